r"""Graphviz: one node a frame, one arrow an edge from parent to child, labelled with its pose.

    "base" -> "camera" [label="xyz 0.1 0.0 1.2\nrpy 0.0 15.0 0.0 deg"];

Metres and degrees; read by graphviz, not by frametool.

The drawing that ROS's view_frames makes of frames that move: who is whose parent, how often, and over which time.

"world" -> "turtle1"[label=" Broadcaster: /demo\nAverage rate: 20.201\nBuffer length: 4.95\n .."];
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.frames.edge_log import cache_entries
from frametool.grammar.result import edge_label, graphviz

if TYPE_CHECKING:
    from frametool.frames.edge_log import CacheEntry
    from frametool.frames.lookups import Frames
    from frametool.grammar.result import Style


def write_tree(tree: Frames, style: Style) -> str:
    """Return a digraph; names are quoted, so that any text is a name.  What moves is drawn as view_frames does."""
    if tree.moves:
        return write_view_frames(tree)
    lines = ["digraph frames {", "  node [shape=ellipse];"]
    lines += [f"  {_quoted(frame)};" for frame in tree.frames]
    for parent, child, transform in tree.edges():
        label = "\\n".join(graphviz(line) for line in edge_label(transform, style))
        lines.append(f'  {_quoted(parent)} -> {_quoted(child)} [label="{label}"];')
    return "\n".join([*lines, "}", ""])


def _quoted(name: str) -> str:
    return f'"{graphviz(name)}"'


def write_view_frames(tree: Frames) -> str:
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
