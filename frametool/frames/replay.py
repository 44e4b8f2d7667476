"""A recording played back: the same lookup again and again while its time goes by, as tf2_echo does on a robot."""

from __future__ import annotations

from fractions import Fraction
from itertools import chain, repeat
from math import ceil, floor
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import NoDataAt, ValueInvalid
from frametool.frames.stamps import BILLION, FURTHEST_NS, whole_stamp

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.frames.lookups import Frames
    from frametool.geometry.transform import Transform

HALF = Fraction(1, 2)


class Replayed(NamedTuple):
    """One lookup of a replay.

    at_ns: its time; None if nothing moves
    found: target_from_source, or the error where there is no data
    steps: how many it stands for; all that lie before the data, or after, are one
    """

    at_ns: int | None
    found: Transform | NoDataAt
    steps: int = 1


def replay(
    frames: Frames, target: str, source: str, rate_hz: float, start_ns: int | None, stop_ns: int | None
) -> Iterator[Replayed]:
    """Yield the lookups of a replay; see Frames.replay."""
    period = BILLION / Fraction(checked_rate(rate_hz))
    span = frames.span(target, source)
    if span is None:
        yield Replayed(start_ns, frames.lookup(target, source))
        return
    begin = span[0] if start_ns is None else whole_stamp(start_ns)
    end = span[1] if stop_ns is None else whole_stamp(stop_ns)
    if begin > end:
        frames.lookup(target, source, begin if stop_ns is None else end)  # raises: all the data lie on one side of it
    steps = floor((end - begin + HALF) / period) + 1
    steps -= begin + round((steps - 1) * period) > end
    first = min(max(ceil((span[0] - begin - HALF) / period), 0), steps)
    last = min(max(floor((span[1] - begin + HALF) / period) + 1, first), steps)
    for number, count in chain([(0, first)], zip(range(first, last), repeat(1)), [(last, steps - last)]):
        at_ns = begin + round(number * period)
        try:
            if count:
                yield Replayed(at_ns, frames.lookup(target, source, at_ns), count)
        except NoDataAt as error:
            yield Replayed(at_ns, error, count)


def checked_rate(rate_hz: float) -> float:
    """Return a rate of steps back; raise ValueInvalid unless they are between a nanosecond and a century apart."""
    if not BILLION / FURTHEST_NS <= rate_hz <= BILLION:
        raise ValueInvalid(f"a rate of {rate_hz:g} Hz has no steps between 1 ns and {FURTHEST_NS // BILLION} s")
    return rate_hz
