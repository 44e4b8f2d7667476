"""Point clouds out of `sensor_msgs/PointCloud2` messages of bags: their points as records of numpy, not copied."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FormatError, Unanswered, ValueInvalid, first_of, listing, shown
from frametool.frames.stamps import BILLION
from frametool.ros.messages import STAMPS, stamp_problem

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from numpy.typing import NDArray

    from frametool.grammar.edges import Tally

CLOUD = "sensor_msgs/msg/PointCloud2"
DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_MOST_VALUES = 1 << 16  # of one point


class PointCloud(NamedTuple):
    """The points of one message.

    number: of the message among those of its topics, from 1
    frame: that of its header, "" for none
    names: of the columns; rows: (n,) records whose fields are called 0, 1, .. in their order
    width, height: n is their product
    """

    number: int
    topic: str
    stamp_ns: int
    frame: str
    names: tuple[str, ...]
    rows: NDArray[Any]
    width: int
    height: int


def cloud_topics(reader: Any, chosen: Collection[str], path: str) -> list[str]:
    """Return the topics whose clouds are wanted: those chosen, or the only one there is.

    chosen: with or without a leading `/`
    Raises Unanswered where there are several to choose from, FormatError where there is none.
    """
    there = sorted({each.topic for each in reader.channels if each.type == CLOUD})
    wanted = {topic.strip("/") for topic in chosen}
    found = [topic for topic in there if topic.strip("/") in wanted]
    if found:
        return found
    if not there:
        known = listing({each.topic for each in reader.channels}) or "none"
        raise FormatError(f"no clouds (PointCloud2) in the bag; its topics: {known}", source=path)
    if wanted:
        known = listing(there, near=next(iter(chosen)))
        raise FormatError(f"no clouds on {listing(chosen)}; topics with clouds: {known}", source=path)
    if len(there) > 1:
        raise Unanswered(f"several topics hold clouds; give --topic {first_of(there, 8, gap='|')}", source=path)
    return there


def read_clouds(reader: Any, topics: Sequence[str], path: str, tally: Tally) -> Iterator[PointCloud | FormatError]:
    """Yield the clouds of some topics in the order they were recorded; in the place of a broken one its error."""
    channels = [each for each in reader.channels if each.topic in topics and each.type == CLOUD]
    for number, (channel, _, data, *_) in enumerate(reader.messages(channels), 1):
        try:
            yield _cloud(reader.types.read(channel, data), number, channel.topic, tally)
        except ValueInvalid as error:
            yield FormatError(str(error), source=path, line=number)


def _cloud(message: Any, number: int, topic: str, tally: Tally) -> PointCloud:
    """Take a message apart; raises ValueInvalid for what contradicts itself."""
    stamp = message.header.stamp
    if problem := stamp_problem(stamp.sec, stamp.nanosec, STAMPS[0]):
        raise problem
    names, kind = _record_of(message)
    width, height = int(message.width), int(message.height)
    frame = message.header.frame_id
    return PointCloud(
        number, topic, stamp.sec * BILLION + stamp.nanosec, tally.names.bare(frame) if frame else "", names,
        _rows(message, kind, width, height), width, height,
    )  # fmt: skip


def _record_of(message: Any) -> tuple[tuple[str, ...], np.dtype[Any]]:
    """Return the columns of a point, and its type: each value of a field is a column."""
    order = ">" if message.is_bigendian else "<"
    step = int(message.point_step)
    names: list[str] = []
    formats: list[str] = []
    offsets: list[int] = []
    for field in message.fields:
        code = DATATYPES.get(int(field.datatype))
        if code is None:
            raise ValueInvalid(f"field {shown(field.name)} has the datatype {field.datatype}, known are 1 to 8")
        count, offset, size = max(int(field.count), 1), int(field.offset), int(code[1])
        end = offset + count * size
        if end > step:
            raise ValueInvalid(f"field {shown(field.name)} ends at byte {end}, a point has {step} (point_step)")
        if len(names) + count > _MOST_VALUES:
            raise ValueInvalid(f"a point has more than {_MOST_VALUES} values")
        names += [field.name] if count == 1 else [f"{field.name}_{place}" for place in range(count)]
        formats += [order + code] * count
        offsets += range(offset, end, size)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueInvalid(f"field {shown(twice[0])} stands twice")
    if missing := [name for name in "xyz" if name not in names]:
        raise ValueInvalid(f"no field {', '.join(missing)}; fields: {listing(names) or 'none'}")
    places = [f"{place}" for place in range(len(names))]
    return tuple(names), np.dtype({"names": places, "formats": formats, "offsets": offsets, "itemsize": step})


def _rows(message: Any, kind: np.dtype[Any], width: int, height: int) -> NDArray[Any]:
    """Return the points; the rows of a grid may be padded."""
    data = np.asarray(message.data, np.uint8)
    step, row = kind.itemsize, int(message.row_step)
    if height == 1 or not row:
        row = max(row, width * step) if height == 1 else width * step
    if height > 1 and row < width * step:
        raise ValueInvalid(f"a row of {width} points of {step} bytes has {row} bytes (row_step)")
    needed = (height - 1) * row + width * step if width and height else 0
    if len(data) < needed:
        raise ValueInvalid(f"{width} x {height} points need {needed} bytes, the message has {len(data)}")
    if not needed:
        return np.empty(0, kind)
    grid: NDArray[Any] = np.ndarray((height, width), kind, data, 0, (row, step))
    return grid.reshape(-1)
