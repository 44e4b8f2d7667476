"""The way between two frames of a tree: which edges, and which of them backwards.

Knows names and parents only. Standing and moving trees both ask here, then compose what lies on the way.
"""

from __future__ import annotations

from frametool.errors import BadTopology, NotConnected

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable


def to_root(frame: str, parent_of: Callable[[str], str | None]) -> list[str]:
    """List a frame and its ancestors, root last.

    Raises BadTopology when the ancestors run in a circle.
    """
    line = [frame]
    parent = parent_of(frame)
    seen = {frame}
    while parent is not None:
        if parent in seen:
            raise BadTopology(cycle_message([*line[line.index(parent) :], parent]))
        line.append(parent)
        seen.add(parent)
        parent = parent_of(parent)
    return line


def edges_between(target: str, source: str, parent_of: Callable[[str], str | None]) -> tuple[list[str], list[str]]:
    """Name the edges between two frames, each by its child.

    Returns (down, up): `down` leads from the common ancestor to the target, `up` from the source to that ancestor;
    target_from_source = inverse(product of down) @ product of reversed up.
    Raises NotConnected, naming both roots.
    """
    target_line = to_root(target, parent_of)
    source_line = to_root(source, parent_of)
    if target_line[-1] != source_line[-1]:
        raise NotConnected(
            f"{target!r} and {source!r} are not connected: {target!r} hangs from root {target_line[-1]!r}, "
            f"{source!r} from root {source_line[-1]!r}",
        )
    while target_line and source_line and target_line[-1] == source_line[-1]:
        target_line.pop()
        source_line.pop()
    return target_line[::-1], source_line


def cycle_message(frames: list[str]) -> str:
    """Draw a cycle, parents to the left: `a <- b <- a`."""
    return f"frames form a cycle: {' <- '.join(reversed(frames))}"
