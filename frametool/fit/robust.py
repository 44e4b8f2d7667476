"""Which of many measurements a fit keeps, and how far off the kept ones are: what trees, hands, points and means share.

u is how many sigmas a measurement is off, as the root of the mean square of its numbers; the sigmas come from medians
where nobody gave them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from frametool.geometry.types import Array

KEPT = 3.0  # sigmas: what is further off is left out
CERTAIN = 2.5  # sigmas: up to here a first weight is 1
MEDIAN_OF_THREE = 1.538  # the median of |r| of three numbers of deviation 1: the root of that of chi2 with 3 degrees
MEDIAN_OF_SIX = 0.944  # the median of u of six numbers: the root of that of chi2 with 6 degrees, over 6
LEAST = 1e-9  # metres, radians: no sigma is below


def first_weights(u: Array) -> Array:
    """Return min(1, 2.5 / u)^2."""
    weights: Array = np.minimum(1.0, CERTAIN / np.maximum(u, 1e-12)) ** 2
    return weights


def median_sigma(lengths: Array, share: float = 1.0) -> float:
    """Return the sigma of three numbers each by the median of their lengths; share q: what the fit leaves of noise."""
    return max(float(np.median(lengths)) / (MEDIAN_OF_THREE * share), LEAST)


def rms_sigma(squares: float, dof: float) -> float:
    """Return the sigma per axis of a sum of squares with so many degrees of freedom."""
    return max(float(np.sqrt(squares / dof)), LEAST)
