"""`frametool.explain`: the derivation of an operation, as its command prints it with --explain.

The module also derives one control step of the followers of a run.
"""

from __future__ import annotations

import math
import sys
from bisect import bisect_right
from inspect import signature
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.source import Source
from frametool.errors import ValueInvalid, alternatives, printable, shown
from frametool.explain import derive
from frametool.explain.derive import (
    CLOSE,
    METRES,
    REPORT,
    DerivationWrong,
    WrittenPose,
    explained,
    spans,
)
from frametool.explain.run import DIGITS, Row
from frametool.frames.lookups import Frames
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry.representations import notation, notations
from frametool.geometry.transform import Rotation, Transform
from frametool.grammar.pose import Pose
from frametool.grammar.result import Style
from frametool.rows.derivations import ByTree, derive_record, written_poses
from frametool.rows.request import RowOptions
from frametool.sim.simulate import IssuedCommand, frame_of, simulate
from frametool.sim.turtle import ARRIVED

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.explain.render import Explanation
    from frametool.explain.run import Sheet, Values
    from frametool.sim.scene import Follow, Scene

    Sample = tuple[int, float, float, float]  # the pose of a frame in its parent: stamp in ns, x, y, theta
    Sighting = tuple[int, Sample, Sample | None]  # a time, and the samples around it; only one if it is at that time


class FollowStep(NamedTuple):
    """One control step of a follower.

    own, led: the follower and its leader in the world; carrot: the target in the leader's frame, if it is another frame
    """

    number: int
    command: IssuedCommand
    follow: Follow
    own: Sighting
    led: Sighting
    carrot: Sighting | None


def follow_steps(scene: Scene, number: int) -> list[FollowStep]:
    """Run a scene until its followers have taken a control step, counted from 0; return the step of each.

        frametool.explain("follow", frametool.follow_steps(frametool.tutorial(), 3))

    Raises ValueInvalid if there is no such step, or no command in it.
    """
    followers = scene.followers
    if not followers:
        raise ValueInvalid("nobody follows in this scene")
    rate = min(follow.controller.rate for follow in followers.values())
    last = math.inf if scene.duration_ns is None else int(scene.duration_ns / BILLION * rate + 1e-9)
    if not 0 <= number <= last:
        raise ValueInvalid(f"no control step {number} in this run; steps: 0 .. {last}")
    due = {name: follow.controller.due_ns(number) for name, follow in followers.items()}
    samples: dict[str, list[Sample]] = {}  # turtles in the world, carrots relative to their leader
    reason, found = "", {}
    for step in simulate(scene):
        for stamp_ns, _, child, transform in step.broadcasts:
            x, y, theta, *_ = step.poses.get(child) or (*transform.components[:2], 0.0)
            samples.setdefault(child, []).append((stamp_ns, x, y, theta))
        reason = next((line for line in step.log if line.startswith("Could not transform")), reason)
        for command in step.commands:
            if due.get(command.turtle) != step.t_ns:
                continue
            follow = followers[command.turtle]
            frames = command.turtle, follow.leader, frame_of(follow.leader, follow.target)
            own, led, target = (samples[name] for name in frames)
            own_ns = led_ns = min(own[-1][0], led[-1][0], target[-1][0])
            if follow.delay_ns:
                own_ns, led_ns = own[-1][0], command.t_ns - follow.delay_ns
            carrot = None if target is led else _at(target, led_ns)
            seen = _at(own, own_ns), _at(led, led_ns), carrot
            found[command.turtle] = FollowStep(number, command, follow, *seen)
        if step.t_ns >= max(due.values()):
            break
    if missing := [name for name in followers if name not in found]:
        why = f": {reason}" if reason else ""
        raise ValueInvalid(f"{missing[0]} has no command at step {number}, {format_stamp(due[missing[0]])} s{why}")
    return [found[name] for name in followers]


def _at(samples: Sequence[Sample], at_ns: int) -> Sighting:
    """Return the samples around a time; only one if it is at that time, or the last."""
    after = bisect_right(samples, at_ns, key=itemgetter(0))
    before = samples[max(after - 1, 0)]
    return at_ns, before, None if before[0] == at_ns or after == len(samples) else samples[after]


def derive_follow(style: Style, steps: FollowStep | Sequence[FollowStep]) -> Explanation:
    """Derive the commands of followers at one step; raises ValueInvalid for anything but the steps of followers."""
    found = [steps] if isinstance(steps, FollowStep) else list(steps) if isinstance(steps, (list, tuple)) else []
    if not found or not all(isinstance(each, FollowStep) for each in found):
        raise ValueInvalid(f"expected the steps of follow_steps, found {shown(steps)}")

    def write(sheet: Sheet) -> None:
        rows = []
        for step in found:
            _derive(sheet, step)
            twist, name = step.command.twist, printable(step.command.turtle)
            label = f"{name} " if len(found) > 1 else ""
            rows += [
                Row(f"{label}linear_x", [""], [twist.linear_x], "m/s"),
                Row(f"{label}angular_z", [""], [twist.angular_z], "rad/s"),
                Row(f"{label}distance", [""], [step.command.distance or 0.0], METRES),
            ]
        sheet.result(f"the command of {', '.join(printable(step.command.turtle) for step in found)}", rows)

    return explained(style, f"follow, step {found[0].number}", write)


def _derive(sheet: Sheet, step: FollowStep) -> None:
    """Add the position of the target in the follower's frame, as x and y, and the command for it.

    Raises DerivationWrong if it differs from the follower's command.
    """
    frame = frame_of(step.follow.leader, step.follow.target)
    follower, leader, target = map(printable, (step.command.turtle, step.follow.leader, frame))
    way = f"world_from_{leader}" + (f" @ {leader}_from_{target}" if step.carrot else "")
    words = {"follower": follower, "target": target, "way": way, "t": "t" if step.carrot else "1"}
    sheet.play("follow seen", {}, number=step.number, time=format_stamp(step.command.t_ns)[:-6], **words)
    values: Values = {"carrot": float(step.carrot is not None)}
    _add_place(sheet, values, step.led, leader, "1", turns=step.carrot is not None)
    _add_place(sheet, values, step.own, follower, "2", turns=True)
    if step.carrot:
        _add_place(sheet, values, step.carrot, f"{target} in {leader}", "c", turns=False)
    sheet.play("follow target", values, **words)
    law, (linear, angular, _), distance = step.follow.controller, step.command.twist, step.command.distance or 0.0
    bearing = math.atan2(values["y"], values["x"])
    behind = bearing * angular * law.gain_angular < 0.0 and abs(abs(bearing) - math.pi) < 1e-9
    values |= {"behind": float(behind), "arrived": ARRIVED}
    values |= {"slow": float(law.max_linear < math.inf), "steady": float(law.max_angular < math.inf)}
    constants = {
        "linear": law.gain_linear, "angular": law.gain_angular,
        "max_linear": law.max_linear, "max_angular": law.max_angular,
    }  # fmt: skip
    texts = {name: f"{each:g}" if float(f"{each:g}") == each else repr(each) for name, each in constants.items()}
    sheet.play("follow law", values, follower=follower, **texts)
    near = CLOSE * (1.0 + distance + 1.0 / max(distance, ARRIVED))  # largest for a small distance
    for name, own, gain in (("d", distance, 1.0), ("linear_x", linear, law.gain_linear),
                            ("angular_z", angular, law.gain_angular)):  # fmt: skip
        if not abs(values[name] - own) <= near * max(1.0, abs(gain)):
            raise DerivationWrong(f"the derived {name} is {values[name]!r}, not {own!r}; {REPORT}")


def _add_place(sheet: Sheet, values: Values, seen: Sighting, name: str, index: str, *, turns: bool) -> None:
    """Add the position of a frame: as published, or between two samples."""
    at_ns, first, then = seen
    (begin_ns, *before), (end_ns, *after) = first, then or first
    values |= dict(zip(("ax", "ay", "ah", "bx", "by", "bh"), (*before, *after), strict=True))
    values |= spans(begin_ns, end_ns, at_ns) | {"turns": float(turns), "between": float(then is not None)}
    at, begin, end = map(format_stamp, (at_ns, begin_ns, end_ns))
    sheet.play("follow place", values, name=name, i=index, at=at, begin=begin, end=end)


# --- `frametool.explain` ---

INLINE = "argument"


def explain(
    operation: str, *operands: Any, to: str = "quaternion", precision: int | None = DIGITS, degrees: bool = False,
    keep_sign: bool = False, **options: Any,
) -> Explanation:  # fmt: skip
    """Derive an operation step by step: formula, formula with these numbers, value with its unit.

        print(frametool.explain("convert", {"rpy_deg": [10, 20, 30]}, to="matrix"))
        frametool.explain("lookup", tree, "map", "camera", at_ns=2_500_000_000).markdown()

    operation, operands: convert POSE; compose POSE ..; invert POSE; relative A B; interpolate A B FRACTION;
        lookup TREE TARGET SOURCE (at_ns, source_at_ns, fixed); apply TREE TARGET SOURCE RECORD (at_ns, kind) or apply
        POSE RECORD (kind); follow STEPS of `follow_steps`.  A POSE is a mapping, its text, a Transform or a Rotation.
    to: notations separated by commas.  precision: significant digits, None for all.  degrees: bare angles are in
        degrees, in and out.
    Raises ValueInvalid; also the errors of the operation.
    """
    if operation not in OPERATIONS:
        raise ValueInvalid(f"no operation {shown(operation)}{alternatives(operation, OPERATIONS, 'operations')}")
    if precision is not None and precision < 1:
        raise ValueInvalid(f"precision counts significant digits, 1 or more; found {precision}")
    chosen = tuple(each for spec in to.split(",") for each in notations(spec.strip()))
    style = Style("text", chosen, degrees=degrees, precision=precision, keep_sign=keep_sign)
    derivation, poses = OPERATIONS[operation]
    try:
        signature(derivation).bind(style, *operands, **options)
    except TypeError as error:
        raise ValueInvalid(f"explain {operation}: {error}") from None
    written = [_pose(each, degrees=degrees) for each in operands[:poses]]
    return derivation(style, *written, *operands[poses:], **options)


def _pose(value: Any, *, degrees: bool) -> WrittenPose:
    """Read one pose: a mapping, its text, a Transform or a Rotation.

    Raises ValueInvalid, FormatError.
    """
    if isinstance(value, (str, dict, list)):
        found = written_poses(_source(value), degrees=degrees)
        if len(found) != 1:
            raise ValueInvalid(f"a derivation is of one pose, {INLINE} holds {len(found)}")
        return found[0]
    if not isinstance(value, (Transform, Rotation)) or value.shape:
        raise ValueInvalid(f"expected one pose: a mapping, its text, a Transform or a Rotation; found {value!r:.60}")
    pose = Pose.of(value.components) if isinstance(value, Transform) else Pose(None, value.components)
    x, y, z, *rotation = pose.components
    return WrittenPose(pose, notation("quaternion"), rotation, position=(x, y, z))


def _source(value: Any) -> Source:
    """Return a text, or a mapping or list as text."""
    from frametool.documents.writers import dump_json

    return Source(INLINE, value if isinstance(value, str) else dump_json(value))


def _apply(style: Style, *operands: Any, at_ns: int | None = None, kind: str = "") -> Explanation:
    by_tree = bool(operands) and isinstance(operands[0], Frames)
    if len(operands) not in ((3, 4) if by_tree else (2,)):
        raise ValueInvalid("apply takes TREE TARGET [SOURCE] RECORD, or POSE RECORD")
    degrees = style.degrees
    if by_tree:
        tree, target, *source, record = operands
        way: ByTree | WrittenPose = ByTree(tree, target, source[0] if source else None, at_ns)
    else:
        pose, record = operands
        way = _pose(pose, degrees=degrees)
    if not isinstance(record, (str, dict)):
        try:
            x, y, z = map(float, record)
        except (TypeError, ValueError):
            raise ValueInvalid(f"expected three numbers or a mapping, found {shown(record)}") from None
        record = {kind or "point": [x, y, z]}
    return derive_record(style, way, _source(record), RowOptions(kind=kind, degrees=degrees))


OPERATIONS: dict[str, tuple[Callable[..., Explanation], int]] = {  # derivation, number of first operands that are poses
    "convert": (derive.convert, 1), "compose": (derive.compose, sys.maxsize), "invert": (derive.invert, 1),
    "relative": (derive.relative, 2), "interpolate": (derive.interpolate, 2), "lookup": (derive.lookup, 0),
    "apply": (_apply, 0), "follow": (derive_follow, 0),
}  # fmt: skip
