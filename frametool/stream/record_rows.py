"""Records that are written alike, as rows: a record is a row whose columns are its scalars.

What such a row becomes in another format is seen from one whose scalars are marks, by the way that single results take;
what is invalid, or worth telling, takes that way itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.documents.document import Node, parse_nodes
from frametool.errors import FrametoolError
from frametool.formats.rows.csv import cells_of
from frametool.geometry import floats
from frametool.geometry.representations import notation
from frametool.grammar.names import in_nanoseconds
from frametool.grammar.result import Result, Style
from frametool.stream.record_cuts import Cut, names_of, plan_of
from frametool.stream.record_text import Answer
from frametool.stream.record_values import SPELLED, plain, plain_scalar, stamp_key, unit_of, values_of_unit
from frametool.stream.row_layout import AS_READ, POINT, POSE, ROTATION, VECTOR, Target
from frametool.stream.row_poses import RowPoses, objects
from frametool.stream.rows import spans_of
from frametool.stream.stamp_columns import read_stamps
from frametool.stream.text_rows import (
    CELL,
    LEAF,
    MORE_NUMBERS,
    NAME,
    NUMBERS,
    PARENT,
    STAMP_NS,
    Marked,
    filled,
    leaf_mark,
    words,
)
from frametool.text.spans import MARGIN, Bytes, Floats, Ints, Spans

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.stream.evaluate import Plan, Run
    from frametool.stream.record_values import Value
    from frametool.stream.request import Request
    from frametool.stream.template import Template
    from frametool.stream.text_rows import Syntax

QUATERNIONS = ((notation("quaternion"), False),)
MOST_ENTRIES = 8  # points or poses of a record: each is looked at for itself
LAST_ASCII = 127


class RecordBatch(NamedTuple):
    """Results of records that are written alike, one a row.

    places: (n,) where each is; results: (n, k) numbers; parents, names: of their frames, one a row or one for all
    stamps_ns: (n,) those of their headers, if they have any
    """

    marked: Marked
    cut: Cut
    data: Bytes
    places: Ints
    results: Floats
    parents: Sequence[str | None]
    names: Sequence[str | None]
    stamps_ns: Ints | None

    def leaf(self, at: int) -> tuple[Node, Spans]:
        """Return a scalar of the records: where it was learned, and its text in each, without quotes."""
        stretch, node = self.cut.template.leaves[at]
        return node, Spans(self.data, self.cut.starts[:, stretch] + MARGIN, self.cut.ends[:, stretch] + MARGIN)

    def text(self, parts: Sequence[tuple[str, Syntax]], style: Style) -> list[Spans]:
        """Return the rows as text; parts: the text of the result with marks."""
        return filled(parts, style, self.marked.numbers, self.results, self._scalar)

    def _scalar(self, mark: str, syntax: Syntax) -> tuple[Spans, str]:
        """Return what is in the place of a mark, as it is written there, and the quotes around it."""
        if mark in (PARENT, NAME):
            return words(self.parents if mark == PARENT else self.names, len(self.places), syntax), ""
        if self.stamps_ns is not None and mark == str(STAMP_NS):
            return spans_of([b"%d" % stamp for stamp in self.stamps_ns.tolist()]), ""
        at = int(mark[-7:])
        node, found = self.leaf(at)
        is_cell = syntax is CELL
        if node.quote:
            passes = (is_cell or not (found.data > LAST_ASCII).any()) and not _holds(found, syntax.unsafe)
        else:
            passes = self.cut.template.json or is_cell
            passes = passes and not (is_cell and (found.data[found.starts] == ord("n")).any())  # it may be null
        if passes:
            return found, syntax.quote if node.quote else ""
        return words(plain_texts(self, at), len(self.places), syntax), ""

    def take(self, rows: Ints) -> RecordBatch:
        """Return some of the rows."""
        size = len(self.places)
        if len(rows) == size:
            return self
        parents, names = ([each[row] for row in rows.tolist()] if len(each) == size else each for each in self[5:7])
        cut = Cut(self.cut.template, self.cut.starts[rows], self.cut.ends[rows])
        stamps = None if self.stamps_ns is None else self.stamps_ns[rows]
        return RecordBatch(self.marked, cut, self.data, self.places[rows], self.results[rows], parents, names, stamps)


def _holds(cells: Spans, characters: bytes) -> bool:
    """Return True if any cell holds one of some characters."""
    counts = np.concatenate([[0], np.cumsum(np.isin(cells.data, [*characters]), dtype=np.int32)])
    return bool((counts[cells.ends] > counts[cells.starts]).any())


class RecordRows:
    """Make rows of records that are written alike."""

    def __init__(self, request: Request, style: Style, *, is_yaml: bool) -> None:
        """Begin without templates."""
        self.request, self.style, self.is_yaml = request, style, is_yaml
        self._plans: dict[Template, tuple[Plan, list[Marked]]] = {}

    def plan(self, template: Template) -> Plan:
        """Return what is done to the records of a template; without marks where their results are not made of them."""
        if template in self._plans:
            return self._plans[template][0]
        plan = plan_of(template, self.request, yaml=self.is_yaml)._replace(pieces=())
        entries, targets, found = template.entries, list[Target](), list[Marked]()
        # few plain numbers, and no place on the Earth
        is_plain = template.regular and len({entry.record.path for entry in entries}) == len(entries) <= MOST_ENTRIES
        is_simple = is_plain and not any(
            entry.record.shape.multiple or entry.record.shape.place or entry.record.placed or entry.target.place
            or entry.target.scaled
            for entry in entries
        )  # fmt: skip
        for at, entry in enumerate(entries if is_simple else ()):
            target = self._target(entry.target, self.request.operation.result_kind(entry.record.shape.kind))
            if (made := marked(template, at, self.request, self.style, target)) is None:
                targets, found = [], []
                break
            targets.append(target)
            found.append(made)
        self._plans[template] = plan._replace(targets=tuple(targets) or plan.targets), found
        return self._plans[template][0]

    def take(self, cut: Cut, run: Run, data: Bytes, text: bytes) -> tuple[list[RecordBatch], set[int]]:
        """Return the rows of a run in batches, and which of them are unclear."""
        template = cut.template
        _, marked = self._plans[template]
        left = {*run.rows[run.locked[run.rows] != 0].tolist()} if marked else {*run.rows.tolist()}
        if self.style.format == "yaml":  # in which a null has lines of its own
            left |= {row for at, node in template.leaves if not node.quote for row in _nulls(cut, at, data)}
        stamps = []
        for at, each in enumerate(marked):
            times, late = _stamps(cut, at, each, data)
            stamps.append(times)
            left |= {*late}
        rows = run.rows[np.array([row not in left for row in run.rows.tolist()], np.bool_)]
        own = Cut(template, cut.starts[rows], cut.ends[rows])
        batches, first = list[RecordBatch](), 0
        for at, (each, times) in enumerate(zip(marked, stamps, strict=True) if len(rows) else ()):
            becomes = [named for pair in names_of(own, at, text) if (named := template.named(at, pair))]
            parents, names = ([pair[role] for pair in becomes] for role in (0, 1))
            numbers, stamps_ns = run.results[rows, first : first + each.size], None if times is None else times[rows]
            batches.append(RecordBatch(each, own, data, own.starts[:, 0] + at, numbers, parents, names, stamps_ns))
            first += each.size
        return batches, left.intersection(run.rows.tolist())

    def _target(self, own: Target, kind: str) -> Target:
        """Choose which numbers of a result are written."""
        if kind not in (POSE, ROTATION):
            return own
        if not own.notations:
            return Target(1.0, ())
        placed = own.unit is not None or own.whole
        target = tuple((each, each.in_degrees(self.style.degrees)) for each in self.style.notations)
        if self.style.format not in SPELLED or not target:
            return Target(1.0, QUATERNIONS, keep_sign=True)
        whole = placed and any(each.representation.whole for each, _ in target)
        return Target(1.0 if placed and not whole else None, target, self.style.keep_sign, whole and len(target) == 1)


def marked(template: Template, at: int, request: Request, style: Style, target: Target) -> Marked | None:
    """Return the result of an entry of a template whose scalars are marks; None where it is not made of them alone."""
    entry = template.entries[at]
    record = entry.record
    text, begin = "", 0
    for number, (stretch, _) in enumerate(template.leaves):
        start, end = template.stretches[stretch]
        text, begin = f"{text}{template.text[begin:start]}{leaf_mark(number)}", end
    text += template.text[begin:]
    operation, shape = request.operation, record.shape
    if operation.formula is None:
        own, carried = 7 if shape.kind in (POSE, ROTATION) else len(NUMBERS[: shape.own_size]), sum(shape.covariance)
    else:  # of numbers alone, what was the row's own counts for nothing
        own, carried = 3 if operation.result_kind(shape.kind) in (POINT, VECTOR) else 7, 0
    parts = (*NUMBERS[:own], *(MORE_NUMBERS + at for at in range(len(operation.extras(shape)) + carried)))
    stamp = None if record.stamp_ns is None else STAMP_NS
    shown = entry._replace(parent=entry.parent and PARENT, name=entry.name and NAME)
    answers = [Answer(shown._replace(record=record._replace(stamp_ns=stamp)), parts)]
    own_style = style if style.format in SPELLED else style.changed(format="csv")
    try:
        root = Node(0, len(text), parse_nodes(text))
        unit = unit_of(record, root.at(record.path[:1]).value)
        (value,) = values_of_unit(root.at(unit), unit, answers, request, own_style)
    except (FrametoolError, ValueError):
        return None
    written = target.written(parts, floats)
    numbers = {repr(number + 0.0): column for column, number in enumerate(written)}
    found = _with_stamp(Marked(value, numbers, len(written)), is_spelled=style.format in SPELLED)
    if found is None or style.format not in SPELLED:
        return found
    if style.format == "csv":
        value = cells_of(found.value, style)
    else:
        value = found.value.mapping(style) if isinstance(found.value, Result) else found.value
    return found if all(repr(each) in numbers for each in _floats(value)) else None


def _floats(value: Any) -> Iterator[float]:
    """Yield the numbers in a value."""
    if isinstance(value, float):
        yield value
    elif isinstance(value, (dict, list)):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _floats(each)


def _with_stamp(found: Marked, *, is_spelled: bool) -> Marked | None:
    """Take the scalar that is a stamp for that of the result; None where it is no scalar.

    is_spelled: stamps stay as they are written, but those that were read already
    """
    extras = found.value.extras if isinstance(found.value, Result) else found.value
    rest = {key: each for key, each in extras.items() if each != STAMP_NS}
    key = stamp_key(rest)
    if not key or (is_spelled and type(rest[key]) is not int):
        return found
    leaf = LEAF.fullmatch(str(rest[key]))
    if key != "stamp_ns":
        del extras[key]
    extras["stamp_ns"] = STAMP_NS
    return None if leaf is None else found._replace(stamp=(int(leaf[1]), in_nanoseconds(key)))


def _stamps(cut: Cut, at: int, each: Marked, data: Bytes) -> tuple[Ints | None, Iterable[int]]:
    """Read the stamps of records, in their headers or with them; give also which records have none."""
    record = cut.template.entries[at].record
    places = [cut.template.stretch_of(path) for path in record.stamps[:2]] if record.stamp_ns is not None else []
    places = [cut.template.leaves[each.stamp[0]][0]] if each.stamp is not None else places
    if not places:
        return None, ()
    spans = (Spans(data, cut.starts[:, place] + MARGIN, cut.ends[:, place] + MARGIN) for place in places)
    return read_stamps((*spans,), in_ns=each.stamp[1] if each.stamp else 0)


def _nulls(cut: Cut, at: int, data: Bytes) -> list[int]:
    """Return the records with null in a stretch."""
    found: list[int] = np.flatnonzero(data[cut.starts[:, at] + MARGIN] == ord("n")).tolist()
    return found


def plain_texts(batch: RecordBatch, at: int) -> list[Any]:
    """Return a scalar of each record as a plain value."""
    node, cells = batch.leaf(at)
    data = cells.data.tobytes()
    spans = zip(cells.starts.tolist(), cells.ends.tolist(), strict=True)
    texts = [data[start:end] for start, end in spans]
    known = {text: plain_of(text.decode(), node) for text in {*texts}}
    return [known[text] for text in texts]


def plain_of(text: str, node: Node) -> Any:
    """Return the text of a scalar as a plain value, quoted as it was where it was learned."""
    if not node.quote:
        return plain_scalar(text)
    return plain(parse_nodes(f"{node.quote}{text}{node.quote}")[0]) if "\\" in text else text


def column_of(batch: RecordBatch, part: Any) -> list[Any]:
    """Return what each row says where the result of all has a part, whose marks are scalars of rows."""
    size = len(batch.places)
    if type(part) is dict:
        columns = [column_of(batch, each) for each in part.values()]
        return [dict(zip(part, row, strict=True)) for row in zip(*columns, strict=True)] if columns else [{}] * size
    if type(part) is list:
        return [[*row] for row in zip(*[column_of(batch, each) for each in part], strict=True)] if part else [[]] * size
    is_stamp = part == STAMP_NS and batch.stamps_ns is not None
    if isinstance(part, float) or is_stamp:
        numbers: Any = batch.stamps_ns if is_stamp else batch.results[:, batch.marked.numbers[repr(part + 0.0)]]
        return [*numbers.tolist()]
    if part in (PARENT, NAME):
        known = batch.parents if part == PARENT else batch.names
        return [*known] * (1 if len(known) == size else size)
    leaf = LEAF.fullmatch(part) if isinstance(part, str) else None
    return [part] * size if leaf is None else plain_texts(batch, int(leaf[1]))


def rows_as_values(batch: RecordBatch) -> Iterator[Value]:
    """Yield the rows of a batch as single results; their numbers are position and quaternion."""
    value = batch.marked.value
    if not isinstance(value, Result):
        yield from column_of(batch, value)
        return
    pose = value.pose
    said = column_of(batch, [pose.name, pose.parent, pose.scale if pose.scale != 1.0 else None, value.extras])
    for numbers, (name, parent, scale, extras) in zip(batch.results.tolist(), said, strict=True):
        own = pose._replace(
            position=None if pose.position is None else tuple(numbers[:3]),
            rotation=None if pose.rotation is None else tuple(numbers[3:7]),
            name=name, parent=parent, scale=scale or 1.0,
        )  # fmt: skip
        yield Result(own, extras)


def poses_of(batch: RecordBatch) -> RowPoses | None:
    """Return the rows of a batch as a block of poses; None where they are points, on the Earth, or scaled."""
    value = batch.marked.value
    if not isinstance(value, Result) or None in (value.pose.position, value.pose.rotation) or AS_READ in value.extras:
        return None
    if value.pose.scale != 1.0:
        return None
    names, parents = (column_of(batch, each) for each in value.pose[2:4])
    names, parents = (each[:1] if len({*each}) == 1 else each for each in (names, parents))
    extras = {key: objects(column_of(batch, each)) for key, each in value.extras.items() if key != "stamp_ns"}
    return RowPoses(batch.results[:, :7] + 0.0, batch.stamps_ns, np.arange(len(batch.places)), parents, names, extras)
