"""PLY, polygons and point clouds: vertices and their normals are transformed; everything else is preserved.

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

Reads `ascii`, `binary_little_endian`, `binary_big_endian`; the unit is that of the author, metres for point clouds.
Rotations of Gaussian splats, rot_0 .. rot_3 (w x y z, of any norm), are rotated too; their spherical harmonics are
not, with a warning.
"""

from __future__ import annotations

import re
from functools import partial
from itertools import chain, takewhile
from math import log
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, listing, shown, warn
from frametool.formats.rows import clouds, column_file
from frametool.geometry.rigid import EXACT, SCALED
from frametool.grammar.readers import NORMALS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Batch, Kind, OutColumn
    from frametool.geometry.types import Components
    from frametool.grammar.result import Style

FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
NAMES = {code: name for name, code in reversed(TYPES.items())}
NEW_NAMES = {code: name for code, name in NAMES.items() if code not in ("i8", "u8")}  # not every tool reads these
NEW_NAMES |= {"b1": "uchar", "f2": "float"}
VERTEX = "vertex"
OWN_LINES: tuple[list[bytes], ...] = ([b"property"], [b"comment"], [b"obj_info"], [])  # of an element
SPLAT = ("rot_1", "rot_2", "rot_3", "rot_0")  # x y z w


class PlyElement(NamedTuple):
    """One element of a file.

    instances: their number; line: in the header
    properties: by name the type of a value, and for a list the type of its count, else ""
    """

    name: str
    instances: int
    line: int
    properties: dict[str, tuple[str, str]]

    @property
    def lists(self) -> list[str]:
        """Return the properties that are lists, whose size is not known beforehand."""
        return [name for name, (_, counted) in self.properties.items() if counted]


def read_head(file: InputFile) -> tuple[bytes, str, list[PlyElement]]:
    """Read a header, up to the data; raises FormatError with line, value and remedy."""
    if (first := file.stream.readline(64)).strip() != b"ply" or not first.endswith(b"\n"):
        raise file.error("the first line of a PLY file is `ply`, and it ends in a line feed", 1)
    fmt, elements, text = "", dict[str, PlyElement](), [first]
    for words in clouds.head_lines(file, text, "`end_header`"):
        line, said = len(text), shown(" ".join(words))
        match words:
            case ["comment" | "obj_info", *_]:
                continue
            case ["end_header", *_]:
                break
            case ["format", name, "1.0"] if name in FORMS and not fmt:
                fmt = name
            case ["format", *_]:
                raise file.error(f"{said}: expected one format: {', '.join(FORMS)}, and 1.0", line)
            case ["element", name, number]:
                count = clouds.count_in(number, f"{shown(number)} of element {shown(name)}", file, line)
                element = PlyElement(name, count, line, {})
                if elements.setdefault(name, element) is not element:
                    raise file.error(f"element {shown(name)} appears twice", line)
            case ["element", *_]:
                raise file.error(f"{said}: expected element NAME COUNT", line)
            case ["property", *_] if not elements:
                raise file.error("a property before the first element", line)
            case ["property", *types, name] if len(types) == (3 if types[:1] == ["list"] else 1):
                types = types[-2:]  # of a list that of its count too
                if unknown := [each for each in types if each not in TYPES]:
                    raise file.error(f"{shown(unknown[0])} is not a type; types: {', '.join(TYPES)}", line)
                if name in element.properties:
                    raise file.error(f"property {shown(name)} of {shown(element.name)} appears twice", line)
                *counted, code = (TYPES[each] for each in types)
                if counted and counted[0][0] == "f":
                    raise file.error(f"{shown(types[0])} counts the values of a list; it has to be an integer", line)
                element.properties[name] = code, "".join(counted)
            case ["property", *_]:
                raise file.error(f"{said}: expected property TYPE NAME, or property list TYPE TYPE NAME", line)
            case [word, *_]:
                known = "format, element, property, comment, obj_info, end_header"
                raise file.error(f"{shown(word)} is not a key of a PLY header; keys: {known}", line)
    if not fmt:
        raise file.error(f"the header has no format; formats: {', '.join(FORMS)}", len(text))
    return b"".join(text), FORMS[fmt], list(elements.values())


class PlyFile(clouds.CloudFile):
    """A cloud, or the vertices of a mesh, read in batches."""

    vectors = NORMALS[::-1]
    what = "vertices"

    def __init__(self, file: InputFile) -> None:
        """Read the header and everything before the vertices; raises FormatError, also for lists on the way to them."""
        self.head, self.order, elements = read_head(file)
        at = next((at for at, each in enumerate(elements) if each.name == VERTEX), None)
        if at is None:
            names = listing(each.name for each in elements) or "none"
            raise file.error(f"no element {VERTEX!r}; elements: {names}")
        before, vertex, self.after = elements[:at], elements[at], elements[at + 1 :]
        self.others = before + self.after
        if vertex.lists:
            message = f"the list {shown(vertex.lists[0])} within {VERTEX!r} is not read"
            raise file.error(f"{message}; write it as an element of its own, or leave it out", vertex.line)
        for each in before:
            if self.order and each.lists and each.instances:
                message = f"element {shown(each.name)} with the list {shown(each.lists[0])} is before {VERTEX!r}"
                raise file.error(f"{message}; write {VERTEX!r} first, or the file as ascii", each.line)
        self.codes = {name: code for name, (code, _) in vertex.properties.items()}
        record = column_file.record_of((self.order or "<") + code for code in self.codes.values())
        super().__init__(file, self.codes, record, vertex.instances)
        self.own_line = vertex.line
        self.is_last = not self.after
        self.turn: tuple[float, ...] | None = None
        if self.order:
            sizes = (each.instances * sum(int(code[1:]) for code, _ in each.properties.values()) for each in before)
            self.before = column_file.read_exactly(file, sum(sizes), "the elements before the vertices")
            column_file.check_declared(file, self.count, record.itemsize, self.what, last=self.is_last)
            return
        lines, count = list[bytes](), sum(each.instances for each in before)
        while count and (line := file.stream.readline()):
            lines.append(line)
            count -= bool(line.strip())
        if count:
            raise file.error(f"the file ends before its vertices, {count} lines early")
        if not self.width:
            raise file.error(f"the {self.count} vertices have no properties")
        self.before = b"".join(lines)
        self.at, self.cells, self.line = range(self.width), self.width, (self.head + self.before).count(b"\n") + 1

    def moved_by(self, pose: Components | None) -> None:
        """Rotate splats by the pose that transforms all points; None: there is no such pose."""
        name = self.file.name
        if pose is not None and len(pose) == SCALED and "scale_0" in self.names:
            warn(f"{name}: scale_0 .. scale_2, the sizes of splats, are left as they are: add {log(pose[EXACT]):.9g}")
        turns = pose is None or pose[6] * pose[6] < 1.0
        if not turns or not set(SPLAT) <= set(self.names):
            return
        if pose is None or self.at is not None or any(self.codes[each][0] != "f" for each in SPLAT):
            why = "not all points are moved by the same pose" if pose is None else "only binary files are turned"
            warn(f"{name}: rot_0 .. rot_3, the rotations of splats, are left as they are: {why}")
            return
        self.turn = pose[3:EXACT]
        if "f_rest_0" in self.names:
            warn(f"{name}: f_rest_*, spherical harmonics, are left as they are: colours keep to the old axes")

    def batches(self) -> Iterator[Batch]:
        """Yield the vertices; raises FormatError if the file ends too early, or has more.

        Rotations of splats are multiplied from the left: the Hamilton product, which preserves their norms.
        """
        for batch in super().batches():
            if self.turn is not None:
                columns = [batch.column(self.names.index(name)) for name in SPLAT]
                bx, by, bz, bw = (column.astype(np.float64) for column in columns)
                ax, ay, az, aw = self.turn
                turned = (
                    aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                    aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz,
                )  # fmt: skip
                for column, values in zip(columns, turned, strict=True):
                    column[:] = values
            yield batch

    def rest(self) -> Iterator[bytes]:
        """Yield everything after the vertices; binary data are copied unchecked.

        Raises FormatError if there are more or fewer lines than the header says.
        """
        lines, begun = 0, b""
        for piece in chain((self.behind,), () if self.is_last else column_file.pieces(self.file.stream)):
            yield piece
            if self.at is not None:
                *whole, begun = (begun + piece).split(b"\n")
                lines += sum(map(bool, map(bytes.strip, whole)))
        lines += bool(begun.strip())
        expected = sum(each.instances for each in self.after)
        if self.at is not None and lines != expected:
            said = f"after the vertices there are {lines} lines, the header says {expected}; correct the header"
            raise self.file.error(said)

    def record_with(self, columns: Sequence[OutColumn]) -> Kind:
        """Return the type of a vertex with other columns."""
        return column_file.record_of(self.order + TYPES[_type_of(column)] for column in columns)

    def header(self, columns: Sequence[OutColumn], count: int) -> bytes:
        """Return the header with the number of vertices and their properties, and everything before them."""
        text = self.head
        if count != self.count:
            if not self.is_last:
                names = ", ".join(shown(each.name) for each in self.others)
                raise ValueInvalid(f"vertices cannot be left out: other elements count them ({names})")
            text = re.sub(rb"(?m)^(\s*element\s+vertex\s+)\d+", rb"\g<1>%d" % count, text, count=1)
        if not clouds.same_columns(columns, self.width):
            lines = text.splitlines(keepends=True)
            end = b"\r\n" if lines[0].endswith(b"\r\n") else b"\n"
            own = list(takewhile(lambda line: line.split()[:1] in OWN_LINES, lines[self.own_line :]))
            others = [line for line in own if line.split()[:1] != [b"property"]]
            made = [_property_line(column) + end for column in columns]
            text = b"".join([*lines[: self.own_line], *made, *others, *lines[self.own_line + len(own) :]])
        return text + self.before


def _type_of(column: OutColumn) -> str:
    """Return PLY's name for the type of a column; raises ValueInvalid for what PLY cannot hold."""
    return clouds.type_in("ply", NEW_NAMES if column.passed is None else NAMES, column)


def _property_line(column: OutColumn) -> bytes:
    return f"property {_type_of(column)} {column.name}".encode()


def create(columns: Sequence[OutColumn], count: int | None, _style: Style) -> column_file.CountedWriter:
    """Return a writer for new points, with numbers of their own types."""
    record = column_file.record_of(f"<{TYPES[_type_of(column)]}" for column in columns)
    lines = b"".join(_property_line(column) + b"\n" for column in columns)

    def head(vertices: int) -> bytes:
        return b"ply\nformat binary_little_endian 1.0\nelement vertex %d\n%send_header\n" % (vertices, lines)

    return column_file.CountedWriter(partial(column_file.encode_records, columns, record), head, count)


open_columns, misfit = PlyFile, partial(clouds.misfit_of, NEW_NAMES)
