"""Columns of Arrow tables as arrays of numbers and back: nulls beside them, each type kept.

Loads pyarrow, the extra `arrow`, where it is asked for; nothing else does.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FileProblem, ValueInvalid, alternatives, shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.text.array_types import Flags, Floats, Ints

# nanoseconds of the units that timestamps have
UNITS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
DTYPES = {"double": np.float64, "float": np.float32, "halffloat": np.float16}  # as Arrow prints its types


def require_pyarrow(what: str, part: str = "") -> Any:
    """Return the library, or a part of it; raises FileProblem that says what needs it and how it is installed."""
    try:
        return import_module(f"pyarrow.{part}" if part else "pyarrow")
    except ImportError:
        raise FileProblem(f"{what} needs pyarrow; install it: pip install 'frametool[arrow]'") from None


class ArrowFloats(NamedTuple):
    """The numbers of one column, (n,) of its own type, nan where it is null; `nulls` is None where none is."""

    values: Any
    nulls: Flags | None


def place_of(name: str, names: Sequence[str]) -> int:
    """Return the place of a column; raises ValueInvalid for one that is not there, or twice."""
    if names.count(name) != 1:
        if name in names:
            raise ValueInvalid(f"column {shown(name)} stands twice")
        raise ValueInvalid(f"no column {shown(name)}{alternatives(name, names, 'columns')}")
    return names.index(name)


def is_floating(kind: Any) -> bool:
    """Tell whether a type of Arrow is one of floating point."""
    return str(kind) in DTYPES


def floats_of(column: Any, name: str) -> ArrowFloats:
    """Read a column, chunked or not; raises ValueInvalid unless its type is one of floating point."""
    if not is_floating(column.type):
        raise ValueInvalid(f"column {shown(name)} is {column.type}, not floating point; cast it to float64 first")
    whole = in_one(column)
    return ArrowFloats(whole.to_numpy(zero_copy_only=False), nulls_of(whole))


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


def rounded(values: Floats, kind: Any) -> Any:
    """Return float64 numbers in a type of floating point, rounded once; what is too large becomes infinite."""
    with np.errstate(over="ignore"):
        return np.asarray(values, DTYPES[str(kind)])


def column_of(values: Any, nulls: Flags | None, kind: Any) -> Any:
    """Return numbers of a type's own precision as a column of it."""
    return require_pyarrow("an Arrow column").array(values, type=kind, mask=nulls)


def stamps_of(column: Any, name: str) -> tuple[Ints, Flags | None]:
    """Read a column of timestamps or integer nanoseconds, 0 where it is null; raises ValueInvalid for another type.

    Timestamps without a time zone count as UTC.
    """
    pa = require_pyarrow("an Arrow column")
    whole = in_one(column)
    unit = UNITS.get(getattr(whole.type, "unit", ""), 0) if str(whole.type).startswith("timestamp") else 0
    if not unit and not pa.types.is_integer(whole.type):
        wanted = "a timestamp, integer nanoseconds, or float seconds"
        raise ValueInvalid(f"column {shown(name)} is {whole.type}; stamps are {wanted}")
    try:
        counts = whole.view(pa.int64()) if unit else whole.cast(pa.int64())
    except pa.ArrowInvalid:
        raise ValueInvalid(f"column {shown(name)}: a stamp is beyond 64 bits of nanoseconds") from None
    nulls = nulls_of(counts)
    stamps: Ints = counts.fill_null(0).to_numpy(zero_copy_only=False)
    if unit > 1:
        most = np.iinfo(np.int64).max // unit
        if np.any((stamps > most) | (stamps < -most)):
            raise ValueInvalid(f"column {shown(name)}: a stamp is beyond 64 bits of nanoseconds")
        stamps = stamps * unit
    return stamps, nulls
