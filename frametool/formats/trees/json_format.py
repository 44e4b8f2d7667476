"""JSON: one object a line, the keys of the pose grammar, numbers as Python's repr.

    {"name": "camera", "parent": "map", "xyz": [1.0, 2.0, 3.0], "quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}

Metres, radians unless the key says degrees; the pose of `name` in `parent`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.json import dump
from frametool.grammar.result import tree_entries

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.lookups import FrameTree
    from frametool.grammar.result import Result, Style


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return one line a result."""
    return write_points((result.mapping(style) for result in results), style)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return one line a record."""
    return "".join(f"{dump(record, style.number)}\n" for record in records)


def write_tree(tree: FrameTree | TransformBuffer, style: Style) -> str:
    """Return the tree in the list form, on one line."""
    return f"{dump({'frames': list(tree_entries(tree, style))}, style.number)}\n"
