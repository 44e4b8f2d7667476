"""Streams whose results come out in another format than theirs: rows of tables and listed poses, block by block.

rows or listed poses -> the operation -> blocks of poses -> the text of the other format
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from frametool.documents.source import InputFile
from frametool.errors import FormatError, Misused, ValueInvalid, warn
from frametool.formats.rows.pose_rows import IMAGE, NUMBER, StampFile, describe, rows_of
from frametool.formats.table import FORMATS, is_recording, is_trajectory
from frametool.geometry.representations import notation
from frametool.grammar.edges import Diagnostics, Options, Topics, stop
from frametool.grammar.names import EARTH_FRAMES
from frametool.stream.column_stream import ColumnRows, move_along
from frametool.stream.evaluate import Plan, Run, State
from frametool.stream.faults import NULL, STOP, Fault, Outcome, RowNote
from frametool.stream.row_layout import POINT, POSE, Shape, Target
from frametool.stream.row_poses import RowPoses, kept
from frametool.stream.rows import Block, spans_of
from frametool.stream.table import rename_of
from frametool.stream.table_stream import TableRows, begin_table, stamps_for
from frametool.stream.writers import LEARNED, TextWriter

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Sequence
    from io import BufferedReader

    from frametool.formats.rows.pose_lists import PoseBlock
    from frametool.formats.table import Poses
    from frametool.grammar.edges import Answers
    from frametool.grammar.result import Style
    from frametool.stream.array_writer import ArrayWriter
    from frametool.stream.recording_writer import RecordingWriter
    from frametool.stream.request import Request
    from frametool.stream.table_stream import PlannedRows

    Step: TypeAlias = tuple[RowPoses, Outcome]  # what a block became, and what is reported about it
    BlockWriter: TypeAlias = "TextWriter | ArrayWriter | RecordingWriter"

QUATERNION = notation("quaternion")


def writer_for(style: Style, kind: str = POSE, extras: Sequence[str] = (), *, placed: bool = True) -> BlockWriter:
    """Return what writes blocks in the format of a style: text, columns of numbers, or messages of a recording.

    kind: pose, point, ..; extras: the numbers with each; placed: whether poses have a position
    """
    writes = FORMATS[style.format].writes
    if "arrays" in writes:
        from frametool.stream.array_writer import ArrayWriter

        return ArrayWriter(style, kind, extras, placed=placed)
    if "recording" in writes:
        from frametool.stream.recording_writer import RecordingWriter

        return RecordingWriter(style, kind, extras, placed=placed)
    return TextWriter(style, kind, extras, placed=placed)


class FormatConverter:
    """Convert a stream of poses or points to another format, block by block."""

    def __init__(self, fmt: str, request: Request, style: Style, source: str, answers: Answers) -> None:
        """Take what is asked for; raises Misused for what only a table can hold."""
        if request.keep or (request.prefix and request.operation.formula is None):
            raise Misused("--keep and --prefix are for tables that stay in their form")
        self.fmt = fmt
        self.source = source
        self.answers = answers
        self.tally = Diagnostics()
        self.is_table = FORMATS[fmt].is_table
        self.module: Any = None if self.is_table else import_module(FORMATS[fmt].reader)
        self.style = style.changed()
        self.request = request._replace(all_numbers=True, notations=(QUATERNION,), keep_sign=True, place=None)
        self.looks_up_places = request.place is not None and not request.poses  # whose TARGET each row was checked for
        self.stamps = StampFile(answers.stamps) if answers.stamps else None
        self.to_arrays, self.has_points = ("arrays" in (writes := FORMATS[style.format].writes)), "points" in writes
        if request.on_error == NULL and not (self.is_table and (self.to_arrays or style.format in LEARNED)):
            raise Misused(f"--on-error null: {style.format} of {fmt} cannot hold a row without a result; give skip")
        self.without = 0  # rows of an array that stand for no point or pose, and have no place in a text

    def outcomes(self, stream: BufferedReader, *, header: bool = True) -> Generator[Outcome]:
        """Yield the text of the results, block by block, and what comes behind the last."""
        writer: BlockWriter | None = None
        for made, outcome in self.steps(stream, header=header):
            if self.request.gathered is not None:
                yield outcome
                continue
            if writer is None:
                writer = self._writer()
            poses = made
            if self.request.on_error == STOP and outcome.faults:
                poses = kept(made, slice(0, int(np.searchsorted(made.lines, outcome.faults[0].line))))
            text = writer.of_block(poses)
            yield outcome._replace(text=text, notes=[*outcome.notes, *self._zones(poses)])
        if writer is None and self.request.gathered is None:
            raise FormatError("nothing in it", source=self.source)
        if writer is not None:
            yield from map(Outcome, writer.end())
        for finding in self.tally.findings():
            warn(f"{self.source}:{finding.line}: {finding.message}")

    def steps(self, stream: BufferedReader, *, header: bool = True) -> Iterator[Step]:
        """Yield the results of one block after the other."""
        if self.is_table:
            return self._rows(stream, header=header)
        return self._columns(stream) if "arrays" in FORMATS[self.fmt].reads else self._listed(stream)

    def _writer(self) -> BlockWriter:
        """Choose what writes the results, by what they are."""
        operation = self.request.operation
        kind = operation.result_kind(self.shape.kind)
        extras = [self.request.prefix + name for name in self.request.extras(self.shape)]
        if operation.only_adds or not kind or (extras and kind != POSE and operation.formula is not None):
            raise Misused(f"a stream of {self.fmt} with such results stays one; leave -f {self.style.format} out")
        return writer_for(self.style, kind, extras, placed=self.placed)

    def _zones(self, poses: RowPoses) -> list[RowNote]:
        """Return the warnings about the zones of results in UTM."""
        place = self.style.place
        there = np.flatnonzero(~np.isnan(poses.numbers[:, 0])) if place is not None and place.words else ()
        if place is None or not len(there):
            return []
        from frametool.stream.earth_columns import zone_notes

        x, y, z = (np.ascontiguousarray(poses.numbers[there, at]) for at in range(3))
        numbers = place.numbers(x, y, z)
        return zone_notes(place, numbers, lambda row: int(poses.lines[there[row]]))

    def _settle(self, rows: PlannedRows, line: int = 0) -> None:
        """Decide what rows become: without a rotation points, where nobody asked for one; raises FormatError."""
        shape, plan = rows.shape, rows.plan
        self.placed = plan.targets[0].unit is not None
        is_bare = shape.kind == POSE and shape.notation is None and bool(self.request.poses)
        has_none = is_bare and not plan.targets[0].notations
        if (is_bare and self.request.keeps_position and not has_none) or (has_none and not self.has_points):
            message = f"no rotation among the columns {rows.columns}: {self.style.format} is written of poses"
            raise FormatError(message, source=self.source, line=line)
        self.shape = shape._replace(kind=POINT) if has_none else shape

    # --- rows of tables, and of columns of numbers ---

    def _rows(self, stream: BufferedReader, *, header: bool) -> Iterator[Step]:
        """Yield the rows of a table."""
        fmt, request = FORMATS[self.fmt].poses, self.request
        begun = begin_table(stream, self.fmt, request, source=self.source, header=header)
        rows = TableRows(begun.table, request, self.source)
        self._settle(rows, line=1)
        count = 0
        none = RowPoses(np.empty((0, 7)), None, np.empty(0, np.int64), [None], [None], {})
        yield none, Outcome(b"", lines=begun.lines, size=begun.taken)
        for block, _, outcome in rows.blocks(begun):
            poses = self._with_place(block, rows)
            if self.looks_up_places:
                poses = poses._replace(parents=EARTH_FRAMES[:1])
            stamps = stamps_for(poses, self.stamps, fmt, count)
            poses = poses._replace(stamps_ns=self._held(stamps, fmt) if fmt.counted else stamps)
            count += len(poses.numbers)
            yield poses, outcome
        if self.stamps:
            self.stamps.finish(count, self.source)
        if is_trajectory(self.fmt):
            describe(Options(self.tally, Topics(), answers=self.answers), fmt, count, named=False)

    def _held(self, stamps_ns: Any, fmt: Poses) -> Any:
        """Return stamps, unless they only count and the other format has no place for them: they are not lost then."""
        rows = rows_of(self.style.format)
        counts = bool(fmt.counted) and self.stamps is None
        has_room = not is_recording(self.style.format) and "stamps" in getattr(rows, "holds", ("stamps",))
        return stamps_ns if has_room or not counts else None

    def _columns(self, stream: BufferedReader) -> Iterator[Step]:
        """Yield the rows of columns of numbers."""
        file = InputFile(self.source if self.source != "stdin" else "-", stream)
        file.format = self.fmt
        opened = self.module.open_columns(file, Options(self.tally, Topics(), answers=self.answers))
        rows = ColumnRows(opened, self.request, self.source)
        move_along(opened, self.request)
        self._settle(rows)
        yield rows.poses(opened.nothing()), Outcome(b"")
        for batch in opened.batches():
            poses = self._with_place(rows.poses(batch), rows)
            if not self.to_arrays and self.request.on_error != NULL:
                there = np.flatnonzero(~np.isnan(poses.numbers[:, 0]))
                self.without += len(poses.numbers) - len(there)
                poses = kept(poses, there)
            yield poses, rows.outcome(batch)
        if self.without:
            count = f"{self.without} {'row' if self.without == 1 else 'rows'}"
            warn(f"{self.source}: {count} without numbers left out: {self.style.format} has no place for them")

    def _with_place(self, poses: RowPoses, rows: PlannedRows) -> RowPoses:
        """Add to points of the Earth their lat, lon and alt as they were read, where these are written again."""
        operation = self.request.operation
        if not (is_recording(self.style.format) or self.style.place) or not operation.keeps_frames:
            return poses
        rows.inputs[:, np.isnan(poses.numbers[:, 0])] = np.nan
        read = operation.place_as_read(self.shape, lambda size: [*rows.inputs[:size]])
        return poses._replace(read=np.column_stack(read)) if read else poses

    # --- formats that list poses ---

    def _listed(self, stream: BufferedReader) -> Iterator[Step]:
        """Yield the poses of a format whose lines are no table."""
        file = InputFile(self.source if self.source != "stdin" else "-", stream)
        faults: list[Fault] = []
        report = stop
        if self.request.on_error != STOP:
            report = lambda error: faults.append(Fault(max(error.line, 1) - 1, "", error.message))  # noqa: E731
        options = Options(self.tally, Topics(), report, normalize=self.request.normalize, answers=self.answers)
        file.format = self.fmt
        fmt: Poses = self.module.form_of(file, options)
        request = self.request
        if request.frames:
            raise ValueInvalid("poses do not say their frame; name SOURCE")
        if request.poses > 1:
            raise FormatError(f"{self.fmt} lists one pose after the other; two a row are wanted", source=self.source)
        self.placed, self.shape = True, Shape(POSE, 1.0, QUATERNION)
        plan = _plan(request)
        state = State()
        rename = rename_of(request) or (lambda parent, name: (parent, name))
        for each in self.module.blocks(file, options, named=False):
            block = _block(each._replace(stamps_ns=each.stamps_ns + request.offset_ns))
            done = Run(plan, block, state)
            good = done.rows.tolist()
            written = [each.rows[row] for row in good]
            images = [row.image for row in written]
            extras = {IMAGE: spans_of([image.encode() for image in images])} if any(images) else {}
            if self.fmt == self.style.format:
                extras[NUMBER] = spans_of([b"%d" % row.number for row in written])
            lines = np.array([row.line for row in written], np.int64)
            own = any(row.names for row in written)
            pairs = [rename(*(row.names or (None, None))) for row in (written if own else written[:1])]
            parents, names = zip(*pairs, strict=True) if pairs else ((None,), (None,))
            stamps = None if own else block.stamps[0][done.rows]
            poses = RowPoses(done.results[done.rows], self._held(stamps, fmt), lines, parents, names, extras)
            found = sorted(faults + done.faults())
            yield poses, Outcome(b"", found, len(each.rows) + len(faults), 0, notes=sorted(done.notes))
            faults.clear()


def _plan(request: Request) -> Plan:
    """Plan poses that are no text."""
    shape = Shape(POSE, 1.0, QUATERNION)
    target = Target(1.0, ((QUATERNION, False),), keep_sign=True)
    edge = request.pose_from_frame if request.operation.moves and request.timed is not None else None
    timed = request.timed if request.timed is not None and request.timed.name else None
    request = request._replace(timed=timed, extra_column=None, unwrap=False)
    return Plan((shape,), (target,), request, ("x", "y", "z", "qx", "qy", "qz", "qw"), edge_of=edge)


def _block(poses: PoseBlock) -> Block:
    """Make a block of rows of poses."""
    numbers, rows = np.array(poses.poses).T.copy(), poses.rows
    return Block(numbers, (), np.arange(len(rows)), lambda row: rows[row].line - 1, stamps=[poses.stamps_ns])
