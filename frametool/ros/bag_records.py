"""Messages of a bag as a stream of JSON lines, one a message: what reads such records reads bags so.

Points, poses, fixes, twists, wrenches and the like; transforms make a tree and clouds are files of their own.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import fields, is_dataclass
from functools import lru_cache
from io import BufferedReader
from math import isfinite
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from frametool.documents.json import dump
from frametool.errors import FormatError, Unanswered, first_of, listing
from frametool.ros.bags import TYPES, check_count, opened_bag, refuse_foreign
from frametool.ros.messages import PATH
from frametool.ros.pose_lists import POSE_ARRAY, posed_messages
from frametool.text.lines import Pieces

CLOUD = "sensor_msgs/msg/PointCloud2"

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from frametool.grammar.edges import Tally

PIECE = 1 << 16  # bytes
FIX = "sensor_msgs/msg/NavSatFix"
STAMPED = ("Point", "Pose", "PoseWithCovariance", "Vector3", "Quaternion", "Twist", "TwistWithCovariance", "Wrench",
           "Accel", "AccelWithCovariance", "Transform")  # fmt: skip
RECORDS = frozenset((
    FIX, PATH, POSE_ARRAY, "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField", "nav_msgs/msg/Odometry",
    *(f"geometry_msgs/msg/{name}Stamped" for name in STAMPED),
))  # fmt: skip


def record_topics(reader: Any, chosen: Collection[str], path: str) -> list[str]:
    """Return the topics whose messages are wanted: those chosen, or the only one that holds fixes; [] for none.

    chosen: with or without a leading `/`
    Raises Unanswered where several hold records and none is chosen.
    """
    there = {each.topic: each.msgtype for each in reader.connections if each.msgtype in RECORDS}
    wanted = {topic.strip("/") for topic in chosen}
    if wanted:
        return [topic for topic in there if topic.strip("/") in wanted]
    if len(there) > 1:
        named = first_of(sorted(there), 8, gap="|")
        raise Unanswered(f"several topics hold records; give --topic {named}", source=path)
    return list(there)


def open_records(path: str, chosen: Collection[str], tally: Tally) -> BufferedReader | None:
    """Open the messages of a bag as JSON lines; None where the topics that are wanted hold clouds.

    Raises FileProblem when the extra is missing, FormatError for a bag that is broken or holds neither.
    """
    with ExitStack() as opened:
        reader = opened.enter_context(opened_bag(path, tally))
        refuse_foreign(reader, chosen, path)
        topics = record_topics(reader, chosen, path)
        if topics:
            return BufferedReader(Pieces(_pieces(_lines(reader, topics, path)), opened.pop_all()))
        wanted = {topic.strip("/") for topic in chosen}
        clouds = [each.topic.strip("/") for each in reader.connections if each.msgtype == CLOUD]
        if any(not wanted or topic in wanted for topic in clouds):
            return None
        held = {f"{each.topic} ({each.msgtype})" for each in reader.connections}
        known = listing(held, near=next(iter(chosen), "")) or "none"
        has_frames = any(each.msgtype in TYPES for each in reader.connections)
    named = f" on {listing(chosen)}" if chosen else ""
    remedy = f"; its frames: frametool lookup {path} TARGET SOURCE" if has_frames else ""
    raise FormatError(f"no points, poses or fixes{named}; topics: {known}{remedy}", source=path)


def _lines(reader: Any, topics: Sequence[str], path: str) -> Iterator[str]:
    """Yield each message, or each pose of a list, as a line; there must be as many messages as the bag says."""
    connections = [each for each in reader.connections if each.topic in topics]
    number = 0
    messages = reader.messages(connections=connections)
    while (found := _next(reader, messages, number + 1, path)) is not None:
        number += 1
        for message in posed_messages(*found):
            yield _text(message) + "\n"
    check_count(reader, connections, number, path)


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


def _next(reader: Any, messages: Iterator[Any], number: int, path: str) -> tuple[Any, str] | None:
    """Return the next message and its type; None behind the last."""
    try:
        if (found := next(messages, None)) is None:
            return None
        connection, _, data = found
        return reader.deserialize(data, connection.msgtype), connection.msgtype
    except Exception as error:  # noqa: BLE001 - a broken bag makes the library raise anything
        raise FormatError(f"message {number}: cannot be read ({type(error).__name__})", source=path) from None


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
