"""Messages of a bag as a stream of JSON lines, one a message: what reads such records reads bags so.

Points, poses, fixes, twists, wrenches and the like; transforms make a tree and clouds are files of their own.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import fields, is_dataclass
from functools import lru_cache
from io import BufferedReader, RawIOBase
from math import isfinite
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from frametool.documents.json import dump
from frametool.errors import FormatError, Unanswered, first_of, listing
from frametool.recordings.read import opened_recording
from frametool.recordings.transforms import TYPES
from frametool.ros.messages import PATH
from frametool.ros.pose_lists import POSE_ARRAY, posed_messages

CLOUD = "sensor_msgs/msg/PointCloud2"

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from frametool.grammar.edges import Tally
    from frametool.recordings.read import Channel, Message, RecordingReader

PIECE = 1 << 16  # bytes
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
            return BufferedReader(_Lines(_pieces(_lines(reader, channels)), opened.pop_all()))
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


def _lines(reader: RecordingReader, channels: Sequence[Channel]) -> Iterator[str]:
    """Yield each message, or each pose of a list, as a line."""
    number = 0
    messages = reader.messages(channels)
    while (found := _next(reader, messages, number + 1)) is not None:
        number += 1
        for message in posed_messages(*found):
            yield _text(message) + "\n"


def _pieces(lines: Iterator[str]) -> Iterator[bytes]:
    """Join lines to pieces, which are read faster than one line each; an error comes behind the lines before it."""
    held: list[str] = []
    size = 0
    try:
        for line in lines:
            held.append(line)
            size += len(line)
            if size >= PIECE:
                yield "".join(held).encode()
                held, size = [], 0
    except FormatError:
        yield "".join(held).encode()
        raise
    yield "".join(held).encode()


def _next(reader: RecordingReader, messages: Iterator[Message], number: int) -> tuple[Any, str] | None:
    """Return the next message and its type; None behind the last."""
    try:
        if (found := next(messages, None)) is None:
            return None
        return reader.types.read(found.channel, found.data), found.channel.type
    except FormatError:
        raise
    except Exception as error:  # noqa: BLE001 - a broken bag makes the libraries raise anything
        raise FormatError(f"message {number}: cannot be read ({type(error).__name__})", source=reader.path) from None


def _text(value: Any) -> str:
    """Return a message, or a part of one, as JSON."""
    kind = type(value)
    write = _WRITERS.get(kind) or _WRITERS.setdefault(kind, _writer(value))
    return write(value)


def _writer(value: Any) -> Callable[[Any], str]:
    """Return what writes values of the type of one: messages as one template of all that is in them, for speed."""
    if is_dataclass(value):
        template, names = _template(value)
        if len(names) == 1:
            return lambda value: template.format(_text(attrgetter(names[0])(value)))
        members, write = attrgetter(*names), template.format
        return lambda value: write(*map(_text, members(value)))
    if hasattr(value, "tolist"):
        return lambda value: _text(value.tolist())
    return dump


def _template(value: Any) -> tuple[str, list[str]]:
    """Return how a message is written, and where what is put into that stands: below it, where types are fixed."""
    parts, names = [], []
    for name in (each.name for each in fields(value) if _is_data(each.name)):
        inner = getattr(value, name)
        below, more = _template(inner) if is_dataclass(inner) and hasattr(value, "__msgtype__") else ("{}", [])
        parts.append(f'"{name}": {below}')
        names += [f"{name}.{each}" for each in more] if below != "{}" else [name]
    return "{{" + ", ".join(parts) + "}}", names


def _float(value: float) -> str:
    """Return a number, or its name where JSON has none for it."""
    return repr(value) if isfinite(value) else f'"{value}"'


_WRITERS: dict[type, Callable[[Any], str]] = {
    float: _float,
    int: repr,
    str: lru_cache(1024)(dump),
    list: lambda values: "[" + ", ".join(map(_text, values)) + "]",
}


def _is_data(name: str) -> bool:
    """Tell a field from the library's own marks and from the constants of a message's type."""
    return not name.isupper() and not name.startswith("__")


class _Lines(RawIOBase):
    """Bytes that an iterator yields, as a stream."""

    def __init__(self, lines: Iterator[bytes], opened: ExitStack) -> None:
        """Take the lines, and what is closed behind the last."""
        self._lines = lines
        self._opened = opened
        self._rest = b""

    def readable(self) -> bool:
        """Tell that it is read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer; 0 at the end."""
        if not self._rest:
            self._rest = next(self._lines, b"")
        size = min(len(self._rest), len(buffer))
        buffer[:size], self._rest = self._rest[:size], self._rest[size:]
        return size

    def close(self) -> None:
        """Close the bag too."""
        self._opened.close()
        super().close()
