"""Poses that a calibration states about pairs of frames, made into the edges of trees: turned round, checked, named.

    T_cam_imu of cam0 and cam1 both end at the IMU: in a tree the cameras hang under it, so each is turned round.

What is stated twice, the other way round or along another way, is no edge but a check.
"""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import bare, shown
from frametool.formats.document_edges import dotted
from frametool.geometry import floats, rigid
from frametool.grammar.edges import Edge
from frametool.grammar.readers import Misfit
from frametool.grammar.rotation import AGREEMENT

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Reading

TOLERATED = 1e-3  # metres, radians: how far a pose and its stated inverse may lie apart, with a warning


class Stated(NamedTuple):
    """One pose as it is stated: target_from_source; in a tree `child` hangs under the other one.

    chained: it is about neighbours in a chain, and only a check where both are known otherwise
    firm: what the child hung under before hangs under the child from now on, never the other way round
    """

    target: str
    source: str
    child: str
    components: Rigid
    path: Path
    chained: bool = False
    firm: bool = False

    @property
    def parent(self) -> str:
        """Return the frame that is not the child."""
        return self.target if self.child == self.source else self.source


class _Forest:
    """Edges by their child, so far."""

    def __init__(self) -> None:
        self.edges: dict[str, Edge] = {}

    def hang(self, each: Stated) -> None:
        """Add a pose that connects two trees."""
        child, parent = each.child, each.parent
        if child in self.edges and parent not in self.edges and not each.firm:
            child, parent = parent, child
        self._make_root(child)
        pose = each.components if child == each.source else rigid.inverse(*each.components)
        self.edges[child] = Edge(parent, child, pose, path=each.path)

    def _make_root(self, frame: str) -> None:
        """Turn the edges above a frame round, so that all of its tree hangs under it."""
        way = []
        while frame in self.edges:
            way.append(self.edges.pop(frame))
            frame = way[-1].parent or ""
        for edge in way:
            parent = edge.parent or ""
            self.edges[parent] = Edge(edge.child, parent, rigid.inverse(*edge.components), path=edge.path)

    def lookup(self, target: str, source: str) -> Rigid | None:
        """Return target_from_source; None where the two are not connected."""
        (root, root_from_target), (other, other_from_source) = map(self._above, (target, source))
        return rigid.compose(*rigid.inverse(*root_from_target), *other_from_source) if root == other else None

    def _above(self, frame: str) -> tuple[str, Rigid]:
        """Return the root above a frame, and the pose of the frame in it."""
        pose: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        while frame in self.edges:
            edge = self.edges[frame]
            pose, frame = rigid.compose(*edge.components, *pose), edge.parent or ""
        return frame, pose


def edges_of(statements: Iterable[Stated], reading: Reading) -> list[Edge]:
    """Return the edges, and check what is stated again against them.

    Raises Misfit where a pose and its inverse contradict each other; other contradictions are noted.
    """
    forest = _Forest()
    first: dict[frozenset[str], Stated] = {}
    for each in sorted(statements, key=lambda each: (each.chained, each.child != each.source)):
        if each.target == each.source:
            raise Misfit(f"frame {shown(each.source)} is its own parent", each.path, key=True)
        if (known := forest.lookup(each.target, each.source)) is None:
            first[frozenset((each.target, each.source))] = each
            forest.hang(each)
        else:
            _compare(known, each, first.get(frozenset((each.target, each.source))), reading)
    return list(forest.edges.values())


def _compare(known: Rigid, each: Stated, first: Stated | None, reading: Reading) -> None:
    """Check a pose that is stated again."""
    metres, radians = rigid.distance(*known, *each.components, floats)
    if metres <= AGREEMENT and radians <= AGREEMENT:
        return
    other = bare(dotted(first.path)) if first else "the others"
    message = f"differs from {other} by {metres * 1000.0:.6g} mm and {degrees(radians):.6g} degrees"
    if first and (metres > TOLERATED or radians > TOLERATED):
        raise Misfit(f"{bare(dotted(each.path))} {message}; keep one", each.path, key=True)
    reading.here = ()
    reading.note(f"{message}; {other} {'is' if first else 'are'} used", *each.path)
