"""PLY, polygons and point clouds: the vertices move, and their normals turn; all else passes byte for byte.

Read: `ascii`, `binary_little_endian`, `binary_big_endian`.  Rotations of Gaussian splats, rot_0 .. rot_3 (w x y z, of
any norm), turn too; their spherical harmonics do not, which is told.  The header is in `frametool.formats.rows.ply`.

The header of a PLY file: its elements in order, their properties, and how they are written.

    ply
    format binary_little_endian 1.0
    comment made by hand
    element vertex 3
    property float x
    property float y
    property float z
    element face 1
    property list uchar int vertex_indices
    end_header

Numbers are in the unit of whoever wrote them, metres for point clouds.

The elements of a binary PLY file that pass: where rows end is followed, so that a file that is cut is noticed.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from frametool.errors import FormatError, ValueInvalid, listing, shown, warn
from frametool.formats.rows.ascii_rows import TextRows, TextWriter, same_columns
from frametool.formats.rows.npy import record_batches
from frametool.formats.rows.structured import (
    StructuredWriter,
    bytes_left,
    check_declared,
    pieces,
    read_exactly,
    rows_of_batch,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from typing import BinaryIO

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Batch, ColumnWriter, Kind, OutColumn
    from frametool.formats.rows.structured import StructuredBatch
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style

    Fail = Callable[[str], FormatError]

LONGEST = 1 << 20  # bytes of a header
FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
VERTEX = "vertex"
_MOST = 1 << 62


class PlyElement(NamedTuple):
    """One element of a file.

    instances: how many there are; line: where it stands in the header
    layout: of each property its name, the type of a value, and of a list the type of what counts it, else ""
    """

    name: str
    instances: int
    layout: tuple[tuple[str, str, str], ...] = ()
    line: int = 0

    @property
    def properties(self) -> tuple[tuple[str, str], ...]:
        """Return the properties as (name, type); "" for the type of a list."""
        return tuple((name, "" if counted else code) for name, code, counted in self.layout)

    @property
    def lists(self) -> list[str]:
        """Name the properties that are lists, whose size is not known beforehand."""
        return [name for name, code in self.properties if not code]

    @property
    def size(self) -> int:
        """Return how many bytes one of them has where none of its properties is a list."""
        return sum(int(code[1:]) for _, code in self.properties if code)


class PlyHead(NamedTuple):
    """What a header says; `text` is the header byte for byte, its last line end included.

    form: a key of FORMS
    """

    text: bytes
    form: str
    elements: tuple[PlyElement, ...]

    @property
    def order(self) -> str:
        """Return the byte order as numpy writes it, "" for text."""
        return FORMS[self.form]

    def vertex(self, source: str) -> tuple[tuple[PlyElement, ...], PlyElement]:
        """Return the elements before the vertices, and these; raises FormatError where they cannot be reached."""
        at = next((at for at, each in enumerate(self.elements) if each.name == VERTEX), None)
        if at is None:
            names = listing(each.name for each in self.elements) or "none"
            raise FormatError(f"no element {VERTEX!r}; elements: {names}", source=source)
        before, vertex = self.elements[:at], self.elements[at]
        if vertex.lists:
            raise FormatError(
                f"the list {shown(vertex.lists[0])} within {VERTEX!r} is not read; write it as an element of its own, "
                "or leave it out",
                source=source,
                line=vertex.line,
            )
        for each in before:
            if self.order and each.lists and each.instances:
                raise FormatError(
                    f"element {shown(each.name)} with the list {shown(each.lists[0])} stands before {VERTEX!r}; "
                    f"write {VERTEX!r} first, or the file as ascii",
                    source=source,
                    line=each.line,
                )
        return before, vertex


def read_ply_head(stream: BinaryIO, source: str) -> PlyHead:
    """Read a header and leave the stream behind it; raises FormatError that says line, value and remedy."""
    text = stream.readline(64)
    if text.rstrip(b"\r\n") != b"ply" or not text.endswith(b"\n"):
        raise FormatError("the first line of a PLY file is `ply`, and it ends in a line feed", source=source, line=1)
    form, elements, number = "", list[PlyElement](), 1

    def fail(message: str) -> FormatError:
        return FormatError(message, source=source, line=number)

    while True:
        line = stream.readline(LONGEST)
        number += 1
        text += line
        if not line or len(text) > LONGEST:
            raise fail("the header ends before its `end_header` line; is the file whole?")
        words = line.decode("latin-1").split()
        word = words[0] if words else "comment"
        if word in ("comment", "obj_info"):
            continue
        if word == "end_header":
            break
        if word == "format":
            if form or len(words) != 3 or words[1] not in FORMS or words[2] != "1.0":
                raise fail(f"{shown(' '.join(words))}: expected one format: {', '.join(FORMS)}, and 1.0")
            form = words[1]
        elif word == "element":
            elements.append(_element(words, elements, number, fail))
        elif word == "property":
            if not elements:
                raise fail("a property before the first element")
            elements[-1] = _with_property(elements[-1], words, fail)
        else:
            known = "format, element, property, comment, obj_info, end_header"
            raise fail(f"{shown(word)} is no key of a PLY header; keys: {known}")
    if not form:
        raise fail(f"the header has no format; formats: {', '.join(FORMS)}")
    return PlyHead(text, form, tuple(elements))


def _element(words: Sequence[str], before: Sequence[PlyElement], line: int, fail: Fail) -> PlyElement:
    """Read `element NAME COUNT`."""
    if len(words) != 3:
        raise fail(f"{shown(' '.join(words))}: expected element NAME COUNT")
    _, name, count = words
    if not (count.isascii() and count.isdecimal()) or len(count) > 19 or int(count) > _MOST:
        raise fail(f"{shown(count)} of element {shown(name)} is no count")
    if any(each.name == name for each in before):
        raise fail(f"element {shown(name)} stands twice")
    return PlyElement(name, int(count), line=line)


def _with_property(element: PlyElement, words: Sequence[str], fail: Fail) -> PlyElement:
    """Read `property TYPE NAME` or `property list TYPE TYPE NAME`."""
    is_list = words[1:2] == ["list"]
    types = words[2:4] if is_list else words[1:2]
    if len(words) != (5 if is_list else 3):
        raise fail(f"{shown(' '.join(words))}: expected property TYPE NAME, or property list TYPE TYPE NAME")
    for each in types:
        if each not in TYPES:
            raise fail(f"{shown(each)} is no type; types: {', '.join(TYPES)}")
    name = words[-1]
    if any(name == known for known, _ in element.properties):
        raise fail(f"property {shown(name)} of {shown(element.name)} stands twice")
    codes = [TYPES[each] for each in types]
    if is_list and codes[0][0] == "f":
        raise fail(f"{shown(types[0])} counts the values of a list; it has to be an integer")
    return element._replace(layout=(*element.layout, (name, codes[-1], codes[0] if is_list else "")))


_SHORT = 16  # rows of one length that are followed one by one before more are looked at together
_LOST = "the rest of the file does not fit its header: {}; is it whole?"


class PlyRows:
    """Follow the rows of elements through a stream of bytes that passes."""

    def __init__(self, elements: Sequence[PlyElement], order: str, source: str) -> None:
        """Take the elements in their order; order: of their bytes, as numpy writes it."""
        self.waiting = [each for each in elements if each.instances]
        self.ends: Literal["little", "big"] = "little" if order == "<" else "big"
        self.of: PlyElement | None = None
        self.sizes: list[tuple[int, int, bool]] = []
        self.source = source
        self.left = self.waiting[0].instances if self.waiting else 0
        self.kept = b""  # the beginning of a row that is not whole yet
        self.skipped = 0  # bytes that still belong to a row, or to rows of one size

    def passing(self, pieces: Iterable[bytes]) -> Iterator[bytes]:
        """Yield the pieces; raises FormatError where they end too early, or go on behind the last row."""
        for piece in pieces:
            self._take(piece)
            yield piece
        self._finish()

    def _finish(self) -> None:
        """Check that all rows came, and nothing behind them."""
        self._take(b"")
        if self.waiting or self.skipped:
            raise FormatError(_LOST.format("it ends too early"), source=self.source)
        if self.kept.strip():
            raise FormatError(_LOST.format(f"{len(self.kept)} bytes too many"), source=self.source)

    def _take(self, piece: bytes) -> None:
        """Follow the rows through a piece."""
        if self.skipped >= len(piece):
            self.skipped -= len(piece)
            piece = b""
        elif self.skipped:
            piece = piece[self.skipped :]
            self.skipped = 0
        data = self.kept + piece
        at = 0
        while self.waiting and not self.skipped:
            element = self.waiting[0]
            end = self._rows(element, data, at) if element.lists else at + self.left * element.size
            if not element.lists:
                self.left = 0
            if not self.left:
                self.waiting.pop(0)
                self.left = self.waiting[0].instances if self.waiting else 0
            elif end == at:
                break
            self.skipped = max(end - len(data), 0)
            at = min(end, len(data))
        self.kept = data[at:]

    def _rows(self, element: PlyElement, data: bytes, at: int) -> int:
        """Return where the rows of an element end that begin in the data, which may be behind it; count them."""
        alike, size = 0, 0
        while self.left and at <= len(data):
            end = self._row(element, data, at)
            if end is None:
                break
            alike = alike + 1 if end - at == size else 1
            size = end - at
            rows = 1
            if alike >= _SHORT and (rows := self._alike(element, data, at, size, 8 * alike)) == 0:
                rows = 1
            alike += rows - 1
            at += rows * size
            self.left -= rows
        return at

    def _row(self, element: PlyElement, data: bytes, at: int) -> int | None:
        """Return where a row ends; None if the data does not say it."""
        for width, counted, is_signed in self._sizes(element):
            if not counted:
                at += width
                continue
            if at + counted > len(data):
                return None
            count = data[at] if counted == 1 else int.from_bytes(data[at : at + counted], self.ends)
            if is_signed and count >> (8 * counted - 1):
                said = f"a list in {element.name!r} has fewer than no values"
                raise FormatError(_LOST.format(said), source=self.source)
            at += counted + count * width
        return at

    def _sizes(self, element: PlyElement) -> list[tuple[int, int, bool]]:
        """Return the bytes of a value of each property, those of what counts a list (0: it is none), and its sign."""
        if element is not self.of:
            self.of = element
            self.sizes = [
                (int(code[1:]), int(counted[1:] or 0), counted[:1] == "i") for _, code, counted in element.layout
            ]
        return self.sizes

    def _alike(self, element: PlyElement, data: bytes, at: int, size: int, most: int) -> int:
        """Count the rows from a place on whose lists are as long as those of the first: most meshes have triangles.

        size: that of the first; most: no more rows are looked at.  Returns 0 where there are too few to look at.
        """
        rows = min((len(data) - at) // size, self.left, most)
        if rows < _SHORT:
            return 0
        table = np.frombuffer(data, np.uint8, rows * size, at).reshape(rows, size)
        same = np.ones(rows, np.bool_)
        place = 0
        for width, counted, _ in self._sizes(element):
            if counted:
                found = table[:, place : place + counted]
                same &= (found == found[0]).all(axis=1)
                place += counted + int.from_bytes(found[0].tobytes(), self.ends) * width
            else:
                place += width
        return rows if same.all() else int(np.argmin(same))


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
