"""Pictures in a terminal: braille characters with eight dots and one colour per cell.

Frames with axes, names and a scale bar, also as plain text; turtles while they move, at most 20 pictures a second.
"""

from __future__ import annotations

import math
from itertools import groupby, pairwise
from operator import itemgetter
from time import monotonic
from typing import TYPE_CHECKING

from frametool.errors import cells, printable
from frametool.frames.stamps import BILLION, format_stamp
from frametool.sim.turtle import SIZE
from frametool.view.progress import coloured_console
from frametool.view.run_plot import colours_of
from frametool.view.scene import SLANTED, Flat, Labels, Projection, Size, nice, words_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Self

    from rich.console import Console
    from rich.panel import Panel

    from frametool.sim.scene import Scene
    from frametool.sim.simulate import IssuedCommand, SimulationStep
    from frametool.view.scene import FrameScene, Label

    Run = tuple[str, str]  # text and its style
    Spot = tuple[int, int]  # line and column

BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column of a cell


class Canvas:
    """A grid of cells; a terminal's cell is about twice as high as wide, so that dots are about square."""

    def __init__(self, lines: int, columns: int | None = None) -> None:
        """Create an empty one, a square where the columns are None."""
        self.lines = lines
        self.columns = 2 * lines if columns is None else columns
        self._cells: dict[tuple[int, int], tuple[int, str, int]] = {}

    def clear(self) -> None:
        """Remove all dots."""
        self._cells.clear()

    def dot(self, x: float, y: float, colour: str) -> None:
        """Set the dot at a position, 0 to 1 with y up, and the colour of its cell."""
        self.mark(*self._dots(x, y), colour)

    def mark(self, across: int, down: int, colour: str, rank: int = 0) -> None:
        """Set a dot by column and row; the highest rank in a cell gives its colour."""
        if not (0 <= across < 2 * self.columns and 0 <= down < 4 * self.lines):
            return
        cell = down // 4, across // 2
        bits, before, before_rank = self._cells.get(cell, (0, colour, rank))
        shown = (colour, rank) if rank >= before_rank else (before, before_rank)
        self._cells[cell] = bits | DOTS[down % 4][across % 2], *shown

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return line and column of a position."""
        across, down = self._dots(x, y)
        return down // 4, across // 2

    def row(self, line: int) -> Iterator[tuple[str, str]]:
        """Yield the characters of a line, each with its colour."""
        for column in range(self.columns):
            bits, colour, _ = self._cells.get((line, column), (0, "", 0))
            yield (chr(BRAILLE + bits) if bits else " "), colour

    def runs(self, line: int, over: Mapping[tuple[int, int], tuple[str, str]]) -> list[tuple[str, str]]:
        """Return a line as runs of one colour; over: letters that replace cells."""
        cells = (over.get((line, column), cell) for column, cell in enumerate(self.row(line)))
        return [("".join(map(itemgetter(0), run)), colour) for colour, run in groupby(cells, key=itemgetter(1))]

    def _dots(self, x: float, y: float) -> tuple[int, int]:
        across = int(x * 2 * self.columns)
        down = int((1.0 - y) * 4 * self.lines)
        return min(max(across, 0), 2 * self.columns - 1), min(max(down, 0), 4 * self.lines - 1)


LINK, TRAIL, AXIS = range(3)  # ranks of dots
AXES = ("red", "green", "blue")
ARROWS = "→↗↑↖←↙↓↘"
LEAST_LINES, LEAST_COLUMNS = 4, 20
MOST_OUTSIDE = 12  # frames that are pointed to


class TerminalPicture:
    """The picture of a scene in some columns and lines; the last line is the scale."""

    def __init__(self, scene: FrameScene, columns: int, lines: int, eye: tuple[float, float] = SLANTED) -> None:
        """Draw it."""
        self._canvas = Canvas(max(lines, LEAST_LINES) - 1, max(columns, LEAST_COLUMNS))
        wide, high = 2.0 * self._canvas.columns, 4.0 * self._canvas.lines
        margin = min(14.0, wide / 8.0, high / 8.0)
        size = Size(wide, high, margin, (6.0, 14.0), cell=(2, 4), line=4.0, measure=lambda words: 2.0 * cells(words))
        self._flat = Projection(scene, size, eye, most=True)
        self._draw()
        labels, outside = Labels(self._flat), self._flat.outside()
        pointed = sum(labels.place(self._at_edge(labels, name)) for name in outside[:MOST_OUTSIDE])
        arrows = len(labels.placed)
        labels.place_all()
        self._names: dict[Spot, Run] = {}  # letter by letter
        for number, label in enumerate(labels.placed):
            line, column = int(label.box[1]) // 4, int(label.box[0]) // 2 + 1
            style = "dim" if number < arrows else "bold"
            self._names |= {(line, column + at): (letter, style) for at, letter in enumerate(_letters(label.words))}
        self._scale = self._scale_line(eye, len(outside) - pointed + labels.hidden)

    def lines(self) -> Iterator[list[Run]]:
        """Yield the lines as runs of one style."""
        for line in range(self._canvas.lines):
            yield self._canvas.runs(line, self._names)
        yield self._scale

    def text(self) -> str:
        """Return the picture without colours."""
        return "".join("".join(text for text, _ in line).rstrip() + "\n" for line in self.lines())

    def _draw(self) -> None:
        """Draw the links, the trails and the axes."""
        flat = self._flat
        for parent, name in flat.links:
            self._line(flat.origins[parent], flat.origins[name], "bright_black", LINK, 3)
        for stretch in (stretch for stretches in flat.trails.values() for stretch in stretches):
            for begin, end in pairwise(map(flat.at, stretch)):
                self._line(begin, end, "magenta", TRAIL, 2)
        for name in flat.nearest_last():
            for axis, tip in flat.axes(name):
                self._line(flat.origins[name], tip, AXES[axis], AXIS)

    def _line(self, begin: Flat, end: Flat, colour: str, rank: int, gap: int = 1) -> None:
        """Set every dot, or every second, third, .. of a line; a line that leaves the picture is cut."""
        if not self._is_inside(begin):
            begin, end = end, begin
        if not self._is_inside(begin):
            return
        far = max(abs(end.x - begin.x), abs(end.y - begin.y))
        part = min(1.0, 4.0 * (self._canvas.columns + self._canvas.lines) / max(far, 1.0))
        end = Flat(begin.x + part * (end.x - begin.x), begin.y + part * (end.y - begin.y), 0.0)
        count = max(1, math.ceil(part * far))
        for number in range(0, count + 1, gap):
            part = number / count
            across, down = (a + (b - a) * part for a, b in zip(begin[:2], end[:2], strict=True))
            self._canvas.mark(math.floor(across), math.floor(down), colour, rank)

    def _is_inside(self, place: Flat) -> bool:
        return 0.0 <= place.x < 2.0 * self._canvas.columns and 0.0 <= place.y < 4.0 * self._canvas.lines

    def _at_edge(self, labels: Labels, name: str) -> Iterator[Label]:
        """Yield the places at an edge for a frame beyond it: its name and distance with an arrow, the nearest first."""
        x, y, _ = self._flat.origins[name]
        half_wide, half_high = self._flat.size.width / 2.0, self._flat.size.height / 2.0
        across, down = x - half_wide, y - half_high
        arrow = ARROWS[round(math.atan2(-down, across) / (math.pi / 4.0)) % 8]
        away = math.dist(self._flat.poses[name][:3], self._flat.centre)
        said = f"{words_of([name])} {away:.0f} m" if away >= 10.0 else f"{words_of([name])} {away:.2g} m"
        words = f"{said} {arrow}" if across > 0.0 else f"{arrow} {said}"
        part = min(half_wide / max(abs(across), 1e-9), half_high / max(abs(down), 1e-9))
        length = 2.0 * cells(words)
        left = half_wide + across * part - (length if across > 0.0 else 0.0)
        left = min(max(left, 0.0), self._flat.size.width - length)
        for line in sorted(range(self._canvas.lines), key=lambda line: abs(4 * line + 2 - half_high - down * part)):
            yield from labels.at(words, length, self._flat.origins[name], left, 4 * line + 2)

    def _scale_line(self, eye: tuple[float, float], hidden: int) -> list[Run]:
        """Return the scale, the direction of view, and the number of names without room."""
        metres = nice(24.0 / self._flat.scale)
        bar = "─" * max(round(metres * self._flat.scale / 2.0) - 2, 0)
        azimuth, elevation = (round(math.degrees(angle)) + 0 for angle in eye)
        more = f", {hidden} name{'s' * (hidden > 1)} hidden" if hidden else ""
        fixed = printable(self._flat.scene.fixed)[:40]
        stamp_ns = self._flat.scene.at_ns
        time = "" if stamp_ns is None else f" at {format_stamp(stamp_ns)[:-6]} s"
        words = f"├{bar}┤ {metres:g} m  in {fixed}{time}, from {azimuth}, {elevation} deg{more}  axes "
        words = words[: self._canvas.columns - 6]
        return [(words, ""), ("x", AXES[0]), (" ", ""), ("y", AXES[1]), (" ", ""), ("z", AXES[2])]


def print_terminal(scene: FrameScene, eye: tuple[float, float] = SLANTED, color: str = "auto") -> None:
    """Print a picture of the terminal's size, in colour where it has any, or as `color` says: always or never."""
    from shutil import get_terminal_size

    from rich.text import Text

    columns, lines = get_terminal_size()
    picture = TerminalPicture(scene, columns, lines - 1, eye)
    coloured_console(color).print(Text("\n").join(Text.assemble(*line) for line in picture.lines()))


def _letters(words: str) -> Iterator[str]:
    """Yield the content of each cell of a text; a wide letter takes two, the second one empty."""
    for letter in words:
        yield letter
        yield from [""] * (cells(letter) - 1)


SCREEN_FRAME = 1.0 / 20.0  # seconds
BACKGROUND = "on rgb(69,86,255)"  # turtlesim's
TALK = 3  # lines of messages below the turtles


class Screen:
    """Draw the steps of a run as they come; a context manager that restores the terminal."""

    def __init__(self, scene: Scene, *, to_stderr: bool = False, console: Console | None = None) -> None:
        """Choose where to draw; the picture fits the terminal."""
        from rich.live import Live

        from frametool.sim.simulate import SimulationStep

        console = console or coloured_console(stderr=to_stderr)
        room = console.height - TALK - 3 - len(scene.followers)
        self._canvas = Canvas(max(5, min(room, (console.width - 4) // 2, 40)))
        # what goes to stdout next to the picture is data and must not be caught
        self._live = Live(console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False)
        self._talk: list[str] = []
        self._last: dict[str, IssuedCommand] = {}
        self._tick = SimulationStep(0)  # the last one
        self._colours: dict[str, str] = {}
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
            self._canvas.clear()
        self._tick, self._colours = step, colours_of(step.states)
        for name, state in step.states.items():
            if not step.pens[name].off:
                self._canvas.dot(state.x / SIZE, state.y / SIZE, self._colours[name])
        if monotonic() - self._drawn >= SCREEN_FRAME:
            self._live.update(self._picture(), refresh=True)
            self._drawn = monotonic()

    def _picture(self) -> Panel:
        """Return the whole picture."""
        from rich.panel import Panel
        from rich.text import Text

        canvas = self._canvas
        turtles = {
            canvas.cell(state.x / SIZE, state.y / SIZE): (
                ARROWS[round(state.theta / (math.pi / 4.0)) % 8], f"bold {self._colours[name]}",
            )
            for name, state in self._tick.states.items()
        }  # fmt: skip
        text = Text()
        for line in range(canvas.lines):
            for run, colour in canvas.runs(line, turtles):
                text.append(run, f"{colour} {BACKGROUND}".strip())
            text.append("\n")
        text.append("".join(f"{_sentence(command)}\n" for command in self._last.values()))
        text.append("\n".join(self._talk), "dim")
        return Panel(text, title=f"{self._tick.t_ns / BILLION:.1f} s", width=canvas.columns + 4)


def _sentence(command: IssuedCommand) -> str:
    """Describe a follower's command in one line."""
    ahead, turning, _ = command.twist
    return f"{printable(command.turtle)}: {command.distance or 0.0:.2f} m, linear {ahead:.2f}, angular {turning:+.2f}"
