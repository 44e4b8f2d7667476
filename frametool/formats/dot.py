"""Graphviz: one node a frame, one arrow an edge from parent to child, labelled with its pose.

"base" -> "camera" [label="xyz 0.1 0.0 1.2\\nrpy 0.0 15.0 0.0 deg"];
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.formats.labels import edge_label

if TYPE_CHECKING:
    from frametool.formats.results import Style
    from frametool.frames.tree import FrameTree


def write_tree(tree: FrameTree, style: Style) -> str:
    """Give a digraph; names are quoted, so that any text is a name."""
    lines = ["digraph frames {", "  node [shape=ellipse];"]
    lines += [f"  {_quoted(frame)};" for frame in tree.frames]
    for parent, child, transform in tree.edges():
        label = "\\n".join(_escaped(line) for line in edge_label(transform, style))
        lines.append(f'  {_quoted(parent)} -> {_quoted(child)} [label="{label}"];')
    return "\n".join([*lines, "}", ""])


def _quoted(name: str) -> str:
    return f'"{_escaped(name)}"'


def _escaped(text: str) -> str:
    """Write a text between double quotes; a backslash would begin one of graphviz's own escapes."""
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
