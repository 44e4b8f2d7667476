"""The pose of one frame over time: a static pose in its parent, or samples in its parents, oldest first.

Samples are stored on pages that are short enough to be sorted again and again.  Knows stamps in integer nanoseconds
and components; knows no other frames.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from itertools import chain, pairwise
from operator import itemgetter

from frametool import sizes
from frametool.geometry import floats, rigid

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import Any, Literal, TypeAlias

    from frametool.geometry.types import Rigid

    Way: TypeAlias = tuple[float, float, float, float, float, float, float, float]
    Track: TypeAlias = "StaticTransform | MovingTrack"  # of one child frame; `is_static` distinguishes them

MANY = 1 << 13  # from this many samples per call on they are packed
FEW = 64  # late samples: up to this many are inserted one by one, a microsecond each; sorting a page takes a hundred


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


class Page:
    """Samples as three parallel lists, and the prepared interpolation after each of them.

    `late` holds samples that arrived out of order, as (stamp, parent, components), until the next query, so that
    one sort inserts many.  None of them is before the first of the page, unless it is the first page.
    """

    __slots__ = ("late", "parents", "samples", "segments", "stamps")

    def __init__(self, stamps: list[int], parents: list[str], samples: list[Rigid]) -> None:
        """Store the lists."""
        self.stamps = stamps
        self.parents = parents
        self.samples = samples  # or Packed, which behaves like such a list
        self.segments: dict[int, Way] = {}
        self.late: list[tuple[int, str, Rigid]] = []

    def unpack(self) -> None:
        """Convert the samples to a list, which can be changed."""
        if type(self.samples) is not list:
            self.samples = [*self.samples]

    def settle(self) -> None:
        """Insert the late samples, each after those of the same stamp."""
        if self.late:
            self.unpack()
        if len(self.late) > FEW:
            rows = [*zip(self.stamps, self.parents, self.samples, strict=True), *self.late]
            rows.sort(key=itemgetter(0))
            self.stamps[:], self.parents[:], self.samples[:] = zip(*rows, strict=True)
        else:
            for stamp_ns, parent, components in self.late:
                at = bisect_right(self.stamps, stamp_ns)
                self.stamps.insert(at, stamp_ns)
                self.parents.insert(at, parent)
                self.samples.insert(at, components)
        if self.late:
            self.late.clear()
            self.segments.clear()

    def drop(self, count: int) -> None:
        """Drop the oldest samples."""
        self.unpack()
        for column in (self.stamps, self.parents, self.samples):
            del column[:count]
        self.segments.clear()


DEFAULT_AUTHORITY = "default_authority"


class StaticTransform:
    """One pose, valid at all times."""

    __slots__ = ("authority", "child", "components", "parent")
    is_static: Literal[True] = True
    varies = False
    count = 1

    def __init__(self, child: str, parent: str, components: Rigid) -> None:
        """Store the pose: tx, ty, tz (metres), x, y, z, w."""
        self.child = child
        self.parent = parent
        self.components = components
        self.authority = DEFAULT_AUTHORITY  # of the last publisher

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
    """Samples in order of time, on pages; a late sample is added to its page, which is sorted at the next query.

    Appending uses the last page, however long; a page is split when a late sample falls into it.
    """

    __slots__ = ("authority", "begins", "child", "known", "last_ns", "pages", "parent", "table", "tail", "varies")
    is_static: Literal[False] = False

    def __init__(self, child: str, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Create a track with one sample."""
        self.child = child
        self.authority = DEFAULT_AUTHORITY
        self.varies = False
        self.tail = Page([stamp_ns], [parent], [components])
        self.pages = [self.tail]
        self.begins = [stamp_ns]  # of each page
        self.last_ns = stamp_ns
        self.parent = parent  # the newest
        self.known: set[int] | None = None  # all stamps, from the first late sample on
        self.table: Any = None  # the samples as arrays, for many lookups at once

    @property
    def count(self) -> int:
        """Return how many samples there are."""
        return sum(len(page.stamps) + len(page.late) for page in self.pages)

    @property
    def first_ns(self) -> int:
        """Return the first stamp."""
        return self.begins[0]

    @property
    def span(self) -> tuple[int, int]:
        """Return the first and the last stamp."""
        return self.begins[0], self.last_ns

    @property
    def components(self) -> Rigid:
        """Return the newest pose."""
        return self.tail.samples[-1]

    def walk(self) -> Iterator[tuple[int, str, Rigid]]:
        """Yield every sample as (stamp, parent, components), oldest first."""
        for page in self.pages:
            page.settle()
            yield from zip(page.stamps, page.parents, page.samples, strict=True)

    def changes(self) -> Iterator[int]:
        """Yield the stamps at which the parent changes."""
        for (_, before, _), (stamp_ns, after, _) in pairwise(self.walk()):
            if before != after:
                yield stamp_ns

    def extend(self, stamps_ns: Sequence[int], components: Sequence[Rigid]) -> None:
        """Append samples under the newest parent, in order of time and later than all others."""
        page = self.tail
        page.stamps.extend(stamps_ns)
        page.parents.extend([self.parent] * len(stamps_ns))
        if type(page.samples) is list and len(page.stamps) > MANY:
            page.samples = Packed(page.samples)  # type: ignore[assignment]
        page.samples.extend(components)
        self.last_ns = page.stamps[-1]
        self.table = None
        if self.known is not None:
            self.known.update(stamps_ns)

    def add(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Add a sample, after those of the same stamp."""
        self.varies = self.varies or parent != self.parent
        if self.known is not None:
            self.known.add(stamp_ns)
        if stamp_ns < self.last_ns:
            self._lay(stamp_ns, parent, components)
            return
        self.tail.stamps.append(stamp_ns)
        self.tail.parents.append(parent)
        self.tail.samples.append(components)
        self.last_ns, self.parent = stamp_ns, parent
        self.table = None

    def add_if_new(self, stamp_ns: int, components: Rigid) -> bool:
        """Add a late sample under the newest parent, unless its stamp exists; return True if it was added.

        The stamps are also kept in a set: searching the pages would cost more than everything else.
        """
        known = self.known
        if known is None:
            known = self.known = {stamp for stamp, _, _ in self.walk()}
        if stamp_ns in known:
            return False
        known.add(stamp_ns)
        self._lay(stamp_ns, self.parent, components)
        return True

    def _lay(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Add a late sample to its page; split a long page."""
        begins = self.begins
        number = bisect_right(begins, stamp_ns) - 1
        if number < 0:
            number, begins[0] = 0, stamp_ns
        page = self.pages[number]
        page.late.append((stamp_ns, parent, components))
        self.table = None
        if len(page.stamps) + len(page.late) > sizes.PAGE:
            self._cut(number)

    def _page(self, at_ns: int) -> Page:
        """Return the page of the newest sample that is not after a time; the first page if there is none."""
        page = self.pages[self._number(at_ns)]
        if page.late:
            page.settle()
        return page

    def _number(self, at_ns: int) -> int:
        return max(bisect_right(self.begins, at_ns) - 1, 0)

    def _cut(self, number: int) -> None:
        """Split a page into short ones."""
        page = self.pages[number]
        page.settle()
        page.unpack()
        count = 2 * len(page.stamps) // sizes.PAGE
        ends = [part * len(page.stamps) // count for part in range(count + 1)]
        cut = [
            Page(page.stamps[begin:end], page.parents[begin:end], page.samples[begin:end])
            for begin, end in pairwise(ends)
        ]
        self.pages[number : number + 1] = cut
        self.begins[number : number + 1] = [each.stamps[0] for each in cut]
        self.tail = self.pages[-1]

    def samples_at(self, stamp_ns: int) -> list[tuple[str, Rigid]]:
        """Return the (parent, components) at exactly a stamp, in order of arrival."""
        begin, end = bisect_left(self.begins, stamp_ns), bisect_right(self.begins, stamp_ns)
        pages = self.pages[max(begin - 1, 0) : end]
        for page in pages:
            page.settle()
        return [
            (page.parents[at], page.samples[at])
            for page in pages
            for at in range(bisect_left(page.stamps, stamp_ns), bisect_right(page.stamps, stamp_ns))
        ]

    def replace(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Replace the last sample at a stamp."""
        page = self._page(stamp_ns)
        at = bisect_right(page.stamps, stamp_ns) - 1
        before = page.parents[at]
        page.unpack()
        page.parents[at], page.samples[at] = parent, components
        page.segments.pop(at, None)
        page.segments.pop(at - 1, None)
        if at == 0:
            self.pages[max(self._number(stamp_ns) - 1, 0)].segments.clear()
        self.parent = self.tail.parents[-1]
        self.table = None
        if parent != before:
            self.varies = any(True for _ in self.changes())

    def drop_before(self, stamp_ns: int) -> None:
        """Drop the samples older than a stamp, but never the newest."""
        oldest = min(stamp_ns, self.last_ns)
        if oldest <= self.begins[0]:
            return
        if len(self.pages[self._number(oldest - 1)].stamps) > sizes.PAGE:
            self._cut(self._number(oldest - 1))
        number = self._number(oldest - 1)
        page = self._page(oldest - 1)
        count = bisect_left(page.stamps, oldest)
        may_settle = self.varies and (number > 0 or len({*page.parents[: count + 1]}) > 1)
        page.drop(count)
        gone = number + (not page.stamps)
        del self.pages[:gone], self.begins[:gone]
        self.begins[0] = self.pages[0].stamps[0]
        self.table = None
        if may_settle:
            self.varies = any(True for _ in self.changes())

    def covers(self, at_ns: int) -> bool:
        """Return True if a time is within the samples."""
        return self.begins[0] <= at_ns <= self.last_ns

    def parent_at(self, at_ns: int) -> str | None:
        """Return the parent at a time; None if a changing parent is not known."""
        if not self.varies:
            return self.parent
        return self.parent_near(at_ns) if self.covers(at_ns) else None

    def parent_near(self, at_ns: int) -> str:
        """Return the parent at a time, or at the sample nearest to it."""
        page = self._page(at_ns)
        return page.parents[max(bisect_right(page.stamps, at_ns) - 1, 0)]

    def at(self, at_ns: int) -> Rigid | None:
        """Return parent_from_child at a time, interpolated between two samples; None outside of them.

        Between samples under different parents the older one is valid, as in tf2.
        """
        page = self.tail if at_ns >= self.begins[-1] else self._page(at_ns)
        if page.late:
            page.settle()
        stamps = page.stamps
        at = bisect_right(stamps, at_ns) - 1
        if at < 0:
            return None
        begin = stamps[at]
        if begin == at_ns:
            return page.samples[at]
        if at + 1 < len(stamps):
            end = stamps[at + 1]
        elif page is self.tail:
            return None
        else:
            end = self._after(page).stamps[0]
        way = page.segments.get(at)
        if way is None:
            way = self._prepare(page, at)
        return rigid.along(*page.samples[at], *way, (at_ns - begin) / (end - begin), floats)

    def _after(self, page: Page) -> Page:
        return self.pages[bisect_right(self.begins, page.stamps[-1])]

    def _prepare(self, page: Page, at: int) -> Way:
        """Prepare the segment from a sample to the next, and cache it."""
        here = page.samples[at]
        following, next_at = (page, at + 1) if at + 1 < len(page.stamps) else (self._after(page), 0)
        there = following.samples[next_at] if page.parents[at] == following.parents[next_at] else here
        way = page.segments[at] = rigid.prepare(*here, *there, floats)
        return way

    def at_many(self, times: Any) -> Rigid:
        """Return parent_from_child at sorted times, an int64 array, all of them covered."""
        if self.table is None:
            from frametool.frames.lookup_many import TrackTable

            self.table = TrackTable(self)
        found: Rigid = self.table.at(times)
        return found
