"""Kernels of rigid transforms: translation tx, ty, tz in metres, then the unit quaternion x, y, z, w.

Knows numbers only; components are floats or arrays of one shape.
"""

from __future__ import annotations

from math import isfinite

from frametool.errors import ValueInvalid
from frametool.geometry import quaternion, rotvec
from frametool.geometry.quaternion import cross

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Components, Namespace, Number, Pair, Rigid, Vector

SERIES_EXP = 1.5  # rad: above, a - sin(a) loses less than a digit; below, ten terms of its series are exact
SERIES_LOG = 0.6  # rad: the same for 1 - (a/2) cot(a/2) and six terms
# (-1)^n / (2n + 3)! : the series of (a - sin a)/a^3 in a^2
SINE_REST = (1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800, -1 / 6227020800, 1 / 1307674368000,
             -1 / 355687428096000, 1 / 121645100408832000)  # fmt: skip
# |B_2n| / (2n)! : the series of (1 - (a/2) cot(a/2))/a^2 in a^2, Bernoulli's numbers
COTANGENT_REST = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600,
                  3617 / 10670622842880000)  # fmt: skip


def compose(
    atx: Number, aty: Number, atz: Number, ax: Number, ay: Number, az: Number, aw: Number,
    btx: Number, bty: Number, btz: Number, bx: Number, by: Number, bz: Number, bw: Number,
) -> Rigid:  # fmt: skip
    """Return a_from_c of a_from_b and b_from_c."""
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = quaternion.to_matrix(ax, ay, az, aw)
    x, y, z, w = quaternion.compose(ax, ay, az, aw, bx, by, bz, bw)
    return (
        r11 * btx + r12 * bty + r13 * btz + atx, r21 * btx + r22 * bty + r23 * btz + aty,
        r31 * btx + r32 * bty + r33 * btz + atz, x, y, z, w,
    )  # fmt: skip


def inverse(tx: Number, ty: Number, tz: Number, x: Number, y: Number, z: Number, w: Number) -> Rigid:
    """Return b_from_a of a_from_b."""
    x, y, z, w = quaternion.conjugate(x, y, z, w)
    rx, ry, rz = quaternion.rotate(x, y, z, w, tx, ty, tz)
    return 0.0 - rx, 0.0 - ry, 0.0 - rz, x, y, z, w


def apply(
    tx: Number, ty: Number, tz: Number, x: Number, y: Number, z: Number, w: Number, px: Number, py: Number, pz: Number
) -> Vector:
    """Move a point: rotate, then shift."""
    rx, ry, rz = quaternion.rotate(x, y, z, w, px, py, pz)
    return rx + tx, ry + ty, rz + tz


def relative(
    atx: Number, aty: Number, atz: Number, ax: Number, ay: Number, az: Number, aw: Number,
    btx: Number, bty: Number, btz: Number, bx: Number, by: Number, bz: Number, bw: Number,
) -> Rigid:  # fmt: skip
    """Return inverse(a) b; the translations are subtracted first, so that near poses keep their digits."""
    x, y, z, w = quaternion.conjugate(ax, ay, az, aw)
    tx, ty, tz = quaternion.rotate(x, y, z, w, btx - atx, bty - aty, btz - atz)
    return tx, ty, tz, *quaternion.compose(x, y, z, w, bx, by, bz, bw)


def interpolate(
    atx: Number, aty: Number, atz: Number, ax: Number, ay: Number, az: Number, aw: Number,
    btx: Number, bty: Number, btz: Number, bx: Number, by: Number, bz: Number, bw: Number,
    fraction: Number, xp: Namespace,
) -> Rigid:  # fmt: skip
    """Return the pose between two: the translation along the straight line, the rotation by slerp, as tf2 does.

    fraction: 0 gives a and 1 gives b to the bit; outside is extrapolated.
    """
    rotation = quaternion.slerp(ax, ay, az, aw, bx, by, bz, bw, fraction, xp)
    between = tuple(_line(a, b, fraction, xp) for a, b in ((atx, btx), (aty, bty), (atz, btz)))
    tx, ty, tz = quaternion.ends((atx, aty, atz), between, (btx, bty, btz), fraction, xp)
    return tx, ty, tz, *rotation


def _line(start: Number, end: Number, fraction: Number, xp: Namespace) -> Number:
    """Interpolate two numbers from the nearer end."""
    step = end - start
    return xp.where(fraction < 0.5, start + fraction * step, end - (1.0 - fraction) * step)


def distance(
    atx: Number, aty: Number, atz: Number, ax: Number, ay: Number, az: Number, aw: Number,
    btx: Number, bty: Number, btz: Number, bx: Number, by: Number, bz: Number, bw: Number, xp: Namespace,
) -> Pair:  # fmt: skip
    """Return the metres and the radians between two poses."""
    metres = xp.length(btx - atx, bty - aty, btz - atz)
    return metres, quaternion.distance(ax, ay, az, aw, bx, by, bz, bw, xp)


def to_matrix(tx: Number, ty: Number, tz: Number, x: Number, y: Number, z: Number, w: Number) -> Components:
    """Return the upper twelve entries m11 .. m34 of the homogeneous matrix, row-major; the last row is 0 0 0 1."""
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = quaternion.to_matrix(x, y, z, w)
    return r11, r12, r13, tx, r21, r22, r23, ty, r31, r32, r33, tz


def to_homogeneous(
    tx: Number, ty: Number, tz: Number, x: Number, y: Number, z: Number, w: Number, _xp: Namespace
) -> Components:
    """Return the sixteen entries of the homogeneous matrix, row-major."""
    return *to_matrix(tx, ty, tz, x, y, z, w), 0.0, 0.0, 0.0, 1.0


def check_twist(vx: float, vy: float, vz: float, wx: float, wy: float, wz: float) -> None:
    """Raise ValueInvalid for a twist that is not finite, or turns so far that no digit of the angle is left."""
    if not all(isfinite(value) for value in (vx, vy, vz)):
        raise ValueInvalid(f"twist {vx:g} {vy:g} {vz:g} is not finite; give finite numbers")
    rotvec.check(wx, wy, wz)


def exp(vx: Number, vy: Number, vz: Number, wx: Number, wy: Number, wz: Number, xp: Namespace) -> Rigid:
    """Return the transform reached by a constant twist in unit time.

    v in metres, w in radians, linear part first as in ROS messages.
    Source: Murray, Li & Sastry 1994: t = v + B w x v + C w x (w x v), B = (1 - cos a)/a^2, C = (a - sin a)/a^3.
    """
    angle = xp.maximum(xp.length(wx, wy, wz), quaternion.TINY)
    half_sine, half_cosine = xp.half_sincos(angle)
    low = angle < SERIES_EXP
    ratio = half_sine / angle
    low_square, high = xp.where(low, angle, 0.0), xp.where(low, SERIES_EXP, angle)
    series = _polynomial(low_square * low_square, SINE_REST)
    second = xp.where(low, series, (high - 2.0 * half_sine * half_cosine) / (high * high * high))
    cx, cy, cz = cross(wx, wy, wz, vx, vy, vz)
    dx, dy, dz = cross(wx, wy, wz, cx, cy, cz)
    first = 2.0 * ratio * ratio
    return (
        vx + (first * cx + second * dx), vy + (first * cy + second * dy), vz + (first * cz + second * dz),
        wx / angle * half_sine, wy / angle * half_sine, wz / angle * half_sine, half_cosine,
    )  # fmt: skip


def log(tx: Number, ty: Number, tz: Number, x: Number, y: Number, z: Number, w: Number, xp: Namespace) -> Components:
    """Return the twist vx, vy, vz, wx, wy, wz whose `exp` is this transform, with an angle up to pi.

    Source: v = t - w x t / 2 + D w x (w x t), D = (1 - (a/2) cot(a/2))/a^2, by its series below 0.6 rad.
    """
    wx, wy, wz = rotvec.from_quaternion(x, y, z, w, xp)
    sine, cosine = xp.length(x, y, z), abs(w)
    half = xp.incline(sine, cosine)
    squared = 4.0 * half * half
    low = 2.0 * half < SERIES_LOG
    series = _polynomial(xp.where(low, squared, 0.0), COTANGENT_REST)
    factor = xp.where(low, series, (1.0 - half * cosine / xp.where(low, 1.0, sine)) / xp.where(low, 1.0, squared))
    cx, cy, cz = cross(wx, wy, wz, tx, ty, tz)
    dx, dy, dz = cross(wx, wy, wz, cx, cy, cz)
    return tx + (factor * dx - 0.5 * cx), ty + (factor * dy - 0.5 * cy), tz + (factor * dz - 0.5 * cz), wx, wy, wz


def _polynomial(x: Number, coefficients: tuple[float, ...]) -> Number:
    """Evaluate a polynomial by Horner's rule, lowest coefficient first."""
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value
