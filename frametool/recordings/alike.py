"""Messages of equal layout, converted to lines of JSON many at once.

One message is parsed according to its type: where each number is, and which bytes are in between (names and lengths),
in which other messages must agree exactly.
"""

from __future__ import annotations

from json import dumps
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from rosbags.interfaces import Nodetype

from frametool.text.spans import MARGIN, Spans, framed, join
from frametool.text.write import shortest_spans

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from frametool.recordings.made import MessageTypes

CODES = {"float64": "<f8", "float32": "<f4", "uint32": "<u4", "int32": "<i4", "uint16": "<u2", "int16": "<i2",
         "uint8": "<u1", "int8": "<i1"}  # fmt: skip
MOST_NUMBERS = 200  # per message
CDR_LE = b"\0\1"
HOLE = "\0"  # a placeholder for a number; no JSON text contains it
POINT_ZERO = 2  # the characters `.0` that an integer written as a float has too many


class Varies(Exception):
    """Raised for a part of a message that has no fixed position."""


class BinaryLayout(NamedTuple):
    """The positions of numbers in messages, the bytes that all of them share, and the JSON text in between."""

    numbers: np.dtype[Any]
    shared: Sequence[tuple[slice, bytes]]
    texts: Sequence[bytes]

    def values(self, messages: Sequence[bytes]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the numbers of messages of equal length, (n, k), and which of the messages differ in no more."""
        text = b"".join(messages)
        rows = np.frombuffer(text, np.uint8).reshape(len(messages), -1)
        columns = np.frombuffer(text, self.numbers)
        alike = np.ones(len(messages), np.bool_)
        for part, said in self.shared:
            alike &= (rows[:, part] == np.frombuffer(said, np.uint8)).all(axis=1)
        return np.stack([columns[name].astype(np.float64) for name in self.numbers.names or ()], axis=-1), alike

    def lines(self, messages: Sequence[bytes]) -> bytes | None:
        """Return messages of equal length as lines; None if they differ in more than finite numbers."""
        numbers, alike = self.values(messages)
        if not (alike.all() and np.isfinite(numbers).all()):
            return None
        names = self.numbers.names or ()
        written = shortest_spans(numbers, b" " * len(names))
        ends = written.ends - np.array([1 + POINT_ZERO * (self.numbers[name].kind != "f") for name in names])
        parts = [_repeated(self.texts[0], len(messages))]
        for at, each in enumerate(self.texts[1:]):
            parts += [Spans(written.data, written.starts[:, at], ends[:, at]), _repeated(each, len(messages))]
        return join(parts)


def _repeated(text: bytes, count: int) -> Spans:
    """Return a text for each row, in pieces that are copied at once."""
    starts = np.arange(0, len(text), MARGIN)
    ends = np.minimum(starts + MARGIN, len(text))
    return Spans(framed(text), np.tile(starts + MARGIN, (count, 1)), np.tile(ends + MARGIN, (count, 1)))


class _Reader:
    """Parses one message."""

    def __init__(self, types: MessageTypes, data: bytes) -> None:
        self.fields, self.data = types.store.fielddefs, data
        self.begin = 0 if types.ros1 else 4
        self.aligned, self.at = not types.ros1, self.begin
        self.places: list[tuple[int, str]] = []
        self.shared = [slice(self.begin)]

    def _place(self, size: int) -> int:
        """Skip the next part of this many bytes; return its position."""
        place = self.at + (-(self.at - self.begin) % size if self.aligned else 0)
        self.at = place + size
        if self.at > len(self.data):
            raise Varies
        return place

    def line(self, kind: str) -> str:
        """Return a message of a type, or a part of one, as JSON with a placeholder for each number."""
        parts = (f"{dumps(name)}: {self._value(*node)}" for name, node in self.fields[kind][1])
        return f"{{{', '.join(parts)}}}"

    def _value(self, node: Nodetype, what: Any) -> str:
        if node == Nodetype.NAME:
            return self.line(what)
        if node == Nodetype.ARRAY and what[1] <= MOST_NUMBERS:
            return f"[{', '.join(self._value(*what[0]) for _ in range(what[1]))}]"
        if node == Nodetype.SEQUENCE:
            begin = self._place(4)
            count = int.from_bytes(self.data[begin : self.at], "little")
            self.shared.append(slice(begin, self.at))
            return f"[{', '.join(self._value(*what[0]) for _ in range(min(count, MOST_NUMBERS + 1)))}]"
        if node != Nodetype.BASE or len(self.places) > MOST_NUMBERS:
            raise Varies
        if what[0] in CODES:
            code = CODES[what[0]]
            self.places.append((self._place(int(code[-1])), code))
            return HOLE
        if what[0] != "string":
            raise Varies
        begin = self._place(4)
        self.at += int.from_bytes(self.data[begin : begin + 4], "little")
        self.shared.append(slice(begin, self.at))
        return dumps(self.data[begin + 4 : self.at].rstrip(b"\0").decode(), ensure_ascii=False)


def layout_of(types: MessageTypes, kind: str, data: bytes, line: bytes | None = None) -> BinaryLayout | None:
    """Return the layout of messages like this one; None unless it gives the same line as the full reader."""
    reader = _Reader(types, data)
    if reader.aligned and data[:2] != CDR_LE:
        return None
    try:
        texts = f"{reader.line(kind)}\n".encode().split(HOLE.encode())
    except (Varies, UnicodeDecodeError):
        return None
    if not reader.places or reader.at != len(data):
        return None
    places, codes = zip(*reader.places, strict=True)
    names = [f"f{at}" for at in range(len(codes))]
    numbers: Any = {"names": names, "formats": codes, "offsets": places, "itemsize": len(data)}
    made = BinaryLayout(np.dtype(numbers), [(part, data[part]) for part in reader.shared], texts)
    return made if line is None or made.lines([data]) == line else None
