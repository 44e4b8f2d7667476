"""Copy a recording with changes: messages are bytes, and everything else is preserved.

The recording is read twice: first to analyse and check it, then to write the copy.  No messages are kept in memory.
Edges of a tree can be added, and messages of poses and points be transformed to another frame, each at its stamp,
including covariances; the twist of an Odometry is in its child's frame and is unchanged.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import BadTopology, ValueInvalid, bare, first_of, shown
from frametool.frames.stamps import BILLION
from frametool.frames.topology import resolve_name, static_and_moving, to_root, two_parents
from frametool.geometry import floats, quaternion, rigid, uncertainty
from frametool.grammar.edges import Diagnostics, Names, Topics
from frametool.recordings.alike import POSE_ARRAY, posed_messages
from frametool.recordings.made import KINDS, serialised, typestore
from frametool.recordings.messages import checked_components, numbers_of
from frametool.recordings.read import ITSELF, SERIALIZED, Recorded, broken, read_metadata
from frametool.recordings.write import RecordingFile, new_channel
from frametool.ros.messages import PATH, STAMPS, stamp_problem

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.recordings.made import MessageTypes
    from frametool.recordings.messages import RawTransform
    from frametool.recordings.read import Channel, RecordingReader

    Advance = Callable[[int, int], None]  # takes the number of messages and bytes that were read
    Change = Callable[[bytes], bytes | None]  # of a message; None drops it

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
    """The edges of a tree, grouped by whether a recording lacks them or has the same or other values."""

    added: list[AddedEdge]
    same: list[AddedEdge]
    replaced: list[AddedEdge]


class RecordedEdges:
    """The edges of a recording, by their children."""

    def __init__(self, name: str) -> None:
        """Create an empty set; `name` is that of the recording, for messages."""
        self.name, self.names = name, Names()
        self.known: dict[str, RecordedEdge] = {}

    def add(self, topic: str, transform: RawTransform) -> None:
        """Add a transform."""
        edge = self.known.setdefault(self.names.bare(transform.child), RecordedEdge(transform.numbers))
        edge.parents[self.names.bare(transform.parent)] = edge.topics[topic] = None
        if not edge.varies and transform.numbers != edge.numbers:
            edge.varies = not is_same(transform.numbers, edge.numbers)

    @cached_property
    def frames(self) -> dict[str, str]:
        """Return all frames, each with a topic, once all transforms were added."""
        found: dict[str, str] = {}
        for child, edge in self.known.items():
            for frame in (*edge.parents, child):
                found.setdefault(frame, next(iter(edge.topics)))
        return found

    def topic_for(self, edge: AddedEdge, added: Iterable[AddedEdge]) -> str:
        """Return the topic for an added edge: `tf_static` in the namespace of the frames above it."""
        parents = {each.child: each.parent for each in added}
        line = [*to_root(edge.parent, parents.get), edge.child]
        topic = next((self.frames[frame] for frame in line if frame in self.frames), "/tf")
        return f"{topic.rpartition('/')[0]}/{STATIC}"

    def apart(self, added: Sequence[AddedEdge]) -> list[str]:
        """Return the roots of added edges that are not connected to the recording."""
        parents, known = {each.child: each.parent for each in added}, self.frames.keys()
        root_of = {edge: to_root(edge.parent, parents.get)[-1] for edge in added}
        held = {root for edge, root in root_of.items() if not known.isdisjoint((edge.parent, edge.child))}
        return sorted({*root_of.values()} - held) if known else []

    def plan(self, tree: Frames, *, replace: bool) -> EdgePlan:
        """Group the edges of a tree: missing in the recording, present with the same values, or with others.

        replace: accept other values
        Raises BadTopology for a frame that moves here or there, has another parent or would be below itself, and for
        other values without `replace`.
        """
        found = EdgePlan([], [], [])
        for track in tree.tracks():
            child, parent = (resolve_name(frame, self.frames) for frame in (track.child, track.parent))
            if not track.is_static:
                raise static_and_moving(child, f" moves in {bare(tree.name)}; --with adds static frames")
            edge, known = AddedEdge(parent, child, track.components), self.known.get(child)
            if known is None:
                found.added.append(edge)
                continue
            self._refuse_other(edge, known, tree.name)
            same = not known.varies and is_same(known.numbers, edge.numbers)
            (found.same if same else found.replaced).append(edge)
        if found.replaced and not replace:
            raise BadTopology(self._others(found.replaced, tree.name), rule="two-poses")
        parents = {child: [*edge.parents][-1] for child, edge in self.known.items()}
        parents |= {edge.child: edge.parent for edge in found.added}
        for edge in found.added:
            to_root(edge.child, parents.get)  # raises for a frame below itself
        return found

    def _refuse_other(self, edge: AddedEdge, known: RecordedEdge, tree: str) -> None:
        """Raise BadTopology for a frame with another parent, a moving one, and one that comes from two robots."""
        topics, here = Topics(), f"{self.name}, {first_of([*known.topics], MOST_NAMED)}"
        for problem in filter(None, (topics.conflict(topic, edge.child) for topic in known.topics)):
            raise BadTopology(problem, source=self.name, rule="two-topics")
        if others := [parent for parent in known.parents if parent != edge.parent]:
            raise two_parents(edge.child, others[0], edge.parent, (here, bare(tree)))
        if known.varies and not any(topic.endswith(STATIC) for topic in known.topics):
            both = f"it moves in {shown(edge.parent)} ({here}) and is static in it ({bare(tree)})"
            raise static_and_moving(edge.child, f": {both}")

    def _others(self, edges: list[AddedEdge], tree: str) -> str:
        """Return which edges have other values, and the differences."""
        differing = []
        for edge in edges:
            known = self.known[edge.child]
            metres, radians = rigid.distance(*known.numbers, *edge.numbers, xp=floats)
            off = f"{metres:.3g} m and {radians * floats.RADIAN:.3g} deg off"
            differing.append(f"{edge} on {first_of([*known.topics], MOST_NAMED)} ({off})")
        what = first_of(differing, MOST_NAMED)
        return f"{self.name}: other values than in {bare(tree)}: {what}; --replace uses those of {bare(tree)}"


def is_same(a: Rigid, b: Rigid) -> bool:
    """Return True if two transforms are equal, whatever the sign of their quaternions; a zero quaternion never is."""
    if not (any(a[3:]) and any(b[3:])):
        return a == b
    metres, radians = rigid.distance(*_unit(*a), *_unit(*b), xp=floats)
    return bool(metres <= SAME * (1.0 + max(map(abs, a[:3]))) and radians <= SAME)


def _unit(tx: float, ty: float, tz: float, x: float, y: float, z: float, w: float) -> Rigid:
    return tx, ty, tz, *quaternion.normalized(x, y, z, w, floats)


def replaced(message: Any, edges: dict[str, AddedEdge], bare_name: Callable[[str], str]) -> bool:
    """Replace the numbers of some edges in a message of transforms; return True if it has any of them."""
    found = [(each, edges.get(bare_name(each.child_frame_id))) for each in message.transforms]
    for each, edge in found:
        if edge is not None:
            put(each.transform.translation, edge.numbers[:3])
            put(each.transform.rotation, edge.numbers[3:])
    return any(edge for _, edge in found)


def put(part: Any, numbers: Sequence[float]) -> None:
    """Write numbers to x, y, z and w of a part of a message."""
    for name, number in zip("xyzw", numbers, strict=False):
        setattr(part, name, number)


LISTS = (POSE_ARRAY, PATH)
MOVED_TYPES = frozenset((
    "geometry_msgs/msg/PointStamped", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/Odometry", *LISTS,
))  # fmt: skip


class MessageHeader(NamedTuple):
    """The frame and the stamp of a header."""

    frame: str
    stamp_ns: int


class MessageMover:
    """Transforms messages to one frame, by static or moving transforms."""

    def __init__(self, frames: Frames, into: str, types: MessageTypes, *, normalize: bool = False) -> None:
        """Store the transforms; raises UnknownFrame for a frame that they do not have.

        normalize: accept any non-zero quaternion
        """
        frames.require(into)
        self.frames, self.into, self.types, self.normalize = frames, frames.resolve_name(into), types, normalize
        self.tally = Diagnostics()  # names with a leading slash, and quaternions that are not unit
        self.header: MessageHeader | None = None  # of the last message, as far as it was read
        self._pose_of = lru_cache(1)(self._looked_up)

    def moved(self, channel: Channel, data: bytes) -> bytes:
        """Return a message of one of MOVED_TYPES in the frame; the same object if it is in this frame already.

        Raises ValueInvalid if it cannot be read or is not a pose, LookupFailed if no transform leads to the frame.
        """
        self.header = None
        message = self.types.read(channel, data)
        self.header = self._read(message.header)
        parts = posed_messages(message, channel.type)
        movers = [self._pose_of(self._read(each.header)) for each in parts]
        is_listed = channel.type in LISTS and self.header.frame != self.into
        if not is_listed and all(each is None for each in movers):
            return data
        for part, mover in zip(parts, movers, strict=True):
            if mover is not None:
                self._move(part, mover)
        for each in (message, *(message.poses if channel.type == PATH else ())):
            each.header.frame_id = self.into
        return self.types.write(channel, message)

    def _read(self, header: Any) -> MessageHeader:
        """Read a header; raises ValueInvalid for an invalid stamp."""
        if problem := stamp_problem(header.stamp.sec, header.stamp.nanosec, STAMPS[0]):
            raise problem
        return MessageHeader(self.tally.names.bare(header.frame_id), header.stamp.sec * BILLION + header.stamp.nanosec)

    def _looked_up(self, header: MessageHeader) -> Rigid | None:
        """Return the pose that transforms from the frame of a header; None for the target frame itself."""
        if header.frame == self.into:
            return None
        if not header.frame:
            raise ValueInvalid("its header names no frame")
        return self.frames.lookup_components(self.into, header.frame, header.stamp_ns)

    def _move(self, part: Any, mover: Rigid) -> None:
        """Transform a point, or a pose and its covariance."""
        if hasattr(part, "point"):
            numbers = part.point.x, part.point.y, part.point.z
            if not abs(sum(numbers)) < uncertainty.INFINITE:
                raise ValueInvalid("the point is not finite", rule="not-finite")
            put(part.point, [each + 0.0 for each in rigid.apply(*mover, *numbers)])
            return
        pose = getattr(part.pose, "pose", part.pose)
        found = checked_components(numbers_of(pose.position, pose.orientation), 0, self.tally, self.normalize)
        tx, ty, tz, x, y, z, w = rigid.compose(*mover, *found)
        put(pose.position, (tx + 0.0, ty + 0.0, tz + 0.0))
        put(pose.orientation, [each + 0.0 for each in quaternion.unit(x, y, z, w, floats)])
        if pose is not part.pose:
            entries = tuple(part.pose.covariance.tolist())
            if any(entries) and entries[0] != uncertainty.UNKNOWN:
                uncertainty.taken(entries)
                part.pose.covariance = np.array(uncertainty.rotate_covariance(entries, *mover[3:])) + 0.0


TF_STATIC = KINDS["tf_static"]
STEP = 1 << 10  # messages between two reports


class RecordCopy:
    """The contents of a recording, and the changes of its copy.

    window: the first and the last log time that is copied; static data are always copied
    change: returns the new messages of a channel; added: the edges that come first, by topic
    counts: of messages by channel; span: the first and the last log time
    inside: how many are in the window; outside: how many outside of it are copied; first_ns: the first time of these
    undefined: types that the recording does not define, and whether ROS 2 Humble does
    """

    def __init__(self, reader: RecordingReader, window: tuple[int, int] | None = None) -> None:
        """Store what to copy; nothing is read yet."""
        self.reader, self.window = reader, window
        self.change: dict[Channel, Change] = {}
        self.added: dict[str, list[AddedEdge]] = {}
        self.counts: Counter[Channel] = Counter()
        self.span: tuple[int, int] | None = None
        self.inside = self.outside = 0
        self.first_ns: int | None = None
        self.undefined: dict[str, bool] = {}

    def read_all(self, advance: Advance) -> None:
        """Read everything and pass every message to `see`; raises FormatError if the recording is not complete."""
        for channel, log_ns, data, *_ in self._messages(advance):
            self.counts[channel] += 1
            first, last = self.span or (log_ns, log_ns)
            self.span = min(first, log_ns), max(last, log_ns)
            is_inside = self._is_inside(log_ns)
            if is_inside or channel.is_static:
                self.first_ns = log_ns if self.first_ns is None else min(self.first_ns, log_ns)
                self.outside += not is_inside
            self.inside += is_inside
            self.see(channel, data)

    def see(self, channel: Channel, data: bytes) -> None:
        """Look at a message when everything is read."""

    def _messages(self, advance: Advance) -> Iterator[Recorded]:
        """Yield all messages."""
        size = 0
        with broken(self.reader.path):
            for number, message in enumerate(self.reader.messages(), 1):
                size += len(message.data)
                if number % STEP == 0:
                    advance(STEP, size)
                    size = 0
                yield message

    def _is_inside(self, log_ns: int) -> bool:
        return self.window is None or self.window[0] <= log_ns <= self.window[1]

    def pieces(self, fmt: str, folder: str, stamp_ns: int, advance: Advance) -> Iterator[bytes]:
        """Yield the bytes of the copy in a format, starting with the added edges; stamp_ns: of these.

        folder: for temporary files while it is written
        """
        files = self.reader.files
        for each in self.reader.all:
            if each.schema is None and each.type:
                self._define(each)
        file = RecordingFile(fmt, folder, files[0].compression, head=files[0].head)
        for topic, edges in self.added.items():
            channel = self._latched(topic)
            file.begin([channel])
            frames = [(edge.parent, edge.child) for edge in edges]
            data = serialised(TF_STATIC, fmt, frames, [stamp_ns] * len(edges), [edge.numbers for edge in edges])
            file.add(Recorded(channel, self.first_ns or 0, data, self.first_ns or 0))
        file.begin(self.reader.all)
        for message in self._messages(advance):
            if self._is_inside(message.log_ns) or message.channel.is_static:
                change = self.change.get(message.channel)
                copied = message.data if change is None else change(message.data)
                if copied is not None:
                    file.add(message._replace(data=copied))
        with broken(self.reader.path):
            said = self._others(file)
            yield from file.pieces(said or self.reader.metadata, itself=said is not None)

    def _others(self, file: RecordingFile) -> dict[str, Any] | None:
        """Copy attachments and metadata of MCAP; return the metadata of rosbag2 in them, or None."""
        said = None
        for source in self.reader.files:
            for other in source.others() if hasattr(source, "others") else ():
                if getattr(other, "metadata", None) is not None and other.name == ITSELF:
                    said = read_metadata(other.metadata.get(SERIALIZED, ""), self.reader.path)
                else:
                    file.add_other(other)
        return said

    def _define(self, channel: Channel) -> None:
        """Define a type that the recording does not define as ROS 2 Humble does, if possible."""
        store = typestore(ros1=False)
        is_known = channel.type in store.types
        self.undefined[channel.type] = is_known
        text = store.generate_msgdef(channel.type, ros_version=2)[0] if is_known else ""
        channel.schema = channel.type, "ros2msg" if is_known else "", text.encode()

    def _latched(self, topic: str) -> Channel:
        """Return a channel of static transforms: that of the recording, or a new one.

        In a ROS 1 bag it is always new, because players keep only the last message of each.
        """
        ros1 = self.reader.is_ros1
        same = [each for each in self.reader.channels if (each.topic, each.type) == (topic, TF_STATIC.type)]
        return same[0] if same and not ros1 else new_channel(TF_STATIC, topic, ros1=ros1, like=self.reader.all)
