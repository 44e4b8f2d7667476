"""SDF, the models and worlds of Gazebo, read; its joints take values.

    <model name="arm"><link name="tip"><pose relative_to="wrist" degrees="true">0 0 0.1 0 0 90</pose></link> ..

Frames are named `model::link`, `model::joint`, `model::frame`, `outer::inner::link`; those of sensors
`model::link::sensor`. Metres and radians unless `degrees`; roll pitch yaw about fixed axes, or `quat_xyzw`.
parent_from_child: a link hangs on the link its joint connects it to, a joint's frame on its child, an explicit frame
on what it is attached to, a model's frame on its canonical link where a joint moves that, else the links on it.
Without `relative_to` a pose is that in the model; of a joint in its child, of a frame in what it is attached to.
A model outside of any world has a parent, `world`, if it has a pose. `<include>` is left out, and said.
Source: sdformat.org, Pose Frame Semantics and Model Composition, SDF 1.4 to 1.12.

The joints of an SDF file: which bodies they connect, and how those move.

The frame of a joint is attached to its child; axes are seen from it, or from the frame that `expressed_in` names.
"""

from __future__ import annotations

from collections import Counter
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.xml import XmlFile, read_nodes
from frametool.errors import FormatError, alternatives, shown
from frametool.formats.robots.model import Joint, Link, Mimic
from frametool.formats.robots.posture import Posture
from frametool.formats.robots.sdf_frames import HELD, IDENTITY, WORLD, SdfFrames
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.quaternion import unit_vector

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.documents.xml import XmlNode
    from frametool.formats.robots.sdf_frames import SdfFrame
    from frametool.grammar.edges import Edge, Options
    from frametool.grammar.readers import Vector

KINDS = {  # how many axes each has
    "revolute": 1, "continuous": 1, "prismatic": 1, "universal": 2, "revolute2": 2, "ball": 0, "fixed": 0,
    "screw": 0, "gearbox": 0,
}  # fmt: skip
STILL = ("screw", "gearbox")
UNLIMITED = 1e15  # the limits that SDF writes for none are 1e16


class SdfJoint(NamedTuple):
    """What connects two bodies, links or the world.

    motions: what moves, outermost first; nothing for a fixed joint
    """

    frame: SdfFrame
    parent: SdfFrame
    child: SdfFrame
    motions: tuple[Joint, ...]

    @property
    def hanging(self) -> SdfFrame:
        """Return the body that hangs on the other one: on the world everything hangs."""
        return self.parent if self.child.kind == WORLD else self.child

    @property
    def outer(self) -> SdfFrame:
        """Return the body that it hangs on."""
        return self.child if self.child.kind == WORLD else self.parent


class SdfJoints:
    """All joints of a file, in its order.

    names: those under which they take values, without scopes where that is enough
    """

    def __init__(self, frames: SdfFrames) -> None:
        """Read them; raises FormatError."""
        self.frames = frames
        self.xml = frames.xml
        of_joints = [frame for frame in frames.all.values() if frame.kind == "joint"]
        counts = Counter(frame.holder.attribute("name") for frame in of_joints)
        self.names = {
            frame.name: local if counts[local := frame.holder.attribute("name")] == 1 else frame.name
            for frame in of_joints
        }
        self.all = [self._read(frame) for frame in of_joints]

    def body(self, frame: SdfFrame) -> SdfFrame | None:
        """Return the link, or the world, that a frame moves with; None for a model without links.

        Raises FormatError for frames that are attached in a circle.
        """
        seen: list[SdfFrame] = []
        current: SdfFrame | None = frame
        while current is not None and current.kind not in ("link", WORLD):
            if current in seen:
                named = " -> ".join(shown(each.name) for each in [*seen, current][-3:])
                raise self.xml.error(frame.holder.element, f"frames attached to each other in a circle: {named}")
            seen.append(current)
            if current.kind == "frame":
                current = self.frames.attached(current)
            else:
                current = self.frames.end(current, "child") if current.kind == "joint" else self.canonical(current)
        return current

    def canonical(self, model: SdfFrame) -> SdfFrame | None:
        """Return the link that a model's frame is attached to: the one it names, or the first, also of nested ones."""
        if told := model.holder.attribute("canonical_link"):
            try:
                return self.frames.find(told, model, model.holder, "canonical_link")
            except FormatError as error:
                if error is not self.frames.missing:
                    raise
                return None
        inside = [frame for frame in self.frames.all.values() if frame.scope is model]
        links = (frame for kind in ("link", "model") for frame in inside if frame.kind == kind)
        return next(links, None)

    def _read(self, frame: SdfFrame) -> SdfJoint:
        holder = frame.holder
        kind = holder.attribute("type")
        if kind not in KINDS:
            message = f"joint {shown(frame.local)} has the type {shown(kind)}{alternatives(kind, KINDS, 'types')}"
            raise self.xml.error(holder.element, message, "type")
        parent, child = (self.body(self.frames.end(frame, which)) for which in ("parent", "child"))
        if parent is None or child is None or parent is child:
            raise self.xml.error(holder.element, f"joint {shown(frame.local)} does not connect two links")
        if kind in STILL:
            message = f"joint {shown(frame.local)} is a {kind}: it stands as in the file and takes no value"
            self.frames.options.tally.note_each(message, holder.element.line)
        return SdfJoint(frame, parent, child, self._motions(frame, kind))

    def _motions(self, frame: SdfFrame, kind: str) -> tuple[Joint, ...]:
        name, line = self.names[frame.name], frame.holder.element.line
        if kind == "ball":
            return (Joint(name, "ball", line=line),)
        plain = {"continuous": "continuous", "prismatic": "prismatic"}.get(kind, "revolute")
        motions = []
        for tag, called in (("axis", name), ("axis2", f"{name}:2"))[: KINDS[kind]]:
            if axis := frame.holder.first(tag):
                motions.append(self._axis(frame, axis, called, plain))
            else:
                message = f"joint {shown(frame.local)} has no <{tag}>: it takes no value there"
                self.frames.options.tally.note_each(message, line)
        return tuple(motions)

    def _axis(self, frame: SdfFrame, axis: XmlNode, name: str, kind: str) -> Joint:
        """Read one axis of a joint, with its limits and what it mimics."""
        line = frame.holder.element.line
        lower, upper = self._limits(axis)
        return Joint(name, kind, self._direction(frame, axis), lower, upper, self._mimic(frame, axis), line=line)

    def _direction(self, frame: SdfFrame, axis: XmlNode) -> Vector:
        """Return an axis as the joint's frame sees it."""
        xyz = axis.first("xyz")
        if xyz is None:
            return 0.0, 0.0, 1.0
        x, y, z = self.xml.numbers_in(xyz.text, xyz.element, "", 3)
        if not (x or y or z):
            raise self.xml.error(xyz.element, f"joint {shown(frame.local)} has the axis 0 0 0, which is no direction")
        scope = frame.scope or self.frames.top
        told = xyz.attribute("expressed_in")
        outer = self.frames.find(told, scope, xyz, "expressed_in") if told else None
        if not told and self._in_model(axis):
            outer = scope
        if outer is not None and outer is not frame:
            turned = self.frames.relative(frame, outer)[3:]
            x, y, z = quaternion.rotate(*turned, x, y, z)
        return unit_vector(x, y, z, floats)

    def _in_model(self, axis: XmlNode) -> bool:
        """Tell whether an axis is seen from the model: in SDF before 1.5 always, until 1.6 where it says so."""
        version = self.frames.version
        flag = axis.text_of("use_parent_model_frame").lower() in ("true", "1")
        return version < (1, 5) or (flag and version < (1, 7))

    def _limits(self, axis: XmlNode) -> tuple[float | None, float | None]:
        limit = axis.first("limit")
        lower = self._limit(limit, "lower")
        upper = self._limit(limit, "upper")
        return (None, None) if lower is None or upper is None or lower > upper else (lower, upper)

    def _limit(self, limit: XmlNode | None, which: str) -> float | None:
        """Read one limit; None for none, which SDF writes as 1e16 or inf."""
        held = limit.first(which) if limit is not None else None
        if held is None or held.text.lstrip("+-").lower() in ("inf", "infinity"):
            return None
        (value,) = self.xml.numbers_in(held.text, held.element, "", 1)
        return value if isfinite(value) and abs(value) < UNLIMITED else None

    def _mimic(self, frame: SdfFrame, axis: XmlNode) -> Mimic | None:
        """Read what a joint follows: multiplier * (leader - reference) + offset, of either axis of the leader."""
        mimic = axis.first("mimic")
        if mimic is None:
            return None
        leader = self.frames.find(mimic.attribute("joint"), frame.scope or self.frames.top, mimic, "joint")
        if leader.kind != "joint":
            raise self.xml.error(mimic.element, f"{shown(leader.name)} is a {leader.kind}, no joint", "joint")
        name = self.names[leader.name] + (":2" if mimic.attribute("axis") == "axis2" else "")
        multiplier = self._number(mimic, "multiplier", 1.0)
        offset, reference = self._number(mimic, "offset", 0.0), self._number(mimic, "reference", 0.0)
        return Mimic(name, multiplier, offset - multiplier * reference)

    def _number(self, holder: XmlNode, tag: str, default: float) -> float:
        held = holder.first(tag)
        return default if held is None else self.xml.numbers_in(held.text, held.element, "", 1)[0]


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a world or model, its joints as told, else where the file has them."""
    xml = XmlFile(file)
    frames = SdfFrames(read_nodes(xml, HELD), xml, options)
    yield from _SdfTree(frames, SdfJoints(frames), options).edges()


class _SdfTree:
    """Hangs the frames of a file on each other."""

    def __init__(self, frames: SdfFrames, joints: SdfJoints, options: Options) -> None:
        self.frames = frames
        self.joints = joints
        self.options = options
        self.hung: dict[str, SdfJoint] = {}  # link -> the joint that it hangs on
        self._above: dict[str, str] = {}  # link -> one on which it hangs, if not at once
        for joint in joints.all:
            self._hang(joint)
        ends = [end for joint in joints.all for end in (joint.parent, joint.child)]
        self.in_world = frames.top.holder.tag == "world" or frames.top in ends
        self.carried = {model.name: self._carrier(model) for model in frames.all.values() if model.kind == "model"}

    def _hang(self, joint: SdfJoint) -> None:
        """Let a link hang on a joint; one that would close a loop is left out, and told."""
        link = joint.hanging.name
        if link in self.hung:
            where = f"{shown(link)} hangs on joint {shown(self.hung[link].frame.local)} already"
        elif self._root_of(joint.outer.name) == link:
            where = f"{shown(joint.outer.name)} hangs on {shown(link)} already"
        else:
            self.hung[link] = joint
            self._above[link] = joint.outer.name
            return
        message = f"joint {shown(joint.frame.local)} closes a loop and is left out: {where}"
        self.options.tally.note_each(message, joint.frame.holder.element.line)

    def _root_of(self, link: str) -> str:
        """Return the link at the top of those on which a link hangs; the way is cut short for the next time."""
        way = []
        while link in self._above:
            way.append(link)
            link = self._above[link]
        self._above.update(dict.fromkeys(way, link))
        return link

    def edges(self) -> Iterator[Edge]:
        """Yield every edge, and the root where nothing stands in a world."""
        links = [self._link(frame) for frame in self.frames.all.values() if frame is not self.frames.top]
        for sensor in self.frames.sensors:
            holder = sensor.scope or self.frames.top
            pose = rigid.compose(*self.frames.relative(holder, sensor.relative_to or holder), *sensor.pose)
            links.append(Link(holder.name, sensor.name, pose, line=sensor.holder.element.line))
        return self._posture().edges(links)

    def _link(self, frame: SdfFrame) -> Link:
        """Return how a frame hangs: on the joint that holds it, if one does."""
        line = frame.holder.element.line
        relative = self.frames.relative
        if joint := self.hung.get(frame.name):
            line = joint.frame.holder.element.line
            origin, after = relative(joint.parent, joint.frame), relative(joint.frame, joint.child)
            rest, inverted = relative(joint.outer, frame), joint.child.kind == WORLD
            return Link(joint.outer.name, frame.name, origin, joint.motions, line, after, rest, inverted)
        outer = self._outer(frame)
        if outer is self.frames.top and self._is_root(frame):
            return Link(None, frame.name, line=line)
        return Link(outer.name, frame.name, relative(outer, frame), line=line)

    def _outer(self, frame: SdfFrame) -> SdfFrame:
        """Return the frame on which one hangs that no joint holds."""
        if frame.kind == "joint":
            return self.frames.end(frame, "child")
        if frame.kind == "frame":
            return self.frames.attached(frame)
        if link := self.carried.get(frame.name):
            return link
        scope = frame.scope  # the nearest model around it that no joint moves, or the world
        while scope is not None and self.carried.get(scope.name):
            scope = scope.scope
        return scope or self.frames.top

    def _carrier(self, model: SdfFrame) -> SdfFrame | None:
        """Return the link on which a model's frame hangs; None where its links hang on it."""
        link = self.joints.body(model)
        return link if link is not None and link.name in self.hung else None

    def _is_root(self, frame: SdfFrame) -> bool:
        """Tell whether a frame has no parent: outside of any world, in a model without a pose in one."""
        way = frame.below(self.frames.top)
        return not self.in_world and way[-1].kind == "model" and way[-1].in_scope == IDENTITY

    def _posture(self) -> Posture:
        """Return where the joints stand; values have the names that we have for joints: `tip` for `arm::tip`."""
        places = {motion.name: joint.frame.holder.element for joint in self.joints.all for motion in joint.motions}
        moving = [motion for joint in self.joints.all for motion in joint.motions]
        fixed = [self.joints.names[joint.frame.name] for joint in self.joints.all if not joint.motions]
        answers = self.options.answers
        values = {self.joints.names.get(name, name): value for name, value in answers.joints.items()}
        options = self.options._replace(answers=answers._replace(joints=values))
        return Posture(
            moving, options, lambda joint, text: self.frames.xml.error(places[joint.name], text), fixed=fixed
        )
