"""Steps that several blocks share: angles and their sines, lengths and directions.

Matrices in derivations: those of quaternions, the rotation nearest to what is given, and the whole pose.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from frametool.explain.formula_tree import Value
from frametool.explain.sheet import DEGREES, RADIANS
from frametool.geometry import floats
from frametool.geometry import matrix as kernel
from frametool.geometry.quaternion import to_matrix

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.sheet import Matrix, Sheet, Values
    from frametool.grammar.readers import Quaternion

TINY, HUGE = 1e-140, 1e140  # beyond, squares leave the range of a double
TWO_TURNS = 720.0  # degrees: the half angle inside has turned once
UNIT = 8.9e-16  # 4 eps: a length this near 1 is 1
ROOTS = ("sqrt(0)/2", "sqrt(2)/2", "sqrt(4)/2", "sqrt(2)/2", "sqrt(0)/2", "-sqrt(2)/2", "-sqrt(4)/2", "-sqrt(2)/2")
EXACT = "Multiples of 90 deg are exact: no rounded pi comes into their sines and cosines."
HALF = "Half the angle stands inside: a quaternion acts twice (q v q*), so w = cos(angle/2)."


def angle(sheet: Sheet, values: Values, name: str, given: float, *, degrees: bool) -> None:
    """Take an angle as it is given; one in degrees becomes radians."""
    if degrees:
        values[f"{name}_deg"] = rest = math.fmod(given, TWO_TURNS)
        if rest != given:
            sheet.say(f"{name}: {given!r} deg less whole double turns of 720 deg is {rest!r} deg, exactly.")
        sheet.step(values, name, f"{name}_deg*pi/180", RADIANS)
    else:
        values[name] = given


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


def norm(names: Sequence[str]) -> str:
    """Return the formula of a length."""
    return f"sqrt({' + '.join(f'{name}**2' for name in names)})"


def to_degrees(sheet: Sheet, values: Values, *names: str) -> list[float]:
    """Turn angles into degrees."""
    return [sheet.step(values, f"{name}_deg", f"{name}*180/pi", DEGREES) for name in names]


LAST_STEP = 1e-9  # the convergence is quadratic: what comes after such a step is rounding
MOST_STEPS = 60


def rows(entries: Sequence[float]) -> Matrix:
    """Return nine numbers as three rows."""
    return [list(entries[at : at + 3]) for at in (0, 3, 6)]


def of_quaternion(sheet: Sheet, q: Quaternion) -> Matrix:
    """Return the matrix of a quaternion as the steps after it take it."""
    return rows([sheet.settled(Value(entry, 1.0)) for entry in to_matrix(*q)])


def nearest_rotation(sheet: Sheet, entries: Sequence[float]) -> Sequence[float]:
    """Return the rotation nearest to a matrix, with the steps to it; what is one already stays as it is."""
    if kernel.defect(*kernel.nine(entries), floats) <= kernel.ORTHONORMAL:
        return entries
    sheet.heading("The nearest rotation")
    off = kernel.defect(*kernel.nine(entries), floats)
    sheet.say(f"The rows are orthonormal only to {off:.1e}. Newton's way to the nearest rotation (Higham 1986): the "
              "mean of M and of its inverse transposed, again and again; each step doubles the right digits.")
    here = rows(kernel.balanced(*kernel.nine(entries), floats))
    if here != rows(entries):
        sheet.say("M is divided by a power of two first; its rotation stays.")
    for count in range(1, MOST_STEPS + 1):
        there = rows(kernel.newton(*kernel.nine(part for row in here for part in row)))
        other = [[2.0 * b - a for a, b in zip(*pair, strict=True)] for pair in zip(here, there, strict=True)]
        sheet.grid(f"M{count}", f"1/2 (M{count - 1 or ''} + M{count - 1 or ''}^-T)",
                   r"\tfrac{1}{2}\left(M + M^{-\mathsf{T}}\right)",
                   ["1/2·(", here, "+", other, ")", "=", there])  # fmt: skip
        step = max(abs(a - b) for pair in zip(here, there, strict=True) for a, b in zip(*pair, strict=True))
        here = there
        if step < LAST_STEP:
            break
    return [part for row in here for part in row]
