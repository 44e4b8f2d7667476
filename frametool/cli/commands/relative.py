"""`frametool relative`: one pose seen from another."""

from __future__ import annotations

from typing import Any

import click

from frametool.cli.explaining import EXPLAIN, PoseTask, one_argument, pose_stream_options
from frametool.cli.group import settings
from frametool.cli.options import TEXT, ColumnNames, Command, limit_options, pose_result_options, window_of
from frametool.cli.poses import rows_among, without_inverse
from frametool.cli.stderr import say
from frametool.grammar.pose import Pose
from frametool.grammar.pose_algebra import relative_names


@click.command(cls=Command, name="relative")
@click.argument("a", type=TEXT, required=False)
@click.argument("b", type=TEXT, required=False)
@pose_result_options("poses")
@click.option("--consecutive", is_flag=True, help="of a stream, each row seen from the row before it")
@click.option("--first", is_flag=True, help="of a stream, each row seen from the first")
@click.option(
    "--velocity",
    is_flag=True,
    help="with --consecutive, also the twist from row to row, m/s and rad/s",
)
@click.option(
    "--time-column",
    type=ColumnNames(),
    metavar="NAME",
    help="with --velocity, the column or key of the stamps  [default: stamp, t ..]",
)
@EXPLAIN
@limit_options
@pose_stream_options
def command(
    a: str | None,
    b: str | None,
    consecutive: bool,
    first: bool,
    velocity: bool,
    time_column: str | None,
    **options: Any,
) -> int:
    """Print B seen from A, inverse(A) B, with the distance and the angle between them.

    \b
      frametool relative '{xyz: [1, 0, 0]}' '{rpy_deg: [0, 0, 90]}'
      frametool lookup robot.yaml map tool | frametool relative - '{xyz: [1,2,0]}'

    A and B are poses in one frame: mappings, files, or - for standard input. distance in metres; angle in radians,
    angle_deg in degrees.

    \b
      frametool relative --first -i walk.tum
      frametool relative --consecutive --velocity -i walk.tum

    The twist in dt seconds is the body's, seen in A: linear R_A' (p_B - p_A) / dt, angular rotvec(A^-1 B) / dt.
    """
    window = window_of(options.pop("start"), options.pop("stop"))
    task = PoseTask(options)
    if task.derives:
        plan = task.plan()
        if consecutive or first:
            raise click.UsageError("--consecutive and --first are about the rows of a stream; leave --explain out")
        from frametool.explain import derive

        arguments = [one_argument(each) for each in (a, b)]
        return task.write(derive.relative(plan, *map(task.written, arguments)))
    if velocity and not consecutive:
        raise click.UsageError("--velocity is that from one row to the next; give --consecutive too")
    if time_column is not None and not (velocity or window or settings().time_offset):
        raise click.UsageError("--time-column is for --velocity, --time-offset, --start and --stop")
    from frametool.stream.request import PREVIOUS, START, Operation

    given = [each for each in (a, b) if each is not None]
    if consecutive or first:
        if (consecutive and first) or len(given) > 1:
            one = "--consecutive and --first are two questions" if consecutive and first else "leave A and B out"
            raise click.UsageError(f"rows are compared with one of themselves; {one}")
        # a row is seen from another one of the same stream, which is the same thing at another moment
        operation = Operation(of=PREVIOUS if consecutive else START, velocity=velocity)
        beside = (time_column or "") if velocity or window else None
        request = task.request(
            operation=operation, extra_column=beside, window=window, rename=lambda _parent, name: (name, name)
        )
        status = task.answer(a or "-", request)
        if velocity and not settings().quiet:
            say("note: the first pose has none before it, so no velocity: it is left out, results begin at the second")
        return status
    if b is None:
        if a not in (None, "-"):
            raise click.UsageError("name A and B; one of them may be - for standard input")
        return task.answer("-", task.request(operation=Operation(of="pair"), poses=2, window=window))
    bare = [without_inverse(each)[0] for each in given]
    if bare == ["-", "-"]:
        raise click.UsageError("standard input can be read once; leave A and B out to compare two poses of each row")
    if task.stream.path and "-" not in bare:
        raise click.UsageError("-i FILE is read where - stands for A or B")
    request = task.request(window=window)
    rows = rows_among(given, request, task.has_table)
    fixed = [*rows.before, *rows.behind][0]

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        own = Pose(name=name, parent=parent)
        return relative_names(*((fixed, own) if rows.at else (own, fixed)))

    operation = Operation(of="first" if rows.at else "second", fixed=fixed.placed)
    return task.answer(rows.argument, request._replace(operation=operation, rename=rename), rows.timed)
