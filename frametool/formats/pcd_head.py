"""The header of a PCD file: what its fields are, how many points there are, how they are written.

    # .PCD v0.7 - Point Cloud Data file format
    VERSION 0.7
    FIELDS x y z intensity
    SIZE 4 4 4 4
    TYPE F F F F
    COUNT 1 1 1 1
    WIDTH 640
    HEIGHT 480
    VIEWPOINT 0 0 0 1 0 0 0
    POINTS 307200
    DATA binary

Metres; VIEWPOINT is the pose of the sensor in the frame of the points, tx ty tz qw qx qy qz.  COLUMNS is an older word
for FIELDS; files before 0.7 have no VIEWPOINT, some no COUNT.  A field called `_` is padding.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, ValueInvalid, listing, shown
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import BinaryIO, NoReturn

LONGEST = 1 << 20  # bytes of a header: a hundred times what the longest known has
DATA = ("ascii", "binary", "binary_compressed")
TYPES = {"F": (4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}
PADDING = "_"
_KEYS = (
    "VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA",
)  # fmt: skip
_VERSIONS = (".5", "0.5", ".6", "0.6", ".7", "0.7")
_MOST_POINTS = 1 << 62
_WIDEST = 1 << 16  # values of one point


class PcdField(NamedTuple):
    """A field of each point: its name, its type as a letter, the bytes of one value, how many values it has."""

    name: str
    kind: str
    size: int
    values: int

    @property
    def code(self) -> str:
        """Return the type of one value as numpy writes it: PCD is little-endian."""
        return f"<{self.kind.lower()}{self.size}"


class PcdHead(NamedTuple):
    """What a header says.

    text: the header byte for byte, its last line end included
    words_at: for each key where the words behind it begin and end in `text`
    viewpoint: seven numbers; None where there are none
    """

    text: bytes
    words_at: Mapping[str, tuple[int, int]]
    fields: tuple[PcdField, ...]
    points: int
    data: str
    viewpoint: tuple[float, ...] | None = None

    def rewritten(self, words: Mapping[str, str]) -> bytes:
        """Return the header with other words behind some keys, those that it has."""
        text = self.text
        for key in sorted(words.keys() & self.words_at.keys(), key=lambda key: self.words_at[key], reverse=True):
            begin, end = self.words_at[key]
            text = text[:begin] + words[key].encode() + text[end:]
        return text


def fields_as_words(fields: Sequence[PcdField]) -> dict[str, str]:
    """Return the words of a header that say what its fields are."""
    return {
        "FIELDS": " ".join(field.name for field in fields),
        "SIZE": " ".join(str(field.size) for field in fields),
        "TYPE": " ".join(field.kind for field in fields),
        "COUNT": " ".join(str(field.values) for field in fields),
    }


def points_as_words(count: int) -> dict[str, str]:
    """Return the words of a header that say how many points there are, in no grid."""
    return {"WIDTH": str(count), "HEIGHT": "1", "POINTS": str(count)}


class _Line(NamedTuple):
    """The words behind a key, its line, and where the words begin and end in the header."""

    words: list[str]
    number: int
    begin: int
    end: int


def read_pcd_head(stream: BinaryIO, source: str) -> PcdHead:
    """Read a header and leave the stream behind it; raises FormatError that says line, value and remedy."""
    text, lines = _lines(stream, source)
    header = _Header(lines, source)
    words_at = {key: (line.begin, line.end) for key, line in lines.items()}
    return PcdHead(text, words_at, header.fields(), header.points(), header.data(), header.viewpoint())


def _lines(stream: BinaryIO, source: str) -> tuple[bytes, dict[str, _Line]]:
    """Read up to the line of DATA."""
    text = b""
    lines: dict[str, _Line] = {}
    number = 0
    while "DATA" not in lines:
        line = stream.readline(LONGEST)
        number += 1
        if not line:
            raise FormatError("the header ends before its DATA line; is the file whole?", source=source, line=number)
        begin = len(text)
        text += line
        if len(text) > LONGEST:
            raise FormatError("no DATA line in the first megabyte: this is no PCD file", source=source, line=number)
        if line.startswith(b"#") or not line.strip():
            continue
        words = line.decode("latin-1").split()
        key = words[0].upper()
        if key not in _KEYS:
            raise FormatError(
                f"{shown(words[0])} is no key of a PCD header; keys: {listing(_KEYS)}", source=source, line=number
            )
        key = "FIELDS" if key == "COLUMNS" else key
        if key in lines:
            raise FormatError(f"{key} stands twice, first on line {lines[key].number}", source=source, line=number)
        first = re.match(rb"\s*\S+\s*", line)
        behind = begin + len(line.rstrip())
        lines[key] = _Line(words[1:], number, min(begin + (first.end() if first else 0), behind), behind)
    return text, lines


class _Header:
    """The lines of a header, and what they mean."""

    def __init__(self, lines: dict[str, _Line], source: str) -> None:
        """Look at what has to be there; raises FormatError."""
        self.lines = lines
        self.source = source
        missing = [key for key in ("FIELDS", "SIZE", "TYPE") if key not in lines]
        if "POINTS" not in lines and not {"WIDTH", "HEIGHT"} <= set(lines):
            missing.append("POINTS")
        if missing:
            raise FormatError(f"the header has no {', '.join(missing)}", source=source, line=lines["DATA"].number)
        version = lines.get("VERSION")
        if version and " ".join(version.words) not in _VERSIONS:
            self.refuse("VERSION", f"version {shown(' '.join(version.words))} is not known; versions: 0.5, 0.6, 0.7")

    def refuse(self, key: str, message: str) -> NoReturn:
        """Raise the error for a line."""
        raise FormatError(message, source=self.source, line=self.lines[key].number)

    def data(self) -> str:
        """Return how the points are written."""
        word = " ".join(self.lines["DATA"].words).lower()
        if word not in DATA:
            self.refuse("DATA", f"DATA {shown(word)} is not known; known: {', '.join(DATA)}")
        return word

    def fields(self) -> tuple[PcdField, ...]:
        """Return the fields of a point."""
        names = self.lines["FIELDS"].words
        sizes, kinds = self._each("SIZE", names), [each.upper() for each in self._each("TYPE", names)]
        counts = self._each("COUNT", names) if "COUNT" in self.lines else ["1"] * len(names)
        if not names:
            self.refuse("FIELDS", "FIELDS names no field")
        for name in names:
            if name != PADDING and names.count(name) > 1:
                self.refuse("FIELDS", f"field {shown(name)} stands twice")
        found = []
        for name, kind, size, count in zip(names, kinds, sizes, counts, strict=True):
            if kind not in TYPES:
                self.refuse("TYPE", f"TYPE {shown(kind)} of field {shown(name)} is not known; known: F, I, U")
            if size not in map(str, TYPES[kind]):
                known = ", ".join(map(str, TYPES[kind]))
                self.refuse("SIZE", f"SIZE {shown(size)} of field {shown(name)}: TYPE {kind} has {known}")
            found.append(PcdField(name, kind, int(size), self._whole("COUNT", count, f" of field {shown(name)}")))
        if sum(field.values for field in found) > _WIDEST:
            self.refuse("COUNT", f"more than {_WIDEST} values a point")
        return tuple(found)

    def _each(self, key: str, names: list[str]) -> list[str]:
        """Return the words of a line that has one for each field."""
        words = self.lines[key].words
        if len(words) != len(names):
            self.refuse(key, f"{key} has {len(words)} values for {len(names)} fields")
        return words

    def _whole(self, key: str, word: str, of: str = "") -> int:
        """Read a count."""
        if not (word.isascii() and word.isdecimal()) or len(word) > 19 or int(word) > _MOST_POINTS:
            self.refuse(key, f"{key} {shown(word)}{of} is no count")
        return int(word)

    def _count(self, key: str) -> int | None:
        """Read the one number of a line, if it is there."""
        if key not in self.lines:
            return None
        words = self.lines[key].words
        if len(words) != 1:
            self.refuse(key, f"{key} has {len(words)} values, expected 1")
        return self._whole(key, words[0])

    def points(self) -> int:
        """Return how many points there are; WIDTH, HEIGHT and POINTS have to agree."""
        width, height, points = self._count("WIDTH"), self._count("HEIGHT"), self._count("POINTS")
        if width is None or height is None:
            return points or 0
        if points is None:
            return width * height
        if points != width * height:
            both = f"WIDTH {width} times HEIGHT {height} is {width * height}"
            self.refuse("POINTS", f"POINTS is {points}, {both}; correct the one that is wrong")
        return points

    def viewpoint(self) -> tuple[float, ...] | None:
        """Return the numbers of VIEWPOINT, if it is there."""
        line = self.lines.get("VIEWPOINT")
        if line is None:
            return None
        if len(line.words) != 7:
            self.refuse("VIEWPOINT", f"VIEWPOINT has {len(line.words)} numbers, expected 7 (tx ty tz qw qx qy qz)")
        try:
            return tuple(parse_number(word) for word in line.words)
        except ValueInvalid as error:
            self.refuse("VIEWPOINT", f"VIEWPOINT: {error}")
