"""The pieces that the text of a row is assembled from: unchanged stretches of the input, and parts of the result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.errors import NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


class In(NamedTuple):
    """An unchanged stretch of the input; part: its key in `Block.parts`."""

    part: Any


class Out(NamedTuple):
    """Numbers `first` to `last` - 1 of the result, with `between` after each but the last."""

    first: int
    last: int
    between: bytes = b","


class Word(NamedTuple):
    """A number of the result that is written as a word, such as a UTM zone; text: converts it, also nan."""

    number: int
    text: Callable[[float], bytes]


def one_of(words: Sequence[str], quote: bytes = b"", null: bytes = b"") -> Callable[[float], bytes]:
    """Return a function that writes a number as the word with this index, with `quote` around it; `null` for nan."""
    return lambda number: quote + words[int(number)].encode() + quote if number == number else null  # noqa: PLR0124 - nan


class Renamed(NamedTuple):
    """The name of a frame of the result, for the name at offset `at` of the text that a template was learned from."""

    at: int
    text: bytes


class Const(NamedTuple):
    """Text that is the same in every row."""

    text: bytes


class IfLocked(NamedTuple):
    """Text that is written only in rows whose Euler angles are not unique."""

    text: bytes


Piece: TypeAlias = In | Out | Const | IfLocked | Word | Renamed
