"""What a row is compared with when that comes from the rows before: one record at a time, with plain floats."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION, format_stamp
from frametool.stream.operation import PREVIOUS

if TYPE_CHECKING:
    from frametool.geometry.types import Rigid


class Memory:
    """The pose before, or the first of all, and its stamp."""

    __slots__ = ("pose", "stamp_ns")

    def __init__(self) -> None:
        """Begin before the first row."""
        self.pose: Rigid | None = None
        self.stamp_ns: int | None = None

    def pair(self, of: str, pose: Rigid) -> list[Rigid]:
        """Return what a pose is compared with, and the pose; the very first one's is itself."""
        before = self.pose or pose
        if of == PREVIOUS or self.pose is None:
            self.pose = pose
        return [before, pose]

    def step(self, stamp_ns: int) -> float | None:
        """Return the seconds since the row before, None for the first; raises ValueInvalid if time stands still."""
        before, self.stamp_ns = self.stamp_ns, stamp_ns
        if before is None:
            return None
        if stamp_ns <= before:
            raise ValueInvalid(no_step(before, stamp_ns))
        return (stamp_ns - before) / BILLION


def no_step(before: int, stamp_ns: int) -> str:
    """Say why there is no velocity between two stamps."""
    what = "is that of the row before" if stamp_ns == before else f"is before {format_stamp(before)}, of the row before"
    return f"stamp {format_stamp(stamp_ns)} {what}: there is no velocity"
