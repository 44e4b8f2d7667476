"""Read and write URDF, the robot description of ROS; its joints take values.

    <joint name="elbow" type="revolute"><origin xyz="0 0 1" rpy="0 0 0"/><parent link="arm"/><child link="tip"/>
      <axis xyz="0 1 0"/><limit lower="-2" upper="2"/><mimic joint="shoulder" multiplier="-1"/></joint>

Metres and radians; rpy about fixed axes x, y, z, or quat_xyzw (URDF 1.1), or both if they agree.  Links are the
frames.  parent_from_child = origin * motion, the motion in the frame after the origin, along or about the axis.
xacro is refused, not expanded.

In output, each edge is a fixed joint with the name of its child.  If no three angles give the exact rotation,
quat_xyzw is added, which URDF 1.0 tools ignore.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.source import UTF16, InputFile, paused_collector
from frametool.documents.xml import Element, XmlFile, XmlNode, read_nodes
from frametool.errors import BadTopology, FormatError, ValueInvalid, alternatives, bare, first_of, listing, shown
from frametool.formats.load import FrameFile, refuse_unknown_joints
from frametool.formats.robots.joints import JointState
from frametool.formats.robots.model import Joint, Link, Mimic, Robot, read_quaternion
from frametool.formats.table import FORMATS
from frametool.formats.unsupported import UNSUPPORTED
from frametool.frames.topology import two_parents
from frametool.geometry import euler, floats
from frametool.geometry.quaternion import unit_vector
from frametool.geometry.representations import notation
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pose import Pose
from frametool.grammar.result import Style, rotation_numbers
from frametool.grammar.rotation_spelling import TURN, agreeing_rotation

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from os import PathLike

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Vector

KINDS = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
LIMITED = ("revolute", "prismatic")
HELD = {
    "robot": ("link", "joint"),
    "link": ("link", "joint"),
    "joint": ("origin", "parent", "child", "axis", "limit", "mimic"),
}
_XACRO = f"xacro, not yet URDF; {UNSUPPORTED['xacro'].remedy}"


class RobotDescription(NamedTuple):
    """The frames of a robot with their lines, and the links of those with a joint, in the order of the file."""

    frames: dict[str, int]
    links: list[Link]
    posture: JointState

    @property
    def roots(self) -> list[str]:
        """Return the frames without a parent."""
        children = {link.child for link in self.links}
        return [frame for frame in self.frames if frame not in children]


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a robot, with joint values from options, default 0."""
    robot = describe(file, options)
    for frame in robot.roots:
        yield Edge(None, frame, IDENTITY, line=robot.frames[frame])
    yield from robot.posture.edges(robot.links)


def describe(file: InputFile, options: Options) -> RobotDescription:
    """Read the links and joints of a robot, and its joint values.

    Raises FormatError if it is not URDF; errors in one joint go to `options.report`.
    """
    xml = XmlFile(file)
    # few files have xacro, whose expressions would have to be searched for in every attribute
    if b"$" in xml.data or b"xacro" in xml.data or xml.data.startswith(UTF16):
        for element in xml.elements(deepest=3, ends=False):
            _refuse_xacro(xml, element)
    reader = _Reader(xml, options)
    for node in read_nodes(xml, HELD, "URDF", texts=False).children:
        try:
            reader.take(node)
        except FormatError as error:
            options.report(error)
    links = list(reader.connected())
    robot = RobotDescription(reader.frames, links, JointState.of(links, options, file.name))
    if not robot.frames:
        raise FormatError("no links in it", source=file.name)
    if len(roots := robot.roots) > 1:
        named = first_of(roots, 5, quote=bare)
        message = f"{len(roots)} roots, where a robot has one: {named}; they are not connected"
        options.tally.note(message, robot.frames[roots[1]], "several-roots")
    return robot


def _refuse_xacro(xml: XmlFile, element: Element) -> None:
    """Refuse elements and expressions that xacro would have to expand first."""
    if element.tag.startswith("xacro:"):
        raise xml.error(element, f"<{bare(element.tag)}> is {_XACRO}")
    for name, value in element.attributes.items():
        if "${" in value or "$(" in value:
            raise xml.error(element, f"{shown(value)} is {_XACRO}", name)


class _Reader:
    """Read links and joints one by one."""

    def __init__(self, xml: XmlFile, options: Options) -> None:
        self.xml, self.options = xml, options
        self.frames: dict[str, int] = {}
        self.joints: dict[str, tuple[Link, Element]] = {}

    def take(self, node: XmlNode) -> None:
        """Read one link or joint; raises FormatError."""
        if node.tag == "link":
            self._frame(node)
            return
        parts: dict[str, Element] = {}
        for part in node.children:
            if parts.setdefault(part.tag, part.element) is not part.element:
                self.options.report(self.xml.error(part.element, f"<{part.tag}> twice in one joint"))
        self._link(node.element, parts)

    def _frame(self, node: XmlNode) -> None:
        for inner in node.children:
            message = f"<{inner.tag}> inside a <link>; links and joints are siblings in <robot>"
            raise self.xml.error(inner.element, message)
        name = self._bare(node.element, "name")
        if name in self.frames:
            raise self.xml.error(node.element, f"link {shown(name)} twice; first in line {self.frames[name]}", "name")
        self.frames[name] = node.element.line

    def _bare(self, element: Element, attribute: str) -> str:
        """Return the name of a frame without its leading slash."""
        return self.options.tally.names.bare(self.xml.required(element, attribute))

    def _link(self, element: Element, parts: dict[str, Element]) -> None:
        """Read one joint from its child elements."""
        name, kind = self.xml.required(element, "name"), self.xml.required(element, "type")
        if name in self.joints:
            line = self.joints[name][1].line
            raise self.xml.error(element, f"joint {shown(name)} twice; first in line {line}", "name")
        if kind not in KINDS:
            message = f"joint {shown(name)} has the type {shown(kind)}{alternatives(kind, KINDS, 'types')}"
            raise self.xml.error(element, message, "type")
        if "parent" not in parts or "child" not in parts:
            missing = "child" if "parent" in parts else "parent"
            raise self.xml.error(element, f"joint {shown(name)} has no <{missing}>")
        parent, child = self._bare(parts["parent"], "link"), self._bare(parts["child"], "link")
        origin = self._origin(parts["origin"]) if "origin" in parts else IDENTITY
        joints = () if kind == "fixed" else (self._joint(name, kind, element, parts),)
        link = Link(parent, child, origin, joints, element.line, fixed="" if joints else name)
        self.joints[name] = link, element

    def _origin(self, element: Element) -> Rigid:
        """Read the pose of a joint in its parent: rpy, or a quaternion."""
        numbers = self.xml.numbers
        x, y, z = numbers(element, "xyz", 3, "0 0 0")
        roll, pitch, yaw = numbers(element, "rpy", 3, "0 0 0")
        rotation = IDENTITY[3:]
        if beyond := next((each for each in (roll, pitch, yaw) if abs(each) > TURN), None):
            message = f"rpy {beyond:g} is more than a full turn in radians; degrees?"
            self.options.tally.note(message, element.line, "degrees")
        if roll or pitch or yaw:
            rotation = euler.to_quaternion(roll, pitch, yaw, "sxyz", floats)
        if "quat_xyzw" not in element.attributes:
            return x, y, z, *rotation
        numbers(element, "quat_xyzw", 4)
        texts = element.attributes["quat_xyzw"].split()
        exact = read_quaternion(self.xml, element, texts, self.options, "quat_xyzw")  # more digits than angles
        if "rpy" in element.attributes:
            try:
                agreeing_rotation(exact, rotation)
            except ValueInvalid as error:
                raise self.xml.error(element, str(error), "quat_xyzw", rule=error.rule) from None
        return x, y, z, *exact

    def _joint(self, name: str, kind: str, element: Element, parts: dict[str, Element]) -> Joint:
        """Read axis, limits, and the joint to mimic."""
        axis = self._axis(name, parts["axis"]) if "axis" in parts and kind in WITH_AXIS else (1.0, 0.0, 0.0)
        lower, upper = self._limits(name, parts["limit"]) if "limit" in parts and kind in LIMITED else (None, None)
        mimic = self._mimic(name, kind, parts["mimic"]) if "mimic" in parts else None
        return Joint(name, kind, axis, lower, upper, mimic, line=element.line)

    def _axis(self, name: str, element: Element) -> Vector:
        x, y, z = self.xml.numbers(element, "xyz", 3, "1 0 0")
        if not (x or y or z):
            raise self.xml.error(element, f"joint {shown(name)} has the axis 0 0 0, which is not a direction", "xyz")
        return (x, y, z) if x * x + y * y + z * z == 1.0 else unit_vector(x, y, z, floats)

    def _limits(self, name: str, element: Element) -> tuple[float | None, float | None]:
        """Read lower and upper; a missing one is 0, and no limits are None."""
        if not ("lower" in element.attributes or "upper" in element.attributes):
            return None, None
        (lower,), (upper,) = self.xml.numbers(element, "lower", 1, "0"), self.xml.numbers(element, "upper", 1, "0")
        if lower > upper:
            message = f"joint {shown(name)} has the limits {lower:g} .. {upper:g}, which nothing fits"
            self.options.tally.note(message, element.line, "limit")
        return lower, upper

    def _mimic(self, name: str, kind: str, element: Element) -> Mimic:
        leader = self.xml.required(element, "joint")
        if kind in ("planar", "floating"):
            raise self.xml.error(element, f"joint {shown(name)} is {kind}: it follows no other")
        (multiplier,) = self.xml.numbers(element, "multiplier", 1, "1")
        (offset,) = self.xml.numbers(element, "offset", 1, "0")
        return Mimic(leader, multiplier, offset)

    def connected(self) -> Iterator[Link]:
        """Yield the links whose ends exist."""
        for name, (link, element) in self.joints.items():
            missing = next((end for end in (link.parent, link.child) if end and end not in self.frames), None)
            if missing is None:
                yield link
                continue
            message = f"joint {shown(name)}: no link {shown(missing)}{alternatives(missing, self.frames, 'links')}"
            self.options.report(self.xml.error(element, message))


def load_robot(path: str | PathLike[str]) -> Robot:
    """Read the robot of a URDF file, `-` for standard input.

    Raises FormatError and BadTopology with file, line and column; FileProblem.
    """
    return robot_of(FrameFile(path))[0]


def robot_of(file: FrameFile) -> tuple[Robot, JointState]:
    """Return the robot of a file, and its joint values from the file's answers; otherwise as `load_robot`."""
    if file.format != "urdf":
        file.close()
        raise FormatError(f"expected a URDF robot, found {FORMATS[file.format].summary}", source=file.name)
    options = Options(file.tally, file.topics, answers=file.answers)
    try:
        with paused_collector():
            described = describe(file, options)
    finally:
        file.close()
    refuse_unknown_joints([file])
    links: dict[str, Link] = {}
    for link in described.links:
        if link.child in links:
            error = two_parents(link.child, str(links[link.child].parent), str(link.parent))
            raise BadTopology(error.message, source=file.name, line=link.line, rule=error.rule)
        links[link.child] = link
    file.tell()
    return Robot(file.name, links, described.frames), described.posture


_ESCAPES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}


def write_tree(tree: Frames, style: Style) -> str:
    """Return the robot.

    Raises ValueInvalid for what URDF cannot hold: moving frames, several roots, names with characters not allowed in
    XML.
    """
    if moving := [track.child for track in tree.tracks() if not track.is_static]:
        raise ValueInvalid(f"URDF holds no motion, but these frames move: {listing(moving)}; give --at TIME")
    if len(tree.roots) > 1:
        message = "URDF holds one tree, and this has the roots"
        raise ValueInvalid(f"{message} {listing(tree.roots)}; --with FILE adds what connects them")
    links = "".join(f'  <link name="{_attribute(frame)}"/>\n' for frame in tree.frames)
    joints = "".join(_joint(parent, child, transform.components, style) for parent, child, transform in tree.edges())
    return f'<?xml version="1.0"?>\n<robot name="robot">\n{links}{joints}</robot>\n'


def _joint(parent: str, child: str, components: Rigid, style: Style) -> str:
    """Write one edge."""
    from frametool.formats.trees.written_poses import angles_of, of_angles

    angles = angles_of(components[3:])
    origin = f'xyz="{_numbers(components[:3], style)}" rpy="{_numbers(angles, style)}"'
    exact = tuple(rotation_numbers(Pose.of(components), notation("xyzw"), style))
    if of_angles(angles) != exact and style.precision is None:
        origin += f' quat_xyzw="{_numbers(exact, style)}"'
    return (
        f'  <joint name="{_attribute(child)}_joint" type="fixed">\n    <origin {origin}/>\n'
        f'    <parent link="{_attribute(parent)}"/>\n    <child link="{_attribute(child)}"/>\n  </joint>\n'
    )


def _numbers(values: Sequence[float], style: Style) -> str:
    return " ".join(map(style.number, values))


def _attribute(name: str) -> str:
    """Write a name as the value of an attribute."""
    if "${" in name or "$(" in name:
        raise ValueInvalid(f"frame {shown(name)} cannot be written in URDF: it reads as xacro")
    if any((ord(letter) < 32 and letter not in _ESCAPES) or letter in "\ufffe\uffff" for letter in name):
        raise ValueInvalid(f"frame {shown(name)} cannot be written in URDF: XML has no such characters")
    return "".join(_ESCAPES.get(letter, letter) for letter in name)
