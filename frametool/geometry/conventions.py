"""Named constant rotations between the axes conventions of the field.

Each row `NAME` is the rotation `flu_from_NAME`: the pose of a frame with those axes in a frame with ROS body axes
(FLU: x forward, y left, z up) at the same place.  `axes_change(a, b)` gives any two.  The world frames are bound as in
ROS REP 103: a body at rest, facing east, has its axes along ENU.
"""

from __future__ import annotations

from math import sqrt

from frametool.errors import ValueInvalid, nearest, shown
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

# flu_from_NAME behind a mirror across y: axes that are left-handed
MIRRORED: dict[str, tuple[Rotation, str]] = {
    "unity": (AXES["optical"][0], "Unity, left-handed: x right, y up, z forward"),
}
BODY_OF = {"enu": "flu", "ned": "frd"}  # the body's axes that go with those of the world
ALIASES = {"opencv": "optical", "ros": "flu"}


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


class AxesChange:
    """A change of axes that may be a mirror too: first y is turned around if it is one, then comes the rotation."""

    __slots__ = ("mirrors", "rotation")

    def __init__(self, rotation: Rotation, *, mirrors: bool = False) -> None:
        """Keep the two together."""
        self.rotation = rotation
        self.mirrors = mirrors

    def inverse(self) -> AxesChange:
        """Return the change back."""
        back = self.rotation.inverse()
        return AxesChange(_in_mirror(back) if self.mirrors else back, mirrors=self.mirrors)

    def after(self, other: AxesChange) -> AxesChange:
        """Return the change by another and then by this one."""
        second = _in_mirror(other.rotation) if self.mirrors else other.rotation
        return AxesChange(self.rotation @ second, mirrors=self.mirrors != other.mirrors)

    def behind(self) -> Rotation:
        """Return the rotation that follows the mirror where this change stands on the right of a pose."""
        return _in_mirror(self.rotation) if self.mirrors else self.rotation


def _in_mirror(rotation: Rotation) -> Rotation:
    """Return the rotation that is seen in a mirror across y."""
    x, y, z, w = rotation.components
    return Rotation.of(-x, y, -z, w)


def named_change(text: str) -> AxesChange:
    """Return the change of axes that a text names: as `named_rotation`, also mirrored ones such as `unity_from_ros`.

    Raises:
        ValueInvalid: unknown name; with the nearest and those there are.
    """
    target, joint, source = text.partition("_from_")
    if not joint:
        target, source = "flu", text
    return _flu_from(target).inverse().after(_flu_from(source))


def _flu_from(name: str) -> AxesChange:
    """Return flu_from_NAME."""
    return AxesChange(MIRRORED[name][0], mirrors=True) if name in MIRRORED else AxesChange(_named(name))


def both_sides(world: str | None, axes: str | None) -> tuple[Rotation | None, bool, Rotation | None]:
    """Return what axes on the left and on the right of a pose make of it: W mirror(pose) B.

    Returns W, whether there is a mirror across y, and B; None for a side that stays.

    Raises:
        ValueInvalid: unknown name; a mirror on one side only, where the result would be no rotation.
    """
    identity = AxesChange(Rotation.identity())
    left = identity if world is None else named_change(world)
    right = identity if axes is None else named_change(axes)
    if left.mirrors != right.mirrors:
        told = world if left.mirrors else axes
        raise ValueInvalid(
            f"{told} is a mirror: on one side of a pose it leaves no rotation; give both sides, "
            "e.g. --world-axes unity_from_ros --axes ros_from_unity"
        )
    sides = left.rotation.canonical(), right.behind().canonical()
    return sides[0] if world else None, left.mirrors, sides[1] if axes else None


def other_side(text: str, *, of_world: bool) -> str:
    """Name the change on the other side of a pose that goes with `ned_from_enu` or `frd_from_flu`; "" without one.

    of_world: the text is that of the frame that poses are seen from
    """
    target, _, source = text.partition("_from_")
    pairs = BODY_OF if of_world else {body: world for world, body in BODY_OF.items()}
    return f"{pairs[source]}_from_{pairs[target]}" if target in pairs and source in pairs else ""


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
    """Return flu_from_NAME; a hint never offers axes that look like others with the opposite sense."""
    name = ALIASES.get(name, name)
    if name in AXES:
        return AXES[name][0]
    if name in MIRRORED:
        both = f"--world-axes {name}_from_ros --axes ros_from_{name}"
        raise ValueInvalid(f"{name} is left-handed (mirrored) and no rotation; convert changes both sides: {both}")
    near = nearest(name, (*AXES, *ALIASES))
    meant = {ALIASES.get(each, each) for each in near}
    hint = f"; did you mean {shown(near[0])}?" if len(meant) == 1 else ";"
    raise ValueInvalid(f"unknown axes {shown(name)}{hint} axes: {', '.join(AXES)}")
