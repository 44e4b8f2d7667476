"""The shortest decimal numbers that read back to the same floats, in bulk, as integers times powers of ten.

For a float of ulp u let 10**k be the power with 1 <= u / 10**k < 10. The float is scaled by 10**-k to a sum of an
integer and a fraction, good to about 2**-45; its neighbours' midpoints lie half an ulp away. A multiple of ten inside
them is the shortest answer, once its trailing zeros are cut; there is at most one. Otherwise the nearest integer is.
Whatever lies closer to a boundary than the error allows is marked unsure and left to `repr`.
Source: the two candidates are those of Giulietti's Schubfach (2020), sections 8 and 9; the 128-bit integers are
replaced by sums of two floats.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.text.powers import halves, power_of_ten, product_error

if TYPE_CHECKING:
    from frametool.text.array_types import Floats, Ints

# Sizes whose products with the powers, and the errors of these, stay normal floats.
_LEAST, _GREATEST = 1e-270, 1e270
_MANTISSA = np.int64((1 << 52) - 1)
# The error of the scaled value is below 2**-45; the margin costs one row in 10**11.
_DOUBT = 2.0**-40
# Numbers of up to fifteen digits are the only ones so short that read as their float.
_SHORT_DECIMALS = 6
_GREATEST_SHORT = 1e15
_PROBE = 32


class Decimals(NamedTuple):
    """Numbers `digits * 10**-places` (n,); `unsure` are the places of those that could not be decided."""

    digits: Ints
    places: Ints
    unsure: Ints


def shortest_decimals(size: Floats) -> Decimals:
    """Return the shortest decimals that read back as these floats, which carry no sign.

    Zero, infinity, nan, subnormal and extreme numbers are unsure, too. Digits may end with zeros.
    """
    if _are_short(size[:_PROBE]) and _are_short(size):
        digits = np.rint(size * 10.0**_SHORT_DECIMALS).astype(np.int64)
        return Decimals(digits, np.full(len(size), _SHORT_DECIMALS), np.empty(0, np.int64))
    return _scaled_decimals(size)


def _are_short(size: Floats) -> bool:
    """Tell whether all numbers have at most six decimals and fifteen digits."""
    power = 10.0**_SHORT_DECIMALS
    digits = np.rint(size * power)
    return bool(((digits / power == size) & (digits < _GREATEST_SHORT)).all())


def _scaled_decimals(size: Floats) -> Decimals:
    bits = size.view(np.int64)
    exponents = bits >> 52
    powers, rests, half_ulps, all_places = _tables()
    half_ulp = half_ulps.take(exponents)
    number, fraction = _scale(size, powers.take(exponents), rests.take(exponents))
    tens = number // 10
    above_ten = (number - tens * 10) + fraction
    below_ten = 10.0 - above_ten
    sure = np.abs(above_ten - half_ulp) > _DOUBT
    sure &= np.abs(below_ten - half_ulp) > _DOUBT
    sure &= np.abs(fraction - 0.5) > _DOUBT
    # A power of two has its lower neighbour at half the distance; only an exact decimal is beyond doubt then.
    sure &= ((bits & _MANTISSA) != 0) | (above_ten == 0)
    upwards = below_ten < half_ulp
    nearest = number + (fraction > 0.5)
    to_tens = (tens + upwards) * 10
    to_tens -= nearest
    to_tens *= upwards | (above_ten < half_ulp)
    nearest += to_tens
    return Decimals(nearest, all_places.take(exponents), np.flatnonzero(~sure))


def _scale(size: Floats, power: Floats, rest: Floats) -> tuple[Ints, Floats]:
    """Multiply by the sum of two floats; return the product as an integer and a fraction from 0 to 1."""
    product = size * power
    error = product_error(halves(size), halves(power), product)
    error += size * rest
    whole = np.floor(error)
    error -= whole
    product_as_integer = product.astype(np.int64)
    product_as_integer += whole.astype(np.int64)
    return product_as_integer, error


@cache
def _tables() -> tuple[Floats, Floats, Floats, Ints]:
    """Tabulate by binary exponent: power of ten that scales, what it lacks, half an ulp scaled, its decimal places."""
    rows = [_table_row(exponent) for exponent in range(2048)]
    powers, rests, half_ulps, places = zip(*rows, strict=True)
    return np.array(powers), np.array(rests), np.array(half_ulps), np.array(places, np.int64)


def _table_row(exponent: int) -> tuple[float, float, float, int]:
    binary = exponent - 1075
    if not _LEAST < 2.0 ** min(max(binary + 52, -1000), 1000) < _GREATEST:
        return 0.0, 0.0, float("nan"), 0
    # floor(binary * log10(2)), exact in this range
    places = -((binary * 315653) >> 20)
    power, rest = power_of_ten(places)
    return power, rest, 2.0 ** (binary - 1) * power, places
