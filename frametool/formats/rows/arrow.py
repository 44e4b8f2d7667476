"""Columns of Arrow tables as arrays of numbers and texts: nulls beside them, each type kept.

Loads pyarrow, the extra `arrow`, where it is asked for; nothing else does.  Knows no file.
"""

from __future__ import annotations

import json
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.documents.json import dump
from frametool.documents.source import Verbatim
from frametool.errors import FileProblem, ValueInvalid, shown
from frametool.formats.rows.column_file import FLOATS, WHOLE, Batch, ColumnNumbers, plain_value, whole_stamps
from frametool.frames.stamps import SUFFIXES
from frametool.text.parse import nanoseconds_of

if TYPE_CHECKING:
    from frametool.formats.rows.column_file import Kind
    from frametool.text.spans import Flags, Ints

# the types of numbers as Arrow prints them -> how numpy calls them
NUMBERS: dict[str, Kind] = {"double": np.dtype("f8"), "float": np.dtype("f4"), "halffloat": np.dtype("f2")}
NUMBERS |= {f"{sign}int{bits}": np.dtype(f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)}
NO_TIME = "no time: null"
STRUCTURED = ("bool", "decimal", "list", "large_list", "fixed_size_list", "struct", "map")  # no texts
IS_JSON = {b"ARROW:extension:name": b"arrow.json", b"ARROW:extension:metadata": b""}  # of a column of JSON texts


def require_pyarrow(what: str, part: str = "") -> Any:
    """Return the library, or a part of it; raises FileProblem that says what needs it and how it is installed."""
    try:
        return import_module(f"pyarrow.{part}" if part else "pyarrow")
    except ImportError:
        raise FileProblem(f"{what} needs pyarrow; install it: pip install 'frametool[arrow]'") from None


def kind_of(arrow_type: Any) -> Kind | None:
    """Return the type of a column's numbers as numpy calls it; None for what is not a number."""
    return NUMBERS.get(str(arrow_type))


def is_floating(arrow_type: Any) -> bool:
    """Tell whether a type of Arrow is one of floating point."""
    kind = kind_of(arrow_type)
    return kind is not None and kind.kind in FLOATS


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


def stamps_of(column: Any, name: str) -> tuple[Ints, Flags | None, Ints]:
    """Read times as nanoseconds: timestamps (UTC where they have no zone), integer nanoseconds, or float seconds.

    Returns them, 0 where they are null, which are null (None: none), and the rows of numbers that are not a time.
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


class ArrowBatch(Batch):
    """Some rows of a file.

    rows: a RecordBatch; ends_group: whether they are the last of a group of rows that is written as one
    """

    def __init__(self, rows: Any, bytes_read: int, *, ends_group: bool) -> None:
        """Take rows, and what they take in the file."""
        self.rows = rows
        self.size = int(rows.num_rows)
        self.bytes_read = bytes_read
        self.ends_group = ends_group

    def numbers(self, place: int) -> ColumnNumbers:
        """Return a column as floats, nan where it is null."""
        column = self.rows.column(place)
        return ColumnNumbers(column.to_numpy(zero_copy_only=False).astype(np.float64), nulls_of(column))

    def stamps(self, place: int, *, in_ns: int) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and why rows have none: timestamps, integers by their name, float seconds."""
        column, name = self.rows.column(place), self.rows.schema.names[place]
        if in_ns and is_floating(column.type):
            raise ValueInvalid(f"column {shown(name)} is {column.type}; {SUFFIXES[in_ns]} are integers or timestamps")
        stamps, nulls, bad = stamps_of(column, name)
        kind = kind_of(column.type)
        if kind is not None and kind.kind in WHOLE:
            numbers, (stamps, beyond) = stamps, whole_stamps(stamps, in_ns)
            if beyond.any():
                remedy = "are these some? then call the column stamp_ns, or let it be a timestamp"
                seconds = numbers[int(np.argmax(beyond))]
                raise ValueInvalid(f"column {shown(name)}: {seconds} s is beyond 64 bits of nanoseconds; {remedy}")
        reasons = {row: f"{column[row].as_py()} is no time in seconds" for row in bad.tolist()}
        return stamps, reasons | dict.fromkeys([] if nulls is None else np.flatnonzero(nulls).tolist(), NO_TIME)

    def texts(self, place: int) -> list[str]:
        """Return a column as texts, "" for null; what is nested as JSON, bytes that are not UTF-8 as \\xff."""
        values = ["" if value is None else value for value in self.values(place)]
        return [value if isinstance(value, str) else dump(value) for value in values]

    def values(self, place: int) -> list[Any]:
        """Return a column as plain values: numbers, texts, None, and what is nested, as a whole or as JSON."""
        column, field = self.rows.column(place), self.rows.schema.field(place)
        kind = str(column.type)
        if "arrow.json" in kind or (field.metadata or {}).get(b"ARROW:extension:name") == b"arrow.json":
            return [_of_json(text) for text in column.to_pylist()]
        pa = require_pyarrow("an Arrow column")
        if kind_of(column.type) is None and not kind.startswith(STRUCTURED):
            with suppress(pa.ArrowInvalid, pa.ArrowNotImplementedError, pa.ArrowTypeError):
                column = column.cast(pa.string())
        return list(map(plain_value, column.to_pylist()))

    def column(self, place: int) -> Any:
        """Return a column as it is: numbers and truth values without a null as an array, else plain values."""
        column = self.rows.column(place)
        if column.null_count or (kind_of(column.type) is None and str(column.type) != "bool"):
            return self.values(place)
        return column.to_numpy(zero_copy_only=False)


def _of_json(text: str | None) -> Any:
    """Read a text of JSON, numbers as they are written; one that is none stays a text."""
    try:
        return text and json.loads(text, parse_float=Verbatim, parse_int=Verbatim)
    except (ValueError, RecursionError):
        return text
