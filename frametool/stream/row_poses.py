"""The rows of a table as blocks of poses: for trees, and for results in another form than the table's.

Also turns single results into such blocks and back, and columns of texts into spans and back.
"""

from __future__ import annotations

import re
from math import isnan
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from frametool.documents.json import JSON_NUMBER, dump
from frametool.documents.source import Verbatim
from frametool.errors import ValueInvalid
from frametool.grammar.names import in_nanoseconds, stamp_places
from frametool.grammar.pose import Pose
from frametool.grammar.result import NoResult, Result
from frametool.stream.evaluate import Run, State
from frametool.stream.faults import NULL, Fault
from frametool.stream.header import listed
from frametool.stream.layout import NAMED, Kept
from frametool.stream.row_layout import PARTS, POSE, Shape
from frametool.stream.rows import chosen
from frametool.stream.run import notes_of
from frametool.stream.stamp_columns import NOWHERE, read_stamps
from frametool.stream.table import UNCLOSED, Naming, cells_of, coded, rename_of, table_block
from frametool.stream.table_plan import plan_table
from frametool.text.cells import torn_record, without_quotes
from frametool.text.csv_line import quoted
from frametool.text.spans import MARGIN, Spans, framed
from frametool.text.write import rounded_to_single, shortest_spans

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from frametool.stream.faults import RowNote
    from frametool.stream.layout import Layout
    from frametool.stream.request import Request
    from frametool.stream.rows import Block
    from frametool.stream.table_stream import Begun
    from frametool.text.spans import Floats, Ints
    Cells: TypeAlias = Spans | NDArray[Any]

NO_STAMP = np.iinfo(np.int64).min  # of a bad row that is kept


class RowPoses(NamedTuple):
    """What became of the rows of a block: the good ones, in their order.

    numbers: (n, k) the results, position first; nan in a row without one that is kept
    stamps_ns: (n,) or None where rows have none; NO_STAMP in a row whose own is none
    lines: (n,) from 0
    parents, names: one a row, one for all, or none
    extras: columns that are not ours, by name: cells of text, or numbers as they are
    given: the frames that the rows of the input are given in
    """

    numbers: Floats
    stamps_ns: Ints | None
    lines: Ints
    parents: Sequence[str | None]
    names: Sequence[str | None]
    extras: Mapping[str, Cells]
    given: Sequence[str | None] = ()


class TablePoses:
    """Turn one block of a table after the other into poses; the rows that are bad are listed in `faults`.

    faults, notes: of the last block, lines from 0
    rows, mended: how many rows there were, and rotations that were normalised; off: how far the worst one was
    """

    def __init__(self, begun: Begun, form: str, request: Request, source: str) -> None:
        """Plan the rows; the request's notations say which numbers come out.

        Raises FormatError for a table without a pose, Misused for a request that does not fit.
        """
        self.table = begun.table
        self.form = form
        self.plan, layout = plan_table(self.table, request._replace(all_numbers=True), source)
        self.shape = self.plan.shapes[0] if self.plan.shapes else Shape(POSE)
        named = request.for_kind(self.shape.kind)
        self.naming = Naming(self.table, layout, named)
        rename = rename_of(named)
        self.unnamed = (None, None) if rename is None else rename(None, None)
        self.roles = [role for role, place in enumerate(self.naming.places) if place is not None]
        if layout.time is None:
            time, below = stamp_places(self.table.names)
            if not self.table.names and not request.columns and min(layout.places, default=0) == 1:
                time = 0  # what stands before the numbers that --from speaks of
            layout = layout._replace(time=None if time in layout.frames else time, below=below)
        self.stamp_at = layout.time
        used = {layout.time, layout.below, *layout.places, *self.naming.places}
        self.kept = [place for place in range(self.table.width) if place not in used]
        self.layout = self._with_stretches(layout)
        self.state = State()
        self.faults: list[Fault] = []
        self.notes: list[RowNote] = []
        self.rows, self.mended, self.off = 0, 0, 0.0

    def _with_stretches(self, layout: Layout) -> Layout:
        """Ask for the stamps, the columns that are not ours, one by one, and the names of the results."""
        stretches = [(place, place, "cell", "cell") for place in self.kept]
        stretches += [(role, role, NAMED, NAMED) for role in self.roles]
        columns = tuple(map(Kept, self.kept))  # of a row that has too few cells
        return layout._replace(stretches=tuple(stretches), pieces=(), columns=columns)

    @property
    def columns(self) -> str:
        """List the columns there are."""
        return listed(self.table.names or ("columns without names",))

    def of_block(self, text: bytes) -> RowPoses:
        """Return the poses of a block, and leave what is wrong with other rows in `faults`."""
        torn = torn_record(text, self.table.delimiter) if self.table.delimiter else None
        body = text if torn is None else text[:torn]
        nulls = self.plan.on_error == NULL
        block = table_block(self.table, self.layout, body, self.naming, nulls=nulls)
        stamps, late = self._stamps(block.stamps)
        run = Run(self.plan, block._replace(bad={**late, **block.bad}), self.state)
        self.faults = run.faults()
        if torn is not None:
            self.faults.append(Fault(text.count(b"\n", 0, torn), "", UNCLOSED, final=True))
        self.mended += len(run.mended)
        self.off = max(self.off, run.off)
        self.notes = notes_of(run, block)
        self.rows += len(block.places) + len(block.broken)
        rows, results, lines = run.rows, run.results, block.places
        if nulls and self.faults:
            block, rows, results, stamps = self._with_nulls(block, run, stamps)
            lines = block.places
        same = rows is run.rows and len(rows) == run.count
        parts = block.parts if same else [chosen(part, rows) for part in block.parts]
        texts = {self.table.name(place): part for place, part in zip(self.kept, parts, strict=False)}
        names: list[Sequence[str | None]] = [[name] for name in self.unnamed]
        for role, part in zip(self.roles, parts[len(self.kept) :], strict=True):
            names[role] = _texts(part)
        lines = lines[rows]
        if b'"' in body and not nulls:
            lines = np.array([block.line_of(row) for row in rows.tolist()], np.int64)
        return RowPoses(
            results, None if stamps is None else stamps[rows], lines, names[0], names[1], texts, block.frames
        )

    def _with_nulls(self, block: Block, run: Run, stamps: Ints | None) -> tuple[Block, Ints, Floats, Ints | None]:
        """Return the rows with the bad ones among them, without results; what has too few cells comes at its place."""
        more = len(block.broken)
        results = np.full((run.count + more, run.results.shape[1]), np.nan)
        results[run.rows] = run.results
        places = np.concatenate([block.places, np.array([each.place for each in block.broken], np.int64)])
        cells = [cells_of(each.null_row, self.table.delimiter) for each in block.broken]
        parts = []
        for at, part in enumerate(block.parts):
            added = spans_of([row[at] if at < min(len(row), len(self.kept)) else b"" for row in cells])
            starts, ends = (np.concatenate([part[side], added[side] + len(part.data)]) for side in (1, 2))
            parts.append(Spans(np.concatenate([part.data, added.data]), starts, ends))
        if stamps is not None:
            stamps = np.concatenate([stamps, np.full(more, NO_STAMP)])
        there = {*run.rows.tolist(), *run.reasons, *range(run.count, run.count + more)}  # not the first of velocities
        rows = np.array(sorted(there, key=places.__getitem__), np.int64)
        return block._replace(places=places, parts=parts), rows, results[rows], stamps

    def _stamps(self, cells: Sequence[tuple[Spans, ...]]) -> tuple[Ints | None, dict[int, tuple[str, str]]]:
        """Read the stamps of a block; return them, and which rows have none that can be read."""
        if self.stamp_at is None or not cells:
            return None, {}
        name = self.table.name(self.stamp_at)
        times, reasons = read_stamps(cells[0], in_ns=in_nanoseconds(name))
        times[list(reasons)] = NO_STAMP
        return times, {row: (name, reason) for row, reason in reasons.items()}


def _texts(part: Spans) -> Sequence[str | None]:
    """Return names, one for all rows where all are the same."""
    if not len(part.starts):
        return [None]
    texts, codes = coded(part)
    return [texts[0] or None] if len(texts) == 1 else [texts[code] or None for code in codes.tolist()]


def first_of(block: RowPoses) -> RowPoses:
    """Return the first pose of a block."""
    return kept(block, slice(0, 1))


def kept(block: RowPoses, rows: slice | Ints) -> RowPoses:
    """Return some poses of a block."""
    at = np.arange(len(block.numbers))[rows].tolist()
    parents, names = (
        [each[row] for row in at] if len(each) == len(block.numbers) else each for each in (block.parents, block.names)
    )
    return block._replace(
        numbers=block.numbers[rows],
        stamps_ns=None if block.stamps_ns is None else block.stamps_ns[rows],
        lines=block.lines[rows],
        parents=parents,
        names=names,
        extras={name: cells_at(each, rows) for name, each in block.extras.items()},
    )


def cells_at(cells: Cells, rows: slice | Ints) -> Cells:
    """Return some cells of a column."""
    return Spans(cells.data, cells.starts[rows], cells.ends[rows]) if isinstance(cells, Spans) else cells[rows]


def block_of(results: Sequence[Result]) -> RowPoses:
    """Return results as a block of poses; raises ValueInvalid for one without a rotation."""
    if any(result.pose.rotation is None for result in results):
        raise ValueInvalid("a trajectory holds poses; a point has no rotation")
    stamps = [result.extras.get("stamp_ns") for result in results]
    if 0 < stamps.count(None) < len(stamps):
        raise ValueInvalid("some poses have a stamp and some have none; add it, or leave it out of all")
    return RowPoses(
        np.array([result.pose.components for result in results]),
        None if None in stamps else np.array(stamps, np.int64),
        np.arange(len(results)),
        [result.pose.parent for result in results],
        [result.pose.name for result in results],
        _extras_of([result.extras for result in results]),
    )


def block_of_points(records: Sequence[dict[str, Any]]) -> RowPoses:
    """Return mappings of points or vectors as a block; raises ValueInvalid for what is neither."""
    kind = next((kind for kind in ("point", "vector") if records and kind in records[0]), "point")
    rows = [_coordinates(record, kind) for record in records]
    stamps = [record.get("stamp_ns") for record in records]
    timed = all(type(stamp) is int for stamp in stamps)
    return RowPoses(
        np.array(rows, np.float64).reshape(-1, 3),
        np.array(stamps, np.int64) if timed else None,
        np.arange(len(rows)),
        [record.get("frame") for record in records],
        [None],
        _extras_of(records, kind, "frame", *"xyz", *["stamp_ns"] * timed),
    )


def _extras_of(records: Sequence[dict[str, Any]], *used: str) -> dict[str, Spans]:
    """Return what records say besides, as a column of cells for each key."""
    others = dict.fromkeys(key for record in records for key in record if key not in (used or ("stamp_ns",)))
    return {each: spans_of([_cell(record.get(each)) for record in records]) for each in others}


def _coordinates(record: dict[str, Any], kind: str) -> list[float]:
    """Return the three numbers of a point, as a list, as a mapping, or under x, y, z."""
    given = record.get(kind, record)
    numbers = given if isinstance(given, list) else [given.get(name) for name in "xyz"] if given else []
    if len(numbers) != 3 or not all(isinstance(number, float) for number in numbers):
        raise ValueInvalid(f"columns hold points or poses, found {', '.join(record)}")
    return numbers


def _cell(value: Any) -> bytes:
    text = dump(value) if isinstance(value, (dict, list)) else "" if value is None else str(value)
    return (quoted(text) if text == text.strip() else text).encode()


def results_of(block: RowPoses, extras: Sequence[str], *, placed: bool = True) -> list[Result]:
    """Return a block as results, one a pose."""
    size = len(block.numbers)
    names, parents = (each if len(each) == size else list(each) * size for each in (block.names, block.parents))
    others = {name: [plain_cell(text) for text in texts_of(spans)] for name, spans in block.extras.items()}
    stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
    made = []
    own = 7 if placed else 4
    null: list[Any] = [*NOWHERE[-own:], *[None] * len(extras)]
    for at, found in enumerate(block.numbers.tolist()):
        numbers = null if isnan(found[0]) else found
        pose = Pose.of(tuple(numbers[:7]) if placed else (0.0, 0.0, 0.0, *numbers[:4]), names[at], parents[at])
        said: dict[str, Any] = dict(zip(extras, numbers[own:], strict=True))
        if stamps is not None:
            said["stamp_ns"] = None if stamps[at] == NO_STAMP else stamps[at]
        said |= {name: texts[at] for name, texts in others.items()}
        made.append((NoResult if numbers is null else Result)(pose if placed else pose._replace(position=None), said))
    return made


def points_of(block: RowPoses, kind: str) -> list[dict[str, Any]]:
    """Return a block of points or vectors as mappings, one each."""
    size = len(block.numbers)
    frames = block.parents if len(block.parents) == size else list(block.parents) * size
    others = {name: [plain_cell(text) for text in texts_of(cells)] for name, cells in block.extras.items()}
    stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
    made = []
    for at, numbers in enumerate(block.numbers.tolist()):
        named: dict[str, Any] = {"frame": frames[at]} if frames[at] else {}
        stamp = {} if stamps is None else {"stamp_ns": None if stamps[at] == NO_STAMP else stamps[at]}
        own = spelled(kind, None if isnan(numbers[0]) else numbers)
        made.append(named | own | stamp | {name: texts[at] for name, texts in others.items()})
    return made


def spelled(kind: str, numbers: Sequence[float] | None) -> dict[str, Any]:
    """Return the numbers of a point, vector, twist or wrench under its keys; None in their place if there are none."""
    if kind not in PARTS:
        return {kind: numbers if numbers is None else list(numbers)}
    halves = (None, None) if numbers is None else (list(numbers[:3]), list(numbers[3:]))
    return {kind: dict(zip(PARTS[kind], halves, strict=True))}


def spans_of(texts: list[bytes]) -> Spans:
    """Return texts, one a row, as spans."""
    lengths = np.fromiter(map(len, texts), np.int64, len(texts))
    ends = np.cumsum(lengths) + MARGIN
    return Spans(framed(b"".join(texts)), ends - lengths, ends)


def texts_of(cells: Cells) -> list[str]:
    """Return the text of each cell, without its quotes; of numbers the shortest that reads back."""
    if not isinstance(cells, Spans) and cells.ndim > 1:  # several values a row
        flat, width = texts_of(cells.reshape(-1)), cells[0].size if len(cells) else 1
        return [f"[{', '.join(flat[at : at + width])}]" for at in range(0, len(flat), width)]
    if not isinstance(cells, Spans) and cells.dtype.kind != "f":
        texts: list[str] = cells.astype(np.str_).tolist()
        return [text.lower() for text in texts] if cells.dtype.kind == "b" else texts
    if not isinstance(cells, Spans):
        cells = float_spans(cells)
    bare = without_quotes(cells)
    data = bare.data.tobytes()
    places = zip(bare.starts.tolist(), bare.ends.tolist(), strict=True)
    return [data[start:end].decode("utf-8", "replace").strip().replace('""', '"') for start, end in places]


def float_spans(values: NDArray[Any]) -> Spans:
    """Write floats as the shortest text that reads back to the same float of their type."""
    doubles = values.astype(np.float64) if values.dtype.itemsize > 4 else rounded_to_single(values.astype(np.float64))
    spans = shortest_spans(doubles.reshape(-1, 1), b",")
    return Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)


def plain_cell(text: str) -> str | Verbatim | None:
    """Return a cell as a plain value: numbers and truth values as they are written."""
    if not text:
        return None
    return Verbatim(text) if text in ("true", "false") or re.fullmatch(JSON_NUMBER, text) else text
