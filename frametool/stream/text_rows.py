"""Rows that are written alike, together: as lines of CSV or JSON, as documents of YAML, as values, and as poses.

A result of which all that differs is a mark is written once; the numbers, names and other scalars of rows then take the
places of the marks.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.documents import json
from frametool.documents.yaml_writer import quoted as quoted_in_yaml
from frametool.formats.rows.csv import cell, quoted
from frametool.grammar.result import Result
from frametool.stream.row_layout import AS_READ
from frametool.stream.rows import (
    RowPoses,
    constant,
    kept,
    number_spans,
    objects,
    plain_cells,
    spans_of,
    text_of,
    texts_of,
)
from frametool.text.spans import Floats, Ints, Spans

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from frametool.grammar.result import Style
    from frametool.stream.record_values import Value

# marks: of numbers (those of a pose; more of them are 0.7310585786300049 + n), stamps, names, and scalars
NUMBERS = (0.1370842961, -3.7208412957, 29.6518402397, 0.22360679774997896, -0.37416573867739417, 0.5099019513592785,
           0.7416198487095663)  # fmt: skip
MORE_NUMBERS = 0.7310585786300049
STAMP_NS = 1234567890987654321
PARENT, NAME = "@@parent@@", "@@name@@"
LEAF = re.compile(r"73105857(\d{7})")  # a whole number: in JSON it needs no quotes either


class Syntax(NamedTuple):
    """How scalars are written in a place: quotes around texts, what a text must not hold to pass, and any value."""

    quote: str
    unsafe: bytes
    write: Callable[[Any], str]


CELL = Syntax("", b'",\\\r\n', lambda value: quoted(text_of(value)))
IN_CELL = Syntax('""', b'"\\', lambda value: json.dump(value).replace('"', '""'))
JSON = Syntax('"', b'"\\', json.dump)
YAML = Syntax('"', bytes(range(128)), lambda value: quoted_in_yaml(value) if type(value) is str else json.dump(value))


class Marked(NamedTuple):
    """The result of one of many rows that are alike, with marks in the place of what differs.

    value: the result; numbers: which column of results stands for a number of it, by its text; size: the columns
    stamp: which scalar of a record is its stamp, if it has no header, and whether it counts nanoseconds
    quotes: of records, those around the scalars, by their marks; is_json: in JSON a scalar without quotes is no text
    """

    value: Value
    numbers: Mapping[str, int]
    size: int
    stamp: tuple[int, int] | None = None
    quotes: Mapping[str, str] | None = None
    is_json: bool = False


def leaf_mark(number: int) -> str:
    """Return the mark of a scalar."""
    return f"73105857{number:07d}"


class AlikeRows(NamedTuple):
    """Results that are written alike, one a row.

    places: (n,) where each is; numbers: (n, k) those that are written
    block: the poses, with their frames, their stamps, and the scalars by their marks; those of records without quotes
    """

    marked: Marked
    places: Ints
    numbers: Floats
    block: RowPoses

    def take(self, rows: Ints) -> AlikeRows:
        """Return some of the rows."""
        return AlikeRows(self.marked, self.places[rows], self.numbers[rows], kept(self.block, rows))

    def text(self, parts: Sequence[tuple[str, Syntax]], style: Style) -> list[Spans]:
        """Return the rows as text; parts: the text of the result with marks, and how scalars are written in it."""
        columns, (size, width) = self.marked.numbers, self.numbers.shape
        is_yaml = style.format == "yaml"
        numbers = number_spans(self.numbers, style.precision, b"," * width, yaml=is_yaml) if width else None
        marks = rf"(?<![\w.+-])(?:{'|'.join([*map(re.escape, columns), str(STAMP_NS)])})(?![\w.+-])"
        found, waiting = list[Spans](), ""
        for text, syntax in parts:
            quote = f"(?:{syntax.quote})?"
            scalars = f"{quote}(?:{LEAF.pattern.replace('(', '(?:')}|{PARENT}|{NAME}){quote}"
            for piece in re.split(f"({marks}|{scalars})", text):
                mark, around = piece.strip('"'), ""
                if numbers is not None and mark in columns:
                    at = columns[mark]
                    made = Spans(numbers.data, numbers.starts[:, at], numbers.ends[:, at] - 1)
                elif mark in (PARENT, NAME, str(STAMP_NS)) or LEAF.fullmatch(mark):
                    made, around = self._scalar(mark, syntax)
                else:
                    waiting += piece
                    continue
                waiting += around
                found += [constant(waiting.encode(), size), made] if waiting else [made]
                waiting = around
        return [*found, constant(waiting.encode(), size)] if waiting else found

    def _scalar(self, mark: str, syntax: Syntax) -> tuple[Spans, str]:
        """Return what is in the place of a mark, as it is written there, and the quotes around it."""
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
        elif not isinstance(cells, Spans) and not is_cell:
            return spans_of([syntax.write(value).encode() for value in plain_cells(cells)]), ""
        elif is_cell:
            return self._words(texts_of(cells), syntax), ""
        return self._words(self._column(mark), syntax), ""

    def _words(self, values: Sequence[Any], syntax: Syntax) -> Spans:
        """Return plain values as they are written in a place, one a row or one for all."""
        known = {value: syntax.write(value).encode() for value in dict.fromkeys(values)}
        size = len(self.places)
        return spans_of([known[value] for value in values]) if len(values) == size else constant(known[values[0]], size)

    def _column(self, mark: str) -> list[Any]:
        """Return a scalar of each row as a plain value."""
        cells, quotes = self.block.extras[mark], self.marked.quotes
        if quotes is None or not isinstance(cells, Spans):
            return plain_cells(cells)
        from frametool.stream.record_values import plain_text

        data = cells.data.tobytes()
        spans = zip(cells.starts.tolist(), cells.ends.tolist(), strict=True)
        texts = [data[start:end] for start, end in spans]
        known = {text: plain_text(text.decode(), quotes[mark]) for text in {*texts}}
        return [known[text] for text in texts]

    def _said(self, part: Any) -> list[Any]:
        """Return what each row says where the result of all has a part, whose marks are scalars of rows."""
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
        """Yield the rows as single results; the numbers of poses are position and quaternion."""
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
        """Return the rows as a block of poses; None where they are points, on the Earth, or scaled."""
        value = self.marked.value
        if not isinstance(value, Result) or None in (value.pose.position, value.pose.rotation):
            return None
        if AS_READ in value.extras or value.pose.scale != 1.0:
            return None
        parents, names = (self._said(each) for each in (value.pose.parent, value.pose.name))
        parents, names = (each[:1] if len({*each}) == 1 else each for each in (parents, names))
        extras = {key: objects(self._said(each)) for key, each in value.extras.items() if key != "stamp_ns"}
        lines = np.arange(len(self.places))
        return RowPoses(self.numbers[:, :7] + 0.0, self.block.stamps_ns, lines, parents, names, extras)


def in_table(cells: Mapping[str, Any], columns: Iterable[str], style: Style) -> list[tuple[str, Syntax]]:
    """Return a line of CSV of the cells of a result with marks."""
    parts: list[tuple[str, Syntax]] = []
    exact = style.changed(precision=None, screen=False)
    for at, name in enumerate(columns):
        value = cells.get(name, "")
        parts += [("," * (at > 0) + cell(value, exact), IN_CELL if isinstance(value, (dict, list)) else CELL)]
    return [*parts, ("\n", CELL)]
