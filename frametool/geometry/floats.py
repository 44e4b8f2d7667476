"""The functions kernels find in `xp` when their components are Python floats; loads no numpy."""

from __future__ import annotations

from math import copysign, fmod, frexp, ldexp, sqrt

from frametool.geometry import trig

__all__ = [
    "canonical_sign", "copysign", "doubled_arctan", "doubled_sincos", "first_nonzero", "fmod", "frexp", "furthest",
    "ldexp", "least", "mask", "maximum", "minimum", "reduced_exactly", "some", "sqrt", "where",
]  # fmt: skip

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Condition

S1, S2, S3, S4, S5, S6 = trig.SINE
A1, A2, A3, A4, A5, A6 = trig.ARC_ABOVE
B1, B2, B3, B4, B5, B6 = trig.ARC_BELOW
LEVEL, RIGHT_ANGLE, RIGHT_ANGLE_REST = trig.LEVEL, trig.RIGHT_ANGLE, trig.RIGHT_ANGLE_REST
maximum, minimum = max, min
some = mask = bool
least = float
reduced_exactly = trig.reduced_exactly


def where(condition: Condition, yes: float, no: float) -> float:
    """Return `yes` if the condition holds, else `no`; both are already computed."""
    return yes if condition else no


def canonical_sign(x: float, y: float, z: float, w: float) -> tuple[float, float, float, float]:
    """Return q or -q: w > 0, or w == 0 and the first non-zero of x, y, z positive; zeros of what is negated are +0."""
    if (w or x or y or z) < 0.0:
        return 0.0 - x, 0.0 - y, 0.0 - z, 0.0 - w
    return x, y, z, w


def furthest(value: float, centre: float = 0.0) -> float:
    """Return how far a number is from another."""
    return abs(value - centre)


def first_nonzero(a: float, b: float, c: float, d: float) -> float:
    """Return the first value that is not zero, or the last."""
    return a or b or c or d


def doubled_sincos(y: float) -> tuple[float, float]:
    """Return sine and cosine of 2y, |y| <= pi/4, by the steps that `arrays` takes."""
    squared = y * y
    bend = (((((squared * S6 + S5) * squared + S4) * squared + S3) * squared + S2) * squared + S1) * squared * y
    sine = y + bend
    squared_sine = sine * sine + (y - sine + bend) * sine * 2.0
    cosine = squared_sine * -2.0 + 1.0
    if cosine < LEVEL:
        cosine = RIGHT_ANGLE - abs(y + y) + RIGHT_ANGLE_REST
    return sqrt(1.0 - squared_sine) * 2.0 * sine, cosine


def doubled_arctan(tangent: float) -> float:
    """Return 2 atan(t), |t| <= 1, by the steps that `arrays` takes."""
    squared = tangent * tangent
    above = ((((squared * A6 + A5) * squared + A4) * squared + A3) * squared + A2) * squared + A1
    below = (((((squared + B6) * squared + B5) * squared + B4) * squared + B3) * squared + B2) * squared + B1
    return (tangent - above / below * squared * tangent) * 2.0
