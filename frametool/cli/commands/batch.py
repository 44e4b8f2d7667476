"""Run commands in one process: `frametool.run` from a program, a notebook or a page, and `frametool batch` from lines.

Each runs as it would alone in a pipe. In a batch, NAME = COMMAND keeps the result, as JSON text, instead of printing
it; $NAME is then replaced by it.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from contextlib import chdir, contextmanager
from functools import partial
from io import BufferedReader, BytesIO, TextIOBase, TextIOWrapper
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, TextIO

import click

from frametool import cli
from frametool.cli.command import FILE, Inputs, argument, command_named, option, say_if_typed
from frametool.cli.commands import TROUBLE, call_command, group
from frametool.cli.sink import LOCATIONS, SYSTEM_ERRORS, say_error, system_message, wants_json
from frametool.documents.source import ReadCache, opened
from frametool.errors import FileProblem, FrametoolError, Misused, ValueInvalid, alternatives
from frametool.rows.faults import ROWS_SKIPPED, SKIP, STOP, RowsSkipped
from frametool.text.shell_words import NAME, goes_on, has_words, pipeline, split

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

_ONE_AT_A_TIME = Lock()  # standard streams and the current folder belong to the whole process


class Ran(NamedTuple):
    """The output of a command, its messages, its exit status, and the files that it wrote."""

    out: bytes
    err: str
    status: int
    files: dict[str, bytes]


def run(
    line: str | Sequence[object], stdin: bytes | str = b"", files: Mapping[str, bytes | str] | None = None, *,
    columns: int = 0,
) -> Ran:  # fmt: skip
    """Run a command in this process as a shell would; errors become messages and a status, and never exit.

    line: as typed, with `|` between commands, or the list of its words; `frametool` may come first
    stdin: the standard input of the command, text or bytes
    files: name -> content; the command runs in a new folder with these files; None: in the current folder
    columns: width of the terminal for which the output is formatted; 0 for a pipe
    Standard streams are replaced while it runs, so calls from several threads wait for each other.
    """
    commands = pipeline(line) if isinstance(line, str) else [line]
    errors = Terminal() if columns else BytesIO()
    data, status = stdin.encode() if isinstance(stdin, str) else stdin, 0
    with _ONE_AT_A_TIME, _folder_of(files) as written, _terminal_of(columns):
        for number, command in enumerate(commands, 1):
            out = Terminal() if columns and number == len(commands) else BytesIO()
            with streams(reader(BytesIO(data)), writer(out), writer(errors, errors="backslashreplace")):
                try:
                    words = split(command, _no_value) if isinstance(command, str) else [*map(str, command)]
                    status = cli.run(words[words[:1] == ["frametool"] :])
                except Misused as error:
                    say_error(error)
                    status = error.exit_code
            data = out.getvalue()
    return Ran(data, errors.getvalue().decode(), status, written)


def _no_value(name: str) -> str:
    raise Misused(f"${name} has no value here; a dollar sign is $$, and in single quotes all is as written")


class Terminal(BytesIO):
    """Output that commands format as for a terminal."""

    def isatty(self) -> bool:
        """Return True."""
        return True


def reader(raw: Any) -> TextIO:
    """Return a standard input that reads a stream of bytes."""
    return TextIOWrapper(BufferedReader(raw), "utf-8")


def writer(buffer: Any, errors: str = "strict") -> TextIOWrapper:
    """Return a standard output that writes into a stream of bytes, which is not closed."""
    by_line = buffer.isatty() or errors != "strict"
    return TextIOWrapper(buffer, "utf-8", errors=errors, newline="\n", line_buffering=by_line)


@contextmanager
def streams(stdin: Any, stdout: TextIO, stderr: TextIO | None = None) -> Iterator[None]:
    """Replace the standard streams while commands run; then restore them, the warnings and the recursion limit."""
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
    """Set the width of the terminal in the environment; 0 for a pipe."""
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
def _folder_of(files: Mapping[str, bytes | str] | None) -> Iterator[dict[str, bytes]]:
    """Enter a temporary folder with these files; yield a mapping, filled at the end with new and changed ones."""
    written: dict[str, bytes] = {}
    if files is None:
        yield written
        return
    if outside := [name for name in files if os.path.isabs(name) or ".." in name.replace("\\", "/").split("/")]:
        raise ValueError(f"files: {outside[0]!r} is not the name of a file in the folder of the command")
    with TemporaryDirectory() as folder, chdir(folder):
        before = {name: content.encode() if isinstance(content, str) else content for name, content in files.items()}
        for name, content in before.items():
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            Path(name).write_bytes(content)
        yield written
        for path in filter(Path.is_file, Path().rglob("*")):
            if before.get(name := path.as_posix()) != (content := path.read_bytes()):
                written[name] = content


EXIT_CODES = "Exit codes: 0 done, 3 lines or rows skipped, else that of the line that failed."
_ASSIGNMENT = re.compile(rf"[ \t]*({NAME})[ \t]*=[ \t]*")


def command_lines(stream: BinaryIO) -> Iterator[tuple[int, str, str]]:
    """Yield the commands of a batch, each as soon as its last line arrives; a line ending in a backslash is continued.

    Yields the number of the first line, the name of the result ("" if it is printed), and the text.
    """
    begin, text = 0, ""
    for number, data in enumerate(chain(iter(stream.readline, b""), [b""]), 1):
        begin = begin or number
        text += data.decode("utf-8-sig", "surrogateescape").rstrip("\r\n")
        found = _ASSIGNMENT.match(text)
        name, command = (found[1], text[found.end() :]) if found else ("", text)
        if goes_on(command):
            text = text[:-1]
            continue
        if name or has_words(command):
            yield begin, name, command
        begin, text = 0, ""


READABLE = (None, "json", "yaml")  # chosen formats that are replaced by JSON for kept results; others are refused
KEPT_ARE = "a name keeps one pose, point, number or tree"


def print_as_json(name: str, context: click.Context) -> None:
    """Set the format of a command that is about to run to JSON; raise Misused if its result cannot be kept."""
    formats: Any = next((each.type for each in context.command.params if each.name == "format_name"), None)
    if "json" not in getattr(formats, "choices", ()):
        raise Misused(f"{name}: {context.info_name} has no result that can be kept; {KEPT_ARE}")
    params = context.params
    if params.get("output") or params.get("explain") or params["format_name"] not in READABLE:
        raise Misused(f"{name}: a result is kept, or written by -f, -o or --explain; leave these or {name} = out")
    params["format_name"] = "json"


FINISHED = (0, ROWS_SKIPPED)  # a command that skipped rows by --on-error has not failed
REFUSED = {
    "batch": "a batch runs no batch; put the lines of that one here",
    "frametool": "omit the word `frametool`: a line begins with the command",
}
NO_INPUT = "standard input is not for the lines of a batch; name a file, or keep a result by NAME = and give $NAME"


class LineFailed(FrametoolError):
    """The error of a line whose command has already reported its error and returned a status."""


class CommandBatch:
    """Runs the commands of a batch; holds what they share: kept results, trees, the exit status.

    source: the name of the batch in messages
    skips: True to continue after a line that fails
    """

    def __init__(self, source: str, *, skips: bool) -> None:
        """Create a batch before its first line."""
        self.source = source
        self.skips = skips
        self.kept: dict[str, str | int] = {}  # name -> its result as JSON, or the number of its line if that failed
        self.context = click.Context(group, info_name="frametool", obj=ReadCache())
        self.count = self.failed = self.status = 0
        self.in_json = True  # False once a line without -f json fails

    def run(self, stream: BinaryIO) -> int:
        """Run the commands of a stream as they arrive and return the exit status of the batch."""
        piped = _Pipe(sys.stdout.buffer, "utf-8", newline="\n") if sys.stdout.isatty() else sys.stdout
        with streams(_NoInput(), piped):  # standard input has the lines of the batch
            for number, name, text in command_lines(stream):
                self.count += 1
                LOCATIONS.append({"source": self.source, "line": number})
                try:
                    status = self._run_line(text, name, number)
                finally:
                    LOCATIONS.pop()
                if status in FINISHED:
                    self.status = self.status or status
                elif self.skips:
                    self.failed += 1
                else:
                    return status
        if not self.failed:
            return self.status
        message = f"{self.source}: {self.failed} of {self.count} lines skipped"
        say_error(RowsSkipped(message, source=self.source, bad=self.failed, rows=self.count), in_json=self.in_json)
        return ROWS_SKIPPED

    def _run_line(self, text: str, name: str, number: int) -> int:
        """Run one command and report its error; return its status.

        name: that under which its result is kept, "" to print it
        """
        words: list[str] = []
        status = 0
        problem: FrametoolError
        try:
            if "\0" in text:
                raise Misused("not UTF-8 text, but UTF-16 or no text: it holds a NUL byte")
            words = split(text, self._value_of)
            if not words:
                raise Misused(f"no command behind {name} =")
            status = self._call(words, name)
            if status in FINISHED:
                return status
            problem = LineFailed(f"{words[0]} ended with status {status}", status=status)
        except BrokenPipeError:
            raise
        except FrametoolError as error:
            problem = error
        except SYSTEM_ERRORS as error:
            problem = FileProblem(system_message(error))
        if name:
            self.kept[name] = number
        self.in_json &= (in_json := wants_json(words))
        say_error(problem, in_json=in_json, fate="line skipped" if self.skips else "")
        return status or TROUBLE.get(words[0] if words else "", problem.exit_code)

    def _call(self, words: list[str], name: str) -> int:
        """Call a command and return its status; with a name, keep its result."""
        if words[0] in REFUSED:
            raise Misused(REFUSED[words[0]])
        self.context.meta.clear()
        if not name:
            return call_command(words, None if words[0].startswith("-") else self.context)  # or an option: no parent
        held = BytesIO()
        with streams(sys.stdin, writer(held)):
            status = call_command(words, self.context, partial(print_as_json, name))
        if status in FINISHED:
            text = held.getvalue().decode()
            if (lines := text.count("\n")) != 1:
                raise ValueInvalid(f"{name}: the command has {lines or 'no'} result{'s' * (lines != 1)}; {KEPT_ARE}")
            self.kept[name] = text.strip()
        return status

    def _value_of(self, name: str) -> str:
        """Return the value of a name; raise Misused for one that has no value."""
        found = self.kept.get(name)
        if isinstance(found, int):
            raise Misused(f"${name} has no value: line {found}, which sets it, has failed")
        if found is None:
            kept = [each for each, value in self.kept.items() if isinstance(value, str)]
            known = alternatives(name, kept, "names") if kept else "; no line before has kept a result"
            raise Misused(f"unknown name ${name}{known}; a dollar sign is $$")
        return found


class _Pipe(TextIOWrapper):
    """A standard output that is not a terminal."""

    def isatty(self) -> bool:
        """Return False."""
        return False


class _NoInput(TextIOBase):
    """A standard input that raises Misused when it is read."""

    @property
    def buffer(self) -> BinaryIO:
        """Raise Misused."""
        raise Misused(NO_INPUT)


@command_named("batch", epilog=EXIT_CODES)
@argument("file", FILE, default="-", metavar="[FILE]")
@option("--on-error", "stop at a line that fails, or report and skip it", (STOP, SKIP), name="on_failure", default=STOP)
def batch_command(inputs: Inputs) -> int:
    """Run the commands of FILE, or of standard input, in one process: one per line, as typed after frametool.

    \b
      frametool batch commands.txt
      frametool batch --on-error skip < commands.txt
      seq 0 90 | sed 's/.*/convert --from rpy_deg 0 0 &/' | frametool batch

    \b
      base = lookup robot.yaml map base_link                  # kept, not printed
      compose $base '{xyz: [0, 0, 1]}' --to rpy_deg

    Each line prints what it prints alone into a pipe, without separators; a pipe is answered line by line. Files of
    frames that several lines name are read once, and again when they have changed.

    NAME = COMMAND keeps a pose, point, number or tree instead of printing it; $NAME or ${NAME} in an argument is then
    that result, with all its digits. Words are quoted as in a shell: 'single quotes' keep everything as written, $NAME
    is replaced in "double quotes" and in bare words, \\ keeps the next character, $$ is a dollar sign, # begins a
    comment, and a backslash at its end joins a line with the next. Pipes, > and < are not available.

    A line that fails is reported with its number: commands.txt:12: .. The exit code is that of the failed line, or 3 if
    lines were skipped. Lines cannot read standard input: name files. A line cannot be another batch.
    """
    say_if_typed(inputs.file)
    with opened(inputs.file) as stream:
        return CommandBatch("stdin" if inputs.file == "-" else inputs.file, skips=inputs.on_failure == SKIP).run(stream)
