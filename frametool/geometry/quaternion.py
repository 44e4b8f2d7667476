"""Kernels on quaternions x, y, z, w (Hamilton, active): products, norms, signs, arcs.

Knows numbers only. Unless said otherwise the inputs are unit to a few eps; components are floats or arrays.
"""

from __future__ import annotations

from frametool.errors import ValueInvalid, warn
from frametool.geometry import floats

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Components, Matrix, Namespace, Number, Quaternion, Vector

EPS = 2.0**-52
UNIT = 4 * EPS  # one normalisation leaves |n^2 - 1| below 3 eps: what lies within 4 is left alone, bit for bit
SILENT = 1e-6
TOLERATED = 1e-3
TINY = 1e-150  # the least angle divided by: sin(x)/x is 1 there, and parts down to 1e-308 survive the quotient


def squared_norm(x: Number, y: Number, z: Number, w: Number) -> Number:
    """Return x^2 + y^2 + z^2 + w^2; right for norms between 1e-150 and 1e150."""
    return x * x + y * y + z * z + w * w


def product(
    ax: Number, ay: Number, az: Number, aw: Number, bx: Number, by: Number, bz: Number, bw: Number
) -> Quaternion:
    """Multiply two quaternions of any norm: the rotation b followed by the rotation a (Hamilton 1843)."""
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def compose(
    ax: Number, ay: Number, az: Number, aw: Number, bx: Number, by: Number, bz: Number, bw: Number
) -> Quaternion:
    """Multiply two unit quaternions and take the rounding off the norm: multiples of 90 degrees stay exact.

    `product` and `settled` written as one: the call every lookup makes at every edge.
    """
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    norm = 0.5 + 0.5 * (x * x + y * y + z * z + w * w)
    return x / norm, y / norm, z / norm, w / norm


def settled(x: Number, y: Number, z: Number, w: Number) -> Quaternion:
    """Take the last rounding off the norm of a quaternion that is unit to 1e-8.

    (1 + n^2)/2 is the norm to first order, and needs no root.  Divided by it, the products of 0, 1/2, sqrt(1/2)
    and 1 that right angles consist of become these doubles again.
    """
    norm = 0.5 + 0.5 * (x * x + y * y + z * z + w * w)
    return x / norm, y / norm, z / norm, w / norm


def conjugate(x: Number, y: Number, z: Number, w: Number) -> Quaternion:
    """Return the inverse of a unit quaternion; zeros stay +0."""
    return 0.0 - x, 0.0 - y, 0.0 - z, w


def unit(x: Number, y: Number, z: Number, w: Number, xp: Namespace) -> Quaternion:
    """Normalise a quaternion of moderate norm; what is unit to 4 eps keeps its bits."""
    squared = x * x + y * y + z * z + w * w
    if xp.all_near_one(squared, UNIT):
        return x, y, z, w
    norm = xp.where(abs(squared - 1.0) > UNIT, xp.sqrt(squared), 1.0)
    return x / norm, y / norm, z / norm, w / norm


def normalized(x: Number, y: Number, z: Number, w: Number, xp: Namespace) -> Quaternion:
    """Normalise a non-zero quaternion of any norm, 1e-310 to 1e300.

    Scaling by the power of two of the largest component is exact, so the squares neither overflow nor vanish.
    """
    largest = xp.maximum(xp.maximum(abs(x), abs(y)), xp.maximum(abs(z), abs(w)))
    shift = -xp.frexp(largest)[1]
    x, y, z, w = xp.ldexp(x, shift), xp.ldexp(y, shift), xp.ldexp(z, shift), xp.ldexp(w, shift)
    norm = xp.sqrt(x * x + y * y + z * z + w * w)
    return x / norm, y / norm, z / norm, w / norm


def canonical(x: Number, y: Number, z: Number, w: Number, xp: Namespace) -> Quaternion:
    """Choose between q and -q: w > 0, or w == 0 and the first non-zero of x, y, z positive."""
    quaternion: Quaternion = xp.canonical_sign(x, y, z, w)
    return quaternion


def from_quaternion(x: Number, y: Number, z: Number, w: Number, xp: Namespace) -> Quaternion:
    """Return the quaternion as it leaves: unit, with the canonical sign."""
    return canonical(*unit(x, y, z, w, xp), xp)


def angle(x: Number, y: Number, z: Number, w: Number, xp: Namespace) -> Number:
    """Return the rotation angle in [0, pi] radians, accurate at both ends (half the angle by atan2)."""
    return 2.0 * xp.incline(xp.length(x, y, z), abs(w))


def arc(
    ax: Number, ay: Number, az: Number, aw: Number, bx: Number, by: Number, bz: Number, bw: Number, xp: Namespace,
) -> Number:  # fmt: skip
    """Return the angle in [0, pi/2] between two quaternions as vectors, q and -q being one: half the rotation's.

    Source: Kahan, 2 atan2(|b - a|, |b + a|); it keeps its relative accuracy for the smallest arcs.
    """
    apart = xp.sqrt(squared_norm(bx - ax, by - ay, bz - az, bw - aw))
    along = xp.sqrt(squared_norm(bx + ax, by + ay, bz + az, bw + aw))
    return 2.0 * xp.incline(0.5 * xp.minimum(apart, along), 0.5 * xp.maximum(apart, along))


def distance(
    ax: Number, ay: Number, az: Number, aw: Number, bx: Number, by: Number, bz: Number, bw: Number, xp: Namespace,
) -> Number:  # fmt: skip
    """Return the angle in [0, pi] of the rotation between two."""
    return 2.0 * arc(ax, ay, az, aw, bx, by, bz, bw, xp)


def slerp(
    ax: Number, ay: Number, az: Number, aw: Number, bx: Number, by: Number, bz: Number, bw: Number,
    fraction: Number, xp: Namespace,
) -> Quaternion:  # fmt: skip
    """Interpolate two unit quaternions along the shorter arc.

    fraction: 0 gives a and 1 gives b to the bit; outside is extrapolated.
    Returns x, y, z, w, unit.  At exactly half a turn both arcs are shortest; the sign of b decides.
    Source: Shoemake 1985, with sin((1-f)a)/sin(a) written as cos(fa) - cos(a) sin(fa)/sin(a): one sine and cosine.
    """
    theta = xp.maximum(arc(ax, ay, az, aw, bx, by, bz, bw, xp), TINY)
    sine, cosine = xp.half_sincos(2.0 * theta)
    part_sine, part_cosine = xp.half_sincos(2.0 * (fraction * theta))
    to_b = part_sine / sine
    to_a = part_cosine - cosine * to_b
    signed = to_b * xp.copysign(1.0, ax * bx + ay * by + az * bz + aw * bw + 0.0)
    mixed = unit(
        to_a * ax + signed * bx, to_a * ay + signed * by, to_a * az + signed * bz, to_a * aw + signed * bw, xp
    )  # fmt: skip
    x, y, z, w = ends((ax, ay, az, aw), mixed, (bx, by, bz, bw), fraction, xp)
    return x, y, z, w


def ends(start: Components, between: Components, end: Components, fraction: Number, xp: Namespace) -> Components:
    """Put the very ends, to the bit, where the fraction is 0 or 1."""
    at_start, at_end = fraction == 0.0, fraction == 1.0
    if not xp.some(at_start | at_end):
        return between
    return tuple(
        xp.where(at_start, a, xp.where(at_end, b, mixed)) for a, mixed, b in zip(start, between, end, strict=True)
    )


def to_matrix(x: Number, y: Number, z: Number, w: Number) -> Matrix:
    """Return the rotation matrix r11 .. r33, row-major.

    Dividing by the norm actually computed makes multiples of 90 degrees exact and forgives a few eps of norm.
    """
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    xs, ys, zs = x * scale, y * scale, z * scale
    wx, wy, wz = w * xs, w * ys, w * zs
    xx, xy, xz = x * xs, x * ys, x * zs
    yy, yz, zz = y * ys, y * zs, z * zs
    return (
        1.0 - (yy + zz), xy - wz, xz + wy,
        xy + wz, 1.0 - (xx + zz), yz - wx,
        xz - wy, yz + wx, 1.0 - (xx + yy),
    )  # fmt: skip


def rotate(x: Number, y: Number, z: Number, w: Number, px: Number, py: Number, pz: Number) -> Vector:
    """Rotate a vector, through the matrix: the shorter cross products leave residue at 90 degrees."""
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = to_matrix(x, y, z, w)
    return r11 * px + r12 * py + r13 * pz, r21 * px + r22 * py + r23 * pz, r31 * px + r32 * py + r33 * pz


def check(x: float, y: float, z: float, w: float, *, normalize: bool = False) -> tuple[float, float, float, float]:
    """Check one quaternion at the door and give it unit.

    Within 1e-6 of norm 1 in silence, within 1e-3 with a warning; with `normalize` any non-zero finite one.

    Raises:
        ValueInvalid: zero, not finite, or not of norm 1.
    """
    squared = x * x + y * y + z * z + w * w
    if abs(squared - 1.0) <= UNIT:
        return x, y, z, w
    norm = floats.length(x, y, z, w)
    problem = complaint(x, y, z, w, norm, normalize=normalize)
    if problem:
        raise problem
    if abs(norm - 1.0) > SILENT and not normalize:
        warn(f"quaternion {x:g} {y:g} {z:g} {w:g} has norm {_shown(norm)} and was normalised", rule="rounded")
    return normalized(x, y, z, w, floats)


def _shown(norm: float) -> str:
    """Write a norm with six digits, or as many as tell it from 1."""
    return f"{norm:.6g}" if f"{norm:.6g}" != "1" else f"{norm:.9g}"


def complaint(x: float, y: float, z: float, w: float, norm: float, *, normalize: bool) -> ValueInvalid | None:
    """Make the error for a quaternion of this norm that is refused; None if it is not."""
    shown = f"quaternion {x:g} {y:g} {z:g} {w:g}"
    if norm == 0.0:
        return ValueInvalid(f"{shown} has no direction; give a non-zero one", rule="denormalized")
    if not all(abs(value) < float("inf") for value in (x, y, z, w)):
        return ValueInvalid(f"{shown} is not finite; give four finite numbers", rule="not-finite")
    if normalize or abs(norm - 1.0) <= TOLERATED:
        return None
    message = f"{shown} has norm {_shown(norm)}; a rotation needs norm 1 (normalize it with --normalize)"
    return ValueInvalid(message, rule="denormalized")


def between(ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number, xp: Namespace) -> Quaternion:
    """Return the shortest rotation that turns the direction a into the direction b.

    The turn by twice the angle between a and the bisector a + b.  Near opposite directions the bisector is all
    rounding along a - b, which is taken out of it (a + b itself is exact there); opposite to 1 eps: half a turn
    about an axis at right angles to a.
    """
    ax, ay, az = unit_vector(ax, ay, az, xp)
    bx, by, bz = unit_vector(bx, by, bz, xp)
    mx, my, mz = ax + bx, ay + by, az + bz
    dx, dy, dz = ax - bx, ay - by, az - bz
    apart = dx * dx + dy * dy + dz * dz
    along = xp.where(apart > 2.0, mx * dx + my * dy + mz * dz, 0.0) / xp.maximum(apart, 2.0)
    mx, my, mz = mx - along * dx, my - along * dy, mz - along * dz
    opposite = abs(mx) + abs(my) + abs(mz) <= EPS
    sx, sy, sz = _sideways(ax, ay, az, xp)
    mx, my, mz = unit_vector(xp.where(opposite, sx, mx), xp.where(opposite, sy, my), xp.where(opposite, sz, mz), xp)
    return *cross(ax, ay, az, mx, my, mz), ax * mx + ay * my + az * mz


def _sideways(x: Number, y: Number, z: Number, xp: Namespace) -> Vector:
    """Return a vector at right angles to a unit vector, from the coordinate axis farthest from it."""
    use_x = (abs(x) <= abs(y)) & (abs(x) <= abs(z))
    use_y = abs(y) <= abs(z)
    zero = 0.0 * x
    # a x e_x = (0, z, -y);  a x e_y = (-z, 0, x);  a x e_z = (y, -x, 0)
    return (
        xp.where(use_x, zero, xp.where(use_y, 0.0 - z, y)),
        xp.where(use_x, z, xp.where(use_y, zero, 0.0 - x)),
        xp.where(use_x, 0.0 - y, xp.where(use_y, x, zero)),
    )


def check_directions(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> None:
    """Raise ValueInvalid if one of two directions is zero."""
    for x, y, z in ((ax, ay, az), (bx, by, bz)):
        if x == y == z == 0.0:
            raise ValueInvalid("vector 0 0 0 has no direction; give a non-zero one")


def unit_vector(x: Number, y: Number, z: Number, xp: Namespace) -> Vector:
    """Return the direction of a non-zero vector of any length; the scaling by a power of two is exact."""
    shift = -xp.frexp(xp.maximum(xp.maximum(abs(x), abs(y)), abs(z)))[1]
    x, y, z = xp.ldexp(x, shift), xp.ldexp(y, shift), xp.ldexp(z, shift)
    length = xp.length(x, y, z)
    return x / length, y / length, z / length


def cross(ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number) -> Vector:
    """Return the vector product."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
