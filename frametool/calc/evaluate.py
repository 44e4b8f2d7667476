"""Evaluate expressions: each part is checked once, in order; values that depend on a row are computed later.

A scope holds the names of an expression; a literal in braces is a pose in the grammar that files share, or a point, a
vector or a twist in the notation of results.

    scope = Scope(tree=frametool.load("robot.yaml"))
    evaluate_line(read_line("inv(map<-base_link) * (map<-tool)"), scope).type      # base_link<-tool
    {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}    {name: tool, parent: wrist, xyz: [0, 0, 0.1]}
    {frame: map, point: [1, 2, 3]}           {twist: [1, 0, 0, 0, 0, 0.5]}

`frametool.calc(..)` evaluates an expression for Python; the value has frames.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from math import pi
from typing import TYPE_CHECKING, Any, Self

from frametool.calc import functions
from frametool.calc.functions import FUNCTIONS, LIST, NUMBER, PLAIN_NUMBER, POINT, POSE, TREE, TWIST, VECTOR, Term, Type
from frametool.calc.parser import PLAIN, RESERVED, UNITS, Branch, CalcError, Line, NoTree, frame_text, parse_line
from frametool.documents.document import parse_documents
from frametool.documents.source import Source, error_at
from frametool.errors import FormatError, FrametoolError, ValueInvalid, did_you_mean, shown, warn
from frametool.frames.lookups import Frames
from frametool.geometry import floats
from frametool.geometry.representations import EARTH_FRAMES
from frametool.geometry.transform import Rotation, Transform
from frametool.geometry.validation import as_numbers
from frametool.grammar.pose import COVARIANCE_KEYS, LEFT_OUT, Pose, read_pose
from frametool.grammar.readers import Misfit, Reading, kind, may_be_on_earth, read_numbers, slash_note, within
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.calc.functions import RowValues
    from frametool.geometry import Array, Components
    from frametool.geometry.place import Earth

NAME = "literal"
AXES = ("x", "y", "z")
PLACED = {"point": (POINT, AXES), "vector": (VECTOR, AXES), "twist": (TWIST, ("vx", "vy", "vz", "wx", "wy", "wz"))}


def literal(value: Any, reading: Reading) -> Term:
    """Convert a pose, or a point, a vector or a twist in the notation of results, to a term; raises Misfit."""
    if type(value) is not dict:
        raise Misfit(f"expected a pose like {{xyz: [x, y, z], rpy_deg: [..]}}, found {kind(value)}")
    key = next((key for key in PLACED if key in value), "")
    if not key:
        pose = read_pose(value, reading)
        if pose.position is not None and pose.rotation is None and any(map(may_be_on_earth, value)):
            return Term(Type(POINT, pose.parent), pose.position)  # a position on the Earth without a rotation
        return term_of_pose(pose)
    if unknown := [each for each in value if each not in (key, "frame")]:
        hint = did_you_mean(unknown[0], ("frame",))
        raise Misfit(f"unknown key {shown(unknown[0])} next to {key}{hint}; expected frame", (unknown[0],), key=True)
    type_, names = PLACED[key]
    frame = value.get("frame")
    if frame is not None and (type(frame) is not str or not frame):
        raise Misfit(f"frame must be a frame's name, found {kind(frame)}", ("frame",))
    return Term(Type(type_, frame), within((key,), read_numbers, value[key], names))


def term_of_pose(pose: Pose) -> Term:
    """Return the term of a pose with or without frame names."""
    return Term(Type(POSE, pose.parent, pose.name), pose.components)


class Scope:
    """The names that an expression can use: values, trees, the default tree, the row of a stream.

    names: of values and trees; extended by assignments
    row: the type of a row; None outside of streams
    degrees, normalize: for literals: the unit of bare angles, and whether inexact rotations are accepted
    seen: the frames of all evaluated values
    """

    def __init__(
        self, *, tree: Frames | None = None, names: dict[str, Term] | None = None, row: Type | None = None,
        degrees: bool = False, normalize: bool = False,
    ) -> None:  # fmt: skip
        """Start with a tree and names."""
        self.tree = tree
        self.names = {} if names is None else names
        self.row = row
        self.degrees = degrees
        self.normalize = normalize
        self.earth: Earth | None = None  # options for all positions on the Earth
        self.seen: set[str | None] = {None}
        self.warned: set[str] = set()  # warnings that are emitted once

    def leave_out(self, covariances: object) -> None:
        """Warn once that expressions ignore covariances, if there are any."""
        message = LEFT_OUT.format("calc")
        if covariances and message not in self.warned:
            self.warned.add(message)
            warn(message)

    def reading(self, source: Source) -> Reading:
        """Return the options for reading the literals of a text."""
        return Reading(source, degrees=self.degrees, normalize=self.normalize, earth=self.earth)

    @property
    def trees(self) -> list[tuple[str, Frames]]:
        """Return the trees by their names in look-ups; the default tree first."""
        named = [(name, term.tree) for name, term in self.names.items() if term.tree is not None]
        return [("", self.tree), *named] if self.tree is not None else named


def pointed(error: FrametoolError, text: str) -> FrametoolError:
    """Add the expression with a caret to an error with a position."""
    at = getattr(error, "at", None)
    if at is not None and not getattr(error, "snippet", ""):
        place = error_at(Source("", text), at, "")
        error.fields = {**error.fields, "column": place.column}
        error.snippet = "\n".join(f"  {each}" for each in place.snippet.split("\n"))  # type: ignore[attr-defined]
    return error


@contextmanager
def located(at: int) -> Iterator[None]:
    """Add the position in the expression to an error that has no position."""
    try:
        yield
    except FrametoolError as error:
        if getattr(error, "at", None) is None:
            error.at = at  # type: ignore[attr-defined]
        raise


def read_line(text: str) -> Line:
    """Parse a line; raises CalcError with the line and a caret below the position."""
    try:
        return parse_line(text, FUNCTIONS)
    except CalcError as error:
        raise pointed(error, text) from None


def evaluate_line(line: Line, scope: Scope) -> Term:
    """Evaluate a parsed line; bind the value to its name, if any, and to `ans`; errors show the line with a caret."""
    try:
        term = _Walk(scope).term(line.tree)
    except FrametoolError as error:
        raise pointed(error, line.text) from None
    if line.name:
        scope.names[line.name] = term._replace(text=line.name)
    scope.names["ans"] = term._replace(text="ans")
    return term


class _Walk:
    """Evaluates the parts of one expression."""

    def __init__(self, scope: Scope) -> None:
        self.scope = scope

    def term(self, branch: Branch) -> Term:
        """Return the value of a part; errors get its position."""
        with located(branch.at):
            found: Term = getattr(self, f"_{branch.kind}")(branch)
        self.scope.seen.update((found.type.target, found.type.source))
        return found

    def _value(self, branch: Branch) -> Term:
        """Return the value of a part that is neither a tree nor a list."""
        with located(branch.at):
            return functions.wanted(self.term(branch))

    def _number(self, branch: Branch) -> Term:
        text, unit = branch.value
        if unit and unit not in UNITS:
            raise CalcError(f"unknown unit {shown(unit)}{did_you_mean(unit, UNITS) or ';'} units: {' '.join(UNITS)}")
        value = float(text)
        times, below, dimension = UNITS[unit] if unit else (1.0, 1.0, PLAIN)
        if value * times == float("inf"):
            raise CalcError(f"{shown(text if value == float('inf') else text + unit)} is not finite")
        return Term(Type(NUMBER, unit=dimension, degrees=unit == "deg"), (value * times / below,))

    def _name(self, branch: Branch) -> Term:
        name, scope = branch.value, self.scope
        if name == "row":
            return Term(self._row("row"), None, lambda row: row.parts)
        if name == "pi":
            return Term(PLAIN_NUMBER, (pi,))
        if name in scope.names:
            return scope.names[name]
        if name == "ans":
            raise CalcError("there is no last value yet")
        if name in UNITS:
            raise CalcError(f"unknown name {shown(name)}; write a unit directly after its number: 1{name}")
        if name in FUNCTIONS:
            raise CalcError(f"{name} is a function: {name}(..) takes {FUNCTIONS[name][0]}")
        if any(name in tree.frames for _, tree in scope.trees):
            raise CalcError(f"unknown name {shown(name)}; a frame is asked for as TARGET<-SOURCE")
        known = [*(each for each in scope.names if each != "ans"), *FUNCTIONS, *RESERVED]
        raise CalcError(f"unknown name {shown(name)}{did_you_mean(name, known)}")

    def _row(self, what: str) -> Type:
        """Return the type of a row."""
        if self.scope.row is None:
            raise CalcError(f"{what} is known in streams only: -i FILE, or standard input")
        return self.scope.row

    def _column(self, branch: Branch) -> Term:
        self._row("row")
        return Term(PLAIN_NUMBER, None, lambda row: (row.cells[branch.value],))

    def _pose(self, branch: Branch) -> Term:
        reading = self.scope.reading(Source(NAME, branch.value))
        try:
            (document,) = parse_documents(branch.value, NAME)
            term = literal(document.value, reading)
        except FormatError as error:
            raise CalcError(error.message) from None
        except Misfit as misfit:
            raise CalcError(str(misfit)) from None
        self.scope.leave_out(not COVARIANCE_KEYS.isdisjoint(document.value))
        for note in reading.notes:
            warn(note.message)
        return term

    def _list(self, branch: Branch) -> Term:
        items = tuple(map(self._value, branch.parts))
        if all(item.type.kind == NUMBER for item in items):
            return functions.called("list", items)
        other = next((item for item in items if item.type.kind != items[0].type.kind), None)
        if other is not None:
            raise CalcError(f"a list holds values of one kind, found {items[0].type.named} and {other.type.named}")
        return Term(Type(LIST), (), items=items, text=branch.value)

    def _call(self, branch: Branch) -> Term:
        name = branch.value
        if name not in FUNCTIONS:
            hint = did_you_mean(name, FUNCTIONS) or f"; functions: {' '.join(FUNCTIONS)}"
            raise CalcError(f"unknown function {shown(name)}{hint}")
        read = self.term if name == "mean" and len(branch.parts) == 1 else self._value
        terms = [read(part) for part in branch.parts]
        return functions.called(name, terms[0].items if terms and terms[0].type.kind == LIST else terms)

    def _chain(self, branch: Branch) -> Term:
        left, rights = self._value(branch.parts[0]), iter(branch.parts[1:])
        for operator, at, frames in branch.value:
            with located(at):
                if frames:
                    left = self._framed(left, [*map(self._bare, frames)])
                else:
                    left = functions.called(operator, [left, self._value(next(rights))])
        return left

    def _negate(self, branch: Branch) -> Term:
        return functions.called("negate", [self._value(branch.parts[0])])

    def _framed(self, term: Term, frames: Sequence[str]) -> Term:
        """Set both frames of a pose, or the frame of another value; raises CalcError if other frames are known."""
        type_ = term.type
        if type_.kind not in ((POSE,) if len(frames) == 2 else functions.FRAMED):
            takes = ".. in FRAME names the frame of a point or vector, .. as TARGET<-SOURCE the two of a pose"
            raise CalcError(f"{takes}; found {type_.named}")
        target, source = (*frames, type_.source)[:2]
        if not (functions.meet(type_.target, target) and functions.meet(type_.source, source)):
            moved = f"({frame_text(target)}<-{frame_text(type_.target)}) * .."
            known = f"in {shown(type_.target)} already; to move it: {moved}"
            raise CalcError(f"this is {f'{type_} already' if type_.kind == POSE else known}")
        self.scope.seen.update(frames)
        return term._replace(type=type_._replace(target=target, source=source))

    def _bare(self, name: str, tree: Frames | None = None) -> str:
        """Remove one leading `/` from a frame's name, as tf2 does, unless a frame has this name.

        Both names of the Earth's frame become `ecef`.
        """
        if name in EARTH_FRAMES:
            return EARTH_FRAMES[0]
        trees = [tree] if tree is not None else [each for _, each in self.scope.trees]
        if len(name) < 2 or not name.startswith("/") or any(name in each.frames for each in trees):
            return name
        warn(slash_note(name))
        return name[1:]

    def _lookup(self, branch: Branch) -> Term:
        frames, named, when = branch.value
        tree = self._tree(named)
        target, source = (self._bare(each, tree) for each in frames)
        type_ = Type(POSE, target, source)
        if when != "row":
            return Term(type_, tree.lookup_components(target, source, None if when == "latest" else when))
        self._row("@ row")
        tree.latest(target, source)  # raises the errors that do not depend on the time

        def at_row(row: RowValues) -> Components:
            """Look up at the times of rows; rows without data are nan."""
            if row.xp is not floats:
                return tree.lookup_many(target, source, row.times_ns, missing="nan").components
            found = tree.lookup_many(target, source, [row.times_ns], missing="nan").components  # same bits as for many
            single = tuple(float(column[0]) for column in found)
            return single if single[6] == single[6] else tree.lookup_components(target, source, row.times_ns)

        return Term(type_, None, at_row)

    def _tree(self, name: str) -> Frames:
        """Return the tree of a look-up; raises NoTree or CalcError."""
        scope = self.scope
        if not name:
            if scope.tree is None:
                raise NoTree("no tree to look up in: give --tree FILE, or name one: d=FILE and d[TARGET<-SOURCE]")
            scope.leave_out(scope.tree.covariances)
            return scope.tree
        if name not in scope.names:
            trees = [each for each, _ in scope.trees if each]
            raise CalcError(f"unknown name {shown(name)}{did_you_mean(name, trees)}")
        tree = scope.names[name].tree
        if tree is None:
            raise CalcError(f"{name} is not a tree but {scope.names[name].type.named}")
        scope.leave_out(tree.covariances)
        return tree


BETWEEN_WORDS = " \t()[]{},*^@+="
WORDS = ("row", "pi", "ans", "as ", "in ")


def completions(scope: Scope, text: str, before: str) -> list[str]:
    """Return the completions of the last word of a line: frames on both sides of an arrow, names, functions.

    text: the word; before: the line before it
    """
    opened = re.search(r"(\w+) *\[$", before)  # the bracket of a named tree
    asked = scope.names[opened[1]].tree if opened and opened[1] in scope.names else None
    tree = asked or scope.tree
    frames = sorted(map(frame_text, tree.frames)) if tree else []
    head, arrow, tail = text.partition("<-")
    if arrow:
        return [f"{head}<-{frame}" for frame in frames if frame.startswith(tail)]
    words = () if asked else (*scope.names, *(f"{name}(" for name in FUNCTIONS), *WORDS)
    return [word for word in (*words, *(f"{frame}<-" for frame in frames)) if word.startswith(text)]


# --- in Python: `frametool.calc(..)`, and values that carry their frames ---


class Measure(float):
    """A number with a unit: `m`, `rad`, `s`; "" for a plain one.  Angles are in radians."""

    __slots__ = ("unit",)
    unit: str

    def __new__(cls, value: float, unit: str) -> Self:
        """Store both."""
        made = super().__new__(cls, value)
        made.unit = unit
        return made

    def __reduce__(self) -> tuple[type[Self], tuple[float, str]]:
        """Allow copying and pickling with the unit."""
        return type(self), (float(self), self.unit)


class Framed:
    """A value with its frames: a pose `target<-source`, or a point, vector, twist or angles in `target`.

    kind: pose, point, vector, twist, angles.  An unknown frame is None.
    """

    __slots__ = ("_term",)

    def __init__(self, term: Term) -> None:
        """Wrap the result of an expression."""
        self._term = term

    @property
    def kind(self) -> str:
        """The kind of the value."""
        return self._term.type.kind

    @property
    def target(self) -> str | None:
        """The frame in which it is expressed."""
        return self._term.type.target

    @property
    def source(self) -> str | None:
        """The frame of which this is the pose."""
        return self._term.type.source

    @property
    def components(self) -> Components:
        """Its numbers, floats or arrays; those of a pose are tx, ty, tz, x, y, z, w."""
        return self._term.at(None)

    @property
    def transform(self) -> Transform:
        """The transform target_from_source of a pose."""
        if self.kind != POSE:
            raise ValueInvalid(f"{self._term.type.named} is not a pose")
        return Transform.of(*self.components)

    @property
    def xyz(self) -> Array:
        """The position of a pose or point, or the vector, shape (..., 3)."""
        return _stacked(self.components[:3])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:  # noqa: FBT001 - numpy's signature
        """Return its numbers, shape (..., n); of a pose the 4x4 matrix."""
        found = self.transform.as_matrix() if self.kind == POSE else _stacked(self.components)
        return found if dtype is None else found.astype(dtype, copy=bool(copy))

    def __repr__(self) -> str:
        """Show kind, frames and numbers."""
        frames = str(self._term.type) if self.kind == POSE else f"in {frame_text(self.target)}"
        return f"<{self.kind} {frames} {self.components}>"


def _stacked(parts: Components) -> Array:
    import numpy as np

    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def calc(
    text: str, /, *, tree: Frames | None = None, degrees: bool = False, normalize: bool = False, **names: Any
) -> Any:
    """Return the value of an expression such as `inv(map<-base_link) * (map<-tool)`; see `help calc`.

    tree: for look-ups without a tree name.  names: values for use in the expression: trees, transforms, rotations,
    numbers, three numbers (a point), six (a twist), lists of transforms, results of other expressions.
    degrees, normalize: how literals of poses are read.
    Returns a Measure, which is a float, or a Framed: `.transform`, `.xyz`, `.target`, `.source`; of a list a list.
    Raises CalcError for frames or units that do not match, LookupFailed.
    """
    if not isinstance(tree, Frames | None):
        raise ValueInvalid(f"expected a tree as frametool.load returns it, found {shown(tree)}")
    terms = {name: term_of(name, value) for name, value in names.items()}
    scope = Scope(tree=tree, names=terms, degrees=degrees, normalize=normalize)
    for name in names:
        read_line(f"{name}=0")  # refuses reserved names
    return _result(evaluate_line(read_line(text), scope))


def _result(term: Term) -> Any:
    """Convert a term to its Python value."""
    if term.type.kind == TREE:
        return term.tree
    if term.type.kind == LIST:
        return [*map(_result, term.items)]
    if term.type.kind != NUMBER:
        return Framed(term)
    (value,) = functions.numbers_in(term)
    return Measure(value, term.type.unit) if type(value) is float else value


def term_of(name: str, value: Any) -> Term:
    """Convert a Python value to a term; arrays (..., 3) are points, (..., 6) twists, others numbers.

    Raises ValueInvalid for other values.
    """
    if isinstance(value, Framed):
        found = value._term  # noqa: SLF001 - its own module
    elif isinstance(value, Frames):
        found = Term(Type(TREE), (), tree=value)
    elif isinstance(value, Transform):
        found = Term(Type(POSE), value.components)
    elif isinstance(value, Rotation):
        found = Term(Type(POSE), (0.0, 0.0, 0.0, *value.components))
    elif isinstance(value, Measure):
        found = Term(Type(NUMBER, unit=value.unit), (float(value),))
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        found = Term(Type(NUMBER), (parse_number(repr(float(value))),))  # refuses values that are not finite
    elif isinstance(value, (list, tuple)) and value and isinstance(value[0], (Transform, Framed)):
        found = Term(Type(LIST), (), items=tuple(term_of(name, each) for each in value))
    else:
        import numpy as np

        number: Any = None if isinstance(value, bool) else value
        try:
            array = as_numbers(number, name).astype(np.float64)
        except ValueInvalid:
            raise ValueInvalid(f"{name}: an expression knows nothing of {shown(type(value).__name__)}") from None
        if not np.isfinite(array).all():
            raise ValueInvalid(f"{name}: the numbers are not finite")
        kind = {3: POINT, 6: TWIST}.get(array.shape[-1] if array.ndim else 1, NUMBER)
        columns = (array,) if kind == NUMBER else np.moveaxis(array, -1, 0)
        found = Term(Type(kind), tuple(float(part) if part.ndim == 0 else part for part in columns))
    return found._replace(text=name)
