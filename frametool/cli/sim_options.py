"""Options that several commands of the turtles share, and the types of their values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Number, Text, decorated
from frametool.errors import ValueInvalid, shown
from frametool.sim.controllers import LAWS
from frametool.sim.scene import LONGEST
from frametool.sim.targets import TARGETS
from frametool.sim.world import VARIANTS
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable

NUMBER = Number()


class Spawn(Text):
    """A place: X,Y or X,Y,THETA."""

    name = "x,y,theta"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read metres and radians; the angle may carry a unit."""
        cells = [cell.strip() for cell in str(super().convert(value, param, ctx)).split(",")]
        if len(cells) not in (2, 3):
            self.fail(f"expected X,Y,THETA, found {shown(str(value))}", param, ctx)
        try:
            angle, unit = parse_angle(cells[2]) if len(cells) == 3 else (0.0, None)
            return parse_number(cells[0]), parse_number(cells[1]), math.radians(angle) if unit == "deg" else angle
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)


class Seconds(Number):
    """A span of time, 0 or more."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read it, and check that stamps reach so far."""
        seconds = float(super().convert(value, param, ctx))
        if not 0.0 <= seconds <= LONGEST:
            self.fail(f"expected 0 or more, and at most {LONGEST}, found {seconds:g}", param, ctx)
        return seconds


class Duration(Seconds):
    """Seconds, or inf."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read it."""
        return math.inf if value == "inf" else super().convert(value, param, ctx)


LEADER = click.option("--leader", type=TEXT, default="still", show_default=True, metavar="NAME|FILE|-",
                      help="still, circle, square, figure8, random, a file of commands, or - for standard input")
LAW = click.option("--law", type=click.Choice(tuple(LAWS)), default="ros1", show_default=True,
                   help="the tutorial's listener: 10 Hz and gains 0.5, 4 (ros1), or 1 Hz and 0.5, 1 (ros2)")
RATE = click.option("--rate", type=NUMBER, metavar="HZ", help="control steps a second")
MAX_LINEAR = click.option("--max-linear", type=NUMBER, metavar="V", help="fastest speed in m/s  [default: none]")
MAX_ANGULAR = click.option("--max-angular", type=NUMBER, metavar="W", help="fastest turn in rad/s  [default: none]")
SPAWN = click.option("--spawn", type=Spawn(), default="4,2,0", show_default=True, metavar="X,Y,THETA",
                     help="where turtle2 begins: metres, radians (or 90deg)")
SEED = click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="of the random leader")
REACH = click.option("--reach", type=NUMBER, default=0.5, show_default=True, metavar="D",
                     help="metres that count as having come to the target")
FOLLOWERS = click.option("--followers", type=click.IntRange(0, 1000), default=1, show_default=True, metavar="N",
                         help="each follows the one before, the first follows turtle1")  # fmt: skip


def follow_options(duration: str) -> Callable[[Any], Any]:
    """Add to a command the options of followers; `duration` is how long it runs if not told."""
    options = [
        FOLLOWERS,
        LAW,
        RATE,
        click.option("--gain-linear", type=NUMBER, metavar="K", help="speed for each metre of distance"),
        click.option("--gain-angular", type=NUMBER, metavar="K", help="turn rate for each radian of bearing"),
        MAX_LINEAR,
        MAX_ANGULAR,
        click.option("--target", type=click.Choice(TARGETS), default="leader", show_default=True,
                     help="the leader, a carrot 2 m to its left, or a carrot that circles it at 10 m"),
        click.option("--delay", type=Seconds(), default=0.0, metavar="S",
                     help="follow where the target was so long ago, looked up through world  [default: 0]"),
        SPAWN,
        click.option("--duration", type=Duration(), default=duration, show_default=True, metavar="S",
                     help="simulated seconds, or inf"),
        click.option("--turtlesim", type=click.Choice(VARIANTS), default="ros1", show_default=True,
                     help="whose turtlesim"),
        click.option("--holonomic", is_flag=True, help="let linear.y count in ROS 2, as the node's parameter does"),
        SEED,
    ]  # fmt: skip
    return lambda function: decorated(function, options)
