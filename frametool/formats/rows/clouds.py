"""Read and write point clouds with a header: common parts of PCD and PLY, and PLY clouds and meshes.

Records are binary, or lines of numbers between blanks.  Unchanged data are preserved byte for byte: in text, blanks,
line ends and the digits of other columns too.  Of PLY, vertices and their normals are transformed:

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
from io import BytesIO
from itertools import chain, takewhile
from math import log
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from frametool.documents.source import InputFile
from frametool.errors import FormatError, ValueInvalid, listing, shown, warn
from frametool.formats.rows import column_file
from frametool.geometry.rigid import EXACT, SCALED
from frametool.grammar.readers import NORMALS
from frametool.text.lines import read_blocks
from frametool.text.numbers import explain_number
from frametool.text.parse import parse_floats
from frametool.text.spans import MARGIN, Cells, Spans, framed, join, split_blank
from frametool.text.write import float_spans, rounded_to_single

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from frametool.formats.rows.column_file import Batch, Kind, Made, OutColumn
    from frametool.geometry import Components
    from frametool.grammar.result import Style
    from frametool.text.spans import Floats, Ints

Code = TypeVar("Code")

LONGEST_HEAD = 1 << 20  # bytes of a header: a hundred times the longest known
_MOST_POINTS = 1 << 62
_NOT_FINITE = {"nan": np.nan, "inf": np.inf, "infinity": np.inf}


class CloudFile(column_file.RecordFile):
    """The points of a file whose header has been read: records, or rows of text.

    at: in text, the positions of the columns among the `cells` numbers of a row; None for records
    line: the line of the next row of text, from 1
    behind: bytes after the last point that were read with it
    header: function of columns and a row count that returns the new header and everything before the points; raises
        ValueInvalid
    record_with: function of columns that returns the type of a point; raises ValueInvalid for types the format lacks
    """

    vectors = NORMALS
    what = "points"  # in messages
    is_last = True  # nothing follows the points
    at: Sequence[int] | None = None
    cells = line = 0
    behind = b""
    names: tuple[str, ...]
    header: Callable[[Sequence[OutColumn], int], bytes]
    record_with: Callable[[Sequence[OutColumn]], Kind]

    def batches(self) -> Iterator[Batch]:
        """Yield the points; raises FormatError if the file ends too early, or has more."""
        yield from super().batches() if self.at is None else self._rows_of_text(self.at)
        if not self.is_last:
            return
        if self.at is None:
            self.behind = self.file.stream.read(self.record.itemsize)
            if self.behind and len(self.behind) == self.record.itemsize:
                raise self.file.error(f"the header says {self.count} {self.what}, more follow")
            return
        blanks = [self.behind]
        while not blanks[-1].strip() and (piece := self.file.stream.read(column_file.PIECE)):
            blanks.append(piece)
        if blanks[-1].strip():
            more = f"the header says {self.count} points, more rows follow; correct the header"
            raise self.file.error(more, self.line)
        self.behind = b"".join(blanks)

    def _rows_of_text(self, at: Sequence[int]) -> Iterator[TextBatch]:
        """Yield the rows; raises FormatError for a row with another number of cells, or if the file ends too early."""
        left = self.count
        for block in read_blocks(self.file.stream) if left else ():  # type: ignore[arg-type]
            cells = split_blank(block, self.cells, comment=b"")
            filled = np.flatnonzero(cells.counts)
            if len(filled) > left:
                end = int(cells.line_ends[filled[left - 1]]) - MARGIN
                self.behind = block[end:]
                cells = split_blank(block[:end], self.cells, comment=b"")
            wrong = np.flatnonzero((cells.counts != self.cells) & (cells.counts != 0))
            if wrong.size:
                columns = " ".join(self.names[:8]) + " .." * (self.cells > 8)
                found = f"expected {self.cells} numbers ({columns}), found {int(cells.counts[wrong[0]])}"
                raise self.file.error(found, self.line + int(wrong[0]))
            yield TextBatch(cells, self, at)
            self.line += len(cells.counts)
            left -= len(cells.rows)
            if not left:
                return
        if left:
            raise self.file.error(f"the header says {self.count} points, the file holds {self.count - left}")

    def rest(self) -> Iterator[bytes]:
        """Yield the rest of the file after the points."""
        yield self.behind

    def rewriter(self, columns: Sequence[OutColumn], count: int | None, style: Style) -> column_file.CountedWriter:
        """Return a writer for a cloud of the same format.

        Raises ValueInvalid for other columns in a text cloud.
        """
        encode: column_file.Encode = partial(encode_text, columns, style)
        own, new = columns[: self.width], columns[self.width :]
        if self.at is None:
            kind = self.record if same_columns(columns, self.width) else self.record_with(columns)
            encode = partial(column_file.encode_records, columns, kind)
        elif not same_columns(own, self.width) or any(column.passed is not None for column in new):
            raise ValueInvalid("columns of an ascii cloud stay as they are; -f csv writes others")
        return column_file.CountedWriter(encode, partial(self.header, columns), count, self.rest)


def same_columns(columns: Sequence[OutColumn], width: int) -> bool:
    """Return True if the columns of an output are those of the input, in the same order."""
    return len(columns) == width and all(column.passed in (None, at) for at, column in enumerate(columns))


def head_lines(file: InputFile, text: list[bytes], last: str) -> Iterator[list[str]]:
    """Yield the words of each line of a header; the lines are appended to `text`.

    last: the line that ends the header, for messages; raises FormatError if the file ends before it
    """
    size = sum(map(len, text))
    while True:
        text.append(line := file.stream.readline(LONGEST_HEAD))
        size += len(line)
        if not line:
            raise file.error(f"the header ends before its {last} line; is the file whole?", len(text))
        if size > LONGEST_HEAD:
            raise file.error(f"no {last} line in the first megabyte; is it a header?", len(text))
        if words := line.decode("latin-1").split():
            yield words


def count_in(word: str, what: str, file: InputFile, line: int) -> int:
    """Parse a count of items; raises FormatError with `what` as their name."""
    if not (word.isascii() and word.isdecimal()) or len(word) > 19 or int(word) > _MOST_POINTS:
        raise file.error(f"{what} is not a count", line)
    return int(word)


def misfit_of(codes: Collection[str], column: OutColumn, taken: Collection[str] = ()) -> str:
    """Return the reason why a format cannot hold a column, "" if it can.

    codes: the format's types in numpy's notation, without byte order; taken: reserved names
    """
    if column.kind is None or column.kind.str[1:] not in codes:
        return f"it has no type for {column.kind}" if column.kind is not None else "it holds numbers"
    one_word = column.name.split() == [column.name] and column.name not in taken
    return "" if one_word else "a name is one word without blanks" + f", and not {' or '.join(taken)}" * bool(taken)


def type_in(fmt: str, codes: Mapping[str, Code], column: OutColumn, taken: Collection[str] = ()) -> Code:
    """Return a format's name for the type of a column; raises ValueInvalid if it has none."""
    if (reason := misfit_of(codes, column, taken)) or column.kind is None:
        raise ValueInvalid(f"column {shown(column.name)} does not fit in {fmt}: {reason}")
    return codes[column.kind.str[1:]]


class TextBatch(column_file.Batch):
    """Rows of text; a number that is not finite means a missing value."""

    def __init__(self, cells: Cells, cloud: CloudFile, at: Sequence[int]) -> None:
        """Store the cells of the next rows of a cloud, and the positions of its columns among them."""
        self.cells, self.cloud, self.at, self.line = cells, cloud, at, cloud.line
        self.size = len(cells.rows)
        self.bytes_read = len(cells.data) - 2 * MARGIN

    def _problem(self, row: int, place: int, reason: str) -> FormatError:
        return self.cloud.file.error(f"{self.cloud.names[place]}: {reason}", self.line + int(self.cells.rows[row]))

    def numbers(self, place: int) -> tuple[Floats, None]:
        """Return a column as floats; raises FormatError for a cell that is not a number."""
        column = self.cells.column(self.at[place])
        values, bad = parse_floats(column)
        for row in bad.tolist():
            text = column.text(row).decode("utf-8", "replace")
            known = _NOT_FINITE.get(text.lower().lstrip("+-"))
            if known is None:
                raise self._problem(row, place, explain_number(text))
            values[row] = -known if text.startswith("-") else known
        return values, None

    def texts(self, place: int) -> list[str]:
        """Return a column as texts."""
        column = self.cells.column(self.at[place])
        return [column.text(row).decode("utf-8", "replace") for row in range(self.size)]

    def column(self, place: int) -> Any:
        """Return a column as numbers of its type; raises FormatError for a number that does not fit it."""
        kind, values = self.cloud.record[place], self.numbers(place)[0]
        if kind.kind not in column_file.WHOLE:
            return values.astype(kind)
        numbers = []
        for row, text in enumerate(self.texts(place)):
            try:
                numbers.append(kind.type(int(text)))
            except (ValueError, OverflowError):  # written with a point, or too large
                raise self._problem(row, place, f"{text} is no {kind.name}") from None
        return np.array(numbers, kind)


def encode_text(
    columns: Sequence[OutColumn], style: Style, batch: TextBatch, rows: Ints | None, made: Sequence[Made]
) -> bytes:
    """Return rows of text in which new numbers replace the cells of their columns, or are appended.

    Numbers have the fewest digits that identify a value of their type, or fixed decimals.
    """
    cells = batch.cells
    chosen = np.arange(batch.size) if rows is None else rows
    if not len(chosen):
        return b"" if rows is not None else cells.data[MARGIN:-MARGIN].tobytes()
    lines = cells.rows[chosen]
    at, ends = cells.line_starts[lines], cells.line_ends[lines]
    if rows is None:  # text between rows goes with the next one, text after the last row with that row
        at = np.concatenate([[MARGIN], ends[:-1]])
        ends = np.append(ends[:-1], len(cells.data) - MARGIN)
    new, parts = iter(made), list[Spans]()
    for place, column in enumerate(columns):
        if column.passed is not None:
            continue
        if column.kind is None:
            raise ValueInvalid(f"column {column.name} holds texts; the rows of a cloud are numbers")
        values = np.asarray(next(new).values, np.float64).reshape(-1, 1)
        is_single = column.kind == column_file.SINGLE and style.precision is None
        spans = float_spans(rounded_to_single(values) if is_single else values, b" ", style.precision)
        written = Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)
        if place < len(batch.at):
            end = cells.ends[chosen, batch.at[place]]
            parts += [Spans(cells.data, at, cells.starts[chosen, batch.at[place]]), written]
        else:
            end, blank = cells.ends[chosen, -1], np.full(len(chosen), MARGIN)
            parts += [Spans(cells.data, at, end), Spans(framed(b" "), blank, blank + 1), written]
        at = end
    return join([*parts, Spans(cells.data, at, ends)])


# --- PLY ---

ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
NAMES = {code: name for name, code in reversed(TYPES.items())}
NEW_NAMES = {code: name for code, name in NAMES.items() if code not in ("i8", "u8")}  # not every tool reads these
NEW_NAMES |= {"b1": "uchar", "f2": "float"}
PROPERTY = rf"(?:list (?:{'|'.join(name for name, code in TYPES.items() if code[0] != 'f')}) )?(?:{'|'.join(TYPES)})"
LINES = {
    "format": f"one format: {', '.join(ENCODINGS)}, and 1.0",
    "element": "element NAME COUNT, each name once",
    "property": "property TYPE NAME below an element, or property list INTEGER TYPE NAME, each name once; "
    f"types: {', '.join(TYPES)}",
}
VERTEX = "vertex"
OWN_LINES: tuple[list[bytes], ...] = ([b"property"], [b"comment"], [b"obj_info"], [])  # lines that follow an element
SPLAT = ("rot_1", "rot_2", "rot_3", "rot_0")  # x y z w


class PlyElement(NamedTuple):
    """One element of a file.

    instances: their number; line: line number in the header
    properties: name -> the type of a value, and for a list the type of its count, else ""
    """

    name: str
    instances: int
    line: int
    properties: dict[str, tuple[str, str]]

    @property
    def lists(self) -> list[str]:
        """Return the names of properties that are lists; their size is not known before the data are read."""
        return [name for name, (_, counted) in self.properties.items() if counted]


def read_head(file: InputFile) -> tuple[bytes, str, list[PlyElement]]:
    """Read a header, up to the data; raises FormatError with line, value and remedy."""
    if (first := file.stream.readline(64)).strip() != b"ply" or not first.endswith(b"\n"):
        raise file.error("the first line of a PLY file is `ply`, and it ends in a line feed", 1)
    fmt, elements, text = "", dict[str, PlyElement](), [first]
    for words in head_lines(file, text, "`end_header`"):
        match words:
            case ["comment" | "obj_info", *_]:
                continue
            case ["end_header", *_]:
                break
            case ["format", name, "1.0"] if name in ENCODINGS and not fmt:
                fmt = name
            case ["element", name, number] if name not in elements:
                count = count_in(number, f"{shown(number)} of element {shown(name)}", file, len(text))
                element = elements[name] = PlyElement(name, count, len(text), {})
            case ["property", *types, name] if (
                elements and name not in element.properties and re.fullmatch(PROPERTY, " ".join(types))
            ):
                *counted, code = (TYPES[each] for each in types if each != "list")
                element.properties[name] = code, "".join(counted)
            case [word, *_]:
                expected = LINES.get(word, f"{', '.join(LINES)}, comment, obj_info or end_header at its beginning")
                raise file.error(f"{shown(' '.join(words))}: expected {expected}", len(text))
    if not fmt:
        raise file.error(f"the header has no format; formats: {', '.join(ENCODINGS)}", len(text))
    return b"".join(text), ENCODINGS[fmt], list(elements.values())


class PlyFile(CloudFile):
    """A cloud, or the vertices of a mesh, read in batches."""

    vectors = NORMALS[::-1]
    what = "vertices"

    def __init__(self, file: InputFile) -> None:
        """Read the header and everything before the vertices.

        Raises FormatError, also for lists in the vertices or in binary elements before them.
        """
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
        """Set the rotation of splats from the pose that transforms all points; warn if it is not applied.

        pose: None if the points do not share one
        """
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

        Raises FormatError if the number of lines is not that of the header.
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
            problem = f"after the vertices there are {lines} lines, the header says {expected}; correct the header"
            raise self.file.error(problem)

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
        if not same_columns(columns, self.width):
            lines = text.splitlines(keepends=True)
            end = b"\r\n" if lines[0].endswith(b"\r\n") else b"\n"
            own = list(takewhile(lambda line: line.split()[:1] in OWN_LINES, lines[self.own_line :]))
            others = [line for line in own if line.split()[:1] != [b"property"]]
            made = [f"property {_type_of(column)} {column.name}".encode() + end for column in columns]
            text = b"".join([*lines[: self.own_line], *made, *others, *lines[self.own_line + len(own) :]])
        return text + self.before


def _type_of(column: OutColumn) -> str:
    """Return PLY's name for the type of a column; raises ValueInvalid for types that PLY does not have."""
    return type_in("ply", NEW_NAMES if column.passed is None else NAMES, column)


def create(columns: Sequence[OutColumn], count: int | None, style: Style) -> column_file.CountedWriter:
    """Return a writer for new points: a new file with these columns, whose numbers keep their types."""
    empty = b"ply\nformat binary_little_endian 1.0\nelement vertex 0\nend_header\n"
    return PlyFile(InputFile("ply", BytesIO(empty))).rewriter(columns, count, style)


open_columns, misfit = PlyFile, partial(misfit_of, NEW_NAMES)
