"""Where on the body of an estimate the point is that the reference saw: a lever arm, from the poses themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.alignment import centre, fitted
from frametool.fit.least_squares import solve_normal

if TYPE_CHECKING:
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.types import Array

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
