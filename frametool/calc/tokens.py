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

FRAME = r'(?:"[^"\n]*"|[^\W\d][\w/:.]*+(?:-++(?![<>])[\w/:.]*+)*+|/[\w/:.]++(?:-++(?![<>])[\w/:.]*+)*+)'
_WORD = re.compile(
    rf"""(?P<lookup>{FRAME}\s*+<-\s*+{FRAME})
    |(?P<number>(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+)(?P<unit>[^\W\d]\w*+)?+
    |(?P<column>row\s*+\.\s*+(?:"[^"\n]*"|\w++(?:\.\w++)*+))
    |(?P<name>[^\W\d]\w*+)
    |(?P<text>"[^"\n]*")
    |(?P<op>[-+*/^@()\[\],=])""",
    re.VERBOSE,
)
_FRAMES = re.compile(rf"({FRAME})\s*+<-\s*+({FRAME})")
_PLAIN = re.compile(FRAME)
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
    """A word: its kind (a group of the pattern, `pose` for braces, `end`), its text and where it stands."""

    kind: str
    text: str
    start: int
    end: int
    unit: str = ""


def tokens_of(text: str) -> list[Token]:
    """Split an expression into words; the last one is the end.  Behind `in` stands a frame."""
    if len(text) > LONGEST:
        raise CalcError(f"an expression of {len(text)} characters; the most are {LONGEST}")
    return [*_words(text), Token("end", "", len(text), len(text))]


def _words(text: str) -> Iterator[Token]:
    at, end, before = 0, len(text), ""
    while True:
        while at < end and text[at].isspace():
            at += 1
        if at == end:
            return
        if text[at] == "{":
            close = closing_brace(text, at)
            yield Token("pose", text[at:close], at, close)
            at = close
            continue
        if before == "in" and (frame := _PLAIN.match(text, at)):
            yield Token("frame", frame[0], at, frame.end())
            at, before = frame.end(), ""
            continue
        match = _WORD.match(text, at)
        if match is None:
            raise CalcError(_unexpected(text, at), at)
        before = match[0]
        kind = match.lastgroup or ""
        unit = match["unit"] or "" if kind == "unit" else ""
        kind = "number" if kind == "unit" else kind
        yield Token(kind, match[kind], at, match.end(), unit)
        at = match.end()


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


def frames_of(lookup: str) -> tuple[str, str]:
    """Return target and source of a look-up's text, without their quotes."""
    match = _FRAMES.fullmatch(lookup)
    assert match is not None  # noqa: S101 - the text of a token
    target, source = (each[1:-1] if each.startswith('"') else each for each in match.groups())
    return target, source


def frame_text(name: str | None) -> str:
    """Write a frame's name as an expression has it; a name that is not known is `?`."""
    if name is None:
        return "?"
    return name if not name.startswith(('"', "/")) and _PLAIN.fullmatch(name) else f'"{name}"'
