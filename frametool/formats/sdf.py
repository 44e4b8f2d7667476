"""SDF, the models and worlds of Gazebo, read; its joints take values.

    <model name="arm"><link name="tip"><pose relative_to="wrist" degrees="true">0 0 0.1 0 0 90</pose></link> ..

Frames are named `model::link`, `model::joint`, `model::frame`, `outer::inner::link`; those of sensors
`model::link::sensor`. Metres and radians unless `degrees`; roll pitch yaw about fixed axes, or `quat_xyzw`.
parent_from_child: a link hangs on the link its joint connects it to, a joint's frame on its child, an explicit frame
on what it is attached to, a model's frame on its canonical link where a joint moves that, else the links on it.
Without `relative_to` a pose is that in the model; of a joint in its child, of a frame in what it is attached to.
A model outside of any world has a parent, `world`, if it has a pose. `<include>` is left out, and said.
Source: sdformat.org, Pose Frame Semantics and Model Composition, SDF 1.4 to 1.12.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.documents.xml_events import XmlFile
from frametool.documents.xml_tree import read_nodes
from frametool.errors import shown
from frametool.formats.posture import Posture
from frametool.formats.sdf_elements import HELD, IDENTITY
from frametool.formats.sdf_frames import SdfFrames
from frametool.formats.sdf_joints import SdfJoints
from frametool.geometry import rigid
from frametool.grammar.edges import Edge

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.input_file import InputFile
    from frametool.formats.sdf_frames import SdfFrame
    from frametool.formats.sdf_joints import SdfJoint
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options


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

    def _carrier(self, model: SdfFrame) -> SdfFrame | None:
        """Return the link on which a model's frame hangs; None where its links hang on it."""
        link = self.joints.body(model)
        return link if link is not None and link.name in self.hung else None

    def _around(self, frame: SdfFrame) -> SdfFrame:
        """Return the frame of the nearest model around one that no joint moves, or the world."""
        scope = frame.scope
        while scope is not None and self.carried.get(scope.name):
            scope = scope.scope
        return scope or self.frames.top

    def edges(self) -> Iterator[Edge]:
        """Yield every edge, and the root where nothing stands in a world."""
        posture = self._posture()
        for frame in self.frames.all.values():
            if frame.name in self.hung:
                yield from self._across(self.hung[frame.name], posture)
            elif frame is not self.frames.top:
                yield self._edge(self._outer(frame), frame)
        for sensor in self.frames.sensors:
            link = sensor.scope or self.frames.top
            pose = rigid.compose(*self.frames.relative(link, sensor.relative_to or link), *sensor.pose)
            yield Edge(link.name, sensor.name, pose, line=sensor.holder.element.line)

    def _outer(self, frame: SdfFrame) -> SdfFrame:
        """Return the frame on which one hangs that no joint holds."""
        if frame.kind == "joint":
            return self.frames.end(frame, "child")
        if frame.kind == "frame":
            return self.frames.attached(frame)
        return self.carried.get(frame.name) or self._around(frame)

    def _edge(self, outer: SdfFrame, frame: SdfFrame) -> Edge:
        """Return an edge that stands still."""
        line = frame.holder.element.line
        if outer is self.frames.top and self._is_root(frame):
            return Edge(None, frame.name, IDENTITY, line=line)
        return Edge(outer.name, frame.name, self.frames.relative(outer, frame), line=line)

    def _is_root(self, frame: SdfFrame) -> bool:
        """Tell whether a frame has no parent: outside of any world, in a model without a pose in one."""
        way = frame.below(self.frames.top)
        return not self.in_world and way[-1].kind == "model" and way[-1].in_scope == IDENTITY

    def _posture(self) -> Posture:
        """Return where the joints stand."""
        places = {motion.name: joint.frame.holder.element for joint in self.joints.all for motion in joint.motions}
        moving = [motion for joint in self.joints.all for motion in joint.motions]
        fixed = [self.joints.names[joint.frame.name] for joint in self.joints.all if not joint.motions]
        return Posture(
            moving,
            self._with_short_names(),
            lambda joint, problem: self.frames.xml.error(places[joint.name], problem),
            fixed=fixed,
        )

    def _with_short_names(self) -> Options:
        """Return the options with values of joints under the names that we have for them: `tip` for `arm::tip`."""
        answers = self.options.answers
        told = {self.joints.names.get(name, name): value for name, value in answers.joints.items()}
        return self.options._replace(answers=answers._replace(joints=told))

    def _across(self, joint: SdfJoint, posture: Posture) -> Iterator[Edge]:
        """Yield the edge across a joint: for good, or a sample at each time."""
        hanging = joint.hanging
        outer = joint.outer
        rest = self.frames.relative(outer, hanging)
        line = joint.frame.holder.element.line
        for stamp_ns, moved in posture.motions(*(motion.name for motion in joint.motions)):
            pose = rest if all(each == IDENTITY for each in moved) else self._moved(joint, moved)
            yield Edge(outer.name, hanging.name, pose, stamp_ns, line)

    def _moved(self, joint: SdfJoint, moved: tuple[Rigid, ...]) -> Rigid:
        """Return the pose of the body that hangs on a joint once that has moved."""
        pose = self.frames.relative(joint.parent, joint.frame)
        for each in (*moved, self.frames.relative(joint.frame, joint.child)):
            pose = rigid.compose(*pose, *each)
        return rigid.inverse(*pose) if joint.turned else pose
