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

from functools import partial
from typing import TYPE_CHECKING, Any

from frametool.documents.xml import Element, read_xml
from frametool.errors import FormatError, ValueInvalid, alternatives, bare, first_of, listing, shown
from frametool.formats.detect import UNSUPPORTED
from frametool.formats.load import FrameFile, load_sources
from frametool.formats.robots.joints import JointState
from frametool.formats.robots.model import Joint, Link, Mimic, Robot, Solid, read_quaternion, solids_of
from frametool.formats.table import FORMATS
from frametool.geometry import euler, floats
from frametool.geometry.quaternion import unit_vector
from frametool.geometry.representations import notation
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Diagnostics, Edge, Options, Topics
from frametool.grammar.pose import TURN, Pose, agreeing_rotation
from frametool.grammar.result import Style, angles_of, of_angles, refuse_motion, rotation_numbers

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from os import PathLike

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames
    from frametool.geometry import Rigid

KINDS = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
_XACRO = f"xacro, not yet URDF; {UNSUPPORTED['xacro'].remedy}"


def read(file: InputFile, options: Options, found: list[Any] | None = None) -> Iterator[Edge]:
    """Yield the edges of a robot, with joint values from options, default 0.

    found: receives the result of `describe`
    """
    frames, links, posture = described = describe(file, options)
    if found is not None:
        found += described
    for frame in _roots(frames, links):
        yield Edge(None, frame, IDENTITY, line=frames[frame])
    yield from posture.edges(links)


def _roots(frames: Iterable[str], links: Iterable[Link]) -> list[str]:
    """Return the frames without a parent."""
    children = {link.child for link in links}
    return [frame for frame in frames if frame not in children]


def describe(file: InputFile, options: Options) -> tuple[dict[str, int], list[Link], JointState]:
    """Return the frames of a robot with their lines, one Link per joint, and the joint values.

    Raises FormatError if it is not URDF; errors in one joint go to `options.report`.
    """
    root = read_xml(file, "robot", "URDF")
    for element in (root, *root.children, *(inner for outer in root.children for inner in outer.children)):
        for name, value in {"": f"<{element.tag}>", **element.attributes}.items():
            if "${" in value or "$(" in value or value.startswith("<xacro:"):
                raise element.error(f"{shown(value)} is {_XACRO}", name)
    frames: dict[str, int] = {}
    joints: dict[str, tuple[Link, Element]] = {}
    for element in root.all("link", "joint"):
        try:
            if element.tag == "joint":
                joints[element.attributes["name"]] = _link(element, joints, options), element
                continue
            for inner in element.all("link", "joint"):
                raise inner.error(f"<{inner.tag}> inside a <link>; links and joints are siblings in <robot>")
            name = options.tally.names.bare(element.required("name"))
            if name in frames:
                raise element.error(f"link {shown(name)} twice; first in line {frames[name]}", "name")
            frames[name] = element.line
        except FormatError as error:
            options.report(error)
    links: list[Link] = []
    for name, (link, element) in joints.items():
        if missing := [end for end in (link.parent, link.child) if end and end not in frames]:
            known = alternatives(missing[0], frames, "links")
            options.report(element.error(f"joint {shown(name)}: no link {shown(missing[0])}{known}"))
        else:
            links.append(link)
    posture = JointState.of(links, options, file.name)
    if not frames:
        raise file.error("no links in it")
    if len(roots := _roots(frames, links)) > 1:
        named = first_of(roots, 5, quote=bare)
        message = f"{len(roots)} roots, where a robot has one: {named}; they are not connected"
        options.tally.note(message, frames[roots[1]], "several-roots")
    return frames, links, posture


def _link(element: Element, joints: Mapping[str, tuple[Link, Element]], options: Options) -> Link:
    """Read one joint, with its axis, limits and mimic; raises FormatError."""
    parts: dict[str, Element] = {}
    for part in element.all("origin", "parent", "child", "axis", "limit", "mimic"):
        if parts.setdefault(part.tag, part) is not part:
            options.report(part.error(f"<{part.tag}> twice in one joint"))
    name, kind = element.required("name"), element.required("type")
    if name in joints:
        raise element.error(f"joint {shown(name)} twice; first in line {joints[name][1].line}", "name")
    if kind not in KINDS:
        message = f"joint {shown(name)} has the type {shown(kind)}{alternatives(kind, KINDS, 'types')}"
        raise element.error(message, "type")
    if "parent" not in parts or "child" not in parts:
        raise element.error(f"joint {shown(name)} has no <{'child' if 'parent' in parts else 'parent'}>")
    parent, child = (options.tally.names.bare(parts[end].required("link")) for end in ("parent", "child"))
    origin = _origin(parts["origin"], options) if "origin" in parts else IDENTITY
    if kind == "fixed":
        return Link(parent, child, origin, line=element.line, fixed=name)
    axis, lower, upper, mimic = (1.0, 0.0, 0.0), None, None, None
    if "axis" in parts and kind != "floating":
        x, y, z = parts["axis"].numbers(3, "xyz", "1 0 0")
        if not (x or y or z):
            raise parts["axis"].error(f"joint {shown(name)} has the axis 0 0 0, which is not a direction", "xyz")
        axis = (x, y, z) if x * x + y * y + z * z == 1.0 else unit_vector(x, y, z, floats)
    limit = parts.get("limit") if kind in ("revolute", "prismatic") else None
    if limit and ("lower" in limit.attributes or "upper" in limit.attributes):
        (lower,), (upper,) = limit.numbers(1, "lower", "0"), limit.numbers(1, "upper", "0")
        if lower > upper:
            message = f"joint {shown(name)} has the limits {lower:g} .. {upper:g}, which nothing fits"
            options.tally.note(message, limit.line, "limit")
    if follows := parts.get("mimic"):
        leader = follows.required("joint")
        if kind in ("planar", "floating"):
            raise follows.error(f"joint {shown(name)} is {kind}: it follows no other")
        mimic = Mimic(leader, *follows.numbers(1, "multiplier", "1"), *follows.numbers(1, "offset", "0"))
    joint = Joint(name, kind, axis, lower, upper, mimic, line=element.line)
    return Link(parent, child, origin, (joint,), element.line)


def _origin(element: Element, options: Options) -> Rigid:
    """Read the pose of a joint in its parent: rpy, or a quaternion."""
    x, y, z = element.numbers(3, "xyz", "0 0 0")
    roll, pitch, yaw = element.numbers(3, "rpy", "0 0 0")
    rotation = IDENTITY[3:]
    if beyond := next((each for each in (roll, pitch, yaw) if abs(each) > TURN), None):
        options.tally.note(f"rpy {beyond:g} is more than a full turn in radians; degrees?", element.line, "degrees")
    if roll or pitch or yaw:
        rotation = euler.to_quaternion(roll, pitch, yaw, "sxyz", floats)
    if "quat_xyzw" not in element.attributes:
        return x, y, z, *rotation
    element.numbers(4, "quat_xyzw")
    texts = element.attributes["quat_xyzw"].split()
    exact = read_quaternion(element, texts, options, "quat_xyzw")  # more digits than angles
    if "rpy" in element.attributes:
        try:
            agreeing_rotation(exact, rotation)
        except ValueInvalid as error:
            raise element.error(str(error), "quat_xyzw", rule=error.rule) from None
    return x, y, z, *exact


def read_solids(file: InputFile) -> Iterator[Solid]:
    """Yield the solids of the links."""
    options = Options(Diagnostics(), Topics())

    def pose(node: Element) -> Rigid:
        origin = node.first("origin")
        return IDENTITY if origin is None else _origin(origin, options)

    for link in read_xml(file, "robot").all("link"):
        yield from solids_of(link.attribute("name").lstrip("/"), link, pose)


def load_robot(path: str | PathLike[str]) -> Robot:
    """Read the robot of a URDF file, `-` for standard input.

    Raises FormatError and BadTopology with file, line and column; FileProblem.
    """
    return robot_of(FrameFile(path))[0]


def robot_of(file: FrameFile) -> tuple[Robot, JointState]:
    """Return the robot of a file, and the joint values from the file's options; raises as `load_robot` does."""
    if file.format != "urdf":
        file.close()
        raise file.error(f"expected a URDF robot, found {FORMATS[file.format].summary}")
    found: list[Any] = []
    file.reader = partial(read, found=found)
    load_sources([file])
    frames, links, posture = found
    return Robot(file.name, {link.child: link for link in links}, frames), posture


_ESCAPES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}


def write_tree(tree: Frames, style: Style) -> str:
    """Return the tree as a URDF robot.

    Raises ValueInvalid for what URDF cannot hold: moving frames, several roots, names with characters not allowed in
    XML.
    """
    refuse_motion(tree, "URDF")
    if len(tree.roots) > 1:
        message = "URDF holds one tree, and this has the roots"
        raise ValueInvalid(f"{message} {listing(tree.roots)}; --with FILE adds what connects them")
    text = '<?xml version="1.0"?>\n<robot name="robot">\n'
    text += "".join(f'  <link name="{_attribute(frame)}"/>\n' for frame in tree.frames)
    for parent, child, transform in tree.edges():
        position, rotation = transform.components[:3], transform.components[3:]
        angles = angles_of(rotation)
        origin = f'xyz="{_numbers(position, style)}" rpy="{_numbers(angles, style)}"'
        exact = tuple(rotation_numbers(Pose.of(transform.components), notation("xyzw"), style))
        if of_angles(angles) != exact and style.precision is None:
            origin += f' quat_xyzw="{_numbers(exact, style)}"'
        text += (
            f'  <joint name="{_attribute(child)}_joint" type="fixed">\n    <origin {origin}/>\n'
            f'    <parent link="{_attribute(parent)}"/>\n    <child link="{_attribute(child)}"/>\n  </joint>\n'
        )
    return f"{text}</robot>\n"


def _numbers(values: Sequence[float], style: Style) -> str:
    return " ".join(map(style.number, values))


def _attribute(name: str) -> str:
    """Write a name as the value of an attribute."""
    if "${" in name or "$(" in name:
        raise ValueInvalid(f"frame {shown(name)} cannot be written in URDF: it reads as xacro")
    if any((ord(letter) < 32 and letter not in _ESCAPES) or letter in "\ufffe\uffff" for letter in name):
        raise ValueInvalid(f"frame {shown(name)} cannot be written in URDF: XML has no such characters")
    return "".join(_ESCAPES.get(letter, letter) for letter in name)
