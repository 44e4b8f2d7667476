"""Ranges of text in one byte array, and joining many of them into one block; the array types of `text`.

A span is a start and an end in `data`; columns of text are arrays of spans, so that unchanged text is never decoded.
Does not interpret text.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

# around every span this many bytes of `data` may be read, whatever they are: copies use whole windows
MARGIN = 64
# windows of one batch fit into the second-level cache
_BATCH_BYTES = 1 << 17


class Spans(NamedTuple):
    """Text as ranges in `data`: `data[starts[i] : ends[i]]`; starts and ends have one shape, rows first."""

    data: Bytes
    starts: Ints
    ends: Ints

    def text(self, *place: int) -> bytes:
        """Return the bytes of one span, by its row and, if there are columns, its column."""
        return self.data[int(self.starts[place]) : int(self.ends[place])].tobytes()


def framed(block: bytes | bytearray | memoryview) -> Bytes:
    """Copy a block into an array with MARGIN zero bytes before and after it: offset i is at MARGIN + i."""
    data = np.zeros(len(block) + 2 * MARGIN, np.uint8)
    data[MARGIN : MARGIN + len(block)] = np.frombuffer(block, np.uint8)
    return data


def windows(data: Bytes, width: int) -> np.ndarray:
    """View `data` as all its overlapping ranges of `width` bytes, each one item: `[i]` begins at i."""
    return np.ndarray((len(data) - width + 1,), f"V{width}", data, 0, (1,))


def join(columns: Sequence[Spans]) -> bytes:
    """Write the spans of each row one after another, row after row.

    columns: spans of shape (n,) or (n, c), all with the same n; nothing is inserted between them.
    Every span is copied as a window of one width, in order, so that each one overwrites what its predecessor wrote
    beyond its end; the few spans longer than MARGIN are then copied one by one.
    """
    parts = []
    for data, starts, stops in columns:
        shape = (len(starts), -1) if starts.size else (0, 1)
        parts.append((data, starts.reshape(shape), stops.reshape(shape)))
    lengths = np.concatenate([end - begin for _, begin, end in parts], axis=1)
    ends = np.cumsum(lengths).reshape(lengths.shape)
    total = int(ends[-1, -1]) if ends.size else 0
    out = np.empty(total + MARGIN, np.uint8)
    places = ends - lengths
    longest = int(lengths.max(initial=1))
    width = min(-(-longest // 8) * 8, MARGIN)
    target = windows(out, width)
    rows = max(1, _BATCH_BYTES // (width * places.shape[1]))
    for first in range(0, len(places), rows):
        some = slice(first, first + rows)
        gathered = [windows(data, width)[begin[some]] for data, begin, _ in parts]
        batch = gathered[0] if len(parts) == 1 else np.concatenate(gathered, axis=1)
        target[places[some].ravel()] = batch.ravel()
    column = 0
    for data, begin, end in parts if longest > width else ():
        for row, at in np.argwhere(end - begin > width).tolist():
            text = data[begin[row, at] : end[row, at]]
            place = int(places[row, column + at])
            out[place : place + len(text)] = text
        column += begin.shape[1]
    return out[:total].tobytes()


# make the C library keep freed memory instead of returning it to the system after every block: freeing one large
# unused allocation raises glibc's thresholds for that (mallopt(3), M_MMAP_THRESHOLD: dynamic); without it each
# temporary array costs page faults: 119 instead of 28 ns per float were measured
np.empty(1 << 24, np.uint8)


Bytes: TypeAlias = NDArray[np.uint8]
Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Words: TypeAlias = NDArray[np.uint64]
Flags: TypeAlias = NDArray[np.bool_]
