"""Columns of Arrow tables as arrays of numbers and back: nulls beside them, each type kept.

Loads pyarrow, the extra `arrow`, where it is asked for; nothing else does.

Rows of Arrow as the streams of columns read and write them: batches, and the schema that a result has.

A column that passes is not looked into; a new one stands in the type of the one it replaces, with its metadata.

Where the bytes of pyarrow's files come from and go: files, pipes, and whoever writes what a batch became.

Cells of a table of text as columns of Arrow: whole numbers, numbers, or the text itself, so that nothing is lost.

A column is of a type only if each cell is written as a number of that type is: 007 and +5 stay text. Empty is null.
"""

from __future__ import annotations

import json
import os
from contextlib import contextmanager
from importlib import import_module
from shutil import copyfileobj
from stat import S_ISREG
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FileProblem, FormatError, ValueInvalid, alternatives, printable, shown
from frametool.formats.rows.column_file import ColumnNumbers
from frametool.frames.stamps import BILLION
from frametool.text.parse import FURTHEST, nanoseconds_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Kind, Made, OutColumn
    from frametool.text.spans import Flags, Floats, Ints

# nanoseconds of the units that timestamps have
UNITS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
DTYPES = {"double": np.float64, "float": np.float32, "halffloat": np.float16}  # as Arrow prints its types


def require_pyarrow(what: str, part: str = "") -> Any:
    """Return the library, or a part of it; raises FileProblem that says what needs it and how it is installed."""
    try:
        return import_module(f"pyarrow.{part}" if part else "pyarrow")
    except ImportError:
        raise FileProblem(f"{what} needs pyarrow; install it: pip install 'frametool[arrow]'") from None


class ArrowFloats(NamedTuple):
    """The numbers of one column, (n,) of its own type, nan where it is null; `nulls` is None where none is."""

    values: Any
    nulls: Flags | None


def place_of(name: str, names: Sequence[str]) -> int:
    """Return the place of a column; raises ValueInvalid for one that is not there, or twice."""
    if names.count(name) != 1:
        if name in names:
            raise ValueInvalid(f"column {shown(name)} stands twice")
        raise ValueInvalid(f"no column {shown(name)}{alternatives(name, names, 'columns')}")
    return names.index(name)


def is_floating(kind: Any) -> bool:
    """Tell whether a type of Arrow is one of floating point."""
    return str(kind) in DTYPES


def floats_of(column: Any, name: str) -> ArrowFloats:
    """Read a column, chunked or not; raises ValueInvalid unless its type is one of floating point."""
    if not is_floating(column.type):
        raise ValueInvalid(f"column {shown(name)} is {column.type}, not floating point; cast it to float64 first")
    whole = in_one(column)
    return ArrowFloats(whole.to_numpy(zero_copy_only=False), nulls_of(whole))


def in_one(column: Any) -> Any:
    """Return a column as one array, without a copy where it is one."""
    if not hasattr(column, "chunks"):
        return column
    return column.chunk(0) if column.num_chunks == 1 else column.combine_chunks()


def nulls_of(column: Any) -> Flags | None:
    """Tell which rows are null, (n,); None where none is."""
    if not column.null_count:
        return None
    nulls: Flags = column.is_null().to_numpy(zero_copy_only=False)
    return nulls


def rounded(values: Floats, kind: Any) -> Any:
    """Return float64 numbers in a type of floating point, rounded once; what is too large becomes infinite."""
    with np.errstate(over="ignore"):
        return np.asarray(values, DTYPES[str(kind)])


def column_of(values: Any, nulls: Flags | None, kind: Any) -> Any:
    """Return numbers of a type's own precision as a column of it."""
    return require_pyarrow("an Arrow column").array(values, type=kind, mask=nulls)


def stamps_of(column: Any, name: str) -> tuple[Ints, Flags | None]:
    """Read a column of timestamps or integer nanoseconds, 0 where it is null; raises ValueInvalid for another type.

    Timestamps without a time zone count as UTC.
    """
    pa = require_pyarrow("an Arrow column")
    whole = in_one(column)
    unit = UNITS.get(getattr(whole.type, "unit", ""), 0) if str(whole.type).startswith("timestamp") else 0
    if not unit and not pa.types.is_integer(whole.type):
        wanted = "a timestamp, integer nanoseconds, or float seconds"
        raise ValueInvalid(f"column {shown(name)} is {whole.type}; stamps are {wanted}")
    try:
        counts = whole.view(pa.int64()) if unit else whole.cast(pa.int64())
    except pa.ArrowInvalid:
        raise ValueInvalid(f"column {shown(name)}: a stamp is beyond 64 bits of nanoseconds") from None
    nulls = nulls_of(counts)
    stamps: Ints = counts.fill_null(0).to_numpy(zero_copy_only=False)
    if unit > 1:
        most = np.iinfo(np.int64).max // unit
        if np.any((stamps > most) | (stamps < -most)):
            raise ValueInvalid(f"column {shown(name)}: a stamp is beyond 64 bits of nanoseconds")
        stamps = stamps * unit
    return stamps, nulls


# bits of whole numbers -> how numpy calls them, as Arrow prints its types
WHOLES = {f"{sign}int{bits}": np.dtype(f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)}
NUMBERS: dict[str, Kind] = {**WHOLES, **{name: np.dtype(kind) for name, kind in DTYPES.items()}}
NO_TIME = "no time: null"


def kind_of(arrow_type: Any) -> Kind | None:
    """Return the type of a column's numbers as numpy calls it; None for what is no number."""
    return NUMBERS.get(str(arrow_type))


def no_rows(schema: Any) -> Any:
    """Return a batch of no rows."""
    pa = require_pyarrow("Arrow")
    return pa.RecordBatch.from_arrays([pa.array([], field.type) for field in schema], schema=schema)


class ArrowBatch:
    """Some rows of a file.

    rows: a RecordBatch; bytes_read: what they take in the file
    ends_group: whether they are the last of a group of rows that is written as one
    """

    def __init__(self, rows: Any, bytes_read: int, *, ends_group: bool) -> None:
        """Take rows, and where in the file they stand."""
        self.rows = rows
        self.bytes_read = bytes_read
        self.ends_group = ends_group

    def let_go(self) -> None:
        """Hold the rows no longer: they keep their whole group in memory."""
        self.rows = None

    @property
    def size(self) -> int:
        """Count the rows."""
        return int(self.rows.num_rows)

    def numbers(self, place: int) -> ColumnNumbers:
        """Return a column as floats, nan where it is null."""
        column = self.rows.column(place)
        values = column.to_numpy(zero_copy_only=False).astype(np.float64)
        return ColumnNumbers(values, nulls_of(column))

    def stamps(self, place: int, *, in_ns: bool) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and why rows have none: timestamps, integers by their name, float seconds."""
        column, name = self.rows.column(place), self.rows.schema.names[place]
        kind = kind_of(column.type)
        if kind is None or kind.kind != "f":
            stamps, nulls = stamps_of(column, name)
            if kind is not None and not in_ns:
                self._check_seconds(stamps, name)
                stamps = stamps * BILLION
            return stamps, dict.fromkeys([] if nulls is None else np.flatnonzero(nulls).tolist(), NO_TIME)
        if in_ns:
            raise ValueInvalid(f"column {shown(name)} is {column.type}; nanoseconds are integers or timestamps")
        values, nulls = self.numbers(place)
        stamps, none = nanoseconds_of(values)
        reasons = {row: f"{values[row]} is no time in seconds" for row in np.flatnonzero(none).tolist()}
        if nulls is not None:
            reasons |= dict.fromkeys(np.flatnonzero(nulls).tolist(), NO_TIME)
        return stamps, reasons

    @staticmethod
    def _check_seconds(seconds: Ints, name: str) -> None:
        beyond = (seconds > FURTHEST) | (seconds < -FURTHEST)
        if beyond.any():
            row = int(np.argmax(beyond))
            remedy = "are these some? then call the column stamp_ns, or let it be a timestamp"
            raise ValueInvalid(f"column {shown(name)}: {seconds[row]} s is beyond 64 bits of nanoseconds; {remedy}")

    def texts(self, place: int) -> list[str]:
        """Return a column as texts, "" for null; what is nested as JSON, bytes that are no UTF-8 as \\xff."""
        column = self.rows.column(place)
        pa = require_pyarrow("an Arrow column")
        if "binary" in str(column.type):
            return [(data or b"").decode("utf-8", "backslashreplace") for data in column.to_pylist()]
        try:
            return [text or "" for text in column.cast(pa.string()).to_pylist()]
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError, pa.ArrowTypeError):
            return ["" if value is None else json.dumps(value, default=str) for value in column.to_pylist()]

    def column(self, place: int) -> Any:
        """Return a column as it is: numbers and truth values without a null as an array, else texts."""
        column = self.rows.column(place)
        if column.null_count or (kind_of(column.type) is None and str(column.type) != "bool"):
            return self.texts(place)
        return column.to_numpy(zero_copy_only=False)


class ArrowRows:
    """Make the rows of a result: the columns that pass, and those that are made in the types they have."""

    def __init__(self, columns: Sequence[OutColumn], given: Any | None) -> None:
        """Take the columns of the result and the schema of the input, None where no column passes."""
        self.columns = columns
        self.pa = require_pyarrow("Arrow")
        fields = [self._field(column, given) for column in columns]
        self.schema = self.pa.schema(fields, metadata=None if given is None else given.metadata)

    def _field(self, column: OutColumn, given: Any | None) -> Any:
        """Return the field of a column: that of the input where it passes or is replaced."""
        if column.passed is not None and given is not None:
            return given.field(column.passed)
        replaced = [] if given is None else given.get_all_field_indices(column.name)
        if replaced and given is not None:
            return given.field(replaced[0])
        if column.kind is None:
            return self.pa.field(column.name, self.pa.string())
        return self.pa.field(column.name, self.pa.from_numpy_dtype(column.kind))

    def of_batch(self, batch: ArrowBatch | None, rows: Ints | None, made: Sequence[Made]) -> Any:
        """Return some rows of a batch as a RecordBatch, with what is made for them."""
        new = iter(made)
        arrays = []
        for column, field in zip(self.columns, self.schema, strict=True):
            if column.passed is None or batch is None:
                arrays.append(self._made(next(new), field))
            else:
                passed = batch.rows.column(column.passed)
                arrays.append(passed if rows is None else passed.take(self.pa.array(rows)))
        return self.pa.RecordBatch.from_arrays(arrays, schema=self.schema)

    def _made(self, made: Made, field: Any) -> Any:
        """Return what is made as a column; raises ValueInvalid for a null that the schema does not allow."""
        if made.absent is not None and not field.nullable and made.absent.any():
            raise ValueInvalid(f"column {field.name} is declared not to hold nulls, and a row becomes null there")
        if isinstance(made.values, np.ndarray) and made.values.dtype.kind not in "USO":
            return column_of(made.values, made.absent, field.type)
        texts = self.pa.array([text or None for text in made.values], self.pa.string())
        if self.pa.types.is_dictionary(field.type):
            texts = texts.dictionary_encode()
        return texts.cast(field.type)


PIECE = 1 << 20  # bytes


@contextmanager
def translated(name: str) -> Iterator[None]:
    """Turn whatever pyarrow raises for a broken file into one line; raises FormatError."""
    pa = require_pyarrow(name)
    try:
        yield
    except (pa.ArrowException, OSError, EOFError, ValueError, OverflowError, MemoryError) as error:
        first = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise FormatError(f"it cannot be read: {printable(first[:200].rstrip('. '))}", source=name) from None


def seekable(file: InputFile) -> Any:
    """Return what pyarrow reads at any place; what comes by a pipe is put into a file without a name first."""
    pa = require_pyarrow(file.name)
    if file.path != "-" and S_ISREG(os.stat(file.path).st_mode):
        return pa.OSFile(file.path)
    stream: Any = file.stream
    if not stream.seekable():
        stream = TemporaryFile()  # noqa: SIM115 - it lives as long as what reads it
        copyfileobj(file.stream, stream, PIECE)
    stream.seek(0)
    return pa.PythonFile(stream, mode="r")


class Collected:
    """A file to write to, whose bytes are taken out piece by piece; the memory of a piece is that of the one before."""

    closed = False

    def __init__(self) -> None:
        """Begin with nothing."""
        self._space = bytearray(PIECE)
        self._filled = 0
        self._taken = 0

    def write(self, data: Any) -> int:
        """Keep some bytes."""
        piece = memoryview(data).cast("B")
        end = self._filled + len(piece)
        if end > len(self._space):
            grown = bytearray(max(end, 2 * len(self._space)))
            grown[: self._filled] = memoryview(self._space)[: self._filled]
            self._space = grown
        self._space[self._filled : end] = piece
        self._filled = end
        return len(piece)

    def tell(self) -> int:
        """Return how many bytes were written so far."""
        return self._taken + self._filled

    def flush(self) -> None:
        """Do nothing: what is written is there."""

    def close(self) -> None:
        """Take nothing more."""
        self.closed = True

    def taken(self) -> memoryview:
        """Return what was written since the last time; it holds until the next bytes are written."""
        size, self._filled = self._filled, 0
        self._taken += size
        return memoryview(self._space)[:size]


WHOLE = r"^-?(0|[1-9][0-9]{0,18})$"
NUMBER = r"^-?(0|[1-9][0-9]{0,14})(\.[0-9]+)?([eE][-+]?[0-9]+)?$"  # longer whole numbers would lose digits
PATTERNS = {"int64": WHOLE, "double": NUMBER}


def type_of(texts: Any) -> Any:
    """Return the type of a column's cells; of none at all, string."""
    pa = require_pyarrow("Arrow")
    fits = (name for name in PATTERNS if texts.null_count < len(texts) and _misfit(texts, name) is None)
    return pa.type_for_alias(next(fits, "string"))


def typed(texts: Any, kind: Any, name: str) -> Any:
    """Return cells in a type; raises ValueInvalid for one that is not written so."""
    if str(kind) not in PATTERNS:
        return texts
    if (text := _misfit(texts, str(kind))) is not None:
        found = f"column {shown(name)}: {shown(text)} is no {kind}, as all cells of the first million rows are"
        raise ValueInvalid(f"{found}; -f csv keeps it as it is")
    return texts.cast(kind)


def _misfit(texts: Any, kind: str) -> str | None:
    """Return the first cell that is not written as a number of a type is; None if all are."""
    pa, compute = require_pyarrow("Arrow"), require_pyarrow("Arrow", "compute")
    wrong = texts.filter(compute.invert(compute.match_substring_regex(texts, PATTERNS[kind])))
    if len(wrong):
        return str(in_one(wrong)[0].as_py())
    try:
        texts.cast(kind)
    except pa.ArrowInvalid:  # beyond 64 bits
        return max((text or "" for text in in_one(texts).to_pylist()), key=len)
    return None
