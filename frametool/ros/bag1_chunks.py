"""ROS 1 bags chunk by chunk, read and written: the headers of connections are kept as they are.

Layout of records: https://wiki.ros.org/Bags/Format/2.0.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, BinaryIO, TypeAlias

from frametool.frames.stamps import BILLION
from frametool.ros.message_chunks import Channel, Chunk, packed, unpacked

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from frametool.ros.message_chunks import Entry

Fields: TypeAlias = dict[bytes, bytes]  # of a header
Connection: TypeAlias = tuple[Fields, Fields]  # the header of its record, and its data, which are a header too
MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION = range(2, 8)
FIRST_RECORD = 4096  # bytes, so that it can be written again at the end
_UINT, _TIME = struct.Struct("<I"), struct.Struct("<II")
_CUT = "a record ends behind the file"


def record(fields: Mapping[bytes, bytes], data: bytes = b"") -> bytes:
    """Return a record of a header and data."""
    head = header(fields)
    return b"".join((_uint(len(head)), head, _uint(len(data)), data))


def header(fields: Mapping[bytes, bytes]) -> bytes:
    """Return the fields of a header."""
    return b"".join(_uint(len(name) + 1 + len(value)) + name + b"=" + value for name, value in fields.items())


def _uint(number: int) -> bytes:
    return struct.pack("<I", number)


def fields_of(head: bytes) -> Fields:
    """Read a header; raises ValueError where a field ends behind it."""
    found = {}
    at = 0
    while at < len(head):
        (size,) = struct.unpack_from("<I", head, at)
        at += 4 + size
        name, joint, value = head[at - size : at].partition(b"=")
        if at > len(head) or not joint:
            raise ValueError(_CUT)
        found[name] = value
    return found


def number_of(value: bytes) -> int:
    """Read an unsigned integer."""
    return int.from_bytes(value, "little")


def time_bytes(time_ns: int) -> bytes:
    """Write a time."""
    return struct.pack("<II", *divmod(time_ns, BILLION))


def channel_of(connection: Connection) -> Channel:
    """Return what a connection is of."""
    head, said = connection
    package, _, name = said[b"type"].decode().rpartition("/")
    return Channel(head[b"topic"].decode(), f"{package}/msg/{name}", "ros1")


def connection(number: int, topic: str, said: Fields) -> Connection:
    """Return a new one with a number."""
    return {b"op": bytes([CONNECTION]), b"conn": _uint(number), b"topic": topic.encode()}, said


def _read(stream: BinaryIO, end: int) -> bytes:
    """Read a header or data, and its length in front."""
    size = number_of(stream.read(4))
    if stream.tell() + size > end:
        raise ValueError(_CUT)
    return stream.read(size)


class MessageHead:
    """What stands before the data of a message: the same fields in all of a file, nearly always in the same order."""

    def __init__(self, raw: bytes) -> None:
        """Learn the layout from a message: its header, with the length before it and that of the data behind it."""
        self.size = len(raw)
        places: dict[bytes, int] = {}
        at = 4
        while at < len(raw) - 4:
            (size,) = struct.unpack_from("<I", raw, at)
            name, _, value = raw[at + 4 : at + 4 + size].partition(b"=")
            at += 4 + size
            places[name] = at - len(value)
        self._number, self._time = (places[b"conn"], places[b"time"]) if raw else (0, 0)
        values = sorted(((self._number, 4), (self._time, 8), (self.size - 4, 4)))
        ends = [0, *(begin + size for begin, size in values)]
        fixed = [(end, begin, raw[end:begin]) for end, (begin, _) in zip(ends, values, strict=False)]
        self._fixed = fixed if raw else [(0, 1, b"")]  # which nothing is

    def read(self, raw: bytes, at: int) -> tuple[int, int, int, int] | None:
        """Return connection, time and where the data begin and end; None for another record."""
        for begin, end, text in self._fixed:
            if raw[at + begin : at + end] != text:
                return None
        (number,) = _UINT.unpack_from(raw, at + self._number)
        seconds, nanoseconds = _TIME.unpack_from(raw, at + self._time)
        start = at + self.size
        return number, seconds * BILLION + nanoseconds, start, start + _UINT.unpack_from(raw, start - 4)[0]


class Bag1File:
    """A bag, read from its beginning to its end; expected: how many messages there are."""

    head = b""  # of MCAP files

    def __init__(self, path: Path, connections: dict[int, Connection]) -> None:
        """Begin before the first record; connections are added to those of the copy."""
        self.path, self.connections = path, connections
        self.expected = 0
        self._head = MessageHead(b"")

    def pieces(self) -> Iterator[Chunk]:
        """Yield chunks in their order.

        Raises ValueError and others for what is broken: whoever asks says where.
        """
        with self.path.open("rb") as stream:
            yield from self._pieces(stream)

    def _pieces(self, stream: BinaryIO) -> Iterator[Chunk]:
        counted: dict[int, int] = {}
        end = stream.seek(0, 2)
        stream.seek(0)
        if stream.read(len(MAGIC)) != MAGIC:
            raise ValueError("it does not begin as bags of version 2.0 do")
        at, total, index = len(MAGIC), -1, end
        while at < end:
            head, data = _read(stream, end), _read(stream, end)
            fields = fields_of(head)
            kind = number_of(fields[b"op"])
            if kind == BAG:
                if fields.get(b"encryptor"):
                    raise ValueError("it is encrypted")
                index, total = number_of(fields[b"index_pos"]), number_of(fields[b"chunk_count"])
                if not index:
                    raise ValueError("it was not closed; `rosbag reindex` mends it")
            elif kind == CHUNK:
                raw = unpacked(data, compression := fields[b"compression"].decode(), number_of(fields[b"size"]))
                counted[at] = len(entries := self._entries(raw))
                yield Chunk(raw, entries, compression, data)
            elif kind == CONNECTION:
                number = self._connection(fields, data)
                self.connections[number] = self.connections.pop(number)  # in the order of the index
            elif kind == CHUNK_INFO:
                counts = struct.unpack(f"<{len(data) // 4}I", data)[1::2]
                self.expected += sum(counts)
                if counted.get(number_of(fields[b"chunk_pos"])) != sum(counts):
                    raise ValueError("a chunk is not what its index says")
                total -= 1
            elif kind != INDEX:
                raise ValueError(f"it has a record of the kind {kind}")
            at += 8 + len(head) + len(data)
        if total or index > end:
            raise ValueError(_CUT)

    def _connection(self, fields: Fields, data: bytes) -> int:
        """Register a connection and return its number."""
        said = fields_of(data)
        if b"type" not in said or b"topic" not in fields:
            raise ValueError("a connection without topic or type")
        number = number_of(fields[b"conn"])
        self.connections.setdefault(number, (fields, said))
        channel_of((fields, said))  # raises for one that cannot be read
        return number

    def _entries(self, raw: bytes) -> list[Entry]:
        """Find the messages in a chunk."""
        entries: list[Entry] = []
        at, end = 0, len(raw)
        while at < end:
            found = self._head.read(raw, at) if at + self._head.size <= end else None
            if found is None:
                behind = self._other(raw, at)
                if behind == at:  # a message, whose head is known now
                    continue
            else:
                number, time_ns, start, behind = found
                if number not in self.connections:
                    raise ValueError(f"a message of connection {number}, which is not there")
                entries.append((number, time_ns, at, start, behind))
            at = behind
        if at > end:
            raise ValueError(_CUT)
        return entries

    def _other(self, raw: bytes, at: int) -> int:
        """Register a connection and return where its record ends; at a message learn the layout of its head."""
        (size,) = struct.unpack_from("<I", raw, at)
        start = at + 8 + size
        fields = fields_of(raw[at + 4 : start - 4])
        kind = fields[b"op"][0]
        if kind == MESSAGE:
            self._head = MessageHead(raw[at:start])
            return at
        (length,) = struct.unpack_from("<I", raw, start - 4)
        if kind == CONNECTION:
            self._connection(fields, raw[start : start + length])
        return int(start + length)


class Bag1Writer:
    """A bag that is written piece by piece; its first bytes are only known at the end."""

    def __init__(self, connections: Mapping[int, Connection]) -> None:
        """Begin; connections: by their numbers."""
        self.connections = connections
        self.counts: dict[int, int] = dict.fromkeys(connections, 0)
        self.size = 0
        self._infos: list[bytes] = []

    def begin(self, index: int = 0) -> bytes:
        """Return the first bytes, where the index begins behind so many; `end` says that."""
        totals = {b"conn_count": _uint(len(self.connections)), b"chunk_count": _uint(len(self._infos))}
        head = header({b"op": bytes([BAG]), b"index_pos": struct.pack("<Q", index), **totals})
        fill = b" " * (FIRST_RECORD - 8 - len(head))
        return self._counted(MAGIC, _uint(len(head)), head, _uint(len(fill)), fill)

    def _counted(self, *pieces: bytes) -> bytes:
        """Join pieces and count their bytes."""
        made = b"".join(pieces)
        self.size += len(made)
        return made

    def chunk(self, chunk: Chunk, changed: Sequence[tuple[Entry, bytes | None]] | None) -> bytes:
        """Return a chunk with its index, as it was or with some of its messages.

        changed: these messages, with their data where it is new
        """
        raw, data, entries = chunk.raw, chunk.stored, chunk.entries
        if changed is not None or data is None:
            raw, entries = self._built(raw, [(each, None) for each in entries] if changed is None else changed)
            data = packed(raw, chunk.compression)
        if not entries:
            return b""
        compression = chunk.compression.encode() or b"none"
        head = {b"op": bytes([CHUNK]), b"compression": compression, b"size": _uint(len(raw))}
        return self._indexed(record(head, data), entries)

    def _built(self, raw: bytes, changed: Sequence[tuple[Entry, bytes | None]]) -> tuple[bytes, list[Entry]]:
        """Return the records of messages, behind those of their connections, and where each is now."""
        pieces = [self._connection(number) for number in dict.fromkeys(entry[0] for entry, _ in changed)]
        entries, at = [], sum(map(len, pieces))
        for (number, time_ns, begin, start, end), data in changed:
            piece = raw[begin:end] if data is None else raw[begin : start - 4] + _uint(len(data)) + data
            pieces.append(piece)
            entries.append((number, time_ns, at, 0, 0))
            at += len(piece)
        return b"".join(pieces), entries

    def _connection(self, number: int) -> bytes:
        fields, said = self.connections[number]
        return record(fields, header(said))

    def _indexed(self, made: bytes, entries: Sequence[Entry]) -> bytes:
        """Return a chunk with the index of its messages."""
        places: dict[int, list[bytes]] = {}
        for number, time_ns, at, _, _ in entries:
            places.setdefault(number, []).append(time_bytes(time_ns) + _uint(at))
        times = [entry[1] for entry in entries]
        head = {b"op": bytes([CHUNK_INFO]), b"ver": _uint(1), b"chunk_pos": struct.pack("<Q", self.size)}
        head |= {b"start_time": time_bytes(min(times)), b"end_time": time_bytes(max(times))}
        head |= {b"count": _uint(len(places))}
        self._infos.append(record(head, b"".join(_uint(each) + _uint(len(places[each])) for each in places)))
        pieces = [made]
        for number, each in places.items():
            self.counts[number] = self.counts.get(number, 0) + len(each)
            head = {b"op": bytes([INDEX]), b"ver": _uint(1), b"conn": _uint(number), b"count": _uint(len(each))}
            pieces.append(record(head, b"".join(each)))
        return self._counted(*pieces)

    def end(self) -> tuple[bytes, bytes]:
        """Return the index, and the first bytes as they are to be."""
        index = self.size
        made = self._counted(*map(self._connection, self.connections), *self._infos)
        return made, self.begin(index)


def message(number: int, time_ns: int, data: bytes) -> bytes:
    """Return the record of a message."""
    return record({b"op": bytes([MESSAGE]), b"conn": _uint(number), b"time": time_bytes(time_ns)}, data)
