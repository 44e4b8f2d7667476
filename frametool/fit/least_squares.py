"""Least squares that every fit shares: normal equations, and the rotation between vectors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid
from frametool.geometry.rotation import Rotation

if TYPE_CHECKING:
    from frametool.geometry.types import Array


class NotSettled(ValueInvalid):
    """Report equations that have no solution."""

    def __init__(self) -> None:
        """Say so."""
        super().__init__("the numbers do not settle what is asked for: too few, too alike or too far apart")


def solve_normal(matrix: Array, right: Array) -> Array:
    """Return inv(matrix) right, (n, k), of a symmetric positive definite matrix; its rows may differ in units.

    Raises NotSettled where there is no solution.
    """
    scaled, units = _scaled(matrix)
    try:
        found: Array = np.linalg.solve(scaled, right / units) / units
    except np.linalg.LinAlgError:
        raise NotSettled from None
    if not np.isfinite(found).all():
        raise NotSettled
    return found


def _scaled(matrix: Array) -> tuple[Array, Array]:
    """Return a matrix whose diagonal is 1, and the units of its rows, (n, 1); raises NotSettled without a diagonal."""
    diagonal = np.diagonal(matrix)[:, None]
    if not (diagonal > 0.0).all():
        raise NotSettled
    units = np.sqrt(diagonal)
    return matrix / units / units.T, units


def inverse(matrix: Array) -> Array:
    """Return the inverse of a symmetric positive definite matrix, symmetric; raises NotSettled where there is none."""
    scaled, units = _scaled(matrix)
    try:
        np.linalg.cholesky(scaled)
        found = np.linalg.inv(scaled) / units / units.T
    except np.linalg.LinAlgError:
        raise NotSettled from None
    return (found + found.T) / 2.0


def align_vectors(source: Array, target: Array) -> Rotation:
    """Return the R of the least sum of |target - R source|^2 over vectors (n, 3); source: Kabsch 1976, Umeyama 1991."""
    u, _, vt = np.linalg.svd(target.T @ source)
    proper = np.array([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)])
    return Rotation.from_matrix((u * proper) @ vt).canonical()


def applied(matrices: Array, vectors: Array) -> Array:
    """Return matrices times vectors: (.., n, k) and (.., k)."""
    found: Array = (matrices @ vectors[..., None])[..., 0]
    return found


def length(vectors: Array) -> Array:
    """Return the lengths of vectors, which lie along the last axis."""
    found: Array = np.linalg.norm(vectors, axis=-1)
    return found
