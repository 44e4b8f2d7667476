"""The functions of expressions: a table of their arguments, results and kernels.

Functions of numbers: trigonometry, roots; angles in degrees keep right angles exact.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.calc import rules
from frametool.calc.parser import METRE, RADIAN, CalcError, frame_text
from frametool.calc.values import (
    ANGLES,
    LIST,
    NUMBER,
    PLAIN_NUMBER,
    POINT,
    POSE,
    TWIST,
    VECTOR,
    Term,
    Type,
    arithmetic,
    made,
)
from frametool.geometry import euler, floats, quaternion, rigid, validation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.calc.evaluate import Scope
    from frametool.calc.values import Kernel
    from frametool.geometry.types import Components, Namespace, Number

    Rule = Callable[[str, Sequence[Term]], Term]

MANY = 1 << 16
LENGTH, ANGLE = Type(NUMBER, unit=METRE), Type(NUMBER, unit=RADIAN)


def trigonometric(pick: Callable[[Number, Number], Number]) -> Rule:
    """Return the rule of a function of an angle, from its sine and cosine; exact at quarter turns in degrees."""

    def rule(name: str, terms: Sequence[Term]) -> Term:
        angle = rules.scalar(terms[0], f"{name}()", angle=True)
        halved = floats.half_sincos_deg if angle.type.degrees else floats.half_sincos
        return made(PLAIN_NUMBER, lambda value, xp: (pick(*halved(2.0 * value, xp)),), angle)

    return rule


def of_number(
    type_: Type, kernel: Callable[..., Number], takes: str = "", allowed: Callable[[float], bool] = lambda _: True
) -> Rule:
    """Return the rule of a function of a plain number; takes: the numbers that are allowed, in words."""

    def rule(name: str, terms: Sequence[Term]) -> Term:
        def check(value: float) -> str:
            return "" if allowed(value) else f"{name}() takes {takes}, found {value:g}"

        number = rules.scalar(terms[0], f"{name}()")
        return made(type_, lambda value, xp: (kernel(value, xp),), number, check=check)

    return rule


def arcsine(value: Number, xp: Namespace) -> Number:
    """Return the angle with a sine."""
    return floats.bearing(value, xp.sqrt((1.0 - value) * (1.0 + value)), 1.0, xp)


def arccosine(value: Number, xp: Namespace) -> Number:
    """Return the angle with a cosine."""
    return floats.bearing(xp.sqrt((1.0 - value) * (1.0 + value)), value, 1.0, xp)


def arctangent(value: Number, xp: Namespace) -> Number:
    """Return the angle with a tangent of any size."""
    steep = abs(value) > 1.0
    small = xp.where(steep, 1.0 / xp.where(steep, value, 1.0), value)
    angle = xp.doubled_arctan(small / (1.0 + xp.sqrt(1.0 + small * small)))
    return xp.where(steep, xp.copysign(floats.RIGHT_ANGLE, value) - angle, angle)


class Builtin(NamedTuple):
    """A function: the number of its arguments, descriptions of the arguments and the result, and its rule.

    rule: from its name and its arguments to the result
    """

    least: int
    most: int
    takes: str
    gives: str
    rule: Rule


def of_one(kinds: Sequence[str], type_of: Callable[[Type], Type], kernel: Kernel) -> Rule:
    """Return the rule of a function of one pose, point or vector."""

    def rule(name: str, terms: Sequence[Term]) -> Term:
        term = rules.need(terms[0], kinds, name)
        return made(type_of(term.type), kernel, term)

    return rule


def _exp(name: str, terms: Sequence[Term]) -> Term:
    def check(*numbers: float) -> str:
        rigid.check_twist(*numbers)
        return ""

    twist = terms[0]
    if twist.type.kind != TWIST:
        raise CalcError(f"{name}() takes six numbers [vx, vy, vz, wx, wy, wz], found {twist.type.named}")
    return made(Type(POSE, twist.type.target), rigid.exp, twist, check=check)


def _interp(name: str, terms: Sequence[Term]) -> Term:
    def line(*numbers: Number) -> Components:
        f = numbers[6]
        return tuple(a + f * (b - a) for a, b in zip(numbers[:3], numbers[3:6], strict=True))

    a, b, fraction = terms
    if a.type.kind == b.type.kind and a.type.kind in rules.PLACED:
        type_ = a.type._replace(target=rules.common(a, b))
        return arithmetic(type_, line, a, b, rules.scalar(fraction, "a fraction"))
    type_ = rules.same_frames([rules.need(a, (POSE,), name), rules.need(b, (POSE,), name)], f"{name}()")
    return made(type_, rigid.interpolate, a, b, rules.scalar(fraction, "a fraction"))


def _mean(name: str, terms: Sequence[Term]) -> Term:
    each = terms[0].items if len(terms) == 1 and terms[0].type.kind == LIST else tuple(map(rules.wanted, terms))
    if not each:
        raise CalcError("mean() of nothing")
    type_ = each[0].type
    kind = type_.kind if type_.kind in (*rules.PLACED, NUMBER) else POSE
    for term in each:
        rules.need(term, (kind,), name)
    if kind == POSE:
        return made(rules.same_frames(each, f"{name}()"), _mean_pose, *each)
    for term in each[1:]:
        if kind == NUMBER and term.type.unit != type_.unit:
            raise CalcError(f"mean() of {type_.named} and {term.type.named}")
        if kind != NUMBER:
            type_ = type_._replace(target=rules.common(Term(type_), term))
    kernel = _mean_parts(1 if kind == NUMBER else 3)
    return arithmetic(type_._replace(degrees=False), kernel, *map(rules.in_radians, each))


def _mean_parts(width: int) -> Kernel:
    def mean(*parts: Number) -> Components:
        count = len(parts) // width
        return tuple(sum(parts[at + width :: width], parts[at]) / count for at in range(width))

    return mean


def _mean_pose(*parts: Number) -> Components:
    """Return the mean of translations and the chordal mean of rotations (Markley et al. 2007)."""
    *numbers, xp = parts
    poses = [numbers[at : at + 7] for at in range(0, len(numbers), 7)]
    count = len(poses)
    shift = [sum((pose[at] for pose in poses[1:]), poses[0][at]) / count for at in range(3)]
    import numpy as np

    rotations = zip(*(pose[3:] for pose in poses), strict=True)
    parts = tuple(np.stack(np.broadcast_arrays(*column)) for column in rotations)
    return (*shift, *xp.canonical_sign(*validation.mean_quaternion(parts, np.ones(count))))


def _dist(name: str, terms: Sequence[Term]) -> Term:
    def points(*numbers: Number) -> Components:
        ax, ay, az, bx, by, bz, xp = numbers
        return (quaternion.magnitude(bx - ax, by - ay, bz - az, xp),)

    a, b = (rules.need(each, (POSE, POINT), name) for each in terms)
    if a.type.kind != b.type.kind:
        raise CalcError(f"{name}() compares two poses or two points, found {a.type.named} and {b.type.named}")
    if a.type.kind == POSE:
        rules.one_target(a, b, f"{name}()")
        return made(LENGTH, lambda *numbers: (rigid.distance(*numbers)[0],), a, b)
    rules.common(a, b)
    return made(LENGTH, points, a, b)


def _angle(name: str, terms: Sequence[Term]) -> Term:
    def own(*pose: Number) -> Components:
        return (rigid.extent(*rules.unit_pose(*pose), pose[-1])[1],)

    def poses(*both: Number) -> Components:
        xp = both[-1]
        return (rigid.distance(*rules.unit_pose(*both[:7], xp), *rules.unit_pose(*both[7:]), xp)[1],)

    if len(terms) == 1:
        if terms[0].type.kind in rules.PLACED:
            raise CalcError(f"{name}() takes a pose, two poses or two vectors; found one {terms[0].type.kind}")
        return made(ANGLE, own, rules.need(terms[0], (POSE,), name))
    a, b = (rules.need(each, (POSE, VECTOR, POINT), name) for each in terms)
    if (a.type.kind == POSE) != (b.type.kind == POSE):
        raise CalcError(f"{name}() compares two poses or two vectors, found {a.type.named} and {b.type.named}")
    if a.type.kind == POSE:
        rules.one_target(a, b, f"{name}()")
        return made(ANGLE, poses, a, b)
    rules.common(a, b)
    return made(ANGLE, _between_vectors, a, b, check=_no_direction)


def _no_direction(*parts: float) -> str:
    return "" if any(parts[:3]) and any(parts[3:6]) else "vector 0 0 0 has no direction; the angle to it is not defined"


def _between_vectors(
    ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number, xp: Namespace
) -> Components:
    """Return the angle between two vectors: 2 atan2(|b - a|, |a + b|) of their directions (Kahan)."""
    ax, ay, az = quaternion.unit_vector(ax, ay, az, xp)
    bx, by, bz = quaternion.unit_vector(bx, by, bz, xp)
    apart = quaternion.length(0.5 * (bx - ax), 0.5 * (by - ay), 0.5 * (bz - az), xp)
    along = quaternion.length(0.5 * (bx + ax), 0.5 * (by + ay), 0.5 * (bz + az), xp)
    return (2.0 * floats.incline(apart, along, xp),)


def _cross(name: str, terms: Sequence[Term]) -> Term:
    a, b = (rules.need(each, rules.PLACED, name) for each in terms)
    return arithmetic(Type(VECTOR, rules.common(a, b)), quaternion.cross, a, b)


def _dot(name: str, terms: Sequence[Term]) -> Term:
    a, b = (rules.need(each, rules.PLACED, name) for each in terms)
    rules.common(a, b)
    return arithmetic(PLAIN_NUMBER, lambda ax, ay, az, bx, by, bz: (ax * bx + ay * by + az * bz,), a, b)


def _inv(name: str, terms: Sequence[Term]) -> Term:
    return rules.inverse(rules.need(terms[0], (POSE,), name))


def _is_sine(value: float) -> bool:
    return abs(value) <= 1.0


_POSE = (POSE,)
_trans = of_one(_POSE, lambda pose: Type(POINT, pose.target), lambda *pose: pose[:3])
_rot = of_one(_POSE, lambda pose: pose, lambda *pose: (*(0.0 * part for part in pose[:3]), *pose[3:7]))
_log = of_one(_POSE, lambda pose: Type(TWIST, pose.target), lambda *pose: rigid.log(*rules.unit_pose(*pose), pose[-1]))
_rpy = of_one(_POSE, lambda pose: Type(ANGLES, pose.target),
              lambda *pose: euler.from_quaternion(*rules.unit_pose(*pose)[3:], "sxyz", pose[-1]))  # fmt: skip
_norm = of_one(rules.PLACED, lambda _: LENGTH, lambda *vector: (quaternion.magnitude(*vector),))
_vector = of_one(rules.PLACED, lambda placed: placed._replace(kind=VECTOR), lambda *vector: vector[:3])


FUNCTIONS = {
    "inv": Builtin(1, 1, "pose", "b<-a of a<-b", _inv),
    "trans": Builtin(1, 1, "pose", "its source's origin, a point in its target", _trans),
    "rot": Builtin(1, 1, "pose", "it without its shift", _rot),
    "rpy": Builtin(1, 1, "pose", "its roll, pitch, yaw", _rpy),
    "log": Builtin(1, 1, "pose", "its twist [vx, vy, vz, wx, wy, wz]", _log),
    "exp": Builtin(1, 1, "six", "the pose a twist reaches in unit time", _exp),
    "dist": Builtin(2, 2, "a, b", "metres between two poses or points seen from one frame", _dist),
    "angle": Builtin(1, 2, "a or a, b", "that of a pose, between two poses or two vectors", _angle),
    "interp": Builtin(3, 3, "a, b, fraction", "between two: straight line and slerp", _interp),
    "mean": Builtin(1, MANY, "a, b, .. or list", "the mean of poses, points, vectors or numbers", _mean),
    "vector": Builtin(1, 1, "[x, y, z]", "a direction: turned by poses, not shifted", _vector),
    "norm": Builtin(1, 1, "v", "length of a point or vector", _norm),
    "dot": Builtin(2, 2, "v, w", "scalar product", _dot),
    "cross": Builtin(2, 2, "v, w", "vector product", _cross),
    "sin": Builtin(1, 1, "angle", "sine", trigonometric(lambda sine, _: sine)),
    "cos": Builtin(1, 1, "angle", "cosine", trigonometric(lambda _, cosine: cosine)),
    "tan": Builtin(1, 1, "angle", "tangent", trigonometric(lambda sine, cosine: sine / cosine)),
    "asin": Builtin(1, 1, "number", "angle of a sine", of_number(ANGLE, arcsine, "-1 .. 1", _is_sine)),
    "acos": Builtin(1, 1, "number", "angle of a cosine", of_number(ANGLE, arccosine, "-1 .. 1", _is_sine)),
    "atan": Builtin(1, 1, "number", "angle of a tangent", of_number(ANGLE, arctangent)),
    "sqrt": Builtin(1, 1, "number", "square root", of_number(
        PLAIN_NUMBER, lambda value, xp: xp.sqrt(value), "what is not negative", lambda value: value >= 0.0)),
}  # fmt: skip


BETWEEN_WORDS = " \t()[]{},*^@+="
WORDS = ("row", "pi", "ans", "as ", "in ")


class Completer:
    """Completes frames on both sides of an arrow, names, and functions with their bracket."""

    def __init__(self, scope: Scope, line: Any) -> None:
        """Store the scope, and readline, which knows the line."""
        self.scope = scope
        self.line = line

    def __call__(self, text: str, state: int) -> str | None:
        """Return one completion after another."""
        found = self.completions(text, self.line.get_line_buffer()[: self.line.get_begidx()])
        return found[state] if state < len(found) else None

    def completions(self, text: str, before: str) -> list[str]:
        """Return all completions of a word after the rest of a line."""
        opened = re.search(r"(\w+) *\[$", before)  # the bracket of a named tree
        asked = self.scope.names[opened[1]].tree if opened and opened[1] in self.scope.names else None
        tree = asked or self.scope.tree
        frames = sorted(map(frame_text, tree.frames)) if tree else []
        head, arrow, tail = text.partition("<-")
        if arrow:
            return [f"{head}<-{frame}" for frame in frames if frame.startswith(tail)]
        words = () if asked else (*self.scope.names, *(f"{name}(" for name in FUNCTIONS), *WORDS)
        return [word for word in (*words, *(f"{frame}<-" for frame in frames)) if word.startswith(text)]
