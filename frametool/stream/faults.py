"""Bad rows: what is reported about each, how many are reported, and whether the run goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, FrametoolError, UnknownFrame, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

STOP, SKIP, NULL = "stop", "skip", "null"
ON_ERROR = (STOP, SKIP, NULL)
MOST = 20
DONE, ROWS_SKIPPED = 0, 3


class Fault(NamedTuple):
    """One bad row.

    line: counted as whoever keeps it says
    column: the name or number of the column that is to blame, "" for the whole row
    reason: why it is bad
    final: nothing behind it can be read
    kind: the name of the failure in machine output
    short: the reason without the list of what there is, where it has one
    skipped: the row is left out whatever the rule
    """

    line: int
    column: str
    reason: str
    final: bool = False
    kind: str = "bad_row"
    short: str = ""
    skipped: bool = False

    @classmethod
    def of(cls, line: int, column: str, reason: str | FrametoolError) -> Fault:
        """Make a fault of an error, or of a reason in words."""
        if isinstance(reason, str):
            return cls(line, column, reason)
        short = reason.short if isinstance(reason, UnknownFrame) else ""
        return cls(line, column, str(reason), kind=reason.kind, short=short)


DEGREES = "degrees"
ZONES = "zone"  # of UTM, of a row; `run` tells where it is first another than before


class RowNote(NamedTuple):
    """Something worth telling about a row: its line from 0, what it is about, the sentence, and the column."""

    line: int
    about: str
    sentence: str
    column: str = ""

    @classmethod
    def of_lost_name(cls, line: int, name: str) -> RowNote:
        """Tell that a frame is not named any more."""
        return cls(line, "unnamed", f"frame {shown(name)} is left out: the frames of the result are not known")

    @classmethod
    def of_latest(cls, line: int, column: str) -> RowNote:
        """Tell that a column of stamps is not looked at."""
        from shlex import quote

        remedy = f"give --time-column {quote(column)}, or --at TIME"
        return cls(line, "latest", f"column {column!r} is not looked at, rows move at the latest time; {remedy}")



class BadRow(FormatError):
    """Report a bad row; if it ended the run, the rows before it are out.

    fate: what became of it: `row skipped`, `no result`, or "" if the run ended
    counted: what the number of its place counts: `line`, or `row` where there are no lines
    """

    def __init__(self, fault: Fault, reason: str, *, source: str, fate: str = "", counted: str = "line") -> None:
        """Take place and kind of a fault; `reason` is its long or its short one."""
        super().__init__(f"{reason} ({fate})" if fate else reason, source=source, line=fault.line)
        self.fault = fault
        self.counted = counted

    def __str__(self) -> str:
        """Return `source:line:column: message`, or `source: row 17, column x: message`."""
        if self.counted == "line":
            return super().__str__()
        column = f", column {self.fault.column}" if self.fault.column else ""
        return f"{self.source}: {self.counted} {self.line}{column}: {self.message}"

    @property
    def kind(self) -> str:
        """Return the name of the failure that made the row bad."""
        return self.fault.kind

    def details(self) -> dict[str, object]:
        """Return the place, whose column has a name or a number."""
        column = self.fault.column
        place = super().details()
        if self.counted != "line":
            place = {"source": self.source, self.counted: self.line}
        return place | ({"column": int(column) if column.isdecimal() else column} if column else {})


class RowsSkipped(FrametoolError):
    """Report how many rows of a run have no result."""

    exit_code = ROWS_SKIPPED


class BadRows:
    """Report bad rows as they come, count them, and say how the run ends.

    source: as messages name it
    on_error: STOP, SKIP or NULL
    most: how many are reported
    tell: what reports them
    counted: what their numbers count: lines, or rows
    """

    def __init__(
        self, source: str, on_error: str = STOP, *, most: int = MOST, tell: Callable[[FrametoolError], None],
        counted: str = "line",
    ) -> None:  # fmt: skip
        """Create an empty count."""
        self.source = source
        self.on_error = on_error
        self.most = most
        self.tell = tell
        self.counted = counted
        self.count = 0
        self._has_listed = False  # the list of what there is stands in the first message only

    def take(self, faults: Iterable[Fault]) -> None:
        """Report the faults of a block; raise BadRow at the first if that is the rule."""
        for fault in faults:
            self.count += 1
            if self.on_error == STOP or fault.final:
                raise BadRow(fault, self._reason(fault), source=self.source, counted=self.counted)
            if self.count <= self.most:
                fate = "row skipped" if self.on_error == SKIP or fault.skipped else "no result"
                self.tell(BadRow(fault, self._reason(fault), source=self.source, fate=fate, counted=self.counted))

    def place(self, number: int, column: str = "") -> str:
        """Name a line or a row, and a column in it."""
        if self.counted == "line":
            return f"{self.source}:{number}" + f":{column}" * bool(column)
        return f"{self.source}: {self.counted} {number}" + f", column {column}" * bool(column)

    def finish(self, rows: int) -> int:
        """Report the final count of a run of so many rows; return its exit status."""
        if not self.count:
            return DONE
        verb = "skipped" if self.on_error == SKIP else "without result"
        more = f", {self.count - self.most} of them not shown" if self.count > self.most else ""
        message = f"{self.source}: {self.count} of {rows} rows {verb}{more}"
        self.tell(RowsSkipped(message, source=self.source, bad=self.count, rows=rows))
        return ROWS_SKIPPED

    def _reason(self, fault: Fault) -> str:
        if fault.short and self._has_listed:
            return fault.short
        self._has_listed = self._has_listed or bool(fault.short)
        return fault.reason
