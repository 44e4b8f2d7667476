"""Joints among the columns of a table, by name: `elbow`, `elbow_deg`, `elbow [deg]`, `finger (mm)`; also stamps."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, bare, did_you_mean, listing, shown
from frametool.formats.joints import TURNING
from frametool.text.units import ANGLES, BRACKETS, LENGTHS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.formats.joints import Joint

_STAMP = re.compile(
    r"[#% ]*(?:.*[._])?(?:stamp|timestamp|time|t)(?:_(n?s))?(?:\s*[\[(]\s*(n?s)\s*[\])])?", re.IGNORECASE
)
_HOLDERS = ("joint", "joints", "position", "positions", "joint_positions")  # before a dot
_UNIT = re.compile(rf"_({'|'.join((*ANGLES, *filter(None, LENGTHS)))})$")


class JointColumn(NamedTuple):
    """A column that holds the value of a joint: radians or metres, unless its name says degrees or another length.

    per_metre: how many of its units make a metre
    """

    place: int
    joint: str
    degrees: bool = False
    per_metre: float = 1.0


def find_joint_columns(names: Sequence[str], joints: Mapping[str, Joint]) -> list[JointColumn]:
    """Return the columns that are called as joints, one a joint.

    Raises ValueInvalid: a unit that the joint cannot have, two columns for one joint, a joint whose value is a pose.
    """
    found: dict[str, JointColumn] = {}
    for place, name in enumerate(names):
        column = _joint_column(place, name, joints)
        if column is None:
            continue
        if column.joint in found:
            first = names[found[column.joint].place]
            raise ValueInvalid(f"columns {shown(first)} and {shown(name)} are both joint {shown(column.joint)}")
        found[column.joint] = column
    return list(found.values())


def _joint_column(place: int, name: str, joints: Mapping[str, Joint]) -> JointColumn | None:
    bare_name, unit = _with_unit(name.lstrip("#% ").strip(), joints)
    joint = joints.get(bare_name)
    if joint is None:
        return None
    if joint.posed:
        raise ValueInvalid(f"column {shown(name)}: joint {shown(joint.name)} is {joint.kind}, which no number says")
    units = ("rad", "deg") if joint.kind in TURNING else tuple(filter(None, LENGTHS))
    known = ANGLES if joint.kind in TURNING else LENGTHS
    if unit and unit not in known:
        raise ValueInvalid(f"column {shown(name)}: joint {shown(joint.name)} is {joint.kind}; units: {listing(units)}")
    if joint.kind in TURNING:
        return JointColumn(place, bare_name, degrees=ANGLES.get(unit, False))
    return JointColumn(place, bare_name, per_metre=LENGTHS[unit])


def _with_unit(name: str, joints: Mapping[str, Joint]) -> tuple[str, str]:
    """Part a column's name into a joint and a unit; a joint's own name is taken whole."""
    if name in joints:
        return name, ""
    holder, dot, rest = name.partition(".")
    if dot and holder in _HOLDERS:
        return _with_unit(rest, joints)
    if match := BRACKETS.search(name):
        return name[: match.start()], match[1]
    if match := _UNIT.search(name):
        return name[: match.start()], match[1]
    return name, ""


def stamp_column(names: Sequence[str], joints: Mapping[str, Joint]) -> tuple[int, bool] | None:
    """Find the column of stamps: its place, and whether they are nanoseconds; None if there is none."""
    for place, name in enumerate(names):
        if name.strip() not in joints and (match := _STAMP.fullmatch(name.strip())):
            return place, "ns" in (match[1], match[2])
    return None


def misspelt(names: Sequence[str], joints: Mapping[str, Joint]) -> str:
    """Return what is wrong with the first column that is nearly called as a joint which no other column holds."""
    held = {column.joint for column in find_joint_columns(names, joints)}
    for name in names:
        bare_name = _with_unit(name.strip(), joints)[0]
        if bare_name not in joints and (near := did_you_mean(bare_name, [*joints.keys() - held], cutoff=0.8)):
            return f"column {shown(name)} is no joint{near}"
    return ""


def no_joints(names: Sequence[str], joints: Mapping[str, Joint]) -> str:
    """Say that no column is called as a joint."""
    return f"no column is a joint; columns: {', '.join(map(bare, names[:20]))}; joints: {listing(joints)}"
