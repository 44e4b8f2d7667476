"""Write columns of numbers and texts into files of columns; each column gets one type that fits all its cells.

Cells of text and values of records wait until `sizes.TYPED` rows are known, from which the types are chosen.  Columns
that a format cannot hold are left out, with one warning.
"""

from __future__ import annotations

import re
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool import sizes
from frametool.documents.source import Verbatim
from frametool.documents.writers import dump_json
from frametool.errors import ValueInvalid, listing, shown, warn
from frametool.formats.rows.column_file import STAMP_NS, WHOLE, Made, OutColumn, not_finite
from frametool.formats.table import FORMATS
from frametool.geometry import arrays
from frametool.grammar.result import in_one_list
from frametool.rows.batch import NO_STAMP, is_typed, objects, plain_cells, text_of, texts_of
from frametool.rows.shapes import POSE, SIX, six_names
from frametool.rows.sinks.as_rows import PoseWriter
from frametool.text.parse import parse_floats
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from frametool.formats.rows.column_file import ColumnWriter, Kind
    from frametool.grammar.result import Style
    from frametool.rows.batch import Cells, RowPoses

SPARE = 64  # least number of characters per text if more rows may follow
DOUBLE, FLAG = np.dtype(np.float64), np.dtype(np.bool_)
EXACT = 1 << 53  # smaller integers are exact as floats
LIMITS, SAFE = np.iinfo(np.int64), 18  # an integer with so many digits is within LIMITS
# cells of each type, in canonical spelling only: 007, +5 and numbers that would lose digits remain text
PATTERNS = {
    np.dtype(np.int64): r"-?(?:0|[1-9][0-9]{0,18})",
    DOUBLE: r"-?(?:0|[1-9][0-9]{0,14})(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?",
    FLAG: "true|false",
}
TYPE_NAMES = {None: "string", DOUBLE: "double"}
READS: dict[Kind, Any] = {np.dtype(np.int64): int, DOUBLE: float, FLAG: "true".__eq__}


def fit(texts: Sequence[str], kind: Kind) -> bool:
    """Return True if all cells are spelled as numbers or booleans of a type."""
    if not all(map(re.compile(PATTERNS[kind]).fullmatch, texts)):
        return False
    return kind.kind not in WHOLE or all(LIMITS.min <= int(text) <= LIMITS.max for text in texts if len(text) > SAFE)


class ColumnsWriter:
    """Write blocks of columns into a file of a format; the columns are those of the first rows."""

    def __init__(self, style: Style, module: Any = None) -> None:
        """Choose the format; module: has the `create` to use instead of that of the format's own module."""
        self.style = style
        self.module: Any = module or import_module(FORMATS[style.format].writer)
        self.has_nulls: bool = getattr(self.module, "NULLS", False)
        self.waiting: list[tuple[int, Mapping[str, Made]]] = []
        self.columns: list[OutColumn] = []
        self.left_out: dict[str, str] = {}
        self.writer: ColumnWriter | None = None

    def of_columns(self, size: int, made: Mapping[str, Made]) -> bytes:
        """Add a block of `size` rows; return the bytes that can be written now, perhaps none."""
        self.waiting.append((size, made))
        if self.writer is None:
            is_open = any(not is_typed(each.values) for each in made.values())
            if not size or (is_open and sum(count for count, _ in self.waiting) < sizes.TYPED):
                return b""
        self.writer = self.writer or self._begin(is_all=False)
        return b"".join(self._written(self.writer))

    def end(self) -> Iterator[bytes]:
        """Yield the bytes of waiting blocks and the end of the file; warn about columns that were left out."""
        self.writer = self.writer or self._begin(is_all=True)
        yield from self._written(self.writer)
        yield from self.writer.end()
        for reason in dict.fromkeys(self.left_out.values()):
            names = listing(name for name, why in self.left_out.items() if why == reason)
            warn(f"{self.style.format}: {names} left out: {reason}")

    def _written(self, writer: ColumnWriter) -> Iterator[bytes]:
        """Yield the bytes of the waiting blocks."""
        known = {column.name for column in self.columns}
        for size, made in self.waiting:
            for name in made.keys() - known:
                self.left_out.setdefault(name, "the first rows do not have it")
            if size:
                none = Made(objects([None] * size))
                typed = [self._typed(column, made.get(column.name, none)) for column in self.columns]
                yield bytes(writer.of_rows(None, None, typed))
        self.waiting = []

    def _begin(self, *, is_all: bool) -> ColumnWriter:
        """Choose the columns and their types and open the file; is_all: no more rows follow."""
        blocks = [made for size, made in self.waiting if size] or [made for _, made in self.waiting[-1:]]
        for name in dict.fromkeys(name for made in blocks for name in made):
            parts = [made[name].values for made in blocks if name in made]
            column = self._column(name, parts, has_gaps=len(parts) < len(blocks))
            if column.kind is None and not is_all:
                column = column._replace(longest=max(SPARE, 2 * column.longest))
            reason = self._misfit(column)
            # readers of all formats know doubles
            as_cells = not ("texts" in FORMATS[self.style.format].writes or all(map(is_typed, parts)))
            if (reason or as_cells) and _is_exact(column.kind, parts):
                column = column._replace(kind=DOUBLE)
                reason = self._misfit(column)
            if reason:
                self.left_out[name] = reason
            else:
                self.columns.append(column)
        if not self.columns:
            raise ValueInvalid(f"{self.style.format} has no place for any column of these: {listing(self.left_out)}")
        texts = {name for size, made in self.waiting for name in made if size and isinstance(made[name].values, Spans)}
        if (named := [column for column in self.columns if column.name in texts]) and self.has_nulls:
            types = ", ".join(f"{each.name} {TYPE_NAMES.get(each.kind, each.kind)}" for each in named)
            warn(f"types of other columns, by their cells: {types}")
        writer: ColumnWriter = self.module.create(self.columns, None, self.style)
        return writer

    def _misfit(self, column: OutColumn) -> str:
        """Return the reason why the format cannot hold a column; "" if it can."""
        if column.kind is None and "texts" not in FORMATS[self.style.format].writes:
            return "it holds numbers"
        reason: str = self.module.misfit(column) if hasattr(self.module, "misfit") else ""
        return reason

    def _column(self, name: str, parts: Sequence[Cells], *, has_gaps: bool) -> OutColumn:
        """Choose the type of a column from its cells."""
        if parts and all(map(is_typed, parts)):
            own: Kind = parts[0].dtype.newbyteorder("=")  # type: ignore[union-attr]
            return OutColumn(name, DOUBLE if own.kind == "f" and own.itemsize > DOUBLE.itemsize else own)
        values = [value for part in parts for value in plain_cells(part)]
        there = [value for value in values if value is not None and value != ""]
        if there and all(isinstance(value, Verbatim) for value in there):
            kind = next((kind for kind in PATTERNS if fit(there, kind)), None)
            if kind != DOUBLE and not self.has_nulls and (has_gaps or len(there) < len(values)):
                kind = DOUBLE if _is_exact(kind, parts) else None
            if kind is not None:
                return OutColumn(name, kind)
        is_json = any(isinstance(value, (dict, list)) for value in there)
        longest = max((len(dump_json(value) if is_json else text_of(value)) for value in there), default=1)
        return OutColumn(name, None, None, longest, is_json)

    def _typed(self, column: OutColumn, made: Made) -> Made:
        """Return a column of a block converted to its type; raises ValueInvalid for a cell that does not fit."""
        cells, kind = made.values, column.kind
        if kind is None:
            if not column.is_json:
                return Made(texts_of(cells))
            return Made(["" if value is None else dump_json(value) for value in plain_cells(cells)])
        if is_typed(cells):
            if kind == DOUBLE and not _is_exact(cells.dtype, [cells]) and cells.dtype.kind in WHOLE:
                raise self._another(column, str(max(cells.tolist(), key=abs)))
            return Made(cells.astype(kind, copy=False), made.absent)
        if kind != FLAG and isinstance(cells, Spans):
            numbers, bad = parse_floats(cells)
            empty = cells.starts == cells.ends
            if kind == DOUBLE and empty[bad].all():
                return Made(numbers, empty if empty.any() else None)
            if not len(bad) and (np.rint(numbers) == numbers).all() and abs(numbers).max() < EXACT:
                return Made(numbers.astype(kind))
        values = plain_cells(cells)
        absent = np.array([value is None for value in values], np.bool_)
        wrong = [value for value in values if value is not None and not fit([text_of(value)], kind)]
        if wrong or (absent.any() and not self.has_nulls and kind != DOUBLE):
            raise self._another(column, text_of(wrong[0]) if wrong else "")
        nothing = np.nan if kind == DOUBLE else 0
        found = np.array([nothing if value is None else READS[kind](value) for value in values], kind)
        return Made(found, absent if absent.any() else None)

    def _another(self, column: OutColumn, text: str) -> ValueInvalid:
        found = f"column {shown(column.name)}: {shown(text)} is no {column.kind}, as all cells of the first rows are"
        return ValueInvalid(f"{found}; -f csv keeps it as it is")


def _is_exact(kind: Kind | None, parts: Sequence[Any]) -> bool:
    """Return True if a column holds integers that are exact as floats."""
    if kind is None or kind.kind not in WHOLE:
        return False
    numbers: list[Any] = []
    for part in parts:
        known = plain_cells(part) if not (is_typed(part) and part.size) else [part.min(), part.max()]
        numbers += [int(each) for each in known if each is not None]
    return all(-EXACT < number < EXACT for number in numbers)  # abs() of the least int64 overflows


class ArrayWriter(PoseWriter):
    """Write blocks of poses, points, vectors, twists or wrenches as columns.

    In this order: names of frames if there are any, numbers, stamps, other columns.
    """

    def __init__(self, style: Style, first: RowPoses) -> None:
        """Choose the format; the first block determines the kind of all rows."""
        super().__init__(style, first)
        self.file = ColumnsWriter(style)
        self.names = [*self.target.position_columns, *self.target.names]
        self.names = [*(six_names(self.kind) if self.kind in SIX else self.names), *self.extras]
        self.file.of_columns(0, {name: Made(np.empty(0)) for name in self.names})  # the columns of a file without rows

    def of_block(self, block: RowPoses) -> bytes:
        """Return the bytes of a block; its numbers are metres and quaternions x y z w, nan in rows without a result."""
        self.settle(block)
        return self.file.of_columns(len(block.numbers), self._made(block))

    def end(self) -> Iterator[bytes]:
        """Yield the rest of the file."""
        return self.file.end()

    def _made(self, block: RowPoses) -> dict[str, Made]:
        """Return the columns of a block by name, with rotations in the notations of the style."""
        size, made, place = len(block.numbers), dict[str, Made](), self.target.place
        for name, frames in (("name", block.names), ("parent" if self.kind == POSE else "frame", block.parents)):
            if any(frames):
                made[name] = Made(objects(block.for_each(frames)))
        columns = self.columns(block)
        own = len(columns) - len(self.extras)
        with np.errstate(invalid="ignore"):
            numbers = self.target.written(block.unmoved(columns[:own]), arrays)
        for name, each in zip(self.names, (*numbers, *columns[own:]), strict=True):
            # nan in rows without a result; the last row of a matrix is four plain numbers
            column = each + columns[0] * 0.0 if isinstance(each, float) else each
            made[name] = Made(column, not_finite(column))
        if place is not None:
            for at, words in place.words.items():
                codes = np.nan_to_num(made[place.columns[at]].values).tolist()
                made[place.columns[at]] = Made(objects([words[int(code)] for code in codes]))
            if self.target.notations:
                made["axes"] = Made(objects([place.axes] * size))
        if block.stamps_ns is not None:
            none = block.stamps_ns == NO_STAMP
            made["stamp_ns"] = Made(block.stamps_ns.astype(STAMP_NS), none if none.any() else None)
        for name, cells in block.extras.items():
            lists = plain_cells(cells) if name == "covariance" and not isinstance(cells, Spans) else []
            values = [each if each is None else in_one_list(each) or [] for each in lists]
            sizes = {len(each) for each in values if each is not None}
            if sizes not in ({36}, {9}):
                made.setdefault(name, Made(cells))
                continue
            from frametool.grammar.covariance import columns as names_of  # c11, c12, ..

            width = sizes.pop()
            rows = np.array([[np.nan] * width if each is None else each for each in values], np.float64)
            for entry, column in zip(names_of(width), rows.T, strict=True):
                made.setdefault(entry, Made(column, not_finite(column)))
        return made
