"""Seconds in floats as whole nanoseconds: those of the decimal that the float prints as, not of its last bit.

Knows no text: 1700000000.1 is 1700000000100000000 ns here as it is where it stands in a table.
"""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np

from frametool.frames.stamps import BILLION
from frametool.text.decimals import shortest_decimals
from frametool.text.powers import TENS

if TYPE_CHECKING:
    from frametool.text.array_types import Flags, Floats, Ints

NINE = 9  # decimals of a second that nanoseconds have
MOST = np.iinfo(np.int64).max
FURTHEST = float(MOST // BILLION)  # seconds


def nanoseconds_of(seconds: Floats) -> tuple[Ints, Flags]:
    """Return seconds (n,) in whole nanoseconds, and which of them are none: not finite, or beyond 64 bits.

    What is finer than a nanosecond is rounded, halves to even.
    """
    size = np.abs(seconds)
    none = ~(size < FURTHEST)
    size[none] = 0.0
    digits, places, unsure = shortest_decimals(size)
    scale = np.abs(NINE - places)
    stamps = digits * TENS.take(scale, mode="clip")
    finer = np.flatnonzero(places > NINE)
    stamps[finer] = _divided(digits[finer], scale[finer])
    for row in unsure[size[unsure] != 0.0].tolist():
        stamps[row] = round(Decimal(repr(float(size[row]))) * BILLION)
    stamps[size == 0.0] = 0
    return np.where(seconds < 0.0, -stamps, stamps), none


def _divided(digits: Ints, places: Ints) -> Ints:
    """Divide by powers of ten and round, halves to even."""
    divisor = TENS.take(places, mode="clip")
    whole = digits // divisor
    twice = 2 * (digits - whole * divisor)
    whole += (twice > divisor) | ((twice == divisor) & (whole % 2 == 1))
    return np.where(places < len(TENS), whole, 0)
