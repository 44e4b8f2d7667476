"""Messages that are poses of a body over time: PoseStamped, PoseWithCovarianceStamped, Odometry.

    {header: {stamp: .., frame_id: map}, pose: {position: {x, y, z}, orientation: {x, y, z, w}}}        PoseStamped
    {header: {..}, child_frame_id: base, pose: {pose: {..}, covariance: [..]}, twist: {..}}             Odometry

The pose of the body in header.frame_id: Odometry names the body, the others do not. Metres, quaternion x, y, z, w.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.grammar.readers import within
from frametool.ros.message_parts import frame_of, header_stamp, part, read_rigid

if TYPE_CHECKING:
    from frametool.grammar.edges import Answers
    from frametool.grammar.readers import Path, Quaternion, Reading, Vector

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
