"""What is huge, tiny, no number or very many: refused in words or done, never a traceback, never `inf` in JSON."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pytest

from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid
from frametool.grammar.result import Style
from frametool.sim.scene import read_scene, tutorial
from frametool.sim.simulate import FORMS, simulate, step_writer
from frametool.sim.turtle import FASTEST_TURN, Turtle, Twist, World, scripted
from frametool.view.pictures import ticks

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

VALUES = (
    "0", "-0", "-1", "1", "nan", "inf", "-inf", "1e40", "1e300", "-1e308", "1e400", "1e-300", "5e-324", "1_0", "0x10",
    "", "abc", "1,1", "99999999999999999999", "\x1b[31m", "\uff11",
)  # fmt: skip
SPAWNS = ("1e300,1e300", "-1e308,0,1e308", "1,1,1e300", "1,1,1e300deg", "1e39,0", "1,2,3,4", "9" * 400)
NUMBERS = ("--rate", "--gain-linear", "--gain-angular", "--max-linear", "--max-angular", "--reach", "--precision", "--seed")
FOLLOW = (*NUMBERS, "--delay", "--followers", "--spawn", "--leader")
SCENE = "turtles: {turtle1: {leader: square}, turtle2: {spawn: [4, 2], follow: turtle1}}\nduration: 0.2\n"
CASES = [
    *(("follow", option, value) for option in FOLLOW for value in VALUES),
    *(("follow", "--spawn", value) for value in SPAWNS),
    *(("follow", "--duration", value) for value in VALUES if value not in ("inf", "1")),
    *(("run", option, value) for option in ("--duration", "--reach", "--seed") for value in VALUES if value != "inf"),
]


def strictly(text: str) -> None:
    """Refuse nan and infinity, which json reads by default."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    for line in text.splitlines():
        json.loads(line, parse_constant=refuse)


@pytest.mark.parametrize(("name", "option", "value"), CASES)
def test_any_value_of_an_option_is_used_or_refused_in_one_line(run: Run, name: str, option: str, value: str) -> None:
    files = {"s.yaml": SCENE}
    short = () if option == "--duration" or name == "run" else ("--duration", "0.2")
    scene = ("s.yaml",) if name == "run" else ()
    outcome = run("sim", name, *scene, option, value, *short, "-f", "json", "--plot", "p.svg", "--force", files=files)
    assert outcome.status in (0, 1, 2, 5)
    assert "Traceback" not in outcome.err
    assert "\x1b" not in outcome.err
    strictly(outcome.out)


@pytest.mark.parametrize("form", FORMS)
def test_a_pose_whose_speed_does_not_fit_float32_is_refused_and_named(form: str) -> None:
    records = step_writer("poses", Style(form))
    scene = tutorial(leader=scripted([(0, Twist(1e40, 0.0))]), followers=0, duration=1.0)
    written = (text for step in simulate(scene) for text in records(step))
    with pytest.raises(ValueInvalid, match=r"^turtle1 at 0\.016 s: its speed does not fit the float32"):
        list(written)


@pytest.mark.parametrize("emit", ["commands", "tf"])
def test_a_leader_at_1e40_metres_a_second_is_followed_in_strict_json(run: Run, emit: str) -> None:
    arguments = ("--leader", "l.csv", "--duration", "1", "--emit", emit, "-f", "json")
    outcome = run("sim", "follow", *arguments, files={"l.csv": "t,linear,angular\n0,1e40,0\n"})
    assert outcome.status == 0
    assert "x=1.6e+38" in outcome.err  # where it would be without the wall: not forty digits
    strictly(outcome.out)


@pytest.mark.parametrize("turn", [FASTEST_TURN * 2, -1e300])
def test_a_turn_that_leaves_no_heading_is_refused(turn: float) -> None:
    with pytest.raises(ValueInvalid, match="turns at most 1e\\+15 rad/s"):
        Twist(0.0, turn)


def test_the_fastest_turn_keeps_a_heading() -> None:
    turtle = Turtle()
    for tick in range(1, 10):
        turtle.command(Twist(1.0, FASTEST_TURN))
        turtle.update(tick * 16_000_000)
        assert abs(turtle.pose.theta) < 4.0


@pytest.mark.parametrize("place", [(1e39, 0.0, 0.0), (0.0, math.nan, 0.0), (0.0, 0.0, -math.inf)])
def test_what_a_service_cannot_take_as_float32_is_refused(place: tuple[float, float, float]) -> None:
    with pytest.raises(ValueInvalid, match="within float32"):
        Turtle(*place)
    with pytest.raises(ValueInvalid, match="within float32"):
        World().call("spawn", x=place[0], y=place[1], theta=place[2])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("turtles: {a: , b: {follow: a, delay: 1e300}}", "s.yaml:1:38: stamp "),
        ("turtles: {a: }\nduration: 1e300", "s.yaml:2:11: stamp "),
        ("turtles: {a: }\nseed: " + "9" * 100, "s.yaml:2:7: expected a whole number 0 .. 18446744073709551616, found '999"),
        ("turtles: {a: }\nevents: [{t: 1e300, clear: }]", "s.yaml:2:14: stamp "),
        ("turtles: {a: }\nevents: [{t: 0, spawn: {x: 1e39, y: 0}}]", "s.yaml:2:24: x must be a number within float32"),
        ("turtles: {a: {leader: [{t: 1e300, linear: 1}]}}", "s.yaml:1:28: stamp "),
    ],
)
def test_times_and_places_that_cannot_be_are_refused_where_they_stand(text: str, message: str) -> None:
    with pytest.raises(FormatError) as caught:
        read_scene(Source("s.yaml", text))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("delay", [-1.0, math.nan, math.inf, 1e300])
def test_a_delay_that_no_buffer_reaches_is_refused(delay: float) -> None:
    with pytest.raises(ValueInvalid, match="delay must be 0"):
        tutorial(delay=delay)


@pytest.mark.parametrize(
    "ends", [(0.0, 5e-324), (-1e300, 1e300), (0.0, 1e-310), (0.0, 1e300), (-5e-324, 0.0), (1e300, 1e300)]
)
def test_an_axis_has_ticks_whatever_its_values(ends: tuple[float, float]) -> None:
    assert 2 <= len(ticks(*ends)) <= 10


# --- very many: twice as many turtles need twice as much work ------------------------------------------------------


class CountedName(str):
    """A turtle's name that counts how often it is compared with another."""

    __slots__ = ()
    compared = 0

    def __lt__(self, other: str) -> bool:
        """Compare, and count."""
        CountedName.compared += 1
        return str.__lt__(self, other)

    def __eq__(self, other: object) -> bool:
        """Compare, and count."""
        CountedName.compared += 1
        return str.__eq__(self, other)

    __hash__ = str.__hash__


def comparisons(turtles: int) -> int:
    """Spawn and kill turtles; return how often names were compared."""
    CountedName.compared = 0
    world = World()
    for number in range(turtles):
        world.spawn(1.0, 1.0, 0.0, CountedName(f"t{number * 7919 % turtles}"))
    world.tick(16_000_000)
    for name in list(world.turtles):
        world.kill(name)
    return CountedName.compared


def test_twice_as_many_spawns_need_hardly_more_than_twice_the_comparisons() -> None:
    assert comparisons(4000) < 2.5 * comparisons(2000)
