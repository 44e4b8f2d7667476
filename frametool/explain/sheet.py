"""A derivation while it is written: headings, sentences, steps, matrices, caveats, and the result at its end.

Also the steps that several blocks share, of angles and lengths, and how the names of formulas are written in LaTeX.
"""

from __future__ import annotations

import math
import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from frametool.errors import ValueInvalid
from frametool.explain.formula_tree import Value, as_latex, as_text, evaluated, latex_number, parsed
from frametool.geometry.quaternion import to_matrix

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.grammar.readers import Quaternion, Vector

    Values = dict[str, float]
    Matrix = list[list[float]]

SYMBOLS = {
    "roll": r"\phi", "pitch": r"\theta", "yaw": r"\psi", "angle": r"\vartheta", "arc": r"\Omega", "pi": r"\pi",
    "bearing": r"\beta", "det": r"\det R", "norm": r"\lVert q \rVert", "tr": r"\operatorname{tr} R",
    "dot": r"a \cdot b", "ww": "4 w^2", "xx": "4 x^2", "yy": "4 y^2", "zz": "4 z^2", "pp": r"\lvert p \rvert^2",
    "a1": r"\alpha_1", "a2": r"\alpha_2", "a3": r"\alpha_3",
}  # fmt: skip
INDEXED = re.compile(r"([a-zA-Z])([0-9]{1,2}|[a-zA-Z][0-9]?)")


def symbol(name: str) -> str:
    """Return a name as LaTeX: Greek where that is the custom, an index where there is one, else upright."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    if name.endswith("_deg"):
        return rf"{symbol(name[:-4])}^{{\circ}}"
    if len(name) == 1:
        return name
    if found := INDEXED.fullmatch(name):
        return f"{found[1]}_{{{found[2]}}}"
    return rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"


XYZ, XYZW = ("x", "y", "z"), ("x", "y", "z", "w")
CYCLES = (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y"))
ENTRIES = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))
DET = "r11*(r22*r33 - r23*r32) + r12*(r23*r31 - r21*r33) + r13*(r21*r32 - r22*r31)"
COLUMNS = "Column k is axis k of the source frame, written in the target frame."
TINY, HUGE = 1e-140, 1e140  # beyond, squares leave the range of a double
TWO_TURNS = 720.0  # degrees: the half angle inside has turned once
ROOTS = ("sqrt(0)/2", "sqrt(2)/2", "sqrt(4)/2", "sqrt(2)/2", "sqrt(0)/2", "-sqrt(2)/2", "-sqrt(4)/2", "-sqrt(2)/2")
EXACT = "Multiples of 90 deg are exact: no rounded pi comes into their sines and cosines."
METRES, RADIANS, DEGREES = "m", "rad", "deg"
HEADING, SENTENCE, CAVEAT = "heading", "sentence", "caveat"
DIGITS = 6  # significant ones, unless another count is asked for
TOO_LARGE = "the numbers are too large or too small for a derivation: a step is not finite"


class Words(NamedTuple):
    """A line of words: a heading with its number, a sentence, or a caveat, which is what is easily got wrong."""

    kind: str
    text: str


class SheetStep(NamedTuple):
    """A name and what it equals: formula, formula with numbers, value; each as text and as LaTeX."""

    name: str
    texts: Sequence[str]
    latex_name: str
    latex: Sequence[str]
    unit: str = ""


class MatrixLine(NamedTuple):
    """A name, a formula, and matrices with signs between them; the last is the value."""

    name: str
    text: str
    latex: str
    parts: Sequence[str | Sequence[Sequence[str]]]
    unit: str = ""


class Row(NamedTuple):
    """A line of the result: a label, named numbers, a unit."""

    label: str
    cells: Sequence[tuple[str, str]]
    unit: str = ""


class SheetResult(NamedTuple):
    """The result as the command prints it, all digits."""

    text: str
    rows: Sequence[Row]


Item: TypeAlias = Words | SheetStep | MatrixLine | SheetResult


class Sheet:
    """Collects a derivation.

    digits: significant ones; None shows and continues with every bit
    clean: what rounding leaves of terms that cancel becomes 0 and stays 0 in what follows
    reach: the largest of the positions, in metres: rounding is measured by it
    stretch: how many times rounding grows where poses are extrapolated
    """

    def __init__(self, digits: int | None = DIGITS, *, clean: bool | None = None) -> None:
        """Begin an empty sheet."""
        self.digits = digits
        self.clean = digits is not None if clean is None else clean
        self.items: list[Item] = []
        self.reach = 1.0
        self.stretch = 1.0
        self._headings = 0
        self._about = ""
        self._warned: set[str] = set()

    def number(self, value: float) -> str:
        """Write a number: short where that is exact, else with all its digits, so that 0.500000 is a rounded one."""
        value += 0.0
        if self.digits is None:
            return repr(value)
        short = f"{value:.{self.digits}g}"
        if float(short) == value:
            return short
        rounded = f"{value:#.{self.digits}g}"
        return f"{value:.{self.digits - 1}e}" if rounded.endswith(".") else rounded

    def numbers(self, values: Sequence[float]) -> str:
        """Write numbers with blanks between them."""
        return " ".join(map(self.number, values))

    def settled(self, value: Value) -> float:
        """Return a number as the steps after it take it.

        Raises ValueInvalid for one that is not finite.
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
        """Name in the headings of a block what they are about."""
        outer, self._about = self._about, f"{self._about}{what}: "
        yield
        self._about = outer

    def reached(self, position: Sequence[float]) -> None:
        """Remember how large positions are."""
        self.reach = max(self.reach, *map(abs, position))

    def say(self, text: str) -> None:
        """Add a sentence."""
        self.items.append(Words(SENTENCE, text))

    def caveat(self, text: str) -> None:
        """Add a caveat, once a sheet."""
        if text not in self._warned:
            self._warned.add(text)
            self.items.append(Words(CAVEAT, text))

    def step(self, values: Values, name: str, formula: str, unit: str = "", *, exactly: str = "") -> float:
        """Add a step and keep its value under its name.

        exactly: constants that are the value exactly, where the formula with rounded numbers would only be near it
        """
        tree = parsed(formula)
        shown = parsed(exactly) if exactly else tree
        try:
            value = values[name] = self.settled(evaluated(shown, values))
        except ArithmeticError:
            raise ValueInvalid(TOO_LARGE) from None
        digits = {each: self.number(number) for each, number in values.items()}
        texts = [as_text(tree, lambda each: each), as_text(shown, lambda each: digits.get(each, each))]
        latex = [
            as_latex(tree, symbol),
            as_latex(shown, lambda each: latex_number(digits[each]) if each in digits else symbol(each)),
        ]
        if texts[1] in (texts[0], digits[name]):
            del texts[1], latex[1]
        texts, latex = [*texts, digits[name]], [*latex, latex_number(digits[name])]
        self.items.append(SheetStep(name, texts, symbol(name), latex, unit))
        return value

    def each(self, values: Values, names: Sequence[str], name: str, formula: str, unit: str = "") -> list[float]:
        """Add one step for each of some names, which stand in the place of %."""
        return [self.step(values, name.replace("%", each), formula.replace("%", each), unit) for each in names]

    def grid(self, name: str, text: str, latex: str, parts: Sequence[str | Matrix], unit: str = "") -> None:
        """Add matrices side by side; the last one is the value."""
        shown = [part if isinstance(part, str) else [[self.number(v) for v in row] for row in part] for part in parts]
        self.items.append(MatrixLine(name, text, latex, shown, unit))

    def aside(self) -> Sheet:
        """Return an empty sheet for steps that are not shown."""
        return Sheet(self.digits, clean=self.clean)

    def chosen(self, values: Values, name: str, value: float, unit: str) -> None:
        """Add a value that is chosen, not derived."""
        values[name] = value
        text = self.number(value)
        self.items.append(SheetStep(name, [text], symbol(name), [text], f"{unit} (chosen)"))

    def inner(self, row: Sequence[float], column: Sequence[float], *more: float) -> float:
        """Return the sum of products in their order, and of further terms: an entry of a product of matrices."""
        terms = [*(a * b for a, b in zip(row, column, strict=True)), *more]
        total = terms[0]
        for term in terms[1:]:
            total += term
        return self.settled(Value(total, max(map(abs, terms))))

    def product(self, a: Matrix, b: Matrix) -> Matrix:
        """Return a product of matrices."""
        columns = transposed(b)
        return [[self.inner(row, column) for column in columns] for row in a]

    def take_angle(self, values: Values, name: str, written: float, *, degrees: bool) -> None:
        """Take an angle as it is written; one in degrees becomes radians."""
        if not degrees:
            values[name] = written
            return
        values[f"{name}_deg"] = rest = math.fmod(written, TWO_TURNS)
        if rest != written:
            self.say(f"{name}: {written!r} deg less whole double turns of 720 deg is {rest!r} deg, exactly.")
        self.step(values, name, f"{name}_deg*pi/180", RADIANS)

    def sine_and_cosine(self, values: Values, name: str, sine: str, cosine: str) -> None:
        """Add the cosine and the sine of half an angle; exact where degrees say so."""
        inside = f"{name}/2"
        turn = values.get(f"{name}_deg", 0.0) / 90.0  # the argument, in 45 degrees
        is_exact = turn != 0.0 and turn == int(turn)
        eighths = int(turn) if is_exact else 0
        self.step(values, cosine, f"cos({inside})", exactly=ROOTS[(eighths + 2) % 8] if is_exact else "")
        self.step(values, sine, f"sin({inside})", exactly=ROOTS[eighths % 8] if is_exact else "")
        if is_exact:
            self.caveat(EXACT)

    def direction(
        self, values: Values, names: Sequence[str], parts: Sequence[str], name: str, measure: str = ""
    ) -> float:
        """Add the length of a non-zero vector and its direction."""
        found, divided, by = self.length(values, names, name, measure)
        for each, part in zip(parts, divided, strict=True):
            self.step(values, each, f"{part}/{by}")
        return found

    def length(
        self, values: Values, names: Sequence[str], name: str, measure: str = ""
    ) -> tuple[float, Sequence[str], str]:
        """Add the length of a vector; one whose squares leave the range of a double is scaled first.

        Returns it, and the names of numbers whose quotients are the direction.
        """
        most = max(abs(values[each]) for each in names)
        if most == 0.0 or TINY < most < HUGE:
            return self.step(values, name, norm(names), measure), names, name
        self.say("Squares of these numbers leave the range of a double; they are divided by the largest first.")
        self.step(values, "m", f"max({', '.join(f'abs({each})' for each in names)})", measure)
        scaled = [f"k{letter}" for letter in "xyzw"[: len(names)]]
        for each, part in zip(scaled, names, strict=True):
            self.step(values, each, f"{part}/m")
        self.step(values, "k", norm(scaled))
        return self.step(values, name, "m*k", measure), scaled, "k"

    def angles(self, values: Values, names: Sequence[str], *, degrees: bool) -> Sequence[float]:
        """Return angles, in degrees with the steps to them."""
        if not degrees:
            return [values[name] for name in names]
        return self.each(values, names, "%_deg", "%*180/pi", DEGREES)

    def matrix(self, q: Quaternion) -> Matrix:
        """Return the matrix of a quaternion as the steps after it take it."""
        return rows([self.settled(Value(entry, 1.0)) for entry in to_matrix(*q)])

    def result(self, text: str, rows: Sequence[Row]) -> None:
        """End with the result."""
        self.items.append(SheetResult(text, rows))


def norm(names: Sequence[str] = XYZW) -> str:
    """Return the formula of a length."""
    return f"sqrt({' + '.join(f'{name}**2' for name in names)})"


def rows(entries: Sequence[float]) -> Matrix:
    """Return nine numbers as three rows."""
    return [list(entries[at : at + 3]) for at in (0, 3, 6)]


def transposed(matrix: Sequence[Sequence[float]]) -> Matrix:
    """Return the columns of a matrix as rows."""
    return [list(column) for column in zip(*matrix, strict=True)]


def upright(vector: Sequence[float] | Vector) -> Matrix:
    """Return a vector as a column."""
    return [[part] for part in vector]
