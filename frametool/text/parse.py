"""Text to floats in bulk, each rounded like Python's `float`; and seconds, as text or as floats, to nanoseconds.

The common cell (a sign, up to eight digits, a point and up to 24 digits) is read in words of eight characters; blanks
around it and an exponent need a second pass. Python's own reader decides if the result is too near to the middle of
two floats, or if the cell is longer or not a number. Source of the exact division: Clinger 1990.
Seconds are those of a float's shortest decimal, not of its last bit: 1700000000.1 is 1700000000100000000 ns.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal

import numpy as np

from frametool.errors import NamedTuple
from frametool.frames.stamps import BILLION, nanoseconds_each, tell_size
from frametool.text import write
from frametool.text.numbers import half_unit
from frametool.text.spans import Bytes, Flags, Floats, Ints, Spans, Words, windows
from frametool.text.write import TENS, ZEROS, halves, not_digits, product_error, read_eight_digits, shortest_decimals

_NUMBER = re.compile(rb"[ \t]*[+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]+)?[ \t]*")
_MOST_WORDS = 3
_EXACT = 1 << 53
# results are accurate to 2**-100; one is certain if the remainder of rounding, times this, does not change it
_DOUBT = 1.0 + 2.0**-30
# with these exponents neither a product nor its error leaves the range of normal floats
_GREATEST_EXPONENT = 240
_MINUS, _PLUS, _SMALL_E = b"-+e"
_LOWER_CASE = 0x20
# masks of the lowest 0 .. 8 bytes of a word
LOWEST = np.array([(1 << 8 * count) - 1 for count in range(9)], np.uint64)


class _Mantissa(NamedTuple):
    """The digits of cells as integers `whole * 10**(8 * words - 8) + tail`; words: of eight digits after the point."""

    whole: Ints
    tail: Ints
    words: int


LONGEST_MEANT = 32  # characters of a cell; those beyond do not matter


def half_units(cells: Spans) -> Floats:
    """Return half a unit of the last written digit of each number (n,), as `half_unit` does for one."""
    starts, ends = trimmed(cells.data, cells.starts, cells.ends)
    texts = windows(cells.data, LONGEST_MEANT)[starts].view(np.uint8).reshape(-1, LONGEST_MEANT)
    inside = np.arange(LONGEST_MEANT) < (ends - starts)[:, None]
    points = (texts == ord(".")) & inside
    decimals = ends - starts - 1 - points.argmax(axis=1)
    found = np.where(points.any(axis=1) & (decimals > 0), 0.5 * 10.0 ** -np.minimum(decimals, 300).astype(float), 0.0)
    for row in np.flatnonzero((((texts | 32) == ord("e")) & inside).any(axis=1)).tolist():
        found[row] = half_unit(cells.text(row).decode("utf-8", "replace"))
    return found


def parse_floats(cells: Spans) -> tuple[Floats, Ints]:
    """Read cells as floats.

    Accepts plain decimal numbers, `[+-] digits [. digits] [e [+-] digits]`, with blanks or tabs around them;
    neither nan, inf, hexadecimals, underscores nor numbers beyond the range of floats.
    Returns the values, in the cells' shape, nan for invalid cells, and the indices of these in the flattened cells, in
    order.
    """
    starts, ends = cells.starts.ravel(), cells.ends.ravel()
    # if the first cell begins with a blank, nearly all do
    if starts.size and _is_blank(cells.data[starts[:1]])[0]:
        starts, ends = trimmed(cells.data, starts, ends)
    values, sure = _parse_plain(cells.data, starts, ends)
    rest = np.flatnonzero(~sure)
    if rest.size:
        # overflows are uncertain, and read one by one
        with np.errstate(over="ignore", invalid="ignore"):
            values[rest], sure = _parse_decorated(cells.data, starts[rest], ends[rest])
        rest = rest[~sure]
    texts = [cells.data[starts[place] : ends[place]].tobytes() for place in rest.tolist()]
    single = np.array([float(text) if _NUMBER.fullmatch(text) else math.nan for text in texts])  # by Python's reader
    single[np.isinf(single)] = math.nan
    values[rest] = single
    return values.reshape(cells.starts.shape), rest[np.isnan(single)]


def _parse_plain(data: Bytes, starts: Ints, ends: Ints) -> tuple[Floats, Flags]:
    """Read cells without blanks and exponents; return the values and the mask of certain ones."""
    begins, negative = _after_sign(data, starts)
    mantissa, sure = _read_mantissa(data, begins, ends)
    if mantissa.words == 1:
        sure &= mantissa.whole < _EXACT
        values = mantissa.whole / 1e8
    else:
        power, rest = write.power_of_ten(-8 * mantissa.words)
        values = _scale(mantissa, np.array(power), np.array(rest), sure)
    values *= 1.0 - 2.0 * negative
    return values, sure


def _parse_decorated(data: Bytes, starts: Ints, ends: Ints) -> tuple[Floats, Flags]:
    """Read cells with blanks around them or with exponents, as `_parse_plain` does."""
    starts, ends = trimmed(data, starts, ends)
    begins, negative = _after_sign(data, starts)
    ends, exponents, sure = _split_exponent(data, begins, ends)
    mantissa, is_number = _read_mantissa(data, begins, ends)
    sure &= is_number
    places = exponents - 8 * mantissa.words - write.LEAST_POWER
    powers, rests = write.powers_of_ten()
    values = _scale(mantissa, powers.take(places, mode="clip"), rests.take(places, mode="clip"), sure)
    values *= 1.0 - 2.0 * negative
    return values, sure


def _after_sign(data: Bytes, starts: Ints) -> tuple[Ints, Flags]:
    first = data.take(starts)
    negative = first == _MINUS
    return starts + (negative | (first == _PLUS)), negative


def trimmed(data: Bytes, starts: Ints, ends: Ints) -> tuple[Ints, Ints]:
    """Remove the blanks and tabs around cells."""
    while (blank := _is_blank(data.take(starts)) & (starts < ends)).any():
        starts = starts + blank
    while (blank := _is_blank(data.take(ends - 1)) & (starts < ends)).any():
        ends = ends - blank
    return starts, ends


def _is_blank(characters: Bytes) -> Flags:
    blank: Flags = (characters == ord(" ")) | (characters == ord("\t"))
    return blank


def _split_exponent(data: Bytes, starts: Ints, ends: Ints) -> tuple[Ints, Ints, Flags]:
    """Find an `e` followed by up to four characters, and read these.

    Returns the ends of the text before it, the exponents (0 without an e) and which of them are numbers in range.
    """
    stops = ends
    for behind in (2, 3, 4, 5):
        places = ends - behind
        stops = np.where((data.take(places) | _LOWER_CASE == _SMALL_E) & (places > starts), places, stops)
    begins, negative = _after_sign(data, np.minimum(stops + 1, ends))
    length = np.where(stops < ends, ends - begins, 0)
    digits = windows(data, 8)[begins].view("<u8") ^ ZEROS
    digits <<= (8 * (8 - length)).astype(np.uint64)
    numbers = read_eight_digits(digits).astype(np.int64)
    sure = (not_digits(digits) == 0) & (numbers <= _GREATEST_EXPONENT) & ((length > 0) | (stops == ends))
    return stops, np.where(negative, -numbers, numbers), sure


def _read_mantissa(data: Bytes, starts: Ints, ends: Ints) -> tuple[_Mantissa, Flags]:
    """Read unsigned decimals as integers of whole words, and return which of them are certain."""
    characters = windows(data, 8)[starts].view("<u8")
    length = ends - starts
    before = np.minimum(write.first_point(characters), length)
    characters ^= ZEROS
    characters <<= ((8 - before) << 3).astype(np.uint64)
    after = length - before - 1
    most = int(after.max(initial=0))
    words = min(max(-(-most // 8), 1), _MOST_WORDS)
    texts = windows(data, 8 * words)[ends - after].view("<u8").reshape(-1, words)
    fraction = []  # words of digit values; those beyond the cell's end are 0
    for word in range(words):
        kept = LOWEST.take(after - 8 * word, mode="clip")
        kept &= texts[:, word] ^ ZEROS
        fraction.append(kept)
    wrong = not_digits(characters)
    for word in fraction:
        wrong |= not_digits(word)
    sure = (wrong == 0) & (length > (after >= 0)) & ((before < 8) | (length <= 8))
    if most > 8 * words:
        sure &= after <= 8 * words
    whole = read_eight_digits(characters) * np.uint64(10**8) + read_eight_digits(fraction[0])
    tail = np.zeros(1, np.uint64)
    for word_of_tail in fraction[1:]:
        tail = tail * np.uint64(10**8) + read_eight_digits(word_of_tail)
    return _Mantissa(whole.view(np.int64), tail.view(np.int64), words), sure


def _scale(mantissa: _Mantissa, power: Floats, rest: Floats, sure: Flags) -> Floats:
    """Multiply by a power of ten, itself a sum of two floats; clear `sure` where the last bit is uncertain."""
    high, low = _as_two_floats(mantissa)
    product = high * power
    error = product_error(halves(high), halves(power), product)
    error += high * rest
    error += low * power
    values: Floats = product + error
    dropped = error - (values - product)
    dropped *= _DOUBT
    dropped += values
    sure &= dropped == values
    return values


def _as_two_floats(mantissa: _Mantissa) -> tuple[Floats, Floats]:
    """Return the mantissa as the sum of a float and its error."""
    high, low = _split_integer(mantissa.whole)
    if mantissa.words == 1:
        return high, low
    power: Floats = np.array(10.0 ** (8 * mantissa.words - 8))
    tail_high, tail_low = _split_integer(mantissa.tail)
    product = high * power
    error = product_error(halves(high), halves(power), product)
    error += low * power
    total = product + tail_high
    error += (product - total) + tail_high
    error += tail_low
    return total, error


def _split_integer(numbers: Ints) -> tuple[Floats, Floats]:
    high = numbers.astype(np.float64)
    return high, (numbers - high.astype(np.int64)).astype(np.float64)


NINE = 9  # decimals of a second in nanoseconds
MOST = np.iinfo(np.int64).max
FURTHEST = float(MOST // BILLION)  # seconds
_STAMP_WORDS = 3


def nanoseconds_of(seconds: Floats) -> tuple[Ints, Flags]:
    """Return seconds (n,) in whole nanoseconds, and which of them are invalid: not finite, or beyond 64 bits.

    Fractions of a nanosecond are rounded, halves to even.
    """
    size = np.abs(seconds)
    none = ~(size < FURTHEST)
    size[none] = 0.0
    digits, places, unsure = shortest_decimals(size)
    scale = np.abs(NINE - places)
    stamps = digits * TENS.take(scale, mode="clip")
    finer = np.flatnonzero(places > NINE)
    divisor, most = TENS.take(scale[finer], mode="clip"), scale[finer] < len(TENS)
    divided = digits[finer] // divisor
    twice = 2 * (digits[finer] - divided * divisor)
    divided += (twice > divisor) | ((twice == divisor) & (divided % 2 == 1))
    stamps[finer] = np.where(most, divided, 0)
    for row in unsure[size[unsure] != 0.0].tolist():
        stamps[row] = round(Decimal(repr(float(size[row]))) * BILLION)
    stamps[size == 0.0] = 0
    return np.where(seconds < 0.0, -stamps, stamps), none


def parse_stamps(cells: Spans, *, in_ns: int) -> tuple[Ints, Flags]:
    """Read cells (n,) of digits with at most one point as nanoseconds; also return the mask of certain results.

    in_ns: nanoseconds per unit of an integer; 0 for decimal seconds, or the unit that its size implies.  Blanks around
    a cell and `ns` behind it are allowed.
    """
    data, (starts, ends) = cells.data, trimmed(*cells)
    suffixed = (data.take(ends - 1) == ord("s")) & (data.take(ends - 2) == ord("n")) & (ends - starts > 2)
    ends = ends - 2 * suffixed
    characters = windows(data, 8 * _STAMP_WORDS)[starts].view("<u8").reshape(-1, _STAMP_WORDS)
    before = write.first_point(characters[:, -1])
    for word in reversed(range(_STAMP_WORDS - 1)):
        here = write.first_point(characters[:, word])
        before = np.where(here < 8, here, before + 8)
    points = starts + np.minimum(before, ends - starts)  # without a point, the end of the cell
    whole, sure = _read_integer(data, points, points - starts)
    decimals = np.maximum(ends - points - 1, 0)
    digits, fine = _read_integer(data, ends, decimals)
    finer = TENS.take(decimals - NINE, mode="clip")  # fractions of a nanosecond are uncertain unless 0
    below = digits // finer * TENS.take(NINE - decimals, mode="clip")
    sure &= fine & (digits % finer == 0) & (ends - starts <= 8 * _STAMP_WORDS) & (ends - starts > (points < ends))
    is_whole = points == ends
    each = np.where(suffixed, 1, in_ns or np.where(is_whole, nanoseconds_each(whole), BILLION))
    sure &= (is_whole | ~(suffixed | bool(in_ns))) & (whole < MOST // each)
    by_size = np.flatnonzero(sure & (each != BILLION) & ~suffixed) if not in_ns else ()
    for row in by_size[:1]:
        tell_size(int(whole[row]), int(each[row]))
    return whole * each + below, sure


def _read_integer(data: Bytes, ends: Ints, length: Ints) -> tuple[Ints, Flags]:
    """Read `length` digits before `ends`; also return the mask of numbers of only digits, within 63 bits."""
    characters = windows(data, 8 * _STAMP_WORDS)[ends - 8 * _STAMP_WORDS].view("<u8").reshape(-1, _STAMP_WORDS)
    words, wrong = [], np.zeros(len(ends), np.uint64)
    for word in range(_STAMP_WORDS):
        digits = characters[:, word] ^ ZEROS
        digits &= ~LOWEST.take(8 * (_STAMP_WORDS - word) - length, mode="clip")
        wrong |= not_digits(digits)
        words.append(read_eight_digits(digits))
    upper, middle, lower = words
    total: Words = (upper * np.uint64(10**8) + middle) * np.uint64(10**8) + lower
    return total.view(np.int64), (wrong == 0) & (upper < (1 << 63) // 10**16)
