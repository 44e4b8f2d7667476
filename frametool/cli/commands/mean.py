"""`frametool mean`: the mean of poses, and how far they lie from it."""

from __future__ import annotations

import click

from frametool.cli.command import Inputs, argument, command_named, option, refuse
from frametool.cli.options import COLUMN, pose_result_options
from frametool.cli.poses import is_inline, is_pasted, read_with, without_inverse
from frametool.cli.sink import say_first
from frametool.cli.streaming import PoseTask, pose_stream_options
from frametool.errors import ValueInvalid, warn
from frametool.stream.faults import MOST
from frametool.text.numbers import parse_number


@command_named("mean")
@argument("poses", nargs=-1, metavar="[POSE.. | FILE]")
@option("--weights NAME | W,W,..", "column or key with weights, or the weights of the POSEs", COLUMN)
@option("--by NAME", "one mean per value of this column or key", COLUMN, excludes=("weights",))
@option("--robust", "reject outliers, and list them")
@pose_stream_options
@pose_result_options("poses")
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
    task = PoseTask(inputs)
    poses, weights, robust = inputs.poses, inputs.weights, inputs.robust
    from frametool.grammar.result import Result
    from frametool.stream.gathering import Gathered
    from frametool.stream.record_values import read_poses

    gathered = Gathered(named=robust, labelled=inputs.by is not None)
    request = task.request(extra_column=inputs.by or weights, gathered=gathered)
    status, numbers = 0, None
    bare, is_inverse = without_inverse(poses[0]) if len(poses) == 1 else ("", False)
    if bare == "-" or (bare and not task.path and not is_pasted(bare, task.notation)):
        task.path, poses = task.path if bare == "-" else bare, ()
        request = request.of_inverses() if is_inverse else request
    if not poses:
        status = task.run(request)
    else:
        task.only_arguments(poses)
        for number, each in enumerate(poses, 1):
            gathered.add(list(read_with(each, request, read_poses)), f"argument {number}" if is_inline(each) else each)
        numbers = None if weights is None else _numbers(weights)
        if numbers is not None and len(numbers) != len(gathered.transforms):
            raise click.UsageError(f"--weights are {len(numbers)}, the poses {len(gathered.transforms)}")
    if gathered.uncertain:
        warn("covariances left out: mean's is that of the rows")
    if gathered.stamped:
        warn("stamps left out: a mean is of no one time")
    from frametool.fit.closed_forms import mean_of_rows

    if inputs.by is None:
        result, left_out = mean_of_rows(gathered, numbers, robust=robust)
        task.output.values([result])
    else:
        refuse(bool(poses), "--by is of rows; POSEs have no column")
        found = [(label, *mean_of_rows(each, None, robust=robust)) for label, each in gathered.groups()]
        task.output.values([Result(each.pose, {inputs.by: label, **each.extras}) for label, each, _ in found])
        left_out = [line for _, _, lines in found for line in lines]
    say_first(left_out, MOST, "poses left out", warn, warn)
    return status


def _numbers(weights: str) -> list[float]:
    """Read the weights of poses that are arguments."""
    try:
        return [parse_number(text.strip()) for text in weights.split(",")]
    except ValueInvalid as error:
        raise click.UsageError(f"--weights: {error}; of POSEs they are numbers, of rows the name of a column") from None
