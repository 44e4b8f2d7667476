"""SweepResult followers at once against the same ones one by one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from frametool.errors import ValueInvalid
from frametool.sim.drivers import FollowController
from frametool.sim.scene import tutorial
from frametool.sim.simulate import RunSummary, simulate
from frametool.sim.sweep import simulate_many
from frametool.sim.turtle import CENTRE

if TYPE_CHECKING:
    from conftest import Sizes


@pytest.mark.parametrize("law", ["ros1", "ros2"])
@pytest.mark.parametrize("leader", ["circle", "random"])
def test_many_followers_are_each_what_one_alone_is(law: str, leader: str) -> None:
    generator = np.random.default_rng(3)
    spawn = generator.uniform((0.0, 0.0, -3.0), (11.0, 11.0, 3.0), size=(6, 3))
    gains = generator.uniform(0.3, 3.0, size=6)
    many = simulate_many(leader, spawn=spawn, law=law, gain_linear=gains, max_angular=2.0, duration=8.0)
    for index in range(6):
        controller = FollowController(law, gain_linear=gains[index], max_angular=2.0)
        scene = tutorial(leader=leader, law=controller, spawn=tuple(spawn[index].tolist()), duration=8.0)
        progress, last = RunSummary(scene), None
        for step in simulate(scene):
            progress.watch(step)
            last = step if step.is_tick else last
        assert last is not None
        assert [many.x[index], many.y[index], many.theta[index]] == pytest.approx(last.states["turtle2"], abs=1e-9)
        assert many.distance[index] == pytest.approx(progress.distances["turtle2"], abs=1e-9)
        reached = progress.reached_ns.get("turtle2", math.nan) / 1e9
        assert many.time_to_reach[index] == pytest.approx(reached, nan_ok=True)
        assert many.wall_hits[index] == progress.walls.get("turtle2", 0)


def test_shapes_broadcast_and_blocks_do_not_show(sizes: Sizes) -> None:
    spawn = np.broadcast_to([4.0, 2.0, 0.0], (3, 1, 3))
    whole = simulate_many(spawn=spawn, gain_linear=[0.5, 1.0], duration=3.0)
    sizes(followers=4)
    parts = simulate_many(spawn=spawn, gain_linear=[0.5, 1.0], duration=3.0)
    assert whole.x.shape == (3, 2)
    assert all(np.array_equal(one, two, equal_nan=True) for one, two in zip(whole, parts, strict=True))


def test_a_higher_gain_is_there_sooner() -> None:
    times = simulate_many(gain_linear=[0.5, 1.0, 2.0]).time_to_reach
    assert np.all(np.diff(times) < 0.0)


def test_overshoot_is_what_is_lost_again_and_nan_where_never_reached() -> None:
    many = simulate_many("still", law="ros2", spawn=[2.0, CENTRE, 0.0], gain_linear=[0.01, 0.5, 1.5])
    assert math.isnan(many.overshoot[0])
    assert many.overshoot[1] == pytest.approx(0.0, abs=1e-6)
    assert many.overshoot[2] > (CENTRE - 2.0) / 2.0 - 0.05  # 1.5 times the way in the first second, then a wide turn


def test_overshoot_is_measured_as_one_follower_shows_it() -> None:
    law = FollowController(gain_linear=0.5)
    steps = simulate(tutorial(leader="circle", law=law, duration=10.0))
    distances = [step.states["turtle2"].distance(step.states["turtle1"]) for step in steps if step.is_tick]
    after = distances[next(at for at, each in enumerate(distances) if each <= 1.2) :]
    expected = max(each - min(after[: at + 1]) for at, each in enumerate(after))
    many = simulate_many("circle", gain_linear=0.5, duration=10.0, reach=1.2)
    assert many.overshoot == pytest.approx(expected, abs=1e-9)


def test_nobody_is_nobody() -> None:
    assert simulate_many(spawn=np.empty((0, 3)), duration=0.1).x.shape == (0,)


@pytest.mark.parametrize(
    "wrong",
    [{"spawn": [1.0, 2.0]}, {"spawn": [1.0, 2.0, math.nan]}, {"gain_linear": [1.0, math.nan]}, {"max_linear": -1.0},
     {"gain_angular": math.inf}, {"rate": 0.0}, {"duration": math.inf}, {"leader": "nobody"}],
)  # fmt: skip
def test_what_one_follower_refuses_many_refuse(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueInvalid):
        simulate_many(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("gains", [{"gain_linear": 1e308}, {"gain_angular": -1.7e308}])
def test_a_gain_that_gives_no_finite_velocity_is_refused_by_both(gains: dict[str, float]) -> None:
    with pytest.raises(ValueInvalid, match=r"gain_linear .* give no finite velocity at 3\.86632"):
        simulate_many(**gains)  # type: ignore[arg-type]
    with pytest.raises(ValueInvalid, match=r"^turtle2: gain_linear .* give no finite velocity at 3\.86632"):
        list(simulate(tutorial(law=FollowController(**gains))))  # type: ignore[arg-type]


def test_a_limit_makes_any_gain_possible() -> None:
    assert np.isfinite(simulate_many(gain_linear=1e308, max_linear=2.0, duration=1.0).distance)
