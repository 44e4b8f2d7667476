"""Find the points and poses inside a document: the mappings that hold a position or a rotation, however deep.

{"stamp": 1, "pose": {"position": {"x": ..}, "orientation": {"x": ..}}}     the holder is the value of `pose`
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import did_you_mean
from frametool.formats.points import POINT_KEYS
from frametool.grammar.pose import POSE_KEYS, read_angle_unit, read_name, read_position
from frametool.grammar.readers import INDICES, Misfit, NotARotation, Reading, kind, read_numbers, within
from frametool.grammar.rotation import AXES_KEY, ROTATION_KEYS, read_rotation, shape_of
from frametool.stream.row_layout import POINT, POSE, VECTOR, Shape

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.grammar.readers import Path
    from frametool.stream.header import Columns
    from frametool.stream.request import Request

INNER = ("transforms", "poses", "pose", "transform", "msg", "message")
XYZ = ("x", "y", "z")


class Holder(NamedTuple):
    """One point or pose: where it is held, what its numbers mean, and their paths (None: not written, so 0).

    key, rotation: the keys that hold position and rotation ("" for bare x, y, z); other rotations are told twice
    flat: keys that hold one number of the rotation each, `rotation` is the first of them
    name, parent: their values and paths; values: the numbers
    """

    path: Path
    shape: Shape
    numbers: tuple[Path | None, ...]
    values: tuple[float, ...]
    key: str = ""
    rotation: str = ""
    others: tuple[str, ...] = ()
    name: tuple[str | None, Path] = (None, ())
    parent: tuple[str | None, Path] = (None, ())
    inverse: bool = False
    flat: tuple[str, ...] = ()


def find_holders(value: Any, request: Request, reading: Reading, path: Path = ()) -> Iterator[Holder]:
    """Yield the points and poses of a document, in order; raises Misfit for what is none, or broken."""
    found = list(_search(value, (), ()))
    if not found:
        keys = f"the keys {', '.join(map(repr, value))}" if type(value) is dict else kind(value)
        raise Misfit(
            f"expected a point like {{point: [x, y, z]}} or a pose like {{xyz: [..], rpy_deg: [..]}}, found {keys}",
            path,
        )
    for inner, outer in found:
        yield _holder(value, inner, outer, request, reading)


def _search(value: Any, path: Path, outer: tuple[Path, ...]) -> Iterator[tuple[Path, tuple[Path, ...]]]:
    """Yield the paths of holders, each with those of the mappings around it."""
    if type(value) is list and value and not any(type(item) in (dict, list) for item in value):
        yield path, outer
    elif type(value) is list:
        if len(value) in (3, 4) and all(type(row) is list for row in value):
            yield path, outer
            return
        for index, item in enumerate(value):
            yield from _search(item, (*path, index), outer)
    elif type(value) is dict:
        if _is_holder(value) or set(XYZ) <= set(value):
            _refuse_several(value, ["the record's own keys"], path)
            yield path, outer
            return
        found = {
            key: list(_search(value[key], (*path, key), (*outer, path)))
            for key in INNER
            if type(value.get(key)) in (dict, list)
        }
        inner = [key for key in found if found[key]]
        if inner:
            _refuse_several(value, inner, path)
        for key in inner:
            yield from found[key]


def _is_holder(value: dict[str, Any]) -> bool:
    return any(_holds(key, each) for key, each in value.items())


def _refuse_several(value: dict[str, Any], found: list[str], path: Path) -> None:
    """Stop where a mapping holds more than one pose: which is meant nobody can tell."""
    ours = {*POINT_KEYS, *ROTATION_KEYS, *found}
    more = [key for key, each in value.items() if type(each) is dict and key not in ours and _is_holder(each)]
    if len(found) + len(more) > 1:
        raise Misfit(f"expected one point or pose in a record, found several: {', '.join([*found, *more])}", path)


def _holds(key: str, value: Any) -> bool:
    return (
        (_is_rotation(key, value) or key in POINT_KEYS)
        and value is not None
        and not (key == "point" and type(value) is str)
    )


def _is_rotation(key: str, value: Any) -> bool:
    return key in ROTATION_KEYS or (key == AXES_KEY and type(value) is str)


def _holder(document: Any, path: Path, outer: tuple[Path, ...], request: Request, reading: Reading) -> Holder:
    value = _at(document, path)
    try:
        if type(value) is list:
            return _bare_list(value, path, reading, request)
        return _mapping(document, value, path, outer, request, reading)
    except Misfit as misfit:
        raise misfit.below(*path) from None


def _bare_list(value: list[Any], path: Path, reading: Reading, request: Request) -> Holder:
    """Read [x, y, z], or the rows of a matrix."""
    if type(value[0]) is list:
        return _with_rotation(value, "matrix", Holder(path, Shape(POSE, None), (), ()), (), reading, request)
    if len(value) != 3:
        raise Misfit(
            f"a bare list of {len(value)} numbers does not say what it is; write {{rpy_deg: [..]}}, {{xyzw: [..]}}, .."
        )
    return Holder(
        path, Shape(request.kind or POINT), tuple((*path, *each) for each in INDICES[:3]), read_position(value, 1.0)
    )


def _mapping(
    document: Any,
    value: dict[str, Any],
    path: Path,
    outer: tuple[Path, ...],
    request: Request,
    reading: Reading,
) -> Holder:
    positions = [key for key in value if key in POINT_KEYS]
    rotations = [key for key, each in value.items() if _is_rotation(key, each)]
    flat = _flat_rotation(value, rotations) if request.kind in ("", POSE) else None
    if len(positions) > 1:
        raise Misfit(f"expected one position, found {' and '.join(positions)}", (positions[1],), key=True)
    _refuse_typos(value, rotations)
    key = positions[0] if positions else ""
    holder = Holder(path, Shape(_kind(key, rotations or flat or (), request), None), (), (), key)
    if positions:
        holder = _with_position(holder, value[key], (key,), POINT_KEYS[key])
    elif set(XYZ) <= set(value):
        _refuse_bare_quaternion(value)
        holder = _with_position(holder, {name: value[name] for name in XYZ}, (), 1.0)
    reading.degrees = read_angle_unit(value["angles"]) if "angles" in value else request.degrees
    if flat is not None:
        holder = _with_flat_rotation(value, flat, holder, reading, request)
    elif rotations:
        within((rotations[0],), read_rotation, rotations[0], value[rotations[0]], reading)
        holder = _with_rotation(value[rotations[0]], rotations[0], holder, (rotations[0],), reading, request)
        holder = holder._replace(others=tuple(rotations[1:]))
        _refuse_disagreement(value, rotations, reading)
    name, parent = _names(document, value, path, outer, pose=holder.shape.kind == POSE)
    return holder._replace(name=name, parent=parent, inverse=value.get("inverse") == "true")


def _refuse_typos(value: dict[str, Any], rotations: list[str]) -> None:
    """Stop at a key that is nearly a rotation's, where no other says the rotation."""
    for key in value:
        near = (
            "" if rotations or key in POSE_KEYS or key in POINT_KEYS else did_you_mean(key, ROTATION_KEYS, cutoff=0.75)
        )
        if near:
            raise Misfit(f"unknown key {key!r}{near}", (key,), key=True)


def _refuse_disagreement(value: dict[str, Any], rotations: list[str], reading: Reading) -> None:
    """Stop where several rotations do not say the same."""
    if len(rotations) > 1:
        from frametool.grammar.pose import read_pose

        read_pose({key: value[key] for key in rotations}, reading)


def _flat_rotation(value: dict[str, Any], rotations: list[str]) -> Columns | None:
    """Find a rotation among the keys by the names that columns have: qx qy qz qw, roll_deg pitch_deg yaw_deg, ..

    Raises Misfit if there are two, or one beside a key that holds a whole rotation.
    """
    from frametool.stream.header import find_rotations

    names = [key for key, each in value.items() if type(each) is str]
    found = [each for each in find_rotations(names, None) if not each.prefix and not each.suffix and not each.whole]
    if found and len(found) + len(rotations) > 1:
        shown = " and ".join([*(each.shown for each in found), *rotations])
        raise Misfit(f"expected one rotation, found {shown}", (found[0].names[0],), key=True)
    return found[0] if found else None


def _refuse_bare_quaternion(value: dict[str, Any]) -> None:
    """Stop at x, y, z beside w."""
    if "w" in value:
        message = "x, y, z beside w may be a quaternion or a point; write {quaternion: {..}} or {point: [..], w: ..}"
        raise Misfit(message, ("w",), key=True)


def _with_flat_rotation(
    value: dict[str, Any], columns: Columns, holder: Holder, reading: Reading, request: Request
) -> Holder:
    """Add a rotation whose numbers are members of the record itself."""
    from frametool.grammar.rotation import read_components, rotation_of

    form, names, texts = columns.form, columns.names, [value[name] for name in columns.names]
    if form is None or request.poses != 1:
        raise Misfit("a record holds one pose; two in a row are for tables")
    places = [(name,) for name in names]
    try:
        rotation_of(form, texts, places, reading)
    except NotARotation as misfit:
        raise misfit.below(names[0]) from None
    values, degrees = read_components(form, texts, places, reading)
    numbers = (*holder.numbers, *((*holder.path, name) for name in names))
    shape = holder.shape._replace(kind=POSE, notation=form, degrees=degrees)
    first = next(key for key in value if key in names)
    return holder._replace(
        shape=shape, numbers=numbers, values=(*holder.values, *values), rotation=first, flat=tuple(names)
    )


def _kind(key: str, rotations: Sequence[object], request: Request) -> str:
    if rotations or request.kind == POSE or not request.operation.moves:
        if rotations and request.kind not in ("", POSE):
            raise Misfit(f"a record has a rotation and cannot be taken for a {request.kind}")
        return POSE
    return request.kind or (VECTOR if key == "vector" else POINT)


def _with_position(holder: Holder, value: Any, below: Path, metre: float) -> Holder:
    """Add the position: a list, or a map in which what is missing is 0."""
    x, y, z = within(below, read_numbers, value, XYZ, partial=True)
    steps = INDICES[:3] if type(value) is list else tuple((name,) for name in XYZ)
    paths = tuple((*holder.path, *below, *step) if type(value) is list or step[0] in value else None for step in steps)
    return holder._replace(shape=holder.shape._replace(unit=round(1.0 / metre, 6)), numbers=paths, values=(x, y, z))


def _with_rotation(value: Any, key: str, holder: Holder, below: Path, reading: Reading, request: Request) -> Holder:
    """Add the rotation's numbers."""
    form, texts, places = shape_of(key, value)
    whole = len(texts) == 16
    if whole and holder.shape.unit is not None:
        raise Misfit("a 4x4 matrix is the whole pose; leave xyz out, or write the 3x3 rotation", below)
    from frametool.grammar.rotation import read_components

    values, degrees = read_components(form, texts, places, reading)
    paths = tuple(_path_if_there(value, (*holder.path, *below), place) for place in places[: len(texts)])
    if degrees != (reading.degrees if form.degrees is None else form.degrees):
        paths = (None,) * len(paths)  # the numbers say another unit than their key: the member is written anew
    shape = holder.shape._replace(kind=POSE, notation=form, degrees=degrees, whole=whole)
    if request.poses != 1:
        raise Misfit("a record holds one pose; two in a row are for tables")
    return holder._replace(shape=shape, numbers=holder.numbers + paths, values=(*holder.values, *values), rotation=key)


def _path_if_there(value: Any, path: Path, place: Path) -> Path | None:
    try:
        _at(value, place)
    except (KeyError, IndexError, TypeError):
        return None
    return (*path, *place)


def _names(
    document: Any,
    value: dict[str, Any],
    path: Path,
    outer: tuple[Path, ...],
    *,
    pose: bool,
) -> tuple[tuple[str | None, Path], tuple[str | None, Path]]:
    """Return the names of the frame posed and of its parent: the holder's own, or the message's around it."""
    own = (read_name(value, "name"), (*path, "name"))
    given = (read_name(value, "parent"), (*path, "parent")) if pose else (read_name(value, "frame"), (*path, "frame"))
    for around in (path, *reversed(outer)):
        message = _at(document, around)
        header = message.get("header") if type(message) is dict else None
        if given[0] is None and type(header) is dict and type(header.get("frame_id")) is str and header["frame_id"]:
            given = header["frame_id"], (*around, "header", "frame_id")
        if (
            own[0] is None
            and type(message) is dict
            and type(message.get("child_frame_id")) is str
            and message["child_frame_id"]
        ):
            own = message["child_frame_id"], (*around, "child_frame_id")
    return own, given


def _at(value: Any, path: Path) -> Any:
    for step in path:
        value = value[step]
    return value
