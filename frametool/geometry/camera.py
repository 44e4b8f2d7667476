"""The value of one camera: pixels of points, and rays or points of pixels.

u right, v down, the centre of the first pixel is 0, 0; K maps the plane of the lens model to pixels.  Where a model is
not valid the result is NaN.  Knows no files.
"""

from __future__ import annotations

from functools import partial
from math import inf, isfinite, nan, pi, tan

from frametool.errors import ValueInvalid, alternatives, shown, warn
from frametool.geometry import quaternion, rigid, validation
from frametool.geometry.lenses import CAMERA_MODELS, CameraModel, Lens, divisor
from frametool.geometry.quaternion import TINY

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from frametool.geometry import Array, Functions, N, Number, Numbers, Rigid, Three, Two, Vector

AXES = {  # optical axes from those of a camera's frame
    "optical": (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    "opengl": (1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0),
    "flu": (0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0),
}
RANGES = {"xi": (-0.999999, inf), "alpha": (0.0, 1.0), "beta": (TINY, inf), "w": (TINY, 3.14)}


class Camera:
    """One camera; immutable.

        camera = Camera("plumb_bob", [500.0, 500.0, 319.5, 239.5], [-0.3, 0.1, 0.0, 0.0], (640, 480))
        pixels, depth = camera.project(points)      # (.., 3) -> (.., 2), (..); NaN where there is no pixel
        rays = camera.unproject(pixels)             # unit directions; with depth= or range= points

    end_angle: the largest angle from the optical axis, in radians; beyond it there are no pixels
    numbers: fx, fy, cx, cy, skew; fields: the arguments of the constructor
    Methods whose names end in `_of` take and return components: floats, which do not import numpy, or arrays.
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

    def __init__(
        self, model: str | None, K: Any, D: Any = (), size: Any = None, *, skew: float = 0.0, axes: str = "optical",  # noqa: N803
        R: Any = None, P: Any = None, turn: Any = None, shift: Vector = (0.0, 0.0, 0.0), **parameters: float | None,  # noqa: N803
    ) -> None:  # fmt: skip
        """Check the parameters of a camera.

        model: a name of `CAMERA_MODELS` or an alias; None: inferred from the parameters and the size of D
        K: fx, fy, cx, cy or 3 rows of 3, in pixels; skew is K[0][1]; D: the distortion; size: width and height
        axes: those of the frame in which points are expressed: optical, opengl or flu
        R, P: 9 and 12 numbers of the rectified image; parameters: xi, alpha, beta, w, as the model needs them
        turn, shift: for rectified cameras, 9 numbers that rotate points in optical axes, then a translation in metres
        Raises ValueInvalid.
        """
        d = _numbers(D, "D")
        if any(d[12:14]):
            raise ValueInvalid(f"D is of a tilted sensor, tau {d[12]:g} {d[13]:g}, which is not read")
        d = d[:12] if len(d) == 14 else d
        own = {name: _numbers(value, name, 1)[0] for name, value in parameters.items() if value is not None}
        name, row = _model_of(model, len(d), own)
        if axes not in AXES:
            raise ValueInvalid(f"axes {shown(axes)} are not known; axes: {', '.join(AXES)}")
        lens = Lens((*d, *(0.0,) * 12)[:12], stretch=2.0 * tan(0.5 * own["w"]) if "w" in own else 1.0, **own)
        lens = lens._replace(end=row.end(lens.D))
        k = _numbers(K, "K", 4, 9)
        k = k if len(k) == 9 else (k[0], 0.0, k[2], 0.0, k[1], k[3], 0.0, 0.0, 1.0)
        if k[3] or k[6:] != (0.0, 0.0, 1.0):
            raise ValueInvalid("K is not a camera matrix: its rows are fx skew cx, 0 fy cy and 0 0 1")
        if not (k[0] and k[4]):
            raise ValueInvalid(f"{'fy' if k[0] else 'fx'} is 0: the camera is not calibrated")
        numbers = k[0], k[4], k[2], k[5], _numbers(skew, "skew", 1)[0] or k[1]
        size = None if size is None else _size(size)
        fields: dict[str, Any] = {"model": name, "K": [*numbers[:4]], "D": [*d], "size": size and [*size]}
        fields |= {"skew": numbers[4], **own, "axes": axes, "shift": shift}
        for key, each, count in (("R", R, 9), ("P", P, 12), ("turn", turn, 9)):
            fields[key] = None if each is None else [*_numbers(each, key, count)]
        a, b = AXES[axes], fields["turn"] or AXES["optical"]
        vars(self).update(
            model=name, numbers=numbers, D=d, size=size, axes=axes, lens=lens, end_angle=row.end_angle(lens),
            fields=fields, _turn=[sum(b[i + k] * a[3 * k + j] for k in range(3)) for i in (0, 3, 6) for j in range(3)],
        )  # fmt: skip

    def __setattr__(self, name: str, value: object) -> None:
        """Raise AttributeError: a camera is immutable."""
        raise AttributeError(f"a camera is frozen; {name} cannot be set")

    def __repr__(self) -> str:
        """Show the arguments of the constructor."""
        return f"Camera({', '.join(f'{name}={value!r}' for name, value in self.mapping().items())})"

    @property
    def K(self) -> Array:  # noqa: N802 - as everybody calls it
        """The camera matrix, 3 x 3, in pixels."""
        import numpy as np

        return np.array(self._rows())

    def _rows(self) -> list[list[float]]:
        fx, fy, cx, cy, skew = self.numbers
        return [[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]

    def mapping(self) -> dict[str, Any]:
        """Return the camera as the mapping under `camera:` in a tree."""
        usual: tuple[Any, ...] = (0.0, "optical", [], None, (0.0, 0.0, 0.0))
        return {name: value for name, value in self.fields.items() if value not in usual or name in ("xi", "alpha")}

    # --- cameras derived from it ---

    def changed(self, **fields: Any) -> Camera:
        """Return a copy with other arguments of the constructor."""
        return Camera(**{**self.fields, **fields})

    def flat(self) -> Camera:
        """Return the pinhole camera with the same K: the image without distortion."""
        return self.changed(model="pinhole", D=(), **dict.fromkeys(CAMERA_MODELS[self.model].parameters))

    def rectified(self, *, from_first: bool = False) -> Camera:
        """Return the camera of the rectified image: R rotates the points, P's 3 x 3 projects them, without distortion.

        from_first: points are in the first camera's rectified frame: P [X; 1], without R
        Raises ValueInvalid if P is not known.
        """
        if not (p := self.fields["P"]):
            raise ValueInvalid("the rectified picture is not known: the camera has no P")
        flat = self.flat().changed(K=[p[0:3], p[4:7], p[8:11]], skew=0.0)
        if not from_first:
            if p[3] or p[7] or p[11]:
                warn(f"column 4 of P, {p[3]:g} {p[7]:g} {p[11]:g}, is a pose and not applied: --from-first applies it")
            return flat.changed(turn=self.fields["R"])
        fx, fy, cx, cy, skew = flat.numbers
        down = (p[7] - cy * p[11]) / fy
        return flat.changed(shift=((p[3] - cx * p[11] - skew * down) / fx, down, p[11]))

    def scaled(self, size: Sequence[int]) -> Camera:
        """Return the camera of the image resized with the same aspect ratio; raises ValueInvalid for another ratio.

        A camera without a size gets this one.
        """
        width, height = _size(size)
        known = self.size or (width, height)
        across, down = width / known[0], height / known[1]
        if abs(height - known[1] * across) >= 1.0 and abs(width - known[0] * down) >= 1.0:
            raise ValueInvalid(f"size {width} x {height} is another shape than {known[0]} x {known[1]}")
        return self.resampled((across, down), (0.5 * across - 0.5, 0.5 * down - 0.5), (width, height))

    def resampled(self, scale: Two[float], shift: Two[float], size: Sequence[int] | None) -> Camera:
        """Return the camera of an image whose pixels are scaled and then shifted."""

        def moved(rows: list[list[float]]) -> list[list[float]]:
            *upper, last = rows
            pairs = zip(upper, scale, shift, strict=True)
            return [*([by * a + off * c for a, c in zip(row, last, strict=True)] for row, by, off in pairs), last]

        p = self.fields["P"]
        return self.changed(K=moved(self._rows()), skew=0.0, P=p and moved([p[:4], p[4:8], p[8:]]), size=size)

    # --- components ---

    def pixels_of(self, x: Number, y: Number, z: Number) -> Vector:
        """Return u, v and the depth (z in optical axes) of points; u and v are NaN where there is no pixel."""
        return validation.run(self._project, 3, (x, y, z))

    def rays_of(self, u: Number, v: Number) -> Vector:
        """Return unit directions x, y, z of pixels, in the camera's frame; NaN where there is none."""
        return validation.run(lambda u, v, xp: self._unturned(*self._optical_ray(u, v, xp)), 3, (u, v))

    def points_of(self, u: Number, v: Number, depth: Number = None, range: Number = None) -> Vector:  # noqa: A002
        """Return points x, y, z in the camera's frame from pixels and depth, or distance from the camera."""
        return validation.run(partial(self._point, range is None), 3, (u, v, depth if range is None else range))

    def plane_points_of(self, u: Number, v: Number, plane_from_camera: Rigid, height: Number = 0.0) -> Vector:
        """Return where the rays of pixels meet z = height of a frame, in that frame; NaN behind and above the horizon.

        plane_from_camera: tx, ty, tz, x, y, z, w
        """
        return validation.run(self._on_plane, 3, (u, v, height, *plane_from_camera))

    def undistorted_of(self, u: Number, v: Number, into: Camera | None = None) -> Two[Number]:
        """Return pixels in the image of another camera at the same position; otherwise as `undistort`."""
        return (into or self.flat()).pixels_of(*self.rays_of(u, v))[:2]

    def is_in_image(self, u: Number, v: Number) -> Any:
        """Return True for pixels inside the image; raises ValueInvalid if the camera has no size."""
        if self.size is None:
            raise ValueInvalid("the size of the picture is not known; give it")
        return (u >= -0.5) & (u < self.size[0] - 0.5) & (v >= -0.5) & (v < self.size[1] - 0.5)

    def is_behind(self, depth: Number) -> Any:
        """Return True for points without a pixel that are behind the camera.

        The others are outside the valid range of the model, `end_angle` from the axis; so are all if the model sees
        backwards.
        """
        return (depth <= 0.0) & (self.end_angle <= 0.5 * pi)

    # --- arrays ---

    def project(self, points: Numbers) -> tuple[Array, Any]:
        """Return pixels (.., 2) and depths (..) of points (.., 3) in the camera's frame.

        The depth is z in optical axes.  Pixels are NaN behind the camera and where the model is not valid.
        """
        *pixels, depth = self.pixels_of(*validation.columns(points, 3, "points", or_nan=True))
        return validation.stacked((*pixels,)), depth

    def unproject(self, pixels: Numbers, depth: Numbers | None = None, range: Numbers | None = None) -> Array:  # noqa: A002
        """Return unit directions (.., 3) of pixels (.., 2) in the camera's frame; points if depth or range is set.

        depth: z in optical axes; range: the distance from the camera.  NaN where there is no direction.
        """
        u, v = validation.columns(pixels, 2, "pixels", or_nan=True)
        distances = (("depth", depth), ("range", range))
        far = {name: validation.as_numbers(each, name) for name, each in distances if each is not None}
        if len(far) > 1:
            raise ValueInvalid("unproject takes depth or range, not both")
        return validation.stacked(self.points_of(u, v, **far) if far else self.rays_of(u, v))

    def undistort(self, pixels: Numbers, into: Camera | None = None) -> Array:
        """Return pixels (.., 2) of the image without distortion, for the same K or for another camera.

        into: another camera, such as `camera.rectified()`
        """
        u, v = validation.columns(pixels, 2, "pixels", or_nan=True)
        return validation.stacked(self.undistorted_of(u, v, into))

    def in_image(self, pixels: Numbers) -> Any:
        """Return True for pixels (.., 2) inside the image."""
        return self.is_in_image(*validation.columns(pixels, 2, "pixels", or_nan=True))

    # --- kernels ---

    def _project(self, x: N, y: N, z: N, xp: Functions[N]) -> Three[N]:
        (a, b, c, d, e, f, g, h, i), (right, below, ahead) = self._turn, self.fields["shift"]
        x, y, z = a * x + b * y + c * z + right, d * x + e * y + f * z + below, g * x + h * y + i * z + ahead
        a, b, seen = CAMERA_MODELS[self.model].to_plane(x, y, z, self.lens, xp)
        fx, fy, cx, cy, skew = self.numbers
        return xp.where(seen, fx * a + skew * b + cx, nan), xp.where(seen, fy * b + cy, nan), z

    def _optical_ray(self, u: N, v: N, xp: Functions[N]) -> Three[N]:
        fx, fy, cx, cy, skew = self.numbers
        b = (v - cy) / fy
        x, y, z, found = CAMERA_MODELS[self.model].from_plane((u - cx - skew * b) / fx, b, self.lens, xp)
        length = xp.where(found, quaternion.length(x, y, z, xp), nan)
        return x / length, y / length, z / length

    def _unturned(self, x: N, y: N, z: N) -> Three[N]:
        a, b, c, d, e, f, g, h, i = self._turn
        return a * x + d * y + g * z + 0.0, b * x + e * y + h * z + 0.0, c * x + f * y + i * z + 0.0

    def _point(self, at_depth: bool, u: N, v: N, far: N, xp: Functions[N]) -> Three[N]:  # noqa: FBT001 - bound
        x, y, z = self._optical_ray(u, v, xp)
        scale = far / divisor(z, xp) if at_depth else far
        scale = xp.where(scale >= 0.0, scale, nan)
        right, below, ahead = self.fields["shift"]
        return self._unturned(x * scale - right, y * scale - below, z * scale - ahead)

    def _on_plane(
        self, u: N, v: N, height: N, tx: N, ty: N, tz: N, qx: N, qy: N, qz: N, qw: N, xp: Functions[N]
    ) -> Three[N]:
        ox, oy, oz = rigid.apply(tx, ty, tz, qx, qy, qz, qw, *self._point(False, u, v, 0.0 * u, xp))  # noqa: FBT003
        x, y, z = quaternion.rotate(qx, qy, qz, qw, *self._unturned(*self._optical_ray(u, v, xp)))
        scale = (height - oz) / divisor(z, xp)
        scale = xp.where(scale > 0.0, scale, nan)
        return ox + scale * x, oy + scale * y, 0.0 * scale + height


def _numbers(value: Any, what: str, *counts: int) -> tuple[float, ...]:
    """Flatten lists of finite numbers; raises ValueInvalid for other values, and for another count."""
    value = value.tolist() if hasattr(value, "tolist") else value
    flat = [value]
    while any(isinstance(each, (list, tuple)) for each in flat):
        flat = [one for each in flat for one in (each if isinstance(each, (list, tuple)) else [each])]
    if wrong := [each for each in flat if not (hasattr(each, "__float__") and isfinite(each))]:
        raise ValueInvalid(f"{what}: {shown(wrong[0])} is not a finite number")
    if counts and len(flat) not in counts:
        raise ValueInvalid(f"{what} is {' or '.join(map(str, counts))} number{'s' * (counts != (1,))}, not {len(flat)}")
    return tuple(float(each) + 0.0 for each in flat)


def _size(value: Any) -> tuple[int, int]:
    width, height = _numbers(value, "size", 2)
    if min(width, height) < 1.0 or width % 1.0 or height % 1.0:
        raise ValueInvalid(f"size {width:g} x {height:g} is not a size: give whole pixels, width and height")
    return int(width), int(height)


def _model_of(model: str | None, count: int, own: dict[str, float]) -> tuple[str, CameraModel]:
    """Return a model's name and row; without a name, the model with these parameters and this many coefficients.

    Raises ValueInvalid if several match, and if the model cannot have such numbers.
    """
    if model is None:
        fitting = [each for each, row in CAMERA_MODELS.items() if {*row.parameters} == own.keys()] or ["pinhole"]
        fitting = [each for each in fitting if count in CAMERA_MODELS[each].coefficients] or fitting
        if count and not own and count not in {each for row in CAMERA_MODELS.values() for each in row.coefficients}:
            raise ValueInvalid(f"no model has {count} coefficients in D; there are 4, 5, 8 or 12")
        if len(fitting) > 1 and count == 4:
            raise ValueInvalid(f"4 coefficients: {' or '.join(f'--model {each}' for each in fitting)}")
        model = fitting[0]
    name = next((name for name, row in CAMERA_MODELS.items() if model.lower() in (name, *row.aliases)), "")
    if not name:
        raise ValueInvalid(f"camera model {shown(model)} is not known{alternatives(model, CAMERA_MODELS, 'models')}")
    counted = {4: "plumb_bob", 5: "plumb_bob", 8: "rational_polynomial", 12: "thin_prism"}
    if name in counted.values() and counted.get(count, name) != name:
        warn(f"{name} with {count} coefficients is read as {counted[count]}")
        name = counted[count]
    row = CAMERA_MODELS[name]
    if count and count not in row.coefficients:
        counts = " or ".join(map(str, row.coefficients)) or "no"
        raise ValueInvalid(f"{name} has {counts} coefficients in D, not {count}")
    if own.keys() != {*row.parameters}:
        needed = " and ".join(row.parameters) or "only D as a parameter"
        raise ValueInvalid(f"{name} has {needed}, not {' and '.join(own) or 'none'}")
    for each, value in own.items():
        low, high = (0.0, inf) if name == "omni" else RANGES[each]
        if not low <= value <= high:
            raise ValueInvalid(f"{each} {value:g} is beyond {low:g} .. {high:g}")
    return name, row
