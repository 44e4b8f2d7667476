"""Write recordings: MCAP files and folders with mcap, ROS 1 bags with rosbags, the extra `frametool[bag]`.

New messages are logged at their stamps, or at the previous log time if a stamp goes back.
"""

from __future__ import annotations

import re
from contextlib import contextmanager, suppress
from heapq import merge
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from shutil import rmtree
from tempfile import gettempdir, mkdtemp
from typing import IO, TYPE_CHECKING, Any
from weakref import finalize

import numpy as np

from frametool.documents.yaml_writer import dump
from frametool.errors import FileProblem, FrametoolError, ValueInvalid, printable
from frametool.geometry import floats, quaternion
from frametool.recordings.made import KINDS, check_stamps, serialised, typestore
from frametool.recordings.read import BAG1, BAG2, CDR, INFORMATION, ITSELF, METADATA, QOS, SERIALIZED, Channel, Recorded

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.frames.lookups import Frames
    from frametool.frames.track import Track
    from frametool.grammar.result import Style
    from frametool.recordings.made import Kind, Sample

NAME = "recording"  # of the file in a bag2 folder, whatever the folder's name: two runs write the same bytes
PIECE = 1 << 20  # bytes
NO_EXTRA = "recordings are written with an extra; install it: pip install 'frametool[bag]'"
VERSION, VERSION_OF_NUMBERS = 9, 8  # of metadata: the newest, and the last with numeric policies
BY_NUMBERS = re.compile(r"\bhistory: *\d")  # in a quality of service


class FirstPiece(bytes):
    """The first bytes of a file in a folder, with its name."""

    name = ""


class RecordingFile:
    """A recording that is being written, to an unnamed file until `pieces` yields its contents."""

    def __init__(self, fmt: str, folder: str = "", compression: str = "", *, head: Any = None) -> None:
        """Open it in a folder for temporary files; raises FileProblem without the extra.

        compression: of its chunks, as MCAP files and bags name them; head: profile and library of MCAP
        """
        try:
            from mcap.writer import CompressionType
            from mcap.writer import Writer as McapWriter
            from rosbags.rosbag1 import Writer as Writer1
        except ImportError:
            raise FileProblem(NO_EXTRA) from None

        self.format, self.log_ns = fmt, 0
        self.counts: dict[Channel, int] = {}
        self.span: tuple[int, int] | None = None  # of log times
        self._folder = folder
        self._numbers: dict[Any, Any] = {}  # of schemas and channels, or connections
        with room_in(folder):
            home = Path(mkdtemp(".part", ".frametool.", folder or None))
            place = home / NAME
            self._writer: Any
            if fmt == BAG1:
                self._writer = Writer1(place)
                if compression:
                    self._writer.set_compression(Writer1.CompressionFormat[compression.upper()])
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

    def channel(self, kind: Kind, topic: str = "") -> Channel:
        """Begin a topic, by default the usual one of its kind, and return the argument for `write`."""
        made = new_channel(kind, topic or kind.topic, ros1=self.format == BAG1)
        self.begin([made])
        return made

    def begin(self, channels: Iterable[Channel]) -> None:
        """Begin some channels."""
        for each in channels:
            if each not in self.counts:
                self.counts[each], self._numbers[each] = 0, self._number(each)

    def _number(self, channel: Channel) -> Any:
        """Return what the writer knows a channel by."""
        said, schema = channel.said, channel.schema
        if self.format == BAG1:
            return self._writer.add_connection(
                channel.topic, channel.type, msgdef=schema[2].decode() if schema else "", md5sum=channel.digest or "*",
                callerid=said.get("callerid"), latching=int(said["latching"]) if said.get("latching") else None,
            )  # fmt: skip
        if schema and schema not in self._numbers:
            self._numbers[schema] = self._writer.register_schema(*schema)
        number = self._numbers[schema] if schema else 0
        return self._writer.register_channel(channel.topic, channel.encoding, number, said)

    def write(self, channel: Channel, stamp_ns: int, data: bytes | memoryview) -> None:
        """Write one message; a late one is logged with the previous one."""
        self.log_ns = max(self.log_ns, stamp_ns)
        self.add(Recorded(channel, self.log_ns, bytes(data), self.log_ns))

    def add(self, message: Recorded) -> None:
        """Write one message as it was recorded."""
        channel, log_ns, data, publish_ns, sequence = message
        number = self._numbers[channel]
        try:
            if self.format == BAG1:
                self._writer.write(number, log_ns, data)
            else:
                self._writer.add_message(number, log_ns, data, publish_ns, sequence)
        except OSError as error:
            raise _named(error, self._folder) from None
        self.counts[channel] += 1
        first, last = self.span or (log_ns, log_ns)
        self.span = min(first, log_ns), max(last, log_ns)

    def add_other(self, other: Any) -> None:
        """Write an attachment or metadata, a record of mcap; rosbag2's metadata about the file itself are replaced."""
        if hasattr(other, "metadata"):
            self._writer.add_metadata(other.name, other.metadata)
        else:
            self._writer.add_attachment(other.create_time, other.log_time, other.name, other.media_type, other.data)

    def pieces(self, before: dict[str, Any] | None = None, *, itself: bool = True) -> Iterator[bytes]:
        """Finish the recording and yield its bytes; for a folder file after file, each starting with a FirstPiece.

        before: the metadata of the source of a copy; itself: whether MCAP contains rosbag2's metadata about a file
        """
        metadata: dict[str, Any] = {}
        with room_in(self._folder):
            if self.format == BAG1:
                self._writer.close()
            else:
                metadata = self._metadata(before or {})
                if itself or self.format == BAG2:
                    self._writer.add_metadata(ITSELF, {SERIALIZED: dump(metadata)})
                self._writer.finish()
                self._stream.close()
        if self.format == BAG2:
            pieces = {METADATA: dump({INFORMATION: metadata}).encode(), f"{NAME}.mcap": self._file.read(PIECE)}
            for name, piece in pieces.items():
                first = FirstPiece(piece)
                first.name = name
                yield first
        while piece := self._file.read(PIECE):
            yield piece
        self._discard()

    def _metadata(self, before: dict[str, Any]) -> dict[str, Any]:
        """Return rosbag2's metadata of a recording, including those of its source."""
        from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos

        first, last = self.span or (0, 0)
        by_numbers = any(BY_NUMBERS.search(each.said.get(QOS, "")) for each in self.counts)
        topics: dict[tuple[str, ...], dict[str, Any]] = {}
        for each, count in self.counts.items():
            qos: Any = each.said.get(QOS, "")
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
    if still:
        data = serialised(KINDS["tf_static"], fmt, [row for track in still for row in _samples(track, style)])
        first = min((track.span[0] for track in moving), default=0)
        file.write(file.channel(KINDS["tf_static"], asked.topic), first, data)
    if moving:
        channel = file.channel(KINDS["tf"], asked.topic)
        samples = merge(*(_samples(track, style) for track in moving), key=itemgetter(0))
        for stamp, rows in groupby(samples, itemgetter(0)):
            check_stamps(np.array([stamp]), fmt)
            file.write(channel, stamp, serialised(KINDS["tf"], fmt, rows))
    yield from file.pieces()


def _samples(track: Track, style: Style) -> Iterator[Sample]:
    """Yield the samples of a frame; static ones with the stamp 0."""
    for stamp_ns, parent, (tx, ty, tz, x, y, z, w) in track.walk():
        turn = (x, y, z, w) if style.keep_sign else quaternion.from_quaternion(x, y, z, w, floats)
        yield stamp_ns or 0, (parent, track.child), tuple(part + 0.0 for part in (tx, ty, tz, *turn))


def _discarded(stream: IO[bytes], file: IO[bytes], folder: Path) -> None:
    """Close what was opened for a recording, and remove what is left of it."""
    for each in (stream, file):
        with suppress(OSError):  # on a full disk the buffered data cannot be written
            each.close()
    rmtree(folder, ignore_errors=True)


@contextmanager
def room_in(folder: str) -> Iterator[None]:
    """Name the folder in which there is no room, or what else the system says of it."""
    try:
        yield
    except FrametoolError:
        raise
    except OSError as error:
        raise _named(error, folder) from None


def _named(error: OSError, folder: str) -> FileProblem:
    return FileProblem(f"{printable(folder or gettempdir())}: {(error.strerror or str(error)).lower()}")


def new_channel(kind: Kind, topic: str, *, ros1: bool, like: Iterable[Channel] = ()) -> Channel:
    """Return a channel of messages that are made; like: others of the same recording, whose definition is taken."""
    store = typestore(ros1=ros1)
    definition, digest = store.generate_msgdef(kind.type, ros_version=1 if ros1 else 2)
    known = [each for each in like if each.type == kind.type]
    encoding = "ros1" if ros1 else CDR
    schema = kind.type, f"ros{2 - ros1}msg", definition.encode()
    said = {"latching": str(int(kind.stays))}
    if not ros1:
        by_numbers = any(BY_NUMBERS.search(each.said.get(QOS, "")) for each in like)
        said, digest = {QOS: latched(by_numbers=by_numbers) if kind.stays else ""}, store.hash_rihs01(kind.type)
    if known:
        return Channel(topic, kind.type, encoding, known[0].schema, said, known[0].digest)
    return Channel(topic, kind.type, encoding, schema, said, digest)


def latched(*, by_numbers: bool) -> str:
    """Return the quality of service of a topic that is there for who comes late, as channels have it."""
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
    from rosbags.rosbag2.metadata import dump_qos_v8, dump_qos_v9

    for_ever = QosTime(9223372036, 854775807)
    made = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, for_ever, for_ever,
               QosLiveliness.AUTOMATIC, for_ever, avoid_ros_namespace_conventions=False)  # fmt: skip
    return str(dump_qos_v8([made])) if by_numbers else dump(dump_qos_v9([made]))
