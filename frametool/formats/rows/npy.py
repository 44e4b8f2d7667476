"""NPY, the array of one file of numpy: n x 3 points, n x 7 poses, or records with named fields.

Read in pieces, never unpickled; of more than two axes the first counts the rows (n x 4 x 4 is n x 16).
"""

from __future__ import annotations

import ast
import struct
from math import prod
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import FormatError, shown
from frametool.formats.rows.structured import PIECE, StructuredBatch, StructuredWriter, is_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import BinaryIO

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Kind, OutColumn
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style

MAGIC = b"\x93NUMPY"
ROWS = 1 << 15  # a batch; in cache with what is made of it
MOST_HEADER = 1 << 20
LONGEST_TEXT = 64  # characters of a name that is made; numpy has a fixed size for them
ALIGNED = 64  # bytes, as numpy pads its headers


class ArrayHeader(NamedTuple):
    """What stands before the numbers: the type of an element, the shape, and whether columns stand one by one."""

    kind: Kind
    shape: tuple[int, ...]
    by_columns: bool


def read_header(stream: BinaryIO, name: str) -> ArrayHeader:
    """Read the header; raises FormatError."""

    def wrong(what: str) -> FormatError:
        return FormatError(what, source=name)

    begin = _exactly(stream, len(MAGIC) + 2, name)
    if not begin.startswith(MAGIC):
        raise wrong("no NPY file: it does not begin with \\x93NUMPY")
    long = begin[len(MAGIC)] > 1
    (size,) = struct.unpack("<I" if long else "<H", _exactly(stream, 4 if long else 2, name))
    if size > MOST_HEADER:
        raise wrong(f"the header says that it has {size} bytes; it is damaged")
    text = _exactly(stream, size, name).decode("utf-8" if begin[len(MAGIC)] > 2 else "latin-1", "replace")
    try:
        said = ast.literal_eval(text.strip())
        kind, shape, by_columns = said["descr"], said["shape"], said["fortran_order"]
        kind = np.lib.format.descr_to_dtype(kind)
        if type(shape) is not tuple or any(type(each) is not int or each < 0 for each in shape):
            raise ValueError(shape)
    except (ValueError, SyntaxError, KeyError, TypeError, MemoryError, RecursionError):
        raise wrong(f"the header cannot be read: {shown(text.strip())}") from None
    if kind.hasobject:
        raise wrong("it holds Python objects, which are never unpickled; save plain numbers")
    return ArrayHeader(kind, shape, bool(by_columns))


def _exactly(stream: BinaryIO, size: int, name: str) -> bytes:
    data = stream.read(size)
    while len(data) < size and (more := stream.read(size - len(data))):
        data += more
    if len(data) < size:
        raise FormatError("the file ends within its header", source=name)
    return data


class NpyFile:
    """An array whose rows are read one batch after the other."""

    vectors: tuple[tuple[str, ...], ...] = ()
    gaps = True

    def __init__(self, file: InputFile) -> None:
        """Read the header; raises FormatError for what is no table of numbers."""
        self.file = file
        header = read_header(file.stream, file.name)
        self.shape = header.shape
        if not self.shape:
            wanted = "wanted are rows: an array n x 3, or one with fields"
            raise FormatError(f"it holds a single value; {wanted}", source=file.name)
        self.count = self.shape[0]
        self.names: tuple[str, ...] | None = header.kind.names
        self.plain = self.names is None
        if self.plain:
            self.width = prod(self.shape[1:]) if len(self.shape) > 1 else 1
            if not is_number(header.kind):
                raise FormatError(f"it holds {header.kind}; wanted are numbers, or fields", source=file.name)
            self.record = np.dtype([(f"{place}", header.kind) for place in range(self.width)])
        elif len(self.shape) > 1:
            raise FormatError(f"records in {len(self.shape)} axes; wanted is one row of them", source=file.name)
        else:
            self.record, self.width = header.kind, len(header.kind.names or ())
        self.by_columns = header.by_columns and len(self.shape) > 1
        self.fields = self.record.names or ()

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers; None for what is no number."""
        kind = self.record[place]
        return kind if is_number(kind) else None

    def batches(self) -> Iterator[StructuredBatch]:
        """Yield the rows; raises FormatError where the file ends too early."""
        if self.by_columns:
            yield from self._rows_of_columns()
        else:
            yield from record_batches(self.file, self.record, self.count, ROWS)

    def _rows_of_columns(self) -> Iterator[StructuredBatch]:
        """Yield the rows of an array whose columns stand one after the other: all of it is read for that."""
        data, size = bytearray(), self.count * self.record.itemsize
        while len(data) < size and (piece := self.file.stream.read(min(PIECE, size - len(data)))):
            data += piece
        if len(data) < size:
            raise FormatError(f"the file ends after {len(data)} of {size} bytes", source=self.file.name)
        array = np.frombuffer(data, self.record[0]).reshape(self.shape, order="F")
        for first in range(0, self.count, ROWS):
            rows = np.ascontiguousarray(array[first : first + ROWS]).reshape(-1, self.width)
            yield StructuredBatch(rows.view(self.record)[:, 0], self.fields)

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> NpyWriter:
        """Return what writes an array of the same kind, row after row."""
        del style
        kind = _record_of(columns, self.record)
        if self.plain and len(columns) == self.width:
            kind = np.dtype([(f"{place}", column.kind or self.record[place]) for place, column in enumerate(columns)])
        return NpyWriter(columns, self.fields, kind, count=None if drops else self.count, shape=self.shape[1:],
                         plain=self.plain)  # fmt: skip


def record_batches(file: InputFile, record: Kind, count: int, size: int) -> Iterator[StructuredBatch]:
    """Yield so many records of a stream; memory is taken as they come, not as many as are said to come.

    Raises FormatError where the file ends too early.
    """
    done = 0
    while done < count:
        rows = min(size, count - done)
        data = bytearray(rows * record.itemsize)
        view, filled = memoryview(data), 0
        while filled < len(data) and (got := file.stream.readinto(view[filled:])):  # type: ignore[attr-defined]
            filled += got
        if filled < len(data):
            whole = done + filled // max(record.itemsize, 1)
            raise FormatError(f"the file ends after {whole} of {count} rows", source=file.name)
        yield StructuredBatch(np.frombuffer(data, record), record.names or ())
        done += rows


def _record_of(columns: Sequence[OutColumn], record: Kind) -> Kind:
    """Return the type of the records of an output; that of the input, padding included, if its fields stay."""
    fields = [(column.name or f"{at}", _field_kind(column, record)) for at, column in enumerate(columns)]
    if record.names is not None and fields == [(name, record[name]) for name in record.names]:
        return record
    return np.dtype(fields)


def _field_kind(column: OutColumn, record: Kind) -> Kind:
    if column.passed is not None:
        return record[column.passed]
    return np.dtype(f"U{LONGEST_TEXT}") if column.kind is None else column.kind


class NpyWriter(StructuredWriter):
    """Write an array: plain where the input was and all columns are of one type, else with fields."""

    def __init__(
        self, columns: Sequence[OutColumn], fields: Sequence[str], kind: Kind, *, count: int | None,
        shape: tuple[int, ...], plain: bool,
    ) -> None:  # fmt: skip
        """Take the shape of a plain input's rows."""
        super().__init__(columns, fields, kind, count=count)
        kinds = {kind[place] for place in range(len(columns))}
        self.plain = plain and len(kinds) == 1
        self.row_shape = shape if prod(shape) == len(columns) else (len(columns),)
        self.element = next(iter(kinds)) if self.plain else kind

    def head(self, count: int) -> bytes:
        """Return the header, padded as numpy does."""
        shape = (count, *self.row_shape) if self.plain else (count,)
        descr = np.lib.format.dtype_to_descr(self.element)
        text = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape!r}, }}"
        long = len(text) + ALIGNED > 0xFFFF
        before = len(MAGIC) + 2 + (4 if long else 2)
        text += " " * (-(before + len(text) + 1) % ALIGNED) + "\n"
        version = b"\x02\x00" if long else b"\x01\x00"
        return MAGIC + version + struct.pack("<I" if long else "<H", len(text)) + text.encode("latin-1")


def open_columns(file: InputFile, options: Options) -> NpyFile:
    """Open an array; raises FormatError."""
    del options
    return NpyFile(file)


def create(columns: Sequence[OutColumn], count: int | None, style: Style) -> NpyWriter:
    """Return what writes rows made elsewhere: n x 3 where there are points alone, else records with fields."""
    del style
    names = [column.name for column in columns]
    kind = _record_of(columns, np.dtype([]))
    return NpyWriter(columns, (), kind, count=count, shape=(), plain=names == ["x", "y", "z"])
