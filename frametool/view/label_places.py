"""Names beside points, none over another: a grid of cells holds what is taken, so that only near ones are compared."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.view.projection import Flat, Projection

    Box = tuple[float, float, float, float]  # left, top, right, bottom

CELL = 64.0  # pixels
DISTANCES = (9.0, 16.0, 26.0, 40.0, 58.0, 80.0)  # pixels from a frame to its name
SIDES = ((1.0, -0.6), (1.0, 0.6), (-1.0, -0.6), (-1.0, 0.6), (0.0, -1.3), (0.0, 1.3), (1.0, 0.0), (-1.0, 0.0))
SAME = 3.0  # pixels within which frames share a name
LONGEST = 60  # characters of a name
WIDE, THIN = "mwMW_@", "il.·tfjrI "


class Label(NamedTuple):
    """A name's place: its words, the point it belongs to, its rectangle, and how far it stands off."""

    words: str
    point: Flat
    box: Box
    away: float


class TakenBoxes:
    """Rectangles that nothing may be put over.

    Of those that are the same to a pixel one is kept: a million frames on one spot cost their names no more than one.
    """

    def __init__(self) -> None:
        """Create an empty grid."""
        self._cells: dict[tuple[int, int], list[Box]] = {}
        self._known: set[tuple[int, ...]] = set()

    def add(self, box: Box) -> None:
        """Take a rectangle."""
        rounded = tuple(map(round, box))
        if rounded in self._known:
            return
        self._known.add(rounded)
        for cell in _cells(box):
            self._cells.setdefault(cell, []).append(box)

    def meets(self, box: Box) -> bool:
        """Tell whether a rectangle lies over one that is taken."""
        left, top, right, bottom = box
        return any(
            left < other[2] and right > other[0] and top < other[3] and bottom > other[1]
            for cell in _cells(box)
            for other in self._cells.get(cell, ())
        )


def _cells(box: Box) -> Iterator[tuple[int, int]]:
    left, top, right, bottom = (math.floor(edge / CELL) for edge in box)
    for column in range(left, right + 1):
        for row in range(top, bottom + 1):
            yield column, row


def place_labels(flat: Projection, *, font: float = 12.0, blocked: Iterable[Box] = ()) -> tuple[list[Label], int]:
    """Place a name beside every group of frames that lie on one point, the nearest to the eye first.

    font: its size in pixels.  blocked: what else stands on the picture.
    Returns the places, and how many names found none.
    """
    taken, axes = TakenBoxes(), TakenBoxes()
    for box in blocked:
        taken.add(box)
    for name in flat.poses:
        x, y, _ = flat.origin(name)
        taken.add((x - 3.0, y - 3.0, x + 3.0, y + 3.0))
        for part in (0.4, 0.7, 1.0):
            for tip in flat.tips(name, part):
                axes.add((tip.x - 2.0, tip.y - 2.0, tip.x + 2.0, tip.y + 2.0))
    placed, hidden = [], 0
    for point, names in flat.groups(SAME):
        words = words_of(names)
        found = _free_spot(_spots(flat, words, point, font), taken, axes)
        if found is None:
            hidden += len(names)
        else:
            taken.add(found.box)
            placed.append(found)
    return placed, hidden


def _free_spot(spots: Iterable[Label], taken: TakenBoxes, axes: TakenBoxes) -> Label | None:
    """Return the first spot over nothing at all, or else the first that is only over axes."""
    second = None
    for spot in spots:
        if taken.meets(spot.box):
            continue
        if not axes.meets(spot.box):
            return spot
        second = second or spot
    return second


def _spots(flat: Projection, words: str, point: Flat, font: float) -> Iterator[Label]:
    """Yield where a name might stand inside the picture, the best first."""
    wide = width_of(words, font)
    for away in DISTANCES:
        for dx, dy in SIDES:
            left = point.x + dx * away - (wide if dx < 0.0 else wide / 2.0 if dx == 0.0 else 0.0)
            middle = point.y + dy * away
            box = left - 2.0, middle - 0.62 * font, left + wide + 2.0, middle + 0.62 * font
            if box[0] > 2.0 and box[2] < flat.size.width - 2.0 and box[1] > 2.0 and box[3] < flat.size.height - 2.0:
                yield Label(words, point, box, away)


def words_of(names: list[str], most: int = 2) -> str:
    """Return the words for frames on one point: some of their names, and how many more there are."""
    words = " · ".join(_cut(name) for name in names[:most])
    return words + (f" +{len(names) - most}" if len(names) > most else "")


def _cut(name: str) -> str:
    name = printable(name)
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"


def width_of(words: str, font: float) -> float:
    """Guess the width of a text in pixels; a little too much rather than too little."""
    return font * sum(0.9 if letter in WIDE else 0.36 if letter in THIN else 0.62 for letter in words) + 2.0
