"""URDF written: each frame a link, each edge a fixed joint with the name of its child.

    <joint name="camera_joint" type="fixed">
      <origin xyz="0.1 0.0 1.2" rpy="0.0 0.2 0.0"/>

Metres and radians; rpy about fixed axes, which every tool reads.  Where three angles cannot say the bits of the
rotation, quat_xyzw stands beside them: tools pass over it in URDF 1.0, and `frametool.formats.urdf` reads it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid, listing, shown
from frametool.geometry import euler, floats, quaternion
from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import rotation_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.tree import FrameTree
    from frametool.geometry.types import Rigid
    from frametool.grammar.result import Style

_ESCAPES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}


def write_tree(tree: FrameTree | TransformBuffer, style: Style) -> str:
    """Return the robot.

    Raises ValueInvalid for what URDF cannot hold: frames that move, several roots, names that XML has no letters for.
    """
    if moving := [track.child for track in tree.tracks() if not track.standing]:
        raise ValueInvalid(f"URDF holds no motion, but these frames move: {listing(moving)}; give --at TIME")
    if len(tree.roots) > 1:
        message = "URDF holds one tree, and this has the roots"
        raise ValueInvalid(f"{message} {listing(tree.roots)}; --with FILE adds what connects them")
    links = "".join(f'  <link name="{_attribute(frame)}"/>\n' for frame in tree.frames)
    joints = "".join(
        _joint(parent, child, transform.components, style) for parent, child, transform in tree.edges()
    )
    return f'<?xml version="1.0"?>\n<robot name="robot">\n{links}{joints}</robot>\n'


def _joint(parent: str, child: str, components: Rigid, style: Style) -> str:
    """Write one edge."""
    pose = Pose.of(components)
    exact = tuple(rotation_numbers(pose, notation("xyzw"), style))
    angles = rotation_numbers(pose, notation("rpy_rad"), style)
    short = [float(f"{angle:.15g}") for angle in angles]  # as people write them
    said = next((each for each in (short, angles) if _from_rpy(each) == exact), None)
    origin = f'xyz="{_numbers(components[:3], style)}" rpy="{_numbers(said or angles, style)}"'
    if said is None and style.precision is None:
        origin += f' quat_xyzw="{_numbers(exact, style)}"'
    return (
        f'  <joint name="{_attribute(child)}_joint" type="fixed">\n    <origin {origin}/>\n'
        f'    <parent link="{_attribute(parent)}"/>\n    <child link="{_attribute(child)}"/>\n  </joint>\n'
    )


def _from_rpy(angles: Sequence[float]) -> tuple[float, ...]:
    """Return the quaternion that `frametool.formats.urdf` makes of the angles."""
    roll, pitch, yaw = angles
    return quaternion.canonical(*euler.to_quaternion(roll, pitch, yaw, "sxyz", floats), floats)


def _numbers(values: Sequence[float], style: Style) -> str:
    return " ".join(map(style.number, values))


def _attribute(name: str) -> str:
    """Write a name as the value of an attribute."""
    if "${" in name or "$(" in name:
        raise ValueInvalid(f"frame {shown(name)} has no place in URDF: it reads as xacro")
    if any((ord(letter) < 32 and letter not in _ESCAPES) or letter in "\ufffe\uffff" for letter in name):
        raise ValueInvalid(f"frame {shown(name)} has no place in URDF: XML has no such characters")
    return "".join(_ESCAPES.get(letter, letter) for letter in name)
