"""Kernels of the six-dimensional representation: the first two columns of the matrix (Zhou et al. 2019)."""

from __future__ import annotations

from math import inf, isfinite

from frametool.errors import ValueInvalid
from frametool.geometry import floats, matrix
from frametool.geometry.quaternion import cross, length, to_matrix, unit_vector

PARALLEL = 1e-12  # sine between the columns: below, rounding decides the plane they span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Components, Four, Functions, N, Six


def to_quaternion(ax: N, ay: N, az: N, bx: N, by: N, bz: N, xp: Functions[N]) -> Four[N]:
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


def from_quaternion(x: N, y: N, z: N, w: N) -> Six[N]:
    """Return r11, r21, r31 and r12, r22, r32."""
    r11, r12, _, r21, r22, _, r31, r32, _ = to_matrix(x, y, z, w)
    return r11, r21, r31, r12, r22, r32


def deviation(ax: N, ay: N, az: N, bx: N, by: N, bz: N, xp: Functions[N]) -> N:
    """Return 0 where two columns span a plane, else inf."""
    sine = length(*cross(*unit_vector(ax, ay, az, xp), *unit_vector(bx, by, bz, xp)), xp)
    return xp.where(sine > PARALLEL, 0.0, inf)


def furthest(ax: N, ay: N, az: N, bx: N, by: N, bz: N, xp: Functions[N]) -> float:
    """Return 0 where all pairs of columns span a plane, else inf."""
    return xp.furthest(deviation(ax, ay, az, bx, by, bz, xp))


def repaired(ax: N, ay: N, az: N, bx: N, by: N, bz: N, _xp: Functions[N]) -> Six[N]:
    """Return two columns as they are: `to_quaternion` takes any that span a plane."""
    return ax, ay, az, bx, by, bz


def check(*columns: float, normalize: bool = False) -> Components:  # noqa: ARG001 - any two that span a plane
    """Return one pair of columns back.

    Raises:
        ValueInvalid: not finite, zero or parallel.
    """
    ax, ay, az, bx, by, bz = columns
    shown = f"columns {ax:g} {ay:g} {az:g} and {bx:g} {by:g} {bz:g}"
    if not all(map(isfinite, columns)):
        raise ValueInvalid(f"{shown} are not finite; give six finite numbers", rule="not-finite")
    if not (ax or ay or az) or not (bx or by or bz):
        raise ValueInvalid(f"{shown} span no plane: one is zero", rule="denormalized")
    if deviation(ax, ay, az, bx, by, bz, floats):
        raise ValueInvalid(f"{shown} span no plane: they are parallel", rule="denormalized")
    return columns
