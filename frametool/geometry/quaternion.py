"""Kernels on quaternions x, y, z, w (Hamilton, active): products, norms, signs, arcs, and notations along the axis.

Knows numbers only. Unless stated otherwise the inputs are unit to a few eps; components are floats or arrays.
"""

from __future__ import annotations

from math import inf

from frametool.errors import ValueInvalid
from frametool.geometry import floats
from frametool.geometry.floats import RADIAN, half_sincos, half_sincos_deg, incline

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from frametool.geometry import Condition, Four, Functions, N, Nine, Three, Two

EPS = 2.0**-52
UNIT = 4 * EPS  # one normalisation leaves |n^2 - 1| below 3 eps: within 4, bits are preserved
SILENT = 1e-6
TOLERATED = 1e-3
FARTHEST = 1e300  # the deviation reported for what can still be normalised although squares overflow
TINY = 1e-150  # the least angle divided by: sin(x)/x is 1 there, and parts down to 1e-308 survive the quotient


def squared_norm(x: N, y: N, z: N, w: N) -> N:
    """Return x^2 + y^2 + z^2 + w^2; accurate for norms between 1e-150 and 1e150."""
    return x * x + y * y + z * z + w * w


def compose(ax: N, ay: N, az: N, aw: N, bx: N, by: N, bz: N, bw: N) -> Four[N]:
    """Multiply two unit quaternions and correct the rounding of the norm: multiples of 90 degrees stay exact.

    The Hamilton product (1843) and `settled` in one function: every lookup calls it at every edge.
    """
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    norm = 0.5 + 0.5 * (x * x + y * y + z * z + w * w)
    return x / norm, y / norm, z / norm, w / norm


def settled(x: N, y: N, z: N, w: N) -> Four[N]:
    """Correct the last rounding of the norm of a quaternion that is unit to 1e-8.

    (1 + n^2)/2 is the norm to first order, without a square root.  Divided by it, the products of 0, 1/2, sqrt(1/2)
    and 1 that right angles consist of become exactly these doubles again.
    """
    norm = 0.5 + 0.5 * (x * x + y * y + z * z + w * w)
    return x / norm, y / norm, z / norm, w / norm


def conjugate(x: N, y: N, z: N, w: N) -> Four[N]:
    """Return the inverse of a unit quaternion; zeros stay +0."""
    return 0.0 - x, 0.0 - y, 0.0 - z, w


def unit(x: N, y: N, z: N, w: N, xp: Functions[N]) -> Four[N]:
    """Normalise a quaternion of moderate norm; the bits of one that is unit to 4 eps are preserved."""
    squared = x * x + y * y + z * z + w * w
    if xp.furthest(squared, 1.0) <= UNIT:
        return x, y, z, w
    norm = xp.where(abs(squared - 1.0) > UNIT, xp.sqrt(squared), 1.0)
    return x / norm, y / norm, z / norm, w / norm


def normalized(x: N, y: N, z: N, w: N, xp: Functions[N]) -> Four[N]:
    """Normalise a non-zero quaternion of any norm, 1e-310 to 1e300.

    Scaling by the power of two of the largest component is exact, so the squares neither overflow nor vanish.
    """
    shift = -xp.frexp(largest_of((abs(x), abs(y), abs(z), abs(w)), xp))[1]
    x, y, z, w = xp.ldexp(x, shift), xp.ldexp(y, shift), xp.ldexp(z, shift), xp.ldexp(w, shift)
    norm = xp.sqrt(x * x + y * y + z * z + w * w)
    return x / norm, y / norm, z / norm, w / norm


def largest_of(values: Sequence[N], xp: Functions[N]) -> N:
    """Return element by element the largest of several numbers."""
    found = values[0]
    for value in values[1:]:
        found = xp.maximum(found, value)
    return found


def from_quaternion(x: N, y: N, z: N, w: N, xp: Functions[N]) -> Four[N]:
    """Return the quaternion for output: unit, with the canonical sign."""
    return xp.canonical_sign(*unit(x, y, z, w, xp))


def angle(x: N, y: N, z: N, w: N, xp: Functions[N]) -> N:
    """Return the rotation angle in [0, pi] radians, accurate at both ends: twice that of a direction."""
    return 2.0 * incline(length(x, y, z, xp), abs(w), xp)


def halves(
    ax: N, ay: N, az: N, aw: N, bx: N, by: N, bz: N, bw: N, xp: Functions[N],
) -> Two[N]:  # fmt: skip
    """Return sine and cosine of half the arc between two quaternions: half the lengths of difference and sum."""
    apart = xp.sqrt(squared_norm(bx - ax, by - ay, bz - az, bw - aw))
    along = xp.sqrt(squared_norm(bx + ax, by + ay, bz + az, bw + aw))
    return 0.5 * xp.minimum(apart, along), 0.5 * xp.maximum(apart, along)


def distance(
    ax: N, ay: N, az: N, aw: N, bx: N, by: N, bz: N, bw: N, xp: Functions[N],
) -> N:  # fmt: skip
    """Return the angle in [0, pi] of the rotation between two orientations, q and -q being equal.

    It is twice the arc between the quaternions as vectors.
    Source: Kahan, 2 atan2(|b - a|, |b + a|); it keeps its relative accuracy for the smallest arcs.
    """
    return 4.0 * incline(*halves(ax, ay, az, aw, bx, by, bz, bw, xp), xp)


def toward(
    ax: N, ay: N, az: N, aw: N, bx: N, by: N, bz: N, bw: N, xp: Functions[N],
) -> tuple[N, N, N, N, N]:  # fmt: skip
    """Return the unit quaternion c orthogonal to a, in the plane of a and b, and half the arc to b in radians.

    The arc is the shorter one; at exactly 180 degrees of rotation both are, and the sign of b decides.
    With s and c the sine and cosine of half the arc: (b - a) / 2sc + a s/c, which is accurate also for b near a.
    """
    apart, along = halves(ax, ay, az, aw, bx, by, bz, bw, xp)
    half_arc = incline(apart, along, xp)  # 0 between equal ends, which are then unchanged at every fraction
    apart = xp.maximum(apart, TINY)
    sign = xp.copysign(1.0, ax * bx + ay * by + az * bz + aw * bw + 0.0)
    ahead, back = 0.5 / (apart * along), apart / along
    return (
        ahead * (sign * bx - ax) + back * ax, ahead * (sign * by - ay) + back * ay,
        ahead * (sign * bz - az) + back * az, ahead * (sign * bw - aw) + back * aw, half_arc,
    )  # fmt: skip


def slerp(
    ax: N, ay: N, az: N, aw: N, bx: N, by: N, bz: N, bw: N,
    fraction: N, xp: Functions[N],
) -> Four[N]:  # fmt: skip
    """Interpolate two unit quaternions along the shorter arc.

    fraction: 0 gives exactly a and 1 exactly b; values outside extrapolate.
    Returns x, y, z, w, unit: a cos(fraction arc) + c sin(fraction arc), with c as returned by `toward`.
    Source: Shoemake 1985, in the steps of `segment`, which prepares c once for many fractions.
    """
    cx, cy, cz, cw, half_arc = toward(ax, ay, az, aw, bx, by, bz, bw, xp)
    sine, cosine = half_sincos(4.0 * (fraction * half_arc), xp)
    x, y, z, w = unit(
        cosine * ax + sine * cx, cosine * ay + sine * cy, cosine * az + sine * cz, cosine * aw + sine * cw, xp
    )
    at_start, at_end = fraction == 0.0, fraction == 1.0
    if not xp.some(at_start | at_end):
        return x, y, z, w
    return (
        either(at_start, ax, at_end, bx, x, xp), either(at_start, ay, at_end, by, y, xp),
        either(at_start, az, at_end, bz, z, xp), either(at_start, aw, at_end, bw, w, xp),
    )  # fmt: skip


def either(first: Condition, a: N, second: Condition, b: N, other: N, xp: Functions[N]) -> N:
    """Return a where the first condition holds, b where the second does, else the other."""
    return xp.where(first, a, xp.where(second, b, other))


def to_matrix(x: N, y: N, z: N, w: N) -> Nine[N]:
    """Return the rotation matrix r11 .. r33, row-major.

    Division by the computed norm makes multiples of 90 degrees exact and corrects a few eps of norm.
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


def rotate(x: N, y: N, z: N, w: N, px: N, py: N, pz: N) -> Three[N]:
    """Rotate a vector by the matrix: the shorter formula of cross products leaves a residue at 90 degrees."""
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = to_matrix(x, y, z, w)
    return r11 * px + r12 * py + r13 * pz, r21 * px + r22 * py + r23 * pz, r31 * px + r32 * py + r33 * pz


def deviation(x: N, y: N, z: N, w: N, xp: Functions[N]) -> N:
    """Return the deviation of the norm from 1 (first order below 1e-6); inf for zero and values that are not finite."""
    squared = x * x + y * y + z * z + w * w
    off = abs(squared - 1.0)
    if xp.furthest(off) <= SILENT:
        return off
    size = largest_of((abs(x), abs(y), abs(z), abs(w)), xp)
    off = xp.where(off <= SILENT, off, xp.minimum(abs(xp.sqrt(squared) - 1.0), FARTHEST))
    return xp.where((size > 0.0) & (size < inf), off, inf)


def explained(parts: Sequence[Any], halves: Sequence[Any], xp: Functions[Any]) -> Condition:
    """Return True if numbers within `halves` of these have norm 1: then only the printed digits are rounded."""
    pairs = [*zip(map(abs, parts), halves, strict=True)]
    nearest = [xp.maximum(size - half, 0.0 * half) for size, half in pairs]
    least = sum((size * size for size in nearest), 0.0)
    most = sum(((size + half) * (size + half) for size, half in pairs), 0.0)
    found: Condition = (least <= 1.0) & (most >= 1.0)
    return found


def repaired(x: N, y: N, z: N, w: N, xp: Functions[N]) -> Four[N]:
    """Normalise quaternions that are not unit to 4 eps; only those with a large deviation take the slower path."""
    squared = x * x + y * y + z * z + w * w
    far = abs(squared - 1.0) > 3.0 * TOLERATED
    norm = xp.where(far, 1.0, xp.sqrt(squared))
    near = x / norm, y / norm, z / norm, w / norm
    if not xp.some(far):
        return near
    other = normalized(x, y, z, w, xp)
    return (
        xp.where(far, other[0], near[0]), xp.where(far, other[1], near[1]),
        xp.where(far, other[2], near[2]), xp.where(far, other[3], near[3]),
    )  # fmt: skip


def remark(x: float, y: float, z: float, w: float) -> str:
    """Return the warning that a quaternion was normalised."""
    return f"quaternion {x:g} {y:g} {z:g} {w:g} has norm {_shown_norm(x, y, z, w)} and was normalised"


def _shown_norm(x: float, y: float, z: float, w: float) -> str:
    """Format a norm with six digits, or as many as distinguish it from 1."""
    norm = magnitude(magnitude(x, y, z, floats), w, 0.0, floats)
    return f"{norm:.6g}" if f"{norm:.6g}" != "1" else f"{norm:.9g}"


def complaint(x: float, y: float, z: float, w: float, *, normalize: bool = False) -> ValueInvalid | None:
    """Return the error for a quaternion that is refused; None if it is accepted: with norm 1 to 1e-3.

    normalize: any non-zero finite one is accepted
    """
    off = deviation(x, y, z, w, floats)
    if off <= TOLERATED or (normalize and off < inf):
        return None
    shown = f"quaternion {x:g} {y:g} {z:g} {w:g}"
    if x == y == z == w == 0.0:
        return ValueInvalid(f"{shown} has no direction; give a non-zero one", rule="denormalized")
    if not off < inf:
        return ValueInvalid(f"{shown} is not finite; give four finite numbers", rule="not-finite")
    message = f"{shown} has norm {_shown_norm(x, y, z, w)}; a rotation needs norm 1 (normalize it with --normalize)"
    return ValueInvalid(message, rule="denormalized")


def between(ax: N, ay: N, az: N, bx: N, by: N, bz: N, xp: Functions[N]) -> Four[N]:
    """Return the shortest rotation from the direction a to the direction b.

    It rotates by twice the angle between a and the bisector a + b.  Near opposite directions the bisector is mostly
    rounding error along a - b, which is removed (a + b itself is exact there).  Opposite to 1 eps: 180 degrees about an
    axis orthogonal to a.
    """
    ax, ay, az = unit_vector(ax, ay, az, xp)
    bx, by, bz = unit_vector(bx, by, bz, xp)
    cx, cy, cz = ax + bx, ay + by, az + bz
    dx, dy, dz = ax - bx, ay - by, az - bz
    apart = dx * dx + dy * dy + dz * dz
    along = xp.where(apart > 2.0, cx * dx + cy * dy + cz * dz, 0.0) / xp.maximum(apart, 2.0)
    cx, cy, cz = cx - along * dx, cy - along * dy, cz - along * dz
    opposite = abs(cx) + abs(cy) + abs(cz) <= EPS
    sx, sy, sz = _sideways(ax, ay, az, xp)
    mx, my, mz = unit_vector(xp.where(opposite, sx, cx), xp.where(opposite, sy, cy), xp.where(opposite, sz, cz), xp)
    x, y, z = cross(ax, ay, az, mx, my, mz)
    return x, y, z, ax * mx + ay * my + az * mz


def _sideways(x: N, y: N, z: N, xp: Functions[N]) -> Three[N]:
    """Return a vector orthogonal to a unit vector, from the coordinate axis farthest from it."""
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


def unit_vector(x: N, y: N, z: N, xp: Functions[N]) -> Three[N]:
    """Return the direction of a non-zero vector of any length."""
    x, y, z, _ = _scaled(x, y, z, xp)
    norm = length(x, y, z, xp)
    return x / norm, y / norm, z / norm


def direction(x: N, y: N, z: N, xp: Functions[N]) -> Four[N]:
    """Return the direction and the length of any vector; for zero, x and 0."""
    still = (x == 0.0) & (y == 0.0) & (z == 0.0)
    x, y, z, exponent = _scaled(xp.where(still, 1.0, x), y, z, xp)
    norm = length(x, y, z, xp)
    return x / norm, y / norm, z / norm, xp.where(still, 0.0, 2.0 * (norm * xp.ldexp(1.0, exponent - 1)))


def magnitude(x: N, y: N, z: N, xp: Functions[N]) -> N:
    """Return the length of any vector; only squares out of range take the slower path."""
    squared = x * x + y * y + z * z
    extreme = (squared < 1e-280) | (squared > 1e300)
    plain = xp.sqrt(squared)
    return xp.where(extreme, direction(x, y, z, xp)[3], plain) if xp.some(extreme) else plain


def _scaled(x: N, y: N, z: N, xp: Functions[N]) -> tuple[N, N, N, Any]:
    """Divide a vector by the power of two of its largest component, which is exact; return the exponent too."""
    exponent = xp.frexp(largest_of((abs(x), abs(y), abs(z)), xp))[1]
    return xp.ldexp(x, -exponent), xp.ldexp(y, -exponent), xp.ldexp(z, -exponent), exponent


def length(x: N, y: N, z: N, xp: Functions[N]) -> N:
    """Return the length of a vector, accurate between 1e-150 and 1e150; hypot differs between machines."""
    return xp.sqrt(x * x + y * y + z * z)


def cross(ax: N, ay: N, az: N, bx: N, by: N, bz: N) -> Three[N]:
    """Return the vector product."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def from_rotvec(rx: N, ry: N, rz: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion x, y, z, w of a rotation vector in radians or degrees.

    Exact down to 1e-300: an angle too small to divide by is replaced by one with the same quotient.
    The unit axis is computed first, so that multiples of 90 degrees about a coordinate axis are exact.
    """
    angle = xp.maximum(length(rx, ry, rz, xp), TINY)
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return rx / angle * sine, ry / angle * sine, rz / angle * sine, cosine


def as_rotvec(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> Three[N]:
    """Return the rotation vector of a unit quaternion, of length 0 to pi (or 180 degrees).

    Relative accuracy holds down to 1e-300.  The sign of the quaternion decides at 180 degrees.
    """
    sine = xp.maximum(length(x, y, z, xp), TINY)
    angle = xp.copysign(2.0 * incline(sine, abs(w), xp), w)
    if degrees:
        angle *= RADIAN
    return x / sine * angle, y / sine * angle, z / sine * angle


def rotvec_complaint(
    x: float, y: float, z: float, *, what: str = "rotation vector", normalize: bool = False  # noqa: ARG001
) -> ValueInvalid | None:
    """Return the error for a rotation vector that is not finite, or so long that its square overflows; else None."""
    if x * x + y * y + z * z < inf:
        return None
    problem = f"{what} {x:g} {y:g} {z:g} is not finite or too long; give numbers below 1e+150"
    return ValueInvalid(problem, rule="not-finite")


def from_axis_angle(ax: N, ay: N, az: N, angle: N, xp: Functions[N], *, degrees: bool = False) -> Four[N]:
    """Return the quaternion x, y, z, w of a rotation about a non-zero axis of any length, in radians or degrees."""
    ux, uy, uz = unit_vector(ax, ay, az, xp)
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return ux * sine, uy * sine, uz * sine, cosine


def as_axis_angle(x: N, y: N, z: N, w: N, xp: Functions[N], *, degrees: bool = False) -> tuple[N, N, N, N]:
    """Return unit axis and angle in [0, pi] (or 180 degrees); the identity has the axis x.

    At 180 degrees, where both directions are correct, the first non-zero component of the axis is positive.
    """
    x, y, z, w = xp.canonical_sign(x, y, z, w)
    ux, uy, uz, sine = direction(x, y, z, xp)
    angle = 2.0 * incline(sine, abs(w), xp)
    return ux, uy, uz, angle * RADIAN if degrees else angle


def axis_angle_complaint(*axis_and_angle: float, normalize: bool = False) -> ValueInvalid | None:  # noqa: ARG001
    """Return the error for an axis of length 0; else None."""
    if any(axis_and_angle[:3]):
        return None
    return ValueInvalid("axis 0 0 0 has no direction; give a non-zero one", rule="denormalized")


def from_mrp(px: N, py: N, pz: N) -> Four[N]:
    """Return the quaternion x, y, z, w of modified Rodrigues parameters (Schaub & Junkins 1996)."""
    squared = px * px + py * py + pz * pz
    scale = 1.0 / (1.0 + squared)
    return 2.0 * px * scale, 2.0 * py * scale, 2.0 * pz * scale, (1.0 - squared) * scale


def as_mrp(x: N, y: N, z: N, w: N, xp: Functions[N]) -> Three[N]:
    """Return modified Rodrigues parameters of length 0 to 1: those of the shorter rotation."""
    x, y, z, w = xp.canonical_sign(x, y, z, w)
    return x / (1.0 + w), y / (1.0 + w), z / (1.0 + w)
