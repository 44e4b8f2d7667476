"""The derivation of one step of a follower: where its target is seen, and the command that follows from it.

Takes the numbers of the step; `frametool.sim.followed` collects them from a run.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import printable
from frametool.explain.chain import fraction
from frametool.explain.derive import CLOSE, REPORT, DerivationStyle, DerivationWrong, explained, row
from frametool.explain.sheet import METRES, RADIANS
from frametool.frames.stamps import format_stamp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.render import Explanation
    from frametool.explain.sheet import Sheet, Values

CUT = "The target is straight behind: y is 0 to rounding, and its last bit decides which way round the follower turns."


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
    sheet.heading(f"Step {step.number}, {format_stamp(step.t_ns)[:-6]} s: {target} seen from {follower}")
    way = f"world_from_{leader}" + (f" @ {leader}_from_{target}" if step.carrot else "")
    sheet.say(
        f"{follower}_from_{target} = (world_from_{follower})^-1 @ {way}; in the plane: the difference, turned back by "
        f"the heading h of {follower}."
    )
    values: Values = {}
    _place(sheet, values, step.led, leader, "1", turns=step.carrot is not None)
    _place(sheet, values, step.own, follower, "2", turns=True)
    x, y = "x1", "y1"
    if step.carrot:
        _place(sheet, values, step.carrot, f"{target} in {leader}", "c", turns=False)
        x, y = "xt", "yt"
        sheet.say(f"{target} in the world:")
        sheet.step(values, x, "x1 + cos(h1)*xc - sin(h1)*yc", METRES)
        sheet.step(values, y, "y1 + sin(h1)*xc + cos(h1)*yc", METRES)
    sheet.step(values, "x", f"cos(h2)*({x} - x2) + sin(h2)*({y} - y2)", METRES)
    sheet.step(values, "y", f"cos(h2)*({y} - y2) - sin(h2)*({x} - x2)", METRES)
    return values


def _place(sheet: Sheet, values: Values, seen: Sighting, name: str, index: str, *, turns: bool) -> None:
    """Add where a frame was: as published, or between two samples."""
    before, after = seen.before, seen.after
    if after is None:
        parts = [("x", before.x, METRES), ("y", before.y, METRES), ("h", before.theta, RADIANS)][: 2 + turns]
        values.update({letter + index: value for letter, value, _ in parts})
        texts = [f"{letter}{index} {sheet.number(value)} {unit}" for letter, value, unit in parts]
        sheet.say(f"{name} at {format_stamp(seen.at_ns)} s: {', '.join(texts)}")
        return
    sheet.say(f"{name}, a before and b after:")
    found = {
        "ax": before.x, "ay": before.y, "ah": before.theta, "bx": after.x, "by": after.y, "bh": after.theta,
        "f": fraction(sheet, before.stamp_ns, after.stamp_ns, seen.at_ns),
    }  # fmt: skip
    for letter in "xy":
        values[letter + index] = sheet.step(found, letter + index, f"a{letter} + f*(b{letter} - a{letter})", METRES)
    if turns:
        values[f"h{index}"] = sheet.step(found, f"h{index}", "ah + f*atan2(sin(bh - ah), cos(bh - ah))", RADIANS)


def _law(sheet: Sheet, step: FollowStep, values: Values) -> None:
    """Add the command of a target at x, y, and compare it with the follower's."""
    sheet.heading(f"The command of {printable(step.follower)}")
    distance = sheet.step(values, "d", "sqrt(x**2 + y**2)", METRES)
    if distance < step.arrived:
        sheet.say(f"Nearer than {step.arrived:g} m: arrived. The bearing is rounding noise there; the follower stands.")
        _compare(step, distance, 0.0, 0.0)
        return
    bearing = math.atan2(values["y"], values["x"])
    behind = bearing * step.angular * step.gains[1] < 0.0 and abs(abs(bearing) - math.pi) < 1e-9
    if behind:
        sheet.caveat(CUT)
    sheet.step(values, "bearing", "-atan2(y, x)" if behind else "atan2(y, x)", RADIANS)
    linear = _command(sheet, values, ("linear_x", "d", "m/s"), step.gains[0], step.limits[0])
    angular = _command(sheet, values, ("angular_z", "bearing", "rad/s"), step.gains[1], step.limits[1])
    sheet.caveat(
        f"{_text(step.gains[0])} and {_text(step.gains[1])} are gains with the unit 1/s: so much of the distance, and "
        "of the bearing, in a second."
    )
    _compare(step, distance, linear, angular)


def _command(sheet: Sheet, values: Values, names: tuple[str, str, str], gain: float, limit: float) -> float:
    """Add a gain times what is seen, and the limit if there is one."""
    name, seen, unit = names
    if limit == math.inf:
        return sheet.step(values, name, f"{_text(gain)}*{seen}", unit)
    sheet.step(values, name[0], f"{_text(gain)}*{seen}", unit)
    sheet.say(f"Limited to {_text(limit)} {unit} either way:")
    return sheet.step(values, name, f"max(-{_text(limit)}, min({_text(limit)}, {name[0]}))", unit)


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
