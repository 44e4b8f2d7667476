"""The mean of poses without those that are wrong."""

from __future__ import annotations

from math import log
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.rigid_arrays import PoseArrays
from frametool.fit.robust import LEAST, draws, lengths, require_near, settled
from frametool.geometry import validation
from frametool.geometry.spread import Spread, mean_and_spread

if TYPE_CHECKING:
    from frametool.fit.robust import Mask
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Array, Numbers

FEWEST_ROBUST = 3  # of two poses nobody knows which is wrong
MOST = 200  # poses that are tried as the middle of the others


class MeanFit(NamedTuple):
    """The mean of the poses kept and how far they lie from it, as `mean_and_spread` returns them.

    used: which were kept; left_out: which were not, though they have a weight; u: how many sigmas each is off
    residuals: [t_i - t, Log(R_i R')], (n, 6); sigma: of each axis of a pose of weight 1, metres and radians
    dof: 3 n - 3 of those used, for each sigma; covariance: of one pose, 6x6 as ROS has it, None of one alone
    """

    transform: Transform
    spread: Spread
    used: Mask
    left_out: Mask
    u: Array
    residuals: Array
    sigma: tuple[float, float]
    dof: int
    covariance: Array | None


def solve_mean(poses: Transform, *, weights: Numbers | None = None, robust: bool = True) -> MeanFit:
    """Return the mean of poses (n,), wrong ones left out; where none is, the bits are those of `mean_and_spread`.

    weights: (n,), in proportion to 1 / variance; a pose of weight 0 counts for nothing
    Raises ValueInvalid where there is no pose, or no mean.
    """
    if len(poses.shape) != 1:
        raise ValueInvalid(f"poses: expected shape (n,), got {poses.shape}")
    require_near(poses.xyz, "poses")
    mass = validation.masses(weights, poses.shape)
    counts = mass > 0.0
    heavy, rows, roots = poses[counts], PoseArrays.of(poses[counts]), np.sqrt(mass[counts])[:, None]

    def mean(kept: Array | Mask) -> tuple[Transform, Spread]:
        chosen = kept > 0.0
        return mean_and_spread(heavy[chosen], None if weights is None else mass[counts][chosen])

    def residuals(middle: Transform) -> Array:
        found: Array = roots * rows.errors(PoseArrays.of(middle))
        return found

    robust = robust and len(heavy) >= FEWEST_ROBUST
    found = settled(
        _middle(heavy, roots) if robust else heavy[0],
        residuals,
        lambda _, first: heavy.mean(first * mass[counts]),
        lambda _, kept: mean(kept)[0],
        unknown=3,
        robust=robust,
    )
    used, count = counts.copy(), int(found.kept.sum())
    used[used] = found.kept
    off = PoseArrays.of(poses).errors(PoseArrays.of(found.model))
    s_t, s_r = map(float, found.sigmas)
    kept = found.residuals[found.kept]
    return MeanFit(
        *mean(found.kept),
        used,
        counts & ~used,
        np.sqrt(mass / 6.0) * np.sqrt(lengths(off) ** 2 @ found.sigmas**-2.0),
        off,
        (s_t, s_r),
        3 * count - 3,
        kept.T @ kept * (count / mass[used].sum() / (count - 1)) if count > 1 else None,
    )


def covariance_of(poses: Transform, mean: Transform, weights: Numbers | None = None) -> Array | None:
    """Return the covariance of one of the poses (n,) whose mean is known, 6x6 as ROS has it; None of one alone."""
    mass = validation.masses(weights, poses.shape)
    count = int((mass > 0.0).sum())
    off = PoseArrays.of(poses).errors(PoseArrays.of(mean)) * np.sqrt(mass)[:, None]
    return off.T @ off * (count / mass.sum() / (count - 1)) if count > 1 else None


def _middle(poses: Transform, roots: Array) -> Transform:
    """Return the pose that the others are nearest to, by the medians of metres and radians."""
    count = len(poses)
    tried = range(count) if count <= MOST else next(draws(1, MOST, count))

    def apart(at: int) -> float:
        return sum(log(max(np.median(roots[:, 0] * off), LEAST)) for off in poses[at].distance(poses))

    return poses[min(tried, key=apart)]
