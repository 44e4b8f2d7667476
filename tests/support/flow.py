"""Streams run in this process: text in, text out, what was told, and the exit status.

The one place where tests know how the engine is asked.
"""

from __future__ import annotations

import io
import sys
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from sized import sized

from frametool import sizes
from frametool.documents.source import Source
from frametool.errors import FrametoolError, ValueInvalid
from frametool.formats.table import readers
from frametool.frames.stamps import read_stamp
from frametool.geometry.representations import notation
from frametool.grammar.readers import Reading
from frametool.grammar.result import Style
from frametool.rows.batch import read_stamps
from frametool.rows.faults import MOST, BadRows, run
from frametool.rows.plain import Entry, answer, read_poses, results
from frametool.rows.record import find_records
from frametool.rows.request import Operation, Request, ResultOptions, RowOptions
from frametool.rows.sources.records import run_records
from frametool.rows.sources.tables import run_table
from frametool.text.spans import MARGIN, Spans, framed

if TYPE_CHECKING:
    from collections.abc import Sequence
    from io import BufferedIOBase

    from frametool.geometry import Rigid
    from frametool.grammar.pose import Pose

Asked: TypeAlias = Request
QUARTER = (1.0, 2.0, 3.0, 0.0, 0.0, 0.7071067811865476, 0.7071067811865476)
ON_ERROR = ("stop", "skip", "null")


def asked(**options: Any) -> Asked:
    """Ask for an operation, by the fields of `Operation`, with options, by those of `Request` and what it is made of."""
    operation = {name: options.pop(name) for name in [*options] if name in Operation._fields}
    rows, results = ({name: options.pop(name) for name in [*options] if name in each._fields} for each in (RowOptions, ResultOptions))
    return Request(Operation(**operation), RowOptions(**rows), ResultOptions(**results), **options)


MOVE = asked(left=QUARTER, moves=True, pose_from_frame=lambda _own: QUARTER, rename=lambda _parent, name: (None, name))
INVERT = asked(inverse=True)


def convert(specs: str) -> Asked:
    return asked(notations=tuple(notation(spec) for spec in specs.split(",")))


class Flow(NamedTuple):
    text: bytes
    told: list[str]
    status: int


def flow(
    text: bytes | BufferedIOBase,
    request: Asked,
    form: str = "csv",
    *,
    header: bool = True,
    size: int = 0,
    most: int = MOST,
) -> Flow:
    """Run a stream; size: bytes a block, 0 as usual."""
    stream = io.BytesIO(text) if isinstance(text, bytes) else text
    out = io.BytesIO()
    told: list[str] = []
    bad = BadRows("in", request.on_error, most=most, tell=lambda error: told.append(str(error)))
    try:
        with sized(block=size or sizes.BLOCK):
            if form in readers("records"):
                outcomes = run_records(stream, form, request, source="in")
            else:
                outcomes = run_table(stream, form, request, source="in", header=header)
            status = run(outcomes, lambda block: [out.write(block)].clear(), bad, lambda _rows, _size: None)
    except FrametoolError as error:
        told.append(str(error))
        status = error.exit_code
    return Flow(out.getvalue(), told, status)


def calls(text: bytes, request: Asked) -> int:
    """Count the calls that a run makes, into Python and out of it."""
    count = 0

    def counted(_frame: object, event: str, _argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(counted)
    try:
        flow(text, request)
    finally:
        sys.setprofile(None)
    return count


def poses_in(text: str, **options: Any) -> list[Pose]:
    """Read the poses of an argument."""
    return read_poses(Source("f", text), asked(**options))


def values_of(text: str, request: Asked) -> list[Any]:
    """Give the results of the records of an argument."""
    return [*results(Source("argument", text), request, Style("json", request.results.notations))]


class Moving:
    """A record of texts, its numbers, and what becomes of them where it is moved."""

    def __init__(self, fields: dict[str, Any]) -> None:
        self.request = asked(moves=True)
        (self.record,) = find_records(fields, self.request, Reading(Source("test", "")), (0,))
        self.own: Sequence[float] = self.record.values[: self.record.shape.own_size]

    def by(self, edge: Rigid) -> Sequence[float]:
        """Return the numbers behind an edge."""
        made = answer(Entry(self.record, self.request.target(self.record.shape), edge), {}, self.request)
        assert made is not None
        return made.parts


def stamps_of(cells: list[str], *, in_ns: bool) -> list[int | str]:
    """Read a column of stamps; what is none gives the reason."""
    texts = [cell.encode() for cell in cells]
    lengths = np.array([len(text) for text in texts], np.int64)
    ends = np.cumsum(lengths + 1) - 1 + MARGIN
    stamps, reasons = read_stamps((Spans(framed(b",".join(texts)), ends - lengths, ends),), in_ns=in_ns)
    return [reasons.get(row, stamp) for row, stamp in enumerate(stamps.tolist())]


def stamp_of(cell: str, *, in_ns: bool) -> int | str:
    """Read one stamp, or give the reason why it is none."""
    try:
        return read_stamp(cell, in_ns=in_ns)
    except ValueInvalid as error:
        return str(error)
