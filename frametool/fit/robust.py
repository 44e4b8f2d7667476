"""Which of many measurements a fit keeps, and how far off the kept ones are: what trees, hands, points and means share.

u is how many sigmas a measurement is off, as the root of the mean square of its numbers; the sigmas come from medians
where nobody gave them.
"""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.least_squares import length

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import TypeAlias

    from numpy.typing import NDArray

    from frametool.geometry.types import Array

    Mask: TypeAlias = NDArray[np.bool_]
    Rows: TypeAlias = slice | list[int] | Mask

Model = TypeVar("Model")

KEPT = 3.0  # sigmas: what is further off is left out
CERTAIN = 2.5  # sigmas: up to here a first weight is 1
MEDIAN_OF_THREE = 1.538  # the median of |r| of three numbers of deviation 1: the root of that of chi2 with 3 degrees
MEDIAN_OF_SIX = 0.944  # the median of u of six numbers: the root of that of chi2 with 6 degrees, over 6
LEAST = 1e-9  # metres, radians: no sigma is below
FARTHEST = 1e100  # metres: sums of squares stay finite
STEADY = 1e-3  # change of a first weight that is rest
FIRST_ROUNDS = 30
ROUNDS = 20  # of leaving out and taking back; in the second half nothing more is left out, so that they end


def require_near(translations: Array, name: str) -> None:
    """Refuse translations whose squares would overflow."""
    if (farthest := np.abs(translations).max(initial=0.0)) > FARTHEST:
        raise ValueInvalid(f"{name}: a place at {farthest:.3g} m; at most {FARTHEST:.0e} m can be fitted")


def draws(count: int, size: int, among: int) -> Iterator[list[int]]:
    """Yield so many seeded choices of rows, the same for ever.

    Of Python's generators only `random()` keeps its sequence between versions by promise, and numpy's keep none.
    """
    source = Random(0)  # noqa: S311 - no secret
    for _ in range(count):
        chosen: set[int] = set()
        while len(chosen) < size:
            chosen.add(int(source.random() * among))
        yield sorted(chosen)


class Settled(NamedTuple, Generic[Model]):
    """A fit of the rows kept: residuals of all (n, 3 or 6), a sigma for each three of them, and u of all."""

    model: Model
    kept: Mask
    residuals: Array
    sigmas: Array
    u: Array


def settled(
    model: Model,
    residuals: Callable[[Model], Array],
    rough: Callable[[Model, Array], Model],
    fit: Callable[[Model, Array], Model],
    *,
    unknown: int,
    robust: bool,
) -> Settled[Model]:
    """Fit, leave out what is further off than 3 sigmas, and fit the rest again until the rows stay.

    residuals: (n, 3) or (n, 6) of a model; unknown: how many numbers each three of them share
    rough, fit: a better model and the best one, by a weight for each row
    """
    count = len(residuals(model))
    kept = np.ones(count, bool)
    if robust:
        share, weights = np.sqrt(1.0 - unknown / (3.0 * count)), np.zeros(count)
        for _ in range(FIRST_ROUNDS):
            before, off = weights, residuals(model)
            u = deviations(off, np.array([median_sigma(part, share) for part in lengths(off).T]))
            weights = first_weights(u)
            if np.abs(weights - before).max() < STEADY:
                break
            model = rough(model, weights)
        kept = u <= KEPT
    for at in range(ROUNDS):
        model = fit(model, kept.astype(float))
        off = residuals(model)
        sigmas = fitted_sigmas(off, kept, unknown)
        u = deviations(off, sigmas)
        near = u <= KEPT if at < ROUNDS // 2 else kept | (u <= KEPT)
        if not robust or (near == kept).all():
            break
        kept = near
    return Settled(model, kept, off, sigmas, u)


def lengths(residuals: Array) -> Array:
    """Return the length of each three of the numbers of a row."""
    return length(residuals.reshape(len(residuals), -1, 3))


def deviations(residuals: Array, sigmas: Array) -> Array:
    """Return u of rows: the root of the mean square of their numbers in sigmas."""
    off = lengths(residuals) / sigmas
    u: Array = np.sqrt((off**2).sum(-1) / (3.0 * off.shape[1]))
    return u


def fitted_sigmas(residuals: Array, weights: Array | Mask, unknown: int) -> Array:
    """Return the sigma of each three numbers of weighted rows that share so many unknown ones."""
    dof = max(3.0 * float(weights.sum()) - unknown, 1.0)
    squares = (weights[:, None] * lengths(residuals) ** 2).sum(0)
    return np.array([rms_sigma(each, dof) for each in squares.tolist()])


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
