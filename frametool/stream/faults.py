"""Bad rows: what is told about each, how many are told, and whether the run goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

STOP, SKIP, NULL = "stop", "skip", "null"
ON_ERROR = (STOP, SKIP, NULL)
MOST = 20
DONE, BAD_DATA, ROWS_SKIPPED = 0, 1, 3


class Fault(NamedTuple):
    """One bad row: its line, the name of the column that is to blame ("" for the whole row), and why.

    final: nothing behind it can be read
    """

    line: int
    column: str
    reason: str
    final: bool = False


class Stopped(FormatError):
    """Report the bad row that ended the run; the rows before it are out."""


class Misused(FormatError):
    """Report options that do not fit the columns of a table."""

    exit_code = 2


class Policy:
    """Tell of faults as they come, count them, and say how the run ends."""

    def __init__(self, source: str, on_error: str = STOP, *, most: int = MOST, tell: Callable[[str], None]) -> None:
        """Name the source as messages shall; at most `most` faults are told."""
        self.source = source
        self.on_error = on_error
        self.most = most
        self.tell = tell
        self.count = 0
        self._frames_told = False  # the list of those there are is told once

    def take(self, faults: Iterable[Fault]) -> None:
        """Tell of the faults of a block; raise Stopped at the first if that is the rule."""
        for fault in faults:
            self.count += 1
            if self.on_error == STOP or fault.final:
                raise Stopped(self._message(fault))
            if self.count <= self.most:
                self.tell(f"{self._message(fault)} ({self._fate()})")

    def finish(self, rows: int) -> int:
        """Tell the final count of a run of so many rows; give its exit status."""
        if not self.count:
            return DONE
        verb = "skipped" if self.on_error == SKIP else "without result"
        more = f", {self.count - self.most} of them not shown" if self.count > self.most else ""
        self.tell(f"{self.source}: {self.count} of {rows} rows {verb}{more}")
        return ROWS_SKIPPED

    def _message(self, fault: Fault) -> str:
        reason, frames, _ = fault.reason.partition(" frames: ")
        if not frames or not self._frames_told:
            self._frames_told, reason = self._frames_told or bool(frames), fault.reason
        column = f"{fault.column}: " if fault.column else ""
        return f"{self.source}:{fault.line}:{' ' * (not column)}{column}{reason.rstrip(';')}"

    def _fate(self) -> str:
        return "row skipped" if self.on_error == SKIP else "no result"
