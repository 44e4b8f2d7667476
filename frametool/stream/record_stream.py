"""JSON and YAML records as streams: each keeps its spelling and all its other keys, byte for byte.

Few records of a whole stream are computed one by one, without numpy; of more those written alike are moved as arrays.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cached_property, partial
from io import BufferedReader
from itertools import chain, count
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from frametool import sizes
from frametool.documents.document import parse_nodes
from frametool.errors import FormatError, FrametoolError
from frametool.grammar.pose import Pose
from frametool.grammar.result import NoResult, Style
from frametool.stream import stamp_source
from frametool.stream.faults import NULL, STOP, Fault, Outcome, RowNote
from frametool.stream.record_results import BlockResults
from frametool.stream.record_text import ROUNDED, Answer, Outside, RecordText
from frametool.stream.record_values import plain, values_of_text
from frametool.stream.splice import attempt, column_in, fault_at, null_of, nulled, rendered
from frametool.stream.splitter import ARRAY, NO_END, Part, Splitter
from frametool.text.lines import Pieces, read_blocks, readiness

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from frametool.geometry.types import Components
    from frametool.stream.evaluate import Plan, Run, State
    from frametool.stream.record_cuts import Cut, Hit, RecordCutter
    from frametool.stream.record_rows import RecordRows
    from frametool.stream.request import Request
    from frametool.stream.template import Template
    from frametool.stream.text_rows import AlikeRows
    from frametool.text.lines import ByteStream
    from frametool.text.spans import Bytes

_LEADING_COMMA = re.compile(rb"\A((?:\xef\xbb\xbf)?\s*\[?\s*),\s*")
LONG_MS = 20  # how long the second block of a stream may take whose first is short
MOST_EXACT = 100  # bad records of one template in a block whose place is looked for


def run_records(
    stream: ByteStream, fmt: str, request: Request, *, source: str, style: Style | None = None
) -> Generator[Outcome]:
    """Yield the outcomes of a stream of records: as text in place, or as results to be written in a style."""
    work = RecordBlocks(fmt, request, source) if style is None else RecordResults(fmt, request, source, style)
    outcomes = _outcomes(stream, work)
    yield from _as_array(outcomes, request.on_error) if fmt == "json" and style is None else outcomes


def _outcomes(stream: ByteStream, work: RecordBlocks) -> Generator[Outcome]:
    """Yield the outcomes of the blocks of a stream; the lack of the closing bracket of an array is a fault."""
    blocks = read_blocks(stream, whole=work.splitter.whole)
    first = next(blocks, None)
    if first is None:
        return
    second: bytes | None = b""
    failed: FormatError | None = None
    if len(first) < sizes.SMALL and readiness(stream, unknown=True)(LONG_MS):
        try:
            second = next(blocks, None)
        except FormatError as error:  # comes behind the results of what is whole
            failed = error
    are_few = second is None and not work.request.in_order and len(work.splitter.parts(first).parts) <= sizes.FEW
    is_open: bool | None = True
    for block in chain([first, second] if second else [first], blocks):
        outcome = work.few(block) if are_few else work.many(block)
        is_open = is_open and outcome.is_open
        yield outcome
    if failed is not None:
        raise failed
    if is_open:
        yield Outcome(b"", (Fault(-1 if work.ended else 0, "", NO_END),), is_open=True)


def at_other_times(stream: ByteStream, fmt: str, offset_ns: int) -> BufferedReader:
    """Return a stream of records with so much added to all stamps in them; a record that cannot be read stays."""

    def pieces() -> Iterator[bytes]:
        splitter = Splitter(fmt)
        for block in read_blocks(stream, whole=splitter.whole):
            edits = []
            for part in splitter.parts(block).parts:
                with suppress(FrametoolError, TypeError, UnicodeDecodeError):  # a list is no key
                    moved, _ = stamp_source.at_other_times(block[part.start : part.end].decode(), offset_ns)
                    edits.append((part.start, part.end, moved.encode()))
            yield stamp_source.replaced(block, edits)

    return BufferedReader(Pieces(filter(None, pieces())))


def _as_array(outcomes: Iterable[Outcome], on_error: str) -> Iterator[Outcome]:
    """Allow no comma before the first record that is left, and close an array that does not end.

    What is before that record is held back: where the first one is an error nothing is written.
    """
    any_kept, held = False, b""
    for outcome in outcomes:
        text = held + outcome.text
        if outcome.is_open is not None and not any_kept and outcome.kept:
            text = _LEADING_COMMA.sub(rb"\1", text)
        broken = any(each.final or each.reason == NO_END for each in outcome.faults)
        ends = on_error != STOP and outcome.is_open and broken
        text += b"]\n" if ends else b""
        any_kept = any_kept or bool(outcome.kept or ends)
        held = b"" if any_kept or outcome.is_open is None else text
        yield outcome._replace(text=text[len(held) :])
    if held:
        yield Outcome(held, ())


class Found:
    """What one block holds: what becomes of records alone and faults, by place, rows of many, warnings, counts.

    singles: where there are many, the records that follow a template
    kept: how many records have a result, or null in the place of one
    """

    def __init__(self) -> None:
        """Create an empty one."""
        self.singles: list[tuple[Part, Hit]] | None = None
        self.items: list[tuple[int, Any]] = []
        self.faults: list[tuple[int, Fault]] = []
        self.runs: list[Run] = []
        self.batches: list[AlikeRows] = []
        self.notes: list[RowNote] = []
        self.rows = self.kept = self.mended = 0


class RecordBlocks:
    """Process one block of records after the other: results take the places of numbers, all else stays."""

    keeps_text = True
    is_singly = False  # whether records are only taken one by one
    most_entries = 1 << 30  # of a record that others may be alike

    def __init__(self, fmt: str, request: Request, source: str) -> None:
        """Start without templates."""
        self.fmt, self.request = fmt, request
        self._read = partial(attempt, fmt=fmt, request=request, name=source)
        self.splitter = Splitter(fmt)
        self.left = sizes.LEARNED  # where no records are alike, learning is lost time
        self.ended = True  # whether the last block ended with a line

    def few(self, text: bytes) -> Outcome:
        """Return the outcome of records that are taken one by one."""
        found = Found()
        closed = self._take(text, 0, len(text), found)
        return self._outcome(text, [], found, closed=closed)

    @cached_property
    def bulk(self) -> tuple[RecordCutter, State]:
        """Return what finds records that are alike, and what one block leaves for the next."""
        from frametool.stream.evaluate import State
        from frametool.stream.record_cuts import RecordCutter

        return RecordCutter(self.splitter, self._read), State()

    def many(self, text: bytes) -> Outcome:
        """Return the outcome of a block."""
        from frametool.stream.record_cuts import by_template, in_order

        if self.is_singly or not (sizes.LEARNED or self.request.in_order):
            return self.few(text)
        found, closed = Found(), False
        found.singles = []
        cuts, rest = self.bulk[0].cut(text)
        for start, end in rest:
            closed = self._take(text, start, end, found)
        cuts = by_template(cuts, found.singles)
        return self._outcome(text, in_order(cuts) if self.request.in_order else cuts, found, closed=closed)

    def _take(self, text: bytes, start: int, end: int, found: Found) -> bool:
        """Take records one by one; what is between them passes.  Return whether an array ends there."""
        parts, closed = self.splitter.parts(text[start:end])
        at, singles = start, found.singles
        for part, line in _with_lines(text, (each.behind(start) for each in parts) if start else parts):
            if part.begin > at and self.keeps_text:
                found.items.append((at, text[at : part.begin]))
            at = part.after
            made = (singles is not None and self.bulk[0].match(text, part)) or self._read(text, part, line)
            if singles is not None and isinstance(made, RecordText):
                made = self._learned(made, text, part) or made
            if isinstance(made, (RecordText, Fault)):
                self._alone(text, part, made, line, found)
            elif singles is not None:
                singles.append((part, made))
            if found.faults and self.request.on_error == STOP:
                return closed
        if at < end and self.keeps_text:
            found.items.append((at, text[at:end]))
        return closed

    def _learned(self, made: RecordText, text: bytes, part: Part) -> Hit | None:
        """Return a template that is learned from a record; None for one that is taken alone."""
        is_alike = self.left and not made.is_long and len(made.entries) <= self.most_entries
        self.left -= bool(is_alike)
        return self.bulk[0].learned(made, text, part) if is_alike or self.request.in_order else None

    def _alone(
        self, text: bytes, part: Part, made: RecordText | Fault, line: int, found: Found,
        parts: Sequence[Components] | None = None,
    ) -> None:  # fmt: skip
        """Take what a record becomes, or why it becomes nothing; parts: the numbers of its results, if known."""
        if isinstance(made, RecordText):
            try:
                answers = made.answers(parts)
                items = self.results(made, answers, text, part)
                notes = made.notes_at(line, column_in(text, part.start), answers)
            except FormatError as error:
                made = fault_at(made.source, error)
            except FrametoolError as error:
                made = Fault.of(line + made.line, getattr(error, "column_name", ""), error)
            else:
                found.notes += notes
                found.mended += [note.rule for note in made.notes].count(ROUNDED) if made.notes else 0
                found.rows, found.kept = found.rows + 1, found.kept + 1
                found.items += items
                return
        if made.kind == Outside.kind:
            return
        found.rows += 1
        found.faults.append((part.begin, made))
        if self.request.on_error == NULL and not made.final:
            found.kept += 1
            found.items += self.without(text, part)

    def _outcome(self, text: bytes, cuts: Sequence[Cut], found: Found, *, closed: bool) -> Outcome:
        """Run every template's records, and put all of it in order."""
        self.ended = text.endswith(b"\n")
        if cuts:
            self._run(text, cuts, found)
        found.faults.sort()
        stops = self.request.on_error == STOP and found.faults
        end = found.faults[0][0] if stops else len(text) + 1
        faults = [*map(itemgetter(1), found.faults)]
        is_open = None if self.splitter.layout != ARRAY else not closed
        lines, notes = text.count(b"\n"), sorted(found.notes, key=RowNote.place)
        outcome = Outcome(b"", faults, found.rows, lines, found.mended, notes, len(text), found.kept, is_open)
        return self.put_together(outcome, found, end)

    def _run(self, text: bytes, cuts: Sequence[Cut], found: Found) -> None:
        """Run the records of all templates; one that is bad is taken alone, which says where it is wrong."""
        from frametool.stream.evaluate import Run
        from frametool.stream.record_cuts import block_of
        from frametool.text.spans import framed

        data = framed(text)
        for cut in cuts:
            plan = self.plan(cut.template)
            run = Run(plan, block_of(cut, data, text, plan.request), self.bulk[1])
            left = self.alone_of(cut, run, data, text, found)
            alone = sorted({*run.reasons, *left})
            found.rows += len(cut.starts) - len(alone)
            found.kept += len(run.rows) - len(left)
            found.mended += len({*run.mended} - left)
            found.runs.append(run)
            for at, (part, line) in enumerate(_with_lines(text, map(cut.part, alone))):
                reason = run.reasons.get(row := alone[at])
                made = self._read(text, part, line) if reason is None or at < MOST_EXACT else None
                if made is None or (reason is not None and not isinstance(made, Fault)):
                    made = Fault.of(run.block.line_of(row), *(reason or ("", "")))
                self._alone(text, part, made, line, found, run.parts_of(row) if self.request.in_order else None)
            found.notes += run.notes
            own = [*cut.template.notes, *cut.template.of_places]
            found.notes += [each._replace(line=run.block.line_of(0)) for each in own if len(cut.starts)]

    # --- what differs where results are written in another format ---

    def results(self, known: RecordText, answers: list[Answer], text: bytes, part: Part) -> Iterable[tuple[int, Any]]:
        """Return what a record becomes, and its place: its text."""
        return [_put(text, part, rendered(known, answers) or text[part.start : part.end])]

    def without(self, text: bytes, part: Part) -> Iterable[tuple[int, Any]]:
        """Return what replaces a record without a result: itself with null in the place of numbers."""
        return [_put(text, part, null_of(text[part.start : part.end], json=self.fmt == "json"))]

    def plan(self, template: Template) -> Plan:
        """Return what is done to the records of a template."""
        from frametool.stream.record_cuts import plan_of

        return plan_of(template, self.request, yaml=self.fmt == "yaml")

    def alone_of(self, cut: Cut, run: Run, data: Bytes, text: bytes, found: Found) -> set[int]:  # noqa: ARG002
        """Return the rows of a run that are taken alone all the same: none."""
        return set()

    def put_together(self, outcome: Outcome, found: Found, end: int) -> Outcome:
        """Return the outcome with the text of all records in order, up to a place."""
        texts = sorted(each for each in found.items if each[0] < end)
        if not found.runs:
            return outcome._replace(text=b"".join([piece for _, piece in texts]))
        from frametool.stream.rows import texts_as_rows, written

        groups = [group for run in found.runs for group in run.groups(end)]
        return outcome._replace(text=written([*groups, texts_as_rows(texts)] if texts else groups))


def _no_result(record: bytes, fmt: str, style: Style) -> NoResult:
    """Return what a bad record says besides its numbers; in a table those are empty cells under names of their own."""
    try:
        text = record.decode()
        said = plain(parse_nodes(nulled(text, json=fmt == "json") or text)[0])
    except (FormatError, UnicodeDecodeError, IndexError, TypeError):  # broken: no parser has taken it before
        said = None
    kept = said if type(said) is dict else {}
    return NoResult(Pose(), {key: value for key, value in kept.items() if style.format != "csv" or _says(value)})


def _says(value: Any) -> bool:
    """Return True if there is more than null in a value."""
    inner = value.values() if type(value) is dict else value if type(value) is list else None
    return value is not None if inner is None else any(map(_says, inner))


def _with_lines(text: bytes, parts: Iterable[Part]) -> Iterator[tuple[Part, int]]:
    """Yield records that follow each other, each with its line, counted from 0."""
    line = counted = 0
    for part in parts:
        line, counted = line + text.count(b"\n", counted, part.start), part.start
        yield part, line


def _put(text: bytes, part: Part, row: bytes) -> tuple[int, bytes]:
    """Return a record with what goes with it, and its place."""
    return part.begin, text[part.begin : part.start] + row + text[part.end : part.after]


class RecordResults(RecordBlocks):
    """Process one block of records after the other: results are written in another format."""

    keeps_text = False
    most_entries = 8  # each is looked at for itself

    def __init__(self, fmt: str, request: Request, source: str, style: Style) -> None:
        """Start without templates."""
        super().__init__(fmt, request.with_results(canonical=True), source)
        self.style = style
        operation = request.operation
        self.is_singly = operation.shown is not None or (request.results.place is not None and not operation.looks_back)

    @cached_property
    def rows(self) -> RecordRows:
        """Return what makes rows of records that are alike."""
        from frametool.stream.record_rows import RecordRows

        return RecordRows(self.request, self.style, is_yaml=self.fmt == "yaml")

    def results(self, known: RecordText, answers: list[Answer], text: bytes, part: Part) -> Iterable[tuple[int, Any]]:  # noqa: ARG002
        """Return the values that a record becomes."""
        return zip(count(part.start), [*values_of_text(known, answers, self.style)], strict=False)

    def without(self, text: bytes, part: Part) -> Iterable[tuple[int, Any]]:
        """Return what a bad record says besides its numbers; in a table those are empty cells under own names."""
        return [(part.start, _no_result(text[part.start : part.end], self.fmt, self.style))]

    def plan(self, template: Template) -> Plan:
        """Return what is done to the records of a template."""
        return self.rows.plan(template)

    def alone_of(self, cut: Cut, run: Run, data: Bytes, text: bytes, found: Found) -> set[int]:
        """Keep the rows of a run; return those that are taken alone."""
        batches, left = self.rows.take(cut, run, data, text)
        found.batches += batches
        return left

    def put_together(self, outcome: Outcome, found: Found, end: int) -> Outcome:
        """Return the outcome with all results up to a place."""
        if outcome.faults and self.request.on_error == STOP:
            batches = [each.take((each.places < end).nonzero()[0]) for each in found.batches]
            found.batches = [each for each in batches if len(each.places)]
            found.items = [each for each in found.items if each[0] < end]
        return outcome._replace(results=BlockResults(found.batches, sorted(found.items, key=itemgetter(0))))
