"""Kernels of the six-dimensional representation: the first two columns of the matrix (Zhou et al. 2019)."""

from __future__ import annotations

from math import isfinite

from frametool.errors import ValueInvalid
from frametool.geometry import floats, matrix
from frametool.geometry.quaternion import to_matrix, unit_vector

PARALLEL = 1e-12  # sine between the columns: below, rounding decides the plane they span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.kinds import Components, Namespace, Number, Quaternion


def to_quaternion(
    ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number, xp: Namespace
) -> Quaternion:
    """Give the quaternion of two columns, orthonormalised by Gram and Schmidt.

    The columns need be neither unit nor at right angles, but not parallel.
    The second is cleared of the first twice: once leaves a residue where they are nearly parallel (Giraud 2005).
    """
    ax, ay, az = unit_vector(ax, ay, az, xp)
    bx, by, bz = unit_vector(bx, by, bz, xp)
    for _ in range(2):
        along = ax * bx + ay * by + az * bz
        bx, by, bz = unit_vector(bx - along * ax, by - along * ay, bz - along * az, xp)
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return matrix.to_quaternion(ax, bx, cx, ay, by, cy, az, bz, cz, xp)


def from_quaternion(x: Number, y: Number, z: Number, w: Number) -> Components:
    """Give r11, r21, r31 and r12, r22, r32."""
    r11, r12, _, r21, r22, _, r31, r32, _ = to_matrix(x, y, z, w)
    return r11, r21, r31, r12, r22, r32


def check(*columns: float, normalize: bool = False) -> Components:  # noqa: ARG001 - any two columns will do
    """Check one pair of columns at the door.

    Raises:
        ValueInvalid: not finite, zero or parallel.
    """
    shown = f"columns {' '.join(f'{value:g}' for value in columns[:3])} and {' '.join(f'{value:g}' for value in columns[3:])}"
    if not all(map(isfinite, columns)):
        raise ValueInvalid(f"{shown} are not finite; give six finite numbers")
    if not any(columns[:3]) or not any(columns[3:]):
        raise ValueInvalid(f"{shown} span no plane: one is zero")
    (ax, ay, az), (bx, by, bz) = unit_vector(*columns[:3], floats), unit_vector(*columns[3:], floats)
    if floats.length(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx) <= PARALLEL:
        raise ValueInvalid(f"{shown} span no plane: they are parallel")
    return columns
