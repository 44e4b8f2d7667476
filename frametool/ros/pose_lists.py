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

    A pose of a Path has its own header; frame and stamp that it leaves open are those of the path.  The stamp 0 beside
    a frame is one where other poses have stamps.
    """
    if kind == POSE_ARRAY:
        return (Posed(message.header, pose) for pose in message.poses)
    if kind == PATH:
        has_stamps = any(each.header.stamp.sec or each.header.stamp.nanosec for each in message.poses)
        return (Posed(_completed(each.header, message.header, has_stamps), each.pose) for each in message.poses)
    return (message,)


def _completed(own: Any, outer: Any, has_stamps: bool) -> Any:  # noqa: FBT001 - it reads so
    """Return a header with the frame, and the stamp, of the one around it where it has none."""
    says_when = own.stamp.sec or own.stamp.nanosec or (has_stamps and own.frame_id)
    return replace(own, stamp=own.stamp if says_when else outer.stamp, frame_id=own.frame_id or outer.frame_id)
