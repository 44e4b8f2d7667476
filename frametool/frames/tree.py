"""A tree of frames that stand still relative to one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import BadTopology, UnknownFrame
from frametool.frames.path import cycle_message, edges_between, to_root
from frametool.geometry import rigid
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

    from frametool.geometry.types import Rigid

MOST_KEPT = 1 << 14  # answers
IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class FrameTree:
    """Hold frames and the fixed transforms between them; answer where one is seen from another.

    Several roots are fine. Every frame has at most one parent, and no frame is its own ancestor.

        tree = FrameTree()
        tree.add("base", "camera", base_from_camera)
        tree.lookup("camera", "base")               # camera_from_base
    """

    def __init__(self, name: str = "") -> None:
        """Begin an empty tree; `name` says in error messages where the frames come from."""
        self.name = name
        self._edges: dict[str, tuple[str, Rigid]] = {}
        self._frames: dict[str, None] = {}
        self._kept: dict[tuple[str, str], Rigid] = {}  # (target, source) -> the answer, until an edge is added
        self._upward: dict[str, str] = {}  # frame -> some ancestor of it; shortened as it is walked

    def add(self, parent: str, child: str, transform: Transform) -> None:
        """Hang a frame under a parent; `transform` is parent_from_child, the pose of the child in its parent.

        Adding an edge again with the same numbers changes nothing.
        Raises BadTopology for a second parent, other numbers for the same edge, a cycle, or a frame in itself.
        """
        self.add_components(parent, child, transform.components)

    def add_components(self, parent: str, child: str, components: Rigid) -> None:
        """Add an edge given as tx, ty, tz (metres), x, y, z, w (unit quaternion); otherwise as `add`."""
        known = self._edges.get(child)
        if known is not None:
            if known == (parent, components):
                return
            raise BadTopology(_clash(child, parent, known[0]))
        if parent == child:
            raise BadTopology(f"frame {child!r} is its own parent")
        if child in self._frames and self._root_of(parent) == child:
            raise BadTopology(cycle_message([*to_root(parent, self.parent), parent]))
        self._frames[parent] = None
        self._frames[child] = None
        self._edges[child] = (parent, components)
        self._kept.clear()
        self._upward[child] = parent

    def add_root(self, frame: str) -> None:
        """Make a frame known that has no parent (yet)."""
        self._frames[frame] = None

    def _root_of(self, frame: str) -> str:
        """Find a frame's root, halving the way for the next search."""
        upward = self._upward
        while (above := upward.get(frame)) is not None:
            further = upward.get(above)
            if further is None:
                return above
            upward[frame] = further
            frame = further
        return frame

    @property
    def frames(self) -> tuple[str, ...]:
        """Return every frame, in the order of first mention."""
        return tuple(self._frames)

    @property
    def roots(self) -> tuple[str, ...]:
        """Return the frames without a parent."""
        return tuple(frame for frame in self._frames if frame not in self._edges)

    def parent(self, frame: str) -> str | None:
        """Return a frame's parent; None for a root."""
        edge = self._edges.get(frame)
        return edge[0] if edge is not None else None

    def edges(self) -> Iterator[tuple[str, str, Transform]]:
        """Walk the edges as (parent, child, parent_from_child), in the order they were added."""
        for child, (parent, components) in self._edges.items():
            yield parent, child, Transform.of(*components)

    def path(self, target: str, source: str) -> list[str]:
        """List the frames on the way from target to source, both included.

        Raises UnknownFrame, NotConnected.
        """
        down, up = self._between(target, source)
        line = to_root(source, self.parent)
        return [*reversed(down), line[len(up)], *reversed(up)]

    def lookup(self, target: str, source: str, at_ns: int | None = None) -> Transform:  # noqa: ARG002 - a tree that stands still answers any time alike
        """Return target_from_source: the pose of source in target, which maps points in source to points in target.

        at_ns: any time, or None; frames that stand still answer all alike.
        Raises UnknownFrame (also for a frame against itself), NotConnected.
        """
        found = self._kept.get((target, source))
        if found is None:
            if len(self._kept) >= MOST_KEPT:
                self._kept.clear()
            found = self._kept[target, source] = self._lookup(target, source)
        return Transform.of(*found)

    def _lookup(self, target: str, source: str) -> Rigid:
        """Find the way and compose what lies on it."""
        down, up = self._between(target, source)
        target_from_top: Rigid = rigid.inverse(*self._product(down)) if down else IDENTITY
        if not up:
            return target_from_top
        top_from_source = self._product(reversed(up))
        return rigid.compose(*target_from_top, *top_from_source) if down else top_from_source

    def latest(self, target: str, source: str) -> None:
        """Return no stamp, as nothing moves; raises UnknownFrame, NotConnected."""
        self._between(target, source)

    def lookup_across(
        self, target: str, target_at_ns: int | None, source: str, source_at_ns: int | None, fixed: str
    ) -> Transform:
        """Return target_from_source by way of a fixed frame, as TransformBuffer does; any times are alike."""
        return self.lookup(target, fixed, target_at_ns) @ self.lookup(fixed, source, source_at_ns)

    def lookup_many(self, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
        """Return target_from_source for each of many times, all alike; see TransformBuffer.lookup_many."""
        from frametool.frames.lookup_many import lookup_still

        return lookup_still(self, target, source, at_ns, missing=missing)

    def _product(self, children: Iterable[str]) -> Rigid:
        """Compose the edges of the named children, topmost first."""
        edges = self._edges
        product: Rigid | None = None
        for child in children:
            edge = edges[child][1]
            product = edge if product is None else rigid.compose(*product, *edge)
        return IDENTITY if product is None else product

    def _between(self, target: str, source: str) -> tuple[list[str], list[str]]:
        """Find the edges between two frames that both exist."""
        for frame in (target, source):
            if frame not in self._frames:
                raise UnknownFrame(frame, known=self._frames, where=self.name)
        return edges_between(target, source, self.parent)

    def __repr__(self) -> str:
        """Say how many frames and which roots."""
        return f"FrameTree({len(self._frames)} frames, roots: {', '.join(self.roots) or 'none'})"


def _clash(child: str, parent: str, known_parent: str) -> str:
    """Say what is wrong when an edge is given twice."""
    if parent == known_parent:
        return f"frame {child!r} has two different poses in {parent!r}"
    return f"frame {child!r} has two parents: {known_parent!r} and {parent!r}"
