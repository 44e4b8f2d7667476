"""How far a long stream is: rows, rate, share of the file, time left; one line on a terminal's stderr."""

from __future__ import annotations

import sys
import time
from typing import Any

PATIENCE = 2.0  # seconds before anything is shown


class Progress:
    """Shows itself only if stderr is a terminal and the job takes longer than two seconds."""

    def __init__(self, total: int | None, *, quiet: bool) -> None:
        """Know the bytes there are in all, or None."""
        self.total = total
        self.rows = self.size = 0
        self._hidden = quiet or sys.stderr is None or not sys.stderr.isatty()
        self._start = time.monotonic()
        self._bar: Any = None

    def advance(self, rows: int, size: int) -> None:
        """Count what was done."""
        self.rows += rows
        self.size += size
        if self._hidden or time.monotonic() - self._start < PATIENCE:
            return
        if self._bar is None:
            self._bar = _bar(self.total)
            self._bar.start()
            self._task = self._bar.add_task("", total=self.total, rows="0", rate="")
        rate = self.rows / (time.monotonic() - self._start)
        self._bar.update(self._task, completed=self.size, rows=f"{self.rows:,}", rate=f"{rate:,.0f}")

    def stop(self) -> None:
        """Take the line away."""
        if self._bar is not None:
            self._bar.stop()


def _bar(total: int | None) -> Any:
    from rich import progress
    from rich.console import Console

    columns: list[Any] = [progress.TextColumn("{task.fields[rows]} rows  {task.fields[rate]} rows/s")]
    if total:
        columns += [progress.BarColumn(), progress.TaskProgressColumn(), progress.TimeRemainingColumn()]
    return progress.Progress(*columns, console=Console(stderr=True), transient=True)
