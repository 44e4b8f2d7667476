"""JSON and YAML records as streams: each keeps its spelling and all its other keys, byte for byte.

Few records of a whole stream are computed one by one, without numpy; of more those written alike are moved as arrays.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cached_property
from io import BufferedReader
from itertools import chain
from typing import TYPE_CHECKING

from frametool import sizes
from frametool.errors import FormatError, FrametoolError
from frametool.stream import stamp_source
from frametool.stream.faults import NULL, STOP, Fault, Outcome, RowNote
from frametool.stream.record_text import Outside, RecordText, attempt, column_in, null_of
from frametool.stream.splitter import ARRAY, NO_END, Part, Splitter
from frametool.text.lines import Pieces, read_blocks

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from frametool.stream.evaluate import Run, State
    from frametool.stream.record_cuts import Cut, FoundRecords, Places, RecordCutter
    from frametool.stream.request import Request
    from frametool.stream.template import Template
    from frametool.text.lines import ByteStream

    Hit = tuple[Template, Places]

_LEADING_COMMA = re.compile(rb"\A((?:\xef\xbb\xbf)?\s*\[?\s*),\s*")
MOST_EXACT = 100  # bad records of one template in a block whose place is looked for


def run_records(stream: ByteStream, fmt: str, request: Request, *, source: str) -> Generator[Outcome]:
    """Yield the outcomes of a stream of records."""
    outcomes = _outcomes(stream, RecordBlocks(fmt, request, source))
    yield from _as_array(outcomes, request.on_error) if fmt == "json" else outcomes


def _outcomes(stream: ByteStream, work: RecordBlocks) -> Generator[Outcome]:
    blocks = read_blocks(stream, whole=work.splitter.whole)
    first = next(blocks, None)
    if first is None:
        return
    second: bytes | None = b""
    if len(first) < sizes.SMALL and _has_ended(stream):
        try:
            second = next(blocks, None)
        except FormatError as error:  # comes behind the results of what is whole
            blocks = _raising(error)
    few = second is None and not work.request.in_order
    if few and len((found := work.splitter.parts(first)).parts) <= sizes.FEW:
        yield work.few(first, found.parts, closed=found.closed)
        return
    begun = [first, second] if second else [first]
    yield from map(work.many, chain(begun, blocks))


def _raising(error: FormatError) -> Iterator[bytes]:
    """Yield nothing and raise an error."""
    raise error
    yield b""


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


def _has_ended(stream: ByteStream) -> bool:
    """Return True if a stream has nothing more to come, or will have within a moment."""
    import select

    try:
        poll = select.poll()
        poll.register(stream.fileno(), select.POLLIN | select.POLLHUP)
    except (AttributeError, OSError, ValueError):
        return True
    return bool(poll.poll(20))


def _as_array(outcomes: Iterable[Outcome], on_error: str) -> Iterator[Outcome]:
    """Allow no comma before the first record that is left, and make the lack of the closing bracket a fault.

    What is before that record is held back: where the first one is an error nothing is written.
    """
    any_kept, is_open, ended = False, None, True
    held = b""
    for outcome in outcomes:
        is_open = outcome.is_open if is_open is not False else False
        text = held + outcome.text
        if outcome.is_open is not None and not any_kept and outcome.kept:
            text = _LEADING_COMMA.sub(rb"\1", text)
        if ends := outcome.is_open and on_error != STOP and any(fault.final for fault in outcome.faults):
            text += b"]\n"
        any_kept = any_kept or bool(outcome.kept or ends)
        ended = text.endswith(b"\n") if text else ended
        held = b"" if any_kept or outcome.is_open is None else text
        yield outcome._replace(text=text[len(held) :])
    if held and not (is_open and on_error == STOP):
        yield Outcome(held, ())
    if is_open:
        fault = Fault(-1 if ended else 0, "", NO_END)
        yield Outcome(b"" if on_error == STOP else b"]\n", (fault,))


class Found:
    """What one block holds besides the records that templates find: texts and faults by place, warnings, counts."""

    def __init__(self) -> None:
        """Create an empty one."""
        self.texts: list[tuple[int, bytes]] = []
        self.faults: list[tuple[int, Fault]] = []
        self.notes: list[RowNote] = []
        self.alone = self.mended = self.nulls = 0  # records that were rendered one by one, and rotations in them


class RecordBlocks:
    """Process one block of records after the other."""

    def __init__(self, fmt: str, request: Request, source: str) -> None:
        """Start without templates."""
        self.fmt, self.request, self.source = fmt, request, source
        self.splitter = Splitter(fmt)

    def few(self, text: bytes, parts: Sequence[Part], *, closed: bool) -> Outcome:
        """Return the outcome of the few records of a whole stream."""
        found = Found()
        self._take(text, 0, len(text), ((part, None) for part in parts), found)
        return self._outcome(text, [], found, closed=closed)

    @cached_property
    def _bulk(self) -> tuple[RecordCutter, State]:
        from frametool.stream.evaluate import State
        from frametool.stream.record_cuts import RecordCutter

        return RecordCutter(self.splitter, self.fmt, self.request, self.source), State()

    def many(self, text: bytes) -> Outcome:
        """Return the outcome of a block."""
        from frametool.stream.record_cuts import in_order

        cutter, _ = self._bulk
        found = Found()
        records, rest = cutter.cut(text)
        for start, end in rest:
            self._take(text, start, end, cutter.singly(text, start, end), found, records)
        cuts = records.by_template()
        return self._outcome(text, in_order(cuts) if self.request.in_order else cuts, found, closed=cutter.closed)

    def _take(
        self, text: bytes, start: int, end: int, parts: Iterable[tuple[Part, Hit | None]], found: Found,
        records: FoundRecords | None = None,
    ) -> None:  # fmt: skip
        """Take records one by one, learning new templates if there are many; what is between them passes."""
        at, line, counted = start, 0, 0
        for part, known in parts:
            if part.begin > at:
                found.texts.append((at, text[at : part.begin]))
            at = part.after
            line, counted = line + text.count(b"\n", counted, part.start), part.start
            if records is not None and (hit := known or self._learned(text, part, line, found)) is not None:
                records.add(part, *hit)
            elif records is None:
                self._alone(text, part, attempt(text, part, self.fmt, self.request, self.source, line), line, found)
            if found.faults and self.request.on_error == STOP:
                return
        if at < end:
            found.texts.append((at, text[at:end]))

    def _learned(self, text: bytes, part: Part, line: int, found: Found) -> Hit | None:
        """Return a template that is learned from a record; None for one that is taken alone."""
        cutter, _ = self._bulk
        made = cutter.read(text, part, line)
        is_alone = isinstance(made, Fault) or (made.is_long and not self.request.in_order)
        hit = None if is_alone else cutter.learned(made, text, part)
        if hit is None:
            self._alone(text, part, made, line, found)
        return hit

    def _alone(self, text: bytes, part: Part, made: RecordText | Fault, line: int, found: Found) -> None:
        """Take what a record becomes, itself where nothing is in it, or why it becomes nothing."""
        row = text[part.start : part.end]
        done = made.rendered(line, column_in(text, part.start)) if isinstance(made, RecordText) else made
        if not isinstance(done, Fault):
            found.notes += done.notes
            found.mended += done.mended
            found.alone += 1
            row = done.text or row
        elif done.kind == Outside.kind:
            return
        else:
            found.faults.append((part.begin, done))
            if self.request.on_error != NULL or done.final:
                return
            found.nulls += 1
            row = null_of(row, json=self.fmt == "json")
        found.texts.append((part.begin, text[part.begin : part.start] + row + text[part.end : part.after]))

    def _outcome(self, text: bytes, cuts: Sequence[Cut], found: Found, *, closed: bool) -> Outcome:
        """Run every template's records, and put all of it in order."""
        rows = sum(len(cut.starts) for cut in cuts) + len(found.faults) + found.alone
        runs = self._runs(text, cuts, found) if cuts else []
        stops = self.request.on_error == STOP and found.faults
        end = min(place for place, _ in found.faults) if stops else len(text) + 1
        texts = sorted(each for each in found.texts if each[0] < end)
        if runs:
            from frametool.stream.rows import texts_as_rows, written

            groups = [group for run in runs for group in run.groups(end)]
            out = written([*groups, texts_as_rows(texts)] if texts else groups)
        else:
            out = b"".join(piece for _, piece in texts)
        mended = found.mended + sum(len(run.mended) for run in runs)
        kept = found.alone + found.nulls + sum(len(run.rows) for run in runs)
        faults = [fault for _, fault in sorted(found.faults)]
        is_open = None if self.splitter.layout != ARRAY else not closed
        lines, notes = text.count(b"\n"), sorted(found.notes, key=RowNote.place)
        return Outcome(out, faults, rows, lines, mended, notes, len(text), kept, is_open)

    def _runs(self, text: bytes, cuts: Sequence[Cut], found: Found) -> list[Run]:
        """Run the records of all templates; one that is bad is taken alone, which says where it is wrong."""
        from frametool.stream.evaluate import Run
        from frametool.stream.record_cuts import block_of, plan_of
        from frametool.text.spans import framed

        _, state = self._bulk
        data, runs = framed(text), []
        for cut in cuts:
            plan = plan_of(cut.template, self.request, yaml=self.fmt == "yaml")
            run = Run(plan, block_of(cut, data, text, plan.request), state)
            runs.append(run)
            for at, row in enumerate(run.reasons):
                fault = Fault.of(run.block.line_of(row), *run.reasons[row])
                part = cut.part(row)
                line = text.count(b"\n", 0, part.start) if at < MOST_EXACT else 0
                made = attempt(text, part, self.fmt, self.request, self.source, line) if at < MOST_EXACT else fault
                self._alone(text, part, made if isinstance(made, Fault) else fault, line, found)
            found.notes += run.notes
            own = [*cut.template.notes, *cut.template.of_places]
            found.notes += [each._replace(line=run.block.line_of(0)) for each in own if len(cut.starts)]
        return runs
