"""Messages about the work: the one way to stderr, which nobody has to read; errors as sentences or as JSON."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager, suppress
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, TextIO

from frametool.errors import FrametoolError, printable

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


class BatchLine(NamedTuple):
    """A line of a batch, and the file it is in."""

    source: str
    line: int

    def __str__(self) -> str:
        """Return what begins each message of its command."""
        return f"{self.source}:{self.line}: "


_lines: list[BatchLine] = []


@contextmanager
def telling_of(line: BatchLine) -> Iterator[None]:
    """Name a line of a batch in all messages while its command runs."""
    _lines.append(line)
    try:
        yield
    finally:
        _lines.pop()


def tell(text: str) -> None:
    """Write lines; that stderr is closed or on a full disk does not change what the data is worth."""
    if sys.stderr is None:
        return
    try:
        print(text, file=sys.stderr, flush=True)  # noqa: T201 - this is where messages become text
    except OSError:
        discard(sys.stderr)


def say(text: str) -> None:
    """Write one line about the work, under the program's name; several where a terminal ends."""
    text = printable(f"frametool: {_lines[-1] if _lines else ''}{text}")
    tell(folded(text) if sys.stderr is not None and sys.stderr.isatty() else text)


def folded(line: str) -> str:
    """Break a line between words where the terminal ends; the rest is indented."""
    from shutil import get_terminal_size

    width = get_terminal_size().columns
    if len(line) <= width:
        return line
    from textwrap import fill

    return fill(line, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def say_warning(message: str, rule: str = "") -> None:
    """Write a warning.

    With --quiet there is no word on names that lost their leading slash: their tree is as it was meant.  What stamps
    are taken for by their size is said once.
    """
    if rule in ("slash", "by-size"):
        import click

        context = click.get_current_context()
        said = context.meta if not context.params.get("quiet") else {"by-size": True, "slash": True}
        if said.get(rule):
            return
        said[rule] = rule == "by-size"
    say(f"warning: {message}")


def say_error(error: FrametoolError, *, in_json: bool, fate: str = "") -> None:
    """Write an error: as a sentence with the source line, or as one object with the fields it is made of.

    fate: what became of the line of a batch in which it is
    """
    if in_json:
        tell(as_json(error, _lines[-1] if _lines else None, fate))
        return
    say(f"{error}{getattr(error, 'remedy', '')}{f' ({fate})' if fate else ''}")
    if snippet := getattr(error, "snippet", ""):
        tell(snippet)


def discard(stream: TextIO) -> None:
    """Let what is still buffered vanish, so that it does not raise again when the process ends."""
    with suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


TROUBLES = (MemoryError, ImportError, OSError)


def words_of(trouble: Exception) -> str:
    """Return what Python or the system could not do."""
    if isinstance(trouble, MemoryError):
        return "out of memory"
    if isinstance(trouble, ImportError):  # numpy's tells of missing memory and files in many lines, the cause last
        return f"a library cannot be loaded: {str(trouble).strip().splitlines()[-1]}"
    return (getattr(trouble, "strerror", None) or str(trouble)).lower()


def wants_json(arguments: Sequence[str]) -> bool:
    """Return True if the arguments of a command ask for JSON."""
    if "--format=json" in arguments or "-fjson" in arguments:
        return True
    return any(option in ("-f", "--format") and value == "json" for option, value in pairwise(arguments))


def as_json(error: FrametoolError, line: BatchLine | None = None, fate: str = "") -> str:
    """Return the error's kind, its message and its fields.

    line: of the batch in which it is; the object's place is then that one, and its own place is under `input`
    fate: what became of that line
    """
    from frametool.documents.json import dump

    message, details = str(error), dict(error.details())
    if line is not None:
        own = {key: details.pop(key) for key in ("source", "line", "column") if key in details}
        message = f"{line}{message}"
        details = {**line._asdict(), **({"input": own} if own else {}), **details}
    return dump({"error": error.kind, "message": f"{message} ({fate})" if fate else message, **details})
