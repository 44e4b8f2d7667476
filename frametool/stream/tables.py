"""A table from first byte to last: its head once, then block after block."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from frametool.errors import FormatError
from frametool.stream.blocks import Run, State
from frametool.stream.rows import written
from frametool.stream.run import Outcome, mapped
from frametool.stream.table import open_table, table_block
from frametool.stream.table_plan import TUM, plan_table
from frametool.text.cells import whole_records
from frametool.text.lines import read_blocks, whole_lines

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from frametool.stream.blocks import Plan
    from frametool.stream.layout import Layout
    from frametool.stream.request import Request
    from frametool.stream.table import Table
    from frametool.text.lines import Source

DELIMITERS = {"csv": b",", "tsv": b"\t", "columns": b"", "tum": b""}


def run_table(
    stream: Source,
    form: str,
    request: Request,
    *,
    source: str,
    header: bool = True,
    jobs: int = 1,
    size: int = 0,
) -> Generator[Outcome]:
    """Give the outcomes of a table's blocks, the first one its head; `size` bytes a block if given."""
    delimiter = DELIMITERS[form]
    options = {"size": size} if size else {}
    blocks = read_blocks(stream, whole=whole_records if delimiter else whole_lines, **options)
    first = _first_rows(blocks, delimiter)
    if first is None:
        raise FormatError("nothing in it", source=source)
    table, rest = open_table(first, delimiter, header=header, source=source)
    table = _as_tum(table, form)
    plan, layout = plan_table(table, request, source)
    head = table.head + (layout.header(table.header) + table.line_end if table.header else b"")
    taken = len(first) - len(rest)
    yield Outcome(head, lines=first.count(b"\n", 0, taken), size=taken)
    work = Work(table, plan, layout)
    yield from mapped(work, chain((rest,) if rest else (), blocks), 1 if work.remembers else jobs)


def _first_rows(blocks: Iterator[bytes], delimiter: bytes) -> bytes | None:
    """Give the first blocks, up to one that holds more than comments."""
    text = b""
    for block in blocks:
        text += block
        if delimiter or any(line.strip() and not line.startswith(b"#") for line in block.splitlines()):
            return text
    return text or None


def _as_tum(table: Table, form: str) -> Table:
    """Name the columns of a trajectory without a header."""
    if table.names or table.delimiter or not (form == "tum" or table.width == len(TUM)):
        return table
    return table._replace(names=TUM, width=len(TUM))


class Work:
    """What is done to each block of a table; holds what one block leaves for the next."""

    def __init__(self, table: Table, plan: Plan, layout: Layout) -> None:
        """Begin before the first row."""
        self.table = table
        self.plan = plan
        self.layout = layout
        self.state = State()
        self.remembers = plan.unwrap or plan.operation.of == "previous"

    def __call__(self, text: bytes) -> Outcome:
        """Process one block."""
        block = table_block(self.table, self.layout, text)
        run = Run(self.plan, block, self.state)
        faults = run.faults()
        doubted = [(block.line_of(row), angle) for row, angle in run.doubted[:1]]
        rows = len(block.places) + len(block.broken)
        return Outcome(
            written(run.groups(run.first_fault())), faults, rows, text.count(b"\n"), len(run.mended), doubted, len(text)
        )
