"""Recordings for the tests: written by rosbags in every form, and read back as the bytes they hold."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Reader as Reader2
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

SECOND = 10**9
START = 1_700_000_000 * SECOND
TF = "tf2_msgs/msg/TFMessage"
ROS2 = ("mcap", "folder", "sqlite")
FORMS = (*ROS2, "bag")
DEFINED = {
    "my_msgs/msg/Distance": ("float64 metres\nstring by  # whom\n", "RIHS01_0123", "0123456789abcdef0123456789abcdef"),
    "my_msgs/msg/Odd": ("this is no (definition\n", "RIHS01_4567", "fedcba9876543210fedcba9876543210"),
}
SLOW = Qos(
    QosHistory.KEEP_ALL, 7, QosReliability.BEST_EFFORT, QosDurability.VOLATILE, QosTime(1, 2), QosTime(3, 4),
    QosLiveliness.MANUAL_BY_TOPIC, QosTime(5, 6), avoid_ros_namespace_conventions=True,
)  # fmt: skip


class Recorded(NamedTuple):
    """A message as it is in a recording: on which connection, when, and its bytes."""

    topic: str
    kind: str
    definition: str
    about: tuple[Any, ...]  # digest, callerid and latching; or quality of service
    log_ns: int
    data: bytes


@cache
def store(form: str) -> Any:
    made = get_typestore(Stores.ROS1_NOETIC if form == "bag" else Stores.ROS2_HUMBLE)
    if TF not in made.types:
        made.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", TF))
    return made


class Maker:
    """Makes messages of the types of one form."""

    def __init__(self, form: str) -> None:
        self.form = form
        self.types = store(form).types

    def part(self, name: str, *values: Any) -> Any:
        return self.types[name if "/" in name else f"geometry_msgs/msg/{name}"](*values)

    def header(self, frame: str, stamp_ns: int) -> Any:
        time = self.part("builtin_interfaces/msg/Time", *divmod(stamp_ns, SECOND))
        return self.part("std_msgs/msg/Header", *([7] if self.form == "bag" else []), time, frame)

    def posed(self, numbers: Sequence[float]) -> Any:
        return self.part("Pose", self.part("Point", *numbers[:3]), self.part("Quaternion", *numbers[3:]))

    def transforms(self, *edges: tuple[str, str, Sequence[float], int]) -> tuple[str, Any]:
        made = [
            self.part(
                "TransformStamped", self.header(parent, stamp_ns), child,
                self.part("Transform", self.part("Vector3", *numbers[:3]), self.part("Quaternion", *numbers[3:])),
            )
            for parent, child, numbers, stamp_ns in edges
        ]  # fmt: skip
        return TF, self.part(TF, made)

    def pose(self, frame: str, stamp_ns: int, numbers: Sequence[float]) -> tuple[str, Any]:
        kind = "geometry_msgs/msg/PoseStamped"
        return kind, self.part(kind, self.header(frame, stamp_ns), self.posed(numbers))

    def serialised(self, kind: str, message: Any) -> bytes:
        made = store(self.form)
        return bytes((made.serialize_ros1 if self.form == "bag" else made.serialize_cdr)(message, kind))

    def read(self, kind: str, data: bytes) -> Any:
        made = store(self.form)
        return (made.deserialize_ros1 if self.form == "bag" else made.deserialize_cdr)(data, kind)


class Sent(NamedTuple):
    """A message that is to be recorded; data: the message, or its bytes; by: who sent it."""

    topic: str
    kind: str
    data: Any
    log_ns: int
    by: str = ""


def write(path: Path, form: str, messages: Iterable[Sent], *, compression: Any = None) -> Path:
    """Write a recording and return the path of its file, or folder."""
    made = Maker(form)
    connections: dict[tuple[str, str, str], Any] = {}
    plugin = StoragePlugin.SQLITE3 if form == "sqlite" else StoragePlugin.MCAP
    writer: Any = Writer1(path) if form == "bag" else Writer2(path, version=9, storage_plugin=plugin)
    if compression is not None:
        writer.set_compression(*compression)
    with writer:
        for topic, kind, data, log_ns, by in messages:
            key = topic, kind, by
            if key not in connections:
                connections[key] = writer.add_connection(topic, kind, **_said(form, kind, by))
            raw = data if isinstance(data, bytes) else made.serialised(kind, data)
            writer.write(connections[key], log_ns, raw)
    return next(path.glob("*.mcap")) if form == "mcap" else path


def _said(form: str, kind: str, by: str) -> dict[str, Any]:
    definition, rihs01, md5sum = DEFINED.get(kind, (None, None, None))
    if form == "bag":
        said: dict[str, Any] = {"callerid": by or None, "latching": 1 if by else None, "md5sum": md5sum}
    else:
        said = {"offered_qos_profiles": [SLOW] if by else [], "rihs01": rihs01}
    return said | ({"msgdef": definition} if definition else {"typestore": store(form)})


def read(path: Path) -> list[Recorded]:
    """Return the messages of a recording."""
    with Reader1(path) if path.suffix == ".bag" else Reader2(path) as reader:
        return [
            Recorded(each.topic, each.msgtype, each.msgdef.data, (each.digest, each.ext), log_ns, bytes(data))
            for each, log_ns, data in reader.messages()
        ]
