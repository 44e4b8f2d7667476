"""Frames at one time: all edges at that time, those without data, and all poses in one frame."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import BadTopology, LookupFailed
from frametool.geometry import rigid
from frametool.geometry.rigid import IDENTITY

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid


class SeenPose(NamedTuple):
    """The pose of a frame in another one.

    reach: the largest coordinate on the path, in metres; rounding is proportional to it
    """

    components: Rigid
    reach: float


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

    def seen_from(self, start: str) -> dict[str, SeenPose]:
        """Return the pose in `start` of every frame connected to it.

        For the latest time, moving frames are looked up one by one: each at the time common to the edges of its path.
        """
        if self.at_ns is None and self.tree.moves:
            return self._looked_up(start)
        found = {start: SeenPose(IDENTITY, 0.0)}
        pending = [start]
        for frame in pending:  # it grows during the loop
            if frame in self.edges and (parent := self.edges[frame][0]) not in found:
                found[parent] = _further(found[frame], rigid.inverse(*self.edges[frame][1]))
                pending.append(parent)
            for child in self._children.get(frame, ()):
                if child not in found:
                    found[child] = _further(found[frame], self.edges[child][1])
                    pending.append(child)
        return found

    def _looked_up(self, start: str) -> dict[str, SeenPose]:
        """Look up every frame that is connected and has a common time."""
        found = {}
        for frame in self.tree.frames:
            try:
                pose = self.tree.lookup_components(start, frame)
                way = self.tree.way(start, frame)
            except (LookupFailed, BadTopology):
                continue
            found[frame] = SeenPose(pose, max(map(_size, [pose, *(track.components for track in way)])))
        return found


def _further(seen: SeenPose, step: Rigid) -> SeenPose:
    """Return the pose after one more edge."""
    pose = rigid.compose(*seen.components, *step)
    return SeenPose(pose, max(seen.reach, _size(step), _size(pose)))


def _size(pose: Rigid) -> float:
    x, y, z = map(abs, pose[:3])
    return float(max(x, y, z))
