"""Kernels of the rotation matrix, nine components row-major: to the quaternion, and to the nearest rotation.

Six numbers are its first two columns, which determine the third (Zhou et al. 2019).
"""

from __future__ import annotations

from math import frexp, inf, ldexp, sqrt

from frametool.errors import ValueInvalid
from frametool.geometry import floats, quaternion
from frametool.geometry.quaternion import EPS, SILENT, TOLERATED, largest_of, length

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

    from frametool.geometry import Condition, Four, Functions, N, Nine, Six

ORTHONORMAL = 8 * EPS  # of the Gram matrix: what rounding alone leaves on a correctly rounded rotation
SINGULAR = 1e-12  # of det / (|row 1| |row 2| |row 3|): below, rounding decides which rotation is nearest
NEAREST, FURTHEST = 0.81 - 1e-9, 1.21 + 1e-9  # squares of the singular values that --normalize accepts: 0.9 .. 1.1
EQUAL = 2e-3  # of squares: if singular values are equal to 1e-3, the matrix is a multiple of a rotation
PARALLEL = 1e-12  # sine between two columns: below, rounding decides the plane they span


def to_quaternion(
    r11: N, r12: N, r13: N, r21: N, r22: N, r23: N,
    r31: N, r32: N, r33: N, xp: Functions[N],
) -> Four[N]:  # fmt: skip
    """Return the quaternion of an orthonormal matrix.

    Source: Shepperd 1978, from the largest of 4w^2, 4x^2, 4y^2, 4z^2, then normalised.
    """
    where = xp.where
    ww, xx = 1.0 + (r11 + r22 + r33), 1.0 + (r11 - r22 - r33)
    yy, zz = 1.0 + (r22 - r11 - r33), 1.0 + (r33 - r11 - r22)
    wx, wy, wz = r32 - r23, r13 - r31, r21 - r12
    xy, xz, yz = r12 + r21, r13 + r31, r23 + r32
    w_first, y_first = xp.mask(ww >= xx), xp.mask(yy >= zz)
    upper = xp.mask(xp.maximum(ww, xx) >= xp.maximum(yy, zz))
    x = where(upper, where(w_first, wx, xx), where(y_first, xy, xz))
    y = where(upper, where(w_first, wy, xy), where(y_first, yy, yz))
    z = where(upper, where(w_first, wz, xz), where(y_first, yz, zz))
    w = where(upper, where(w_first, ww, wx), where(y_first, wy, wz))
    scale = xp.sqrt(1.0 / (x * x + y * y + z * z + w * w))
    return x * scale, y * scale, z * scale, w * scale


def determinant(a: N, b: N, c: N, d: N, e: N, f: N, g: N, h: N, i: N) -> N:
    """Return the determinant: 1 for a rotation, negative for a reflection."""
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def gram(a: N, b: N, c: N, d: N, e: N, f: N, g: N, h: N, i: N) -> Six[N]:
    """Return R R^T: the squared lengths of the rows, then the products of the first and second, first and third .."""
    return (
        a * a + b * b + c * c, d * d + e * e + f * f, g * g + h * h + i * i,
        a * d + b * e + c * f, a * g + b * h + c * i, d * g + e * h + f * i,
    )  # fmt: skip


def defect(a: N, b: N, c: N, d: N, e: N, f: N, g: N, h: N, i: N, xp: Functions[N]) -> N:
    """Return the largest entry of |R R^T - 1|: the deviation of the rows from orthonormal."""
    aa, bb, cc, ab, ac, bc = gram(a, b, c, d, e, f, g, h, i)
    return largest_of([abs(aa - 1.0), abs(bb - 1.0), abs(cc - 1.0), abs(ab), abs(ac), abs(bc)], xp)


def is_multiple(aa: N, bb: N, cc: N, ab: N, ac: N, bc: N, one: float = 1.0) -> Condition:
    """Return True if, by its Gram matrix, a matrix is a rotation times a number other than 1, whose square is `one`."""
    square = (aa + bb + cc) / 3.0
    alike = _within((1.0 - EQUAL) * square, (1.0 + EQUAL) * square, aa, bb, cc, ab, ac, bc)
    return alike & (abs(square - one) > EQUAL * one)


def is_near(aa: N, bb: N, cc: N, ab: N, ac: N, bc: N) -> Condition:
    """Return True if, by its Gram matrix, all singular values of a matrix are in 0.9 .. 1.1."""
    return _within(NEAREST, FURTHEST, aa, bb, cc, ab, ac, bc)


def _within(low: N | float, high: N | float, aa: N, bb: N, cc: N, ab: N, ac: N, bc: N) -> Condition:
    """Return True if the eigenvalues of a Gram matrix G are between two numbers.

    That is, if G - low and high - G are positive definite, by their leading minors (Sylvester).
    """
    return _is_positive(aa - low, bb - low, cc - low, ab, ac, bc) & _is_positive(
        high - aa, high - bb, high - cc, -ab, -ac, -bc
    )


def _is_positive(aa: N, bb: N, cc: N, ab: N, ac: N, bc: N) -> Condition:
    return (aa > 0.0) & (aa * bb - ab * ab > 0.0) & (determinant(aa, ab, ac, ab, bb, bc, ac, bc, cc) > 0.0)


def nearest(a: N, b: N, c: N, d: N, e: N, f: N, g: N, h: N, i: N, xp: Functions[N]) -> Nine[N]:
    """Return the rotation nearest to a matrix that is close to one: its orthogonal polar factor.

    Source: Higham 1986, Newton's X <- (X + X^-T)/2 with the inverse by cofactors.
    The convergence is quadratic: after a step below 1e-9 the error is 1e-18, and the row is finished.
    """
    x = a, b, c, d, e, f, g, h, i
    moving: Condition | None = None
    for _ in range(60):
        after = newton(*x)
        step = largest_of([abs(new - old) for new, old in zip(after, x, strict=True)], xp)
        if moving is None:
            x, moving = after, step >= 1e-9
        else:
            x = nine(xp.where(moving, new, old) for new, old in zip(after, x, strict=True))
            moving = moving & (step >= 1e-9)
        if not xp.some(moving):
            break
    return x


def newton(a: N, b: N, c: N, d: N, e: N, f: N, g: N, h: N, i: N) -> Nine[N]:
    """Take one Newton step towards the orthogonal factor."""
    cofactors = (
        e * i - f * h, f * g - d * i, d * h - e * g,
        c * h - b * i, a * i - c * g, b * g - a * h,
        b * f - c * e, c * d - a * f, a * e - b * d,
    )  # fmt: skip
    half = 0.5 / (a * cofactors[0] + b * cofactors[1] + c * cofactors[2])
    return nine(0.5 * old + half * new for old, new in zip((a, b, c, d, e, f, g, h, i), cofactors, strict=True))


def deviation(a: N, b: N, c: N, d: N, e: N, f: N, g: N, h: N, i: N, xp: Functions[N]) -> N:
    """Return the deviation of a matrix from orthonormal; inf if --normalize does not accept it."""
    off = defect(a, b, c, d, e, f, g, h, i, xp)
    right: Condition = determinant(a, b, c, d, e, f, g, h, i) > SINGULAR
    if not xp.furthest(off) <= TOLERATED:
        products = gram(a, b, c, d, e, f, g, h, i)
        right, off = right & is_near(*products), xp.where(is_multiple(*products), inf, off)
    return xp.where(right, off, inf)


def explained(parts: Sequence[Any], halves: Sequence[Any], xp: Functions[Any]) -> Condition:
    """Return True if rows within `halves` of these may be orthonormal: then only the printed digits are rounded."""
    found: Any = True
    for a in (0, 3, 6):
        found = found & quaternion.explained(parts[a : a + 3], halves[a : a + 3], xp)
        for b in range(a + 3, 9, 3):
            dot = sum((parts[a + at] * parts[b + at] for at in range(3)), 0.0)
            room = sum((abs(parts[a + at]) * halves[b + at] + (abs(parts[b + at]) + halves[b + at]) * halves[a + at]
                        for at in range(3)), 0.0)  # fmt: skip
            found = found & (abs(dot) <= room + SILENT)
    made: Condition = found
    return made


def remark(*entries: float) -> str:
    """Return the warning that a matrix was replaced."""
    off = defect(*nine(entries), floats)
    return f"matrix is orthonormal only to {off:.2g} and was replaced by the nearest rotation"


def complaint(*entries: float, normalize: bool) -> ValueInvalid | None:
    """Return the error for a matrix that is mirrored, singular, a multiple of a rotation or not orthonormal to 1e-3.

    normalize: any with singular values in 0.9 .. 1.1 is accepted
    """
    matrix = nine(entries)
    exponent = frexp(max(map(abs, matrix)))[1]
    scaled = nine(ldexp(part, -exponent) for part in matrix)  # by a power of two: no square leaves the range
    products = gram(*scaled)
    lengths = sqrt(products[0]) * sqrt(products[1]) * sqrt(products[2])
    volume = determinant(*scaled) / (lengths or 1.0)  # in [-1, 1], 0 where a row is zero
    if volume < -SINGULAR:
        found = f"matrix has determinant {determinant(*matrix):.6g}"
        return ValueInvalid(f"{found}: it is left-handed (mirrored); a rotation has 1", rule="mirrored")
    off = defect(*matrix, floats)
    if volume <= SINGULAR:
        rows = ", ".join(" ".join(f"{value:g}" for value in entries[at : at + 3]) for at in (0, 3, 6))
        problem = f"matrix {rows} is singular; no rotation is nearest to it"
    elif off <= TOLERATED:
        return None
    elif is_multiple(*products, ldexp(1.0, min(-2 * exponent, 1000))):
        size = ldexp(sqrt(sum(products[:3]) / 3.0), exponent)
        problem = f"matrix is {size:.6g} times a rotation: a similarity, not a pose"
        problem += " (--scale of compose, invert and apply takes it)"
    else:
        near = is_near(*gram(*matrix))
        if near and normalize:
            return None
        remedy = "(normalize it with --normalize)" if near else "(sheared or scaled unevenly)"
        problem = f"matrix is not a rotation: its rows are orthonormal only to {off:.2g} {remedy}"
    return ValueInvalid(problem, rule="denormalized")


def nine(values: Iterable[N]) -> Nine[N]:
    """Return nine values as a tuple of known length."""
    a, b, c, d, e, f, g, h, i = values
    return a, b, c, d, e, f, g, h, i


def from_six_d(ax: N, ay: N, az: N, bx: N, by: N, bz: N, xp: Functions[N]) -> Four[N]:
    """Return the quaternion of two columns, orthonormalised by Gram and Schmidt.

    The columns need not be unit or orthogonal, but must not be parallel.
    The second is orthogonalised twice: once leaves a residue if they are nearly parallel (Giraud 2005).
    """
    ax, ay, az = quaternion.unit_vector(ax, ay, az, xp)
    along = ax * bx + ay * by + az * bz
    bx, by, bz = quaternion.unit_vector(bx - along * ax, by - along * ay, bz - along * az, xp)
    rest = ax * bx + ay * by + az * bz
    bx, by, bz = bx - rest * ax, by - rest * ay, bz - rest * az
    cx, cy, cz = quaternion.cross(ax, ay, az, bx, by, bz)
    return to_quaternion(ax, bx, cx, ay, by, cy, az, bz, cz, xp)


def as_six_d(x: N, y: N, z: N, w: N) -> Six[N]:
    """Return r11, r21, r31 and r12, r22, r32."""
    r11, r12, _, r21, r22, _, r31, r32, _ = quaternion.to_matrix(x, y, z, w)
    return r11, r21, r31, r12, r22, r32


def six_d_deviation(ax: N, ay: N, az: N, bx: N, by: N, bz: N, xp: Functions[N]) -> N:
    """Return 0 if two columns span a plane, else inf."""
    ax, ay, az, first = quaternion.direction(ax, ay, az, xp)
    bx, by, bz, second = quaternion.direction(bx, by, bz, xp)
    sine = length(*quaternion.cross(ax, ay, az, bx, by, bz), xp)
    return xp.where((sine > PARALLEL) & (first > 0.0) & (second > 0.0), 0.0, inf)


def six_d_complaint(*columns: float, normalize: bool = False) -> ValueInvalid:  # noqa: ARG001
    """Return the error for two columns that span no plane."""
    ax, ay, az, bx, by, bz = columns
    why = "they are parallel" if any((ax, ay, az)) and any((bx, by, bz)) else "one is zero"
    shown = f"columns {ax:g} {ay:g} {az:g} and {bx:g} {by:g} {bz:g}"
    return ValueInvalid(f"{shown} span no plane: {why}", rule="denormalized")
