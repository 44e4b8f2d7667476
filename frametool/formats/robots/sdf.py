"""Read SDF, the models and worlds of Gazebo; their joints take values.

    <model name="arm"><link name="tip"><pose relative_to="wrist" degrees="true">0 0 0.1 0 0 90</pose></link> ..

Frames are named `model::link`, `model::joint`, `model::frame`, `outer::inner::link`; those of sensors
`model::link::sensor`. Metres and radians unless `degrees`; roll pitch yaw about fixed axes, or `quat_xyzw`.
parent_from_child: the parent of a link is the other link of its joint, of a joint's frame its child, of an explicit
frame the frame it is attached to, of a model's frame its canonical link if a joint moves that, else of the links the
model's frame.
Without `relative_to` a pose is relative to the model; of a joint to its child, of a frame to what it is attached to.
A model outside of any world has a parent, `world`, if it has a pose. `<include>` is omitted, with a warning.
Source: sdformat.org, Pose Frame Semantics and Model Composition, SDF 1.4 to 1.12.

Every model is a scope: a pose is relative to a frame of its model, or of a nested one, named with `::`.  The frame that
a frame is attached to is independent of that, and determines its motion.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.xml import Element, read_xml
from frametool.errors import alternatives, shown
from frametool.formats.robots.joints import JointState
from frametool.formats.robots.model import Joint, Link, Mimic, Solid, read_quaternion, solids_of
from frametool.frames.lookups import FrameTree
from frametool.frames.topology import Groups
from frametool.geometry import euler, floats, quaternion, rigid
from frametool.grammar.edges import Diagnostics, Edge, Options, Topics

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.geometry import Rigid


def read_pose(holder: Element, options: Options) -> tuple[Rigid, str]:
    """Read the pose of an element: x y z roll pitch yaw, or x y z qx qy qz qw.

    Missing or empty is the identity.  Returns the pose and the frame it is relative to, "" for the default.
    Raises FormatError.
    """
    pose = holder.first("pose")
    if pose is None:
        return rigid.IDENTITY, ""
    if pose.attribute("frame"):
        message = "<pose frame=..> of SDF 1.5 has no meaning and is left out; relative_to has one"
        options.tally.note_each(message, pose.line)
    degrees, fmt = pose.attribute("degrees").lower() in TRUE, pose.attribute("rotation_format")
    if fmt not in ("", "euler_rpy", "quat_xyzw"):
        raise pose.error(f"rotation_format {shown(fmt)}; expected euler_rpy or quat_xyzw", "rotation_format")
    if degrees and fmt == "quat_xyzw":
        raise pose.error("degrees with quat_xyzw; keep one", "degrees")
    relative_to = pose.attribute("relative_to")
    if not pose.text:
        return rigid.IDENTITY, relative_to
    x, y, z, roll, pitch, yaw = pose.numbers(7 if fmt == "quat_xyzw" else 6)[:6]
    if fmt == "quat_xyzw":
        rotation = read_quaternion(pose, pose.text.split()[3:], options)
    else:
        rotation = euler.to_quaternion(roll, pitch, yaw, "sxyz", floats, degrees=degrees)
    return (x, y, z, *rotation), relative_to


WORLD = "world"
WHOLE = "gz sdf -p FILE > whole.sdf"
INSIDE = "__model__"
DEEPEST_MODEL = 100
TRUE = ("true", "1")


class SdfFrame:
    """One frame: of a world, model, link, joint, sensor, or an explicit one.

    name: with its scopes, as in the tree; local: as in the file
    scope: the enclosing model or world; for a world itself
    attached_to: the frame that it moves with, unless it is a link
    pose: as written, relative to `relative_to`
    placement: for a model with a placement_frame, the frame that has this pose; else None
    """

    __slots__ = ("attached_to", "holder", "kind", "local", "name", "placement", "pose", "relative_to", "scope")

    def __init__(self, kind: str, local: str, scope: SdfFrame | None, holder: Element) -> None:
        """Create a frame without a pose."""
        self.kind, self.local = kind, local
        self.scope: SdfFrame = scope or self
        self.name: str = local if scope is None or scope.kind == WORLD else f"{scope.name}::{local}"
        self.holder = holder
        self.pose = rigid.IDENTITY
        self.relative_to = self.attached_to = self.scope
        self.placement: SdfFrame | None = None

    def way(self) -> list[SdfFrame]:
        """Return the frames on the path from this one up to, but not including, the world."""
        way, frame = [], self
        while frame is not frame.scope:
            way.append(frame)
            frame = frame.scope
        return way


KINDS = {  # number of axes of each
    "revolute": 1, "continuous": 1, "prismatic": 1, "universal": 2, "revolute2": 2, "ball": 0, "fixed": 0,
    "screw": 0, "gearbox": 0,
}  # fmt: skip
UNLIMITED = 1e15  # SDF writes 1e16 for no limit


class SdfJoint(NamedTuple):
    """The connection of two bodies, links or the world.

    motions: its single-axis joints, outermost first; empty for a fixed joint
    """

    frame: SdfFrame
    parent: SdfFrame
    child: SdfFrame
    motions: tuple[Joint, ...]

    @property
    def ends(self) -> tuple[SdfFrame, SdfFrame]:
        """Return the child and its parent in the tree; the world is always the parent."""
        return (self.parent, self.child) if self.child.kind == WORLD else (self.child, self.parent)


class SdfTree:
    """All frames of a file, and the joints between them.

    all: the frames by their names with scopes
    names: frame of a joint -> its name in joint values, without scopes if that is unique
    hung: link -> the joint that connects it to its parent
    carried: model -> the link that its frame is attached to, for models that a joint moves
    """

    def __init__(self, root: Element, options: Options) -> None:
        """Read the frames, their poses, and the joints; raises FormatError."""
        self.options = options
        worlds = list(root.all("world"))
        if len(worlds) > 1:
            raise worlds[1].error("a second <world>; a tree is of one")
        self.top = SdfFrame(WORLD, WORLD, None, worlds[0] if worlds else root)
        self.all: dict[str, SdfFrame] = {WORLD: self.top}
        self.sensors: list[SdfFrame] = []
        parts = root.attribute("version").split(".")  # anything but numbers counts as the newest version
        self.version = tuple(map(int, parts)) if all(part.isdecimal() for part in parts) else (2,)
        self.included = False
        self._take()
        frames = [frame for frame in self.all.values() if frame is not self.top]
        for frame in [*frames, *self.sensors]:
            self._read(frame)
        self.tree = FrameTree()
        self.seen: dict[str, dict[str, Rigid]] = {}  # cache: frame -> poses of frames in it; keeps long chains linear
        for frame in frames:
            placed = frame.placement or frame
            if not self.tree.hang(frame.relative_to.name, placed.name, frame.pose):
                named = f"{shown(frame.name)} -> {shown(frame.relative_to.name)}"
                message = f"poses relative to each other in a circle: {named}"
                raise (frame.holder.first("pose") or frame.holder).error(message)
        of_joints = [frame for frame in frames if frame.kind == "joint"]
        counts = Counter(frame.holder.attribute("name") for frame in of_joints)
        self.names = {
            frame.name: local if counts[local := frame.holder.attribute("name")] == 1 else frame.name
            for frame in of_joints
        }
        self.joints = [self._joint(frame) for frame in of_joints]
        self.hung: dict[str, SdfJoint] = {}
        connected = Groups[str]()
        for joint in self.joints:
            link, outer = (end.name for end in joint.ends)
            if link in self.hung:
                where = f"{shown(link)} hangs on joint {shown(self.hung[link].frame.local)} already"
            elif not connected.join(link, outer):
                where = f"{shown(outer)} hangs on {shown(link)} already"
            else:
                self.hung[link] = joint
                continue
            self.note(joint.frame.holder, f"joint {shown(joint.frame.local)} closes a loop and is left out: {where}")
        ends = [end for joint in self.joints for end in (joint.parent, joint.child)]
        self.in_world = self.top.holder.tag == "world" or self.top in ends
        self.carried: dict[str, SdfFrame] = {}
        for model in [frame for frame in frames if frame.kind == "model"]:
            if (body := self.body(model)) and body.name in self.hung:
                self.carried[model.name] = body

    def _take(self) -> None:
        """Register the contents of the world or file, and of all models in it."""
        scopes = [self.top]
        for scope in scopes:  # grows during the loop
            if len(scope.way()) > DEEPEST_MODEL:
                raise scope.holder.error(f"more than {DEEPEST_MODEL} models inside one another")
            for holder in scope.holder.children:
                if holder.tag == "include":
                    name = shown(holder.text_of("name") or holder.text_of("uri"))
                    self.note(holder, f"<include> {name} is left out, it needs other files; with them: {WHOLE}")
                    self.included = True
                elif holder.tag == "state" and scope is self.top:
                    self.note(holder, "<state> is left out: every model is at its own pose")
                elif holder.tag in ("model", "link", "joint", "frame"):
                    frame = self._named(holder, scope)
                    if holder.tag == "model":
                        scopes.append(frame)
                    for sensor in holder.all("sensor") if holder.tag == "link" else ():
                        self.sensors.append(SdfFrame("sensor", sensor.required("name"), frame, sensor))

    def note(self, holder: Element, message: str) -> None:
        """Record a warning at an element."""
        self.options.tally.note_each(message, holder.line)

    def _named(self, holder: Element, scope: SdfFrame) -> SdfFrame:
        """Register one element under its name."""
        frame = SdfFrame(holder.tag, holder.required("name"), scope, holder)
        if frame.local in (WORLD, INSIDE):
            raise holder.error(f"the name {shown(frame.local)} is reserved", "name")
        known = self.all.get(frame.name)
        if known is not None and self.version < (1, 7) and holder.tag == "joint" and known.kind == "link":
            self.note(holder, f"joint {shown(frame.local)} has the name of a link; its frame is {frame.local}_joint")
            frame = SdfFrame("joint", f"{frame.local}_joint", scope, holder)
            known = self.all.get(frame.name)
        if known is not None:
            first = f"first in line {known.holder.line}"
            raise holder.error(f"{holder.tag} {shown(frame.name)} twice; {first}", "name")
        self.all[frame.name] = frame
        return frame

    def _read(self, frame: SdfFrame) -> None:
        """Read the pose of a frame and find its reference frame."""
        holder, scope = frame.holder, frame.scope
        frame.pose, relative_to = read_pose(holder, self.options)
        if frame.kind == "frame" and (name := holder.attribute("attached_to")):
            frame.attached_to = self.find(name, scope, holder, "attached_to")
        elif frame.kind == "joint":  # both ends must exist
            _, frame.attached_to = self.end(frame, "parent"), self.end(frame, "child")
        elif frame.kind == "sensor":  # in its link, but names are those of the enclosing model
            scope = scope.scope
        frame.relative_to = frame.attached_to
        if relative_to:
            frame.relative_to = self.find(relative_to, scope, holder.first("pose") or holder, "relative_to")
        if frame.kind == "model" and (placed := holder.attribute("placement_frame")):
            frame.placement = self.find(placed, frame, holder, "placement_frame")

    def end(self, joint: SdfFrame, which: str) -> SdfFrame:
        """Return the frame that is the parent or the child of a joint."""
        holder = joint.holder.first(which)
        if holder is None or not holder.text:
            raise (holder or joint.holder).error(f"joint {shown(joint.local)} has no <{which}>")
        if holder.text == WORLD:
            return self.top
        return self.find(holder.text, joint.scope, holder, "")

    def find(self, name: str, scope: SdfFrame, holder: Element, attribute: str) -> SdfFrame:
        """Return the frame with a name in a scope.

        Raises FormatError with the names that exist.
        """
        if name == (INSIDE if scope.kind == "model" else WORLD):
            return scope
        full = name if scope.kind == WORLD else f"{scope.name}::{name}"
        found = self.all.get(full) or self.all.get(full.removesuffix(f"::{INSIDE}"))
        if found is not None and found is not self.top:
            return found
        place = "the world" if scope.kind == WORLD else f"model {shown(scope.name)}"
        message = f"no frame {shown(name)} in {place}"
        if name == WORLD:
            raise holder.error(f"{message}; poses in a model are relative to frames of the model", attribute)
        if self.included:
            raise holder.error(f"{message}; those of <include> need other files: {WHOLE}", attribute)
        inside = [frame.local for frame in self.all.values() if frame.scope is scope and frame is not scope]
        raise holder.error(f"{message}{alternatives(name, inside, 'frames')}", attribute)

    def relative(self, outer: SdfFrame, frame: SdfFrame) -> Rigid:
        """Return the pose of `frame` in `outer` with all joints at rest; as in the file, if it is written there."""
        if frame.relative_to is outer and frame.placement is None:
            return frame.pose
        if outer.relative_to is frame and outer.placement is None:
            return rigid.inverse(*outer.pose)
        known = self.seen.setdefault(outer.name, {outer.name: rigid.IDENTITY})
        way, top = [], frame.name
        while top not in known and (track := self.tree.track(top)):
            way.append(track)
            top = track.parent
        if top not in known:
            return self.tree.near(outer.name, frame.name)
        for track in reversed(way):
            known[track.child] = rigid.compose(*known[track.parent], *track.components)
        return known[frame.name]

    def body(self, frame: SdfFrame) -> SdfFrame | None:
        """Return the link, or the world, that a frame moves with; None for a model without links.

        Raises FormatError for a cycle of frames that are attached to each other.
        """
        seen: list[SdfFrame] = []
        current: SdfFrame | None = frame
        while current is not None and current.kind not in ("link", WORLD):
            if current in seen:
                named = " -> ".join(shown(each.name) for each in [*seen, current][-3:])
                raise frame.holder.error(f"frames attached to each other in a circle: {named}")
            seen.append(current)
            if current.kind != "model":
                current = current.attached_to
            elif name := current.holder.attribute("canonical_link"):
                current = self.find(name, current, current.holder, "canonical_link")
            else:  # its first link, also of nested models
                inside = [each for each in self.all.values() if each.scope is current]
                current = next((each for kind in ("link", "model") for each in inside if each.kind == kind), None)
        return current

    def _joint(self, frame: SdfFrame) -> SdfJoint:
        """Read a joint: the bodies that it connects, and its axes."""
        holder = frame.holder
        kind = holder.attribute("type")
        if kind not in KINDS:
            message = f"joint {shown(frame.local)} has the type {shown(kind)}{alternatives(kind, KINDS, 'types')}"
            raise holder.error(message, "type")
        parent, child = (self.body(self.end(frame, which)) for which in ("parent", "child"))
        if parent is None or child is None or parent is child:
            raise holder.error(f"joint {shown(frame.local)} does not connect two links")
        if kind in ("screw", "gearbox"):
            named = f"joint {shown(frame.local)} is a {kind}"
            self.note(holder, f"{named}: it is fixed as in the file and takes no value")
        name, line = self.names[frame.name], holder.line
        motions = [Joint(name, "ball", line=line)] if kind == "ball" else []
        plain = kind if kind in ("continuous", "prismatic") else "revolute"
        for tag, called in (("axis", name), ("axis2", f"{name}:2"))[: KINDS[kind]]:
            if axis := holder.first(tag):
                motions.append(self._motion(frame, axis, Joint(called, plain, line=line)))
            else:
                self.note(holder, f"joint {shown(frame.local)} has no <{tag}>: it takes no value there")
        return SdfJoint(frame, parent, child, tuple(motions))

    def _motion(self, frame: SdfFrame, axis: Element, joint: Joint) -> Joint:
        """Read an axis, in the joint's frame, its limits and its mimic of either axis of a leader."""
        x, y, z = 0.0, 0.0, 1.0
        if xyz := axis.first("xyz"):
            x, y, z = xyz.numbers(3)
            if not (x or y or z):
                raise xyz.error(f"joint {shown(frame.local)} has the axis 0 0 0, which is not a direction")
            outer, in_model = frame, axis.text_of("use_parent_model_frame").lower() in TRUE
            if name := xyz.attribute("expressed_in"):
                outer = self.find(name, frame.scope, xyz, "expressed_in")
            elif self.version < (1, 5) or (self.version < (1, 7) and in_model):
                outer = frame.scope  # before 1.5 an axis is relative to the model, until 1.6 by use_parent_model_frame
            if outer is not frame:
                x, y, z = quaternion.rotate(*self.relative(frame, outer)[3:], x, y, z)
            x, y, z = quaternion.unit_vector(x, y, z, floats)
        joint = joint._replace(axis=(x, y, z))
        limit, limits = axis.first("limit"), []
        for held in (limit.first("lower"), limit.first("upper")) if limit else ():
            if held and held.text.lstrip("+-").lower() not in ("inf", "infinity"):
                limits += [value for value in held.numbers(1) if abs(value) < UNLIMITED]
        if len(limits) == 2 and limits[0] <= limits[1]:
            joint = joint._replace(lower=limits[0], upper=limits[1])
        if mimic := axis.first("mimic"):  # multiplier * (leader - reference) + offset
            leader = self.find(mimic.attribute("joint"), frame.scope, mimic, "joint")
            if leader.kind != "joint":
                raise mimic.error(f"{shown(leader.name)} is a {leader.kind}, no joint", "joint")
            name = self.names[leader.name] + (":2" if mimic.attribute("axis") == "axis2" else "")
            usual = {"multiplier": 1.0, "offset": 0.0, "reference": 0.0}
            stated = {part.tag: part.numbers(1)[0] for part in reversed([*mimic.all(*usual)])}  # the first of each
            multiplier, offset, reference = (usual | stated).values()
            joint = joint._replace(mimic=Mimic(name, multiplier, offset - multiplier * reference))
        return joint

    def edges(self) -> Iterator[Edge]:
        """Yield every edge, and the root if there is no world."""
        links = [self._link(frame) for frame in self.all.values() if frame is not self.top]
        for sensor in self.sensors:
            holder = sensor.scope
            pose = rigid.compose(*self.relative(holder, sensor.relative_to), *sensor.pose)
            links.append(Link(holder.name, sensor.name, pose, line=sensor.holder.line))
        moving = [motion for joint in self.joints for motion in joint.motions]
        fixed = [self.names[joint.frame.name] for joint in self.joints if not joint.motions]
        answers = self.options.answers  # joints may be named with their scopes
        values = {self.names.get(name, name): value for name, value in answers.joints.items()}
        options = self.options._replace(answers=answers._replace(joints=values))
        return JointState(moving, options, self.top.holder.file.source.name, fixed=fixed).edges(links)

    def _link(self, frame: SdfFrame) -> Link:
        """Return the connection of a frame: through its joint, if there is one."""
        line = frame.holder.line
        relative = self.relative
        if joint := self.hung.get(frame.name):
            line = joint.frame.holder.line
            origin, after = relative(joint.parent, joint.frame), relative(joint.frame, joint.child)
            outer = joint.ends[1]
            rest, inverted = relative(outer, frame), frame is joint.parent
            return Link(outer.name, frame.name, origin, joint.motions, line, after, rest, inverted)
        if frame.kind in ("joint", "frame"):
            outer = frame.attached_to
        elif frame.name in self.carried:
            outer = self.carried[frame.name]
        else:  # the nearest enclosing model that no joint moves, or the world
            outer = frame.scope
            while outer.name in self.carried:
                outer = outer.scope
        model = frame.way()[-1]
        stays = outer is self.top and model.kind == "model" and relative(outer, model) == rigid.IDENTITY
        if stays and not self.in_world:
            return Link(None, frame.name, line=line)  # outside of any world, in a model without a pose in one
        return Link(outer.name, frame.name, relative(outer, frame), line=line)


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a world or model, with joint values from options, default as in the file."""
    yield from SdfTree(read_xml(file, "sdf"), options).edges()


def read_solids(file: InputFile) -> Iterator[Solid]:
    """Yield the solids of the links."""
    frames = SdfTree(read_xml(file, "sdf"), Options(Diagnostics(), Topics()))
    for frame in frames.all.values():
        if frame.kind == "link":
            yield from solids_of(frame.name, frame.holder, lambda node: read_pose(node, frames.options)[0])
