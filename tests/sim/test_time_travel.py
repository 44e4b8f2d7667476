"""`--delay S`: what a follower sees is where its target was S seconds before now, not before its own last pose.

The oracle has no tf: it keeps the published float32 poses of every tick, looks between the two around `now - S`, and moves
turtles by turtlesim's rules, written down again.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from frametool.sim.scene import tutorial
from frametool.sim.simulate import IssuedCommand, simulate
from frametool.sim.turtle import Twist, scripted

MILLISECOND = 1_000_000
SCRIPT = json.loads((Path(__file__).parents[1] / "golden" / "turtle_follow.json").read_text())["leader"]
H = float(np.float32(499 / 45))
PI = 3.14159265


class Place(NamedTuple):
    """What a turtle published at a tick."""

    x: float
    y: float
    theta: float


class OracleTurtle:
    """A turtle and all that it has published."""

    def __init__(self, x: float, y: float, theta: float) -> None:
        self.x, self.down, self.theta = x, float(np.float32(H - y)), theta
        self.linear = self.angular = 0.0
        self.commanded = 0
        self.inbox: tuple[float, float] | None = None
        self.published: list[Place] = []

    def publish(self) -> None:
        """Publish as float32."""
        self.published.append(Place(*(float(np.float32(each)) for each in (self.x, H - self.down, self.theta))))

    def update(self, now: int) -> None:
        """Advance one tick at `now` milliseconds."""
        if self.inbox:
            (self.linear, self.angular), self.commanded, self.inbox = self.inbox, now, None
        if now - self.commanded > 1000:
            self.linear = self.angular = 0.0
        turned = self.theta + self.angular * 0.016
        self.theta = turned - 2 * PI * math.floor((turned + PI) / (2 * PI))
        self.x = min(max(self.x + math.cos(self.theta) * self.linear * 0.016, 0.0), H)
        self.down = min(max(self.down - math.sin(self.theta) * self.linear * 0.016, 0.0), H)

    def was_at(self, when: float) -> Place | None:
        """Return where tf puts the turtle at a time in milliseconds; None where it would have to extrapolate."""
        if not 0.0 <= when <= 16 * (len(self.published) - 1):
            return None
        index, part = int(when // 16), (when % 16) / 16
        before, after = self.published[index], self.published[min(index + 1, len(self.published) - 1)]
        turn = math.remainder(after.theta - before.theta, 2 * math.pi)
        return Place(
            before.x + part * (after.x - before.x), before.y + part * (after.y - before.y), before.theta + part * turn
        )


def followed(delay: float, period: int, duration: int) -> list[tuple[int, float, float]]:
    """Return milliseconds, linear and angular of every command of turtle2 behind the golden leader."""
    leader, follower = OracleTurtle(H / 2, H / 2, 0.0), OracleTurtle(4.0, 2.0, 0.0)
    script = {t: (linear, angular) for t, linear, angular in SCRIPT}
    commands = []
    for now in range(duration + 1):
        if now % 16 == 0:
            for turtle in (leader, follower):
                if now:
                    turtle.update(now)
                turtle.publish()
        leader.inbox = script.get(now, leader.inbox)
        if now % period == 0 and (seen := leader.was_at(now - delay)):
            own = follower.published[-1]
            across, up = seen.x - own.x, seen.y - own.y
            bearing = math.remainder(math.atan2(up, across) - own.theta, 2 * math.pi)
            follower.inbox = 0.5 * math.hypot(across, up), 4.0 * bearing
            commands.append((now, *follower.inbox))
    return commands


def issued(**options: float) -> list[IssuedCommand]:
    """Return the commands of turtle2 behind the golden leader."""
    leader = scripted([(t * MILLISECOND, Twist(linear, angular)) for t, linear, angular in SCRIPT])
    steps = simulate(tutorial(leader=leader, **options))  # type: ignore[arg-type]
    return [command for step in steps for command in step.commands]


@pytest.mark.parametrize("delay", [5.0, 2.5, 0.7, 0.05, 0.005, 12.0])
def test_a_delayed_follower_does_what_the_rules_say_tick_by_tick(delay: float) -> None:
    rows = [(each.t_ns // MILLISECOND, *each.twist[:2]) for each in issued(delay=delay)]
    expected = followed(delay * 1000, 100, 20_000)
    assert [row[0] for row in rows] == [row[0] for row in expected]
    assert rows == [pytest.approx(row, abs=1e-5) for row in expected]


@pytest.mark.parametrize("delay", [5.0, 0.7])
def test_the_first_command_comes_when_the_target_has_been_there_for_the_delay(delay: float) -> None:
    first = issued(delay=delay)[0]
    assert first.t_ns == round(delay * 1e9)
    assert first.twist[:2] == pytest.approx((1.933158, 4.639467), abs=1e-6)


@pytest.mark.parametrize("target", ["carrot", "moving-carrot"])
def test_a_carrot_is_looked_up_at_the_past_time_too(target: str) -> None:
    steps = simulate(tutorial(target=target, delay=5.0, duration=5.0))
    first = next(command for step in steps for command in step.commands)
    away = 2.0 if target == "carrot" else 10.0  # where it was at time 0
    assert first.t_ns == 5_000 * MILLISECOND
    assert first.distance == pytest.approx(math.hypot(H / 2 - 4, H / 2 + away - 2))
