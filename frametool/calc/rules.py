"""The rules of operators: matching frames, compatible units, and the kernels that compute results."""

from __future__ import annotations

import operator
from functools import partial
from math import inf, nan
from typing import TYPE_CHECKING

from frametool.calc.parser import METRE, PLAIN, RADIAN, CalcError, frame_text
from frametool.calc.values import (
    ANGLES,
    LIST,
    NUMBER,
    POINT,
    POSE,
    TO_RADIANS,
    TREE,
    TWIST,
    VECTOR,
    Term,
    Type,
    arithmetic,
    made,
    meet,
)
from frametool.errors import shown
from frametool.geometry import floats, quaternion, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from frametool.calc.values import Kernel
    from frametool.geometry.types import Components, Namespace, Number, Rigid

PLACED = (POINT, VECTOR)


def in_radians(term: Term) -> Term:
    """Return an angle with its number in radians."""
    if not term.type.degrees:
        return term
    return arithmetic(term.type._replace(degrees=False), lambda angle: (angle * TO_RADIANS,), term)


def wanted(term: Term) -> Term:
    """Refuse a tree or a list where one value is expected."""
    if term.type.kind == TREE:
        raise CalcError(f"{term.text} is a tree; ask it: {term.text}[TARGET<-SOURCE]")
    if term.type.kind == LIST:
        raise CalcError(f"{term.text} is a list of {len(term.items)}; only mean(..) takes one")
    return term


def common(left: Term, right: Term) -> str | None:
    """Return the common frame of two points or vectors."""
    a, b = left.type, right.type
    if not meet(a.target, b.target):
        raise CalcError(f"{a.named} and {b.named}: both must be in one frame")
    return a.target if a.target is not None else b.target


def same_frames(terms: Sequence[Term], what: str) -> Type:
    """Return the frames common to several poses; refuse poses of different frames."""
    type_ = terms[0].type
    for term in terms[1:]:
        other = term.type
        if not (meet(type_.target, other.target) and meet(type_.source, other.source)):
            raise CalcError(f"{what} needs two poses of the same frames, found {type_} and {other}")
        type_ = Type(
            POSE,
            other.target if type_.target is None else type_.target,
            other.source if type_.source is None else type_.source,
        )
    return type_


def one_target(left: Term, right: Term, what: str) -> None:
    """Refuse two poses with different reference frames; their bodies may differ."""
    if not meet(left.type.target, right.type.target):
        raise CalcError(f"{what} compares two poses in one frame, found {left.type} and {right.type}")


def scalar(term: Term, what: str, *, angle: bool = False) -> Term:
    """Refuse anything but a plain number or, if allowed, an angle."""
    if term.type.kind != NUMBER or term.type.unit not in ((PLAIN, RADIAN) if angle else (PLAIN,)):
        raise CalcError(f"{what} takes {'an angle' if angle else 'a plain number'}, found {term.type.named}")
    return term


def need(term: Term, kinds: Sequence[str], what: str) -> Term:
    """Refuse a value of another kind."""
    if term.type.kind not in kinds:
        articles = " or ".join(f"a {kind}" if kind != ANGLES else kind for kind in kinds)
        raise CalcError(f"{what}() takes {articles}, found {term.type.named}")
    return term


def _by_part(operation: Callable[[Number, Number], Number]) -> Kernel:
    """Return the kernel that combines two numbers, or two vectors component by component."""

    def kernel(*parts: Number) -> Components:
        half = len(parts) // 2
        return tuple(map(operation, parts[:half], parts[half:]))

    return kernel


_PLUS, _MINUS, _TIMES, _OVER = map(_by_part, (operator.add, operator.sub, operator.mul, operator.truediv))


def _turned(*parts: Number) -> Components:
    return quaternion.rotate(*parts[3:])


def _no_division(*parts: float) -> str:
    return "division by zero" if parts[-1] == 0.0 else ""


REMEDIES = {
    POSE: "poses have a * b, inv(a), inv(a) * b, a ^ 0.5 and a * point",
    POINT: "a direction is vector([x, y, z])",
}


def refused(verb: str, *terms: Term, by: str = "and") -> CalcError:
    """Return the error that something cannot be done with values, and what to write instead."""
    what, kinds = f" {by} ".join(each.type.named for each in terms), [each.type.kind for each in terms]
    remedy = next((f"; {text}" for kind, text in REMEDIES.items() if kind in kinds), "")
    return CalcError(f"cannot {verb} {what}{remedy}")


# --- products ---


def times(left: Term, right: Term) -> Term:
    """Multiply: poses whose inner frames match, a pose and what it transforms, numbers, a number and a vector."""
    a, b = left.type.kind, right.type.kind
    if a == b == POSE:
        return _composed(left, right)
    if a == POSE and b in PLACED:
        return _moved(left, right)
    if a == b == NUMBER:
        if PLAIN not in (left.type.unit, right.type.unit):
            raise CalcError(f"cannot multiply {left.type.named} by {right.type.named}; units have no powers")
        type_ = left.type if right.type.unit == PLAIN else right.type  # degrees stay degrees
        return arithmetic(type_, _TIMES, left, right)
    if {a, b} == {NUMBER, VECTOR}:
        number, vector = (left, right) if a == NUMBER else (right, left)
        _require_scale(number)
        return arithmetic(vector.type, lambda factor, *parts: tuple(factor * part for part in parts), number, vector)
    raise refused("multiply", left, right, by="by")


def _composed(left: Term, right: Term) -> Term:
    a, b = left.type, right.type
    if not meet(a.source, b.target):
        raise CalcError(f"{a} * {b}: {shown(a.source)} and {shown(b.target)} do not touch")
    return arithmetic(Type(POSE, a.target, b.source), rigid.compose, left, right)


def _moved(pose: Term, point: Term) -> Term:
    a, b = pose.type, point.type
    if not meet(a.source, b.target):
        raise CalcError(f"{a} takes {b.kind}s in {shown(a.source)}, found one in {shown(b.target)}")
    kernel = rigid.apply if b.kind == POINT else _turned
    return arithmetic(Type(b.kind, a.target), kernel, pose, point)


def _require_scale(number: Term) -> None:
    if number.type.unit not in (PLAIN, METRE):
        raise CalcError(f"a vector is scaled by a plain number or a length, found {number.type.named}")


def over(left: Term, right: Term) -> Term:
    """Divide by a number."""
    a, b = left.type, right.type
    if a.kind == b.kind == NUMBER and b.unit in (PLAIN, a.unit):
        if b.unit == PLAIN:
            return arithmetic(a, _OVER, left, right, check=_no_division)
        if a.degrees != b.degrees:
            left, right = in_radians(left), in_radians(right)
        return arithmetic(Type(NUMBER), _OVER, left, right, check=_no_division)
    if a.kind == VECTOR and b.kind == NUMBER:
        _require_scale(right)
        return arithmetic(a, lambda x, y, z, n: (x / n, y / n, z / n), left, right, check=_no_division)
    raise refused("divide", left, right, by="by")


# --- sums ---


def _sum(left: Term, right: Term, *, adding: bool) -> Term:
    """Add or subtract values that can be added."""
    a, b = left.type, right.type
    kernel = _PLUS if adding else _MINUS
    if a.kind == b.kind == NUMBER and a.unit == b.unit:
        if a.degrees and b.degrees:
            return arithmetic(a, kernel, left, right)
        return arithmetic(a._replace(degrees=False), kernel, in_radians(left), in_radians(right))
    if (a.kind in PLACED and b.kind in PLACED) or a.kind == b.kind == TWIST:
        frame = common(left, right)
        return arithmetic(Type(_kind_of_sum(a, b, adding=adding), frame), kernel, left, right)
    raise refused("add" if adding else "subtract", left, right)


def _kind_of_sum(a: Type, b: Type, *, adding: bool) -> str:
    """Return the kind of a sum or difference of points and vectors, or of twists."""
    if a.kind == b.kind == POINT:
        if adding and (a.target is not None or b.target is not None):
            raise CalcError("the sum of two points depends on the origin; subtract them, or use mean(..)")
        return POINT if adding else VECTOR
    if a.kind == VECTOR and b.kind == POINT and not adding:
        raise CalcError("a point cannot be subtracted from a vector; point - vector is a point")
    return a.kind if a.kind == b.kind else POINT


OPERATORS: dict[str, Callable[[Term, Term], Term]] = {
    "*": times,
    "/": over,
    "+": partial(_sum, adding=True),
    "-": partial(_sum, adding=False),
}


def negated(term: Term) -> Term:
    """Return the negative of a number, a vector or a twist."""
    if term.type.kind not in (NUMBER, VECTOR, TWIST) and term.type != Type(POINT):
        raise refused("negate", term)
    return arithmetic(term.type, lambda *parts: tuple(0.0 - part for part in parts), term)


# --- powers and frames ---


def inverse(term: Term) -> Term:
    """Return b<-a of a<-b."""
    return arithmetic(Type(POSE, term.type.source, term.type.target), rigid.inverse, term)


def power(base: Term, exponent: Term) -> Term:
    """Raise a number to a power, or scale a pose's screw motion: exp(f log); -1 is the inverse."""
    a, b = base.type, exponent.type
    if b.kind != NUMBER or b.unit != PLAIN:
        raise CalcError(f"an exponent is a plain number, found {b.named}")
    known = exponent.parts[0] if exponent.parts is not None else None
    if type(known) is not float:
        known = None
    if a.kind == POSE:
        if known == -1.0:
            return inverse(base)
        if known == 1.0:
            return base
        return made(Type(POSE, a.target), _part_of_motion, base, exponent)
    if a.kind != NUMBER:
        raise CalcError(f"{a.named} has no powers; poses and numbers have")
    return made(scalar(base, "a power").type, _powered, base, exponent, check=_no_power)


def _part_of_motion(*numbers: Number) -> Components:
    *pose, fraction, xp = numbers
    vx, vy, vz, wx, wy, wz = (fraction * part for part in rigid.log(*unit_pose(*pose, xp), xp))
    return rigid.exp(vx, vy, vz, wx, wy, wz, xp)


def unit_pose(*parts: Number) -> Rigid:
    """Return a pose with its quaternion normalised, which products preserve only to a few eps.

    parts: of the pose, and the namespace
    """
    tx, ty, tz, x, y, z, w, xp = parts
    return tx, ty, tz, *quaternion.unit(x, y, z, w, xp)


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


def _no_power(base: float, exponent: float) -> str:
    if base == 0.0 and exponent < 0.0:
        return "division by zero"
    if base < 0.0 and exponent != int(exponent):
        return f"{base:g} has no power {exponent:g}"
    return ""


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
        hint = "a point has 3, a twist 6; rotations need a name: {rpy_deg: [..]}"
        raise CalcError(f"a list of {numbers}; {hint}")
    units = [METRE] * 3 + [RADIAN] * 3
    for term, unit in zip(items, units, strict=False):
        if term.type.unit not in (PLAIN, unit):
            what = "a point is in metres" if len(items) == 3 else "a twist is three lengths, then three angles"
            raise CalcError(f"{what}, found {term.type.named}")
    kind = POINT if len(items) == 3 else TWIST
    return arithmetic(Type(kind), lambda *parts: parts, *map(in_radians, items))
