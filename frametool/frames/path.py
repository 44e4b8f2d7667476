"""The path between two frames of a tree: its edges, and their product, static or at a time.

Static and moving trees both use it; static parts are composed only once.  At a time without data the error names the
edge that has none, the distance in time, and what has data.
"""

from __future__ import annotations

from operator import attrgetter

from frametool.errors import NoDataAt, TooEarly, TooLate, bare
from frametool.frames.stamps import BILLION, format_stamp
from frametool.frames.track import MovingTrack, StaticTransform, Track
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.representations import EARTH_FRAMES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeVar

    from frametool.frames.edge_log import EdgeLog
    from frametool.geometry.types import Rigid

    Edge = TypeVar("Edge")

OTHER_CLOCK = 10**8 * BILLION  # three years: beyond it, only one of two clocks counts from 1970


def compose_path(
    to_target: Sequence[Edge], to_source: Sequence[Edge], sample: Callable[[Edge], Rigid | None], *, far: bool = False
) -> Rigid | None:
    """Return target_from_source, floats or columns; None if an edge has no pose.

    to_target, to_source: the edges from the common ancestor down to either end.  An empty branch does not change the
    bits of the other.
    sample: returns parent_from_child of an edge, or None.
    far: the common ancestor is far away: subtracting before rotating halves the rounding of positions.
    """
    ends: list[Rigid | None] = []  # the product of each branch, topmost edge first; None if it is empty
    for edges in (to_target, to_source):
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
    if far:
        return rigid.relative(*top_from_target, *top_from_source)
    return rigid.compose(*rigid.inverse(*top_from_target), *top_from_source)


class Query:
    """The path between two frames, from their common ancestor down to the target and down to the source.

    fixed: the result, if nothing on the path moves; otherwise None
    moving: the edges that move
    far: whether the common ancestor is the Earth
    """

    __slots__ = ("far", "fixed", "moving", "to_source", "to_target")

    def __init__(self, to_target: Sequence[Track], to_source: Sequence[Track]) -> None:
        """Compose the static edges; both branches begin with the topmost edge."""
        self.moving = [track for track in (*to_target, *to_source) if not track.is_static]
        self.far = bool(to_target) and to_target[0].parent in EARTH_FRAMES
        self.fixed: Rigid | None = None
        self.to_target: Sequence[Track] = ()
        self.to_source: Sequence[Track] = ()
        if self.moving:
            self.to_target, self.to_source = _folded(to_target), _folded(to_source)
        else:
            self.fixed = compose_path(to_target, to_source, attrgetter("components"), far=self.far)

    def compose(self, sample: Callable[[Track], Rigid | None]) -> Rigid | None:
        """Return target_from_source for the poses that `sample` finds for the edges."""
        return compose_path(self.to_target, self.to_source, sample, far=self.far)

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


def _folded(tracks: Sequence[Track]) -> list[Track]:
    """Compose adjacent static edges."""
    pieces: list[Track] = []
    for track in tracks:
        if pieces and track.is_static and pieces[-1].is_static:
            pose = rigid.compose(*pieces[-1].components, *track.components)
            pieces[-1] = StaticTransform(track.child, pieces[-1].parent, pose)
        else:
            pieces.append(track)
    return pieces


def no_data(target: str, source: str, at_ns: int, path: Sequence[Track]) -> NoDataAt:
    """Return the error for a lookup at a time; it names the edge whose data are furthest from it.

    path: the edges between the two frames, from the target to the source.
    """
    moving = [track for track in path if not track.is_static]
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
    clocks = "; that is years: one of the clocks counts from 1970, the other does not" if short >= OTHER_CLOCK else ""
    frames = list(map(bare, frames_on(target, source, path)))
    if len(frames) > 13:
        frames = [*frames[:6], f"({len(frames) - 12} more)", *frames[-6:]]
    message = (
        f"no data for {bare(parent)} -> {bare(worst.child)} at {format_stamp(at_ns)}; {cover} ({off}), "
        f"on the path {' <- '.join(frames)}{whole}{clocks}"
    )
    return (TooEarly if is_early else TooLate)(
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


def frames_on(target: str, source: str, path: Sequence[Track | EdgeLog]) -> list[str]:
    """Return the frames on a path of edges from target to source, both included."""
    frames = [target]
    for track in path:
        frames.append(track.parent if track.child == frames[-1] else track.child)
    return frames if frames[-1] == source else [*frames, source]
