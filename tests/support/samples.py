"""Hostile inputs for rotations: where formulas divide by zero, cancel, overflow or change branch. Seeded."""

from __future__ import annotations

import math

import numpy as np

Quaternion = tuple[float, float, float, float]

TINY_ANGLES = (1e-300, 1e-200, 1e-154, 1e-100, 1e-30, 1e-16, 1e-12, 1e-9, 1e-8, 1e-4, 1e-2)
NEAR_PI = tuple(math.pi - gap for gap in (0.0, 1e-16, 1e-15, 1e-12, 1e-9, 1e-8, 1e-6))
LOCK_GAPS = (0.0, 1e-16, 3e-16, 1e-15, 1e-12, 1e-9, 9e-8, 1e-7, 1e-6)
AXES_3 = (
    (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (2 / 7, -3 / 7, 6 / 7), (-1.0, 1e-9, 1e-12),
)  # fmt: skip
SQRT_HALF = math.sqrt(0.5)


def lattice() -> list[Quaternion]:
    """List the quaternions of right angles: one component 1, all four 1/2, or two sqrt(1/2)."""
    ones = [[sign * (n == one) for n in range(4)] for one in range(4) for sign in (1.0, -1.0)]
    halves = [[0.5 if bits >> n & 1 else -0.5 for n in range(4)] for bits in range(16)]
    pairs = [
        [SQRT_HALF * (1.0 if n == a else sign) if n in (a, b) else 0.0 for n in range(4)]
        for a in range(4) for b in range(a + 1, 4) for sign in (1.0, -1.0)
    ]  # fmt: skip
    return [(x, y, z, w) for x, y, z, w in (*ones, *halves, *pairs)]


LATTICE = lattice()


def random_quaternions(count: int, seed: int = 0) -> list[Quaternion]:
    """Draw unit quaternions x, y, z, w."""
    drawn = np.random.default_rng(seed).normal(size=(count, 4))
    return [(x, y, z, w) for x, y, z, w in (drawn / np.linalg.norm(drawn, axis=1, keepdims=True)).tolist()]


def rotation_vectors() -> list[tuple[float, float, float]]:
    """List tiny, ordinary and nearly straight turns about every axis."""
    angles = (*TINY_ANGLES, 0.5, 1.0, 2.0, 3.0, *NEAR_PI)
    return [(x * angle, y * angle, z * angle) for x, y, z in AXES_3 for angle in angles]


def quaternions(count: int = 20) -> list[Quaternion]:
    """List random and hostile unit quaternions: the lattice of right angles, w = 0, w < 0, tiny and straight turns."""
    hostile = [turned(*vector) for vector in rotation_vectors()]
    return [*random_quaternions(count), *LATTICE, *hostile, *((-x, -y, -z, -w) for x, y, z, w in hostile[::7])]


def turned(rx: float, ry: float, rz: float) -> Quaternion:
    """Give the quaternion of a rotation vector, right where it is tiny."""
    length = math.hypot(rx, ry, rz)
    scale = math.sin(length / 2) / length if length > 1e-8 else 0.5
    return rx * scale, ry * scale, rz * scale, math.cos(length / 2)


def euler_angles(axes: str, count: int = 6) -> list[tuple[float, float, float]]:
    """List angles of a convention: random, at gimbal lock and close to it, tiny."""
    generator = np.random.default_rng(sum(map(ord, axes)))
    locks = (0.0, math.pi) if axes[1] == axes[3] else (-math.pi / 2, math.pi / 2)
    drawn = [(a, b, c) for a, b, c in generator.uniform(-3.1, 3.1, (count, 3)).tolist()]
    near = [(0.7, lock + side * gap, -1.2) for lock in locks for gap in LOCK_GAPS for side in (1, -1)]
    tiny = [(1e-20, 1e-9, -1e-12), (0.0, 5e-8, 0.0), (1e-300, 0.0, 1e-300), (1.0, 0.0, 0.0)]
    return [*drawn, *near, *tiny]
