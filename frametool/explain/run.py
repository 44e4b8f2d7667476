"""Evaluate the sheets in `sheets.txt`, the text of derivations: a `Sheet` fills in the numbers of a run.

It also has the steps that several sheets share, of angles and lengths.  A formula is one string in Python's
arithmetic; its syntax tree gives the value, and in `render` the text and the LaTeX, so that the three cannot disagree.
The tree is interpreted; nothing is executed.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from contextlib import contextmanager
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from frametool.errors import ValueInvalid
from frametool.geometry import floats
from frametool.geometry import matrix as kernel
from frametool.geometry.quaternion import to_matrix

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    Values = dict[str, float]
    Matrix = list[list[float]]

ENTRIES = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))
TINY, HUGE = 1e-140, 1e140  # beyond, squares leave the range of a double
TWO_TURNS = 720.0  # degrees: the half angle in the formula has turned once
ROOTS = ("sqrt(0)/2", "sqrt(2)/2", "sqrt(4)/2", "sqrt(2)/2", "sqrt(0)/2", "-sqrt(2)/2", "-sqrt(4)/2", "-sqrt(2)/2")
EXACT = "Multiples of 90 deg are exact: no rounded pi comes into their sines and cosines."
HEADING, SENTENCE, CAVEAT = "#", ">", "!"
DIGITS = 6  # default of significant digits
TOO_LARGE = "the numbers are too large or too small for a derivation: a step is not finite"
MATRIX_STEP = re.compile(r"(-?)R(?:\((\w)\))?(\^T)? (\w+)(?: \+ (\w+))?")  # R(q) of qx .. qw, R of x y z w
STEP = re.compile(r"(\S+) = (.*?)(?:  \[(.*)\])?")
NOISE = 2e-15  # share of the larger term that the rounding of a few terms leaves where they cancel
FAR = 16.0  # radians: a larger angle is as written, not a multiple of a rounded pi
SUM, PRODUCT, SIGN, POWER = 1, 2, 3, 4  # precedence of operators
# operator -> precedence, text, function
OPERATORS: dict[type[ast.operator], tuple[int, str, Callable[[float, float], float]]] = {
    ast.Add: (SUM, " + ", operator.add), ast.Sub: (SUM, " - ", operator.sub), ast.Mult: (PRODUCT, "·", operator.mul),
    ast.Div: (PRODUCT, "/", operator.truediv), ast.Pow: (POWER, "^", lambda a, b: a ** int(b)),
}  # fmt: skip
# readers recompute a line with their own library: the values are those of `math`, not of the kernels
FUNCTIONS: dict[str, Callable[..., float]] = {
    "sin": math.sin, "cos": math.cos, "sqrt": math.sqrt, "atan2": math.atan2, "hypot": math.hypot, "abs": abs,
    "min": min, "max": max,
}  # fmt: skip
COMPARISONS: dict[type[ast.cmpop], Callable[[float, float], bool]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip


@lru_cache(maxsize=1024)
def parsed(formula: str) -> ast.expr:
    """Return the syntax tree of a formula."""
    return ast.parse(formula, mode="eval").body


def evaluated(node: ast.expr, values: Mapping[str, float], noise: float = 0.0) -> float:
    """Return the value of a tree; raises KeyError for a name without a value, ArithmeticError as `math` does.

    noise: a sum of terms that cancel is 0 if it is no larger than this share of them; so are a sine and a cosine,
        relative to their angle
    """
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            return math.pi if name == "pi" else values[name]
        case ast.UnaryOp(operand=operand):
            return -evaluated(operand, values, noise)
        case ast.Call(func=ast.Name(id=name), args=nodes):
            arguments = [evaluated(each, values, noise) for each in nodes]
            number = float(FUNCTIONS[name](*arguments))
            return cleaned(number, noise, min(abs(arguments[0]), FAR)) if name in ("sin", "cos") else number
        case ast.BinOp(left=left, op=sign, right=right):
            a, b = evaluated(left, values, noise), evaluated(right, values, noise)
            number = OPERATORS[type(sign)][2](a, b)
            return cleaned(number, noise, max(abs(a), abs(b))) if isinstance(sign, (ast.Add, ast.Sub)) else number
    raise ValueError(ast.dump(node))


def cleaned(number: float, noise: float, size: float) -> float:
    """Return a number, or 0 if it is only the rounding error of numbers of a size."""
    return 0.0 if abs(number) <= noise * size else number


def holds(condition: str, values: Mapping[str, float]) -> bool:
    """Return True if a comparison holds, or if a single number is not 0."""
    node = parsed(condition)
    if not isinstance(node, ast.Compare):
        return evaluated(node, values) != 0.0
    left, right = (evaluated(each, values) for each in (node.left, *node.comparators))
    return COMPARISONS[type(node.ops[0])](left, right)


class SheetLine(NamedTuple):
    """A line of a sheet, and the indented lines below it."""

    text: str
    body: Sequence[SheetLine]


@cache
def sheets() -> dict[str, Sequence[SheetLine]]:
    """Return the sheets by name."""
    _, *found = Path(__file__).with_name("sheets.txt").read_text(encoding="utf-8").split("\n== ")
    named = (each.rstrip("\n").split("\n") for each in found)
    return {name: nested(lines) for name, *lines in named}


def nested(lines: Sequence[str]) -> list[SheetLine]:
    """Attach indented lines to the line before them."""
    found: list[tuple[str, list[str]]] = []
    for line in lines:
        if line.startswith("  "):
            found[-1][1].append(line[2:])
        else:
            found.append((line, []))
    return [SheetLine(text, nested(body)) for text, body in found]


class Words(NamedTuple):
    """A line of words: a heading with its number, a sentence, or a caveat about a common mistake."""

    kind: str
    text: str


class SheetStep(NamedTuple):
    """A name and what it equals: formula, formula with numbers, value.

    shown: the formula whose numbers are shown
    numbers: the texts of the numbers in it, and of its value
    """

    name: str
    formula: str
    shown: str
    numbers: Mapping[str, str]
    unit: str = ""


class MatrixLine(NamedTuple):
    """A name, a formula, and matrices with signs between them; the last is the value."""

    name: str
    text: str
    parts: Sequence[str | Sequence[Sequence[str]]]
    unit: str = ""


class Row(NamedTuple):
    """A line of the result: a label, the numbers and their names, a unit."""

    label: str
    names: Sequence[str]
    numbers: Sequence[float]
    unit: str = ""


class SheetResult(NamedTuple):
    """The result of the command, with all digits."""

    text: str
    rows: Sequence[Row]


Item: TypeAlias = Words | SheetStep | MatrixLine | SheetResult


class Sheet:
    """Collects a derivation.

    digits: significant digits; None shows and continues with every bit
    clean: rounding errors of terms that cancel become 0 and stay 0 in later steps
    reach: the largest of the positions, in metres, as the scale of rounding
    stretch: the factor by which rounding grows if poses are extrapolated
    """

    def __init__(self, digits: int | None = DIGITS, *, clean: bool) -> None:
        """Create an empty sheet."""
        self.digits, self.noise = digits, NOISE * clean
        self.items: list[Item] = []
        self.reach = 1.0
        self.stretch = 1.0
        self._headings = 0
        self._about = ""

    def number(self, value: float) -> str:
        """Format a number: short if that is exact, else with all its digits, so that 0.500000 is a rounded one."""
        value += 0.0
        if self.digits is None:
            return repr(value)
        short = f"{value:.{self.digits}g}"
        if float(short) == value:
            return short
        rounded = f"{value:#.{self.digits}g}"
        return f"{value:.{self.digits - 1}e}" if rounded.endswith(".") else rounded

    def numbers(self, values: Sequence[float]) -> str:
        """Format numbers separated by blanks."""
        return " ".join(map(self.number, values))

    def settled(self, number: float, size: float = 0.0) -> float:
        """Return a number as used by the following steps; 0 if it is only the rounding error of numbers of a size.

        Raises ValueInvalid if it is not finite.
        """
        if not abs(number) < math.inf:
            raise ValueInvalid(TOO_LARGE)
        return cleaned(number, self.noise, size) + 0.0

    def heading(self, text: str) -> None:
        """Begin a numbered part."""
        self._headings += 1
        self.items.append(Words(HEADING, f"{self._headings}. {self._about}{text}"))

    @contextmanager
    def about(self, what: str) -> Iterator[None]:
        """Name the subject of a block in its headings."""
        outer, self._about = self._about, f"{self._about}{what}: "
        yield
        self._about = outer

    def reached(self, position: Sequence[float]) -> None:
        """Record the size of positions."""
        self.reach = max(self.reach, *map(abs, position))

    def say(self, text: str) -> None:
        """Add a sentence."""
        self.items.append(Words(SENTENCE, text))

    def caveat(self, text: str) -> None:
        """Add a caveat, once per sheet."""
        if Words(CAVEAT, text) not in self.items:
            self.items.append(Words(CAVEAT, text))

    def play(self, name: str, values: Values, /, **words: Any) -> Values:
        """Add the lines of a sheet; return `values` with the values of its steps."""
        self._play(sheets()[name], values, words)
        return values

    def _play(self, lines: Sequence[SheetLine], values: Values, words: dict[str, Any]) -> None:
        """Add lines; those below a condition only if it holds."""
        is_taken = False
        for text, body in lines:
            kind, _, rest = text.partition(" ")
            if kind not in ("if", "elif", "else"):
                for each in _for_each(text):
                    self._line(each, values, words)
                continue
            is_taken = is_taken and kind != "if"
            if not is_taken and (kind == "else" or holds(self._filled(rest, values, words), values)):
                is_taken = True
                self._play(body, values, words)

    def _filled(self, text: str, values: Values, words: Mapping[str, Any]) -> str:
        return text.format_map({name: self.number(value) for name, value in values.items()} | {**words})

    def _line(self, line: str, values: Values, words: dict[str, Any]) -> None:
        """Add one line."""
        kind, _, rest = line.partition(" ")
        text = self._filled(rest, values, words)
        if kind in WRITERS:
            WRITERS[kind](self, text)
        elif kind == "use":
            self._play(sheets()[text], values, words)
        elif kind == "word":
            name, _, words_text = text.partition(" = ")
            words[name] = words_text
        elif kind[0] == "@":
            getattr(self, kind[1:])(values, *text.split())
        elif kind == ":":
            self.matrix_step(values, text)
        elif kind == "let":
            name, formula, _ = _parts(text)
            values[name] = self.value(formula, values)
        else:
            name, formula, unit = _parts(self._filled(line, values, words))
            self.step(values, name, formula, unit)

    def value(self, formula: str, values: Values) -> float:
        """Return the value of a formula as used by the following steps.

        Raises ValueInvalid if it is not finite.
        """
        try:
            return self.settled(evaluated(parsed(formula), values, self.noise))
        except ArithmeticError:
            raise ValueInvalid(TOO_LARGE) from None

    def step(self, values: Values, name: str, formula: str, unit: str = "", *, exactly: str = "") -> float:
        """Add a step and store its value under its name.

        exactly: constants with the exact value, if the formula with rounded numbers is only close to it
        """
        value = values[name] = self.value(exactly or formula, values)
        numbers = {each: self.number(number) for each, number in values.items()}
        self.items.append(SheetStep(name, formula, exactly or formula, numbers, unit))
        return value

    def grid(self, name: str, text: str, parts: Sequence[str | Matrix], unit: str = "") -> None:
        """Add matrices side by side; the last one is the value."""
        shown = [part if isinstance(part, str) else [[self.number(v) for v in row] for row in part] for part in parts]
        self.items.append(MatrixLine(name, text, shown, unit))

    def matrix_step(self, values: Values, line: str) -> None:
        """Add a matrix, or a step: the matrix of a quaternion times a vector, negated or with a vector added."""
        if " = " not in line:
            self.grid(line, "", [rows([values[each] for each in ENTRIES])])
            return
        name, formula, unit = _parts(line)
        minus, prefix, transposed, *vectors = MATRIX_STEP.fullmatch(formula).groups("")  # type: ignore[union-attr]
        x, y, z, w = (values[prefix + each] for each in "xyzw")
        matrix = rows([self.settled(entry, 1.0) for entry in to_matrix(x, y, z, w)])
        if transposed:
            matrix = [list(column) for column in zip(*matrix, strict=True)]
        arm, *shift = ([values[each + axis] for axis in "xyz"] for each in vectors if each)
        found = []
        for at, row in enumerate(matrix):  # the sum of products in their order, then of the vector added
            first, *others = [*(a * b for a, b in zip(row, arm, strict=True)), *(each[at] for each in shift)]
            entry = self.settled(sum(others, first), max(map(abs, (first, *others))))
            found.append(0.0 - entry if minus else entry)
        parts: list[str | Matrix] = [minus] if minus else []
        parts += [matrix, _column(arm)]
        for each in shift:
            parts += ["+", _column(each)]
        self.grid(name, formula, [*parts, "=", _column(found)], unit)
        values.update(zip((name.rstrip("'") + axis for axis in "xyz"), found, strict=True))

    def result(self, text: str, rows: Sequence[Row]) -> None:
        """End with the result."""
        self.items.append(SheetResult(text, rows))

    def angle(self, values: Values, name: str) -> None:
        """Read an angle as written; degrees are converted to radians."""
        written = values.get(f"{name}_deg")
        if written is None:
            return
        values[f"{name}_deg"] = rest = math.fmod(written, TWO_TURNS)
        if rest != written:
            self.say(f"{name}: {written!r} deg less whole double turns of 720 deg is {rest!r} deg, exactly.")
        self.step(values, name, f"{name}_deg*pi/180", "rad")

    def half(self, values: Values, name: str, sine: str, cosine: str) -> None:
        """Add the cosine and the sine of half an angle; exact for suitable degrees."""
        turn = values.get(f"{name}_deg", 0.0) / 90.0  # the argument, in 45 degrees
        is_exact = turn != 0.0 and turn == int(turn)
        eighths = int(turn) if is_exact else 0
        self.step(values, cosine, f"cos({name}/2)", exactly=ROOTS[(eighths + 2) % 8] if is_exact else "")
        self.step(values, sine, f"sin({name}/2)", exactly=ROOTS[eighths % 8] if is_exact else "")
        if is_exact:
            self.caveat(EXACT)

    def length(self, values: Values, name: str, parts: str, unit: str = "") -> None:
        """Add the length of a vector."""
        names = _each(parts)
        most = max(abs(values[each]) for each in names)
        has_squares = most == 0.0 or TINY < most < HUGE
        root = f"sqrt({' + '.join(f'{each}**2' for each in names)})"
        self.step(values, name, root if has_squares else f"hypot({', '.join(names)})", unit)

    def nearest(self, values: Values) -> None:
        """Replace a matrix by the nearest rotation; a rotation is unchanged."""
        entries = kernel.nine(values[each] for each in ENTRIES)
        off = kernel.defect(*entries, floats)
        if off > kernel.ORTHONORMAL:
            values.update(zip(ENTRIES, kernel.nearest(*entries, floats), strict=True))
            self.play("nearest rotation", values, error=f"{off:.1e}")


WRITERS: dict[str, Callable[[Sheet, str], None]] = {
    HEADING: Sheet.heading, SENTENCE: Sheet.say, CAVEAT: Sheet.caveat,
}  # fmt: skip


def _for_each(line: str) -> Sequence[str]:
    """Return a line for each name in place of % or $; helper functions take names of vectors unchanged."""
    if line[0] in WRITERS:
        return [line]
    text, _, letters = line.partition("  for ")
    if letters:
        return [text.replace("%", each) for each in letters.split()]
    return [line] if line[0] == "@" else _each(line)


def _each(pattern: str) -> Sequence[str]:
    """Expand a pattern for x, y, z if it has %, for x, y, z, w if it has $."""
    for sign, letters in (("%", "xyz"), ("$", "xyzw")):
        if sign in pattern:
            return [pattern.replace(sign, letter) for letter in letters]
    return [pattern]


def _parts(text: str) -> tuple[str, ...]:
    """Return name, formula and unit of a step."""
    return STEP.fullmatch(text).groups("")  # type: ignore[union-attr]


def rows(entries: Sequence[float]) -> Matrix:
    """Return nine numbers as three rows."""
    return [list(entries[at : at + 3]) for at in (0, 3, 6)]


def _column(vector: Sequence[float]) -> Matrix:
    return [[entry] for entry in vector]
