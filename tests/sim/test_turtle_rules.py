"""turtlesim's rules one by one, and what the follower does at the edges."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from frametool.errors import ValueInvalid
from frametool.sim.scene import Follow, Scene, SceneTurtle, ServiceCall, tutorial
from frametool.sim.simulate import RunSummary, Simulation, SimulationStep, simulate
from frametool.sim.turtle import (
    CENTRE,
    LAWS,
    LEADERS,
    SIZE,
    TICK_NS,
    TIMEOUT_NS,
    FollowController,
    Heading,
    ServiceRefused,
    Turtle,
    TurtleState,
    Twist,
    World,
    arriving,
    scripted,
    single,
    typed_commands,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

SECOND = 1_000_000_000


def walked(turtle: Turtle, ticks: int, begin: int = 1) -> Turtle:
    """Advance a turtle by some ticks."""
    for tick in range(begin, begin + ticks):
        turtle.update(tick * TICK_NS)
    return turtle


def test_one_up_key_moves_the_turtle_63_ticks() -> None:
    turtle = Turtle()
    turtle.command(Twist(2.0, 0.0))
    xs = [walked(turtle, 1, tick).pose.x for tick in range(1, 126)]
    assert xs[62] == xs[-1] == pytest.approx(7.560444, abs=1e-6)
    assert xs[61] < xs[62]


def test_the_last_of_several_commands_wins() -> None:
    turtle = Turtle()
    turtle.command(Twist(-2.0, 0.0))
    turtle.command(Twist(0.0, 1.0))
    assert walked(turtle, 1).pose[3:] == (0.0, 1.0)


def test_speed_has_no_sign() -> None:
    turtle = Turtle()
    turtle.command(Twist(-3.0, 0.0, 4.0))
    assert walked(turtle, 1).pose.linear_velocity == 5.0


@pytest.mark.parametrize("theta", [3.5, -3.5, 100.0, -math.pi])
def test_headings_are_wrapped_below_pi(theta: float) -> None:
    wrapped = walked(Turtle(theta=theta), 1).state.theta
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped - theta) == pytest.approx(1.0)


def test_only_a_holonomic_turtle_goes_sideways() -> None:
    states = []
    for holonomic in (True, False):
        turtle = Turtle(holonomic=holonomic)
        turtle.command(Twist(0.0, 0.0, 1.0))
        states.append(walked(turtle, 1).state.y - CENTRE)
    assert states == [pytest.approx(0.016), 0.0]


def test_spawn_arguments_are_float32() -> None:
    assert Turtle(0.1, 0.2, 0.3).state == pytest.approx((single(0.1), single(0.2), single(0.3)), abs=1e-6)
    assert Turtle(0.1).state.x == 0.10000000149011612


def test_a_turtle_spawned_outside_is_put_to_the_wall_at_its_first_tick() -> None:
    turtle = Turtle(-1.0, 20.0)
    assert turtle.update(TICK_NS) == pytest.approx((-1.0, 20.0, 0.0))
    assert turtle.state == (0.0, SIZE, 0.0)
    assert turtle.update(2 * TICK_NS) is None


def test_velocity_is_not_zeroed_at_the_wall() -> None:
    turtle = Turtle(11.0)
    turtle.command(Twist(2.0, 0.0))
    assert [turtle.update(tick * TICK_NS) is not None for tick in range(1, 6)] == [False, False, True, True, True]


def test_teleports_act_in_order_before_the_motion_of_the_same_tick() -> None:
    turtle = Turtle()
    turtle.command(Twist(1.0, 0.0))
    turtle.teleport_absolute(2.0, 3.0, 0.0)
    turtle.teleport_relative(1.0, math.pi / 2.0)
    assert walked(turtle, 1).state == pytest.approx((2.0, 4.016, math.pi / 2.0), abs=1e-6)


def test_teleporting_above_the_world_stops_at_its_top() -> None:
    turtle = Turtle()
    turtle.teleport_absolute(1.0, 50.0, 0.0)
    assert turtle.update(TICK_NS) is None
    assert turtle.state.y == SIZE


def test_rotate_absolute_turns_at_one_radian_a_second_and_ends_within_its_tolerance() -> None:
    turtle = Turtle()
    turtle.rotate_absolute(-1.0)
    assert walked(turtle, 10).pose.angular_velocity == -1.0
    assert walked(turtle, 90, 11).state.theta == pytest.approx(-1.0, abs=0.02)
    assert turtle.pose.angular_velocity == 0.0


def test_a_command_aborts_rotate_absolute() -> None:
    turtle = Turtle()
    turtle.rotate_absolute(1.0)
    walked(turtle, 5)
    turtle.command(Twist(0.0, -1.0))
    assert walked(turtle, 5, 6).pose.angular_velocity == -1.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
def test_a_command_that_is_not_finite_is_refused(bad: float, place: int) -> None:
    with pytest.raises(ValueInvalid, match="must be finite"):
        Twist(*(bad if index == place else 0.0 for index in range(3)))


@pytest.mark.parametrize("huge", [1e300, -1.7e308])
def test_a_huge_command_ends_at_the_wall(huge: float) -> None:
    turtle = Turtle()
    turtle.command(Twist(huge, 0.0, huge))
    assert turtle.update(TICK_NS) is not None
    assert {turtle.state.x, turtle.state.y} <= {0.0, SIZE}


def test_unnamed_turtles_get_the_next_free_number() -> None:
    world = World()
    names = [world.spawn(), world.spawn(name="turtle2"), world.spawn(), world.spawn(name="a"), world.spawn()]
    assert names == ["turtle1", "turtle2", "turtle3", "a", "turtle4"]


@pytest.mark.parametrize(("variant", "word"), [("ros1", "turtled"), ("ros2", "turtle")])
def test_a_taken_name_is_refused_in_turtlesims_words(variant: str, word: str) -> None:
    world = World(variant)
    world.spawn()
    with pytest.raises(ServiceRefused, match=rf"^A {word} named \[turtle1\] already exists$"):
        world.call("spawn", x=1.0, y=1.0, name="turtle1")


def test_killing_who_is_not_there_is_refused_in_turtlesims_words() -> None:
    with pytest.raises(ServiceRefused, match=r"^Tried to kill turtle \[ghost\], which does not exist$"):
        World().call("kill", name="ghost")


def test_reset_leaves_turtle1_in_the_centre() -> None:
    world = World()
    for _ in range(3):
        world.spawn(1.0, 1.0)
    world.call("reset")
    assert [(name, turtle.state) for name, turtle in world.turtles.items()] == [("turtle1", TurtleState(CENTRE, CENTRE, 0.0))]
    assert world.spawn() == "turtle2"


def test_spawning_is_logged_as_turtlesim_logs_it() -> None:
    message = World().call("spawn", x=5.544445, y=5.544445, theta=0.0)
    assert message == "Spawning turtle [turtle1] at x=[5.544445], y=[5.544445], theta=[0.000000]"


@pytest.mark.parametrize(
    ("service", "arguments", "message"),
    [
        ("fly", {}, "no service 'fly'"),
        ("spawn", {"x": 1.0}, "spawn needs y"),
        ("kill", {"name": "a", "x": 1.0}, "kill has no 'x'"),
        ("set_pen", {"turtle": "nobody"}, "no turtle"),
    ],
)
def test_a_wrong_call_says_what_is_wrong(service: str, arguments: dict[str, float | str], message: str) -> None:
    with pytest.raises(ValueInvalid, match=message):
        World().call(service, **arguments)


# --- the follower --------------------------------------------------------------------------------------------------


def last_of(scene: Scene) -> tuple[RunSummary, SimulationStep]:
    """Run a scene; return its summary and its last tick."""
    progress = RunSummary(scene)
    last = None
    for step in simulate(scene):
        progress.watch(step)
        last = step if step.is_tick else last
    assert last is not None
    return progress, last


def commands(scene: Scene) -> list[Twist]:
    """Return all commands of a scene's followers."""
    return [command.twist for step in simulate(scene) for command in step.commands]


def test_the_first_command_of_the_tutorial() -> None:
    first = commands(tutorial(spawn=(1.0, 1.0, 0.0), duration=0.0))[0]
    assert first == pytest.approx((3.213408, 3.141593, 0.0), abs=1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_a_leader_straight_behind_is_turned_to(law: str) -> None:
    assert abs(FollowController(law).command(-1.0, 0.0).angular_z) == pytest.approx(LAWS[law][2] * math.pi)


@pytest.mark.parametrize("place", [(0.0, 0.0), (-0.0, 0.0), (-1e-16, 1e-17), (-1e-6, 0.0)])
def test_at_distance_zero_a_follower_neither_moves_nor_spins(place: tuple[float, float]) -> None:
    assert FollowController().command(*place) == (0.0, 0.0, 0.0)


def test_a_follower_spawned_upon_its_leader_stays() -> None:
    scene = tutorial(spawn=(5.544445, 5.544445, 0.0), duration=5.0)
    assert set(commands(scene)) == {(0.0, 0.0, 0.0)}


def test_limits_bound_the_command_on_both_sides() -> None:
    law = FollowController(max_linear=1.0, max_angular=0.5)
    assert law.command(-9.0, -1e-3) == (1.0, -0.5, 0.0)


@pytest.mark.parametrize(
    "wrong", [{"rate": 0.0}, {"rate": math.nan}, {"gain_linear": math.inf}, {"max_linear": -1.0}, {"law": "ros3"}]
)
def test_an_impossible_controller_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueInvalid):
        FollowController(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("rate", [10.0, 3.0, 30.0, 7.3])
def test_control_steps_do_not_drift(rate: float) -> None:
    assert abs(FollowController(rate=rate).due_ns(1_000_000) - 1_000_000 / rate * 1e9) < 1.0


def test_a_run_that_never_began_has_no_distances() -> None:
    assert list(RunSummary(tutorial()).lines()) == ["ended before the first step"]


def test_a_chain_of_followers_converges() -> None:
    progress, _ = last_of(tutorial(followers=4, duration=60.0))
    assert [*progress.reached_ns] == ["turtle2", "turtle3", "turtle4", "turtle5"]
    assert max(progress.distances.values()) < 1e-3


def test_the_carrot_is_two_metres_to_the_leaders_left() -> None:
    _, last = last_of(tutorial(target="carrot", duration=40.0))
    assert last.states["turtle2"][:2] == pytest.approx((CENTRE, CENTRE + 2.0), abs=1e-3)


def test_the_moving_carrot_is_seen_where_it_is() -> None:
    seen = [each.distance for step in simulate(tutorial(target="moving-carrot", duration=0.0)) for each in step.commands]
    assert seen == [pytest.approx(math.hypot(CENTRE - 4.0, CENTRE + 10.0 - 2.0))]


def test_time_travel_fails_into_the_past_first_and_then_goes_where_the_leader_was() -> None:
    steps = list(simulate(tutorial(leader="circle", delay=5.0, duration=6.0)))
    logged = [line for step in steps for line in step.log]
    first = next(step for step in steps if step.commands)
    assert len(logged) == 1
    assert "too early" in logged[0]
    assert first.t_ns == pytest.approx(5 * SECOND, abs=0.11 * SECOND)
    assert first.commands[0].distance == pytest.approx(math.dist((4.0, 2.0), (CENTRE, CENTRE)), abs=0.2)


def test_a_delay_beyond_ten_seconds_is_kept_in_the_buffer() -> None:
    assert len(commands(tutorial(leader="circle", delay=15.0, duration=17.0))) > 10


def test_a_killed_leader_is_followed_until_its_last_transform_is_forgotten() -> None:
    scene = tutorial(leader="circle", duration=15.0)._replace(calls=[ServiceCall(SECOND, "kill", {"name": "turtle1"})])
    steps = list(simulate(scene))
    last = max(step.t_ns for step in steps if step.commands)
    assert 10.5 * SECOND < last < 11.5 * SECOND
    assert any("Could not transform turtle2 to turtle1" in line for step in steps for line in step.log)


def test_a_killed_follower_commands_no_more() -> None:
    scene = tutorial(duration=3.0)._replace(calls=[ServiceCall(SECOND, "kill", {"name": "turtle2"})])
    assert max(step.t_ns for step in simulate(scene) if step.commands) <= SECOND + TICK_NS


def test_a_refused_call_is_logged_and_the_run_goes_on() -> None:
    scene = tutorial(duration=2.0)._replace(calls=[ServiceCall(SECOND, "spawn", {"x": 1.0, "y": 1.0, "name": "turtle2"}, "here")])
    log = [line for step in simulate(scene) for line in step.log]
    assert log == ["here: A turtled named [turtle2] already exists"]


def test_a_turtle_cannot_follow_itself() -> None:
    scene = Scene([SceneTurtle("a", (1.0, 1.0, 0.0), Follow("a", FollowController()))])
    with pytest.raises(ValueInvalid, match="cannot follow itself"):
        list(simulate(scene))


@pytest.mark.parametrize("leader", LEADERS)
def test_the_same_seed_gives_the_same_steps(leader: str) -> None:
    runs = [[step.states for step in simulate(tutorial(leader=leader, seed=7, duration=5.0))] for _ in range(2)]
    assert runs[0] == runs[1]


def test_another_seed_gives_another_way() -> None:
    ends = {last_of(tutorial(leader="random", seed=seed, duration=5.0))[1].states["turtle1"] for seed in range(4)}
    assert len(ends) == 4


@pytest.mark.parametrize("leader", ["circle", "square", "figure8", "random"])
def test_a_built_in_leader_stays_off_the_walls(leader: str) -> None:
    progress, _ = last_of(tutorial(leader=leader, followers=0, duration=60.0))
    assert progress.walls == {}


def test_draw_square_has_sides_of_two_metres() -> None:
    corners = {
        (round(step.states["turtle1"].x * 2) / 2, round(step.states["turtle1"].y * 2) / 2)
        for step in simulate(tutorial(leader="square", followers=0, duration=27.0))
        if step.is_tick and step.poses["turtle1"].linear_velocity == 0.0
    }
    assert corners == {(5.5, 5.5), (7.5, 5.5), (7.5, 7.5), (5.5, 7.5)}


def test_a_script_out_of_order_is_refused() -> None:
    leader = scripted([(TIMEOUT_NS, Twist(1.0, 0.0)), (0, Twist(0.0, 0.0))])
    with pytest.raises(ValueInvalid, match="sort them by time"):
        commands(tutorial(leader=leader, duration=5.0))


def test_of_commands_that_arrive_the_newest_that_is_due_acts_and_turns_to_headings() -> None:
    leader = arriving([(0, Twist(1.0, 0.0)), (0, Heading(1.0)), (SECOND, Twist(2.0, 0.0))])
    scene = tutorial(leader=leader, followers=0, duration=0.5)
    assert last_of(scene)[1].poses["turtle1"].angular_velocity == 1.0


def test_an_arrow_is_a_command_and_the_key_q_ends_the_run() -> None:
    typed = typed_commands([b"\x1b[A?", b"fq\x1b[B"], headings=False)
    assert next(typed) == (0, Twist(2.0, 0.0))
    scene = tutorial(leader=arriving(typed), duration=600.0)
    assert max((step.t_ns for step in simulate(scene)), default=0) < 600 * SECOND


def test_what_ends_the_commands_that_arrive_ends_the_run() -> None:
    def broken() -> Iterator[tuple[int, Twist]]:
        yield 0, Twist(1.0, 0.0)
        raise ValueInvalid("torn")

    with pytest.raises(ValueInvalid, match="torn"):
        for _ in simulate(tutorial(leader=arriving(broken()), duration=None)):
            pass


def test_an_endless_run_keeps_ten_seconds_of_transforms() -> None:
    scene = tutorial(leader="circle", duration=None)
    simulation = Simulation(scene)
    ticks = simulation.ticks()
    for due_ns, _ in zip(ticks, range(2500), strict=False):
        simulation.step = SimulationStep(due_ns)
    track = simulation.buffer.track("turtle1")
    assert track is not None
    assert track.count <= 10 * SECOND // TICK_NS + 2


def test_unknown_leaders_targets_and_worlds_are_named() -> None:
    for wrong, message in (({"leader": "circel"}, "leaders: "), ({"target": "x"}, "targets: "), ({"delay": -1.0}, "delay")):
        with pytest.raises(ValueInvalid, match=message):
            tutorial(**wrong)
    with pytest.raises(ValueInvalid, match="ros1, ros2"):
        list(simulate(tutorial(turtlesim="ros3")))


def test_a_scripted_leader_may_be_run_again() -> None:
    scene = tutorial(leader=scripted([(0, Twist(1.0, 1.0))]), duration=1.0)
    assert commands(scene) == commands(scene)
