"""Common parts of all fits: normal equations, errors and steps of poses, and robust outlier rejection.

An error or a step is (n, 6): metres and a rotation vector, both along the fixed axes of the parent frame, as in the
covariances of ROS: t + d[:3], Exp(d[3:]) R.
u is the residual of a measurement in sigmas, the root mean square of its components; sigmas that the user does not
state are estimated from medians.
"""

from __future__ import annotations

from math import degrees
from random import Random
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

import numpy as np

from frametool.errors import ValueInvalid
from frametool.geometry import arrays, floats
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import Any, TypeAlias

    from numpy.typing import NDArray

    from frametool.geometry import Array

    Mask: TypeAlias = NDArray[np.bool_]
    Rows: TypeAlias = slice | list[int] | Mask


class Undetermined(ValueInvalid):
    """Equations without a unique finite solution."""

    def __init__(self) -> None:
        """Set the message."""
        super().__init__("the numbers do not settle what is asked for: too few, too alike or too far apart")


def solve_normal(matrix: Array, right: Array) -> Array:
    """Return inv(matrix) right, (n, k), for a symmetric positive definite matrix, whose rows may differ in units.

    Raises Undetermined if there is no solution.
    """
    diagonal = np.diagonal(matrix)[:, None]
    if not (diagonal > 0.0).all():
        raise Undetermined
    units = np.sqrt(diagonal)
    try:
        found: Array = np.linalg.solve(matrix / units / units.T, right / units) / units
    except np.linalg.LinAlgError:
        raise Undetermined from None
    if not np.isfinite(found).all():
        raise Undetermined
    return found


def inverse(matrix: Array) -> Array:
    """Return the inverse of a symmetric positive definite matrix, symmetric; raises Undetermined if there is none."""
    found = solve_normal(matrix, np.eye(len(matrix)))
    if not (np.diagonal(found) > 0.0).all():
        raise Undetermined
    return (found + found.T) / 2.0


def align_vectors(source: Array, target: Array) -> Rotation:
    """Return the R that minimises the sum of |target - R source|^2 of vectors (n, 3).

    Source: Kabsch 1976, Umeyama 1991.
    """
    u, _, vt = np.linalg.svd(target.T @ source)
    proper = np.array([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)])
    return Rotation.from_matrix((u * proper) @ vt).canonical()


def applied(matrices: Array, vectors: Array) -> Array:
    """Return matrices times vectors: (.., n, k) and (.., k)."""
    found: Array = (matrices @ vectors[..., None])[..., 0]
    return found


def sigmas(errors: Array, information: Array) -> Array:
    """Return the root mean square of errors (.., 6) in sigmas; information: the inverse covariances, (.., 6, 6)."""
    squares = (errors * applied(information, errors)).sum(-1)
    found: Array = np.sqrt(np.maximum(squares, 0.0) / 6)
    return found


def length(vectors: Array) -> Array:
    """Return the lengths of vectors along the last axis."""
    found: Array = np.linalg.norm(vectors, axis=-1)
    return found


NEAR = 1e-4  # radians: below, the series of J^-1 is exact to the last bits


def stepped(poses: Transform, steps: Array) -> Transform:
    """Return poses after small steps (.., 6): t + d[:3], Exp(d[3:]) R."""
    turned = Rotation.from_rotvec(steps[..., 3:]) @ poses.rotation
    return Transform(Rotation.from_quaternion(turned.as_quaternion(), normalize=True), poses.xyz + steps[..., :3])


def errors(poses: Transform, measured: Transform) -> Array:
    """Return the errors of poses, [t - measured t, Log(R measured R')], (.., 6)."""
    turned = (poses.rotation @ measured.rotation.inverse()).as_rotvec()
    return np.concatenate([poses.xyz - measured.xyz, turned], -1)


def off_text(metres: float, radians: float, *, digits: int = 1) -> str:
    """Format the translation and the angle of an error for messages."""
    return f"{1e3 * metres:.1f} mm {degrees(radians):.{digits}f} deg"


def skew(v: Array) -> Array:
    """Return the matrices [v]x of vectors (.., 3): [v]x a = v x a."""
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*v.shape, 3)


def inverse_left_jacobian(rotvecs: Array) -> Array:
    """Return J^-1(w): Log(Exp(d) Exp(w)) = w + J^-1(w) d for small d.

    Source: Barfoot 2017, eq. 7.77b; I - [w]x / 2 + (1 / a^2 - (1 + cos a) / (2 a sin a)) [w]x^2, a = |w|.
    """
    angle = length(rotvecs)
    far = angle > NEAR
    a = np.where(far, angle, 1.0)
    sine, cosine = floats.half_sincos(a, arrays)
    factor = np.where(far, 1.0 / a**2 - cosine / (2.0 * a * sine), 1.0 / 12.0)
    crossed = skew(rotvecs)
    return np.eye(3) - crossed / 2.0 + factor[..., None, None] * (crossed @ crossed)


def batch_of(argument: Any, name: str) -> Transform:
    """Convert single transforms or matrices (n, 4, 4) to one batch of transforms (n,); a batch is returned as it is.

    name: for messages.  Raises ValueInvalid for another shape, which it names, and for translations above 1e100 m.
    """
    if not isinstance(argument, Transform) and len(argument) and all(isinstance(each, Transform) for each in argument):
        if many := next((each.shape for each in argument if each.shape), ()):
            raise ValueInvalid(f"{name}: expected single transforms, got shape {many}")
        argument = stacked(argument)
    if not isinstance(argument, Transform):
        matrices = np.asarray(argument)
        if matrices.ndim != 3 or matrices.shape[1:] != (4, 4):
            raise ValueInvalid(f"{name}: expected matrices of shape (n, 4, 4), got {matrices.shape}")
        argument = Transform.from_matrix(matrices)
    poses: Transform = argument
    if len(poses.shape) != 1:
        raise ValueInvalid(f"{name}: expected transforms of shape (n,), got {poses.shape}")
    require_near(poses.xyz, name)
    return poses


def stacked(transforms: Iterable[Transform]) -> Transform:
    """Combine single transforms into one batch."""
    return Transform.of(*map(np.array, zip(*(each.components for each in transforms), strict=True)))


Model = TypeVar("Model")

KEPT = 3.0  # sigmas: a larger residual is an outlier
CERTAIN = 2.5  # sigmas: smaller residuals have the weight 1 in the first fit
MEDIAN_OF_THREE = 1.538  # the median of |r| of three numbers of deviation 1: the root of that of chi2 with 3 degrees
MEDIAN_OF_SIX = 0.944  # the median of u of six numbers: the root of that of chi2 with 6 degrees, over 6
LEAST = 1e-9  # metres, radians: the minimum of a sigma
FARTHEST = 1e100  # metres: sums of squares stay finite
STEADY = 1e-4  # largest change of a weight of the first fit at convergence
FIRST_ROUNDS = 50
ROUNDS = 20  # of rejecting and readmitting; the second half rejects nothing more, so that it terminates


def require_near(translations: Array, name: str) -> None:
    """Raise ValueInvalid for translations whose squares would overflow."""
    if (farthest := np.abs(translations).max(initial=0.0)) > FARTHEST:
        raise ValueInvalid(f"{name}: a place at {farthest:.3g} m; at most {FARTHEST:.0e} m can be fitted")


def draws(count: int, size: int, among: int) -> Iterator[list[int]]:
    """Yield `count` random choices of `size` rows out of `among`, sorted; reproducible.

    Of Python's generators only `random()` guarantees its sequence between versions, and numpy's none.
    """
    source = Random(0)  # noqa: S311 - no secret
    for _ in range(count):
        chosen: set[int] = set()
        while len(chosen) < size:
            chosen.add(int(source.random() * among))
        yield sorted(chosen)


class RobustFit(NamedTuple, Generic[Model]):
    """A fit of the inliers.

    kept: the inliers; residuals: of all rows, (n, 3) or (n, 6); sigmas: one for each three columns of them
    u: the residual of each row in sigmas
    """

    model: Model
    kept: Mask
    residuals: Array = np.ones(0)
    sigmas: Array = np.ones(0)
    u: Array = np.ones(0)


def robust_fit(
    model: Model, residuals: Callable[[Model], Array], rough: Callable[[Model, Array], Model],
    fit: Callable[[Model, Array], Model], *, count: int, unknown: int, robust: bool,
) -> RobustFit[Model]:  # fmt: skip
    """Fit, reject rows beyond 3 sigmas, and fit the rest again until the inliers do not change.

    residuals: those of a model, (count, 3) or (count, 6); unknown: the number of unknowns behind each three columns
    rough, fit: return an improved model and the best one, for a weight per row
    """
    kept, share = np.ones(count, bool), np.sqrt(1.0 - unknown / (3.0 * count))

    def by_medians(model: Model) -> Array:
        off = residuals(model)
        return deviations(off, np.array([median_sigma(part, share) for part in lengths(off).T]))

    def fitted(found: RobustFit[Model], kept: Mask) -> RobustFit[Model]:
        model = fit(found.model, kept.astype(float))
        off = residuals(model)
        sigmas = fitted_sigmas(off, kept, unknown)
        return RobustFit(model, kept, off, sigmas, deviations(off, sigmas))

    if robust:
        model, kept = first_inliers(model, by_medians, rough)
    return refit_inliers(RobustFit(model, kept), fitted, robust=robust)


def first_inliers(
    model: Model, u_of: Callable[[Model], Array], rough: Callable[[Model, Array], Model]
) -> tuple[Model, Mask]:
    """Improve a model with weights min(1, 2.5 / u)^2 until they converge; return it and the mask of inliers, u <= 3."""
    weights = None
    for _ in range(FIRST_ROUNDS):
        before, u = weights, u_of(model)
        weights = np.minimum(1.0, CERTAIN / np.maximum(u, 1e-12)) ** 2
        if before is not None and np.abs(weights - before).max() < STEADY:
            break
        model = rough(model, weights)
    return model, u <= KEPT


def refit_inliers(
    found: RobustFit[Model], fit: Callable[[RobustFit[Model], Mask], RobustFit[Model]], *, robust: bool
) -> RobustFit[Model]:
    """Fit the inliers, and again those within 3 sigmas of the new fit, until they do not change.

    fit: returns a better fit of some rows, with `kept`, the rows it used, and `u` of all rows
    """
    kept = found.kept
    for at in range(ROUNDS):
        found = fit(found, kept)
        kept = found.u <= KEPT if at < ROUNDS // 2 else found.kept | (found.u <= KEPT)
        if not robust or (kept == found.kept).all():
            break
    return found


def lengths(residuals: Array) -> Array:
    """Return the length of each three columns of residuals, (n, columns / 3)."""
    return length(residuals.reshape(len(residuals), -1, 3))


def deviations(residuals: Array, sigmas: Array) -> Array:
    """Return u of each row: the root mean square of its columns in sigmas."""
    off = lengths(residuals) / sigmas
    u: Array = np.sqrt((off**2).sum(-1) / (3.0 * off.shape[1]))
    return u


def fitted_sigmas(residuals: Array, weights: Array | Mask, unknown: int) -> Array:
    """Return the sigma of each three columns of weighted residuals, which share `unknown` unknowns."""
    dof = max(3.0 * float(weights.sum()) - unknown, 1.0)
    squares = (weights[:, None] * lengths(residuals) ** 2).sum(0)
    return np.array([max(float(np.sqrt(each / dof)), LEAST) for each in squares.tolist()])


def median_sigma(lengths: Array, share: float = 1.0) -> float:
    """Return the sigma of vectors of three numbers from their median length; share: of the noise that a fit leaves."""
    return max(float(np.median(lengths)) / (MEDIAN_OF_THREE * share), LEAST)
