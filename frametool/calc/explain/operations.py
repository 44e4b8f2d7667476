"""Steps of what is done to poses: product, inverse, difference, the way between two, and what moves points."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc.explain.angles import length, norm, to_degrees
from frametool.calc.explain.matrices import of_quaternion
from frametool.calc.explain.sheet import METRES, RADIANS, transposed, upright
from frametool.calc.explain.to_quaternion import XYZ, XYZW

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.calc.explain.sheet import Matrix, Sheet
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
FROM_Q = "R(q) is the matrix of q: r11 = 1 - 2 (y^2 + z^2), r12 = 2 (x y - z w), and so on."
NEARLY_ZERO = 1e-15
HAMILTON = {
    "x": "aw*bx + ax*bw + ay*bz - az*by",
    "y": "aw*by - ax*bz + ay*bw + az*bx",
    "z": "aw*bz + ax*by - ay*bx + az*bw",
    "w": "aw*bw - ax*bx - ay*by - az*bz",
}


def product(sheet: Sheet, a: Quaternion, b: Quaternion, *, brief: bool = False) -> Quaternion:
    """Multiply two quaternions; brief: on one line."""
    values = _named("a", a, XYZW) | _named("b", b, XYZW)
    if brief:
        aside = type(sheet)(sheet.digits, clean=sheet.clean)
        x, y, z, w = (aside.step(values, f"c{name}", formula) for name, formula in HAMILTON.items())
        sheet.quaternions("q", "a b", (a, b), (x, y, z, w))
        return x, y, z, w
    sheet.say("c = a b (Hamilton: ij = k, ji = -k; not commutative)")
    x, y, z, w = (sheet.step(values, f"c{name}", formula) for name, formula in HAMILTON.items())
    sheet.caveat(ORDER)
    return x, y, z, w


def compose(sheet: Sheet, a: Rigid, b: Rigid, frames: tuple[str, str, str], *, brief: bool = False) -> Rigid:
    """Multiply two poses: `frames` are those of a_from_b and b_from_c, in this order."""
    first, middle, last = frames
    sheet.heading(f"{first}_from_{last} = {first}_from_{middle} @ {middle}_from_{last}")
    if not brief:
        sheet.say(TOUCH)
    position = moved(sheet, a, b[:3], "t", ("R(a) tb + ta", r"R(a)\,t_b + t_a"), METRES)
    return *position, *product(sheet, a[3:], b[3:], brief=brief)


def moved(
    sheet: Sheet, pose: Rigid, point: Sequence[float], name: str, formula: tuple[str, str], unit: str
) -> Vector:
    """Move a point: turn it, then shift it."""
    matrix = of_quaternion(sheet, pose[3:])
    x, y, z = (sheet.inner(row, point, shift) for row, shift in zip(matrix, pose[:3], strict=True))
    parts: Parts = [matrix, upright(point), "+", upright(pose[:3]), "=", upright((x, y, z))]
    sheet.grid(name, *formula, parts, unit)
    return x, y, z


def turned(
    sheet: Sheet, q: Quaternion, vector: Sequence[float], name: str, formula: tuple[str, str], unit: str = ""
) -> Vector:
    """Turn a vector."""
    matrix = of_quaternion(sheet, q)
    x, y, z = (sheet.inner(row, vector) for row in matrix)
    sheet.grid(name, *formula, [matrix, upright(vector), "=", upright((x, y, z))], unit)
    return x, y, z


def inverse(sheet: Sheet, pose: Rigid, target: str, source: str) -> Rigid:
    """Turn target_from_source around."""
    sheet.heading(f"{source}_from_{target} = inverse of {target}_from_{source}")
    sheet.say("The axis turns round: q* = (-x, -y, -z, w), and its matrix is R^T.")
    back = transposed(of_quaternion(sheet, pose[3:]))
    x, y, z = (0.0 - sheet.inner(row, pose[:3]) for row in back)
    parts: Parts = ["-", back, upright(pose[:3]), "=", upright((x, y, z))]
    sheet.grid("t'", "-R^T t", r"-R^{\mathsf T}\,t", parts, METRES)
    sheet.caveat(INVERSE)
    return x, y, z, *conjugate(sheet, pose[3:])


def conjugate(sheet: Sheet, q: Quaternion) -> Quaternion:
    """Turn the axis of a rotation round."""
    x, y, z, w = q
    found = (0.0 - x, 0.0 - y, 0.0 - z, w)
    sheet.say("q* = " + ", ".join(f"{name} {sheet.number(part)}" for name, part in zip(XYZW, found, strict=True)))
    return found


def relative(sheet: Sheet, a: Rigid, b: Rigid, frames: tuple[str, str, str]) -> Rigid:
    """Compare two poses: `frames` are the one both are given in, that of a and that of b."""
    world, first, second = frames
    sheet.heading(f"{first}_from_{second} = ({world}_from_{first})^-1 @ {world}_from_{second}")
    sheet.say("inverse, then compose: R^T tb + (-R^T ta) = R^T (tb - ta); subtracted first, near poses keep their "
              "digits.")  # fmt: skip
    sheet.say("d = tb - ta")
    values = _named("a", a[:3], XYZ) | _named("b", b[:3], XYZ)
    apart = [sheet.step(values, f"d{name}", f"b{name} - a{name}", METRES) for name in XYZ]
    back = transposed(of_quaternion(sheet, a[3:]))
    x, y, z = (sheet.inner(row, apart) for row in back)
    sheet.grid("t", "R(A)^T d", r"R(A)^{\mathsf T}\,d", [back, upright(apart), "=", upright((x, y, z))], METRES)
    sheet.caveat(INVERSE)
    sheet.say("a = q(A)*, b = q(B); the axis of A turns round: q* = (-x, -y, -z, w).")
    _, _, _, ax, ay, az, aw = a
    qx, qy, qz, qw = product(sheet, (0.0 - ax, 0.0 - ay, 0.0 - az, aw), b[3:])
    return x, y, z, qx, qy, qz, qw


def extent(sheet: Sheet, pose: Rigid, frame: str) -> tuple[float, float, float]:
    """Measure a transform: distance, angle in radians and in degrees."""
    sheet.heading("How far apart")
    values = _named("t", pose[:3], XYZ) | _named("", pose[3:], XYZW)
    distance, _, _ = length(sheet, values, ("tx", "ty", "tz"), "d", METRES)
    length(sheet, values, XYZ, "s")
    angle = sheet.step(values, "angle", "2*atan2(s, abs(w))", RADIANS)
    sheet.caveat(f"The distance does not depend on the frame; the position does: it is written in {frame}.")
    return distance, angle, to_degrees(sheet, values, "angle")[0]


def between(sheet: Sheet, a: Rigid, b: Rigid, fraction: float) -> Rigid:
    """Go a fraction of the way between two poses: straight line and slerp."""
    sheet.stretch = max(sheet.stretch, abs(fraction))
    position = line(sheet, a[:3], b[:3], fraction)
    return *position, *slerp(sheet, a[3:], b[3:], fraction)


def line(sheet: Sheet, a: Sequence[float], b: Sequence[float], fraction: float) -> Vector:
    """Interpolate positions along the line, from the nearer end."""
    sheet.heading("Position: along the straight line")
    values = {"f": fraction} | _named("a", a, XYZ) | _named("b", b, XYZ)
    nearer = "a{0} + f*(b{0} - a{0})" if fraction < 0.5 else "b{0} - (1 - f)*(b{0} - a{0})"
    x, y, z = (sheet.step(values, f"t{name}", nearer.format(name), METRES) for name in XYZ)
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
        for name in XYZW:
            sheet.step(values, f"n{name}", f"-b{name}")
    else:
        sheet.say("dot >= 0: the arc to b is not longer than that to -b (double cover).")
    if abs(values["dot"]) < NEARLY_ZERO:
        sheet.caveat(HALF_TURN)
    for letter, sign in (("m", "-"), ("p", "+")):
        for name in XYZW:
            sheet.step(values, f"{letter}{name}", f"{other}{name} {sign} a{name}")
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
    x, y, z, w = (sheet.step(values, f"q{name}", f"ka*a{name} + kb*{other}{name}") for name in XYZW)
    return x, y, z, w


def _named(prefix: str, numbers: Sequence[float], names: Sequence[str]) -> dict[str, float]:
    return {f"{prefix}{name}": number for name, number in zip(names, numbers, strict=True)}
