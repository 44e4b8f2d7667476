"""Floats as the shortest decimals that read back the same, in bulk, and their layout as text, aligned at the point.

For a float of ulp u let 10**k be the power with 1 <= u / 10**k < 10.  The float is scaled by 10**-k to a sum of an
integer and a fraction, accurate to about 2**-45; its neighbours' midpoints are half an ulp away.  A multiple of ten
between them is the shortest result, once its trailing zeros are removed; there is at most one.  Otherwise it is the
nearest integer.  Numbers closer to a boundary than the error are marked unsure and left to `repr`.
Source: the two candidates are those of Giulietti's Schubfach (2020), sections 8 and 9, with sums of two floats instead
of 128-bit integers.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.text.digits import ZEROS, count_digits, eight_digits, halves, power_of_ten, product_error
from frametool.text.spans import MARGIN, Spans, framed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.text.spans import Bytes, Flags, Floats, Ints, Words

# numbers whose products with the powers, and the errors of these, are normal floats
_LEAST, _GREATEST = 1e-270, 1e270
_MANTISSA = np.int64((1 << 52) - 1)
# the error of the scaled value is below 2**-45; the margin costs one row in 10**11
_DOUBT = 2.0**-40
# numbers of up to fifteen digits are the only ones this short that read as their float
_SHORT_DECIMALS = 6
_GREATEST_SHORT = 1e15
_PROBE = 32


class Decimals(NamedTuple):
    """Numbers `digits * 10**-places` (n,); `unsure` are the indices of undecided ones."""

    digits: Ints
    places: Ints
    unsure: Ints


def shortest_decimals(size: Floats) -> Decimals:
    """Return the shortest decimals that read back as these floats, which have no sign.

    Zero, infinity, nan, subnormal and extreme numbers are unsure too. Digits may end with zeros.
    """
    if _are_short(size[:_PROBE]) and _are_short(size):
        digits = np.rint(size * 10.0**_SHORT_DECIMALS).astype(np.int64)
        return Decimals(digits, np.full(len(size), _SHORT_DECIMALS), np.empty(0, np.int64))
    return _scaled_decimals(size)


def _are_short(size: Floats) -> bool:
    """Return True if all numbers have at most six decimals and fifteen digits."""
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
    # a power of two has its lower neighbour at half the distance; only an exact decimal is certain then
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
    """Return tables by binary exponent: scaling power of ten, its error, half an ulp scaled, decimal places."""
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


WIDTH = 40
POINT = 15
# one byte of the fifteen is the sign
GREATEST_WHOLE = 10**14
_MINUS = ord("-")
_POINT_CHARACTER = np.uint64(ord(".") << 56)


class Fields:
    """Rows of WIDTH bytes, as five words and as one long array of bytes between two margins.

    bytes  0 .. 14   sign and whole part, right-aligned     0 ..  7, 8 .. 15   two words of characters
    byte  15         the point
    bytes 16 .. 32   fraction, left-aligned                16 .. 23, 24 .. 31, 32 .. 39   three words
    A number begins at its first digit or sign and ends at its last wanted digit: what is outside is never copied, so
    that neither leading nor trailing zeros have to be moved.
    """

    def __init__(self, rows: int) -> None:
        """Allocate rows; their content is arbitrary until written."""
        self.data: Bytes = np.empty(rows * WIDTH + 2 * MARGIN, np.uint8)
        inner = self.data[MARGIN : MARGIN + rows * WIDTH]
        self.words: Words = inner.view("<u8").reshape(rows, WIDTH // 8)
        self.origins: Ints = np.arange(MARGIN, MARGIN + rows * WIDTH, WIDTH, dtype=np.int64)

    def write_whole(self, whole: Ints) -> None:
        """Write the digits of integers below GREATEST_WHOLE before the point, and the point."""
        upper = whole // 10**7 if whole.max(initial=0) >= 10**7 else None
        lower = whole if upper is None else whole - upper * 10**7
        words = eight_digits(lower)
        words >>= np.uint64(8)
        words |= _POINT_CHARACTER
        self.words[:, 1] = words
        if upper is not None:
            self.words[:, 0] = eight_digits(upper)

    def write_fraction(self, fraction: Ints, digits: int) -> list[Words]:
        """Write integers as exactly this many digits (up to 17) after the point; return their words, padded with 0."""
        words = []
        rest = fraction
        for left in range(digits, 0, -8):
            leading = rest if left <= 8 else rest // 10 ** (left - 8)
            words.append(_left_digits(leading, min(left, 8)))
            self.words[:, 1 + len(words)] = words[-1]
            if left > 8:
                rest = rest - leading * 10 ** (left - 8)
        return words

    def write_sign(self, starts: Ints, negative: Flags) -> Ints:
        """Write a minus before each start; return the starts, moved to the minus of negative numbers."""
        self.data[starts - 1] = _MINUS
        return starts - negative

    def whole_starts(self, whole: Ints) -> Ints:
        """Return the offsets of the first digits of the whole parts in `data`."""
        return self.origins + POINT - count_digits(whole)


def _left_digits(numbers: Ints, digits: int) -> Words:
    """Return the characters of integers of this many digits, padded with 0 to eight."""
    if digits == 1:
        return numbers.view(np.uint64) + ZEROS
    return eight_digits(numbers * 10 ** (8 - digits) if digits < 8 else numbers)


def written(values: Floats, separators: bytes, write: Callable[[Floats], Spans]) -> Spans:
    """Write rows of floats (n, c) by a function for a flat array; append its column's separator to each."""
    rows, columns = values.shape
    if len(separators) != columns:
        raise ValueError(f"{columns} columns, but {len(separators)} separators")
    with np.errstate(over="ignore", invalid="ignore"):
        data, starts, ends = write(np.ascontiguousarray(values, np.float64).ravel())
    data[ends] = np.tile(np.frombuffer(separators, np.uint8), rows)
    return Spans(data, starts.reshape(rows, columns), (ends + 1).reshape(rows, columns))


def replaced(spans: Spans, places: Ints, texts: Sequence[str]) -> Spans:
    """Return the spans with those at `places` replaced by other text, each followed by one spare byte."""
    if not texts:
        return spans
    added = framed("".join(f"{text} " for text in texts).encode())
    lengths = np.array([len(text) for text in texts], np.int64)
    begins = len(spans.data) + MARGIN + np.cumsum(lengths + 1) - lengths - 1
    spans.starts[places] = begins
    spans.ends[places] = begins + lengths
    return Spans(np.concatenate([spans.data, added]), spans.starts, spans.ends)
