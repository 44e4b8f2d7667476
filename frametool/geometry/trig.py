"""Sine, cosine and arc tangent of arrays by polynomials in plain numpy.

Without AVX-512 numpy calls the C library for every element, 10 to 20 ns each; a multiplication takes 0.3.
The coefficients come from interpolation at Chebyshev nodes with 60 digits; the tests hold the results to theirs.
"""

from __future__ import annotations

from math import pi

import numpy as np

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Number, Pair

# (sin(y)/y - 1)/y^2 in y^2, |y| <= pi/4: relative error of the sine 2^-56
SINE = (-0.16666666666666666, 0.008333333333330948, -0.0001984126983675857, 2.755731610255057e-06,
        -2.5051131844614108e-08, 1.5918129266803394e-10)  # fmt: skip
# (1 - atan(t)/t)/t^2 as a quotient in t^2, 0 <= t <= 1, the divisor led by 1: relative error of the angle 2^-55
ARC_ABOVE = (404.44958201411697, 905.3726290655958, 709.2810809323058, 230.9790943899718, 28.6344514670043,
             0.9024525862982413)  # fmt: skip
ARC_BELOW = (1213.3487460423516, 3444.127134821938, 3674.312918256491, 1825.9201295139483, 423.8789826719409,
             39.96465648522898, 1.0)  # fmt: skip
# pi/2 in two parts, the first of 33 bits (fdlibm): its products with whole numbers below 2^20 are exact
QUARTER_TURN, QUARTER_TURN_REST = 1.57079632673412561417, 6.07710050650619224932e-11
FAR = 2.0**20


def largest(x: Number) -> float:
    """Return the largest magnitude, NaN if there is one."""
    return float(np.abs(x).max(initial=0.0))


def half_sincos(angle: Number) -> Pair:
    """Return sine and cosine of half an angle in radians, at most 2 eps off.

    Source: sin 2y = 2 sin y cos y and cos 2y = 1 - 2 sin^2 y of the quarter y, which |sin y| <= sqrt(1/2) makes
    well-conditioned.  Quarters beyond pi/4 are reduced as Cody & Waite 1980 do.
    """
    quarter = 0.25 * angle
    bound = largest(quarter)
    if bound <= 0.25 * pi:
        return _doubled(quarter)
    if not bound < FAR:
        return np.sin(0.5 * angle), np.cos(0.5 * angle)
    turns = np.rint(quarter * (2.0 / pi))
    quarter -= turns * QUARTER_TURN
    quarter -= turns * QUARTER_TURN_REST
    sine, cosine = _doubled(quarter)
    if bound > 0.75 * pi:
        turns -= 2.0 * np.rint(0.5 * turns)
    sign = 1.0 - 2.0 * abs(turns)
    return sine * sign, cosine * sign


def _doubled(y: Number) -> Pair:
    """Return sine and cosine of 2y, |y| <= pi/4.

    The rounding of sin y is added to its square, so that the cosine of a right angle vanishes to half an eps.
    """
    squared = y * y
    bend = polynomial(squared, SINE)
    bend *= squared
    bend *= y
    sine = y + bend
    rounding = y - sine
    rounding += bend
    rounding *= sine
    rounding *= 2.0
    squared = sine * sine
    squared += rounding
    root = np.sqrt(1.0 - squared)
    root *= 2.0
    root *= sine
    squared *= -2.0
    squared += 1.0
    return root, squared


def doubled_arctan(tangent: Number) -> Number:
    """Return 2 atan(t), |t| <= 1, at most 1 eps off; of 1 it is pi/2 to the bit."""
    squared = tangent * tangent
    rest = polynomial(squared, ARC_ABOVE)
    rest /= polynomial(squared, ARC_BELOW)
    rest *= squared
    rest *= tangent
    rest = tangent - rest
    rest *= 2.0
    return rest


def polynomial(x: Number, coefficients: tuple[float, ...]) -> Number:
    """Evaluate a polynomial by Horner's rule in one array, lowest coefficient first."""
    value = x * coefficients[-1]
    for coefficient in coefficients[-2:0:-1]:
        value += coefficient
        value *= x
    value += coefficients[0]
    return value
