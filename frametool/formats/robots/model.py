"""The model of a robot for all formats: links, the joints between them, and joint values.

    Link("base", "arm", origin, (Joint("elbow", "revolute", (0.0, 1.0, 0.0), lower=-2.0, upper=2.0),))

Radians, metres, poses.  A value is text as people write it (`0.5`, `30deg`, `pi/2`, `2cm`), a number, or a pose for a
joint with several degrees of freedom.  `Robot.fk` and the edges of a tree use the same function for the pose of a link.

    robot = frametool.load_robot("arm.urdf")
    base_from_tip = robot.fk("base", "tip", {"shoulder": 0.3, "elbow": numpy.linspace(0.0, 1.0, 1000)})

Joint values from files, and over time, are in `frametool.formats.robots.joints`.
"""

from __future__ import annotations

from functools import reduce
from importlib import import_module
from itertools import repeat
from operator import and_
from typing import Any, NamedTuple, TypeAlias

from frametool.documents.document import parse_documents
from frametool.documents.source import InputFile, Source
from frametool.errors import FormatError, UnknownFrame, ValueInvalid, alternatives, listing, shown
from frametool.formats.table import FORMATS
from frametool.frames.topology import FramePath, path_between
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.representations import notation
from frametool.geometry.transform import Transform
from frametool.geometry.validation import as_numbers, scalars, single
from frametool.grammar.pose import read_pose, read_spelled
from frametool.grammar.readers import INDICES, Misfit, Quaternion, Reading, Vector, as_mapping, kind
from frametool.text.numbers import parse_angle, parse_length

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.documents.xml import Element
    from frametool.geometry import Components, Condition, Namespace, Number, Numbers, Rigid
    from frametool.grammar.edges import Options

    Value: TypeAlias = "JointValue | Rigid"
    Values: TypeAlias = Mapping[str, Value]

TURNING = ("revolute", "continuous")
POSED = ("planar", "floating", "ball")  # their value is a pose, not a number
OUT_OF_PLANE = 1e-9


def read_quaternion(element: Element, texts: Sequence[str], options: Options, attribute: str = "") -> Quaternion:
    """Read x, y, z, w of an element by the rules of the grammar; warnings are recorded.  Raises FormatError."""
    reading = Reading(element.file.source, normalize=options.normalize)
    try:
        rotation = read_spelled(notation("xyzw"), texts, INDICES, reading).rotation
    except ValueInvalid as error:
        raise element.error(str(error), attribute, rule=error.rule) from None
    options.tally.note_all(reading.notes, element.line)
    return rotation


class Mimic(NamedTuple):
    """A joint follows another one: multiplier * value + offset, in radians or metres."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


class Joint(NamedTuple):
    """A joint that can move.

    kind: one of TURNING or POSED, or prismatic
    axis: unit vector in the frame of the joint; of a planar joint the normal of its plane
    lower, upper: limits in radians or metres, None for no limit
    rest, rest_pose: the value, a number or a pose, at the pose in the file (MJCF's `ref`), which is the default
    anchor: the point of its frame about which it rotates
    line: line number in the file
    """

    name: str
    kind: str
    axis: Vector = (1.0, 0.0, 0.0)
    lower: float | None = None
    upper: float | None = None
    mimic: Mimic | None = None
    rest: float = 0.0
    rest_pose: Rigid = rigid.IDENTITY
    anchor: Vector = (0.0, 0.0, 0.0)
    line: int = 0

    @property
    def posed(self) -> bool:
        """Return True if its value is a pose."""
        return self.kind in POSED

    @property
    def start(self) -> Value:
        """Return the default value of the joint; for a mimic that of a leader at 0."""
        if self.mimic:
            return followed(self, JointValue(0.0))
        return self.rest_pose if self.posed else JointValue(self.rest)


class JointValue(NamedTuple):
    """The value of a revolute or prismatic joint: a float or an array; radians or metres, or degrees, which are exact.

    An angle in degrees is never converted to radians: quarter turns have exact poses.
    """

    number: Number
    degrees: bool = False

    @property
    def plain(self) -> Number:
        """Return the value in radians or metres."""
        return self.number * floats.DEGREE if self.degrees else self.number


def motion(joint: Joint, value: Value, xp: Namespace = floats) -> Rigid:
    """Return the pose of the frame after the joint in the frame before it, for a joint value."""
    if isinstance(value, JointValue):
        number, degrees = value
        if joint.rest:
            number = number - (joint.rest * floats.RADIAN if degrees else joint.rest)
        if joint.kind == "prismatic":
            return rigid.slid(*joint.axis, number)
        value = rigid.turned(*joint.axis, number, xp, degrees=degrees)
    if not any(joint.anchor):
        return value
    tx, ty, tz, *_ = value
    px, py, pz = joint.anchor
    mx, my, mz = quaternion.rotate(*value[3:], px, py, pz)
    return tx + px - mx, ty + py - my, tz + pz - mz, *value[3:]


def _is_at_rest(joint: Joint, value: Value) -> Condition:
    """Return True, or a mask for arrays, where the joint value causes no motion."""
    if not isinstance(value, JointValue):
        return value == rigid.IDENTITY
    at_rest: Condition = value.number == (joint.rest * floats.RADIAN if value.degrees else joint.rest)
    return at_rest


class Link(NamedTuple):
    """The connection of a frame to its parent.

    parent: None for a root
    origin, after: poses before and after the joints; parent_from_child = origin * motions * after
    joints: those that move the frame, outermost first
    rest: its pose with all joints at rest, with exactly the numbers of the file
    inverted: origin, joints and after give child_from_parent instead
    fixed: the name of the fixed joint to its parent, "" without one
    """

    parent: str | None
    child: str
    origin: Rigid = rigid.IDENTITY
    joints: tuple[Joint, ...] = ()
    line: int = 0
    after: Rigid = rigid.IDENTITY
    rest: Rigid | None = None
    inverted: bool = False
    fixed: str = ""

    def pose(self, values: Sequence[Value], xp: Namespace = floats) -> Rigid:
        """Return parent_from_child for joint values; exactly `rest` if no joint has moved."""
        rest = self.rest or _product(self.origin, self.after)
        if not self.joints:
            return rest
        at_rest: Condition = reduce(and_, map(_is_at_rest, self.joints, values))
        if at_rest is True:
            return rest
        moved = _product(self.origin, *map(motion, self.joints, values, repeat(xp)), self.after)
        if self.inverted:
            moved = rigid.inverse(*moved)
        if not xp.some(at_rest):
            return moved
        return tuple(xp.where(at_rest, one, other) for one, other in zip(rest, moved, strict=True))


def _product(*poses: Rigid) -> Rigid:
    """Return the product of poses, the outermost first; identities are skipped, so that they change no bits."""
    product = rigid.IDENTITY
    for each in poses:
        if each is not rigid.IDENTITY:
            product = each if product is rigid.IDENTITY else rigid.compose(*product, *each)
    return product


def followed(joint: Joint, leader: Value) -> Value:
    """Return the value of a joint that mimics another one; limits are not applied."""
    if joint.mimic is None or not isinstance(leader, JointValue):
        return joint.start
    _, multiplier, offset = joint.mimic
    if leader.degrees and joint.kind in TURNING:
        return JointValue(leader.number * multiplier + offset * floats.RADIAN, degrees=True)
    return JointValue(leader.plain * multiplier + offset)


def leaders_first(
    names: Iterable[str], joints: Mapping[str, Joint], valued: Collection[str] = (), file: str = ""
) -> dict[str, str]:
    """Return joint -> the joint that it mimics, for the joints and all that they mimic, leaders first.

    valued: joints with a value; these, and joints that mimic no other, have the leader ""
    Raises FormatError, with the name of the file, for joints that mimic each other in a circle.
    """
    order: dict[str, str] = {}
    for first in names:
        line, name = dict[str, str](), first
        while name and name not in order:
            if name in line:
                circle = " -> ".join(map(shown, [*[*line][[*line].index(name) :][:7], name]))
                problem = f"joints mimic each other in a circle: {circle}"
                raise FormatError(problem, source=file, line=joints[name].line)
            mimic = None if name in valued else joints[name].mimic
            line[name] = mimic.joint if mimic and mimic.joint in joints else ""
            name = line[name]
        order |= reversed(line.items())
    return order


def read_value(joint: Joint, value: Any, source: Source, *, normalize: bool = False) -> Value:
    """Read the value of a joint: a number, text with or without a unit, a mapping with a pose within its freedom.

    source: where it is, for messages.  Raises Misfit with the path below the value, and ValueInvalid.
    """
    if not joint.posed and isinstance(value, (JointValue, float)):
        return value if isinstance(value, JointValue) else JointValue(value)
    which = f"joint {shown(joint.name)}"
    if not joint.posed:
        if type(value) is not str:
            expected = "metres, or 2cm" if joint.kind == "prismatic" else "radians, or 30deg"
            raise Misfit(f"{which} is {joint.kind}: expected {expected}, found {kind(value)}")
        if joint.kind == "prismatic":
            return JointValue(parse_length(value))
        number, unit = parse_angle(value)
        return JointValue(number, degrees=unit == "deg")
    expected = f"{which} is {joint.kind}: it takes a POSE, as '{{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}}'"
    if type(value) is str and value.lstrip().startswith("{"):
        try:
            documents = parse_documents(value, source.name)
        except FormatError as error:
            raise ValueInvalid(f"{which}: {error.message}") from None
        value = documents[0].value if len(documents) == 1 else None
    if type(value) is not dict:
        raise Misfit(f"{expected}; found {kind(value)}")
    pose = read_pose(as_mapping(value, expected), Reading(source, normalize=normalize))
    if pose.name is not None or pose.parent is not None:
        raise Misfit(f"{which} names its frames itself; leave name and parent out")
    tx, ty, tz, x, y, z, _ = pose.components
    ax, ay, az = joint.axis
    if joint.kind == "ball" and (tx or ty or tz):
        raise Misfit(f"{which} is a ball joint: it turns only; leave the position out")
    if joint.kind == "planar":
        along = ax * tx + ay * ty + az * tz
        tilt = max(map(abs, (y * az - z * ay, z * ax - x * az, x * ay - y * ax)))
        if max(abs(along), tilt) > OUT_OF_PLANE * (1.0 + max(map(abs, (tx, ty, tz)))):
            raise Misfit(f"{which} is planar: this pose leaves the plane across {ax:g} {ay:g} {az:g}")
    return pose.components


# --- solids, as files draw them ---

SIZES = {"box": 3, "cylinder": 2, "capsule": 2, "sphere": 1}  # shape -> the count of its size's numbers
SHAPES = (*SIZES, "mesh")
PARTS = {"size": 3, "radius": 1, "length": 1}  # attributes with the size of a shape -> the count of their numbers


class Solid(NamedTuple):
    """A solid in a frame: a kind of SHAPES, its pose, and its size in metres; centred at the origin, with axis z.

    size: edge lengths of a box; radius and length, for a capsule without its caps; radius; () for a mesh
    """

    frame: str
    kind: str
    size: tuple[float, ...]
    pose: Rigid = rigid.IDENTITY


def read_solids(file: InputFile, fmt: str) -> list[Solid]:
    """Return the solids of a file that was read as a tree; [] for formats without solids.  Raises FormatError."""
    read = getattr(import_module(FORMATS[fmt].reader), "read_solids", None)
    return [*read(file)] if read else []


def solids_of(name: str, link: Element, pose_of: Callable[[Element], Rigid]) -> list[Solid]:
    """Return the visual shapes of a link; if these are only meshes, its simple collision shapes, if any."""

    def size(shape: Element) -> Iterator[float]:
        for part, count in PARTS.items():  # attributes in URDF, elements in SDF
            if part in shape.attributes:
                yield from shape.numbers(count, part)
            elif held := shape.first(part):
                yield from held.numbers(count)

    visual, collision = (
        [Solid(name, shape.tag, tuple(size(shape)), pose_of(node))
         for node in link.all(tag) for geometry in node.all("geometry") for shape in geometry.all(*SHAPES)]
        for tag in ("visual", "collision")
    )  # fmt: skip
    simple = [each for each in collision if each.kind != "mesh"]
    return simple if visual and simple and all(each.kind == "mesh" for each in visual) else visual


class Robot:
    """Frames and the joints between them; computes the pose of one frame in another.

    frames: names, in the order of the file
    joints: those that move, by name
    """

    def __init__(self, name: str, links: Mapping[str, Link], frames: Iterable[str]) -> None:
        """Store the frames, and the links of those that are not roots; `name` is for messages."""
        self.name = name
        self.frames = tuple(frames)
        self.links = dict(links)
        self.joints = {joint.name: joint for link in links.values() for joint in link.joints}

    @property
    def roots(self) -> tuple[str, ...]:
        """Return the frames without a parent."""
        return tuple(frame for frame in self.frames if frame not in self.links)

    def chain(self, base: str, tip: str) -> Chain:
        """Return the joints and fixed segments between two frames.

        Raises UnknownFrame, NotConnected.
        """
        for frame in (base, tip):
            if frame not in self.frames:
                raise UnknownFrame(frame, known=self.frames, where=self.name)
        path = path_between(base, tip, lambda frame: self.links[frame].parent if frame in self.links else None)
        return Chain(path, self.links, self.joints)

    def __repr__(self) -> str:
        """Show the number of frames and joints, and the roots."""
        counts = f"{len(self.frames)} frames, {len(self.joints)} joints"
        return f"Robot({counts}, roots: {', '.join(self.roots) or 'none'})"

    def fk(self, base: str, tip: str, joints: Mapping[str, Any] | Numbers) -> Transform:
        """Return base_from_tip, the pose of `tip` in `base`, for one set of joint values or many at once.

        joints: values by name, numbers or arrays of one shape: radians and metres, text like "30deg", a pose for a
            planar or floating joint; or an array (..., n) of the joints in the order of `chain(base, tip).needs`.
        A joint that mimics another one follows it unless it has a value of its own.
        Raises UnknownFrame, NotConnected; ValueInvalid for missing or unknown joints.
        """
        chain = self.chain(base, tip)
        values: dict[str, Value] = {}
        named: Any = joints
        if not hasattr(joints, "keys"):
            array = as_numbers(joints, "joints")
            if array.ndim == 0 or array.shape[-1] != len(chain.needs):
                wanted = f"(..., {len(chain.needs)}) for {listing(chain.needs)}"
                raise ValueInvalid(f"joints: expected shape {wanted}, got {array.shape}")
            named = {name: array[..., at] for at, name in enumerate(chain.needs)}
        for name, value in named.items():
            joint = self.joints.get(name)
            if joint is None:
                raise ValueInvalid(f"no joint {shown(name)}{alternatives(name, self.joints, 'joints')}")
            if joint.posed and isinstance(value, Transform):
                if not single(value.components):
                    raise ValueInvalid(f"joint {shown(name)} takes one pose, got many")
                values[name] = value.components
            elif isinstance(value, (str, dict)):
                values[name] = read_value(joint, value, Source(f"joint {name}", ""))
            else:
                values[name] = JointValue(scalars(value, name))
        if missing := chain.missing(values):
            raise ValueInvalid(f"no value for {listing(missing)}; the joints on the way are {listing(chain.needs)}")
        return Transform.of(*chain.run(values))


class Chain:
    """The path between two frames of a robot: its links, and the joints that determine it.

    needs: the joints whose values are needed, without those that mimic others
    """

    def __init__(self, path: FramePath, links: Mapping[str, Link], joints: Mapping[str, Joint]) -> None:
        """Find the links from the common ancestor down to both ends, topmost first."""
        self._joints = joints
        self._down, self._up = ([links[child] for child in edges] for edges in (path.to_target, path.to_source))
        self._between = [joint.name for link in (*self._down, *self._up) for joint in link.joints]
        self.needs = tuple(self.missing(()))

    def uses(self, joint: str) -> bool:
        """Return True if a joint moves anything on the path, by itself or through joints that mimic it."""
        return joint in leaders_first(self._between, self._joints)

    def missing(self, valued: Collection[str]) -> list[str]:
        """Return the joints that have no value, neither of their own nor through the joint they mimic."""
        order = leaders_first(self._between, self._joints, valued)
        return [name for name, leader in order.items() if not leader and name not in valued]

    def run(self, values: Values) -> Components:
        """Return tx, ty, tz, x, y, z, w: floats if all values are, else arrays, computed block by block."""
        used = {name: values[name] for name in leaders_first(self._between, self._joints, values) if name in values}
        plain = {name: value for name, value in used.items() if isinstance(value, JointValue)}
        numbers = tuple(value.number for value in plain.values())
        if single(numbers):
            return self.pose(used, floats)
        from frametool.geometry import arrays

        def kernel(*block: Any) -> Components:
            parts = zip(plain.items(), block, strict=True)
            return self.pose({**used, **{name: JointValue(part, each.degrees) for (name, each), part in parts}}, arrays)

        return arrays.run(kernel, 7, numbers)

    def pose(self, values: Values, xp: Namespace) -> Rigid:
        """Return base_from_tip, computed from values of the needed joints: all floats, or arrays of one block."""
        known = dict(values)
        for name, leader in leaders_first(self._between, self._joints, values).items():
            if name not in known:
                joint = self._joints[name]
                known[name] = followed(joint, known[leader]) if leader else joint.start
        top_from_base, top_from_tip = (
            _product(*(link.pose([known[joint.name] for joint in link.joints], xp) for link in links))
            for links in (self._down, self._up)
        )
        if not self._down:
            return top_from_tip
        if not self._up:
            return rigid.inverse(*top_from_base)
        return rigid.compose(*rigid.inverse(*top_from_base), *top_from_tip)
