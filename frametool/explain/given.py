"""Poses as they were written: the notation and its numbers beside the pose they are, so that the way to it shows."""

from __future__ import annotations

from string import ascii_lowercase
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import printable
from frametool.explain.operations import inverse, to_quaternion
from frametool.geometry.rigid import IDENTITY
from frametool.grammar import pose_algebra

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.run import Sheet
    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Rigid
    from frametool.grammar.pose import Pose
    from frametool.grammar.readers import Quaternion

PLAIN = ("quaternion", "xyzw")


class Given(NamedTuple):
    """A pose as it was written.

    pose: what it is, read as every command reads it
    notation: that of its rotation; None where none is written
    numbers: of the rotation, in column order; degrees: whether its angles are degrees
    position: x, y, z in metres as written, before `inverse: true`
    inverse: whether what is written is the inverse
    """

    pose: Pose
    notation: Notation | None = None
    numbers: Sequence[float] = ()
    degrees: bool = False
    position: Sequence[float] = (0.0, 0.0, 0.0)
    inverse: bool = False

    def quaternion(self, sheet: Sheet) -> Quaternion:
        """Add the way from the numbers as written to the quaternion."""
        if self.notation is None:
            sheet.play("no rotation", {})
            return IDENTITY[3:]
        return to_quaternion(sheet, self.numbers, self.notation, degrees=self.degrees)

    def components(self, sheet: Sheet, target: str, source: str) -> Rigid:
        """Add the way from the numbers as written to target_from_source."""
        name = self.notation.representation.name if self.notation else ""
        if not name or (name in PLAIN and abs(sum(x * x for x in self.numbers) - 1.0) <= 1e-12):
            qx, qy, qz, qw = self.numbers or IDENTITY[3:]
        else:
            with sheet.about(self._named(target, source)):
                qx, qy, qz, qw = self.quaternion(sheet)
        x, y, z = self.position
        found: Rigid = (x, y, z, qx, qy, qz, qw)
        return inverse(sheet, found, source, target) if self.inverse else found

    def _named(self, target: str, source: str) -> str:
        return f"{source}_from_{target}" if self.inverse else f"{target}_from_{source}"

    def turned(self) -> Given:
        """Return the inverse: what is written stays, the pose and its frames are turned around."""
        return self._replace(pose=pose_algebra.inverse(self.pose), inverse=not self.inverse)

    def say(self, sheet: Sheet, target: str, source: str) -> None:
        """List the pose of target_from_source as it is written."""
        sheet.reached(self.position)
        line = f"{self._named(target, source)}: xyz {sheet.numbers(self.position)} m"
        if self.notation is not None:
            name, axes = self.notation.representation.name, self.notation.axes
            if self.notation.representation.angles:
                name += ("_deg" if self.degrees else "_rad") + (f":{axes}" if axes else "")
            line += f", {'xyzw' if name == 'quaternion' else name} {sheet.numbers(self.numbers)}"
        sheet.say(line + (f"; its inverse is {target}_from_{source}" if self.inverse else ""))


def frames_of(poses: Sequence[Pose]) -> list[str]:
    """Name the frames along a chain of poses, each as its neighbours call it, else by a letter."""
    taken = {name for pose in poses for name in (pose.name, pose.parent) if name}
    letters = (each for each in (*ascii_lowercase, *(f"f{n}" for n in range(len(poses) + 2))) if each not in taken)
    sides = zip((None, *(pose.name for pose in poses)), (*(pose.parent for pose in poses), None), strict=True)
    return [printable(before or after or next(letters)) for before, after in sides]
