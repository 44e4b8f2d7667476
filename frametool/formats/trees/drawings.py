r"""Drawings of trees for graphviz and mermaid: a node a frame, an arrow from parent to child with its pose.

    "base" -> "camera" [label="xyz 0.1 0.0 1.2\nrpy 0.0 15.0 0.0 deg"];               dot
    n0["base"] -->|"xyz 0.1 0.0 1.2<br>rpy 0.0 15.0 0.0 deg"| n1["camera"]             mermaid

Metres and degrees; read by those programs, not by frametool.  In graphviz, frames that move are drawn as ROS's
view_frames does: who is whose parent, how often, and over which time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.frames.edge_log import CacheEntry, cache_entries
from frametool.grammar.result import Style, edge_label, graphviz

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames


def write_tree(tree: Frames, style: Style) -> str:
    """Return a flowchart of mermaid, or a digraph of graphviz."""
    if style.form == "mermaid":
        return _flowchart(tree, style)
    if tree.moves:
        return _view_frames(tree)
    lines = ["digraph frames {", "  node [shape=ellipse];"]
    lines += [f'  "{graphviz(frame)}";' for frame in tree.frames]
    for parent, child, transform in tree.edges():
        label = "\\n".join(map(graphviz, edge_label(transform, style, parent)))
        lines.append(f'  "{graphviz(parent)}" -> "{graphviz(child)}" [label="{label}"];')
    return "\n".join([*lines, "}", ""])


def _flowchart(tree: Frames, style: Style) -> str:
    """Return a flowchart; nodes are numbered, because mermaid's ids take few characters."""
    ids = {frame: f"n{index}" for index, frame in enumerate(tree.frames)}
    lines = ["flowchart TD"]
    lines += [f'  {ids[frame]}["{_escaped(frame)}"]' for frame in tree.frames]
    for parent, child, transform in tree.edges():
        label = "<br>".join(map(_escaped, edge_label(transform, style, parent)))
        lines.append(f'  {ids[parent]} -->|"{label}"| {ids[child]}')
    return "\n".join([*lines, ""])


def _escaped(text: str) -> str:
    """Write what mermaid or HTML would take for its own as character codes (`#quot;`)."""
    return "".join(
        character if character.isalnum() or character in " _-/.:,+" else f"#{ord(character)};" for character in text
    )


def _view_frames(tree: Frames) -> str:
    """Return the digraph; the legend, which graphviz must hang somewhere, stands above the first root."""
    edges = cache_entries(tree)
    newest = max((each.newest for each in edges), default=0.0)
    lines = ["digraph G {", *map(_edge, edges), "edge [style=invis];"]
    lines += [' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";']
    lines += [f'"Recorded at time: {newest:.6f}"[ shape=plaintext ] ;']
    lines += [f'}}->"{graphviz(root)}";' for root in tree.roots[:1]] or ["}"]
    return "\n".join([*lines, "}", ""])


def _edge(each: CacheEntry) -> str:
    facts = {
        "Broadcaster": graphviz(each.authority),
        "Average rate": round(each.rate, 3),
        "Buffer length": round(each.length, 3),
        "Most recent transform": round(each.newest, 3),
        "Oldest transform": round(each.oldest, 3),
    }
    label = "\\n".join(f"{name}: {value}" for name, value in facts.items())
    return f'"{graphviz(each.parent)}" -> "{graphviz(each.child)}"[label=" {label}\\n"];'
