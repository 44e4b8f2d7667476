"""`frametool invert`: the inverse of a pose."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, pose_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import poses_from
from frametool.cli.streaming import Stream, stream_options
from frametool.grammar.pose import inverted
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from frametool.documents.source import Source


@click.command(cls=Command, name="invert")
@click.argument("pose", type=TEXT, default="-")
@rotation_options
@pose_options
@result_options("poses")
@stream_options
def command(pose: str, deg: bool, normalize: bool, **options: Any) -> int:
    """Turn poses around: a_from_b -> b_from_a; named frames change places.

    \b
      frametool invert '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool invert -

    POSE is a mapping, a file, or - for standard input, also with several poses.
    """
    stream = Stream(options)
    source: str | Source = pose
    output = Output("poses", deg=deg, **options)
    if stream.is_wanted(pose):
        from frametool.stream.operation import Operation
        from frametool.stream.request import Request

        wishes = Request(
            Operation(inverse=True), degrees=deg, normalize=normalize, rename=lambda parent, name: (name, parent)
        )
        outcome = stream.run(wishes, output)
        if isinstance(outcome, int):
            return outcome
        source = outcome
    inverses = [
        inverted(each)._replace(name=each.parent, parent=each.name)
        for each in poses_from(source, degrees=deg, normalize=normalize)
    ]
    output.poses(Result(each) for each in inverses)
    return 0
