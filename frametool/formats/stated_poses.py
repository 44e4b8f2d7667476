"""Poses that a calibration states about pairs of frames, made into the edges of trees: turned round, checked, named.

    T_cam_imu of cam0 and cam1 both end at the IMU: in a tree the cameras hang under it, so each is turned round.

What is stated twice, the other way round or along another way, is no edge but a check.
"""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import LookupFailed, shown
from frametool.formats.document_edges import dotted
from frametool.frames.tree import FrameTree
from frametool.geometry import floats, rigid
from frametool.grammar.edges import Edge
from frametool.grammar.readers import Misfit
from frametool.grammar.rotation import AGREEMENT

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Reading

TOLERATED = 1e-3  # metres, radians: how far a pose and its stated inverse may lie apart, with a warning


class Stated(NamedTuple):
    """One pose as it is stated: target_from_source; in a tree `child` hangs under the other one.

    chained: it is about neighbours in a chain, and only a check where both are known otherwise
    """

    target: str
    source: str
    child: str
    components: Rigid
    path: Path
    chained: bool = False

    @property
    def edge(self) -> Edge:
        """Return the edge, turned round if the child is its target."""
        if self.child == self.source:
            return Edge(self.target, self.source, self.components, path=self.path)
        return Edge(self.source, self.target, rigid.inverse(*self.components), path=self.path)


def edges_of(statements: Iterable[Stated], reading: Reading) -> Iterator[Edge]:
    """Yield the edges, and check what is stated again against them.

    Raises Misfit where a pose and its inverse contradict each other; other contradictions are noted.
    """
    known = FrameTree()
    first: dict[frozenset[str], Stated] = {}
    order = sorted(statements, key=lambda each: (each.chained, each.child != each.source))
    for each in order:
        if each.target == each.source:
            raise Misfit(f"frame {shown(each.source)} is its own parent", each.path, key=True)
        pair = frozenset((each.target, each.source))
        if (stated := _lookup(known, each)) is not None:
            _compare(stated, each, first.get(pair), reading)
            continue
        first[pair] = each
        edge = each.edge
        if known.parent(edge.child) is not None and edge.parent is not None and known.parent(edge.parent) is None:
            edge = each._replace(child=edge.parent).edge
        if known.parent(edge.child) is None and edge.parent is not None:
            known.add_components(edge.parent, edge.child, edge.components)
        yield edge


def _lookup(known: FrameTree, each: Stated) -> Rigid | None:
    """Return target_from_source as the edges so far have it; None if they do not connect the two."""
    try:
        return known.lookup_components(each.target, each.source)
    except LookupFailed:
        return None


def _compare(stated: Rigid, each: Stated, first: Stated | None, reading: Reading) -> None:
    """Check a pose that is stated again."""
    metres, radians = rigid.distance(*stated, *each.components, floats)
    if metres <= AGREEMENT and radians <= AGREEMENT:
        return
    other = f"{dotted(first.path)}" if first else "the other matrices"
    message = f"differs from {other} by {metres * 1000.0:.6g} mm and {degrees(radians):.6g} degrees"
    if first and (metres > TOLERATED or radians > TOLERATED):
        raise Misfit(f"{dotted(each.path)} {message}; keep one", each.path, key=True)
    reading.here = ()
    reading.note(f"{message}; {other} {'is' if first else 'are'} used", *each.path)
