"""The joints of a robot, whatever form described it, and the values they take: radians, metres, poses.

    Joint("elbow", "revolute", (0.0, 1.0, 0.0), lower=-2.0, upper=2.0)

A value is text as people write it (`0.5`, `30deg`, `pi/2`, `2cm`), a number, or a pose where a joint has no single one.
"""

from __future__ import annotations

from typing import NamedTuple

from frametool.documents.document import parse_documents
from frametool.errors import FormatError, ValueInvalid, shown
from frametool.geometry import floats
from frametool.geometry.rigid import slid, turned
from frametool.geometry.trig import DEGREE, RADIAN
from frametool.grammar.pose import read_pose
from frametool.grammar.readers import Misfit, Reading, as_mapping, kind
from frametool.text.numbers import parse_angle, parse_length

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, TypeAlias

    from frametool.documents.source import Source
    from frametool.geometry.types import Number, Rigid
    from frametool.grammar.readers import Vector

    Value: TypeAlias = "JointValue | Rigid"

TURNING = ("revolute", "continuous")
POSED = ("planar", "floating", "ball")  # no single number says where these stand
KINDS = (*TURNING, "prismatic", *POSED)
OUT_OF_PLANE = 1e-9


class Mimic(NamedTuple):
    """A joint follows another one: multiplier * value + offset, in radians or metres."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


class Joint(NamedTuple):
    """A joint that can move.

    kind: one of KINDS
    axis: unit, in the frame of the joint; of a planar one the normal of its plane
    lower, upper: limits in radians or metres, if it has any
    rest: the value where nothing has moved, which it has unless told (MJCF's `ref`)
    line: on which it was written
    """

    name: str
    kind: str
    axis: Vector = (1.0, 0.0, 0.0)
    lower: float | None = None
    upper: float | None = None
    mimic: Mimic | None = None
    rest: float = 0.0
    line: int = 0

    @property
    def posed(self) -> bool:
        """Tell whether its value is a pose."""
        return self.kind in POSED

    @property
    def start(self) -> Value:
        """Return the value it has unless told."""
        return IDENTITY if self.posed else JointValue(self.rest)


class JointValue(NamedTuple):
    """The value of a joint that turns or slides: a float or an array; radians or metres, or degrees, which stay exact.

    An angle in degrees is never turned into radians on its way: quarter turns have exact poses.
    """

    number: Number
    degrees: bool = False

    @property
    def plain(self) -> Number:
        """Return it in radians or metres."""
        return self.number * DEGREE if self.degrees else self.number


IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def motion(joint: Joint, value: Value) -> Rigid:
    """Return what a joint does to the frame behind it, for a value that is no array."""
    if not isinstance(value, JointValue):
        return value
    number, degrees = value
    if not degrees and number == joint.rest:
        return IDENTITY
    if joint.rest:
        number = number - (joint.rest * RADIAN if degrees else joint.rest)
    if joint.kind == "prismatic":
        return slid(*joint.axis, number)
    return turned(*joint.axis, number, floats, degrees=degrees)


def followed(joint: Joint, leader: Value) -> Value:
    """Return the value of a joint that mimics another one; it is not held back by limits."""
    if joint.mimic is None or not isinstance(leader, JointValue):
        return joint.start
    _, multiplier, offset = joint.mimic
    if leader.degrees and joint.kind in TURNING:
        return JointValue(leader.number * multiplier + offset * RADIAN, degrees=True)
    return JointValue(leader.plain * multiplier + offset)


def read_value(joint: Joint, value: Any, source: Source, *, normalize: bool = False) -> Value:
    """Read the value of a joint: a number, text with or without a unit, a mapping that is a pose.

    source: where it stands, for messages.  Raises Misfit with the path below the value, and ValueInvalid.
    """
    if joint.posed:
        return _read_posed(joint, value, source, normalize=normalize)
    if isinstance(value, (JointValue, float)):
        return value if isinstance(value, JointValue) else JointValue(value)
    if type(value) is not str:
        raise Misfit(f"joint {shown(joint.name)} is {joint.kind}: expected {_unit(joint)}, found {kind(value)}")
    if joint.kind == "prismatic":
        return JointValue(parse_length(value))
    number, unit = parse_angle(value)
    return JointValue(number, degrees=unit == "deg")


def _unit(joint: Joint) -> str:
    return "metres, or 2cm" if joint.kind == "prismatic" else "radians, or 30deg"


def _read_posed(joint: Joint, value: Any, source: Source, *, normalize: bool) -> Rigid:
    """Read the pose of a planar, floating or ball joint."""
    example = "'{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}'"
    expected = f"joint {shown(joint.name)} is {joint.kind}: it takes a POSE, as {example}"
    if type(value) is str and value.lstrip().startswith("{"):
        try:
            documents = parse_documents(value, source.name)
        except FormatError as error:
            raise ValueInvalid(f"joint {shown(joint.name)}: {error.message}") from None
        value = documents[0].value if len(documents) == 1 else None
    if type(value) is not dict:
        raise Misfit(f"{expected}; found {kind(value)}")
    pose = read_pose(as_mapping(value, expected), Reading(source, normalize=normalize))
    if pose.name is not None or pose.parent is not None:
        raise Misfit(f"joint {shown(joint.name)} names its frames itself; leave name and parent out")
    _check_freedom(joint, pose.components)
    return pose.components


def _check_freedom(joint: Joint, components: Rigid) -> None:
    """Refuse a pose that the joint cannot take."""
    tx, ty, tz, x, y, z, _ = components
    ax, ay, az = joint.axis
    if joint.kind == "ball" and (tx or ty or tz):
        raise Misfit(f"joint {shown(joint.name)} is a ball joint: it turns only; leave the position out")
    if joint.kind == "planar":
        along = ax * tx + ay * ty + az * tz
        tilt = max(map(abs, (y * az - z * ay, z * ax - x * az, x * ay - y * ax)))
        if max(abs(along), tilt) > OUT_OF_PLANE * (1.0 + max(map(abs, (tx, ty, tz)))):
            normal = f"{ax:g} {ay:g} {az:g}"
            raise Misfit(f"joint {shown(joint.name)} is planar: this pose leaves the plane across {normal}")
