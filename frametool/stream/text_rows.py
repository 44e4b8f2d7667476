"""Rows that are written alike as text: lines of CSV or JSON, documents of YAML.

A result of which all that differs is a mark is written once; the numbers, names and other scalars of rows then take the
places of the marks.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents import json
from frametool.documents.yaml_writer import quoted as quoted_in_yaml
from frametool.formats.rows.csv import cell, quoted
from frametool.stream.rows import constant, number_spans, spans_of
from frametool.text.spans import Floats, Spans

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

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


CELL = Syntax("", b'",\\\r\n', lambda value: quoted("" if value is None else str(value)))
IN_CELL = Syntax('""', b'"\\', lambda value: json.dump(value).replace('"', '""'))
JSON = Syntax('"', b'"\\', json.dump)
YAML = Syntax('"', bytes(range(128)), lambda value: quoted_in_yaml(value) if type(value) is str else json.dump(value))


class Marked(NamedTuple):
    """The result of one of many rows that are alike, with marks in the place of what differs.

    value: the result; numbers: which column of results stands for a number of it, by its text; size: the columns
    stamp: which scalar of a record is its stamp, if it has no header, and whether it counts nanoseconds
    """

    value: Value
    numbers: Mapping[str, int]
    size: int
    stamp: tuple[int, int] | None = None


def leaf_mark(number: int) -> str:
    """Return the mark of a scalar."""
    return f"73105857{number:07d}"


def in_table(cells: Mapping[str, Any], columns: Iterable[str], style: Style) -> list[tuple[str, Syntax]]:
    """Return a line of CSV of the cells of a result with marks."""
    parts: list[tuple[str, Syntax]] = []
    exact = style.changed(precision=None, screen=False)
    for at, name in enumerate(columns):
        value = cells.get(name, "")
        parts += [("," * (at > 0) + cell(value, exact), IN_CELL if isinstance(value, (dict, list)) else CELL)]
    return [*parts, ("\n", CELL)]


def in_document(text: str, style: Style) -> list[tuple[str, Syntax]]:
    """Return a line of JSON or a document of YAML: the text of a result with marks."""
    return [(text, YAML if style.format == "yaml" else JSON)]


def filled(
    parts: Sequence[tuple[str, Syntax]], style: Style, columns: Mapping[str, int], results: Floats,
    scalar: Callable[[str, Syntax], tuple[Spans, str]],
) -> list[Spans]:  # fmt: skip
    """Put what the rows have in the places of marks.

    columns: which column of the results is marked by a number's text
    scalar: what rows have in the place of another mark, as it is written there, and the quotes around it
    """
    size, width = results.shape
    marks = rf"(?<![\w.+-])(?:{'|'.join([*map(re.escape, columns), str(STAMP_NS)])})(?![\w.+-])"
    numbers = number_spans(results, style.precision, b"," * width, yaml=style.format == "yaml") if width else None
    found: list[Spans] = []
    waiting = ""
    for text, syntax in parts:
        quote = f"(?:{syntax.quote})?"
        for piece in re.split(f"({marks}|{quote}(?:{LEAF.pattern.replace('(', '(?:')}|{PARENT}|{NAME}){quote})", text):
            mark, around = piece.strip('"'), ""
            if numbers is not None and mark in columns:
                at = columns[mark]
                made = Spans(numbers.data, numbers.starts[:, at], numbers.ends[:, at] - 1)
            elif mark in (PARENT, NAME, str(STAMP_NS)) or LEAF.fullmatch(mark):
                made, around = scalar(mark, syntax)
                waiting += around
            else:
                waiting += piece
                continue
            found += [constant(waiting.encode(), size), made] if waiting else [made]
            waiting = around
    return [*found, constant(waiting.encode(), size)] if waiting else found


def words(values: Sequence[Any], size: int, syntax: Syntax) -> Spans:
    """Return plain values as they are written in a place, one a row or one for all."""
    known = {value: syntax.write(value).encode() for value in dict.fromkeys(values)}
    return spans_of([known[value] for value in values]) if len(values) == size else constant(known[values[0]], size)
