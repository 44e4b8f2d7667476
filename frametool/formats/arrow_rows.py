"""Rows of Arrow as the streams of columns read and write them: batches, and the schema that a result has.

A column that passes is not looked into; a new one stands in the type of the one it replaces, with its metadata.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import ValueInvalid, shown
from frametool.formats.arrow_columns import DTYPES, column_of, nulls_of, require_pyarrow, stamps_of
from frametool.formats.column_file import ColumnNumbers
from frametool.frames.stamps import BILLION
from frametool.text.seconds import FURTHEST, nanoseconds_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.formats.column_file import Kind, Made, OutColumn
    from frametool.text.array_types import Ints

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
