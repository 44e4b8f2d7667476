"""One copy of a recording: which edges are added or replaced, which messages move, and what is reported.

Poses and points are transformed at their stamps, including covariances; the twist of an Odometry is in its child's
frame and is unchanged.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool import errors
from frametool.errors import BadTopology, FormatError, ValueInvalid, bare, did_you_mean, first_of, shown, warn
from frametool.formats.load import FrameFile, Rules, load_sources
from frametool.frames.stamps import BILLION, format_stamp
from frametool.frames.topology import resolve_name, static_and_moving, to_root, two_parents
from frametool.geometry import floats, quaternion, rigid, uncertainty
from frametool.grammar.edges import Diagnostics, Edge, Names, Topics
from frametool.recordings.messages import POSE_ARRAY, TYPES, RawTransform, numbers_of, posed_messages, recorded_edges
from frametool.recordings.read import ITSELF, SERIALIZED, Recorded, broken, read_metadata, typestore
from frametool.recordings.write import KINDS, SECONDS_ROS2, RecordingFile, new_channel, serialised
from frametool.ros.message_stream import unit_components
from frametool.ros.messages import PATH, POSES, STAMPS, stamp_problem
from frametool.stream.faults import STOP, BadRows, Fault

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.recordings.read import Channel, MessageTypes, RecordingReader

    Advance = Callable[[int, int], None]  # takes the number of messages and bytes that were read

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


class EdgePlan(NamedTuple):
    """The edges of a tree: those that a recording lacks, by topic, and those with the same or other values there.

    apart: the roots of added edges that are not connected to the recording
    """

    added: dict[str, list[Edge]]
    apart: list[str]
    same: list[Edge]
    replaced: list[Edge]


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
        added, same, others, name = list[Edge](), list[Edge](), list[Edge](), bare(tree.name)
        for track in tree.tracks():
            child, parent = (resolve_name(frame, self.frames) for frame in (track.child, track.parent))
            if not track.is_static:
                raise static_and_moving(child, f" moves in {name}; --with adds static frames")
            edge, known = Edge(parent, child, track.components), self.known.get(child)
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
            is_there = not known.varies and is_same(known.numbers, edge.components)
            (same if is_there else others).append(edge)
        if others and not replace:
            differing = []
            for edge in others:
                numbers, on = self.known[edge.child].numbers, first_of([*self.known[edge.child].topics], MOST_NAMED)
                metres, radians = rigid.distance(*numbers, *edge.components, xp=floats)
                off = f"{metres:.3g} m and {radians * floats.RADIAN:.3g} deg off"
                differing.append(f"{_listed([edge])} on {on} ({off})")
            what = f"other values than in {name}: {first_of(differing, MOST_NAMED)}; --replace uses those of {name}"
            raise BadTopology(f"{self.name}: {what}", rule="two-poses")
        return EdgePlan(*self._by_topic(added), same, others)

    def _by_topic(self, added: Iterable[Edge]) -> tuple[dict[str, list[Edge]], list[str]]:
        """Return added edges by topic, `tf_static` in the namespace of the frames above them, and the roots apart."""
        above = {each.child: str(each.parent) for each in added}
        topics, is_held = dict[str, list[Edge]](), dict[str, bool]()
        everywhere = {child: [*edge.parents][-1] for child, edge in self.known.items()} | above
        for edge in added:
            to_root(edge.child, everywhere.get)  # raises for a frame below itself
            line = [*to_root(above[edge.child], above.get), edge.child]
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
MOVED_TYPES = POSES | {"geometry_msgs/msg/PointStamped", POSE_ARRAY}


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


MOVES = ", ".join(sorted(name.rpartition("/")[2] for name in MOVED_TYPES))
TF_STATIC = KINDS["tf_static"]
STEP = 1 << 10  # messages between two reports


class RecordRequest(NamedTuple):
    """What is to be changed in a recording.

    bad: what is done with messages that cannot be moved
    tree: its edges are added; replace: they replace edges with other values
    into: the frame that messages are moved into; topics: of these messages, and of the transforms that are used
    window: the first and the last log time that is copied
    normalize: take any non-zero quaternion
    """

    bad: BadRows
    tree: Frames | None = None
    replace: bool = False
    into: str = ""
    topics: tuple[str, ...] = ()
    window: tuple[int, int] | None = None
    normalize: bool = False


class RecordRun:
    """One copy of a recording: `look` reads it, `pieces` are the bytes of the copy, `summary` says what was done.

    Messages are bytes, and everything that is not changed is preserved.  No messages are kept in memory.
    counts: of messages by channel; span: the first and the last log time
    inside: how many are in the window; outside: how many outside of it are copied; first_ns: the first time of these
    undefined: types that the recording does not define, and whether ROS 2 Humble does
    """

    def __init__(self, recording: RecordingReader, request: RecordRequest) -> None:
        """Begin with a recording that is not read yet."""
        self.reader, self.request, self.path = recording, request, recording.path
        self.window = request.window or (-inf, inf)
        self.counts: Counter[Channel] = Counter()
        self.span: tuple[int, int] | None = None
        self.inside = self.outside = 0
        self.first_ns: int | None = None
        self.undefined: dict[str, bool] = {}
        self.edges = RecordedEdges(recording.path)
        self.plan = EdgePlan({}, [], [], [])
        self.transform_topics = {topic for topic in request.topics if topic.rpartition("/")[2] in ("tf", STATIC)}
        self.used = recording.on_topics(TYPES, self.transform_topics)  # channels whose transforms are used
        named = {topic.strip("/") for topic in {*request.topics} - self.transform_topics}
        self.named = [each for each in recording.all if each.topic.strip("/") in named]  # channels that are moved
        self.mover: MessageMover | None = None
        self.moved: dict[str, int] = {}  # topic -> how many of its messages were looked at
        self.unmoved = self.rewritten = 0

    def look(self, advance: Advance) -> None:
        """Read the recording once, and check that it can be changed as requested.

        Raises FormatError for a recording that is not whole and a topic that cannot be moved, BadTopology for edges
        that do not fit, LookupFailed for a frame that is not there and a window without messages.
        """
        request, reader = self.request, self.reader
        self._read_all(advance)
        self._check_topics()
        if request.window and not self.inside:
            there = f"they are logged from {' to '.join(map(format_stamp, self.span))}" if self.span else "it has none"
            span = " to ".join(map(format_stamp, request.window))
            raise errors.NoDataAt(f"{self.path}: no messages from {span}; {there}")
        others = [each for each in reader.all if each not in reader.channels]
        for each in others if request.tree is not None or request.into else ():
            if each.type.replace(".", "/").rpartition("/")[2].startswith("FrameTransform"):  # as protobuf's
                raise FormatError(f"{each.topic} holds {each.type}: no transforms of recordings", source=self.path)
            if each.encoding == "ros1":
                raise FormatError("messages of ROS 1 in MCAP are only copied, not read", source=self.path)
        if request.tree is not None:
            self.plan = self.edges.plan(request.tree, replace=request.replace)
            for root in self.plan.apart:
                near = did_you_mean(root, self.edges.frames)
                warn(f"{self.path}: frame {shown(root)} is in none of its transforms{near}")
        if request.into:  # by all transforms as they are in the copy
            more = [*chain.from_iterable(self.plan.added.values()), *self.plan.replaced]
            used = [each for each in self.used if self.counts[each]]
            if not more and not used:
                raise FormatError("no transforms in it; --with FILE brings some", source=self.path)
            children = {edge.child for edge in more}

            def as_copied(_: FrameFile, options: Options) -> Iterator[Edge]:
                found = recorded_edges(reader, used, options) if used else ()
                yield from (edge for piece in found for edge in piece.edges() if edge.child not in children)
                yield from more

            source = FrameFile(self.path, topics=self.transform_topics)
            source.reader = as_copied
            frames = load_sources([source], Rules(normalize=request.normalize))
            self.mover = MessageMover(frames, request.into, reader.types, normalize=request.normalize)

    def _read_all(self, advance: Advance) -> None:
        """Count the messages, and collect the edges; raises FormatError if the recording is not complete."""
        used = self.used if self.request.tree is not None else ()
        for channel, log_ns, data, *_ in self._messages(advance):
            self.counts[channel] += 1
            first, last = self.span or (log_ns, log_ns)
            self.span = min(first, log_ns), max(last, log_ns)
            is_inside = self.window[0] <= log_ns <= self.window[1]
            if is_inside or channel.is_static:
                self.first_ns = log_ns if self.first_ns is None else min(self.first_ns, log_ns)
                self.outside += not is_inside
            self.inside += is_inside
            if channel not in used:
                continue
            try:
                found = self.reader.types.read(channel, data).transforms
            except ValueInvalid as error:
                raise FormatError(f"a message on {channel.topic}: {error}", source=self.path) from None
            for each in found:
                self.edges.add(channel.topic, RawTransform.of(each))

    def _check_topics(self) -> None:
        """Raise FormatError for a topic that is not there or cannot be moved, Misused where none is to be moved."""
        known = {channel.topic for channel in self.reader.all}
        for topic in self.request.topics:
            if topic.strip("/") not in {each.strip("/") for each in known}:
                raise FormatError(f"no topic {topic}{errors.alternatives(topic, known, 'topics')}", source=self.path)
        for each in self.named:
            if each.type not in MOVED_TYPES:
                what = f"{each.topic} holds {each.type or 'no type'}; --into moves {MOVES}"
                raise FormatError(what, source=self.path)
        if self.request.into and not self.named:
            movable = sorted({each.topic for each in self.reader.all if each.type in MOVED_TYPES})
            remedy = f"--topic {first_of(movable, MOST_NAMED, gap='|')}" if movable else f"none of them is {MOVES}"
            raise errors.Misused(f"--into moves the messages of topics that are named; {remedy}", source=self.path)

    def _messages(self, advance: Advance) -> Iterator[Recorded]:
        """Yield all messages."""
        size = 0
        with broken(self.path):
            for number, message in enumerate(self.reader.messages(), 1):
                size += len(message.data)
                if number % STEP == 0:
                    advance(STEP, size)
                    size = 0
                yield message

    def pieces(self, fmt: str, folder: str, advance: Advance) -> Iterator[bytes]:
        """Yield the bytes of the copy in a format, starting with the added edges.

        folder: for temporary files while it is written
        """
        reader, first_ns = self.reader, self.first_ns or 0
        files, channels, ros1 = reader.files, reader.all, reader.is_ros1
        stamp_ns = first_ns if first_ns // BILLION <= SECONDS_ROS2[1] else 0
        for each in (one for one in channels if one.schema is None and one.type):  # is it in ROS 2 Humble?
            store = typestore(ros1=False)
            is_known = self.undefined[each.type] = each.type in store.types
            text = store.generate_msgdef(each.type, ros_version=2)[0] if is_known else ""
            each.schema = each.type, "ros2msg" if is_known else "", text.encode()
        file = RecordingFile(fmt, folder, files[0].compression, head=files[0].head)
        for topic, edges in self.plan.added.items():
            # a new channel in a ROS 1 bag even if there is one: players keep only the last message of each
            same = [each for each in reader.channels if (each.topic, each.type) == (topic, TF_STATIC.type)]
            channel = same[0] if same and not ros1 else new_channel(TF_STATIC, topic, ros1=ros1, like=channels)
            file.begin([channel])
            samples = [(stamp_ns, (str(edge.parent), edge.child), edge.components) for edge in edges]
            file.add([Recorded(channel, first_ns, serialised(TF_STATIC, fmt, samples), first_ns)])
        file.begin(channels)
        file.add(self._copied(advance))
        said: dict[str, Any] | None = None  # the metadata of rosbag2 about an MCAP file
        with broken(self.path):
            for other in chain.from_iterable(each.others() for each in files if hasattr(each, "others")):
                if getattr(other, "metadata", None) is not None and other.name == ITSELF:
                    said = read_metadata(other.metadata.get(SERIALIZED, ""), self.path)
                else:
                    file.add_other(other)
            yield from file.pieces(said or reader.metadata, itself=said is not None)

    def _copied(self, advance: Advance) -> Iterator[Recorded]:
        """Yield the messages of the copy: with new values of edges, or in another frame; some are left out."""
        edges, types, names = {edge.child: edge for edge in self.plan.replaced}, self.reader.types, self.edges.names
        for message in self._messages(advance):
            channel, data = message.channel, message.data
            if not (self.window[0] <= message.log_ns <= self.window[1] or channel.is_static):
                continue
            if channel in self.used and any(name.encode() in data for name in edges):
                found = types.read(channel, data)
                named = [(edges.get(names.bare(each.child_frame_id)), each.transform) for each in found.transforms]
                for edge, part in named:
                    if edge is not None:
                        put(part.translation, edge.components[:3])
                        put(part.rotation, edge.components[3:])
                if any(edge for edge, _ in named):
                    self.rewritten += 1
                    data = types.write(channel, found)
            if self.mover and channel in self.named:
                number = self.moved[channel.topic] = self.moved.get(channel.topic, 0) + 1
                try:
                    data = self.mover.moved(channel, data)
                except (errors.LookupFailed, ValueInvalid) as error:
                    stamp = "" if self.mover.header is None else f", stamp {format_stamp(self.mover.header[1])}"
                    reason = f"on {channel.topic}{stamp}: {error}"
                    if self.request.bad.on_error == STOP:
                        error.args = (f"{self.path}: message {number}: {reason}",)
                        raise
                    self.request.bad.take([Fault(number, "", reason)])
                    continue
                self.unmoved += data is message.data
            yield message._replace(data=data)

    def summary(self) -> Iterator[str]:
        """Yield a sentence for each thing that was done or not needed."""
        for topic, edges in self.plan.added.items():
            yield f"added on {topic}: {_listed(edges)}"
        if self.plan.replaced:
            yield f"replaced in {_count(self.rewritten)}: {_listed(self.plan.replaced)}"
        if self.plan.same:
            yield f"there already with the same values: {_listed(self.plan.same)}"
        if self.moved:
            count, topics = sum(self.moved.values()) - self.request.bad.count, first_of([*self.moved], MOST_NAMED)
            stayed = f", {self.unmoved} of them were in it" if self.unmoved else ""
            yield f"{_count(count)} in {self.request.into} ({topics}){stayed}"
        if self.outside:
            yield f"kept outside of --between: {_count(self.outside)} on {STATIC}"
        for is_usual, how in (True, "written as in ROS 2 Humble"), (False, "copied without a definition"):
            if kinds := sorted(kind for kind, usual in self.undefined.items() if usual is is_usual):
                yield f"types that it does not define are {how}: {first_of(kinds, MOST_NAMED)}"
        if not (self.plan.added or self.rewritten or self.moved or self.request.window):
            yield f"nothing is changed: {_count(self.counts.total())} copied"


def _listed(edges: Sequence[Edge]) -> str:
    return first_of([f"{bare(str(edge.parent))} -> {bare(edge.child)}" for edge in edges], MOST_NAMED)


def _count(messages: int) -> str:
    return f"{messages} message{'s' * (messages != 1)}"
