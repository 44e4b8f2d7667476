"""The words of an expression, each with its place; a look-up such as `map<-base_link` is one word.

Knows no grammar.  A frame's name may hold `/`, `:`, `.` and `-`, so that no operator stands in a look-up.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from frametool.errors import FrametoolError, shown
from frametool.text.numbers import odd_characters

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

LONGEST = 1 << 16
"""Most characters of an expression."""

_NUMBER = re.compile(r"((?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+)(\w*+)")
_COLUMN = r'\s*+\.\s*+(?:"[^"\n]*"|\w++(?:\.\w++)*+)'
ARROW = "<-"
_OPERATORS = "-+*/^@()[],="
_IN_FRAMES = "_/:.-"
_BEFORE_QUOTE = "{[,: \t\r\n"


class CalcError(FrametoolError):
    """Report an expression that cannot be read, whose frames or units do not fit, or that has no value.

    at: the place in the expression, from 0; None where the whole is meant
    snippet: the expression with a caret below the place
    """

    def __init__(self, message: str, at: int | None = None) -> None:
        """Keep the place beside the message."""
        super().__init__(message)
        self.at = at
        self.snippet = ""


class NoTree(CalcError):
    """Report a look-up where no tree was given."""

    exit_code = 2


class Token(NamedTuple):
    """A word: its kind, its text and where it stands.

    kind: lookup, number, name, column, text (in quotes), frame (behind `in`), pose (in braces), op, end
    unit: what stands close behind a number; frames: target and source of a look-up
    """

    kind: str
    text: str
    start: int
    end: int
    unit: str = ""
    frames: tuple[str, ...] = ()


def tokens_of(text: str) -> list[Token]:
    """Split an expression into words; the last one is the end.  Behind `in` stands a frame."""
    if len(text) > LONGEST:
        raise CalcError(f"an expression of {len(text)} characters; the most are {LONGEST}")
    return [*_words(text), Token("end", "", len(text), len(text))]


def _words(text: str) -> Iterator[Token]:
    at, end, before = 0, len(text), ""
    while True:
        at = _behind_blanks(text, at)
        if at == end:
            return
        token = _word(text, at, before)
        yield token
        at, before = token.end, token.text


def _behind_blanks(text: str, at: int) -> int:
    while at < len(text) and text[at].isspace():
        at += 1
    return at


def _word(text: str, at: int, before: str) -> Token:
    """Read the word at a place."""
    first = text[at]
    if first == "{":
        close = closing_brace(text, at)
        return Token("pose", text[at:close], at, close)
    if (frame := _behind_frame(text, at)) > at:
        if before == "in":
            return Token("frame", text[at:frame], at, frame)
        if (lookup := _lookup(text, at, frame)) is not None:
            return lookup
        if first == '"':
            return Token("text", text[at:frame], at, frame)
    if (number := _NUMBER.match(text, at)) is not None:
        return Token("number", number[1], at, number.end(), number[2])
    if (end := _behind_name(text, at)) > at:
        column = re.compile(_COLUMN).match(text, end) if text[at:end] == "row" else None
        if column is not None:
            return Token("column", text[at : column.end()], at, column.end())
        return Token("name", text[at:end], at, end)
    if first in _OPERATORS:
        return Token("op", first, at, at + 1)
    raise CalcError(_unexpected(text, at), at)


def _behind_name(text: str, at: int) -> int:
    """Return the end of the name at a place; the place itself where there is none."""
    end = at
    while end < len(text) and (text[end].isalnum() or text[end] == "_"):
        end += 1
    return at if text[at].isdecimal() else end


def _behind_frame(text: str, at: int) -> int:
    """Return the end of the frame's name at a place; the place itself where there is none.

    Within quotes anything; else letters, digits and _ / : . -, but a dash before an arrow is none of the name.
    """
    if text[at] == '"':
        close = text.find('"', at + 1)
        return at if close < 0 or "\n" in text[at:close] else close + 1
    begin = at + (text[at] == "/")
    if begin == len(text) or not (text[begin].isalpha() or text[begin] == "_"):
        return at
    end = begin
    while end < len(text) and (text[end].isalnum() or text[end] in _IN_FRAMES):
        end += 1
    if end < len(text) and text[end] in "<>":
        end = begin + len(text[begin:end].rstrip("-"))
    return end


def _lookup(text: str, begin: int, end: int) -> Token | None:
    """Read a look-up whose target was found."""
    arrow = _behind_blanks(text, end)
    if not text.startswith(ARROW, arrow):
        return None
    second = _behind_blanks(text, arrow + len(ARROW))
    last = second if second == len(text) else _behind_frame(text, second)
    if last == second:
        raise CalcError("a frame is missing behind <-: TARGET<-SOURCE", second)
    frames = tuple(each[1:-1] if each.startswith('"') else each for each in (text[begin:end], text[second:last]))
    return Token("lookup", text[begin:last], begin, last, frames=frames)


def _unexpected(text: str, at: int) -> str:
    """Say what is wrong with a character that begins no word."""
    if odd := odd_characters(text[at]):
        return f"unexpected {odd}"
    lookup = "a look-up is written TARGET<-SOURCE"
    hints = {
        "}": "a { before it is missing", '"': 'a quote is not closed: "name"', "<": lookup, ">": lookup,
        ".": "a number has a digit behind its point, a column is row.NAME",
        ";": "write one expression a line", "~": "the inverse is inv(..)", "'": 'names with blanks stand in "',
    }  # fmt: skip
    hint = hints.get(text[at], "")
    return f"unexpected {shown(text[at])}" + (f"; {hint}" if hint else "")


def closing_brace(text: str, at: int) -> int:
    """Return the place behind the brace that closes the one at a place; what is quoted holds none."""
    depth, quote = 0, ""
    for place in range(at, len(text)):
        character = text[place]
        if quote:
            if character == quote and not (quote == '"' and _is_escaped(text, place)):
                quote = ""
        elif character in "\"'" and text[place - 1] in _BEFORE_QUOTE:
            quote = character
        elif character in "{}":
            depth += 1 if character == "{" else -1
            if not depth:
                return place + 1
    raise CalcError("a { is not closed", at)


def _is_escaped(text: str, place: int) -> bool:
    """Tell whether an odd number of backslashes stands before a place."""
    before = text[:place]
    return (len(before) - len(before.rstrip("\\"))) % 2 == 1 if before.endswith("\\") else False


def frame_text(name: str | None) -> str:
    """Write a frame's name as an expression has it; a name that is not known is `?`."""
    if name is None:
        return "?"
    plain = name and not name.startswith(('"', "/", "-")) and not name.endswith("-")
    return name if plain and _behind_frame(name, 0) == len(name) else f'"{name}"'
