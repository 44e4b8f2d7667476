"""Write poses and trees in YAML and JSON, in the grammar in which they are read; and as the numbers of other formats.

One document or line per result; metres, radians unless the key states degrees; numbers as Python's repr.  Angles read
back to the same rotation if possible, matrices to the last bits: a quaternion has more bits than either preserves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, listing, shown, warn
from frametool.geometry import euler, floats, quaternion, rigid
from frametool.grammar.result import Result, Style, tree_entries

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid, Three
    from frametool.grammar.readers import Quaternion


def write_poses(results: Iterable[Result | dict[str, Any]], style: Style) -> str:
    """Return one line per result in JSON, else the results as documents separated by `---`."""
    records = (each.mapping(style) if isinstance(each, Result) else each for each in results)
    if style.format == "json":
        from frametool.documents import json

        return "".join(f"{json.dump(record, style.number)}\n" for record in records)
    from frametool.documents import yaml_writer

    return "---\n".join(yaml_writer.dump(record, style.number) for record in records)


write_points = write_poses


def write_tree(tree: Frames, style: Style) -> str:
    """Return the tree in list form, roots first; JSON on one line."""
    if style.format == "json":
        from frametool.documents import json

        return f"{json.dump({'frames': list(tree_entries(tree, style))}, style.number)}\n"
    from frametool.documents.yaml_writer import flow

    entries = "".join(f"  - {flow(entry, style.number)}\n" for entry in tree_entries(tree, style))
    return f"frames:\n{entries}"


MOST_DECIMALS = 17


def refuse_motion(tree: Frames, fmt: str) -> None:
    """Raise ValueInvalid for a tree that moves, which a format cannot hold."""
    if moving := next((track.child for track in tree.tracks() if not track.is_static), None):
        raise ValueInvalid(f"{fmt} holds no moving frames, and {shown(moving)} moves; give --at TIME")


def static_edges(tree: Frames, fmt: str) -> list[tuple[str, str, Rigid]]:
    """Return parent, child and pose of the edges of a tree; warns about frames that nothing is connected to.

    Raises ValueInvalid if it moves, or has none.
    """
    refuse_motion(tree, fmt)
    edges = [(track.parent, track.child, track.components) for track in tree.tracks()]
    if not edges:
        raise ValueInvalid(f"{fmt} holds poses, and the tree has none: {listing(tree.frames)}")
    parents = {parent for parent, _, _ in edges}
    if lonely := [frame for frame in tree.roots if frame not in parents]:
        warn(f"{fmt} cannot store frames without a pose: {', '.join(map(shown, lonely[:5]))} left out")
    return edges


def angles_of(rotation: Quaternion) -> Three[float]:
    """Return roll, pitch, yaw of a rotation: with the fewest decimals that give the same bits, else the nearest."""
    original = quaternion.from_quaternion(*rotation, floats)
    exact: Three[float] = euler.from_quaternion(*original, "sxyz", floats)
    for decimals in range(MOST_DECIMALS):
        roll, pitch, yaw = (round(angle, decimals) for angle in exact)
        if of_angles((roll, pitch, yaw)) == original:
            return roll, pitch, yaw
    return exact


def of_angles(angles: Iterable[float]) -> Quaternion:
    """Return the rotation that roll, pitch and yaw are read as."""
    roll, pitch, yaw = angles
    return quaternion.canonical(*euler.to_quaternion(roll, pitch, yaw, "sxyz", floats), floats)


def rows_of(pose: Rigid) -> list[list[float]]:
    """Return the rows of the 4x4 matrix of a pose."""
    numbers = rigid.to_homogeneous(*pose[:3], *quaternion.from_quaternion(*pose[3:], floats), floats)
    return [[number + 0.0 for number in numbers[at : at + 4]] for at in (0, 4, 8, 12)]  # avoids -0.0
