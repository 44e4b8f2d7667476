"""`frametool resample`: a trajectory at other moments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.cli import options
from frametool.cli.command import Inputs, argument, command_named, option, refuse
from frametool.cli.commands.compare import gap_option, read_delta, trajectory, trajectory_options, write_trajectory
from frametool.cli.output import Output
from frametool.cli.sink import say
from frametool.errors import FormatError, warn
from frametool.formats.table import by_name, writers
from frametool.frames.path import seconds
from frametool.grammar.edges import stop
from frametool.stream.faults import ROWS_SKIPPED

if TYPE_CHECKING:
    from frametool.frames.trajectory import Trajectory


@command_named("resample")
@argument("path", metavar="TRAJ")
@option("--rate HZ", "poses per second, from the first on", options.read_rate)
@option("--at FILE|TIMES", "at the timestamps of a file; T,T,.., START:STOP:STEP", name="times")
@option("--every 1m|5deg", "at even steps of distance or rotation", lambda text: read_delta(text, "m", "deg"))
@gap_option
@trajectory_options
@options.limit_options
@options.rotation_options
@options.result_options("poses")
def command(inputs: Inputs) -> int:
    """Interpolate a trajectory at other times: positions along the line, rotations by slerp.

    \b
      frametool resample walk.tum --rate 10
      frametool resample truth.tum --at mono.tum -o same_stamps.tum
      frametool resample walk.tum --every 0.5m -f csv

    TRAJ is a trajectory as for `compare`. There are no poses beyond its ends, nor in gaps longer than --max-gap; the
    number of times without a pose is reported.
    """
    path, rate, times, every = inputs.path, inputs.rate, inputs.times, inputs.every
    refuse(sum(each is not None for each in (rate, times, every)) != 1, "give one of --rate, --at and --every")
    output = Output(inputs, "poses", otherwise=by_name(path, writers("poses")) or "csv")
    (fmt,) = options.for_each(inputs.input_formats, 1)
    found, name, skipped = trajectory(inputs, path, fmt, inputs.on_error)
    from frametool.fit.alignment import resampled, stamps_at_rate, stamps_every

    found = _in_order(found, name)
    counted = found.stamps_ns is None
    if counted:
        refuse(every is None, f"{name} has no stamps; give them with --stamps FILE")
        found = found.numbered()
    if every:
        stamps = stamps_every(found, every)
    else:
        stamps = stamps_at_rate(found, rate) if rate else _stamps(inputs, times or "")
    if not counted and (window := options.window_of(inputs)):
        inputs.ask("start", "stop")
        stamps = stamps[(window[0] <= stamps) & (stamps <= window[1])]
    made = resampled(found, stamps, inputs.max_gap_ns)
    if lost := len(stamps) - made.size:
        first, last = map(int, found.stamps_ns[[0, -1]])
        in_gap = " or in a gap" * int(lost > ((stamps < first) | (stamps > last)).sum())
        lies, are = ("lies", "is") if lost == 1 else ("lie", "are")
        span = f"{seconds(first)} .. {seconds(last)} s of {name}{in_gap}"
        say(f"note: {lost} of {len(stamps)} times {lies} outside {span} and {are} left out")
    write_trajectory(output, made._replace(stamps_ns=None) if counted else made)
    return ROWS_SKIPPED if skipped else 0


def _stamps(inputs: Inputs, text: str) -> Any:
    """Read the stamps of a trajectory, or a list of times."""
    import numpy as np

    from frametool.errors import FileProblem

    try:
        found, name, _ = trajectory(inputs, text)
    except (FormatError, FileProblem):
        return np.array(options.read_times(text, stop), np.int64)
    refuse(found.stamps_ns is None, f"--at {text}: the poses there have no stamps")
    return _in_order(found, name).stamps_ns


def _in_order(found: Trajectory, name: str) -> Trajectory:
    """Sort a trajectory; warn of what that changes."""
    for hint in found.disorder(name):
        warn(hint)
    return found.in_order()
