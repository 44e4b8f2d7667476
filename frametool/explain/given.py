"""Poses as they were written: the notation and its numbers beside the pose they are, so that the way to it shows."""

from __future__ import annotations

from string import ascii_lowercase
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.source import Source
from frametool.errors import ValueInvalid, printable
from frametool.explain.from_quaternion import blocks_of, run
from frametool.explain.operations import inverse
from frametool.grammar import pose_algebra
from frametool.grammar.pose import Pose
from frametool.stream.record_values import documents, pose_of
from frametool.stream.request import Request
from frametool.stream.row_layout import POSE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.sheet import Sheet
    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Quaternion
    from frametool.stream.record import Record

INLINE = "argument"
PLAIN = ("quaternion", "xyzw")
IDENTITY = (0.0, 0.0, 0.0, 1.0)


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
            sheet.heading("The rotation")
            sheet.say("None is given: the identity, x 0, y 0, z 0, w 1.")
            return IDENTITY
        block = blocks_of(self.notation).to_quaternion
        q: Quaternion = run(block, sheet, self.numbers, self.notation, degrees=self.degrees)
        return q

    def components(self, sheet: Sheet, target: str, source: str) -> Rigid:
        """Add the way from the numbers as written to target_from_source."""
        name = self.notation.representation.name if self.notation else ""
        if not name or (name in PLAIN and abs(sum(x * x for x in self.numbers) - 1.0) <= 1e-12):
            qx, qy, qz, qw = self.numbers or IDENTITY
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


def given_poses(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[Given]:
    """Read the poses of a text as they are written; raises as `read_poses` does."""
    request = Request(kind=POSE, degrees=degrees, normalize=normalize)
    return [given_of(record, request) for _, records in documents(source, request) for record in records]


def given_of(record: Record, request: Request) -> Given:
    """Return a record as it is written."""
    shape, form = record.shape, record.shape.notation
    given = Given(pose_of(record, request), form, position=shape.position(record.values), inverse=shape.inverse)
    if form is None:
        return given
    return given._replace(
        numbers=shape.rotation(record.values), degrees=bool(form.representation.angles) and shape.degrees
    )


def given_pose(value: Any, *, degrees: bool = False) -> Given:
    """Take one pose: a mapping, its text, a Transform or a Rotation.

    Raises ValueInvalid, FormatError.
    """
    from frametool.geometry.representations import notation
    from frametool.geometry.rotation import Rotation
    from frametool.geometry.transform import Transform

    if isinstance(value, (str, dict, list)):
        found = given_poses(source_of(value), degrees=degrees)
        if len(found) != 1:
            raise ValueInvalid(f"a derivation is of one pose, {INLINE} holds {len(found)}")
        return found[0]
    if not isinstance(value, (Transform, Rotation)) or value.shape:
        raise ValueInvalid(f"expected one pose: a mapping, its text, a Transform or a Rotation; found {value!r:.60}")
    pose = Pose.of(value.components) if isinstance(value, Transform) else Pose(None, value.components)
    x, y, z, *rotation = pose.components
    return Given(pose, notation("quaternion"), rotation, position=(x, y, z))


def source_of(value: Any) -> Source:
    """Return a text, or a mapping or list as text."""
    from frametool.documents.json import dump

    return Source(INLINE, value if isinstance(value, str) else dump(value))


def frames_of(count: int, poses: Sequence[Pose]) -> list[str]:
    """Name the frames along a chain of poses, each as its neighbours call it, else by a letter."""
    taken = {name for pose in poses for name in (pose.name, pose.parent) if name}
    letters = (each for each in (*ascii_lowercase, *(f"f{n}" for n in range(count + 1))) if each not in taken)
    names = []
    for at in range(count):
        before = poses[at - 1].name if at else None
        after = poses[at].parent if at < len(poses) else None
        names.append(printable(before or after or next(letters)))
    return names
