"""Arrow IPC: batches as a file with a directory at its end (Feather), or as a stream that begins at once."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from frametool.formats.rows.arrow import ArrowBatch, kind_of, no_rows, require_pyarrow, seekable, translated
from frametool.formats.rows.arrow_writer import GroupWriter

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import ColumnWriter, Kind, OutColumn
    from frametool.grammar.result import Style

MAGIC = b"ARROW1"
BODY_AT = 8  # behind the magic and two bytes that fill it up
MESSAGE = b"\xff\xff\xff\xff"  # what each message begins with
ROWS = 1 << 16
CODECS = ("lz4", "zstd")
RECORD_BATCH = 3


class IpcColumns:
    """A file or stream that was opened: its schema is read, its rows are not."""

    vectors: tuple[tuple[str, ...], ...] = ()
    gaps = False

    def __init__(self, file: InputFile) -> None:
        """Read the schema; raises FormatError."""
        self.name = file.name
        self.pa = require_pyarrow(self.name)
        head = file.head()
        self.form = "arrow" if head.startswith(MAGIC) else "arrows"
        self.codec = codec_in(head[BODY_AT:] if self.form == "arrow" else head)
        ipc = require_pyarrow(self.name, "ipc")
        with translated(self.name):
            if self.form == "arrow":
                self.reader = ipc.open_file(seekable(file))
            else:
                self.reader = ipc.open_stream(self.pa.PythonFile(file.stream, mode="r"))
            self.schema = self.reader.schema
            self.names: tuple[str, ...] | None = tuple(self.schema.names)
        self.width = len(self.schema.names)

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers; None for what is no number."""
        return kind_of(self.schema.field(place).type)

    def batches(self) -> Iterator[ArrowBatch]:
        """Yield the rows; raises FormatError where the file is broken."""
        for rows in self._records():
            for start in range(0, max(rows.num_rows, 1), ROWS):
                part = rows.slice(start, ROWS)
                batch = ArrowBatch(part, part.nbytes, ends_group=start + ROWS >= rows.num_rows)
                yield batch
                batch.let_go()
            del rows, part  # before the next are read

    def _records(self) -> Iterator[Any]:
        """Yield the batches of the file."""
        if self.form == "arrow":
            for at in range(self.reader.num_record_batches):
                with translated(self.name):
                    rows = self.reader.get_batch(at)
                    rows.validate(full=True)  # what is broken ends the process where it is touched
                yield rows
            return
        while True:
            try:
                with translated(self.name):
                    rows = self.reader.read_next_batch()
                    rows.validate(full=True)
            except StopIteration:
                return
            yield rows

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes the same schema, compressed in the same way; the form may be another one of Arrow's."""
        del drops
        from frametool.formats.rows.arrow_files import writer_of

        return writer_of(style.form, self.form, columns, self.schema, {"codec": self.codec})


def codec_in(data: bytes) -> str | None:
    """Return how the first batch of rows is compressed, as far as it is among the first bytes.

    Source: format/Message.fbs and File.fbs of Arrow; a message is a flatbuffer behind its length.
    """
    at = 0
    try:
        while data[at : at + 4] == MESSAGE:
            (size,) = struct.unpack_from("<i", data, at + 4)
            message = memoryview(data)[at + 8 : at + 8 + size]
            root = struct.unpack_from("<i", message, 0)[0]
            body = _number(message, root, 3, "<q")
            if _number(message, root, 1, "<B") == RECORD_BATCH:
                return _codec_of(message, _table(message, root, 2))
            at += 8 + size + body
    except (struct.error, IndexError):
        return None
    return None


def _codec_of(message: memoryview, batch: int) -> str | None:
    """Return the codec of a batch of rows, None if it is not compressed."""
    if not _place(message, batch, 3):
        return None
    return CODECS[_number(message, _table(message, batch, 3), 0, "<b")]


def _place(message: memoryview, table: int, field: int) -> int:
    """Return where a field of a table stands; 0 for one that is not there."""
    directory = table - struct.unpack_from("<i", message, table)[0]
    (size,) = struct.unpack_from("<H", message, directory)
    entry = 4 + 2 * field
    offset = struct.unpack_from("<H", message, directory + entry)[0] if entry < size else 0
    return table + offset if offset else 0


def _number(message: memoryview, table: int, field: int, form: str) -> int:
    """Return a number of a table, 0 if it is not there."""
    place = _place(message, table, field)
    return int(struct.unpack_from(form, message, place)[0]) if place else 0


def _table(message: memoryview, table: int, field: int) -> int:
    """Return where a table within a table stands."""
    place = _place(message, table, field)
    return place + int(struct.unpack_from("<i", message, place)[0])


class IpcWriter(GroupWriter):
    """Write each group of rows as one batch."""

    def __init__(self, form: str, columns: Sequence[OutColumn], given: Any | None, how: dict[str, Any]) -> None:
        """Begin with nothing; `how` has the codec of the input's batches, if any."""
        super().__init__(columns, given)
        self.form = form
        self.codec = how.get("codec")

    def begin(self) -> Any:
        """Return the writer of a file or a stream."""
        ipc = require_pyarrow("Arrow", "ipc")
        new = ipc.new_file if self.form == "arrow" else ipc.new_stream
        return new(self.file, self.schema, options=ipc.IpcWriteOptions(compression=self.codec))

    def write(self, table: Any) -> None:
        """Write a batch."""
        batches = table.combine_chunks().to_batches()
        for batch in batches or [no_rows(self.schema)]:
            self.writer.write_batch(batch)


def open_columns(file: InputFile) -> IpcColumns:
    """Open a file or a stream; raises FormatError."""
    return IpcColumns(file)


WRITER = IpcWriter
