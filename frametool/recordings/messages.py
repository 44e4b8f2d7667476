"""The contents of a recording's messages: transforms as edges, clouds as numpy records, everything else as JSON lines.

Points, poses, fixes, twists, wrenches and the like are a stream of JSON lines, one per message.  Transforms are read
from every topic that has any; those on a topic `tf_static` are static.  Points of clouds are not copied.
"""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cache
from io import BufferedReader
from itertools import groupby
from json import JSONEncoder
from math import isfinite
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FormatError, Unanswered, ValueInvalid, first_of, listing, shown
from frametool.frames.stamps import BILLION
from frametool.geometry import quaternion
from frametool.grammar.edges import Edge, EdgeColumns
from frametool.recordings.read import opened_recording
from frametool.ros.messages import PATH, POSES, STAMPS, body_of, stamp_problem
from frametool.ros.plain_messages import unit_components
from frametool.text.lines import Pieces

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Diagnostics, Options
    from frametool.recordings.alike import BinaryLayout
    from frametool.recordings.made import MessageTypes
    from frametool.recordings.read import Channel, Recorded, RecordingReader


CLOUD = "sensor_msgs/msg/PointCloud2"
DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_MOST_VALUES = 1 << 16  # per point


class PointCloud(NamedTuple):
    """The points of one message.

    number: of the message among those of its topics, from 1
    frame: that of its header, "" for none
    names: of the columns; rows: (n,) records with the fields 0, 1, .. in their order
    width, height: n is their product
    """

    number: int
    topic: str
    stamp_ns: int
    frame: str
    names: tuple[str, ...]
    rows: NDArray[Any]
    width: int
    height: int


def cloud_topics(reader: Any, chosen: Collection[str], path: str) -> list[str]:
    """Return the topics of clouds to read: those chosen, or the only one.

    chosen: with or without a leading `/`
    Raises Unanswered if there are several, FormatError if there is none.
    """
    there = sorted({each.topic for each in reader.channels if each.type == CLOUD})
    wanted = {topic.strip("/") for topic in chosen}
    found = [topic for topic in there if topic.strip("/") in wanted]
    if found:
        return found
    if not there:
        known = listing({each.topic for each in reader.channels}) or "none"
        raise FormatError(f"no clouds (PointCloud2) in the bag; its topics: {known}", source=path)
    if wanted:
        known = listing(there, near=next(iter(chosen)))
        raise FormatError(f"no clouds on {listing(chosen)}; topics with clouds: {known}", source=path)
    if len(there) > 1:
        raise Unanswered(f"several topics hold clouds; give --topic {first_of(there, 8, gap='|')}", source=path)
    return there


def read_clouds(reader: Any, topics: list[str], path: str, tally: Diagnostics) -> Iterator[PointCloud | FormatError]:
    """Yield the clouds of some topics in the order of the recording; an invalid one is replaced by its error."""
    channels = [each for each in reader.channels if each.topic in topics and each.type == CLOUD]
    for number, (channel, _, data, *_) in enumerate(reader.messages(channels), 1):
        try:
            yield _cloud(reader.types.read(channel, data), number, channel.topic, tally)
        except ValueInvalid as error:
            yield FormatError(str(error), source=path, line=number)


def _cloud(message: Any, number: int, topic: str, tally: Diagnostics) -> PointCloud:
    """Parse a message; raises ValueInvalid if it contradicts itself."""
    stamp = message.header.stamp
    if problem := stamp_problem(stamp.sec, stamp.nanosec, STAMPS[0]):
        raise problem
    names, kind = _record_of(message)
    width, height = int(message.width), int(message.height)
    frame = message.header.frame_id
    return PointCloud(
        number, topic, stamp.sec * BILLION + stamp.nanosec, tally.names.bare(frame) if frame else "", names,
        _rows(message, kind, width, height), width, height,
    )  # fmt: skip


def _record_of(message: Any) -> tuple[tuple[str, ...], np.dtype[Any]]:
    """Return the columns of a point, and its type: each value of a field is a column."""
    order = ">" if message.is_bigendian else "<"
    step = int(message.point_step)
    names: list[str] = []
    formats: list[str] = []
    offsets: list[int] = []
    for field in message.fields:
        code = DATATYPES.get(int(field.datatype))
        if code is None:
            raise ValueInvalid(f"field {shown(field.name)} has the datatype {field.datatype}, known are 1 to 8")
        count, offset, size = max(int(field.count), 1), int(field.offset), int(code[1])
        end = offset + count * size
        if end > step:
            raise ValueInvalid(f"field {shown(field.name)} ends at byte {end}, a point has {step} (point_step)")
        if len(names) + count > _MOST_VALUES:
            raise ValueInvalid(f"a point has more than {_MOST_VALUES} values")
        names += [field.name] if count == 1 else [f"{field.name}_{place}" for place in range(count)]
        formats += [order + code] * count
        offsets += range(offset, end, size)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueInvalid(f"field {shown(twice[0])} appears twice")
    if missing := [name for name in "xyz" if name not in names]:
        raise ValueInvalid(f"no field {', '.join(missing)}; fields: {listing(names) or 'none'}")
    places = [f"{place}" for place in range(len(names))]
    return tuple(names), np.dtype({"names": places, "formats": formats, "offsets": offsets, "itemsize": step})


def _rows(message: Any, kind: np.dtype[Any], width: int, height: int) -> NDArray[Any]:
    """Return the points; the rows of a grid may be padded."""
    data = np.asarray(message.data, np.uint8)
    step, row = kind.itemsize, int(message.row_step)
    if height == 1 or not row:
        row = max(row, width * step) if height == 1 else width * step
    if height > 1 and row < width * step:
        raise ValueInvalid(f"a row of {width} points of {step} bytes has {row} bytes (row_step)")
    needed = (height - 1) * row + width * step if width and height else 0
    if len(data) < needed:
        raise ValueInvalid(f"{width} x {height} points need {needed} bytes, the message has {len(data)}")
    if not needed:
        return np.empty(0, kind)
    grid: NDArray[Any] = np.ndarray((height, width), kind, data, 0, (row, step))
    return grid.reshape(-1)


POSE_ARRAY = "geometry_msgs/msg/PoseArray"


@dataclass
class Posed:
    """A pose of a list, with the fields of a PoseStamped."""

    header: Any
    pose: Any


def posed_messages(message: Any, kind: str) -> Sequence[Any] | Iterator[Any]:
    """Return the poses of a message that is a list of them, each with its header; else the message itself.

    A pose of a Path has its own header; a missing frame or stamp is that of the path.  A stamp of 0 with a frame is
    a valid time if other poses have stamps.
    """
    if kind == POSE_ARRAY:
        return (Posed(message.header, pose) for pose in message.poses)
    if kind == PATH:
        has_stamps = any(each.header.stamp.sec or each.header.stamp.nanosec for each in message.poses)
        return (Posed(_completed(each.header, message.header, has_stamps), each.pose) for each in message.poses)
    return (message,)


def _completed(own: Any, outer: Any, has_stamps: bool) -> Any:  # noqa: FBT001 - it reads so
    """Return a header in which a missing frame and stamp are those of the outer header."""
    says_when = own.stamp.sec or own.stamp.nanosec or (has_stamps and own.frame_id)
    return replace(own, stamp=own.stamp if says_when else outer.stamp, frame_id=own.frame_id or outer.frame_id)


MANY = 4000  # messages
FEW = 16  # messages: fewer are read one by one
MOST_LAYOUTS = 16  # of messages of one length
FIX = "sensor_msgs/msg/NavSatFix"
STAMPED = ("Point", "Pose", "PoseWithCovariance", "Vector3", "Quaternion", "Twist", "TwistWithCovariance", "Wrench",
           "Accel", "AccelWithCovariance", "Transform")  # fmt: skip
RECORDS = frozenset((
    FIX, PATH, POSE_ARRAY, "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField", "nav_msgs/msg/Odometry",
    *(f"geometry_msgs/msg/{name}Stamped" for name in STAMPED),
))  # fmt: skip


def record_channels(reader: RecordingReader, chosen: Collection[str]) -> list[Channel]:
    """Return the channels to read: those chosen, or those of the only topic with records.

    chosen: topics with or without a leading `/`
    Raises Unanswered if several have records and none is chosen.
    """
    there = [each for each in reader.channels if each.type in RECORDS]
    wanted = {topic.strip("/") for topic in chosen}
    topics = sorted({each.topic for each in there})
    if len(topics) > 1 and not wanted:
        named = first_of(topics, 8, gap="|")
        raise Unanswered(f"several topics hold records; give --topic {named}", source=reader.path)
    return [each for each in there if not wanted or each.topic.strip("/") in wanted]


def open_records(path: str, chosen: Collection[str], tally: Diagnostics) -> BufferedReader | None:
    """Open the messages of a bag as JSON lines; None if the chosen topics have clouds.

    Raises FileProblem when the extra is missing, FormatError for a bag that is broken or has neither.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_recording(path, tally))
        reader.refuse_foreign(chosen)
        if channels := record_channels(reader, chosen):
            pieces = filter(None, _pieces(reader, channels))  # an empty one would be the end
            return BufferedReader(Pieces(pieces, opened.pop_all()))
        wanted = {topic.strip("/") for topic in chosen}
        clouds = [each.topic.strip("/") for each in reader.channels if each.type == CLOUD]
        if any(not wanted or topic in wanted for topic in clouds):
            return None
        held = {f"{each.topic} ({each.type})" for each in reader.channels}
        known = listing(held, near=next(iter(chosen), "")) or "none"
        has_frames = any(each.type in TYPES for each in reader.channels)
    named = f" on {listing(chosen)}" if chosen else ""
    remedy = f"; its frames: frametool lookup {path} TARGET SOURCE" if has_frames else ""
    raise FormatError(f"no points, poses or fixes{named}; topics: {known}{remedy}", source=path)


def open_trajectory(path: str, chosen: Collection[str], tally: Diagnostics) -> tuple[BufferedReader, str] | None:
    """Open the poses of the chosen topic, or of the only moving one, as JSON lines; return the topic too.

    None for other topics, and if none was chosen and there are transforms too.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_recording(path, tally))
        wanted = {topic.strip("/") for topic in chosen}
        there = [each for each in reader.channels if not wanted or each.topic.strip("/") in wanted]
        found = [each for each in there if each.type in POSES]
        if len({each.topic for each in found}) != 1 or any(each.type in TYPES for each in there):
            return None
        pieces = filter(None, _pieces(reader, found))
        return BufferedReader(Pieces(pieces, opened.pop_all())), found[0].topic


def _pieces(reader: RecordingReader, channels: Sequence[Channel]) -> Iterator[bytes]:
    """Yield the messages, or the poses of lists, as lines, many together; an error follows the lines before it."""
    held: list[bytes] = []
    number = 1
    layouts: dict[Any, BinaryLayout | None] = {}
    try:
        for stretch in _stretches(reader.blocks(channels)):
            for (channel, _), run in groupby(stretch, lambda each: (each.channel, len(each.data))):
                for text, count in _lines(reader.types, channel, [each.data for each in run], layouts):
                    held.append(text)
                    number += count
            yield b"".join(held)
            held.clear()
    except Exception as error:
        yield b"".join(held)
        if isinstance(error, FormatError):
            raise
        what = f"message {number}: cannot be read ({type(error).__name__})"
        raise FormatError(what, source=reader.path) from None
    yield b"".join(held)


def _stretches(blocks: Iterator[Iterable[Recorded]]) -> Iterator[list[Recorded]]:
    """Yield messages in groups; those before an error too."""
    held: list[Recorded] = []
    try:
        for block in blocks:
            held += block
            if len(held) >= MANY:
                yield held
                held = []
    except Exception:
        yield held
        raise
    yield held


def _lines(
    types: MessageTypes, channel: Channel, messages: list[bytes], layouts: dict[Any, BinaryLayout | None]
) -> Iterator[tuple[bytes, int]]:
    """Yield the lines of messages of equal length, and their number: all at once if their layout is equal.

    layouts: those known, by channel and length; None if no two messages have the same layout
    """
    key = channel, len(messages[0])
    known = layouts.get(key)
    found = known and known.lines(messages)
    if found is None and (known or key not in layouts):
        from frametool.recordings.alike import layout_of

        layouts[key] = known = layout_of(types, channel.type, messages[0], _text(types, channel, messages[0]))
        found = known and known.lines(messages)
    if found is None:
        yield from ((_text(types, channel, each), 1) for each in messages)
    else:
        yield found, len(messages)


def _text(types: MessageTypes, channel: Channel, data: bytes) -> bytes:
    """Return the lines of one message."""
    return "".join(map(_line, posed_messages(types.read(channel, data), channel.type))).encode()


def _line(message: Any) -> str:
    """Return a message as a line of JSON; numbers that JSON does not have are written by name."""
    try:
        return f"{_encode(message)}\n"
    except ValueError:
        return f"{_encode(_named(message))}\n"


def _named(value: Any) -> Any:
    """Return a message, or a part of one, with numbers that are not finite replaced by their names."""
    if isinstance(value, float):
        return value if isfinite(value) else str(value)
    if isinstance(value, str | int):
        return value
    inner = _plain(value) if not isinstance(value, list) else value
    return [*map(_named, inner)] if isinstance(inner, list) else {name: _named(each) for name, each in inner.items()}


def _plain(value: Any) -> Any:
    """Return the fields of a message, or the numbers of an array."""
    inner = getattr(value, "__dict__", None)
    if inner is None:
        return value.tolist()
    kind: Any = type(value)
    for name in _marks(kind):
        inner.pop(name, None)
    return inner


@cache
def _marks(kind: Any) -> list[str]:
    """Return the fields of a type that are not data: the library's own, and constants."""
    return [name for name in kind.__dataclass_fields__ if not name[0].islower()]


_encode = JSONEncoder(default=_plain, allow_nan=False, ensure_ascii=False, check_circular=False).encode


TYPES = frozenset(("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"))


class RawTransform(NamedTuple):
    """A transform as recorded, unchecked; numbers: tx, ty, tz, x, y, z, w; stamp: seconds and nanoseconds."""

    parent: str
    child: str
    numbers: Rigid
    stamp: tuple[int, int]

    @classmethod
    def of(cls, message: Any, body: str = "") -> RawTransform:
        """Return the contents of a TransformStamped, or of a pose over time, of a frame or of a body."""
        if hasattr(message, "transform"):
            body, moved, turned = message.child_frame_id, message.transform.translation, message.transform.rotation
        else:
            pose = getattr(message.pose, "pose", message.pose)
            body = getattr(message, "child_frame_id", "") or body
            moved, turned = pose.position, pose.orientation
        numbers = moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w
        return cls(message.header.frame_id, body, numbers, (message.header.stamp.sec, message.header.stamp.nanosec))


def read(file: InputFile, options: Options) -> Iterator[Edge | EdgeColumns]:
    """Yield the transforms of a bag in the order of the recording.

    An edge's line is the number of its message among those with transforms.
    Raises FileProblem when the extra is missing; FormatError for a bag that is broken or has no transforms.
    """
    try:
        with opened_recording(file.path, options.tally) as reader:
            yield from recorded_edges(reader, _channels(reader, options), options)
    except FormatError as error:
        options.report(error)


def _channels(reader: RecordingReader, options: Options) -> list[Channel]:
    """Return the channels with transforms, and chosen ones with poses; raises FormatError if there are none."""
    reader.refuse_foreign(options.topics.chosen)
    chosen = options.topics.chooses
    found = [each for each in reader.channels if each.type in TYPES or (each.type in POSES and chosen(each.topic))]
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


def recorded_edges(
    reader: RecordingReader, channels: Sequence[Channel], options: Options
) -> Iterator[Edge | EdgeColumns]:
    """Yield the edges of the messages on some channels; raises FormatError if there are none, or one is broken."""
    number = 0
    layouts: dict[Any, list[tuple[BinaryLayout, list[RawTransform]]]] = {}
    for stretch in _stretches(reader.blocks(channels)):
        for is_static, part in groupby(stretch, lambda each: each.channel.is_static):
            messages = [*part]
            columns = None
            if len(messages) >= FEW and not is_static:
                columns = _columns(reader, messages, number, options, layouts)
            if columns is not None:
                yield columns
                number += len(messages)
                continue
            for each in messages:
                number += 1
                for said in _transforms(reader, each, number, options):
                    if edge := _edge(said, number, each.channel.topic, each.log_ns, reader.path, options):
                        yield edge
    if not number:
        raise FormatError(f"no messages on {', '.join(each.topic for each in channels)}", source=reader.path)


def _transforms(reader: RecordingReader, message: Recorded, number: int, options: Options) -> list[RawTransform]:
    """Return the transforms in a message, or the pose; raises FormatError for bytes that are none."""
    channel = message.channel
    try:
        found = reader.types.read(channel, message.data)
    except ValueInvalid as error:
        raise FormatError(f"message {number} on {channel.topic}: {error}", source=reader.path) from None
    parts = posed_messages(found, channel.type) if channel.type in POSES else found.transforms
    return [RawTransform.of(each, body_of(channel.topic, options.answers)) for each in parts]


def _columns(
    reader: RecordingReader, messages: Sequence[Recorded], number: int, options: Options,
    layouts: dict[Any, list[tuple[BinaryLayout, list[RawTransform]]]],
) -> EdgeColumns | None:  # fmt: skip
    """Return the edges of many messages at once; None where one of them has to be read by itself.

    number: of the message before them; layouts: those learned, by channel and length, with what a message says
    """
    groups: dict[Any, list[int]] = {}
    for at, each in enumerate(messages):
        groups.setdefault((each.channel, len(each.data)), []).append(at)
    rough, rows = len(options.tally.rough), list[Any]()
    for key, group in groups.items():
        left, known = np.array(group), layouts.setdefault(key, [])
        if options.topics.chosen and not options.topics.chooses(key[0].topic):
            return None
        for tried in range(MOST_LAYOUTS):
            if not left.size:
                break
            if tried == len(known):
                if (learned := _learned(reader, messages[left[0]], number + 1 + int(left[0]), options)) is None:
                    break
                known.append(learned)
            layout, transforms = known[tried]
            values, alike = layout.values([messages[at].data for at in left.tolist()])
            found = _edge_rows(values[alike], left[alike].tolist(), transforms, number, options)
            if found is None:
                break
            rows += found
            left = left[~alike]
        if left.size:
            del options.tally.rough[rough:]
            return None
    rows.sort(key=itemgetter(0))
    lines, parents, children, stamps_ns, components = zip(*rows, strict=True) if rows else [()] * 5
    sent = [messages[line - number - 1] for line in lines]
    topics, received = [each.channel.topic for each in sent], [each.log_ns for each in sent]
    options.topics.counts.update(Counter(topics) + Counter(options.topics.counts))
    options.tally.rough[rough:] = sorted(options.tally.rough[rough:])
    return EdgeColumns(parents, children, stamps_ns, components, lines, topics, received)


def _learned(
    reader: RecordingReader, message: Recorded, number: int, options: Options
) -> tuple[BinaryLayout, list[RawTransform]] | None:
    """Return how a message lies, and its transforms; None where it has to be read by itself."""
    from frametool.recordings.alike import layout_of

    try:
        transforms = _transforms(reader, message, number, options)
    except FormatError:  # raised again in its turn
        return None
    channel, bare = message.channel, options.tally.names.bare
    layout = layout_of(reader.types, channel.type, message.data)
    if layout is None or not all(
        each.parent and each.child and options.topics.agrees(channel.topic, bare(each.child)) for each in transforms
    ):
        return None
    numbers, count = layout.values([message.data])[0], len(transforms)
    if not count or numbers.shape[1] not in (9 * count, 10 * count):  # ROS 1 counts its headers
        return None
    said = [(*each.stamp, *each.numbers) for each in transforms]
    return (layout, transforms) if [*map(tuple, numbers.reshape(count, -1)[:, -9:].tolist())] == said else None


def _edge_rows(
    values: NDArray[np.float64], at: list[int], transforms: list[RawTransform], number: int, options: Options
) -> list[Any] | None:
    """Return line, frames, stamp and components of each transform of messages; None where one is refused."""
    rows, count = values.reshape(len(values) * len(transforms), -1)[:, -9:], len(transforms)
    stamps = rows[:, :2].astype(np.int64)
    if not np.isfinite(rows).all():
        return None
    if len(rows) and any(stamp_problem(int(a), int(b), STAMPS[0]) for a, b in (stamps.min(0), stamps.max(0))):
        return None
    bare = options.tally.names.bare
    ends = [(bare(each.parent), bare(each.child)) for each in transforms] * len(values)
    lines = [number + 1 + place for place in at for _ in range(count)]
    stamps_ns = (stamps[:, 0] * BILLION + stamps[:, 1]).tolist()
    found = []
    numbers = map(tuple, rows[:, 2:].tolist())
    for line, (parent, child), stamp_ns, each in zip(lines, ends, stamps_ns, numbers, strict=True):
        if (components := unit_components(each, line, options.tally, options.normalize)) is None:
            return None
        found.append((line, parent, child, stamp_ns, components))
    return found


def _edge(said: RawTransform, number: int, topic: str, received_ns: int, path: str, options: Options) -> Edge | None:
    """Return the edge in a message on a topic; None if the topic is not read.

    number: of the message among those with transforms
    Raises FormatError for an invalid one.
    """
    if not options.topics.takes(topic):
        return None
    tally = options.tally
    parent, child = tally.names.bare(said.parent), tally.names.bare(said.child)
    components = unit_components(said.numbers, number, tally, options.normalize)
    if components is None or not parent or not child:
        problem = ValueInvalid("its position is not finite", rule="not-finite")
        problem = quaternion.complaint(*said.numbers[3:], normalize=options.normalize) or problem
        problem = problem if parent and child else ValueInvalid("an empty frame name")
        edge = f"{shown(parent)} -> {shown(child)}"
        raise FormatError(f"message {number}: {edge}: {problem}", source=path, rule=problem.rule)
    if misfit := stamp_problem(*said.stamp, STAMPS[0]):
        raise FormatError(f"message {number}: {parent!r} -> {child!r}: {misfit}", source=path)
    if clash := options.topics.conflict(topic, child):
        options.report(FormatError(clash, source=path, rule="two-topics"))
    stamp_ns = None if topic.endswith("tf_static") else said.stamp[0] * BILLION + said.stamp[1]
    return Edge(parent, child, components, stamp_ns, number, received_ns, topic=topic)


