"""turtlesim and turtle-follow against recorded numbers.

Source: tests/golden/turtle_follow.json and turtlesim_dynamics.json, made by turtlesim's rules with lookups by the real
tf2 0.7.6, and checked there against the real node to 2.6e-7.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from frametool.sim.scene import tutorial
from frametool.sim.simulate import SimulationStep, simulate
from frametool.sim.turtle import SIZE, FollowController, Twist, scripted

GOLDEN = Path(__file__).parents[1] / "golden"
FOLLOW = json.loads((GOLDEN / "turtle_follow.json").read_text())
DYNAMICS = json.loads((GOLDEN / "turtlesim_dynamics.json").read_text())
MILLISECOND = 1_000_000
TRACES = {trace["name"]: trace for trace in FOLLOW["traces"]}
SCENARIOS = {scenario["name"]: scenario for scenario in DYNAMICS["scenarios"]}


@pytest.fixture(scope="module")
def runs() -> dict[str, list[SimulationStep]]:
    """Run every trace once."""
    return {name: list(simulate(scene_of(trace))) for name, trace in TRACES.items()}


def scene_of(trace: dict[str, Any]) -> Any:
    """Return the scene of a trace."""
    law = FollowController(
        rate=1000.0 / trace["period_ms"], gain_linear=trace["gain_linear"], gain_angular=trace["gain_angular"]
    )
    leader = scripted([(t * MILLISECOND, Twist(ahead, turning)) for t, ahead, turning in FOLLOW["leader"]])
    return tutorial(leader=leader, law=law, spawn=tuple(trace["spawn"]))


def walls(steps: list[SimulationStep]) -> list[tuple[float, float, float]]:
    """Return time and place of every wall hit."""
    return [(step.t_ns / 1e9, hit.place.x, hit.place.y) for step in steps for hit in step.walls]


def recorded_walls(warnings: list[list[Any]]) -> list[Any]:
    """Read turtlesim's warnings; its y runs down from the top."""
    found = [(t, *map(float, re.findall(r"[xy]=([-\d.]+)", text))) for t, text in warnings]
    return [pytest.approx((t, x, SIZE - y), abs=1e-6) for t, x, y in found]


@pytest.mark.parametrize("name", TRACES)
def test_commands_and_states_are_those_of_the_recorded_trace(name: str, runs: dict[str, list[SimulationStep]]) -> None:
    commands = [command for step in runs[name] for command in step.commands]
    rows = [
        [each.t_ns / MILLISECOND, each.twist.linear_x, each.twist.angular_z, *(each.leader or ()), *each.state]
        for each in commands
    ]
    assert rows == [pytest.approx(row, abs=1e-9) for row in TRACES[name]["steps"]]


@pytest.mark.parametrize("name", TRACES)
def test_walls_are_hit_at_the_recorded_ticks(name: str, runs: dict[str, list[SimulationStep]]) -> None:
    assert walls(runs[name]) == recorded_walls(TRACES[name]["walls"])


def test_poses_are_the_recorded_float32_ones_at_every_tick(runs: dict[str, list[SimulationStep]]) -> None:
    steps = [step for step in runs["ros1_spawn_4_2"] if step.is_tick and step.t_ns]
    rows = [[step.t_ns / MILLISECOND, *step.poses["turtle1"], *step.poses["turtle2"]] for step in steps]
    assert rows == [pytest.approx(row, abs=1e-6) for row in TRACES["ros1_spawn_4_2"]["ticks"]]


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_turtle_moves_as_recorded(name: str) -> None:
    recorded = SCENARIOS[name]
    script = [(t * MILLISECOND, Twist(ahead, turning, aside)) for t, _, ahead, aside, turning in recorded["events"]]
    scene = tutorial(leader=scripted(script), followers=0, duration=recorded["final"][0] / 1000.0)
    steps = list(simulate(scene))
    poses = {step.t_ns // MILLISECOND: step.poses["turtle1"] for step in steps if step.is_tick}
    rows = [*recorded["rows"], recorded["final"]]
    assert [tuple(poses[row[0]]) for row in rows] == [pytest.approx(tuple(row[1:]), abs=1e-6) for row in rows]
    assert sum(any(pose[3:]) for pose in poses.values()) == recorded["moving_ticks"]
    assert walls(steps) == recorded_walls(recorded["walls"])
