"""`frametool compose`: the product of poses."""

from __future__ import annotations

from functools import reduce

import click

from frametool.cli.command import Inputs, argument, command_named
from frametool.cli.options import offset_option, pose_result_options, scale_option
from frametool.cli.poses import rows_among, without_inverse
from frametool.cli.streaming import EXPLAIN, PoseTask, pose_stream_options
from frametool.grammar.pose import Pose
from frametool.grammar.pose_algebra import product


@command_named("compose")
@argument("poses", nargs=-1, required=True, metavar="POSE POSE ..")
@pose_stream_options
@pose_result_options("poses")
@scale_option
@EXPLAIN
@offset_option
def command(inputs: Inputs) -> int:
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
