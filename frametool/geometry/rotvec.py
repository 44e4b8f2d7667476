"""Kernels of the rotation vector: the axis times the angle, radians."""

from __future__ import annotations

from math import inf

from frametool.errors import ValueInvalid
from frametool.geometry.quaternion import TINY, length
from frametool.geometry.trig import RADIAN, half_sincos, half_sincos_deg, incline

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Components, Four, Functions, N, Three


def to_quaternion(rx: N, ry: N, rz: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion x, y, z, w of a rotation vector in radians or degrees.

    Exact down to 1e-300: an angle too small to be divided by stands for all smaller ones, with the same quotient.
    The unit axis is taken first, so that multiples of 90 degrees about a coordinate axis are exact.
    """
    angle = xp.maximum(length(rx, ry, rz, xp), TINY)
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return rx / angle * sine, ry / angle * sine, rz / angle * sine, cosine


def from_quaternion(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> Three[N]:
    """Return the rotation vector of a unit quaternion, of length 0 to pi (or 180 degrees).

    Relative accuracy holds down to 1e-300.  Half a turn leaves with the sign the quaternion has.
    """
    sine = xp.maximum(length(x, y, z, xp), TINY)
    angle = xp.copysign(2.0 * incline(sine, abs(w), xp), w)
    if degrees:
        angle *= RADIAN
    return x / sine * angle, y / sine * angle, z / sine * angle


def check(*vector: float, what: str = "rotation vector", normalize: bool = False) -> Components:  # noqa: ARG001
    """Return one back.

    Raises:
        ValueInvalid: not finite, or so long that its square overflows.
    """
    x, y, z = vector
    if not x * x + y * y + z * z < inf:
        shown = f"{what} {x:g} {y:g} {z:g}"
        raise ValueInvalid(f"{shown} is not finite or too long; give numbers below 1e+150", rule="not-finite")
    return vector
