"""What changes in the copy of a recording: edges that are added or replaced, and messages in another frame.

Poses and points are transformed at their stamps, including covariances; the twist of an Odometry is in its child's
frame and is unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import BadTopology, ValueInvalid, bare, first_of, shown
from frametool.frames.stamps import BILLION
from frametool.frames.topology import resolve_name, static_and_moving, to_root, two_parents
from frametool.geometry import floats, quaternion, rigid, uncertainty
from frametool.grammar.edges import Diagnostics, Names, Topics
from frametool.recordings.messages import POSE_ARRAY, RawTransform, numbers_of, posed_messages
from frametool.ros.message_stream import unit_components
from frametool.ros.messages import PATH, STAMPS, stamp_problem

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.recordings.read import Channel, MessageTypes

SAME = 1e-12  # metres, for positions of about a metre, and radians: the rounding of composing and writing numbers
STATIC = "tf_static"
MOST_NAMED = 8  # edges


@dataclass(slots=True)
class RecordedEdge:
    """The data of one frame in a recording: its first values, its parents, its topics, and whether others follow."""

    numbers: Rigid
    parents: dict[str, None] = field(default_factory=dict)
    topics: dict[str, None] = field(default_factory=dict)
    varies: bool = False


class AddedEdge(NamedTuple):
    """A static edge: parent_from_child."""

    parent: str
    child: str
    numbers: Rigid

    def __str__(self) -> str:
        """Return `parent -> child`."""
        return f"{bare(self.parent)} -> {bare(self.child)}"


class EdgePlan(NamedTuple):
    """The edges of a tree: those that a recording lacks, by topic, and those with the same or other values there.

    apart: the roots of added edges that are not connected to the recording
    """

    added: dict[str, list[AddedEdge]]
    apart: list[str]
    same: list[AddedEdge]
    replaced: list[AddedEdge]


class RecordedEdges:
    """The edges of a recording, by their children."""

    def __init__(self, name: str) -> None:
        """Create an empty set; `name` is that of the recording, for messages."""
        self.name, self.names = name, Names()
        self.known: dict[str, RecordedEdge] = {}
        self.frames: dict[str, str] = {}  # all of them, each with a topic

    def add(self, topic: str, transform: RawTransform) -> None:
        """Add a transform."""
        child, parent = self.names.bare(transform.child), self.names.bare(transform.parent)
        edge = self.known.setdefault(child, RecordedEdge(transform.numbers))
        edge.parents[parent] = edge.topics[topic] = None
        for frame in (parent, child):
            self.frames.setdefault(frame, topic)
        if not edge.varies and transform.numbers != edge.numbers:
            edge.varies = not is_same(transform.numbers, edge.numbers)

    def plan(self, tree: Frames, *, replace: bool) -> EdgePlan:
        """Group the edges of a tree: missing in the recording, present with the same values, or with others.

        replace: accept other values
        Raises BadTopology for a frame that moves here or there, has another parent or would be below itself, and for
        other values without `replace`.
        """
        added, same, others, name = list[AddedEdge](), list[AddedEdge](), list[AddedEdge](), bare(tree.name)
        for track in tree.tracks():
            child, parent = (resolve_name(frame, self.frames) for frame in (track.child, track.parent))
            if not track.is_static:
                raise static_and_moving(child, f" moves in {name}; --with adds static frames")
            edge, known = AddedEdge(parent, child, track.components), self.known.get(child)
            if known is None:
                added.append(edge)
                continue
            topics, here = Topics(), f"{self.name}, {first_of([*known.topics], MOST_NAMED)}"
            for problem in filter(None, (topics.conflict(topic, child) for topic in known.topics)):
                raise BadTopology(problem, source=self.name, rule="two-topics")  # it comes from two robots
            if wrong := [other for other in known.parents if other != parent]:
                raise two_parents(child, wrong[0], parent, (here, name))
            if known.varies and not any(topic.endswith(STATIC) for topic in known.topics):
                raise static_and_moving(child, f": it moves in {shown(parent)} ({here}) and is static in it ({name})")
            is_there = not known.varies and is_same(known.numbers, edge.numbers)
            (same if is_there else others).append(edge)
        if others and not replace:
            differing = []
            for edge in others:
                numbers, on = self.known[edge.child].numbers, first_of([*self.known[edge.child].topics], MOST_NAMED)
                metres, radians = rigid.distance(*numbers, *edge.numbers, xp=floats)
                differing.append(f"{edge} on {on} ({metres:.3g} m and {radians * floats.RADIAN:.3g} deg off)")
            what = f"other values than in {name}: {first_of(differing, MOST_NAMED)}; --replace uses those of {name}"
            raise BadTopology(f"{self.name}: {what}", rule="two-poses")
        return EdgePlan(*self._by_topic(added), same, others)

    def _by_topic(self, added: Iterable[AddedEdge]) -> tuple[dict[str, list[AddedEdge]], list[str]]:
        """Return added edges by topic, `tf_static` in the namespace of the frames above them, and the roots apart."""
        above = {each.child: each.parent for each in added}
        topics, is_held = dict[str, list[AddedEdge]](), dict[str, bool]()
        everywhere = {child: [*edge.parents][-1] for child, edge in self.known.items()} | above
        for edge in added:
            to_root(edge.child, everywhere.get)  # raises for a frame below itself
            line = [*to_root(edge.parent, above.get), edge.child]
            near = next((self.frames[frame] for frame in line if frame in self.frames), "/tf")
            topics.setdefault(f"{near.rpartition('/')[0]}/{STATIC}", []).append(edge)
            is_held[line[-2]] = is_held.get(line[-2], False) or not self.frames.keys().isdisjoint(line[:1] + line[-1:])
        return topics, sorted(root for root, held in is_held.items() if not held) if self.frames else []


def is_same(a: Rigid, b: Rigid) -> bool:
    """Return True if two transforms are equal, whatever the sign of their quaternions; a zero quaternion never is."""
    if not (any(a[3:]) and any(b[3:])):
        return a == b
    one, other = ((*each[:3], *quaternion.normalized(*each[3:], floats)) for each in (a, b))
    metres, radians = rigid.distance(*one, *other, xp=floats)
    return bool(metres <= SAME * (1.0 + max(map(abs, a[:3]))) and radians <= SAME)


def put(part: Any, numbers: Sequence[float]) -> None:
    """Write numbers to x, y, z and w of a part of a message."""
    for name, number in zip("xyzw", numbers, strict=False):
        setattr(part, name, number)


LISTS = (POSE_ARRAY, PATH)
MOVED_TYPES = frozenset((
    "geometry_msgs/msg/PointStamped", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/Odometry", *LISTS,
))  # fmt: skip


class MessageMover:
    """Transforms messages to one frame, by static or moving transforms."""

    def __init__(self, frames: Frames, into: str, types: MessageTypes, *, normalize: bool = False) -> None:
        """Store the transforms; raises UnknownFrame for a frame that they do not have.

        normalize: accept any non-zero quaternion
        """
        frames.require(into)
        self.frames, self.into, self.types, self.normalize = frames, frames.resolve_name(into), types, normalize
        self.tally = Diagnostics()  # names with a leading slash, and quaternions that are not unit
        self.header: tuple[str, int] | None = None  # frame and stamp of the last message, as far as it was read
        self._pose_of = lru_cache(1)(self._looked_up)

    def moved(self, channel: Channel, data: bytes) -> bytes:
        """Return a message of one of MOVED_TYPES in the frame; the same object if it is in this frame already.

        Raises ValueInvalid if it cannot be read or is not a pose, LookupFailed if no transform leads to the frame.
        """
        self.header = None
        message = self.types.read(channel, data)
        self.header = self._read(message.header)
        parts = posed_messages(message, channel.type)
        movers = [self._pose_of(*self._read(each.header)) for each in parts]
        is_listed = channel.type in LISTS and self.header[0] != self.into
        if not is_listed and all(each is None for each in movers):
            return data
        for part, mover in zip(parts, movers, strict=True):
            if mover is not None:
                self._move(part, mover)
        for each in (message, *(message.poses if channel.type == PATH else ())):
            each.header.frame_id = self.into
        return self.types.write(channel, message)

    def _read(self, header: Any) -> tuple[str, int]:
        """Return the frame and the stamp of a header; raises ValueInvalid for an invalid stamp."""
        if problem := stamp_problem(header.stamp.sec, header.stamp.nanosec, STAMPS[0]):
            raise problem
        return self.tally.names.bare(header.frame_id), header.stamp.sec * BILLION + header.stamp.nanosec

    def _looked_up(self, frame: str, stamp_ns: int) -> Rigid | None:
        """Return the pose that transforms from a frame; None for the target frame itself."""
        if frame == self.into:
            return None
        if not frame:
            raise ValueInvalid("its header names no frame")
        return self.frames.lookup_components(self.into, frame, stamp_ns)

    def _move(self, part: Any, mover: Rigid) -> None:
        """Transform a point, or a pose and its covariance."""
        if hasattr(part, "point"):
            numbers = part.point.x, part.point.y, part.point.z
            if not abs(sum(numbers)) < uncertainty.INFINITE:
                raise ValueInvalid("the point is not finite", rule="not-finite")
            put(part.point, [each + 0.0 for each in rigid.apply(*mover, *numbers)])
            return
        pose = getattr(part.pose, "pose", part.pose)
        found = unit_components(numbers_of(pose.position, pose.orientation), 0, self.tally, self.normalize)
        tx, ty, tz, x, y, z, w = rigid.compose(*mover, *found)
        put(pose.position, (tx + 0.0, ty + 0.0, tz + 0.0))
        put(pose.orientation, [each + 0.0 for each in quaternion.unit(x, y, z, w, floats)])
        if pose is not part.pose:
            entries = tuple(part.pose.covariance.tolist())
            if any(entries) and entries[0] != uncertainty.UNKNOWN:
                uncertainty.taken(entries)
                part.pose.covariance = np.array(uncertainty.rotate_covariance(entries, *mover[3:])) + 0.0
