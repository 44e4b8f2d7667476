"""What messages of a recording say: objects of rosbags, of the types that the recording defines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from frametool.errors import ValueInvalid
from frametool.recordings.made import typestore

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.recordings.read import Channel

BETWEEN_IDL = "=" * 80 + "\nIDL: "  # before the name of each file
TIMES = {"builtin_interfaces/msg/Time": "uint32", "builtin_interfaces/msg/Duration": "int32"}  # wiki.ros.org/msg


class MessageTypes:
    """The types of some channels: those the recording defines, or the usual ones where it defines none."""

    def __init__(self, channels: Sequence[Channel], *, ros1: bool) -> None:
        """Begin without any: one that cannot be read is in the way of its own messages only."""
        self.channels, self.ros1 = channels, ros1
        self.store: Any = get_typestore(Stores.EMPTY)
        for name, code in TIMES.items() if ros1 else ():  # the library has int32 for both
            fields: Any = [("sec", (Nodetype.BASE, (code, 0))), ("nanosec", (Nodetype.BASE, ("uint32", 0)))]
            self.store.fielddefs[name] = ([], fields)

    def read(self, channel: Channel, data: bytes) -> Any:
        """Return a message; raises ValueInvalid for bytes that are none."""
        if channel.type not in self.store.types:
            self._learn(channel.type)
        try:
            return (self.store.deserialize_ros1 if self.ros1 else self.store.deserialize_cdr)(data, channel.type)
        except Exception:  # noqa: BLE001 - of broken bytes the library raises anything
            raise ValueInvalid(f"its bytes are no {channel.type}") from None

    def write(self, channel: Channel, message: Any) -> bytes:
        """Return the bytes of a message that was read."""
        return bytes((self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr)(message, channel.type))

    def _learn(self, kind: str) -> None:
        """Find out what messages of a type hold; raises ValueError where that is not what their hash says."""
        found: dict[str, Any] = {}
        digests: set[str] = set()
        for each in self.channels:
            _, form, definition = each.schema or ("", "", b"")
            if each.type != kind or form not in ("ros1msg", "ros2msg", "ros2idl", "omgidl"):
                continue
            digests |= {each.digest} - {""}
            text = definition.decode()
            if form.endswith("msg"):
                found |= get_types_from_msg(text, kind)
                continue
            for part in text.split(BETWEEN_IDL)[1:] or [f"\n{text}"]:
                found |= get_types_from_idl(part.partition("\n")[2])
        known = self.store
        self._register(found)
        try:
            known.generate_msgdef(kind)
        except Exception:  # noqa: BLE001 - of a type that is not there, or has parts that are not
            self._register(typestore(ros1=self.ros1).fielddefs)
        for digest in digests:
            made = known.generate_msgdef(kind)[1] if self.ros1 else known.hash_rihs01(kind)
            if made != digest:
                raise ValueError(f"hash of {kind} is {made}, not {digest}")

    def _register(self, types: dict[str, Any]) -> None:
        """Take types that are not known yet."""
        self.store.register({name: each for name, each in types.items() if name not in self.store.types})
