"""What is done to each row: one object an operation, the same for floats and for arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.geometry import quaternion, rigid
from frametool.geometry.trig import RADIAN
from frametool.stream.row_layout import VECTOR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.types import Components, Namespace, Rigid

RELATIVE_EXTRAS = ("distance", "angle", "angle_deg")


class Operation(NamedTuple):
    """Products with fixed poses before and after each row, after it was turned around if asked for.

    left, right: applied as left @ row @ right
    inverse: the row itself is inverted first
    of: "" for nothing more; else relative: "first" inverse(fixed) row, "second" inverse(row) fixed, "pair" the two
        poses of a row, "previous" the row before and this one
    fixed: the pose that "first" and "second" need
    moves: the row is moved rather than composed: points and vectors are allowed
    """

    left: Rigid | None = None
    right: Rigid | None = None
    inverse: bool = False
    of: str = ""
    fixed: Rigid | None = None
    moves: bool = False

    @property
    def extras(self) -> tuple[str, ...]:
        """Name the numbers that come beside the pose."""
        return RELATIVE_EXTRAS if self.of else ()

    @property
    def changes_nothing(self) -> bool:
        """Tell whether rows only change their notation."""
        return self.left is self.right is None and not self.inverse and not self.of

    def point(self, kind: str, position: Components, edge: Rigid | None) -> Components:
        """Move a point or a vector by `edge`, else by `left`."""
        mover = edge or self.left
        if mover is None:
            return position
        x, y, z = position
        return quaternion.rotate(*mover[3:], x, y, z) if kind == VECTOR else rigid.apply(*mover, x, y, z)

    def pose(self, poses: Sequence[Rigid], edge: Rigid | None, xp: Namespace) -> Components:
        """Return the resulting pose, and what else is known about it."""
        result: Rigid = rigid.inverse(*poses[0]) if self.inverse else poses[0]
        left = edge or self.left
        if left is not None:
            result = rigid.compose(*left, *result)
        if self.right is not None:
            result = rigid.compose(*result, *self.right)
        return self._relative([result, *poses[1:]], xp) if self.of else result

    def _relative(self, poses: Sequence[Rigid], xp: Namespace) -> Components:
        first, second = self._pair(poses)
        result = rigid.relative(*first, *second)
        metres, angle = rigid.extent(*result, xp)
        return *result, metres, angle, angle * RADIAN

    def _pair(self, poses: Sequence[Rigid]) -> tuple[Rigid, Rigid]:
        if self.of == "first" and self.fixed is not None:
            return self.fixed, poses[0]
        if self.of == "second" and self.fixed is not None:
            return poses[0], self.fixed
        return poses[0], poses[1]
