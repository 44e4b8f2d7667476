"""The transform, and the scale, that bring an estimate onto its reference.

point_in_ref = scale * ref_from_est.apply(point_in_est): p' = c R p + t, R' = R R_i.
"""

from __future__ import annotations

from math import atan2
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.least_squares import align_vectors
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.types import Array

ALIGNMENTS = ("none", "origin", "yaw", "se3", "sim3")
LEAST = 3  # pairs
STILL = 1e-9  # rms, of 1 + the largest coordinate: what rounding moves
THIN = 1e-5  # of the second axis over the first: a line


class Unaligned(ValueInvalid):
    """What pairs do not determine; `other` names the alignments that they do."""


class Fit(NamedTuple):
    """An alignment: ref_from_est, and the scale that comes before it."""

    transform: Transform
    scale: float = 1.0

    def moved(self, est: Trajectory) -> Trajectory:
        """Return an estimate as the fit places it."""
        rotation, shift = self.transform.rotation, self.transform.xyz
        xyz = self.scale * rotation.apply(est.xyz) + shift
        if est.rotation is None:
            return est._replace(xyz=xyz)
        return est._replace(xyz=xyz, xyzw=np.stack((rotation @ est.rotation).components, -1))


def fitted(kind: str, ref: Trajectory, est: Trajectory, up: Array, names: tuple[str, str] = ("ref", "est")) -> Fit:
    """Fit paired poses; raises Unaligned, with the name of the side, where they do not determine the alignment."""
    if kind == "none":
        return Fit(Transform.identity())
    if kind == "origin":
        return _origin(ref, est)
    if kind == "yaw":
        return _yaw(ref.xyz, est.xyz, up, names)
    for name, each in zip(names, (ref, est), strict=True):
        _require_plane(kind, each.xyz, name)
    return umeyama(ref.xyz, est.xyz, with_scale=kind == "sim3")


def principal_axes(xyz: Array) -> Array:
    """Return the rms of positions along their principal axes, the largest first."""
    spread: Array = np.linalg.svd(xyz - centre(xyz), compute_uv=False) / np.sqrt(len(xyz))
    return spread


def _require_plane(kind: str, xyz: Array, name: str) -> None:
    if len(xyz) < LEAST:
        raise Unaligned(f"{len(xyz)} pairs; {kind} needs {LEAST}; --align origin or none")
    first, second, _ = principal_axes(xyz)
    if first < STILL * (1 + np.abs(xyz).max()):
        raise Unaligned(f"{name} does not move; --align none")
    if second < THIN * first:
        raise Unaligned(f"{name} lies on a line: the turn about it is free; --align yaw, origin or none")


def umeyama(ref: Array, est: Array, weights: Array | None = None, *, with_scale: bool) -> Fit:
    """Minimise the sum of w |c R e + t - r|^2; source: Umeyama 1991."""
    mass = np.ones(len(ref)) if weights is None else weights
    ref_mean, est_mean = centre(ref, mass), centre(est, mass)
    r, e = ref - ref_mean, est - est_mean
    e = e - centre(e, mass)  # what rounding left of the mean
    rotation = align_vectors(e, mass[:, None] * r)
    scale = float((mass[:, None] * rotation.apply(e) * r).sum() / (mass[:, None] * e**2).sum()) if with_scale else 1.0
    return Fit(Transform(rotation, ref_mean - scale * rotation.apply(est_mean)), scale)


def centre(xyz: Array, mass: Array | None = None) -> Array:
    """Return the weighted mean of positions."""
    found: Array = xyz.mean(0) if mass is None else mass @ xyz / mass.sum()
    return found


def _yaw(ref: Array, est: Array, up: Array, names: tuple[str, str]) -> Fit:
    """Minimise the same over turns about `up` alone."""
    ref_mean, est_mean = centre(ref), centre(est)
    r, e = ref - ref_mean, est - est_mean
    across = [each - np.outer(each @ up, up) for each in (r, e)]
    for name, each, whole in zip(names, across, (ref, est), strict=True):
        if np.sqrt((each**2).sum() / len(each)) < STILL * (1 + np.abs(whole).max()):
            raise Unaligned(f"{name} has no motion across up: yaw is free; --align origin or none")
    sine, cosine = (np.cross(across[1], across[0]) @ up).sum(), (across[1] * across[0]).sum()
    rotation = Rotation.from_axis_angle(up, atan2(sine, cosine))
    return Fit(Transform(rotation, ref_mean - rotation.apply(est_mean)))


def _origin(ref: Trajectory, est: Trajectory) -> Fit:
    """Put the first pose of the estimate onto that of the reference: ref_0 inv(est_0)."""
    if ref.xyzw is None or est.xyzw is None:
        raise Unaligned("origin needs rotations of both; --align se3, yaw or none")
    return Fit(ref.poses[0] @ est.poses[0].inverse())
