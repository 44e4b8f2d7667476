"""`frametool echo`: a transform as a recording goes by, what tf2_echo is for a running robot."""

from __future__ import annotations

import sys
from itertools import islice
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.options import (
    FILE,
    Command,
    Number,
    Skipped,
    Time,
    pose_options,
    reading_options,
    result_options,
    rotation_options,
    rules,
    rules_options,
    verbose_option,
)
from frametool.cli.output import Output
from frametool.cli.trees import FRAME, frame_name, load_tree
from frametool.errors import NoDataAt, ValueInvalid
from frametool.frames.lookups import checked_rate
from frametool.grammar.pose_algebra import result_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.frames.lookups import Replayed
    from frametool.grammar.result import Result

STAMP = Time(latest=False)


class Rate(Number):
    """Steps a second."""

    name = "rate"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number, if a replay can have that rate."""
        try:
            return checked_rate(super().convert(value, param, ctx))
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)


@click.command(cls=Command, name="echo")
@click.argument("tree", type=FILE)
@click.argument("target", type=FRAME)
@click.argument("source", type=FRAME)
@click.option("--rate", type=Rate(), default=1.0, show_default=True, metavar="HZ",
              help="blocks a second, in the time of the recording")  # fmt: skip
@click.option("--start", type=STAMP, metavar="T", help="begin there  [default: when all edges have data]")
@click.option("--stop", type=STAMP, metavar="T", help="end there  [default: when the first edge has no more]")
@click.option("-l", "--limit", type=click.IntRange(1), metavar="N", help="at most so many blocks")
@click.option("--with", "more", multiple=True, type=FILE, metavar="FILE", help="merge this file too; may be repeated")
@rules_options
@reading_options()
@verbose_option
@pose_options
@rotation_options
@result_options("poses")
def command(
    tree: str, target: str, source: str, more: Sequence[str], rate: float, start: int | None, stop: int | None,
    limit: int | None, moving: bool, cache: int | None, tf2: str | None, normalize: bool,
    format_name: str | None, output: str | None, **options: Any,
) -> int:  # fmt: skip
    """Print the pose of SOURCE in TARGET, time after time, as tf2_echo does on a running robot.

    \b
      frametool echo drive.yaml map base_link
      frametool echo drive.yaml map lidar --rate 10 --format csv
      frametool echo drive.yaml lidar box --start 2.5 --limit 1 --precision 6
      ros2 topic echo /tf > tf.txt; frametool echo tf.txt map camera

    Order is TARGET SOURCE, and the first line says in words what is seen from what: tf2_echo names its arguments the
    other way round and then does the same. Blocks are text unless --format or the suffix of --output says otherwise;
    they have 3 decimals unless --precision says otherwise. Stamps are seconds with nine decimals.
    """
    if start is not None and stop is not None and start > stop:
        raise click.UsageError("--start is after --stop")
    form = format_name or (None if output else "text")
    out = Output("poses", format_name=form, output=output, **options)
    frames = load_tree(tree, more, rules(moving=moving, cache=cache, tf2=tf2, normalize=normalize))
    target, source = frame_name(target, frames), frame_name(source, frames)
    out.style.axes = frames.camera_axes.get(source, "")
    replayed = frames.replay(target, source, rate_hz=rate, start_ns=start, stop_ns=stop)
    skipped = Skipped(in_json=out.told == "json")
    results = skipped.counted(_results(replayed, target, source, skipped))
    shown = islice(results, None if limit is None else min(limit, sys.maxsize))
    if out.style.form == "text":
        from frametool.view.pose_text import write_blocks

        out.pieces(write_blocks(shown, target, source, out.style))
    else:
        out.poses_as_they_come(shown)
    return skipped.finish()


def _results(
    replayed: Iterator[Replayed], target: str, source: str, skipped: Skipped
) -> Iterator[Result]:
    """Yield the answers and count the errors; raise the first error where no time has data."""
    for at_ns, found, steps in replayed:
        if isinstance(found, NoDataAt):
            skipped.add(found, steps)
        else:
            yield result_at(found.components, target, source, at_ns)
    if skipped.errors and not skipped.found:
        raise skipped.errors[0]
