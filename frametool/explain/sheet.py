"""A derivation while it is written: headings, sentences, steps, matrices, caveats, and the result at its end.

How the names of formulas are written in LaTeX.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from frametool.errors import ValueInvalid
from frametool.explain.formula_tree import Value, as_latex, as_text, evaluated, latex_number, parsed

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


METRES, RADIANS, DEGREES = "m", "rad", "deg"
HEADING, SENTENCE, CAVEAT = "heading", "sentence", "caveat"
DIGITS = 6  # significant ones, unless told
TOO_LARGE = "the numbers are too large or too small for a derivation: a step is not finite"


class Words(NamedTuple):
    """What is said: a heading with its number, a sentence, or a caveat, which is what is easily got wrong."""

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
    every: all products of long chains are shown
    reach: the largest of the positions, in metres: rounding is measured by it
    stretch: how many times rounding grows where poses are extrapolated
    """

    def __init__(self, digits: int | None = DIGITS, *, clean: bool | None = None, every: bool = False) -> None:
        """Begin an empty sheet."""
        self.digits = digits
        self.clean = digits is not None if clean is None else clean
        self.every = every
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

    def quaternions(self, text: tuple[str, str], latex: tuple[str, str], *values: Quaternion) -> None:
        """Add what two quaternions make, on one line, each as (x, y, z, w).

        text, latex: the formula, and the same with a place for each of the two
        values: the two, and what they make
        """
        *texts, found = (f"({', '.join(map(self.number, each))})" for each in values)
        *latex_texts, latex_found = map(latex_tuple, (*texts, found))
        shown, latex_shown = text[1] % tuple(texts), latex[1] % tuple(latex_texts)
        self.items.append(SheetStep("q", [text[0], shown, found], "q", [latex[0], latex_shown, latex_found]))

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

    def result(self, text: str, rows: Sequence[Row]) -> None:
        """End with the result."""
        self.items.append(SheetResult(text, rows))


def latex_tuple(text: str) -> str:
    """Return numbers in parentheses as LaTeX."""
    numbers = r",\ ".join(latex_number(each) for each in text[1:-1].split(", "))
    return rf"\left({numbers}\right)"


def transposed(matrix: Sequence[Sequence[float]]) -> Matrix:
    """Return the columns of a matrix as rows."""
    return [list(column) for column in zip(*matrix, strict=True)]


def upright(vector: Sequence[float] | Vector) -> Matrix:
    """Return a vector as a column."""
    return [[part] for part in vector]
