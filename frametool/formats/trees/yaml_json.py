"""YAML and JSON: one document or one line a result, in the grammar that poses and trees are read in.

    name: camera
    parent: map
    xyz: [1.0, 2.0, 3.0]
    quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}

Metres, radians unless the key says degrees; the pose of `name` in `parent`.  Numbers as Python's repr.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.grammar.result import Result, Style, tree_entries

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.frames.lookups import Frames


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return a document or a line a result."""
    return write_points((result.mapping(style) for result in results), style)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return one line a record in JSON, else the records as documents parted by `---`."""
    if style.form == "json":
        from frametool.documents import json

        return "".join(f"{json.dump(record, style.number)}\n" for record in records)
    from frametool.documents import yaml_writer

    return "---\n".join(yaml_writer.dump(record, style.number) for record in records)


def write_tree(tree: Frames, style: Style) -> str:
    """Return the tree in the list form, roots first; JSON on one line."""
    if style.form == "json":
        from frametool.documents import json

        return f"{json.dump({'frames': list(tree_entries(tree, style))}, style.number)}\n"
    from frametool.documents.yaml_writer import flow

    entries = "".join(f"  - {flow(entry, style.number)}\n" for entry in tree_entries(tree, style))
    return f"frames:\n{entries}"
