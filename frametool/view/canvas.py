"""A picture of dots in a terminal: braille characters, eight dots a cell, one colour a cell. Memory does not grow."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column of a cell


class Canvas:
    """Some lines of cells; a terminal's cell is about twice as high as wide, so that dots are about square."""

    def __init__(self, lines: int, columns: int | None = None) -> None:
        """Create an empty one, a square where the columns are not given."""
        self.lines = lines
        self.columns = 2 * lines if columns is None else columns
        self._cells: dict[tuple[int, int], tuple[int, str, int]] = {}

    def clear(self) -> None:
        """Wipe all dots."""
        self._cells.clear()

    def dot(self, x: float, y: float, colour: str) -> None:
        """Set the dot of a place, 0 to 1 with y up; the cell takes its colour."""
        self.mark(*self._dots(x, y), colour)

    def mark(self, across: int, down: int, colour: str, rank: int = 0) -> None:
        """Set a dot by its number from the left and the top; of several in a cell the highest rank colours it."""
        if not (0 <= across < 2 * self.columns and 0 <= down < 4 * self.lines):
            return
        cell = down // 4, across // 2
        bits, before, before_rank = self._cells.get(cell, (0, colour, rank))
        kept = (colour, rank) if rank >= before_rank else (before, before_rank)
        self._cells[cell] = bits | DOTS[down % 4][across % 2], *kept

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return line and column of a place."""
        across, down = self._dots(x, y)
        return down // 4, across // 2

    def rank(self, line: int, column: int) -> int:
        """Return the rank of a cell; -1 if it is empty."""
        return self._cells.get((line, column), (0, "", -1))[2]

    def row(self, line: int) -> Iterator[tuple[str, str]]:
        """Yield the characters of a line, each with its colour."""
        for column in range(self.columns):
            bits, colour, _ = self._cells.get((line, column), (0, "", 0))
            yield (chr(BRAILLE + bits) if bits else " "), colour

    def runs(self, line: int, over: Mapping[tuple[int, int], tuple[str, str]]) -> list[tuple[str, str]]:
        """Return a line as pieces of one colour; `over` holds what stands in cells instead of dots."""
        cells = (over.get((line, column), cell) for column, cell in enumerate(self.row(line)))
        return [("".join(map(itemgetter(0), run)), colour) for colour, run in groupby(cells, key=itemgetter(1))]

    def _dots(self, x: float, y: float) -> tuple[int, int]:
        across = int(x * 2 * self.columns)
        down = int((1.0 - y) * 4 * self.lines)
        return min(max(across, 0), 2 * self.columns - 1), min(max(down, 0), 4 * self.lines - 1)
