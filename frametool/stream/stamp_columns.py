"""Stamps in bulk: decimal seconds or nanoseconds as text to integer nanoseconds, never through a float."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.stream.stamp_source import read_header_stamp, read_stamp
from frametool.text.digits import ZEROS, first_point, not_digits, read_eight_digits
from frametool.text.parse import LOWEST, trimmed
from frametool.text.spans import windows

if TYPE_CHECKING:
    from frametool.text.array_types import Bytes, Flags, Ints, Words
    from frametool.text.spans import Spans

_WORDS = 3
_LONGEST = 8 * _WORDS
_MOST_SECONDS = (1 << 63) // BILLION
_MOST_UPPER = (1 << 63) // 10**16
_BELOW_NS = np.uint64(10**7)


def parse_stamps(cells: Spans, *, in_ns: bool) -> tuple[Ints, dict[int, str]]:
    """Read cells (n,) as nanoseconds: decimal seconds, or integers of nanoseconds if so told or followed by `ns`.

    Gives the stamps, and why a cell is none; what is not plainly written is left to `read_stamp`.
    """
    starts, ends = trimmed(cells.data, cells.starts, cells.ends)
    stamps, sure = _parse_plain(cells.data, starts, ends, in_ns=in_ns)
    reasons = {}
    for row in np.flatnonzero(~sure).tolist():
        try:
            stamps[row] = read_stamp(cells.text(row).decode("utf-8", "replace"), in_ns=in_ns)
        except ValueInvalid as error:
            reasons[row] = str(error)
    return stamps, reasons


def parse_header_stamps(seconds: Spans, nanoseconds: Spans) -> tuple[Ints, dict[int, str]]:
    """Read the two whole numbers of stamps (n,) as nanoseconds; otherwise as `parse_stamps`."""
    whole, sure = _parse_plain(seconds.data, *trimmed(*seconds), in_ns=True)
    below, fine = _parse_plain(nanoseconds.data, *trimmed(*nanoseconds), in_ns=True)
    stamps = whole * BILLION + below
    reasons = {}
    for row in np.flatnonzero(~(sure & fine & (whole < _MOST_SECONDS))).tolist():
        try:
            stamps[row] = read_header_stamp(seconds.text(row).decode(), nanoseconds.text(row).decode())
        except (ValueInvalid, OverflowError) as error:
            reasons[row] = str(error)
    return stamps, reasons


def _parse_plain(data: Bytes, starts: Ints, ends: Ints, *, in_ns: bool) -> tuple[Ints, Flags]:
    """Read digits with at most a point among them; give the nanoseconds and which of them are sure."""
    suffixed = (data.take(ends - 1) == ord("s")) & (data.take(ends - 2) == ord("n")) & (ends - starts > 2)
    ends = ends - 2 * suffixed
    points = starts + _point(data, starts, ends)
    whole, sure = _integer(data, points, points - starts)
    below, fine = _fraction(data, points + 1, ends - points - 1)
    sure &= fine & (ends - starts <= _LONGEST) & (ends - starts > (points < ends))
    nanoseconds = suffixed | in_ns
    sure &= np.where(nanoseconds, points == ends, whole < _MOST_SECONDS)
    return np.where(nanoseconds, whole, whole * BILLION + below), sure


def _point(data: Bytes, starts: Ints, ends: Ints) -> Ints:
    """Return how many characters stand before the point; all of them where there is none."""
    characters = windows(data, _LONGEST)[starts].view("<u8").reshape(-1, _WORDS)
    before = first_point(characters[:, _WORDS - 1])
    for word in reversed(range(_WORDS - 1)):
        here = first_point(characters[:, word])
        before = np.where(here < 8, here, before + 8)
    count: Ints = np.minimum(before, ends - starts)
    return count


def _integer(data: Bytes, ends: Ints, length: Ints) -> tuple[Ints, Flags]:
    """Read so many digits before `ends`, not above 63 bits."""
    characters = windows(data, _LONGEST)[ends - _LONGEST].view("<u8").reshape(-1, _WORDS)
    words, wrong = [], np.zeros(len(ends), np.uint64)
    for word in range(_WORDS):
        digits = characters[:, word] ^ ZEROS
        digits &= ~LOWEST.take(8 * (_WORDS - word) - length, mode="clip")
        wrong |= not_digits(digits)
        words.append(read_eight_digits(digits))
    upper, middle, lower = words
    total: Words = (upper * np.uint64(10**8) + middle) * np.uint64(10**8) + lower
    return total.view(np.int64), (wrong == 0) & (upper < _MOST_UPPER)


def _fraction(data: Bytes, starts: Ints, length: Ints) -> tuple[Ints, Flags]:
    """Read so many digits from `starts` as nanoseconds; what is finer must be 0."""
    characters = windows(data, 16)[starts].view("<u8").reshape(-1, 2)
    first, second = ((characters[:, word] ^ ZEROS) & LOWEST.take(length - 8 * word, mode="clip") for word in range(2))
    sure = (not_digits(first) | not_digits(second)) == 0
    rest = read_eight_digits(second)
    nanoseconds = read_eight_digits(first) * np.uint64(10) + rest // _BELOW_NS
    return nanoseconds.view(np.int64), sure & (rest % _BELOW_NS == 0) & (length <= 16)
