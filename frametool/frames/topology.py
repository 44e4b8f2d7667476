"""The rules of a tree: one parent per frame, one pose in it, no cycle; the errors for edges that break them; snapshots.

Each error is a BadTopology without a place: a tree raises it, a loader adds where both edges are, `check` lists it.
"""

from __future__ import annotations

from collections.abc import Hashable
from contextlib import suppress
from functools import cached_property
from math import isfinite
from typing import Generic, TypeVar

from frametool.errors import BadTopology, LookupFailed, NotConnected, ValueInvalid, bare, shown
from frametool.geometry import rigid
from frametool.geometry.representations import EARTH_FRAMES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Container, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Components, Rigid

MOST_SHOWN = 16  # frames of a cycle


Member = TypeVar("Member", bound=Hashable)


class Groups(Generic[Member]):
    """Disjoint sets of connected frames or bodies (union-find)."""

    def __init__(self) -> None:
        """Create an empty partition: every member is alone."""
        self._up: dict[Member, Member] = {}

    def of(self, member: Member) -> Member:
        """Return the representative of a member's set; the path to it is halved (path halving)."""
        up = self._up
        while (above := up.get(member)) is not None:
            further = up.get(above)
            if further is None:
                return above
            up[member] = further
            member = further
        return member

    def join(self, one: Member, other: Member) -> bool:
        """Merge the sets of two members; return False if they are the same already."""
        one, other = self.of(one), self.of(other)
        if one != other:
            self._up[one] = other
        return one != other


def resolve_name(frame: str, known: Container[str]) -> str:
    """Return the name of a frame among known names: the Earth has two, `ecef` and `earth`."""
    if frame in EARTH_FRAMES and frame not in known:
        return next((other for other in EARTH_FRAMES if other in known), frame)
    return frame


def to_root(frame: str, parent_of: Callable[[str], str | None]) -> list[str]:
    """Return a frame and its ancestors, root last.

    Raises BadTopology if the ancestors form a cycle.
    """
    line = {frame: None}
    parent = parent_of(frame)
    while parent is not None:
        if parent in line:
            raise cycle([*[*line][[*line].index(parent) :], parent])
        line[parent] = None
        parent = parent_of(parent)
    return [*line]


def edges_between(target: str, source: str, parent_of: Callable[[str], str | None]) -> tuple[list[str], list[str]]:
    """Return the edges between two frames, each by its child.

    Returns (down, up): `down` leads from the common ancestor to the target, `up` from the source to that ancestor;
    target_from_source = inverse(product of down) @ product of reversed up.
    Raises NotConnected, naming both roots.
    """
    target_line = to_root(target, parent_of)
    source_line = to_root(source, parent_of)
    if target_line[-1] != source_line[-1]:
        raise NotConnected(
            f"{shown(target)} and {shown(source)} are not connected: "
            f"{shown(target)} hangs from root {shown(target_line[-1])}, "
            f"{shown(source)} from root {shown(source_line[-1])}",
            target=target, source=source, target_root=target_line[-1], source_root=source_line[-1],
        )  # fmt: skip
    while target_line and source_line and target_line[-1] == source_line[-1]:
        target_line.pop()
        source_line.pop()
    return target_line[::-1], source_line


def check_edge(parent: str, child: str, components: Rigid) -> None:
    """Refuse an invalid edge; raises ValueInvalid, BadTopology."""
    if not parent or not child:
        raise ValueInvalid(f"an edge needs two frames, found parent {shown(parent)} and child {shown(child)}")
    if parent == child:
        raise own_parent(child)
    if not all(map(isfinite, components)):
        numbers = " ".join(map(repr, components))
        raise ValueInvalid(f"the pose of {shown(child)} in {shown(parent)} is not finite: {numbers}")


def check_same(child: str, known: tuple[str, Rigid], found: tuple[str, Rigid]) -> None:
    """Refuse another parent or pose of a static frame; both are (parent, components)."""
    if found[0] != known[0]:
        raise two_parents(child, known[0], found[0])
    if found[1] != known[1]:
        raise two_poses(child, found[0])


def own_parent(child: str) -> BadTopology:
    """Return the error for a frame in itself."""
    return BadTopology(f"frame {shown(child)} is its own parent", rule="self")


def two_parents(child: str, one: str, other: str, places: Sequence[str] = ()) -> BadTopology:
    """Return the error for a static frame with two parents; `places` states where each is named, if known."""
    parents = [f"{shown(parent)} ({at})" for parent, at in zip((one, other), places, strict=False)]
    named = " and ".join(parents or (shown(one), shown(other)))
    return BadTopology(f"frame {shown(child)} has two parents: {named}", rule="two-parents")


def two_poses(child: str, parent: str) -> BadTopology:
    """Return the error for a static frame with two poses in its parent."""
    return BadTopology(f"frame {shown(child)} has two different poses in {shown(parent)}", rule="two-poses")


def two_covariances(parent: str, child: str, one: Components | None, other: Components | None) -> BadTopology:
    """Return the error for an edge with two different covariances."""
    what = "two different covariances" if one and other else "a covariance in one place and none in another"
    return BadTopology(f"frame {shown(child)} in {shown(parent)} has {what}", rule="two-covariances")


def static_and_moving(child: str, details: str = " is both static and moving") -> BadTopology:
    """Return the error for a frame that is both static and moving; `details` states where."""
    return BadTopology(f"frame {shown(child)}{details}", rule="static-and-moving")


def cycle(frames: list[str]) -> BadTopology:
    """Return the error for a cycle, parents to the left: `a <- b <- a`; shortened in the middle if it is long."""
    if len(frames) > MOST_SHOWN + 1:
        frames = [*frames[: MOST_SHOWN // 2], f"({len(frames) - MOST_SHOWN} more)", *frames[-MOST_SHOWN // 2 :]]
    return BadTopology(f"frames form a cycle: {' <- '.join(map(bare, reversed(frames)))}", rule="cycle")


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
