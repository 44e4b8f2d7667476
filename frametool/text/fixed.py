"""Floats to text with a fixed number of decimals, in bulk, byte for byte as `'%.{precision}f'` writes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.text.fields import GREATEST_WHOLE, POINT, Fields, replaced, written
from frametool.text.powers import halves, product_error
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from frametool.text.array_types import Flags, Floats, Ints

# Below this every scaled value and its nearest integer are exact.
_GREATEST_SCALED = 9e15
# A product is off by half an ulp of itself; twice that is safe.
_DOUBT = 2.0**-52
_MOST_DECIMALS = 15


def fixed_spans(values: Floats, precision: int, separators: bytes) -> Spans:
    """Write rows of floats with so many decimals, as spans (n, c), each with its separator.

    values: (n, c); separators: c bytes, the one that follows each column.
    Nan and infinity become `nan` and `inf`, as in `%`.
    """
    return written(values, separators, lambda flat: _all_spans(flat, precision))


def _all_spans(flat: Floats, precision: int) -> Spans:
    limit = min(_GREATEST_SCALED, GREATEST_WHOLE * 10.0 ** min(precision, _MOST_DECIMALS))
    size = np.abs(flat)
    slow = _slow_places(size, precision, limit)
    if slow.size:
        size[slow] = 0.0
    spans = _write(_scaled(size, min(precision, _MOST_DECIMALS)), np.signbit(flat), min(precision, _MOST_DECIMALS))
    return replaced(spans, slow, [f"{value:.{precision}f}" for value in flat[slow].tolist()])


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


def _write(numbers: Ints, negative: Flags, precision: int) -> Spans:
    fields = Fields(len(numbers))
    whole = numbers // 10**precision if precision else numbers
    fields.write_whole(whole)
    if precision:
        fields.write_fraction(numbers - whole * 10**precision, precision)
    starts = fields.write_sign(fields.whole_starts(whole), negative)
    length = POINT + 1 + precision if precision else POINT
    return Spans(fields.data, starts, fields.origins + length)
