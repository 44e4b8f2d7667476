"""`frametool.run`: the command line inside a program, a notebook or a page."""

from __future__ import annotations

import os
import sys
import warnings
from contextlib import chdir, contextmanager
from io import BufferedReader, BytesIO, TextIOWrapper
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO

from frametool import cli
from frametool.cli.sink import say_error
from frametool.errors import Misused
from frametool.text.shell_words import pipeline, split

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

_ONE_AT_A_TIME = Lock()  # standard streams and the current folder are those of the whole process


class Ran(NamedTuple):
    """The output of a command, its messages, its exit status, and what it wrote into the folder of its files."""

    out: bytes
    err: str
    status: int
    files: dict[str, bytes]


def run(
    line: str | Sequence[object], stdin: bytes = b"", files: Mapping[str, bytes] | None = None, *, columns: int = 0
) -> Ran:
    """Run a command in this process as a shell would: what is wrong with it is a message and a status, never an exit.

    line: as it is typed, `|` between commands, or the list of its words; `frametool` may come first
    stdin: what the command finds on standard input
    files: name -> content; the command runs in a folder that holds these, without them in the current one
    columns: width of the terminal that the output is laid out for; 0 for a pipe
    Standard streams are replaced while it runs, so calls from several threads wait for each other.
    """
    commands = pipeline(line) if isinstance(line, str) else [line]
    errors = Terminal() if columns else BytesIO()
    data, status = stdin, 0
    with _ONE_AT_A_TIME, _folder_of(files) as written, _terminal_of(columns):
        for number, command in enumerate(commands, 1):
            out = Terminal() if columns and number == len(commands) else BytesIO()
            with streams(reader(BytesIO(data)), writer(out), writer(errors, errors="backslashreplace")):
                try:
                    words = split(command, _no_value) if isinstance(command, str) else [*map(str, command)]
                    status = cli.run(words[words[:1] == ["frametool"] :])
                except Misused as error:
                    say_error(error, in_json=False)
                    status = error.exit_code
            data = out.getvalue()
    return Ran(data, errors.getvalue().decode(), status, written)


def _no_value(name: str) -> str:
    raise Misused(f"${name} has no value here; a dollar sign is $$, and in single quotes all is as written")


class Terminal(BytesIO):
    """Output that commands lay out for people."""

    def isatty(self) -> bool:
        """Return True."""
        return True


def reader(raw: Any) -> TextIO:
    """Return a standard input that reads a stream of bytes."""
    return TextIOWrapper(BufferedReader(raw), "utf-8")


def writer(buffer: Any, errors: str = "strict") -> TextIOWrapper:
    """Return a standard output that writes into a stream of bytes, which stays open."""
    by_line = buffer.isatty() or errors != "strict"
    return TextIOWrapper(buffer, "utf-8", errors=errors, newline="\n", line_buffering=by_line)


@contextmanager
def streams(stdin: Any, stdout: TextIO, stderr: TextIO | None = None) -> Iterator[None]:
    """Replace the standard streams while commands run; what they change of the process is changed back."""
    before, limit = (sys.stdin, sys.stdout, sys.stderr), sys.getrecursionlimit()
    sys.stdin, sys.stdout, sys.stderr = stdin, stdout, stderr or sys.stderr
    try:
        with warnings.catch_warnings():
            yield
    finally:
        for new, old in ((stdout, before[1]), (stderr, before[2])):
            if isinstance(new, TextIOWrapper) and new is not old:
                new.detach()  # which flushes
        if stdin is not before[0]:
            stdin.close()
        sys.stdin, sys.stdout, sys.stderr = before
        sys.setrecursionlimit(limit)


@contextmanager
def _terminal_of(columns: int) -> Iterator[None]:
    """Let the environment say how wide the terminal is; 0 for a pipe."""
    before = os.environ.get("COLUMNS")
    if columns:
        os.environ["COLUMNS"] = str(columns)
    try:
        yield
    finally:
        os.environ.pop("COLUMNS", None)
        if before is not None:
            os.environ["COLUMNS"] = before


@contextmanager
def _folder_of(files: Mapping[str, bytes] | None) -> Iterator[dict[str, bytes]]:
    """Enter a folder with these files; yield what holds, at the end, those that were written there."""
    written: dict[str, bytes] = {}
    if files is None:
        yield written
        return
    if outside := [name for name in files if os.path.isabs(name) or ".." in name.replace("\\", "/").split("/")]:
        raise ValueError(f"files: {outside[0]!r} is not the name of a file in the folder of the command")
    with TemporaryDirectory() as folder, chdir(folder):
        for name, content in files.items():
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            Path(name).write_bytes(content)
        yield written
        for path in filter(Path.is_file, Path().rglob("*")):
            if files.get(name := path.as_posix()) != (content := path.read_bytes()):
                written[name] = content
