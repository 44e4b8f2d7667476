"""NPY, numpy's file of one array: n x 3 points, n x 7 poses, or records with named fields.

Read in pieces, never unpickled; with more than two axes the first counts the rows (n x 4 x 4 is n x 16).
"""

from __future__ import annotations

import struct
from functools import partial
from io import BytesIO
from math import prod
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib import format as npy

from frametool.formats.rows import column_file

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Batch, ColumnWriter, Kind, OutColumn
    from frametool.grammar.result import Style

MAGIC = b"\x93NUMPY"
MOST_HEADER = 1 << 20
MOST_COLUMNS, MOST_BYTES = 1 << 16, 1 << 24  # of a row
LONGEST_TEXT = 64  # characters of a new text if its length is unknown: numpy's texts have a fixed size
ALIGNED = 64  # bytes, as numpy pads its headers
UTF8 = b"\x03"  # version of headers with names that are not ASCII


class NpyFile(column_file.RecordFile):
    """An array whose rows are read in batches."""

    def __init__(self, file: InputFile) -> None:
        """Read the header; raises FormatError if it is not that of a table of numbers."""
        head = file.stream.read(len(MAGIC) + 4)
        if not head.startswith(MAGIC):
            raise file.error("no NPY file: it does not begin with \\x93NUMPY")
        version = head[len(MAGIC) : len(MAGIC) + 1]
        is_long = version > b"\x01"
        head += file.stream.read(2 * is_long)
        size = int.from_bytes(head[len(MAGIC) + 2 :], "little")
        if size > MOST_HEADER:
            raise file.error(f"the header says that it has {size} bytes; it is damaged")
        read = npy.read_array_header_2_0 if is_long else npy.read_array_header_1_0
        with column_file.translated(file.name, "the header cannot be read: {}"):
            shape, self.by_columns, kind = read(BytesIO(head[len(MAGIC) + 2 :] + file.stream.read(size)), MOST_HEADER)
            if version == UTF8 and kind.names is not None:
                kind.names = tuple(name.encode("latin-1").decode() for name in kind.names)
        columns = prod(shape[1:])
        are_rows = len(shape) == 1 if kind.names is not None else column_file.is_number(kind)
        if kind.hasobject or min(shape, default=-1) < 0 or not are_rows:
            wanted = "wanted are rows of plain numbers, n x 3, or a row of records"
            raise file.error(f"it holds {kind} in the shape {shape}; {wanted}; objects are never unpickled")
        if columns > MOST_COLUMNS or columns * kind.itemsize > MOST_BYTES:
            most = f"at most {MOST_COLUMNS} are read, of {MOST_BYTES} bytes"
            raise file.error(f"a row of {columns} columns; {most}")
        record = kind if kind.names is not None else column_file.record_of([kind] * columns)
        super().__init__(file, kind.names, record, shape[0])
        self.shape: tuple[int, ...] = shape
        column_file.check_declared(file, self.count, record.itemsize, "rows", last=True)

    def batches(self) -> Iterator[Batch]:
        """Yield the rows; raises FormatError if the file ends too early."""
        if not self.by_columns or len(self.shape) == 1:
            yield from super().batches()
            return
        data = column_file.read_exactly(self.file, self.count * self.record.itemsize, "its columns")
        array = np.frombuffer(data, self.record[0]).reshape(self.shape, order="F")
        for first in range(0, self.count, column_file.MOST_ROWS):
            rows = np.ascontiguousarray(array[first : first + column_file.MOST_ROWS]).reshape(-1, self.width)
            yield column_file.StructuredBatch(rows.view(self.record)[:, 0])

    def rewriter(self, columns: Sequence[OutColumn], count: int | None, _style: Style) -> ColumnWriter:
        """Return a writer for an array of the same kind, row after row."""
        return _writer(columns, self.record, count, self.shape[1:] if self.names is None else None)


def _writer(
    columns: Sequence[OutColumn], of_input: Kind, count: int | None, shape: tuple[int, ...] | None
) -> column_file.CountedWriter:
    """Return a writer for an array: without fields if the input has none and all columns have one type.

    of_input: the type of the input's records; shape: of a row of an input without fields, None for one with fields
    """
    made = [column.kind or np.dtype(f"U{column.longest or LONGEST_TEXT}") for column in columns]
    fields = [
        (column.name or f"{at}", kind if column.passed is None else of_input[column.passed])
        for at, (column, kind) in enumerate(zip(columns, made, strict=True))
    ]
    same = of_input.names is not None and fields == [(name, of_input[name]) for name in of_input.names]
    record = of_input if same else np.dtype(fields)  # with the padding of the input
    kinds = {record[place] for place in range(len(columns))}
    element, row_shape = record, tuple[int, ...]()
    if shape is not None and len(kinds) == 1:
        element, row_shape = kinds.pop(), shape if prod(shape) == len(columns) else (len(columns),)

    def head(rows: int) -> bytes:
        """Return the header, padded as numpy does."""
        descr = npy.dtype_to_descr(element)
        text = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {(rows, *row_shape)!r}, }}".encode()
        version = UTF8 if not text.isascii() else b"\x02" if len(text) + ALIGNED > 0xFFFF else b"\x01"
        length = "<H" if version == b"\x01" else "<I"
        before = len(MAGIC) + 2 + struct.calcsize(length)
        text += b" " * (-(before + len(text) + 1) % ALIGNED) + b"\n"
        return MAGIC + version + b"\0" + struct.pack(length, len(text)) + text

    return column_file.CountedWriter(partial(column_file.encode_records, columns, record), head, count)


def create(columns: Sequence[OutColumn], count: int | None, _style: Style) -> ColumnWriter:
    """Return a writer for new rows: n x 3 for points alone, else records with fields."""
    names = tuple(column.name for column in columns)
    return _writer(columns, np.dtype([]), count, () if names == column_file.XYZ else None)


open_columns = NpyFile
