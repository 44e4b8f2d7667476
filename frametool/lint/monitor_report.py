"""The report of `monitor`, as plain mappings with units in their keys: one per edge, and one for a chain of edges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import FormatError, Misused, shown
from frametool.formats.load import FrameFile, refuse_unknown_joints
from frametool.frames.edge_log import EdgeLog, chain
from frametool.frames.stamps import BILLION
from frametool.frames.topology import frames_on
from frametool.grammar.edges import stop

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.grammar.edges import Report


def monitor(
    files: Sequence[FrameFile], *ends: str, normalize: bool = False, clashing: Report = stop
) -> list[dict[str, Any]]:
    """Describe every edge of some files; or, for `ends` (target, source), those between the two and their chain.

    clashing: receives the errors about frames on the topics of two robots, whose samples then count as one
    Raises FormatError for files without transforms, UnknownFrame, NotConnected.
    """

    def report(error: FormatError) -> None:
        (clashing if error.rule == "two-topics" else stop)(error)

    logs: dict[str, EdgeLog] = {}
    for file in files:
        for edge in file.edges(report, normalize=normalize):
            if edge.parent is not None:
                log = logs.get(edge.child) or logs.setdefault(edge.child, EdgeLog(edge.child))
                log.add(edge.parent, edge.components, edge.stamp_ns, edge.line, edge.received_ns)
                if edge.topic:
                    log.topics[edge.topic] = log.topics.get(edge.topic, 0) + 1
    refuse_unknown_joints(files)
    if not logs:
        raise FormatError("no transforms in it", source=", ".join(file.name for file in files))
    if not ends:
        return list(map(edge_entry, logs.values()))
    target, source = ends
    if not (between := [logs[child] for child in chain(logs, target, source)]):
        raise Misused(f"no edge is between {shown(target)} and itself; name two frames")
    return [*map(edge_entry, between), chain_entry(target, source, between)]


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


YEAR_S = 31_557_600


def clocks_differ(entries: Sequence[dict[str, Any]]) -> bool:
    """Return True if stamps and the recorder count from different years: with simulated time a delay has no meaning."""
    return any(abs(entry["delay_max_s"] or 0.0) > YEAR_S for entry in entries)


# of the values of its edges, that of a chain
OF_CHAIN: dict[str, Callable[..., Any]] = {
    "count": sum, "rate_hz": min, "gap_s": max, "delay_max_s": max, "jumps": sum, "backward": sum,
    "parent_changes": sum,
}  # fmt: skip


def chain_entry(target: str, source: str, logs: Sequence[EdgeLog]) -> dict[str, Any]:
    """Describe the edges between two frames together: their common interval, and their worst values."""
    spans = [log.span for log in logs if log.moves]
    first, last = (max(begin for begin, _ in spans), min(end for _, end in spans)) if spans else (None, None)
    entries = [edge_entry(log) for log in logs]
    known = {key: [entry[key] for entry in entries if entry[key] is not None] for key in OF_CHAIN}
    worst = {key: OF_CHAIN[key](values) for key, values in known.items() if values}
    return dict.fromkeys(entries[0]) | worst | {
        "kind": "chain",
        "parent": target,
        "child": source,
        "first_ns": first,
        "last_ns": last,
        "parents": " <- ".join(frames_on(target, source, logs)),
        "topics": "",
        "overlap": None if first is None or last is None else first <= last,
    }
