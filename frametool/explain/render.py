"""Derivations in their forms: text, Markdown with formulas, a LaTeX document.

A derivation as text of 80 columns. A line that begins with = + - or · goes on with the one before.
"""

from __future__ import annotations

from itertools import groupby
from textwrap import wrap
from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid, alternatives, shown
from frametool.explain.formula_tree import latex_number
from frametool.explain.sheet import Caveat, MatrixLine, Sentence, SheetHeading, SheetResult, SheetStep

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.explain.sheet import Item, Row

WIDTH = 80
INDENT = "   "


def text_of(items: Sequence[Item]) -> str:
    """Return a derivation as text."""
    lines: list[str] = []
    count = 0
    for is_step, group in groupby(items, lambda item: isinstance(item, SheetStep)):
        if is_step:
            lines += _steps([item for item in group if isinstance(item, SheetStep)])
            continue
        for item in group:
            count += isinstance(item, SheetHeading)
            lines += _lines(item, count)
    return "\n".join(lines).lstrip("\n") + "\n"


def _lines(item: Item, count: int) -> list[str]:
    """Return the lines of what is no step."""
    if isinstance(item, SheetHeading):
        return ["", *_wrapped(item.text, f"{count}. ", INDENT)]
    if isinstance(item, Sentence):
        return _wrapped(item.text, INDENT, INDENT)
    if isinstance(item, Caveat):
        return _wrapped(item.text, f"{INDENT}! ", f"{INDENT}  ")
    if isinstance(item, MatrixLine):
        return _grid(item)
    if isinstance(item, SheetResult):
        return ["", *_wrapped(f"Result: {item.text}" if item.text else "Result", "", INDENT), *result_lines(item.rows)]
    return []


def _wrapped(text: str, first: str, further: str) -> list[str]:
    return wrap(
        text, WIDTH, initial_indent=first, subsequent_indent=further, break_long_words=False, break_on_hyphens=False
    )


def _steps(steps: Sequence[SheetStep]) -> Iterator[str]:
    """Write successive steps with their signs of equality below one another."""
    width = max(len(step.name) for step in steps)
    for step in steps:
        unit = f" {step.unit}" if step.unit else ""
        head = f"{INDENT}{step.name:<{width}} = "
        line = head + " = ".join(step.texts) + unit
        if len(line) <= WIDTH:
            yield line
            continue
        further = " " * (len(head) - 2) + "= "
        *formulas, value = step.texts
        last = " = ".join([*formulas[1:], value]) + unit
        yield from _broken(head, formulas[0])
        if len(further + last) <= WIDTH:
            yield further + last
            continue
        for formula in formulas[1:]:
            yield from _broken(further, formula)
        yield f"{further}{value}{unit}"


def _broken(head: str, formula: str) -> Iterator[str]:
    """Write a formula; one that is too long goes on before its plus and minus signs."""
    line = head
    for piece in _pieces(formula):
        if len(line) + len(piece) > WIDTH and line != head and line.strip():
            yield line.rstrip()
            line = " " * len(head) + piece.lstrip()
        else:
            line += piece
    yield line.rstrip()


def _pieces(formula: str) -> list[str]:
    """Cut a formula before the signs between its terms, else between its factors, else between terms inside of one."""
    cuts = _places(formula, 0, (" + ", " - ")) or _places(formula, 0, ("·(",)) or _places(formula, 1, (" + ", " - "))
    return [formula[begin:end] for begin, end in zip([0, *cuts], [*cuts, len(formula)], strict=True)]


def _places(formula: str, level: int, signs: tuple[str, ...]) -> list[int]:
    """Return where signs stand within so many parentheses."""
    depth, places = 0, []
    for at, letter in enumerate(formula):
        if depth == level and formula.startswith(signs, at):
            places.append(at)
        depth += (letter == "(") - (letter == ")")
    return places


def _grid(grid: MatrixLine) -> list[str]:
    """Write matrices side by side, as many as the width holds."""
    lines = [f"{INDENT}{grid.name} = {grid.text}"] if grid.text else []
    head = f"{INDENT}{' ' * len(grid.name) if grid.text else grid.name} = "
    groups: list[list[list[str]]] = [[]]
    used = len(head)
    blocks = [[part] if isinstance(part, str) else _block(part) for part in grid.parts]
    for block, after in zip(blocks, [*blocks[1:], [grid.unit]], strict=True):
        size = len(block[0]) + 1 + (len(grid.unit) + 1) * (block is blocks[-1] and bool(grid.unit))
        needed = size + (len(after[0]) + 1) * (len(block) == 1)  # a sign stays with what it is before
        if used + needed > WIDTH and any(len(each) > 1 for each in groups[-1]):
            groups.append([])
            used = len(head)
        groups[-1].append(block)
        used += size
    for at, group in enumerate(groups):
        lead = head if at == 0 else " " * len(head)
        lines += _side_by_side(lead, group, grid.unit if at == len(groups) - 1 else "")
    return lines


def _block(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[at]) for row in rows) for at in range(len(rows[0]))]
    return [f"[{' '.join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))}]" for row in rows]


def _side_by_side(head: str, blocks: list[list[str]], unit: str) -> list[str]:
    height = max(map(len, blocks))
    middle = height // 2
    lines = []
    for row in range(height):
        cells = [block[row] if len(block) == height else (block[0] if row == middle else " " * len(block[0]))
                 for block in blocks]  # fmt: skip
        line = (head if row == middle else " " * len(head)) + " ".join(cells)
        lines.append((line + (f" {unit}" if unit and row == middle else "")).rstrip())
    return lines


def result_lines(rows: Sequence[Row]) -> list[str]:
    """Write the result: a line a notation, or one a number where that is too long."""
    width = max((len(row.label) for row in rows), default=0)
    lines = []
    for row in rows:
        head = f"{INDENT}{row.label:<{width}}  "
        cells = [f"{name} {number}".lstrip() for name, number in row.cells]
        unit = f" {row.unit}" if row.unit else ""
        line = head + "  ".join(cells) + unit
        if len(line) <= WIDTH:
            lines.append(line)
        elif any(name for name, _ in row.cells):
            lines += [(head if at == 0 else " " * len(head)) + cell + unit for at, cell in enumerate(cells)]
        else:
            filled = wrap("  ".join(cells), WIDTH - len(head), break_on_hyphens=False, break_long_words=False)
            lines += [(head if at == 0 else " " * len(head)) + part for at, part in enumerate(filled)]
    return lines


LONG = 90  # characters of LaTeX that a line of a formula holds, about
MARKDOWN_SPECIAL = frozenset("\\`*_{}[]<>#|~$&")
LATEX_SPECIAL = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "%": r"\%", "_": r"\_",
    "^": r"\textasciicircum{}", "~": r"\textasciitilde{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': "''", "`": r"\char96{}", "-": "-{}",
}  # fmt: skip
PREAMBLE = r"""\documentclass{article}
\usepackage{amsmath}
\usepackage[a4paper,landscape,margin=2cm]{geometry}
\setlength{\parindent}{0pt}
\setlength{\parskip}{6pt}
\allowdisplaybreaks
\begin{document}
"""


class Explanation:
    """A derivation: `str` of it is the text, `markdown()` and `latex()` its other forms; Jupyter shows it as Markdown.

    title: what is derived
    """

    def __init__(self, title: str, items: Sequence[Item]) -> None:
        """Keep the parts in their order."""
        self.title = title
        self.items = tuple(items)

    def __str__(self) -> str:
        """Return the text, of 80 columns where the numbers let it."""
        return text_of(self.items)

    def __repr__(self) -> str:
        """Say what is derived."""
        return f"<Explanation of {self.title}>"

    def markdown(self) -> str:
        """Return Markdown with formulas between dollar signs, as GitHub and Jupyter show it."""
        parts = [f"## {_markdown_text(self.title)}", *_parts(self.items, _markdown_item, _markdown_formulas)]
        return "\n\n".join(parts) + "\n"

    _repr_markdown_ = markdown

    def latex(self) -> str:
        """Return a LaTeX document."""
        parts = _parts(self.items, _latex_item, _latex_formulas)
        return PREAMBLE + "\n\n".join([rf"\section*{{{_latex_text(self.title)}}}", *parts]) + "\n\\end{document}\n"

    def render(self, form: str = "text") -> str:
        """Return the derivation as text, markdown or latex; raises ValueInvalid for another form."""
        if form not in FORMS:
            raise ValueInvalid(f"no form {shown(form)}{alternatives(form, FORMS, 'forms')}")
        return FORMS[form](self)


FORMS: dict[str, Callable[[Explanation], str]] = {
    "text": Explanation.__str__,
    "markdown": Explanation.markdown,
    "latex": Explanation.latex,
}


def _parts(
    items: Sequence[Item], write: Callable[[Item, int], str], formulas: Callable[[list[str]], str]
) -> Iterator[str]:
    """Yield the parts of a derivation; successive formulas stand in one."""
    count = 0
    for is_formula, group in groupby(items, lambda item: isinstance(item, (SheetStep, MatrixLine))):
        if is_formula:
            yield formulas([line for item in group for line in _aligned(item)])
            continue
        for item in group:
            count += isinstance(item, SheetHeading)
            yield write(item, count)


def _aligned(item: Item) -> Iterator[str]:
    """Yield the lines of a formula, aligned at the first sign of equality of each."""
    unit = ""
    if isinstance(item, MatrixLine):
        name = item.name.replace("'", r"^{\prime}")
        matrices = " ".join(_matrix(part) for part in item.parts)
        parts, unit = [*([item.latex] if item.latex else []), matrices], item.unit
    elif isinstance(item, SheetStep):
        name, parts, unit = item.latex_name, list(item.latex), item.unit
    else:
        return
    unit = rf"\ \text{{{_latex_text(unit)}}}" if unit else ""
    if sum(map(len, parts)) <= LONG or len(parts) == 1:
        yield f"{name} &= {' = '.join(parts)}{unit}"
        return
    yield f"{name} &= {parts[0]}"
    if sum(map(len, parts[1:])) <= 2 * LONG:
        yield f"&= {' = '.join(parts[1:])}{unit}"
        return
    for part in parts[1:-1]:
        yield f"&= {part}"
    yield f"&= {parts[-1]}{unit}"


def _matrix(part: str | Sequence[Sequence[str]]) -> str:
    if isinstance(part, str):
        return rf"{latex_number(part[:-1])} \cdot" if part.endswith("·") else part.replace("·", r" \cdot ")
    rows = r" \\ ".join(" & ".join(map(latex_number, row)) for row in part)
    return rf"\begin{{bmatrix}} {rows} \end{{bmatrix}}"


def _markdown_formulas(lines: list[str]) -> str:
    body = " \\\\\n".join(lines)
    return f"$$\n\\begin{{aligned}}\n{body}\n\\end{{aligned}}\n$$"


def _latex_formulas(lines: list[str]) -> str:
    body = " \\\\\n".join(lines)
    return f"\\begin{{align*}}\n{body}\n\\end{{align*}}"


def _markdown_item(item: Item, count: int) -> str:
    """Write what is no formula."""
    if isinstance(item, SheetHeading):
        return f"### {count}. {_markdown_text(item.text)}"
    if isinstance(item, Sentence):
        return _markdown_text(item.text)
    if isinstance(item, Caveat):
        return f"> **Note.** {_markdown_text(item.text)}"
    if isinstance(item, SheetResult):
        lines = "\n".join(line.removeprefix("   ") for line in result_lines(item.rows))
        head = f"**Result**: {_markdown_text(item.text)}" if item.text else "**Result**"
        return f"{head}\n\n```text\n{lines}\n```"
    return ""


def _latex_item(item: Item, count: int) -> str:
    """Write what is no formula."""
    if isinstance(item, SheetHeading):
        return rf"\subsection*{{{count}. {_latex_text(item.text)}}}"
    if isinstance(item, Sentence):
        return _latex_text(item.text)
    if isinstance(item, Caveat):
        return rf"\emph{{Note.}} {_latex_text(item.text)}"
    if isinstance(item, SheetResult):
        lines = [_latex_text(line.removeprefix("   ")).replace(" ", "~") for line in result_lines(item.rows)]
        head = rf"\textbf{{Result}}: {_latex_text(item.text)}" if item.text else r"\textbf{Result}"
        return f"{head}\n\n{{\\ttfamily\n" + "\\\\\n".join(lines) + "\n\\par}"
    return ""


def _markdown_text(text: str) -> str:
    return "".join(f"\\{each}" if each in MARKDOWN_SPECIAL else each for each in text)


def _latex_text(text: str) -> str:
    """Escape text; letters beyond ASCII are named, because not every TeX has them."""
    return "".join(LATEX_SPECIAL.get(each, each) if each.isascii() else f"[U+{ord(each):04X}]" for each in text)
