"""Kernels of the six-dimensional representation: the first two columns of the matrix (Zhou et al. 2019)."""

from __future__ import annotations

from math import isfinite

from frametool.errors import ValueInvalid
from frametool.geometry import floats, matrix
from frametool.geometry.quaternion import cross, to_matrix, unit_vector

PARALLEL = 1e-12  # sine between the columns: below, rounding decides the plane they span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Components, Namespace, Number, Quaternion


def to_quaternion(ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number, xp: Namespace) -> Quaternion:
    """Return the quaternion of two columns, orthonormalised by Gram and Schmidt.

    The columns need be neither unit nor at right angles, but not parallel.
    The second is cleared of the first twice: once leaves a residue where they are nearly parallel (Giraud 2005).
    """
    ax, ay, az = unit_vector(ax, ay, az, xp)
    along = ax * bx + ay * by + az * bz
    bx, by, bz = unit_vector(bx - along * ax, by - along * ay, bz - along * az, xp)
    rest = ax * bx + ay * by + az * bz
    bx, by, bz = bx - rest * ax, by - rest * ay, bz - rest * az
    cx, cy, cz = cross(ax, ay, az, bx, by, bz)
    return matrix.to_quaternion(ax, bx, cx, ay, by, cy, az, bz, cz, xp)


def from_quaternion(x: Number, y: Number, z: Number, w: Number) -> Components:
    """Return r11, r21, r31 and r12, r22, r32."""
    r11, r12, _, r21, r22, _, r31, r32, _ = to_matrix(x, y, z, w)
    return r11, r21, r31, r12, r22, r32


def check(
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
    *,
    normalize: bool = False,  # noqa: ARG001
) -> Components:
    """Check one pair of columns at the door; any two that span a plane will do.

    Raises:
        ValueInvalid: not finite, zero or parallel.
    """
    shown = f"columns {ax:g} {ay:g} {az:g} and {bx:g} {by:g} {bz:g}"
    if not all(map(isfinite, (ax, ay, az, bx, by, bz))):
        raise ValueInvalid(f"{shown} are not finite; give six finite numbers", rule="not-finite")
    if not (ax or ay or az) or not (bx or by or bz):
        raise ValueInvalid(f"{shown} span no plane: one is zero", rule="denormalized")
    first, second = unit_vector(ax, ay, az, floats), unit_vector(bx, by, bz, floats)
    if floats.length(*cross(*first, *second)) <= PARALLEL:
        raise ValueInvalid(f"{shown} span no plane: they are parallel", rule="denormalized")
    return ax, ay, az, bx, by, bz
