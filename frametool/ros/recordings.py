"""Recordings written: MCAP files, ROS 1 bags and bag2 folders, through the rosbags library, the extra `frametool[bag]`.

A message is serialised by the library once for the frames it names; stamps and numbers are then put in their places,
for one and for a million alike.  Messages are logged at their stamps, or at the one before where a stamp goes back.
"""

from __future__ import annotations

import struct
from contextlib import contextmanager, suppress
from functools import lru_cache
from heapq import merge
from itertools import chain, groupby
from operator import itemgetter
from pathlib import Path
from shutil import rmtree
from tempfile import gettempdir, mkdtemp
from typing import IO, TYPE_CHECKING, Any, NamedTuple, Self, TypeAlias
from weakref import finalize

import numpy as np

from frametool.errors import FileProblem, FrametoolError, ValueInvalid, printable, shown
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry import floats, quaternion

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.frames.track import Track
    from frametool.geometry.types import Components
    from frametool.grammar.result import Style
    from frametool.text.spans import Floats, Ints

BAG1, BAG2 = "bag1", "bag2"
NAME = "recording"  # of the file in a bag2 folder, whatever that is called: two runs write the same bytes
METADATA = "metadata.yaml"
PIECE = 1 << 20  # bytes
NO_EXTRA = "recordings are written with an extra; install it: pip install 'frametool[bag]'"
SECONDS = {BAG1: (0, (1 << 32) - 1)}  # of a stamp; those of ROS 2 are int32
SECONDS_ROS2 = (-(1 << 31), (1 << 31) - 1)


class Kind(NamedTuple):
    """What one kind of message is: the usual topic, its type, how many numbers each of its stamps has.

    stays: it is latched, so that who comes late gets it too
    """

    topic: str
    type: str
    numbers: int
    stays: bool = False


KINDS = {
    "tf_static": Kind("/tf_static", "tf2_msgs/msg/TFMessage", 7, stays=True),
    "tf": Kind("/tf", "tf2_msgs/msg/TFMessage", 7),
    "pose": Kind("/pose", "geometry_msgs/msg/PoseStamped", 7),
    "path": Kind("/path", "nav_msgs/msg/Path", 7),
    "point": Kind("/point", "geometry_msgs/msg/PointStamped", 3),
    "fix": Kind("/fix", "sensor_msgs/msg/NavSatFix", 3),
}


class FirstPiece(bytes):
    """The first bytes of a file in a folder, with its name."""

    name: str

    def __new__(cls, piece: bytes, name: str) -> Self:
        """Take a piece and a name."""
        made = super().__new__(cls, piece)
        made.name = name
        return made


class RecordingFile:
    """A recording that is being written, into a file without a name until `pieces` yields what is in it."""

    def __init__(self, form: str, folder: str = "") -> None:
        """Open it in a folder that has room for it; raises FileProblem without the extra."""
        try:
            from rosbags.rosbag1 import Writer as Writer1
            from rosbags.rosbag2 import StoragePlugin, Writer
        except ImportError:
            raise FileProblem(NO_EXTRA) from None

        self.form = form
        self.log_ns = 0
        self._folder = folder
        self._store = typestore(form)
        with room_in(folder):
            self._home = Path(mkdtemp(".part", ".frametool.", folder or None))
            bag = self._home / NAME
            made = Writer1(bag) if form == BAG1 else Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer: Any = made
            self._writer.open()
            self._file = (bag if form == BAG1 else bag / f"{NAME}.mcap").open("rb")
        self._discard = finalize(self, _discarded, self._writer, self._file, self._home)
        with suppress(OSError):  # Windows does not let go of the name of an open file
            rmtree(self._home)

    def channel(self, kind: Kind, topic: str = "") -> Any:
        """Begin a topic, the usual one of its kind unless told, and return what `write` takes."""
        topic = topic or kind.topic
        if self.form == BAG1:
            return self._writer.add_connection(topic, kind.type, typestore=self._store, latching=int(kind.stays))
        profiles = [latched()] if kind.stays else []
        return self._writer.add_connection(topic, kind.type, typestore=self._store, offered_qos_profiles=profiles)

    def write(self, channel: Any, stamp_ns: int, message: bytes | memoryview) -> None:
        """Write one message; what comes late is logged with the one before."""
        self.log_ns = max(self.log_ns, stamp_ns)
        try:
            self._writer.write(channel, self.log_ns, message)
        except OSError as error:
            raise _named(error, self._folder) from None

    def pieces(self) -> Iterator[bytes]:
        """End the recording and yield its bytes; of a folder file after file, each begun by a FirstPiece."""
        bag = self._home / NAME
        with room_in(self._folder):
            bag.mkdir(parents=True, exist_ok=True)
            self._writer.close()
            metadata = b"" if self.form == BAG1 else (bag / METADATA).read_bytes()
        rmtree(self._home, ignore_errors=True)
        piece = self._file.read(PIECE)
        if self.form == BAG2:
            yield FirstPiece(metadata, METADATA)
            piece = FirstPiece(piece, f"{NAME}.mcap")
        while piece:
            yield piece
            piece = self._file.read(PIECE)
        self._discard()


def _discarded(writer: Any, file: IO[bytes], folder: Path) -> None:
    """Close what was opened for a recording, and remove what is left of it."""
    writer.abort()
    file.close()
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


@lru_cache
def typestore(form: str) -> Any:
    """Return the types of messages that a form of recording is written with."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if form == BAG1 else Stores.ROS2_HUMBLE)
    if KINDS["tf"].type not in store.types:  # the library's Noetic has only tf/tfMessage
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", KINDS["tf"].type))
    return store


def latched() -> Any:
    """Return what a topic offers that is there for who comes late."""
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    for_ever = QosTime(9223372036, 854775807)
    return Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, for_ever, for_ever,
               QosLiveliness.AUTOMATIC, for_ever, avoid_ros_namespace_conventions=False)  # fmt: skip


def check_stamps(stamps_ns: Ints, form: str) -> None:
    """Raise ValueInvalid for a stamp whose seconds a message cannot hold."""
    first, last = SECONDS.get(form, SECONDS_ROS2)
    seconds = stamps_ns // BILLION
    bad = stamps_ns[(seconds < first) | (seconds > last)]
    if len(bad):
        stamp = format_stamp(int(bad[0]))
        raise ValueInvalid(f"stamp {stamp} has no place in {form}, whose seconds are {first} .. {last}")


def tree_pieces(tree: Frames, style: Style) -> Iterator[bytes]:
    """Yield the bytes of a recording of a tree: what stands in one message, what moves in one for each stamp."""
    form, asked = style.form, style.recording
    topics = {"tf_static": any(track.is_static for track in tree.tracks()), "tf": tree.moves}
    if asked.topic and all(topics.values()):
        raise ValueInvalid(f"the tree stands and moves, on two topics; {asked.topic} names one")
    if not any(topics.values()):
        raise ValueInvalid(f"{form} holds transforms, and there is none in the tree")
    file = RecordingFile(form, asked.folder)
    moving = merge(*(_samples(track, style) for track in tree.tracks() if not track.is_static), key=itemgetter(0))
    messages = ((stamp, [*rows]) for stamp, rows in groupby(moving, itemgetter(0)))
    first = next(messages, None)
    if topics["tf_static"]:
        still = [row for track in tree.tracks() if track.is_static for row in _samples(track, style)]
        data = serialised(KINDS["tf_static"], form, *_columns(still))
        file.write(file.channel(KINDS["tf_static"], asked.topic), 0 if first is None else first[0], data)
    if first is not None:
        channel = file.channel(KINDS["tf"], asked.topic)
        for stamp, rows in chain([first], messages):
            check_stamps(np.array([stamp]), form)
            file.write(channel, stamp, serialised(KINDS["tf"], form, *_columns(rows)))
    yield from file.pieces()


Sample: TypeAlias = "tuple[int, tuple[str, str], Components]"


def _samples(track: Track, style: Style) -> Iterator[Sample]:
    """Yield the samples of a frame as stamp, (parent, child) and pose; what stands has the stamp 0."""
    for stamp_ns, parent, (tx, ty, tz, x, y, z, w) in track.walk():
        turn = (x, y, z, w) if style.keep_sign else quaternion.from_quaternion(x, y, z, w, floats)
        yield stamp_ns or 0, (parent, track.child), tuple(part + 0.0 for part in (tx, ty, tz, *turn))


def _columns(samples: Sequence[Sample]) -> Iterator[Any]:
    """Return frames, stamps and poses of samples."""
    return zip(*((frames, stamp, pose) for stamp, frames, pose in samples), strict=True)


class MessageTemplate:
    """The bytes of a message about one frame, and where its stamp and numbers stand in them."""

    def __init__(self, kind: Kind, form: str, parent: str, child: str = "") -> None:
        """Serialise one with numbers that nothing else in it is; raises ValueInvalid for names that are no text."""
        numbers = [_PROBE * (at + 1) for at in range(kind.numbers)]
        self.bytes = serialised(kind, form, [(parent, child)], [_PROBE_NS], [numbers])
        self.stamp_at = self.bytes.index(struct.pack("<II", *divmod(_PROBE_NS, BILLION)))
        self.numbers_at = self.bytes.index(struct.pack(f"<{kind.numbers}d", *numbers))

    def filled(self, stamps_ns: Ints, numbers: Floats) -> list[bytes]:
        """Return a message for each of stamps (n,) and numbers (n, k)."""
        count, size = len(stamps_ns), len(self.bytes)
        rows = np.tile(np.frombuffer(self.bytes, np.uint8), (count, 1))
        times = np.column_stack(np.divmod(stamps_ns, BILLION)).astype("<u4")  # seconds before 1970 wrap, as int32 does
        for at, part in ((self.stamp_at, times), (self.numbers_at, np.ascontiguousarray(numbers, "<f8"))):
            own = part.view(np.uint8)
            rows[:, at : at + own.shape[1]] = own
        whole = rows.tobytes()
        return [whole[at : at + size] for at in range(0, count * size, size)]


_PROBE = 1.2345678912345e-67
_PROBE_NS = 1532698752_187654321


def serialised(
    kind: Kind, form: str, frames: Sequence[tuple[str, str]], stamps_ns: Sequence[int],
    numbers: Sequence[Sequence[float]],
) -> bytes:  # fmt: skip
    """Return one message; frames: (parent, child) of each of its transforms or poses.

    Raises ValueInvalid for names that are no text.
    """
    store = typestore(form)
    message = _message(store.types, kind, frames, [divmod(stamp, BILLION) for stamp in stamps_ns], numbers)
    try:
        return bytes((store.serialize_ros1 if form == BAG1 else store.serialize_cdr)(message, kind.type))
    except UnicodeEncodeError as error:
        raise ValueInvalid(f"{shown(error.object)} is no name that can be written") from None


def _message(
    types: Any, kind: Kind, frames: Sequence[tuple[str, str]], stamps: Sequence[tuple[int, int]],
    numbers: Sequence[Sequence[float]],
) -> Any:  # fmt: skip
    """Return one message of the library's types; stamps are seconds and nanoseconds."""

    def part(name: str, *values: Any) -> Any:
        return types[f"geometry_msgs/msg/{name}"](*values)

    def header(at: int) -> Any:
        make = types["std_msgs/msg/Header"]
        counter = (0,) if "seq" in make.__dataclass_fields__ else ()  # of ROS 1
        return make(*counter, types["builtin_interfaces/msg/Time"](*stamps[at]), frames[at][0])

    def pose(at: int) -> Any:
        own = numbers[at]
        return part("PoseStamped", header(at), part("Pose", part("Point", *own[:3]), part("Quaternion", *own[3:])))

    def transform(at: int) -> Any:
        own = numbers[at]
        moved = part("Transform", part("Vector3", *own[:3]), part("Quaternion", *own[3:]))
        return part("TransformStamped", header(at), frames[at][1], moved)

    each, make = range(len(frames)), types[kind.type]
    if kind.type == KINDS["tf"].type:
        return make([transform(at) for at in each])
    if kind == KINDS["path"]:
        return make(header(len(frames) - 1), [pose(at) for at in each])
    if kind == KINDS["pose"]:
        return pose(0)
    if kind == KINDS["point"]:
        return make(header(0), part("Point", *numbers[0]))
    fixed_by_gps = types["sensor_msgs/msg/NavSatStatus"](0, 1)
    return make(header(0), fixed_by_gps, *numbers[0], np.zeros(9), 0)  # covariance not known
