"""What can be said of a recording edge by edge: how often, from when to when, where it pauses, jumps or goes back."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import UnknownFrame
from frametool.frames.path import edges_between
from frametool.frames.stamps import BILLION
from frametool.geometry import floats, rigid

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.geometry.kinds import Rigid

JUMP_FACTOR = 10.0  # a jump is a step so many times the median step of its edge ..
JUMP_METRES, JUMP_RADIANS = 0.1, 0.2  # .. and also longer than what noise and slow frames do
GAP_FACTOR = 5.0  # a gap is a pause so many times the median pause


class Step(NamedTuple):
    """The way from one sample to the next in time: where it ends, how far and how long it was."""

    stamp_ns: int
    line: int
    metres: float
    radians: float
    pause_ns: int


class EdgeLog:
    """The samples of one child frame, in the order they came; stamps in nanoseconds."""

    def __init__(self, child: str) -> None:
        """Begin without samples."""
        self.child = child
        self.parents: list[str] = []  # in the order they took over
        self.count = 0
        self.standing = False
        self.first_ns: int | None = None
        self.last_ns: int | None = None
        self.steps: list[Step] = []
        self.backward = 0
        self.delays_ns: list[int] = []
        self._newest: Rigid | None = None

    def add(
        self, parent: str, components: Rigid, stamp_ns: int | None, line: int = 0, received_ns: int | None = None
    ) -> None:
        """Take one sample in; without a stamp the frame stands still."""
        self.count += 1
        if not self.parents or self.parents[-1] != parent:
            self.parents.append(parent)
            self._newest = None
        if stamp_ns is None:
            self.standing = True
            return
        if received_ns is not None:
            self.delays_ns.append(received_ns - stamp_ns)
        if self.last_ns is not None and stamp_ns < self.last_ns:
            self.backward += 1
        elif self._newest is not None and self.last_ns is not None and stamp_ns > self.last_ns:
            metres, radians = rigid.distance(*self._newest, *components, xp=floats)
            self.steps.append(Step(stamp_ns, line, metres, radians, stamp_ns - self.last_ns))
        self.first_ns = stamp_ns if self.first_ns is None else min(self.first_ns, stamp_ns)
        if self.last_ns is None or stamp_ns >= self.last_ns:
            self.last_ns, self._newest = stamp_ns, components

    @property
    def parent(self) -> str:
        """Give the newest parent."""
        return self.parents[-1]

    @property
    def moves(self) -> bool:
        """Tell an edge with two different stamps from one that stands still."""
        return not self.standing and self.first_ns != self.last_ns

    @property
    def rate(self) -> float | None:
        """Give samples a second between the first and the last stamp; None for an edge that stands still."""
        if self.first_ns is None or self.last_ns is None or not self.moves:
            return None
        return (self.count - 1) * BILLION / (self.last_ns - self.first_ns)

    @property
    def longest(self) -> Step | None:
        """Give the step with the longest pause."""
        return max(self.steps, key=lambda step: step.pause_ns, default=None)

    def gaps(self) -> list[Step]:
        """Give the steps that waited far longer than usual."""
        usual = _median([step.pause_ns for step in self.steps])
        return [step for step in self.steps if step.pause_ns > GAP_FACTOR * usual]

    def jumps(self) -> list[Step]:
        """Give the steps that went far further than usual."""
        metres, radians = (_median([step[field] for step in self.steps]) for field in (2, 3))
        far, turned = max(JUMP_METRES, JUMP_FACTOR * metres), max(JUMP_RADIANS, JUMP_FACTOR * radians)
        return [step for step in self.steps if step.metres > far or step.radians > turned]


def _median(values: list[float]) -> float:
    return sorted(values)[len(values) // 2] if values else 0.0


def chain(logs: dict[str, EdgeLog], target: str, source: str) -> list[str]:
    """Name the children of the edges between two frames, by their newest parents, from target to source.

    Raises UnknownFrame, NotConnected.
    """
    known = dict.fromkeys(frame for log in logs.values() for frame in (log.parent, log.child))
    for frame in (target, source):
        if frame not in known:
            raise UnknownFrame(frame, known=known)
    down, up = edges_between(target, source, lambda frame: logs[frame].parent if frame in logs else None)
    return [*reversed(down), *reversed(up)]


def common_interval(logs: Iterable[EdgeLog]) -> tuple[int, int] | None:
    """Give the first and last stamp that all moving edges cover; None if all stand still; empty if first > last."""
    moving = [log for log in logs if log.moves and log.first_ns is not None and log.last_ns is not None]
    if not moving:
        return None
    return max(log.first_ns for log in moving), min(log.last_ns for log in moving)  # type: ignore[type-var, return-value]
