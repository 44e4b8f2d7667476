"""Mermaid: a flowchart from parents to children, edges labelled with their poses.

    n0["base"] -->|"xyz 0.1 0.0 1.2<br>rpy 0.0 15.0 0.0 deg"| n1["camera"]

Metres and degrees; read by mermaid, not by frametool.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.grammar.result import edge_label

if TYPE_CHECKING:
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.lookups import FrameTree
    from frametool.grammar.result import Style


def write_tree(tree: FrameTree | TransformBuffer, style: Style) -> str:
    """Return a flowchart; nodes are numbered, because mermaid's ids take few characters."""
    ids = {frame: f"n{index}" for index, frame in enumerate(tree.frames)}
    lines = ["flowchart TD"]
    lines += [f'  {ids[frame]}["{_escaped(frame)}"]' for frame in tree.frames]
    for parent, child, transform in tree.edges():
        label = "<br>".join(_escaped(line) for line in edge_label(transform, style))
        lines.append(f'  {ids[parent]} -->|"{label}"| {ids[child]}')
    return "\n".join([*lines, ""])


def _escaped(text: str) -> str:
    """Write what mermaid or HTML would take for its own as character codes (`#quot;`)."""
    return "".join(
        character if character.isalnum() or character in " _-/.:,+" else f"#{ord(character)};" for character in text
    )
