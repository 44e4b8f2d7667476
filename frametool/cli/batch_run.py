"""A batch: commands one after the other in one process, each as it would run alone in a pipe."""

from __future__ import annotations

import io
import sys
from contextlib import contextmanager, redirect_stdout
from typing import TYPE_CHECKING

import click

from frametool.cli import TROUBLE
from frametool.cli.batch_lines import command_lines
from frametool.cli.error_json import wants_json
from frametool.cli.group import called, called_in, group
from frametool.cli.kept_results import KeptResults, captured, print_as_json
from frametool.cli.misuse import answered
from frametool.cli.stderr import BatchLine, say_error, telling_of
from frametool.cli.tree_cache import TreeCache
from frametool.cli.troubles import TROUBLES, words_of
from frametool.errors import FileProblem, FrametoolError
from frametool.stream.faults import ROWS_SKIPPED, Misused, RowsSkipped

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import BinaryIO

    from frametool.cli.batch_lines import CommandLine

FINISHED = (0, ROWS_SKIPPED)  # a command that skipped rows, as it was told to, has come to its end
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
        self.context = click.Context(group, info_name="frametool", obj=TreeCache())
        self.count = self.failed = self.status = 0
        self.in_json = True  # as all lines that failed wanted their errors

    def run(self, stream: BinaryIO) -> int:
        """Run the commands of a stream as they come and return the exit status of all."""
        with _without_input(), _as_in_a_pipe():
            for line in command_lines(stream, self.source):
                if not (line.words.words or line.words.problem):
                    continue
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
        """Run one command and tell what goes wrong; return its status."""
        words: list[str] = []
        status = 0
        problem: FrametoolError
        with telling_of(BatchLine(self.source, line.number)):
            try:
                if line.words.problem:
                    raise Misused(line.words.problem)
                words = line.words.with_values(self.results.value_of)
                status = self._printed(words) if not line.name else self._kept(line.name, words)
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

    def _printed(self, words: Sequence[str], name: str = "") -> int:
        """Call a command; with a name for its result in a form that can be kept."""
        _refuse(words)

        def prepare(context: click.Context) -> None:
            if name:
                print_as_json(name, context)

        self.context.meta.clear()
        if words[0].startswith("-") and not name:  # options of frametool itself
            return answered(lambda: called(list(words)), words)
        return answered(lambda: called_in(self.context, words, prepare), words)

    def _kept(self, name: str, words: Sequence[str]) -> int:
        """Call a command and keep what it prints."""
        with captured() as held:
            status = self._printed(words, name)
        if status in FINISHED:
            self.results.keep(name, held.getvalue().decode())
        return status


def _refuse(words: Sequence[str]) -> None:
    """Raise Misused for a command that has no place in a batch."""
    if words[0] == "batch":
        raise Misused("a batch runs no batch; put the lines of that one here")
    if words[0] == "frametool":
        raise Misused("a line is what stands behind frametool; leave that word out")
    endless = next((each for each in words if each in ENDLESS), "")
    if words[0] == "sim" and (endless or "--duration inf" in " ".join(words)):
        raise Misused(f"sim {endless or '--duration inf'} keeps the lines behind it waiting; run it alone")


@contextmanager
def _without_input() -> Iterator[None]:
    """Keep commands from standard input, which holds their own lines or belongs to none of them."""
    before = sys.stdin
    sys.stdin = _NoInput()
    try:
        yield
    finally:
        sys.stdin = before


class _NoInput(io.TextIOBase):
    """A standard input that refuses whoever reads from it."""

    @property
    def buffer(self) -> BinaryIO:
        """Raise Misused."""
        raise Misused(NO_INPUT)


@contextmanager
def _as_in_a_pipe() -> Iterator[None]:
    """Let commands print into a terminal as they print into a pipe."""
    if not sys.stdout.isatty():
        yield
        return
    stream = _Pipe(sys.stdout.buffer, "utf-8")
    try:
        with redirect_stdout(stream):
            yield
    finally:
        stream.detach()


class _Pipe(io.TextIOWrapper):
    """A standard output that is taken for no terminal."""

    def isatty(self) -> bool:
        """Return that it is none."""
        return False
