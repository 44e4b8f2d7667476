"""The poses of a table as one list: read as streams read their rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.calc.values import LIST, POINT, POSE, Term, Type
from frametool.documents.source import opened
from frametool.errors import FormatError
from frametool.stream.faults import BadRow
from frametool.stream.operation import Operation
from frametool.stream.request import Request
from frametool.stream.table_stream import run_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.types import Components, Namespace, Number


class _Collector:
    """An expression over rows that keeps them."""

    columns: tuple[str, ...] = ()
    reads_row = adds = True
    needs_time = False

    def __init__(self) -> None:
        self.kept = ""
        self.blocks: list[Components] = []

    def kind(self, row: str) -> str:
        """Write nothing."""
        self.kept = row
        return ""

    def extras(self, row: str) -> tuple[str, ...]:  # noqa: ARG002 - there are none
        """Write nothing."""
        return ()

    def rename(self, row: str, parent: str | None, name: str | None) -> tuple[str | None, str | None]:  # noqa: ARG002
        """Leave frames as they are."""
        return parent, name

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace  # noqa: ARG002
    ) -> Components:
        """Keep the rows of a block."""
        self.blocks.append(parts)
        return (0.0,) * 7


def poses_of_table(path: str, form: str, *, normalize: bool, degrees: bool) -> Term:
    """Return the poses or points of a table as a list; raises FormatError at the first bad row."""
    import numpy as np

    collector = _Collector()
    request = Request(Operation(moves=True, formula=collector), normalize=normalize, degrees=degrees)
    line = 1
    file: Any = opened(path)
    with file as stream:
        for outcome in run_table(stream, form, request, source=path):
            if outcome.faults:
                fault = outcome.faults[0]
                raise BadRow(fault._replace(line=fault.line + line), fault.reason, source=path)
            line += outcome.lines
    rows = [
        np.stack([np.broadcast_to(part, np.broadcast_shapes(*map(np.shape, block))) for part in block], axis=-1)
        for block in collector.blocks
    ]
    if not rows or not sum(map(len, rows)):
        raise FormatError("no rows in it", source=path)
    type_ = Type(POSE if collector.kept == POSE else POINT)
    items = tuple(Term(type_, tuple(row)) for block in rows for row in block.tolist())
    return Term(Type(LIST), (), items=items)
