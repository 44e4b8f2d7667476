"""Read a stream in blocks of whole lines: a typed line at once, a full pipe in large pieces, a file also as ranges.

Ranges are for processes that read them themselves.  Knows nothing of what lines hold, nor of numpy, so that a tool
which sees only a few lines stays light.
"""

from __future__ import annotations

import os
import stat
import sys
from io import BufferedReader, RawIOBase
from itertools import chain
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool import sizes
from frametool.errors import FileProblem, FormatError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from io import BufferedIOBase
    from typing import TypeAlias

    ByteStream: TypeAlias = BufferedIOBase  # `read1` gives what has arrived, and waits only while there is nothing


# A piece this large was not typed: more is on its way, and waiting a moment for it saves much work per block. But
# nothing that has arrived is kept back for longer than the second number.
BULK_BYTES = 1 << 14
_PATIENCE_MS = 5
_LONGEST_WAIT_S = 0.02


def whole_lines(text: bytes) -> int:
    """Return how many bytes of the text are whole lines."""
    return text.rfind(b"\n") + 1


def read_blocks(
    stream: ByteStream,
    *,
    whole: Callable[[bytes], int] = whole_lines,
    lines_before: Callable[[], int] = int,
) -> Iterator[bytes]:
    """Yield blocks of whole lines, in order; only the very last may lack its line end.

    A block has `sizes.BLOCK` bytes when the stream delivers as fast as they are taken.
    whole: how many bytes of a text are finished records; for records of several lines. A negative number: so many
    bytes are the beginning of a record that goes on behind them, and need not be looked at again.
    lines_before: counts the lines before the stream, for errors.
    Raises FormatError if one record is longer than `sizes.RECORD`, however the stream was cut.
    """
    size, longest = sizes.BLOCK, sizes.RECORD
    ready = _readiness(stream)
    begun: list[bytes] = []  # the beginning of a record
    pieces: list[bytes] = []  # what follows it
    held, line = 0, 1
    while piece := _read_piece(stream, min(size, longest - held), ready):
        pieces.append(piece)
        held += len(piece)
        if b"\n" in piece:
            text = b"".join(pieces)
            end = whole(text)
            if end > 0:
                block = b"".join((*begun, text[:end]))
                yield block
                line += block.count(b"\n")
                begun, held = [], len(text) - end
            elif end < 0:
                begun.append(text[:-end])
            pieces = [text[abs(end) :]]
        if held >= longest:
            what = f"the record that begins in line {lines_before() + line} is longer than {longest} bytes"
            raise FormatError(f"{what}: this is no text in lines, or a quote is not closed")
    if rest := b"".join((*begun, *pieces)):
        yield rest


def _read_piece(stream: ByteStream, size: int, ready: Callable[[int], bool]) -> bytes:
    """Read what has arrived, and what arrives right after it if that is much."""
    piece = stream.read1(size)
    if not piece or len(piece) >= size:
        return piece
    pieces = [piece]
    missing = size - len(piece)
    until = monotonic() + _LONGEST_WAIT_S
    while missing > 0 and monotonic() < until and ready(_PATIENCE_MS if len(piece) >= BULK_BYTES else 0):
        piece = stream.read1(missing)
        if not piece:
            break
        pieces.append(piece)
        missing -= len(piece)
    return b"".join(pieces)


def _readiness(stream: ByteStream) -> Callable[[int], bool]:
    """Return a function that tells whether more comes within so many milliseconds; False if it cannot tell."""
    import select

    try:
        poll = select.poll()
        poll.register(stream.fileno(), select.POLLIN)
    except (AttributeError, OSError, ValueError):
        return lambda _patience: False
    return lambda patience: bool(poll.poll(patience))


class Pieces(RawIOBase):
    """Bytes that an iterator yields, as a stream; no piece is empty."""

    def __init__(self, pieces: Iterator[bytes], source: Any = None) -> None:
        """Take the pieces, and what is closed behind the last."""
        self._pieces = pieces
        self._source = source
        self._rest = b""

    def readable(self) -> bool:
        """Return True."""
        return True

    def fileno(self) -> int:
        """Return the number of the file that the pieces are of."""
        return int(self._source.fileno())

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer with what fits of the next piece; 0 at the end."""
        self._rest = self._rest or next(self._pieces, b"")
        size = min(len(self._rest), len(buffer))
        buffer[:size], self._rest = self._rest[:size], self._rest[size:]
        return size

    def close(self) -> None:
        """Close the source too; standard input stays open."""
        if self._source is not None and self._source is not getattr(sys.stdin, "buffer", None):
            self._source.close()
        super().close()


def arrived(stream: BufferedReader, is_enough: Callable[[bytes], bool], most: int) -> BufferedReader:
    """Wait until a pipe has brought enough to tell its form, and return a stream that shows it at the first look.

    is_enough: judges the bytes so far; most: bytes after which nothing is waited for
    """
    if is_enough(stream.peek()):
        return stream
    held = b""
    while len(held) < most and (piece := stream.read1(most - len(held))):
        held += piece
        if b"\n" in piece and is_enough(held):
            break
    pieces = chain((held,) if held else (), iter(lambda: stream.read1(most), b""))
    return BufferedReader(Pieces(pieces, stream), most)


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
        about = os.fstat(stream.fileno())
        return Extent(stream.tell(), about.st_size) if stat.S_ISREG(about.st_mode) else None
    except (AttributeError, OSError, ValueError):
        return None


def blocks_behind(
    stream: ByteStream,
    extent: Extent,
    taken: int,
    *,
    name: str,
    whole: Callable[[], Callable[[bytes], int]],
) -> Iterator[bytes | ByteRange]:
    """Yield the blocks of a file from a place on as `read_blocks` cuts them; as ranges up to the last.

    extent: of the stream at its start; taken: the bytes of it that were read, whole records
    whole: makes what tells how many bytes of a text are finished records
    Raises FileProblem if the file ends before it did at the start: what was there is lost then.
    """
    at, file = extent.begin + taken, stream.fileno()
    for each in _ranges(file, name, at, sizes.BLOCK, whole()):
        yield each
        at = each.start + each.size
    stream.seek(at)
    yield from read_blocks(stream, whole=whole(), lines_before=lambda: _count_lines(file, extent.begin, at))
    if stream.tell() < extent.end:
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
    while begin < end and (piece := os.pread(file, min(sizes.BLOCK, end - begin), begin)):
        count += piece.count(b"\n")
        begin += len(piece)
    return count
