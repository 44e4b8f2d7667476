"""YAML: one document a result, in the grammar that poses and trees are read in.

name: camera
parent: map
xyz: [1.0, 2.0, 3.0]
quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.formats.results import tree_entries
from frametool.formats.yaml_text import dump, quoted

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.formats.results import Result, Style
    from frametool.frames.tree import FrameTree


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Give the results as documents, parted by `---`."""
    return write_points((result.mapping(style) for result in results), style)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Give the records as documents, parted by `---`."""
    return "---\n".join(dump(record, style.number) for record in records)


def write_tree(tree: FrameTree, style: Style) -> str:
    """Give the tree in the list form, roots first."""
    entries = "".join(f"  - {_flow(entry, style)}\n" for entry in tree_entries(tree, style))
    return f"frames:\n{entries}"


def _flow(entry: dict[str, Any], style: Style) -> str:
    """Write one entry on one line."""
    return "{" + ", ".join(f"{quoted(key)}: {_value(each, style)}" for key, each in entry.items()) + "}"


def _value(value: Any, style: Style) -> str:
    """Write a value as it may stand inside braces."""
    if isinstance(value, dict):
        return _flow(value, style)
    if isinstance(value, list):
        return "[" + ", ".join(_value(each, style) for each in value) + "]"
    return dump(value, style.number).rstrip("\n")
