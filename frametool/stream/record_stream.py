"""JSON and YAML records as streams: each keeps its spelling and all its other keys, or is written in another format.

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
from frametool.documents.document import Node, parse_nodes
from frametool.errors import FormatError, FrametoolError, ValueInvalid
from frametool.frames.stamps import read_header_stamp, read_stamp, stamp_text
from frametool.grammar.pose import Pose
from frametool.grammar.readers import STAMP_KEYS, in_nanoseconds
from frametool.grammar.result import NoResult, Style
from frametool.stream.faults import NULL, STOP, Fault, Outcome, RowNote
from frametool.stream.record_results import BlockResults, text_in_order
from frametool.stream.record_values import MOST_ENTRIES, ROUNDED, Outside, RecordText, plain, values_of_text
from frametool.stream.splice import attempt, column_in, fault_at, nulled, rendered
from frametool.stream.splitter import ARRAY, NO_END, Part, Splitter
from frametool.text.lines import Pieces, read_blocks, readiness, with_edits

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from frametool.geometry.types import Components
    from frametool.stream.evaluate import Run, State
    from frametool.stream.record_cuts import Hit, RecordCutter
    from frametool.stream.record_rows import RecordRows
    from frametool.stream.request import Request
    from frametool.stream.writers import AlikeRows
    from frametool.text.lines import ByteStream

_LEADING_COMMA = re.compile(rb"\A((?:\xef\xbb\xbf)?\s*\[?\s*),\s*")
LONG_MS = 20  # how long the second block of a stream may take whose first is short
MOST_EXACT = 100  # bad records of one template in a block whose place is looked for


def run_records(
    stream: ByteStream, fmt: str, request: Request, *, source: str, style: Style | None = None
) -> Generator[Outcome]:
    """Yield the outcomes of a stream of records: as text in place, or as results to be written in a style."""
    outcomes = _outcomes(stream, RecordBlocks(fmt, request, source, style))
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
    are_few = second is None and not work.request.in_order and len(work.splitter.parts(first)[0]) <= sizes.FEW
    is_open: bool | None = True
    for block in chain([first, second] if second else [first], blocks):
        outcome = work.outcome(block, are_few=are_few)
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
            for part in splitter.parts(block)[0]:
                with suppress(FrametoolError, TypeError, UnicodeDecodeError):  # a list is no key
                    moved, _ = with_offset(block[part.start : part.end].decode(), offset_ns)
                    edits.append((part.start, part.end, moved.encode()))
            yield with_edits(block, edits)

    return BufferedReader(Pieces(filter(None, pieces())))


def with_offset(text: str, offset_ns: int) -> tuple[str, int]:
    """Return documents with so much added to all stamps in them, and how many these are."""
    edits: list[tuple[int, int, str]] = []
    for root in parse_nodes(text):
        _shift(root, offset_ns, edits)
    return with_edits(text, edits), len(edits)


def _shift(node: Node, offset_ns: int, edits: list[tuple[int, int, str]]) -> None:
    """Add to `edits` those of the stamps below a node: one of a mapping by its key, or the seconds it is made of."""
    if type(node.value) is list:
        for each in node.value:
            _shift(each, offset_ns, edits)
    if type(node.value) is not dict:
        return
    own = next((key for key in STAMP_KEYS if key in node.value and type(node.value[key][1].value) is str), "")
    for key, (_, value) in node.value.items():
        if key != own:
            _shift(value, offset_ns, edits)
            continue
        with suppress(ValueInvalid):
            in_ns = in_nanoseconds(key)
            new = stamp_text(value.value, read_stamp(value.value, in_ns=in_ns) + offset_ns, in_ns=in_ns)
            edits.append((value.start + bool(value.quote), value.end - bool(value.quote), new))
    for seconds, below in (("sec", "nanosec"), ("secs", "nsecs")):
        pair = [node.value[key][1] for key in (seconds, below) if key in node.value]
        if len(pair) == 2:
            with suppress(ValueInvalid):
                stamp_ns = read_header_stamp(*(each.value for each in pair)) + offset_ns
                parts = divmod(stamp_ns, 1_000_000_000)
                edits += [(each.start, each.end, str(part)) for each, part in zip(pair, parts, strict=True)]


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
        self.alike: list[AlikeRows] = []
        self.notes: list[RowNote] = []
        self.rows = self.kept = self.mended = 0


class RecordBlocks:
    """Process one block of records after the other.

    Results take the places of numbers and all else stays, or they are values and rows to be written in a style.
    """

    def __init__(self, fmt: str, request: Request, source: str, style: Style | None = None) -> None:
        """Start without templates."""
        self.fmt, self.style, operation = fmt, style, request.operation
        self.request = request if style is None else request.with_results(canonical=True)
        self.splitter = Splitter(fmt)
        self._read = partial(attempt, fmt=fmt, request=self.request, name=source)
        shows_all = operation.shown is not None or (request.results.place is not None and not operation.looks_back)
        learns = (sizes.LEARNED or request.in_order) and not (style is not None and shows_all)
        self._is_singly = not learns  # records are only taken one by one
        self._left = sizes.LEARNED  # where no records are alike, learning is lost time
        self.ended = True  # whether the last block ended with a line

    @cached_property
    def _bulk(self) -> tuple[RecordCutter, State, RecordRows | None]:
        """Return what finds records that are alike, what one block leaves for the next, and what makes rows of them."""
        from frametool.stream.evaluate import State
        from frametool.stream.record_cuts import RecordCutter

        rows = None
        if self.style is not None:
            from frametool.stream.record_rows import RecordRows

            rows = RecordRows(self.request, self.style, is_yaml=self.fmt == "yaml")
        return RecordCutter(self.splitter, self._read), State(), rows

    def outcome(self, text: bytes, *, are_few: bool) -> Outcome:
        """Return the outcome of a block; a few records are taken one by one."""
        found, are_few = Found(), are_few or self._is_singly
        closed = self._take(text, 0, len(text), found) if are_few else self._run(text, found)
        self.ended = text.endswith(b"\n")
        found.faults.sort()
        stops = self.request.on_error == STOP and found.faults
        end = found.faults[0][0] if stops else len(text) + 1
        is_open = None if self.splitter.layout != ARRAY else not closed
        outcome = Outcome(
            b"", [*map(itemgetter(1), found.faults)], found.rows, text.count(b"\n"), found.mended,
            sorted(found.notes, key=RowNote.place), len(text), found.kept, is_open,
        )  # fmt: skip
        items = sorted((each for each in found.items if each[0] < end), key=itemgetter(0))
        if self.style is None:
            groups = [group for run in found.runs for group in run.groups(end)]
            return outcome._replace(text=text_in_order(items, groups))
        alike = [each.take((each.places < end).nonzero()[0]) for each in found.alike] if stops else found.alike
        return outcome._replace(results=BlockResults([each for each in alike if len(each.places)], items, text))

    def _take(self, text: bytes, start: int, end: int, found: Found) -> bool:
        """Take records one by one; what is between them passes.  Return whether an array ends there."""
        parts, closed = self.splitter.parts(text[start:end])
        at, singles, keeps_text = start, found.singles, self.style is None
        for part, line in _with_lines(text, (each.behind(start) for each in parts) if start else parts):
            if part.begin > at and keeps_text:
                found.items.append((at, text[at : part.begin]))
            at = part.after
            made = (singles is not None and self._bulk[0].match(text, part)) or self._read(text, part, line)
            if singles is not None and isinstance(made, RecordText):
                are_few = keeps_text or len(made.entries) <= MOST_ENTRIES
                is_alike = self._left and are_few and not made.is_long
                self._left -= bool(is_alike)
                if is_alike or self.request.in_order:
                    made = self._bulk[0].learned(made, text, part) or made
            if isinstance(made, (RecordText, Fault)):
                self._alone(text, part, made, line, found)
            elif singles is not None:
                singles.append((part, made))
            if found.faults and self.request.on_error == STOP:
                return closed
        if at < end and keeps_text:
            found.items.append((at, text[at:end]))
        return closed

    def _alone(
        self, text: bytes, part: Part, made: RecordText | Fault, line: int, found: Found,
        parts: Sequence[Components] | None = None,
    ) -> None:  # fmt: skip
        """Take what a record becomes, or why it becomes nothing; parts: the numbers of its results, if known."""
        record, style, items = text[part.start : part.end], self.style, list[tuple[int, Any]]()
        if isinstance(made, RecordText):
            try:
                answers = made.answers(parts)
                if style is None:
                    items = [_put(text, part, rendered(made, answers) or record)]
                else:
                    items = [*zip(count(part.start), values_of_text(made, answers, style), strict=False)]
                notes = made.notes_at(line, column_in(text, part.start), answers)
            except FormatError as error:
                made = fault_at(made.source, error)
            except FrametoolError as error:
                made = Fault(line + made.line, getattr(error, "column_name", ""), error)
            else:
                found.notes += notes
                found.mended += [note.rule for note in made.notes].count(ROUNDED) if made.notes else 0
                found.rows, found.kept = found.rows + 1, found.kept + 1
                found.items += items
                return
        if isinstance(made.reason, Outside):
            return
        found.rows += 1
        found.faults.append((part.begin, made))
        if self.request.on_error == NULL and not made.final:
            found.kept += 1
            is_json = self.fmt == "json"
            if style is None:  # itself, with null in the place of numbers, or null
                body = record.rstrip(b"\r\n")
                row = (nulled(body, json=is_json) or "null").encode() + record[len(body) :]
                found.items.append(_put(text, part, row))
            else:
                found.items.append((part.start, _no_result(record, style, json=is_json)))

    def _run(self, text: bytes, found: Found) -> bool:
        """Run the records of all templates, the others alone.  Return whether an array ends there.

        One that is bad is taken alone too, which says where it is wrong.
        """
        from frametool.stream.evaluate import Run
        from frametool.stream.record_cuts import block_of, by_template, in_order, plan_of
        from frametool.text.spans import framed

        cutter, state, rows = self._bulk
        found.singles, closed = [], False
        cuts, rest = cutter.cut(text)
        for start, end in rest:
            closed = self._take(text, start, end, found)
        cuts = by_template(cuts, found.singles)
        cuts = in_order(cuts) if self.request.in_order else cuts
        data = framed(text if cuts else b"")
        for cut in cuts:
            template, left = cut.template, set[int]()
            plan = rows.plan(template) if rows else plan_of(template, self.request, yaml=self.fmt == "yaml")
            run = Run(plan, block_of(cut, data, text, plan.request), state)
            if rows is not None:
                alike, left = rows.take(cut, run, data, text)
                found.alike += alike
            alone = sorted({*run.reasons, *left})
            found.rows += len(cut.starts) - len(alone)
            found.kept += len(run.rows) - len(left)
            found.mended += len({*run.mended} - left)
            found.runs.append(run)
            for at, (part, line) in enumerate(_with_lines(text, map(cut.part, alone))):
                reason = run.reasons.get(row := alone[at])
                made = self._read(text, part, line) if reason is None or at < MOST_EXACT else None
                if made is None or (reason is not None and not isinstance(made, Fault)):
                    made = Fault(run.block.line_of(row), *(reason or ("", "")))
                self._alone(text, part, made, line, found, run.parts_of(row) if self.request.in_order else None)
            found.notes += run.notes
            if len(cut.starts):
                found.notes += [each._replace(line=run.block.line_of(0)) for each in template.notes]
        return closed


def _no_result(record: bytes, style: Style, *, json: bool) -> NoResult:
    """Return what a bad record says besides its numbers; in a table those are empty cells under names of their own."""
    is_table = style.format == "csv"
    try:
        root = parse_nodes(nulled(record, json=json) or record.decode())[0]
        kept = {
            key: plain(node) for key, (_, node) in (root.value.items() if type(root.value) is dict else ())
            if not is_table or any(plain(leaf) is not None for leaf in node.leaves())
        }  # fmt: skip
    except (FormatError, UnicodeDecodeError, IndexError, TypeError):  # broken: no parser has taken it before
        kept = {}
    return NoResult(Pose(), kept)


def _with_lines(text: bytes, parts: Iterable[Part]) -> Iterator[tuple[Part, int]]:
    """Yield records that follow each other, each with its line, counted from 0."""
    line = counted = 0
    for part in parts:
        line, counted = line + text.count(b"\n", counted, part.start), part.start
        yield part, line


def _put(text: bytes, part: Part, row: bytes) -> tuple[int, bytes]:
    """Return a record with what goes with it, and its place."""
    return part.begin, text[part.begin : part.start] + row + text[part.end : part.after]
