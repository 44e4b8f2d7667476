"""A trajectory at other moments: at a rate, at given stamps, or at even steps of its path or its turning."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.pairs import GAP, between, interval

if TYPE_CHECKING:
    from frametool.fit.comparison import Delta
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.types import Array

MOST = 100_000_000  # poses
BILLION = 10**9


def resampled(each: Trajectory, stamps_ns: Array, max_gap_ns: float | None = None) -> Trajectory:
    """Return a trajectory at stamps that lie within it: straight line and slerp, as pairs are interpolated.

    Stamps between poses that are more than a gap apart, 3 median intervals if none is said, have no pose.
    """
    return between(each, stamps_ns, GAP * interval(each.stamps_ns) if max_gap_ns is None else max_gap_ns)[0]


def stamps_at_rate(each: Trajectory, rate_hz: float) -> Array:
    """Return stamps from the first pose on, so many a second, each rounded by itself."""
    first, last = int(each.stamps_ns[0]), int(each.stamps_ns[-1])
    count = int((last - first) * rate_hz / BILLION * (1 + 1e-12)) + 1
    if count > MOST:
        raise ValueInvalid(f"{count} poses are more than {MOST}; give a lower rate")
    stamps: Array = first + np.rint(np.arange(count) * (BILLION / rate_hz)).astype(np.int64)
    return stamps[stamps <= last]


def stamps_every(each: Trajectory, delta: Delta) -> Array:
    """Return the stamps at which a trajectory is a whole number of steps along its path, or its turning."""
    along = delta.along(each)
    if along is None:
        raise ValueInvalid(f"steps of {delta} need rotations")
    count = int(along[-1] / delta.amount * (1 + 1e-12)) + 1
    if count > MOST:
        raise ValueInvalid(f"{count} poses are more than {MOST}; give longer steps")
    wanted = np.minimum(np.arange(count) * delta.amount, along[-1])
    after = np.searchsorted(along, wanted).clip(1, len(along) - 1)
    step = along[after] - along[after - 1]
    part = np.divide(wanted - along[after - 1], step, out=np.zeros(count), where=step > 0.0)
    gaps = each.stamps_ns[after] - each.stamps_ns[after - 1]
    stamps: Array = each.stamps_ns[after - 1] + np.rint(part * gaps).astype(np.int64)
    return stamps
