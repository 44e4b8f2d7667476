"""The parser of expressions: tokens with their positions, and a grammar by precedence climbing.

The parser computes nothing.  A look-up such as `map<-base_link` is one token: a frame's name may contain `/`, `:`,
`.` and `-`.

    sum     = product {("+" | "-") product}        product = factor {("*" | "/") factor}
    factor  = {"-" | "+"} power                    power   = named ["^" factor]
    named   = atom {"as" TARGET<-SOURCE | "in" FRAME}
    atom    = NUMBER[UNIT] | LOOKUP ["@" time] | NAME "[" LOOKUP ["@" time] "]" | NAME "(" .. ")" | NAME
            | row | row.COLUMN | {pose} | "[" .. "]" | "(" sum ")"
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from frametool.errors import FrametoolError, ValueInvalid, shown
from frametool.text.numbers import odd_characters

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Container, Iterator

LONGEST = 1 << 16  # characters of an expression
DEEPEST = 100  # levels of nested brackets, signs and exponents
RESERVED = ("row", "as", "in", "ans", "pi")
PLAIN, METRE, RADIAN, SECOND = "", "m", "rad", "s"
# unit -> factor, divisor and base unit: dividing rounds once, so that 100mm is 0.1m
UNITS: dict[str, tuple[float, float, str]] = {
    "m": (1.0, 1.0, METRE), "mm": (1.0, 1e3, METRE), "cm": (1.0, 1e2, METRE), "km": (1e3, 1.0, METRE),
    "rad": (1.0, 1.0, RADIAN), "deg": (1.0, 1.0, RADIAN),
    "s": (1.0, 1.0, SECOND), "ms": (1.0, 1e3, SECOND), "us": (1.0, 1e6, SECOND), "ns": (1.0, 1e9, SECOND),
}  # fmt: skip
# precedence of operators and of the words for frames; SIGN is that of a sign before its value
LOOSEST, SIGN, FRAMES = 0, 2, 4
BINDING = {"+": LOOSEST, "-": LOOSEST, "*": 1, "/": 1, "^": 3, "as": FRAMES, "in": FRAMES}
_FRAME = r'(?:"[^"\n]*+"|/?+[^\W\d](?:[\w/:.]|-(?!-*+[<>]))*+)'
_TOKEN = re.compile(rf"""(?x)
    (?P<lookup>(?P<target>{_FRAME})\s*+<-\s*+(?P<source>{_FRAME}))
  | (?P<text>"[^"\n]*+")
  | (?P<number>(?P<digits>(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+)(?P<unit>\w*+))
  | (?P<column>row\s*+\.\s*+(?:"[^"\n]*"|\w++(?:\.\w++)*+))
  | (?P<name>(?!\d)\w++)
  | (?P<op>[-+*/^@()\[\],=])""")
_BRACES = r"""(?s)(?<=[{\[,: \t\r\n])(?:"(?:[^"\\]|\\.)*+"|'[^']*+'|(?P<unclosed>["']))|[{}]"""


class CalcError(FrametoolError):
    """An expression that cannot be parsed, whose frames or units do not match, or that has no value.

    at: the position in the expression, from 0; None for the whole expression
    snippet: the expression with a caret below the position
    """

    def __init__(self, message: str, at: int | None = None) -> None:
        """Store the position with the message."""
        super().__init__(message)
        self.at = at
        self.snippet = ""


class NoTree(CalcError):
    """A look-up without a tree."""

    exit_code = 2


class Token(NamedTuple):
    """A token: its kind, text and position.

    kind: lookup, number, name, column, text (in quotes), frame (after `in`), pose (in braces), op, end
    unit: of a number, directly after it; frames: target and source of a look-up
    """

    kind: str
    text: str
    start: int
    end: int
    unit: str = ""
    frames: tuple[str, ...] = ()


def tokens_of(text: str) -> list[Token]:
    """Split an expression into tokens, the last of which is the end; the token after `in` is a frame."""
    if len(text) > LONGEST:
        raise CalcError(f"an expression of {len(text)} characters; the most are {LONGEST}")
    tokens: list[Token] = []
    blank, at = re.compile(r"\s*+"), 0
    while (at := blank.match(text, at).end()) < len(text):  # type: ignore[union-attr]
        first = text[at]
        if first == "{":
            depth = 0  # of braces; those in quotes do not count
            for brace in re.compile(_BRACES).finditer(text, at):
                depth += (brace[0] == "{") - (brace[0] == "}")
                if brace["unclosed"] or not depth:
                    break
            if depth:
                raise CalcError("a { is not closed", at)
            token = Token("pose", text[at : brace.end()], at, brace.end())
        elif tokens and tokens[-1].text == "in" and (frame := re.compile(_FRAME).match(text, at)):
            token = Token("frame", frame[0], at, frame.end())
        elif found := _TOKEN.match(text, at):
            kind, unit = found.lastgroup or "", found["unit"] or ""
            frames = tuple(each.strip('"') for each in (found["target"], found["source"]) if each)
            token = Token(kind, found["digits"] or found[0], at, found.end(), unit, frames)
        else:
            hint = "; a quote is not closed" * (first == '"')
            raise CalcError(f"unexpected {odd_characters(first) or shown(first) + hint}", at)
        tokens.append(token)
        at = token.end
    return [*tokens, Token("end", "", at, at)]


def frame_text(name: str | None) -> str:
    """Format a frame's name for an expression; an unknown name is `?`."""
    if name is None:
        return "?"
    plain = re.fullmatch(_FRAME, name) and not name.startswith(('"', "/")) and not name.endswith("-")
    return name if plain else f'"{name}"'


class Branch(NamedTuple):
    """A node of the syntax tree of an expression.

    kind: number, lookup, name, column, call, pose, list, chain, negate
    at: the position for messages about it
    value: its data, by kind; parts: its children in order
    """

    kind: str
    at: int
    value: Any = None
    parts: tuple[Branch, ...] = ()


class Operator(NamedTuple):
    """An operator of a chain, or the word `as` or `in` with the frames after it; at: its position."""

    text: str
    at: int
    frames: tuple[str, ...] = ()


class Line(NamedTuple):
    """A line: the name that it assigns ("" if none), its expression, and the whole text."""

    name: str
    tree: Branch
    text: str


def parse_line(text: str, taken: Container[str]) -> Line:
    """Parse `NAME = expression` or an expression; taken: names that cannot be assigned."""
    head, equals, _ = text.partition("=")
    name = head.strip() if equals else ""
    if not name.isidentifier():
        return Line("", _Parser(text).whole(), text)
    if name in RESERVED or name in taken:
        message = f"{shown(name)} has a meaning of its own and cannot be bound; take another name"
        raise CalcError(message, head.index(name))
    return Line(name, _Parser(" " * (len(head) + 1) + text[len(head) + 1 :]).whole(), text)


def walk(tree: Branch) -> Iterator[Branch]:
    """Yield a node and all its descendants."""
    waiting = [tree]
    while waiting:
        branch = waiting.pop()
        yield branch
        waiting += branch.parts


def needs_time(branch: Branch) -> bool:
    """Return True for a look-up at the time of the row, `@ row`."""
    return branch.kind == "lookup" and branch.value[2] == "row"


def reads_row(branch: Branch) -> bool:
    """Return True for the name `row`."""
    return branch.kind == "name" and branch.value == "row"


def mentions_row(tree: Branch) -> bool:
    """Return True if an expression needs rows: it has `row`, `row.COLUMN` or `@ row`."""
    return any(each.kind == "column" or reads_row(each) or needs_time(each) for each in walk(tree))


class _Parser:
    """Parses the tokens of one expression; counts nested levels."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = tokens_of(text)
        self.index = 0
        self.depth = 0

    @property
    def next(self) -> Token:
        return self.tokens[self.index]

    def take(self) -> Token:
        token = self.next
        self.index += token.kind != "end"
        return token

    def has(self, *texts: str) -> bool:
        return self.next.kind == "op" and self.next.text in texts

    def expect(self, text: str) -> Token:
        """Take an operator; raises CalcError if another token is next."""
        if self.has(text):
            return self.take()
        found = f", found {shown(self.next.text)}" if self.next.kind != "end" else " here"
        raise CalcError(f"expected {text!r}{found}{self._hint()}", self.next.start)

    def whole(self) -> Branch:
        """Parse the whole text."""
        tree = self.value()
        if self.next.kind != "end":
            raise CalcError(f"unexpected {shown(self.next.text)}{self._hint()}", self.next.start)
        return tree

    def _hint(self) -> str:
        """Return a hint if a unit is separated from its number, else ""."""
        token, before = self.next, self.tokens[self.index - 1] if self.index else None
        if before is not None and before.kind == "number" and not before.unit and token.text in UNITS:
            return f"; write a unit directly after its number: {before.text}{token.text}"
        return ""

    def deeper(self, at: int, least: int = LOOSEST) -> Branch:
        """Parse a nested value; raises CalcError beyond DEEPEST levels."""
        self.depth += 1
        if self.depth > DEEPEST:
            raise CalcError(f"nested deeper than {DEEPEST} levels", at)
        found = self.value(least)
        self.depth -= 1
        return found

    def value(self, least: int = LOOSEST) -> Branch:
        """Parse a value, and the operators after it with at least this precedence, as one chain from left to right."""
        if self.has("-", "+"):
            sign = self.take()
            first = self.deeper(sign.start, SIGN)
            first = Branch("negate", sign.start, None, (first,)) if sign.text == "-" else first
        else:
            first = self.atom()
        operators, parts = list[Operator](), [first]
        while self.next.kind in ("op", "name") and (binds := BINDING.get(self.next.text, -1)) >= least:
            token = self.take()
            frames: tuple[str, ...] = ()
            if binds == FRAMES:
                named = self.take()
                if named.kind != ("lookup" if token.text == "as" else "frame"):
                    both = "as names both frames: .. as TARGET<-SOURCE"
                    raise CalcError(both if token.text == "as" else "in names one frame: .. in FRAME", named.start)
                frames = named.frames or (named.text.strip('"'),)
            else:  # 2^3^2 is 2^9
                right = self.deeper(token.start, SIGN) if token.text == "^" else self.value(binds + 1)
                parts.append(right)
            operators.append(Operator(token.text, token.start, frames))
        return Branch("chain", operators[0].at, tuple(operators), tuple(parts)) if operators else first

    def atom(self) -> Branch:
        """Parse one value."""
        token = self.take()
        kind, text, start = token[:3]
        if kind == "op" and text == "(":
            inside = self.deeper(start)
            self.expect(")")
            return inside
        if kind == "op" and text == "[":
            parts, end = self._items("]", start)
            return Branch("list", start, self.text[start:end], parts)
        if kind == "number":
            return Branch(kind, start, (text, token.unit))
        if kind == "lookup":
            return self._lookup(token, "")
        if kind == "name" and self.has("("):
            self.take()
            return Branch("call", start, text, self._items(")", start)[0])
        if kind == "name" and self.has("["):  # a look-up in a named tree
            self.take()
            asked = self.take()
            if asked.kind != "lookup":
                raise CalcError(f"expected a look-up like {text}[TARGET<-SOURCE]", asked.start)
            found = self._lookup(asked, text)
            self.expect("]")
            return found
        if kind == "column":
            return Branch(kind, start, text.partition(".")[2].strip().strip('"'))
        if kind == "pose" or (kind == "name" and text not in ("as", "in")):
            return Branch(kind, start, text)
        if kind == "end":
            raise CalcError("something is missing here", start)
        hint = "; a frame is asked for as TARGET<-SOURCE" if kind == "text" else ""
        raise CalcError(f"unexpected {shown(text)}{hint}", start)

    def _items(self, close: str, start: int) -> tuple[tuple[Branch, ...], int]:
        """Parse values separated by commas up to a closing bracket; return them and the position after it."""
        items = []
        if not self.has(close):
            items.append(self.deeper(start))
            while self.has(","):
                self.take()
                items.append(self.deeper(start))
        return tuple(items), self.expect(close).end

    def _lookup(self, token: Token, tree: str) -> Branch:
        """Parse the time of a look-up: nanoseconds, never through a float, or `latest` or `row`."""
        when: int | str | None = None
        if self.has("@"):
            self.take()
            sign = self.take().text if self.has("-", "+") else ""
            time = self.take()
            if time.kind == "name" and time.text in ("latest", "row") and not sign:
                when = time.text
            elif time.kind == "number" and time.unit:
                from frametool.frames.stamps import parse_time

                try:
                    when = parse_time(f"{sign}{time.text}{time.unit}")
                except ValueInvalid as error:
                    raise CalcError(str(error), time.start) from None
            else:
                found = "" if time.kind == "end" else f", found {shown(time.text)}"
                expected = "expected a time with its unit, 2.5s or 2500000000ns, or latest or row"
                raise CalcError(f"{expected}{found}", time.start)
        return Branch("lookup", token.start, (token.frames, tree, when))
