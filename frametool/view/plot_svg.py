"""A run as SVG, without any library: turtlesim's window at its own scale, beside it distance and commands over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple
from xml.sax.saxutils import escape

from frametool.sim.turtle import SIZE
from frametool.view.drawing import COLOURS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.sim.turtle import TurtleState
    from frametool.view.drawing import Drawing, Stroke

WINDOW = 500  # pixels, as turtlesim's
METRE = 45  # pixels
MARGIN = 30
LEFT = WINDOW + 110  # where the curves begin
WIDTH = LEFT + 420 + MARGIN
HEIGHT = WINDOW + 2 * MARGIN
BACKGROUND = "#4556ff"  # turtlesim's 69, 86, 255
INK = "#333"
LEAST_SPAN, FURTHEST = 1e-300, 1e300  # of values on an axis; what is beyond is drawn at its end
# the turtles' colours as they show on white
DARKENED = dict(
    zip(COLOURS, ("#c79a00", "#d4691b", "#1593ad", "#2a9d8f", "#d6458b", "#5a9a16", "#7d5fc7", "#666666"), strict=True)
)


class Panel(NamedTuple):
    """A diagram over time: title with unit, top and height in pixels, its lines (name, colour, times, values)."""

    title: str
    top: float
    height: float
    lines: Sequence[tuple[str, str, Sequence[float], Sequence[float]]]


def plot(drawing: Drawing) -> str:
    """Return the drawing as an SVG document."""
    rows = panels(drawing)
    parts = [*_window(drawing), *(part for panel in rows for part in _panel(panel))]
    return document(WIDTH if rows else HEIGHT, HEIGHT, parts)


def document(width: float, height: float, parts: Iterable[str]) -> str:
    """Return an SVG of this size in pixels, on white."""
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    style = f'font-family="sans-serif" font-size="12" fill="{INK}"'
    return f'{head} {style}>\n<rect width="100%" height="100%" fill="#fff"/>\n{"".join(parts)}</svg>\n'


def panels(drawing: Drawing) -> list[Panel]:
    """Return the diagrams of a drawing; none where nobody follows."""
    curves = {name: curve for name, curve in drawing.curves.items() if curve.times}
    if not curves:
        return []
    height = (WINDOW - 2 * 50) / 3
    colours = drawing.colours()
    rows = (("distance (m)", "distance"), ("linear.x (m/s)", "linear"), ("angular.z (rad/s)", "angular"))
    return [
        Panel(title, MARGIN + index * (height + 50), height, [
            (name, DARKENED[colours[name]], curve.times, getattr(curve, key)) for name, curve in curves.items()
        ])
        for index, (title, key) in enumerate(rows)
    ]  # fmt: skip


def _window(drawing: Drawing) -> Iterator[str]:
    """Draw the world: background, trails, turtles where they ended."""
    yield f'<svg x="{MARGIN}" y="{MARGIN}" width="{WINDOW}" height="{WINDOW}" viewBox="0 0 {WINDOW} {WINDOW}">\n'
    yield f'<rect width="{WINDOW}" height="{WINDOW}" fill="{BACKGROUND}"/>\n'
    yield from map(_stroke, drawing.strokes)
    colours = drawing.colours()
    yield from (_turtle(name, state, colours[name]) for name, state in drawing.turtles.items())
    yield "</svg>\n"


def _stroke(stroke: Stroke) -> str:
    pen = stroke.pen
    points = " ".join(f"{_number(x * METRE)},{_number((SIZE - y) * METRE)}" for x, y in stroke.points)
    return (
        f'<polyline points="{points}" fill="none" stroke="rgb({pen.r},{pen.g},{pen.b})" stroke-width="{pen.width}" '
        f'stroke-linecap="round" stroke-linejoin="round"><title>{escape(stroke.turtle)}</title></polyline>\n'
    )


def _turtle(name: str, state: TurtleState, colour: str) -> str:
    """Draw a turtle from above: shell, head and feet; nose along its heading."""
    place = f"translate({_number(state.x * METRE)} {_number((SIZE - state.y) * METRE)})"
    feet = "".join(f'<circle cx="{x}" cy="{y}" r="4"/>' for x in (-9, 9) for y in (-11, 11))
    return (
        f'<g transform="{place}"><g transform="rotate({_number(-math.degrees(state.theta))})" fill="{colour}" '
        f'stroke="{INK}">{feet}<circle cx="17" r="5"/><ellipse rx="14" ry="12"/></g>'
        f'<text y="-20" text-anchor="middle" fill="#fff">{escape(name)}</text></g>\n'
    )


def _panel(panel: Panel) -> Iterator[str]:
    """Draw a diagram: frame, ticks, lines, and their names."""
    width = WIDTH - LEFT - MARGIN
    x_ticks = ticks(0.0, max(max(times) for _, _, times, _ in panel.lines))
    y_ticks = ticks(*_bounds(value for line in panel.lines for value in line[3]))
    right, low, high = x_ticks[-1], y_ticks[0], y_ticks[-1]

    def across(t: float) -> str:
        return _number(LEFT + width * t / right)

    def down(value: float) -> str:
        return _number(panel.top + panel.height * (high - min(max(value, low), high)) / (high - low))

    bottom = _number(panel.top + panel.height)
    yield f'<text x="{LEFT}" y="{_number(panel.top - 8)}">{panel.title}</text>\n'
    for tick in y_ticks:
        yield f'<path d="M{LEFT} {down(tick)}H{LEFT + width}" stroke="#ddd"/>'
        yield f'<text x="{LEFT - 6}" y="{down(tick)}" dy="4" text-anchor="end">{tick:g}</text>\n'
    for tick in x_ticks:
        unit = " s" if tick == right else ""
        yield f'<text x="{across(tick)}" y="{bottom}" dy="15" text-anchor="middle">{tick:g}{unit}</text>\n'
    for index, (name, colour, times, values) in enumerate(panel.lines):
        points = " ".join(f"{across(t)},{down(value)}" for t, value in zip(times, values, strict=True))
        yield f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>\n'
        place = f'x="{LEFT + width - 80 * index}" y="{_number(panel.top - 8)}"'
        yield f'<text {place} text-anchor="end" fill="{colour}">{escape(name)}</text>\n'


def ticks(low: float, high: float) -> list[float]:
    """Return round numbers that enclose two values: 1, 2 or 5 times a power of ten apart, four to ten of them."""
    span = high - low if high - low > LEAST_SPAN else 1.0
    step = 10.0 ** math.floor(math.log10(span / 4.0))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if span / (step * factor) <= 6.0)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [count * step for count in range(first, max(last, first + 1) + 1)]


def _bounds(values: Iterable[float]) -> tuple[float, float]:
    """Return the least and the greatest value, zero included, as far as an axis reaches."""
    known = [0.0, *values]
    return max(min(known), -FURTHEST), min(max(known), FURTHEST)


def _number(value: float) -> str:
    """Write pixels with a tenth's precision."""
    return f"{round(value, 1) + 0.0:g}" if abs(value) < 1e4 else f"{value:.0f}"
