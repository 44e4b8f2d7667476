"""Alignment of paired trajectories by a transform and a scale, and the lever arm between two sensors.

point_in_ref = scale * ref_from_est.apply(point_in_est): p' = c R p + t, R' = R R_i.
"""

from __future__ import annotations

from math import atan2
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.least_squares import align_vectors, solve_normal
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry import Array

ALIGNMENTS = ("none", "origin", "yaw", "se3", "sim3")
SCALED = ("sim3", "origin+scale")
FEWEST = 3  # pairs of an alignment, and poses for a clock offset, which needs two speeds at least
STILL = 1e-9  # rms, relative to 1 + the largest coordinate: the effect of rounding
THIN = 1e-5  # ratio of the second principal axis to the first below which positions are on a straight line


class Unaligned(ValueInvalid):
    """Pairs that do not determine an alignment; `other` names alignments that they determine."""


class Fit(NamedTuple):
    """An alignment: the transform ref_from_est, and the scale applied before it."""

    transform: Transform
    scale: float = 1.0

    def moved(self, est: Trajectory) -> Trajectory:
        """Return the estimate after the alignment, in the reference's world."""
        rotation, shift = self.transform.rotation, self.transform.xyz
        xyz = self.scale * rotation.apply(est.xyz) + shift
        if est.rotation is None:
            return est._replace(xyz=xyz)
        return est._replace(xyz=xyz, xyzw=np.stack((rotation @ est.rotation).components, -1))


def fitted(
    kind: str, ref: Trajectory, est: Trajectory, up: Array, names: tuple[str, str] = ("ref", "est"), *,
    tied: bool = False,
) -> Fit:
    """Fit the alignment of paired poses.

    kind: one of ALIGNMENTS, or origin+scale: the scale of sim3, then the first pose, as evo does with
        --correct_scale --align_origin
    up: the axis of `yaw`; names: of the trajectories, for messages
    tied: the first position of the estimate is aligned exactly with that of the reference
    Raises Unaligned, which names the trajectory, if the poses do not determine the alignment.
    """
    if kind == "none":
        return Fit(Transform.identity())
    if kind == "origin":
        if ref.xyzw is None or est.xyzw is None:
            raise Unaligned("origin needs rotations of both; --align se3, yaw or none")
        return Fit(ref.poses[0] @ est.poses[0].inverse())  # the first poses coincide
    if kind == "yaw":  # the same least squares as for se3, over rotations about `up` only
        ref_mean, est_mean = (each.xyz[0] if tied else centre(each.xyz) for each in (ref, est))
        across = [each - np.outer(each @ up, up) for each in (ref.xyz - ref_mean, est.xyz - est_mean)]
        for name, each, whole in zip(names, across, (ref.xyz, est.xyz), strict=True):
            if np.sqrt((each**2).sum() / len(each)) < STILL * (1 + np.abs(whole).max()):
                raise Unaligned(f"{name} has no motion across up: yaw is free; --align origin or none")
        sine, cosine = (np.cross(across[1], across[0]) @ up).sum(), (across[1] * across[0]).sum()
        rotation = Rotation.from_axis_angle(up, atan2(sine, cosine))
        return Fit(Transform(rotation, ref_mean - rotation.apply(est_mean)))
    for name, xyz in zip(names, (ref.xyz, est.xyz), strict=True):
        if len(xyz) < FEWEST:
            raise Unaligned(f"{len(xyz)} pairs; {kind} needs {FEWEST}; --align origin or none")
        first, second, _ = principal_axes(xyz)
        if first < STILL * (1 + np.abs(xyz).max()):
            raise Unaligned(f"{name} does not move; --align none")
        if second < THIN * first:
            raise Unaligned(f"{name} lies on a line: the turn about it is free; --align yaw, origin or none")
    found = umeyama(ref.xyz, est.xyz, with_scale=kind in SCALED, tied=tied)
    if kind == "origin+scale":
        return fitted("origin", ref, est._replace(xyz=found.scale * est.xyz), up)._replace(scale=found.scale)
    return found


def principal_axes(xyz: Array) -> Array:
    """Return the rms of positions along their principal axes, in descending order."""
    spread: Array = np.linalg.svd(xyz - centre(xyz), compute_uv=False) / np.sqrt(len(xyz))
    return spread


def umeyama(ref: Array, est: Array, weights: Array | None = None, *, with_scale: bool, tied: bool = False) -> Fit:
    """Minimise the sum of w |c R e + t - r|^2; source: Umeyama 1991.  tied: subject to c R e_0 + t = r_0."""
    mass = np.ones(len(ref)) if weights is None else weights
    ref_mean, est_mean = (each[0] if tied else centre(each, mass) for each in (ref, est))
    r, e = ref - ref_mean, est - est_mean
    e = e if tied else e - centre(e, mass)  # corrects the rounding of the mean
    rotation = align_vectors(e, mass[:, None] * r)
    scale = float((mass[:, None] * rotation.apply(e) * r).sum() / (mass[:, None] * e**2).sum()) if with_scale else 1.0
    return Fit(Transform(rotation, ref_mean - scale * rotation.apply(est_mean)), scale)


def centre(xyz: Array, mass: Array | None = None) -> Array:
    """Return the weighted mean of positions."""
    found: Array = xyz.mean(0) if mass is None else mass @ xyz / mass.sum()
    return found


ARM_STEPS = 50
SEEN = 1e-6  # rms of metres per metre of the arm above which a direction is observable from the rotations
DONE = 1e-13  # relative size of a step at convergence


def lever_arm(kind: str, ref: Trajectory, est: Trajectory, up: Array) -> Array:
    """Return the lever arm l of p_ref = c R (p_i + R_i l) + t, metres, estimated jointly with the alignment.

    Unobservable directions are 0.  Gauss-Newton with variable projection (Golub and Pereyra 1973): the alignment is
    fitted again after each step, and a step fits only the residuals that the alignment's parameters cannot explain.
    Raises ValueInvalid without rotations of the estimate.
    """
    if est.rotation is None:
        raise ValueInvalid("a lever arm needs rotations of the estimate")
    arm = np.zeros(3)
    for _ in range(ARM_STEPS):
        shifted = est._replace(xyz=est.xyz + est.rotation.apply(arm))
        fit = fitted(kind, ref, shifted, up)
        placed = fit.moved(shifted)
        turns = fit.scale * (fit.transform.rotation @ est.rotation).as_matrix()  # the effect of a step of the arm
        free = turns.reshape(-1, 3)
        residual = (ref.xyz - placed.xyz).reshape(-1)
        if not kind.startswith(("none", "origin")):
            # the derivatives of positions by alignment parameters: shifts, rotations about x, y, z or up, scale
            centred = placed.xyz - centre(placed.xyz)
            parts = [np.broadcast_to(axis, centred.shape) for axis in np.eye(3)]
            parts += [np.cross(axis, centred) for axis in (up[None] if kind == "yaw" else np.eye(3))]
            parts += [centred] * (kind == "sim3")
            own = np.stack([part.reshape(-1) for part in parts], -1)
            free = free - own @ solve_normal(own.T @ own, own.T @ free)
        squares, axes = np.linalg.eigh(free.T @ free)
        seen = squares > (SEEN * fit.scale) ** 2 * len(turns)
        step = axes[:, seen] @ (axes[:, seen].T @ (residual @ free) / squares[seen])
        arm = arm + step
        if np.abs(step).max() <= DONE * (1 + np.abs(arm).max()):
            break
    return arm
