"""Kernels of the motions of joints: what a joint does to the frame behind it, as components tx, ty, tz, x, y, z, w.

Knows numbers only.  Axes are unit and plain floats; values are floats or arrays.
"""

from __future__ import annotations

from frametool.geometry.trig import half_sincos, half_sincos_deg

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Functions, N, Number, Rigid


def turned(ax: float, ay: float, az: float, angle: N, xp: Functions[N], *, degrees: bool = False) -> Rigid:
    """Return the motion of a revolute or continuous joint: a turn about its axis, in radians or degrees."""
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return 0.0, 0.0, 0.0, _times(ax, sine), _times(ay, sine), _times(az, sine), cosine


def slid(ax: float, ay: float, az: float, distance: N) -> Rigid:
    """Return the motion of a prismatic joint: a shift along its axis, in metres."""
    return _times(ax, distance), _times(ay, distance), _times(az, distance), 0.0, 0.0, 0.0, 1.0


def _times(part: float, values: Number) -> Number:
    """Multiply by a part of an axis, which mostly is 0: then a plain float stays one and costs nothing further on."""
    return part * values if part else 0.0
