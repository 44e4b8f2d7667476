"""Records in bulk: those written alike are cut by one expression, moved as arrays, and put together again."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.stream.blocks import Plan, Run, State
from frametool.stream.faults import NULL, SKIP, STOP, Fault
from frametool.stream.record_stream import attempt, end_of_record, null_of
from frametool.stream.rows import Block, written
from frametool.stream.run import Outcome
from frametool.stream.text_parts import In
from frametool.text.cells import without_quotes
from frametool.text.spans import MARGIN, Spans, framed

if TYPE_CHECKING:
    import re
    from collections.abc import Sequence

    from frametool.stream.record_stream import Splitter
    from frametool.stream.request import Request
    from frametool.stream.template import Learned
    from frametool.text.array_types import Ints

MOST_KINDS = 256  # kinds of records kept in mind
MOST_TRIED = 8  # of them tried on whole blocks
MOST_LOOKED = 1 << 16  # bytes in which the first record of what is left is looked for
WORTH_CUTTING = 1 << 12  # bytes


class Cut(NamedTuple):
    """Records of one kind found in a block: where each stretch of each begins and ends."""

    learned: Learned
    starts: Ints
    ends: Ints


class Work:
    """What is done to each block of records; remembers the kinds it has met."""

    def __init__(self, splitter: Splitter, form: str, request: Request, source: str) -> None:
        """Begin knowing nothing."""
        self.splitter = splitter
        self.form = form
        self.request = request
        self.source = source
        self.state = State()
        self.kinds: list[Learned] = []

    def __call__(self, text: bytes) -> Outcome:
        """Process one block."""
        cuts: list[Cut] = []
        rest = [(0, len(text))]
        if self.splitter.lines is not False or self.form == "yaml":
            rest = self._cut(text, rest, self.kinds[-MOST_TRIED:][::-1], cuts)
            rest = self._learn_and_cut(text, rest, cuts)
        odd: list[tuple[int, bytes]] = []
        faults: list[tuple[int, Fault]] = []
        singles: dict[Learned, list[tuple[tuple[int, int], ...]]] = {}
        for start, end in rest:
            self._rest(text, start, end, odd, faults, singles)
        cuts += [_as_cut(learned, spans) for learned, spans in singles.items()]
        cuts = _in_order(cuts) if self.request.in_order else cuts
        return self._outcome(text, framed(text), cuts, odd, faults)

    def _learn_and_cut(self, text: bytes, rest: list[tuple[int, int]], cuts: list[Cut]) -> list[tuple[int, int]]:
        """Learn the kinds of the first records that are left, a few, and cut by them too."""
        for _ in range(MOST_TRIED):
            spans = [
                (start, span)
                for start, end in rest[:1]
                for span in self.splitter.records(text[start : min(end, start + MOST_LOOKED)])[:1]
            ]
            if len(rest) > 1 or not spans or not rest or rest[0][1] - rest[0][0] < WORTH_CUTTING:
                return rest
            start, (begin, stop) = spans[0]
            known = len(self.kinds)
            line = text.count(b"\n", 0, start + begin)
            record = text[start + begin : start + stop]
            if self._match(record, 0, len(record)) is None:
                problem = attempt(record, self.form, self.request, self.source, line, self._remember)
                if isinstance(problem, Fault) or len(self.kinds) == known:
                    return rest
            rest = self._cut(text, rest, self.kinds[-1:], cuts)
        return rest

    def _cut(
        self,
        text: bytes,
        rest: list[tuple[int, int]],
        kinds: Sequence[Learned],
        cuts: list[Cut],
    ) -> list[tuple[int, int]]:
        """Cut what is left of a block by the kinds met before; give what is then left."""
        for learned in kinds:
            left = []
            for start, end in rest:
                cut, gaps = _cut_chunk(learned, text[start:end], start)
                if cut is not None:
                    cuts.append(cut)
                left += gaps
            rest = left
        return rest

    def _rest(
        self,
        text: bytes,
        start: int,
        end: int,
        odd: list[tuple[int, bytes]],
        faults: list[tuple[int, Fault]],
        singles: dict[Learned, list[tuple[tuple[int, int], ...]]],
    ) -> None:
        """Take records one by one, learning new kinds; what stands between them passes."""
        chunk = text[start:end]
        at = 0
        for begin, stop in self.splitter.records(chunk):
            after = end_of_record(chunk, stop, self.form)
            if begin > at:
                odd.append((start + at, chunk[at:begin]))
            at = after
            match = self._match(chunk, begin, stop)
            if match is None:
                line = text.count(b"\n", 0, start + begin)
                problem = attempt(chunk[begin:stop], self.form, self.request, self.source, line, self._remember)
                if isinstance(problem, Fault):
                    faults.append((start + begin, problem))
                    if self.request.on_error == NULL:
                        odd.append((start + begin, null_of(chunk[begin:stop]) + chunk[stop:after]))
                    continue
                match = self._match(chunk, begin, stop)
            if match is None:
                odd.append((start + begin, chunk[begin:after]))
                continue
            learned, found = match
            spans = [*found.regs[1:], (stop, after)]
            singles.setdefault(learned, []).append(tuple((a + start, b + start) for a, b in spans))
        if at < len(chunk):
            odd.append((start + at, chunk[at:]))

    def _match(self, chunk: bytes, begin: int, stop: int) -> tuple[Learned, re.Match[bytes]] | None:
        for learned in reversed(self.kinds):
            found = learned.pattern.fullmatch(chunk, begin, stop)
            if found is not None:
                return learned, found
        return None

    def _remember(self, learned: Learned) -> bytes:
        """Keep a kind in mind, not too many."""
        self.kinds = [*self.kinds[-MOST_KINDS + 1 :], learned]
        return b""

    def _outcome(
        self,
        text: bytes,
        data: np.ndarray,
        cuts: Sequence[Cut],
        odd: list[tuple[int, bytes]],
        faults: list[tuple[int, Fault]],
    ) -> Outcome:
        """Run every kind's records, and put all of it in order."""
        groups, found, rows, mended = [], list(faults), len(faults), 0
        doubted: list[tuple[int, str]] = []
        end = min((place for place, _ in faults), default=None) if self.request.on_error == STOP else None
        runs = []
        for cut in cuts:
            rows += len(cut.starts)
            for run in self._runs(cut, data, text):
                runs.append((run, cut))
                mended += len(run.mended)
                bad = [int(cut.starts[row, 0]) for row in run.reasons]
                if self.request.on_error == NULL:
                    odd += [(int(cut.starts[row, 0]), _null_row(cut, row, text)) for row in run.reasons]
                found += [
                    (int(cut.starts[row, 0]), Fault.of(run.block.line_of(row), *reason))
                    for row, reason in run.reasons.items()
                ]
                doubted += [(run.block.line_of(row), angle) for row, angle in run.doubted[:1]]
                if self.request.on_error == STOP and bad:
                    end = min(bad) if end is None else min(end, *bad)
        for run, _ in runs:
            groups += run.groups(end)
        odd = [(place, piece) for place, piece in odd if end is None or place < end]
        if odd:
            from frametool.stream.rows import texts_as_rows

            groups.append(texts_as_rows(odd))
        ordered = [fault for _, fault in sorted(found)]
        return Outcome(written(groups), ordered, rows, text.count(b"\n"), mended, doubted, len(text))

    def _runs(self, cut: Cut, data: np.ndarray, text: bytes) -> list[Run]:
        """Run the records of one kind."""
        learned = cut.learned
        starts, ends = cut.starts + MARGIN, cut.ends + MARGIN
        numbers = _numbers(learned, data, starts, ends)
        parts = [Spans(data, starts[:, index], ends[:, index]) for index in range(starts.shape[1])]

        def line_of(row: int) -> int:
            return text.count(b"\n", 0, int(cut.starts[row, 0])) + learned.line

        stamps = [without_quotes(parts[index]) for index in learned.stamps]
        block = Block(numbers, parts, cut.starts[:, 0], line_of, stamps=stamps)
        return [Run(self._plan(learned), block, self.state)]

    def _plan(self, learned: Learned) -> Plan:
        request = self.request
        pieces = (*learned.pieces, In(len(learned.stretches)))
        targets = tuple(entry.target for entry in learned.entries)
        edges = tuple(entry.edge for entry in learned.entries)
        plan = Plan(learned.shapes, targets, request.operation, pieces, learned.names, b"null", edges=edges)
        return plan._replace(
            normalize=request.normalize,
            precision=request.precision,
            on_error=SKIP if request.on_error == NULL else request.on_error,
            unwrap=request.unwrap,
            yaml=self.form == "yaml",
            timed=request.timed,
            sources=tuple(entry.holder.parent[0] for entry in learned.entries),
        )


def _cut_chunk(learned: Learned, chunk: bytes, offset: int) -> tuple[Cut | None, list[tuple[int, int]]]:
    """Cut a chunk of lines by one expression; give the records, and the gaps between them."""
    stretches = len(learned.stretches) + 1
    pieces = learned.block_pattern.split(chunk)
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
    return Cut(learned, starts[rows].reshape(shape)[:, 1:], ends[rows].reshape(shape)[:, 1:]), gaps


def _as_cut(learned: Learned, spans: Sequence[tuple[tuple[int, int], ...]]) -> Cut:
    found = np.fromiter(chain.from_iterable(chain.from_iterable(spans)), np.int64).reshape(len(spans), -1, 2)
    return Cut(learned, np.ascontiguousarray(found[:, :, 0]), np.ascontiguousarray(found[:, :, 1]))


def _in_order(cuts: Sequence[Cut]) -> list[Cut]:
    """Part cuts of several kinds so that their records follow each other as in the text."""
    if not cuts:
        return []
    kinds = np.concatenate([np.full(len(cut.starts), index) for index, cut in enumerate(cuts)])
    rows = np.concatenate([np.arange(len(cut.starts)) for cut in cuts])
    order = np.argsort(np.concatenate([cut.starts[:, 0] for cut in cuts]), kind="stable")
    changes = np.flatnonzero(np.diff(kinds[order])) + 1
    parts = [(cuts[kinds[part[0]]], rows[part]) for part in np.split(order, changes)]
    return [Cut(cut.learned, cut.starts[part], cut.ends[part]) for cut, part in parts]


def _null_row(cut: Cut, row: int, text: bytes) -> bytes:
    """Return what stands for a record without a result, with what parts it from the next."""
    begin, end, after = int(cut.starts[row, 0]), int(cut.starts[row, -1]), int(cut.ends[row, -1])
    return null_of(text[begin:end]) + text[end:after]


def _numbers(learned: Learned, data: np.ndarray, starts: Ints, ends: Ints) -> Spans:
    """Return the spans of our numbers; those that a kind does not write as plain numbers are its own."""
    rows = len(starts)
    if learned.regular:
        columns = list(learned.numbers)
        return Spans(data, np.ascontiguousarray(starts[:, columns]), np.ascontiguousarray(ends[:, columns]))
    texts = [repr(value).encode() for value in learned.values]
    own = framed(b" ".join(texts))
    lengths = np.array([len(text) for text in texts], np.int64)
    first = np.cumsum(lengths + 1) - lengths - 1 + MARGIN
    return Spans(own, np.tile(first, (rows, 1)), np.tile(first + lengths, (rows, 1)))
