"""Copy one recording: add or replace edges, move messages into another frame, and report what was done.

Poses and points are transformed at their stamps, including covariances; the twist of an Odometry is in its child's
frame and is unchanged.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool import errors
from frametool.errors import BadTopology, FormatError, ValueInvalid, bare, did_you_mean, first_of, shown, warn
from frametool.formats.load import FrameFile, Rules, load_sources
from frametool.frames.stamps import BILLION, format_stamp
from frametool.frames.topology import resolve_name, static_and_moving, to_root, two_parents
from frametool.geometry import floats, quaternion, rigid, uncertainty
from frametool.grammar.edges import Answers, Diagnostics, Edge, Names, Topics
from frametool.recordings.contents import POSE_ARRAY, TYPES, numbers_of, posed_messages, raw_transforms, recorded_edges
from frametool.recordings.read import Recorded, typestore
from frametool.recordings.write import KINDS, SECONDS_ROS2, RecordingFile, new_channel, serialised
from frametool.ros.message_stream import unit_components
from frametool.ros.messages import PATH, POSES, STAMPS, stamp_problem
from frametool.rows.faults import STOP, BadRows, Fault

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from frametool.frames.lookups import Frames
    from frametool.geometry import Rigid
    from frametool.grammar.edges import EdgeColumns, Options
    from frametool.recordings.read import Channel, RecordingReader

    Advance = Callable[[int, int], None]  # takes the number of messages and bytes that were read

SAME = 1e-12  # metres, for positions of about a metre, and radians: the rounding of composing and writing numbers
STATIC = "tf_static"
TRANSFORMS = ("tf", STATIC)  # last part of the names of topics of transforms
MOST_NAMED = 8  # edges
MOVED_TYPES = POSES | {"geometry_msgs/msg/PointStamped", POSE_ARRAY}
MOVES = ", ".join(sorted(name.rpartition("/")[2] for name in MOVED_TYPES))
TF_STATIC = KINDS["tf_static"]


@dataclass(slots=True)
class RecordedEdge:
    """The edges of one frame in a recording: first values, parents, topics, and True if other values follow."""

    numbers: Rigid
    parents: dict[str, None] = field(default_factory=dict)
    topics: dict[str, None] = field(default_factory=dict)
    varies: bool = False


def is_same(a: Rigid, b: Rigid) -> bool:
    """Return True if two transforms are equal, whatever the sign of their quaternions; a zero quaternion never is."""
    if not (any(a[3:]) and any(b[3:])):
        return a == b
    one, other = ((*each[:3], *quaternion.normalized(*each[3:], floats)) for each in (a, b))
    metres, radians = rigid.distance(*one, *other, xp=floats)
    return bool(metres <= SAME * (1.0 + max(map(abs, a[:3]))) and radians <= SAME)


def put(part: Any, numbers: Iterable[float]) -> None:
    """Write numbers to x, y, z and w of a part of a message, without -0.0."""
    for name, number in zip("xyzw", numbers, strict=False):
        setattr(part, name, number + 0.0)


@dataclass
class RecordRun:
    """One copy of a recording: `pieces` yields its bytes, `summary` what was changed.

    Messages are copied as bytes, and everything else is preserved.  No messages are kept in memory.

    bad: reports messages that cannot be moved
    tree: its edges are added; replace: they replace edges with other values
    into: the frame that messages are moved into; topics: of these messages, and of the transforms that are used
    window: the first and the last log time that is copied
    normalize: accept any non-zero quaternion
    """

    reader: RecordingReader
    bad: BadRows
    tree: Frames | None = None
    replace: bool = False
    into: str = ""
    topics: tuple[str, ...] = ()
    window: tuple[int, int] | None = None
    normalize: bool = False

    def __post_init__(self) -> None:
        """Read the transforms that are needed, and check that the recording can be changed as requested.

        Raises FormatError for a topic that is missing or cannot be moved, Misused if no topic can be moved.  Raises
        BadTopology for edges that contradict the recording, LookupFailed for an unknown frame.
        """
        self.names = Names()
        self.known: dict[str, RecordedEdge] = {}  # the edges of the recording, by child
        self.topic_of: dict[str, str] = {}  # a topic of each frame
        self.added: dict[str, list[Edge]] = {}  # missing edges, by topic
        self.same: list[Edge] = []  # edges that exist with the same values
        self.replaced: dict[str, Edge] = {}  # edges with other values, by child
        self.moved = Counter[str]()  # number of messages read, by topic
        self.tally = Diagnostics()  # names with a leading slash, and quaternions that are not unit
        self.undefined: dict[str, set[str]] = {}  # types without a definition, by how they are written
        self.copied = self.unmoved = self.rewritten = self.outside = 0
        of_transforms = {topic for topic in self.topics if topic.rpartition("/")[2] in TRANSFORMS}
        self.used = self.reader.on_topics(TYPES, of_transforms)  # channels whose transforms are used
        self.named = self._chosen(of_transforms)  # channels that are moved
        if self.tree is not None:
            self._plan(self.tree)
        if self.into:
            frames = self._as_copied(of_transforms)
            (self.into,) = frames.require(self.into)
            self.lookup = lru_cache(1)(frames.lookup_components)  # poses of an array have one header

    def _chosen(self, of_transforms: set[str]) -> list[Channel]:
        """Return the channels that are moved.

        Raises FormatError for a topic that is missing or cannot be read, Misused if no topic can be moved.
        """
        chosen: list[Channel] = []
        channels, path = self.reader.all, self.reader.path
        for topic in self.topics:
            found = [each for each in channels if each.topic.strip("/") == topic.strip("/")]
            if not found:
                known = errors.alternatives(topic, {each.topic for each in channels}, "topics")
                raise FormatError(f"no topic {topic}{known}", source=path)
            for each in found if topic not in of_transforms else ():
                if each.type not in MOVED_TYPES:
                    raise FormatError(f"{each.topic} holds {each.type or 'no type'}; --into moves {MOVES}", source=path)
                chosen.append(each)
        if self.into and not chosen:
            movable = sorted({each.topic for each in channels if each.type in MOVED_TYPES})
            remedy = f"--topic {first_of(movable, MOST_NAMED, gap='|')}" if movable else f"none of them is {MOVES}"
            raise errors.Misused(f"--into moves the messages of topics that are named; {remedy}", source=path)
        for each in channels if self.tree is not None or self.into else ():
            is_like_ours = each.type.replace(".", "/").rpartition("/")[2].startswith("FrameTransform")  # protobuf
            if each not in self.reader.channels and (is_like_ours or each.encoding == "ros1"):
                what = f"{each.topic} holds {each.type} in {each.encoding}, which is only copied, not read"
                raise FormatError(what, source=path)
        return chosen

    def _plan(self, tree: Frames) -> None:
        """Group the edges of a tree: missing in the recording, present with the same values, or with other values.

        Raises BadTopology for a frame that moves in one of them, has another parent or would be below itself; without
        `replace` also for other values.
        """
        for said, _, sent in chain.from_iterable(raw_transforms(self.reader, self.used, Answers())):
            parent, child = self.names.bare(said.parent), self.names.bare(said.child)
            before = self.known.setdefault(child, RecordedEdge(said.numbers))
            before.parents[parent] = before.topics[sent.channel.topic] = None
            for frame in (parent, child):
                self.topic_of.setdefault(frame, sent.channel.topic)
            if not before.varies and said.numbers != before.numbers:
                before.varies = not is_same(said.numbers, before.numbers)
        name, path = bare(tree.name), self.reader.path
        added, differing = dict[str, Edge](), list[str]()
        for track in tree.tracks():
            child, parent = (resolve_name(frame, self.topic_of) for frame in (track.child, track.parent))
            if not track.is_static:
                raise static_and_moving(child, f" moves in {name}; --with adds static frames")
            edge, known = Edge(parent, child, track.components), self.known.get(child)
            if known is None:
                added[child] = edge
                continue
            topics, on = Topics(), first_of([*known.topics], MOST_NAMED)
            here = f"{path}, {on}"
            for problem in filter(None, (topics.conflict(topic, child) for topic in known.topics)):
                raise BadTopology(problem, source=path, rule="two-topics")  # it comes from two robots
            if wrong := [other for other in known.parents if other != parent]:
                raise two_parents(child, wrong[0], parent, (here, name))
            if known.varies and not any(topic.endswith(STATIC) for topic in known.topics):
                raise static_and_moving(child, f": it moves in {shown(parent)} ({here}) and is static in it ({name})")
            if not known.varies and is_same(known.numbers, edge.components):
                self.same.append(edge)
                continue
            self.replaced[child] = edge
            metres, radians = rigid.distance(*known.numbers, *edge.components, xp=floats)
            off = f"{metres:.3g} m and {radians * floats.RADIAN:.3g} deg off"
            differing.append(f"{_listed([edge])} on {on} ({off})")
        if differing and not self.replace:
            what = f"other values than in {name}: {first_of(differing, MOST_NAMED)}; --replace uses those of {name}"
            raise BadTopology(f"{path}: {what}", rule="two-poses")
        self._place(added)

    def _place(self, added: dict[str, Edge]) -> None:
        """Choose the topics of added edges: `tf_static` in the namespace of the frames above them.

        Warns about edges that are not connected to the recording.  Raises BadTopology for a frame below itself.
        """
        above = {child: str(edge.parent) for child, edge in added.items()}
        everywhere = {child: [*edge.parents][-1] for child, edge in self.known.items()} | above
        connected = {to_root(frame, above.get)[-1] for frame in self.topic_of}  # roots above its frames
        apart = set[str]()
        for child, edge in added.items():
            to_root(child, everywhere.get)  # raises for a frame below itself
            line = to_root(above[child], above.get)
            near = next((self.topic_of[frame] for frame in (*line, child) if frame in self.topic_of), "/tf")
            self.added.setdefault(f"{near.rpartition('/')[0]}/{STATIC}", []).append(edge)
            apart |= {line[-1]} - connected
        for root in sorted(apart) if self.topic_of else ():
            near = did_you_mean(root, self.topic_of)
            warn(f"{self.reader.path}: frame {shown(root)} is in none of its transforms{near}")

    def _as_copied(self, topics: set[str]) -> Frames:
        """Return the transforms of the copy: those on some topics, or on all, with the added and replaced edges."""
        more = [*chain.from_iterable(self.added.values()), *self.replaced.values()]
        children = {edge.child for edge in more}
        if not more and not self.used:
            raise FormatError("no transforms in it; --with FILE brings some", source=self.reader.path)

        def read(_: FrameFile, options: Options) -> Iterator[Edge | EdgeColumns]:
            for piece in recorded_edges(self.reader, self.used, options):
                others = (edge for edge in piece.edges() if edge.child not in children)
                yield from [piece] if children.isdisjoint(piece.children) else others
            yield from more

        source = FrameFile(self.reader.path, topics=topics)
        source.reader = read
        return load_sources([source], Rules(normalize=self.normalize))

    def pieces(self, fmt: str, folder: str, advance: Advance) -> Iterator[bytes]:
        """Yield the bytes of the copy in a format, starting with the added edges.

        folder: for temporary files while it is written
        Raises FormatError for a recording that is not whole, NoDataAt for a window without messages.
        """
        reader, copied = self.reader, self._messages(advance)
        files, channels, ros1, first = reader.files, reader.all, reader.is_ros1, next(copied, None)
        first_ns = first.log_ns if first else 0
        stamp_ns = first_ns if first_ns // BILLION <= SECONDS_ROS2[1] else 0
        for each in (one for one in channels if one.schema is None and one.type):
            how, encoding, text, humble = "copied without a definition", "", "", typestore(ros1=False)
            if each.type in humble.types:
                how, encoding = "written as in ROS 2 Humble", "ros2msg"
                text = humble.generate_msgdef(each.type, ros_version=2)[0]
            self.undefined.setdefault(how, set()).add(each.type)
            each.schema = each.type, encoding, text.encode()
        file = RecordingFile(fmt, folder, files[0].compression, head=files[0].head)
        for topic, edges in self.added.items():
            # a new channel in a ROS 1 bag even if there is one: players keep only the last message of each
            same = [each for each in reader.channels if (each.topic, each.type) == (topic, TF_STATIC.type)]
            channel = same[0] if same and not ros1 else new_channel(TF_STATIC, topic, ros1=ros1, like=channels)
            file.begin([channel])
            samples = [(stamp_ns, (str(edge.parent), edge.child), edge.components) for edge in edges]
            file.add([Recorded(channel, first_ns, serialised(TF_STATIC, fmt, samples), first_ns)])
        file.begin(channels)
        file.add(chain([first] if first else (), copied))
        self.copied = sum(file.counts.values())
        for other in chain.from_iterable(each.others() for each in files):
            file.add_other(other)
        yield from file.pieces(reader.metadata)

    def _messages(self, advance: Advance) -> Iterator[Recorded]:
        """Yield the messages of the copy; raises NoDataAt for a window without messages."""
        begin, end = self.window or (-inf, inf)
        outside, is_empty = None, self.window is not None
        for message in self.reader.messages():
            channel, log_ns, data, *_ = message
            advance(1, len(data))
            if begin <= log_ns <= end:
                is_empty = False
            else:
                first, last = outside or (log_ns, log_ns)
                outside = min(first, log_ns), max(last, log_ns)
                if not channel.is_static:
                    continue
                self.outside += 1
            changed: bytes | None = data
            if self.replaced and channel in self.used:
                changed = self._with_edges(channel, data)
            elif channel in self.named:
                changed = self._in_frame(channel, data)
            if changed is not None:
                yield message if changed is data else message._replace(data=changed)
        if self.window and is_empty:
            there = f"they are logged from {' to '.join(map(format_stamp, outside))}" if outside else "it has none"
            span = " to ".join(map(format_stamp, self.window))
            raise errors.NoDataAt(f"{self.reader.path}: no messages from {span}; {there}")

    def _with_edges(self, channel: Channel, data: bytes) -> bytes:
        """Return a message of transforms with the new values of edges; the same object if it has none of them."""
        if not any(name.encode() in data for name in self.replaced):
            return data
        message, is_new = self.reader.types.read(channel, data), False
        for each in message.transforms:
            if edge := self.replaced.get(self.names.bare(each.child_frame_id)):
                put(each.transform.translation, edge.components[:3])
                put(each.transform.rotation, edge.components[3:])
                is_new = True
        self.rewritten += is_new
        return self.reader.types.write(channel, message) if is_new else data

    def _in_frame(self, channel: Channel, data: bytes) -> bytes | None:
        """Return a message in the chosen frame, the same object if it already is; None if it cannot be moved."""
        self.moved[channel.topic] += 1
        stamp = ""
        try:
            message = self.reader.types.read(channel, data)
            frame, stamp_ns = self._header(message)
            stamp, stays = f", stamp {format_stamp(stamp_ns)}", frame == self.into
            for part in posed_messages(message, channel.type):
                frame, stamp_ns = self._header(part)
                if frame != self.into:
                    self._move(part, frame, stamp_ns)
                    stays = False
        except (errors.LookupFailed, ValueInvalid) as error:
            number, reason = self.moved[channel.topic], f"on {channel.topic}{stamp}: {error}"
            if self.bad.on_error == STOP:
                error.args = (f"{self.reader.path}: message {number}: {reason}",)
                raise
            self.bad.take([Fault(number, "", reason)])
            return None
        self.unmoved += stays
        if stays:
            return data
        for each in (message, *(message.poses if channel.type == PATH else ())):
            each.header.frame_id = self.into
        return self.reader.types.write(channel, message)

    def _header(self, message: Any) -> tuple[str, int]:
        """Return the frame and the stamp of a message; raises ValueInvalid for an invalid stamp."""
        stamp = message.header.stamp
        if problem := stamp_problem(stamp.sec, stamp.nanosec, STAMPS[0]):
            raise problem
        return self.tally.names.bare(message.header.frame_id), stamp.sec * BILLION + stamp.nanosec

    def _move(self, part: Any, frame: str, stamp_ns: int) -> None:
        """Transform a point, or a pose and its covariance, from another frame."""
        if not frame:
            raise ValueInvalid("its header names no frame")
        mover = self.lookup(self.into, frame, stamp_ns)
        if hasattr(part, "point"):
            numbers = part.point.x, part.point.y, part.point.z
            if not abs(sum(numbers)) < uncertainty.INFINITE:
                raise ValueInvalid("the point is not finite", rule="not-finite")
            put(part.point, rigid.apply(*mover, *numbers))
            return
        pose = getattr(part.pose, "pose", part.pose)
        found = unit_components(numbers_of(pose.position, pose.orientation), 0, self.tally.rough, self.normalize)
        tx, ty, tz, x, y, z, w = rigid.compose(*mover, *found)
        put(pose.position, (tx, ty, tz))
        put(pose.orientation, quaternion.unit(x, y, z, w, floats))
        if pose is not part.pose:
            entries = tuple(part.pose.covariance.tolist())
            if any(entries) and entries[0] != uncertainty.UNKNOWN:
                uncertainty.taken(entries)
                part.pose.covariance = np.array(uncertainty.rotate_covariance(entries, *mover[3:])) + 0.0

    def summary(self) -> Iterator[str]:
        """Yield a sentence for each change, and for each edge that needed none."""
        for topic, edges in self.added.items():
            yield f"added on {topic}: {_listed(edges)}"
        if self.replaced:
            yield f"replaced in {_count(self.rewritten)}: {_listed(self.replaced.values())}"
        if self.same:
            yield f"there already with the same values: {_listed(self.same)}"
        if self.moved:
            stayed = f", {self.unmoved} of them were in it" if self.unmoved else ""
            topics = first_of([*self.moved], MOST_NAMED)
            yield f"{_count(self.moved.total() - self.bad.count)} in {self.into} ({topics}){stayed}"
        if self.outside:
            yield f"kept outside of --between: {_count(self.outside)} on {STATIC}"
        for how, kinds in sorted(self.undefined.items(), reverse=True):
            yield f"types that it does not define are {how}: {first_of(sorted(kinds), MOST_NAMED)}"
        if not (self.added or self.rewritten or self.moved or self.window):
            yield f"nothing is changed: {_count(self.copied)} copied"


def _listed(edges: Iterable[Edge]) -> str:
    return first_of([f"{bare(str(edge.parent))} -> {bare(edge.child)}" for edge in edges], MOST_NAMED)


def _count(messages: int) -> str:
    return f"{messages} message{'s' * (messages != 1)}"
