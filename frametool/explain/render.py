"""The output of derivations: text of 80 columns, Markdown with formulas.

A line that begins with = + - or · continues the previous one.
"""

from __future__ import annotations

import ast
import re
from functools import partial
from itertools import groupby
from textwrap import wrap
from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid, alternatives, shown
from frametool.explain import run
from frametool.explain.run import HEADING, PRODUCT, SENTENCE, SUM, MatrixLine, SheetResult, SheetStep, Words, parsed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    Leaf = Callable[[str], str]


WIDTH = 80
INDENT = "   "
GLUE, CUT = "\u00a0", "\v"  # a non-breaking blank, and a place for a line break
INDENTS = {HEADING: ("", INDENT), SENTENCE: (INDENT, INDENT), run.CAVEAT: (f"{INDENT}! ", f"{INDENT}  ")}


def _wrapped(text: str, first: str, further: str) -> list[str]:
    return wrap(
        text, WIDTH, initial_indent=first, subsequent_indent=further, break_long_words=False, break_on_hyphens=False,
        replace_whitespace=False,
    )  # fmt: skip


def equals(
    step: SheetStep, write: Callable[..., str], name: Callable[[str], str], number: Callable[[str], str]
) -> list[str]:
    """Return the sides of a step's equation: its formula, the formula with numbers, its value.

    write, name, number: format a tree, a name and a number's text
    """
    shown = write(parsed(step.shown), lambda each: number(step.numbers[each]) if each in step.numbers else name(each))
    return [*dict.fromkeys([write(parsed(step.formula), name), shown, number(step.numbers[step.name])])]


def _steps(steps: Sequence[SheetStep]) -> Iterator[str]:
    """Yield the lines of successive steps, with their signs of equality below one another.

    A long formula is broken before its plus and minus signs, or before a product.
    """
    width = max(len(step.name) for step in steps)
    for step in steps:
        head = f"{INDENT}{step.name:<{width}} = "
        hang, room = " " * (len(head) - 2) + "= ", WIDTH - len(head)
        texts = equals(step, as_text, str, str)
        texts[-1] = f"{texts[-1]} {step.unit}".rstrip()
        first, rest = texts[:1], [" = ".join(texts[1:])] * (len(texts) > 1)
        if len(whole := " = ".join(texts)) <= room:
            texts = [whole]
        elif len("".join(rest)) <= room:
            texts = [*first, *rest]
        for at, text in enumerate(texts):
            begin = hang if at else head
            lines = [begin + text]
            for glued in (re.sub(r" (?![+-] )", GLUE, text), text.replace("·", f"{CUT}·")):
                if max(map(len, lines)) > WIDTH:
                    lines = _wrapped(glued, begin, " " * len(begin))
            yield from (line.replace(GLUE, " ").replace(CUT, "") for line in lines)


def _grid(grid: MatrixLine) -> list[str]:
    """Return the lines of matrices side by side, as many as fit."""
    lines = [f"{INDENT}{grid.name} = {grid.text}"] if grid.text else []
    head = f"{INDENT}{' ' * len(grid.name) if grid.text else grid.name} = "
    groups: list[list[str]] = []
    sign = ""
    for part in grid.parts:
        if isinstance(part, str):
            sign = f"{part} "
            continue
        widths = [max(map(len, column)) for column in zip(*part, strict=True)]
        rows = [f"[{' '.join(cell.rjust(size) for cell, size in zip(row, widths, strict=True))}]" for row in part]
        block = _side_by_side(sign, rows, f" {grid.unit}" if grid.unit and part is grid.parts[-1] else "")
        if groups and len(head) + len(groups[-1][0]) + 1 + max(map(len, block)) <= WIDTH:
            groups[-1] = [f"{left} {right}" for left, right in zip(groups[-1], block, strict=True)]
        else:
            groups.append(block)
        sign = ""
    for group in groups:
        lines += [line.rstrip() for line in _side_by_side(head, group)]
        head = " " * len(head)
    return lines


def _side_by_side(left: str, block: Sequence[str], right: str = "") -> list[str]:
    """Return a block with words at the left and at the right of its middle row."""
    before, behind, middle = " " * len(left), " " * len(right), len(block) // 2
    return [left + row + right if at == middle else before + row + behind for at, row in enumerate(block)]


def result_lines(rows: Sequence[run.Row]) -> list[str]:
    """Return the lines of the result: one per representation, or per number if that is too long."""
    width = max((len(row.label) for row in rows), default=0)
    lines = []
    for row in rows:
        head = f"{INDENT}{row.label:<{width}}  "
        cells = [f"{name} {number + 0.0!r}".lstrip() for name, number in zip(row.names, row.numbers, strict=True)]
        unit = f" {row.unit}" if row.unit else ""
        texts = ["  ".join(cells) + unit]
        if len(head + texts[0]) > WIDTH:
            if any(row.names):
                texts = [cell + unit for cell in cells]
            else:
                texts = wrap("  ".join(cells), WIDTH - len(head), break_on_hyphens=False, break_long_words=False)
        lines += [(" " * len(head) if at else head) + text for at, text in enumerate(texts)]
    return lines


CALLS = {"sqrt": r"\sqrt{%s}", "abs": r"\left\lvert %s \right\rvert"}
CALLS |= {name: rf"\operatorname{{{name}}}\left(%s\right)" for name in ("atan2", "hypot")}
EXPONENT = re.compile(r"e([+-]?)0*(\d+)$")


def as_text(
    node: ast.expr, leaf: Leaf, outer: int = 0, *, right: bool = False, latex: bool = False
) -> str:  # fmt: skip
    """Write a tree as arithmetic, with · for products and ^ for powers, or as LaTeX; `leaf` formats the names.

    outer: the precedence of the enclosing operator; right: it is the right operand
    """
    write = partial(as_text, leaf=leaf, latex=latex)
    if isinstance(node, ast.Constant):
        return repr(node.value)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        name = node.func.id
        call = CALLS.get(name, rf"\{name}\left(%s\right)") if latex else f"{name}(%s)"
        return call % ", ".join(map(write, node.args))
    if isinstance(node, ast.Name):
        text = leaf(node.id)
        loose = text.startswith("-") and (outer > SUM or right)
        loose = loose or (r"\times" in text and outer > PRODUCT) or ("^" in text and outer >= run.POWER)
    elif isinstance(node, ast.UnaryOp):
        text = f"-{write(node.operand, outer=run.SIGN, right=True)}"
        loose = outer > SUM or right
    elif not isinstance(node, ast.BinOp):
        raise TypeError(ast.dump(node))
    elif latex and isinstance(node.op, ast.Div):
        text = rf"\frac{{{write(node.left)}}}{{{write(node.right)}}}"
        loose = outer > PRODUCT + 1
    else:
        binds, sign, _ = run.OPERATORS[type(node.op)]
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


SYMBOLS = {
    "roll": r"\phi", "pitch": r"\theta", "yaw": r"\psi", "angle": r"\vartheta", "arc": r"\Omega", "pi": r"\pi",
    "bearing": r"\beta", "det": r"\det R", "norm": r"\lVert q \rVert", "tr": r"\operatorname{tr} R",
    "dot": r"a \cdot b", "ww": "4 w^2", "xx": "4 x^2", "yy": "4 y^2", "zz": "4 z^2", "pp": r"\lvert p \rvert^2",
    "a1": r"\alpha_1", "a2": r"\alpha_2", "a3": r"\alpha_3",
}  # fmt: skip
INDEXED = re.compile(r"([a-zA-Z])([0-9]{1,2}|[a-zA-Z][0-9]?)")
LONG = 90  # approximate characters of LaTeX in a line of a formula
SPECIAL = frozenset("\\`*_{}[]<>#|~$&")
WORDS = {HEADING: "### %s", SENTENCE: "%s", run.CAVEAT: "> **Note.** %s"}
FORMULAS = "$$\n\\begin{aligned}\n%s\n\\end{aligned}\n$$"
RESULT = "**Result**%s\n\n```text\n%s\n```"


def symbol(name: str) -> str:
    """Return a name as LaTeX: Greek if customary, with an index if there is one, else upright."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    if name.endswith("_deg"):
        return rf"{symbol(name[:-4])}^{{\circ}}"
    if len(name) == 1:
        return name
    if found := INDEXED.fullmatch(name):
        return f"{found[1]}_{{{found[2]}}}"
    return rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"


class Explanation:
    """A derivation: `str` of it is the text, `markdown()` the Markdown that Jupyter shows.

    title: what is derived
    """

    def __init__(self, title: str, items: Sequence[run.Item]) -> None:
        """Store the parts in their order."""
        self.title = title
        self.items = tuple(items)

    def __str__(self) -> str:
        """Return the text, of 80 columns if the numbers allow it."""
        lines: list[str] = []
        for is_step, group in groupby(self.items, lambda item: isinstance(item, SheetStep)):
            if is_step:
                lines += _steps([item for item in group if isinstance(item, SheetStep)])
                continue
            for item in group:
                if isinstance(item, Words):
                    lines += [""] * (item.kind == HEADING) + _wrapped(item.text, *INDENTS[item.kind])
                elif isinstance(item, SheetResult):
                    title = f"Result: {item.text}" if item.text else "Result"
                    lines += ["", *_wrapped(title, "", INDENT), *result_lines(item.rows)]
                elif isinstance(item, MatrixLine):
                    lines += _grid(item)
        return "\n".join(lines).lstrip("\n") + "\n"

    def __repr__(self) -> str:
        """Return a short description."""
        return f"<Explanation of {self.title}>"

    def markdown(self) -> str:
        """Return Markdown with formulas between dollar signs, as GitHub and Jupyter show it; each run is one block."""
        parts = [f"## {_escaped(self.title)}"]
        for is_formula, group in groupby(self.items, lambda item: isinstance(item, (SheetStep, MatrixLine))):
            if is_formula:
                steps = [item for item in group if isinstance(item, (SheetStep, MatrixLine))]
                parts.append(FORMULAS % " \\\\\n".join(line for item in steps for line in _aligned(item)))
                continue
            for item in group:
                if isinstance(item, Words):
                    parts.append(WORDS[item.kind] % _escaped(item.text))
                elif isinstance(item, SheetResult):
                    lines = [line.removeprefix(INDENT) for line in result_lines(item.rows)]
                    parts.append(RESULT % (f": {_escaped(item.text)}" if item.text else "", "\n".join(lines)))
        return "\n\n".join(parts) + "\n"

    _repr_markdown_ = markdown

    def render(self, fmt: str = "text") -> str:
        """Return the derivation as text or markdown; raises ValueInvalid for another format."""
        if fmt not in FORMS:
            raise ValueInvalid(f"unknown format {shown(fmt)}{alternatives(fmt, FORMS, 'formats')}")
        return FORMS[fmt](self)


FORMS: dict[str, Callable[[Explanation], str]] = {"text": Explanation.__str__, "markdown": Explanation.markdown}


def _aligned(item: SheetStep | MatrixLine) -> list[str]:
    """Return the lines of a formula, aligned at the first sign of equality of each."""
    if isinstance(item, MatrixLine):
        name = item.name.replace("'", r"^{\prime}")
        formula = re.sub(r"(?<!\+) (?!\+)", r"\\,", re.sub(r"\b([a-zM])([a-z\d])\b", r"\1_\2", item.text))
        formula = formula.replace("^T", r"^{\mathsf T}")
        parts = [*filter(None, [formula]), " ".join(map(_matrix, item.parts))]
    else:
        name, parts = symbol(item.name), equals(item, as_latex, symbol, latex_number)
    if sum(map(len, parts)) <= LONG:
        parts = [" = ".join(parts)]
    elif sum(map(len, parts[1:])) <= 2 * LONG:
        parts = [parts[0], *filter(None, [" = ".join(parts[1:])])]
    if item.unit:
        parts[-1] += rf"\ \text{{{item.unit}}}"
    return [f"{name} &= {parts[0]}", *(f"&= {part}" for part in parts[1:])]


def _matrix(part: str | Sequence[Sequence[str]]) -> str:
    if isinstance(part, str):
        return part
    rows = r" \\ ".join(" & ".join(map(latex_number, row)) for row in part)
    return rf"\begin{{bmatrix}} {rows} \end{{bmatrix}}"


def _escaped(text: str) -> str:
    return "".join(f"\\{each}" if each in SPECIAL else each for each in text)
