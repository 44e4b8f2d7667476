"""The values of a rotation and of a rigid transform, or of many: components inside, numpy arrays outside.

Know no text, no names and no time; radians and metres only.  One item is four or seven Python floats and needs no numpy
until it returns an array.  `a_from_b` maps points in b to the same points in a, and is the pose of b in a.
`Batched` is what both share: one item or an array of them, with numpy's indexing.
"""

from __future__ import annotations

from functools import cache

from frametool.errors import ValueInvalid
from frametool.geometry import euler, floats, quaternion, rigid, validation
from frametool.geometry.quaternion import SILENT
from frametool.geometry.representations import LAST_ROW, checked_axes, notation

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any, Self

    from frametool.geometry import Array, Components, Kernel, Numbers, Quaternion, Rigid

NEAR = 1e-9  # rad: the default of `is_close`, three digits above the rounding of long chains
NEAR_BY = 1e-9  # metres: the same for translations
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
    _compose: Kernel

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

    def __matmul__(self, other: Self) -> Self:
        """Compose: a_from_b @ b_from_c is a_from_c."""
        kind, ours = type(self), self._components
        if type(other) is not kind:
            return NotImplemented
        theirs = other._components
        if type(ours[-1]) is type(theirs[-1]) is float:
            product = _new(kind)
            product._components = kind._compose(*ours, *theirs)
            return product
        return self.of(*validation.run(kind._compose, len(ours), (*ours, *theirs), functions=False))

    def __repr__(self) -> str:
        """Show one item's numbers, or the shape of many."""
        name, shown = type(self).__name__, [repr(part) for part in self._components if not self.shape]
        if not shown:
            return f"<{name} of shape {self.shape}>"
        turn = ", ".join(shown[-4:])
        return f"{name}.from_parts(xyz=[{', '.join(shown[:3])}], xyzw=[{turn}])" if shown[4:] else f"{name}([{turn}])"

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
    _compose = staticmethod(quaternion.compose)

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

    def as_notation(self, name: str, *, out: Array | None = None) -> Array:
        """Return the numbers of a representation, as `from_notation` takes them."""
        rep = _notation(name)
        inner = (3, 3) if name == "matrix" else (len(rep.columns),)
        return validation.rows(rep.from_quaternion, inner, self._components, out=out)

    def as_quaternion(self, *, out: Array | None = None) -> Array:
        """Return x, y, z, w of shape (..., 4), unit, with w >= 0 (w == 0: first non-zero of x, y, z positive)."""
        return self.as_notation("xyzw", out=out)

    def as_matrix(self, *, out: Array | None = None) -> Array:
        """Return matrices of shape (..., 3, 3); their columns are the rotated axes."""
        return self.as_notation("matrix", out=out)

    def as_rotvec(self, *, out: Array | None = None) -> Array:
        """Return rotation vectors of shape (..., 3), radians, of length 0 to pi."""
        return self.as_notation("rotvec", out=out)

    def as_axis_angle(self, *, out: Array | None = None) -> tuple[Array, Any]:
        """Return unit axes of shape (..., 3) and angles in [0, pi] of shape (...); the identity has the axis x.

        `out`, of shape (..., 4), receives axis and angle in one row; the returned arrays are views of it.
        """
        four = self.as_notation("axis_angle", out=out)
        return four[..., :3], four[..., 3] if four.ndim > 1 else float(four[3])

    def as_euler(self, axes: str, *, out: Array | None = None) -> Array:
        """Return angles in radians of shape (..., 3), in the order of the letters of a tf name such as `rzyx`.

        The middle one is in [-pi/2, pi/2], or in [0, pi] if first and third axis are the same; at gimbal lock
        (see `gimbal_lock`) the third is 0.
        """
        return self.as_notation(f"euler:{axes}", out=out)

    def as_rpy(self, *, out: Array | None = None) -> Array:
        """Return roll, pitch, yaw in radians about the fixed axes x, y, z, of shape (..., 3)."""
        return self.as_notation("rpy", out=out)

    def gimbal_lock(self, axes: str) -> Any:
        """Return True for each element whose angles in a convention are at gimbal lock, to 1 eps."""
        locked = euler.locked(*self._components, checked_axes(axes))
        return bool(locked) if validation.single(self._components) else locked

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


class Transform(Batched):
    """One rigid transform, or an array of them of any shape; immutable.

    `a_from_c = a_from_b @ b_from_c`; `point_in_a = a_from_b.apply(point_in_b)`.  Metres and radians.

    `out=` of `as_matrix`, `log` and every `apply`: a writable numpy array of float64 of the result's shape, which is
    filled and returned; it may be the input itself.  See `Rotation` for details.
    """

    __slots__ = ()
    _components: Rigid
    _compose = staticmethod(rigid.compose)

    def __init__(self, rotation: Rotation, translation: Numbers) -> None:
        """Create from a rotation and a translation of shape (..., 3) in metres; batch shapes broadcast."""
        if not isinstance(rotation, Rotation):
            kind = type(rotation).__name__
            advice = "Transform(rotation, xyz) takes a Rotation first; from_parts(xyz=.., rpy=..) says which is which"
            raise ValueInvalid(f"rotation: expected a Rotation, got {kind}; {advice}")
        shift = validation.columns(translation, 3, "translation")
        self._components = validation.joined(shift, rotation.components, "translation")

    @property
    def components(self) -> Rigid:
        """Return tx, ty, tz, x, y, z, w: floats of one transform, else arrays of the batch's shape."""
        return self._components

    @classmethod
    def identity(cls) -> Transform:
        """Return the identity transform."""
        return cls.of(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

    @classmethod
    def random(cls, n: int | None = None, *, seed: Any = None, radius: float = 1.0) -> Transform:
        """Return one random transform, or n: uniform rotations, normal translations with this deviation in metres."""
        import numpy as np

        generator = np.random.default_rng(seed)
        return cls(Rotation.random(n, seed=generator), radius * generator.normal(size=(3,) if n is None else (n, 3)))

    @classmethod
    def from_parts(cls, xyz: Numbers = (0.0, 0.0, 0.0), *, normalize: bool = False, **rotation: Any) -> Transform:
        """Create one, or many, from position and rotation: `Transform.from_parts(xyz=[1, 2, 3], rpy_deg=[0, 0, 90])`.

        xyz: metres, shape (..., 3)
        rotation: at most one, with a name of `frametool help rotations`: rpy, rpy_deg, xyzw, wxyz, rotvec, matrix ..;
            or `rotation=` a Rotation, such as `Rotation.from_euler(..)`.
        Raises ValueInvalid for any other name, wrong shapes, values that are not finite, or not a rotation.
        """
        if isinstance(xyz, Rotation):
            raise ValueInvalid("xyz: the position comes first, the rotation by its name: from_parts(xyz, rotation=..)")
        if len(rotation) > 1:
            raise ValueInvalid(f"from_parts takes one rotation, not {' and '.join(rotation)}")
        (name, inputs), *_ = [*rotation.items(), ("rotation", Rotation.identity())]
        turn = inputs if name == "rotation" else Rotation.from_notation(name, inputs, normalize=normalize)
        shift, parts = validation.columns(xyz, 3, "xyz"), Rotation._components_of(turn, "rotation")  # noqa: SLF001
        return cls.of(*validation.joined(shift, parts, "xyz"))

    @classmethod
    def from_arrays(cls, xyz: Numbers, xyzw: Numbers, *, normalize: bool = False) -> Transform:
        """Create from translations of shape (..., 3) in metres and quaternions x, y, z, w of shape (..., 4).

        Raises:
            ValueInvalid: wrong shapes, not finite, or not a rotation; names the first such row.
        """
        return cls.from_parts(xyz, xyzw=xyzw, normalize=normalize)

    @classmethod
    def from_matrix(cls, matrices: Numbers, *, normalize: bool = False) -> Transform:
        """Create from homogeneous matrices of shape (..., 4, 4), the last row 0 0 0 1.

        Raises:
            ValueInvalid: wrong shape, another last row, not finite, or not a rotation; names the first such row.
        """
        m = validation.matrices(matrices, 4, "matrix")
        import numpy as np

        off = sum(abs(entry - wanted) for entry, wanted in zip(m[12:], LAST_ROW, strict=True))
        if (bad := ~(np.asarray(off) <= SILENT)).any():
            place, row = validation.first_bad(m[12:], bad, "matrix")
            numbers = " ".join(f"{value:g}" for value in row)
            raise ValueInvalid(f"{place}: last row {numbers}; expected 0 0 0 1")
        rotation = Rotation.from_columns("matrix", (*m[0:3], *m[4:7], *m[8:11]), "matrix", normalize=normalize)
        return cls.of(*validation.joined((m[3], m[7], m[11]), rotation.components, "matrix"))

    @classmethod
    def exp(cls, twist: Numbers) -> Transform:
        """Return the transform reached by constant twists (vx, vy, vz, wx, wy, wz), shape (..., 6), in unit time.

        Linear part first, as in ROS messages: metres, then radians.
        """
        inputs = validation.columns(twist, 6, "twist")
        return cls.of(*validation.checked(rigid.exp, 7, inputs, "twist", rigid.check_twist))

    @property
    def xyz(self) -> Array:
        """The translations, shape (..., 3), metres."""
        return validation.rows(lambda x, y, z, _xp: (x, y, z), (3,), self._components[:3])

    @property
    def xyzw(self) -> Array:
        """The quaternions x, y, z, w, shape (..., 4), unit, with the canonical sign."""
        return self.rotation.as_quaternion()

    @property
    def rotation(self) -> Rotation:
        """The rotation."""
        return Rotation.of(*self._components[3:])

    def as_matrix(self, *, out: Array | None = None) -> Array:
        """Return homogeneous matrices of shape (..., 4, 4)."""
        return validation.rows(rigid.to_homogeneous, (4, 4), self._components, out=out)

    def log(self, *, out: Array | None = None) -> Array:
        """Return the twists (vx, vy, vz, wx, wy, wz), shape (..., 6), whose `exp` this is; angles up to pi."""
        return validation.rows(rigid.log, (6,), self._components, out=out)

    def inverse(self) -> Transform:
        """Return b_from_a of a_from_b."""
        return self.of(*validation.run(rigid.inverse, 7, self._components, functions=False))

    def relative(self, other: Transform) -> Transform:
        """Return the pose of the other in this one: self.inverse() @ other, accurate also for close poses."""
        return self.of(
            *validation.run(rigid.relative, 7, (*self._components, *self._components_of(other)), functions=False)
        )

    def apply(self, points: Numbers, *, out: Array | None = None) -> Array:
        """Transform points of shape (..., 3); transforms and points broadcast over the leading axes."""
        inputs = validation.columns(points, 3, "points")
        return validation.moved(rigid.apply, self._components, inputs, "points", out=out)

    def apply_vector(self, vectors: Numbers, *, out: Array | None = None) -> Array:
        """Rotate vectors of shape (..., 3): directions and velocities, which are not translated."""
        return self.rotation.apply(vectors, out=out)

    def apply_twist(self, twists: Numbers, *, out: Array | None = None) -> Array:
        """Transform twists (vx, vy, vz, wx, wy, wz), shape (..., 6): of the same body, at the target's origin."""
        inputs = validation.columns(twists, 6, "twists")
        return validation.moved(rigid.move_twist, self._components, inputs, "twists", out=out)

    def apply_wrench(self, wrenches: Numbers, *, out: Array | None = None) -> Array:
        """Transform wrenches (fx, fy, fz, mx, my, mz), shape (..., 6), in N and Nm, to the target's origin."""
        inputs = validation.columns(wrenches, 6, "wrenches")
        return validation.moved(rigid.move_wrench, self._components, inputs, "wrenches", out=out)

    def interpolate(self, other: Transform, fraction: Numbers) -> Transform:
        """Interpolate: translation linearly, rotation by slerp; fractions 0 and 1 return the ends exactly.

        fraction: a number, or an array that broadcasts with the transforms.
        """
        parts = (*self._components, *self._components_of(other), validation.scalars(fraction, "fraction"))
        return self.of(*validation.run(rigid.interpolate, 7, parts))

    def distance(self, other: Transform) -> tuple[Any, Any]:
        """Return the distance in metres and the angle in radians between two."""
        metres, radians = validation.run(rigid.distance, 2, (*self._components, *self._components_of(other)))
        return metres, radians

    def is_close(self, other: Transform, *, angle: float = NEAR, distance: float = NEAR_BY) -> Any:
        """Return True per element if two differ by at most an angle in radians and a distance in metres."""
        metres, radians = self.distance(other)
        close = (metres <= distance) & (radians <= angle)
        return bool(close) if type(metres) is float else close

    def canonical(self) -> Transform:
        """Return the same transform with a quaternion of canonical sign."""
        return Transform.of(*self._components[:3], *self.rotation.canonical().components)

    def mean(self, weights: Numbers | None = None) -> Transform:
        """Return the weighted mean of all elements: of the translations, and the chordal mean of the rotations."""
        if not self.shape:
            return self
        mass = validation.masses(weights, self.shape)
        shift = (float((part * mass).sum() / mass.sum()) for part in self._components[:3])
        return Transform.of(*shift, *self.rotation.mean(weights).components)
