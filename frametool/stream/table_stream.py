"""A table from first byte to last: its head once, then block after block."""

from __future__ import annotations

from contextlib import suppress
from itertools import chain
from shlex import quote
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FormatError, FrametoolError, Misused, listing
from frametool.formats.table import FORMATS
from frametool.frames.stamps import BILLION
from frametool.grammar.names import NORMAL_NAMES, in_nanoseconds, stamp_places
from frametool.stream.evaluate import Run, State
from frametool.stream.faults import NULL, Fault, Outcome, RowNote, notes_of
from frametool.stream.header import listed
from frametool.stream.layout import NAMED, New
from frametool.stream.row_layout import POSE, Shape
from frametool.stream.row_poses import NO_STAMP, RowPoses
from frametool.stream.rows import chosen, written
from frametool.stream.stamp_columns import read_stamps
from frametool.stream.table import (
    BYTE_ORDER_MARK,
    COMMENT,
    UNCLOSED,
    Naming,
    as_trajectory,
    at_other_times,
    coded,
    open_table,
    table_block,
    unnamed,
)
from frametool.stream.table_plan import own_count, plan_table, with_vectors
from frametool.text.cells import RecordEnds, torn_record
from frametool.text.lines import read_blocks, whole_lines

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Sequence

    from frametool.formats.rows.pose_rows import StampFile
    from frametool.formats.table import Poses
    from frametool.stream.request import Request
    from frametool.stream.rows import Block
    from frametool.stream.stamp_source import Timed
    from frametool.stream.table import Table
    from frametool.text.lines import ByteStream
    from frametool.text.spans import Ints, Spans


def run_table(
    stream: ByteStream, fmt: str, request: Request, *, source: str, header: bool = True
) -> Generator[Outcome]:
    """Yield the outcomes of a table's blocks, the first one its head."""
    begun = begin_table(stream, fmt, request, source=source, header=header)
    names = begun.table.names
    request = request if NORMAL_NAMES.isdisjoint(names or ()) else with_vectors(names, request)
    rows = TableRows(begun.table, request, source)
    yield Outcome(begun.table.opening(rows.layout), lines=begun.lines, size=begun.taken)
    for text in begun.texts():
        run, outcome = rows.of_text(text)
        yield outcome._replace(text=written(run.groups(run.first_fault())))


class Begun(NamedTuple):
    """A table whose head was read: what follows of the first block, the other blocks, bytes and lines of the head."""

    table: Table
    rest: bytes
    blocks: Iterator[bytes]
    taken: int
    lines: int

    def texts(self) -> Iterator[bytes]:
        """Yield the text of the rows, block by block."""
        return chain((self.rest,) if self.rest else (), self.blocks)


def begin_table(stream: ByteStream, fmt: str, request: Request, *, source: str, header: bool = True) -> Begun:
    """Read the head of a table in a format; raises FormatError."""
    delimiter = (FORMATS[fmt].delimiter or "").encode()
    blocks = read_blocks(stream, whole=RecordEnds(delimiter) if delimiter else whole_lines)
    first = _first_rows(blocks)
    if first is None:
        raise FormatError("nothing in it", source=source)
    table, rest = open_table(first, fmt, header=header, source=source, expected=request.given or request.given_place)
    table = as_trajectory(table, fmt, request, source)
    taken = len(first) - len(rest)
    return Begun(table, rest, blocks, taken, first.count(b"\n", 0, taken))


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
    extra = request.extra_column
    if (request.window or request.offset_ns) and extra is None and not (timed and timed.name):
        extra = ""
    if extra == "":
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


class PlannedRows:
    """Rows that are planned: what is done with each, what it is called, and what one block leaves for the next.

    off: how far the worst rotation was from one; mended: how many were normalised
    """

    def __init__(self, table: Table, request: Request, source: str) -> None:
        """Plan the rows of a table; raises FormatError or Misused where they do not fit what is asked for."""
        self.table = table
        self.request, self.unasked = settle_stamps(table, request, source)
        self.plan, self.layout = plan_table(table, self.request, source)
        self.shape = self.plan.shapes[0] if self.plan.shapes else Shape(POSE)
        self.naming = Naming(table, self.layout, self.request.for_kind(self.shape.kind))
        if request.gathered is not None:
            request.gathered.stamped |= stamp_places(table.names)[0] is not None
        self.state = State()
        self.mended, self.off = 0, 0.0

    def ran(self, block: Block) -> Run:
        """Return what becomes of a block."""
        run = Run(self.plan, block, self.state)
        self.mended += len(run.mended)
        self.off = max(self.off, run.off)
        return run

    def notes_of(self, run: Run, frames: Sequence[str | None]) -> list[RowNote]:
        """Return warnings about the rows of a block; frames: that they are expressed in."""
        notes = notes_of(run, run.block)
        if self.unasked is not None and run.count and moves_in_time(self.unasked, {*frames} or {None}):
            remedy = f"give --time-column {quote(self.unasked.name)}, or --at TIME"
            ignored = f"column {self.unasked.name!r} is not looked at, rows move at the latest time; {remedy}"
            notes.append(RowNote(run.block.line_of(0), "latest", ignored))
            self.unasked = None
        return sorted(notes)


class TableRows(PlannedRows):
    """The rows of a table, block by block.

    stamp_at: the column of stamps that are read of each row, whoever needs them; stamps_ns: those of the last block
    """

    stamp_at: int | None = None
    stamps_ns: Ints | None = None

    def of_text(self, text: bytes) -> tuple[Run, Outcome]:
        """Return what becomes of a block, and its outcome; behind a quote that is not closed nothing is read."""
        torn = torn_record(text, self.table.delimiter) if self.table.delimiter else None
        body = at_other_times(self.table, self.layout, text[:torn], self.request.offset_ns)
        block = table_block(self.table, self.layout, body, self.naming)
        if self.stamp_at is not None and block.stamps:
            name = self.table.name(self.stamp_at)
            self.stamps_ns, reasons = read_stamps(block.stamps[0], in_ns=in_nanoseconds(name))
            self.stamps_ns[list(reasons)] = NO_STAMP
            block = block._replace(bad={**{row: (name, reason) for row, reason in reasons.items()}, **block.bad})
        run = self.ran(block)
        faults = run.faults()
        if torn is not None:
            faults.append(Fault(text.count(b"\n", 0, torn), "", UNCLOSED, final=True))
        notes = self.notes_of(run, block.frames)
        rows = len(block.places) + len(block.broken)
        return run, Outcome(b"", faults, rows, text.count(b"\n"), len(run.mended), notes, len(text))


class TablePoses(TableRows):
    """Turn one block of a table after the other into poses.

    inputs: the numbers of the last block's good rows as read, a row a column
    """

    def __init__(self, table: Table, request: Request, source: str) -> None:
        """Plan the rows; the request's notations say which numbers come out.

        Raises FormatError for a table without a pose, Misused for a request that does not fit.
        """
        super().__init__(table, with_vectors(table.names, request)._replace(all_numbers=True), source)
        layout = self.layout
        self.unnamed = unnamed(request, self.shape)
        self.roles = [role for role, place in enumerate(self.naming.places) if place is not None]
        if layout.time is None:
            time, below = stamp_places(table.names)
            if not table.names and not request.columns and min(layout.places, default=0) == 1:
                time = 0  # what is before the numbers that --from speaks of
            layout = layout._replace(time=None if time in layout.frames else time, below=below)
        self.stamp_at = layout.time
        used = {layout.time, layout.below, *layout.places, *self.naming.places}
        self.kept = [place for place in range(table.width) if place not in used]
        stretches = [(place, place, "cell", "cell") for place in self.kept]
        stretches += [(role, role, NAMED, NAMED) for role in self.roles]
        self.layout = layout._replace(stretches=tuple(stretches), pieces=())

    @property
    def columns(self) -> str:
        """List the columns there are."""
        return listed(self.table.names or ("columns without names",))

    def blocks(self, begun: Begun) -> Iterator[tuple[RowPoses, int, Outcome]]:
        """Yield the poses of all blocks of a table, each with the line, from 1, at which it begins."""
        line = 1 + begun.lines
        for text in begun.texts():
            poses, outcome = self.of_block(text)
            yield poses, line, outcome
            line += outcome.lines

    def of_block(self, text: bytes) -> tuple[RowPoses, Outcome]:
        """Return the poses of a block, and what is said of it."""
        run, outcome = self.of_text(text)
        rows, results, block = run.rows, run.results, run.block
        if self.request.on_error == NULL and run.reasons:
            rows = np.array(sorted({*run.rows.tolist(), *run.reasons}), np.int64)
            results = np.full((len(rows), run.results.shape[1]), np.nan)
            results[np.searchsorted(rows, run.rows)] = run.results
        self.inputs = np.reshape(run.columns, (len(run.columns), run.count))[:, rows]
        parts = block.parts if len(rows) == run.count else [chosen(part, rows) for part in block.parts]
        texts: dict[str, Any] = {self.table.name(place): part for place, part in zip(self.kept, parts, strict=False)}
        own = own_count(self.plan, results.shape[1])
        extra = [each for each in self.layout.columns if isinstance(each, New) and each.number >= own]
        texts |= {each.name: results[:, each.number] for each in extra}
        names: list[Sequence[str | None]] = [[name] for name in self.unnamed]
        for role, part in zip(self.roles, parts[len(self.kept) :], strict=True):
            names[role] = _texts(part)
        lines = block.places[rows]
        if b'"' in text:
            lines = np.array([block.line_of(row) for row in rows.tolist()], np.int64)
        stamps = None if self.stamps_ns is None else self.stamps_ns[rows]
        return RowPoses(results[:, :own], stamps, lines, names[0], names[1], texts, block.frames), outcome


def _texts(part: Spans) -> Sequence[str | None]:
    """Return names, one for all rows where all are the same."""
    if not len(part.starts):
        return [None]
    texts, codes = coded(part)
    return [texts[0] or None] if len(texts) == 1 else [texts[code] or None for code in codes.tolist()]


def stamps_for(block: RowPoses, file: StampFile | None, fmt: Poses, before: int) -> Ints | None:
    """Return the stamps of poses behind some: those of a file, their own, or their numbers as seconds."""
    size = len(block.numbers)
    if file:
        return np.array([file.at(before + at) for at in range(size)], np.int64)
    counts = block.stamps_ns is None and fmt.counted
    return np.arange(before, before + size, dtype=np.int64) * BILLION if counts else block.stamps_ns


def moves_in_time(timed: Timed, frames: set[str | None]) -> bool:
    """Return True if the way from one of some frames depends on the time; rows of unknown frames say so themselves."""
    for frame in frames:
        with suppress(FrametoolError):
            if timed.moves(frame):
                return True
    return False
