"""ROS messages of transforms, poses and joint positions: read from plain values, and written as the tools print them.

    {header: {stamp: {sec: 1, nanosec: 0}, frame_id: map}, child_frame_id: base, transform: {translation: {..}, ..}}
    {header: {stamp: .., frame_id: map}, pose: {position: {x, y, z}, orientation: {x, y, z, w}}}        PoseStamped
    {header: {..}, child_frame_id: base, pose: {pose: {..}, covariance: [..]}, twist: {..}}             Odometry
    {timestamp: {sec: 1, nsec: 0}, parent_frame_id: map, child_frame_id: base, translation: {..}, ..}   Foxglove

    {header: {stamp: .., frame_id: ''}, name: [elbow, wrist], position: [0.5, -0.2], velocity: [], ..}  JointState

Quaternions x, y, z, w; metres; header.frame_id is the parent: parent_from_child. Stamps become integer nanoseconds.
Joint positions are radians or metres; a message may contain only some joints.

Written are the texts of `rostopic echo` (ros1) and `ros2 topic echo` (ros2), `---` after each message:

    header:                     header:·             rostopic writes a blank after a key that opens a block,
      frame_id: map               frame_id: "map"    quotes names, and aligns nanoseconds to nine columns

and those of Foxglove, FrameTransform and FrameTransforms in JSON, one message per line:

    {"timestamp": {"sec": 1, "nsec": 0}, "parent_frame_id": "world", "child_frame_id": "base",
     "translation": {"x": 0, ..}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}

A message to be written is a mapping in the order of its fields, its stamps are mappings too; types of messages are not
known, except that a transform, a point and a pose have a header.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any

from frametool.documents.source import Verbatim
from frametool.documents.writers import dump_json, dump_yaml, quoted
from frametool.errors import FormatError, ValueInvalid, shown
from frametool.frames.stamps import BILLION, NotATime, format_stamp, parse_stamp
from frametool.geometry.representations import notation
from frametool.grammar.pose import read_rotation
from frametool.grammar.readers import Misfit, Path, Quaternion, Reading, Vector, as_mapping, kind, read_numbers, within
from frametool.grammar.result import Result, Style, edge_results, rotation_numbers

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.frames.lookups import FrameTree
    from frametool.grammar.edges import Answers, Diagnostics, Edge, Options


STAMPS = (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"))  # ROS 2, ROS 1, Foxglove
SECONDS = {"sec": range(-(1 << 31), 1 << 32), "secs": range(1 << 32)}  # int32 of ROS 2, uint32 of the others
PARTS, HAS = "a TransformStamped has header, child_frame_id, transform", "a message with a pose has header, pose"
_TRANSFORM, _POSE = ("translation", "rotation"), ("position", "orientation")
# messages with several parts, or whose content is not obvious: the fields expressed in the header's frame with their
# kinds, and the fields in other frames, which are unchanged; in other messages the key is the kind of the content
HELD: dict[str, tuple[dict[str, str], tuple[str, ...]]] = {
    "Imu": ({"orientation": "attitude", "angular_velocity": "vector", "linear_acceleration": "vector"}, ()),
    "MagneticField": ({"magnetic_field": "vector"}, ()),
    "QuaternionStamped": ({"quaternion": "rotation"}, ()),
    "Odometry": ({"pose": ""}, ("twist",)),  # in the child's frame
    "Marker": ({"pose": ""}, ("scale", "points", "uv_coordinates")),  # in the frame of the pose
}
_INTEGER = r"(?a) *[-+]?\d{1,25}"
_LEFT_OUT = "<(array|sequence) type: .*>"
LISTS = ("transforms", "static_transforms")
MESSAGE_KEYS = frozenset(("header", "linear", "force"))  # of messages with geometry
MARKS = frozenset(("child_frame_id", *LISTS))
STALE = "euler_angles_degree"  # Apollo writes it next to the quaternion and does not update it
STALE_DEGREES = 0.1


def is_message(value: dict[str, Any]) -> bool:
    """Return True if a mapping is a TransformStamped, a list of them, or one of these in rosbridge's envelope."""
    return (not MARKS.isdisjoint(value) and "frame_id" not in value) or is_envelope(value)


def is_envelope(value: dict[str, Any]) -> bool:
    """Return True if a mapping is rosbridge's envelope of a message."""
    return value.get("op") == "publish" and type(value.get("msg")) is dict


def topic_of(value: Any) -> str:
    """Return the topic named in an envelope, or ""."""
    return str(value.get("topic") or "") if type(value) is dict and is_envelope(value) else ""


def on_topic(edge: Edge, name: str, options: Options) -> Edge:
    """Return an edge, without its stamp on tf_static; a frame on two topics is reported as an error."""
    if problem := options.topics.conflict(edge.topic, edge.child):
        options.report(FormatError(problem, source=name, line=edge.line, column=1, rule="two-topics"))
    return edge._replace(stamp_ns=None) if edge.topic.endswith("tf_static") else edge


def messages(value: dict[str, Any], path: Path) -> Iterator[tuple[dict[str, Any], Path]]:
    """Yield every TransformStamped in a message, with its path."""
    if is_envelope(value):
        value, path = value["msg"], (*path, "msg")
    if "child_frame_id" in value:
        yield value, path
        return
    for key, entries in value.items():
        here = (*path, key)
        if key == "timestamp":  # of a FrameTransforms message
            continue
        if key not in LISTS:
            raise Misfit(f"unknown key {shown(key)} next to transforms", here, key=True)
        listed = within(here, whole_list, entries or [], f"{key} as a list of TransformStamped")
        for index, entry in enumerate(listed):
            yield within((*here, index), as_mapping, entry, "a TransformStamped"), (*here, index)


def read_transform(
    message: dict[str, Any], reading: Reading, body: str = ""
) -> tuple[str, str, Vector, Quaternion, int | None]:
    """Read a TransformStamped, a FrameTransform or a stamped pose: parent, child, position, rotation, stamp_ns or None.

    body: the child frame of a pose that does not name it
    """
    if "parent_frame_id" in message:  # a FrameTransform
        only(message, ("timestamp", "parent_frame_id", "child_frame_id", *_TRANSFORM))
        parent, child = (frame_of(message, key, (), reading) for key in ("parent_frame_id", "child_frame_id"))
        position, rotation = read_rigid(message, _TRANSFORM, reading)
        stamp_ns = within(("timestamp",), _read_timestamp, message["timestamp"]) if "timestamp" in message else None
        return parent, child, position, rotation, stamp_ns
    is_posed = is_pose(message)
    key, what, keys = ("pose", HAS, _POSE) if is_posed else ("transform", PARTS, _TRANSFORM)
    path: Path = (key,)
    if not is_posed:
        only(message, ("header", "child_frame_id", key))
    header, inner = part(message, "header", what), part(message, key, what)
    if is_posed and "pose" in inner:
        inner, path = within(path, part, inner, key, "with a covariance"), (key, key)
    if not is_posed:
        within(("header",), only, header, ("seq", "stamp", "frame_id"))
        within(path, only, inner, (*keys, STALE))
    position, rotation = within(path, read_rigid, inner, keys, reading)
    if STALE in inner:
        _warn_of_stale_angles(inner[STALE], rotation, reading)
    parent = frame_of(header, "frame_id", ("header",), reading)
    child = frame_of(message, "child_frame_id", (), reading) if message.get("child_frame_id") or not is_posed else body
    return parent, child, position, rotation, header_stamp(header)


def _warn_of_stale_angles(value: Any, rotation: Quaternion, reading: Reading) -> None:
    """Warn if the angles of an entry differ from its quaternion, which is used."""
    from math import degrees

    from frametool.geometry import floats, quaternion

    path = ("transform", STALE)
    angles: Quaternion = within(path, read_rotation, "rpy_deg", value, reading)[1]
    apart = degrees(quaternion.distance(*rotation, *angles, floats))
    if apart > STALE_DEGREES:
        reading.note(f"{STALE} differs from the quaternion by {apart:.3g} degrees; the quaternion is used", *path)


PATH = "nav_msgs/msg/Path"
POSES = frozenset((  # messages that make a trajectory
    "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped", "nav_msgs/msg/Odometry", PATH,
))  # fmt: skip


def is_pose(value: Any) -> bool:
    """Return True if a message has a header and a pose."""
    return type(value) is dict and "header" in value and type(value.get("pose")) is dict


def body_of(topic: str, answers: Answers) -> str:
    """Return the name of the body for messages that do not name it: that of --frames, else the topic."""
    return answers.frames[-1] if answers.frames else topic.strip("/") or "body"


def _read_timestamp(value: Any) -> int:
    """Read {sec, nsec}, or a date with a zone, `2023-11-14T22:13:20.123456789Z`."""
    try:
        return parse_stamp(value.upper()) if type(value) is str else read_stamp(value)
    except NotATime:
        what = "expected a time as {sec, nsec} or 2023-11-14T22:13:20.5Z"
        raise Misfit(f"{what}, found {kind(value)}") from None


def only(mapping: dict[str, Any], known: tuple[str, ...]) -> None:
    """Raise Misfit for unknown keys."""
    for key in mapping:
        if key not in known:
            raise Misfit(f"unknown key {shown(key)}; expected {', '.join(known)}", (key,), key=True)


def part(message: dict[str, Any], key: str, what: str) -> dict[str, Any]:
    """Return a mapping inside a message; what: describes the keys of the message, for errors."""
    if key not in message:
        raise Misfit(f"missing {key}; {what}")
    inner: dict[str, Any] = within((key,), as_mapping, message[key], f"{key} as a mapping")
    return inner


def frame_of(mapping: dict[str, Any], key: str, path: Path, reading: Reading) -> str:
    """Read a frame's name; one leading `/` is removed, as in tf2, with a note."""
    name = mapping.get(key)
    here = (*path, key) if key in mapping else path
    if type(name) is not str or not name:
        raise Misfit(f"{key} must name a frame, found {kind(name or None)}", here)
    return reading.bare(name, *here)


def header_stamp(header: Any) -> int | None:
    """Read the stamp of a header as nanoseconds; None for a header without a stamp."""
    if type(header) is not dict or "stamp" not in header:
        return None
    stamp_ns: int = within(("header", "stamp"), read_stamp, header["stamp"])
    return stamp_ns


def read_stamp(value: Any) -> int:
    """Read {sec, nanosec}, {secs, nsecs} or {sec, nsec} as nanoseconds."""
    stamp = as_mapping(value, "stamp as {sec, nanosec}")
    for names in STAMPS:
        if (*stamp,) == names or set(stamp) == set(names):
            for name in names:
                if not isinstance(stamp[name], str) or not re.fullmatch(_INTEGER, stamp[name]):
                    raise Misfit(f"{name} must be a whole number, found {kind(stamp[name])}", (name,))
            seconds, nanoseconds = (int(stamp[name]) for name in names)
            if problem := stamp_problem(seconds, nanoseconds, names):
                raise problem
            return seconds * BILLION + nanoseconds
    raise Misfit("expected stamp as {sec, nanosec} or {secs, nsecs}")


def stamp_problem(seconds: int, nanoseconds: int, names: tuple[str, str]) -> Misfit | None:
    """Return the error for a stamp that no message can hold, None for a valid one."""
    allowed = SECONDS[names[0]]
    if seconds not in allowed:
        return Misfit(f"{names[0]} {seconds} is beyond {allowed[0]} .. {allowed[-1]}", (names[0],))
    if not 0 <= nanoseconds < BILLION:
        return Misfit(f"{names[1]} {nanoseconds} is beyond 0 .. 999999999", (names[1],))
    return None


def whole_list(value: Any, what: str) -> list[Any]:
    """Return a value if it is a complete list; raises Misfit for others and for lists that a tool has truncated."""
    if type(value) is str and re.fullmatch(_LEFT_OUT, value):
        raise Misfit(f"the numbers are not there, only {shown(value)}: record without --no-arr (--noarr)")
    if type(value) is not list:
        raise Misfit(f"expected {what}, found {kind(value)}")
    if "..." in value:
        raise Misfit("the list was cut short here; record with `ros2 topic echo --full-length`", (value.index("..."),))
    return value


def read_rigid(mapping: dict[str, Any], keys: tuple[str, str], reading: Reading) -> tuple[Vector, Quaternion]:
    """Read the position and the rotation under the keys of a kind of message."""
    for key in keys:
        if key not in mapping:
            raise Misfit(f"missing {key}")
    x, y, z = within(keys[:1], read_numbers, mapping[keys[0]], ("x", "y", "z"))
    rotation = within(keys[1:], read_rotation, "quaternion", mapping[keys[1]], reading).rotation
    return (x, y, z), rotation


STATE_LISTS = ("name", "position", "velocity", "effort")


def is_joint_state(value: dict[str, Any]) -> bool:
    """Return True if a mapping is a JointState: it has a list of joint names."""
    return type(value.get("name")) is list or ("position" in value and "velocity" in value and "name" in value)


def positions(value: dict[str, Any]) -> Iterator[tuple[str, Any, Path]]:
    """Yield the name of each joint, its position as text, and the path to it.

    Raises Misfit.
    """
    names = within(("name",), whole_list, value["name"], "name as a list of joints")
    listed = within(("position",), whole_list, value.get("position", []), "position as a list of numbers")
    if not listed and names:
        raise Misfit("a JointState without positions", ("name",), key=True)
    if len(names) != len(listed):
        raise Misfit(f"{len(names)} names and {len(listed)} positions; each joint has one", ("position",))
    for index, (name, position) in enumerate(zip(names, listed, strict=True)):
        if type(name) is not str or not name:
            raise Misfit(f"expected the name of a joint, found {kind(name or None)}", ("name", index))
        yield name, position, ("position", index)


def position_of(joint: str, value: Any) -> Path | None:
    """Return the path to the position of a joint in a JointState; None without this joint, or for other values."""
    if type(value) is not dict or type(value.get("name")) is not list or joint not in value["name"]:
        return None
    index = value["name"].index(joint)
    listed = value.get("position")
    return ("position", index) if type(listed) is list and index < len(listed) else None


# lines that the tools or the shell print between messages; only the warning about lost messages ends a document
is_noise = partial(
    re.fullmatch,
    r"""(?x) \ufeff? (?:
      A\ message\ was\ lost!!! | \ttotal\ count\ change:\ ?\d+ | \ttotal\ count:\ ?\d+(?:---)?
    | WARNING:\ .* | Is\ /clock\ being\ published\?
    | \[\ ?(?:DEBUG|INFO|WARN|ERROR|FATAL)\ ?\].*
    | \d{4}-\d\d-\d\d\ [\d:.]+\ \[[A-Z_]+\ \w+\].* | selected\ interface\ .*\ multicast.*
    | \$\ .* | \[exit\ \d+\] | \^C.* )""",
)
_NOISE_START = r"(?m)^(?=[A-Z\t\[\d$^\ufeff])"  # no key that ROS prints begins like this


def without_noise(text: str, line: int = 0, tally: Diagnostics | None = None) -> str:
    """Replace lines that are known not to be data by blanks, and record them; positions in the text are preserved."""
    if re.search(_NOISE_START, text) is None:
        return text
    kept = text.split("\n")
    for index, each in enumerate(kept):
        if is_noise(each.rstrip("\r")):
            if tally is not None:
                tally.noise.append((line + index, each.strip()))
            kept[index] = " " * len(each.encode())
    return "\n".join(kept)


# --- messages as the tools print them ---


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return a message for each pose; a frame without a name is "", an unknown stamp is 0."""
    return "".join(message_text(transform_stamped(result, style), style) for result in results)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return PointStamped and Vector3Stamped messages; records that are messages are unchanged."""
    made = []
    for record in records:
        inner = next((value for value in record.values() if isinstance(value, (list, dict))), record)
        values: list[Any] = inner if isinstance(inner, list) else [inner.get(axis) for axis in "xyz"]
        message = record
        if MESSAGE_KEYS.isdisjoint(record) and len(values) == 3 and all(type(each) is float for each in values):
            key, xyz = "vector" if "vector" in record else "point", dict(zip("xyz", values, strict=True))
            message = {"header": new_header(record.get("frame"), record.get("stamp_ns"), style), key: xyz}
        made.append(message_text(message, style))
    return "".join(made)


def write_tree(tree: FrameTree, style: Style) -> str:
    """Return one message with all edges, as in a latched /tf_static."""
    return message_text({"transforms": [transform_stamped(edge, style) for edge in edge_results(tree)]}, style)


def message_text(message: dict[str, Any], style: Style) -> str:
    """Return one message and the line that ends it."""
    if style.format == "foxglove":
        return f"{dump_json(message, style.number)}\n"
    return "".join(f"{line}\n" for line in _lines(_respelled(message, style.format), style)) + "---\n"


def _respelled(value: Any, fmt: str) -> Any:
    """Convert the headers and stamps of a message to the ROS version of a format."""
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
    return {"header": new_header(pose.parent, stamp_ns, style), "child_frame_id": pose.name or "", "transform": moved}


def new_header(frame: str | None, stamp_ns: int | None, style: Style) -> dict[str, Any]:
    """Return a header; in ROS 1 it has a counter, 0."""
    first = {"seq": 0} if style.format == "ros1" else {}
    return first | {"stamp": new_stamp(stamp_ns or 0, style.format), "frame_id": frame or ""}


def new_stamp(stamp_ns: int, fmt: str) -> dict[str, int]:
    """Return nanoseconds as the fields of a stamp; the second one is never negative."""
    names = STAMPS[fmt == "ros1"]
    whole, rest = divmod(stamp_ns, BILLION)
    if problem := stamp_problem(whole, rest, names):
        raise ValueInvalid(f"stamp {format_stamp(stamp_ns)} does not fit in {fmt}: {problem}")
    return dict(zip(names, (whole, rest), strict=True))


def _lines(mapping: dict[str, Any], style: Style, indent: str = "") -> Iterator[str]:
    """Yield the lines of a mapping in block style, as PyYAML writes for ROS 2 and genpy for ROS 1.

    In ROS 1 a list of numbers is one line.
    """
    is_ros1 = style.format == "ros1"
    opening = ": " if is_ros1 else ":"
    for key, value in mapping.items():
        if isinstance(value, dict) and (value or is_ros1):
            yield f"{indent}{key}{opening}"
            yield from _lines(value, style, indent + "  ")
        elif isinstance(value, list) and (any(isinstance(item, dict) for item in value) if is_ros1 else value):
            yield f"{indent}{key}{opening}"
            for item in value:  # ROS 2: the dash is in the column of the key; ROS 1: the item is below the dash
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
