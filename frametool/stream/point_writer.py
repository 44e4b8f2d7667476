"""Points and vectors in blocks to the text of a form that is not their table's."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import ValueInvalid
from frametool.formats import FORMATS
from frametool.stream.pose_values import float_spans, kept, plain_cell, spans_of, texts_of
from frametool.stream.rows import number_spans
from frametool.text.csv_line import quoted
from frametool.text.spans import MARGIN, Spans, framed, join

if TYPE_CHECKING:
    from frametool.grammar.result import Style
    from frametool.stream.table_poses import RowPoses

BEGUN_WITH = 8  # rows that are written one by one, the header with them


class PointWriter:
    """Write blocks of points or vectors one after the other, as the form writes single ones."""

    def __init__(self, style: Style, kind: str) -> None:
        """Choose the form; kind: `point` or `vector`.  Raises ValueInvalid for a form that holds poses only."""
        if "points" not in FORMATS[style.form].writes:
            raise ValueInvalid(f"{style.form} holds poses; a {kind} has no rotation")
        self.style = style
        self.kind = kind
        self.module: Any = import_module(FORMATS[style.form].writer)
        self.first: dict[str, Any] | None = None

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block; numbers are metres."""
        if self.first is not None and (rows := self._in_bulk(block)) is not None:
            return rows
        if self.first is None and len(block.numbers) > BEGUN_WITH:
            count = len(block.numbers)
            begun = self.of_block(kept(block, slice(0, BEGUN_WITH)))
            return begun + self.of_block(kept(block, slice(BEGUN_WITH, count)))
        records = self._records(block)
        if not records:
            return b""
        text: str
        if self.first is None:
            self.first = records[0]
            text = self.module.write_points(records, self.style)
            return text.encode()
        known = self.module.write_points([self.first], self.style)
        text = self.module.write_points([self.first, *records], self.style)
        return text[len(known) :].encode()

    def end(self) -> bytes:
        """Return what comes behind the last: nothing."""
        return b""

    def _in_bulk(self, block: RowPoses) -> bytes | None:
        """Return the rows of CSV for a block whose cells are all numbers; None for what is written row by row."""
        size, numbers = len(block.numbers), np.ascontiguousarray(block.numbers)
        if self.style.form != "csv" or not size or len(block.parents) != 1 or not np.isfinite(numbers).all():
            return None
        columns = [] if block.parents[0] is None else [spans_of([quoted(block.parents[0]).encode()] * size)]
        columns.append(number_spans(numbers, self.style.precision, b",,\0"))
        columns[-1].ends[:, 2] -= 1
        if block.stamps_ns is not None:
            columns.append(spans_of([b"%d" % stamp for stamp in block.stamps_ns.tolist()]))
        for cells in block.extras.values():
            if isinstance(cells, Spans) or cells.dtype.kind not in "fiu" or cells.ndim != 1:
                return None
            is_float = cells.dtype.kind == "f"
            if is_float and not np.isfinite(cells).all():
                return None
            columns.append(float_spans(cells) if is_float else spans_of([b"%d" % cell for cell in cells.tolist()]))
        parts = [part for column in columns for part in (_constant(b",", size), column)]
        return join([*parts[1:], _constant(b"\n", size)])

    def _records(self, block: RowPoses) -> list[dict[str, Any]]:
        size = len(block.numbers)
        frames = block.parents if len(block.parents) == size else list(block.parents) * size
        others = {name: [plain_cell(text) for text in texts_of(cells)] for name, cells in block.extras.items()}
        stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
        records = []
        for at, numbers in enumerate(block.numbers.tolist()):
            record: dict[str, Any] = {"frame": frames[at]} if frames[at] else {}
            record[self.kind] = numbers
            if stamps is not None:
                record["stamp_ns"] = stamps[at]
            records.append(record | {name: texts[at] for name, texts in others.items()})
        return records


def _constant(text: bytes, size: int) -> Spans:
    starts = np.full(size, MARGIN, np.int64)
    return Spans(framed(text), starts, starts + len(text))
