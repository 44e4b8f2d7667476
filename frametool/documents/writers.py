"""Write plain values as YAML, without the YAML library and in one style, and as JSON on one line.

    name: camera
    xyz: [1.0, 2.0e-05, 3.0]
    quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}

Text is quoted wherever YAML 1.1 or 1.2 would read something else than that text.  The caller formats floats.
"""

from __future__ import annotations

import re

from frametool.documents.source import Verbatim
from frametool.errors import ValueInvalid

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

# a letter, _ or /, then also digits . - and single blanks: never an indicator, a number or a date
_PLAIN = r"(?:[^\W\d]|/)[\w./-]*(?: [\w./-]+)*"
_WORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null", "nan", "inf", "infinity"))
_ESCAPED = r'["\\]|[^ -~\xa1-\u1fff\u3001-\ud7ff\uf900-\ufdff\U00010000-\U0003ffff]'
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
_LONGEST_KEY = 200  # characters; a parser searches the colon in the next 1024 bytes
_WIDEST_FLOW_MAP = 8
_INFINITE = float("inf")


def dump_yaml(value: Any, number: Callable[[float], str] = repr) -> str:
    """Write dicts, lists, text, numbers, booleans and None as one YAML document.

    Lists of scalars and small maps of numbers are on one line, everything else in blocks.
    number: formats a float; `1e-05` becomes `1.0e-05`, because YAML 1.1 needs the point.
    Raises ValueInvalid for nan and inf.
    """
    if (line := _one_line(value, number)) is not None and not (type(value) is dict and value):
        return f"{line}\n"
    return "\n".join(_block(value, number)) + "\n"


def flow(value: Any, number: Callable[[float], str] = repr) -> str:
    """Write a value on one line, lists and maps in brackets."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key, value)}: {flow(each, number)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(flow(each, number) for each in value) + "]"
    if isinstance(value, str):
        return str(value) if isinstance(value, Verbatim) else quoted(value)
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, float):
        return repr(value)
    if not -_INFINITE < value < _INFINITE:
        raise ValueInvalid(f"{value!r} is not finite and cannot be written")
    text = number(value)
    return text if "e" not in text or "." in text else text.replace("e", ".0e")  # with the point that YAML 1.1 needs


def quoted(text: str) -> str:
    """Write a text without quotes if that is safe, else in double quotes with escapes."""
    if text.isascii() and text.isidentifier() and len(text) <= _LONGEST_KEY and text.lower() not in _WORDS:
        return text  # most keys and names, before any pattern is compiled
    plain = len(text) <= _LONGEST_KEY and re.fullmatch(_PLAIN, text)
    if plain and text.lower() not in _WORDS and text.isprintable():
        return text
    return f'"{re.sub(_ESCAPED, _escape, text)}"'


def _key(key: str, siblings: dict[str, Any]) -> str:
    """Write a key; y after x remains without quotes, because no reader in use takes that for a boolean."""
    return key if key == "y" and "x" in siblings else quoted(key)


def _escape(match: re.Match[str]) -> str:
    """Escape a character that is not allowed in quotes; raises ValueInvalid for half a surrogate pair."""
    code = ord(match[0])
    if 0xD800 <= code < 0xE000:
        raise ValueInvalid(f"{match.string!r} holds half a character and cannot be written")
    return _ESCAPES.get(match[0]) or (f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}")


def _one_line(value: Any, number: Callable[[float], str]) -> str | None:
    """Write a scalar, a list of scalars, or a small map of numbers; return None for values that need a block."""
    if isinstance(value, dict):
        if len(value) > _WIDEST_FLOW_MAP:
            return None
        for key, each in value.items():
            if not isinstance(each, (int, float, Verbatim)) or len(key) > _LONGEST_KEY:
                return None
    elif isinstance(value, (list, tuple)) and any(isinstance(each, (dict, list, tuple)) for each in value):
        return None
    return flow(value, number)


def _block(value: Any, number: Callable[[float], str]) -> Iterator[str]:
    """Yield the lines of a list or map in blocks, without indentation."""
    if not isinstance(value, dict):
        for each in value:
            line = _one_line(each, number)
            lines = _block(each, number) if line is None else iter((line,))
            yield f"- {next(lines)}"
            yield from (f"  {below}" for below in lines)
        return
    for key, each in value.items():
        head = f"{_key(key, value)}:"
        if len(key) > _LONGEST_KEY:
            yield f"? {head[:-1]}"
            head = ":"
        line = _one_line(each, number)
        yield head if line is None else f"{head} {line}"
        if line is None:
            yield from (f"  {below}" for below in _block(each, number))


def dump_json(value: Any, number: Callable[[float], str] = repr) -> str:
    """Write plain values as JSON on one line.

    number: formats a float, which `json.dumps` does not allow
    """
    if isinstance(value, (float, Verbatim)):
        return number(value) if isinstance(value, float) else str(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{dump_json(key)}: {dump_json(each, number)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(dump_json(each, number) for each in value) + "]"
    if isinstance(value, str) and value.isascii() and value.isprintable() and '"' not in value and "\\" not in value:
        return f'"{value}"'  # most texts, without importing json
    import json

    is_plain = not isinstance(value, str) or value.isprintable()
    return json.dumps(value, ensure_ascii=not is_plain)  # escapes control characters and lone surrogates
