"""The rules and words of tf2's buffer, ROS 1 (0.7.6) and ROS 2 (0.39), for those who compare.

What is refused, what a repeated stamp means, which edge an error blames, and every text, to the blank.
"""

from __future__ import annotations

from math import isnan, nan, sqrt
from typing import TYPE_CHECKING

from frametool.errors import BadTopology, LookupFailed, NotConnected, UnknownFrame
from frametool.frames.path import to_root
from frametool.frames.policy import BufferPolicy, Refused
from frametool.frames.stamps import BILLION
from frametool.geometry import quaternion

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack, StandingTrack, Track
    from frametool.geometry.types import Rigid

TEN_SECONDS = 10 * BILLION
LENGTH_TOLERANCE = 0.01  # of the squared norm
EXPLAINED = "listed at http://wiki.ros.org/tf/Errors%20explained"
MOST_EDGES = 1000


class Ros1(BufferPolicy):
    """tf2 of ROS 1: the first insert decides whether a frame stands, the first sample of a stamp wins."""

    zero_counts = False
    refuses_cycles = False
    default_keep_ns = TEN_SECONDS
    between = 'with frame_id and child_frame_id  "'

    def admit(self, parent: str, child: str, components: Rigid, authority: str) -> tuple[str, str, Rigid]:
        """Strip one slash of each name; refuse with every complaint at once."""
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        components = self.received(components)
        lines = list(self._complaints(parent, child, components, authority))
        if lines:
            raise Refused("Error:", *lines)
        return parent, child, _unit(components)

    def received(self, components: Rigid) -> Rigid:
        """Return the numbers as they come out of the message."""
        return components

    def _complaints(self, parent: str, child: str, components: Rigid, authority: str) -> list[str]:
        """Return what tf2 logs of names and numbers, in its order."""
        start = f'Ignoring transform for child_frame_id "{child}" from authority "{authority}" because of'
        position, rotation = (" ".join(map("{:f}".format, part)) for part in (components[:3], components[3:]))
        off = abs(sum(value * value for value in components[3:]) - 1.0)
        lines = []
        if child == parent:
            lines.append(
                f'TF_SELF_TRANSFORM: Ignoring transform from authority "{authority}" {self.between}{child}" '
                "because they are the same",
            )
        if not child:
            unset = f'from authority "{authority}" because child_frame_id not set '
            lines.append(f"TF_NO_CHILD_FRAME_ID: Ignoring transform {unset}")
        if not parent:
            unset = f'with child_frame_id "{child}"  from authority "{authority}" because frame_id not set'
            lines.append(f"TF_NO_FRAME_ID: Ignoring transform {unset}")
        if any(map(isnan, components)):
            lines.append(f"TF_NAN_INPUT: {start} a nan value in the transform ({position}) ({rotation})")
        if not off < LENGTH_TOLERANCE:
            lines.append(f"TF_DENORMALIZED_QUATERNION: {start} an invalid quaternion in the transform ({rotation})")
        return lines

    def settle_kind(self, track: Track, *, standing: bool) -> bool:  # noqa: ARG002 - the first decides
        """Keep the kind of the first."""
        return track.standing

    def stand(self, track: StandingTrack, parent: str, components: Rigid) -> None:
        """Overwrite the value."""
        track.parent, track.components = parent, components

    def refuse_old(self, track: MovingTrack, stamp_ns: int, keep_ns: int, authority: str) -> None:
        """Refuse what is older than the cache."""
        if track.last_ns - keep_ns > stamp_ns:
            raise Refused("Warning:", *self.old(_received(track.child, stamp_ns, authority)))

    def old(self, what: str) -> tuple[str, ...]:
        """Return the words for data from the past."""
        return (f"TF_OLD_DATA ignoring data from the past (Possible reasons are {EXPLAINED}) {what}",)

    def repeat(
        self, track: MovingTrack, stamp_ns: int, parent: str, components: Rigid, authority: str,  # noqa: ARG002
    ) -> bool:
        """Refuse a second sample of a stamp."""
        what = _received(track.child, stamp_ns, authority)
        raise Refused("Warning:", f"TF_REPEATED_DATA ignoring data with redundant timestamp {what}")

    def is_bad_name(self, name: str) -> bool:
        """Return whether a name cannot be asked for at all."""
        return not name or name.startswith("/")

    def unknown(self, name: str, role: str, buffer: Frames) -> LookupFailed:
        """Report a frame that does not exist, or a name that cannot."""
        error = UnknownFrame(name, known=buffer.frames, where=buffer.name)
        argument = f"passed to lookupTransform argument {role}"
        text = self.invalid(name, argument) if self.is_bad_name(name) else f'"{name}" {argument} does not exist. '
        error.args = (text,)
        return error

    def invalid(self, name: str, argument: str) -> str:
        """Return the words for an empty name or one with a slash."""
        if not name:
            return f"Invalid argument {argument} in tf2 frame_ids cannot be empty"
        return f"Invalid argument \"{name}\" {argument} in tf2 frame_ids cannot start with a '/' like: "

    def unconnected(
        self, buffer: Frames, error: NotConnected, target: str, source: str, at_ns: int | None
    ) -> LookupFailed:
        """Report two frames of different trees, unless the search ends before it could tell: then the lack of data."""
        if at_ns is not None and _blamed(buffer, target, source, at_ns) is not None:
            return self.missing(buffer, target, source, at_ns, [])
        return NotConnected(
            f"Could not find a connection between '{target}' and '{source}' because they are not part of the same tree."
            "Tf has two or more unconnected trees.",
            **error.fields,
        )

    def looped(
        self, buffer: Frames, error: BadTopology, target: str, source: str, at_ns: int | None
    ) -> tuple[list[str], list[str]]:
        """Find the way as far as tf2 does, which stops once it meets the other end; else say that there is a loop."""
        up, down = (_climb(buffer, *ends, at_ns) for ends in ((source, target), (target, source)))
        if up is None and down is None:
            raise _loop(buffer) from error
        return ([], up) if up is not None else ((down or [])[::-1], [])

    def refuse_depth(self, buffer: Frames, target: str, source: str, at_ns: int | None) -> None:
        """Take a way of more than a thousand edges for a loop, on the source's side first."""
        for frame, other in ((source, target), (target, source)):
            line = to_root(frame, lambda each: buffer.parent(each, at_ns))
            met = other in line
            if (line.index(other) if met else len(line) - 1) > MOST_EDGES:
                raise _loop(buffer)
            if met:
                return

    def missing(self, buffer: Frames, target: str, source: str, at_ns: int, way: list[Track]) -> LookupFailed:
        """Blame the edge that tf2 blames."""
        track = _blamed(buffer, target, source, at_ns)
        error = super().missing(buffer, target, source, at_ns, way or [track] if track is not None else way)
        if track is not None:
            ends = f", when looking up transform from frame [{source}] to frame [{target}]"
            error.args = (self.extrapolation(track, at_ns) + ends,)
        return error

    def extrapolation(self, track: MovingTrack, at_ns: int) -> str:
        """Return the words for a time outside of an edge's samples."""
        first, last = track.span
        if track.count == 1:
            return (
                f"Lookup would require extrapolation at time {self.seconds(at_ns)}, "
                f"but only time {self.seconds(first)} is in the buffer"
            )
        when, end, there = ("future", "latest", last) if at_ns > last else ("past", "earliest", first)
        return (
            f"Lookup would require extrapolation {self.amount(abs(at_ns - there))}into the {when}.  "
            f"Requested time {self.seconds(at_ns)} but the {end} data is at time {self.seconds(there)}"
        )

    def seconds(self, stamp_ns: int) -> str:
        """Write a time as ROS 1 does: as a double."""
        return f"{_double(stamp_ns):.9f}"

    def amount(self, duration_ns: int) -> str:
        """Write how much is missing."""
        return f"{_double(duration_ns):.9f}s "


class Ros2(Ros1):
    """tf2 of ROS 2: any quaternion is normalised, the last insert decides the kind, differing repeats are kept."""

    between = 'with frame_id and  child_frame_id "'
    listing_decimals = 6
    prunes_first = True  # what is over age then lives on until the next sample

    def received(self, components: Rigid) -> Rigid:
        """Normalise the quaternion, as the way through a matrix does; of zero only nan is left."""
        tx, ty, tz, x, y, z, w = components
        norm = sqrt(x * x + y * y + z * z + w * w)
        if norm == 0.0:
            return tx, ty, tz, nan, nan, nan, nan
        return tx, ty, tz, x / norm, y / norm, z / norm, w / norm

    def settle_kind(self, track: Track, *, standing: bool) -> bool:  # noqa: ARG002 - the last decides
        """Switch the kind; the old samples are thrown away."""
        return standing

    def old(self, what: str) -> tuple[str, ...]:
        """Return the words for data from the past."""
        return f"TF_OLD_DATA ignoring data from the past {what}", f"Possible reasons are {EXPLAINED}"

    def repeat(
        self, track: MovingTrack, stamp_ns: int, parent: str, components: Rigid, authority: str,  # noqa: ARG002
    ) -> bool:
        """Drop an exact duplicate; keep other data too, the later insert as the lower bound."""
        if (parent, components) not in track.samples_at(stamp_ns):
            track.add(stamp_ns, parent, components)
        return False

    def invalid(self, name: str, argument: str) -> str:
        """Return the words for an empty name or one with a slash."""
        reason = "start with a '/'" if name else "be empty"
        return f'Invalid argument "{name}" {argument} - in tf2 frame_ids cannot {reason}'

    def seconds(self, stamp_ns: int) -> str:
        """Write a time as ROS 2 does: six decimals of a double."""
        return f"{stamp_ns / BILLION:f}"

    def amount(self, duration_ns: int) -> str:  # noqa: ARG002
        """Leave out how much is missing."""
        return ""


TF2: dict[str, BufferPolicy] = {"ros1": Ros1(), "ros2": Ros2()}


def _loop(buffer: Frames) -> LookupFailed:
    """Report what tf2 takes for a loop, with all frames."""
    known = (f"Frame {track.child} exists with parent {track.parent}." for track in buffer.tracks())
    error = LookupFailed("\n".join(("The tf tree is invalid because it contains a loop.", *known, "")))
    error.many_lines = True
    return error


def _blamed(buffer: Frames, target: str, source: str, at_ns: int) -> MovingTrack | None:
    """Walk as tf2 does: up from the source until data end, then up from the target until the walks meet.

    Returns the first edge on the target's side without data, else the one that ended the source's walk.
    """
    top, failed = _walk(buffer, source, target, at_ns)
    _, blamed = _walk(buffer, target, top, at_ns)
    return blamed or failed


def _walk(buffer: Frames, frame: str, stop: str, at_ns: int) -> tuple[str, MovingTrack | None]:
    """Go up from a frame to `stop`, to the root or to the first edge without data; return the end and that edge."""
    for _ in range(MOST_EDGES):
        track = buffer.track(frame)
        if frame == stop or track is None:
            break
        if not track.standing and not track.covers(at_ns):
            return frame, track
        parent = track.parent_at(at_ns)
        frame = frame if parent is None else parent
    return frame, None


def _climb(buffer: Frames, frame: str, stop: str, at_ns: int | None) -> list[str] | None:
    """List the frames from one up to just below `stop`; None if it is not met."""
    line: list[str] = []
    while frame != stop and len(line) <= MOST_EDGES:
        line.append(frame)
        parent = buffer.parent(frame, at_ns)
        if parent is None:
            return None
        frame = parent
    return line if frame == stop else None


def _unit(components: Rigid) -> Rigid:
    """Return the pose with its quaternion unit: tf2 keeps it as given, half a percent off at most."""
    squared = sum(value * value for value in components[3:])
    if abs(squared - 1.0) <= quaternion.UNIT:
        return components
    norm = sqrt(squared)
    tx, ty, tz, x, y, z, w = components
    return tx, ty, tz, x / norm, y / norm, z / norm, w / norm


def _received(child: str, stamp_ns: int, authority: str) -> str:
    return f"for frame {child} at time {stamp_ns / BILLION:f} according to authority {authority}"


def _double(duration_ns: int) -> float:
    """Return seconds as ROS 1 computes them: whole seconds and 1e-9 times the rest, summed as doubles."""
    whole, rest = divmod(duration_ns, BILLION)
    return whole + 1e-9 * rest
