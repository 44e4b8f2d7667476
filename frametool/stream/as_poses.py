"""Streams whose results come out in another format than theirs: rows of tables and listed poses, block by block.

rows or listed poses -> the operation -> blocks of poses -> the text of the other format

`read` makes of the rows of a table frames that move, of which each is a pose at its time:

stamp,x,y,z,qx,qy,qz,qw                      frames as --frames says, `world` and `body` if it does not
stamp_ns,parent,name,x,y,yaw_deg             each row names its frames
parent,name,x,y,z,roll,pitch,yaw             no stamps: frames that are static

Without names of columns rows are those of tum, t x y z qx qy qz qw,

    1305031102.1758 1.34 0.62 1.65 0.657 0.612 -0.295 -0.311

of kitti, three rows of a matrix,

    1.0 0.0 0.0 0.5 0.0 1.0 0.0 0.0 0.0 0.0 1.0 2.0

or of euroc, nanoseconds, x y z, qw qx qy qz, and what else it has:

    1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, BinaryIO, TypeAlias, cast

import numpy as np

from frametool.documents.source import InputFile, not_text
from frametool.errors import FormatError, Misused, ValueInvalid, warn
from frametool.formats.rows.pose_rows import IMAGE, NUMBER, StampFile, describe, rows_of
from frametool.formats.table import FORMATS, Rows, holds, is_trajectory
from frametool.frames.stamps import BILLION
from frametool.geometry.representations import notation
from frametool.grammar.edges import Answers, Diagnostics, EdgeColumns, Options, Topics, stop
from frametool.grammar.readers import EARTH_FRAMES
from frametool.grammar.result import Result, Style
from frametool.stream.evaluate import Plan, Run, State
from frametool.stream.faults import NULL, STOP, BadRow, Fault, Outcome, written_by
from frametool.stream.record_results import BlockResults, ResultWriter, blocks_of
from frametool.stream.request import NO_STAMPS, SOME, Request, RowOptions
from frametool.stream.row_layout import POINT, POSE, Shape
from frametool.stream.rows import NO_ROWS, NO_STAMP, Block, RowPoses, block_of, kept, spans_of
from frametool.stream.table import PlannedRows, TableRows
from frametool.stream.writers import LEARNED, PoseWriter, RowsWriter, SingleWriter, TextWriter

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from frametool.geometry.types import Components
    from frametool.stream.record_values import Value
    from frametool.text.lines import ByteStream
    from frametool.text.spans import Ints

    Step: TypeAlias = tuple[RowPoses, Outcome]  # what a block became, and what is reported about it

QUATERNION = notation("quaternion")
NO_ROTATION = "no rotation among the columns {}: poses are wanted"
AS_VALUES = Style("json")  # of results that are not written


def writer_for(style: Style, first: RowPoses) -> PoseWriter:
    """Return what writes blocks in the format of a style: text, columns of numbers, or messages of a recording."""
    if holds(style.format, "arrays"):
        from frametool.stream.array_writer import ArrayWriter

        return ArrayWriter(style, first)
    if holds(style.format, "recording"):
        from frametool.stream.recording_writer import RecordingWriter

        return RecordingWriter(style, first)
    text = TextWriter if rows_of(style.format) else SingleWriter
    return (RowsWriter if style.format in LEARNED else text)(style, first)


class Blocks(ResultWriter):
    """Write blocks of things of one kind, those of the first block, in the format of a style."""

    def __init__(self, style: Style) -> None:
        """Begin without any."""
        self.style = style
        self.writer: PoseWriter | None = None

    def of_block(self, block: RowPoses | BlockResults) -> bytes:
        """Return the text of a block of poses, or of results, many together."""
        if isinstance(block, RowPoses):
            return self._write(block)
        if (posed := block.posed()) is not None:
            return self._write(posed)
        values, to_arrays = [*block.in_order()], holds(self.style.format, "arrays")
        is_any = any(not isinstance(each, Result) or each.pose.position is not None for each in values)
        placed = is_any or not to_arrays if self.writer is None else self.writer.placed
        return self._write(block_of(values, placed=placed, timed=not to_arrays)) if values else b""

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last."""
        if self.writer is None:
            self._write(NO_ROWS)
        yield from self.writer.end()  # type: ignore[union-attr]

    def _write(self, block: RowPoses) -> bytes:
        if self.writer is None:
            self.writer = writer_for(self.style, block)
        if block.kind != self.writer.kind:
            raise ValueInvalid(f"one file holds things of one kind, found {self.writer.kind} and {block.kind}")
        if block.placed > self.writer.placed:
            block = block._replace(numbers=block.numbers[:, 3:], placed=False)
        return self.writer.of_block(block)


def poses_text(values: Iterable[Value], style: Style) -> str:
    """Return single results as text of a format whose rows are poses."""
    writer = Blocks(style)
    return b"".join((*map(writer.of_block, blocks_of(values)), *writer.end())).decode()


class FormatConverter:
    """Convert a stream of poses or points to another format, block by block.

    rows: those of a table, or of columns of numbers, once steps have begun
    tally: what was assumed about a trajectory
    """

    rows: PlannedRows

    def __init__(
        self, fmt: str, request: Request, source: str, style: Style = AS_VALUES, answers: Answers = Answers()  # noqa: B008
    ) -> None:
        """Take what is asked for; raises Misused for what only a table can hold."""
        if request.results.keep or (request.results.prefix and request.operation.formula is None):
            raise Misused("--keep and --prefix are for tables that stay in their form")
        self.fmt = fmt
        self.source = source
        self.answers = answers
        self.tally = Diagnostics()
        self.is_table = FORMATS[fmt].is_table
        self.style = style.changed()
        self.request = request.with_results(all_numbers=True, notations=(QUATERNION,), keep_sign=True, place=None)
        # whose TARGET each row was checked for
        self.looks_up_places = request.results.place is not None and not request.rows.poses
        self.to_arrays, self.has_points = ("arrays" in (writes := FORMATS[style.format].writes)), "points" in writes
        if request.on_error == NULL and not (self.is_table and (self.to_arrays or style.format in LEARNED)):
            raise Misused(f"--on-error null: {style.format} of {fmt} cannot hold a row without a result; give skip")

    def outcomes(self, stream: ByteStream, *, header: bool = True) -> Generator[Outcome]:
        """Yield the text of the results, block by block, and what comes behind the last."""
        yield from written_by(Blocks(self.style), self._to_write(stream, header=header), self.request.on_error)
        for finding in self.tally.findings():
            warn(f"{self.source}:{finding.line}: {finding.message}")

    def _to_write(self, stream: ByteStream, *, header: bool) -> Iterator[Outcome]:
        """Yield the blocks that are written: up to the first bad row where that ends the stream."""
        operation, place, is_any = self.request.operation, self.style.place, False
        for poses, outcome in self.steps(stream, header=header):
            has_more = poses.more and poses.kind != POSE and operation.formula is not None
            if not is_any and (operation.only_adds or not poses.kind or has_more):
                wanted = self.style.format
                raise Misused(f"a stream of {self.fmt} with such results stays one; leave -f {wanted} out")
            is_any, notes, left = True, [*outcome.notes], poses
            if self.request.on_error == STOP and outcome.faults:
                left = kept(poses, slice(0, int(np.searchsorted(poses.lines, outcome.faults[0].line))))
            if place is not None and place.words:
                from frametool.stream.earth_columns import zone_notes

                if len(there := np.flatnonzero(~np.isnan(left.numbers[:, 0]))):
                    columns = place.numbers(*np.ascontiguousarray(left.numbers[there, :3].T))
                    notes += zone_notes(place, columns, left.lines[there].tolist().__getitem__)
            yield outcome._replace(results=left, notes=notes, kept=len(left.numbers))
        if not is_any:
            raise FormatError("nothing in it", source=self.source)

    def steps(self, stream: ByteStream, *, header: bool = True) -> Iterator[Step]:
        """Yield the results of one block after the other; of rows first a block without any."""
        if self.is_table:
            steps = self._rows(stream, header=header)
        else:
            steps = self._columns(stream) if "arrays" in FORMATS[self.fmt].reads else self._listed(stream)
        for poses, outcome in steps:
            names, prefix = self.request.operation.extras(self.shape), self.request.results.prefix
            own = self._of_position(poses, names) if self.shape.kind == POINT and len(poses.numbers) else poses
            kind, more = self.request.operation.result_kind(self.shape.kind), tuple(prefix + name for name in names)
            yield own._replace(kind=kind, placed=self.placed, more=more), outcome

    def _of_position(self, poses: RowPoses, names: Sequence[str]) -> RowPoses:
        """Return points with their own covariance, of rows that were read as poses without a rotation."""
        every = self.request.operation.extras(self.rows.shape)
        columns = [*range(3), *(3 + every.index(name) for name in names)]
        return poses._replace(numbers=poses.numbers[:, columns]) if len(names) < len(every) else poses

    def _begin(self, rows: PlannedRows, line: int = 0) -> None:
        """Decide what rows become: without a rotation points, where nobody asked for one; raises FormatError."""
        self.rows, shape, (target, *_) = rows, rows.shape, rows.plan.targets
        self.placed = target.unit is not None
        is_bare = shape.kind == POSE and shape.notation is None and bool(self.request.rows.poses)
        has_none = is_bare and not target.notations
        if (is_bare and self.request.keeps_position and not has_none) or (has_none and not self.has_points):
            raise FormatError(NO_ROTATION.format(rows.columns), source=self.source, line=line)
        self.shape = shape._replace(kind=POINT) if has_none else shape

    # --- rows of tables, and of columns of numbers ---

    def _rows(self, stream: ByteStream, *, header: bool) -> Iterator[Step]:
        """Yield the rows of a table, with the stamps of a file, their own, or their numbers as seconds."""
        fmt = FORMATS[self.fmt].rows
        file = StampFile(self.answers.stamps) if self.answers.stamps else None
        rows = TableRows(stream, self.fmt, self.request, self.source, header=header)
        self._begin(rows, line=1)
        yield NO_ROWS, Outcome(b"", lines=rows.lines, size=rows.taken)
        count = 0
        for text in rows.texts:
            run, outcome, cells = rows.of_text(text)
            chosen, numbers = run.settled()
            lines = run.block.places[chosen]
            if b'"' in text:  # a cell may hold line ends
                lines = np.array([*map(run.block.line_of, chosen.tolist())], np.int64)
            before, count = count, count + len(numbers)
            poses = self._with_place(rows.poses_of(run, chosen, numbers, cells.column, lines))
            if self.looks_up_places:
                poses = poses._replace(parents=EARTH_FRAMES[:1])
            if file:
                poses = poses._replace(stamps_ns=np.array(file.between(before, count), np.int64))
            elif fmt.counted and poses.stamps_ns is None and self.request.rows.stamps != NO_STAMPS:
                poses = poses._replace(stamps_ns=np.arange(before, count) * BILLION)
            yield poses._replace(stamps_ns=self._held(poses.stamps_ns, fmt)), outcome
        if file:
            file.finish(count, self.source)
        if is_trajectory(self.fmt):
            describe(Options(self.tally, Topics(), answers=self.answers), fmt, count, named=False)

    def _held(self, stamps_ns: Ints | None, fmt: Rows) -> Ints | None:
        """Return stamps, unless they only count and the other format has no place for them: they are not lost then."""
        counts, other = bool(fmt.counted) and not self.answers.stamps, self.style.format
        are_lost = self.request.rows.stamps == NO_STAMPS or holds(other, "recording") or FORMATS[other].rows.counted
        return None if counts and are_lost else stamps_ns

    def _columns(self, stream: ByteStream) -> Iterator[Step]:
        """Yield the rows of columns of numbers; those that stand for no point have no place in a text."""
        from frametool.stream.column_stream import ColumnRows, move_along

        opened = import_module(FORMATS[self.fmt].reader).open_columns(self._opened(stream)[0])
        rows = ColumnRows(opened, self.request, self.source)
        move_along(opened, self.request)
        self._begin(rows)
        yield rows.poses(opened.nothing()), Outcome(b"")
        left_out = 0
        for batch in opened.batches():
            poses = self._with_place(rows.poses(batch))
            if not self.to_arrays and self.request.on_error != NULL:
                there = np.flatnonzero(~np.isnan(poses.numbers[:, 0]))
                left_out += len(poses.numbers) - len(there)
                poses = kept(poses, there)
            yield poses, rows.outcome(batch)
        if left_out:
            count = f"{left_out} {'row' if left_out == 1 else 'rows'}"
            warn(f"{self.source}: {count} without numbers left out: {self.style.format} has no place for them")

    def _opened(self, stream: ByteStream) -> tuple[InputFile, Options]:
        """Return the stream as a file, and how it is read."""
        file = InputFile("-" if self.source == "stdin" else self.source, cast("BinaryIO", stream))
        file.format = self.fmt
        return file, Options(self.tally, Topics(), normalize=self.request.rows.normalize, answers=self.answers)

    def _with_place(self, poses: RowPoses) -> RowPoses:
        """Add to points of the Earth their lat, lon and alt as they were read, where these are written again."""
        place, inputs = self.shape.place, self.rows.inputs
        is_written = holds(self.style.format, "recording") or self.style.place
        if not is_written or place is None or place.name != "lla" or not self.request.operation.keeps_frames:
            return poses
        inputs[:, np.isnan(poses.numbers[:, 0])] = np.nan
        fields = tuple(field for field in place.fields if field[:3] in ("lat", "lon", "alt", "msl", "und"))
        return poses._replace(read=np.column_stack(place._replace(fields=fields).lla([*inputs[: len(fields)]])))

    # --- formats that list poses ---

    def _listed(self, stream: ByteStream) -> Iterator[Step]:
        """Yield the poses of a format whose lines are no table."""
        module, request = import_module(FORMATS[self.fmt].reader), self.request
        if request.rows.frames:
            raise ValueInvalid("poses do not say their frame; name SOURCE")
        if request.operation.columns:
            raise FormatError(f"{self.fmt} lists poses and has no columns; convert it to csv first", source=self.source)
        if request.rows.poses > 1:
            raise FormatError(f"{self.fmt} lists one pose after the other; two a row are wanted", source=self.source)
        faults: list[Fault] = []
        report = stop
        if request.on_error != STOP:
            report = lambda error: faults.append(Fault(max(error.line, 1) - 1, "", error.message))  # noqa: E731
        file, options = self._opened(stream)
        fmt: Rows = module.form_of(file, options)
        self.placed, self.shape, state, timed = True, Shape(POSE, 1.0, ((QUATERNION, False),)), State(), request.timed
        edge_of = request.pose_from_frame if request.operation.moves and timed else None
        bare = request._replace(timed=timed if timed and timed.name else None)
        bare = bare.with_rows(extra_column=None).with_results(unwrap=False)
        target = self.shape._replace(keep_sign=True)
        plan = Plan((self.shape,), (target,), bare, ("x", "y", "z", *QUATERNION.columns), edge_of=edge_of)
        rename = request.for_kind(POSE).rename or (lambda parent, name: (parent, name))
        for each in module.blocks(file, options._replace(report=report), named=False):
            lines = [row.line - 1 for row in each.rows]
            stamps = [each.stamps_ns + request.offset_ns]
            block = Block(np.array(each.poses).T.copy(), {}, np.arange(len(lines)), lines.__getitem__, stamps=stamps)
            done = Run(plan, block, state)
            written = [each.rows[row] for row in done.rows.tolist()]
            extras = {}
            if any(row.image for row in written):
                extras[IMAGE] = spans_of([row.image.encode() for row in written])
            if self.fmt == self.style.format:
                extras[NUMBER] = spans_of([b"%d" % row.number for row in written])
            own = any(row.names for row in written)
            pairs = [rename(*(row.names or (None, None))) for row in (written if own else written[:1])]
            parents, names = zip(*pairs, strict=True) if pairs else ((None,), (None,))
            times = None if own else self._held(stamps[0][done.rows], fmt)
            places = np.array(lines, np.int64)[done.rows]
            poses = RowPoses(done.results[done.rows], times, places, parents, names, extras)
            found, count = sorted(faults + done.faults()), len(lines) + len(faults)
            yield poses, Outcome(b"", found, count, notes=sorted(done.notes))
            faults.clear()


# --- tables as frames ---


def read(file: InputFile, options: Options) -> Iterator[EdgeColumns]:
    """Yield the rows of a table as poses of one frame, or of those that its columns name.

    Raises or reports FormatError with the line of a row that is no pose.
    """
    fmt = FORMATS[file.format].rows
    if what := not_text(file.head()):
        raise FormatError(what, source=file.name)
    request = Request(rows=RowOptions(normalize=options.normalize, stamps=SOME))
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
    """Return the poses of a block, of frames that move where they have stamps."""
    columns: Components = tuple(block.numbers.T)
    if len(columns) == len("xyzw"):
        columns = (*[columns[0] * 0.0] * 3, *columns)
    poses = [*zip(*(column.tolist() for column in columns), strict=True)]
    stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
    bare, usual = options.tally.names.bare, options.answers.names(*fmt.frames)
    parents, names = (
        [bare(name or other) for name in block.for_each(each)]
        for each, other in zip((block.parents, block.names), usual, strict=True)
    )
    options.tally.axes |= dict.fromkeys(names, options.answers.camera_axes or fmt.axes)
    lines = (block.lines + line).tolist()
    return EdgeColumns(parents, names, stamps or [None] * len(poses), poses, lines, is_ordered=stamps is not None)
