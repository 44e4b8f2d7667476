"""A question about two frames, prepared: the edges between them, those that stand still already composed.

Knows tracks and geometry; `Frames` finds the way and keeps the queries.
"""

from __future__ import annotations

from operator import attrgetter

from frametool.frames.path import compose_path
from frametool.frames.track import StandingTrack
from frametool.geometry import floats, quaternion, rigid

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.frames.track import Track
    from frametool.geometry.types import Rigid


class Query:
    """The way between two frames, from their common ancestor down to the target and down to the source.

    fixed: the answer, where nothing on the way moves; otherwise None
    moving: the edges that move
    """

    __slots__ = ("fixed", "moving", "to_source", "to_target")

    def __init__(self, to_target: Sequence[Track], to_source: Sequence[Track]) -> None:
        """Compose what stands still; both branches come topmost edge first."""
        self.moving = [track for track in (*to_target, *to_source) if not track.standing]
        self.fixed: Rigid | None = None
        self.to_target: Sequence[Track] = ()
        self.to_source: Sequence[Track] = ()
        if self.moving:
            self.to_target, self.to_source = _folded(to_target), _folded(to_source)
        else:
            self.fixed = compose_path(to_target, to_source, attrgetter("components"))

    def compose(self, sample: Callable[[Track], Rigid | None]) -> Rigid | None:
        """Return target_from_source of the poses that `sample` finds for the edges."""
        return compose_path(self.to_target, self.to_source, sample)

    def at(self, at_ns: int) -> Rigid | None:
        """Return target_from_source at a time; None if an edge has no data then."""
        found = self.fixed or self.compose(lambda track: track.at(at_ns))
        if found is None or found is self.fixed:
            return found
        tx, ty, tz, x, y, z, w = found
        return tx, ty, tz, *quaternion.unit(x, y, z, w, floats)

    def latest(self, *, zero_counts: bool = True) -> int | None:
        """Return the newest stamp that every moving edge has reached; None when all stand still.

        zero_counts: otherwise edges whose newest stamp is 0 are passed over, as tf2 does.
        """
        newest = [track.last_ns for track in self.moving]
        return min((stamp for stamp in newest if stamp or zero_counts), default=None)

    @property
    def span(self) -> tuple[int, int] | None:
        """Return the first and last time at which every moving edge has data; None if none moves.

        They never overlap where the first is after the last.
        """
        if not self.moving:
            return None
        return max(track.first_ns for track in self.moving), min(track.last_ns for track in self.moving)


def _folded(tracks: Sequence[Track]) -> list[Track]:
    """Compose neighbours that stand still."""
    pieces: list[Track] = []
    for track in tracks:
        if pieces and track.standing and pieces[-1].standing:
            pose = rigid.compose(*pieces[-1].components, *track.components)
            pieces[-1] = StandingTrack(track.child, pieces[-1].parent, pose)
        else:
            pieces.append(track)
    return pieces
