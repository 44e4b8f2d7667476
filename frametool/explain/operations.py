"""Steps of what is done to poses: product, inverse, difference, the way between two, a change of axes at both ends.

And of what moves the content of a record into another frame: points, vectors, twists, wrenches, covariances.
"""

from __future__ import annotations

from itertools import product as pairs
from typing import TYPE_CHECKING, NamedTuple

from frametool.explain.sheet import CYCLES, METRES, RADIANS, XYZ, XYZW, Sheet, norm, transposed, upright
from frametool.geometry import quaternion, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.explain.sheet import Matrix
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Quaternion, Vector
    Parts = list[str | Matrix]

TOUCH = "Frames that touch cancel. The second position is first turned into the first frame, then the first is added."
ORDER = (
    "a b read left to right turns about the axes as they turn along; right to left, about axes that stand still. "
    "b a would be another rotation."
)
INVERSE = "The position is not just negated but also turned into the other frame: -R^T t."
HALF_TURN = "Half a turn apart both ways round are equally short; the sign of b decides, as in tf2."
VECTOR = "A direction (vector, axis, velocity) is only turned: R v, without + t. A point moves by R p + t."
ARM = "The velocity and the torque depend on the point they are taken at: the lever arm t comes in."
MIRROR = "One side alone would leave no rotation: its matrix would have the determinant -1."
FROM_Q = "R(q) is the matrix of q: r11 = 1 - 2 (y^2 + z^2), r12 = 2 (x y - z w), and so on."
NEARLY_ZERO = 1e-15
HAMILTON = {
    "x": "aw*bx + ax*bw + ay*bz - az*by",
    "y": "aw*by - ax*bz + ay*bw + az*bx",
    "z": "aw*bz + ax*by - ay*bx + az*bw",
    "w": "aw*bw - ax*bx - ay*by - az*bz",
}


def _named(prefix: str, numbers: Sequence[float], names: Sequence[str]) -> dict[str, float]:
    return {f"{prefix}{name}": number for name, number in zip(names, numbers, strict=True)}


def product(sheet: Sheet, a: Quaternion, b: Quaternion) -> Quaternion:
    """Multiply two quaternions."""
    values = _named("a", a, XYZW) | _named("b", b, XYZW)
    sheet.say("c = a b (Hamilton: ij = k, ji = -k; not commutative)")
    x, y, z, w = (sheet.step(values, f"c{name}", formula) for name, formula in HAMILTON.items())
    sheet.caveat(ORDER)
    return x, y, z, w


def compose(sheet: Sheet, a: Rigid, b: Rigid, frames: tuple[str, str, str]) -> Rigid:
    """Multiply two poses: `frames` are those of a_from_b and b_from_c, in this order."""
    first, middle, last = frames
    sheet.heading(f"{first}_from_{last} = {first}_from_{middle} @ {middle}_from_{last}")
    sheet.say(TOUCH)
    position = turned(sheet, a[3:], b[:3], "t", ("R(a) tb + ta", r"R(a)\,t_b + t_a"), METRES, shift=a[:3])
    return *position, *product(sheet, a[3:], b[3:])


def turned(
    sheet: Sheet, q: Quaternion, vector: Sequence[float], name: str, formula: tuple[str, str], unit: str = "",
    shift: Sequence[float] = (),
) -> Vector:  # fmt: skip
    """Turn a vector, or turn and then shift a point."""
    return _times(sheet, sheet.matrix(q), vector, name, formula, unit, shift)


def _times(
    sheet: Sheet, matrix: Matrix, vector: Sequence[float], name: str, formula: tuple[str, str], unit: str,
    shift: Sequence[float] = (),
) -> Vector:  # fmt: skip
    """Add a matrix times a vector, and a shift."""
    x, y, z = (sheet.inner(row, vector, *shift[at : at + 1]) for at, row in enumerate(matrix))
    more: Parts = ["+", upright(shift)] if shift else []
    sheet.grid(name, *formula, [matrix, upright(vector), *more, "=", upright((x, y, z))], unit)
    return x, y, z


def inverse(sheet: Sheet, pose: Rigid, target: str, source: str) -> Rigid:
    """Turn target_from_source around."""
    sheet.heading(f"{source}_from_{target} = inverse of {target}_from_{source}")
    sheet.say("The axis turns round: q* = (-x, -y, -z, w), and its matrix is R^T.")
    back = transposed(sheet.matrix(pose[3:]))
    x, y, z = (0.0 - sheet.inner(row, pose[:3]) for row in back)
    parts: Parts = ["-", back, upright(pose[:3]), "=", upright((x, y, z))]
    sheet.grid("t'", "-R^T t", r"-R^{\mathsf T}\,t", parts, METRES)
    sheet.caveat(INVERSE)
    q = quaternion.conjugate(*pose[3:])
    sheet.say("q* = " + ", ".join(f"{name} {sheet.number(part)}" for name, part in zip(XYZW, q, strict=True)))
    return x, y, z, *q


def relative(sheet: Sheet, a: Rigid, b: Rigid, frames: tuple[str, str, str]) -> Rigid:
    """Compare two poses: `frames` are the one both are seen from, that of a and that of b."""
    world, first, second = frames
    sheet.heading(f"{first}_from_{second} = ({world}_from_{first})^-1 @ {world}_from_{second}")
    sheet.say("inverse, then compose: R^T tb + (-R^T ta) = R^T (tb - ta); subtracted first, near poses keep their "
              "digits.")  # fmt: skip
    sheet.say("d = tb - ta")
    values = _named("a", a[:3], XYZ) | _named("b", b[:3], XYZ)
    apart = sheet.each(values, XYZ, "d%", "b% - a%", METRES)
    back = transposed(sheet.matrix(a[3:]))
    x, y, z = _times(sheet, back, apart, "t", ("R(A)^T d", r"R(A)^{\mathsf T}\,d"), METRES)
    sheet.caveat(INVERSE)
    sheet.say("a = q(A)*, b = q(B); the axis of A turns round: q* = (-x, -y, -z, w).")
    return x, y, z, *product(sheet, quaternion.conjugate(*a[3:]), b[3:])


def extent(sheet: Sheet, pose: Rigid, frame: str) -> tuple[float, float, float]:
    """Measure a transform: distance, angle in radians and in degrees."""
    sheet.heading("How far apart")
    values = _named("t", pose[:3], XYZ) | _named("", pose[3:], XYZW)
    distance, _, _ = sheet.length(values, ("tx", "ty", "tz"), "d", METRES)
    sheet.length(values, XYZ, "s")
    angle = sheet.step(values, "angle", "2*atan2(s, abs(w))", RADIANS)
    sheet.caveat(f"The distance does not depend on the frame; the position does: it is written in {frame}.")
    return distance, angle, sheet.angles(values, ["angle"], degrees=True)[0]


def between(sheet: Sheet, a: Rigid, b: Rigid, fraction: float) -> Rigid:
    """Go a fraction of the way between two poses: straight line and slerp."""
    sheet.stretch = max(sheet.stretch, abs(fraction))
    position = line(sheet, a[:3], b[:3], fraction)
    return *position, *slerp(sheet, a[3:], b[3:], fraction)


def line(sheet: Sheet, a: Sequence[float], b: Sequence[float], fraction: float) -> Vector:
    """Interpolate positions along the line, from the nearer end."""
    sheet.heading("Position: along the straight line")
    values = {"f": fraction} | _named("a", a, XYZ) | _named("b", b, XYZ)
    nearer = "a% + f*(b% - a%)" if fraction < 0.5 else "b% - (1 - f)*(b% - a%)"
    x, y, z = sheet.each(values, XYZ, "t%", nearer, METRES)
    return x, y, z


def slerp(sheet: Sheet, a: Quaternion, b: Quaternion, fraction: float) -> Quaternion:
    """Interpolate rotations along the shorter arc."""
    sheet.heading("Rotation: slerp, the shorter arc at constant speed")
    values = {"f": fraction} | _named("a", a, XYZW) | _named("b", b, XYZW)
    sheet.step(values, "dot", "ax*bx + ay*by + az*bz + aw*bw")
    other = "b"
    if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + 0.0 < 0.0:
        sheet.say("dot < 0: the arc to -b, the same rotation, is the shorter one (double cover).")
        other = "n"
        sheet.each(values, XYZW, "n%", "-b%")
    else:
        sheet.say("dot >= 0: the arc to b is not longer than that to -b (double cover).")
    if abs(values["dot"]) < NEARLY_ZERO:
        sheet.caveat(HALF_TURN)
    sheet.each(values, XYZW, "m%", f"{other}% - a%")
    sheet.each(values, XYZW, "p%", f"{other}% + a%")
    sheet.step(values, "minus", norm([f"m{name}" for name in XYZW]))
    sheet.step(values, "plus", norm([f"p{name}" for name in XYZW]))
    sheet.step(values, "arc", "2*atan2(minus, plus)", RADIANS)
    sheet.caveat("The arc between quaternions is half the angle between the rotations.")
    if values["arc"]:
        sheet.step(values, "ka", "sin((1 - f)*arc)/sin(arc)")
        sheet.step(values, "kb", "sin(f*arc)/sin(arc)")
    else:
        sheet.say("The rotations are the same: the weights are those of a straight line.")
        sheet.step(values, "ka", "1 - f")
        sheet.step(values, "kb", "f")
    x, y, z, w = sheet.each(values, XYZW, "q%", f"ka*a% + kb*{other}%")
    return x, y, z, w


def point(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn, then shift."""
    sheet.heading(f"point_in_{target} = {target}_from_{source} * point_in_{source}")
    sheet.say(FROM_Q)
    found = turned(sheet, pose[3:], numbers, "p'", ("R(q) p + t", r"R(q)\,p + t"), METRES, shift=pose[:3])
    sheet.caveat(VECTOR)
    return found


def vector(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn only."""
    sheet.heading(f"vector_in_{target} = R({target}_from_{source}) * vector_in_{source}")
    sheet.say(FROM_Q)
    found = turned(sheet, pose[3:], numbers, "v'", ("R(q) v", "R(q)\\,v"))
    sheet.caveat(VECTOR)
    return found


def twist(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn both vectors; the linear one is then that of the body's point at the target's origin."""
    sheet.heading(f"twist at the origin of {target}, from that at the origin of {source}")
    sheet.say("w' = R w, and v' = R v + t x w': the velocity of the same rigid body, elsewhere.")
    angular, linear = _with_arm(sheet, pose, ("w", numbers[3:], "rad/s"), ("v", numbers[:3], "m/s"))
    return *linear, *angular


def wrench(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn both vectors; the torque is then that about the target's origin."""
    sheet.heading(f"wrench about the origin of {target}, from that about the origin of {source}")
    sheet.say("f' = R f, and m' = R m + t x f'.")
    force, torque = _with_arm(sheet, pose, ("f", numbers[:3], "N"), ("m", numbers[3:], "Nm"))
    return *force, *torque


def _with_arm(
    sheet: Sheet, pose: Rigid, first: tuple[str, Sequence[float], str], second: tuple[str, Sequence[float], str]
) -> tuple[Sequence[float], Sequence[float]]:
    """Turn two vectors (letter, numbers, unit), and add t x the first one to the second."""
    (a, vector, unit), (b, other, other_unit) = first, second
    free = turned(sheet, pose[3:], vector, f"{a}'", (f"R(q) {a}", rf"R(q)\,{a}"), unit)
    here = turned(sheet, pose[3:], other, "u", (f"R(q) {b}", rf"R(q)\,{b}"), other_unit)
    sheet.caveat(ARM)
    values = _named("u", here, XYZ) | _named("t", pose[:3], XYZ) | _named(a, free, XYZ)
    return free, [sheet.step(values, f"{b}{i}", f"u{i} + t{j}*{a}{k} - t{k}*{a}{j}", other_unit) for i, j, k in CYCLES]


def pose_covariance(sheet: Sheet, pose: Rigid, numbers: Sequence[float]) -> Sequence[float]:
    """Turn each 3x3 block C into R C R^T."""
    sheet.heading("The covariance: each 3x3 block C becomes R C R^T")
    turn = sheet.matrix(pose[3:])
    found = [0.0] * 36
    for top, left in pairs((0, 3), repeat=2):
        sheet.say(f"{'rotation' if top else 'position'} with {'rotation' if left else 'position'}:")
        places = [slice(at + left, at + left + 3) for at in range(6 * top, 6 * top + 18, 6)]
        made = _sandwich(sheet, turn, [list(numbers[place]) for place in places], "R C R^T", r"R\,C\,R^{\mathsf T}")
        for place, row in zip(places, made, strict=True):
            found[place] = row
    return found


def twist_covariance(sheet: Sheet, pose: Rigid, numbers: Sequence[float]) -> Sequence[float]:
    """Turn the 6x6 covariance C into A C A^T."""
    sheet.heading("The covariance of the twist: A C A^T")
    sheet.say("A is what the move does to the six numbers: rows R | t x R, and 0 | R.")
    turn = sheet.matrix(pose[3:])
    tx, ty, tz = pose[:3]
    arm = sheet.product([[0.0, -tz, ty], [tz, 0.0, -tx], [-ty, tx, 0.0]], turn)
    adjoint = [[*turn[i], *arm[i]] for i in range(3)] + [[0.0, 0.0, 0.0, *turn[i]] for i in range(3)]
    rows = [list(numbers[6 * i : 6 * i + 6]) for i in range(6)]
    made = _sandwich(sheet, adjoint, rows, "A C A^T", r"A\,C\,A^{\mathsf T}")
    return [entry for row in made for entry in row]


def _sandwich(sheet: Sheet, a: Matrix, c: Matrix, text: str, latex: str) -> Matrix:
    back = transposed(a)
    found = sheet.product(sheet.product(a, c), back)
    sheet.grid("C'", text, latex, [a, c, back, "=", found])
    return found


MOVERS: dict[str, Callable[..., Sequence[float]]] = {"point": point, "vector": vector, "twist": twist, "wrench": wrench}


class OtherAxes(NamedTuple):
    """A change of axes: the names and rotations of its sides, None for one that stays, and whether it is a mirror."""

    world: tuple[str, Quaternion] | None = None
    axes: tuple[str, Quaternion] | None = None
    mirrors: bool = False


def with_other_axes(sheet: Sheet, pose: Rigid, change: OtherAxes) -> Rigid:
    """Add the steps from a pose to the same with other axes, on its left, then on its right."""
    if change.world is not None and change.axes is not None:
        sheet.say("p becomes W p B: W turns the frame it is seen from, B the frame it is the pose of.")
    if change.mirrors:
        sheet.heading("Mirrored across y, for axes that are left-handed")
        sheet.say("y changes its sign, and so do the turns about x and z: t = (x, -y, z), q = (-qx, qy, -qz, qw).")
        pose = rigid.mirrored(*pose)
        sheet.say(f"p = xyz {sheet.numbers(pose[:3])} m, xyzw {sheet.numbers(pose[3:])}")
        sheet.caveat(MIRROR)
    if change.world is not None:
        name, w = change.world
        sheet.heading(f"Other axes of the frame it is seen from: {name}")
        sheet.say(f"W = {name} turns the position and stands on the left of the rotation so far: a = W, b = q.")
        x, y, z = pose[:3]
        if x or y or z:
            x, y, z = turned(sheet, w, pose[:3], "t", ("R(W) t", r"R(W)\,t"), METRES)
        pose = x, y, z, *product(sheet, w, pose[3:])
    if change.axes is None:
        return pose
    name, b = change.axes
    sheet.heading(f"Other axes: {name}")
    sheet.say(f"a is the rotation so far, b = {name}: the pose of the new axes in the old ones.")
    return *pose[:3], *product(sheet, pose[3:], b)
