"""Records in bulk: those written alike are cut by one expression, moved as arrays, and put together again.

The same definition as for one record (`template.learn`), evaluated for many at once.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.stream.answers import Outside
from frametool.stream.evaluate import Plan, Run, State
from frametool.stream.faults import NULL, SKIP, STOP, Fault, RowNote
from frametool.stream.record import KEYS_REMEDY
from frametool.stream.record_text import Rendered, attempt, column_in, null_of, rendered
from frametool.stream.rows import Block, texts_as_rows, written
from frametool.stream.run import Outcome
from frametool.stream.splitter import ARRAY, DOCUMENTS, LINES
from frametool.stream.template import Template
from frametool.stream.text_parts import In
from frametool.text.cells import without_quotes
from frametool.text.spans import MARGIN, Spans, framed

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from frametool.stream.request import Request
    from frametool.stream.splitter import Part, Splitter
    from frametool.text.spans import Bytes, Ints

    Places: TypeAlias = Sequence[tuple[int, int]]

MOST_TEMPLATES = 256  # kept in mind
MOST_TRIED = 8  # of them tried on whole blocks
MOST_LOOKED = 1 << 16  # bytes in which the first record of what is left is looked for
WORTH_CUTTING = 1 << 12  # bytes


class Cut(NamedTuple):
    """Records of one template found in a block: where each stretch of each begins and ends.

    The last two columns are what follows a record and what stands before it.
    """

    template: Template
    starts: Ints
    ends: Ints


class Found:
    """What one block holds: records by template, and what passes or is wrong, by place."""

    def __init__(self) -> None:
        """Create an empty one."""
        self.cuts: list[Cut] = []
        self.singles: dict[Template, list[tuple[tuple[int, int], ...]]] = {}
        self.odd: list[tuple[int, bytes]] = []
        self.faults: list[tuple[int, Fault]] = []
        self.closed = False
        self.notes: list[RowNote] = []
        self.alone = self.mended = 0  # records that were rendered one by one, and rotations in them

    def add(self, rendered: Rendered, line: int) -> None:
        """Count a record that was rendered alone; lines are counted from `line`."""
        self.notes += [note._replace(line=note.line + line) for note in rendered.notes]
        self.alone += 1
        self.mended += rendered.mended


class RecordBlocks:
    """Process one block of records after the other; keeps the templates it has met."""

    def __init__(self, splitter: Splitter, form: str, request: Request, source: str) -> None:
        """Start without templates."""
        self.splitter = splitter
        self.form = form
        self.request = request
        self.source = source
        self.state = State()
        self.templates: list[Template] = []
        self.long: tuple[bytes, Template] | None = None  # the last record that was too long to be looked for again

    def __call__(self, text: bytes) -> Outcome:
        """Process one block."""
        found = Found()
        rest = [(0, len(text))]
        if self.splitter.layout in (LINES, DOCUMENTS) and _is_text(text):
            rest = self._cut(text, rest, self.templates[-MOST_TRIED:][::-1], found)
            rest = self._learn_and_cut(text, rest, found)
        for start, end in rest:
            self._take_singly(text, start, end, found)
        cuts = _by_template(found.cuts + [_as_cut(template, spans) for template, spans in found.singles.items()])
        found.cuts = _in_order(cuts) if self.request.in_order else cuts
        return self._outcome(text, framed(text), found)

    def _learn_and_cut(self, text: bytes, rest: list[tuple[int, int]], found: Found) -> list[tuple[int, int]]:
        """Learn templates from the first records that are left, a few, and cut by them too."""
        for _ in range(MOST_TRIED):
            if len(rest) != 1 or rest[0][1] - rest[0][0] < WORTH_CUTTING:
                return rest
            start, end = rest[0]
            looked = text[start : min(end, start + MOST_LOOKED)]
            parts = self.splitter.parts(looked).parts[:1]
            if not parts or parts[0].problem:
                return rest
            record = looked[parts[0].start : parts[0].end]
            known = len(self.templates)
            if self._match(record, 0, len(record)) is None:
                self._learn(looked, parts[0])
                if len(self.templates) == known:
                    return rest
            rest = self._cut(text, rest, self.templates[-1:], found)
        return rest

    def _cut(
        self, text: bytes, rest: list[tuple[int, int]], templates: Sequence[Template], found: Found
    ) -> list[tuple[int, int]]:
        """Cut what is left of a block by templates; return what is then left."""
        for template in templates:
            left = []
            for start, end in rest:
                cut, gaps = _cut_chunk(template, text[start:end], start)
                if cut is not None:
                    found.cuts.append(cut)
                left += gaps
            rest = left
        return rest

    def _take_singly(self, text: bytes, start: int, end: int, found: Found) -> None:
        """Take records one by one, learning new templates; what stands between them passes."""
        chunk = text[start:end]
        matches: dict[int, tuple[Template, Places]] = {}

        def match(at: int) -> int | None:
            """Match the template used last, which most records follow."""
            hit = self.templates[-1].pattern.match(chunk, at) if self.templates and clean else None
            if hit is None:
                return None
            matches[at] = self.templates[-1], hit.regs[1:]
            return hit.end()

        clean = _is_text(chunk)
        parts, found.closed = self.splitter.parts(chunk, match)
        line = text.count(b"\n", 0, start)
        at = counted = below = 0
        for part in parts:
            if part.begin > at:
                found.odd.append((start + at, chunk[at : part.begin]))
            at = part.after
            below, counted = below + chunk.count(b"\n", counted, part.start), part.start  # lines of the chunk
            hit = None if part.problem else matches.get(part.start) or self._match(chunk, part.start, part.end)
            if hit is None:
                learned: Template | bytes | Fault | Rendered = (
                    Fault(below, "", part.problem) if part.problem else self._learn(chunk, part)
                )
                if isinstance(learned, Template) and learned.is_long and not self.request.in_order:
                    learned = rendered(
                        learned, self.request, below, column_in(chunk, part.start)
                    )
                if isinstance(learned, Rendered):
                    row = chunk[part.begin : part.start] + learned.text + chunk[part.end : part.after]
                    found.odd.append((start + part.begin, row))
                    found.add(learned, line)
                    continue
                if isinstance(learned, Fault) and learned.kind == Outside.kind:
                    continue
                if isinstance(learned, Fault):
                    found.faults.append((start + part.begin, learned._replace(line=learned.line + line)))
                    if self.request.on_error == NULL and not part.outside:
                        nulled = null_of(chunk[part.start : part.end], json=self.form == "json")
                        row = chunk[part.begin : part.start] + nulled + chunk[part.end : part.after]
                        found.odd.append((start + part.begin, row))
                    continue
                hit = None if isinstance(learned, bytes) else self._own_places(learned, chunk, part)
            if hit is None:
                found.odd.append((start + part.begin, chunk[part.begin : part.after]))
                continue
            template, places = hit
            spans = [*places, (part.end, part.after), (part.begin, part.start)]
            found.singles.setdefault(template, []).append(tuple((a + start, b + start) for a, b in spans))
        if at < len(chunk):
            found.odd.append((start + at, chunk[at:]))

    def _own_places(self, learned: Template, chunk: bytes, part: Part) -> tuple[Template, Places] | None:
        """Return where the stretches of the record stand from which a template was learned."""
        if not learned.is_long:
            return self._match(chunk, part.start, part.end)
        return learned, [(begin + part.start, end + part.start) for begin, end in learned.places()]

    def _match(self, chunk: bytes, begin: int, stop: int) -> tuple[Template, Places] | None:
        """Find the template that a record follows."""
        if not _is_text(chunk[begin:stop]):
            return None
        for template in reversed(self.templates):
            found = template.pattern.fullmatch(chunk, begin, stop)
            if found is not None:
                return template, found.regs[1:]
        return None

    def _learn(self, chunk: bytes, part: Part) -> Fault | bytes | Template:
        """Return the template of a record, or why it has none; keep it in mind unless it is long, not too many."""
        record = chunk[part.start : part.end]
        if self.long is not None and self.long[0] == record:
            return self.long[1]
        learned = attempt(chunk, part, self.form, self.request, self.source)
        if isinstance(learned, (Fault, bytes)):
            return learned
        if learned.is_long:
            self.long = record, learned
        else:
            self.templates = [*self.templates[-MOST_TEMPLATES + 1 :], learned]
        return learned

    def _outcome(self, text: bytes, data: Bytes, found: Found) -> Outcome:
        """Run every template's records, and put all of it in order."""
        stops, skips = self.request.on_error == STOP, self.request.on_error != NULL
        faults, odd, notes = list(found.faults), found.odd, found.notes
        runs = []
        for cut in found.cuts:
            run = Run(self._plan(cut.template), self._block(cut, data, text), self.state)
            runs.append(run)
            bad = [(int(run.block.places[row]), row) for row in run.reasons]
            faults += [(place, Fault.of(run.block.line_of(row), *run.reasons[row])) for place, row in bad]
            odd += [] if skips else [(place, _null_row(cut, row, text)) for place, row in bad]
            notes += [run.note_of_degrees(*each) for each in run.doubted[:1]]
            notes += run.rounded
            told = [*cut.template.notes, *cut.template.of_places]
            notes += [each._replace(line=run.block.line_of(0)) for each in told if len(cut.starts)]
        end = min((place for place, _ in faults), default=None) if stops else None
        groups = [group for run in runs for group in run.groups(end)]
        kept = sum(len(run.rows) for run in runs) + found.alone + (0 if skips else len(faults))
        odd = [(place, piece) for place, piece in odd if end is None or place < end]
        if odd:
            groups.append(texts_as_rows(odd))
        rows = sum(len(cut.starts) for cut in found.cuts) + len(found.faults) + found.alone
        return Outcome(
            written(groups),
            [fault for _, fault in sorted(faults)],
            rows,
            text.count(b"\n"),
            sum(len(run.mended) for run in runs) + found.mended,
            sorted(notes),
            len(text),
            kept,
            None if self.splitter.layout != ARRAY else not found.closed,
        )

    def _block(self, cut: Cut, data: Bytes, text: bytes) -> Block:
        """Describe the records of one template as rows."""
        template = cut.template
        starts, ends = cut.starts + MARGIN, cut.ends + MARGIN
        parts = [Spans(data, starts[:, index], ends[:, index]) for index in range(starts.shape[1])]

        def line_of(row: int) -> int:
            return text.count(b"\n", 0, int(cut.starts[row, 0])) + template.line

        def place_of(row: int, number: int) -> tuple[int, str]:
            if not template.regular:
                return line_of(row), ""
            start = int(starts[row, template.numbers[number]]) - MARGIN
            return text.count(b"\n", 0, start), str(column_in(text, start))

        stamps = [tuple(without_quotes(parts[index]) for index in each) for each in template.stamps]
        numbers = _numbers(template, data, starts, ends)
        return Block(numbers, parts, cut.starts[:, -1], line_of, stamps=stamps, place_of=place_of)

    def _plan(self, template: Template) -> Plan:
        """Say what is done to the records of one template."""
        request = self.request
        after = len(template.stretches)
        plan = Plan(
            template.shapes,
            tuple(entry.target for entry in template.entries),
            request.operation,
            (In(after + 1), *template.pieces, In(after)),
            template.names,
            b"null",
            edges=tuple(entry.edge for entry in template.entries),
        )
        return plan._replace(
            normalize=request.normalize,
            precision=request.precision,
            on_error=SKIP if request.on_error == NULL else request.on_error,
            unwrap=request.unwrap,
            yaml=self.form == "yaml",
            timed=template.timed(request),
            beside=template.beside if request.extra_column is not None else "",
            gathered=request.gathered,
            window=request.window,
            remedies=tuple(
                KEYS_REMEDY if record.flat else f"write {record.rotation}_deg" for record, *_ in template.entries
            ),
            sources=tuple(entry.record.parent.text for entry in template.entries),
        )


def _is_text(block: bytes) -> bool:
    """Tell whether bytes are UTF-8: an expression for bytes would let others pass."""
    if block.isascii():
        return True
    try:
        block.decode()
    except UnicodeDecodeError:
        return False
    return True


def _cut_chunk(template: Template, chunk: bytes, offset: int) -> tuple[Cut | None, list[tuple[int, int]]]:
    """Cut a chunk of lines by one expression; give the records, and the gaps between them."""
    stretches = len(template.stretches) + 1
    pieces = template.block_pattern.split(chunk)
    count = len(pieces) // (stretches + 1)
    if not count:
        return None, [(offset, offset + len(chunk))]
    ends = np.cumsum(np.fromiter(map(len, pieces), np.int64, len(pieces))) + offset
    starts = np.empty_like(ends)
    starts[0], starts[1:] = offset, ends[:-1]
    between = np.arange(0, len(pieces), stretches + 1)
    gaps = [(int(starts[at]), int(ends[at])) for at in between[starts[between] < ends[between]]]
    rows = slice(0, count * (stretches + 1))
    shape = (count, stretches + 1)
    begins, stops = starts[rows].reshape(shape)[:, 1:], ends[rows].reshape(shape)[:, 1:]
    first = begins[:, :1]  # nothing stands before a record
    return Cut(template, np.concatenate([begins, first], axis=1), np.concatenate([stops, first], axis=1)), gaps


def _as_cut(template: Template, spans: Sequence[tuple[tuple[int, int], ...]]) -> Cut:
    found = np.fromiter(chain.from_iterable(chain.from_iterable(spans)), np.int64).reshape(len(spans), -1, 2)
    return Cut(template, np.ascontiguousarray(found[:, :, 0]), np.ascontiguousarray(found[:, :, 1]))


def _by_template(cuts: Sequence[Cut]) -> list[Cut]:
    """Join the cuts of each template, whose records then follow each other as in the text."""
    found: dict[Template, list[Cut]] = {}
    for cut in cuts:
        found.setdefault(cut.template, []).append(cut)
    joined = []
    for template, each in found.items():
        starts, ends = (np.concatenate(parts) for parts in ([cut.starts for cut in each], [cut.ends for cut in each]))
        order = np.argsort(starts[:, 0], kind="stable") if len(each) > 1 else slice(None)
        joined.append(Cut(template, starts[order], ends[order]))
    return joined


def _in_order(cuts: Sequence[Cut]) -> list[Cut]:
    """Part cuts of several sorts so that their records follow each other as in the text."""
    if not cuts:
        return []
    sorts = np.concatenate([np.full(len(cut.starts), index) for index, cut in enumerate(cuts)])
    rows = np.concatenate([np.arange(len(cut.starts)) for cut in cuts])
    order = np.argsort(np.concatenate([cut.starts[:, 0] for cut in cuts]), kind="stable")
    changes = np.flatnonzero(np.diff(sorts[order])) + 1
    parts = [(cuts[sorts[part[0]]], rows[part]) for part in np.split(order, changes)]
    return [Cut(cut.template, cut.starts[part], cut.ends[part]) for cut, part in parts]


def _null_row(cut: Cut, row: int, text: bytes) -> bytes:
    """Return what stands for a record without a result, with what goes with it."""
    begin, start = int(cut.starts[row, -1]), int(cut.starts[row, 0])
    end, after = int(cut.starts[row, -2]), int(cut.ends[row, -2])
    return text[begin:start] + null_of(text[start:end], json=cut.template.json) + text[end:after]


def _numbers(template: Template, data: Bytes, starts: Ints, ends: Ints) -> Spans:
    """Return the spans of our numbers; those that a template does not write as plain numbers are its own."""
    rows = len(starts)
    if template.regular:
        columns = list(template.numbers)
        return Spans(data, np.ascontiguousarray(starts[:, columns]), np.ascontiguousarray(ends[:, columns]))
    texts = [repr(value).encode() for value in template.values]
    own = framed(b" ".join(texts))
    lengths = np.array([len(text) for text in texts], np.int64)
    first = np.cumsum(lengths + 1) - lengths - 1 + MARGIN
    return Spans(own, np.tile(first, (rows, 1)), np.tile(first + lengths, (rows, 1)))
