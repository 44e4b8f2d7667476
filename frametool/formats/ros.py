"""ROS messages as text: TransformStamped and what contains it, in the spellings of ROS 1 and ROS 2.

    {header: {stamp: {sec: 1, nanosec: 0}, frame_id: map}, child_frame_id: base, transform: {translation: {..}, ..}}

Quaternions x, y, z, w; metres; header.frame_id is the parent: parent_from_child. Stamps become int nanoseconds.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.formats.json_form import dump as json_dump
from frametool.formats.pose import Pose
from frametool.formats.results import rotation_numbers
from frametool.formats.rotations import read_rotation
from frametool.formats.values import Misfit, as_mapping, kind, read_numbers, within
from frametool.formats.yaml_text import dump, quoted
from frametool.frames.stamps import BILLION
from frametool.geometry.representations import notation

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.formats.results import Result, Style
    from frametool.formats.values import Path, Quaternion, Reading, Vector
    from frametool.frames.tree import FrameTree

LISTS = ("transforms", "static_transforms")
STALE = "euler_angles_degree"  # Apollo writes it beside the quaternion and does not keep it up to date
STALE_DEGREES = 0.1
STAMPS = (("sec", "nanosec"), ("secs", "nsecs"))
_INTEGER = re.compile(r"[-+]?\d{1,25}", re.ASCII)


def is_message(value: dict[str, Any]) -> bool:
    """Tell whether a mapping is a TransformStamped or a list of them."""
    return "child_frame_id" in value or any(key in value for key in LISTS)


def messages(value: dict[str, Any], path: Path) -> Iterator[tuple[dict[str, Any], Path]]:
    """Give every TransformStamped in a message, with its path."""
    if "child_frame_id" in value:
        yield value, path
        return
    for key, entries in value.items():
        here = (*path, key)
        if key not in LISTS:
            raise Misfit(f"unknown key {key!r} beside transforms", here, key=True)
        if type(entries) is not list and entries is not None:
            raise Misfit(f"{key} must be a list of TransformStamped, found {kind(entries)}", here)
        for index, entry in enumerate(entries or ()):
            yield within((*here, index), as_mapping, entry, "a TransformStamped"), (*here, index)


def read_transform(message: dict[str, Any], reading: Reading) -> tuple[str, str, Vector, Quaternion, int | None]:
    """Read one TransformStamped as (parent, child, position, rotation, stamp_ns); no stamp is None."""
    _only(message, ("header", "child_frame_id", "transform"))
    header = _part(message, "header")
    transform = _part(message, "transform")
    within(("header",), _only, header, ("seq", "stamp", "frame_id"))
    within(("transform",), _only, transform, ("translation", "rotation", STALE))
    for part, key in ((transform, "translation"), (transform, "rotation")):
        if key not in part:
            raise Misfit(f"missing {key}", ("transform",))
    position = within(("transform", "translation"), read_numbers, transform["translation"], ("x", "y", "z"))
    _, rotation = within(("transform", "rotation"), read_rotation, "quaternion", transform["rotation"], reading)
    if STALE in transform:
        _warn_of_stale_angles(transform[STALE], rotation, reading)
    parent = _frame(header, "frame_id", ("header",))
    return (
        parent,
        _frame(message, "child_frame_id", ()),
        (position[0], position[1], position[2]),
        rotation,
        _stamp(header),
    )


def _part(message: dict[str, Any], key: str) -> dict[str, Any]:
    if key not in message:
        raise Misfit(f"missing {key}; a TransformStamped has header, child_frame_id, transform")
    part: dict[str, Any] = within((key,), as_mapping, message[key], f"{key} as a mapping")
    return part


def _only(mapping: dict[str, Any], known: tuple[str, ...]) -> None:
    for key in mapping:
        if key not in known:
            raise Misfit(f"unknown key {key!r}; expected {', '.join(known)}", (key,), key=True)


def _frame(mapping: dict[str, Any], key: str, path: Path) -> str:
    name = mapping.get(key)
    if type(name) is not str or not name:
        raise Misfit(f"{key} must name a frame, found {kind(name or None)}", (*path, key) if key in mapping else path)
    return name


def _stamp(header: dict[str, Any]) -> int | None:
    """Read {sec, nanosec} or {secs, nsecs} as nanoseconds."""
    if "stamp" not in header:
        return None
    stamp = within(("header", "stamp"), as_mapping, header["stamp"], "stamp as {sec, nanosec}")
    for seconds, nanoseconds in STAMPS:
        if set(stamp) == {seconds, nanoseconds}:
            return _whole(stamp, seconds) * BILLION + _whole(stamp, nanoseconds)
    raise Misfit("expected stamp as {sec, nanosec} or {secs, nsecs}", ("header", "stamp"))


def _whole(stamp: dict[str, Any], key: str) -> int:
    text = stamp[key]
    if type(text) is not str or not _INTEGER.fullmatch(text):
        raise Misfit(f"{key} must be a whole number, found {kind(text)}", ("header", "stamp", key))
    return int(text)


def _warn_of_stale_angles(value: Any, rotation: Quaternion, reading: Reading) -> None:
    """Compare the angles beside a quaternion with it; the quaternion is what counts."""
    from math import degrees

    from frametool.geometry import floats, quaternion

    path = ("transform", STALE)
    angles: Quaternion = within(path, read_rotation, "rpy_deg", value, reading)[1]
    apart = degrees(quaternion.distance(*rotation, *angles, floats))
    if apart > STALE_DEGREES:
        reading.note(f"{STALE} differs from the quaternion by {apart:.3g} degrees; the quaternion is used", *path)


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Give TransformStamped messages, each ended by `---`; frames without a name are "", stamps 0."""
    ros1 = style.form == "ros1"
    messages = [_transform_stamped(result.pose, style, ros1=ros1) for result in results]
    return "".join("".join(_block(message, style, "", ros1=ros1)) + "---\n" for message in messages)


def write_tree(tree: FrameTree, style: Style) -> str:
    """Give one TFMessage with every edge, as a latched /tf_static holds it."""
    ros1 = style.form == "ros1"
    lines = ["transforms: \n" if ros1 else "transforms:\n"]
    for parent, child, transform in tree.edges():
        pose = Pose.of(transform.components, child, parent)
        entry = list(_block(_transform_stamped(pose, style, ros1=ros1), style, "    " if ros1 else "  ", ros1=ros1))
        lines += ["  - \n", *entry] if ros1 else [f"- {entry[0][2:]}", *entry[1:]]
    return "".join(lines) + "---\n"


def _transform_stamped(pose: Pose, style: Style, *, ros1: bool) -> dict[str, Any]:
    """Give a TransformStamped as a mapping in the order of its fields."""
    seconds, nanoseconds = STAMPS[ros1]
    header = {"seq": 0} if ros1 else {}
    rotation = rotation_numbers(pose, notation("quaternion"), style)
    return {
        "header": header | {"stamp": {seconds: 0, nanoseconds: 0}, "frame_id": pose.parent or ""},
        "child_frame_id": pose.name or "",
        "transform": {
            "translation": dict(zip("xyz", pose.components, strict=False)),
            "rotation": dict(zip("xyzw", rotation, strict=True)),
        },
    }


def _block(mapping: dict[str, Any], style: Style, indent: str, *, ros1: bool) -> Iterator[str]:
    """Write nested mappings as the ROS tools do: ROS 1 leaves a blank after a key that opens a block."""
    for key, value in mapping.items():
        if isinstance(value, dict):
            yield f"{indent}{key}: \n" if ros1 else f"{indent}{key}:\n"
            yield from _block(value, style, indent + "  ", ros1=ros1)
        else:
            yield f"{indent}{key}: {_scalar(key, value, style, ros1=ros1)}\n"


def _scalar(key: str, value: Any, style: Style, *, ros1: bool) -> str:
    if isinstance(value, str):
        return json_dump(value) if ros1 else _ros2_text(value)
    if isinstance(value, float):
        return style.number(value) if ros1 else dump(value, style.number).rstrip()
    return f"{value:>9}" if key == "nsecs" else str(value)  # rostopic aligns nanoseconds to nine columns


def _ros2_text(text: str) -> str:
    """Write a name as PyYAML does: in single quotes where it needs any."""
    safe = quoted(text)
    return safe if safe == text or not text.isprintable() else "'" + text.replace("'", "''") + "'"
