"""Messages as the bytes they are recorded as, plain CDR or ROS 1: taken apart field by field, and some fields changed.

All that is not changed stays as it was to the bit: stamps, names, other numbers, what fills gaps and what comes last.
"""

from __future__ import annotations

import struct
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid, shown
from frametool.frames.stamps import BILLION
from frametool.ros.messages import STAMPS, stamp_problem

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.geometry.types import Components, Rigid

WIDEST = {0: 8, 1: 8, 6: 4, 7: 4}  # by the first two bytes of CDR: what a number of eight bytes is aligned to
CDR_BEGIN = 4  # bytes before the first field
MOST_FILL = 3  # bytes behind the last field
POSE = 7  # numbers


class MessageHeader(NamedTuple):
    """What a header says: in which frame and when."""

    frame: str
    stamp_ns: int


class MessageFields:
    """A message whose fields are taken over one by one into a new one, and may be replaced there."""

    def __init__(self, data: bytes, *, ros1: bool) -> None:
        """Begin before the first field; raises ValueInvalid for an encoding that is not plain CDR."""
        layout = 1 if ros1 else int.from_bytes(data[:2], "big")
        if layout not in WIDEST or (len(data) < CDR_BEGIN and not ros1):
            raise ValueInvalid(f"it begins with {data[:CDR_BEGIN].hex(' ') or 'nothing'}: that is not plain CDR")
        self.data, self.ros1 = data, ros1
        self._order = "<" if layout & 1 else ">"  # of the bytes of a number
        self._four, self._eight = (1, 1) if ros1 else (4, WIDEST[layout])  # bytes that numbers of so many align to
        self._begin = self.at = 0 if ros1 else CDR_BEGIN
        self.made = bytearray(data[: self.at])

    def doubles(self, count: int) -> Components:
        """Take doubles over."""
        return self._numbers(_layout(f"{self._order}{count}d"), self._eight)

    def pose(self) -> Rigid:
        """Take the seven numbers of a pose or transform over."""
        tx, ty, tz, x, y, z, w = self.doubles(POSE)
        return tx, ty, tz, x, y, z, w

    def integer(self) -> int:
        """Take a length or a count over."""
        (number,) = self._numbers(_layout(self._order + "I"), self._four)
        return int(number)

    def _numbers(self, layout: struct.Struct, to: int) -> tuple[Any, ...]:
        """Take numbers over that are aligned to so many bytes."""
        at, made = self.at, self.made
        begin = at + (self._begin - at) % to
        self.at = end = begin + layout.size
        if end > len(self.data):
            raise ValueInvalid(f"it is cut short: its fields need {end} bytes, it has {len(self.data)}")
        new = (self._begin - len(made)) % to
        made += self.data[at:end] if new == begin - at else bytes(new) + self.data[begin:end]
        return layout.unpack_from(self.data, begin)

    def put(self, numbers: Sequence[float]) -> None:
        """Replace the doubles that were taken over last."""
        layout = _layout(f"{self._order}{len(numbers)}d")
        layout.pack_into(self.made, len(self.made) - layout.size, *numbers)

    def text(self, new: str | None = None) -> str:
        """Take a text over, or another one in its place, and return what it was."""
        size = self.integer()
        raw, self.at = self.data[self.at : self.at + size], self.at + size
        kept = raw
        if new is not None:
            kept = new.encode() + b"\0" * (not self.ros1)
            _layout(self._order + "I").pack_into(self.made, len(self.made) - 4, len(kept))
        self.made += kept
        try:
            return raw.removesuffix(b"\0").decode()
        except UnicodeDecodeError:
            raise ValueInvalid(f"{shown(raw)} is not UTF-8 text") from None

    def header(self, frame: str | None = None) -> MessageHeader:
        """Take a header over, or with another frame in it, and return what it said."""
        seconds, nanoseconds = self.stamp()
        if problem := stamp_problem(seconds, nanoseconds, STAMPS[0]):
            raise problem
        return MessageHeader(self.text(frame), seconds * BILLION + nanoseconds)

    def stamp(self) -> tuple[int, int]:
        """Take seconds and nanoseconds of a header over, and the counter that ROS 1 has before them."""
        *_, seconds, nanoseconds = self._numbers(_layout(self._order + ("III" if self.ros1 else "iI")), self._four)
        return seconds, nanoseconds

    def whole(self) -> bytes:
        """Return the new message; raises ValueInvalid where the old one goes on behind its fields, or ends in them."""
        rest = self.data[self.at :]
        if len(rest) > MOST_FILL or self.at > len(self.data):
            raise ValueInvalid(f"it has {len(self.data)} bytes, and its fields end at byte {self.at}")
        return bytes(self.made + rest)


class RawTransform(NamedTuple):
    """A transform as it was recorded, unchecked; numbers: tx, ty, tz, x, y, z, w; stamp: seconds and nanoseconds."""

    parent: str
    child: str
    numbers: Rigid
    stamp: tuple[int, int]


class Transforms:
    """The transforms of a TFMessage that is taken over; `put` of its fields replaces the numbers of the last one.

    names: between which bytes those of the last one stand
    """

    def __init__(self, data: bytes, *, ros1: bool) -> None:
        """Begin before the first one."""
        self.fields = MessageFields(data, ros1=ros1)
        self.names = 0, 0

    def __iter__(self) -> Iterator[RawTransform]:
        """Yield each transform."""
        fields = self.fields
        for _ in range(fields.integer()):
            stamp, begin = fields.stamp(), fields.at
            parent, child = fields.text(), fields.text()
            self.names = begin, fields.at
            yield RawTransform(parent, child, fields.pose(), stamp)


@cache
def _layout(code: str) -> struct.Struct:
    return struct.Struct(code)
