"""Ranges of text in one byte array: found as the cells of lines, joined into one block; the array types of `text`.

A span is a start and an end in `data`; columns of text are arrays of spans, so that unchanged text is never decoded.
Two families of cells: between delimiters (CSV, TSV; quoted as in RFC 4180) and between blanks (TUM and others).
The text is not interpreted.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from frametool.errors import NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

# around every span this many bytes of `data` may be read, whatever they are: copies use whole windows
MARGIN = 64
# windows of one batch fit into the second-level cache, but a batch has at least this many rows, because each costs
_BATCH_BYTES, _LEAST_ROWS = 1 << 17, 1 << 8
_NOTHING_HIDDEN: Flags = np.empty(0, np.bool_)
_CLOSING_QUOTE = re.compile(rb'(?:[^"]++|"")*+"')
_NEWLINE, _RETURN, _QUOTE, _BLANK, _TAB = b'\n\r" \t'


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
    views = [windows(data, width) for data, _, _ in parts]
    rows = max(_LEAST_ROWS, _BATCH_BYTES // (width * places.shape[1]))
    for first in range(0, len(places), rows):
        some = slice(first, first + rows)
        gathered = [view[begin[some]] for view, (_, begin, _) in zip(views, parts, strict=True)]
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


# --- the cells of a block of lines: the range of each, without changing their text ---


class Cells(NamedTuple):
    """The lines of a block and the cells of those with the expected number of cells.

    data: the block between margins (see MARGIN); all offsets refer to it
    line_starts, line_ends: (lines,), a line's first byte and the one after its line end
    counts: (lines,), cells in each line; 0 for an empty line or a comment
    rows: (n,), the lines with the expected number of cells, and starts, ends: (n, columns), their ranges
    """

    data: Bytes
    line_starts: Ints
    line_ends: Ints
    counts: Ints
    rows: Ints
    starts: Ints
    ends: Ints

    def column(self, index: int) -> Spans:
        """Return the spans of one column."""
        return Spans(self.data, self.starts[:, index], self.ends[:, index])

    def odd_lines(self) -> Ints:
        """Return the lines with another number of cells, including empty ones and comments."""
        return np.delete(np.arange(len(self.counts)), self.rows)

    def line(self, index: int) -> bytes:
        """Return the bytes of one line with its end."""
        return self.data[self.line_starts[index] : self.line_ends[index]].tobytes()

    def lines_before(self) -> Ints:
        """Count the line ends in the block before each line: more than its index if cells contain line ends."""
        return np.searchsorted(np.flatnonzero(self.data == _NEWLINE), self.line_starts)


class _Found(NamedTuple):
    """All cells of a block in order, and for each line the number of cells up to its end."""

    starts: Ints
    ends: Ints
    stops: Ints
    line_ends: Ints


def split_delimited(block: bytes, delimiter: bytes, columns: int) -> Cells:
    """Find cells between delimiters; quotes are part of the cell's span, and hide delimiters and line ends.

    block: whole lines; the last line end may be missing.
    """
    data, end = _closed(block)
    hidden = _inside_quotes(data, end, delimiter) if b'"' in block else _NOTHING_HIDDEN
    if hidden is None:  # one by one; the last match is the empty one at the end of the text
        closed = block if block.endswith(b"\n") else block + b"\n"
        places = [(cell.start(), cell.start(1), cell.end()) for cell in _cell_pattern(delimiter).finditer(closed)]
        starts, ends, after = (np.array(places[:-1], np.int64).reshape(-1, 3) + MARGIN).T
        ends = np.minimum(ends, MARGIN + len(block))
        stops = np.flatnonzero((data[ends] == _NEWLINE) | (after == MARGIN + len(closed))) + 1
        found = _Found(starts, ends, stops, after[stops - 1])
    else:  # at every delimiter and line end, except hidden ones
        text = data[MARGIN:end]
        is_mark = (text == delimiter[0]) | (text == _NEWLINE)
        if hidden.size:
            is_mark &= ~hidden
        marks = np.flatnonzero(is_mark)
        marks += MARGIN
        stops = np.flatnonzero(data.take(marks) == _NEWLINE) + 1
        starts = np.empty_like(marks)
        starts[:1] = MARGIN
        starts[1:] = marks[:-1] + 1
        found = _Found(starts, marks, stops, marks[stops - 1] + 1)
    if b"\r" in block:
        last = found.stops - 1
        found.ends[last] -= (data[found.ends[last] - 1] == _RETURN) & (found.ends[last] > found.starts[last])
    return _select(data, min(end, MARGIN + len(block)), found, columns)


def split_blank(block: bytes, columns: int, *, comment: bytes = b"#") -> Cells:
    """Find cells between runs of blanks and tabs, as `split_delimited` does for delimiters.

    A line that begins with `comment`, one character if any, has no cells.
    """
    data, end = _closed(block)
    text = data[MARGIN - 1 : end]
    gap = (text == _BLANK) | (text == _TAB) | (text == _RETURN) | (text == _NEWLINE)
    gap[0] = True
    edges = np.flatnonzero(gap[1:] != gap[:-1]) + MARGIN
    newlines = np.flatnonzero(text == _NEWLINE) + MARGIN - 1
    starts = edges[::2]
    found = _Found(starts, edges[1::2], np.searchsorted(starts, newlines), newlines + 1)
    return _select(data, min(end, MARGIN + len(block)), found, columns, comment)


def whole_records(text: bytes, delimiter: bytes = b",") -> int:
    """Return the number of bytes of the text in complete lines, up to one that ends outside of quotes."""
    end = text.rfind(b"\n") + 1
    if text.find(b'"', 0, end) < 0 or _ends_outside_quotes(text[:end], delimiter):
        return end
    before_last_quote = text.rfind(b"\n", 0, text.rfind(b'"', 0, end)) + 1
    if before_last_quote and _ends_outside_quotes(text[:before_last_quote], delimiter):
        return before_last_quote
    record_ends = [cell.end() for cell in _cell_pattern(delimiter).finditer(text) if cell[1] == b"\n"]
    return max(record_ends, default=0)


class RecordEnds:
    """Find the ends of records in text that arrives in pieces; bytes inside an open quote are scanned once."""

    def __init__(self, delimiter: bytes) -> None:
        """Start before the first record."""
        self.delimiter = delimiter
        self.quoted = False

    def __call__(self, text: bytes) -> int:
        """Return the number of bytes in complete records; negative: that many begin a record whose quote is open.

        text: contains a line end; it follows the records returned last.
        """
        last, start = text.rfind(b"\n") + 1, 0
        if self.quoted:
            closing = _CLOSING_QUOTE.match(text, 0, last)
            if closing is None:
                return -last
            start = closing.end()
        end = whole_records(text[start:], self.delimiter)
        self.quoted = not end
        return start + end if end else -last


def torn_record(text: bytes, delimiter: bytes) -> int | None:
    """Return the start of the record with a quote that is not closed; None if all are closed."""
    if _ends_outside_quotes(text, delimiter):
        return None
    start = 0
    for cell in _cell_pattern(delimiter).finditer(text):
        if cell.start(1) == len(text) and re.fullmatch(rb'"(?:[^"]++|"")*+', text[cell.start() :]):
            return start
        start = cell.end() if cell[1] == b"\n" else start
    return None


def _ends_outside_quotes(lines: bytes, delimiter: bytes) -> bool:
    """Return True if complete lines certainly end outside of quotes."""
    return b'"' not in lines or _inside_quotes(framed(lines), MARGIN + len(lines), delimiter) is not None


def without_quotes(cells: Spans) -> Spans:
    """Return the spans without surrounding quotes; for text without quotes inside."""
    first, last = cells.data[cells.starts], cells.data[cells.ends - 1]
    quoted = (first == _QUOTE) & (last == _QUOTE) & (cells.ends - cells.starts > 1)
    return Spans(cells.data, cells.starts + quoted, cells.ends - quoted)


def _closed(block: bytes) -> tuple[Bytes, int]:
    """Return the block between margins, with a line end if it has none, and its end."""
    data = framed(block)
    end = MARGIN + len(block)
    if not block or block.endswith(b"\n"):
        return data, end
    data[end] = _NEWLINE
    return data, end + 1


def _inside_quotes(data: Bytes, end: int, delimiter: bytes) -> Flags | None:
    """Return the mask of bytes inside quotes; None if a quote neither opens, closes nor doubles another."""
    quotes = np.flatnonzero(data[:end] == _QUOTE)
    opening, closing = quotes[::2], quotes[1::2]
    before, after = data[opening - 1], data[closing + 1]
    opens = (before == delimiter[0]) | (before == _NEWLINE) | (before == _QUOTE) | (opening == MARGIN)
    closes = (after == delimiter[0]) | (after == _NEWLINE) | (after == _QUOTE) | (after == _RETURN)
    if len(quotes) % 2 or not opens.all() or not closes.all():
        return None
    inside: Flags = np.bitwise_xor.accumulate(data[MARGIN:end] == _QUOTE)
    return inside


@cache
def _cell_pattern(delimiter: bytes) -> re.Pattern[bytes]:
    """Return a pattern for one cell and, as group 1, its end; an unclosed quote reaches to the end of the text."""
    mark = re.escape(delimiter)
    quoted = rb'"(?:[^"]++|"")*+(?:"[^' + mark + rb"\n]*+|\Z)"
    return re.compile(rb"(?:" + quoted + rb"|[^" + mark + rb"\n]*+)(" + mark + rb"|\n|\Z)")


def _select(data: Bytes, end: int, found: _Found, columns: int, comment: bytes = b"") -> Cells:
    """Select the cells of those lines with the expected number of cells."""
    line_starts = np.concatenate([[MARGIN], found.line_ends[:-1]])[: len(found.line_ends)]
    line_ends = np.minimum(found.line_ends, end)
    counts = np.diff(found.stops, prepend=0)
    if len(found.ends):
        counts[found.ends[found.stops - 1] <= line_starts] = 0
    if comment:
        counts[data[line_starts] == comment[0]] = 0
    rows = np.flatnonzero(counts == columns)
    if len(rows) * columns == len(found.starts):
        starts, ends = found.starts.reshape(-1, columns), found.ends.reshape(-1, columns)
    else:
        places = found.stops[rows][:, None] + np.arange(-columns, 0)
        starts, ends = found.starts[places], found.ends[places]
    return Cells(data, line_starts, line_ends, counts, rows, starts, ends)


# make the C library keep freed memory instead of returning it to the system after every block: freeing one large
# unused allocation raises glibc's thresholds for that (mallopt(3), M_MMAP_THRESHOLD: dynamic); without it each
# temporary array costs page faults: 119 instead of 28 ns per float were measured
np.empty(1 << 24, np.uint8)


Bytes: TypeAlias = NDArray[np.uint8]
Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Words: TypeAlias = NDArray[np.uint64]
Flags: TypeAlias = NDArray[np.bool_]
