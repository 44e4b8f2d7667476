"""`frametool compose`: the product of poses."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, pose_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import combinations, one_pose
from frametool.cli.streaming import Stream, stream_options
from frametool.errors import ValueInvalid
from frametool.geometry import rigid
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.documents.source import Source
    from frametool.stream.operation import Operation

    Rename = Callable[[str | None, str | None], tuple[str | None, str | None]]


@click.command(cls=Command, name="compose")
@click.argument("poses", nargs=-1, required=True, type=TEXT, metavar="POSE POSE ..")
@rotation_options
@pose_options
@result_options("poses")
@stream_options
def command(poses: tuple[str, ...], deg: bool, normalize: bool, **options: Any) -> int:
    """Multiply poses, left to right: a_from_b, b_from_c -> a_from_c.

    \b
      frametool compose '{xyz: [1, 2, 3]}' '{rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool compose - '{xyz: [0, 0, 1]}'

    POSE is a mapping, a file, or - for standard input. Where poses name their frames, the frames must touch.
    """
    stream = Stream(options)
    output = Output("poses", deg=deg, **options)
    given: list[str | Source] = list(poses)
    if poses.count("-") == 1:
        at = poses.index("-")
        fixed = [None if each == "-" else one_pose(each, degrees=deg, normalize=normalize) for each in poses]
        operation, rename = _around(fixed[:at], fixed[at + 1 :])
        from frametool.stream.request import Request

        wishes = Request(operation, degrees=deg, normalize=normalize, rename=rename)
        outcome = stream.run(wishes, output)
        if isinstance(outcome, int):
            return outcome
        given[at] = outcome
    elif stream.path:
        raise click.UsageError("-i FILE is read where - stands among the poses")
    products = [reduce(product, each) for each in combinations(given, degrees=deg, normalize=normalize)]
    output.poses(Result(each) for each in products)
    return 0


def _around(left: Sequence[Pose | None], right: Sequence[Pose | None]) -> tuple[Operation, Rename]:
    """Return the operation that puts each row between two products, and what it does to frames."""
    before, after = (reduce(product, filter(None, poses)) if poses else None for poses in (left, right))

    from frametool.stream.operation import Operation

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        result = reduce(product, filter(None, (before, Pose(name=name, parent=parent), after)))
        return result.parent, result.name

    return Operation(left=before and before.components, right=after and after.components), rename


def product(left: Pose, right: Pose) -> Pose:
    """Return a_from_c of a_from_b and b_from_c; frames that are named must touch."""
    if left.name is not None and right.parent is not None and left.name != right.parent:
        raise ValueInvalid(
            f"frames do not touch: {left.parent or '?'} <- {left.name} is followed by "
            f"{right.parent} <- {right.name or '?'}; change the order, or invert one",
        )
    return Pose.of(rigid.compose(*left.components, *right.components), right.name, left.parent)
