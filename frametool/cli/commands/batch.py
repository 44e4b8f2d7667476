"""`frametool batch`: commands one after the other in one process, each as it would run alone in a pipe.

NAME = COMMAND keeps the result, as JSON text, instead of printing it; $NAME is then replaced by it.
"""

from __future__ import annotations

import json
import os
import re
import sys
from functools import partial
from io import BytesIO, TextIOBase, TextIOWrapper
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import click

from frametool.cli.command import FILE, Inputs, argument, command_named, option
from frametool.cli.commands import TROUBLE, answered, called, called_in, group
from frametool.cli.embedded import streams, writer
from frametool.cli.stderr import TROUBLES, BatchLine, say, say_error, telling_of, wants_json, words_of
from frametool.documents.source import MOST_CHARACTERS, UTF16, ReadCache, decode, opened
from frametool.errors import FileProblem, FormatError, FrametoolError, Misused, ValueInvalid, alternatives
from frametool.grammar.rotation_spelling import ROTATION_KEYS
from frametool.ros.messages import LISTS
from frametool.stream.faults import ROWS_SKIPPED, SKIP, STOP, RowsSkipped
from frametool.stream.record import POINT_KEYS
from frametool.stream.row_layout import PARTS
from frametool.text.shell_words import NAME, goes_on, has_words, split

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

EXIT_CODES = "Exit codes: 0 done, 3 lines or rows skipped, else that of the line that failed."



MOST_JOINED = 1000  # lines of one command
_ASSIGNMENT = re.compile(rf"[ \t]*({NAME})[ \t]*=[ \t]*")


class CommandLine(NamedTuple):
    """A command of a batch.

    number: of its first line
    name: what its result is kept as; "" if it is printed
    text: the command itself
    problem: why it cannot be taken
    """

    number: int
    name: str
    text: str
    problem: str


def command_lines(stream: BinaryIO, source: str) -> Iterator[CommandLine]:
    """Yield the commands of a batch, each as soon as its last line is there.

    Raises FormatError for what is no text of lines at all.
    """
    lines = _lines(stream, source)
    for number, begin, wrong in lines:
        text, problem, joined = begin, wrong, 1
        while goes_on(_parted(text)[1]) and not problem:  # a backslash joins the next line to this one
            _, more, problem = next(lines, (0, "", ""))
            text = text[:-1] + more
            joined += 1
            if joined > MOST_JOINED:
                raise FormatError(f"a command of more than {MOST_JOINED} lines", source=source, line=number)
        name, text = _parted(text)
        if name and not has_words(text):
            problem = problem or f"no command behind {name} ="
        if problem or has_words(text):
            yield CommandLine(number, name, text, problem)


def _parted(text: str) -> tuple[str, str]:
    """Return the name before `=`, if there is one, and the command behind it."""
    found = _ASSIGNMENT.match(text)
    return ("", text) if found is None else (found[1], text[found.end() :])


def _lines(stream: BinaryIO, source: str) -> Iterator[tuple[int, str, str]]:
    """Yield the number of each line, its text without its end, and what is wrong with its bytes."""
    for number, data in enumerate(iter(lambda: stream.readline(MOST_CHARACTERS + 1), b""), 1):
        if number == 1 and data.startswith(UTF16):
            raise FormatError("UTF-16; lines are read as UTF-8: iconv -f UTF-16 -t UTF-8", source=source)
        if len(data) > MOST_CHARACTERS:
            raise FormatError(f"a line of more than {MOST_CHARACTERS} bytes", source=source, line=number)
        try:
            yield number, decode(data, source).rstrip("\r\n"), ""
        except FormatError as error:
            yield number, "", error.message


KEPT = {"frames", *LISTS, *POINT_KEYS, *ROTATION_KEYS, *PARTS, "x", "y", "z"}  # keys of trees, and of records
READABLE = ("json", "yaml")  # the same numbers; other formats are for printing
KEPT_ARE = "a name keeps one pose, point, number or tree"


class KeptResults:
    """The results of lines `NAME = COMMAND`."""

    def __init__(self) -> None:
        """Create it without any."""
        self._texts: dict[str, str] = {}
        self._failed: dict[str, int] = {}  # name -> the line that sets it

    def value_of(self, name: str) -> str:
        """Return the value of a name; raise Misused for one that has no value."""
        if name in self._texts:
            return self._texts[name]
        if name in self._failed:
            raise Misused(f"${name} has no value: line {self._failed[name]}, which sets it, has failed")
        known = alternatives(name, self._texts, "names") if self._texts else "; no line before has kept a result"
        shells = "variables of the shell are not known here" if name in os.environ else "a dollar sign is $$"
        raise Misused(f"unknown name ${name}{known}; {shells}")

    def keep(self, name: str, text: str) -> None:
        """Keep a result that was printed as JSON; raise ValueInvalid for what no name can keep."""
        if len(text) > MOST_CHARACTERS:
            raise ValueInvalid(f"a result of more than {MOST_CHARACTERS} bytes; {KEPT_ARE}")
        lines = text.count("\n")
        if lines != 1:
            raise ValueInvalid(f"{name}: the command has {lines or 'no'} result{'s' * (lines != 1)}; {KEPT_ARE}")
        try:
            value = json.loads(text)
        except ValueError:
            raise ValueInvalid(f"{name}: the result is text; {KEPT_ARE}") from None
        keys = set(value) if isinstance(value, dict) else set()
        if not (isinstance(value, float | int) or keys & KEPT):
            raise ValueInvalid(f"{name}: the result is a report; {KEPT_ARE}")
        self._texts[name] = text.strip()
        self._failed.pop(name, None)

    def lose(self, name: str, line: int) -> None:
        """Forget what a name stood for: the line that sets it has failed."""
        self._texts.pop(name, None)
        self._failed[name] = line


def print_as_json(name: str, context: click.Context) -> None:
    """Let a command that is about to run print what can be kept; raise Misused where it cannot."""
    formats: Any = next((each.type for each in context.command.params if each.name == "format_name"), None)
    if "json" not in getattr(formats, "choices", ()):
        raise Misused(f"{name}: {context.info_name} has no result that can be kept; {KEPT_ARE}")
    params = context.params
    if other := ("-o FILE" if params.get("output") else "--explain" if params.get("explain") else ""):
        raise Misused(f"{name}: a result is kept or written, not both; leave {other} or {name} = out")
    if params["format_name"] not in (None, *READABLE):
        raise Misused(f"{name}: -f {params['format_name']} is for printing, and {name} is kept; leave it out")
    params["format_name"] = "json"


FINISHED = (0, ROWS_SKIPPED)  # a command that skipped rows, as --on-error says, has come to its end
ENDLESS = ("--realtime", "--live", "teleop", "--duration=inf")
NO_INPUT = "standard input is not for the lines of a batch; name a file, or keep a result by NAME = and give $NAME"


class LineFailed(FrametoolError):
    """Report a command that said itself what is wrong, by its status."""


class CommandBatch:
    """The commands of a batch, and what they leave for those behind them: kept results, trees, the exit status.

    source: the batch as messages name it
    skips: go on behind a line that fails
    """

    def __init__(self, source: str, *, skips: bool) -> None:
        """Create a batch of which nothing has run."""
        self.source = source
        self.skips = skips
        self.results = KeptResults()
        self.context = click.Context(group, info_name="frametool", obj=ReadCache())
        self.count = self.failed = self.status = 0
        self.in_json = True  # as all lines that failed wanted their errors

    def run(self, stream: BinaryIO) -> int:
        """Run the commands of a stream as they come and return the exit status of all."""
        piped = _Pipe(sys.stdout.buffer, "utf-8", newline="\n") if sys.stdout.isatty() else sys.stdout
        with streams(_NoInput(), piped):  # standard input has the lines of the batch
            for line in command_lines(stream, self.source):
                self.count += 1
                status = self._run_line(line)
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

    def _run_line(self, line: CommandLine) -> int:
        """Run one command and report what goes wrong; return its status."""
        words: list[str] = []
        status = 0
        problem: FrametoolError
        with telling_of(BatchLine(self.source, line.number)):
            try:
                if line.problem:
                    raise Misused(line.problem)
                words = split(line.text, self.results.value_of)
                status = self._called(words, line.name)
                if status in FINISHED:
                    return status
                problem = LineFailed(f"{words[0]} ended with status {status}", status=status)
            except BrokenPipeError:
                raise
            except FrametoolError as error:
                problem = error
            except TROUBLES as error:
                problem = FileProblem(words_of(error))
            if line.name:
                self.results.lose(line.name, line.number)
            self.in_json &= (in_json := wants_json(words))
            say_error(problem, in_json=in_json, fate="line skipped" if self.skips else "")
        return status or TROUBLE.get(words[0] if words else "", problem.exit_code)

    def _called(self, words: list[str], name: str) -> int:
        """Call a command; with a name keep what it prints."""
        _refuse(words)
        self.context.meta.clear()
        if not name:
            is_own = words[0].startswith("-")  # an option of frametool itself
            return answered(lambda: called(words) if is_own else called_in(self.context, words), words)
        held = BytesIO()
        with streams(sys.stdin, writer(held)):
            status = answered(lambda: called_in(self.context, words, partial(print_as_json, name)), words)
        if status in FINISHED:
            self.results.keep(name, held.getvalue().decode())
        return status


def _refuse(words: Sequence[str]) -> None:
    """Raise Misused for a command that has no place in a batch."""
    if words[0] == "batch":
        raise Misused("a batch runs no batch; put the lines of that one here")
    if words[0] == "frametool":
        raise Misused("omit the word `frametool`: a line begins with the command")
    endless = next((each for each in words if each in ENDLESS), "")
    if words[0] == "sim" and (endless or "--duration inf" in " ".join(words)):
        raise Misused(f"sim {endless or '--duration inf'} keeps the lines behind it waiting; run it alone")


class _Pipe(TextIOWrapper):
    """A standard output that is never taken for a terminal."""

    def isatty(self) -> bool:
        """Return False."""
        return False


class _NoInput(TextIOBase):
    """A standard input that refuses whoever reads from it."""

    @property
    def buffer(self) -> BinaryIO:
        """Raise Misused."""
        raise Misused(NO_INPUT)


@command_named("batch", epilog=EXIT_CODES)
@argument("file", FILE, default="-", metavar="[FILE]")
@option("--on-error", "stop at a line that fails, or report and skip it", (STOP, SKIP), name="on_failure", default=STOP)
def command(inputs: Inputs) -> int:
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
    lines were skipped. Lines cannot read standard input: name files. A line cannot be another batch, nor run in real
    time or without end, like sim --realtime.
    """
    file, skips = inputs.file, inputs.on_failure == SKIP
    stream = opened(file)
    if file != "-":
        with stream:
            return CommandBatch(file, skips=skips).run(stream)
    if stream.isatty():
        say("reading from the terminal; end with Ctrl-D")
    return CommandBatch("stdin", skips=skips).run(stream)
