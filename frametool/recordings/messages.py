"""The contents of a recording's messages: transforms as edges, clouds as numpy records, everything else as JSON lines.

Points, poses, fixes, twists, wrenches and the like are a stream of JSON lines, one per message.  Transforms are read
from every topic that has any; those on a topic `tf_static` are static.  Points of clouds are not copied.
"""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from io import BufferedReader
from itertools import chain, groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FormatError, Unanswered, ValueInvalid, first_of, listing, shown
from frametool.frames.stamps import BILLION
from frametool.grammar.edges import Edge, EdgeColumns
from frametool.recordings.read import opened_recording
from frametool.recordings.types import POSE_ARRAY, Layouts, posed_messages, text_of
from frametool.ros.messages import PATH, POSES, STAMPS, body_of, on_topic, stamp_problem
from frametool.ros.plain_messages import edge_columns, unit_components
from frametool.text.lines import Pieces

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Diagnostics, Options
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


def cloud_topics(reader: RecordingReader, chosen: Collection[str]) -> list[str]:
    """Return the topics of clouds to read: those chosen, with or without a leading `/`, or the only one.

    Raises Unanswered if there are several, FormatError if there is none.
    """
    found = reader.on_topics({CLOUD}, chosen)
    _refuse_several(found, chosen, "clouds", reader.path)
    if not found:
        raise _nothing(reader, "clouds", chosen)
    return sorted({each.topic for each in found})


def _nothing(reader: RecordingReader, what: str, chosen: Collection[str] = ()) -> FormatError:
    """Return the error that nothing of a kind is on the chosen topics, or on any."""
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
    frame = message.header.frame_id
    return PointCloud(
        number, topic, stamp.sec * BILLION + stamp.nanosec, tally.names.bare(frame) if frame else "", names,
        _rows(message, kind, width, height), width, height,
    )  # fmt: skip


def _record_of(message: Any) -> tuple[tuple[str, ...], np.dtype[Any]]:
    """Return the columns of a point, and its type: each value of a field is a column."""
    order, step = ">" if message.is_bigendian else "<", int(message.point_step)
    columns: dict[str, tuple[str, int]] = {}
    for field in message.fields:
        code = DATATYPES.get(int(field.datatype))
        if code is None:
            raise ValueInvalid(f"field {shown(field.name)} has the datatype {field.datatype}, known are 1 to 8")
        count, offset, size = max(int(field.count), 1), int(field.offset), int(code[1])
        end = offset + count * size
        if end > step:
            raise ValueInvalid(f"field {shown(field.name)} ends at byte {end}, a point has {step} (point_step)")
        if len(columns) + count > _MOST_VALUES:
            raise ValueInvalid(f"a point has more than {_MOST_VALUES} values")
        names = [field.name] if count == 1 else [f"{field.name}_{place}" for place in range(count)]
        if twice := columns.keys() & {*names}:
            raise ValueInvalid(f"field {shown(min(twice))} appears twice")
        columns |= {name: (order + code, at) for name, at in zip(names, range(offset, end, size), strict=True)}
    if missing := [name for name in "xyz" if name not in columns]:
        raise ValueInvalid(f"no field {', '.join(missing)}; fields: {listing(columns) or 'none'}")
    formats, offsets = zip(*columns.values(), strict=True)
    places = [f"{place}" for place in range(len(columns))]
    return tuple(columns), np.dtype({"names": places, "formats": formats, "offsets": offsets, "itemsize": step})


def _rows(message: Any, kind: np.dtype[Any], width: int, height: int) -> NDArray[Any]:
    """Return the points; the rows of a grid may be padded."""
    data = np.asarray(message.data, np.uint8)
    step, row = kind.itemsize, int(message.row_step) or width * kind.itemsize
    if height > 1 and row < width * step:
        raise ValueInvalid(f"a row of {width} points of {step} bytes has {row} bytes (row_step)")
    needed = (height - 1) * row + width * step if width and height else 0
    if len(data) < needed:
        raise ValueInvalid(f"{width} x {height} points need {needed} bytes, the message has {len(data)}")
    if not needed:
        return np.empty(0, kind)
    grid: NDArray[Any] = np.ndarray((height, width), kind, data, 0, (max(row, width * step), step))
    return grid.reshape(-1)


FIX = "sensor_msgs/msg/NavSatFix"
STAMPED = ("Point", "Pose", "PoseWithCovariance", "Vector3", "Quaternion", "Twist", "TwistWithCovariance", "Wrench",
           "Accel", "AccelWithCovariance", "Transform")  # fmt: skip
RECORDS = frozenset((
    FIX, PATH, POSE_ARRAY, "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField", "nav_msgs/msg/Odometry",
    *(f"geometry_msgs/msg/{name}Stamped" for name in STAMPED),
))  # fmt: skip


def open_records(path: str, chosen: Collection[str], tally: Diagnostics) -> BufferedReader | None:
    """Open the messages of a bag as JSON lines: those of the chosen topics, with or without a leading `/`.

    None if the chosen topics have clouds.
    Raises FileProblem when the extra is missing, Unanswered if several topics have records and none is chosen,
    FormatError for a bag that is broken or has neither.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_recording(path, tally))
        reader.refuse_foreign(chosen)
        if channels := reader.on_topics(RECORDS, chosen):
            _refuse_several(channels, chosen, "records", path)
            return _opened_lines(reader, channels, opened)
        if reader.on_topics({CLOUD}, chosen):
            return None
        raise _nothing(reader, "points, poses or fixes", chosen)


def _refuse_several(channels: Iterable[Channel], chosen: Collection[str], what: str, path: str) -> None:
    """Raise Unanswered if channels have several topics and none was chosen."""
    topics = sorted({each.topic for each in channels})
    if len(topics) > 1 and not chosen:
        raise Unanswered(f"several topics hold {what}; give --topic {first_of(topics, 8, gap='|')}", source=path)


def open_trajectory(path: str, chosen: Collection[str], tally: Diagnostics) -> tuple[BufferedReader, str] | None:
    """Open the poses of the chosen topic, or of the only moving one, as JSON lines; return the topic too.

    None for other topics, and if none was chosen and there are transforms too.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_recording(path, tally))
        found = reader.on_topics(POSES, chosen)
        if len({each.topic for each in found}) != 1 or reader.on_topics(TYPES, chosen):
            return None
        return _opened_lines(reader, found, opened), found[0].topic


def _opened_lines(reader: RecordingReader, channels: Sequence[Channel], opened: ExitStack) -> BufferedReader:
    pieces = filter(None, _pieces(reader, channels))  # an empty one would be the end
    return BufferedReader(Pieces(pieces, opened.pop_all()))


def _pieces(reader: RecordingReader, channels: Sequence[Channel]) -> Iterator[bytes]:
    """Yield the messages, or the poses of lists, as lines, many together; an error follows the lines before it."""
    layouts, number = Layouts(reader.types), 1
    try:
        for stretch in reader.blocks(channels):
            known: dict[int, bytes] = {}
            for at, layout, values in layouts.groups(stretch):
                known |= zip(at, layout.lines(values).splitlines(keepends=True) if layout else (), strict=False)
            lines: list[bytes] = []
            try:
                for place, each in enumerate(stretch):
                    lines.append(known.get(place) or text_of(reader.types, each.channel, each.data))
            finally:
                number += len(lines)
                yield b"".join(lines)
    except FormatError:
        raise
    except Exception as error:  # noqa: BLE001 - of broken bytes the libraries raise anything
        what = f"message {number}: cannot be read ({type(error).__name__})"
        raise FormatError(what, source=reader.path) from None


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
        stamp = message.header.stamp.sec, message.header.stamp.nanosec
        return cls(message.header.frame_id, body, numbers_of(moved, turned), stamp)


def numbers_of(moved: Any, turned: Any) -> Rigid:
    """Return the components of two parts of a message, a position and a quaternion."""
    return moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w


def read(file: InputFile, options: Options) -> Iterator[Edge | EdgeColumns]:
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
    """Return the chosen channels with transforms or poses, or all with transforms; FormatError if the bag has none."""
    chosen = options.topics.chosen
    reader.refuse_foreign(chosen)
    options.topics.seen |= {each.topic for each in reader.channels}
    with_frames, posed = reader.on_topics(TYPES), reader.on_topics(POSES, chosen)
    for other in reader.channels:
        if other.topic.rpartition("/")[2] in ("tf", "tf_static") and other not in (*with_frames, *posed):
            what = f"{other.topic} holds {other.type} and no transforms; is it damaged?"
            raise FormatError(what, source=reader.path)
    if not with_frames and not (chosen and posed):
        raise _nothing(reader, "transforms")
    return reader.on_topics(TYPES | POSES, chosen) if chosen else with_frames


def recorded_edges(
    reader: RecordingReader, channels: Sequence[Channel], options: Options
) -> Iterator[Edge | EdgeColumns]:
    """Yield the edges of the messages on some channels; raises FormatError if there are none, or one is broken."""
    layouts, number = Layouts(reader.types), 0
    for stretch in reader.blocks(channels):
        for is_static, part in groupby(stretch, lambda each: each.channel.is_static):
            messages = [*part]
            found = zip(_contents(reader, layouts, messages, number, options), messages, strict=True)
            rows = [(each, at, sent) for at, (some, sent) in enumerate(found, number + 1) for each in some]
            columns = None if is_static or not rows else _columns(rows, options)
            yield from [columns] if columns else (_edge(*row, reader.path, options) for row in rows)
            number += len(messages)
    if not number:
        raise FormatError(f"no messages on {', '.join(each.topic for each in channels)}", source=reader.path)


def _contents(
    reader: RecordingReader, layouts: Layouts, messages: Sequence[Recorded], number: int, options: Options
) -> list[list[RawTransform]]:
    """Return the transforms or the pose in each message, of equal layout at once; `number` of them before."""
    found: list[list[RawTransform]] = [[] for _ in messages]
    for at, layout, values in layouts.groups(messages):
        first = messages[at[0]]
        known = _transforms(reader, first._replace(data=layout.sample), 0, options) if layout else []
        if layout and known and values.shape[1] in (9 * len(known), 10 * len(known)):  # ROS 1 counts its headers
            numbers = np.vstack([layout.values([layout.sample])[0], values])
            own, *rows = numbers.reshape(len(numbers), len(known), -1)[:, :, -9:].tolist()
            if own == [[*each.stamp, *each.numbers] for each in known]:
                for place, row in zip(at, rows, strict=True):
                    found[place] = [
                        RawTransform(each.parent, each.child, tuple(numbers), (int(second), int(part)))
                        for each, (second, part, *numbers) in zip(known, row, strict=True)
                    ]
                continue
        for place in at:
            found[place] = _transforms(reader, messages[place], number + place + 1, options)
    return found


def _transforms(reader: RecordingReader, message: Recorded, number: int, options: Options) -> list[RawTransform]:
    """Return the transforms in a message, or the pose; raises FormatError for invalid bytes."""
    channel = message.channel
    try:
        found = reader.types.read(channel, message.data)
    except ValueInvalid as error:
        raise FormatError(f"message {number} on {channel.topic}: {error}", source=reader.path) from None
    parts = posed_messages(found, channel.type) if channel.type in POSES else found.transforms
    return [RawTransform.of(each, body_of(channel.topic, options.answers)) for each in parts]


def _columns(rows: Sequence[tuple[RawTransform, int, Recorded]], options: Options) -> EdgeColumns | None:
    """Return the edges of many messages at once; None, and no warnings about numbers, if one of them is refused."""
    transforms, lines, sent = zip(*rows, strict=True)
    *names, numbers, stamps = zip(*transforms, strict=True)
    bare = {name: options.tally.names.bare(name) for name in dict.fromkeys(chain(*names))}
    parents, children = ([*map(bare.__getitem__, each)] for each in names)
    topics = [each.channel.topic for each in sent]
    if not all(options.topics.agrees(*each) for each in dict.fromkeys(zip(topics, children, strict=True))):
        return None
    found = edge_columns(
        (parents, children), zip(*stamps, strict=True), numbers, lines, options.tally, normalize=options.normalize,
        topics=topics, received_ns=[each.log_ns for each in sent],
    )  # fmt: skip
    if found:
        options.topics.counts.update(Counter(topics) + Counter(options.topics.counts))
    return found


def _edge(said: RawTransform, number: int, message: Recorded, path: str, options: Options) -> Edge:
    """Return the edge in a message; raises FormatError for an invalid one.

    number: of the message among those with transforms
    """
    tally, topic = options.tally, message.channel.topic
    options.topics.takes(topic)
    parent, child = tally.names.bare(said.parent), tally.names.bare(said.child)
    problem = stamp_problem(*said.stamp, STAMPS[0]) if parent and child else ValueInvalid("an empty frame name")
    try:
        components = unit_components(said.numbers, number, tally, options.normalize)
    except ValueInvalid as error:
        problem = problem or error
    if problem:
        what = f"message {number}: {shown(parent)} -> {shown(child)}: {problem}"
        raise FormatError(what, source=path, rule=problem.rule)
    stamp_ns = said.stamp[0] * BILLION + said.stamp[1]
    return on_topic(Edge(parent, child, components, stamp_ns, number, message.log_ns, topic=topic), path, options)
