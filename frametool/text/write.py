"""Convert floats to text in bulk: the shortest that reads back the same, or with a fixed number of decimals.

The same bytes as `repr` and `{:z.{precision}f}`; for floats of 32 bits the shortest text that reads back to them.

For a float of ulp u let 10**k be the power with 1 <= u / 10**k < 10.  The float is scaled by 10**-k to a sum of an
integer and a fraction, accurate to about 2**-45; its neighbours' midpoints are half an ulp away.  A multiple of ten
between them is the shortest result, once its trailing zeros are removed; there is at most one.  Otherwise it is the
nearest integer.  Numbers closer to a boundary than the error are marked unsure and left to `repr`.
Source: the two candidates are those of Giulietti's Schubfach (2020), sections 8 and 9, with sums of two floats instead
of 128-bit integers.

Decimal digits are eight characters in one 64-bit word, the first in the lowest byte.  Powers of ten are sums of two
floats; products of floats are exact, as a float and its error: arithmetic to 100 bits, which reading uses too.
Source: Dekker 1971 (splitting, exact product); Veltkamp's constant 2^27 + 1.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import NamedTuple
from frametool.text.spans import MARGIN, Bytes, Flags, Floats, Ints, Spans, Words, framed

if TYPE_CHECKING:
    from collections.abc import Sequence


_SPLITTER = 134217729.0
# beyond these exponents a product or its error leaves the range of normal floats
LEAST_POWER, GREATEST_POWER = -290, 290
TENS: Ints = 10 ** np.arange(19, dtype=np.int64)


def halves(value: Floats) -> tuple[Floats, Floats]:
    """Split floats into sums of two floats of 26 bits each; |value| below 1e300."""
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
    low = np.frombuffer(b"".join(b"%04d" % number for number in range(10000)), "<u4").astype(np.uint64)
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


# --- the shortest decimals ---

# numbers whose products with the powers, and the errors of these, are normal floats
_SMALLEST, _LARGEST = 1e-270, 1e270
_MANTISSA = np.int64((1 << 52) - 1)
# the error of the scaled value is below 2**-45; the margin costs one row in 10**11
_DOUBTFUL = 2.0**-40
# a float has at most one decimal of up to fifteen digits that reads back as it
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
    bits = size.view(np.int64)
    exponents = bits >> 52
    powers, rests, half_ulps, all_places = _tables()
    half_ulp = half_ulps.take(exponents)
    # times a power of ten, the sum of two floats: an integer and a fraction from 0 to 1
    power = powers.take(exponents)
    product = size * power
    fraction = product_error(halves(size), halves(power), product)
    fraction += size * rests.take(exponents)
    whole = np.floor(fraction)
    fraction -= whole
    number = product.astype(np.int64)
    number += whole.astype(np.int64)
    tens = number // 10
    above_ten = (number - tens * 10) + fraction
    below_ten = 10.0 - above_ten
    sure = np.abs(above_ten - half_ulp) > _DOUBTFUL
    sure &= np.abs(below_ten - half_ulp) > _DOUBTFUL
    sure &= np.abs(fraction - 0.5) > _DOUBTFUL
    # a power of two has its lower neighbour at half the distance; only an exact decimal is certain then
    sure &= ((bits & _MANTISSA) != 0) | (above_ten == 0)
    upwards = below_ten < half_ulp
    nearest = number + (fraction > 0.5)
    to_tens = (tens + upwards) * 10
    to_tens -= nearest
    to_tens *= upwards | (above_ten < half_ulp)
    nearest += to_tens
    return Decimals(nearest, all_places.take(exponents), np.flatnonzero(~sure))


def _are_short(size: Floats) -> bool:
    """Return True if all numbers have at most six decimals and fifteen digits."""
    power = 10.0**_SHORT_DECIMALS
    digits = np.rint(size * power)
    return bool(((digits / power == size) & (digits < _GREATEST_SHORT)).all())


@cache
def _tables() -> tuple[Floats, Floats, Floats, Ints]:
    """Return tables by binary exponent: scaling power of ten, its error, half an ulp scaled, decimal places."""
    rows = []
    for binary in range(-1075, 2048 - 1075):
        if not _SMALLEST < 2.0 ** min(max(binary + 52, -1000), 1000) < _LARGEST:
            rows.append((0.0, 0.0, float("nan"), 0))
            continue
        # floor(binary * log10(2)), exact in this range
        places = -((binary * 315653) >> 20)
        power, rest = power_of_ten(places)
        rows.append((power, rest, 2.0 ** (binary - 1) * power, places))
    powers, rests, half_ulps, decimals = zip(*rows, strict=True)
    return np.array(powers), np.array(rests), np.array(half_ulps), np.array(decimals, np.int64)


WIDTH = 40
POINT = 15
# one byte of the fifteen is the sign
GREATEST_WHOLE = 10**14
_POINT_CHARACTER = np.uint64(ord(".") << 56)


class Fields:
    """Rows of WIDTH bytes, as five words and as one long array of bytes between two margins.

    bytes  0 .. 14   sign and whole part, right-aligned     0 ..  7, 8 .. 15   two words of characters
    byte  15         the point
    bytes 16 .. 32   fraction, left-aligned                16 .. 23, 24 .. 31, 32 .. 39   three words
    A number begins at its first digit or sign and ends at its last needed digit; the rest is never copied, so
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
        words = eight_digits(whole if upper is None else whole - upper * 10**7)
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
            if left == 1:
                words.append(leading.view(np.uint64) + ZEROS)
            else:
                words.append(eight_digits(leading * 10 ** (8 - left) if left < 8 else leading))
            self.words[:, 1 + len(words)] = words[-1]
            if left > 8:
                rest = rest - leading * 10 ** (left - 8)
        return words

    def write_sign(self, starts: Ints, negative: Flags) -> Ints:
        """Write a minus before each start; return the starts, moved to the minus of negative numbers."""
        self.data[starts - 1] = ord("-")
        return starts - negative

    def whole_starts(self, whole: Ints) -> Ints:
        """Return the offsets of the first digits of the whole parts in `data`."""
        return self.origins + POINT - count_digits(whole)


def float_spans(values: Floats, separators: bytes, precision: int | None = None) -> Spans:
    """Write rows of floats as spans (n, c), each with its separator: shortest, or with a fixed number of decimals.

    values: (n, c); separators: c bytes, the one that follows each column.
    Nan and infinity become `nan` and `inf`, as in `repr` and `%`.
    """
    flat, shape = np.ascontiguousarray(values, np.float64).ravel(), values.shape
    with np.errstate(over="ignore", invalid="ignore"):
        data, starts, ends = _shortest(flat) if precision is None else _fixed(flat, precision)
    data[ends] = np.tile(np.frombuffer(separators, np.uint8), len(values))
    return Spans(data, starts.reshape(shape), (ends + 1).reshape(shape))


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


# repr writes an exponent below the first and from the second on; numbers from GREATEST_WHOLE to it are left to repr
_LEAST_PLAIN = 1e-4
_LEAST_POWER = 1e16
_MOST_DIGITS = 17
_MOST_EXPONENT = 330


def _shortest(flat: Floats) -> Spans:
    """Write floats (n,), digit by digit for all at once; those that are not certain by Python."""
    size = np.abs(flat)
    decimals = shortest_decimals(size)
    powered, single = _unusual(size, decimals.unsure)

    # the whole part, the fraction as 17 digits, and the zeros before these; the whole part is never rounded up: an
    # integer in reach would be the float itself
    digits, places = decimals.digits, decimals.places
    whole = size.astype(np.int64)
    fraction = digits - whole * TENS.take(places, mode="clip")
    fraction *= TENS.take(_MOST_DIGITS - places, mode="clip")
    zeros = np.maximum(places - _MOST_DIGITS, 0)
    # with an exponent there is one digit before the point
    digits, places = digits[powered], places[powered]
    behind = count_digits(digits) - 1
    scale = TENS.take(behind)
    whole[powered] = first = digits // scale
    fraction[powered] = (digits - first * scale) * TENS.take(_MOST_DIGITS - behind)
    zeros[powered] = 0
    whole[single] = fraction[single] = zeros[single] = 0

    fields = Fields(len(flat))
    fields.write_whole(whole)
    shown = significant_digits(fields.write_fraction(fraction, _MOST_DIGITS))
    starts = fields.whole_starts(whole)
    ends = fields.origins + (POINT + 1) + np.maximum(shown, 1)
    small = np.flatnonzero(zeros)
    fields.words[small, 1] = _small_prefixes().take(zeros[small])
    starts[small] -= zeros[small]
    starts = fields.write_sign(starts, np.signbit(flat))

    # exponents overwrite the point and the 0 after it if nothing else follows
    rows, lengths = _exponent_texts()
    begins, exponents = ends[powered], behind - places + _MOST_EXPONENT
    is_whole = (begins == fields.origins[powered] + POINT + 2) & (fields.data[begins - 1] == ord("0"))
    begins -= 2 * is_whole
    texts = rows[exponents]
    for offset in range(texts.shape[1]):
        fields.data[begins + offset] = texts[:, offset]
    ends[powered] = begins + lengths[exponents]
    return replaced(Spans(fields.data, starts, ends), single, [repr(value) for value in flat[single].tolist()])


def _unusual(size: Floats, unsure: Ints) -> tuple[Ints, Ints]:
    """Return the indices of numbers written with an exponent, and those left to Python."""
    single = unsure[size[unsure] != 0]
    inner = size[size != 0] if not size.all() else size
    if inner.min(initial=1) >= _LEAST_PLAIN and inner.max(initial=1) < GREATEST_WHOLE:
        return np.empty(0, np.int64), single
    powered = ((size < _LEAST_PLAIN) & (size > 0)) | (size >= _LEAST_POWER)
    by_python = (size >= GREATEST_WHOLE) & ~powered
    powered[single] = False
    by_python[single] = True
    return np.flatnonzero(powered), np.flatnonzero(by_python)


@cache
def _small_prefixes() -> Words:
    """Return a table of the word before the first significant digit: `0.`, `0.0`, `0.00`, .."""
    texts = [("0." + "0" * zeros).rjust(8) for zeros in range(6)]
    return np.frombuffer("".join(texts).encode(), "<u8")


@cache
def _exponent_texts() -> tuple[Bytes, Ints]:
    """Return a table of `e-330` .. `e+330` as rows of five bytes, with their lengths."""
    texts = [f"e{exponent:+03d}" for exponent in range(-_MOST_EXPONENT, _MOST_EXPONENT + 1)]
    rows = np.frombuffer("".join(text.ljust(5) for text in texts).encode(), np.uint8).reshape(-1, 5)
    return rows, np.array([len(text) for text in texts])


_DIGITS = (6, 7, 8, 9)  # neighbouring floats always differ in six digits, nine always identify them
_LEAST, _GREATEST = 1e-12, 1e20  # between them the power of ten is exact


def rounded_to_single(values: Floats) -> Floats:
    """Return the doubles with the fewest digits that are the same floats of 32 bits.

    values: any shape; each is rounded to 32 bits first.  Their shortest text as doubles is then the shortest text
    that a 32-bit reader takes for the same float.  Values that are not finite are unchanged.
    """
    single = values.astype(np.float32)
    exact = single.astype(np.float64).ravel()
    size = np.abs(exact)
    found = exact.copy()
    usual = np.flatnonzero((size >= _LEAST) & (size < _GREATEST))
    wanted = exact[usual]
    exponents = np.floor(np.log10(size[usual])).astype(np.int64)
    for digits in _DIGITS:
        places = digits - 1 - exponents
        up, down = 10.0 ** np.maximum(places, 0), 10.0 ** np.maximum(-places, 0)
        tried = np.rint(wanted * up / down) * down / up
        same = tried.astype(np.float32) == wanted.astype(np.float32)
        found[usual[same]] = tried[same]
        usual, wanted, exponents = usual[~same], wanted[~same], exponents[~same]
        if not usual.size:
            break
    unusual = np.flatnonzero(np.isfinite(exact) & (size > 0) & ((size < _LEAST) | (size >= _GREATEST)))
    found[unusual] = [float(str(value)) for value in single.ravel()[unusual]]
    return found.reshape(values.shape)


# below this every scaled value and its nearest integer are exact
_GREATEST_SCALED = 9e15
# a product is off by half an ulp of itself; twice that is safe
_DOUBT = 2.0**-52
_MOST_DECIMALS = 15


def _fixed(flat: Floats, precision: int) -> Spans:
    """Write floats (n,); large ones, and those with more decimals than can be exact, by Python."""
    decimals = min(precision, _MOST_DECIMALS)
    limit = min(_GREATEST_SCALED, GREATEST_WHOLE * 10.0**decimals)
    size = np.abs(flat)
    by_python = np.arange(len(size)) if precision > decimals else np.flatnonzero(~(size * 10.0**precision < limit))
    size[by_python] = 0.0
    numbers = _scaled(size, decimals)
    fields = Fields(len(numbers))
    whole = numbers // 10**decimals if decimals else numbers
    fields.write_whole(whole)
    if decimals:
        fields.write_fraction(numbers - whole * 10**decimals, decimals)
    starts = fields.write_sign(fields.whole_starts(whole), np.signbit(flat) & (numbers != 0))
    spans = Spans(fields.data, starts, fields.origins + (POINT + 1 + decimals if decimals else POINT))
    return replaced(spans, by_python, [f"{value:z.{precision}f}" for value in flat[by_python].tolist()])


def _scaled(size: Floats, precision: int) -> Ints:
    """Return the integers nearest to size * 10**precision, exactly; an exact half goes to the even one."""
    power = 10.0**precision
    product = size * power
    nearest = np.rint(product)
    numbers = nearest.astype(np.int64)
    doubt = np.abs(product - nearest)
    doubt += product * _DOUBT
    near_half = np.flatnonzero(doubt >= 0.5)
    if near_half.size:  # the exact product is the rounded one and its error
        size, product = size[near_half], product[near_half]
        error = product_error(halves(size), halves(np.full_like(size, power)), product)
        floor = np.floor(product)
        excess = (product - floor - 0.5) + error
        below: Ints = floor.astype(np.int64)
        below += (excess > 0) | ((excess == 0) & (below % 2 == 1))
        numbers[near_half] = below
    return numbers
