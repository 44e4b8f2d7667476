"""Named constant rotations between the axes conventions of the field.

Each row `NAME` is the rotation `flu_from_NAME`: the pose of a frame with those axes in a frame with ROS body axes
(FLU: x forward, y left, z up) at the same position.  `axes_change(a, b)` combines any two.  World frames follow ROS
REP 103: a body at rest that faces east has its axes along ENU.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, nearest, shown
from frametool.geometry import euler, floats, matrix, quaternion
from frametool.geometry.representations import WORLDS
from frametool.geometry.transform import Rotation

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

# flu_from_NAME of left-handed axes, after a reflection in y
MIRRORED: dict[str, tuple[Rotation, str]] = {
    "unity": (AXES["optical"][0], "Unity, left-handed: x right, y up, z forward"),
    "unreal": (AXES["flu"][0], "Unreal Engine, left-handed: x forward, y right, z up, in cm"),
}
SYSTEMS = {"ros": ("enu", "flu"), "aircraft": ("ned", "frd")}  # the axes of the world, and of bodies in it
ALIASES = {"opencv": "optical", "blender": "opengl"}
IN_CENTIMETRES = "unreal"
ENGINE_ANGLES = {"unreal": "rpy_unreal", "unity": "euler_unity"}  # the representation of each engine's own angles
OWN = "x,-y,-z"  # user-defined axes: (x, y, z) becomes (x, -y, -z)


def axes_change(target: str, source: str) -> Rotation:
    """Return the rotation that takes coordinates in the source's axes to the target's: `axes_change("enu", "ned")`.

    Raises:
        ValueInvalid: unknown name; lists the nearest name and all names.
    """
    return named_rotation(f"{target}_from_{source}")


def named_rotation(text: str) -> Rotation:
    """Return the rotation named by a text: `optical` is flu_from_optical, `ned_from_enu` any two, or `x,-y,-z`.

    Raises:
        ValueInvalid: unknown name (lists the nearest and all names), or a reflection.
    """
    change = named_change(text)
    if change.mirrors:
        both = f"--all-axes {text if '_from_' in text or ',' in text else f'{text}_from_ros'}"
        message = f"{text} is left-handed (mirrored) and no rotation; convert changes both sides: {both}"
        raise ValueInvalid(message, rule="mirrored")
    return change.rotation.canonical()


class AxesChange(NamedTuple):
    """A change of axes that may include a reflection: first y is negated if so, then the rotation is applied."""

    rotation: Rotation
    mirrors: bool = False

    def behind(self) -> Rotation:
        """Return the rotation that follows the reflection if this change is on the right side of a pose."""
        x, y, z, w = self.rotation.components
        return Rotation.of(-x, y, -z, w) if self.mirrors else self.rotation


def named_change(text: str, *, of_world: bool = False) -> AxesChange:
    """Return the change of axes named by a text: as `named_rotation`, and reflections such as `unity_from_ros`.

    of_world: the names of systems, `ros` and `aircraft`, mean their world axes, not their body axes

    Raises:
        ValueInvalid: unknown name; lists the nearest name and all names.
    """
    if "," in text:  # (x, y, z) becomes (x, -y, -z) for `x,-y,-z`
        rows = [[float((letter == each) - (f"-{letter}" == each)) for letter in "xyz"] for each in _letters(text)]
        mirrors = matrix.determinant(*matrix.nine(entry for row in rows for entry in row)) < 0.0
        entries = matrix.nine(entry for x, y, z in rows for entry in (x, -y if mirrors else y, z))
        return AxesChange(Rotation.of(*matrix.to_quaternion(*entries, floats)), mirrors)
    target, joint, source = text.partition("_from_")
    if not joint:
        target, source = "flu", text
    names = (_system(name)[not of_world] for name in (target, source))
    (back, mirrors), (there, other) = (({**AXES, **MIRRORED}[name][0], name in MIRRORED) for name in names)
    return AxesChange(AxesChange(back.inverse() @ there, mirrors).behind(), mirrors != other)


def _letters(text: str) -> list[str]:
    """Return three signed letters, each axis once; raise ValueInvalid for anything else."""
    found = [each.strip().removeprefix("+") for each in text.split(",")]
    if sorted(each.removeprefix("-") for each in found) != ["x", "y", "z"]:
        raise ValueInvalid(f"{shown(text)} is not a set of axes: x, y and z once each, with their signs, as {OWN}")
    return found


def sides_of(text: str) -> tuple[str, str]:
    """Return the changes W and B on the left and right side of a pose for `A_from_B` of systems: p becomes W p B.

    `aircraft_from_ros` is ned_from_enu and flu_from_frd.  A single set of axes, also user-defined ones, applies to
    world and bodies alike, so that B is the inverse of W.

    Raises:
        ValueInvalid: unknown name; not of the form `A_from_B`.
    """
    if "," in text:
        letters = _letters(text)
        at = {each.removeprefix("-"): ("-" * each.startswith("-")) + "xyz"[place] for place, each in enumerate(letters)}
        return ",".join(letters), ",".join(at[letter] for letter in "xyz")
    target, joint, source = text.partition("_from_")
    ends = (  # a name of axes means the system that it belongs to: `ned` aircraft
        next((axes for axes in SYSTEMS.values() if name in axes), None) or _system(name)
        for name in (target, source if joint else "ros")
    )
    (world, body), (from_world, from_body) = ends
    if not joint:
        raise ValueInvalid(f"{shown(text)} is one end of a change; give A_from_B, as {text}_from_ros")
    return f"{world}_from_{from_world}", f"{from_body}_from_{body}"


def world_of(change: str) -> str:
    """Return `enu` or `ned` where a change of a world's axes, `A_from_B`, ends in one of them; else ""."""
    name, joint, _ = change.partition("_from_")
    world = SYSTEMS.get(name, (name,))[0]
    return world if joint and world in WORLDS else ""


def _system(name: str) -> tuple[str, str]:
    """Return the world axes and the body axes of a system."""
    name = ALIASES.get(name, name)
    if name in SYSTEMS or name in AXES or name in MIRRORED:
        return SYSTEMS.get(name, (name, name))
    known = (*AXES, *MIRRORED, *SYSTEMS, *ALIASES)
    near = nearest(name, known)
    meant = {ALIASES.get(each, each) for each in near}  # a suggestion never has axes of the opposite sense
    hint = f"; did you mean {shown(near[0])}?" if len(meant) == 1 else ";"
    raise ValueInvalid(f"unknown axes {shown(name)}{hint} axes: {', '.join(known)}, or three letters: {OWN}")


def both_sides(world: str | None, axes: str | None) -> tuple[Rotation | None, bool, Rotation | None]:
    """Return W, mirror and B for changes of axes on the left and right side of a pose: W mirror(pose) B.

    W and B are None for an unchanged side; mirror is True for a reflection across y.

    Raises:
        ValueInvalid: unknown name; a reflection on one side only, whose result would not be a rotation.
    """
    identity = AxesChange(Rotation.identity())
    left = identity if world is None else named_change(world, of_world=True)
    right = identity if axes is None else named_change(axes)
    if left.mirrors != right.mirrors:
        mirror = world if left.mirrors else axes
        raise ValueInvalid(
            f"{mirror} is a mirror, which on one side leaves no rotation; give both: --all-axes unity_from_ros is "
            "--world-axes unity_from_ros --axes ros_from_unity"
        )
    if world and axes and left.mirrors and "," not in world + axes:
        body, _, new = axes.partition("_from_")
        if (body in MIRRORED) != (world.partition("_from_")[2] in MIRRORED):
            raise ValueInvalid(
                f"--axes {axes} begins at axes of the other hand: it stands on the right of the pose, so beside "
                f"--world-axes {world} it is --axes {new}_from_{body}"
            )
    sides = left.rotation.canonical(), right.behind().canonical()
    return sides[0] if world else None, left.mirrors, sides[1] if axes else None


def other_side(text: str, *, of_world: bool) -> str:
    """Return the change on the other side that usually goes with `ned_from_enu` or `frd_from_flu`; "" without one.

    of_world: the text is the change of the reference frame
    """
    target, _, source = text.partition("_from_")
    pairs = {each[not of_world]: each[of_world] for each in SYSTEMS.values()}
    return f"{pairs[source]}_from_{pairs[target]}" if target in pairs and source in pairs else ""


def find_euler(rotation: Rotation, angles: Sequence[float], *, tolerance: float = 1e-6) -> list[str]:
    """Return the Euler conventions in which three angles are this rotation, within `tolerance`; all in radians.

    Raises:
        ValueInvalid: there is none; names the nearest.
    """
    first, second, third = angles
    off = {}
    for axes in sorted(euler.AXES):
        made = euler.to_quaternion(first, second, third, axes, floats)
        off[axes] = quaternion.distance(*made, *rotation.components, floats)
    near = min(off, key=off.__getitem__)
    if off[near] > tolerance:
        found = f"{near} is off by {off[near]:g}"
        if off[near] < 0.1:
            found += f", which --tolerance {1.01 * off[near]:.2g} takes"
        raise ValueInvalid(f"no Euler convention gives these angles within {tolerance:g} rad; {found}")
    return [axes for axes, angle in off.items() if angle <= tolerance]
