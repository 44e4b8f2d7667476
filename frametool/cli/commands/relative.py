"""`frametool relative`: one pose seen from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, pose_options, result_options, rotation_options
from frametool.cli.explaining import Explaining, all_given, explain_options, one_argument
from frametool.cli.output import Output
from frametool.cli.poses import combinations, one_pose
from frametool.cli.streaming import Stream, stream_options
from frametool.cli.trees import pose_reading_options
from frametool.grammar.pose import Pose
from frametool.grammar.pose_algebra import relative, relative_names

if TYPE_CHECKING:
    from frametool.stream.request import Request


@click.command(cls=Command, name="relative")
@click.argument("a", type=TEXT, required=False)
@click.argument("b", type=TEXT, required=False)
@rotation_options
@pose_options
@result_options("poses")
@click.option(
    "--consecutive", is_flag=True, help="of a stream, each row seen from the row before; the first is the identity"
)
@explain_options
@click.option("--first", is_flag=True, help="of a stream, each row seen from the first, which is then the identity")
@stream_options
@pose_reading_options
def command(
    a: str | None, b: str | None, deg: bool, normalize: bool, consecutive: bool, first: bool, **options: Any
) -> int:  # fmt: skip
    """Print B seen from A, inverse(A) B, with the distance and the angle between them.

    \b
      frametool relative '{xyz: [1, 0, 0]}' '{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool relative - '{xyz: [1, 2, 0]}'

    A and B are poses in one frame: mappings, files, or - for standard input. distance in metres; angle in radians,
    angle_deg in degrees.
    """
    stream, explaining = Stream(options), Explaining(options)
    output = Output("poses", deg=deg, **options)
    if explaining:
        plan = explaining.plan(output, stream)
        if consecutive or first:
            option = "--first" if first else "--consecutive"
            raise click.UsageError(f"{option} is about the rows of a stream; leave it or --explain out")
        from frametool.calc.explain.derive import derive_relative

        arguments = [str(one_argument(each)) for each in (a, b)]
        one, other = all_given(arguments, stream.given, degrees=deg, normalize=normalize)
        return explaining.write(derive_relative(one, other, plan), output)
    from frametool.stream.request import Request

    given = [each for each in (a, b) if each is not None]
    if consecutive and first:
        raise click.UsageError("--consecutive and --first are two answers; give one")
    if (consecutive or first) and given not in ([], ["-"]):
        option = "--first" if first else "--consecutive"
        raise click.UsageError(f"{option} is about the rows of a stream; leave A and B out")
    if len(given) < 2 or "-" in given:
        request = Request(given=stream.given, degrees=deg, normalize=normalize)
        other_row = "start" if first else "previous" if consecutive else ""
        return stream.run(_asked(a, b, request, other_row), output)
    if stream.path:
        raise click.UsageError("-i FILE is read where - stands for A or B")
    pairs = combinations(given, stream.given, degrees=deg, normalize=normalize)
    output.poses([relative(*pair) for pair in pairs])
    return 0


def _asked(a: str | None, b: str | None, plain: Request, other_row: str) -> Request:
    """Compare a stream's rows with a fixed A or B, with another row, or with the row's own second pose."""
    from frametool.stream.operation import Operation

    if b is None:
        if a not in (None, "-"):
            raise click.UsageError("name A and B; one of them may be - for standard input")
        if not other_row:
            return plain._replace(operation=Operation(of="pair"), poses=2)
        # a row is seen from one before it, which is the same thing at an earlier time
        return plain._replace(operation=Operation(of=other_row), rename=lambda _parent, name: (name, name))
    if a == b == "-":
        raise click.UsageError("standard input can be read once; leave A and B out to compare two poses of each row")
    first = a != "-"
    fixed = one_pose(str(a if first else b), plain.given, degrees=plain.degrees, normalize=plain.normalize)

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        own = Pose(name=name, parent=parent)
        return relative_names(*((fixed, own) if first else (own, fixed)))

    operation = Operation(of="first" if first else "second", fixed=fixed.components)
    return plain._replace(operation=operation, rename=rename)
