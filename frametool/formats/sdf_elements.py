"""The elements of SDF that place frames, and how a pose is written in them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.documents.source import Source
from frametool.errors import ValueInvalid, shown
from frametool.geometry import euler, floats
from frametool.geometry.representations import notation
from frametool.grammar.readers import INDICES, Reading
from frametool.grammar.rotation import rotation_of

if TYPE_CHECKING:
    from frametool.documents.xml_events import XmlFile
    from frametool.documents.xml_tree import XmlNode
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options

IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_AXIS = frozenset(("xyz", "limit", "mimic", "use_parent_model_frame"))
HELD = {
    "sdf": frozenset(("world", "model", "include")),
    "world": frozenset(("model", "frame", "joint", "include", "state")),
    "model": frozenset(("model", "link", "joint", "frame", "pose", "include")),
    "link": frozenset(("pose", "sensor")),
    "sensor": frozenset(("pose",)),
    "frame": frozenset(("pose",)),
    "joint": frozenset(("pose", "parent", "child", "axis", "axis2")),
    "axis": _AXIS,
    "axis2": _AXIS,
    "limit": frozenset(("lower", "upper")),
    "mimic": frozenset(("multiplier", "offset", "reference")),
    "include": frozenset(("uri", "name")),
}


def read_pose(holder: XmlNode, xml: XmlFile, options: Options) -> tuple[Rigid, str]:
    """Read the pose of an element: x y z roll pitch yaw, or x y z qx qy qz qw.

    What is empty or missing is the identity.  Returns it with what it is relative to, "" for the default.
    Raises FormatError.
    """
    pose = holder.first("pose")
    if pose is None:
        return IDENTITY, ""
    if pose.attribute("frame"):
        message = "<pose frame=..> of SDF 1.5 has no meaning and is left out; relative_to has one"
        options.tally.note_each(message, pose.element.line)
    degrees, quaternion = _is_true(pose.attribute("degrees")), _is_quaternion(pose, xml)
    if degrees and quaternion:
        raise xml.error(pose.element, "degrees with quat_xyzw; keep one", "degrees")
    if not pose.text:
        return IDENTITY, pose.attribute("relative_to")
    numbers = xml.numbers_in(pose.text, pose.element, "", 7 if quaternion else 6)
    x, y, z = numbers[:3]
    if quaternion:
        rotation = _quaternion(pose, xml, options)
    else:
        roll, pitch, yaw = numbers[3:]
        rotation = euler.to_quaternion(roll, pitch, yaw, "sxyz", floats, degrees=degrees)
    return (x, y, z, *rotation), pose.attribute("relative_to")


def _is_true(text: str) -> bool:
    return text.lower() in ("true", "1")


def _is_quaternion(pose: XmlNode, xml: XmlFile) -> bool:
    form = pose.attribute("rotation_format")
    if form not in ("", "euler_rpy", "quat_xyzw"):
        message = f"rotation_format {shown(form)}; expected euler_rpy or quat_xyzw"
        raise xml.error(pose.element, message, "rotation_format")
    return form == "quat_xyzw"


def _quaternion(pose: XmlNode, xml: XmlFile, options: Options) -> tuple[float, float, float, float]:
    reading = Reading(Source(xml.name, ""), normalize=options.normalize)
    try:
        rotation = rotation_of(notation("xyzw"), pose.text.split()[3:], INDICES, reading)
    except ValueInvalid as error:
        raise xml.error(pose.element, str(error), rule=error.rule) from None
    for note in reading.notes:
        options.tally.note(note, pose.element.line)
    return rotation
