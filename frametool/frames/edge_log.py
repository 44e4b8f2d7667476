"""Statistics of edges: their rate, first and last stamp, gaps, jumps and backward stamps.

For the samples of a recording in order of arrival, and for the edges of a tree: as a short text, and as tf2 lists it.
"""

from __future__ import annotations

from array import array
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import UnknownFrame
from frametool.frames.stamps import BILLION
from frametool.frames.topology import FramePath, path_between, seconds
from frametool.geometry import rigid

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack, Track
    from frametool.geometry.types import Array, Indices, Rigid

JUMP_FACTOR = 10.0  # a jump is a step of at least this many median steps of its edge ..
JUMP_METRES, JUMP_RADIANS = 0.1, 0.2  # .. and longer than noise and low rates explain
GAP_FACTOR = 5.0  # a gap is a pause of at least this many median pauses


LEAST_RETURNS = 3  # oscillations that are not an accident
RETURN_FACTOR = 0.1  # an oscillation ends this close to its start, relative to its step


class SampleStep(NamedTuple):
    """The step from one stamp to the next: its end, distance and duration, and whether it leads back.

    Between different parents there is no distance: metres and radians are 0.  `returns` is True if the last two steps
    are both large and the second ends near the start of the first.
    """

    stamp_ns: int
    line: int
    metres: float
    radians: float
    pause_ns: int
    returns: bool


class EdgeLog:
    """The samples of one child frame, in order of arrival; stamps in nanoseconds."""

    def __init__(self, child: str) -> None:
        """Create an empty log."""
        self.child = child
        self.parent = ""  # the newest
        self.parents: dict[str, int] = {}  # in the order in which they were first named
        self.topics: dict[str, int] = {}  # number of samples by topic, if the topic is known
        self.changes = 0
        self.count = 0
        self.is_static = False
        self.first_ns: int | None = None
        self.last_ns: int | None = None
        self.backward = 0  # samples that arrived after a later stamp
        self.delays_ns: list[int] = []
        self._stamps: list[int] = []  # Python integers: a broken clock may exceed 64 bits
        self._lines = array("q")
        self._under = array("q")  # the number of the parent
        self._poses = array("d")  # seven numbers per sample

    def add(
        self, parent: str, components: Rigid, stamp_ns: int | None, line: int = 0, received_ns: int | None = None
    ) -> None:
        """Add one sample; without a stamp the frame is static."""
        self.changes += self.count > 0 and parent != self.parent
        self.count += 1
        self.parent = parent
        under = self.parents.setdefault(parent, len(self.parents))
        if stamp_ns is None:
            self.is_static = True
            return
        if received_ns is not None:
            self.delays_ns.append(received_ns - stamp_ns)
        self.backward += self.is_late(stamp_ns)
        self.first_ns = stamp_ns if self.first_ns is None else min(self.first_ns, stamp_ns)
        self.last_ns = stamp_ns if self.last_ns is None else max(self.last_ns, stamp_ns)
        self._stamps.append(stamp_ns)
        self._lines.append(line)
        self._under.append(under)
        self._poses.extend(components)

    def is_late(self, stamp_ns: int) -> bool:
        """Return True if a stamp arrives after a later one."""
        return self.last_ns is not None and stamp_ns < self.last_ns

    @cached_property
    def steps(self) -> list[SampleStep]:
        """Return the steps between stamps in order of time, once all are in; the last of equal stamps counts."""
        last = {stamp: at for at, stamp in enumerate(self._stamps)}
        order = [last[stamp] for stamp in sorted(last)]
        if len(order) < 2:
            return []
        import numpy as np

        poses, under = np.array(self._poses).reshape(-1, 7)[order].T, np.array(self._under)[order]
        far, over_two = _apart(poses, under, 1), _apart(poses, under, 2)
        least = np.array([[JUMP_METRES], [JUMP_RADIANS]])
        back = (np.minimum(far[:, :-1], far[:, 1:]) > least) & (over_two < RETURN_FACTOR * far[:, :-1])
        pauses = [self._stamps[at] - self._stamps[before] for before, at in pairwise(order)]
        stamps, lines = ([column[at] for at in order[1:]] for column in (self._stamps, self._lines))
        metres, radians = far.tolist()
        return [*map(SampleStep, stamps, lines, metres, radians, pauses, np.append(False, back.any(0)).tolist())]

    @property
    def moves(self) -> bool:
        """Return True if there are two different stamps."""
        return not self.is_static and self.first_ns != self.last_ns

    @property
    def span(self) -> tuple[int, int]:
        """Return the first and the last stamp of a moving edge."""
        return self.first_ns or 0, self.last_ns or 0

    @property
    def rate(self) -> float | None:
        """Return samples per second between the first and the last stamp; None for a static edge."""
        first, last = self.span
        return (self.count - 1) * BILLION / (last - first) if self.moves else None

    def gaps(self) -> list[SampleStep]:
        """Return the steps that took far longer than usual."""
        usual = _median([step.pause_ns for step in self.steps])
        return [step for step in self.steps if step.pause_ns > GAP_FACTOR * usual]

    def jumps(self) -> list[SampleStep]:
        """Return the steps that are far larger than usual."""
        metres, radians = (_median([step[field] for step in self.steps]) for field in (2, 3))
        far, turned = max(JUMP_METRES, JUMP_FACTOR * metres), max(JUMP_RADIANS, JUMP_FACTOR * radians)
        return [step for step in self.steps if step.metres > far or step.radians > turned]

    def returns(self) -> list[SampleStep]:
        """Return the steps back if an edge oscillates all the time, as with two publishers that disagree."""
        back = [step for step in self.steps if step.returns]
        return back if len(back) >= max(LEAST_RETURNS, len(self.steps) / 3) else []


def _apart(poses: Array, under: Indices, by: int) -> Array:
    """Return metres and radians between poses in rows and those so many further on; 0 between different parents."""
    import numpy as np

    from frametool.geometry import arrays

    found = rigid.distance(*poses[:, :-by], *poses[:, by:], arrays)  # type: ignore[call-arg]
    return np.where(under[:-by] == under[by:], found, 0.0)


def _median(values: list[float]) -> float:
    return sorted(values)[len(values) // 2] if values else 0.0


def chain(logs: dict[str, EdgeLog], target: str, source: str) -> FramePath:
    """Return the path between two frames by their newest parents.

    Raises UnknownFrame, NotConnected.
    """
    known = dict.fromkeys(frame for log in logs.values() for frame in (log.parent, log.child))
    for frame in (target, source):
        if frame not in known:
            raise UnknownFrame(frame, known=known)
    return path_between(target, source, lambda frame: logs[frame].parent if frame in logs else None)


SHORTEST = 0.0001  # seconds: tf2 divides by at least this


def motion(track: MovingTrack) -> str:
    """Return a short description of a frame's motion: `41 at 10 Hz, 0 .. 4 s`."""
    first, last = track.span
    if first == last:
        return f"one at {seconds(first)} s" if track.count == 1 else f"{track.count} at once"
    rate = (track.count - 1) * BILLION / (last - first)
    changes = sum(1 for _ in track.changes())
    times = f" {changes} times" if changes > 1 else ""
    other = f", reparented{times}" if changes else ""
    return f"{track.count} at {rate:.4g} Hz, {seconds(first)} .. {seconds(last)} s{other}"


class CacheEntry:
    """An entry of tf2's cache listing; a static one has no stamps."""

    def __init__(self, track: Track) -> None:
        """Count the samples of a track."""
        oldest, newest = (0, 0) if track.is_static else track.span
        self.child, self.parent = track.child, track.parent
        self.oldest, self.newest = oldest / BILLION, newest / BILLION
        self.length = (newest - oldest) / BILLION
        self.rate = track.count / max(self.length, SHORTEST)


def listed_motion(rate: float, length: float, newest: float) -> str:
    """Return a short description of an edge's motion from tf2's listing: hertz, and seconds."""
    if length > 0.0:
        return f"{rate:.4g} Hz over {length:.4g} s"
    return f"one at {newest:.9g} s" if newest else "static"


def cache_entries(tree: Frames) -> list[CacheEntry]:
    """Return tf2's listing, in the order of first mention."""
    return [CacheEntry(track) for frame in tree.frames if (track := tree.track(frame))]
