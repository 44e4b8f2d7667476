"""What is learned from one record and holds for all that are written alike: what its numbers mean, what changes.

Records are alike if they differ only in our numbers and in scalars that merely pass; then one regular expression
cuts them all into the same stretches, and nothing has to be parsed again.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import Document, format_error, parse_documents
from frametool.documents.json_reader import strict_json
from frametool.documents.nodes import parse_nodes
from frametool.documents.source import Source, check_text
from frametool.errors import FormatError
from frametool.grammar.readers import Misfit, NotARotation, Reading
from frametool.stream.find_poses import find_holders
from frametool.stream.splice import Editor, target_of
from frametool.stream.stamp_source import stamp_path
from frametool.stream.text_parts import In, Out

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.documents.nodes import Node
    from frametool.geometry.types import Rigid
    from frametool.stream.find_poses import Holder
    from frametool.stream.request import Request
    from frametool.stream.row_layout import Shape, Target
    from frametool.stream.splice import Edit
    from frametool.stream.text_parts import Piece

# what may be a number; reading it decides
JSON_NUMBER = r"-?(?!0[0-9])[0-9][-+.0-9eE]*+"
YAML_NUMBER = r"[-+.]?[0-9][-+.0-9eE]*+"
JSON_TEXT = r'"[^"\\\x00-\x1f]*(?:\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4})[^"\\\x00-\x1f]*)*"'
# what may stand for a scalar that passes, by its quotes: never anything that could be read as more than one scalar
YAML_PLAIN = r"(?:-(?! )|[A-Za-z0-9_./+])(?:[\w./+-]| (?=[\w./+(-])|:(?=[\w/]))*"
FREE = {
    (True, True): JSON_TEXT,
    (True, False): r"(?:-?(?!0[0-9])[0-9]++(?:\.[0-9]++)?+(?:[eE][-+]?[0-9]++)?+|true|false|null)",
    (False, True): r'"[^"\\\x00-\x1f]*"',
    (False, False): YAML_PLAIN,
}
SINGLE_QUOTED = r"'[^'\x00-\x1f]*'"


class Entry(NamedTuple):
    """One point or pose of a record: what it is, how its result is written, and its mover, or its stamp."""

    holder: Holder
    target: Target
    edge: Rigid | None
    stamp: tuple[str | int, ...] | None = None


class Learned:
    """A record, and what holds for all that are alike.

    segments: the stretches of its text; numbers: those that hold our numbers, in order; stamps: those of each entry's
    stamp; pieces: of the result
    """

    def __init__(
        self, text: str, entries: Sequence[Entry], nodes: Sequence[Node], edits: Sequence[Edit], *, json: bool
    ) -> None:
        """Cut the text where numbers and edits are."""
        self.text = text
        self.entries = tuple(entries)
        self.json = json
        self._nodes = nodes
        slots = _slots(entries, nodes)
        stamps = [_span(nodes, entry.stamp) for entry in entries if entry.stamp is not None]
        number = re.compile(JSON_NUMBER if json else YAML_NUMBER)
        self.regular = all(slot is not None and number.fullmatch(text, *slot) for slot in slots)
        self.values = tuple(value for entry in entries for value in entry.holder.values)
        cuts = sorted({slot for slot in (*slots, *stamps) if slot is not None})
        self.stretches, self.pieces = _cut(text, cuts, edits)
        self.numbers = tuple(self.stretches.index(slot) for slot in slots if slot is not None)
        self.stamps = tuple(self.stretches.index(stamp) for stamp in stamps)
        first = min((slot[0] for slot in slots if slot is not None), default=0)
        self.line = text.count("\n", 0, first)

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Return what the numbers mean."""
        return tuple(entry.holder.shape for entry in self.entries)

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
            ".".join(map(str, path[1:])) if path else "" for entry in self.entries for path in entry.holder.numbers
        )

    def segments(self) -> list[str]:
        """Return the text of each stretch."""
        return [self.text[start:end] for start, end in self.stretches]

    @cached_property
    def expression(self) -> bytes:
        """Return the regular expression, one group a stretch, that all records match that are alike."""
        number = JSON_NUMBER if self.json else YAML_NUMBER
        ours = set(self.numbers)
        fixed = _fixed_places(self.entries, self._nodes)
        free = [leaf for node in self._nodes for leaf in node.leaves() if (leaf.start, leaf.end) not in fixed]
        groups = [
            f"({number})" if index in ours and self.regular else f"({self._open(start, end, free)})"
            for index, (start, end) in enumerate(self.stretches)
        ]
        return "".join(groups).encode()

    def _open(self, start: int, end: int, free: Sequence[Node]) -> str:
        """Write a stretch as an expression in which scalars that pass may differ."""
        parts, at = [], start
        for leaf in free:
            pattern = self._pattern(leaf)
            if (
                leaf.start < at
                or leaf.end > end
                or not re.fullmatch(pattern, self.text[leaf.start : leaf.end], re.ASCII)
            ):
                continue
            parts += [re.escape(self.text[at : leaf.start]), pattern]
            at = leaf.end
        return "".join([*parts, re.escape(self.text[at:end])])

    def _pattern(self, leaf: Node) -> str:
        return SINGLE_QUOTED if leaf.quote == "'" else FREE[self.json, leaf.quote == '"']


def _slots(entries: Sequence[Entry], nodes: Sequence[Node]) -> list[tuple[int, int] | None]:
    """Return where each of our numbers stands, without its quotes; None for one that is not written."""
    found: list[tuple[int, int] | None] = []
    for entry in entries:
        for path in entry.holder.numbers:
            node = _node(nodes, path) if path is not None else None
            found.append(None if node is None else (node.start + bool(node.quote), node.end - bool(node.quote)))
    return found


def _span(nodes: Sequence[Node], path: tuple[str | int, ...]) -> tuple[int, int]:
    """Return where a scalar stands, with its quotes."""
    node = _node(nodes, path)
    return node.start, node.end


def _node(nodes: Sequence[Node], path: tuple[str | int, ...]) -> Node:
    return nodes[int(path[0])].at(path[1:])


def _fixed_places(entries: Sequence[Entry], nodes: Sequence[Node]) -> set[tuple[int, int]]:
    """Return the places of scalars that must be the same: our numbers, names of frames, what says units and axes."""
    fixed = {
        (node.start, node.end)
        for entry in entries
        for path in entry.holder.numbers
        if path is not None
        for node in (_node(nodes, path),)
    }
    for entry in entries:
        holder = entry.holder
        for _, path in (holder.name, holder.parent):
            try:
                node = _node(nodes, path)
            except (KeyError, IndexError):
                continue
            fixed.add((node.start, node.end))
        node = _node(nodes, holder.path)
        if type(node.value) is dict:
            for key in ("angles", "inverse", holder.rotation, *holder.others):
                if key in node.value:
                    fixed.update((leaf.start, leaf.end) for leaf in node.value[key][1].leaves())
    return fixed


def _cut(
    text: str, slots: Sequence[tuple[int, int]], edits: Sequence[Edit]
) -> tuple[list[tuple[int, int]], list[Piece]]:
    """Cut the text into stretches, each number one of its own; give them with the pieces of the result."""
    stretches: list[tuple[int, int]] = []
    pieces: list[Piece] = []
    at = 0
    for edit in sorted(edits, key=lambda each: (each.start, each.end)):
        start = max(edit.start, at)
        _pass(stretches, pieces, slots, at, start, shown=True)
        pieces += edit.pieces
        _pass(stretches, pieces, slots, start, max(edit.end, start), shown=False)
        at = max(edit.end, start)
    _pass(stretches, pieces, slots, at, len(text), shown=True)
    return stretches, _joined(pieces)


def _pass(
    stretches: list[tuple[int, int]],
    pieces: list[Piece],
    slots: Sequence[tuple[int, int]],
    start: int,
    end: int,
    *,
    shown: bool,
) -> None:
    """Add the stretches from start to end, numbers singly; they are pieces of the result if they are shown."""
    for slot in slots:
        if start <= slot[0] and slot[1] <= end:
            if slot[0] > start:
                _add(stretches, pieces, (start, slot[0]), shown=shown)
            _add(stretches, pieces, slot, shown=shown)
            start = slot[1]
    if end > start:
        _add(stretches, pieces, (start, end), shown=shown)


def _add(stretches: list[tuple[int, int]], pieces: list[Piece], stretch: tuple[int, int], *, shown: bool) -> None:
    stretches.append(stretch)
    if shown:
        pieces.append(In(len(stretches) - 1))


def _joined(pieces: list[Piece]) -> list[Piece]:
    return [piece for piece in pieces if not isinstance(piece, Out) or piece.last > piece.first]


def learn(text: str, request: Request, *, json: bool, source: str, line: int) -> Learned | None:
    """Learn from one record; None if there is nothing in it.

    line: of the record's first character, from 1.  Raises FormatError with the place.
    """
    here = Source(source, text)
    try:
        documents = _json_documents(here) if json else parse_documents(text, source)
        entries = [entry for document in documents for entry in _entries(document, request, here)]
    except FormatError as error:
        error.line += line - 1
        raise
    if not entries:
        return None
    nodes = parse_nodes(text)
    return Learned(text, entries, nodes, _edits(text, entries, nodes, request, json=json), json=json)


def _json_documents(source: Source) -> list[Document]:
    """Read strict JSON: what only YAML would take is a fault of the record."""
    check_text(source)
    values = strict_json(source)
    return [Document(value, index, source) for index, value in enumerate(values) if value is not None]


def _entries(document: Any, request: Request, source: Source) -> list[Entry]:
    reading = Reading(source, degrees=request.degrees, normalize=request.normalize)
    try:
        holders = list(find_holders(document.value, request, reading))
        made = []
        for holder in holders:
            placed = _below_document(holder, document.index)
            timed = request.timed
            stamp = (document.index, *stamp_path(document.value, holder.path, timed.name)) if timed else None
            edge = request.way(placed.parent[0]) if request.way and not timed else None
            if request.way is None and request.rename:
                request.rename(placed.parent[0], placed.name[0])
            made.append(Entry(placed, target_of(placed, request), edge, stamp))
    except Misfit as misfit:
        error = format_error(source, (document.index, *misfit.path), str(misfit), key=misfit.key)
        error.__cause__ = misfit if isinstance(misfit, NotARotation) else None
        error.column_name = ".".join(map(str, misfit.path))  # type: ignore[attr-defined]
        raise error from misfit
    return made


def _below_document(holder: Holder, index: int) -> Holder:
    """Let a holder's paths begin at the document's number."""
    return holder._replace(
        path=(index, *holder.path),
        shape=holder.shape._replace(inverse=holder.inverse),
        numbers=tuple(None if path is None else (index, *path) for path in holder.numbers),
        name=(holder.name[0], (index, *holder.name[1])),
        parent=(holder.parent[0], (index, *holder.parent[1])),
    )


def _edits(text: str, entries: Sequence[Entry], nodes: Sequence[Node], request: Request, *, json: bool) -> list[Edit]:
    edits: list[Edit] = []
    first = 0
    for entry in entries:
        index = int(entry.holder.path[0])
        holder = _above_document(entry.holder)
        edits += Editor(text, nodes[index], holder, entry.target, request, json=json, first=first).run()
        first += entry.target.size + len(request.operation.extras) * (entry.holder.shape.kind == "pose")
    return edits


def _above_document(holder: Holder) -> Holder:
    """Let a holder's paths begin below its document."""
    return holder._replace(
        path=holder.path[1:],
        numbers=tuple(None if path is None else path[1:] for path in holder.numbers),
        name=(holder.name[0], holder.name[1][1:]),
        parent=(holder.parent[0], holder.parent[1][1:]),
    )
