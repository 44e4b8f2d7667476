"""Records of a whole text and their results as values: for arguments, for files, and for output in another format.

The records, the operation and what is said of them are those of streams; only the text is not kept.
"""

from __future__ import annotations

import re
from contextlib import suppress
from itertools import islice
from typing import TYPE_CHECKING, Any

from frametool.documents.document import Aliased, Node, parse_nodes, refuse_alias
from frametool.documents.json import JSON_NUMBER
from frametool.documents.source import Source, Verbatim
from frametool.errors import FormatError, Misused, ValueInvalid, shown, warn
from frametool.formats.table import is_recording
from frametool.grammar.pose import SCALE, Pose
from frametool.grammar.readers import Misfit, NotARotation, Path, Reading, in_nanoseconds, stamp_column, tell
from frametool.grammar.result import Result, Style, with_entries
from frametool.stream.record import STALE, Record, pose_of, value_at
from frametool.stream.record_text import Answer, Outside, RecordText, wide_turn, written
from frametool.stream.request import Request, RowOptions
from frametool.stream.row_layout import AS_READ, PARTS, POSE, ROTATION, VECTOR
from frametool.stream.stamp_source import read_stamp

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    Value = Result | dict[str, Any]

SPELLED = ("yaml", "json", "csv")  # formats in which other keys keep their names
NOT_PLAIN = frozenset((*STALE, "angles", "inverse"))


def read_poses(source: Source, asked: Request) -> list[Pose]:
    """Return every pose of a text, in order; at least one.

    asked: the unit of bare angles, what counts as a rotation, the operation, which may not take all that records say
    Raises FormatError with the place.
    """
    return read_given(source, asked)[0]


def read_given(source: Source, asked: Request) -> tuple[list[Pose], set[str]]:
    """Return every pose of a text as `read_poses` does, and the keys that come with any of them."""
    own = RowOptions(kind=POSE, degrees=asked.rows.degrees, normalize=asked.rows.normalize)
    request = Request(asked.operation, own, gathered=asked.gathered)
    poses: list[Pose] = []
    extra: set[str] = set()
    known = read_text(source, request)
    for record in known.records:
        poses.append(pose_of(record, request)._replace(stamp_ns=stamp_of(known.values, record, source)))
        unit = unit_of(record, value_at(known.values, record.path[:1]))
        extra.update(_header_stamp(record), _rest(known.root.at(unit), unit, record))
    if not poses:
        raise FormatError("nothing in it; a pose is {xyz: [x, y, z], rpy_deg: [roll, pitch, yaw]}", source=source.name)
    return poses, extra


def stamp_of(documents: dict[int, Any], record: Record, source: Source) -> int | None:
    """Return the stamp of a record, of its header or its own; raises FormatError with its place."""
    own = value_at(documents, record.path)
    key = stamp_key(own) if record.stamp_ns is None and type(own) is dict else ""
    try:
        return _read_stamp(key, own[key]) if key else record.stamp_ns
    except ValueInvalid as error:
        raise Misfit(str(error), (*record.path, key)).placed(source) from None


def read_text(source: Source, request: Request) -> RecordText:
    """Read the records of a text, and warn of what is invalid in them, with its place."""
    known = RecordText(source, request, json=False)
    tell(source, known.notes)
    return known


def results(source: Source, request: Request, style: Style) -> Iterator[Value]:
    """Yield the results of every record of a text in a format: poses with what else their records say, or messages.

    Raises FormatError with the place of a record that cannot be read or has no result.
    """
    if request.operation.looks_back:
        raise Misused("rows are compared with those before them in streams; pipe them in as JSON lines, YAML or CSV")
    known = read_text(source, request.with_results(canonical=True))
    if lost := next((entry.lost for entry in known.entries if entry.lost), ""):
        warn(f"{source.name}: frame {shown(lost)} is left out: the frames of the result are not known")
    answers = []
    for entry in known.entries:
        try:
            with suppress(Outside):
                answers.append(known.answer(entry))
        except ValueInvalid as error:  # what was read well has no result
            misfit = error if isinstance(error, Misfit) else NotARotation(str(error), entry.record.path)
            raise misfit.placed(known.source) from misfit
    if warning := next(filter(None, (wide_turn(each, request.operation) for each in answers)), None):
        tell(source, [warning])
    yield from values_of_text(known, answers, style)


def values_of_text(known: RecordText, answers: Sequence[Answer], style: Style) -> Iterator[Value]:
    """Yield the results of a text as values; raises FormatError for an alias, and where nothing is in it."""
    units: dict[Path, list[Answer]] = {}
    for each in answers:
        record = each.entry.record
        units.setdefault(unit_of(record, value_at(known.values, record.path[:1])), []).append(each)
    for unit, ours in units.items():
        try:
            yield from values_of_unit(known.root.at(unit), unit, ours, known.request, style)
        except Aliased as error:
            raise error.in_text(known.text) from None
    if not known.values:
        raise FormatError("nothing in it", source=known.source.name)


def unit_of(record: Record, document: Any) -> Path:
    """Return the path of the thing that a record's result is: the document, or an item of the list it is."""
    return record.path[: 1 + (type(document) is list and len(record.path) > 1)]


def values_of_unit(node: Node, unit: Path, answers: list[Answer], request: Request, style: Style) -> Iterator[Value]:
    """Yield what one document or item becomes: a pose, or a mapping, for each record in it."""
    is_one = len({each.entry.record.path for each in answers}) < len(answers)  # of several things, as an Imu
    if request.operation.moves and is_one:
        yield _of_several(node, unit, answers, request)
        return
    for each in answers:
        if request.operation.formula is not None:
            yield _formula_result(node, unit, each, request, style.format)
        elif each.entry.record.shape.kind in (POSE, ROTATION):
            yield _pose_result(node, unit, each, request, style)
        else:
            yield _flat(node, unit, each, request, style.format)


def _formula_result(node: Node, unit: Path, made: Answer, request: Request, fmt: str) -> Value:
    """Return what an expression made of a record, with what else the record says."""
    entry, operation = made.entry, request.operation
    shape = entry.record.shape
    kind = operation.result_kind(shape.kind)
    names = [request.results.prefix + name for name in request.extras(shape)]
    extras: dict[str, Any] = dict(zip(names, made.parts[len(made.parts) - len(names) :], strict=True))
    if operation.shown is not None:
        numbers = tuple(extras.values())
        members = operation.shown.values(request.results.prefix, numbers)
        extras = operation.shown.cells(names, numbers) if fmt == "csv" else members
    if operation.only_adds:
        return with_stamp_ns(plain(node), fmt) | extras if type(node.value) is dict else extras
    rest = with_stamp_ns(_rest(node, unit, entry.record), fmt)
    if kind == POSE:
        stamp = _header_stamp(entry.record) if not request.rows.poses else {}
        return Result(Pose.of(made.parts[:7], entry.name, entry.parent), stamp | extras | rest)
    seen_from = "frame" if kind or shape.kind != POSE else "parent"
    named = {key: name for key, name in (("name", entry.name), (seen_from, entry.parent)) if name is not None}
    return named | ({kind: list(made.parts[:3])} if kind else {}) | extras | rest


def _header_stamp(record: Record) -> dict[str, int]:
    """Return the stamp of a message's header, if it has one."""
    return {} if record.stamp_ns is None else {"stamp_ns": record.stamp_ns}


def _pose_result(node: Node, unit: Path, made: Answer, request: Request, style: Style) -> Value:
    """Return a pose with its frames and what else its record says; a vector that nothing turns stays one."""
    entry = made.entry
    record = entry.record
    pose = Pose.of(made.parts[:7], entry.name, entry.parent)
    placed, turned = entry.target.unit is not None or entry.target.whole, bool(entry.target.notations)
    pose = pose._replace(position=pose.position if placed else None, rotation=pose.rotation if turned else None)
    extras = _extras(made, request, 7) | _rest(node, unit, record)
    if record.key == VECTOR and placed and not turned and request.operation.keeps_frames:  # it is at no place
        named = {} if entry.parent is None else {"frame": entry.parent}
        return named | {VECTOR: [*made.parts[:3]]} | _header_stamp(record) | with_stamp_ns(extras, style.format)
    if request.operation.similar and isinstance(extras.get(SCALE), float):
        pose = pose._replace(scale=extras.pop(SCALE))
    return Result(pose, _header_stamp(record) | with_stamp_ns(extras, style.format))


def with_stamp_ns(extras: dict[str, Any], fmt: str) -> dict[str, Any]:
    """Read the stamp that a record says, in whole seconds and nanoseconds too, unless its format keeps it as it is.

    Raises ValueInvalid for what is no time.
    """
    key = stamp_key(extras)
    is_spelled = fmt in SPELLED and (fmt != "csv" or type(extras[key]) is not dict) if key else False
    if not key or (key != "stamp_ns" and is_spelled):
        return extras
    return extras | {"stamp_ns": _read_stamp(key, extras.pop(key))}


def at_time(value: Value, timed: dict[str, Any]) -> Value:
    """Return a result with a stamp, or without any; its own stays as it is written if there is to be one."""
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


def _read_stamp(key: str, value: Any) -> int:
    """Read a stamp as its key says, or as whole seconds and nanoseconds; raises ValueInvalid."""
    if type(value) is dict:
        from frametool.ros import messages

        return messages.read_stamp(value)
    return read_stamp(str(value), in_ns=in_nanoseconds(key))


def _rest(node: Node, unit: Path, record: Record) -> dict[str, Any]:
    """Return what a record and the mappings around it say besides the pose, its frames and its stamp.

    node: the thing that the record's result is; unit: the path of that
    """
    # its pose, and what is no longer true of the result
    used = {record.key, record.rotation, *record.others, *record.flat, *record.members, *record.placed, *NOT_PLAIN}
    used.update(PARTS.get(record.shape.kind, ()))
    names = {path for each in (record.name, record.parent) for path in each.paths}
    rest: dict[str, Any] = {}
    for depth in range(len(unit), len(record.path) + 1):
        path = record.path[:depth]
        holder = node.at(path[len(unit) :])
        if type(holder.value) is not dict:
            continue
        on_the_way = {*record.path[depth : depth + 1], "header", *record.covariances}
        for key, (_, value) in holder.value.items():
            is_used = key in on_the_way or (*path, key) in names or (path == record.path and key in used)
            if not is_used and key not in rest:
                rest[key] = plain(value)
    return rest


def _flat(node: Node, unit: Path, made: Answer, request: Request, fmt: str) -> dict[str, Any]:
    """Return a point, vector, twist or wrench as a mapping without levels, with what else its record says."""
    entry = made.entry
    kind = entry.record.shape.kind
    named: dict[str, Any] = {"frame": entry.parent} if entry.parent is not None else {}
    numbers = written(made)[: entry.target.size]
    extra = _extras(made, request, len(numbers))
    if kind in PARTS:
        named |= dict(zip(PARTS[kind], (numbers[:3], numbers[3:]), strict=True))
    elif entry.target.place is not None:
        from frametool.grammar.place import point_entry

        named = point_entry(entry.parent, made.parts[:3], entry.target.place, getattr(made.parts, "read", None))
    else:
        named[kind] = numbers
    if is_recording(fmt) and request.operation.keeps_frames:
        holder = node.at(entry.record.path[len(unit) :])
        named |= {AS_READ: read} if (read := _place_as_read(holder, entry.record)) else {}
    rest = with_stamp_ns(_rest(node, unit, entry.record), fmt)
    return ({"name": entry.name} if entry.name else {}) | named | _header_stamp(entry.record) | extra | rest


def _place_as_read(node: Node, record: Record) -> list[float]:
    """Return lat, lon and alt where a record says them; [] elsewhere."""
    from frametool.grammar.place import LLA_KEYS, read_at

    keys = [key for key in (*record.members, *record.placed) if key in LLA_KEYS]
    if not keys:
        return []
    place, numbers = read_at({key: str(plain(node.at((key,)))) for key in keys}, Reading(Source("", "")))
    return [*place.lla(numbers)]


def _of_several(node: Node, unit: Path, answers: list[Answer], request: Request) -> dict[str, Any]:
    """Return a message of several things as a mapping without levels, a key for each of their numbers."""
    last = answers[-1].entry  # of the first, an orientation, nothing may be known: then it stays
    found = {"frame": last.parent} | _header_stamp(last.record) | _rest(node, unit, last.record)
    for each in answers:
        record, numbers = each.entry.record, written(each)[: each.entry.target.size]
        field = record.key or record.rotation
        if numbers:
            found.pop(field, None)
        found |= {f"{field}_{axis}": number for axis, number in zip("xyzw", numbers, strict=False)}
        found |= _extras(each, request, len(each.parts) - sum(record.shape.covariance))
    return found


def _extras(made: Answer, request: Request, own: int) -> dict[str, Any]:
    """Return what a result says behind its own numbers, by its keys: a distance, its covariances, a scale."""
    shape = made.entry.record.shape
    numbers = iter([number + 0.0 for number in made.parts[own:]])
    extras = with_entries({name: next(numbers) for name in request.operation.extras(shape)})
    for key, size in zip(made.entry.record.covariances, shape.covariance, strict=False):
        entries = list(islice(numbers, size))
        extras[key] = entries if size > 1 else entries[0]
    return extras


def plain(node: Node) -> Any:
    """Return a node as a plain value; numbers and truth values keep their text."""
    if type(node.value) is dict:
        return {key: plain(value) for key, (_, value) in node.value.items()}
    if type(node.value) is list:
        return [plain(item) for item in node.value]
    refuse_alias(node)
    if node.quote or node.value is None:
        return node.value
    return plain_scalar(node.value)


def plain_scalar(text: str) -> str | Verbatim | None:
    """Return a scalar without quotes as a plain value: numbers and truth values keep their text."""
    if text in ("null", "~", ""):
        return None
    return Verbatim(text) if text in ("true", "false") or re.fullmatch(JSON_NUMBER, text) else text


def plain_text(text: str, quote: str) -> Any:
    """Return the text within the quotes of a scalar as a plain value."""
    if not quote:
        return plain_scalar(text)
    return plain(parse_nodes(f"{quote}{text}{quote}")[0]) if "\\" in text else text
