r"""The drawing that ROS's view_frames makes of frames that move: who is whose parent, how often, and over which time.

"world" -> "turtle1"[label=" Broadcaster: /demo\nAverage rate: 20.201\nBuffer length: 4.95\n .."];
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.frames.report import cache_entries
from frametool.grammar.edge_label import graphviz

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.frames.report import CacheEntry


def write_tree(tree: Frames) -> str:
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
