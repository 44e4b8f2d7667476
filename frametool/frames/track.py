"""The pose of one frame over time: a static pose in its parent, or samples in its parents, oldest first.

A track has components and stamps in integer nanoseconds, and does not depend on other frames.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from itertools import chain, islice, pairwise
from operator import itemgetter

from frametool.errors import NamedTuple
from frametool.geometry import floats, rigid

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import Any, Literal, TypeAlias

    from frametool.geometry import Rigid

    Way: TypeAlias = tuple[float, float, float, float, float, float, float, float]

MANY = 1 << 13  # number of samples above which `extend` packs them
FEW = 64  # late samples: up to this many are inserted one by one, which is cheaper than a sort


class Packed:
    """Poses in one array, 56 bytes each instead of 290 as tuples of floats; converted to a list before a change."""

    __slots__ = ("numbers",)

    def __init__(self, poses: Iterable[Rigid]) -> None:
        """Pack them."""
        self.numbers = array("d", chain.from_iterable(poses))

    def __iter__(self) -> Iterator[Rigid]:
        """Yield the poses as tuples."""
        return zip(*[iter(self.numbers)] * 7, strict=True)

    def __getitem__(self, at: int) -> tuple[float, ...]:
        """Return one pose by its index, from either end."""
        return tuple(self.numbers[7 * at : 7 * at + 7 or None])

    def append(self, pose: Rigid) -> None:
        """Add one."""
        self.numbers.extend(pose)

    def extend(self, poses: Iterable[Rigid]) -> None:
        """Add several."""
        self.numbers.extend(chain.from_iterable(poses))


class _Static(NamedTuple):
    """The pose of a static frame: tx, ty, tz (metres), x, y, z, w."""

    child: str
    parent: str
    components: Rigid


class StaticTransform(_Static):
    """One pose, valid at all times."""

    __slots__ = ()
    is_static: Literal[True] = True
    varies = False
    count = 1  # type: ignore[assignment] # of samples

    def covers(self, at_ns: int) -> bool:  # noqa: ARG002 - any time
        """Return True: a static pose is valid at every time."""
        return True

    def parent_at(self, at_ns: int) -> str:  # noqa: ARG002 - any time
        """Return the parent."""
        return self.parent

    def at(self, times: Any) -> Rigid:  # noqa: ARG002 - any time
        """Return the pose, the same for one time or many."""
        return self.components

    parent_near = parent_at
    at_many = at

    def walk(self) -> Iterator[tuple[None, str, Rigid]]:
        """Yield the pose as the only sample, without a stamp."""
        yield None, self.parent, self.components


class MovingTrack:
    """Samples in order of time, as three parallel lists, and the prepared interpolation after some of them.

    `late` holds samples that arrived out of order, (parent, components) by stamp, until the next query, so that one
    sort inserts many.
    """

    __slots__ = (
        "begin", "child", "first_ns", "last_ns", "late", "parent", "parents", "samples", "segments", "stamps", "table",
        "varies",
    )  # fmt: skip
    is_static: Literal[False] = False

    def __init__(self, child: str, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Create a track with one sample."""
        self.child = child
        self.varies = False
        self.stamps, self.parents = [stamp_ns], [parent]
        self.samples = [components]  # or Packed, which behaves like such a list
        self.begin = 0  # index of the oldest sample; items before it were dropped, or are room for older samples
        self.late: dict[int, tuple[str, Rigid]] = {}
        self.segments: dict[int, Way] = {}  # by the stamp at which they begin
        self.first_ns = self.last_ns = stamp_ns
        self.parent = parent  # the newest
        self.table: Any = None  # the samples as arrays, for many lookups at once

    @property
    def count(self) -> int:
        """Return how many samples there are."""
        return len(self.stamps) - self.begin + len(self.late)

    @property
    def span(self) -> tuple[int, int]:
        """Return the first and the last stamp."""
        return self.first_ns, self.last_ns

    @property
    def components(self) -> Rigid:
        """Return the newest pose."""
        return self.samples[-1]

    def walk(self) -> Iterator[tuple[int, str, Rigid]]:
        """Yield every sample as (stamp, parent, components), oldest first."""
        self._settle()
        return islice(zip(self.stamps, self.parents, self.samples, strict=True), self.begin, None)

    def changes(self) -> Iterator[int]:
        """Yield the stamps at which the parent changes."""
        for (_, before, _), (stamp_ns, after, _) in pairwise(self.walk()):
            if before != after:
                yield stamp_ns

    def extend(self, stamps_ns: Sequence[int], components: Sequence[Rigid]) -> None:
        """Append samples under the newest parent, in order of time and later than all others."""
        self.stamps.extend(stamps_ns)
        self.parents.extend([self.parent] * len(stamps_ns))
        if type(self.samples) is list and len(self.stamps) > MANY:
            self.samples = Packed(self.samples)  # type: ignore[assignment]
        self.samples.extend(components)
        self.last_ns = self.stamps[-1]
        self.table = None

    def add(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Add a sample at a new stamp."""
        self.table = None
        if stamp_ns < self.last_ns:
            self.varies = self.varies or parent != self.parent
            self.late[stamp_ns] = parent, components
            self.first_ns = min(self.first_ns, stamp_ns)
            return
        if parent != self.parent:
            self.varies, self.parent = True, parent
        self.stamps.append(stamp_ns)
        self.parents.append(parent)
        self.samples.append(components)
        self.last_ns = stamp_ns

    def has(self, stamp_ns: int) -> bool:
        """Return True if there is a sample at a stamp; late samples are not inserted for this, which costs more."""
        if stamp_ns > self.last_ns:
            return False
        return stamp_ns in self.late or self.stamps[bisect_left(self.stamps, stamp_ns, self.begin)] == stamp_ns

    def _unpack(self) -> None:
        """Convert the samples to a list, which can be changed."""
        if type(self.samples) is not list:
            self.samples = [*self.samples]

    def _settle(self) -> None:
        """Insert the late samples."""
        if not self.late:
            return
        self._unpack()
        columns: tuple[list[Any], ...] = self.stamps, self.parents, self.samples
        late = [(stamp_ns, *sample) for stamp_ns, sample in self.late.items()]
        if len(late) > FEW:
            rows = [*islice(zip(*columns, strict=True), self.begin, None), *late]
            rows.sort(key=itemgetter(0))
            self.stamps[:], self.parents[:], self.samples[:] = zip(*rows, strict=True)
            self.begin = 0
            self.segments.clear()
        else:
            for sample in late:
                at = bisect_right(self.stamps, sample[0], self.begin)
                self.segments.pop(self.stamps[at - 1], None)
                if not at:  # before the oldest there is room, doubled when it is used up, so that this is fast
                    self.begin = at = len(self.stamps)
                    for column in columns:
                        column[:0] = column[:1] * at
                before = at - (at == self.begin)  # in the room's last place, or between two others
                for column, part in zip(columns, sample, strict=True):
                    column[before:at] = [part]
                self.begin -= at - before
        self.late.clear()

    def _place(self, at_ns: int) -> int:
        """Return the index of the newest sample that is not after a time; `begin` - 1 if all are after it."""
        if self.late:
            self._settle()
        return bisect_right(self.stamps, at_ns, self.begin) - 1

    def sample_at(self, stamp_ns: int) -> tuple[str, Rigid]:
        """Return parent and components of the sample at an existing stamp."""
        at = self._place(stamp_ns)
        return self.parents[at], self.samples[at]

    def replace(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Replace the sample at a stamp."""
        at = self._place(stamp_ns)
        before = self.parents[at]
        self._unpack()
        self.parents[at], self.samples[at] = parent, components
        self.segments.pop(stamp_ns, None)
        self.segments.pop(self.stamps[at - 1], None)
        self.parent = self.parents[-1]
        self.table = None
        if parent != before:
            self.varies = any(True for _ in self.changes())

    def drop_before(self, stamp_ns: int) -> None:
        """Drop samples older than a stamp, but never the newest; the lists are shortened when half is dropped."""
        oldest = min(stamp_ns, self.last_ns)
        if oldest <= self.first_ns:
            return
        self._settle()
        gone = slice(self.begin, bisect_left(self.stamps, oldest, self.begin))
        self.begin = gone.stop
        self.first_ns = self.stamps[self.begin]
        self.table = None
        for dropped in self.stamps[gone]:
            self.segments.pop(dropped, None)
        if self.varies and len({*self.parents[gone], self.parents[self.begin]}) > 1:
            self.varies = any(True for _ in self.changes())
        if 2 * self.begin > len(self.stamps):
            self._unpack()
            for column in (self.stamps, self.parents, self.samples):
                del column[: self.begin]
            self.begin = 0

    def covers(self, at_ns: int) -> bool:
        """Return True if a time is within the samples."""
        return self.first_ns <= at_ns <= self.last_ns

    def parent_at(self, at_ns: int) -> str | None:
        """Return the parent at a time; None if a changing parent is not known."""
        if not self.varies:
            return self.parent
        return self.parent_near(at_ns) if self.covers(at_ns) else None

    def parent_near(self, at_ns: int) -> str:
        """Return the parent at a time, or at the sample nearest to it."""
        return self.parents[max(self._place(at_ns), self.begin)]

    def at(self, at_ns: int) -> Rigid | None:
        """Return parent_from_child at a time, interpolated between two samples; None outside of them.

        Between samples under different parents the older one is valid, as in tf2.
        """
        at = self._place(at_ns)
        if at < self.begin:
            return None
        begin = self.stamps[at]
        if begin == at_ns:
            return self.samples[at]
        if at_ns > self.last_ns:
            return None
        way = self.segments.get(begin)
        if way is None:
            after = self.samples[at + 1] if self.parents[at] == self.parents[at + 1] else self.samples[at]
            way = self.segments[begin] = rigid.prepare(*self.samples[at], *after, floats)
        return rigid.along(*self.samples[at], *way, (at_ns - begin) / (self.stamps[at + 1] - begin), floats)

    def at_many(self, times: Any) -> Rigid:
        """Return parent_from_child at sorted times, an int64 array, all of them covered."""
        if self.table is None:
            from frametool.frames.trajectory import TrackTable

            self.table = TrackTable(self)
        found: Rigid = self.table.at(times)
        return found


Track = StaticTransform | MovingTrack  # of one child frame; `is_static` distinguishes them
