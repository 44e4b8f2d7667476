"""The functions of expressions: one literal table of what each takes, gives and does.

Functions of numbers: sines and their kin, roots; angles in degrees keep right angles exact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc.rules import (
    PLACED,
    common,
    in_radians,
    inverse,
    need,
    one_target,
    plain_angle,
    plain_number,
    same_frames,
    wanted,
    with_unit,
)
from frametool.calc.tokens import CalcError
from frametool.calc.values import (
    ANGLES,
    LIST,
    METRE,
    NUMBER,
    PLAIN,
    PLAIN_NUMBER,
    POINT,
    POSE,
    RADIAN,
    TWIST,
    VECTOR,
    Term,
    Type,
    made,
)
from frametool.geometry import euler, quaternion, rigid, trig

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.calc.rules import Trees
    from frametool.geometry.types import Components, Namespace, Number

def _sincos(angle: Number, xp: Namespace, *, degrees: bool) -> Components:
    """Return sine and cosine; exact at whole quarter turns in degrees."""
    found: Components = (trig.half_sincos_deg if degrees else trig.half_sincos)(2.0 * angle, xp)
    return found


def trigonometric(pick: Callable[[Number, Number], Number]) -> Callable[[str, Sequence[Term], Trees], Term]:
    """Return the rule of a function of an angle, made of its sine and cosine."""
    def rule(name: str, terms: Sequence[Term], _: Trees) -> Term:
        angle = plain_angle(wanted(terms[0]), f"{name}()")
        degrees = angle.type.degrees

        def kernel(value: Number, xp: Namespace) -> Components:
            return (pick(*_sincos(value, xp, degrees=degrees)),)

        return made(PLAIN_NUMBER, kernel, angle)

    return rule


def arc(kernel: Callable[..., Number], bound: float | None) -> Callable[[str, Sequence[Term], Trees], Term]:
    """Return the rule of a function whose value is an angle; `bound` is the largest number it takes."""
    def rule(name: str, terms: Sequence[Term], _: Trees) -> Term:
        def check(value: float) -> str:
            return f"{name}() takes -1 .. 1, found {value:g}" if bound is not None and abs(value) > bound else ""

        number = plain_number(wanted(terms[0]), f"{name}()")
        return made(Type(NUMBER, unit=RADIAN), lambda value, xp: (kernel(value, xp),), number, check=check)

    return rule


def arcsine(value: Number, xp: Namespace) -> Number:
    """Return the angle of a sine."""
    return trig.bearing(value, xp.sqrt((1.0 - value) * (1.0 + value)), 1.0, xp)


def arccosine(value: Number, xp: Namespace) -> Number:
    """Return the angle of a cosine."""
    return trig.bearing(xp.sqrt((1.0 - value) * (1.0 + value)), value, 1.0, xp)


def arctangent(value: Number, xp: Namespace) -> Number:
    """Return the angle of a tangent of any size."""
    steep = abs(value) > 1.0
    small = xp.where(steep, 1.0 / xp.where(steep, value, 1.0), value)
    angle = xp.doubled_arctan(small / (1.0 + xp.sqrt(1.0 + small * small)))
    return xp.where(steep, xp.copysign(trig.RIGHT_ANGLE, value) - angle, angle)


def sqrt(name: str, terms: Sequence[Term], _: Trees) -> Term:
    """Take the square root of a number and of its unit."""
    def check(value: float) -> str:
        return f"{name}() takes what is not negative, found {value:g}" if value < 0.0 else ""

    number = in_radians(need(wanted(terms[0]), (NUMBER,), name))
    unit = number.type.unit
    type_ = Type(NUMBER, unit=(unit[0] / 2.0, unit[1] / 2.0, unit[2] / 2.0)) if unit != PLAIN else PLAIN_NUMBER
    return made(type_, lambda value, xp: (xp.sqrt(value),), number, check=check)


MANY = 1 << 16


class Builtin:
    """A function: how many values it takes, in words what and what for, and its rule.

    rule: from its name, its values and the trees there are to the result
    """

    __slots__ = ("gives", "least", "most", "rule", "takes")

    def __init__(
        self, least: int, most: int, takes: str, gives: str, rule: Callable[[str, Sequence[Term], Trees], Term]
    ) -> None:
        """Keep all of it."""
        self.least = least
        self.most = most
        self.takes = takes
        self.gives = gives
        self.rule = rule


def _inv(name: str, terms: Sequence[Term], _: Trees) -> Term:
    return inverse(need(terms[0], (POSE,), name))


def _trans(name: str, terms: Sequence[Term], _: Trees) -> Term:
    pose = need(terms[0], (POSE,), name)
    return made(Type(POINT, pose.type.target), lambda *parts: parts[:3], pose, functions=False)


def _rot(name: str, terms: Sequence[Term], _: Trees) -> Term:
    pose = need(terms[0], (POSE,), name)
    return made(pose.type, lambda *parts: (*[0.0 * part for part in parts[:3]], *parts[3:]), pose, functions=False)


def _rpy(name: str, terms: Sequence[Term], _: Trees) -> Term:
    def angles(*parts: Number) -> Components:
        *pose, xp = parts
        return euler.from_quaternion(*with_unit(pose, xp)[3:], "sxyz", xp)

    pose = need(terms[0], (POSE,), name)
    return made(Type(ANGLES, pose.type.target), angles, pose)


def _log(name: str, terms: Sequence[Term], _: Trees) -> Term:
    def twist(*parts: Number) -> Components:
        *pose, xp = parts
        return rigid.log(*with_unit(pose, xp), xp)

    pose = need(terms[0], (POSE,), name)
    return made(Type(TWIST, pose.type.target), twist, pose)


def _exp(name: str, terms: Sequence[Term], _: Trees) -> Term:
    def check(*twist: float) -> str:
        rigid.check_twist(*twist)
        return ""

    twist = terms[0]
    if twist.type.kind != TWIST:
        raise CalcError(f"{name}() takes six numbers [vx, vy, vz, wx, wy, wz], found {twist.type.named}")
    return made(Type(POSE, twist.type.target), rigid.exp, twist, check=check)


def _interp(name: str, terms: Sequence[Term], _: Trees) -> Term:
    a, b, fraction = terms
    if a.type.kind == b.type.kind and a.type.kind in PLACED:
        return _between_points(name, terms, _)
    type_ = same_frames([need(a, (POSE,), name), need(b, (POSE,), name)], f"{name}()")
    return made(type_, rigid.interpolate, a, b, plain_number(fraction, "a fraction"))


def _between_points(_name: str, terms: Sequence[Term], trees: Trees) -> Term:
    def line(*parts: Number) -> Components:
        f = parts[6]
        return tuple(a + f * (b - a) for a, b in zip(parts[:3], parts[3:6], strict=True))

    a, b, fraction = terms
    type_ = a.type._replace(target=common(a, b, trees))
    return made(type_, line, a, b, plain_number(fraction, "a fraction"), functions=False)


def _mean(name: str, terms: Sequence[Term], trees: Trees) -> Term:
    each = terms[0].items if len(terms) == 1 and terms[0].type.kind == LIST else tuple(map(wanted, terms))
    if not each:
        raise CalcError("mean() of nothing")
    for term in each:
        need(term, (each[0].type.kind,) if each[0].type.kind in (*PLACED, NUMBER, POSE) else (POSE,), name)
    kind = each[0].type.kind
    if kind == POSE:
        return made(same_frames(each, f"{name}()"), _mean_pose, *each)
    type_ = each[0].type
    for term in each[1:]:
        if kind == NUMBER and term.type.unit != type_.unit:
            raise CalcError(f"mean() of {type_.named} and {term.type.named}")
        if kind != NUMBER:
            type_ = type_._replace(target=common(Term(type_, text=each[0].text), term, trees))
    if kind == NUMBER:
        return made(type_._replace(degrees=False), _mean_parts(1), *map(in_radians, each), functions=False)
    return made(type_, _mean_parts(3), *each, functions=False)


def _mean_parts(width: int) -> Callable[..., Components]:
    def mean(*parts: Number) -> Components:
        count = len(parts) // width
        return tuple(sum(parts[at + width :: width], parts[at]) / count for at in range(width))

    return mean


def _mean_pose(*parts: Number) -> Components:
    """Return the mean of translations and the chordal one of rotations (Markley et al. 2007)."""
    *numbers, xp = parts
    poses = [numbers[at : at + 7] for at in range(0, len(numbers), 7)]
    count = len(poses)
    shift = [sum((pose[at] for pose in poses[1:]), poses[0][at]) / count for at in range(3)]
    moment = [
        [sum((p[3 + i] * p[3 + j] for p in poses[1:]), poses[0][3 + i] * poses[0][3 + j]) for j in range(4)]
        for i in range(4)
    ]
    return (*shift, *xp.canonical_sign(*quaternion.largest_eigenvector(moment, xp)))


def _dist(name: str, terms: Sequence[Term], trees: Trees) -> Term:
    def poses(*parts: Number) -> Components:
        return (rigid.distance(*parts)[0],)

    def points(*parts: Number) -> Components:
        ax, ay, az, bx, by, bz, xp = parts
        return (quaternion.magnitude(bx - ax, by - ay, bz - az, xp),)

    a, b = (need(each, (POSE, POINT), name) for each in terms)
    if a.type.kind != b.type.kind:
        raise CalcError(f"{name}() compares two poses or two points, found {a.type.named} and {b.type.named}")
    if a.type.kind == POSE:
        one_target(a, b, f"{name}()", trees)
        return made(Type(NUMBER, unit=METRE), poses, a, b)
    common(a, b, trees)
    return made(Type(NUMBER, unit=METRE), points, a, b)


def _angle(name: str, terms: Sequence[Term], trees: Trees) -> Term:
    def own(*parts: Number) -> Components:
        *pose, xp = parts
        return (rigid.extent(*with_unit(pose, xp), xp)[1],)

    def poses(*parts: Number) -> Components:
        *both, xp = parts
        return (rigid.distance(*with_unit(both[:7], xp), *with_unit(both[7:], xp), xp)[1],)

    type_ = Type(NUMBER, unit=RADIAN)
    if len(terms) == 1:
        if terms[0].type.kind in PLACED:
            raise CalcError(f"{name}() takes a pose, two poses or two vectors; found one {terms[0].type.kind}")
        return made(type_, own, need(terms[0], (POSE,), name))
    a, b = (need(each, (POSE, VECTOR, POINT), name) for each in terms)
    if (a.type.kind == POSE) != (b.type.kind == POSE):
        raise CalcError(f"{name}() compares two poses or two vectors, found {a.type.named} and {b.type.named}")
    if a.type.kind == POSE:
        one_target(a, b, f"{name}()", trees)
        return made(type_, poses, a, b)
    common(a, b, trees)
    return made(type_, _between_vectors, a, b, check=_no_direction)


def _no_direction(*parts: float) -> str:
    return "" if any(parts[:3]) and any(parts[3:6]) else "vector 0 0 0 has no direction; the angle to it is not defined"


def _between_vectors(
    ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number, xp: Namespace
) -> Components:
    """Return the angle of two vectors: 2 atan2(|b - a|, |a + b|) of their directions (Kahan)."""
    ax, ay, az = quaternion.unit_vector(ax, ay, az, xp)
    bx, by, bz = quaternion.unit_vector(bx, by, bz, xp)
    apart = quaternion.length(0.5 * (bx - ax), 0.5 * (by - ay), 0.5 * (bz - az), xp)
    along = quaternion.length(0.5 * (bx + ax), 0.5 * (by + ay), 0.5 * (bz + az), xp)
    return (2.0 * trig.incline(apart, along, xp),)


def _norm(name: str, terms: Sequence[Term], _: Trees) -> Term:
    def length(*parts: Number) -> Components:
        x, y, z, xp = parts
        return (quaternion.magnitude(x, y, z, xp),)

    return made(Type(NUMBER, unit=METRE), length, need(terms[0], PLACED, name))


def _cross(name: str, terms: Sequence[Term], trees: Trees) -> Term:
    a, b = (need(each, PLACED, name) for each in terms)
    return made(Type(VECTOR, common(a, b, trees)), quaternion.cross, a, b, functions=False)


def _dot(name: str, terms: Sequence[Term], trees: Trees) -> Term:
    def dot(ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number) -> Components:
        return (ax * bx + ay * by + az * bz,)

    a, b = (need(each, PLACED, name) for each in terms)
    common(a, b, trees)
    return made(PLAIN_NUMBER, dot, a, b, functions=False)


def _vector(name: str, terms: Sequence[Term], _: Trees) -> Term:
    given = need(terms[0], PLACED, name)
    return given.typed(given.type._replace(kind=VECTOR))


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
    "asin": Builtin(1, 1, "number", "angle of a sine", arc(arcsine, 1.0)),
    "acos": Builtin(1, 1, "number", "angle of a cosine", arc(arccosine, 1.0)),
    "atan": Builtin(1, 1, "number", "angle of a tangent", arc(arctangent, None)),
    "sqrt": Builtin(1, 1, "number", "square root; that of m^2 is m", sqrt),
}
