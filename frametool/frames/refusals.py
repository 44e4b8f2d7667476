"""What frames do not accept; and the error of a lookup at a time without data.

That error says which edge lacks them, how far off the time is, and when the whole way has data.
"""

from __future__ import annotations

from math import isfinite

from frametool.errors import BadTopology, NoDataAt, TooEarly, TooLate, ValueInvalid, bare, shown
from frametool.frames.stamps import BILLION, format_stamp

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.edge_log import EdgeLog
    from frametool.frames.track import MovingTrack, StandingTrack, Track
    from frametool.geometry.types import Rigid


def check_edge(parent: str, child: str, components: Rigid) -> None:
    """Refuse an edge that cannot be; raises ValueInvalid, BadTopology."""
    if not parent or not child:
        raise ValueInvalid(f"an edge needs two frames, found parent {shown(parent)} and child {shown(child)}")
    if parent == child:
        raise BadTopology(f"frame {shown(child)} is its own parent", rule="self")
    if not all(map(isfinite, components)):
        numbers = " ".join(map(repr, components))
        raise ValueInvalid(f"the pose of {shown(child)} in {shown(parent)} is not finite: {numbers}")


def check_same(track: StandingTrack, parent: str, components: Rigid) -> None:
    """Refuse a further value of a standing frame, unless it is the same."""
    if parent != track.parent:
        message = f"frame {shown(track.child)} has two parents: {shown(track.parent)} and {shown(parent)}"
        raise BadTopology(message, rule="two-parents")
    if components != track.components:
        message = f"frame {shown(track.child)} has two different poses in {shown(parent)}"
        raise BadTopology(message, rule="two-poses")


def check_age(track: MovingTrack, stamp_ns: int, keep_ns: int) -> None:
    """Refuse a sample older than what a buffer keeps."""
    newest = track.last_ns
    if newest - keep_ns > stamp_ns:
        raise ValueInvalid(
            f"a sample of {shown(track.child)} at {format_stamp(stamp_ns)} is older than the buffer keeps: "
            f"{format_stamp(keep_ns)} s before its newest at {format_stamp(newest)}",
        )


OTHER_CLOCK = 10**8 * BILLION  # three years: beyond, one clock counts from 1970 and the other from its start


def no_data(target: str, source: str, at_ns: int, path: Sequence[Track]) -> NoDataAt:
    """Compose the error for a lookup at a time, blaming the edge that is furthest from it.

    path: the edges between the two frames, from the target to the source.
    """
    moving = [track for track in path if not track.standing]
    worst = max(moving, key=lambda track: gap(track, at_ns))
    first, last = worst.span
    short = gap(worst, at_ns)
    early = at_ns < first
    begin, end = max(track.first_ns for track in moving), min(track.last_ns for track in moving)
    parent = worst.parent_near(at_ns)
    off = f"{seconds(short)} s too {'early' if early else 'late'}"
    cover = f"samples cover {format_stamp(first)} .. {format_stamp(last)}"
    if first == last:
        cover = f"its only sample is at {format_stamp(first)}"
    clocks = "; that is years: one of the clocks counts from 1970, the other does not" if short >= OTHER_CLOCK else ""
    message = (
        f"no data for {bare(parent)} -> {bare(worst.child)} at {format_stamp(at_ns)}; {cover} ({off}), "
        f"{_way(target, source, path)}{_whole(moving, begin, end)}{clocks}"
    )
    return (TooEarly if early else TooLate)(
        message, parent=parent, child=worst.child, at_ns=at_ns, first_ns=first, last_ns=last, short_ns=short,
        short_s=short / BILLION, target=target, source=source, path=frames_on(target, source, path),
        available_from_ns=begin if begin <= end else None, available_until_ns=end if begin <= end else None,
    )  # fmt: skip


def left_out(track: MovingTrack, at_ns: int) -> str:
    """Return the sentence that says why an edge is left out of the tree at a time."""
    return (
        f"{bare(track.parent)} -> {bare(track.child)} is left out: no data at {format_stamp(at_ns)}, "
        f"samples cover {format_stamp(track.first_ns)} .. {format_stamp(track.last_ns)} "
        f"({seconds(gap(track, at_ns))} s off)"
    )


def gap(track: MovingTrack, at_ns: int) -> int:
    """Return how far a time lies outside of a track's samples, in nanoseconds."""
    first, last = track.span
    return max(first - at_ns, at_ns - last, 0)


def seconds(duration_ns: int) -> str:
    """Write a duration in seconds without idle zeros: `0.5`, `3`."""
    return format_stamp(duration_ns).rstrip("0").rstrip(".")


def _way(target: str, source: str, path: Sequence[Track]) -> str:
    """Write the way with arrows from source to target, cut in the middle when it is long."""
    frames = list(map(bare, frames_on(target, source, path)))
    if len(frames) > 13:
        frames = [*frames[:6], f"({len(frames) - 12} more)", *frames[-6:]]
    return f"on the path {' <- '.join(frames)}"


def frames_on(target: str, source: str, path: Sequence[Track | EdgeLog]) -> list[str]:
    """List the frames on a path of edges from target to source, both included."""
    frames = [target]
    for track in path:
        frames.append(track.parent if track.child == frames[-1] else track.child)
    return frames if frames[-1] == source else [*frames, source]


def _whole(moving: Sequence[MovingTrack], begin: int, end: int) -> str:
    """Return the clause that says when all edges have data, or which two never do."""
    if len(moving) == 1:
        return ""
    if begin <= end:
        return f"; the whole path has data from {format_stamp(begin)} until {format_stamp(end)}"
    late = max(moving, key=lambda track: track.first_ns)
    early = min(moving, key=lambda track: track.last_ns)
    ended, begun = (f"{bare(track.parent)} -> {bare(track.child)}" for track in (early, late))
    return f"; {ended} ends at {format_stamp(end)} before {begun} begins at {format_stamp(begin)}: they never overlap"
