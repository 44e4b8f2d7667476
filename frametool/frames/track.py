"""What one frame did over time: its poses in its parents, oldest first; or the one pose of a frame that stands still.

Knows stamps in integer nanoseconds and components; knows no other frames.
"""

from __future__ import annotations

from bisect import bisect_right

from frametool.geometry import floats, segment

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, TypeAlias

    from frametool.geometry.types import Rigid

    Way: TypeAlias = tuple[float, float, float, float, float, float, float, float]


class Track:
    """The samples of one child frame: three parallel lists; a standing frame has one sample and no stamp."""

    __slots__ = ("authority", "child", "parents", "samples", "segments", "stamps", "standing", "table", "varies")

    def __init__(self, child: str, *, standing: bool) -> None:
        """Begin without samples."""
        self.child = child
        self.standing = standing
        self.authority = "default_authority"  # who said so last
        self.stamps: list[int] = []
        self.parents: list[str] = []
        self.samples: list[Rigid] = []
        self.varies = False  # whether the parent changes
        self.segments: dict[int, Way] = {}  # sample -> what `segment.prepare` gave for it and the next
        self.table: Any = None  # the same for many lookups at once, as arrays

    @property
    def parent(self) -> str:
        """Return the newest parent."""
        return self.parents[-1]

    @property
    def span(self) -> tuple[int, int]:
        """Return the first and the last stamp of a moving frame."""
        return self.stamps[0], self.stamps[-1]

    def stand(self, parent: str, components: Rigid) -> None:
        """Set the one pose of a standing frame."""
        self.parents, self.samples = [parent], [components]

    def add(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Sort a sample in, after those of the same stamp."""
        at = bisect_right(self.stamps, stamp_ns)
        self.varies = self.varies or (bool(self.parents) and parent != self.parents[0])
        self.stamps.insert(at, stamp_ns)
        self.parents.insert(at, parent)
        self.samples.insert(at, components)
        self.forget()

    def replace(self, at: int, parent: str, components: Rigid) -> None:
        """Put another sample in the place of one."""
        self.parents[at] = parent
        self.samples[at] = components
        self.varies = any(each != self.parents[0] for each in self.parents)
        self.forget()

    def drop_before(self, stamp_ns: int) -> None:
        """Drop the samples older than a stamp."""
        at = bisect_right(self.stamps, stamp_ns - 1)
        if at:
            del self.stamps[:at], self.parents[:at], self.samples[:at]
            self.varies = self.varies and any(each != self.parents[0] for each in self.parents)
            self.forget()

    def forget(self) -> None:
        """Forget what was prepared from the samples."""
        self.segments.clear()
        self.table = None

    def index(self, at_ns: int) -> int | None:
        """Return the sample that holds or begins the way at a time; None outside of the samples."""
        at = bisect_right(self.stamps, at_ns) - 1
        if at < 0 or (at + 1 == len(self.stamps) and self.stamps[at] != at_ns):
            return None
        return at

    def parent_at(self, at_ns: int | None) -> str | None:
        """Return the parent at a time, or the newest one; None where a changing parent is not known."""
        if not self.varies or at_ns is None:
            return self.parents[-1]
        at = self.index(at_ns)
        return None if at is None else self.parents[at]

    def parent_near(self, at_ns: int) -> str:
        """Return the parent at a time, or at the sample nearest to it."""
        if not self.varies:
            return self.parents[-1]
        return self.parents[max(bisect_right(self.stamps, at_ns) - 1, 0)]

    def at(self, at_ns: int) -> Rigid | None:
        """Return parent_from_child at a time, interpolated between two samples; None outside of them.

        Between samples under different parents the older one holds, as in tf2.
        """
        stamps = self.stamps
        at = bisect_right(stamps, at_ns) - 1
        if at < 0:
            return None
        begin = stamps[at]
        if begin == at_ns:
            return self.samples[at]
        if at + 1 == len(stamps):
            return None
        way = self.segments.get(at)
        if way is None:
            way = self._prepare(at)
        fraction = (at_ns - begin) / (stamps[at + 1] - begin)
        return segment.along(*self.samples[at], *way, fraction, floats)

    def _prepare(self, at: int) -> Way:
        """Prepare the way from a sample to the next, and keep it."""
        here = self.samples[at]
        there = self.samples[at + 1] if self.parents[at] == self.parents[at + 1] else here
        way = self.segments[at] = segment.prepare(*here, *there, floats)
        return way
