"""Moving frames: a buffer of transforms with lookups at any time, with the results of tf2's buffer, without ROS."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid, shown, warn
from frametool.frames import topology
from frametool.frames.lookups import Frames, taken
from frametool.frames.stamps import FURTHEST_NS, format_stamp, whole_stamp
from frametool.frames.track import MovingTrack, StaticTransform

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from frametool.geometry import Rigid
    from frametool.geometry.transform import Transform


class TransformBuffer(Frames):
    """Store transforms over time; look up the pose of one frame in another at any time.

    Stamps are integer nanoseconds, in any order. Between two samples translations are interpolated linearly and
    rotations by slerp, edge by edge. Nothing is pruned unless `keep_ns` is set. The latest time is None; 0 is a time.

        buffer = TransformBuffer()
        buffer.insert("map", "base", map_from_base, 1_700_000_000_000_000_000)
        buffer.insert("base", "camera", base_from_camera)                 # no stamp: static
        buffer.lookup("map", "camera", 1_700_000_000_000_000_000)         # map_from_camera then; default: latest
    """

    def __init__(self, *, keep_ns: int | None = None, name: str = "") -> None:
        """Create an empty buffer.

        keep_ns: drop samples older than this before each frame's newest sample; None keeps everything.
        name: of the source of the frames, for error messages.
        """
        super().__init__(name)
        self.keep_ns = keep_ns

    @property
    def moves(self) -> bool:  # type: ignore[override]
        """Return True if any frame moves."""
        return any(not track.is_static for track in self._tracks.values())

    def insert(
        self, parent: str, child: str, transform: Transform, stamp_ns: int | None = None, *,
        static: bool | None = None, covariance: Any = None,
    ) -> None:  # fmt: skip
        """Add parent_from_child, the pose of the child in its parent, at a time; without a time the frame is static.

        static: marks a static frame although it has a stamp, which is ignored.
        covariance: of the edge, the same for all its samples, passed with any of them; None changes nothing.
        A different pose at an existing stamp replaces the old one, with a warning.
        Raises ValueInvalid; BadTopology for two static poses or covariances, a static frame that moves, a cycle.
        """
        parent, child = self.resolve_name(parent), self.resolve_name(child)
        components, found = taken(transform, covariance)
        if found and (known := self.covariances.get(child, found)) != found:
            raise topology.two_covariances(parent, child, known, found)
        if self.insert_components(parent, child, components, stamp_ns, static=static):
            warn(f"frame {shown(child)} has two different poses at {format_stamp(stamp_ns or 0)}; the last one holds")
        if found:
            self.covariances[child] = found

    def insert_components(
        self, parent: str, child: str, components: Rigid, stamp_ns: int | None = None, *,
        static: bool | None = None,
    ) -> bool:  # fmt: skip
        """Add tx, ty, tz (metres), x, y, z, w (unit quaternion); otherwise as `insert`.

        Returns True if other data at the same stamp were replaced; the caller may know where both were written.
        """
        track = self._tracks.get(child)
        if (
            self.keep_ns is None and track is not None and type(stamp_ns) is int and not static and not track.is_static
            and track.parent == parent and -FURTHEST_NS < stamp_ns < FURTHEST_NS
            and -1e300 < sum(components) < 1e300  # finite
            and (track.last_ns < stamp_ns or not track.has(stamp_ns))
        ):  # fmt: skip
            track.add(stamp_ns, parent, components)
            return False
        if not parent or not child:
            raise ValueInvalid(f"an edge needs two frames, found parent {shown(parent)} and child {shown(child)}")
        if parent == child:
            raise topology.own_parent(child)
        if not all(map(isfinite, components)):
            numbers = " ".join(map(repr, components))
            raise ValueInvalid(f"the pose of {shown(child)} in {shown(parent)} is not finite: {numbers}")
        static = stamp_ns is None if static is None else static
        stamp = 0 if stamp_ns is None else whole_stamp(stamp_ns)
        if track is not None and track.is_static != static:
            raise topology.static_and_moving(child)
        replaced = False
        if track is None:
            self._refuse_cycle(parent, child, stamp, static=static)
            pose = StaticTransform(child, parent, components)
            self._put(pose if static else MovingTrack(child, stamp, parent, components))
        elif track.is_static:
            topology.check_same(child, (track.parent, track.components), (parent, components))
        else:
            replaced = self._move(track, parent, components, stamp)
        self._frames[parent] = None
        return replaced

    def insert_many(self, parent: str, child: str, stamps_ns: Sequence[int], components: Sequence[Rigid]) -> None:
        """Add poses of a moving frame in ascending order of time, all later than the samples it already has.

        Equivalent to `insert_components`, and much faster.  If a rule or `keep_ns` requires a check of each pose, they
        are added one by one.
        """
        self.insert_components(parent, child, components[0], stamps_ns[0])
        track = self._tracks[child]
        within = stamps_ns[0] > -FURTHEST_NS and stamps_ns[-1] < FURTHEST_NS
        if self.keep_ns is not None or track.is_static or not within or not all(map(isfinite, map(sum, components))):
            for stamp_ns, each in zip(stamps_ns[1:], components[1:], strict=True):
                self.insert_components(parent, child, each, stamp_ns)
        else:
            track.extend(stamps_ns[1:], components[1:])

    def _move(self, track: MovingTrack, parent: str, components: Rigid, stamp_ns: int) -> bool:
        """Add a further sample of a moving frame; return True if it replaced another one."""
        if self.keep_ns is not None and track.last_ns - self.keep_ns > stamp_ns:
            raise ValueInvalid(
                f"a sample of {shown(track.child)} at {format_stamp(stamp_ns)} is older than the buffer keeps: "
                f"{format_stamp(self.keep_ns)} s before its newest at {format_stamp(track.last_ns)}",
            )
        if track.has(stamp_ns):
            known = track.sample_at(stamp_ns)
            if known == (parent, components):
                return False
            self._varies = self._varies or parent != known[0]
            self._queries.clear()
            track.replace(stamp_ns, parent, components)
            return True
        if parent != track.parent:
            self._refuse_cycle(parent, track.child, stamp_ns, static=False)
            self._varies = True
            self._queries.clear()
        track.add(stamp_ns, parent, components)
        if self.keep_ns is not None:
            track.drop_before(track.last_ns - self.keep_ns)
        return False

    def _refuse_cycle(self, parent: str, child: str, stamp_ns: int, *, static: bool) -> None:
        """Raise BadTopology if the child is an ancestor of its parent at the same time."""
        if child not in self._frames:
            return
        line = [parent]
        while (track := self._tracks.get(line[-1])) is not None:
            at_stamp = not static and track.covers(stamp_ns) and track.parent_at(stamp_ns) == track.parent
            if not (track.is_static or at_stamp):  # it has no data under its newest parent then
                return
            line.append(track.parent)
            if line[-1] == child:
                raise topology.cycle([*line, parent])
            if len(line) > len(self._tracks):
                return  # a cycle of other frames, whose edges were valid at different times when they were added

    def make_static(self, frame: str) -> None:
        """Make a moving frame static, with the pose of its newest sample."""
        moved = self._tracks[frame]
        self._put(StaticTransform(frame, moved.parent, moved.components))

    def __repr__(self) -> str:
        """Return how many frames and samples there are."""
        samples = sum(track.count for track in self._tracks.values())
        return f"TransformBuffer({len(self._frames)} frames, {samples} samples)"
