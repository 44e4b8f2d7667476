"""Kernels of the way between two poses, prepared once and walked at many fractions.

The rotation is that of `quaternion.slerp`, to the bit once it is normalised; what does not depend on the fraction is
computed once.
Knows numbers only; components are floats or arrays of one shape.
"""

from __future__ import annotations

from frametool.geometry import quaternion

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Eight, Functions, N, Seven


def prepare(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    btx: N, bty: N, btz: N, bx: N, by: N, bz: N, bw: N, xp: Functions[N],
) -> Eight[N]:  # fmt: skip
    """Return the step dx, dy, dz in metres, then what `quaternion.toward` does: c as x, y, z, w, and half the arc."""
    cx, cy, cz, cw, half_arc = quaternion.toward(ax, ay, az, aw, bx, by, bz, bw, xp)
    return btx - atx, bty - aty, btz - atz, cx, cy, cz, cw, half_arc


def along(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    dx: N, dy: N, dz: N, cx: N, cy: N, cz: N, cw: N, half_arc: N,
    fraction: N, xp: Functions[N],
) -> Seven[N]:  # fmt: skip
    """Return the pose at a fraction of the way from a, by what `prepare` gave; unit to some eps.

    fraction: 0 to 1, so that the angle never needs to be reduced.
    """
    sine, cosine = xp.doubled_sincos(fraction * half_arc)
    return (
        atx + fraction * dx, aty + fraction * dy, atz + fraction * dz,
        cosine * ax + sine * cx, cosine * ay + sine * cy, cosine * az + sine * cz, cosine * aw + sine * cw,
    )  # fmt: skip
