"""Slow second implementations, in 60 digits: products of elementary rotations, the matrix exponential, Newton's polar.

They share no formula with the kernels; numbers come in as floats and are taken as exact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mpmath
from mpmath import mp, mpf

if TYPE_CHECKING:
    from collections.abc import Sequence

mp.dps = 60
EPS = 2.0**-52
UNITS = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def matrix_of_quaternion(xyzw: Sequence[float]) -> Any:
    """Give the matrix of a quaternion of any norm: v v^T and the cross product, divided by the squared norm."""
    x, y, z, w = (mpf(part) for part in xyzw)
    v, cross = mpmath.matrix([x, y, z]), cross_matrix(x, y, z)
    norm = x * x + y * y + z * z + w * w
    return (2 * v * v.T + (w * w - x * x - y * y - z * z) * mpmath.eye(3) + 2 * w * cross) / norm


def cross_matrix(x: Any, y: Any, z: Any) -> Any:
    """Give the matrix of the vector product."""
    return mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def matrix_of_turn(axis: Sequence[float], angle: Any) -> Any:
    """Give the matrix of a turn about an axis of any length (Rodrigues)."""
    length = mpmath.sqrt(sum(mpf(part) ** 2 for part in axis))
    k = cross_matrix(*(mpf(part) / length for part in axis))
    return mpmath.eye(3) + mpmath.sin(angle) * k + 2 * mpmath.sin(angle / 2) ** 2 * k * k


def matrix_of_rotvec(vector: Sequence[float]) -> Any:
    """Give the matrix of a rotation vector."""
    length = mpmath.sqrt(sum(mpf(part) ** 2 for part in vector))
    return matrix_of_turn(vector, length) if length else mpmath.eye(3)


def matrix_of_euler(axes: str, angles: Sequence[Any]) -> Any:
    """Give the product of three elementary matrices: each new one from the left if static, from the right if not."""
    total = mpmath.eye(3)
    for letter, angle in zip(axes[1:], angles, strict=True):
        turn = matrix_of_turn(UNITS[letter], mpf(angle))
        total = turn * total if axes[0] == "s" else total * turn
    return total


def error(found: Any, expected: Any) -> float:
    """Give the angle in eps between two rotation matrices, from |found - expected| = 2 sqrt(2) sin(angle/2)."""
    return float(2 * mpmath.asin(mpmath.mnorm(found - expected, "f") / (2 * mpmath.sqrt(2)))) / EPS


def exponential(twist: Sequence[float]) -> Any:
    """Give the 4x4 exponential of a twist vx, vy, vz, wx, wy, wz by its power series."""
    v, w = [mpf(part) for part in twist[:3]], [mpf(part) for part in twist[3:]]
    cross = cross_matrix(*w)
    generator = mpmath.matrix([[*(cross[row, column] for column in range(3)), v[row]] for row in range(3)] + [[0] * 4])
    total, term = mpmath.eye(4), mpmath.eye(4)
    for n in range(1, 90):
        term = term * generator / n
        total += term
    return total


def polar(rows: Sequence[Sequence[float]]) -> Any:
    """Give the orthogonal polar factor of a 3x3 matrix by Newton's iteration, with a true inverse."""
    x = mpmath.matrix([[mpf(value) for value in row] for row in rows])
    for _ in range(12):
        x = (x + (x**-1).T) / 2
    return x


def as_matrix(rows: Any) -> Any:
    """Take a numpy matrix as exact."""
    return mpmath.matrix([[mpf(float(value)) for value in row] for row in rows])
