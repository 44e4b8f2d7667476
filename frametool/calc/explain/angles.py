"""Steps that several blocks share: angles and their sines, lengths and directions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from frametool.calc.explain.sheet import DEGREES, RADIANS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.calc.explain.sheet import Sheet, Values

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
