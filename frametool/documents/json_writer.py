"""Plain values to JSON text on one line; how floats are written is the caller's."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


class Verbatim(str):
    """A number or truth value as it was written; it is written so again, without quotes."""

    __slots__ = ()


def dump(value: Any, number: Callable[[float], str] = repr) -> str:
    """Write plain values as JSON on one line; `number` writes the floats.

    Not json.dumps, because that has no say in how floats are written.
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
    return json.dumps(value, ensure_ascii=not is_plain)  # control characters and lone surrogates reach no terminal raw
