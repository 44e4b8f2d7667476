"""Read a stream in blocks of whole lines: a typed line at once, a full pipe in large pieces.

Knows nothing of what lines hold, nor of numpy, so that a tool
which sees only a few lines stays light.
"""

from __future__ import annotations

import sys
from io import BufferedReader, RawIOBase
from itertools import chain
from time import monotonic
from typing import TYPE_CHECKING, Any

from frametool import sizes
from frametool.errors import FormatError

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
) -> Iterator[bytes]:
    """Yield blocks of whole lines, in order; only the very last may lack its line end.

    A block has `sizes.BLOCK` bytes when the stream delivers as fast as they are taken.
    whole: how many bytes of a text are finished records; for records of several lines. A negative number: so many
    bytes are the beginning of a record that goes on behind them, and need not be looked at again.
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
            what = f"the record that begins in line {line} is longer than {longest} bytes"
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
