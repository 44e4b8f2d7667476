"""Lens models: kernels that project points to the plane z = 1 and turn positions in it back into directions.

Points are in optical axes (x right, y down, z forward).  Where a model is not valid the result is marked so.  Floats
and arrays give the same bits; floats do not import numpy.

Nine models share three pairs of kernels: the pinhole is `omni` without xi, `ds` is `eucm` with another centre, `fov` is
an equidistant lens with points stretched before and the plane scaled after.
"""

from __future__ import annotations

from itertools import pairwise
from math import acos, atan2, inf, pi, sqrt
from typing import NamedTuple

from frametool.geometry import floats, quaternion
from frametool.geometry.floats import bearing, half_sincos, polynomial
from frametool.geometry.quaternion import TINY

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from frametool.geometry import Condition, Functions, N, Six, Two

    Seen = tuple[N, N, Condition]
    Found = tuple[N, N, N, Condition]

STEEPEST = 1e8  # (r/z)^2 at 89.994 degrees: a distortion that grows up to there is taken to grow without end
REACH = 1e4  # r/z where the search for such a distortion begins


class Lens(NamedTuple):
    """The parameters of a model.

    D: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, or k1 k2 k3 k4 of equidistant; filled up with zeros
    stretch: of fov, 2 tan(w/2); end: r/z or the angle up to which the model is valid
    """

    D: tuple[float, ...]
    xi: float = 0.0
    alpha: float = 0.0
    beta: float = 1.0
    w: float = 1.0
    stretch: float = 1.0
    end: float = inf


# --- where a distortion stops growing ---


def _slope(coefficients: Sequence[float]) -> list[float]:
    return [power * each for power, each in enumerate(coefficients)][1:]


def _roots(coefficients: Sequence[float], top: float) -> list[float]:
    """Return where a polynomial changes its sign in (0, top], ascending: between the roots of its derivative."""
    if not any(coefficients[1:]):
        return []
    found = []
    for turn, high in pairwise([0.0, *_roots(_slope(coefficients), top), top]):
        low, sign = turn, polynomial(turn, coefficients)
        if sign and sign * polynomial(high, coefficients) <= 0.0:
            while low < (middle := 0.5 * (low + high)) < high:
                low, high = (middle, high) if sign * polynomial(middle, coefficients) > 0.0 else (low, middle)  # noqa: PLW2901
            found.append(high)
    return found


def _brown_end(d: Sequence[float]) -> float:
    """Return r at which r times the radial factor stops growing or has a pole."""

    def times(a: Sequence[float], b: Sequence[float]) -> list[float]:
        return [sum(a[i] * b[k - i] for i in range(k + 1) if i < len(a) and k - i < len(b)) for k in range(7)]

    above, below = (1.0, d[0], d[1], d[4]), (1.0, *d[5:8])
    bends = zip([0.0, *times(_slope(above), below)], [0.0, *times(above, _slope(below))], strict=True)
    growth = [k + 2.0 * (rise - fall) for k, (rise, fall) in zip(times(above, below), bends, strict=False)]
    return sqrt(min([*_roots(growth, STEEPEST), *_roots(below, STEEPEST)], default=inf))


def _equidistant_end(d: Sequence[float]) -> float:
    """Return the angle at which the polynomial stops growing, at most pi."""
    return min([*map(sqrt, _roots(_angle_slope(d), pi * pi)), pi])


# --- distortion and undistortion in the plane ---


def divisor(value: N, xp: Functions[N]) -> N:
    """Return numbers to divide by, without 0, which raises an error for floats."""
    return xp.where(abs(value) > TINY, value, TINY)


def _brown(a: N, b: N, d: Sequence[float], xp: Functions[N]) -> Six[N]:
    """Return the distorted position in the plane (Brown 1966, as in OpenCV) and its derivatives by a and b."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = d
    s = a * a + b * b
    m = divisor(1.0 + s * (k4 + s * (k5 + s * k6)), xp)
    factor = (1.0 + s * (k1 + s * (k2 + s * k3))) / m
    x = a * factor + 2.0 * p1 * a * b + p2 * (s + 2.0 * a * a) + s * (s1 + s * s2)
    y = b * factor + p1 * (s + 2.0 * b * b) + 2.0 * p2 * a * b + s * (s3 + s * s4)
    bend = 2.0 * (k1 + s * (2.0 * k2 + s * (3.0 * k3)) - factor * (k4 + s * (2.0 * k5 + s * (3.0 * k6)))) / m
    gx, gy = 2.0 * (s1 + 2.0 * s2 * s), 2.0 * (s3 + 2.0 * s4 * s)
    across = a * b * bend + 2.0 * (p1 * a + p2 * b)
    xa, xb = factor + a * a * bend + 2.0 * p1 * b + 6.0 * p2 * a + a * gx, across + b * gx
    return x, y, xa, xb, across + a * gy, factor + b * b * bend + 6.0 * p1 * b + 2.0 * p2 * a + b * gy


def _radial(r: N, d: Sequence[float], xp: Functions[N]) -> Two[N]:
    """Return r times the radial factor, and its derivative."""
    k1, k2, _, _, *rest = d[:8]
    x, _, slope, *_ = _brown(r, 0.0 * r, (k1, k2, 0.0, 0.0, *rest, 0.0, 0.0, 0.0, 0.0), xp)
    return x, slope


def _angle_slope(d: Sequence[float]) -> tuple[float, ...]:
    return 1.0, 3.0 * d[0], 5.0 * d[1], 7.0 * d[2], 9.0 * d[3]


def _angular(t: N, d: Sequence[float], _xp: Functions[N]) -> Two[N]:
    """Return the polynomial of equidistant at an angle, and its derivative."""
    return t * polynomial(t * t, (1.0, *d[:4])), polynomial(t * t, _angle_slope(d))


def _inverse(grown: Callable[..., Any], y: N, d: Sequence[float], top: float, tolerance: float, xp: Functions[N]) -> N:
    """Invert a growing function on 0 to the top: Newton's steps of at most half the bracket, else bisection."""
    low, high, t = 0.0 * y, 0.0 * y + top, xp.minimum(y, top)
    for _ in range(60):
        value, slope = grown(t, d, xp)
        low, high = xp.where(value < y, t, low), xp.where(value < y, high, t)
        new = t - (value - y) / xp.where(slope > TINY, slope, TINY)
        new = xp.where(abs(new - t) <= 0.5 * (high - low), new, 0.5 * (low + high))
        going = abs(new - t) > tolerance * (1.0 + t)
        if not xp.some(going):
            break
        t = xp.where(going, new, t)
    return t


def _undistorted(x: N, y: N, lens: Lens, xp: Functions[N]) -> Seen[N]:
    """Return the undistorted position in the plane, to 1e-12, and whether there is one where the model is valid.

    First along the radius, then by Newton's steps in two dimensions, each at most a third of the distance to the
    centre.
    """
    if not any(lens.D):
        return x, y, x == x  # noqa: PLR0124 - False of NaN, for floats and arrays
    r, top = xp.sqrt(x * x + y * y), min(0.999 * lens.end, REACH)
    t = _inverse(_radial, xp.minimum(r, _radial(top, lens.D, floats)[0]), lens.D, top, 1e-3, xp)
    scale = t / xp.where(r > 0.0, r, 1.0)
    a, b = x * scale, y * scale
    for _ in range(20):
        u, v, xa, xb, ya, yb = _brown(a, b, lens.D, xp)
        area = divisor(xa * yb - xb * ya, xp)
        da, db = ((u - x) * yb - (v - y) * xb) / area, ((v - y) * xa - (u - x) * ya) / area
        far, step = xp.sqrt(a * a + b * b), xp.sqrt(da * da + db * db)
        going = step > 4e-16 * (1.0 + far)
        if not xp.some(going):
            break
        share = xp.minimum(0.3 * (far + 0.1) / divisor(step, xp), 1.0)
        a, b = xp.where(going, a - share * da, a), xp.where(going, b - share * db, b)
    u, v, *_ = _brown(a, b, lens.D, xp)
    close = (u - x) * (u - x) + (v - y) * (v - y) <= 1e-24 * (1.0 + r) * (1.0 + r)
    return a, b, close & (a * a + b * b < lens.end * lens.end)


# --- models: points to the plane, the plane to directions ---


def _to_omni(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> Seen[N]:
    n = quaternion.length(x, y, z, xp)
    seen = z > -_omni_limit(lens) * n
    w = xp.where(seen, z + lens.xi * n, 1.0)
    a, b = x / w, y / w
    seen = seen & (a * a + b * b < lens.end * lens.end)
    if any(lens.D):
        a, b, *_ = _brown(a, b, lens.D, xp)
    return a, b, seen


def _from_omni(a: N, b: N, lens: Lens, xp: Functions[N]) -> Found[N]:
    a, b, found = _undistorted(a, b, lens, xp)
    s = a * a + b * b
    root = 1.0 + (1.0 - lens.xi * lens.xi) * s
    scale = (lens.xi + xp.sqrt(xp.maximum(root, 0.0))) / (1.0 + s)
    return scale * a, scale * b, scale - lens.xi, found & (root > 0.0)


def _omni_limit(lens: Lens) -> float:
    return lens.xi if lens.xi <= 1.0 else 1.0 / lens.xi


def _omni_angle(lens: Lens) -> float:
    """Return the angle at which points have no image, or at which the model ends."""
    x, _, z, found = _from_omni(min(lens.end, STEEPEST), 0.0, lens._replace(D=()), floats)
    return min(acos(-_omni_limit(lens)), atan2(x, z) if found and lens.end < inf else pi)


def _to_sphere(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> Seen[N]:
    s = lens.beta * (x * x + y * y)
    n = xp.sqrt(s + z * z)
    d, seen = lens.xi * n + z, z > -_sphere_limit(lens) * n
    d = divisor(xp.where(seen, lens.alpha * xp.sqrt(s + d * d) + (1.0 - lens.alpha) * d, 1.0), xp)
    return x / d, y / d, seen


def _from_sphere(a: N, b: N, lens: Lens, xp: Functions[N]) -> Found[N]:
    xi, alpha, s = lens.xi, lens.alpha, lens.beta * (a * a + b * b)
    root = 1.0 - (2.0 * alpha - 1.0) * s
    m = (1.0 - alpha * alpha * s) / divisor(alpha * xp.sqrt(xp.maximum(root, 0.0)) + 1.0 - alpha, xp)
    second = m * m + (1.0 - xi * xi) * s
    scale = (m * xi + xp.sqrt(xp.maximum(second, 0.0))) / divisor(m * m + s, xp)
    return scale * a, scale * b, scale * m - xi, (root > 0.0) & (second > 0.0)


def _sphere_limit(lens: Lens) -> float:
    limit = min(lens.alpha, 1.0 - lens.alpha) / max(lens.alpha, 1.0 - lens.alpha)
    return min((limit + lens.xi) / sqrt(2.0 * limit * lens.xi + lens.xi * lens.xi + 1.0), 1.0)


def _sphere_angle(lens: Lens) -> float:
    limit = _sphere_limit(lens)
    return atan2(sqrt(1.0 - limit * limit), -limit * sqrt(lens.beta))


def _to_equidistant(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> Seen[N]:
    x, y = lens.stretch * x, lens.stretch * y
    r, n = xp.sqrt(x * x + y * y), quaternion.length(x, y, z, xp)
    t = bearing(r, z, xp.maximum(n, TINY), xp)
    scale = _angular(t, lens.D, xp)[0] / (lens.w * xp.where(r > 0.0, r, 1.0))
    return x * scale, y * scale, (t < lens.end) & (n > 0.0)


def _from_equidistant(a: N, b: N, lens: Lens, xp: Functions[N]) -> Found[N]:
    r = lens.w * xp.sqrt(a * a + b * b)
    sine, cosine = half_sincos(2.0 * _inverse(_angular, r, lens.D, lens.end, 4e-16, xp), xp)
    scale = xp.where(r > 0.0, lens.w * sine / xp.where(r > 0.0, r, 1.0), lens.w) / lens.stretch
    return a * scale, b * scale, cosine, r < _angular(lens.end, lens.D, floats)[0]


class CameraModel(NamedTuple):
    """A lens model.

    aliases: other names; parameters: names of those that are not in D
    coefficients: the possible sizes of D; missing ones are zeros
    to_plane: kernel: x, y, z, lens, xp -> a, b, and whether it is valid there
    from_plane: kernel: a, b, lens, xp -> a direction x, y, z of any length, and whether there is one
    end: D -> `Lens.end`; end_angle: lens -> the largest angle from the optical axis, radians
    """

    aliases: tuple[str, ...]
    parameters: tuple[str, ...]
    coefficients: tuple[int, ...]
    to_plane: Callable[..., Any] = _to_omni
    from_plane: Callable[..., Any] = _from_omni
    end: Callable[[Sequence[float]], float] = _brown_end
    end_angle: Callable[[Lens], float] = _omni_angle


_SPHERE = _to_sphere, _from_sphere, _brown_end, _sphere_angle
_ANGLE = _to_equidistant, _from_equidistant
CAMERA_MODELS = {
    "pinhole": CameraModel(("none",), (), ()),
    "plumb_bob": CameraModel(("radtan", "radial-tangential"), (), (4, 5)),
    "rational_polynomial": CameraModel((), (), (8,)),
    "thin_prism": CameraModel((), (), (12,)),
    "equidistant": CameraModel(
        ("equi", "fisheye", "kannala_brandt", "kb4"), (), (4,), *_ANGLE, _equidistant_end, lambda lens: lens.end
    ),
    "omni": CameraModel(("mei",), ("xi",), (4, 5)),
    "ds": CameraModel(("double_sphere",), ("xi", "alpha"), (), *_SPHERE),
    "eucm": CameraModel((), ("alpha", "beta"), (), *_SPHERE),
    "fov": CameraModel((), ("w",), (), *_ANGLE, lambda _: 0.5 * pi, lambda lens: lens.end),
}
