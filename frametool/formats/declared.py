"""What a header says of the file behind it, held against the file: before anything is read, memory taken or written."""

from __future__ import annotations

import os
import stat
from shutil import copyfileobj
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any
from weakref import finalize

from frametool.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

    from frametool.documents.input_file import InputFile

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
