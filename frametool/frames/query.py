"""How to answer a question about two frames: the edges on the way, those that stand still already composed.

Knows tracks and geometry; the buffer finds the way and keeps the plans.
"""

from __future__ import annotations

from frametool.frames.track import Track
from frametool.geometry import floats, quaternion, rigid

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.geometry.types import Rigid

    Piece = Track | Rigid

IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Plan:
    """The way between two frames, from their common ancestor down to the target and down to the source."""

    __slots__ = ("fixed", "moving", "to_source", "to_target")

    def __init__(self, to_target: Iterable[Track], to_source: Iterable[Track]) -> None:
        """Fold the standing edges of both branches, topmost edge first."""
        self.to_target = _folded(to_target)
        self.to_source = _folded(to_source)
        self.moving = [piece for piece in (*self.to_target, *self.to_source) if isinstance(piece, Track)]
        self.fixed = None if self.moving else _joined(_product(self.to_target), _product(self.to_source))

    def at(self, at_ns: int) -> Rigid | None:
        """Return target_from_source at a time; None if an edge has no data then."""
        if self.fixed is not None:
            return self.fixed
        top_from_target = _product_at(self.to_target, at_ns)
        top_from_source = _product_at(self.to_source, at_ns)
        if top_from_target is None or top_from_source is None:
            return None
        tx, ty, tz, x, y, z, w = _joined(top_from_target, top_from_source)
        return tx, ty, tz, *quaternion.unit(x, y, z, w, floats)

    def latest(self, *, zero_counts: bool = True) -> int | None:
        """Return the newest stamp that every moving edge has reached; None when all stand still.

        zero_counts: otherwise edges whose newest stamp is 0 are passed over, as tf2 does.
        """
        newest = [track.stamps[-1] for track in self.moving]
        return min((stamp for stamp in newest if stamp or zero_counts), default=None)


def _folded(tracks: Iterable[Track]) -> list[Piece]:
    """Compose neighbours that stand still."""
    pieces: list[Piece] = []
    for track in tracks:
        if not track.standing:
            pieces.append(track)
        elif pieces and not isinstance(pieces[-1], Track):
            pieces[-1] = rigid.compose(*pieces[-1], *track.samples[0])
        else:
            pieces.append(track.samples[0])
    return pieces


def _product(pieces: Iterable[Piece]) -> Rigid:
    """Return the product of at most one folded piece."""
    return next((piece for piece in pieces if not isinstance(piece, Track)), IDENTITY)


def _product_at(pieces: Iterable[Piece], at_ns: int) -> Rigid | None:
    """Compose the pieces at a time."""
    product: Rigid | None = None
    for piece in pieces:
        here = piece.at(at_ns) if isinstance(piece, Track) else piece
        if here is None:
            return None
        product = here if product is None else rigid.compose(*product, *here)
    return IDENTITY if product is None else product


def _joined(top_from_target: Rigid, top_from_source: Rigid) -> Rigid:
    """Return target_from_source; a branch without edges costs nothing and leaves the other's bits alone."""
    if top_from_target is IDENTITY:
        return top_from_source
    if top_from_source is IDENTITY:
        return rigid.inverse(*top_from_target)
    return rigid.compose(*rigid.inverse(*top_from_target), *top_from_source)
