"""Decimal numbers laid out in rows of 40 bytes, the point of every one in the same place, as spans.

    bytes  0 .. 14   sign and whole part, right-aligned     0 ..  7, 8 .. 15   two words of characters
    byte  15         the point
    bytes 16 .. 32   fraction, left-aligned                16 .. 23, 24 .. 31, 32 .. 39   three words
A number begins where its first digit or sign stands and ends where its last wanted digit does: what stands outside is
never shown, so that neither leading nor trailing zeros have to be moved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.text.digits import ZEROS, count_digits, eight_digits
from frametool.text.spans import MARGIN, Spans, framed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.text.array_types import Bytes, Flags, Floats, Ints, Words

WIDTH = 40
POINT = 15
# One byte of the fifteen is the sign's.
GREATEST_WHOLE = 10**14
_MINUS = ord("-")
_POINT_CHARACTER = np.uint64(ord(".") << 56)


class Fields:
    """Rows of WIDTH bytes, seen as five words and as one long array of bytes between two margins."""

    def __init__(self, rows: int) -> None:
        """Make room for so many rows; their content is arbitrary until written."""
        self.data: Bytes = np.empty(rows * WIDTH + 2 * MARGIN, np.uint8)
        inner = self.data[MARGIN : MARGIN + rows * WIDTH]
        self.words: Words = inner.view("<u8").reshape(rows, WIDTH // 8)
        self.origins: Ints = np.arange(MARGIN, MARGIN + rows * WIDTH, WIDTH, dtype=np.int64)

    def write_whole(self, whole: Ints) -> None:
        """Write the digits of integers below GREATEST_WHOLE before the point, and the point."""
        upper = whole // 10**7 if whole.max(initial=0) >= 10**7 else None
        lower = whole if upper is None else whole - upper * 10**7
        words = eight_digits(lower)
        words >>= np.uint64(8)
        words |= _POINT_CHARACTER
        self.words[:, 1] = words
        if upper is not None:
            self.words[:, 0] = eight_digits(upper)

    def write_fraction(self, fraction: Ints, digits: int) -> list[Words]:
        """Write integers as exactly so many digits (up to 17) after the point; return their words, filled up with 0."""
        words = []
        rest = fraction
        for left in range(digits, 0, -8):
            leading = rest if left <= 8 else rest // 10 ** (left - 8)
            words.append(_left_digits(leading, min(left, 8)))
            self.words[:, 1 + len(words)] = words[-1]
            if left > 8:
                rest = rest - leading * 10 ** (left - 8)
        return words

    def write_sign(self, starts: Ints, negative: Flags) -> Ints:
        """Put a minus before each start; return the starts, moved to the minus where it counts."""
        self.data[starts - 1] = _MINUS
        return starts - negative

    def whole_starts(self, whole: Ints) -> Ints:
        """Return where the first digits of the whole parts stand in `data`."""
        return self.origins + POINT - count_digits(whole)


def _left_digits(numbers: Ints, digits: int) -> Words:
    """Return the characters of integers of so many digits, filled up with 0 to eight."""
    if digits == 1:
        return numbers.view(np.uint64) + ZEROS
    return eight_digits(numbers * 10 ** (8 - digits) if digits < 8 else numbers)


def written(values: Floats, separators: bytes, write: Callable[[Floats], Spans]) -> Spans:
    """Write rows of floats (n, c) by a function for a flat array of them; put its column's separator behind each."""
    rows, columns = values.shape
    if len(separators) != columns:
        raise ValueError(f"{columns} columns, but {len(separators)} separators")
    with np.errstate(over="ignore", invalid="ignore"):
        data, starts, ends = write(np.ascontiguousarray(values, np.float64).ravel())
    data[ends] = np.tile(np.frombuffer(separators, np.uint8), rows)
    return Spans(data, starts.reshape(rows, columns), (ends + 1).reshape(rows, columns))


def replaced(spans: Spans, places: Ints, texts: Sequence[str]) -> Spans:
    """Return the spans with those at `places` replaced by other text, each followed by one spare byte."""
    if not texts:
        return spans
    added = framed("".join(f"{text} " for text in texts).encode())
    lengths = np.array([len(text) for text in texts], np.int64)
    begins = len(spans.data) + MARGIN + np.cumsum(lengths + 1) - lengths - 1
    spans.starts[places] = begins
    spans.ends[places] = begins + lengths
    return Spans(np.concatenate([spans.data, added]), spans.starts, spans.ends)
