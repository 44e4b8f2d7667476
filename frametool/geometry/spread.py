"""How far transforms lie from their mean, and whether there is one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid
from frametool.geometry import validation

if TYPE_CHECKING:
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Numbers

LEAST_GAP = 1e-9  # between the two largest eigenvalues, as a part of their sum


class Spread(NamedTuple):
    """Distances from a mean, in metres and radians: the root of their weighted mean square, and the largest."""

    distance_rms: float
    distance_max: float
    angle_rms: float
    angle_max: float


def mean_and_spread(poses: Transform, weights: Numbers | None = None) -> tuple[Transform, Spread]:
    """Return the weighted mean of transforms, as `Transform.mean`, and how far they lie from it.

    What has no weight counts for nothing.
    Raises ValueInvalid where weights are none, or the rotations point so many ways that none is the mean.
    """
    mass = validation.masses(weights, poses.shape)
    moment = validation.second_moment(poses.components[3:], mass)
    _refuse_no_mean(moment)
    mean = poses.mean(weights)
    metres, radians = mean.distance(poses)
    counts = mass > 0.0
    whole = validation.total(mass.copy())
    return mean, Spread(
        (validation.total(mass * metres * metres) / whole) ** 0.5,
        float(metres[counts].max()),
        (validation.total(mass * radians * radians) / whole) ** 0.5,
        float(radians[counts].max()),
    )


def _refuse_no_mean(moment: Any) -> None:
    """Stop where two eigenvectors of sum(w q q^T) are as good as each other."""
    import numpy as np

    *_, second, first = np.linalg.eigvalsh(np.array(moment))
    if first - second <= LEAST_GAP * (first + second):
        raise ValueInvalid("the rotations lie so far apart that none is their mean; leave some out, or give weights")
