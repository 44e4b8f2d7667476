"""The pose of one frame in another: `lookup` in a tree, `echo` over a recording, `fk` for rows of joint values."""

from __future__ import annotations

import sys
from itertools import islice
from typing import TYPE_CHECKING, Any

import click

from frametool.cli import options
from frametool.cli.command import FILE, Inputs, argument, command_named, option, refuse, together
from frametool.cli.output import QUATERNION, Output
from frametool.cli.sink import say_error
from frametool.cli.streaming import EXPLAIN, Task, stream_options
from frametool.cli.trees import FRAME, frame_name, load_tree, lookup_time_ns, lookups_in, opened, report_files
from frametool.errors import FrametoolError, NoDataAt, UnknownFrame, warn
from frametool.formats.table import holds
from frametool.geometry.rigid import EXACT, UNCERTAIN
from frametool.grammar import pose_algebra as algebra
from frametool.grammar.edges import stop
from frametool.grammar.pose import LEFT_OUT
from frametool.grammar.readers import EARTH_FRAMES
from frametool.rows.faults import NULL, SKIP, RowsSkipped

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.geometry import Components
    from frametool.grammar.result import Result

WITH_COVARIANCE = ("json", "yaml", "csv")
MANY = ("times", "start", "stop")


MOST_REPORTED = 10  # times without a result


class Skipped:
    """Times without a result: the first are reported, all are counted."""

    def __init__(self, *, in_json: bool) -> None:
        """Start at 0; in_json: write errors as JSON."""
        self.in_json, self.count = in_json, 0
        self.errors: list[FrametoolError] = []

    def add(self, error: FrametoolError | None, count: int = 1) -> None:
        """Count one or several times; store the error if it will be reported."""
        self.count += count
        if error is not None and len(self.errors) < MOST_REPORTED:
            self.errors.append(error)

    def finish(self, found: int) -> int:
        """Report the skipped times; return the exit status.  found: the number of times with a result."""
        if not self.count:
            return 0
        for error in self.errors:
            say_error(error, in_json=self.in_json, fate="skipped")
        count = found + self.count
        total = RowsSkipped(f"{self.count} of {count} times skipped", bad=self.count, rows=count)
        say_error(total, in_json=self.in_json)
        return total.exit_code


# columns of a table of lookups: their content, heading in the help, excluded options
_COLUMNS = (("TARGET", "Rows", ()), ("SOURCE", "Rows", ()), ("time", "Time", ("at",)))


@command_named("lookup", own=("times", "notations"))
@argument("tree", FILE)
@argument("target", FRAME, required=False, metavar="TARGET")
@argument("source", FRAME, required=False, metavar="SOURCE")
@option("--at TIME", "seconds, nanoseconds with ns  [default: latest]", options.read_time, excludes=MANY)
@option("--source-at TIME", "the time at SOURCE, with --fixed; --at: at TARGET", options.read_time, requires=("fixed",),
        excludes=MANY)  # fmt: skip
@option("--fixed FRAME", "static frame between the two times: map", FRAME, excludes=MANY, requires=("source_at",))
@option("--covariance", "also the covariance, from the edges' sigmas (help covariance)", excludes=("explain", "fixed"))
@options.times_option
@options.limit_options
@options.rules_options
@stream_options
@options.reading_options
@options.pose_result_options("poses")
@EXPLAIN
@together(*(
    option(f"--{end.lower()}-column NAME", f"column with the {end} of each row of -i or stdin", options.COLUMN,
           excludes=(*more, "times", "source_at", "fixed", "explain"), under=under)
    for end, under, more in _COLUMNS
))  # fmt: skip
def lookup_command(inputs: Inputs) -> int:
    """Print the pose of SOURCE in TARGET, which maps points in SOURCE to TARGET.

    \b
      frametool lookup robot.yaml map camera_optical
      frametool lookup drive.yaml map base_link --times 0:4:0.5 --format csv
      frametool lookup drive.yaml lidar lidar --at 4 --source-at 2.5 --fixed map

    TREE is a file, -, or . for FRAMETOOL_TREE's (help time).
    Trajectories and tables (-f tum, csv ..) hold all samples, those from --start to --stop.
    """
    output, target, source = Output(inputs, "poses"), inputs.target, inputs.source
    by_row = {inputs.target_column, inputs.source_column, inputs.time_column} != {None}
    refuse(not by_row and source is None, f"missing argument '{'TARGET' if target is None else 'SOURCE'}'")
    if covariance := inputs.covariance:
        refuse(output.style.place, "--covariance is along the axes of ecef; leave --to PLACE out")
        fmt = output.chosen if by_row else output.style.format
        has_none = not (fmt in (None, "text", *WITH_COVARIANCE) or holds(fmt, "arrays"))
        refuse(has_none, f"{fmt} has no place for a covariance; {', '.join(WITH_COVARIANCE)} have")
    tree = load_tree(inputs, inputs.tree, inputs.more, streams=by_row)
    lookups = lookups_in(inputs, tree, carried=covariance)
    status = (_by_row if by_row else _of_two)(inputs, output, lookups, target, source)
    inputs.note(lookups.assumptions())
    return status


def _of_two(inputs: Inputs, output: Output, lookups: algebra.Lookups, target: str, source: str) -> int:
    """Print the pose of one frame in another, or its derivation."""
    tree, at, source_at = lookups.tree, lookup_time_ns(inputs.at), lookup_time_ns(inputs.source_at)
    target, source, fixed = frame_name(target, tree), frame_name(source, tree), inputs.fixed
    fixed = fixed and frame_name(fixed, tree)
    if inputs.explain:
        task = Task(inputs, output=output)
        return task.derive("lookup", tree, target, source, at_ns=at, source_at_ns=source_at, fixed=fixed)
    output.set_camera_axes_of(tree, source)
    every = output.holds_all or {inputs.peek("start"), inputs.peek("stop")} != {None}
    every = every and inputs.at is None and fixed is None and tree.latest(target, source) is not None
    if inputs.times is not None or every:
        return _many(inputs, output, lookups, target, source)
    if fixed is not None:
        output.values([algebra.looked_up_across(tree, target, at, source, source_at, fixed)])
    else:
        output.values([lookups.result(target, source, at)])
    return 0


def _many(inputs: Inputs, output: Output, lookups: algebra.Lookups, target: str, source: str) -> int:
    """Print the results at --times, or at all samples; with --on-error skip report times without a result."""
    tree, window, times = lookups.tree, options.window_of(inputs), inputs.times
    skipped = Skipped(in_json=output.chosen == "json")
    skip = times is not None and inputs.on_error == SKIP
    refuse(times and inputs.on_error == NULL, "--on-error null is for tables; with --times it is stop or skip")
    report = skipped.add if skip else stop
    stamps = algebra.sample_stamps(tree, target, source) if times is None else options.read_times(times, report)
    if window is not None:
        inputs.use("start", "stop")
        stamps = [stamp for stamp in stamps if window[0] <= stamp <= window[1]]
        if not stamps:
            raise NoDataAt(f"no sample of {target} -> {source} from --start to --stop")

    def miss(at_ns: int) -> None:
        is_full = len(skipped.errors) == MOST_REPORTED  # finding the reason is slow
        skipped.add(None if is_full else algebra.why_missing(tree, target, source, at_ns))

    unread = skipped.count
    try:
        output.stream_poses(lookups.results(target, source, stamps, miss if skip else None))
    except NoDataAt as error:
        error.remedy = "; --on-error skip goes on" * (len(stamps) > 1)  # type: ignore[attr-defined]
        raise
    return skipped.finish(len(stamps) + unread - skipped.count)


def _by_row(inputs: Inputs, output: Output, lookups: algebra.Lookups, target: str | None, source: str | None) -> int:
    """Add the pose of SOURCE in TARGET to every row; a frame on the command line applies to all rows."""
    from frametool.rows.request import Operation, Timed

    task, tree, place = Task(inputs, output=output), lookups.tree, output.style.place
    columns = inputs.target_column, inputs.source_column
    if columns[0] is not None and source is None:
        target, source = None, target
    for name, column, called in ((target, columns[0], "TARGET"), (source, columns[1], "SOURCE")):
        refuse((name is None) == (column is None), f"name {called} or its column, one of the two")
    fixed_target, fixed_source = (name and frame_name(name, tree) for name in (target, source))
    if place is not None:
        from frametool.grammar.place import check_in_ecef

        check_in_ecef(fixed_target or EARTH_FRAMES[0], place)
    frames = tuple(each for each in columns if each is not None)
    at = None if inputs.time_column else lookup_time_ns(inputs.at)

    def ends_of(names: str | None) -> tuple[str, str]:
        cells = (names or "").split("\0") if len(frames) == 2 else [names or ""]
        if len(cells) > max(len(frames), 1):
            raise UnknownFrame(names or "", known=tree.frames)  # a cell holds a NUL, the separator of names
        return fixed_target or cells[0], fixed_source or cells[-1]

    def edge_of(names: str | None, own: int | None = at) -> Components:
        ends = ends_of(names)
        if place is not None:
            check_in_ecef(ends[0], place)
        return lookups.one(*ends, own)

    def many(names: str | None, times_ns: Any) -> Components:
        return lookups.many(*ends_of(names), times_ns)

    width = UNCERTAIN if lookups.carried else EXACT
    timed = None if inputs.time_column is None else Timed(inputs.time_column, many, edge_of, width=width)
    request = task.request(
        poses=0, pose_from_frame=edge_of, notations=output.notations or QUATERNION,
        operation=Operation(uncertain=lookups.carried), timed=timed, frames=frames,
    )  # fmt: skip
    return task.run(request)


@command_named("echo")
@argument("tree", FILE)
@argument("target", FRAME)
@argument("source", FRAME)
@option("--rate HZ", "blocks per second, in the time of the recording", options.read_rate, default=1.0)
@option("--start T", "begin there  [default: when all edges have data]", options.read_limit, under="Time")
@option("--stop T", "end there  [default: when the first edge has no more]", options.read_limit, under="Time")
@option("-l --limit N", "print at most N blocks", click.IntRange(1))
@options.moving_options
@options.pose_result_options("poses")
def echo_command(inputs: Inputs) -> int:
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
    options.window_of(inputs)  # refuses a start after the stop
    out = Output(inputs, "poses", otherwise=None if inputs.output else "text")
    refuse(out.style.place and out.style.format == "text", "tf2_echo's blocks have x, y, z; give -f yaml, json or csv")
    frames = load_tree(inputs, inputs.tree, inputs.more)
    target, source = frame_name(target, frames), frame_name(source, frames)
    out.set_camera_axes_of(frames, source)
    if frames.covariances:
        warn(LEFT_OUT.format("echo"))
    replayed = frames.replay(target, source, rate_hz=inputs.rate, start_ns=start, stop_ns=stop)
    skipped, found = Skipped(in_json=out.chosen == "json"), 0

    def results() -> Iterator[Result]:
        """Yield the poses and count the errors; raise the first error if no time has data."""
        nonlocal found
        for at_ns, answer, steps in replayed:
            if isinstance(answer, NoDataAt):
                skipped.add(answer, steps)
            else:
                found += 1
                yield algebra.result_at(answer.components, target, source, at_ns)
        if skipped.errors and not found:
            raise skipped.errors[0]

    shown = islice(results(), None if limit is None else min(limit, sys.maxsize))
    if out.style.format == "text":
        from frametool.view.text import write_blocks

        out.pieces(write_blocks(shown, target, source, out.style))
    else:
        out.stream_poses(shown)
    return skipped.finish(found)


@command_named("fk", own=("input_path", "joints"))
@argument("tree", FILE, metavar="URDF")
@argument("base", FRAME, metavar="BASE")
@argument("tip", FRAME, metavar="TIP")
@stream_options
@options.reading_options
@options.pose_result_options("poses")
def fk_command(inputs: Inputs) -> int:
    """Add the pose of TIP in BASE to rows of joint values.

    \b
      frametool fk arm.urdf arm_base tool -i joints.csv
      frametool fk arm.urdf tool right_finger -i joints.csv --prefix finger_
      printf 't,gripper_mm\\n0,12.5\\n' | frametool fk arm.urdf tool left_finger

    Rows are a table with a column for each joint, JSON lines or YAML documents with a key for each, or JointState
    messages as `ros2 topic echo` prints them. Columns have the names of joints: radians and metres, or elbow_deg, elbow
    [deg], finger_mm. Other columns are unchanged. A joint of the chain without a column needs --joint or --joints; a
    mimic joint follows its leader. For a single posture use `frametool lookup arm.urdf arm_base tool -j elbow=30deg`.
    """
    stream = Task(inputs, "poses")
    if (joints := inputs.peek("joints")) and not stream.path and not stream.has_input():
        words = " ".join((inputs.tree, inputs.base, inputs.tip, *(f"-j {each}" for each in joints)))
        raise click.UsageError(f"no rows of joint values: give -i FILE; for one posture, frametool lookup {words}")
    from frametool.formats.robots.urdf import robot_of
    from frametool.rows.formulas import JointRows, names_in
    from frametool.rows.request import Operation

    (file,) = opened(inputs, (inputs.tree,), streams=True)
    robot, posture = robot_of(file)
    rows = JointRows(robot, posture, frame_name(inputs.base, robot), frame_name(inputs.tip, robot))
    with stream.opened() as source:
        begin = source.peek()
        fmt = stream.format_of(begin)
        refuse(holds(fmt, "arrays"), f"rows of joints are a table of text, records or messages, not {fmt}")
        wanted, header = "a key for each joint, or JointState messages", not inputs.no_header
        names = names_in(begin, fmt, stream.name, wanted, header=header)
        rows.bind(names, stream.name, fixed=frozenset(file.answers.joints))
        file.tally.assumed = ""  # rows have the values of all joints of the chain
        report_files(inputs, [file])
        return stream.run(stream.request(operation=Operation(moves=True, formula=rows), poses=0))
