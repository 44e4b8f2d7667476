"""Successive samples of one frame: a piece of a track that is short enough to be put in order again and again."""

from __future__ import annotations

from bisect import bisect_right
from operator import itemgetter

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import TypeAlias

    from frametool.geometry.types import Rigid

    Way: TypeAlias = tuple[float, float, float, float, float, float, float, float]

FEW = 64  # late samples: up to so many are sorted in one by one, a microsecond each; a whole page takes a hundred


class Page:
    """Samples as three parallel lists, and what was prepared to interpolate after each of them.

    `late` holds those that came out of order, as (stamp, parent, components): they wait until somebody asks, so that
    one sort takes in many.  None of them is before the first of the page, unless the page is the first.
    """

    __slots__ = ("late", "parents", "samples", "segments", "stamps")

    def __init__(self, stamps: list[int], parents: list[str], samples: list[Rigid]) -> None:
        """Keep the lists."""
        self.stamps = stamps
        self.parents = parents
        self.samples = samples
        self.segments: dict[int, Way] = {}
        self.late: list[tuple[int, str, Rigid]] = []

    def settle(self) -> None:
        """Sort in what came late, each after those of its stamp."""
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
        for column in (self.stamps, self.parents, self.samples):
            del column[:count]
        self.segments.clear()
