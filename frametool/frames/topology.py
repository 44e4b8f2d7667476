"""The rules of a tree, the errors for edges that break them, and snapshots; the path between two frames.

The rules are: one parent per frame, one pose in it, no cycle.  Each error is a BadTopology without a place: a tree
raises it, a loader adds where both edges are, `check` lists it.  Static and moving trees both use the path; static
parts are composed only once.  At a time without data the error names the edge that is furthest from having data, this
distance in time, and the interval in which the path has data.
"""

from __future__ import annotations

from collections.abc import Hashable
from contextlib import suppress
from functools import cached_property
from operator import attrgetter
from typing import Generic, TypeVar

from frametool.errors import (
    BadTopology,
    LookupFailed,
    NamedTuple,
    NoDataAt,
    NotConnected,
    TooEarly,
    TooLate,
    bare,
    shown,
)
from frametool.frames.stamps import BILLION, format_stamp
from frametool.frames.track import MovingTrack, StaticTransform, Track
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.representations import EARTH_FRAMES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Container, Mapping, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry import Components, Rigid

MOST_SHOWN = 16  # frames of a path or a cycle
OTHER_CLOCK = 10**8 * BILLION  # three years: if only one of two times is smaller, only the other counts from 1970


Member = TypeVar("Member", bound=Hashable)


class Groups(Generic[Member]):
    """Disjoint sets of connected frames or bodies (union-find)."""

    def __init__(self) -> None:
        """Create an empty partition: every member is alone."""
        self._up: dict[Member, Member] = {}

    def of(self, member: Member) -> Member:
        """Return the representative of a member's set; the path to it is halved (path halving)."""
        up = self._up
        while (above := up.get(member)) is not None:
            further = up.get(above)
            if further is None:
                return above
            up[member] = further
            member = further
        return member

    def join(self, one: Member, other: Member) -> bool:
        """Merge the sets of two members; return False if they are the same already."""
        one, other = self.of(one), self.of(other)
        if one != other:
            self._up[one] = other
        return one != other


def resolve_name(frame: str, known: Container[str]) -> str:
    """Return the name of a frame among known names: the Earth has two, `ecef` and `earth`."""
    if frame in EARTH_FRAMES and frame not in known:
        return next((other for other in EARTH_FRAMES if other in known), frame)
    return frame


def to_root(frame: str, parent_of: Callable[[str], str | None]) -> list[str]:
    """Return a frame and its ancestors, root last.

    Raises BadTopology if the ancestors form a cycle.
    """
    line = {frame: None}
    parent = parent_of(frame)
    while parent is not None:
        if parent in line:
            raise cycle([*[*line][[*line].index(parent) :], parent])
        line[parent] = None
        parent = parent_of(parent)
    return [*line]


class FramePath(NamedTuple):
    """The path between two frames: its edges from their common ancestor `top` down to either, each by its child.

    target_from_source is the inverse of the product of the edges to the target, times that of the edges to the source.
    """

    to_target: tuple[str, ...]
    top: str
    to_source: tuple[str, ...]

    @property
    def frames(self) -> tuple[str, ...]:
        """Return the frames from the target to the source, both included."""
        return (*self.to_target[::-1], self.top, *self.to_source)

    @property
    def edges(self) -> tuple[str, ...]:
        """Return the edges from the target to the source."""
        return (*self.to_target[::-1], *self.to_source)


def path_between(target: str, source: str, parent_of: Callable[[str], str | None]) -> FramePath:
    """Return the path between two frames; raises NotConnected, naming both roots."""
    target_line, source_line = to_root(target, parent_of), to_root(source, parent_of)
    if target_line[-1] != source_line[-1]:
        raise NotConnected(
            f"{shown(target)} and {shown(source)} are not connected: "
            f"{shown(target)} hangs from root {shown(target_line[-1])}, "
            f"{shown(source)} from root {shown(source_line[-1])}",
            target=target, source=source, target_root=target_line[-1], source_root=source_line[-1],
        )  # fmt: skip
    while target_line and source_line and target_line[-1] == source_line[-1]:
        top = target_line.pop()
        source_line.pop()
    return FramePath(tuple(target_line[::-1]), top, tuple(source_line[::-1]))


def check_same(child: str, known: tuple[str, Rigid], found: tuple[str, Rigid]) -> None:
    """Raise BadTopology for another parent or pose of a static frame; known, found: (parent, components)."""
    if found[0] != known[0]:
        raise two_parents(child, known[0], found[0])
    if found[1] != known[1]:
        raise two_poses(child, found[0])


def own_parent(child: str) -> BadTopology:
    """Return the error for a frame that is its own parent."""
    return BadTopology(f"frame {shown(child)} is its own parent", rule="self")


def two_parents(child: str, one: str, other: str, places: Sequence[str] = ()) -> BadTopology:
    """Return the error for a static frame with two parents; `places` states where each is named, if known."""
    parents = [f"{shown(parent)} ({at})" for parent, at in zip((one, other), places, strict=False)]
    named = " and ".join(parents or (shown(one), shown(other)))
    return BadTopology(f"frame {shown(child)} has two parents: {named}", rule="two-parents")


def two_poses(child: str, parent: str) -> BadTopology:
    """Return the error for a static frame with two poses in its parent."""
    return BadTopology(f"frame {shown(child)} has two different poses in {shown(parent)}", rule="two-poses")


def two_covariances(parent: str, child: str, one: Components | None, other: Components | None) -> BadTopology:
    """Return the error for an edge with two different covariances."""
    what = "two different covariances" if one and other else "a covariance in one place and none in another"
    return BadTopology(f"frame {shown(child)} in {shown(parent)} has {what}", rule="two-covariances")


def static_and_moving(child: str, details: str = " is both static and moving") -> BadTopology:
    """Return the error for a frame that is both static and moving; `details` states where."""
    return BadTopology(f"frame {shown(child)}{details}", rule="static-and-moving")


def cycle(frames: list[str]) -> BadTopology:
    """Return the error for a cycle, parents to the left: `a <- b <- a`."""
    return BadTopology(f"frames form a cycle: {_arrows(frames[::-1])}", rule="cycle")


def _arrows(frames: Sequence[str]) -> str:
    """Return frames with arrows between them, shortened in the middle if they are many."""
    names = list(map(bare, frames))
    half = MOST_SHOWN // 2
    if len(names) > MOST_SHOWN + 1:
        names[half:-half] = [f"({len(names) - MOST_SHOWN} more)"]
    return " <- ".join(names)


class Snapshot:
    """The edges of a tree at one time, or each at its own latest time.

    edges: child -> its parent and its pose there, parent_from_child
    without_data: the moving frames that have no data at that time, with their samples
    """

    def __init__(self, tree: Frames, at_ns: int | None = None) -> None:
        """Collect the edges of a tree; `at_ns` None is the latest of each."""
        self.tree = tree
        self.at_ns = at_ns
        self.edges: dict[str, tuple[str, Rigid]] = {}
        self.without_data: dict[str, MovingTrack] = {}
        for track in tree.tracks():
            pose = track.components if at_ns is None else track.at(at_ns)
            parent = track.parent if at_ns is None else track.parent_at(at_ns)
            if pose is not None and parent is not None:
                self.edges[track.child] = parent, pose
            elif not track.is_static:
                self.without_data[track.child] = track

    def parent(self, frame: str) -> str | None:
        """Return a frame's parent; None for a root, and if there are no data."""
        return self.edges[frame][0] if frame in self.edges else None

    @cached_property
    def roots(self) -> dict[str, str]:
        """Return the root above each frame, itself for a root; frames with the same root are connected."""
        groups = Groups[str]()
        for child, (parent, _) in self.edges.items():
            groups.join(child, parent)
        return {frame: groups.of(frame) for frame in self.tree.frames}

    @cached_property
    def _children(self) -> dict[str, list[str]]:
        children: dict[str, list[str]] = {}
        for child, (parent, _) in self.edges.items():
            children.setdefault(parent, []).append(child)
        return children

    def below(self, start: str) -> list[str]:
        """Return a frame and all its descendants, the nearest first."""
        found = [start]
        for frame in found:  # it grows during the loop
            found += (child for child in self._children.get(frame, ()) if child != start)
        return found

    def seen_from(self, start: str) -> dict[str, Rigid]:
        """Return the pose in `start` of every frame connected to it.

        For the latest time, moving frames are looked up one by one: each at the time common to the edges of its path.
        """
        found: dict[str, Rigid] = {start: rigid.IDENTITY}
        if self.at_ns is None and self.tree.moves:
            for frame in self.tree.frames:
                with suppress(LookupFailed, BadTopology):
                    found[frame] = self.tree.lookup_components(start, frame)
            return found
        pending = [start]
        for frame in pending:  # it grows during the loop
            steps = {child: self.edges[child][1] for child in self._children.get(frame, ())}
            if frame in self.edges:
                parent, pose = self.edges[frame]
                steps = {parent: rigid.inverse(*pose)} | steps
            for other in [each for each in steps if each not in found]:
                found[other] = rigid.compose(*found[frame], *steps[other])
                pending.append(other)
        return found


class Query:
    """The edges of the path between two frames, from their common ancestor down to the target and down to the source.

    fixed: the result, if nothing on the path moves; otherwise None
    moving: the edges that move
    far: True if the common ancestor is the Earth
    """

    __slots__ = ("far", "fixed", "moving", "to_source", "to_target")

    def __init__(self, path: FramePath, tracks: Mapping[str, Track]) -> None:
        """Look up the edges of a path, and compose static ones that follow each other."""
        self.far = bool(path.to_target) and path.top in EARTH_FRAMES
        self.to_target, self.to_source, self.moving = list[Track](), list[Track](), list[MovingTrack]()
        for edges, pieces in ((path.to_target, self.to_target), (path.to_source, self.to_source)):
            for track in map(tracks.__getitem__, edges):
                if not track.is_static:
                    self.moving.append(track)
                elif pieces and pieces[-1].is_static:
                    pose = rigid.compose(*pieces.pop().components, *track.components)
                    track = StaticTransform(track.child, "", pose)  # noqa: PLW2901
                pieces.append(track)
        self.fixed = None if self.moving else self.compose(attrgetter("components"))

    def compose(self, sample: Callable[[Track], Rigid | None]) -> Rigid | None:
        """Return target_from_source from the poses that `sample` finds, floats or columns; None if one is missing.

        An empty branch does not change the bits of the other.
        """
        ends: list[Rigid | None] = []  # the product of each branch, topmost edge first; None if it is empty
        for edges in (self.to_target, self.to_source):
            product: Rigid | None = None
            for here in map(sample, edges):
                if here is None:
                    return None
                product = here if product is None else rigid.compose(*product, *here)
            ends.append(product)
        top_from_target, top_from_source = ends
        if top_from_target is None:
            return top_from_source or rigid.IDENTITY
        if top_from_source is None:
            return rigid.inverse(*top_from_target)
        if self.far:  # subtracting before rotating halves the rounding of positions
            return rigid.relative(*top_from_target, *top_from_source)
        return rigid.compose(*rigid.inverse(*top_from_target), *top_from_source)

    def at(self, at_ns: int) -> Rigid | None:
        """Return target_from_source at a time; None if an edge has no data then."""
        found = self.fixed or self.compose(lambda track: track.at(at_ns))
        if found is None or found is self.fixed:
            return found
        tx, ty, tz, x, y, z, w = found
        return tx, ty, tz, *quaternion.unit(x, y, z, w, floats)

    def latest(self) -> int | None:
        """Return the newest stamp that every moving edge has reached; None if all are static."""
        return min((track.last_ns for track in self.moving), default=None)

    @property
    def span(self) -> tuple[int, int] | None:
        """Return the first and last time at which every moving edge has data; None if none moves.

        If the first is after the last, they never overlap.
        """
        if not self.moving:
            return None
        return max(track.first_ns for track in self.moving), min(track.last_ns for track in self.moving)


def no_data(target: str, source: str, at_ns: int, path: Sequence[str], edges: Sequence[Track]) -> NoDataAt:
    """Return the error for a lookup at a time; it names the edge whose data are furthest from it.

    path, edges: the frames between the two, from the target to the source, and their poses
    """
    moving = [track for track in edges if not track.is_static]
    worst = max(moving, key=lambda track: gap(track, at_ns))
    first, last = worst.span
    short = gap(worst, at_ns)
    is_early = at_ns < first
    begin, end = max(track.first_ns for track in moving), min(track.last_ns for track in moving)
    parent = worst.parent_near(at_ns)
    off = f"{seconds(short)} s too {'early' if is_early else 'late'}"
    cover = f"samples cover {format_stamp(first)} .. {format_stamp(last)}"
    if first == last:
        cover = f"its only sample is at {format_stamp(first)}"
    whole = f"; the whole path has data from {format_stamp(begin)} until {format_stamp(end)}" * (len(moving) > 1)
    if begin > end:
        early, late = min(moving, key=attrgetter("last_ns")), max(moving, key=attrgetter("first_ns"))
        ended, begun = (f"{bare(track.parent)} -> {bare(track.child)}" for track in (early, late))
        when = f"ends at {format_stamp(end)} before {begun} begins at {format_stamp(begin)}"
        whole = f"; {ended} {when}: they never overlap"
    clocks = "; one of the clocks counts from 1970, the other does not" * (min(at_ns, last) < OTHER_CLOCK <= short)
    message = (
        f"no data for {bare(parent)} -> {bare(worst.child)} at {format_stamp(at_ns)}; {cover} ({off}), "
        f"on the path {_arrows(path)}{whole}{clocks}"
    )
    return (TooEarly if is_early else TooLate)(
        message, parent=parent, child=worst.child, at_ns=at_ns, first_ns=first, last_ns=last, short_ns=short,
        short_s=short / BILLION, target=target, source=source, path=[*path],
        available_from_ns=begin if begin <= end else None, available_until_ns=end if begin <= end else None,
    )  # fmt: skip


def left_out(track: MovingTrack, at_ns: int) -> str:
    """Return the reason why an edge is omitted from the tree at a time."""
    return (
        f"{bare(track.parent)} -> {bare(track.child)} is left out: no data at {format_stamp(at_ns)}, "
        f"samples cover {format_stamp(track.first_ns)} .. {format_stamp(track.last_ns)} "
        f"({seconds(gap(track, at_ns))} s off)"
    )


def motion(track: MovingTrack) -> str:
    """Return a short description of a frame's motion: `41 at 10 Hz, 0 .. 4 s`."""
    first, last = track.span
    if first == last:
        return f"one at {seconds(first)} s" if track.count == 1 else f"{track.count} at once"
    rate = (track.count - 1) * BILLION / (last - first)
    changes = sum(1 for _ in track.changes())
    times = f" {changes} times" if changes > 1 else ""
    other = f", reparented{times}" if changes else ""
    return f"{track.count} at {rate:.4g} Hz, {seconds(first)} .. {seconds(last)} s{other}"


def gap(track: MovingTrack, at_ns: int) -> int:
    """Return the distance of a time from a track's samples, in nanoseconds."""
    first, last = track.span
    return max(first - at_ns, at_ns - last, 0)


def seconds(duration_ns: int) -> str:
    """Format a duration in seconds without trailing zeros: `0.5`, `3`."""
    return format_stamp(duration_ns).rstrip("0").rstrip(".")

