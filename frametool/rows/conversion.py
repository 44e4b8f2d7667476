"""Convert streams to another format, block by block: tables, columns of numbers, and files that list poses.

rows -> the operation -> blocks of poses or points -> the other format

`read` reads a table as frames; each row is the pose of a moving frame at its stamp, or of a static frame:

stamp,x,y,z,qx,qy,qz,qw                      frames of --frames, by default `world` and `body`
stamp_ns,parent,name,x,y,yaw_deg             each row names its frames
parent,name,x,y,z,roll,pitch,yaw             without stamps frames are static

Rows without names of columns are those of tum, t x y z qx qy qz qw,

    1305031102.1758 1.34 0.62 1.65 0.657 0.612 -0.295 -0.311

of kitti, three rows of a matrix,

    1.0 0.0 0.0 0.5 0.0 1.0 0.0 0.0 0.0 0.0 1.0 2.0

or of euroc, nanoseconds, x y z, qw qx qy qz, then other numbers:

    1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, BinaryIO, TypeAlias, cast

import numpy as np

from frametool.documents.source import InputFile, not_text
from frametool.errors import FormatError, Misused, ValueInvalid, warn
from frametool.formats.rows.pose_rows import StampFile, describe, rows_of
from frametool.formats.table import FORMATS, Rows, holds, is_trajectory
from frametool.frames.stamps import BILLION
from frametool.geometry.representations import notation
from frametool.grammar.edges import Answers, Diagnostics, EdgeColumns, Options, Topics
from frametool.grammar.pose import LEFT_OUT
from frametool.grammar.readers import EARTH_FRAMES, may_be_uncertain
from frametool.grammar.result import SPELLED, Style
from frametool.rows.batch import NO_ROWS, NO_STAMP, RowPoses, block_of, kept
from frametool.rows.faults import DEGREES, NULL, SKIP, BadRow, Fault, Outcome, written_by
from frametool.rows.request import NO_STAMPS, SOME, Request, RowOptions
from frametool.rows.shapes import POINT, POSE, Shape
from frametool.rows.sinks.as_rows import PoseWriter, RowsWriter, SingleWriter, TextWriter
from frametool.rows.sinks.results import BlockResults, ResultWriter, blocks_of
from frametool.rows.sources.tables import TableRows

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from frametool.formats.rows.column_file import ColumnFile
    from frametool.rows.plain import Value
    from frametool.rows.sources.column_files import ColumnRows
    from frametool.text.lines import ByteStream

    Step: TypeAlias = tuple[RowPoses, Outcome]  # the results of a block, and its outcome

QUATERNION = notation("quaternion")
NO_ROTATION = "no rotation among the columns {}: poses are wanted"
AS_VALUES = Style("json")  # for results that are not written


def writer_for(style: Style, first: RowPoses) -> PoseWriter:
    """Return the writer of blocks in the format of a style: text, columns of numbers, or messages of a recording."""
    if holds(style.format, "arrays"):
        from frametool.rows.sinks.as_arrays import ArrayWriter

        return ArrayWriter(style, first)
    if holds(style.format, "recording"):
        from frametool.rows.sinks.as_messages import RecordingWriter

        return RecordingWriter(style, first)
    text = TextWriter if rows_of(style.format) else SingleWriter
    return (RowsWriter if style.format in SPELLED else text)(style, first)


class Blocks(ResultWriter):
    """Write blocks of rows of one kind, that of the first block, in the format of a style."""

    def __init__(self, style: Style) -> None:
        """Begin without blocks."""
        self.style = style
        self.writer: PoseWriter | None = None

    def of_block(self, block: RowPoses | BlockResults) -> bytes:
        """Add a block of rows, or of results; return the text that can be written now."""
        if not isinstance(block, RowPoses):
            is_text = not holds(self.style.format, "arrays")
            block = block_of(block, timed=is_text)
            block = block._replace(placed=block.placed or is_text)
            if not len(block.numbers):
                return b""
        if self.writer is None:
            self.writer = writer_for(self.style, block)
        if block.kind != self.writer.kind:
            raise ValueInvalid(f"one file holds things of one kind, found {self.writer.kind} and {block.kind}")
        if block.placed > self.writer.placed:
            raise ValueInvalid("the first rows are rotations without a position, others have one; add it to all")
        return self.writer.of_block(block._replace(placed=self.writer.placed))

    def end(self) -> Iterator[bytes]:
        """Yield the rest of the text."""
        if self.writer is None:
            self.of_block(NO_ROWS)
        yield from self.writer.end()  # type: ignore[union-attr]


def poses_text(values: Iterable[Value], style: Style) -> str:
    """Return single results as text of a format whose rows are poses."""
    writer = Blocks(style)
    return b"".join((*map(writer.of_block, blocks_of(values)), *writer.end())).decode()


class FormatConverter:
    """Convert a stream of poses or points to another format, block by block.

    rows: the planned rows, set by the first step
    tally: the assumptions about a trajectory
    """

    rows: TableRows | ColumnRows

    def __init__(
        self, fmt: str, request: Request, source: str, style: Style = AS_VALUES, answers: Answers = Answers()  # noqa: B008
    ) -> None:
        """Store the request; raises Misused for options that only apply to tables in their own format."""
        if request.results.keep or (request.results.prefix and not request.operation.extras(Shape(POSE))):
            raise Misused("--keep and --prefix are for tables that stay in their form")
        self.fmt, self.source, self.answers = fmt, source, answers
        self.is_table = FORMATS[fmt].is_table
        self.tally, self.style = Diagnostics(), style.changed()
        in_ecef = request.with_results(place=None, last_place=request.results.place)
        self.request = in_ecef.with_results(all_numbers=True, notations=(QUATERNION,), keep_sign=True)
        # each row was checked against TARGET
        self.looks_up_places = request.results.place is not None and not request.rows.poses
        has_nulls = style.format in SPELLED or holds(style.format, "arrays")
        if request.on_error == NULL and not (self.is_table and has_nulls):
            raise Misused(f"--on-error null: {style.format} of {fmt} cannot hold a row without a result; give skip")

    def outcomes(self, stream: ByteStream, *, header: bool = True) -> Generator[Outcome]:
        """Yield the text of the results, block by block, and warn about assumptions at the end."""
        yield from written_by(Blocks(self.style), self._to_write(stream, header=header), self.request.on_error)
        for finding in self.tally.findings():
            warn(f"{self.source}:{finding.line}: {finding.message}")

    def _to_write(self, stream: ByteStream, *, header: bool) -> Iterator[Outcome]:
        """Yield the outcome of each block with the results to write and the warnings about them."""
        operation, place = self.request.operation, self.style.place
        for poses, outcome in self.steps(stream, header=header):
            has_more = poses.more and poses.kind != POSE and operation.formula is not None
            if operation.only_adds or not poses.kind or has_more:
                remedy = f"leave -f {self.style.format} out" if self.is_table else "convert it to csv first"
                raise Misused(f"such results are columns added to the rows of {self.fmt}; {remedy}")
            notes = [*outcome.notes]
            if place is not None and place.words:
                from frametool.rows.columns_earth import zone_notes

                if len(there := np.flatnonzero(~np.isnan(poses.numbers[:, 0]))):
                    columns = place.numbers(*np.ascontiguousarray(poses.numbers[there, :3].T))
                    notes += zone_notes(place, columns, poses.lines[there].tolist().__getitem__)
            yield outcome._replace(results=poses, notes=notes, kept=len(poses.numbers))

    def steps(self, stream: ByteStream, *, header: bool = True) -> Iterator[Step]:
        """Yield the results of each block, after a first block without rows.

        Stamps are those of a --stamps file, else of the rows; formats that count their rows get one per second.
        """
        is_table, other, fmt = self.is_table, self.style.format, FORMATS[self.fmt].rows
        rows = TableRows(stream, self.fmt, self.request, self.source, header=header) if is_table else self._rows(stream)
        self._begin(rows)
        # stamps that only count may be dropped if the other format has no place for them
        counts = bool(fmt.counted) and not (self.answers.stamps or (self.fmt == "g2o" and self.answers.edges))
        has_no_place = holds(other, "recording") or FORMATS[other].rows.counted
        are_lost = counts and (self.request.rows.stamps == NO_STAMPS or has_no_place)
        operation = self.request.operation
        kind, names = operation.result_kind(self.shape.kind), operation.extras(self.shape)
        more = tuple(map(self.request.results.prefix.__add__, names))
        file = StampFile(self.answers.stamps) if self.answers.stamps and is_table else None
        is_placed, count = self.looks_up_places or self.shape.kind == POINT or self.shape.place is not None, 0
        for found, outcome in rows.steps() if is_table else self._without_gaps(rows):
            poses = self._placed(found, names) if is_placed else found
            # a bad row uses up a stamp, too
            every = np.union1d(poses.lines, [each.line for each in outcome.faults]) if outcome.faults else poses.lines
            at, before, count = np.searchsorted(every, poses.lines), count, count + len(every)
            stamps = None if are_lost else poses.stamps_ns
            if file is not None:
                stamps = np.array(file.between(before, count), np.int64)[at]
            elif counts and stamps is None and not are_lost:
                stamps = (before + at) * BILLION
            yield poses._replace(stamps_ns=stamps, kind=kind, placed=self.placed, more=more), outcome
        if file is not None:
            file.finish(count, self.source)
        if is_table and is_trajectory(self.fmt):
            describe(Options(self.tally, Topics(), answers=self.answers), fmt, count, named=False)

    def _rows(self, stream: ByteStream) -> ColumnRows:
        """Plan the rows of a stream of binary columns, or of a file that lists poses."""
        from frametool.rows.sources.column_files import ColumnRows, ListedPoses, move_along

        file = InputFile("-" if self.source == "stdin" else self.source, cast("BinaryIO", stream))
        file.format = self.fmt
        if "arrays" in FORMATS[self.fmt].reads:
            columns: ColumnFile = import_module(FORMATS[self.fmt].reader).open_columns(file)
            move_along(columns, self.request)
        else:
            options = Options(self.tally, Topics(), normalize=self.request.rows.normalize, answers=self.answers)
            columns = ListedPoses(file, options, self.request, numbered=self.fmt == self.style.format)  # type: ignore[abstract]
        return ColumnRows(columns, self.request, self.source)

    def _without_gaps(self, rows: TableRows | ColumnRows) -> Iterator[Step]:
        """Yield the results without rows that have no numbers, which text formats cannot hold."""
        left_out = 0
        for poses, outcome in rows.steps():
            there = np.flatnonzero(~np.isnan(poses.numbers[:, 0]))
            left_out += len(poses.numbers) - len(there)
            rows.inputs = rows.inputs[:, there]
            yield kept(poses, there), outcome
        if left_out:
            what = f"{left_out} {'row' if left_out == 1 else 'rows'} without numbers left out"
            warn(f"{self.source}: {what}: {self.style.format} has no place for them")

    def _begin(self, rows: TableRows | ColumnRows) -> None:
        """Determine the kind of the results: points, if there is no rotation and no option chose one.

        Raises FormatError if the format cannot hold it.
        """
        self.rows, shape, (target, *_) = rows, rows.shape, rows.plan.targets
        self.placed = target.unit is not None
        is_bare = shape.kind == POSE and shape.notation is None and bool(self.request.rows.poses)
        has_none = is_bare and not target.notations
        no_points = "points" not in FORMATS[self.style.format].writes
        if (is_bare and self.request.keeps_position and not has_none) or (has_none and no_points):
            raise FormatError(NO_ROTATION.format(rows.columns), source=self.source, line=int(self.is_table))
        self.shape = shape._replace(kind=POINT) if has_none else shape

    def _placed(self, poses: RowPoses, names: Sequence[str]) -> RowPoses:
        """Return points with their own covariance only, and geodetic positions as read if they are written again.

        names: of the numbers after each point
        """
        place, operation = self.shape.place, self.request.operation
        if self.looks_up_places:
            poses = poses._replace(parents=EARTH_FRAMES[:1])
        every = operation.extras(self.rows.shape)
        if self.shape.kind == POINT and len(names) < len(every):  # rows that were read as poses
            columns = [*range(3), *(3 + every.index(name) for name in names)]
            poses = poses._replace(numbers=poses.numbers[:, columns])
        is_written = holds(self.style.format, "recording") or self.style.place
        if not is_written or place is None or place.name != "lla" or not operation.keeps_frames:
            return poses
        inputs = self.rows.inputs
        inputs[:, np.isnan(poses.numbers[:, 0])] = np.nan
        fields = tuple(field for field in place.fields if field[:3] in ("lat", "lon", "alt", "msl", "und"))
        return poses._replace(read=np.column_stack(place._replace(fields=fields).lla([*inputs[: len(fields)]])))


# --- tables as frames ---


def read(file: InputFile, options: Options) -> Iterator[EdgeColumns]:
    """Yield the rows of a table as poses of one frame, or of the frames that their columns name.

    Raises or reports FormatError with the line of a row without a valid pose.
    """
    fmt = FORMATS[file.format].rows
    if what := not_text(file.head()):
        raise FormatError(what, source=file.name)
    request = Request(rows=RowOptions(normalize=options.normalize, stamps=SOME), on_error=SKIP)
    converter = FormatConverter(file.format, request, file.name, answers=options.answers)
    named, line, count = dict[int, str](), 0, 0
    for block, outcome in converter.steps(cast("ByteStream", file.stream)):
        if not line:
            rows, line = converter.rows, 1
            if converter.shape.kind != POSE:  # positions on the Earth
                raise FormatError(NO_ROTATION.format(rows.columns), source=file.name, line=1)
            named = {role: rows.table.name(at) for role, at in enumerate(rows.layout.named) if at is not None}
            lacking = ", ".join(name for role, name in enumerate(("parent", "name")) if role not in named)
            if lacking and not rows.layout.times and not (fmt.counted or options.answers.stamps):
                wanted = "frames that stand still have parent and name, one that moves stamp or stamp_ns"
                missing = f"no column {lacking} nor stamp among {rows.columns}; {wanted}, or --stamps FILE"
                raise FormatError(missing, source=file.name, line=1)
            if any(map(may_be_uncertain, rows.table.names or ())):
                options.tally.note(LEFT_OUT.format("a table of frames"), line)
            fmt = fmt if converter.shape.place is None else fmt._replace(frames=(EARTH_FRAMES[0], *fmt.frames[1:]))
        nameless = {
            row: Fault(line + int(block.lines[row]), column, "no name of a frame")
            for role, column in named.items()
            for names in [block.for_each((block.parents, block.names)[role])]
            for row, name in enumerate(() if all(names) else names)
            if not name
        }
        faults, parts = [each._replace(line=line + each.line) for each in outcome.faults], [block]
        if block.stamps_ns is not None and (bare := block.stamps_ns == NO_STAMP).any():
            static, moving = (kept(block, np.flatnonzero(each)) for each in (bare, ~bare))
            parts = [static._replace(stamps_ns=None), moving]
            if len(named) < 2:
                column = rows.table.name(rows.layout.times[0])
                faults += [Fault(line + at, column, "no stamp") for at in parts.pop(0).lines.tolist()]
        for note in (each for each in outcome.notes if each.about == DEGREES):
            options.tally.note(note.sentence.replace("give --deg, or ", ""), line + note.line, DEGREES)
        for fault in [*faults, *nameless.values()]:
            options.report(BadRow(fault, str(fault.reason), source=file.name))
        for part in parts:
            if len(part.numbers):
                yield _edges(part, line, fmt, options)
        line, count = line + outcome.lines, count + len(block.numbers)
    if len(named) < 2:
        describe(options, fmt, count)
    if fmt.rotation == "matrix":
        options.tally.projected = converter.rows.off
    else:
        options.tally.rough += [1] * converter.rows.mended


def _edges(block: RowPoses, line: int, fmt: Rows, options: Options) -> EdgeColumns:
    """Return the poses of a block as edges; with stamps the frames move."""
    poses = [*map(tuple, block.numbers.tolist())]
    stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
    bare, usual = options.tally.names.bare, options.answers.names(*fmt.frames)
    parents, names = (
        [bare(name or other) for name in block.for_each(each)]
        for each, other in zip((block.parents, block.names), usual, strict=True)
    )
    options.tally.axes |= dict.fromkeys(names, options.answers.camera_axes or fmt.axes)
    lines = (block.lines + line).tolist()
    return EdgeColumns(parents, names, stamps or [None] * len(poses), poses, lines, is_ordered=stamps is not None)
