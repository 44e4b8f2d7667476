"""One line of CSV: its cells with the columns they begin at, and back; quoted as RFC 4180 says.

For lines that come one at a time; blocks of them are the work of `cells`.
"""

from __future__ import annotations

import re
from typing import NamedTuple

_CELL = re.compile(r'(?:[^\S\n]*"((?:[^"]|"")*)"\s*|([^,]*))(?:,|$)')


class LineCell(NamedTuple):
    """The text of a cell without its quotes and the blanks around it, and its first character's column, from 1."""

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
    """Write a cell, in quotes where a reader would split it."""
    is_split = "," in text or '"' in text or "\r" in text or "\n" in text
    return '"' + text.replace('"', '""') + '"' if is_split else text
