"""`frametool invert`: the inverse of a pose."""

from __future__ import annotations

from typing import Any

import click

from frametool.cli.explaining import Explaining, explain_options, given
from frametool.cli.options import TEXT, Command, pose_options, pose_reading_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import write_results
from frametool.cli.streaming import Stream, stream_options


@click.command(cls=Command, name="invert")
@click.argument("pose", type=TEXT, default="-")
@rotation_options
@pose_options
@result_options("poses")
@explain_options
@stream_options
@pose_reading_options
def command(pose: str, deg: bool, normalize: bool, **options: Any) -> int:
    """Turn poses around: a_from_b -> b_from_a; named frames change places.

    \b
      frametool invert '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool invert -

    POSE is a mapping, a file, or - for standard input, also with several poses.
    """
    stream, explaining = Stream(options), Explaining(options)
    output = Output("poses", deg=deg, **options)
    if explaining:
        plan = explaining.plan(output, stream)
        from frametool.explain import derive

        written = given(pose, stream.given, degrees=deg, normalize=normalize)
        return explaining.write(derive.invert(plan, written), output)
    from frametool.stream.request import Operation, Request

    request = Request(
        Operation(inverse=True),
        given=stream.given,
        degrees=deg,
        normalize=normalize,
        rename=lambda parent, name: (name, parent),
    )
    return write_results(pose, stream, request, output)
