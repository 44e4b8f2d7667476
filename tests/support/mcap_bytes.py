"""MCAP files byte by byte, by a second hand: everything that the format may hold, written and read in the order it lies.

See https://mcap.dev/spec.  Shares no code with frametool.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any, NamedTuple

import lz4.frame  # type: ignore[import-untyped]

MAGIC = b"\x89MCAP0\r\n"


def text(value: str | bytes) -> bytes:
    data = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(data)) + data


def record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def header(profile: str = "ros2", library: str = "by hand") -> bytes:
    return record(1, text(profile) + text(library))


def schema(number: int, name: str, encoding: str, data: str) -> bytes:
    return record(3, struct.pack("<H", number) + text(name) + text(encoding) + text(data))


def channel(number: int, of: int, topic: str, encoding: str = "cdr", **said: str) -> bytes:
    pairs = b"".join(text(key) + text(value) for key, value in said.items())
    return record(4, struct.pack("<HH", number, of) + text(topic) + text(encoding) + text(pairs))


def message(number: int, data: bytes, log_ns: int, published_ns: int, sequence: int = 0) -> bytes:
    return record(5, struct.pack("<HIQQ", number, sequence, log_ns, published_ns) + data)


def chunk(raw: bytes, compression: str = "") -> bytes:
    packed = lz4.frame.compress(raw) if compression == "lz4" else raw
    head = struct.pack("<QQQI", 0, 0, len(raw), zlib.crc32(raw))
    return record(6, head + text(compression) + struct.pack("<Q", len(packed)) + packed)


def attachment(name: str, data: bytes) -> bytes:
    body = struct.pack("<QQ", 3, 4) + text(name) + text("text/plain") + struct.pack("<Q", len(data)) + data
    return record(9, body + struct.pack("<I", zlib.crc32(body)))


def metadata(name: str, **said: str) -> bytes:
    return record(12, text(name) + text(b"".join(text(key) + text(value) for key, value in said.items())))


def whole(*records: bytes) -> bytes:
    """Return a file without a summary."""
    return b"".join((MAGIC, *records, record(15, bytes(4)), record(2, bytes(20)), MAGIC))


class Lying(NamedTuple):
    """A message in a file: its channel, what is said of that, its schema, its number, its times and its data."""

    topic: str
    encoding: str
    said: bytes
    schema: tuple[bytes, ...]
    sequence: int
    log_ns: int
    published_ns: int
    data: bytes


class McapContents:
    """All records of a file; those of the summary apart."""

    def __init__(self, data: bytes) -> None:
        assert data[:8] == data[-8:] == MAGIC
        self.messages: list[Lying] = []
        self.others: list[tuple[int, bytes]] = []  # kind and body, as of attachments
        self.schemas: dict[int, tuple[bytes, ...]] = {0: ()}
        self.channels: dict[int, tuple[str, str, bytes, int]] = {}
        self.places: dict[int, list[tuple[int, int]]] = {}  # by the indexes: log times, and where messages begin
        self.chunks: dict[int, bytes] = {}
        self.summary: list[tuple[int, bytes]] = []
        self._data = data
        at, is_data = 8, True
        while at < len(data) - 8:
            kind, size = struct.unpack_from("<BQ", data, at)
            body = data[at + 9 : at + 9 + size]
            if kind == 15:
                is_data = False
            elif is_data:
                self._take(kind, body, at)
            else:
                self.summary.append((kind, body))
            at += 9 + size
        assert at == len(data) - 8

    def _take(self, kind: int, body: bytes, at: int = 0) -> None:
        if kind == 3:
            (number,) = struct.unpack_from("<H", body)
            self.schemas[number] = tuple(_texts(body[2:], 3))
        elif kind == 4:
            number, of = struct.unpack_from("<HH", body)
            topic, encoding, said = _texts(body[4:], 3)
            self.channels[number] = topic.decode(), encoding.decode(), said, of
        elif kind == 5:
            number, sequence, log_ns, published_ns = struct.unpack_from("<HIQQ", body)
            topic_, encoding_, said, of = self.channels[number]
            self.messages.append(Lying(topic_, encoding_, said, self.schemas[of], sequence, log_ns, published_ns, body[22:]))
        elif kind == 6:
            self._chunk(body, at)
        elif kind == 7:
            (number,) = struct.unpack_from("<H", body)
            (pairs,) = _texts(body[2:], 1)
            found = struct.iter_unpack("<QQ", pairs)
            for log_ns, offset in found:
                inside = struct.unpack_from("<BQHIQ", self.chunks[max(self.chunks)], offset)
                assert (inside[0], inside[2], inside[4]) == (5, number, log_ns)
                self.places.setdefault(number, []).append((log_ns, offset))
        elif kind != 1:
            self.others.append((kind, body))

    def _chunk(self, body: bytes, at: int) -> None:
        _, _, size, checksum = struct.unpack_from("<QQQI", body)
        (compression,) = _texts(body[28:], 1)
        packed = body[28 + 4 + len(compression) + 8 :]
        raw = lz4.frame.decompress(packed) if compression == b"lz4" else packed
        assert len(raw) == size
        assert checksum in (0, zlib.crc32(raw))
        self.chunks[at] = raw
        inside = 0
        while inside < len(raw):
            kind, length = struct.unpack_from("<BQ", raw, inside)
            self._take(kind, raw[inside + 9 : inside + 9 + length])
            inside += 9 + length

    def in_summary(self, kind: int) -> list[bytes]:
        return [body for each, body in self.summary if each == kind]


def _texts(body: bytes, count: int) -> list[bytes]:
    found: list[Any] = []
    at = 0
    for _ in range(count):
        (size,) = struct.unpack_from("<I", body, at)
        found.append(body[at + 4 : at + 4 + size])
        at += 4 + size
    return found
