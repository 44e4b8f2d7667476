"""The rows of a table as poses rather than text: for trees, and for results in another form than the table's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from frametool.stream.blocks import Run, State
from frametool.stream.faults import Fault
from frametool.stream.header import listed
from frametool.stream.output_columns import NAMED
from frametool.stream.row_layout import POSE, Shape
from frametool.stream.rows import chosen
from frametool.stream.run import notes_of
from frametool.stream.stamp_columns import parse_stamps
from frametool.stream.table import UNCLOSED, table_block
from frametool.stream.table_names import Naming, coded, rename_of
from frametool.stream.table_plan import plan_table
from frametool.stream.trajectory_columns import in_nanoseconds, stamp_column
from frametool.text.cells import torn_record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from frametool.stream.output_columns import Layout
    from frametool.stream.request import Request
    from frametool.stream.run import RowNote
    from frametool.stream.table_stream import Begun
    from frametool.text.array_types import Floats, Ints
    from frametool.text.spans import Spans

    Cells: TypeAlias = Spans | NDArray[Any]


class RowPoses(NamedTuple):
    """What became of the rows of a block: the good ones, in their order.

    numbers: (n, k) the results, position first
    stamps_ns: (n,) or None where rows have none
    lines: (n,) from 0
    parents, names: one a row, one for all, or none
    extras: columns that are not ours, by name: cells of text, or numbers as they are
    given: the frames that the rows of the input are given in
    """

    numbers: Floats
    stamps_ns: Ints | None
    lines: Ints
    parents: Sequence[str | None]
    names: Sequence[str | None]
    extras: Mapping[str, Cells]
    given: Sequence[str | None] = ()


class TablePoses:
    """Turn one block of a table after the other into poses; the rows that are bad are listed in `faults`.

    faults, notes: of the last block, lines from 0
    rows, mended: how many rows there were, and rotations that were normalised; off: how far the worst one was
    """

    def __init__(self, begun: Begun, form: str, request: Request, source: str) -> None:
        """Plan the rows; the request's notations say which numbers come out.

        Raises FormatError for a table without a pose, Misused for a request that does not fit.
        """
        self.table = begun.table
        self.form = form
        self.plan, layout = plan_table(self.table, request._replace(whole=True), source)
        self.shape = self.plan.shapes[0] if self.plan.shapes else Shape(POSE)
        named = request.for_kind(self.shape.kind)
        self.naming = Naming(self.table, layout, named)
        rename = rename_of(named)
        self.unnamed = (None, None) if rename is None else rename(None, None)
        self.roles = [role for role, place in enumerate(self.naming.places) if place is not None]
        self.stamp_at = layout.time
        if layout.time is None and (found := stamp_column(self.table.names)) not in layout.frames:
            self.stamp_at = found
        used = {self.stamp_at, *layout.places, *self.naming.places}
        self.kept = [place for place in range(self.table.width) if place not in used]
        self.layout = self._with_stretches(layout)
        self.state = State()
        self.faults: list[Fault] = []
        self.notes: list[RowNote] = []
        self.rows, self.mended, self.off = 0, 0, 0.0

    def _with_stretches(self, layout: Layout) -> Layout:
        """Ask for the stamps, the columns that are not ours, one by one, and the names of the results."""
        stretches = [(place, place, "cell", "cell") for place in self.kept]
        stretches += [(role, role, NAMED, NAMED) for role in self.roles]
        return layout._replace(stretches=tuple(stretches), time=self.stamp_at, pieces=())

    @property
    def columns(self) -> str:
        """List the columns there are."""
        return listed(self.table.names or ("columns without names",))

    def of_block(self, text: bytes) -> RowPoses:
        """Return the poses of a block, and leave what is wrong with other rows in `faults`."""
        torn = torn_record(text, self.table.delimiter) if self.table.delimiter else None
        body = text if torn is None else text[:torn]
        block = table_block(self.table, self.layout, body, self.naming, nulls=False)
        stamps, late = self._stamps(block.stamps)
        run = Run(self.plan, block._replace(bad={**late, **block.bad}), self.state)
        self.faults = run.faults()
        if torn is not None:
            self.faults.append(Fault(text.count(b"\n", 0, torn), "", UNCLOSED, final=True))
        self.mended += len(run.mended)
        self.off = max(self.off, run.off)
        self.notes = notes_of(run, block)
        parts = block.parts if len(run.rows) == run.count else [chosen(part, run.rows) for part in block.parts]
        texts = {self.table.name(place): part for place, part in zip(self.kept, parts, strict=False)}
        names: list[Sequence[str | None]] = [[name] for name in self.unnamed]
        for role, part in zip(self.roles, parts[len(self.kept) :], strict=True):
            names[role] = _texts(part)
        lines = block.places[run.rows]
        if b'"' in body:
            lines = np.array([block.line_of(row) for row in run.rows.tolist()], np.int64)
        self.rows += len(block.places) + len(block.broken)
        return RowPoses(
            run.results, None if stamps is None else stamps[run.rows], lines, names[0], names[1], texts,
            block.frames,
        )

    def _stamps(self, cells: Sequence[tuple[Spans, ...]]) -> tuple[Ints | None, dict[int, tuple[str, str]]]:
        """Read the stamps of a block; return them, and which rows have none that can be read."""
        if self.stamp_at is None or not cells:
            return None, {}
        name = self.table.name(self.stamp_at)
        times, reasons = parse_stamps(*cells[0], in_ns=in_nanoseconds(self.form, name))
        return times, {row: (name, reason) for row, reason in reasons.items()}


def _texts(part: Spans) -> Sequence[str | None]:
    """Return names, one for all rows where all are the same."""
    if not len(part.starts):
        return [None]
    texts, codes = coded(part)
    return [texts[0] or None] if len(texts) == 1 else [texts[code] or None for code in codes.tolist()]
