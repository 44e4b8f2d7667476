"""Blocks as tf2_echo prints them: time, translation, the rotation in three notations, the matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.frames.stamps import format_stamp
from frametool.geometry import floats, rigid
from frametool.geometry.representations import notation
from frametool.grammar.result import rotation_numbers
from frametool.view.pose_text import in_width

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.grammar.result import Result, Style

DECIMALS = 3
ROTATIONS = (("quaternion", "Quaternion"), ("rpy_rad", "RPY (radian)"), ("rpy_deg", "RPY (degree)"))


def write_blocks(results: Iterable[Result], target: str, source: str, style: Style) -> Iterator[str]:
    """Yield the blocks as they come; the first begins by saying in words which frame is seen from which."""
    heading = in_width(f"{source} seen from {target}", f"(maps points in {source} to points in {target})")
    for result in results:
        yield heading + _block(result, style)
        heading = ""


def _block(result: Result, style: Style) -> str:
    """Return one block; a path that stands still has no time."""
    decimals = DECIMALS if style.precision is None else style.precision
    stamp_ns = result.extras.get("stamp_ns")
    pose = result.pose
    lines = ["At any time: the frames stand still" if stamp_ns is None else f"At time {format_stamp(stamp_ns)}"]
    lines.append(f"- Translation: {_listed(pose.components[:3], decimals)}")
    for spec, name in ROTATIONS:
        lines.append(f"- Rotation: in {name} {_listed(rotation_numbers(pose, notation(spec), style), decimals)}")
    return "\n".join([*lines, "- Matrix:", *_matrix(result, decimals)]) + "\n"


def _matrix(result: Result, decimals: int) -> Iterable[str]:
    """Yield the four rows of the homogeneous matrix."""
    numbers = rigid.to_homogeneous(*result.pose.components, floats)
    for row in range(4):
        cells = (_fixed(value, decimals) for value in numbers[4 * row : 4 * row + 4])
        yield "".join(f" {cell:>{decimals + 3}}" for cell in cells)


def _listed(values: Sequence[float], decimals: int) -> str:
    return f"[{', '.join(_fixed(value, decimals) for value in values)}]"


def _fixed(value: float, decimals: int) -> str:
    """Round; no minus before a zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"
