"""Decimal digits as eight characters in one 64-bit word, the first in the lowest byte, and arithmetic to 100 bits.

Powers of ten are sums of two floats; products of floats are exact, as a float and its error.
Source: Dekker 1971 (splitting, exact product); Veltkamp's constant 2^27 + 1.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.text.spans import Floats, Ints, Words

_SPLITTER = 134217729.0
# beyond these exponents a product or its error leaves the range of normal floats
LEAST_POWER, GREATEST_POWER = -290, 290
TENS: Ints = 10 ** np.arange(19, dtype=np.int64)


def halves(value: Floats) -> tuple[Floats, Floats]:
    """Split floats into two of 26 bits each, whose sum they are; |value| below 1e300."""
    stretched = value * _SPLITTER
    high = stretched - (stretched - value)
    return high, value - high


def product_error(a: tuple[Floats, Floats], b: tuple[Floats, Floats], product: Floats) -> Floats:
    """Return the error of the rounded product of two floats, which are passed as their halves."""
    (a_high, a_low), (b_high, b_low) = a, b
    error = a_high * b_high
    error -= product
    error += a_high * b_low
    error += a_low * b_high
    error += a_low * b_low
    return error


@cache
def power_of_ten(exponent: int) -> tuple[float, float]:
    """Return 10**exponent as a float, and the float nearest to its error."""
    above, below = (10**exponent, 1) if exponent >= 0 else (1, 10**-exponent)
    high = above / below
    numerator, denominator = high.as_integer_ratio()
    return high, (above * denominator - numerator * below) / (below * denominator)


@cache
def powers_of_ten() -> tuple[Floats, Floats]:
    """Return a table of `power_of_ten` from LEAST_POWER to GREATEST_POWER: the powers and their errors."""
    table = np.array([power_of_ten(exponent) for exponent in range(LEAST_POWER, GREATEST_POWER + 1)])
    return np.ascontiguousarray(table[:, 0]), np.ascontiguousarray(table[:, 1])


def _word(byte: int) -> np.uint64:
    return np.uint64(int.from_bytes(bytes([byte]) * 8, "little"))


ZEROS = _word(ord("0"))
_POINTS, _ONES, _HIGH, _ABOVE_NINE = _word(ord(".")), _word(1), _word(0x80), _word(0x76)
_EVERY_FOURTH = np.uint64(0x000000FF000000FF)
_HUNDREDS = np.uint64(100 + (1000000 << 32))
_ONES_AND_TEN_THOUSANDS = np.uint64(1 + (10000 << 32))


def read_eight_digits(digits: Words) -> Words:
    """Return the numbers in words of eight digit values (characters ^ ZEROS).

    Source: three multiplications, Lemire 2018.
    """
    pairs = digits * np.uint64(10)
    pairs += digits >> np.uint64(8)
    upper = pairs >> np.uint64(16)
    upper &= _EVERY_FOURTH
    upper *= _ONES_AND_TEN_THOUSANDS
    pairs &= _EVERY_FOURTH
    pairs *= _HUNDREDS
    pairs += upper
    pairs >>= np.uint64(32)
    return pairs


def not_digits(digits: Words) -> Words:
    """Return words that are zero if all eight digit values are 0 to 9."""
    beyond = digits + _ABOVE_NINE
    beyond |= digits
    beyond &= _HIGH
    return beyond


def first_point(characters: Words) -> Ints:
    """Return the index, 0 to 7, of the first point in words of eight characters; 8 if there is none."""
    others = characters ^ _POINTS
    found = others - _ONES
    found &= ~others
    found &= _HIGH
    # the bits below the lowest set bit: the highest of each byte before it; those of all eight if none is set
    below = (~found & (found - np.uint64(1))) >> np.uint64(7) & _ONES
    below *= _ONES  # the highest byte is their sum
    return (below >> np.uint64(56)).view(np.int64)


@cache
def _four_digits() -> tuple[Words, Words]:
    """Return tables of the characters 0000 .. 9999 in the lower and in the upper half of a word."""
    characters = b"".join(b"%04d" % number for number in range(10000))
    low = np.frombuffer(characters, "<u4").astype(np.uint64)
    return low, low << np.uint64(32)


def eight_digits(numbers: Ints) -> Words:
    """Return the characters of integers in 0 .. 99999999, with leading zeros."""
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


def significant_digits(words: Sequence[Words]) -> Ints:
    """Count the digits of numbers in words of characters up to their last non-zero one.

    A word's highest non-zero byte follows from the exponent of the word as a float: digits are below 16, so that
    rounding never reaches the next byte. The float 0 has the exponent -1023, below that of any other word.
    """
    last = np.full(words[0].shape, -1, np.int64)
    for index, word in enumerate(words):
        exponents = (word ^ ZEROS).view(np.int64).astype(np.float64).view(np.int64) >> 52
        exponents -= 1023 - 64 * index
        exponents >>= 3
        np.maximum(last, exponents, out=last)
    return last + 1
