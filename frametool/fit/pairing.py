"""Pairs of poses of two trajectories, at common stamps or the nearest ones; and the stamps to resample one at."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.least_squares import require_near
from frametool.frames.stamps import BILLION

if TYPE_CHECKING:
    from frametool.fit.trajectory_errors import Delta
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry import Array, Indices
    from frametool.geometry.transform import Transform

GAP = 3  # median intervals between two neighbours that may be interpolated


class Pairs(NamedTuple):
    """Paired poses of the reference and of the estimate, at the stamps of the reference's clock.

    possible: the possible number of pairs: poses of the sampled trajectory within the time of the other
    shared: the number of poses of one trajectory with more than one partner
    interpolated: "ref", "est" or None; max_gap_s: the maximum interval for interpolation
    offset_ns: what was added to the estimate's stamps; offset_score: of an estimated one
    mount: by which the estimate's poses were multiplied
    """

    ref: Trajectory
    est: Trajectory
    possible: int
    shared: int = 0
    interpolated: str | None = None
    max_gap_s: float | None = None
    offset_ns: int = 0
    offset_score: float | None = None
    mount: Transform | None = None

    def at(self, index: Array | slice) -> Pairs:
        """Select pairs as numpy does."""
        return self._replace(ref=self.ref.at(index), est=self.est.at(index))


def paired(
    ref: Trajectory, est: Trajectory, max_gap_ns: float | None = None, max_diff_ns: float | None = None
) -> Pairs:
    """Pair the stamps of one trajectory with interpolated poses of the other, the denser one: linear and slerp.

    Never beyond its ends, nor in gaps longer than the maximum; equal stamps need no interpolation.
    max_diff_ns: pair each pose of the shorter one with the nearest stamp of the other instead, the earlier one of a tie
    Poses without stamps are paired by index.
    """
    if ref.stamps_ns is None or est.stamps_ns is None:
        count = slice(min(ref.size, est.size))
        return Pairs(ref.at(count), est.at(count), est.size)
    walks_est = est.size <= ref.size
    if max_diff_ns is None:
        walks_est = interval(ref.stamps_ns) <= interval(est.stamps_ns)
    walked, other = (est, ref) if walks_est else (ref, est)
    shared, name, gap_s = 0, None, None
    if max_diff_ns is None:
        gap_ns = GAP * interval(other.stamps_ns) if max_gap_ns is None else max_gap_ns
        made, has_partner = between(other, walked.stamps_ns, gap_ns)
        kept = walked if has_partner.all() else walked.at(has_partner)
        name, gap_s = "ref" if walks_est else "est", gap_ns / 1e9 if isfinite(gap_ns) else None
    else:
        other = other.at(np.argsort(other.stamps_ns, kind="stable"))
        index, off = nearest(other.stamps_ns, walked.stamps_ns)
        index, kept = index[off <= max_diff_ns], walked.at(off <= max_diff_ns)
        made, shared = other.at(index), len(index) - len(np.unique(index))
    is_inside = (est.stamps_ns.min() <= ref.stamps_ns) & (ref.stamps_ns <= est.stamps_ns.max())
    possible = est.size if walks_est else int(np.count_nonzero(is_inside))
    return Pairs(*((made, kept) if walks_est else (kept, made)), possible, shared, name, gap_s)


def between(dense: Trajectory, stamps_ns: Array, max_gap_ns: float | None = None) -> tuple[Trajectory, Array]:
    """Return poses at the stamps within a trajectory and not in a gap, and the mask of these stamps.

    Interpolated linearly and by slerp; by default a gap is longer than 3 median intervals.
    """
    own = dense.stamps_ns
    max_gap_ns = GAP * interval(own) if max_gap_ns is None else max_gap_ns
    after = np.searchsorted(own, stamps_ns).clip(0, len(own) - 1)
    before = np.where(own[after] == stamps_ns, after, (after - 1).clip(0))
    gap = own[after] - own[before]
    found = (own[before] <= stamps_ns) & (stamps_ns <= own[after]) & (gap <= max_gap_ns)
    after, before, gap, at = after[found], before[found], gap[found], stamps_ns[found]
    fraction = (at - own[before]) / np.maximum(gap, 1)
    start, end = dense.at(before), dense.at(after)
    if start.xyzw is None:
        xyz = start.xyz + fraction[:, None] * (end.xyz - start.xyz)
        return start._replace(stamps_ns=at, xyz=xyz), found
    return start.with_poses(start.poses.interpolate(end.poses, fraction))._replace(stamps_ns=at), found


def nearest(own: Array, stamps_ns: Array) -> tuple[Indices, Array]:
    """Return the index of the nearest of some sorted stamps, the earlier one of a tie, and how far off it is."""
    after = np.searchsorted(own, stamps_ns).clip(0, len(own) - 1)
    before = (after - 1).clip(0)
    index = np.where(stamps_ns - own[before] <= np.abs(own[after] - stamps_ns), before, after)
    return index, np.abs(own[index] - stamps_ns)


def interval(stamps_ns: Array) -> float:
    """Return the median interval between stamps; infinite for a single one."""
    return float(np.median(np.diff(stamps_ns))) if len(stamps_ns) > 1 else float("inf")


MOST = 100_000_000  # poses


def stamps_at_rate(each: Trajectory, rate_hz: float) -> Array:
    """Return stamps from the first pose on at a rate, each rounded independently."""
    first, last = int(each.stamps_ns[0]), int(each.stamps_ns[-1])
    count = _count((last - first) * rate_hz / BILLION)
    stamps: Array = first + np.rint(np.arange(count) * (BILLION / rate_hz)).astype(np.int64)
    return stamps[stamps <= last]


def _count(steps: float) -> int:
    """Return the number of poses at whole steps."""
    count = int(steps * (1 + 1e-12)) + 1
    if count > MOST:
        raise ValueInvalid(f"{count} poses are more than {MOST}; give a lower rate or longer steps")
    return count


def stamps_every(each: Trajectory, delta: Delta) -> Array:
    """Return the stamps at which a trajectory has covered whole multiples of a step of path or rotation."""
    require_near(each.xyz, each.body)
    along = delta.along(each)
    if along is None:
        raise ValueInvalid(f"steps of {delta} need rotations")
    count = _count(along[-1] / delta.amount)
    wanted = np.minimum(np.arange(count) * delta.amount, along[-1])
    after = np.searchsorted(along, wanted).clip(1, len(along) - 1)
    step = along[after] - along[after - 1]
    part = np.divide(wanted - along[after - 1], step, out=np.zeros(count), where=step > 0.0)
    gaps = each.stamps_ns[after] - each.stamps_ns[after - 1]
    stamps: Array = each.stamps_ns[after - 1] + np.rint(part * gaps).astype(np.int64)
    return stamps
