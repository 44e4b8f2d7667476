"""Messages of a bag as a stream of JSON lines, one a message: what reads such records reads bags so.

Points, poses, fixes, twists, wrenches and the like; transforms make a tree and clouds are files of their own.
"""

from __future__ import annotations

from contextlib import ExitStack
from functools import cache
from io import BufferedReader
from json import JSONEncoder
from math import isfinite
from typing import TYPE_CHECKING, Any

from frametool.errors import FormatError, Unanswered, first_of, listing
from frametool.recordings.read import opened_recording
from frametool.recordings.transforms import TYPES
from frametool.ros.messages import PATH
from frametool.ros.pose_lists import POSE_ARRAY, posed_messages
from frametool.text.lines import Pieces

CLOUD = "sensor_msgs/msg/PointCloud2"

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from frametool.grammar.edges import Tally
    from frametool.recordings.read import Channel, RecordingReader

MANY = 400  # lines
FIX = "sensor_msgs/msg/NavSatFix"
STAMPED = ("Point", "Pose", "PoseWithCovariance", "Vector3", "Quaternion", "Twist", "TwistWithCovariance", "Wrench",
           "Accel", "AccelWithCovariance", "Transform")  # fmt: skip
RECORDS = frozenset((
    FIX, PATH, POSE_ARRAY, "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField", "nav_msgs/msg/Odometry",
    *(f"geometry_msgs/msg/{name}Stamped" for name in STAMPED),
))  # fmt: skip


def record_channels(reader: RecordingReader, chosen: Collection[str]) -> list[Channel]:
    """Return the channels whose messages are wanted: those chosen, or those of the only topic that holds records.

    chosen: topics with or without a leading `/`
    Raises Unanswered where several hold records and none is chosen.
    """
    there = [each for each in reader.channels if each.type in RECORDS]
    wanted = {topic.strip("/") for topic in chosen}
    topics = sorted({each.topic for each in there})
    if len(topics) > 1 and not wanted:
        named = first_of(topics, 8, gap="|")
        raise Unanswered(f"several topics hold records; give --topic {named}", source=reader.path)
    return [each for each in there if not wanted or each.topic.strip("/") in wanted]


def open_records(path: str, chosen: Collection[str], tally: Tally) -> BufferedReader | None:
    """Open the messages of a bag as JSON lines; None where the topics that are wanted hold clouds.

    Raises FileProblem when the extra is missing, FormatError for a bag that is broken or holds neither.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_recording(path, tally))
        reader.refuse_foreign(chosen)
        if channels := record_channels(reader, chosen):
            return BufferedReader(Pieces(_pieces(reader, channels), opened.pop_all()))
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


def _pieces(reader: RecordingReader, channels: Sequence[Channel]) -> Iterator[bytes]:
    """Yield each message, or each pose of a list, as a line, many together; an error comes behind the lines before."""
    held: list[str] = []
    number = 1
    try:
        for channel, _, data, *_ in reader.messages(channels):
            held += map(_line, posed_messages(reader.types.read(channel, data), channel.type))
            number += 1
            if len(held) >= MANY:
                yield "".join(held).encode()
                held.clear()
    except Exception as error:
        yield "".join(held).encode()
        if isinstance(error, FormatError):
            raise
        what = f"message {number}: cannot be read ({type(error).__name__})"
        raise FormatError(what, source=reader.path) from None
    yield "".join(held).encode()


def _line(message: Any) -> str:
    """Return a message as a line of JSON; a number that JSON has not by its name."""
    try:
        return f"{_encode(message)}\n"
    except ValueError:
        return f"{_encode(_named(message))}\n"


def _named(value: Any) -> Any:
    """Return a message, or a part of one, with the names of numbers that are not finite."""
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
    """Return the fields of a type that are no data: the library's own, and constants."""
    return [name for name in kind.__dataclass_fields__ if not name[0].islower()]


_encode = JSONEncoder(default=_plain, allow_nan=False, ensure_ascii=False, check_circular=False).encode
