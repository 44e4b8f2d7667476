"""A table from first byte to last: its head once, then block after block."""

from __future__ import annotations

from contextlib import suppress
from itertools import chain
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FormatError, FrametoolError, Misused, listing
from frametool.formats.table import FORMATS
from frametool.grammar.readers import NORMALS, stamp_places
from frametool.stream.evaluate import Run, State
from frametool.stream.faults import STOP, Fault, Outcome, RowNote
from frametool.stream.header import listed
from frametool.stream.layout import New
from frametool.stream.request import VELOCITIES
from frametool.stream.row_layout import POSE, Shape
from frametool.stream.row_poses import RowPoses, taken
from frametool.stream.rows import Block, written
from frametool.stream.table import (
    BYTE_ORDER_MARK,
    UNCLOSED,
    Naming,
    as_trajectory,
    at_other_times,
    open_table,
    table_block,
    without_comments,
)
from frametool.stream.table_plan import own_count, plan_table
from frametool.text.cells import Cells, RecordEnds, torn_record
from frametool.text.lines import read_blocks, whole_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence

    from frametool.stream.request import Request
    from frametool.stream.stamp_source import Timed
    from frametool.stream.table import Table
    from frametool.text.lines import ByteStream
    from frametool.text.spans import Floats, Ints


def run_table(
    stream: ByteStream, fmt: str, request: Request, *, source: str, header: bool = True
) -> Generator[Outcome]:
    """Yield the outcomes of a table's blocks, the first one its head."""
    rows = TableRows(stream, fmt, request, source, header=header)
    yield Outcome(rows.table.opening(rows.layout), lines=rows.lines, size=rows.taken)
    for text in rows.texts:
        run, outcome, _ = rows.of_text(text)
        end, broken = None, [place for place, _ in run.block.broken]
        if request.on_error == STOP and (run.reasons or broken):  # what is before the first bad row is written
            end = min([*run.block.places[[*run.reasons]].tolist(), *broken])
        yield outcome._replace(text=written(run.groups(end)))


def _first_rows(blocks: Iterator[bytes]) -> bytes | None:
    """Return the first blocks, up to one that holds more than comments."""
    text = b""
    for block in blocks:
        text += block
        if without_comments(text.removeprefix(BYTE_ORDER_MARK)):
            return text
    return text or None


def settle_stamps(table: Table, request: Request, source: str) -> tuple[Request, Timed | None]:
    """Find the column of stamps that a request needs; or, where no option names one, the one nobody asked for."""
    timed, extra, operation = request.timed, request.rows.extra_column, request.operation
    found, _ = stamp_places(table.names)

    def stamps(who: str) -> str:
        if found is None:
            known = f"; columns: {listing(table.names)}" if table.names else ""
            message = f"{who}: no column looks like stamps; name it with --time-column{known}"
            raise Misused(message, source=source, line=1)
        return table.name(found)

    is_cut = (request.window or request.offset_ns) and extra is None and not (timed and timed.name)
    if extra == "" or is_cut:
        who = "a velocity" if operation.of == VELOCITIES else "--start, --stop, --time-offset"
        request = request.with_rows(extra_column=stamps(who))
    if timed is None or timed.name:
        return request, None
    if operation.formula is not None and not operation.shown:
        return request._replace(timed=timed._replace(name=stamps("@ row"))), None
    return request._replace(timed=None), None if found is None else timed._replace(name=table.name(found))


class PlannedRows:
    """Rows that are planned: what is done with each, what it is called, and what one block leaves for the next.

    A request for all numbers makes poses of them; its notations say which numbers come out.
    off: how far the worst rotation was from one; mended: how many were normalised
    inputs: the numbers of the last rows that became poses as read, a row a column
    """

    def __init__(
        self, table: Table, request: Request, source: str, normals: Sequence[tuple[str, ...]] = NORMALS, *,
        stamped: bool = True,
    ) -> None:  # fmt: skip
        """Plan the rows of a table; raises FormatError or Misused where they do not fit what is asked for.

        normals: the columns of vectors that turn with points; stamped: a column with the name of a stamp is one
        """
        self.table = table
        self.request, self.unasked = settle_stamps(table, request, source)
        self.plan, self.layout = plan_table(table, self.request, source, normals, stamped=stamped)
        self.shape = self.plan.shapes[0] if self.plan.shapes else Shape(POSE)
        self.naming = Naming(table, self.layout, self.request.for_kind(self.shape.kind), self.shape)
        if request.gathered is not None:
            request.gathered.stamped |= stamp_places(table.names)[0] is not None
        self.state = State()
        self.mended, self.off = 0, 0.0

    @property
    def columns(self) -> str:
        """List the columns there are."""
        return listed(self.table.names or ("columns without names",))

    @property
    def roles(self) -> list[int]:
        """Return whether columns name the parent (0) and what a row is the pose of (1)."""
        return [role for role, place in enumerate(self.naming.places) if place is not None]

    def ran(self, block: Block) -> Run:
        """Return what becomes of a block."""
        run = Run(self.plan, block, self.state)
        self.mended += len(run.mended)
        self.off = max(self.off, run.off)
        return run

    def notes_of(self, run: Run) -> list[RowNote]:
        """Return warnings about the rows of a block."""
        notes = list(run.notes)
        if self.unasked is not None and run.count and moves_in_time(self.unasked, {*run.block.frames[0]}):
            remedy = f"give --time-column {quote(self.unasked.name)}, or --at TIME"
            ignored = f"column {self.unasked.name!r} is not looked at, rows move at the latest time; {remedy}"
            notes.append(RowNote(run.block.line_of(0), "latest", ignored))
            self.unasked = None
        return sorted(notes)

    def poses_of(self, run: Run, rows: Ints, numbers: Floats, column: Callable[[int], Any], lines: Ints) -> RowPoses:
        """Return the results of some rows of a block as poses; column: returns the cells of one for all rows."""
        layout, block = self.layout, run.block
        self.inputs = np.reshape(run.columns, (len(run.columns), run.count))[:, rows]
        used = {layout.time, layout.below, *layout.places, *self.naming.places}
        others = [place for place in range(self.table.width) if place not in used]
        extras = {self.table.name(place): taken(column(place), rows) for place in others}
        own = own_count(self.plan, numbers.shape[1])
        extra = [each for each in layout.columns if isinstance(each, New) and each.number >= own]
        extras |= {each.name: numbers[:, each.number] for each in extra}
        stamps = None if layout.time is None else block.stamps[0][rows]
        parents, names = self.naming.texts(block.names, rows)
        return RowPoses(numbers[:, :own], stamps, lines, parents, names, extras)


class TableRows(PlannedRows):
    """The rows of a table, block by block.

    texts: those of the blocks; taken, lines: how many bytes and lines the head had
    """

    def __init__(
        self, stream: ByteStream, fmt: str, request: Request, source: str, *, header: bool = True
    ) -> None:
        """Read the head of a table in a format, and plan its rows; raises FormatError or Misused."""
        delimiter = (FORMATS[fmt].rows.delimiter or "").encode()
        blocks = read_blocks(stream, whole=RecordEnds(delimiter) if delimiter else whole_lines)
        first = _first_rows(blocks)
        if first is None:
            raise FormatError("nothing in it", source=source)
        known = request.rows.given or request.rows.given_place
        table, rest = open_table(first, fmt, header=header, source=source, expected=known)
        super().__init__(as_trajectory(table, fmt, request, source), request, source)
        self.texts = chain((rest,) if rest else (), blocks)
        self.taken = len(first) - len(rest)
        self.lines = first.count(b"\n", 0, self.taken)

    def of_text(self, text: bytes) -> tuple[Run, Outcome, Cells]:
        """Return what becomes of a block, and its outcome; behind a quote that is not closed nothing is read."""
        torn = torn_record(text, self.table.delimiter) if self.table.delimiter else None
        body = text[:torn]
        if self.request.offset_ns and self.layout.time is not None:
            body = at_other_times(self.table, self.layout, body, self.request.offset_ns)
        cells = self.table.split(body)
        block = table_block(self.table, self.layout, cells, self.naming, self.request)
        run = self.ran(block)
        faults = run.faults()
        if torn is not None:
            faults.append(Fault(text.count(b"\n", 0, torn), "", UNCLOSED, final=True))
        rows = len(block.places) + len(block.broken)
        return run, Outcome(b"", faults, rows, text.count(b"\n"), len(run.mended), self.notes_of(run), len(text)), cells

    def blocks(self) -> Iterator[tuple[RowPoses, Outcome]]:
        """Yield the poses of all blocks."""
        for text in self.texts:
            run, outcome, cells = self.of_text(text)
            rows, numbers = run.settled()
            lines = run.block.places[rows]
            if b'"' in text:  # a cell may hold line ends
                lines = np.array([*map(run.block.line_of, rows.tolist())], np.int64)
            yield self.poses_of(run, rows, numbers, cells.column, lines), outcome


def moves_in_time(timed: Timed, frames: set[str | None]) -> bool:
    """Return True if the way from one of some frames depends on the time; rows of unknown frames say so themselves."""
    for frame in frames:
        with suppress(FrametoolError):
            if timed.moves(frame):
                return True
    return False
