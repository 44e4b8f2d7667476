"""A formula is one string in Python's arithmetic: its syntax tree gives the text, the LaTeX and the value.

So the three cannot disagree. The tree is interpreted; nothing is executed.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from functools import lru_cache, partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    Leaf = Callable[[str], str]

NOISE = 2e-15  # of the larger term: what the rounding of a few terms leaves where they cancel
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
CALLS = {"sqrt": r"\sqrt{%s}", "abs": r"\left\lvert %s \right\rvert"}
CALLS |= {name: rf"\operatorname{{{name}}}\left(%s\right)" for name in ("atan2", "hypot")}
PI = "pi"
EXPONENT = re.compile(r"e([+-]?)0*(\d+)$")


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
            return math.pi if name == PI else values[name]
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
        binds, sign, _ = OPERATORS[type(node.op)]
        first, second = write(node.left, outer=binds), write(node.right, outer=binds + 1, right=True)
        text = first + sign + second
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
