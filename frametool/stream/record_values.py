"""Records of a whole text and their results as values: for arguments, for files, and for output in another form.

The records, the operation and what is said of them are those of streams; only the text is not kept.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import parse_documents
from frametool.documents.json import JSON_NUMBER, Verbatim
from frametool.documents.source import Source, decode
from frametool.errors import FormatError, FrametoolError, ValueInvalid, shown, warn
from frametool.formats.table import is_trajectory
from frametool.formats.trees.tree_reader import tell
from frametool.frames.stamps import BILLION, parse_stamp
from frametool.geometry import floats
from frametool.grammar.names import in_nanoseconds
from frametool.grammar.pose import Pose, inverted
from frametool.grammar.readers import Misfit, Reading
from frametool.grammar.result import Result
from frametool.stream.record import PARTS, STALE, XYZ, find_records, lost_name, placed, value_at
from frametool.stream.request import Memory, Request
from frametool.stream.row_layout import COVARIANCE, POINT, POSE, SIX, VECTOR
from frametool.stream.scalar import checked_rotation, moved
from frametool.stream.stamp_source import key_path, read_header_stamp, read_stamp, stamp_keys

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.document import Document, Node
    from frametool.geometry.types import Components, Rigid
    from frametool.grammar.readers import Path
    from frametool.grammar.result import Style
    from frametool.stream.faults import BadRows
    from frametool.stream.record import Record
    from frametool.text.lines import ByteStream

    Value = Result | dict[str, Any]

MESSAGES = ("yaml", "json", "ros1", "ros2")  # forms that can hold a message with all its fields
MOST_TOLD = 3  # of what is odd by one rule in one text
NOT_PLAIN = frozenset((*STALE, "angles", "inverse"))


class Answer(NamedTuple):
    """A record and what became of it: the components of its result, and the frames it then names."""

    record: Record
    parts: Components
    parent: str | None
    name: str | None


def read_poses(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[Pose]:
    """Return every pose of a text, in order; at least one.

    degrees: the unit of bare angles.  normalize: accept any non-zero quaternion and any matrix near a rotation.
    Raises FormatError with the place.
    """
    request = Request(kind=POSE, degrees=degrees, normalize=normalize)
    poses = [pose_of(record, request) for _, records in documents(source, request) for record in records]
    if not poses:
        raise FormatError("nothing in it; a pose is {xyz: [x, y, z], rpy_deg: [roll, pitch, yaw]}", source=source.name)
    return poses


def pose_of(record: Record, request: Request) -> Pose:
    """Return a record as a named pose; position or rotation is None where it has none."""
    shape = record.shape
    rotation = None
    if shape.notation is not None:
        rotation, _ = checked_rotation(shape, record.values, normalize=request.normalize)
    placed_at = shape.whole or shape.unit is not None
    pose = Pose(shape.position(record.values) if placed_at else None, rotation, record.name.text, record.parent.text)
    return inverted(pose) if record.inverse else pose


def documents(source: Source, request: Request) -> Iterator[tuple[Document, list[Record]]]:
    """Yield the documents of a text with their records, and warn of what is odd in them, with its place.

    What is odd in many poses, by one rule, is told of the first few and then counted.
    """
    told: Counter[str] = Counter()
    for document in parse_documents(source.text, source.name):
        reading = Reading(source, degrees=request.degrees, normalize=request.normalize)
        try:
            records = list(find_records(document.value, request, reading, (document.index,)))
        except Misfit as misfit:
            raise placed(misfit, source) from misfit
        new = []
        for note in reading.notes:
            told[note.rule] += 1
            if told[note.rule] <= MOST_TOLD:
                new.append(note)
        tell(source, new)
        yield document, records
    if more := sum(max(count - MOST_TOLD, 0) for count in told.values()):
        warn(f"{source.name}: {more} more like these")


def results(source: Source, request: Request, style: Style, memory: Memory | None = None) -> Iterator[Value]:
    """Yield the results of every record of a text in a form: poses with what else their records say, or messages.

    memory: of the records before this text.
    Raises FormatError with the place of a record that cannot be read or has no result.
    """
    from frametool.documents.document import NOTHING, parse_nodes

    nodes: list[Node] = []
    found = False
    memory = memory or Memory()
    for document, records in documents(source, request):
        found = True
        read = [_answer(document, record, request, source, memory) for record in records]
        answers = [answer for answer in read if answer is not None]
        for unit in dict.fromkeys(_unit(answer.record, document.value) for answer in answers):
            ours = [answer for answer in answers if answer.record.path[: len(unit)] == unit]
            if all(_says_no_more(answer.record, document, unit) for answer in ours):
                yield from _values(NOTHING, unit, ours, request, style, source)
                continue
            nodes = nodes or parse_nodes(source.text)
            yield from _values(_at(nodes, unit), unit, ours, request, style, source)
    if not found:
        raise FormatError("nothing in it", source=source.name)


def _unit(record: Record, document: Any) -> Path:
    """Return the path of the thing that a record's result is: the document, or an item of the list it is."""
    return record.path[: 1 + (type(document) is list and len(record.path) > 1)]


def _answer(
    document: Document, record: Record, request: Request, source: Source, memory: Memory
) -> Answer | None:
    """Apply the operation to one record; the first of all has no velocity and so no result."""
    request = request.for_kind(record.shape.kind)
    try:
        parent, name = record.parent.text, record.name.text
        if request.rename is not None:
            if lost := lost_name(record, request):
                warn(f"{source.name}: frame {shown(lost)} is left out: the frames of the result are not known")
            parent, name = request.rename(parent, name)
        if request.operation.formula is not None:
            at_ns = _asked_time(record, request, source)
            parts, _ = moved(record, None, record.values, request, at_ns)
        else:
            parts, _ = moved(record, _edge(record, request, source), record.values, request, memory=memory)
        if request.operation.velocity:
            seconds = memory.step(_beside_ns(document, record, request))
            if seconds is None:
                return None
            parts = request.operation.with_velocity(parts, seconds, floats)
    except Misfit as misfit:
        raise placed(misfit, source) from misfit
    except ValueInvalid as error:
        raise placed(Misfit(str(error), record.path), source) from error
    return Answer(record, parts, parent, name)


def _beside_ns(document: Document, record: Record, request: Request) -> int:
    """Return the stamp that stands beside a record."""
    from frametool.stream.template import beside_path

    paths = beside_path(document, record, request.beside or "")
    texts = [str(value_at(document.value, path[1:])) for path in paths]
    return read_header_stamp(*texts) if len(texts) > 1 else read_stamp(*texts, in_ns=in_nanoseconds(str(paths[0][-1])))


def _edge(record: Record, request: Request, source: Source) -> Rigid | None:
    """Find the pose that moves a record, at the time its header says where that matters."""
    timed = request.timed
    if timed is not None and record.stamp and timed.moves(record.parent.text):
        return timed.pose(record.parent.text, stamp_of(record, source))
    return None if request.way is None else request.way(record.parent.text)


def _asked_time(record: Record, request: Request, source: Source) -> int | None:
    """Return the time of a record where an expression looks up at it."""
    timed = request.timed
    if timed is None:
        return None
    if record.stamp and not timed.name:
        return stamp_of(record, source)
    document = next(each for each in parse_documents(source.text, source.name) if each.index == record.path[0])
    path = record.path[1:]
    found = key_path(document.value, path, timed.name) if timed.name else stamp_keys(document.value, path)
    key = timed.name or str(found[-1])
    return read_stamp(value_at(document.value, found), in_ns=timed._replace(name=key).in_ns)


def stamp_of(record: Record, source: Source) -> int:
    """Return the stamp of a record's header."""
    values = {document.index: document.value for document in parse_documents(source.text, source.name)}
    seconds, below = (int(value_at(values, path)) for path in record.stamp)
    return seconds * BILLION + below


def _values(
    node: Node, unit: Path, answers: list[Answer], request: Request, style: Style, source: Source
) -> Iterator[Value]:
    """Yield what one document or item becomes: itself with new numbers, or a pose for each record in it."""
    inside = any(type(step) is str for answer in answers for step in answer.record.path[len(unit) :])
    keeps = not request.notations or [form.spec for form in style.notations] == ["quaternion"]
    if inside and style.form in MESSAGES and keeps and request.operation.moves:
        yield _rewritten(node, unit, answers, request)
        return
    for answer in answers:
        record = answer.record
        if request.operation.formula is not None:
            yield _formula_result(node, unit, answer, request)
        elif record.shape.kind == POSE:
            made = _pose_result(node, unit, answer, request)
            if is_trajectory(style.form):
                _keep_stamp(made, node, unit, record, source)
            yield made
        elif style.form == "csv" or (style.form == "text" and record.shape.kind not in PARTS):
            yield _flat(answer, request)
        else:
            yield _rewritten(node, unit, [answer], request)


def _keep_stamp(result: Result, node: Node, unit: Path, record: Record, source: Source) -> None:
    """Put the stamp of a record's header, or that it says under `stamp` or `stamp_ns`, where lookups have theirs."""
    said = {key: result.extras.pop(key, None) for key in ("stamp", "stamp_ns")}
    try:
        if record.stamp:
            seconds, below = (int(str(node.at(path[len(unit) :]).value)) for path in record.stamp)
            result.extras["stamp_ns"] = seconds * BILLION + below
        elif said["stamp_ns"] is not None:
            result.extras["stamp_ns"] = parse_stamp(f"{said['stamp_ns']}ns")
        elif said["stamp"] is not None:
            result.extras["stamp_ns"] = parse_stamp(str(said["stamp"]))
    except ValueInvalid as error:
        raise placed(Misfit(str(error), record.path), source) from None


def _formula_result(node: Node, unit: Path, answer: Answer, request: Request) -> Value:
    """Return what an expression made of a record, with what else the record says."""
    shape, operation = answer.record.shape, request.operation
    kind = operation.result_kind(shape.kind)
    names = [request.prefix + name for name in operation.extras(shape.kind)]
    extras: dict[str, Any] = dict(zip(names, answer.parts[len(answer.parts) - len(names) :], strict=True))
    if operation.only_adds:
        return plain(node) | extras if type(node.value) is dict else extras
    rest = _rest(node, unit, answer.record)
    if kind == POSE:
        stamp = _header_stamp(node, unit, answer.record) if not request.poses else {}
        return Result(Pose.of(answer.parts[:7], answer.name, answer.parent), stamp | extras | rest)
    seen_from = "frame" if kind or shape.kind != POSE else "parent"
    named = {key: name for key, name in (("name", answer.name), (seen_from, answer.parent)) if name is not None}
    return named | ({kind: list(answer.parts[:3])} if kind else {}) | extras | rest


def _header_stamp(node: Node, unit: Path, record: Record) -> dict[str, int]:
    """Return the stamp of a message's header, if it has one."""
    if not record.stamp:
        return {}
    seconds, below = (int(node.at(path[len(unit) :]).value) for path in record.stamp)
    return {"stamp_ns": seconds * BILLION + below}


def _pose_result(node: Node, unit: Path, answer: Answer, request: Request) -> Result:
    """Return a pose with its frames and what else its record says."""
    shape = answer.record.shape
    operation = request.operation
    pose = Pose.of(answer.parts[:7], answer.name, answer.parent)
    if operation.keeps_position or operation.only_inverts or operation.turns:
        has_position = shape.whole or shape.unit is not None
        has_rotation = shape.notation is not None or operation.turns or request.notations
        pose = pose._replace(
            position=pose.position if has_position else None, rotation=pose.rotation if has_rotation else None
        )
    extras: dict[str, Any] = dict(zip(request.operation.extras(POSE), answer.parts[7:], strict=False))
    if shape.covariance:
        extras["covariance"] = list(answer.parts[-COVARIANCE:])
    return Result(pose, extras | _rest(node, unit, answer.record))


def _used_keys(record: Record) -> set[str]:
    """Return the keys of a record that say its pose, or what is no longer true of the result."""
    return {record.key, record.rotation, *record.others, *record.flat, *record.members, *NOT_PLAIN}


def _says_no_more(record: Record, document: Document, unit: Path) -> bool:
    """Tell whether a unit is one pose with its frames and nothing else, so that its text need not be walked again."""
    value = value_at(document.value, unit[1:])
    if record.path != unit or record.shape.kind != POSE or type(value) is not dict:
        return False
    names = {path[-1] for each in (record.name, record.parent) for path in each.paths if path[:-1] == unit}
    return _used_keys(record).union(names).issuperset(value)


def _rest(node: Node, unit: Path, record: Record) -> dict[str, Any]:
    """Return what a record and the mappings around it say beside the pose, its frames and its stamp."""
    used = _used_keys(record)
    names = {path for each in (record.name, record.parent) for path in each.paths}
    rest: dict[str, Any] = {}
    for depth in range(len(unit), len(record.path) + 1):
        path = record.path[:depth]
        holder = node.at(path[len(unit) :])
        if type(holder.value) is not dict:
            continue
        on_the_way = set(record.path[depth : depth + 1]) | {"header", "covariance"}
        for key, (_, value) in holder.value.items():
            if key not in on_the_way and (*path, key) not in names and not (path == record.path and key in used):
                rest.setdefault(key, plain(value))
    return rest


def _flat(answer: Answer, request: Request) -> dict[str, Any]:
    """Return a point, vector, twist or wrench as a mapping without levels."""
    from frametool.stream.splice import target_of

    record = answer.record
    entry: dict[str, Any] = {"frame": answer.parent} if answer.parent is not None else {}
    numbers = target_of(record, request).written(answer.parts, floats)[:6]
    if record.shape.kind in PARTS:
        first, second = PARTS[record.shape.kind]
        return entry | {first: numbers[:3], second: numbers[3:]}
    return entry | {record.shape.kind: numbers}


def _rewritten(node: Node, unit: Path, answers: list[Answer], request: Request) -> Any:
    """Return a document or an item of it with the numbers and frames of its results, all else as it is."""
    from frametool.stream.splice import target_of

    if type(node.value) is list:
        return _flat(answers[0], request)
    changes: dict[Path, Any] = {}
    added: dict[Path, dict[str, Any]] = {}
    for answer in answers:
        record = answer.record
        numbers = target_of(record, request._replace(notations=())).written(answer.parts, floats)
        for index, (path, number) in enumerate(zip(record.numbers, numbers, strict=True)):
            if path is None:
                added.setdefault((*record.path, record.key), {})[XYZ[index]] = number
            else:
                changes[path] = number
        for name, new, key in ((record.name, answer.name, "name"), (record.parent, answer.parent, "frame")):
            changes |= dict.fromkeys(name.paths, new)
            if new is not None and not name.paths and record.shape.kind not in SIX:
                added.setdefault(record.path, {})[key] = new
    made = _plain_with(node, unit, changes, added)
    record = answers[0].record
    if record.path == unit and record.key in (POINT, VECTOR) and record.key != record.shape.kind:
        return {record.shape.kind if key == record.key else key: value for key, value in made.items()}
    return made


def _plain_with(node: Node, path: Path, changes: dict[Path, Any], added: dict[Path, dict[str, Any]]) -> Any:
    """Return a node as a plain value in which some values are others; a name that became None is left out or ''."""
    if path in changes:
        return changes[path]
    if type(node.value) is list:
        return [_plain_with(item, (*path, index), changes, added) for index, item in enumerate(node.value)]
    if type(node.value) is not dict:
        return plain(node)
    made = {}
    for key, (_, value) in node.value.items():
        here = (*path, key)
        if here in changes and changes[here] is None and key in ("frame", "name", "parent"):
            continue
        made[key] = "" if here in changes and changes[here] is None else _plain_with(value, here, changes, added)
    new = added.get(path, {})
    return {key: value for key, value in new.items() if key not in XYZ} | made | new


def plain(node: Node) -> Any:
    """Return a node as a plain value; numbers and truth values keep their text."""
    if type(node.value) is dict:
        return {key: plain(value) for key, (_, value) in node.value.items()}
    if type(node.value) is list:
        return [plain(item) for item in node.value]
    if node.quote or node.value is None:
        return node.value
    if node.value in ("null", "~", ""):
        return None
    is_plain = node.value in ("true", "false") or re.fullmatch(JSON_NUMBER, node.value)
    return Verbatim(node.value) if is_plain else node.value


def _at(nodes: list[Node], path: Path) -> Node:
    """Return the node at a path that begins with the index of its document."""
    return nodes[int(path[0])].at(path[1:])


def stream_results(
    stream: ByteStream, form: str, request: Request, style: Style, bad: BadRows
) -> Iterator[Value]:
    """Yield the results of a stream of records in another form than theirs; bad ones are reported as rows are."""
    from frametool.stream.faults import Fault
    from frametool.stream.record_stream import without_noise
    from frametool.stream.splitter import Splitter
    from frametool.text.lines import read_blocks

    splitter = Splitter(form)
    line, rows = 1, 0
    memory = Memory()
    for block in read_blocks(stream, whole=splitter.whole):
        for part in splitter.parts(block).parts:
            rows += 1
            at = line + block.count(b"\n", 0, part.start)
            if part.problem:
                bad.take([Fault(at, "", part.problem)])
                continue
            try:
                text = decode(block[part.start : part.end], bad.source)
                plain_text = without_noise(text) if form == "yaml" else text
                yield from results(Source(bad.source, plain_text), request, style, memory)
            except FormatError as error:
                bad.take([Fault(at + max(error.line, 1) - 1, str(error.column or ""), error.message)])
            except FrametoolError as error:
                bad.take([Fault.of(at, "", error)])
        line += block.count(b"\n")
    bad.finish(rows)
