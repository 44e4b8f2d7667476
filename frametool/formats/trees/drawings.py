r"""Drawings of trees for graphviz (dot) and mermaid: one node per frame, an arrow from parent to child with its pose.

    "base" -> "camera" [label="xyz 0.1 0.0 1.2\nrpy 0.0 15.0 0.0 deg"];               dot
    n0["base"] -->|"xyz 0.1 0.0 1.2<br>rpy 0.0 15.0 0.0 deg"| n1["camera"]             mermaid

Metres and degrees.  In graphviz, moving frames are drawn as ROS's view_frames does: parents, rates and time spans.
Graphviz can also be read: an arrow goes from parent to child; there are no poses.  The listing of
tf2's `all_frames_as_yaml` has no poses either; names are not quoted, a blank follows each, stamps have three decimals:

    laser:
      parent: 'base_link'
      broadcaster: 'default_authority'
      rate: 10000.000
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.frames.stamps import BILLION
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Edge, Options
from frametool.grammar.result import Style, edge_label, graphviz

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames

_WORD = r"""("(?:[^"\\]|\\.)*+"|[A-Za-z_\d./]++)"""
_ARROW = rf"""{_WORD}\s*->\s*(?={_WORD}\s*(\[(?:[^\]"]|"(?:[^"\\]|\\.)*+")*+\])?)"""
_LISTED_FACTS = ("rate", "buffer_length", "most_recent_transform")
SHORTEST = 0.0001  # seconds: tf2 divides by at least this
_FACTS = (r"Average rate:\s*([\d.]+)", r"Buffer length:\s*([\d.]+)", r"Most recent transform:\s*([\d.]+)")


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the frames and edges of a digraph or a listing; rates, or labels, are recorded in `options.tally.drawn`."""
    if file.format == "tf2":
        for entry, line in _with_lines(r"(?m)^(\S.*?):[ \t]*\r?\n((?:[ \t]+\S.*(?:\n|\Z))+)", file.text):
            listed = dict(re.findall(r"(?m)^\s*(\w+):[ \t]*(.*?)\s*$", entry[2]))
            ends = (entry[1], listed.get("parent", ""))
            child, parent = (options.tally.names.bare(each.strip("'\"")) for each in ends)
            if parent:
                numbers = (listed.get(name, "") for name in _LISTED_FACTS)
                numbers = (float(each) if re.fullmatch(r"\d+(?:\.\d*)?", each) else 0.0 for each in numbers)
                options.tally.drawn[child] = _motion(*numbers)
                yield Edge(parent, child, IDENTITY, line=line)
        return
    text = re.sub(r"(?m)^[^\S\n]*//.*$", "", file.text)
    if not text.rstrip().endswith("}"):
        raise file.error("the drawing ends before its last }; is the file whole?")
    for node, line in _with_lines(rf"(?m)^[^\S\n]*{_WORD}\s*;\s*$", text):
        if (name := _unquoted(node[1])) not in ("graph", "node", "edge"):  # words that set styles
            yield Edge(None, options.tally.names.bare(name), IDENTITY, line=line)
    for arrow, line in _with_lines(_ARROW, text):
        parent, child = (options.tally.names.bare(_unquoted(word)) for word in arrow.groups()[:2])
        facts = [float(found[1]) for pattern in _FACTS if (found := re.search(pattern, arrow[3] or ""))]
        label = re.search(r"""label\s*=\s*("(?:[^"\\]|\\.)*+")""", arrow[3] or "")
        about = " ".join(re.sub(r"\\[nlr]", " ", label[1][1:-1]).split()) if label else ""
        options.tally.drawn[child] = _motion(*facts) if len(facts) == len(_FACTS) else about
        yield Edge(parent, child, IDENTITY, line=line)


def _motion(rate: float, length: float, newest: float) -> str:
    """Describe the motion of an edge from tf2's numbers: hertz, and seconds."""
    if length > 0.0:
        return f"{rate:.4g} Hz over {length:.4g} s"
    return f"one at {newest:.9g} s" if newest else "static"


def _with_lines(pattern: str, text: str) -> Iterator[tuple[re.Match[str], int]]:
    """Yield the matches of a pattern in a text, each with the line in which its first group begins."""
    line, before = 1, 0
    for match in re.finditer(pattern, text):
        line += text.count("\n", before, match.start(1))
        before = match.start(1)
        yield match, line


def _unquoted(word: str) -> str:
    return re.sub(r"\\(.)", r"\1", word[1:-1]) if word[0] == '"' else word


def _cache_entries(tree: Frames) -> Iterator[tuple[str, str, float, float, float, float]]:
    """Yield child, parent, rate, newest and oldest stamp and their distance, as tf2 lists its cache; static: no stamps.

    The order is that of first mention.
    """
    for track in (each for frame in tree.frames if (each := tree.track(frame))):
        oldest, newest = (0, 0) if track.is_static else track.span
        length = (newest - oldest) / BILLION
        yield track.child, track.parent, track.count / max(length, SHORTEST), newest / BILLION, oldest / BILLION, length


def write_tree(tree: Frames, style: Style) -> str:
    """Return a flowchart of mermaid, a digraph of graphviz, or the listing of tf2 (`{}` without frames)."""
    if style.format == "tf2":
        return "".join(
            f"{child}: \n"
            f"  parent: '{parent}'\n"
            "  broadcaster: 'default_authority'\n"
            f"  rate: {rate:.3f}\n"
            f"  most_recent_transform: {newest:.3f}\n"
            f"  oldest_transform: {oldest:.3f}\n"
            f"  buffer_length: {length:.3f}\n"
            for child, parent, rate, newest, oldest, length in _cache_entries(tree)
        ) or "{}\n"
    if style.format == "mermaid":  # nodes are numbered, because its ids allow few characters
        ids = {frame: f"n{index}" for index, frame in enumerate(tree.frames)}
        lines = ["flowchart TD", *(f'  {ids[frame]}["{_escaped(frame)}"]' for frame in tree.frames)]
        for parent, child, transform in tree.edges():
            label = "<br>".join(map(_escaped, edge_label(transform, style, parent)))
            lines.append(f'  {ids[parent]} -->|"{label}"| {ids[child]}')
        return "\n".join([*lines, ""])
    if tree.moves:
        return _view_frames(tree)
    lines = ["digraph frames {", "  node [shape=ellipse];", *(f'  "{graphviz(frame)}";' for frame in tree.frames)]
    for parent, child, transform in tree.edges():
        label = "\\n".join(map(graphviz, edge_label(transform, style, parent)))
        lines.append(f'  "{graphviz(parent)}" -> "{graphviz(child)}" [label="{label}"];')
    return "\n".join([*lines, "}", ""])


def _escaped(text: str) -> str:
    """Escape characters with a meaning in mermaid or HTML by character codes (`#quot;`)."""
    return "".join(
        character if character.isalnum() or character in " _-/.:,+" else f"#{ord(character)};" for character in text
    )


def _view_frames(tree: Frames) -> str:
    """Return the digraph of a moving tree; graphviz must attach the legend to a node, which is the first root."""
    lines, last = ["digraph G {"], 0.0
    for number, (child, parent, rate, newest, oldest, length) in enumerate(_cache_entries(tree)):
        label = (
            f"Broadcaster: default_authority\\nAverage rate: {round(rate, 3)}\\n"
            f"Buffer length: {round(length, 3)}\\nMost recent transform: {round(newest, 3)}\\n"
            f"Oldest transform: {round(oldest, 3)}\\n"
        )
        lines.append(f'"{graphviz(parent)}" -> "{graphviz(child)}"[label=" {label}"];')
        last = max(last, newest) if number else newest
    lines += ["edge [style=invis];", ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";']
    lines += [f'"Recorded at time: {last:.6f}"[ shape=plaintext ] ;']
    lines += [f'}}->"{graphviz(root)}";' for root in tree.roots[:1]] or ["}"]
    return "\n".join([*lines, "}", ""])
