"""A recording copied with something changed: messages are bytes, and all that nobody asked to change stays as it is.

It is read twice: first to see what there is and whether it is whole, then to be written.  No messages are kept.
"""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from frametool.documents.yaml_writer import dump
from frametool.errors import FileProblem, FormatError
from frametool.ros import bag1_chunks, mcap_chunks
from frametool.ros.bag1_chunks import Bag1File, Bag1Writer
from frametool.ros.bag2_folder import INFORMATION, DatabaseFile, files_of, metadata_of, read_metadata
from frametool.ros.bags import broken, check_files, refuse_empty
from frametool.ros.mcap_chunks import ChannelRegistry, McapFile, McapWriter, built, mapping, sized, texts_of
from frametool.ros.message_chunks import Channel, Chunk, OtherRecord, zstd
from frametool.ros.recordings import BAG1, BAG2, METADATA, NAME, NO_EXTRA, PIECE, FirstPiece, room_in

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from frametool.grammar.edges import Tally
    from frametool.ros.bag1_chunks import Connection
    from frametool.ros.record_changes import RecordChanges

    Advance = Callable[[int, int], None]  # takes how many messages and bytes were read

FILE = f"{NAME}.mcap"  # in a folder
SELF, SERIALIZED = sized(b"rosbag2"), "serialized_metadata"  # the metadata that rosbag2 puts into a file, of itself


class CopiedRecording:
    """A recording that is to be copied: its channels by their numbers, and its chunks as often as they are asked for.

    metadata: of a folder
    registry: the schemas and channels of the copy; of a ROS 1 bag it has connections instead
    undefined: types of messages that it does not define, and whether ROS 2 Humble does
    """

    def __init__(self, path: str, form: str, files: Sequence[Path], metadata: dict[str, Any]) -> None:
        """Take the files of a recording; `opened_recording` finds them."""
        self.path, self.form, self.files, self.metadata = path, form, files, metadata
        self.registry = ChannelRegistry()
        self.connections: dict[int, Connection] = {}
        self.head = b""
        self.undefined: dict[str, bool] = {}
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
        return {number: self.registry.channel(number)[0] for number in self.registry.channels}

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
            return DatabaseFile(file, self.registry, self.undefined)
        if storage != "mcap":
            raise ValueError(f"storage {storage!r} is not known")
        return McapFile(file, self.registry)

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
    refuse_empty(path)
    try:
        import rosbags.highlevel  # noqa: F401 - its types, and what unpacks chunks, come with it
    except ImportError:
        raise FileProblem(f"{path}: {NO_EXTRA}") from None

    files, metadata = [Path(path)], {}
    with ExitStack() as opened:
        with broken(path):
            check_files(path, tally)
            if Path(path).is_dir():
                text = (Path(path) / METADATA).read_text(encoding="utf-8")
                metadata = read_metadata(text, f"{path}/{METADATA}")
                files = files_of(Path(path), metadata, opened)
            made = CopiedRecording(path, form, files, metadata)
        yield made


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
        writer = McapWriter(recording.registry, recording.head)
        first = writer.begin()
        yield FirstPiece(first, FILE) if form == BAG2 else first
        yield writer.chunk(_chunk_of(added, first_ns, mcap_chunks.message), None)
        itself = []
        for piece in recording.pieces():
            if isinstance(piece, Chunk):
                yield writer.chunk(piece, changes.apply(piece))
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
    with room_in(folder), TemporaryFile(dir=folder or None) as file:
        file.write(writer.begin())
        file.write(writer.chunk(_chunk_of(added, first_ns, bag1_chunks.message), None))
        for piece in recording.pieces():
            if isinstance(piece, Chunk):
                file.write(writer.chunk(piece, changes.apply(piece)))
                advance(len(piece.entries), len(piece.stored or piece.raw))
        index, first = writer.end()
        file.write(index)
        file.seek(0)
        file.write(first)
        file.seek(0)
        while data := file.read(PIECE):
            yield data
