"""A TransformStamped taken as tf2 takes it: any numbers, empty names; what is wrong with it the buffer's policy says.

{header: {stamp: {sec: 1, nanosec: 0}, frame_id: ""}, child_frame_id: base, transform: {translation: {x: .nan, ..}}}
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.grammar.readers import Misfit, kind, within
from frametool.ros.message_parts import PARTS, header_stamp, part
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from frametool.geometry.types import Rigid

ODD = {"nan": "nan", ".nan": "nan"} | {
    f"{sign}{word}": f"{sign}inf" for sign in ("", "+", "-") for word in ("inf", ".inf", "infinity")
}


def read_transform(message: dict[str, Any]) -> tuple[str, str, Rigid, int | None]:
    """Read parent, child, tx, ty, tz (metres), x, y, z, w (of any norm) and the stamp, None if there is none.

    Raises Misfit where there is no such text at all.
    """
    header = part(message, "header", PARTS)
    transform = part(message, "transform", PARTS)
    tx, ty, tz = within(("transform",), _numbers, transform, "translation", "xyz")
    x, y, z, w = within(("transform",), _numbers, transform, "rotation", "xyzw")
    names = header.get("frame_id"), message.get("child_frame_id")
    parent, child = (name if type(name) is str else "" for name in names)
    stamp_ns = None if header.get("stamp") is None else header_stamp(header, raw=True)
    return parent, child, (tx, ty, tz, x, y, z, w), stamp_ns


def _numbers(transform: dict[str, Any], key: str, axes: str) -> list[float]:
    """Read numbers, which may be infinite or none."""
    mapping = part(transform, key, f"a transform has {key}")
    return [within((key, axis), _number, mapping.get(axis)) for axis in axes]


def _number(text: Any) -> float:
    if type(text) is not str:
        raise Misfit(f"expected a number, found {kind(text)}")
    try:
        return float(ODD[text.lower()]) if text.lower() in ODD else parse_number(text)
    except ValueInvalid as error:
        raise Misfit(str(error)) from None
