"""`frametool relative`: one pose seen from another."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, pose_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import combinations, one_pose
from frametool.cli.streaming import Stream, stream_options
from frametool.errors import ValueInvalid
from frametool.geometry import floats, rigid
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from frametool.documents.source import Source
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
@stream_options
def command(a: str | None, b: str | None, deg: bool, normalize: bool, consecutive: bool, **options: Any) -> int:
    """Print B seen from A, inverse(A) B, with the distance and the angle between them.

    \b
      frametool relative '{xyz: [1, 0, 0]}' '{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map base_link | frametool relative - '{xyz: [1, 2, 0]}'

    A and B are poses in one frame: mappings, files, or - for standard input. distance in metres; angle in radians,
    angle_deg in degrees.
    """
    stream = Stream(options)
    output = Output("poses", deg=deg, **options)
    given: list[str | Source] = [each for each in (a, b) if each is not None]
    if consecutive and given not in ([], ["-"]):
        raise click.UsageError("--consecutive is about the rows of a stream; leave A and B out")
    if len(given) < 2 or "-" in given:
        wishes = _wishes(a, b, consecutive=consecutive, degrees=deg, normalize=normalize)
        outcome = stream.run(wishes, output)
        if isinstance(outcome, int):
            return outcome
        given = [outcome if each == "-" else each for each in given]
    elif stream.path:
        raise click.UsageError("-i FILE is read where - stands for A or B")
    if len(given) != 2:
        raise click.UsageError("name A and B; one of them may be - for standard input")
    pairs = combinations(given, degrees=deg, normalize=normalize)
    output.poses([_relative(*pair) for pair in pairs])
    return 0


def _wishes(a: str | None, b: str | None, *, consecutive: bool, degrees: bool, normalize: bool) -> Request:
    """Say what a stream's rows are compared with: a fixed A or B, the row before, or the row's own second pose."""
    from frametool.stream.operation import Operation
    from frametool.stream.request import Request

    if b is None:
        if a not in (None, "-"):
            raise click.UsageError("name A and B; one of them may be - for standard input")
        of = "previous" if consecutive else "pair"
        return Request(Operation(of=of), poses=1 if consecutive else 2, degrees=degrees, normalize=normalize)
    if a == b == "-":
        raise click.UsageError("standard input can be read once; leave A and B out to compare two poses of each row")
    first = a != "-"
    fixed = one_pose(str(a if first else b), degrees=degrees, normalize=normalize)

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        own = Pose(name=name, parent=parent)
        result = _relative(*((fixed, own) if first else (own, fixed))).pose
        return result.parent, result.name

    operation = Operation(of="first" if first else "second", fixed=fixed.components)
    return Request(operation, rename=rename, degrees=degrees, normalize=normalize)


def _relative(a: Pose, b: Pose) -> Result:
    if a.parent is not None and b.parent is not None and a.parent != b.parent:
        raise ValueInvalid(f"A is given in {a.parent!r} and B in {b.parent!r}; give both in one frame")
    components = rigid.relative(*a.components, *b.components)
    distance, angle = rigid.extent(*components, floats)
    extras = {"distance": distance, "angle": angle, "angle_deg": math.degrees(angle)}
    return Result(Pose.of(components, b.name, a.name), extras)
