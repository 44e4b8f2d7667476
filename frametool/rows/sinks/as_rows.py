"""Write blocks of poses, points and vectors in any text format.

The text of a row is defined by the format (`ROWS`), or learned from the text of one result; for other formats results
are written one by one.  Other columns are written if the format has a place for them.

To learn a row, one result is written with marks in place of everything that differs from row to row; each mark is then
replaced by the numbers, names and other scalars of all rows.
"""

from __future__ import annotations

import re
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.documents.document import JSON_NUMBER
from frametool.documents.source import Verbatim
from frametool.documents.writers import dump_json
from frametool.documents.writers import quoted as quoted_in_yaml
from frametool.errors import ValueInvalid, listing, warn
from frametool.formats.rows import pose_rows
from frametool.formats.rows.csv import cell, cells_of, quoted, row
from frametool.formats.rows.pose_rows import IMAGE, MOST_NAMED, NUMBER, RowForm, image_name, is_turned, rows_of, turned
from frametool.formats.table import FORMATS
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry import arrays, floats, quaternion, rigid
from frametool.grammar.pose import SCALE
from frametool.grammar.readers import EARTH_FRAMES
from frametool.grammar.result import SPELLED, Result, Style
from frametool.rows.batch import (
    SOME_STAMPS,
    RowPoses,
    assemble,
    constant,
    kept,
    objects,
    one_text,
    plain_cells,
    spans_of,
    text_of,
    texts_of,
    values_of,
)
from frametool.rows.request import target_of
from frametool.rows.shapes import AS_READ, POSE, SIX
from frametool.rows.sinks import Const, In, Out, Piece
from frametool.rows.sinks.results import BlockResults, Documents, ResultWriter, csv_rows
from frametool.text.spans import Floats, Ints, Spans, join, without_quotes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from frametool.geometry import Components
    from frametool.rows.plain import Value

LOSABLE = ("names of frames", "stamps")
NUMBERED = "without stamps, poses are numbered in seconds: 0, 1, 2 .."


class PoseWriter(ResultWriter):
    """Base of the writers of blocks of poses, points, vectors, twists or wrenches.

    kind: of each row; placed: poses have positions; extras: the names of further numbers
    target: the shape in which the numbers of a result are written
    """

    def __init__(self, style: Style, first: RowPoses) -> None:
        """Store the style; the first block determines the kind of all rows."""
        self.style, self.kind, self.extras = style, first.kind, first.more
        self.placed = first.placed or first.kind != POSE
        self.target = target_of(style, first.kind, placed=self.placed)

    def columns(self, block: RowPoses) -> Components:
        """Return the numbers of a block as contiguous columns."""
        return tuple(map(np.ascontiguousarray, block.numbers.T))

    def settle(self, block: RowPoses) -> None:
        """Refuse positions that are not in ECEF if geodetic ones are wanted; the first may become the origin."""
        if self.style.place is None or not len(block.numbers):
            return
        from frametool.grammar.place import check_in_ecef

        for parent in dict.fromkeys(block.parents):
            check_in_ecef(parent, self.style.place)
        self.style.place.settle(*self.columns(block)[:3])


class SingleWriter(PoseWriter):
    """Write blocks of poses, points or vectors with the format's writer of single results."""

    def __init__(self, style: Style, first: RowPoses) -> None:
        """Store the style and the kind of rows; raises ValueInvalid if the format cannot hold them."""
        super().__init__(style, first)
        if (kind := first.kind) in SIX:
            raise ValueInvalid(f"{style.format} is not written of rows of a {kind}; write csv, json or yaml")
        if kind != POSE and "points" not in FORMATS[style.format].writes:
            raise ValueInvalid(f"{style.format} holds poses; a {kind} has no rotation")
        self.dropped, self.made_up = dict[str, None](), dict[str, None]()
        self.first: Any = None

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block; its numbers are metres and quaternions x y z w."""
        if not len(block.numbers):
            return b""
        self.settle(block)
        self.dropped |= dict.fromkeys((*self.extras, *block.extras))
        refuse_scale_in(self.style.format, self.dropped)
        results = values_of(block, self.target.place)
        module: Any = import_module(FORMATS[self.style.format].writer)
        write: Callable[[Sequence[Any], Style], str] = module.write_poses if self.kind == POSE else module.write_points
        if self.first is None:
            self.first = results[0]
            return write(results, self.style).encode()
        known = write([self.first], self.style)  # the text of several begins with that of the first alone
        return write([self.first, *results], self.style)[len(known) :].encode()

    def end(self) -> Iterator[bytes]:
        """Warn in one line about what was left out or assumed."""
        left = [words for words in LOSABLE if words in self.dropped]
        if others := self.dropped.keys() - {*LOSABLE}:
            left.append(listing(others, MOST_NAMED))
        if said := [f"{', '.join(left)} left out"] * bool(left) + [*self.made_up]:
            warn(f"{self.style.format}: {'; '.join(said)}")
        return iter(())


class TextWriter(SingleWriter):
    """Write blocks of poses in a format that defines the text of a pose (`ROWS`)."""

    def __init__(self, style: Style, first: RowPoses) -> None:
        """Store the style and the kind of rows; raises ValueInvalid for other notations than the format's."""
        super().__init__(style, first)
        if any(each.spec != "quaternion" for each in style.notations):
            raise ValueInvalid(f"{style.format} writes rotations in its own way; leave --to out")
        self.fixed, self.count = rows_of(style.format) or RowForm(()), 0
        self.made_up |= dict.fromkeys(filter(None, [self.fixed.constants]))

    def end(self) -> Iterator[bytes]:
        """Yield the text after the last pose, and warn."""
        axes = FORMATS[self.style.format].rows.axes
        if self.count and is_turned(self.style):
            self.made_up[f"camera axes turned from {self.style.axes} to {axes}, half a turn about x"] = None
        elif axes and not self.style.axes:
            self.made_up[f"the axes of the poses are taken for {axes}, as {self.style.format} has them"] = None
        yield from super().end()
        yield self.fixed.tail if self.count else self.fixed.head + self.fixed.tail

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block; its numbers are metres and quaternions x y z w."""
        if not len(block.numbers):
            return b""
        if (place := self.style.place) is not None:
            names = ", ".join(each.name for each in (place, *place.more))
            raise ValueInvalid(f"{self.style.format} holds x, y, z; leave --to {names} out, or write csv or json")
        refuse_scale_in(self.style.format, (*self.extras, *block.extras))
        fmt, images, size = self.fixed, block.extras.get(IMAGE), len(block.numbers)
        before, self.count = self.count, self.count + size
        counted, has_stamps = FORMATS[self.style.format].rows.counted, block.stamps_ns is not None
        left = any(block.parents) or any(block.names), counted and has_stamps and NUMBER not in block.extras
        self.dropped |= {words: None for words, is_left in zip(LOSABLE, left, strict=True) if is_left}
        self.dropped |= dict.fromkeys(name for name in (*self.extras, *block.extras) if name not in (IMAGE, NUMBER))
        if before and not counted and has_stamps == (NUMBERED in self.made_up):  # unlike the blocks before
            raise ValueInvalid(SOME_STAMPS)
        if not (counted or has_stamps):
            self.made_up[NUMBERED] = None
        if IMAGE in fmt.row and images is None:
            self.made_up["pictures are named by their stamps"] = None
        tx, ty, tz, x, y, z, w = self.columns(block)[:7]
        pose = turned(self.style, (tx, ty, tz, *quaternion.unit(x, y, z, w, arrays)))
        tx, ty, tz, x, y, z, w = rigid.inverse(*pose) if FORMATS[self.style.format].rows.inverse else pose
        turn = (x, y, z, w) if self.style.keep_sign else quaternion.from_quaternion(x, y, z, w, arrays)
        values = np.column_stack(fmt.numbers(tx, ty, tz, *turn)) + 0.0  # no -0.0
        refuse_infinite(values)
        stamps, numbers = block.stamps_ns, [*range(before + fmt.first, before + fmt.first + size)]
        times = [at * BILLION for at in range(before, before + size)] if stamps is None else stamps.tolist()
        if NUMBER in block.extras:
            numbers = [int(text) for text in texts_of(block.extras[NUMBER])]
        pieces: list[Piece] = [Const(fmt.between)] if fmt.between else []
        parts, first = list[Spans](), 0
        for piece in fmt.row:
            if isinstance(piece, bytes):
                pieces.append(Const(piece))
                continue
            if isinstance(piece, pose_rows.Numbers):
                pieces.append(Out(first, first + piece.size, piece.between))
                first += piece.size
                continue
            if piece == IMAGE:
                known = [None] * size if images is None else texts_of(images)
                texts = [image_name(*each).encode() for each in zip(known, times, strict=True)]
            elif piece == "seconds" and min(times) >= 0:
                texts = [b"%d.%09d" % divmod(time, BILLION) for time in times]
            elif piece == "seconds":
                texts = [format_stamp(time).encode() for time in times]
            else:
                texts = [b"%d" % each for each in (times if piece == "nanoseconds" else numbers)]
            pieces.append(In(len(parts)))
            parts.append(spans_of(texts))
        text = join(assemble(pieces, parts, values, np.zeros(size, np.int64), self.style.precision))
        return text if before else fmt.head + text[len(fmt.between) :]


class RowsWriter(PoseWriter):
    """Write blocks of poses, points or vectors as CSV, JSON or YAML; rows with the same layout are written together."""

    def __init__(self, style: Style, first: RowPoses) -> None:
        """Store the style and the first block."""
        super().__init__(style, first)
        self.documents = None if style.format == "csv" else Documents(style)
        self.names: dict[str, None] = {}  # columns of a table: those of the first rows
        self.head = first  # determines the columns of a table without rows

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block; its numbers are metres and quaternions x y z w."""
        if not len(block.numbers):
            return b""
        self.settle(block)
        # rows without a result, or with angles that are not unique, are written one by one
        alone, alike = np.isnan(block.numbers[:, 0]), list[AlikeRows]()
        with np.errstate(invalid="ignore"):
            if (locked := self.target.locked(self.columns(block)[:7])) is not None:
                alone |= locked != 0
        varies = block.extras or any(len(each) > 1 for each in (block.names, block.parents))
        is_worded = self.target.place is not None and self.target.place.words
        if self.style.screen or is_worded or (varies and self.style.format == "yaml"):
            alone[:] = True
        rows, singles = np.flatnonzero(~alone), np.flatnonzero(alone)
        if len(rows):
            some = kept(block, rows) if len(singles) else block
            numbers = self.target.written(some.unmoved(self.columns(some)), arrays)
            values = np.stack(np.broadcast_arrays(*numbers), axis=-1) + 0.0  # no -0.0
            refuse_infinite(values)
            scalars = {leaf_mark(at): cells for at, cells in enumerate(some.extras.values())}
            alike = [AlikeRows(self._marked(some), rows, values, some._replace(extras=scalars))]
        others = kept(block, singles) if len(singles) < len(alone) else block
        made = values_of(others, self.target.place) if len(singles) else ()
        results = BlockResults(alike, [*zip(singles.tolist(), made, strict=True)])
        if self.documents is not None:
            return self.documents.of_block(results)
        before = len(self.names)
        text = csv_rows(results, self.names, self.style)
        if before and (more := [*self.names][before:]):
            raise ValueInvalid(f"{listing(more)}: the first rows have no such columns; write json or yaml")
        return text if before else row(self.names, self.style).encode() + text

    def end(self) -> Iterator[bytes]:
        """Yield the header of a table without rows."""
        if self.documents is None and not self.names:
            yield row(cells_of(self._marked(self.head).value, self.style), self.style).encode()

    def _marked(self, block: RowPoses) -> Marked:
        """Return a result like those of a block, with marks for everything that differs from row to row."""
        size, place = {POSE: 7, **dict.fromkeys(SIX, 6)}.get(self.kind, 3), self.target.place
        # far from the Earth's centre, where no latitude is defined
        own = (*((1.0 if place is None else 1e6) * part for part in NUMBERS[:3]), *NUMBERS[3:size])
        more = [MORE_NUMBERS + at for at in range(len(self.extras))]
        numbers = [*self.target.written(own, floats), *more]
        columns = {repr(number): at for at, number in enumerate(numbers) if type(number) is float}
        parent = PARENT if place is None or self.kind == POSE else EARTH_FRAMES[0]
        one = block._replace(
            numbers=np.array([[*own, *more]]), read=None, placed=self.placed,
            stamps_ns=None if block.stamps_ns is None else np.array([STAMP_NS]),
            parents=block.parents if len(block.parents) == 1 else [parent],
            names=block.names if len(block.names) == 1 else [NAME],
            extras={name: objects([Verbatim(leaf_mark(at))]) for at, name in enumerate(block.extras)},
        )  # fmt: skip
        (value,) = values_of(one, place)
        return Marked(value, columns, len(numbers))


def refuse_infinite(values: Floats) -> None:
    """Raise ValueInvalid for numbers that are not finite."""
    if not np.isfinite(values).all():
        raise ValueInvalid("a result is too large for a double")


def refuse_scale_in(fmt: str, extra: Iterable[str]) -> None:
    """Raise ValueInvalid if a format has no place for the scale of a similarity."""
    if SCALE in extra and fmt not in ("text", *SPELLED):
        raise ValueInvalid(f"{fmt} has no place for a scale; write json, yaml or csv")


# --- rows with the same layout: as lines of CSV or JSON, as documents of YAML, as values, and as poses ---

# marks of numbers (of a pose; further ones are 0.7310585786300049 + n), stamps, names, and scalars
NUMBERS = (0.1370842961, -3.7208412957, 29.6518402397, 0.22360679774997896, -0.37416573867739417, 0.5099019513592785,
           0.7416198487095663)  # fmt: skip
MORE_NUMBERS = 0.7310585786300049
STAMP_NS = 1234567890987654321
PARENT, NAME = "@@parent@@", "@@name@@"
# columns whose texts are written unchanged, or between quotes
VALUES = re.compile(rb"(?:(?:%s|true|false)\n)*+" % JSON_NUMBER.encode())
WORDS = re.compile(rb'(?:(?!(?:true|false)\n)[A-Za-z_][^"\\\x00-\x1f\x7f-\xff]*+(?<! )\n)*+')
LEAF = re.compile(r"73105857(\d{7})")  # a whole number: in JSON it needs no quotes either


class Syntax(NamedTuple):
    """The syntax of scalars in a place: quotes around texts, bytes that need escapes, a writer for any value."""

    quote: str
    unsafe: bytes
    write: Callable[[Any], str]


CELL = Syntax("", b'",\\\r\n', lambda value: quoted(text_of(value)))
IN_CELL = Syntax('""', b'"\\', lambda value: dump_json(value).replace('"', '""'))
JSON = Syntax('"', b'"\\', dump_json)
YAML = Syntax('"', bytes(range(128)), lambda value: quoted_in_yaml(value) if type(value) is str else dump_json(value))


class Marked(NamedTuple):
    """One result that represents many with the same layout, with marks for everything that differs.

    value: the result; numbers: the column of results for each mark of a number; size: the number of columns
    stamp: the stretches of the stamp of records; in_ns: nanoseconds per unit of a single one
    quotes: the quotes around the scalars of records, by mark; None for rows of tables
    is_json: the records are JSON, in which a scalar without quotes is not a text
    """

    value: Value
    numbers: Mapping[str, int]
    size: int
    stamp: tuple[int, ...] = ()
    in_ns: int = 0
    quotes: Mapping[str, str] | None = None
    is_json: bool = False


def leaf_mark(number: int) -> str:
    """Return the mark of a scalar."""
    return f"73105857{number:07d}"


class AlikeRows(NamedTuple):
    """Results with the same layout, one per row.

    places: (n,) the position of each; numbers: (n, k) the numbers to write
    block: the poses with their frames and stamps; its extras are the other scalars by mark, those of records unquoted
    """

    marked: Marked
    places: Ints
    numbers: Floats
    block: RowPoses

    def take(self, rows: Ints) -> AlikeRows:
        """Return some of the rows."""
        return AlikeRows(self.marked, self.places[rows], self.numbers[rows], kept(self.block, rows))

    def as_documents(self, text: str, style: Style) -> list[Spans]:
        """Return the rows as JSON or YAML; text: the result with marks."""
        return self._text([(text, YAML if style.format == "yaml" else JSON)], style)

    def as_cells(self, cells: Mapping[str, Any], columns: Iterable[str], style: Style) -> list[Spans]:
        """Return the rows as lines of CSV; cells: the result with marks."""
        parts: list[tuple[str, Syntax]] = []
        exact = style.changed(precision=None, screen=False)
        for at, name in enumerate(columns):
            value = cells.get(name, "")
            parts += [("," * (at > 0) + cell(value, exact), IN_CELL if isinstance(value, (dict, list)) else CELL)]
        return self._text([*parts, ("\n", CELL)], style)

    def _text(self, parts: Sequence[tuple[str, Syntax]], style: Style) -> list[Spans]:
        """Return the rows as text; parts: pieces of the result with marks, each with the syntax of its scalars."""
        columns, size = self.marked.numbers, len(self.places)
        marks = rf"(?<![\w.+-])(?:{'|'.join([*map(re.escape, columns), str(STAMP_NS)])})(?![\w.+-])"
        pieces, spans, waiting = list[Piece](), list[Spans](), ""
        for text, syntax in parts:
            quote = f"(?:{syntax.quote})?"
            scalars = f"{quote}(?:{LEAF.pattern.replace('(', '(?:')}|{PARENT}|{NAME}){quote}"
            for piece in re.split(f"({marks}|{scalars})", text):
                mark, around = piece.strip('"'), ""
                if mark in columns:
                    made: Piece = Out(columns[mark], columns[mark] + 1)
                elif mark in (PARENT, NAME, str(STAMP_NS)) or LEAF.fullmatch(mark):
                    scalar, around = self._scalar(mark, syntax)
                    if (only := one_text(scalar)) is not None:  # the same in all rows: constant text
                        waiting += f"{around}{only.decode()}{around}"
                        continue
                    made, spans = In(len(spans)), [*spans, scalar]
                else:
                    waiting += piece
                    continue
                waiting += around
                pieces += [Const(waiting.encode()), made] if waiting else [made]
                waiting = around
        pieces += [Const(waiting.encode())] if waiting else []
        locked = np.zeros(size, np.int64)
        return assemble(pieces, spans, self.numbers, locked, style.precision, yaml=style.format == "yaml")

    def _scalar(self, mark: str, syntax: Syntax) -> tuple[Spans, str]:
        """Return the texts that replace a mark, and the quotes around them."""
        block, quotes, is_cell = self.block, self.marked.quotes, syntax is CELL
        if mark in (PARENT, NAME):
            return self._words(block.parents if mark == PARENT else block.names, syntax), ""
        if block.stamps_ns is not None and mark == str(STAMP_NS):
            return spans_of([b"%d" % stamp for stamp in block.stamps_ns.tolist()]), ""
        cells = block.extras[mark]
        if quotes is not None and isinstance(cells, Spans):
            if quotes[mark]:
                passes = is_cell or not (cells.data > 127).any()
                if passes:
                    counts = np.concatenate([[0], np.cumsum(np.isin(cells.data, [*syntax.unsafe]), dtype=np.int32)])
                    passes = not (counts[cells.ends] > counts[cells.starts]).any()
            elif is_cell:
                passes = not (cells.data[cells.starts] == ord("n")).any()  # it may be null
            else:
                passes = self.marked.is_json
            if passes:
                return cells, syntax.quote if quotes[mark] else ""
        elif is_cell:
            return self._words(texts_of(cells), syntax), ""
        elif not isinstance(cells, Spans):
            return spans_of([syntax.write(value).encode() for value in plain_cells(cells)]), ""
        else:
            bare, size = without_quotes(cells), len(self.places)
            lines = join([bare, constant(b"\n", size)])
            for pattern, quote in ((VALUES, ""), (WORDS, syntax.quote)):
                if lines.count(b"\n") == size and pattern.fullmatch(lines):
                    return bare, quote
        return self._words(self._column(mark), syntax), ""

    def _words(self, values: Sequence[Any], syntax: Syntax) -> Spans:
        """Return plain values in the syntax of a place, one per row or one for all."""
        known = {value: syntax.write(value).encode() for value in dict.fromkeys(values)}
        size = len(self.places)
        return spans_of([known[value] for value in values]) if len(values) == size else constant(known[values[0]], size)

    def _column(self, mark: str) -> list[Any]:
        """Return the values that a mark represents, one per row."""
        cells, quotes = self.block.extras[mark], self.marked.quotes
        if quotes is None or not isinstance(cells, Spans):
            return plain_cells(cells)
        from frametool.rows.plain import plain_text

        data = cells.data.tobytes()
        spans = zip(cells.starts.tolist(), cells.ends.tolist(), strict=True)
        texts = [data[start:end] for start, end in spans]
        known = {text: plain_text(text.decode(), quotes[mark]) for text in {*texts}}
        return [known[text] for text in texts]

    def _said(self, part: Any) -> list[Any]:
        """Return a part of the result for each row, with the row's values for its marks."""
        block, size = self.block, len(self.places)
        if type(part) in (dict, list):
            columns = [self._said(each) for each in (part.values() if type(part) is dict else part)]
            rows: Iterable[tuple[Any, ...]] = zip(*columns, strict=True) if columns else [()] * size
            return [dict(zip(part, row, strict=True)) if type(part) is dict else [*row] for row in rows]
        if part == STAMP_NS and block.stamps_ns is not None:
            return [*block.stamps_ns.tolist()]
        if isinstance(part, float):
            return [*self.numbers[:, self.marked.numbers[repr(part + 0.0)]].tolist()]
        if part in (PARENT, NAME):
            return [*block.for_each(block.parents if part == PARENT else block.names)]
        return self._column(part) if isinstance(part, str) and LEAF.fullmatch(part) else [part] * size

    def values(self) -> Iterator[Value]:
        """Yield the rows as single results; the numbers of poses must be position and quaternion."""
        value = self.marked.value
        if not isinstance(value, Result):
            yield from self._said(value)
            return
        pose = value.pose
        said = self._said([pose.name, pose.parent, pose.scale if pose.scale != 1.0 else None, value.extras])
        for numbers, (name, parent, scale, extras) in zip(self.numbers.tolist(), said, strict=True):
            own = pose._replace(
                position=None if pose.position is None else tuple(numbers[:3]),
                rotation=None if pose.rotation is None else tuple(numbers[3:7]),
                name=name, parent=parent, scale=scale or 1.0,
            )  # fmt: skip
            yield Result(own, extras)

    def poses(self) -> RowPoses | None:
        """Return the rows as a block with positions for lines; None if they are not plain poses."""
        value = self.marked.value
        if not isinstance(value, Result) or None in (value.pose.position, value.pose.rotation):
            return None
        if AS_READ in value.extras or value.pose.scale != 1.0:
            return None
        parents, names = (self._said(each) for each in (value.pose.parent, value.pose.name))
        parents, names = (each[:1] if len({*each}) == 1 else each for each in (parents, names))
        extras = {key: objects(self._said(each)) for key, each in value.extras.items() if key != "stamp_ns"}
        return RowPoses(self.numbers[:, :7] + 0.0, self.block.stamps_ns, self.places, parents, names, extras)
