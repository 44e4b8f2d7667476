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
from itertools import chain
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from frametool.errors import FormatError, ValueInvalid, listing, shown, warn
from frametool.formats.rows import column_file
from frametool.formats.table import FORMATS
from frametool.grammar.readers import NORMALS
from frametool.text.cells import Cells, split_blank
from frametool.text.lines import read_blocks
from frametool.text.numbers import explain_number
from frametool.text.parse import parse_floats
from frametool.text.spans import MARGIN, Ints, Spans, framed, join
from frametool.text.write import fixed_spans, rounded_to_single, shortest_spans

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
    from typing import BinaryIO

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Kind, Made, OutColumn
    from frametool.grammar.result import Style

Code = TypeVar("Code")

LONGEST_HEAD = 1 << 20  # bytes of a header: a hundred times the longest known
_MOST_POINTS = 1 << 62
_NOT_FINITE = {"nan": np.nan, "inf": np.inf, "infinity": np.inf}
_SINGLE = np.dtype("<f4")


class CloudFile(column_file.RecordFile):
    """The points of a file whose header has been read."""

    vectors = NORMALS
    what = "points"  # in messages
    text: TextRows | None = None
    is_last = True  # nothing follows the points
    behind = b""
    names: tuple[str, ...]

    def batches(self) -> Iterator[column_file.Batch]:
        """Yield the points; raises FormatError if the file ends too early, or has more."""
        if self.text is not None:
            yield from self.text.batches()
            self.behind = self.text.check_end() if self.is_last else b""
            return
        yield from super().batches()
        self.behind = self.file.stream.read(self.record.itemsize) if self.is_last else b""
        if self.behind and len(self.behind) == self.record.itemsize:
            raise self.file.error(f"the header says {self.count} {self.what}, more follow")

    def rest(self) -> Iterator[bytes]:
        """Yield the rest of the file after the points."""
        return iter((self.behind,))

    def header(self, columns: Sequence[OutColumn], count: int) -> bytes:
        """Return the header with changes, and everything before the points; raises ValueInvalid."""
        raise NotImplementedError

    def record_with(self, columns: Sequence[OutColumn]) -> Kind:
        """Return the type of a point with other columns; raises ValueInvalid for what the format cannot hold."""
        raise NotImplementedError

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> column_file.CountedWriter:
        """Return a writer for a cloud of the same format."""
        head, count = partial(self.header, columns), None if drops else self.count
        if self.text is None:
            kind = self.record if same_columns(columns, self.width) else self.record_with(columns)
            return column_file.CountedWriter(partial(column_file.encode_records, columns, kind), head, count, self.rest)
        beyond = columns[self.width :]
        if not same_columns(columns[: self.width], self.width) or any(column.passed is not None for column in beyond):
            raise ValueInvalid("columns of an ascii cloud stay as they are; -f csv writes others")
        return column_file.CountedWriter(partial(encode_text, columns, style), head, count, self.rest)


def same_columns(columns: Sequence[OutColumn], width: int) -> bool:
    """Return True if the columns of an output are those of the input, in the same order."""
    return len(columns) == width and all(column.passed in (None, at) for at, column in enumerate(columns))


def head_lines(
    stream: BinaryIO, text: list[bytes], fail: Callable[[str], FormatError], last: str
) -> Iterator[list[str]]:
    """Yield the words of a header's lines, which are added to the text; raises FormatError if it does not end.

    last: the line that ends it
    """
    size = sum(map(len, text))
    while True:
        text.append(line := stream.readline(LONGEST_HEAD))
        size += len(line)
        if not line:
            raise fail(f"the header ends before its {last} line; is the file whole?")
        if size > LONGEST_HEAD:
            raise fail(f"no {last} line in the first megabyte; is it a header?")
        if words := line.decode("latin-1").split():
            yield words


def count_in(word: str, what: str, fail: Callable[[str], FormatError]) -> int:
    """Read a count of items, which an error calls `what`; raises FormatError."""
    if not (word.isascii() and word.isdecimal()) or len(word) > 19 or int(word) > _MOST_POINTS:
        raise fail(f"{what} is not a count")
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


# --- points as lines of text ---


class TextRows:
    """The rows of a stream of text, in batches, and what follows them.

    line: that of the next row, from 1
    """

    def __init__(self, cloud: CloudFile, at: Sequence[int], width: int, line: int) -> None:
        """Store the positions of a cloud's columns among the `width` cells of a row."""
        self.cloud, self.at, self.width, self.line = cloud, at, width, line
        self._rest = b""

    def problem(self, message: str, line: int = 0) -> FormatError:
        """Return the error for a line, or for the file."""
        return self.cloud.file.error(message, line)

    def batches(self) -> Iterator[TextBatch]:
        """Yield the rows; raises FormatError for a row of another width, or if the file ends too early."""
        done, count = 0, self.cloud.count
        for block in read_blocks(self.cloud.file.stream) if count else ():  # type: ignore[arg-type]
            batch = self._batch(block, count - done)
            done += batch.size
            yield batch
            self.line += len(batch.cells.counts)
            if done == count:
                return
        if done < count:
            raise self.problem(f"the header says {count} points, the file holds {done}")

    def _batch(self, block: bytes, most: int) -> TextBatch:
        """Split a block into cells, and keep what follows the last row."""
        cells = split_blank(block, self.width, comment=b"")
        filled = np.flatnonzero(cells.counts)
        if len(filled) > most:
            end = int(cells.line_ends[filled[most - 1]]) - MARGIN
            self._rest = block[end:]
            cells = split_blank(block[:end], self.width, comment=b"")
        wrong = np.flatnonzero((cells.counts != self.width) & (cells.counts != 0))
        if wrong.size:
            columns = " ".join(self.cloud.names[:8]) + " .." * (self.width > 8)
            found = int(cells.counts[wrong[0]])
            raise self.problem(f"expected {self.width} numbers ({columns}), found {found}", self.line + int(wrong[0]))
        return TextBatch(cells, self)

    def behind(self) -> Iterator[bytes]:
        """Yield what follows the last row."""
        return chain((self._rest,), column_file.pieces(self.cloud.file.stream))

    def check_end(self) -> bytes:
        """Return the blanks after the last row; raises FormatError if more rows follow."""
        blanks: list[bytes] = []
        for piece in self.behind():
            if piece.strip():
                count = self.cloud.count
                raise self.problem(f"the header says {count} points, more rows follow; correct the header", self.line)
            blanks.append(piece)
        return b"".join(blanks)


class TextBatch(column_file.Batch):
    """Rows; a number that is not finite means a missing number."""

    def __init__(self, cells: Cells, table: TextRows) -> None:
        """Store the cells of the next rows of a table."""
        self.cells, self.table = cells, table
        self.line = table.line
        self.size = len(cells.rows)
        self.bytes_read = len(cells.data) - 2 * MARGIN

    def _problem(self, row: int, place: int, reason: str) -> FormatError:
        return self.table.problem(f"{self.table.cloud.names[place]}: {reason}", self.line + int(self.cells.rows[row]))

    def numbers(self, place: int) -> column_file.ColumnNumbers:
        """Return a column as floats; raises FormatError for a cell that is not a number."""
        column = self.cells.column(self.table.at[place])
        values, bad = parse_floats(column)
        for row in bad.tolist():
            text = column.text(row).decode("utf-8", "replace")
            known = _NOT_FINITE.get(text.lower().lstrip("+-"))
            if known is None:
                raise self._problem(row, place, explain_number(text))
            values[row] = -known if text.startswith("-") else known
        return column_file.ColumnNumbers(values)

    def texts(self, place: int) -> list[str]:
        """Return a column as texts."""
        column = self.cells.column(self.table.at[place])
        return [column.text(row).decode("utf-8", "replace") for row in range(self.size)]

    def column(self, place: int) -> Any:
        """Return a column as numbers of its type; raises FormatError for a number that does not fit it."""
        kind, values = self.table.cloud.record[place], self.numbers(place).values
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
    """Return rows with new numbers in place of their cells, or after them in further columns."""
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
        written = _written(next(new).values, column, style)
        if place < len(batch.table.at):
            cell = batch.table.at[place]
            end = cells.ends[chosen, cell]
            parts += [Spans(cells.data, at, cells.starts[chosen, cell]), written]
        else:
            end, blank = cells.ends[chosen, -1], np.full(len(chosen), MARGIN)
            parts += [Spans(cells.data, at, end), Spans(framed(b" "), blank, blank + 1), written]
        at = end
    return join([*parts, Spans(cells.data, at, ends)])


def _written(numbers: Any, column: OutColumn, style: Style) -> Spans:
    """Write numbers as the shortest text of their type, or with fixed decimals."""
    if column.kind is None:
        raise ValueInvalid(f"column {column.name} holds texts; the rows of a cloud are numbers")
    values = np.asarray(numbers, np.float64).reshape(-1, 1)
    if style.precision is not None:
        spans = fixed_spans(values, style.precision, b" ")
    else:
        spans = shortest_spans(rounded_to_single(values) if column.kind == _SINGLE else values, b" ")
    return Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)


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
        return PointsWriter(columns, style.format)


class PointsWriter:
    """Writes points without a header; `off` is the largest rounding error of float32."""

    def __init__(self, columns: Sequence[OutColumn], fmt: str) -> None:
        """Find the columns; raises ValueInvalid if one is missing, and warns about those that are omitted."""
        self.columns, self.format = columns, fmt
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


def create(columns: Sequence[OutColumn], _count: int | None, style: Style) -> PointsWriter:
    """Return a writer for new points."""
    return PointsWriter(columns, style.format)


open_columns = BinCloud
