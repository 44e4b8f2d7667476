"""Arithmetic of poses: `compose`, `invert`, `relative`, `interpolate`."""

from __future__ import annotations

from functools import reduce

import click

from frametool.cli.command import Inputs, argument, command_named, option, refuse
from frametool.cli.options import COLUMN, limit_options, offset_option, pose_result_options, scale_option
from frametool.cli.poses import combinations, rows_among, without_inverse
from frametool.cli.streaming import EXPLAIN, PoseTask, one_argument, pose_stream_options
from frametool.errors import warn
from frametool.grammar.pose import LEFT_OUT, Pose
from frametool.text.numbers import parse_fractions


@command_named("compose")
@argument("poses", nargs=-1, required=True, metavar="POSE POSE ..")
@pose_stream_options
@pose_result_options("poses")
@scale_option
@EXPLAIN
@offset_option
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
    task, poses = PoseTask(inputs), inputs.poses
    if task.derives:
        return task.derive("compose", *map(task.written, poses))
    if task.path and not any(without_inverse(each)[0] == "-" for each in poses):
        raise click.UsageError("-i FILE is read where - stands among the poses")
    from frametool.grammar.pose_algebra import product
    from frametool.stream.request import Operation

    request = task.request(operation=Operation(similar=True, multiples=inputs.scale))
    rows = rows_among(poses, request, task.has_table)
    before = reduce(product, rows.before) if rows.before else None

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        result = reduce(product, [*filter(None, [before]), Pose(name=name, parent=parent), *rows.behind])
        return result.parent, result.name

    behind = tuple(each.placed for each in rows.behind)
    operation = Operation(before and before.placed, behind, similar=True, multiples=inputs.scale)
    return task.answer(rows.argument, request._replace(operation=operation, rename=rename), rows.timed)


@command_named("invert")
@argument("pose", default="-")
@pose_stream_options
@pose_result_options("poses")
@scale_option
@EXPLAIN
@offset_option
def invert_command(inputs: Inputs) -> int:
    """Invert poses: a_from_b -> b_from_a; frame names are swapped.

    \b
      frametool invert '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool invert -

    POSE is a mapping, a file, or - for standard input, also with several poses.
    """
    task = PoseTask(inputs)
    if task.derives:
        return task.derive("invert", task.written(inputs.pose))
    from frametool.stream.request import Operation

    operation = Operation(inverse=True, similar=True, multiples=inputs.scale)
    return task.answer(inputs.pose, task.request(operation=operation, rename=lambda parent, name: (name, parent)))


@command_named("relative")
@argument("a", required=False)
@argument("b", required=False)
@pose_stream_options
@pose_result_options("poses")
@option("--consecutive", "of a stream, each row relative to the row before it", excludes=("first", "explain"))
@option("--first", "of a stream, each row relative to the first", excludes=("explain",))
@option("--velocity", "with --consecutive, also the twist between rows, m/s and rad/s", requires=("consecutive",))
@option("--time-column NAME", "with --velocity, the column or key of the stamps  [default: stamp, t ..]", COLUMN,
    requires=("velocity", "time_offset", "start", "stop"))
@EXPLAIN
@limit_options
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
    task, a, b = PoseTask(inputs), inputs.a, inputs.b
    if task.derives:
        return task.derive("relative", *map(task.written, [one_argument(each) for each in (a, b)]))
    from frametool.stream.request import PREVIOUS, START, Operation

    poses = [each for each in (a, b) if each is not None]
    if inputs.consecutive or inputs.first:
        velocity = inputs.consecutive and inputs.velocity
        refuse(len(poses) > 1, "rows are compared with one of themselves; leave A and B out")
        # a row is seen from another one of the same stream, which is the same thing at another moment
        operation = Operation(of=PREVIOUS if inputs.consecutive else START, velocity=velocity)
        column = (inputs.time_column or "") if velocity or task.window else None
        request = task.request(operation=operation, extra_column=column, rename=lambda _parent, name: (name, name))
        status = task.answer(a or "-", request)
        left_out = "the first pose has none before it, so no velocity: it is left out, results begin at the second"
        inputs.note(f"note: {left_out}" if velocity else None)
        return status
    if b is None:
        refuse(a not in (None, "-"), "name A and B; one of them may be - for standard input")
        return task.answer("-", task.request(operation=Operation(of="pair"), poses=2))
    bare = [without_inverse(each)[0] for each in poses]
    refuse(bare == ["-", "-"], "standard input can be read once; leave A and B out to compare two poses of each row")
    refuse(task.path and "-" not in bare, "-i FILE is read where - stands for A or B")
    from frametool.grammar.pose_algebra import relative_names

    request = task.request()
    rows = rows_among(poses, request, task.has_table)
    fixed = [*rows.before, *rows.behind][0]

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        own = Pose(name=name, parent=parent)
        return relative_names(*((fixed, own) if rows.at else (own, fixed)))

    operation = Operation(of="first" if rows.at else "second", fixed=fixed.placed)
    return task.answer(rows.argument, request._replace(operation=operation, rename=rename), rows.timed)


@command_named("interpolate", own=("notations",))
@argument("a")
@argument("b")
@argument("fractions", parse_fractions, nargs=-1, required=True, metavar="FRACTION..")
@pose_result_options("poses")
@EXPLAIN
def interpolate_command(inputs: Inputs) -> int:
    """Print poses between A (fraction 0) and B (fraction 1), as tf2 does: straight line and slerp.

    \b
      frametool interpolate '{xyz: [0, 0, 0]}' '{xyz: [1, 0, 0]}' 0.5
      frametool interpolate '{rpy: [0, 0, 0]}' '{rpy: [0, 0, 1]}' 0:1:0.25 -f csv

    Fractions are numbers, or START:STOP:STEP; those outside 0 .. 1 extrapolate. The rotation takes the shorter arc.
    Unlike a screw motion, position and rotation are independent.
    """
    task, asked = PoseTask(inputs), [each for some in inputs.fractions for each in some]
    if task.derives:
        refuse(len(asked) != 1, f"--explain derives one fraction, found {len(asked)}")
        return task.derive("interpolate", task.written(inputs.a), task.written(inputs.b), asked[0])
    from frametool.grammar.pose_algebra import interpolated, shared_stamp
    from frametool.grammar.result import Result

    pairs = combinations((inputs.a, inputs.b), task.request())
    if any(pose.covariance for pair in pairs for pose in pair):
        warn(LEFT_OUT.format("interpolate"))
    between = [interpolated(first, last, each) for first, last in pairs for each in asked]
    task.output.values([Result(pose, shared_stamp((pose,))) for pose in between])
    return 0
