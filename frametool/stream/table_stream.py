"""A table from first byte to last: its head once, then block after block."""

from __future__ import annotations

import re
from contextlib import suppress
from itertools import chain
from typing import TYPE_CHECKING

from frametool.errors import FormatError, FrametoolError, listing
from frametool.stream.blocks import Run, State
from frametool.stream.faults import NULL, Fault, Misused
from frametool.stream.rows import written
from frametool.stream.run import Outcome, RowNote, mapped
from frametool.stream.table import UNCLOSED, open_table, table_block
from frametool.stream.table_names import Naming
from frametool.stream.table_plan import TUM, plan_table
from frametool.text.cells import RecordEnds, torn_record
from frametool.text.lines import BLOCK_BYTES, read_blocks

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from frametool.stream.blocks import Plan
    from frametool.stream.output_columns import Layout
    from frametool.stream.request import Request
    from frametool.stream.stamp_source import Timed
    from frametool.stream.table import Table
    from frametool.text.lines import ByteStream

STAMPS = re.compile(r"[#% ]*(?:.*[._])?(?:stamp|timestamp|time|t)(?:_ns|_s)?\s*(?:[\[(].*)?", re.IGNORECASE)
DELIMITERS = {"csv": b",", "tsv": b"\t", "semicolon": b";", "columns": b"", "tum": b""}


def run_table(
    stream: ByteStream,
    form: str,
    request: Request,
    *,
    source: str,
    header: bool = True,
    jobs: int = 1,
    size: int = 0,
) -> Generator[Outcome]:
    """Yield the outcomes of a table's blocks, the first one its head; `size` bytes a block if given."""
    delimiter = DELIMITERS[form]
    blocks = _blocks(stream, delimiter, size)
    first = _first_rows(blocks, delimiter)
    if first is None:
        raise FormatError("nothing in it", source=source)
    table, rest = open_table(first, delimiter, header=header, source=source)
    table = _as_tum(table, form, request)
    unasked = None
    if request.timed is not None and request.operation.formula is not None:
        name = request.timed.name or _stamp_column(table, source)
        request = request._replace(timed=request.timed._replace(name=name))
    elif request.timed is not None and not request.timed.name:  # rows have no header
        unasked, request = _stamps_unasked(table, request.timed), request._replace(timed=None)
    if request.beside == "":
        request = request._replace(beside=_usual_stamps(table, source))
    plan, layout = plan_table(table, request, source)
    taken = len(first) - len(rest)
    yield Outcome(table.opening(layout), lines=first.count(b"\n", 0, taken), size=taken)
    named = request.for_kind(plan.shapes[0].kind) if plan.shapes else request
    work = TableWork(table, plan, layout, Naming(table, layout, named), unasked)
    yield from mapped(work, chain((rest,) if rest else (), blocks), 1 if request.in_order else jobs)


def _blocks(stream: ByteStream, delimiter: bytes, size: int) -> Iterator[bytes]:
    """Return blocks of whole rows; cells in quotes may hold line ends."""
    size = size or BLOCK_BYTES
    if not delimiter:
        return read_blocks(stream, size=size)
    return read_blocks(stream, size=size, whole=RecordEnds(delimiter))


def _first_rows(blocks: Iterator[bytes], delimiter: bytes) -> bytes | None:
    """Return the first blocks, up to one that holds more than comments."""
    text = b""
    for block in blocks:
        text += block
        if delimiter or any(line.strip() and not line.startswith(b"#") for line in block.splitlines()):
            return text
    return text or None


def _as_tum(table: Table, form: str, request: Request) -> Table:
    """Name the columns of a trajectory without a header, unless --from says what they are."""
    if table.names or request.given or not (form == "tum" or table.width == len(TUM)):
        return table
    return table._replace(names=TUM, width=len(TUM))


def _stamp_column(table: Table, source: str) -> str:
    """Name the column of stamps that an expression asks for; raises Misused where none looks so."""
    name = next(filter(STAMPS.fullmatch, table.names or ()), None)
    if name is None:
        known = f"; columns: {listing(table.names)}" if table.names else ""
        raise Misused(f"@ row: no column looks like stamps; name it with --time-column{known}", source=source, line=1)
    return name


def _stamps_unasked(table: Table, timed: Timed) -> Timed | None:
    """Find a column of stamps that no option names."""
    name = next(filter(STAMPS.fullmatch, table.names or ()), None)
    return None if name is None else timed._replace(name=name)


def _usual_stamps(table: Table, source: str) -> str:
    """Return the name of the column of stamps that no option names."""
    name = next(filter(STAMPS.fullmatch, table.names or ()), None)
    if name is None:
        columns = f"; columns: {', '.join(table.names)}" if table.names else ""
        raise Misused(f"rows have no column of stamps; give --time-column{columns}", source=source, line=1)
    return name


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
        block = table_block(self.table, self.layout, text, self.naming, nulls=self.plan.on_error == NULL)
        run = Run(self.plan, block, self.state)
        faults = run.faults()
        notes = [RowNote.of_degrees(block.line_of(row), angle) for row, angle in run.doubted[:1]]
        notes += [RowNote.of_lost_name(block.line_of(row), name) for row, name in block.lost]
        if self.unasked is not None and len(block.places) and _moves(self.unasked, set(block.frames) or {None}):
            notes.append(RowNote.of_latest(block.line_of(0), self.unasked.name))
            self.unasked = None
        notes += [RowNote.of_rounding(block.line_of(row)) for row in sorted(run.mended)[:1]]
        rows = len(block.places) + len(block.broken)
        return Outcome(
            written(run.groups(run.first_fault())),
            faults,
            rows,
            text.count(b"\n"),
            len(run.mended),
            sorted(notes),
            len(text),
        )


def _moves(timed: Timed, frames: set[str | None]) -> bool:
    """Tell whether the way from one of some frames depends on the time; rows of unknown frames say so themselves."""
    for frame in frames:
        with suppress(FrametoolError):
            if timed.moves(frame):
                return True
    return False
