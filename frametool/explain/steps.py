"""Steps that several blocks share: angles and their sines, lengths and directions, matrices."""

from __future__ import annotations

import math
from inspect import signature
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, shown
from frametool.explain.formula_tree import Value
from frametool.explain.sheet import DEGREES, RADIANS
from frametool.geometry import floats
from frametool.geometry import matrix as kernel
from frametool.geometry.quaternion import to_matrix

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.explain.sheet import Matrix, Sheet, Values
    from frametool.geometry.representations import Notation
    from frametool.grammar.readers import Quaternion

XYZ, XYZW = ("x", "y", "z"), ("x", "y", "z", "w")
CYCLES = (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y"))
ENTRIES = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))
DET = "r11*(r22*r33 - r23*r32) + r12*(r23*r31 - r21*r33) + r13*(r21*r32 - r22*r31)"
COLUMNS = "Column k is axis k of the source frame, written in the target frame."
TINY, HUGE = 1e-140, 1e140  # beyond, squares leave the range of a double
TWO_TURNS = 720.0  # degrees: the half angle inside has turned once
UNIT = 8.9e-16  # 4 eps: a length this near 1 is 1
LAST_STEP = 1e-9  # the convergence is quadratic: what comes after such a step is rounding
MOST_STEPS = 60
ROOTS = ("sqrt(0)/2", "sqrt(2)/2", "sqrt(4)/2", "sqrt(2)/2", "sqrt(0)/2", "-sqrt(2)/2", "-sqrt(4)/2", "-sqrt(2)/2")
EXACT = "Multiples of 90 deg are exact: no rounded pi comes into their sines and cosines."
HALF = "Half the angle stands inside: a quaternion acts twice (q v q*), so w = cos(angle/2)."


def run_block(
    table: Mapping[str, Callable[..., Any]], form: Notation, sheet: Sheet, numbers: Sequence[float], **how: Any
) -> Any:  # fmt: skip
    """Run the block of a notation; raises ValueInvalid for a representation without one."""
    name = form.representation.name
    if name not in table:
        raise ValueInvalid(f"there is no derivation of {shown(name)}; derived are {', '.join(table)}")
    return run(table[name], sheet, numbers, axes=form.bound_axes(), **how)


def run(block: Callable[..., Any], sheet: Sheet, numbers: Sequence[float], **how: Any) -> Any:
    """Run a block with what it names of axes and units."""
    names = signature(block).parameters
    return block(sheet, numbers, **{name: value for name, value in how.items() if name in names})


def take_angle(sheet: Sheet, values: Values, name: str, written: float, *, degrees: bool) -> None:
    """Take an angle as it is written; one in degrees becomes radians."""
    if not degrees:
        values[name] = written
        return
    values[f"{name}_deg"] = rest = math.fmod(written, TWO_TURNS)
    if rest != written:
        sheet.say(f"{name}: {written!r} deg less whole double turns of 720 deg is {rest!r} deg, exactly.")
    sheet.step(values, name, f"{name}_deg*pi/180", RADIANS)


def sine_and_cosine(sheet: Sheet, values: Values, name: str, sine: str, cosine: str, *, half: bool = True) -> None:
    """Add the cosine and the sine of an angle or of its half; exact where degrees say so."""
    inside = f"{name}/2" if half else name
    turn = values.get(f"{name}_deg", 0.0) / (90.0 if half else 45.0)  # the argument, in 45 degrees
    is_exact = turn != 0.0 and turn == int(turn) and (half or turn % 2 == 0)
    eighths = int(turn) if is_exact else 0
    sheet.step(values, cosine, f"cos({inside})", exactly=ROOTS[(eighths + 2) % 8] if is_exact else "")
    sheet.step(values, sine, f"sin({inside})", exactly=ROOTS[eighths % 8] if is_exact else "")
    if is_exact:
        sheet.caveat(EXACT)


def direction(
    sheet: Sheet, values: Values, given: Sequence[str], unit: Sequence[str], name: str, measure: str = ""
) -> float:
    """Add the length of a non-zero vector and its direction."""
    found, divided, by = length(sheet, values, given, name, measure)
    for each, part in zip(unit, divided, strict=True):
        sheet.step(values, each, f"{part}/{by}")
    return found


def length(
    sheet: Sheet, values: Values, given: Sequence[str], name: str, measure: str = ""
) -> tuple[float, Sequence[str], str]:
    """Add the length of a vector; one whose squares leave the range of a double is scaled first.

    Returns it, and the names of numbers whose quotients are the direction.
    """
    most = max(abs(values[each]) for each in given)
    if most == 0.0 or TINY < most < HUGE:
        return sheet.step(values, name, norm(given), measure), given, name
    sheet.say("Squares of these numbers leave the range of a double; they are divided by the largest first.")
    sheet.step(values, "m", f"max({', '.join(f'abs({each})' for each in given)})", measure)
    scaled = [f"k{letter}" for letter in "xyzw"[: len(given)]]
    for each, part in zip(scaled, given, strict=True):
        sheet.step(values, each, f"{part}/m")
    sheet.step(values, "k", norm(scaled))
    return sheet.step(values, name, "m*k", measure), scaled, "k"


def norm(names: Sequence[str] = XYZW) -> str:
    """Return the formula of a length."""
    return f"sqrt({' + '.join(f'{name}**2' for name in names)})"


def angles(sheet: Sheet, values: Values, names: Sequence[str], *, degrees: bool) -> Sequence[float]:
    """Return angles, in degrees with the steps to them."""
    return to_degrees(sheet, values, *names) if degrees else [values[name] for name in names]


def to_degrees(sheet: Sheet, values: Values, *names: str) -> list[float]:
    """Turn angles into degrees."""
    return [sheet.step(values, f"{name}_deg", f"{name}*180/pi", DEGREES) for name in names]


def rows(entries: Sequence[float]) -> Matrix:
    """Return nine numbers as three rows."""
    return [list(entries[at : at + 3]) for at in (0, 3, 6)]


def of_quaternion(sheet: Sheet, q: Quaternion) -> Matrix:
    """Return the matrix of a quaternion as the steps after it take it."""
    return rows([sheet.settled(Value(entry, 1.0)) for entry in to_matrix(*q)])


def nearest_rotation(sheet: Sheet, entries: Sequence[float]) -> Sequence[float]:
    """Return the rotation nearest to a matrix, with the steps to it; what is one already stays as it is."""
    off = kernel.defect(*kernel.nine(entries), floats)
    if off <= kernel.ORTHONORMAL:
        return entries
    sheet.heading("The nearest rotation")
    sheet.say(f"The rows are orthonormal only to {off:.1e}. Newton's way to the nearest rotation (Higham 1986): the "
              "mean of M and of its inverse transposed, again and again; each step doubles the right digits.")
    here = rows(kernel.balanced(*kernel.nine(entries), floats))
    if here != rows(entries):
        sheet.say("M is divided by a power of two first; its rotation stays.")
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
