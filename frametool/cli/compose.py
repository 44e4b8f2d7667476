"""`frametool compose`: the product of poses."""

from __future__ import annotations

from functools import reduce
from typing import Any

import click

from frametool.cli.command import TEXT, Command, pose_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import combinations
from frametool.errors import ValueInvalid
from frametool.formats.pose import Pose
from frametool.formats.results import Result
from frametool.geometry import rigid


@click.command(cls=Command, name="compose")
@click.argument("poses", nargs=-1, required=True, type=TEXT, metavar="POSE POSE ..")
@rotation_options
@pose_options
@result_options("poses")
def command(poses: tuple[str, ...], deg: bool, normalize: bool, **options: Any) -> None:
    """Multiply poses, left to right: a_from_b, b_from_c -> a_from_c.

    \b
      frametool compose '{xyz: [1, 2, 3]}' '{rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool compose - '{xyz: [0, 0, 1]}'

    POSE is a mapping, a file, or - for standard input. Where poses name their frames, the frames must touch.
    """
    output = Output("poses", deg=deg, **options)
    products = [reduce(product, each) for each in combinations(poses, degrees=deg, normalize=normalize)]
    output.poses(Result(each) for each in products)


def product(left: Pose, right: Pose) -> Pose:
    """Give a_from_c of a_from_b and b_from_c; frames that are named must touch."""
    if left.name is not None and right.parent is not None and left.name != right.parent:
        raise ValueInvalid(
            f"frames do not touch: {left.parent or '?'} <- {left.name} is followed by "
            f"{right.parent} <- {right.name or '?'}; change the order, or invert one",
        )
    return Pose.of(rigid.compose(*left.components, *right.components), right.name, left.parent)
