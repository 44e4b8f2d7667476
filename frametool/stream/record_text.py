"""The records of a text, read once: one record of a stream, an argument or a document, and what becomes of it."""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property, partial
from itertools import islice
from math import isfinite, isinf
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.document import Document, Node, locate_many, parse_documents, parse_nodes
from frametool.documents.json import strict_json
from frametool.documents.source import Source, check_text
from frametool.errors import Finding, FrametoolError, ValueInvalid
from frametool.geometry import floats
from frametool.grammar.readers import Misfit, Path, Reading, in_nanoseconds, within
from frametool.stream.faults import ZONES, RowNote
from frametool.stream.record import Record, find_records, value_at
from frametool.stream.row_layout import FLAT, LEAVES_PLANE, Target, checked_rotation
from frametool.stream.stamp_source import key_path, read_header_stamp, read_stamp, stamp_keys

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.geometry.types import Components, Rigid
    from frametool.stream.request import Operation, Request
    from frametool.stream.splice import Edit

ROUNDED = "rounded"  # rule of the warning about rotations that were normalised
MOST_LEAVES = 2000  # scalars of a record: an expression that cuts those written alike takes longer for more
SIX_BY_SIX = 36  # entries of the covariance of a pose


class Outside(FrametoolError):
    """Report a record whose time is not wanted, which is left out without a word."""

    kind = "outside"


class Entry(NamedTuple):
    """One record of a text and what is asked of it.

    target: how its result is written
    edge: the pose that moves it; None if absent, or where its own time decides
    stamp: the paths of that time, or of what else comes with it: one, or seconds and nanoseconds
    parent, name: the frames of its result
    """

    record: Record
    target: Target
    edge: Rigid | None
    stamp: tuple[Path, ...] = ()
    parent: str | None = None
    name: str | None = None

    @property
    def lost(self) -> str:
        """Name a frame that the record names and the result cannot."""
        is_named = self.parent is not None or self.name is not None
        return "" if is_named else self.record.parent.text or self.record.name.text or ""

    def stamp_ns(self, texts: Sequence[str]) -> int:
        """Read the texts of the record's own time."""
        if len(texts) > 1:
            return read_header_stamp(*texts)
        return read_stamp(texts[0], in_ns=in_nanoseconds(str(self.stamp[0][-1])))


class Answer(NamedTuple):
    """What became of a record: the components of its result; has_gaps: numbers of it may be nan."""

    entry: Entry
    parts: Components
    has_gaps: bool = False


def read_entries(document: Document, request: Request, source: Source, notes: list[Finding]) -> list[Entry]:
    """Read the records of a document, and what each is asked; what is invalid about them is added to notes.

    Raises FormatError with the place of a record that cannot be read.
    """
    reading = Reading(source, degrees=request.rows.degrees, normalize=request.rows.normalize, earth=request.earth)
    try:
        records = list(find_records(document.value, request, reading, (document.index,)))
        if reading.notes:
            notes += [_at_its_number(each, records) for each in reading.notes]
        return [_entry(document, record, request) for record in records]
    except Misfit as misfit:
        error = misfit.placed(source)
        error.column_name = ".".join(map(str, misfit.path[1:]))  # type: ignore[attr-defined]
        raise error from misfit


def _at_its_number(note: Finding, records: Sequence[Record]) -> Finding:
    """Return a note about a rotation with the place of the first of its numbers, as blocks of rows have it."""
    found = (each for each in records if note.rule == ROUNDED and each.path == note.path and each.shape.notation)
    record = next(found, None)
    path = record and record.numbers[record.shape.rotation_at[0]]
    return note._replace(path=path) if path else note


def _entry(document: Document, record: Record, request: Request) -> Entry:
    """Find the pose that moves a record, or the stamp at which it is looked up; check the frames it names."""
    stamp: tuple[Path, ...] = ()
    edge = None
    timed, operation = request.timed, request.operation
    if timed is not None and timed.name:
        stamp = _scalar(document, record, timed.name)
    elif timed is not None and record.stamps and timed.moves(record.parent.text):
        stamp = record.stamps[:2]
    elif timed is not None and operation.formula is not None and not operation.shown:
        stamp = _scalar(document, record)
    elif (key := request.rows.extra_column) is not None:
        stamp = (not key and record.stamps[:2]) or _scalar(document, record, key)
    elif request.pose_from_frame is not None:
        edge = request.pose_from_frame(record.parent.text)
    request = request.for_kind(record.shape.kind)
    parent, name = record.parent.text, record.name.text
    if request.rename is not None:
        parent, name = request.rename(parent, name)
    names = [each.representation.name for each in request.results.notations]
    # conventions of Euler angles share a key and are together
    together = sorted(request.results.notations, key=lambda each: names.index(each.representation.name))
    target = request.with_results(notations=tuple(together)).target(record.shape)
    return Entry(record, target, edge, stamp, parent, name)


def _scalar(document: Document, record: Record, name: str = "") -> tuple[Path]:
    """Find a scalar of a record or of what is around it, by a name or that of a stamp; raises Misfit."""
    find = partial(key_path, name=name) if name else stamp_keys
    return ((document.index, *within((document.index,), find, document.value, record.path[1:])),)


def answer(entry: Entry, stamp: Sequence[str], request: Request) -> Answer:
    """Return what becomes of a record.

    stamp: the texts of its own time
    Raises ValueInvalid for what is no rotation, FrametoolError where there is no pose at its time.
    """
    operation, shape, timed = request.operation, entry.record.shape, request.timed
    edge, at_ns = entry.edge, None
    if stamp and (timed is not None or request.window):
        try:
            at_ns = entry.stamp_ns(stamp)
            if timed is not None and (operation.formula is None or operation.shown):
                edge = timed.pose(entry.record.parent.text, at_ns)
        except FrametoolError as error:
            error.column_name = timed.column if timed else str(entry.stamp[0][-1])  # type: ignore[attr-defined]
            raise
    if request.window and at_ns is not None and not request.window[0] <= at_ns <= request.window[1]:
        raise Outside("beyond --start or --stop")
    parts = operation.result(
        shape, entry.record.values, edge, floats,
        rotation=lambda own: checked_rotation(shape, own, normalize=request.rows.normalize)[0],
        compared=lambda pose: [pose], seconds=float, times_ns=at_ns,
    )  # fmt: skip
    return Answer(entry, parts, has_gaps=operation.shown is not None)


def wide_turn(made: Answer, operation: Operation) -> Finding | None:
    """Return a warning of a turn that is too uncertain for the first order; of what moves others it comes elsewhere."""
    record = made.entry.record
    if operation.uncertain or len(operation.carried(record.shape)) < SIX_BY_SIX:
        return None
    from frametool.geometry.uncertainty import WIDE_RULE, doubt

    message = doubt(made.parts[-SIX_BY_SIX:])
    return Finding(WIDE_RULE, message, path=record.path) if message else None


def written(each: Answer) -> list[float]:
    """Return the numbers of a result as they are written; raises ValueInvalid for one that leaves the plane."""
    target = each.entry.target
    for name, number in target.left_out(each.parts, floats):
        if abs(number) > FLAT:
            raise ValueInvalid(LEAVES_PLANE.format(name, number))
    if target.place is not None:
        target.place.check_result(*each.parts[:3])
    numbers = [number + 0.0 for number in target.written(each.parts, floats)]  # none is -0.0
    if not all(map(isfinite, numbers)) and (not each.has_gaps or any(map(isinf, numbers))):
        raise ValueInvalid("the result is not finite: the numbers are too large")
    return numbers


class RecordText:
    """The records of a text, and what is asked of each.

    values: of its documents, by their number in the text; entries: its records
    notes: warnings about them
    edits: what changes in the text
    """

    def __init__(self, source: Source, request: Request, *, json: bool) -> None:
        """Read the records; raises FormatError with the place."""
        self.source, self.text, self.request, self.json = source, source.text, request, json
        self.notes: list[Finding] = []
        self.edits: list[Edit] = []
        documents = json_documents(source) if json else parse_documents(source.text, source.name)
        self.values = {document.index: document.value for document in documents}
        self.entries = [entry for each in documents for entry in read_entries(each, request, source, self.notes)]

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

    @cached_property
    def line(self) -> int:
        """Return the line, from 0, of the first of our numbers."""
        paths = (path for entry in self.entries for path in entry.record.numbers if path is not None)
        return self.text.count("\n", 0, min((self.root.at(path).start for path in paths), default=0))

    def answer(self, entry: Entry) -> Answer:
        """Return what becomes of a record."""
        texts = [str(value_at(self.values, path)) for path in entry.stamp] if entry.stamp else ()
        return answer(entry, texts, self.request)

    def answers(self, parts: Sequence[Components] | None = None) -> list[Answer]:
        """Return what becomes of the records but for those whose time is not wanted; raises Outside if none is.

        parts: the components of each result, if known
        """
        if parts is not None:
            return [Answer(*each) for each in zip(self.entries, parts, strict=True)]
        found = []
        for entry in self.entries:
            with suppress(Outside):
                found.append(self.answer(entry))
        if len(found) < len(self.entries) and (not found or not self.request.results.canonical):
            raise Outside("beyond --start or --stop")
        return found

    def row_notes(self) -> Iterator[RowNote]:
        """Yield warnings that hold for all records that are written alike."""
        for entry in self.entries:
            if entry.lost:
                yield RowNote.of_lost_name(0, entry.lost)
            if not entry.record.values and entry.record.shape.kind:
                yield RowNote(0, "identity", "neither position nor rotation: taken as the identity")

    def notes_at(self, line: int, column: int, answers: Sequence[Answer] = ()) -> list[RowNote]:
        """Return all warnings about the records, their numbers, and what became of them, each with its place.

        line, column: where the text begins; lines count from 0
        """
        begin, found = Source("", self.text, line, column), list[RowNote]()
        places = locate_many(self.text, [note.path for note in self.notes]) if self.notes else ()
        for note, at_char in zip(self.notes, places, strict=True):
            at, there = begin.place(*at_char)
            found.append(RowNote(at, note.rule, note.message, str(there)))
        for each in self.row_notes():
            if all(each.about != other.about for other in found[: len(self.notes)]):
                found.append(each._replace(line=line + self.line))
        found.sort()
        for answer in answers:
            if wide := wide_turn(answer, self.request.operation):
                found.append(RowNote(line + self.line, wide.rule, wide.message))
                break
        if answers and (place := answers[0].entry.target.place) is not None:
            from frametool.geometry.earth import ZONES as ZONE_NAMES

            numbers = written(answers[0])
            found += [RowNote(line + self.line, ZONES, ZONE_NAMES[int(numbers[at])]) for at in place.words]
        return found


def json_documents(source: Source) -> list[Document]:
    """Read strict JSON: what only YAML would take is a fault of the record."""
    check_text(source)
    values = strict_json(source)
    return [Document(value, index, source) for index, value in enumerate(values) if value is not None]


def without_noise(text: str) -> str:
    """Blank the lines that the echo tools print between messages."""
    from frametool.ros.message_stream import NOISE

    return "\n".join("" if NOISE(line.rstrip("\r")) else line for line in text.split("\n"))
