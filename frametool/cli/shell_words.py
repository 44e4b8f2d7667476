r"""A line as a shell would take it apart: words, quotes, comments, and names whose values stand in for them.

    lookup 'my robot.yaml' map "base link"  # a comment
    compose $base_from_tool "inv(${map_from_base})" \
        '{xyz: [1, 2, 3]}'

In single quotes all is as written; in double quotes and bare `$NAME` is replaced, `\` takes the next character as it
is, and `$$` is one dollar sign.  What only a shell can do is refused, not taken for text.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.stream.faults import Misused

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_DOLLAR = rf"\$(?:{NAME}|\{{[^}}]*\}}|[$({{0-9@*\#?!-])?"
_TOKEN = re.compile(
    rf"""(?xs)
      (?P<blank> [ \t\r\n]+)
    | (?P<plain> [^ \t\r\n\\'"#$|&;<>`]+ | \#)
    | '(?P<single> [^']*)'
    | "(?P<double> (?:[^"\\]|\\.)*)"
    | \\(?P<escaped> .)
    | (?P<dollar> \$['"] | {_DOLLAR})
    | (?P<special> .)
    """
)
_IN_QUOTES = re.compile(rf"(?s)\\(?P<escaped>.)|(?P<dollar>{_DOLLAR})|(?P<special>`)|(?P<plain>[^\\$`]+)")
_INSTEAD = {
    "|": "keep a result by NAME = COMMAND and give $NAME",
    "<": "name the file as an argument, or with -i",
    ">": "write files with -o FILE",
    ";": "write one command a line",
    "&": "write one command a line",
    "`": "keep a result by NAME = COMMAND and give $NAME",
    "$(": "keep a result by NAME = COMMAND and give $NAME",
}


class WordPart(NamedTuple):
    """A piece of a word: text, or the name whose value stands there."""

    text: str
    is_name: bool = False


class ShellWords(NamedTuple):
    """The words of a line, each in its pieces.

    problem: why they cannot be taken; "" if they can
    goes_on: the line ends in a backslash, so the next one belongs to it
    """

    words: list[list[WordPart]]
    problem: str = ""
    goes_on: bool = False

    def with_values(self, value_of: Callable[[str], str]) -> list[str]:
        """Return the words with the values of names in them."""
        return ["".join(value_of(part.text) if part.is_name else part.text for part in word) for word in self.words]


def split(line: str) -> ShellWords:
    """Take a line apart; a `#` that begins a word begins a comment."""
    words: list[list[WordPart]] = []
    word: list[WordPart] | None = None
    problem = ""
    for token in _TOKEN.finditer(line):
        kind, text = token.lastgroup or "", token[0]
        if kind == "blank":
            word = None
            continue
        if text == "#" and word is None:
            break
        if kind == "special" and (text == "\\" or (text in "'\"" and _ends_in_backslash(line))):
            return ShellWords(words, problem, goes_on=True)
        if kind == "special" and text in "'\"":
            return ShellWords(words, problem or f"the {text} in column {token.start() + 1} is not closed")
        try:
            parts = list(_parts(kind, token[kind], is_first=word is None))
        except Misused as refused:
            problem = problem or str(refused)
            parts = []
        if word is None:
            word = []
            words.append(word)
        word += parts
    return ShellWords(words, problem)


def _parts(kind: str, text: str, *, is_first: bool = False) -> Iterator[WordPart]:
    """Yield the pieces of a token; raise Misused for what only a shell can do."""
    if kind == "double":
        for token in _IN_QUOTES.finditer(text):
            inner = token.lastgroup or ""
            yield from _parts("quoted" if inner == "escaped" else inner, token[inner])
    elif kind == "dollar":
        yield _named(text)
    elif kind == "special":
        raise Misused(f"{text} is for a shell: {_INSTEAD[text]}; in quotes it is text")
    elif kind == "quoted":  # a backslash in double quotes stays before what needs none
        yield WordPart(text if text in '$`"\\' else f"\\{text}")
    elif kind == "plain" and is_first and text.startswith("~/"):
        yield WordPart(os.path.expanduser(text))
    else:
        yield WordPart(text)


def _named(text: str) -> WordPart:
    """Return what a dollar sign and what follows it stand for."""
    behind = text[1:]
    bare = behind[1:-1] if behind.startswith("{") else behind
    if re.fullmatch(NAME, bare):
        return WordPart(bare, is_name=True)
    if behind == "$":
        return WordPart("$")
    if behind == "(":
        raise Misused(f"$( is for a shell: {_INSTEAD['$(']}; in single quotes it is text")
    if not behind:
        return WordPart(text)
    raise Misused(f"{text} names nothing: names are letters, digits and _; $$ is a dollar sign")


def _ends_in_backslash(line: str) -> bool:
    """Tell whether the last character is a backslash that no other one takes."""
    return (len(line) - len(line.rstrip("\\"))) % 2 == 1
