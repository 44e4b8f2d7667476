"""From a table's columns and what is asked for to the plan of its rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import FormatError, alternatives
from frametool.geometry.representations import notation
from frametool.stream.blocks import Plan
from frametool.stream.faults import Misused
from frametool.stream.header import Pose, find_poses, named_pose
from frametool.stream.output_columns import Kept, New, Told, lay_out, refuse_repeated
from frametool.stream.row_layout import POINT, POSE, Shape, Target

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.representations import Notation
    from frametool.stream.header import Columns
    from frametool.stream.output_columns import Column, Layout
    from frametool.stream.request import Request
    from frametool.stream.table import Table

TUM = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
FRAME_NAMES = ("frame", "frame_id", "header.frame_id", "field.header.frame_id")
COUNTING = "frame"  # such a column often counts pictures: beside a SOURCE it is not asked


def plan_table(table: Table, request: Request, source: str) -> tuple[Plan, Layout]:
    """Settle which columns are read and written; raises FormatError that names the columns there are."""
    poses = _find(table, request, source)
    if request.poses == 1 and not request.operation.moves and request.operation.keeps_position:
        poses = [_without_position(poses[0], request, table, source)]
    shapes = tuple(_shape(pose, request) for pose in poses)
    target = _target(shapes, request)
    places = tuple(place for pose in poses for columns in pose if columns for place in columns.places)
    frames = _frame_columns(table, request, source)
    edge_of = request.edge_of
    if frames and edge_of is None:
        edge_of = request.way
    columns = _columns(table, poses, shapes, target, request, frames)
    if table.header:
        refuse_repeated(columns, table.names or ())
    layout = lay_out(columns, places, frames, table.width, table.delimiter)
    layout = layout._replace(time=_time_column(table, request, source))
    return Plan(
        shapes, (target,), request.operation, layout.pieces, tuple(table.name(place) for place in places), layout.null,
        edge_of, request.normalize, request.precision, request.on_error, request.unwrap,
        timed=request.timed, frame_column=table.name(frames[0]) if len(frames) == 1 else "",
    ), layout  # fmt: skip


def _find(table: Table, request: Request, source: str) -> list[Pose]:
    """Find the columns of the poses, by --columns, by name, or by their number where there are no names."""
    if not request.poses:
        return []
    if request.columns:
        if len(request.columns) != request.poses:
            raise Misused(f"--columns is given {len(request.columns)} times, for {request.poses} poses in a row")
        return [named_pose(spec, table.names, table.width, request.given) for spec in request.columns]
    if table.names:
        return find_poses(table.names, request.given, request.poses, source)
    if request.poses == 1 and (spec := _by_width(table.width, request.given)):
        return [named_pose(spec, None, table.width, request.given)]
    raise FormatError(
        f"{table.width} columns without names do not say what they are; give --columns", source=source, line=1
    )


def _by_width(width: int, given: Notation | None) -> str:
    """Take all columns of a table without names for a point or pose: TUM's eight, or as many as it has numbers."""
    size = len(given.representation.columns) if given else 0
    if given and given.representation.name == "matrix" and width in (16, 17):
        return f"{width - 15}-{width}"
    if given and width in (size, size + 3, size + 4):
        return f"{1 + (width == size + 4)}-{width}"
    return {3: "1-3", 7: "1-7", 8: "2-8", 16: "1-16"}.get(width, "") if not given else ""


def _without_position(pose: Pose, request: Request, table: Table, source: str) -> Pose:
    """Leave the position to pass as it is where only the rotation is rewritten."""
    if pose.rotation is None:
        wanted = "; give --from REP or --columns" if request.given is None else ""
        raise FormatError(
            f"no columns of a rotation among: {', '.join(table.names or ('columns without names',))}{wanted}",
            source=source,
            line=1,
        )
    return pose if _is_matrix(request.notations) or pose.rotation.whole else Pose(None, pose.rotation)


def _is_matrix(notations: Sequence[Notation]) -> bool:
    return len(notations) == 1 and notations[0].representation.name == "matrix"


def _shape(pose: Pose, request: Request) -> Shape:
    unit = pose.position.unit if pose.position else None
    if pose.rotation is None or pose.rotation.form is None:
        moved = request.operation.moves and request.kind != POSE
        return Shape((request.kind or POINT) if moved else POSE, unit)
    if request.kind not in ("", POSE) and request.operation.moves:
        raise Misused(
            f"rows have a rotation, {pose.rotation.shown}, and cannot be taken for a {request.kind}; "
            "name the three with --columns"
        )
    form = pose.rotation.form
    return Shape(POSE, None if pose.rotation.whole else unit, form, request.in_degrees(form), pose.rotation.whole)


def _target(shapes: Sequence[Shape], request: Request) -> Target:
    """Settle how results are written: as they were read unless told."""
    shape = shapes[0] if shapes else Shape(POSE)
    if shape.kind != POSE:
        return Target(shape.unit, ())
    notations = request.notations or ((shape.notation,) if shape.notation else ())
    if not notations and not _only_turns_around(request):
        notations = (notation("quaternion"),)
    forms = tuple((form, request.in_degrees(form)) for form in notations)
    placed = shape.whole or shape.unit is not None
    whole = placed and (_is_matrix(request.notations) or (shape.whole and not request.notations))
    unit = None if whole or not (placed or _shifts(request)) else shape.unit or 1.0
    return Target(unit, forms, request.keep_sign, whole)


def _only_turns_around(request: Request) -> bool:
    """Tell whether rows without a rotation have none afterwards."""
    operation = request.operation
    return operation.left is None and not operation.right and not operation.of and not _by_row(request)


def _by_row(request: Request) -> bool:
    """Tell whether each row has its own pose that moves it."""
    return request.edge_of is not None or request.timed is not None


def _shifts(request: Request) -> bool:
    """Tell whether rows without a position may have one afterwards."""
    operation = request.operation
    fixed = (operation.left, *operation.right, operation.fixed)
    return _by_row(request) or any(pose is not None and any(pose[:3]) for pose in fixed)


def _frame_columns(table: Table, request: Request, source: str) -> tuple[int, ...]:
    """Find the columns that name frames."""
    names = table.names or ()
    found = [name for name in names if name in FRAME_NAMES or name.endswith(("header.frame_id",))]
    agrees = not request.frames and request.told is not None and request.operation.moves
    if agrees and len(found) == 1 and found[0] != COUNTING:
        return (names.index(found[0]),)  # what rows say must agree with SOURCE
    if request.frames == ("",):
        if len(found) != 1:
            raise FormatError(
                f"rows do not say their frame; name SOURCE, or give --frame-column; columns: {', '.join(names)}",
                source=source,
                line=1,
            )
        return (names.index(found[0]),)
    for name in request.frames:
        if name not in names:
            raise Misused(f"no column {name!r}{alternatives(name, names, 'columns')}", source=source, line=1)
    return tuple(names.index(name) for name in request.frames)


def _time_column(table: Table, request: Request, source: str) -> int | None:
    """Find the column of the stamps, by its name or, where there are none, by its number from 1."""
    if request.timed is None:
        return None
    name, names = request.timed.name, table.names or tuple(map(str, range(1, table.width + 1)))
    if name not in names:
        raise Misused(f"no column {name!r}{alternatives(name, names, 'columns')}", source=source, line=1)
    return names.index(name)


def _columns(
    table: Table,
    poses: Sequence[Pose],
    shapes: Sequence[Shape],
    target: Target,
    request: Request,
    frames: Sequence[int],
) -> list[Column]:
    """Put the results where they belong."""
    new = _new_columns(poses, target, request)
    ours = [columns for pose in poses for columns in pose if columns is not None]
    columns: list[Column] = [Kept(place) for place in range(table.width)]
    if request.keep or not ours:
        return [*columns, *(column for group in new for column in group)]
    if request.told is not None and len(frames) == 1:
        columns[frames[0]] = Told(frames[0], request.told)
    at: dict[int, list[Column]] = {place: [] for each in ours for place in each.places}
    position, rotation, extras = new
    pose = poses[0]
    if _in_place(pose, shapes[0], target, request):
        for column, place in zip(
            (*position, *rotation), (place for each in ours for place in each.places), strict=False
        ):
            at[place].append(column)
        at[max(at)] += [*(position + rotation)[len(at) :], *extras]
    elif pose.position and pose.rotation and target.unit is not None and len(poses) == 1:
        for column, place in zip(position, pose.position.places, strict=True):
            at[place].append(column)
        at[min(pose.rotation.places)] += [*rotation, *extras]
    else:
        at[min(at)] += [*position, *rotation, *extras]
    return [column for place, given in enumerate(columns) for column in at.get(place, [given])]


def _in_place(pose: Pose, shape: Shape, target: Target, request: Request) -> bool:
    """Tell whether each number of the result stands where one of the input did."""
    if request.poses != 1:
        return False
    same = not target.notations or shape.notation is None or [form for form, _ in target.notations] == [shape.notation]
    placed = (shape.unit is None) == (target.unit is None)
    return same and placed and shape.whole == target.whole and (pose.position is not None or pose.rotation is not None)


def _new_columns(poses: Sequence[Pose], target: Target, request: Request) -> list[list[Column]]:
    """Name the numbers of the result: position, rotation, what else there is."""
    pose = poses[0] if poses else Pose(None, None)
    rotation_names = [name for form, degrees in target.notations for name in _names(form, degrees=degrees)]
    if target.whole:
        rotation_names = [f"m{row}{column}" for row in "1234" for column in "1234"]
    rotation = pose.rotation
    same = rotation is not None and [form for form, _ in target.notations] == [rotation.form]
    if rotation and same and rotation.whole == target.whole and not request.prefix and len(poses) == 1:
        rotation_names = list(rotation.names)
    else:
        rotation_names = _affixed(rotation_names, pose.rotation, request, len(poses))
    names = ["x", "y", "z"] if target.unit is not None else []
    if names and pose.position and not request.prefix and len(poses) == 1:
        names = list(pose.position.names)
    else:
        names = [request.prefix + name for name in names]
    extras = [request.prefix + name for name in request.operation.extras]
    indices = iter(range(len(names) + len(rotation_names) + len(extras)))
    return [[New(next(indices), name) for name in group] for group in (names, rotation_names, extras)]


def _affixed(names: Sequence[str], columns: Columns | None, request: Request, poses: int) -> list[str]:
    """Add to new names the affixes of those they come from, or the prefix asked for."""
    if request.prefix or columns is None or poses > 1:
        return [request.prefix + name for name in names]
    suffix = "" if "deg" in columns.suffix or "rad" in columns.suffix else columns.suffix
    return [columns.prefix + name + suffix for name in names]


def _names(form: Notation, *, degrees: bool) -> Sequence[str]:
    """Name a notation's columns; angles in degrees say so."""
    if form.degrees is not None or not degrees:
        return form.columns
    return [f"{name}_deg" if index in form.representation.angles else name for index, name in enumerate(form.columns)]
