"""Kernels of the rotation vector: the axis times the angle, radians."""

from __future__ import annotations

from frametool.errors import ValueInvalid
from frametool.geometry.quaternion import TINY

LIMIT = 1e150  # beyond, the square of the length overflows (and no digit of a turn is left)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Namespace, Number, Quaternion, Vector


def to_quaternion(rx: Number, ry: Number, rz: Number, xp: Namespace, *, degrees: bool = False) -> Quaternion:
    """Return the quaternion x, y, z, w of a rotation vector in radians or degrees.

    Exact down to 1e-300: an angle too small to be divided by stands for all smaller ones, with the same quotient.
    The unit axis is taken first, so that multiples of 90 degrees about a coordinate axis are exact.
    """
    angle = xp.maximum(xp.length(rx, ry, rz), TINY)
    sine, cosine = xp.half_sincos_deg(angle) if degrees else xp.half_sincos(angle)
    return rx / angle * sine, ry / angle * sine, rz / angle * sine, cosine


def from_quaternion(x: Number, y: Number, z: Number, w: Number, xp: Namespace, *, degrees: bool = False) -> Vector:
    """Return the rotation vector of a unit quaternion, of length 0 to pi (or 180 degrees).

    Relative accuracy holds down to 1e-300.  Half a turn leaves with the sign the quaternion has.
    """
    sine = xp.maximum(xp.length(x, y, z), TINY)
    angle = xp.copysign(2.0 * xp.incline(sine, abs(w)), w)
    if degrees:
        angle = xp.degrees(angle)
    return x / sine * angle, y / sine * angle, z / sine * angle


def check(
    rx: float,
    ry: float,
    rz: float,
    *,
    normalize: bool = False,  # noqa: ARG001 - every length is one
) -> tuple[float, float, float]:
    """Check one at the door.

    Raises:
        ValueInvalid: not finite, or so long that its square overflows.
    """
    if not all(abs(value) <= LIMIT for value in (rx, ry, rz)):
        shown = f"rotation vector {rx:g} {ry:g} {rz:g}"
        raise ValueInvalid(f"{shown} is not finite or too long; give numbers below {LIMIT:g}", rule="not-finite")
    return rx, ry, rz
