"""What differs between two trees, for a person: what only one has, other parents, then tables of what moved."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import printable
from frametool.view.tree_text import cells

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.lint.tree_diff import Apart, Difference

WIDTH = 80
NUMBER = 11  # columns of each number
LABEL = WIDTH - 4 * NUMBER


def write_diff(found: Iterable[Difference]) -> str:
    """Return differences in parts with a heading each."""
    kinds: dict[str, list[Difference]] = {}
    for each in found:
        kinds.setdefault(each.kind, []).append(each)
    moved = [*kinds.pop("moved", ()), *kinds.pop("same", ())]
    parts = [_list(kind, found) for kind, found in kinds.items()]
    starts = dict.fromkeys(each.seen_from for each in moved)
    parts += (_table(start, [each for each in moved if each.seen_from == start]) for start in starts)
    return "\n".join(parts)


_HEADINGS = {"only-in-a": "only in A", "only-in-b": "only in B", "parent": "other parent", "motion": "stands or moves",
             "no-data": "no data", "samples": "other samples"}  # fmt: skip


def _list(kind: str, found: Iterable[Difference]) -> str:
    """Return a heading and the lines of differences that are said in words."""
    return f"{_HEADINGS[kind]}:\n" + "".join(f"{line}\n" for each in found for line in _said(each))


def _said(each: Difference) -> Iterator[str]:
    """Yield the lines about one frame."""
    text = short(each.frame, WIDTH - 4)
    if each.kind in ("only-in-a", "only-in-b"):
        parent = each.parent_a if each.kind == "only-in-a" else each.parent_b
        text += f" in {short(parent, WIDTH - 8)}" if parent is not None else ", a root"
    elif each.kind == "parent":
        in_a, in_b = ("none" if name is None else short(name, WIDTH // 2) for name in (each.parent_a, each.parent_b))
        text += f": {in_a} in A, {in_b} in B"
    elif each.own:
        text += f" by up to {each.own}"
    text += f": {each.note}" if each.note else ""
    yield from _folded(text)
    if each.kind == "parent" and each.seen:
        yield f"    moved {each.seen}, seen from {short(str(each.seen_from), WIDTH // 2 - 10)}"


def _folded(text: str) -> Iterator[str]:
    """Yield the words of a text in lines, by the cells they take; all but the first line further in."""
    line = " "
    for word in (short(word, WIDTH - 4) for word in text.split(" ")):
        if cells(line) + cells(word) >= WIDTH and line.strip():
            yield line
            line = "   "
        line += f" {word}"
    yield line


def _table(start: str | None, found: Sequence[Difference]) -> str:
    """Return the table of the frames that moved, as far as they are seen from one frame."""
    seen = f"seen from {start}" if start is not None else "seen from elsewhere"
    both = 2 * NUMBER
    head = f"{'moved':<{LABEL}}{'in its parent':>{both}}{_padded(short(seen, both - 2), both)}\n"
    units = f"{'':{LABEL}}" + 2 * f"{'mm':>{NUMBER}}{'deg':>{NUMBER}}" + "\n"
    return head + units + "".join(map(_row, found))


def _row(each: Difference) -> str:
    """Return the line of one frame; two if its name is long."""
    label = f"  {each.frame} in {each.parent_a}" if each.parent_a is not None else f"  {each.frame}"
    numbers = "".join(f"{text:>{NUMBER}}" for text in (*_numbers(each.own), *_numbers(each.seen)))
    label = short(label, WIDTH)
    gap = LABEL - cells(label)
    return f"{label}{' ' * gap}{numbers}\n" if gap > 0 else f"{label}\n{'':{LABEL}}{numbers}\n"


def _numbers(apart: Apart | None) -> tuple[str, str]:
    """Write how far two poses are apart in mm and degrees; what is rounding as 0."""
    if apart is None:
        return "-", "-"
    metres = 0.0 if apart.metres <= apart.rounding else apart.millimetres
    turn = 0.0 if apart.radians <= apart.turn_rounding else apart.degrees
    return _number(metres, 3), _number(turn, 4)


def _number(value: float, decimals: int) -> str:
    """Write a number with some decimals, or with its power of ten where they would not show it."""
    fits = value == 0.0 or 0.5 * 10.0**-decimals <= value < 1e6
    return f"{value:.{decimals}f}" if fits else f"{value:.2e}"


def _padded(text: str, width: int) -> str:
    return " " * (width - cells(text)) + text


def short(name: str, width: int) -> str:
    """Return a name on one line within so many columns; of a longer one both ends."""
    name = printable(name)
    if cells(name) <= width:
        return name
    keep = width // 2 - 2 if name.isascii() else width // 4 - 1
    return f"{name[:keep]}...{name[-keep:]}"
