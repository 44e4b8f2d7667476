"""Records in bulk found in text: those written alike are cut by one expression, learned from the first of them."""

from __future__ import annotations

from itertools import accumulate, chain, count, starmap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.stream.evaluate import Plan
from frametool.stream.faults import NULL, SKIP, Fault
from frametool.stream.layout import In, Renamed
from frametool.stream.record import KEYS_REMEDY
from frametool.stream.rows import Block, read_extra
from frametool.stream.splice import column_in, quoted_name
from frametool.stream.splitter import DOCUMENTS, LINES, Part, Splitter
from frametool.stream.template import Template
from frametool.text.spans import MARGIN, Bytes, Ints, Spans, framed, without_quotes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import TypeAlias

    from frametool.stream.record_text import RecordText
    from frametool.stream.request import Request
    from frametool.stream.template import Names

    Places: TypeAlias = Sequence[tuple[int, int]]
    Hit: TypeAlias = tuple[Template, Places]

MOST_TEMPLATES = 256  # kept in mind
MOST_TRIED = 8  # of them tried on whole blocks
MOST_LOOKED = 1 << 16  # bytes in which the first record of what is left is looked for
WORTH_CUTTING = 1 << 12  # bytes


class Cut(NamedTuple):
    """Records of one template found in a block: where each stretch of each begins and ends.

    The last two columns are what follows a record and what is before it.
    """

    template: Template
    starts: Ints
    ends: Ints

    def part(self, row: int) -> Part:
        """Return where a record is."""
        ends = self.ends[row].tolist()
        return Part(int(self.starts[row, -1]), int(self.starts[row, 0]), int(self.starts[row, -2]), ends[-2])


class RecordCutter:
    """Finds the records of blocks that are written alike; keeps the templates it has met.

    read: reads a record, or says what is wrong with it
    """

    def __init__(self, splitter: Splitter, read: Callable[[bytes, Part], RecordText | Fault]) -> None:
        """Start without templates."""
        self.splitter, self.read = splitter, read
        self.templates: list[Template] = []

    def cut(self, text: bytes) -> tuple[list[Cut], list[tuple[int, int]]]:
        """Return the records of a block that templates find, and what is left between them."""
        cuts: list[Cut] = []
        rest = [(0, len(text))]
        if self.splitter.layout not in (LINES, DOCUMENTS) or not is_text(text):
            return cuts, rest
        for template in self.templates[-MOST_TRIED:][::-1]:
            rest = _cut_by(template, text, rest, cuts)
        for _ in range(MOST_TRIED):
            start, end = rest[0] if len(rest) == 1 else (0, 0)
            if end - start < WORTH_CUTTING or not self._learn_first(text[start : min(end, start + MOST_LOOKED)]):
                break
            rest = _cut_by(self.templates[-1], text, rest, cuts)
        cuts, strays = _without_strays(cuts, text)
        return cuts, sorted(rest + strays)

    def _learn_first(self, text: bytes) -> bool:
        """Return True if there is a template for the first record of a text, which is learned from it if need be."""
        part = next(iter(self.splitter.parts(text).parts), None)
        if part is None or part.problem:
            return False
        if self.match(text, part) is None:
            known = self.read(text, part)
            if isinstance(known, Fault) or known.is_long or not known.entries:
                return False
            self.learned(known, text, part)
        return True

    def match(self, text: bytes, part: Part) -> Hit | None:
        """Find the template that a record follows, and where its stretches are."""
        if part.problem or not is_text(text[part.start : part.end]):
            return None
        for template in reversed(self.templates):
            found = template.pattern.fullmatch(text, part.start, part.end)
            if found is not None and template.fits_in(text, found.regs[1:]):
                return template, found.regs[1:]
        return None

    def learned(self, known: RecordText, text: bytes, part: Part) -> Hit | None:
        """Learn from a record; a template is kept in mind unless it is long, not too many."""
        if not known.entries:
            return None
        template = Template(known)
        if known.is_long:
            return template, [(begin + part.start, end + part.start) for begin, end in template.places()]
        self.templates = [*self.templates[-MOST_TEMPLATES + 1 :], template]
        return self.match(text, part)


def by_template(cuts: Iterable[Cut], singles: Iterable[tuple[Part, Hit]]) -> list[Cut]:
    """Return all records of a block, those of each template as they follow each other in the text.

    singles: those that were found alone
    """
    alone: dict[Template, list[Places]] = {}
    for part, (template, places) in singles:
        alone.setdefault(template, []).append((*places, (part.end, part.after), (part.begin, part.start)))
    found: dict[Template, list[Cut]] = {}
    for cut in chain(cuts, starmap(_as_cut, alone.items())):
        found.setdefault(cut.template, []).append(cut)
    joined = []
    for template, each in found.items():
        starts, ends = (np.concatenate(parts) for parts in zip(*(cut[1:] for cut in each), strict=True))
        order = np.argsort(starts[:, 0], kind="stable") if len(each) > 1 else slice(None)
        joined.append(Cut(template, starts[order], ends[order]))
    return joined


def block_of(cut: Cut, data: Bytes, text: bytes, request: Request) -> Block:
    """Describe the records of one template as rows; request: that of their plan."""
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

    stamps, bad = list[Any](), dict[int, tuple[str, str]]()
    column = request.timed.column if request.timed else request.rows.extra_column or ""
    for each in template.stamps:
        found, late = read_extra([without_quotes(parts[index]) for index in each], request, column)
        stamps.append(found)
        bad = {**late, **bad}
    named = [names_of(cut, at, text) for at in range(len(template.entries))]
    frames = [[parent for parent, _ in each] for each in named]
    renamed = [piece for piece in template.pieces if isinstance(piece, Renamed)]
    parts += [_renamed(template, piece, named, len(starts)) for piece in renamed]
    numbers = _numbers(template, data, starts, ends)
    places = cut.starts[:, -1]
    return Block(numbers, parts, places, line_of, stamps=stamps, bad=bad, place_of=place_of, frames=frames)


def names_of(cut: Cut, at: int, text: bytes) -> list[Names]:
    """Return the frames that an entry of each record names, parent and name; one pair where all name the same."""
    record = cut.template.entries[at].record
    columns: list[list[str | None]] = []
    for index, known in zip(cut.template.frames[at], (record.parent.text, record.name.text), strict=True):
        columns.append([known] if index is None else _texts(text, cut.starts[:, index], cut.ends[:, index]))
    size = max(map(len, columns))
    parents, names = (each if len(each) == size else each * size for each in columns)
    return [*zip(parents, names, strict=True)]


def _texts(text: bytes, starts: Ints, ends: Ints) -> list[str | None]:
    """Return texts, one a record, or the one that all have."""
    size = ends[0] - starts[0]
    if (ends - starts == size).all():
        found = np.frombuffer(text, np.uint8)[starts[:, None] + np.arange(size)]
        if (found == found[0]).all():
            return [text[starts[0] : ends[0]].decode()]
    texts = [text[start:end] for start, end in zip(starts.tolist(), ends.tolist(), strict=True)]
    known = {each: each.decode() for each in {*texts}}
    return [known[each] for each in texts]


def _renamed(template: Template, piece: Renamed, frames: Sequence[Sequence[Names]], rows: int) -> Spans:
    """Return the names of frames as results have them."""
    at, role, node = template.renamed[piece.at]
    texts = {}
    for each in {*frames[at]}:
        named = template.named(at, each) or (None, None)
        texts[each] = quoted_name(node, named[role] or "", json=template.json).encode()
    stops = dict(zip(texts, accumulate(map(len, texts.values())), strict=True))
    ends = np.array([stops[each] for each in frames[at]], np.int64) + MARGIN
    starts = ends - np.array([len(texts[each]) for each in frames[at]], np.int64)
    return Spans(framed(b"".join(texts.values())), np.resize(starts, rows), np.resize(ends, rows))


def plan_of(template: Template, request: Request, *, yaml: bool) -> Plan:
    """Return what is done to the records of one template."""
    after, entries = len(template.stretches), template.entries
    renamed = count(after + 2)
    pieces = [In(next(renamed)) if isinstance(each, Renamed) else each for each in template.pieces]
    on_error = SKIP if request.on_error == NULL else request.on_error  # rows without one are written elsewhere
    stamp = next((entry.stamp for entry in entries if entry.stamp), ())
    key = str(stamp[0][-1]) if stamp else ""
    timed = request.timed
    if timed is not None and not timed.name and request.operation.formula is not None:
        timed = timed._replace(name=key if len(stamp) == 1 else "")  # what was found says by its own name what it is
    extra = None if request.rows.extra_column is None else key
    return Plan(
        tuple(entry.record.shape for entry in entries),
        tuple(entry.target for entry in entries),
        request._replace(on_error=on_error, timed=timed, offset_ns=0).with_rows(extra_column=extra),
        tuple(".".join(map(str, (path or ())[1:])) for entry in entries for path in entry.record.numbers),
        (In(after + 1), *pieces, In(after)),
        b"null",
        edge_of=request.pose_from_frame if any(entry.edge is not None for entry in entries) else None,
        yaml=yaml,
        remedies=tuple(
            KEYS_REMEDY if record.flat else f"write {record.rotation}_deg" for record, *_ in entries
        ),
    )


def is_text(block: bytes) -> bool:
    """Return True if bytes are UTF-8: an expression for bytes would let others pass."""
    if block.isascii():
        return True
    try:
        block.decode()
    except UnicodeDecodeError:
        return False
    return True


def _cut_by(template: Template, text: bytes, rest: list[tuple[int, int]], cuts: list[Cut]) -> list[tuple[int, int]]:
    """Cut what is left of a block by one expression, and add the records to `cuts`; return what is then left."""
    left = []
    width = len(template.stretches) + 2  # with what follows a record, and what parts it from the one before
    for start, end in rest:
        pieces = template.block_pattern.split(text[start:end])
        count = len(pieces) // width
        ends = np.cumsum(np.fromiter(map(len, pieces), np.int64, len(pieces))) + start
        starts = np.concatenate([[start], ends[:-1]])
        between = np.arange(0, len(pieces), width)
        left += [(int(starts[at]), int(ends[at])) for at in between[starts[between] < ends[between]]]
        if count:
            begins, stops = (each[: count * width].reshape(count, width)[:, 1:] for each in (starts, ends))
            first = begins[:, :1]  # nothing is before a record
            cuts.append(Cut(template, *(np.concatenate([each, first], axis=1) for each in (begins, stops))))
    return left


def _without_strays(cuts: Sequence[Cut], text: bytes) -> tuple[list[Cut], list[tuple[int, int]]]:
    """Leave out records whose frames are called so that their results are written otherwise; return where these are."""
    found: list[Cut] = []
    strays: list[tuple[int, int]] = []
    for cut in cuts:
        fits = np.ones(len(cut.starts), np.bool_)
        for at in range(len(cut.template.entries)):
            names = names_of(cut, at, text)
            wrong = {each for each in {*names} if cut.template.named(at, each) is None}
            if wrong:
                fits &= np.resize(np.array([each not in wrong for each in names]), len(fits))
        gone = ~fits
        strays += zip(cut.starts[gone, 0].tolist(), cut.ends[gone, -2].tolist(), strict=True)
        found.append(cut if fits.all() else Cut(cut.template, cut.starts[fits], cut.ends[fits]))
    return [cut for cut in found if len(cut.starts)], strays


def _as_cut(template: Template, spans: Sequence[Places]) -> Cut:
    found = np.fromiter(chain.from_iterable(chain.from_iterable(spans)), np.int64).reshape(len(spans), -1, 2)
    return Cut(template, np.ascontiguousarray(found[:, :, 0]), np.ascontiguousarray(found[:, :, 1]))


def in_order(cuts: Sequence[Cut]) -> list[Cut]:
    """Part cuts so that their records follow each other as in the text; a record that holds several is alone."""
    if not cuts:
        return []
    sorts = np.concatenate([np.full(len(cut.starts), index) for index, cut in enumerate(cuts)])
    rows = np.concatenate([np.arange(len(cut.starts)) for cut in cuts])
    order = np.argsort(np.concatenate([cut.starts[:, 0] for cut in cuts]), kind="stable")
    several, ordered = np.array([len(cut.template.entries) > 1 for cut in cuts]), sorts[order]
    changes = np.flatnonzero((np.diff(ordered) != 0) | several[ordered[1:]]) + 1
    parts = [(cuts[sorts[part[0]]], rows[part]) for part in np.split(order, changes)]
    return [Cut(cut.template, cut.starts[part], cut.ends[part]) for cut, part in parts]


def _numbers(template: Template, data: Bytes, starts: Ints, ends: Ints) -> Spans:
    """Return the spans of our numbers; those that a template does not write as plain numbers are its own."""
    rows = len(starts)
    if template.regular:
        columns = list(template.numbers)
        return Spans(data, np.ascontiguousarray(starts[:, columns]), np.ascontiguousarray(ends[:, columns]))
    texts = [repr(value).encode() for record, *_ in template.entries for value in record.values]
    own = framed(b" ".join(texts))
    lengths = np.array([len(text) for text in texts], np.int64)
    first = np.cumsum(lengths + 1) - lengths - 1 + MARGIN
    return Spans(own, np.tile(first, (rows, 1)), np.tile(first + lengths, (rows, 1)))
