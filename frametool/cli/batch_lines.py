"""The lines of a batch as they come: each with its number, its words, and the name under which its result is kept."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.cli.shell_words import NAME, Words, split
from frametool.documents.limits import MOST_CHARACTERS
from frametool.documents.source import UTF16, decode
from frametool.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

MOST_JOINED = 1000  # lines of one command
_ASSIGNMENT = re.compile(rf"[ \t]*({NAME})[ \t]*=[ \t]*")


class CommandLine(NamedTuple):
    """A command of a batch.

    number: of its first line
    name: what its result is kept as; "" if it is printed
    words: those of the command; without any, the line is blank or a comment
    """

    number: int
    name: str
    words: Words


def command_lines(stream: BinaryIO, source: str) -> Iterator[CommandLine]:
    """Yield the commands of a batch, each as soon as its last line is there.

    Raises FormatError for what is no text of lines at all.
    """
    lines = _lines(stream, source)
    for number, text, problem in lines:
        yield _command_line(number, text, problem, lines, source)


def _command_line(
    number: int, text: str, problem: str, lines: Iterator[tuple[int, str, str]], source: str
) -> CommandLine:
    """Return the command that begins in a line, with the lines that a backslash joins to it."""
    name, words = _taken_apart(text)
    joined = 1
    while words.goes_on and not problem:
        _, more, problem = next(lines, (0, "", ""))
        text = text[:-1] + more
        joined += 1
        if joined > MOST_JOINED:
            raise FormatError(f"a command of more than {MOST_JOINED} lines", source=source, line=number)
        name, words = _taken_apart(text)
    return CommandLine(number, name, Words([], problem) if problem else words)


def _taken_apart(text: str) -> tuple[str, Words]:
    """Return the name before `=`, if there is one, and the words behind it."""
    found = _ASSIGNMENT.match(text)
    if found is None:
        return "", split(text)
    words = split(text[found.end() :])
    if not (words.words or words.problem or words.goes_on):
        words = Words([], f"no command behind {found[1]} =")
    return found[1], words


def _lines(stream: BinaryIO, source: str) -> Iterator[tuple[int, str, str]]:
    """Yield the number of each line, its text without its end, and what is wrong with its bytes."""
    number = 0
    while data := stream.readline(MOST_CHARACTERS + 1):
        number += 1
        if number == 1 and data.startswith(UTF16):
            raise FormatError("UTF-16; lines are read as UTF-8: iconv -f UTF-16 -t UTF-8", source=source)
        if len(data) > MOST_CHARACTERS:
            raise FormatError(f"a line of more than {MOST_CHARACTERS} bytes", source=source, line=number)
        try:
            yield number, decode(data, source).rstrip("\r\n"), ""
        except FormatError as error:
            yield number, "", error.message
