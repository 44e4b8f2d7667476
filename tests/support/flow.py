"""Streams run in this process: text in, text out, what was told, and the exit status."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FrametoolError
from frametool.formats.table import readers
from frametool.geometry.representations import notation
from frametool.stream.faults import MOST, BadRows
from frametool.stream.record_stream import run_records
from frametool.stream.request import Operation, Request
from frametool.stream.run import run
from frametool.stream.table_stream import run_table

if TYPE_CHECKING:
    from io import BufferedReader

QUARTER = (1.0, 2.0, 3.0, 0.0, 0.0, 0.7071067811865476, 0.7071067811865476)
MOVE = Request(Operation(left=QUARTER, moves=True), pose_from_frame=lambda _own: QUARTER, rename=lambda _parent, name: (None, name))
INVERT = Request(Operation(inverse=True))


def convert(specs: str) -> Request:
    return Request(notations=tuple(notation(spec) for spec in specs.split(",")))


class Flow(NamedTuple):
    text: bytes
    told: list[str]
    status: int


def flow(
    text: bytes | BufferedReader,
    request: Request,
    form: str = "csv",
    *,
    header: bool = True,
    size: int = 0,
    most: int = MOST,
) -> Flow:
    stream = io.BytesIO(text) if isinstance(text, bytes) else text
    out = io.BytesIO()
    told: list[str] = []
    bad = BadRows("in", request.on_error, most=most, tell=lambda error: told.append(str(error)))
    try:
        if form in readers("records"):
            outcomes = run_records(stream, form, request, source="in", size=size)
        else:
            outcomes = run_table(stream, form, request, source="in", header=header, size=size)
        status = run(outcomes, lambda block: [out.write(block)].clear(), bad, lambda _rows, _size: None)
    except FrametoolError as error:
        told.append(str(error))
        status = error.exit_code
    return Flow(out.getvalue(), told, status)
