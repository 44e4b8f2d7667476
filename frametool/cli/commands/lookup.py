"""`frametool lookup`: where one frame is seen from another, and when."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from frametool.cli.command import FILE, Inputs, argument, command_named, option
from frametool.cli.explaining import EXPLAIN, PoseTask
from frametool.cli.lookup_rows import RowFrames, column_options
from frametool.cli.options import (
    TIME,
    Skipped,
    at_ns,
    limit_options,
    read_times,
    reading_options,
    result_options,
    rules,
    rules_options,
    times_option,
    whole_pose_options,
    window_of,
)
from frametool.cli.streaming import stream_options
from frametool.cli.trees import FRAME, CarriedSigmas, frame_name, load_tree, tell_unused_sigmas
from frametool.errors import NoDataAt
from frametool.formats.table import holds_arrays
from frametool.grammar.edges import stop
from frametool.grammar.pose_algebra import looked_up, looked_up_across, looked_up_many, sample_stamps, why_missing
from frametool.stream.faults import NULL, SKIP

if TYPE_CHECKING:

    from frametool.cli.output import Output
    from frametool.frames.lookups import Frames


WITH_COVARIANCE = ("json", "yaml", "csv")


@command_named("lookup", own=("times", "notations"))
@argument("tree", FILE)
@argument("target", FRAME, required=False, metavar="TARGET")
@argument("source", FRAME, required=False, metavar="SOURCE")
@option("--with FILE", "merge this tree too; may be repeated", name="more", multiple=True, under="Files")
@option("--at TIME", "seconds, nanoseconds with ns  [default: latest]", TIME, excludes=("times", "start", "stop"))
@option("--source-at TIME", "the time at SOURCE, with --fixed; --at: at TARGET", TIME,
    excludes=("times", "start", "stop"), requires=("fixed",))  # fmt: skip
@option("--fixed FRAME", "what stands still between the two times: map", FRAME, excludes=("times", "start", "stop"),
    requires=("source_at",))  # fmt: skip
@option("--covariance", "how sure it is, by the edges' sigmas (help covariance)", excludes=("explain", "fixed"))
@times_option
@limit_options
@rules_options
@reading_options(streams=True)
@stream_options
@whole_pose_options
@result_options("poses")
@EXPLAIN
@column_options
def command(inputs: Inputs) -> int:
    """Print the pose of SOURCE in TARGET, which maps points in SOURCE to TARGET.

    \b
      frametool lookup robot.yaml map camera_optical
      frametool lookup drive.yaml map base_link --times 0:4:0.5 --format csv
      frametool lookup drive.yaml lidar lidar --at 4 --source-at 2.5 --fixed map

    TREE is a file, -, or . for FRAMETOOL_TREE's (help time).
    Trajectories and tables (-f tum, csv ..) hold all samples, those from --start to --stop.
    """
    window = window_of(inputs)
    by_row, task = RowFrames(inputs), PoseTask(inputs)
    output, target, source = task.output, inputs.target, inputs.source
    plan = task.plan() if task.derives else None
    if not by_row and (target is None or source is None):
        raise click.UsageError(f"missing argument '{'TARGET' if target is None else 'SOURCE'}'")
    if target is not None and not (by_row and by_row.target is not None):
        output.check_target(target)
    covariance = plan is None and inputs.covariance
    if covariance:
        _check_covariance(output, by_row=bool(by_row))
    frames = load_tree(inputs.tree, inputs.more, rules(inputs), streams=bool(by_row))
    sigmas = CarriedSigmas(frames) if covariance else None
    if sigmas is None:
        tell_unused_sigmas(frames)
    if by_row or target is None or source is None:
        at = None if by_row.time else at_ns(inputs.at)
        return by_row.run(task, frames, target, source, at, sigmas, window)
    target, source = frame_name(target, frames), frame_name(source, frames)
    at, source_at, fixed = at_ns(inputs.at), at_ns(inputs.source_at), inputs.fixed and frame_name(inputs.fixed, frames)
    if plan is not None:
        from frametool.explain import derive

        return task.write(derive.lookup(plan, frames, target, source, at_ns=at, source_at_ns=source_at, fixed=fixed))
    output.take_axes_in(frames, source)
    output.mark_frames(target, source)
    every = output.holds_all or window is not None
    every = every and inputs.at is None and fixed is None and frames.latest(target, source) is not None
    if inputs.times is not None or every:
        return _many(output, frames, target, source, inputs, sigmas, window)
    if fixed is not None:
        output.poses([looked_up_across(frames, target, at, source, source_at, fixed)])
    else:
        result = looked_up(frames, target, source, at, covariance=covariance)
        output.poses([result if sigmas is None else sigmas.noted(result)])
    if sigmas is not None:
        sigmas.tell()
    return 0


def _check_covariance(output: Output, *, by_row: bool) -> None:
    """Refuse --covariance where it has no meaning, and in forms that have no place for it."""
    if output.style.place is not None:
        name = output.style.place.name
        raise click.UsageError(f"--to {name}: the covariance is along the axes of ecef; leave one of the two out")
    form = output.told if by_row else output.style.form
    if form not in (None, "text", *WITH_COVARIANCE) and not holds_arrays(form):
        raise click.UsageError(f"{form} has no place for a covariance; {', '.join(WITH_COVARIANCE)} have")


def _many(
    output: Output, frames: Frames, target: str, source: str, inputs: Inputs, sigmas: CarriedSigmas | None,
    window: tuple[int, int] | None,
) -> int:  # fmt: skip
    """Print the results at --times, or at those of all samples; with --on-error skip others are left out, and told."""
    times, skipped = inputs.times, Skipped(in_json=output.told == "json")
    skip = times is not None and inputs.on_error == SKIP
    if times is not None and inputs.on_error == NULL:
        raise click.UsageError("--on-error null is for tables; with --times it is stop or skip")
    asked = sample_stamps(frames, target, source) if times is None else read_times(times, skipped.add if skip else stop)
    if window is not None:
        inputs.ask("start", "stop")
        asked = [stamp for stamp in asked if window[0] <= stamp <= window[1]]
        if not asked:
            raise NoDataAt(f"no sample of {target} -> {source} from --start to --stop")

    def miss(at_ns: int) -> None:
        skipped.add(None if skipped.is_full else why_missing(frames, target, source, at_ns))

    carried = sigmas is not None
    results = looked_up_many(frames, target, source, asked, miss=miss if skip else None, covariance=carried)
    output.poses_as_they_come(skipped.counted(results if sigmas is None else map(sigmas.noted, results)))
    if sigmas is not None:
        sigmas.tell()
    return skipped.finish()
