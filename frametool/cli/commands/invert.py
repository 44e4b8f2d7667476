"""`frametool invert`: the inverse of a pose."""

from __future__ import annotations

from frametool.cli.command import Inputs, argument, command_named
from frametool.cli.options import offset_option, pose_result_options, scale_option
from frametool.cli.streaming import EXPLAIN, PoseTask, pose_stream_options


@command_named("invert")
@argument("pose", default="-")
@pose_stream_options
@pose_result_options("poses")
@scale_option
@EXPLAIN
@offset_option
def command(inputs: Inputs) -> int:
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
