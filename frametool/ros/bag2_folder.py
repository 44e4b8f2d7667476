"""ROS 2 bags beside MCAP files: sqlite3 files as chunks of MCAP, and metadata.yaml of folders, read and written."""

from __future__ import annotations

import re
import shutil
from contextlib import closing
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_documents
from frametool.documents.source import Verbatim
from frametool.documents.yaml_writer import dump
from frametool.errors import FormatError, ValueInvalid
from frametool.ros.mcap_chunks import MESSAGE_HEAD, mapping, message_head, sized
from frametool.ros.message_chunks import FULL, Chunk, zstd
from frametool.ros.recordings import BAG2, METADATA, latched, typestore

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import ExitStack

    from frametool.ros.mcap_chunks import ChannelRegistry, McapWriter
    from frametool.ros.message_chunks import Entry

INFORMATION = "rosbag2_bagfile_information"
QOS, HASH = "offered_qos_profiles", "topic_type_hash"  # what rosbag2 says of a channel of MCAP
VERSION, VERSION_OF_NUMBERS = 9, 8  # of metadata: the newest, and the last that says policies by numbers


def latched_qos(*, by_numbers: bool) -> str:
    """Return the quality of service of a latched topic, as channels have it."""
    from rosbags.rosbag2.metadata import dump_qos_v8, dump_qos_v9

    return str(dump_qos_v8([latched()])) if by_numbers else dump(dump_qos_v9([latched()]))


def says_by_numbers(qos: str) -> bool:
    """Tell whether policies are numbers, as rosbag2 wrote them before version 9."""
    return re.search(r"\bhistory: *\d", qos) is not None


def read_metadata(text: str, name: str) -> dict[str, Any]:
    """Read metadata, of a folder or as it stands in an MCAP file; every value in it is text.

    Raises ValueError for what is no YAML.
    """
    try:
        documents = parse_documents(text, name)
    except FormatError as error:
        raise ValueError(str(error)) from None
    for document in documents:
        if type(document.value) is dict:
            found = document.value.get(INFORMATION, document.value)
            return found if type(found) is dict else {}
    return {}


def files_of(folder: Path, metadata: dict[str, Any], opened: ExitStack) -> list[Path]:
    """Return the files of a bag in their order; those compressed as a whole are unpacked, as long as it is opened."""
    found = [folder / PurePath(name).name for name in metadata["relative_file_paths"]]
    if metadata.get("compression_mode", "").lower() != "file":
        return found
    home, unpacked = Path(opened.enter_context(TemporaryDirectory(prefix="frametool."))), []
    for path in found:
        unpacked.append(home / path.stem)
        with zstd().open(path, "rb") as packed, unpacked[-1].open("wb") as plain:
            shutil.copyfileobj(packed, plain)
    return unpacked


class DatabaseFile:
    """A sqlite3 file of rosbag2, read as chunks of an MCAP file; each table says what its version has."""

    head = sized(b"ros2") + sized(b"frametool")
    expected: int | None = None

    def __init__(self, path: Path, registry: ChannelRegistry, undefined: dict[str, bool]) -> None:
        """Begin before the first message; the registry is that of the copy.

        undefined: takes the types that it does not define, and whether ROS 2 Humble does
        """
        self.path, self.registry, self.undefined = path, registry, undefined

    def pieces(self) -> Iterator[Chunk]:
        """Yield chunks, in the order of log times.

        Raises ValueError and others for what is broken: whoever asks says where.
        """
        from sqlite3 import Row, connect

        with closing(connect(f"{self.path.absolute().as_uri()}?mode=ro", uri=True)) as database:
            database.row_factory = Row
            tables = {each[0] for each in database.execute("SELECT name FROM sqlite_master")}
            listed = [dict(each) for each in database.execute("SELECT * FROM message_definitions")] if (
                "message_definitions" in tables
            ) else []  # fmt: skip
            definitions = {each["topic_type"]: each for each in listed}
            channels = {
                each["id"]: self._channel(dict(each), definitions)
                for each in database.execute("SELECT * FROM topics ORDER BY id")
            }
            database.row_factory = None
            rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id")
            records: list[bytes] = []
            entries: list[Entry] = []
            size = 0
            for topic, log_ns, data in rows:
                channel = channels[topic]
                start, end = size + MESSAGE_HEAD, size + MESSAGE_HEAD + len(data)
                records += message_head(channel, log_ns, len(data)), data
                entries.append((channel, log_ns, size, start, end))
                size = end
                if size > FULL:
                    yield Chunk(b"".join(records), entries)
                    records, entries, size = [], [], 0
            if entries:
                yield Chunk(b"".join(records), entries)

    def _channel(self, topic: dict[str, Any], definitions: dict[str, dict[str, Any]]) -> int:
        """Return the number of a topic in the copy."""
        kind = topic["type"]
        defined = definitions.get(kind) or self._defined(kind)
        encoding, text = str(defined["encoding"]), str(defined["encoded_message_definition"])
        schema = self.registry.add_schema(None, b"".join(sized(each.encode()) for each in (kind, encoding, text)))
        said = {QOS: topic.get(QOS) or "", HASH: topic.get("type_description_hash") or ""}
        said = {key: value for key, value in said.items() if value or key == QOS}
        named = (sized(str(topic[name]).encode()) for name in ("name", "serialization_format"))
        return self.registry.add_channel(None, schema, b"".join((*named, mapping(said))))

    def _defined(self, kind: str) -> dict[str, str]:
        """Return the definition of a type that the file does not define: that of ROS 2 Humble, or none."""
        store = typestore(BAG2)
        text = store.generate_msgdef(kind, ros_version=2)[0] if kind in store.types else ""
        self.undefined[kind] = bool(text)
        return {"encoding": "ros2msg" if text else "", "encoded_message_definition": text}


def metadata_of(writer: McapWriter, before: dict[str, Any], file: str) -> dict[str, Any]:
    """Return the metadata of a file that was written, with what it said before of where it comes from."""
    first, last = writer.span or (0, 0)
    topics: dict[tuple[Any, ...], dict[str, Any]] = {}
    listed = (each["topic_metadata"] for each in before.get("topics_with_message_count") or ())
    hashes = {(each["name"], each["type"]): each.get("type_description_hash") for each in listed}
    by_numbers = False
    for number in sorted(writer.registry.channels):
        channel, schema, said = writer.registry.channel(number)
        qos = said.get(QOS, "")
        by_numbers |= says_by_numbers(qos)
        told = said.get(HASH) or hashes.get((channel.topic, channel.type)) or type_hash(*writer.registry.schema(schema))
        about = {"name": channel.topic, "type": channel.type, "serialization_format": channel.encoding,
                 QOS: qos, "type_description_hash": told}  # fmt: skip
        row = topics.setdefault((*about.values(),), {"topic_metadata": about, "message_count": 0})
        row["message_count"] += writer.counts.get(number, 0)
    version = VERSION_OF_NUMBERS if by_numbers else VERSION
    for row in topics.values() if version == VERSION else ():
        row["topic_metadata"][QOS] = _profiles(row["topic_metadata"][QOS], row["topic_metadata"]["name"])
    count = sum(writer.counts.values())
    times = {"duration": {"nanoseconds": last - first}, "starting_time": {"nanoseconds_since_epoch": first}}
    return {
        "version": version, "storage_identifier": "mcap", **times, "message_count": count,
        "topics_with_message_count": list(topics.values()), "compression_format": "", "compression_mode": "",
        "relative_file_paths": [file], "files": [{"path": file, **times, "message_count": count}],
        "custom_data": before.get("custom_data"), "ros_distro": before.get("ros_distro") or "",
    }  # fmt: skip


def _profiles(qos: str, topic: str) -> Any:
    """Return the profiles of a topic as a list."""
    try:
        found = parse_documents(qos, METADATA)
    except FormatError as error:
        raise ValueInvalid(f"what {topic} offers ({QOS}) cannot be read: {error.message}") from None
    return _plain(found[0].value) if found else []


def _plain(value: Any) -> Any:
    """Return a value with its numbers and truth values as they were written."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return Verbatim(value) if re.fullmatch(r"-?\d+|true|false", value or "") else value


def type_hash(name: str, encoding: str, definition: str) -> str:
    """Return the hash by which ROS 2 knows a type; "" for a definition that cannot be read."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    if encoding != "ros2msg":
        return ""
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(get_types_from_msg(definition, name))
        return str(store.hash_rihs01(name))
    except Exception:  # noqa: BLE001 - of a definition that is broken the library raises anything
        return ""
