"""Decimal digits of non-negative integers as eight characters in one 64-bit word, the first in the lowest byte."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from frametool.text.powers import TENS

if TYPE_CHECKING:
    from frametool.text.arrays import Ints, Words


@cache
def _four_digits() -> tuple[Words, Words]:
    """Tabulate the characters 0000 .. 9999, once in the lower and once in the upper half of a word."""
    characters = b"".join(b"%04d" % number for number in range(10000))
    low = np.frombuffer(characters, "<u4").astype(np.uint64)
    return low, low << np.uint64(32)


def eight_digits(numbers: Ints) -> Words:
    """Give the characters of integers in 0 .. 99999999, with leading zeros."""
    low, high = _four_digits()
    narrow = numbers.astype(np.uint32)
    upper = narrow // np.uint32(10000)
    narrow -= upper * np.uint32(10000)
    words = low.take(upper)
    words |= high.take(narrow)
    return words


def count_digits(numbers: Ints) -> Ints:
    """Count the decimal digits of integers from 0 to below 10**18; 0 has one."""
    count = np.ones(numbers.shape, np.int64)
    for power in TENS[1 : len(str(int(numbers.max(initial=0))))]:
        count += numbers >= power
    return count


def trailing_zeros(numbers: Ints) -> Ints:
    """Count the zeros integers end with; 0 itself counts as having none."""
    count = np.zeros(numbers.shape, np.int64)
    rest = numbers
    place = np.arange(len(numbers))
    while place.size:
        shorter = rest // 10
        ends = (shorter * 10 == rest) & (rest != 0)
        place, rest = place[ends], shorter[ends]
        count[place] += 1
    return count
