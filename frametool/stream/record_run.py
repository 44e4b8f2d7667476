"""One copy of a recording: which edges are added or replaced, which messages move, and what is reported."""

from __future__ import annotations

from collections import Counter
from itertools import chain
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import (
    FormatError,
    LookupFailed,
    Misused,
    NoDataAt,
    ValueInvalid,
    alternatives,
    did_you_mean,
    first_of,
    shown,
    warn,
)
from frametool.formats.load import FrameFile, Rules, load_sources
from frametool.frames.stamps import BILLION, format_stamp
from frametool.grammar.edges import Edge, Options, stop
from frametool.recordings.copy import MOST_NAMED, MOVED_TYPES, STATIC, EdgePlan, MessageMover, RecordedEdges, put
from frametool.recordings.messages import TYPES, RawTransform, recorded_edges
from frametool.recordings.read import ITSELF, SERIALIZED, Recorded, broken, read_metadata, typestore
from frametool.recordings.write import KINDS, SECONDS_ROS2, RecordingFile, new_channel, serialised
from frametool.stream.faults import STOP, BadRows, Fault

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import EdgeColumns, Report, Samples
    from frametool.recordings.copy import AddedEdge
    from frametool.recordings.read import Channel, RecordingReader

    Advance = Callable[[int, int], None]  # takes the number of messages and bytes that were read

MOVES = ", ".join(sorted(name.rpartition("/")[2] for name in MOVED_TYPES))
OTHER_TRANSFORMS = "FrameTransform"  # of Foxglove, and lists of them
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
            raise NoDataAt(f"{self.path}: no messages from {' to '.join(map(format_stamp, request.window))}; {there}")
        others = [each for each in reader.all if each not in reader.channels]
        for each in others if request.tree is not None or request.into else ():
            if each.type.replace(".", "/").rpartition("/")[2].startswith(OTHER_TRANSFORMS):  # as protobuf's
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
            source = TransformsOfCopy(reader, used, self.transform_topics, more)
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
                raise FormatError(f"no topic {topic}{alternatives(topic, known, 'topics')}", source=self.path)
        for each in self.named:
            if each.type not in MOVED_TYPES:
                what = f"{each.topic} holds {each.type or 'no type'}; --into moves {MOVES}"
                raise FormatError(what, source=self.path)
        if self.request.into and not self.named:
            movable = sorted({each.topic for each in self.reader.all if each.type in MOVED_TYPES})
            remedy = f"--topic {first_of(movable, MOST_NAMED, gap='|')}" if movable else f"none of them is {MOVES}"
            raise Misused(f"--into moves the messages of topics that are named; {remedy}", source=self.path)

    def _moved(self, mover: MessageMover, channel: Channel, data: bytes) -> bytes | None:
        """Return a message in the other frame; one that cannot be moved is an error, or left out."""
        number = self.moved[channel.topic] = self.moved.get(channel.topic, 0) + 1
        try:
            new = mover.moved(channel, data)
        except (LookupFailed, ValueInvalid) as error:
            stamp = "" if mover.header is None else f", stamp {format_stamp(mover.header[1])}"
            reason = f"on {channel.topic}{stamp}: {error}"
            if self.request.bad.on_error == STOP:
                error.args = (f"{self.path}: message {number}: {reason}",)
                raise
            self.request.bad.take([Fault(number, "", reason)])
            return None
        self.unmoved += new is data
        return new

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
            data = serialised(TF_STATIC, fmt, [(stamp_ns, (edge.parent, edge.child), edge.numbers) for edge in edges])
            file.add([Recorded(channel, first_ns, data, first_ns)])
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
        edges, types, bare = {edge.child: edge for edge in self.plan.replaced}, self.reader.types, self.edges.names.bare
        for message in self._messages(advance):
            channel, data = message.channel, message.data
            if not (self.window[0] <= message.log_ns <= self.window[1] or channel.is_static):
                continue
            if channel in self.used and any(name.encode() in data for name in edges):
                found = types.read(channel, data)
                named = [(edges.get(bare(each.child_frame_id)), each.transform) for each in found.transforms]
                for edge, part in named:
                    if edge is not None:
                        put(part.translation, edge.numbers[:3])
                        put(part.rotation, edge.numbers[3:])
                if any(edge for edge, _ in named):
                    self.rewritten += 1
                    data = types.write(channel, found)
            new = self._moved(self.mover, channel, data) if self.mover and channel in self.named else data
            if new is not None:
                yield message._replace(data=new)

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


class TransformsOfCopy(FrameFile):
    """The transforms of a recording as its copy has them: some of its edges are replaced, and others are added."""

    def __init__(
        self, recording: RecordingReader, channels: Sequence[Channel], topics: set[str], more: Sequence[AddedEdge]
    ) -> None:
        """Take the recording, the channels and topics that are read, and the edges that are added or replaced."""
        super().__init__(recording.path, topics=topics)
        self.recording, self.channels, self.more = recording, channels, more

    def pieces(
        self, report: Report = stop, *, tell: bool = True, normalize: bool = False  # noqa: ARG002
    ) -> Iterator[Edge | Samples | EdgeColumns]:  # fmt: skip
        """Yield its edges, but for those that are replaced, and then the others."""
        self.close()
        options = Options(self.tally, self.topics, report, normalize, self.answers)
        children = {edge.child for edge in self.more}
        found = recorded_edges(self.recording, self.channels, options) if self.channels else ()
        edges = (edge for piece in found for edge in ((piece,) if isinstance(piece, Edge) else piece.edges()))
        yield from (edge for edge in edges if edge.child not in children)
        yield from (Edge(edge.parent, edge.child, edge.numbers) for edge in self.more)
        self.tell()


def _listed(edges: Sequence[AddedEdge]) -> str:
    return first_of([*map(str, edges)], MOST_NAMED)


def _count(messages: int) -> str:
    return f"{messages} message{'s' * (messages != 1)}"
