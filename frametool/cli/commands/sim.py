"""`frametool sim`: the turtles; one file a subcommand, one table of them."""

from __future__ import annotations

import click

from frametool.cli.group import Group
from frametool.cli.options import EXIT_CODES

SUBCOMMANDS = {
    "follow": ("frametool.cli.commands.sim_follow", "a leader, and one or more turtles that follow"),
    "run": ("frametool.cli.commands.sim_run", "a whole scene from one file"),
    "teleop": ("frametool.cli.commands.sim_teleop", "drive turtle1 with the arrow keys, drawn in the terminal"),
    "sweep": ("frametool.cli.commands.sim_sweep", "how soon a follower is there, for many gains at once"),
}
HELP = """Replay turtlesim and the turtle-follow tutorial, without ROS and without a screen.

\b
  frametool sim follow --leader square --duration 5 --format csv
  frametool sim follow --spawn 1,1,0 --leader circle --plot follow.svg

Simulated time, exact to turtlesim: 16 ms ticks, float32 poses, the walls. Followers look their leader up in a buffer
of transforms, as `lookup` does. A summary goes to stderr.
"""


class SimGroup(Group):
    """The subcommands of the turtles."""

    table = SUBCOMMANDS


@click.command(cls=SimGroup, name="sim", help=HELP, epilog=EXIT_CODES)
def command() -> None:
    """Hold the subcommands."""
