"""What operators and functions do with values: a table of what each takes, how frames and units meet, and the kernel.

An angle in degrees stays in degrees where that is exact: in sums, and in sine and cosine.
"""

from __future__ import annotations

import operator
from math import inf, nan
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.calc.parser import METRE, PLAIN, RADIAN, CalcError, frame_text
from frametool.calc.values import ANGLES, NUMBER, PLAIN_NUMBER, POINT, POSE, TWIST, VECTOR, Term, Type, made, meet
from frametool.errors import first_of, shown
from frametool.geometry import euler, floats, quaternion, rigid, validation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.calc.values import Check, Kernel
    from frametool.geometry.types import Components, Namespace, Number, Rigid

PLACED = (POINT, VECTOR)
TO_RADIANS = 0.017453292519943295
LENGTH, ANGLE = Type(NUMBER, unit=METRE), Type(NUMBER, unit=RADIAN)
# the words in `Overload.takes` that are no kinds
FITS: dict[str, Callable[[Type], bool]] = {
    "placed": lambda type_: type_.kind in PLACED,
    "measure": lambda type_: type_.kind == NUMBER,
    "plain": lambda type_: type_.kind == NUMBER and type_.unit == PLAIN,
    "scale": lambda type_: type_.kind == NUMBER and type_.unit in (PLAIN, METRE),
    "angle": lambda type_: type_.kind == NUMBER and type_.unit in (PLAIN, RADIAN),
    "degrees": lambda type_: type_.degrees,
}


# --- how frames and units meet: the type that the result is derived from; None: not this meaning ---


def _first(_: str, first: Type, *_others: Type) -> Type:
    return first


def _second(_: str, _first: Type, second: Type) -> Type:
    return second


def _touching(_: str, a: Type, b: Type) -> Type:
    if not meet(a.source, b.target):
        raise CalcError(f"{a} * {b}: {shown(a.source)} and {shown(b.target)} do not touch")
    return Type(POSE, a.target, b.source)


def _moved(_: str, pose: Type, placed: Type) -> Type:
    if not meet(pose.source, placed.target):
        where = f"in {shown(pose.source)}, found one in {shown(placed.target)}"
        raise CalcError(f"{pose} takes {placed.kind}s {where}")
    return placed._replace(target=pose.target)


def _in_one_frame(_: str, a: Type, *others: Type) -> Type:
    for b in others:
        if b.kind != NUMBER and not meet(a.target, b.target):
            raise CalcError(f"{a.named} and {b.named}: both must be in one frame")
        a = a._replace(target=b.target if a.target is None else a.target)
    return a


def _free_of_frames(_: str, *points: Type) -> Type | None:
    if any(each.target is not None for each in points):
        raise CalcError("the sum of two points depends on the origin; subtract them, or use mean(..)")
    return points[0]


def _unplaced(_: str, point: Type) -> Type | None:
    return point if point.target is None else None


def _of_one_unit(_: str, first: Type, *others: Type) -> Type | None:
    return first if all(each.unit == first.unit for each in others) else None


def _seen_from_one_frame(name: str, a: Type, b: Type) -> Type:
    if not meet(a.target, b.target):
        raise CalcError(f"{name}() compares two poses in one frame, found {a} and {b}")
    return a


def _of_the_same_frames(name: str, a: Type, *others: Type) -> Type:
    for b in others:
        if b.kind == NUMBER:  # a fraction
            continue
        if not (meet(a.target, b.target) and meet(a.source, b.source)):
            raise CalcError(f"{name}() needs two poses of the same frames, found {a} and {b}")
        a = Type(POSE, b.target if a.target is None else a.target, b.source if a.source is None else a.source)
    return a


class Overload(NamedTuple):
    """One meaning of an operator or function: the kinds of its arguments, its type and its kernel.

    takes: a kind or a word of FITS for each argument; many: for each of any number
    gives: the type of the result, from what `joined` returns for the types of the arguments
    as_written: angles are not converted to radians if all are in degrees
    check: returns the reason why floats have no result, "" if they have one
    """

    takes: str
    gives: Callable[[Type], Type]
    kernel: Kernel
    joined: Callable[..., Type | None] = _first
    check: Check | None = None
    as_written: bool = False
    many: bool = False

    def result(self, name: str, terms: Sequence[Term]) -> Term | None:
        """Return the result; None if the arguments are of other kinds; raises CalcError if frames do not match."""
        words = self.takes.split() * (len(terms) if self.many else 1)
        if not terms or len(words) != len(terms) or not all(map(_fits, words, terms)):
            return None
        if not self.as_written or len({term.type.degrees for term in terms if term.type.unit == RADIAN}) > 1:
            terms = [*map(in_radians, terms)]
        type_ = self.joined(name, *(term.type for term in terms))
        return None if type_ is None else made(self.gives(type_), self.kernel, *terms, check=self.check)


def _fits(word: str, term: Term) -> bool:
    return FITS[word](term.type) if word in FITS else term.type.kind == word


def in_radians(term: Term) -> Term:
    """Return an angle with its number in radians."""
    if not term.type.degrees:
        return term
    return made(term.type._replace(degrees=False), lambda angle, _: (angle * TO_RADIANS,), term)


# --- kernels: they take the numbers of all arguments, and the namespace of their functions ---


def plain(kernel: Callable[..., Components]) -> Kernel:
    """Return the kernel of arithmetic that needs no namespace."""
    return lambda *numbers: kernel(*numbers[:-1])


def _by_part(operation: Callable[[Number, Number], Number]) -> Kernel:
    """Return the kernel that combines two numbers, or two vectors component by component."""

    def kernel(*numbers: Number) -> Components:
        half = len(numbers) // 2
        return tuple(map(operation, numbers[:half], numbers[half:-1]))

    return kernel


_PLUS, _MINUS, _TIMES, _OVER = map(_by_part, (operator.add, operator.sub, operator.mul, operator.truediv))
_NEGATED = plain(lambda *numbers: tuple(0.0 - number for number in numbers))


def _line(*numbers: Number) -> Components:
    fraction = numbers[6]
    return tuple(a + fraction * (b - a) for a, b in zip(numbers[:3], numbers[3:6], strict=True))


def unit_pose(*parts: Number) -> Rigid:
    """Return a pose with its quaternion normalised, which products preserve only to a few eps.

    parts: of the pose, and the namespace
    """
    tx, ty, tz, x, y, z, w, xp = parts
    return tx, ty, tz, *quaternion.unit(x, y, z, w, xp)


def _of_unit(kernel: Callable[..., Components]) -> Kernel:
    """Return a kernel of one pose that normalises it first."""
    return lambda *pose: kernel(*unit_pose(*pose), pose[-1])


def _roll_pitch_yaw(*pose: Number) -> Components:
    *_, x, y, z, w = unit_pose(*pose)
    return euler.from_quaternion(x, y, z, w, "sxyz", pose[-1])


def _angle_between_poses(*both: Number) -> Components:
    xp = both[-1]
    return (rigid.distance(*unit_pose(*both[:7], xp), *unit_pose(*both[7:]), xp)[1],)


def _angle_between_vectors(
    ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number, xp: Namespace
) -> Components:
    """Return the angle between two vectors: 2 atan2(|b - a|, |a + b|) of their directions (Kahan)."""
    ax, ay, az = quaternion.unit_vector(ax, ay, az, xp)
    bx, by, bz = quaternion.unit_vector(bx, by, bz, xp)
    apart = quaternion.length(0.5 * (bx - ax), 0.5 * (by - ay), 0.5 * (bz - az), xp)
    along = quaternion.length(0.5 * (bx + ax), 0.5 * (by + ay), 0.5 * (bz + az), xp)
    return (2.0 * floats.incline(apart, along, xp),)


def _mean_parts(width: int) -> Kernel:
    def mean(*numbers: Number) -> Components:
        parts = numbers[:-1]
        return tuple(sum(parts[at + width :: width], parts[at]) / (len(parts) // width) for at in range(width))

    return mean


def _mean_pose(*parts: Number) -> Components:
    """Return the mean of translations and the chordal mean of rotations (Markley et al. 2007)."""
    import numpy as np

    *numbers, xp = parts
    columns = [numbers[at::7] for at in range(7)]
    shift = (sum(column[1:], column[0]) / len(column) for column in columns[:3])
    rotations = tuple(np.stack(np.broadcast_arrays(*column)) for column in columns[3:])
    return (*shift, *xp.canonical_sign(*validation.mean_quaternion(rotations, np.ones(len(columns[0])))))


def _part_of_motion(*numbers: Number) -> Components:
    *pose, fraction, xp = numbers
    vx, vy, vz, wx, wy, wz = (fraction * part for part in rigid.log(*unit_pose(*pose, xp), xp))
    return rigid.exp(vx, vy, vz, wx, wy, wz, xp)


def _powered(base: Number, exponent: Number, xp: Namespace) -> Components:
    if xp is floats:
        return (_power(base, exponent),)
    import numpy as np

    powers: Any = np.frompyfunc(_row_power, 2, 1)  # numpy's own differs between processors
    return (powers(base, exponent).astype(float),)


def _power(base: float, exponent: float) -> float:
    result = base**exponent
    return nan if isinstance(result, complex) else float(result)


def _row_power(base: float, exponent: float) -> float:
    try:
        return _power(base, exponent)
    except (OverflowError, ZeroDivisionError):
        return inf


def _arcsine(value: Number, xp: Namespace) -> Components:
    return (floats.bearing(value, xp.sqrt((1.0 - value) * (1.0 + value)), 1.0, xp),)


def _arccosine(value: Number, xp: Namespace) -> Components:
    return (floats.bearing(xp.sqrt((1.0 - value) * (1.0 + value)), value, 1.0, xp),)


def _arctangent(value: Number, xp: Namespace) -> Components:
    """Return the angle with a tangent of any size."""
    steep = abs(value) > 1.0
    small = xp.where(steep, 1.0 / xp.where(steep, value, 1.0), value)
    angle = xp.doubled_arctan(small / (1.0 + xp.sqrt(1.0 + small * small)))
    return (xp.where(steep, xp.copysign(floats.RIGHT_ANGLE, value) - angle, angle),)


# --- checks ---


def _no_division(*numbers: float) -> str:
    return "division by zero" if numbers[-1] == 0.0 else ""


def _no_power(base: float, exponent: float) -> str:
    if base == 0.0 and exponent < 0.0:
        return "division by zero"
    return f"{base:g} has no power {exponent:g}" if base < 0.0 and exponent != int(exponent) else ""


def _no_direction(*numbers: float) -> str:
    is_known = any(numbers[:3]) and any(numbers[3:])
    return "" if is_known else "vector 0 0 0 has no direction; the angle to it is not defined"


def _no_twist(*numbers: float) -> str:
    rigid.check_twist(*numbers)  # raises ValueInvalid
    return ""


def _within(name: str, least: float, most: float, words: str) -> Check:
    return lambda value: "" if least <= value <= most else f"{name}() takes {words}, found {value:g}"


# --- the tables ---


def _unchanged(type_: Type) -> Type:
    return type_


def _always(type_: Type) -> Callable[[Type], Type]:
    return lambda _: type_


def _kind(kind: str) -> Callable[[Type], Type]:
    """Return the type of another kind in the same frame."""
    return lambda type_: Type(kind, type_.target)


def _sums(kernel: Kernel) -> list[Overload]:
    """Return the meanings that a sum and a difference share."""
    return [
        Overload("measure measure", _unchanged, kernel, _of_one_unit, as_written=True),
        Overload("vector vector", _unchanged, kernel, _in_one_frame),
        Overload("twist twist", _unchanged, kernel, _in_one_frame),
        Overload("point vector", _unchanged, kernel, _in_one_frame),
    ]


INVERSE = Overload(POSE, lambda pose: Type(POSE, pose.source, pose.target), plain(rigid.inverse))
# operator -> what cannot be done, its meanings
OPERATORS: dict[str, tuple[str, Sequence[Overload]]] = {
    "*": ("multiply {} by {}", [
        Overload("pose pose", _unchanged, plain(rigid.compose), _touching),
        Overload("pose point", _unchanged, plain(rigid.apply), _moved),
        Overload("pose vector", _unchanged, lambda *numbers: quaternion.rotate(*numbers[3:-1]), _moved),
        Overload("measure plain", _unchanged, _TIMES, as_written=True),
        Overload("plain measure", _unchanged, _TIMES, _second, as_written=True),
        Overload("scale vector", _unchanged, plain(lambda n, x, y, z: (n * x, n * y, n * z)), _second),
        Overload("vector scale", _unchanged, plain(lambda x, y, z, n: (n * x, n * y, n * z))),
    ]),
    "/": ("divide {} by {}", [
        Overload("measure plain", _unchanged, _OVER, check=_no_division, as_written=True),
        Overload("measure measure", _always(PLAIN_NUMBER), _OVER, _of_one_unit, _no_division, as_written=True),
        Overload("vector scale", _unchanged, plain(lambda x, y, z, n: (x / n, y / n, z / n)), check=_no_division),
    ]),
    "+": ("add {} and {}", [
        *_sums(_PLUS),
        Overload("vector point", _kind(POINT), _PLUS, _in_one_frame),
        Overload("point point", _unchanged, _PLUS, _free_of_frames),
    ]),
    "-": ("subtract {} and {}", [*_sums(_MINUS), Overload("point point", _kind(VECTOR), _MINUS, _in_one_frame)]),
    "^": ("raise {} to {}: a power is that of a pose or a plain number, an exponent a plain number", [
        Overload("pose plain", _kind(POSE), _part_of_motion),
        Overload("plain plain", _unchanged, _powered, check=_no_power),
    ]),
    "negate": ("negate {}", [
        Overload("measure", _unchanged, _NEGATED, as_written=True),
        Overload(VECTOR, _unchanged, _NEGATED),
        Overload(TWIST, _unchanged, _NEGATED),
        Overload(POINT, _unchanged, _NEGATED, _unplaced),
    ]),
}  # fmt: skip
REMEDIES = {
    POSE: "; poses have a * b, inv(a), inv(a) * b, a ^ 0.5 and a * point",
    POINT: "; a direction is vector([x, y, z])",
}


def operated(sign: str, *terms: Term) -> Term:
    """Return the result of an operator; raises CalcError."""
    refusal, overloads = OPERATORS[sign]
    for each in overloads:
        if (found := each.result(sign, terms)) is not None:
            return found
    remedy = next((text for kind, text in REMEDIES.items() if kind in [term.type.kind for term in terms]), "")
    raise CalcError(f"cannot {refusal.format(*(term.type.named for term in terms))}{remedy}")


def power(base: Term, exponent: Term) -> Term:
    """Raise a number to a power, or scale a pose's screw motion: exp(f log); -1 is the inverse."""
    known = exponent.parts[0] if exponent.parts and exponent.type == PLAIN_NUMBER else None
    if base.type.kind == POSE and type(known) is float and abs(known) == 1.0:
        return base if known == 1.0 else called("inv", [base])
    return operated("^", base, exponent)


def _angular(pick: Callable[[Number, Number], Number]) -> list[Overload]:
    """Return the meanings of a function of an angle, from its sine and cosine; exact at quarter turns in degrees."""
    return [
        Overload("degrees", _always(PLAIN_NUMBER), lambda value, xp: (pick(*floats.half_sincos_deg(2.0 * value, xp)),),
            as_written=True),
        Overload("angle", _always(PLAIN_NUMBER), lambda value, xp: (pick(*floats.half_sincos(2.0 * value, xp)),)),
    ]  # fmt: skip


# function -> what it takes, its meanings
FUNCTIONS: dict[str, tuple[str, Sequence[Overload]]] = {
    "inv": ("a pose", [INVERSE]),
    "trans": ("a pose", [Overload(POSE, _kind(POINT), lambda *pose: pose[:3])]),
    "rot": ("a pose", [Overload(POSE, _unchanged, lambda *pose: (*(0.0 * part for part in pose[:3]), *pose[3:7]))]),
    "rpy": ("a pose", [Overload(POSE, _kind(ANGLES), _roll_pitch_yaw)]),
    "log": ("a pose", [Overload(POSE, _kind(TWIST), _of_unit(rigid.log))]),
    "exp": ("six numbers [vx, vy, vz, wx, wy, wz]", [Overload(TWIST, _kind(POSE), rigid.exp, check=_no_twist)]),
    "dist": ("two poses or two points", [
        Overload("pose pose", _always(LENGTH), lambda *both: rigid.distance(*both)[:1], _seen_from_one_frame),
        Overload("point point", _always(LENGTH), lambda ax, ay, az, bx, by, bz, xp: (
            quaternion.magnitude(bx - ax, by - ay, bz - az, xp),), _in_one_frame),
    ]),
    "angle": ("a pose, two poses or two vectors", [
        Overload(POSE, _always(ANGLE), _of_unit(lambda *pose: rigid.extent(*pose)[1:])),
        Overload("pose pose", _always(ANGLE), _angle_between_poses, _seen_from_one_frame),
        Overload("placed placed", _always(ANGLE), _angle_between_vectors, _in_one_frame, _no_direction),
    ]),
    "interp": ("two poses, points or vectors and a fraction", [
        Overload("pose pose plain", _unchanged, rigid.interpolate, _of_the_same_frames),
        Overload("point point plain", _unchanged, _line, _in_one_frame),
        Overload("vector vector plain", _unchanged, _line, _in_one_frame),
    ]),
    "mean": ("poses, points, vectors or numbers of one unit, or a list", [
        Overload(POSE, _unchanged, _mean_pose, _of_the_same_frames, many=True),
        Overload(POINT, _unchanged, _mean_parts(3), _in_one_frame, many=True),
        Overload(VECTOR, _unchanged, _mean_parts(3), _in_one_frame, many=True),
        Overload("measure", _unchanged, _mean_parts(1), _of_one_unit, many=True),
    ]),
    "vector": ("[x, y, z]", [Overload("placed", _kind(VECTOR), lambda *vector: vector[:3])]),
    "norm": ("a vector", [Overload("placed", _always(LENGTH), lambda *vector: (quaternion.magnitude(*vector),))]),
    "dot": ("two vectors", [Overload("placed placed", _always(PLAIN_NUMBER), plain(
        lambda ax, ay, az, bx, by, bz: (ax * bx + ay * by + az * bz,)), _in_one_frame)]),
    "cross": ("two vectors", [Overload("placed placed", _kind(VECTOR), plain(quaternion.cross), _in_one_frame)]),
    "sin": ("an angle", _angular(lambda sine, _: sine)),
    "cos": ("an angle", _angular(lambda _, cosine: cosine)),
    "tan": ("an angle", _angular(lambda sine, cosine: sine / cosine)),
    "asin": ("a plain number", [
        Overload("plain", _always(ANGLE), _arcsine, check=_within("asin", -1.0, 1.0, "-1 .. 1"))]),
    "acos": ("a plain number", [
        Overload("plain", _always(ANGLE), _arccosine, check=_within("acos", -1.0, 1.0, "-1 .. 1"))]),
    "atan": ("a plain number", [Overload("plain", _always(ANGLE), _arctangent)]),
    "sqrt": ("a plain number", [Overload("plain", _unchanged, lambda value, xp: (xp.sqrt(value),), check=_within(
        "sqrt", 0.0, inf, "what is not negative"))]),
}  # fmt: skip


def called(name: str, terms: Sequence[Term]) -> Term:
    """Return the result of a function; raises CalcError."""
    takes, overloads = FUNCTIONS[name]
    for each in overloads:
        if (found := each.result(name, terms)) is not None:
            return found
    what = first_of([term.type.named for term in terms], 3) or "nothing"
    raise CalcError(f"{name}() takes {takes}, found {what}")


# --- frames of a value ---


def as_frames(term: Term, target: str | None, source: str | None) -> Term:
    """Return a pose with both its frames."""
    type_ = term.type
    if type_.kind != POSE:
        raise CalcError(f"only a pose has two frames; found {type_.named}")
    if not (meet(type_.target, target) and meet(type_.source, source)):
        raise CalcError(f"this is {type_} already")
    return term._replace(type=type_._replace(target=target, source=source))


def in_frame(term: Term, frame: str) -> Term:
    """Set the frame of a point, a vector, a twist or angles."""
    type_ = term.type
    if type_.kind not in (POINT, VECTOR, TWIST, ANGLES):
        hint = "; a pose has two: .. as TARGET<-SOURCE" if type_.kind == POSE else ""
        raise CalcError(f"in names the frame of a point or vector; found {type_.named}{hint}")
    if not meet(type_.target, frame):
        moved = f"({frame_text(frame)}<-{frame_text(type_.target)}) * .."
        raise CalcError(f"this is in {shown(type_.target)} already; to move it: {moved}")
    return term._replace(type=type_._replace(target=frame))


def list_of_numbers(items: Sequence[Term]) -> Term:
    """Return the point of three numbers, or the twist of six."""
    if len(items) not in (3, 6):
        numbers = "1 number" if len(items) == 1 else f"{len(items)} numbers"
        raise CalcError(f"a list of {numbers}; a point has 3, a twist 6; rotations need a name: {{rpy_deg: [..]}}")
    for term, unit in zip(items, [METRE] * 3 + [RADIAN] * 3, strict=False):
        if term.type.unit not in (PLAIN, unit):
            what = "a point is in metres" if len(items) == 3 else "a twist is three lengths, then three angles"
            raise CalcError(f"{what}, found {term.type.named}")
    return made(Type(POINT if len(items) == 3 else TWIST), plain(lambda *parts: parts), *map(in_radians, items))
