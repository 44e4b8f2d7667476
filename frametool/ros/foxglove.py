"""Foxglove's JSON: FrameTransform and FrameTransforms, one message per line.

    {"timestamp": {"sec": 1, "nsec": 0}, "parent_frame_id": "world", "child_frame_id": "turtle1",
     "translation": {"x": 0, ..}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}

Quaternions x, y, z, w; metres; the pose of the child in its parent: parent_from_child.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.json import dump
from frametool.frames.stamps import BILLION
from frametool.geometry.representations import notation
from frametool.grammar.result import edge_results, rotation_numbers

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.frames.lookups import FrameTree
    from frametool.grammar.result import Result, Style


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return one FrameTransform per line; frames without a name are "", an unknown stamp is 0."""
    return "".join(f"{dump(_frame_transform(result, style), style.number)}\n" for result in results)


def write_tree(tree: FrameTree, style: Style) -> str:
    """Return one FrameTransforms with every edge."""
    return f"{dump({'transforms': [_frame_transform(edge, style) for edge in edge_results(tree)]}, style.number)}\n"


def _frame_transform(result: Result, style: Style) -> dict[str, Any]:
    seconds, nanoseconds = divmod(result.extras.get("stamp_ns") or 0, BILLION)
    rotation = rotation_numbers(result.pose, notation("quaternion"), style)
    return {
        "timestamp": {"sec": seconds, "nsec": nanoseconds}, "parent_frame_id": result.pose.parent or "",
        "child_frame_id": result.pose.name or "", "translation": dict(zip("xyz", result.pose.components, strict=False)),
        "rotation": dict(zip("xyzw", rotation, strict=True)),
    }  # fmt: skip
