"""Kernels of rotations written along their axis: rotation vector, axis and angle, modified Rodrigues parameters."""

from __future__ import annotations

from math import inf, isfinite

from frametool.errors import ValueInvalid
from frametool.geometry.floats import RADIAN, half_sincos, half_sincos_deg, incline
from frametool.geometry.quaternion import TINY, canonical, direction, length, unit_vector

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Components, Four, Functions, N, Three


def from_rotvec(rx: N, ry: N, rz: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion x, y, z, w of a rotation vector in radians or degrees.

    Exact down to 1e-300: an angle too small to divide by is replaced by one with the same quotient.
    The unit axis is computed first, so that multiples of 90 degrees about a coordinate axis are exact.
    """
    angle = xp.maximum(length(rx, ry, rz, xp), TINY)
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return rx / angle * sine, ry / angle * sine, rz / angle * sine, cosine


def as_rotvec(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> Three[N]:
    """Return the rotation vector of a unit quaternion, of length 0 to pi (or 180 degrees).

    Relative accuracy holds down to 1e-300.  The sign of the quaternion decides at 180 degrees.
    """
    sine = xp.maximum(length(x, y, z, xp), TINY)
    angle = xp.copysign(2.0 * incline(sine, abs(w), xp), w)
    if degrees:
        angle *= RADIAN
    return x / sine * angle, y / sine * angle, z / sine * angle


def check_rotvec(*vector: float, what: str = "rotation vector", normalize: bool = False) -> Components:  # noqa: ARG001
    """Check one rotation vector and return it.

    Raises:
        ValueInvalid: not finite, or so long that its square overflows.
    """
    x, y, z = vector
    if not x * x + y * y + z * z < inf:
        shown = f"{what} {x:g} {y:g} {z:g}"
        raise ValueInvalid(f"{shown} is not finite or too long; give numbers below 1e+150", rule="not-finite")
    return vector


def from_axis_angle(ax: N, ay: N, az: N, angle: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion x, y, z, w of a rotation about a non-zero axis of any length, in radians or degrees."""
    ux, uy, uz = unit_vector(ax, ay, az, xp)
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return ux * sine, uy * sine, uz * sine, cosine


def as_axis_angle(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> tuple[N, N, N, N]:
    """Return unit axis and angle in [0, pi] (or 180 degrees); the identity has the axis x.

    At 180 degrees, where both directions are correct, the first non-zero component of the axis is positive.
    """
    x, y, z, w = canonical(x, y, z, w, xp)
    ux, uy, uz, sine = direction(x, y, z, xp)
    angle = 2.0 * incline(sine, abs(w), xp)
    return ux, uy, uz, angle * RADIAN if degrees else angle


def check_axis_angle(*axis_and_angle: float, normalize: bool = False) -> Components:  # noqa: ARG001 - any length is an axis
    """Check one axis and angle and return them.

    Raises:
        ValueInvalid: not finite, or the axis is zero.
    """
    ax, ay, az, angle = axis_and_angle
    if not all(map(isfinite, axis_and_angle)):
        shown = f"axis {ax:g} {ay:g} {az:g}, angle {angle:g}"
        raise ValueInvalid(f"{shown} is not finite; give finite numbers", rule="not-finite")
    if not (ax or ay or az):
        raise ValueInvalid("axis 0 0 0 has no direction; give a non-zero one", rule="denormalized")
    return axis_and_angle


def from_mrp(px: N, py: N, pz: N) -> Four[N]:
    """Return the quaternion x, y, z, w of modified Rodrigues parameters (Schaub & Junkins 1996)."""
    squared = px * px + py * py + pz * pz
    scale = 1.0 / (1.0 + squared)
    return 2.0 * px * scale, 2.0 * py * scale, 2.0 * pz * scale, (1.0 - squared) * scale


def as_mrp(x: N, y: N, z: N, w: N, xp: Functions[N]) -> Three[N]:
    """Return modified Rodrigues parameters of length 0 to 1: those of the shorter rotation."""
    divisor = xp.copysign(1.0 + abs(w), xp.first_nonzero(w, x, y, z))
    return x / divisor, y / divisor, z / divisor
