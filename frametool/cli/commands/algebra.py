"""Arithmetic of poses: `compose`, `invert`, `relative`, `interpolate`, `mean`, `between`."""

from __future__ import annotations

from functools import partial, reduce
from typing import Any

from frametool.cli import options, poses
from frametool.cli.command import FILE, Inputs, argument, command_named, misuse, option, refuse
from frametool.cli.output import Output
from frametool.cli.sink import say, say_first
from frametool.cli.streaming import EXPLAIN, Task, pose_stream_options
from frametool.errors import warn
from frametool.grammar.pose import LEFT_OUT, Pose
from frametool.grammar.result import Result
from frametool.rows.faults import MOST
from frametool.rows.request import NO_STAMPS, PREVIOUS, START, VELOCITIES, Operation, Request, RowOptions
from frametool.rows.shapes import VECTOR
from frametool.text.numbers import parse_fractions, parse_number


@command_named("compose")
@argument("poses", FILE, nargs=-1, required=True, metavar="POSE POSE ..")
@pose_stream_options
@options.pose_result_options("poses")
@options.scale_option
@EXPLAIN
@options.offset_option
def compose_command(inputs: Inputs) -> int:
    """Multiply poses, left to right: a_from_b, b_from_c -> a_from_c.

    \b
      frametool compose '{xyz: [1, 2, 3]}' '{rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map tool | frametool compose - '{xyz: [0,0,1]}'
      frametool compose 'inv({xyz: [1, 2, 3]})' '~{rpy_deg: [0, 0, 90]}'
      frametool compose inv '{rpy_deg: [0, 0, 90]}' '{xyz: [14, -4, 0]}'

    POSE is a mapping, a file, or - for standard input. If poses name their frames, adjacent frames must match. The
    inverse of a pose is inv(POSE) or ~POSE, in quotes, or the word inv before it.
    """
    task = Task(inputs, "poses")
    if task.plan:
        return task.derive("compose", *map(task.read_written, inputs.poses))
    from frametool.grammar.pose_algebra import product

    request = task.request(operation=Operation(similar=True, multiples=inputs.scale))
    rows = poses.rows_among(inputs.poses, request, task)
    before = reduce(product, rows.before) if rows.before else None

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        result = reduce(product, [*filter(None, [before]), Pose(name=name, parent=parent), *rows.behind])
        return result.parent, result.name

    behind = tuple(each.placed for each in rows.behind)
    operation = Operation(before and before.placed, behind, similar=True, multiples=inputs.scale)
    return task.write_results(rows.argument, request._replace(operation=operation, rename=rename), rows.timed)


@command_named("invert")
@argument("pose", FILE, default="-")
@pose_stream_options
@options.pose_result_options("poses")
@options.scale_option
@EXPLAIN
@options.offset_option
def invert_command(inputs: Inputs) -> int:
    """Invert poses: a_from_b -> b_from_a; frame names are swapped.

    \b
      frametool invert '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool invert -

    POSE is a mapping, a file, or - for standard input, also with several poses.
    """
    task = Task(inputs, "poses")
    if task.plan:
        return task.derive("invert", task.read_written(inputs.pose))
    inverse = Operation(inverse=True, similar=True, multiples=inputs.scale)
    return task.write_results(inputs.pose, task.request(operation=inverse, rename=lambda parent, name: (name, parent)))


@command_named("relative")
@argument("a", FILE, required=False)
@argument("b", FILE, required=False)
@pose_stream_options
@options.pose_result_options("poses")
@option("--consecutive", "of a stream, each row relative to the row before it", excludes=("first", "explain"))
@option("--first", "of a stream, each row relative to the first", excludes=("explain",))
@option("--velocity", "with --consecutive, also the twist between rows, m/s and rad/s", requires=("consecutive",))
@option("--time-column NAME", "with --velocity, the column or key of the stamps  [default: stamp, t ..]",
    options.COLUMN, requires=("velocity", "time_offset", "start", "stop"))  # fmt: skip
@EXPLAIN
@options.limit_options
def relative_command(inputs: Inputs) -> int:
    """Print B seen from A, inverse(A) B, with the distance and the angle between them.

    \b
      frametool relative '{xyz: [1, 0, 0]}' '{rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map tool | frametool relative - '{xyz: [1,2,0]}'

    A and B are poses in one frame: mappings, files, or - for standard input. distance in metres; angle in radians,
    angle_deg in degrees.

    \b
      frametool relative --first -i walk.tum
      frametool relative --consecutive --velocity -i walk.tum

    The twist in dt seconds is the body's, seen in A: linear R_A' (p_B - p_A) / dt, angular rotvec(A^-1 B) / dt.
    """
    task, a, b = Task(inputs, "poses"), inputs.a, inputs.b
    if task.plan:
        return task.derive("relative", *map(task.read_written, (a, b)))
    if inputs.consecutive or inputs.first:
        velocity = inputs.consecutive and inputs.velocity
        refuse(b is not None, "rows are compared with one of themselves; leave A and B out")
        # both rows are poses of one frame at different times, so the result has its name twice
        operation = Operation(of=VELOCITIES if velocity else PREVIOUS if inputs.consecutive else START)
        column = (inputs.time_column or "") if velocity or task.window else None
        request = task.request(operation=operation, stamp_or_weight_column=column, rename=lambda _, name: (name, name))
        status = task.write_results(a or "-", request)
        left_out = "the first pose has none before it, so no velocity: it is left out, results begin at the second"
        inputs.note(f"note: {left_out}" if velocity else None)
        return status
    if b is None:
        refuse(a not in (None, "-"), "name A and B; one of them may be - for standard input")
        request = task.request(operation=Operation(of="pair"), poses=2, rename=lambda *_: (None, None))
        return task.write_results("-", request)
    from frametool.grammar.pose_algebra import relative_names

    request = task.request()
    rows = poses.rows_among((a, b), request, task)
    fixed = [*rows.before, *rows.behind][0]

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        own = Pose(name=name, parent=parent)
        return relative_names(*((fixed, own) if rows.at else (own, fixed)))

    operation = Operation(of="first" if rows.at else "second", fixed=fixed.placed)
    return task.write_results(rows.argument, request._replace(operation=operation, rename=rename), rows.timed)


@command_named("interpolate", own=("notations",))
@argument("a", FILE)
@argument("b", FILE)
@argument("fractions", parse_fractions, nargs=-1, required=True, metavar="FRACTION..")
@options.pose_result_options("poses")
@EXPLAIN
def interpolate_command(inputs: Inputs) -> int:
    """Print poses between A (fraction 0) and B (fraction 1), as tf2 does: straight line and slerp.

    \b
      frametool interpolate '{xyz: [0, 0, 0]}' '{xyz: [1, 0, 0]}' 0.5
      frametool interpolate '{rpy: [0, 0, 0]}' '{rpy: [0, 0, 1]}' 0:1:0.25 -f csv

    Fractions are numbers, or START:STOP:STEP; those outside 0 .. 1 extrapolate. The rotation takes the shorter arc.
    Unlike a screw motion, position and rotation are independent.
    """
    task, fractions = Task(inputs, "poses"), [each for some in inputs.fractions for each in some]
    if task.plan:
        refuse(len(fractions) != 1, f"--explain derives one fraction, found {len(fractions)}")
        return task.derive("interpolate", task.read_written(inputs.a), task.read_written(inputs.b), fractions[0])
    from frametool.grammar.pose_algebra import interpolated, shared_stamp

    pairs = poses.combinations((inputs.a, inputs.b), task.request())
    if any(pose.covariance for pair in pairs for pose in pair):
        warn(LEFT_OUT.format("interpolate"))
    between = [interpolated(first, last, each) for first, last in pairs for each in fractions]
    task.output.values([Result(pose, shared_stamp((pose,))) for pose in between])
    return 0


@command_named("mean")
@argument("poses", FILE, nargs=-1, metavar="[POSE.. | FILE]")
@option("--weights NAME | W,W,..", "column or key with weights, or the weights of the POSEs", options.COLUMN)
@option("--by NAME", "one mean per value of this column or key", options.COLUMN, excludes=("weights",))
@option("--robust", "reject outliers, and list them")
@pose_stream_options
@options.pose_result_options("poses")
def mean_command(inputs: Inputs) -> int:
    """Average poses: the mean position, the mean rotation, and how far the poses lie from them.

    \b
      frametool mean '{rpy_deg: [0, 0, 80]}' '{rpy_deg: [0, 0, 100]}'
      frametool mean '{xyz: [0, 0, 0]}' '{xyz: [1, 0, 0]}' --weights 1,3
      printf 'x,y,z,weight\\n0,0,0,1\\n4,0,0,3\\n' | frametool mean --weights weight
      frametool mean tag_seen.csv --robust
      printf 'tag,x,y,z\\n7,0,0,0\\n7,4,0,0\\n9,1,1,1\\n' | frametool mean --by tag

    Poses are arguments, the rows of a FILE, or of standard input. The mean rotation is the chordal one: the least sum
    of squared differences of matrices. distance_rms and distance_max are metres, angle_rms and angle_max radians (and
    _deg degrees) between the poses and the mean. covariance is that of one pose: x y z and rotations about X Y Z in the
    parent's axes as in ROS, with n - 1; std_x, std_y, std_z and std_angle are roots of its diagonal.

    With --robust outliers, more than 3 sigmas off by medians, are rejected: all of that is of the poses kept, `used` of
    `count`. A warning lists each with its place, how far off it is, and u, that in sigmas. Without outliers the
    numbers are those of the plain mean. Weights are in proportion to 1 / variance.
    """
    task, weights, by, robust = Task(inputs, "poses"), inputs.weights, inputs.by, inputs.robust
    from frametool.rows.samples import MeanRows, means_of

    arguments, status, numbers = inputs.poses, 0, None
    rows = MeanRows(weights, by)
    request = task.request(kind="pose", stamp_or_weight_column=rows.key, stamps=NO_STAMPS)
    bare, is_inverse = poses.without_inverse(arguments[0]) if len(arguments) == 1 else ("", False)
    if bare == "-" or (bare and not task.path and not poses.is_pasted(bare, task.notation)):
        arguments = ()
        if bare != "-":
            task.path = task.name = bare
        request = request.of_inverses() if is_inverse else request
    if not arguments:
        status = task.run(request, rows)
    else:
        refuse(by is not None, "--by is of rows; POSEs have no column")
        task.only_arguments(arguments)
        for number, each in enumerate(arguments, 1):
            name = f"argument {number}" if poses.is_inline(each) else each
            list(poses.read_with(each, request, partial(rows.add, name=name)))
        with misuse("--weights of POSEs are numbers: "):
            numbers = None if weights is None else [parse_number(text.strip()) for text in weights.split(",")]
        count, own = len(rows.named), len(rows.named if numbers is None else numbers)
        refuse(own != count, f"--weights are {own}, the poses {count}")
    if rows.uncertain:
        warn("covariances left out: mean's is that of the rows")
    if rows.stamped:
        warn("stamps left out: a mean is of no one time")
    rows.local = (place := task.output.style.place) is not None and place.axes != "ecef"
    if rows.local:
        warn(LEFT_OUT.format("a mean at a place"))
    found = [*means_of(rows, numbers, robust=robust)]
    task.output.values([mean for mean, _ in found])
    say_first([line for _, lines in found for line in lines], MOST, "poses left out", warn, warn)
    return status


OPPOSITE = 1e-8  # radians from half a turn within which the axis is undetermined


@command_named("between", own=("notations",))
@argument("vectors", nargs=-1, required=True, metavar="V1 V2")
@options.rotation_options
@options.result_options("poses")
def between_command(inputs: Inputs) -> None:
    """Print the shortest rotation that turns the direction V1 into the direction V2, and its angle.

    \b
      frametool between 1,0,0 0,1,0 --to rpy_deg
      frametool between 0 0 1 0.1 -0.2 9.7
      frametool between '{x: 0, y: 0, z: 1}' '[1, 1, 0]'

    A vector is three numbers or a mapping, of any length but 0. For opposite directions any perpendicular axis is
    valid; one is chosen and reported.
    """
    from frametool.grammar.pose_algebra import turn_between
    from frametool.rows.plain import read_text

    output, request = Output(inputs, "poses"), Request(Operation(moves=True), RowOptions(kind=VECTOR))
    texts, found = inputs.vectors, list[Any]()
    if len(texts) == 6:
        texts = ",".join(texts[:3]), ",".join(texts[3:])
    for text in texts:
        with poses.inline_misuse():
            records = read_text(poses.pose_source(text, request), request).records
            found += [record.shape.position(record.values) for record in records]
    refuse(len(found) != 2, f"two vectors are wanted, V1 and V2, of three numbers each; found {len(found)}")
    result = turn_between(*found)
    if result.extras["angle_deg"] > 180.0 - OPPOSITE:
        say("note: the directions are opposite: half a turn about any axis at right angles to them; one was chosen")
    output.values([result])
