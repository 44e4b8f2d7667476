"""Runs of turtles: a plot of turtlesim's window with charts of distance and commands, a live screen, and a page."""

from __future__ import annotations

import math
from itertools import cycle
from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import printable
from frametool.frames.buffer import TransformBuffer
from frametool.frames.stamps import BILLION
from frametool.sim.turtle import SIZE
from frametool.view.pictures import ChartLine, Picture, box, dot, line, stacked, words
from frametool.view.progress import coloured_console
from frametool.view.stills import ARROWS, Canvas

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import Self

    from rich.console import Console
    from rich.panel import Panel

    from frametool.sim.scene import Scene
    from frametool.sim.simulate import IssuedCommand, SimulationStep
    from frametool.sim.turtle import Pen, TurtleState
    from frametool.view.pictures import Point, SvgElement

# where pens have all one colour, curves and turtles still differ: one colour a turtle, in the order of their names;
# the second is how it shows on white
COLOURS = {
    "#f4d35e": "#c79a00", "#ee964b": "#d4691b", "#7bdff2": "#1593ad", "#b2f7ef": "#2a9d8f",
    "#f7a1c4": "#d6458b", "#c3f584": "#5a9a16", "#d0bdf4": "#7d5fc7", "#ffffff": "#666666",
}  # fmt: skip
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


WINDOW, METRE, BACKGROUND = 500.0, 45.0, (69, 86, 255)  # pixels and colour, as turtlesim's
MARGIN = 30.0
LEFT = WINDOW + 110.0  # where the curves begin
PANEL_WIDTH, PANEL_GAP = 420.0, 50.0
HEIGHT = WINDOW + 2.0 * MARGIN
PANELS = ("distance (m)", "linear.x (m/s)", "angular.z (rad/s)")  # as the numbers of curves after the times
# circles of a turtle: pixels ahead and to the left, radius: feet, head, shell
BODY = (*((x, y, 4.0) for x in (-9.0, 9.0) for y in (-11.0, 11.0)), (17.0, 0.0, 5.0), (0.0, 0.0, 13.0))


def run_picture(drawing: Drawing) -> Picture:
    """Draw the run; without followers there are no charts."""
    colours = colours_of({*drawing.turtles, *drawing.curves})
    shapes = [*_window(drawing, colours)]
    followed = {name: rows for name, rows in drawing.curves.items() if rows}
    panels = {
        title: [ChartLine(name, COLOURS[colours[name]], [(row[0], row[at]) for row in rows])
                for name, rows in followed.items()]
        for at, title in enumerate(PANELS if followed else (), 1)
    }  # fmt: skip
    area = LEFT, MARGIN, PANEL_WIDTH, (WINDOW - 2.0 * PANEL_GAP) / len(PANELS)
    shapes += (shape for chart in stacked(area, PANEL_GAP, "time (s)", panels) for shape in chart.drawn())
    return Picture(LEFT + PANEL_WIDTH + MARGIN if followed else HEIGHT, HEIGHT, shapes, "turtles")


def _window(drawing: Drawing, colours: dict[str, str]) -> Iterator[SvgElement]:
    """Draw the world: background, trails, and the turtles at the end from above."""

    def place(x: float, y: float) -> Point:
        return MARGIN + x * METRE, MARGIN + (SIZE - y) * METRE

    yield box(MARGIN, MARGIN, WINDOW, WINDOW, f"#{bytes(BACKGROUND).hex()}")
    for stroke in drawing.strokes:
        *colour, width, _ = stroke.pen
        yield line([place(*point) for point in stroke.points], f"#{bytes(colour).hex()}", width, title=stroke.turtle)
    for name, (*position, theta) in drawing.turtles.items():
        x, y = place(*position)
        cosine, sine = math.cos(theta), math.sin(theta)
        for ahead, left, radius in BODY:
            across, down = x + cosine * ahead - sine * left, y - sine * ahead - cosine * left
            yield dot(across, down, radius + 1.0, "#333333")
            yield dot(across, down, radius, colours[name])
        yield words(x, y - 24.0, name, "#ffffff", "middle")


SCREEN_FRAME = 1.0 / 20.0  # seconds
TALK = 3  # lines of messages below the turtles


class Screen:
    """Draw the steps of a run as they come; a context manager that restores the terminal."""

    def __init__(self, scene: Scene, *, to_stderr: bool = False, console: Console | None = None) -> None:
        """Choose where to draw; the picture fits the terminal."""
        from rich.live import Live

        from frametool.sim.simulate import SimulationStep

        console = console or coloured_console(stderr=to_stderr)
        room = console.height - TALK - 3 - len(scene.followers)
        lines = max(5, min(room, (console.width - 4) // 2, 40))
        self._canvas = Canvas(lines, 2 * lines)
        # what goes to stdout next to the picture is data and must not be caught
        self._live = Live(console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False)
        self._talk: list[str] = []
        self._last: dict[str, IssuedCommand] = {}
        self._tick = SimulationStep(0)  # the last one
        self._drawn = -math.inf

    def __enter__(self) -> Self:
        """Take the terminal."""
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Draw the last frame and restore the terminal."""
        self._live.update(self._picture(), refresh=True)
        self._live.stop()

    def watch(self, step: SimulationStep) -> None:
        """Add a step to the picture, and show it if enough time has passed."""
        self._talk = [*self._talk, *step.log, *map(str, step.walls)][-TALK:]
        self._last.update((command.turtle, command) for command in step.commands)
        if not step.is_tick:
            return
        if step.clears != self._tick.clears:
            self._canvas.cells.clear()
        self._tick = step
        for name, colour in colours_of(step.states).items():
            if not step.pens[name].off:
                self._canvas.mark(*self._dot(step.states[name]), colour)
        if monotonic() - self._drawn >= SCREEN_FRAME:
            self._live.update(self._picture(), refresh=True)
            self._drawn = monotonic()

    def _dot(self, state: TurtleState) -> tuple[int, int]:
        """Return column and row of the dot at a turtle; at the walls it is the last one."""
        dots = 4 * self._canvas.lines
        across, down = (min(int(part * dots / SIZE), dots - 1) for part in (state.x, SIZE - state.y))
        return across, down

    def _picture(self) -> Panel:
        """Return the whole picture."""
        from rich.panel import Panel
        from rich.text import Text

        turtles = {}
        for name, colour in colours_of(self._tick.states).items():
            across, down = self._dot(self._tick.states[name])
            arrow = ARROWS[round(self._tick.states[name].theta / (math.pi / 4.0)) % 8]
            turtles[down // 4, across // 2] = arrow, f"bold {colour}"
        text = Text()
        for row in range(self._canvas.lines):
            for run, colour in self._canvas.runs(row, turtles):
                text.append(run, f"{colour} on rgb({','.join(map(str, BACKGROUND))})".strip())
            text.append("\n")
        for command in self._last.values():
            ahead, turning, _ = command.twist
            moves = f"{command.distance or 0.0:.2f} m, linear {ahead:.2f}, angular {turning:+.2f}"
            text.append(f"{printable(command.turtle)}: {moves}\n")
        text.append("\n".join(self._talk), "dim")
        return Panel(text, title=f"{self._tick.t_ns / BILLION:.1f} s", width=self._canvas.columns + 4)


def run_page() -> tuple[Callable[[SimulationStep], None], Callable[[], str]]:
    """Return what collects the transforms of a run by steps, and what then makes a page of them, seen from above."""
    from frametool.view.exports import write_page
    from frametool.view.scene import EYES, FrameScene

    buffer = TransformBuffer(name="run")

    def watch(step: SimulationStep) -> None:
        for stamp_ns, parent, child, transform in step.broadcasts:
            buffer.insert(parent, child, transform, stamp_ns)

    return watch, lambda: write_page(FrameScene(buffer), title="turtles", file="tf.yaml", eye=EYES["top"])
