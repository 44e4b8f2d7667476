"""A picture of dots in a terminal: braille characters, eight dots a cell, one colour a cell. Memory does not grow."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column of a cell


class Canvas:
    """A square of so many cells, twice as many across as down; places run from 0 to 1, y up."""

    def __init__(self, lines: int) -> None:
        """Make an empty one; a terminal's cell is about twice as high as wide."""
        self.lines = lines
        self.columns = 2 * lines
        self._cells: dict[tuple[int, int], tuple[int, str]] = {}

    def clear(self) -> None:
        """Wipe all dots."""
        self._cells.clear()

    def dot(self, x: float, y: float, colour: str) -> None:
        """Set a dot; the cell takes its colour."""
        across, down = self._dots(x, y)
        cell = down // 4, across // 2
        bits, _ = self._cells.get(cell, (0, colour))
        self._cells[cell] = bits | DOTS[down % 4][across % 2], colour

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return line and column of a place."""
        across, down = self._dots(x, y)
        return down // 4, across // 2

    def row(self, line: int) -> Iterator[tuple[str, str]]:
        """Yield the characters of a line, each with its colour."""
        for column in range(self.columns):
            bits, colour = self._cells.get((line, column), (0, ""))
            yield (chr(BRAILLE + bits) if bits else " "), colour

    def _dots(self, x: float, y: float) -> tuple[int, int]:
        across = int(x * 2 * self.columns)
        down = int((1.0 - y) * 4 * self.lines)
        return min(max(across, 0), 2 * self.columns - 1), min(max(down, 0), 4 * self.lines - 1)
