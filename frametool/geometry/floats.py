"""The functions kernels find in `xp` when their components are Python floats; loads no numpy."""

from __future__ import annotations

from math import atan2, cbrt, copysign, cos, degrees, fmod, frexp, ldexp, radians, sin, sqrt
from math import hypot as length

__all__ = [
    "all_near_one", "bearing", "canonical_sign", "cbrt", "copysign", "degrees", "first_nonzero", "frexp",
    "half_sincos", "half_sincos_deg", "incline", "largest", "ldexp", "length", "maximum", "minimum", "radians", "some",
    "sqrt", "where",
]  # fmt: skip

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Pair

SQRT_HALF = sqrt(0.5)
maximum, minimum = max, min
incline = atan2
largest = abs
some = bool


def where(condition: bool, yes: float, no: float) -> float:  # noqa: FBT001 - numpy's signature
    """Return `yes` if the condition holds, else `no`; both are already computed."""
    return yes if condition else no


def canonical_sign(x: float, y: float, z: float, w: float) -> tuple[float, float, float, float]:
    """Return q or -q: w > 0, or w == 0 and the first non-zero of x, y, z positive; zeros of what is negated are +0."""
    if (w or x or y or z) < 0.0:
        return 0.0 - x, 0.0 - y, 0.0 - z, 0.0 - w
    return x, y, z, w


def bearing(y: float, x: float, _radius: float) -> float:
    """Return the angle of a direction in [-pi, pi]; arrays profit from knowing its length."""
    return atan2(y, x)


def all_near_one(value: float, tolerance: float) -> bool:
    """Say whether a number is within a tolerance of 1."""
    return abs(value - 1.0) <= tolerance


def first_nonzero(*values: float) -> float:
    """Return the first value that is not zero, or the last."""
    for value in values:
        if value:
            return value
    return values[-1]


def half_sincos(angle: float) -> Pair:
    """Return sine and cosine of half an angle in radians."""
    half = 0.5 * angle
    return sin(half), cos(half)


def half_sincos_deg(angle: float) -> Pair:
    """Return sine and cosine of half an angle in degrees.

    Exact at multiples of 180; at odd multiples of 90 both have the same double sqrt(1/2) as magnitude, so that
    products cancel exactly.  The reduction to at most 45 degrees is exact.
    """
    half = 0.5 * fmod(angle, 720.0)
    if -45.0 < half < 45.0:
        rest = radians(half)
        return sin(rest), cos(rest)
    quarter = round(half / 90.0)
    rest = half - 90.0 * quarter
    sine, cosine = sin(radians(rest)), cos(radians(rest))
    if abs(rest) == 45.0:
        sine, cosine = copysign(SQRT_HALF, rest), SQRT_HALF
    if quarter & 1:
        sine, cosine = cosine, 0.0 - sine
    return (0.0 - sine, 0.0 - cosine) if quarter & 2 else (sine, cosine)
