"""Everything said about frames over time, admitted by the rules of a policy; the buffer asks it.

Knows names, stamps and tracks; finds no ways.
"""

from __future__ import annotations

from operator import index
from typing import TYPE_CHECKING

from frametool.errors import BadTopology, ValueInvalid
from frametool.frames.path import cycle_message
from frametool.frames.policy import FRAMETOOL, Policy
from frametool.frames.track import Track
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from frametool.geometry.types import Rigid

FURTHEST_NS = 1 << 62  # differences of two such stamps fit into 64 bits; the year 2116


def policy_named(name: str) -> Policy:
    """Return the rules of `frametool`, `ros1` or `ros2`."""
    if name == "frametool":
        return FRAMETOOL
    from frametool.frames.tf2 import TF2

    if name not in TF2:
        raise ValueInvalid(f"unknown policy {name!r}; expected frametool, {', '.join(TF2)}")
    return TF2[name]


class TrackStore:
    """Hold the track of every frame that has a parent, and the frames there are."""

    def __init__(self, *, policy: Policy, keep_ns: int | None, name: str) -> None:
        """Begin empty; see TransformBuffer."""
        self.name = name
        self.policy = policy
        self.keep_ns = policy.default_keep_ns if keep_ns is None else keep_ns
        self._tracks: dict[str, Track] = {}
        self._frames: dict[str, None] = {}
        self._varies = False  # whether any frame has ever changed its parent
        self._plain = policy is FRAMETOOL and self.keep_ns is None

    def _changed(self) -> None:
        """Take note that ways may have changed."""

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
        self._changed()
        return track

    def _stand(self, track: Track, parent: str, components: Rigid) -> None:
        if track.parents:
            self.policy.stand(track, parent, components)
        else:
            track.stand(parent, components)
        self._changed()

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
            self._changed()
        track.add(stamp_ns, parent, components)
        if self.keep_ns is not None:
            self.policy.prune_after(track, self.keep_ns)
        return False

    def _repeat(self, track: Track, at: int, parent: str, components: Rigid, authority: str) -> bool:
        self._varies = self._varies or parent != track.parents[at]
        self._changed()
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
        """Return every frame, in the order of first mention, children before their parents."""
        return tuple(self._frames)

    @property
    def roots(self) -> tuple[str, ...]:
        """Return the frames without a parent."""
        return tuple(frame for frame in self._frames if frame not in self._tracks)

    def edges(self) -> Iterator[tuple[str, str, Transform]]:
        """Walk the edges as (parent, child, parent_from_child), each as it was last, in the order of first mention."""
        for track in self._tracks.values():
            yield track.parents[-1], track.child, Transform.of(*track.samples[-1])

    def track(self, frame: str) -> Track | None:
        """Return what is known about a frame over time; None for a root."""
        return self._tracks.get(frame)

    def tracks(self) -> Iterator[Track]:
        """Walk what is known about each frame that has a parent, in the order of first mention."""
        return iter(self._tracks.values())

    def parent(self, frame: str, at_ns: int | None = None) -> str | None:
        """Return a frame's parent at a time, or the newest; None for a root or where it is not known."""
        track = self._tracks.get(frame)
        return None if track is None else track.parent_at(at_ns)


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
