"""Frames that move: transforms in, any lookup at any time out, as tf2's buffer answers it, without ROS."""

from __future__ import annotations

from operator import index
from typing import TYPE_CHECKING

from frametool.errors import BadTopology, LookupFailed, NotConnected, ValueInvalid, warn
from frametool.frames.path import cycle_message, edges_between, to_root
from frametool.frames.plan import Plan
from frametool.frames.policy import FRAMETOOL, Policy
from frametool.frames.stamps import format_stamp
from frametool.frames.track import Track
from frametool.geometry import rigid
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from frametool.geometry.kinds import Rigid

FURTHEST_NS = 1 << 62  # differences of two such stamps fit into 64 bits; the year 2116
MOST_PLANS = 1 << 14


def policy_named(name: str) -> Policy:
    """Give the rules of `frametool`, `ros1` or `ros2`."""
    if name == "frametool":
        return FRAMETOOL
    from frametool.frames.tf2 import TF2

    if name not in TF2:
        raise ValueInvalid(f"unknown policy {name!r}; expected frametool, {', '.join(TF2)}")
    return TF2[name]


class TransformBuffer:
    """Hold transforms over time; answer where one frame is seen from another, and when.

    Stamps are integer nanoseconds, in any order. Between two samples translations are interpolated along the line and
    rotations by slerp, edge by edge. Nothing is pruned unless `keep_ns` says so.

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
        self.name = name
        self.policy = policy_named(policy)
        self.keep_ns = self.policy.default_keep_ns if keep_ns is None else keep_ns
        self._tracks: dict[str, Track] = {}
        self._frames: dict[str, None] = {}
        self._plans: dict[tuple[str, str], Plan] = {}
        self._varies = False  # whether any frame has ever changed its parent
        self._plain = self.policy is FRAMETOOL and self.keep_ns is None

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

    def insert_components(
        self, parent: str, child: str, components: Rigid, stamp_ns: int | None = None, *,
        static: bool | None = None, authority: str = "default_authority",
    ) -> bool:  # fmt: skip
        """Add tx, ty, tz (metres), x, y, z, w (unit quaternion); otherwise as `insert`.

        Returns whether other data at the same stamp were replaced; the caller may know where both were written.
        """
        track = self._tracks.get(child)
        if (
            self._plain and track is not None and type(stamp_ns) is int and not static and track.stamps
            and track.stamps[-1] < stamp_ns < FURTHEST_NS and track.parents[-1] == parent
            and -1e300 < sum(components) < 1e300  # finite
        ):  # fmt: skip
            track.stamps.append(stamp_ns)
            track.parents.append(parent)
            track.samples.append(components)
            track.table = None
            return False
        parent, child, components = self.policy.admit(parent, child, components, authority)
        standing = stamp_ns is None if static is None else static
        stamp = 0 if stamp_ns is None else whole_stamp(stamp_ns)
        return self._admit(parent, child, components, stamp, standing=standing, authority=authority)

    def _admit(
        self, parent: str, child: str, components: Rigid, stamp_ns: int, *, standing: bool, authority: str,
    ) -> bool:  # fmt: skip
        """Add what may be the first of its frame, out of order, or against a rule."""
        track = self._tracks.get(child)
        if track is None or not track.parents:
            self._refuse_cycle(parent, child, stamp_ns, standing=standing)
            track = self._begin(parent, child, standing=standing)
        elif track.standing != standing:
            standing = self.policy.settle_kind(track, standing=standing)
            if track.standing != standing:
                track = self._begin(parent, child, standing=standing)
        replaced = False
        if standing:
            self._stand(track, parent, components)
        else:
            replaced = self._move(track, parent, components, stamp_ns, authority)
        self._frames[parent] = None
        track.authority = authority
        return replaced

    def _begin(self, parent: str, child: str, *, standing: bool) -> Track:
        """Make the track of a frame."""
        self._frames[child] = None
        self._frames[parent] = None
        track = self._tracks[child] = Track(child, standing=standing)
        self._plans.clear()
        return track

    def _stand(self, track: Track, parent: str, components: Rigid) -> None:
        if track.parents:
            self.policy.stand(track, parent, components)
        else:
            track.stand(parent, components)
        self._plans.clear()

    def _move(self, track: Track, parent: str, components: Rigid, stamp_ns: int, authority: str) -> bool:
        stamps = track.stamps
        if stamps and self.keep_ns is not None:
            self.policy.refuse_old(track, stamp_ns, self.keep_ns, authority)
            self.policy.prune_before(track, self.keep_ns)
        at = track.index(stamp_ns) if stamps else None
        if at is not None and stamps[at] == stamp_ns:
            return self._repeat(track, at, parent, components, authority)
        if stamps and parent != track.parents[-1]:
            self._refuse_cycle(parent, track.child, stamp_ns, standing=False)
            self._varies = True
            self._plans.clear()
        track.add(stamp_ns, parent, components)
        if self.keep_ns is not None:
            self.policy.prune_after(track, self.keep_ns)
        return False

    def _repeat(self, track: Track, at: int, parent: str, components: Rigid, authority: str) -> bool:
        self._varies = self._varies or parent != track.parents[at]
        self._plans.clear()
        return self.policy.repeat(track, at, parent, components, authority)

    def _refuse_cycle(self, parent: str, child: str, stamp_ns: int, *, standing: bool) -> None:
        """Raise BadTopology if the child is its parent's ancestor at the same time."""
        if not self.policy.refuses_cycles or child not in self._frames:
            return
        line = [parent]
        at_ns = None if standing else stamp_ns
        while (track := self._tracks.get(line[-1])) is not None and _holds(track, at_ns):
            line.append(track.parents[-1])
            if line[-1] == child:
                raise BadTopology(cycle_message([*line, parent]))

    def add_root(self, frame: str) -> None:
        """Make a frame known that has no parent (yet)."""
        self._frames[frame] = None

    def make_stand(self, frame: str) -> None:
        """Take the newest sample of a moving frame for its pose at all times."""
        moved = self._tracks[frame]
        track = self._begin(moved.parent, frame, standing=True)
        track.stand(moved.parent, moved.samples[-1])

    @property
    def frames(self) -> tuple[str, ...]:
        """Give every frame, in the order of first mention, children before their parents."""
        return tuple(self._frames)

    @property
    def roots(self) -> tuple[str, ...]:
        """Give the frames without a parent."""
        return tuple(frame for frame in self._frames if frame not in self._tracks)

    def edges(self) -> Iterator[tuple[str, str, Transform]]:
        """Walk the edges as (parent, child, parent_from_child), each as it was last, in the order of first mention."""
        for track in self._tracks.values():
            yield track.parents[-1], track.child, Transform.of(*track.samples[-1])

    def track(self, frame: str) -> Track | None:
        """Give what is known about a frame over time; None for a root."""
        return self._tracks.get(frame)

    def tracks(self) -> Iterator[Track]:
        """Walk what is known about each frame that has a parent, in the order of first mention."""
        return iter(self._tracks.values())

    def parent(self, frame: str, at_ns: int | None = None) -> str | None:
        """Give a frame's parent at a time, or the newest; None for a root, and where a changing parent is not known."""
        track = self._tracks.get(frame)
        return None if track is None else track.parent_at(at_ns)

    def lookup(self, target: str, source: str, at_ns: int | None = None) -> Transform:
        """Give target_from_source: the pose of source in target, which maps points in source to points in target.

        at_ns: the time; None is the latest that all edges of the path have reached.
        Raises UnknownFrame (also for a frame against itself), NotConnected, TooEarly, TooLate.
        """
        return Transform.of(*self.lookup_components(target, source, at_ns))

    def lookup_components(self, target: str, source: str, at_ns: int | None = None) -> Rigid:
        """Give tx, ty, tz, x, y, z, w of target_from_source; otherwise as `lookup`."""
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
        """Give the latest stamp that all moving edges of the newest path have reached; None if none moves.

        Of a frame against itself it is that frame's own newest stamp.
        Raises UnknownFrame, NotConnected.
        """
        newest = self.plan(target, source, None).latest(zero_counts=self.policy.zero_counts)
        own = self._tracks.get(source) if target == source else None
        return own.stamps[-1] if own is not None and not own.standing else newest

    def lookup_across(
        self, target: str, target_at_ns: int | None, source: str, source_at_ns: int | None, fixed: str,
    ) -> Transform:  # fmt: skip
        """Give the pose that source had at one time, seen from where target was at another.

        fixed: a frame that counts as standing in between, e.g. the map.  A time of None is that half's latest.
        Raises as `lookup`.
        """
        for frame, role in ((target, "target_frame"), (source, "source_frame"), (fixed, "fixed_frame")):
            self._require(frame, role)
        fixed_from_source = self.lookup_components(fixed, source, source_at_ns)
        target_from_fixed = self.lookup_components(target, fixed, target_at_ns)
        return Transform.of(*rigid.compose(*target_from_fixed, *fixed_from_source))

    def lookup_many(self, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
        """Give target_from_source at many times: a batch of the times' shape.

        at_ns: integer nanoseconds, an array or a sequence.  missing: "raise" at the first time without data, as
        `lookup` does, or "nan" for rows of NaN there.
        """
        from frametool.frames.batch import lookup_many

        return lookup_many(self, target, source, at_ns, missing=missing)

    def path(self, target: str, source: str, at_ns: int | None = None) -> list[str]:
        """List the frames on the way from target to source, both included, at a time or by the newest parents.

        Raises UnknownFrame, NotConnected.
        """
        down, up = self._between(target, source, at_ns)
        top = self.parent(up[-1] if up else down[0], at_ns) if up or down else source
        return [*reversed(down), str(top), *reversed(up)]

    def way(self, target: str, source: str, at_ns: int | None = None) -> list[Track]:
        """List the edges between two frames, from the target to the source; otherwise as `path`."""
        down, up = self._between(target, source, at_ns)
        return [self._tracks[child] for child in (*reversed(down), *reversed(up))]

    def span(self, target: str, source: str) -> tuple[int, int] | None:
        """Give the first and last time at which every moving edge of the newest path has data; None if none moves.

        They never overlap where the first is after the last.
        """
        moving = [track.span for track in self.way(target, source) if not track.standing]
        return (max(first for first, _ in moving), min(last for _, last in moving)) if moving else None

    def changes(self) -> list[int]:
        """List the stamps, sorted, at which a frame whose parent changes gets another one, or begins, or has ended."""
        stamps: set[int] = set()
        for track in self._tracks.values() if self._varies else ():
            if track.varies:
                pairs = zip(track.parents, track.parents[1:], track.stamps[1:], strict=False)
                stamps.update(stamp for before, after, stamp in pairs if before != after)
                stamps.update((track.stamps[0], track.stamps[-1] + 1))
        return sorted(stamps)

    def plan(self, target: str, source: str, at_ns: int | None) -> Plan:
        """Give the way between two frames as it is at a time, or by the newest parents."""
        return self._plans.get((target, source)) or self._plan(target, source, at_ns)

    def _plan(self, target: str, source: str, at_ns: int | None) -> Plan:
        """Find the way; keep it if no parent on it ever changes."""
        down, up = self._between(target, source, at_ns)
        tracks = self._tracks
        plan = Plan([tracks[child] for child in down], [tracks[child] for child in reversed(up)])
        if not self._varies or not (self._changes_above(target) or self._changes_above(source)):
            if len(self._plans) >= MOST_PLANS:
                self._plans.clear()
            self._plans[target, source] = plan
        return plan

    def _changes_above(self, frame: str) -> bool:
        """Say whether a frame or an ancestor of it ever changes its parent."""
        return any(frame in self._tracks and self._tracks[frame].varies for frame in to_root(frame, self.parent))

    def _between(self, target: str, source: str, at_ns: int | None) -> tuple[list[str], list[str]]:
        """Name the edges between two frames that both exist, as `edges_between` does."""
        self._require(target, "target_frame")
        self._require(source, "source_frame")

        try:
            return edges_between(target, source, lambda frame: self.parent(frame, at_ns))
        except NotConnected as error:
            raise self._unconnected(error, target, source, at_ns) from None

    def _require(self, frame: str, role: str) -> None:
        if frame not in self._frames or self.policy.is_bad_name(frame):
            raise self.policy.unknown(frame, role, self)

    def _unconnected(self, error: NotConnected, target: str, source: str, at_ns: int | None) -> LookupFailed:
        """Tell two trees from one whose changing parent is not known at a time."""
        ends = [to_root(frame, lambda each: self.parent(each, at_ns))[-1] for frame in (target, source)]
        if at_ns is None or not any(end in self._tracks for end in ends):
            return self.policy.unconnected(error, target, source)
        broken = [self._tracks[end] for end in ends if end in self._tracks]
        return self.policy.missing(self, target, source, at_ns, broken)

    def __repr__(self) -> str:
        """Say how many frames and samples."""
        samples = sum(len(track.samples) for track in self._tracks.values())
        return f"TransformBuffer({len(self._frames)} frames, {samples} samples)"


def whole_stamp(stamp_ns: Any) -> int:
    """Check a stamp at the door: an integer, never a float.

    Raises ValueInvalid.
    """
    try:
        stamp = index(stamp_ns)
    except TypeError:
        raise ValueInvalid(f"a stamp is integer nanoseconds, found {stamp_ns!r}") from None
    if not -FURTHEST_NS < stamp < FURTHEST_NS:
        raise ValueInvalid(f"stamp {stamp} ns is beyond the year 2116; are these nanoseconds?")
    return stamp


def _holds(track: Track, at_ns: int | None) -> bool:
    """Say whether an edge under its newest parent has data at a time; standing ones always, and None asks for these."""
    if track.standing:
        return True
    return at_ns is not None and track.parent_at(at_ns) == track.parent and track.index(at_ns) is not None
