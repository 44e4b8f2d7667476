"""Foxglove's JSON: FrameTransform and FrameTransforms, one message a line.

    {"timestamp": {"sec": 1, "nsec": 0}, "parent_frame_id": "world", "child_frame_id": "turtle1",
     "translation": {"x": 0, ..}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}

Quaternions x, y, z, w; metres; the pose of the child in its parent: parent_from_child.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.json import dump
from frametool.frames.stamps import BILLION
from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.readers import Misfit, kind, within
from frametool.grammar.result import Result, rotation_numbers
from frametool.ros.message_parts import frame_of, only, read_rigid, read_stamp

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.frames.lookups import FrameTree
    from frametool.grammar.readers import Quaternion, Reading, Vector
    from frametool.grammar.result import Style

EPOCH = 719_163  # the day 1970-01-01, counted from year 1
_DATE = (
    r"(?a)(\d{4}-\d\d-\d\d)[Tt ](?P<h>[01]\d|2[0-3]):(?P<m>[0-5]\d):(?P<s>[0-5]\d|60)(?:\.(?P<part>\d{1,9})0*)?"
    r"(?:[Zz]|(?P<sign>[-+])(?P<oh>[01]\d|2[0-3]):(?P<om>[0-5]\d))"
)
KEYS = ("timestamp", "parent_frame_id", "child_frame_id", "translation", "rotation")


def is_frame_transform(value: dict[str, Any]) -> bool:
    """Tell whether a mapping is a FrameTransform."""
    return "parent_frame_id" in value


def read_transform(message: dict[str, Any], reading: Reading) -> tuple[str, str, Vector, Quaternion, int | None]:
    """Read one FrameTransform as (parent, child, position, rotation, stamp_ns); no timestamp is None."""
    only(message, KEYS)
    parent = frame_of(message, "parent_frame_id", (), reading)
    child = frame_of(message, "child_frame_id", (), reading)
    position, rotation = read_rigid(message, ("translation", "rotation"), reading)
    stamp_ns = within(("timestamp",), _read_timestamp, message["timestamp"]) if "timestamp" in message else None
    return parent, child, position, rotation, stamp_ns


def _read_timestamp(value: Any) -> int:
    """Read {sec, nsec}, or a date as RFC 3339 has it, `2023-11-14T22:13:20.123456789Z`, to the nanosecond."""
    if type(value) is not str:
        return read_stamp(value)
    from datetime import date

    found = re.fullmatch(_DATE, value)
    try:
        days = date.fromisoformat(found[1]).toordinal() - EPOCH if found else None
    except ValueError:
        days = None
    if not found or days is None:
        raise Misfit(f"expected a time as {{sec, nsec}} or 2023-11-14T22:13:20.5Z, found {kind(value)}")
    hours, minutes, seconds, off_hours, off_minutes = (int(found[name] or 0) for name in ("h", "m", "s", "oh", "om"))
    sign = -1 if found["sign"] == "-" else 1
    whole = days * 86_400 + (hours - sign * off_hours) * 3600 + (minutes - sign * off_minutes) * 60 + seconds
    return whole * BILLION + int((found["part"] or "").ljust(9, "0"))


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return one FrameTransform a line; frames without a name are "", a stamp that is not known is 0."""
    return "".join(f"{dump(_frame_transform(result, style), style.number)}\n" for result in results)


def write_tree(tree: FrameTree, style: Style) -> str:
    """Return one FrameTransforms with every edge."""
    edges = (Result(Pose.of(transform.components, child, parent)) for parent, child, transform in tree.edges())
    return f"{dump({'transforms': [_frame_transform(edge, style) for edge in edges]}, style.number)}\n"


def _frame_transform(result: Result, style: Style) -> dict[str, Any]:
    seconds, nanoseconds = divmod(result.extras.get("stamp_ns") or 0, BILLION)
    rotation = rotation_numbers(result.pose, notation("quaternion"), style)
    return {
        "timestamp": {"sec": seconds, "nsec": nanoseconds},
        "parent_frame_id": result.pose.parent or "",
        "child_frame_id": result.pose.name or "",
        "translation": dict(zip("xyz", result.pose.components, strict=False)),
        "rotation": dict(zip("xyzw", rotation, strict=True)),
    }
