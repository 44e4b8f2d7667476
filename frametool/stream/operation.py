"""What is done to each row: one object an operation, the same for floats and for arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.geometry import quaternion, rigid, rotvec, spatial
from frametool.geometry.trig import RADIAN
from frametool.grammar.pose import VELOCITY
from frametool.stream.row_layout import POINT, POSE, TWIST, VECTOR, WRENCH

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.types import Components, Namespace, Number, Rigid
    from frametool.stream.row_layout import Shape

RELATIVE_EXTRAS = ("distance", "angle", "angle_deg")
START, PREVIOUS = "start", "previous"  # rows before that a row is compared with


def _turn(_x: Number, _y: Number, _z: Number, *numbers: Number) -> Components:
    return quaternion.rotate(*numbers)


MOVERS: dict[str, Callable[..., Components]] = {
    POINT: rigid.apply,
    VECTOR: _turn,
    TWIST: spatial.move_twist,
    WRENCH: spatial.move_wrench,
}  # a pose is composed: `Operation.pose`


class Operation(NamedTuple):
    """What is done to each row: turned around if asked for, then multiplied with fixed poses, then compared.

    left, right: applied as left @ row @ right[0] @ right[1] ..
    inverse: the row itself is inverted first
    of: what a row is compared with; "" for nothing, "first" inverse(fixed) row, "second" inverse(row) fixed,
        "pair" the two poses of a row, "previous" the row before and this one, "start" the first row and this one
    velocity: of "previous" also the twist that leads from one row to the next in the time between them
    fixed: the pose that "first" and "second" need
    moves: the row is moved rather than composed: points and vectors are allowed
    turns: axes change: on the right only the rotation, the position, if there is one, stays as it is
    mirrors: the row is seen in a mirror across y, before all else
    """

    left: Rigid | None = None
    right: tuple[Rigid, ...] = ()
    inverse: bool = False
    of: str = ""
    fixed: Rigid | None = None
    moves: bool = False
    turns: bool = False
    mirrors: bool = False
    velocity: bool = False

    @property
    def extras(self) -> tuple[str, ...]:
        """Name the numbers that come beside the pose."""
        return (RELATIVE_EXTRAS + VELOCITY * self.velocity) if self.of else ()

    @property
    def looks_back(self) -> bool:
        """Tell whether a row's result depends on the rows before it."""
        return self.of in (START, PREVIOUS)

    @property
    def changes_nothing(self) -> bool:
        """Tell whether rows only change their notation."""
        return self._is_bare and not self.inverse

    @property
    def keeps_position(self) -> bool:
        """Tell whether positions stay as they are written."""
        return self.changes_nothing or (self.turns and self.left is None and not self.mirrors)

    @property
    def only_inverts(self) -> bool:
        """Tell whether rows are turned around and nothing else."""
        return self._is_bare and self.inverse

    @property
    def _is_bare(self) -> bool:
        return not (self.left or self.right or self.of or self.moves or self.mirrors)

    def move(self, shape: Shape, numbers: Components, edge: Rigid | None) -> Components:
        """Move a point, a vector, a twist or a wrench with its covariance by `edge`, else by `left`."""
        mover = edge or self.left
        if mover is None:
            return numbers
        own = shape.own_size
        moved: Components = MOVERS[shape.kind](*mover, *numbers[:own])
        return (*moved, *self.covariance(shape, numbers[own:], mover))

    def covariance(self, shape: Shape, numbers: Components, edge: Rigid | None) -> Components:
        """Move the covariance of a pose or a twist by `edge`, else by `left`; nothing where there is none."""
        mover = edge or self.left
        if not shape.covariance or mover is None:
            return numbers
        if shape.kind == POSE:
            return tuple(spatial.rotate_covariance(*mover[3:], numbers))
        return tuple(spatial.move_twist_covariance(*mover, numbers))

    def pose(self, poses: Sequence[Rigid], edge: Rigid | None, xp: Namespace) -> Components:
        """Return the resulting pose, and what else is known about it."""
        result: Rigid = rigid.inverse(*poses[0]) if self.inverse else poses[0]
        if self.mirrors:
            result = rigid.mirrored(*result)
        left = edge or self.left
        if left is not None:
            result = rigid.compose(*left, *result)
        for right in self.right:
            result = rigid.compose(*result, *right)
        return self._relative([result, *poses[1:]], xp) if self.of else result

    def _relative(self, poses: Sequence[Rigid], xp: Namespace) -> Components:
        first, second = self._pair(poses)
        result = rigid.relative(*first, *second)
        metres, angle = rigid.extent(*result, xp)
        return *result, metres, angle, angle * RADIAN

    @staticmethod
    def with_velocity(parts: Components, seconds: Number, xp: Namespace) -> Components:
        """Add the body twist that makes this step in so many seconds, seen in the first of the two frames.

        Linear R_A' (p_B - p_A) / dt, angular the rotation vector of A^-1 B over dt: position and rotation on their own.
        """
        turned = rotvec.from_quaternion(parts[3], parts[4], parts[5], parts[6], xp)
        return (*parts, *(part / seconds for part in (*parts[:3], *turned)))

    def _pair(self, poses: Sequence[Rigid]) -> tuple[Rigid, Rigid]:
        if self.of == "first" and self.fixed is not None:
            return self.fixed, poses[0]
        if self.of == "second" and self.fixed is not None:
            return poses[0], self.fixed
        return poses[0], poses[1]
