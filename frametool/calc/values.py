"""The values of expressions: their kind, frames and units, and their numbers, or the function that computes them.

An unknown frame is None, shown as `?`, and matches any.  Numbers are components, floats or arrays of one shape.
"""

from __future__ import annotations

from math import inf, isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.calc.parser import PLAIN, CalcError, frame_text
from frametool.errors import ValueInvalid, shown
from frametool.geometry import floats
from frametool.geometry.representations import EARTH_FRAMES
from frametool.geometry.validation import single

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Components, Namespace

    Kernel = Callable[..., Components]
    Check = Callable[..., str | None]

POSE, POINT, VECTOR, NUMBER = "pose", "point", "vector", "number"
TWIST, ANGLES, LIST, TREE = "twist", "angles", "list", "tree"


class Type(NamedTuple):
    """What is known of a value without its numbers.

    target, source: the frames of a pose; a point, vector, twist or angles are in `target`
    unit: that of a number: m, rad, s or none
    degrees: of an angle whose number is in degrees, so that right angles are exact
    """

    kind: str
    target: str | None = None
    source: str | None = None
    unit: str = PLAIN
    degrees: bool = False

    def __str__(self) -> str:
        """Format the frames of a pose, target<-source."""
        return f"{frame_text(self.target)}<-{frame_text(self.source)}"

    @property
    def named(self) -> str:
        """Return a description for messages."""
        if self.kind == POSE:
            return f"the pose {self}"
        if self.kind == NUMBER:
            return "a number" if self.unit == PLAIN else f"a number in {self.unit}"
        if self.kind == LIST:
            return "a list"
        what = "angles" if self.kind == ANGLES else f"a {self.kind}"
        return what if self.target is None else f"{what} in {shown(self.target)}"


PLAIN_NUMBER = Type(NUMBER)


class RowValues(NamedTuple):
    """One row, or a block of rows: its pose, point or vector, the used columns, its time, and the functions.

    bound: the values of names by the id of the function that computes them, so that each is computed once
    """

    parts: Components
    cells: Mapping[str, Any]
    times_ns: Any
    xp: Namespace
    bound: dict[int, Components]


class Term(NamedTuple):
    """An evaluated part of an expression: its type, and its numbers, or the function that computes them from a row.

    parts: None if they depend on a row; items: those of a list; tree: for look-ups
    text: as written
    """

    type: Type
    parts: Components | None = None
    compute: Callable[[RowValues], Components] | None = None
    items: tuple[Term, ...] = ()
    tree: Frames | None = None
    text: str = ""

    def at(self, row: RowValues | None) -> Components:
        """Return the numbers, computed from a row if necessary."""
        if self.parts is not None:
            return self.parts
        if row is None or self.compute is None:
            raise CalcError("row is known in streams only: -i FILE, or standard input")
        return self.compute(row)


def made(type_: Type, kernel: Kernel, *operands: Term, check: Check | None = None) -> Term:
    """Return the result of a kernel for the numbers of all operands: at once if they are known, else for each row.

    kernel: takes the numbers, then the namespace with their functions
    check: returns the reason why floats have no result, if there is one, or raises it
    """

    def computed(row: RowValues | None) -> Components:
        numbers = tuple(part for each in operands for part in each.at(row))
        if single(numbers):
            return _of_floats(kernel, numbers, check)
        return kernel(*numbers, row.xp) if row is not None else _of_arrays(kernel, numbers, check)

    if all(each.parts is not None for each in operands):
        return Term(type_, computed(None))
    return Term(type_, None, computed)


def _of_floats(kernel: Kernel, numbers: Components, check: Check | None) -> Components:
    """Run a kernel on floats; a result that is not finite is an error."""
    if check is not None and (reason := check(*numbers)):
        raise CalcError(reason)
    try:
        result = kernel(*numbers, floats)
    except ValueInvalid as error:
        raise CalcError(str(error)) from None
    except (ZeroDivisionError, OverflowError, ValueError):
        result = (inf,)
    if not all(map(isfinite, result)):
        raise CalcError("the result is not finite")
    return result


def _of_arrays(kernel: Kernel, numbers: Components, check: Check | None) -> Components:
    """Run a kernel on arrays of one shape; the first element without a finite result is an error."""
    import numpy as np

    from frametool.geometry import arrays

    with np.errstate(all="ignore"):
        result = kernel(*numbers, arrays)
    bad = np.flatnonzero(~np.logical_and.reduce([np.isfinite(np.asarray(part)) for part in result]))
    if bad.size:
        full = np.broadcast_arrays(*numbers)
        try:
            _of_floats(kernel, tuple(float(part.reshape(-1)[bad[0]]) for part in full), check)
        except CalcError as error:
            raise CalcError(f"{error} (element {bad[0]})") from None
    return result


def meet(a: str | None, b: str | None) -> bool:
    """Return True if two frames may be the same."""
    return a is None or b is None or a == b or (a in EARTH_FRAMES and b in EARTH_FRAMES)


def wanted(term: Term) -> Term:
    """Refuse a tree or a list where one value is expected."""
    if term.type.kind == TREE:
        raise CalcError(f"{term.text} is a tree; ask it: {term.text}[TARGET<-SOURCE]")
    if term.type.kind == LIST:
        raise CalcError(f"{term.text} is a list of {len(term.items)}; only mean(..) takes one")
    return term
