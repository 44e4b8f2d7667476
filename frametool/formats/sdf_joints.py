"""The joints of an SDF file: which bodies they connect, and how those move.

The frame of a joint is attached to its child; axes are seen from it, or from the frame that `expressed_in` names.
"""

from __future__ import annotations

from collections import Counter
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, alternatives, shown
from frametool.formats.joints import Joint, Mimic
from frametool.formats.sdf_frames import WORLD
from frametool.geometry import floats, quaternion
from frametool.geometry.quaternion import unit_vector

if TYPE_CHECKING:
    from frametool.documents.xml_tree import XmlNode
    from frametool.formats.sdf_frames import SdfFrame, SdfFrames
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
    def turned(self) -> bool:
        """Tell whether the parent hangs on the child: on the world everything hangs."""
        return self.child.kind == WORLD

    @property
    def hanging(self) -> SdfFrame:
        """Return the body that hangs on the other one."""
        return self.parent if self.turned else self.child

    @property
    def outer(self) -> SdfFrame:
        """Return the body that it hangs on."""
        return self.child if self.turned else self.parent


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
