"""Plots of turtle runs: turtlesim's window, and charts of distance and commands."""

from __future__ import annotations

import math
from itertools import cycle
from typing import TYPE_CHECKING, NamedTuple

from frametool.frames.stamps import BILLION
from frametool.sim.turtle import SIZE
from frametool.view.pictures import Area, Chart, ChartLine, Picture, PictureBox, PictureDot, PictureLine, PictureWords

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.sim.scene import Scene
    from frametool.sim.simulate import SimulationStep
    from frametool.sim.turtle import Pen, TurtleState
    from frametool.view.pictures import Shape

    Point = tuple[float, float]

# where pens have all one colour, curves and turtles still differ: one colour a turtle, in the order of their names
COLOURS = ("#f4d35e", "#ee964b", "#7bdff2", "#b2f7ef", "#f7a1c4", "#c3f584", "#d0bdf4", "#ffffff")

SHORT = 0.05  # metres: two pixels


class Stroke(NamedTuple):
    """A line drawn with one pen; points in metres, y up."""

    turtle: str
    pen: Pen
    points: list[Point]


def colours_of(turtles: Iterable[str]) -> dict[str, str]:
    """Return a colour for each turtle, in the order of their names."""
    return dict(zip(sorted(turtles), cycle(COLOURS), strict=False))


class Drawing:
    """Collect what a plot shows of a run; turtles that do not move take no memory."""

    def __init__(self, scene: Scene) -> None:
        """Create an empty drawing."""
        self.strokes: list[Stroke] = []
        self.turtles: dict[str, TurtleState] = {}
        # of each follower, for each control step: seconds, metres, m/s, rad/s
        self.curves: dict[str, list[tuple[float, ...]]] = {name: [] for name in scene.followers}
        self._current: dict[str, Stroke] = {}
        self._clears = 0

    def watch(self, step: SimulationStep) -> None:
        """Add a step to the drawing."""
        if step.is_tick:
            if step.clears != self._clears:
                self._clears = step.clears
                self.strokes.clear()
                self._current.clear()
            self.turtles = step.states
            for name in step.states:
                self._draw(name, step)
        for command in step.commands:
            ahead, turning, _ = command.twist
            self.curves[command.turtle].append((step.t_ns / BILLION, command.distance or 0.0, ahead, turning))

    def colours(self) -> dict[str, str]:
        """Return the colour of every turtle: `#rrggbb`."""
        return colours_of({*self.turtles, *self.curves})

    def _draw(self, name: str, step: SimulationStep) -> None:
        """Extend a turtle's stroke, or begin one with a new pen."""
        x, y, _ = step.states[name]
        pen = step.pens[name]
        stroke = self._current.get(name)
        if stroke is None or stroke.pen != pen:
            begin = [stroke.points[-1]] if stroke is not None else []
            stroke = self._current[name] = Stroke(name, pen, begin)
            if not pen.off:
                self.strokes.append(stroke)
        if not stroke.points or math.dist(stroke.points[-1], (x, y)) > SHORT:
            stroke.points.append((x, y))


WINDOW = 500.0  # pixels, as turtlesim's
METRE = 45.0  # pixels
MARGIN = 30.0
LEFT = WINDOW + 110.0  # where the curves begin
PANEL_WIDTH = 420.0
PANEL_GAP = 50.0
HEIGHT = WINDOW + 2.0 * MARGIN
BACKGROUND = "#4556ff"  # turtlesim's 69, 86, 255
WHITE = "#ffffff"
# the turtles' colours as they show on white
DARKENED = dict(
    zip(COLOURS, ("#c79a00", "#d4691b", "#1593ad", "#2a9d8f", "#d6458b", "#5a9a16", "#7d5fc7", "#666666"), strict=True)
)
PANELS = ("distance (m)", "linear.x (m/s)", "angular.z (rad/s)")  # as the numbers of curves after the times
FEET = [(x, y, 4.0) for x in (-9.0, 9.0) for y in (-11.0, 11.0)]


def run_picture(drawing: Drawing) -> Picture:
    """Draw the run; without followers there are no charts."""
    followed = {name: rows for name, rows in drawing.curves.items() if rows}
    shapes = list(_window(drawing))
    colours = drawing.colours()
    height = (WINDOW - 2.0 * PANEL_GAP) / 3.0
    for index, title in enumerate(PANELS if followed else ()):
        curves = [
            ChartLine(name, DARKENED[colours[name]], [(row[0], row[index + 1]) for row in rows])
            for name, rows in followed.items()
        ]
        area = Area(LEFT, MARGIN + index * (height + PANEL_GAP), PANEL_WIDTH, height)
        names = ("time (s)" * (title == PANELS[-1]), title)
        shapes += Chart(area, names, curves).drawn()
    return Picture(LEFT + PANEL_WIDTH + MARGIN if followed else HEIGHT, HEIGHT, shapes, "turtles")


def _place(x: float, y: float) -> tuple[float, float]:
    """Return the pixels of a position in the world."""
    return MARGIN + x * METRE, MARGIN + (SIZE - y) * METRE


def _window(drawing: Drawing) -> Iterator[Shape]:
    """Draw the world: background, trails, final turtles."""
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
