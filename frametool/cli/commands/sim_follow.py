"""`frametool sim follow`: a leader, and turtles that follow it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.explaining import EXPLAIN, significant
from frametool.cli.options import Command
from frametool.cli.sim_output import LEADER, SimOutput, follow_options, leader_of, output_options
from frametool.cli.sink import writing
from frametool.errors import ValueInvalid
from frametool.formats.table import by_suffix
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
@click.option("--explain-step", type=click.IntRange(0), metavar="N", help="derive the command of step N, from 0")
@EXPLAIN
def command(leader: str, explain_step: int | None, explain: str | None, **options: Any) -> None:
    """Let turtle2 follow turtle1 by tf, as the tutorial does, and print its velocity commands.

    \b
      frametool sim follow
      frametool sim follow --spawn 1,1,0 --leader square --format csv
      frametool sim follow --leader figure8 --followers 3 --plot f.svg --emit tf
      frametool sim follow --explain-step 3

    A leader file has t, linear, angular as CSV, JSON or YAML; standard input also takes Twist messages and the words
    up, down, left, right, one a second unless they say their time: simulated time waits for the next of them, or goes
    on with --realtime, where they act when they come. A turtle at a wall is reported once, and every tick
    there is counted in the summary. Below 2 micrometres from its target a follower stands still.
    """
    precision, told = options["precision"], _told(options)
    output, scene = output_and_scene(options, leader)
    if explain_step is not None:
        _explain(output, scene, explain_step, explain or "text", precision, told)
    elif explain is not None:
        raise click.UsageError("--explain derives one control step; name it with --explain-step N, from 0")
    else:
        output.run(scene)


def _told(options: dict[str, Any]) -> list[str]:
    """Name the options that are about a whole run and not about one step."""
    named = {"live": "--live", "realtime": "--realtime", "plot": "--plot", "view": "--view"}
    told = [option for name, option in named.items() if options[name]]
    if options["emit"] != "commands":
        told.append("--emit")
    form = options["format_name"] or by_suffix(options["output"], ("yaml", "json", "csv"))
    return [*told, f"the format {form}"] if form not in (None, "text") else told


def _explain(output: SimOutput, scene: Scene, step: int, form: str, precision: int | None, told: list[str]) -> None:
    """Write the derivation of one control step of the followers."""
    if told:
        raise click.UsageError(f"--explain-step derives one step in words; leave {' and '.join(told)} out")
    from frametool.explain.derive import DerivationStyle
    from frametool.explain.follow import derive_follow
    from frametool.sim.followed import follow_steps

    plan = DerivationStyle(output.style, significant(precision))
    text = derive_follow(plan, follow_steps(scene, step)).render(form)
    with writing(output.output, force=output.force) as write:
        write(text)


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
