"""What a buffer accepts, and the words of its refusals: frametool's own; those of tf2 are in `frametool.frames.tf2`.

Here too is the error of a lookup at a time without data: which edge, how far off, and when the whole way has data.
"""

from __future__ import annotations

from math import isfinite

from frametool.errors import BadTopology, NoDataAt, TooEarly, TooLate, UnknownFrame, ValueInvalid, bare, shown
from frametool.frames.path import edges_between
from frametool.frames.stamps import BILLION, format_stamp

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.errors import LookupFailed, NotConnected
    from frametool.frames.edge_log import EdgeLog
    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack, StandingTrack, Track
    from frametool.geometry.types import Rigid


class Refused(ValueInvalid):
    """A transform that tf2 would log and drop; `lines` are what it logs, with console_bridge's level."""

    def __init__(self, level: str, *lines: str) -> None:
        """Keep the lines as they are logged."""
        super().__init__("\n".join(lines))
        self.lines = [f"{level:<9}{line}" for line in lines]


class BufferPolicy:
    """The rules of a buffer and the words of its refusals; these here are frametool's, the stricter ones."""

    zero_counts = True  # whether a newest stamp of 0 is a time like any other
    refuses_cycles = True
    prunes_first = False  # whether old samples go before a new one comes, and not after
    listing_decimals = 3  # of stamps, where frames are listed
    default_keep_ns: int | None = None

    def admit(
        self, parent: str, child: str, components: Rigid, authority: str,  # noqa: ARG002 - tf2's words name it
    ) -> tuple[str, str, Rigid]:
        """Return names and numbers as they are kept.

        Raises ValueInvalid, BadTopology.
        """
        if not parent or not child:
            raise ValueInvalid(f"an edge needs two frames, found parent {shown(parent)} and child {shown(child)}")
        if parent == child:
            raise BadTopology(f"frame {shown(child)} is its own parent", rule="self")
        if not all(map(isfinite, components)):
            numbers = " ".join(map(repr, components))
            raise ValueInvalid(f"the pose of {shown(child)} in {shown(parent)} is not finite: {numbers}")
        return parent, child, components

    def settle_kind(self, track: Track, *, standing: bool) -> bool:
        """Return whether a further sample counts as standing."""
        if track.standing != standing:
            raise BadTopology(f"frame {shown(track.child)} both stands still and moves", rule="static-and-moving")
        return standing

    def stand(self, track: StandingTrack, parent: str, components: Rigid) -> None:
        """Take a further value of a standing frame: only the same."""
        if parent != track.parent:
            message = f"frame {shown(track.child)} has two parents: {shown(track.parent)} and {shown(parent)}"
            raise BadTopology(message, rule="two-parents")
        if components != track.components:
            message = f"frame {shown(track.child)} has two different poses in {shown(parent)}"
            raise BadTopology(message, rule="two-poses")

    def refuse_old(self, track: MovingTrack, stamp_ns: int, keep_ns: int, authority: str) -> None:  # noqa: ARG002
        """Refuse a sample older than what a buffer keeps."""
        newest = track.last_ns
        if newest - keep_ns > stamp_ns:
            raise ValueInvalid(
                f"a sample of {shown(track.child)} at {format_stamp(stamp_ns)} is older than the buffer keeps: "
                f"{format_stamp(keep_ns)} s before its newest at {format_stamp(newest)}",
            )

    def repeat(
        self, track: MovingTrack, stamp_ns: int, parent: str, components: Rigid, authority: str,  # noqa: ARG002
    ) -> bool:
        """Take a further sample of a stamp: the last one holds.  Returns whether other data were replaced."""
        if track.samples_at(stamp_ns)[-1] == (parent, components):
            return False
        track.replace(stamp_ns, parent, components)
        return True

    def unknown(self, name: str, role: str, buffer: Frames) -> LookupFailed:  # noqa: ARG002
        """Report a frame nobody has heard of."""
        return UnknownFrame(name, known=buffer.frames, where=buffer.name)

    def is_bad_name(self, name: str) -> bool:  # noqa: ARG002
        """Return whether a name cannot be asked for at all."""
        return False

    def unconnected(
        self, buffer: Frames, error: NotConnected, target: str, source: str, at_ns: int | None,  # noqa: ARG002
    ) -> LookupFailed:
        """Report two frames of different trees."""
        return error

    def looped(
        self, buffer: Frames, error: BadTopology, target: str, source: str, at_ns: int | None,
    ) -> tuple[list[str], list[str]]:  # fmt: skip
        """Find the way where the newest parents form a circle: only by parents known at the very time."""
        if at_ns is None:
            raise error
        return edges_between(target, source, lambda frame: _parent_exactly(buffer, frame, at_ns))

    def refuse_depth(self, buffer: Frames, target: str, source: str, at_ns: int | None) -> None:
        """Refuse ways that are too long: none is."""

    def missing(
        self, buffer: Frames, target: str, source: str, at_ns: int, way: list[Track],  # noqa: ARG002
    ) -> LookupFailed:
        """Report that an edge on the way has no data at a time."""
        return no_data(target, source, at_ns, way)


def _parent_exactly(buffer: Frames, frame: str, at_ns: int) -> str | None:
    """Return a frame's parent only if it has data at a time."""
    track = buffer.track(frame)
    return track.parent_at(at_ns) if track is not None and track.covers(at_ns) else None


FRAMETOOL = BufferPolicy()


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
