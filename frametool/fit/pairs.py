"""Which pose of an estimate belongs to which of the reference: at common stamps, or the nearest ones.

Also which pose of a gripper belongs to which of a target.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.frames.trajectory import BODY, WORLD
from frametool.stream.samples import HandEyeSamples

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.types import Array

GAP = 3  # median intervals that may lie between two neighbours which are interpolated
NEAR_NS = 50_000_000  # between stamps of a gripper and a target that are paired


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
    other = other.at(np.argsort(other.stamps_ns, kind="stable"))
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
    return int(np.count_nonzero((span.min() <= stamps_ns) & (stamps_ns <= span.max())))


def paired_samples(
    gripper: Trajectory, target: Trajectory, files: tuple[str, str], max_gap_ns: int | None
) -> HandEyeSamples:
    """Pair poses: the gripper's at the target's stamps, or row by row where not both have stamps.

    Between two that are no more than a gap apart it is interpolated, else the nearest within the gap is taken.
    Raises ValueInvalid where there are as many as nothing pairs.
    """
    names = [name if each.world != WORLD or each.body != BODY else None
             for each in (gripper, target) for name in (each.world, each.body)]  # fmt: skip
    for each, file in ((gripper, files[0]), (target, files[1])):
        if each.xyzw is None:
            raise ValueInvalid(f"{file}: positions alone are no poses: rotations are needed here")
    if gripper.stamps_ns is None or target.stamps_ns is None:
        if gripper.size != target.size:
            counts = f"{files[0]} has {gripper.size} poses, {files[1]} {target.size}"
            raise ValueInvalid(f"{counts}, and no stamps to pair them")
        places = _places(files[1], target, range(target.size))
        return HandEyeSamples(gripper.poses, target.poses, places, tuple(names), files)
    gap_ns, dense = NEAR_NS if max_gap_ns is None else max_gap_ns, gripper.in_order()
    made, is_between = between(dense, target.stamps_ns, gap_ns)
    index = np.searchsorted(dense.stamps_ns, target.stamps_ns).clip(1, max(dense.size - 1, 1))
    off = np.abs(dense.stamps_ns[[index - 1, index.clip(0, dense.size - 1)]] - target.stamps_ns)
    nearest, near = np.where(off[0] <= off[1], index - 1, index.clip(0, dense.size - 1)), off.min(0) <= gap_ns
    chosen = dense.at(nearest)
    chosen.xyz[is_between], chosen.xyzw[is_between] = made.xyz, made.xyzw
    kept = np.flatnonzero(is_between | near)
    gap = f"{gap_ns / 1e6:g} ms"
    if not len(kept):
        apart = f"their stamps are {float(off.min()) / 1e9:.3f} s apart at least; one clock? --max-gap"
        raise ValueInvalid(f"no pose of {files[0]} is within {gap} of one of {files[1]}: {apart}")
    told = []
    if alone := target.size - len(kept):
        told = [f"{files[1]}: {alone} of {target.size} poses have none of {files[0]} within {gap}: unpaired"]
    sides = chosen.at(kept).poses, target.at(kept).poses
    return HandEyeSamples(*sides, _places(files[1], target.at(kept), kept.tolist()), tuple(names), files, "", told)


def _places(file: str, each: Trajectory, rows: Sequence[int]) -> list[str]:
    """Name where poses stand: by line, or by row where there are none."""
    if each.lines is None:
        return [f"{file} row {row + 1}" for row in rows]
    return [f"{file}:{line}" for line in each.lines.tolist()]
