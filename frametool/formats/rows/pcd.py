"""PCD, the point clouds of PCL: x y z in metres, normals, and other fields, which are preserved byte for byte.

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

Reads `ascii`, `binary`, and `binary_compressed` (LZF), which is written as `binary`.  VIEWPOINT is the pose of the
sensor in the frame of the points, tx ty tz qw qx qy qz, and is transformed with them.  COLUMNS is an older word for
FIELDS; files before 0.7 have no VIEWPOINT, some no COUNT.  A field named `_` is padding.
"""

from __future__ import annotations

import re
import struct
from collections import Counter
from functools import partial
from io import BytesIO
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.documents.source import InputFile
from frametool.errors import FormatError, ValueInvalid, listing, shown, warn
from frametool.formats.rows import column_file
from frametool.formats.rows.clouds import CloudFile, count_in, head_lines, misfit_of, same_columns, type_in
from frametool.geometry import floats, quaternion, rigid
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.rows.column_file import Batch, Kind, OutColumn
    from frametool.geometry import Components, Rigid
    from frametool.grammar.result import Style

DATA = ("ascii", "binary", "binary_compressed")
TYPES = {"F": (4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}
CODES = {f"{letter.lower()}{size}": (size, letter) for letter, sizes in TYPES.items() for size in sizes}
CODES |= {"f2": (4, "F"), "b1": (1, "U")}  # numpy's types, and the PCD types that hold their values
PADDING = "_"
EMPTY = (
    b"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS _\nSIZE 1\nTYPE U\nCOUNT 1\n"
    b"WIDTH 0\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 0\nDATA binary\n"
)
_EACH = ("FIELDS", "SIZE", "TYPE", "COUNT")
_KEYS = ("VERSION", "COLUMNS", *_EACH, "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
_WIDEST = 1 << 16  # values of one point


class PcdField(NamedTuple):
    """A field of each point: its name, the bytes of one value, its type as a letter, the number of its values."""

    name: str
    size: int
    kind: str
    values: int

    @property
    def code(self) -> str:
        """Return the type of one value in numpy's notation: PCD is little-endian."""
        return f"<{self.kind.lower()}{self.size}"


def layout_of(fields: Sequence[PcdField]) -> tuple[list[str], list[int], Kind]:
    """Return the columns of fields, one per value: their names, their positions in a row, and the type of a point.

    Padding is not a column, but occupies bytes.
    """
    values = [(field, place) for field in fields for place in range(field.values)]
    offsets = [0, *accumulate(field.size for field, _ in values)]
    used = [(at, field, place) for at, (field, place) in enumerate(values) if field.name != PADDING]
    record = np.dtype({
        "names": [f"{number}" for number in range(len(used))],
        "formats": [field.code for _, field, _ in used],
        "offsets": [offsets[at] for at, _, _ in used],
        "itemsize": offsets[-1],
    })  # fmt: skip
    names = [field.name if field.values == 1 else f"{field.name}_{place}" for _, field, place in used]
    return names, [at for at, _, _ in used], record


def viewpoint_words(pose: Rigid) -> str:
    """Format the pose of a sensor as the values of VIEWPOINT: tx ty tz qw qx qy qz."""
    tx, ty, tz, x, y, z, w = pose
    x, y, z, w = quaternion.from_quaternion(x, y, z, w, floats)
    return " ".join(repr(each + 0.0) for each in (tx, ty, tz, w, x, y, z))


MOST = 88  # maximum expansion of one packed byte: three make up to 264


def unpack(packed: bytes, size: int) -> bytearray:
    """Decompress data of LZF to `size` bytes.

    A control byte below 32 is a number of literal bytes minus one.  Otherwise its upper three bits are a length
    minus two (seven: the next byte is added), its lower five the upper bits of a distance minus one, whose lower eight
    follow.  Memory grows with the data, never with `size`.
    Raises ValueInvalid for invalid data, or another size.
    Source: liblzf, lzf_d.c.
    """
    if size > MOST * len(packed):
        raise ValueInvalid(f"{len(packed)} packed bytes cannot hold {size}")
    out, at, end = bytearray(), 0, len(packed)
    try:
        while at < end and len(out) <= size:  # the hot loop
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
                raise ValueInvalid("it refers to bytes before its beginning")
            if distance >= length:
                out += out[start : start + length]
            else:  # the run overlaps its own output
                part = out[start:]
                out += (part * (length // distance + 1))[:length]
    except IndexError:
        at = end + 1
    if at > end:
        raise ValueInvalid("it ends in the middle of a run")
    if len(out) != size:
        raise ValueInvalid(f"it makes {'only' if len(out) < size else 'at least'} {len(out)} bytes, not {size}")
    return out


class PcdFile(CloudFile):
    """A cloud whose points are read in batches.

    text: the header byte for byte, including its last line end
    words: the values of each key; lines: the line number of each key
    sensor: the seven numbers of VIEWPOINT, None without it; viewpoint: the new values as text, "" if unchanged
    grid: the new WIDTH and HEIGHT if the number of points changes; None for a single row
    """

    viewpoint = ""
    grid: tuple[int, int] | None = None
    sensor: tuple[float, ...] | None = None

    def __init__(self, file: InputFile) -> None:
        """Read the header and check it against the file; raises FormatError with line, value and remedy."""
        self.file, text = file, list[bytes]()
        self.words: dict[str, list[str]] = {}
        self.lines: dict[str, int] = {}
        for words in head_lines(file, text, "DATA"):
            if words[0].startswith("#"):
                continue
            if (key := words[0].upper()) not in _KEYS:
                raise file.error(f"{shown(words[0])} is not a key of a PCD header; keys: {listing(_KEYS)}", len(text))
            if (key := "FIELDS" if key == "COLUMNS" else key) in self.lines:
                raise file.error(f"{key} appears twice, first on line {self.lines[key]}", len(text))
            self.lines[key], self.words[key] = len(text), words[1:]
            if key == "DATA":
                break
        self.text = b"".join(text)
        missing = [key for key in ("FIELDS", "SIZE", "TYPE") if key not in self.lines]
        if "POINTS" not in self.lines and not {"WIDTH", "HEIGHT"} <= set(self.lines):
            missing.append("POINTS")
        if missing:
            raise self._problem("DATA", f"the header has no {', '.join(missing)}")
        self.fields = self._read_fields()
        sizes = {key: " ".join(self.words[key]) for key in ("WIDTH", "HEIGHT", "POINTS") if key in self.words}
        counts = {key: count_in(text, f"{key} {shown(text)}", file, self.lines[key]) for key, text in sizes.items()}
        if {"WIDTH", "HEIGHT"} <= counts.keys():
            points = counts["WIDTH"] * counts["HEIGHT"]
            if counts.setdefault("POINTS", points) != points:
                both = f"WIDTH {counts['WIDTH']} times HEIGHT {counts['HEIGHT']} is {points}"
                raise self._problem("POINTS", f"POINTS is {counts['POINTS']}, {both}; correct the one that is wrong")
        self.data = " ".join(self.words["DATA"]).lower()
        if self.data not in DATA:
            raise self._problem("DATA", f"DATA {shown(self.data)} is not known; known: {', '.join(DATA)}")
        if (sensor := self.words.get("VIEWPOINT")) is not None:
            if len(sensor) != 7:
                found = f"VIEWPOINT has {len(sensor)} numbers, expected 7 (tx ty tz qw qx qy qz)"
                raise self._problem("VIEWPOINT", found)
            try:
                self.sensor = tuple(map(parse_number, sensor))
            except ValueInvalid as error:
                raise self._problem("VIEWPOINT", f"VIEWPOINT: {error}") from None
        names, cells, record = layout_of(self.fields)
        super().__init__(file, names, record, counts["POINTS"])
        if self.data == "binary":
            column_file.check_declared(file, self.count, self.record.itemsize, self.what, last=True)
        elif self.data == "ascii":
            self.at, self.cells = cells, sum(field.values for field in self.fields)
            self.line = self.text.count(b"\n") + 1

    def _problem(self, key: str, message: str) -> FormatError:
        """Return an error at the line of a key."""
        return self.file.error(message, self.lines.get(key, 0))

    def _read_fields(self) -> tuple[PcdField, ...]:
        """Return the fields of a point."""
        names, fields = self.words["FIELDS"], list[PcdField]()
        others = {key: self.words.get(key, ["1"] * len(names)) for key in _EACH[1:]}
        for key, words in others.items():
            if len(words) != len(names):
                raise self._problem(key, f"{key} has {len(words)} values for {len(names)} fields")
        if not names:
            raise self._problem("FIELDS", "FIELDS names no field")
        for name, times in Counter(names).items():
            if name != PADDING and times > 1:
                raise self._problem("FIELDS", f"field {shown(name)} appears twice")
        for name, size, letter, values in zip(names, *others.values(), strict=True):
            of, kind = f" of field {shown(name)}", letter.upper()
            if size not in map(str, TYPES.get(kind, ())):
                known = "; ".join(f"{each} with {', '.join(map(str, sizes))}" for each, sizes in TYPES.items())
                found = f"TYPE {shown(kind)} with SIZE {shown(size)}{of}"
                raise self._problem("SIZE" if kind in TYPES else "TYPE", f"{found} is not known; known: {known}")
            count = count_in(values, f"COUNT {shown(values)}{of}", self.file, self.lines.get("COUNT", 0))
            fields.append(PcdField(name, int(size), kind, count))
        if sum(field.values for field in fields) > _WIDEST:
            raise self._problem("COUNT", f"more than {_WIDEST} values a point")
        return tuple(fields)

    def moved_by(self, pose: Components | None) -> None:
        """Transform VIEWPOINT by the pose that transforms all points; with a warning if it is left unchanged.

        pose: None if the points do not share one
        """
        if self.sensor is None:
            return
        name = self.file.name
        if pose is None:
            warn(f"{name}: VIEWPOINT is left as it is: not all points are moved by the same pose")
            return
        tx, ty, tz, w, x, y, z = self.sensor
        if quaternion.complaint(x, y, z, w):
            warn(f"{name}: VIEWPOINT is left as it is: {w:g} {x:g} {y:g} {z:g} is not a rotation")
            return
        moved = rigid.compose_full(pose, (tx, ty, tz, *quaternion.repaired(x, y, z, w, floats)))
        self.viewpoint = viewpoint_words(rigid.pose_of(moved))

    def batches(self) -> Iterator[Batch]:
        """Yield the points; raises FormatError if the file ends too early, or has more.

        Packed columns are stored field by field, possibly with padding.
        """
        if self.data != "binary_compressed":
            yield from super().batches()
            return
        if not self.count:
            return
        file, points, fields = self.file, self.count, self.fields
        packed_size, size = struct.unpack("<II", column_file.read_exactly(file, 8, "the sizes behind DATA"))
        if size != points * self.record.itemsize:
            fields = tuple(field for field in fields if field.name != PADDING)
            plain = sum(field.size * field.values for field in fields)
            if size != points * plain:
                raise file.error(f"the header says {points} points of {plain} bytes, the packed data says {size} bytes")
        packed = column_file.read_exactly(file, packed_size, "the packed points")
        if file.stream.read(1):
            raise file.error("more bytes follow the packed points")
        try:
            data = np.frombuffer(unpack(packed, size), np.uint8)
        except ValueInvalid as error:
            raise file.error(f"the packed points cannot be unpacked: {error}") from None
        columns, at = list[Any](), 0
        for field in fields:
            end = at + points * field.values * field.size
            if field.name != PADDING:
                columns.extend(data[at:end].view(field.code).reshape(points, field.values).T)
            at = end
        step = column_file.rows_of_batch(self.record.itemsize)
        for first in range(0, points, step):
            rows = np.zeros(min(step, points - first), self.record)
            for name, values in zip(self.record.names or (), columns, strict=True):
                rows[name] = values[first : first + step]
            yield column_file.StructuredBatch(rows)

    def _fields_of(self, columns: Sequence[OutColumn]) -> tuple[PcdField, ...]:
        """Return the fields of an output: the input's and new ones, or one per column if the input's columns change.

        Raises ValueInvalid for types that PCD lacks.
        """
        known = self.fields if same_columns(columns[: self.width], self.width) else ()
        new = columns[self.width * bool(known) :]
        return (*known, *(PcdField(column.name, *type_in("pcd", CODES, column, PADDING), 1) for column in new))

    def record_with(self, columns: Sequence[OutColumn]) -> Kind:
        """Return the type of a point with other columns."""
        return layout_of(self._fields_of(columns))[2]

    def header(self, columns: Sequence[OutColumn], count: int) -> bytes:
        """Return the header with new values; everything else is unchanged."""
        fields = self._fields_of(columns)
        words = {"VIEWPOINT": self.viewpoint} if self.viewpoint else {}
        if self.data == "binary_compressed":
            warn(f"{self.file.name}: binary_compressed is written as binary")
            words["DATA"] = "binary"
        if fields != self.fields:
            words |= {key: " ".join(str(field[at]) for field in fields) for at, key in enumerate(_EACH)}
        if count != self.count:
            width, height = self.grid or (count, 1)
            words |= {"WIDTH": f"{width}", "HEIGHT": f"{height}", "POINTS": f"{count}"}
        lines = self.text.split(b"\n")
        for key in words.keys() & self.lines.keys():
            at = self.lines[key] - 1
            first, last = re.match(rb"\s*\S+\s+", lines[at]), len(lines[at].rstrip())
            lines[at] = lines[at][: first.end() if first else last] + words[key].encode() + lines[at][last:]
        return b"\n".join(lines)


def create(
    columns: Sequence[OutColumn], count: int | None, style: Style, *, grid: tuple[int, int] | None = None,
    sensor: Rigid | None = None,
) -> column_file.CountedWriter:  # fmt: skip
    """Return a writer for new points: a new file with these columns, whose numbers keep their types.

    grid: the number of points per row, and of rows; sensor: the sensor's pose in the frame of the points
    """
    file = PcdFile(InputFile("pcd", BytesIO(EMPTY)))
    file.fields, file.grid, file.viewpoint = (), grid, viewpoint_words(sensor) if sensor else ""
    return file.rewriter(columns, count, style)


open_columns, misfit = PcdFile, partial(misfit_of, CODES, taken=PADDING)
