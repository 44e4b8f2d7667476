"""Parquet and Arrow IPC (Feather), with pyarrow, the extra `frametool[arrow]`; either can be converted to the other.

Parquet begins with PAR1, an Arrow file with ARROW1.  Rows are read and written in groups, those of the input or of a
million: types, metadata and compression are preserved.  Unchanged columns are not inspected; a new one has the type
and metadata of the one it replaces.  Columns are arrays of numbers and texts with null masks.  `apply_arrow` moves the
points of batches inside of engines, without a file.
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
from frametool.documents.source import InputFile, Verbatim
from frametool.documents.writers import dump_json
from frametool.errors import FileProblem, ValueInvalid, alternatives, shown, warn
from frametool.formats.rows import column_file
from frametool.geometry import arrays, quaternion, rigid
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.rows.column_file import Kind, Made, OutColumn
    from frametool.frames.lookups import Frames
    from frametool.geometry import Components
    from frametool.grammar.result import Style
    from frametool.text.spans import Flags, Floats, Ints


# number types in Arrow's notation -> in numpy's
NUMBERS: dict[str, Kind] = {"double": np.dtype("f8"), "float": np.dtype("f4"), "halffloat": np.dtype("f2")}
NUMBERS |= {f"{sign}int{bits}": np.dtype(f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)}
NO_TIME = "no time: null"
STRUCTURED = ("bool", "decimal", "list", "large_list", "fixed_size_list", "struct", "map")  # not text
IS_JSON = {b"ARROW:extension:name": b"arrow.json", b"ARROW:extension:metadata": b""}  # metadata of a column of JSON


def require_pyarrow(what: str, part: str = "") -> Any:
    """Return pyarrow, or a module of it; raises FileProblem with the reason and the install command."""
    try:
        return import_module(f"pyarrow.{part}" if part else "pyarrow")
    except ImportError:
        raise FileProblem(f"{what} needs pyarrow; install it: pip install 'frametool[arrow]'") from None


def kind_of(arrow_type: Any) -> Kind | None:
    """Return the numpy type of a column's numbers; None for other columns."""
    return NUMBERS.get(str(arrow_type))


def is_floating(arrow_type: Any) -> bool:
    """Return True for a floating-point type of Arrow."""
    kind = kind_of(arrow_type)
    return kind is not None and kind.kind in column_file.FLOATS


def in_one(column: Any) -> Any:
    """Return a column as one array, without a copy if it has one chunk."""
    if not hasattr(column, "chunks"):
        return column
    return column.chunk(0) if column.num_chunks == 1 else column.combine_chunks()


def nulls_of(column: Any) -> Flags | None:
    """Return the null mask, (n,); None without nulls."""
    if not column.null_count:
        return None
    nulls: Flags = column.is_null().to_numpy(zero_copy_only=False)
    return nulls


def stamps_of(column: Any, name: str, in_ns: int) -> tuple[Ints, Flags | None, dict[int, str]]:
    """Convert times to nanoseconds: timestamps (UTC if they have no zone), integers, or float seconds.

    in_ns: as in `column_file.stamps_in`, for integers
    Returns the times (0 for null), the null mask (None: no nulls), and row -> the reason why a number is not a time.
    Raises ValueInvalid for another type.
    """
    pa = require_pyarrow("an Arrow column")
    whole = in_one(column)
    nulls = nulls_of(whole)
    if pa.types.is_timestamp(whole.type):
        try:
            whole, in_ns = whole.cast(pa.timestamp("ns", whole.type.tz)).cast(pa.int64()), 1
        except pa.ArrowInvalid:
            raise ValueInvalid(f"column {shown(name)}: a stamp is beyond 64 bits of nanoseconds") from None
    elif kind_of(whole.type) is None:
        wanted = "a timestamp, integer nanoseconds, or float seconds"
        raise ValueInvalid(f"column {shown(name)} is {whole.type}; stamps are {wanted}")
    numbers = (whole if is_floating(whole.type) else whole.fill_null(0)).to_numpy(zero_copy_only=False)
    stamps, bad, reason = column_file.stamps_in(numbers, in_ns)
    rows = np.flatnonzero(bad if nulls is None else bad & ~nulls).tolist()
    return stamps, nulls, {row: f"{whole[row].as_py()} is {reason}" for row in rows}


class ArrowBatch(column_file.Batch):
    """Rows of a file.

    rows: a RecordBatch; ends_group: True if they are the last of a group of rows, which is written as one
    """

    def __init__(self, rows: Any, bytes_read: int, *, ends_group: bool) -> None:
        """Store rows, and their size in the file."""
        self.rows = rows
        self.size = int(rows.num_rows)
        self.bytes_read, self.ends_group = bytes_read, ends_group

    def numbers(self, place: int) -> tuple[Floats, Flags | None]:
        """Return a column as floats, nan for null, and the null mask."""
        column = self.rows.column(place)
        return column.to_numpy(zero_copy_only=False).astype(np.float64), nulls_of(column)

    def stamps(self, place: int, *, in_ns: int) -> tuple[Ints, dict[int, str]]:
        """Return timestamps, integers or float seconds as nanoseconds, and row -> reason for rows without a time."""
        stamps, nulls, reasons = stamps_of(self.rows.column(place), self.rows.schema.names[place], in_ns)
        return stamps, reasons | dict.fromkeys([] if nulls is None else np.flatnonzero(nulls).tolist(), NO_TIME)

    def texts(self, place: int) -> list[str]:
        """Return a column as texts, "" for null; nested values as JSON, bytes that are not UTF-8 as \\xff."""
        values = ["" if value is None else value for value in self.values(place)]
        return [value if isinstance(value, str) else dump_json(value) for value in values]

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
HEADROOM, LEAST_ROOM = 3, 1 << 26  # memory for writing a group: this multiple of its size, plus these bytes
NULLS = True  # columns may hold nulls
AT_ONCE = 1 << 16  # rows of a batch: results stay near the cache
CODECS = {b"\x04\x22\x4d\x18": "lz4", b"\x28\xb5\x2f\xfd": "zstd"}  # of Arrow's batches, by their magic numbers
BUFFER = 1 << 20  # bytes of a column of Parquet that are read at once
SIZES = {"INT32": 4, "FLOAT": 4, "INT64": 8, "DOUBLE": 8}  # bytes of an uncompressed number
DICTIONARIES = {"PLAIN_DICTIONARY", "RLE_DICTIONARY"}
OWN_SCHEMA = b"ARROW:schema"
OLD_LIST = ".list.item"  # the name of lists before the standard's `.list.element`


class ArrowFile(column_file.ColumnFile):
    """An opened file: its schema is read, its rows are not."""

    gaps = False

    def __init__(self, file: InputFile) -> None:
        """Read the schema; raises FileProblem without pyarrow, FormatError for a broken file."""
        pa, head, self.name = require_pyarrow(file.name), file.head(), file.name
        self.format = next((fmt for begin, fmt in BEGINNINGS.items() if head.startswith(begin)), "")
        if not self.format:
            found = f"it begins with {shown(head[:8])}" if head else "it is empty"
            raise file.error(f"neither Parquet (PAR1) nor Arrow (ARROW1): {found}")
        self.codec = next((codec for magic, codec in CODECS.items() if magic in head), None)
        with column_file.translated(self.name):
            if file.path != "-" and os.path.isfile(file.path):
                self.source = pa.OSFile(file.path)
            else:  # a pipe is first copied to an unnamed file
                stream = column_file.seekable(file, self)
                stream.seek(0)
                self.source = pa.PythonFile(stream, mode="r")
            if self.format == "parquet":
                parquet = require_pyarrow(self.name, "parquet")
                self.reader = parquet.ParquetFile(self.source, pre_buffer=False, buffer_size=BUFFER)
                self.schema = self.reader.schema_arrow
                if self.reader.metadata.num_row_groups:  # raises for a damaged group, where reading it would abort
                    next(self.reader.iter_batches(1, [0]), None)
            else:
                self.reader = require_pyarrow("Arrow", "ipc").open_file(self.source)
                self.schema = self.reader.schema
            self.names: tuple[str, ...] | None = tuple(self.schema.names)
        self.width = len(self.schema.names)
        self.kinds = [kind_of(field.type) for field in self.schema]

    def batches(self) -> Iterator[ArrowBatch]:
        """Yield the rows, and close the file; raises FormatError if it is broken."""
        with self.source:  # a thread of pyarrow may hold it longer than its reader
            found = self._parquet() if self.format == "parquet" else self._arrow()
            while True:
                with column_file.translated(self.name):
                    batch = next(found, None)
                if batch is None:
                    return
                yield batch
                batch.rows = None  # before the next are read

    def _arrow(self) -> Iterator[ArrowBatch]:
        """Yield the rows of a file of Arrow: batches of rows, with a directory at its end (Feather)."""
        for group in range(self.reader.num_record_batches):
            rows = self.reader.get_batch(group)
            rows.validate(full=True)  # broken data would end the process later
            for start in range(0, max(rows.num_rows, 1), AT_ONCE):
                part = rows.slice(start, AT_ONCE)
                yield ArrowBatch(part, bytes_of(part), ends_group=start + AT_ONCE >= rows.num_rows)
            del rows, part  # before the next are read

    def _parquet(self) -> Iterator[ArrowBatch]:
        """Yield the rows of a file of Parquet, group by group."""
        groups = [self.reader.metadata.row_group(at) for at in range(self.reader.metadata.num_row_groups)]
        if any(group.total_byte_size > sizes.GROUP for group in groups):
            warn(f"{self.name}: groups of rows beyond {sizes.GROUP >> 20} MiB are written in parts")
        for at, group in enumerate(groups):
            left = group.num_rows
            share = sum(group.column(place).total_compressed_size for place in range(group.num_columns)) / max(left, 1)
            for rows in self.reader.iter_batches(AT_ONCE, [at]) if left else [empty_rows(self.schema)]:
                left -= rows.num_rows
                yield ArrowBatch(rows, int(share * rows.num_rows), ends_group=left <= 0)
                del rows  # before the next are read

    def rewriter(self, columns: Sequence[OutColumn], _count: int | None, style: Style) -> GroupWriter:
        """Return a writer with the same schema and compression; the output may be the other Arrow format."""
        fmt = style.format if style.format in BEGINNINGS.values() else self.format
        how: dict[str, Any] = {}  # arguments of pyarrow's writer
        if fmt == self.format == "arrow":
            how = {"compression": self.codec}
        elif fmt == self.format and self.reader.metadata.num_row_groups:
            group = self.reader.metadata.row_group(0)
            stored = [group.column(at) for at in range(group.num_columns)]
            codecs = {each.path_in_schema: each.compression.replace("UNCOMPRESSED", "NONE") for each in stored}
            repeating = []  # columns that a dictionary made smaller; trying it for others costs time
            for each in stored:
                plain = SIZES.get(each.physical_type, 0) * each.num_values
                if not DICTIONARIES.isdisjoint(each.encodings) and not 0 < plain <= each.total_uncompressed_size:
                    repeating.append(each.path_in_schema)
            how = {
                "compression": codecs,
                "use_dictionary": repeating,
                "use_deprecated_int96_timestamps": any(each.physical_type == "INT96" for each in stored),
                "use_compliant_nested_type": not any(OLD_LIST in each.path_in_schema for each in stored),
                "store_schema": OWN_SCHEMA in (self.reader.metadata.metadata or {}),
            }
        return GroupWriter(fmt, columns, self.schema, how)


def empty_rows(schema: Any) -> Any:
    """Return a RecordBatch without rows."""
    return require_pyarrow("Arrow").RecordBatch.from_pylist([], schema=schema)


def bytes_of(rows: Any) -> int:
    """Return the size of rows in memory, estimated where pyarrow (before 22, for views of texts) cannot measure it."""
    try:
        return int(rows.nbytes)
    except TypeError:
        return 16 * int(rows.num_rows * rows.num_columns)


class Collected(BytesIO):
    """A file in memory to write to, whose bytes are taken piece by piece."""

    before = 0  # number of bytes taken so far

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
    """Collects rows until a group is complete: a row group of Parquet, or a batch of Arrow."""

    def __init__(self, fmt: str, columns: Sequence[OutColumn], of_input: Any, how: dict[str, Any]) -> None:
        """Store the columns of the output, and make its schema.

        of_input: the schema of the input, None for new rows; how: arguments of pyarrow's writer
        """
        self.pa = require_pyarrow("Arrow")
        self.format, self.columns, self.how = fmt, columns, how
        self.sink = Collected()
        fields = []
        for column in columns:
            own = [] if column.passed is None else [column.passed]
            if of_input is not None and not own:  # a new column may replace one of the input
                own = of_input.get_all_field_indices(column.name)
            if own:
                fields.append(of_input.field(own[0]))
            else:
                kind = self.pa.string() if column.kind is None else self.pa.from_numpy_dtype(column.kind)
                fields.append(self.pa.field(column.name, kind, metadata=IS_JSON if column.is_json else None))
        self.schema = self.pa.schema(fields, metadata=None if of_input is None else of_input.metadata)
        self.writer: Any = None
        self.waiting: list[Any] = []
        self.size = self.count = self.read = 0

    def of_rows(self, batch: Any, rows: Ints | None, made: Sequence[Made]) -> bytes:
        """Add rows, and return the bytes that were written, if a group of rows became complete.

        Raises ValueInvalid for a null that the schema does not allow.
        """
        new, arrays = iter(made), []
        for column, field in zip(self.columns, self.schema, strict=True):
            if column.passed is not None and batch is not None:
                passed = batch.rows.column(column.passed)
                arrays.append(passed if rows is None else passed.take(self.pa.array(rows)))
                continue
            values, absent = next(new)
            if absent is not None and not field.nullable and absent.any():
                raise ValueInvalid(f"column {field.name} is declared not to hold nulls, and a row becomes null there")
            if isinstance(values, np.ndarray):
                arrays.append(self.pa.array(values, type=field.type, mask=absent))
                continue
            texts = self.pa.array([text or None for text in values], self.pa.string())
            is_dictionary = self.pa.types.is_dictionary(field.type)
            arrays.append((texts.dictionary_encode() if is_dictionary else texts).cast(field.type))
        found = self.pa.RecordBatch.from_arrays(arrays, schema=self.schema)
        self.waiting.append(found)
        self.size += bytes_of(found)
        self.count += found.num_rows
        self.read += found.num_rows if batch is None else batch.size
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

    def _write_group(self) -> None:
        """Write the collected rows; a group without rows is not written, unless the input has one."""
        table = self.pa.Table.from_batches(self.waiting, self.schema)
        np.empty(HEADROOM * self.size + LEAST_ROOM, np.uint8)  # raises MemoryError, while pyarrow would end the process
        if self.writer is None:
            file, how = self.pa.PythonFile(self.sink, mode="w"), self.how
            if self.format == "arrow":
                ipc = require_pyarrow("Arrow", "ipc")
                self.writer = ipc.new_file(file, self.schema, options=ipc.IpcWriteOptions(**how))
            else:
                if codecs := how.get("compression"):  # new columns are compressed as most columns of the input
                    usual = Counter(codecs.values()).most_common(1)[0][0]
                    how = {**how, "compression": {field.name: usual for field in self.schema} | codecs}
                self.writer = require_pyarrow("Parquet", "parquet").ParquetWriter(file, self.schema, **how)
        if self.count or (self.waiting and not self.read):
            for batch in table.combine_chunks().to_batches() or [empty_rows(self.schema)]:
                self.writer.write_batch(batch, *[max(batch.num_rows, 1)] * (self.format == "parquet"))
        self.waiting, self.size, self.count, self.read = [], 0, 0, 0


def create(columns: Sequence[OutColumn], _count: int | None, style: Style) -> GroupWriter:
    """Return a writer for new rows."""
    return GroupWriter(style.format, columns, None, {})


open_columns = ArrowFile

# --- points moved inside of engines ---

XYZ = ("x", "y", "z")
COLUMNS = {"point": XYZ, "vector": XYZ, "pose": (*XYZ, "qx", "qy", "qz", "qw")}  # as_ -> default columns


def apply_arrow(
    data: Any,
    transform: Transform | None = None,
    columns: Sequence[str] | None = None,
    as_: str = "point",
    *,
    tree: Frames | None = None,
    target: str = "",
    source: str = "",
    time_column: str | None = None,
) -> Any:
    """Move the points of a pyarrow RecordBatch or Table; return the same type, with all other columns unchanged.

    transform: one, or one per row; or `tree`, `target`, `source`: looked up at the latest time, with `time_column` at
    each row's (timestamps, integer nanoseconds, float seconds).
    as_: "point" or "vector", columns x, y, z unless named, or "pose", columns x, y, z, qx, qy, qz, qw.
    A null in one of these columns makes all of them null in its row.  float32 is computed in float64 and rounded once.
    Raises ValueInvalid for columns that are not floating point, and for the first row, from 0, that is not finite.
    """
    pa = require_pyarrow("apply_arrow")
    if not isinstance(data, (pa.RecordBatch, pa.Table)):
        kind = f"{type(data).__module__}.{type(data).__name__}"
        raise ValueInvalid(f"expected a pyarrow RecordBatch or Table, got {kind}")
    if as_ not in COLUMNS:
        raise ValueInvalid(f"as_ is one of {', '.join(COLUMNS)}; found {shown(as_)}")
    names, usual = COLUMNS[as_] if columns is None else tuple(columns), COLUMNS[as_]
    if len(names) != len(usual) or len(set(names)) != len(names):
        raise ValueInvalid(f"columns: a {as_} has {len(usual)}, like {', '.join(usual)}; found {', '.join(names)}")
    places = [_place_of(name, data.schema.names) for name in names]
    fields, inputs = [data.schema.field(place) for place in places], [in_one(data.column(place)) for place in places]
    if wrong := next((field for field in fields if not is_floating(field.type)), None):
        raise ValueInvalid(f"column {shown(wrong.name)} is {wrong.type}, not floating point; cast it to float64 first")
    numbers = [column.to_numpy(zero_copy_only=False) for column in inputs]
    masks = [mask for mask in map(nulls_of, inputs) if mask is not None]
    nulls = np.logical_or.reduce(masks) if masks else None
    mover = _mover(data, transform, tree, target, source, time_column, nulls)
    new = list(data.columns)
    for place, each, field in zip(places, _moved(as_, mover, numbers, nulls), fields, strict=True):
        with np.errstate(over="ignore"):  # numbers that are too large become infinite
            values = np.asarray(each, kind_of(field.type))
        if nulls is not None and not field.nullable:
            row = int(np.argmax(nulls))
            raise ValueInvalid(f"{field.name}[{row}] becomes null, and the schema allows none there; make it nullable")
        finite = np.isfinite(values) if nulls is None else np.isfinite(values) | nulls
        if not finite.all():
            row = int(np.argmin(finite))
            for column, its in zip(numbers, fields, strict=True):
                if not np.isfinite(column[row]):
                    what = f"{its.name}[{row}]: {column[row]} is not finite"
                    raise ValueInvalid(f"{what}; make it null, or leave the row out")
            raise ValueInvalid(f"{field.name}[{row}]: the result is too large for {field.type}")
        new[place] = pa.array(values, type=field.type, mask=nulls)
    return type(data).from_arrays(new, schema=data.schema)


def _moved(as_: str, mover: Transform, numbers: list[Any], nulls: Flags | None) -> Components:
    """Return the columns of points, vectors or poses moved by a transform."""
    if as_ == "vector":
        return arrays.run(quaternion.rotate, 3, (*mover.components[3:], *numbers))
    if as_ == "point":
        return arrays.run(rigid.apply, 3, (*mover.components, *numbers))
    rows = np.stack(numbers, axis=-1, dtype=np.float64)
    if nulls is not None:  # values of null rows are arbitrary
        rows[nulls] = rigid.IDENTITY
    poses = mover @ Transform.from_arrays(rows[:, :3], rows[:, 3:])
    return (*poses.components[:3], *poses.xyzw.T)


def _place_of(name: str, names: Sequence[str]) -> int:
    """Return the index of a column; raises ValueInvalid if it is missing or appears twice."""
    if name not in names:
        raise ValueInvalid(f"no column {shown(name)}{alternatives(name, names, 'columns')}")
    if names.count(name) > 1:
        raise ValueInvalid(f"column {shown(name)} appears twice")
    return names.index(name)


def _mover(
    data: Any, transform: Transform | None, tree: Frames | None, target: str, source: str, time_column: str | None,
    nulls: Flags | None,
) -> Transform:  # fmt: skip
    """Return the transform of the rows, one or one per row; for null rows nothing is looked up."""
    if tree is None:
        lacks_tree, rows = target or source or time_column, data.num_rows
        if lacks_tree or not isinstance(transform, Transform):
            found = "no tree" if lacks_tree else type(transform).__name__
            raise ValueInvalid(f"expected a Transform, or tree, target and source; got {found}")
        if transform.shape not in ((), (rows,)):
            raise ValueInvalid(f"transforms of shape {transform.shape} for {rows} rows; expected one, or one a row")
        return transform
    if transform is not None or not (target and source):
        raise ValueInvalid("give a transform, or tree, target and source")
    if time_column is None:
        return tree.lookup(target, source)
    column = data.column(_place_of(time_column, data.schema.names))
    stamps, missing, bad = stamps_of(column, time_column, int(not is_floating(column.type)))
    for row, reason in bad.items():
        raise ValueInvalid(f"{time_column}[{row}]: {reason}; integers are nanoseconds")
    needed = np.True_ if nulls is None else ~nulls
    if missing is not None and (lost := missing & needed).any():
        row = int(np.argmax(lost))
        raise ValueInvalid(f"{time_column}[{row}] is null: no time; leave the row out, or make it null in whole")
    if nulls is None:
        return tree.lookup_many(target, source, stamps)
    poses = np.tile(np.reshape(rigid.IDENTITY, (7, 1)), len(stamps))
    poses[:, needed] = tree.lookup_many(target, source, stamps[needed]).components
    return Transform.of(*poses)
