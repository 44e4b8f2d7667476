"""Frames at one time: all edges at that time, those without data, and all poses in one frame."""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING

from frametool.errors import BadTopology, LookupFailed
from frametool.geometry import rigid

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid


class Snapshot:
    """The edges of a tree at one time, or each at its own latest time.

    edges: child -> its parent and its pose there, parent_from_child
    without_data: the moving frames that have no data at that time
    """

    def __init__(self, tree: Frames, at_ns: int | None = None) -> None:
        """Collect the edges of a tree; `at_ns` None is the latest of each."""
        self.tree = tree
        self.at_ns = at_ns
        self.edges: dict[str, tuple[str, Rigid]] = {}
        self.without_data: set[str] = set()
        for track in tree.tracks():
            pose = track.components if at_ns is None else track.at(at_ns)
            parent = track.parent if at_ns is None else track.parent_at(at_ns)
            if pose is None or parent is None:
                self.without_data.add(track.child)
            else:
                self.edges[track.child] = parent, pose

    def parent(self, frame: str) -> str | None:
        """Return a frame's parent; None for a root, and if there are no data."""
        return self.edges[frame][0] if frame in self.edges else None

    @cached_property
    def roots(self) -> dict[str, str]:
        """Return the root above each frame, itself for a root; frames with the same root are connected."""
        roots: dict[str, str] = {}
        for frame in self.tree.frames:
            line: dict[str, None] = {}
            above: str | None = frame
            while above is not None and above not in roots and above not in line:
                line[above] = None
                above = self.parent(above)
            root = next(reversed(line)) if line and above is None else frame if above in line else roots[above or frame]
            roots.update(dict.fromkeys(line, root))
        return roots

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
