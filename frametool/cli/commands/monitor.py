"""`frametool monitor`: what a recording says about each of its edges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import FILE, TEXT, Command, result_options
from frametool.cli.output import Output
from frametool.cli.recordings import opened
from frametool.cli.trees import verbose_option
from frametool.errors import FormatError
from frametool.frames.edge_log import EdgeLog, chain
from frametool.lint.monitor_report import chain_entry, edge_entry

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.formats.recordings import Recording


@click.command(cls=Command, name="monitor")
@click.argument("recording", type=TEXT)
@click.argument("frames", nargs=-1, type=TEXT, metavar="[TARGET SOURCE]")
@click.option("--with", "more", multiple=True, type=FILE, metavar="FILE", help="read this file too; may be repeated")
@verbose_option
@result_options("report")
def command(recording: str, frames: Sequence[str], more: Sequence[str], **options: Any) -> None:
    """Tell the rate, count, first and last stamp, largest gap, delay and jumps of each edge of RECORDING.

    \b
      frametool monitor drive.yaml
      frametool monitor drive.yaml map box --format json
      ros2 topic echo /tf | frametool monitor -

    With TARGET and SOURCE only the edges between them are told, and the interval in which all of them have data.
    Rates are in stamp time: what the recorder's clock did is the delay, known from bags and `rostopic echo -p` only.
    A gap is the longest pause between two stamps, in the order of time; back counts samples that come after a later
    stamp, reparented the changes of parent. A jump is a step 10 times the median one and longer than 0.1 m or
    0.2 rad.
    """
    if len(frames) not in (0, 2):
        raise click.UsageError(f"name TARGET and SOURCE, or neither; found {len(frames)} frames")
    output = Output("report", **options)
    logs = _logs(opened((recording, *more)))
    children = chain(logs, frames[0], frames[1]) if frames else list(logs)
    entries = [edge_entry(logs[child]) for child in children]
    if frames:
        entries.append(chain_entry(frames[0], frames[1], [logs[child] for child in children]))
    output.report(entries)


def _logs(recordings: Sequence[Recording]) -> dict[str, EdgeLog]:
    """Log every edge of the recordings, in the order of first mention."""
    logs: dict[str, EdgeLog] = {}
    for recording in recordings:
        for edge in recording.edges():
            if edge.parent is not None:
                log = logs.get(edge.child) or logs.setdefault(edge.child, EdgeLog(edge.child))
                log.add(edge.parent, edge.components, edge.stamp_ns, edge.line, edge.received_ns)
    if not logs:
        raise FormatError("no transforms in it", source=", ".join(recording.name for recording in recordings))
    return logs
