"""`frametool convert`: one rotation or pose in other representations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, Notations, pose_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import is_inline, pose_from_numbers, poses_from
from frametool.formats.results import Result

if TYPE_CHECKING:
    from frametool.geometry.representations import Notation


@click.command(cls=Command, name="convert", short_help="one rotation or pose in other representations")
@click.argument("values", nargs=-1, type=TEXT, metavar="[VALUES.. | POSE]")
@click.option("--from", "given", type=Notations(), metavar="REP", help="what the bare VALUES are")
@rotation_options
@pose_options
@result_options("poses")
def command(
    values: tuple[str, ...], given: tuple[Notation, ...] | None, deg: bool, normalize: bool, **options: Any
) -> None:
    """Write one rotation or pose in other representations.

    \b
      frametool convert --from rpy_deg 0 0 90
      frametool convert '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}' --to matrix
      frametool convert --from quaternion 0 0 0 1 --to rpy_deg,axis_angle --format json

    VALUES are numbers in the order of the representation, after x y z when there is a position; an angle may carry
    its unit: 90deg, 1.57rad, pi/2. POSE is a mapping as above, a file, or - for standard input, also with several
    poses; without any argument standard input is read.
    """
    output = Output("poses", deg=deg, **options)
    if values and not is_inline(values[0]) and (given or len(values) > 1):
        poses = [pose_from_numbers(values, given, degrees=deg, normalize=normalize)]
    else:
        poses = [pose for each in values or ("-",) for pose in poses_from(each, degrees=deg, normalize=normalize)]
    output.poses(Result(pose) for pose in poses)
    output.tell_of_lock(poses)
