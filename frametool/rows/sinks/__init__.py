"""The pieces that the text of a row is made of: what stays of the input, and what stands in it of the result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.errors import NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


class In(NamedTuple):
    """A stretch of the input, by its key among the spans a format found."""

    part: Any


class Out(NamedTuple):
    """Numbers of the result, from the first up to before the last, each followed by `between` but for the last."""

    first: int
    last: int
    between: bytes = b","


class Word(NamedTuple):
    """A number of the result in other words than digits; nan is a row without it."""

    number: int
    text: Callable[[float], bytes]


def one_of(words: Sequence[str], quote: bytes = b"", null: bytes = b"") -> Callable[[float], bytes]:
    """Return what writes a number as the word that it encodes, between quotes or not: the zone of UTM."""
    return lambda number: quote + words[int(number)].encode() + quote if number == number else null  # noqa: PLR0124 - nan


class Renamed(NamedTuple):
    """The name of a frame in the result, in place of the one that begins at `at` in the text that was learned."""

    at: int
    text: bytes


class Const(NamedTuple):
    """The same text in every row."""

    text: bytes


class IfLocked(NamedTuple):
    """Text that is only in rows whose angles are not unique."""

    text: bytes


Piece: TypeAlias = In | Out | Const | IfLocked | Word | Renamed
