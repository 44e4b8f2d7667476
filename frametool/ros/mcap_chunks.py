"""MCAP files chunk by chunk, read and written: every record is kept, of unknown kinds too.

Layout of records: https://mcap.dev/spec.  Schemas and channels keep their numbers; where several files are joined,
those of later files get others if theirs are taken.
"""

from __future__ import annotations

import struct
from itertools import chain
from typing import TYPE_CHECKING, BinaryIO, TypeVar
from zlib import crc32

from frametool.ros.message_chunks import FULL, Channel, Chunk, OtherRecord, packed, unpacked

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from frametool.ros.message_chunks import Entry

    Value = TypeVar("Value")

MAGIC = b"\x89MCAP0\r\n"
(
    HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX,
    STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END,
) = range(1, 16)  # fmt: skip
# kinds of records that are made anew
OURS = frozenset((MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX, SUMMARY_OFFSET, DATA_END))
_HEAD = struct.Struct("<BQ")  # of a record: its kind, how long it is
_MESSAGE = struct.Struct("<BQHIQQ")  # .. and of a message: its channel, number, log time and time of publication
MESSAGE_HEAD = _MESSAGE.size  # bytes before its data
_CHUNK = struct.Struct("<QQQI")  # first and last log time, size, checksum
_CUT = "a record ends behind the file"


def record(kind: int, *body: bytes) -> bytes:
    """Return a record."""
    return b"".join((_HEAD.pack(kind, sum(map(len, body))), *body))


def sized(data: bytes) -> bytes:
    """Return a text, a mapping or a list with its length in front."""
    return struct.pack("<I", len(data)) + data


def mapping(texts: Mapping[str, str]) -> bytes:
    """Return a mapping."""
    return sized(b"".join(sized(each.encode()) for pair in texts.items() for each in pair))


class _Reader:
    """Fields of a record, one after the other."""

    def __init__(self, body: bytes) -> None:
        self.body, self.at = body, 0

    def number(self, code: str) -> int:
        (found,) = struct.unpack_from(f"<{code}", self.body, self.at)
        self.at += struct.calcsize(f"<{code}")
        return int(found)

    def data(self) -> bytes:
        size = self.number("I")
        self.at += size
        if self.at > len(self.body):
            raise ValueError(_CUT)
        return self.body[self.at - size : self.at]

    def text(self) -> str:
        return self.data().decode()


def texts_of(data: bytes) -> dict[str, str]:
    """Read a mapping without its length."""
    fields, found = _Reader(data), {}
    while fields.at < len(data):
        key = fields.text()
        found[key] = fields.text()
    return found


class ChannelRegistry:
    """The schemas and channels of a copy by their numbers; equal ones of several files are one."""

    def __init__(self) -> None:
        """Begin without any."""
        self.schemas: dict[int, bytes] = {}
        self.channels: dict[int, tuple[int, bytes]] = {}  # number of the schema, and the rest of the record

    def add_schema(self, number: int | None, body: bytes) -> int:
        """Register a schema and return its number in the copy; body: name, encoding and data."""
        return 0 if number == 0 else _number_for(self.schemas, number, body)  # 0 is none

    def add_channel(self, number: int | None, schema: int, body: bytes) -> int:
        """Register a channel and return its number in the copy; body: topic, encoding and metadata."""
        return _number_for(self.channels, number, (schema, body))

    def schema(self, number: int) -> tuple[str, str, str]:
        """Return name, encoding and definition of a type."""
        fields = _Reader(self.schemas[number]) if number else _Reader(bytes(12))
        return fields.text(), fields.text(), fields.data().decode(errors="replace")

    def channel(self, number: int) -> tuple[Channel, int, dict[str, str]]:
        """Return a channel, the number of its schema, and its metadata."""
        schema, body = self.channels[number]
        fields = _Reader(body)
        topic, encoding = fields.text(), fields.text()
        name = self.schema(schema)[0]
        if "/" in name and "/msg/" not in name and encoding == "ros1":
            name = name.replace("/", "/msg/")
        return Channel(topic, name, encoding), schema, texts_of(fields.data())


def _number_for(known: dict[int, Value], number: int | None, value: Value) -> int:
    """Register a value under its own number if that is free, else under that of an equal one, or a new one."""
    if number is None or known.get(number, value) != value:
        number = next((other for other, each in known.items() if each == value), max(known, default=0) + 1)
    known[number] = value
    return number


def _records(stream: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield kind and body of each record of a file; raises ValueError for one that ends early."""
    end = stream.seek(0, 2)
    stream.seek(0)
    if stream.read(len(MAGIC)) != MAGIC:
        raise ValueError("it does not begin as MCAP does")
    kind = HEADER
    while kind != FOOTER:
        kind, size = _HEAD.unpack(stream.read(_HEAD.size))
        if stream.tell() + size > end:
            raise ValueError(_CUT)
        yield kind, stream.read(size)
    if stream.read(len(MAGIC)) != MAGIC:
        raise ValueError("it does not end as MCAP does")


class McapFile:
    """One file, read from its beginning to its end.

    head: the body of its first record; expected: how many messages there are, None where it does not say so
    """

    def __init__(self, path: Path, registry: ChannelRegistry) -> None:
        """Begin before the first record; the registry is that of the copy."""
        self.path, self.registry = path, registry
        self.head = b""
        self.expected: int | None = None
        self._schemas = {0: 0}  # numbers here -> numbers in the copy
        self._channels: dict[int, int] = {}
        self._loose: list[bytes] = []  # messages outside of chunks

    def pieces(self) -> Iterator[Chunk | OtherRecord]:
        """Yield chunks and other records in their order.

        Raises ValueError and others for what is broken: whoever asks says where.
        """
        with self.path.open("rb") as stream:
            yield from self._pieces(stream)

    def _pieces(self, stream: BinaryIO) -> Iterator[Chunk | OtherRecord]:
        loose = 0
        for kind, body in _records(stream):
            if kind == MESSAGE:
                self._loose.append(record(kind, body))
                loose += len(body)
            elif kind == CHUNK:
                yield from self._joined()
                yield self._chunk(body)
            elif kind == STATISTICS:
                self.expected = _Reader(body).number("Q")
            elif kind == HEADER:
                self.head = body
            elif kind not in OURS and not self._registers(kind, body):
                yield OtherRecord(kind, body)
            if loose > FULL or kind == FOOTER:
                loose = 0
                yield from self._joined()

    def _joined(self) -> Iterator[Chunk]:
        """Yield the messages outside of chunks as one."""
        raw = b"".join(self._loose)
        self._loose.clear()
        if raw:
            yield Chunk(raw, self._entries(raw), is_same=self._is_same)

    def _registers(self, kind: int, body: bytes) -> bool:
        """Register a schema or a channel; tell whether the record is done with."""
        if kind == SCHEMA:
            number = int.from_bytes(body[:2], "little")
            self._schemas[number] = self.registry.add_schema(number, body[2:])
        elif kind == CHANNEL:
            number, schema = struct.unpack_from("<HH", body)
            self._channels[number] = self.registry.add_channel(number, self._schemas[schema], body[4:])
            self.registry.channel(self._channels[number])  # raises for one that cannot be read
        return kind in (SCHEMA, CHANNEL, FOOTER)

    def _chunk(self, body: bytes) -> Chunk:
        """Take a chunk apart; raises ValueError if its checksum is another."""
        _, _, size, checksum = _CHUNK.unpack_from(body)
        fields = _Reader(body)
        fields.at = _CHUNK.size
        compression = fields.text()
        length = fields.number("Q")
        data = body[fields.at : fields.at + length]
        if len(data) != length:
            raise ValueError(_CUT)
        raw = unpacked(data, compression, size)
        if checksum and crc32(raw) != checksum:
            raise ValueError("a chunk's checksum is wrong")
        return Chunk(raw, self._entries(raw), compression, body, is_same=self._is_same)

    @property
    def _is_same(self) -> bool:
        """Tell whether all numbers so far are those of the copy."""
        return all(own == number for own, number in chain(self._schemas.items(), self._channels.items()))

    def _entries(self, raw: bytes) -> list[Entry]:
        """Find the messages in a chunk."""
        entries: list[Entry] = []
        at, end, channels, size = 0, len(raw), self._channels, _MESSAGE.size
        add, unpack = entries.append, _MESSAGE.unpack_from
        while at < end:
            if raw[at] == MESSAGE:
                _, length, channel, _, log_ns, _ = unpack(raw, at)
                behind = at + length + 9
                if behind < at + size:
                    raise ValueError("a message is shorter than its head")
                add((channels[channel], log_ns, at, at + size, behind))
            else:
                kind, length = _HEAD.unpack_from(raw, at)
                behind = at + length + 9
                self._registers(kind, raw[at + 9 : behind])
            at = behind
        if at > end:
            raise ValueError(_CUT)
        return entries


def message_head(channel: int, log_ns: int, size: int, sequence: int = 0, publish_ns: int | None = None) -> bytes:
    """Return what stands before the data of a message, of so many bytes."""
    published = log_ns if publish_ns is None else publish_ns
    return _MESSAGE.pack(MESSAGE, MESSAGE_HEAD - _HEAD.size + size, channel, sequence, log_ns, published)


def message(channel: int, log_ns: int, data: bytes) -> bytes:
    """Return the record of a message."""
    return message_head(channel, log_ns, len(data)) + data


def built(raw: bytes, changed: Iterable[tuple[Entry, bytes | None]]) -> tuple[bytes, list[Entry]]:
    """Return the records of some messages of a chunk, some of them with new data, and where each is now."""
    pieces: list[bytes] = []
    entries: list[Entry] = []
    at = 0
    for (channel, log_ns, begin, start, end), new in changed:
        _, _, own, sequence, _, publish_ns = _MESSAGE.unpack_from(raw, begin)
        if new is None and own == channel:
            piece = raw[begin:end]
        else:
            data = raw[start:end] if new is None else new
            piece = message_head(channel, log_ns, len(data), sequence, publish_ns) + data
        pieces.append(piece)
        behind = at + len(piece)
        entries.append((channel, log_ns, at, at + MESSAGE_HEAD, behind))
        at = behind
    return b"".join(pieces), entries


class McapWriter:
    """An MCAP file that is written piece by piece, with its summary at the end."""

    def __init__(self, registry: ChannelRegistry, head: bytes) -> None:
        """Begin; head: the body of the first record."""
        self.registry = registry
        self.counts: dict[int, int] = dict.fromkeys(registry.channels, 0)
        self.span: tuple[int, int] | None = None  # of log times
        self.size = 0
        self._head = head
        self._written: set[tuple[int, int]] = set()  # kinds and numbers of schemas and channels
        self._indexes: dict[int, list[bytes]] = {kind: [] for kind in (CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX)}

    def _counted(self, *pieces: bytes) -> bytes:
        """Join pieces and count their bytes."""
        made = b"".join(pieces)
        self.size += len(made)
        return made

    def begin(self) -> bytes:
        """Return the first bytes."""
        return self._counted(MAGIC, record(HEADER, self._head))

    def chunk(self, chunk: Chunk, changed: Sequence[tuple[Entry, bytes | None]] | None) -> bytes:
        """Return a chunk with its index, as it was or with some of its messages.

        changed: these messages, with their data where it is new
        """
        raw, body, entries = chunk.raw, chunk.stored, chunk.entries
        if changed is None and not chunk.is_same:
            changed = [(entry, None) for entry in entries]
        if changed is not None:
            raw, entries = built(raw, changed)
        if changed is not None or body is None:
            data = packed(raw, chunk.compression)
            head = _CHUNK.pack(*_span(entries), len(raw), crc32(raw)), sized(chunk.compression.encode())
            body = b"".join((*head, struct.pack("<Q", len(data)), data))
        if not entries:
            return b""
        return self._announced(*{entry[0] for entry in entries}) + self._indexed(body, entries)

    def _announced(self, *channels: int) -> bytes:
        """Return the records of channels, and of their schemas, that are not written yet."""
        pieces = []
        for number in channels:
            schema, body = self.registry.channels[number]
            if schema and (SCHEMA, schema) not in self._written:
                pieces.append(self._schema(schema))
            if (CHANNEL, number) not in self._written:
                pieces.append(self._channel(number, schema, body))
            self._written |= {(SCHEMA, schema), (CHANNEL, number)}
        return self._counted(*pieces)

    def _schema(self, number: int) -> bytes:
        return record(SCHEMA, struct.pack("<H", number), self.registry.schemas[number])

    @staticmethod
    def _channel(number: int, schema: int, body: bytes) -> bytes:
        return record(CHANNEL, struct.pack("<HH", number, schema), body)

    def _indexed(self, body: bytes, entries: Sequence[Entry]) -> bytes:
        """Return a chunk with the index of its messages."""
        places: dict[int, list[int]] = {}
        for channel, log_ns, at, _, _ in entries:
            places.setdefault(channel, []).extend((log_ns, at))
        first, last = _span(entries)
        self.span = (first, last) if self.span is None else (min(first, self.span[0]), max(last, self.span[1]))
        begin = self.size
        made, offsets = [record(CHUNK, body)], []
        at = begin + len(made[0])
        for channel, pairs in places.items():
            self.counts[channel] = self.counts.get(channel, 0) + len(pairs) // 2
            offsets.append(struct.pack("<HQ", channel, at))
            index = sized(struct.pack(f"<{len(pairs)}Q", *pairs))
            made.append(record(MESSAGE_INDEX, struct.pack("<H", channel), index))
            at += len(made[-1])
        fields = _Reader(body)
        _, _, size, _ = _CHUNK.unpack_from(body)
        fields.at = _CHUNK.size
        compression = fields.data()
        self._indexes[CHUNK_INDEX].append(b"".join((
            struct.pack("<QQQQ", first, last, begin, len(made[0])), sized(b"".join(offsets)),
            struct.pack("<Q", at - begin - len(made[0])), sized(compression),
            struct.pack("<QQ", fields.number("Q"), size),
        )))  # fmt: skip
        return self._counted(*made)

    def other(self, other: OtherRecord) -> bytes:
        """Return another record, and add it to the index."""
        made = record(other.kind, other.body)
        place = struct.pack("<QQ", self.size, len(made))
        fields = _Reader(other.body)
        if other.kind == ATTACHMENT:
            times = other.body[:16]
            fields.at = 16
            name, media = fields.data(), fields.data()
            size = struct.pack("<Q", fields.number("Q"))
            self._indexes[ATTACHMENT_INDEX].append(b"".join((place, times, size, sized(name), sized(media))))
        elif other.kind == METADATA:
            self._indexes[METADATA_INDEX].append(place + sized(fields.data()))
        return self._counted(made)

    def end(self) -> bytes:
        """Return the rest: channels without messages, the summary, and what closes the file."""
        data = self._announced(*sorted(self.registry.channels)) + self._counted(record(DATA_END, bytes(4)))
        first, last = self.span or (0, 0)
        counts = b"".join(struct.pack("<HQ", *pair) for pair in sorted(self.counts.items()))
        totals = len(self.registry.schemas), len(self.registry.channels), *map(len, (
            self._indexes[ATTACHMENT_INDEX], self._indexes[METADATA_INDEX], self._indexes[CHUNK_INDEX],
        ))  # fmt: skip
        statistics = struct.pack("<QHIIIIQQ", sum(self.counts.values()), *totals, first, last) + sized(counts)
        groups = {
            SCHEMA: [self._schema(number) for number in self.registry.schemas],
            CHANNEL: [self._channel(number, *each) for number, each in self.registry.channels.items()],
            **{kind: [record(kind, body) for body in bodies] for kind, bodies in self._indexes.items()},
            STATISTICS: [record(STATISTICS, statistics)],
        }
        begin, at, offsets = self.size, self.size, []
        for kind, records in groups.items():
            if size := sum(map(len, records)):
                offsets.append(record(SUMMARY_OFFSET, struct.pack("<BQQ", kind, at, size)))
                at += size
        summary = b"".join((*chain.from_iterable(groups.values()), *offsets))
        footer = _HEAD.pack(FOOTER, 20) + struct.pack("<QQ", begin, at)
        checksum = struct.pack("<I", crc32(summary + footer))
        return data + self._counted(summary, footer, checksum, MAGIC)


def _span(entries: Sequence[Entry]) -> tuple[int, int]:
    """Return the first and the last log time; 0 of none."""
    times = [entry[1] for entry in entries]
    return min(times, default=0), max(times, default=0)
