"""What the page needs to move the joints of a robot: where each stands, between which limits, and which it follows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.formats.joints import JointValue

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.formats.joints import Value
    from frametool.formats.robot import Robot


def joint_sliders(robot: Robot, values: Mapping[str, Value], names: Sequence[str]) -> list[dict[str, Any]]:
    """Return the joints that turn or slide and stand still, as the page has them.

    values: of the joints, by name.  names: of the frames of the page, in its order.
    """
    index = {name: number for number, name in enumerate(names)}
    links = {child: link for child, link in robot.links.items() if link.joint and child in index}
    found: list[dict[str, Any]] = []
    for child, link in links.items():
        joint = link.joint
        value = values.get(joint.name) if joint else None
        if joint and not joint.posed and isinstance(value, JointValue):
            found.append({
                "name": joint.name, "frame": index[child], "kind": joint.kind, "axis": joint.axis,
                "origin": link.origin, "lower": joint.lower, "upper": joint.upper, "value": float(value.plain),
            })  # fmt: skip
    places = {str(each["name"]): number for number, each in enumerate(found)}
    for name, each in zip(places, found, strict=True):
        mimic = robot.joints[name].mimic
        if mimic and mimic.joint in places:
            each["mimic"] = [places[mimic.joint], mimic.multiplier, mimic.offset]
    return found
