"""Readers of the single values in scenes and leader files; what does not fit raises Misfit, which names its place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, alternatives, shown
from frametool.frames.stamps import parse_stamp
from frametool.grammar.readers import Misfit, as_mapping, kind, within
from frametool.sim.scene import LONGEST, LONGEST_NS
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping
    from typing import TypeVar

    Value = TypeVar("Value")

LONGEST_INTEGER = 30  # digits


def guarded(call: Callable[..., Value], *arguments: Any, **options: Any) -> Value:
    """Call what refuses values; what it refuses can then be placed."""
    try:
        return call(*arguments, **options)
    except ValueInvalid as error:
        raise Misfit(str(error)) from None


def text_reader(parse: Callable[[str], Value], what: str) -> Callable[[Any], Value]:
    """Return the reader of values for a parser of text; `what` says in errors what is expected."""

    def read(value: Any) -> Value:
        if type(value) is not str:
            raise Misfit(f"expected {what}, found {kind(value)}")
        return guarded(parse, value)

    return read


def one_of(names: Collection[str]) -> Callable[[Any], str]:
    """Return the reader of one of several words."""

    def parse(text: str) -> str:
        if text not in names:
            raise ValueInvalid(f"unknown {shown(text)}{alternatives(text, names, 'choices')}")
        return text

    return text_reader(parse, f"one of {', '.join(names)}")


def known_keys(value: Any, keys: Collection[str], what: str) -> dict[str, Any]:
    """Take a value for a mapping with some of these keys."""
    mapping = as_mapping(value, what)
    if unknown := [key for key in mapping if key not in keys]:
        known = alternatives(unknown[0], keys, "keys")
        raise Misfit(f"unknown key {shown(unknown[0])}{known}", (unknown[0],), key=True)
    return mapping


def field(mapping: Mapping[str, Any], key: str, read: Callable[[Any], Value], default: Any) -> Value:
    """Read the value of a key, or its default."""
    value: Value = within((key,), read, mapping.get(key, default))
    return value


def _radians(text: str) -> float:
    value, unit = parse_angle(text)
    return math.radians(value) if unit == "deg" else value


def _stamp(text: str) -> int:
    stamp_ns = parse_stamp(text)
    if stamp_ns > LONGEST_NS:
        raise ValueInvalid(f"{text} s is more than {LONGEST} s")
    return stamp_ns


def _time(text: str) -> int:
    stamp_ns = _stamp(text)
    if stamp_ns < 0:
        raise ValueInvalid(f"{text} s is before the start, which is 0")
    return stamp_ns


def _endless(text: str) -> int | None:
    return None if text in ("inf", ".inf") else _time(text)


def _boolean(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueInvalid(f"expected true or false, found {shown(text)}")
    return text == "true"


def _integer(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) <= LONGEST_INTEGER):
        raise ValueInvalid(f"expected a whole number, found {shown(text)}")
    return int(text)


def _byte(text: str) -> float:
    value = parse_number(text)
    if not (0.0 <= value <= 255.0 and value.is_integer()):
        raise ValueInvalid(f"expected a whole number 0 .. 255, found {text}")
    return value


def _flag(text: str) -> float:
    return float(_boolean(text)) if text in ("true", "false") else parse_number(text)


read_number = text_reader(parse_number, "a number")
read_byte = text_reader(_byte, "a whole number 0 .. 255")
read_angle = text_reader(_radians, "an angle in radians, or like 90deg")
read_stamp = text_reader(_stamp, "a time in seconds")
read_time = text_reader(_time, "a time in seconds")
read_duration = text_reader(_endless, "a duration in seconds, or inf")
read_boolean = text_reader(_boolean, "true or false")
read_flag = text_reader(_flag, "true or false")  # also turtlesim's 1 and 0
read_integer = text_reader(_integer, "a whole number")
