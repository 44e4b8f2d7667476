"""`frametool sim run`: a whole scene from one file."""

from __future__ import annotations

from typing import Any

import click

from frametool.cli.options import TEXT, Command
from frametool.cli.poses import source_of, usage_if_inline
from frametool.cli.sim_output import DURATION, SimOutput, output_options
from frametool.cli.stderr import say
from frametool.errors import FormatError
from frametool.frames.stamps import BILLION
from frametool.sim.scene import duration_ns
from frametool.sim.scene_file import read_scene


@click.command(cls=Command, name="run")
@click.argument("scene", type=TEXT)
@click.option("--duration", type=DURATION, metavar="S", help="simulated seconds, or inf  [default: the scene's]")
@click.option("--seed", type=click.IntRange(0), help="of random leaders  [default: the scene's]")
@output_options
def command(scene: str, duration: float | None, seed: int | None, **options: Any) -> None:
    """Run SCENE, a YAML or JSON file, and print the followers' velocity commands.

    \b
      frametool sim run turtles.yaml
      frametool sim run turtles.yaml --emit poses --format csv --plot turtles.svg

    \b
      duration: 20
      turtles:
        turtle1: {leader: square}
        turtle2: {spawn: [4, 2, 0], follow: turtle1, law: ros1}
      events:
        - {t: 5, teleport_absolute: {turtle: turtle1, x: 2, y: 2, theta: 90deg}}

    A turtle has spawn, and leader (still, circle, square, figure8, random, a file, a list of commands) or follow with
    law, rate, gain_linear, gain_angular, max_linear, max_angular, target, delay. Events are turtlesim's services:
    spawn, kill, reset, clear, teleport_absolute, teleport_relative, rotate_absolute (ROS 2), set_pen.
    """
    output = SimOutput.of(**options)
    try:
        read = read_scene(source_of(scene), seed=seed)
    except FormatError as error:
        raise usage_if_inline(error) from None
    chosen = read if duration is None else read._replace(duration_ns=duration_ns(duration))
    if late := chosen.late_calls():
        end = f"{(chosen.duration_ns or 0) / BILLION:g} s"
        more = f", nor do {len(late) - 1} more" if late[1:] else ""
        say(f"warning: {late[0].place} ({late[0].service}) never happens, the run ends at {end}{more}")
    output.run(chosen)
