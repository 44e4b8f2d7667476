"""The contents of a recording's messages: transforms as edges, clouds as numpy records, other types as JSON lines.

Points, poses, fixes, twists, wrenches and the like are a stream of JSON lines, one per message.  Transforms are read
from every topic that has any; those on a topic `tf_static` are static.  Points of clouds are not copied.
"""

from __future__ import annotations

import re
from collections import Counter
from contextlib import ExitStack
from dataclasses import replace
from io import BufferedReader
from itertools import chain, groupby
from json import dumps
from math import isfinite
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FormatError, Unanswered, ValueInvalid, first_of, listing, shown
from frametool.frames.stamps import BILLION
from frametool.recordings.read import Channel, MessageTypes, Recorded, RecordingReader, opened_recording
from frametool.ros.message_stream import edge_columns
from frametool.ros.messages import PATH, POSES, STAMPS, body_of, stamp_problem
from frametool.text.lines import Pieces
from frametool.text.spans import MARGIN, Spans, framed, join
from frametool.text.write import float_spans

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from numpy.typing import NDArray

    from frametool.documents.source import InputFile
    from frametool.geometry import Rigid
    from frametool.grammar.edges import Answers, Diagnostics, EdgeColumns, Options


CLOUD, POSE_ARRAY = "sensor_msgs/msg/PointCloud2", "geometry_msgs/msg/PoseArray"
DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
MOST_VALUES = 1 << 16  # values of a field


class PointCloud(NamedTuple):
    """The points of one message.

    number: of the message among those of its topics, from 1
    frame: that of its header, "" for no frame
    names: of the columns; rows: (n,) records with the fields 0, 1, .. in their order
    width, height: of the grid; n is their product
    """

    number: int
    topic: str
    stamp_ns: int
    frame: str
    names: tuple[str, ...]
    rows: NDArray[Any]
    width: int
    height: int


def cloud_topics(reader: RecordingReader, chosen: Collection[str]) -> list[str]:
    """Return the topics of clouds to read: those chosen, with or without a leading `/`, or the only one.

    Raises Unanswered if there are several, FormatError if there is none.
    """
    return sorted({each.topic for each in _of_one_topic(reader, {CLOUD}, chosen, "clouds")})


def _of_one_topic(
    reader: RecordingReader, types: Collection[str], chosen: Collection[str], what: str
) -> list[Channel]:  # fmt: skip
    """Return the channels of some types on the chosen topics, or on the only topic with them."""
    found = reader.on_topics(types, chosen)
    topics = sorted({each.topic for each in found})
    if len(topics) > 1 and not chosen:
        raise Unanswered(f"several topics hold {what}; give --topic {first_of(topics, 8, gap='|')}", source=reader.path)
    if not found:
        raise _nothing(reader, what, chosen)
    return found


def _nothing(reader: RecordingReader, what: str, chosen: Collection[str] = ()) -> FormatError:
    """Return the error that no messages of a kind are on the chosen topics, or on any topic."""
    named = f" on {listing(chosen)}" if chosen else ""
    known = listing({f"{each.topic} ({each.type})" for each in reader.all}, near=next(iter(chosen), ""))
    remedy = f"; its frames: frametool lookup {reader.path} TARGET SOURCE" if reader.on_topics(TYPES) else ""
    if poses := sorted(each.topic for each in reader.on_topics(POSES)):
        remedy = remedy or f"; --topic {poses[0]} reads its poses"
    return FormatError(f"no {what}{named}; topics: {known or 'none'}{remedy}", source=reader.path)


def read_clouds(reader: RecordingReader, topics: list[str], tally: Diagnostics) -> Iterator[PointCloud | FormatError]:
    """Yield the clouds of some topics in the order of the recording; an invalid one is replaced by its error."""
    for number, (channel, _, data, *_) in enumerate(reader.messages(reader.on_topics({CLOUD}, topics)), 1):
        try:
            yield _cloud(reader.types.read(channel, data), number, channel.topic, tally)
        except ValueInvalid as error:
            yield FormatError(str(error), source=reader.path, line=number)


def _cloud(message: Any, number: int, topic: str, tally: Diagnostics) -> PointCloud:
    """Parse a message; raises ValueInvalid if it contradicts itself."""
    stamp = message.header.stamp
    if problem := stamp_problem(stamp.sec, stamp.nanosec, STAMPS[0]):
        raise problem
    names, kind = _record_of(message)
    width, height = int(message.width), int(message.height)
    data, least = np.asarray(message.data, np.uint8), width * kind.itemsize
    row = int(message.row_step) or least  # rows of a grid may be padded
    needed = (height - 1) * row + least if width and height else 0
    if needed > len(data) or (height > 1 and row < least):
        points = f"{width} x {height} points of {kind.itemsize} bytes"
        raise ValueInvalid(f"{points} in rows of {row} (row_step) do not fit: the message has {len(data)} bytes")
    rows: NDArray[Any] = np.empty(0, kind)
    if needed:
        rows = np.ndarray((height, width), kind, data, 0, (max(row, least), kind.itemsize)).reshape(-1)
    frame = message.header.frame_id
    return PointCloud(
        number, topic, stamp.sec * BILLION + stamp.nanosec, tally.names.bare(frame) if frame else "", names, rows,
        width, height,
    )  # fmt: skip


def _record_of(message: Any) -> tuple[tuple[str, ...], np.dtype[Any]]:
    """Return the names of a point's columns, and the type of a point; each value of a field is a column."""
    order, step = ">" if message.is_bigendian else "<", int(message.point_step)
    columns: dict[str, tuple[str, int]] = {}
    for field in message.fields:
        code = DATATYPES.get(int(field.datatype))
        if code is None:
            raise ValueInvalid(f"field {shown(field.name)} has the datatype {field.datatype}, known are 1 to 8")
        count, offset, size = max(int(field.count), 1), int(field.offset), int(code[1])
        end = offset + count * size
        if end > step or count > MOST_VALUES:
            raise ValueInvalid(f"field {shown(field.name)} ends at byte {end}, a point has {step} (point_step)")
        names = [field.name] if count == 1 else [f"{field.name}_{place}" for place in range(count)]
        if twice := columns.keys() & {*names}:
            raise ValueInvalid(f"field {shown(min(twice))} appears twice")
        columns |= {name: (order + code, at) for name, at in zip(names, range(offset, end, size), strict=True)}
    if missing := [name for name in "xyz" if name not in columns]:
        raise ValueInvalid(f"no field {', '.join(missing)}; fields: {listing(columns) or 'none'}")
    formats, offsets = zip(*columns.values(), strict=True)
    places = [f"{place}" for place in range(len(columns))]
    return tuple(columns), np.dtype({"names": places, "formats": formats, "offsets": offsets, "itemsize": step})


FIX, POINT = "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/PointStamped"
STAMPED = ("Point", "Pose", "PoseWithCovariance", "Vector3", "Quaternion", "Twist", "TwistWithCovariance", "Wrench",
           "Accel", "AccelWithCovariance", "Transform")  # fmt: skip
RECORDS = frozenset((
    FIX, PATH, POSE_ARRAY, "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField", "nav_msgs/msg/Odometry",
    *(f"geometry_msgs/msg/{name}Stamped" for name in STAMPED),
))  # fmt: skip


def open_records(path: str, chosen: Collection[str], tally: Diagnostics) -> BufferedReader | None:
    """Open the messages of a bag as JSON lines: those of the chosen topics, with or without a leading `/`.

    Returns None if the chosen topics have only clouds.
    Raises FileProblem when the extra is missing, Unanswered if several topics have records and none is chosen,
    FormatError for a bag that is broken or has neither.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_recording(path, tally))
        if reader.on_topics({CLOUD}, chosen) and not reader.on_topics(RECORDS, chosen):
            return None
        found = _of_one_topic(reader, RECORDS, chosen, "points, poses or fixes")
        return BufferedReader(Pieces(_pieces(reader, found), opened.pop_all()))


def open_trajectory(path: str, chosen: Collection[str], tally: Diagnostics) -> tuple[BufferedReader, str] | None:
    """Open the poses of the chosen topic, or of the only topic with poses, as JSON lines; return the topic too.

    Without poses, positions are taken alike.
    None unless there is exactly one such topic, and if the (chosen) topics have transforms too.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_recording(path, tally))
        found = reader.on_topics(POSES, chosen) or reader.on_topics({FIX, POINT}, chosen)
        if len({each.topic for each in found}) != 1 or reader.on_topics(TYPES, chosen):
            return None
        return BufferedReader(Pieces(_pieces(reader, found), opened.pop_all())), found[0].topic


def _pieces(reader: RecordingReader, channels: Sequence[Channel]) -> Iterator[bytes]:
    """Yield the messages as lines of JSON, a list of poses as a line for each, in blocks of lines.

    Raises FormatError after the lines before a broken message.
    """
    number = 1
    try:
        for stretch in reader.blocks(channels):
            known: dict[int, bytes] = {}
            for at, layout, values in alike(reader.types, stretch):
                known |= zip(at, layout.lines(values).splitlines(keepends=True), strict=True)
            lines: list[bytes] = []
            try:
                for place, each in enumerate(stretch):
                    lines.append(known.get(place) or text_of(reader.types, each.channel, each.data))
            finally:
                number += len(lines)
                if any(lines):  # an empty piece would end the stream
                    yield b"".join(lines)
    except FormatError:
        raise
    except Exception as error:  # noqa: BLE001 - of broken bytes the libraries raise anything
        what = f"message {number}: cannot be read ({type(error).__name__})"
        raise FormatError(what, source=reader.path) from None


def posed_messages(message: Any, kind: str) -> list[Any]:
    """Return the poses of a PoseArray or a Path, each with a header; else a list with the message itself.

    A pose of a Path has its own header; a missing frame or stamp is that of the path.  A stamp of 0 with a frame is
    a valid time if other poses have stamps.
    """
    if kind == POSE_ARRAY:
        return [SimpleNamespace(header=message.header, pose=pose) for pose in message.poses]
    if kind != PATH:
        return [message]
    outer, found = message.header, []
    has_stamps = any(each.header.stamp.sec or each.header.stamp.nanosec for each in message.poses)
    for each in message.poses:
        own = each.header
        says_when = own.stamp.sec or own.stamp.nanosec or (has_stamps and own.frame_id)
        header = replace(own, stamp=own.stamp if says_when else outer.stamp, frame_id=own.frame_id or outer.frame_id)
        found.append(SimpleNamespace(header=header, pose=each.pose))
    return found


def text_of(types: MessageTypes, channel: Channel, data: bytes) -> bytes:
    """Return a message as a line of JSON, a list of poses as a line for each."""
    found = posed_messages(types.read(channel, data), channel.type)
    return "".join(f"{dumps(_plain(each), ensure_ascii=False)}\n" for each in found).encode()


def _plain(value: Any) -> Any:
    """Convert a message, or a part of one, to plain values; numbers that JSON lacks are written by name."""
    if isinstance(value, float):
        return value if isfinite(value) else str(value)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list):
        return [*map(_plain, value)]
    if isinstance(value, str | int):
        return value
    return {name: _plain(each) for name, each in vars(value).items() if name[0].islower()}  # others are constants


CODES = {"float64": "<f8", "float32": "<f4", "uint32": "<u4", "int32": "<i4", "uint16": "<u2", "int16": "<i2",
         "uint8": "<u1", "int8": "<i1"}  # fmt: skip
MOST_NUMBERS = 200  # in a message that is read fast
MOST_LAYOUTS = 16  # layouts tried for messages of one channel and length
CDR_LE = b"\0\1"
HOLE = b"\0"  # a placeholder for a number; no JSON text contains it
STRING_OR_NUMBER = re.compile(rb'("(?:[^"\\]|\\.)*")|-?\d[-+.\de]*')
POINT_ZERO = 2  # characters `.0` to remove from an integer written as a float


class BinaryLayout(NamedTuple):
    """The layout of messages with equal bytes apart from their numbers, for reading many at once.

    numbers: the positions and types of the numbers; shared: the parts whose bytes must be those of the sample
    texts: the JSON text around the numbers; sample: the message that the layout was learned from
    """

    numbers: np.dtype[Any]
    shared: Sequence[slice]
    texts: Sequence[bytes]
    sample: bytes

    def values(self, messages: Sequence[bytes]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the numbers of messages of equal length, (n, k), and the mask of messages that have this layout.

        Messages with numbers that are not finite are not in the mask.
        """
        text = b"".join(messages)
        rows = np.frombuffer(text, np.uint8).reshape(len(messages), -1)
        columns = np.frombuffer(text, self.numbers)
        numbers = np.stack([columns[name].astype(np.float64) for name in self.numbers.names or ()], axis=-1)
        same = [rows[:, part] == np.frombuffer(self.sample[part], np.uint8) for part in self.shared]
        alike: Any = np.hstack([np.isfinite(numbers), *same]).all(axis=1)
        return numbers, alike

    def lines(self, numbers: NDArray[np.float64]) -> bytes:
        """Return the JSON lines of messages with these numbers, (n, k)."""
        names = self.numbers.names or ()
        written = float_spans(numbers, b" " * len(names))
        ends = written.ends - np.array([1 + POINT_ZERO * (self.numbers[name].kind != "f") for name in names])
        parts = [_repeated(self.texts[0], len(numbers))]
        for at, each in enumerate(self.texts[1:]):
            parts += [Spans(written.data, written.starts[:, at], ends[:, at]), _repeated(each, len(numbers))]
        return join(parts)


def _repeated(text: bytes, count: int) -> Spans:
    """Return one text for each of `count` rows, as spans."""
    starts = np.arange(0, len(text), MARGIN)
    ends = np.minimum(starts + MARGIN, len(text))
    return Spans(framed(text), np.tile(starts + MARGIN, (count, 1)), np.tile(ends + MARGIN, (count, 1)))


def numbers_in(types: MessageTypes, kind: str, data: bytes) -> tuple[list[tuple[int, str]], list[slice]]:
    """Return the positions and types of the numbers in a message, and the parts that other messages must share.

    Raises ValueError or KeyError if one of its parts has no fixed position.
    """
    from rosbags.interfaces import Nodetype

    begin = at = 0 if types.ros1 else 4
    left: list[Any] = [(Nodetype.NAME, kind)]
    numbers, shared = list[tuple[int, str]](), [slice(begin)]
    while left:
        node, what = left.pop()
        if node == Nodetype.NAME:
            left += (each for _, each in reversed(types.store.fielddefs[what][1]))
            continue
        if node == Nodetype.ARRAY:
            left += [what[0]] * min(what[1], MOST_NUMBERS)
            continue
        has_count = node == Nodetype.SEQUENCE or what[0] == "string"
        code = "<u4" if has_count else CODES[what[0]]
        size = int(code[-1])
        place = at if types.ros1 else at + (begin - at) % size
        at = place + size
        if not has_count:
            numbers.append((place, code))
        elif node == Nodetype.SEQUENCE:
            left += [what[0]] * min(int.from_bytes(data[place:at], "little"), MOST_NUMBERS)
        else:
            at += int.from_bytes(data[place:at], "little")
        shared += [slice(place, at)] * has_count
        if len(numbers) > MOST_NUMBERS:
            raise ValueError
    if at != len(data) or not numbers or not (types.ros1 or data[:2] == CDR_LE):
        raise ValueError
    return numbers, shared


def layout_of(types: MessageTypes, channel: Channel, data: bytes) -> BinaryLayout | None:
    """Return the layout of messages like this one; None if it would give another line than the full reader."""
    try:
        line = text_of(types, channel, data)
        found, shared = numbers_in(types, channel.type, data)
    except (ValueError, KeyError):
        return None
    places, codes = zip(*found, strict=True)
    names = [f"f{at}" for at in range(len(codes))]
    numbers = np.dtype({"names": names, "formats": codes, "offsets": places, "itemsize": len(data)})
    texts = STRING_OR_NUMBER.sub(lambda found: found[1] or HOLE, line).split(HOLE)
    if len(texts) != len(codes) + 1:
        return None
    made = BinaryLayout(numbers, shared, texts, data)
    values, alike = made.values([data])
    return made if alike.all() and made.lines(values) == line else None


def alike(
    types: MessageTypes, messages: Sequence[Recorded]
) -> Iterator[tuple[list[int], BinaryLayout, NDArray[np.float64]]]:
    """Yield the indices of messages of one layout, the layout, and their numbers (n, k); skip messages without one."""
    groups: dict[Any, list[int]] = {}
    for at, each in enumerate(messages):
        groups.setdefault((each.channel, len(each.data)), []).append(at)
    for key, group in groups.items():
        left, known = np.array(group), types.layouts.setdefault(key, [])
        for tried in range(MOST_LAYOUTS):
            if tried == len(known):
                known.append(layout_of(types, key[0], messages[left[0]].data))
            if (layout := known[tried]) is None:
                break
            values, fit = layout.values([messages[at].data for at in left.tolist()])
            if fit.any():
                yield left[fit].tolist(), layout, values[fit]
            left = left[~fit]
            if not left.size:
                break


TYPES = frozenset(("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"))


class RawTransform(NamedTuple):
    """A transform as recorded, unchecked; numbers: tx, ty, tz, x, y, z, w; stamp: seconds and nanoseconds."""

    parent: str
    child: str
    numbers: Rigid
    stamp: tuple[int, int]


def numbers_of(moved: Any, turned: Any) -> Rigid:
    """Return the components tx, ty, tz, x, y, z, w of a position and a quaternion in a message."""
    return moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w


def read(file: InputFile, options: Options) -> Iterator[EdgeColumns]:
    """Yield the transforms of a bag in the order of the recording.

    An edge's line is the number of its message among those with transforms.
    Raises FileProblem when the extra is missing; FormatError for a bag that is broken or has no transforms.
    """
    try:
        with opened_recording(file.path, options.tally) as reader:
            if found := _channels(reader, options):
                yield from recorded_edges(reader, found, options)
    except FormatError as error:
        options.report(error)


def _channels(reader: RecordingReader, options: Options) -> list[Channel]:
    """Return the chosen channels with transforms or poses, by default all with transforms.

    Raises FormatError if there are no such channels.
    """
    chosen = options.topics.chosen
    options.topics.seen |= {each.topic for each in reader.channels}
    with_frames, posed = reader.on_topics(TYPES), reader.on_topics(POSES, chosen)
    for other in reader.channels:
        if other.topic.rpartition("/")[2] in ("tf", "tf_static") and other not in (*with_frames, *posed):
            what = f"{other.topic} holds {other.type} and no transforms; is it damaged?"
            raise FormatError(what, source=reader.path)
    if not with_frames and not (chosen and posed):
        raise _nothing(reader, "transforms")
    return reader.on_topics(TYPES | POSES, chosen) if chosen else with_frames


def recorded_edges(reader: RecordingReader, channels: Sequence[Channel], options: Options) -> Iterator[EdgeColumns]:
    """Yield the edges of the messages on some channels; raises FormatError if one is broken."""
    for rows in raw_transforms(reader, channels, options.answers):
        for is_static, part in groupby(rows, lambda row: row[2].channel.is_static):
            for columns in _columns([*part], reader.path, options):
                yield columns._replace(stamps_ns=[None] * len(columns.lines)) if is_static else columns


def raw_transforms(
    reader: RecordingReader, channels: Sequence[Channel], answers: Answers
) -> Iterator[list[tuple[RawTransform, int, Recorded]]]:
    """Yield lists of the transforms and poses on some channels, each with its message and the message's number.

    Messages are numbered from 1; those of equal layout are read at once.
    """
    number = 0
    for messages in reader.blocks(channels):
        found: dict[int, list[RawTransform]] = {}
        for at, layout, values in alike(reader.types, messages):
            known = _transforms(reader, messages[at[0]]._replace(data=layout.sample), 0, answers)
            if known and values.shape[1] in (9 * len(known), 10 * len(known)):  # headers of ROS 1 have a counter
                numbers = np.vstack([layout.values([layout.sample])[0], values])
                own, *rows = numbers.reshape(len(numbers), len(known), -1)[:, :, -9:].tolist()
                if own == [[*each.stamp, *each.numbers] for each in known]:
                    for place, row in zip(at, rows, strict=True):
                        found[place] = [
                            RawTransform(each.parent, each.child, tuple(numbers), (int(second), int(part)))
                            for each, (second, part, *numbers) in zip(known, row, strict=True)
                        ]
        yield [
            (each, number + at, sent)
            for at, sent in enumerate(messages, 1)
            for each in found.get(at - 1) or _transforms(reader, sent, number + at, answers)
        ]
        number += len(messages)


def _transforms(reader: RecordingReader, message: Recorded, number: int, answers: Answers) -> list[RawTransform]:
    """Return the transforms, or poses, in a message; raises FormatError for invalid bytes."""
    channel, body, found = message.channel, body_of(message.channel.topic, answers), list[RawTransform]()
    try:
        contents = reader.types.read(channel, message.data)
    except ValueInvalid as error:
        raise FormatError(f"message {number} on {channel.topic}: {error}", source=reader.path) from None
    for each in posed_messages(contents, channel.type) if channel.type in POSES else contents.transforms:
        if channel.type in POSES:
            pose, child = getattr(each.pose, "pose", each.pose), getattr(each, "child_frame_id", "") or body
            numbers = numbers_of(pose.position, pose.orientation)
        else:
            child, numbers = each.child_frame_id, numbers_of(each.transform.translation, each.transform.rotation)
        stamp = each.header.stamp.sec, each.header.stamp.nanosec
        found.append(RawTransform(each.header.frame_id, child, numbers, stamp))
    return found


def _columns(
    rows: Sequence[tuple[RawTransform, int, Recorded]], path: str, options: Options
) -> Iterator[EdgeColumns]:  # fmt: skip
    """Yield the edges of many messages at once; raises FormatError for the first invalid one, after those before it.

    rows: transforms, each with the number of its message, and the message
    """
    transforms, lines, sent = zip(*rows, strict=True)
    *names, numbers, stamps = zip(*transforms, strict=True)
    bare = {name: options.tally.names.bare(name) for name in dict.fromkeys(chain(*names))}
    parents, children = ([*map(bare.__getitem__, each)] for each in names)
    topics = [each.channel.topic for each in sent]
    try:
        found = edge_columns(
            (parents, children), zip(*stamps, strict=True), numbers, lines, options.tally, normalize=options.normalize,
            topics=topics, received_ns=[each.log_ns for each in sent],
        )  # fmt: skip
    except ValueInvalid as error:
        if half := len(rows) // 2:
            yield from _columns(rows[:half], path, options)
            yield from _columns(rows[half:], path, options)
            return
        options.topics.takes(topics[0])
        what = f"message {lines[0]}: {shown(parents[0])} -> {shown(children[0])}: {error}"
        raise FormatError(what, source=path, rule=error.rule) from None
    options.topics.counts.update(Counter(topics) + Counter(options.topics.counts))
    pairs = [*zip(topics, children, strict=True)]
    for pair in dict.fromkeys(pairs):
        if problem := options.topics.conflict(*pair):
            line = lines[pairs.index(pair)]
            options.report(FormatError(problem, source=path, line=line, column=1, rule="two-topics"))
    yield found
