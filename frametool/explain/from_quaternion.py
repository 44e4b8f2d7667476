"""From the quaternion to each representation: one block a representation, and the table of the blocks of both ways.

A block takes the sheet, the quaternion, and what it names of `axes`, `degrees` and `keep_sign`.
"""

from __future__ import annotations

from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid, shown
from frametool.explain import to_quaternion
from frametool.explain.sheet import COLUMNS, DEGREES, DET, ENTRIES, RADIANS, XYZ, XYZW, rows
from frametool.geometry import euler as kernel
from frametool.geometry import floats

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.explain.sheet import Sheet, Values
    from frametool.geometry.representations import Notation
    from frametool.grammar.readers import Quaternion

NEAR_LOCK = 1e-3  # of h: below, the entries of the matrix lose more digits than the derivation may be off
ENTRY = dict(zip(ENTRIES, (
    "1 - 2*(y**2 + z**2)", "2*(x*y - z*w)", "2*(x*z + y*w)",
    "2*(x*y + z*w)", "1 - 2*(x**2 + z**2)", "2*(y*z - x*w)",
    "2*(x*z - y*w)", "2*(y*z + x*w)", "1 - 2*(x**2 + y**2)",
), strict=True))  # fmt: skip
COVER = "Double cover: q and -q are one rotation. The sign with w >= 0 is taken (w = 0: first of x, y, z positive)."
LOCK = "Gimbal lock: the first and the third axis coincide; only one sum of their angles is known, not each."
NOT_ASIN = "pitch = atan2(-r31, h), not asin(-r31): asin loses half the digits near +-90 deg."
NOT_ACOS = "2 atan2(s, w), not 2 acos(w): acos loses half the digits near no rotation."


def quaternion(sheet: Sheet, q: Quaternion, *, keep_sign: bool) -> Sequence[float]:
    """Choose the sign; the order is x, y, z, w."""
    return q if keep_sign else canonical(sheet, q, heading="The quaternion with w >= 0")


def wxyz(sheet: Sheet, q: Quaternion, *, keep_sign: bool) -> Sequence[float]:
    """Choose the sign and put the scalar first."""
    sheet.heading("The quaternion as w, x, y, z")
    sheet.say("The scalar stands first; other libraries put it last, and four numbers do not say which.")
    x, y, z, w = q if keep_sign else canonical(sheet, q)
    sheet.say(f"w {sheet.number(w)}, x {sheet.number(x)}, y {sheet.number(y)}, z {sheet.number(z)}")
    return w, x, y, z


def canonical(sheet: Sheet, q: Quaternion, *, first: float | None = None, heading: str = "") -> Quaternion:
    """Return q or -q, with steps if the sign is turned; `first` decides it, else w or the first that is not 0."""
    x, y, z, w = q
    if (w or x or y or z if first is None else first) >= 0.0:
        return q
    if heading:
        sheet.heading(heading)
    x, y, z, w = sheet.each(dict(zip(XYZW, q, strict=True)), XYZW, "q%", "-%")
    sheet.caveat(COVER)
    return x, y, z, w


def matrix(sheet: Sheet, q: Quaternion) -> Sequence[float]:
    """Work out the nine entries, and check the determinant."""
    values = dict(zip(XYZW, q, strict=True))
    sheet.heading("Quaternion to matrix")
    found = [sheet.step(values, name, formula) for name, formula in ENTRY.items()]
    sheet.grid("R", "", "", [rows(found)])
    sheet.caveat(COLUMNS)
    sheet.step(values, "det", DET)
    return found


def rpy(sheet: Sheet, q: Quaternion, *, degrees: bool) -> Sequence[float]:
    """Read the angles off five entries of the matrix; near lock off half their sum and difference."""
    values, names = dict(zip(XYZW, q, strict=True)), ("roll", "pitch", "yaw")
    aside, inner = sheet.aside(), dict(values)
    for name in ("r11", "r21"):
        aside.step(inner, name, ENTRY[name])
    sheet.heading("Quaternion to roll, pitch, yaw")
    if aside.step(inner, "h", "sqrt(r11**2 + r21**2)") < NEAR_LOCK:
        sheet.say("pitch is so near +-90 deg that the entries of the matrix lose digits. Instead:")
        return _by_halves(sheet, values, "sxyz", names, degrees=degrees)
    for name in ("r11", "r21", "r31", "r32", "r33"):
        sheet.step(values, name, ENTRY[name])
    sheet.step(values, "h", "sqrt(r11**2 + r21**2)")
    sheet.step(values, "roll", "atan2(r32, r33)", RADIANS)
    sheet.step(values, "pitch", "atan2(-r31, h)", RADIANS)
    sheet.step(values, "yaw", "atan2(r21, r11)", RADIANS)
    sheet.caveat(NOT_ASIN)
    return sheet.angles(values, names, degrees=degrees)


def euler(sheet: Sheet, q: Quaternion, *, axes: str, degrees: bool) -> Sequence[float]:
    """Take half the sum and half the difference of the outer angles as directions (Bernardes & Viollet 2022)."""
    values = dict(zip(XYZW, q, strict=True))
    sheet.heading(f"Quaternion to Euler angles {axes}")
    fixed = "the fixed axes" if axes[0] == "s" else "the axes as they turn along,"
    sheet.say(f"{axes}: a1, a2, a3 about {fixed} {', then '.join(axes[1:])}.")
    return _by_halves(sheet, values, axes, ("a1", "a2", "a3"), degrees=degrees)


def _by_halves(
    sheet: Sheet, values: Values, axes: str, names: tuple[str, str, str], *, degrees: bool
) -> Sequence[float]:
    """Add the three angles of a convention."""
    i, j, k, parity, symmetric, static = kernel.AXES[axes]
    vi, vj, vk = "xyz"[i], "xyz"[j], "xyz"[k]
    plus, minus = ("+", "-") if parity > 0.0 else ("-", "+")
    first, middle, third = names
    sheet.say(f"(a, b) points along half the sum of {first} and {third}, (c, d) along half their difference.")
    if symmetric:
        formulas = {"a": "w", "b": vi, "c": vj, "d": vk if parity > 0.0 else f"-{vk}"}
    else:
        formulas = {"a": f"w {plus} {vj}", "b": f"{vi} + {vk}", "c": f"w {minus} {vj}", "d": f"{vi} - {vk}"}
    for name, formula in formulas.items():
        sheet.step(values, name, formula)
    if symmetric:
        sheet.step(values, "k", "sqrt(c**2 + d**2)")
        sheet.step(values, "h", "sqrt(a**2 + b**2)")
        sheet.step(values, middle, "2*atan2(k, h)", RADIANS)
    else:
        sheet.step(values, "h", "sqrt((a**2 + b**2)*(c**2 + d**2))")
        sheet.step(values, "k", f"2*(w*{vj} {plus} {vi}*{vk})")
        sheet.step(values, middle, "atan2(k, h)", RADIANS)
    a, b, c, d, x, y, z, w = (values[name] for name in ("a", "b", "c", "d", *XYZW))
    if kernel.locked(x, y, z, w, axes):  # the third angle is 0, the first twice that of the pair that is left
        by_difference = "atan2(-2*c*d, c**2 - d**2)" if static else "atan2(2*c*d, c**2 - d**2)"
        by_sum = a * a + b * b > c * c + d * d
        sheet.step(values, first, "atan2(2*a*b, a**2 - b**2)" if by_sum else by_difference, RADIANS)
        sheet.chosen(values, third, 0.0, RADIANS)
        sheet.caveat(LOCK)
    else:
        sums, differences = ("b*c + a*d", "a*c - b*d"), ("b*c - a*d", "a*c + b*d")
        for number, (name, (rise, run)) in enumerate(
            zip((first, third), (differences, sums) if static else (sums, differences), strict=True), 1
        ):
            sheet.step(values, f"y{number}", rise)
            sheet.step(values, f"x{number}", run)
            sheet.step(values, name, f"atan2(y{number}, x{number})", RADIANS)
        level = floats.sqrt((a * a + b * b) * (c * c + d * d))
        if 0.0 < level < NEAR_LOCK:
            sheet.caveat(
                f"Beside lock: {first} and {third} each are known only to about {4e-16 / level:.0e} rad, and by so "
                "much the result may differ; one sum of them is known to all digits."
            )
    return sheet.angles(values, names, degrees=degrees)


def axis_angle(sheet: Sheet, q: Quaternion, *, degrees: bool) -> Sequence[float]:
    """Divide the vector by its length; the angle from both."""
    sheet.heading("Quaternion to axis and angle")
    values = dict(zip(XYZW, canonical(sheet, q), strict=True))
    if not _axis(sheet, values):
        sheet.say("No rotation: the angle is 0, any axis will do, and x is taken.")
        return 1.0, 0.0, 0.0, 0.0
    return values["vx"], values["vy"], values["vz"], *sheet.angles(values, ["angle"], degrees=degrees)


def _axis(sheet: Sheet, values: Values) -> bool:
    """Add s, the angle and the unit axis; return whether there is one."""
    if not any(values[name] for name in XYZ):
        return False
    sheet.direction(values, XYZ, ("vx", "vy", "vz"), "s")
    sheet.step(values, "angle", "2*atan2(s, w)", RADIANS)
    sheet.caveat(NOT_ACOS)
    return True


def rotvec(sheet: Sheet, q: Quaternion, *, degrees: bool) -> Sequence[float]:
    """Multiply the axis with the angle."""
    sheet.heading("Quaternion to rotation vector")
    values = dict(zip(XYZW, canonical(sheet, q, first=q[3]), strict=True))
    if not _axis(sheet, values):
        sheet.say("No rotation: the vector is 0.")
        return 0.0, 0.0, 0.0
    sheet.angles(values, ["angle"], degrees=degrees)
    suffix, unit = ("_deg", DEGREES) if degrees else ("", RADIANS)
    return sheet.each(values, XYZ, f"r%{suffix}", f"v%*angle{suffix}", unit)


def mrp(sheet: Sheet, q: Quaternion) -> Sequence[float]:
    """Project the sphere: v/(1 + w)."""
    sheet.heading("Quaternion to modified Rodrigues parameters")
    sheet.say("p = v tan(angle/4): with w >= 0 the shorter turn, and |p| at most 1.")
    values = dict(zip(XYZW, canonical(sheet, q), strict=True))
    return sheet.each(values, XYZ, "p%", "%/(1 + w)")


def six_d(sheet: Sheet, q: Quaternion) -> Sequence[float]:
    """Work out the first two columns of the matrix."""
    values = dict(zip(XYZW, q, strict=True))
    sheet.heading("Quaternion to two columns")
    found = [sheet.step(values, name, ENTRY[name]) for name in ("r11", "r21", "r31", "r12", "r22", "r32")]
    sheet.say("The first column, then the second; the third is their vector product.")
    return found


def from_unreal(sheet: Sheet, numbers: Sequence[float], *, degrees: bool) -> Quaternion:
    """Go as from rpy, then negate x and y."""
    return _mirrored(sheet, to_quaternion.rpy(sheet, numbers, degrees=degrees))


def rpy_unreal(sheet: Sheet, q: Quaternion, *, degrees: bool) -> Sequence[float]:
    """Negate x and y, then go as to rpy."""
    return rpy(sheet, _mirrored(sheet, q), degrees=degrees)


def _mirrored(sheet: Sheet, q: Quaternion) -> Quaternion:
    """Turn about x and y the other way."""
    sheet.heading("The signs of Unreal's rotator")
    sheet.say("Unreal turns about x and y the other way than rpy (FRotator::Quaternion); z and w stay.")
    x, y = sheet.each(dict(zip(XYZW, q, strict=True)), XYZW[:2], "q%", "-%")
    return x, y, q[2], q[3]


def from_unity(sheet: Sheet, numbers: Sequence[float], *, degrees: bool) -> Quaternion:
    """Go as from the Euler angles z, x, y."""
    return to_quaternion.euler(sheet, (*numbers[2:], *numbers[:2]), axes="szxy", degrees=degrees)


def euler_unity(sheet: Sheet, q: Quaternion, *, degrees: bool) -> Sequence[float]:
    """Go as to the Euler angles z, x, y."""
    z, x, y = euler(sheet, q, axes="szxy", degrees=degrees)
    sheet.say(f"In Unity's order: x {sheet.number(x)}, y {sheet.number(y)}, z {sheet.number(z)}")
    return x, y, z


class Blocks(NamedTuple):
    """The ways of a representation: from its numbers to the quaternion, and back."""

    to_quaternion: Callable[..., Quaternion]
    from_quaternion: Callable[..., Sequence[float]]


BLOCKS = {
    "quaternion": Blocks(to_quaternion.quaternion, quaternion),
    "xyzw": Blocks(to_quaternion.quaternion, quaternion),
    "wxyz": Blocks(to_quaternion.wxyz, wxyz),
    "rpy": Blocks(to_quaternion.rpy, rpy),
    "euler": Blocks(to_quaternion.euler, euler),
    "axis_angle": Blocks(to_quaternion.axis_angle, axis_angle),
    "rotvec": Blocks(to_quaternion.rotvec, rotvec),
    "matrix": Blocks(to_quaternion.matrix, matrix),
    "mrp": Blocks(to_quaternion.mrp, mrp),
    "six_d": Blocks(to_quaternion.six_d, six_d),
    "rpy_unreal": Blocks(from_unreal, rpy_unreal),
    "euler_unity": Blocks(from_unity, euler_unity),
}


def blocks_of(form: Notation) -> Blocks:
    """Return the blocks of a notation; raises ValueInvalid for a representation without them."""
    name = form.representation.name
    if name not in BLOCKS:
        raise ValueInvalid(f"there is no derivation of {shown(name)}; derived are {', '.join(BLOCKS)}")
    return BLOCKS[name]


def run(block: Callable[..., Any], sheet: Sheet, numbers: Sequence[float], form: Notation, **how: bool) -> Any:
    """Run a block with what it names of the axes and units of a notation."""
    known = {"axes": form.bound_axes(), **how}
    return block(sheet, numbers, **{name: known[name] for name in signature(block).parameters if name in known})
