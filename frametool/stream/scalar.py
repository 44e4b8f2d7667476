"""One record at a time with plain floats: for the few records of a typed line or of another command, without numpy."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from frametool.errors import FrametoolError, ValueInvalid
from frametool.geometry import floats, rigid
from frametool.stream.row_layout import IDENTITY, POSE, pose_of
from frametool.stream.stamp_source import read_stamp
from frametool.stream.text_parts import Const, In, Out

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.types import Components, Rigid
    from frametool.stream.request import Request
    from frametool.stream.template import Entry, Learned


def result_of(record: Learned, request: Request) -> str:
    """Return the text of a record's result; raises ValueInvalid for what is no rotation, or too large."""
    numbers: list[float] = []
    locked = False
    first = 0
    for entry, edge in zip(record.entries, _edges(record, request), strict=True):
        count = len(entry.holder.values)
        parts = _moved(entry, edge, record.values[first : first + count], request)
        pose = parts[:7] if len(parts) > 3 else parts
        numbers += [*entry.target.numbers(pose, floats), *parts[7:]]
        locked = locked or bool(entry.target.locked(pose))
        first += count
    if not all(map(isfinite, numbers)):
        raise ValueInvalid("the result is not finite: the numbers are too large")
    write = number_writer(request.precision, yaml=not record.json)
    return _text(record, [write(number) for number in numbers], locked=locked)


def _edges(record: Learned, request: Request) -> list[Rigid | None]:
    """Return the poses that move the entries, at their own times if they have such."""
    timed, segments = request.timed, record.segments()
    if timed is None:
        return [entry.edge for entry in record.entries]
    try:
        stamps = [read_stamp(segments[index], in_ns=timed.in_ns) for index in record.stamps]
        return [timed.pose(entry.holder.parent[0], at) for entry, at in zip(record.entries, stamps, strict=True)]
    except FrametoolError as error:
        error.column_name = timed.name  # type: ignore[attr-defined]
        raise


def _moved(entry: Entry, edge: Rigid | None, values: Sequence[float], request: Request) -> Components:
    shape = entry.holder.shape
    if shape.kind != POSE:
        return request.operation.point(shape.kind, shape.position(values), edge)
    rotation: Components = IDENTITY
    if shape.notation is not None:
        given = shape.rotation(values)
        rotation = shape.notation.checked_quaternion(given, floats, degrees=shape.degrees, normalize=request.normalize)
    pose: Rigid = pose_of(shape.position(values), rotation)
    return request.operation.pose([rigid.inverse(*pose) if shape.inverse else pose], edge, floats)


def number_writer(precision: int | None, *, yaml: bool) -> Callable[[float], str]:
    """Return what writes a number as the bulk of a stream does."""
    if precision is not None:
        return lambda value: f"{value:.{precision}f}"
    if not yaml:
        return repr

    def write(value: float) -> str:
        text = repr(value)
        return text if "e" not in text or "." in text else text.replace("e", ".0e")

    return write


def _text(record: Learned, numbers: Sequence[str], *, locked: bool) -> str:
    segments = record.segments()
    text = ""
    for piece in record.pieces:
        if isinstance(piece, In):
            text += segments[piece.part]
        elif isinstance(piece, Out):
            text += numbers[piece.first]
        elif isinstance(piece, Const) or locked:
            text += piece.text.decode()
    return text
