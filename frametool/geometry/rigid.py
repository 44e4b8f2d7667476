"""Kernels of rigid transforms: translation tx, ty, tz in metres, then the unit quaternion x, y, z, w.

Products and inverses; interpolation of two poses, prepared once for many fractions, with exactly the rotation of
`quaternion.slerp`; motions of joints; and twists and wrenches in another frame
(linear part first), by the adjoint.
A full pose has seven components alone, eight with a scale, 43 with a covariance: the eighth is s of the similarity
p' = s R p + t, the 36 are the entries that `uncertainty` describes.  A pose alone is exact and has scale 1; none has
both.
Knows numbers only; components are floats or arrays of one shape, and both take the same steps.
"""

from __future__ import annotations

from math import isfinite

from frametool.errors import ValueInvalid
from frametool.geometry import quaternion
from frametool.geometry.floats import half_sincos, half_sincos_deg, incline, polynomial
from frametool.geometry.quaternion import cross, either, length

TYPE_CHECKING = False

if TYPE_CHECKING:
    from frametool.geometry import Components, Functions, N, Number, Rigid, Seven, Six, Three, Two

EXACT, SCALED, UNCERTAIN = 7, 8, 43  # components of a full pose: alone, with a scale, with a covariance
NOT_BOTH = "the covariance cannot be carried through a scale; leave one of them out"
SIMILARITY = "scale: a similarity, not a pose; apply --transform, compose and invert take it"
IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
SERIES_EXP = 1.5  # rad: above, a - sin(a) loses less than a digit; below, ten terms of its series are exact
SERIES_LOG = 0.6  # rad: the same for 1 - (a/2) cot(a/2) and six terms
# (-1)^n / (2n + 3)! : the series of (a - sin a)/a^3 in a^2
SINE_REST = (1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800, -1 / 6227020800, 1 / 1307674368000,
             -1 / 355687428096000, 1 / 121645100408832000)  # fmt: skip
# |B_2n| / (2n)! : the series of (1 - (a/2) cot(a/2))/a^2 in a^2, Bernoulli's numbers
COTANGENT_REST = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600,
                  3617 / 10670622842880000)  # fmt: skip


def compose(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    btx: N, bty: N, btz: N, bx: N, by: N, bz: N, bw: N,
) -> Seven[N]:  # fmt: skip
    """Return a_from_c of a_from_b and b_from_c."""
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = quaternion.to_matrix(ax, ay, az, aw)
    x, y, z, w = quaternion.compose(ax, ay, az, aw, bx, by, bz, bw)
    return (
        r11 * btx + r12 * bty + r13 * btz + atx, r21 * btx + r22 * bty + r23 * btz + aty,
        r31 * btx + r32 * bty + r33 * btz + atz, x, y, z, w,
    )  # fmt: skip


def inverse(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N) -> Seven[N]:
    """Return b_from_a of a_from_b."""
    ix, iy, iz, iw = quaternion.conjugate(x, y, z, w)
    rx, ry, rz = quaternion.rotate(ix, iy, iz, iw, tx, ty, tz)
    return 0.0 - rx, 0.0 - ry, 0.0 - rz, ix, iy, iz, iw


def apply(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N, px: N, py: N, pz: N) -> Three[N]:
    """Transform a point: rotate, then translate."""
    rx, ry, rz = quaternion.rotate(x, y, z, w, px, py, pz)
    return rx + tx, ry + ty, rz + tz


def relative(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    btx: N, bty: N, btz: N, bx: N, by: N, bz: N, bw: N,
) -> Seven[N]:  # fmt: skip
    """Return inverse(a) b; the translations are subtracted first, so that close poses keep their digits."""
    x, y, z, w = quaternion.conjugate(ax, ay, az, aw)
    tx, ty, tz = quaternion.rotate(x, y, z, w, btx - atx, bty - aty, btz - atz)
    qx, qy, qz, qw = quaternion.compose(x, y, z, w, bx, by, bz, bw)
    return tx, ty, tz, qx, qy, qz, qw


def mirrored(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N) -> Seven[N]:
    """Return a pose reflected across y: both its frames become left-handed."""
    return tx, -ty, tz, -x, y, -z, w


def interpolate(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    btx: N, bty: N, btz: N, bx: N, by: N, bz: N, bw: N,
    fraction: N, xp: Functions[N],
) -> Seven[N]:  # fmt: skip
    """Interpolate two poses: the translation linearly, the rotation by slerp, as tf2 does.

    fraction: 0 gives exactly a and 1 exactly b; values outside extrapolate.
    """
    x, y, z, w = quaternion.slerp(ax, ay, az, aw, bx, by, bz, bw, fraction, xp)
    tx, ty, tz = _line(atx, btx, fraction, xp), _line(aty, bty, fraction, xp), _line(atz, btz, fraction, xp)
    return tx, ty, tz, x, y, z, w


def _line(start: N, end: N, fraction: N, xp: Functions[N]) -> N:
    """Interpolate two numbers from the nearer end; exact at both ends."""
    step = end - start
    between = xp.where(fraction < 0.5, start + fraction * step, end - (1.0 - fraction) * step)
    return either(fraction == 0.0, start, fraction == 1.0, end, between, xp)


def distance(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    btx: N, bty: N, btz: N, bx: N, by: N, bz: N, bw: N, xp: Functions[N],
) -> Two[N]:  # fmt: skip
    """Return the distance in metres and the angle in radians between two poses."""
    metres = quaternion.magnitude(btx - atx, bty - aty, btz - atz, xp)
    return metres, quaternion.distance(ax, ay, az, aw, bx, by, bz, bw, xp)


def extent(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N, xp: Functions[N]) -> Two[N]:
    """Return the translation of a transform in metres and its angle in [0, pi] radians."""
    return quaternion.magnitude(tx, ty, tz, xp), quaternion.angle(x, y, z, w, xp)


def to_matrix(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N) -> tuple[N, N, N, N, N, N, N, N, N, N, N, N]:
    """Return the upper twelve entries m11 .. m34 of the homogeneous matrix, row-major; the last row is 0 0 0 1."""
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = quaternion.to_matrix(x, y, z, w)
    return r11, r12, r13, tx, r21, r22, r23, ty, r31, r32, r33, tz


def to_homogeneous(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N, _xp: Functions[N]) -> Components:
    """Return the sixteen entries of the homogeneous matrix, row-major; floats are constant for all rows."""
    upper: Components = to_matrix(tx, ty, tz, x, y, z, w)
    return *upper, 0.0, 0.0, 0.0, 1.0


def check_twist(vx: float, vy: float, vz: float, wx: float, wy: float, wz: float) -> None:
    """Raise ValueInvalid for a twist that is not finite, or so large that no digit of its angle is left."""
    if not all(isfinite(value) for value in (vx, vy, vz)):
        raise ValueInvalid(f"twist {vx:g} {vy:g} {vz:g} is not finite; give finite numbers")
    if problem := quaternion.rotvec_complaint(wx, wy, wz):
        raise problem


def exp(vx: N, vy: N, vz: N, wx: N, wy: N, wz: N, xp: Functions[N]) -> Seven[N]:
    """Return the transform reached by a constant twist in unit time.

    v in metres, w in radians, linear part first as in ROS messages.
    Source: Murray, Li & Sastry 1994: t = v + B w x v + C w x (w x v), B = (1 - cos a)/a^2, C = (a - sin a)/a^3.
    """
    angle = xp.maximum(length(wx, wy, wz, xp), quaternion.TINY)
    half_sine, half_cosine = half_sincos(angle, xp)
    low = angle < SERIES_EXP
    ratio = half_sine / angle
    low_square, high = xp.where(low, angle, 0.0), xp.where(low, SERIES_EXP, angle)
    series = polynomial(low_square * low_square, SINE_REST)
    second = xp.where(low, series, (high - 2.0 * half_sine * half_cosine) / (high * high * high))
    cx, cy, cz = cross(wx, wy, wz, vx, vy, vz)
    dx, dy, dz = cross(wx, wy, wz, cx, cy, cz)
    first = 2.0 * ratio * ratio
    return (
        vx + (first * cx + second * dx), vy + (first * cy + second * dy), vz + (first * cz + second * dz),
        wx / angle * half_sine, wy / angle * half_sine, wz / angle * half_sine, half_cosine,
    )  # fmt: skip


def log(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N, xp: Functions[N]) -> Six[N]:
    """Return the twist vx, vy, vz, wx, wy, wz whose `exp` is this transform, with an angle up to pi.

    Source: v = t - w x t / 2 + D w x (w x t), D = (1 - (a/2) cot(a/2))/a^2, by its series below 0.6 rad.
    """
    wx, wy, wz = quaternion.as_rotvec(x, y, z, w, xp)
    sine, cosine = length(x, y, z, xp), abs(w)
    half = incline(sine, cosine, xp)
    squared = 4.0 * half * half
    low = 2.0 * half < SERIES_LOG
    series = polynomial(xp.where(low, squared, 0.0), COTANGENT_REST)
    factor = xp.where(low, series, (1.0 - half * cosine / xp.where(low, 1.0, sine)) / xp.where(low, 1.0, squared))
    cx, cy, cz = cross(wx, wy, wz, tx, ty, tz)
    dx, dy, dz = cross(wx, wy, wz, cx, cy, cz)
    return tx + (factor * dx - 0.5 * cx), ty + (factor * dy - 0.5 * cy), tz + (factor * dz - 0.5 * cz), wx, wy, wz


def prepare(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    btx: N, bty: N, btz: N, bx: N, by: N, bz: N, bw: N, xp: Functions[N],
) -> tuple[N, N, N, N, N, N, N, N]:  # fmt: skip
    """Return the step dx, dy, dz in metres, then the result of `quaternion.toward`: c as x, y, z, w, half the arc."""
    cx, cy, cz, cw, half_arc = quaternion.toward(ax, ay, az, aw, bx, by, bz, bw, xp)
    return btx - atx, bty - aty, btz - atz, cx, cy, cz, cw, half_arc


def along(
    atx: N, aty: N, atz: N, ax: N, ay: N, az: N, aw: N,
    dx: N, dy: N, dz: N, cx: N, cy: N, cz: N, cw: N, half_arc: N,
    fraction: N, xp: Functions[N],
) -> Seven[N]:  # fmt: skip
    """Return the pose at a fraction of the segment from a, as prepared by `prepare`; unit to a few eps.

    fraction: 0 to 1, so that the angle needs no reduction.
    """
    sine, cosine = xp.doubled_sincos(fraction * half_arc)
    return (
        atx + fraction * dx, aty + fraction * dy, atz + fraction * dz,
        cosine * ax + sine * cx, cosine * ay + sine * cy, cosine * az + sine * cz, cosine * aw + sine * cw,
    )  # fmt: skip


def turned(ax: float, ay: float, az: float, angle: N, xp: Functions[N], *, degrees: bool = False) -> Rigid:
    """Return the motion of a revolute or continuous joint: a rotation about its axis, in radians or degrees."""
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return 0.0, 0.0, 0.0, _times(ax, sine), _times(ay, sine), _times(az, sine), cosine


def slid(ax: float, ay: float, az: float, distance: N) -> Rigid:
    """Return the motion of a prismatic joint: a translation along its axis, in metres."""
    return _times(ax, distance), _times(ay, distance), _times(az, distance), 0.0, 0.0, 0.0, 1.0


def _times(part: float, values: Number) -> Number:
    """Multiply by a component of an axis, mostly 0: then the product is the plain float 0 and costs nothing."""
    return part * values if part else 0.0


def move_wrench(
    tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N,
    fx: N, fy: N, fz: N, mx: N, my: N, mz: N,
) -> Six[N]:  # fmt: skip
    """Return force and torque about the target's origin: f' = R f, m' = R m + t x f'.

    f in N and m in Nm about the source's origin. Source: Murray, Li, Sastry 1994, eq. 2.66.
    """
    ax, ay, az = quaternion.rotate(x, y, z, w, fx, fy, fz)
    bx, by, bz = quaternion.rotate(x, y, z, w, mx, my, mz)
    cx, cy, cz = quaternion.cross(tx, ty, tz, ax, ay, az)
    return ax, ay, az, bx + cx, by + cy, bz + cz


def move_twist(
    tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N,
    vx: N, vy: N, vz: N, wx: N, wy: N, wz: N,
) -> Six[N]:  # fmt: skip
    """Return the velocity of the same rigid body at the target's origin: w' = R w, v' = R v + t x w'.

    v in m/s is that of the body's point at the source's origin. Source: Murray, Li, Sastry 1994, eq. 2.58.
    """
    ax, ay, az = quaternion.rotate(x, y, z, w, vx, vy, vz)
    bx, by, bz = quaternion.rotate(x, y, z, w, wx, wy, wz)
    cx, cy, cz = quaternion.cross(tx, ty, tz, bx, by, bz)
    return ax + cx, ay + cy, az + cz, bx, by, bz


# --- full poses: with a scale or a covariance, or neither ---


def compose_full(a: Components, b: Components) -> Components:
    """Return a_from_c of a_from_b and b_from_c: s = s1 s2, R = R1 R2, t = t1 + s1 R1 t2."""
    if len(a) == len(b) == EXACT:
        return compose(*a, *b)
    first, second = pose_of(a), pose_of(b)
    if SCALED in (len(a), len(b)):
        if UNCERTAIN in (len(a), len(b)):
            raise ValueInvalid(NOT_BOTH)
        s1, s2 = scale_of(a), scale_of(b)
        x, y, z = second[:3]
        return (*compose(*first, s1 * x, s1 * y, s1 * z, *second[3:]), s1 * s2)
    from frametool.geometry import uncertainty

    entries = uncertainty.propagate_compose(first, covariance_of(a), second, covariance_of(b))
    return (*compose(*first, *second), *(entries or ()))


def inverse_full(a: Components) -> Components:
    """Return b_from_a of a_from_b: 1/s, R', -R' t / s."""
    pose = pose_of(a)
    x, y, z, *rotation = inverse(*pose)
    if len(a) == SCALED:
        s = a[EXACT]
        return (x / s, y / s, z / s, *rotation, 1.0 / s)
    if len(a) == EXACT:
        return (x, y, z, *rotation)
    from frametool.geometry import uncertainty

    return (x, y, z, *rotation, *uncertainty.propagate_inverse(pose, a[EXACT:]))


def relative_full(a: Components, b: Components) -> Components:
    """Return the pose of b in a: inverse(a) b."""
    pose = relative(*pose_of(a), *pose_of(b))
    if SCALED in (len(a), len(b)):
        raise ValueInvalid(SIMILARITY)
    return pose if len(a) == len(b) == EXACT else (*pose, *compose_full(inverse_full(a), b)[EXACT:])


def pose_of(a: Components) -> Rigid:
    """Return the seven components of a pose."""
    tx, ty, tz, x, y, z, w = a[:EXACT]
    return tx, ty, tz, x, y, z, w


def covariance_of(a: Components) -> Components | None:
    """Return the covariance of a pose; None if it is exact."""
    return a[EXACT:] if len(a) == UNCERTAIN else None


def scale_of(a: Components) -> Number:
    """Return the scale of a similarity; 1 for a pose."""
    return a[EXACT] if len(a) == SCALED else 1.0
