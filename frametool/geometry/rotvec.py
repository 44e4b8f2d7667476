"""Kernels of the rotation vector: the axis times the angle, radians."""

from __future__ import annotations

from frametool.errors import ValueInvalid
from frametool.geometry.quaternion import TINY

LIMIT = 1e150  # beyond, the square of the length overflows (and no digit of a turn is left)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.kinds import Namespace, Number, Quaternion, Vector


def to_quaternion(rx: Number, ry: Number, rz: Number, xp: Namespace, *, degrees: bool = False) -> Quaternion:
    """Give the quaternion x, y, z, w of a rotation vector in radians or degrees.

    Exact down to 1e-300: below 1e-9 rad the factor sin(angle/2)/angle is 1/2 to the last bit.
    The unit axis is taken first, so that multiples of 90 degrees about a coordinate axis are exact.
    """
    angle = xp.length(rx, ry, rz)
    sine, cosine = xp.half_sincos_deg(angle) if degrees else xp.half_sincos(angle)
    tiny = angle < TINY
    divisor, factor = xp.where(tiny, 1.0, angle), xp.where(tiny, xp.radians(0.5) if degrees else 0.5, sine)
    return rx / divisor * factor, ry / divisor * factor, rz / divisor * factor, cosine


def from_quaternion(x: Number, y: Number, z: Number, w: Number, xp: Namespace, *, degrees: bool = False) -> Vector:
    """Give the rotation vector of a unit quaternion, of length 0 to pi (or 180 degrees).

    Relative accuracy holds down to 1e-300: below 1e-9 the factor angle/|v| is 2/w.
    Half a turn leaves with the sign the quaternion has.
    """
    sine = xp.length(x, y, z)
    angle = 2.0 * xp.atan2(sine, abs(w))
    tiny = sine < TINY
    divisor = xp.copysign(xp.where(tiny, abs(w), sine), w)
    factor = xp.where(tiny, 2.0, angle)
    if degrees:
        factor = xp.degrees(factor)
    return x / divisor * factor, y / divisor * factor, z / divisor * factor


def check(
    rx: float, ry: float, rz: float, *, normalize: bool = False  # noqa: ARG001 - every length is one
) -> tuple[float, float, float]:
    """Check one at the door.

    Raises:
        ValueInvalid: not finite, or so long that its square overflows.
    """
    if not all(abs(value) <= LIMIT for value in (rx, ry, rz)):
        raise ValueInvalid(f"rotation vector {rx:g} {ry:g} {rz:g} is not finite or too long; give numbers below {LIMIT:g}")
    return rx, ry, rz
