"""Kernels of the 24 Euler conventions, both ways, by one algorithm.

A convention has the name of tf's `transformations`: `s` (static axes, extrinsic) or `r` (rotating axes, intrinsic)
and three axis letters in the order of the rotations. Angles are in the order of the letters. Knows numbers only.
"""

from __future__ import annotations

from frametool.geometry.floats import RADIAN, bearing, half_sincos, half_sincos_deg, incline
from frametool.geometry.quaternion import EPS, settled

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry import Condition, Four, Functions, N, Three

LOCK = EPS * EPS  # of the squared radii: above 1 eps the angles are determined, and dropping them would be an error


def _plan(name: str) -> tuple[int, int, int, float, bool, bool]:
    """Return the axes i, j, k (outermost first), their parity, and whether symmetric and static."""
    static = name[0] == "s"
    i, j, last = ("xyz".index(letter) for letter in (name[:0:-1] if static else name[1:]))
    return i, j, 3 - i - j, 1.0 if (j - i) % 3 == 1 else -1.0, last == i, static


AXES = {
    name: _plan(name)
    for name in (
        "sxyz", "sxyx", "sxzy", "sxzx", "syzx", "syzy", "syxz", "syxy", "szxy", "szxz", "szyx", "szyz",
        "rzyx", "rxyx", "ryzx", "rxzx", "rxzy", "ryzy", "rzxy", "ryxy", "ryxz", "rzxz", "rxyz", "rzyz",
    )
}  # fmt: skip


def to_quaternion(first: N, second: N, third: N, axes: str, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion x, y, z, w of three angles about the axes of a convention.

    Angles in radians, or in degrees with exact results at multiples of 90.
    Source: the product of three elementary quaternions q_i(a) q_j(b) q_k(c), written out.
    """
    i, j, k, parity, symmetric, static = AXES[axes]
    half = half_sincos_deg if degrees else half_sincos
    sa, ca = half(third if static else first, xp)
    sb, cb = half(second, xp)
    sc, cc = half(first if static else third, xp)
    cosines, sines, mixed, turned = ca * cc, sa * sc, sa * cc, ca * sc
    vector = [cb, cb, cb]
    if symmetric:
        w = cb * (cosines - sines)
        vector[i] = cb * (mixed + turned)
        vector[j] = sb * (cosines + sines)
        vector[k] = sb * (mixed - turned) * parity
    else:
        signed, level = (sb, cb) if parity > 0.0 else (-sb, -cb)
        w = cb * cosines - signed * sines
        vector[i] = cb * mixed + signed * turned
        vector[j] = sb * cosines - level * sines
        vector[k] = cb * turned + signed * mixed
    x, y, z = vector
    return settled(x, y, z, w) if degrees else (x, y, z, w)


def from_quaternion(x: N, y: N, z: N, w: N, axes: str, xp: Functions[N], *, degrees: bool = False) -> Three[N]:
    """Return the three angles of a convention, in the order of its letters.

    The middle angle is in [-pi/2, pi/2], or in [0, pi] if the outer axes are the same; the others in (-pi, pi].
    At gimbal lock the third is 0.  Degrees are exact at multiples of 90.
    Source: Bernardes & Viollet 2022, sum and difference of two angles as directions, by a complex product;
    the middle angle from its sine, so that small angles keep their digits.
    """
    i, j, k, parity, symmetric, static = AXES[axes]
    vector = x, y, z
    a, b, c, d = _pairs(vector, w, i, j, k, parity, symmetric)
    squared_sum, squared_difference = a * a + b * b, c * c + d * d
    radius = xp.sqrt(squared_sum * squared_difference)
    if symmetric:
        middle = 2.0 * incline(xp.sqrt(squared_difference), xp.sqrt(squared_sum), xp)
    else:
        middle = incline(2.0 * (w * vector[j] + (vector[i] * vector[k]) * parity), radius, xp)
    limit = LOCK * (xp.furthest(squared_sum) + xp.furthest(squared_difference))  # of all rows
    if not (xp.least(squared_sum) > limit and xp.least(squared_difference) > limit):
        a, b, c, d, radius = _without_third(a, b, c, d, squared_sum, squared_difference, radius, static, xp)
    ac, bd, ad, bc = a * c, b * d, a * d, b * c
    outer, inner = bearing(bc + ad + 0.0, ac - bd, radius, xp), bearing(bc - ad + 0.0, ac + bd, radius, xp)
    first, third = (inner, outer) if static else (outer, inner)
    return (first * RADIAN, middle * RADIAN, third * RADIAN) if degrees else (first, middle, third)


def from_unreal(roll: N, pitch: N, yaw: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion of an Unreal rotator: yaw to the right, pitch up, roll clockwise, in Unreal's axes.

    Source: FRotator::Quaternion, which CARLA's Rotation follows: that of rpy with x and y negated.
    """
    x, y, z, w = to_quaternion(roll, pitch, yaw, "sxyz", xp, degrees=degrees)
    return 0.0 - x, 0.0 - y, z, w


def as_unreal(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> Three[N]:
    """Return roll, pitch, yaw of an Unreal rotator."""
    return from_quaternion(0.0 - x, 0.0 - y, z, w, "sxyz", xp, degrees=degrees)


def from_unity(x: N, y: N, z: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion of Unity's Quaternion.Euler: about the fixed z, then x, then y, in Unity's axes."""
    return to_quaternion(z, x, y, "szxy", xp, degrees=degrees)


def as_unity(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> Three[N]:
    """Return x, y, z of Unity's eulerAngles, x between -90 and 90 degrees."""
    about_z, about_x, about_y = from_quaternion(x, y, z, w, "szxy", xp, degrees=degrees)
    return about_x, about_y, about_z


def locked(x: N, y: N, z: N, w: N, axes: str) -> Condition:
    """Return True if a convention is at gimbal lock: the first and third axis coincide to 1 eps."""
    i, j, k, parity, symmetric, _ = AXES[axes]
    a, b, c, d = _pairs((x, y, z), w, i, j, k, parity, symmetric)
    squared_sum, squared_difference = a * a + b * b, c * c + d * d
    limit = LOCK * (squared_sum + squared_difference)
    return (squared_sum <= limit) | (squared_difference <= limit)


def _pairs(
    vector: Three[N], w: N, i: int, j: int, k: int, parity: float, symmetric: bool,  # noqa: FBT001
) -> Four[N]:  # fmt: skip
    """Return a, b, c, d: (a, b) points along half the sum of the outer angles, (c, d) along half their difference."""
    vi, vj, vk = vector[i], vector[j], vector[k]
    if symmetric:
        return w, vi, vj, vk * parity
    signed = vj * parity
    return w + signed, vi + vk, w - signed, vi - vk


def _without_third(
    a: N, b: N, c: N, d: N, squared_sum: N, squared_difference: N, radius: N,
    static: bool, xp: Functions[N],  # noqa: FBT001
) -> tuple[N, N, N, N, N]:  # fmt: skip
    """Return the pairs and the product of their lengths, the pair that vanished at gimbal lock replaced by the other.

    For static axes by its mirror image: thus the third angle becomes 0.
    """
    limit = LOCK * (squared_sum + squared_difference)
    no_sum, no_difference = squared_sum <= limit, squared_difference <= limit
    mirrored_b, mirrored_d = (0.0 - b, 0.0 - d) if static else (b, d)
    radius = xp.where(no_sum, squared_difference, xp.where(no_difference, squared_sum, radius))
    return (
        xp.where(no_sum, c, a), xp.where(no_sum, mirrored_d, b),
        xp.where(no_difference, a, c), xp.where(no_difference, mirrored_b, d), radius,
    )  # fmt: skip
