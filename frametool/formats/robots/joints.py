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
from frametool.errors import (
    BadAnswer,
    FormatError,
    ValueInvalid,
    alternatives,
    bare,
    did_you_mean,
    first_of,
    listing,
    shown,
    warn,
)
from frametool.formats.detect import detect
from frametool.formats.robots.model import TURNING, Joint, JointValue, Link, followed, read_value
from frametool.formats.rows.csv import split_line
from frametool.formats.table import FORMATS, readers
from frametool.formats.trees.tree_reader import read_time
from frametool.frames.stamps import SUFFIXES, format_stamp, parse_stamp
from frametool.geometry import floats, rigid
from frametool.grammar.edges import Diagnostics, Edge, Options
from frametool.grammar.readers import Misfit, as_mapping, kind
from frametool.ros import messages
from frametool.ros.message_stream import TextMessage, line_texts, read_messages
from frametool.text.numbers import ANGLES, BRACKETS, LENGTHS, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.formats.robots.model import Fail, Value
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path

    Series = Mapping[int, Value]

SLACK = 1e-9  # tolerance of limits: values are printed with fewer digits than they have
HALF_TURN = 3.141592653589793
STATES = "--joint NAME=VALUE"


class JointState:
    """The values of all joints of a robot: one each, or samples over time.

    still, moving: values by name, or by name and stamp
    named: names of the joints with a value; the others follow them, or are at rest

    """

    def __init__(self, joints: Iterable[Joint], options: Options, fail: Fail, *, fixed: Collection[str] = ()) -> None:
        """Read the values in options and files.

        joints: those that move, each name once
        options: `answers` has the values; `tally` collects unknown names, and warnings
        fail: returns the error for the place of a joint
        fixed: names of joints that do not move
        Raises FormatError: an invalid value, a mimic of itself or of a missing joint.
        """
        self.joints = {joint.name: joint for joint in joints}
        self.still: dict[str, Value] = {}
        self.moving: dict[str, Series] = {}
        self._times: dict[str, list[int]] = {}
        self._options = options
        self._fixed = frozenset(fixed)
        self._take_files()
        self._take_options()
        self._tell_limits()
        self.named = frozenset((*self.still, *self.moving))
        self.known = set(self.named)
        self._follow(fail)
        options.tally.robot = self.still, [], [name for name in self.joints if name not in self.known]
        options.tally.assumed = options.tally.assumed or self._about()

    @classmethod
    def of(cls, links: Collection[Link], options: Options, fail: Fail | None = None) -> JointState:
        """Return the joint values for the joints of some links."""
        joints = (joint for link in links for joint in link.joints)
        fail = fail or (lambda joint, problem: FormatError(problem, line=joint.line))
        return cls(joints, options, fail, fixed=[link.fixed for link in links if link.fixed])

    def edges(self, links: Iterable[Link]) -> Iterator[Edge]:
        """Yield one edge per link: static, or a sample at each time at which one of its joints has a value."""
        links = [*links]
        self._options.tally.robot = self.still, links, [name for name in self.joints if name not in self.known]
        for link in links:
            for stamp_ns, values in self.values(*(joint.name for joint in link.joints)):
                yield Edge(link.parent, link.child, link.pose(values), stamp_ns, link.line)

    def values(self, *names: str) -> Iterator[tuple[int | None, list[Value]]]:
        """Yield the values of joints that move one frame together: once without a stamp, or at each of their times.

        A joint without a sample at the time of another one is interpolated.
        """
        if moving := [name for name in names if name in self.moving]:
            for stamp_ns in self._common_times(moving):
                yield stamp_ns, [self._at(name, stamp_ns) for name in names]
        else:
            yield None, [self.still[name] for name in names]

    def _common_times(self, moving: Sequence[str]) -> list[int]:
        """Return the times at which any of some joints has a sample and all are known."""
        begin = max(min(self.moving[name]) for name in moving)
        end = min(max(self.moving[name]) for name in moving)
        if begin > end:
            problem = f"joints {listing(moving)} move one frame and have no time in common"
            files = ", ".join(self._options.answers.joint_files)
            raise FormatError(f"{problem}; their values end at {format_stamp(end)}, or begin later", source=files)
        return sorted({at for name in moving for at in self.moving[name] if begin <= at <= end})

    def _at(self, name: str, stamp_ns: int) -> Value:
        """Return the value of a joint at a time between its first and last sample, or its only value."""
        if name in self.still:
            return self.still[name]
        series = self.moving[name]
        if stamp_ns in series:
            return series[stamp_ns]
        times = self._times.setdefault(name, [*series])
        after = bisect_left(times, stamp_ns)
        begin, end = times[after - 1], times[after]
        return _between(series[begin], series[end], (stamp_ns - begin) / (end - begin))

    def _take_files(self) -> None:
        """Read all files; later ones override earlier ones, and all samples of a file are used."""
        for path in self._options.answers.joint_files:
            found: dict[str, list[tuple[int | None, Value]]] = {}
            setting = None
            for setting in JointFile(path, self.joints).settings():
                if setting.joint in self.joints:
                    found.setdefault(setting.joint, []).append((setting.stamp_ns, self._read(setting)))
                else:
                    problem = unknown_joint(setting.joint, self.joints, self._fixed)
                    self._options.tally.unknown_joints.setdefault(setting.joint, setting.refuse(problem, ()))
            if setting is None:
                raise FormatError("no values of joints in it", source=path)
            for name, values in found.items():
                self._take(name, values)

    def _read(self, setting: JointSample) -> Value:
        normalize = self._options.normalize
        try:
            return read_value(self.joints[setting.joint], setting.value, setting.source, normalize=normalize)
        except Misfit as misfit:
            raise setting.refuse(str(misfit), misfit.path) from None
        except ValueInvalid as error:
            raise setting.refuse(str(error), ()) from None

    def _take(self, name: str, values: Sequence[tuple[int | None, Value]]) -> None:
        """Store the samples of one joint; constant ones are a single value, and without times the last counts."""
        self.still.pop(name, None)
        self.moving.pop(name, None)
        series = {stamp_ns: value for stamp_ns, value in values if stamp_ns is not None}
        last = values[-1][1]
        if any(stamp_ns is None for stamp_ns, _ in values) or all(value == last for value in series.values()):
            self.still[name] = last
        else:
            self.moving[name] = dict(sorted(series.items()))

    def _take_options(self) -> None:
        """Read the values of `--joint`, which override files."""
        for name, text in self._options.answers.joints.items():
            joint = self.joints.get(name)
            if joint is None:
                problem = unknown_joint(name, self.joints, self._fixed)
                self._options.tally.unknown_joints[name] = BadAnswer(f"--joint: {problem}")
                continue
            try:
                source = Source(f"--joint {name}={text}", text)
                value = read_value(joint, text, source, normalize=self._options.normalize)
            except ValueInvalid as error:
                raise BadAnswer(f"--joint {shown(name)}: {error}") from None
            self._take(name, [(None, value)])

    def _follow(self, fail: Fail) -> None:
        """Set each joint without a value: from its leader, along chains of any length, or at rest."""
        for name in self.joints:
            chain = {name: None}
            last = name
            while (leader := self._leader(last, fail)) is not None:
                if leader in chain:
                    circle = [*chain][[*chain].index(leader) :][:8]
                    drawn = " -> ".join(map(shown, [*circle, leader]))
                    raise fail(self.joints[leader], f"joints mimic each other in a circle: {drawn}")
                chain[leader] = None
                last = leader
            for follower in reversed(chain):
                self._settle(self.joints[follower])

    def _leader(self, name: str, fail: Fail) -> str | None:
        """Return the joint that determines one without a value."""
        mimic = self.joints[name].mimic
        if name in self.still or name in self.moving or mimic is None or mimic.joint in self._fixed:
            return None
        leader = self.joints.get(mimic.joint)
        if leader is None or leader.posed:
            which = "no joint" if leader is None else leader.kind
            raise fail(self.joints[name], f"joint {shown(name)} mimics {shown(mimic.joint)}, which is {which}")
        return mimic.joint

    def _settle(self, joint: Joint) -> None:
        """Compute the value of a joint whose leader has one."""
        name, mimic = joint.name, joint.mimic
        if name in self.still or name in self.moving:
            return
        leader = mimic.joint if mimic else ""
        if leader in self.moving:
            self.moving[name] = {at: followed(joint, value) for at, value in self.moving[leader].items()}
        elif leader in self.still:
            self.still[name] = followed(joint, self.still[leader])
        else:
            self.still[name] = followed(joint, JointValue(0.0)) if mimic else joint.start
        if leader in self.known:
            self.known.add(name)

    def _tell_limits(self) -> None:
        """Record values beyond limits, and steps that a pose cannot follow."""
        for name in (*self.still, *self.moving):
            joint, tally = self.joints[name], self._options.tally
            series = self.moving.get(name) or {0: self.still[name]}
            values = [value.plain for value in series.values() if isinstance(value, JointValue)]
            if joint.lower is not None and joint.upper is not None and joint.lower <= joint.upper:
                beyond = [value for value in values if not joint.lower - SLACK <= value <= joint.upper + SLACK]
                if beyond:
                    tally.note(_about_limits(joint, beyond, len(values)), joint.line, "limit")
            steps = zip(series, values, values[1:], strict=False) if joint.kind == "revolute" else ()
            if wide := next((at for at, one, two in steps if abs(two - one) >= HALF_TURN), None):
                far = f"joint {shown(name)} turns by half a turn or more in the step from {format_stamp(wide)}"
                tally.note(f"{far}; poses between go the shorter way", joint.line)

    def _about(self) -> str:
        """Return how many joints are at rest because no value was set."""
        free = [joint for joint in self.joints.values() if joint.name not in self.known]
        if not free:
            return ""
        at_zero = all(joint.posed or self.still[joint.name] == JointValue(0.0) for joint in free)
        many = f"{len(free)} joint{'s' * (len(free) > 1)}"
        return f"{many} at {'0' if at_zero else 'rest'} ({STATES})"


def _about_limits(joint: Joint, beyond: Sequence[float], count: int) -> str:
    """Return the warning that values of a joint are beyond its limits."""
    unit = "rad" if joint.kind in TURNING else "m"
    limits = f"its limits {joint.lower:g} .. {joint.upper:g} {unit}"
    samples = f" in {len(beyond)} of {count} samples, first" if count > 1 else ","
    return f"joint {shown(joint.name)} is beyond {limits}{samples} {beyond[0]:g}"


def _between(one: Value, two: Value, fraction: float) -> Value:
    """Interpolate the value of a joint between two samples: linearly, and by slerp for a pose."""
    if not (isinstance(one, JointValue) and isinstance(two, JointValue)):
        begin, end = cast("Rigid", one), cast("Rigid", two)
        return rigid.interpolate(*begin, *end, fraction, floats)
    if one.degrees == two.degrees:
        return JointValue(one.number + (two.number - one.number) * fraction, one.degrees)
    return JointValue(one.plain + (two.plain - one.plain) * fraction)


_HOLDERS = ("joint", "joints", "position", "positions", "joint_positions")  # before a dot
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
        column = _joint_column(place, name, joints)
        if column is None:
            continue
        if column.joint in found:
            first = names[found[column.joint].place]
            raise ValueInvalid(f"columns {shown(first)} and {shown(name)} are both joint {shown(column.joint)}")
        found[column.joint] = column
    return list(found.values())


def _joint_column(place: int, name: str, joints: Mapping[str, Joint]) -> JointColumn | None:
    bare_name, unit = _with_unit(name.lstrip("#% ").strip(), joints)
    joint = joints.get(bare_name)
    if joint is None:
        return None
    if joint.posed:
        raise ValueInvalid(f"column {shown(name)}: joint {shown(joint.name)} is {joint.kind}, which no number says")
    turns = joint.kind in TURNING
    if unit and unit not in (ANGLES if turns else LENGTHS):
        units = ("rad", "deg") if turns else tuple(filter(None, LENGTHS))
        raise ValueInvalid(f"column {shown(name)}: joint {shown(joint.name)} is {joint.kind}; units: {listing(units)}")
    return JointColumn(place, bare_name, ANGLES.get(unit, False), 1.0 if turns else LENGTHS[unit])


def _with_unit(name: str, joints: Mapping[str, Joint]) -> tuple[str, str]:
    """Split a column's name into a joint and a unit; a joint's own name is not split."""
    if name in joints:
        return name, ""
    holder, dot, rest = name.partition(".")
    if dot and holder in _HOLDERS:
        return _with_unit(rest, joints)
    match = re.search(BRACKETS, name) or _UNIT.search(name)
    return (name[: match.start()], match[1]) if match else (name, "")


def stamp_column(names: Sequence[str], joints: Mapping[str, Joint]) -> tuple[int, str] | None:
    """Return the index of the column of stamps and the unit in its name, if any; None if there is none."""
    from frametool.grammar import names as known

    place = known.stamp_column("" if name.strip() in joints else name.strip() for name in names)
    return None if place is None else (place, SUFFIXES.get(known.in_nanoseconds(names[place].strip()), ""))


def misspelt(names: Sequence[str], joints: Mapping[str, Joint]) -> str:
    """Return the error for the first column whose name resembles a joint that no other column has."""
    held = {column.joint for column in find_joint_columns(names, joints)}
    for name in names:
        bare_name = _with_unit(name.strip(), joints)[0]
        if bare_name not in joints and (near := did_you_mean(bare_name, [*joints.keys() - held], cutoff=0.8)):
            return f"column {shown(name)} is not a joint{near}"
    return ""


DELIMITERS = {"tsv": "\t", "semicolon": ";"}  # of tables other than CSV


class JointSample(NamedTuple):
    """One value of a joint in a file: its text, and its stamp; `refuse` returns the error for its place."""

    joint: str
    value: Any
    stamp_ns: int | None
    refuse: Callable[[str, Path], FormatError]
    source: Source


class JointFile:
    """One file of joint values, and the joints that it may contain."""

    def __init__(self, path: str, joints: Mapping[str, Joint]) -> None:
        """Open a file, or FILE:STATE for a named state; raises FileProblem."""
        file, colon, state = path.rpartition(":")
        has_state = colon and file and not os.path.exists(path) and os.path.exists(file)
        self.path, self.state = (file, state) if has_state else (path, "")
        self.joints = joints
        self.tally = Diagnostics()
        self.file = InputFile(self.path)

    def settings(self) -> Iterator[JointSample]:
        """Yield the values in the order of the file, and close it.

        Raises FormatError.
        """
        try:
            yield from self._settings()
        finally:
            self.file.close()
        for note in self.tally.findings():
            warn(f"{self.file.name}:{note.line}: {note.message}")

    def _settings(self) -> Iterator[JointSample]:
        head = self.file.head()
        name = self.file.name
        fmt = detect(head, "joints", "records", "rows", name=self.path, otherwise="yaml")[0]
        if "joints" in FORMATS[fmt].reads:
            yield from import_module(FORMATS[fmt].reader).read_joints(self.file, self.state)
        elif self.state:
            having = " and ".join(readers("joints"))
            raise FormatError(f"has no states with names; {having} files do", source=name)
        elif head.lstrip().startswith(b"<"):
            raise FormatError("this XML has no values of joints; maps, JointState messages, CSV have", source=name)
        elif "rows" in FORMATS[fmt].reads:
            yield from self._table(fmt, head.decode("utf-8", "replace"))
        else:
            yield from self._messages(read_messages(self.file.stream, name, "echo", self.tally))

    def _messages(
        self, messages: Iterable[TextMessage | FormatError], state_of: Callable[[Any], Any] | None = None
    ) -> Iterator[JointSample]:
        """Yield the values in documents or rows; `state_of` makes a JointState of a row."""
        for message in messages:
            if isinstance(message, FormatError):
                raise message
            try:
                yield from self._values(state_of(message.value) if state_of else message.value, (), message)
            except Misfit as misfit:
                raise message.error(misfit) from None

    def _values(self, value: Any, path: Path, message: TextMessage) -> Iterator[JointSample]:
        """Yield the values in a plain value: a JointState, a map, or a list of either."""
        if type(value) is list:
            for index, each in enumerate(value):
                yield from self._values(each, (*path, index), message)
        elif type(value) is dict and messages.is_envelope(value):
            yield from self._values(value["msg"], (*path, "msg"), message)
        else:
            try:
                mapping = as_mapping(value, "a map of joints, or a JointState")
                if not messages.is_joint_state(mapping):
                    yield from self._map(mapping, path, message)
                    return
                stamp_ns = messages.stamp_of_state(mapping)
                for joint, position, place in messages.positions(mapping):
                    refuse = partial(_refused, message, (*path, *place))
                    yield JointSample(joint, _finite(position, place), stamp_ns, refuse, message.source)
            except Misfit as misfit:
                raise misfit.below(*path) from None

    def _map(self, mapping: dict[str, Any], path: Path, message: TextMessage) -> Iterator[JointSample]:
        """Yield the values of a map, or of the only map in it, as under `joints:`."""
        from frametool.grammar.names import STAMP_KEYS

        times = [key for key in STAMP_KEYS if key in mapping and key not in self.joints]
        stamp_ns = read_time(mapping, times[0], " like 12.5") if times else None
        keys = [key for key in mapping if key not in times]
        if len(keys) == 1 and keys[0] not in self.joints and type(mapping[keys[0]]) is dict:
            path, mapping = (*path, keys[0]), mapping[keys[0]]
            keys = list(mapping)
        for key in keys:
            yield JointSample(key, mapping[key], stamp_ns, partial(_refused, message, (*path, key)), message.source)

    def _table(self, fmt: str, head: str) -> Iterator[JointSample]:
        """Yield the values of a table: one column per joint, or the output of the echo tools."""
        first = next((line for line in head.split("\n") if line.strip()), "")
        name = self.file.name
        if first.startswith("%time,"):
            rows = read_messages(self.file.stream, name, "csv1", self.tally)
            yield from self._messages(rows, messages.of_numbered)
        elif messages.looks_like_row(first):
            texts = line_texts(self.file.stream, name, self.tally)
            rows = (TextMessage(text, Source(name, text), line, cells=True) for line, text in texts)
            yield from self._messages(rows, lambda row: messages.of_row(messages.unquoted(row)))
        else:
            yield from self._columns(fmt)

    def _cells(self, fmt: str, line: str) -> list[str]:
        if fmt == "csv":
            return [cell.text for cell in split_line(line)]
        return [cell.strip().strip('"') for cell in line.split(DELIMITERS.get(fmt))]

    def _columns(self, fmt: str) -> Iterator[JointSample]:
        """Yield the values of a table whose header names joints."""
        rows = line_texts(self.file.stream, self.file.name, self.tally)
        number, header = next(rows, (1, ""))
        names = self._cells(fmt, header.strip("\r\ufeff"))
        try:
            columns = find_joint_columns(names, self.joints)
            if not columns:
                named = first_of(names, 20, quote=bare)
                raise ValueInvalid(f"no column is a joint; columns: {named}; joints: {listing(self.joints)}")
            if problem := misspelt(names, self.joints):
                raise ValueInvalid(problem)
        except ValueInvalid as error:
            raise FormatError(str(error), source=self.file.name, line=number) from None
        stamp = stamp_column(names, self.joints)
        used = {column.place for column in columns} | {stamp[0] if stamp else -1}
        if others := [name for place, name in enumerate(names) if place not in used]:
            warn(f"{self.file.name}:{number}: columns that are no joints were left out: {listing(others)}")
        source = Source(self.file.name, "")
        for number, line in rows:
            if line.lstrip().startswith("#"):
                continue
            cells = self._cells(fmt, line.rstrip("\r"))

            def refuse(problem: str, _below: Path, line: int = number) -> FormatError:
                return FormatError(problem, source=self.file.name, line=line)

            if len(cells) != len(names):
                raise refuse(f"expected {len(names)} cells, found {len(cells)}", ())
            at = ""
            try:
                if stamp:
                    at = names[stamp[0]]
                    stamp_ns = parse_stamp(cells[stamp[0]] + stamp[1])
                for place, joint, degrees, per_metre in columns:
                    at = names[place]
                    value = JointValue(parse_number(cells[place]) / per_metre, degrees)
                    yield JointSample(joint, value, stamp_ns if stamp else None, refuse, source)
            except ValueInvalid as error:
                raise refuse(f"{at}: {error}", ()) from None


def _finite(value: Any, path: Path) -> JointValue:
    """Read a position in a message: radians or metres, without units."""
    try:
        if type(value) is not str:
            raise ValueInvalid(f"expected a number, found {kind(value)}")
        return JointValue(parse_number(value))
    except ValueInvalid as error:
        raise Misfit(str(error), path, rule=error.rule) from None


def _refused(message: TextMessage, path: Path, problem: str, below: Path) -> FormatError:
    return message.error(Misfit(problem, (*path, *below)))


def unknown_joint(joint: str, joints: Mapping[str, Joint], fixed: frozenset[str]) -> str:
    """Return the error that a robot has no such joint, or that it is fixed."""
    if joint in fixed:
        return f"joint {shown(joint)} is fixed and takes no value; joints: {listing(joints)}"
    return f"no joint {shown(joint)}{alternatives(joint, joints, 'joints')}"
