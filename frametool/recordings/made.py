"""New messages: transforms, poses, points and fixes, serialised by rosbags.

The library serialises a message once for each set of frames; stamps and numbers are then written into its bytes,
for one message or a million.  Messages that are read are objects of rosbags too, of the types that the recording
defines.
"""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, shown
from frametool.frames.stamps import BILLION, format_stamp

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.recordings.read import Channel
    from frametool.text.spans import Floats, Ints

    Sample = tuple[int, tuple[str, str], Sequence[float]]  # its stamp, parent and child, and numbers

BAG1 = "bag1"
SECONDS = {BAG1: (0, (1 << 32) - 1)}  # of a stamp; int32 in ROS 2
SECONDS_ROS2 = (-(1 << 31), (1 << 31) - 1)


class Kind(NamedTuple):
    """One kind of message: its usual topic, its type, and the count of numbers per stamp.

    each: of a list, the type of its items
    stays: it is latched, so that late subscribers get it too
    """

    topic: str
    type: str
    numbers: int
    each: str = ""
    stays: bool = False


KINDS = {
    "tf_static": Kind("/tf_static", "tf2_msgs/msg/TFMessage", 7, "geometry_msgs/msg/TransformStamped", stays=True),
    "tf": Kind("/tf", "tf2_msgs/msg/TFMessage", 7, "geometry_msgs/msg/TransformStamped"),
    "pose": Kind("/pose", "geometry_msgs/msg/PoseStamped", 7),
    "path": Kind("/path", "nav_msgs/msg/Path", 7, "geometry_msgs/msg/PoseStamped"),
    "point": Kind("/point", "geometry_msgs/msg/PointStamped", 3),
    "fix": Kind("/fix", "sensor_msgs/msg/NavSatFix", 3),
}


@lru_cache
def typestore(*, ros1: bool) -> Any:
    """Return the usual types of messages."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    if KINDS["tf"].type not in store.types:  # the library's Noetic has only tf/tfMessage
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", KINDS["tf"].type))
    return store


def check_stamps(stamps_ns: Ints, fmt: str) -> None:
    """Raise ValueInvalid for a stamp whose seconds a message cannot hold."""
    first, last = SECONDS.get(fmt, SECONDS_ROS2)
    seconds = stamps_ns // BILLION
    bad = stamps_ns[(seconds < first) | (seconds > last)]
    if len(bad):
        stamp = format_stamp(int(bad[0]))
        raise ValueInvalid(f"stamp {stamp} does not fit in {fmt}, whose seconds are {first} .. {last}")


class MessageTemplate:
    """The bytes of a message about one frame, and the positions of its stamp and numbers."""

    def __init__(self, kind: Kind, fmt: str, parent: str, child: str = "") -> None:
        """Serialise a message with unique numbers to find their positions; ValueInvalid for names that are not text."""
        numbers = [_PROBE * (at + 1) for at in range(kind.numbers)]
        self.bytes = serialised(kind, fmt, [(_PROBE_NS, (parent, child), numbers)])
        self.stamp_at = self.bytes.index(struct.pack("<II", *divmod(_PROBE_NS, BILLION)))
        self.numbers_at = self.bytes.index(struct.pack(f"<{kind.numbers}d", *numbers))

    def filled(self, stamps_ns: Ints, numbers: Floats) -> list[bytes]:
        """Return a message for each of stamps (n,) and numbers (n, k)."""
        count, size = len(stamps_ns), len(self.bytes)
        rows = np.tile(np.frombuffer(self.bytes, np.uint8), (count, 1))
        times = np.column_stack(np.divmod(stamps_ns, BILLION)).astype("<u4")  # seconds before 1970 wrap, like int32
        for at, part in ((self.stamp_at, times), (self.numbers_at, np.ascontiguousarray(numbers, "<f8"))):
            own = part.view(np.uint8)
            rows[:, at : at + own.shape[1]] = own
        whole = rows.tobytes()
        return [whole[at : at + size] for at in range(0, count * size, size)]


_PROBE = 1.2345678912345e-67
_PROBE_NS = 1532698752_187654321


def serialised(kind: Kind, fmt: str, samples: Iterable[Sample]) -> bytes:
    """Return one message of some transforms, poses or points; raises ValueInvalid for names that are not text."""
    store = typestore(ros1=fmt == BAG1)
    whole = [_leaves(kind, *sample) for sample in samples]
    leaves = whole[0]
    if kind.each:
        stamp_and_frame = whole[-1][:3] if kind == KINDS["path"] else []
        leaves = [*stamp_and_frame, [_built(store, kind.each, iter(each)) for each in whole]]
    message = _built(store, kind.type, iter(leaves))
    try:
        return bytes((store.serialize_ros1 if fmt == BAG1 else store.serialize_cdr)(message, kind.type))
    except UnicodeEncodeError as error:
        raise ValueInvalid(f"{shown(error.object)} is not a name that can be written") from None


def _leaves(kind: Kind, stamp_ns: int, frames: tuple[str, str], numbers: Sequence[float]) -> list[Any]:
    """Return the contents of a stamped message in the order of its definition."""
    second, part = divmod(stamp_ns, BILLION)
    stamp = (second + (1 << 31)) % (1 << 32) - (1 << 31), part  # rosbags takes seconds of ROS 1 as int32
    if kind.type == KINDS["fix"].type:  # by GPS, of unknown covariance
        return [*stamp, frames[0], 0, 1, *numbers, np.zeros(9), 0]
    return [*stamp, *frames[: 1 + (kind.type == KINDS["tf"].type)], *numbers]


def _built(store: Any, kind: str, leaves: Iterator[Any]) -> Any:
    """Return a message of a type; headers of ROS 1 have a counter too."""
    from rosbags.interfaces import Nodetype

    parts = (
        0 if name == "seq" else _built(store, what, leaves) if node == Nodetype.NAME else next(leaves)
        for name, (node, what) in store.fielddefs[kind][1]
    )
    return store.types[kind](*parts)


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
        """Learn the definition of a type; raises ValueError if it does not match its hash."""
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
                raise ValueError(f"hash of {kind} is {made}, not {digest}")

    def _register(self, types: dict[str, Any]) -> None:
        """Register types that are not known yet."""
        self.store.register({name: each for name, each in types.items() if name not in self.store.types})
