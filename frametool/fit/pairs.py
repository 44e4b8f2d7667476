"""Which pose of an estimate belongs to which of the reference: at common stamps, or the nearest ones."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.types import Array

GAP = 3  # median intervals that may lie between two neighbours which are interpolated


class Pairs(NamedTuple):
    """Poses of the reference and of the estimate, one each, at the stamps of the reference's clock.

    possible: how many there could be: poses of the walked trajectory within the time of the other
    shared: how many poses of one trajectory have more than one partner
    interpolated: "ref", "est" or None; max_gap_s: how far its neighbours may be apart
    """

    ref: Trajectory
    est: Trajectory
    possible: int
    shared: int = 0
    interpolated: str | None = None
    max_gap_s: float | None = None

    def at(self, index: Array | slice) -> Pairs:
        """Choose pairs as numpy does."""
        return self._replace(ref=self.ref.at(index), est=self.est.at(index))


def by_number(ref: Trajectory, est: Trajectory) -> Pairs:
    """Pair two trajectories without stamps, pose by pose."""
    count = min(ref.size, est.size)
    return Pairs(ref.at(slice(count)), est.at(slice(count)), est.size)


def interpolated(ref: Trajectory, est: Trajectory, max_gap_ns: float | None = None) -> Pairs:
    """Pair the stamps of one with poses between two of the other, the denser one: straight line and slerp.

    Never beyond its ends, nor where its neighbours are more than a gap apart; an equal stamp needs none.
    """
    walks_est = interval(ref.stamps_ns) <= interval(est.stamps_ns)
    walked, dense = (est, ref) if walks_est else (ref, est)
    gap_ns = GAP * interval(dense.stamps_ns) if max_gap_ns is None else max_gap_ns
    made, has_partner = between(dense, walked.stamps_ns, gap_ns)
    kept = walked.at(has_partner)
    sides = (made, kept) if walks_est else (kept, made)
    possible = est.size if walks_est else _inside(ref.stamps_ns, est.stamps_ns)
    name = "ref" if walks_est else "est"
    return Pairs(*sides, possible, 0, name, gap_ns / 1e9 if isfinite(gap_ns) else None)


def between(dense: Trajectory, stamps_ns: Array, max_gap_ns: float) -> tuple[Trajectory, Array]:
    """Return poses at the stamps that lie between neighbours of a trajectory, and which stamps those are."""
    own = dense.stamps_ns
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


def nearest(ref: Trajectory, est: Trajectory, max_diff_ns: float) -> Pairs:
    """Pair each pose of the shorter one with that of the nearest stamp of the other, of two the earlier."""
    walks_est = est.size <= ref.size
    walked, other = (est, ref) if walks_est else (ref, est)
    after = np.searchsorted(other.stamps_ns, walked.stamps_ns).clip(1 if other.size > 1 else 0, other.size - 1)
    before = (after - 1).clip(0)
    from_before = walked.stamps_ns - other.stamps_ns[before]
    index = np.where(from_before <= other.stamps_ns[after] - walked.stamps_ns, before, after)
    close = np.abs(other.stamps_ns[index] - walked.stamps_ns) <= max_diff_ns
    index = index[close]
    sides = (other.at(index), walked.at(close)) if walks_est else (walked.at(close), other.at(index))
    possible = est.size if walks_est else _inside(ref.stamps_ns, est.stamps_ns)
    return Pairs(*sides, possible, len(index) - len(np.unique(index)))


def interval(stamps_ns: Array) -> float:
    """Return the median time from one stamp to the next; of a single one endless."""
    return float(np.median(np.diff(stamps_ns))) if len(stamps_ns) > 1 else float("inf")


def _inside(stamps_ns: Array, span: Array) -> int:
    return int(np.count_nonzero((span[0] <= stamps_ns) & (stamps_ns <= span[-1])))
