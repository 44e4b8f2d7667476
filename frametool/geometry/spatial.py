"""Wrenches, twists and covariances seen from another frame: what the adjoint of a transform does to them.

A transform is target_from_source as tx, ty, tz, x, y, z, w; vectors are three components, linear part first.
"""

from __future__ import annotations

from frametool.geometry import quaternion

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from frametool.geometry.types import N, Six

    Rows: TypeAlias = Sequence[Sequence[float]]


def move_wrench(
    tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N,
    fx: N, fy: N, fz: N, mx: N, my: N, mz: N,
) -> Six[N]:  # fmt: skip
    """Return force and torque about the target's origin: f' = R f, m' = R m + t x f'.

    f in N and m in Nm about the source's origin. Source: Murray, Li, Sastry 1994, eq. 2.66.
    """
    ax, ay, az = quaternion.rotate(x, y, z, w, fx, fy, fz)
    bx, by, bz = quaternion.rotate(x, y, z, w, mx, my, mz)
    cx, cy, cz = quaternion.cross(tx, ty, tz, ax, ay, az)
    return ax, ay, az, bx + cx, by + cy, bz + cz


def move_twist(
    tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N,
    vx: N, vy: N, vz: N, wx: N, wy: N, wz: N,
) -> Six[N]:  # fmt: skip
    """Return the velocity of the same rigid body at the target's origin: w' = R w, v' = R v + t x w'.

    v in m/s is that of the body's point at the source's origin. Source: Murray, Li, Sastry 1994, eq. 2.58.
    """
    ax, ay, az = quaternion.rotate(x, y, z, w, vx, vy, vz)
    bx, by, bz = quaternion.rotate(x, y, z, w, wx, wy, wz)
    cx, cy, cz = quaternion.cross(tx, ty, tz, bx, by, bz)
    return ax + cx, ay + cy, az + cz, bx, by, bz


def rotate_covariance(x: float, y: float, z: float, w: float, covariance: Sequence[float]) -> list[float]:
    """Turn a 6 x 6 covariance, row-major: each 3 x 3 block C becomes R C R^T.

    That is the covariance of a position and of small rotations about fixed axes, as ROS has it.
    """
    turn = quaternion.to_matrix(x, y, z, w)
    rows = [turn[0:3], turn[3:6], turn[6:9]]
    moved = [0.0] * 36
    for top in (0, 3):
        for left in (0, 3):
            block = [[covariance[6 * (top + i) + left + j] for j in range(3)] for i in range(3)]
            for i, row in enumerate(_product(_product(rows, block), _transposed(rows))):
                moved[6 * (top + i) + left : 6 * (top + i) + left + 3] = row
    return moved


def move_twist_covariance(
    tx: float, ty: float, tz: float, x: float, y: float, z: float, w: float, covariance: Sequence[float]
) -> list[float]:
    """Move the 6 x 6 covariance of a twist: A C A^T, where A is what `move_twist` does."""
    columns = [move_twist(tx, ty, tz, x, y, z, w, *[float(i == j) for j in range(6)]) for i in range(6)]
    adjoint = _transposed(columns)
    rows = [covariance[6 * i : 6 * i + 6] for i in range(6)]
    return [value for row in _product(_product(adjoint, rows), columns) for value in row]


def _product(a: Rows, b: Rows) -> list[list[float]]:
    columns = _transposed(b)
    return [[_inner(row, column) for column in columns] for row in a]


def _inner(row: Sequence[float], column: Sequence[float]) -> float:
    """Return the sum of the products in their order: `sum` compensates its rounding from Python 3.12 on."""
    total = 0.0
    for x, y in zip(row, column, strict=True):
        total += x * y
    return total


def _transposed(a: Rows) -> list[list[float]]:
    return [list(column) for column in zip(*a, strict=True)]
