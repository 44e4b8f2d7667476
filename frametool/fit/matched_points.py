"""The transform between matched points, and its scale: a = c R b + t, robust against outliers."""

from __future__ import annotations

from itertools import chain
from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, warn
from frametool.fit import least_squares as lsq
from frametool.fit.alignment import FEWEST, STILL, THIN, Fit, centre, principal_axes, umeyama
from frametool.geometry import validation
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.fit.least_squares import Mask, Rows
    from frametool.geometry import Array, Numbers

FEWEST_ROBUST = 5  # three points always fit, so that with four the outlier cannot be identified
TRIPLES = 500
MOST = 2000  # points on which a triple is tested
ROUNDING = 1e-12  # accuracy of distances relative to the largest coordinate
BETTER = 5.0  # ratio: an alternative with residuals this much smaller is reported
UNITS = {1000.0: "millimetres?", 100.0: "centimetres?"}
ABOUT = 0.05  # relative difference from a unit's scale up to which the unit is named
ONE = Transform.identity()
MIRROR = np.array([1.0, 1.0, -1.0])


class PointsFit(NamedTuple):
    """target_from_source and the scale c, with their covariance (6x6, as in ROS) and the scale's sigma.

    used: the inliers; left_out: the outliers, without the points of weight 0
    residuals: target - (c R source + t), (n, 3); u: the residual of each in sigmas; sigma: of each axis for weight 1
    dof: 3 n - 6, with a scale 3 n - 7; rms: of the inliers in metres, and None, as there is no angle
    """

    transform: Transform
    scale: float
    scale_sigma: float | None
    covariance: Array
    used: Mask
    left_out: Mask
    residuals: Array
    u: Array
    sigma: float
    dof: int
    rms: tuple[float, None]


def solve_points(
    target: Numbers, source: Numbers, *, weights: Numbers | None = None, scale: bool = False, robust: bool = True,
    names: tuple[str, str] = ("A", "B"),
) -> PointsFit:  # fmt: skip
    """Estimate the transform from source points to the matching target points, (n, 3) each; outliers are rejected.

    weights: (n,), proportional to 1 / variance; a pair of weight 0 is ignored
    scale: estimate one too, target = scale R source + t; names: of target and source, for messages
    Returns .transform (target_from_source), .scale, .covariance, .used and more.
    Raises ValueInvalid if the points are too few, on a line, or mirrored.
    """
    a, b = _points(target, "target"), _points(source, "source")
    if len(a) != len(b):
        raise ValueInvalid(f"target has {len(a)} points, source {len(b)}")
    mass = np.ones(len(a)) if weights is None or not len(a) else validation.masses(weights, a.shape[:1])
    if (count := int((mass > 0.0).sum())) < FEWEST:
        raise ValueInvalid(f"{count} matched point{'s'[: count != 1]}; {FEWEST} are needed, not on a line")
    pairs = _Pairs(a[mass > 0.0], b[mass > 0.0], mass[mass > 0.0])
    pairs.require_plane()
    robust = robust and count >= FEWEST_ROBUST
    start, typical = pairs.start(with_scale=scale, robust=robust)
    mirrored = pairs._replace(source=pairs.source * MIRROR).start(with_scale=scale, robust=robust)[1]
    if BETTER * mirrored <= typical:
        off = f"{1000.0 * mirrored:.1f} mm, not {1000.0 * typical:.1f} mm"
        raise ValueInvalid(f"a mirror image fits ({off}): one set is left-handed")

    def rough(_: Fit, weights: Array) -> Fit:
        return umeyama(*pairs[:2], pairs.mass * weights, with_scale=scale)

    def fit(_: Fit, kept: Array) -> Fit:
        chosen = pairs.at(kept > 0.0)
        chosen.require_plane()
        return umeyama(*chosen, with_scale=scale)

    count = len(pairs.mass)
    found = lsq.robust_fit(start, pairs.weighted_residuals, rough, fit, count=count, unknown=6 + scale, robust=robust)
    best, sigma, kept = found.model, float(found.sigmas[0]), found.kept
    covariance, scale_sigma = pairs.at(kept).covariance(best, sigma, with_scale=scale)
    used = mass > 0.0
    used[used] = kept
    residuals = _Pairs(a, b, mass).residuals(best)
    if not scale:
        scaled, its_typical = pairs.start(with_scale=True, robust=robust)
        if BETTER * its_typical <= typical and scaled.scale > 0.0:
            is_great = scaled.scale > 1.0
            (great, small), ratio = (names, scaled.scale) if is_great else (names[::-1], 1.0 / scaled.scale)
            unit = next((unit for unit in UNITS if abs(ratio / unit - 1.0) < ABOUT), ratio)
            warn(f"{great} is {unit:.4g} times {small}: {UNITS.get(unit, 'a scale?')}")
    return PointsFit(
        best.transform.canonical(), best.scale, scale_sigma, covariance, used, (mass > 0.0) & ~used, residuals,
        np.sqrt(mass / 3.0) * lsq.length(residuals) / sigma, sigma, 3 * int(kept.sum()) - 6 - scale,
        (sqrt((residuals[used] ** 2).sum() / used.sum()), None),
    )  # fmt: skip


class _Pairs(NamedTuple):
    """Matched points (n, 3) and their weights."""

    target: Array
    source: Array
    mass: Array

    def at(self, index: Rows) -> _Pairs:
        return _Pairs(*(part[index] for part in self))

    def residuals(self, fit: Fit) -> Array:
        placed: Array = fit.transform.rotation.apply(fit.scale * self.source) + fit.transform.xyz
        return self.target - placed

    def weighted_residuals(self, fit: Fit) -> Array:
        found: Array = np.sqrt(self.mass)[:, None] * self.residuals(fit)
        return found

    def start(self, *, with_scale: bool, robust: bool) -> tuple[Fit, float]:
        """Return the fit, of all points or of a triple, with the least typical distance, and that distance.

        The typical distance is the median, but at least the fourth: three always fit.  It is never below rounding.
        """
        count = len(self.mass)
        seen = self.at(next(lsq.draws(1, MOST, count))) if count > MOST else self
        middle = min(max(len(seen.mass) // 2, 3), len(seen.mass) - 1)
        best = (np.inf, Fit(ONE))
        triples: Iterable[Rows] = lsq.draws(TRIPLES * robust, 3, count)
        for few in chain([slice(None)], triples):
            chosen = self.at(few)
            if chosen.is_line():
                continue
            fit = umeyama(*chosen, with_scale=with_scale)
            off = (seen.weighted_residuals(fit) ** 2).sum(-1)
            best = min(best, (float(np.partition(off, middle)[middle]), fit), key=lambda each: each[0])
        return best[1], max(sqrt(best[0]), ROUNDING * max(np.abs(self.target).max(), np.abs(self.source).max()))

    def is_line(self) -> bool:
        """Return True if the target or the source points are on a line, or at one point."""
        for xyz in self[:2]:
            first, second, _ = principal_axes(xyz)
            if second <= max(THIN * first, STILL * np.abs(xyz).max()):
                return True
        return False

    def require_plane(self) -> None:
        if len(self.mass) < FEWEST or self.is_line():
            raise ValueInvalid("the points lie on a line: the turn about it cannot be known")

    def covariance(self, fit: Fit, sigma: float, *, with_scale: bool) -> tuple[Array, float | None]:
        """Return the covariance of the pose (6, 6), and the scale's sigma if it is estimated, from the inverse Hessian.

        At the points' centre position, rotation and scale are independent; the lever arm transforms it to the source's
        origin.
        """
        middle = centre(self.source, self.mass)
        arms = fit.transform.rotation.apply(self.source - middle)
        unit = np.broadcast_to(np.eye(3), (len(arms), 3, 3))
        slopes = np.concatenate([unit, -lsq.skew(fit.scale * arms), arms[:, :, None]], 2)[:, :, : 6 + with_scale]
        about = lsq.inverse(np.einsum("n,nij,nik->jk", self.mass, slopes, slopes))
        lever = fit.transform.rotation.apply(middle)
        levers = np.eye(6 + with_scale)
        levers[:3, 3:6], levers[:3, 6:] = lsq.skew(fit.scale * lever), -lever[:, None]
        found = levers @ about @ levers.T
        found = sigma**2 / 2.0 * (found + found.T)
        return found[:6, :6], sqrt(found[6, 6]) if with_scale else None


def _points(values: Numbers, name: str) -> Array:
    xyz = np.stack(np.atleast_1d(*validation.columns(values, 3, name)), -1)
    if xyz.ndim != 2:
        raise ValueInvalid(f"{name}: expected shape (n, 3), got {xyz.shape}")
    validation.all_finite((xyz,), name)
    lsq.require_near(xyz, name)
    return xyz
