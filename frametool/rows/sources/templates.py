"""Find records with the same layout in a text: a template is learned from one record and matches the others.

Records have the same layout if they differ only in the numbers of their poses and in scalars that do not influence how
the record is read.  One regular expression then splits all of them into the same stretches, without parsing.
"""

from __future__ import annotations

import re
from functools import cached_property
from itertools import accumulate, chain, count, pairwise
from operator import attrgetter, itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from frametool import sizes
from frametool.documents.document import JSON_NUMBER, Node
from frametool.errors import FrametoolError
from frametool.grammar.pose import DESCRIPTIVE, LISTED_WORDS, POSE_KEYS, ROTATION_KEYS
from frametool.grammar.readers import AXES_KEY, NAME_KEYS, PARENT_COLUMNS, Path, may_be_uncertain
from frametool.rows.batch import Block, Coded, chosen, numbered, one_text, spans_of, stamps_in
from frametool.rows.evaluate import Plan
from frametool.rows.faults import SKIP, Fault
from frametool.rows.holders import POINT_KEYS
from frametool.rows.plain import MOST_ENTRIES
from frametool.rows.record import KEYS_REMEDY
from frametool.rows.shapes import POSE
from frametool.rows.sinks import Const, In, Renamed
from frametool.rows.sinks.in_place import OURS, column_in, quoted_name, stretches_of
from frametool.text.spans import MARGIN, Bytes, Ints, Spans, without_quotes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.rows.plain import Entry, RecordText
    from frametool.rows.request import Request
    from frametool.rows.sources.records import Part, Splitter

    Names: TypeAlias = tuple[str | None, str | None]  # parent and name
    Renaming: TypeAlias = tuple[Names, Names]  # of a record, and of its result
    Places: TypeAlias = Sequence[tuple[int, int]]
    Hit: TypeAlias = tuple["Template", Places]
    Called: TypeAlias = tuple[list[Any], Ints]

MOST_TEMPLATES = 256  # remembered
MOST_TRIED = 8  # of them tried on whole blocks
MOST_LOOKED = 1 << 16  # bytes in which the first remaining record is searched for
WORTH_CUTTING = 1 << 12  # bytes
MOST_NAMES = 1 << 16  # of frames, remembered
# the syntax of a number: exact for JSON; for YAML each match is checked when it is read
YAML_NUMBER = r"[-+.]?[0-9][-+.0-9eE]*+"
JSON_TEXT = r'"[^"\\\x00-\x1f]*(?:\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4})[^"\\\x00-\x1f]*)*"'
# texts that may replace an unused scalar, by its quotes; each is certainly a single scalar
YAML_PLAIN = r"(?:-(?! )|[A-Za-z0-9_./+])(?:[\w./+-]| (?=[\w./+(-])|:(?=[\w/]))*"
FREE = {
    (True, '"'): JSON_TEXT,
    (True, ""): rf"(?:{JSON_NUMBER}|true|false|null)",
    (False, '"'): r'"[^"\\\x00-\x1f]*"',
    (False, "'"): r"'[^'\x00-\x1f]*'",
    (False, ""): YAML_PLAIN,
}
FRAME = {
    (True, '"'): r'[^"\\\x00-\x1f]+',
    (False, '"'): r'[^"\\\x00-\x1f]+',
    (False, "'"): r"[^'\x00-\x1f]+",
    (False, ""): rf"(?!(?:null|Null|NULL)\b){YAML_PLAIN}",
}
STAMP = r"(?:0|[1-9]\d{0,8}|[1-3]\d{9})(?![.\deE])", r"(?:0|[1-9]\d{0,8})(?![.\deE])"  # seconds, nanoseconds
NOT_UNKNOWN = r"(?!-1(?:\.0*)?(?:[eE][-+]?0+)?(?![.\deE]))"  # an unknown covariance begins with -1
# scalars under these keys influence how a record is read, at any depth ..
DECISIVE = frozenset((*POINT_KEYS, *ROTATION_KEYS, AXES_KEY, *PARENT_COLUMNS, *NAME_KEYS))
# .. and these in the mappings around the record, unless their value is a single number
_WORDS = frozenset(
    word.partition("_deg")[0].partition("_rad")[0] for word in {*OURS, *POSE_KEYS, "theta"} - LISTED_WORDS
)  # fmt: skip
COVARIANCE = "covariance"  # the entries of an unchanged covariance have no influence
RESULT_KEYS = DESCRIPTIVE - {"frame"}  # a number under these belongs to a result; null may be another record
OF_ALL = ("unnamed", "identity", "no-alt", "band-s", "stays", "left-out")  # rules of warnings for all records


class Template:
    """The layout of records, learned from one of them.

    stretches: start and end of each part of the text
    numbers: the stretches of the numbers of the poses, in order; () if one of them is not a plain number
    stamps: the stretches of each entry's stamp
    named: the stretches of frames whose names may differ; frames: for each entry the indices among these of its parent
        and its name, None for a name that is the same in all records
    pieces: the pieces of the result; roles: for each name among them its entry, parent (0) or name (1), and its node
    notes: the warnings that hold for all records
    leaves: with a style, the scalars that differ: the stretch and the node of each
    """

    def __init__(self, known: RecordText) -> None:
        """Split the text at numbers, stamps, names and edits."""
        self.text, self.json, self.line = known.text, known.json, known.line
        self.root, self.entries, self._request = known.root, tuple(known.entries), known.request
        every = known.notes_at(0, known.source.first_column)
        self.notes = [each for each in every if each.about in OF_ALL]
        number = re.compile(JSON_NUMBER if self.json else YAML_NUMBER)
        paths = [(record, path) for record, *_ in self.entries for path in record.numbers]
        own = [self.root.at(path) for _, path in paths if path is not None]
        self.regular = len(own) == len(paths) and all(
            number.fullmatch(self.text, *_text_of(node)) for node in own
        )  # fmt: skip
        own = own if self.regular else []
        self._patterns = {  # of the texts that may differ
            _text_of(node): NOT_UNKNOWN * (path in record.begins) + number.pattern
            for node, (record, path) in zip(own, paths, strict=False)
        }
        stamps = [[self.root.at(path) for path in entry.stamp] for entry in self.entries]
        frames = [self._frames_of(entry) for entry in self.entries]
        named = {_text_of(node): node for node in chain(*frames) if node is not None}
        self._patterns |= {span: FRAME[self.json, node.quote] for span, node in named.items()}
        anew, leaves = known.request.results.rewrite_records, dict[tuple[int, int], Node]()
        span_of = _text_of if anew else attrgetter("start", "end")  # with a style, scalars are taken without quotes
        cuts = {*self._patterns, *map(span_of, chain(*stamps))}
        if anew and self.regular:
            leaves = {_text_of(node): node for node in own} | named
        for leaf, pattern in () if known.is_long or (anew and not self.regular) else self._free_leaves():
            size, span = len(leaf.quote) if anew else 0, span_of(leaf)
            if span[0] < span[1]:
                leaves[span] = leaf
                self._patterns.setdefault(span, pattern[size : len(pattern) - size])
        self.stretches, pieces = stretches_of(len(self.text), sorted(cuts.union(leaves if anew else ())), known.edits)
        at = dict(zip(self.stretches, count(), strict=False))
        self.numbers = tuple(at[_text_of(node)] for node in own)
        self.stamps = tuple(tuple(at[span_of(node)] for node in each) for each in stamps)
        self.named = [at[span] for span in named]
        order = {node.start: place for place, node in enumerate(named.values())}
        self.frames = [[None if node is None else order[node.start] for node in each] for each in frames]
        self.leaves = sorted(((at[span], node) for span, node in leaves.items()), key=itemgetter(0)) if anew else []
        roles = {
            node.start: (entry, role, node)
            for entry, each in reversed([*enumerate(frames)]) for role, node in enumerate(each) if node is not None
        }  # fmt: skip
        self.roles = [roles[each.at] for each in pieces if isinstance(each, Renamed) and each.at in roles]
        places = count(len(self.stretches) + 2)  # keys after those of the stretches and the separators
        self.pieces = [
            each if not isinstance(each, Renamed) else In(next(places)) if each.at in roles else Const(each.text)
            for each in pieces
        ]
        self._results: dict[tuple[bytes, ...], list[Renaming] | None] = {}
        self._own = self._renamed(tuple(self.text[slice(*span)].encode() for span in named))

    @cached_property
    def block_pattern(self) -> re.Pattern[bytes]:
        """Match a record with this layout where one may begin; the last group is the separator after it."""
        begin, end = rb"(?:\A|(?<=\n---\n)|(?<=\n--- )|(?<=\n---\r\n))", rb"(---(?:[ \t]*\r?\n| (?=\S)))"
        if self.json:
            begin, end = rb"(?m:^)", rb"([ \t]*,?[ \t]*\r?\n)"
        return re.compile(begin + self.pattern.pattern + end)

    @cached_property
    def pattern(self) -> re.Pattern[bytes]:
        """Match a record with this layout."""
        return re.compile(self._groups[0])

    @property
    def sizes(self) -> list[int]:
        """Return the bytes of each stretch; -1 for one of varying size, which is a group of the pattern."""
        return self._groups[1]

    @cached_property
    def _groups(self) -> tuple[bytes, list[int]]:
        groups, sizes, left = [], [], sorted(self._patterns, reverse=True)
        for start, end in self.stretches:
            parts, at = [], start
            while left and left[-1][1] <= end:
                own = left.pop()
                if own[0] >= at:
                    parts += [re.escape(self.text[at : own[0]]), self._patterns[own]]
                    at = own[1]
            text = "".join([*parts, re.escape(self.text[at:end])])
            groups.append(f"({text})" if parts else text)
            sizes.append(-1 if parts else len(self.text[start:end].encode()))
        return "".join(groups).encode(), sizes

    def places(self, found: re.Match[bytes]) -> Places:
        """Return start and end of each stretch of a record that matches."""
        groups, ends = iter(found.regs[1:]), [found.start()]
        for size in self.sizes:
            ends.append(next(groups)[1] if size < 0 else ends[-1] + size)
        return [*pairwise(ends)]

    def renamed(self, names: tuple[bytes, ...]) -> list[Renaming] | None:
        """Return the frames of each entry and of its result for some names of the frames that may differ.

        None if the rest of the result would differ with these names.
        """
        if names not in self._results:
            if len(self._results) > MOST_NAMES:
                self._results.clear()
            found, own = self._renamed(names), self._own
            self._results[names] = found[0] if found and own and found[1] == own[1] else None
        return self._results[names]

    def _renamed(self, names: tuple[bytes, ...]) -> tuple[list[Renaming], list[Any]] | None:
        """Return the frames of entries and results, and all else that depends on the names; None for invalid names."""
        found, others, request, timed = list[Any](), list[Any](), self._request, self._request.timed
        for (record, _, edge, *_), own in zip(self.entries, self.frames, strict=True):
            pairs = zip((record.parent.text, record.name.text), own, strict=True)
            parent, name = (old if at is None else names[at].decode() for old, at in pairs)
            if any(path[-1] == "frame" and request.counts(parent or "") for path in record.parent.paths):
                return None
            try:
                rename = request.for_kind(record.shape.kind).rename
                new = (parent, name) if rename is None else rename(parent, name)
                if edge is not None and request.pose_from_frame is not None:
                    request.pose_from_frame(parent)
                others.append(timed is not None and not timed.name and timed.moves(parent))
            except FrametoolError:
                return None
            found.append(((parent, name), new))
            others += [
                text if at is None else (text == old, not text)
                for text, old, at in zip(new, (parent, name), own, strict=True)
            ]
        return found, others

    def _frames_of(self, entry: Entry) -> list[Node | None]:
        """Return the nodes of a record's parent and name, None for a name that must be the same in all records.

        A name may differ if it is plain text in a single place, and no counter of rows.
        """
        record, request, found = entry.record, self._request, list[Node | None]()
        is_placed = record.keys.placed or record.shape.place or request.results.place or request.rows.given_place
        for name in (record.parent, record.name):
            is_one = request.rows.poses and not is_placed and name.text and len(name.paths) == 1
            node = self.root.at(name.paths[0]) if is_one and name.paths[0] not in entry.stamp else None
            is_plain = node and len(node.value) == node.end - node.start - 2 * bool(node.quote)
            pattern = FRAME.get((self.json, node.quote)) if node and is_plain else None
            found.append(node if node and pattern and re.fullmatch(pattern, node.value, re.ASCII) else None)
        return found

    def _free_leaves(self) -> Iterator[tuple[Node, str]]:
        """Yield the scalars that do not influence how a record is read, in order, each with its pattern."""
        around: set[Path] = set()
        fixed: set[Path | None] = set()
        for record, *_ in self.entries:
            for depth in range(len(record.path) + 1):
                around |= {record.path[:depth], (*record.path[:depth], "header")}
            around |= {(*record.path, "scale")} if record.shape.kind == POSE else set()
            fixed.update(record.numbers, record.begins)
        has_poses = any(record.shape.kind == POSE for record, *_ in self.entries)
        words = _WORDS if has_poses else _WORDS - {"scale"}  # of points that is data
        placed = {(*record.path, key) for record, *_ in self.entries for key in record.keys.placed}
        number = JSON_NUMBER if self.json else YAML_NUMBER
        operation = self._request.operation
        passes = operation.keeps_frames and operation.formula is None
        stamps = {path: STAMP[at % 2] for record, *_ in self.entries for at, path in enumerate(record.stamps)}
        for path, leaf in _leaves(self.root, ()):
            depth = next((depth for depth in range(len(path), 0, -1) if type(path[depth - 1]) is str), 0)
            key, is_own = str(path[depth - 1]) if depth else "", depth == len(path)
            # next to the numbers of a pose a scalar may be one of them, or change their meaning, whatever its unit
            stem = re.split(r"[^a-z0-9_]|_(?:deg|rad|mm)", key.casefold(), maxsplit=1)[0]
            is_free = key in RESULT_KEYS if is_own else key == COVARIANCE and passes
            pattern = FREE.get((self.json, leaf.quote), FREE[self.json, ""])
            if key == "frame" and self._request.counts(leaf.value):
                pattern = f"{leaf.quote}[0-9]++{leaf.quote}"
            elif path in stamps:
                pattern = f"{leaf.quote}{stamps[path]}{leaf.quote}"
            elif "sigma" in path or may_be_uncertain(key) or any(path[: len(each)] == each for each in placed):
                continue  # part of a covariance or a geodetic position that is read by itself
            elif is_free and path not in fixed and re.fullmatch(number, leaf.value):
                pattern = f"{leaf.quote}{number}{leaf.quote}"
            elif is_own and key in LISTED_WORDS:
                pass
            elif path in fixed or key in DECISIVE or (path[: depth - 1] in around and stem in words):
                continue
            if re.fullmatch(pattern, self.text[leaf.start : leaf.end], re.ASCII):
                yield leaf, pattern


def _leaves(node: Node, path: Path) -> Iterator[tuple[Path, Node]]:
    """Yield the scalar values below a node with their paths, in the order of the text."""
    if type(node.value) is dict:
        for key, (_, value) in node.value.items():
            yield from _leaves(value, (*path, key))
    elif type(node.value) is list:
        for index, value in enumerate(node.value):
            yield from _leaves(value, (*path, index))
    else:
        yield path, node


def _text_of(node: Node) -> tuple[int, int]:
    """Return start and end of a scalar without its quotes."""
    return node.start + bool(node.quote), node.end - bool(node.quote)


class Cut(NamedTuple):
    """The records of one template in a block: starts and ends (n, stretches + 2) of their stretches.

    The last two columns are the separators after and before a record.
    """

    template: Template
    starts: Ints
    ends: Ints

    def place(self, row: int) -> tuple[int, int, int, int]:
        """Return begin, start, end, after of a record, as in `Part`."""
        starts = self.starts[row].tolist()
        return starts[-1], starts[0], starts[-2], int(self.ends[row, -2])

    def frames(self, text: bytes) -> Called:
        """Return the distinct frames of the records and of their results, and the index of each record's.

        None for frames whose result needs another template.
        """
        columns, data = list[list[bytes]](), np.frombuffer(text, np.uint8)
        for named in self.template.named:
            starts, ends = self.starts[:, named], self.ends[:, named]
            only = one_text(Spans(data, starts, ends))
            spans = zip(starts.tolist(), ends.tolist(), strict=True) if only is None else ()
            columns.append([text[start:end] for start, end in spans] if only is None else [only])
        size = max(map(len, columns), default=1)
        rows = zip(*(each if len(each) == size else each * size for each in columns), strict=True) if columns else [()]
        known, codes = numbered([*rows])
        return [*map(self.template.renamed, known)], np.broadcast_to(codes, len(self.starts))


class RecordCutter:
    """Find the records of blocks by templates, and learn these.

    read: reads a record; returns a Fault for one that is invalid
    """

    def __init__(self, splitter: Splitter, read: Callable[[bytes, Part], RecordText | Fault]) -> None:
        """Start without templates."""
        self.splitter, self.read = splitter, read
        self.templates: list[Template] = []
        self.left = sizes.LEARNED  # records left to learn from: if all differ, learning is wasted

    def cut(self, text: bytes) -> tuple[list[Cut], list[tuple[int, int]]]:
        """Return the records of a block that match templates, and the rest of the block."""
        cuts, rest = list[Cut](), [(0, len(text))]
        if not is_text(text):
            return cuts, rest
        for template in self.templates[-MOST_TRIED:][::-1]:
            rest = _cut_by(template, text, rest, cuts)
        for _ in range(MOST_TRIED):  # learn one from the first remaining record
            start, end = rest[0] if len(rest) == 1 else (0, 0)
            head = text[start : min(end, start + MOST_LOOKED)]
            part = next(iter(self.splitter.parts(head)[0]), None) if end - start >= WORTH_CUTTING else None
            if part is None or part.problem:
                break
            if self.match(head, part) is None:
                known = self.read(head, part)
                if isinstance(known, Fault) or known.is_long or self.learned(known, head, part) is None:
                    break
            rest = _cut_by(self.templates[-1], text, rest, cuts)
        found = []
        for cut in by_template(cuts, ()):  # less the records whose frames need another template
            frames, codes = cut.frames(text)
            fits = np.array([each is not None for each in frames])[codes]
            rest += zip(cut.starts[~fits, 0].tolist(), cut.ends[~fits, -2].tolist(), strict=True)
            found.append(cut if fits.all() else Cut(cut.template, cut.starts[fits], cut.ends[fits]))
        return [cut for cut in found if len(cut.starts)], sorted(rest)

    def match(self, text: bytes, part: Part) -> Hit | None:
        """Return the template that matches a record, and where its stretches are."""
        if part.problem or not is_text(text[part.start : part.end]):
            return None
        for template in reversed(self.templates):
            found = template.pattern.fullmatch(text, part.start, part.end)
            if found is not None:
                places = template.places(found)
                if template.renamed(tuple(text[slice(*places[at])] for at in template.named)) is not None:
                    return template, places
        return None

    def learned(self, known: RecordText, text: bytes, part: Part) -> Hit | None:
        """Learn a template from a record: from every record if their order matters, else from few and short ones.

        The template is remembered unless the record is long.
        """
        rewritten, in_order = known.request.results.rewrite_records, known.request.in_order
        is_split = known.request.window and len({entry.stamp for entry in known.entries}) > 1  # some may be beyond it
        has_many = rewritten and len(known.entries) > MOST_ENTRIES
        is_alike = self.left and not (known.is_long or is_split or has_many)
        if not known.entries or not (is_alike or in_order):
            return None
        self.left -= bool(is_alike)
        template = Template(known)
        if not known.is_long:  # else the expression is too long
            self.templates = [*self.templates[-MOST_TEMPLATES + 1 :], template]
            if hit := self.match(text, part):
                return hit
        # long, or with lines of tools in it, for which the template has blanks of the same size
        lengths = [len(template.text[start:end].encode()) for start, end in template.stretches]
        return template, list(pairwise(accumulate(lengths, initial=part.start)))


def _cut_by(template: Template, text: bytes, rest: list[tuple[int, int]], cuts: list[Cut]) -> list[tuple[int, int]]:
    """Split the rest of a block by one expression and add the records to `cuts`; return what is left."""
    left = list[tuple[int, int]]()
    sizes = np.array([-1, *template.sizes, -1])  # with the text before and the separator after a record
    varying = np.flatnonzero(sizes < 0)
    for start, end in rest:
        pieces = template.block_pattern.split(text[start:end])
        lengths = np.tile(sizes, (len(pieces) // len(varying), 1))
        found = np.fromiter(map(len, pieces[:-1]), np.int64, len(pieces) - 1)
        lengths[:, varying] = found.reshape(-1, len(varying))
        ends = np.cumsum(lengths).reshape(lengths.shape) + start
        starts, behind = ends - lengths, int(ends[-1, -1]) if len(ends) else start
        between = lengths[:, 0] > 0
        left += zip(starts[between, 0].tolist(), ends[between, 0].tolist(), strict=True)
        left += [(behind, end)] * (behind < end)
        if len(lengths):
            first = starts[:, 1:2]  # nothing is before a record
            cuts.append(Cut(template, *(np.concatenate([each[:, 1:], first], axis=1) for each in (starts, ends))))
    return left


def by_template(cuts: Iterable[Cut], singles: Iterable[tuple[Part, Hit]]) -> list[Cut]:
    """Return all records of a block by template, in the order of the text; singles: those found one by one."""
    found: dict[Template, list[Cut]] = {}
    for cut in cuts:
        found.setdefault(cut.template, []).append(cut)
    alone: dict[Template, list[Places]] = {}
    for part, (template, places) in singles:
        alone.setdefault(template, []).append((*places, (part.end, part.after), (part.begin, part.start)))
    for template, spans in alone.items():
        every = np.fromiter(chain.from_iterable(chain.from_iterable(spans)), np.int64).reshape(len(spans), -1, 2)
        one = Cut(template, *(np.ascontiguousarray(every[:, :, side]) for side in (0, 1)))
        found.setdefault(template, []).append(one)
    joined = []
    for template, each in found.items():
        starts, ends = (np.concatenate(parts) for parts in zip(*(cut[1:] for cut in each), strict=True))
        order = np.argsort(starts[:, 0], kind="stable") if len(each) > 1 else slice(None)
        joined.append(Cut(template, starts[order], ends[order]))
    return joined


def in_order(cuts: Sequence[Cut]) -> list[Cut]:
    """Split cuts so that all records are in the order of the text; a record with several entries gets its own cut."""
    if not cuts:
        return []
    sorts = np.concatenate([np.full(len(cut.starts), index) for index, cut in enumerate(cuts)])
    rows = np.concatenate([np.arange(len(cut.starts)) for cut in cuts])
    order = np.argsort(np.concatenate([cut.starts[:, 0] for cut in cuts]), kind="stable")
    several, ordered = np.array([len(cut.template.entries) > 1 for cut in cuts]), sorts[order]
    changes = np.flatnonzero((np.diff(ordered) != 0) | several[ordered[1:]]) + 1
    parts = [(cuts[sorts[part[0]]], rows[part]) for part in np.split(order, changes)]
    return [Cut(cut.template, cut.starts[part], cut.ends[part]) for cut, part in parts]


def block_of(cut: Cut, called: Called, data: Bytes, text: bytes, request: Request) -> Block:
    """Return the records of one template as rows; called: their frames, request: that of their plan."""
    template, rows = cut.template, len(cut.starts)
    starts, ends = cut.starts + MARGIN, cut.ends + MARGIN
    parts = {index: Spans(data, starts[:, index], ends[:, index]) for index in range(starts.shape[1])}

    def line_of(row: int) -> int:
        return text.count(b"\n", 0, int(cut.starts[row, 0])) + template.line

    def place_of(row: int, number: int) -> tuple[int, str]:
        if not template.regular:
            return line_of(row), ""
        start = int(starts[row, template.numbers[number]]) - MARGIN
        return text.count(b"\n", 0, start), str(column_in(text, start))

    stamps, bad = list[Any](), dict[int, tuple[str, str]]()
    column = request.timed.column if request.timed else request.rows.stamp_or_weight_column or ""
    for each in template.stamps:
        found, late = stamps_in([without_quotes(parts[index]) for index in each], column)
        stamps.append(found)
        bad = {**late, **bad}
    named, codes = called
    frames = []
    for at in range(len(template.entries)):
        known, own = numbered([each[at][0][0] for each in named])
        frames.append(Coded([*known], None if len(named) == 1 else own[codes]))
    for at, role, node in template.roles:  # the names of results
        texts = [quoted_name(node, each[at][1][role] or "", json=template.json).encode() for each in named]
        parts[len(parts)] = chosen(spans_of(texts), codes)
    # numbers that are no plain text are the same in all records
    numbers: Any = np.tile([value for record, *_ in template.entries for value in record.values], (rows, 1))
    if template.regular:
        columns = list(template.numbers)
        numbers = Spans(data, np.ascontiguousarray(starts[:, columns]), np.ascontiguousarray(ends[:, columns]))
    places = cut.starts[:, -1]
    return Block(numbers, parts, places, line_of, stamps=stamps, bad=bad, place_of=place_of, frames=frames)


def plan_of(template: Template, request: Request, *, yaml: bool) -> Plan:
    """Return the plan for the records of one template."""
    after, entries = len(template.stretches), template.entries
    stamp = next((entry.stamp for entry in entries if entry.stamp), ())
    key = str(stamp[0][-1]) if stamp else ""
    timed = request.timed
    if timed is not None and not timed.name and request.operation.formula is not None:
        timed = timed._replace(name=key if len(stamp) == 1 else "")  # the key that was found has the unit in its name
    extra = None if request.rows.stamp_or_weight_column is None else key
    return Plan(  # bad records are computed one by one
        tuple(entry.record.shape for entry in entries),
        tuple(entry.target for entry in entries),
        request._replace(on_error=SKIP, timed=timed, offset_ns=0).with_rows(stamp_or_weight_column=extra),
        tuple(".".join(map(str, (path or ())[1:])) for entry in entries for path in entry.record.numbers),
        (In(after + 1), *template.pieces, In(after)),
        b"null",
        edge_of=request.pose_from_frame if any(entry.edge is not None for entry in entries) else None,
        yaml=yaml,
        degree_hints=tuple(
            KEYS_REMEDY if record.keys.flat else f"write {record.keys.rotation}_deg" for record, *_ in entries
        ),
    )


def is_text(block: bytes) -> bool:
    """Return True if bytes are UTF-8, which a regular expression for bytes does not check."""
    try:
        block.decode()
    except UnicodeDecodeError:
        return False
    return True
