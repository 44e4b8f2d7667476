"""`frametool relative`: one pose seen from another."""

from __future__ import annotations

import math
from typing import Any

import click

from frametool.cli.command import TEXT, Command, pose_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import combinations
from frametool.errors import ValueInvalid
from frametool.formats.pose import Pose
from frametool.formats.results import Result
from frametool.geometry import floats, quaternion, rigid


@click.command(cls=Command, name="relative")
@click.argument("a", type=TEXT)
@click.argument("b", type=TEXT)
@rotation_options
@pose_options
@result_options("poses")
def command(a: str, b: str, deg: bool, normalize: bool, **options: Any) -> None:
    """Give B seen from A, inverse(A) B, with the distance and the angle between them.

    \b
      frametool relative '{xyz: [1, 0, 0]}' '{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool relative - '{xyz: [1, 2, 0]}'

    A and B are poses in one frame: mappings, files, or - for standard input. distance in metres; angle in radians,
    angle_deg in degrees.
    """
    output = Output("poses", deg=deg, **options)
    pairs = combinations((a, b), degrees=deg, normalize=normalize)
    output.poses([_relative(*pair) for pair in pairs])


def _relative(a: Pose, b: Pose) -> Result:
    if a.parent is not None and b.parent is not None and a.parent != b.parent:
        raise ValueInvalid(f"A is given in {a.parent!r} and B in {b.parent!r}; give both in one frame")
    components = rigid.relative(*a.components, *b.components)
    distance = floats.length(*components[:3])
    angle = quaternion.angle(*components[3:], floats)
    extras = {"distance": distance, "angle": angle, "angle_deg": math.degrees(angle)}
    return Result(Pose.of(components, b.name, a.name), extras)
