"""The reader of rosbags, for which only the types have to be known whose messages are read."""

from __future__ import annotations

from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.typesys import get_types_from_idl, get_types_from_msg

from frametool.ros.recordings import BAG1, BAG2, typestore

BETWEEN_IDL = "=" * 80 + "\nIDL: "  # before the name of each file


class BagReader(AnyReader):
    """Read messages of a bag; their types are those it defines, or the usual ones where it defines none."""

    def _open(self) -> None:
        """Open without a look at the types: one that cannot be read is in the way of its own messages only."""
        assert self.stack  # noqa: S101 - for the types
        for reader in self.readers:
            self.stack.enter_context(reader)
        self.connections = [connection for reader in self.readers for connection in reader.connections]

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
