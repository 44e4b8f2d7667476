"""Columns of Arrow tables as arrays of numbers and texts: nulls beside them, each type kept.

Loads pyarrow, the extra `arrow`, where it is asked for; nothing else does.  Knows no file.
"""

from __future__ import annotations

import json
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FileProblem, ValueInvalid, shown
from frametool.formats.rows.column_file import FLOATS, WHOLE, Batch, ColumnNumbers
from frametool.frames.stamps import BILLION
from frametool.text.parse import FURTHEST, nanoseconds_of

if TYPE_CHECKING:
    from frametool.formats.rows.column_file import Kind
    from frametool.text.spans import Flags, Ints

# the types of numbers as Arrow prints them -> how numpy calls them
NUMBERS: dict[str, Kind] = {"double": np.dtype("f8"), "float": np.dtype("f4"), "halffloat": np.dtype("f2")}
NUMBERS |= {f"{sign}int{bits}": np.dtype(f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)}
NO_TIME = "no time: null"


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

    def stamps(self, place: int, *, in_ns: bool) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and why rows have none: timestamps, integers by their name, float seconds."""
        column, name = self.rows.column(place), self.rows.schema.names[place]
        if in_ns and is_floating(column.type):
            raise ValueInvalid(f"column {shown(name)} is {column.type}; nanoseconds are integers or timestamps")
        stamps, nulls, bad = stamps_of(column, name)
        kind = kind_of(column.type)
        if kind is not None and kind.kind in WHOLE and not in_ns:
            beyond = (stamps > FURTHEST) | (stamps < -FURTHEST)
            if beyond.any():
                remedy = "are these some? then call the column stamp_ns, or let it be a timestamp"
                seconds = stamps[int(np.argmax(beyond))]
                raise ValueInvalid(f"column {shown(name)}: {seconds} s is beyond 64 bits of nanoseconds; {remedy}")
            stamps = stamps * BILLION
        reasons = {row: f"{column[row].as_py()} is no time in seconds" for row in bad.tolist()}
        return stamps, reasons | dict.fromkeys([] if nulls is None else np.flatnonzero(nulls).tolist(), NO_TIME)

    def texts(self, place: int) -> list[str]:
        """Return a column as texts, "" for null; what is nested as JSON, bytes that are not UTF-8 as \\xff."""
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


# --- cells of text as columns: of a type only if each is written as a number of it is, 007 and +5 stay text ---

WHOLE_NUMBER = r"^-?(0|[1-9][0-9]{0,18})$"
NUMBER = r"^-?(0|[1-9][0-9]{0,14})(\.[0-9]+)?([eE][-+]?[0-9]+)?$"  # longer whole numbers would lose digits
PATTERNS = {"int64": WHOLE_NUMBER, "double": NUMBER}


def type_of(texts: Any) -> Any:
    """Return the type of a column's cells, null where they are empty; of none at all, string."""
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
