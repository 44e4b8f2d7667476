"""A run of turtles as a picture: turtlesim's window at its own scale, beside it distance and commands over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple
from xml.sax.saxutils import escape

from frametool.errors import printable
from frametool.sim.turtle import SIZE
from frametool.view.drawing import COLOURS
from frametool.view.shapes import Picture, PictureBox, PictureDot, PictureLine, PictureWords

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.sim.turtle import TurtleState
    from frametool.view.drawing import Drawing
    from frametool.view.shapes import Shape

WINDOW = 500.0  # pixels, as turtlesim's
METRE = 45.0  # pixels
MARGIN = 30.0
LEFT = WINDOW + 110.0  # where the curves begin
PANEL_WIDTH = 420.0
PANEL_GAP = 50.0
HEIGHT = WINDOW + 2.0 * MARGIN
BACKGROUND = "#4556ff"  # turtlesim's 69, 86, 255
WHITE = "#ffffff"
LEAST_SPAN, FURTHEST = 1e-300, 1e300  # of values on an axis; what is beyond is drawn at its end
# the turtles' colours as they show on white
DARKENED = dict(
    zip(COLOURS, ("#c79a00", "#d4691b", "#1593ad", "#2a9d8f", "#d6458b", "#5a9a16", "#7d5fc7", "#666666"), strict=True)
)
PANELS = (("distance (m)", "distance"), ("linear.x (m/s)", "linear"), ("angular.z (rad/s)", "angular"))
COLUMNS = ("follower", "t (s)", "distance (m)", "linear.x (m/s)", "angular.z (rad/s)")
FEET = [(x, y, 4.0) for x in (-9.0, 9.0) for y in (-11.0, 11.0)]


class Curve(NamedTuple):
    """One line of a diagram over time: seconds and values."""

    name: str
    colour: str
    times: Sequence[float]
    values: Sequence[float]


def run_picture(drawing: Drawing) -> Picture:
    """Draw the run; the diagrams are left out where nobody follows."""
    followed = {name: curve for name, curve in drawing.curves.items() if curve.times}
    shapes = list(_window(drawing))
    colours = drawing.colours()
    for index, (title, key) in enumerate(PANELS if followed else ()):
        curves = [
            Curve(name, DARKENED[colours[name]], each.times, getattr(each, key)) for name, each in followed.items()
        ]
        height = (WINDOW - 2.0 * PANEL_GAP) / 3.0
        shapes += _panel(title, curves, MARGIN + index * (height + PANEL_GAP), height)
    return Picture(LEFT + PANEL_WIDTH + MARGIN if followed else HEIGHT, HEIGHT, shapes, "turtles")


def last_commands(drawing: Drawing) -> str:
    """Return an HTML table of what each follower saw and did last."""
    rows = "".join(
        f"<tr><td>{escape(printable(name))}</td><td>{curve.times[-1]:g}</td><td>{curve.distance[-1]:.4f}</td>"
        f"<td>{curve.linear[-1]:.4f}</td><td>{curve.angular[-1]:.4f}</td></tr>\n"
        for name, curve in drawing.curves.items()
        if curve.times
    )
    head = "".join(f"<th>{title}</th>" for title in COLUMNS)
    return f"<table>\n<tr>{head}</tr>\n{rows}</table>\n" if rows else ""


def _place(x: float, y: float) -> tuple[float, float]:
    """Return the pixels of a place in the world."""
    return MARGIN + x * METRE, MARGIN + (SIZE - y) * METRE


def _window(drawing: Drawing) -> Iterator[Shape]:
    """Draw the world: background, trails, turtles where they ended."""
    yield PictureBox(MARGIN, MARGIN, WINDOW, WINDOW, BACKGROUND)
    for stroke in drawing.strokes:
        red, green, blue, width, _ = stroke.pen
        colour = f"#{red:02x}{green:02x}{blue:02x}"
        yield PictureLine([_place(*point) for point in stroke.points], colour, width, title=stroke.turtle)
    colours = drawing.colours()
    for name, state in drawing.turtles.items():
        yield from _turtle(name, state, colours[name])


def _turtle(name: str, state: TurtleState, colour: str) -> Iterator[Shape]:
    """Draw a turtle from above: feet, head along its heading, shell."""
    x, y = _place(state.x, state.y)
    cosine, sine = math.cos(state.theta), math.sin(state.theta)
    for ahead, left, radius in (*FEET, (17.0, 0.0, 5.0), (0.0, 0.0, 13.0)):
        across, down = x + cosine * ahead - sine * left, y - sine * ahead - cosine * left
        yield PictureDot(across, down, radius + 1.0, "#333333")
        yield PictureDot(across, down, radius, colour)
    yield PictureWords(x, y - 24.0, name, WHITE, "middle")


def _panel(title: str, curves: Sequence[Curve], top: float, height: float) -> Iterator[Shape]:
    """Draw a diagram: ticks, lines, and their names."""
    x_ticks = ticks(0.0, max(max(curve.times) for curve in curves))
    y_ticks = ticks(*_bounds(value for curve in curves for value in curve.values))
    last, low, high = x_ticks[-1], y_ticks[0], y_ticks[-1]

    def place(t: float, value: float) -> tuple[float, float]:
        inside = min(max(value, low), high)
        return LEFT + PANEL_WIDTH * t / last, top + height * (high - inside) / (high - low)

    yield PictureWords(LEFT, top - 12.0, title)
    for tick in y_ticks:
        yield PictureLine([place(0.0, tick), place(last, tick)], "faint")
        yield PictureWords(LEFT - 6.0, place(0.0, tick)[1], f"{tick:g}", anchor="end")
    for tick in x_ticks:
        seconds = f"{tick:g}{' s' * (tick == last)}"
        yield PictureWords(place(tick, low)[0], top + height + 12.0, seconds, anchor="middle")
    for index, (name, colour, times, values) in enumerate(curves):
        points = [place(t, value) for t, value in zip(times, values, strict=True)]
        yield PictureLine(points, colour, 1.5, title=name)
        yield PictureWords(LEFT + PANEL_WIDTH - 80.0 * index, top - 12.0, name, colour, "end")


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
