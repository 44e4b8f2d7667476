"""What one frame does over time: one pose in its parent for ever, or poses in its parents, oldest first.

Knows stamps in integer nanoseconds and components; knows no other frames.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from itertools import pairwise

from frametool.geometry import floats, segment

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any, Literal, TypeAlias

    from frametool.geometry.types import Rigid

    Track: TypeAlias = "StandingTrack | MovingTrack"  # what is known of one child frame; `standing` tells which
    Way: TypeAlias = tuple[float, float, float, float, float, float, float, float]

PAGE = 512  # samples: what a late one moves when it is sorted in
DEFAULT_AUTHORITY = "default_authority"


class StandingTrack:
    """One pose, which holds at all times."""

    __slots__ = ("authority", "child", "components", "parent")
    standing: Literal[True] = True
    varies = False
    count = 1

    def __init__(self, child: str, parent: str, components: Rigid) -> None:
        """Keep the pose: tx, ty, tz (metres), x, y, z, w."""
        self.child = child
        self.parent = parent
        self.components = components
        self.authority = DEFAULT_AUTHORITY  # who said so last

    def covers(self, at_ns: int) -> bool:  # noqa: ARG002 - any time
        """Hold at every time."""
        return True

    def parent_at(self, at_ns: int) -> str:  # noqa: ARG002 - any time
        """Return the parent."""
        return self.parent

    def at(self, times: Any) -> Rigid:  # noqa: ARG002 - any time
        """Return the pose, once for any time or many."""
        return self.components

    parent_near = parent_at
    at_many = at

    def walk(self) -> Iterator[tuple[None, str, Rigid]]:
        """Yield the pose as the one sample, without a stamp."""
        yield None, self.parent, self.components


class Page:
    """Successive samples as three parallel lists, and what was prepared to interpolate after each of them."""

    __slots__ = ("parents", "samples", "segments", "stamps")

    def __init__(self, stamps: list[int], parents: list[str], samples: list[Rigid]) -> None:
        """Keep the lists."""
        self.stamps = stamps
        self.parents = parents
        self.samples = samples
        self.segments: dict[int, Way] = {}


class MovingTrack:
    """Samples in the order of time, on pages: one that comes late moves a page of others, not all that follow.

    Appending goes to the last page, however long; a page is cut when a late sample falls into it.
    """

    __slots__ = ("authority", "begins", "child", "last_ns", "pages", "parent", "table", "tail", "varies")
    standing: Literal[False] = False

    def __init__(self, child: str, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Create a track with one sample."""
        self.child = child
        self.authority = DEFAULT_AUTHORITY
        self.varies = False
        self._take([Page([stamp_ns], [parent], [components])])

    def _take(self, pages: list[Page]) -> None:
        """Keep other pages: none of them empty, in the order of time."""
        self.pages = pages
        self.begins = [page.stamps[0] for page in pages]
        self.tail = pages[-1]
        self.last_ns = self.tail.stamps[-1]
        self.parent = self.tail.parents[-1]  # the newest
        self.table: Any = None  # the samples as arrays, for many lookups at once

    @property
    def count(self) -> int:
        """Return how many samples there are."""
        return sum(len(page.stamps) for page in self.pages)

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
            yield from zip(page.stamps, page.parents, page.samples, strict=True)

    def changes(self) -> Iterator[int]:
        """Yield the stamps from which another parent holds."""
        for (_, before, _), (stamp_ns, after, _) in pairwise(self.walk()):
            if before != after:
                yield stamp_ns

    def extend(self, stamps_ns: Sequence[int], components: Sequence[Rigid]) -> None:
        """Append samples under the newest parent, in the order of time and later than all others."""
        page = self.tail
        page.stamps.extend(stamps_ns)
        page.parents.extend([self.parent] * len(stamps_ns))
        page.samples.extend(components)
        self.last_ns = page.stamps[-1]
        self.table = None

    def add(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Sort a sample in, after those of the same stamp."""
        self.varies = self.varies or parent != self.parent
        page = self._short_page(stamp_ns)
        self._insert(page, bisect_right(page.stamps, stamp_ns), stamp_ns, parent, components)

    def add_if_new(self, stamp_ns: int, components: Rigid) -> bool:
        """Sort a sample in under the newest parent, unless its stamp is there already; return whether it was not."""
        page = self._short_page(stamp_ns)
        at = bisect_right(page.stamps, stamp_ns)
        if at and page.stamps[at - 1] == stamp_ns:
            return False
        self._insert(page, at, stamp_ns, self.parent, components)
        return True

    def _short_page(self, stamp_ns: int) -> Page:
        """Return the page of a stamp, cut if a late sample would have to move many."""
        page = self._page(stamp_ns)
        if stamp_ns >= self.last_ns or len(page.stamps) <= PAGE:
            return page
        self._cut(page)
        return self._page(stamp_ns)

    def _insert(self, page: Page, at: int, stamp_ns: int, parent: str, components: Rigid) -> None:
        page.stamps.insert(at, stamp_ns)
        page.parents.insert(at, parent)
        page.samples.insert(at, components)
        self.table = None
        if stamp_ns >= self.last_ns:
            self.last_ns, self.parent = stamp_ns, parent
        else:
            page.segments.clear()
            self.begins[0] = min(stamp_ns, self.begins[0])

    def _page(self, at_ns: int) -> Page:
        """Return the page of the newest sample that is not after a time; the first page where there is none."""
        if at_ns >= self.begins[-1]:
            return self.tail
        return self.pages[max(bisect_right(self.begins, at_ns) - 1, 0)]

    def _cut(self, page: Page) -> None:
        """Cut a page into short ones."""
        number = self.pages.index(page)
        cut = [
            Page(page.stamps[at : at + PAGE // 2], page.parents[at : at + PAGE // 2], page.samples[at : at + PAGE // 2])
            for at in range(0, len(page.stamps), PAGE // 2)
        ]
        self.pages[number : number + 1] = cut
        self.begins[number : number + 1] = [each.stamps[0] for each in cut]
        self.tail = self.pages[-1]

    def samples_at(self, stamp_ns: int) -> list[tuple[str, Rigid]]:
        """Return the (parent, components) of exactly a stamp, the first that came first."""
        begin, end = bisect_left(self.begins, stamp_ns), bisect_right(self.begins, stamp_ns)
        return [
            (page.parents[at], page.samples[at])
            for page in self.pages[max(begin - 1, 0) : end]
            for at in range(bisect_left(page.stamps, stamp_ns), bisect_right(page.stamps, stamp_ns))
        ]

    def replace(self, stamp_ns: int, parent: str, components: Rigid) -> None:
        """Put another sample in the place of the last one at a stamp."""
        number = bisect_right(self.begins, stamp_ns) - 1
        page = self.pages[number]
        at = bisect_right(page.stamps, stamp_ns) - 1
        page.parents[at], page.samples[at] = parent, components
        for each in self.pages[max(number - 1, 0) : number + 1]:
            each.segments.clear()
        varied = self.varies or parent != self.parent
        self._take(self.pages)
        self.varies = varied and any(True for _ in self.changes())

    def drop_before(self, stamp_ns: int) -> None:
        """Drop the samples older than a stamp, but never the newest."""
        oldest = min(stamp_ns, self.last_ns)
        if oldest <= self.first_ns:
            return
        pages = self.pages[self.pages.index(self._page(oldest - 1)) :]
        at = bisect_left(pages[0].stamps, oldest)
        for column in (pages[0].stamps, pages[0].parents, pages[0].samples):
            del column[:at]
        pages[0].segments.clear()
        self._take(pages if pages[0].stamps else pages[1:])
        self.varies = self.varies and any(True for _ in self.changes())

    def covers(self, at_ns: int) -> bool:
        """Return whether a time lies within the samples."""
        return self.begins[0] <= at_ns <= self.last_ns

    def parent_at(self, at_ns: int) -> str | None:
        """Return the parent at a time; None where a changing parent is not known."""
        if not self.varies:
            return self.parent
        return self.parent_near(at_ns) if self.covers(at_ns) else None

    def parent_near(self, at_ns: int) -> str:
        """Return the parent at a time, or at the sample nearest to it."""
        page = self._page(at_ns)
        return page.parents[max(bisect_right(page.stamps, at_ns) - 1, 0)]

    def at(self, at_ns: int) -> Rigid | None:
        """Return parent_from_child at a time, interpolated between two samples; None outside of them.

        Between samples under different parents the older one holds, as in tf2.
        """
        page = self.tail if at_ns >= self.begins[-1] else self._page(at_ns)
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
        return segment.along(*page.samples[at], *way, (at_ns - begin) / (end - begin), floats)

    def _after(self, page: Page) -> Page:
        return self.pages[bisect_right(self.begins, page.stamps[-1])]

    def _prepare(self, page: Page, at: int) -> Way:
        """Prepare the way from a sample to the next, and keep it."""
        here = page.samples[at]
        following, next_at = (page, at + 1) if at + 1 < len(page.stamps) else (self._after(page), 0)
        there = following.samples[next_at] if page.parents[at] == following.parents[next_at] else here
        way = page.segments[at] = segment.prepare(*here, *there, floats)
        return way

    def at_many(self, times: Any) -> Rigid:
        """Return parent_from_child at sorted times, an int64 array, all of them covered."""
        if self.table is None:
            from frametool.frames.lookup_many import TrackTable

            self.table = TrackTable(self)
        found: Rigid = self.table.at(times)
        return found
