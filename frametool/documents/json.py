"""JSON text to plain values and to places, and plain values to JSON on one line: knows JSON, no meaning.

The json module is ten times faster than any YAML parser and starts faster; it stores no places, so an error searches
them with a scan of its own.  The caller formats floats.
"""

from __future__ import annotations

import re
import sys

from frametool import sizes
from frametool.documents.source import END, LEAF, LIST, MAP, Source, Verbatim, error_at, repeated_key, too_much
from frametool.errors import FormatError

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from frametool.documents.source import Event

JSON_NUMBER = r"-?(?:0|[1-9][0-9]*+)(?:\.[0-9]++)?+(?:[eE][-+]?[0-9]++)?+"
_BLANKS = re.compile(r"[ \t\n\r]*")
_WORD = r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\]]|[^\s{}\[\],:"]+'
# escapes such as \ud83d without the other half of the surrogate pair
_WHOLE = r"(?s)(?:[^\\]++|\\u[dD][89abAB]..\\u[dD][c-fC-F]..|(?!\\u[dD][89a-fA-F])\\.)*+"
_BRACKETS = {"{": MAP, "[": LIST, "]": END, "}": END}


class _RepeatedKey(Exception):
    """A key that appears twice in one object, or is empty."""


class _NoJson(FormatError):
    """A text that is not JSON at all."""


def looks_like_json(text: str) -> bool:
    """Return True if the first non-blank character opens an array, or an object with a quoted key or no key."""
    first = _end_of_blanks(text, 0)
    if not text.startswith("{", first):
        return text.startswith("[", first)
    second = _end_of_blanks(text, first + 1)
    return second == len(text) or text[second] in '"}'


def _end_of_blanks(text: str, begin: int) -> int:
    """Return the offset of the next non-blank character."""
    match = _BLANKS.match(text, begin)
    return match.end() if match else begin


def parse_json(source: Source) -> list[Any] | None:
    """Return the values of a text of one or several JSON objects or arrays; None if it is not JSON.

    Numbers and booleans remain text, null is None.  Raises FormatError for JSON that is not accepted: a duplicate key,
    half a surrogate pair, too deep, too much.
    """
    try:
        return strict_json(source)
    except _NoJson:
        return None


def strict_json(source: Source) -> list[Any]:
    """Return the values of a text that must be JSON; otherwise raises FormatError with the place."""
    from json import JSONDecoder

    text = source.text
    if text.count("[") + text.count("{") > sizes.MOST_CONTAINERS:
        raise error_at(source, 0, too_much(0))
    decode = JSONDecoder(object_pairs_hook=_distinct, parse_int=str, parse_float=str, parse_constant=str).raw_decode
    values: list[Any] = []
    end, limit = _end_of_blanks(text, 0), sys.getrecursionlimit()
    sys.setrecursionlimit(limit + 4 * sizes.DEEPEST)  # the stack that json needs for deep nesting
    try:
        while end < len(text):
            value, end = decode(text, end)
            values.append(value)
            end = _end_of_blanks(text, end)
    except RecursionError:
        raise _too_deep(source) from None
    except _RepeatedKey:
        raise repeated_key(source, json_events(text)) from None
    except ValueError as error:
        problem = getattr(error, "msg", str(error))
        message = f"not JSON: {problem[:1].lower()}{problem[1:]}"
        raise error_at(source, getattr(error, "pos", 0), message, _NoJson) from None
    finally:
        sys.setrecursionlimit(limit)
    at = re.match(_WHOLE, text).end() if "\\u" in text else len(text)  # type: ignore[union-attr]
    if at < len(text):
        raise error_at(source, at, f"{text[at : at + 6]} is half a character; its other half is missing")
    if not _settle(values, text):
        raise _too_deep(source)
    return values


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a dict of pairs whose keys all differ and are not empty."""
    made = dict(pairs)
    if len(made) != len(pairs) or "" in made:
        raise _RepeatedKey
    return made


def _settle(values: list[Any], text: str) -> bool:
    """Convert booleans to text, level by level; return True if there are at most sizes.DEEPEST levels."""
    has_words = "true" in text or "false" in text
    level: list[Any] = [values]
    for _ in range(sizes.DEEPEST + 1):
        if has_words:
            for outer in level:
                pairs = outer.items() if type(outer) is dict else enumerate(outer)
                for key in [key for key, value in pairs if value is True or value is False]:
                    outer[key] = "true" if outer[key] else "false"
        level = [
            inner
            for outer in level
            for inner in (outer.values() if type(outer) is dict else outer)
            if type(inner) is dict or type(inner) is list
        ]
        if not level:
            return True
    return False


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


def dump(value: Any, number: Callable[[float], str] = repr) -> str:
    """Write plain values as JSON on one line; `number` formats the floats.

    json.dumps does not allow that.
    """
    if isinstance(value, (float, Verbatim)):
        return number(value) if isinstance(value, float) else str(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{dump(key)}: {dump(each, number)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(dump(each, number) for each in value) + "]"
    if isinstance(value, str) and value.isascii() and value.isprintable() and '"' not in value and "\\" not in value:
        return f'"{value}"'  # most texts, without importing json
    import json

    is_plain = not isinstance(value, str) or value.isprintable()
    return json.dumps(value, ensure_ascii=not is_plain)  # escapes control characters and lone surrogates
