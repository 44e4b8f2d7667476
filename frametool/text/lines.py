"""Read a stream in blocks of whole lines: a typed line at once, a full pipe in large pieces.

Lines are not interpreted, and numpy is not imported, so that commands with only a few lines start fast.
"""

from __future__ import annotations

import sys
from io import BufferedReader, RawIOBase
from itertools import chain
from time import monotonic
from typing import TYPE_CHECKING, Any, AnyStr

from frametool import sizes
from frametool.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from io import BufferedIOBase
    from typing import TypeAlias

    ByteStream: TypeAlias = BufferedIOBase  # `read1` returns what has arrived, and blocks only if nothing has


# a piece this large was not typed: more follows, and a short wait for it saves much work per block; but no data that
# have arrived are held back for longer than the last number
BULK_BYTES = 1 << 14
_PATIENCE_MS = 5
_LONGEST_WAIT_S = 0.02


def whole_lines(text: bytes) -> int:
    """Return the number of bytes of the text in complete lines."""
    return text.rfind(b"\n") + 1


def read_blocks(
    stream: ByteStream, *, whole: Callable[[bytes], int] = whole_lines, longest: int = 0
) -> Iterator[bytes]:
    """Yield blocks of whole lines, in order; only the very last may lack its line end.

    A block has `sizes.BLOCK` bytes if the stream delivers as fast as they are processed.
    whole: returns the number of bytes in complete records, for records of several lines; negative: that many bytes
        begin a record that continues after them, and need not be scanned again.
    longest: the maximum number of bytes of a record, else `sizes.RECORD`, independent of the pieces of the stream
    Raises FormatError if one is longer.
    """
    size, longest = sizes.BLOCK, longest or sizes.RECORD
    ready = readiness(stream)
    begun: list[bytes] = []  # the beginning of a record
    pieces: list[bytes] = []  # the text after it
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
            what = f"the record that begins in line {line} is longer than {longest} bytes"
            raise FormatError(f"{what}: this is not text in lines, or a quote is not closed")
    if rest := b"".join((*begun, *pieces)):
        yield rest


def _read_piece(stream: ByteStream, size: int, ready: Callable[[int], bool]) -> bytes:
    """Read the bytes that have arrived; if these are many, also those that arrive within a short wait."""
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


def readiness(stream: ByteStream, *, unknown: bool = False) -> Callable[[int], bool]:
    """Return a function that returns True if more bytes, or the end, arrive within this many milliseconds.

    unknown: its result for a stream that cannot be polled
    """
    import select

    try:
        poll = select.poll()
        poll.register(stream.fileno(), select.POLLIN)
    except (AttributeError, OSError, ValueError):
        return lambda _patience: unknown
    return lambda patience: bool(poll.poll(patience))


class Pieces(RawIOBase):
    """The bytes from an iterator, as a stream; no piece is empty."""

    def __init__(self, pieces: Iterator[bytes], source: Any = None) -> None:
        """Store the pieces, and the source to close after the last."""
        self._pieces = pieces
        self._source = source
        self._rest = b""

    def readable(self) -> bool:
        """Return True."""
        return True

    def fileno(self) -> int:
        """Return the file descriptor of the source."""
        return int(self._source.fileno())

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer from the next piece; 0 at the end."""
        self._rest = self._rest or next(self._pieces, b"")
        size = min(len(self._rest), len(buffer))
        buffer[:size], self._rest = self._rest[:size], self._rest[size:]
        return size

    def close(self) -> None:
        """Close the source too; standard input remains open."""
        if self._source is not None and self._source is not getattr(sys.stdin, "buffer", None):
            self._source.close()
        super().close()


def arrived(stream: BufferedReader, is_enough: Callable[[bytes], bool], most: int) -> BufferedReader:
    """Wait until a pipe has delivered enough to detect its format, and return a stream that allows peeking at it.

    is_enough: judges the bytes so far; most: the number of bytes after which it stops waiting
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


def with_edits(text: AnyStr, edits: Iterable[tuple[int, int, AnyStr]]) -> AnyStr:
    """Return text or bytes with ranges replaced; edits: (start, end, replacement)."""
    pieces: list[AnyStr] = []
    end = 0
    for start, stop, new in sorted(edits):
        pieces += [text[end:start], new]
        end = stop
    pieces.append(text[end:])
    return text[:0].join(pieces)
