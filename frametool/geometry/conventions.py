"""Named constant rotations between the axes conventions of the field.

Each row `NAME` is the rotation `flu_from_NAME`: the pose of a frame with those axes in a frame with ROS body axes
(FLU: x forward, y left, z up) at the same place.  `axes_change(a, b)` gives any two.  The world frames are bound as in
ROS REP 103: a body at rest, facing east, has its axes along ENU.
"""

from __future__ import annotations

from math import sqrt

from frametool.errors import ValueInvalid, did_you_mean, shown
from frametool.geometry import euler, floats, quaternion
from frametool.geometry.rotation import Rotation

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

HALF, ROOT = 0.5, sqrt(0.5)

AXES: dict[str, tuple[Rotation, str]] = {
    "flu": (Rotation.of(0.0, 0.0, 0.0, 1.0), "ROS body (REP 103): x forward, y left, z up"),
    "frd": (Rotation.of(1.0, 0.0, 0.0, 0.0), "aircraft body: x forward, y right, z down"),
    "optical": (Rotation.of(-HALF, HALF, -HALF, HALF), "camera (ROS optical, OpenCV): x right, y down, z forward"),
    "opengl": (Rotation.of(HALF, -HALF, -HALF, HALF), "OpenGL and Blender camera: x right, y up, z backward"),
    "enu": (Rotation.of(0.0, 0.0, 0.0, 1.0), "world (REP 103): x east, y north, z up"),
    "ned": (Rotation.of(ROOT, ROOT, 0.0, 0.0), "world of aircraft: x north, y east, z down"),
}


def axes_change(target: str, source: str) -> Rotation:
    """Return the rotation that takes coordinates in the source's axes to the target's: `axes_change("enu", "ned")`.

    Raises:
        ValueInvalid: unknown name; with the nearest and those there are.
    """
    return (_named(target).inverse() @ _named(source)).canonical()


def named_rotation(text: str) -> Rotation:
    """Return the rotation that a text names: `optical` is flu_from_optical, `ned_from_enu` any two.

    Raises:
        ValueInvalid: unknown name; with the nearest and those there are.
    """
    target, joint, source = text.partition("_from_")
    return axes_change(target, source) if joint else axes_change("flu", text)


def find_euler(rotation: Rotation, angles: Sequence[float], *, tolerance: float = 1e-6) -> list[str]:
    """Return the Euler conventions in which three angles are this rotation, within `tolerance`; all in radians.

    Raises:
        ValueInvalid: there is none; with the nearest.
    """
    first, second, third = angles
    off = {}
    for axes in sorted(euler.AXES):
        made = euler.to_quaternion(first, second, third, axes, floats)
        off[axes] = quaternion.distance(*made, *rotation.components, floats)
    near = min(off, key=off.__getitem__)
    if off[near] > tolerance:
        found = f"{near} is off by {off[near]:g}"
        raise ValueInvalid(f"no Euler convention gives these angles within {tolerance:g} rad; {found}")
    return [axes for axes, angle in off.items() if angle <= tolerance]


def _named(name: str) -> Rotation:
    if name not in AXES:
        near = did_you_mean(name, AXES) or ";"
        raise ValueInvalid(f"unknown axes {shown(name)}{near} axes: {', '.join(AXES)}")
    return AXES[name][0]
