"""The turtles drawn in the terminal while they walk: trails of dots, an arrow for each, at most 20 frames a second."""

from __future__ import annotations

import math
from time import monotonic
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live
from rich.panel import Panel
from rich.text import Text

from frametool.errors import printable
from frametool.frames.stamps import BILLION
from frametool.sim.turtle import SIZE
from frametool.view.run_plot import colours_of
from frametool.view.terminal import Canvas

if TYPE_CHECKING:
    from types import TracebackType
    from typing import Self

    from frametool.sim.scene import Scene
    from frametool.sim.simulate import IssuedCommand, SimulationStep
    from frametool.sim.turtle import TurtleState

FRAME = 1.0 / 20.0  # seconds
ARROWS = "→↗↑↖←↙↓↘"
STYLE = "on rgb(69,86,255)"  # turtlesim's background
TALK = 3  # lines of messages below the drawing


class Screen:
    """Draw steps as they come; a context, so that the terminal is as before afterwards."""

    def __init__(self, scene: Scene, *, to_stderr: bool = False, console: Console | None = None) -> None:
        """Choose where to draw; the picture takes what the terminal's height and width allow."""
        self._console = console or Console(stderr=to_stderr)
        beside = TALK + 3 + len(scene.followers)
        self._canvas = Canvas(max(5, min(self._console.height - beside, (self._console.width - 4) // 2, 40)))
        # what goes to stdout beside the picture is data and must not be caught
        self._live = Live(console=self._console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False)
        self._talk: list[str] = []
        self._last: dict[str, IssuedCommand] = {}
        self._states: dict[str, TurtleState] = {}
        self._colours: dict[str, str] = {}
        self._clears = self._t_ns = 0
        self._drawn = -math.inf

    def __enter__(self) -> Self:
        """Take the terminal."""
        self._live.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:  # fmt: skip
        """Draw the last frame and give the terminal back."""
        self._live.update(self._picture(), refresh=True)
        self._live.__exit__(kind, error, trace)

    def watch(self, step: SimulationStep) -> None:
        """Add a step to the picture, and show it if the last frame is old enough."""
        self._talk = [*self._talk, *step.log, *map(str, step.walls)][-TALK:]
        self._last.update((command.turtle, command) for command in step.commands)
        if not step.is_tick:
            return
        self._t_ns = step.t_ns
        self._mark(step)
        if monotonic() - self._drawn >= FRAME:
            self._live.update(self._picture(), refresh=True)
            self._drawn = monotonic()

    def _mark(self, step: SimulationStep) -> None:
        """Set the dots of a tick."""
        if step.clears != self._clears:
            self._clears = step.clears
            self._canvas.clear()
        if self._states.keys() != step.states.keys():
            self._colours = colours_of(step.states)
        self._states = step.states
        for name, state in step.states.items():
            if not step.pens[name].off:
                self._canvas.dot(state.x / SIZE, state.y / SIZE, self._colours[name])

    def _picture(self) -> Panel:
        """Return the whole picture."""
        canvas = self._canvas
        turtles = {
            canvas.cell(state.x / SIZE, state.y / SIZE): (_arrow(state), f"bold {self._colours[name]}")
            for name, state in self._states.items()
        }
        text = Text()
        for line in range(canvas.lines):
            for run, colour in canvas.runs(line, turtles):
                text.append(run, f"{colour} {STYLE}".strip())
            text.append("\n")
        text.append("".join(f"{_sentence(command)}\n" for command in self._last.values()))
        text.append("\n".join(self._talk), "dim")
        return Panel(text, title=f"{self._t_ns / BILLION:.1f} s", width=canvas.columns + 4)


def _arrow(state: TurtleState) -> str:
    """Return the arrow nearest to a heading."""
    return ARROWS[round(state.theta / (math.pi / 4.0)) % 8]


def _sentence(command: IssuedCommand) -> str:
    """Describe in a line what a follower does."""
    ahead, turning, _ = command.twist
    return f"{printable(command.turtle)}: {command.distance or 0.0:.2f} m, linear {ahead:.2f}, angular {turning:+.2f}"
