"""What is learned from one record and holds for all that are written alike: what its numbers mean, what changes.

Records are alike if they differ only in our numbers and in scalars that cannot matter; then one regular expression
cuts them all into the same stretches, and nothing has to be parsed again.
"""

from __future__ import annotations

import re
from functools import cached_property
from itertools import accumulate, chain, count
from operator import itemgetter
from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.documents.json import JSON_NUMBER
from frametool.errors import FrametoolError
from frametool.grammar.pose import DESCRIPTIVE, LISTED_WORDS, POSE_KEYS, ROTATION_KEYS
from frametool.grammar.readers import AXES_KEY, NAME_KEYS, PARENT_KEYS, Path, may_be_uncertain
from frametool.stream.layout import Const, Renamed
from frametool.stream.record import POINT_KEYS, Record
from frametool.stream.row_layout import POSE
from frametool.stream.splice import OURS, cut

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from frametool.documents.document import Node
    from frametool.stream.record_text import RecordText
    from frametool.stream.request import Request

    Names: TypeAlias = tuple[str | None, str | None]
    Span: TypeAlias = tuple[int, int]

# what a number looks like: JSON's is exact, YAML's is judged when it is read
YAML_NUMBER = r"[-+.]?[0-9][-+.0-9eE]*+"
JSON_TEXT = r'"[^"\\\x00-\x1f]*(?:\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4})[^"\\\x00-\x1f]*)*"'
# what may stand for a scalar that passes, by its quotes: never anything that could be read as more than one scalar
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
NOT_UNKNOWN = r"(?!-1(?:\.0*)?(?:[eE][-+]?0+)?(?![.\deE]))"  # as a covariance begins of which nothing is known
# scalars under these keys decide what a record is, wherever in it they are ..
OF_PLACES = ("no-alt", "band-s", "stays", "left-out")  # the rules of notes on places, which rows do not tell
DECISIVE = frozenset((*POINT_KEYS, *ROTATION_KEYS, AXES_KEY, *PARENT_KEYS, *NAME_KEYS))
# .. and these in the mappings that hold the record, unless a number alone is under them
_WORDS = frozenset(
    word.partition("_deg")[0].partition("_rad")[0] for word in {*OURS, *POSE_KEYS, "theta"} - LISTED_WORDS
)  # fmt: skip
COVARIANCE = "covariance"  # an entry of one that passes as it is decides nothing
RESULT_KEYS = DESCRIPTIVE - {"frame"}  # a number under these belongs to a result; null may be another record
MOST_NAMES = 1 << 16  # of frames, kept in mind


class Template:
    """The text of records, and what holds for all that are written alike.

    stretches: where each part of the text is
    numbers: the stretches that hold our numbers, in order; regular: whether all of them are written plainly
    stamps: the stretches of each entry's stamp
    frames: the stretches of the names of each entry's frames, parent and name; None where they are the same in all
    pieces: what the result is made of; renamed: whose name it is that stood somewhere: of which entry, whether its
        parent or its name, and the scalar that it was
    notes: what is worth telling about all of them
    of_places: those of them that hold for all
    leaves: of what is written anew, the scalars that differ: the stretch of each, and where it was learned
    """

    def __init__(self, known: RecordText) -> None:
        """Cut the text where numbers, stamps, names and edits are."""
        self.text = text = known.text
        self.entries = tuple(known.entries)
        self.json, self.line = known.json, known.line
        self.notes = list(known.row_notes())
        self.of_places = [each for each in known.notes_at(0, known.source.first_column) if each.about in OF_PLACES]
        self._root, self._request = known.root, known.request
        self._named: dict[tuple[int, Names], Names | None] = {}
        number = re.compile(JSON_NUMBER if self.json else YAML_NUMBER)
        self._patterns: dict[Span, str] = {}  # of what may be there
        numbers: list[Span] = []
        paths = [(record, path) for record, *_ in self.entries for path in record.numbers]
        for record, path in paths:
            if path is not None:
                numbers.append(_text_of(known.root.at(path)))
                self._patterns[numbers[-1]] = NOT_UNKNOWN * (path in record.begins) + number.pattern
        self.regular = len(numbers) == len(paths) and all(number.fullmatch(text, *span) for span in numbers)
        self._patterns = self._patterns if self.regular else {}
        stamps = [[known.root.at(path) for path in entry.stamp] for entry in self.entries]
        cuts = {*numbers, *((node.start, node.end) for node in chain(*stamps))}
        frames = [_frames_of(known.root, entry.record, known.request, json=self.json) for entry in self.entries]
        self._patterns |= {_text_of(node): FRAME[self.json, node.quote] for node in chain(*frames) if node is not None}
        leaves: dict[Span, Node] = {}
        if known.request.results.canonical and self.regular:
            own = [known.root.at(path) for _, path in paths if path is not None]
            leaves = {_text_of(node): node for node in (*own, *chain(*frames)) if node is not None}
            leaves |= self._cut_leaves(cuts | self._patterns.keys())
        self.stretches, pieces = cut(len(text), sorted(cuts | self._patterns.keys()), known.edits)
        at = dict(zip(self.stretches, count(), strict=False))
        self.numbers = tuple(at[span] for span in numbers)
        self.stamps = tuple(tuple(at[node.start, node.end] for node in each) for each in stamps)
        self.frames = [[None if node is None else at[_text_of(node)] for node in nodes] for nodes in frames]
        self.leaves = sorted(((at[span], node) for span, node in leaves.items()), key=itemgetter(0))
        self.renamed: dict[int, tuple[int, int, Node]] = {}
        for entry, nodes in enumerate(frames):
            for role, node in enumerate(nodes):
                if node is not None:
                    self.renamed.setdefault(node.start, (entry, role, node))
        self.pieces = [
            Const(each.text) if isinstance(each, Renamed) and each.at not in self.renamed else each for each in pieces
        ]

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

    def places(self) -> list[tuple[int, int]]:
        """Return where each stretch is in the record that was learned, in bytes."""
        sizes = [len(self.text[start:end].encode()) for start, end in self.stretches]
        ends = list(accumulate(sizes))
        return list(zip([0, *ends[:-1]], ends, strict=True))

    def named(self, at: int, names: Names) -> Names | None:
        """Return the frames of the result of an entry that names these; None where the text around them is another."""
        if (at, names) not in self._named:
            if len(self._named) > MOST_NAMES:
                self._named.clear()
            record = self.entries[at].record
            found, own = self._renamed(at, names), self._renamed(at, (record.parent.text, record.name.text))
            self._named[at, names] = found[0] if found and own and found[1:] == own[1:] else None
        return self._named[at, names]

    def _renamed(self, at: int, names: Names) -> tuple[Names, Any, Any, bool] | None:
        """Return the frames of such a result, and all else that they decide about its text."""
        entry, request, timed = self.entries[at], self._request, self._request.timed
        asked = request.for_kind(entry.record.shape.kind)
        if any(path[-1] == "frame" and request.counts(names[0] or "") for path in entry.record.parent.paths):
            return None
        try:
            new = names if asked.rename is None else asked.rename(*names)
            if entry.edge is not None and request.pose_from_frame is not None:
                request.pose_from_frame(names[0])
            is_timed = timed is not None and not timed.name and timed.moves(names[0])
        except FrametoolError:
            return None
        parent, name = (
            name if index is None else (name == old, name == other, not name)
            for name, old, other, index in zip(new, names, names[::-1], self.frames[at], strict=True)
        )
        return new, parent, name, is_timed

    def fits_in(self, text: bytes, places: Sequence[tuple[int, int]]) -> bool:
        """Return True if the frames that a record names fit; places: where its stretches are."""
        for at, (entry, found) in enumerate(zip(self.entries, self.frames, strict=True)):
            known = entry.record.parent.text, entry.record.name.text
            parent, name = (
                old if index is None else text[slice(*places[index])].decode()
                for old, index in zip(known, found, strict=True)
            )
            if self.named(at, (parent, name)) is None:
                return False
        return True

    @cached_property
    def expression(self) -> bytes:
        """Return the regular expression, one group a stretch, that all records match that are alike."""
        free = iter(() if self._request.results.canonical else self._free_leaves())
        leaf = next(free, None)
        groups = []
        for start, end in self.stretches:
            if (start, end) in self._patterns:
                groups.append(f"({self._patterns[start, end]})")
                continue
            parts, at = [], start
            while leaf is not None and leaf[0].end <= end:
                node, pattern = leaf
                if node.start >= at:
                    parts += [re.escape(self.text[at : node.start]), pattern]
                    at = node.end
                leaf = next(free, None)
            groups.append("".join(["(", *parts, re.escape(self.text[at:end]), ")"]))
        return "".join(groups).encode()

    def _cut_leaves(self, cuts: Collection[Span]) -> dict[Span, Node]:
        """Return the scalars that decide nothing, without their quotes, and add what may be there."""
        found: dict[Span, Node] = {}
        for node, pattern in self._free_leaves():
            span, quotes = (node.start, node.end), len(node.quote or "")
            if span not in cuts:  # else it is a stamp, which is read as it is written
                span, pattern = (node.start + quotes, node.end - quotes), pattern[quotes : len(pattern) - quotes]  # noqa: PLW2901
            if span[0] < span[1]:
                found[span], self._patterns[span] = node, pattern
        return found

    def stretch_of(self, path: Path) -> int:
        """Return the stretch of a scalar that decides nothing."""
        node = self._root.at(path)
        return next(at for at, each in self.leaves if each.start == node.start)

    def _free_leaves(self) -> Iterator[tuple[Node, str]]:
        """Yield the scalars that decide nothing, in order, each with the expression of what it may be."""
        around: set[Path] = set()
        fixed: set[Path | None] = set()
        for record, *_ in self.entries:
            depths = range(len(record.path) + 1)
            around.update(record.path[:depth] for depth in depths)
            around.update((*record.path[:depth], "header") for depth in depths)
            around.update([(*record.path, "scale")] * (record.shape.kind == POSE))
            fixed.update(record.numbers, record.begins)
        has_poses = any(record.shape.kind == POSE for record, *_ in self.entries)
        words = _WORDS if has_poses else _WORDS - {"scale"}  # of points that is data
        placed = {(*record.path, key) for record, *_ in self.entries for key in record.placed}
        number = JSON_NUMBER if self.json else YAML_NUMBER
        operation = self._request.operation
        passes = operation.keeps_frames and operation.formula is None and self._request.gathered is None
        stamps = {path: STAMP[at % 2] for record, *_ in self.entries for at, path in enumerate(record.stamps)}
        for path, leaf in _leaves(self._root, ()):
            depth = next((depth for depth in range(len(path), 0, -1) if type(path[depth - 1]) is str), 0)
            key, is_own = str(path[depth - 1]) if depth else "", depth == len(path)
            is_free = key in RESULT_KEYS if is_own else key == COVARIANCE and passes
            pattern = FREE.get((self.json, leaf.quote), FREE[self.json, ""])
            if key == "frame" and self._request.counts(leaf.value):
                pattern = f"{leaf.quote}[0-9]++{leaf.quote}"
            elif path in stamps:
                pattern = f"{leaf.quote}{stamps[path]}{leaf.quote}"
            elif "sigma" in path or may_be_uncertain(key) or any(path[: len(each)] == each for each in placed):
                continue  # they say a covariance or a place, and are no numbers of ours
            elif is_free and path not in fixed and re.fullmatch(number, leaf.value):
                pattern = f"{leaf.quote}{number}{leaf.quote}"
            elif is_own and key in LISTED_WORDS:
                pass
            elif path in fixed or key in DECISIVE or (path[: depth - 1] in around and _stem(key) in words):
                continue
            if re.fullmatch(pattern, self.text[leaf.start : leaf.end], re.ASCII):
                yield leaf, pattern


def _stem(key: str) -> str:
    """Return a key without its unit: with our numbers its scalar may be one of them or change what they mean."""
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


def _frames_of(root: Node, record: Record, request: Request, *, json: bool) -> tuple[Node | None, Node | None]:
    """Return where the frames of a record are named, parent and name, if all that is alike may name others."""
    is_placed = record.placed or record.shape.place or request.results.place or request.rows.given_place
    if is_placed or not request.rows.poses:
        return None, None
    parent, name = (
        root.at(each.paths[0]) if each.text and len(each.paths) == 1 else None for each in (record.parent, record.name)
    )
    return _as_frame(parent, json=json), _as_frame(name, json=json)


def _as_frame(node: Node | None, *, json: bool) -> Node | None:
    """Return the node of a frame's name if it is written as plainly as all that are alike are."""
    if node is None or type(node.value) is not str or len(node.value) != node.end - node.start - 2 * bool(node.quote):
        return None
    pattern = FRAME.get((json, node.quote))
    return node if pattern is not None and re.fullmatch(pattern, node.value, re.ASCII) else None


def _text_of(node: Node) -> Span:
    """Return where the text of a scalar is, without its quotes."""
    return node.start + bool(node.quote), node.end - bool(node.quote)
