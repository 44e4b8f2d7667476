"""Strict parsing of YAML and JSON text into plain values, and the place of a path in the text.

A document consists of dicts, lists, text and None: every scalar remains text as written, so that names are preserved
(`on`, `007`, `12:30`) and numbers are parsed only by `frametool.text.numbers`.  Places are not stored while reading;
they are searched when a message needs them.  For rewriting parts of a text, `parse_nodes` returns a tree of nodes with
their places.  The module knows only syntax.
"""

from __future__ import annotations

import re
import sys
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any

from frametool import sizes
from frametool.documents.source import END, LEAF, LIST, MAP, Source, error_at, levels, places_of, repeated_key, too_much
from frametool.errors import FormatError, NamedTuple
from frametool.text.numbers import odd_characters

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from frametool.documents.source import Event, InputFile, Path

_BYTE_ORDER_MARK = "\ufeff"
JSON_NUMBER = r"-?(?:0|[1-9][0-9]*+)(?:\.[0-9]++)?+(?:[eE][-+]?[0-9]++)?+"
_WORD = r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\]]|[^\s{}\[\],:"]+'
# escapes such as \ud83d without the other half of the surrogate pair
_WHOLE = r"(?s)(?:[^\\]++|\\u[dD][89abAB]..\\u[dD][c-fC-F]..|(?!\\u[dD][89a-fA-F])\\.)*+"
_BRACKETS = {"{": MAP, "[": LIST, "]": END, "}": END}


class Document(NamedTuple):
    """One document of a text: its value, its index in the text (empty ones count), and the text."""

    value: Any
    index: int  # type: ignore[assignment] # not of a tuple
    source: Source


def parse_documents(text: str, name: str, tags: Collection[str] = ()) -> list[Document]:
    """Read every document of a YAML or JSON text; empty ones are omitted.

    name: that of the text, for messages
    tags: YAML tags of mappings that are read, as in `parse_yaml`
    Values are dict, list, str or None (an empty value, `~`, `null`); keys are text, each once.
    Raises FormatError with line and column.
    """
    source = Source(name, text.removeprefix(_BYTE_ORDER_MARK))
    check_text(source)
    values = parse_json(source)
    if values is None:
        from frametool.documents.yaml import parse_yaml

        values = parse_yaml(source, tags)
    return [Document(value, index, source) for index, value in enumerate(values) if value is not None]


def check_text(source: Source) -> None:
    """Raise FormatError for a text that is too long, or has half a surrogate pair, which no encoding can write."""
    if len(source.text) > sizes.MOST_CHARACTERS:
        problem = f"longer than {sizes.MOST_CHARACTERS} characters, the most in one file; split it"
        raise FormatError(problem, source=source.name)
    if len(source.text) > sizes.MOST_VALUES and source.text.count(",") + source.text.count("\n") > sizes.MOST_VALUES:
        problem = f"more than {sizes.MOST_VALUES} commas and line ends, the most in one file; split it"
        raise FormatError(problem, source=source.name)
    try:
        source.text.encode()
    except UnicodeEncodeError as error:
        odds = ord(source.text[error.start])
        raise error_at(source, error.start, f"not UTF-8: half a character (U+{odds:04X})") from None


def events_of(text: str) -> Iterator[Event]:
    """Yield the events of a text that `parse_documents` has read: its values in order, with their places."""
    if parse_json(Source("", text)) is not None:
        return json_events(text)
    from frametool.documents.yaml import yaml_events

    return yaml_events(text)


def locate_many(text: str, paths: Sequence[Path], *, key: bool = False) -> list[tuple[int, int]]:
    """Return line and column, from 1, of the values at several paths, or of their keys, in one pass over a text.

    text: one that `parse_documents` has read
    paths: (document index, key or index, ...); a missing value gets the place of the nearest enclosing one
    """
    text = text.removeprefix(_BYTE_ORDER_MARK)
    return places_of(text, _offsets(text, paths, key=key))


def _offsets(text: str, paths: Sequence[Path], *, key: bool) -> list[int]:
    """Return the offset of the value, or of the key, at each path, in one pass over the events of a text.

    A path is (document, key or index, ...).  If the text does not have it, the offset is that of the nearest enclosing
    value.  In a list the key is the value; of equal keys the first is used.
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


def file_error(file: InputFile, what: str, line: int, path: Path, kind: type[FormatError] = FormatError) -> FormatError:
    """Return the error for a path from the top of a file's document, or for a line if the path is empty."""
    return format_error(file.source, path, what, error=kind) if path else file.error(what, line, kind=kind)


def explain_scalar(text: str) -> str:
    """Return a hint at why a scalar is found instead of a mapping; "" if no reason is known.

    Reasons are a missing blank after a colon, an invisible character, and `=` instead of a colon.
    """
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
    flow: False for a map or list without brackets
    quote: that of a scalar, * for an alias
    column: of the first character in YAML, from 0
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
    return nodes_of(events_of(text))


def nodes_of(events: Iterable[Event]) -> list[Node]:
    """Return the trees of all documents; lists and maps that are still open end with the last event."""
    roots: list[Node] = []
    opened: list[tuple[Event, list[Node]]] = []  # lists and maps that are not complete yet, with their nodes
    for event in chain(events, repeat((END, "", 0, 0, "", 0))):
        kind, word, start, end, style, column = event
        if kind not in (LEAF, END):
            opened.append((event, []))
            continue
        node = Node(start, end, word, quote=style, column=column)
        if kind == END:
            if not opened:
                break
            (kind, _, start, _, style, column), inner = opened.pop()
            pairs = zip(inner[::2], inner[1::2], strict=False)
            value: Any = inner
            if kind == MAP:  # a key that is a list or a map is left to the parser
                value = {key.value: (key, each) for key, each in pairs if isinstance(key.value, str)}
            if not style:  # without brackets it ends with its last value
                end = inner[-1].end if inner else start
            node = Node(start, end, value, bool(style), column=column)
        (opened[-1][1] if opened else roots).append(node)
    return roots


# --- JSON, which the module json reads ten times faster than any parser of YAML, without places ---


BLANKS = " \t\n\r"  # of JSON


class _NoJson(FormatError):
    """A text that is not JSON at all."""


def looks_like_json(text: str) -> bool:
    """Return True if the first non-blank character opens an array, or an object with a quoted key or no key."""
    # without a pattern: compiling it takes longer than reading a short text; `in` is True for an empty rest too
    return (begun := text.lstrip(BLANKS))[:1] == "[" or (begun[:1] == "{" and begun[1:].lstrip(BLANKS)[:1] in '"}')


def parse_json(source: Source) -> list[Any] | None:
    """Return the values of a text of one or several JSON objects or arrays; None for other text.

    Numbers and booleans remain text, null is None.  Raises FormatError for JSON that is not accepted: a duplicate key,
    half a surrogate pair, too deep, too much.
    """
    try:
        return strict_json(source) if looks_like_json(source.text) else None
    except _NoJson:
        return None


def strict_json(source: Source) -> list[Any]:
    """Return the values of a text that must be JSON; raises FormatError with the place."""
    from json import JSONDecoder

    text = source.text
    if text.count("[") + text.count("{") > sizes.MOST_CONTAINERS:
        raise error_at(source, 0, too_much(0))

    def distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        made = dict(pairs)
        if len(made) != len(pairs) or "" in made:
            raise repeated_key(source, json_events(text))
        return made

    decode = JSONDecoder(object_pairs_hook=distinct, parse_int=str, parse_float=str, parse_constant=str).raw_decode
    values: list[Any] = []
    end, limit = 0, sys.getrecursionlimit()
    sys.setrecursionlimit(limit + 4 * sizes.DEEPEST)  # the stack that json needs for deep nesting
    try:
        while begin := re.compile(r"[^ \t\n\r]").search(text, end):
            value, end = decode(text, begin.start())
            values.append(value)
    except RecursionError:
        raise _too_deep(source) from None
    except FormatError:
        raise
    except ValueError as error:
        problem = getattr(error, "msg", str(error))
        message = f"not JSON: {problem[:1].lower()}{problem[1:]}"
        raise error_at(source, getattr(error, "pos", 0), message, _NoJson) from None
    finally:
        sys.setrecursionlimit(limit)
    at = re.match(_WHOLE, text).end() if "\\u" in text else len(text)  # type: ignore[union-attr]
    if at < len(text):
        raise error_at(source, at, f"{text[at : at + 6]} is half a character; its other half is missing")
    has_words = "true" in text or "false" in text
    for depth, level in enumerate(levels(values)):
        if depth > sizes.DEEPEST:
            raise _too_deep(source)
        for outer in level if has_words else ():
            pairs = outer.items() if type(outer) is dict else enumerate(outer)
            for key in [key for key, value in pairs if value is True or value is False]:
                outer[key] = "true" if outer[key] else "false"
    return values


def json_events(text: str) -> Iterator[Event]:
    """Yield the values of a text that parse_json reads, in order, with their places."""
    from json import loads

    for token in re.finditer(_WORD, text):
        word = token[0]
        if word in _BRACKETS:
            yield _BRACKETS[word], "", token.start(), token.end(), word, 0
        elif word[0] == '"':
            text = loads(word, strict=False) if "\\" in word else word[1:-1]
            yield LEAF, text, token.start(), token.end(), '"', 0
        else:
            yield LEAF, word, token.start(), token.end(), "", 0


def _too_deep(source: Source) -> FormatError:
    """Return the error for the bracket that exceeds the depth."""
    depth = 0
    for kind, _, start, *_ in json_events(source.text):
        depth += {LEAF: 0, END: -1}.get(kind, 1)
        if depth > sizes.DEEPEST:
            return error_at(source, start, too_much(sizes.DEEPEST))
    return error_at(source, 0, too_much(sizes.DEEPEST))
