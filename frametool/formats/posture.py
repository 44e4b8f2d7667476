"""Where the joints of one robot stand, at one time or over time: as told by options and files, else at rest.

A joint that mimics another follows it, in chains too; only its own name overrides that.
"""

from __future__ import annotations

from bisect import bisect_left
from typing import TYPE_CHECKING, cast

from frametool.documents.source import Source
from frametool.errors import BadAnswer, FormatError, ValueInvalid, listing, shown
from frametool.formats.joints import IDENTITY, TURNING, JointValue, followed, motion, read_value
from frametool.frames.stamps import format_stamp
from frametool.geometry import floats, rigid
from frametool.grammar.edges import Edge
from frametool.grammar.readers import Misfit, Note

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.formats.joint_files import Setting
    from frametool.formats.joints import Joint, Value
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options

    Series = Mapping[int, Value]
    Fail = Callable[[Joint, str], FormatError]

SLACK = 1e-9  # by which a value may lie beyond a limit: printed with fewer digits than it has
HALF_TURN = 3.141592653589793
STATES = "--joint NAME=VALUE"


class Posture:
    """The values of all joints of a robot: one each, or samples over time.

    still, moving: values by name, or by name and stamp
    given: names of the joints told of; the others follow them, or are at rest
    """

    def __init__(self, joints: Iterable[Joint], options: Options, fail: Fail, *, fixed: Collection[str] = ()) -> None:
        """Take what options and files say.

        joints: those that move, each name once
        options: `answers` holds what was told; `tally` takes the names nobody here has, and what is odd
        fail: makes the error for the place of a joint
        fixed: names of joints that do not move
        Raises FormatError: a value that is none, mimics in a circle or of no joint.
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
        self.given = frozenset((*self.still, *self.moving))
        self.told = set(self.given)
        self._follow(fail)
        options.tally.has_joints = True
        options.tally.about = options.tally.about or self._about()

    def edges(self, parent: str, child: str, origin: Rigid, joint: str, line: int = 0) -> Iterator[Edge]:
        """Yield the edge across one joint: for good, or a sample at each time; `origin` is the pose at rest."""
        for stamp_ns, (moved,) in self.motions(joint):
            pose = origin if moved is IDENTITY else rigid.compose(*origin, *moved)
            yield Edge(parent, child, pose, stamp_ns, line)

    def motions(self, *names: str) -> Iterator[tuple[int | None, tuple[Rigid, ...]]]:
        """Yield what joints do together to the frames behind them: once without a stamp, or at each of their times.

        A joint without a sample at the time of another one is interpolated.
        """
        joints = [self.joints[name] for name in names]
        moving = [name for name in names if name in self.moving]
        if not moving:
            yield None, tuple(motion(joint, self.still[joint.name]) for joint in joints)
            return
        for stamp_ns in self._common_times(moving):
            yield stamp_ns, tuple(motion(joint, self._at(joint.name, stamp_ns)) for joint in joints)

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
        """Return the value of a joint at a time between its first and last sample, or the one it has always."""
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
        """Read all files; the later one counts, and of one file all its samples."""
        if not self._options.answers.joint_files:
            return
        from frametool.formats.joint_files import JointFile, unknown_joint

        for path in self._options.answers.joint_files:
            found: dict[str, list[tuple[int | None, Value]]] = {}
            setting = None
            for setting in JointFile(path, self.joints).settings():
                if setting.joint in self.joints:
                    found.setdefault(setting.joint, []).append((setting.stamp_ns, self._read(setting)))
                elif setting.loose and (setting.joint in self._fixed or type(setting.value) is dict):
                    message = f"{path}: joint {shown(setting.joint)} does not move in the robot; its value is left out"
                    self._options.tally.note(Note("odd", message, ()), 1)
                else:
                    problem = unknown_joint(setting.joint, self.joints, self._fixed)
                    self._options.tally.unknown_joints.setdefault(setting.joint, setting.refuse(problem, ()))
            if setting is None:
                raise FormatError("no values of joints in it", source=path)
            for name, values in found.items():
                self._take(name, values)

    def _read(self, setting: Setting) -> Value:
        normalize = self._options.normalize
        try:
            return read_value(self.joints[setting.joint], setting.value, setting.source, normalize=normalize)
        except Misfit as misfit:
            raise setting.refuse(str(misfit), misfit.path) from None
        except ValueInvalid as error:
            raise setting.refuse(str(error), ()) from None

    def _take(self, name: str, values: Sequence[tuple[int | None, Value]]) -> None:
        """Keep the samples of one joint; one that stays where it is stands still, and without times the last counts."""
        self.still.pop(name, None)
        self.moving.pop(name, None)
        series = {stamp_ns: value for stamp_ns, value in values if stamp_ns is not None}
        last = values[-1][1]
        if any(stamp_ns is None for stamp_ns, _ in values) or all(value == last for value in series.values()):
            self.still[name] = last
        else:
            self.moving[name] = dict(sorted(series.items()))

    def _take_options(self) -> None:
        """Read what `--joint` says; it wins over files."""
        from frametool.formats.joint_files import unknown_joint

        for name, text in self._options.answers.joints.items():
            place = f"--joint {name}={text}"
            joint = self.joints.get(name)
            if joint is None:
                problem = unknown_joint(name, self.joints, self._fixed)
                self._options.tally.unknown_joints[name] = BadAnswer(f"--joint: {problem}")
                continue
            try:
                value = read_value(joint, text, Source(place, text), normalize=self._options.normalize)
            except ValueInvalid as error:
                raise BadAnswer(f"--joint {shown(name)}: {error}") from None
            self._take(name, [(None, value)])

    def _follow(self, fail: Fail) -> None:
        """Settle each joint that nobody told of: at its leader's value, along chains of any length, or at rest."""
        for name, joint in self.joints.items():
            if joint.mimic is None:
                if name not in self.given:
                    self.still[name] = joint.start
                continue
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
        """Return the joint that decides over one which is not settled yet."""
        mimic = self.joints[name].mimic
        if name in self.still or name in self.moving or mimic is None:
            return None
        if mimic.joint in self._fixed:
            return None
        if mimic.joint not in self.joints:
            raise fail(self.joints[name], f"joint {shown(name)} mimics {shown(mimic.joint)}, which is no joint")
        if self.joints[mimic.joint].posed:
            kind = self.joints[mimic.joint].kind
            raise fail(self.joints[name], f"joint {shown(name)} mimics {shown(mimic.joint)}, which is {kind}")
        return mimic.joint

    def _settle(self, joint: Joint) -> None:
        """Find the value of a joint whose leader has one."""
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
        if leader in self.told:
            self.told.add(name)

    def _tell_limits(self) -> None:
        """Note the values told that lie beyond limits, and steps that a pose cannot follow."""
        for name in (*self.still, *self.moving):
            joint = self.joints[name]
            series = self.moving.get(name) or {0: self.still[name]}
            values = [value.plain for value in series.values() if isinstance(value, JointValue)]
            if joint.lower is not None and joint.upper is not None and joint.lower <= joint.upper:
                beyond = [value for value in values if not joint.lower - SLACK <= value <= joint.upper + SLACK]
                if beyond:
                    self._note("limit", _about_limits(joint, beyond, len(values)), joint)
            steps = zip(series, values, values[1:], strict=False) if joint.kind == "revolute" else ()
            if wide := next((at for at, one, two in steps if abs(two - one) >= HALF_TURN), None):
                far = f"joint {shown(name)} turns by half a turn or more in the step from {format_stamp(wide)}"
                self._note("odd", f"{far}; poses between go the shorter way", joint)

    def _note(self, rule: str, message: str, joint: Joint) -> None:
        self._options.tally.note(Note(rule, message, ()), joint.line)

    def _about(self) -> str:
        """Say how many joints stand where nobody said."""
        free = [joint for joint in self.joints.values() if joint.name not in self.told]
        if not free:
            return ""
        at_zero = all(joint.posed or self.still[joint.name] == JointValue(0.0) for joint in free)
        many = f"{len(free)} joint{'s' * (len(free) > 1)}"
        return f"{many} at {'0' if at_zero else 'rest'} ({STATES})"


def _about_limits(joint: Joint, beyond: Sequence[float], count: int) -> str:
    """Say that values of a joint lie beyond its limits."""
    unit = "rad" if joint.kind in TURNING else "m"
    limits = f"its limits {joint.lower:g} .. {joint.upper:g} {unit}"
    samples = f" in {len(beyond)} of {count} samples, first" if count > 1 else ","
    return f"joint {shown(joint.name)} is beyond {limits}{samples} {beyond[0]:g}"


def _between(one: Value, two: Value, fraction: float) -> Value:
    """Return the value of a joint between two samples: on the line, and by slerp where it is a pose."""
    if not (isinstance(one, JointValue) and isinstance(two, JointValue)):
        begin, end = cast("Rigid", one), cast("Rigid", two)
        return rigid.interpolate(*begin, *end, fraction, floats)
    if one.degrees == two.degrees:
        return JointValue(one.number + (two.number - one.number) * fraction, one.degrees)
    return JointValue(one.plain + (two.plain - one.plain) * fraction)
