"""Rows of numbers between blanks whose columns have types, as in the ascii forms of point clouds.

What is not changed passes byte for byte: blanks, line ends, the digits of other columns.
"""

from __future__ import annotations

from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any
from weakref import finalize

import numpy as np

from frametool.errors import FormatError, ValueInvalid
from frametool.formats.rows.column_file import WHOLE, ColumnNumbers
from frametool.formats.rows.structured import PIECE, stamps_of_numbers
from frametool.text.cells import split_blank
from frametool.text.lines import read_blocks
from frametool.text.numbers import explain_number
from frametool.text.parse import parse_floats
from frametool.text.spans import MARGIN, Spans, framed, join
from frametool.text.write import fixed_spans, rounded_to_single, shortest_spans

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Kind, Made, OutColumn
    from frametool.grammar.result import Style
    from frametool.text.cells import Cells
    from frametool.text.spans import Floats, Ints

_NOT_FINITE = {"nan": np.nan, "inf": np.inf, "infinity": np.inf}
_EXACT = 2.0**53
_SINGLE = np.dtype(np.float32)


class TextBatch:
    """Some rows; a number that is not finite stands for no number."""

    def __init__(
        self, cells: Cells, kinds: Sequence[Kind], at: Sequence[int], place: Callable[[int, int, str], FormatError]
    ) -> None:
        """Take the cells of rows, the type of each column and where it stands among them.

        place: makes the error for a number, by row and column.
        """
        self.cells = cells
        self.kinds = kinds
        self.at = at
        self.place = place

    @property
    def size(self) -> int:
        """Count the rows."""
        return len(self.cells.rows)

    @property
    def bytes_read(self) -> int:
        """Count the bytes of the file that they take."""
        return len(self.cells.data) - 2 * MARGIN

    def numbers(self, place: int) -> ColumnNumbers:
        """Return a column as floats; raises FormatError for a cell that is no number."""
        column = self.cells.column(self.at[place])
        values, bad = parse_floats(column)
        for row in bad.tolist():
            text = column.text(row).decode("utf-8", "replace")
            known = _NOT_FINITE.get(text.lower().lstrip("+-"))
            if known is None:
                raise self.place(row, place, explain_number(text))
            values[row] = -known if text.startswith("-") else known
        return ColumnNumbers(values)

    def stamps(self, place: int, *, in_ns: bool) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and why rows have none."""
        return stamps_of_numbers(self.column(place), in_ns=in_ns)

    def texts(self, place: int) -> list[str]:
        """Return a column as texts."""
        column = self.cells.column(self.at[place])
        return [column.text(row).decode("utf-8", "replace") for row in range(self.size)]

    def column(self, place: int) -> Any:
        """Return a column as numbers of its kind."""
        kind = self.kinds[place]
        values = self.numbers(place).values
        if kind.kind not in WHOLE:
            return values.astype(kind)
        try:
            return np.array([int(text) for text in self.texts(place)], kind)
        except (ValueError, OverflowError):
            return self._whole(values, place)

    def _whole(self, values: Floats, place: int) -> Any:
        """Return numbers written with a point as integers; raises FormatError for what is none of the column's kind."""
        kind = self.kinds[place]
        limits = np.iinfo(kind)
        good = (values == np.rint(values)) & (values >= limits.min) & (values <= limits.max) & (abs(values) < _EXACT)
        if not good.all():
            row = int(np.flatnonzero(~good)[0])
            raise self.place(row, place, f"{self.texts(place)[row]} is no {kind.name}")
        return values.astype(kind)


class TextRows:
    """The rows of a stream of text, batch after batch, and what follows them.

    line: that of the next row, from 1
    """

    def __init__(
        self, file: InputFile, names: Sequence[str], kinds: Sequence[Kind], at: Sequence[int], width: int, count: int,
        line: int,
    ) -> None:  # fmt: skip
        """Take the columns and where they stand among the `width` cells of a row, and how many rows there shall be."""
        self.file = file
        self.names = names
        self.kinds = kinds
        self.at = at
        self.width = width
        self.count = count
        self.line = line
        self._rest = b""

    def batches(self) -> Iterator[TextBatch]:
        """Yield the rows; raises FormatError for a row of another width, or where the file ends too early."""
        done = 0
        for block in read_blocks(self.file.stream) if self.count else ():  # type: ignore[arg-type]
            batch = self._batch(block, self.count - done)
            done += batch.size
            yield batch
            self.line += len(batch.cells.counts)
            if done == self.count:
                return
        if done < self.count:
            raise FormatError(f"the header says {self.count} points, the file holds {done}", source=self.file.name)

    def _batch(self, block: bytes, most: int) -> TextBatch:
        """Split a block into cells, and keep what stands behind the last row that is wanted."""
        cells = split_blank(block, self.width, comment=b"")
        if int(np.count_nonzero(cells.counts)) > most:
            last = int(np.flatnonzero(cells.counts)[most - 1])
            end = int(cells.line_ends[last]) - MARGIN
            self._rest = block[end:]
            cells = split_blank(block[:end], self.width, comment=b"")
        wrong = np.flatnonzero((cells.counts != self.width) & (cells.counts != 0))
        if wrong.size:
            line = int(wrong[0])
            found = int(cells.counts[line])
            raise FormatError(
                f"expected {self.width} numbers ({' '.join(self.names[:8])}{' ..' * (self.width > 8)}), found {found}",
                source=self.file.name,
                line=self.line + line,
            )
        first = self.line

        def place(row: int, column: int, reason: str) -> FormatError:
            line = first + int(cells.rows[row])
            return FormatError(f"{self.names[column]}: {reason}", source=self.file.name, line=line)

        return TextBatch(cells, self.kinds, self.at, place)

    def behind(self) -> Iterator[bytes]:
        """Yield what stands behind the last row."""
        if self._rest:
            yield self._rest
        while piece := self.file.stream.read(PIECE):
            yield piece

    def check_end(self) -> bytes:
        """Return the blanks behind the last row; raises FormatError where more rows stand there."""
        blanks: list[bytes] = []
        for piece in self.behind():
            if piece.strip():
                raise FormatError(
                    f"the header says {self.count} points, more rows follow; correct the header",
                    source=self.file.name,
                    line=self.line,
                )
            blanks.append(piece)
        return b"".join(blanks)


class TextWriter:
    """Write rows as they were, with what is made in the place of their cells, or behind them."""

    def __init__(
        self, columns: Sequence[OutColumn], width: int, style: Style, *, head: Callable[[int], bytes],
        count: int | None, behind: Callable[[], Iterable[bytes]],
    ) -> None:  # fmt: skip
        """Take the columns of the output and how many the input has.

        head: makes the header for so many rows; count: how many there will be, None if that is known at the end only
        behind: yields what follows the rows
        Raises ValueInvalid where the columns of the input do not stay.
        """
        if not same_columns(columns[:width], width) or any(column.passed is not None for column in columns[width:]):
            raise ValueInvalid("columns of an ascii cloud stay as they are; -f csv writes others")
        self.columns = columns
        self.style = style
        self.head = head
        self.count = count
        self.behind = behind
        self.written = 0
        self.begun = False
        self.waiting = None if count is not None else TemporaryFile()  # noqa: SIM115 - closed with the writer
        if self.waiting is not None:
            finalize(self, self.waiting.close)

    def of_rows(self, batch: Any, rows: Ints | None, made: Sequence[Made]) -> bytes:
        """Return the text of a batch."""
        text = splice(batch, rows, self.columns, made, self.style)
        self.written += batch.size if rows is None else len(rows)
        if self.waiting is not None:
            self.waiting.write(text)
            return b""
        head = b"" if self.begun else self.head(self.count or 0)
        self.begun = True
        return head + text

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last batch; all, if the rows had to be counted first."""
        if not self.begun:
            yield self.head(self.written)
        if self.waiting is not None:
            self.waiting.seek(0)
            while piece := self.waiting.read(PIECE):
                yield piece
        yield from self.behind()


def same_columns(columns: Sequence[OutColumn], width: int) -> bool:
    """Tell whether the columns of an output are those of the input, each in its place."""
    return len(columns) == width and all(column.passed in (None, at) for at, column in enumerate(columns))


def splice(
    batch: TextBatch, rows: Ints | None, columns: Sequence[OutColumn], made: Sequence[Made], style: Style
) -> bytes:
    """Return the text of a batch with what is made in its columns, which follow one another as the input's do.

    rows: those that are kept (None: all).  Columns beyond those of the input stand at the ends of the lines.
    """
    cells = batch.cells
    chosen = np.arange(batch.size) if rows is None else rows
    if not len(chosen):
        return b"" if rows is not None else cells.data[MARGIN:-MARGIN].tobytes()
    lines = cells.rows[chosen]
    begins = cells.line_starts[lines]
    ends = cells.line_ends[lines]
    if rows is None:  # what stands between rows, or behind the last, belongs to one of them
        begins = np.concatenate([[MARGIN], ends[:-1]])
        ends = np.append(ends[:-1], len(cells.data) - MARGIN)
    at = begins
    places = {column: place for place, column in enumerate(batch.at)}
    new = dict(zip(_made_at(columns), made, strict=True))
    parts: list[Spans] = []
    for _, place in sorted(places.items()):
        if place in new:
            start, end = (each[chosen, batch.at[place]] for each in (cells.starts, cells.ends))
            written = _unless_lost(_written(new[place], columns[place], style), Spans(cells.data, start, end))
            parts += [Spans(cells.data, at, start), written]
            at = end
    for place in sorted(new.keys() - set(places.values())):
        end = cells.ends[chosen, -1]
        parts += [Spans(cells.data, at, end), _constant(b" ", len(chosen)), _written(new[place], columns[place], style)]
        at = end
    return join([*parts, Spans(cells.data, at, ends)])


def _made_at(columns: Sequence[OutColumn]) -> list[int]:
    return [place for place, column in enumerate(columns) if column.passed is None]


def _written(made: Made, column: OutColumn, style: Style) -> Spans:
    """Write numbers as the shortest text of their kind, or with so many decimals."""
    kind = column.kind
    if kind is None:
        raise ValueInvalid(f"column {column.name} holds texts; the rows of a cloud are numbers")
    values = np.asarray(made.values, np.float64).reshape(-1, 1)
    if style.precision is not None:
        spans = fixed_spans(values, style.precision, b" ")
    else:
        spans = shortest_spans(rounded_to_single(values) if kind == _SINGLE else values, b" ")
    return Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)


def _unless_lost(new: Spans, old: Spans) -> Spans:
    """Keep the text of cells that held no number: `-nan` stays."""
    first = new.data[new.starts]
    odd = np.flatnonzero((first == ord("n")) | (first == ord("i")) | (first == ord("-")))
    kept = odd[_begin_with_letters(old, odd)] if odd.size else odd
    if not kept.size:
        return new
    starts, ends = new.starts.copy(), new.ends.copy()
    starts[kept] = old.starts[kept] + len(new.data)
    ends[kept] = old.ends[kept] + len(new.data)
    return Spans(np.concatenate([new.data, old.data]), starts, ends)


def _begin_with_letters(spans: Spans, rows: Ints) -> Any:
    """Tell which texts begin with a letter behind their sign."""
    starts = spans.starts[rows]
    first = spans.data[starts]
    first = spans.data[starts + ((first == ord("-")) | (first == ord("+")))]
    return first >= ord("A")


def _constant(text: bytes, size: int) -> Spans:
    starts = np.full(size, MARGIN, np.int64)
    return Spans(framed(text), starts, starts + len(text))
