"""Cameras: the models of lenses with their kernels both ways, and the value of one camera.

A kernel takes points in optical axes (x right, y down, z forward) to the plane at distance 1, or places in that plane
back to directions; K makes pixels of the plane.  u right, v down, the centre of the first pixel is 0, 0.  Where a model
does not hold there is no number: NaN, from Python and in streams alike.  Floats and arrays give the same bits; floats
load no numpy.  Knows no names and no files.
"""

from __future__ import annotations

from itertools import pairwise
from math import acos, atan, atan2, inf, isfinite, nan, pi, sqrt
from typing import NamedTuple

from frametool.errors import ValueInvalid, alternatives, shown, warn
from frametool.geometry import floats, quaternion, rigid, validation
from frametool.geometry.floats import bearing, half_sincos
from frametool.geometry.quaternion import TINY

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from frametool.geometry.transform import Transform
    from frametool.geometry.types import (
        Array,
        Components,
        Condition,
        Functions,
        N,
        Number,
        Numbers,
        Rigid,
        Three,
        Two,
        Vector,
    )

STEEPEST = 1e8  # of (r/z)^2, 89.994 degrees: where a distortion grows up to there it is endless
REACH = 1e4  # of r/z, where the search for an endless one begins
REPROJECTED = 1e-12  # how close a direction must come back to the place in the plane that it was found for
AXES = {  # optical axes from those that a camera's frame may have
    "optical": (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    "opengl": (1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0),
    "flu": (0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0),
}


class Lens(NamedTuple):
    """The parameters of a model.

    D: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, or k1 k2 k3 k4 of equidistant; zeros fill it up
    end: how far it holds: r/z, or the angle of equidistant; infinite where it does not end
    """

    D: tuple[float, ...]
    xi: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    w: float = 0.0
    end: float = inf


# ---------------------------------------------------------------- where a distortion stops growing


def horner(coefficients: Sequence[float], x: N) -> N:
    """Evaluate a polynomial, lowest coefficient first."""
    value = 0.0 * x
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def _first_root(coefficients: Sequence[float], top: float) -> float:
    """Return the least root of a polynomial in (0, top]; infinite if there is none."""
    return min((root for root in _roots(coefficients, top) if root > 0.0), default=inf)


def _roots(coefficients: Sequence[float], top: float) -> list[float]:
    """Return where a polynomial changes its sign in [0, top]: by bisection between the roots of its derivative."""
    if not any(coefficients[1:]):
        return []
    turns = [0.0, *(root for root in _roots(_slope(coefficients), top) if 0.0 < root < top), top]
    found = []
    for low, high in pairwise(turns):
        before, behind = low, high
        sign = horner(coefficients, low)
        if sign == 0.0 or sign * horner(coefficients, high) > 0.0:
            continue
        while before < (middle := 0.5 * (before + behind)) < behind:
            same = sign * horner(coefficients, middle) > 0.0
            before, behind = (middle, behind) if same else (before, middle)
        found.append(behind)
    return found


def _slope(coefficients: Sequence[float]) -> list[float]:
    return [power * each for power, each in enumerate(coefficients)][1:]


def _product(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [sum(a[i] * b[k - i] for i in range(len(a)) if 0 <= k - i < len(b)) for k in range(len(a) + len(b) - 1)]


def _fractions(d: Sequence[float]) -> Two[Any]:
    """Return the polynomials in s = r^2 above and below the line of the radial factor."""
    return (1.0, d[0], d[1], d[4]), (1.0, *d[5:8])


def brown_end(d: Sequence[float]) -> float:
    """Return r at which r times the radial factor stops growing, or that has a pole."""
    above, below = _fractions(d)
    rises, falls = _product(_slope(above), below), _product(above, _slope(below))
    growth = _product(above, below)
    for power in range(6):
        growth[power + 1] += 2.0 * (rises[power] - falls[power])
    return sqrt(min(_first_root(growth, STEEPEST), _first_root(below, STEEPEST)))


def equidistant_end(d: Sequence[float]) -> float:
    """Return the angle at which its polynomial stops growing, at most pi."""
    return min(sqrt(_first_root(_angular_slope(d), pi * pi)), pi)


# ---------------------------------------------------------------- distortions in the plane, and out of them


def distorted(a: N, b: N, d: Sequence[float], xp: Functions[N]) -> Two[N]:
    """Return where a place in the plane comes to lie (Brown 1966, as OpenCV has it)."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = d
    s = a * a + b * b
    factor = 1.0 + s * (k1 + s * (k2 + s * k3))
    if k4 or k5 or k6:
        factor = factor / _divisor(1.0 + s * (k4 + s * (k5 + s * k6)), xp)
    both = 2.0 * a * b
    x = a * factor + p1 * both + p2 * (s + 2.0 * a * a)
    y = b * factor + p1 * (s + 2.0 * b * b) + p2 * both
    if s1 or s2 or s3 or s4:
        x, y = x + s * (s1 + s * s2), y + s * (s3 + s * s4)
    return x, y


def _divisor(value: N, xp: Functions[N]) -> N:
    """Return numbers to divide by: none is 0, at which floats raise."""
    return xp.where(abs(value) > TINY, value, TINY)


def _radial(r: N, d: Sequence[float], xp: Functions[N]) -> Two[N]:
    """Return r times the radial factor, and how fast that grows."""
    above, below = _fractions(d)
    s = r * r
    m = _divisor(horner(below, s), xp)
    factor = horner(above, s) / m
    return r * factor, factor + 2.0 * s * (horner(_slope(above), s) - factor * horner(_slope(below), s)) / m


def _angular(t: N, d: Sequence[float], _xp: Functions[N]) -> Two[N]:
    """Return the polynomial of equidistant at an angle, and how fast it grows."""
    s = t * t
    return t * horner((1.0, *d[:4]), s), horner(_angular_slope(d), s)


def _angular_slope(d: Sequence[float]) -> tuple[float, ...]:
    return 1.0, 3.0 * d[0], 5.0 * d[1], 7.0 * d[2], 9.0 * d[3]


def _inverse(grown: Callable[..., Any], y: N, d: Sequence[float], top: float, tolerance: float, xp: Functions[N]) -> N:
    """Return where in 0 to the top a growing function has a value: Newton, kept in a bracket that shrinks."""
    low, high = 0.0 * y, 0.0 * y + top
    t = xp.minimum(y, top)
    for _ in range(60):
        value, slope = grown(t, d, xp)
        off = value - y
        low, high = xp.where(off < 0.0, t, low), xp.where(off < 0.0, high, t)
        new = t - off / xp.where(slope > TINY, slope, TINY)
        new = xp.where((new >= low) & (new <= high), new, 0.5 * (low + high))
        going = abs(new - t) > tolerance * (1.0 + t)
        if not xp.some(going):
            break
        t = xp.where(going, new, t)
    return t


def undistorted(x: N, y: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    """Return the place in the plane that `distorted` brings here, and whether there is one below the end.

    Radially first, then Newton in two dimensions; a place that lies beyond the end only by the tangential terms begins
    near the end.
    """
    if not any(lens.D):
        return x, y, x == x  # noqa: PLR0124 - False of NaN, for floats and arrays
    r, top = xp.sqrt(x * x + y * y), min(0.999 * lens.end, REACH)
    t = _inverse(_radial, xp.minimum(r, _radial(top, lens.D, floats)[0]), lens.D, top, 1e-3, xp)
    scale = t / xp.where(r > 0.0, r, 1.0)
    a, b = x * scale, y * scale
    for _ in range(20):
        da, db = _step(a, b, x, y, lens.D, xp)
        going = xp.sqrt(da * da + db * db) > 4e-16 * (1.0 + xp.sqrt(a * a + b * b))
        if not xp.some(going):
            break
        a, b = xp.where(going, a - da, a), xp.where(going, b - db, b)
    u, v = distorted(a, b, lens.D, xp)
    u, v = u - x, v - y
    close = xp.sqrt(u * u + v * v) <= REPROJECTED * (1.0 + r)
    return a, b, close & (a * a + b * b < lens.end * lens.end)


def _step(a: N, b: N, x: N, y: N, d: Sequence[float], xp: Functions[N]) -> Two[N]:
    """Return Newton's step in the plane, about a third of the way from the centre at most."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = d
    s = a * a + b * b
    m = _divisor(1.0 + s * (k4 + s * (k5 + s * k6)), xp)
    factor = (1.0 + s * (k1 + s * (k2 + s * k3))) / m
    bend = 2.0 * (k1 + s * (2.0 * k2 + s * (3.0 * k3)) - factor * (k4 + s * (2.0 * k5 + s * (3.0 * k6)))) / m
    gx, gy = 2.0 * (s1 + 2.0 * s2 * s), 2.0 * (s3 + 2.0 * s4 * s)
    across = a * b * bend + 2.0 * (p1 * a + p2 * b)
    xa, xb = factor + a * a * bend + 2.0 * p1 * b + 6.0 * p2 * a + a * gx, across + b * gx
    ya, yb = across + a * gy, factor + b * b * bend + 6.0 * p1 * b + 2.0 * p2 * a + b * gy
    u, v = distorted(a, b, d, xp)
    u, v = u - x, v - y
    area = _divisor(xa * yb - xb * ya, xp)
    da, db = (u * yb - v * xb) / area, (v * xa - u * ya) / area
    limit, length = 0.3 * (xp.sqrt(s) + 0.1), xp.sqrt(da * da + db * db)
    far = length > limit
    short = xp.where(far, limit / xp.where(far, length, 1.0), 1.0)
    return da * short, db * short


# ---------------------------------------------------------------- models: points to the plane, the plane to directions


def _to_pinhole(x: N, y: N, z: N, _lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    seen = z > 0.0
    z = xp.where(seen, z, 1.0)
    return x / z, y / z, seen


def _to_brown(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    a, b, seen = _to_pinhole(x, y, z, lens, xp)
    seen = seen & (a * a + b * b < lens.end * lens.end)
    a, b = distorted(a, b, lens.D, xp)
    return a, b, seen


def _to_equidistant(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    r, n = xp.sqrt(x * x + y * y), quaternion.length(x, y, z, xp)
    t = bearing(r, z, xp.maximum(n, TINY), xp)
    scale = _angular(t, lens.D, xp)[0] / xp.where(r > 0.0, r, 1.0)
    return x * scale, y * scale, (t < lens.end) & (n > 0.0)


def _to_omni(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    n = quaternion.length(x, y, z, xp)
    w = z + lens.xi * n
    seen = z > -_omni_limit(lens) * n
    w = xp.where(seen, w, 1.0)
    a, b = x / w, y / w
    seen = seen & (a * a + b * b < lens.end * lens.end)
    a, b = distorted(a, b, lens.D, xp)
    return a, b, seen


def _omni_limit(lens: Lens) -> float:
    return lens.xi if lens.xi <= 1.0 else 1.0 / lens.xi


def _to_ds(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    squared = x * x + y * y
    n = xp.sqrt(squared + z * z)
    d = lens.xi * n + z
    seen = z > -_ds_limit(lens) * n
    d = xp.where(seen, lens.alpha * xp.sqrt(squared + d * d) + (1.0 - lens.alpha) * d, 1.0)
    return x / d, y / d, seen


def _ds_limit(lens: Lens) -> float:
    limit = _eucm_limit(lens)
    return (limit + lens.xi) / sqrt(2.0 * limit * lens.xi + lens.xi * lens.xi + 1.0)


def _to_eucm(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    h = xp.sqrt(lens.beta * (x * x + y * y) + z * z)
    seen = z > -_eucm_limit(lens) * h
    h = xp.where(seen, lens.alpha * h + (1.0 - lens.alpha) * z, 1.0)
    return x / h, y / h, seen


def _eucm_limit(lens: Lens) -> float:
    alpha = lens.alpha
    return alpha / (1.0 - alpha) if alpha <= 0.5 else (1.0 - alpha) / alpha


def _to_fov(x: N, y: N, z: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, Condition]:
    r, seen = xp.sqrt(x * x + y * y), z > 0.0
    rise = _fov_slope(lens) * r
    t = bearing(rise, z, xp.maximum(xp.sqrt(rise * rise + z * z), TINY), xp)
    scale = t / (lens.w * xp.where(r > 0.0, r, 1.0))
    return x * scale, y * scale, seen


def _fov_slope(lens: Lens) -> float:
    sine, cosine = half_sincos(lens.w, floats)
    return 2.0 * sine / cosine


def _from_brown(a: N, b: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, N, Condition]:
    a, b, found = undistorted(a, b, lens, xp)
    return a, b, 0.0 * a + 1.0, found


def _from_equidistant(a: N, b: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, N, Condition]:
    r = xp.sqrt(a * a + b * b)
    t = _inverse(_angular, r, lens.D, lens.end, 4e-16, xp)
    sine, cosine = half_sincos(2.0 * t, xp)
    scale = xp.where(r > 0.0, sine / xp.where(r > 0.0, r, 1.0), 1.0)
    return a * scale, b * scale, cosine, r < _angular(lens.end, lens.D, floats)[0]


def _from_omni(a: N, b: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, N, Condition]:
    a, b, found = undistorted(a, b, lens, xp)
    s = a * a + b * b
    root = 1.0 + (1.0 - lens.xi * lens.xi) * s
    scale = (lens.xi + xp.sqrt(xp.maximum(root, 0.0))) / (1.0 + s)
    return scale * a, scale * b, scale - lens.xi, found & (root > 0.0)


def _from_ds(a: N, b: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, N, Condition]:
    xi, alpha = lens.xi, lens.alpha
    s = a * a + b * b
    root = 1.0 - (2.0 * alpha - 1.0) * s
    m = (1.0 - alpha * alpha * s) / _divisor(alpha * xp.sqrt(xp.maximum(root, 0.0)) + 1.0 - alpha, xp)
    second = m * m + (1.0 - xi * xi) * s
    scale = (m * xi + xp.sqrt(xp.maximum(second, 0.0))) / _divisor(m * m + s, xp)
    return scale * a, scale * b, scale * m - xi, (root > 0.0) & (second > 0.0)


def _from_eucm(a: N, b: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, N, Condition]:
    alpha, s = lens.alpha, lens.beta * (a * a + b * b)
    root = 1.0 - (2.0 * alpha - 1.0) * s
    z = (1.0 - alpha * alpha * s) / _divisor(alpha * xp.sqrt(xp.maximum(root, 0.0)) + 1.0 - alpha, xp)
    return a, b, z, root > 0.0


def _from_fov(a: N, b: N, lens: Lens, xp: Functions[N]) -> tuple[N, N, N, Condition]:
    r = xp.sqrt(a * a + b * b)
    t = lens.w * r
    sine, cosine = half_sincos(2.0 * t, xp)
    scale = xp.where(r > 0.0, sine / xp.where(r > 0.0, r, 1.0), lens.w)
    return a * scale, b * scale, _fov_slope(lens) * cosine, t < 0.5 * pi


def _brown_angle(lens: Lens) -> float:
    return atan(lens.end)


def _omni_angle(lens: Lens) -> float:
    """Return the angle at which points have no image, or that at which the distortion ends."""
    angle = acos(-_omni_limit(lens))
    if lens.end == inf or 1.0 + (1.0 - lens.xi**2) * lens.end**2 <= 0.0:
        return angle
    x, _, z, _ = _from_omni(lens.end, 0.0, lens._replace(D=()), floats)
    return min(angle, atan2(x, z))


def _eucm_angle(lens: Lens) -> float:
    limit = _eucm_limit(lens)
    return atan2(sqrt(1.0 - limit * limit), -limit * sqrt(lens.beta))


class CameraModel(NamedTuple):
    """A model of a lens.

    aliases: its other names
    coefficients: how many numbers its D may have; none are zeros
    parameters: names of those that are not in D
    to_plane: kernel: x, y, z, lens, xp -> a, b, whether it holds there
    from_plane: kernel: a, b, lens, xp -> a direction x, y, z of any length, whether there is one
    end: D -> where the distortion stops growing, as Lens has it
    end_angle: lens -> from the optical axis on, in radians
    """

    aliases: tuple[str, ...]
    coefficients: tuple[int, ...]
    parameters: tuple[str, ...]
    to_plane: Callable[..., Any]
    from_plane: Callable[..., Any]
    end: Callable[[Sequence[float]], float]
    end_angle: Callable[[Lens], float]


def _endless(_d: Sequence[float]) -> float:
    return inf


_BROWN = _to_brown, _from_brown, brown_end, _brown_angle
CAMERA_MODELS = {
    "pinhole": CameraModel(("none",), (), (), _to_pinhole, _from_brown, _endless, _brown_angle),
    "plumb_bob": CameraModel(("radtan", "radial-tangential"), (4, 5), (), *_BROWN),
    "rational_polynomial": CameraModel((), (8,), (), *_BROWN),
    "thin_prism": CameraModel((), (12,), (), *_BROWN),
    "equidistant": CameraModel(
        ("equi", "fisheye", "kannala_brandt", "kb4"), (4,), (),
        _to_equidistant, _from_equidistant, equidistant_end, lambda lens: lens.end,
    ),
    "omni": CameraModel(("mei",), (4, 5), ("xi",), _to_omni, _from_omni, brown_end, _omni_angle),
    "ds": CameraModel(
        ("double_sphere",), (), ("xi", "alpha"), _to_ds, _from_ds, _endless, lambda lens: acos(-_ds_limit(lens))
    ),
    "eucm": CameraModel((), (), ("alpha", "beta"), _to_eucm, _from_eucm, _endless, _eucm_angle),
    "fov": CameraModel((), (), ("w",), _to_fov, _from_fov, _endless, _brown_angle),
}  # fmt: skip


class Camera:
    """One camera; frozen.

        camera = Camera("plumb_bob", [500.0, 500.0, 319.5, 239.5], [-0.3, 0.1, 0.0, 0.0], (640, 480))
        pixels, depth = camera.project(points)      # (.., 3) -> (.., 2), (..); NaN where there is no pixel
        rays = camera.unproject(pixels)             # unit directions; with depth= or range= points

    end_angle: from the optical axis on, in radians; beyond it there are no pixels
    numbers: fx, fy, cx, cy, skew; fields: what the constructor takes
    Methods whose names end in `_of` take and return components: floats, which load no numpy, or arrays.
    """

    model: str
    numbers: tuple[float, float, float, float, float]
    D: tuple[float, ...]
    size: tuple[int, int] | None
    axes: str
    end_angle: float
    lens: Lens
    fields: dict[str, Any]
    _turn: tuple[float, ...]
    _shift: tuple[float, ...]

    def __init__(
        self,
        model: str | None,
        K: Any,  # noqa: N803 - as everybody calls it
        D: Any = (),  # noqa: N803
        size: Sequence[int] | None = None,
        *,
        skew: float = 0.0,
        axes: str = "optical",
        R: Any = None,  # noqa: N803
        P: Any = None,  # noqa: N803
        turn: Sequence[float] | None = None,
        shift: Sequence[float] = (0.0, 0.0, 0.0),
        **parameters: float | None,
    ) -> None:
        """Check and keep what a camera is.

        model: a name of `CAMERA_MODELS` or an alias; None: by the parameters and how many numbers D has
        K: fx, fy, cx, cy or 3 rows of 3, in pixels; skew is K[0][1]; D: the distortion; size: width and height
        axes: those of the frame that points are seen in: optical, opengl or flu
        R, P: 9 and 12 numbers that make the rectified picture; parameters: xi, alpha, beta, w, as the model has them
        turn, shift: 9 numbers that rotate points in optical axes, metres that are added then: of rectified cameras
        Raises ValueInvalid.
        """
        coefficients = _coefficients(D)
        given = {name: _numbers(value, name, 1)[0] for name, value in parameters.items() if value is not None}
        name = _model_of(model, coefficients, given)
        row = CAMERA_MODELS[name]
        _check(name, row, coefficients, given)
        if axes not in AXES:
            raise ValueInvalid(f"axes {shown(axes)} are not known; axes: {', '.join(AXES)}")
        fx, fy, cx, cy, slant = _intrinsics(K)
        numbers = fx, fy, cx, cy, _numbers(skew, "skew", 1)[0] or slant
        lens = Lens((*coefficients, *(0.0,) * 12)[:12], **given)
        lens = lens._replace(end=row.end(lens.D))
        shape = None if size is None else _size(size)
        fields: dict[str, Any] = {"model": name, "K": [fx, fy, cx, cy], "D": [*coefficients]}
        fields |= {"size": shape and [*shape], "skew": numbers[4], **given, "axes": axes}
        fields |= {"turn": turn, "shift": (*shift,)}
        fields |= {} if R is None else {"R": [*_numbers(R, "R", 9)]}
        fields |= {} if P is None else {"P": [*_numbers(P, "P", 12)]}
        vars(self).update(
            model=name, numbers=numbers, D=coefficients, size=shape, axes=axes, lens=lens,
            end_angle=row.end_angle(lens), fields=fields, _shift=tuple(shift),
            _turn=AXES[axes] if turn is None else _matrix_product(turn, AXES[axes]),
        )  # fmt: skip

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse to change."""
        raise AttributeError(f"a camera is frozen; {name} cannot be set")

    def __repr__(self) -> str:
        """Show what it is made of."""
        return f"Camera({', '.join(f'{name}={value!r}' for name, value in self.mapping().items())})"

    @property
    def K(self) -> Array:  # noqa: N802 - as everybody calls it
        """The matrix of the pinhole, 3 x 3, in pixels."""
        import numpy as np

        fx, fy, cx, cy, skew = self.numbers
        return np.array([[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def mapping(self) -> dict[str, Any]:
        """Return it as `camera:` of a tree has it."""
        usual = {"skew": 0.0, "axes": "optical", "D": [], "size": None, "turn": None, "shift": (0.0, 0.0, 0.0)}
        return {name: value for name, value in self.fields.items() if name not in usual or value != usual[name]}

    # --- cameras made of it ---

    def changed(self, **fields: Any) -> Camera:
        """Return one that differs in something that the constructor takes."""
        return Camera(**{**self.fields, **fields})

    def flat(self) -> Camera:
        """Return the pinhole of its K: its picture without distortion."""
        return self.changed(model="pinhole", D=(), **dict.fromkeys(CAMERA_MODELS[self.model].parameters))

    def rectified(self, *, from_first: bool = False) -> Camera:
        """Return the camera of the rectified picture: R turns the points, then P's 3 x 3, no distortion.

        from_first: points are those of the first camera's rectified frame: P [X; 1], without R
        Raises ValueInvalid where P is not known.
        """
        if "P" not in self.fields:
            raise ValueInvalid("the rectified picture is not known: the camera has no P")
        p = self.fields["P"]
        flat = self.flat().changed(K=[p[0:3], p[4:7], p[8:11]], skew=0.0)
        if not from_first:
            if p[3] or p[7] or p[11]:
                warn(f"column 4 of P, {p[3]:g} {p[7]:g} {p[11]:g}, is a pose and not applied: --from-first applies it")
            return flat.changed(turn=self.fields.get("R"))
        fx, fy, cx, cy, skew = flat.numbers
        down = (p[7] - cy * p[11]) / fy
        return flat.changed(shift=((p[3] - cx * p[11] - skew * down) / fx, down, p[11]))

    def scaled(self, size: Sequence[int]) -> Camera:
        """Return the camera of the picture in another size of the same shape; raises ValueInvalid for another shape.

        Where the camera has no size yet it gets this one.
        """
        width, height = _size(size)
        if self.size is None or self.size == (width, height):
            return self.changed(size=(width, height))
        across, down = width / self.size[0], height / self.size[1]
        if abs(height - self.size[1] * across) >= 1.0 and abs(width - self.size[0] * down) >= 1.0:
            known = f"{self.size[0]} x {self.size[1]}"
            raise ValueInvalid(f"size {width} x {height} is another shape than {known}")
        return self.resampled((across, down), (0.5 * across - 0.5, 0.5 * down - 0.5), (width, height))

    def resampled(self, scale: Two[float], shift: Two[float], size: Sequence[int] | None) -> Camera:
        """Return the camera of a picture whose pixels are scaled and then shifted."""
        fx, fy, cx, cy, skew = self.numbers
        across, down = scale
        four = fx * across, fy * down, cx * across + shift[0], cy * down + shift[1]
        made: dict[str, Any] = {"K": four, "skew": skew * across}
        if p := self.fields.get("P"):
            rows = zip(p[0:4], p[4:8], p[8:12], strict=True)
            right, below, last = zip(
                *((across * a + shift[0] * c, down * b + shift[1] * c, c) for a, b, c in rows), strict=True
            )
            made["P"] = *right, *below, *last
        return self.changed(**made, size=size)

    # --- components ---

    def pixels_of(self, x: Number, y: Number, z: Number) -> Vector:
        """Return u, v and the depth, z in optical axes, of points; u and v are NaN where there is no pixel."""
        return validation.run(self._project, 3, (x, y, z))

    def rays_of(self, u: Number, v: Number) -> Vector:
        """Return unit directions x, y, z of pixels, in the axes of the camera's frame; NaN where there is none."""
        return validation.run(lambda u, v, xp: self._unturned(*self._ray(u, v, xp)), 3, (u, v))

    def points_of(self, u: Number, v: Number, depth: Number = None, range: Number = None) -> Vector:  # noqa: A002
        """Return points x, y, z in the camera's frame of pixels and their depth, or their range from the camera."""
        kernel = self._at_depth if range is None else self._at_range
        return validation.run(kernel, 3, (u, v, depth if range is None else range))

    def plane_points_of(self, u: Number, v: Number, plane_from_camera: Rigid, height: Number = 0.0) -> Vector:
        """Return where the rays of pixels meet z = height of a frame, in that frame; NaN behind and above the horizon.

        plane_from_camera: tx, ty, tz, x, y, z, w
        """
        return validation.run(self._on_plane, 3, (u, v, height, *plane_from_camera))

    def undistorted_of(self, u: Number, v: Number, into: Camera | None = None) -> Two[Number]:
        """Return where pixels are in the picture of another camera in the same place; otherwise as `undistort`."""
        into = into or self.flat()
        return into.pixels_of(*self.rays_of(u, v))[:2]

    def is_in_image(self, u: Number, v: Number) -> Any:
        """Return whether pixels, none of which is NaN, lie in the picture; raises ValueInvalid where it has no size."""
        if self.size is None:
            raise ValueInvalid("the size of the picture is not known; give it")
        width, height = self.size
        return (u >= -0.5) & (u < width - 0.5) & (v >= -0.5) & (v < height - 0.5)

    def is_behind(self, depth: Number) -> Any:
        """Return whether points without a pixel have none because they are behind the camera.

        The others lie beyond the model, `end_angle` from the axis; of a model that looks back all do.
        """
        return (depth <= 0.0) & (self.end_angle <= 0.5 * pi)

    # --- arrays ---

    def project(self, points: Numbers) -> tuple[Array, Any]:
        """Return pixels (.., 2) and depths (..) of points (.., 3) in the camera's frame.

        The depth is z in optical axes.  Pixels are NaN behind the camera and where the model does not hold.
        """
        u, v, depth = self.pixels_of(*_columns(points, 3, "points"))
        return validation.stacked((u, v)), depth

    def unproject(self, pixels: Numbers, depth: Numbers | None = None, range: Numbers | None = None) -> Array:  # noqa: A002
        """Return unit directions (.., 3) of pixels (.., 2) in the camera's frame; points where more is known.

        depth: z in optical axes; range: the distance from the camera.  NaN where there is none.
        """
        u, v = _columns(pixels, 2, "pixels")
        if depth is None and range is None:
            return validation.stacked(self.rays_of(u, v))
        if depth is not None and range is not None:
            raise ValueInvalid("unproject takes depth or range, not both")
        far = validation.scalars(depth if range is None else range, "depth or range")
        return validation.stacked(self.points_of(u, v, *((far, None) if range is None else (None, far))))

    def on_plane(self, pixels: Numbers, plane_from_camera: Transform, height: float = 0.0) -> Array:
        """Return where the rays of pixels (.., 2) meet z = height of a frame: points (.., 3) in it, NaN for no such."""
        u, v = _columns(pixels, 2, "pixels")
        return validation.stacked(self.plane_points_of(u, v, plane_from_camera.components, float(height)))

    def undistort(self, pixels: Numbers, into: Camera | None = None) -> Array:
        """Return pixels (.., 2) of the picture without distortion: that of K without D, or of another camera's.

        into: as `camera.rectified()`
        """
        u, v = _columns(pixels, 2, "pixels")
        return validation.stacked(self.undistorted_of(u, v, into))

    def in_image(self, pixels: Numbers) -> Any:
        """Return whether pixels (.., 2) lie in the picture."""
        return self.is_in_image(*_columns(pixels, 2, "pixels"))

    # --- kernels ---

    def _project(self, x: N, y: N, z: N, xp: Functions[N]) -> Three[N]:
        a, b, c, d, e, f, g, h, i = self._turn
        right, below, ahead = self._shift
        x, y, z = a * x + b * y + c * z + right, d * x + e * y + f * z + below, g * x + h * y + i * z + ahead
        a, b, seen = CAMERA_MODELS[self.model].to_plane(x, y, z, self.lens, xp)
        fx, fy, cx, cy, skew = self.numbers
        return xp.where(seen, fx * a + skew * b + cx, nan), xp.where(seen, fy * b + cy, nan), z

    def _ray(self, u: N, v: N, xp: Functions[N]) -> Three[N]:
        """Return unit directions in optical axes, as the model sees."""
        fx, fy, cx, cy, skew = self.numbers
        b = (v - cy) / fy
        a = (u - cx - skew * b) / fx
        x, y, z, found = CAMERA_MODELS[self.model].from_plane(a, b, self.lens, xp)
        length = xp.where(found, quaternion.length(x, y, z, xp), nan)
        return x / length, y / length, z / length

    def _unturned(self, x: N, y: N, z: N) -> Three[N]:
        a, b, c, d, e, f, g, h, i = self._turn
        return a * x + d * y + g * z + 0.0, b * x + e * y + h * z + 0.0, c * x + f * y + i * z + 0.0

    def _at(self, x: N, y: N, z: N, scale: N) -> Three[N]:
        right, below, ahead = self._shift
        return self._unturned(x * scale - right, y * scale - below, z * scale - ahead)

    def _at_depth(self, u: N, v: N, depth: N, xp: Functions[N]) -> Three[N]:
        x, y, z = self._ray(u, v, xp)
        scale = depth / _divisor(z, xp)
        return self._at(x, y, z, xp.where(scale > 0.0, scale, nan))

    def _at_range(self, u: N, v: N, distance: N, xp: Functions[N]) -> Three[N]:
        return self._at(*self._ray(u, v, xp), xp.where(distance >= 0.0, distance, nan))

    def _on_plane(
        self, u: N, v: N, height: N, tx: N, ty: N, tz: N, qx: N, qy: N, qz: N, qw: N, xp: Functions[N]
    ) -> Three[N]:
        zero = 0.0 * u
        ox, oy, oz = rigid.apply(tx, ty, tz, qx, qy, qz, qw, *self._at(zero, zero, zero, zero))
        x, y, z = quaternion.rotate(qx, qy, qz, qw, *self._unturned(*self._ray(u, v, xp)))
        scale = (height - oz) / _divisor(z, xp)
        scale = xp.where(scale > 0.0, scale, nan)
        return ox + scale * x, oy + scale * y, 0.0 * scale + height


def _columns(value: Numbers, width: int, name: str) -> Components:
    """Take (.., width) numbers apart: floats of one item, or columns; what is not finite passes."""
    array = validation.as_numbers(value, name)
    if array.ndim == 0 or array.shape[-1] != width:
        raise ValueInvalid(f"{name}: expected shape (..., {width}), got {array.shape}")
    return tuple(array.astype(float).tolist()) if array.ndim == 1 else tuple(array[..., at] for at in range(width))


def _numbers(value: Any, what: str, *counts: int) -> tuple[float, ...]:
    """Flatten lists of finite numbers; raises ValueInvalid for others, and for another count."""
    value = value.tolist() if hasattr(value, "tolist") else value
    rows = value if isinstance(value, (list, tuple)) else [value]
    flat = [each for row in rows for each in (row if isinstance(row, (list, tuple)) else [row])]
    for each in flat:
        if type(each) not in (int, float) or not isfinite(each):
            raise ValueInvalid(f"{what}: {shown(each)} is not a finite number")
    if counts and len(flat) not in counts:
        raise ValueInvalid(f"{what} is {' or '.join(map(str, counts))} number{'s' * (counts != (1,))}, not {len(flat)}")
    return tuple(float(each) + 0.0 for each in flat)


def _intrinsics(value: Any) -> tuple[float, ...]:
    """Return fx, fy, cx, cy, skew of K as four numbers or three rows."""
    numbers = _numbers(value, "K", 4, 9)
    if len(numbers) == 4:
        numbers = numbers[0], 0.0, numbers[2], 0.0, numbers[1], numbers[3], 0.0, 0.0, 1.0
    fx, skew, cx, zero, fy, cy, *last = numbers
    if zero or last != [0.0, 0.0, 1.0]:
        raise ValueInvalid("K is no matrix of a camera: its rows are fx skew cx, 0 fy cy and 0 0 1")
    for name, each in (("fx", fx), ("fy", fy)):
        if not each:
            raise ValueInvalid(f"{name} is 0: the camera is not calibrated")
    return fx, fy, cx, cy, skew


def _size(value: Any) -> tuple[int, int]:
    width, height = _numbers(value, "size", 2)
    if not (width >= 1.0 and height >= 1.0 and width.is_integer() and height.is_integer()):
        raise ValueInvalid(f"size {width:g} x {height:g} is no size: give whole pixels, width and height")
    return int(width), int(height)


def _coefficients(value: Any) -> tuple[float, ...]:
    """Return D without the two angles of a tilted sensor, which must be 0."""
    found = _numbers(value, "D")
    if len(found) == 14 and any(found[12:]):
        raise ValueInvalid(f"D is of a tilted sensor, tau {found[12]:g} {found[13]:g}, which is not read")
    return found[:12] if len(found) == 14 else found


def _model_of(model: str | None, coefficients: Sequence[float], parameters: dict[str, float]) -> str:
    """Return the name of a model; of none the one that has such parameters and so many coefficients."""
    count = len(coefficients)
    if model is None:
        fitting = [name for name, row in CAMERA_MODELS.items() if {*row.parameters} == parameters.keys()]
        fitting = [each for each in fitting if count in (CAMERA_MODELS[each].coefficients or (0,))] or fitting
        if len(fitting) > 1 and count == 4:
            raise ValueInvalid(f"4 coefficients: {' or '.join(f'--model {name}' for name in fitting)}")
        model = fitting[0] if fitting else "pinhole"
    name = next((name for name, row in CAMERA_MODELS.items() if model.lower() in (name, *row.aliases)), "")
    if not name:
        raise ValueInvalid(f"camera model {shown(model)} is not known{alternatives(model, CAMERA_MODELS, 'models')}")
    counted = {8: "rational_polynomial", 12: "thin_prism"}.get(count)
    if name == "plumb_bob" and counted:
        warn(f"plumb_bob with {count} coefficients is read as {counted}")
        return counted
    return name


def _check(name: str, row: CameraModel, coefficients: Sequence[float], parameters: dict[str, float]) -> None:
    """Raise ValueInvalid where a model cannot have such numbers."""
    if coefficients and len(coefficients) not in row.coefficients:
        counts = " or ".join(map(str, row.coefficients)) or "no"
        raise ValueInvalid(f"{name} has {counts} coefficients in D, not {len(coefficients)}")
    if parameters.keys() != {*row.parameters}:
        needed = " and ".join(row.parameters) or "no parameters beside D"
        raise ValueInvalid(f"{name} has {needed}, not {' and '.join(parameters) or 'none'}")
    ranges = {"alpha": (0.0, 1.0), "beta": (TINY, inf), "w": (TINY, 3.14), "xi": (-1.0 if name == "ds" else 0.0, inf)}
    for each, value in parameters.items():
        low, high = ranges[each]
        if not low <= value <= high:
            raise ValueInvalid(f"{each} {value:g} is beyond {low:g} .. {high:g}")


def _matrix_product(a: Sequence[float], b: Sequence[float]) -> tuple[float, ...]:
    return tuple(sum(a[3 * row + k] * b[3 * k + column] for k in range(3)) for row in range(3) for column in range(3))
