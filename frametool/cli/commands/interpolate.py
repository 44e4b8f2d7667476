"""`frametool interpolate`: poses on the way from one to another."""

from __future__ import annotations

from typing import Any

import click

from frametool.cli.explaining import PoseTask, explain_options
from frametool.cli.options import TEXT, Command, Number, pose_result_options
from frametool.cli.poses import combinations
from frametool.errors import warn
from frametool.grammar.pose import LEFT_OUT
from frametool.grammar.pose_algebra import interpolated, shared_stamp
from frametool.grammar.result import Result


@click.command(cls=Command, name="interpolate")
@click.argument("a", type=TEXT)
@click.argument("b", type=TEXT)
@click.argument("fractions", nargs=-1, required=True, type=Number())
@pose_result_options("poses")
@explain_options
def command(a: str, b: str, fractions: tuple[float, ...], **options: Any) -> int:
    """Print poses between A (fraction 0) and B (fraction 1), as tf2 does: straight line and slerp.

    \b
      frametool interpolate '{xyz: [0, 0, 0]}' '{xyz: [1, 0, 0]}' 0.5
      frametool interpolate '{rpy: [0, 0, 0]}' '{rpy: [0, 0, 1]}' 0 0.5 1 -f csv

    The rotation takes the shorter arc. Fractions outside 0 .. 1 extrapolate. Unlike a screw motion, position and
    rotation are independent.
    """
    task = PoseTask(options)
    if task.derives:
        plan = task.plan()
        if len(fractions) != 1:
            raise click.UsageError(f"--explain derives one fraction, found {len(fractions)}")
        from frametool.explain import derive

        return task.write(derive.interpolate(plan, task.written(a), task.written(b), fractions[0]))
    pairs = combinations((a, b), task.request())
    if any(pose.covariance for pair in pairs for pose in pair):
        warn(LEFT_OUT.format("interpolate"))
    between = [interpolated(first, last, each) for first, last in pairs for each in fractions]
    task.output.poses([Result(pose, shared_stamp((pose,))) for pose in between])
    return 0
