"""Floats to text in bulk: the shortest that reads back the same, or a fixed number of decimals.

The same bytes as `repr` and `{:z.{precision}f}`; for floats of 32 bits the shortest text that reads back to them.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.text.decimals import GREATEST_WHOLE, POINT, Decimals, Fields, replaced, shortest_decimals, written
from frametool.text.digits import TENS, count_digits, halves, product_error, significant_digits
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from frametool.text.spans import Bytes, Flags, Floats, Ints, Words

# repr writes an exponent below the first and from the second on; Python writes numbers between GREATEST_WHOLE and it
_LEAST_PLAIN = 1e-4
_LEAST_POWER = 1e16
_MOST_DIGITS = 17
_MOST_EXPONENT = 330


class _Parts(NamedTuple):
    """A number's whole part, its fraction as 17 digits, and the zeros before these."""

    whole: Ints
    fraction: Ints
    zeros: Ints


def shortest_spans(values: Floats, separators: bytes) -> Spans:
    """Write rows of floats as spans (n, c), each with its separator.

    values: (n, c); separators: c bytes, the one that follows each column.
    Nan and infinity become `nan` and `inf`, as in `repr`.
    """
    return written(values, separators, _all_spans)


def _all_spans(flat: Floats) -> Spans:
    size = np.abs(flat)
    decimals = shortest_decimals(size)
    powered, single = _unusual(size, decimals.unsure)
    parts = _plain_parts(size, decimals)
    exponents = _power_parts(parts, decimals, powered)
    for part in parts:
        part[single] = 0
    fields = Fields(len(flat))
    starts, ends = _write(fields, parts)
    starts = fields.write_sign(starts, np.signbit(flat))
    _write_exponents(fields, ends, powered, exponents)
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


def _plain_parts(size: Floats, decimals: Decimals) -> _Parts:
    """Split numbers at the point. A whole part is never rounded up: an integer in reach would be the float itself."""
    whole = size.astype(np.int64)
    digits, places = decimals.digits, decimals.places
    fraction = digits - whole * TENS.take(places, mode="clip")
    fraction *= TENS.take(_MOST_DIGITS - places, mode="clip")
    zeros = np.maximum(places - _MOST_DIGITS, 0)
    return _Parts(whole, fraction, zeros)


def _power_parts(parts: _Parts, decimals: Decimals, powered: Ints) -> Ints:
    """Convert numbers with an exponent to one digit before the point; return their exponents."""
    digits, places = decimals.digits[powered], decimals.places[powered]
    behind = count_digits(digits) - 1
    scale = TENS.take(behind)
    whole = digits // scale
    parts.whole[powered] = whole
    parts.fraction[powered] = (digits - whole * scale) * TENS.take(_MOST_DIGITS - behind)
    parts.zeros[powered] = 0
    return behind - places


def _write(fields: Fields, parts: _Parts) -> tuple[Ints, Ints]:
    """Write all parts; return the start of each number, without its sign, and its end."""
    fields.write_whole(parts.whole)
    shown = significant_digits(fields.write_fraction(parts.fraction, _MOST_DIGITS))
    starts = fields.whole_starts(parts.whole)
    ends = fields.origins + (POINT + 1) + np.maximum(shown, 1)
    small = np.flatnonzero(parts.zeros)
    fields.words[small, 1] = _small_prefixes().take(parts.zeros[small])
    starts[small] -= parts.zeros[small]
    return starts, ends


def _write_exponents(fields: Fields, ends: Ints, powered: Ints, exponents: Ints) -> None:
    """Append the exponents to their numbers; they overwrite the point and the 0 after it if nothing else follows."""
    rows, lengths = _exponent_texts()
    begins = ends[powered]
    is_whole = (begins == fields.origins[powered] + POINT + 2) & (fields.data[begins - 1] == ord("0"))
    begins -= 2 * is_whole
    texts = rows[exponents + _MOST_EXPONENT]
    for offset in range(texts.shape[1]):
        fields.data[begins + offset] = texts[:, offset]
    ends[powered] = begins + lengths[exponents + _MOST_EXPONENT]


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


def fixed_spans(values: Floats, precision: int, separators: bytes) -> Spans:
    """Write rows of floats with a fixed number of decimals, as spans (n, c), each with its separator.

    values: (n, c); separators: c bytes, the one that follows each column.
    Nan and infinity become `nan` and `inf`, as in `%`.
    """
    return written(values, separators, lambda flat: _fixed_spans(flat, precision))


def _fixed_spans(flat: Floats, precision: int) -> Spans:
    limit = min(_GREATEST_SCALED, GREATEST_WHOLE * 10.0 ** min(precision, _MOST_DECIMALS))
    size = np.abs(flat)
    slow = _slow_places(size, precision, limit)
    if slow.size:
        size[slow] = 0.0
    decimals = min(precision, _MOST_DECIMALS)
    numbers = _scaled(size, decimals)
    spans = _write_fixed(numbers, np.signbit(flat) & (numbers != 0), decimals)
    return replaced(spans, slow, [f"{value:z.{precision}f}" for value in flat[slow].tolist()])


def _slow_places(size: Floats, precision: int, limit: float) -> Ints:
    if precision > _MOST_DECIMALS:
        return np.arange(len(size))
    ordinary = size * 10.0**precision < limit
    return np.empty(0, np.int64) if ordinary.all() else np.flatnonzero(~ordinary)


def _scaled(size: Floats, precision: int) -> Ints:
    """Return the integers nearest to size * 10**precision, exactly; an exact half goes to the even one."""
    power = 10.0**precision
    product = size * power
    nearest = np.rint(product)
    numbers = nearest.astype(np.int64)
    doubt = np.abs(product - nearest)
    doubt += product * _DOUBT
    near_half = np.flatnonzero(doubt >= 0.5)
    if near_half.size:
        numbers[near_half] = _round_exactly(size[near_half], product[near_half], power)
    return numbers


def _round_exactly(size: Floats, product: Floats, power: float) -> Ints:
    """Round the exact product, which is the rounded one and its error, half to even."""
    error = product_error(halves(size), halves(np.full_like(size, power)), product)
    floor = np.floor(product)
    excess = (product - floor - 0.5) + error
    below: Ints = floor.astype(np.int64)
    below += (excess > 0) | ((excess == 0) & (below % 2 == 1))
    return below


def _write_fixed(numbers: Ints, negative: Flags, precision: int) -> Spans:
    fields = Fields(len(numbers))
    whole = numbers // 10**precision if precision else numbers
    fields.write_whole(whole)
    if precision:
        fields.write_fraction(numbers - whole * 10**precision, precision)
    starts = fields.write_sign(fields.whole_starts(whole), negative)
    length = POINT + 1 + precision if precision else POINT
    return Spans(fields.data, starts, fields.origins + length)
