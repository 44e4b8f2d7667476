"""A tree of frames that stand still relative to one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import BadTopology, shown
from frametool.frames.lookups import Frames
from frametool.frames.path import cycle_message, to_root
from frametool.frames.policy import FRAMETOOL
from frametool.frames.track import StandingTrack

if TYPE_CHECKING:
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Rigid


class FrameTree(Frames):
    """Hold frames and the fixed transforms between them; answer where one is seen from another.

    Several roots are fine. Every frame has at most one parent, and no frame is its own ancestor.

        tree = FrameTree()
        tree.add("base", "camera", base_from_camera)
        tree.lookup("camera", "base")               # camera_from_base
    """

    def __init__(self, name: str = "") -> None:
        """Create an empty tree; `name` says in error messages where the frames come from."""
        super().__init__(name, FRAMETOOL)
        self._upward: dict[str, str] = {}  # frame -> some ancestor of it; shortened as it is walked

    def add(self, parent: str, child: str, transform: Transform) -> None:
        """Hang a frame under a parent; `transform` is parent_from_child, the pose of the child in its parent.

        Adding an edge again with the same numbers changes nothing.
        Raises BadTopology for a second parent, other numbers for the same edge, a cycle, or a frame in itself.
        """
        self.add_components(parent, child, transform.components)

    def add_components(self, parent: str, child: str, components: Rigid) -> None:
        """Add an edge given as tx, ty, tz (metres), x, y, z, w (unit quaternion); otherwise as `add`."""
        known = self._tracks.get(child)
        if known is not None and known.standing:
            self.policy.stand(known, parent, components)
            return
        if parent == child:
            raise BadTopology(f"frame {shown(child)} is its own parent", rule="self")
        if child in self._frames and self._root_of(parent) == child:
            raise BadTopology(cycle_message([*to_root(parent, self.parent), parent]), rule="cycle")
        self._frames[parent] = None
        self._frames[child] = None
        self._tracks[child] = StandingTrack(child, parent, components)
        self._queries.clear()
        self._upward[child] = parent

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

    def __repr__(self) -> str:
        """Return how many frames there are and which roots."""
        return f"FrameTree({len(self._frames)} frames, roots: {', '.join(self.roots) or 'none'})"
