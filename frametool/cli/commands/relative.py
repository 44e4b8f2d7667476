"""`frametool relative`: one pose seen from another."""

from __future__ import annotations

from frametool.cli.command import Inputs, argument, command_named, option, refuse
from frametool.cli.options import COLUMN, limit_options, pose_result_options
from frametool.cli.poses import rows_among, without_inverse
from frametool.cli.streaming import EXPLAIN, PoseTask, one_argument, pose_stream_options
from frametool.grammar.pose import Pose
from frametool.grammar.pose_algebra import relative_names


@command_named("relative")
@argument("a", required=False)
@argument("b", required=False)
@pose_stream_options
@pose_result_options("poses")
@option("--consecutive", "of a stream, each row relative to the row before it", excludes=("first", "explain"))
@option("--first", "of a stream, each row relative to the first", excludes=("explain",))
@option("--velocity", "with --consecutive, also the twist between rows, m/s and rad/s", requires=("consecutive",))
@option("--time-column NAME", "with --velocity, the column or key of the stamps  [default: stamp, t ..]", COLUMN,
    requires=("velocity", "time_offset", "start", "stop"))
@EXPLAIN
@limit_options
def command(inputs: Inputs) -> int:
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
    task, a, b = PoseTask(inputs), inputs.a, inputs.b
    if task.derives:
        return task.derive("relative", *map(task.written, [one_argument(each) for each in (a, b)]))
    from frametool.stream.request import PREVIOUS, START, Operation

    poses = [each for each in (a, b) if each is not None]
    if inputs.consecutive or inputs.first:
        velocity = inputs.consecutive and inputs.velocity
        refuse(len(poses) > 1, "rows are compared with one of themselves; leave A and B out")
        # a row is seen from another one of the same stream, which is the same thing at another moment
        operation = Operation(of=PREVIOUS if inputs.consecutive else START, velocity=velocity)
        column = (inputs.time_column or "") if velocity or task.window else None
        request = task.request(operation=operation, extra_column=column, rename=lambda _parent, name: (name, name))
        status = task.answer(a or "-", request)
        left_out = "the first pose has none before it, so no velocity: it is left out, results begin at the second"
        inputs.note(f"note: {left_out}" if velocity else None)
        return status
    if b is None:
        refuse(a not in (None, "-"), "name A and B; one of them may be - for standard input")
        return task.answer("-", task.request(operation=Operation(of="pair"), poses=2))
    bare = [without_inverse(each)[0] for each in poses]
    refuse(bare == ["-", "-"], "standard input can be read once; leave A and B out to compare two poses of each row")
    refuse(task.path and "-" not in bare, "-i FILE is read where - stands for A or B")
    request = task.request()
    rows = rows_among(poses, request, task.has_table)
    fixed = [*rows.before, *rows.behind][0]

    def rename(parent: str | None, name: str | None) -> tuple[str | None, str | None]:
        own = Pose(name=name, parent=parent)
        return relative_names(*((fixed, own) if rows.at else (own, fixed)))

    operation = Operation(of="first" if rows.at else "second", fixed=fixed.placed)
    return task.answer(rows.argument, request._replace(operation=operation, rename=rename), rows.timed)
