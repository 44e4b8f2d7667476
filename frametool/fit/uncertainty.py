"""How sure the poses of a fitted tree are: first order, the inverse of the normal equations, all loops in."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from frametool.fit.graph import Groups
from frametool.fit.linear import crossed, product
from frametool.fit.tree_solver import Fitted, TreeProblem, jacobians, of_body

if TYPE_CHECKING:
    from frametool.fit.elimination import BlockFactor
    from frametool.fit.rigid_arrays import PoseArrays
    from frametool.geometry.types import Array


class Uncertainty:
    """Covariances (6, 6) of poses between frames of bodies, in the axes of the frame they are given in.

    None where a pose rests on rows whose noise nobody gave and no loop shows.
    """

    def __init__(self, problem: TreeProblem, found: Fitted) -> None:
        """Take a fit; nothing is computed before it is asked for."""
        self._problem, self._found = problem, found
        known = np.flatnonzero(found.kept & (problem.rows.given | found.estimated)).tolist()
        self._known = Groups(problem.count, (problem.pairs[row] for row in known))

    def between(self, target: tuple[int, PoseArrays], source: tuple[int, PoseArrays]) -> Array | None:
        """Return that of source in target, each a body and where the frame is."""
        (t, a), (s, b) = target, source
        if t == s:
            return np.zeros((6, 6))
        if self._known.of(t) != self._known.of(s):
            return None
        right = np.zeros((self._problem.count, 6, 6))
        for body, frame, by in zip((t, s), (a, b), jacobians(a, b, np.zeros(3)), strict=True):
            right[body] = of_body(by, self._found.bodies.at(body), frame).T
        solved = self._factor.solve(right[1:])
        return _symmetric(crossed(right[1:].reshape(-1, 6), solved.reshape(-1, 6)))

    def in_root(self, body: int, frame: PoseArrays) -> Array | None:
        """Return that of a frame in the root."""
        if not body:
            return np.zeros((6, 6))
        if self._known.of(body) != self._known.of(0):
            return None
        arm = of_body(np.eye(6), self._found.bodies.at(body), frame)
        return _symmetric(product(product(arm, self._of_bodies[body - 1]), arm.T))

    @cached_property
    def _factor(self) -> BlockFactor:
        information = self._problem.information(self._found.noise) * self._found.kept[:, None, None]
        return self._problem.elimination.factored(self._problem.normal_equations(self._found.bodies, information)[0])

    @cached_property
    def _of_bodies(self) -> Array:
        return self._factor.inverse_diagonal()


def _symmetric(covariance: Array) -> Array:
    return (covariance + covariance.T) / 2
