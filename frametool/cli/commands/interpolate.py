"""`frametool interpolate`: poses on the way from one to another."""

from __future__ import annotations

from frametool.cli.command import Inputs, argument, command_named, refuse
from frametool.cli.options import pose_result_options
from frametool.cli.poses import combinations
from frametool.cli.streaming import EXPLAIN, PoseTask
from frametool.errors import warn
from frametool.grammar.pose import LEFT_OUT
from frametool.grammar.pose_algebra import interpolated, shared_stamp
from frametool.grammar.result import Result
from frametool.text.numbers import parse_fractions


@command_named("interpolate", own=("notations",))
@argument("a")
@argument("b")
@argument("fractions", parse_fractions, nargs=-1, required=True, metavar="FRACTION..")
@pose_result_options("poses")
@EXPLAIN
def command(inputs: Inputs) -> int:
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
    pairs = combinations((inputs.a, inputs.b), task.request())
    if any(pose.covariance for pair in pairs for pose in pair):
        warn(LEFT_OUT.format("interpolate"))
    between = [interpolated(first, last, each) for first, last in pairs for each in asked]
    task.output.values([Result(pose, shared_stamp((pose,))) for pose in between])
    return 0
