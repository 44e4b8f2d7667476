"""`frametool echo`: a transform as a recording goes by, what tf2_echo is for a running robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import FILE, Command, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.stderr import say
from frametool.cli.times import Time, rules, rules_options
from frametool.cli.trees import FRAME, frame_name, load_tree, verbose_option
from frametool.errors import NoDataAt
from frametool.frames.stamps import BILLION
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.tree import FrameTree

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
@verbose_option
@rotation_options
@result_options("poses")
def command(
    tree: str, target: str, source: str, more: Sequence[str], rate: float, start: int | None, stop: int | None,
    limit: int | None, moving: bool, cache: int | None, tf2: str | None,
    format_name: str | None, output: str | None, **options: Any,
) -> int:  # fmt: skip
    """Tell where SOURCE is seen from TARGET, time after time, as tf2_echo does on a running robot.

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
    times = _times(frames, target, source, rate, start, stop)
    failures: list[NoDataAt] = []
    results = _limited(_results(frames, target, source, times, failures), limit)
    if out.style.form == "text":
        from frametool.view.echo_text import write_block, write_heading

        out.pieces(piece for piece in _blocks(write_heading(target, source), results, write_block, out))
    else:
        out.poses(list(results))
    return _told(failures)


def _blocks(heading: str, results: Iterator[Result], write_block: Any, out: Output) -> Iterator[str]:
    """Yield the heading with the first block, then the others as they are looked up."""
    for result in results:
        yield heading + write_block(result, out.style)
        heading = ""


def _times(
    frames: FrameTree | TransformBuffer, target: str, source: str, rate: float, start: int | None, stop: int | None
) -> Iterator[int | None]:
    """Yield the times to look at: from the first at which every edge has data; None if nothing moves."""
    span = getattr(frames, "span", lambda *_: None)(target, source)
    if span is None:
        yield start
        return
    begin = span[0] if start is None else start
    end = span[1] if stop is None else stop
    if begin > end:
        frames.lookup(target, source, begin if stop is None else stop)  # says what has no data there
        raise click.UsageError("--stop is before the first time at which all edges have data; give --start")
    count = 0
    while (at_ns := begin + round(count * BILLION / rate)) <= end:
        yield at_ns
        count += 1


def _results(
    frames: FrameTree | TransformBuffer, target: str, source: str, times: Iterator[int | None], failures: list[NoDataAt]
) -> Iterator[Result]:
    """Look up at each time; where there is no data, keep the error and go on.

    Raises NoDataAt where no time has any.
    """
    missing = True
    for at_ns in times:
        try:
            found = frames.lookup(target, source, at_ns)
        except NoDataAt as error:
            failures.append(error)
            continue
        missing = False
        extras = {} if at_ns is None else {"stamp_ns": at_ns}
        yield Result(Pose.of(found.components, source, target), extras)
    if missing and failures:
        raise failures[0]


def _limited(results: Iterator[Result], limit: int | None) -> Iterator[Result]:
    from itertools import islice

    return islice(results, limit)


def _told(failures: list[NoDataAt]) -> int:
    """Tell of the times without data; the status says that some are missing."""
    if not failures:
        return 0
    say(str(failures[0]))  # the first one stands for all
    if len(failures) > 1:
        say(f"{len(failures)} times without data")
    return SKIPPED
