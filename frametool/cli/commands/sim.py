"""`frametool sim`: the turtles: a leader and followers, a scene of a file, keys in the terminal."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from frametool.cli import sim_output
from frametool.cli.command import EXIT_CODES, Command, Inputs, argument, misuse, option, refuse
from frametool.cli.commands import Group
from frametool.cli.explaining import explain_option, significant
from frametool.cli.poses import inline_misuse, source_of
from frametool.cli.signals import clean_up
from frametool.cli.sim_output import LEADER, SimOutput, follow_options, leader_of, output_options, parse_duration
from frametool.cli.sink import writing
from frametool.cli.stderr import say
from frametool.formats.table import by_suffix
from frametool.frames.stamps import BILLION
from frametool.sim.drivers import FollowController, Mailbox, keys_in, meaning_of
from frametool.sim.scene import Scene, duration_ns, tutorial
from frametool.sim.scene_file import read_scene

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.sim.drivers import MakeLeader

INSTEAD = "pipe key names into frametool sim follow --leader -"
SUBCOMMANDS = {
    "follow": "a leader, and one or more turtles that follow",
    "run": "a whole scene from one file",
    "teleop": "drive turtle1 with the arrow keys, drawn in the terminal",
}
HELP = """Replay turtlesim and the turtle-follow tutorial, without ROS and without a screen.

\b
  frametool sim follow --leader square --duration 5 --format csv
  frametool sim follow --spawn 1,1,0 --leader circle --plot follow.svg

Simulated time, exact to turtlesim: 16 ms ticks, float32 poses, the walls. Followers look their leader up in a buffer
of transforms, as `lookup` does. A summary goes to stderr.
"""


class SimGroup(Group):
    """The subcommands of the turtles, which are below."""

    table = {name: (__name__, about) for name, about in SUBCOMMANDS.items()}  # noqa: RUF012 - as the group's own

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        """Return one of them, or say which there are."""
        return self.commands.get(cmd_name) or super().get_command(ctx, cmd_name)


@click.group("sim", cls=SimGroup, help=HELP, epilog=EXIT_CODES)
def command() -> None:
    """Hold the subcommands."""


LAW_OPTIONS = ("rate", "gain_linear", "gain_angular", "max_linear", "max_angular")
SCENE_OPTIONS = ("followers", "spawn", "target", "delay", "duration", "turtlesim", "holonomic")


@command.command("follow", cls=Command)
@LEADER
@follow_options("20")
@output_options
@option("--explain-step N", "derive the command of step N, from 0", click.IntRange(0), under="Result")
@explain_option(requires=("explain_step",))
def follow(inputs: Inputs) -> None:
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
    if inputs.explain_step is not None:
        _explain(inputs)
        return
    leader = leader_of(inputs)
    SimOutput(inputs).run(scene_of(inputs, leader))


def _explain(inputs: Inputs) -> None:
    """Write the derivation of one control step of the followers."""
    scene = scene_of(inputs, leader_of(inputs))
    fmt = inputs.format_name or by_suffix(inputs.output, ("yaml", "json", "csv"))
    refuse(fmt not in (None, "text"), f"--explain-step derives one step in words; leave the format {fmt} out")
    from frametool.explain.derive import DerivationStyle, derive_follow
    from frametool.sim.followed import follow_steps

    plan = DerivationStyle(sim_output.style_of(inputs), significant(inputs.precision))
    text = derive_follow(plan, follow_steps(scene, inputs.explain_step)).render(inputs.explain or "text")
    with writing(inputs.output, force=bool(inputs.force)) as write:
        write(text)


def scene_of(inputs: Inputs, leader: MakeLeader) -> Scene:
    """Return the scene of a leader and followers; what cannot be is a usage error."""
    chosen = {name: getattr(inputs, name) for name in SCENE_OPTIONS}
    if chosen["holonomic"] and chosen["turtlesim"] == "ros1":
        raise click.UsageError("--holonomic is for --turtlesim ros2; in ROS 1 linear.y always counts")
    with misuse():
        law = FollowController(inputs.law, **{name: getattr(inputs, name) for name in LAW_OPTIONS})
        return tutorial(leader=leader, law=law, **chosen)


@command.command("run", cls=Command)
@argument("scene")
@option("--duration S", "simulated seconds, or inf  [default: the scene's]", parse_duration)
@option("--seed", "seed of random leaders  [default: the scene's]", click.IntRange(0), under="Turtles")
@output_options
def run(inputs: Inputs) -> None:
    """Run SCENE, a YAML or JSON file, and print the followers' velocity commands.

    \b
      frametool sim run turtles.yaml
      frametool sim run turtles.yaml --emit poses --format csv --plot scene.svg

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
    output, duration = SimOutput(inputs), inputs.duration
    with inline_misuse():
        read = read_scene(source_of(inputs.scene), seed=inputs.seed)
    chosen = read if duration is None else read._replace(duration_ns=duration_ns(duration))
    if late := chosen.late_calls():
        end = f"{(chosen.duration_ns or 0) / BILLION:g} s"
        more = f", nor do{f'es {late[1].place}' if len(late) == 2 else f' {len(late) - 1} more'}" if late[1:] else ""
        say(f"warning: {late[0].place} ({late[0].service}) never happens, the run ends at {end}{more}")
    output.run(chosen)


QUIT = b"qQ\x04"


@command.command("teleop", cls=Command)
@follow_options("inf")
@output_options
def teleop(inputs: Inputs) -> None:
    """Drive turtle1 with the arrow keys, as turtle_teleop_key does; turtle2 follows. Drawn in the terminal; q ends it.

    \b
      frametool sim teleop
      frametool sim teleop --followers 3 --plot mine.svg
      frametool sim teleop --turtlesim ros2 --format csv > commands.csv

    Each key moves for a second: 2 m/s ahead or back, 2 rad/s to the left or right. With --turtlesim ros2 the keys
    g t r e d c v b around f turn to a heading. When stdout is no terminal, every command goes there.
    """
    refuse(sys.stdin is None or not sys.stdin.isatty(), f"standard input is no terminal; {INSTEAD}")
    mailbox = Mailbox()
    output, scene = SimOutput(inputs.but(live=True), leaders=True), scene_of(inputs, mailbox)
    with keyboard(mailbox, headings=scene.variant == "ros2"):
        output.run(scene)


@contextmanager
def keyboard(mailbox: Mailbox, *, headings: bool) -> Iterator[None]:
    """Read single keys from the terminal into a mailbox; the terminal is as before afterwards."""
    try:
        import termios
        import tty
    except ImportError:
        raise click.UsageError(f"single keys are read on Linux and macOS alone; {INSTEAD}") from None
    from threading import Thread

    clean_up()
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        Thread(target=_listen, args=(mailbox, headings), daemon=True).start()
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _listen(mailbox: Mailbox, headings: bool) -> None:
    """Post what keys mean until the key that ends it."""
    while data := os.read(sys.stdin.fileno(), 64):
        for key in keys_in(data):
            if key in QUIT:
                mailbox.close()
                return
            command = meaning_of(key, headings=headings)
            if command is not None:
                mailbox.post(command)
