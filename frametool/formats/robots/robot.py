"""A robot in Python: its frames and joints, and where a frame is seen from another for values of the joints.

Example:
    robot = frametool.load_robot("arm.urdf")
    base_from_tip = robot.fk("base", "tip", {"shoulder": 0.3, "elbow": numpy.linspace(0.0, 1.0, 1000)})
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.source import Source, paused_collector
from frametool.errors import BadTopology, FormatError, UnknownFrame, ValueInvalid, alternatives, listing, shown
from frametool.formats.load import Recording, refuse_unknown_joints
from frametool.formats.robots.joints import TURNING, Joint, JointValue, followed, read_value
from frametool.formats.table import FORMATS
from frametool.frames.path import edges_between
from frametool.geometry import floats, rigid
from frametool.geometry.rigid import go_on, slide, turn
from frametool.geometry.transform import Transform
from frametool.geometry.trig import RADIAN
from frametool.geometry.validation import as_numbers, scalars, single
from frametool.grammar.edges import Options

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence
    from os import PathLike

    from frametool.formats.robots.joints import Value
    from frametool.formats.robots.posture import Posture
    from frametool.geometry.types import Components, Namespace, Numbers, Rigid

    Values = Mapping[str, Value]

IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Link(NamedTuple):
    """How a frame hangs in its parent: the pose at rest, then what the joint does; None for a fixed one."""

    parent: str
    origin: Rigid
    joint: Joint | None = None


class Robot:
    """Frames, and joints between them; answers where a frame is seen from another.

    frames: names, in the order of the file
    joints: those that move, by name
    """

    def __init__(self, name: str, links: Mapping[str, Link], frames: Iterable[str]) -> None:
        """Take the frames, and how those hang that are no roots; `name` is for messages."""
        self.name = name
        self.frames = tuple(frames)
        self.links = dict(links)
        self.joints = {link.joint.name: link.joint for link in links.values() if link.joint}

    @property
    def roots(self) -> tuple[str, ...]:
        """Return the frames that hang nowhere."""
        return tuple(frame for frame in self.frames if frame not in self.links)

    def chain(self, base: str, tip: str) -> Chain:
        """Return the joints and fixed pieces between two frames.

        Raises UnknownFrame, NotConnected.
        """
        for frame in (base, tip):
            if frame not in self.frames:
                raise UnknownFrame(frame, known=self.frames, where=self.name)
        down, up = edges_between(base, tip, self._parent)
        return Chain([self.links[child] for child in down], [self.links[child] for child in reversed(up)], self.joints)

    def __repr__(self) -> str:
        """Return how many frames and joints there are, and the roots."""
        counts = f"{len(self.frames)} frames, {len(self.joints)} joints"
        return f"Robot({counts}, roots: {', '.join(self.roots) or 'none'})"

    def _parent(self, frame: str) -> str | None:
        link = self.links.get(frame)
        return link.parent if link else None

    def fk(self, base: str, tip: str, joints: Mapping[str, Any] | Numbers) -> Transform:
        """Return base_from_tip, the pose of `tip` in `base`, for one posture or for many at once.

        joints: values by name, numbers or arrays of one shape: radians and metres, text like "30deg", a pose for a
        planar or floating joint; or an array (..., n) of the joints in the order of `chain(base, tip).needs`.
        A joint that mimics another one follows it unless it has a value of its own.
        Raises UnknownFrame, NotConnected; ValueInvalid for joints that are missing or not there.
        """
        chain = self.chain(base, tip)
        values = self._values(joints) if hasattr(joints, "keys") else _of_array(joints, chain.needs)
        if missing := chain.missing(values):
            raise ValueInvalid(f"no value for {listing(missing)}; the joints on the way are {listing(chain.needs)}")
        return Transform.of(*chain.run(values))

    def _values(self, joints: Any) -> dict[str, Value]:
        """Check what is told of joints."""
        values: dict[str, Value] = {}
        for name, value in joints.items():
            joint = self.joints.get(name)
            if joint is None:
                raise ValueInvalid(f"no joint {shown(name)}{alternatives(name, self.joints, 'joints')}")
            if joint.posed and isinstance(value, Transform):
                values[name] = _single_pose(value, name)
            elif isinstance(value, (str, dict)):
                values[name] = read_value(joint, value, Source(f"joint {name}", ""))
            else:
                values[name] = JointValue(scalars(value, name))
        return values


def _single_pose(pose: Transform, name: str) -> Rigid:
    """Take the pose of a planar or floating joint, which is the same for all."""
    if not single(pose.components):
        raise ValueInvalid(f"joint {shown(name)} takes one pose, got many")
    return pose.components


def _of_array(joints: Numbers, names: Sequence[str]) -> dict[str, Value]:
    """Take the last axis of an array apart."""
    array = as_numbers(joints, "joints")
    if array.ndim == 0 or array.shape[-1] != len(names):
        wanted = f"(..., {len(names)}) for {listing(names)}"
        raise ValueInvalid(f"joints: expected shape {wanted}, got {array.shape}")
    return {name: JointValue(scalars(array[..., at], "joints")) for at, name in enumerate(names)}


class Chain:
    """The way between two frames of a robot, prepared: fixed pieces composed, joints in order.

    needs: the joints whose values decide, those that mimic others left out
    """

    def __init__(self, down: Sequence[Link], up: Sequence[Link], joints: Mapping[str, Joint]) -> None:
        """Take the links from the common ancestor down to either end, topmost first."""
        self._joints = joints
        self._down, self._up = _pieces(down), _pieces(up)
        self._between = tuple(link.joint.name for link in (*down, *up) if link.joint)
        self.needs = self._deciding(())

    def uses(self, joint: str) -> bool:
        """Tell whether a joint moves anything on the way, by itself or through those that follow it."""
        return any(joint in self._followed(name, ()) for name in self._between)

    def missing(self, told: Collection[str]) -> list[str]:
        """Name the joints without a value, neither told nor followed."""
        return [name for name in self._deciding(told) if name not in told]

    def _deciding(self, told: Collection[str]) -> tuple[str, ...]:
        """Name the joints that decide: those told of, and those that follow no other."""
        return tuple(dict.fromkeys(self._followed(name, told)[-1] for name in self._between))

    def _followed(self, name: str, told: Collection[str]) -> list[str]:
        """Return a joint and those it follows, up to one that is told or follows none."""
        line = [name]
        while line[-1] not in told:
            mimic = self._joints[line[-1]].mimic
            if mimic is None or mimic.joint not in self._joints:
                break
            line.append(mimic.joint)
        return line

    def run(self, values: Values) -> Components:
        """Return tx, ty, tz, x, y, z, w: floats if all values are, else arrays, computed block by block."""
        used = {name: values[name] for name in self._deciding(values) if name in values}
        numbers = {name: value.number for name, value in used.items() if isinstance(value, JointValue)}

        def kernel(*parts: Any) -> Components:
            *block, xp = parts
            given = zip(numbers, block, strict=True)
            values = {name: JointValue(number, _in_degrees(used[name])) for name, number in given}
            return self.pose({**used, **values}, xp)

        if single(tuple(numbers.values())):
            return kernel(*numbers.values(), floats)
        from frametool.geometry import arrays

        return arrays.run(kernel, 7, tuple(numbers.values()), arrays)

    def pose(self, values: Values, xp: Namespace) -> Rigid:
        """Return base_from_tip for values of the joints that are needed: all floats, or arrays of one block."""
        top_from_base, top_from_tip = (self._along(pieces, values, xp) for pieces in (self._down, self._up))
        if not self._down:
            return top_from_tip
        if not self._up:
            return rigid.inverse(*top_from_base)
        return rigid.compose(*rigid.inverse(*top_from_base), *top_from_tip)

    def _along(self, pieces: Sequence[Rigid | Joint], values: Values, xp: Namespace) -> Rigid:
        """Go along one branch."""
        pose = None
        for piece in pieces:
            if isinstance(piece, Joint):
                pose = _across(pose or IDENTITY, piece, self._value(piece.name, values), xp)
            else:
                pose = go_on(pose, piece) if pose else piece
        return pose or IDENTITY

    def _value(self, name: str, values: Values) -> Value:
        """Return the value of a joint: told, followed, or at rest."""
        *followers, leader = self._followed(name, values)
        value = values[leader] if leader in values else self._joints[leader].start
        if leader not in values and self._joints[leader].mimic:  # of a joint that is fixed
            value = followed(self._joints[leader], JointValue(0.0))
        for each in reversed(followers):
            value = followed(self._joints[each], value)
        return value


def _in_degrees(value: Value) -> bool:
    return isinstance(value, JointValue) and value.degrees


def _pieces(links: Iterable[Link]) -> list[Rigid | Joint]:
    """Return the fixed pieces of a branch and the joints between them; neighbours that are fixed are composed."""
    pieces: list[Rigid | Joint] = []
    for link in links:
        if pieces and not isinstance(pieces[-1], Joint):
            pieces[-1] = rigid.compose(*pieces[-1], *link.origin)
        else:
            pieces.append(link.origin)
        if link.joint:
            pieces.append(link.joint)
    return pieces


def _across(pose: Rigid, joint: Joint, value: Value, xp: Namespace) -> Rigid:
    """Carry a pose across a joint."""
    if not isinstance(value, JointValue):
        return rigid.compose(*pose, *value)
    number, degrees = value
    if joint.rest:
        number = number - (joint.rest * RADIAN if degrees else joint.rest)
    if joint.kind in TURNING:
        return turn(pose, joint.axis, number, xp, degrees=degrees)
    return slide(pose, joint.axis, number)


def load_robot(path: str | PathLike[str]) -> Robot:
    """Read the robot of a URDF file, `-` for standard input.

    Raises FormatError and BadTopology with file, line and column; FileProblem.
    """
    return robot_of(Recording(path))[0]


def robot_of(file: Recording) -> tuple[Robot, Posture]:
    """Return the robot of a file, and where its joints stand as the file's answers say; otherwise as `load_robot`."""
    if file.form != "urdf":
        file.close()
        raise FormatError(f"expected a URDF robot, found {FORMATS[file.form].summary}", source=file.name)
    from frametool.formats.robots.urdf import describe

    options = Options(file.tally, file.topics, answers=file.answers)
    try:
        with paused_collector():
            described = describe(file, options)
            posture = described.posture(options)
    finally:
        file.close()
    refuse_unknown_joints([file])
    links: dict[str, Link] = {}
    for hinge in described.hinges:
        if hinge.child in links:
            parents = f"{shown(links[hinge.child].parent)} and {shown(hinge.parent)}"
            problem = f"frame {shown(hinge.child)} has two parents: {parents}"
            raise BadTopology(problem, source=file.name, line=hinge.element.line, rule="two-parents")
        links[hinge.child] = Link(hinge.parent, hinge.origin, hinge.joint)
    file.tell()
    return Robot(file.name, links, described.links), posture
