"""From each representation to the quaternion: one block a representation, and the table of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, shown
from frametool.explain.sheet import RADIANS
from frametool.explain.steps import HALF, UNIT, angle, direction, nearest_rotation, norm, sine_and_cosine

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.explain.sheet import Sheet, Values
    from frametool.geometry.representations import Notation
    from frametool.grammar.readers import Quaternion

    Block = Callable[..., Quaternion]  # (sheet, numbers as written, axes, degrees)

XYZ, XYZW = ("x", "y", "z"), ("x", "y", "z", "w")
NOT_UNIT = "The axis is not a unit vector: it is divided by its length. With a longer axis q would be no rotation."
SQUARES = (
    "ww, xx, yy, zz are four times the squares of w, x, y, z. The largest is taken: nothing is then divided by a "
    "small number (Shepperd 1978)."
)
GRAM_SCHMIDT = (
    "Gram and Schmidt: the first is made unit, the second loses what it has along the first and is made unit, the "
    "third is their vector product."
)
ENTRIES = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))
SHEPPERD = {"w": "1 + r11 + r22 + r33", "x": "1 + r11 - r22 - r33", "y": "1 - r11 + r22 - r33",
            "z": "1 - r11 - r22 + r33"}  # fmt: skip
PAIRS = {"xy": "r12 + r21", "xz": "r13 + r31", "yz": "r23 + r32", "xw": "r32 - r23", "yw": "r13 - r31",
         "zw": "r21 - r12"}  # fmt: skip


def quaternion(sheet: Sheet, numbers: Sequence[float], _axes: str, _degrees: bool) -> Quaternion:  # noqa: FBT001
    """Take x, y, z, w: named or scalar last."""
    return _as_given(sheet, numbers, "x, y, z, w: the scalar w stands last.")


def wxyz(sheet: Sheet, numbers: Sequence[float], _axes: str, _degrees: bool) -> Quaternion:  # noqa: FBT001
    """Take w, x, y, z."""
    w, *vector = numbers
    return _as_given(sheet, (*vector, w), "w, x, y, z: the scalar w stands first.")


def _as_given(sheet: Sheet, numbers: Sequence[float], order: str) -> Quaternion:
    """Take a quaternion, normalised unless it is unit to 4 eps."""
    values = dict(zip(XYZW, numbers, strict=True))
    sheet.heading("The quaternion as given")
    sheet.say(order)
    sheet.say(", ".join(f"{name} {sheet.number(value)}" for name, value in values.items()))
    if abs(sum(part * part for part in numbers) - 1.0) <= UNIT:
        sheet.step(values, "norm", norm(XYZW))
        return _four(values, XYZW)
    direction(sheet, values, XYZW, ("qx", "qy", "qz", "qw"), "norm")
    sheet.caveat("The norm is not 1: every part is divided by it, which keeps the axis and the angle.")
    return _four(values, ("qx", "qy", "qz", "qw"))


def rpy(sheet: Sheet, numbers: Sequence[float], _axes: str, degrees: bool) -> Quaternion:  # noqa: FBT001
    """Multiply the turns about z, y, x, written out: six sines and cosines of half angles."""
    values: Values = {}
    sheet.heading("Roll, pitch, yaw to quaternion")
    sheet.say("About the fixed axes x, then y, then z: the same as z, y', x'' turning along.")
    sheet.say("q = qz(yaw) qy(pitch) qx(roll): what is done first stands rightmost.")
    for name, given in zip(("roll", "pitch", "yaw"), numbers, strict=True):
        angle(sheet, values, name, given, degrees=degrees)
    for name in ("roll", "pitch", "yaw"):
        sine_and_cosine(sheet, values, name, f"s{name[0]}", f"c{name[0]}")
    sheet.caveat(HALF)
    sheet.step(values, "x", "sr*cp*cy - cr*sp*sy")
    sheet.step(values, "y", "cr*sp*cy + sr*cp*sy")
    sheet.step(values, "z", "cr*cp*sy - sr*sp*cy")
    sheet.step(values, "w", "cr*cp*cy + sr*sp*sy")
    return _unit(sheet, values)


def euler(sheet: Sheet, numbers: Sequence[float], axes: str, degrees: bool) -> Quaternion:  # noqa: FBT001
    """Multiply three elementary quaternions: two products."""
    values: Values = {}
    order, fixed = axes[1:], axes[0] == "s"
    sheet.heading(f"Euler angles {axes} to quaternion")
    outermost = introduce(sheet, values, numbers, axes, degrees=degrees)
    sheet.say(f"q = {' '.join(f'q{order[at]}(a{at + 1})' for at in outermost)}")
    for at in range(3):
        sine_and_cosine(sheet, values, f"a{at + 1}", f"s{at + 1}", f"c{at + 1}")
    sheet.caveat(HALF)
    first, second, third = outermost
    p = {"w": f"c{first + 1}", order[first]: f"s{first + 1}"}
    sheet.say(f"p = q{order[first]} q{order[second]}, then q = p q{order[third]}; only these parts are not 0:")
    for name, formula in _times_elementary(p, order[second], second + 1).items():
        sheet.step(values, f"p{name}", formula)
    for name, formula in _times_elementary({part: f"p{part}" for part in XYZW}, order[third], third + 1).items():
        sheet.step(values, name, formula)
    sheet.caveat(_about_order(fixed=fixed))
    return _unit(sheet, values)


def introduce(sheet: Sheet, values: Values, numbers: Sequence[float], axes: str, *, degrees: bool) -> tuple[int, ...]:
    """Say what three Euler angles mean and take them; return the places of the factors, outermost first."""
    order, fixed = axes[1:], axes[0] == "s"
    kind = "the fixed axes" if fixed else "the axes as they turn along,"
    way = "right to left: what is done first stands rightmost" if fixed else "left to right, in the order of the turns"
    sheet.say(f"{axes}: a1, a2, a3 about {kind} {', then '.join(order)}. The factors stand {way}.")
    for at, given in enumerate(numbers):
        angle(sheet, values, f"a{at + 1}", given, degrees=degrees)
    return (2, 1, 0) if fixed else (0, 1, 2)


def _about_order(*, fixed: bool) -> str:
    other = "turning axes read left to right" if fixed else "fixed axes read right to left"
    return f"The same product about {other}: s and r differ only in the order of the factors."


def _times_elementary(p: dict[str, str], axis: str, number: int) -> dict[str, str]:
    """Return the formulas of p times the quaternion (s along an axis, c): parts of p that are 0 are left out."""
    after, last = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}[axis]
    sine, cosine = f"s{number}", f"c{number}"
    terms = {
        axis: ((axis, cosine, "+"), ("w", sine, "+")),
        after: ((after, cosine, "+"), (last, sine, "+")),
        last: ((last, cosine, "+"), (after, sine, "-")),
        "w": (("w", cosine, "+"), (axis, sine, "-")),
    }
    formulas = {}
    for name in XYZW:
        text = "".join(f" {sign} {p[part]}*{factor}" for part, factor, sign in terms[name] if part in p)
        formulas[name] = text[3:] if text.startswith(" +") else f"-{text[3:]}"
    return formulas


def axis_angle(sheet: Sheet, numbers: Sequence[float], _axes: str, degrees: bool) -> Quaternion:  # noqa: FBT001
    """Take the axis' direction and half the angle."""
    values = dict(zip(("ax", "ay", "az"), numbers, strict=False))
    sheet.heading("Axis and angle to quaternion")
    sheet.say("q = (v sin(angle/2), cos(angle/2)), v a unit axis.")
    unit_axis(sheet, values)
    angle(sheet, values, "angle", numbers[3], degrees=degrees)
    return _about_axis(sheet, values)


def unit_axis(sheet: Sheet, values: Values) -> None:
    """Add the unit axis vx, vy, vz of ax, ay, az."""
    length = direction(sheet, values, ("ax", "ay", "az"), ("vx", "vy", "vz"), "n")
    if abs(length - 1.0) > UNIT:
        sheet.caveat(NOT_UNIT)


def _about_axis(sheet: Sheet, values: Values) -> Quaternion:
    """Add the quaternion of the unit axis vx, vy, vz and `angle`."""
    sine_and_cosine(sheet, values, "angle", "s", "w")
    for name in XYZ:
        sheet.step(values, name, f"v{name}*s")
    sheet.caveat(HALF)
    return _unit(sheet, values)


def rotvec(sheet: Sheet, numbers: Sequence[float], _axes: str, degrees: bool) -> Quaternion:  # noqa: FBT001
    """Take the length for the angle and the direction for the axis."""
    unit = "_deg" if degrees else ""
    names = tuple(f"r{name}{unit}" for name in XYZ)
    values = dict(zip(names, numbers, strict=True))
    sheet.heading("Rotation vector to quaternion")
    sheet.say("Its length is the angle, its direction the axis.")
    if not any(numbers):
        sheet.say("The vector is 0: no rotation, x 0, y 0, z 0, w 1, and no axis.")
        return 0.0, 0.0, 0.0, 1.0
    length = direction(sheet, values, names, ("vx", "vy", "vz"), f"angle{unit}", "deg" if degrees else RADIANS)
    angle(sheet, values, "angle", length, degrees=degrees)
    return _about_axis(sheet, values)


def matrix(sheet: Sheet, numbers: Sequence[float], _axes: str, _degrees: bool) -> Quaternion:  # noqa: FBT001
    """Take the largest of the four squares (Shepperd 1978)."""
    values = dict(zip(ENTRIES, nearest_rotation(sheet, numbers), strict=True))
    sheet.heading("Matrix to quaternion")
    return _shepperd(sheet, values)


def _shepperd(sheet: Sheet, values: Values) -> Quaternion:
    sheet.say(SQUARES)
    squares = {name: sheet.step(values, name * 2, formula) for name, formula in SHEPPERD.items()}
    large = max(squares, key=squares.__getitem__)
    sheet.step(values, large, f"sqrt({large * 2})/2")
    for name in XYZW:
        if name != large:
            pair = PAIRS.get(name + large) or PAIRS[large + name]
            sheet.step(values, name, f"({pair})/(4*{large})")
    return _unit(sheet, values)


def six_d(sheet: Sheet, numbers: Sequence[float], _axes: str, _degrees: bool) -> Quaternion:  # noqa: FBT001
    """Orthonormalise two columns by Gram and Schmidt, add the third, go on as with a matrix."""
    values = dict(zip(("ax", "ay", "az", "bx", "by", "bz"), numbers, strict=True))
    sheet.heading("Two columns to a matrix")
    sheet.say(GRAM_SCHMIDT)
    direction(sheet, values, ("ax", "ay", "az"), ("ux", "uy", "uz"), "n")
    sheet.step(values, "d", "ux*bx + uy*by + uz*bz")
    for name in XYZ:
        sheet.step(values, f"e{name}", f"b{name} - d*u{name}")
    direction(sheet, values, ("ex", "ey", "ez"), ("vx", "vy", "vz"), "l")
    if sheet.step(values, "f", "ux*vx + uy*vy + uz*vz"):
        sheet.say("The columns are nearly parallel; what is left along the first is taken out again.")
        for name in XYZ:
            sheet.step(values, f"g{name}", f"v{name} - f*u{name}")
    second = "g" if "gx" in values else "v"
    for name, a, b in (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y")):
        sheet.step(values, f"w{name}", f"u{a}*{second}{b} - u{b}*{second}{a}")
    columns = [[values[f"{letter}{name}"] for name in XYZ] for letter in ("u", second, "w")]
    sheet.grid("R", "(u v w)", r"(u\ v\ w)", [[list(row) for row in zip(*columns, strict=True)]])
    sheet.heading("Matrix to quaternion")
    entries = [part for row in zip(*columns, strict=True) for part in row]
    return _shepperd(sheet, dict(zip(ENTRIES, entries, strict=True)))


def mrp(sheet: Sheet, numbers: Sequence[float], _axes: str, _degrees: bool) -> Quaternion:  # noqa: FBT001
    """Undo the projection: 2 p/(1 + |p|^2)."""
    values = dict(zip(("px", "py", "pz"), numbers, strict=True))
    sheet.heading("Modified Rodrigues parameters to quaternion")
    sheet.say("p = v tan(angle/4), v a unit axis; so |p| = 1 is half a turn.")
    sheet.step(values, "pp", "px**2 + py**2 + pz**2")
    for name in XYZ:
        sheet.step(values, name, f"2*p{name}/(1 + pp)")
    sheet.step(values, "w", "(1 - pp)/(1 + pp)")
    return _unit(sheet, values)


def _unit(sheet: Sheet, values: Values) -> Quaternion:
    """Check that a quaternion is unit, and return it."""
    sheet.step(values, "norm", norm(XYZW))
    return _four(values, XYZW)


def _four(values: Values, names: Sequence[str]) -> Quaternion:
    x, y, z, w = (values[name] for name in names)
    return x, y, z, w


TO_QUATERNION: dict[str, Block] = {
    "quaternion": quaternion,
    "xyzw": quaternion,
    "wxyz": wxyz,
    "rpy": rpy,
    "euler": euler,
    "axis_angle": axis_angle,
    "rotvec": rotvec,
    "matrix": matrix,
    "mrp": mrp,
    "six_d": six_d,
}


def block_of(table: Mapping[str, Callable[..., Any]], form: Notation) -> Callable[..., Any]:
    """Return the block of a notation; raises ValueInvalid for a representation without one."""
    name = form.representation.name
    if name not in table:
        raise ValueInvalid(f"there is no derivation of {shown(name)}; derived are {', '.join(table)}")
    return table[name]
