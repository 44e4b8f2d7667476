"""From each representation to the quaternion, one block a representation.

A block takes the sheet, the numbers as written, and what it names of their axes and units.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.explain.sheet import CYCLES, DEGREES, ENTRIES, RADIANS, XYZ, XYZW, norm, rows
from frametool.geometry import floats
from frametool.geometry import matrix as kernel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.sheet import Sheet, Values
    from frametool.grammar.readers import Quaternion

UNIT = 8.9e-16  # 4 eps: a length this near 1 is 1
LAST_STEP = 1e-9  # the convergence is quadratic: what comes after such a step is rounding
MOST_STEPS = 60
HALF = "Half the angle stands inside: a quaternion acts twice (q v q*), so w = cos(angle/2)."
NOT_UNIT = "The axis is not a unit vector: it is divided by its length. With a longer axis q would be no rotation."
SQUARES = (
    "ww, xx, yy, zz are four times the squares of w, x, y, z. The largest is taken: nothing is then divided by a "
    "small number (Shepperd 1978)."
)
GRAM_SCHMIDT = (
    "Gram and Schmidt: the first is made unit, the second loses what it has along the first and is made unit, the "
    "third is their vector product."
)
SHEPPERD = {"w": "1 + r11 + r22 + r33", "x": "1 + r11 - r22 - r33", "y": "1 - r11 + r22 - r33",
            "z": "1 - r11 - r22 + r33"}  # fmt: skip
PAIRS = {"xy": "r12 + r21", "xz": "r13 + r31", "yz": "r23 + r32", "xw": "r32 - r23", "yw": "r13 - r31",
         "zw": "r21 - r12"}  # fmt: skip


def quaternion(sheet: Sheet, numbers: Sequence[float]) -> Quaternion:
    """Take x, y, z, w: named or scalar last."""
    return _as_given(sheet, numbers, "x, y, z, w: the scalar w stands last.")


def wxyz(sheet: Sheet, numbers: Sequence[float]) -> Quaternion:
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
        sheet.step(values, "norm", norm())
        return _four(values, XYZW)
    sheet.direction(values, XYZW, ("qx", "qy", "qz", "qw"), "norm")
    sheet.caveat("The norm is not 1: every part is divided by it, which keeps the axis and the angle.")
    return _four(values, ("qx", "qy", "qz", "qw"))


def rpy(sheet: Sheet, numbers: Sequence[float], *, degrees: bool) -> Quaternion:
    """Multiply the turns about z, y, x, written out: six sines and cosines of half angles."""
    sheet.heading("Roll, pitch, yaw to quaternion")
    sheet.say("About the fixed axes x, then y, then z: the same as z, y', x'' turning along.")
    sheet.say("q = qz(yaw) qy(pitch) qx(roll): what is done first stands rightmost.")
    values: Values = {}
    for name, written in zip(("roll", "pitch", "yaw"), numbers, strict=True):
        sheet.take_angle(values, name, written, degrees=degrees)
    for name in ("roll", "pitch", "yaw"):
        sheet.sine_and_cosine(values, name, f"s{name[0]}", f"c{name[0]}")
    sheet.caveat(HALF)
    sheet.step(values, "x", "sr*cp*cy - cr*sp*sy")
    sheet.step(values, "y", "cr*sp*cy + sr*cp*sy")
    sheet.step(values, "z", "cr*cp*sy - sr*sp*cy")
    sheet.step(values, "w", "cr*cp*cy + sr*sp*sy")
    return _unit(sheet, values)


def euler(sheet: Sheet, numbers: Sequence[float], *, axes: str, degrees: bool) -> Quaternion:
    """Multiply three elementary quaternions: two products."""
    values: Values = {}
    sheet.heading(f"Euler angles {axes} to quaternion")
    order, fixed = axes[1:], axes[0] == "s"
    kind = "the fixed axes" if fixed else "the axes as they turn along,"
    way = "right to left: what is done first stands rightmost" if fixed else "left to right, in the order of the turns"
    sheet.say(f"{axes}: a1, a2, a3 about {kind} {', then '.join(order)}. The factors stand {way}.")
    for at, written in enumerate(numbers, 1):
        sheet.take_angle(values, f"a{at}", written, degrees=degrees)
    outermost = (3, 2, 1) if fixed else (1, 2, 3)
    sheet.say(f"q = {' '.join(f'q{axes[at]}(a{at})' for at in outermost)}")
    for at in (1, 2, 3):
        sheet.sine_and_cosine(values, f"a{at}", f"s{at}", f"c{at}")
    sheet.caveat(HALF)
    first, second, third = outermost
    sheet.say(f"p = q{axes[first]} q{axes[second]}, then q = p q{axes[third]}; only these parts are not 0:")
    p = {"w": f"c{first}", axes[first]: f"s{first}"}
    for name, formula in _times_elementary(p, axes[second], second).items():
        sheet.step(values, f"p{name}", formula)
    for name, formula in _times_elementary({part: f"p{part}" for part in XYZW}, axes[third], third).items():
        sheet.step(values, name, formula)
    other = "turning axes read left to right" if fixed else "fixed axes read right to left"
    sheet.caveat(f"The same product about {other}: s and r differ only in the order of the factors.")
    return _unit(sheet, values)


def _times_elementary(p: dict[str, str], axis: str, number: int) -> dict[str, str]:
    """Return the formulas of p times the quaternion (s along an axis, c): parts of p that are 0 are left out."""
    _, after, last = CYCLES["xyz".index(axis)]
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


def axis_angle(sheet: Sheet, numbers: Sequence[float], *, degrees: bool) -> Quaternion:
    """Take the axis' direction and half the angle."""
    sheet.heading("Axis and angle to quaternion")
    sheet.say("q = (v sin(angle/2), cos(angle/2)), v a unit axis.")
    values = dict(zip(("ax", "ay", "az"), numbers, strict=False))
    length = sheet.direction(values, ("ax", "ay", "az"), ("vx", "vy", "vz"), "n")
    if abs(length - 1.0) > UNIT:
        sheet.caveat(NOT_UNIT)
    sheet.take_angle(values, "angle", numbers[3], degrees=degrees)
    return _about_axis(sheet, values)


def _about_axis(sheet: Sheet, values: Values) -> Quaternion:
    """Add the quaternion of the unit axis vx, vy, vz and `angle`."""
    sheet.sine_and_cosine(values, "angle", "s", "w")
    sheet.each(values, XYZ, "%", "v%*s")
    sheet.caveat(HALF)
    return _unit(sheet, values)


def rotvec(sheet: Sheet, numbers: Sequence[float], *, degrees: bool) -> Quaternion:
    """Take the length for the angle and the direction for the axis."""
    unit = "_deg" if degrees else ""
    names = tuple(f"r{name}{unit}" for name in XYZ)
    values = dict(zip(names, numbers, strict=True))
    sheet.heading("Rotation vector to quaternion")
    sheet.say("Its length is the angle, its direction the axis.")
    if not any(numbers):
        sheet.say("The vector is 0: no rotation, x 0, y 0, z 0, w 1, and no axis.")
        return 0.0, 0.0, 0.0, 1.0
    length = sheet.direction(values, names, ("vx", "vy", "vz"), f"angle{unit}",
                       DEGREES if degrees else RADIANS)  # fmt: skip
    sheet.take_angle(values, "angle", length, degrees=degrees)
    return _about_axis(sheet, values)


def matrix(sheet: Sheet, numbers: Sequence[float]) -> Quaternion:
    """Take the largest of the four squares (Shepperd 1978)."""
    return _shepperd(sheet, nearest_rotation(sheet, numbers))


def _shepperd(sheet: Sheet, entries: Sequence[float]) -> Quaternion:
    values = dict(zip(ENTRIES, entries, strict=True))
    sheet.heading("Matrix to quaternion")
    sheet.say(SQUARES)
    squares = {name: sheet.step(values, name * 2, formula) for name, formula in SHEPPERD.items()}
    large = max(squares, key=squares.__getitem__)
    sheet.step(values, large, f"sqrt({large * 2})/2")
    for name in XYZW:
        if name != large:
            pair = PAIRS.get(name + large) or PAIRS[large + name]
            sheet.step(values, name, f"({pair})/(4*{large})")
    return _unit(sheet, values)


def six_d(sheet: Sheet, numbers: Sequence[float]) -> Quaternion:
    """Orthonormalise two columns by Gram and Schmidt, add the third, go on as with a matrix."""
    values = dict(zip(("ax", "ay", "az", "bx", "by", "bz"), numbers, strict=True))
    sheet.heading("Two columns to a matrix")
    sheet.say(GRAM_SCHMIDT)
    sheet.direction(values, ("ax", "ay", "az"), ("ux", "uy", "uz"), "n")
    sheet.step(values, "d", "ux*bx + uy*by + uz*bz")
    sheet.each(values, XYZ, "e%", "b% - d*u%")
    sheet.direction(values, ("ex", "ey", "ez"), ("vx", "vy", "vz"), "l")
    if sheet.step(values, "f", "ux*vx + uy*vy + uz*vz"):
        sheet.say("The columns are nearly parallel; what is left along the first is taken out again.")
        sheet.each(values, XYZ, "g%", "v% - f*u%")
    second = "g" if "gx" in values else "v"
    for name, a, b in CYCLES:
        sheet.step(values, f"w{name}", f"u{a}*{second}{b} - u{b}*{second}{a}")
    columns = [[values[f"{letter}{name}"] for name in XYZ] for letter in ("u", second, "w")]
    sheet.grid("R", "(u v w)", r"(u\ v\ w)", [[list(row) for row in zip(*columns, strict=True)]])
    return _shepperd(sheet, [part for row in zip(*columns, strict=True) for part in row])


def mrp(sheet: Sheet, numbers: Sequence[float]) -> Quaternion:
    """Undo the projection: 2 p/(1 + |p|^2)."""
    values = dict(zip(("px", "py", "pz"), numbers, strict=True))
    sheet.heading("Modified Rodrigues parameters to quaternion")
    sheet.say("p = v tan(angle/4), v a unit axis; so |p| = 1 is half a turn.")
    sheet.step(values, "pp", "px**2 + py**2 + pz**2")
    sheet.each(values, XYZ, "%", "2*p%/(1 + pp)")
    sheet.step(values, "w", "(1 - pp)/(1 + pp)")
    return _unit(sheet, values)


def _unit(sheet: Sheet, values: Values) -> Quaternion:
    """Check that a quaternion is unit, and return it."""
    sheet.step(values, "norm", norm())
    return _four(values, XYZW)


def _four(values: Values, names: Sequence[str]) -> Quaternion:
    x, y, z, w = (values[name] for name in names)
    return x, y, z, w


def nearest_rotation(sheet: Sheet, entries: Sequence[float]) -> Sequence[float]:
    """Return the rotation nearest to a matrix, with the steps to it; what is one already stays as it is."""
    off = kernel.defect(*kernel.nine(entries), floats)
    if off <= kernel.ORTHONORMAL:
        return entries
    sheet.heading("The nearest rotation")
    sheet.say(f"The rows are orthonormal only to {off:.1e}. Newton's way to the nearest rotation (Higham 1986): the "
              "mean of M and of its inverse transposed, again and again; each step doubles the right digits.")
    here = rows(entries)
    for count in range(1, MOST_STEPS + 1):
        there = rows(kernel.newton(*kernel.nine(part for row in here for part in row)))
        other = [[2.0 * b - a for a, b in zip(*pair, strict=True)] for pair in zip(here, there, strict=True)]
        name, latex = f"M{count - 1 or ''}", r"\tfrac{1}{2}\left(M + M^{-\mathsf{T}}\right)"
        sheet.grid(f"M{count}", f"1/2 ({name} + {name}^-T)", latex, ["1/2·(", here, "+", other, ")", "=", there])
        step = max(abs(a - b) for pair in zip(here, there, strict=True) for a, b in zip(*pair, strict=True))
        here = there
        if step < LAST_STEP:
            break
    return [part for row in here for part in row]
