"""Covariances of a fitted tree: first order, the inverse of the normal equations, all loops in."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from frametool.fit.graph import Groups
from frametool.fit.least_squares import inverse
from frametool.fit.tree_solver import Fitted, TreeProblem, jacobians, of_body

if TYPE_CHECKING:
    from frametool.fit.rigid_arrays import PoseArrays
    from frametool.geometry.types import Array


class Uncertainty:
    """Covariances (6, 6) of poses between frames of bodies, along the axes of the target frame.

    None where a pose depends on rows whose noise is neither given nor shown by a loop.
    """

    def __init__(self, problem: TreeProblem, found: Fitted) -> None:
        """Take a fit; nothing is computed before it is asked for."""
        self._problem, self._found = problem, found
        known = np.flatnonzero(found.kept & (problem.rows.given | found.estimated)).tolist()
        self._known = Groups(problem.count, (problem.pairs[row] for row in known))

    def between(self, target: tuple[int, PoseArrays], source: tuple[int, PoseArrays]) -> Array | None:
        """Return the covariance of source in target, each a body and the pose of a frame of it."""
        if target[0] == source[0]:
            return np.zeros((6, 6))
        if self._known.of(target[0]) != self._known.of(source[0]):
            return None
        by_ends = zip((target, source), jacobians(target[1], source[1], np.zeros(3)), strict=True)
        slopes = np.hstack([of_body(by, self._found.bodies.at(body), frame) for (body, frame), by in by_ends])
        ends = [target[0], source[0]]
        found: Array = slopes @ self._of_bodies[ends][:, :, ends].reshape(12, 12) @ slopes.T
        return (found + found.T) / 2.0

    @cached_property
    def _of_bodies(self) -> Array:
        """Return the covariance of all bodies, (bodies, 6, bodies, 6); zeros for the root."""
        problem, found = self._problem, self._found
        information = problem.information(found.noise) * found.kept[:, None, None]
        whole = np.zeros((problem.count, 6, problem.count, 6))
        if problem.unknown:
            normal = problem.normal_equations(found.bodies, information)[0]
            whole[1:, :, 1:] = inverse(normal).reshape(problem.unknown, 6, problem.unknown, 6)
        return whole
