"""Binary files of columns of numbers: the interface of the formats, and their common parts.

The module of a format that is read as `arrays` has `open_columns(file) -> ColumnFile`; if it is written,
`create(columns, count, style) -> ColumnWriter`.  Rows are numbered from 1 across batches.

Records in a file have numpy's layout, one field after another.  Headers are checked against the file before data are
read, memory is allocated or output is written.

Files of kitti-bin and nuscenes-bin are nothing but records, and are read and written here: consecutive points, four or
five float32 (little-endian) each:

    x y z intensity            KITTI, velodyne/000000.bin
    x y z intensity ring       nuScenes, LIDAR_TOP/*.pcd.bin

Metres, in the frame of the lidar.  The file does not state which of the two it is: `--in` does.
"""

from __future__ import annotations

import os
import stat
from contextlib import contextmanager
from decimal import Decimal
from functools import cached_property, partial
from shutil import copyfileobj
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, Protocol, TypeAlias
from weakref import finalize

import numpy as np

from frametool.documents.source import InputFile, Verbatim
from frametool.errors import FormatError, FrametoolError, ValueInvalid, listing, printable, shown, warn
from frametool.formats.table import FORMATS
from frametool.frames.stamps import SUFFIXES, nanoseconds_each, tell_size
from frametool.text.parse import nanoseconds_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from frametool.geometry import Components
    from frametool.grammar.result import Style
    from frametool.text.spans import Flags, Floats, Ints

    Kind: TypeAlias = np.dtype[Any]
    Encode: TypeAlias = Callable[[Any, Ints | None, Sequence["Made"]], bytes | memoryview]

FLOATS, WHOLE = "f", "iu"  # kinds of numpy's types
STAMP_NS = np.dtype(np.int64)
XYZ = ("x", "y", "z")
SINGLE = np.dtype("<f4")
PIECE = 1 << 20  # bytes that are copied at once
BATCH_BYTES = 1 << 21
MOST_ROWS = 1 << 15  # of a batch; it and its results stay in cache


class OutColumn(NamedTuple):
    """A column of the output.

    name: "" if columns have no names
    kind: the numpy type of its numbers; None for texts
    passed: the index of the input column that is copied unchanged; None for a new column
    longest: the maximum length of a text, 0 if unknown; is_json: True if texts are JSON
    """

    name: str
    kind: Kind | None
    passed: int | None = None
    longest: int = 0
    is_json: bool = False


class Made(NamedTuple):
    """The data of a new column.

    values: (n,) of its type, nan for missing numbers; or texts
    absent: the mask of missing values; None if there are no missing values
    """

    values: Any
    absent: Flags | None = None


class Batch(Protocol):
    """Rows of a file, addressed by the indices of its columns.

    size: the number of rows; bytes_read: their size in the file
    errors: those of rows that could not be read and are left out
    """

    size: int
    bytes_read: int
    errors: Sequence[FormatError] = ()

    @cached_property
    def lines(self) -> Ints:
        """Return the line of each row, or its number in the batch, from 0."""
        return np.arange(self.size)

    def column(self, place: int) -> Any:
        """Return a column unchanged: an array of the file's type, or texts."""

    def numbers(self, place: int) -> tuple[Floats, Flags | None]:
        """Return a column as floats, and the null mask (None: no nulls); a null may be any number."""
        with np.errstate(invalid="ignore"):  # a signalling nan
            return self.column(place).astype(np.float64), None

    def stamps(self, place: int, *, in_ns: int) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and row -> reason for rows without a time; in_ns: as in `stamps_in`."""
        stamps, bad, reason = stamps_in(self.column(place), in_ns)
        return stamps, dict.fromkeys(np.flatnonzero(bad).tolist(), reason)

    def texts(self, place: int) -> Sequence[str]:
        """Return a column as texts, "" for missing ones."""
        return [str(plain_value(value)) for value in self.column(place).tolist()]


def stamps_in(numbers: NDArray[Any], in_ns: int) -> tuple[Ints, Flags, str]:
    """Convert numbers to nanoseconds; returns them, the mask of numbers that are not times, and the reason.

    in_ns: nanoseconds per unit of integers; 0: seconds, or for integers the unit that the first one's size implies
    A float of seconds has the value of its shortest decimal text, as in a table of text.
    """
    if numbers.dtype.kind not in WHOLE:
        if in_ns:
            raise ValueInvalid(f"{SUFFIXES[in_ns]} are integers, found {numbers.dtype}")
        return *nanoseconds_of(numbers.astype(np.float64)), "not a time in seconds"
    first = int(next(iter(numbers[numbers != 0]), 0))
    each = in_ns or nanoseconds_each(first)
    if not in_ns:
        tell_size(first, each)
    reason = "beyond 64 bits of nanoseconds; are these some? then call the column stamp_ns"
    return numbers.astype(np.int64) * each, abs(numbers) > np.iinfo(np.int64).max // each, reason


class ColumnWriter(Protocol):
    """Writes rows batch by batch."""

    def of_rows(self, batch: Batch | None, rows: Ints | None, made: Sequence[Made]) -> bytes | memoryview:
        """Return the bytes for rows of a batch (None: all), with the new data of each new column.

        batch: None if no column is copied from the input.
        """

    def end(self) -> Iterator[bytes]:
        """Yield the bytes after the last batch."""


class ColumnFile(Protocol):
    """An opened file: its columns are known, its rows are not read yet.

    names: of the columns; None if they have no names; width: their number
    kinds: the numpy types of their numbers; None for texts and everything else
    vectors: names of columns with vectors that are rotated with the points, such as normals
    gaps: True: a number that is not finite means a missing point; False: its row is invalid
    count: the number of rows; None if the file does not state it
    """

    names: tuple[str, ...] | None
    width: int
    kinds: Sequence[Kind | None]
    vectors: tuple[tuple[str, ...], ...] = ()
    gaps: bool
    count: int | None = None

    def moved_by(self, pose: Components | None) -> None:
        """Transform data of all points, such as the sensor's pose or rotations of splats, before rows are read.

        pose: the pose that transforms all points; None if they do not share one
        """
        del pose

    def batches(self) -> Iterator[Batch]:
        """Yield the rows; raises FormatError if the file ends too early."""

    def nothing(self) -> Batch:
        """Return a batch without rows."""
        return StructuredBatch(np.zeros(0, record_of(kind or "U1" for kind in self.kinds)))

    def rewriter(self, columns: Sequence[OutColumn], count: int | None, style: Style) -> ColumnWriter:
        """Return a writer for a file of the same format that preserves everything outside of the columns.

        count: the number of rows; None if it is known only at the end
        """


class StructuredBatch(Batch):
    """Rows of a structured array, one field per column."""

    def __init__(self, rows: NDArray[Any]) -> None:
        """Store rows (n,)."""
        self.rows = rows
        self.fields = rows.dtype.names or ()
        self.size = len(rows)
        self.bytes_read = rows.nbytes

    def column(self, place: int) -> NDArray[Any]:
        """Return a field."""
        return self.rows[self.fields[place]]


def record_of(kinds: Iterable[Any]) -> Kind:
    """Return the type of records with one value of each type, in this order."""
    return np.dtype([(f"{place}", kind) for place, kind in enumerate(kinds)])


def is_number(kind: Kind | None) -> bool:
    """Return True if a column of this type holds numbers."""
    return kind is not None and kind.kind in FLOATS + WHOLE


def plain_value(value: Any) -> Any:
    """Convert a library's value to JSON values; types that JSON lacks become text."""
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
    """Return the mask of numbers that are not finite; None if all are."""
    with np.errstate(invalid="ignore", over="ignore"):
        if np.isfinite(values.sum()):
            return None
    flags: Flags = ~np.isfinite(values)
    return flags if flags.any() else None


# --- reading ---


class RecordFile(ColumnFile):
    """A file whose rows are records, one field per column."""

    gaps = True
    count: int

    def __init__(self, file: InputFile, names: Iterable[str] | None, record: Kind, count: int) -> None:
        """Store the names of the columns, the type of a row as a record, and the number of rows."""
        self.file, self.record, self.count = file, record, count
        self.names = None if names is None else tuple(names)
        self.width = len(record.names or ())
        kinds = [record[place] for place in range(self.width)]
        self.kinds = [kind if is_number(kind) else None for kind in kinds]

    def batches(self) -> Iterator[Batch]:
        """Yield the rows; memory grows with the data, not with the stated count.

        Raises FormatError if rows are missing.
        """
        size, count = rows_of_batch(self.record.itemsize), self.count
        for done in range(0, count, size):
            data = bytearray(min(size, count - done) * self.record.itemsize)
            filled = self.file.stream.readinto(data)  # type: ignore[attr-defined]
            if filled < len(data):
                whole = done + filled // max(self.record.itemsize, 1)
                raise self.file.error(f"the file ends after {whole} of {count} rows")
            yield StructuredBatch(np.frombuffer(data, self.record))


def rows_of_batch(size: int) -> int:
    """Return how many records of `size` bytes are read at once."""
    return max(1, min(MOST_ROWS, BATCH_BYTES // max(size, 1)))


@contextmanager
def translated(name: str, what: str = "it cannot be read: {}") -> Iterator[None]:
    """Convert any exception of a library into a FormatError, with its first line in place of {}."""
    try:
        yield
    except FrametoolError:
        raise
    except Exception as error:  # noqa: BLE001 - a broken file makes libraries raise anything, also MemoryError
        first = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise FormatError(what.format(printable(first[:200].rstrip(". "))), source=name) from None


def bytes_left(stream: BinaryIO) -> int | None:
    """Return the number of remaining bytes; None for a pipe."""
    try:
        about = os.fstat(stream.fileno())
        return about.st_size - stream.tell() if stat.S_ISREG(about.st_mode) else None
    except (OSError, ValueError):
        return None


def check_declared(file: InputFile, count: int, size: int, what: str, *, last: bool) -> None:
    """Raise FormatError if a file has fewer records than its header states.

    count, size: the number of records and the bytes of each; what: their name in messages
    last: nothing else follows them, so that more data are an error too
    """
    if count and not size:
        raise file.error(f"the header says {count} {what} of 0 bytes each")
    left = bytes_left(file.stream)
    if left is None:
        return
    problem = f"the header says {count} {what} of {size} bytes, the file holds {max(left, 0) // max(size, 1)}"
    if left < count * size:
        raise file.error(f"{problem}; is it whole?")
    if last and size and left >= (count + 1) * size:
        raise file.error(f"{problem}; correct the header")


def pieces(stream: BinaryIO) -> Iterator[bytes]:
    """Yield the rest of a stream."""
    return iter(partial(stream.read, PIECE), b"")


def read_exactly(file: InputFile, size: int, what: str) -> bytes:
    """Read `size` bytes; memory grows with the data.  Raises FormatError if there are fewer.

    what: name of the data, for the message
    """
    found: list[bytes] = []
    missing = size
    while missing and (piece := file.stream.read(min(missing, PIECE))):
        found.append(piece)
        missing -= len(piece)
    if missing:
        raise file.error(f"the file ends within {what}, {missing} bytes are missing")
    return b"".join(found)


def temporary_file(owner: object) -> Any:
    """Return an unnamed file that is closed when its owner is deleted."""
    file = TemporaryFile()  # noqa: SIM115 - closed with its owner
    finalize(owner, file.close)
    return file


def seekable(file: InputFile, owner: object) -> Any:
    """Return the stream of a file with random access; for a pipe a copy that is closed when its owner is deleted."""
    if bytes_left(file.stream) is not None:
        return file.stream
    copy = temporary_file(owner)
    copyfileobj(file.stream, copy, PIECE)
    copy.seek(0)
    return copy


# --- writing ---


class CountedWriter:
    """Writes a header with the number of rows, the rows, and the bytes after them."""

    def __init__(
        self, encode: Encode, head: Callable[[int], bytes], count: int | None,
        behind: Callable[[], Iterable[bytes]] = tuple,
    ) -> None:  # fmt: skip
        """Store the functions that encode rows, header and end.

        encode: returns the bytes of rows of a batch, with their new data
        head: returns the header for a number of rows; behind: yields the bytes after the rows
        count: the number of rows; None if it is known only at the end: until then the rows are kept in a temporary file
        """
        self.encode, self.head, self.count, self.behind = encode, head, count, behind
        self.written = 0
        self.begun = False
        self.waiting = temporary_file(self) if count is None else None

    def of_rows(self, batch: Any, rows: Ints | None, made: Sequence[Made]) -> bytes | memoryview:
        """Return the bytes of a batch."""
        data = self.encode(batch, rows, made)
        self.written += len(made[0].values) if batch is None else batch.size if rows is None else len(rows)
        if self.waiting is not None:
            self.waiting.write(data)
            return b""
        head = b"" if self.begun else self.head(self.count or 0)
        self.begun = True
        return head + data if head else data

    def end(self) -> Iterator[bytes]:
        """Yield the bytes after the last batch, or all bytes if the rows had to be counted first."""
        if not self.begun:
            yield self.head(self.written)
        if self.waiting is not None:
            self.waiting.seek(0)
            yield from pieces(self.waiting)
        yield from self.behind()


def encode_records(
    columns: Sequence[OutColumn], kind: Kind, batch: StructuredBatch | None, rows: Ints | None, made: Sequence[Made]
) -> bytes | memoryview:
    """Return rows as records: new data are written into their fields, the others are copied.

    kind: type of the records, with a field for each column; if it is that of the batch, its records are changed in
        place
    """
    of_input = batch if batch is None or rows is None else StructuredBatch(batch.rows[rows])
    if of_input is not None and of_input.rows.dtype == kind:
        records = of_input.rows
    else:
        records = np.zeros(len(made[0].values) if of_input is None else of_input.size, kind)
    new = iter(made)
    for name, column in zip(kind.names or (), columns, strict=True):
        if column.passed is None:
            values = next(new).values
            if records.dtype[name].kind == "U":
                most = records.dtype[name].itemsize // np.dtype("U1").itemsize
                if len(longest := max(values, key=len, default="")) > most:  # numpy would truncate it
                    found = f"{shown(longest)} has {len(longest)}"
                    raise ValueInvalid(f"column {column.name} holds {most} characters, {found}")
            records[name] = values
        elif of_input is not None and records is not of_input.rows:
            records[name] = of_input.column(column.passed)
    return memoryview(records.view(np.uint8)) if records.size else b""  # type: ignore[arg-type]


# --- points without a header ---


class BinCloud(RecordFile):
    """The points of a file without a header."""

    def __init__(self, file: InputFile) -> None:
        """Count the points; raises FormatError if the last one is incomplete."""
        names = FORMATS[file.format].rows.columns
        record = record_of([SINGLE] * len(names))
        file.stream = seekable(file, self)
        size = bytes_left(file.stream) or 0
        if size % record.itemsize:
            others = {name: row.rows.columns for name, row in FORMATS.items() if row.reader == __name__}
            fits = [name for name, of in others.items() if of and size % (SINGLE.itemsize * len(of)) == 0]
            hint = f"; --in {fits[0]} fits" if fits else "; is it whole?"
            points = f"points of {record.itemsize} bytes (float32 {' '.join(names)})"
            raise file.error(f"{size} bytes are no whole number of {points}{hint}")
        super().__init__(file, names, record, size // record.itemsize)

    def batches(self) -> Iterator[Batch]:
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

    def rewriter(self, columns: Sequence[OutColumn], count: int | None, style: Style) -> ColumnWriter:
        """Return a writer for a cloud without a header, of either format."""
        return create(columns, count, style)


def create(columns: Sequence[OutColumn], _count: int | None, style: Style) -> CountedWriter:
    """Return a writer for points without a header, which warns about columns left out and about rounding to float32.

    Raises ValueInvalid if a column is missing, or a number too large.
    """
    fmt, names, off = style.format, FORMATS[style.format].rows.columns, 0.0
    at_input = [column.name for column in columns if column.kind is not None]
    if missing := [name for name in names if name not in at_input]:
        raise ValueInvalid(f"{fmt} holds {' '.join(names)}; there is no {listing(missing)}")
    if others := [column.name for column in columns if column.name not in names]:
        warn(f"{fmt}: {listing(others)} left out: it holds {' '.join(names)} alone")

    def encode(batch: Batch | None, rows: Ints | None, made: Sequence[Made]) -> bytes:
        nonlocal off
        new, found = iter(made), {}
        for column in columns:
            if column.passed is None or batch is None:
                found[column.name] = next(new).values
            else:
                passed = batch.column(column.passed)
                found[column.name] = passed if rows is None else passed[rows]
        points = np.empty((len(found[names[0]]), len(names)), SINGLE)
        for at, name in enumerate(names):
            with np.errstate(over="ignore", invalid="ignore"):
                points[:, at] = found[name]
                far = abs(points[:, at] - found[name])
            if np.isinf(far).any():
                raise ValueInvalid(f"column {name}: {found[name][np.isinf(far)][0]:g} is too large for float32")
            off = max(off, float(np.nanmax(far, initial=0.0)))
        return points.tobytes()

    def behind() -> tuple[bytes, ...]:
        if off:
            warn(f"{fmt}: numbers are float32; they were rounded by up to {off:.1g}")
        return ()

    return CountedWriter(encode, lambda _: b"", 0, behind)


open_columns = BinCloud
