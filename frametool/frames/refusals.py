"""The error of a lookup at a time without data: which edge has none, the distance in time, and what has data."""

from __future__ import annotations

from frametool.errors import NoDataAt, TooEarly, TooLate, bare
from frametool.frames.stamps import BILLION, format_stamp

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.edge_log import EdgeLog
    from frametool.frames.track import MovingTrack, Track


OTHER_CLOCK = 10**8 * BILLION  # three years: beyond it, only one of two clocks counts from 1970


def no_data(target: str, source: str, at_ns: int, path: Sequence[Track]) -> NoDataAt:
    """Return the error for a lookup at a time; it names the edge whose data are furthest from it.

    path: the edges between the two frames, from the target to the source.
    """
    moving = [track for track in path if not track.is_static]
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
    """Return the reason why an edge is omitted from the tree at a time."""
    return (
        f"{bare(track.parent)} -> {bare(track.child)} is left out: no data at {format_stamp(at_ns)}, "
        f"samples cover {format_stamp(track.first_ns)} .. {format_stamp(track.last_ns)} "
        f"({seconds(gap(track, at_ns))} s off)"
    )


def gap(track: MovingTrack, at_ns: int) -> int:
    """Return the distance of a time from a track's samples, in nanoseconds."""
    first, last = track.span
    return max(first - at_ns, at_ns - last, 0)


def seconds(duration_ns: int) -> str:
    """Format a duration in seconds without trailing zeros: `0.5`, `3`."""
    return format_stamp(duration_ns).rstrip("0").rstrip(".")


def _way(target: str, source: str, path: Sequence[Track]) -> str:
    """Format the path with arrows from source to target, shortened in the middle if it is long."""
    frames = list(map(bare, frames_on(target, source, path)))
    if len(frames) > 13:
        frames = [*frames[:6], f"({len(frames) - 12} more)", *frames[-6:]]
    return f"on the path {' <- '.join(frames)}"


def frames_on(target: str, source: str, path: Sequence[Track | EdgeLog]) -> list[str]:
    """Return the frames on a path of edges from target to source, both included."""
    frames = [target]
    for track in path:
        frames.append(track.parent if track.child == frames[-1] else track.child)
    return frames if frames[-1] == source else [*frames, source]


def _whole(moving: Sequence[MovingTrack], begin: int, end: int) -> str:
    """Return the clause that states when all edges have data, or which two never do."""
    if len(moving) == 1:
        return ""
    if begin <= end:
        return f"; the whole path has data from {format_stamp(begin)} until {format_stamp(end)}"
    late = max(moving, key=lambda track: track.first_ns)
    early = min(moving, key=lambda track: track.last_ns)
    ended, begun = (f"{bare(track.parent)} -> {bare(track.child)}" for track in (early, late))
    return f"; {ended} ends at {format_stamp(end)} before {begun} begins at {format_stamp(begin)}: they never overlap"
