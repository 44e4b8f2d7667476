"""The records of a text, read once: one record of a stream, an argument or a document, and the text of its result."""

from __future__ import annotations

import re
from functools import cached_property, partial
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.document import Aliased, Document, Node, locate_many, parse_documents, parse_nodes
from frametool.documents.json import strict_json
from frametool.documents.source import Source, check_text, decode
from frametool.errors import FormatError, FrametoolError
from frametool.stream.answers import answer, number_writer, read_entries, wide_turn, written
from frametool.stream.faults import ZONES, Fault, RowNote
from frametool.stream.layout import Const, IfLocked, In, Out, Renamed, Word
from frametool.stream.record import value_at
from frametool.stream.splice import Splicer, null_edits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.errors import Finding
    from frametool.stream.answers import Answer, Entry
    from frametool.stream.layout import Piece
    from frametool.stream.record import Record
    from frametool.stream.request import Request
    from frametool.stream.splice import Edit
    from frametool.stream.splitter import Part

_OTHER_START = re.compile(r"^(?=[A-Z\t\[\d$^])", re.MULTILINE)  # no key that ROS prints begins so

MOST_LEAVES = 2000  # scalars of a record: an expression that cuts those written alike takes longer for more


class Rendered(NamedTuple):
    """The text of a result, b"" where nothing is in it; how many rotations were normalised for it, and warnings."""

    text: bytes
    mended: int
    notes: list[RowNote]


class RecordText:
    """The records of a text, and what is asked of each.

    values: of its documents, by their number in the text; entries: its records
    notes: warnings about them, unless `note` takes these
    edits: what changes in the text
    """

    def __init__(
        self, source: Source, request: Request, *, json: bool, note: Callable[[list[Finding]], object] | None = None
    ) -> None:
        """Read the records; raises FormatError with the place."""
        self.source, self.text, self.request, self.json = source, source.text, request, json
        self.notes: list[Finding] = []
        self.edits: list[Edit] = []
        documents = json_documents(source) if json else parse_documents(source.text, source.name)
        self.values = {document.index: document.value for document in documents}
        take = note or self.notes.extend
        self.entries = [entry for each in documents for entry in read_entries(each, request, source, take)]

    @property
    def records(self) -> list[Record]:
        """Return the records."""
        return [entry.record for entry in self.entries]

    @cached_property
    def root(self) -> Node:
        """Return the nodes of the text, by the number of their document."""
        return Node(0, len(self.text), parse_nodes(self.text))

    @cached_property
    def is_long(self) -> bool:
        """Return True if it has so many scalars that no other one is looked for that is written alike."""
        return next(islice(self.root.leaves(), MOST_LEAVES, None), None) is not None

    @property
    def line(self) -> int:
        """Return the line, from 0, of the first of our numbers."""
        paths = (path for entry in self.entries for path in entry.record.numbers if path is not None)
        return self.text.count("\n", 0, min((self.root.at(path).start for path in paths), default=0))

    def answer(self, entry: Entry) -> Answer:
        """Return what becomes of a record."""
        texts = [str(value_at(self.values, path)) for path in entry.stamp]
        return answer(entry, entry.record.values, texts, self.request)

    def edits_for(self, entries: Sequence[Entry], request: Request) -> list[Edit]:
        """Return what changes in the text; a name that several records share changes once."""
        edits: list[Edit] = []
        first = 0
        for entry in entries:
            edits += Splicer(self.text, self.root, entry, request, json=self.json, first=first).run()
            first += request.result_size(entry.record.shape, entry.target)
        return list(dict.fromkeys(edits))

    def with_numbers(
        self, edits: Sequence[Edit], texts: Sequence[str], numbers: Sequence[float], *, locked: bool = False
    ) -> str:
        """Return the text with the texts of numbers of results in their places, some of them as words."""
        stretches, pieces = cut(len(self.text), (), edits)
        shown = []
        for piece in pieces:
            if isinstance(piece, In):
                shown.append(self.text[slice(*stretches[piece.part])])
            elif isinstance(piece, Out):
                shown.append(texts[piece.first])
            elif isinstance(piece, Word):
                shown.append(piece.text(numbers[piece.number]).decode())
            elif isinstance(piece, (Const, Renamed)) or (locked and isinstance(piece, IfLocked)):
                shown.append(piece.text.decode())
        return "".join(shown)

    def rendered(self, line: int, column: int) -> Rendered | Fault:
        """Return the text of the result, or why there is none.

        line, column: where the text begins; lines count from 0
        """
        try:
            answers = [*map(self.answer, self.entries)]
            numbers = [number for each in answers for number in written(each)]
        except FrametoolError as error:
            return Fault.of(line + self.line, getattr(error, "column_name", ""), error)
        write = number_writer(self.request.precision, yaml=not self.json)
        locked = any(each.entry.target.locked(each.parts) for each in answers)
        text = self.with_numbers(self.edits, [write(number) for number in numbers], numbers, locked=locked)
        mended, notes = sum(note.rule == "rounded" for note in self.notes), self.notes_at(line, column)
        wide = next(filter(None, (wide_turn(each, self.request.operation) for each in answers)), None)
        notes += [RowNote(line + self.line, wide.rule, wide.message)] if wide else []
        if (place := answers[0].entry.target.place if answers else None) is not None:
            from frametool.geometry.transverse_mercator import ZONES as ZONE_NAMES

            zones = (ZONE_NAMES[int(numbers[at])] for at in place.words)
            notes += [RowNote(line + self.line, ZONES, zone) for zone in zones]
        return Rendered(text.encode() if self.entries else b"", mended, notes)

    def row_notes(self) -> Iterator[RowNote]:
        """Yield warnings that hold for all records that are written alike."""
        for entry in self.entries:
            if entry.lost:
                yield RowNote.of_lost_name(0, entry.lost)
            if not entry.record.values and entry.record.shape.kind:
                yield RowNote(0, "identity", "neither position nor rotation: taken as the identity")

    def notes_at(self, line: int, column: int) -> list[RowNote]:
        """Return all warnings about the records and their numbers, each with its place."""
        begin = Source("", self.text, line, column)
        places = [begin.place(*each) for each in locate_many(self.text, [note.path for note in self.notes])]
        notes = zip(self.notes, places, strict=True)
        found = [RowNote(at, note.rule, note.message, str(there)) for note, (at, there) in notes]
        known = {note.about for note in found}
        others = [each._replace(line=line + self.line) for each in self.row_notes() if each.about not in known]
        return sorted(found + others)


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


def json_documents(source: Source) -> list[Document]:
    """Read strict JSON: what only YAML would take is a fault of the record."""
    check_text(source)
    values = strict_json(source)
    return [Document(value, index, source) for index, value in enumerate(values) if value is not None]


def nulled(text: str, *, json: bool) -> str | None:
    """Return the text of a record with null in the place of our numbers; None if it has none that can be found."""
    try:
        json_documents(Source("", text)) if json else parse_documents(text, "")
        edits = null_edits(Node(0, len(text), parse_nodes(text)))
    except FormatError:
        return None
    segments, pieces = cut(len(text), (), edits)
    shown = (text[slice(*segments[each.part])] if isinstance(each, In) else "null" for each in pieces)
    return "".join(shown) if edits else None


def null_of(record: bytes, *, json: bool) -> bytes:
    """Return what replaces a record without a result: its keys with null in the place of ours, or null."""
    body = record.rstrip(b"\r\n")
    try:
        text = nulled(body.decode(), json=json)
    except UnicodeDecodeError:
        text = None
    return (b"null" if text is None else text.encode()) + record[len(body) :]


def column_in(text: bytes, place: int) -> int:
    """Return the column, from 1, at which a place is in its line."""
    return len(text[text.rfind(b"\n", 0, place) + 1 : place].decode("utf-8", "replace")) + 1


def attempt(
    text: bytes, part: Part, fmt: str, request: Request, name: str, line: int,
    note: Callable[[Source, list[Finding]], object] | None = None,
) -> RecordText | Fault:  # fmt: skip
    """Read one record of a stream, or say what is wrong with it.

    line: where the record begins, counted from 0; note: takes warnings about it
    """
    if part.problem:
        return Fault(line, "", part.problem, final=part.final)
    source = Source(name, "", line + 1, column_in(text, part.start))
    try:
        decoded = decode(text[part.start : part.end], name)
        if fmt == "yaml" and _OTHER_START.search(decoded):
            decoded = without_noise(decoded)
        source = source._replace(text=decoded)
        found = RecordText(source, request, json=fmt == "json", note=note and partial(note, source))
        if not request.canonical:
            found.edits = found.edits_for(found.entries, request)
    except Aliased as error:
        return fault_at(source, error.in_text(source.text))
    except FormatError as error:
        return fault_at(source, error)
    except FrametoolError as error:
        return Fault.of(line, getattr(error, "column_name", ""), error)
    return found


def fault_at(source: Source, error: FormatError) -> Fault:
    """Return an error in a record as a fault with its place."""
    line, column = source.place(max(error.line, 1), error.column)
    named = getattr(error, "column_name", "") or (str(column) if error.column else "")
    return Fault(line - 1, named, error.message, kind=error.kind)


def without_noise(text: str) -> str:
    """Blank the lines that the echo tools print between messages."""
    from frametool.ros.message_stream import NOISE

    return "\n".join("" if NOISE(line.rstrip("\r")) else line for line in text.split("\n"))
