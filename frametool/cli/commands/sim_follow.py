"""`frametool sim follow`: a leader, and turtles that follow it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Command
from frametool.cli.leader import leader_of
from frametool.cli.sim_options import LEADER, follow_options
from frametool.cli.sim_output import SimOutput, output_options
from frametool.errors import ValueInvalid
from frametool.sim.controllers import FollowController
from frametool.sim.scene import tutorial

if TYPE_CHECKING:
    from frametool.sim.leaders import MakeLeader
    from frametool.sim.scene import Scene

LAW_OPTIONS = ("rate", "gain_linear", "gain_angular", "max_linear", "max_angular")
SCENE_OPTIONS = ("followers", "spawn", "target", "delay", "duration", "turtlesim", "holonomic")


@click.command(cls=Command, name="follow")
@LEADER
@follow_options("20")
@output_options
def command(leader: str, **options: Any) -> None:
    """Let turtle2 follow turtle1 by tf, as the tutorial does, and print its velocity commands.

    \b
      frametool sim follow
      frametool sim follow --spawn 1,1,0 --leader square --format csv
      frametool sim follow --leader figure8 --followers 3 --plot chain.svg --emit tf

    A leader file has t, linear, angular as CSV, JSON or YAML; standard input also takes Twist messages and the words
    up, down, left, right, one a second unless they say their time: simulated time waits for the next of them, or goes
    on with --realtime, where they act when they come. A turtle at a wall is reported once, and every tick
    there is counted in the summary. Below 2 micrometres from its target a follower stands still.
    """
    output, scene = output_and_scene(options, leader)
    output.run(scene)


def output_and_scene(
    options: dict[str, Any], leader: str | MakeLeader, **more: Any,
) -> tuple[SimOutput, Scene]:  # fmt: skip
    """Return the output and the scene that the options describe; what cannot be is a usage error."""
    law, seed = options.pop("law"), options.pop("seed")
    changes = {name: options.pop(name) for name in LAW_OPTIONS}
    chosen = {name: options.pop(name) for name in SCENE_OPTIONS}
    if chosen["holonomic"] and chosen["turtlesim"] == "ros1":
        raise click.UsageError("--holonomic is for --turtlesim ros2; in ROS 1 linear.y always counts")
    output = SimOutput(**options, **more)
    try:
        controller = FollowController(law, **changes)
        drive = leader_of(leader, seed, paced=output.realtime) if isinstance(leader, str) else leader
        return output, tutorial(leader=drive, law=controller, **chosen)
    except ValueInvalid as error:
        raise click.UsageError(str(error)) from None
