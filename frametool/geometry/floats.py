"""The functions that kernels find in `xp` for Python floats, and how sines are computed; no numpy.

Sine, cosine and arc tangent of floats and arrays take the same steps, + - * / and square roots, which IEEE 754 rounds
correctly: one number and a million give the same bits on every machine, whatever its C library.  The polynomials are
written twice, here as one expression and in `arrays` step by step in place, the fastest way for each.  Coefficients
come from interpolation at Chebyshev nodes with 60 digits; the tests compare the results with 60 digits too.
"""

from __future__ import annotations

import math
from math import atan2, cos, isfinite, nan, pi, sin

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry import Condition, Functions, N, Two

copysign, fmod, frexp, ldexp, sqrt = math.copysign, math.fmod, math.frexp, math.ldexp, math.sqrt
DEGREE, RADIAN = pi / 180.0, 180.0 / pi  # a degree in radians and a radian in degrees
SQRT_HALF = sqrt(0.5)
# (sin(y)/y - 1)/y^2 in y^2, |y| <= pi/4: relative error of the sine 2^-56
SINE = (
    -0.16666666666666666, 0.008333333333330948, -0.0001984126983675857,
    2.755731610255057e-06, -2.5051131844614108e-08, 1.5918129266803394e-10,
)  # fmt: skip
# (1 - atan(t)/t)/t^2 as a quotient in t^2, 0 <= t <= 1, the divisor monic, which saves floats a product:
# relative error of the angle 2^-55
ARC_ABOVE = (
    404.44958201411697, 905.3726290655958, 709.2810809323058, 230.9790943899718, 28.6344514670043, 0.9024525862982413,
)  # fmt: skip
ARC_BELOW = (
    1213.3487460423516, 3444.127134821938, 3674.312918256491, 1825.9201295139483, 423.8789826719409, 39.96465648522898,
    1.0,
)  # fmt: skip
# pi/2 in two parts, the first of 33 bits (fdlibm): its products with whole numbers below 2^20 are exact
QUARTER_TURN, QUARTER_TURN_REST = 1.57079632673412561417, 6.07710050650619224932e-11
FAR = 2.0**20
RIGHT_ANGLE, RIGHT_ANGLE_REST = 0.5 * pi, 6.123233995736766e-17  # pi/2 in two doubles
LEVEL = 2.0**-27  # a cosine below it equals the distance to a right angle, to the last bit
WHOLE = 1.5 * 2.0**52  # adding and subtracting it rounds to the nearest whole number, ties to even


def half_sincos(angle: N, xp: Functions[N]) -> Two[N]:
    """Return sine and cosine of half an angle in radians, at most 1.5 eps off.

    Source: sin 2y = 2 sin y cos y and cos 2y = 1 - 2 sin^2 y of the quarter y, well-conditioned because
    |sin y| <= sqrt(1/2); near a right angle the cosine is the distance to it.  Quarters beyond pi/4 are reduced as in
    Cody & Waite 1980, and by `reduced_exactly` beyond 2^20.
    """
    quarter = 0.25 * angle
    bound = xp.furthest(quarter)
    if bound <= 0.25 * pi:
        return xp.doubled_sincos(quarter)
    quarter, turns = reduced(quarter) if bound < FAR else xp.reduced_exactly(quarter)
    sine, cosine = xp.doubled_sincos(quarter)
    turns -= 2.0 * nearest(0.5 * turns)
    sign = 1.0 - 2.0 * abs(turns)
    return sine * sign, cosine * sign


def half_sincos_deg(angle: N, xp: Functions[N]) -> Two[N]:
    """Return sine and cosine of half an angle in degrees.

    Exact at multiples of 180; at odd multiples of 90 both have the same double sqrt(1/2) as magnitude, so that
    products cancel exactly.  The reduction to at most 45 degrees is exact.
    """
    half = 0.5 * xp.fmod(angle, 720.0)
    turns = nearest(half / 90.0)
    rest = half - 90.0 * turns
    sine, cosine = xp.doubled_sincos(0.5 * (rest * DEGREE))
    diagonal = abs(rest) == 45.0
    if xp.some(diagonal):
        sine = xp.where(diagonal, xp.copysign(SQRT_HALF, rest), sine)
        cosine = xp.where(diagonal, SQRT_HALF, cosine)
    if not xp.some(turns != 0.0):
        return sine, cosine
    turns -= 4.0 * nearest(0.25 * turns)
    swapped, back = abs(turns) == 1.0, (turns == -1.0) | (abs(turns) == 2.0)
    sine, cosine = xp.where(swapped, cosine, sine), xp.where(swapped, 0.0 - sine, cosine)
    return xp.where(back, 0.0 - sine, sine), xp.where(back, 0.0 - cosine, cosine)


def nearest(x: N) -> N:
    """Return the nearest integer, |x| < 2^51; zero is +0."""
    whole = x + WHOLE
    whole -= WHOLE
    return whole


def reduced(x: N) -> Two[N]:
    """Return an angle below 2^20 minus the nearest multiple of a quarter turn, and that multiple."""
    turns = nearest(x * (2.0 / pi))
    x = x - turns * QUARTER_TURN
    x -= turns * QUARTER_TURN_REST
    return x, turns


def incline(rise: N, run: N, xp: Functions[N]) -> N:
    """Return the angle of a direction of length 1 to 1e-8, run >= 0.

    It is twice the angle with tangent rise / (length + run), which is at most 1; equal parts give exactly pi/4.
    """
    length = 0.5 + 0.5 * (rise * rise + run * run)
    angle = xp.doubled_arctan(rise / (length + run))
    even = rise == run
    return xp.where(even, 0.25 * pi, angle) if xp.some(even) else angle


def bearing(y: N, x: N, radius: N, xp: Functions[N]) -> N:
    """Return the angle of a direction of this length in [-pi, pi], NaN for no direction."""
    angle = xp.doubled_arctan(y / (radius + abs(x)))
    side = xp.copysign(1.0, x)
    angle *= side
    angle += (0.5 - 0.5 * side) * xp.copysign(pi, y)
    return angle


def polynomial(x: N, coefficients: Sequence[float]) -> N:
    """Evaluate a polynomial by Horner's rule, arrays in a new array; lowest coefficient first."""
    value = x * coefficients[-1]
    for coefficient in coefficients[-2:0:-1]:
        value += coefficient
        value *= x
    value += coefficients[0]
    return value


def reduced_exactly(x: float) -> tuple[float, float]:
    """Return an angle up to 4e307 minus the nearest multiple of a quarter turn, and the parity of the multiple.

    The C library's sine and cosine reduce the angle by as many digits of pi as it takes.
    """
    if not isfinite(x):
        return nan, 0.0
    return 0.25 * atan2(sin(4.0 * x), cos(4.0 * x)), float(cos(2.0 * x) < 0.0)


S1, S2, S3, S4, S5, S6 = SINE
A1, A2, A3, A4, A5, A6 = ARC_ABOVE
B1, B2, B3, B4, B5, B6, _ = ARC_BELOW
maximum, minimum = max, min
some = mask = bool
least = float


def where(condition: Condition, yes: float, no: float) -> float:
    """Return `yes` if the condition holds, else `no`; both are already computed."""
    return yes if condition else no


def canonical_sign(x: float, y: float, z: float, w: float) -> tuple[float, float, float, float]:
    """Return q or -q such that w > 0, or w == 0 and the first non-zero of x, y, z is positive; no -0 where negated."""
    if (w or x or y or z) < 0.0:
        return 0.0 - x, 0.0 - y, 0.0 - z, 0.0 - w
    return x, y, z, w


def furthest(value: float, centre: float = 0.0) -> float:
    """Return the distance of a number from another."""
    return abs(value - centre)


def doubled_sincos(y: float) -> tuple[float, float]:
    """Return sine and cosine of 2y, |y| <= pi/4, by the same steps as `arrays`."""
    squared = y * y
    bend = (((((squared * S6 + S5) * squared + S4) * squared + S3) * squared + S2) * squared + S1) * squared * y
    sine = y + bend
    squared_sine = sine * sine + (y - sine + bend) * sine * 2.0
    cosine = squared_sine * -2.0 + 1.0
    if cosine < LEVEL:
        cosine = RIGHT_ANGLE - abs(y + y) + RIGHT_ANGLE_REST
    return sqrt(1.0 - squared_sine) * 2.0 * sine, cosine


def doubled_arctan(tangent: float) -> float:
    """Return 2 atan(t), |t| <= 1, by the same steps as `arrays`."""
    squared = tangent * tangent
    above = ((((squared * A6 + A5) * squared + A4) * squared + A3) * squared + A2) * squared + A1
    below = (((((squared + B6) * squared + B5) * squared + B4) * squared + B3) * squared + B2) * squared + B1
    return (tangent - above / below * squared * tangent) * 2.0
