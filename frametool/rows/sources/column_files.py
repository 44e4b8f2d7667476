"""Stream binary files of columns: planned like tables, computed in the same blocks, written without text.

A point cloud in a message is such a file, too: it is moved by one pose and written as a file of its own.
"""

from __future__ import annotations

from importlib import import_module
from io import BytesIO
from itertools import chain
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.documents.source import InputFile
from frametool.errors import FormatError, Misused, listing, warn
from frametool.formats.rows import column_file, pcd, pose_rows
from frametool.formats.rows.column_file import FLOATS, STAMP_NS, ColumnFile, Made, OutColumn, not_finite
from frametool.formats.rows.csv import quoted
from frametool.formats.rows.pose_rows import IMAGE, NUMBER
from frametool.formats.table import FORMATS
from frametool.geometry.representations import ROTATIONS
from frametool.geometry.rigid import EXACT
from frametool.grammar.readers import NORMALS, STAMP_KEYS, in_nanoseconds
from frametool.rows.batch import Block, RowPoses, coded_texts, is_typed, objects, taken
from frametool.rows.faults import SKIP, STOP, Fault, Outcome
from frametool.rows.plan import Kept, Named, New
from frametool.rows.request import NO_STAMPS, VELOCITIES, Operation, Request
from frametool.rows.sinks import Out, Word
from frametool.rows.sinks.as_arrays import DOUBLE, ColumnsWriter
from frametool.rows.sources.tables import PlannedRows, Table

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Sequence

    from frametool.formats.rows.column_file import Batch, ColumnWriter, Kind
    from frametool.geometry import Rigid
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style
    from frametool.recordings.contents import PointCloud
    from frametool.rows.evaluate import Run
    from frametool.text.spans import Flags, Floats


PARENT, NAME, STAMP = "parent", "name", "stamp_ns"  # columns of `ListedPoses`


class ListedPoses(ColumnFile):
    """The poses of a file that lists them, as columns; an edge of a pose graph has columns for its two frames."""

    gaps = False

    def __init__(self, file: InputFile, options: Options, request: Request, *, numbered: bool) -> None:
        """Read the first block of poses; numbered: add a column with their numbers.

        Raises FormatError if there are none.
        """
        self.errors = list[FormatError]()
        options = options if request.on_error == STOP else options._replace(report=self.errors.append)
        self.blocks = pose_rows.blocks(file, options, named=False)
        if (first := next(self.blocks, None)) is None:
            raise FormatError("nothing in it", source=file.name)
        self.first, has_names = first, any(row.names for row in first.rows)
        others = {PARENT: has_names, NAME: has_names, STAMP: not has_names and request.rows.stamps != NO_STAMPS}
        others |= {IMAGE: any(row.image for row in first.rows), NUMBER: numbered}
        self.others = [name for name, is_there in others.items() if is_there]
        self.names = (*"xyz", *ROTATIONS["quaternion"].columns, *self.others)
        self.kinds = [*[DOUBLE] * EXACT, *(STAMP_NS if name == STAMP else None for name in self.others)]
        self.width = len(self.names)

    def batches(self) -> Iterator[Batch]:
        """Yield the poses block by block."""
        for block in chain([self.first], self.blocks):
            every = {
                PARENT: [row.names and row.names[0] for row in block.rows],
                NAME: [row.names and row.names[1] for row in block.rows], STAMP: block.stamps_ns,
                IMAGE: [row.image or None for row in block.rows], NUMBER: [row.number for row in block.rows],
            }  # fmt: skip
            kinds = zip(self.others, self.kinds[EXACT:], strict=True)
            others = [np.array(every[name], kind or object) for name, kind in kinds]
            batch = column_file.StructuredBatch(np.rec.fromarrays([*block.poses, *others]))
            batch.lines = np.array([row.line - 1 for row in block.rows], np.int64)
            batch.errors, self.errors[:] = [*self.errors], []
            yield batch


class ColumnRows(PlannedRows):
    """The rows of a file of columns, batch by batch."""

    def __init__(self, file: ColumnFile, request: Request, source: str) -> None:
        """Plan the rows; raises FormatError or Misused as for a table with the same columns."""
        self.file = file
        names = file.names
        header = tuple(quoted(name).encode() for name in names or ())
        table = Table(b",", names, file.width, header=header, source=source, normals=file.vectors)
        is_stamped = dict(zip(names or (), file.kinds, strict=False)).get(STAMP_KEYS[0]) == STAMP_NS
        try:  # `t` or `time` of a cloud has an unknown unit; a column that frametool writes states it
            super().__init__(table._replace(stamped=is_stamped or not file.vectors), request)
        except FormatError as error:
            error.line = 0  # binary files have no line with names
            raise
        for at, place in enumerate(self.layout.places):
            if file.kinds[place] is None and at not in self.plan.categorical:
                raise Misused(f"column {table.name(place)} holds no numbers", source=source)
        self.narrow: dict[int, Kind] = {}  # results that are rounded to a smaller type
        for column in () if request.results.all_numbers else self.layout.columns:  # which are all doubles
            if isinstance(column, New) and isinstance(column.piece, Out):
                kind = self._kind_of(column.name)
                self.narrow |= {column.piece.first: kind} if kind.itemsize < DOUBLE.itemsize else {}

    def out_columns(self, *, named: bool = False) -> list[OutColumn]:
        """Return the columns of the output; a replaced float32 column remains float32, new columns are doubles.

        named: name the columns of a file without names
        """
        names = self.table.names
        usual = [name for each in self.plan.targets for name in (*each.position_columns, *each.names)]
        ours = dict(zip(self.layout.places, usual, strict=False))
        found = []
        for at, column in enumerate(self.layout.columns, 1):
            kind, place, name = None, column.place if isinstance(column, Kept) else None, ""
            if isinstance(column, New):
                name, number = column.name, column.piece.first if isinstance(column.piece, Out) else None
                kind = None if number is None else self._kind_of(name)
                name = usual[number] if number is not None and number < len(usual) and not names else name
            else:
                name = names[column.place] if names else ours.get(column.place, f"column_{at}")
                kind = None if place is None else self.file.kinds[place]
            found.append(OutColumn(name * bool(names or named), kind, place))
        return found

    def _kind_of(self, name: str) -> Kind:
        """Return the type of a column of results: that of the column it replaces; raises Misused for integers."""
        names, kinds = self.table.names, self.file.kinds
        kind: Kind | None = DOUBLE
        if names is None and getattr(kinds[0], "kind", "") in FLOATS:  # an array of one type
            kind = kinds[0]
        elif names and name in names:
            kind = kinds[names.index(name)]
        if kind is None or kind.kind not in FLOATS:
            whole = f"column {name} holds {kind}, where the result would be rounded"
            raise Misused(f"{whole}; --keep puts it beside, -f csv writes text", source=self.table.source)
        return kind

    def steps(self) -> Iterator[tuple[RowPoses, Outcome]]:
        """Yield the results of each batch for another format, after an empty batch with the columns."""
        for batch in chain([self.file.nothing()], self.file.batches()):
            run, outcome = self.of_batch(batch)
            yield self.poses_of(run, batch.column, batch.lines), outcome

    def of_batch(self, batch: Batch) -> tuple[Run, Outcome]:
        """Compute a batch; its results are nan where its numbers are absent."""
        values, absent, bad = self._read(batch)
        every = self.request.operation.formula is not None
        shapes = zip(absent, self.plan.shapes, strict=False)
        empty = [flags for flags, shape in shapes if shape.notation or every]
        gone = np.flatnonzero(np.logical_or.reduce(empty)) if np.any(empty) else None  # 0 is no rotation
        names = self.names_of(batch.size, lambda place: coded_texts(batch.texts(place)))
        stamps, late = self._stamps(batch)
        block = Block(
            values, {}, np.arange(batch.size), lambda row: int(batch.lines[row]), names=names, stamps=stamps,
            bad={**late, **names.bad, **bad}, gone=gone, frames=[names.frames],
        )  # fmt: skip
        run = self.ran(block)
        for number, kind in self.narrow.items():
            with np.errstate(over="ignore"):  # overflow makes a row bad, not infinite
                run.refuse(~np.isfinite(run.results[:, number].astype(kind)), f"the result is too large for {kind}")
        first, targets = 0, self.plan.targets
        for flags, target in zip(absent, targets, strict=False):
            last = first + target.own_size if len(targets) > 1 else None
            run.results[flags, first:last] = np.nan
            first += target.own_size
        unread = [Fault(max(error.line, 1) - 1, "", error.message) for error in batch.errors]
        faults, size = sorted(unread + run.faults()), batch.size + len(unread)
        lines = 0 if isinstance(self.file, ListedPoses) else batch.size  # they have lines of their own
        return run, Outcome(b"", faults, size, lines, len(run.mended), run.notes, batch.bytes_read)

    def _read(self, batch: Batch) -> tuple[Floats, Flags, dict[int, tuple[str, str]]]:
        """Return the numbers (n, c), for each shape the mask of rows without numbers, and the reasons of bad rows.

        Absent numbers are 0, or nan for a formula.
        """
        places, shapes = self.layout.places, self.plan.shapes
        columns = np.empty((len(places), batch.size))
        absent = np.zeros((max(len(shapes), 1), batch.size), np.bool_)
        bad: dict[int, tuple[str, str]] = {}
        first = 0
        for flags, shape in zip(absent, shapes, strict=False):
            for at in range(first, first + shape.size):
                if at in self.plan.categorical:
                    columns[at], reasons = coded_texts(batch.texts(places[at])).numbers(self.plan.categorical[at])
                    bad |= {row: (self.plan.names[at], reason) for row, reason in reasons.items()}
                    continue
                columns[at], missing = batch.numbers(places[at])
                if missing is not None:
                    np.logical_or(flags, missing, out=flags)
                if (invalid := not_finite(columns[at])) is not None and self.file.gaps:
                    np.logical_or(flags, invalid, out=flags)
                elif invalid is not None:
                    wrong = invalid if missing is None else invalid & ~missing
                    bad |= dict.fromkeys(np.flatnonzero(wrong).tolist(), (self.plan.names[at], "not finite"))
            columns[first : first + shape.size, flags] = 0.0 if self.request.operation.formula is None else np.nan
            first += shape.size
        return columns.T, absent, bad

    def _stamps(self, batch: Batch) -> tuple[list[Any], dict[int, tuple[str, str]]]:
        """Read the stamps of rows; also return the column and the reason for each row without a valid stamp."""
        times = self.layout.times
        if not times:
            return [], {}
        name = self.table.name(times[0])
        stamps, reasons = batch.stamps(times[0], in_ns=in_nanoseconds(name))
        for below in times[1:]:
            nanoseconds, more = batch.stamps(below, in_ns=1)
            stamps, reasons = stamps + nanoseconds, {**more, **reasons}
        return [stamps + self.request.offset_ns], {row: (name, reason) for row, reason in reasons.items()}

    def made(self, columns: Sequence[OutColumn], run: Run) -> list[Made]:
        """Return the data of the columns that are new or renamed, in the order of the output."""
        made, (rows, numbers) = list[Made](), run.settled(run.end)
        for column, target in zip(columns, self.layout.columns, strict=True):
            new = target.piece if isinstance(target, New) else None
            if isinstance(new, Word):
                codes = np.nan_to_num(numbers[:, new.number]).tolist()
                made.append(Made([new.text(code).decode() for code in codes]))
            elif isinstance(new, Out):
                with np.errstate(invalid="ignore"):
                    values = numbers[:, new.first].astype(column.kind or DOUBLE)
                made.append(Made(values, not_finite(values)))
            elif new is not None:
                made.append(Made([new.text.decode()] * len(numbers)))
            elif isinstance(target, Named):
                texts = [text or "" for text in run.block.names.texts(target.role, rows)]
                made.append(Made(texts * (len(rows) if len(texts) == 1 else 1)))
        return made


def run_columns(file: ColumnFile, request: Request, style: Style, *, source: str) -> Generator[Outcome]:
    """Yield the outcome of each batch of a file, written in the same format."""
    rows = ColumnRows(file, request, source)
    columns = rows.out_columns()
    move_along(file, request)
    drops = request.on_error == SKIP or request.operation.of == VELOCITIES
    writer: ColumnWriter = file.rewriter(columns, None if drops else file.count, style)
    for batch in file.batches():
        run, outcome = rows.of_batch(batch)
        chosen, _ = run.settled(run.end)
        some = None if len(chosen) == batch.size else chosen
        yield outcome._replace(text=writer.of_rows(batch, some, rows.made(columns, run)))
    yield from map(Outcome, writer.end())


class OtherColumns:
    """Write several files of columns, each moved by its own pose, as one file with the columns that all of them have.

    The type of a column can hold the numbers of all files.
    """

    def __init__(
        self, files: Sequence[tuple[ColumnFile, Request, str]], style: Style, module: Any = None
    ) -> None:  # fmt: skip
        """Plan the rows of files, each with its request and its name; raises as `ColumnRows`.

        module: as for `ColumnsWriter`
        """
        self.parts = [(file, ColumnRows(file, request, source)) for file, request, source in files]
        every = [{column.name: column for column in rows.out_columns(named=True)} for _, rows in self.parts]
        self.writer = ColumnsWriter(style, module)
        self.kinds: dict[str, Kind | None] = {}
        for name in every[0]:
            if all(name in columns for columns in every):
                kinds = [columns[name].kind for columns in every]
                self.kinds[name] = None if None in kinds else np.result_type(*kinds)
        others = dict.fromkeys(name for columns in every for name in columns if name not in self.kinds)
        if others:
            warn(f"{listing(others)} left out: not all of the clouds have it")
        for file, request, _ in files:
            move_along(file, request)

    def outcomes(self, at: int = 0) -> Generator[Outcome]:
        """Yield the outcome of each batch of one file, and of the last file also the end of the output."""
        file, rows = self.parts[at]
        columns = rows.out_columns(named=True)
        for batch in chain([file.nothing()], file.batches()):  # an empty batch has the columns, too
            run, outcome = rows.of_batch(batch)
            (chosen, _), new, found = run.settled(run.end), iter(rows.made(columns, run)), dict[str, Made]()
            for column in columns:
                place, kind = column.passed, self.kinds.get(column.name)
                if place is None:
                    each = next(new)
                    each = each if isinstance(each.values, np.ndarray) else Made(objects(each.values))
                elif column.kind is not None and column.kind.kind in FLOATS:
                    values, nulls = batch.numbers(place)
                    each = Made(values.astype(column.kind)[chosen], None if nulls is None else nulls[chosen])
                else:
                    each = Made(taken(batch.column(place), chosen))
                if kind is not None and is_typed(each.values):  # integers with nulls are objects
                    each = each._replace(values=each.values.astype(kind, copy=False))
                found |= {column.name: each} if column.name in self.kinds else {}
            yield outcome._replace(text=self.writer.of_columns(len(chosen), found))
        if rows is self.parts[-1][1]:
            yield from map(Outcome, self.writer.end())


def move_along(file: ColumnFile, request: Request) -> None:
    """Let the file move its other positions, such as that of the sensor, together with its points."""
    operation, timed = request.operation, request.timed
    if operation.moves and not request.results.keep:
        by_row = request.rows.frames or (timed is not None and timed.name)
        file.moved_by(None if by_row else operation.left)


def moved_cloud(cloud: PointCloud, pose: Rigid, style: Style, source: str) -> Generator[Outcome]:
    """Yield the outcomes of a point cloud that is moved by a pose and written in the format of a style."""
    module: Any = import_module(FORMATS[style.format].writer)
    kept = {"grid": (cloud.width, cloud.height), "sensor": pose} if module is pcd else {}  # PCD can store both
    create = lambda columns, _count, style: module.create(columns, len(cloud.rows), style, **kept)  # noqa: E731
    into = SimpleNamespace(**{**vars(module), "create": create})
    request = Request(Operation(left=pose, moves=True))
    stored = InputFile(source, BytesIO(cloud.rows.tobytes()))
    file = column_file.RecordFile(stored, cloud.names, cloud.rows.dtype, len(cloud.rows))  # type: ignore[abstract]
    file.vectors = NORMALS
    return OtherColumns([(file, request, source)], style, into).outcomes()
