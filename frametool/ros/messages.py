"""ROS messages that hold transforms: TransformStamped and what contains it, in the spellings of ROS 1 and ROS 2.

    {header: {stamp: {sec: 1, nanosec: 0}, frame_id: map}, child_frame_id: base, transform: {translation: {..}, ..}}

Quaternions x, y, z, w; metres; header.frame_id is the parent: parent_from_child. Stamps become int nanoseconds.
Also read: the envelope of rosbridge, and Foxglove's FrameTransform.

Messages that are poses of a body over time: PoseStamped, PoseWithCovarianceStamped, Odometry.

    {header: {stamp: .., frame_id: map}, pose: {position: {x, y, z}, orientation: {x, y, z, w}}}        PoseStamped
    {header: {..}, child_frame_id: base, pose: {pose: {..}, covariance: [..]}, twist: {..}}             Odometry

The pose of the body in header.frame_id: Odometry names the body, the others do not. Metres, quaternion x, y, z, w.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import shown
from frametool.grammar.readers import Misfit, as_mapping, within
from frametool.grammar.rotation_spelling import read_rotation
from frametool.ros import foxglove
from frametool.ros.message_parts import PARTS, frame_of, header_stamp, only, part, read_rigid, whole_list

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.grammar.edges import Answers
    from frametool.grammar.readers import Path, Quaternion, Reading, Vector

LISTS = ("transforms", "static_transforms")
MESSAGE_KEYS = frozenset(("header", "linear", "force"))  # of messages that hold geometry
MARKS = frozenset(("child_frame_id", *LISTS))
STALE = "euler_angles_degree"  # Apollo writes it beside the quaternion and does not keep it up to date
BESIDE_LIST = ("timestamp",)  # of a FrameTransforms message
STALE_DEGREES = 0.1


def is_message(value: dict[str, Any]) -> bool:
    """Tell whether a mapping is a TransformStamped, a list of them, or either in rosbridge's envelope."""
    return not MARKS.isdisjoint(value) or is_envelope(value)


def is_envelope(value: dict[str, Any]) -> bool:
    """Tell whether a mapping is what rosbridge puts around a message."""
    return value.get("op") == "publish" and type(value.get("msg")) is dict


def topic_of(value: Any) -> str:
    """Return the topic that an envelope names, or ""."""
    return str(value.get("topic") or "") if type(value) is dict and is_envelope(value) else ""


def messages(value: dict[str, Any], path: Path) -> Iterator[tuple[dict[str, Any], Path]]:
    """Yield every TransformStamped in a message, with its path."""
    if is_envelope(value):
        value, path = value["msg"], (*path, "msg")
    if "child_frame_id" in value:
        yield value, path
        return
    for key, entries in value.items():
        here = (*path, key)
        if key in BESIDE_LIST:
            continue
        if key not in LISTS:
            raise Misfit(f"unknown key {shown(key)} beside transforms", here, key=True)
        listed = within(here, whole_list, entries or [], f"{key} as a list of TransformStamped")
        for index, entry in enumerate(listed):
            yield within((*here, index), as_mapping, entry, "a TransformStamped"), (*here, index)


def read_transform(
    message: dict[str, Any], reading: Reading, *, may_be_nameless: bool = False
) -> tuple[str, str, Vector, Quaternion, int | None]:
    """Read one TransformStamped as (parent, child, position, rotation, stamp_ns); no stamp is None.

    may_be_nameless: as a pose it needs no frames; their names are then "".
    """
    if foxglove.is_frame_transform(message):
        return foxglove.read_transform(message, reading)
    only(message, ("header", "child_frame_id", "transform"))
    header = part(message, "header", PARTS)
    transform = part(message, "transform", PARTS)
    within(("header",), only, header, ("seq", "stamp", "frame_id"))
    within(("transform",), only, transform, ("translation", "rotation", STALE))
    position, rotation = within(("transform",), read_rigid, transform, ("translation", "rotation"), reading)
    if STALE in transform:
        _warn_of_stale_angles(transform[STALE], rotation, reading)
    parent = frame_of(header, "frame_id", ("header",), reading, may_be_empty=may_be_nameless)
    child = frame_of(message, "child_frame_id", (), reading, may_be_empty=may_be_nameless)
    return parent, child, position, rotation, header_stamp(header)


def _warn_of_stale_angles(value: Any, rotation: Quaternion, reading: Reading) -> None:
    """Compare the angles beside a quaternion with it; the quaternion is what counts."""
    from math import degrees

    from frametool.geometry import floats, quaternion

    path = ("transform", STALE)
    angles: Quaternion = within(path, read_rotation, "rpy_deg", value, reading)[1]
    apart = degrees(quaternion.distance(*rotation, *angles, floats))
    if apart > STALE_DEGREES:
        reading.note(f"{STALE} differs from the quaternion by {apart:.3g} degrees; the quaternion is used", *path)


HAS = "a message with a pose has header, pose"
TYPES = frozenset(
    f"{package}/msg/{name}"
    for package, name in (
        ("geometry_msgs", "PoseStamped"), ("geometry_msgs", "PoseWithCovarianceStamped"), ("nav_msgs", "Odometry"),
    )
)  # fmt: skip


def is_pose(value: Any) -> bool:
    """Tell whether a message has a header and a pose."""
    return type(value) is dict and "header" in value and type(value.get("pose")) is dict


def body_of(topic: str, answers: Answers) -> str:
    """Name a body that its messages do not name: as --frames does, else by its topic."""
    return answers.frames[-1] if answers.frames else topic.strip("/") or "body"


def read_pose(
    message: dict[str, Any], reading: Reading, body: str
) -> tuple[str, str, Vector, Quaternion, int | None]:
    """Read one message as (parent, child, position, rotation, stamp_ns); `body` is the child where it names none."""
    header = part(message, "header", HAS)
    pose = part(message, "pose", HAS)
    path: Path = ("pose",)
    if "pose" in pose:
        pose, path = within(path, part, pose, "pose", "with a covariance beside it"), ("pose", "pose")
    position, rotation = within(path, read_rigid, pose, ("position", "orientation"), reading)
    parent = frame_of(header, "frame_id", ("header",), reading)
    child = frame_of(message, "child_frame_id", (), reading) if message.get("child_frame_id") else body
    return parent, child, position, rotation, header_stamp(header)
