"""The types of recorded messages: as objects of rosbags, as lines of JSON, and the layout of their bytes.

Messages of equal layout are converted many at once.  One message is parsed according to its type: where each number is,
and which bytes are in between (names and lengths), in which other messages must agree exactly.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from json import dumps
from math import isfinite
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.ros.messages import PATH
from frametool.text.spans import MARGIN, Spans, framed, join
from frametool.text.write import shortest_spans

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray
    from rosbags.interfaces import Nodetype

    from frametool.recordings.read import Channel, Recorded

CODES = {"float64": "<f8", "float32": "<f4", "uint32": "<u4", "int32": "<i4", "uint16": "<u2", "int16": "<i2",
         "uint8": "<u1", "int8": "<i1"}  # fmt: skip
MOST_NUMBERS = 200  # per message
MOST_LAYOUTS = 16  # of messages of one length
CDR_LE = b"\0\1"
HOLE = b"\0"  # a placeholder for a number; no JSON text contains it
STRING_OR_NUMBER = re.compile(rb'("(?:[^"\\]|\\.)*")|-?\d[-+.\de]*')
POINT_ZERO = 2  # the characters `.0` that an integer written as a float has too many
TF, POSE_ARRAY = "tf2_msgs/msg/TFMessage", "geometry_msgs/msg/PoseArray"


@lru_cache
def typestore(*, ros1: bool) -> Any:
    """Return the usual types of messages."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    if TF not in store.types:  # the library's Noetic has only tf/tfMessage
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", TF))
    return store


BETWEEN_IDL = "=" * 80 + "\nIDL: "  # before the name of each file
TIMES = {"builtin_interfaces/msg/Time": "uint32", "builtin_interfaces/msg/Duration": "int32"}  # wiki.ros.org/msg


class MessageTypes:
    """The types of some channels: those defined in the recording, or the usual ones if it defines none."""

    def __init__(self, channels: Sequence[Channel], *, ros1: bool) -> None:
        """Create an empty set; a type that cannot be read affects only its own messages."""
        from rosbags.interfaces import Nodetype
        from rosbags.typesys import Stores, get_typestore

        self.channels, self.ros1 = channels, ros1
        self.store: Any = get_typestore(Stores.EMPTY)
        for name, code in TIMES.items() if ros1 else ():  # the library has int32 for both
            fields: Any = [("sec", (Nodetype.BASE, (code, 0))), ("nanosec", (Nodetype.BASE, ("uint32", 0)))]
            self.store.fielddefs[name] = ([], fields)

    def read(self, channel: Channel, data: bytes) -> Any:
        """Return a message; raises ValueInvalid for invalid bytes."""
        if channel.type not in self.store.types:
            self._learn(channel.type)
        try:
            return (self.store.deserialize_ros1 if self.ros1 else self.store.deserialize_cdr)(data, channel.type)
        except Exception:  # noqa: BLE001 - of broken bytes the library raises anything
            raise ValueInvalid(f"its bytes are not a {channel.type}") from None

    def write(self, channel: Channel, message: Any) -> bytes:
        """Return the bytes of a message that was read."""
        return bytes((self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr)(message, channel.type))

    def _learn(self, kind: str) -> None:
        """Learn the definition of a type; raises TypeError if it does not match its hash."""
        from rosbags.typesys import get_types_from_idl, get_types_from_msg

        found: dict[str, Any] = {}
        digests: set[str] = set()
        for each in self.channels:
            _, fmt, definition = each.schema or ("", "", b"")
            if each.type != kind or fmt not in ("ros1msg", "ros2msg", "ros2idl", "omgidl"):
                continue
            digests |= {each.digest} - {""}
            text = definition.decode()
            if fmt.endswith("msg"):
                found |= get_types_from_msg(text, kind)
                continue
            for part in text.split(BETWEEN_IDL)[1:] or [f"\n{text}"]:
                found |= get_types_from_idl(part.partition("\n")[2])
        known = self.store
        self._register(found)
        try:
            known.generate_msgdef(kind)
        except Exception:  # noqa: BLE001 - of a type that is not there, or has parts that are not
            self._register(typestore(ros1=self.ros1).fielddefs)
        for digest in digests:
            made = known.generate_msgdef(kind)[1] if self.ros1 else known.hash_rihs01(kind)
            if made != digest:
                raise TypeError(f"hash of {kind} is {made}, not {digest}")

    def _register(self, types: dict[str, Any]) -> None:
        """Register types that are not known yet."""
        self.store.register({name: each for name, each in types.items() if name not in self.store.types})


def posed_messages(message: Any, kind: str) -> list[Any]:
    """Return the poses of a message that is a list of them, each with its header; else the message itself.

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
    """Return a message, or a part of one, as plain values; numbers that JSON does not have are written by name."""
    if isinstance(value, float):
        return value if isfinite(value) else str(value)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list):
        return [*map(_plain, value)]
    if isinstance(value, str | int):
        return value
    return {name: _plain(each) for name, each in vars(value).items() if name[0].islower()}  # others are constants


class BinaryLayout(NamedTuple):
    """The positions of numbers in messages, the bytes that all of them share, and the JSON text in between.

    sample: the message that it was learned from
    """

    numbers: np.dtype[Any]
    shared: Sequence[slice]
    texts: Sequence[bytes]
    sample: bytes

    def values(self, messages: Sequence[bytes]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the numbers of messages of equal length, (n, k), and which differ from the sample in nothing else.

        Those with numbers that are not finite do not count as alike.
        """
        text = b"".join(messages)
        rows = np.frombuffer(text, np.uint8).reshape(len(messages), -1)
        columns = np.frombuffer(text, self.numbers)
        numbers = np.stack([columns[name].astype(np.float64) for name in self.numbers.names or ()], axis=-1)
        same = [rows[:, part] == np.frombuffer(self.sample[part], np.uint8) for part in self.shared]
        alike: Any = np.hstack([np.isfinite(numbers), *same]).all(axis=1)
        return numbers, alike

    def lines(self, numbers: NDArray[np.float64]) -> bytes:
        """Return messages with these numbers, (n, k), as lines."""
        names = self.numbers.names or ()
        written = shortest_spans(numbers, b" " * len(names))
        ends = written.ends - np.array([1 + POINT_ZERO * (self.numbers[name].kind != "f") for name in names])
        parts = [_repeated(self.texts[0], len(numbers))]
        for at, each in enumerate(self.texts[1:]):
            parts += [Spans(written.data, written.starts[:, at], ends[:, at]), _repeated(each, len(numbers))]
        return join(parts)


def _repeated(text: bytes, count: int) -> Spans:
    """Return a text for each row, in pieces that are copied at once."""
    starts = np.arange(0, len(text), MARGIN)
    ends = np.minimum(starts + MARGIN, len(text))
    return Spans(framed(text), np.tile(starts + MARGIN, (count, 1)), np.tile(ends + MARGIN, (count, 1)))


class MessageNumbers:
    """The numbers in one message: their places and types, and the parts that other messages must share with it."""

    def __init__(self, types: MessageTypes, kind: str, data: bytes) -> None:
        """Read a message; raises ValueError if one of its parts has no fixed place."""
        from rosbags.interfaces import Nodetype

        self.fields, self.data = types.store.fielddefs, data
        self.begin = self.at = 0 if types.ros1 else 4
        self.aligned = not types.ros1
        self.numbers: list[tuple[int, str]] = []
        self.shared = [slice(self.begin)]
        self._value(Nodetype.NAME, kind)
        if self.at != len(data) or not self.numbers or (self.aligned and data[:2] != CDR_LE):
            raise ValueError

    def _value(self, node: Nodetype, what: Any) -> None:
        from rosbags.interfaces import Nodetype  # the extra is named where it is missing

        if node == Nodetype.NAME:
            for _, inner in self.fields[what][1]:
                self._value(*inner)
        elif node == Nodetype.ARRAY:
            for _ in range(min(what[1], MOST_NUMBERS)):
                self._value(*what[0])
        elif node == Nodetype.SEQUENCE or what[0] == "string":
            begin = self._place(4)
            count = int.from_bytes(self.data[begin : self.at], "little")
            self.at += count if node == Nodetype.BASE else 0
            self.shared.append(slice(begin, self.at))
            for _ in range(min(count, MOST_NUMBERS) if node == Nodetype.SEQUENCE else 0):
                self._value(*what[0])
        else:
            code = CODES.get(what[0])
            if code is None or len(self.numbers) > MOST_NUMBERS:
                raise ValueError
            self.numbers.append((self._place(int(code[-1])), code))

    def _place(self, size: int) -> int:
        """Skip the next part of this many bytes; return its position."""
        self.at += size + (-(self.at - self.begin) % size if self.aligned else 0)
        return self.at - size


def layout_of(types: MessageTypes, channel: Channel, data: bytes) -> BinaryLayout | None:
    """Return the layout of messages like this one; None unless it gives the same line as the full reader."""
    try:
        line = text_of(types, channel, data)
        fields = MessageNumbers(types, channel.type, data)
    except ValueError:
        return None
    places, codes = zip(*fields.numbers, strict=True)
    names = [f"f{at}" for at in range(len(codes))]
    numbers = np.dtype({"names": names, "formats": codes, "offsets": places, "itemsize": len(data)})
    texts = STRING_OR_NUMBER.sub(lambda found: found[1] or HOLE, line).split(HOLE)
    if len(texts) != len(codes) + 1:
        return None
    made = BinaryLayout(numbers, fields.shared, texts, data)
    values, alike = made.values([data])
    return made if alike.all() and made.lines(values) == line else None


class Layouts:
    """The layouts that were learned of the messages of a recording, by channel and length."""

    def __init__(self, types: MessageTypes) -> None:
        """Create an empty set."""
        self.types = types
        self._known: dict[Any, list[BinaryLayout | None]] = {}

    def groups(
        self, messages: Sequence[Recorded]
    ) -> Iterator[tuple[list[int], BinaryLayout | None, NDArray[np.float64]]]:
        """Yield the places of messages of one layout, and their numbers, (n, k); without a layout where it varies."""
        groups: dict[Any, list[int]] = {}
        for at, each in enumerate(messages):
            groups.setdefault((each.channel, len(each.data)), []).append(at)
        for key, group in groups.items():
            left, known = np.array(group), self._known.setdefault(key, [])
            for tried in range(MOST_LAYOUTS):
                if tried == len(known):
                    known.append(layout_of(self.types, key[0], messages[left[0]].data))
                if (layout := known[tried]) is None:
                    break
                values, alike = layout.values([messages[at].data for at in left.tolist()])
                if alike.any():
                    yield left[alike].tolist(), layout, values[alike]
                left = left[~alike]
                if not left.size:
                    break
            if left.size:
                yield left.tolist(), None, np.empty((0, 0))
