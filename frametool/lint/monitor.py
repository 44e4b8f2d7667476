"""Analyse the samples of edges in order of arrival: rate, first and last stamp, gaps, jumps and backward stamps.

The report of `monitor` consists of plain mappings with units in their keys: one per edge, and one for a chain.
"""

from __future__ import annotations

from array import array
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import FormatError, Misused, UnknownFrame, shown
from frametool.formats.load import FrameFile, refuse_unknown_joints
from frametool.frames.stamps import BILLION
from frametool.frames.topology import FramePath, path_between
from frametool.geometry import rigid
from frametool.grammar.edges import stop

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry import Array, Indices
    from frametool.grammar.edges import Edge, Report
    from frametool.lint.rules import Statement

JUMP_FACTOR = 10.0  # a jump is a step of at least this many median steps of its edge ..
JUMP_METRES, JUMP_RADIANS = 0.1, 0.2  # .. and longer than noise or a low rate would cause
GAP_FACTOR = 5.0  # a gap is a pause of at least this many median pauses
LEAST_RETURNS = 3  # oscillations that are not an accident
RETURN_FACTOR = 0.1  # an oscillation ends this close to its start, relative to its step


class SampleStep(NamedTuple):
    """The step from one stamp to the next: its end, distance and duration.

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
    """The samples of one child frame, in order of arrival; stamps in nanoseconds.

    parent: that of the last sample
    changes: samples with another parent than the previous one; backward: samples that arrive after a later stamp
    """

    def __init__(self, first: Edge | Statement) -> None:
        """Create an empty log for the child of a sample."""
        self.child, self.parent = first.child, first.parent or ""
        self.parents: dict[str, int] = {}  # in the order in which they were first named
        self.topics: dict[str, int] = {}  # number of samples by topic, if the topic is known
        self.changes = self.backward = self.count = 0
        self.is_static = False
        self.first_ns: int | None = None
        self.last_ns: int | None = None
        self.delays_ns: list[int] = []
        self._stamps: list[int] = []  # Python integers: a broken clock may exceed 64 bits
        self._lines = array("q")
        self._under = array("q")  # the number of the parent
        self._poses = array("d")  # seven numbers per sample

    def add(self, seen: Edge | Statement, received_ns: int | None = None) -> None:
        """Add one sample; without a stamp the frame is static."""
        parent, stamp_ns = seen.parent or "", seen.stamp_ns
        self.changes += parent != self.parent
        self.count += 1
        self.parent = parent
        under = self.parents.setdefault(parent, len(self.parents))
        if stamp_ns is None:
            self.is_static = True
            return
        if received_ns is not None:
            self.delays_ns.append(received_ns - stamp_ns)
        self.backward += self.last_ns is not None and stamp_ns < self.last_ns
        self.first_ns = stamp_ns if self.first_ns is None else min(self.first_ns, stamp_ns)
        self.last_ns = stamp_ns if self.last_ns is None else max(self.last_ns, stamp_ns)
        self._stamps.append(stamp_ns)
        self._lines.append(seen.line)
        self._under.append(under)
        self._poses.extend(seen.components)

    @cached_property
    def steps(self) -> list[SampleStep]:
        """Return the steps between stamps in order of time, once all are in; of equal stamps the last is used."""
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
        """Return the steps back of an edge that oscillates, as with two publishers that disagree."""
        back = [step for step in self.steps if step.returns]
        return back if len(back) >= max(LEAST_RETURNS, len(self.steps) / 3) else []


def _apart(poses: Array, under: Indices, by: int) -> Array:
    """Return metres and radians between each pose and the one `by` rows later; 0 between different parents."""
    import numpy as np

    from frametool.geometry import arrays

    with np.errstate(all="ignore"):  # steps between places of 1e308 m overflow
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


def monitor(
    files: Sequence[FrameFile], *ends: str, normalize: bool = False, clashing: Report = stop
) -> list[dict[str, Any]]:
    """Describe every edge of files; or, for `ends` (target, source), the edges between the two and their chain.

    clashing: receives the errors about frames on the topics of two robots, whose samples are then combined
    Raises FormatError for files without transforms, UnknownFrame, NotConnected.
    """

    def report(error: FormatError) -> None:
        (clashing if error.rule == "two-topics" else stop)(error)

    logs: dict[str, EdgeLog] = {}
    for file in files:
        for edge in file.edges(report, normalize=normalize):
            if edge.parent is not None:
                log = logs.get(edge.child) or logs.setdefault(edge.child, EdgeLog(edge))
                log.add(edge, edge.received_ns)
                if edge.topic:
                    log.topics[edge.topic] = log.topics.get(edge.topic, 0) + 1
    refuse_unknown_joints(files)
    if not logs:
        raise FormatError("no transforms in it", source=", ".join(file.name for file in files))
    if not ends:
        return list(map(edge_entry, logs.values()))
    target, source = ends
    path = chain(logs, target, source)
    if not (between := [logs[child] for child in path.edges]):
        raise Misused(f"no edge is between {shown(target)} and itself; name two frames")
    return [*map(edge_entry, between), chain_entry(path.frames, between)]


def edge_entry(log: EdgeLog) -> dict[str, Any]:
    """Describe an edge; unknown or inapplicable values are None."""
    longest = max(log.steps, key=lambda step: step.pause_ns, default=None)
    delays = log.delays_ns
    metres = sum(step.metres for step in log.steps)
    seconds = sum(step.pause_ns for step in log.steps) / BILLION
    speeds = [step.metres / step.pause_ns * BILLION for step in log.steps]
    return {
        "kind": "moving" if log.moves else "static",
        "parent": log.parent,
        "child": log.child,
        "count": log.count,
        "rate_hz": log.rate,
        "first_ns": log.first_ns,
        "last_ns": log.last_ns,
        "gap_s": longest.pause_ns / BILLION if longest else None,
        "gap_until_ns": longest.stamp_ns if longest else None,
        "delay_mean_s": sum(delays) / len(delays) / BILLION if delays else None,
        "delay_max_s": max(delays) / BILLION if delays else None,
        "length_m": metres if log.steps else None,
        "duration_s": seconds if log.steps else None,
        "speed_mean": metres / seconds if log.steps else None,
        "speed_max": max(speeds, default=None),
        "gaps": len(log.gaps()) if log.steps else None,
        "jumps": len(log.jumps()),
        "backward": log.backward,
        "parents": ", ".join(log.parents),
        "parent_changes": log.changes,
        "topics": ", ".join(f"{topic} ({count})" for topic, count in log.topics.items()),
        "overlap": None,
    }


# key -> the value of a chain, from those of its edges
OF_CHAIN: dict[str, Callable[..., Any]] = {
    "count": sum, "rate_hz": min, "gap_s": max, "delay_max_s": max, "jumps": sum, "backward": sum,
    "parent_changes": sum,
}  # fmt: skip


def chain_entry(path: Sequence[str], logs: Sequence[EdgeLog]) -> dict[str, Any]:
    """Describe the edges of a path together: their common interval, and their worst values."""
    spans = [log.span for log in logs if log.moves]
    first, last = (max(begin for begin, _ in spans), min(end for _, end in spans)) if spans else (None, None)
    entries = [edge_entry(log) for log in logs]
    known = {key: [entry[key] for entry in entries if entry[key] is not None] for key in OF_CHAIN}
    worst = {key: OF_CHAIN[key](values) for key, values in known.items() if values}
    return dict.fromkeys(entries[0]) | worst | {
        "kind": "chain",
        "parent": path[0],
        "child": path[-1],
        "first_ns": first,
        "last_ns": last,
        "parents": " <- ".join(path),
        "topics": "",
        "overlap": None if first is None or last is None else first <= last,
    }
