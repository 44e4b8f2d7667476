"""The frames of an SDF file, and where each stands before anything has moved.

Every model is a scope: a pose is relative to a frame of the model it stands in, or of one nested in that, named with
`::`.  Which frame a frame is attached to is another matter, and says how it moves.
Source: sdformat.org, Pose Frame Semantics (1.7) and Model Composition (1.8).

The elements of SDF that place frames, and how a pose is written in them.
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING

from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid, alternatives, shown
from frametool.geometry import euler, floats, rigid
from frametool.geometry.representations import notation
from frametool.grammar.readers import INDICES, Reading
from frametool.grammar.rotation_spelling import rotation_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.documents.xml import XmlFile, XmlNode
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options

IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_AXIS = frozenset(("xyz", "limit", "mimic", "use_parent_model_frame"))
HELD = {
    "sdf": frozenset(("world", "model", "include")),
    "world": frozenset(("model", "frame", "joint", "include", "state")),
    "model": frozenset(("model", "link", "joint", "frame", "pose", "include")),
    "link": frozenset(("pose", "sensor")),
    "sensor": frozenset(("pose",)),
    "frame": frozenset(("pose",)),
    "joint": frozenset(("pose", "parent", "child", "axis", "axis2")),
    "axis": _AXIS,
    "axis2": _AXIS,
    "limit": frozenset(("lower", "upper")),
    "mimic": frozenset(("multiplier", "offset", "reference")),
    "include": frozenset(("uri", "name")),
}


def read_pose(holder: XmlNode, xml: XmlFile, options: Options) -> tuple[Rigid, str]:
    """Read the pose of an element: x y z roll pitch yaw, or x y z qx qy qz qw.

    What is empty or missing is the identity.  Returns it with what it is relative to, "" for the default.
    Raises FormatError.
    """
    pose = holder.first("pose")
    if pose is None:
        return IDENTITY, ""
    if pose.attribute("frame"):
        message = "<pose frame=..> of SDF 1.5 has no meaning and is left out; relative_to has one"
        options.tally.note_each(message, pose.element.line)
    degrees, quaternion = _is_true(pose.attribute("degrees")), _is_quaternion(pose, xml)
    if degrees and quaternion:
        raise xml.error(pose.element, "degrees with quat_xyzw; keep one", "degrees")
    if not pose.text:
        return IDENTITY, pose.attribute("relative_to")
    numbers = xml.numbers_in(pose.text, pose.element, "", 7 if quaternion else 6)
    x, y, z = numbers[:3]
    if quaternion:
        rotation = _quaternion(pose, xml, options)
    else:
        roll, pitch, yaw = numbers[3:]
        rotation = euler.to_quaternion(roll, pitch, yaw, "sxyz", floats, degrees=degrees)
    return (x, y, z, *rotation), pose.attribute("relative_to")


def _is_true(text: str) -> bool:
    return text.lower() in ("true", "1")


def _is_quaternion(pose: XmlNode, xml: XmlFile) -> bool:
    form = pose.attribute("rotation_format")
    if form not in ("", "euler_rpy", "quat_xyzw"):
        message = f"rotation_format {shown(form)}; expected euler_rpy or quat_xyzw"
        raise xml.error(pose.element, message, "rotation_format")
    return form == "quat_xyzw"


def _quaternion(pose: XmlNode, xml: XmlFile, options: Options) -> tuple[float, float, float, float]:
    reading = Reading(Source(xml.name, ""), normalize=options.normalize)
    try:
        rotation = rotation_of(notation("xyzw"), pose.text.split()[3:], INDICES, reading)
    except ValueInvalid as error:
        raise xml.error(pose.element, str(error), rule=error.rule) from None
    for note in reading.notes:
        options.tally.note(note, pose.element.line)
    return rotation


WORLD = "world"
INSIDE = "__model__"
DEEPEST_MODEL = 100


class SdfFrame:
    """One frame: of a world, model, link, joint, sensor, or one that is only a frame.

    name: with its scopes, as the tree has it; local: as the file has it
    scope: the model, or the world, in which it stands; None for the world
    pose: as written, in `relative_to`; in_scope: worked out, in the frame of the scope
    """

    __slots__ = ("holder", "in_scope", "kind", "local", "name", "open", "placement", "pose", "relative_to", "scope")

    def __init__(self, kind: str, local: str, scope: SdfFrame | None, holder: XmlNode) -> None:
        """Create a frame whose pose is not read yet."""
        self.kind = kind
        self.local = local
        self.scope = scope
        self.name: str = local if scope is None or scope.kind == WORLD else f"{scope.name}::{local}"
        self.holder = holder
        self.pose = IDENTITY
        self.relative_to = scope
        self.placement: SdfFrame | None = None
        self.in_scope: Rigid | None = None
        self.open = False

    def below(self, scope: SdfFrame) -> list[SdfFrame]:
        """Return the frames on the way up from this one to a scope around it, that excluded."""
        way: list[SdfFrame] = []
        frame: SdfFrame | None = self
        while frame is not None and frame is not scope:
            way.append(frame)
            frame = frame.scope
        return way


class SdfFrames:
    """All frames of a file by name."""

    def __init__(self, root: XmlNode, xml: XmlFile, options: Options) -> None:
        """Read the frames and the poses; raises FormatError."""
        self.xml = xml
        self.options = options
        worlds = list(root.all("world"))
        if len(worlds) > 1:
            raise xml.error(worlds[1].element, "a second <world>; a tree is of one")
        self.top = SdfFrame(WORLD, WORLD, None, worlds[0] if worlds else root)
        self.all: dict[str, SdfFrame] = {WORLD: self.top}
        self.sensors: list[SdfFrame] = []
        self.version = _version(root)
        self.missing: FormatError | None = None  # the last error about a name that was left out
        self.gone: set[str] = set()
        self._take([self.top])
        while self._read_all():  # as long as names are lost with what was left out
            pass
        for frame in self.all.values():
            self._settle(frame)

    def _take(self, scopes: list[SdfFrame]) -> None:
        """Register what stands in some scopes, and in those below."""
        for scope in scopes:  # which grows
            if len(scope.below(self.top)) > DEEPEST_MODEL:
                raise self.xml.error(scope.holder.element, f"more than {DEEPEST_MODEL} models inside one another")
            for holder in scope.holder.children:
                if holder.tag == "include":
                    self._leave_out(holder)
                elif holder.tag == "state":
                    message = "<state> is left out: every model stands where its own pose has it"
                    self.options.tally.note_each(message, holder.element.line)
                elif holder.tag in ("model", "link", "joint", "frame"):
                    frame = self._named(holder, scope)
                    if holder.tag == "model":
                        scopes.append(frame)
                    for sensor in holder.all("sensor"):
                        self.sensors.append(SdfFrame("sensor", self._name(sensor), frame, sensor))

    def _name(self, holder: XmlNode) -> str:
        name = holder.attribute("name")
        if not name:
            raise self.xml.error(holder.element, f"<{holder.tag}> has no name")
        return name

    def _named(self, holder: XmlNode, scope: SdfFrame) -> SdfFrame:
        """Register one element under its name."""
        frame = SdfFrame(holder.tag, self._name(holder), scope, holder)
        if frame.local in (WORLD, INSIDE):
            raise self.xml.error(holder.element, f"the name {shown(frame.local)} is reserved", "name")
        known = self.all.get(frame.name)
        if known is not None and self.version < (1, 7) and holder.tag == "joint" and known.kind == "link":
            message = f"joint {shown(frame.local)} has the name of a link; its frame is {frame.local}_joint"
            self.options.tally.note_each(message, holder.element.line)
            frame = SdfFrame("joint", f"{frame.local}_joint", scope, holder)
            known = self.all.get(frame.name)
        if known is not None:
            first = f"first in line {known.holder.element.line}"
            raise self.xml.error(holder.element, f"{holder.tag} {shown(frame.name)} twice; {first}", "name")
        self.all[frame.name] = frame
        return frame

    def _leave_out(self, include: XmlNode) -> None:
        name = shown(include.text_of("name") or include.text_of("uri"))
        message = f"<include> {name} is left out, it needs other files; with them: gz sdf -p FILE > whole.sdf"
        self.options.tally.note_each(message, include.element.line)

    def _read_all(self) -> bool:
        """Read every frame; return whether some were left out because they build on what is included."""
        lost: list[SdfFrame] = []
        for frame in [*self.all.values(), *self.sensors]:
            try:
                if frame is not self.top:
                    self._read(frame)
            except FormatError as error:
                if error is not self.missing:
                    raise
                lost.append(frame)
                message = f"{frame.kind} {shown(frame.name)} is left out: {error.message}"
                self.options.tally.note_each(message, frame.holder.element.line)
        self.gone |= {frame.name for frame in lost}
        self.all = {name: each for name, each in self.all.items() if not self._is_gone(each)}
        self.sensors = [each for each in self.sensors if not self._is_gone(each)]
        return bool(lost)

    def _is_gone(self, frame: SdfFrame) -> bool:
        """Tell whether a frame, or a scope around it, was left out."""
        return any(each.name in self.gone for each in (frame, *frame.below(self.top)))

    def _read(self, frame: SdfFrame) -> None:
        """Read the pose of a frame and find what it is relative to."""
        holder, scope = frame.holder, frame.scope or self.top
        frame.pose, told = read_pose(holder, self.xml, self.options)
        pose = holder.first("pose")
        if frame.kind == "sensor":  # which stands in its link, but sees the names around that
            around = scope.scope or self.top
            frame.relative_to = self.find(told, around, pose or holder, "relative_to") if told else scope
        else:
            outer = self._default(frame)
            frame.relative_to = self.find(told, scope, pose or holder, "relative_to") if told else outer
        if frame.kind == "model" and (placed := holder.attribute("placement_frame")):
            frame.placement = self.find(placed, frame, holder, "placement_frame")

    def _default(self, frame: SdfFrame) -> SdfFrame | None:
        """Return what the pose of a frame is relative to unless told; what it needs besides must be there too."""
        if frame.kind == "frame":
            return self.attached(frame)
        if frame.kind == "joint":
            return [self.end(frame, which) for which in ("parent", "child")][1]
        return frame.scope

    def attached(self, frame: SdfFrame) -> SdfFrame:
        """Return what an explicit frame is attached to."""
        scope = frame.scope or self.top
        told = frame.holder.attribute("attached_to")
        return self.find(told, scope, frame.holder, "attached_to") if told else scope

    def end(self, joint: SdfFrame, which: str) -> SdfFrame:
        """Return the frame that is the parent or the child of a joint."""
        holder = joint.holder.first(which)
        if holder is None or not holder.text:
            raise self.xml.error((holder or joint.holder).element, f"joint {shown(joint.local)} has no <{which}>")
        if holder.text == WORLD:
            return self.top
        return self.find(holder.text, joint.scope or self.top, holder, "")

    def find(self, told: str, scope: SdfFrame, holder: XmlNode, attribute: str) -> SdfFrame:
        """Return the frame that a name means in a scope.

        Raises FormatError with the names there are.
        """
        if told == (INSIDE if scope.kind == "model" else WORLD):
            return scope
        name = told if scope.kind == WORLD else f"{scope.name}::{told}"
        found = self.all.get(name) or self.all.get(name.removesuffix(f"::{INSIDE}"))
        if found is not None and found is not self.top:
            return found
        place = "the world" if scope.kind == WORLD else f"model {shown(scope.name)}"
        message = f"no frame {shown(told)} in {place}"
        if self._is_left_out(told, name, scope):
            self.missing = self.xml.error(holder.element, message, attribute)
            raise self.missing
        raise self.xml.error(holder.element, message + self._hint(told, scope), attribute)

    def _is_left_out(self, told: str, name: str, scope: SdfFrame) -> bool:
        """Tell whether a name is one that was left out, or begins with that of an included model."""
        if any(name == gone or name.startswith(f"{gone}::") for gone in self.gone):
            return True
        for include in scope.holder.all("include"):
            file = include.text_of("uri").rstrip("/").rsplit("/", 1)[-1]
            names = (include.text_of("name"), file, file.rsplit(".", 1)[0])
            if told.split("::", maxsplit=1)[0] in names or include.attribute("merge") == "true":
                return True
        return False

    def _hint(self, told: str, scope: SdfFrame) -> str:
        """Say what could have been meant by a name that is not there."""
        if told == WORLD:
            return "; poses in a model are relative to frames of the model"
        return alternatives(told, [frame.local for frame in self.all.values() if frame.scope is scope], "frames")

    def _settle(self, frame: SdfFrame) -> None:
        """Work out the pose of a frame in its scope, after those it depends on; a stack, for chains may be long.

        Raises FormatError for frames that are relative to each other in a circle.
        """
        pending = [frame]
        while pending:
            current = pending[-1]
            if current.in_scope is not None:
                pending.pop()
                continue
            needed = [each for each in self._needed(current) if each.in_scope is None]
            if not needed:
                current.in_scope = self._worked_out(current)
            elif current.open or any(each.open for each in needed):
                named = " -> ".join(shown(each.name) for each in [current, *needed][:2])
                message = f"poses relative to each other in a circle: {named}"
                raise self.xml.error((current.holder.first("pose") or current.holder).element, message)
            else:
                current.open = True
                pending += needed

    def _needed(self, frame: SdfFrame) -> list[SdfFrame]:
        """Return the frames whose poses make up that of a frame."""
        if frame.scope is None or frame.relative_to is None:
            return []
        needed = self._between(frame.relative_to, frame.scope)
        return needed + (frame.placement.below(frame) if frame.placement else [])

    def _between(self, frame: SdfFrame, scope: SdfFrame) -> list[SdfFrame]:
        """Return the frames between one and a scope: those below that, or above it where the frame is the world."""
        return scope.below(self.top) if frame is self.top else frame.below(scope)

    def _worked_out(self, frame: SdfFrame) -> Rigid:
        scope, relative_to = frame.scope, frame.relative_to
        if scope is None or relative_to is None:
            return IDENTITY
        pose = frame.pose if relative_to is scope else rigid.compose(*self.seen_from(scope, relative_to), *frame.pose)
        if frame.placement is None:
            return pose
        return rigid.compose(*pose, *rigid.inverse(*self.seen_from(frame, frame.placement)))

    def seen_from(self, scope: SdfFrame, frame: SdfFrame) -> Rigid:
        """Return the pose of a frame below a scope, or of the world, in the frame of the scope."""
        way = [each.in_scope or IDENTITY for each in reversed(self._between(frame, scope))]
        pose = _product(way)
        return rigid.inverse(*pose) if frame is self.top and way else pose

    def relative(self, outer: SdfFrame, frame: SdfFrame) -> Rigid:
        """Return the pose of one frame in another, before anything has moved; as written where it was written so."""
        if frame.relative_to is outer and frame.placement is None:
            return frame.pose
        if outer.relative_to is frame and outer.placement is None:
            return rigid.inverse(*outer.pose)
        around = {id(each) for each in (outer, *outer.below(self.top), self.top)}
        common = next(each for each in (*frame.below(self.top), self.top) if id(each) in around)
        seen = _product([each.in_scope or IDENTITY for each in reversed(frame.below(common))])
        if common is outer:
            return seen
        own = _product([each.in_scope or IDENTITY for each in reversed(outer.below(common))])
        return rigid.relative(*own, *seen)


def _product(poses: Sequence[Rigid]) -> Rigid:
    return reduce(lambda outer, inner: rigid.compose(*outer, *inner), poses) if poses else IDENTITY


def _version(root: XmlNode) -> tuple[int, ...]:
    """Return the version of SDF as numbers; what is none counts as the newest."""
    parts = root.attribute("version").split(".")
    return tuple(map(int, parts)) if all(part.isdecimal() for part in parts) else (2,)
