"""Split bytes into pieces of text that end at a document or a line: recordings of any size in bounded memory."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from frametool import sizes
from frametool.documents.source import MOST_CHARACTERS, UTF16, decode
from frametool.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import BinaryIO



class Piece(NamedTuple):
    """Complete documents or lines of a text, and the number of their first line, from 1."""

    text: str
    line: int


def documents(stream: BinaryIO, name: str) -> Iterator[Piece]:
    """Split a stream after lines that end in `---`; a piece has as many documents as arrived in one block.

    Raises FormatError if it is not UTF-8, and for a document that is too long.
    """
    return _pieces(stream, name, _end_of_documents)


def lines(stream: BinaryIO, name: str) -> Iterator[Piece]:
    """Split a stream after line ends; a piece has as many lines as arrived in one block."""
    return _pieces(stream, name, lambda data, start: data.rfind(b"\n", start) + 1)


def _end_of_documents(data: bytearray, start: int) -> int:
    """Return the offset after the last line that ends in `---`, or 0.

    `ros2 topic echo` appends the three dashes to its note about a lost message.
    """
    ends = (data.rfind(end, start) + len(end) for end in (b"---\n", b"---\r\n") if data.rfind(end, start) >= 0)
    return max(ends, default=0)


def _pieces(stream: BinaryIO, name: str, end_of: Callable[[bytearray, int], int]) -> Iterator[Piece]:
    """Read blocks and yield complete pieces; the rest is joined to the next block."""
    line = 1
    waiting, size = bytearray(), sizes.PIECE
    while block := stream.read1(size):  # type: ignore[attr-defined]
        seen = len(waiting)
        waiting += block
        whole = 0 if waiting.startswith(UTF16) else end_of(waiting, max(0, seen - 4))
        if whole:
            piece = _piece(bytes(waiting[:whole]), name, line)
            yield piece
            line += piece.text.count("\n")
            del waiting[:whole]
        if len(waiting) > MOST_CHARACTERS:
            message = f"no end of a document or line within {MOST_CHARACTERS >> 20} MiB"
            raise FormatError(message, source=name, line=line)
    if waiting:
        yield _piece(bytes(waiting), name, line)


def _piece(data: bytes, name: str, line: int) -> Piece:
    """Decode a piece; line ends become those of Unix, which does not change line numbers."""
    with counted_from(line):
        text = decode(data, name)
    return Piece(text.replace("\r\n", "\n") if "\r" in text else text, line)


@contextmanager
def counted_from(line: int) -> Iterator[None]:
    """Make errors of a piece name the line in the whole file; `line` is the number of the piece's first line."""
    try:
        yield
    except FormatError as error:
        error.line += line - 1 if error.line else 0
        raise
