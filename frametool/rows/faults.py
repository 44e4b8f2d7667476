"""Run a stream: outcomes in order, bad rows reported after the good ones before them, and the exit status."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import FormatError, FrametoolError, NamedTuple, UnknownFrame, shown, warn

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from frametool.rows.batch import RowPoses
    from frametool.rows.sinks.results import BlockResults, ResultWriter

STOP, SKIP, NULL = "stop", "skip", "null"
ON_ERROR = (STOP, SKIP, NULL)
MOST = 20
DONE, ROWS_SKIPPED = 0, 3


class Fault(NamedTuple):
    """A bad row.

    line: of the row; from 0 within a block, from 1 in a report
    column: the name or number of the bad column; "" for the whole row
    reason: why it is bad, as an error or a message
    final: nothing after it can be read
    kind: the name of the failure in machine output, if the reason has none
    skipped: the row is skipped whatever `on_error` is
    """

    line: int
    column: str
    reason: str | FrametoolError
    final: bool = False
    kind: str = ""
    skipped: bool = False


DEGREES = "degrees"
ZONES = "zone"  # the UTM zone of a row; `run` warns when it changes


class RowNote(NamedTuple):
    """A warning about a row: its line from 0, the rule, the message, and the column."""

    line: int
    about: str
    sentence: str
    column: str = ""

    def place(self) -> tuple[int, str, int, str]:
        """Return the key that notes are sorted by: line, rule, column; records may share a line."""
        return self.line, self.about, len(self.column), self.column

    @classmethod
    def of_lost_name(cls, line: int, name: str) -> RowNote:
        """Return the warning that the result no longer names a frame."""
        return cls(line, "unnamed", f"frame {shown(name)} is left out: the frames of the result are not known")


class BadRow(FormatError):
    """The report of a bad row; if it ends the run, the rows before it are already written.

    fate: `row skipped`, `no result`, or "" if it ends the run
    counted: the unit of its number: `line`, or `row` or `message` in files without lines
    remedy: what to do, in text output
    """

    def __init__(self, fault: Fault, reason: str, *, source: str, fate: str = "", counted: str = "line") -> None:
        """Store the place and the kind of a fault; `reason` is its long or its short message."""
        super().__init__(f"{reason} ({fate})" if fate else reason, source=source, line=fault.line)
        self.fault = fault
        self.counted = counted
        self.remedy = ""

    def __str__(self) -> str:
        """Return `source:line:column: message`, or `source: row 17, column x: message`."""
        if self.counted == "line":
            return super().__str__()
        return f"{_place(self.source, self.counted, self.line, self.fault.column)}: {self.message}"

    @property
    def kind(self) -> str:
        """Return the name of the failure that made the row bad."""
        return self.fault.kind or getattr(self.fault.reason, "kind", "bad_row")

    def details(self) -> dict[str, object]:
        """Return the place, with the column as a name or a number."""
        column = self.fault.column
        place = super().details()
        if self.counted != "line":
            place = {"source": self.source, self.counted: self.line}
        return place | ({"column": int(column) if column.isdecimal() else column} if column else {})


def _place(source: str, counted: str, number: int, column: str) -> str:
    """Return the place of a line, row or message of a source, and of a column in it."""
    if counted == "line":
        return f"{source}:{number}" + f":{column}" * bool(column)
    return f"{source}: {counted} {number}" + f", column {column}" * bool(column)


class RowsSkipped(FrametoolError):
    """The report of how many rows of a run have no result."""

    exit_code = ROWS_SKIPPED


class BadRows:
    """Report bad rows as they come, count them, and determine how the run ends.

    source: its name in messages
    on_error: STOP, SKIP or NULL
    most: the number of rows to report
    tell: function that reports an error
    counted: the unit of rows: `line`, `row` or `message`
    """

    def __init__(
        self, source: str, on_error: str = STOP, *, most: int = MOST, counted: str = "line",
        tell: Callable[[FrametoolError], None] = lambda error: warn(str(error)),
    ) -> None:  # fmt: skip
        """Start with no bad rows."""
        self.source = source
        self.on_error = on_error
        self.most = most
        self.tell = tell
        self.counted = counted
        self.unit = "message" if counted == "message" else "row"
        self.count = 0
        self._has_listed = False  # only the first message lists the known names

    def take(self, faults: Iterable[Fault]) -> None:
        """Report the faults of a block; raise BadRow at the first if `on_error` is STOP, or if nothing follows it."""
        for fault in faults:
            self.count += 1
            if self.on_error == STOP or fault.final:
                raise BadRow(fault, self._reason(fault), source=self.source, counted=self.counted)
            if self.count <= self.most:
                fate = f"{self.unit} skipped" if self.on_error == SKIP or fault.skipped else "no result"
                self.tell(BadRow(fault, self._reason(fault), source=self.source, fate=fate, counted=self.counted))

    def place(self, number: int, column: str = "") -> str:
        """Return the place of a line or a row, and of a column in it."""
        return _place(self.source, self.counted, number, column)

    def finish(self, rows: int) -> int:
        """Report the number of bad rows of a run with `rows` rows; return the exit status."""
        if not self.count:
            return DONE
        verb = "skipped" if self.on_error == SKIP else "without result"
        more = f", {self.count - self.most} of them not shown" if self.count > self.most else ""
        message = f"{self.source}: {self.count} of {rows} {self.unit}s {verb}{more}"
        self.tell(RowsSkipped(message, source=self.source, bad=self.count, rows=rows))
        return ROWS_SKIPPED

    def _reason(self, fault: Fault) -> str:
        if not isinstance(fault.reason, UnknownFrame):
            return str(fault.reason)
        known, self._has_listed = self._has_listed, True
        return fault.reason.short if known else str(fault.reason)


class Outcome(NamedTuple):
    """The result of a block.

    text: the output
    faults: the bad rows, with lines from 0
    rows, lines, size: the number of rows, lines and bytes of the block
    mended: the number of rotations that were normalised
    notes: warnings
    kept: the number of rows in the text, or in the results
    is_open: an array continues after the block; None outside of arrays
    results: results that are not yet written
    """

    text: bytes | memoryview
    faults: Sequence[Fault] = ()
    rows: int = 0
    lines: int = 0
    mended: int = 0
    notes: Sequence[RowNote] = ()
    size: int = 0
    kept: int = 0
    is_open: bool | None = None
    results: RowPoses | BlockResults | None = None


def written_by(writer: ResultWriter, outcomes: Iterator[Outcome], on_error: str) -> Generator[Outcome]:
    """Write the results of blocks; text that the writer holds back comes before the error that ends a stream."""
    begun = False
    while True:
        try:
            outcome = next(outcomes, None)
        except FrametoolError:
            if begun:
                yield from map(Outcome, writer.end())
            raise
        if outcome is None:
            yield from map(Outcome, writer.end())
            return
        begun = begun or outcome.kept > 0
        text = b"" if outcome.results is None else writer.of_block(outcome.results)
        if begun and any(on_error == STOP or fault.final for fault in outcome.faults):
            yield from map(Outcome, (text, *writer.end()))
            text = b""
        yield outcome._replace(text=text)


def run(
    outcomes: Iterable[Outcome],
    write: Callable[[bytes | memoryview], None],
    bad: BadRows,
    advance: Callable[[int, int], None] | None = None,
) -> int:
    """Write the text of each block, report its faults, and return the exit status.

    advance: called with the rows and bytes of each block.  Raises BadRow at the first fault if `bad.on_error` is STOP.
    """
    line, rows, mended = 1, 0, 0
    reported: set[str] = set()
    zone = ""
    for outcome in outcomes:
        if outcome.text:
            write(outcome.text)
        if advance is not None:
            advance(outcome.rows, outcome.size)
        faults: Sequence[Fault] = outcome.faults and [each._replace(line=each.line + line) for each in outcome.faults]
        for note in outcome.notes:  # in the order of the lines
            if note.about == ZONES:
                before, zone = zone or note.sentence, note.sentence
                if before == zone:
                    continue
                sentence = f"the zone changes from {before} to {zone}: another grid; --zone {before} holds one"
                note = note._replace(sentence=sentence)  # noqa: PLW2901
            if note.about in reported:
                continue
            reported.add(note.about)
            bad.take(fault for fault in faults if fault.line < line + note.line)
            faults = [fault for fault in faults if fault.line >= line + note.line]
            warn(f"{bad.place(line + note.line, note.column)}: {note.sentence}")
        bad.take(faults)
        line, rows, mended = line + outcome.lines, rows + outcome.rows, mended + outcome.mended
    if mended > 1:  # the first was already reported
        warn(f"{bad.source}: {mended} of {rows} rotations were off by more than 1e-6 and were normalised")
    return bad.finish(rows)
