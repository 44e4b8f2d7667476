"""HTML of values for notebooks: the text that a terminal shows, and the picture of a tree."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from typing import Any

from frametool.frames.lookups import Frames


def html_of(value: Any) -> str | None:
    """Return the HTML of a transform, rotation, tree, trajectory or comparison; None if its repr is all there is."""
    if isinstance(value, Frames) and value.frames:
        from frametool.view.pictures import still_picture, write_svg
        from frametool.view.scene import FrameScene

        # a picture of its own, for the style of an SVG element would count in the whole notebook
        svg = b64encode(write_svg(still_picture(FrameScene(value), title=value.name)).encode()).decode()
        return f'<img alt="frames of {escape(value.name)}" src="data:image/svg+xml;base64,{svg}">'
    if hasattr(value, "as_dict"):
        from frametool.view.fit_text import write_comparison

        return f"<pre>{escape(write_comparison(value.as_dict()))}</pre>"
    if hasattr(value, "stamps_ns"):
        from frametool.frames.trajectory import way

        path = f"{way(value.xyz)[-1]:.3f} m of path" if value.size else "empty"
        return f"<pre>{value.size} poses of {escape(value.body)} in {escape(value.world)}, {path}</pre>"
    if isinstance(value, Frames) or value.shape:
        return None
    from frametool.grammar.pose import Pose
    from frametool.grammar.result import Result, Style
    from frametool.view.pose_text import write_poses

    parts = value.components
    pose = Pose.of(parts) if len(parts) > len("xyzw") else Pose(rotation=parts)
    return f"<pre>{escape(write_poses([Result(pose)], Style('text')))}</pre>"
