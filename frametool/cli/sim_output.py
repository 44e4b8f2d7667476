"""A scene on its way to the user: steps out of the simulation, to stdout, stderr, a drawing, a plot."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Number
from frametool.cli.sink import is_special, refuse_existing, writing
from frametool.cli.stderr import say
from frametool.errors import FileProblem
from frametool.frames.stamps import BILLION
from frametool.sim.progress import Progress
from frametool.sim.simulate import simulate
from frametool.sim.step_writer import EMITS, FORMS, Writer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.cli.sink import Write
    from frametool.sim.scene import Scene
    from frametool.sim.simulate import Step
    from frametool.view.drawing import Drawing

    Watch = Callable[[Step], None]

SUFFIXES = {".csv": "csv", ".json": "json", ".jsonl": "json", ".txt": "text", ".yaml": "yaml", ".yml": "yaml"}
PLOTS = {".svg": "frametool.view.plot_svg", ".html": "frametool.view.plot_html", ".png": "frametool.view.plot_png"}


def play_options(function: Any) -> Any:
    """Add to a command the options that say what is shown of a simulation."""
    options = [
        click.option("--emit", type=click.Choice(EMITS), default="commands", show_default=True,
                     help="followers' velocity commands, every turtle's pose a tick, or transforms for `lookup -`"),
        click.option("-f", "--format", "format_name", type=click.Choice(FORMS),
                     help="form of the records  [default: text on a terminal, yaml otherwise]"),
        click.option("--precision", type=click.IntRange(0, 30), metavar="N",
                     help="digits after the point  [default: the shortest text that reads back to the same bits]"),
        click.option("-o", "--output", type=TEXT, metavar="FILE",
                     help="write there instead of stdout, whole or not at all"),
        click.option("--reach", type=Number(), default=0.5, show_default=True, metavar="D",
                     help="metres that count as having come to the target"),
        click.option("--realtime", is_flag=True, help="one simulated second a second, instead of as fast as possible"),
        click.option("--live", is_flag=True, help="draw the turtles in the terminal, in real time"),
        click.option("--plot", type=TEXT, metavar="FILE", help="draw the run into a .svg, .html or .png"),
        click.option("--force", is_flag=True, help="let --output and --plot replace existing files"),
    ]  # fmt: skip
    for option in reversed(options):
        function = option(function)
    return function


class Show:
    """What is shown of a simulation, and where: what the options of a command say."""

    def __init__(
        self, *, emit: str = "commands", format_name: str | None = None, precision: int | None = None,
        output: str | None = None, reach: float = 0.5, realtime: bool = False, live: bool = False,
        plot: str | None = None, force: bool = False, leaders: bool = False,
    ) -> None:  # fmt: skip
        """Check what can be checked before anything runs.

        Raises click.UsageError, FileProblem.
        """
        self.emit = emit
        self.form = form_of(format_name, output)
        self.number = number_writer(precision)
        self.leaders = leaders
        self.output = None if output == "-" else output
        self.reach = reach
        self.realtime = realtime or live
        self.live = live
        self.plot = plot
        self.force = force
        self._check()

    def _check(self) -> None:
        if self.reach < 0.0:
            raise click.UsageError(f"--reach must be 0 or more, found {self.reach:g}")
        if self.live and not (sys.stdout.isatty() or sys.stderr.isatty()):
            raise click.UsageError("--live draws in a terminal, and neither stdout nor stderr is one; see --plot")
        check_files(self.plot, self.output, force=self.force)

    def play(self, scene: Scene) -> None:
        """Run a scene to its end and sum it up on stderr.

        Raises KeyboardInterrupt after the summary if it was interrupted.
        """
        progress = Progress(scene, self.reach)
        drawing = self._drawing(scene)
        interrupted = False
        try:
            with ExitStack() as stack:
                watchers = [progress.watch, *self._watchers(scene, stack), *([drawing.watch] if drawing else [])]
                for step in simulate(scene):
                    for watch in watchers:
                        watch(step)
        except KeyboardInterrupt:  # leaves no file: what it holds is not the whole run
            interrupted = True
        for line in progress.lines():
            say(line)
        if drawing:
            self._save(drawing)
        if interrupted:
            raise KeyboardInterrupt

    def _drawing(self, scene: Scene) -> Drawing | None:
        """Return what remembers the run for the plot, if there is to be one."""
        if not self.plot:
            return None
        from frametool.view.drawing import Drawing

        return Drawing(scene)

    def _watchers(self, scene: Scene, stack: ExitStack) -> Iterator[Watch]:
        """Open what the steps go to; the stack closes it."""
        if self.realtime:
            yield Pace().wait
        if self.live:
            from frametool.view.live import Screen

            yield stack.enter_context(Screen(scene, to_stderr=not sys.stdout.isatty())).watch
        else:
            yield Log().watch
        if self.output is not None or not (self.live and sys.stdout.isatty()):
            yield self._writing(stack.enter_context(writing(self.output, force=self.force)), scene)

    def _save(self, drawing: Drawing) -> None:
        """Write the plot in the form that its suffix names."""
        path = str(self.plot)
        with writing(path, force=self.force) as write:
            write(import_module(PLOTS[suffix_of(path)]).plot(drawing))

    def _writing(self, write: Write, scene: Scene) -> Watch:
        """Return what writes a step's records, each at once, so that a reader at the other end of a pipe sees it."""
        several = self.leaders or self.emit == "poses" or len(scene.followers) > 1
        writer = Writer(self.emit, self.form, self.number, leaders=self.leaders, labelled=several)

        def watch(step: Step) -> None:
            for text in writer.write(step):
                write(text)

        return watch


class Pace:
    """Keep simulated time from running ahead of the clock."""

    def __init__(self) -> None:
        """Start the clock."""
        from time import monotonic, sleep

        self._sleep, self._clock = sleep, monotonic
        self._start = monotonic()

    def wait(self, step: Step) -> None:
        """Wait until a step is due."""
        ahead = step.t_ns / BILLION - (self._clock() - self._start)
        if ahead > 0.0:
            self._sleep(ahead)


class Log:
    """Tell on stderr what turtlesim and the followers log; of a wall once for each contact."""

    def __init__(self) -> None:
        """Begin with no turtle at a wall."""
        self._at_wall: frozenset[str] = frozenset()

    def watch(self, step: Step) -> None:
        """Tell of one step."""
        for line in step.log:
            say(f"{step.t_ns / BILLION:.3f} s: {line}")
        for hit in step.walls:
            if hit.turtle not in self._at_wall:
                say(f"{step.t_ns / BILLION:.3f} s: {hit}")
        if step.is_tick:
            self._at_wall = frozenset(hit.turtle for hit in step.walls)


def form_of(format_name: str | None, output: str | None) -> str:
    """Settle the form: as told, else by the file's suffix, else text for a terminal and YAML for a pipe."""
    by_suffix = SUFFIXES.get(suffix_of(output or ""))
    return format_name or by_suffix or ("text" if output is None and sys.stdout.isatty() else "yaml")


def number_writer(precision: int | None) -> Callable[[float], str] | None:
    """Return what writes numbers with so many decimals; None for the form's own way."""
    return None if precision is None else f"{{:.{precision}f}}".format


def suffix_of(path: str) -> str:
    """Return a file's suffix in small letters."""
    return os.path.splitext(path)[1].lower()


def check_files(plot: str | None, output: str | None, *, force: bool) -> None:
    """Refuse before any work what could not be written after it.

    Raises click.UsageError, FileProblem, ValueInvalid when matplotlib is missing.
    """
    if plot and suffix_of(plot) not in PLOTS:
        raise click.UsageError(f"--plot takes {', '.join(PLOTS)}; found {plot!r}")
    if plot and output and os.path.realpath(plot) == os.path.realpath(output) and not is_special(plot):
        raise click.UsageError(f"--output and --plot are the same file: {plot}")
    for path in filter(None, (plot, output)):
        refuse_existing(path, force=force)
        if path != "-" and not os.path.isdir(os.path.dirname(path) or "."):
            raise FileProblem(f"{path}: no directory {os.path.dirname(path)}")
    if plot and suffix_of(plot) == ".png":
        from frametool.view.plot_png import require_matplotlib

        require_matplotlib()
