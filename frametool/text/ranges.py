"""Blocks of a file as the ranges of bytes where they stand, for processes that read them themselves.

Knows nothing of what lines hold, nor of who reads them.
"""

from __future__ import annotations

import os
import stat
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FileProblem
from frametool.text.lines import BLOCK_BYTES, read_blocks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Protocol

    from frametool.text.lines import ByteStream

    class FileStream(ByteStream, Protocol):
        """A stream that may be a file."""

        def fileno(self) -> int:
            """Return its descriptor."""

        def tell(self) -> int:
            """Return the place behind what was taken."""

        def seek(self, place: int, /) -> int:
            """Go on at a place."""


class ByteRange(NamedTuple):
    """Some bytes of a file.

    file: its descriptor, which processes share; name: as messages name it
    """

    file: int
    name: str
    start: int
    size: int

    def read(self) -> bytes:
        """Return the bytes; raises FileProblem if they are not there any more."""
        pieces = []
        at, end = self.start, self.start + self.size
        while at < end and (piece := os.pread(self.file, end - at, at)):
            pieces.append(piece)
            at += len(piece)
        if at < end:
            raise _shrunk(self.name)
        return b"".join(pieces)


def content(block: bytes | ByteRange) -> bytes:
    """Return the bytes of a block."""
    return block.read() if isinstance(block, ByteRange) else block


class Extent(NamedTuple):
    """Where a stream begins in a file, and where the file ends."""

    begin: int
    end: int


def extent_in_file(stream: ByteStream) -> Extent | None:
    """Return what is left of a plain file, None if a stream is something else."""
    try:
        file: FileStream = stream  # type: ignore[assignment]
        about = os.fstat(file.fileno())
        return Extent(file.tell(), about.st_size) if stat.S_ISREG(about.st_mode) else None
    except (AttributeError, OSError, ValueError):
        return None


def blocks_behind(
    stream: ByteStream,
    extent: Extent,
    taken: int,
    *,
    name: str,
    size: int = BLOCK_BYTES,
    whole: Callable[[], Callable[[bytes], int]],
) -> Iterator[bytes | ByteRange]:
    """Yield the blocks of a file from a place on as `read_blocks` cuts them; as ranges up to the last.

    extent: of the stream at its start; taken: the bytes of it that were read, whole records
    whole: makes what tells how many bytes of a text are finished records
    Raises FileProblem if the file ends before it did at the start: what was there is lost then.
    """
    file: FileStream = stream  # type: ignore[assignment]
    at = extent.begin + taken
    for each in _ranges(file.fileno(), name, at, size, whole()):
        yield each
        at = each.start + each.size
    file.seek(at)
    yield from read_blocks(
        stream, size=size, whole=whole(), lines_before=lambda: _count_lines(file.fileno(), extent.begin, at)
    )
    if file.tell() < extent.end:
        raise _shrunk(name)


def _shrunk(name: str) -> FileProblem:
    return FileProblem(f"{name}: became shorter while it was read")


def _ranges(file: int, name: str, at: int, size: int, whole: Callable[[bytes], int]) -> Iterator[ByteRange]:
    """Yield ranges up to a record that does not fit into a block, or to where the file ends."""
    while len(text := os.pread(file, size, at)) == size and b"\n" in text and (end := whole(text)) > 0:
        yield ByteRange(file, name, at, end)
        at += end


def _count_lines(file: int, begin: int, end: int) -> int:
    """Count the line ends between two places."""
    count = 0
    while begin < end and (piece := os.pread(file, min(BLOCK_BYTES, end - begin), begin)):
        count += piece.count(b"\n")
        begin += len(piece)
    return count
