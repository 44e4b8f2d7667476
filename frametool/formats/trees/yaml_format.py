"""YAML: one document a result, in the grammar that poses and trees are read in.

    name: camera
    parent: map
    xyz: [1.0, 2.0, 3.0]
    quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}

Metres, radians unless the key says degrees; the pose of `name` in `parent`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.yaml_writer import dump, flow
from frametool.grammar.result import tree_entries

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.lookups import FrameTree
    from frametool.grammar.result import Result, Style


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return the results as documents, parted by `---`."""
    return write_points((result.mapping(style) for result in results), style)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return the records as documents, parted by `---`."""
    return "---\n".join(dump(record, style.number) for record in records)


def write_tree(tree: FrameTree | TransformBuffer, style: Style) -> str:
    """Return the tree in the list form, roots first."""
    entries = "".join(f"  - {flow(entry, style.number)}\n" for entry in tree_entries(tree, style))
    return f"frames:\n{entries}"
