"""Messages of poses and points moved into another frame, each at its stamp.

Covariances are turned along; the twist of an Odometry is given in its child's frame and stays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid
from frametool.geometry import floats, quaternion, rigid, uncertainty
from frametool.grammar.edges import Tally
from frametool.ros.message_bytes import MessageFields, MessageHeader
from frametool.ros.plain_messages import unit_components

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid

POINT = 3  # numbers


class MessageMover:
    """What moves messages into one frame, by transforms that may move themselves."""

    def __init__(self, frames: Frames, into: str, *, ros1: bool, normalize: bool = False) -> None:
        """Take the transforms; raises UnknownFrame for a frame that they do not know.

        normalize: take any non-zero quaternion
        """
        frames.require(into)
        self.frames, self.into = frames, frames.resolve_name(into)
        self.ros1, self.normalize = ros1, normalize
        self.tally = Tally()  # of names with a leading slash, and rough quaternions
        self.header: MessageHeader | None = None  # of the message that was moved last, as far as it was read
        self._last: tuple[MessageHeader, Rigid] | None = None
        self._has_moved = False

    def moved(self, kind: str, data: bytes) -> bytes:
        """Return a message of one of MOVED_TYPES in the frame; the same object where it is in it already.

        Raises ValueInvalid for what cannot be read or is no pose, LookupFailed where no transform leads to the frame.
        """
        self._has_moved, self.header = False, None
        fields = MessageFields(data, ros1=self.ros1)
        MOVED_TYPES[kind](self, fields)
        made = fields.whole()
        return made if self._has_moved else data

    def point(self, fields: MessageFields) -> None:
        """Move a PointStamped."""
        pose = self._pose_of(self._header(fields))
        numbers = fields.doubles(POINT)
        if pose is not None:
            if not abs(sum(numbers)) < uncertainty.INFINITE:
                raise ValueInvalid("the point is not finite", rule="not-finite")
            fields.put([part + 0.0 for part in rigid.apply(*pose, *numbers)])

    def pose(self, fields: MessageFields) -> None:
        """Move a PoseStamped."""
        self._pose(fields, self._pose_of(self._header(fields)))

    def uncertain_pose(self, fields: MessageFields, *, has_child: bool = False) -> None:
        """Move a PoseWithCovarianceStamped, or an Odometry: header and child come first."""
        pose = self._pose_of(self._header(fields))
        if has_child:
            fields.text()
        self._pose(fields, pose)
        entries = fields.doubles(uncertainty.POSE)
        if pose is not None and any(entries) and entries[0] != uncertainty.UNKNOWN:
            uncertainty.taken(entries)
            fields.put([entry + 0.0 for entry in uncertainty.turned(entries, *pose[3:])])

    def odometry(self, fields: MessageFields) -> None:
        """Move an Odometry, without its twist."""
        self.uncertain_pose(fields, has_child=True)
        fields.doubles(TWIST)

    def poses(self, fields: MessageFields) -> None:
        """Move a PoseArray."""
        header = self._listed(fields)
        for _ in range(fields.integer()):
            self._pose(fields, self._pose_of(header))

    def path(self, fields: MessageFields) -> None:
        """Move a Path, each pose by its own header; what that leaves open is as `pose_lists` has it."""
        header = self._listed(fields)
        has_stamps = any(self._stamps_of_path(fields.data))
        for _ in range(fields.integer()):
            frame, stamp_ns = fields.header(self.into)
            stamp_ns = stamp_ns if stamp_ns or (has_stamps and frame) else header.stamp_ns
            self._pose(fields, self._pose_of(MessageHeader(frame or header.frame, stamp_ns)))

    def _stamps_of_path(self, data: bytes) -> Iterator[int]:
        """Yield the stamp of each pose."""
        fields = MessageFields(data, ros1=self.ros1)
        fields.header()
        for _ in range(fields.integer()):
            yield fields.header().stamp_ns
            fields.pose()

    def _header(self, fields: MessageFields) -> MessageHeader:
        """Take the header of the message over."""
        self.header = fields.header(self.into)
        return self.header

    def _listed(self, fields: MessageFields) -> MessageHeader:
        """Take the header of a list over, of which nothing may follow."""
        header = self._header(fields)
        self._has_moved = self._name(header) != self.into
        return header

    def _name(self, header: MessageHeader) -> str:
        return self.tally.names.bare(header.frame) if header.frame else ""

    def _pose_of(self, header: MessageHeader) -> Rigid | None:
        """Return the pose that moves what is given as a header says; None for what is in the frame already."""
        name = self._name(header)
        if name == self.into:
            return None
        self._has_moved = True
        if not name:
            raise ValueInvalid("its header names no frame")
        if self._last is None or self._last[0] != header:
            self._last = header, self.frames.lookup_components(self.into, name, header.stamp_ns)
        return self._last[1]

    def _pose(self, fields: MessageFields, mover: Rigid | None) -> None:
        """Move the pose that comes next."""
        numbers = fields.pose()
        if mover is None:
            return
        pose = unit_components(numbers, 0, self.tally, self.normalize)
        if pose is None:
            problem = quaternion.complaint(*numbers[3:], normalize=self.normalize)
            raise problem or ValueInvalid("its position is not finite", rule="not-finite")
        tx, ty, tz, x, y, z, w = rigid.compose(*mover, *pose)
        fields.put([part + 0.0 for part in (tx, ty, tz, *quaternion.unit(x, y, z, w, floats))])


TWIST = 6 + uncertainty.POSE  # numbers, of which 36 are its covariance
MOVED_TYPES: dict[str, Callable[[MessageMover, MessageFields], None]] = {
    "geometry_msgs/msg/PointStamped": MessageMover.point,
    "geometry_msgs/msg/PoseStamped": MessageMover.pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": MessageMover.uncertain_pose,
    "geometry_msgs/msg/PoseArray": MessageMover.poses,
    "nav_msgs/msg/Path": MessageMover.path,
    "nav_msgs/msg/Odometry": MessageMover.odometry,
}
