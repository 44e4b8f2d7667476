"""Leaders from the command line: a built-in name, a file, standard input."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from frametool.documents.source import Source, decode, read_text
from frametool.errors import FormatError, alternatives, shown
from frametool.sim.command_file import read_commands, read_script
from frametool.sim.leaders import LEADERS, Mailbox, built_in, scripted

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from frametool.sim.leaders import MakeLeader


def leader_of(argument: str, seed: int, *, paced: bool) -> MakeLeader:
    """Return the leader of an argument; `paced`: what comes from standard input acts when it arrives.

    Raises FormatError; FileProblem; click.UsageError for a name that is neither a leader nor a file.
    """
    if argument in LEADERS:
        return built_in(argument, seed)
    if argument == "-":
        return _from_stdin(paced=paced)
    if not os.path.exists(argument) and not os.path.splitext(argument)[1]:
        raise click.UsageError(f"no leader {shown(argument)}{alternatives(argument, LEADERS, 'leaders')}, or a file")
    return scripted(read_script(Source(argument, read_text(argument))))


def _from_stdin(*, paced: bool) -> MakeLeader:
    """Read commands as they come: by their times, or in real time whenever they arrive."""
    if sys.stdin.isatty():
        raise click.UsageError("standard input is a terminal; pipe commands in, or see frametool sim teleop")
    if not paced:
        return scripted(read_commands(stdin_lines(), "stdin"))
    mailbox = Mailbox()
    mailbox.fill_from(read_commands(stdin_lines(), "stdin", period_ns=0))
    return lambda: mailbox


def stdin_lines() -> Iterator[str]:
    """Yield the lines of standard input as they arrive.

    Raises FormatError for bytes that are no text.
    """
    for number, data in enumerate(_lines(sys.stdin.buffer)):
        try:
            yield decode(data, "stdin")
        except FormatError as error:
            error.line += number
            raise


def _lines(stream: Any) -> Iterator[bytes]:
    """Read past the stream's buffer: Python aborts when it ends while a thread waits inside that."""
    begun: list[bytes] = []
    while block := stream.raw.read(1 << 16):
        first, *more = block.split(b"\n")
        begun.append(first)
        for rest in more:
            yield b"".join(begun) + b"\n"
            begun = [rest]
    if last := b"".join(begun):
        yield last
