"""Kernels of the way between two poses, prepared once and walked at many fractions.

The rotation is a cos(f theta) + c sin(f theta), where c is the unit quaternion at right angles to a in the plane of
a and b: the same slerp as `rigid.interpolate`, without dividing by a sine at every fraction.
Knows numbers only; components are floats or arrays of one shape.
"""

from __future__ import annotations

from frametool.geometry import quaternion
from frametool.geometry.trig import incline

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Eight, Functions, N, Seven


def prepare(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    btx: N, bty: N, btz: N, bx: N, by: N, bz: N, bw: N, xp: Functions[N],
) -> Eight[N]:  # fmt: skip
    """Return the step dx, dy, dz in metres, c as x, y, z, w, and half the arc in radians.

    The arc is the shorter one; at exactly half a turn the sign of b decides.  Equal rotations have arc 0 and c 0.
    """
    where = xp.where
    apart, near = quaternion.halves(ax, ay, az, aw, bx, by, bz, bw, xp)
    sine, cosine = 2.0 * apart * near, (near - apart) * (near + apart)
    still = apart == 0.0
    sign = where(ax * bx + ay * by + az * bz + aw * bw < 0.0, -1.0, 1.0)
    scale = where(still, 0.0, 1.0 / where(still, 1.0, sine))
    to, back = sign * scale, cosine * scale
    return (
        btx - atx, bty - aty, btz - atz,
        to * bx - back * ax, to * by - back * ay, to * bz - back * az, to * bw - back * aw,
        incline(apart, near, xp),
    )  # fmt: skip


def along(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    dx: N, dy: N, dz: N, cx: N, cy: N, cz: N, cw: N, quarter: N,
    fraction: N, xp: Functions[N],
) -> Seven[N]:  # fmt: skip
    """Return the pose at a fraction of the way from a, by what `prepare` gave; unit to some eps.

    fraction: 0 to 1, so that the angle never needs to be reduced.
    """
    sine, cosine = xp.doubled_sincos(fraction * quarter)
    return (
        atx + fraction * dx, aty + fraction * dy, atz + fraction * dz,
        cosine * ax + sine * cx, cosine * ay + sine * cy, cosine * az + sine * cz, cosine * aw + sine * cw,
    )  # fmt: skip
