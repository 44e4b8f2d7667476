"""URDF, the robot description of ROS, read; its joints take values.

    <joint name="elbow" type="revolute"><origin xyz="0 0 1" rpy="0 0 0"/><parent link="arm"/><child link="tip"/>
      <axis xyz="0 1 0"/><limit lower="-2" upper="2"/><mimic joint="shoulder" multiplier="-1"/></joint>

Metres and radians; rpy about fixed axes x, y, z, or quat_xyzw (URDF 1.1), or both where they agree.  Links are the
frames.  parent_from_child = origin * motion, the motion in the frame behind the origin, along or about the axis.
xacro is refused, not expanded.

Written, each edge is a fixed joint with the name of its child.  Where three angles cannot say the bits of the rotation,
quat_xyzw stands beside them, which tools pass over in URDF 1.0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.source import UTF16, Source
from frametool.documents.xml import XmlFile
from frametool.errors import FormatError, ValueInvalid, alternatives, bare, listing, shown
from frametool.formats.robots.joints import IDENTITY, Joint, Mimic
from frametool.formats.robots.posture import Posture
from frametool.formats.table import FORMATS
from frametool.geometry import euler, floats, quaternion
from frametool.geometry.quaternion import unit_vector
from frametool.geometry.representations import notation
from frametool.grammar.edges import Edge
from frametool.grammar.pose import Pose
from frametool.grammar.readers import INDICES, Note, Reading
from frametool.grammar.result import rotation_numbers
from frametool.grammar.rotation_spelling import TURN, agreeing_rotation, rotation_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.documents.xml import Element
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.lookups import FrameTree
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.grammar.readers import Quaternion, Vector
    from frametool.grammar.result import Style

KINDS = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
PARTS = ("origin", "parent", "child", "axis", "limit", "mimic")


class Hinge(NamedTuple):
    """What connects a link to its parent: the pose at rest, and the joint, None for a fixed one."""

    name: str
    parent: str
    child: str
    origin: Rigid
    joint: Joint | None
    element: Element


class RobotDescription(NamedTuple):
    """The links of a robot, each with its line, and what connects them, in the order of the file."""

    xml: XmlFile
    links: dict[str, int]
    hinges: list[Hinge]

    @property
    def roots(self) -> list[str]:
        """Return the links that hang nowhere."""
        children = {hinge.child for hinge in self.hinges}
        return [link for link in self.links if link not in children]

    def posture(self, options: Options) -> Posture:
        """Return where the joints stand, as the options say."""
        places = {hinge.name: hinge.element for hinge in self.hinges}
        joints = [hinge.joint for hinge in self.hinges if hinge.joint]
        fixed = [hinge.name for hinge in self.hinges if not hinge.joint]
        return Posture(joints, options, lambda joint, problem: self.xml.error(places[joint.name], problem), fixed=fixed)


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a robot, its joints as told, else at 0."""
    robot = describe(file, options)
    for link in robot.roots:
        yield Edge(None, link, IDENTITY, line=robot.links[link])
    posture = robot.posture(options)
    for _, parent, child, origin, joint, element in robot.hinges:
        if joint is None:
            yield Edge(parent, child, origin, line=element.line)
        else:
            yield from posture.edges(parent, child, origin, joint.name, element.line)


def describe(file: InputFile, options: Options) -> RobotDescription:
    """Read the links and joints of a robot.

    Raises FormatError for what is no URDF; what is wrong with one joint goes to `options.report`.
    """
    xml = XmlFile(file)
    reader = _Reader(xml, options)
    for element in xml.elements(deepest=3, ends=False):
        reader.take(element)
    reader.end_joint()
    robot = RobotDescription(xml, reader.links, list(reader.connected()))
    if not robot.links:
        raise FormatError("no links in it", source=file.name)
    if len(roots := robot.roots) > 1:
        named = f"{', '.join(map(bare, roots[:5]))}{', ..' * (len(roots) > 5)}"
        message = f"{len(roots)} roots, where a robot has one: {named}; they are not connected"
        options.tally.note(Note("several-roots", message, ()), robot.links[roots[1]])
    return robot


class _Reader:
    """Takes elements as they come, and keeps what the joint in hand is made of."""

    def __init__(self, xml: XmlFile, options: Options) -> None:
        self.xml = xml
        self.options = options
        self.bare = options.tally.names.bare
        self.links: dict[str, int] = {}
        self.hinges: dict[str, Hinge] = {}
        self.outer: Element | None = None  # the link or joint in hand
        self.parts: dict[str, Element] = {}
        # few files hold what would have to be looked for in every attribute
        self.suspicious = b"$" in xml.data or b"xacro" in xml.data or xml.data.startswith(UTF16)

    def take(self, element: Element) -> None:
        """Take the beginning of an element down to the parts of joints."""
        if self.suspicious:
            self._refuse_xacro(element)
        if element.depth == 3:
            self._inside(element)
            return
        self.end_joint()
        self.outer = element
        self.parts = {}
        if element.depth == 1:
            if element.tag != "robot":
                raise self.xml.error(element, f"URDF begins with <robot>, found <{bare(element.tag)}>")
        elif element.tag == "link":
            try:
                self._link(element)
            except FormatError as error:
                self.options.report(error)

    def _link(self, element: Element) -> None:
        name = self.bare(self._name(element))
        if name in self.links:
            raise self.xml.error(element, f"link {shown(name)} twice; first in line {self.links[name]}", "name")
        self.links[name] = element.line

    def _inside(self, element: Element) -> None:
        """Keep a part of a joint; links and joints do not stand inside links."""
        outer, tag = self.outer.tag if self.outer else "", element.tag
        if outer == "joint":
            if tag in PARTS and self.parts.setdefault(tag, element) is not element:
                self.options.report(self.xml.error(element, f"<{tag}> twice in one joint"))
        elif outer == "link" and tag in ("link", "joint"):
            raise self.xml.error(element, f"<{tag}> inside a <link>; links and joints stand side by side in <robot>")

    def _refuse_xacro(self, element: Element) -> None:
        """Refuse what xacro would have to expand first: its elements, and expressions in attributes."""
        if element.tag.startswith("xacro:"):
            raise self.xml.error(element, f"<{bare(element.tag)}> is {_XACRO}")
        for name, value in element.attributes.items():
            if "${" in value or "$(" in value:
                raise self.xml.error(element, f"{shown(value)} is {_XACRO}", name)

    def end_joint(self) -> None:
        """Read the joint in hand, if it is one, from its parts."""
        if self.outer is None or self.outer.tag != "joint":
            return
        try:
            hinge = self._hinge(self.outer, self.parts)
        except FormatError as error:
            self.options.report(error)
        else:
            self.hinges[hinge.name] = hinge

    def _name(self, element: Element, attribute: str = "name") -> str:
        """Return an attribute that names something."""
        name = element.attributes.get(attribute)
        if not name:
            raise self.xml.error(element, f"<{element.tag}> has no {attribute}", attribute if name is not None else "")
        return name

    def _hinge(self, element: Element, parts: dict[str, Element]) -> Hinge:
        """Read one joint from its parts."""
        name = self._name(element)
        kind = self._name(element, "type")
        if name in self.hinges:
            line = self.hinges[name].element.line
            raise self.xml.error(element, f"joint {shown(name)} twice; first in line {line}", "name")
        if kind not in KINDS:
            message = f"joint {shown(name)} has the type {shown(kind)}{alternatives(kind, KINDS, 'types')}"
            raise self.xml.error(element, message, "type")
        if "parent" not in parts or "child" not in parts:
            missing = "child" if "parent" in parts else "parent"
            raise self.xml.error(element, f"joint {shown(name)} has no <{missing}>")
        parent, child = self.bare(self._name(parts["parent"], "link")), self.bare(self._name(parts["child"], "link"))
        origin = self._origin(parts["origin"]) if "origin" in parts else IDENTITY
        joint = None if kind == "fixed" else self._joint(name, kind, element, parts)
        return Hinge(name, parent, child, origin, joint, element)

    def _origin(self, element: Element) -> Rigid:
        """Read the pose of a joint in its parent: rpy, or a quaternion."""
        numbers = self.xml.numbers
        x, y, z = numbers(element, "xyz", 3, "0 0 0")
        roll, pitch, yaw = numbers(element, "rpy", 3, "0 0 0")
        rotation = IDENTITY[3:]
        if beyond := next((each for each in (roll, pitch, yaw) if abs(each) > TURN), None):
            message = f"rpy {beyond:g} is more than a full turn in radians; degrees?"
            self.options.tally.note(Note("degrees", message, ()), element.line)
        if roll or pitch or yaw:
            rotation = euler.to_quaternion(roll, pitch, yaw, "sxyz", floats)
        if "quat_xyzw" in element.attributes:
            rotation = self._quaternion(element, rotation if "rpy" in element.attributes else None)
        return x, y, z, *rotation

    def _quaternion(self, element: Element, other: Quaternion | None) -> Quaternion:
        """Read quat_xyzw, which must agree with the angles if they stand beside it, and says more digits than they."""
        self.xml.numbers(element, "quat_xyzw", 4)
        reading = Reading(Source(self.xml.name, ""), normalize=self.options.normalize)
        texts = element.attributes["quat_xyzw"].split()
        try:
            rotation = rotation_of(notation("xyzw"), texts, INDICES, reading)
            if other is not None:
                agreeing_rotation(rotation, other)
        except ValueInvalid as error:
            raise self.xml.error(element, str(error), "quat_xyzw", rule=error.rule) from None
        for note in reading.notes:
            self.options.tally.note(note, element.line)
        return rotation

    def _joint(self, name: str, kind: str, element: Element, parts: dict[str, Element]) -> Joint:
        """Read what moves: axis, limits, the joint that is followed."""
        axis = self._axis(name, parts["axis"]) if "axis" in parts and kind in WITH_AXIS else (1.0, 0.0, 0.0)
        lower, upper = self._limits(name, parts["limit"]) if "limit" in parts and kind in LIMITED else (None, None)
        mimic = self._mimic(name, kind, parts["mimic"]) if "mimic" in parts else None
        return Joint(name, kind, axis, lower, upper, mimic, line=element.line)

    def _axis(self, name: str, element: Element) -> Vector:
        x, y, z = self.xml.numbers(element, "xyz", 3, "1 0 0")
        if not (x or y or z):
            raise self.xml.error(element, f"joint {shown(name)} has the axis 0 0 0, which is no direction", "xyz")
        return (x, y, z) if x * x + y * y + z * z == 1.0 else unit_vector(x, y, z, floats)

    def _limits(self, name: str, element: Element) -> tuple[float | None, float | None]:
        """Read lower and upper; one that is missing is 0, and no limits are none."""
        if not ("lower" in element.attributes or "upper" in element.attributes):
            return None, None
        (lower,), (upper,) = self.xml.numbers(element, "lower", 1, "0"), self.xml.numbers(element, "upper", 1, "0")
        if lower > upper:
            message = f"joint {shown(name)} has the limits {lower:g} .. {upper:g}, which nothing fits"
            self.options.tally.note(Note("limit", message, ()), element.line)
        return lower, upper

    def _mimic(self, name: str, kind: str, element: Element) -> Mimic:
        leader = self._name(element, "joint")
        if kind in ("planar", "floating"):
            raise self.xml.error(element, f"joint {shown(name)} is {kind}: it follows no other")
        (multiplier,) = self.xml.numbers(element, "multiplier", 1, "1")
        (offset,) = self.xml.numbers(element, "offset", 1, "0")
        return Mimic(leader, multiplier, offset)

    def connected(self) -> Iterator[Hinge]:
        """Yield the joints between links that there are."""
        for hinge in self.hinges.values():
            missing = next((link for link in (hinge.parent, hinge.child) if link not in self.links), None)
            if missing is None:
                yield hinge
                continue
            message = f"joint {shown(hinge.name)}: no link {shown(missing)}{alternatives(missing, self.links, 'links')}"
            self.options.report(self.xml.error(hinge.element, message))


LIMITED = ("revolute", "prismatic")
_XACRO = f"xacro, not yet URDF; {FORMATS['xacro'].instead}"


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
    """Return the quaternion that `frametool.formats.robots.urdf` makes of the angles."""
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
