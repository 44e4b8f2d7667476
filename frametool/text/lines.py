"""Read a stream in blocks of whole lines: a typed line at once, a full pipe in large pieces.

Knows nothing of what lines hold, nor of numpy, so that a tool
which sees only a few lines stays light.
"""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

from frametool.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from io import BufferedIOBase
    from typing import TypeAlias

    ByteStream: TypeAlias = BufferedIOBase  # `read1` gives what has arrived, and waits only while there is nothing


BLOCK_BYTES = 1 << 19
LONGEST_RECORD = 1 << 26
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
    size: int = BLOCK_BYTES,
    longest: int = LONGEST_RECORD,
    whole: Callable[[bytes], int] = whole_lines,
) -> Iterator[bytes]:
    """Yield blocks of whole lines, in order; only the very last may lack its line end.

    size: bytes a block has when the stream delivers as fast as they are taken.
    whole: how many bytes of a text are finished records; for records of several lines. A negative number: so many
    bytes are the beginning of a record that goes on behind them, and need not be looked at again.
    Raises FormatError if one record is longer than `longest`, however the stream was cut.
    """
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
