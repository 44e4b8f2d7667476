"""Kernels of axis and angle; the axis need not be unit."""

from __future__ import annotations

from math import isfinite

from frametool.errors import ValueInvalid
from frametool.geometry.quaternion import canonical, unit_vector

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Namespace, Number, Quaternion


def to_quaternion(
    ax: Number, ay: Number, az: Number, angle: Number, xp: Namespace, *, degrees: bool = False
) -> Quaternion:
    """Return the quaternion x, y, z, w of a turn about a non-zero axis of any length, in radians or degrees."""
    ux, uy, uz = unit_vector(ax, ay, az, xp)
    sine, cosine = xp.half_sincos_deg(angle) if degrees else xp.half_sincos(angle)
    return ux * sine, uy * sine, uz * sine, cosine


def from_quaternion(
    x: Number, y: Number, z: Number, w: Number, xp: Namespace, *, degrees: bool = False
) -> tuple[Number, Number, Number, Number]:
    """Return unit axis and angle in [0, pi] (or 180 degrees); the identity has the axis x.

    At half a turn, where both directions are right, the first non-zero component of the axis is positive.
    """
    x, y, z, w = canonical(x, y, z, w, xp)
    angle = 2.0 * xp.incline(xp.length(x, y, z), abs(w))
    still = (x == 0.0) & (y == 0.0) & (z == 0.0)
    ux, uy, uz = unit_vector(xp.where(still, 1.0, x), y, z, xp)
    return ux, uy, uz, xp.degrees(angle) if degrees else angle


def check(
    ax: float,
    ay: float,
    az: float,
    angle: float,
    *,
    normalize: bool = False,  # noqa: ARG001 - any length is an axis
) -> tuple[float, float, float, float]:
    """Check one axis and angle at the door.

    Raises:
        ValueInvalid: not finite, or the axis is zero.
    """
    if not all(map(isfinite, (ax, ay, az, angle))):
        shown = f"axis {ax:g} {ay:g} {az:g}, angle {angle:g}"
        raise ValueInvalid(f"{shown} is not finite; give finite numbers", rule="not-finite")
    if not (ax or ay or az):
        raise ValueInvalid("axis 0 0 0 has no direction; give a non-zero one", rule="denormalized")
    return ax, ay, az, angle
