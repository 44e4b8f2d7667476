"""A file that was opened and looked at, or a text given as it stands: its name for messages, its form, its bytes."""

from __future__ import annotations

from functools import cached_property
from io import BytesIO

from frametool.documents.source import HEAD, Source, opened, read_text

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from os import PathLike
    from typing import BinaryIO


class InputFile:
    """A file, standard input for `-`, or a folder; what it holds is read once, as a stream or as one text."""

    def __init__(self, path: str | PathLike[str], stream: BinaryIO | None = None, *, folder: bool = False) -> None:
        """Open a file.

        stream: what was opened already, with nothing of it read; folder: there is nothing to open.
        Raises FileProblem.
        """
        self.path = str(path)
        self.name = "stdin" if self.path == "-" else self.path
        self.form = ""
        self.beside: Sequence[InputFile] = ()  # all files that are read together
        self.scopes: list[str] = []  # what stands before its names, once for each, where another file says so
        self.stream: BinaryIO = BytesIO() if folder else stream or opened(path)

    def head(self) -> bytes:
        """Return the first bytes, and leave them to be read."""
        head: bytes = self.stream.peek(HEAD)[:HEAD]  # type: ignore[attr-defined]
        return head

    @cached_property
    def text(self) -> str:
        """Return the whole text."""
        return read_text(self.path, self.stream)

    @property
    def source(self) -> Source:
        """Return the whole text under its name."""
        return Source(self.name, self.text)

    def close(self) -> None:
        """Let go of a file; standard input stays open."""
        if self.path != "-":
            self.stream.close()
