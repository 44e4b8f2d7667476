"""The files of ROS 2 bags as rosbags reads them, but for what is foreign in them: that is passed over, not refused.

The library refuses a whole file in functions that its methods call: those methods are taken over with other functions
in their place, so that the library stays as it is.
"""

from __future__ import annotations

from types import FunctionType
from typing import TYPE_CHECKING, Any

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from rosbags.rosbag2 import reader as folders
from rosbags.rosbag2 import storage_mcap
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

if TYPE_CHECKING:
    from collections.abc import Callable

KNOWN_SCHEMAS = ("ros2msg", "ros2idl", "omgidl", "")


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


STORAGES = {"": _Folder, ".mcap": _Mcap, ".db3": _Sqlite}  # by the ending of the name
