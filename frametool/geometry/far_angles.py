"""The reduction of angles of more than a million turns, in whole numbers of as many bits as it takes."""

from __future__ import annotations

from functools import cache
from math import isfinite, nan

SPARE = 128  # bits behind the point: 64 for the result, 64 for what a double may lie close to a quarter turn


def reduced_exactly(x: float) -> tuple[float, float]:
    """Return what is left of an angle less the nearest whole number of quarter turns, rounded once, and its parity."""
    if not isfinite(x):
        return nan, 0.0
    above, below = x.as_integer_ratio()
    bits = SPARE + -(-above.bit_length() // 64) * 64
    quarter_turn = _pi(bits) >> 1
    turns, rest = divmod((above << bits) // below + quarter_turn // 2, quarter_turn)
    return (rest - quarter_turn // 2) / (1 << bits), float(turns & 1)


@cache
def _pi(bits: int) -> int:
    """Return pi times 2^bits, by Machin's 16 arccot 5 - 4 arccot 239 (1706)."""
    one = 1 << (bits + 32)
    return (16 * _arccot(5, one) - 4 * _arccot(239, one)) >> 32


def _arccot(x: int, one: int) -> int:
    """Return arccot x times one, by the series of the arc tangent of 1/x."""
    power = total = one // x
    divisor = 1
    while power:
        power //= -x * x
        divisor += 2
        total += power // divisor
    return total
