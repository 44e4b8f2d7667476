"""Powers of ten as the sum of two floats, and exact products of floats: arithmetic to about 100 bits.

Source: Dekker 1971 (splitting, exact product); Veltkamp's constant 2^27 + 1.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from frametool.text.array_types import Floats, Ints

_SPLITTER = 134217729.0
# Beyond these exponents a product or its error leaves the range of normal floats.
LEAST_POWER, GREATEST_POWER = -290, 290
TENS: Ints = 10 ** np.arange(19, dtype=np.int64)


def halves(value: Floats) -> tuple[Floats, Floats]:
    """Split floats into two of 26 bits each whose sum they are; |value| below 1e300."""
    stretched = value * _SPLITTER
    high = stretched - (stretched - value)
    return high, value - high


def product_error(a: tuple[Floats, Floats], b: tuple[Floats, Floats], product: Floats) -> Floats:
    """Return what the rounded product of two floats, given as their halves, lacks to the exact one."""
    (a_high, a_low), (b_high, b_low) = a, b
    error = a_high * b_high
    error -= product
    error += a_high * b_low
    error += a_low * b_high
    error += a_low * b_low
    return error


@cache
def power_of_ten(exponent: int) -> tuple[float, float]:
    """Return 10**exponent as a float and the float nearest to what it lacks."""
    above, below = (10**exponent, 1) if exponent >= 0 else (1, 10**-exponent)
    high = above / below
    numerator, denominator = high.as_integer_ratio()
    return high, (above * denominator - numerator * below) / (below * denominator)


@cache
def powers_of_ten() -> tuple[Floats, Floats]:
    """Tabulate `power_of_ten` from LEAST_POWER to GREATEST_POWER: the powers and what they lack."""
    table = np.array([power_of_ten(exponent) for exponent in range(LEAST_POWER, GREATEST_POWER + 1)])
    return np.ascontiguousarray(table[:, 0]), np.ascontiguousarray(table[:, 1])
