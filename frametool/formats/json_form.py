"""JSON: one object a line, the keys of the pose grammar, numbers as Python's repr.

{"name": "camera", "parent": "map", "xyz": [1.0, 2.0, 3.0], "quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.formats.results import tree_entries

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from frametool.formats.results import Result, Style
    from frametool.frames.tree import FrameTree


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Give one line a result."""
    return write_points((result.mapping(style) for result in results), style)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Give one line a record."""
    return "".join(f"{dump(record, style.number)}\n" for record in records)


def write_tree(tree: FrameTree, style: Style) -> str:
    """Give the tree in the list form, on one line."""
    return f"{dump({'frames': list(tree_entries(tree, style))}, style.number)}\n"


def dump(value: Any, number: Callable[[float], str] = repr) -> str:
    """Write plain values as JSON on one line; `number` writes the floats.

    Not json.dumps, because that has no say in how floats are written.
    """
    if isinstance(value, float):
        return number(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{dump(key)}: {dump(each, number)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(dump(each, number) for each in value) + "]"
    if isinstance(value, str) and value.isascii() and value.isidentifier():
        return f'"{value}"'  # keys and most names, without importing json
    import json

    return json.dumps(value, ensure_ascii=False)
