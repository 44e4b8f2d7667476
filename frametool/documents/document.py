"""Strict parsing of YAML and JSON text into plain values, and the place of a path in the text.

A document consists of dicts, lists, text and None: every scalar remains text as written, so that names are preserved
(`on`, `007`, `12:30`) and numbers are parsed only by `frametool.text.numbers`.  Places are not stored while reading;
they are searched when a message needs them.  To rewrite parts of a text there is a tree of its nodes, with the place
of each.  Knows syntax only.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from frametool import sizes
from frametool.documents.json import json_events, looks_like_json, parse_json
from frametool.documents.source import END, LEAF, LIST, MAP, UTF16, Source, check_text, decode, error_at, places_of
from frametool.errors import FormatError
from frametool.text.numbers import odd_characters

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence
    from typing import BinaryIO

    from frametool.documents.source import Event, Path
    from frametool.text.lines import ByteStream

_BYTE_ORDER_MARK = "\ufeff"


class Document:
    """One document of a text: its value, its index in the text (empty ones count), and the text."""

    __slots__ = ("index", "source", "value")

    def __init__(self, value: Any, index: int, source: Source) -> None:
        """Store the three."""
        self.value, self.index, self.source = value, index, source


def parse_documents(text: str, name: str, tags: Collection[str] = ()) -> list[Document]:
    """Read every document of a YAML or JSON text; empty ones are omitted.

    name: of the text, for messages.  tags: YAML tags of mappings that are read, as in `parse_yaml`.
    Values are dict, list, str or None (an empty value, `~`, `null`); keys are text, each once.
    Raises FormatError with line and column.
    """
    source = Source(name, text.removeprefix(_BYTE_ORDER_MARK))
    check_text(source)
    values = parse_json(source) if looks_like_json(source.text) else None
    if values is None:
        from frametool.documents.yaml import parse_yaml

        values = parse_yaml(source, tags)
    return [Document(value, index, source) for index, value in enumerate(values) if value is not None]


def events_of(text: str) -> Iterator[Event]:
    """Yield the values of a text that parse_documents has read, in order, with their places."""
    if looks_like_json(text) and parse_json(Source("", text)) is not None:
        return json_events(text)
    from frametool.documents.yaml import yaml_events

    return yaml_events(text)


def locate_many(text: str, paths: Sequence[Path], *, key: bool = False) -> list[tuple[int, int]]:
    """Return line and column, from 1, of the values at several paths, or of their keys, in one pass over a text.

    text: one that `parse_documents` has read.
    path: (document index, key or index, ...).  A missing value gets the place of the nearest enclosing one.
    """
    text = text.removeprefix(_BYTE_ORDER_MARK)
    return places_of(text, _offsets(text, paths, key=key))


def _offsets(text: str, paths: Sequence[Path], *, key: bool) -> list[int]:
    """Iterate over the events of a text, and return the offset of the value, or of the key, at each path.

    A path is (document, key or index, ...).  If the text does not have it, the offset is that of the nearest enclosing
    value.  In a list the key is the value; the first of equal keys counts.
    """
    wanted = {path[:length] for path in paths for length in range(1, len(path) + 1)}
    found: dict[Path, tuple[int, int]] = {}  # the offsets of the key and of the value
    outer: list[tuple[Path, str | int | None]] = []
    path: Path = ()
    step: str | int | None = 0  # the next index or key; None when a key is expected
    key_start = 0
    for kind, word, start, *_ in events_of(text) if paths else ():
        if kind == END:
            path, step = outer.pop()
            continue
        if step is None:
            step, key_start = word, start
            continue
        here = (*path, step)
        if here in wanted and here not in found:
            found[here] = (start if type(step) is int else key_start, start)
            if len(found) == len(wanted):
                break
        step = step + 1 if isinstance(step, int) else None
        if kind != LEAF:
            outer.append((path, step))
            path, step = here, 0 if kind == LIST else None
    offsets = []
    for each in paths:
        length = next((length for length in range(len(each), 0, -1) if each[:length] in found), 0)
        offsets.append(found[each[:length]][not (key and length == len(each))] if length else 0)
    return offsets


def format_error(
    source: Source, path: Path, message: str, *, key: bool = False, error: type[FormatError] = FormatError
) -> FormatError:
    """Return the error for a value, or its key, at a path: with the place, the source line and a caret."""
    bare = source._replace(text=source.text.removeprefix(_BYTE_ORDER_MARK))
    (offset,) = _offsets(bare.text, [path], key=key)
    return error_at(bare, offset, message, error)


def explain_scalar(text: str) -> str:
    """Return why a text is found instead of a mapping: no blank after a colon, an invisible character; or ""."""
    if match := re.match(r"([\w./-]+):(?=[^\s:/])", text):
        return f"write a blank after '{match[1]}:'"
    if ":" in text and (strange := odd_characters(text)):
        return f"it has {strange}; use an ordinary blank"
    if match := re.match(r"([\w./-]+) ?=", text):
        return f"write '{match[1]}: ' instead of '='"
    return ""


class Node(NamedTuple):
    """A value and its range in the text, from its first character to after its last.

    value: text of a scalar, a dict of (key node, value node) by key, or a list of nodes
    flow: a map or list in brackets; quote: the quotes of a scalar, * for an alias; column of its first character
    """

    start: int
    end: int
    value: Any
    flow: bool = True
    quote: str = ""
    column: int = 0

    def at(self, path: tuple[str | int, ...]) -> Node:
        """Return the node at a path; raises FormatError below an alias."""
        node: Node = self
        for step in path:
            refuse_alias(node)
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


class Aliased(FormatError):
    """A YAML alias: its value is defined elsewhere, and may be shared."""

    def in_text(self, text: str) -> Aliased:
        """Return the error for the first alias in a text."""
        aliases = (leaf.start for root in parse_nodes(text) for leaf in root.leaves() if leaf.quote == "*")
        ((self.line, self.column),) = places_of(text, [next(aliases, 0)])
        return self


def refuse_alias(node: Node) -> None:
    """Raise Aliased for an alias of YAML."""
    if node.quote == "*":
        raise Aliased("a YAML alias is in place of what is rewritten; replace it by its value")


def parse_nodes(text: str) -> list[Node]:
    """Return the trees of all documents of a text that `parse_documents` has read, without checks."""
    roots: list[Node] = []
    opened: list[tuple[Event, list[Node]]] = []  # lists and maps that are not complete yet, with their nodes
    for event in events_of(text):
        kind, word, start, end, style, column = event
        if kind not in (LEAF, END):
            opened.append((event, []))
            continue
        node = Node(start, end, word, quote=style, column=column)
        if kind == END:
            (kind, _, start, _, style, column), inner = opened.pop()
            pairs = zip(inner[::2], inner[1::2], strict=False)
            value: Any = {key.value: (key, each) for key, each in pairs} if kind == MAP else inner
            if not style:  # without brackets it ends with its last value
                end = inner[-1].end if inner else start
            node = Node(start, end, value, bool(style), column=column)
        (opened[-1][1] if opened else roots).append(node)
    return roots


# --- text in pieces that end at a document or a line: recordings of any size in bounded memory ---


class Piece(NamedTuple):
    """Complete documents or lines of a text, and the number of their first line, from 1."""

    text: str
    line: int


def lines(stream: BinaryIO, name: str, whole: Callable[[bytes], int] | None = None) -> Iterator[Piece]:
    """Split a stream after line ends; a piece has as many lines as arrived in one block.

    whole: as in `read_blocks`.  Line ends become those of Unix, which does not change line numbers.
    Raises FormatError if it is not UTF-8, and for a line or document that is too long.
    """
    from frametool.text.lines import read_blocks, whole_lines

    line = 1
    blocks = read_blocks(cast("ByteStream", stream), whole=whole or whole_lines, longest=sizes.MOST_CHARACTERS)
    for block in blocks:
        if block.startswith(UTF16):  # which has other line ends
            block += b"".join(blocks)  # noqa: PLW2901
        with counted_from(line):
            text = decode(block, name)
        yield Piece(text.replace("\r\n", "\n") if "\r" in text else text, line)
        line += text.count("\n")


def documents(stream: BinaryIO, name: str) -> Iterator[Piece]:
    """Split a stream after lines that end in `---`; a piece has as many documents as arrived in one block."""
    return lines(stream, name, _whole_documents)


def _whole_documents(text: bytes) -> int:
    """Return the number of bytes up to the last line that ends in `---`; negative: that many lines have none.

    `ros2 topic echo` appends the three dashes to its note about a lost message.
    """
    ends = (text.rfind(end) + len(end) for end in (b"---\n", b"---\r\n") if end in text)
    return max(ends, default=-1 - text.rfind(b"\n"))


@contextmanager
def counted_from(line: int) -> Iterator[None]:
    """Make errors of a piece name the line in the whole file; `line` is the number of the piece's first line."""
    try:
        yield
    except FormatError as error:
        error.line += line - 1 if error.line else 0
        raise
