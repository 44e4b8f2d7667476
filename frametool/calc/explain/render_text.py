"""A derivation as text of 80 columns. A line that begins with = + - or · goes on with the one before."""

from __future__ import annotations

from itertools import groupby
from textwrap import wrap
from typing import TYPE_CHECKING

from frametool.calc.explain.sheet import Caveat, MatrixLine, Sentence, SheetHeading, SheetResult, SheetStep

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.calc.explain.sheet import Item, Row

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
