"""Messages that hold several poses, taken apart: each pose as a message of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from frametool.ros.messages import PATH

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

POSE_ARRAY = "geometry_msgs/msg/PoseArray"


@dataclass
class Posed:
    """A pose of a list, with the fields of a PoseStamped."""

    header: Any
    pose: Any


def posed_messages(message: Any, kind: str) -> Sequence[Any] | Iterator[Any]:
    """Return the poses of a message that is a list of them, each with its header; else the message itself.

    A pose of a Path has its own header; the frame and the stamp that it leaves open are those of the path.
    """
    if kind == POSE_ARRAY:
        return (Posed(message.header, pose) for pose in message.poses)
    if kind == PATH:
        return (Posed(_completed(each.header, message.header), each.pose) for each in message.poses)
    return (message,)


def _completed(header: Any, outer: Any) -> Any:
    """Return a header with the frame and the stamp of the one around it, where it has none."""
    if not header.frame_id:
        header = replace(header, frame_id=outer.frame_id)
    if not (header.stamp.sec or header.stamp.nanosec):
        header = replace(header, stamp=outer.stamp)
    return header
