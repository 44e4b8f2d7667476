"""Graphviz: one node a frame, one arrow an edge from parent to child, labelled with its pose.

    "base" -> "camera" [label="xyz 0.1 0.0 1.2\\nrpy 0.0 15.0 0.0 deg"];

Metres and degrees; read by graphviz, not by frametool.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.grammar.edge_label import edge_label, graphviz

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.grammar.result import Style


def write_tree(tree: Frames, style: Style) -> str:
    """Return a digraph; names are quoted, so that any text is a name.  What moves is drawn as view_frames does."""
    if tree.moves:
        from frametool.formats import view_frames

        return view_frames.write_tree(tree)
    lines = ["digraph frames {", "  node [shape=ellipse];"]
    lines += [f"  {_quoted(frame)};" for frame in tree.frames]
    for parent, child, transform in tree.edges():
        label = "\\n".join(graphviz(line) for line in edge_label(transform, style))
        lines.append(f'  {_quoted(parent)} -> {_quoted(child)} [label="{label}"];')
    return "\n".join([*lines, "}", ""])


def _quoted(name: str) -> str:
    return f'"{graphviz(name)}"'
