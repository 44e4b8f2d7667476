"""Charts: lines over axes with round numbers, each axis with its name and unit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.view.pictures import PictureDot, PictureLine, PictureWords
from frametool.view.scene import text_width

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.view.pictures import Shape

    Range = tuple[float, float]
    Point = tuple[float, float]

LEAST_SPAN, FURTHEST = 1e-300, 1e300  # of values on an axis; what is beyond is drawn at its end


class Area(NamedTuple):
    """The plot area of a chart in pixels, without its labels."""

    left: float
    top: float
    width: float
    height: float


class ChartLine(NamedTuple):
    """A line in data coordinates; a line without a name is not in the legend."""

    name: str
    colour: str
    points: Sequence[Point]
    width: float = 1.5
    dashes: tuple[float, ...] = ()
    dots: bool = False


class Chart:
    """Two axes in a plot area, and the mapping from data to pixels."""

    def __init__(self, area: Area, x: Range, y: Range, names: tuple[str, str], *, equal: bool = False) -> None:
        """Choose the limits of both axes.

        names: titles of the x and the y axis, with units.  equal: use one scale for both axes.
        """
        self.area, self.names = area, names
        if equal:
            pixels = min(size / max(end - begin, 1e-9) for size, (begin, end) in zip(area[2:], (x, y), strict=True))
            x, y = (((begin + end - size / pixels) / 2.0, (begin + end + size / pixels) / 2.0)
                    for size, (begin, end) in zip(area[2:], (x, y), strict=True))  # fmt: skip
        limits = [(max(begin, -FURTHEST), min(end, FURTHEST)) for begin, end in (x, y)]
        self.ticks = [ticks(*each) for each in limits]
        self.x, self.y = ((each[0], each[-1]) for each in self.ticks)
        if x[1] - x[0] > LEAST_SPAN:  # ends where the values do
            self.x = limits[0]
        if equal:
            self.y = limits[1]
        self.ticks = [[at for at in each if begin <= at <= end]
                      for each, (begin, end) in zip(self.ticks, (self.x, self.y), strict=True)]  # fmt: skip

    def place(self, x: float, y: float) -> Point:
        """Return the pixels of a point; values beyond the y axis are clamped to its ends."""
        left, top, width, height = self.area
        inside = min(max(y, self.y[0]), self.y[1])
        across = left + width * (x - self.x[0]) / (self.x[1] - self.x[0])
        return across, top + height * (self.y[1] - inside) / (self.y[1] - self.y[0])

    def drawn(self, lines: Sequence[ChartLine] = ()) -> Iterator[Shape]:
        """Draw axes, lines and the legend."""
        left, top, width, height = self.area
        right, bottom = left + width, top + height
        yield PictureWords(left, top - 14.0, self.names[1], "soft")
        if self.names[0]:
            yield PictureWords(right, bottom + 30.0, self.names[0], "soft", "end")
        for tick in self.ticks[0]:
            across = self.place(tick, 0.0)[0]
            yield PictureLine([(across, top), (across, bottom)], "faint")
            yield PictureWords(across, bottom + 13.0, f"{tick:g}", "soft", "middle", 11.0)
        for tick in self.ticks[1]:
            down = self.place(0.0, tick)[1]
            yield PictureLine([(left, down), (right, down)], "faint" if tick else "zero")
            yield PictureWords(left - 7.0, down, f"{tick:g}", "soft", "end", 11.0)
        for line in lines:
            points = [self.place(*point) for point in line.points]
            if points:
                yield PictureLine(points, line.colour, line.width, dashes=line.dashes, title=line.name)
            yield from (PictureDot(x, y, 3.0, line.colour) for x, y in points if line.dots)
        yield from legend(lines, left + text_width(self.names[1]), right, top - 14.0)


def legend(lines: Sequence[ChartLine], left: float, right: float, y: float) -> Iterator[Shape]:
    """Draw a right-aligned legend on one line, each name after its line; of a long one only dashed lines."""
    named = [line for line in lines if line.name]
    if sum(text_width(line.name) + 33.0 for line in named) > right - left:
        named = [line for line in named if line.dashes]
    for line in reversed(named):
        yield PictureWords(right, y, line.name, "ink", "end", 11.0)
        right -= text_width(line.name) + 5.0
        yield PictureLine([(right - 16.0, y), (right, y)], line.colour, max(line.width, 2.0), dashes=line.dashes)
        right -= 28.0


def ticks(low: float, high: float) -> list[float]:
    """Return 2 to 10 round numbers that enclose two values, spaced 1, 2 or 5 times a power of ten."""
    span = high - low if high - low > LEAST_SPAN else 1.0
    step = 10.0 ** math.floor(math.log10(span / 4.0))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if span / (step * factor) <= 6.0)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [count * step for count in range(first, max(last, first + 1) + 1)]
