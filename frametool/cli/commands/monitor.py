"""`frametool monitor`: what a recording says about each of its edges."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from frametool.cli.command import Inputs, argument, command_named, option, refuse
from frametool.cli.options import file_options, offset_option, result_options
from frametool.cli.output import Output
from frametool.cli.sink import say, say_error, say_first
from frametool.cli.trees import opened, state
from frametool.lint.monitor_report import clocks_differ, monitor

if TYPE_CHECKING:

    from frametool.errors import FormatError

FAILED = 1
MOST_TOLD = 3  # frames that come by the topics of two robots


@command_named("monitor")
@argument("recording")
@argument("frames", nargs=-1, metavar="[TARGET SOURCE]")
@option("--with FILE", "read this file too; may be repeated", name="more", multiple=True, under="Files")
@offset_option
@file_options
@result_options("report")
def monitor_command(inputs: Inputs) -> int:
    """Print the rate, count, first and last stamp, largest gap, delay and jumps of each edge of RECORDING.

    \b
      frametool monitor drive.yaml
      frametool monitor drive.yaml map box --format json
      frametool sim follow --duration 2 --emit tf | frametool monitor -

    RECORDING is a bag, a tree that moves, or what `ros2 topic echo /tf` prints. With TARGET and SOURCE only the edges
    between them are reported, and the interval in which all of them have data. Rates are in stamp time; the delay is
    the recorder's clock minus the stamp, known only from bags and `rostopic echo -p`. A gap is the longest pause
    between two stamps, in the order of time; back counts samples that come after a later stamp, reparented the changes
    of parent; gaps are pauses 5 times the median one. length_m is that of the path, speed_mean and speed_max metres a
    second from stamp to stamp. A jump is a step 10 times the median one and longer than 0.1 m or 0.2 rad.
    """
    frames = inputs.frames
    refuse(len(frames) not in (0, 2), f"name TARGET and SOURCE, or neither; found {len(frames)} frames")
    output = Output(inputs, "report")
    files = opened((inputs.recording, *inputs.more))
    clashes: list[FormatError] = []
    report = monitor(files, *frames, normalize=inputs.normalize, clashing=clashes.append)
    inputs.ask("time_offset")
    state(files)
    tell = partial(say_error, in_json=output.chosen == "json")
    say_first(clashes, MOST_TOLD, "frames come by two topics", tell)
    if clocks_differ(report):
        say("note: stamps and the recorder's clock are years apart (simulated time?): the delays say nothing")
    output.report(report)
    return FAILED if clashes else 0
