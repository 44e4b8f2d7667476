"""Point clouds: what those with a header share, PCD and PLY; and those without, of KITTI and nuScenes.

Records are binary, or lines of numbers between blanks.  Unchanged data are preserved byte for byte: in text, blanks,
line ends and the digits of other columns too.  Headers are parsed and written by their formats.

A cloud without a header is consecutive points, four or five float32 (little-endian) each:

    x y z intensity            KITTI, velodyne/000000.bin
    x y z intensity ring       nuScenes, LIDAR_TOP/*.pcd.bin

Metres, in the frame of the lidar.  The file does not state which of the two it is: `--in` does.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from frametool.errors import ValueInvalid, listing, shown, warn
from frametool.formats.rows import column_file
from frametool.formats.table import FORMATS
from frametool.grammar.readers import NORMALS
from frametool.text.lines import read_blocks
from frametool.text.numbers import explain_number
from frametool.text.parse import parse_floats
from frametool.text.spans import MARGIN, Cells, Spans, framed, join, split_blank
from frametool.text.write import fixed_spans, rounded_to_single, shortest_spans

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from frametool.documents.source import InputFile
    from frametool.errors import FormatError
    from frametool.formats.rows.column_file import Kind, Made, OutColumn
    from frametool.grammar.result import Style
    from frametool.text.spans import Floats, Ints

Code = TypeVar("Code")

LONGEST_HEAD = 1 << 20  # bytes of a header: a hundred times the longest known
_MOST_POINTS = 1 << 62
_NOT_FINITE = {"nan": np.nan, "inf": np.inf, "infinity": np.inf}
_SINGLE = np.dtype("<f4")


class CloudFile(column_file.RecordFile):
    """The points of a file whose header has been read: records, or rows of text.

    at: in text, the positions of its columns among the `cells` numbers of a row; None for records
    line: that of the next row of text, from 1
    behind: what was read after the last point
    header: from columns and a count to the header with changes, and everything before the points; raises ValueInvalid
    record_with: from columns to the type of a point with these; raises ValueInvalid for what the format cannot hold
    """

    vectors = NORMALS
    what = "points"  # in messages
    is_last = True  # nothing follows the points
    at: Sequence[int] | None = None
    cells = line = 0
    behind = b""
    names: tuple[str, ...]
    header: Callable[[Sequence[OutColumn], int], bytes]
    record_with: Callable[[Sequence[OutColumn]], Kind]

    def batches(self) -> Iterator[column_file.Batch]:
        """Yield the points; raises FormatError if the file ends too early, or has more."""
        yield from super().batches() if self.at is None else self._rows_of_text(self.at)
        if not self.is_last:
            return
        if self.at is None:
            self.behind = self.file.stream.read(self.record.itemsize)
            if self.behind and len(self.behind) == self.record.itemsize:
                raise self.file.error(f"the header says {self.count} {self.what}, more follow")
            return
        blanks = [self.behind]
        while not blanks[-1].strip() and (piece := self.file.stream.read(column_file.PIECE)):
            blanks.append(piece)
        if blanks[-1].strip():
            more = f"the header says {self.count} points, more rows follow; correct the header"
            raise self.file.error(more, self.line)
        self.behind = b"".join(blanks)

    def _rows_of_text(self, at: Sequence[int]) -> Iterator[TextBatch]:
        """Yield the rows; raises FormatError for a row of another width, or if the file ends too early."""
        left = self.count
        for block in read_blocks(self.file.stream) if left else ():  # type: ignore[arg-type]
            cells = split_blank(block, self.cells, comment=b"")
            filled = np.flatnonzero(cells.counts)
            if len(filled) > left:
                end = int(cells.line_ends[filled[left - 1]]) - MARGIN
                self.behind = block[end:]
                cells = split_blank(block[:end], self.cells, comment=b"")
            wrong = np.flatnonzero((cells.counts != self.cells) & (cells.counts != 0))
            if wrong.size:
                columns = " ".join(self.names[:8]) + " .." * (self.cells > 8)
                found = f"expected {self.cells} numbers ({columns}), found {int(cells.counts[wrong[0]])}"
                raise self.file.error(found, self.line + int(wrong[0]))
            yield TextBatch(cells, self, at)
            self.line += len(cells.counts)
            left -= len(cells.rows)
            if not left:
                return
        if left:
            raise self.file.error(f"the header says {self.count} points, the file holds {self.count - left}")

    def rest(self) -> Iterator[bytes]:
        """Yield the rest of the file after the points."""
        yield self.behind

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> column_file.CountedWriter:
        """Return a writer for a cloud of the same format."""
        encode: column_file.Encode = partial(encode_text, columns, style)
        own, new = columns[: self.width], columns[self.width :]
        if self.at is None:
            kind = self.record if same_columns(columns, self.width) else self.record_with(columns)
            encode = partial(column_file.encode_records, columns, kind)
        elif not same_columns(own, self.width) or any(column.passed is not None for column in new):
            raise ValueInvalid("columns of an ascii cloud stay as they are; -f csv writes others")
        head, count = partial(self.header, columns), None if drops else self.count
        return column_file.CountedWriter(encode, head, count, self.rest)


def same_columns(columns: Sequence[OutColumn], width: int) -> bool:
    """Return True if the columns of an output are those of the input, in the same order."""
    return len(columns) == width and all(column.passed in (None, at) for at, column in enumerate(columns))


def head_lines(file: InputFile, text: list[bytes], last: str) -> Iterator[list[str]]:
    """Yield the words of a header's lines, which are added to the text; raises FormatError if it does not end.

    last: the line that ends it
    """
    size = sum(map(len, text))
    while True:
        text.append(line := file.stream.readline(LONGEST_HEAD))
        size += len(line)
        if not line:
            raise file.error(f"the header ends before its {last} line; is the file whole?", len(text))
        if size > LONGEST_HEAD:
            raise file.error(f"no {last} line in the first megabyte; is it a header?", len(text))
        if words := line.decode("latin-1").split():
            yield words


def count_in(word: str, what: str, file: InputFile, line: int) -> int:
    """Read a count of items, which an error calls `what`; raises FormatError."""
    if not (word.isascii() and word.isdecimal()) or len(word) > 19 or int(word) > _MOST_POINTS:
        raise file.error(f"{what} is not a count", line)
    return int(word)


def misfit_of(codes: Collection[str], column: OutColumn, taken: Collection[str] = ()) -> str:
    """Return why a format cannot hold a column, "" if it can.

    codes: its types in numpy's notation, without byte order; taken: reserved names
    """
    if column.kind is None or column.kind.str[1:] not in codes:
        return f"it has no type for {column.kind}" if column.kind is not None else "it holds numbers"
    one_word = column.name.split() == [column.name] and column.name not in taken
    return "" if one_word else "a name is one word without blanks" + f", and not {' or '.join(taken)}" * bool(taken)


def type_in(fmt: str, codes: Mapping[str, Code], column: OutColumn, taken: Collection[str] = ()) -> Code:
    """Return a format's name for the type of a column; raises ValueInvalid if it has none."""
    if (reason := misfit_of(codes, column, taken)) or column.kind is None:
        raise ValueInvalid(f"column {shown(column.name)} does not fit in {fmt}: {reason}")
    return codes[column.kind.str[1:]]


class TextBatch(column_file.Batch):
    """Rows of text; a number that is not finite means a missing number."""

    def __init__(self, cells: Cells, cloud: CloudFile, at: Sequence[int]) -> None:
        """Store the cells of the next rows of a cloud, and the positions of its columns among them."""
        self.cells, self.cloud, self.at, self.line = cells, cloud, at, cloud.line
        self.size = len(cells.rows)
        self.bytes_read = len(cells.data) - 2 * MARGIN

    def _problem(self, row: int, place: int, reason: str) -> FormatError:
        return self.cloud.file.error(f"{self.cloud.names[place]}: {reason}", self.line + int(self.cells.rows[row]))

    def numbers(self, place: int) -> tuple[Floats, None]:
        """Return a column as floats; raises FormatError for a cell that is not a number."""
        column = self.cells.column(self.at[place])
        values, bad = parse_floats(column)
        for row in bad.tolist():
            text = column.text(row).decode("utf-8", "replace")
            known = _NOT_FINITE.get(text.lower().lstrip("+-"))
            if known is None:
                raise self._problem(row, place, explain_number(text))
            values[row] = -known if text.startswith("-") else known
        return values, None

    def texts(self, place: int) -> list[str]:
        """Return a column as texts."""
        column = self.cells.column(self.at[place])
        return [column.text(row).decode("utf-8", "replace") for row in range(self.size)]

    def column(self, place: int) -> Any:
        """Return a column as numbers of its type; raises FormatError for a number that does not fit it."""
        kind, values = self.cloud.record[place], self.numbers(place)[0]
        if kind.kind not in column_file.WHOLE:
            return values.astype(kind)
        numbers = []
        for row, text in enumerate(self.texts(place)):
            try:
                numbers.append(kind.type(int(text)))
            except (ValueError, OverflowError):  # written with a point, or too large
                raise self._problem(row, place, f"{text} is no {kind.name}") from None
        return np.array(numbers, kind)


def encode_text(
    columns: Sequence[OutColumn], style: Style, batch: TextBatch, rows: Ints | None, made: Sequence[Made]
) -> bytes:
    """Return rows with new numbers in place of their cells, or after them in further columns.

    They are the shortest text of their type, or have fixed decimals.
    """
    cells = batch.cells
    chosen = np.arange(batch.size) if rows is None else rows
    if not len(chosen):
        return b"" if rows is not None else cells.data[MARGIN:-MARGIN].tobytes()
    lines = cells.rows[chosen]
    at, ends = cells.line_starts[lines], cells.line_ends[lines]
    if rows is None:  # text between rows, or after the last, belongs to one of them
        at = np.concatenate([[MARGIN], ends[:-1]])
        ends = np.append(ends[:-1], len(cells.data) - MARGIN)
    new, parts = iter(made), list[Spans]()
    for place, column in enumerate(columns):
        if column.passed is not None:
            continue
        if column.kind is None:
            raise ValueInvalid(f"column {column.name} holds texts; the rows of a cloud are numbers")
        values = np.asarray(next(new).values, np.float64).reshape(-1, 1)
        if style.precision is not None:
            spans = fixed_spans(values, style.precision, b" ")
        else:
            spans = shortest_spans(rounded_to_single(values) if column.kind == _SINGLE else values, b" ")
        written = Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)
        if place < len(batch.at):
            end = cells.ends[chosen, batch.at[place]]
            parts += [Spans(cells.data, at, cells.starts[chosen, batch.at[place]]), written]
        else:
            end, blank = cells.ends[chosen, -1], np.full(len(chosen), MARGIN)
            parts += [Spans(cells.data, at, end), Spans(framed(b" "), blank, blank + 1), written]
        at = end
    return join([*parts, Spans(cells.data, at, ends)])


# --- points without a header ---


class BinCloud(column_file.RecordFile):
    """The points of a file without a header."""

    def __init__(self, file: InputFile) -> None:
        """Count the points; raises FormatError if the last one is incomplete."""
        names = FORMATS[file.format].rows.columns
        record = column_file.record_of([_SINGLE] * len(names))
        file.stream = column_file.seekable(file, self)
        size = column_file.bytes_left(file.stream) or 0
        if size % record.itemsize:
            others = [name for name, row in FORMATS.items() if row.reader == __name__ and name != file.format]
            fits = [name for name in others if size % (_SINGLE.itemsize * len(FORMATS[name].rows.columns)) == 0]
            hint = f"; --in {fits[0]} fits" if fits else "; is it whole?"
            points = f"points of {record.itemsize} bytes (float32 {' '.join(names)})"
            raise file.error(f"{size} bytes are no whole number of {points}{hint}")
        super().__init__(file, names, record, size // record.itemsize)

    def batches(self) -> Iterator[column_file.Batch]:
        """Yield the points; raises FormatError for invalid rings."""
        done = 0
        for batch in super().batches():
            rings = batch.column(self.width - 1) if "ring" in FORMATS[self.file.format].rows.columns else np.zeros(0)
            bad = np.flatnonzero((rings != np.rint(rings)) | (rings < 0))
            if len(bad):
                found = f"ring: {rings[bad[0]]:g} is not a ring number; is it --in kitti-bin?"
                raise self.file.error(found, done + int(bad[0]) + 1)
            done += batch.size
            yield batch

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> PointsWriter:
        """Return a writer for a cloud of either format."""
        del drops
        return PointsWriter(columns, None, style)


class PointsWriter:
    """Writes points without a header; `off` is the largest rounding error of float32."""

    def __init__(self, columns: Sequence[OutColumn], _count: int | None, style: Style) -> None:
        """Find the columns; raises ValueInvalid if one is missing, and warns about those that are omitted."""
        self.columns, self.format = columns, (fmt := style.format)
        self.names = FORMATS[fmt].rows.columns
        self.off = 0.0
        at_input = [column.name for column in columns if column.kind is not None]
        if missing := [name for name in self.names if name not in at_input]:
            raise ValueInvalid(f"{fmt} holds {' '.join(self.names)}; there is no {listing(missing)}")
        if others := [column.name for column in columns if column.name not in self.names]:
            warn(f"{fmt}: {listing(others)} left out: it holds {' '.join(self.names)} alone")

    def of_rows(self, batch: column_file.Batch | None, rows: Ints | None, made: Sequence[Made]) -> bytes:
        """Return the bytes of some points."""
        new, found = iter(made), {}
        for column in self.columns:
            if column.passed is None or batch is None:
                found[column.name] = next(new).values
            else:
                passed = batch.column(column.passed)
                found[column.name] = passed if rows is None else passed[rows]
        points = np.empty((len(found[self.names[0]]), len(self.names)), _SINGLE)
        for at, name in enumerate(self.names):
            with np.errstate(over="ignore", invalid="ignore"):
                points[:, at] = found[name]
                far = abs(points[:, at] - found[name])
            if np.isinf(far).any():
                raise ValueInvalid(f"column {name}: {found[name][np.isinf(far)][0]:g} is too large for float32")
            self.off = max(self.off, float(np.nanmax(far, initial=0.0)))
        return points.tobytes()

    def end(self) -> Iterator[bytes]:
        """Warn about rounding."""
        if self.off:
            warn(f"{self.format}: numbers are float32; they were rounded by up to {self.off:.1g}")
        return iter(())


open_columns, create = BinCloud, PointsWriter
