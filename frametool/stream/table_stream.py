"""A table from first byte to last: its head once, then block after block."""

from __future__ import annotations

import re
from contextlib import suppress
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, FrametoolError, Misused, listing, warn
from frametool.formats.table import FORMATS
from frametool.grammar.names import NORMAL_NAMES, RATES, stamp_places
from frametool.stream.evaluate import Run, State
from frametool.stream.faults import Fault, Outcome, RowNote, notes_of
from frametool.stream.rows import written
from frametool.stream.table import (
    BYTE_ORDER_MARK,
    COMMENT,
    UNCLOSED,
    Naming,
    as_trajectory,
    at_other_times,
    open_table,
    table_block,
)
from frametool.stream.table_plan import plan_table, with_vectors
from frametool.text.cells import RecordEnds, torn_record
from frametool.text.lines import read_blocks, whole_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence

    from frametool.stream.evaluate import Plan
    from frametool.stream.layout import Layout
    from frametool.stream.request import Request
    from frametool.stream.stamp_source import Timed
    from frametool.stream.table import Table
    from frametool.text.lines import ByteStream


def run_table(
    stream: ByteStream, form: str, request: Request, *, source: str, header: bool = True
) -> Generator[Outcome]:
    """Yield the outcomes of a table's blocks, the first one its head."""
    table, rest, blocks, taken, lines = begin_table(stream, form, request, source=source, header=header)
    request = request if NORMAL_NAMES.isdisjoint(table.names or ()) else with_vectors(table.names, request)
    request, unasked = settle_stamps(table, request, source)
    plan, layout = plan_table(table, request, source)
    yield Outcome(table.opening(layout), lines=lines, size=taken)
    named = request.for_kind(plan.shapes[0].kind) if plan.shapes else request
    work = TableWork(table, plan, layout, Naming(table, layout, named), unasked)
    yield from map(work, chain((rest,) if rest else (), blocks))


class Begun(NamedTuple):
    """A table whose head was read: what follows of the first block, the other blocks, bytes and lines of the head."""

    table: Table
    rest: bytes
    blocks: Iterator[bytes]
    taken: int
    lines: int


def begin_table(stream: ByteStream, form: str, request: Request, *, source: str, header: bool = True) -> Begun:
    """Read the head of a table in a form; raises FormatError."""
    ends = _record_ends((FORMATS[form].delimiter or "").encode())
    blocks = read_blocks(stream, whole=ends())
    first = _first_rows(blocks)
    if first is None:
        raise FormatError("nothing in it", source=source)
    table, rest = open_table(first, form, header=header, source=source)
    table = as_trajectory(table, form, request, source)
    if request.operation.turns and not request.columns:
        _warn_of_vectors(table.names or (), source)
    taken = len(first) - len(rest)
    return Begun(table, rest, blocks, taken, first.count(b"\n", 0, taken))


def _warn_of_vectors(names: Sequence[str], source: str) -> None:
    """Warn of velocities and rates beside poses whose axes change: no name says in which frame they are given."""
    if found := [name for name in names if re.fullmatch(RATES, name)]:
        warn(f"{source}: {listing(found, 9)} keep to the old axes: poses and covariances turn alone")


def _record_ends(delimiter: bytes) -> Callable[[], Callable[[bytes], int]]:
    """Return what makes a finder of the ends of rows; cells in quotes may hold line ends."""
    return partial(RecordEnds, delimiter) if delimiter else lambda: whole_lines


def _first_rows(blocks: Iterator[bytes]) -> bytes | None:
    """Return the first blocks, up to one that holds more than comments."""
    text = b""
    for block in blocks:
        text += block
        lines = text.removeprefix(BYTE_ORDER_MARK).splitlines()
        if any(line.strip() and not line.startswith(COMMENT) for line in lines):
            return text
    return text or None


def settle_stamps(table: Table, request: Request, source: str) -> tuple[Request, Timed | None]:
    """Find the column of stamps that a request needs; or, where no option names one, the one nobody asked for."""
    timed = request.timed
    beside = request.extra_column
    if (request.window or request.offset_ns) and beside is None and not (timed and timed.name):
        beside = ""
    if beside == "":
        who = "a velocity" if request.operation.velocity else "--start, --stop, --time-offset"
        request = request._replace(extra_column=_stamp_column(table, source, who))
    if timed is None:
        return request, None
    if request.operation.formula is not None and not request.operation.shown:
        name = timed.name or _stamp_column(table, source, "@ row")
        return request._replace(timed=timed._replace(name=name)), None
    if timed.name:
        return request, None
    found, _ = stamp_places(table.names)
    return request._replace(timed=None), None if found is None else timed._replace(name=table.name(found))


def _stamp_column(table: Table, source: str, who: str) -> str:
    """Name the column of stamps that somebody asks for; raises Misused where none looks so."""
    found, _ = stamp_places(table.names)
    if found is None:
        known = f"; columns: {listing(table.names)}" if table.names else ""
        raise Misused(f"{who}: no column looks like stamps; name it with --time-column{known}", source=source, line=1)
    return table.name(found)


class TableWork:
    """Turn one block of a table after the other into its outcome; keeps what one block leaves for the next."""

    def __init__(self, table: Table, plan: Plan, layout: Layout, naming: Naming, unasked: Timed | None) -> None:
        """Take the plan of a table; `unasked` are the stamps that rows have and nobody asked for."""
        self.table = table
        self.plan = plan
        self.layout = layout
        self.naming = naming
        self.unasked = unasked
        self.state = State()

    def __call__(self, text: bytes) -> Outcome:
        """Process one block; a quote that is not closed takes all behind it along."""
        torn = torn_record(text, self.table.delimiter) if self.table.delimiter else None
        if torn is None:
            return self._done(text)
        done = self._done(text[:torn]) if torn else Outcome(b"")
        fault = Fault(text.count(b"\n", 0, torn), "", UNCLOSED, final=True)
        return done._replace(faults=[*done.faults, fault])

    def _done(self, text: bytes) -> Outcome:
        size = len(text)
        text = at_other_times(self.table, self.layout, text, self.plan.offset_ns)
        block = table_block(self.table, self.layout, text, self.naming)
        run = Run(self.plan, block, self.state)
        faults = run.faults()
        notes = notes_of(run, block)
        if self.unasked is not None and len(block.places) and moves_in_time(self.unasked, set(block.frames) or {None}):
            notes.append(RowNote.of_latest(block.line_of(0), self.unasked.name))
            self.unasked = None
        rows = len(block.places) + len(block.broken)
        return Outcome(
            written(run.groups(run.first_fault())),
            faults,
            rows,
            text.count(b"\n"),
            len(run.mended),
            sorted(notes),
            size,
        )


def moves_in_time(timed: Timed, frames: set[str | None]) -> bool:
    """Tell whether the way from one of some frames depends on the time; rows of unknown frames say so themselves."""
    for frame in frames:
        with suppress(FrametoolError):
            if timed.moves(frame):
                return True
    return False
