"""What the rows of a block say besides their poses: stamps, weights, and the poses that move each of them.

Stamps are read in bulk, decimal seconds or nanoseconds to integer nanoseconds, never through a float.
"""

from __future__ import annotations

from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FrametoolError
from frametool.frames.stamps import BILLION, nanoseconds_each, tell_size
from frametool.grammar.readers import in_nanoseconds
from frametool.stream.row_layout import NOWHERE
from frametool.stream.row_poses import NO_STAMP, texts_of
from frametool.stream.rows import numbered, read_each
from frametool.stream.stamp_source import Timed, read_header_stamp, read_stamp
from frametool.text.numbers import parse_number
from frametool.text.parse import LOWEST, parse_floats, trimmed
from frametool.text.spans import Bytes, Flags, Ints, Spans, Words, windows
from frametool.text.write import TENS, ZEROS, first_point, not_digits, read_eight_digits

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.types import Rigid
    from frametool.stream.request import Request

    Blame = Callable[[int, str, str | FrametoolError], None]

_WORDS = 3
_LONGEST = 8 * _WORDS
_MOST = (1 << 63) - 1
_MOST_SECONDS = _MOST // BILLION
_MOST_UPPER = (1 << 63) // 10**16
_NINE = 9  # decimals of a second in nanoseconds


def read_extra(cells: Sequence[Spans], request: Request, name: str) -> tuple[Any, dict[int, tuple[str, str]]]:
    """Read the stamps of rows, or the weights or labels of those that are gathered; give also which rows have none.

    cells: as for `read_stamps`, or () for none; name: that of their column or key
    """
    if not cells:
        return None, {}
    values: Any
    if not request.weighs:
        values, reasons = read_stamps(cells, in_ns=in_nanoseconds(name) if len(cells) == 1 else 0)
        values[[*reasons]] = NO_STAMP
    elif request.gathered is not None and request.gathered.labelled:
        return np.array(texts_of(cells[0]), object), {}
    else:
        values, bad = parse_floats(cells[0])
        texts = {row: cells[0].text(row).decode("utf-8", "replace").strip(" \t\"'") for row in bad.tolist()}
        reasons = read_each(values, texts, lambda row: parse_number(texts[row]))
    return values, {row: (name, reason) for row, reason in reasons.items()}


def read_stamps(cells: Sequence[Spans], *, in_ns: int) -> tuple[Ints, dict[int, str]]:
    """Read one column (n,) as nanoseconds, or two of whole seconds and nanoseconds.

    in_ns: how many nanoseconds a whole number of one column is; 0 are decimal seconds, and what ends in `ns` is some
    Gives the stamps, and why a row has none; what is not plainly written is read one by one.
    """
    parsed = [_parse_plain(each.data, *trimmed(*each), in_ns=in_ns if len(cells) == 1 else 1) for each in cells]
    stamps, sure = parsed[0]
    if len(cells) == 2:
        stamps, sure = stamps * BILLION + parsed[1][0], sure & parsed[1][1] & (stamps < _MOST_SECONDS)


    def read(row: int) -> int:
        texts = [each.text(row).decode("utf-8", "replace") for each in cells]
        return read_header_stamp(*texts) if len(texts) == 2 else read_stamp(texts[0], in_ns=in_ns)

    return stamps, read_each(stamps, np.flatnonzero(~sure).tolist(), read)


def _parse_plain(data: Bytes, starts: Ints, ends: Ints, *, in_ns: int) -> tuple[Ints, Flags]:
    """Read digits with at most a point among them; give the nanoseconds and which of them are sure."""
    suffixed = (data.take(ends - 1) == ord("s")) & (data.take(ends - 2) == ord("n")) & (ends - starts > 2)
    ends = ends - 2 * suffixed
    points = starts + _point(data, starts, ends)
    whole, sure = _integer(data, points, points - starts)
    decimals = np.maximum(ends - points - 1, 0)
    digits, fine = _integer(data, ends, decimals)
    finer = TENS.take(decimals - _NINE, mode="clip")  # what is finer than a nanosecond must be 0
    below = digits // finer * TENS.take(_NINE - decimals, mode="clip")
    sure &= fine & (digits % finer == 0) & (ends - starts <= _LONGEST) & (ends - starts > (points < ends))
    is_whole = points == ends
    each = np.where(suffixed, 1, in_ns or np.where(is_whole, nanoseconds_each(whole), BILLION))
    sure &= (is_whole | ~(suffixed | bool(in_ns))) & (whole < _MOST // each)
    by_size = np.flatnonzero(sure & (each != BILLION) & ~suffixed) if not in_ns else ()
    for row in by_size[:1]:
        tell_size(int(whole[row]), int(each[row]))
    return whole * each + below, sure


def _point(data: Bytes, starts: Ints, ends: Ints) -> Ints:
    """Return how many characters are before the point; all of them if absent."""
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


def by_frame(edge_of: Callable[..., Rigid], frames: Sequence[str | None], blame: Blame, column: str = "") -> Rigid:
    """Return the pose of each row by its frame's name; a row whose frame has none is bad."""
    known, codes = numbered(frames)
    edges = []
    for name, at in known.items():
        try:
            edges.append(edge_of(name))
        except FrametoolError as error:
            edges.append(NOWHERE)
            for row in np.flatnonzero(codes == at).tolist():
                blame(row, column, error)
    columns = zip_longest(*edges, fillvalue=0.0)
    return tuple(np.array(each)[codes] for each in columns)  # type: ignore[return-value]


def by_time(
    timed: Timed, times: Ints, rows: Ints, frames: Sequence[str | None], blame: Blame, column: str = ""
) -> Rigid:
    """Return the pose of each of some rows at its stamp, nan of others; a row without data then is bad.

    times: the stamp of each row, nanoseconds
    frames: one a row, or one for all (None: the one SOURCE); column: the one that names them
    """
    poses = np.full((timed.width, len(times)), np.nan)
    known, codes = numbered(frames)
    for frame, at in known.items():
        some = rows if len(known) == 1 else rows[codes[rows] == at]
        try:
            poses[:, some] = timed.many(frame, times[some])
        except FrametoolError as error:
            for row in some.tolist():
                blame(row, column, error)
            continue
        for row in some[np.isnan(poses[6, some])].tolist():  # asked singly, it says why
            try:
                timed.one(frame, int(times[row]))
                blame(row, timed.column, "no data")
            except FrametoolError as error:
                blame(row, timed.column, error)
    return tuple(poses)  # type: ignore[return-value]
