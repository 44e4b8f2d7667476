"""Poses and points in blocks to a file of columns of numbers; other columns go along where they have a place."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import ValueInvalid, listing, warn
from frametool.formats import FORMATS
from frametool.formats.column_file import STAMP_NS, Made, OutColumn
from frametool.formats.structured import not_finite
from frametool.geometry import arrays
from frametool.geometry.representations import notation
from frametool.stream.header import XYZ
from frametool.stream.pose_values import texts_of
from frametool.stream.row_layout import POSE, Target
from frametool.text.parse import parse_floats
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.column_file import ColumnWriter
    from frametool.grammar.result import Style
    from frametool.stream.table_poses import RowPoses
    from frametool.text.array_types import Flags

DOUBLE = np.dtype(np.float64)


class ArrayWriter:
    """Write blocks of poses, points or vectors one after the other; `end` yields what comes behind the last.

    The columns are those of the first block: frames where it has names, stamps, numbers, and what is not ours.
    """

    def __init__(self, style: Style, kind: str, extras: Sequence[str] = (), *, placed: bool = True) -> None:
        """Choose the form; kind: pose, point or vector; extras: the numbers beside each; placed: it has a position."""
        self.style = style
        self.kind = kind
        self.extras = tuple(extras)
        self.module: Any = import_module(FORMATS[style.form].writer)
        self.has_texts = getattr(self.module, "HOLDS_TEXTS", False)
        forms = tuple((each, style.in_degrees(each)) for each in style.notations or (notation("quaternion"),))
        whole = placed and len(forms) == 1 and forms[0][0].representation.whole is not None
        self.target = Target(None if whole or not placed else 1.0, forms, style.keep_sign, whole)
        if kind != POSE:
            self.target = Target(1.0, ())
        self.placed = placed
        self.columns: list[OutColumn] = []
        self.left_out: list[str] = []
        self.writer: ColumnWriter | None = None

    def of_block(self, block: RowPoses) -> bytes | memoryview:
        """Return what is written of a block; numbers are metres and x y z w, nan in rows without a result."""
        if not len(block.numbers):
            return b""
        made = self._made(block)
        if self.writer is None:
            self._begin(made)
        assert self.writer is not None  # noqa: S101 - for the types
        return self.writer.of_rows(None, None, [made[column.name] for column in self.columns])

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last block."""
        if self.writer is None:
            self._begin({name: Made(np.empty(0)) for name in self._numbers()})
        assert self.writer is not None  # noqa: S101 - for the types
        ended = self.writer.end()
        yield from (ended,) if isinstance(ended, bytes) else ended
        if self.left_out:
            warn(f"{self.style.form}: {listing(self.left_out)} left out: it holds numbers")

    def _begin(self, made: dict[str, Made]) -> None:
        """Choose the columns."""
        for name, each in made.items():
            kind = each.values.dtype if isinstance(each.values, np.ndarray) else None
            if kind is not None or self.has_texts:
                self.columns.append(OutColumn(name, kind))
            else:
                self.left_out.append(name)
        self.writer = self.module.create(self.columns, None, self.style)

    def _numbers(self) -> list[str]:
        """Name the numbers of a result."""
        position = list(XYZ) if self.target.unit is not None else []
        return [*position, *self.target.names, *self.extras]

    def _made(self, block: RowPoses) -> dict[str, Made]:
        """Return the columns of a block by name."""
        size = len(block.numbers)
        made: dict[str, Made] = {}
        names = (("name", block.names), ("parent", block.parents)) if self.kind == POSE else (("frame", block.parents),)
        for name, given in names:
            if any(given):
                made[name] = Made([each or "" for each in given] * (1 if len(given) == size else size))
        for name, column in zip(self._numbers(), self._written(block), strict=True):
            made[name] = Made(column, not_finite(column))
        if block.stamps_ns is not None:
            made["stamp_ns"] = Made(block.stamps_ns.astype(STAMP_NS))
        for name, cells in block.extras.items():
            made.setdefault(name, self._extra(name, cells))
        return made

    def _written(self, block: RowPoses) -> list[Any]:
        """Return the numbers of the results in the notations that are written."""
        columns = [np.ascontiguousarray(column) for column in block.numbers.T]
        if self.kind == POSE and not self.placed:
            columns = [columns[0] * 0.0] * 3 + columns
        own = 7 if self.kind == POSE else 3
        with np.errstate(invalid="ignore"):
            return [*self.target.numbers(tuple(columns[:own]), arrays), *columns[own:]]

    def _extra(self, name: str, cells: Any) -> Made:
        """Return a column that is not ours: as it is, or of cells as numbers if all of the first block are."""
        if not isinstance(cells, Spans):
            return Made(cells)
        if self.has_texts:  # it types them by itself
            return Made(texts_of(cells))
        known = next((column.kind for column in self.columns if column.name == name), DOUBLE)
        if name in self.left_out or known is None:
            return Made(texts_of(cells))
        numbers, bad = parse_floats(cells)
        empty = cells.starts == cells.ends
        absent: Flags | None = empty if empty.any() else None
        if set(bad.tolist()) <= set(np.flatnonzero(empty).tolist()):
            numbers[empty] = np.nan
            return Made(numbers, absent)
        if self.writer is not None:
            text = texts_of(Spans(cells.data, cells.starts[bad[:1]], cells.ends[bad[:1]]))[0]
            raise ValueInvalid(f"column {name}: {text!r} is no number as those before; write csv, or drop the column")
        return Made(texts_of(cells))
