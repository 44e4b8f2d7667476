"""A formula is one string in Python's arithmetic: its syntax tree gives the text, the LaTeX and the value.

So the three cannot disagree. The tree is interpreted; nothing is executed.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from functools import lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    Leaf = Callable[[str], str]

NOISE = 2e-15  # of the largest term: what the rounding of a few terms leaves where they cancel
FAR = 16.0  # radians: a larger angle is as written, not a multiple of a rounded pi
SUM, PRODUCT, SIGN, POWER = 1, 2, 3, 4  # precedence of operators
BINDS = {ast.Add: SUM, ast.Sub: SUM, ast.Mult: PRODUCT, ast.Div: PRODUCT, ast.Pow: POWER}
TEXT = {ast.Add: " + ", ast.Sub: " - ", ast.Mult: "·", ast.Div: "/", ast.Pow: "^"}
# readers recompute a line with their own library: the values are those of `math`, not of the kernels
FUNCTIONS: dict[str, Callable[..., float]] = {
    "sin": math.sin, "cos": math.cos, "sqrt": math.sqrt, "atan2": math.atan2, "hypot": math.hypot, "abs": abs,
    "min": min, "max": max,
}  # fmt: skip
COMPARISONS: dict[type[ast.cmpop], Callable[[float, float], bool]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip
CALLS = {"sqrt": r"\sqrt{%s}", "abs": r"\left\lvert %s \right\rvert"}
CALLS |= {name: rf"\operatorname{{{name}}}\left(%s\right)" for name in ("atan2", "hypot")}
PI = "pi"
EXPONENT = re.compile(r"e([+-]?)0*(\d+)$")


class Value(NamedTuple):
    """A number, and the magnitude of the numbers whose rounding affects it."""

    number: float
    size: float

    @property
    def settled(self) -> float:
        """Return the number, or 0 if it is only the rounding error of terms that cancel."""
        return 0.0 if abs(self.number) <= NOISE * self.size else self.number


@lru_cache(maxsize=1024)
def parsed(formula: str) -> ast.expr:
    """Return the syntax tree of a formula."""
    return ast.parse(formula, mode="eval").body


def evaluated(node: ast.expr, values: Mapping[str, float]) -> Value:
    """Return the value of a tree; raises KeyError for a name without a value, ArithmeticError as `math` does."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return Value(float(node.value), abs(float(node.value)))
    if isinstance(node, ast.Name):
        number = math.pi if node.id == PI else values[node.id]
        return Value(number, abs(number))
    if isinstance(node, ast.UnaryOp):
        number, size = evaluated(node.operand, values)
        return Value(-number, size)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return _called(node.func.id, [evaluated(each, values) for each in node.args])
    if isinstance(node, ast.BinOp):
        return _joined(node.op, evaluated(node.left, values), evaluated(node.right, values))
    raise ValueError(ast.dump(node))


def holds(condition: str, values: Mapping[str, float]) -> bool:
    """Return True if a comparison holds, or if a single number is not 0."""
    node = parsed(condition)
    if not isinstance(node, ast.Compare):
        return evaluated(node, values).number != 0.0
    left, right = (evaluated(each, values).number for each in (node.left, *node.comparators))
    return COMPARISONS[type(node.ops[0])](left, right)


def _joined(sign: ast.operator, left: Value, right: Value) -> Value:
    """Apply an operator, and to first order the effect of rounding on its result."""
    (a, size_a), (b, size_b) = left, right
    if isinstance(sign, (ast.Add, ast.Sub)):
        return Value(a + b if isinstance(sign, ast.Add) else a - b, max(size_a, size_b))
    if isinstance(sign, ast.Mult):
        return Value(a * b, max(size_a * abs(b), abs(a) * size_b))
    if isinstance(sign, ast.Div):
        return Value(a / b, max(size_a / abs(b), abs(a / b) * size_b / abs(b)))
    number = a ** int(b)
    return Value(number, max(abs(number), b * size_a * abs(a) ** (int(b) - 1)))


def _called(name: str, arguments: list[Value]) -> Value:
    """Call a function; the magnitude follows from its derivative."""
    number = float(FUNCTIONS[name](*(each.number for each in arguments)))
    x, size = arguments[0]
    if name in ("sin", "cos"):
        slope = math.cos(x) if name == "sin" else math.sin(x)
        return Value(number, max(abs(number), abs(slope) * min(size, FAR)))
    if name == "sqrt":
        return Value(number, max(number, size / (2.0 * number)) if number else math.sqrt(size))
    if name == "atan2":
        other, other_size = arguments[1]
        squared = x * x + other * other
        return Value(number, max(abs(number), (abs(other) * size + abs(x) * other_size) / squared if squared else 0.0))
    return Value(number, max(abs(number), *(each.size for each in arguments)))


def as_text(
    node: ast.expr, leaf: Leaf, outer: int = 0, *, right: bool = False, latex: bool = False
) -> str:  # fmt: skip
    """Write a tree as arithmetic, with · for products and ^ for powers, or as LaTeX; `leaf` formats the names.

    outer: the precedence of the enclosing operator; right: it is the right operand
    """
    write = partial(as_text, leaf=leaf, latex=latex)
    if isinstance(node, ast.Constant):
        return repr(node.value)
    if isinstance(node, ast.Call):
        return _call(node.func.id if isinstance(node.func, ast.Name) else "", map(write, node.args), latex=latex)
    if isinstance(node, ast.Name):
        text = leaf(node.id)
        loose = text.startswith("-") and (outer > SUM or right)
        loose = loose or (r"\times" in text and outer > PRODUCT) or ("^" in text and outer >= POWER)
    elif isinstance(node, ast.UnaryOp):
        text = f"-{write(node.operand, outer=SIGN, right=True)}"
        loose = outer > SUM or right
    elif not isinstance(node, ast.BinOp):
        raise TypeError(ast.dump(node))
    elif latex and isinstance(node.op, ast.Div):
        text = rf"\frac{{{write(node.left)}}}{{{write(node.right)}}}"
        loose = outer > PRODUCT + 1
    else:
        binds = BINDS[type(node.op)]
        first, second = write(node.left, outer=binds), write(node.right, outer=binds + 1, right=True)
        text = first + TEXT[type(node.op)] + second
        if latex and isinstance(node.op, ast.Pow):
            text = f"{first}^{{{second}}}"
        elif latex and isinstance(node.op, ast.Mult):
            is_dot = first[-1].isdigit() or second[0].isdigit() or second.startswith(r"\left(-")  # next to a number
            text = rf"{first} \cdot {second}" if is_dot else rf"{first} \, {second}"
        loose = binds < outer
    if not loose:
        return text
    return rf"\left({text}\right)" if latex else f"({text})"


as_latex = partial(as_text, latex=True)


def latex_number(text: str) -> str:
    """Format a number's text as LaTeX: an exponent as a power of ten."""
    found = EXPONENT.search(text)
    if not found:
        return text
    sign = "-" if found[1] == "-" else ""
    return rf"{text[: found.start()]} \times 10^{{{sign}{found[2]}}}"


def _call(name: str, arguments: Iterable[str], *, latex: bool) -> str:
    return (CALLS.get(name, rf"\{name}\left(%s\right)") if latex else f"{name}(%s)") % ", ".join(arguments)
