"""The derivation of one step of a follower: where its target is seen, and the command that follows from it.

Takes the numbers of the step; `frametool.sim.followed` collects them from a run.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import printable
from frametool.explain.chain import spans
from frametool.explain.derive import CLOSE, METRES, RADIANS, REPORT, DerivationStyle, DerivationWrong, explained, row
from frametool.frames.stamps import format_stamp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.render import Explanation
    from frametool.explain.run import Sheet, Values


class PlanarSample(NamedTuple):
    """Where a frame was in its parent: stamp, metres, radians."""

    stamp_ns: int
    x: float
    y: float
    theta: float = 0.0


class Sighting(NamedTuple):
    """Where a frame is taken to be: at a time, between two samples or at the first of them."""

    at_ns: int
    before: PlanarSample
    after: PlanarSample | None = None


class FollowStep(NamedTuple):
    """What happened in one control step of a follower.

    number, t_ns: which step, and when
    follower, leader, target: names of frames; the target is the leader or hangs on it
    own, led: where the two turtles were in the world; carrot: where the target was in the leader's frame
    gains: linear and angular, 1/s; limits: m/s and rad/s, inf for none
    arrived: the distance below which the follower stands still, in metres
    distance, linear, angular: what the follower saw, in metres, and its command, in m/s and rad/s
    """

    number: int
    t_ns: int
    follower: str
    leader: str
    target: str
    own: Sighting
    led: Sighting
    carrot: Sighting | None
    gains: tuple[float, float]
    limits: tuple[float, float]
    arrived: float
    distance: float
    linear: float
    angular: float


def derive_follow(plan: DerivationStyle, steps: Sequence[FollowStep]) -> Explanation:
    """Derive the commands of followers at one step."""

    def write(sheet: Sheet) -> None:
        rows = []
        for step in steps:
            _law(sheet, step, _seen(sheet, step))
            label = f"{printable(step.follower)} " if len(steps) > 1 else ""
            command = {"linear_x": (step.linear, "m/s"), "angular_z": (step.angular, "rad/s")}
            for name, (value, unit) in (command | {"distance": (step.distance, METRES)}).items():
                rows.append(row(label + name, [""], [value], unit))
        sheet.result(f"the command of {', '.join(printable(step.follower) for step in steps)}", rows)

    return explained(plan, f"follow, step {steps[0].number}", write)


def _seen(sheet: Sheet, step: FollowStep) -> Values:
    """Add where the target is in the follower's frame, as x and y."""
    follower, leader, target = map(printable, (step.follower, step.leader, step.target))
    way = f"world_from_{leader}" + (f" @ {leader}_from_{target}" if step.carrot else "")
    words = {"follower": follower, "target": target, "way": way, "t": "t" if step.carrot else "1"}
    sheet.play("follow seen", {}, number=step.number, time=format_stamp(step.t_ns)[:-6], **words)
    values: Values = {"carrot": float(step.carrot is not None)}
    _place(sheet, values, step.led, leader, "1", turns=step.carrot is not None)
    _place(sheet, values, step.own, follower, "2", turns=True)
    if step.carrot:
        _place(sheet, values, step.carrot, f"{target} in {leader}", "c", turns=False)
    return sheet.play("follow target", values, **words)


def _place(sheet: Sheet, values: Values, seen: Sighting, name: str, index: str, *, turns: bool) -> None:
    """Add where a frame was: as published, or between two samples."""
    before, after, at = seen.before, seen.after, format_stamp(seen.at_ns)
    if after is None:
        values |= dict(zip((f"x{index}", f"y{index}", f"h{index}"), before[1 : 3 + turns], strict=False))
        texts = [f"{letter}{index} {sheet.number(values[letter + index])} {unit}" for letter, unit in
                 (("x", METRES), ("y", METRES), ("h", RADIANS))[: 2 + turns]]  # fmt: skip
        sheet.say(f"{name} at {at} s: {', '.join(texts)}")
        return
    values |= dict(zip(("ax", "ay", "ah", "bx", "by", "bh"), (*before[1:], *after[1:]), strict=True))
    values |= spans(before.stamp_ns, after.stamp_ns, seen.at_ns) | {"turns": float(turns)}
    begin, end = format_stamp(before.stamp_ns), format_stamp(after.stamp_ns)
    sheet.play("follow between", values, name=name, i=index, at=at, begin=begin, end=end)


def _law(sheet: Sheet, step: FollowStep, values: Values) -> None:
    """Add the command of a target at x, y, and compare it with the follower's."""
    bearing = math.atan2(values["y"], values["x"])
    behind = bearing * step.angular * step.gains[1] < 0.0 and abs(abs(bearing) - math.pi) < 1e-9
    values |= {"behind": float(behind), "arrived": step.arrived}
    values |= {"slow": float(step.limits[0] < math.inf), "steady": float(step.limits[1] < math.inf)}
    names = ("linear", "angular", "max_linear", "max_angular")
    words = dict(zip(names, map(_text, step.gains + step.limits), strict=True))
    sheet.play("follow law", values, follower=printable(step.follower), **words)
    _compare(step, values["d"], values["linear_x"], values["angular_z"])


def _text(value: float) -> str:
    """Write a constant of a formula: short where that is exact."""
    return f"{value:g}" if float(f"{value:g}") == value else repr(value)


def _compare(step: FollowStep, distance: float, linear: float, angular: float) -> None:
    """Compare with what the follower did; raises DerivationWrong."""
    near = CLOSE * (1.0 + step.distance + 1.0 / max(step.distance, step.arrived))  # a bearing is the worse, the nearer
    for found, own, gain in zip(
        (distance, linear, angular), (step.distance, step.linear, step.angular), (1.0, *step.gains), strict=True
    ):
        if not abs(found - own) <= near * max(1.0, abs(gain)):
            raise DerivationWrong(f"the derivation of {step.follower} gives {found!r}, not {own!r}; {REPORT}")
