"""Trajectories: `compare` with a reference, `align` to it, `resample` at other times."""

from __future__ import annotations

import os
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from frametool.cli import options, poses
from frametool.cli.command import FILE, Inputs, argument, command_named, option, refuse, refuse_two_readers, together
from frametool.cli.output import Output
from frametool.cli.sink import refuse_existing, say, say_error, writing
from frametool.cli.trees import answers, load_tree
from frametool.errors import FileProblem, FormatError, FrametoolError, ValueInvalid, shown, warn
from frametool.formats.table import by_name, writers
from frametool.frames.stamps import parse_stamp, parse_time
from frametool.frames.topology import seconds
from frametool.grammar.edges import stop
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result
from frametool.rows.faults import ROWS_SKIPPED, STOP, BadRows
from frametool.text.numbers import parse_lengths, parse_share

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.fit.comparison import Comparison
    from frametool.fit.trajectory_errors import Delta
    from frametool.frames.trajectory import Trajectory

UP = {
    "x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0), "-y": (0.0, -1.0, 0.0), "-z": (0.0, 0.0, -1.0),
}  # fmt: skip
LIMITS = options.parser("frametool.fit.limits", "parse_limits")
ALIGN = ("se3", "sim3", "yaw", "origin", "origin+scale", "none")


def _read_offset(text: str) -> tuple[int | str, float | None]:
    word, colon, limit = text.partition(":")
    if word != "auto":
        return parse_time(text), None
    seconds = parse_time(limit) / 1e9 if colon else None
    if seconds is not None and seconds <= 0:
        raise ValueInvalid(f"{shown(text)}: how far is looked behind auto: is more than 0 s")
    return "auto", seconds


def _read_limit(text: str) -> tuple[bool, int]:
    """Parse `12.5`, on the reference's clock, or `+5s`, after the first pair: (False, ns) or (True, ns)."""
    return (True, options.read_span(text[1:])) if text.startswith("+") else (False, parse_stamp(text))


def read_delta(text: str, *units: str) -> Delta:
    """Parse a step in one of the units, all by default; a number of frames needs no unit."""
    from frametool.fit.trajectory_errors import parse_delta

    return parse_delta(f"{text}frames" if text.isdigit() and "frames" in units else text, *[units] * bool(units))


gap_option = option("--max-gap TIME", "longest gap to interpolate  [default: 3 medians]", options.read_span,
                    name="max_gap_ns")  # fmt: skip
pairing_options = together(
    option("--match HOW", "interpolate or nearest  [default: interpolate]", ("interpolate", "nearest")),
    gap_option,
    option("--max-diff TIME", "largest difference of stamps  [default: 10ms]", options.read_span, name="max_diff_ns"),
    option("--min-match SHARE", "fewer pairs are an error  [default: 10%]", parse_share),
    option("--start TIME", "ignore pairs before, a stamp of REF; +5s: after the first", _read_limit, under="Time"),
    option("--stop TIME", "ignore pairs after", _read_limit, under="Time"),
    option("--offset TIME|auto", "seconds by which EST's clock lags; auto:LIMIT", _read_offset),
    option("--mount POSE|auto", "pose of REF's sensor in EST's body; FILE:BODY:POINT"),
    option("--align FIT", ", ".join(ALIGN).replace("se3", "se3 (default)", 1), ALIGN),
    option("--align-first N|10s|5m", "fit to the first pairs only", lambda text: read_delta(text, "frames", "s", "m")),
    option("--tie-first", "with se3, sim3, yaw: first positions coincide"),
    option("--up AXIS", "up axis of REF's world: z, -y ..  [default: z]", (*UP,)),
)
trajectory_options = together(
    option("--on-error", "bad rows", (STOP, "skip"), default=STOP, under="Rows"), options.reading_options
)
REPORTS = {".html": "html", ".htm": "html", ".svg": "svg"}
EXCEEDED, TROUBLE = 1, 2
EXIT_CODES = "Exit codes: 0 done, 1 bad data, 2 usage, 3 rows skipped, 5 file; --fail: 0 within, 1 exceeded, 2 error."


@command_named("compare", epilog=EXIT_CODES)
@argument("ref", FILE)
@argument("est", FILE, nargs=-1, required=True, metavar="EST..")
@pairing_options
@option("--delta 1m,5deg,..", "of rpe, also s, deg, frames  [default: 1m,10m,100m]",
        lambda text: tuple(map(read_delta, text.split(","))), name="deltas")  # fmt: skip
@option("--all-pairs", "rpe from every pose, not from end to end")
@option("--tolerance SHARE", "of --delta with --all-pairs  [default: 10%]", parse_share, requires=("all_pairs",))
@option("--pairs-from WHICH", "reference or estimate  [default: reference]", ("reference", "estimate"))
@option("--segments 100,200,..", "lengths of kitti, metres  [default: 100,..,800]", parse_lengths)
@option("--segment-step N", "one for every N-th pair  [default: 10]", click.IntRange(1))
@option("--as", "defaults of evo", ("evo",), name="like")
@option("--rows [=ate|rpe|kitti]", "one row per pair, step or segment: CSV, JSON")
@option("--explain", "the formulas with this run's numbers", ("text",), under="Result", excludes=("rows",))
@option("--fail LIMIT,..", "exit with 1 if a limit is exceeded: ate>5cm", LIMITS, name="limits")
@option("--report FILE.html|svg", "also write a report in one file; with -o instead",
        partial(options.read_path, suffixes=REPORTS))  # fmt: skip
@trajectory_options
@options.list_options("markdown", "latex")
def compare_command(inputs: Inputs) -> int:
    """Compare trajectories with a reference: absolute and relative errors.

    \b
      frametool compare truth.tum odometry.tum --offset auto
      frametool compare truth.tum truth.tum mono.tum --align sim3 -f markdown
      frametool compare antenna.csv truth.tum --mount auto --report error.html
      frametool compare truth.tum mono.tum --align sim3 --fail 'ate>1m,paired<90%'

    REF and EST are trajectories or positions in any format (help trajectories).
    """
    limits, force, path = inputs.limits or (), inputs.force, inputs.output or ""
    instead = path if inputs.format_name is None and options.suffix_of(path) in REPORTS else None
    reports = [path for path in (inputs.report, instead) if path]
    for path in reports:
        refuse_existing(path, force=force)
        is_one = len(inputs.est) == 1 or REPORTS[options.suffix_of(path)] != "svg"
        refuse(not is_one, "an SVG shows one comparison; write .html for several")
    output = Output(inputs, "report", otherwise="text")
    explain, rows = (None, None) if instead else (inputs.explain, inputs.rows)
    refuse(explain and output.style.format != "text", f"--explain writes text, not {output.style.format}")
    try:
        found, skipped = comparisons(inputs.ref, inputs.est, inputs)
        every = [each.as_dict() for each in found]
        checked = [(each, limit) for each in every for limit in limits]
        exceeded = [(each, limit, now) for each, limit in checked if (now := limit.passed(each)) is not None]
        for path in reports:
            import shlex

            from frametool.view.comparison_report import write_report

            line = shlex.join(["frametool", *click.get_current_context().obj])
            with writing(path, force=force) as write:
                write(write_report(found, REPORTS[options.suffix_of(path)], line))
        if explain:
            from frametool.explain.derive import write_explanation

            output.text("\n".join(map(write_explanation, every)))
        elif not instead:
            _write(output, found, every, rows)
    except FrametoolError as error:
        if limits:
            error.exit_code = TROUBLE
        raise
    for each, limit, now in exceeded:
        say(f"limit exceeded: {each['est']}: {limit.name} is {now:.6g}, {limit.text}")
    return EXCEEDED if exceeded else (TROUBLE if limits else ROWS_SKIPPED) if skipped else 0


def _write(output: Output, found: Sequence[Any], every: list[dict[str, Any]], rows: str | None) -> None:
    """Write rows, a table of several comparisons, or the comparisons."""
    from frametool.fit.comparison import rows as rows_of
    from frametool.view.comparison_report import write_comparison, write_table

    fmt = output.style.format
    if rows:
        refuse(fmt in ("markdown", "latex"), f"--rows are written as csv, json or yaml, not as {fmt}")
        several = len(found) > 1
        records = [{"est": each.names[1]} | row if several else row for each in found for row in rows_of(each, rows)]
        output.style = output.style.changed(format="csv" if fmt == "text" else fmt)
        output.report(records)
    elif fmt in ("csv", "markdown", "latex") or (fmt == "text" and len(every) > 1):
        output.text(write_table(every, fmt))
    elif fmt == "text":
        output.text(write_comparison(every[0]))
    else:
        output.report(every)


@command_named("align")
@argument("ref", FILE)
@argument("est", FILE)
@pairing_options
@option("--names REF,EST", "names of the two worlds  [default: their own]", partial(options.read_names, spec="REF,EST"))
@trajectory_options
@options.rotation_options
@options.result_options("poses")
def align_command(inputs: Inputs) -> int:
    """Print the pose of EST's world in REF's, as `compare` fits it, as a tree entry.

    \b
      frametool align truth.tum odometry.tum --offset auto --names map,odom
      frametool align truth.tum odometry.tum --offset auto -o aligned.tum
      frametool align truth.tum mono.tum --align sim3 --to matrix

    -o FILE writes all of EST as it was compared: on REF's clock, with the mount and the fit applied, in the format of
    its suffix or of -f. `frametool help trajectories` describes the fits. The scale of sim3 is separate from the pose:
    p' = scale R p + t; such an entry cannot be part of a tree.
    """
    into = Output(inputs, "poses") if inputs.output else None
    entry = Output(inputs.changed(output=None, format_name=None) if into else inputs, "poses")
    (found,), skipped = comparisons(inputs.ref, [inputs.est], inputs)
    from frametool.fit.comparison import worlds

    named = inputs.names or worlds(found)
    whole = found.whole_estimate()._replace(world=found.pairs.ref.world)
    if into is not None or entry.is_trajectory:
        write_trajectory(into or entry, whole)
    if not entry.is_trajectory:
        pose = Pose.of(found.fit.transform.components, named[1], named[0])
        entry.values([Result(pose._replace(scale=found.fit.scale))])
    return ROWS_SKIPPED if skipped else 0


@command_named("resample")
@argument("path", FILE, metavar="TRAJ")
@option("--rate HZ", "poses per second, from the first on", options.read_rate)
@option("--at FILE|TIMES", "at the timestamps of a file; T,T,.., START:STOP:STEP", name="times")
@option("--every 1m|5deg", "at even steps of distance or rotation", lambda text: read_delta(text, "m", "deg"))
@gap_option
@trajectory_options
@options.limit_options
@options.rotation_options
@options.result_options("poses")
def resample_command(inputs: Inputs) -> int:
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
    from frametool.fit.pairing import between, stamps_at_rate, stamps_every
    from frametool.rows.trajectories import in_order

    found = in_order(found, name)
    counted = found.stamps_ns is None
    if counted:
        refuse(every is None, f"{name} has no stamps; give them with --stamps FILE")
        found = found.numbered()
    if every:
        stamps = stamps_every(found, every)
    elif rate:
        stamps = stamps_at_rate(found, rate)
    else:  # the stamps of a trajectory, or a list of times
        import numpy as np

        try:
            other, other_name, _ = trajectory(inputs, times or "")
        except (FormatError, FileProblem):
            stamps = np.array(options.read_times(times or "", stop), np.int64)
        else:
            refuse(other.stamps_ns is None, f"--at {times}: the poses there have no stamps")
            stamps = in_order(other, other_name).stamps_ns
    if not counted and (window := options.window_of(inputs)):
        inputs.use("start", "stop")
        stamps = stamps[(window[0] <= stamps) & (stamps <= window[1])]
    made = between(found, stamps, inputs.max_gap_ns)[0]
    if lost := len(stamps) - made.size:
        first, last = map(int, found.stamps_ns[[0, -1]])
        in_gap = " or in a gap" * int(lost > ((stamps < first) | (stamps > last)).sum())
        lies, are = ("lies", "is") if lost == 1 else ("lie", "are")
        span = f"{seconds(first)} .. {seconds(last)} s of {name}{in_gap}"
        say(f"note: {lost} of {len(stamps)} times {lies} outside {span} and {are} left out")
    write_trajectory(output, made._replace(stamps_ns=None) if counted else made)
    return ROWS_SKIPPED if skipped else 0


def trajectory(inputs: Inputs, argument: str, fmt: str = "", on_error: str = STOP) -> tuple[Trajectory, str, bool]:
    """Read a trajectory of the command line; return it, its name in messages, and True if rows were skipped."""
    from frametool.rows.trajectories import read_trajectory, split_name

    made: list[BadRows] = []

    def policy(name: str) -> BadRows:
        made.append(BadRows(name, on_error, tell=say_error))
        return made[-1]

    known = answers(inputs)
    found = read_trajectory(
        argument, fmt=fmt, topics=inputs.topics, answers=known._replace(time_offset=0), policy=policy,
        normalize=bool(inputs.normalize),
    )  # fmt: skip
    if found.stamps_ns is not None:
        inputs.use("time_offset")
        found = found._replace(stamps_ns=found.stamps_ns + known.time_offset)
    file, inside = split_name(argument)
    name = ":".join(["stdin" if file == "-" else os.path.basename(file), *inside])
    return found, name, any(bad.count for bad in made)


def comparisons(ref: str, ests: Sequence[str], inputs: Inputs) -> tuple[list[Comparison], bool]:
    """Compare estimates with a reference by the options, with warnings.

    Also returns True if rows were skipped.
    """
    from frametool.fit.comparison import EVO, SETTINGS, Settings, compared

    refuse_two_readers([ref, *ests])
    base = EVO if inputs.like else Settings()
    of_other_match = "max_gap_ns" if (inputs.match or base.pairing.match) == "nearest" else "max_diff_ns"
    names = (name for name in SETTINGS if name != of_other_match)
    passed = {name: value for name in names if (value := getattr(inputs, name)) is not None}
    if "offset" in passed:
        passed["offset"], limit = passed["offset"]
        passed |= {} if limit is None else {"offset_limit_s": limit}
    if "up" in passed:
        passed["up"] = UP[passed["up"]]
    if "mount" in passed:
        passed["mount"] = _mount(inputs, passed["mount"])
    chosen, formats = base.changed(**passed), options.for_each(inputs.input_formats, 1 + len(ests))
    reference, ref_name, skipped = trajectory(inputs, ref, formats[0], inputs.on_error)
    found = []
    for est, fmt in zip(ests, formats[1:], strict=True):
        estimate, name, some = trajectory(inputs, est, fmt, inputs.on_error)
        skipped |= some
        found.append(compared(reference, estimate, chosen, (ref_name, name)))
        for hint in found[-1].hints:
            warn(hint)
    return found, skipped


def _mount(inputs: Inputs, text: str) -> Any:
    """Read --mount: auto, a pose, or FILE:BODY:POINT, the pose of the frame POINT in BODY."""
    if text == "auto":
        return text
    if poses.is_pasted(text):
        from frametool.geometry.transform import Transform
        from frametool.rows.request import Request

        return Transform.of(*poses.one_pose(text, Request()).components)
    from frametool.rows.trajectories import split_name

    file, names = split_name(text)
    refuse(len(names) != 2, f"--mount {shown(text)}: a pose, auto, or FILE:BODY:POINT")
    return load_tree(inputs, file).lookup(names[0], names[1])


def write_trajectory(output: Output, found: Trajectory) -> None:
    """Write poses, or positions, in any format that holds them; default frame names are omitted."""
    import numpy as np

    from frametool.frames.trajectory import BODY, WORLD
    from frametool.rows.batch import RowPoses
    from frametool.rows.shapes import POINT, POSE

    world, body = (found.world, found.body) if (found.world, found.body) != (WORLD, BODY) else (None, None)
    kind, names = (POINT, [None]) if found.xyzw is None else (POSE, [body])
    numbers = (found.xyz if kind == POINT else np.stack(found.poses.components, axis=-1)) + 0.0  # none is -0.0
    output.rows(RowPoses(numbers, found.stamps_ns, np.arange(found.size), [world], names, {}, kind=kind))
