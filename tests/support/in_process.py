"""A line of shell whose `frametool` runs in this process, and so takes a twentieth of the time.

It knows what the documented examples use: quotes, pipes, `;`, `&&`, `||`, redirections, `d=..`, `$d`, `$?`,
`$(mktemp -d)`, `cd` and a few programs. Anything else is `NotUnderstood`, and needs a real shell.
"""

from __future__ import annotations

import io
import os
import re
import subprocess
from contextlib import ExitStack, chdir
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple
from unittest import mock

from frametool import cli
from frametool.cli.commands.batch import Terminal, reader, streams, writer

if TYPE_CHECKING:
    from pathlib import Path

PROGRAMS = {"cat", "cut", "echo", "grep", "head", "printf", "sed", "seq", "sort", "tail", "true", "wc"}
VARIABLE = r"\$\(mktemp -d\)|\$\w+|\$\?"
PIECE = rf"'[^']*'|\"(?:[^\"\\$`]|{VARIABLE})*\"|[^\s'\"\\$`|&;<>()*?\[\]{{}}#~]|(?<!\s)[#~]|{VARIABLE}"
TOKEN = re.compile(
    rf"(?P<joint>&&|\|\||[|;])\s*|(?P<redirection>\d?>&\d|(?:\d?>|<)[ \t]*(?:{PIECE})+)|(?P<word>(?:{PIECE})+)|[ \t]+(?:#.*)?"
)
COMMAND = re.compile(rf"{'|'.join(PROGRAMS)}|frametool|cd|\w+=.*")


class NotUnderstood(Exception):
    """Report what only a real shell runs."""


class Outcome(NamedTuple):
    """What a line leaves behind."""

    status: int
    out: str
    err: str


class Stage(NamedTuple):
    """A command of a pipeline: its words as they are written, its redirections."""

    words: list[str]
    redirections: list[str]


def parsed(line: str) -> list[tuple[str, list[Stage]]]:
    """Return the pipelines of a line, each with what joins it to the one before; raises NotUnderstood."""
    pipelines = [(";", [Stage([], [])])]
    position = 0
    while position < len(line):
        found = TOKEN.match(line, position)
        if found is None:
            raise NotUnderstood(line[position:])
        position = found.end()
        stages = pipelines[-1][1]
        if found["joint"] == "|":
            stages.append(Stage([], []))
        elif found["joint"]:
            pipelines.append((found["joint"], [Stage([], [])]))
        elif found["word"]:
            stages[-1].words.append(found["word"])
        elif found["redirection"]:
            stages[-1].redirections.append(found["redirection"])
    if not all(stage.words and COMMAND.fullmatch(stage.words[0]) for _, stages in pipelines for stage in stages):
        raise NotUnderstood(line)
    return pipelines


def understands(line: str) -> bool:
    """Return True if the line needs no real shell."""
    try:
        return bool(parsed(line))
    except NotUnderstood:
        return False


def run_line(line: str, folder: Path, *, pipefail: bool = False) -> Outcome:
    """Run a line in a folder, with nothing on its standard input; raises NotUnderstood."""
    out, err = io.BytesIO(), io.BytesIO()
    with ExitStack() as until_end:
        status = _Shell(out, err, until_end, pipefail=pipefail).run(line, folder)
    return Outcome(status, out.getvalue().decode(), err.getvalue().decode())


def printed(line: str, folder: Path, width: int) -> str:
    """Return what a line prints on a terminal, its standard error among it; raises NotUnderstood."""
    screen = Terminal()
    environment = {"TERM": "dumb", "NO_COLOR": "1", "COLUMNS": str(width)}
    with mock.patch.dict(os.environ, environment), ExitStack() as until_end:
        _Shell(screen, screen, until_end, pipefail=False).run(line, folder)
    return screen.getvalue().decode()


class _Shell:
    """A shell: its variables, and where its output goes."""

    def __init__(self, out: io.BytesIO, err: io.BytesIO, until_end: ExitStack, *, pipefail: bool) -> None:
        self.out, self.err, self.until_end, self.pipefail = out, err, until_end, pipefail
        self.variables = {"?": "0"}

    def run(self, line: str, folder: Path) -> int:
        """Run a line and return its exit status."""
        with chdir(folder):
            for joint, stages in parsed(line):
                if joint == ";" or (joint == "&&") == (self.variables["?"] == "0"):
                    self.variables["?"] = str(self._pipeline(stages))
        return int(self.variables["?"])

    def _pipeline(self, stages: list[Stage]) -> int:
        """Run commands one after the other, each with the output of the one before."""
        data, statuses = b"", [0]
        for stage in stages:
            out = self.out if stage is stages[-1] else io.BytesIO()
            statuses.append(self._stage(stage, data, out))
            data = out.getvalue()
        return next((each for each in reversed(statuses) if each), 0) if self.pipefail else statuses[-1]

    def _stage(self, stage: Stage, data: bytes, out: io.BytesIO) -> int:
        """Run a command with its redirections."""
        stdin: Any = io.BytesIO(data)
        streams: dict[str, Any] = {"1": out, "2": self.err}
        with ExitStack() as files:
            for each in stage.redirections:
                number, sign, target = re.findall(r"(?s)^(\d?)(>&|>|<)\s*(.*)", each)[0]
                if sign == ">&":
                    streams[number or "1"] = streams[target]
                elif sign == "<":
                    stdin = files.enter_context(open(self._value(target), "rb", buffering=0))
                else:
                    streams[number or "1"] = files.enter_context(open(self._value(target), "wb"))
            return self._command([self._value(word) for word in stage.words], stdin, streams["1"], streams["2"])

    def _command(self, words: list[str], stdin: Any, out: Any, err: Any) -> int:
        """Run a command."""
        if words[0] == "frametool":
            return frametool(words[1:], stdin, out, err)
        if words[0] == "cd":
            os.chdir(words[1])
        elif words[0] in PROGRAMS:
            done = subprocess.run(words, input=stdin.read(), capture_output=True, check=False)
            out.write(done.stdout)
            err.write(done.stderr)
            return done.returncode
        else:
            name, _, self.variables[name] = words[0].partition("=")
        return 0

    def _value(self, word: str) -> str:
        """Return what a word stands for: without its quotes, its variables replaced."""
        pieces = re.findall(PIECE, word)
        return "".join(each[1:-1] if each[0] == "'" else re.sub(VARIABLE, self._variable, each.strip('"')) for each in pieces)

    def _variable(self, found: re.Match[str]) -> str:
        """Return the value of a variable, or a new folder."""
        if found[0].startswith("$("):
            return self.until_end.enter_context(TemporaryDirectory())
        return self.variables[found[0][1:]]


def frametool(words: list[str], stdin: Any, out: Any, err: Any) -> int:
    """Run the command line in this process on streams as a process has them; what it changes is changed back."""
    with streams(reader(stdin), writer(out), writer(err, "backslashreplace")), mock.patch.dict(os.environ):
        return cli.run(words)
