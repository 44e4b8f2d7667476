"""Records in bulk: those written alike are moved as arrays, and put together again.

The same definition as for one record (`template.learn`), evaluated for many at once.
"""

from __future__ import annotations

from itertools import repeat
from typing import TYPE_CHECKING

from frametool.stream.answers import Outside
from frametool.stream.evaluate import Run, State
from frametool.stream.faults import NULL, STOP, Fault, Outcome, RowNote
from frametool.stream.record_cuts import RecordCutter, block_of, in_order, plan_of
from frametool.stream.record_text import Rendered, attempt, column_in, null_of, rendered
from frametool.stream.rows import texts_as_rows, written
from frametool.stream.splitter import ARRAY, Part
from frametool.stream.template import Template
from frametool.text.spans import framed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.stream.record_cuts import Cut, FoundRecords, Places
    from frametool.stream.request import Request
    from frametool.stream.splitter import Splitter

MOST_EXACT = 100  # bad records of one template in a block whose place is looked for


class Found:
    """What one block holds beside the records that templates find: what passes or is wrong, by place."""

    def __init__(self) -> None:
        """Create an empty one."""
        self.odd: list[tuple[int, bytes]] = []
        self.faults: list[tuple[int, Fault]] = []
        self.notes: list[RowNote] = []
        self.alone = self.mended = 0  # records that were rendered one by one, and rotations in them

    def add(self, rendered: Rendered) -> None:
        """Count a record that was rendered alone."""
        self.notes += rendered.notes
        self.alone += 1
        self.mended += rendered.mended


class RecordBlocks:
    """Process one block of records after the other."""

    def __init__(self, splitter: Splitter, form: str, request: Request, source: str) -> None:
        """Start without templates."""
        self.form = form
        self.request = request
        self.cutter = RecordCutter(splitter, form, request, source)
        self.state = State()

    def __call__(self, text: bytes) -> Outcome:
        """Process one block."""
        found = Found()
        records, rest = self.cutter.cut(text)
        for start, end in rest:
            self._take_singly(text, start, end, records, found)
        cuts = records.by_template()
        return self._outcome(text, in_order(cuts) if self.request.in_order else cuts, found)

    def _take_singly(self, text: bytes, start: int, end: int, records: FoundRecords, found: Found) -> None:
        """Take records one by one, learning new templates; what stands between them passes."""
        at, line, counted = start, 0, 0
        for part, hit in self.cutter.singly(text, start, end):
            if part.begin > at:
                found.odd.append((at, text[at : part.begin]))
            at = part.after
            line, counted = line + text.count(b"\n", counted, part.start), part.start
            template, places = hit or self._learned(text, part, line, found)
            if template is not None:
                records.add(part, template, places)
        if at < end:
            found.odd.append((at, text[at:end]))

    def _learned(self, text: bytes, part: Part, line: int, found: Found) -> tuple[Template | None, Places]:
        """Return a template that is learned from a record; else take what it becomes, or why it becomes nothing."""
        learned = self.cutter.learn(text, part, line)
        made: Template | bytes | Fault | Rendered = learned
        if isinstance(made, Template) and made.is_long and not self.request.in_order:
            made = rendered(made, self.request, line, column_in(text, part.start))
        if isinstance(made, Template) and (hit := self.cutter.own_places(made, text, part)) is not None:
            return hit
        row = text[part.start : part.end]
        if isinstance(made, Rendered):
            found.add(made)
            row = made.text
        elif isinstance(made, Fault):
            found.faults += [(part.begin, made)] if made.kind != Outside.kind else []
            if made.kind == Outside.kind or self.request.on_error != NULL or made.final:
                return None, ()
            row = null_of(row, json=self.form == "json")
        found.odd.append((part.begin, text[part.begin : part.start] + row + text[part.end : part.after]))
        return None, ()

    def _outcome(self, text: bytes, cuts: Sequence[Cut], found: Found) -> Outcome:
        """Run every template's records, and put all of it in order."""
        stops, skips = self.request.on_error == STOP, self.request.on_error != NULL
        faults, odd, notes = list(found.faults), found.odd, found.notes
        data, runs = framed(text), []
        for cut in cuts:
            plan = plan_of(cut.template, self.request, yaml=self.form == "yaml")
            run = Run(plan, block_of(cut, data, text), self.state)
            runs.append(run)
            bad = [(int(run.block.places[row]), row) for row in run.reasons]
            told = [Fault.of(run.block.line_of(row), *run.reasons[row]) for _, row in bad]
            told[:MOST_EXACT] = map(self._exactly, repeat(text), repeat(cut), bad[:MOST_EXACT], told)
            faults += zip((place for place, _ in bad), told, strict=True)
            odd += [] if skips else [(place, _null_row(cut, row, text)) for place, row in bad]
            notes += [run.note_of_degrees(*each) for each in run.doubted[:1]]
            notes += run.rounded
            own = [*cut.template.notes, *cut.template.of_places]
            notes += [each._replace(line=run.block.line_of(0)) for each in own if len(cut.starts)]
        end = min((place for place, _ in faults), default=None) if stops else None
        groups = [group for run in runs for group in run.groups(end)]
        kept = sum(len(run.rows) for run in runs) + found.alone + (0 if skips else len(faults))
        odd = [(place, piece) for place, piece in odd if end is None or place < end]
        if odd:
            groups.append(texts_as_rows(odd))
        rows = sum(len(cut.starts) for cut in cuts) + len(found.faults) + found.alone
        return Outcome(
            written(groups),
            [fault for _, fault in sorted(faults)],
            rows,
            text.count(b"\n"),
            sum(len(run.mended) for run in runs) + found.mended,
            sorted(notes),
            len(text),
            kept,
            None if self.cutter.splitter.layout != ARRAY else not self.cutter.closed,
        )

    def _exactly(self, text: bytes, cut: Cut, bad: tuple[int, int], fault: Fault) -> Fault:
        """Return what is wrong with a record as it is said of one alone, with its place; else the fault."""
        part = _part(cut, bad[1])
        said = attempt(text, part, self.form, self.request, self.cutter.source, text.count(b"\n", 0, part.start))
        return said if isinstance(said, Fault) else fault


def _part(cut: Cut, row: int) -> Part:
    """Return where a record stands."""
    begin, start = int(cut.starts[row, -1]), int(cut.starts[row, 0])
    return Part(begin, start, int(cut.starts[row, -2]), int(cut.ends[row, -2]))


def _null_row(cut: Cut, row: int, text: bytes) -> bytes:
    """Return what stands for a record without a result, with what goes with it."""
    begin, start, end, after, *_ = _part(cut, row)
    return text[begin:start] + null_of(text[start:end], json=cut.template.json) + text[end:after]
