"""Parquet: groups of rows, read one after the other and written as they were: types, metadata, compression, groups."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from frametool.errors import warn
from frametool.formats.rows.arrow import ArrowBatch, kind_of, no_rows, require_pyarrow, seekable, translated
from frametool.formats.rows.arrow_writer import LARGEST, GroupWriter

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import ColumnWriter, Kind, OutColumn
    from frametool.grammar.result import Style

SMALL = 1 << 26  # bytes of a group that may be held beside another one
BUFFER = 1 << 20  # bytes that are read at once of a group that is not held
ROWS = 1 << 16  # a batch: what is made of it stays near the cache
SIZES = {"INT32": 4, "FLOAT": 4, "INT64": 8, "DOUBLE": 8}  # bytes of a number as it is
DICTIONARIES = {"PLAIN_DICTIONARY", "RLE_DICTIONARY"}
OWN_SCHEMA = b"ARROW:schema"
OLD_LIST = ".list.item"  # what lists were called before the standard's `.list.element`


class ParquetColumns:
    """A file that was opened: its schema is read, its rows are not."""

    vectors: tuple[tuple[str, ...], ...] = ()
    gaps = False

    def __init__(self, file: InputFile) -> None:
        """Read the schema; raises FormatError."""
        self.name = file.name
        parquet = require_pyarrow(self.name, "parquet")
        with translated(self.name):
            self.source = seekable(file)
            self.file = parquet.ParquetFile(self.source, pre_buffer=False)
            self.schema = self.file.schema_arrow
            self.names: tuple[str, ...] | None = tuple(self.schema.names)
            self.about = self.file.metadata
            if self.about.num_row_groups:
                next(self._rows_of(0, 1), None)  # of a damaged group this raises, where its description aborts
        self.told = False
        self.width = len(self.schema.names)

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers; None for what is no number."""
        return kind_of(self.schema.field(place).type)

    def batches(self) -> Iterator[ArrowBatch]:
        """Yield the rows, group by group; while a small one is worked on, the next is read."""
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

    def _of_group(self, group: int, table: Any) -> Iterator[ArrowBatch]:
        """Yield the batches of a group, of its table or, where that would be too large, as they are read."""
        about = self.about.row_group(group)
        left, share = about.num_rows, 0.0
        for rows in self._pieces(group) if table is None else _batches_of(table, self.schema):
            share = share or _compressed(about) / max(left, 1)
            left -= rows.num_rows
            batch = ArrowBatch(rows, int(share * rows.num_rows), ends_group=left <= 0)
            yield batch
            batch.let_go()

    def _table(self, group: int) -> Any:
        """Read a group, its columns side by side; None for one that is too large to be held."""
        if self.about.row_group(group).total_byte_size > LARGEST:
            return None
        with translated(self.name):
            return self.file.read_row_group(group)

    def _pieces(self, group: int) -> Iterator[Any]:
        """Yield a group in batches that are read when they are asked for."""
        if not self.told:
            warn(f"{self.name}: groups of rows beyond {LARGEST >> 20} MiB are written in parts")
            self.told = True
        pieces = self._rows_of(group, ROWS)
        while True:
            with translated(self.name):
                rows = next(pieces, None)
            if rows is None:
                return
            yield rows

    def _rows_of(self, group: int, count: int) -> Iterator[Any]:
        """Return what reads so many rows of a group at a time."""
        parquet = require_pyarrow(self.name, "parquet")
        file = parquet.ParquetFile(self.source, metadata=self.about, buffer_size=BUFFER, pre_buffer=False)
        found: Iterator[Any] = file.iter_batches(batch_size=count, row_groups=[group])
        return found

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes the same schema, compressed in the same way; the form may be another one of Arrow's."""
        del drops
        from frametool.formats.rows.arrow_files import writer_of

        return writer_of(style.form, "parquet", columns, self.schema, self._compression())

    def _compression(self) -> dict[str, Any]:
        """Return how the columns are compressed and encoded, as the writer of pyarrow wants to be told."""
        if not self.about.num_row_groups:
            return {}
        group = self.about.row_group(0)
        columns = [group.column(at) for at in range(group.num_columns)]
        codecs = {column.path_in_schema: _codec(column.compression) for column in columns}
        return {
            "compression": codecs,
            "use_dictionary": [column.path_in_schema for column in columns if _repeats(column)],
            "use_deprecated_int96_timestamps": any(column.physical_type == "INT96" for column in columns),
            "use_compliant_nested_type": not any(OLD_LIST in column.path_in_schema for column in columns),
            "store_schema": OWN_SCHEMA in (self.about.metadata or {}),
        }


def _batches_of(table: Any, schema: Any) -> Sequence[Any]:
    """Return a table in batches, one where it has no rows."""
    return table.to_batches(max_chunksize=ROWS) or [no_rows(schema)]


def _compressed(group: Any) -> int:
    """Count the bytes that a group of rows takes in the file."""
    return sum(group.column(at).total_compressed_size for at in range(group.num_columns))


def _codec(name: str) -> str:
    return "NONE" if name == "UNCOMPRESSED" else name


def _repeats(column: Any) -> bool:
    """Tell whether a dictionary of the values of a column made it shorter; for others trying costs time."""
    plain = SIZES.get(column.physical_type, 0) * column.num_values
    return not DICTIONARIES.isdisjoint(column.encodings) and not 0 < plain <= column.total_uncompressed_size


class ParquetWriter(GroupWriter):
    """Write groups of rows."""

    def __init__(self, form: str, columns: Sequence[OutColumn], given: Any | None, how: dict[str, Any]) -> None:
        """Begin with nothing; `how` is the compression of the input's columns, others have that of most."""
        del form
        super().__init__(columns, given)
        self.how = how

    def begin(self) -> Any:
        """Return the writer of a file."""
        how, codecs = self.how, self.how.get("compression")
        if codecs:
            usual = Counter(codecs.values()).most_common(1)[0][0]
            missing = [field.name for field in self.schema if field.name not in codecs]
            how = {**how, "compression": {**dict.fromkeys(missing, usual), **codecs}}
        return require_pyarrow("Parquet", "parquet").ParquetWriter(self.file, self.schema, **how)

    def write(self, table: Any) -> None:
        """Write a group."""
        self.writer.write_table(table, row_group_size=max(table.num_rows, 1))


def open_columns(file: InputFile) -> ParquetColumns:
    """Open a file; raises FormatError."""
    return ParquetColumns(file)


WRITER = ParquetWriter
