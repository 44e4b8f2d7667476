"""An expression as a small tree, by precedence climbing; knows the grammar, neither frames nor numbers.

sum     = product {("+" | "-") product}        product = factor {("*" | "/") factor}
factor  = {"-" | "+"} power                    power   = named ["^" factor]
named   = atom {"as" TARGET<-SOURCE | "in" FRAME}
atom    = NUMBER[UNIT] | LOOKUP ["@" time] | NAME "[" LOOKUP ["@" time] "]" | NAME "(" .. ")" | NAME
          | row | row.COLUMN | {pose} | "[" .. "]" | "(" sum ")"
"""

from __future__ import annotations

from typing import Any, NamedTuple

from frametool.calc.tokens import CalcError, Token, tokens_of
from frametool.errors import ValueInvalid, shown

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

DEEPEST = 100
"""Most levels of brackets, signs and exponents within one another."""

RESERVED = ("row", "as", "in", "ans", "pi")
SUM, PRODUCT = ("+", "-"), ("*", "/")
TIME_UNITS = {"s": "", "ms": "e-3", "us": "e-6", "ns": "ns"}
ATOMS = frozenset(("number", "lookup", "name", "column", "call", "pose", "list"))


class Branch(NamedTuple):
    """A part of an expression.

    kind: number, lookup, name, column, call, pose, list, chain, sign, power, as, in
    at: the place that a message about it points to
    start, end: where its text stands; left, right: with the brackets around it
    value: what it says beside its parts, by kind; parts: those in order
    """

    kind: str
    at: int
    start: int
    end: int
    left: int
    right: int
    value: Any = None
    parts: tuple[Branch, ...] = ()

    @property
    def is_atom(self) -> bool:
        """Tell whether it needs no brackets wherever it stands."""
        return self.kind in ATOMS


class Line:
    """A line: the name it binds, if it does, and its expression with the whole text it stands in."""

    __slots__ = ("name", "text", "tree")

    def __init__(self, name: str, tree: Branch, text: str) -> None:
        """Keep all of it."""
        self.name = name
        self.tree = tree
        self.text = text


def parse_line(text: str, taken: frozenset[str] = frozenset()) -> Line:
    """Read `NAME = expression` or an expression; `taken` are names that cannot be bound."""
    head, equals, _ = text.partition("=")
    name = head.strip() if equals else ""
    if not name.isidentifier():
        return Line("", _Parser(text).whole(), text)
    if name in RESERVED or name in taken:
        message = f"{shown(name)} has a meaning of its own and cannot be bound; take another name"
        raise CalcError(message, head.index(name))
    return Line(name, _Parser(text, len(head) + 1).whole(), text)


def walk(tree: Branch) -> Iterator[Branch]:
    """Yield a part of an expression and all below it."""
    waiting = [tree]
    while waiting:
        branch = waiting.pop()
        yield branch
        waiting += branch.parts


def columns_of(tree: Branch) -> list[str]:
    """Name the columns that an expression asks for, each once."""
    return list(dict.fromkeys(column_name(branch.value) for branch in walk(tree) if branch.kind == "column"))


def needs_time(tree: Branch) -> bool:
    """Tell whether an expression looks up at the time of the row."""
    return any(branch.kind == "lookup" and branch.value[2] == "row" for branch in walk(tree))


def column_name(text: str) -> str:
    """Return the column of `row.COLUMN`."""
    return text.partition(".")[2].strip().strip('"')


def mentions_row(tree: Branch) -> bool:
    """Tell whether an expression needs rows: `row`, `row.COLUMN`, `@ row`."""
    return any(
        branch.kind == "column"
        or (branch.kind == "name" and branch.value == "row")
        or (branch.kind == "lookup" and branch.value[2] == "row")
        for branch in walk(tree)
    )


class _Parser:
    """Reads the words of one expression; levels within one another are counted."""

    def __init__(self, text: str, begin: int = 0) -> None:
        """Split the text from `begin`."""
        blank = " " * begin + text[begin:] if begin else text
        self.tokens = tokens_of(blank)
        self.index = 0
        self.depth = 0

    @property
    def next(self) -> Token:
        return self.tokens[self.index]

    def take(self) -> Token:
        token = self.tokens[self.index]
        self.index += token.kind != "end"
        return token

    def has(self, *texts: str) -> bool:
        token = self.tokens[self.index]
        return token.kind == "op" and token.text in texts

    def expect(self, text: str, why: str = "") -> Token:
        """Take an operator, or say that it is missing."""
        if self.has(text):
            return self.take()
        found = f", found {shown(self.next.text)}" if self.next.kind != "end" else " here"
        raise CalcError(f"expected {text!r}{found}{why or self._hint()}", self.next.start)

    def whole(self) -> Branch:
        """Read all of the text."""
        tree = self.sum()
        if self.next.kind != "end":
            token = self.next
            raise CalcError(f"unexpected {shown(token.text)}{self._hint()}", token.start)
        return tree

    def _hint(self) -> str:
        """Say what may be meant by a word that does not go on with what was read."""
        from frametool.calc.values import UNITS

        token, before = self.next, self.tokens[self.index - 1] if self.index else None
        if before is not None and before.kind == "number" and not before.unit and token.text in UNITS:
            return f"; a unit stands close to its number: {before.text}{token.text}"
        if token.kind in ("lookup", "name", "pose", "column"):
            return "; poses are joined by *"
        if token.text == "=":
            return "; a name stands before =, alone: NAME = expression"
        return "; a time belongs to a look-up: map<-base @ 2.5s" if token.text == "@" else ""

    def _deeper(self, at: int) -> None:
        self.depth += 1
        if self.depth > DEEPEST:
            raise CalcError(f"nested deeper than {DEEPEST} levels", at)

    def sum(self) -> Branch:
        """Read terms joined by + and -."""
        return self._chain(SUM)

    def _chain(self, operators: tuple[str, ...]) -> Branch:
        first = self._chain(PRODUCT) if operators is SUM else self.factor()
        parts, joined = [first], []
        while self.has(*operators):
            token = self.take()
            joined.append((token.text, token.start))
            parts.append(self._chain(PRODUCT) if operators is SUM else self.factor())
        if not joined:
            return first
        left, right = first.left, parts[-1].right
        return Branch("chain", joined[0][1], left, right, left, right, tuple(joined), tuple(parts))

    def factor(self) -> Branch:
        """Read signs and what they stand before."""
        if not self.has("-", "+"):
            return self.power()
        token = self.take()
        self._deeper(token.start)
        below = self.factor()
        self.depth -= 1
        return Branch("sign", token.start, token.start, below.right, token.start, below.right, token.text, (below,))

    def power(self) -> Branch:
        """Read a value and its exponent."""
        base = self.named()
        if not self.has("^"):
            return base
        token = self.take()
        self._deeper(token.start)
        exponent = self.factor()
        self.depth -= 1
        left, right = base.left, exponent.right
        return Branch("power", token.start, left, right, left, right, None, (base, exponent))

    def named(self) -> Branch:
        """Read a value and the frames it is said to have."""
        branch, before = self.atom(), self.depth
        while self.next.kind == "name" and self.next.text in ("as", "in"):
            word = self.take()
            self._deeper(word.start)
            token = self.take()
            if word.text == "as" and token.kind != "lookup":
                raise CalcError("as names both frames: .. as TARGET<-SOURCE", token.start)
            if word.text == "in" and token.kind != "frame":
                raise CalcError("in names one frame: .. in FRAME", token.start)
            value, end = token.frames or token.text, token.end
            branch = Branch(word.text, word.start, branch.left, end, branch.left, end, value, (branch,))
        self.depth = before
        return branch

    def atom(self) -> Branch:
        """Read one value."""
        token = self.take()
        start, end = token.start, token.end
        if token.kind == "op" and token.text == "(":
            self._deeper(start)
            inside = self.sum()
            close = self.expect(")")
            self.depth -= 1
            return inside._replace(left=start, right=close.end)
        if token.kind == "op" and token.text == "[":
            parts, end = self._items("]", start)
            return Branch("list", start, start, end, start, end, None, parts)
        if token.kind == "number":
            return Branch("number", start, start, end, start, end, (token.text, token.unit))
        if token.kind == "lookup":
            return self._lookup(token, start, "")
        if token.kind in ("column", "pose"):
            return Branch(token.kind, start, start, end, start, end, token.text)
        if token.kind == "name" and self.has("("):
            self.take()
            parts, end = self._items(")", start)
            return Branch("call", start, start, end, start, end, token.text, parts)
        if token.kind == "name" and self.has("["):
            return self._asked(token)
        if token.kind == "name" and token.text not in ("as", "in"):
            return Branch("name", start, start, end, start, end, token.text)
        if token.kind == "end":
            raise CalcError("something is missing here", start)
        hint = "; a frame is asked for as TARGET<-SOURCE" if token.kind == "text" else ""
        raise CalcError(f"unexpected {shown(token.text)}{hint}", start)

    def _items(self, close: str, start: int) -> tuple[tuple[Branch, ...], int]:
        """Read values between commas up to a bracket; return them and where it ends."""
        self._deeper(start)
        items = []
        if not self.has(close):
            items.append(self.sum())
            while self.has(","):
                self.take()
                items.append(self.sum())
        end = self.expect(close).end
        self.depth -= 1
        return tuple(items), end

    def _asked(self, name: Token) -> Branch:
        """Read the look-up in a tree that has a name: d[map<-base @ 2.5s]."""
        self.take()
        token = self.take()
        if token.kind != "lookup":
            raise CalcError(f"expected a look-up like {name.text}[TARGET<-SOURCE]", token.start)
        branch = self._lookup(token, name.start, name.text)
        end = self.expect("]").end
        return branch._replace(end=end, right=end)

    def _lookup(self, token: Token, start: int, tree: str) -> Branch:
        when: int | str | None = None
        end = token.end
        if self.has("@"):
            self.take()
            when, end = self._time()
        return Branch("lookup", token.start, start, end, start, end, (token.frames, tree, when))

    def _time(self) -> tuple[int | str, int]:
        """Read a time as nanoseconds, never through a float, or one of the words."""
        sign = self.take().text if self.has("-", "+") else ""
        token = self.take()
        if token.kind == "name" and token.text in ("latest", "row") and not sign:
            return token.text, token.end
        if token.kind != "number" or token.unit not in TIME_UNITS:
            found = "" if token.kind == "end" else f", found {shown(token.text + token.unit)}"
            expected = "expected a time with its unit, 2.5s or 2500000000ns, or latest or row"
            raise CalcError(f"{expected}{found}", token.start)
        from frametool.frames.stamps import parse_stamp, whole_stamp

        written = TIME_UNITS[token.unit]
        if "e" in token.text.lower() and written.startswith("e"):
            raise CalcError(f"{shown(token.text + token.unit)}: write a time with an exponent in s", token.start)
        try:
            return whole_stamp(parse_stamp(f"{sign}{token.text}{written}")), token.end
        except ValueInvalid as error:
            raise CalcError(str(error), token.start) from None
