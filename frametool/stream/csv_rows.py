"""Rows of records that are alike as lines of CSV: numbers of results and scalars of records between constant text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.formats.rows.csv import cell, quoted
from frametool.stream.record_rows import LEAF, NAME, PARENT, STAMP_NS, Filling, plain_texts
from frametool.stream.rows import constant, number_spans, spans_of, texts_as_rows, written
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.grammar.result import Style
    from frametool.stream.record_rows import RecordBatch
    from frametool.text.spans import Flags

SPLITTING = np.isin(np.arange(256), [*b'",\\\r\n'])  # a text with one of these is no cell as it is


def merged(
    lines: Sequence[tuple[int, bytes]],
    batches: Sequence[RecordBatch],
    texts: Sequence[Mapping[str, Any]],
    columns: Sequence[str],
    style: Style,
) -> bytes:
    """Return the rows of batches, and lines that are written already, in the order of their places."""
    rows = (_rows(batch, cells, columns, style) for batch, cells in zip(batches, texts, strict=True))
    groups = [(batch.places, spans) for batch, spans in zip(batches, rows, strict=True)]
    return written([*groups, texts_as_rows(lines)] if lines else groups)


def _rows(batch: RecordBatch, cells: Mapping[str, Any], columns: Sequence[str], style: Style) -> list[Spans]:
    """Return the text of the rows of a batch."""
    size, width = len(batch.places), batch.results.shape[1]
    numbers = number_spans(batch.results, style.precision, b"," * width) if width else None
    parts: list[Spans] = []
    waiting = b""
    for name in columns:
        value = cells.get(name, "")
        if isinstance(value, float) and numbers is not None:
            at = batch.marked.numbers[repr(value)]
            made = Spans(numbers.data, numbers.starts[:, at], numbers.ends[:, at] - 1)
        else:
            made = _cells(batch, value, style)
        parts += [constant(waiting, size), made] if waiting else [made]
        waiting = b","
    return [*parts, constant(b"\n", size)]


def _cells(batch: RecordBatch, value: Any, style: Style) -> Spans:
    """Return what replaces a cell with marks in each row."""
    size = len(batch.places)
    if value == STAMP_NS and batch.stamps_ns is not None:
        return spans_of([b"%d" % stamp for stamp in batch.stamps_ns.tolist()])
    if value in (PARENT, NAME):
        return _words(batch.parents if value == PARENT else batch.names, size)
    if isinstance(value, (dict, list)):
        filling = Filling(batch)
        return spans_of([cell(filling.filled(value, row), style).encode() for row in range(size)])
    leaf = LEAF.fullmatch(value) if isinstance(value, str) else None
    if leaf is None:
        return _words([value], size)
    node, found = batch.leaf(int(leaf[1]))
    is_unclear = _is_split(found) if node.quote else found.data[found.starts] == ord("n")  # it may be null
    if not is_unclear.any():
        return found
    return _words(plain_texts(batch, int(leaf[1])), size)


def _is_split(cells: Spans) -> Flags:
    """Return which cells hold a character for which a cell has quotes, or a scalar an escape."""
    counts = np.concatenate([[0], np.cumsum(SPLITTING[cells.data], dtype=np.int32)])
    found: Flags = counts[cells.ends] > counts[cells.starts]
    return found


def _words(values: Sequence[Any], size: int) -> Spans:
    """Return plain values as cells, one a row or one for all."""
    known = {value: quoted("" if value is None else str(value)).encode() for value in values}
    return spans_of([known[value] for value in values]) if len(values) == size else constant(known[values[0]], size)
