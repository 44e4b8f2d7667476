"""A recording played back: the same lookup again and again while its time goes by, as tf2_echo does on a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import NoDataAt, ValueInvalid
from frametool.frames.stamps import BILLION, FURTHEST_NS, whole_stamp

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.frames.lookups import Frames
    from frametool.geometry.transform import Transform


def replay(
    frames: Frames, target: str, source: str, rate_hz: float, start_ns: int | None, stop_ns: int | None
) -> Iterator[tuple[int | None, Transform | NoDataAt]]:
    """Yield each time with its answer, or with the error where there is no data; see Frames.replay."""
    for at_ns in replay_times(frames, target, source, rate_hz, start_ns, stop_ns):
        try:
            yield at_ns, frames.lookup(target, source, at_ns)
        except NoDataAt as error:
            yield at_ns, error


def replay_times(
    frames: Frames, target: str, source: str, rate_hz: float, start_ns: int | None, stop_ns: int | None
) -> Iterator[int | None]:
    """Yield the times of a replay: `rate_hz` a second from start to stop; only the start if nothing moves."""
    if not BILLION / FURTHEST_NS <= rate_hz <= BILLION:
        raise ValueInvalid(f"a rate of {rate_hz:g} Hz has no steps between 1 ns and {FURTHEST_NS // BILLION} s")
    span = frames.span(target, source)
    if span is None:
        yield start_ns
        return
    begin = span[0] if start_ns is None else whole_stamp(start_ns)
    end = span[1] if stop_ns is None else whole_stamp(stop_ns)
    if begin > end:
        frames.lookup(target, source, begin if stop_ns is None else end)  # raises: all the data lie on one side of it
    count = 0
    while (at_ns := begin + round(count * BILLION / rate_hz)) <= end:
        yield at_ns
        count += 1
