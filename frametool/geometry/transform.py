"""The value of a rigid transform, or of many: seven components inside, numpy arrays outside.

Knows no names and no time. `a_from_b` maps points in b to the same points in a, and is the pose of b in a.
"""

from __future__ import annotations

from frametool.errors import ValueInvalid
from frametool.geometry import rigid, validation
from frametool.geometry.quaternion import SILENT
from frametool.geometry.representations import LAST_ROW
from frametool.geometry.rotation import NEAR, Batched, Rotation

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from frametool.geometry.types import Array, Numbers, Rigid

NEAR_BY = 1e-9  # metres: the default of `is_close` for translations
_new = object.__new__


class Transform(Batched):
    """One rigid transform, or an array of them of any shape; immutable.

    `a_from_c = a_from_b @ b_from_c`; `point_in_a = a_from_b.apply(point_in_b)`.  Metres and radians.

    `out=` of `as_matrix`, `log` and every `apply`: a writable numpy array of float64 of the result's shape, which is
    filled and returned; it may be the input itself.  See `Rotation` for details.
    """

    __slots__ = ()
    _components: Rigid

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
        shift = validation.columns(xyz, 3, "xyz")
        rotation = Rotation.from_quaternion(xyzw, normalize=normalize)
        return cls.of(*validation.joined(shift, rotation.components, "xyz"))

    @classmethod
    def from_matrix(cls, matrices: Numbers, *, normalize: bool = False) -> Transform:
        """Create from homogeneous matrices of shape (..., 4, 4), the last row 0 0 0 1.

        Raises:
            ValueInvalid: wrong shape, another last row, not finite, or not a rotation; names the first such row.
        """
        m = validation.matrices(matrices, 4, "matrix")
        off = sum(abs(entry - wanted) for entry, wanted in zip(m[12:], LAST_ROW, strict=True))
        if not (type(off) is float and off <= SILENT):
            import numpy as np

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

    def __matmul__(self, other: Transform) -> Transform:
        """Compose: a_from_b @ b_from_c is a_from_c."""
        if type(other) is not Transform:
            return NotImplemented
        ours, theirs = self._components, other._components
        if type(ours[6]) is type(theirs[6]) is float:
            product = _new(Transform)
            product._components = rigid.compose(*ours, *theirs)
            return product
        return self.of(*validation.run(rigid.compose, 7, (*ours, *theirs), functions=False))

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

    def __repr__(self) -> str:
        """Show one transform's numbers, or the shape of many."""
        if self.shape:
            return f"<Transform of shape {self.shape}>"
        shown = [repr(part) for part in self._components]
        return f"Transform.from_parts(xyz=[{', '.join(shown[:3])}], xyzw=[{', '.join(shown[3:])}])"
