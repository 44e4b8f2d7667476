"""What is learned from one record and holds for all that are written alike: what its numbers mean, what changes.

Records are alike if they differ only in our numbers and in scalars that cannot matter; then one regular expression
cuts them all into the same stretches, and nothing has to be parsed again.
"""

from __future__ import annotations

import re
from functools import cached_property
from itertools import accumulate, islice, pairwise
from typing import TYPE_CHECKING

from frametool.documents.document import Aliased, Document, Node, parse_documents, parse_nodes
from frametool.documents.json import JSON_NUMBER, strict_json
from frametool.documents.source import Source, check_text
from frametool.errors import FormatError
from frametool.grammar.names import NAME_KEYS, PARENT_KEYS, may_be_uncertain
from frametool.grammar.pose import DESCRIPTIVE, POSE_KEYS
from frametool.grammar.rotation_spelling import AXES_KEY, LISTED_WORDS, ROTATION_KEYS
from frametool.stream.answers import answer, read_entries
from frametool.stream.faults import RowNote
from frametool.stream.record import POINT_KEYS, STALE
from frametool.stream.row_layout import PARTS, POSE
from frametool.stream.splice import OURS, Splicer
from frametool.stream.text_parts import Const, IfLocked, In, Out, Word

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.errors import Finding
    from frametool.grammar.readers import Path
    from frametool.stream.answers import Answer, Entry
    from frametool.stream.record import Record
    from frametool.stream.request import Request
    from frametool.stream.row_layout import Shape
    from frametool.stream.splice import Edit
    from frametool.stream.stamp_source import Timed
    from frametool.stream.text_parts import Piece

# what a number looks like: JSON's is exact, YAML's is judged when it is read
YAML_NUMBER = r"[-+.]?[0-9][-+.0-9eE]*+"
JSON_TEXT = r'"[^"\\\x00-\x1f]*(?:\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4})[^"\\\x00-\x1f]*)*"'
# what may stand for a scalar that passes, by its quotes: never anything that could be read as more than one scalar
YAML_PLAIN = r"(?:-(?! )|[A-Za-z0-9_./+])(?:[\w./+-]| (?=[\w./+(-])|:(?=[\w/]))*"
FREE = {
    (True, True): JSON_TEXT,
    (True, False): rf"(?:{JSON_NUMBER}|true|false|null)",
    (False, True): r'"[^"\\\x00-\x1f]*"',
    (False, False): YAML_PLAIN,
}
SINGLE_QUOTED = r"'[^'\x00-\x1f]*'"
STAMP = r"(?:0|[1-9]\d{0,8}|[1-3]\d{9})(?![.\deE])", r"(?:0|[1-9]\d{0,8})(?![.\deE])"  # seconds, nanoseconds
NOT_UNKNOWN = r"(?!-1(?:\.0*)?(?:[eE][-+]?0+)?(?![.\deE]))"  # as a covariance begins of which nothing is known
# scalars under these keys decide what a record is, wherever in it they stand ..
OF_PLACES = ("no-alt", "band-s", "stays", "left-out")  # the rules of notes on places, which rows do not tell
DECISIVE = frozenset((*POINT_KEYS, *ROTATION_KEYS, AXES_KEY, *PARENT_KEYS, *NAME_KEYS))
# .. and these in the mappings that hold the record; a number alone under a word of others is none
_WORDS = frozenset(
    word.partition("_deg")[0].partition("_rad")[0] for word in {*OURS, *POSE_KEYS, "theta"} - LISTED_WORDS
)  # fmt: skip
TOLD = DESCRIPTIVE - {"frame"}  # whatever a number under these is, it tells of a result; null may be another record
NOT_PLAIN = frozenset((*STALE, "angles", "inverse"))
MOST_LEAVES = 2000
"""Scalars of a record that is learned for others: an expression for more takes longer than they are worth."""


class Template:
    """The text of records, and what holds for all that are written alike.

    stretches: where each part of the text stands
    numbers: the stretches that hold our numbers, in order; known: those that -1 would make another record
    stamps: the stretches of each entry's stamp
    pieces: what the result is made of
    notes: what is worth telling about all of them; own_notes: about the record that was learned alone
    of_places: those of them that hold for all
    header, rest: of a result that is written anew, the stretches of its header's stamp and of what else is said, by
    key; says_apart: where none of them is in another one
    """

    def __init__(
        self,
        text: str,
        entries: Sequence[Entry],
        root: Node,
        edits: Sequence[Edit],
        request: Request,
        notes: Sequence[Finding] = (),
        *,
        json: bool,
    ) -> None:
        """Cut the text where numbers, stamps and edits are."""
        self.text = text
        self.entries = tuple(entries)
        self.json = json
        self.notes = list(_notes(entries))
        self.own_notes = notes
        self.of_places = [RowNote(0, each.rule, each.message) for each in notes if each.rule in OF_PLACES]
        self._root = root
        self._request = request
        slots = [_inside(root, path) for entry in entries for path in entry.record.numbers]
        known = {_inside(root, path) for entry in entries for path in entry.record.known}
        held = [[root.at(path) for path in entry.stamp] for entry in entries]
        stamps = [[(node.start, node.end) for node in each] for each in held]
        number = re.compile(JSON_NUMBER if json else YAML_NUMBER)
        self.regular = all(slot is not None and number.fullmatch(text, *slot) for slot in slots)
        self.values = tuple(value for entry in entries for value in entry.record.values)
        cuts = {*(slot for slot in slots if slot is not None), *(span for spans in stamps for span in spans)}
        header, rest = _said_beside(root, entries) if request.canonical else ([], {})
        more = {(node.start, node.end) for node in (*header, *rest.values())}
        self.says_apart = all(end <= start for (_, end), (start, _) in pairwise(sorted(cuts | more)))
        cuts |= more if self.says_apart else set()
        self.stretches, self.pieces = cut(len(text), sorted(cuts), edits)
        at = {stretch: index for index, stretch in enumerate(self.stretches)}
        self.numbers = tuple(at[slot] for slot in slots if slot is not None)
        self.known = {at[slot] for slot in known if slot is not None}
        self.stamps = tuple(tuple(at[span] for span in spans) for spans in stamps)
        self.header = [at[node.start, node.end] for node in header if self.says_apart]
        self.rest = {key: (at[node.start, node.end], node) for key, node in rest.items() if self.says_apart}
        first = min((slot[0] for slot in slots if slot is not None), default=0)
        self.line = text.count("\n", 0, first)

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Return what the numbers mean."""
        return tuple(entry.record.shape for entry in self.entries)

    @cached_property
    def pattern(self) -> re.Pattern[bytes]:
        """Match a record that is alike."""
        return re.compile(self.expression)

    @cached_property
    def block_pattern(self) -> re.Pattern[bytes]:
        """Match such a record from where one may begin; its last group is what parts it from the next."""
        if self.json:
            return re.compile(rb"(?m:^)" + self.expression + rb"([ \t]*,?[ \t]*\r?\n)")
        return re.compile(rb"(?:\A|(?<=\n---\n)|(?<=\n---\r\n))" + self.expression + rb"(---[ \t]*\r?\n)")

    @property
    def names(self) -> tuple[str, ...]:
        """Name the numbers by the keys that lead to them."""
        return tuple(
            ".".join(map(str, path[1:])) if path else "" for entry in self.entries for path in entry.record.numbers
        )

    @property
    def beside(self) -> str:
        """Return the last key that leads to what is read beside the numbers."""
        return next((str(entry.stamp[0][-1]) for entry in self.entries if entry.stamp), "")

    def timed(self, request: Request) -> Timed | None:
        """Return where stamps stand; a key that nobody named but was found says by its own name what they are."""
        found = next((entry.stamp[0][-1] for entry in self.entries if len(entry.stamp) == 1), "")
        if request.timed is None or request.timed.name or request.operation.formula is None:
            return request.timed
        return request.timed._replace(name=str(found))

    @cached_property
    def is_long(self) -> bool:
        """Tell whether the record has so many scalars that no other one is looked for that is written alike."""
        leaves = _leaves(self._root, ())
        return next(islice(leaves, MOST_LEAVES, None), None) is not None

    def places(self) -> list[tuple[int, int]]:
        """Return where each stretch stands in the record that was learned, in bytes."""
        sizes = [len(segment.encode()) for segment in self.segments()]
        ends = list(accumulate(sizes))
        return list(zip([0, *ends[:-1]], ends, strict=True))

    def segments(self) -> list[str]:
        """Return the text of each stretch."""
        return [self.text[start:end] for start, end in self.stretches]

    def answers(self, request: Request) -> list[Answer]:
        """Return what becomes of the records of the text that was learned from."""
        texts, values = self.segments(), iter(self.values)
        found = []
        for entry, stamp in zip(self.entries, self.stamps, strict=True):
            own = list(islice(values, entry.record.shape.size))
            each = answer(entry, own, [texts[index] for index in stamp], request)
            found += [] if each is None else [each]
        return found

    def with_numbers(self, numbers: Sequence[str], *, locked: bool) -> str:
        """Return the text of the result."""
        return filled(self.pieces, self.segments(), numbers, locked=locked)

    @cached_property
    def expression(self) -> bytes:
        """Return the regular expression, one group a stretch, that all records match that are alike."""
        number = JSON_NUMBER if self.json else YAML_NUMBER
        ours = set(self.numbers)
        free = iter(self._free_leaves())
        leaf = next(free, None)
        groups = []
        for index, (start, end) in enumerate(self.stretches):
            if index in ours and self.regular:
                groups.append(f"({NOT_UNKNOWN * (index in self.known)}{number})")
                continue
            parts, at = [], start
            while leaf is not None and leaf[0].end <= end:
                node, pattern = leaf
                if node.start >= at and re.fullmatch(pattern, self.text[node.start : node.end], re.ASCII):
                    parts += [re.escape(self.text[at : node.start]), pattern]
                    at = node.end
                leaf = next(free, None)
            groups.append("".join(["(", *parts, re.escape(self.text[at:end]), ")"]))
        return "".join(groups).encode()

    def _free_leaves(self) -> Iterator[tuple[Node, str]]:
        """Yield the scalars that decide nothing, in order, each with the expression of what it may be."""
        around = {entry.record.path[:depth] for entry in self.entries for depth in range(len(entry.record.path) + 1)}
        around |= {(*path, "header") for path in around}
        poses = [entry.record.path for entry in self.entries if entry.record.shape.kind == POSE]
        around |= {(*path, "scale") for path in poses}
        words = _WORDS if poses else _WORDS - {"scale"}  # of points that is data
        fixed = {path for entry in self.entries for path in (*entry.record.numbers, *entry.record.unknown)}
        placed = {(*entry.record.path, key) for entry in self.entries for key in entry.record.placed}
        number = re.compile(JSON_NUMBER if self.json else YAML_NUMBER)
        stamps = {path: STAMP[at % 2] for entry in self.entries for at, path in enumerate(entry.record.stamps)}
        for path, leaf in _leaves(self._root, ()):
            depth = next((depth for depth in range(len(path), 0, -1) if type(path[depth - 1]) is str), 0)
            key = str(path[depth - 1]) if depth else ""
            if key == "frame" and self._request.counts(leaf.value):
                yield leaf, f"{leaf.quote}[0-9]++{leaf.quote}"
            elif path in stamps:
                yield leaf, f"{leaf.quote}{stamps[path]}{leaf.quote}"
            elif "sigma" in path or may_be_uncertain(key) or any(path[: len(each)] == each for each in placed):
                continue  # they say a covariance or a place, and are no numbers of ours
            elif key in LISTED_WORDS and depth == len(path):
                yield leaf, SINGLE_QUOTED if leaf.quote == "'" else FREE[self.json, leaf.quote == '"']
            elif key in TOLD and depth == len(path) and path not in fixed and number.fullmatch(leaf.value):
                yield leaf, f"{leaf.quote}{number.pattern}{leaf.quote}"
            elif path in fixed or key in DECISIVE or (path[: depth - 1] in around and _stem(key) in words):
                continue
            else:
                yield leaf, SINGLE_QUOTED if leaf.quote == "'" else FREE[self.json, leaf.quote == '"']


def _said_beside(root: Node, entries: Sequence[Entry]) -> tuple[list[Node], dict[str, Node]]:
    """Return the stamp in the header of a record that is alone in its text, and what else is said beside it."""
    record = entries[0].record
    if len(entries) > 1 or type(root.at(record.path[:1]).value) is not dict:
        return [], {}
    stamp = record.stamps[:2] if record.stamp_ns is not None else ()
    return [root.at(path) for path in stamp], rest_of(root.at(record.path[:1]), record.path[:1], record)


def used_keys(record: Record) -> set[str]:
    """Return the keys of a record that say its pose, or what is no longer true of the result."""
    halves = PARTS.get(record.shape.kind, ())
    own = record.key, record.rotation, *record.others, *record.flat, *record.members, *record.placed
    return {*own, *halves, *NOT_PLAIN}


def rest_of(node: Node, unit: Path, record: Record) -> dict[str, Node]:
    """Return what a record and the mappings around it say beside the pose, its frames and its stamp, by key.

    node: the thing that the record's result is; unit: the path of that
    """
    used = used_keys(record)
    names = {path for each in (record.name, record.parent) for path in each.paths}
    rest: dict[str, Node] = {}
    for depth in range(len(unit), len(record.path) + 1):
        path = record.path[:depth]
        holder = node.at(path[len(unit) :])
        if type(holder.value) is not dict:
            continue
        on_the_way = {*record.path[depth : depth + 1], "header", *record.covariances}
        for key, (_, value) in holder.value.items():
            if key not in on_the_way and (*path, key) not in names and not (path == record.path and key in used):
                rest.setdefault(key, value)
    return rest


def _notes(entries: Sequence[Entry]) -> Iterator[RowNote]:
    """Yield what is worth telling about the records of a text."""
    for entry in entries:
        if entry.lost:
            yield RowNote.of_lost_name(0, entry.lost)
        if not entry.record.values and entry.record.shape.kind:
            yield RowNote(0, "identity", "neither position nor rotation: taken as the identity")


def _stem(key: str) -> str:
    """Return a key without its unit: beside our numbers its scalar may be one of them or change what they mean."""
    return re.split(r"[^a-z0-9_]|_(?:deg|rad|mm)", key.casefold(), maxsplit=1)[0]


def _leaves(node: Node, path: Path) -> Iterator[tuple[Path, Node]]:
    """Yield the scalars that are values, in the order of the text, with their paths."""
    if type(node.value) is dict:
        for key, (_, value) in node.value.items():
            yield from _leaves(value, (*path, key))
    elif type(node.value) is list:
        for index, value in enumerate(node.value):
            yield from _leaves(value, (*path, index))
    else:
        yield path, node


def _inside(root: Node, path: Path | None) -> tuple[int, int] | None:
    """Return where a number stands, without its quotes; None for one that is not written."""
    if path is None:
        return None
    node = root.at(path)
    return node.start + bool(node.quote), node.end - bool(node.quote)


def cut(
    length: int, cuts: Sequence[tuple[int, int]], edits: Iterable[Edit]
) -> tuple[list[tuple[int, int]], list[Piece]]:
    """Cut a text into stretches, each number one of its own; return them with the pieces of the result."""
    stretches: list[tuple[int, int]] = []
    pieces: list[Piece] = []
    slots = list(reversed(cuts))

    def walk(start: int, end: int, *, shown: bool) -> None:
        """Add the stretches from start to end; they are pieces of the result if they are shown."""
        while start < end:
            slot = slots[-1] if slots and slots[-1][1] <= end else None
            stop = end if slot is None else slot[0] if slot[0] > start else slots.pop()[1]
            stretches.append((start, stop))
            if shown:
                pieces.append(In(len(stretches) - 1))
            start = stop

    at = 0
    for edit in sorted(edits, key=lambda each: (each.start, each.end)):
        start = max(edit.start, at)
        walk(at, start, shown=True)
        pieces += edit.pieces
        walk(start, max(edit.end, start), shown=False)
        at = max(edit.end, start)
    walk(at, length, shown=True)
    return stretches, [piece for piece in pieces if not isinstance(piece, Out) or piece.last > piece.first]


def filled(pieces: Sequence[Piece], texts: Sequence[str], numbers: Sequence[str], *, locked: bool = False) -> str:
    """Put pieces together with the stretches of one text and the numbers of its result."""
    shown = []
    for piece in pieces:
        if isinstance(piece, In):
            shown.append(texts[piece.part])
        elif isinstance(piece, Out):
            shown.append(numbers[piece.first])
        elif isinstance(piece, Word):
            shown.append(piece.text(float(numbers[piece.number])).decode())
        elif isinstance(piece, Const) or (locked and isinstance(piece, IfLocked)):
            shown.append(piece.text.decode())
    return "".join(shown)


def learn(text: str, request: Request, *, json: bool, source: str, line: int) -> Template | None:
    """Learn from the text of one record; None if there is nothing in it.

    line: of the record's first character, from 1.  Raises FormatError with the place.
    """
    here = Source(source, text)
    notes: list[Finding] = []
    try:
        documents = _json_documents(here) if json else parse_documents(text, source)
        entries = [entry for document in documents for entry in read_entries(document, request, here, notes.extend)]
    except FormatError as error:
        error.line += line - 1
        raise
    if not entries:
        return None
    root = Node(0, len(text), parse_nodes(text))
    try:
        edits = edits_of(text, entries, root, request, json=json)
        return Template(text, entries, root, edits, request, notes, json=json)
    except Aliased as error:
        error.in_text(text).line += line - 1
        raise


def nulled(text: str, *, json: bool) -> str | None:
    """Return the text of a record with null in the place of our numbers; None if it has none that can be found."""
    from frametool.stream.splice import null_edits

    try:
        _json_documents(Source("", text)) if json else parse_documents(text, "")
        edits = null_edits(Node(0, len(text), parse_nodes(text)))
    except FormatError:
        return None
    if not edits:
        return None
    segments, pieces = cut(len(text), (), edits)
    shown = (text[slice(*segments[each.part])] if isinstance(each, In) else "null" for each in pieces)
    return "".join(shown)


def _json_documents(source: Source) -> list[Document]:
    """Read strict JSON: what only YAML would take is a fault of the record."""
    check_text(source)
    values = strict_json(source)
    return [Document(value, index, source) for index, value in enumerate(values) if value is not None]


def edits_of(text: str, entries: Sequence[Entry], root: Node, request: Request, *, json: bool) -> list[Edit]:
    """Return what changes in a text; a name that several records share changes once."""
    edits: list[Edit] = []
    first = 0
    for entry in entries:
        shape = entry.record.shape
        edits += Splicer(text, root, entry, request, json=json, first=first).run()
        first += request.result_size(shape, entry.target)
    return list(dict.fromkeys(edits))
