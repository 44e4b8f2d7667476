"""PLY, polygons and point clouds: the vertices move, and their normals turn; all else passes byte for byte.

Read: `ascii`, `binary_little_endian`, `binary_big_endian`.  Rotations of Gaussian splats, rot_0 .. rot_3 (w x y z, of
any norm), turn too; their spherical harmonics do not, which is told.  The header is in `frametool.formats.ply_head`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import FormatError, ValueInvalid, shown, warn
from frametool.formats.declared import bytes_left, check_declared, pieces, read_exactly, rows_of_batch
from frametool.formats.npy import record_batches
from frametool.formats.ply_elements import PlyRows
from frametool.formats.ply_head import TYPES, read_ply_head
from frametool.formats.structured import StructuredWriter
from frametool.formats.text_rows import TextRows, TextWriter, same_columns

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.documents.input_file import InputFile
    from frametool.formats.column_file import Batch, ColumnWriter, Kind, OutColumn
    from frametool.formats.structured import StructuredBatch
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style

NORMALS: tuple[tuple[str, ...], ...] = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"))
SPLAT = ("rot_1", "rot_2", "rot_3", "rot_0")  # x y z w
HARMONICS = "f_rest_0"
_NAMES = {code: name for name, code in reversed(TYPES.items())}
_NOT_COMMON = ("i8", "u8")  # read where somebody wrote them, never chosen
_CODES = {"b1": "u1", "f2": "f4"}


class PlyFile:
    """A cloud, or the vertices of a mesh, read one batch after the other."""

    vectors = NORMALS
    gaps = True

    def __init__(self, file: InputFile) -> None:
        """Read the header and what stands before the vertices; raises FormatError."""
        self.file = file
        self.head = read_ply_head(file.stream, file.name)
        before, self.vertex = self.head.vertex(file.name)
        self.is_last = self.head.elements[-1] is self.vertex
        self.names: tuple[str, ...] = tuple(name for name, _ in self.vertex.properties)
        self.width = len(self.names)
        kinds = [np.dtype((self.head.order or "<") + code) for _, code in self.vertex.properties]
        self.record = np.dtype([(f"{place}", kind) for place, kind in enumerate(kinds)])
        self.turn: tuple[float, ...] | None = None
        self.text: TextRows | None = None
        self.behind = b""
        count = self.vertex.instances
        if self.head.order:
            self.before = self._skipped(sum(each.instances * each.size for each in before))
            check_declared(file, count, self.record.itemsize, "vertices", last=self.is_last)
        else:
            line = self.head.text.count(b"\n") + 1
            self.before = self._lines(sum(each.instances for each in before))
            line += self.before.count(b"\n")
            if not self.width:
                raise FormatError(f"the {count} vertices have no properties", source=file.name)
            self.text = TextRows(file, self.names, kinds, range(self.width), self.width, count, line)

    def _skipped(self, size: int) -> bytes:
        """Read the elements before the vertices."""
        left = bytes_left(self.file.stream)
        if left is not None and left < size:
            raise FormatError(f"the file ends before its vertices, {size - left} bytes early", source=self.file.name)
        return read_exactly(self.file, size, "the elements before the vertices")

    def _lines(self, count: int) -> bytes:
        """Read the lines of the elements before the vertices."""
        lines: list[bytes] = []
        while count and (line := self.file.stream.readline()):
            lines.append(line)
            count -= bool(line.strip())
        if count:
            raise FormatError(f"the file ends before its vertices, {count} lines early", source=self.file.name)
        return b"".join(lines)

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers."""
        return self.record[place]

    def moved_by(self, pose: Rigid | None) -> None:
        """Turn the rotations of splats with the pose that moves all points; None: there is no such one."""
        name = self.file.name
        turns = pose is None or pose[6] * pose[6] < 1.0
        if not turns or not set(SPLAT) <= set(self.names):
            return
        if pose is None or self.text is not None or any(self._code(each)[0] != "f" for each in SPLAT):
            why = "not all points are moved by the same pose" if pose is None else "only binary files are turned"
            warn(f"{name}: rot_0 .. rot_3, the rotations of splats, are left as they are: {why}")
            return
        self.turn = pose[3:]
        if HARMONICS in self.names:
            warn(f"{name}: f_rest_*, spherical harmonics, are left as they are: colours keep to the old axes")

    def _code(self, name: str) -> str:
        return dict(self.vertex.properties)[name]

    def batches(self) -> Iterator[Batch]:
        """Yield the vertices; raises FormatError where the file ends too early, or holds more."""
        if self.text is not None:
            yield from self.text.batches()
            if self.is_last:
                self.behind = self.text.check_end()
            return
        size = self.record.itemsize
        for batch in record_batches(self.file, self.record, self.vertex.instances, rows_of_batch(size)):
            if self.turn is not None:
                self._turn_splats(batch, self.turn)
            yield batch
        if self.is_last:
            self.behind = self.file.stream.read(size)
            if size and len(self.behind) == size:
                said = f"the header says {self.vertex.instances} vertices, more follow"
                raise FormatError(said, source=self.file.name)

    def _turn_splats(self, batch: StructuredBatch, turn: Sequence[float]) -> None:
        """Multiply rotations from the left, in place: the Hamilton product, which keeps their norms."""
        fields = [f"{self.names.index(name)}" for name in SPLAT]
        bx, by, bz, bw = (batch.rows[field].astype(np.float64) for field in fields)
        ax, ay, az, aw = turn
        turned = (
            aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz,
        )  # fmt: skip
        for field, values in zip(fields, turned, strict=True):
            batch.rows[field] = values

    def rest(self) -> Iterable[bytes]:
        """Yield what stands behind the vertices."""
        if self.is_last:
            return (self.behind,)
        if self.text is not None:
            return self._counted(self.text)
        behind = self.head.elements[self.head.elements.index(self.vertex) + 1 :]
        return PlyRows(behind, self.head.order, self.file.name).passing(pieces(self.file.stream))

    def _counted(self, text: TextRows) -> Iterator[bytes]:
        """Yield the lines of the other elements; raises FormatError where there are not as many as the header says."""
        at = self.head.elements.index(self.vertex)
        expected = sum(each.instances for each in self.head.elements[at + 1 :])
        lines, begun = 0, b""
        for piece in text.behind():
            yield piece
            *whole, begun = (begun + piece).split(b"\n")
            lines += sum(map(bool, map(bytes.strip, whole)))
        lines += bool(begun.strip())
        if lines != expected:
            said = f"behind the vertices stand {lines} lines, the header says {expected}; correct the header"
            raise FormatError(said, source=self.file.name)

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes a file of the same kind."""
        count = None if drops else self.vertex.instances

        def head(vertices: int) -> bytes:
            return self._head(columns, vertices) + self.before

        if self.text is not None:
            return TextWriter(columns, self.width, style, head=head, count=count, behind=self.rest)
        kind = self.record
        if not same_columns(columns, self.width):
            kinds = [(f"{at}", self._kind_of(column)) for at, column in enumerate(columns)]
            kind = np.dtype(kinds)
        return PlyWriter(columns, self.record.names or (), kind, count=count, head=head, rest=self.rest)

    def _kind_of(self, column: OutColumn) -> Kind:
        return np.dtype(self.head.order + code_of(column))

    def _head(self, columns: Sequence[OutColumn], count: int) -> bytes:
        """Return the header with what changed in it: how many vertices there are, and their properties."""
        text = self.head.text
        if count != self.vertex.instances:
            if not self.is_last:
                names = ", ".join(shown(each.name) for each in self.head.elements if each is not self.vertex)
                raise ValueInvalid(f"vertices cannot be left out: other elements count them ({names})")
            text = re.sub(rb"(?m)^(\s*element\s+vertex\s+)\d+", rb"\g<1>%d" % count, text, count=1)
        if same_columns(columns, self.width):
            return text
        lines = text.splitlines(keepends=True)
        first = self.vertex.line
        last = first
        while lines[last].split()[:1] in ([b"property"], [b"comment"], [b"obj_info"], []):
            last += 1
        others = [line for line in lines[first:last] if line.split()[:1] != [b"property"]]
        end = b"\r\n" if lines[0].endswith(b"\r\n") else b"\n"
        return b"".join([*lines[:first], *(each + end for each in properties(columns)), *others, *lines[last:]])


class PlyWriter(StructuredWriter):
    """Write vertices as binary PLY."""

    def __init__(
        self, columns: Sequence[OutColumn], fields: Sequence[str], kind: Kind, *, count: int | None,
        head: Callable[[int], bytes], rest: Callable[[], Iterable[bytes]] = tuple,
    ) -> None:  # fmt: skip
        """Take what makes the header for so many vertices, and what yields all that stands behind them."""
        super().__init__(columns, fields, kind, count=count)
        self.head_of = head
        self.rest = rest

    def head(self, count: int) -> bytes:
        """Return the header."""
        return self.head_of(count)

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last batch; all, if the vertices had to be counted first."""
        ended = super().end()
        yield from (ended,) if isinstance(ended, bytes) else ended
        yield from self.rest()


def code_of(column: OutColumn) -> str:
    """Return the type of a column without its byte order; raises ValueInvalid for what PLY cannot hold."""
    if column.kind is None:
        raise ValueInvalid(f"ply holds numbers; column {shown(column.name)} of texts has no place in it")
    code = column.kind.str[1:]
    code = _CODES.get(code, code)
    if code not in _NAMES or (code in _NOT_COMMON and column.passed is None):
        raise ValueInvalid(f"ply has no type for {column.kind}, that of column {shown(column.name)}")
    return code


def properties(columns: Sequence[OutColumn]) -> Iterator[bytes]:
    """Yield the lines of a header that name columns; raises ValueInvalid for a name of several words."""
    for column in columns:
        if not column.name or column.name.split() != [column.name]:
            raise ValueInvalid(f"{shown(column.name)} cannot be the name of a property of ply: one word without blanks")
        yield f"property {_NAMES[code_of(column)]} {column.name}".encode()


def open_columns(file: InputFile, options: Options) -> PlyFile:
    """Open a cloud; raises FormatError."""
    del options
    return PlyFile(file)


def create(columns: Sequence[OutColumn], count: int | None, style: Style) -> PlyWriter:
    """Return what writes points made elsewhere, with numbers of the types they have."""
    del style
    kind = np.dtype([(f"{at}", f"<{code_of(column)}") for at, column in enumerate(columns)])
    lines = b"".join(each + b"\n" for each in properties(columns))

    def head(vertices: int) -> bytes:
        return b"ply\nformat binary_little_endian 1.0\nelement vertex %d\n%send_header\n" % (vertices, lines)

    return PlyWriter(columns, (), kind, count=count, head=head)
