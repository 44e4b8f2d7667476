"""Evaluate the sheets in `sheets.txt`, the text of derivations: a `Sheet` fills in the numbers of a run.

Also the steps that several sheets share, of angles and lengths.
"""

from __future__ import annotations

import math
import re
import string
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from frametool.errors import ValueInvalid
from frametool.explain.formula_tree import Value, evaluated, holds, parsed
from frametool.geometry import floats
from frametool.geometry import matrix as kernel
from frametool.geometry.quaternion import to_matrix

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from frametool.grammar.readers import Quaternion

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
LAST_STEP = 1e-9  # the convergence is quadratic: after such a step there is only rounding
MOST_STEPS = 60
STEP = re.compile(r"(\S+) = (.*?)(?:  \[(.*)\])?")


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

    shown: the formula whose numbers are shown, "" for a chosen value
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
    """A line of the result: a label, named numbers, a unit."""

    label: str
    cells: Sequence[tuple[str, str]]
    unit: str = ""


class SheetResult(NamedTuple):
    """The result of the command, with all digits."""

    text: str
    rows: Sequence[Row]


Item: TypeAlias = Words | SheetStep | MatrixLine | SheetResult


class Filler(string.Formatter):
    """Fills in words and values; a value without a format is formatted like the numbers of the sheet."""

    def __init__(self, number: Callable[[float], str]) -> None:
        """Store the formatting function of numbers."""
        self.number = number

    def format_field(self, value: Any, format_spec: str) -> str:
        """Format one field."""
        return self.number(value) if isinstance(value, float) and not format_spec else format(value, format_spec)


class Sheet:
    """Collects a derivation.

    digits: significant digits; None shows and continues with every bit
    clean: rounding errors of terms that cancel become 0 and stay 0 in later steps
    matrices: those named in steps of matrices
    reach: the largest of the positions, in metres, as the scale of rounding
    stretch: the factor by which rounding grows if poses are extrapolated
    """

    def __init__(self, digits: int | None = DIGITS, *, clean: bool) -> None:
        """Create an empty sheet."""
        self.digits, self.clean = digits, clean
        self.items: list[Item] = []
        self.matrices: dict[str, Matrix] = {}
        self.reach = 1.0
        self.stretch = 1.0
        self._headings = 0
        self._about = ""
        self._filler = Filler(self.number)

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

    def settled(self, value: Value) -> float:
        """Return a number as used by the following steps.

        Raises ValueInvalid if it is not finite.
        """
        number = value.settled if self.clean else value.number
        if not abs(number) < float("inf"):
            raise ValueInvalid(TOO_LARGE)
        return number + 0.0

    def heading(self, text: str) -> None:
        """Begin a part."""
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
        """Add a sheet, and return the values of its steps too: `values` with the new names."""
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
        return self._filler.vformat(text, (), {**values, **words})

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
            HELPERS[kind](self, values, *text.split())
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
            return self.settled(evaluated(parsed(formula), values))
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
        """Add a matrix, or a step of matrices: a product of them, with a sign before it or a vector added."""
        if " = " not in line:
            self.grid(line, "", [rows([values[each] for each in ENTRIES])])
            return
        name, formula, unit = _parts(line)
        product, _, shift = formula.removeprefix("-").partition(" + ")
        factors = [self._operand(each, values) for each in product.split()]
        added = [self._operand(shift, values)] if shift else []
        found = factors[0]
        for factor in factors[1:-1]:
            found = self.product(found, factor)
        found = self.product(found, factors[-1], *added)
        signs: list[str | Matrix] = ["-"] if formula.startswith("-") else []
        if signs:
            found = [[0.0 - entry for entry in row] for row in found]
        plus: list[str | Matrix] = ["+", *added] if shift else []
        self.grid(name, formula, [*signs, *factors, *plus, "=", found], unit)
        if len(found[0]) > 1:
            self.matrices[name] = found
        else:
            values.update(zip((name.rstrip("'") + each for each in "xyz"), (row[0] for row in found), strict=True))

    def _operand(self, name: str, values: Values) -> Matrix:
        """Return the matrix of a quaternion, R(q), a matrix, a transposed one, or a vector as a column."""
        if name.endswith("^T"):
            return transposed(self._operand(name[:-2], values))
        if name.startswith("R("):
            x, y, z, w = (values[name[2] + each] for each in "xyzw")
            return self.matrix((x, y, z, w))
        if name in self.matrices:
            return self.matrices[name]
        return [[values[name + each]] for each in "xyz"]

    def inner(self, row: Sequence[float], column: Sequence[float], *more: float) -> float:
        """Return the sum of products in their order, and of further terms: an entry of a product of matrices."""
        terms = [*(a * b for a, b in zip(row, column, strict=True)), *more]
        total = terms[0]
        for term in terms[1:]:
            total += term
        return self.settled(Value(total, max(map(abs, terms))))

    def product(self, a: Matrix, b: Matrix, *added: Matrix) -> Matrix:
        """Return a product of matrices, with others added."""
        columns = transposed(b)
        return [
            [self.inner(row, column, *(each[i][k] for each in added)) for k, column in enumerate(columns)]
            for i, row in enumerate(a)
        ]

    def matrix(self, q: Quaternion) -> Matrix:
        """Return the matrix of a quaternion as used by the following steps."""
        return rows([self.settled(Value(entry, 1.0)) for entry in to_matrix(*q)])

    def result(self, text: str, rows: Sequence[Row]) -> None:
        """End with the result."""
        self.items.append(SheetResult(text, rows))

    def chosen(self, values: Values, name: str, value: str, unit: str) -> None:
        """Add a value that is chosen, not derived."""
        values[name] = float(value)
        self.items.append(SheetStep(name, "", "", {name: self.number(values[name])}, f"{unit} (chosen)"))

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

    def direction(self, values: Values, name: str, parts: str, found: str, unit: str = "") -> None:
        """Add the length of a non-zero vector and its direction."""
        names, by = self.length(values, name, parts, unit)
        for each, part in zip(_each(found), names, strict=True):
            self.step(values, each, f"{part}/{by}")

    def length(self, values: Values, name: str, parts: str, unit: str = "") -> tuple[Sequence[str], str]:
        """Add the length of a vector; if squares leave the range of a double it is scaled first.

        Returns the names of numbers whose quotients are the direction.
        """
        names = _each(parts)
        most = max(abs(values[each]) for each in names)
        if most == 0.0 or TINY < most < HUGE:
            self.step(values, name, _norm(names), unit)
            return names, name
        self.say("Squares of these numbers leave the range of a double; they are divided by the largest first.")
        self.step(values, "m", f"max({', '.join(f'abs({each})' for each in names)})", unit)
        scaled = [f"k{letter}" for letter in "xyzw"[: len(names)]]
        for each, part in zip(scaled, names, strict=True):
            self.step(values, each, f"{part}/m")
        self.step(values, "k", _norm(scaled))
        self.step(values, name, "m*k", unit)
        return scaled, "k"

    def columns(self, values: Values, *letters: str) -> None:
        """Add the matrix of three columns."""
        entries = [[values[letter + each] for letter in letters] for each in "xyz"]
        self.grid("R", "(u v w)", [entries])
        values.update(zip(ENTRIES, [entry for row in entries for entry in row], strict=True))

    def nearest(self, values: Values) -> None:
        """Add the steps to the rotation nearest to a matrix; a rotation is unchanged."""
        here = rows([values[each] for each in ENTRIES])
        off = kernel.defect(*kernel.nine(entry for row in here for entry in row), floats)
        if off <= kernel.ORTHONORMAL:
            return
        self.play("nearest rotation", {"off": off})
        for count in range(1, MOST_STEPS + 1):
            there = rows(kernel.newton(*kernel.nine(part for row in here for part in row)))
            other = [[2.0 * b - a for a, b in zip(*pair, strict=True)] for pair in zip(here, there, strict=True)]
            name = f"M{count - 1 or ''}"
            parts: list[str | Matrix] = ["1/2·(", here, "+", other, ")", "=", there]
            self.grid(f"M{count}", f"1/2 ({name} + {name}^-T)", parts)
            step = max(abs(a - b) for pair in zip(here, there, strict=True) for a, b in zip(*pair, strict=True))
            here = there
            if step < LAST_STEP:
                break
        values.update(zip(ENTRIES, [entry for row in here for entry in row], strict=True))


WRITERS: dict[str, Callable[[Sheet, str], None]] = {
    HEADING: Sheet.heading, SENTENCE: Sheet.say, CAVEAT: Sheet.caveat,
}  # fmt: skip
HELPERS: dict[str, Callable[..., object]] = {
    "@angle": Sheet.angle, "@half": Sheet.half, "@direction": Sheet.direction, "@length": Sheet.length,
    "@columns": Sheet.columns, "@nearest": Sheet.nearest, "@chosen": Sheet.chosen,
}  # fmt: skip


def _for_each(line: str) -> Sequence[str]:
    """Repeat a line for each name in place of % or $; helper functions take names of vectors unchanged."""
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


def _parts(text: str) -> tuple[str, str, str]:
    """Return name, formula and unit of a step."""
    found = STEP.fullmatch(text)
    if found is None:
        raise ValueError(text)
    return found[1], found[2], found[3] or ""


def _norm(names: Sequence[str]) -> str:
    return f"sqrt({' + '.join(f'{name}**2' for name in names)})"


def rows(entries: Sequence[float]) -> Matrix:
    """Return nine numbers as three rows."""
    return [list(entries[at : at + 3]) for at in (0, 3, 6)]


def transposed(matrix: Sequence[Sequence[float]]) -> Matrix:
    """Return the columns of a matrix as rows."""
    return [list(column) for column in zip(*matrix, strict=True)]
