"""The transform, and the scale, that bring an estimate onto its reference; where its body is the reference's.

point_in_ref = scale * ref_from_est.apply(point_in_est): p' = c R p + t, R' = R R_i.
"""

from __future__ import annotations

from math import atan2
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.least_squares import align_vectors, solve_normal
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


STEPS = 50
SEEN = 1e-6  # rms of metres that a metre of the arm moves: along a direction that the turns show
DONE = 1e-13


def lever_arm(kind: str, ref: Trajectory, est: Trajectory, up: Array) -> Array:
    """Return the shift l of p_ref = c R (p_i + R_i l) + t that fits best together with the alignment, metres.

    What the turns do not show stays 0.  Gauss-Newton: the alignment is fitted anew after each step, and the step is
    the least-squares one of what its own parameters cannot explain (variable projection, Golub and Pereyra 1973).
    Raises ValueInvalid without rotations of the estimate.
    """
    if est.rotation is None:
        raise ValueInvalid("a lever arm needs rotations of the estimate")
    arm = np.zeros(3)
    for _ in range(STEPS):
        shifted = est._replace(xyz=est.xyz + est.rotation.apply(arm))
        fit = fitted(kind, ref, shifted, up)
        placed = fit.moved(shifted)
        turns = fit.scale * (fit.transform.rotation @ est.rotation).as_matrix()  # what a step of the arm moves
        own = _tangents(kind, placed.xyz, up)
        free = turns.reshape(-1, 3)
        residual = (ref.xyz - placed.xyz).reshape(-1)
        if own is not None:
            free = free - own @ solve_normal(own.T @ own, own.T @ free)
        squares, axes = np.linalg.eigh(free.T @ free)
        seen = squares > (SEEN * fit.scale) ** 2 * len(turns)
        step = axes[:, seen] @ (axes[:, seen].T @ (residual @ free) / squares[seen])
        arm = arm + step
        if np.abs(step).max() <= DONE * (1 + np.abs(arm).max()):
            break
    return arm


def _tangents(kind: str, xyz: Array, up: Array) -> Array | None:
    """Return how the parameters of an alignment move positions: shifts, turns about x, y, z or up, and scale."""
    if kind in ("none", "origin"):
        return None
    centred = xyz - centre(xyz)
    axes = up[None] if kind == "yaw" else np.eye(3)
    parts = [*(np.broadcast_to(axis, xyz.shape) for axis in np.eye(3)), *(np.cross(axis, centred) for axis in axes)]
    if kind == "sim3":
        parts.append(centred)
    return np.stack([part.reshape(-1) for part in parts], -1)
