"""The value of a rotation, or of many: components inside, numpy arrays outside.

Knows no text and no files; radians only. One item is four Python floats and needs no numpy until it returns an array.
`Batched` is what it shares with `Transform`: one item or an array of them, with numpy's indexing.
"""

from __future__ import annotations

from functools import cache

from frametool.errors import ValueInvalid
from frametool.geometry import euler, floats, quaternion, validation
from frametool.geometry.representations import checked_axes, notation

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any, Self

    from frametool.geometry.types import Array, Components, Numbers, Quaternion

NEAR = 1e-9  # rad: the default of `is_close`, three digits above the rounding of long chains
_new = object.__new__
_notation = cache(notation)


def in_notebook(value: object) -> str | None:
    """Show a value in a notebook as a terminal does."""
    import frametool

    return frametool.html_of(value)


class Batched:
    """One item, or an array of them of any shape; immutable."""

    __slots__ = ("_components",)
    __array_ufunc__ = None  # an array times a value is refused, not tried element by element
    _components: Components

    @classmethod
    def of(cls, *components: Any) -> Self:
        """Create without checks from (tx, ty, tz and) x, y, z, w: all floats, or all arrays of one shape."""
        made = _new(cls)
        made._components = components  # noqa: SLF001 - its own class
        return made

    @classmethod
    def _components_of(cls, value: object, name: str = "other") -> Components:
        """Return the components of a value of this type; raise ValueInvalid for anything else."""
        if isinstance(value, cls):
            return value._components  # noqa: SLF001 - its own class
        raise ValueInvalid(f"{name}: expected a {cls.__name__}, got {type(value).__name__}")

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the batch; () for one item."""
        return getattr(self._components[-1], "shape", ())

    def __len__(self) -> int:
        """Return the length of the first axis; one item has no length."""
        if not self.shape:
            raise TypeError(f"one {type(self).__name__.lower()} has no length")
        return self.shape[0]

    def __getitem__(self, index: Any) -> Self:
        """Select elements as numpy does."""
        if not self.shape:
            raise TypeError(f"one {type(self).__name__.lower()} has no elements")
        parts = (part[index] for part in self._components)
        return self.of(*(part if getattr(part, "shape", ()) else float(part) for part in parts))

    def __iter__(self) -> Iterator[Self]:
        """Iterate over the first axis."""
        return (self[index] for index in range(len(self)))

    _repr_html_ = in_notebook


class Rotation(Batched):
    """One rotation, or an array of them of any shape; immutable.

    Active, right-handed; quaternions are Hamilton's, x, y, z, w.  `@` composes (the right one acts first), `apply`
    rotates vectors.  Every `from_X` accepts leading axes (..., k), every `as_X` returns them; arguments are never
    changed.

    `out=` of `as_X` and `apply`: a writable numpy array of float64 in native byte order, of the result's shape, with
    any strides (also a memmap); it is filled and returned.  It may be, or overlap, the input:
    `r.apply(points, out=points)` rotates points in place, or raises an error and leaves them unchanged.
    """

    __slots__ = ()
    _components: Quaternion

    def __init__(self, xyzw: Numbers) -> None:
        """Create from quaternions x, y, z, w of shape (..., 4), as `from_quaternion`."""
        self._components = Rotation.from_quaternion(xyzw).components

    @property
    def components(self) -> Quaternion:
        """The quaternion's x, y, z, w: floats of one rotation, else arrays of the batch's shape."""
        return self._components

    @classmethod
    def identity(cls) -> Rotation:
        """Return the identity rotation."""
        return cls.of(0.0, 0.0, 0.0, 1.0)

    @classmethod
    def random(cls, n: int | None = None, *, seed: Any = None) -> Rotation:
        """Return one random rotation, or n, uniformly distributed; a seed makes them reproducible.

        Source: Muller 1959, a normal vector of four has no preferred direction.
        """
        import numpy as np

        drawn = np.random.default_rng(seed).normal(size=(4,) if n is None else (n, 4))
        return cls.from_quaternion(drawn, normalize=True)

    @classmethod
    def from_quaternion(cls, xyzw: Numbers, *, normalize: bool = False) -> Rotation:
        """Create from quaternions x, y, z, w of shape (..., 4).

        Norms within 1e-6 of 1 are normalised silently, within 1e-3 with a warning; with `normalize` any non-zero one.

        Raises:
            ValueInvalid: wrong shape, not finite, zero, or not of norm 1; names the first such row.
        """
        return cls.from_columns("xyzw", validation.columns(xyzw, 4, "xyzw"), "xyzw", normalize=normalize)

    @classmethod
    def from_matrix(cls, matrices: Numbers, *, normalize: bool = False) -> Rotation:
        """Create from matrices of shape (..., 3, 3), orthonormal to 1e-6 (to 1e-3: nearest rotation and a warning).

        With `normalize`, the nearest rotation (the polar factor) if all singular values are in 0.9 .. 1.1.

        Raises:
            ValueInvalid: wrong shape, not finite, mirrored, scaled, not orthonormal; names the first such row.
        """
        return cls.from_columns("matrix", validation.matrices(matrices, 3, "matrix"), "matrix", normalize=normalize)

    @classmethod
    def from_notation(cls, name: str, numbers: Numbers, *, normalize: bool = False) -> Rotation:
        """Create from a representation, `rpy_deg` or `euler:rzyx`: shape (..., its columns), matrices (..., 3, 3).

        Quaternions need an explicit order, xyzw or wxyz.
        """
        rep = _notation(name)
        rep.bound_axes()
        if name == "quaternion":
            raise ValueInvalid("quaternion does not say its order; give xyzw=[..] or wxyz=[..]")
        if name == "matrix":
            return cls.from_matrix(numbers, normalize=normalize)
        return cls.from_columns(name, validation.columns(numbers, len(rep.columns), name), name, normalize=normalize)

    @classmethod
    def from_rotvec(cls, rotvec_xyz: Numbers) -> Rotation:
        """Create from rotation vectors, axis times angle in radians, of shape (..., 3)."""
        return cls.from_columns("rotvec", validation.columns(rotvec_xyz, 3, "rotvec"), "rotvec")

    @classmethod
    def from_axis_angle(cls, axis: Numbers, angle: Numbers) -> Rotation:
        """Create from axes of shape (..., 3), non-zero, and angles in radians of shape (...); they broadcast."""
        inputs = (*validation.columns(axis, 3, "axis"), validation.scalars(angle, "angle"))
        return cls.from_columns("axis_angle", inputs, "axis")

    @classmethod
    def from_euler(cls, axes: str, angles: Numbers) -> Rotation:
        """Create from angles in radians of shape (..., 3), in the order of the letters of a tf name such as `rzyx`."""
        return cls.from_columns(f"euler:{axes}", validation.columns(angles, 3, "angles"), "angles")

    @classmethod
    def from_rpy(cls, rpy: Numbers) -> Rotation:
        """Create from roll, pitch, yaw in radians about the fixed axes x, y, z, of shape (..., 3)."""
        return cls.from_columns("rpy", validation.columns(rpy, 3, "rpy"), "rpy")

    @classmethod
    def from_mrp(cls, parameters: Numbers) -> Rotation:
        """Create from modified Rodrigues parameters, axis times tan(angle/4), of shape (..., 3)."""
        return cls.from_columns("mrp", validation.columns(parameters, 3, "mrp"), "mrp")

    @classmethod
    def from_six_d(cls, columns: Numbers) -> Rotation:
        """Create from the first two matrix columns, one after another, of shape (..., 6); they are orthonormalised."""
        return cls.from_columns("six_d", validation.columns(columns, 6, "six_d"), "six_d")

    @classmethod
    def between(cls, start: Numbers, end: Numbers) -> Rotation:
        """Return the shortest rotation from one direction, shape (..., 3), to another; lengths do not matter.

        For opposite directions the axis is orthogonal to the start and to the coordinate axis farthest from it.
        """
        parts = (*validation.columns(start, 3, "start"), *validation.columns(end, 3, "end"))
        return cls.of(*validation.checked(quaternion.between, 4, parts, "start, end", quaternion.check_directions))

    @classmethod
    def from_columns(cls, spec: str, inputs: Components, name: str, *, normalize: bool = False) -> Rotation:
        """Check and convert the columns of a notation; errors call them `name`."""
        rep = _notation(spec)
        if validation.single(inputs):
            return cls.of(*rep.checked_quaternion(inputs, floats, normalize=normalize))
        return cls.of(*validation.require_rotations(rep, inputs, name, normalize=normalize))

    def _as(self, spec: str, out: Array | None, inner: tuple[int, ...] = ()) -> Array:
        """Return rows of the columns of a notation, in shape `inner` if set, in `out` if passed."""
        rep = _notation(spec)
        return validation.rows(rep.from_quaternion, inner or (len(rep.columns),), self._components, out=out)

    def as_quaternion(self, *, out: Array | None = None) -> Array:
        """Return x, y, z, w of shape (..., 4), unit, with w >= 0 (w == 0: first non-zero of x, y, z positive)."""
        return self._as("xyzw", out)

    def as_matrix(self, *, out: Array | None = None) -> Array:
        """Return matrices of shape (..., 3, 3); their columns are the rotated axes."""
        return self._as("matrix", out, (3, 3))

    def as_rotvec(self, *, out: Array | None = None) -> Array:
        """Return rotation vectors of shape (..., 3), radians, of length 0 to pi."""
        return self._as("rotvec", out)

    def as_axis_angle(self, *, out: Array | None = None) -> tuple[Array, Any]:
        """Return unit axes of shape (..., 3) and angles in [0, pi] of shape (...); the identity has the axis x.

        `out`, of shape (..., 4), receives axis and angle in one row; the returned arrays are views of it.
        """
        four = self._as("axis_angle", out)
        return four[..., :3], four[..., 3] if four.ndim > 1 else float(four[3])

    def as_euler(self, axes: str, *, out: Array | None = None) -> Array:
        """Return angles in radians of shape (..., 3), in the order of the letters of a tf name such as `rzyx`.

        The middle one is in [-pi/2, pi/2], or in [0, pi] if first and third axis are the same; at gimbal lock
        (see `gimbal_lock`) the third is 0.
        """
        return self._as(f"euler:{axes}", out)

    def as_rpy(self, *, out: Array | None = None) -> Array:
        """Return roll, pitch, yaw in radians about the fixed axes x, y, z, of shape (..., 3)."""
        return self._as("rpy", out)

    def as_mrp(self, *, out: Array | None = None) -> Array:
        """Return modified Rodrigues parameters of shape (..., 3), of length 0 to 1."""
        return self._as("mrp", out)

    def as_six_d(self, *, out: Array | None = None) -> Array:
        """Return the first two matrix columns, one after another, of shape (..., 6)."""
        return self._as("six_d", out)

    def gimbal_lock(self, axes: str) -> Any:
        """Return True for each element whose angles in a convention are at gimbal lock, to 1 eps."""
        locked = euler.locked(*self._components, checked_axes(axes))
        return bool(locked) if validation.single(self._components) else locked

    def __matmul__(self, other: Rotation) -> Rotation:
        """Compose: a_from_b @ b_from_c is a_from_c."""
        if type(other) is not Rotation:
            return NotImplemented
        ours, theirs = self._components, other._components
        if type(ours[3]) is type(theirs[3]) is float:
            product = _new(Rotation)
            product._components = quaternion.compose(*ours, *theirs)
            return product
        return self.of(*validation.run(quaternion.compose, 4, (*ours, *theirs), functions=False))

    def inverse(self) -> Rotation:
        """Return the inverse rotation."""
        return Rotation.of(*quaternion.conjugate(*self._components))

    def canonical(self) -> Rotation:
        """Return the same rotation with a quaternion of canonical sign."""
        return self.of(*validation.run(quaternion.from_quaternion, 4, self._components))

    def apply(self, vectors: Numbers, *, out: Array | None = None) -> Array:
        """Rotate vectors of shape (..., 3); rotations and vectors broadcast over the leading axes."""
        inputs = validation.columns(vectors, 3, "vectors")
        return validation.moved(quaternion.rotate, self._components, inputs, "vectors", out=out)

    def angle(self) -> Any:
        """Return the angle of rotation in [0, pi] radians."""
        return validation.number(quaternion.angle, self._components)

    def distance(self, other: Rotation) -> Any:
        """Return the angle in [0, pi] radians of the rotation between two."""
        return validation.number(quaternion.distance, (*self._components, *self._components_of(other)))

    def is_close(self, other: Rotation, *, angle: float = NEAR) -> Any:
        """Return True for each element whose rotations differ by at most an angle in radians; q and -q are the same."""
        return self.distance(other) <= angle

    def slerp(self, other: Rotation, fraction: Numbers) -> Rotation:
        """Interpolate along the shorter arc; fraction 0 returns exactly this rotation and 1 exactly the other.

        fraction: a number, or an array that broadcasts with the rotations.
        """
        parts = (*self._components, *self._components_of(other), validation.scalars(fraction, "fraction"))
        return self.of(*validation.run(quaternion.slerp, 4, parts))

    def mean(self, weights: Numbers | None = None) -> Rotation:
        """Return the chordal mean of all elements: the rotation with the least sum of squared matrix differences."""
        if not self.shape:
            return self
        mass = validation.masses(weights, self.shape).reshape(-1)
        found = validation.mean_quaternion(tuple(part.reshape(-1) for part in self._components), mass)
        return Rotation.of(*found).canonical()

    def __repr__(self) -> str:
        """Show one rotation's quaternion, or the shape of many."""
        if self.shape:
            return f"<Rotation of shape {self.shape}>"
        return f"Rotation([{', '.join(map(repr, self._components))}])"
