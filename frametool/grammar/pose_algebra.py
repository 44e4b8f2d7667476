"""Products, inverses and differences of poses that name their frames; frames that do not touch are refused.

map_from_tool = product(map_from_base, base_from_tool)
"""

from __future__ import annotations

import math

from frametool.errors import ValueInvalid, shown
from frametool.geometry import floats, quaternion, rigid
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.grammar.readers import Vector

RELATIVE_EXTRAS = ("distance", "angle", "angle_deg")


def product(left: Pose, right: Pose) -> Pose:
    """Return a_from_c of a_from_b and b_from_c.

    Raises ValueInvalid where both name the frame between them and the names differ.
    """
    return Pose.of(rigid.compose(*left.components, *right.components), *composed_names(left, right)[::-1])


def composed_names(left: Pose, right: Pose) -> tuple[str | None, str | None]:
    """Return parent and name of a product; raise ValueInvalid if the frames do not touch."""
    if left.name is not None and right.parent is not None and left.name != right.parent:
        raise ValueInvalid(
            f"frames do not touch: {left.parent or '?'} <- {left.name} is followed by "
            f"{right.parent} <- {right.name or '?'}; change the order, or invert one",
        )
    return left.parent, right.name


def inverse(pose: Pose) -> Pose:
    """Return b_from_a of a_from_b; what the pose does not say stays unsaid."""
    components = rigid.inverse(*pose.components)
    return Pose(
        None if pose.position is None else components[:3],
        None if pose.rotation is None else components[3:],
        pose.parent,
        pose.name,
    )


def relative(a: Pose, b: Pose) -> Result:
    """Return B seen from A, inverse(a) b, with the distance in metres and the angle in radians and degrees.

    Raises ValueInvalid where the two are given in different frames.
    """
    components = rigid.relative(*a.components, *b.components)
    distance, angle = rigid.extent(*components, floats)
    extras = dict(zip(RELATIVE_EXTRAS, (distance, angle, math.degrees(angle)), strict=True))
    parent, name = relative_names(a, b)
    return Result(Pose.of(components, name, parent), extras)


def relative_names(a: Pose, b: Pose) -> tuple[str | None, str | None]:
    """Return parent and name of B seen from A; raise ValueInvalid if they are given in different frames."""
    _refuse_two_parents(a, b)
    return a.name, b.name


def turn_between(start: Vector, end: Vector) -> Result:
    """Return the shortest rotation from one direction to another, with its angle in radians and degrees.

    Raises ValueInvalid for a vector of length 0.
    """
    quaternion.check_directions(*start, *end)
    turned = quaternion.between(*start, *end, floats)
    angle = quaternion.angle(*turned, floats)
    return Result(Pose(rotation=turned), {"angle": angle, "angle_deg": math.degrees(angle)})


def interpolated(a: Pose, b: Pose, fraction: float) -> Pose:
    """Return the pose at a fraction of the way from a (0) to b (1): straight line and slerp, as tf2 does.

    Raises ValueInvalid where the two are given in different frames.
    """
    _refuse_two_parents(a, b)
    components = rigid.interpolate(*a.components, *b.components, fraction, floats)
    return Pose.of(components, a.name if a.name == b.name else None, a.parent or b.parent)


def _refuse_two_parents(a: Pose, b: Pose) -> None:
    if a.parent is not None and b.parent is not None and a.parent != b.parent:
        raise ValueInvalid(f"A is given in {shown(a.parent)} and B in {shown(b.parent)}; give both in one frame")
