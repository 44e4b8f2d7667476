"""Tables as streams: CSV and TSV with a header, and columns between blanks; every byte that is not ours passes.

id,x,y,z,tag                            1305031102.1758 1.34 0.62 1.65 0.657 0.612 -0.295 -0.311
007,1.0,2.0,3.0,"a,b"                   (TUM: t x y z qx qy qz qw; s, m; the pose of the body in the world)
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import FormatError, shown, warn
from frametool.stream.header import has_names_of_ours
from frametool.stream.output_columns import NAMED
from frametool.stream.rows import Block, Broken
from frametool.stream.trajectory_columns import TUM
from frametool.text.cells import split_blank, split_delimited, torn_record, without_quotes
from frametool.text.spans import MARGIN, Spans

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.stream.header import PoseColumns
    from frametool.stream.output_columns import Layout
    from frametool.stream.table_names import Naming
    from frametool.text.array_types import Ints
    from frametool.text.cells import Cells

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
COMMENT = b"#"
NEWLINE = 10
UNCLOSED = "a quote is opened here and not closed"


class Table(NamedTuple):
    """How a table is written.

    delimiter: what is between cells, b"" for blanks
    names: of its columns, if it has any; width: how many cells a row has
    head: what comes before the header, or before the first row
    header: the raw text of the header's cells; title: its whole line; line_end: what ends it
    pose: its columns, where the form says which they are, whatever their names
    """

    delimiter: bytes
    names: tuple[str, ...] | None
    width: int
    head: bytes = b""
    header: tuple[bytes, ...] = ()
    title: bytes = b""
    line_end: bytes = b"\n"
    pose: PoseColumns | None = None

    def split(self, block: bytes) -> Cells:
        """Find the cells of a block."""
        if self.delimiter:
            return split_delimited(block, self.delimiter, self.width)
        return split_blank(block, self.width, comment=COMMENT)

    def name(self, place: int) -> str:
        """Name a column for messages."""
        return self.names[place] if self.names else f"column {place + 1}"

    def opening(self, layout: Layout) -> bytes:
        """Return what stands before the first row of the output: the header as it was where no column changes."""
        if not self.header:
            return self.head
        cells = layout.header(self.header)
        title = self.title if cells == list(self.header) else (self.delimiter or b" ").join(cells)
        return self.head + title + self.line_end


def open_table(block: bytes, delimiter: bytes, *, header: bool, source: str) -> tuple[Table, bytes]:
    """Look at the first block; return the table and the block without what stands before the first row."""
    mark = BYTE_ORDER_MARK if block.startswith(BYTE_ORDER_MARK) else b""
    comments, rest = _comments(block[len(mark) :])
    line = _first_record(rest, delimiter)
    if delimiter and torn_record(line, delimiter) is not None:
        raise FormatError(UNCLOSED, source=source, line=1)
    cells = _cells(line, delimiter)
    named = _named_comment(comments, delimiter, len(cells)) if header else None
    if not cells and not (delimiter and comments):
        raise FormatError("no rows in it", source=source)
    numeric = [_is_number(_unquoted(cell)) for cell in cells]
    own = header and not (all(numeric) if delimiter else any(numeric))
    if named is not None and not (own and has_names_of_ours(map(_unquoted, cells))):
        head, titles, title, end = named
        return Table(delimiter, _names(titles, source), len(titles), mark + head, titles, title, end), rest
    if not own:
        if header and delimiter and len(cells) != len(TUM):
            raise FormatError("the first line holds numbers and no names; give --no-header", source=source, line=1)
        return Table(delimiter, None, len(cells), mark + comments), rest
    title = line.rstrip(b"\r\n")
    end = line[len(title) :] or b"\n"
    table = Table(delimiter, _names(cells, source), len(cells), mark + comments, tuple(cells), title, end)
    return table, rest[len(line) :]


def _comments(text: bytes) -> tuple[bytes, bytes]:
    """Split a text behind the comments and empty lines at its start."""
    end = 0
    for line in text.splitlines(keepends=True):
        if line.strip() and not line.startswith(COMMENT):
            break
        end += len(line)
    return text[:end], text[end:]


def _named_comment(
    comments: bytes, delimiter: bytes, width: int
) -> tuple[bytes, tuple[bytes, ...], bytes, bytes] | None:
    """Take the last comment for the header if it has a word for each column and one of them is a name of ours.

    Returns what stands before its words, the words, their line, and what follows up to the first row.
    """
    lines = [line for line in comments.splitlines(keepends=True) if line.strip()]
    if not lines:
        return None
    start = comments.rindex(lines[-1])
    text = lines[-1].rstrip(b"\r\n")
    words = text.lstrip(b"# \t")
    cells = _cells(words, delimiter)
    if not cells or (width and len(cells) != width) or not has_names_of_ours(map(_unquoted, cells)):
        return None
    before = comments[: start + len(text) - len(words)]
    return before, tuple(cells), words, comments[start + len(text) :]


def _names(cells: Sequence[bytes], source: str) -> tuple[str, ...]:
    """Return the names of columns; a quote within one opens nothing, which is said."""
    for cell in cells:
        if b'"' in cell and not cell.strip().startswith(b'"'):
            warn(f"{source}:1: the quote in the name {shown(_unquoted(cell))} opens nothing and is taken as it stands")
    return tuple(map(_unquoted, cells))


def _first_record(text: bytes, delimiter: bytes) -> bytes:
    """Return the first line, its end included; a quoted cell may hold line ends."""
    end = text.find(b"\n") + 1 or len(text)
    if not delimiter or b'"' not in text[:end]:
        return text[:end]
    ends = split_delimited(text, delimiter, 0).line_ends
    return text[: int(ends[0]) - MARGIN] if len(ends) else text


def _cells(line: bytes, delimiter: bytes) -> list[bytes]:
    """Return the raw cells of one line."""
    if not delimiter:
        return line.split()
    count = int(split_delimited(line, delimiter, 0).counts[0]) if line.strip() else 0
    if not count:
        return []
    cells = split_delimited(line, delimiter, count)
    return [cells.column(index).text(0) for index in range(count)]


def _unquoted(cell: bytes) -> str:
    text = cell.decode("utf-8", "replace").strip()
    return text[1:-1].replace('""', '"') if len(text) > 1 and text[0] == text[-1] == '"' else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def table_block(table: Table, layout: Layout, text: bytes, naming: Naming, *, nulls: bool) -> Block:
    """Find the rows of a block, their numbers, their names, and the stretches of text that pass.

    nulls: rows without numbers are written too.
    """
    cells = table.split(text)
    columns = _as_slice(layout.places)
    numbers = Spans(cells.data, cells.starts[:, columns], cells.ends[:, columns])
    if b'"' in text and layout.places:
        numbers = without_quotes(numbers)
    names = naming.of_block(cells)
    parts = [
        names.spans[begin] if kind == NAMED else _stretch(cells, begin, end, kind, until)
        for begin, end, kind, until in layout.stretches
    ]
    stamps = [] if layout.time is None else [(without_quotes(cells.column(layout.time)),)]
    odd, broken = [], []
    lines_before = _line_counter(cells)
    if len(cells.rows) < len(cells.counts):
        for line in cells.odd_lines().tolist():
            raw = cells.line(line)
            if cells.counts[line] == 0:
                odd.append((line, raw))
            else:
                null_row = _null_row(table, layout, raw) if nulls else b""
                broken.append(Broken(line, lines_before(line), "", _ragged(table, int(cells.counts[line])), null_row))
    return Block(
        numbers, parts, cells.rows, lambda row: lines_before(int(cells.rows[row])), odd, broken, names.frames,
        stamps, names.bad, names.lost,
    )  # fmt: skip


def _as_slice(places: Sequence[int]) -> slice | list[int]:
    """Return neighbouring columns as a slice, which copies nothing."""
    if places and tuple(places) == tuple(range(places[0], places[0] + len(places))):
        return slice(places[0], places[0] + len(places))
    return list(places)


def _stretch(cells: Cells, first: int, last: int, begin: str, end: str) -> Spans:
    """Return the span from one cell to another in every row, with what stands before or after as told."""
    starts = {
        "cell": lambda: cells.starts[:, first],
        "line": lambda: cells.line_starts[cells.rows],
        "gap": lambda: cells.ends[:, first - 1],
        "end": lambda: cells.ends[:, first],
    }[begin]()
    ends = {
        "cell": lambda: cells.ends[:, last],
        "line": lambda: cells.line_ends[cells.rows],
        "gap": lambda: cells.starts[:, last + 1],
    }[end]()
    return Spans(cells.data, starts, ends)


def _line_counter(cells: Cells) -> Callable[[int], int]:
    """Return what counts the line ends before a line: more than its index if cells hold line ends."""

    @cache
    def newlines() -> Ints:
        return np.flatnonzero(cells.data == NEWLINE)

    return lambda line: int(np.searchsorted(newlines(), cells.line_starts[line]))


def _ragged(table: Table, count: int) -> str:
    """Say that a row has too few or too many cells."""
    named = f" ({' '.join(table.names)})" if table.names and len(table.names) < 12 else ""
    return f"expected {table.width} cells{named}, found {count}"


def _null_row(table: Table, layout: Layout, raw: bytes) -> bytes:
    body = raw.rstrip(b"\r\n")
    cells = _cells(raw, table.delimiter) if b'"' in raw or not table.delimiter else body.split(table.delimiter)
    return layout.null_row(cells) + raw[len(body) :]
