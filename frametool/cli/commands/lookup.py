"""`frametool lookup`: where one frame is seen from another, and when."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.explaining import EXPLAIN, PoseTask
from frametool.cli.group import refuse_unused, settings
from frametool.cli.lookup_rows import RowFrames, column_options
from frametool.cli.options import (
    FILE,
    TIME,
    Command,
    Skipped,
    at_ns,
    limit_options,
    pose_options,
    read_times,
    reading_options,
    result_options,
    rotation_options,
    rules,
    rules_options,
    times_option,
    window_of,
)
from frametool.cli.streaming import OPTIONS, stream_options
from frametool.cli.trees import FRAME, CarriedSigmas, frame_name, load_tree, tell_unused_sigmas
from frametool.errors import NoDataAt
from frametool.formats.table import holds_arrays
from frametool.grammar.edges import stop
from frametool.grammar.pose_algebra import looked_up, looked_up_across, looked_up_many, sample_stamps, why_missing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.cli.output import Output
    from frametool.frames.lookups import Frames


WITH_COVARIANCE = ("json", "yaml", "csv")


@click.command(cls=Command, name="lookup")
@click.argument("tree", type=FILE)
@click.argument("target", type=FRAME, required=False, metavar="TARGET")
@click.argument("source", type=FRAME, required=False, metavar="SOURCE")
@click.option("--with", "more", multiple=True, type=FILE, metavar="FILE", help="merge this tree too; may be repeated")
@click.option("--at", type=TIME, metavar="TIME", help="seconds, nanoseconds with ns  [default: latest]")
@click.option("--source-at", type=TIME, metavar="TIME", help="the time at SOURCE, with --fixed; --at: at TARGET")
@click.option("--fixed", type=FRAME, metavar="FRAME", help="what stands still between the two times: map")
@click.option("--covariance", is_flag=True, help="how sure it is, by the edges' sigmas (help covariance)")
@times_option
@limit_options
@rules_options
@reading_options(streams=True)
@pose_options
@rotation_options
@result_options("poses")
@EXPLAIN
@column_options
@stream_options
def command(
    tree: str, target: str | None, source: str | None, more: Sequence[str], at: int | str | None,
    source_at: int | str | None, fixed: str | None, covariance: bool, times: str | None, moving: bool,
    cache: int | None, **options: Any,
) -> int:  # fmt: skip
    """Print the pose of SOURCE in TARGET, which maps points in SOURCE to TARGET.

    \b
      frametool lookup robot.yaml map camera_optical
      frametool lookup drive.yaml map base_link --times 0:4:0.5 --format csv
      frametool lookup drive.yaml lidar lidar --at 4 --source-at 2.5 --fixed map

    TREE is a file, -, or . for FRAMETOOL_TREE's (help time).
    Trajectories and tables (-f tum, csv ..) hold all samples, those from --start to --stop.
    """
    window = window_of(options.pop("start"), options.pop("stop"))
    by_row, task = RowFrames(options), PoseTask(options)
    stream, output = task.stream, task.output
    if task.derives and (by_row or times is not None):
        raise click.UsageError("--explain derives one lookup; name TARGET and SOURCE, and --at TIME if it matters")
    plan = task.plan() if task.derives else None
    if not by_row and (target is None or source is None):
        raise click.UsageError(f"missing argument '{'TARGET' if target is None else 'SOURCE'}'")
    _check(at, source_at, fixed, times, window)
    if target is not None and not (by_row and by_row.target is not None):
        output.check_target(target)
    if covariance:
        _check_covariance(output, derives=task.derives, fixed=fixed, by_row=bool(by_row))
    if by_row:
        refuse_unused("is for one lookup; the rows of a table name theirs", "times", "source_at", "fixed")
        if by_row.time is not None:
            refuse_unused("is one time for all rows; --time-column gives each its own", "at")
    else:
        rows = {*OPTIONS} - {"quiet", "given", *(["on_error"] if times is not None else [])}
        refuse_unused("is about rows: give --time-column, --target-column or --source-column", *rows)
    if times is not None and stream.options["on_error"] == "null":
        raise click.UsageError("--on-error null is for tables; with --times it is stop or skip")
    chosen = rules(moving=moving, cache=cache, normalize=task.normalize)
    frames = load_tree(tree, more, chosen, streams=bool(by_row))
    if not any("order" in asks for _, asks in settings().inputs):
        refuse_unused("changes nothing: that is not left open here", "given")
    sigmas = CarriedSigmas(frames) if covariance else None
    if sigmas is None:
        tell_unused_sigmas(frames)
    if by_row or target is None or source is None:
        return by_row.run(task, frames, target, source, at_ns(at), sigmas, window)
    target, source = frame_name(target, frames), frame_name(source, frames)
    fixed = fixed and frame_name(fixed, frames)
    if plan is not None:
        from frametool.explain import derive

        found = derive.lookup(plan, frames, target, source, at_ns=at_ns(at), source_at_ns=at_ns(source_at), fixed=fixed)
        return task.write(found)
    output.take_axes_in(frames, source)
    output.mark_frames(target, source)
    every = output.holds_all or window is not None
    every = every and at is None and fixed is None and frames.latest(target, source) is not None
    if times is not None or every:
        skip = stream.options["on_error"] == "skip"
        return _many(output, frames, target, source, times, sigmas, window, skip=skip)
    if fixed is not None:
        output.poses([looked_up_across(frames, target, at_ns(at), source, at_ns(source_at), fixed)])
    else:
        result = looked_up(frames, target, source, at_ns(at), covariance=covariance)
        output.poses([result if sigmas is None else sigmas.noted(result)])
    if sigmas is not None:
        sigmas.tell()
    return 0


def _check(
    at: int | str | None, source_at: int | str | None, fixed: str | None, times: str | None,
    window: tuple[int, int] | None,
) -> None:  # fmt: skip
    """Refuse options that do not belong together."""
    if window is not None and (at is not None or fixed is not None):
        raise click.UsageError("--start and --stop are about many times; leave --at, --source-at and --fixed out")
    if (source_at is None) != (fixed is None):
        raise click.UsageError("--source-at and --fixed belong together: two times need a frame that stands still")
    if times is not None and (at is not None or fixed is not None):
        raise click.UsageError("--times says all the times; leave --at, --source-at and --fixed out")


def _check_covariance(output: Output, *, derives: bool, fixed: str | None, by_row: bool) -> None:
    """Refuse --covariance where it has no meaning, and in forms that have no place for it."""
    if derives:
        raise click.UsageError("--explain derives poses; leave --covariance out")
    if fixed is not None:
        raise click.UsageError("--covariance is of one time; across two an edge counts twice, and not independently")
    if output.style.place is not None:
        name = output.style.place.name
        raise click.UsageError(f"--to {name}: the covariance is along the axes of ecef; leave one of the two out")
    form = output.told if by_row else output.style.form
    if form not in (None, "text", *WITH_COVARIANCE) and not holds_arrays(form):
        raise click.UsageError(f"{form} has no place for a covariance; {', '.join(WITH_COVARIANCE)} have")


def _many(
    output: Output, frames: Frames, target: str, source: str, times: str | None, sigmas: CarriedSigmas | None,
    window: tuple[int, int] | None, *, skip: bool,
) -> int:  # fmt: skip
    """Print the results at many times, or at those of all samples; with `skip` the others are left out and reported."""
    skipped = Skipped(in_json=output.told == "json")
    asked = sample_stamps(frames, target, source) if times is None else read_times(times, skipped.add if skip else stop)
    if window is not None:
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
