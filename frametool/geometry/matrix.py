"""Kernels of the rotation matrix, nine components row-major: to the quaternion, and to the nearest rotation."""

from __future__ import annotations

from frametool.errors import ValueInvalid, warn
from frametool.geometry import floats
from frametool.geometry.quaternion import EPS, SILENT, TOLERATED, to_matrix

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from frametool.geometry.types import Matrix, Namespace, Number, Quaternion

ORTHONORMAL = 8 * EPS  # of the Gram matrix: what rounding alone leaves on a correctly rounded rotation
SINGULAR = 1e-12  # of det / (|row 1| |row 2| |row 3|): below, rounding decides which rotation is nearest


def to_quaternion(
    r11: Number, r12: Number, r13: Number, r21: Number, r22: Number, r23: Number,
    r31: Number, r32: Number, r33: Number, xp: Namespace,
) -> Quaternion:  # fmt: skip
    """Return the quaternion of an orthonormal matrix.

    Source: Shepperd 1978, from the largest of 4w^2, 4x^2, 4y^2, 4z^2, then normalised.
    """
    where = xp.where
    ww, xx = 1.0 + (r11 + r22 + r33), 1.0 + (r11 - r22 - r33)
    yy, zz = 1.0 + (r22 - r11 - r33), 1.0 + (r33 - r11 - r22)
    wx, wy, wz = r32 - r23, r13 - r31, r21 - r12
    xy, xz, yz = r12 + r21, r13 + r31, r23 + r32
    w_first, y_first = ww >= xx, yy >= zz
    upper = where(w_first, ww, xx) >= where(y_first, yy, zz)
    x = where(upper, where(w_first, wx, xx), where(y_first, xy, xz))
    y = where(upper, where(w_first, wy, xy), where(y_first, yy, yz))
    z = where(upper, where(w_first, wz, xz), where(y_first, yz, zz))
    w = where(upper, where(w_first, ww, wx), where(y_first, wy, wz))
    scale = xp.sqrt(1.0 / (x * x + y * y + z * z + w * w))
    return x * scale, y * scale, z * scale, w * scale


def from_quaternion(x: Number, y: Number, z: Number, w: Number) -> Matrix:
    """Return the matrix of a quaternion."""
    return to_matrix(x, y, z, w)


def determinant(
    a: Number, b: Number, c: Number, d: Number, e: Number, f: Number, g: Number, h: Number, i: Number
) -> Number:
    """Return the determinant: 1 for a rotation, negative for what is mirrored."""
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def defect(
    a: Number, b: Number, c: Number, d: Number, e: Number, f: Number, g: Number, h: Number, i: Number, xp: Namespace
) -> Number:
    """Return the largest entry of |R R^T - 1|: how far the rows are from orthonormal."""
    larger = xp.maximum
    lengths = larger(abs(a * a + b * b + c * c - 1.0), abs(d * d + e * e + f * f - 1.0))
    lengths = larger(lengths, abs(g * g + h * h + i * i - 1.0))
    angles = larger(abs(a * d + b * e + c * f), abs(a * g + b * h + c * i))
    return larger(larger(angles, abs(d * g + e * h + f * i)), lengths)


def nearest(
    a: Number, b: Number, c: Number, d: Number, e: Number, f: Number, g: Number, h: Number, i: Number, xp: Namespace
) -> Matrix:
    """Return the rotation nearest to a matrix of positive determinant: its orthogonal polar factor.

    Source: Higham 1986, Newton's X <- (X + X^-T)/2 with the inverse by cofactors, started at determinant 1.
    The convergence is quadratic: a step below 1e-9 leaves 1e-18.
    """
    scale = 1.0 / xp.cbrt(determinant(a, b, c, d, e, f, g, h, i))
    x: Matrix = tuple(part * scale for part in (a, b, c, d, e, f, g, h, i))
    for _ in range(60):
        x, step = _newton(x, xp)
        if step < 1e-9:
            break
    return x


def _newton(x: Matrix, xp: Namespace) -> tuple[Matrix, float]:
    """Take one Newton step towards the orthogonal factor; give it with the largest change."""
    a, b, c, d, e, f, g, h, i = x
    cofactors = (
        e * i - f * h, f * g - d * i, d * h - e * g,
        c * h - b * i, a * i - c * g, b * g - a * h,
        b * f - c * e, c * d - a * f, a * e - b * d,
    )  # fmt: skip
    half = 0.5 / (a * cofactors[0] + b * cofactors[1] + c * cofactors[2])
    after: Matrix = tuple(0.5 * old + cofactor * half for old, cofactor in zip(x, cofactors, strict=True))
    return after, max(xp.largest(new - old) for new, old in zip(after, x, strict=True))


def check(*values: float, normalize: bool = False) -> Matrix:
    """Check one matrix at the door, nine entries row-major, and give the rotation nearest to it.

    Orthonormal to 1e-6 in silence, to 1e-3 with a warning; with `normalize` any of positive determinant.

    Raises:
        ValueInvalid: not finite, mirrored, singular or not orthonormal.
    """
    entries: Matrix = as_nine(values)
    off = defect(*entries, floats)
    problem = complaint(entries, off, normalize=normalize)
    if problem:
        raise problem
    if off <= ORTHONORMAL:
        return entries
    if off > SILENT and not normalize:
        warn(f"matrix is orthonormal only to {off:.2g} and was replaced by the nearest rotation", rule="rounded")
    return nearest(*scaled(*entries, floats), floats)


def complaint(entries: Matrix, off: float, *, normalize: bool) -> ValueInvalid | None:
    """Make the error for a matrix that far from orthonormal; None if it is not refused."""
    if not all(abs(value) < float("inf") for value in entries):
        return ValueInvalid(f"matrix {_shown(entries)} is not finite; give nine finite numbers", rule="not-finite")
    if not normalize and not off <= TOLERATED and not (off < 1.0 and determinant(*entries) < 0.0):
        off_by = f"its rows are orthonormal only to {off:.2g} (normalize it with --normalize)"
        return ValueInvalid(f"matrix is not a rotation: {off_by}", rule="denormalized")
    volume = relative_volume(*entries, floats)
    if volume < -SINGULAR:
        found = f"matrix has determinant {determinant(*entries):.6g}"
        return ValueInvalid(f"{found}: it is left-handed (mirrored); a rotation has 1", rule="mirrored")
    if volume <= SINGULAR:
        return ValueInvalid(f"matrix {_shown(entries)} is singular; no rotation is nearest to it", rule="denormalized")
    return None


def scaled(
    a: Number, b: Number, c: Number, d: Number, e: Number, f: Number, g: Number, h: Number, i: Number, xp: Namespace
) -> Matrix:
    """Scale a matrix by the power of two of its largest entry: its rotation stays, its determinant is in range."""
    larger = xp.maximum
    largest = larger(larger(larger(abs(a), abs(b)), larger(abs(c), abs(d))), larger(abs(e), abs(f)))
    shift = -xp.frexp(larger(larger(largest, abs(g)), larger(abs(h), abs(i))))[1]
    return tuple(xp.ldexp(part, shift) for part in (a, b, c, d, e, f, g, h, i))


def relative_volume(
    a: Number, b: Number, c: Number, d: Number, e: Number, f: Number, g: Number, h: Number, i: Number, xp: Namespace
) -> Number:
    """Return the determinant divided by the lengths of the rows: in [-1, 1], 0 where a row is zero."""
    a, b, c, d, e, f, g, h, i = scaled(a, b, c, d, e, f, g, h, i, xp)
    lengths = xp.length(a, b, c) * xp.length(d, e, f) * xp.length(g, h, i)
    return determinant(a, b, c, d, e, f, g, h, i) / xp.where(lengths == 0.0, 1.0, lengths)


def as_nine(values: Any) -> Matrix:
    """Name nine values a matrix."""
    nine: Matrix = values
    return nine


def _shown(entries: tuple[float, ...]) -> str:
    """Show a matrix on one line."""
    return ", ".join(" ".join(f"{value:g}" for value in entries[row : row + 3]) for row in (0, 3, 6))
