"""Parquet and Arrow IPC (Feather), with pyarrow, the extra `frametool[arrow]`; either can be converted to the other.

Parquet begins with PAR1, an Arrow file with ARROW1.  Rows are read and written in groups, those of the input or of a
million: types, metadata and compression are preserved.  Unchanged columns are not inspected; a new one has the type
and metadata of the one it replaces.  Columns are arrays of numbers and texts with null masks.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from contextlib import suppress
from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool import sizes
from frametool.documents.json import dump
from frametool.documents.source import Verbatim
from frametool.errors import FileProblem, FormatError, ValueInvalid, shown, warn
from frametool.formats.rows import column_file
from frametool.frames.stamps import SUFFIXES
from frametool.text.parse import nanoseconds_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Kind, Made, OutColumn
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style
    from frametool.text.spans import Flags, Ints


# number types in Arrow's notation -> in numpy's
NUMBERS: dict[str, Kind] = {"double": np.dtype("f8"), "float": np.dtype("f4"), "halffloat": np.dtype("f2")}
NUMBERS |= {f"{sign}int{bits}": np.dtype(f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)}
NO_TIME = "no time: null"
STRUCTURED = ("bool", "decimal", "list", "large_list", "fixed_size_list", "struct", "map")  # not text
IS_JSON = {b"ARROW:extension:name": b"arrow.json", b"ARROW:extension:metadata": b""}  # of a column of JSON texts


def require_pyarrow(what: str, part: str = "") -> Any:
    """Return the library, or a part of it; raises FileProblem with the reason and the install command."""
    try:
        return import_module(f"pyarrow.{part}" if part else "pyarrow")
    except ImportError:
        raise FileProblem(f"{what} needs pyarrow; install it: pip install 'frametool[arrow]'") from None


def kind_of(arrow_type: Any) -> Kind | None:
    """Return the type of a column's numbers in numpy's notation; None for other columns."""
    return NUMBERS.get(str(arrow_type))


def is_floating(arrow_type: Any) -> bool:
    """Return True if a type of Arrow is one of floating point."""
    kind = kind_of(arrow_type)
    return kind is not None and kind.kind in column_file.FLOATS


def in_one(column: Any) -> Any:
    """Return a column as one array, without a copy if it is one."""
    if not hasattr(column, "chunks"):
        return column
    return column.chunk(0) if column.num_chunks == 1 else column.combine_chunks()


def nulls_of(column: Any) -> Flags | None:
    """Return which rows are null, (n,); None if none is."""
    if not column.null_count:
        return None
    nulls: Flags = column.is_null().to_numpy(zero_copy_only=False)
    return nulls


def stamps_of(column: Any, name: str) -> tuple[Ints, Flags | None, Ints]:
    """Read times as nanoseconds: timestamps (UTC if they have no zone), integer nanoseconds, or float seconds.

    Returns the times (0 for null), the null mask (None: none), and the rows of numbers that are not a time.
    Raises ValueInvalid for another type.
    """
    pa = require_pyarrow("an Arrow column")
    whole = in_one(column)
    nulls = nulls_of(whole)
    if is_floating(whole.type):
        stamps, bad = nanoseconds_of(whole.to_numpy(zero_copy_only=False).astype(np.float64))
        return stamps, nulls, np.flatnonzero(bad if nulls is None else bad & ~nulls)
    is_timestamp = pa.types.is_timestamp(whole.type)
    if not is_timestamp and not pa.types.is_integer(whole.type):
        wanted = "a timestamp, integer nanoseconds, or float seconds"
        raise ValueInvalid(f"column {shown(name)} is {whole.type}; stamps are {wanted}")
    try:
        counts = (whole.cast(pa.timestamp("ns", whole.type.tz)) if is_timestamp else whole).cast(pa.int64())
    except pa.ArrowInvalid:
        raise ValueInvalid(f"column {shown(name)}: a stamp is beyond 64 bits of nanoseconds") from None
    return counts.fill_null(0).to_numpy(zero_copy_only=False), nulls, np.zeros(0, np.int64)


class ArrowBatch(column_file.Batch):
    """Rows of a file.

    rows: a RecordBatch; ends_group: whether they are the last of a group of rows that is written as one
    """

    def __init__(self, rows: Any, bytes_read: int, *, ends_group: bool) -> None:
        """Store rows, and their size in the file."""
        self.rows = rows
        self.size = int(rows.num_rows)
        self.bytes_read, self.ends_group = bytes_read, ends_group

    def numbers(self, place: int) -> column_file.ColumnNumbers:
        """Return a column as floats, nan for null."""
        column = self.rows.column(place)
        return column_file.ColumnNumbers(column.to_numpy(zero_copy_only=False).astype(np.float64), nulls_of(column))

    def stamps(self, place: int, *, in_ns: int) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and why rows have none: timestamps, integers by name, float seconds."""
        column, name = self.rows.column(place), self.rows.schema.names[place]
        if in_ns and is_floating(column.type):
            raise ValueInvalid(f"column {shown(name)} is {column.type}; {SUFFIXES[in_ns]} are integers or timestamps")
        stamps, nulls, bad = stamps_of(column, name)
        kind = kind_of(column.type)
        if kind is not None and kind.kind in column_file.WHOLE:
            numbers, (stamps, beyond) = stamps, column_file.whole_stamps(stamps, in_ns)
            if beyond.any():
                remedy = "are these some? then call the column stamp_ns, or let it be a timestamp"
                seconds = numbers[int(np.argmax(beyond))]
                raise ValueInvalid(f"column {shown(name)}: {seconds} s is beyond 64 bits of nanoseconds; {remedy}")
        reasons = {row: f"{column[row].as_py()} is not a time in seconds" for row in bad.tolist()}
        return stamps, reasons | dict.fromkeys([] if nulls is None else np.flatnonzero(nulls).tolist(), NO_TIME)

    def texts(self, place: int) -> list[str]:
        """Return a column as texts, "" for null; nested values as JSON, bytes that are not UTF-8 as \\xff."""
        values = ["" if value is None else value for value in self.values(place)]
        return [value if isinstance(value, str) else dump(value) for value in values]

    def values(self, place: int) -> list[Any]:
        """Return a column as plain values: numbers, texts, None, and nested values, as objects or as JSON."""
        column, field = self.rows.column(place), self.rows.schema.field(place)
        kind = str(column.type)
        if "arrow.json" in kind or (field.metadata or {}).get(b"ARROW:extension:name") == b"arrow.json":
            return [_of_json(text) for text in column.to_pylist()]
        pa = require_pyarrow("an Arrow column")
        if kind_of(column.type) is None and not kind.startswith(STRUCTURED):
            with suppress(pa.ArrowInvalid, pa.ArrowNotImplementedError, pa.ArrowTypeError):
                column = column.cast(pa.string())
        return list(map(column_file.plain_value, column.to_pylist()))

    def column(self, place: int) -> Any:
        """Return a column unchanged: numbers and booleans without nulls as an array, else plain values."""
        column = self.rows.column(place)
        if column.null_count or (kind_of(column.type) is None and str(column.type) != "bool"):
            return self.values(place)
        return column.to_numpy(zero_copy_only=False)


def _of_json(text: str | None) -> Any:
    """Parse a JSON text, numbers as written; invalid JSON remains a text."""
    try:
        return text and json.loads(text, parse_float=Verbatim, parse_int=Verbatim)
    except (ValueError, RecursionError):
        return text


BEGINNINGS = {b"PAR1": "parquet", b"ARROW1": "arrow"}
NEW_GROUP = 1 << 20  # rows of a group if the input has none
HEADROOM, LEAST_ROOM = 3, 1 << 26  # memory for writing a group: this multiple of its size, and these additional bytes
NULLS = True  # its columns may hold nulls
AT_ONCE = 1 << 16  # rows of a batch: results stay near the cache


class ArrowFile(column_file.ColumnFile):
    """An opened file: its schema is read, its rows are not."""

    gaps = False
    source: Any  # pyarrow's source

    def __init__(self, file: InputFile, fmt: str) -> None:
        """Read the schema; raises FormatError."""
        self.name = file.name
        self.format = fmt
        with column_file.translated(self.name):
            self.schema = self.opened(file)
            self.names: tuple[str, ...] | None = tuple(self.schema.names)
        self.width = len(self.schema.names)
        self.kinds = [kind_of(field.type) for field in self.schema]

    def opened(self, file: InputFile) -> Any:
        """Open the file and return its schema."""
        raise NotImplementedError

    def encoding(self) -> dict[str, Any]:
        """Return the compression and encoding of the file, for the writer of the same format."""
        raise NotImplementedError

    def read(self) -> Iterator[ArrowBatch]:
        """Yield the rows; raises FormatError if the file is broken."""
        raise NotImplementedError

    def batches(self) -> Iterator[ArrowBatch]:
        """Yield the rows, and close the file; raises FormatError if it is broken."""
        with self.source:  # a thread of pyarrow may hold it longer than its reader
            for batch in self.read():
                yield batch
                batch.rows = None  # frees their group

    def guarded(self, found: Iterator[Any]) -> Iterator[Any]:
        """Yield the items that pyarrow reads; raises FormatError if the file is broken."""
        while True:
            with column_file.translated(self.name):
                rows = next(found, None)
            if rows is None:
                return
            yield rows
            del rows  # before the next are read

    def random_access(self, file: InputFile) -> Any:
        """Return a source with random access; a pipe is first copied to an unnamed file."""
        pa = require_pyarrow(self.name)
        if file.path != "-" and os.path.isfile(file.path):
            return pa.OSFile(file.path)
        stream = column_file.seekable(file, self)
        stream.seek(0)
        return pa.PythonFile(stream, mode="r")

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> GroupWriter:
        """Return a writer with the same schema and compression; the output may be the other Arrow format."""
        del drops
        fmt = style.format if style.format in WRITERS else self.format
        same = WRITERS[fmt] is WRITERS[self.format]
        return WRITERS[fmt](fmt, columns, self.schema, self.encoding() if same else {})


class Collected(BytesIO):
    """A file to write to, whose bytes are taken piece by piece."""

    before = 0  # bytes that were taken

    def tell(self) -> int:
        """Return the number of bytes written so far."""
        return self.before + super().tell()

    def close(self) -> None:
        """Do nothing: the bytes are still to be taken."""

    def taken(self) -> bytes:
        """Return the bytes written since the last call."""
        piece = self.getvalue()
        self.before += len(piece)
        self.seek(0)
        self.truncate()
        return piece


class GroupWriter:
    """Collects rows until a group is complete; subclasses define the beginning of a file and the writing of a group."""

    def __init__(self, fmt: str, columns: Sequence[OutColumn], of_input: Any | None, how: dict[str, Any]) -> None:
        """Store the columns of the result, the schema of the input if it has one, and its encoding."""
        self.pa = require_pyarrow("Arrow")
        self.format, self.columns, self.how = fmt, columns, how
        self.sink = Collected()
        self.file = self.pa.PythonFile(self.sink, mode="w")
        fields = [self._field(column, of_input) for column in columns]
        self.schema = self.pa.schema(fields, metadata=None if of_input is None else of_input.metadata)
        self.writer: Any = None
        self.waiting: list[Any] = []
        self.size = self.count = self.read = 0

    def begin(self) -> Any:
        """Return the writer for `file`; it can be closed."""
        raise NotImplementedError

    def write(self, table: Any) -> None:
        """Write a group of rows."""
        raise NotImplementedError

    def of_rows(self, batch: Any, rows: Ints | None, made: Sequence[Made]) -> bytes:
        """Return the bytes written once a group of rows is complete."""
        new = self._rows(batch, rows, made)
        self.waiting.append(new)
        self.size += bytes_of(new)
        self.count += new.num_rows
        self.read += new.num_rows if batch is None else batch.size
        ends = batch.ends_group if batch is not None else self.count >= NEW_GROUP
        if ends or self.size > sizes.GROUP:
            self._write_group()
        return self.sink.taken()

    def end(self) -> Iterator[bytes]:
        """Yield the last group and the end of the file."""
        if self.waiting or self.writer is None:
            self._write_group()
        self.writer.close()
        yield self.sink.taken()

    def _field(self, column: OutColumn, of_input: Any | None) -> Any:
        """Return the field of a column: that of the input if it is unchanged or replaced."""
        if of_input is not None:
            replaced = of_input.get_all_field_indices(column.name) if column.passed is None else [column.passed]
            if replaced:
                return of_input.field(replaced[0])
        kind = self.pa.string() if column.kind is None else self.pa.from_numpy_dtype(column.kind)
        return self.pa.field(column.name, kind, metadata=IS_JSON if column.is_json else None)

    def _rows(self, batch: ArrowBatch | None, rows: Ints | None, made: Sequence[Made]) -> Any:
        """Return some rows of a batch as a RecordBatch, with the new columns."""
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
        """Return a new column; raises ValueInvalid for a null that the schema does not allow."""
        if made.absent is not None and not field.nullable and made.absent.any():
            raise ValueInvalid(f"column {field.name} is declared not to hold nulls, and a row becomes null there")
        if isinstance(made.values, np.ndarray):
            return self.pa.array(made.values, type=field.type, mask=made.absent)
        texts = self.pa.array([text or None for text in made.values], self.pa.string())
        if self.pa.types.is_dictionary(field.type):
            texts = texts.dictionary_encode()
        return texts.cast(field.type)

    def _write_group(self) -> None:
        """Write the collected rows; a group without rows is not written."""
        table = self.pa.Table.from_batches(self.waiting, self.schema)
        np.empty(HEADROOM * self.size + LEAST_ROOM, np.uint8)  # raises MemoryError, while pyarrow would end the process
        if self.writer is None:
            self.writer = self.begin()
        if self.count or (self.waiting and not self.read):
            self.write(table)
        self.waiting, self.size, self.count, self.read = [], 0, 0, 0


# --- Arrow IPC: batches as a file with a directory at its end (Feather) ---

CODECS = {b"\x04\x22\x4d\x18": "lz4", b"\x28\xb5\x2f\xfd": "zstd"}


class IpcFile(ArrowFile):
    """A file of Arrow."""

    def opened(self, file: InputFile) -> Any:
        """Open the file and return its schema."""
        ipc = require_pyarrow(self.name, "ipc")
        self.codec = codec_in(file.head())
        self.source = self.random_access(file)
        self.reader = ipc.open_file(self.source)
        return self.reader.schema

    def encoding(self) -> dict[str, Any]:
        """Return the codec of the batches."""
        return {"compression": self.codec}

    def _records(self) -> Iterator[Any]:
        """Yield the batches of the file."""
        for rows in map(self.reader.get_batch, range(self.reader.num_record_batches)):
            rows.validate(full=True)  # broken data would end the process later
            yield rows
            del rows

    def read(self) -> Iterator[ArrowBatch]:
        """Yield the rows; raises FormatError where the file is broken."""
        for rows in self.guarded(self._records()):
            for start in range(0, max(rows.num_rows, 1), AT_ONCE):
                part = rows.slice(start, AT_ONCE)
                yield ArrowBatch(part, bytes_of(part), ends_group=start + AT_ONCE >= rows.num_rows)
            del rows, part  # before the next are read


def bytes_of(rows: Any) -> int:
    """Return the memory size of rows; pyarrow before 22 does not measure views of texts: an estimate."""
    try:
        return int(rows.nbytes)
    except TypeError:
        return 16 * int(rows.num_rows * rows.num_columns)


def codec_in(data: bytes) -> str | None:
    """Return the compression of the first batch of rows, if it is within the first bytes, by its magic number."""
    return next((codec for magic, codec in CODECS.items() if magic in data), None)


class IpcWriter(GroupWriter):
    """Write each group of rows as one batch."""

    def begin(self) -> Any:
        """Return the writer of a file."""
        ipc = require_pyarrow("Arrow", "ipc")
        return ipc.new_file(self.file, self.schema, options=ipc.IpcWriteOptions(**self.how))

    def write(self, table: Any) -> None:
        """Write a batch."""
        empty = self.pa.RecordBatch.from_pylist([], schema=self.schema)
        for batch in table.combine_chunks().to_batches() or [empty]:
            self.writer.write_batch(batch)


# --- Parquet ---

SMALL = 1 << 26  # bytes of a group that may be in memory together with another one
BUFFER = 1 << 20  # bytes read at once of a group that is not in memory
SIZES = {"INT32": 4, "FLOAT": 4, "INT64": 8, "DOUBLE": 8}  # bytes of an uncompressed number
DICTIONARIES = {"PLAIN_DICTIONARY", "RLE_DICTIONARY"}
OWN_SCHEMA = b"ARROW:schema"
OLD_LIST = ".list.item"  # the name of lists before the standard's `.list.element`


class ParquetFile(ArrowFile):
    """A file of Parquet."""

    def opened(self, file: InputFile) -> Any:
        """Open the file and return its schema."""
        self.source = self.random_access(file)
        self.file = require_pyarrow(self.name, "parquet").ParquetFile(self.source, pre_buffer=False)
        self.about = self.file.metadata
        self.warned = False
        if self.about.num_row_groups:
            next(self._rows_of(0, 1), None)  # raises an exception for a damaged group, where reading it would abort
        return self.file.schema_arrow

    def read(self) -> Iterator[ArrowBatch]:
        """Yield the rows, group by group; while a small one is processed, the next is read."""
        from concurrent.futures import ThreadPoolExecutor

        count = self.about.num_row_groups
        following = None
        with ThreadPoolExecutor(1) as ahead:
            for group in range(count):
                table = self._table(group) if following is None else following.result()
                is_small = self.about.row_group(group).total_byte_size <= SMALL
                following = ahead.submit(self._table, group + 1) if is_small and group + 1 < count else None
                yield from self._of_group(group, table)
                table = None  # before the next is read

    def _table(self, group: int) -> Any:
        """Read a whole group; None for one that is too large for memory."""
        if self.about.row_group(group).total_byte_size > sizes.GROUP:
            return None
        with column_file.translated(self.name):
            return self.file.read_row_group(group)

    def _of_group(self, group: int, table: Any) -> Iterator[ArrowBatch]:
        """Yield the batches of a group, from memory or, if it is too large, as they are read."""
        about = self.about.row_group(group)
        left = about.num_rows
        packed = sum(about.column(at).total_compressed_size for at in range(about.num_columns))
        share = packed / max(left, 1)
        if table is not None:
            empty = require_pyarrow("Arrow").RecordBatch.from_pylist([], schema=self.schema)
            parts = iter(table.to_batches(max_chunksize=AT_ONCE) or [empty])
        else:
            parts = self.guarded(self._rows_of(group, AT_ONCE))
            if not self.warned:
                warn(f"{self.name}: groups of rows beyond {sizes.GROUP >> 20} MiB are written in parts")
            self.warned = True
        for rows in parts:
            left -= rows.num_rows
            yield ArrowBatch(rows, int(share * rows.num_rows), ends_group=left <= 0)

    def _rows_of(self, group: int, count: int) -> Iterator[Any]:
        """Return an iterator that reads this many rows of a group at a time."""
        parquet = require_pyarrow(self.name, "parquet")
        file = parquet.ParquetFile(self.source, metadata=self.about, buffer_size=BUFFER, pre_buffer=False)
        found: Iterator[Any] = file.iter_batches(batch_size=count, row_groups=[group])
        return found

    def encoding(self) -> dict[str, Any]:
        """Return the compression and encoding of the columns, as arguments of pyarrow's writer."""
        if not self.about.num_row_groups:
            return {}
        group = self.about.row_group(0)
        columns = [group.column(at) for at in range(group.num_columns)]
        codecs = {column.path_in_schema: column.compression.replace("UNCOMPRESSED", "NONE") for column in columns}
        return {
            "compression": codecs,
            "use_dictionary": [column.path_in_schema for column in columns if _repeats(column)],
            "use_deprecated_int96_timestamps": any(column.physical_type == "INT96" for column in columns),
            "use_compliant_nested_type": not any(OLD_LIST in column.path_in_schema for column in columns),
            "store_schema": OWN_SCHEMA in (self.about.metadata or {}),
        }


def _repeats(column: Any) -> bool:
    """Return True if a dictionary made a column smaller; for others trying costs time."""
    plain = SIZES.get(column.physical_type, 0) * column.num_values
    return not DICTIONARIES.isdisjoint(column.encodings) and not 0 < plain <= column.total_uncompressed_size


class ParquetWriter(GroupWriter):
    """Write groups of rows."""

    def begin(self) -> Any:
        """Return the writer of a file; new columns are compressed as most columns of the input."""
        how, codecs = self.how, self.how.get("compression")
        if codecs:
            usual = Counter(codecs.values()).most_common(1)[0][0]
            missing = [field.name for field in self.schema if field.name not in codecs]
            how = {**how, "compression": {**dict.fromkeys(missing, usual), **codecs}}
        return require_pyarrow("Parquet", "parquet").ParquetWriter(self.file, self.schema, **how)

    def write(self, table: Any) -> None:
        """Write a group."""
        self.writer.write_table(table, row_group_size=max(table.num_rows, 1))


WRITERS: dict[str, type[GroupWriter]] = {"parquet": ParquetWriter, "arrow": IpcWriter}


def open_columns(file: InputFile, _options: Options) -> ArrowFile:
    """Open a file of either format; raises FileProblem without pyarrow, FormatError for a broken file."""
    require_pyarrow(file.name)
    head = file.head()
    fmt = next((fmt for begin, fmt in BEGINNINGS.items() if head.startswith(begin)), "")
    if not fmt:
        found = f"it begins with {shown(head[:8])}" if head else "it is empty"
        raise FormatError(f"neither Parquet (PAR1) nor Arrow (ARROW1): {found}", source=file.name)
    return (ParquetFile if fmt == "parquet" else IpcFile)(file, fmt)


def create(columns: Sequence[OutColumn], _count: int | None, style: Style) -> GroupWriter:
    """Return a writer for new rows."""
    return WRITERS[style.format](style.format, columns, None, {})
