"""One record at a time with plain floats: for the few records of a typed line or of another command, without numpy."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FrametoolError, ValueInvalid, overheard
from frametool.geometry import floats, rigid
from frametool.stream.row_layout import FLAT, IDENTITY, LEAVES_PLANE, POSE, TURN, pose_of
from frametool.stream.stamp_source import read_header_stamp, read_stamp
from frametool.stream.text_parts import Const, IfLocked, In, Out

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.types import Components, Quaternion, Rigid
    from frametool.stream.record import Record
    from frametool.stream.request import Formula, Memory, Request
    from frametool.stream.row_layout import Shape
    from frametool.stream.template import Template


class Rendered(NamedTuple):
    """The text of a result, and what is odd about the numbers it comes from."""

    text: str
    mended: bool = False
    doubt: str = ""


def result_of(template: Template, request: Request) -> Rendered:
    """Return the text of a record's result; raises ValueInvalid for what is no rotation, or too large."""
    numbers: list[float] = []
    locked = mended = False
    doubt = ""
    first = 0
    for entry, edge, at in zip(template.entries, *_movers(template, request), strict=True):
        shape = entry.record.shape
        values = template.values[first : first + shape.size]
        parts, odd = moved(entry.record, edge, values, request, at)
        numbers += entry.target.written(parts, floats)
        for name, number in entry.target.left_out(parts, floats):
            if abs(number) > FLAT:
                raise ValueInvalid(LEAVES_PLANE.format(name, number))
        locked = locked or bool(entry.target.locked(parts))
        mended = mended or odd
        doubt = doubt or doubtful_angle(shape, values)
        first += shape.size
    if not all(map(isfinite, numbers)):
        raise ValueInvalid("the result is not finite: the numbers are too large")
    write = number_writer(request.precision, yaml=not template.json)
    return Rendered(_text(template, [write(number) for number in numbers], locked=locked), mended, doubt)


def _movers(template: Template, request: Request) -> tuple[list[Rigid | None], list[int | None]]:
    """Return the poses that move the records, at their own times if they have such, and those times."""
    timed, segments = template.timed(request), template.segments()
    edges: list[Rigid | None] = []
    times: list[int | None] = []
    for entry, stamps in zip(template.entries, template.stamps, strict=True):
        if timed is None or not stamps:
            edges.append(entry.edge)
            times.append(None)
            continue
        texts = [segments[index] for index in stamps]
        try:
            at = read_header_stamp(*texts) if len(texts) == 2 else read_stamp(texts[0], in_ns=timed.in_ns)
            times.append(at)
            edges.append(None if request.operation.formula else timed.pose(entry.record.parent.text, at))
        except FrametoolError as error:
            error.column_name = timed.column  # type: ignore[attr-defined]
            raise
    return edges, times


def moved(
    record: Record, edge: Rigid | None, values: Sequence[float], request: Request, at_ns: int | None = None,
    memory: Memory | None = None,
) -> tuple[Components, bool]:
    """Apply the operation to one record; return also whether its rotation had to be normalised.

    memory: of the records before, where it is compared with one of them
    """
    shape = record.shape
    own = values[: shape.own_size]
    if request.operation.formula is not None:
        return _evaluated(request.operation.formula, record, values, request, at_ns)
    if shape.kind != POSE:
        start = shape.position(own) if shape.unit is not None else tuple(own)
        return request.operation.move(shape, (*start, *values[shape.own_size :]), edge), False
    rotation, odd = checked_rotation(shape, own, normalize=request.normalize)
    pose: Rigid = pose_of(shape.position(own), rotation)
    pose = rigid.inverse(*pose) if record.inverse else pose
    poses = memory.pair(request.operation.of, pose) if memory and request.operation.looks_back else [pose]
    result = request.operation.pose(poses, edge, floats)
    beside = request.operation.covariance(shape, tuple(values[shape.own_size :]), edge)
    return (*result, *beside), bool(odd)


def _evaluated(
    formula: Formula, record: Record, values: Sequence[float], request: Request, at_ns: int | None
) -> tuple[Components, bool]:
    """Return what an expression makes of one record; and whether its rotation had to be normalised."""
    shape, odd = record.shape, False
    parts: Components = ()
    if shape.kind == POSE:
        rotation, warned = checked_rotation(shape, values[: shape.own_size], normalize=request.normalize)
        pose: Rigid = pose_of(shape.position(values), rotation)
        parts, odd = rigid.inverse(*pose) if record.inverse else pose, bool(warned)
    elif shape.kind:
        parts = shape.position(values)
    cells = values[shape.size - shape.beside : shape.size]
    return formula.result(shape.kind, parts, cells, at_ns, floats), odd


def checked_rotation(
    shape: Shape, values: Sequence[float], *, normalize: bool
) -> tuple[Quaternion, list[tuple[str, str]]]:
    """Return the quaternion of a record's numbers, and what is odd about them as (rule, sentence).

    Raises ValueInvalid for what is no rotation.
    """
    if shape.notation is None:
        return IDENTITY, []
    tail = shape.joined.tail if shape.joined else ()
    if tail and tuple(values[-len(tail) :]) != tail:
        wanted, found = (" ".join(f"{value:g}" for value in row) for row in (tail, values[-len(tail) :]))
        raise ValueInvalid(f"the last row of a 4x4 pose is {wanted}, found {found}")
    check = shape.notation.checked_quaternion
    return overheard(check, shape.rotation(values), floats, degrees=shape.degrees, normalize=normalize)


def doubtful_angle(shape: Shape, values: Sequence[float]) -> str:
    """Name a bare angle beyond a full turn; "" where there is none."""
    form = shape.notation
    if form is None or shape.degrees or form.degrees is not None or form.representation.name == "rotvec":
        return ""
    given = shape.rotation(values)
    beyond = [given[index] for index in form.representation.angles if abs(given[index]) > TURN]
    return f"{form.spec} {beyond[0]:g}" if beyond else ""


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


def _text(template: Template, numbers: Sequence[str], *, locked: bool) -> str:
    """Put the text of the result together."""
    segments = template.segments()
    text = ""
    for piece in template.pieces:
        if isinstance(piece, In):
            text += segments[piece.part]
        elif isinstance(piece, Out):
            text += numbers[piece.first]
        elif isinstance(piece, Const) or (locked and isinstance(piece, IfLocked)):
            text += piece.text.decode()
    return text
