"""Plan the rows of a table from its columns and the request: the columns to read, and the columns to write."""

from __future__ import annotations

import re
from contextlib import suppress
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

from frametool.errors import FormatError, Misused, NamedTuple, ValueInvalid, alternatives, shown
from frametool.grammar import readers
from frametool.grammar.readers import AXES_KEY, may_be_uncertain, nanoseconds_beside, stamp_places, without_mark
from frametool.rows import columns as header
from frametool.rows.columns import XYZ, PoseColumns, listed, row_shape
from frametool.rows.evaluate import Plan
from frametool.rows.request import NO_STAMPS, PAIR, PLAIN, Request
from frametool.rows.shapes import NORMAL, POINT, POSE, SIX, Shape, place_of, six_names
from frametool.rows.sinks import Const, In, Out, Word, one_of
from frametool.text.numbers import number_or_none

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.rows.sinks import Piece
    from frametool.rows.sources.tables import Table

class Kept(NamedTuple):
    """A column of the input that is unchanged."""

    place: int


class New(NamedTuple):
    """A column of the result: its name, and a number, a word for a number, or a constant text."""

    name: str
    piece: Out | Word | Const


class Named(NamedTuple):
    """A column of the input in which the result writes a frame: its parent (role 0) or its name (role 1)."""

    place: int
    role: int


Column: TypeAlias = Kept | New | Named


class Layout(NamedTuple):
    """The columns of the output, and the columns of the input to read.

    places: the columns of the numbers, in the order of the shapes
    times: the column of stamps; of whole seconds also that of the nanoseconds
    frames: the columns that name the frame a row is expressed in; for look-ups both frames
    named: the columns of the parent and of the name of a row's pose
    """

    columns: tuple[Column, ...]
    places: tuple[int, ...]
    frames: tuple[int, ...]
    times: tuple[int, ...] = ()
    named: tuple[int | None, int | None] = (None, None)


def plan_table(table: Table, request: Request) -> tuple[Plan, Layout]:
    """Choose the columns to read and to write; raises ValueInvalid with the known columns.

    With `all_numbers` in the request the plan has no pieces of text.
    """
    formula, poses, names = request.operation.formula, list[PoseColumns](), table.names or ()
    is_needed = formula is None or formula.reads_row or bool(request.rows.columns)
    with suppress(*() if is_needed else (FormatError, ValueInvalid)):
        poses = _find(table, request)
    on_earth = bool(poses) and poses[0].position is not None and place_of(poses[0].position.unit) is not None
    is_point = request.operation.turns and poses and poses[0].rotation is None
    passes = not (request.operation.moves or request.results.all_numbers or is_point)
    if request.rows.poses == 1 and not on_earth and passes and request.keeps_position:
        poses = [_without_position(poses[0], request, table)]
    shapes, places = tuple[Shape, ...](), tuple[int, ...]()
    for pose, kind in zip(poses, request.rows.kinds or (request.rows.kind,) * len(poses), strict=True):
        for columns in filter(None, pose):
            if columns.wrong:
                raise ValueInvalid(columns.wrong)
        shapes, places = (*shapes, row_shape(pose, request, kind)), places + pose.places
    if formula is not None:  # the columns that it reads come last
        shapes = ((shapes[0] if shapes else Shape("", None))._replace(extras=formula.columns),)
    if on_earth or request.results.place is not None:
        from frametool.rows.columns_earth import readers_of, settle

        request, shapes = settle(request, shapes, table, on_earth=on_earth)
    extra: tuple[int, ...] = ()
    if any(map(may_be_uncertain, names)):
        from frametool.rows.columns_uncertain import covariance_columns

        extra, shapes = covariance_columns(table, request, shapes)
    request = request.for_kind(shapes[0].kind) if shapes else request
    places += extra * bool(shapes and shapes[0].covariance)  # a formula uses none
    if len({*places}) < len(places):
        twice = sorted({table.name(place) for place in places if places.count(place) > 1})
        raise Misused(f"--columns: {', '.join(twice)} appears twice")
    places += tuple(_place(name, table) for name in request.operation.columns)
    for pose, kind in _turning_along(table, poses, request):
        poses, shapes, places = [*poses, pose], (*shapes, Shape(kind)), places + pose.places
    has_one = not shapes or request.operation.of == PAIR  # a pair has one result
    targets = tuple(map(request.target, shapes[:1] or (Shape(POSE),) if has_one else shapes))
    frames = _frame_columns(table, request, on_earth=on_earth)
    parent, name = frames[0] if frames and request.rows.poses else None, None
    if request.rows.poses and not (request.operation.moves and request.rename is None):
        name = _first_called(readers.NAME_KEYS, table)
    moves_each = on_earth or request.rows.frames or (frames and request.operation.moves)
    asked_at = range(shapes[0].own_size, shapes[0].size) if request.operation.shown else ()  # read empty as nan
    words, marked, staying = readers_of(shapes[0]) if on_earth else ({}, dict.fromkeys(asked_at, number_or_none), 0)
    if on_earth and (position := poses[0].position):  # the status of a fix is read and unchanged
        position = position._replace(places=position.places[: len(position.places) - staying])
        poses = [poses[0]._replace(position=position)]
    written = _columns(table, poses, shapes, targets, request, (parent, name), extra)
    if table.header:
        refuse_repeated(written, names, request)
    times = _stamp_columns(table, request, places, frames)
    pieces = () if request.results.all_numbers else pieces_of(written, table.width, table.delimiter)
    layout = Layout(tuple(written), places, frames, tuple(times), (parent, name))
    return Plan(
        shapes, targets, request, tuple(map(table.name, places)), pieces, b"" if table.delimiter else b"nan",
        request.pose_from_frame if moves_each else None, table.name(frames[0]) if len(frames) == 1 else "",
        categorical=words, dms_columns=marked,
    ), layout  # fmt: skip


def _find(table: Table, request: Request) -> list[PoseColumns]:
    """Find the columns of the poses: those of --columns, else by name, else by their number if they have no names.

    A twist next to a pose remains as other columns.
    """
    asked, specs, width = request.rows, request.rows.columns, table.width
    if not asked.poses:
        return []
    other = asked.stamp_or_weight_column if asked.stamps == NO_STAMPS else None
    apart = None if other is None else _place(other, table)
    if specs and len(specs) != asked.poses:
        raise Misused(f"--columns is given {len(specs)} times, for {asked.poses} poses in a row")
    if specs or not table.names:
        kinds = (asked.kinds if specs else ()) or (asked.kind,) * max(len(specs), 1)
        choose: Callable[..., PoseColumns] = header.chosen_pose
        if asked.given_place:
            from frametool.rows.columns_earth import chosen_pose as choose
        specs = specs or ("" if asked.given_place else _by_width(width, request),)
        chosen = zip(specs, kinds, strict=True)
        return [choose(spec, table.names, width, request, kind) for spec, kind in chosen]
    hidden = {at for at, name in enumerate(table.names) if at == apart or name == asked.stamp_or_weight_column}
    every = header.Header(table.names, hidden)
    six = header.find_six(every, asked.kind if asked.kind in SIX else "")
    if asked.kind in SIX and six is None:
        wanted = " ".join(six_names(asked.kind))
        found = f"no columns of a {asked.kind} ({wanted}) among: {listed(every.names)}; name them with --columns"
        raise ValueInvalid(found)
    others = every.without(six.places if six else ())
    if six is not None and (asked.kind in SIX or not others.has_pose):
        return [PoseColumns(six, None)]
    if not (request.operation.moves or request.operation.changes_nothing):
        others = every  # a twist would no longer be that of the pose
    if asked.poses == 1 and (asked.given_place or any(map(readers.may_be_on_earth, every.names))):
        from frametool.rows.columns_earth import find_pose

        if (pose := find_pose(others, request, table.source)) is not None:
            return [pose]
    return header.find_poses(others, asked.given, asked.poses)


def _by_width(width: int, request: Request) -> str:
    """Return all columns of a table without names, if their number decides what they are, perhaps after a stamp."""
    asked, said = request.rows, request.rows.given
    begin = 1 if asked.kind in SIX or width in header.by_count(said) else 2
    if asked.poses == 1 and (begin == 1 or (said is not None and width - 1 in {*said.counts[1:]})):
        return f"{begin}-{width}"
    reason = f"{width} columns without names do not say what they are; give --from REP, or --columns"
    if asked.poses == 1 and said:
        reason = f"{said.counted}; found {width} columns without names; or give --columns"
    raise ValueInvalid(reason)


def _turning_along(table: Table, poses: Sequence[PoseColumns], request: Request) -> list[tuple[PoseColumns, str]]:
    """Find the columns of vectors that rotate with the point or pose of a row, each with its kind."""
    operation, names, kind = request.operation, table.names or (), request.rows.kind
    if not poses or request.rows.columns or operation.formula is not None:
        return []
    found = list[tuple[tuple[int, ...], str]]()
    for each in table.normals if kind in ("", POINT) else ():
        if not {*names} >= {*XYZ, *each}:
            continue
        if operation.turns and (operation.left is not None or operation.mirrors):
            remedy = "--columns x,y,z turns the points alone, apply all of them"
            raise Misused(f"{' '.join(each)} would keep to the old axes; {remedy}")
        if operation.moves:
            found.append((tuple(map(names.index, each)), NORMAL))
    if operation.turns or (operation.moves and re.search(r"(?i) (?:body[_.])?[vw]x\b", f" {' '.join(names)}")):
        from frametool.rows.columns_uncertain import find_rates

        found += find_rates(names, poses[0].places, operation, table.source)
    return [(PoseColumns(header.Columns(at, tuple(names[each] for each in at)), None), kind) for at, kind in found]


def _without_position(pose: PoseColumns, request: Request, table: Table) -> PoseColumns:
    """Drop the position of a pose if only its rotation is rewritten; the columns of the position are then unchanged."""
    if pose.rotation is None and request.results.default_notation:
        return pose
    if pose.rotation is None:
        wanted = "; give --from REP or --columns" if request.rows.given is None else ""
        found = f"no columns of a rotation among: {listed(table.called)}{wanted}"
        raise ValueInvalid(found)
    leaves_plane = pose.position and not pose.position.wrong and pose.position.absent and request.results.notations
    is_whole = len(request.results.notations) == 1 and request.results.notations[0].representation.whole is not None
    stays = not (is_whole or pose.rotation.whole or leaves_plane)
    return PoseColumns(None, pose.rotation) if stays else pose


def _frame_columns(table: Table, request: Request, *, on_earth: bool) -> tuple[int, ...]:
    """Find the columns that name frames: those in options, else the one of the frame that rows are expressed in."""
    asked = request.rows
    names = table.names or ()
    if on_earth:
        return tuple(place for place, name in enumerate(names) if name == readers.PARENT_KEYS[0])[:1]
    if not (asked.poses or asked.frames):
        return ()
    if asked.frames and asked.frames != ("",):
        return tuple(_place(name, table) for name in asked.frames)
    found = _first_called(readers.PARENT_COLUMNS, table)
    if found is None and asked.frames:
        unsaid = "rows do not say their frame; name SOURCE, or give --frame-column; columns"
        raise ValueInvalid(f"{unsaid}: {', '.join(names)}")
    return () if found is None else (found,)


def _first_called(names: Sequence[str], table: Table) -> int | None:
    """Return the place of the column with the first name that exists, also after a message's path; None without one."""
    for name in names:
        for place, column in enumerate(table.names or ()):
            if column == name or ("_id" in name and column.endswith(f".{name}")):
                return place
    return None


def _place(name: str, table: Table) -> int:
    """Return the place of a column; raises Misused if it is missing or appears twice."""
    names, source = table.called, table.source
    if name not in names and names.count(bare := without_mark(name)) == 1:
        name = bare
    if name not in names:
        raise Misused(f"no column {shown(name)}{alternatives(name, names, 'columns')}", source=source, line=1)
    if names.count(name) > 1:
        raise Misused(f"column {shown(name)} appears twice", source=source, line=1)
    return names.index(name)


def _stamp_columns(table: Table, request: Request, places: Sequence[int], frames: Sequence[int]) -> list[int]:
    """Find the column of stamps, by its name or number, and the column of nanoseconds of stamps in whole seconds.

    With `all_numbers` in the request also a usual column that no option names.
    """
    if request.rows.stamps == NO_STAMPS:
        return []
    name = request.timed.name if request.timed else request.rows.stamp_or_weight_column
    if name is not None:
        time = _place(name, table)
        try:
            readers.in_nanoseconds(table.name(time))
        except ValueInvalid as error:
            raise Misused(str(error), source=table.source, line=1) from None
        below = nanoseconds_beside(table.names, time) if table.names else None
        return [time] if below is None else [time, below]
    if not (table.stamped and request.results.all_numbers):
        return []
    usual, below = stamp_places(table.names)
    if not (table.names or request.rows.columns) and min(places, default=1) == 1 and not frames:
        usual = 0  # the column before the numbers, or the only one
    return [] if usual in frames else [place for place in (usual, below) if place is not None]


def _columns(
    table: Table, poses: Sequence[PoseColumns], shapes: Sequence[Shape], targets: Sequence[Shape], request: Request,
    named: Sequence[int | None], covariance: Sequence[int],
) -> list[Column]:  # fmt: skip
    """Return the columns of the output; results replace the columns they come from if they match number by number.

    Else they replace the first of these columns.  With --keep or a formula they are added.
    named: the columns of the parent and the name; covariance: the columns of a covariance
    Raises Misused for several poses whose results have other numbers.
    """
    columns: list[Column] = [Kept(place) for place in range(table.width)]
    operation, asked = request.operation, request.results
    only_turned = operation.changes_nothing and asked.place is None
    if only_turned and asked.default_notation and not (asked.all_numbers or targets[0].notations or asked.keep):
        return columns
    at: dict[int, list[Column]] = {place: [] for pose in poses for place in pose.places}
    adds, ours = asked.keep or operation.only_adds or not at, tuple(at)
    for role, renamed in enumerate(named if request.rename is not None and not adds else ()):
        if renamed is not None:
            at.setdefault(renamed, [Named(renamed, role)])
    added, first = list[Column](), 0
    for number, target in enumerate(targets):
        pose = poses[number] if len(poses) == len(targets) else PoseColumns(None, None)  # of a pair
        shape, places = shapes[number] if shapes else Shape(POSE), pose.places or ours
        several = len(targets) > 1 and (request.rows.poses > 1 or number > 0)
        is_same = pose.rotation is not None and [each for each, _ in target.notations] == [pose.rotation.notation]
        position, rotation, extras = _new_columns(
            pose, target, request, shape, first, table.delimiter, several=several, same=is_same
        )
        first += target.size
        # True if each number of the result replaces one of the input
        read, written = ((each.unit is None, each.whole, len(each.absent)) for each in (shape, target))
        in_place = bool(pose.places) and read == written and shape.place is target.place is None
        in_place = in_place and (is_same or not target.notations or shape.notation is None)
        if several and (not in_place or (asked.notations and request.rows.poses > 1)):
            raise Misused("several --columns are moved as they are written; for --to, or a rotation alone, give one")
        if adds:
            added += [*position, *rotation, *extras]
            continue
        if covariance and not number:  # its entries are the last numbers of the result
            last = len(extras) - len(operation.carried(shape))
            at |= {place: extras[last:] if place == min(covariance) else [] for place in covariance}
            extras = extras[:last]
        parts: list[tuple[Sequence[int], list[Column]]]
        if not in_place and pose.position and pose.rotation and target.unit is not None:
            places = pose.position.places
            position = [*map(Kept, places), *position[len(places) :]] if only_turned else position
            parts = [(places, position), ((min(pose.rotation.places),), [*rotation, *extras])]
        else:
            parts = [(places if in_place else (min(places),), [*position, *rotation, *extras])]
        for own, new in parts:  # further new columns come after the last of these
            for place, column in zip(own, new, strict=False):
                at[place].append(column)
            at[max(own)] += new[len(own) :]
    if adds:  # after the others, or replacing columns of the same name
        gives_way = (operation.shown or PLAIN).replaces
        more = {getattr(each, "name", at) if gives_way else at: each for at, each in enumerate(added)}
        mixed = [more.pop(name, kept) for name, kept in zip(table.called, columns, strict=True)]
        return [*mixed, *more.values()]
    return [column for place, old in enumerate(columns) for column in at.get(place, [old])]


def _new_columns(
    pose: PoseColumns, target: Shape, request: Request, shape: Shape, first: int, delimiter: bytes,
    *, several: bool, same: bool,
) -> list[list[Column]]:  # fmt: skip
    """Return the new columns of a result, numbered from `first`: position, rotation, extras.

    several: the request has several results, so that the names are those of the input columns
    same: the rotation is written in the notation in which it was read
    """
    rotation, alone, prefix = pose.rotation, not request.results.prefix or several, request.results.prefix
    affixes = rotation.affixes if rotation and alone else (prefix, "")
    moved, gone = target.position_columns, target.absent
    turned = [name.join(affixes) for at, name in enumerate(target.names, len(moved)) if at not in gone]
    if rotation and alone and same and rotation.whole == target.whole:
        turned = [prefix + name for name in rotation.names]
    moved = [name for at, name in enumerate(moved) if at not in gone]
    if pose.position and (target.kind in SIX or (moved and alone and target.place == shape.place)):
        moved = list(pose.position.names)
        if target.place is None and not (target.kind in SIX or gone):
            moved += ["z".join(pose.position.affixes)] * (len(moved) < len(XYZ))
    words = (request.operation.shown or target.place or PLAIN).words
    between, null = (delimiter, b"") if delimiter else (b" ", b"nan")
    names = [*(prefix + name for name in moved), *turned, *(prefix + name for name in target.extras)]
    new: list[Column] = []
    for at, name in enumerate(names, first):
        new.append(New(name, Word(at, one_of(words[at], null=null)) if at in words else Out(at, at + 1, between)))
    axes: list[Column] = []
    if target.place is not None and turned and not (target.place == shape.place and AXES_KEY in target.place.fields):
        axes = [New(prefix + AXES_KEY, Const(target.place.axes.encode()))]
    begin, end = len(moved), len(moved) + len(turned)
    extra = [column for column, name in zip(new[end:], names[end:], strict=True) if name not in turned]
    return [[*new[:begin], *axes], new[begin:end], extra]


# --- the text of a row ---


def pieces_of(columns: Sequence[Column], width: int, delimiter: bytes) -> tuple[Piece, ...]:
    """Return the pieces of a row's text for its columns; neighbouring unchanged columns are one stretch.

    The key of a stretch is its two bounds in a row: 0 is the start of the line, cell i begins at 2 i + 1 and ends at
    2 i + 2, and the last bound is the end of the line.  The key of a written name is its `Named`.
    """
    pieces: list[Piece] = []

    def keep(begin: int, end: int) -> None:
        last = pieces[-1] if pieces else None
        if isinstance(last, In) and type(last.part) is tuple and last.part[1] == begin:
            begin = pieces.pop().part[0]  # type: ignore[union-attr]
        pieces.append(In((begin, end)))

    for before, column in pairwise((None, *columns)):
        last, new = pieces[-1] if pieces else None, column.piece if isinstance(column, New) else None
        if isinstance(column, Kept):  # with the delimiter before it, except for the first
            keep(2 * column.place + (before is None and column.place > 0), 2 * column.place + 2)
        elif isinstance(last, Out) and isinstance(new, Out) and last.last == new.first:
            pieces[-1] = last._replace(last=new.last)
        else:
            if isinstance(before, Kept) and before.place < width - 1:  # with the delimiter after it
                keep(2 * before.place + 2, 2 * before.place + 3)
            elif before:
                pieces.append(Const(delimiter or b" "))
            pieces.append(new or In(column))
    keep(2 * width, 2 * width + 1)
    return tuple(pieces)


def refuse_repeated(columns: Sequence[Column], names: Sequence[str], request: Request) -> None:
    """Raise Misused if a new column has the name of an unchanged column, or of another new one."""
    new = [column.name for column in columns if isinstance(column, New)]
    if len({*new}) < len(new):
        twice = sorted({name for name in new if new.count(name) > 1})
        if {*XYZ} <= {*twice}:
            hint = "a point with a weight: --columns x,y,z; a rotation: name it qx, qy, qz, qw"
            raise Misused(f"columns x, y, z, w are a quaternion, its position would have their names; {hint}")
        raise Misused(f"--to: columns {', '.join(twice)} would appear twice")
    if clash := sorted({*new}.intersection(names[each.place] for each in columns if not isinstance(each, New))):
        has_prefix = not request.results.all_numbers or request.operation.extras(Shape(POSE))
        remedy = "name the new ones with --prefix" if has_prefix else "rename them in the input"
        raise Misused(f"columns {', '.join(clash)} would appear twice; {remedy}")
