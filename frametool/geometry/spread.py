"""The mean of transforms, whether it exists, and the distances of the transforms from it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid
from frametool.geometry import validation

if TYPE_CHECKING:
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Numbers

FARTHEST = 1e150  # metres: squares stay finite
LEAST_GAP = 1e-9  # between the two largest eigenvalues, relative to their sum


class Spread(NamedTuple):
    """Distances from a mean, in metres and radians: the weighted root mean square, and the largest."""

    distance_rms: float
    distance_max: float
    angle_rms: float
    angle_max: float


def mean_and_spread(poses: Transform, weights: Numbers | None = None) -> tuple[Transform, Spread]:
    """Return the weighted mean of transforms, as `Transform.mean`, and their distances from it.

    Transforms with weight 0 have no effect.
    Raises ValueInvalid for invalid weights, and if the rotations are so different that they have no mean.
    """
    mass = validation.masses(weights, poses.shape)
    moment = validation.second_moment(poses.components[3:], mass)
    _refuse_no_mean(moment)
    mean = poses.mean(weights)
    metres, radians = mean.distance(poses)
    counts = mass > 0.0
    whole = validation.total(mass.copy())
    if not metres[counts].max() < FARTHEST:
        raise ValueInvalid(f"poses lie {metres[counts].max():.3g} m from their mean; at most {FARTHEST:.0e} m")
    return mean, Spread(
        (validation.total(mass * metres * metres) / whole) ** 0.5,
        float(metres[counts].max()),
        (validation.total(mass * radians * radians) / whole) ** 0.5,
        float(radians[counts].max()),
    )


def _refuse_no_mean(moment: Any) -> None:
    """Raise an error if two eigenvectors of sum(w q q^T) are equally good."""
    import numpy as np

    *_, second, first = np.linalg.eigvalsh(np.array(moment))
    if first - second <= LEAST_GAP * (first + second):
        raise ValueInvalid("the rotations lie so far apart that none is their mean; leave some out, or give weights")
