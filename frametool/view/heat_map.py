"""A sweep of two gains as two maps of colours: time to reach, and overshoot; empty where it never was within reach."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.view.shapes import Picture, PictureBox, PictureWords

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.sim.sweep import SweepResult
    from frametool.view.shapes import Shape

SIDE = 400.0  # pixels of a map
MARGIN = 70.0
BAR = 15.0
SHADES = 50  # of the bar
# viridis at five places, dark for little
STOPS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))


class GainMap(NamedTuple):
    """One map: what it shows, its values in a row for each linear gain, nan where there is none, and the gains."""

    title: str
    values: Sequence[Sequence[float]]
    linear: Sequence[float]
    angular: Sequence[float]

    @property
    def bounds(self) -> tuple[float, float]:
        """Return the least and the greatest value."""
        known = [value for row in self.values for value in row if value == value]  # noqa: PLR0124 - nan
        return (min(known), max(known)) if known else (0.0, 0.0)


def sweep_picture(gain_linear: Sequence[float], gain_angular: Sequence[float], result: SweepResult) -> Picture:
    """Draw both maps side by side."""
    columns = {"time to reach (s)": result.time_to_reach, "overshoot (m)": result.overshoot}
    maps = [GainMap(title, values.tolist(), gain_linear, gain_angular) for title, values in columns.items()]
    shapes = [shape for index, each in enumerate(maps) for shape in _map(each, MARGIN + index * (SIDE + 2.0 * MARGIN))]
    return Picture(2.0 * (SIDE + 2.0 * MARGIN), SIDE + 2.0 * MARGIN, shapes)


def _map(each: GainMap, left: float) -> Iterator[Shape]:
    """Draw one map: a rectangle for each pair, linear gains upwards, angular gains to the right."""
    high, wide = SIDE / len(each.linear), SIDE / len(each.angular)
    yield PictureWords(left, MARGIN - 16.0, each.title, size=14.0)
    for row, (linear, values) in enumerate(zip(each.linear, each.values, strict=True)):
        for column, (angular, value) in enumerate(zip(each.angular, values, strict=True)):
            label = f"linear {linear:g}, angular {angular:g}: {value:.4g}"
            x, y = left + column * wide, MARGIN + SIDE - (row + 1) * high
            yield PictureBox(x, y, wide, high, _colour(value, each.bounds), label)
    yield from _gains(each, left)
    yield from _bar(left + SIDE + 10.0, each.bounds)


def _gains(each: GainMap, left: float) -> Iterator[Shape]:
    """Name the gains at the ends of both sides."""
    below, bottom = MARGIN + SIDE + 14.0, MARGIN + SIDE
    yield PictureWords(left, below, f"{each.angular[0]:g}")
    yield PictureWords(left + SIDE / 2.0, below, "angular gain (1/s)", anchor="middle")
    yield PictureWords(left + SIDE, below, f"{each.angular[-1]:g}", anchor="end")
    yield PictureWords(left - 6.0, bottom - 6.0, f"{each.linear[0]:g}", anchor="end")
    yield PictureWords(left - 14.0, MARGIN + SIDE / 2.0, "linear gain (1/s)", anchor="middle", turn=-90.0)
    yield PictureWords(left - 6.0, MARGIN + 6.0, f"{each.linear[-1]:g}", anchor="end")


def _bar(left: float, bounds: tuple[float, float]) -> Iterator[Shape]:
    """Draw what the colours mean."""
    low, high = bounds
    for shade in range(SHADES):
        y = MARGIN + SIDE * (SHADES - 1 - shade) / SHADES
        yield PictureBox(left, y, BAR, SIDE / SHADES + 0.5, _colour(shade / (SHADES - 1), (0.0, 1.0)))
    yield PictureWords(left, MARGIN - 8.0, f"{high:.3g}")
    yield PictureWords(left, MARGIN + SIDE + 14.0, f"{low:.3g}")


def _colour(value: float, bounds: tuple[float, float]) -> str:
    """Return the colour of a value between its bounds; that of the paper for nan."""
    if value != value:  # noqa: PLR0124 - nan
        return "paper"
    low, high = bounds
    place = (value - low) / (high - low) * (len(STOPS) - 1) if high > low else 0.0
    at = min(int(place), len(STOPS) - 2)
    mixed = (round(a + (b - a) * (place - at)) for a, b in zip(STOPS[at], STOPS[at + 1], strict=True))
    return f"#{''.join(f'{part:02x}' for part in mixed)}"
