"""One line of CSV: its cells with their columns, and back; quoted as in RFC 4180.

For single lines; `cells` processes blocks of lines.
"""

from __future__ import annotations

import re
from typing import NamedTuple

_CELL = re.compile(r'(?:[^\S\n]*"((?:[^"]|"")*)"\s*|([^,]*))(?:,|$)')


class LineCell(NamedTuple):
    """The text of a cell without its quotes and surrounding blanks, and its first character's column, from 1."""

    text: str
    column: int


def split_line(line: str) -> list[LineCell]:
    """Return the cells of a line; an empty line has one empty cell."""
    cells = []
    for cell in _CELL.finditer(line):
        quoted_text, plain = cell.groups()
        text = plain.strip() if quoted_text is None else quoted_text.replace('""', '"')
        cells.append(LineCell(text, cell.start() + 1))
        if not cell[0].endswith(","):
            break
    return cells


def quoted(text: str) -> str:
    """Write a cell, in quotes if necessary."""
    is_split = "," in text or '"' in text or "\r" in text or "\n" in text
    return '"' + text.replace('"', '""') + '"' if is_split else text
