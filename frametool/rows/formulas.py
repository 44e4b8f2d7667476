"""Formulas for streams: pixels of points, points or rays of pixels, and poses from joint values.

Rows keep their columns.  A point without a pixel, or a pixel without a ray, gets nan.
"""

from __future__ import annotations

from collections import Counter
from math import degrees
from typing import TYPE_CHECKING, Any

from frametool import errors
from frametool.documents.document import parse_documents
from frametool.errors import FormatError, Misused, ValueInvalid, bare, did_you_mean, first_of, listing, shown, warn
from frametool.formats.table import FORMATS
from frametool.geometry import quaternion, rigid
from frametool.rows.request import Formula, Shown
from frametool.rows.shapes import POINT, POSE
from frametool.rows.sinks import Word, one_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.formats.robots.joints import JointColumn, JointState
    from frametool.formats.robots.model import Robot
    from frametool.geometry import Components, Namespace, Number, Rigid
    from frametool.geometry.camera import Camera

ALL, INSIDE, OUTSIDE, UNSIZED = "", "in the image", "outside it", "with a pixel"
BEHIND, BEYOND, HORIZON = "behind the camera", "beyond the model", "above the horizon"
UNKNOWN = 2.0  # in_image if the size of the image is unknown
TRUTHS, BITS = ("false", "true", "null"), ("0", "1", "")
RAY = tuple(f"{part}_{axis}" for part in ("origin", "ray") for axis in "xyz")
OWN = (0.0,) * 7  # a placeholder: the pose of the row is not replaced


class Seen(Formula):
    """Base of both camera formulas: rows and frames are unchanged, and the outcomes are counted."""

    def __init__(self, camera: Camera, what: str, first: float) -> None:
        """Begin without rows.

        what: the name of a row in messages; first: the coordinate of the centre of the first pixel
        """
        self.camera = camera
        self.what = what
        self.first = first
        self.counts: Counter[str] = Counter()

    @property
    def lost(self) -> int:
        """Return the number of rows without numbers."""
        return self.counts[BEHIND] + self.counts[BEYOND] + self.counts[HORIZON]

    @property
    def is_mostly_behind(self) -> bool:
        """Return True if most points are behind the camera, so that its axes may be assumed wrongly."""
        return 2 * self.counts[BEHIND] > self.counts[ALL] >= 3

    def summary(self) -> str:
        """Return the number of rows and of each outcome, for a message; "" if there is no outcome to report."""
        angle = f" ({degrees(self.camera.end_angle):.1f} deg)"
        parts = [
            f"{self.counts[name]} {name}{angle * (name == BEYOND)}"
            for name in (INSIDE, OUTSIDE, UNSIZED, BEHIND, BEYOND, HORIZON)
            if self.counts[name]
        ]
        rows = f"{self.counts[ALL]} {self.what}{'s' * (self.counts[ALL] != 1)}"
        return f"{rows}: {', '.join(parts)}" if parts else ""


class PixelsOfPoints(Seen):
    """The pixel and the depth of each point, whether it is in the image, and optionally its distance."""

    def __init__(
        self, camera: Camera, first: float, *, name: str, ranged: bool, take: Callable[..., None] | None = None
    ) -> None:
        """Store the camera and its name, "" for none; ranged: add the distance.

        take: called with the pixels, the depths, and the mask of pixels in the image
        """
        super().__init__(camera, "point", first)
        self.names = ("u", "v", "depth", "in_image", *["range"] * ranged)
        self.take = take
        members: dict[str, Any] = {"camera": name} if name else {}
        members |= {"pixel": (0, 1), "depth": (2,), "in_image": Word(3, one_of(TRUTHS))}
        self.shown = Shown({3: BITS}, members | dict.fromkeys(self.names[4:], (4,)))

    def extras(self, row: str) -> tuple[str, ...]:
        """Name the numbers; raises ValueInvalid for rows without a position."""
        if row not in (POINT, POSE):
            raise ValueInvalid(f"a {row} has no pixel; points and poses have one")
        return self.names

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace  # noqa: ARG002
    ) -> Components:
        """Return the numbers of points that are expressed in the camera's frame."""
        x, y, z = parts[:3]
        u, v, depth = self.camera.pixels_of(x, y, z)
        sized = self.camera.size is not None
        inside = self.camera.is_in_image(u, v) if sized else _is_known(u)
        code = 1.0 * inside if sized else UNKNOWN + 0.0 * depth
        # bad rows are nan and counted elsewhere
        seen, there, within = _number(_is_known(u)), _number(_is_known(depth)), _number(inside)
        behind = _number(self.camera.is_behind(depth) & (u != u))  # noqa: PLR0124 - nan
        self.counts.update({ALL: there, BEHIND: behind, BEYOND: there - seen - behind})
        self.counts.update({INSIDE: within, OUTSIDE: seen - within} if sized else {UNSIZED: seen})
        if self.take is not None:
            self.take(u, v, depth, inside)
        ranged = (xp.sqrt(x * x + y * y + z * z),) * len(self.names[4:])
        return (*OWN, u + self.first, v + self.first, depth, code, *ranged)


class PointsOfPixels(Seen):
    """A ray or a point for each pixel, or the pixel of another camera.

    columns: of u and v, then of the depth or range
    far: "depth" or "range" and its value, if constant; "" if unknown
    height: of the plane to intersect, in the frame of the second pose that is passed; None without a plane
    into: the other camera
    """

    reads_row = False

    def __init__(
        self, camera: Camera, first: float, columns: Sequence[str], *, far: tuple[str, float | None] = ("", None),
        height: float | None = None, into: Camera | None = None, target: str = "",
    ) -> None:  # fmt: skip
        """Store the camera and what to compute; target: the frame of the results, "" without a name."""
        super().__init__(camera, "pixel", first)
        self.columns = tuple(columns)
        self.far, self.constant = far
        self.height = height
        self.into = into
        self.names: tuple[str, ...] = ("x", "y", "z")
        members: dict[str, Any] = {"point": (0, 1, 2)}
        if into is None and height is None and not self.far:
            self.names, members = RAY, {"origin": (0, 1, 2), "ray": (3, 4, 5)}
        elif into is not None and self.columns[0].startswith("pixel"):
            self.names, members = ("u", "v"), {"pixel": (0, 1)}
        elif into is not None:
            self.names, members = self.columns[:2], {self.columns[at]: (at,) for at in range(2)}
        named = {"frame": target} if target and into is None else {}
        self.shown = Shown({}, named | members, replaces=into is not None)

    def extras(self, row: str) -> tuple[str, ...]:  # noqa: ARG002
        """Name the numbers."""
        return self.names

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace  # noqa: ARG002
    ) -> Components:
        """Return the results for pixels; parts: the pose of the camera, then that of the plane."""
        u, v = (each - self.first for each in cells[:2])
        poses: Any = parts
        pose: Rigid = poses[:7]
        found: Components
        if self.into is not None:
            found = tuple(each + self.first for each in self.camera.undistorted_of(u, v, self.into))
        elif self.height is not None:
            found = rigid.apply(*pose, *self.camera.plane_points_of(u, v, poses[7:], self.height))
        elif self.far:
            point = self.camera.points_of(u, v, **{self.far: cells[2] if cells[2:] else self.constant})
            found = rigid.apply(*pose, *point) if pose else point
        else:
            origin, ray = self.camera.points_of(u, v, range=0.0), self.camera.rays_of(u, v)
            if pose:
                origin, ray = rigid.apply(*pose, *origin), quaternion.rotate(*pose[3:], *ray)
            found = *origin, *ray
        there = _is_known(sum(cells))
        lost = there & (found[-1] != found[-1])
        beyond = _number(lost)
        if beyond and self.into is None:
            beyond -= _number(lost & _is_known(self.camera.rays_of(u, v)[0]))
        self.counts.update({ALL: _number(there), BEYOND: beyond})
        self.counts[BEHIND if self.far else HORIZON] += _number(lost) - beyond
        return (*OWN, *found)


def _is_known(number: Number) -> Any:
    return number == number  # noqa: PLR0124 - nan is not equal to itself


def _number(flag: Any) -> int:
    """Return the number of True flags of a block, or 1 or 0 for a single one."""
    return int(flag if isinstance(flag, bool) else flag.sum())


# --- joints ---


class JointRows(Formula):
    """The pose of tip in base, two frames of a robot, for each row of joint values."""

    reads_row = False
    adds = False

    def __init__(self, robot: Robot, posture: JointState, base: str, tip: str) -> None:
        """Find the chain of joints; those with a value in the posture need no column.

        Raises UnknownFrame, NotConnected; BadAnswer for joints whose value changes over time.
        """
        self.chain = robot.chain(base, tip)
        self.joints = robot.joints
        self.base = base
        self.tip = tip
        if posture.moving:
            raise errors.BadAnswer(f"--joints: {listing(posture.moving)} moves over time; stream that file with -i")
        self.constants = {name: posture.still[name] for name in posture.named}
        self._read: Sequence[JointColumn] = ()
        self._beyond: set[str] = set()

    def bind(self, names: Sequence[str], source: str, *, fixed: frozenset[str] = frozenset()) -> None:
        """Choose the columns of the joints of the chain.

        fixed: the joints whose value must come from `constants`
        Raises Misused for a joint without a column or with two values, FormatError for an invalid unit.
        """
        from frametool.formats.robots.joints import find_joint_columns

        try:
            found = find_joint_columns(names, self.joints)
        except ValueInvalid as error:
            raise FormatError(str(error), source=source, line=1) from None
        self._read = columns = [column for column in found if self.chain.uses(column.joint)]
        known = {**self.constants, **{column.joint: None for column in columns}}
        if twice := next((column for column in columns if column.joint in fixed), None):
            problem = f"joint {shown(twice.joint)} has a column, {shown(names[twice.place])}, and a value by --joint"
            raise Misused(f"{problem}; keep one", source=source)
        if missing := self.chain.missing(known):
            others = [name for place, name in enumerate(names) if place not in {column.place for column in found}]
            near = did_you_mean(missing[0], others)
            example = "or give it by --joint" if near else f"give --joint {missing[0]}=VALUE"
            what = f"no column for joint{'s' * (len(missing) > 1)} {listing(missing)}{near or ';'} {example}"
            raise Misused(f"{what}; columns: {first_of(names, 12, quote=bare)}", source=source, line=1)
        self.columns = tuple(names[column.place] for column in columns)

    def kind(self, row: str) -> str:  # noqa: ARG002 - whatever a row is
        """Return POSE."""
        return POSE

    def rename(self, row: str, parent: str | None, name: str | None) -> tuple[str | None, str | None]:  # noqa: ARG002
        """Return base and tip."""
        return self.base, self.tip

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace  # noqa: ARG002
    ) -> Components:
        """Return the pose for the joint values of a block, or of one row."""
        from frametool.formats.robots.joints import SLACK
        from frametool.formats.robots.model import TURNING, JointValue

        values = dict(self.constants)
        for column, cell in zip(self._read, cells, strict=True):
            values[column.joint] = value = JointValue(cell / column.per_metre, column.degrees)
            joint = self.joints[column.joint]
            if joint.lower is None or joint.upper is None or joint.lower > joint.upper or joint.name in self._beyond:
                continue
            middle = 0.5 * (joint.lower + joint.upper)
            if xp.some(abs(value.plain - middle) > joint.upper - middle + SLACK):
                self._beyond.add(joint.name)
                unit = "rad" if joint.kind in TURNING else "m"
                warn(f"joint {shown(joint.name)} goes beyond its limits {joint.lower:g} .. {joint.upper:g} {unit}")
        return self.chain.pose(values, xp)


def names_in(begin: bytes, fmt: str, source: str, wanted: str, *, header: bool = True) -> Sequence[str]:
    """Return the names of a table's columns, or the keys of the first record; of a JointState its joints.

    begin: the first bytes of the stream; wanted: what a record must have, for messages
    Columns without names are numbered from 1; keys in a mapping are joined to its key by a dot.
    """
    if "records" not in FORMATS[fmt].reads:
        from frametool.rows.sources.tables import open_table

        table, _ = open_table(begin, fmt, header=header, source=source)
        return table.called
    from frametool.ros import messages
    from frametool.rows.sources.records import Splitter

    part = next(iter(Splitter(fmt).parts(begin)[0]), None)
    text = "" if part is None else begin[part.start : part.end].decode("utf-8", "replace")
    documents = parse_documents(messages.without_noise(text) if fmt == "yaml" else text, source)
    value: Any = documents[0].value if documents else {}
    value = value[0] if type(value) is list and value else value
    if type(value) is not dict:
        raise FormatError(f"expected a mapping with {wanted}", source=source, line=1)
    inner = value["msg"] if messages.is_envelope(value) else value
    return [joint for joint, *_ in messages.positions(inner)] if messages.is_joint_state(inner) else _flat_keys(value)


def _flat_keys(value: dict[str, Any], prefix: str = "") -> list[str]:
    """Return the keys of all values that are no mappings, in order."""
    found: list[str] = []
    for key, each in value.items():
        found += _flat_keys(each, f"{prefix}{key}.") if type(each) is dict else [prefix + key]
    return found
