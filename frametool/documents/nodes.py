"""The tree of a JSON or YAML text with the place of every value, for those who rewrite parts of a text.

Knows syntax only.  The text must be one that `parse_documents` reads: nothing is checked again here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import events_of
from frametool.documents.marks import END, LEAF, MAP

if TYPE_CHECKING:
    from collections.abc import Iterator


class Node(NamedTuple):
    """A value and where it stands, from its first character up to behind its last.

    value: text of a scalar, a dict of (key node, value node) by key, or a list of nodes
    flow: a map or list in brackets; quote: the character around a scalar, * for an alias; column of its first character
    """

    start: int
    end: int
    value: Any
    flow: bool = True
    quote: str = ""
    column: int = 0

    def at(self, path: tuple[str | int, ...]) -> Node:
        """Return the node further down."""
        node: Node = self
        for step in path:
            inner: Any = node.value
            index: Any = step
            node = inner[index] if type(inner) is list else inner[index][1]
        return node

    def leaves(self) -> Iterator[Node]:
        """Yield the scalars that are values, in order."""
        pending = [self]
        while pending:
            node = pending.pop()
            if type(node.value) is dict:
                pending += [value for _, value in reversed(node.value.values())]
            elif type(node.value) is list:
                pending += reversed(node.value)
            else:
                yield node


NOTHING = Node(0, 0, {})
"""A mapping without keys."""


class _Opened:
    """A list or map whose end has not come yet."""

    __slots__ = ("column", "end", "flow", "key", "start", "value")

    def __init__(self, kind: int, start: int, column: int, *, flow: bool) -> None:
        self.value: Any = {} if kind == MAP else []
        self.start = start
        self.end = start
        self.column = column
        self.flow = flow
        self.key: Node | None = None

    def take(self, node: Node) -> None:
        """Add an item, a key, or the value of the key before it."""
        self.end = node.end
        if type(self.value) is list:
            self.value.append(node)
        elif self.key is None:
            self.key = node
        else:
            self.value[self.key.value] = self.key, node
            self.key = None

    def node(self, end: int) -> Node:
        """Return the node that ends here; what has no brackets ends with its last value."""
        return Node(self.start, end if self.flow else self.end, self.value, self.flow, column=self.column)


def parse_nodes(text: str) -> list[Node]:
    """Return the trees of all documents of a text."""
    roots: list[Node] = []
    opened: list[_Opened] = []
    for kind, word, start, end, style, column in events_of(text):
        if kind not in (LEAF, END):
            opened.append(_Opened(kind, start, column, flow=bool(style)))
            continue
        node = opened.pop().node(end) if kind == END else Node(start, end, word, quote=style, column=column)
        if opened:
            opened[-1].take(node)
        else:
            roots.append(node)
    return roots
