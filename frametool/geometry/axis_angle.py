"""Kernels of axis and angle; the axis need not be unit."""

from __future__ import annotations

from math import isfinite

from frametool.errors import ValueInvalid
from frametool.geometry.quaternion import canonical, direction, unit_vector
from frametool.geometry.trig import RADIAN, half_sincos, half_sincos_deg, incline

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Components, Four, Functions, N


def to_quaternion(ax: N, ay: N, az: N, angle: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion x, y, z, w of a turn about a non-zero axis of any length, in radians or degrees."""
    ux, uy, uz = unit_vector(ax, ay, az, xp)
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return ux * sine, uy * sine, uz * sine, cosine


def from_quaternion(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> tuple[N, N, N, N]:
    """Return unit axis and angle in [0, pi] (or 180 degrees); the identity has the axis x.

    At half a turn, where both directions are right, the first non-zero component of the axis is positive.
    """
    x, y, z, w = canonical(x, y, z, w, xp)
    ux, uy, uz, sine = direction(x, y, z, xp)
    angle = 2.0 * incline(sine, abs(w), xp)
    return ux, uy, uz, angle * RADIAN if degrees else angle


def check(*axis_and_angle: float, normalize: bool = False) -> Components:  # noqa: ARG001 - any length is an axis
    """Return one axis and angle back.

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
