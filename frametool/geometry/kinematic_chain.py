"""Kernels of a chain of joints: the pose so far, carried across one joint, or one fixed piece, after the other.

Axes and fixed pieces are plain floats; zeros among them cost nothing, which is most of them in robots.  What is left
out depends on them alone, so that floats and arrays take the same steps.  Components are floats or arrays.
"""

from __future__ import annotations

from frametool.geometry.quaternion import settled
from frametool.geometry.trig import half_sincos, half_sincos_deg

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Namespace, Number, Quaternion, Rigid, Vector


def turn(pose: Rigid, axis: Vector, angle: Number, xp: Namespace, *, degrees: bool = False) -> Rigid:
    """Return the pose behind a joint that turns about a unit axis, in radians or degrees.

    Source: the Hamilton product with (axis sine, cosine) of half the angle, the sine taken out.
    """
    tx, ty, tz, x, y, z, w = pose
    ax, ay, az = axis
    sine, cosine = half_sincos_deg(angle, xp) if degrees else half_sincos(angle, xp)
    return tx, ty, tz, *settled(
        x * cosine + sine * _sum((ax, w), (az, y), (-ay, z)),
        y * cosine + sine * _sum((ay, w), (-az, x), (ax, z)),
        z * cosine + sine * _sum((az, w), (ay, x), (-ax, y)),
        w * cosine - sine * _sum((ax, x), (ay, y), (az, z)),
    )


def slide(pose: Rigid, axis: Vector, distance: Number) -> Rigid:
    """Return the pose behind a joint that slides along a unit axis, in metres."""
    dx, dy, dz = _rotated(pose[3:], axis)
    tx, ty, tz = pose[:3]
    return tx + dx * distance, ty + dy * distance, tz + dz * distance, *pose[3:]


def go_on(pose: Rigid, piece: Rigid) -> Rigid:
    """Return the pose at the end of a fixed piece."""
    tx, ty, tz, x, y, z, w = pose
    if any(piece[:3]):
        dx, dy, dz = _rotated(pose[3:], piece[:3])
        tx, ty, tz = tx + dx, ty + dy, tz + dz
    bx, by, bz, bw = piece[3:]
    if not (bx or by or bz):
        return tx, ty, tz, x, y, z, w
    return tx, ty, tz, *settled(
        _sum((bx, w), (bw, x), (bz, y), (-by, z)),
        _sum((by, w), (-bz, x), (bw, y), (bx, z)),
        _sum((bz, w), (by, x), (-bx, y), (bw, z)),
        _sum((bw, w), (-bx, x), (-by, y), (-bz, z)),
    )


def _rotated(rotation: Quaternion, vector: Vector) -> Vector:
    """Rotate a constant vector: the columns of the matrix that it needs.

    Divided by the norm actually computed, which keeps multiples of 90 degrees exact.
    """
    x, y, z, w = rotation
    vx, vy, vz = vector
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    xs, ys, zs = x * scale, y * scale, z * scale
    columns = []
    if vx:
        columns.append((vx, 1.0 - (y * ys + z * zs), x * ys + w * zs, x * zs - w * ys))
    if vy:
        columns.append((vy, x * ys - w * zs, 1.0 - (x * xs + z * zs), y * zs + w * xs))
    if vz:
        columns.append((vz, x * zs + w * ys, y * zs - w * xs, 1.0 - (x * xs + y * ys)))
    first, second, third = (_sum(*((column[0], column[row]) for column in columns)) for row in (1, 2, 3))
    return first, second, third


def _sum(*terms: tuple[float, Number]) -> Number:
    """Add up numbers times constants, those times 0 left out."""
    total = None
    for factor, number in terms:
        if factor:
            part = number if factor == 1.0 else factor * number
            total = part if total is None else total + part
    return 0.0 if total is None else total
