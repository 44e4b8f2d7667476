"""`frametool compose`: the product of poses."""

from __future__ import annotations

from functools import reduce
from typing import Any

import click

from frametool.cli.explaining import Explaining, all_given, explain_options
from frametool.cli.options import TEXT, Command, pose_options, pose_reading_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import combinations, factors_of, one_pose
from frametool.cli.streaming import Stream, stream_options
from frametool.grammar.pose import Pose
from frametool.grammar.pose_algebra import product
from frametool.grammar.result import Result


@click.command(cls=Command, name="compose")
@click.argument("poses", nargs=-1, required=True, type=TEXT, metavar="POSE POSE ..")
@rotation_options
@pose_options
@result_options("poses")
@explain_options
@stream_options
@pose_reading_options
def command(poses: tuple[str, ...], deg: bool, normalize: bool, **options: Any) -> int:
    """Multiply poses, left to right: a_from_b, b_from_c -> a_from_c.

    \b
      frametool compose '{xyz: [1, 2, 3]}' '{rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map tool | frametool compose - '{xyz: [0,0,1]}'
      frametool compose 'inv({xyz: [1, 2, 3]})' '~{rpy_deg: [0, 0, 90]}'
      frametool compose inv '{rpy_deg: [0, 0, 90]}' '{xyz: [14, -4, 0]}'

    POSE is a mapping, a file, or - for standard input. Where poses name their frames, the frames must touch. The
    inverse of any of them is inv(POSE) or ~POSE, in quotes, or the word inv before it.
    """
    stream, explaining = Stream(options), Explaining(options)
    output = Output("poses", deg=deg, **options)
    factors = factors_of(poses)
    given = [each.argument for each in factors]
    if explaining:
        plan = explaining.plan(output, stream)
        from frametool.explain import derive

        written = all_given(given, stream.given, degrees=deg, normalize=normalize)
        turned = [each.turned() if factor.is_inverse else each for each, factor in zip(written, factors, strict=True)]
        return explaining.write(derive.compose(plan, *turned), output)
    if "-" not in given:
        if stream.path:
            raise click.UsageError("-i FILE is read where - stands among the poses")
        each_product = combinations(factors, stream.given, degrees=deg, normalize=normalize)
        products = [reduce(product, each) for each in each_product]
        output.poses(Result(each) for each in products)
        return 0
    if given.count("-") > 1:
        raise click.UsageError("standard input can be read once; only one argument may be -")
    at = given.index("-")
    left, right = (
        [each.of(one_pose(each.argument, stream.given, degrees=deg, normalize=normalize)) for each in side]
        for side in (factors[:at], factors[at + 1 :])
    )
    rows = factors[at]
    from frametool.stream.request import Operation, Request

    before = reduce(product, left) if left else None

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        result = reduce(product, [*filter(None, [before]), rows.of(Pose(name=name, parent=parent)), *right])
        return result.parent, result.name

    operation = Operation(
        before and before.components, tuple(each.components for each in right), inverse=rows.is_inverse
    )
    return stream.run(Request(operation, degrees=deg, normalize=normalize, rename=rename), output)
