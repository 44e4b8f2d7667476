"""MJCF, the models of MuJoCo, read; their joints take values.

    <body name="arm" pos="0 0 1" quat="1 -1 0 0"><joint name="elbow" axis="0 1 0" pos="0 0 .1" ref="30"/> ..

parent_from_child = pose * the motions of the body's joints, in order: hinges turn about `axis` through `pos`, by their
value less `ref`; so a joint that nobody tells of stands at `ref`, where the file shows the body. Bodies hang on the
body around them, the outermost on `world`; sites and cameras are `site:NAME`, `camera:NAME` (looking along -z).
Metres; degrees unless the compiler says radian; quaternions w first, of any length; eulerseq with moving axes in lower
and fixed ones in upper case. Values of a key: --joints FILE.xml:KEY. <include>, <replicate>, <attach> are refused.
Source: MuJoCo 3 and 4, XML reference and engine_core_smooth.c (mj_kinematics).

The bodies, sites, cameras and joints of an MJCF model, in the order in which MuJoCo counts them.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.source import Source
from frametool.documents.xml import XmlFile, read_nodes
from frametool.errors import FormatError, alternatives, shown
from frametool.formats.robots.model import Joint, JointValue
from frametool.formats.robots.mjcf_attributes import Classes, PoseReader, own_attributes
from frametool.formats.robots.posture import Posture, Setting
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.trig import DEGREE
from frametool.grammar.edges import Edge, Options, Tally, Topics

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from frametool.documents.source import InputFile
    from frametool.documents.xml import XmlNode
    from frametool.formats.robots.mjcf_attributes import Attributes
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Vector

IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
WORLD = "world"
WHOLE = "save it whole: mujoco.mj_saveLastXML('whole.xml', mujoco.MjModel.from_xml_path('FILE'))"
REFUSED = ("include", "replicate", "attach")
MADE = ("composite", "flexcomp")
JOINTS = ("joint", "freejoint")
INSIDE = ("body", "frame", *JOINTS, "site", "camera", *REFUSED, *MADE)
HELD = {
    "mujoco": ("compiler", "default", "worldbody", "keyframe", "include"),
    "default": ("default", "joint", "site", "camera", "include"),
    "worldbody": INSIDE,
    "body": INSIDE,
    "frame": INSIDE,
    "keyframe": ("key", "include"),
}
TYPES = {"hinge": "revolute", "slide": "prismatic", "ball": "ball", "free": "floating"}


class Anchored(NamedTuple):
    """A joint of a body, and the point of the body that it turns about."""

    joint: Joint
    anchor: Vector
    node: XmlNode


class Placed(NamedTuple):
    """A body, site or camera: its pose in its parent where every joint is at its reference, and its joints in order."""

    parent: str
    name: str
    pose: Rigid
    joints: list[Anchored]
    node: XmlNode


class _Inside(NamedTuple):
    """What surrounds an element: its body, the default class, and the frames in the body that it stands in."""

    body: Placed
    around: str
    frame: Rigid


class MjcfModel:
    """The frames of a model, bodies before what they hold."""

    def __init__(self, root: XmlNode, xml: XmlFile, options: Options) -> None:
        """Read a model; raises FormatError."""
        self.xml = xml
        self.options = options
        self._refuse(root)
        self.poses = PoseReader(root, xml)
        for section in root.all("default"):
            self._refuse(section)
        self.classes = Classes(root, xml)
        self.placed: dict[str, Placed] = {}
        self.joint_names: dict[str, XmlNode] = {}
        self._counts: dict[tuple[str, str], int] = {}
        self.world = Placed("", WORLD, IDENTITY, [], root)
        for section in root.all("worldbody"):
            self._walk(section)

    @property
    def joints(self) -> list[Anchored]:
        """Return all joints in the order of qpos: body by body, those of a body before those of the bodies in it."""
        return [joint for placed in self.placed.values() for joint in placed.joints]

    def _refuse(self, node: XmlNode) -> None:
        """Refuse what MuJoCo would have to expand first."""
        for child in node.all(*REFUSED):
            message = f"<{child.tag}> is not expanded here; {WHOLE}"
            raise self.xml.error(child.element, message)

    def _walk(self, section: XmlNode) -> None:
        """Read what stands in a world in the order of the file; a stack, for bodies may be deep."""
        self._refuse(section)
        pending = [(child, _Inside(self.world, "", IDENTITY)) for child in reversed(section.children)]
        while pending:
            node, around = pending.pop()
            if (inside := self._take(node, around)) is not None:
                self._refuse(node)
                pending += [(child, inside) for child in reversed(node.children)]

    def _take(self, node: XmlNode, inside: _Inside) -> _Inside | None:
        """Read one element; of a body or frame return what surrounds that which it holds."""
        if node.tag in MADE:
            message = f"<{node.tag}> is left out: its bodies are made by MuJoCo; {WHOLE}"
            self.options.tally.note_each(message, node.element.line)
        elif node.tag == "frame":
            pose = rigid.compose(*inside.frame, *self.poses.pose(own_attributes(node.element)))
            return inside._replace(around=self._class(node, inside.around), frame=pose)
        elif node.tag == "body":
            body = self._place(node, inside, self.poses.pose(own_attributes(node.element)))
            return _Inside(body, self._class(node, inside.around), IDENTITY)
        elif node.tag in JOINTS:
            self._join(node, inside)
        else:
            self._mark(node, inside)
        return None

    def _class(self, node: XmlNode, around: str) -> str:
        """Return the class that a body or frame gives to what stands in it."""
        name = node.attribute("childclass")
        if name:
            self.classes.check(name, node.element, "childclass")
        return name or around

    def _mark(self, node: XmlNode, inside: _Inside) -> None:
        """Read a site or camera."""
        attributes = self.classes.attributes(node.element, inside.around)
        pose = self.poses.pose_of_site(attributes) if node.tag == "site" else self.poses.pose(attributes)
        placed = self._place(node, inside, pose)
        if "mode" in attributes and (mode := attributes["mode"].text.strip()) != "fixed":
            message = f"{placed.name} has the mode {shown(mode)}, in which MuJoCo turns it over time"
            self.options.tally.note_each(f"{message}; it stands as written", node.element.line)

    def _place(self, node: XmlNode, inside: _Inside, pose: Rigid) -> Placed:
        """Register a body, site or camera; sites and cameras have names of their own, and show it."""
        name = self._name(node, inside.body.name)
        name = name if node.tag == "body" else f"{node.tag}:{name}"
        known = self.placed.get(name)
        if known is not None or name == WORLD:
            first = f"; first in line {known.node.element.line}" if known else ", which is the name of the root"
            raise self.xml.error(node.element, f"{node.tag} {shown(name)} twice{first}", "name")
        pose = pose if inside.frame == IDENTITY else rigid.compose(*inside.frame, *pose)
        self.placed[name] = Placed(inside.body.name, name, pose, [], node)
        return self.placed[name]

    def _name(self, node: XmlNode, body: str) -> str:
        """Return the name of an element; one without is counted in its body."""
        if name := node.attribute("name"):
            return name
        count = self._counts[body, node.tag] = self._counts.get((body, node.tag), 0) + 1
        return f"{body}/{node.tag}{count}"

    def _join(self, node: XmlNode, inside: _Inside) -> None:
        """Read a joint of a body."""
        body = inside.body
        if body is self.world:
            raise self.xml.error(node.element, "the world has no joints; put it into a <body>")
        free = node.tag == "freejoint"
        attributes = own_attributes(node.element) if free else self.classes.attributes(node.element, inside.around)
        kind = "free" if free else self.poses.word(attributes, "type", "hinge", tuple(TYPES))
        if kind == "free" and (node.attribute("align") or str(self.poses.aligns_free).lower()) == "true":
            message = "alignfree: MuJoCo moves this body's frame onto its inertia, which is not computed here"
            raise self.xml.error(node.element, f'{message}; write align="false", or {WHOLE}')
        name = node.attribute("name") or f"{body.name}/joint{len(body.joints) + 1}"
        if known := self.joint_names.get(name):
            raise self.xml.error(node.element, f"joint {shown(name)} twice; first in line {known.element.line}", "name")
        if kind == "free" and body.parent != WORLD:
            message = f"joint {shown(name)} is free: it belongs into a body directly in the world"
            raise self.xml.error(node.element, message)
        if body.joints and "floating" in (body.joints[0].joint.kind, TYPES[kind]):
            message = f"joint {shown(name)} beside others in body {shown(body.name)}, one of them free; keep that"
            raise self.xml.error(node.element, message)
        self.joint_names[name] = node
        body.joints.append(self._anchored(node, name, kind, attributes, inside.frame))

    def _anchored(self, node: XmlNode, name: str, kind: str, attributes: Attributes, frame: Rigid) -> Anchored:
        """Read the axis, anchor, limits and reference of a joint; frames around it move axis and anchor."""
        if kind == "free":
            return Anchored(Joint(name, "floating", line=node.element.line), (0.0, 0.0, 0.0), node)
        px, py, pz = self.poses.numbers(attributes, "pos", 3, (0.0, 0.0, 0.0))
        anchor = rigid.apply(*frame, px, py, pz)
        if kind == "ball":
            return Anchored(Joint(name, "ball", line=node.element.line), anchor, node)
        axis = quaternion.rotate(*frame[3:], *self.poses.direction(attributes, "axis", (0.0, 0.0, 1.0)))
        degrees = kind == "hinge" and self.poses.degrees
        (rest,) = (value * DEGREE if degrees else value for value in self.poses.numbers(attributes, "ref", 1, (0.0,)))
        lower, upper = self._limits(attributes, degrees=degrees)
        return Anchored(Joint(name, TYPES[kind], axis, lower, upper, rest=rest, line=node.element.line), anchor, node)

    def _limits(self, attributes: Attributes, *, degrees: bool) -> tuple[float | None, float | None]:
        """Read the range of a joint, where it is limited: by default where it has one."""
        limited = self.poses.word(attributes, "limited", "auto", ("auto", "true", "false"))
        applies = limited == "true" or (limited == "auto" and self.poses.limits_apply)
        if "range" not in attributes or not applies:
            return None, None
        lower, upper = self.poses.numbers(attributes, "range", 2, ())
        return (lower * DEGREE, upper * DEGREE) if degrees else (lower, upper)


SIZES = {"floating": 7, "ball": 4}  # numbers of a joint in qpos; the others have one


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a model, its joints as told, else at their references."""
    xml = XmlFile(file)
    model = MjcfModel(read_nodes(xml, HELD), xml, options)
    joints = [each.joint for each in model.joints]
    posture = Posture(joints, options, lambda joint, problem: xml.error(model.joint_names[joint.name].element, problem))
    for placed in model.placed.values():
        line = placed.node.element.line
        if not placed.joints:
            yield Edge(placed.parent, placed.name, placed.pose, line=line)
            continue
        for stamp_ns, moved in posture.motions(*(each.joint.name for each in placed.joints)):
            yield Edge(placed.parent, placed.name, _moved(placed, moved, posture), stamp_ns, line)


def _moved(placed: Placed, moved: Sequence[Rigid], posture: Posture) -> Rigid:
    """Return the pose of a body whose joints have moved; the value of a free one is the pose itself, in the world."""
    pose = placed.pose
    for (joint, anchor, _), motion in zip(placed.joints, moved, strict=True):
        if joint.kind == "floating":
            pose = motion if joint.name in posture.told else pose
        elif motion != IDENTITY:
            pose = rigid.compose(*pose, *_about(anchor, motion))
    return pose


def _about(anchor: tuple[float, float, float], motion: Rigid) -> Rigid:
    """Return a motion about a point: what turns leaves the point where it is."""
    tx, ty, tz, qx, qy, qz, qw = motion
    px, py, pz = anchor
    mx, my, mz = quaternion.rotate(qx, qy, qz, qw, px, py, pz)
    return tx + px - mx, ty + py - my, tz + pz - mz, qx, qy, qz, qw


def read_joints(file: InputFile, state: str) -> Iterator[Setting]:
    """Yield what a key of the model says of its joints: `state` is its name, or its number from 0.

    Raises FormatError.
    """
    try:
        xml = XmlFile(file)
    finally:
        file.close()
    root = read_nodes(xml, HELD)
    joints = MjcfModel(root, xml, Options(Tally(), Topics())).joints
    key = _key(root, xml, state)
    if not key.attribute("qpos"):
        raise xml.error(key.element, f"key {shown(state)} has no qpos")
    count = sum(_size(each.joint) for each in joints)
    numbers = iter(xml.numbers(key.element, "qpos", count))
    refuse = partial(_refused, xml, key)
    for anchored in joints:
        mine = [next(numbers) for _ in range(_size(anchored.joint))]
        yield Setting(anchored.joint.name, _value(anchored, mine, refuse), None, refuse, Source(xml.name, ""))


def _size(joint: Joint) -> int:
    return SIZES.get(joint.kind, 1)


def _key(root: XmlNode, xml: XmlFile, state: str) -> XmlNode:
    """Return the key of a name or number."""
    keys = [key for frames in root.all("keyframe") for key in frames.all("key")]
    names = {key.attribute("name") or str(index): key for index, key in enumerate(keys)}
    numbered = {str(index): key for index, key in enumerate(keys)}
    if not keys:
        raise FormatError("no <key> in it, which would say where joints stand", source=xml.name)
    if not state:
        message = f"name one of its keys: {xml.name}:{next(iter(names))}"
        raise FormatError(f"{message}{alternatives('', names, 'keys')}", source=xml.name)
    if state not in names | numbered:
        raise FormatError(f"no key {shown(state)}{alternatives(state, names, 'keys')}", source=xml.name)
    return names.get(state) or numbered[state]


def _value(anchored: Anchored, numbers: list[float], refuse: Any) -> Any:
    """Return the value of a joint as files have it: a number, or the mapping that is a pose; quaternions w first."""
    if anchored.joint.kind not in SIZES:
        return JointValue(numbers[0])
    w, x, y, z = numbers[-4:]
    if w == x == y == z == 0.0:
        raise refuse(f"qpos of joint {shown(anchored.joint.name)}: 0 0 0 0 has no direction", ())
    turned = quaternion.normalized(x, y, z, w, floats)
    pose: dict[str, Any] = {"xyzw": [repr(part) for part in turned]}
    return pose | {"xyz": [repr(part) for part in numbers[:3]]} if anchored.joint.kind == "floating" else pose


def _refused(xml: XmlFile, key: XmlNode, problem: str, _path: Path) -> FormatError:
    return xml.error(key.element, problem, "qpos")
