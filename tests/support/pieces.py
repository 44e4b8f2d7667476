"""Standard input that arrives in pieces, as a pipe brings it: in this process, or through a pipe of the system."""

from __future__ import annotations

import io
import os
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence


class Pieces(io.RawIOBase):
    """A stream whose every read gives one piece, or what of it there is room for."""

    def __init__(self, pieces: Sequence[bytes]) -> None:
        """Take the pieces; none may be empty."""
        self._left = list(reversed(pieces))

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        if not self._left:
            return 0
        piece = self._left.pop()
        if len(piece) > len(buffer):
            self._left.append(piece[len(buffer) :])
            piece = piece[: len(buffer)]
        buffer[: len(piece)] = piece
        return len(piece)


def bytewise(data: bytes) -> list[bytes]:
    return [data[at : at + 1] for at in range(len(data))]


def linewise(data: bytes) -> list[bytes]:
    return data.splitlines(keepends=True)


def comment_first(data: bytes) -> list[bytes]:
    """Cut behind the first line, which our own trajectories write as a comment."""
    first, end, rest = data.partition(b"\n")
    return [piece for piece in (first + end, rest) if piece]


def halves(data: bytes) -> list[bytes]:
    return [data[: len(data) // 2], data[len(data) // 2 :]]


CUTS: dict[str, Callable[[bytes], list[bytes]]] = {
    "byte by byte": bytewise,
    "line by line": linewise,
    "the first line alone": comment_first,
    "in halves": halves,
}


@contextmanager
def piped(pieces: Sequence[bytes], pause: float) -> Iterator[io.FileIO]:
    """Yield the reading end of a pipe into which a thread writes piece after piece, with a pause behind each."""
    reading, writing = os.pipe()

    def write() -> None:
        with open(writing, "wb", buffering=0) as stream:
            for piece in pieces:
                stream.write(piece)
                time.sleep(pause)

    thread = threading.Thread(target=write)
    thread.start()
    try:
        with io.FileIO(reading) as stream:
            yield stream
    finally:
        thread.join()
