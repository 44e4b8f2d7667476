"""Where in a row the results go: which columns stay, which are replaced, and the pieces that its text is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from frametool.errors import Misused

if TYPE_CHECKING:
    from collections.abc import Sequence


class In(NamedTuple):
    """A stretch of the input, by its index among the spans a format found."""

    part: int


class Out(NamedTuple):
    """Numbers of the result, from the first up to before the last, each followed by `between` but for the last."""

    first: int
    last: int
    between: bytes = b","


class Word(NamedTuple):
    """A number of the result as the word that it encodes, between quotes or not: the zone of UTM."""

    number: int
    words: tuple[str, ...]
    quote: bytes = b""

    def text(self, number: float) -> bytes:
        """Return the word of a number."""
        return self.quote + self.words[int(number)].encode() + self.quote


class Item(Word):
    """A number of a list with what is around it, or another text where it is not a number.

    words: the text before it, the one behind it, the other one, and the format of the number
    """

    def text(self, number: float) -> bytes:
        """Return the text of a number."""
        before, behind, other, fmt = self.words
        if number != number:  # noqa: PLR0124 - nan
            return other.encode()
        return f"{before}{number_text(number, fmt, self.quote.decode())}{behind}".encode()


def number_text(number: float, fmt: str, exponent: str) -> str:
    """Write a number in a format of Python's; exponent: what 1e-05 has for its e, in YAML `.0e`."""
    text = format(number, fmt)
    return text if "." in text else text.replace("e", exponent)


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
    """Text that is only in rows whose angles are not unique."""

    text: bytes


Piece: TypeAlias = In | Out | Const | IfLocked | Instead | Word | Renamed


Stretch: TypeAlias = tuple[int, int, str, str]


class Kept(NamedTuple):
    """A column of the input."""

    place: int


class New(NamedTuple):
    """A number of the result, under its name; words: those that it encodes."""

    number: int
    name: str
    words: tuple[str, ...] = ()


class Fixed(NamedTuple):
    """The same word in every row of the result, under a name."""

    word: str
    name: str


class Named(NamedTuple):
    """A frame's name in place of a column: the result's parent or what it is the pose of."""

    place: int
    role: int


PARENT, NAME = 0, 1  # roles of names
NAMED = "named"  # a stretch that is no text of the input but the name of a role


Column: TypeAlias = Kept | New | Fixed | Named
ADDED = (New, Fixed)  # no columns of the input


class Layout(NamedTuple):
    """The columns of the output, and from where in a row its pieces come.

    places: the columns our numbers are read from; time: that of the stamps; below: that of the
        nanoseconds of stamps whose seconds are whole
    frames: those that name the frame a row is expressed in, for look-ups the two frames
    name: the one that says what a row is the pose of
    stretches: (first, last column, where it begins, where it ends) of the text that passes
    """

    columns: tuple[Column, ...]
    places: tuple[int, ...]
    frames: tuple[int, ...]
    stretches: tuple[Stretch, ...]
    time: int | None = None
    below: int | None = None
    name: int | None = None


def quoted(name: str, delimiter: bytes) -> bytes:
    """Write a cell, in quotes where a reader would split it."""
    text = name.encode()
    if delimiter and any(mark in text for mark in (delimiter, b'"', b"\n", b"\r")):
        return b'"' + text.replace(b'"', b'""') + b'"'
    return text


def lay_out(columns: Sequence[Column], width: int, delimiter: bytes) -> tuple[tuple[Piece, ...], tuple[Stretch, ...]]:
    """Make the pieces of a row out of its columns, as few as can be: neighbours that pass are one stretch."""
    between = delimiter or b" "
    pieces: list[Piece] = []
    stretches: list[Stretch] = []
    groups: list[list[Column]] = []
    for column in columns:  # columns that follow one another, and numbers that do, go together
        before = groups[-1][-1] if groups else None
        goes_on = isinstance(before, Kept) and isinstance(column, Kept) and column.place == before.place + 1
        if isinstance(before, New) and isinstance(column, New) and not (column.words or before.words):
            goes_on = column.number == before.number + 1
        if goes_on:
            groups[-1].append(column)
        else:
            groups.append([column])
    for at, group in enumerate(groups):
        first, last = group[0], at == len(groups) - 1
        follows = not last and not isinstance(groups[at + 1][0], Kept)
        if isinstance(first, Kept):
            end = first.place + len(group) - 1
            ending = "line" if last and end == width - 1 else "gap" if follows and end < width - 1 else "cell"
            begin = "line" if not at and not first.place else "gap" if at and first.place else "cell"
            stretches.append((first.place, end, begin, ending))
            pieces.append(In(len(stretches) - 1))
            follows = follows and end == width - 1
        elif isinstance(first, Named):
            stretches += [(first.place, first.place, "cell", "cell"), (first.role, first.role, NAMED, NAMED)]
            pieces.append(Instead(len(stretches) - 2, len(stretches) - 1))
        elif isinstance(first, Fixed):
            pieces.append(Const(first.word.encode()))
        else:
            run = Out(first.number, first.number + len(group), between)
            pieces.append(Word(first.number, first.words) if first.words else run)
        if follows:
            pieces.append(Const(between))
    if not stretches or stretches[-1][3] != "line":
        stretches.append((width - 1, width - 1, "end", "line"))
        pieces.append(In(len(stretches) - 1))
    return tuple(pieces), tuple(stretches)


def refuse_repeated(columns: Sequence[Column], names: Sequence[str]) -> None:
    """Raise Misused if a new column would be called as one that stays, or as another new one."""
    new = [column.name for column in columns if isinstance(column, ADDED)]
    kept = [names[column.place] for column in columns if not isinstance(column, ADDED)]
    if len({*new}) < len(new):
        twice = sorted({name for name in new if new.count(name) > 1})
        if {"x", "y", "z"} <= {*twice}:
            hint = "a point with a weight: --columns x,y,z; a rotation: name it qx, qy, qz, qw"
            raise Misused(f"columns x, y, z, w are a quaternion, its position would have their names; {hint}")
        raise Misused(f"--to: columns {', '.join(twice)} would appear twice")
    clash = sorted(set(new).intersection(kept))
    if clash:
        raise Misused(f"columns {', '.join(clash)} would appear twice; name the new ones with --prefix")
