"""A recording copied with something changed: messages are bytes, and all that nobody asked to change stays as it is.

It is read twice: first for what there is and whether it is whole, then to be written.  No messages are kept.
"""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import TYPE_CHECKING, Any

from frametool.documents.yaml_writer import dump
from frametool.errors import FileProblem, FormatError
from frametool.ros import bag1_chunks, mcap_chunks
from frametool.ros.bag1_chunks import Bag1File, Bag1Writer
from frametool.ros.bag2_folder import (
    INFORMATION,
    QOS,
    DatabaseFile,
    files_of,
    latched_qos,
    metadata_of,
    read_metadata,
    says_by_numbers,
)
from frametool.ros.bags import TYPES, broken, check_files
from frametool.ros.chunks import NO_EXTRA, Channel, Chunk, OtherRecord, zstd
from frametool.ros.mcap_chunks import McapFile, McapWriter, Schemas, built, mapping, sized, texts_of
from frametool.ros.recordings import BAG1, BAG2, KINDS, METADATA, NAME, PIECE, FirstPiece, serialised, typestore

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from frametool.grammar.edges import Tally
    from frametool.ros.bag1_chunks import Connection
    from frametool.ros.chunks import Entry
    from frametool.ros.recorded_edges import AddedEdge

    Advance = Callable[[int, int], None]  # takes how many messages and bytes were read
    Change = Callable[[bytes, int], bytes | None]  # of a message and its log time; None leaves it out

FILE = f"{NAME}.mcap"  # in a folder
SELF, SERIALIZED = sized(b"rosbag2"), "serialized_metadata"  # the metadata that rosbag2 puts into a file, of itself
STATIC = KINDS["tf_static"]


class CopiedRecording:
    """A recording that is to be copied: its channels by their numbers, and its chunks as often as they are asked for.

    metadata: of a folder
    known: of all but ROS 1 bags, the schemas and channels of the copy; connections: of a ROS 1 bag, those of the copy
    untold: types of messages that it does not define
    """

    def __init__(self, path: str, form: str, files: Sequence[Path], metadata: dict[str, Any]) -> None:
        """Take the files of a recording; `opened_recording` finds them."""
        self.path, self.form, self.files, self.metadata = path, form, files, metadata
        self.known = Schemas()
        self.connections: dict[int, Connection] = {}
        self.head = b""
        self.untold: set[str] = set()
        self.size = sum(file.stat().st_size for file in files)

    @property
    def is_ros1(self) -> bool:
        """Tell whether it is a ROS 1 bag."""
        return self.form == BAG1

    @property
    def channels(self) -> dict[int, Channel]:
        """Return the channels by their numbers, once all was read."""
        if self.is_ros1:
            return {number: bag1_chunks.channel_of(each) for number, each in self.connections.items()}
        return {number: self.known.channel(number)[0] for number in self.known.channels}

    def pieces(self) -> Iterator[Chunk | OtherRecord]:
        """Yield chunks and other records in their order; raises FormatError for a recording that is not whole."""
        total, said = 0, self.metadata.get("message_count")
        with broken(self.path):
            for file in self.files:
                source, count = self._source(file), 0
                for piece in source.pieces():
                    if isinstance(piece, Chunk):
                        count += len(piece.entries)
                        yield self._inflated(piece)
                    else:
                        yield piece
                self.head = self.head or source.head
                self._check(count, source.expected)
                total += count
            self._check(total, None if said is None else int(said))

    def messages(self, types: Collection[str]) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield channel, log time and data of the messages of some types."""
        channels: dict[int, Channel] = {}
        for piece in self.pieces():
            if not isinstance(piece, Chunk):
                continue
            for number, log_ns, _, start, end in piece.entries:
                if number not in channels:
                    channels = self.channels
                if channels[number].type in types:
                    yield channels[number], log_ns, piece.raw[start:end]

    def _check(self, count: int, expected: int | None) -> None:
        """Raise FormatError unless as many messages are there as are said to be."""
        if expected not in (None, count):
            raise FormatError(f"the bag is damaged: {count} of {expected} messages are there", source=self.path)

    def _source(self, file: Path) -> Bag1File | DatabaseFile | McapFile:
        if self.is_ros1:
            return Bag1File(file, self.connections)
        storage = self.metadata.get("storage_identifier") or ("sqlite3" if self.form == BAG2 else "mcap")
        if storage == "sqlite3":
            return DatabaseFile(file, self.known, self.untold)
        if storage != "mcap":
            raise ValueError(f"storage {storage!r} is not known")
        return McapFile(file, self.known)

    def _inflated(self, chunk: Chunk) -> Chunk:
        """Unpack the messages of a folder in which each is packed by itself."""
        if self.metadata.get("compression_mode", "").lower() != "message":
            return chunk
        unpack = zstd().decompress
        raw, entries = built(chunk.raw, ((each, unpack(chunk.raw[each[3] : each[4]])) for each in chunk.entries))
        return Chunk(raw, entries, chunk.compression)


@contextmanager
def opened_recording(path: str, form: str, tally: Tally) -> Iterator[CopiedRecording]:
    """Open a recording to copy it; raises FileProblem without the extra, FormatError for one that is broken."""
    try:
        import rosbags.highlevel  # noqa: F401 - its types, and what unpacks chunks, come with it
    except ImportError:
        raise FileProblem(f"{path}: {NO_EXTRA}") from None

    with TemporaryDirectory(prefix="frametool.") as home:
        files, metadata = [Path(path)], {}
        with broken(path):
            check_files(path, tally)
            if Path(path).is_dir():
                text = (Path(path) / METADATA).read_text(encoding="utf-8")
                metadata = read_metadata(text, f"{path}/{METADATA}")
                files = files_of(Path(path), metadata, Path(home))
            made = CopiedRecording(path, form, files, metadata)
        yield made


class RecordChanges:
    """What becomes of the messages of a recording, by the numbers of their channels.

    window: the first and the last log time of those that are left; kept: channels of which all are
    change: what becomes of the messages of a channel
    """

    def __init__(self, window: tuple[int, int] | None = None) -> None:
        """Begin with nothing but a window."""
        self.window = window
        self.kept: set[int] = set()
        self.change: dict[int, Change] = {}

    def of(self, chunk: Chunk) -> list[tuple[Entry, bytes | None]] | None:
        """Return the messages that are left of a chunk, with their data where these are new; None: all of it."""
        if self.window is None and not any(entry[0] in self.change for entry in chunk.entries):
            return None
        entries = [entry for entry in chunk.entries if self.takes(entry)]
        left: list[tuple[Entry, bytes | None]] = []
        is_other = len(entries) < len(chunk.entries)
        for entry in entries:
            change = self.change.get(entry[0])
            if change is None:
                left.append((entry, None))
                continue
            data = chunk.raw[entry[3] : entry[4]]
            new = change(data, entry[1])
            is_other |= new is not data
            if new is not None:
                left.append((entry, None if new is data else new))
        return left if is_other else None

    def takes(self, entry: Entry) -> bool:
        """Tell whether a message is left by its log time."""
        return self.window is None or self.window[0] <= entry[1] <= self.window[1] or entry[0] in self.kept


class RecordContents:
    """What is found in a recording when it is read first.

    counts: of messages, by the numbers of their channels; span: the first and the last log time
    inside, outside: how many are in the window, and are left outside of it; first_ns: the first log time that is left
    """

    def __init__(self, recording: CopiedRecording, changes: RecordChanges) -> None:
        """Begin before the first chunk."""
        self.recording, self.changes = recording, changes
        self.counts: Counter[int] = Counter()
        self.span: tuple[int, int] | None = None
        self.inside = self.outside = 0
        self.first_ns: int | None = None

    def read(self, advance: Advance, see: Callable[[Channel, bytes], None] | None = None) -> None:
        """Read it all; raises FormatError for what is not whole.

        see: takes every message of transforms, with its channel
        """
        channels: dict[int, Channel] = {}
        for piece in self.recording.pieces():
            if not isinstance(piece, Chunk) or not piece.entries:
                continue
            counted = Counter(entry[0] for entry in piece.entries)
            if not counted.keys() <= channels.keys():
                channels = self.recording.channels
                self.changes.kept = {number for number, each in channels.items() if each.is_static}
            self.counts += counted
            self._time(piece)
            if see is not None and any(channels[number].type in TYPES for number in counted):
                for number, _, _, start, end in piece.entries:
                    if channels[number].type in TYPES:
                        see(channels[number], piece.raw[start:end])
            advance(len(piece.entries), len(piece.stored or piece.raw))

    def _time(self, chunk: Chunk) -> None:
        """Take the log times of a chunk in."""
        times = [entry[1] for entry in chunk.entries]
        first, last = self.span or (times[0], times[0])
        self.span = min(first, *times), max(last, *times)
        window = self.changes.window
        if window is not None:
            inside = sum(window[0] <= each <= window[1] for each in times)
            times = [entry[1] for entry in chunk.entries if self.changes.takes(entry)]
            self.inside += inside
            self.outside += len(times) - inside
        if times:
            self.first_ns = min(times) if self.first_ns is None else min(self.first_ns, *times)


def added_messages(
    recording: CopiedRecording, edges: dict[str, list[AddedEdge]], stamp_ns: int
) -> list[tuple[int, bytes]]:
    """Return a message of edges for each topic, with the number of the channel it is written on."""
    form = BAG1 if recording.is_ros1 else BAG2
    made = []
    for topic, each in edges.items():
        frames = [(edge.parent, edge.child) for edge in each]
        data = serialised(STATIC, form, frames, [stamp_ns] * len(each), [edge.numbers for edge in each])
        channel = _latched_connection if recording.is_ros1 else _latched_channel
        made.append((channel(recording, topic), data))
    return made


def _latched_channel(recording: CopiedRecording, topic: str) -> int:
    """Return the number of a channel of transforms for good: that of the recording, or a new one."""
    known = recording.known
    qos = [known.channel(number)[2].get(QOS, "") for number in known.channels]
    for number, channel in recording.channels.items():
        if (channel.topic, channel.type, channel.encoding) == (topic, STATIC.type, "cdr"):
            return number
    definition, _ = typestore(BAG2).generate_msgdef(STATIC.type, ros_version=2)
    kind = b"".join(sized(each.encode()) for each in (STATIC.type, "ros2msg", definition))
    named = [number for number, body in known.schemas.items() if body.startswith(sized(STATIC.type.encode()))]
    schema = named[0] if named else known.add_schema(None, kind)
    said = mapping({QOS: latched_qos(by_numbers=any(map(says_by_numbers, qos)))})
    body = b"".join((sized(topic.encode()), sized(b"cdr"), said))
    return known.add_channel(None, schema, body)


def _latched_connection(recording: CopiedRecording, topic: str) -> int:
    """Return the number of a new latched connection, for whoever plays it keeps the last message of each."""
    known = recording.connections
    found = [said for head, said in known.values() if head[b"topic"].decode() == topic]
    definition, digest = typestore(BAG1).generate_msgdef(STATIC.type)
    said = found[0] if found else {
        b"type": STATIC.type.replace("/msg/", "/").encode(), b"md5sum": digest.encode(),
        b"message_definition": definition.encode(),
    }  # fmt: skip
    said = {name: each for name, each in said.items() if name != b"callerid"}
    number = max(known, default=-1) + 1
    made = bag1_chunks.connection(number, topic, {**said, b"topic": topic.encode(), b"latching": b"1"})
    recording.connections = {number: made, **known}  # first, so that its messages come first among those of one time
    return number


def copied(
    recording: CopiedRecording, changes: RecordChanges, added: Sequence[tuple[int, bytes]], first_ns: int, form: str,
    folder: str, advance: Advance,
) -> Iterator[bytes]:  # fmt: skip
    """Yield the bytes of a copy in a form, what is added first, at the first log time.

    folder: where there is room for it while it is written; advance: takes how much was read
    """
    if form == BAG1:
        yield from _bag(recording, changes, added, first_ns, folder, advance)
        return
    with broken(recording.path):
        writer = McapWriter(recording.known, recording.head)
        first = writer.begin()
        yield FirstPiece(first, FILE) if form == BAG2 else first
        yield writer.chunk(_chunk_of(added, first_ns, mcap_chunks.message), None)
        itself = []
        for piece in recording.pieces():
            if isinstance(piece, Chunk):
                yield writer.chunk(piece, changes.of(piece))
                advance(len(piece.entries), len(piece.stored or piece.raw))
            elif piece.kind == mcap_chunks.METADATA and piece.body.startswith(SELF):
                itself.append(piece)
            else:
                yield writer.other(piece)
        said = texts_of(itself[0].body[len(SELF) + 4 :]).get(SERIALIZED, "") if itself else ""
        before = recording.metadata or read_metadata(said, recording.path)
        metadata = metadata_of(writer, before, FILE) if itself or form == BAG2 else {}
        if len(itself) == 1 and before.get("message_count") == str(metadata["message_count"]):
            yield writer.other(itself[0])
        elif itself:
            made = SELF + mapping({SERIALIZED: dump(metadata)})
            yield writer.other(OtherRecord(mcap_chunks.METADATA, made))
        yield writer.end()
        if form == BAG2:
            yield FirstPiece(dump({INFORMATION: metadata}).encode(), METADATA)


def _chunk_of(messages: Sequence[tuple[int, bytes]], log_ns: int, record: Callable[[int, int, bytes], bytes]) -> Chunk:
    """Return a chunk of messages that are all logged at one time."""
    raw, entries = b"", []
    for channel, data in messages:
        made = record(channel, log_ns, data)
        entries.append((channel, log_ns, len(raw), len(raw) + len(made) - len(data), len(raw) + len(made)))
        raw += made
    return Chunk(raw, entries)


def _bag(
    recording: CopiedRecording, changes: RecordChanges, added: Sequence[tuple[int, bytes]], first_ns: int, folder: str,
    advance: Advance,
) -> Iterator[bytes]:  # fmt: skip
    """Yield the bytes of a ROS 1 bag, whose first ones are known last."""
    writer = Bag1Writer(recording.connections)
    with TemporaryFile(dir=folder or None) as file:
        file.write(writer.begin())
        file.write(writer.chunk(_chunk_of(added, first_ns, bag1_chunks.message), None))
        for piece in recording.pieces():
            if isinstance(piece, Chunk):
                file.write(writer.chunk(piece, changes.of(piece)))
                advance(len(piece.entries), len(piece.stored or piece.raw))
        index, first = writer.end()
        file.write(index)
        file.seek(0)
        file.write(first)
        file.seek(0)
        while data := file.read(PIECE):
            yield data
