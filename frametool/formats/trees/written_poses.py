"""Write poses and trees in YAML and JSON, in the grammar in which they are read; and as the numbers of other formats.

One document or line per result; metres, radians unless the key states degrees; numbers as Python's repr.  Angles and
matrices are chosen so that they read back to the same rotation if possible: a quaternion has more bits than three
angles or nine entries preserve.  A remaining difference is reported once.

"""

from __future__ import annotations

from itertools import product
from math import copysign, pi
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, listing, shown, warn
from frametool.geometry import euler, floats, matrix, quaternion, rigid
from frametool.grammar.result import Result, Style, tree_entries

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid, Three
    from frametool.grammar.readers import Quaternion


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return one document or line per result."""
    return write_points((result.mapping(style) for result in results), style)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return one line per record in JSON, else the records as documents separated by `---`."""
    if style.format == "json":
        from frametool.documents import json

        return "".join(f"{json.dump(record, style.number)}\n" for record in records)
    from frametool.documents import yaml_writer

    return "---\n".join(yaml_writer.dump(record, style.number) for record in records)


def write_tree(tree: Frames, style: Style) -> str:
    """Return the tree in list form, roots first; JSON on one line."""
    if style.format == "json":
        from frametool.documents import json

        return f"{json.dump({'frames': list(tree_entries(tree, style))}, style.number)}\n"
    from frametool.documents.yaml_writer import flow

    entries = "".join(f"  - {flow(entry, style.number)}\n" for entry in tree_entries(tree, style))
    return f"frames:\n{entries}"


MOST_DECIMALS = 17


def static_edges(tree: Frames, fmt: str) -> list[tuple[str, str, Rigid]]:
    """Return parent, child and pose of the edges of a tree; raises ValueInvalid if it moves, or has none."""
    tracks = list(tree.tracks())
    if moving := next((track.child for track in tracks if not track.is_static), None):
        raise ValueInvalid(f"{fmt} holds no moving frames, and {shown(moving)} moves; give --at TIME")
    if not tracks:
        raise ValueInvalid(f"{fmt} holds poses, and the tree has none: {listing(tree.frames)}")
    return [(track.parent, track.child, track.components) for track in tracks]


def warn_lonely_roots(tree: Frames, fmt: str) -> None:
    """Warn about frames that a format cannot name because nothing is connected to them."""
    parents = {track.parent for track in tree.tracks()}
    if lonely := [frame for frame in tree.roots if frame not in parents]:
        warn(f"{fmt} cannot store frames without a pose: {', '.join(map(shown, lonely[:5]))} left out")


class Precision:
    """The largest difference between the poses and what is read back."""

    def __init__(self, fmt: str, notation: str) -> None:
        """Start with nothing written; `notation` is that of the rotations."""
        self.format, self.notation = fmt, notation
        self.metres = 0.0
        self.radians = 0.0

    def add(self, original: Rigid, back: Rigid) -> None:
        """Compare one pose with what is read back."""
        same = (*original[:3], *quaternion.from_quaternion(*original[3:], floats))
        if same != back:
            metres, radians = rigid.distance(*original, *back, floats)
            self.metres, self.radians = max(self.metres, metres), max(self.radians, radians)

    def tell(self, style: Style) -> None:
        """Warn if anything differs that could be written more exactly; fixed decimals are the user's choice."""
        if style.precision is None and (self.metres or self.radians):
            off = " and ".join(
                f"{value:.1g} {unit}" for value, unit in ((self.metres, "m"), (self.radians, "rad")) if value
            )
            warn(f"{self.format}: poses are written as {self.notation}; they read back to within {off}")


def angles_of(rotation: Quaternion) -> tuple[Three[float], Quaternion]:
    """Return roll, pitch, yaw of a rotation, and the rotation that they read back to.

    The angles with the fewest decimals that give the same bits, which are those of a file the rotation came from;
    otherwise the nearest angles.  The equivalent angles on the other side are tried too.
    """
    original = quaternion.from_quaternion(*rotation, floats)
    exact: Three[float] = euler.from_quaternion(*original, "sxyz", floats)
    for decimals in range(MOST_DECIMALS):
        for roll, yaw in product(*((angle, angle - copysign(2.0 * pi, angle)) for angle in (exact[0], exact[2]))):
            angles = (round(roll, decimals), round(exact[1], decimals), round(yaw, decimals))
            if of_angles(angles) == original:
                return angles, original
    return exact, of_angles(exact)


def of_angles(angles: Iterable[float]) -> Quaternion:
    """Return the rotation that roll, pitch and yaw are read as."""
    roll, pitch, yaw = angles
    return quaternion.canonical(*euler.to_quaternion(roll, pitch, yaw, "sxyz", floats), floats)


def rows_of(pose: Rigid) -> tuple[list[list[float]], Rigid]:
    """Return the rows of the 4x4 matrix of a pose, and the pose that they read back to."""
    position, original = pose[:3], quaternion.from_quaternion(*pose[3:], floats)
    numbers = [number + 0.0 for number in rigid.to_homogeneous(*position, *original, floats)]  # avoids -0.0
    turn = matrix.check(*numbers[0:3], *numbers[4:7], *numbers[8:11])
    back = quaternion.canonical(*matrix.to_quaternion(*turn, floats), floats)
    return [list(numbers[at : at + 4]) for at in (0, 4, 8, 12)], (*position, *back)
