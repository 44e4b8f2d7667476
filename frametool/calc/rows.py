"""Expressions over the rows of a stream: checked once for each kind of row, computed once per block.

Frames are checked for each pair of names in the rows, numbers for all rows at once, because they do not depend on the
names of frames.

The module also reads the poses of a table as one list, like the rows of a stream.
"""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.calc.evaluate import AXES, PLACED, Scope, evaluate_line, literal, term_of_pose
from frametool.calc.functions import ANGLES, LIST, NUMBER, POINT, POSE, VECTOR, RowValues, Term, Type, numbers_in
from frametool.calc.parser import RADIAN, CalcError, Line, needs_time, reads_row, walk
from frametool.documents.source import Source, opened
from frametool.errors import FormatError, FrametoolError
from frametool.grammar.pose import COVARIANCE_KEYS
from frametool.grammar.readers import Misfit, may_be_on_earth
from frametool.grammar.readers import tell as tell_notes
from frametool.ros.messages import LISTS
from frametool.rows.faults import BadRows
from frametool.rows.request import Formula, Request, RowOptions, target_of
from frametool.rows.samples import samples_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry import Components, Namespace, Number
    from frametool.grammar.result import Style

RESULT = "result"  # the column of a number without a name
NAMES: dict[str, Sequence[str]] = {ANGLES: ("roll", "pitch", "yaw"), **dict(PLACED.values())}
# placeholders for the frames of rows that no expression names: their names do not affect the result
SOME, OTHER = "\0some", "\0other"


class Bound(NamedTuple):
    """Lines evaluated for rows of one type.

    terms: (name, result) of each line; extras: the names of the numbers that are added; frames: of all values
    """

    terms: tuple[tuple[str, Term], ...]
    extras: tuple[str, ...]
    frames: frozenset[str | None]


class RowExpressions(Formula):
    """Lines whose results replace rows (one without a name) or are added to them (all named).

    bindings: lines that only define names for the others
    """

    def __init__(self, lines: Sequence[Line], bindings: Sequence[Line], scope: Scope, style: Style) -> None:
        """Store the lines; the style defines how poses are written in new columns."""
        self.lines = tuple(lines)
        self.bindings = tuple(bindings)
        self.scope = scope
        self.degrees = style.degrees
        self.target = target_of(style.changed(place=None))
        self.adds = all(line.name for line in lines)
        parts = [branch for line in (*bindings, *lines) for branch in walk(line.tree)]
        self.columns = tuple(dict.fromkeys(each.value for each in parts if each.kind == "column"))
        self.needs_time, self.reads_row = any(map(needs_time, parts)), any(map(reads_row, parts))
        self._bound: dict[Type, Bound] = {}

    def check(self, kinds: Sequence[str]) -> None:
        """Raise the first error if the lines fit none of several kinds of rows."""
        problems = []
        for kind in kinds if self.reads_row else ("",):
            try:
                self._for(Type(kind))
            except FrametoolError as error:
                problems.append(error)
            else:
                return
        raise problems[0]

    def kind(self, row: str) -> str:
        """Return the kind of the result for rows of a kind: pose, point or vector; "" for numbers."""
        if self.adds:
            return ""
        kind = self._for(Type(row)).terms[0][1].type.kind
        return kind if kind in (POSE, POINT, VECTOR) else ""

    def extras(self, row: str) -> tuple[str, ...]:
        """Return the names of the numbers that are added to rows of a kind."""
        return self._for(Type(row)).extras

    def rename(self, row: str, parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        """Return the frames of the result for a row with these frames; raises CalcError if they do not fit."""
        known = self._for(Type(row)).frames
        first = parent if parent in known else SOME
        second = name if name in known else SOME if name == parent else OTHER
        is_pose = row == POSE
        try:
            bound = self._for(Type(row, first, second if is_pose else None))
        except FrametoolError:
            self._bind_all(Type(row, parent, name if is_pose else None))  # raises the same error with the real names
            raise
        if self.adds or not self.kind(row):
            return parent, name
        result = bound.terms[0][1].type
        meant = {first: parent, second: name}
        target, source = (meant.get(each, each) for each in (result.target, result.source))
        return target, source if result.kind == POSE else name

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace
    ) -> Components:
        """Return the components of the result and then the extras; raises CalcError if floats have no result."""
        bound = self._for(Type(row))
        values = RowValues(parts, dict(zip(self.columns, cells, strict=True)), times_ns, xp, {})
        if self.kind(row):
            return bound.terms[0][1].at(values)
        numbers = [number for _, term in bound.terms for number in self._numbers(term, values)]
        return (*(0.0,) * 7, *numbers)  # the pose of the row is not replaced

    def _for(self, type_: Type) -> Bound:
        """Return the lines evaluated for rows of a type, from a cache."""
        if type_ not in self._bound:
            self._bound[type_] = self._bind_all(type_)
        return self._bound[type_]

    def _bind_all(self, type_: Type) -> Bound:
        scope = copy(self.scope)
        scope.names, scope.row, scope.seen = dict(self.scope.names), type_, {None}
        for line in self.bindings:
            self._bind(line, scope)
        terms = tuple((line.name, self._bind(line, scope)) for line in self.lines)
        named = terms if self.adds or terms[0][1].type.kind not in (POSE, POINT, VECTOR) else ()
        extras = tuple(name for own, term in named for name in self._names(own, term.type))
        return Bound(terms, extras, frozenset(scope.seen))

    def _bind(self, line: Line, scope: Scope) -> Term:
        """Evaluate a line; the value of a name is computed once per block, however often it is used."""
        term = evaluate_line(line, scope)
        compute = term.compute
        if not line.name:
            return term
        if term.parts is None and compute is not None:

            def once(row: RowValues) -> Components:
                if id(compute) not in row.bound:
                    row.bound[id(compute)] = compute(row)
                return row.bound[id(compute)]

            term = term._replace(compute=once)
        scope.names[line.name] = term = term._replace(text=line.name)
        return term

    def _names(self, own: str, type_: Type) -> tuple[str, ...]:
        """Return the names of the numbers of a value: NAME, or NAME_x, NAME_y .."""
        if type_.kind not in (NUMBER, POSE, *NAMES):
            raise CalcError(f"a{'n' * (type_.kind[:1] == 'a')} {type_.kind} cannot be added to rows")
        if type_.kind == NUMBER:
            return (f"{own or RESULT}{'_deg' * (self.degrees and type_.unit == RADIAN)}",)
        if type_.kind == POSE:
            names: Sequence[str] = (*(AXES if self.target.unit is not None else ()), *self.target.names)
        else:
            names = [name + "_deg" * (self.degrees and type_.kind == ANGLES) for name in NAMES[type_.kind]]
        return tuple(f"{own}_{name}" if own else name for name in names)

    def _numbers(self, term: Term, row: RowValues) -> Sequence[Number]:
        """Return the numbers of a value in their written units."""
        if term.type.kind == POSE:
            return self.target.written(term.at(row), row.xp)
        return numbers_in(term, row, degrees=self.degrees)


def poses_of_table(path: str, fmt: str, *, normalize: bool, degrees: bool) -> Term:
    """Read the poses or points of a table as a list; raises FormatError at the first bad row."""
    with opened(path) as stream:
        numbers = samples_of(stream, fmt, RowOptions(normalize=normalize, degrees=degrees), BadRows(path)).numbers
    is_turned = not np.isnan(numbers[0, -1])
    type_ = Type(POSE if is_turned else POINT)
    rows = np.nan_to_num(numbers[:, : 7 if is_turned else len(AXES)]).tolist()
    return Term(Type(LIST), (), items=tuple(Term(type_, tuple(row)) for row in rows))


def values_of_document(source: Source, scope: Scope) -> Term | None:
    """Read the poses or points of a document; None for a tree."""
    from frametool.documents.document import parse_documents
    from frametool.rows.plain import read_poses

    documents = [document.value for document in parse_documents(source.text, source.name)]
    if any(type(each) is dict and not {"frames", *LISTS}.isdisjoint(each) for each in documents):
        return None
    alone = documents[0] if len(documents) == 1 and type(documents[0]) is dict else {}
    if not PLACED.keys().isdisjoint(alone) or any(map(may_be_on_earth, alone)):
        try:
            scope.leave_out(not COVARIANCE_KEYS.isdisjoint(alone))
            reading = scope.reading(source)
            found = literal(alone, reading)
        except Misfit as misfit:
            raise misfit.placed(source, 0) from None
        tell_notes(source, [note._replace(path=(0, *note.path)) for note in reading.notes])
        return found
    poses = read_poses(source, Request(rows=RowOptions(degrees=scope.degrees, normalize=scope.normalize)))
    if not poses:
        raise FormatError("nothing in it", source=source.name)
    scope.leave_out(any(pose.covariance for pose in poses))
    items = tuple(map(term_of_pose, poses))
    return items[0] if len(items) == 1 else Term(Type(LIST), (), items=items)
