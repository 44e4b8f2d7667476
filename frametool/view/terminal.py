"""Draw frames and turtles in the terminal with braille characters."""

from __future__ import annotations

import math
from itertools import cycle, groupby, pairwise
from operator import itemgetter
from shutil import get_terminal_size
from time import monotonic
from typing import TYPE_CHECKING

from frametool.errors import cells, printable
from frametool.frames.stamps import BILLION, format_stamp
from frametool.sim.turtle import SIZE, TurtleState
from frametool.view.frame_scene import EYES, Flat, FrameScene, Projection, Size, placed_names, rounded, words_of
from frametool.view.text import coloured_console

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from rich.console import Console
    from rich.panel import Panel

    from frametool.sim.scene import Scene
    from frametool.sim.simulate import IssuedCommand, SimulationStep
    from frametool.view.frame_scene import Eye, Label

    Run = tuple[str, str]  # text and its style
    Spot = tuple[int, int]  # line and column


DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # bits of a cell's dots, by row and column


class Canvas:
    """A grid of cells with eight dots and one colour each; a terminal's cell is about twice as high as wide."""

    def __init__(self, lines: int, columns: int) -> None:
        """Create an empty canvas."""
        self.lines, self.columns = lines, columns
        self.cells: dict[Spot, tuple[int, str]] = {}  # dots and colour

    def mark(self, across: int, down: int, colour: str) -> None:
        """Set a dot by column and row; the last one in a cell determines its colour."""
        if 0 <= across < 2 * self.columns and 0 <= down < 4 * self.lines:
            cell = down // 4, across // 2
            dots, _ = self.cells.get(cell, (0, ""))
            self.cells[cell] = dots | DOTS[down % 4][across % 2], colour

    def runs(self, line: int, over: Mapping[Spot, Run]) -> list[Run]:
        """Return a line as runs of one style; over: letters that replace cells, with their style."""
        drawn = []
        for column in range(self.columns):
            dots, colour = self.cells.get((line, column), (0, ""))
            drawn.append(over.get((line, column)) or (chr(0x2800 + dots) if dots else " ", colour))
        return [("".join(map(itemgetter(0), run)), colour) for colour, run in groupby(drawn, key=itemgetter(1))]


COLOURS = ("red", "green", "blue")  # of axes
ARROWS = "→↗↑↖←↙↓↘"


def terminal_lines(scene: FrameScene, columns: int, lines: int, eye: Eye = EYES["slanted"]) -> list[list[Run]]:
    """Draw a scene and return its lines as runs of one style; the last line is the scale."""
    canvas = Canvas(max(lines, 4) - 1, max(columns, 20))
    wide, high = 2.0 * canvas.columns, 4.0 * canvas.lines
    margin = min(14.0, wide / 8.0, high / 8.0)
    size = Size(wide, high, margin, (6.0, 14.0), cell=(2, 4), line=4.0, measure=lambda words: 2.0 * cells(words))
    flat = Projection(scene, size, eye, most=True)
    for parent, name in flat.links:
        _mark_line(canvas, flat, flat.origins[parent], flat.origins[name], "bright_black", 3)
    for stretch in (stretch for stretches in flat.trails.values() for stretch in stretches):
        for begin, end in pairwise(map(flat.at, stretch)):
            _mark_line(canvas, flat, begin, end, "magenta", 2)
    for name in flat.nearest_last:
        for axis, tip in flat.axes(name):
            _mark_line(canvas, flat, flat.origins[name], tip, COLOURS[axis])
    outside = [name for name, point in flat.origins.items() if not flat.holds(point)]
    labels, hidden = placed_names(flat, outside=(_at_edge(flat, name) for name in outside[:12]))
    letters: dict[Spot, Run] = {}
    for words, _, (left, top, *_), away in labels:
        row, column = int(top) // 4, int(left) // 2 + 1
        style = "bold" if away else "dim"
        drawn = (each for letter in words for each in (letter, *[""] * (cells(letter) - 1)))  # wide letters take two
        letters |= {(row, column + at): (letter, style) for at, letter in enumerate(drawn)}
    # the scale, the direction of view, and the number of names without room
    metres, stamp_ns, hidden = rounded(24.0 / flat.scale), scene.at_ns, hidden + len(outside[12:])
    bar = "─" * max(round(metres * flat.scale / 2.0) - 2, 0)
    azimuth, elevation = (round(math.degrees(angle)) + 0 for angle in eye)
    more = f", {hidden} name{'s' * (hidden > 1)} hidden" if hidden else ""
    time = "" if stamp_ns is None else f" at {format_stamp(stamp_ns)[:-6]} s"
    seen = f"in {printable(scene.fixed)[:40]}{time}, from {azimuth}, {elevation} deg{more}"
    text = f"├{bar}┤ {metres:g} m  {seen}  axes "[: canvas.columns - 6]
    scale = [(text, ""), ("x", COLOURS[0]), (" ", ""), ("y", COLOURS[1]), (" ", ""), ("z", COLOURS[2])]
    return [*(canvas.runs(row, letters) for row in range(canvas.lines)), scale]


def terminal_text(scene: FrameScene, columns: int, lines: int, eye: Eye = EYES["slanted"]) -> str:
    """Return the picture without colours."""
    drawn = terminal_lines(scene, columns, lines, eye)
    return "".join("".join(text for text, _ in runs).rstrip() + "\n" for runs in drawn)


def print_terminal(scene: FrameScene, eye: Eye = EYES["slanted"], color: str = "auto") -> None:
    """Print a picture of the terminal's size, in colour if it has colours, or by `color`: always or never."""
    from rich.text import Text

    columns, lines = get_terminal_size()
    drawn = terminal_lines(scene, columns, lines - 1, eye)
    coloured_console(color).print(Text("\n").join(Text.assemble(*runs) for runs in drawn))


def _mark_line(canvas: Canvas, flat: Projection, begin: Flat, end: Flat, colour: str, gap: int = 1) -> None:
    """Draw a line, with `gap` only every second, third, .. dot; the part outside of the picture is not drawn."""
    if not flat.holds(begin):
        begin, end = end, begin
    if not flat.holds(begin):
        return
    far = max(abs(end.x - begin.x), abs(end.y - begin.y))
    most = 2.0 * flat.size.width + flat.size.height  # the rest is outside
    count = max(1, math.ceil(min(far, most)))
    part = min(1.0, most / max(far, 1.0)) / count
    for number in range(0, count + 1, gap):
        across, down = (a + (b - a) * part * number for a, b in zip(begin[:2], end[:2], strict=True))
        canvas.mark(math.floor(across), math.floor(down), colour)


def _at_edge(flat: Projection, name: str) -> Iterator[Label]:
    """Yield labels at the edge, with distance and arrow, for a frame outside the picture; best position first."""
    x, y, _ = flat.origins[name]
    half_wide, half_high = flat.size.width / 2.0, flat.size.height / 2.0
    across, down = x - half_wide, y - half_high
    arrow = ARROWS[round(math.atan2(-down, across) / (math.pi / 4.0)) % 8]
    away = math.dist(flat.poses[name][:3], flat.centre)
    label = f"{words_of([name])} {away:.0f} m" if away >= 10.0 else f"{words_of([name])} {away:.2g} m"
    text = f"{label} {arrow}" if across > 0.0 else f"{arrow} {label}"
    part = min(half_wide / max(abs(across), 1e-9), half_high / max(abs(down), 1e-9))
    length = flat.size.measure(text)
    left = half_wide + across * part - (length if across > 0.0 else 0.0)
    left = min(max(left, 0.0), flat.size.width - length)
    middles = (at + 2 for at in range(0, int(flat.size.height), 4))
    for middle in sorted(middles, key=lambda at: abs(at - half_high - down * part)):
        yield from flat.label(text, length, flat.origins[name], left, middle)


# colours of turtles, whatever their pens have: on the picture -> on white
ON_WHITE = {
    "#f4d35e": "#c79a00", "#ee964b": "#d4691b", "#7bdff2": "#1593ad", "#b2f7ef": "#2a9d8f",
    "#f7a1c4": "#d6458b", "#c3f584": "#5a9a16", "#d0bdf4": "#7d5fc7", "#ffffff": "#666666",
}  # fmt: skip
BACKGROUND = (69, 86, 255)  # that of turtlesim
LOGGED = 3  # lines of messages below the turtles


def colours_of(turtles: Iterable[str]) -> dict[str, str]:
    """Return a colour for each turtle, in the order of their names."""
    return dict(zip(sorted(turtles), cycle(ON_WHITE), strict=False))


class Screen:
    """Draws the steps of a run as they arrive; the context manager `live` takes over and restores the terminal."""

    def __init__(self, scene: Scene, *, to_stderr: bool = False, console: Console | None = None) -> None:
        """Choose the terminal of stdout or stderr, and the size of the picture."""
        from rich.live import Live

        from frametool.sim.simulate import SimulationStep

        console = console or coloured_console(stderr=to_stderr)
        room = console.height - LOGGED - 3 - len(scene.followers)
        lines = max(5, min(room, (console.width - 4) // 2, 40))
        self._canvas = Canvas(lines, 2 * lines)
        self._log: list[str] = []
        self._last: dict[str, IssuedCommand] = {}
        self._tick = SimulationStep(0)  # the last tick
        self._drawn = -math.inf
        # results on stdout must not be redirected into the picture
        self.live = Live(
            get_renderable=self._picture, console=console, auto_refresh=False, redirect_stdout=False,
            redirect_stderr=False,
        )  # fmt: skip

    def watch(self, step: SimulationStep) -> None:
        """Add a step to the picture, and show it if enough time has passed."""
        self._log = [*self._log, *step.log, *map(str, step.walls)][-LOGGED:]
        self._last.update((command.turtle, command) for command in step.commands)
        if not step.is_tick:
            return
        if step.clears != self._tick.clears:
            self._canvas.cells.clear()
        self._tick = step
        for name, colour in colours_of(step.states).items():
            if not step.pens[name].off:
                self._canvas.mark(*self._dot(step.states[name]), colour)
        if monotonic() - self._drawn >= 1.0 / 20.0:
            self.live.refresh()
            self._drawn = monotonic()

    def _dot(self, state: TurtleState) -> tuple[int, int]:
        """Return column and row of a turtle's dot, clamped to the canvas."""
        dots = 4 * self._canvas.lines
        across, down = (min(int(part * dots / SIZE), dots - 1) for part in (state.x, SIZE - state.y))
        return across, down

    def _picture(self) -> Panel:
        """Return the picture with the last messages below."""
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
        text.append("\n".join(self._log), "dim")
        return Panel(text, title=f"{self._tick.t_ns / BILLION:.1f} s", width=self._canvas.columns + 4)
