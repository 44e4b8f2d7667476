"""Read recordings: ROS 1 bags with rosbags, MCAP files with mcap, databases with sqlite3; the extra `frametool[bag]`.

Messages are bytes, in the order of their log times; `MessageTypes` converts them to objects of rosbags.
"""

from __future__ import annotations

import shutil
from bisect import bisect_left
from collections import Counter
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from io import BytesIO
from itertools import chain
from operator import attrgetter, itemgetter
from pathlib import Path, PurePath
from struct import Struct
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import parse_documents
from frametool.errors import FileProblem, FormatError, FrametoolError, ValueInvalid

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from frametool.grammar.edges import Diagnostics

BAG1, BAG2, MCAP = "bag1", "bag2", "mcap"
CDR = "cdr"
METADATA, INFORMATION = "metadata.yaml", "rosbag2_bagfile_information"
ITSELF, SERIALIZED = "rosbag2", "serialized_metadata"  # metadata of rosbag2 in an MCAP file, about the file
QOS, HASH = "offered_qos_profiles", "topic_type_hash"  # metadata of rosbag2 about a channel of MCAP
MOST = 1 << 28  # bytes of a chunk: a larger one is not unpacked
LOST = "SELECT count(*) FROM messages WHERE topic_id NOT IN (SELECT id FROM topics)"
NO_SUMMARY = "{} has no summary: whether it lost messages cannot be known"
RECORD_HEAD = 9  # bytes of a record's header
RECORD, MESSAGE = Struct("<BQ"), Struct("<HIQQ")  # the header of a record, and of a message in it (mcap.dev/spec)
BLOCK = 1 << 10  # messages of a block
TF = "tf2_msgs/msg/TFMessage"
MANY = 4000  # messages of a block in order of time


@dataclass(eq=False, slots=True)
class Channel:
    """The common properties of the messages of one publisher.

    topic, type: as ROS 2 writes them, `/pose` and `geometry_msgs/msg/PoseStamped`
    encoding: of its messages, `cdr`, `ros1`, or another
    schema: name, encoding and text of the definition of its type, as in MCAP, if there is one
    metadata: quality of service in ROS 2, callerid and latching in ROS 1
    digest: the hash of the type
    """

    topic: str
    type: str
    encoding: str = CDR
    schema: tuple[str, str, bytes] | None = None
    metadata: dict[str, str] = field(default_factory=dict)
    digest: str = ""

    @property
    def is_static(self) -> bool:
        """Return True for a topic of static transforms."""
        return self.topic.rpartition("/")[2] == "tf_static"


class Recorded(NamedTuple):
    """A message as recorded; times are nanoseconds."""

    channel: Channel
    log_ns: int
    data: bytes
    publish_ns: int = 0
    sequence: int = 0


class McapFile:
    """An MCAP file.

    channels: id -> channel; compression: of its chunks
    stated: channel id -> number of messages, total: of all; None if the file does not state it
    """

    def __init__(self, path: Path, opened: ExitStack, tally: Diagnostics) -> None:
        """Read its summary, or the whole file if the summary is incomplete."""
        from mcap.reader import SeekingReader

        self.stream = opened.enter_context(path.open("rb"))
        self._schemas: dict[int, tuple[str, str, bytes]] = {}
        self.channels: dict[int, Channel] = {}
        reader = SeekingReader(self.stream)
        self.head, summary = reader.get_header(), reader.get_summary()
        statistics, chunks = (summary.statistics, summary.chunk_indexes) if summary else (None, [])
        if statistics is None:
            tally.note(NO_SUMMARY.format(path.name), 1)
        self.statistics, self.total = statistics, statistics.message_count if statistics else None
        self.stated = (statistics.channel_message_counts if statistics else None) or None  # an empty map states nothing
        self._chunks = chunks if statistics and statistics.chunk_count == len(chunks) else []
        self.compression = self._chunks[0].compression if self._chunks else ""
        if summary and statistics and statistics.channel_count == len(summary.channels):
            self._register(*summary.schemas.values(), *summary.channels.values())
        else:
            for _ in self.found(set()):
                pass

    def others(self) -> Iterator[Any]:
        """Yield its attachments and metadata, as records of mcap."""
        from mcap.records import Attachment, Metadata

        if self.statistics is None or self.statistics.attachment_count or self.statistics.metadata_count:
            yield from (each for each in self._all() if isinstance(each, Attachment | Metadata))

    def _all(self) -> Iterator[Any]:
        """Yield all records in the order of the file."""
        from mcap.stream_reader import StreamReader

        self.stream.seek(0)
        yield from StreamReader(self.stream, emit_chunks=True).records

    def _records(self, numbers: set[int]) -> Iterator[Any]:
        """Yield the chunks with messages on some channels, or all records if there is no index of chunks."""
        from mcap.data_stream import ReadDataStream
        from mcap.records import Chunk

        if not self._chunks:
            yield from self._all()
        for each in sorted(self._chunks, key=lambda each: each.message_start_time):
            if not numbers.isdisjoint(each.message_index_offsets) or not each.message_index_offsets:
                self.stream.seek(each.chunk_start_offset + RECORD_HEAD)
                yield Chunk.read(ReadDataStream(self.stream))

    def found(self, numbers: set[int]) -> Iterator[list[Recorded]]:
        """Yield the messages on some channels, by their ids, in blocks; register schemas and channels."""
        from mcap import records

        found: list[Recorded] = []
        for each in self._records(numbers):
            if isinstance(each, records.Chunk):
                self._take(each, numbers, found)
            elif isinstance(each, records.Message):
                channel = self.channels[each.channel_id]
                if each.channel_id in numbers:
                    found.append(Recorded(channel, each.log_time, each.data, each.publish_time, each.sequence))
            elif isinstance(each, records.Schema | records.Channel):
                self._register(each)
            if isinstance(each, records.Chunk) or len(found) > BLOCK:
                yield found
                found = []
        yield found

    def _take(self, chunk: Any, numbers: set[int], found: list[Recorded]) -> None:
        """Append the messages on some channels that are in a chunk to `found`; register schemas and channels.

        Raises ValueError for a chunk that is too large, before it is unpacked.
        """
        import zstandard
        from mcap import records
        from mcap.data_stream import ReadDataStream
        from mcap.opcode import Opcode
        from mcap.stream_reader import get_chunk_data_stream

        size = chunk.uncompressed_size
        if chunk.compression == "zstd" and size <= MOST:
            size = max(size, zstandard.frame_content_size(chunk.data))  # the memory needed to unpack it
        if size > MOST:
            raise ValueError(f"a chunk of {size} bytes; {MOST} are read")
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        data, end, message = bytes(stream.read(length)), 0, Opcode.MESSAGE.value
        while end < len(data):
            code, size = RECORD.unpack_from(data, end)
            begin, end = end + RECORD_HEAD, end + RECORD_HEAD + size
            if end > len(data):
                raise ValueError("a record is longer than its chunk")
            if code == message:
                number, sequence, log_ns, publish_ns = MESSAGE.unpack_from(data, begin)
                channel = self.channels[number]
                if number in numbers:
                    found.append(Recorded(channel, log_ns, data[begin + MESSAGE.size : end], publish_ns, sequence))
            elif code in (Opcode.SCHEMA, Opcode.CHANNEL):
                kind = records.Schema if code == Opcode.SCHEMA else records.Channel
                self._register(kind.read(ReadDataStream(BytesIO(data[begin:end]))))

    def _register(self, *records: Any) -> None:
        """Register schemas and channels that are not known yet."""
        for each in records:
            if hasattr(each, "data"):
                self._schemas.setdefault(each.id, (each.name, each.encoding, each.data))
            elif each.id not in self.channels:
                schema = self._schemas[each.schema_id] if each.schema_id else None
                name = schema[0] if schema else ""
                if each.message_encoding == "ros1" and "/msg/" not in name:
                    name = name.replace("/", "/msg/")
                digest = each.metadata.get(HASH, "")
                made = Channel(each.topic, name, each.message_encoding, schema, each.metadata, digest)
                self.channels[each.id] = made


def _in_order(chunks: Iterable[list[Recorded]]) -> Iterator[list[Recorded]]:
    """Yield the messages of chunks in the order of log times, in blocks; chunks that overlap are merged.

    chunks: none is empty.  If reading fails, the messages before the error are yielded first.
    """
    time, ready, held = itemgetter(1), list[Recorded](), list[Recorded]()
    try:
        for found in chunks:
            found.sort(key=time)
            at = bisect_left(held, found[0].log_ns, key=time)
            ready += held[:at]
            held = sorted([*held[at:], *found], key=time) if at < len(held) else found
            if len(ready) >= MANY:
                yield ready
                ready = []
    except Exception:
        yield ready + held
        raise
    yield ready + held


class DatabaseFile:
    """A sqlite3 file of rosbag2; the contents of its tables depend on its version."""

    head, compression, stated, total, others = None, "", None, None, tuple  # it has no attachments or metadata

    def __init__(self, path: Path, opened: ExitStack, _tally: Diagnostics) -> None:
        """Check the file with sqlite3, because rows on a broken page would be missing silently, and read its topics."""
        from sqlite3 import Row, connect

        self.database = connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)
        opened.callback(self.database.close)
        ((answer,),) = self.database.execute("PRAGMA quick_check(1)").fetchall()
        ((lost,),) = self.database.execute(LOST).fetchall() if answer == "ok" else [[0]]
        if answer != "ok" or lost:
            problem = f"{lost} messages belong to no topic" if lost else " ".join(answer.split())[:100]
            raise FormatError(f"the bag is damaged: {problem}", source=str(path))
        rows = self.database.cursor()
        rows.row_factory = Row
        has = "SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'"
        listed = rows.execute("SELECT * FROM message_definitions").fetchall() if rows.execute(has).fetchone() else []
        defined = {each["topic_type"]: (each["encoding"], each["encoded_message_definition"]) for each in listed}
        self.channels = {}
        for topic in map(dict, rows.execute("SELECT * FROM topics ORDER BY id").fetchall()):
            kind, digest = topic["type"], topic.get("type_description_hash") or ""
            metadata = {QOS: topic.get(QOS) or ""} | ({HASH: digest} if digest else {})
            schema = (kind, defined[kind][0], defined[kind][1].encode()) if kind in defined else None
            made = Channel(topic["name"], kind, topic["serialization_format"], schema, metadata, digest)
            self.channels[topic["id"]] = made

    def found(self, numbers: set[int]) -> Iterator[list[Recorded]]:
        """Yield the messages on some channels, by their ids, in blocks."""
        some = ",".join(map(str, numbers))
        some = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({some}) ORDER BY timestamp, id"  # noqa: S608 - numbers
        rows = self.database.execute(some)
        while block := rows.fetchmany(BLOCK):
            yield [Recorded(self.channels[number], log_ns, data, log_ns) for number, log_ns, data in block]


class Bag1File:
    """A ROS 1 bag; chunks are read whole, without the index of their messages."""

    head, compression, others = None, "", tuple  # it has no attachments or metadata

    def __init__(self, path: Path, opened: ExitStack, _tally: Diagnostics) -> None:
        """Read the index of connections and chunks at the end of the file."""
        from rosbags.rosbag1.reader import Reader

        class Unindexed(Reader):
            def read_index_data(self, pos: int, indexes: Any) -> None:
                """Do nothing."""

        self.reader: Any = opened.enter_context(Unindexed(path))
        self.channels = {}
        for each in self.reader.connections:
            about = {name: str(value) for name, value in each.ext._asdict().items() if value is not None}
            schema = each.msgtype, "ros1msg", each.msgdef.data.encode()
            self.channels[each.id] = Channel(each.topic, each.msgtype, "ros1", schema, about, each.digest)
        self.stated = sum((Counter(each.connection_counts) for each in self.reader.chunk_infos), Counter[int]())
        self.total = self.stated.total()

    def found(self, numbers: set[int]) -> Iterator[list[Recorded]]:
        """Yield the messages on some channels, by their ids, chunk by chunk."""
        from rosbags.rosbag1.reader import Header, RecordType, read_bytes, read_uint32

        infos = (each for each in self.reader.chunk_infos if not numbers.isdisjoint(each.connection_counts))
        for each in sorted(infos, key=attrgetter("start_time")):
            about = self.reader.chunks[each.pos]
            self.reader.bio.seek(about.datapos)
            found: list[Recorded] = []
            try:
                chunk = about.decompressor(self.reader.bio.read(about.datasize))
                records = BytesIO(chunk)
                while records.tell() < len(chunk):
                    header = Header.read(records)
                    data = read_bytes(records, read_uint32(records))
                    is_message = header.get_uint8("op") != RecordType.CONNECTION
                    if is_message and (number := header.get_uint32("conn")) in numbers:
                        log_ns = header.get_time("time")
                        found.append(Recorded(self.channels[number], log_ns, data, log_ns))
            finally:
                yield found


@lru_cache
def typestore(*, ros1: bool) -> Any:
    """Return the message types of ROS 1 Noetic or ROS 2 Humble."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    if TF not in store.types:  # the library's Noetic has only tf/tfMessage
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", TF))
    return store


class MessageTypes:
    """The types of some channels: as defined in the recording, or the usual ones if it does not define them."""

    def __init__(self, channels: Sequence[Channel], *, ros1: bool) -> None:
        """Create an empty set; types are learned when needed: an unreadable one affects only its own messages."""
        from rosbags.interfaces import Nodetype
        from rosbags.typesys import Stores, get_typestore

        self.channels, self.ros1 = channels, ros1
        self.layouts: dict[tuple[Channel, int], list[Any]] = {}  # channel and length of messages -> learned layouts
        self.store: Any = get_typestore(Stores.EMPTY)
        if ros1:  # seconds of ROS 1 are unsigned (wiki.ros.org/msg); the library has int32
            parts: Any = [(name, (Nodetype.BASE, ("uint32", 0))) for name in ("sec", "nanosec")]
            self.store.fielddefs["builtin_interfaces/msg/Time"] = [], parts

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
        from rosbags.typesys import get_types_from_msg

        found: dict[str, Any] = {}
        digests: set[str] = set()
        for each in self.channels:
            _, fmt, definition = each.schema or ("", "", b"")
            if each.type == kind and fmt in ("ros1msg", "ros2msg"):
                digests |= {each.digest} - {""}
                found |= get_types_from_msg(definition.decode(), kind)
        self._register(found)
        try:
            self.store.generate_msgdef(kind)
        except Exception:  # noqa: BLE001 - of a type that is not there, or has parts that are not
            self._register(typestore(ros1=self.ros1).fielddefs)
        for digest in digests:
            made = self.store.generate_msgdef(kind)[1] if self.ros1 else self.store.hash_rihs01(kind)
            if made != digest:
                raise TypeError(f"hash of {kind} is {made}, not {digest}")

    def _register(self, types: dict[str, Any]) -> None:
        """Register types that are not known yet."""
        self.store.register({name: each for name, each in types.items() if name not in self.store.types})


class RecordingReader:
    """An open recording.

    all: its channels, equal ones of several files merged; channels: those in the encoding of its ROS version
    metadata: of a folder, every value as text
    """

    def __init__(self, path: str, opened: ExitStack, tally: Diagnostics) -> None:
        """Open its files, which are closed by the stack."""
        self.path, self.metadata, files = path, dict[str, Any](), [Path(path)]
        if files[0].is_dir():
            self.metadata = read_metadata((files[0] / METADATA).read_text(encoding="utf-8"), f"{path}/{METADATA}")
            files = [files[0] / PurePath(name).name for name in self.metadata["relative_file_paths"]]
            if self.metadata.get("compression_mode", "").lower() == "file":  # unpacked while the recording is open
                import zstandard

                home, packed = Path(opened.enter_context(TemporaryDirectory(prefix="frametool."))), files
                files = [home / each.stem for each in packed]
                for whole, plain in zip(packed, files, strict=True):
                    with zstandard.open(whole, "rb") as source, plain.open("wb") as target:
                        shutil.copyfileobj(source, target)
        with files[0].open("rb") as first:
            self.is_ros1 = first.read(8) == b"#ROSBAG "
        self.files: list[Any] = []
        for file in files:
            storage = self.metadata.get("storage_identifier") or file.suffix.removeprefix(".")
            kind: Any = DatabaseFile if storage in ("sqlite3", "db3") else McapFile
            self.files.append((Bag1File if self.is_ros1 else kind)(file, opened, tally))
        self._is_packed = self.metadata.get("compression_mode", "").lower() == "message"
        known: dict[tuple[Any, ...], Channel] = {}
        for each in self.files:
            for number, one in each.channels.items():
                key = one.topic, one.type, one.encoding, one.schema, *one.metadata.items()
                each.channels[number] = known.setdefault(key, one)
        topics = self.metadata.get("topics_with_message_count") or ()
        self._topics = [{**each["topic_metadata"], "count": each["message_count"]} for each in topics]
        hashes = {(each["name"], each["type"]): each.get("type_description_hash", "") for each in self._topics}
        for channel in known.values():
            channel.digest = channel.digest or hashes.get((channel.topic, channel.type)) or ""
        encoding = "ros1" if self.is_ros1 else CDR
        self.all = [*known.values()]
        self.channels = [each for each in self.all if each.encoding == encoding]
        self.types = MessageTypes(self.channels, ros1=self.is_ros1)

    def messages(self, wanted: Collection[Channel] | None = None) -> Iterator[Recorded]:
        """Yield the messages on some channels, or on all; raises FormatError if messages are missing."""
        return chain.from_iterable(self.blocks(wanted))

    def blocks(self, wanted: Collection[Channel] | None = None) -> Iterator[Sequence[Recorded]]:
        """Yield the messages as `messages` does, in lists of varying length."""
        total, wanted = 0, None if wanted is None else {*wanted}
        for file in self.files:
            count, numbers = 0, {number for number, each in file.channels.items() if wanted is None or each in wanted}
            for block in _in_order(filter(None, file.found(numbers))):
                count += len(block)
                if self._is_packed:  # each message by itself
                    import zstandard

                    yield [each._replace(data=zstandard.open(BytesIO(each.data)).read(MOST)) for each in block]
                else:
                    yield block
            known = None if file.stated is None else sum(file.stated.get(number, 0) for number in numbers)
            self._check(wanted, count, known, file.total if wanted is None else None)  # total: also lost channels
            total += count
        named = {(each.topic, each.type) for each in wanted or ()}
        counts = [int(each["count"]) for each in self._topics if (each["name"], each["type"]) in named]
        stated = sum(counts) if counts else None
        self._check(wanted, total, self.metadata.get("message_count") if wanted is None else stated)

    def _check(self, wanted: Collection[Channel] | None, count: int, *stated: Any) -> None:
        """Raise FormatError unless the number of messages is as stated."""
        for expected in stated:
            if expected is not None and int(expected) != count:
                names = "" if wanted is None else f" on {', '.join(sorted({each.topic for each in wanted}))}"
                what = f"the bag is damaged: {count} of {expected} messages{names} are there"
                raise FormatError(what, source=self.path)

    def on_topics(self, types: Collection[str], topics: Collection[str] = ()) -> list[Channel]:
        """Return the channels of some types, on some topics, with or without a leading `/`, or on all."""
        named = {topic.strip("/") for topic in topics}
        return [each for each in self.channels if each.type in types and (not named or each.topic.strip("/") in named)]


def read_metadata(text: str, name: str) -> dict[str, Any]:
    """Parse rosbag2's metadata, of a folder or in an MCAP file; all values are text.

    Raises ValueError if they are not YAML.
    """
    try:
        documents = parse_documents(text, name)
    except FormatError as error:
        raise ValueError(str(error)) from None
    found = next((each.value for each in documents if type(each.value) is dict), {})
    return dict(found.get(INFORMATION, found))


@contextmanager
def opened_recording(path: str, tally: Diagnostics) -> Iterator[RecordingReader]:
    """Open a recording; any exception of the libraries for a broken one becomes a FormatError.

    Raises FileProblem without the extra.
    """
    if path != "-" and Path(path).is_file() and not Path(path).stat().st_size:
        raise FormatError("nothing in it: an empty file is not a bag", source=path)
    require_extra(f"{path}: bags are read")
    if path == "-":
        raise FileProblem("stdin: a bag cannot be read from a pipe; name its file")
    with broken(path), ExitStack() as opened:
        yield RecordingReader(path, opened, tally)


def require_extra(what: str) -> None:
    """Raise FileProblem if the libraries are not installed."""
    try:
        import mcap  # noqa: F401 - whether it is there
        import rosbags.typesys  # noqa: F401 - as well
    except ImportError:
        raise FileProblem(f"{what} with an extra; install it: pip install 'frametool[bag]'") from None


@contextmanager
def broken(path: str) -> Iterator[None]:
    """Convert any exception from reading a broken bag, even MemoryError, into a FormatError."""
    try:
        yield
    except (FrametoolError, BrokenPipeError):
        raise
    except Exception as error:  # noqa: BLE001 - see above
        why = f"{type(error).__name__}: {error}"[:100].replace("\n", " ")
        raise FormatError(f"the bag cannot be read; is it whole, and its suffix right? ({why})", source=path) from None
