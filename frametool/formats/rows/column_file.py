"""Files of columns of numbers, read without any text: what a format has to offer, and what its files share.

The module of a format that is read as `arrays` has `open_columns(file, options) -> ColumnFile`; of one that is written
so, `create(columns, count, style) -> ColumnWriter`.  Rows are counted from 1, batches follow one another.

Records lie in a file as numpy keeps them, the fields of one after the other.  What a header says of them is held
against the file before anything is read, memory taken or written.  Knows no format.
"""

from __future__ import annotations

import os
import stat
from decimal import Decimal
from functools import partial
from shutil import copyfileobj
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias
from weakref import finalize

import numpy as np

from frametool.documents.source import Verbatim
from frametool.errors import FormatError, ValueInvalid, shown
from frametool.frames.stamps import SUFFIXES, nanoseconds_each, tell_size
from frametool.text.parse import nanoseconds_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from typing import BinaryIO

    from numpy.typing import NDArray

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Components
    from frametool.grammar.result import Style
    from frametool.text.spans import Flags, Floats, Ints

    Kind: TypeAlias = np.dtype[Any]
    Encode: TypeAlias = Callable[[Any, Ints | None, Sequence["Made"]], bytes | memoryview]

FLOATS, WHOLE = "f", "iu"  # kinds of numpy's types
STAMP_NS = np.dtype(np.int64)
XYZ = ("x", "y", "z")
PIECE = 1 << 20  # bytes that are copied at once
BATCH_BYTES = 1 << 21
MOST_ROWS = 1 << 15  # of a batch; in cache with what is made of it


class ColumnNumbers(NamedTuple):
    """Numbers of a column: (n,) of float64 or its own type, nan where null, and the nulls (None: there are none)."""

    values: Floats
    nulls: Flags | None = None


class OutColumn(NamedTuple):
    """A column of the output.

    name: "" where columns have no names
    kind: the type of its numbers; None for texts
    passed: the place of the column of the input that passes as it is; None for what is made
    longest: how many characters a text has at most, where that is known; is_json: whether texts are JSON
    """

    name: str
    kind: Kind | None
    passed: int | None = None
    longest: int = 0
    is_json: bool = False


class Made(NamedTuple):
    """What stands in a column that is made: (n,) of its kind, or texts; and the rows that have none (None: all have).

    Numbers of rows that have none are nan.
    """

    values: Any
    absent: Flags | None = None


class Batch(Protocol):
    """Some rows of a file; places are those of its columns.

    size: how many they are; bytes_read: how many bytes of the file they take
    """

    size: int
    bytes_read: int

    def column(self, place: int) -> Any:
        """Return a column as it is: an array whose kind the file tells, or texts."""

    def numbers(self, place: int) -> ColumnNumbers:
        """Return a column as floats; a null may be any number."""
        return ColumnNumbers(self.column(place).astype(np.float64))

    def stamps(self, place: int, *, in_ns: int) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and why rows have none; in_ns: as `whole_stamps` has it.

        A float of seconds counts as the decimal that it prints as, as it does in a table of text.
        """
        numbers = self.column(place)
        if numbers.dtype.kind in WHOLE:
            stamps, bad = whole_stamps(numbers, in_ns)
        elif in_ns:
            raise ValueInvalid(f"{SUFFIXES[in_ns]} are integers, found {numbers.dtype}")
        else:
            stamps, bad = nanoseconds_of(numbers.astype(np.float64))
        return stamps, dict.fromkeys(np.flatnonzero(bad).tolist(), "not a time in seconds")

    def texts(self, place: int) -> Sequence[str]:
        """Return a column as texts, "" for none."""
        return [str(plain_value(value)) for value in self.column(place).tolist()]


def whole_stamps(numbers: NDArray[Any], in_ns: int) -> tuple[Ints, Flags]:
    """Return whole numbers as nanoseconds, and which are beyond 64 bits of them.

    in_ns: how many nanoseconds each counts; 0 are seconds, or what the size of the first says
    """
    first = int(next(iter(numbers[numbers != 0]), 0))
    each = in_ns or nanoseconds_each(first)
    if not in_ns:
        tell_size(first, each)
    return numbers.astype(np.int64) * each, abs(numbers) > np.iinfo(np.int64).max // each


class ColumnWriter(Protocol):
    """Write the rows of one batch after the other."""

    def of_rows(self, batch: Batch | None, rows: Ints | None, made: Sequence[Made]) -> bytes | memoryview:
        """Return what is written of a batch: of these of its rows (None: all), with what is made for each of them.

        batch: None where no column passes.
        """

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last batch."""


class ColumnFile(Protocol):
    """A file that was opened: its columns are known, its rows are not read yet.

    names: of the columns; None where they have none; width: how many there are
    kinds: the types of their numbers; None for texts and for what else is not a number
    vectors: columns of vectors that turn when points move, as normals do
    gaps: numbers that are not finite stand for none: a point without return; else their rows are bad
    """

    names: tuple[str, ...] | None
    width: int
    kinds: Sequence[Kind | None]
    vectors: tuple[tuple[str, ...], ...] = ()
    gaps: bool

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers; None for what is not a number."""
        return self.kinds[place]

    def moved_by(self, pose: Components | None) -> None:
        """Move what has a place among the points by the pose that moves all of them, before any is read.

        That is the pose of the sensor, or rotations of splats; None: there is no such pose.
        """
        del pose

    def batches(self) -> Iterator[Batch]:
        """Yield the rows; raises FormatError where the file ends too early."""

    def nothing(self) -> Batch:
        """Return a batch of no rows."""
        return StructuredBatch(np.zeros(0, record_of(kind or "U1" for kind in self.kinds)))

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes a file of the same form, with what the columns do not hold as it was.

        drops: rows may be left out, so that their number is not known before the end.
        """


class StructuredBatch(Batch):
    """Some rows of an array with a field for each column."""

    def __init__(self, rows: NDArray[Any]) -> None:
        """Take rows (n,)."""
        self.rows = rows
        self.fields = rows.dtype.names or ()
        self.size = len(rows)
        self.bytes_read = rows.nbytes

    def column(self, place: int) -> NDArray[Any]:
        """Return a field as it is."""
        return self.rows[self.fields[place]]


def record_of(kinds: Iterable[Any]) -> Kind:
    """Return the type of records that have a value of each kind, one behind the other."""
    return np.dtype([(f"{place}", kind) for place, kind in enumerate(kinds)])


def is_number(kind: Kind | None) -> bool:
    """Return True if a column of this kind holds numbers."""
    return kind is not None and kind.kind in FLOATS + WHOLE


def plain_value(value: Any) -> Any:
    """Return a value of a library as JSON has it: what it has no word for as text."""
    if isinstance(value, dict):
        return {str(key): plain_value(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_value(each) for each in value]
    if isinstance(value, bytes):
        return value.decode("utf-8", "backslashreplace")
    if isinstance(value, Decimal) and value.is_finite():
        return Verbatim(f"{value:f}")
    return value if value is None or isinstance(value, (str, int, float)) else str(value)


def not_finite(values: Floats) -> Flags | None:
    """Return which numbers are not finite; None if all are."""
    with np.errstate(invalid="ignore", over="ignore"):
        if np.isfinite(values.sum()):
            return None
    flags: Flags = ~np.isfinite(values)
    return flags if flags.any() else None


# --- reading ---


def rows_of_batch(size: int) -> int:
    """Return how many records of so many bytes are read at once."""
    return max(1, min(MOST_ROWS, BATCH_BYTES // max(size, 1)))


def record_batches(file: InputFile, record: Kind, count: int) -> Iterator[StructuredBatch]:
    """Yield so many records of a stream; memory is taken as they come, not as many as are said to come.

    Raises FormatError where the file ends too early.
    """
    size = rows_of_batch(record.itemsize)
    for done in range(0, count, size):
        data = bytearray(min(size, count - done) * record.itemsize)
        filled = file.stream.readinto(data)  # type: ignore[attr-defined]
        if filled < len(data):
            whole = done + filled // max(record.itemsize, 1)
            raise FormatError(f"the file ends after {whole} of {count} rows", source=file.name)
        yield StructuredBatch(np.frombuffer(data, record))


def bytes_left(stream: BinaryIO) -> int | None:
    """Return how many bytes a file still holds; None for a pipe."""
    try:
        about = os.fstat(stream.fileno())
        return about.st_size - stream.tell() if stat.S_ISREG(about.st_mode) else None
    except (OSError, ValueError):
        return None


def check_declared(file: InputFile, count: int, size: int, what: str, *, last: bool) -> None:
    """Raise FormatError where a file does not hold as many records as its header says.

    count, size: the records and the bytes of each; what: they are called so
    last: nothing else follows them, so that what does would be records that the header leaves out
    """
    if count and not size:
        raise FormatError(f"the header says {count} {what} of 0 bytes each", source=file.name)
    left = bytes_left(file.stream)
    if left is None:
        return
    problem = f"the header says {count} {what} of {size} bytes, the file holds {max(left, 0) // max(size, 1)}"
    if left < count * size:
        raise FormatError(f"{problem}; is it whole?", source=file.name)
    if last and size and left >= (count + 1) * size:
        raise FormatError(f"{problem}; correct the header", source=file.name)


def pieces(stream: BinaryIO) -> Iterator[bytes]:
    """Yield the rest of a stream."""
    return iter(partial(stream.read, PIECE), b"")


def read_exactly(file: InputFile, size: int, what: str) -> bytes:
    """Read so many bytes, memory growing with what comes; raises FormatError where there are fewer."""
    found: list[bytes] = []
    missing = size
    while missing and (piece := file.stream.read(min(missing, PIECE))):
        found.append(piece)
        missing -= len(piece)
    if missing:
        raise FormatError(f"the file ends within {what}, {missing} bytes are missing", source=file.name)
    return b"".join(found)


def temporary_file(owner: object) -> Any:
    """Return a file without a name that is closed with its owner."""
    file = TemporaryFile()  # noqa: SIM115 - closed with its owner
    finalize(owner, file.close)
    return file


def seekable(file: InputFile, owner: object) -> Any:
    """Return the stream of a file, to be read here and there; of a pipe a copy, which is closed with its owner."""
    if bytes_left(file.stream) is not None:
        return file.stream
    copy = temporary_file(owner)
    copyfileobj(file.stream, copy, PIECE)
    copy.seek(0)
    return copy


# --- writing ---


class CountedWriter:
    """Write a header that says how many rows there are, the rows, and what stands behind them."""

    def __init__(
        self, encode: Encode, head: Callable[[int], bytes], count: int | None,
        behind: Callable[[], Iterable[bytes]] = tuple,
    ) -> None:  # fmt: skip
        """Take what makes bytes of the rows of a batch, with what is made for them.

        head: makes the header for so many rows; behind: yields what follows the rows
        count: how many rows there will be; None if that is known at the end only: they wait in a file until then.
        """
        self.encode, self.head, self.count, self.behind = encode, head, count, behind
        self.written = 0
        self.begun = False
        self.waiting = temporary_file(self) if count is None else None

    def of_rows(self, batch: Any, rows: Ints | None, made: Sequence[Made]) -> bytes | memoryview:
        """Return what is written of a batch."""
        data = self.encode(batch, rows, made)
        self.written += len(made[0].values) if batch is None else batch.size if rows is None else len(rows)
        if self.waiting is not None:
            self.waiting.write(data)
            return b""
        head = b"" if self.begun else self.head(self.count or 0)
        self.begun = True
        return head + data if head else data

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last batch; all, if the rows had to be counted first."""
        if not self.begun:
            yield self.head(self.written)
        if self.waiting is not None:
            self.waiting.seek(0)
            yield from pieces(self.waiting)
        yield from self.behind()


def encode_records(
    columns: Sequence[OutColumn], kind: Kind, batch: StructuredBatch | None, rows: Ints | None, made: Sequence[Made]
) -> bytes | memoryview:
    """Return rows as records: what is made goes into its field, what passes is copied.

    kind: of the records, which have a field for each of the columns.  Where none is new they are changed in place.
    """
    given = batch if batch is None or rows is None else StructuredBatch(batch.rows[rows])
    if given is not None and given.rows.dtype == kind:
        records = given.rows
    else:
        records = np.zeros(len(made[0].values) if given is None else given.size, kind)
    new = iter(made)
    for name, column in zip(kind.names or (), columns, strict=True):
        if column.passed is None:
            values = next(new).values
            if records.dtype[name].kind == "U":
                most = records.dtype[name].itemsize // np.dtype("U1").itemsize
                if len(longest := max(values, key=len, default="")) > most:  # numpy would cut it
                    found = f"{shown(longest)} has {len(longest)}"
                    raise ValueInvalid(f"column {column.name} holds {most} characters, {found}")
            records[name] = values
        elif given is not None and records is not given.rows:
            records[name] = given.column(column.passed)
    return memoryview(records.view(np.uint8)) if records.size else b""  # type: ignore[arg-type]
