"""Write recordings: MCAP files and folders with mcap, ROS 1 bags with rosbags, the extra `frametool[bag]`.

Messages are serialised by rosbags once for each set of frames; stamps and numbers are then written into the bytes.
They are logged at their stamps, or at the previous log time if a stamp goes back.
"""

from __future__ import annotations

import re
import struct
from contextlib import contextmanager, suppress
from functools import lru_cache
from heapq import merge
from itertools import chain, groupby
from operator import itemgetter
from pathlib import Path
from shutil import rmtree
from tempfile import gettempdir, mkdtemp
from typing import IO, TYPE_CHECKING, Any, NamedTuple
from weakref import finalize

import numpy as np

from frametool.documents.writers import dump_yaml
from frametool.errors import FileProblem, FrametoolError, ValueInvalid, printable, shown
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry import floats, quaternion
from frametool.recordings import read
from frametool.recordings.read import BAG1, BAG2, QOS, TF, Channel, Recorded, typestore

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.frames.track import Track
    from frametool.grammar.result import Style
    from frametool.text.spans import Floats, Ints

    Sample = tuple[int, tuple[str, str], Sequence[float]]  # stamp, (parent, child), numbers

NAME = "recording"  # of the file in a bag2 folder, independent of the folder's name, so that two runs agree
PIECE = 1 << 20  # bytes
VERSION, VERSION_OF_NUMBERS = 9, 8  # of metadata: the newest, and the last with numeric policies
BY_NUMBERS = re.compile(r"\bhistory: *\d")  # in a quality of service: policies are numbers
SECONDS = {BAG1: (0, (1 << 32) - 1)}  # range of the seconds of a stamp; int32 in ROS 2
SECONDS_ROS2 = (-(1 << 31), (1 << 31) - 1)
_PROBE, _PROBE_NS = 1.2345678912345e-67, 1532698752_187654321  # a number and a stamp with unique bytes


class Kind(NamedTuple):
    """One kind of message.

    type: of the messages; numbers: their count per stamp
    each: the type of the items of a list, "" for other messages
    latched: late subscribers receive it too
    """

    type: str
    numbers: int
    each: str = ""
    latched: bool = False


STAMPED = "geometry_msgs/msg/TransformStamped"
KINDS = {
    "tf_static": Kind(TF, 7, STAMPED, latched=True),
    "tf": Kind(TF, 7, STAMPED),
    "pose": Kind("geometry_msgs/msg/PoseStamped", 7),
    "path": Kind("nav_msgs/msg/Path", 7, "geometry_msgs/msg/PoseStamped"),
    "point": Kind("geometry_msgs/msg/PointStamped", 3),
    "fix": Kind("sensor_msgs/msg/NavSatFix", 3),
}


def check_stamps(stamps_ns: Ints, fmt: str) -> None:
    """Raise ValueInvalid for a stamp whose seconds a message cannot hold."""
    first, last = SECONDS.get(fmt, SECONDS_ROS2)
    seconds = stamps_ns // BILLION
    bad = stamps_ns[(seconds < first) | (seconds > last)]
    if len(bad):
        stamp = format_stamp(int(bad[0]))
        raise ValueInvalid(f"stamp {stamp} does not fit in {fmt}, whose seconds are {first} .. {last}")


def filled(kind: Kind, fmt: str, frames: tuple[str, str], stamps_ns: Ints, numbers: Floats) -> list[bytes]:
    """Return a message for each of stamps (n,) and numbers (n, k), all with the same frames."""
    data, stamp_at, numbers_at = _template(kind, fmt, frames)
    count, size = len(stamps_ns), len(data)
    rows = np.tile(np.frombuffer(data, np.uint8), (count, 1))
    times = np.column_stack(np.divmod(stamps_ns, BILLION)).astype("<u4")  # seconds before 1970 wrap, like int32
    for at, part in ((stamp_at, times), (numbers_at, np.ascontiguousarray(numbers, "<f8"))):
        own = part.view(np.uint8)
        rows[:, at : at + own.shape[1]] = own
    whole = rows.tobytes()
    return [whole[at : at + size] for at in range(0, count * size, size)]


@lru_cache(1 << 10)
def _template(kind: Kind, fmt: str, frames: tuple[str, str]) -> tuple[bytes, int, int]:
    """Return the bytes of a message, and the positions of its stamp and numbers in them."""
    numbers = [_PROBE * (at + 1) for at in range(kind.numbers)]
    data = serialised(kind, fmt, [(_PROBE_NS, frames, numbers)])
    stamp_at = data.index(struct.pack("<II", *divmod(_PROBE_NS, BILLION)))
    return data, stamp_at, data.index(struct.pack(f"<{kind.numbers}d", *numbers))


def serialised(kind: Kind, fmt: str, samples: Iterable[Sample]) -> bytes:
    """Return one message with some transforms, poses or points; raises ValueInvalid for invalid text in names."""
    store = typestore(ros1=fmt == BAG1)
    whole = []  # the values of each stamped message, in the order of its definition
    for stamp_ns, frames, numbers in samples:
        second, part = divmod(stamp_ns, BILLION)
        stamp = (second + (1 << 31)) % (1 << 32) - (1 << 31), part  # rosbags takes seconds of ROS 1 as int32
        if kind.type == KINDS["fix"].type:  # status: GPS fix, unknown covariance
            whole.append([*stamp, frames[0], 0, 1, *numbers, np.zeros(9), 0])
        else:
            whole.append([*stamp, *frames[: 1 + (kind.type == TF)], *numbers])
    leaves = whole[0]
    if kind.each:
        stamp_and_frame = whole[-1][:3] if kind == KINDS["path"] else []
        leaves = [*stamp_and_frame, [_built(store, kind.each, iter(each)) for each in whole]]
    message = _built(store, kind.type, iter(leaves))
    try:
        return bytes((store.serialize_ros1 if fmt == BAG1 else store.serialize_cdr)(message, kind.type))
    except UnicodeEncodeError as error:
        raise ValueInvalid(f"{shown(error.object)} is not a name that can be written") from None


def _built(store: Any, kind: str, leaves: Iterator[Any]) -> Any:
    """Return a message of a type from the values of its fields, depth first; the counter of ROS 1 headers is 0."""
    from rosbags.interfaces import Nodetype

    parts = (
        0 if name == "seq" else _built(store, what, leaves) if node == Nodetype.NAME else next(leaves)
        for name, (node, what) in store.fielddefs[kind][1]
    )
    return store.types[kind](*parts)


class FirstPiece(bytes):
    """The first bytes of a file in a folder, with its name."""

    name = ""


class RecordingFile:
    """A recording that is being written to an unnamed file, until `pieces` yields its contents."""

    def __init__(self, fmt: str, folder: str = "", compression: str = "", *, head: Any = None) -> None:
        """Open the unnamed file in a folder; raises FileProblem without the extra.

        folder: for temporary files, "" for the default; of MCAP, compression: of its chunks; head: profile and library
        """
        read.require_extra("recordings are written")
        from mcap.writer import CompressionType
        from mcap.writer import Writer as McapWriter
        from rosbags.rosbag1 import Writer as Writer1

        self.format, self.log_ns = fmt, 0
        self.counts: dict[Channel, int] = {}
        self.span: tuple[int, int] | None = None  # first and last log time
        self._itself: dict[str, Any] | None = None  # rosbag2's metadata in the source of a copy
        self._folder = folder
        self._numbers: dict[Any, Any] = {}  # ids of schemas and channels, or connections
        with room_in(folder):
            home = Path(mkdtemp(".part", ".frametool.", folder or None))
            place = home / NAME
            self._writer: Any
            if fmt == BAG1:
                self._writer = Writer1(place)
                self._writer.open()
                self._stream = self._writer.bio
            else:
                self._stream = place.open("xb")
                self._writer = McapWriter(self._stream, compression=CompressionType[compression.upper() or "NONE"])
                self._writer.start(*((head.profile, head.library) if head else ("ros2", "frametool")))
            self._file = place.open("rb")
        self._discard = finalize(self, _discarded, self._stream, self._file, home)
        with suppress(OSError):  # Windows keeps the name of an open file
            rmtree(home)

    def channel(self, name: str, topic: str = "") -> Channel:
        """Return the channel for a kind of messages, by default on its usual topic; registered at first use."""
        if name not in self._numbers:
            self._numbers[name] = new_channel(KINDS[name], topic or f"/{name}", ros1=self.format == BAG1)
            self.begin([self._numbers[name]])
        found: Channel = self._numbers[name]
        return found

    def begin(self, channels: Iterable[Channel]) -> None:
        """Register the channels that are new."""
        for each in channels:
            if each in self.counts:
                continue
            known, schema = each.metadata, each.schema
            if self.format == BAG1:
                number = self._writer.add_connection(
                    each.topic, each.type, msgdef=schema[2].decode() if schema else "", md5sum=each.digest or "*",
                    callerid=known.get("callerid"), latching=int(known["latching"]) if known.get("latching") else None,
                )  # fmt: skip
            else:
                if schema and schema not in self._numbers:
                    self._numbers[schema] = self._writer.register_schema(*schema)
                of_schema = self._numbers[schema] if schema else 0
                number = self._writer.register_channel(each.topic, each.encoding, of_schema, known)
            self.counts[each], self._numbers[each] = 0, number

    def write(self, messages: Iterable[tuple[Channel, int, bytes]]) -> None:
        """Write messages with their channels and stamps; if a stamp goes back, the previous log time is used."""
        logged = []
        for channel, stamp_ns, data in messages:
            self.log_ns = max(self.log_ns, stamp_ns)
            logged.append(Recorded(channel, self.log_ns, data, self.log_ns))
        self.add(logged)

    def add(self, messages: Iterable[Recorded]) -> None:
        """Write messages with their recorded times."""
        with room_in(self._folder):
            for channel, log_ns, data, publish_ns, sequence in messages:
                number = self._numbers[channel]
                if self.format == BAG1:
                    self._writer.write(number, log_ns, data)
                else:
                    self._writer.add_message(number, log_ns, data, publish_ns, sequence)
                self.counts[channel] += 1
                first, last = self.span or (log_ns, log_ns)
                self.span = min(first, log_ns), max(last, log_ns)

    def add_other(self, other: Any) -> None:
        """Write an attachment or metadata, a record of mcap; rosbag2's metadata about the file are written anew."""
        if not hasattr(other, "metadata"):
            self._writer.add_attachment(other.create_time, other.log_time, other.name, other.media_type, other.data)
        elif other.name == read.ITSELF:
            self._itself = read.read_metadata(other.metadata.get(read.SERIALIZED, ""), other.name)
        else:
            self._writer.add_metadata(other.name, other.metadata)

    def pieces(self, before: dict[str, Any] | None = None) -> Iterator[bytes]:
        """Finish the recording and yield its bytes; for a folder file after file, each starting with a FirstPiece.

        before: metadata of the source of a copy, None for a new recording; a copy in MCAP has rosbag2's metadata about
            the
            file only if its source has
        """
        metadata: dict[str, Any] = {}
        with room_in(self._folder):
            if self.format == BAG1:
                self._writer.close()
            else:
                metadata = self._metadata(self._itself or before or {})
                if before is None or self._itself is not None or self.format == BAG2:
                    self._writer.add_metadata(read.ITSELF, {read.SERIALIZED: dump_yaml(metadata)})
                self._writer.finish()
                self._stream.close()
        if self.format == BAG2:
            about = dump_yaml({read.INFORMATION: metadata}).encode()
            for name, piece in (read.METADATA, about), (f"{NAME}.mcap", self._file.read(PIECE)):
                first = FirstPiece(piece)
                first.name = name
                yield first
        while piece := self._file.read(PIECE):
            yield piece
        self._discard()

    def _metadata(self, before: dict[str, Any]) -> dict[str, Any]:
        """Return rosbag2's metadata of the recording; some values are those of the source of a copy."""
        from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos

        first, last = self.span or (0, 0)
        by_numbers = any(BY_NUMBERS.search(each.metadata.get(QOS, "")) for each in self.counts)
        topics: dict[tuple[str, ...], dict[str, Any]] = {}
        for each, count in self.counts.items():
            qos: Any = each.metadata.get(QOS, "")
            if not by_numbers:
                with suppress(Exception):  # metadata that cannot be parsed are unchanged
                    qos = dump_qos_v9(parse_qos(qos or []))
            about = {"name": each.topic, "type": each.type, "serialization_format": each.encoding, QOS: qos}
            about["type_description_hash"] = each.digest
            row = topics.setdefault((*map(str, about.values()),), {"topic_metadata": about, "message_count": 0})
            row["message_count"] += count
        count = sum(self.counts.values())
        times = {"duration": {"nanoseconds": last - first}, "starting_time": {"nanoseconds_since_epoch": first}}
        file = f"{NAME}.mcap"
        return {
            "version": VERSION_OF_NUMBERS if by_numbers else VERSION, "storage_identifier": "mcap", **times,
            "message_count": count, "topics_with_message_count": [*topics.values()],
            "compression_format": "", "compression_mode": "",
            "relative_file_paths": [file], "files": [{"path": file, **times, "message_count": count}],
            "custom_data": before.get("custom_data"), "ros_distro": before.get("ros_distro") or "",
        }  # fmt: skip


def tree_pieces(tree: Frames, style: Style) -> Iterator[bytes]:
    """Yield the bytes of a recording of a tree: static edges in one message, moving ones in one per stamp."""
    fmt, asked = style.format, style.recording
    still = [track for track in tree.tracks() if track.is_static]
    moving = [track for track in tree.tracks() if not track.is_static]
    if asked.topic and still and moving:
        raise ValueInvalid(f"the tree has static and moving frames, on two topics; {asked.topic} names one")
    if not still and not moving:
        raise ValueInvalid(f"{fmt} holds transforms, and there is none in the tree")
    file = RecordingFile(fmt, asked.folder)
    first = min((track.span[0] for track in moving), default=0)
    static = [("tf_static", first, [row for track in still for row in _samples(track, style)])] if still else []
    samples = merge(*(_samples(track, style) for track in moving), key=itemgetter(0))
    for name, stamp_ns, rows in chain(static, (("tf", *each) for each in groupby(samples, itemgetter(0)))):
        check_stamps(np.array([stamp_ns]), fmt)
        file.write([(file.channel(name, asked.topic), stamp_ns, serialised(KINDS[name], fmt, rows))])
    yield from file.pieces()


def _samples(track: Track, style: Style) -> Iterator[Sample]:
    """Yield the samples of a frame; static ones with the stamp 0."""
    for stamp_ns, parent, (tx, ty, tz, x, y, z, w) in track.walk():
        turn = (x, y, z, w) if style.keep_sign else quaternion.from_quaternion(x, y, z, w, floats)
        yield stamp_ns or 0, (parent, track.child), tuple(part + 0.0 for part in (tx, ty, tz, *turn))


def _discarded(stream: IO[bytes], file: IO[bytes], folder: Path) -> None:
    """Close the streams of a recording, and remove its temporary files."""
    for each in (stream, file):
        with suppress(OSError):  # on a full disk the buffered data cannot be written
            each.close()
    rmtree(folder, ignore_errors=True)


@contextmanager
def room_in(folder: str) -> Iterator[None]:
    """Convert errors of the system, such as a full disk, into FileProblem with the folder."""
    try:
        yield
    except FrametoolError:
        raise
    except OSError as error:
        problem = (error.strerror or str(error)).lower()
        raise FileProblem(f"{printable(folder or gettempdir())}: {problem}") from None


def new_channel(kind: Kind, topic: str, *, ros1: bool, like: Iterable[Channel] = ()) -> Channel:
    """Return a channel for new messages; like: channels of the same recording, whose type definition is used."""
    store, same = typestore(ros1=ros1), next((each for each in like if each.type == kind.type), None)
    definition, digest = store.generate_msgdef(kind.type, ros_version=2 - ros1)
    digest = digest if ros1 else store.hash_rihs01(kind.type)
    own: Any = kind.type, f"ros{2 - ros1}msg", definition.encode()
    schema, digest = (same.schema, same.digest) if same else (own, digest)
    # rosbag play has one publisher for each topic and caller, and rosbags wants them to differ
    callers = [each.metadata.get("callerid", "") for each in like if each.topic == topic]
    caller = next(name for name in ("", *(f"/frametool_{at + 1}" for at in range(len(callers)))) if name not in callers)
    metadata = {"latching": str(int(kind.latched)), **({"callerid": caller} if caller else {})} if ros1 else {QOS: ""}
    if kind.latched and not ros1:  # quality of service of a latched topic: transient local
        from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
        from rosbags.rosbag2.metadata import dump_qos_v8, dump_qos_v9

        for_ever = QosTime(9223372036, 854775807)
        made = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, for_ever, for_ever,
                   QosLiveliness.AUTOMATIC, for_ever, avoid_ros_namespace_conventions=False)  # fmt: skip
        by_numbers = any(BY_NUMBERS.search(each.metadata.get(QOS, "")) for each in like)
        metadata[QOS] = str(dump_qos_v8([made])) if by_numbers else dump_yaml(dump_qos_v9([made]))
    return Channel(topic, kind.type, "ros1" if ros1 else read.CDR, schema, metadata, digest)
