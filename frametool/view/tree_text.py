"""A tree of frames as a drawing of lines; on a terminal in colour, through rich."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, NamedTuple

from frametool.formats.labels import edge_label

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.formats.results import Style
    from frametool.frames.tree import FrameTree
    from frametool.geometry.transform import Transform


class Line(NamedTuple):
    """One frame of the drawing: the lines before its name, and its pose in its parent."""

    branch: str
    frame: str
    label: tuple[str, ...]


def write_tree(tree: FrameTree, style: Style) -> str:
    """Draw a tree with plain lines: each frame below its parent, its pose beside it."""
    return "".join(
        f"{line.branch}{line.frame}{pad}{'  '.join(line.label)}".rstrip() + "\n" for line, pad in _padded(tree, style)
    )


def print_tree(tree: FrameTree, style: Style) -> None:
    """Draw a tree on the terminal, in colour where it has any."""
    from rich.console import Console
    from rich.text import Text

    console = Console(file=sys.stdout, highlight=False, soft_wrap=True)
    for line, pad in _padded(tree, style):
        name = "bold green" if not line.label else "bold"
        console.print(Text.assemble((line.branch, "dim"), (line.frame, name), pad, ("  ".join(line.label), "cyan")))


def _padded(tree: FrameTree, style: Style) -> Iterator[tuple[Line, str]]:
    """Give the lines with the blanks that bring their poses below one another."""
    lines = list(_lines(tree, style))
    width = max((len(line.branch) + len(line.frame) for line in lines), default=0)
    firsts = max((len(line.label[0]) for line in lines if line.label), default=0)
    for line in lines:
        label = (f"{line.label[0]:<{firsts}}", *line.label[1:]) if line.label else ()
        yield line._replace(label=label), " " * bool(label) * (width - len(line.branch) - len(line.frame) + 2)


def _lines(tree: FrameTree, style: Style) -> Iterator[Line]:
    """Walk the tree from its roots, children in the order they were added; a stack, so that no tree is too deep."""
    children: dict[str, list[tuple[str, Transform]]] = {}
    for parent, child, transform in tree.edges():
        children.setdefault(parent, []).append((child, transform))
    pending: list[tuple[str, Transform | None, str, str]] = [(root, None, "", "") for root in reversed(tree.roots)]
    while pending:
        frame, pose, branch, below = pending.pop()
        yield Line(branch, frame, edge_label(pose, style) if pose is not None else ())
        inner = children.get(frame, ())
        for at in range(len(inner) - 1, -1, -1):
            last = at == len(inner) - 1
            pending.append((*inner[at], below + ("└── " if last else "├── "), below + ("    " if last else "│   ")))
