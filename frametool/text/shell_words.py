r"""A line parsed like in a shell: words, quotes, comments, and variables.

    lookup 'my robot.yaml' map "base link"  # a comment
    compose $base_from_tool "inv(${map_from_base})" \
        '{xyz: [1, 2, 3]}'

Single quotes are literal; in double quotes and outside `$NAME` is replaced, `\` escapes the next character,
and `$$` is one dollar sign.  Features of a real shell are refused, not taken for text.
"""

from __future__ import annotations

import os
import re
from itertools import pairwise
from typing import TYPE_CHECKING

from frametool.errors import Misused

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_DOLLAR = rf"\$(?:{NAME}|\{{[^}}]*\}}|[$({{0-9@*\#?!-])?"
_TOKEN = re.compile(
    rf"""(?xs)
      (?P<blank> (?:[ \t\r\n]|\\\n)+)
    | (?P<plain> [^ \t\r\n\\'"#$|&;<>`]+ | \#)
    | '(?P<single> [^']*)'
    | "(?P<double> (?:[^"\\]|\\.)*)"
    | (?P<open> ['"].*)
    | \\(?P<escaped> .)
    | (?P<dollar> \$['"] | {_DOLLAR})
    | (?P<special> .)
    """
)
_IN_QUOTES = re.compile(rf"(?s)\\(?P<quoted>.)|(?P<dollar>{_DOLLAR})|(?P<special>`)")
_INSTEAD = "write one command a line, keep a result by NAME = COMMAND, name files with -i and -o"


def _tokens(line: str) -> Iterator[tuple[re.Match[str], bool]]:
    """Yield the tokens of a line up to a comment, each with True if it begins a word."""
    begins = True
    for token in _TOKEN.finditer(line):
        if begins and token[0] == "#":
            return
        yield token, begins
        begins = token.lastgroup == "blank"


def has_words(line: str) -> bool:
    """Return True for a line that is neither blank nor a comment."""
    return any(token.lastgroup != "blank" for token, _ in _tokens(line))


def goes_on(line: str) -> bool:
    """Return True for a line that continues on the next: it ends in a backslash, not escaped and not in a comment."""
    backslashes = len(line) - len(line.rstrip("\\"))
    return backslashes % 2 == 1 and any(token.end() == len(line) for token, _ in _tokens(line))


def pipeline(line: str) -> list[str]:
    """Return the commands of a line separated by bars."""
    bars = [token.start() for token, _ in _tokens(line) if token[0] == "|"]
    return [line[begin + 1 : end] for begin, end in pairwise([-1, *bars, len(line)])]


def split(line: str, value_of: Callable[[str], str]) -> list[str]:
    """Return the words of a line with variables replaced; raises Misused for an open quote, and features of a shell."""
    words: list[str] = []
    for token, begins in _tokens(line):
        kind = token.lastgroup or ""
        if kind == "open":
            raise Misused(f"the {token[0][0]} in column {token.start() + 1} is not closed")
        if kind != "blank":
            words += [""] * begins
            words[-1] += _text(kind, token[kind], value_of, begins=begins)
    return words


def _text(kind: str, text: str, value_of: Callable[[str], str], *, begins: bool = False) -> str:
    """Return the text of a token; kind: its group in the pattern; begins: True for the first of a word."""
    if kind == "double":
        return _IN_QUOTES.sub(lambda each: _text(each.lastgroup or "", each[each.lastgroup or ""], value_of), text)
    if kind == "dollar":
        name = text[1:].removeprefix("{").removesuffix("}")
        if re.fullmatch(NAME, name):
            return value_of(name)
        if text not in ("$", "$$"):
            raise Misused(f"{text} names nothing: names are letters, digits and _; $$ is a dollar sign")
        return "$"
    if kind == "special":
        raise Misused(f"{text} is for a shell: {_INSTEAD}; in quotes it is text")
    if kind == "quoted":  # a backslash in double quotes is literal before other characters
        return text if text in '$`"\\' else f"\\{text}"
    return os.path.expanduser(text) if kind == "plain" and begins and text.startswith("~/") else text
