"""The frames that rows of a table name: the one a row is given in, what it is the pose of, and those of its result."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import FrametoolError
from frametool.stream.output_columns import NAME, PARENT, quoted
from frametool.text.cells import without_quotes
from frametool.text.spans import MARGIN, Spans, framed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.stream.output_columns import Layout
    from frametool.stream.request import Request
    from frametool.stream.table import Table
    from frametool.text.array_types import Ints
    from frametool.text.cells import Cells

    Names = tuple[str | None, str | None]  # parent, name
    Texts = tuple[str, str]
    Rename = Callable[[str | None, str | None], Names]

COUNTER = "frame"  # such a column often counts pictures


class BlockNames(NamedTuple):
    """The names of a block's rows.

    frames: the one each row is given in, or for look-ups the two, parted by NUL
    spans: the names of the results, by role
    bad: rows whose names do not fit: column and reason
    lost: the first row whose result cannot name a frame, and that frame
    """

    frames: Sequence[str | None] = ()
    spans: tuple[Spans, ...] = ()
    bad: Mapping[int, tuple[str, str | FrametoolError]] = MappingProxyType({})
    lost: Sequence[tuple[int, str]] = ()


class Naming:
    """What a run does with the names in a table; remembers the frame of the rows before."""

    def __init__(self, table: Table, layout: Layout, request: Request) -> None:
        """Take from the request what it does to names."""
        self.layout = layout
        self.places: tuple[int | None, int | None] = (None, None)
        if request.poses and layout.frames:
            self.places = layout.frames[0], layout.name
        elif request.poses:
            self.places = None, layout.name
        self.column = next((table.name(place) for place in self.places if place is not None), "")
        may_count = layout.frames and table.name(layout.frames[0]) == COUNTER and COUNTER not in request.frames
        self.counts = request.counts if may_count else None
        self.rename = rename_of(request)
        self.consecutive = request.operation.looks_back
        self.before: str | None = None

    def of_block(self, cells: Cells) -> BlockNames:
        """Read the names of a block's rows and name the results."""
        if self.places == (None, None):
            columns = [_coded(cells, place) for place in self.layout.frames]
            texts = [[column.texts[code] for code in column.codes.tolist()] for column in columns]
            return BlockNames(["\0".join(names) for names in zip(*texts, strict=True)] if texts else ())
        parents, names = (_coded(cells, place) for place in self.places)
        size = len(names.texts)
        found, of_row = np.unique(parents.codes * size + names.codes, return_inverse=True)
        pairs = [(parents.texts[code // size], names.texts[code % size]) for code in found.tolist()]
        results = [self._result(*pair) for pair in pairs]
        bad: dict[int, tuple[str, str | FrametoolError]] = {}
        for row in np.flatnonzero(np.array([isinstance(each, FrametoolError) for each in results])[of_row]).tolist():
            bad[row] = self.column, results[of_row[row]]
        emptied = np.array([self._loses(*each) for each in zip(pairs, results, strict=True)])[of_row]
        lost = [
            (row, self._lost(pairs[of_row[row]], results[of_row[row]])) for row in np.flatnonzero(emptied)[:1].tolist()
        ]
        if self.consecutive:
            bad |= self._breaks([parents.texts[code] for code in parents.codes.tolist()])
        frames = [None if not text or self._is_counter(text) else text for text in parents.texts]
        spans = tuple(
            self._spans(cells, role, pairs, [_named(*each) for each in zip(results, pairs, strict=True)], of_row)
            for role in (PARENT, NAME)
        )
        return BlockNames([frames[code] for code in parents.codes.tolist()], spans, bad, lost)

    def _is_counter(self, name: str) -> bool:
        return self.counts is not None and self.counts(name)

    def _breaks(self, parents: Sequence[str]) -> dict[int, tuple[str, str]]:
        """Find the rows that are given in another frame than the first."""
        if self.before is None and parents:
            self.before = parents[0]
        reason = f"given in another frame than {self.before!r}, as the rows before are"
        return {row: (self.column, reason) for row, parent in enumerate(parents) if parent != self.before}

    def _result(self, parent: str, name: str) -> Texts | FrametoolError:
        """Return the texts of a result's names; a counter stays, and what is not known is left empty."""
        if self.rename is None:
            return parent, name
        counter = self._is_counter(parent)
        try:
            new = self.rename(None if counter else parent or None, name or None)
        except FrametoolError as error:
            return error
        return parent if counter else new[0] or "", new[1] or ""

    def _loses(self, pair: Texts, result: Texts | FrametoolError) -> bool:
        """Tell whether a cell that named a frame is empty in the result."""
        return bool(self._lost(pair, result))

    def _lost(self, pair: Texts, result: Texts | FrametoolError) -> str:
        """Return the frame that a cell named and the result does not; "" if there is none."""
        named = zip(self.places, pair, _named(result, pair), strict=True)
        return next((old for place, old, new in named if place is not None and old and not new), "")

    def _spans(
        self, cells: Cells, role: int, pairs: Sequence[Texts], results: Sequence[Texts], of_row: Ints
    ) -> Spans:
        """Write names as cells; one that does not change stays as it is written."""
        place = self.places[role]
        if place is None:
            return Spans(cells.data, of_row, of_row)
        texts = [quoted(result[role], self.layout.delimiter) for result in results]
        data = framed(b"".join(texts))
        lengths = np.array([len(text) for text in texts], np.int64)
        ends = np.cumsum(lengths) + MARGIN
        starts, ends = (ends - lengths)[of_row], ends[of_row]
        same = np.array([pair[role] == result[role] for pair, result in zip(pairs, results, strict=True)])[of_row]
        if same.any():
            data = np.concatenate([data, cells.data])
            starts = np.where(same, cells.starts[:, place] + len(data) - len(cells.data), starts)
            ends = np.where(same, cells.ends[:, place] + len(data) - len(cells.data), ends)
        return Spans(data, starts, ends)


def _named(result: Texts | FrametoolError, pair: Texts) -> Texts:
    return pair if isinstance(result, FrametoolError) else result


def rename_of(request: Request) -> Rename | None:
    """Return what an operation does to the names of a row; None where they stay."""
    if request.rename is not None:
        return request.rename
    if request.operation.moves:
        return lambda _parent, name: (request.told, name)
    if request.operation.looks_back:
        return lambda _parent, name: (name, name)
    return (lambda _parent, _name: (None, None)) if request.operation.of == "pair" else None


class Coded(NamedTuple):
    """A column of texts as the distinct ones and the number of each row's."""

    texts: Sequence[str]
    codes: Ints


def _coded(cells: Cells, place: int | None) -> Coded:
    """Read the texts of a column; where all are the same, as frames often are, that is one text."""
    rows = len(cells.rows)
    if place is None or not rows:
        return Coded([""], np.zeros(rows, np.int64))
    return coded(cells.column(place))


def coded(cells: Spans) -> Coded:
    """Read cells (n,), not none, as texts."""
    column, rows = without_quotes(cells), len(cells.starts)
    if _is_constant(column):
        return Coded([_text(column.text(0))], np.zeros(rows, np.int64))
    data, known = column.data.tobytes(), dict[bytes, int]()
    spans = zip(column.starts.tolist(), column.ends.tolist(), strict=True)
    codes = np.fromiter((known.setdefault(data[start:end], len(known)) for start, end in spans), np.int64, rows)
    return Coded([_text(each) for each in known], codes)


def _text(cell: bytes) -> str:
    return cell.decode("utf-8", "replace").strip().replace('""', '"')


def _is_constant(column: Spans) -> bool:
    """Tell whether all cells hold the same bytes."""
    length = int(column.ends[0] - column.starts[0])
    if length > MARGIN or (column.ends - column.starts != length).any():
        return False
    first = column.data[column.starts[0] : column.ends[0]]
    return all(bool((column.data[column.starts + offset] == byte).all()) for offset, byte in enumerate(first))
