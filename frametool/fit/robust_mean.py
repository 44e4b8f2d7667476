"""The mean of poses, with outliers rejected."""

from __future__ import annotations

from math import log
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit import least_squares as lsq
from frametool.geometry import validation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.fit.least_squares import Mask
    from frametool.geometry import Array, Numbers
    from frametool.geometry.transform import Transform

FEWEST = 3  # poses for outlier rejection: of two that disagree neither is the outlier
MOST_TRIED = 200  # poses that are tried as the start of the fit
LEAST_GAP = 1e-9  # between the two largest eigenvalues, relative to their sum


class MeanFit(NamedTuple):
    """The mean of the inliers and their distances from it.

    rms, most: the weighted root mean square and the largest distance of the inliers, metres and radians
    used: the inliers; left_out: the outliers, without the poses of weight 0; u: the residual of each in sigmas
    residuals: [t_i - t, Log(R_i R')], (n, 6); sigma: of each axis of a pose of weight 1, metres and radians
    dof: 3 n - 3 of the inliers, for each sigma; covariance: of one pose, 6x6 as in ROS, None for a single pose
    """

    transform: Transform
    rms: tuple[float, float]
    most: tuple[float, float]
    used: Mask
    left_out: Mask
    u: Array
    residuals: Array
    sigma: tuple[float, float]
    dof: int
    covariance: Array | None


def solve_mean(
    poses: Transform | Numbers | Sequence[Transform], *, weights: Numbers | None = None, robust: bool = True
) -> MeanFit:
    """Return the mean of poses, transforms or matrices (n, 4, 4); outliers are rejected.

    weights: (n,), proportional to 1 / variance; a pose of weight 0 is ignored
    Without outliers exactly the mean of `Transform.mean`.
    Raises ValueInvalid if there is no pose, and if the rotations are so different that they have no mean.
    """
    poses = lsq.batch_of(poses, "poses")
    mass = validation.masses(weights, poses.shape)
    counts, roots = mass > 0.0, np.sqrt(mass)[:, None]
    own, weight, robust = poses[counts], mass[counts], robust and counts.sum() >= FEWEST

    def apart(at: int) -> float:
        """Return the distance of a pose from the others: the sum of the logarithms of the median metres and radians."""
        return sum(log(max(np.median(roots[counts, 0] * off), lsq.LEAST)) for off in own[at].distance(own))

    def mean_of(_: Transform, kept: Array) -> Transform:
        return own[kept > 0.0].mean(weight[kept > 0.0])

    tried = range(len(own)) if len(own) <= MOST_TRIED else next(lsq.draws(1, MOST_TRIED, len(own)))
    start = own[min(tried, key=apart)] if robust else own[0]
    found = lsq.robust_fit(
        start, lambda middle: roots[counts] * lsq.errors(own, middle),
        lambda _, weights: own.mean(weights * weight), mean_of, count=len(own), unknown=3, robust=robust,
    )  # fmt: skip
    used, mean = counts.copy(), found.model
    used[counts] = found.kept
    inliers, shares = poses[used], mass[used]
    *_, second, first = np.linalg.eigvalsh(np.array(validation.second_moment(inliers.components[3:], shares)))
    if first - second <= LEAST_GAP * (first + second):  # two eigenvectors of sum(w q q^T) are equally good
        raise ValueInvalid("the rotations lie so far apart that none is their mean; leave some out, or give weights")
    distances = np.stack(mean.distance(inliers))
    rms, most = np.sqrt((shares * distances**2).sum(1) / shares.sum()), distances.max(1)
    off = lsq.errors(poses, mean)
    count, kept = int(used.sum()), roots[used] * off[used]
    covariance = kept.T @ kept * (count / shares.sum() / (count - 1)) if count > 1 else None
    s_t, s_r = found.sigmas.tolist()
    return MeanFit(
        mean, tuple(rms.tolist()), tuple(most.tolist()), used, counts & ~used,
        lsq.deviations(roots * off, found.sigmas), off, (s_t, s_r), 3 * count - 3, covariance,
    )  # fmt: skip
