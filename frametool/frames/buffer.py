"""Frames that move: transforms in, any lookup at any time out, as tf2's buffer answers it, without ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import BadTopology, LookupFailed, NotConnected, ValueInvalid, warn
from frametool.frames.path import edges_between, to_root
from frametool.frames.query import Plan
from frametool.frames.stamps import format_stamp
from frametool.frames.track_store import TrackStore, policy_named, whole_stamp
from frametool.geometry import rigid
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from frametool.frames.track import Track
    from frametool.geometry.types import Rigid

MOST_PLANS = 1 << 14


class TransformBuffer(TrackStore):
    """Hold transforms over time; answer where one frame is seen from another, and when.

    Stamps are integer nanoseconds, in any order. Between two samples translations are interpolated along the line and
    rotations by slerp, edge by edge. Nothing is pruned unless `keep_ns` says so. The latest time is None; 0 is a time.

        buffer = TransformBuffer()
        buffer.insert("map", "base", map_from_base, 1_700_000_000_000_000_000)
        buffer.insert("base", "camera", base_from_camera)                 # no stamp: stands still
        buffer.lookup("map", "camera", 1_700_000_000_000_000_000)         # map_from_camera then; without a time: latest
    """

    def __init__(self, *, keep_ns: int | None = None, policy: str = "frametool", name: str = "") -> None:
        """Begin an empty buffer.

        keep_ns: keep only so much before each frame's newest sample; None keeps everything.
        policy: "ros1" and "ros2" accept, refuse and complain as tf2 does, and keep 10 s unless told.
        name: says in error messages where the frames come from.
        """
        super().__init__(policy=policy_named(policy), keep_ns=keep_ns, name=name)
        self._plans: dict[tuple[str, str], Plan] = {}
        self._loops = False  # whether newest parents were found to form a circle

    def insert(
        self, parent: str, child: str, transform: Transform, stamp_ns: int | None = None, *,
        static: bool | None = None, authority: str = "default_authority",
    ) -> None:  # fmt: skip
        """Add parent_from_child, the pose of the child in its parent, at a time; without a time the frame stands still.

        static: says so where a standing frame comes with a stamp, which is then ignored.  authority: for tf2's words.
        A different pose at a stamp that is already there replaces the old one, with a warning.
        Raises ValueInvalid; BadTopology for two standing poses, standing and moving at once, a cycle.
        """
        components = transform.components
        if type(components[6]) is not float and transform.shape:
            raise ValueInvalid(f"insert takes one transform, found {len(transform)}; insert them one by one")
        if self.insert_components(parent, child, components, stamp_ns, static=static, authority=authority):
            warn(f"frame {child!r} has two different poses at {format_stamp(stamp_ns or 0)}; the last one holds")

    def _changed(self) -> None:
        self._plans.clear()

    def parent_exactly(self, frame: str, at_ns: int) -> str | None:
        """Return a frame's parent only if it has data at a time."""
        track = self._tracks.get(frame)
        known = track is not None and (track.standing or track.index(at_ns) is not None)
        return track.parent_at(at_ns) if track is not None and known else None

    def lookup(self, target: str, source: str, at_ns: int | None = None) -> Transform:
        """Return target_from_source: the pose of source in target, which maps points in source to points in target.

        at_ns: the time; None is the latest that all edges of the path have reached.
        Raises UnknownFrame (also for a frame against itself), NotConnected, TooEarly, TooLate.
        """
        return Transform.of(*self.lookup_components(target, source, at_ns))

    def lookup_components(self, target: str, source: str, at_ns: int | None = None) -> Rigid:
        """Return tx, ty, tz, x, y, z, w of target_from_source; otherwise as `lookup`."""
        plan = self._plans.get((target, source))
        if plan is None:
            plan = self._plan(target, source, at_ns)
        if plan.fixed is not None:
            return plan.fixed
        if at_ns is None:
            at_ns = plan.latest(zero_counts=self.policy.zero_counts) or 0
        found = plan.at(at_ns if type(at_ns) is int else whole_stamp(at_ns))
        if found is None:
            raise self.policy.missing(self, target, source, at_ns, self.way(target, source, at_ns))
        return found

    def latest(self, target: str, source: str) -> int | None:
        """Return the latest stamp that all moving edges of the newest path have reached; None if none moves.

        Of a frame against itself it is that frame's own newest stamp.
        Raises UnknownFrame, NotConnected.
        """
        newest = self.plan(target, source, None).latest(zero_counts=self.policy.zero_counts)
        own = self._tracks.get(source) if target == source else None
        return own.stamps[-1] if own is not None and not own.standing else newest

    def lookup_across(
        self, target: str, target_at_ns: int | None, source: str, source_at_ns: int | None, fixed: str,
    ) -> Transform:  # fmt: skip
        """Return the pose that source had at one time, seen from where target was at another.

        fixed: a frame that counts as standing in between, e.g. the map.  A time of None is that half's latest.
        Raises as `lookup`.
        """
        for frame, role in ((target, "target_frame"), (source, "source_frame"), (fixed, "fixed_frame")):
            self._require(frame, role)
        fixed_from_source = self.lookup_components(fixed, source, source_at_ns)
        target_from_fixed = self.lookup_components(target, fixed, target_at_ns)
        return Transform.of(*rigid.compose(*target_from_fixed, *fixed_from_source))

    def lookup_many(self, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
        """Return target_from_source at many times: a batch of the times' shape.

        at_ns: integer nanoseconds, an array or a sequence.  missing: "raise" at the first time without data, as
        `lookup` does, or "nan" for rows of NaN there.
        """
        from frametool.frames.lookup_many import lookup_many

        return lookup_many(self, target, source, at_ns, missing=missing)

    def path(self, target: str, source: str, at_ns: int | None = None) -> list[str]:
        """List the frames on the way from target to source, both included, at a time or by the newest parents.

        Raises UnknownFrame, NotConnected.
        """
        down, up = self.between(target, source, at_ns)
        top = self.parent(up[-1] if up else down[0], at_ns) if up or down else source
        return [*reversed(down), str(top), *reversed(up)]

    def way(self, target: str, source: str, at_ns: int | None = None) -> list[Track]:
        """List the edges between two frames, from the target to the source; otherwise as `path`."""
        down, up = self.between(target, source, at_ns)
        return [self._tracks[child] for child in (*reversed(down), *reversed(up))]

    def span(self, target: str, source: str) -> tuple[int, int] | None:
        """Return the first and last time at which every moving edge of the newest path has data; None if none moves.

        They never overlap where the first is after the last.
        """
        moving = [track.span for track in self.way(target, source) if not track.standing]
        return (max(first for first, _ in moving), min(last for _, last in moving)) if moving else None

    def changes(self) -> list[int]:
        """List the stamps, sorted, at which a frame whose parent changes gets another one, or begins, or has ended."""
        stamps: set[int] = set()
        for track in self._tracks.values() if self._varies else ():
            if track.varies or (self._loops and not track.standing):
                pairs = zip(track.parents, track.parents[1:], track.stamps[1:], strict=False)
                stamps.update(stamp for before, after, stamp in pairs if before != after)
                stamps.update((track.stamps[0], track.stamps[-1] + 1))
        return sorted(stamps)

    def plan(self, target: str, source: str, at_ns: int | None) -> Plan:
        """Return the way between two frames as it is at a time, or by the newest parents."""
        return self._plans.get((target, source)) or self._plan(target, source, at_ns)

    def _plan(self, target: str, source: str, at_ns: int | None) -> Plan:
        """Find the way; keep it if no parent on it ever changes."""
        plan = self.plan_of(*self.between(target, source, at_ns))
        if not self._varies or not (self._changes_above(target) or self._changes_above(source)):
            if len(self._plans) >= MOST_PLANS:
                self._plans.clear()
            self._plans[target, source] = plan
        return plan

    def plan_of(self, down: Sequence[str], up: Sequence[str]) -> Plan:
        """Make the plan of a way that `between` named."""
        tracks = self._tracks
        return Plan([tracks[child] for child in down], [tracks[child] for child in reversed(up)])

    def _changes_above(self, frame: str) -> bool:
        """Say whether a frame or an ancestor of it ever changes its parent."""
        if self._loops:
            return True
        return any(frame in self._tracks and self._tracks[frame].varies for frame in to_root(frame, self.parent))

    def between(self, target: str, source: str, at_ns: int | None) -> tuple[list[str], list[str]]:
        """Name the edges between two frames that both exist, as `edges_between` does."""
        self.require(target, source)

        try:
            found = edges_between(target, source, lambda frame: self.parent(frame, at_ns))
        except NotConnected as error:
            raise self._unconnected(error, target, source, at_ns) from None
        except BadTopology as error:
            self._loops = self._varies = True
            return self.policy.looped(self, error, target, source, at_ns)
        self.policy.refuse_depth(self, target, source, at_ns)
        return found

    def require(self, target: str, source: str) -> None:
        """Raise UnknownFrame unless both frames are there."""
        self._require(target, "target_frame")
        self._require(source, "source_frame")

    def _require(self, frame: str, role: str) -> None:
        if frame not in self._frames or self.policy.is_bad_name(frame):
            raise self.policy.unknown(frame, role, self)

    def _unconnected(self, error: NotConnected, target: str, source: str, at_ns: int | None) -> LookupFailed:
        """Tell two trees from one whose changing parent is not known at a time."""
        if at_ns is not None and self._varies:
            try:
                down, up = edges_between(target, source, lambda frame: self._parent_near(frame, at_ns))
            except NotConnected:
                pass
            else:
                way = [self._tracks[child] for child in (*reversed(down), *reversed(up))]
                return self.policy.missing(self, target, source, at_ns, way)
        return self.policy.unconnected(error, target, source)

    def _parent_near(self, frame: str, at_ns: int) -> str | None:
        track = self._tracks.get(frame)
        return None if track is None else track.parent_near(at_ns)

    def __repr__(self) -> str:
        """Say how many frames and samples."""
        samples = sum(len(track.samples) for track in self._tracks.values())
        return f"TransformBuffer({len(self._frames)} frames, {samples} samples)"
