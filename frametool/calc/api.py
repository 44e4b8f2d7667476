"""`frametool.calc(..)`: expressions in Python, with values that carry their frames.

Results are also converted to the mappings of machine formats, and to text for people.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Self

from frametool.calc.evaluate import Scope, evaluate_line, read_line
from frametool.calc.functions import ANGLES, LIST, NUMBER, POINT, POSE, TREE, TWIST, VECTOR, Term, Type, in_radians
from frametool.calc.parser import RADIAN, frame_text
from frametool.errors import ValueInvalid, printable, shown
from frametool.formats.table import FORMATS, is_trajectory
from frametool.frames.lookups import Frames
from frametool.geometry.floats import RADIAN as DEGREES
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.types import Array, Components


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
        """The frame whose pose it is."""
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
    terms = {name: _term(name, value) for name, value in names.items()}
    scope = Scope(tree=tree, names=terms, degrees=degrees, normalize=normalize)
    for name in names:
        read_line(f"{name}=0")  # refuses reserved names
    return _result(evaluate_line(read_line(text), scope))


def _result(term: Term) -> Any:
    """Return the Python value of a term."""
    if term.type.kind == TREE:
        return term.tree
    if term.type.kind == LIST:
        return [*map(_result, term.items)]
    if term.type.kind != NUMBER:
        return Framed(term)
    (value,) = in_radians(term).at(None)
    return Measure(value, term.type.unit) if type(value) is float else value


def _term(name: str, value: Any) -> Term:
    """Convert a Python value; of arrays (..., 3) is points, (..., 6) twists, others numbers."""
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
        found = Term(Type(LIST), (), items=tuple(_term(name, each) for each in value))
    else:
        import numpy as np

        try:
            array = np.asarray(None if isinstance(value, bool) else value, dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueInvalid(f"{name}: an expression knows nothing of {shown(type(value).__name__)}") from None
        if not np.isfinite(array).all():
            raise ValueInvalid(f"{name}: the numbers are not finite")
        kind = {3: POINT, 6: TWIST}.get(array.shape[-1] if array.ndim else 1, NUMBER)
        columns = (array,) if kind == NUMBER else np.moveaxis(array, -1, 0)
        found = Term(Type(kind), tuple(float(part) if part.ndim == 0 else part for part in columns))
    return found._replace(text=name)


def plain_result(term: Term, style: Style) -> Any:
    """Return a value as a result: a pose as a Result, a number bare, anything else as a mapping."""
    type_, numbers = term.type, term.at(None)
    frame = {} if type_.target is None else {"frame": type_.target}
    if type_.kind == POSE:
        return Result(Pose.of(numbers, type_.source, type_.target))
    if type_.kind == NUMBER:
        return angle_in(term, degrees=style.degrees) if type_.unit == RADIAN else numbers[0]
    if type_.kind == ANGLES:
        return frame | ({"rpy_deg": [each * DEGREES for each in numbers]} if style.degrees else {"rpy": list(numbers)})
    if type_.kind == POINT and style.place is not None:
        from frametool.grammar.place import point_entry

        return point_entry(type_.target, numbers, style.place)
    return frame | {type_.kind: list(numbers)}


def angle_in(term: Term, *, degrees: bool) -> float:
    """Return an angle in degrees or radians; one written in degrees is exact."""
    if degrees and term.type.degrees:
        return float(term.at(None)[0])
    radians = float(in_radians(term).at(None)[0])
    return radians * DEGREES if degrees else radians


def line_of_value(term: Term, style: Style) -> str:
    """Return a value other than a pose or a point as a line for people."""

    def text(*values: float) -> str:
        return "  ".join(style.number(value + 0.0) for value in values)

    type_, numbers = term.type, term.at(None)
    frame = "" if type_.target is None else f" in {printable(type_.target)}"
    if type_.kind == NUMBER and type_.unit == RADIAN:
        radians, degrees = (text(angle_in(term, degrees=each)) for each in (False, True))
        return f"{degrees} deg  ({radians} rad)\n" if style.degrees else f"{radians} rad  ({degrees} deg)\n"
    if type_.kind == NUMBER:
        return f"{text(numbers[0])} {type_.unit}".rstrip() + "\n"
    if type_.kind == ANGLES:
        return f"rpy  {text(*numbers)}  rad{frame}\n     {text(*(each * DEGREES for each in numbers))}  deg\n"
    return f"linear  {text(*numbers[:3])}  m\nangular  {text(*numbers[3:])}  rad{frame}\n"  # a twist


def machine_text(term: Term, style: Style) -> str:
    """Write a value as a document or line of a machine format."""
    result = plain_result(term, style)
    if isinstance(result, Result) and is_trajectory(style.format):
        from frametool.stream.writers import write_poses

        return write_poses([result], style)
    held = {"arrays": "columns of numbers", "recording": "messages"}
    if what := next((held[each] for each in FORMATS[style.format].writes if each in held), ""):
        raise ValueInvalid(f"{style.format} holds {what}: calc writes rows of -i in it, not single values")
    module = import_module(FORMATS[style.format].writer)
    if isinstance(result, Result):
        return str(module.write_poses([result], style))
    if term.type.kind not in (POINT, VECTOR) and style.format not in ("json", "yaml"):
        raise ValueInvalid(f"{style.format} has no form for {term.type.named}; write it as text, json, yaml or csv")
    return str(module.write_points([result], style))


def machine_table(terms: Sequence[Term], style: Style) -> str:
    """Write values as a table."""
    from frametool.calc.rows import NAMES, RESULT
    from frametool.formats.rows.csv import write_poses

    def cells(term: Term) -> Any:
        result = plain_result(term, style)
        if isinstance(result, Result) or (style.place is not None and term.type.kind == POINT):
            return result
        if isinstance(result, float):
            return {RESULT: result}
        *frame, (key, numbers) = result.items()
        names = [name + "_deg" * (key == "rpy_deg") for name in NAMES[term.type.kind]]
        return dict(frame) | dict(zip(names, numbers, strict=True))

    return write_poses(map(cells, terms), style)
