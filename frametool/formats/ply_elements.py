"""The elements of a binary PLY file that pass: where rows end is followed, so that a file that is cut is noticed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from frametool.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.formats.ply_head import PlyElement

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
