"""What the numbers of one row or record mean: a point, a vector or a pose, and in which notation.

Knows no text; works on floats and on arrays alike.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.geometry import euler, quaternion
from frametool.grammar.result import KEPT

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Components, Namespace, Rigid

POINT, VECTOR, POSE, TWIST, WRENCH = "point", "vector", "pose", "twist", "wrench"
SIX = (TWIST, WRENCH)  # two vectors, linear part first
COVARIANCE = 36
IDENTITY = (0.0, 0.0, 0.0, 1.0)
TURN = 6.283185307179586


class Shape(NamedTuple):
    """The numbers of a row in order: position (3, if any), then rotation (if any); or the 16 of a whole matrix.

    unit: how many of the position's numbers make a metre; None where there is no position
    inverse: what is written is the inverse
    covariance: the 36 numbers of a covariance come last
    """

    kind: str
    unit: float | None = 1.0
    notation: Notation | None = None
    degrees: bool = False
    whole: bool = False
    inverse: bool = False
    covariance: bool = False

    @property
    def size(self) -> int:
        """Count the numbers of a row."""
        return self.own_size + COVARIANCE * self.covariance

    @property
    def own_size(self) -> int:
        """Count the numbers of the thing itself, without its covariance."""
        if self.kind in SIX:
            return 6
        rotation = len(self.notation.representation.columns) if self.notation else 0
        return 16 if self.whole else rotation + (self.unit is not None) * 3

    @property
    def rotation_at(self) -> tuple[int, ...]:
        """Return the indices of the rotation's numbers."""
        if self.whole:
            return (0, 1, 2, 4, 5, 6, 8, 9, 10)
        return tuple(range(0 if self.unit is None else 3, self.own_size))

    @property
    def angles_at(self) -> tuple[int, ...]:
        """Return the indices of the angles among the numbers."""
        angles = self.notation.representation.angles if self.notation else ()
        return tuple(self.rotation_at[index] for index in angles)

    def position(self, numbers: Sequence[Any]) -> Components:
        """Return x, y, z in metres; 0 where there is no position."""
        if self.whole:
            return numbers[3], numbers[7], numbers[11]
        if self.unit is None:
            return (0.0, 0.0, 0.0)
        x, y, z = numbers[:3]
        return (x, y, z) if self.unit == 1.0 else (x / self.unit, y / self.unit, z / self.unit)

    def rotation(self, numbers: Sequence[Any]) -> Components:
        """Return the rotation's numbers, in the order of its columns."""
        return tuple(numbers[index] for index in self.rotation_at)


def axes_of(form: Notation) -> str | None:
    """Return the Euler axes of a notation whose angles may not be unique; None for others."""
    return "sxyz" if form.representation.name == "rpy" else form.axes


class Target(NamedTuple):
    """How results are written.

    unit: of positions; None where none are written
    notations: of rotations, each with the unit of its angles
    whole: the 16 numbers of a homogeneous matrix
    plain: the numbers of a twist or wrench as they are
    """

    unit: float | None
    notations: tuple[tuple[Notation, bool], ...]
    keep_sign: bool = False
    whole: bool = False
    plain: bool = False

    def written(self, parts: Components, xp: Namespace) -> list[Any]:
        """Return all numbers of a result: those of the thing itself, then what comes beside it as it is."""
        own = 6 if self.plain else 3 if len(parts) == 3 else 7
        return [*self.numbers(parts[:own], xp), *parts[own:]]

    def numbers(self, parts: Components, xp: Namespace) -> list[Any]:
        """Return the numbers of a result: the position, then each notation's; or the 16 of a whole matrix."""
        if self.plain:
            return list(parts)
        position = [] if self.unit is None else [part * self.unit if self.unit != 1.0 else part for part in parts[:3]]
        if len(parts) == 3 or not self.notations:
            return position
        turned = [number for form, degrees in self.notations for number in self._rotation(parts, form, degrees, xp)]
        return _homogeneous(turned, parts[:3]) if self.whole else position + turned

    def _rotation(self, parts: Components, form: Notation, degrees: bool, xp: Namespace) -> Components:  # noqa: FBT001
        x, y, z, w = parts[3:7]
        x, y, z, w = quaternion.unit(x, y, z, w, xp)
        if self.keep_sign and form.representation.name in KEPT:
            return KEPT[form.representation.name](x, y, z, w)
        return form.from_quaternion(x, y, z, w, xp, degrees=degrees)

    @property
    def size(self) -> int:
        """Count the numbers of a result."""
        if self.whole or self.plain:
            return 16 if self.whole else 6
        return (self.unit is not None) * 3 + sum(len(form.representation.columns) for form, _ in self.notations)

    def angle_columns(self) -> list[tuple[int, float]]:
        """Return which of the numbers are angles, each with the size of a full turn."""
        found, first = [], 0 if self.unit is None else 3
        for form, degrees in self.notations:
            found += [(first + index, 360.0 if degrees else TURN) for index in form.representation.angles]
            first += len(form.representation.columns)
        return found

    def locked(self, parts: Components) -> Any:
        """Tell whether Euler angles among the notations are not unique; None where there are none."""
        axes = next((axes for form, _ in self.notations if (axes := axes_of(form))), None)
        if axes is None or len(parts) < 7:
            return None
        x, y, z, w = parts[3:7]
        return euler.locked(x, y, z, w, axes)


def _homogeneous(rows: Sequence[Any], position: Components) -> list[Any]:
    """Return the 16 numbers of the 4x4 matrix."""
    upper = [number for row, moved in enumerate(position) for number in (*rows[3 * row : 3 * row + 3], moved)]
    return [*upper, 0.0, 0.0, 0.0, 1.0]


def pose_of(position: Components, rotation: Components) -> Rigid:
    """Join position and quaternion."""
    x, y, z = position
    qx, qy, qz, qw = rotation
    return x, y, z, qx, qy, qz, qw
