"""Messages of poses and points moved into another frame, each at its stamp.

Covariances are turned along; the twist of an Odometry is given in its child's frame and stays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.geometry import floats, quaternion, rigid, uncertainty
from frametool.grammar.edges import Tally
from frametool.recordings.edges import put
from frametool.ros.messages import PATH, STAMPS, stamp_problem
from frametool.ros.plain_messages import unit_components
from frametool.ros.pose_lists import POSE_ARRAY, posed_messages

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.recordings.read import Channel
    from frametool.recordings.types import MessageTypes

LISTS = (POSE_ARRAY, PATH)
MOVED_TYPES = frozenset((
    "geometry_msgs/msg/PointStamped", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/Odometry", *LISTS,
))  # fmt: skip


class MessageHeader(NamedTuple):
    """What a header says: in which frame and when."""

    frame: str
    stamp_ns: int

    @classmethod
    def of(cls, header: Any) -> MessageHeader:
        """Read a header; raises ValueInvalid for a stamp that is none."""
        if problem := stamp_problem(header.stamp.sec, header.stamp.nanosec, STAMPS[0]):
            raise problem
        return cls(header.frame_id, header.stamp.sec * BILLION + header.stamp.nanosec)


class MessageMover:
    """What moves messages into one frame, by transforms that may move themselves."""

    def __init__(self, frames: Frames, into: str, types: MessageTypes, *, normalize: bool = False) -> None:
        """Take the transforms; raises UnknownFrame for a frame that they do not know.

        normalize: take any non-zero quaternion
        """
        frames.require(into)
        self.frames, self.into, self.types, self.normalize = frames, frames.resolve_name(into), types, normalize
        self.tally = Tally()  # of names with a leading slash, and rough quaternions
        self.header: MessageHeader | None = None  # of the message that was moved last, as far as it was read
        self._last: tuple[MessageHeader, Rigid] | None = None

    def moved(self, channel: Channel, data: bytes) -> bytes:
        """Return a message of one of MOVED_TYPES in the frame; the same object where it is in it already.

        Raises ValueInvalid for what cannot be read or is no pose, LookupFailed where no transform leads to the frame.
        """
        self.header = None
        message = self.types.read(channel, data)
        self.header = MessageHeader.of(message.header)
        parts = [*posed_messages(message, channel.type)]
        movers = [self._pose_of(MessageHeader.of(each.header)) for each in parts]
        is_listed = channel.type in LISTS and self._name(self.header) != self.into
        if not is_listed and all(each is None for each in movers):
            return data
        for part, mover in zip(parts, movers, strict=True):
            if mover is not None:
                self._move(part, mover)
        for each in (message, *(message.poses if channel.type == PATH else ())):
            each.header.frame_id = self.into
        return self.types.write(channel, message)

    def _name(self, header: MessageHeader) -> str:
        return self.tally.names.bare(header.frame) if header.frame else ""

    def _pose_of(self, header: MessageHeader) -> Rigid | None:
        """Return the pose that moves what is given as a header says; None for what is in the frame already."""
        name = self._name(header)
        if name == self.into:
            return None
        if not name:
            raise ValueInvalid("its header names no frame")
        if self._last is None or self._last[0] != header:
            self._last = header, self.frames.lookup_components(self.into, name, header.stamp_ns)
        return self._last[1]

    def _move(self, part: Any, mover: Rigid) -> None:
        """Move a point, or a pose and its covariance."""
        if hasattr(part, "point"):
            numbers = part.point.x, part.point.y, part.point.z
            if not abs(sum(numbers)) < uncertainty.INFINITE:
                raise ValueInvalid("the point is not finite", rule="not-finite")
            put(part.point, [each + 0.0 for each in rigid.apply(*mover, *numbers)])
            return
        pose = getattr(part.pose, "pose", part.pose)
        at, turn = pose.position, pose.orientation
        turned = turn.x, turn.y, turn.z, turn.w
        found = unit_components((at.x, at.y, at.z, *turned), 0, self.tally, self.normalize)
        if found is None:
            problem = quaternion.complaint(*turned, normalize=self.normalize)
            raise problem or ValueInvalid("its position is not finite", rule="not-finite")
        tx, ty, tz, x, y, z, w = rigid.compose(*mover, *found)
        put(at, (tx + 0.0, ty + 0.0, tz + 0.0))
        put(turn, [each + 0.0 for each in quaternion.unit(x, y, z, w, floats)])
        if pose is not part.pose:
            entries = tuple(part.pose.covariance.tolist())
            if any(entries) and entries[0] != uncertainty.UNKNOWN:
                uncertainty.taken(entries)
                part.pose.covariance = np.array(uncertainty.rotate_covariance(entries, *mover[3:])) + 0.0
