"""What ROS messages are made of: header, stamp, frame names; read from plain values."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.errors import shown
from frametool.frames.stamps import BILLION
from frametool.grammar.readers import Misfit, as_mapping, kind, read_numbers, within
from frametool.grammar.rotation_spelling import read_rotation

if TYPE_CHECKING:
    from frametool.grammar.readers import Path, Quaternion, Reading, Vector

STAMPS = (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"))  # ROS 2, ROS 1, Foxglove
SECONDS = {"sec": range(-(1 << 31), 1 << 32), "secs": range(1 << 32)}  # int32 of ROS 2, uint32 of the others
PARTS = "a TransformStamped has header, child_frame_id, transform"
MOST_DIGITS = 25
_INTEGER = rf"(?a) *[-+]?\d{{1,{MOST_DIGITS}}}"
_LEFT_OUT = "<(array|sequence) type: .*>"


def only(mapping: dict[str, Any], known: tuple[str, ...]) -> None:
    """Refuse keys that are not known."""
    for key in mapping:
        if key not in known:
            raise Misfit(f"unknown key {shown(key)}; expected {', '.join(known)}", (key,), key=True)


def part(message: dict[str, Any], key: str, what: str) -> dict[str, Any]:
    """Return a mapping inside a message; `what` says which keys the message has."""
    if key not in message:
        raise Misfit(f"missing {key}; {what}")
    inner: dict[str, Any] = within((key,), as_mapping, message[key], f"{key} as a mapping")
    return inner


def frame_of(
    mapping: dict[str, Any], key: str, path: Path, reading: Reading, *, may_be_empty: bool = False
) -> str:
    """Read a frame's name; one leading `/` goes, as tf2 does it, and is noted."""
    name = mapping.get(key)
    if may_be_empty and name in ("", None) and key in mapping:
        return ""
    here = (*path, key) if key in mapping else path
    if type(name) is not str or not name:
        raise Misfit(f"{key} must name a frame, found {kind(name or None)}", here)
    return reading.bare(name, *here)


def header_stamp(header: dict[str, Any], *, raw: bool = False) -> int | None:
    """Read the stamp of a header as nanoseconds; None where there is none."""
    if "stamp" not in header:
        return None
    stamp_ns: int = within(("header", "stamp"), read_stamp, header["stamp"], raw=raw)
    return stamp_ns


def read_stamp(value: Any, *, raw: bool = False) -> int:
    """Read {sec, nanosec}, {secs, nsecs} or {sec, nsec} as nanoseconds.

    raw: add up whatever stands there, as tf2 does.
    """
    stamp = as_mapping(value, "stamp as {sec, nanosec}")
    for names in STAMPS:
        if (*stamp,) == names or set(stamp) == set(names):
            seconds, nanoseconds = (_whole(stamp, name) for name in names)
            if not raw and (problem := stamp_problem(seconds, nanoseconds, names)):
                raise problem
            return seconds * BILLION + nanoseconds
    raise Misfit("expected stamp as {sec, nanosec} or {secs, nsecs}")


def stamp_problem(seconds: int, nanoseconds: int, names: tuple[str, str]) -> Misfit | None:
    """Return what is wrong with a stamp that no message can hold."""
    allowed = SECONDS[names[0]]
    if seconds not in allowed:
        return Misfit(f"{names[0]} {seconds} is beyond {allowed[0]} .. {allowed[-1]}", (names[0],))
    if not 0 <= nanoseconds < BILLION:
        return Misfit(f"{names[1]} {nanoseconds} is beyond 0 .. 999999999", (names[1],))
    return None


def _whole(stamp: dict[str, Any], key: str) -> int:
    text = stamp[key]
    if type(text) is str and len(text) <= MOST_DIGITS and text.isascii() and text.isdigit():
        return int(text)
    if type(text) is not str or not re.fullmatch(_INTEGER, text):
        raise Misfit(f"{key} must be a whole number, found {kind(text)}", (key,))
    return int(text)


def whole_list(value: Any, what: str) -> list[Any]:
    """Take a value for a list that was printed whole; the tools cut long ones unless told otherwise."""
    if type(value) is str and re.fullmatch(_LEFT_OUT, value):
        raise Misfit(f"the numbers are not there, only {shown(value)}: record without --no-arr (--noarr)")
    if type(value) is not list:
        raise Misfit(f"expected {what}, found {kind(value)}")
    if "..." in value:
        raise Misfit("the list was cut short here; record with `ros2 topic echo --full-length`", (value.index("..."),))
    return value


def read_rigid(mapping: dict[str, Any], keys: tuple[str, str], reading: Reading) -> tuple[Vector, Quaternion]:
    """Read position and rotation under the keys that a kind of message has for them."""
    for key in keys:
        if key not in mapping:
            raise Misfit(f"missing {key}")
    x, y, z = within(keys[:1], read_numbers, mapping[keys[0]], ("x", "y", "z"))
    _, rotation = within(keys[1:], read_rotation, "quaternion", mapping[keys[1]], reading)
    return (x, y, z), rotation
