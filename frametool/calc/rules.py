"""What the operators need and give: frames that touch, units that agree, and the kernels that then run.

Where frames do not touch: what to write instead, found by trying, as texts that can be pasted.  There a term appears
as it was typed: bound names by their names, literals as they are, look-ups in a named tree as d[..].
"""

from __future__ import annotations

import operator
from contextlib import suppress
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
from frametool.errors import LookupFailed, shown
from frametool.geometry import floats, quaternion, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any

    from frametool.calc.parser import Dimension
    from frametool.calc.values import Kernel
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Components, Namespace, Number, Rigid
    Trees = Sequence[tuple[str, Frames]]

MOST = 2  # suggestions in one message
PLACED = (POINT, VECTOR)


def inverse_text(term: Term) -> str:
    """Write the inverse of a term: that of an inverse is what was inverted."""
    term = _simplest(term)
    return f"inv({term.text})" if term.inverse_of is None else term.inverse_of.bracketed


def _simplest(term: Term) -> Term:
    """Return what was inverted twice."""
    while term.inverse_of is not None and term.inverse_of.inverse_of is not None:
        term = term.inverse_of.inverse_of
    return term


def _forms(term: Term) -> tuple[tuple[str, str | None, str | None], ...]:
    """Return a pose and its inverse: text, target, source."""
    target, source = term.type.target, term.type.source
    return (_simplest(term).bracketed, target, source), (inverse_text(term), source, target)


def rewritten_products(left: Term, right: Term) -> Iterator[str]:
    """Yield the products of two poses, either inverted or not, in either order, whose frames touch."""
    pairs = [(a, b) for a in _forms(left) for b in _forms(right)]
    swapped = [(b, a) for a, b in pairs]
    tried = [pairs[2], pairs[1], pairs[3], swapped[0], swapped[1], swapped[2], swapped[3]]
    for (first, target, between), (second, touching, source) in tried:
        if between is not None and between == touching:
            yield f"{first} * {second}  (= {frame_text(target)}<-{frame_text(source)})"


def for_product(left: Term, right: Term, trees: Trees) -> str:
    """Say how two poses that do not touch can be multiplied."""
    found = list(rewritten_products(left, right))[:MOST]
    if found:
        return f"frames that touch: {', or '.join(found)}"
    between = _looked_up(left.type.source, right.type.target, trees)
    return f"a lookup between them is missing: {between or _arrow(left.type.source, right.type.target)}"


def for_point(pose: Term, point: Term, trees: Trees) -> str:
    """Say how a point in another frame can be moved."""
    if point.type.target == pose.type.target:
        return f"{inverse_text(pose)} takes points in {frame_text(pose.type.target)}"
    between = _looked_up(pose.type.source, point.type.target, trees)
    return f"{between or _arrow(pose.type.source, point.type.target)} stands between"


def for_same_frames(left: Term, right: Term) -> str:
    """Say how two poses of different frames go together; "" where nothing is found."""
    a, b = left.type, right.type
    if a.target is not None and a.target == b.source and a.source == b.target:
        return f"; {inverse_text(right)} is {frame_text(b.source)}<-{frame_text(b.target)}"
    if a.target is not None and a.target == b.target and a.source != b.source:
        seen = f"{frame_text(b.source)} seen from {frame_text(a.source)}"
        return f"; for {seen}: {inverse_text(left)} * {_simplest(right).bracketed}"
    return ""


def for_one_target(left: Term, right: Term, trees: Trees) -> str:
    """Say how two poses come to be seen from one frame; "" where nothing is found."""
    a, b = left.type, right.type
    if b.source == a.target:
        return f"; write {inverse_text(right)} for the second"
    if a.source == b.target:
        return f"; write {inverse_text(left)} for the first"
    if a.source is not None and a.source == b.source:
        return f"; write inv(..) for both: {inverse_text(left)}, {inverse_text(right)}"
    return for_other_frame(left, right, trees)


def for_other_frame(left: Term, right: Term, trees: Trees) -> str:
    """Say how the second of two points or vectors comes into the frame of the first."""
    over = _looked_up(left.type.target, right.type.target, trees)
    if over is None:
        return f"; a lookup between them is missing: {_arrow(left.type.target, right.type.target)}"
    return f"; bring the second over: ({over}) * {right.bracketed}"


def _arrow(target: str | None, source: str | None) -> str:
    return f"{frame_text(target)}<-{frame_text(source)}"


def _looked_up(target: str | None, source: str | None, trees: Trees) -> str | None:
    """Return a look-up of one of some trees, by name, that knows both frames; None where none does."""
    for name, tree in trees:
        if target in tree.frames and source in tree.frames:
            with suppress(LookupFailed):
                tree.lookup_components(str(target), str(source))
                return f"{name}[{_arrow(target, source)}]" if name else _arrow(target, source)
    return None


def in_radians(term: Term) -> Term:
    """Return an angle with its number in radians."""
    if not term.type.degrees:
        return term
    return arithmetic(term.type._replace(degrees=False), lambda angle: (angle * TO_RADIANS,), term)


def wanted(term: Term) -> Term:
    """Refuse a tree or a list where one value is wanted."""
    if term.type.kind == TREE:
        raise CalcError(f"{term.text} is a tree; ask it: {term.text}[TARGET<-SOURCE]")
    if term.type.kind == LIST:
        raise CalcError(f"{term.text} is a list of {len(term.items)}; only mean(..) takes one")
    return term


def common(left: Term, right: Term, trees: Trees) -> str | None:
    """Return the one frame that two points or vectors are seen in."""
    a, b = left.type, right.type
    if not meet(a.target, b.target):
        hint = for_other_frame(left, right, trees)
        raise CalcError(f"{a.named} and {b.named}: both must be seen from one frame{hint}")
    return a.target if a.target is not None else b.target


def same_frames(terms: Sequence[Term], what: str) -> Type:
    """Return the frames that all of some poses have; refuse poses of different ones."""
    first = terms[0]
    type_ = first.type
    for term in terms[1:]:
        other = term.type
        if not (meet(type_.target, other.target) and meet(type_.source, other.source)):
            hint = for_same_frames(first, term)
            raise CalcError(f"{what} needs two poses of the same frames, found {type_} and {other}{hint}")
        type_ = Type(
            POSE,
            other.target if type_.target is None else type_.target,
            other.source if type_.source is None else type_.source,
        )
    return type_


def one_target(left: Term, right: Term, what: str, trees: Trees) -> None:
    """Refuse two poses that are not seen from one frame; whose poses they are may differ."""
    if not meet(left.type.target, right.type.target):
        hint = for_one_target(left, right, trees)
        raise CalcError(f"{what} compares two poses seen from one frame, found {left.type} and {right.type}{hint}")


def scalar(term: Term, what: str, *, angle: bool = False) -> Term:
    """Refuse what is neither a plain number nor, where one is meant, an angle."""
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
    """Return the kernel that joins two numbers, or two vectors part by part."""

    def kernel(*parts: Number) -> Components:
        half = len(parts) // 2
        return tuple(map(operation, parts[:half], parts[half:]))

    return kernel


_PLUS, _MINUS, _TIMES, _OVER = map(_by_part, (operator.add, operator.sub, operator.mul, operator.truediv))


def _turned(*parts: Number) -> Components:
    return quaternion.rotate(*parts[3:])


def _no_division(*parts: float) -> str:
    return "division by zero" if parts[-1] == 0.0 else ""


# --- products ---


def times(left: Term, right: Term, trees: Trees) -> Term:
    """Multiply: poses whose frames touch, a pose and what it moves, numbers, a number and a vector."""
    a, b = left.type.kind, right.type.kind
    if a == b == POSE:
        return _composed(left, right, trees)
    if a == POSE and b in PLACED:
        return _moved(left, right, trees)
    if a == b == NUMBER:
        unit = _added(left.type.unit, right.type.unit)
        if PLAIN in (left.type.unit, right.type.unit):  # degrees stay degrees
            type_ = Type(NUMBER, unit=unit, degrees=left.type.degrees or right.type.degrees)
            return arithmetic(type_, _TIMES, left, right)
        return arithmetic(Type(NUMBER, unit=unit), _TIMES, in_radians(left), in_radians(right))
    if {a, b} == {NUMBER, VECTOR}:
        number, vector = (left, right) if a == NUMBER else (right, left)
        _require_scale(number)
        return arithmetic(vector.type, lambda factor, *parts: tuple(factor * part for part in parts), number, vector)
    if POSE in (a, b) and NUMBER in (a, b):
        raise CalcError("a pose cannot be multiplied by a number; its part is pose ^ 0.5")
    if b == POSE and a in PLACED:
        raise CalcError(f"the pose stands on the left: {right.type} * {a}")
    if {a, b} == {NUMBER, POINT}:
        raise CalcError("a point cannot be multiplied by a number; a direction is vector([x, y, z])")
    raise CalcError(f"cannot multiply {left.type.named} by {right.type.named}")


def _composed(left: Term, right: Term, trees: Trees) -> Term:
    a, b = left.type, right.type
    if not meet(a.source, b.target):
        apart = f"{shown(a.source)} and {shown(b.target)} do not touch"
        raise CalcError(f"{a} * {b}: {apart}; {for_product(left, right, trees)}")
    return arithmetic(Type(POSE, a.target, b.source), rigid.compose, left, right)


def _moved(pose: Term, point: Term, trees: Trees) -> Term:
    a, b = pose.type, point.type
    if not meet(a.source, b.target):
        what = f"{b.kind}s"
        hint = for_point(pose, point, trees).replace("points", what)
        raise CalcError(f"{a} takes {what} in {shown(a.source)}, found one in {shown(b.target)}; {hint}")
    kernel = rigid.apply if b.kind == POINT else _turned
    return arithmetic(Type(b.kind, a.target), kernel, pose, point)


def _require_scale(number: Term) -> None:
    if number.type.unit not in (PLAIN, METRE):
        raise CalcError(f"a vector is scaled by a plain number or a length, found {number.type.named}")


def _added(a: Dimension, b: Dimension) -> Dimension:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def raised(unit: Dimension, power: float) -> Dimension:
    """Return a power of a unit."""
    return unit[0] * power, unit[1] * power, unit[2] * power


def over(left: Term, right: Term, _: Trees) -> Term:
    """Divide by a number."""
    a, b = left.type, right.type
    if b.kind != NUMBER:
        hint = f"; for poses: {inverse_text(right)} * {_simplest(left).bracketed}" if a.kind == b.kind == POSE else ""
        raise CalcError(f"cannot divide by {b.named}{hint}")
    if a.kind == NUMBER:
        type_ = Type(NUMBER, unit=_added(a.unit, raised(b.unit, -1.0)))
        if b.unit == PLAIN or (a.degrees and b.degrees):
            type_ = type_._replace(degrees=a.degrees and not b.degrees)
            return arithmetic(type_, _OVER, left, right, check=_no_division)
        return arithmetic(type_, _OVER, in_radians(left), in_radians(right), check=_no_division)
    if a.kind == VECTOR:
        _require_scale(right)
        return arithmetic(a, lambda x, y, z, n: (x / n, y / n, z / n), left, right, check=_no_division)
    hint = "; its part is pose ^ 0.5" if a.kind == POSE else "; a direction is vector([x, y, z])" * (a.kind == POINT)
    raise CalcError(f"cannot divide {a.named} by a number{hint}")


# --- sums ---


def _sum(left: Term, right: Term, trees: Trees, *, adding: bool) -> Term:
    """Add or subtract what can be added."""
    a, b = left.type, right.type
    verb, sign, kernel = ("add", "+", _PLUS) if adding else ("subtract", "-", _MINUS)
    if a.kind == b.kind == NUMBER:
        if a.unit != b.unit:
            raise CalcError(f"cannot {verb} {a.named} and {b.named}")
        if a.degrees and b.degrees:
            return arithmetic(a, kernel, left, right)
        return arithmetic(a._replace(degrees=False), kernel, in_radians(left), in_radians(right))
    if (a.kind in PLACED and b.kind in PLACED) or a.kind == b.kind == TWIST:
        frame = common(left, right, trees)
        return arithmetic(Type(_kind_of_sum(a, b, adding=adding), frame), kernel, left, right)
    if POSE in (a.kind, b.kind):
        raise CalcError(f"poses are composed with *, not {sign}; the difference of two is inv(a) * b")
    raise CalcError(f"cannot {verb} {a.named} and {b.named}")


def _kind_of_sum(a: Type, b: Type, *, adding: bool) -> str:
    """Return what a sum or difference of points and vectors is, or of twists."""
    if a.kind == b.kind == POINT:
        if adding and (a.target is not None or b.target is not None):
            raise CalcError("the sum of two points depends on the origin; subtract them, or use mean(..)")
        return POINT if adding else VECTOR
    if a.kind == VECTOR and b.kind == POINT and not adding:
        raise CalcError("a point cannot be subtracted from a vector; point - vector is a point")
    return a.kind if a.kind == b.kind else POINT


OPERATORS: dict[str, Callable[[Term, Term, Trees], Term]] = {
    "*": times,
    "/": over,
    "+": partial(_sum, adding=True),
    "-": partial(_sum, adding=False),
}


def negated(term: Term) -> Term:
    """Return the negative of a number, a vector or a twist."""
    kind = term.type.kind
    if kind == POSE:
        raise CalcError("a pose has no negative; inv(..) is its inverse")
    if kind == POINT and term.type.target is not None:
        raise CalcError("a point in a frame has no negative; a direction is vector(..)")
    if kind not in (NUMBER, VECTOR, TWIST, POINT):
        raise CalcError(f"{term.type.named} has no negative")
    return arithmetic(term.type, lambda *parts: tuple(0.0 - part for part in parts), term)


def unsigned(term: Term) -> Term:
    """Take what a plus stands before."""
    if term.type.kind == POSE:
        raise CalcError("a pose has no sign; leave the + out")
    return term


# --- powers and frames ---


def inverse(term: Term) -> Term:
    """Return b<-a of a<-b."""
    found = arithmetic(Type(POSE, term.type.source, term.type.target), rigid.inverse, term)
    return found._replace(inverse_of=term)


def power(base: Term, exponent: Term) -> Term:
    """Raise a number to a power, or take a part of a pose's screw motion: exp(f log); -1 is the inverse."""
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
    if a.unit == PLAIN:
        return made(a, _powered, base, exponent, check=_no_power)
    if known is None:
        raise CalcError(f"the exponent of {a.named} must be a number that is known")
    return made(Type(NUMBER, unit=raised(a.unit, known)), _powered, in_radians(base), exponent, check=_no_power)


def _part_of_motion(*numbers: Number) -> Components:
    *pose, fraction, xp = numbers
    vx, vy, vz, wx, wy, wz = (fraction * part for part in rigid.log(*unit_pose(*pose, xp), xp))
    return rigid.exp(vx, vy, vz, wx, wy, wz, xp)


def unit_pose(*parts: Number) -> Rigid:
    """Return a pose with its quaternion made unit, which products keep only to some eps.

    parts: of the pose, and the namespace
    """
    tx, ty, tz, x, y, z, w, xp = parts
    return tx, ty, tz, *quaternion.unit(x, y, z, w, xp)


def _powered(base: Number, exponent: Number, xp: Namespace) -> Components:
    if xp is floats:
        return (_power(base, exponent),)
    import numpy as np

    powers: Any = np.frompyfunc(_row_power, 2, 1)  # arrays' own differ between processors
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
    return term._replace(type=type_._replace(target=target, source=source), inverse_of=None)


def in_frame(term: Term, frame: str) -> Term:
    """Say what frame a point, a vector, a twist or angles are seen in."""
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
        hint = "a point has 3, a twist 6; rotations say what they are: {rpy_deg: [..]}"
        raise CalcError(f"a list of {numbers}; {hint}")
    units = [METRE] * 3 + [RADIAN] * 3
    for term, unit in zip(items, units, strict=False):
        if term.type.unit not in (PLAIN, unit):
            what = "a point is in metres" if len(items) == 3 else "a twist is three lengths, then three angles"
            raise CalcError(f"{what}, found {term.type.named}")
    kind = POINT if len(items) == 3 else TWIST
    return arithmetic(Type(kind), lambda *parts: parts, *map(in_radians, items))
