"""The reader of rosbags, for which only the types have to be known whose messages are read."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import MessageDefinitionFormat, Nodetype
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_types_from_idl, get_types_from_msg

from frametool.ros.recordings import BAG1, BAG2, typestore

STORAGES: dict[str, Any] = {}
with suppress(ImportError, AttributeError):  # another version of the library is another one inside
    from frametool.ros.bag_storages import STORAGES

BETWEEN_IDL = "=" * 80 + "\nIDL: "  # before the name of each file
CDR = "cdr"
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
                own = STORAGES.get("" if reader.path.is_dir() else reader.path.suffix)
                reader.storage = reader.storage if own is None else own(reader.path)

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
