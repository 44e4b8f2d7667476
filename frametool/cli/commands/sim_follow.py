"""`frametool sim follow`: a leader, and turtles that follow it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, Number, Text, decorated
from frametool.cli.leader import leader_of
from frametool.cli.sim_output import Show, play_options
from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.sim.controllers import LAWS, FollowController
from frametool.sim.scene import tutorial
from frametool.sim.targets import TARGETS
from frametool.sim.world import VARIANTS
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.sim.leaders import MakeLeader
    from frametool.sim.scene import Scene

NUMBER = Number()


class Spawn(Text):
    """A place: X,Y or X,Y,THETA."""

    name = "x,y,theta"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read metres and radians; the angle may carry a unit."""
        cells = [cell.strip() for cell in str(super().convert(value, param, ctx)).split(",")]
        if len(cells) not in (2, 3):
            self.fail(f"expected X,Y,THETA, found {value!r}", param, ctx)
        try:
            angle, unit = parse_angle(cells[2]) if len(cells) == 3 else (0.0, None)
            return parse_number(cells[0]), parse_number(cells[1]), math.radians(angle) if unit == "deg" else angle
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)


class Duration(Number):
    """Seconds, 0 or more, or inf."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read it."""
        if value == "inf":
            return math.inf
        seconds = float(super().convert(value, param, ctx))
        if seconds < 0.0:
            self.fail(f"expected 0 or more, found {seconds:g}", param, ctx)
        return seconds


def follow_options(duration: str) -> Callable[[Any], Any]:
    """Add to a command the options of followers; `duration` is how long it runs if not told."""
    options = [
        click.option("--law", type=click.Choice(tuple(LAWS)), default="ros1", show_default=True,
                     help="the tutorial's listener: 10 Hz and gains 0.5, 4 (ros1), or 1 Hz and 0.5, 1 (ros2)"),
        click.option("--rate", type=NUMBER, metavar="HZ", help="control steps a second"),
        click.option("--gain-linear", type=NUMBER, metavar="K", help="speed for each metre of distance"),
        click.option("--gain-angular", type=NUMBER, metavar="K", help="turn rate for each radian of bearing"),
        click.option("--max-linear", type=NUMBER, metavar="V", help="fastest speed in m/s  [default: none]"),
        click.option("--max-angular", type=NUMBER, metavar="W", help="fastest turn in rad/s  [default: none]"),
        click.option("--target", type=click.Choice(TARGETS), default="leader", show_default=True,
                     help="the leader, a carrot 2 m to its left, or a carrot that circles it at 10 m"),
        click.option("--delay", type=Duration(), default=0.0, metavar="S",
                     help="follow where the target was so long ago, looked up through world  [default: 0]"),
        click.option("--spawn", type=Spawn(), default="4,2,0", show_default=True, metavar="X,Y,THETA",
                     help="where turtle2 begins: metres, radians (or 90deg)"),
        click.option("--duration", type=Duration(), default=duration, show_default=True, metavar="S",
                     help="simulated seconds, or inf"),
        click.option("--turtlesim", type=click.Choice(VARIANTS), default="ros1", show_default=True,
                     help="whose turtlesim"),
        click.option("--holonomic", is_flag=True, help="let linear.y count in ROS 2, as the node's parameter does"),
        click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="of the random leader"),
    ]  # fmt: skip
    return lambda function: decorated(function, options)


@click.command(cls=Command, name="follow")
@click.option("--leader", type=TEXT, default="still", show_default=True, metavar="NAME|FILE|-",
              help="still, circle, square, figure8, random, a file of commands, or - for standard input")
@click.option("--followers", type=click.IntRange(0, 1000), default=1, show_default=True, metavar="N",
              help="each follows the one before")
@follow_options("20")
@play_options
def command(leader: str, followers: int, **options: Any) -> None:
    """Let turtle2 follow turtle1 by tf, as the tutorial does, and print its velocity commands.

    \b
      frametool sim follow
      frametool sim follow --spawn 1,1,0 --leader square --format csv
      frametool sim follow --leader figure8 --followers 3 --plot chain.svg --emit tf

    A leader file has t, linear, angular as CSV, JSON or YAML; standard input also takes Twist messages and the words
    up, down, left, right, one a second unless they say their time: simulated time waits for the next of them, or goes
    on with --realtime, where they act when they come. A turtle at a wall is told of once, and every tick
    there is counted in the summary. Below 2 micrometres from its target a follower stands still.
    """
    show, scene = settled(options, leader, followers)
    show.play(scene)


def duration_ns(seconds: float) -> int | None:
    """Return nanoseconds; None for ever."""
    return None if seconds == math.inf else round(seconds * BILLION)


def settled(
    options: dict[str, Any], leader: str | MakeLeader, followers: int, **more: Any,
) -> tuple[Show, Scene]:  # fmt: skip
    """Make the show and the scene of the options; what cannot be is a usage error."""
    keys = ("rate", "gain_linear", "gain_angular", "max_linear", "max_angular")
    changes = {key: options.pop(key) for key in keys}
    names = ("spawn", "target", "delay", "duration", "turtlesim", "holonomic")
    chosen = {name: options.pop(name) for name in names}
    if chosen["holonomic"] and chosen["turtlesim"] == "ros1":
        raise click.UsageError("--holonomic is for --turtlesim ros2; in ROS 1 linear.y always counts")
    law, seed = options.pop("law"), options.pop("seed")
    show = Show(**options, **more)
    try:
        controller = FollowController(law, **changes)
        drive = leader_of(leader, seed, paced=show.realtime) if isinstance(leader, str) else leader
        return show, tutorial(leader=drive, law=controller, followers=followers, **chosen)
    except ValueInvalid as error:
        raise click.UsageError(str(error)) from None
