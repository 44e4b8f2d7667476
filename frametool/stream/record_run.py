"""One copy of a recording: which edges are added or replaced, which messages move, and what is reported."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import (
    FormatError,
    FrametoolError,
    LookupFailed,
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
from frametool.ros.bags import TYPES, recorded_edge
from frametool.ros.latched import added_messages
from frametool.ros.message_bytes import Transforms
from frametool.ros.moved_messages import MOVED_TYPES, MessageMover
from frametool.ros.record_changes import RecordChanges, RecordContents
from frametool.ros.record_copy import copied
from frametool.ros.recorded_edges import MOST_NAMED, STATIC, EdgePlan, RecordedEdges, replaced
from frametool.ros.recordings import SECONDS_ROS2
from frametool.stream.faults import DONE, MOST, ROWS_SKIPPED, SKIP, STOP, Misused, RowsSkipped

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.errors import Finding
    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import EdgeColumns, Report, Samples
    from frametool.ros.message_chunks import Channel
    from frametool.ros.record_changes import Change
    from frametool.ros.record_copy import Advance, CopiedRecording
    from frametool.ros.recorded_edges import AddedEdge

MOVES = ", ".join(sorted(name.rpartition("/")[2] for name in MOVED_TYPES))
OTHER_TRANSFORMS = "FrameTransform"  # of Foxglove, and lists of them
LAST_STAMP = SECONDS_ROS2[1] * BILLION


class RecordRequest(NamedTuple):
    """What is to be changed in a recording.

    tree: its edges are added; replace: they replace edges with other values
    into: the frame that messages are moved into; topics: of these messages, and of the transforms that are used
    window: the first and the last log time that is copied
    on_error: STOP or SKIP, at a message that cannot be moved; report: is called with the reason
    normalize: take any non-zero quaternion
    """

    tree: Frames | None = None
    replace: bool = False
    into: str = ""
    topics: tuple[str, ...] = ()
    window: tuple[int, int] | None = None
    on_error: str = STOP
    report: Callable[[FrametoolError], None] = lambda _error: None
    normalize: bool = False


class RecordRun:
    """One copy of a recording: `look` reads it, `pieces` are the bytes of the copy, `summary` says what was done."""

    def __init__(self, recording: CopiedRecording, request: RecordRequest) -> None:
        """Begin with a recording that is not read yet."""
        self.recording, self.request = recording, request
        self.changes = RecordChanges(request.window)
        self.contents = RecordContents(recording, self.changes)
        self.edges = RecordedEdges(recording.path, ros1=recording.is_ros1)
        self.plan = EdgePlan([], [], [])
        self.added: dict[str, list[AddedEdge]] = {}  # by the topics they come on
        self.transform_topics = {topic for topic in request.topics if topic.rpartition("/")[2] in ("tf", STATIC)}
        self.mover: MessageMover | None = None
        self.moved: dict[str, int] = {}  # topic -> how many of its messages were looked at
        self.unmoved = self.skipped = self.rewritten = 0

    def look(self, advance: Advance) -> None:
        """Read the recording once, and check that it can be changed as requested.

        Raises FormatError for a recording that is not whole and a topic that cannot be moved, BadTopology for edges
        that do not fit, LookupFailed for a frame that is not there and a window without messages.
        """
        request = self.request
        self.contents.read(advance, self._collect_edges if request.tree is not None else None)
        channels = self.recording.channels
        self._check_topics(channels)
        if request.window and not self.contents.inside:
            raise NoDataAt(self._empty(request.window))
        if request.tree is not None or request.into:
            self._refuse_others(channels)
        if request.tree is not None:
            self.plan = self.edges.plan(request.tree, replace=request.replace)
            for edge in self.plan.added:
                self.added.setdefault(self.edges.topic_for(edge, self.plan.added), []).append(edge)
            for root in self.edges.apart(self.plan.added):
                near = did_you_mean(root, self.edges.frames)
                warn(f"{self.recording.path}: frame {shown(root)} is in none of its transforms{near}")
        changes = self.changes.change
        if self.plan.replaced:
            change = self._replacer()
            changes |= {number: change for number, each in channels.items() if self._is_used(each)}
        if request.into:
            ros1, normalize = self.recording.is_ros1, request.normalize
            self.mover = mover = MessageMover(self._frames(), request.into, ros1=ros1, normalize=normalize)
            named = {number: each for number, each in channels.items() if self._is_named(each)}
            changes |= {number: self._moving(each, mover) for number, each in named.items()}

    def _is_used(self, channel: Channel) -> bool:
        """Tell whether the transforms of a channel are used: those of the topics that are named, or all."""
        return channel.type in TYPES and (not self.transform_topics or _is_among(channel.topic, self.transform_topics))

    def _is_named(self, channel: Channel) -> bool:
        """Tell whether the messages of a channel are to be moved."""
        return _is_among(channel.topic, {*self.request.topics} - self.transform_topics)

    def _collect_edges(self, channel: Channel, data: bytes) -> None:
        """Collect the edges of a message of transforms."""
        if not self._is_used(channel):
            return
        with _on_topic(channel.topic, self.recording.path):
            self.edges.add(channel.topic, data)

    def _check_topics(self, channels: dict[int, Channel]) -> None:
        """Raise FormatError for a topic that is not there or cannot be moved, Misused where none is to be moved."""
        path, into = self.recording.path, self.request.into
        known = {channel.topic for channel in channels.values()}
        for topic in self.request.topics:
            if not _is_among(topic, known):
                raise FormatError(f"no topic {topic}{alternatives(topic, known, 'topics')}", source=path)
        named = [channel for channel in channels.values() if self._is_named(channel)]
        for topic, kind, _ in named:
            if kind not in MOVED_TYPES:
                raise FormatError(f"{topic} holds {kind or 'no type'}; --into moves {MOVES}", source=path)
        if into and not named:
            movable = sorted({each.topic for each in channels.values() if each.type in MOVED_TYPES})
            remedy = f"--topic {first_of(movable, MOST_NAMED, gap='|')}" if movable else f"none of them is {MOVES}"
            beside = f" beside {first_of(sorted(self.transform_topics), MOST_NAMED)}" if self.transform_topics else ""
            raise Misused(f"--into moves the messages of topics that are named{beside}; {remedy}", source=path)

    def _refuse_others(self, channels: dict[int, Channel]) -> None:
        """Raise FormatError for transforms that cannot be read here, as protobuf's."""
        for topic, kind, encoding in channels.values():
            if kind.replace(".", "/").rpartition("/")[2].startswith(OTHER_TRANSFORMS):
                raise FormatError(f"{topic} holds {kind}: no transforms of recordings", source=self.recording.path)
            if encoding == "ros1" and not self.recording.is_ros1:
                raise FormatError("messages of ROS 1 in MCAP are only copied, not read", source=self.recording.path)

    def _empty(self, window: tuple[int, int]) -> str:
        """Say that no message lies in a window."""
        span = self.contents.span
        there = f"they are logged from {' to '.join(map(format_stamp, span))}" if span else "it has none at all"
        return f"{self.recording.path}: no messages from {' to '.join(map(format_stamp, window))}; {there}"

    def _frames(self) -> Frames:
        """Return all transforms as they are in the copy."""
        more = [*self.plan.added, *self.plan.replaced]
        channels = self.recording.channels
        if not more and not any(self.contents.counts[number] for number in channels if self._is_used(channels[number])):
            raise FormatError("no transforms in it; --with FILE brings some", source=self.recording.path)
        source = TransformsOfCopy(self.recording, self.transform_topics, more)
        return load_sources([source], Rules(normalize=self.request.normalize))

    def _replacer(self) -> Change:
        """Return a function that puts the new values into messages of transforms."""
        edges = {edge.child: edge for edge in self.plan.replaced}
        names = [child.encode() for child in edges]

        def change(data: bytes, _log_ns: int) -> bytes:
            if not any(name in data for name in names):
                return data
            new = replaced(data, edges, self.edges.bare, ros1=self.recording.is_ros1)
            self.rewritten += new is not data
            return new

        return change

    def _moving(self, channel: Channel, mover: MessageMover) -> Change:
        """Return a function that moves the messages of a channel; one that cannot be moved is an error, or left out."""

        def change(data: bytes, _log_ns: int) -> bytes | None:
            number = self.moved[channel.topic] = self.moved.get(channel.topic, 0) + 1
            try:
                new = mover.moved(channel.type, data)
            except (LookupFailed, ValueInvalid) as error:
                stamp = "" if mover.header is None else f", stamp {format_stamp(mover.header.stamp_ns)}"
                fate = " (message skipped)" if self.request.on_error == SKIP else ""
                error.args = (f"{self.recording.path}: message {number} on {channel.topic}{stamp}: {error}{fate}",)
                if not fate:
                    raise
                self.skipped += 1
                if self.skipped <= MOST:
                    self.request.report(error)
                return None
            self.unmoved += new is data
            return new

        return change

    def pieces(self, form: str, folder: str, advance: Advance) -> Iterator[bytes]:
        """Yield the bytes of the copy in a form; folder: where there is room for it while it is written."""
        first_ns = self.contents.first_ns or 0
        added = added_messages(self.recording, self.added, first_ns if first_ns < LAST_STAMP else 0)
        yield from copied(self.recording, self.changes, added, first_ns, form, folder, advance)

    def summary(self) -> Iterator[str]:
        """Yield a sentence for each thing that was done or not needed."""
        for topic, edges in self.added.items():
            yield f"added on {topic}: {_listed(edges)}"
        if self.plan.replaced:
            yield f"replaced in {_count(self.rewritten)}: {_listed(self.plan.replaced)}"
        if self.plan.same:
            yield f"there already with the same values: {_listed(self.plan.same)}"
        if self.moved:
            count, topics = sum(self.moved.values()) - self.skipped, first_of([*self.moved], MOST_NAMED)
            stayed = f", {self.unmoved} of them were in it" if self.unmoved else ""
            yield f"{_count(count)} in {self.request.into} ({topics}){stayed}"
        if self.contents.outside:
            yield f"kept outside of --between: {_count(self.contents.outside)} on {STATIC}"
        for is_usual, how in (True, "written as in ROS 2 Humble"), (False, "copied without a definition"):
            if kinds := sorted(kind for kind, usual in self.recording.undefined.items() if usual is is_usual):
                yield f"types that it does not define are {how}: {first_of(kinds, MOST_NAMED)}"
        if not (self.added or self.rewritten or self.moved or self.request.window):
            yield f"nothing is changed: {_count(sum(self.contents.counts.values()))} copied"

    def remarks(self) -> Iterator[Finding]:
        """Yield what was odd in messages that were moved."""
        if self.mover is not None:
            yield from self.mover.tally.told()

    def finish(self) -> int:
        """Report how many messages were left out; return the exit status."""
        if not self.skipped:
            return DONE
        total = sum(self.moved.values())
        more = f", {self.skipped - MOST} of them not shown" if self.skipped > MOST else ""
        message = f"{self.recording.path}: {self.skipped} of {total} messages skipped{more}"
        self.request.report(RowsSkipped(message, source=self.recording.path, bad=self.skipped, messages=total))
        return ROWS_SKIPPED


class TransformsOfCopy(FrameFile):
    """The transforms of a recording as its copy has them: some of its edges are replaced, and others are added."""

    def __init__(self, recording: CopiedRecording, topics: set[str], more: Sequence[AddedEdge]) -> None:
        """Take the recording, the topics that are read (all if none), and the edges that are added or replaced."""
        super().__init__(recording.path, topics=topics)
        self.recording, self.more = recording, more

    def pieces(
        self, report: Report = stop, *, tell: bool = True, normalize: bool = False  # noqa: ARG002
    ) -> Iterator[Edge | Samples | EdgeColumns]:  # fmt: skip
        """Yield its edges, but for those that are replaced, and then the others."""
        self.close()
        options = Options(self.tally, self.topics, report, normalize, self.answers)
        children = {edge.child for edge in self.more}
        for number, (channel, log_ns, data) in enumerate(self.recording.messages(TYPES), 1):
            with _on_topic(channel.topic, self.path):
                for said in Transforms(data, ros1=self.recording.is_ros1):
                    edge = recorded_edge(said, number, channel.topic, log_ns, self.path, options)
                    if edge is not None and edge.child not in children:
                        yield edge
        yield from (Edge(edge.parent, edge.child, edge.numbers) for edge in self.more)
        self.tell()


@contextmanager
def _on_topic(topic: str, path: str) -> Iterator[None]:
    """Name the topic of a message that cannot be read."""
    try:
        yield
    except ValueInvalid as error:
        raise FormatError(f"a message on {topic}: {error}", source=path) from None


def _is_among(topic: str, topics: set[str]) -> bool:
    """Tell whether a topic is one of some, with or without a slash in front."""
    return topic.strip("/") in {each.strip("/") for each in topics}


def _listed(edges: Sequence[AddedEdge]) -> str:
    return first_of(list(map(str, edges)), MOST_NAMED)


def _count(messages: int) -> str:
    return f"{messages} message{'s' * (messages != 1)}"
