"""Poses as arrays of matrices, what a fit needs of them: products, errors, small steps and how these act.

rotations: (n, 3, 3); translations: (n, 3), metres.  An error or a step is (n, 6): metres and a rotation vector, both
along the fixed axes of the parent frame, as the covariances of ROS: t + d[:3], Exp(d[3:]) R.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.fit.least_squares import applied, length
from frametool.geometry import arrays, floats, matrix, quaternion, vectors
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from typing import Any

    from frametool.geometry.types import Array, Quaternion

NEAR = 1e-4  # radians: below, the series of J^-1 is exact to the last bits


class PoseArrays(NamedTuple):
    """Many poses, or one without the first axis."""

    rotations: Any
    translations: Any

    @classmethod
    def of(cls, transform: Transform) -> PoseArrays:
        """Convert transforms."""
        whole = transform.as_matrix()
        return cls(whole[..., :3, :3].copy(), whole[..., :3, 3].copy())

    @property
    def transform(self) -> Transform:
        """The same as transforms."""
        x, y, z = np.moveaxis(self.translations, -1, 0)
        return Transform.of(x, y, z, *as_quaternion(self.rotations))

    @property
    def inverse(self) -> PoseArrays:
        """The poses the other way round."""
        back = np.swapaxes(self.rotations, -1, -2)
        return PoseArrays(back, -applied(back, self.translations))

    def __matmul__(self, other: PoseArrays) -> PoseArrays:
        """Compose: a_from_c = a_from_b @ b_from_c."""
        return PoseArrays(self.rotations @ other.rotations, self.apply(other.translations))

    def apply(self, points: Array) -> Array:
        """Move points."""
        moved: Array = applied(self.rotations, points) + self.translations
        return moved

    def at(self, index: Any) -> PoseArrays:
        """Choose poses as numpy does."""
        return PoseArrays(self.rotations[index], self.translations[index])

    def stepped(self, steps: Array) -> PoseArrays:
        """Add small steps: t + d[:3], Exp(d[3:]) R."""
        return PoseArrays(exp(steps[..., 3:]) @ self.rotations, self.translations + steps[..., :3])

    def errors(self, measured: PoseArrays) -> Array:
        """Return [t - measured t, Log(R measured R')]."""
        turned = log(self.rotations @ np.swapaxes(measured.rotations, -1, -2))
        return np.concatenate([self.translations - measured.translations, turned], -1)


def as_quaternion(rotations: Array) -> Quaternion:
    """Return x, y, z, w >= 0 of rotation matrices."""
    entries = matrix.nine(rotations[..., i, j] for i in range(3) for j in range(3))
    return quaternion.unit(*matrix.to_quaternion(*entries, arrays), arrays)


def exp(rotvecs: Array) -> Array:
    """Return the rotation matrices of rotation vectors (.., 3), radians."""
    x, y, z = np.moveaxis(rotvecs, -1, 0)
    nine = quaternion.to_matrix(*vectors.from_rotvec(x, y, z, arrays))
    return np.stack(nine, -1).reshape(*rotvecs.shape, 3)


def log(rotations: Array) -> Array:
    """Return the rotation vectors of rotation matrices (.., 3, 3)."""
    x, y, z, w = as_quaternion(rotations)
    return np.stack(vectors.as_rotvec(x, y, z, w, arrays), -1)


def skew(v: Array) -> Array:
    """Return [v]x of vectors (.., 3): [v]x a = v x a."""
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*v.shape, 3)


def inverse_left_jacobian(rotvecs: Array) -> Array:
    """Return J^-1(w): Log(Exp(d) Exp(w)) = w + J^-1(w) d for small d.

    Source: Barfoot 2017, eq. 7.77b; I - [w]x / 2 + (1 / a^2 - (1 + cos a) / (2 a sin a)) [w]x^2, a = |w|.
    """
    angle = length(rotvecs)
    far = angle > NEAR
    a = np.where(far, angle, 1.0)
    sine, cosine = floats.half_sincos(a, arrays)
    factor = np.where(far, 1.0 / a**2 - cosine / (2.0 * a * sine), 1.0 / 12.0)
    crossed = skew(rotvecs)
    return np.eye(3) - crossed / 2.0 + factor[..., None, None] * (crossed @ crossed)
