"""The pieces a row's text is made of: stretches of the input, numbers of the result, constant text."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias


class In(NamedTuple):
    """A stretch of the input, by its index among the spans a format found."""

    part: int


class Out(NamedTuple):
    """Numbers of the result, from the first up to before the last, each followed by `between` but for the last."""

    first: int
    last: int
    between: bytes = b","


class Word(NamedTuple):
    """A number of the result as the word that it stands for, between quotes or not: the zone of UTM."""

    number: int
    words: tuple[str, ...]
    quote: bytes = b""

    def text(self, number: float) -> bytes:
        """Return the word of a number."""
        return self.quote + self.words[int(number)].encode() + self.quote


class Item(Word):
    """A number of a list with what stands around it, or another text where it is none.

    words: the text before it, the one behind it, the other one, and the format of the number
    """

    def text(self, number: float) -> bytes:
        """Return the text of a number."""
        before, behind, other, form = self.words
        if number != number:  # noqa: PLR0124 - nan
            return other.encode()
        text = format(number, form)
        return f"{before}{text if '.' in text else text.replace('e', self.quote.decode())}{behind}".encode()


class Instead(NamedTuple):
    """A name of the result in place of a stretch of the input, which stays where there is no result."""

    part: int
    new: int


class Renamed(NamedTuple):
    """The name of a frame in the result, in place of the one that begins at `at` in the text that was learned."""

    at: int
    text: bytes


class Const(NamedTuple):
    """The same text in every row."""

    text: bytes


class IfLocked(NamedTuple):
    """Text that stands only in rows whose angles are not unique."""

    text: bytes


Piece: TypeAlias = In | Out | Const | IfLocked | Instead | Word | Renamed
