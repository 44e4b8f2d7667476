"""A formula is one string in Python's arithmetic: from its syntax tree come the text, the LaTeX and the value.

So the three cannot disagree. The tree is walked; nothing is executed.
"""

from __future__ import annotations

import ast
import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    Leaf = Callable[[str], str]

NOISE = 2e-15  # of the largest term: what the rounding of a few terms leaves where they cancel
FAR = 16.0  # radians: a larger angle is as it was given, no multiple of a rounded pi
SUM, PRODUCT, SIGN, POWER = 1, 2, 3, 4  # how tightly an operator binds
BINDS = {ast.Add: SUM, ast.Sub: SUM, ast.Mult: PRODUCT, ast.Div: PRODUCT, ast.Pow: POWER}
TEXT = {ast.Add: " + ", ast.Sub: " - ", ast.Mult: "·", ast.Div: "/", ast.Pow: "^"}
# The line is recomputed by readers with the library they have: the values are those of `math`, not of the kernels.
FUNCTIONS: dict[str, Callable[..., float]] = {
    "sin": math.sin, "cos": math.cos, "sqrt": math.sqrt, "atan2": math.atan2, "abs": abs, "min": min, "max": max,
}  # fmt: skip
PI = "pi"
EXPONENT = re.compile(r"e([+-]?)0*(\d+)$")


class Value(NamedTuple):
    """A number, and the size of the numbers whose rounding is in it."""

    number: float
    size: float

    @property
    def settled(self) -> float:
        """Return the number, or 0 where it is what rounding left of terms that cancel."""
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


def _joined(operator: ast.operator, left: Value, right: Value) -> Value:
    """Apply an operator, and to first order what rounding does to its result."""
    (a, size_a), (b, size_b) = left, right
    if isinstance(operator, ast.Add):
        return Value(a + b, max(size_a, size_b))
    if isinstance(operator, ast.Sub):
        return Value(a - b, max(size_a, size_b))
    if isinstance(operator, ast.Mult):
        return Value(a * b, max(size_a * abs(b), abs(a) * size_b))
    if isinstance(operator, ast.Div):
        return Value(a / b, max(size_a / abs(b), abs(a / b) * size_b / abs(b)))
    number = a ** int(b)
    return Value(number, max(abs(number), b * size_a * abs(a) ** (int(b) - 1)))


def _called(name: str, arguments: list[Value]) -> Value:
    """Call a function; the size follows from its derivative."""
    number = float(FUNCTIONS[name](*(each.number for each in arguments)))
    x, size = arguments[0]
    if name in ("sin", "cos"):
        size = min(size, FAR)
    if name == "cos":
        return Value(number, max(abs(number), abs(math.sin(x)) * size))
    if name == "sqrt":
        return Value(number, max(number, size / (2.0 * number)) if number else math.sqrt(size))
    if name == "atan2":
        other, other_size = arguments[1]
        squared = x * x + other * other
        return Value(number, max(abs(number), (abs(other) * size + abs(x) * other_size) / squared if squared else 0.0))
    if name == "sin":
        return Value(number, max(abs(number), abs(math.cos(x)) * size))
    return Value(number, max(abs(number), *(each.size for each in arguments)))


def as_text(node: ast.expr, leaf: Leaf, outer: int = 0, *, right: bool = False) -> str:
    """Write a tree as arithmetic, · for times and ^ for powers; `leaf` writes the names."""
    if isinstance(node, ast.Constant):
        return repr(node.value)
    if isinstance(node, ast.Name):
        text = leaf(node.id)
        return f"({text})" if text.startswith("-") and (outer > SUM or right) else text
    if isinstance(node, ast.UnaryOp):
        text = f"-{as_text(node.operand, leaf, SIGN, right=True)}"
        return f"({text})" if outer > SUM or right else text
    if isinstance(node, ast.Call):
        return f"{_name(node)}({', '.join(as_text(each, leaf) for each in node.args)})"
    if not isinstance(node, ast.BinOp):
        raise TypeError(ast.dump(node))
    binds = BINDS[type(node.op)]
    first, second = as_text(node.left, leaf, binds), as_text(node.right, leaf, binds + 1, right=True)
    text = first + TEXT[type(node.op)] + second
    return f"({text})" if binds < outer else text


def as_latex(node: ast.expr, leaf: Leaf, outer: int = 0, *, right: bool = False) -> str:
    """Write a tree as LaTeX; `leaf` writes the names."""
    if isinstance(node, ast.Constant):
        return repr(node.value)
    if isinstance(node, ast.Name):
        text = leaf(node.id)
        loose = (text.startswith("-") and (outer > SUM or right)) or (r"\times" in text and outer > PRODUCT)
        loose = loose or ("^" in text and outer >= POWER)
        return rf"\left({text}\right)" if loose else text
    if isinstance(node, ast.UnaryOp):
        text = f"-{as_latex(node.operand, leaf, SIGN, right=True)}"
        return rf"\left({text}\right)" if outer > SUM or right else text
    if isinstance(node, ast.Call):
        return _latex_call(_name(node), [as_latex(each, leaf) for each in node.args])
    if not isinstance(node, ast.BinOp):
        raise TypeError(ast.dump(node))
    if isinstance(node.op, ast.Div):
        text = rf"\frac{{{as_latex(node.left, leaf)}}}{{{as_latex(node.right, leaf)}}}"
        return rf"\left({text}\right)" if outer > PRODUCT + 1 else text
    binds = BINDS[type(node.op)]
    first, second = as_latex(node.left, leaf, binds), as_latex(node.right, leaf, binds + 1, right=True)
    if isinstance(node.op, ast.Pow):
        text = f"{first}^{{{second}}}"
    elif isinstance(node.op, ast.Mult):
        text = f"{first} {_times(first, second)} {second}"
    else:
        text = first + TEXT[type(node.op)] + second
    return rf"\left({text}\right)" if binds < outer else text


def latex_number(text: str) -> str:
    """Write a number's text as LaTeX: an exponent as a power of ten."""
    found = EXPONENT.search(text)
    if not found:
        return text
    sign = "-" if found[1] == "-" else ""
    return rf"{text[: found.start()]} \times 10^{{{sign}{found[2]}}}"


def _name(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else ""


def _latex_call(name: str, arguments: list[str]) -> str:
    if name == "sqrt":
        return rf"\sqrt{{{arguments[0]}}}"
    if name == "abs":
        return rf"\left\lvert {arguments[0]} \right\rvert"
    operator = r"\operatorname{atan2}" if name == "atan2" else rf"\{name}"
    return rf"{operator}\left({', '.join(arguments)}\right)"


def _times(first: str, second: str) -> str:
    """Choose the sign of a product: a dot where a number stands beside it, else a thin space."""
    return r"\cdot" if first[-1].isdigit() or second[0].isdigit() or second.startswith(r"\left(-") else r"\,"
