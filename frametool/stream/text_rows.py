"""Rows of records that are alike as text: lines of CSV or JSON, documents of YAML.

A result of which all that differs is a mark is written once; numbers of results and scalars of records then take the
places of the marks.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.documents import json
from frametool.documents.yaml_writer import quoted as quoted_in_yaml
from frametool.formats.rows.csv import cell, quoted
from frametool.stream.record_rows import LEAF, NAME, PARENT, STAMP_NS, plain_texts
from frametool.stream.rows import constant, number_spans, spans_of
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from frametool.grammar.result import Style
    from frametool.stream.record_rows import RecordBatch


class Syntax(NamedTuple):
    """How scalars are written in a place: quotes around texts, what a text must not hold to pass, and any value."""

    quote: str
    unsafe: bytes
    write: Callable[[Any], str]


LAST_ASCII = 127
CELL = Syntax("", b'",\\\r\n', lambda value: quoted("" if value is None else str(value)))
IN_CELL = Syntax('""', b'"\\', lambda value: json.dump(value).replace('"', '""'))
JSON = Syntax('"', b'"\\', json.dump)
YAML = Syntax('"', bytes(range(128)), lambda value: quoted_in_yaml(value) if type(value) is str else json.dump(value))


def table_rows(batch: RecordBatch, cells: Mapping[str, Any], columns: Iterable[str], style: Style) -> list[Spans]:
    """Return the rows of a batch as lines of CSV; cells: those of the result with marks."""
    parts: list[tuple[str, Syntax]] = []
    exact = style.changed(precision=None, screen=False)
    for at, name in enumerate(columns):
        value = cells.get(name, "")
        parts += [("," * (at > 0) + cell(value, exact), IN_CELL if isinstance(value, (dict, list)) else CELL)]
    return _filled(batch, [*parts, ("\n", CELL)], style)


def document_rows(batch: RecordBatch, text: str, style: Style) -> list[Spans]:
    """Return the rows of a batch as lines of JSON or documents of YAML; text: that of the result with marks."""
    return _filled(batch, [(text, YAML if style.format == "yaml" else JSON)], style)


def _filled(batch: RecordBatch, parts: Sequence[tuple[str, Syntax]], style: Style) -> list[Spans]:
    """Put what the rows have in the places of marks."""
    size, columns = len(batch.places), batch.marked.numbers
    marks = rf"(?<![\w.+-])(?:{'|'.join([*map(re.escape, columns), str(STAMP_NS)])})(?![\w.+-])"
    width = batch.results.shape[1]
    numbers = number_spans(batch.results, style.precision, b"," * width, yaml=style.format == "yaml") if width else None
    found: list[Spans] = []
    waiting = ""
    for text, syntax in parts:
        quote = f"(?:{syntax.quote})?"
        for piece in re.split(f"({marks}|{quote}(?:{LEAF.pattern.replace('(', '(?:')}|{PARENT}|{NAME}){quote})", text):
            mark, around = piece.strip('"'), ""
            if numbers is not None and mark in columns:
                at = columns[mark]
                made = Spans(numbers.data, numbers.starts[:, at], numbers.ends[:, at] - 1)
            elif mark in (PARENT, NAME):
                made = _words(batch.parents if mark == PARENT else batch.names, size, syntax)
            elif mark == str(STAMP_NS) and batch.stamps_ns is not None:
                made = spans_of([b"%d" % stamp for stamp in batch.stamps_ns.tolist()])
            elif leaf := LEAF.fullmatch(mark):
                made, around = _leaf(batch, int(leaf[1]), syntax)
                waiting += around
            else:
                waiting += piece
                continue
            found += [constant(waiting.encode(), size), made] if waiting else [made]
            waiting = around
    return [*found, constant(waiting.encode(), size)] if waiting else found


def _leaf(batch: RecordBatch, at: int, syntax: Syntax) -> tuple[Spans, str]:
    """Return a scalar of the records as it is written in a place, and the quotes around it."""
    node, found = batch.leaf(at)
    is_cell = syntax is CELL
    if node.quote:
        passes = (is_cell or not (found.data > LAST_ASCII).any()) and not _holds(found, syntax.unsafe)
    else:
        passes = batch.cut.template.json or is_cell
        passes = passes and not (is_cell and (found.data[found.starts] == ord("n")).any())  # it may be null
    if passes:
        return found, syntax.quote if node.quote else ""
    return _words(plain_texts(batch, at), len(batch.places), syntax), ""


def _holds(cells: Spans, characters: bytes) -> bool:
    """Return True if any cell holds one of some characters."""
    counts = np.concatenate([[0], np.cumsum(np.isin(cells.data, [*characters]), dtype=np.int32)])
    return bool((counts[cells.ends] > counts[cells.starts]).any())


def _words(values: Sequence[Any], size: int, syntax: Syntax) -> Spans:
    """Return plain values as they are written in a place, one a row or one for all."""
    known = {value: syntax.write(value).encode() for value in values}
    return spans_of([known[value] for value in values]) if len(values) == size else constant(known[values[0]], size)
