"""Rows that lie in a file as numpy keeps them: the fields of one record after the other.

What a header says of the file behind it, held against the file: before anything is read, memory taken or written.
"""

from __future__ import annotations

import os
import stat
from functools import cached_property
from shutil import copyfileobj
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any
from weakref import finalize

import numpy as np

from frametool.errors import FormatError, ValueInvalid, shown
from frametool.formats.rows.column_file import FLOATS, WHOLE, ColumnNumbers, Made
from frametool.frames.stamps import BILLION
from frametool.text.parse import FURTHEST, nanoseconds_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import BinaryIO

    from numpy.typing import NDArray

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Kind, OutColumn
    from frametool.text.spans import Flags, Floats, Ints

PIECE = 1 << 20  # bytes


class StructuredBatch:
    """Some rows of an array with fields."""

    def __init__(self, rows: NDArray[Any], fields: Sequence[str]) -> None:
        """Take rows (n,) and the names of the fields in the order of the columns."""
        self.rows = rows
        self.fields = fields

    @property
    def size(self) -> int:
        """Count the rows."""
        return len(self.rows)

    @property
    def bytes_read(self) -> int:
        """Count the bytes of the file that they take."""
        return self.rows.nbytes

    def column(self, place: int) -> NDArray[Any]:
        """Return a field as it is."""
        return self.rows[self.fields[place]]

    def numbers(self, place: int) -> ColumnNumbers:
        """Return a field as floats."""
        return ColumnNumbers(self.column(place).astype(np.float64))

    def stamps(self, place: int, *, in_ns: bool) -> tuple[Ints, dict[int, str]]:
        """Return a field as nanoseconds, and why rows have none."""
        return stamps_of_numbers(self.column(place), in_ns=in_ns)

    def texts(self, place: int) -> list[str]:
        """Return a field as texts."""
        given = self.column(place)
        return [text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text) for text in given.tolist()]


def not_finite(values: Floats) -> Flags | None:
    """Return which numbers are not finite; None if all are."""
    with np.errstate(invalid="ignore", over="ignore"):
        if np.isfinite(values.sum()):
            return None
    flags: Flags = ~np.isfinite(values)
    return flags if flags.any() else None


def stamps_of_numbers(given: NDArray[Any], *, in_ns: bool) -> tuple[Ints, dict[int, str]]:
    """Return numbers as nanoseconds, and why rows have none: integers of seconds or nanoseconds, floats of seconds.

    A float of seconds counts as the decimal that it prints as, as it does in a table of text.
    """
    if given.dtype.kind in WHOLE:
        stamps = given.astype(np.int64)
        return (stamps, {}) if in_ns else (stamps * BILLION, _beyond(abs(given) > FURTHEST))
    if in_ns:
        raise ValueInvalid(f"nanoseconds are integers, found {given.dtype}")
    stamps, none = nanoseconds_of(given.astype(np.float64))
    return stamps, _beyond(none)


def _beyond(rows: Flags) -> dict[int, str]:
    return dict.fromkeys(np.flatnonzero(rows).tolist(), "not a time in seconds")


class StructuredWriter:
    """Write rows as records: a head that says how many there are, the records, a tail.

    What is made goes in its field, what passes is copied; where no field is new the rows are changed in their place.
    """

    def __init__(self, columns: Sequence[OutColumn], fields: Sequence[str], kind: Kind, *, count: int | None) -> None:
        """Take the columns, the fields of the input that may pass, and the type of the records that are written.

        count: how many rows there will be; None if that is known at the end only: they wait in a file until then.
        """
        self.columns = columns
        self.fields = fields
        self.kind = kind
        self.count = count
        self.written = 0
        self.waiting = None if count is not None else TemporaryFile()  # noqa: SIM115 - closed with the writer
        if self.waiting is not None:
            finalize(self, self.waiting.close)

    def head(self, count: int) -> bytes:
        """Return what stands before so many records."""
        raise NotImplementedError

    def tail(self) -> bytes:
        """Return what stands behind the records."""
        return b""

    def of_rows(self, batch: Any, rows: Ints | None, made: Sequence[Made]) -> bytes | memoryview:
        """Return the records of a batch."""
        records = self.records(batch, rows, made)
        head = self.head(self.count) if self.count is not None and not self.written else b""
        self.written += len(records)
        data = self.encoded(records)
        if self.waiting is not None:
            self.waiting.write(data)
            return b""
        return head + bytes(data) if head else data

    def end(self) -> bytes | Iterator[bytes]:
        """Return what comes behind the last batch; all, if the rows had to be counted first."""
        if self.waiting is None:
            return (b"" if self.written else self.head(0)) + self.tail()
        return self._all()

    def _all(self) -> Iterator[bytes]:
        assert self.waiting is not None  # noqa: S101 - for the types; `end` looked
        yield self.head(self.written)
        self.waiting.seek(0)
        while piece := self.waiting.read(PIECE):
            yield piece
        yield self.tail()

    def encoded(self, records: NDArray[Any]) -> bytes | memoryview:
        """Return records as they are written."""
        return memoryview(records.view(np.uint8)) if records.size else b""  # type: ignore[arg-type]

    def records(self, batch: StructuredBatch | None, rows: Ints | None, made: Sequence[Made]) -> NDArray[Any]:
        """Return the records of a batch with what is made in its fields."""
        given = None if batch is None else batch.rows if rows is None else batch.rows[rows]
        size = len(made[0].values) if given is None else len(given)
        records = given if given is not None and given.dtype == self.kind else np.zeros(size, self.kind)
        new = iter(made)
        for name, column in zip(self.out_fields, self.columns, strict=True):
            if column.passed is None:
                values = next(new).values
                if column.kind is None:
                    _check_lengths(values, records.dtype[name], column.name)
                records[name] = values
            elif records is not given and given is not None:
                records[name] = given[self.fields[column.passed]]
        return records

    @cached_property
    def out_fields(self) -> tuple[str, ...]:
        """Name the fields that are written, in the order of the columns."""
        return tuple(name for name in self.kind.names or ())


def _check_lengths(texts: Sequence[str], kind: Kind, name: str) -> None:
    """Refuse texts that numpy would cut; raises ValueInvalid."""
    most = kind.itemsize // np.dtype("U1").itemsize
    longest = max(texts, key=len, default="")
    if len(longest) > most:
        raise ValueInvalid(f"column {name} holds {most} characters, {shown(longest)} has {len(longest)}")


def is_number(kind: Kind | None) -> bool:
    """Tell whether a column of this kind holds numbers."""
    return kind is not None and kind.kind in FLOATS + WHOLE


PIECE = 1 << 20
BATCH_BYTES = 1 << 21
MOST_ROWS = 1 << 15  # a batch; in cache with what is made of it


def rows_of_batch(size: int) -> int:
    """Return how many records of so many bytes are read at once."""
    return max(1, min(MOST_ROWS, BATCH_BYTES // max(size, 1)))


def bytes_left(stream: BinaryIO) -> int | None:
    """Return how many bytes a file still holds; None for a pipe."""
    try:
        about = os.fstat(stream.fileno())
        return about.st_size - stream.tell() if stat.S_ISREG(about.st_mode) else None
    except (OSError, ValueError):
        return None


def check_declared(file: InputFile, count: int, size: int, what: str, *, last: bool) -> None:
    """Raise FormatError where a file does not hold as many records as its header says.

    count, size: the records and the bytes of each; what: they are called so
    last: nothing else follows them, so that what does would be records that the header leaves out
    """
    if count and not size:
        raise FormatError(f"the header says {count} {what} of 0 bytes each", source=file.name)
    left = bytes_left(file.stream)
    if left is None:
        return
    if left < count * size:
        there = max(left, 0) // size
        raise FormatError(
            f"the header says {count} {what} of {size} bytes, the file holds {there}; is it whole?", source=file.name
        )
    if last and size and left >= (count + 1) * size:
        raise FormatError(
            f"the header says {count} {what} of {size} bytes, the file holds {left // size}; correct the header",
            source=file.name,
        )


def pieces(stream: BinaryIO) -> Iterator[bytes]:
    """Yield the rest of a stream."""
    while piece := stream.read(PIECE):
        yield piece


def kept_in_file(stream: BinaryIO, owner: object) -> BinaryIO:
    """Return a file with the rest of a stream, for what has to be read here and there; it goes with its owner."""
    kept: Any = TemporaryFile()  # noqa: SIM115 - closed with its owner
    finalize(owner, kept.close)
    copyfileobj(stream, kept, PIECE)
    kept.seek(0)
    return kept  # type: ignore[no-any-return]


def read_exactly(file: InputFile, size: int, what: str) -> bytes:
    """Read so many bytes, memory growing with what comes; raises FormatError where there are fewer."""
    found: list[bytes] = []
    missing = size
    while missing and (piece := file.stream.read(min(missing, PIECE))):
        found.append(piece)
        missing -= len(piece)
    if missing:
        raise FormatError(f"the file ends within {what}, {missing} bytes are missing", source=file.name)
    return b"".join(found)
