"""`frametool echo`: a transform as a recording goes by, what tf2_echo is for a running robot."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import FILE, Command, result_options, rotation_options, verbose_option
from frametool.cli.output import Output
from frametool.cli.stderr import say
from frametool.cli.times import Time, rules, rules_options
from frametool.cli.trees import FRAME, frame_name, load_tree, topic_option
from frametool.errors import NoDataAt
from frametool.grammar.looked_up import result_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.geometry.transform import Transform
    from frametool.grammar.result import Result

SKIPPED = 3
STAMP = Time(latest=False)


@click.command(cls=Command, name="echo")
@click.argument("tree", type=FILE)
@click.argument("target", type=FRAME)
@click.argument("source", type=FRAME)
@click.option("--rate", type=click.FloatRange(min=0, min_open=True), default=1.0, show_default=True, metavar="HZ",
              help="blocks a second, in the time of the recording")  # fmt: skip
@click.option("--start", type=STAMP, metavar="T", help="begin there  [default: when all edges have data]")
@click.option("--stop", type=STAMP, metavar="T", help="end there  [default: when the first edge has no more]")
@click.option("-l", "--limit", type=click.IntRange(1), metavar="N", help="at most so many blocks")
@click.option("--with", "more", multiple=True, type=FILE, metavar="FILE", help="merge this file too; may be repeated")
@rules_options
@topic_option
@verbose_option
@rotation_options
@result_options("poses")
def command(
    tree: str, target: str, source: str, more: Sequence[str], rate: float, start: int | None, stop: int | None,
    limit: int | None, moving: bool, cache: int | None, tf2: str | None,
    format_name: str | None, output: str | None, **options: Any,
) -> int:  # fmt: skip
    """Print the pose of SOURCE in TARGET, time after time, as tf2_echo does on a running robot.

    \b
      frametool echo drive.yaml map base_link
      frametool echo drive.yaml map lidar --rate 10 --format csv
      frametool echo drive.yaml lidar box --start 2.5 --limit 1 --precision 6
      ros2 topic echo /tf > tf.txt; frametool echo tf.txt --with tf_static.txt map camera

    Order is TARGET SOURCE, and the first line says in words what is seen from what: tf2_echo names its arguments the
    other way round and then does the same. Blocks are text unless --format or the suffix of --output says otherwise;
    they have 3 decimals unless --precision says otherwise. Stamps are seconds with nine decimals.
    """
    if start is not None and stop is not None and start > stop:
        raise click.UsageError("--start is after --stop")
    form = format_name or (None if output else "text")
    out = Output("poses", format_name=form, output=output, **options)
    frames = load_tree(tree, more, rules(moving=moving, cache=cache, tf2=tf2))
    target, source = frame_name(target, frames), frame_name(source, frames)
    replayed = frames.replay(target, source, rate_hz=rate, start_ns=start, stop_ns=stop)
    failures = Failures()
    results = islice(_results(replayed, target, source, failures), limit)
    if out.style.form == "text":
        from frametool.view.echo_text import write_blocks

        out.pieces(write_blocks(results, target, source, out.style))
    else:
        out.poses(list(results))
    return failures.told()


class Failures:
    """Times without data: the first error stands for all."""

    def __init__(self) -> None:
        """Create an empty count."""
        self.first: NoDataAt | None = None
        self.count = 0

    def add(self, error: NoDataAt) -> None:
        """Count one."""
        self.first = self.first or error
        self.count += 1

    def told(self) -> int:
        """Report them on stderr; returns the exit status."""
        if self.first is not None:
            say(str(self.first))
        if self.count > 1:
            say(f"{self.count} times without data")
        return SKIPPED if self.count else 0


def _results(
    replayed: Iterator[tuple[int | None, Transform | NoDataAt]], target: str, source: str, failures: Failures
) -> Iterator[Result]:
    """Yield the answers and count the errors; raise the first error where no time has data."""
    missing = True
    for at_ns, found in replayed:
        if isinstance(found, NoDataAt):
            failures.add(found)
        else:
            missing = False
            yield result_at(found.components, target, source, at_ns)
    if missing and failures.first is not None:
        raise failures.first
