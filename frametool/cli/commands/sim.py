"""`frametool sim`: turtles: a leader and followers, a scene from a file, keys in the terminal."""

from __future__ import annotations

import math
import os
import sys
from contextlib import ExitStack
from functools import partial
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import EXIT_CODES, FILE, Command, argument, misuse, option, refuse, say_if_typed, together
from frametool.cli.commands import Group
from frametool.cli.options import PRECISION, place_options, read_path, suffix_of
from frametool.cli.output import Output
from frametool.cli.poses import inline_misuse, source_of
from frametool.cli.signals import STATE
from frametool.cli.sink import refuse_existing, say, writing
from frametool.cli.streaming import explain_option, significant
from frametool.documents.source import InputFile, Source
from frametool.errors import FileProblem, alternatives, shown
from frametool.frames.stamps import BILLION
from frametool.sim import turtle as drivers
from frametool.sim.scene import Scene, duration_ns, parse_spawn, read_scene, read_script, read_stream, tutorial
from frametool.sim.simulate import EMITS, FORMS, RunSummary, event_log, simulate, step_writer
from frametool.sim.turtle import TICK_NS, VARIANTS
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.cli.command import Inputs
    from frametool.sim.simulate import Watch
    from frametool.sim.turtle import MakeLeader


_of_turtles = partial(option, under="Turtles")


def parse_duration(text: str) -> float:
    """Parse seconds, or inf."""
    return math.inf if text == "inf" else parse_number(text)


def follow_options(duration: str) -> Callable[[Any], Any]:
    """Return the options of a command on followers; duration: the default of --duration."""
    return together(
        option("--followers N", "each follows the previous one, the first follows turtle1", click.IntRange(0, 1000),
               default=1),
        option("--law", "the tutorial's listener: 10 Hz and gains 0.5, 4 (ros1), or 1 Hz and 0.5, 1 (ros2)",
               (*drivers.LAWS,), default="ros1"),
        option("--rate HZ", "control steps per second", parse_number),
        _of_turtles("--gain-linear K", "speed for each metre of distance", parse_number),
        _of_turtles("--gain-angular K", "turn rate for each radian of bearing", parse_number),
        _of_turtles("--max-linear V", "fastest speed in m/s  [default: none]", parse_number),
        _of_turtles("--max-angular W", "fastest turn in rad/s  [default: none]", parse_number),
        _of_turtles("--target", "the leader, a carrot 2 m to its left, or a carrot that circles it at 10 m",
                    drivers.TARGETS, default="leader"),
        _of_turtles("--delay S", "follow the target's past position, looked up through world  [default: 0]",
                    parse_number, default=0.0),
        option("--spawn X,Y,THETA", "start of turtle2: metres, radians (or 90deg)", parse_spawn, default="4,2,0"),
        option("--duration S", "simulated seconds, or inf", parse_duration, default=duration),
        _of_turtles("--turtlesim", "whose turtlesim", VARIANTS, default="ros1"),
        _of_turtles("--holonomic", "use linear.y in ROS 2, like the node's parameter"),
    )  # fmt: skip


output_options = together(
    option("--emit", "velocity commands of followers, poses of all turtles, or transforms for `lookup -`", EMITS,
           default="commands"),
    _of_turtles("--reach D", "distance in metres at which the target is reached", parse_number, default=0.5),
    _of_turtles("--realtime", "run in real time, instead of as fast as possible"),
    option("--live", "draw the turtles in the terminal, in real time"),
    option("--view FILE.html", "show the frames over time on a page, like `view`",
           partial(read_path, suffixes=(".html",))),
    option("-f --format", "format of the records  [default: text on a terminal, yaml otherwise]", FORMS,
           name="format_name"),
    PRECISION,
    place_options,
    option("--plot FILE", "draw the result into a .svg, .html or .png",
           partial(read_path, suffixes=(".svg", ".html", ".png"))),
)  # fmt: skip


def _paced(start: float) -> Watch:
    """Return a function that keeps simulated time from running ahead of real time."""
    return lambda step: sleep(max(0.0, step.t_ns / BILLION - (monotonic() - start)))


def _pictures(scene: Scene, plot: str | None, view: str | None) -> dict[str, tuple[Watch, Callable[[], str | bytes]]]:
    """Return for each picture's file a function that takes each step, and one that then returns the file's content."""
    found: dict[str, tuple[Watch, Callable[[], str | bytes]]] = {}
    if plot:
        from frametool.view.exports import run_picture
        from frametool.view.pictures import require_matplotlib, write_picture

        if suffix_of(plot) == ".png":
            require_matplotlib()
        watch_run, drawn = run_picture(scene)
        found[plot] = watch_run, lambda: write_picture(drawn(), suffix_of(plot))
    if view:
        from frametool.view.exports import run_page

        found[view] = run_page()
    return found


def show_run(inputs: Inputs, scene: Scene, *, leaders: bool = False) -> None:
    """Run a scene to its end, write or draw it by the options, and write a summary to stderr.

    Raises click.UsageError and FileProblem before anything runs; KeyboardInterrupt after the summary, if interrupted.
    """
    style, live, emit, reach = Output(inputs, "report").style, inputs.live, inputs.emit, inputs.reach
    plot, view, force = inputs.plot, inputs.view, inputs.force
    output: str | None = None if inputs.output == "-" else inputs.output
    refuse(reach < 0.0, f"--reach must be 0 or more, found {reach:g}")
    seen = live and (sys.stdout.isatty() or sys.stderr.isatty())
    refuse(live and not seen, "--live draws in a terminal, and neither stdout nor stderr is one; see --plot")
    files = [*filter(None, (output, plot, view))]
    refuse(len({*map(os.path.realpath, files)}) < len(files), "the same file: --output, --plot or --view")
    for path in files:
        refuse_existing(path, force=force)
        if not os.path.isdir(os.path.dirname(path) or "."):
            raise FileProblem(f"{path}: no directory {os.path.dirname(path)}")
    summary, interrupted = RunSummary(scene, reach), False
    pictures = _pictures(scene, plot, view)
    try:
        with ExitStack() as stack:  # closes the screen and the output
            watchers: list[Watch] = [summary.watch, *[_paced(monotonic())] * bool(inputs.realtime or live)]
            if live:
                from frametool.view.terminal import Screen

                STATE.cleans_up = True  # the terminal's cursor
                screen = Screen(scene, to_stderr=not sys.stdout.isatty())
                stack.enter_context(screen.live)
            watchers.append(screen.watch if live else event_log(say))
            if output is not None or not (live and sys.stdout.isatty()):
                inputs.use("precision")
                several = emit == "poses" or len(scene.followers) > 1
                records_of = step_writer(emit, style, leaders=leaders, labelled=leaders or several)
                write = stack.enter_context(writing(output, force=force))
                # each record at once, for the reader of a pipe
                watchers.append(lambda step: [write(text) for text in records_of(step)])
            watchers += [watch for watch, _ in pictures.values()]
            inputs.refuse_unused()
            for step in simulate(scene):
                for watch in watchers:
                    watch(step)
    except KeyboardInterrupt:  # --output FILE is not written: it would be incomplete
        interrupted = True
    for line in summary.lines():
        say(line)
    for path, (_, content) in pictures.items():
        with writing(path, force=force) as write:
            write(content())
    if interrupted:
        raise KeyboardInterrupt


SUBCOMMANDS = {
    "follow": (__name__, "a leader, and one or more turtles that follow"),
    "run": (__name__, "a whole scene from one file"),
    "teleop": (__name__, "drive turtle1 with the arrow keys, drawn in the terminal"),
}
HELP = """Replay turtlesim and the turtle-follow tutorial, without ROS and without a screen.

\b
  frametool sim follow --leader square --duration 5 --format csv
  frametool sim follow --spawn 1,1,0 --leader circle --plot follow.svg

Simulated time, exact to turtlesim: 16 ms ticks, float32 poses, the walls. Followers look their leader up in a buffer
of transforms, as `lookup` does. A summary goes to stderr.
"""


sim_command = Group("sim", table=SUBCOMMANDS, help=HELP, epilog=EXIT_CODES)
LAW_OPTIONS = ("rate", "gain_linear", "gain_angular", "max_linear", "max_angular")
SCENE_OPTIONS = ("followers", "duration", "turtlesim")


@sim_command.command("follow", cls=Command)
@option("--leader NAME|FILE|-", "still, circle, square, figure8, random, a file of commands, or - for standard input",
        default="still")
@follow_options("20")
@_of_turtles("--seed", "seed of the random leader", click.IntRange(0), default=0)
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
    argument, seed, is_paced = inputs.leader, inputs.seed, inputs.realtime or inputs.live
    if argument in drivers.LEADERS:
        leader = drivers.built_in(argument, seed)
    elif argument == "-":
        if sys.stdin is None:
            raise FileProblem("standard input is closed")
        say_if_typed()
        # paced, commands act when they arrive
        make, period_ns = (drivers.arriving, 0) if is_paced else (drivers.scripted, BILLION)
        leader = make(read_stream(sys.stdin.buffer, "stdin", period_ns=period_ns))
    else:
        if not os.path.exists(argument) and not os.path.splitext(argument)[1]:
            known = alternatives(argument, drivers.LEADERS, "leaders")
            raise click.UsageError(f"no leader {shown(argument)}{known}, or a file")
        leader = drivers.scripted(read_script(Source(argument, InputFile(argument).text)))
    if inputs.explain_step is None:
        show_run(inputs, scene_of(inputs, leader))
        return
    scene, output = scene_of(inputs, leader), Output(inputs, "report", otherwise="text")
    refuse(output.style.format != "text", f"--explain-step writes text, not {output.style.format}")
    from frametool.sim.followed import derive_follow, follow_steps

    style = output.style.changed(precision=significant(inputs.precision))
    output.text(derive_follow(style, follow_steps(scene, inputs.explain_step)).render(inputs.explain or "text"))


def scene_of(inputs: Inputs, leader: MakeLeader) -> Scene:
    """Return the scene of a leader and followers; raises click.UsageError for invalid options."""
    chosen = {name: getattr(inputs, name) for name in SCENE_OPTIONS}
    holonomic = chosen["turtlesim"] == "ros2" and inputs.holonomic  # ROS 1 always uses linear.y
    with misuse():
        if chosen["followers"]:  # the options of followers have no effect without one
            chosen |= {name: getattr(inputs, name) for name in ("spawn", "target", "delay")}
            chosen["law"] = drivers.FollowController(inputs.law, **{key: getattr(inputs, key) for key in LAW_OPTIONS})
        return tutorial(leader=leader, holonomic=holonomic, **chosen)


@sim_command.command("run", cls=Command)
@argument("scene", FILE)
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
    duration = inputs.duration
    with inline_misuse():
        read = read_scene(source_of(inputs.scene), seed=inputs.seed)
    with misuse():
        chosen = read if duration is None else read._replace(duration_ns=duration_ns(duration))
    # a call is executed at the first tick after its time
    last_ns = math.inf if chosen.duration_ns is None else chosen.duration_ns // TICK_NS * TICK_NS
    if late := [call for call in chosen.calls if call.t_ns >= last_ns]:
        end = f"{(chosen.duration_ns or 0) / BILLION:g} s"
        more = f", nor do{f'es {late[1].place}' if len(late) == 2 else f' {len(late) - 1} more'}" if late[1:] else ""
        say(f"warning: {late[0].place} ({late[0].service}) never happens, the run ends at {end}{more}")
    show_run(inputs, chosen)


@sim_command.command("teleop", cls=Command)
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
    refuse(sys.stdin is None or not sys.stdin.isatty(), f"standard input is no terminal; {drivers.INSTEAD}")
    STATE.cleans_up = True  # the terminal's keys
    with drivers.keyboard(headings=inputs.turtlesim == "ros2") as leader:
        show_run(inputs.changed(live=True), scene_of(inputs, leader), leaders=True)
