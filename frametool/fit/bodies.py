"""Bodies of frames that are fixed to each other, and the graph that measurements make of them: trees and bridges."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, alternatives, bare, first_of, shown
from frametool.frames.topology import Groups, Snapshot
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from frametool.fit.blunders import Measurement
    from frametool.frames.lookups import Frames

    Pairs = Sequence[tuple[int, int]]


class SpanningTree(NamedTuple):
    """Rows that connect every body to the root by one path.

    order: the bodies, each after its parent
    parent: the parent of each body, itself for the root; row: the row that joins them, -1 for the root
    depth: the number of rows from the root
    """

    order: list[int]
    parent: list[int]
    row: list[int]
    depth: list[int]

    def rows_between(self, a: int, b: int) -> list[int]:
        """Return the rows between two bodies."""
        rows = []
        while a != b:
            if self.depth[a] < self.depth[b]:
                a, b = b, a
            rows.append(self.row[a])
            a = self.parent[a]
        return rows


def spanning_tree(count: int, pairs: Pairs, rows: Iterable[int]) -> SpanningTree:
    """Return the tree of the first rows that close no loop (Kruskal); together the rows join all bodies."""
    groups = Groups[int]()
    near: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for row in rows:
        a, b = pairs[row]
        if groups.join(a, b):
            near[a].append((b, row))
            near[b].append((a, row))
    order, parent, by, depth = [0], [0] * count, [-1] * count, [0] * count
    for body in order:  # grows during the loop
        for other, row in near[body]:
            if row != by[body]:
                parent[other], by[other], depth[other] = body, row, depth[body] + 1
                order.append(other)
    return SpanningTree(order, parent, by, depth)


def bridges(tree: SpanningTree, pairs: Pairs, rows: Iterable[int]) -> set[int]:
    """Return the rows of a spanning tree that are in no loop with any of these rows."""
    found = {row for row in tree.row if row >= 0}
    for row in set(rows) - found:
        found.difference_update(tree.rows_between(*pairs[row]))
    return found


MOST = 1000  # frames


class Bodies(NamedTuple):
    """The bodies formed by measured and fixed frames.

    frames: in order of first mention; number: the body of each, 0 for the root's
    pose: of each frame in its body; in the root's body, in the root
    """

    root: str
    frames: tuple[str, ...]
    number: dict[str, int]
    pose: dict[str, Transform]


def bodies_of(measurements: Sequence[Measurement], root: str | None, fixed: Frames) -> Bodies:
    """Group frames into bodies; raises ValueInvalid for an unknown root, and if frames are not connected."""
    edges = [*((m.parent, m.child) for m in measurements), *((each.parent, each.child) for each in fixed.tracks())]
    frames = tuple(dict.fromkeys(name for edge in edges for name in edge))
    if len(frames) > MOST:
        raise ValueInvalid(f"{len(frames)} frames; solve takes at most {MOST}")
    if root is None:
        children = {child for _, child in edges}
        root = next((name for name in frames if name not in children), frames[0])
    elif root not in frames:
        raise ValueInvalid(f"unknown root {shown(root)}{alternatives(root, frames, 'frames')}")
    joined, groups = Groups[str](), dict[str, list[str]]()
    for edge in edges:
        joined.join(*edge)
    for name in frames:
        groups.setdefault(joined.of(name), []).append(name)
    if len(groups) > 1:
        texts = [first_of(sorted(group), 3, quote=bare) for group in groups.values()]
        raise ValueInvalid(f"no measurement connects {first_of(texts, 3, gap=' | ')}")
    tops = {name: name for name in frames} | Snapshot(fixed).roots
    first: dict[str, str] = {}  # of each body, by the top of its tree
    for name in (root, *frames):
        first.setdefault(tops[name], name)
    number = {top: at for at, top in enumerate(first)}
    anchors = {name: first[tops[name]] for name in frames}
    pose = {name: Transform.identity() if name == at else fixed.lookup(at, name) for name, at in anchors.items()}
    return Bodies(root, frames, {name: number[tops[name]] for name in frames}, pose)
