"""A TransformStamped taken as tf2 takes it: any numbers, empty names; what is wrong with it the buffer's policy says.

{header: {stamp: {sec: 1, nanosec: 0}, frame_id: ""}, child_frame_id: base, transform: {translation: {x: .nan, ..}}}
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.grammar.readers import Misfit, as_mapping, kind, within
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from frametool.geometry.types import Rigid

ODD = {"nan": "nan", ".nan": "nan"} | {
    f"{sign}{word}": f"{sign}inf" for sign in ("", "+", "-") for word in ("inf", ".inf", "infinity")
}
STAMPS = (("sec", "nanosec"), ("secs", "nsecs"))


def read_transform(message: dict[str, Any]) -> tuple[str, str, Rigid, int | None]:
    """Read parent, child, tx, ty, tz (metres), x, y, z, w (of any norm) and the stamp, None if there is none.

    Raises Misfit where there is no such text at all.
    """
    header = _part(message, ("header",))
    position = _part(message, ("transform", "translation"))
    rotation = _part(message, ("transform", "rotation"))
    tx, ty, tz = (within(("transform", "translation"), _number, position, key) for key in "xyz")
    x, y, z, w = (within(("transform", "rotation"), _number, rotation, key) for key in "xyzw")
    components = (tx, ty, tz, x, y, z, w)
    return _name(header.get("frame_id")), _name(message.get("child_frame_id")), components, _stamp(header)


def _part(message: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    """Go down to a mapping inside a message."""
    value: Any = message
    for depth, key in enumerate(path):
        value = within(path[:depth], as_mapping, value, "a mapping").get(key)
    return within(path, as_mapping, value, f"{path[-1]} as a mapping")  # type: ignore[no-any-return]


def _number(mapping: dict[str, Any], key: str) -> float:
    """Read a number, which may be infinite or none."""
    text = mapping.get(key)
    if type(text) is not str:
        raise Misfit(f"expected a number, found {kind(text)}", (key,) if key in mapping else ())
    try:
        return float(ODD[text.lower()]) if text.lower() in ODD else parse_number(text)
    except ValueInvalid as error:
        raise Misfit(str(error), (key,)) from None


def _name(value: Any) -> str:
    return value if type(value) is str else ""


def _stamp(header: dict[str, Any]) -> int | None:
    """Read {sec, nanosec} or {secs, nsecs} as nanoseconds."""
    stamp = header.get("stamp")
    for names in STAMPS:
        if type(stamp) is dict and all(type(stamp.get(name)) is str and stamp[name].isdecimal() for name in names):
            return int(stamp[names[0]]) * BILLION + int(stamp[names[1]])
    if stamp is None:
        return None
    raise Misfit("expected stamp as {sec, nanosec} or {secs, nsecs}", ("header", "stamp"))
