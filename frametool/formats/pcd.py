"""PCD, the point clouds of PCL: x y z in metres, normals, and other fields, which pass byte for byte.

Read: `ascii`, `binary`, and `binary_compressed`, which is written as `binary`.  VIEWPOINT moves with the points.
What the header says is in `frametool.formats.pcd_head`.
"""

from __future__ import annotations

import struct
from itertools import count as numbers_from
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FormatError, ValueInvalid, shown, warn
from frametool.formats.declared import check_declared, read_exactly, rows_of_batch
from frametool.formats.lzf import unpack
from frametool.formats.npy import record_batches
from frametool.formats.pcd_head import PADDING, PcdField, fields_as_words, points_as_words, read_pcd_head
from frametool.formats.structured import StructuredBatch, StructuredWriter
from frametool.formats.text_rows import TextRows, TextWriter, same_columns
from frametool.geometry import floats, quaternion, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.documents.input_file import InputFile
    from frametool.formats.column_file import Batch, ColumnWriter, Kind, OutColumn
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style

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
