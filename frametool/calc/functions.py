"""The values of expressions, and the operators and functions on them.

A value has a kind, frames, a unit, and its numbers, or the function that computes them.  An unknown frame is None,
shown as `?`, and matches any.  Numbers are components, floats or arrays of one shape.  Tables list, for each operator
and function, the kinds of its arguments, the rule for their frames and units, and the kernel.  An angle in degrees
remains in degrees where that is exact: in sums, and in sine and cosine.
"""

from __future__ import annotations

import operator
from math import inf, isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.calc.parser import METRE, PLAIN, RADIAN, CalcError, frame_text
from frametool.errors import ValueInvalid, first_of, shown
from frametool.geometry import euler, floats, quaternion, rigid, validation
from frametool.geometry.representations import EARTH_FRAMES
from frametool.geometry.validation import single

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry import Components, Namespace, Number, Rigid

    Kernel = Callable[..., Components]
    Check = Callable[..., str | None]

POSE, POINT, VECTOR, NUMBER = "pose", "point", "vector", "number"
TWIST, ANGLES, LIST, TREE = "twist", "angles", "list", "tree"
FRAMED = (POINT, VECTOR, TWIST, ANGLES)  # kinds with one frame


class Type(NamedTuple):
    """The kind, frames and unit of a value.

    target, source: the frames of a pose; a point, vector, twist or angles are expressed in `target`
    unit: that of a number: m, rad, s or ""
    degrees: True for an angle whose number is in degrees, so that right angles are exact
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
    """One row, or a block of rows.

    parts: its pose, point or vector; cells: the used columns by name; times_ns: its time; xp: the namespace of
        functions
    bound: id of the function that computes a name's value -> value, so that each is computed once
    """

    parts: Components
    cells: Mapping[str, Any]
    times_ns: Any
    xp: Namespace
    bound: dict[int, Components]


class Term(NamedTuple):
    """An evaluated part of an expression: its type, and its numbers, or the function that computes them from a row.

    parts: the numbers, None if they depend on a row; items: the values of a list; tree: for look-ups
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
    check: returns the reason why floats have no result, "" if they have one; or raises an error
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
    """Return True if two frames are the same, or may be because one is unknown."""
    return a is None or b is None or a == b or (a in EARTH_FRAMES and b in EARTH_FRAMES)


def wanted(term: Term) -> Term:
    """Return a term unchanged; raises CalcError for a tree or a list."""
    if term.type.kind == TREE:
        raise CalcError(f"{term.text} is a tree; ask it: {term.text}[TARGET<-SOURCE]")
    if term.type.kind == LIST:
        raise CalcError(f"{term.text} is a list of {len(term.items)}; only mean(..) takes one")
    return term


TO_RADIANS = 0.017453292519943295
# word in a rule other than a kind -> predicate
FITS: dict[str, Callable[[Term], bool]] = {
    "placed": lambda term: term.type.kind in (POINT, VECTOR),
    "free": lambda term: term.type.kind == POINT and term.type.target is None,
    "plain": lambda term: term.type.kind == NUMBER and term.type.unit == PLAIN,
    "scale": lambda term: term.type.kind == NUMBER and term.type.unit in (PLAIN, METRE),
    "angle": lambda term: term.type.kind == NUMBER and term.type.unit in (PLAIN, RADIAN),
    "degrees": lambda term: term.type.degrees,
    "1": lambda term: _constant(term) == 1.0,
    "-1": lambda term: _constant(term) == -1.0,
}
UNIT_OF = {"plain": PLAIN, "length": METRE, "angle": RADIAN}  # word for the result in a rule -> unit


def _constant(term: Term) -> Number | None:
    """Return the number of a plain number that is the same in all rows; None for other terms."""
    return term.parts[0] if term.type == PLAIN_NUMBER and term.parts and single(term.parts) else None


class Overload(NamedTuple):
    """One signature of an operator or function: a rule for kinds, frames and units, and the kernel.

    rule: `pose.ab pose.bc -> pose.ac`, a kind or a word of FITS for each argument with letters for its frames, target
        first, or for the unit of a number; equal letters must be the same frame or unit; `..` repeats the only argument
    check: returns the reason why floats have no result, "" if they have one; or raises an error
    """

    rule: str
    kernel: Kernel
    check: Check | None = None

    def result(self, sign: str, terms: Sequence[Term]) -> Term | None:
        """Return the result; None if kinds or units do not fit; raises CalcError if frames do not match."""
        takes, gives = self.rule.split(" -> ")
        words = takes.split()
        words = words[:1] * len(terms) if words[-1] == ".." else words
        types = [term.type for term in terms]
        if not types or len(words) != len(types):
            return None
        for word, term in zip(words, terms, strict=True):
            own, _, _ = word.partition(".")
            if not (FITS[own](term) if own in FITS else term.type.kind == own):
                return None
        if (known := _unified(sign, words, types)) is None:
            return None
        if "angle" in words or len({type_.degrees for type_ in types if type_.unit == RADIAN}) > 1:
            terms = [*map(in_radians, terms)]
        kind, _, letters = gives.partition(".")
        if kind == NUMBER:
            type_ = Type(NUMBER, unit=known[letters] or PLAIN, degrees=any(term.type.degrees for term in terms))
        elif kind in UNIT_OF:
            type_ = Type(NUMBER, unit=UNIT_OF[kind])
        else:
            type_ = Type(kind, known.get(letters[:1]), known.get(letters[1:]))
        return made(type_, self.kernel, *terms, check=self.check)


def _unified(sign: str, words: Sequence[str], types: Sequence[Type]) -> dict[str, str | None] | None:
    """Return the frame or the unit of each letter of a rule; None if units differ.

    Raises CalcError if frames differ.
    """
    found: dict[str, str | None] = {}
    for word, type_ in zip(words, types, strict=True):
        values = (type_.unit,) if type_.kind == NUMBER else (type_.target, type_.source)
        for letter, value in zip(word.partition(".")[2], values, strict=False):
            known = found.setdefault(letter, value)
            if not meet(known, value):
                if type_.kind == NUMBER:
                    return None
                texts = [str(each) if each.kind == POSE else each.named for each in types]
                text = f"{sign}({first_of(texts, 3)})" if sign in FUNCTIONS else f" {sign} ".join(texts)
                remark = "do not touch" if sign == "*" else "must be one frame"
                raise CalcError(f"{text}: {shown(known)} and {shown(value)} {remark}")
            found[letter] = value if known is None else known
    return found


def in_radians(term: Term) -> Term:
    """Return an angle with its number in radians."""
    if not term.type.degrees:
        return term
    return made(term.type._replace(degrees=False), lambda angle, _: (angle * TO_RADIANS,), term)


def numbers_in(term: Term, row: RowValues | None = None, *, degrees: bool = False) -> Components:
    """Return the numbers of a value, angles in degrees or radians; an angle written in degrees is exact in degrees."""
    is_angle = degrees and (term.type.kind == ANGLES or term.type.unit == RADIAN)
    if is_angle and term.type.degrees:
        return term.at(row)
    numbers = in_radians(term).at(row)
    return tuple(number * floats.RADIAN for number in numbers) if is_angle else numbers


# --- kernels: they take the numbers of all arguments, and the namespace of their functions ---


def plain(kernel: Callable[..., Components]) -> Kernel:
    """Return a kernel that ignores the namespace."""
    return lambda *numbers: kernel(*numbers[:-1])


def _by_part(operation: Callable[[Number, Number], Number]) -> Kernel:
    """Return the kernel that combines two numbers, or two vectors component by component."""

    def kernel(*numbers: Number) -> Components:
        half = len(numbers) // 2
        return tuple(map(operation, numbers[:half], numbers[half:-1]))

    return kernel


_PLUS, _MINUS, _TIMES, _OVER = map(_by_part, (operator.add, operator.sub, operator.mul, operator.truediv))
_NEGATED = plain(lambda *numbers: tuple(0.0 - number for number in numbers))
_SAME = plain(lambda *numbers: numbers)


def _line(*numbers: Number) -> Components:
    fraction = numbers[6]
    return tuple(a + fraction * (b - a) for a, b in zip(numbers[:3], numbers[3:6], strict=True))


def unit_pose(*parts: Number) -> Rigid:
    """Return a pose with its quaternion normalised, which products preserve only to a few eps.

    parts: of the pose, and the namespace
    """
    tx, ty, tz, x, y, z, w, xp = parts
    return tx, ty, tz, *quaternion.unit(x, y, z, w, xp)


def _of_unit(kernel: Callable[..., Components]) -> Kernel:
    """Return a kernel that normalises the quaternion of its pose first."""
    return lambda *pose: kernel(*unit_pose(*pose), pose[-1])


def _angle_between_vectors(
    ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number, xp: Namespace
) -> Components:
    """Return the angle between two vectors: 2 atan2(|b - a|, |a + b|) of their directions (Kahan)."""
    ax, ay, az = quaternion.unit_vector(ax, ay, az, xp)
    bx, by, bz = quaternion.unit_vector(bx, by, bz, xp)
    apart = quaternion.length(0.5 * (bx - ax), 0.5 * (by - ay), 0.5 * (bz - az), xp)
    along = quaternion.length(0.5 * (bx + ax), 0.5 * (by + ay), 0.5 * (bz + az), xp)
    return (2.0 * floats.incline(apart, along, xp),)


def _mean_parts(width: int) -> Kernel:
    def mean(*numbers: Number) -> Components:
        parts = numbers[:-1]
        return tuple(sum(parts[at + width :: width], parts[at]) / (len(parts) // width) for at in range(width))

    return mean


def _mean_pose(*parts: Number) -> Components:
    """Return the mean of translations and the chordal mean of rotations (Markley et al. 2007)."""
    import numpy as np

    *numbers, xp = parts
    columns = [numbers[at::7] for at in range(7)]
    shift = (sum(column[1:], column[0]) / len(column) for column in columns[:3])
    rotations = tuple(np.stack(np.broadcast_arrays(*column)) for column in columns[3:])
    return (*shift, *xp.canonical_sign(*validation.mean_quaternion(rotations, np.ones(len(columns[0])))))


def _part_of_motion(*numbers: Number) -> Components:
    *pose, fraction, xp = numbers
    vx, vy, vz, wx, wy, wz = (fraction * part for part in rigid.log(*unit_pose(*pose, xp), xp))
    return rigid.exp(vx, vy, vz, wx, wy, wz, xp)


def _power(base: Number, exponent: Number, xp: Namespace) -> Components:
    """Return a power; nan if it is not real, infinite if it is too large."""
    if xp is not floats:
        import numpy as np

        powers: Any = np.frompyfunc(lambda a, b: _power(a, b, floats)[0], 2, 1)  # numpy's own differs from floats'
        return (powers(base, exponent).astype(float),)
    try:
        result = base**exponent
    except (OverflowError, ZeroDivisionError):
        return (inf,)
    return (nan if isinstance(result, complex) else float(result),)


def _leg(value: Number, xp: Namespace) -> Number:
    """Return sqrt(1 - value^2)."""
    return xp.sqrt((1.0 - value) * (1.0 + value))


# --- checks ---


def _no_division(*numbers: float) -> str:
    return "division by zero" if numbers[-1] == 0.0 else ""


def _no_power(base: float, exponent: float) -> str:
    if base == 0.0 and exponent < 0.0:
        return "division by zero"
    return f"{base:g} has no power {exponent:g}" if base < 0.0 and exponent != int(exponent) else ""


def _within(name: str, least: float, most: float, words: str) -> Check:
    return lambda value: "" if least <= value <= most else f"{name}() takes {words}, found {value:g}"


# --- the tables ---


# rules common to sums and differences
SUMS = [f"{each} {each} -> {each}" for each in ("number.u", "vector.a", "twist.a")] + ["point.a vector.a -> point.a"]


# operator -> message if no overload fits, overloads
OPERATORS: dict[str, tuple[str, Sequence[Overload]]] = {
    "*": ("multiply {} by {}", [
        Overload("pose.ab pose.bc -> pose.ac", plain(rigid.compose)),
        Overload("pose.ab point.b -> point.a", plain(rigid.apply)),
        Overload("pose.ab vector.b -> vector.a", lambda *numbers: quaternion.rotate(*numbers[3:-1])),
        Overload("number.u plain -> number.u", _TIMES),
        Overload("plain number.u -> number.u", _TIMES),
        Overload("scale vector.a -> vector.a", plain(lambda n, x, y, z: (n * x, n * y, n * z))),
        Overload("vector.a scale -> vector.a", plain(lambda x, y, z, n: (n * x, n * y, n * z))),
    ]),
    "/": ("divide {} by {}", [
        Overload("number.u plain -> number.u", _OVER, _no_division),
        Overload("number.u number.u -> plain", _OVER, _no_division),
        Overload("vector.a scale -> vector.a", plain(lambda x, y, z, n: (x / n, y / n, z / n)), _no_division),
    ]),
    "+": ("add {} and {}", [
        Overload(rule, _PLUS) for rule in (*SUMS, "vector.a point.a -> point.a", "free free -> point")]),
    "-": ("subtract {} and {}", [Overload(rule, _MINUS) for rule in (*SUMS, "point.a point.a -> vector.a")]),
    "^": ("raise {} to {}: a power is that of a pose or a plain number, an exponent a plain number", [
        Overload("pose.ab 1 -> pose.ab", lambda *numbers: numbers[:7]),
        Overload("pose.ab -1 -> pose.ba", lambda *numbers: rigid.inverse(*numbers[:7])),
        Overload("pose.ab plain -> pose.a", _part_of_motion),
        Overload("plain plain -> plain", _power, _no_power),
    ]),
    "negate": ("negate {}", [
        Overload(rule, _NEGATED)
        for rule in ("number.u -> number.u", "vector.a -> vector.a", "twist.a -> twist.a", "free -> point")]),
    "list": ("make a point (3 lengths) or twist (lengths, angles) of {count} numbers; rotations: {{rpy_deg: [..]}}", [
        Overload("scale scale scale -> point", _SAME),
        Overload("scale scale scale angle angle angle -> twist", _SAME),
    ]),
}  # fmt: skip


def _angular(pick: Callable[[Number, Number], Number]) -> list[Overload]:
    """Return the overloads of a function of an angle, from its sine and cosine; exact at quarter turns in degrees."""
    return [
        Overload("degrees -> plain", lambda value, xp: (pick(*floats.half_sincos_deg(2.0 * value, xp)),)),
        Overload("angle -> plain", lambda value, xp: (pick(*floats.half_sincos(2.0 * value, xp)),)),
    ]


# function -> description of its arguments, overloads
FUNCTIONS: dict[str, tuple[str, Sequence[Overload]]] = {
    "inv": ("a pose", [Overload("pose.ab -> pose.ba", plain(rigid.inverse))]),
    "trans": ("a pose", [Overload("pose.ab -> point.a", lambda *pose: pose[:3])]),
    "rot": ("a pose", [
        Overload("pose.ab -> pose.ab", lambda *pose: (*(0.0 * part for part in pose[:3]), *pose[3:7]))]),
    "rpy": ("a pose", [Overload("pose.ab -> angles.a", _of_unit(
        lambda _x, _y, _z, x, y, z, w, xp: euler.from_quaternion(x, y, z, w, "sxyz", xp)))]),
    "log": ("a pose", [Overload("pose.ab -> twist.a", _of_unit(rigid.log))]),
    "exp": ("six numbers [vx, vy, vz, wx, wy, wz]", [Overload("twist.a -> pose.a", rigid.exp, rigid.check_twist)]),
    "dist": ("two poses or two points", [
        Overload("pose.ab pose.ac -> length", lambda *both: rigid.distance(*both)[:1]),
        Overload("point.a point.a -> length", lambda ax, ay, az, bx, by, bz, xp: (
            quaternion.magnitude(bx - ax, by - ay, bz - az, xp),)),
    ]),
    "angle": ("a pose, two poses or two vectors", [
        Overload("pose.ab -> angle", _of_unit(lambda *pose: rigid.extent(*pose)[1:])),
        Overload("pose.ab pose.ac -> angle", lambda *both: rigid.distance(
            *unit_pose(*both[:7], both[14]), *unit_pose(*both[7:]), both[14])[1:]),
        Overload("placed.a placed.a -> angle", _angle_between_vectors, lambda *both: (
            "" if any(both[:3]) and any(both[3:])
            else "vector 0 0 0 has no direction; the angle to it is not defined")),
    ]),
    "interp": ("two poses, points or vectors and a fraction", [
        Overload("pose.ab pose.ab plain -> pose.ab", rigid.interpolate),
        Overload("point.a point.a plain -> point.a", _line),
        Overload("vector.a vector.a plain -> vector.a", _line),
    ]),
    "mean": ("poses, points, vectors or numbers of one unit, or a list", [
        Overload("pose.ab .. -> pose.ab", _mean_pose),
        Overload("point.a .. -> point.a", _mean_parts(3)),
        Overload("vector.a .. -> vector.a", _mean_parts(3)),
        Overload("number.u .. -> number.u", _mean_parts(1)),
    ]),
    "vector": ("[x, y, z]", [Overload("placed.a -> vector.a", _SAME)]),
    "norm": ("a vector", [Overload("placed.a -> length", lambda *vector: (quaternion.magnitude(*vector),))]),
    "dot": ("two vectors", [
        Overload("placed.a placed.a -> plain", plain(
            lambda ax, ay, az, bx, by, bz: (ax * bx + ay * by + az * bz,)))]),
    "cross": ("two vectors", [Overload("placed.a placed.a -> vector.a", plain(quaternion.cross))]),
    "sin": ("an angle", _angular(lambda sine, _: sine)),
    "cos": ("an angle", _angular(lambda _, cosine: cosine)),
    "tan": ("an angle", _angular(lambda sine, cosine: sine / cosine)),
    "asin": ("a plain number", [Overload("plain -> angle", lambda value, xp: (
        floats.bearing(value, _leg(value, xp), 1.0, xp),), _within("asin", -1.0, 1.0, "-1 .. 1"))]),
    "acos": ("a plain number", [Overload("plain -> angle", lambda value, xp: (
        floats.bearing(_leg(value, xp), value, 1.0, xp),), _within("acos", -1.0, 1.0, "-1 .. 1"))]),
    "atan": ("a plain number", [Overload("plain -> angle", lambda value, xp: (
        floats.bearing(value, 1.0, quaternion.magnitude(value, 1.0, 0.0, xp), xp),))]),
    "sqrt": ("a plain number", [
        Overload("plain -> plain", lambda value, xp: (xp.sqrt(value),), _within(
            "sqrt", 0.0, inf, "what is not negative"))]),
}  # fmt: skip


def called(name: str, terms: Sequence[Term]) -> Term:
    """Return the result of an operator or a function; raises CalcError."""
    takes, overloads = FUNCTIONS.get(name) or OPERATORS[name]
    for each in overloads:  # the first that fits the arguments
        if (found := each.result(name, terms)) is not None:
            return found
    types = [term.type.named for term in terms]
    if name in FUNCTIONS:
        raise CalcError(f"{name}() takes {takes}, found {first_of(types, 3) or 'nothing'}")
    raise CalcError(f"cannot {takes.format(*types, count=len(terms))}")
