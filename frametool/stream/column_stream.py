"""Files of columns of numbers as streams: planned as tables are, evaluated in the same blocks, no text in between.

The points of a message are such a file too: moved by one pose, and written as a file of their own.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FormatError, Misused, ValueInvalid, listing, warn
from frametool.formats.rows import pcd
from frametool.formats.rows.column_file import (
    FLOATS,
    ColumnFile,
    Made,
    OutColumn,
    StructuredBatch,
    not_finite,
    plain_value,
    rows_of_batch,
)
from frametool.formats.table import FORMATS
from frametool.grammar.names import NORMALS, in_nanoseconds, stamp_column
from frametool.stream.array_writer import ColumnsWriter
from frametool.stream.faults import NULL, SKIP, STOP, Outcome
from frametool.stream.layout import NAME, PARENT, Fixed, Kept, Named, New, Worded, quoted
from frametool.stream.request import Operation, Request
from frametool.stream.row_poses import RowPoses, objects, texts_of
from frametool.stream.rows import Block, spans_of
from frametool.stream.table import Table, unnamed
from frametool.stream.table_plan import own_count, with_vectors
from frametool.stream.table_stream import PlannedRows
from frametool.text.cells import Cells
from frametool.text.spans import Spans, framed

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Mapping, Sequence

    from frametool.formats.rows.column_file import Batch, ColumnWriter, Kind
    from frametool.geometry.types import Rigid
    from frametool.grammar.result import Style
    from frametool.recordings.messages import PointCloud
    from frametool.stream.evaluate import Run
    from frametool.stream.faults import Fault, RowNote
    from frametool.stream.table import BlockNames
    from frametool.text.spans import Flags, Floats, Ints

NOTHING = np.zeros((0, 0), np.int64)
DOUBLE = np.dtype(np.float64)


class RowResults(NamedTuple):
    """What became of a batch: the rows that are written, in their order.

    rows: (n,) which of the batch's rows they are; None for all
    numbers: (n, k) the results, nan if absent
    absent: (n,) for each shape, rows that have no numbers on purpose; None where all have
    names: by role, the names of the results, one a row, where a column holds them
    own_frames: the frames that the rows are expressed in
    """

    rows: Ints | None
    numbers: Floats
    absent: Sequence[Flags | None]
    names: Mapping[int, Sequence[str]]
    own_frames: Sequence[str | None]


class ColumnRows(PlannedRows):
    """Turn the rows of one batch after the other into results; the bad ones are listed in `faults`.

    faults, notes: of the last batch, rows from 0
    """

    def __init__(self, file: ColumnFile, request: Request, source: str) -> None:
        """Plan the rows; raises FormatError or Misused as for a table of the same columns."""
        self.file = file
        self.source = source
        names = file.names
        table = Table(b",", names, file.width, header=tuple(quoted(name, b",") for name in names or ()))
        try:
            super().__init__(table, with_vectors(names, request, file.vectors), source)
        except FormatError as error:
            error.line = 0  # the names of columns are in no line here
            raise
        for at, place in enumerate(self.layout.places):
            if file.kind(place) is None and at not in self.plan.words:
                raise Misused(f"column {table.name(place)} holds no numbers", source=source)
        self.faults: list[Fault] = []
        self.notes: list[RowNote] = []
        self.narrow = {} if request.all_numbers else self._narrow()  # all of them are written as doubles
        self.numbers = sum(isinstance(column, New) for column in self.layout.columns)

    def columns(self) -> list[OutColumn]:
        """Return the columns of the output; what is read as float32 is written so, what is new is a double."""
        found = []
        for column in self.layout.columns:
            if isinstance(column, Kept):
                found.append(OutColumn(self._name(column.place), self.file.kind(column.place), column.place))
            elif isinstance(column, New):
                found.append(OutColumn(column.name if self.table.names else "", self._kind_of(column)))
            else:
                name = self._name(column.place) if isinstance(column, Named) else column.name
                found.append(OutColumn(name, None))
        return found

    def named_columns(self) -> list[OutColumn]:
        """Return the columns of the output, each with a name: those of a file without names get the usual ones."""
        if self.table.names:
            return self.columns()
        targets = self.plan.targets
        names = [name for each in targets for name in (*each.position_columns, *each.names)]
        kept = dict(zip(self.layout.places, names, strict=False))
        found = []
        for at, (column, target) in enumerate(zip(self.columns(), self.layout.columns, strict=True), 1):
            ours = dict(enumerate(names)).get(target.number) if isinstance(target, New) else None
            if isinstance(target, (Kept, Named)):
                ours = kept.get(target.place)
            elif isinstance(target, (Worded, Fixed)):
                ours = target.name
            found.append(column._replace(name=ours or f"column_{at}"))
        return found

    def _name(self, place: int) -> str:
        return self.table.names[place] if self.table.names else ""

    def _kind_of(self, column: New) -> Kind:
        """Return the type of a result's numbers: that of the column it replaces; raises Misused for integers."""
        place = self._replaced(column)
        kind = DOUBLE if place is None else self.file.kind(place)
        if kind is None or kind.kind not in FLOATS:
            whole = f"column {column.name} holds {kind}, where the result would be rounded"
            raise Misused(f"{whole}; --keep puts it beside, -f csv writes text", source=self.source)
        return kind

    def _replaced(self, column: New) -> int | None:
        """Return the place of the input's column whose numbers a result's replace."""
        names = self.table.names
        if names is None:  # an array of one type
            return 0 if getattr(self.file.kind(0), "kind", "") in FLOATS else None
        return names.index(column.name) if column.name in names else None

    def _narrow(self) -> dict[int, Kind]:
        """Return which numbers of the result are rounded to fewer digits than they are computed with."""
        news = [column for column in self.layout.columns if isinstance(column, New)]
        kinds = {column.number: self._kind_of(column) for column in news}
        return {number: kind for number, kind in kinds.items() if kind.itemsize < DOUBLE.itemsize}

    def of_batch(self, batch: Batch) -> RowResults:
        """Return the results of a batch, and leave what is wrong with other rows in `faults`."""
        size = batch.size
        values, absent, bad = self._read(batch)
        gone = self._without_pose(absent)
        present = None if gone is None else np.flatnonzero(~gone)
        names = self._names(batch)
        times, late = self._times(batch)
        weights = self._weights(batch, late)
        block = Block(
            Spans(framed(b""), NOTHING, NOTHING), (), np.arange(size), lambda row: row,
            bad={**late, **names.bad, **bad}, frames=names.frames, lost=names.lost, values=values, times=times,
            weights=weights,
        )  # fmt: skip
        run = self.ran(block if present is None else _chosen(block, present))
        self._round(run)
        self.faults = run.faults()
        self.notes = self.notes_of(run, block.frames)
        return self._settled(run, size, present, absent, names)

    def outcome(self, batch: Batch, text: bytes = b"") -> Outcome:
        """Return what is written of the last batch, and what is said of it."""
        mended, self.mended = self.mended, 0
        return Outcome(text, self.faults, batch.size, batch.size, mended, self.notes, batch.bytes_read)

    def poses(self, batch: Batch) -> RowPoses:
        """Return the results of a batch for another format, with what else its rows hold."""
        results = self.of_batch(batch)
        rows = np.arange(batch.size) if results.rows is None else results.rows
        stamp_at = self.layout.time
        found = stamp_column(self.table.names)
        if stamp_at is None and found not in self.layout.frames and not self.file.vectors:
            stamp_at = found  # `t` or `time` of a cloud is what its sensor counts, in whatever unit
        stamps = None
        if stamp_at is not None:
            name = self.table.name(stamp_at)
            stamps = batch.stamps(stamp_at, in_ns=in_nanoseconds(name))[0][rows]
        used = {stamp_at, *self.layout.places, *self.naming.places}
        extras = {
            self.table.name(place): _cells(batch.column(place), rows)
            for place in range(self.table.width)
            if place not in used and self.table.names
        }
        names: list[Sequence[str | None]] = [[name] for name in unnamed(self.request, self.shape)]
        for role, texts in results.names.items():
            names[role] = [text or None for text in texts]
        own = own_count(self.plan, results.numbers.shape[1])
        for column in self.layout.columns:
            if isinstance(column, New) and column.number >= own:
                extras[column.name] = results.numbers[:, column.number]
        return RowPoses(results.numbers[:, :own], stamps, rows, names[PARENT], names[NAME], extras, results.own_frames)

    # --- what is read ---

    def _read(self, batch: Batch) -> tuple[Floats, list[Flags | None], dict[int, tuple[str, str]]]:
        """Return our numbers (n, c); for each shape which rows have none, which count as 0; and rows that are bad."""
        places = self.layout.places
        columns = np.empty((len(places), batch.size))
        absent: list[Flags | None] = []
        bad: dict[int, tuple[str, str]] = {}
        first = 0
        for shape in self.plan.shapes:
            flags: Flags | None = None
            for at in range(first, first + shape.size):
                if at in self.plan.words:
                    columns[at] = self._words(batch, at, bad)
                    continue
                columns[at], missing = batch.numbers(places[at])
                invalid = not_finite(columns[at])
                if invalid is not None and not self.file.gaps:
                    wrong = invalid if missing is None else invalid & ~missing
                    bad |= dict.fromkeys(np.flatnonzero(wrong).tolist(), (self.plan.names[at], "not finite"))
                else:
                    missing = _either(missing, invalid)
                flags = _either(flags, missing)
            if flags is not None:
                columns[first : first + shape.size, flags] = 0.0
            absent.append(flags)
            first += shape.size
        return columns.T, absent or [None], bad

    def _words(self, batch: Batch, at: int, bad: dict[int, tuple[str, str]]) -> list[float]:
        """Read a column of words, each of which encodes a number."""
        read, texts = self.plan.words[at], [str(text) for text in batch.texts(self.layout.places[at])]
        known: dict[str, float] = {}
        for row, text in enumerate(texts):
            try:
                known[text] = known[text] if text in known else read(text)
            except ValueInvalid as error:
                bad[row] = self.plan.names[at], str(error)
        return [known.get(text, 0.0) for text in texts]

    def _without_pose(self, absent: Sequence[Flags | None]) -> Flags | None:
        """Return which rows cannot be computed: 0 is a point, but no rotation."""
        gone: Flags | None = None
        request = self.request
        for shape, flags in zip(self.plan.shapes, absent, strict=False):
            if shape.notation is not None or request.operation.formula is not None or request.gathered is not None:
                gone = _either(gone, flags)
        return gone

    def _names(self, batch: Batch) -> BlockNames:
        """Read the names of rows, as the cells of a table."""
        places = sorted({place for place in (*self.naming.places, *self.layout.frames) if place is not None})
        texts = [[quoted(text, b",") for text in batch.texts(place)] for place in places]
        spans = spans_of([text for each in texts for text in each])
        starts = np.zeros((batch.size, self.table.width if places else 0), np.int64)
        ends = starts.copy()
        for at, place in enumerate(places):
            rows = slice(at * batch.size, (at + 1) * batch.size)
            starts[:, place], ends[:, place] = spans.starts[rows], spans.ends[rows]
        none = np.zeros(0, np.int64)
        return self.naming.of_block(Cells(spans.data, none, none, none, np.arange(batch.size), starts, ends))

    def _times(self, batch: Batch) -> tuple[Ints | None, dict[int, tuple[str, str]]]:
        """Read the stamps of rows, and which of them have none."""
        if self.layout.time is None or self._weighs:
            return None, {}
        name = self.table.name(self.layout.time)
        times, reasons = batch.stamps(self.layout.time, in_ns=in_nanoseconds(name))
        if self.layout.below is not None:
            below, more = batch.stamps(self.layout.below, in_ns=1)
            times, reasons = times + below, {**more, **reasons}
        return times, {row: (name, reason) for row, reason in reasons.items()}

    @property
    def _weighs(self) -> bool:
        return self.request.gathered is not None and bool(self.request.extra_column)

    def _weights(self, batch: Batch, bad: dict[int, tuple[str, str]]) -> Floats | None:
        """Read the weights of rows; those that are none are bad."""
        if self.layout.time is None or not self._weighs:
            return None
        if self.request.gathered is not None and self.request.gathered.labelled:
            return np.array(batch.texts(self.layout.time), object)
        weights, nulls = batch.numbers(self.layout.time)
        invalid = _either(nulls, not_finite(weights))
        if invalid is not None:
            name = self.table.name(self.layout.time)
            bad |= dict.fromkeys(np.flatnonzero(invalid).tolist(), (name, "not finite"))
            weights[invalid] = 0.0
        return weights

    # --- what becomes of it ---

    def _round(self, run: Run) -> None:
        """Find results that are too large for the type of their column: bad rows, no infinities."""
        for number, kind in self.narrow.items():
            with np.errstate(over="ignore"):
                beyond = ~np.isfinite(run.results[:, number].astype(kind))
            if beyond.any():
                run.refuse(run.rows[beyond].tolist(), f"the result is too large for {kind}")

    def _settled(
        self, run: Run, size: int, present: Ints | None, absent: Sequence[Flags | None], names: BlockNames
    ) -> RowResults:
        """Put the results of the rows that could be computed at their places among all that are written."""
        computed = run.rows if present is None else present[run.rows]
        bad = np.array([run.block.line_of(row) for row in run.reasons], np.int64)
        written = np.ones(size, np.bool_)
        if run.lone is not None:
            written[run.block.line_of(run.lone)] = False
        if self.request.on_error == STOP and len(bad):
            written[int(bad.min()) :] = False
        elif self.request.on_error == NULL and len(bad):
            absent = [_either(flags, np.isin(np.arange(size), bad)) for flags in absent]
        else:
            written[bad] = False
        numbers, rows = run.results, None
        if len(computed) < size:
            numbers = np.full((size, run.results.shape[1]), np.nan)
            numbers[computed] = run.results
        for flags, span in zip(absent, self._spans(), strict=True):
            if flags is not None:
                numbers[flags, span.start : span.stop] = np.nan
        if not written.all():
            rows = np.flatnonzero(written)
            numbers = numbers[rows]
            absent = [flags if flags is None else flags[rows] for flags in absent]
        return RowResults(rows, numbers, absent, self._texts(names, rows), names.frames)

    def _spans(self) -> list[range]:
        """Return which numbers of the result come from each shape: all of one, if there is one result."""
        targets = self.plan.targets
        ends = np.cumsum([target.size for target in targets]).tolist()
        if len(targets) == 1:
            return [range(self.numbers)] * max(len(self.plan.shapes), 1)
        return [range(end - target.size, end) for target, end in zip(targets, ends, strict=True)]

    def absent_in(self, number: int, results: RowResults) -> Flags | None:
        """Return which rows have no number in a column of the result."""
        found: Flags | None = None
        for flags, span in zip(results.absent, self._spans(), strict=True):
            if number in span:
                found = _either(found, flags)
        return found

    def _texts(self, names: BlockNames, rows: Ints | None) -> dict[int, list[str]]:
        """Return the names of the results by role."""
        found = {}
        for role in (PARENT, NAME):
            if self.naming.places[role] is not None and names.spans:
                texts = texts_of(names.spans[role])
                found[role] = texts if rows is None else [texts[row] for row in rows.tolist()]
        return found


def _chosen(block: Block, rows: Ints) -> Block:
    """Keep some rows of a block, which count on as they did."""
    numbers = rows.tolist()
    at = {row: place for place, row in enumerate(numbers)}
    return block._replace(
        values=None if block.values is None else block.values[rows],
        places=np.arange(len(rows)),
        line_of=numbers.__getitem__,
        bad={at[row]: why for row, why in block.bad.items() if row in at},
        frames=[block.frames[row] for row in numbers] if block.frames else (),
        lost=[(at[row], name) for row, name in block.lost if row in at],
        times=None if block.times is None else block.times[rows],
        weights=None if block.weights is None else block.weights[rows],
    )


def _cells(column: Any, rows: Ints) -> Any:
    """Return some of a column as it is; what is no number, truth value or time of numpy as plain values."""
    if not isinstance(column, np.ndarray):
        return objects([column[row] for row in rows.tolist()])
    if column.ndim == 1 and column.dtype.kind in "fiubM":
        return column[rows]
    return objects(map(plain_value, column[rows].tolist()))


def _either(first: Flags | None, second: Flags | None) -> Flags | None:
    if first is None or second is None:
        return first if second is None else second
    return first | second


def run_columns(
    file: ColumnFile, request: Request, style: Style, *, source: str, into: Any = None
) -> Generator[Outcome]:
    """Yield what becomes of a file's batches in a file of the same format, or in that of a module, `into`."""
    rows = ColumnRows(file, request, source)
    columns = rows.columns() if into is None else rows.named_columns()
    move_along(file, request)
    if rows.narrow and not request.gathered:
        kinds = ", ".join(sorted({kind.name for kind in rows.narrow.values()}))
        warn(f"{source}: {kinds} columns are computed as float64 and rounded once")
    drops = request.on_error == SKIP or request.operation.velocity
    writer: ColumnWriter | None = None
    other = None if into is None else ColumnsWriter(style, into)
    if other is None and not request.gathered:
        writer = file.rewriter(columns, style, drops=drops)
    for batch in file.batches():
        results = rows.of_batch(batch)
        text: Any = b""
        if other is not None:
            text = other.of_columns(len(results.numbers), _in_other_format(columns, rows, batch, results))
        elif writer is not None:
            text = writer.of_rows(batch, results.rows, made_of(columns, rows, results))
        yield rows.outcome(batch, text)
    if other is not None and not other.begun:
        empty = file.nothing()
        other.of_columns(0, _in_other_format(columns, rows, empty, rows.of_batch(empty)))
    if (last := other or writer) is not None:
        yield from map(Outcome, last.end())


class MergedClouds:
    """Several files of columns, each moved by its own pose, as one file of a format: the columns that all of them have.

    Numbers of one column get the type that holds those of all files.
    """

    def __init__(self, files: Sequence[tuple[ColumnFile, Request, str]], style: Style) -> None:
        """Plan the rows of files, each with what is done with it and its name; raises as `run_columns`."""
        self.parts = [(file, ColumnRows(file, request, source)) for file, request, source in files]
        every = [{column.name: column for column in rows.named_columns()} for _, rows in self.parts]
        self.writer = ColumnsWriter(style)
        self.kinds: dict[str, Kind | None] = {}
        for name in every[0]:
            if all(name in columns for columns in every):
                kinds = [columns[name].kind for columns in every]
                self.kinds[name] = None if None in kinds else np.result_type(*kinds)
        others = dict.fromkeys(name for columns in every for name in columns if name not in self.kinds)
        if others:
            warn(f"{listing(others)} left out: not all of the clouds have it")
        if narrow := {kind.name for _, rows in self.parts for kind in rows.narrow.values()}:
            warn(f"{', '.join(sorted(narrow))} columns are computed as float64 and rounded once")
        for file, request, _ in files:
            move_along(file, request)

    def outcomes(self, at: int) -> Iterator[Outcome]:
        """Yield what becomes of the batches of one file."""
        file, rows = self.parts[at]
        columns = rows.named_columns()
        for batch in file.batches():
            results = rows.of_batch(batch)
            made = _in_other_format(columns, rows, batch, results)
            typed = {
                name: made[name] if kind is None else made[name]._replace(values=made[name].values.astype(kind))
                for name, kind in self.kinds.items()
            }
            text = self.writer.of_columns(len(results.numbers), typed)
            yield rows.outcome(batch, text)


def _in_other_format(
    columns: Sequence[OutColumn], rows: ColumnRows, batch: Batch, results: RowResults
) -> dict[str, Made]:
    """Return the columns of a batch by name, for a file of another format."""
    new = iter(made_of(columns, rows, results))
    chosen = np.arange(batch.size) if results.rows is None else results.rows
    found = {}
    for column in columns:
        if column.passed is None:
            made = next(new)
            found[column.name] = made if isinstance(made.values, np.ndarray) else Made(objects(made.values))
        elif column.kind is not None and column.kind.kind in FLOATS:
            values, nulls = batch.numbers(column.passed)
            found[column.name] = Made(values.astype(column.kind)[chosen], None if nulls is None else nulls[chosen])
        else:
            found[column.name] = Made(_cells(batch.column(column.passed), chosen))
    return found


def move_along(file: ColumnFile, request: Request) -> None:
    """Let what else has a place among the points of a file move with them."""
    operation, timed = request.operation, request.timed
    if operation.moves and not request.keep and request.gathered is None:
        by_row = request.frames or (timed is not None and timed.name)
        file.moved_by(None if by_row else operation.left)


def made_of(columns: Sequence[OutColumn], rows: ColumnRows, results: RowResults) -> list[Made]:
    """Return what is in the columns that are made, in their order."""
    made = []
    for column, target in zip(columns, rows.layout.columns, strict=True):
        if isinstance(target, New):
            with np.errstate(invalid="ignore"):
                values = results.numbers[:, target.number].astype(column.kind or DOUBLE)
            made.append(Made(values, rows.absent_in(target.number, results)))
        elif isinstance(target, Named):
            made.append(Made(results.names.get(target.role, ())))
        elif isinstance(target, Worded):
            made.append(Made([target.words[int(number)] for number in results.numbers[:, target.number].tolist()]))
        elif isinstance(target, Fixed):
            made.append(Made([target.word] * len(results.numbers)))
    return made


class MessageColumns(ColumnFile):
    """The points of a message as a file of columns."""

    vectors = NORMALS
    gaps = True

    def __init__(self, cloud: PointCloud) -> None:
        """Take the cloud."""
        self.cloud = cloud
        self.names: tuple[str, ...] | None = cloud.names
        self.width = len(cloud.names)
        self.kinds = [cloud.rows.dtype[place] for place in range(self.width)]

    def batches(self) -> Iterator[StructuredBatch]:
        """Yield the points."""
        rows = self.cloud.rows
        step = rows_of_batch(rows.dtype.itemsize)
        for first in range(0, len(rows), step):
            yield StructuredBatch(rows[first : first + step])

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Refuse: messages are written in other formats."""
        raise NotImplementedError


class _GridOfForm:
    """A format in which the grid of a cloud is kept, and the pose of its sensor, where it has room for them."""

    def __init__(self, fmt: str, cloud: PointCloud, pose: Rigid) -> None:
        """Take the cloud and the pose that moves it."""
        self.module: Any = import_module(FORMATS[fmt].writer)
        self.cloud = cloud
        self.pose = pose
        if hasattr(self.module, "misfit"):
            self.misfit = self.module.misfit

    def create(self, columns: Sequence[OutColumn], count: int | None, style: Style) -> ColumnWriter:
        """Return what writes the points."""
        del count
        cloud = self.cloud
        kept = {"grid": (cloud.width, cloud.height), "sensor": self.pose} if self.module is pcd else {}
        writer: ColumnWriter = self.module.create(columns, len(cloud.rows), style, **kept)
        return writer


def moved_cloud(cloud: PointCloud, pose: Rigid, style: Style, source: str) -> Iterator[Outcome]:
    """Yield what a cloud becomes when a pose moves it, in the format of a style."""
    request = Request(Operation(left=pose, moves=True))
    into = _GridOfForm(style.format, cloud, pose)
    yield from run_columns(MessageColumns(cloud), request, style, source=source, into=into)
