"""Where the bytes of pyarrow's files come from and go: files, pipes, and whoever writes what a batch became."""

from __future__ import annotations

import os
from contextlib import contextmanager
from shutil import copyfileobj
from stat import S_ISREG
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from frametool.errors import FormatError, printable
from frametool.formats.arrow_columns import require_pyarrow

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.input_file import InputFile

PIECE = 1 << 20  # bytes


@contextmanager
def translated(name: str) -> Iterator[None]:
    """Turn whatever pyarrow raises for a broken file into one line; raises FormatError."""
    pa = require_pyarrow(name)
    try:
        yield
    except (pa.ArrowException, OSError, EOFError, ValueError, OverflowError, MemoryError) as error:
        first = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise FormatError(f"it cannot be read: {printable(first[:200].rstrip('. '))}", source=name) from None


def seekable(file: InputFile) -> Any:
    """Return what pyarrow reads at any place; what comes by a pipe is put into a file without a name first."""
    pa = require_pyarrow(file.name)
    if file.path != "-" and S_ISREG(os.stat(file.path).st_mode):
        return pa.OSFile(file.path)
    stream: Any = file.stream
    if not stream.seekable():
        stream = TemporaryFile()  # noqa: SIM115 - it lives as long as what reads it
        copyfileobj(file.stream, stream, PIECE)
    stream.seek(0)
    return pa.PythonFile(stream, mode="r")


class Collected:
    """A file to write to, whose bytes are taken out piece by piece; the memory of a piece is that of the one before."""

    closed = False

    def __init__(self) -> None:
        """Begin with nothing."""
        self._space = bytearray(PIECE)
        self._filled = 0
        self._taken = 0

    def write(self, data: Any) -> int:
        """Keep some bytes."""
        piece = memoryview(data).cast("B")
        end = self._filled + len(piece)
        if end > len(self._space):
            grown = bytearray(max(end, 2 * len(self._space)))
            grown[: self._filled] = memoryview(self._space)[: self._filled]
            self._space = grown
        self._space[self._filled : end] = piece
        self._filled = end
        return len(piece)

    def tell(self) -> int:
        """Return how many bytes were written so far."""
        return self._taken + self._filled

    def flush(self) -> None:
        """Do nothing: what is written is there."""

    def close(self) -> None:
        """Take nothing more."""
        self.closed = True

    def taken(self) -> memoryview:
        """Return what was written since the last time; it holds until the next bytes are written."""
        size, self._filled = self._filled, 0
        self._taken += size
        return memoryview(self._space)[:size]
