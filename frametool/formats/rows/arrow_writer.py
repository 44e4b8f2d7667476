"""Rows in groups, as Parquet and Arrow IPC hold them: those of the input, or of a million."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import warn
from frametool.formats.rows.arrow import ArrowRows, Collected, require_pyarrow, type_of, typed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.rows.arrow import ArrowBatch
    from frametool.formats.rows.column_file import Made, OutColumn
    from frametool.text.spans import Ints

LARGEST = 3 << 26  # bytes of a group of rows that is held as a whole, four times in all: below 1 GB
NEW_GROUP = 1 << 20  # rows of a group where the input has none
OURS = ("frame", "name", "parent")  # columns of names that we make: frames, whatever they look like


class GroupWriter:
    """Collect rows until a group is whole; a form says how a file begins and how a group is written.

    Texts from elsewhere get the types that the cells of the first group have.
    """

    def __init__(self, columns: Sequence[OutColumn], given: Any | None) -> None:
        """Take the columns of the result, and the schema of the input if it has one."""
        self.pa = require_pyarrow("Arrow")
        self.sink = Collected()
        self.file = self.pa.PythonFile(self.sink, mode="w")
        self.rows = ArrowRows(columns, given)
        self.schema = self.rows.schema
        texts = [column.name for column in columns if column.kind is None and column.name not in OURS]
        self.untyped = texts if given is None else []
        self.writer: Any = None
        self.waiting: list[Any] = []
        self.size = self.count = self.read = 0

    def begin(self) -> Any:
        """Return what writes to `file`; it can be closed."""
        raise NotImplementedError

    def write(self, table: Any) -> None:
        """Write a group of rows."""
        raise NotImplementedError

    def of_rows(self, batch: ArrowBatch | None, rows: Ints | None, made: Sequence[Made]) -> memoryview:
        """Return what is written once a group of rows is whole."""
        new = self.rows.of_batch(batch, rows, made)
        self.waiting.append(new)
        self.size += new.nbytes
        self.count += new.num_rows
        self.read += new.num_rows if batch is None else batch.size
        ends = batch.ends_group if batch is not None else self.count >= NEW_GROUP
        if ends or self.size > LARGEST:
            self._write_group()
        return self.sink.taken()

    def end(self) -> Iterator[bytes]:
        """Yield the last group and what stands behind all."""
        if self.waiting or self.writer is None:
            self._write_group()
        self.writer.close()
        yield bytes(self.sink.taken())

    def _write_group(self) -> None:
        """Write what waits; a group whose rows were all left out is none."""
        table = self.pa.Table.from_batches(self.waiting, self.rows.schema)
        begins = self.writer is None
        if self.untyped:
            table = self._typed(table, begins=begins)
        if begins:
            self.writer = self.begin()
        if self.count or (self.waiting and not self.read):
            self.write(table)
        self.waiting, self.size, self.count, self.read = [], 0, 0, 0

    def _typed(self, table: Any, *, begins: bool) -> Any:
        """Return a group whose texts have their types, which the first one settles."""
        for name in self.untyped:
            at = self.schema.get_field_index(name)
            if begins:
                self.schema = self.schema.set(at, self.pa.field(name, type_of(table.column(at))))
            made = typed(table.column(at), self.schema.field(at).type, name)
            table = table.set_column(at, self.schema.field(at), made)
        if begins:
            told = ", ".join(f"{name} {self.schema.field(name).type}" for name in self.untyped)
            warn(f"types of other columns, by their cells: {told}")
        return table
