"""Queries of frames: their names, how they are connected, the pose of one in another, and at which times.

`Frames` has the queries of static trees and recordings alike; `FrameTree` holds static frames.  A replay repeats a
lookup while time advances.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial, reduce
from itertools import chain, repeat
from math import ceil, floor
from operator import methodcaller
from types import MappingProxyType
from typing import TYPE_CHECKING

from frametool.errors import (
    BadTopology,
    NamedTuple,
    NoDataAt,
    NotConnected,
    UnknownFrame,
    ValueInvalid,
    bare,
    listing,
    warn,
)
from frametool.frames import topology
from frametool.frames.stamps import BILLION, FURTHEST_NS, whole_stamp
from frametool.frames.topology import FramePath, Groups, Query, Snapshot, left_out, no_data, path_between, to_root
from frametool.frames.track import StaticTransform, Track
from frametool.geometry import rigid
from frametool.geometry.rigid import IDENTITY
from frametool.geometry.transform import Transform, in_notebook

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from typing import Any

    from frametool.geometry import Components, Rigid
    from frametool.geometry.camera import Camera

MOST_KEPT = 1 << 14  # queries in the cache


class Frames:
    """Look up the pose of one frame in another: the common part of FrameTree and TransformBuffer.

    Times are integer nanoseconds; None is the latest.  Static frames have the same pose at all times.
    """

    moves: bool  # True if any frame moves
    at_ns: int | None = None  # the time of a tree that was extracted from moving frames

    cameras: Mapping[str, Camera] = MappingProxyType({})  # by frame, from `camera:` entries
    read_cameras: Callable[[], dict[str, Callable[..., Camera]]] = staticmethod(dict)  # from files of other formats

    robots: Sequence[tuple[Any, Any, list[str]]] = ()  # of files with joints: values, links, joints without a value

    def __init__(self, name: str) -> None:
        """Create an empty set of frames; `name` is that of their source, for error messages."""
        self.name = name
        self._tracks: dict[str, Track] = {}
        self._frames: dict[str, None] = {}
        self._queries: dict[tuple[str, str], Query] = {}
        self.camera_axes: dict[str, str] = {}  # of camera frames, if their file states them
        self.covariances: dict[str, Components] = {}  # of edges, by their child; missing ones are exact
        self.drawn: dict[str, str] = {}  # edges without a pose, by their child: the rate in a drawing
        self._varies = False  # whether any frame has ever changed its parent
        self._loops = False  # whether newest parents were found to form a cycle

    def add_root(self, frame: str) -> None:
        """Add a frame that has no parent (yet)."""
        self._frames[frame] = None

    def _put(self, track: Track) -> None:
        """Store a track and replace that of the same frame."""
        self._frames[track.child] = None
        self._tracks[track.child] = track
        self._queries.clear()

    # --- contents ---

    _repr_html_ = in_notebook

    @property
    def frames(self) -> tuple[str, ...]:
        """Return all frames, in the order of first mention."""
        return tuple(self._frames)

    def resolve_name(self, frame: str) -> str:
        """Return the name of a frame in this tree: `ecef` and `earth` are the same frame."""
        return topology.resolve_name(frame, self._frames)

    @property
    def roots(self) -> tuple[str, ...]:
        """Return the frames without a parent."""
        return tuple(frame for frame in self._frames if frame not in self._tracks)

    def parent(self, frame: str, at_ns: int | None = None) -> str | None:
        """Return a frame's parent at a time, or the newest; None for a root or if it is not known."""
        if (track := self.track(frame)) is None:
            return None
        return track.parent if at_ns is None else track.parent_at(at_ns)

    def edges(self) -> Iterator[tuple[str, str, Transform]]:
        """Iterate over the edges as (parent, child, parent_from_child), newest poses, in the order of first mention."""
        for track in self._tracks.values():
            yield track.parent, track.child, Transform.of(*track.components)

    def track(self, frame: str) -> Track | None:
        """Return the pose or samples of a frame; None for a root."""
        return self._tracks.get(frame) or self._tracks.get(topology.resolve_name(frame, self._frames))

    def tracks(self) -> Iterator[Track]:
        """Iterate over the tracks of all frames that have a parent, in the order of first mention."""
        return iter(self._tracks.values())

    def tree_at(self, at_ns: int) -> FrameTree:
        """Return the tree at one time; edges without data at that time are omitted, with a warning."""
        tree = FrameTree(self.name)
        for frame in self._frames:
            tree.add_root(frame)
        now = Snapshot(self, at_ns)
        for child, (parent, pose) in now.edges.items():
            tree.add_components(parent, child, pose)
        for track in now.without_data.values():
            warn(left_out(track, at_ns))
        tree.covariances = {child: each for child, each in self.covariances.items() if tree.track(child)}
        tree.drawn, tree.at_ns = self.drawn, at_ns
        tree.camera_axes, tree.cameras, tree.read_cameras = self.camera_axes, self.cameras, self.read_cameras
        return tree

    # --- cameras ---

    def camera(self, frame: str, size: tuple[int, int] | None = None) -> Camera:
        """Return the camera of a frame: intrinsics from the tree's files, points expressed in its own axes.

        size: of the image, if a file does not state it, or to resize
        Raises UnknownFrame, ValueInvalid if there are no intrinsics, FormatError if they cannot be read.
        """
        (frame,) = self.require(frame)
        found = self.cameras.get(frame)
        if found is None:
            known = self.read_cameras()
            if frame not in known:
                what = f"{self.name}: {bare(frame)} has no intrinsics; --camera FILE[:NAME]"
                raise ValueInvalid(f"{what}; cameras: {listing({**self.cameras, **known}) or 'none'}")
            found = known[frame](size=size)
        axes = self.camera_axes.get(frame, found.axes)
        return found if axes == found.axes else found.changed(axes=axes)

    # --- one lookup ---

    def lookup(self, target: str, source: str, at_ns: int | None = None) -> Transform:
        """Return target_from_source: the pose of source in target, which maps points in source to points in target.

        at_ns: the time; None is the latest.
        Raises UnknownFrame (also for a frame relative to itself), NotConnected, TooEarly, TooLate.
        """
        kept = self._queries.get((target, source))
        if kept is not None and kept.fixed is not None:  # shortcut for static frames
            return Transform.of(*kept.fixed)
        return Transform.of(*self.lookup_components(target, source, at_ns))

    def lookup_components(self, target: str, source: str, at_ns: int | None = None) -> Rigid:
        """Return tx, ty, tz, x, y, z, w of target_from_source; otherwise as `lookup`."""
        query = self.query(target, source, at_ns)
        if query.fixed is not None:
            return query.fixed
        if at_ns is None:  # the time first: at that time parents may differ from the newest
            at_ns = query.latest() or 0
            query = self.query(target, source, at_ns)
        found = query.at(at_ns if type(at_ns) is int else whole_stamp(at_ns))
        if found is None:
            raise self._no_data(target, source, at_ns, self.between(target, source, at_ns))
        return found

    def latest(self, target: str, source: str) -> int | None:
        """Return the latest stamp that all moving edges on the path by the newest parents have reached, as tf2 does.

        None if nothing moves there.  For a frame relative to itself it is that frame's own newest stamp.
        Raises UnknownFrame, NotConnected.
        """
        newest = self.query(target, source, None).latest()
        own = self._tracks.get(source) if target == source else None
        return newest if own is None or own.is_static else own.last_ns

    def lookup_across(
        self, target: str, target_at_ns: int | None, source: str, source_at_ns: int | None, fixed: str,
    ) -> Transform:  # fmt: skip
        """Return the pose of source at one time in target at another time; raises as `lookup`.

        fixed: a frame that is assumed static in between, such as the map
        target_at_ns, source_at_ns: None for the latest time of the transform between `fixed` and this frame
        """
        self.require(target, source, fixed)
        fixed_from_source = self.lookup_components(fixed, source, source_at_ns)
        return Transform.of(*rigid.compose(*self.lookup_components(target, fixed, target_at_ns), *fixed_from_source))

    def covariance(self, target: str, source: str, at_ns: int | None = None) -> list[float]:
        """Return the covariance of target_from_source: 36 numbers, row-major, to first order; edges are independent.

        Over (x, y, z, rotation about X, Y, Z), metres and radians, along the fixed axes of the target.
        Raises ValueInvalid if no edge on the path has a covariance; otherwise as `lookup`.
        """
        from frametool.geometry.uncertainty import warn_if_wide

        at_ns = self.latest(target, source) if at_ns is None else at_ns
        self.lookup_components(target, source, at_ns)  # raises if there are no data
        found = self.carried(target, source, at_ns)
        warn_if_wide([found])  # no edge is wider
        return [*found]

    def carried(
        self, target: str, source: str, at_ns: int | None, sample: Callable[[Track], Rigid | None] | None = None
    ) -> Components:
        """Return the 36 entries of `covariance`; zeros if there is no edge between the frames.

        at_ns: a time with data, None if nothing moves
        sample: finds the poses of the edges, floats or columns, instead of those at that time
        """
        sample = sample or methodcaller("at", whole_stamp(at_ns or 0))
        path = self.between(target, source, at_ns)
        if path.edges and self.covariances.keys().isdisjoint(path.edges):
            raise ValueInvalid(f"no edge between {bare(target)} and {bare(source)} has a sigma or a covariance")
        from frametool.geometry import uncertainty

        edges: dict[str, Components] = {
            child: (*(sample(self._tracks[child]) or IDENTITY), *self.covariances.get(child, ()))
            for child in path.edges
        }
        steps = [rigid.inverse_full(edges[child]) for child in path.to_target[::-1]]
        steps += [edges[child] for child in path.to_source]
        found = rigid.covariance_of(reduce(rigid.compose_full, steps, IDENTITY)) or (0.0,) * uncertainty.POSE
        return tuple(entry + 0.0 for entry in uncertainty.symmetric(found))

    # --- many lookups ---

    def lookup_many(self, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
        """Return target_from_source at many times: a batch of the times' shape.

        at_ns: integer nanoseconds, an array or a sequence.  missing: "raise" an error at the first time without data,
        as `lookup` does, or "nan" for rows of NaN.
        """
        from frametool.frames.trajectory import lookup_many

        return lookup_many(self, target, source, at_ns, missing=missing)

    def replay(
        self, target: str, source: str, *, rate_hz: float, start_ns: int | None = None, stop_ns: int | None = None
    ) -> Iterator[Replayed]:
        """Yield (at_ns, found, steps) while time advances: found is target_from_source.

        Without data, found is the error; steps is 1, but all steps before or after the `span` are combined into one.

        rate_hz: steps per second.  start_ns, stop_ns: None for the `span`.  If nothing moves there is one step.
        Raises ValueInvalid for a rate whose steps are not between a nanosecond and a century; otherwise as `lookup`.
        """
        from fractions import Fraction  # saves 2 ms at start-up

        half, period = Fraction(1, 2), BILLION / Fraction(checked_rate(rate_hz))
        span = self.span(target, source)
        if span is None:
            yield Replayed(start_ns, self.lookup(target, source))
            return
        begin = span[0] if start_ns is None else whole_stamp(start_ns)
        end = span[1] if stop_ns is None else whole_stamp(stop_ns)
        if begin > end:
            self.lookup(target, source, begin if stop_ns is None else end)  # raises: all data are on one side of it
        steps = floor((end - begin + half) / period) + 1
        steps -= begin + round((steps - 1) * period) > end
        first = min(max(ceil((span[0] - begin - half) / period), 0), steps)
        last = min(max(floor((span[1] - begin + half) / period) + 1, first), steps)
        for number, count in chain([(0, first)], zip(range(first, last), repeat(1)), [(last, steps - last)]):
            at_ns = begin + round(number * period)
            try:
                if count:
                    yield Replayed(at_ns, self.lookup(target, source, at_ns), count)
            except NoDataAt as error:
                yield Replayed(at_ns, error, count)

    # --- the path ---

    def path(self, target: str, source: str, at_ns: int | None = None) -> list[str]:
        """Return the frames on the path from target to source, both included, as `lookup` uses it.

        Raises as `lookup`.
        """
        if at_ns is None and self._varies:
            at_ns = self.latest(target, source)
        return [*self.between(target, source, at_ns).frames]

    def way(self, target: str, source: str, at_ns: int | None = None) -> list[Track]:
        """Return the edges between two frames, from the target to the source, at a time or by the newest parents."""
        return [self._tracks[child] for child in self.between(target, source, at_ns).edges]

    def span(self, target: str, source: str) -> tuple[int, int] | None:
        """Return the first and last time at which a lookup has a result; None if nothing on the path moves.

        If parents change there may be times without data in between.  If there is no such time at all, it is the first
        that all edges have reached and the last at which all still have data, by the newest parents: first > last.
        """
        newest = self.query(target, source, None).span
        changes = self.changes()
        if not changes:
            return newest
        found = []
        for begin, end in zip([changes[0] - 1, *changes], [*changes, None], strict=True):
            path = self.path_at(target, source, begin)
            if path is not None and (span := Query(path, self._tracks).span) is not None:
                first = span[0] if begin < changes[0] else max(span[0], begin)
                last = span[1] if end is None else min(span[1], end - 1)
                found += [(first, last)] if first <= last else []
        return (found[0][0], found[-1][1]) if found else newest

    def changes(self) -> list[int]:
        """Return the stamps, sorted, at which a frame with changing parents begins, ends, or gets another parent."""
        stamps: set[int] = set()
        for track in self._tracks.values() if self._varies else ():
            if not track.is_static and (track.varies or self._loops):
                stamps.update(track.changes())
                stamps.update((track.first_ns, track.last_ns + 1))
        return sorted(stamps)

    def query(self, target: str, source: str, at_ns: int | None) -> Query:
        """Return the path between two frames at a time, or by the newest parents; cached if no parent changes."""
        if kept := self._queries.get((target, source)):
            return kept
        query = Query(self.between(target, source, at_ns), self._tracks)
        if not self._varies:
            if len(self._queries) >= MOST_KEPT:
                self._queries.clear()
            self._queries[target, source] = query
        return query

    def path_at(self, target: str, source: str, at_ns: int) -> FramePath | None:
        """Return the path as `between` does; None if the frames are not connected, or have no data, at that time."""
        try:
            return self.between(target, source, at_ns)
        except (NoDataAt, NotConnected):
            return None

    def between(self, target: str, source: str, at_ns: int | None) -> FramePath:
        """Return the path between two existing frames at a time, or by the newest parents."""
        target, source = self.require(target, source)
        try:
            return path_between(target, source, partial(self.parent, at_ns=at_ns) if self._varies else self.parent)
        except NotConnected:
            if at_ns is not None and self._varies:
                with suppress(NotConnected):  # perhaps a changing parent is not known at that time
                    near = path_between(target, source, partial(self._parent_near, at_ns=at_ns))
                    raise self._no_data(target, source, at_ns, near) from None
            raise
        except BadTopology:
            self._loops = self._varies = True
            if at_ns is None:
                raise
            parent = partial(self._parent_near, at_ns=at_ns, is_covered=True)
            return path_between(target, source, parent)  # of the edges that have data then

    def _parent_near(self, child: str, at_ns: int, *, is_covered: bool = False) -> str | None:
        """Return the parent of a frame at a time, or at the nearest sample; None for a root.

        is_covered: also return None if the time is outside of the samples
        """
        track = self._tracks.get(child)
        return track.parent_near(at_ns) if track and (track.covers(at_ns) or not is_covered) else None

    def require(self, *frames: str) -> list[str]:
        """Return the names of frames in this tree; raise UnknownFrame unless all exist."""
        names = []
        for frame in frames:
            names.append(topology.resolve_name(frame, self._frames))
            if names[-1] not in self._frames:
                raise UnknownFrame(frame, known=self.frames, where=self.name)
        return names

    def _no_data(self, target: str, source: str, at_ns: int, path: FramePath) -> NoDataAt:
        return no_data(target, source, at_ns, path.frames, [self._tracks[child] for child in path.edges])


class FrameTree(Frames):
    """Frames and the static transforms between them, with lookups of one in another.

    Several roots are allowed. Every frame has at most one parent, and no frame is its own ancestor.

        tree = FrameTree()
        tree.add("base", "camera", base_from_camera)
        tree.lookup("camera", "base")               # camera_from_base
        tree.add("ecef", "map", frametool.earth_pose(48.1, 11.5, 520.0))  # axes at a position on the Earth
    """

    moves = False

    def __init__(self, name: str = "") -> None:
        """Create an empty tree; `name` is that of the source of the frames, for error messages."""
        super().__init__(name)
        self.groups = Groups[str]()  # of connected frames

    def add(self, parent: str, child: str, transform: Transform, covariance: Any = None) -> None:
        """Add a frame; `transform` is parent_from_child, the pose of the child in its parent.

        covariance: of this pose, as `covariance` returns it, or 6 rows of 6; None is exact.
        Adding an edge again with the same numbers changes nothing.
        Raises BadTopology for a second parent, other numbers for the same edge, a cycle, or a frame as its own parent;
        ValueInvalid for anything but a single Transform, and for numbers that are not a covariance.
        """
        parent, child = self.resolve_name(parent), self.resolve_name(child)
        known, (components, found) = self._tracks.get(child), taken(transform, covariance)
        if known is not None and known.parent == parent and self.covariances.get(child, ()) != found:
            raise topology.two_covariances(parent, child, self.covariances.get(child), found)
        self.add_components(parent, child, components)
        if found:
            self.covariances[child] = found

    def add_components(self, parent: str, child: str, components: Rigid) -> None:
        """Add an edge as tx, ty, tz (metres), x, y, z, w (unit quaternion); otherwise as `add`."""
        known = self._tracks.get(child)
        if known is not None and known.is_static:
            topology.check_same(child, (known.parent, known.components), (parent, components))
            return
        if parent == child:
            raise topology.own_parent(child)
        if child in self._frames and self.groups.of(parent) == self.groups.of(child):
            raise topology.cycle([*to_root(parent, self.parent), parent])
        self._frames[parent] = None
        self._put(StaticTransform(child, parent, components))
        self.groups.join(child, parent)

    def hang(self, parent: str, child: str, components: Rigid) -> bool:
        """Add an edge between two trees, whatever their roots; return False if it would close a loop."""
        if self.groups.of(parent) == self.groups.of(child):
            return False
        above, way = child, []  # the edges above the child are inverted, so that it becomes the root of its tree
        while (track := self._tracks.pop(above, None)) is not None:
            way.append(track)
            above = track.parent
        for track in way:
            self._put(StaticTransform(track.parent, track.child, rigid.inverse(*track.components)))
        self.add_components(parent, child, components)
        return True

    def near(self, target: str, source: str) -> Rigid:
        """Return target_from_source of two frames that exist.

        Climbs from both frames in turn until the paths meet, so that neighbours deep in a long chain cost no more than
        others.  Raises NotConnected.
        """
        if self.groups.of(target) != self.groups.of(source):
            self.between(target, source, None)  # raises
        ways = ({target: IDENTITY}, {source: IDENTITY})  # ancestor -> pose of target, or of source, in it
        tops = [target, source]
        at = 0
        while (top := tops[at]) not in ways[1 - at]:
            if track := self.track(top):
                tops[at] = track.parent
                ways[at][track.parent] = rigid.compose(*track.components, *ways[at][top])
            at = 1 - at
        return rigid.compose(*rigid.inverse(*ways[0][top]), *ways[1][top])

    def __repr__(self) -> str:
        """Show the number of frames and the roots."""
        return f"FrameTree({len(self._frames)} frames, roots: {', '.join(self.roots) or 'none'})"


class Replayed(NamedTuple):
    """One lookup of a replay.

    at_ns: its time; None if nothing moves
    found: target_from_source, or the error if there are no data
    steps: the number of steps combined here; more than 1 only before or after all data
    """

    at_ns: int | None
    found: Transform | NoDataAt
    steps: int = 1


def checked_rate(rate_hz: float) -> float:
    """Return a rate; raise ValueInvalid unless its steps are between a nanosecond and a century."""
    if not BILLION / FURTHEST_NS <= rate_hz <= BILLION:
        raise ValueInvalid(f"a rate of {rate_hz:g} Hz has no steps between 1 ns and {FURTHEST_NS // BILLION} s")
    return rate_hz


def taken(transform: Transform, covariance: Any) -> tuple[Rigid, Components]:
    """Return the components of a transform, and the checked entries of its covariance, () for None.

    Raises ValueInvalid.
    """
    if not isinstance(transform, Transform) or (type(transform.components[6]) is not float and transform.shape):
        raise ValueInvalid(f"the pose of a frame is one Transform, found {transform!r}")
    if covariance is None:
        return transform.components, ()
    from frametool.geometry import uncertainty

    return transform.components, uncertainty.taken(covariance)

