"""Joint values of a robot, at one time or over time, from options and files; by default at rest.

    {shoulder: 30deg, gripper: 2cm, base: {xyz: [1, 0, 0]}}          with `stamp`, one sample of many
    {name: [shoulder, gripper], position: [0.5, 0.02]}               JointState, of either ROS, one or many
    t,shoulder_deg,elbow [deg],finger (mm)                           a table; without stamps its last row is used
    scene.xml:ready                                                  a key of MJCF

A joint that mimics another follows it, also in chains; only a value of its own overrides that.  Each value keeps its
place in the file; its meaning depends on the joint.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_left
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from frametool.documents.source import InputFile, Source
from frametool.errors import BadAnswer, FormatError, ValueInvalid, alternatives, did_you_mean, listing, shown, warn
from frametool.formats.detect import detect
from frametool.formats.robots.model import TURNING, Joint, JointValue, Link, followed, leaders_first, read_value
from frametool.formats.rows.csv import split_line
from frametool.formats.table import FORMATS, readers
from frametool.formats.trees.tree_reader import read_time
from frametool.frames.stamps import SUFFIXES, format_stamp, parse_stamp
from frametool.geometry import floats, rigid
from frametool.grammar.edges import Diagnostics, Edge, Options
from frametool.grammar.readers import STAMP_KEYS, Misfit, Path, as_mapping, in_nanoseconds, stamp_column
from frametool.ros import messages
from frametool.ros.message_stream import TextMessage, line_texts, read_messages
from frametool.text.numbers import ANGLES, BRACKETS, LENGTHS, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.formats.robots.model import Value
    from frametool.geometry import Rigid

    Series = Mapping[int | None, Value]

SLACK = 1e-9  # tolerance of limits: values are printed with fewer digits than they have
HALF_TURN = 3.141592653589793


class JointState:
    """The values of all joints of a robot, constant or sampled over time.

    series: name -> stamp -> value; a constant value has the single stamp None
    named: names of the joints with a value from options or files; the others mimic these, or are at rest
    """

    def __init__(self, joints: Iterable[Joint], options: Options, file: str, *, fixed: Collection[str] = ()) -> None:
        """Read the values in options and files.

        joints: those that move, each name once
        options: `answers` has the values; `tally` collects unknown names, and warnings
        file: name of the file of the robot
        fixed: names of joints that do not move
        Raises FormatError: an invalid value, a mimic of itself or of a missing joint.
        """
        self.joints = {joint.name: joint for joint in joints}
        self.series: dict[str, Series] = {}
        self._options = options
        self._fixed = frozenset(fixed)
        self._file = file
        for path in options.answers.joint_files:  # later ones override earlier ones
            self._take_file(path)
        for name, text in options.answers.joints.items():  # which override files
            joint = self.joints.get(name)
            if joint is None:
                options.tally.unknown_joints[name] = BadAnswer(f"--joint: {self._unknown(name)}")
                continue
            try:
                source = Source(f"--joint {name}={text}", text)
                self.series[name] = {None: read_value(joint, text, source, normalize=options.normalize)}
            except ValueInvalid as error:
                raise BadAnswer(f"--joint {shown(name)}: {error}") from None
        self._tell_limits()
        self.named = frozenset(self.series)
        self._free = free = self._follow()
        options.tally.robot = self.still, [], free
        if free and not options.tally.assumed:
            at_zero = all(self.joints[name].posed or self.series[name] == {None: JointValue(0.0)} for name in free)
            many = f"{len(free)} joint{'s' * (len(free) > 1)}"
            options.tally.assumed = f"{many} at {'0' if at_zero else 'rest'} (--joint NAME=VALUE)"

    @classmethod
    def of(cls, links: Collection[Link], options: Options, file: str) -> JointState:
        """Return the joint values for the joints of some links."""
        joints = (joint for link in links for joint in link.joints)
        return cls(joints, options, file, fixed=[link.fixed for link in links if link.fixed])

    @property
    def still(self) -> dict[str, Value]:
        """Return the values of joints that are constant, by name."""
        return {name: series[None] for name, series in self.series.items() if None in series}

    @property
    def moving(self) -> list[str]:
        """Return the names of joints with samples over time."""
        return [name for name, series in self.series.items() if None not in series]

    def edges(self, links: Iterable[Link]) -> Iterator[Edge]:
        """Yield one edge per link: static, or a sample at each time at which one of its joints has a value."""
        links = [*links]
        self._options.tally.robot = self.still, links, self._free
        for link in links:
            for stamp_ns, values in self.values(*(joint.name for joint in link.joints)):
                yield Edge(link.parent, link.child, link.pose(values), stamp_ns, link.line)

    def values(self, *names: str) -> Iterator[tuple[int | None, list[Value]]]:
        """Yield the values of joints that move one frame together: once with stamp None, or at each time of any.

        A joint without a sample at a time of another one is interpolated, within the time that they share.
        """
        times = {name: [at for at in self.series[name] if at is not None] for name in names}
        moving = {name: series for name, series in times.items() if series}
        if not moving:
            yield None, [self.series[name][None] for name in names]
            return
        begin, end = max(each[0] for each in moving.values()), min(each[-1] for each in moving.values())
        if begin > end:
            problem = f"joints {listing(moving)} move one frame and have no time in common"
            files = ", ".join(self._options.answers.joint_files)
            raise FormatError(f"{problem}; their values end at {format_stamp(end)}, or begin later", source=files)
        for stamp_ns in sorted({at for each in moving.values() for at in each if begin <= at <= end}):
            yield stamp_ns, [self._at(name, stamp_ns, times[name]) for name in names]

    def _at(self, name: str, stamp_ns: int, times: Sequence[int]) -> Value:
        """Return the value of a joint at a time between its first and last sample, or its only value.

        It is interpolated linearly, a pose by slerp.
        """
        series = self.series[name]
        if not times or stamp_ns in series:
            return series[stamp_ns if times else None]
        after = bisect_left(times, stamp_ns)
        begin, end = times[after - 1], times[after]
        one, two, fraction = series[begin], series[end], (stamp_ns - begin) / (end - begin)
        if not (isinstance(one, JointValue) and isinstance(two, JointValue)):
            return rigid.interpolate(*cast("Rigid", one), *cast("Rigid", two), fraction, floats)
        if one.degrees == two.degrees:
            return JointValue(one.number + (two.number - one.number) * fraction, one.degrees)
        return JointValue(one.plain + (two.plain - one.plain) * fraction)

    def _take_file(self, path: str) -> None:
        """Read all values of a file; equal values of a joint are a constant, without times the last one is used."""
        found: dict[str, list[tuple[int | None, Value]]] = {}
        sample = None
        for sample in read_joint_file(path, self.joints):
            joint = self.joints.get(sample.joint)
            if joint is None:
                error = sample.refuse(self._unknown(sample.joint), ())
                self._options.tally.unknown_joints.setdefault(sample.joint, error)
                continue
            try:
                value = read_value(joint, sample.value, Source(path, ""), normalize=self._options.normalize)
            except ValueInvalid as error:
                raise sample.refuse(str(error), getattr(error, "path", ())) from None
            found.setdefault(sample.joint, []).append((sample.stamp_ns, value))
        if sample is None:
            raise FormatError("no values of joints in it", source=path)
        for name, values in found.items():
            series, last = dict(values), values[-1][1]
            is_constant = None in series or all(value == last for value in series.values())
            in_order = sorted(series.items(), key=lambda each: each[0] or 0)
            self.series[name] = {None: last} if is_constant else dict(in_order)

    def _unknown(self, joint: str) -> str:
        """Return the message that the robot has no such joint, or that it is fixed."""
        if joint in self._fixed:
            return f"joint {shown(joint)} is fixed and takes no value; joints: {listing(self.joints)}"
        return f"no joint {shown(joint)}{alternatives(joint, self.joints, 'joints')}"

    def _follow(self) -> list[str]:
        """Set each joint without a value: from the joint it mimics, along chains of any length, or at rest.

        Returns the names of the joints that no value determines.
        """
        known = set(self.named)
        for name, leader in leaders_first(self.joints, self.joints, self.named, self._file).items():
            joint = self.joints[name]
            if leader and not self.joints[leader].posed:
                self.series[name] = {at: followed(joint, value) for at, value in self.series[leader].items()}
                if leader in known:
                    known.add(name)
            elif name not in self.named:
                if joint.mimic and joint.mimic.joint not in self._fixed:
                    which = self.joints[leader].kind if leader else "no joint"
                    problem = f"joint {shown(name)} mimics {shown(joint.mimic.joint)}, which is {which}"
                    raise FormatError(problem, source=self._file, line=joint.line)
                self.series[name] = {None: joint.start}
        return [name for name in self.joints if name not in known]

    def _tell_limits(self) -> None:
        """Record warnings: values beyond limits, and steps of half a turn or more, whose direction is ambiguous."""
        for name, series in self.series.items():
            joint, tally = self.joints[name], self._options.tally
            values = [value.plain for value in series.values() if isinstance(value, JointValue)]
            if joint.lower is not None and joint.upper is not None and joint.lower <= joint.upper:
                lower, upper = joint.lower - SLACK, joint.upper + SLACK
                if beyond := [value for value in values if not lower <= value <= upper]:
                    limits = f"{joint.lower:g} .. {joint.upper:g} {'rad' if joint.kind in TURNING else 'm'}"
                    tally.note(f"joint {shown(name)} is beyond its limits {limits}, {beyond[0]:g}", joint.line, "limit")
            steps = zip(series, values, values[1:], strict=False) if joint.kind == "revolute" else ()
            for wide in [at for at, one, two in steps if abs(two - one) >= HALF_TURN][:1]:
                far = f"joint {shown(name)} turns by half a turn or more in the step from {format_stamp(wide or 0)}"
                tally.note(f"{far}; poses between go the shorter way", joint.line)


_HOLDERS = ("joint", "joints", "position", "positions", "joint_positions")  # prefixes of column names, before a dot
_UNIT = re.compile(rf"_({'|'.join((*ANGLES, *filter(None, LENGTHS)))})$")


class JointColumn(NamedTuple):
    """A column with the value of a joint: radians or metres, unless its name states degrees or another unit.

    per_metre: its units per metre
    """

    place: int
    joint: str
    degrees: bool = False
    per_metre: float = 1.0


def find_joint_columns(names: Sequence[str], joints: Mapping[str, Joint]) -> list[JointColumn]:
    """Return the columns with names of joints, one per joint.

    Raises ValueInvalid: an impossible unit, two columns for one joint, a joint whose value is a pose.
    """
    found: dict[str, JointColumn] = {}
    for place, name in enumerate(names):
        own, unit = _with_unit(name.lstrip("#% ").strip(), joints)
        joint = joints.get(own)
        if joint is None:
            continue
        problem = f"column {shown(name)}: joint {shown(own)} is {joint.kind}"
        if joint.posed:
            raise ValueInvalid(f"{problem}, which no number says")
        turns = joint.kind in TURNING
        if unit and unit not in (ANGLES if turns else LENGTHS):
            units = ("rad", "deg") if turns else tuple(filter(None, LENGTHS))
            raise ValueInvalid(f"{problem}; units: {listing(units)}")
        if own in found:
            first = names[found[own].place]
            raise ValueInvalid(f"columns {shown(first)} and {shown(name)} are both joint {shown(own)}")
        found[own] = JointColumn(place, own, ANGLES.get(unit, False), 1.0 if turns else LENGTHS[unit])
    return list(found.values())


def _with_unit(name: str, joints: Mapping[str, Joint]) -> tuple[str, str]:
    """Split a column's name into a joint and a unit; a joint's own name is not split."""
    if name in joints:
        return name, ""
    holder, dot, rest = name.partition(".")
    if dot and holder in _HOLDERS:
        return _with_unit(rest, joints)
    match = re.search(BRACKETS, name) or _UNIT.search(name)
    return (name[: match.start()], match[1]) if match else (name, "")


class JointSample(NamedTuple):
    """One value of a joint in a file: its text, and its stamp; `refuse` returns the error for its place."""

    joint: str
    value: Any
    stamp_ns: int | None
    refuse: Callable[[str, Path], FormatError]


def read_joint_file(path: str, joints: Mapping[str, Joint]) -> Iterator[JointSample]:
    """Yield the values in a file, in its order; `path` may be FILE:STATE for a named state.

    joints: those of the robot, which columns and keys may name
    Raises FileProblem, FormatError.
    """
    whole, colon, state = path.rpartition(":")
    has_state = colon and whole and not os.path.exists(path) and os.path.exists(whole)
    path, state = (whole, state) if has_state else (path, "")
    file, tally = InputFile(path), Diagnostics()
    try:
        head = file.head()
        fmt = detect(head, "joints", "records", "rows", name=path, otherwise="yaml")
        if "joints" in FORMATS[fmt].reads:
            yield from import_module(FORMATS[fmt].reader).read_joints(file, state)
        elif state:
            having = " and ".join(readers("joints"))
            raise file.error(f"has no states with names; {having} files do")
        elif head.lstrip().startswith(b"<"):
            raise file.error("this XML has no values of joints; maps, JointState messages, CSV have")
        elif "rows" in FORMATS[fmt].reads:
            yield from _of_table(file, fmt, joints, tally)
        else:
            for message in read_messages(file.stream, file.name, tally):
                if isinstance(message, FormatError):
                    raise message
                try:
                    yield from _of_value(message.value, (), message, joints)
                except Misfit as misfit:
                    raise message.error(misfit) from None
    finally:
        file.close()
    for note in tally.findings():
        warn(f"{file.name}:{note.line}: {note.message}")


def _of_value(value: Any, path: Path, message: TextMessage, joints: Mapping[str, Joint]) -> Iterator[JointSample]:
    """Yield the joint values in a YAML or JSON value: a JointState message, a map, or a list of these.

    A map of joints may be below a single key.
    """
    if type(value) is list:
        for index, each in enumerate(value):
            yield from _of_value(each, (*path, index), message, joints)
    elif type(value) is dict and messages.is_envelope(value):
        yield from _of_value(value["msg"], (*path, "msg"), message, joints)
    else:
        try:
            mapping = as_mapping(value, "a map of joints, or a JointState")
            if messages.is_joint_state(mapping):
                stamp_ns = messages.header_stamp(mapping.get("header"))
                for joint, position, place in messages.positions(mapping):
                    yield JointSample(joint, position, stamp_ns, partial(_refused, message, (*path, *place)))
                return
            times = [key for key in STAMP_KEYS if key in mapping and key not in joints]
            stamp_ns = read_time(mapping, times[0], " like 12.5") if times else None
        except Misfit as misfit:
            raise misfit.below(*path) from None
        keys = [key for key in mapping if key not in times]
        if len(keys) == 1 and keys[0] not in joints and type(mapping[keys[0]]) is dict:
            path, mapping = (*path, keys[0]), mapping[keys[0]]
            keys = list(mapping)
        for key in keys:
            yield JointSample(key, mapping[key], stamp_ns, partial(_refused, message, (*path, key)))


def _of_table(file: InputFile, fmt: str, joints: Mapping[str, Joint], tally: Diagnostics) -> Iterator[JointSample]:
    """Yield the values of a table whose header names joints."""
    rows = line_texts(file.stream, file.name, tally)
    first, header = next(rows, (1, ""))
    names = _cells(fmt, header.strip("\r\ufeff"))
    try:
        columns = find_joint_columns(names, joints)
        if not columns:
            raise ValueInvalid(f"no column is a joint; columns: {listing(names)}; joints: {listing(joints)}")
        without = joints.keys() - {column.joint for column in columns}
        for name in names:
            own = _with_unit(name.strip(), joints)[0]
            if own not in joints and (near := did_you_mean(own, [*without], cutoff=0.8)):
                raise ValueInvalid(f"column {shown(name)} is not a joint{near}")
    except ValueInvalid as error:
        raise file.error(str(error), first) from None
    times = stamp_column("" if name.strip() in joints else name.strip() for name in names)
    unit = "" if times is None else SUFFIXES.get(in_nanoseconds(names[times].strip()), "")
    used = {times, *(column.place for column in columns)}
    if others := [name for place, name in enumerate(names) if place not in used]:
        warn(f"{file.name}:{first}: columns that are no joints were left out: {listing(others)}")
    stamp_ns, at = None, ""
    for number, line in rows:
        if line.lstrip().startswith("#"):
            continue
        cells = _cells(fmt, line.rstrip("\r"))

        def refuse(problem: str, _below: Path = (), line: int = number) -> FormatError:
            return file.error(problem, line)

        if len(cells) != len(names):
            raise refuse(f"expected {len(names)} cells, found {len(cells)}")
        try:
            if times is not None:
                at = names[times]
                stamp_ns = parse_stamp(cells[times] + unit)
            for place, joint, degrees, per_metre in columns:
                at = names[place]
                yield JointSample(joint, JointValue(parse_number(cells[place]) / per_metre, degrees), stamp_ns, refuse)
        except ValueInvalid as error:
            raise refuse(f"{at}: {error}") from None


def _cells(fmt: str, line: str) -> list[str]:
    if fmt == "csv":
        return [cell.text for cell in split_line(line)]
    return [cell.strip().strip('"') for cell in line.split(FORMATS[fmt].rows.delimiter or None)]


def _refused(message: TextMessage, path: Path, problem: str, below: Path) -> FormatError:
    return message.error(Misfit(problem, (*path, *below)))
