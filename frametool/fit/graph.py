"""The graph of measurements: which bodies they join, in which order a tree reaches them, what no loop checks.

Bodies are numbered, 0 is the root; a row joins a pair of them.  Knows nothing of poses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    Pairs = Sequence[tuple[int, int]]


class Groups:
    """Bodies in groups that grow together (union-find)."""

    def __init__(self, count: int, pairs: Iterable[tuple[int, int]] = ()) -> None:
        """Start with groups of one, and join some pairs."""
        self._up = list(range(count))
        for a, b in pairs:
            self.join(a, b)

    def of(self, body: int) -> int:
        """Return the number of a body's group: that of one of its bodies."""
        up = self._up
        while up[body] != body:
            up[body] = body = up[up[body]]
        return body

    def join(self, a: int, b: int) -> bool:
        """Put the group of a into that of b; return True if they were two."""
        a, b = self.of(a), self.of(b)
        self._up[a] = b
        return a != b


class SpanningTree(NamedTuple):
    """Rows that reach every body from the root on one way.

    order: the bodies, each after the one it hangs from
    above: the body each hangs from, itself for the root; row: the row that joins them, -1 for the root
    depth: how many rows from the root
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
        """Return the bodies that hang by a row."""
        hang = [False] * len(self.order)
        for body in self.order:
            hang[body] = self.row[body] == row or (self.row[body] >= 0 and hang[self.above[body]])
        return [body for body, hangs in enumerate(hang) if hangs]


def spanning_tree(count: int, pairs: Pairs, rows: Iterable[int]) -> SpanningTree:
    """Grow the tree of the first rows that close no loop (Kruskal); together the rows join all bodies."""
    groups = Groups(count)
    near: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for row in rows:
        a, b = pairs[row]
        if groups.join(a, b):
            near[a].append((b, row))
            near[b].append((a, row))
    order, above, by, depth = [0], [0] * count, [-1] * count, [0] * count
    for body in order:  # grows while it is walked
        for other, row in near[body]:
            if row != by[body]:
                above[other], by[other], depth[other] = body, row, depth[body] + 1
                order.append(other)
    return SpanningTree(order, above, by, depth)


def bridges(tree: SpanningTree, pairs: Pairs, rows: Iterable[int]) -> set[int]:
    """Return the rows of a spanning tree that are in no loop with any of these rows."""
    found = {row for row in tree.row if row >= 0}
    looped = list(range(len(tree.order)))  # the highest body that loops found so far join it with

    def top(body: int) -> int:
        while looped[body] != body:
            looped[body] = body = looped[looped[body]]
        return body

    for row in set(rows) - found:
        a, b = (top(body) for body in pairs[row])
        while a != b:
            if tree.depth[a] < tree.depth[b]:
                a, b = b, a
            found.discard(tree.row[a])
            looped[a] = tree.above[a]
            a = top(a)
    return found
