"""Read MJCF, MuJoCo's models; their joints take values.

    <body name="arm" pos="0 0 1" quat="1 -1 0 0"><joint name="elbow" axis="0 1 0" pos="0 0 .1" ref="30"/> ..

parent_from_child = pose * the motions of the body's joints, in order: hinges rotate about `axis` through `pos`, by
their value minus `ref`; so a joint without a value is at `ref`, where the file has the body. The parent of a body is
the enclosing one, of the outermost `world`; sites and cameras are `site:NAME`, `camera:NAME` (looking along -z).
Metres; degrees unless the compiler states radian; quaternions w first, of any length; eulerseq with moving axes in
lower and fixed ones in upper case. Values of a key: --joints FILE.xml:KEY. <include>, <replicate>, <attach> are
refused.
Source: MuJoCo 3 and 4, XML reference and engine_core_smooth.c (mj_kinematics).

An element has at most one of the five orientations (quat, axisangle, euler, xyaxes, zaxis), and its own overrides
that of its class.
"""

from __future__ import annotations

from itertools import islice
from math import dist
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.xml import Element, read_xml
from frametool.errors import FormatError, alternatives, shown
from frametool.formats.robots.joints import JointSample, JointState
from frametool.formats.robots.model import SHAPES, SIZES, Joint, JointValue, Link, Solid
from frametool.geometry import floats, matrix, quaternion, rigid
from frametool.grammar.edges import Diagnostics, Edge, Options, Topics

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.geometry import Rigid
    from frametool.grammar.readers import Path, Quaternion, Vector

    Attributes = dict[str, Element]  # name -> the element, or the default, that has it

WORLD = "world"
WHOLE = "save it whole: mujoco.mj_saveLastXML('whole.xml', mujoco.MjModel.from_xml_path('FILE'))"
NESTING = ("mujoco", "default", "worldbody", "body", "frame", "keyframe")  # with elements that are read
TYPES = {"hinge": "revolute", "slide": "prismatic", "ball": "ball", "free": "floating"}
ORIENTATIONS = {  # and their defaults
    "quat": "1 0 0 0", "axisangle": "0 0 1 0", "euler": "0 0 0", "xyaxes": "1 0 0 0 1 0", "zaxis": "0 0 1",
}  # fmt: skip
MAIN = "main"
STRAIGHT = ("capsule", "cylinder", "box", "ellipsoid")  # sites that may be defined by two ends
LEAST = 1e-14  # below this length MuJoCo treats a vector as zero
SAME_LINE = 1e-10  # tolerance of MuJoCo for a zaxis along z


class _Inside(NamedTuple):
    """The context of an element: its body, the default class, and the enclosing frames in the body."""

    body: str
    around: str
    frame: Rigid


class MjcfModel:
    """The frames of a model, parents before children; its compiler's settings, and its default classes.

    classes: class -> kind of element -> attributes; nested ones inherit the enclosing ones
    """

    def __init__(self, root: Element, options: Options) -> None:
        """Read a model; raises FormatError."""
        self.options = options
        nodes = [root]
        for node in nodes:  # grows during the loop
            nodes += node.children if node.tag in NESTING else ()
            if node.tag in ("include", "replicate", "attach"):
                raise node.error(f"<{node.tag}> is not expanded here; {WHOLE}")
        attributes: dict[str, Element] = {}  # of the compiler sections, anywhere in the file: the last value is used
        for section in root.all("compiler"):
            attributes |= own_attributes(section)
        self.degrees = word(attributes, "angle", "degree", "radian") == "degree"
        self.limits_apply = word(attributes, "autolimits", "true", "false") == "true"
        self.aligns_free = word(attributes, "alignfree", "false", "true")
        self.eulerseq = attributes["eulerseq"].attributes["eulerseq"] if "eulerseq" in attributes else "xyz"
        if len(self.eulerseq) != len("xyz") or not set(self.eulerseq) <= set("xyzXYZ"):
            message = f"eulerseq {shown(self.eulerseq)}; expected three of xyz (moving axes) and XYZ (fixed axes)"
            raise attributes["eulerseq"].error(message, "eulerseq")
        if word(attributes, "coordinate", "local", "global") == "global":
            message = "coordinate=global; MuJoCo reads it no more: save the model with MuJoCo 2.3.3 first"
            raise attributes["coordinate"].error(message, "coordinate")
        self.classes: dict[str, dict[str, Attributes]] = {MAIN: {}}
        self._read_classes(root)
        self.links: dict[str, Link] = {}
        self.joints: dict[str, Joint] = {}
        self.geoms: list[tuple[Element, _Inside]] = []
        self._counts: dict[tuple[str, str], int] = {}
        for section in root.all("worldbody"):  # in the order of the file; with a stack, because bodies may be deep
            pending = [(child, _Inside(WORLD, MAIN, rigid.IDENTITY)) for child in reversed(section.children)]
            while pending:
                node, around = pending.pop()
                if (inside := self._take(node, around)) is not None:
                    pending += [(child, inside) for child in reversed(node.children)]

    def _read_classes(self, root: Element) -> None:
        """Read the sections of defaults, each from a copy of the enclosing one; raises FormatError."""
        pending = []
        for section in root.all("default"):
            name = section.attribute("class") or MAIN
            if name != MAIN:
                raise section.error(f"the outermost default class is called main, found {shown(name)}", "class")
            pending.append((section, MAIN))
        for node, name in pending:  # grows during the loop
            mine = self.classes[name]
            for child in node.children:
                if child.tag != "default":
                    mine[child.tag] = over(own_attributes(child), mine.get(child.tag, {}))
            for child in node.all("default"):
                inner = child.attribute("class")
                if not inner or inner in self.classes:
                    problem = f"default class {shown(inner)} twice" if inner else "a <default> without class"
                    raise child.error(problem, "class" if inner else "")
                self.classes[inner] = dict(mine)
                pending.append((child, inner))

    def attributes(self, node: Element, around: str) -> Attributes:
        """Return the attributes of an element; `around` is the class inherited from the enclosing bodies."""
        return over(own_attributes(node), self.classes[self._class(node, "class", around)].get(node.tag, {}))

    def _class(self, node: Element, attribute: str, around: str) -> str:
        """Return the class that an attribute names, by default the inherited one; raises FormatError if undefined."""
        name = node.attribute(attribute) or around
        if name not in self.classes:
            raise node.error(f"no default class {shown(name)}{alternatives(name, self.classes, 'classes')}", attribute)
        return name

    def _take(self, node: Element, inside: _Inside) -> _Inside | None:
        """Read one element; returns the context of its children for a body or frame, else None."""
        if node.tag in ("composite", "flexcomp"):
            self.options.tally.note_each(f"<{node.tag}> is left out: its bodies are made by MuJoCo; {WHOLE}", node.line)
        elif node.tag == "frame":
            pose = rigid.compose(*inside.frame, *self.pose(own_attributes(node)))
            return inside._replace(around=self._class(node, "childclass", inside.around), frame=pose)
        elif node.tag == "body":
            name = self._place(node, inside, self.pose(own_attributes(node)))
            return _Inside(name, self._class(node, "childclass", inside.around), rigid.IDENTITY)
        elif node.tag in ("joint", "freejoint"):
            self._join(node, inside)
        elif node.tag == "geom":
            self.geoms.append((node, inside))
        elif node.tag in ("site", "camera"):
            attributes = self.attributes(node, inside.around)
            name = self._place(node, inside, (self.pose_of_site if node.tag == "site" else self.pose)(attributes))
            if node.tag == "camera":
                self.options.tally.axes[name] = self.options.answers.camera_axes or "opengl"
            if "mode" in attributes and (mode := attributes["mode"].attribute("mode")) != "fixed":
                turns = f"{name} has the mode {shown(mode)}, in which MuJoCo rotates it over time"
                self.options.tally.note_each(f"{turns}; its pose is as written", node.line)
        return None

    def _place(self, node: Element, inside: _Inside, pose: Rigid) -> str:
        """Add a body, site or camera at its rest pose; return its name, whose prefix shows whether it is a body."""
        name = node.attribute("name")
        if not name:  # numbered in its body
            count = self._counts[inside.body, node.tag] = self._counts.get((inside.body, node.tag), 0) + 1
            name = f"{inside.body}/{node.tag}{count}"
        name = name if node.tag == "body" else f"{node.tag}:{name}"
        known = self.links.get(name)
        if known is not None or name == WORLD:
            first = f"; first in line {known.line}" if known else ", which is the name of the root"
            raise node.error(f"{node.tag} {shown(name)} twice{first}", "name")
        pose = pose if inside.frame == rigid.IDENTITY else rigid.compose(*inside.frame, *pose)
        self.links[name] = Link(inside.body, name, pose, line=node.line)
        return name

    def _join(self, node: Element, inside: _Inside) -> None:
        """Read a joint of a body; enclosing frames transform its axis and anchor."""
        if inside.body == WORLD:
            raise node.error("the world has no joints; put it into a <body>")
        link = self.links[inside.body]
        free = node.tag == "freejoint"
        attributes = own_attributes(node) if free else self.attributes(node, inside.around)
        kind = "free" if free else word(attributes, "type", *TYPES)
        if kind == "free" and (node.attribute("align") or self.aligns_free) == "true":
            message = "alignfree: MuJoCo moves this body's frame onto its inertia, which is not computed here"
            raise node.error(f'{message}; write align="false", or {WHOLE}')
        name = node.attribute("name") or f"{link.child}/joint{len(link.joints) + 1}"
        if known := self.joints.get(name):
            raise node.error(f"joint {shown(name)} twice; first in line {known.line}", "name")
        if kind == "free" and link.parent != WORLD:
            raise node.error(f"joint {shown(name)} is free: it belongs into a body directly in the world")
        if link.joints and "floating" in (link.joints[0].kind, TYPES[kind]):
            message = f"joint {shown(name)} beside others in body {shown(link.child)}, one of them free; keep that"
            raise node.error(message)
        joint = Joint(name, TYPES[kind], line=node.line)
        if kind == "free":  # its value is its pose in the world
            joint, link = joint._replace(rest_pose=link.origin), link._replace(origin=rigid.IDENTITY)
        else:
            joint = joint._replace(anchor=rigid.apply(*inside.frame, *numbers_of(attributes, "pos", "0 0 0")))
        if kind in ("hinge", "slide"):
            axis = direction(attributes, "axis", numbers_of(attributes, "axis", "0 0 1"))
            unit = floats.DEGREE if kind == "hinge" and self.degrees else 1.0
            rest = unit * numbers_of(attributes, "ref", "0")[0]
            limited = word(attributes, "limited", "auto", "true", "false")
            lower = upper = None
            if "range" in attributes and (limited == "true" or (limited == "auto" and self.limits_apply)):
                lower, upper = (unit * limit for limit in numbers_of(attributes, "range", "0 0"))
            turned = quaternion.rotate(*inside.frame[3:], *axis)
            joint = joint._replace(axis=turned, lower=lower, upper=upper, rest=rest)
        self.joints[name] = joint
        self.links[link.child] = link._replace(joints=(*link.joints, joint))

    def pose(self, attributes: Attributes) -> Rigid:
        """Read position and orientation."""
        x, y, z = numbers_of(attributes, "pos", "0 0 0")
        present = [name for name in ORIENTATIONS if name in attributes]
        if len(present) > 1:
            raise attributes[present[1]].error(f"{' and '.join(present)} in one element; keep one", present[1])
        return x, y, z, *(self._orientation(present[0], attributes) if present else rigid.IDENTITY[3:])

    def pose_of_site(self, attributes: Attributes) -> Rigid:
        """Read the pose of a site, which may be defined by two ends: its z axis points to the first end."""
        if "fromto" not in attributes:
            return self.pose(attributes)
        if "pos" in attributes:
            raise attributes["fromto"].error("pos and fromto in one site; keep one", "fromto")
        if word(attributes, "type", "sphere", *STRAIGHT) == "sphere":
            raise attributes["fromto"].error(f"type 'sphere'; expected {', '.join(STRAIGHT)}", "type")
        ax, ay, az, bx, by, bz = numbers_of(attributes, "fromto", "0 0 0 0 0 0")
        along = direction(attributes, "fromto", (ax - bx, ay - by, az - bz))
        return 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz), *_turning_z(*along)

    def _orientation(self, kind: str, attributes: Attributes) -> Quaternion:
        """Read one of the five orientations; raises FormatError."""
        numbers = numbers_of(attributes, kind, ORIENTATIONS[kind])
        match kind:
            case "quat":  # of any length but zero
                qw, qx, qy, qz = numbers
                if qw == qx == qy == qz == 0.0:
                    raise attributes[kind].error("quat: 0 0 0 0 has no direction", kind)
                is_unit = abs(qw * qw + qx * qx + qy * qy + qz * qz - 1.0) <= quaternion.UNIT
                return (qx, qy, qz, qw) if is_unit else quaternion.normalized(qx, qy, qz, qw, floats)
            case "axisangle":
                axis = direction(attributes, kind, numbers[:3])
                return quaternion.from_axis_angle(*axis, numbers[3], floats, degrees=self.degrees)
            case "euler":  # about the axes of eulerseq: a moving axis multiplies on the right, a fixed one on the left
                turned = rigid.IDENTITY[3:]
                for letter, angle in zip(self.eulerseq, numbers, strict=True):
                    half_sincos = floats.half_sincos_deg if self.degrees else floats.half_sincos
                    sine, cosine = half_sincos(angle, floats)
                    turn = *(sine if axis == letter.lower() else 0.0 for axis in "xyz"), cosine
                    turned = quaternion.compose(*((*turned, *turn) if letter.islower() else (*turn, *turned)))
                return turned
            case "xyaxes":  # x is used, and the part of y orthogonal to it
                x = direction(attributes, kind, numbers[:3])
                along = sum(a * b for a, b in zip(x, numbers[3:], strict=True))
                y = direction(attributes, kind, [b - along * a for a, b in zip(x, numbers[3:], strict=True)])
                z = quaternion.cross(*x, *y)
                return matrix.to_quaternion(x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2], floats)
        return _turning_z(*direction(attributes, kind, numbers))


def own_attributes(node: Element) -> Attributes:
    """Return the attributes of an element without empty ones."""
    return {name: node for name, text in node.attributes.items() if text.strip()}


def over(inner: Attributes, outer: Attributes) -> Attributes:
    """Return the attributes of an element merged over those of its class: one orientation replaces all others."""
    turned = not inner.keys().isdisjoint(ORIENTATIONS)
    return {name: each for name, each in outer.items() if not (turned and name in ORIENTATIONS)} | inner


def word(attributes: Attributes, name: str, default: str, *others: str) -> str:
    """Return an attribute with one of several values; raises FormatError."""
    if name not in attributes:
        return default
    text = attributes[name].attribute(name)
    if text not in (default, *others):
        raise attributes[name].error(f"{name} {shown(text)}; expected {', '.join((default, *others))}", name)
    return text


def numbers_of(attributes: Attributes, name: str, default: str) -> tuple[float, ...]:
    """Read an attribute of as many numbers as its default has."""
    if name not in attributes:
        return tuple(map(float, default.split()))
    return attributes[name].numbers(len(default.split()), name)


def direction(attributes: Attributes, name: str, vector: Sequence[float]) -> Vector:
    """Return the unit vector along the vector of an attribute; raises FormatError if that is zero."""
    x, y, z = vector
    if quaternion.magnitude(x, y, z, floats) < LEAST:
        raise attributes[name].error(f"{name}: {x:g} {y:g} {z:g} has no direction", name)
    return quaternion.unit_vector(x, y, z, floats)


def _turning_z(x: float, y: float, z: float) -> Quaternion:
    """Return the shortest rotation from the z axis to a direction; about x if that is -z, as in MuJoCo."""
    if z < 0.0 and quaternion.length(x, y, 0.0, floats) < SAME_LINE:
        return 1.0, 0.0, 0.0, 0.0
    return quaternion.between(0.0, 0.0, 1.0, x, y, z, floats)


SHOWN_GROUPS = 3  # MuJoCo's viewer draws geoms of groups below this
IN_QPOS = {"floating": 7, "ball": 4}  # numbers of a joint in qpos; joints of other kinds have one


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a model, with joint values from options, by default those of the file (`ref`)."""
    links = MjcfModel(read_xml(file, "mujoco"), options).links.values()
    yield from JointState.of(links, options, file.name).edges(links)


def read_joints(file: InputFile, state: str) -> Iterator[JointSample]:
    """Yield the joint values of a key of the model: `state` is its name, or its number from 0.

    Raises FormatError.
    """
    root = read_xml(file, "mujoco")
    links = MjcfModel(root, Options(Diagnostics(), Topics())).links.values()
    joints = [joint for link in links for joint in link.joints]  # a body's before those of its children
    keys = [key for frames in root.all("keyframe") for key in frames.all("key")]
    if not keys:
        raise file.error("no <key> in it, which would have joint values")
    names = {key.attribute("name") or str(index): key for index, key in enumerate(keys)}
    states = {str(index): key for index, key in enumerate(keys)} | names
    if state not in states:
        message = f"no key {shown(state)}" if state else f"name one of its keys: {file.name}:{next(iter(names))}"
        raise file.error(f"{message}{alternatives(state, names, 'keys')}")
    key = states[state]
    if not key.attribute("qpos"):
        raise key.error(f"key {shown(state)} has no qpos")
    sizes = [IN_QPOS.get(joint.kind, 1) for joint in joints]
    numbers = iter(key.numbers(sum(sizes), "qpos"))

    def refuse(problem: str, _path: Path) -> FormatError:
        return key.error(problem, "qpos")

    for joint, size in zip(joints, sizes, strict=True):
        found = list(islice(numbers, size))
        if size == 1:
            yield JointSample(joint.name, JointValue(found[0]), None, refuse)
            continue
        w, x, y, z = found[-4:]
        if w == x == y == z == 0.0:
            raise refuse(f"qpos of joint {shown(joint.name)}: 0 0 0 0 has no direction", ())
        pose = {"xyzw": [repr(part) for part in quaternion.normalized(x, y, z, w, floats)]}
        pose |= {"xyz": [repr(part) for part in found[:3]]} if joint.kind == "floating" else {}
        yield JointSample(joint.name, pose, None, refuse)


def read_solids(file: InputFile) -> Iterator[Solid]:
    """Yield the geoms of a model that MuJoCo's viewer draws."""
    model = MjcfModel(read_xml(file, "mujoco"), Options(Diagnostics(), Topics()))
    for node, inside in model.geoms:
        attributes = model.attributes(node, inside.around)
        usual = "mesh" if "mesh" in attributes else "sphere"
        kind = attributes["type"].attribute("type") if "type" in attributes else usual
        if numbers_of(attributes, "group", "0")[0] >= SHOWN_GROUPS or kind not in SHAPES:
            continue
        size = numbers_of(attributes, "size", attributes["size"].attribute("size") if "size" in attributes else "")
        if "fromto" in attributes:
            ends = numbers_of(attributes, "fromto", "0 0 0 0 0 0")
            size = (*size[:1], 0.5 * dist(ends[:3], ends[3:]))
        size = tuple(2.0 * number if kind == "box" or at == 1 else number for at, number in enumerate(size))
        pose = rigid.compose(*inside.frame, *model.pose_of_site(attributes))
        yield Solid(inside.body, kind, size[: SIZES.get(kind, 0)], pose)
