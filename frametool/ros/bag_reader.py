"""The reader of rosbags, for which only the types have to be known whose messages are read."""

from __future__ import annotations

from types import FunctionType
from typing import TYPE_CHECKING, Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat, Nodetype
from rosbags.rosbag2 import Reader, storage_mcap
from rosbags.rosbag2 import reader as folders
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
from rosbags.typesys import get_types_from_idl, get_types_from_msg

from frametool.ros.recordings import BAG1, BAG2, typestore

if TYPE_CHECKING:
    from collections.abc import Callable

BETWEEN_IDL = "=" * 80 + "\nIDL: "  # before the name of each file
CDR = "cdr"
KNOWN_SCHEMAS = ("ros2msg", "ros2idl", "omgidl", "")
TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
SECONDS_ROS1 = {TIMES[0]: "uint32", TIMES[1]: "int32"}  # wiki.ros.org/msg; the library has int32 for both


class BagReader(AnyReader):
    """Read messages of a bag; their types are those it defines, or the usual ones where it defines none.

    foreign: topics whose messages are no CDR, and how they are encoded; they are no connections
    """

    def __init__(self, paths: Any) -> None:
        """Choose what reads the files; only opened can it be read."""
        super().__init__(paths)
        self.foreign: dict[str, str] = {}
        for reader in self.readers:
            if isinstance(reader, Reader):
                path = reader.path
                own: Any = _Folder if path.is_dir() else STORAGES.get(path.suffix)
                if own is not None:
                    reader.storage = own(path)

    def _open(self) -> None:
        """Open without a look at the types: one that cannot be read is in the way of its own messages only."""
        assert self.stack  # noqa: S101 - for the types
        for reader in self.readers:
            self.stack.enter_context(reader)
        found = [connection for reader in self.readers for connection in reader.connections]
        encodings = [getattr(each.ext, "serialization_format", CDR) for each in found]
        for each, encoding in zip(found, encodings, strict=True):
            f"{each.topic} {each.msgtype} {encoding}".encode()  # raises where it was no text
        self.foreign = {each.topic: how for each, how in zip(found, encodings, strict=True) if how != CDR}
        self.connections = [each for each, how in zip(found, encodings, strict=True) if how == CDR]
        if not self.is2:
            self._take_times_of_ros1()

    def _take_times_of_ros1(self) -> None:
        """Let stamps of ROS 1 go on until 2106: their seconds have no sign."""
        for name in TIMES:
            code = SECONDS_ROS1[name]
            fields: Any = [("sec", (Nodetype.BASE, (code, 0))), ("nanosec", (Nodetype.BASE, ("uint32", 0)))]
            self.typestore.fielddefs[name] = ([], fields)

    def deserialize(self, rawdata: bytes, typ: str) -> Any:
        """Return a message."""
        if typ not in self.typestore.types:
            self._learn(typ)
        return super().deserialize(rawdata, typ)

    def _learn(self, kind: str) -> None:
        """Find out what messages of a type hold; raises ValueError where that is not what their hash says."""
        found: dict[str, Any] = {}
        digests: set[str] = set()
        for connection in self.connections:
            text, form = connection.msgdef.data, connection.msgdef.format
            if connection.msgtype != kind or form == MessageDefinitionFormat.NONE:
                continue
            digests |= {connection.digest} - {""}
            if form == MessageDefinitionFormat.MSG:
                found |= get_types_from_msg(text, kind)
                continue
            for each in text.split(BETWEEN_IDL)[1:] or [f"\n{text}"]:
                found |= get_types_from_idl(each.partition("\n")[2])
        known = self.typestore
        found = found or typestore(BAG2 if self.is2 else BAG1).fielddefs
        known.register({name: each for name, each in found.items() if name not in known.types})
        for digest in digests:
            made = known.hash_rihs01(kind) if self.is2 else known.generate_msgdef(kind)[1]
            if made != digest:
                raise ValueError(f"hash of {kind} is {made}, not {digest}")


# The library refuses a whole file for what is foreign in it, in functions that its methods call: those methods are
# taken over with other functions in their place, so that its own stay as they are.


def _with(method: Any, **others: Callable[..., Any]) -> Any:
    """Return a method of the library that calls other functions than the library's."""
    return FunctionType(method.__code__, {**method.__globals__, **others}, method.__name__, method.__defaults__)


def _definition(schema: Any) -> MessageDefinition:
    """Return what a schema defines; nothing where it is not one of ROS 2 (JSON Schema, Protobuf, ..)."""
    if schema is None or schema.encoding not in KNOWN_SCHEMAS:
        return MessageDefinition(MessageDefinitionFormat.NONE, "")
    return storage_mcap.get_msgdef(schema)


def _text(stream: Any) -> str:
    """Read a text; the definitions of Protobuf are none and read as what they are not."""
    return storage_mcap.read_bytes(stream).decode(errors="surrogateescape")


def _no_qos(_said: Any) -> list[Any]:
    """Return no quality of service: it says nothing of messages that are recorded, and may be written anyhow."""
    return []


class _Mcap(McapReader):
    """Read MCAP beside whose messages there are foreign ones."""

    read_index = _with(McapReader.read_index, get_msgdef=_definition, get_qos=_no_qos, read_string=_text)
    meta_scan = _with(McapReader.meta_scan, get_msgdef=_definition, get_qos=_no_qos, read_string=_text)


class _Sqlite(Sqlite3Reader):
    """Read a database of rosbag2."""

    _open = _with(Sqlite3Reader._open, parse_qos=_no_qos)  # noqa: SLF001 - it is the library's


class _Folder(folders.DirectoryReader):
    """Read a folder of rosbag2."""

    STORAGE_PLUGINS = {"mcap": _Mcap, "sqlite3": _Sqlite}  # noqa: RUF012 - as the library has it
    open = _with(folders.DirectoryReader.open, parse_qos=_no_qos)


STORAGES = {".mcap": _Mcap, ".db3": _Sqlite}
