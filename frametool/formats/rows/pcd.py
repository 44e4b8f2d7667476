"""PCD, the point clouds of PCL: x y z in metres, normals, and other fields, which pass byte for byte.

Read: `ascii`, `binary`, and `binary_compressed`, which is written as `binary`.  VIEWPOINT moves with the points.
What the header says is in `frametool.formats.rows.pcd`.

The header of a PCD file: what its fields are, how many points there are, how they are written.

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

LZF, the compression of `binary_compressed` PCD files: unpacking only.

A control byte below 32 says how many bytes follow as they are, less one.  Else its upper three bits are a length less
two (seven: the next byte is added) and its lower five the upper bits of a distance less one, whose lower eight follow.
Source: liblzf, lzf_d.c.
"""

from __future__ import annotations

import re
import struct
from itertools import count as numbers_from
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FormatError, ValueInvalid, listing, shown, warn
from frametool.formats.rows.ascii_rows import TextRows, TextWriter, same_columns
from frametool.formats.rows.npy import record_batches
from frametool.formats.rows.structured import (
    StructuredBatch,
    StructuredWriter,
    check_declared,
    read_exactly,
    rows_of_batch,
)
from frametool.geometry import floats, quaternion, rigid
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from typing import BinaryIO, NoReturn

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Batch, ColumnWriter, Kind, OutColumn
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style

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


MOST = 88  # bytes that one packed byte may stand for: three make up to 264
_TORN = "it ends in the middle of a run"


def unpack(packed: bytes, size: int) -> bytearray:
    """Return the `size` bytes that were packed.

    Memory grows with what is there, never with `size`.
    Raises ValueInvalid for what was not packed so, or makes more or fewer bytes.
    """
    if size > MOST * len(packed):
        raise ValueInvalid(f"{len(packed)} packed bytes cannot hold {size}")
    out = bytearray()
    try:
        at = _unpack(packed, size, out)
    except IndexError:
        raise ValueInvalid(_TORN) from None
    if len(out) != size or at > len(packed):
        raise ValueInvalid(_TORN if at > len(packed) else f"it makes {_count(out, size)} bytes, not {size}")
    return out


def _count(out: bytearray, size: int) -> str:
    return f"only {len(out)}" if len(out) < size else f"at least {len(out)}"


def _unpack(packed: bytes, size: int, out: bytearray) -> int:
    """Append runs until all is read or too much is there; return where reading ended.  The hot loop."""
    at, end = 0, len(packed)
    while at < end and len(out) <= size:
        control = packed[at]
        at += 1
        if control < 32:
            next_at = at + control + 1
            out += packed[at:next_at]
            at = next_at
            continue
        length = control >> 5
        if length == 7:
            length += packed[at]
            at += 1
        length += 2
        distance = ((control & 31) << 8) + packed[at] + 1
        at += 1
        start = len(out) - distance
        if start < 0:
            raise ValueInvalid("it refers to what stands before its beginning")
        if distance >= length:
            out += out[start : start + length]
        else:  # the run overlaps what it makes
            part = out[start:]
            out += (part * (length // distance + 1))[:length]
    return at


NORMALS: tuple[tuple[str, ...], ...] = (("normal_x", "normal_y", "normal_z"), ("nx", "ny", "nz"))
KINDS = {"f": "F", "i": "I", "u": "U", "b": "U"}
_BEGIN = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
_FIELD_KEYS = ("FIELDS", "SIZE", "TYPE", "COUNT")
_HALF = 2  # bytes of a float that PCD has no type for


class PcdColumn:
    """A column of a cloud: the field it belongs to, its name, its type, where it stands among the cells of a row."""

    def __init__(self, field: PcdField, name: str, cell: int) -> None:
        """Take one value of a field."""
        self.field = field
        self.name = name
        self.kind: Kind = np.dtype(field.code)
        self.cell = cell


class PcdFile:
    """A cloud whose points are read one batch after the other."""

    vectors = NORMALS
    gaps = True

    def __init__(self, file: InputFile) -> None:
        """Read the header and hold it against the file; raises FormatError."""
        self.file = file
        self.head = read_pcd_head(file.stream, file.name)
        self.columns, self.record = _columns_of(self.head.fields, padded=True)
        self.names: tuple[str, ...] = tuple(column.name for column in self.columns)
        self.width = len(self.columns)
        self.text: TextRows | None = None
        self.viewpoint = ""
        self.behind = b""
        if self.head.data == "binary":
            check_declared(file, self.head.points, self.record.itemsize, "points", last=True)
        elif self.head.data == "ascii":
            line = self.head.text.count(b"\n") + 1
            kinds = [column.kind for column in self.columns]
            cells = [column.cell for column in self.columns]
            every = sum(field.values for field in self.head.fields)
            self.text = TextRows(file, self.names, kinds, cells, every, self.head.points, line)

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers."""
        return self.columns[place].kind

    def moved_by(self, pose: Rigid | None) -> None:
        """Move VIEWPOINT by the pose that moves all points; None: there is no such one."""
        given = self.head.viewpoint
        if given is None:
            return
        name = self.file.name
        if pose is None:
            warn(f"{name}: VIEWPOINT is left as it is: not all points are moved by the same pose")
            return
        tx, ty, tz, w, x, y, z = given
        if quaternion.complaint(x, y, z, w):
            warn(f"{name}: VIEWPOINT is left as it is: {' '.join(f'{each:g}' for each in given[3:])} is no rotation")
            return
        self.viewpoint = viewpoint_words(rigid.compose(*pose, tx, ty, tz, *quaternion.repaired(x, y, z, w, floats)))

    def batches(self) -> Iterator[Batch]:
        """Yield the points; raises FormatError where the file ends too early, or holds more."""
        head, file = self.head, self.file
        if self.text is not None:
            yield from self.text.batches()
            self.behind = self.text.check_end()
        elif head.data == "binary":
            yield from record_batches(file, self.record, head.points, rows_of_batch(self.record.itemsize))
            self.behind = file.stream.read(self.record.itemsize)
            if len(self.behind) == self.record.itemsize and self.behind:
                raise FormatError(f"the header says {head.points} points, more follow", source=file.name)
        elif head.points:
            yield from self._unpacked()

    def _unpacked(self) -> Iterator[StructuredBatch]:
        """Yield the points of packed columns, which follow one another."""
        file, points = self.file, self.head.points
        packed_size, size = struct.unpack("<II", read_exactly(file, 8, "the sizes behind DATA"))
        plain = _columns_of(self.head.fields, padded=False)[1].itemsize
        padded = size == points * self.record.itemsize
        if not padded and size != points * plain:
            raise FormatError(
                f"the header says {points} points of {plain} bytes, the packed data says {size} bytes", source=file.name
            )
        packed = read_exactly(file, packed_size, "the packed points")
        if file.stream.read(1):
            raise FormatError("more bytes follow the packed points", source=file.name)
        try:
            data = unpack(packed, size)
        except ValueInvalid as error:
            raise FormatError(f"the packed points cannot be unpacked: {error}", source=file.name) from None
        del packed
        values = self._by_field(np.frombuffer(data, np.uint8), padded=padded)
        step = rows_of_batch(self.record.itemsize)
        for first in range(0, points, step):
            rows = np.zeros(min(step, points - first), self.record)
            for name, each in values.items():
                rows[name] = each[first : first + step]
            yield StructuredBatch(rows, self.record.names or ())

    def _by_field(self, data: Any, *, padded: bool) -> dict[str, Any]:
        """Return the numbers of each column, which stand field by field."""
        found: dict[str, Any] = {}
        at, column = 0, 0
        for field in self.head.fields:
            if field.name == PADDING and not padded:
                continue
            size = self.head.points * field.values * field.size
            table = data[at : at + size].view(field.code).reshape(-1, field.values)
            at += size
            for place in range(field.values if field.name != PADDING else 0):
                found[f"{column}"] = table[:, place]
                column += 1
        return found

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes a cloud of the same kind."""
        count = None if drops else self.head.points
        if self.text is not None:
            fields = self.head.fields + tuple(_new_field(column) for column in columns[self.width :])
            head = _Rewritten(self, fields)
            return TextWriter(columns, self.width, style, head=head, count=count, behind=lambda: (self.behind,))
        same = same_columns(columns, self.width)
        fields = self.head.fields if same else self._fields(columns)
        kind = self.record if same else _columns_of(fields, padded=True)[1]
        return PcdWriter(
            columns, self.record.names or (), kind, count=count, head=_Rewritten(self, fields), cloud=self
        )

    def _fields(self, columns: Sequence[OutColumn]) -> tuple[PcdField, ...]:
        """Return the fields of an output; columns of one field that stay together stay one."""
        found: list[PcdField] = []
        places = [column.passed for column in columns]
        at = 0
        while at < len(columns):
            passed = places[at]
            field = None if passed is None else self.columns[passed].field
            if passed is not None and field is not None and field.values > 1:
                whole = [place for place, each in enumerate(self.columns) if each.field is field]
                if places[at : at + field.values] == whole:
                    found.append(field)
                    at += field.values
                    continue
            found.append(_new_field(columns[at]))
            at += 1
        return tuple(found)


class _Rewritten:
    """The header of a cloud with what changed in it."""

    def __init__(self, cloud: PcdFile, fields: tuple[PcdField, ...]) -> None:
        """Take the fields of the output."""
        self.cloud = cloud
        self.fields = fields

    def __call__(self, count: int) -> bytes:
        """Return it for so many points; what is as it was stays byte for byte."""
        head = self.cloud.head
        words: dict[str, str] = {}
        if self.cloud.viewpoint:
            words["VIEWPOINT"] = self.cloud.viewpoint
        if head.data == "binary_compressed":
            warn(f"{self.cloud.file.name}: binary_compressed is written as binary")
            words["DATA"] = "binary"
        if self.fields != head.fields:
            words |= fields_as_words(self.fields)
        if count != head.points:
            words |= points_as_words(count)
        return head.rewritten(words)


class PcdWriter(StructuredWriter):
    """Write points as binary PCD."""

    def __init__(
        self, columns: Sequence[OutColumn], fields: Sequence[str], kind: Kind, *, count: int | None,
        head: Callable[[int], bytes] | None = None, cloud: PcdFile | None = None,
    ) -> None:  # fmt: skip
        """Take what makes the header for so many points, and the cloud that they come from; without it `words` do."""
        super().__init__(columns, fields, kind, count=count)
        self.head_of = head
        self.cloud = cloud
        self.words: dict[str, str] = {}

    def head(self, count: int) -> bytes:
        """Return the header."""
        if self.head_of is not None:
            return self.head_of(count)
        words = {"WIDTH": str(count), "HEIGHT": "1", "VIEWPOINT": "0 0 0 1 0 0 0"} | self.words
        words |= {"POINTS": str(count), "DATA": "binary"}
        order = (*_FIELD_KEYS, "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
        return (_BEGIN + "".join(f"{key} {words[key]}\n" for key in order)).encode()

    def tail(self) -> bytes:
        """Return what stands behind the points: less than one."""
        return self.cloud.behind if self.cloud else b""


def viewpoint_words(pose: Rigid) -> str:
    """Return the pose of a sensor as the words of VIEWPOINT: tx ty tz qw qx qy qz."""
    tx, ty, tz, x, y, z, w = pose
    x, y, z, w = quaternion.from_quaternion(x, y, z, w, floats)
    return " ".join(repr(each + 0.0) for each in (tx, ty, tz, w, x, y, z))


def _columns_of(fields: Sequence[PcdField], *, padded: bool) -> tuple[list[PcdColumn], Kind]:
    """Return the columns, each value of a field one, and the type of a point; padding is none, and room where asked."""
    columns: list[PcdColumn] = []
    offsets: list[int] = []
    at, cell = 0, 0
    for field in fields:
        if field.name == PADDING:
            at += field.size * field.values * padded
            cell += field.values
            continue
        for place in range(field.values):
            columns.append(PcdColumn(field, field.name if field.values == 1 else f"{field.name}_{place}", cell))
            offsets.append(at)
            at += field.size
            cell += 1
    names = [f"{number}" for number in range(len(columns))]
    formats = [column.kind for column in columns]
    return columns, np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": at})


def _new_field(column: OutColumn) -> PcdField:
    """Return the field of a column; raises ValueInvalid for what PCD cannot hold."""
    kind = column.kind
    if kind is None:
        raise ValueInvalid(f"pcd holds numbers; column {shown(column.name)} of texts has no place in it")
    if kind.kind not in KINDS or kind.itemsize > 8:
        raise ValueInvalid(f"pcd has no type for {kind}, that of column {shown(column.name)}")
    if not column.name or column.name.split() != [column.name] or column.name == PADDING:
        raise ValueInvalid(f"{shown(column.name)} cannot be the name of a field of pcd: one word without blanks")
    size = 4 if kind.kind == "f" and kind.itemsize == _HALF else kind.itemsize
    return PcdField(column.name, KINDS[kind.kind], size, 1)


def open_columns(file: InputFile, options: Options) -> PcdFile:
    """Open a cloud; raises FormatError."""
    del options
    return PcdFile(file)


def create(columns: Sequence[OutColumn], count: int | None, style: Style) -> PcdWriter:
    """Return what writes points made elsewhere, with numbers of the types they have."""
    del style
    named = named_xyz(columns)
    fields = [_new_field(column) for column in named]
    writer = PcdWriter(named, (), _columns_of(fields, padded=True)[1], count=count)
    writer.words |= fields_as_words(fields)
    return writer


def named_xyz(columns: Sequence[OutColumn]) -> list[OutColumn]:
    """Return the columns, with names for those that have none."""
    names = iter(numbers_from(1))
    return [each if each.name else each._replace(name=f"column_{next(names)}") for each in columns]
