"""Tables as streams: CSV and TSV with a header, and columns between blanks; every byte that is not ours passes.

id,x,y,z,tag                            1305031102.1758 1.34 0.62 1.65 0.657 0.612 -0.295 -0.311
007,1.0,2.0,3.0,"a,b"                   (TUM: t x y z qx qy qz qw; s, m; the pose of the body in the world)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError
from frametool.stream.rows import Block, Broken
from frametool.text.cells import split_blank, split_delimited, torn_record, without_quotes
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.stream.output_columns import Layout
    from frametool.text.cells import Cells

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
COMMENT = b"#"
UNCLOSED = "a quote is opened here and not closed"


class Table(NamedTuple):
    """How a table is written: what is between cells (b"" for blanks), its column names if it has any, and its width.

    head: what comes before the first row; header: the raw text of the header's cells, head included
    """

    delimiter: bytes
    names: tuple[str, ...] | None
    width: int
    head: bytes = b""
    header: tuple[bytes, ...] = ()
    line_end: bytes = b"\n"

    def split(self, block: bytes) -> Cells:
        """Find the cells of a block."""
        if self.delimiter:
            return split_delimited(block, self.delimiter, self.width)
        return split_blank(block, self.width, comment=COMMENT)

    def name(self, place: int) -> str:
        """Name a column for messages."""
        return self.names[place] if self.names else f"column {place + 1}"


def open_table(block: bytes, delimiter: bytes, *, header: bool, source: str) -> tuple[Table, bytes]:
    """Look at the first block; give the table and the block without what stands before the first row."""
    mark = BYTE_ORDER_MARK if block.startswith(BYTE_ORDER_MARK) else b""
    rest = block[len(mark) :]
    skipped = _comments(rest) if not delimiter else 0
    line = _first_record(rest[skipped:], delimiter)
    if delimiter and torn_record(line, delimiter) is not None:
        raise FormatError(UNCLOSED, source=source, line=1)
    cells = _cells(line, delimiter)
    if not cells:
        raise FormatError("no rows in it", source=source)
    names = tuple(_unquoted(cell) for cell in cells)
    head = mark + rest[:skipped]
    numeric = [_is_number(name) for name in names]
    if not header or (not delimiter and any(numeric)):
        return Table(delimiter, None, len(cells), head), rest[skipped:]
    if all(numeric):
        raise FormatError("the first line holds numbers and no names; give --no-header", source=source, line=1)
    _refuse_repeated(names, source, 1 + head.count(b"\n"))
    end = line[len(line.rstrip(b"\r\n")) :] or b"\n"
    return Table(delimiter, names, len(cells), head, tuple(cells), end), rest[skipped + len(line) :]


def _comments(text: bytes) -> int:
    """Return the length of the comments and empty lines at the start."""
    end = 0
    for line in text.splitlines(keepends=True):
        if line.strip() and not line.startswith(COMMENT):
            break
        end += len(line)
    return end


def _first_record(text: bytes, delimiter: bytes) -> bytes:
    """Return the first line, its end included; a quoted cell may hold line ends."""
    end = text.find(b"\n") + 1
    while delimiter and end and text.count(b'"', 0, end) % 2:
        end = text.find(b"\n", end) + 1
    return text[:end] if end else text


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


def _refuse_repeated(names: Sequence[str], source: str, line: int) -> None:
    repeated = sorted({name for name in names if name and names.count(name) > 1})
    if repeated:
        raise FormatError(f"columns stand twice in the header: {', '.join(repeated)}", source=source, line=line)


def table_block(table: Table, layout: Layout, text: bytes) -> Block:
    """Find the rows of a block, their numbers, and the stretches of text that pass."""
    cells = table.split(text)
    columns = _as_slice(layout.places)
    numbers = Spans(cells.data, cells.starts[:, columns], cells.ends[:, columns])
    if b'"' in text and layout.places:
        numbers = without_quotes(numbers)
    parts = [_stretch(cells, *stretch) for stretch in layout.stretches]
    frames: Sequence[str] = ()
    if layout.frames:
        named = [_texts(cells, place) for place in layout.frames]
        frames = ["\0".join(names) for names in zip(*named, strict=True)]
    stamps = [] if layout.time is None else [(without_quotes(cells.column(layout.time)),)]
    odd, broken = [], []
    if len(cells.rows) < len(cells.counts):
        for line in cells.odd_lines().tolist():
            raw = cells.line(line)
            if cells.counts[line] == 0:
                odd.append((line, raw))
            else:
                broken.append(_broken(table, layout, cells, line, raw))
    return Block(
        numbers, parts, cells.rows, lambda row: cells.lines_before(int(cells.rows[row])), odd, broken, frames, stamps
    )


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


def _texts(cells: Cells, place: int) -> list[str]:
    column = without_quotes(cells.column(place))
    return [column.text(row).decode("utf-8", "replace") for row in range(len(cells.rows))]


def _broken(table: Table, layout: Layout, cells: Cells, line: int, raw: bytes) -> Broken:
    """Describe a row with too few or too many cells."""
    count = int(cells.counts[line])
    named = f" ({' '.join(table.names)})" if table.names and len(table.names) < 12 else ""
    reason = f"expected {table.width} cells{named}, found {count}"
    body = raw.rstrip(b"\r\n")
    given = _cells(raw, table.delimiter)
    null_row = layout.null_row(given) + raw[len(body) :]
    return Broken(line, cells.lines_before(line), "", reason, null_row)
