"""Read the records of one text (an argument, a document, or one record of a stream) and compute them one by one.

Results are values for arguments, files and output in another format.  Reading, operation and warnings are the same as
for streams.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cached_property, partial
from itertools import islice
from math import isfinite, isinf
from typing import TYPE_CHECKING, Any

from frametool.documents.document import (
    JSON_NUMBER,
    Aliased,
    Document,
    Node,
    check_text,
    locate_many,
    parse_documents,
    parse_nodes,
    refuse_alias,
    strict_json,
)
from frametool.documents.source import Source, Verbatim
from frametool.errors import Finding, FormatError, FrametoolError, Misused, NamedTuple, ValueInvalid, shown, warn
from frametool.formats.table import holds
from frametool.geometry import floats
from frametool.grammar.pose import SCALE, Pose
from frametool.grammar.readers import Misfit, NotARotation, Path, Reading, in_nanoseconds, stamp_column, tell, within
from frametool.grammar.result import SPELLED, Result, Style, with_entries
from frametool.rows.faults import ZONES, RowNote
from frametool.rows.holders import outdated, value_at
from frametool.rows.record import Record, find_records, key_path, pose_of
from frametool.rows.request import NO_STAMPS, Request, RowOptions
from frametool.rows.shapes import AS_READ, FLAT, LEAVES_PLANE, PARTS, POSE, ROTATION, VECTOR, checked_rotation

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from frametool.geometry import Components, Rigid
    from frametool.rows.request import Operation
    from frametool.rows.shapes import Shape

    Value = Result | dict[str, Any]

ROUNDED = "rounded"  # the rule of the warning for normalised rotations
MOST_LEAVES = 2000  # scalars of a record from which a template is learned: for more its expression is slow
MOST_ENTRIES = 8  # points or poses of a record for which rows are made together
SIX_BY_SIX = 36  # entries of the covariance of a pose
CUT = "some of its poses are beyond --start or --stop: what stays is written to another format, as -f csv"


class Outside(FrametoolError):
    """A record outside --start and --stop, which is left out without a warning."""

    kind = "outside"


class Entry(NamedTuple):
    """One record of a text and how its result is made.

    target: the shape of the result
    edge: the pose that moves it; None if nothing moves it, or if the pose depends on its stamp
    stamp: the path of the stamp or weight, or the paths of seconds and nanoseconds
    parent, name: the frames of its result
    """

    record: Record
    target: Shape
    edge: Rigid | None
    stamp: tuple[Path, ...] = ()
    parent: str | None = None
    name: str | None = None


class Answer(NamedTuple):
    """The result of a record: its components; has_gaps: some of them may be nan."""

    entry: Entry
    parts: Components
    has_gaps: bool = False


def _entry(document: Document, record: Record, request: Request) -> Entry:
    """Find the pose that moves a record, or the stamp for its look-up, and the frames of its result."""
    stamp: tuple[Path, ...] = ()
    edge = None
    timed, operation = request.timed, request.operation
    path_of = partial(key_path, {document.index: document.value}, record.path)
    if timed is not None and timed.name:
        stamp = (path_of((timed.name,)),)
    elif timed is not None and record.stamps and timed.moves(record.parent.text):
        stamp = record.stamps[:2]
    elif timed is not None and operation.formula is not None and not operation.shown:
        stamp = (path_of(),)
    elif (key := request.rows.stamp_or_weight_column) is not None and request.rows.stamps != NO_STAMPS:
        stamp = (not key and record.stamps[:2]) or (path_of((key,)) if key else path_of(),)
    elif request.pose_from_frame is not None:
        edge = request.pose_from_frame(record.parent.text)
    request = request.for_kind(record.shape.kind)
    parent, name = record.parent.text, record.name.text
    if request.rename is not None:
        parent, name = request.rename(parent, name)
    names = [each.representation.name for each in request.results.notations]
    # conventions of Euler angles share a key and must be neighbours
    together = sorted(request.results.notations, key=lambda each: names.index(each.representation.name))
    target = request.with_results(notations=tuple(together)).target(record.shape)
    return Entry(record, target, edge, stamp, parent, name)


def answer(entry: Entry, values: Mapping[int, Any], request: Request) -> Answer:
    """Compute the result of a record; values: the documents, in which its stamp is read.

    Raises ValueInvalid for an invalid rotation, FrametoolError without a pose at its stamp.
    """
    operation, shape, timed = request.operation, entry.record.shape, request.timed
    edge, at_ns = entry.edge, None
    if entry.stamp and (timed is not None or request.window):
        from frametool.frames.stamps import read_header_stamp, read_stamp

        key, stamp = str(entry.stamp[0][-1]), [str(value_at(values, path)) for path in entry.stamp]
        try:
            at_ns = read_header_stamp(*stamp) if stamp[1:] else read_stamp(stamp[0], in_ns=in_nanoseconds(key))
            if timed is not None and (operation.formula is None or operation.shown):
                edge = timed.pose(entry.record.parent.text, at_ns)
        except FrametoolError as error:
            error.column_name = timed.column if timed else key  # type: ignore[attr-defined]
            raise
    if request.window and at_ns is not None and not request.window[0] <= at_ns <= request.window[1]:
        raise Outside("beyond --start or --stop")
    parts = operation.result(
        shape, entry.record.values, edge, floats, times_ns=at_ns,
        rotation=lambda own: checked_rotation(shape, own, normalize=request.rows.normalize)[0],
    )  # fmt: skip
    return Answer(entry, parts, has_gaps=operation.shown is not None)


def wide_turn(made: Answer, operation: Operation) -> Finding | None:
    """Return the warning for a rotation too uncertain for the first order, unless the operation itself warns."""
    record = made.entry.record
    if operation.uncertain or len(operation.carried(record.shape)) < SIX_BY_SIX:
        return None
    from frametool.geometry.uncertainty import WIDE_RULE, doubt

    message = doubt(made.parts[-SIX_BY_SIX:])
    return Finding(WIDE_RULE, message, path=record.path) if message else None


def written(each: Answer) -> list[float]:
    """Return the numbers of a result as written; raises ValueInvalid for one that leaves the plane or is not finite."""
    target = each.entry.target
    for name, number in target.left_out(each.parts, floats):
        if abs(number) > FLAT:
            raise ValueInvalid(LEAVES_PLANE.format(name, number))
    if target.place is not None:
        target.place.check_result(*each.parts[:3])
    numbers = [number + 0.0 for number in target.written(each.parts, floats)]  # no -0.0
    if not all(map(isfinite, numbers)) and (not each.has_gaps or any(map(isinf, numbers))):
        raise ValueInvalid("the result is not finite: the numbers are too large")
    return numbers


class RecordText:
    """The records of a text and how their results are made.

    values: its documents by number; entries: its records
    notes: warnings about the records; edits: the edits that write results in place
    """

    def __init__(self, source: Source, request: Request, *, json: bool) -> None:
        """Read the records; raises FormatError with the place of one that cannot be read."""
        self.source, self.text, self.request, self.json = source, source.text, request, json
        self.notes, self.edits = list[Finding](), list[Any]()
        self.values, self.entries = dict[int, Any](), list[Entry]()
        rows = request.rows
        for document in json_documents(source) if json else parse_documents(source.text, source.name):
            self.values[document.index] = document.value
            reading = Reading(source, degrees=rows.degrees, normalize=rows.normalize, earth=request.earth)
            try:
                records = list(find_records(document.value, request, reading, (document.index,)))
                for note in reading.notes:
                    # the place of a rotation is that of its first number, as in blocks of rows
                    its = (each for each in records if note.rule == ROUNDED and each.path == note.path)
                    found = next((each for each in its if each.shape.notation), None)
                    path = found and found.numbers[found.shape.rotation_at[0]]
                    self.notes.append(note._replace(path=path) if path else note)
                for record in records:
                    self.entries.append(_entry(document, record, request))
            except Misfit as misfit:
                error = misfit.placed(source)
                error.column_name = ".".join(map(str, misfit.path[1:]))  # type: ignore[attr-defined]
                raise error from misfit

    @property
    def records(self) -> list[Record]:
        """Return the records."""
        return [entry.record for entry in self.entries]

    @cached_property
    def root(self) -> Node:
        """Return the nodes of the text, a list of documents."""
        return Node(0, len(self.text), parse_nodes(self.text))

    @cached_property
    def is_long(self) -> bool:
        """Return True if it has too many scalars to learn a template from."""
        return next(islice(self.root.leaves(), MOST_LEAVES, None), None) is not None

    @cached_property
    def line(self) -> int:
        """Return the line, from 0, of the first number of a pose."""
        paths = (path for entry in self.entries for path in entry.record.numbers if path is not None)
        return self.text.count("\n", 0, min((self.root.at(path).start for path in paths), default=0))

    def answers(self, parts: Sequence[Components] | None = None) -> list[Answer]:
        """Compute the results of the records within --start and --stop; raises Outside if all are outside.

        parts: the components of each result, if already computed
        """
        if parts is not None:
            return [Answer(*each) for each in zip(self.entries, parts, strict=True)]
        found = []
        for entry in self.entries:
            with suppress(Outside):
                found.append(answer(entry, self.values, self.request))
        if len(found) < len(self.entries) and (not found or not self.request.results.rewrite_records):
            raise ValueInvalid(CUT) if found else Outside("beyond --start or --stop")
        return found

    def starts(self, begin: int, answers: Sequence[Answer]) -> Iterator[int]:
        """Yield the byte at which each record begins, if the text begins at `begin`."""
        at = 0
        for each in answers:
            start = self.root.at(each.entry.record.path).start
            begin, at = begin + len(self.text[at:start].encode()), max(at, start)
            yield begin

    @property
    def lost(self) -> str:
        """Return a frame of a record whose result has no frames, else ""."""
        for record, _, _, _, parent, name in self.entries:
            if parent is None and name is None and (lost := record.parent.text or record.name.text):
                return lost
        return ""

    def notes_at(self, line: int, column: int, answers: Sequence[Answer] = ()) -> list[RowNote]:
        """Return all warnings about the records and their results, each with its place.

        line, column: the start of the text; lines count from 0
        """
        begin, found = Source("", self.text, line, column), list[RowNote]()
        places = locate_many(self.text, [note.path for note in self.notes]) if self.notes else ()
        for note, at_char in zip(self.notes, places, strict=True):
            at, there = begin.place(*at_char)
            found.append(RowNote(at, note.rule, note.message, str(there)))
        if self.lost:
            found.append(RowNote.of_lost_name(line + self.line, self.lost))
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
    """Read strict JSON; syntax that only YAML allows is an error."""
    check_text(source)
    values = strict_json(source)
    return [Document(value, index, source) for index, value in enumerate(values) if value is not None]


# --- results as values ---


def read_poses(source: Source, asked: Request) -> list[Pose]:
    """Return all poses of a text, at least one.

    asked: sets the unit of bare angles, the check of rotations, and whether scales are accepted
    Raises FormatError with the place.
    """
    return read_given(source, asked)[0]


def read_given(source: Source, asked: Request) -> tuple[list[Pose], set[str]]:
    """Return all poses of a text as `read_poses` does, and the other keys of their records."""
    own = RowOptions(kind=POSE, degrees=asked.rows.degrees, normalize=asked.rows.normalize)
    request = Request(asked.operation, own)
    poses: list[Pose] = []
    extra: set[str] = set()
    known = read_text(source, request)
    for record in known.records:
        poses.append(pose_of(record, request)._replace(stamp_ns=stamp_of(known.values, record, source)))
        own, keys = value_at(known.values, record.path), record.keys
        ours = {keys.position, keys.rotation, *keys.flat, *keys.members}
        if record.path[1:] or type(own) is list or not ours.issuperset(own):  # else the nodes are not needed
            extra.update(_header_stamp(record), _rest(known.root, record))
    if not poses:
        raise FormatError("nothing in it; a pose is {xyz: [x, y, z], rpy_deg: [roll, pitch, yaw]}", source=source.name)
    return poses, extra


def stamp_of(documents: dict[int, Any], record: Record, source: Source) -> int | None:
    """Return the stamp of a record's header, or its own; raises FormatError with its place."""
    own = value_at(documents, record.path)
    if record.stamp_ns is not None or type(own) is not dict:
        return record.stamp_ns
    try:
        return with_stamp_ns({**own}, "").get("stamp_ns")
    except Misfit as misfit:
        raise misfit.below(*record.path).placed(source) from None


def read_text(source: Source, request: Request) -> RecordText:
    """Read the records of a text and emit the warnings about them."""
    known = RecordText(source, request, json=False)
    tell(source, known.notes)
    return known


def results(source: Source, request: Request, style: Style) -> Iterator[Value]:
    """Yield the results of all records of a text: poses with the other fields of their records, or mappings.

    Raises FormatError with the place of a record that cannot be read or that has no result.
    """
    if request.operation.looks_back:
        raise Misused("rows are compared with those before them in streams; pipe them in as JSON lines, YAML or CSV")
    request = request.with_results(rewrite_records=True)
    known = read_text(source, request)
    if known.lost:
        warn(f"{source.name}: frame {shown(known.lost)} is left out: the frames of the result are not known")
    answers = []
    for entry in known.entries:
        try:
            with suppress(Outside):
                answers.append(answer(entry, known.values, request))
        except ValueInvalid as error:  # a valid record without a result
            misfit = error if isinstance(error, Misfit) else NotARotation(str(error), entry.record.path)
            raise misfit.placed(known.source) from misfit
    if warning := next(filter(None, (wide_turn(each, request.operation) for each in answers)), None):
        tell(source, [warning])
    yield from values_of_text(known, answers, style)


def values_of_text(known: RecordText, answers: Sequence[Answer], style: Style) -> Iterator[Value]:
    """Yield the results of a text as values; raises FormatError for an alias and for an empty text."""
    units: dict[Path, list[Answer]] = {}
    for each in answers:
        units.setdefault(_unit_of(each.entry.record), []).append(each)
    for ours in units.values():
        try:
            yield from values_of_unit(known.root, ours, known.request, style)
        except Aliased as error:
            raise error.in_text(known.text) from None
    if not known.values:
        raise FormatError("nothing in it", source=known.source.name)


def _unit_of(record: Record) -> Path:
    """Return the path of the value that a record's result replaces: the document, or an item of its list."""
    return record.path[: 1 + (len(record.path) > 1 and type(record.path[1]) is int)]


def values_of_unit(root: Node, answers: list[Answer], request: Request, style: Style) -> Iterator[Value]:
    """Yield the results of one document or item: a pose or a mapping for each record in it."""
    is_one = not answers[1:] or not request.operation.moves
    if not is_one and len({each.entry.record.path for each in answers}) < len(answers):
        yield _of_several(root, answers, request)
        return
    for each in answers:
        yield _result(root, each, request, style.format)


def _of_several(root: Node, answers: list[Answer], request: Request) -> dict[str, Any]:
    """Return the results of several fields of one message, such as an Imu, as a flat mapping with a key per number."""
    last = answers[-1].entry  # an unknown orientation is the first, and unchanged
    found = {"frame": last.parent} | _header_stamp(last.record) | _rest(root, last.record)
    for each in answers:
        record, numbers = each.entry.record, written(each)[: each.entry.target.own_size]
        field = record.keys.position or record.keys.rotation
        if numbers:
            found.pop(field, None)
        found |= {f"{field}_{axis}": number for axis, number in zip("xyzw", numbers, strict=False)}
        found |= _extras(each, request)
    return found


def _header_stamp(record: Record) -> dict[str, int]:
    """Return the stamp of a message's header, if it has one."""
    return {} if record.stamp_ns is None else {"stamp_ns": record.stamp_ns}


def _result(root: Node, made: Answer, request: Request, fmt: str) -> Value:
    """Return the result of a record with its frames and other fields: a pose, or a flat mapping."""
    (entry, parts, _), operation, extras = made, request.operation, _extras(made, request)
    record, target, kind = entry.record, entry.target, operation.result_kind(entry.record.shape.kind)
    if operation.formula is not None:
        if operation.shown is not None:
            cells = tuple(extras.values())
            members = operation.shown.values(request.results.prefix, cells)
            extras = operation.shown.cells([*extras], cells) if fmt == "csv" else members
        if operation.only_adds:
            node = root.at(_unit_of(record))
            return with_stamp_ns(plain(node), fmt) | extras if type(node.value) is dict else extras
    said = _header_stamp(record) | extras | with_stamp_ns(_rest(root, record), fmt) | extras  # new ones count
    seen_from = "frame" if kind or record.shape.kind != POSE else "parent"
    named = {key: name for key, name in (("name", entry.name), (seen_from, entry.parent)) if name is not None}
    if kind in (POSE, ROTATION):
        placed, turned = target.unit is not None or target.whole, bool(target.notations)
        # a vector that is not rotated has no position
        if record.keys.position == VECTOR and placed and not turned and operation.keeps_frames:
            return named | {VECTOR: [*parts[:3]]} | said
        pose = Pose.of(parts[:7], entry.name, entry.parent)
        pose = pose._replace(position=pose.position if placed else None, rotation=pose.rotation if turned else None)
        if operation.similar and isinstance(said.get(SCALE), float):
            pose = pose._replace(scale=said.pop(SCALE))
        return Result(pose, said)
    values = written(made)[: target.own_size]
    place: dict[str, Any] = dict(zip(PARTS.get(kind, (kind,)), (values[:3], values[3:]), strict=False)) if kind else {}
    if target.place is not None:
        from frametool.grammar.place import point_entry

        named.pop(seen_from, None)  # which is in the geodetic position
        place = point_entry(entry.parent, parts[:3], target.place, getattr(parts, "read", None))
    if holds(fmt, "recording") and operation.keeps_frames:  # which writes lat, lon and alt as they were read
        from frametool.grammar.place import LLA_KEYS, read_at

        keys = [key for key in (*record.keys.members, *record.keys.placed) if key in LLA_KEYS]
        lla = {key: str(plain(root.at((*record.path, key)))) for key in keys}
        at, numbers = read_at(lla, Reading(Source("", ""))) if lla else (None, ())
        place |= {} if at is None else {AS_READ: [*at.lla(numbers)]}
    return named | place | said


def with_stamp_ns(extras: dict[str, Any], fmt: str) -> dict[str, Any]:
    """Convert the stamp of a record to `stamp_ns`, unless the format preserves it as it is written.

    Raises ValueInvalid for an invalid time.
    """
    key = stamp_key(extras)
    is_spelled = fmt in SPELLED and (fmt != "csv" or type(extras[key]) is not dict) if key else False
    if not key or (key != "stamp_ns" and is_spelled):
        return extras
    value = extras.pop(key)
    if type(value) is dict:
        from frametool.ros.messages import read_stamp

        return extras | {"stamp_ns": within((key,), read_stamp, value)}
    from frametool.frames.stamps import read_stamp as read

    return extras | {"stamp_ns": within((key,), read, str(value), in_ns=in_nanoseconds(key))}


def at_time(value: Value, timed: dict[str, Any]) -> Value:
    """Return a result with a stamp: its own as written, else `timed`; without a stamp if `timed` is {}."""
    if not isinstance(value, Result):
        return value
    key = stamp_key(value.extras)
    if key and timed:
        return value
    return type(value)(value.pose, timed | {name: each for name, each in value.extras.items() if name != key})


def stamp_key(members: dict[str, Any]) -> str:
    """Return the key of a mapping's own stamp, "" if absent."""
    keys = [key for key, value in members.items() if value is not None and type(value) is not list]
    at = None if "stamp_ns" in keys else stamp_column(keys)
    return "stamp_ns" if "stamp_ns" in keys else "" if at is None else keys[at]


def _rest(root: Node, record: Record) -> dict[str, Any]:
    """Return the other fields of a record and of the mappings around it, without pose, frames and header."""
    keys, used = record.keys, {"angles", "inverse", *PARTS.get(record.shape.kind, ())}
    used |= {keys.position, keys.rotation, *keys.others, *keys.flat, *keys.members, *keys.placed}
    names, rest = {*record.name.paths, *record.parent.paths}, dict[str, Any]()
    for depth in range(len(_unit_of(record)), len(record.path) + 1):
        path = record.path[:depth]
        holder = root.at(path)
        if type(holder.value) is not dict:
            continue
        on_the_way = {*record.path[depth : depth + 1], "header", *keys.covariances}
        used |= outdated(holder.value)
        for key, (_, value) in holder.value.items():
            is_used = key in on_the_way or (*path, key) in names or (path == record.path and key in used)
            if not is_used and key not in rest:
                rest[key] = plain(value)
    return rest


def _extras(made: Answer, request: Request) -> dict[str, Any]:
    """Return the extra numbers of a result by key: a distance, covariances, a scale."""
    shape = made.entry.record.shape
    names, sizes = request.operation.extras(shape), () if shape.rewritten else shape.covariance
    numbers = iter(made.parts[len(made.parts) - len(names) - sum(sizes) :])  # the covariances come last
    found = {request.results.prefix + name: number + 0.0 for name, number in zip(names, numbers, strict=False)}
    extras: dict[str, Any] = found if request.operation.shown else with_entries(found)
    for key, size in zip(made.entry.record.keys.covariances, sizes, strict=False):
        entries = [number + 0.0 for number in islice(numbers, size)]
        extras[key] = entries if size > 1 else entries[0]
    return extras


def plain(node: Node) -> Any:
    """Return a node as a plain value; numbers and booleans keep their text."""
    if type(node.value) is dict:
        return {key: plain(value) for key, (_, value) in node.value.items()}
    if type(node.value) is list:
        return [plain(item) for item in node.value]
    refuse_alias(node)
    return node.value if node.quote or node.value is None else plain_text(node.value, "")


def plain_text(text: str, quote: str) -> Any:
    """Return the text of a scalar without its quotes as a plain value; numbers and booleans keep their text."""
    if quote:
        return plain(parse_nodes(f"{quote}{text}{quote}")[0]) if "\\" in text else text
    if text in ("null", "~", ""):
        return None
    return Verbatim(text) if text in ("true", "false") or re.fullmatch(JSON_NUMBER, text) else text
