"""Kernels of the way between two poses, prepared once and walked at many fractions.

The rotation is a cos(f theta) + c sin(f theta), where c is the unit quaternion at right angles to a in the plane of
a and b: the same slerp as `rigid.interpolate`, without dividing by a sine at every fraction.
Knows numbers only; components are floats or arrays of one shape.
"""

from __future__ import annotations

from frametool.geometry import quaternion

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import TypeAlias

    from frametool.geometry.types import Namespace, Number, Rigid

    Way: TypeAlias = tuple[Number, Number, Number, Number, Number, Number, Number, Number]


def prepare(
    atx: Number, aty: Number, atz: Number, ax: Number, ay: Number, az: Number, aw: Number,
    btx: Number, bty: Number, btz: Number, bx: Number, by: Number, bz: Number, bw: Number, xp: Namespace,
) -> Way:  # fmt: skip
    """Return the step dx, dy, dz in metres, c as x, y, z, w, and twice the arc theta in radians.

    The arc is the shorter one; at exactly half a turn the sign of b decides.  Equal rotations have arc 0 and c 0.
    """
    where = xp.where
    theta = quaternion.arc(ax, ay, az, aw, bx, by, bz, bw, xp)
    sine, cosine = xp.half_sincos(2.0 * theta)
    still = theta == 0.0
    sign = where(ax * bx + ay * by + az * bz + aw * bw < 0.0, -1.0, 1.0)
    scale = where(still, 0.0, 1.0 / where(still, 1.0, sine))
    toward = sign * scale
    back = cosine * scale
    return (
        btx - atx, bty - aty, btz - atz,
        toward * bx - back * ax, toward * by - back * ay, toward * bz - back * az, toward * bw - back * aw,
        2.0 * theta,
    )  # fmt: skip


def along(
    atx: Number, aty: Number, atz: Number, ax: Number, ay: Number, az: Number, aw: Number,
    dx: Number, dy: Number, dz: Number, cx: Number, cy: Number, cz: Number, cw: Number, arc: Number,
    fraction: Number, xp: Namespace,
) -> Rigid:  # fmt: skip
    """Return the pose at a fraction of the way from a, by what `prepare` gave; unit to some eps."""
    sine, cosine = xp.half_sincos(fraction * arc)
    return (
        atx + fraction * dx, aty + fraction * dy, atz + fraction * dz,
        cosine * ax + sine * cx, cosine * ay + sine * cy, cosine * az + sine * cz, cosine * aw + sine * cw,
    )  # fmt: skip
