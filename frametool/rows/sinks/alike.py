"""Write results of records with the same layout as rows, whose columns are the scalars of the records.

The text of such a row is learned from one result in which every scalar is a mark.  Records with a warning or an error
are written one by one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.documents.document import Node, parse_nodes
from frametool.documents.writers import dump_json
from frametool.errors import FrametoolError
from frametool.formats.rows.csv import cells_of
from frametool.geometry import floats
from frametool.geometry.representations import notation
from frametool.grammar.readers import in_nanoseconds
from frametool.grammar.result import SPELLED, Result, Style
from frametool.rows.batch import RowPoses, chosen, read_stamps
from frametool.rows.plain import MOST_ENTRIES, Answer, stamp_key, values_of_unit
from frametool.rows.request import target_of
from frametool.rows.shapes import POINT, POSE, ROTATION, VECTOR, Shape
from frametool.rows.sinks import as_rows
from frametool.rows.sinks.as_rows import LEAF, NAME, NUMBERS, PARENT, STAMP_NS, AlikeRows, Marked, leaf_mark
from frametool.rows.sources.templates import Cut, Template, plan_of

if TYPE_CHECKING:
    from frametool.rows.evaluate import Plan, Run
    from frametool.rows.request import Request
    from frametool.rows.sources.templates import Called

QUATERNION = notation("quaternion")


class RecordRows:
    """Make rows from the results of records that share a template."""

    def __init__(self, request: Request, style: Style, *, is_yaml: bool) -> None:
        """Begin without templates."""
        self.request, self.style, self.is_yaml = request, style, is_yaml
        self._plans: dict[Template, tuple[Plan, list[Marked]]] = {}

    def plan(self, template: Template) -> Plan:
        """Return the plan for the records of a template, without marks if its results need more than the scalars."""
        if template in self._plans:
            return self._plans[template][0]
        plan = plan_of(template, self.request, yaml=self.is_yaml)._replace(pieces=())
        entries, targets, found = template.entries, list[Shape](), list[Marked]()
        # few plain numbers, and no position on the Earth
        is_plain = template.regular and len({entry.record.path for entry in entries}) == len(entries) <= MOST_ENTRIES
        is_simple = is_plain and not any(
            self.request.operation.reads_scale(record.shape) or record.shape.place or record.keys.placed
            or target.place or target.scaled
            for record, target, *_ in entries
        )  # fmt: skip
        for at, entry in enumerate(entries if is_simple else ()):
            target = self._target(entry.target, self.request.operation.result_kind(entry.record.shape.kind))
            if (made := self._marked(template, at, target)) is None:
                targets, found = [], []
                break
            targets.append(target)
            found.append(made)
        self._plans[template] = plan._replace(targets=tuple(targets) or plan.targets), found
        return self._plans[template][0]

    def take(self, cut: Cut, run: Run, called: Called) -> tuple[list[AlikeRows], set[int]]:
        """Return the rows of a run in batches, and the rows that must be written one by one.

        called: the frames of all records, as `Cut.frames` returns them
        """
        template, marked, parts = cut.template, self._plans[cut.template][1], run.block.parts
        left = {*run.rows[run.locked[run.rows] != 0].tolist()} if marked else {*run.rows.tolist()}
        if self.style.format == "yaml":  # a null changes the layout of YAML
            for cells in (parts[at] for at, node in template.leaves if not node.quote):
                left |= {*np.flatnonzero(cells.data[cells.starts] == ord("n")).tolist()}
        stamps = []
        for each in marked:
            times, late = read_stamps([parts[at] for at in each.stamp], in_ns=each.in_ns) if each.stamp else (None, ())
            stamps.append(times)
            left |= {*late}
        rows = run.rows[np.array([row not in left for row in run.rows.tolist()], np.bool_)]
        frames, codes = called
        which = codes[rows].tolist() if len(frames) > 1 else [0]
        first, batches = 0, list[AlikeRows]()
        for at, (each, times) in enumerate(zip(marked, stamps, strict=True) if len(rows) else ()):
            parents, names = ([frames[code][at][1][role] for code in which] for role in (0, 1))
            numbers = run.results[rows, first : first + each.size]
            leaves = {
                leaf_mark(number): chosen(parts[place], rows)
                for number, (place, _) in enumerate(template.leaves) if leaf_mark(number) in (each.quotes or ())
            }  # fmt: skip
            block = RowPoses(numbers, None if times is None else times[rows], rows, parents, names, leaves)
            batches.append(AlikeRows(each, cut.starts[rows, 0] + at, numbers, block))
            first += each.size
        return batches, left.intersection(run.rows.tolist())

    def _target(self, own: Shape, kind: str) -> Shape:
        """Return the shape in which the numbers of a result are written."""
        if kind not in (POSE, ROTATION):
            return own
        if not own.notations:
            return Shape(POSE)
        if self.style.format not in SPELLED or not self.style.notations:
            return Shape(POSE, notations=((QUATERNION, False),), keep_sign=True)
        return target_of(self.style, placed=own.unit is not None or own.whole)

    def _marked(self, template: Template, at: int, target: Shape) -> Marked | None:
        """Return the result of an entry with marks for its scalars; None if it needs more than these."""
        entry, operation, style = template.entries[at], self.request.operation, self.style
        record, shape, is_spelled = entry.record, entry.record.shape, style.format in SPELLED
        text, begin = "", 0
        for number, (stretch, _) in enumerate(template.leaves):
            start, end = template.stretches[stretch]
            text, begin = f"{text}{template.text[begin:start]}{leaf_mark(number)}", end
        text += template.text[begin:]
        if operation.formula is None:
            size = 7 if shape.kind in (POSE, ROTATION) else len(NUMBERS[: shape.own_size])
            carried = 0 if shape.rewritten else sum(shape.covariance)
        else:  # for numbers alone the pose of the row is ignored
            size, carried = 3 if operation.result_kind(shape.kind) in (POINT, VECTOR) else 7, 0
        parts = (*NUMBERS[:size], *(as_rows.MORE_NUMBERS + at for at in range(len(operation.extras(shape)) + carried)))
        shown = entry._replace(
            record=record._replace(stamp_ns=None if record.stamp_ns is None else STAMP_NS),
            parent=entry.parent and PARENT, name=entry.name and NAME,
        )  # fmt: skip
        try:
            root = Node(0, len(text), parse_nodes(text))
            own_style = style if is_spelled else style.changed(format="csv")
            (value,) = values_of_unit(root, [Answer(shown, parts)], self.request, own_style)
        except (FrametoolError, ValueError):
            return None
        written = target.written(parts, floats)
        numbers = {repr(number + 0.0): column for column, number in enumerate(written)}
        there = str([*value.pose, value.extras] if isinstance(value, Result) else value)
        quotes = {mark: node.quote for at, (_, node) in enumerate(template.leaves) if (mark := leaf_mark(at)) in there}
        found = Marked(value, numbers, len(written), quotes=quotes, is_json=template.json)
        if record.stamp_ns is not None:  # the stamp of its header
            begins = [template.root.at(path).start for path in record.stamps[:2]]
            found = found._replace(stamp=tuple(at for at, node in template.leaves if node.start in begins))
        # a scalar that is a stamp is parsed, unless its text is copied
        extras = value.extras if isinstance(value, Result) else value
        rest = {key: each for key, each in extras.items() if each != STAMP_NS}
        if (key := stamp_key(rest)) and not (is_spelled and type(rest[key]) is not int):
            if (leaf := LEAF.fullmatch(str(rest[key]))) is None:
                return None
            if key != "stamp_ns":
                del extras[key]
            extras["stamp_ns"] = STAMP_NS
            found = found._replace(stamp=(template.leaves[int(leaf[1])][0],), in_ns=in_nanoseconds(key))
        if is_spelled:
            cells = value.mapping(style) if isinstance(value, Result) else value
            try:
                in_columns = cells_of(value, style) if style.format == "csv" else cells
                dump_json(in_columns, lambda each: f"{numbers[repr(each)]}")
            except KeyError:
                return None  # one of its numbers has no column
        return found
