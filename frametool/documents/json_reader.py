"""JSON text to plain values, and to places: knows JSON, no meaning.

The json module is ten times faster than any YAML parser and starts sooner; it keeps no places, so they are found by
a scan of their own when an error needs them.
"""

from __future__ import annotations

import re

from frametool.documents.limits import DEEPEST, MOST_CONTAINERS, too_much
from frametool.documents.marks import END, LEAF, LIST, MAP, find_marks
from frametool.documents.source import Source, error_at, place_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from frametool.documents.marks import Path, PlaceEvent
    from frametool.errors import FormatError

_BLANKS = re.compile(r"[ \t\n\r]*")
_PIECE = r'("[^"\\]*+(?:\\.[^"\\]*+)*+")|[{}\[\]]|[^\s{}\[\],:"]+'
_ESCAPE = r"(?s)\\(?:u([0-9a-fA-F]{4})|.)"
_OPENING = {"{": MAP, "[": LIST}


class _RepeatedKey(Exception):
    """Carry a key that stands twice in one object."""


def looks_like_json(text: str) -> bool:
    """Say whether the first character that is not blank opens an object or array."""
    return text.startswith(("{", "["), _BLANKS.match(text).end())  # type: ignore[union-attr]


def parse_json(source: Source) -> list[Any] | None:
    """Return the values of a text of one or several JSON objects or arrays; None if it is no JSON.

    Numbers and truth values stay text, null is None.  Raises FormatError for what is JSON but must not be:
    a key twice, half a character, too deep, too much.
    """
    if source.text.count("[") + source.text.count("{") > MOST_CONTAINERS:
        raise error_at(source, 0, too_much(0))
    try:
        values = _decoded(source.text)
    except _RepeatedKey:
        raise _repeated(source) from None
    except RecursionError:
        raise _too_deep(source) from None
    except ValueError:
        return None
    if "\\u" in source.text:
        _check_escapes(source)
    if not _settle(values):
        raise _too_deep(source)
    return values


def strict_json(source: Source) -> list[Any]:
    """Return the values of a text that must be JSON; raises FormatError with the place where it is none."""
    values = parse_json(source)
    if values is not None:
        return values
    try:
        _decoded(source.text)
    except ValueError as error:
        problem = getattr(error, "msg", str(error))
        raise error_at(source, getattr(error, "pos", 0), f"not JSON: {problem[:1].lower()}{problem[1:]}") from None
    return []


def json_marks(source: Source, paths: Sequence[Path]) -> dict[Path, tuple[tuple[int, int], tuple[int, int]]]:
    """Find the places (line, column) of keys and values in a text that parse_json reads."""
    found = find_marks(_place_events(source.text), paths)
    places = {mark: place_of(source.text, mark) for marks in found.values() for mark in marks}
    return {path: (places[key], places[value]) for path, (key, value) in found.items()}


def _decoded(text: str) -> list[Any]:
    """Decode one value after the other, up to the end."""
    from json import JSONDecoder

    decode = JSONDecoder(object_pairs_hook=_distinct, parse_int=str, parse_float=str, parse_constant=str).raw_decode
    values = []
    end = _end_of_blanks(text, 0)
    while end < len(text):
        value, end = decode(text, end)
        values.append(value)
        end = _end_of_blanks(text, end)
    return values


def _end_of_blanks(text: str, begin: int) -> int:
    """Return the offset of the next character that is not blank."""
    match = _BLANKS.match(text, begin)
    return match.end() if match else begin


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make a dict of pairs whose keys all differ and are not empty."""
    made = dict(pairs)
    if len(made) != len(pairs) or "" in made:
        raise _RepeatedKey
    return made


def _settle(values: list[Any]) -> bool:
    """Turn truth values into text, level by level; say whether there are at most DEEPEST levels."""
    level: list[Any] = [values]
    for _ in range(DEEPEST + 1):
        level = [inner for outer in level for inner in _inner(outer)]
        if not level:
            return True
    return False


def _inner(outer: Any) -> list[Any]:
    """Return the containers inside a container, whose truth values become text."""
    pairs = outer.items() if type(outer) is dict else enumerate(outer)
    for key in [key for key, value in pairs if value is True or value is False]:
        outer[key] = "true" if outer[key] else "false"
    return [value for value in (outer.values() if type(outer) is dict else outer) if type(value) in {dict, list}]


def _place_events(text: str) -> Iterator[PlaceEvent[int]]:
    """Reduce JSON's tokens to what finding places needs; the marks are offsets."""
    from json import loads

    for token in re.finditer(_PIECE, text):
        word = token[0]
        if word in {"]", "}"}:
            yield END, "", token.start()
        elif word in _OPENING:
            yield _OPENING[word], "", token.start()
        else:
            yield LEAF, loads(word, strict=False) if token[1] else word, token.start()


def _repeated(source: Source) -> FormatError:
    """Find the first key that its object holds twice, or that is empty."""
    open_keys: list[dict[str, int] | None] = []
    value_next = True
    for kind, text, mark in _place_events(source.text):
        if kind == END:
            open_keys.pop()
        elif kind == LEAF and open_keys and (keys := open_keys[-1]) is not None and not value_next:
            if not text:
                return error_at(source, mark, "an empty key")
            if text in keys:
                line, column = place_of(source.text, keys[text])
                return error_at(source, mark, f"key {text!r} stands twice; first at {line}:{column}")
            keys[text] = mark
            value_next = True
            continue
        elif kind != LEAF:
            open_keys.append({} if kind == MAP else None)
        value_next = not open_keys or open_keys[-1] is None
    return error_at(source, 0, "a key stands twice")


def _too_deep(source: Source) -> FormatError:
    """Find the bracket that is one too many."""
    depth = 0
    for kind, _, mark in _place_events(source.text):
        depth += (kind in {LIST, MAP}) - (kind == END)
        if depth > DEEPEST:
            return error_at(source, mark, too_much(DEEPEST))
    return error_at(source, 0, too_much(DEEPEST))


def _check_escapes(source: Source) -> None:
    r"""Refuse \ud83d without its other half: a text that no file can hold."""
    high = None
    for escape in re.finditer(_ESCAPE, source.text):
        code = int(escape[1] or "0", 16)
        if high is not None and not (0xDC00 <= code < 0xE000 and escape.start() == high.end()):
            raise _half(source, high)
        if high is None and 0xDC00 <= code < 0xE000:
            raise _half(source, escape)
        high = escape if 0xD800 <= code < 0xDC00 else None
    if high is not None:
        raise _half(source, high)


def _half(source: Source, escape: re.Match[str]) -> FormatError:
    """Make the error for half a surrogate pair."""
    return error_at(source, escape.start(), f"{escape[0]} is half a character; its other half is missing")
