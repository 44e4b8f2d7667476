"""The terminal through rich: in which colours, and progress bars on stderr for jobs longer than two seconds."""

from __future__ import annotations

import os
import sys
import time
from contextlib import AbstractContextManager, suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

PATIENCE = 2.0  # seconds before anything is shown


class ProgressBar(AbstractContextManager["ProgressBar"]):
    """Show the progress of a job, if stderr is a terminal and it takes longer than two seconds."""

    def __init__(self, total: int | None, *, quiet: bool = False, counted: str = "rows") -> None:
        """Start the clock; total: bytes, if known; counted: the unit of the count."""
        self.total, self._counted = total, counted
        self.rows = self.size = 0
        self._hidden = quiet or sys.stderr is None or not sys.stderr.isatty()
        self._start = time.monotonic()
        self._bar: Any = None

    def __exit__(self, *_: object) -> None:
        """Clear the line."""
        if self._bar is not None:
            with suppress(OSError):  # a terminal that has gone does not change what the data is worth
                self._bar.stop()

    def advance(self, rows: int, size: int) -> None:
        """Count what was done."""
        self.rows += rows
        self.size += size
        seconds = time.monotonic() - self._start
        if self._hidden or seconds < PATIENCE:
            return
        with suppress(OSError):
            if self._bar is None:
                from rich import progress

                text = f"{{task.fields[rows]}} {self._counted}  {{task.fields[rate]}} {self._counted}/s"
                columns: list[Any] = [progress.TextColumn(text)]
                if self.total:
                    columns += [progress.BarColumn(), progress.TaskProgressColumn(), progress.TimeRemainingColumn()]
                self._bar = progress.Progress(*columns, console=coloured_console(stderr=True), transient=True)
                self._bar.start()
                self._task = self._bar.add_task("", total=self.total, rows="0", rate="")
            self._bar.update(self._task, completed=self.size, rows=f"{self.rows:,}", rate=f"{self.rows / seconds:,.0f}")


def coloured_console(color: str = "auto", *, stderr: bool = False) -> Console:
    """Return an output, in colour where the terminal has any, or as `color` says: always or never.

    Where there is no colour, also by NO_COLOR, nothing is bold or dim either.
    """
    from rich.console import Console

    plain = color == "never" or (color == "auto" and bool(os.environ.get("NO_COLOR")))
    return Console(
        file=sys.stderr if stderr else sys.stdout, highlight=False, soft_wrap=True, no_color=plain,
        force_terminal=True if color == "always" else None,
        color_system=None if plain else "auto" if color == "auto" else "standard",
    )  # fmt: skip
