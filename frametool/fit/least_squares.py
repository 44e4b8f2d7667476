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


def solve_normal(matrix: Array, right: Array) -> Array:
    """Return inv(matrix) right, (n, k), of a symmetric positive definite matrix; its rows may differ in units.

    Raises NotSettled where it is not positive definite.
    """
    units = np.sqrt(np.maximum(np.diagonal(matrix), 0.0))
    units[units == 0.0] = np.nan  # fails below, as every NaN
    scaled = matrix / units / units[:, None]
    try:
        np.linalg.cholesky(scaled)
        found: Array = np.linalg.solve(scaled, right / units[:, None]) / units[:, None]
    except np.linalg.LinAlgError:
        found = np.full(1, np.nan)
    if not np.isfinite(found).all():
        raise NotSettled("the numbers do not settle what is asked for: too few, too alike or too far apart")
    return found


def inverse(matrix: Array) -> Array:
    """Return the inverse of a symmetric positive definite matrix, symmetric; raises NotSettled where there is none."""
    found = solve_normal(matrix, np.eye(len(matrix)))
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
