"""A sweep of two gains as two maps of colours: time to reach, and overshoot; empty where it never was within reach."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.view.plot_svg import document

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.sim.sweep import SweepResult

SIDE = 400  # pixels of a map
MARGIN = 70
BAR = 15
# viridis at five places, dark for little
STOPS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))


class Map(NamedTuple):
    """One map: what it shows, and a row of values for each linear gain; nan is left empty."""

    title: str
    values: Sequence[Sequence[float]]

    @property
    def bounds(self) -> tuple[float, float]:
        """Return the least and the greatest value."""
        known = [value for row in self.values for value in row if value == value]  # noqa: PLR0124 - nan
        return (min(known), max(known)) if known else (0.0, 0.0)


def plot(gain_linear: Sequence[float], gain_angular: Sequence[float], many: SweepResult, suffix: str) -> str | bytes:
    """Return the maps as a picture of the kind that a suffix names: .svg, .html, .png."""
    maps = [Map("time to reach (s)", many.time_to_reach.tolist()), Map("overshoot (m)", many.overshoot.tolist())]
    if suffix == ".png":
        return _png(maps, gain_linear, gain_angular)
    parts = [part for index, each in enumerate(maps) for part in _map(each, index, gain_linear, gain_angular)]
    svg = document(2 * (SIDE + 2 * MARGIN), SIDE + 2 * MARGIN, parts)
    return svg if suffix == ".svg" else f'<!DOCTYPE html>\n<meta charset="utf-8"><title>sweep</title>\n{svg}'


def _map(each: Map, index: int, gain_linear: Sequence[float], gain_angular: Sequence[float]) -> Iterator[str]:
    """Draw one map: a rectangle for each pair, linear gains upwards, angular gains to the right."""
    left, top = MARGIN + index * (SIDE + 2 * MARGIN), MARGIN
    high, wide = SIDE / len(gain_linear), SIDE / len(gain_angular)
    yield f'<text x="{left}" y="{top - 12}" font-size="14">{each.title}</text>\n'
    for row, values in enumerate(each.values):
        for column, value in enumerate(values):
            corner = f'x="{left + column * wide:.2f}" y="{top + SIDE - (row + 1) * high:.2f}"'
            label = f"linear {gain_linear[row]:g}, angular {gain_angular[column]:g}: {value:.4g}"
            look = f'width="{wide:.2f}" height="{high:.2f}" fill="{_colour(value, each.bounds)}"'
            yield f"<rect {corner} {look}><title>{label}</title></rect>\n"
    yield from _axes(left, top, gain_linear, gain_angular)
    yield from _bar(left + SIDE + 10, top, each.bounds)


def _axes(left: float, top: float, gain_linear: Sequence[float], gain_angular: Sequence[float]) -> Iterator[str]:
    """Name the gains at the ends of both sides."""
    below = top + SIDE + 16
    yield f'<text x="{left}" y="{below}">{gain_angular[0]:g}</text>'
    yield f'<text x="{left + SIDE}" y="{below}" text-anchor="end">{gain_angular[-1]:g}</text>'
    yield f'<text x="{left + SIDE / 2}" y="{below}" text-anchor="middle">angular gain (1/s)</text>\n'
    yield f'<text x="{left - 6}" y="{top + SIDE}" text-anchor="end">{gain_linear[0]:g}</text>'
    yield f'<text x="{left - 6}" y="{top + 10}" text-anchor="end">{gain_linear[-1]:g}</text>'
    turned = f"translate({left - 12} {top + SIDE / 2}) rotate(-90)"
    yield f'<text transform="{turned}" text-anchor="middle">linear gain (1/s)</text>\n'


def _bar(left: float, top: float, bounds: tuple[float, float]) -> Iterator[str]:
    """Draw what the colours mean."""
    low, high = bounds
    for step in range(50):
        colour = _colour(step / 49, (0.0, 1.0))
        corner = f'x="{left}" y="{top + SIDE * (49 - step) / 50:.1f}"'
        yield f'<rect {corner} width="{BAR}" height="{SIDE / 50 + 0.5}" fill="{colour}"/>'
    yield f'\n<text x="{left}" y="{top - 4}">{high:.3g}</text><text x="{left}" y="{top + SIDE + 14}">{low:.3g}</text>\n'


def _colour(value: float, bounds: tuple[float, float]) -> str:
    """Return the colour of a value between its bounds; none for nan."""
    if value != value:  # noqa: PLR0124 - nan
        return "none"
    low, high = bounds
    place = (value - low) / (high - low) * (len(STOPS) - 1) if high > low else 0.0
    at = min(int(place), len(STOPS) - 2)
    mixed = (round(a + (b - a) * (place - at)) for a, b in zip(STOPS[at], STOPS[at + 1], strict=True))
    return f"#{''.join(f'{part:02x}' for part in mixed)}"


def _png(maps: Sequence[Map], gain_linear: Sequence[float], gain_angular: Sequence[float]) -> bytes:
    """Draw the maps with matplotlib."""
    from frametool.view.plot_png import as_png, figure

    drawn: Any = figure(11.0, 4.6)
    sides = {"xlabel": "angular gain (1/s)", "ylabel": "linear gain (1/s)"}
    ends = (gain_angular[0], gain_angular[-1], gain_linear[0], gain_linear[-1])
    extent = ends if ends[0] != ends[1] and ends[2] != ends[3] else None
    for index, each in enumerate(maps):
        axes = drawn.add_subplot(1, 2, index + 1, title=each.title, **sides)
        drawn.colorbar(axes.imshow(each.values, origin="lower", aspect="auto", extent=extent))
    return as_png(drawn)
