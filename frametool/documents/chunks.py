"""Bytes to pieces of text that end where a document or a line ends: recordings of any size in bounded memory."""

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
    """Whole documents or lines of a text, and the number of their first line, from 1."""

    text: str
    line: int


def documents(stream: BinaryIO, name: str) -> Iterator[Piece]:
    """Cut a stream behind lines that end in `---`; a piece holds as many documents as came in one block.

    Raises FormatError for what is no UTF-8, and for a document that is too long.
    """
    return _pieces(stream, name, _end_of_documents)


def lines(stream: BinaryIO, name: str) -> Iterator[Piece]:
    """Cut a stream behind line ends; a piece holds as many lines as came in one block."""
    return _pieces(stream, name, lambda data, start: data.rfind(b"\n", start) + 1)


def _end_of_documents(data: bytearray, start: int) -> int:
    """Return the offset behind the last line that ends in `---`, or 0.

    `ros2 topic echo` puts the three dashes behind the last word of its note about a lost message.
    """
    ends = (data.rfind(end, start) + len(end) for end in (b"---\n", b"---\r\n") if data.rfind(end, start) >= 0)
    return max(ends, default=0)


def _pieces(stream: BinaryIO, name: str, end_of: Callable[[bytearray, int], int]) -> Iterator[Piece]:
    """Read blocks and pass on what is whole; the rest waits for the next block."""
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
    """Decode a piece; line ends become those of Unix, which changes no line's number."""
    with counted_from(line):
        text = decode(data, name)
    return Piece(text.replace("\r\n", "\n") if "\r" in text else text, line)


@contextmanager
def counted_from(line: int) -> Iterator[None]:
    """Let errors of a piece name the line in the whole file; `line` is the number of the piece's first."""
    try:
        yield
    except FormatError as error:
        error.line += line - 1 if error.line else 0
        raise
