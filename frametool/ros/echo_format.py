"""ROS messages as the tools print them: `rostopic echo` (ros1) and `ros2 topic echo` (ros2), `---` after each.

    header:                     header:·             rostopic writes a blank after a key that opens a block,
      frame_id: map               frame_id: "map"    quotes names, and aligns nanoseconds to nine columns

Foxglove's FrameTransform and FrameTransforms are JSON, one message per line:

    {"timestamp": {"sec": 1, "nsec": 0}, "parent_frame_id": "world", "child_frame_id": "turtle1",
     "translation": {"x": 0, ..}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}

A message is a mapping in the order of its fields; its stamps are mappings too. This module does not know message
types, except that a transform, a point and a pose have a header.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.source import Verbatim
from frametool.documents.writers import dump_json, dump_yaml, quoted
from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry.representations import notation
from frametool.grammar.result import Result, Style, edge_results, rotation_numbers
from frametool.ros.messages import MESSAGE_KEYS, STAMPS, stamp_problem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.frames.lookups import FrameTree


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return a message for each pose; frames without a name are "", an unknown stamp is 0."""
    return "".join(message_text(transform_stamped(result, style), style) for result in results)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return PointStamped and Vector3Stamped messages; messages are unchanged."""
    made = []
    for record in records:
        inner = next((value for value in record.values() if isinstance(value, (list, dict))), record)
        values: list[Any] = inner if isinstance(inner, list) else [inner.get(axis) for axis in "xyz"]
        message = record
        if MESSAGE_KEYS.isdisjoint(record) and len(values) == 3 and all(type(each) is float for each in values):
            key, xyz = "vector" if "vector" in record else "point", dict(zip("xyz", values, strict=True))
            message = {"header": header(record.get("frame"), record.get("stamp_ns"), style), key: xyz}
        made.append(message_text(message, style))
    return "".join(made)


def write_tree(tree: FrameTree, style: Style) -> str:
    """Return one message with every edge, as in a latched /tf_static."""
    return message_text({"transforms": [transform_stamped(edge, style) for edge in edge_results(tree)]}, style)


def message_text(message: dict[str, Any], style: Style) -> str:
    """Return one message and the line that ends it."""
    if style.format == "foxglove":
        return f"{dump_json(message, style.number)}\n"
    return "".join(f"{line}\n" for line in _lines(_respelled(message, style.format), style)) + "---\n"


def _respelled(value: Any, fmt: str) -> Any:
    """Convert the headers and stamps of a message to the other ROS version."""
    if isinstance(value, list):
        return [_respelled(each, fmt) for each in value]
    if not isinstance(value, dict):
        return value
    for seconds, nanoseconds in STAMPS:
        if value.keys() == {seconds, nanoseconds}:
            return dict(zip(STAMPS[fmt == "ros1"], (value[seconds], value[nanoseconds]), strict=True))
    made = {key: _respelled(each, fmt) for key, each in value.items()}
    if "frame_id" in made and "stamp" in made:
        seq = {"seq": made.pop("seq", 0)}
        return seq | made if fmt == "ros1" else made
    return made


def transform_stamped(result: Result, style: Style) -> dict[str, Any]:
    """Return a TransformStamped, or a FrameTransform, in the order of its fields."""
    pose, stamp_ns = result.pose, result.extras.get("stamp_ns")
    rotation = rotation_numbers(pose, notation("quaternion"), style)
    moved = {
        "translation": dict(zip("xyz", pose.components, strict=False)),
        "rotation": dict(zip("xyzw", rotation, strict=True)),
    }
    if style.format == "foxglove":
        timestamp = dict(zip(("sec", "nsec"), divmod(stamp_ns or 0, BILLION), strict=True))
        names = {"parent_frame_id": pose.parent or "", "child_frame_id": pose.name or ""}
        return {"timestamp": timestamp, **names, **moved}
    return {"header": header(pose.parent, stamp_ns, style), "child_frame_id": pose.name or "", "transform": moved}


def header(frame: str | None, stamp_ns: int | None, style: Style) -> dict[str, Any]:
    """Return a header; ROS 1 numbers its messages."""
    first = {"seq": 0} if style.format == "ros1" else {}
    return first | {"stamp": stamp(stamp_ns or 0, style.format), "frame_id": frame or ""}


def stamp(stamp_ns: int, fmt: str) -> dict[str, int]:
    """Return nanoseconds as a message has them; the second part is never negative."""
    names = STAMPS[fmt == "ros1"]
    whole, rest = divmod(stamp_ns, BILLION)
    if problem := stamp_problem(whole, rest, names):
        raise ValueInvalid(f"stamp {format_stamp(stamp_ns)} does not fit in {fmt}: {problem}")
    return dict(zip(names, (whole, rest), strict=True))


def _lines(mapping: dict[str, Any], style: Style, indent: str = "") -> Iterator[str]:
    """Write block style as PyYAML does for ROS 2, as genpy does for ROS 1, where a list of numbers is one line."""
    is_ros1 = style.format == "ros1"
    opening = ": " if is_ros1 else ":"
    for key, value in mapping.items():
        if isinstance(value, dict) and (value or is_ros1):
            yield f"{indent}{key}{opening}"
            yield from _lines(value, style, indent + "  ")
        elif isinstance(value, list) and (any(isinstance(item, dict) for item in value) if is_ros1 else value):
            yield f"{indent}{key}{opening}"
            for item in value:  # in ROS 2 in the column of its key and the dash before it, in ROS 1 below the dash
                if is_ros1:
                    yield f"{indent}  - "
                    yield from _lines(item, style, indent + "    ")
                elif isinstance(item, dict):
                    lines = _lines(item, style, indent + "  ")
                    yield f"{indent}- {next(lines).lstrip()}"
                    yield from lines
                else:
                    yield f"{indent}- {_scalar(item, style)}"
        elif isinstance(value, list) and is_ros1:
            yield f"{indent}{key}: [{', '.join(_scalar(item, style) for item in value)}]"
        else:
            yield f"{indent}{key}: {_scalar(value, style):>{9 if key == 'nsecs' else 0}}"


def _scalar(value: Any, style: Style) -> str:
    """Write a value on one line, as genpy or PyYAML does."""
    if isinstance(value, Verbatim):
        return str(value)
    if style.format == "ros1":
        if isinstance(value, str):
            return dump_json(value)
        return style.number(value) if isinstance(value, float) else str(value)
    if not isinstance(value, str):
        return dump_yaml(value, style.number).rstrip("\n")
    safe = quoted(value)
    return safe if safe == value or not value.isprintable() else "'" + value.replace("'", "''") + "'"
