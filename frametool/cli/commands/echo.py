"""`frametool echo`: a transform as a recording goes by, what tf2_echo is for a running robot."""

from __future__ import annotations

import sys
from itertools import islice
from typing import TYPE_CHECKING

import click

from frametool.cli.command import FILE, Inputs, argument, command_named, option, refuse
from frametool.cli.options import Skipped, read_limit, read_rate, rules, tree_result_options
from frametool.cli.output import Output
from frametool.cli.trees import FRAME, frame_name, load_tree
from frametool.errors import NoDataAt, warn
from frametool.grammar.pose import LEFT_OUT
from frametool.grammar.pose_algebra import result_at

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.frames.lookups import Replayed
    from frametool.grammar.result import Result


@command_named("echo")
@argument("tree", FILE)
@argument("target", FRAME)
@argument("source", FRAME)
@option("--rate HZ", "blocks per second, in the time of the recording", read_rate, default=1.0)
@option("--start T", "begin there  [default: when all edges have data]", read_limit, under="Time")
@option("--stop T", "end there  [default: when the first edge has no more]", read_limit, under="Time")
@option("-l --limit N", "print at most N blocks", click.IntRange(1))
@tree_result_options("poses")
def command(inputs: Inputs) -> int:
    """Print the pose of SOURCE in TARGET over time, like tf2_echo on a running robot.

    \b
      frametool echo drive.yaml map base_link
      frametool echo drive.yaml map lidar --rate 10 --format csv
      frametool echo drive.yaml lidar box --start 2.5 --limit 1 --precision 6

    The order is TARGET SOURCE, as the first line says in words: tf2_echo names its arguments the other way round but
    prints the same. Blocks are text unless --format or the suffix of --output says otherwise; they have 3 decimals
    unless --precision sets another number. Timestamps are seconds with nine decimals. TREE is also what `ros2 topic
    echo /tf` printed (help recordings).
    """
    target, source, start, stop, limit = inputs.target, inputs.source, inputs.start, inputs.stop, inputs.limit
    refuse(start is not None and stop is not None and start > stop, "--start is after --stop")
    out = Output(inputs, "poses", otherwise=None if inputs.output else "text")
    out.check_target(target)
    if out.style.place is not None and out.style.format == "text":
        raise click.UsageError(f"--to {out.style.place.name}: tf2_echo's blocks have x, y, z; -f yaml, json or csv")
    frames = load_tree(inputs.tree, inputs.more, rules(inputs))
    target, source = frame_name(target, frames), frame_name(source, frames)
    out.take_axes_in(frames, source)
    if frames.covariances:
        warn(LEFT_OUT.format("echo"))
    replayed = frames.replay(target, source, rate_hz=inputs.rate, start_ns=start, stop_ns=stop)
    skipped = Skipped(in_json=out.chosen == "json")
    results = skipped.counted(_results(replayed, target, source, skipped))
    shown = islice(results, None if limit is None else min(limit, sys.maxsize))
    if out.style.format == "text":
        from frametool.view.pose_text import write_blocks

        out.pieces(write_blocks(shown, target, source, out.style))
    else:
        out.poses_as_they_come(shown)
    return skipped.finish()


def _results(replayed: Iterator[Replayed], target: str, source: str, skipped: Skipped) -> Iterator[Result]:
    """Yield the answers and count the errors; raise the first error where no time has data."""
    for at_ns, found, steps in replayed:
        if isinstance(found, NoDataAt):
            skipped.add(found, steps)
        else:
            yield result_at(found.components, target, source, at_ns)
    if skipped.errors and not skipped.found:
        raise skipped.errors[0]
