"""What a plot shows of a run: the turtles' trails by pen, and each follower's distance and commands over time."""

from __future__ import annotations

import math
from itertools import cycle
from typing import TYPE_CHECKING, NamedTuple

from frametool.frames.stamps import BILLION

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.sim.scene import Scene
    from frametool.sim.simulate import SimulationStep
    from frametool.sim.turtle import Pen, TurtleState

    Point = tuple[float, float]

# where pens have all one colour, curves and turtles still differ: one colour a turtle, in the order of their names
COLOURS = ("#f4d35e", "#ee964b", "#7bdff2", "#b2f7ef", "#f7a1c4", "#c3f584", "#d0bdf4", "#ffffff")

SHORT = 0.05  # metres, two pixels
FLAT = 1e-6  # metres; small, because the points left out before are not looked at again


class Stroke(NamedTuple):
    """A line drawn with one pen: points in metres, y up."""

    turtle: str
    pen: Pen
    points: list[Point]


class Curves(NamedTuple):
    """A follower over time: seconds, metres, m/s, rad/s, one of each a control step."""

    times: list[float]
    distance: list[float]
    linear: list[float]
    angular: list[float]


def colours_of(turtles: Iterable[str]) -> dict[str, str]:
    """Return a colour for each turtle, in the order of their names."""
    return dict(zip(sorted(turtles), cycle(COLOURS), strict=False))


class Drawing:
    """Remember of the steps what a plot shows; turtles that do not move add nothing."""

    def __init__(self, scene: Scene) -> None:
        """Create the drawing of a run that has not begun."""
        self.strokes: list[Stroke] = []
        self.turtles: dict[str, TurtleState] = {}
        self.curves: dict[str, Curves] = {name: Curves([], [], [], []) for name in scene.followers}
        self._current: dict[str, Stroke] = {}
        self._clears = 0

    def watch(self, step: SimulationStep) -> None:
        """Add a step to the drawing."""
        if step.is_tick:
            self._wipe_if_cleared(step)
            self.turtles = step.states
            for name in step.states:
                self._draw(name, step)
        for command in step.commands:
            curves = self.curves[command.turtle]
            curves.times.append(step.t_ns / BILLION)
            curves.distance.append(command.distance or 0.0)
            curves.linear.append(command.twist.linear_x)
            curves.angular.append(command.twist.angular_z)

    def colours(self) -> dict[str, str]:
        """Return the colour of every turtle: `#rrggbb`."""
        return colours_of({*self.turtles, *self.curves})

    def _wipe_if_cleared(self, step: SimulationStep) -> None:
        if step.clears != self._clears:
            self._clears = step.clears
            self.strokes.clear()
            self._current.clear()

    def _draw(self, name: str, step: SimulationStep) -> None:
        """Go on with a turtle's stroke, or begin one with its new pen."""
        x, y, _ = step.states[name]
        pen = step.pens[name]
        stroke = self._current.get(name)
        if stroke is None or stroke.pen != pen:
            begin = [stroke.points[-1]] if stroke is not None else []
            stroke = self._current[name] = Stroke(name, pen, begin)
            if not pen.off:
                self.strokes.append(stroke)
        _extend(stroke.points, (x, y))


def _extend(points: list[Point], place: Point) -> None:
    """Go on to a place; a point on the straight way there is not kept."""
    if len(points) > 1 and _is_straight(points[-2], points[-1], place):
        points[-1] = place
    elif not points or points[-1] != place:
        points.append(place)


def _is_straight(begin: Point, middle: Point, end: Point) -> bool:
    """Tell whether the middle lies between both ends, and so near to the line through them that nobody sees it."""
    ahead_x, ahead_y = middle[0] - begin[0], middle[1] - begin[1]
    on_x, on_y = end[0] - middle[0], end[1] - middle[1]
    if ahead_x * on_x + ahead_y * on_y <= 0.0:
        return False
    length = math.hypot(ahead_x + on_x, ahead_y + on_y)
    return length < SHORT or abs(ahead_x * on_y - ahead_y * on_x) < FLAT * length
