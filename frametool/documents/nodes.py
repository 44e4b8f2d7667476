"""The tree of a JSON or YAML text with the place of every value, for those who rewrite parts of a text.

Knows syntax only.  The text must be one that `parse_documents` reads: nothing is checked again here.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.json_reader import looks_like_json, parse_json
from frametool.documents.source import Source

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

_TOKEN = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\]]|[^\s{}\[\],:"]+')


class Node(NamedTuple):
    """A value and where it stands, from its first character up to behind its last.

    value: text of a scalar, a dict of (key node, value node) by key, or a list of nodes
    flow: a map or list in brackets; quote: the character around a scalar, if any; column of its first character
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
        if type(self.value) is dict:
            for _, value in self.value.values():
                yield from value.leaves()
        elif type(self.value) is list:
            for value in self.value:
                yield from value.leaves()
        else:
            yield self


def parse_nodes(text: str) -> list[Node]:
    """Return the trees of all documents of a text."""
    is_json = looks_like_json(text) and parse_json(Source("", text)) is not None
    return list(_json_nodes(text) if is_json else _yaml_nodes(text))


def _json_nodes(text: str) -> Iterator[Node]:
    tokens = _TOKEN.finditer(text)
    for token in tokens:
        yield _json_node(token, tokens)


def _json_node(token: re.Match[str], tokens: Iterator[re.Match[str]]) -> Node:
    from json import loads

    word = token[0]
    if word == "[":
        items = []
        while (token_in := next(tokens))[0] != "]":
            items.append(_json_node(token_in, tokens))
        return Node(token.start(), token_in.end(), items)
    if word == "{":
        pairs = {}
        while (token_in := next(tokens))[0] != "}":
            key = _json_node(token_in, tokens)
            pairs[key.value] = key, _json_node(next(tokens), tokens)
        return Node(token.start(), token_in.end(), pairs)
    quoted = word.startswith('"')
    return Node(token.start(), token.end(), loads(word, strict=False) if quoted else word, quote='"' * quoted)


def _yaml_nodes(text: str) -> Iterator[Node]:
    from frametool.documents.yaml_events import node_events

    events = node_events(text)
    for event in events:
        yield _yaml_node(event, events)


def _yaml_node(event: Any, events: Iterator[Any]) -> Node:
    """Build the node that begins with an event; block maps and lists end with their last value."""
    start, end = event.start_mark.index, event.end_mark.index
    column = event.start_mark.column
    kind = type(event).__name__
    if kind == "AliasEvent":
        return Node(start, end, "*", quote="*", column=column)
    if kind == "ScalarEvent":
        return Node(start, end, event.value, quote=event.style or "", column=column)
    value: Any = {} if kind == "MappingStartEvent" else []
    last = start
    while type(inner := next(events)).__name__ not in ("MappingEndEvent", "SequenceEndEvent"):
        node = _yaml_node(inner, events)
        if type(value) is dict:
            child = _yaml_node(next(events), events)
            value[node.value] = node, child
            last = max(node.end, child.end)
        else:
            value.append(node)
            last = node.end
    flow = bool(event.flow_style)
    return Node(start, inner.end_mark.index if flow else last, value, flow, column=column)
