"""Derivations in their forms: text, Markdown with formulas, a LaTeX document."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from frametool.calc.explain.formula_tree import latex_number
from frametool.calc.explain.render_text import result_lines, text_of
from frametool.calc.explain.sheet import Caveat, MatrixLine, Sentence, SheetHeading, SheetResult, SheetStep
from frametool.errors import ValueInvalid, alternatives, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.calc.explain.sheet import Item

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
