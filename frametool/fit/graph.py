"""The graph of measurements: frames that are fixed to each other form bodies, and rows join pairs of bodies.

Connectivity, spanning trees, and rows that are in no loop.  Bodies are numbered, 0 is the root.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, alternatives, listing, shown
from frametool.frames.topology import Groups
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from frametool.frames.lookups import Frames
    from frametool.stream.measurements import Measurement

    Pairs = Sequence[tuple[int, int]]

class SpanningTree(NamedTuple):
    """Rows that connect every body to the root by one path.

    order: the bodies, each after its parent
    above: the parent of each body, itself for the root; row: the row that joins them, -1 for the root
    depth: the number of rows from the root
    """

    order: list[int]
    above: list[int]
    row: list[int]
    depth: list[int]

    def way(self, a: int, b: int) -> list[int]:
        """Return the rows between two bodies."""
        rows = []
        while a != b:
            if self.depth[a] < self.depth[b]:
                a, b = b, a
            rows.append(self.row[a])
            a = self.above[a]
        return rows

    def beyond(self, row: int) -> list[int]:
        """Return the bodies below a row."""
        hang = [False] * len(self.order)
        for body in self.order:
            hang[body] = self.row[body] == row or (self.row[body] >= 0 and hang[self.above[body]])
        return [body for body, hangs in enumerate(hang) if hangs]


def spanning_tree(count: int, pairs: Pairs, rows: Iterable[int]) -> SpanningTree:
    """Return the tree of the first rows that close no loop (Kruskal); together the rows join all bodies."""
    groups = Groups[int]()
    near: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for row in rows:
        a, b = pairs[row]
        if groups.join(a, b):
            near[a].append((b, row))
            near[b].append((a, row))
    order, above, by, depth = [0], [0] * count, [-1] * count, [0] * count
    for body in order:  # grows during the loop
        for other, row in near[body]:
            if row != by[body]:
                above[other], by[other], depth[other] = body, row, depth[body] + 1
                order.append(other)
    return SpanningTree(order, above, by, depth)


def bridges(tree: SpanningTree, pairs: Pairs, rows: Iterable[int]) -> set[int]:
    """Return the rows of a spanning tree that are in no loop with any of these rows."""
    found = {row for row in tree.row if row >= 0}
    looped = Groups[int]()  # bodies joined by loops so far; the highest represents them
    for row in set(rows) - found:
        a, b = map(looped.of, pairs[row])
        while a != b:
            if tree.depth[a] < tree.depth[b]:
                a, b = b, a
            found.discard(tree.row[a])
            looped.join(a, tree.above[a])
            a = looped.of(a)
    return found


MOST = 1000  # frames
LISTED = 150  # characters of names in the message about unconnected frames


class Bodies(NamedTuple):
    """The bodies formed by measured and fixed frames.

    frames: in order of first mention; number: the body of each, 0 for the root's
    pose: of each frame in its body; in the root's body, in the root
    """

    root: str
    frames: tuple[str, ...]
    number: dict[str, int]
    pose: dict[str, Transform]

    @property
    def size(self) -> int:
        """Return how many bodies there are."""
        return 1 + max(self.number.values())


def bodies_of(measurements: Sequence[Measurement], root: str | None, fixed: Frames) -> Bodies:
    """Group frames into bodies; raises ValueInvalid for an unknown root."""
    edges = [*((m.parent, m.child) for m in measurements), *((each.parent, each.child) for each in fixed.tracks())]
    frames = tuple(dict.fromkeys(name for edge in edges for name in edge))
    if len(frames) > MOST:
        raise ValueInvalid(f"{len(frames)} frames; solve takes at most {MOST}")
    if root is None:
        children = {child for _, child in edges}
        root = next((name for name in frames if name not in children), frames[0])
    elif root not in frames:
        raise ValueInvalid(f"unknown root {shown(root)}{alternatives(root, frames, 'frames')}")
    first: dict[str, str] = {}  # of each body, by the top of its tree
    for name in (root, *frames):
        first.setdefault(top_of(fixed, name), name)
    number = {top: at for at, top in enumerate(first)}
    anchors = {name: first[top_of(fixed, name)] for name in frames}
    pose = {name: Transform.identity() if name == at else fixed.lookup(at, name) for name, at in anchors.items()}
    return Bodies(root, frames, {name: number[top_of(fixed, name)] for name in frames}, pose)


def top_of(fixed: Frames, name: str) -> str:
    """Return the root of the tree of fixed frames that holds a frame."""
    while name in fixed.frames and (above := fixed.parent(name)) is not None:
        name = above
    return name


def require_connected(bodies: Bodies, pairs: Iterable[tuple[int, int]]) -> None:
    """Raise ValueInvalid, with the groups of frames, if rows do not join all bodies."""
    joined = Groups[int]()
    for pair in pairs:
        joined.join(*pair)
    groups: dict[int, list[str]] = {}
    for name in bodies.frames:
        groups.setdefault(joined.of(bodies.number[name]), []).append(name)
    if len(groups) > 1:
        most = next(most for most in (*range(20, 0, -1), 0) if not most or len(_grouped(groups, most)) <= LISTED)
        raise ValueInvalid(f"no measurement connects {_grouped(groups, max(most, 1))[:LISTED]}")


def _grouped(groups: dict[int, list[str]], most: int) -> str:
    parts = [listing(names, most) for names in list(groups.values())[: most + (len(groups) == most + 1)]]
    more = len(groups) - len(parts)
    return " | ".join(parts) + (f" | {more} more groups" if more else "")
