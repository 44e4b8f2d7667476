"""The path between two frames of a tree: its edges, and their product, static or at a time.

Static and moving trees both use it; static parts are composed only once.
"""

from __future__ import annotations

from operator import attrgetter

from frametool.frames.track import StaticTransform
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.representations import EARTH_FRAMES
from frametool.geometry.rigid import IDENTITY

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeVar

    from frametool.frames.track import Track
    from frametool.geometry.types import Rigid

    Edge = TypeVar("Edge")

def compose_path(
    to_target: Sequence[Edge], to_source: Sequence[Edge], sample: Callable[[Edge], Rigid | None], *, far: bool = False
) -> Rigid | None:
    """Return target_from_source, floats or columns; None if an edge has no pose.

    to_target, to_source: the edges from the common ancestor down to either end.  An empty branch does not change the
    bits of the other.
    sample: returns parent_from_child of an edge, or None.
    far: the common ancestor is far away: subtracting before rotating halves the rounding of positions.
    """
    top_from_target, top_from_source = _product(to_target, sample), _product(to_source, sample)
    if top_from_target is None or top_from_source is None:
        return None
    if not to_target:
        return top_from_source
    if not to_source:
        return rigid.inverse(*top_from_target)
    if far:
        return rigid.relative(*top_from_target, *top_from_source)
    return rigid.compose(*rigid.inverse(*top_from_target), *top_from_source)


def _product(edges: Sequence[Edge], sample: Callable[[Edge], Rigid | None]) -> Rigid | None:
    """Compose the edges of one branch, topmost first."""
    product = None
    for here in map(sample, edges):
        if here is None:
            return None
        product = here if product is None else rigid.compose(*product, *here)
    return IDENTITY if product is None else product


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
