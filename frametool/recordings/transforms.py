"""Transforms of recordings: every topic that holds some is read, with whatever namespace.

What comes by a topic `tf_static` stands still.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import FormatError, ValueInvalid, shown
from frametool.frames.stamps import BILLION
from frametool.geometry import quaternion
from frametool.grammar.edges import Edge
from frametool.recordings.read import opened_recording
from frametool.ros.messages import POSES, STAMPS, body_of, stamp_problem
from frametool.ros.plain_messages import unit_components
from frametool.ros.pose_lists import posed_messages

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.recordings.read import Channel, RecordingReader

TYPES = frozenset(("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"))


class RawTransform(NamedTuple):
    """A transform as it was recorded, unchecked; numbers: tx, ty, tz, x, y, z, w; stamp: seconds and nanoseconds."""

    parent: str
    child: str
    numbers: Rigid
    stamp: tuple[int, int]

    @classmethod
    def of(cls, message: Any, body: str = "") -> RawTransform:
        """Return what a TransformStamped says, or a pose over time, of a frame or of a body."""
        if hasattr(message, "transform"):
            body, moved, turned = message.child_frame_id, message.transform.translation, message.transform.rotation
        else:
            pose = getattr(message.pose, "pose", message.pose)
            body = getattr(message, "child_frame_id", "") or body
            moved, turned = pose.position, pose.orientation
        numbers = moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w
        return cls(message.header.frame_id, body, numbers, (message.header.stamp.sec, message.header.stamp.nanosec))


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the transforms of a bag in the order they were recorded.

    An edge's line is the number of its message among those with transforms.
    Raises FileProblem when the extra is missing; FormatError for a bag that is broken or holds no transforms.
    """
    try:
        with opened_recording(file.path, options.tally) as reader:
            yield from recorded_edges(reader, _channels(reader, options), options)
    except FormatError as error:
        options.report(error)


def _channels(reader: RecordingReader, options: Options) -> list[Channel]:
    """Return the channels with transforms, and those chosen that hold poses; raises FormatError without any."""
    reader.refuse_foreign(options.topics.chosen)
    found = [each for each in reader.channels if _is_read(each, options)]
    options.topics.seen |= {each.topic for each in reader.channels}
    for other in reader.channels:
        if other not in found and other.topic.rpartition("/")[2] in ("tf", "tf_static"):
            what = f"{other.topic} holds {other.type} and no transforms; is it damaged?"
            raise FormatError(what, source=reader.path)
    if not found:
        poses = sorted({each.topic for each in reader.channels if each.type in POSES})
        foreign = {f"{each.topic} ({each.encoding})" for each in reader.foreign}
        known = ", ".join(sorted(options.topics.seen | foreign))
        hint = f"; --topic {poses[0]} reads its poses" if poses else ""
        what = f"no transforms in the bag; its topics: {known}{hint}" if known else "no messages in the bag"
        raise FormatError(what, source=reader.path)
    return found


def _is_read(channel: Channel, options: Options) -> bool:
    """Return True for a channel that holds transforms, or was chosen and holds poses."""
    return channel.type in TYPES or (channel.type in POSES and options.topics.chooses(channel.topic))


def recorded_edges(reader: RecordingReader, channels: Sequence[Channel], options: Options) -> Iterator[Edge]:
    """Yield the edges of the messages on some channels; raises FormatError where there is none, or one is broken."""
    number = 0
    for number, (channel, received_ns, data, *_) in enumerate(reader.messages(channels), 1):
        try:
            message = reader.types.read(channel, data)
        except ValueInvalid as error:
            raise FormatError(f"message {number} on {channel.topic}: {error}", source=reader.path) from None
        body = body_of(channel.topic, options.answers)
        for each in posed_messages(message, channel.type) if channel.type in POSES else message.transforms:
            if edge := _edge(RawTransform.of(each, body), number, channel.topic, received_ns, reader.path, options):
                yield edge
    if not number:
        raise FormatError(f"no messages on {', '.join(each.topic for each in channels)}", source=reader.path)


def _edge(said: RawTransform, number: int, topic: str, received_ns: int, path: str, options: Options) -> Edge | None:
    """Return the edge that a message on a topic says; None where the topic does not count.

    number: of the message among those with transforms
    Raises FormatError for one that is none.
    """
    if not options.topics.takes(topic):
        return None
    tally = options.tally
    parent, child = tally.names.bare(said.parent), tally.names.bare(said.child)
    components = unit_components(said.numbers, number, tally, options.normalize)
    if components is None or not parent or not child:
        problem = _complaint(parent, child, said.numbers, normalize=options.normalize)
        edge = f"{shown(parent)} -> {shown(child)}"
        raise FormatError(f"message {number}: {edge}: {problem}", source=path, rule=problem.rule)
    if misfit := stamp_problem(*said.stamp, STAMPS[0]):
        raise FormatError(f"message {number}: {parent!r} -> {child!r}: {misfit}", source=path)
    if clash := options.topics.conflict(topic, child):
        options.report(FormatError(clash, source=path, rule="two-topics"))
    stamp_ns = None if topic.endswith("tf_static") else said.stamp[0] * BILLION + said.stamp[1]
    return Edge(parent, child, components, stamp_ns, number, received_ns, topic=topic)


def _complaint(parent: str, child: str, numbers: tuple[float, ...], *, normalize: bool) -> ValueInvalid:
    """Say what is wrong with a transform that was refused."""
    if not parent or not child:
        return ValueInvalid("an empty frame name")
    problem = quaternion.complaint(*numbers[3:], normalize=normalize)
    return problem or ValueInvalid("its position is not finite", rule="not-finite")
