"""Read one record: a point, vector, pose, twist or wrench; the meaning of its numbers, their paths and its frames.

    {"id": 7, "frame": "lidar", "point": [1, 2, 3]}
    {"header": {"frame_id": "map"}, "pose": {"position": {"x": ..}, "orientation": {"x": ..}}}    as in ROS messages
    {"x": 1, "y": 2, "z": 3, "qx": 0, "qy": 0, "qz": 0, "qw": 1}                                  as columns of tables

Arguments, files, streams and messages are read by this definition; other keys are preserved.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from itertools import product
from math import nan
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from frametool.errors import NamedTuple, did_you_mean, shown
from frametool.geometry import floats
from frametool.grammar import readers
from frametool.grammar.pose import (
    COVARIANCE_KEYS,
    DESCRIPTIVE,
    POSITION_KEYS,
    RELATIVE,
    ROTATION_KEYS,
    SCALE,
    XYZ,
    Pose,
    as_meant,
    inverted,
    read_angle_unit,
    read_pose,
    read_rotation,
)
from frametool.grammar.readers import EARTH_FRAMES, NAME_KEYS, PARENT_COLUMNS, STAMP_KEYS, Misfit, Reading, kind, within
from frametool.rows.holders import POINT_KEYS, Members, bare_numbers, covariance_keys, find_holders, value_at
from frametool.rows.shapes import ACCEL, PARTS, POINT, POSE, TURN, VECTOR, Shape, checked_rotation, doubt
from frametool.text.numbers import parse_number, read_number_or_angle

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.grammar.readers import Path
    from frametool.rows.columns import PoseColumns
    from frametool.rows.holders import Holder
    from frametool.rows.request import Request

KEYS_REMEDY = "name the keys _deg"
EARTH_PARENTS, EARTH_NAMES = ("parent", "frame"), ("child_frame_id", "name", "frame_id")


class Name(NamedTuple):
    """A frame's name, None if missing or empty, and the paths at which the record has it."""

    text: str | None = None
    paths: tuple[Path, ...] = ()


class RecordKeys(NamedTuple):
    """The keys of a record's position, rotation and covariance.

    position: "" if each of its numbers has a key of its own, then these are `members`
    others: further keys with the same rotation or position in another notation
    flat: the keys of a rotation with one number each; `rotation` is then the first of them
    covariances: the keys of the covariances, or of a scale, whose numbers are the last
    placed: the keys of a geodetic position, if the record's numbers are converted from it
    """

    position: str = ""
    rotation: str = ""
    others: tuple[str, ...] = ()
    members: tuple[str, ...] = ()
    flat: tuple[str, ...] = ()
    covariances: tuple[str, ...] = ()
    placed: tuple[str, ...] = ()


class Record(NamedTuple):
    """One point, vector, pose, twist or wrench: its numbers, their meaning and paths, and its frames.

    path: of the mapping or list with the numbers
    numbers: the path of each number; None for a missing one, which is 0
    values: the numbers, in the order of `shape`
    begins: the path of the first entry of each covariance of a message; -1 there means unknown
    stamps: the paths of seconds and nanoseconds in its header, then in those around it; stamp_ns: the first stamp
    """

    path: Path
    shape: Shape
    numbers: tuple[Path | None, ...] = ()
    values: tuple[float, ...] = ()
    keys: RecordKeys = RecordKeys()
    name: Name = Name()
    parent: Name = Name()
    begins: tuple[Path, ...] = ()
    stamps: tuple[Path, ...] = ()
    stamp_ns: int | None = None


def find_records(document: Any, request: Request, reading: Reading, path: Path) -> Iterator[Record]:
    """Yield the records of a document in order; all paths begin with `path`, that of the document.

    Raises Misfit, with the path, for a document without records and for a record that cannot be read.
    """
    root: Any = document  # all paths begin here; a proxy is no dict, so that no key is searched in it
    for step in reversed(path):
        root = MappingProxyType({step: root})
    for each in find_holders(document, path, request, reading):
        yield read_record(root, each, request, reading)


def read_record(root: Any, holder: Holder, request: Request, reading: Reading) -> Record:
    """Read the record in a mapping or list."""
    path, field, kind, members = holder
    value, formula = value_at(root, path), request.operation.formula
    reading.here = path
    try:
        if type(value) is list:
            return _bare_list(value, path, reading, request)
        if kind:
            record = _of_message(value, path, reading, request, field=field, kind=kind)
        elif request.rows.poses:
            record = _mapping(members or Members(value), path, reading, request)
    except Misfit as misfit:
        raise misfit.below(*path) from None
    if not request.rows.poses:
        record = _only_asked(value, path, request)
    if formula is not None and record.shape.kind in PARTS:
        raise Misfit(f"an expression takes poses, points and vectors; this is a {record.shape.kind}", path)
    if formula is not None and not (formula.reads_row or record.values or Members(value).say_pose):
        record = record._replace(shape=Shape("", None))
    # the covariance is in the record, or in the mapping around it as in messages
    around = (path, path[:-1]) if path[-1:] == (record.shape.kind,) else (path,)
    keys = {*covariance_keys(field), *COVARIANCE_KEYS}
    for each in () if record.keys.placed or request.operation.only_adds else around:
        outer = value_at(root, each)
        if type(outer) is dict and (not keys.isdisjoint(outer) or any(map(readers.may_be_uncertain, outer))):
            from frametool.rows.columns_uncertain import with_covariances

            record = with_covariances(record, outer, each, covariance_keys(field), request, reading)
            break
    record = _with_asked(record, root, request)
    return _with_names(record, root, request) if request.rows.poses else record


def _only_asked(value: dict[str, Any], path: Path, request: Request) -> Record:
    """Return a record without numbers, to which the operation adds a result; it must not have such keys yet.

    A JointState is replaced by the pose, and the frame of its header becomes that of the pose.
    """
    from frametool.ros import messages

    record, header = Record(path, Shape("", None)), value.get("header")
    ours = {*POSITION_KEYS, *ROTATION_KEYS}.difference(key for key in STAMP_KEYS if type(value.get(key)) is not list)
    if messages.is_joint_state(value):
        record = record._replace(keys=RecordKeys(members=tuple(key for key in messages.STATE_LISTS if key in value)))
        if type(header) is dict:
            record = record._replace(parent=_named(header, ("frame_id",), (*path, "header"), Name(), request))
    elif there := next((key for key in value if key in ours), None):
        raise Misfit(f"key {shown(there)} is there already, where the result would stand", (*path, there), key=True)
    elif request.operation.shown is None:
        return record
    return _with_stamp(record, header, (*path, "header", "stamp")) if type(header) is dict else record


def outermost(path: Path) -> Path:
    """Return the path of the outermost value with a single record: an item of a list, or the document."""
    return path[: max((at for at, step in enumerate(path, 1) if type(step) is int), default=0)]


def _with_asked(record: Record, root: Any, request: Request) -> Record:
    """Add the numbers of the keys that a formula needs; raise Misfit if a key that is added exists."""
    operation, value, said = request.operation, value_at(root, record.path), request.operation.shown
    for name in operation.columns:
        found, number = None, nan
        if not said or value.get(name.partition(".")[0], "") is not None:  # else no pixel
            found = key_path(root, record.path, (name,), "a number")
            text = value_at(root, found)
            number = within(found, parse_number, text if type(text) is str else "")
        record = record._replace(numbers=(*record.numbers, found), values=(*record.values, number))
    if operation.only_adds or operation.of:
        _refuse_repeated(record, root, request)
    return record._replace(shape=record.shape._replace(extras=operation.columns)) if operation.columns else record


def _refuse_repeated(record: Record, root: Any, request: Request) -> None:
    """Raise Misfit if a key of the result exists, unless a comparison replaces that of an earlier one."""
    operation, said, path = request.operation, request.operation.shown, record.path
    names, last, problem = operation.extras(record.shape), len(path), ", where the result would stand"
    first = len(outermost(path) if request.results.rewrite_records else path)  # in another format all is in one row
    if operation.only_adds:
        names += () if said is None or said.replaces else (*said.members,)
        first = last = len(outermost(path))
        problem = "; take another name, or --prefix"
    for holder in (value_at(root, path[:depth]) for depth in range(first, last + 1)):
        is_compared = not operation.only_adds and {*RELATIVE} <= {*holder}
        for key in (request.results.prefix + name for name in names if operation.only_adds or name in DESCRIPTIVE):
            if key in holder and not is_compared and key not in record.keys.flat:
                raise Misfit(f"key {shown(key)} is there already{problem}", path)


def _of_message(value: Any, path: Path, reading: Reading, request: Request, *, field: str, kind: str) -> Record:
    """Read a field of a message; an orientation whose covariance begins with -1 is unknown and unchanged."""
    if request.rows.kind not in ("", kind):
        raise Misfit(f"{field} cannot be taken for a {request.rows.kind}")
    if kind == VECTOR:
        return _with_position(Record(path, Shape(kind), keys=RecordKeys(field)), value[field], 1.0, partial=False)
    if known := value.get(key := covariance_keys(field)[0]):
        from frametool.rows.columns_uncertain import is_unknown

        if within((key,), is_unknown, known, (9,)):
            return Record(path, Shape("", None), keys=RecordKeys(rotation=field))
    reading.degrees = request.rows.degrees
    record = _with_rotation(value[field], field, Record(path, Shape(POSE, None)), (field,), reading, request)
    return record._replace(shape=record.shape._replace(kind=kind))


def _bare_list(value: list[Any], path: Path, reading: Reading, request: Request) -> Record:
    """Read [x, y, z], or the rows of a matrix."""
    if request.operation.only_adds or request.operation.columns:
        raise Misfit("a bare list has no keys; write a mapping like {point: [x, y, z]}")
    if type(value[0]) is list:
        return _with_rotation(value, "matrix", Record(path, Shape(POSE, None)), (), reading, request)
    if len(value) != 3 or not request.operation.moves:
        raise bare_numbers(value)
    return Record(path, Shape(_kind("", (), request)), *_three(value, path, 1.0))


def _mapping(members: Members, path: Path, reading: Reading, request: Request) -> Record:
    """Read the position and the rotation of a mapping, or the two vectors of a twist or wrench."""
    value, positions, rotations = members.value, members.positions, members.rotations
    if members.parts:
        return _two_vectors(value, ACCEL if path[-1:] == (ACCEL,) else members.parts, path, request)
    if members.on_earth:
        from frametool.rows.columns_earth import placed_record

        inner = partial(_pose_at_place, path=path, reading=reading, request=request)
        empty = Record(path, Shape("", None), parent=Name(EARTH_FRAMES[0]))
        if (found := placed_record(value, empty, positions, inner, reading, request)) is not None:
            return found
    flat = members.flat
    if flat and flat.position and flat.position.kind:
        if not request.operation.moves:
            raise Misfit(f"a {flat.position.kind} cannot be taken for a pose; apply moves it")
        return _with_flat(Record(path, Shape(flat.position.kind, None)), value, flat, reading, request)
    turned, there = rotations or (flat and flat.rotation), positions or (flat and flat.position)
    # a pose may have the same position or rotation twice
    several = () if turned and POSITION_KEYS.keys() >= {*positions} else (*positions[1:2],)
    if positions and flat and flat.position and not flat.position.absent:
        several = flat.position.names
    if several:
        both = f"{positions[0]} and {' '.join(several)}"
        raise Misfit(f"expected one position, found {both}", several[:1], key=True)
    members.refuse_typos({*([] if turned else ROTATION_KEYS), *([] if there else POSITION_KEYS)})
    key = positions[0] if positions else ""
    operation, rows, sigma = request.operation, request.rows, value.get("sigma")
    # with a sigma of the rotation it is a pose
    is_sure = type(sigma) is dict and any(each[:3] in ("rpy", "rol", "pit", "yaw") for each in sigma)
    turns = turned or (not operation.moves and is_sure)
    # a PointStamped or Vector3Stamped remains one in another format, unless a rotation is requested
    is_kept = operation.changes_nothing and operation.formula is None
    stays = not turns and "header" in value and key in (POINT, VECTOR) and is_kept and not (rows.kind or rows.given)
    stays = stays and {each.spec for each in request.results.notations} <= {"quaternion"}
    record = Record(path, Shape(key if stays else _kind(key, turns, request), None), keys=RecordKeys(key))
    if positions:
        record = _with_position(record, value[key], POINT_KEYS[key], partial="header" not in value)
    reading.degrees = read_angle_unit(value["angles"]) if "angles" in value else rows.degrees
    if flat:
        record = _with_flat(record, value, flat, reading, request)
    if rotations:
        record = _with_rotation(value[rotations[0]], rotations[0], record, (rotations[0],), reading, request)
    if len(rotations) > 1 or len(positions) > 1:
        keys = (*rotations, *(positions if len(positions) > 1 else ()))
        read_pose({key: value[key] for key in value if key in keys}, reading)  # they must be equal
    if (flag := value.get("inverse", "false")) not in ("true", "false"):
        raise Misfit(f"inverse must be true or false, found {kind(flag)}", ("inverse",))
    shape = record.shape._replace(inverse=flag == "true")
    record = record._replace(shape=shape, keys=record.keys._replace(others=(*rotations[1:], *positions[1:])))
    is_ecef = flat and flat.position and flat.position.affixes[0].lower().endswith("ecef_")
    place = request.rows.given_place or ("ecef" if is_ecef else "")
    return _given_on_earth(record, request.with_rows(given_place=place)) if place else record


def _given_on_earth(record: Record, request: Request) -> Record:
    """Return a record whose x, y, z are in ecef, or in the axes of an origin, as set by --from."""
    from frametool.geometry.place import Earth, Place

    place = Place.of_xyz(request.rows.given_place, request.earth or Earth())
    shape = record.shape
    if place is None or shape.whole or shape.unit is None:
        return record
    if shape.unit != 1.0:
        raise Misfit(f"--from {request.rows.given_place} takes metres")
    is_point = shape.notation is None and not request.rows.kind and request.operation.keeps_frames
    shape = shape._replace(unit=place, kind=POINT if is_point else shape.kind)
    return record._replace(shape=shape, parent=Name(EARTH_FRAMES[0]))


def _pose_at_place(rest: dict[str, Any], path: Path, reading: Reading, request: Request) -> tuple[Pose, list[str]]:
    """Read the pose next to a geodetic position, and return its keys except those of its covariance."""
    covariance = None
    if not COVARIANCE_KEYS.isdisjoint(rest):
        from frametool.grammar.covariance import read_covariance

        covariance = read_covariance(rest, reading)
    bare = {key: each for key, each in rest.items() if key not in COVARIANCE_KEYS}
    own = Members(bare)
    if not (own.say_pose or own.flat):
        return Pose(covariance=covariance), []
    record = _mapping(own, path, reading, request.with_rows(kind=POSE))
    used = [*own.rotations, *own.positions, *record.keys.members, *record.keys.flat, *{"angles"}.intersection(bare)]
    return pose_of(record, request)._replace(covariance=covariance), used


def pose_of(record: Record, request: Request) -> Pose:
    """Return a record as a pose with its frames; position or rotation is None if it has none."""
    shape, values, names = record.shape, record.values, (record.name.text, record.parent.text)
    check, is_placed = partial(checked_rotation, shape, normalize=request.rows.normalize), shape.whole or shape.unit
    if request.operation.reads_scale(shape):
        from frametool.rows.columns_uncertain import of_multiple

        whole = of_multiple(shape, values[: shape.own_size], lambda own: check(own)[0], floats)
        pose = Pose.of(whole[: 7 + (whole[7] != 1.0)], *names)
        return pose if is_placed else pose._replace(position=None)
    position: Any = shape.position(values) if is_placed else None
    rotation: Any = None if shape.notation is None else shape.turned(values, check(values)[0])
    covariance = values[shape.own_size :][:36] if 36 in shape.covariance else None
    scale = values[-1] if 1 in shape.covariance else 1.0
    pose = Pose(position, rotation, *names, None, covariance, scale)
    return inverted(pose) if shape.inverse else pose


def _two_vectors(value: dict[str, Any], name: str, path: Path, request: Request) -> Record:
    """Read a twist or a wrench."""
    if request.rows.kind not in ("", name) or not request.operation.moves:
        raise readers.NotARotation(f"a {name} cannot be taken for a {request.rows.kind or POSE}")
    halves = [within((part,), _three, value[part], (*path, part)) for part in PARTS[name]]
    paths, numbers = (first + second for first, second in zip(*halves, strict=True))
    return Record(path, Shape(name, None), paths, numbers)


def _with_flat(record: Record, value: dict[str, Any], flat: PoseColumns, reading: Reading, request: Request) -> Record:
    """Add position, unless it has one, and rotation from keys with one number each."""
    from frametool.rows.columns import Columns, row_shape

    position, rotation = flat
    if record.keys.position:
        flat = flat._replace(position=Columns((), (), unit=record.shape.unit))
    elif position is not None:
        record = record._replace(
            shape=record.shape._replace(unit=position.unit, absent=position.absent),
            numbers=tuple((*record.path, name) for name in position.names),
            values=tuple(_number(value, name, metres=position.unit == 1.0) for name in position.names),
            keys=RecordKeys(members=position.names),
        )
    if rotation is None:
        return record
    names = rotation.names
    shape = row_shape(flat, request.with_rows(degrees=reading.degrees), POSE)
    paths, values = ((), ()) if shape.whole else (record.numbers, record.values)
    numbers = [_number(value, name, degrees=shape.in_degrees(at)) for at, name in enumerate(names, len(values))]
    if shape.notation is not None:
        numbers = as_meant(shape.notation, numbers, [value[name] for name in names], reading)
    every = (*values, *numbers)
    for rule, message in within((names[0],), checked_rotation, shape, every, normalize=reading.normalize)[1]:
        reading.note(message, names[0], rule=rule)
    angles = shape.rotation(every)
    largest = max(shape.bare_angles, key=lambda at: abs(angles[at]), default=None)
    if largest is not None and abs(angles[largest]) > TURN:
        name = names[shape.number_at(largest) - shape.position_size]
        reading.note(doubt(shape, angles[largest], KEYS_REMEDY), name, rule="degrees")
    keys = record.keys._replace(rotation=next(key for key in value if key in names), flat=names)
    paths = (*paths, *((*record.path, name) for name in names))
    return record._replace(shape=shape, numbers=paths, values=every, keys=keys)


def _number(value: dict[str, Any], key: str, *, degrees: bool | None = None, metres: bool = False) -> float:
    """Read a member that is a number, an angle, or a length."""
    if type(value[key]) is not str:
        raise Misfit(f"expected a number, found {kind(value[key])}", (key,))
    return float(within((key,), read_number_or_angle, value[key], degrees, metres=metres))


def _kind(key: str, rotations: object, request: Request) -> str:
    """Return the kind of a mapping: a pose if it has a rotation, else a point or vector, or the kind set by --as."""
    if request.rows.kind in PARTS:
        raise Misfit(f"a {request.rows.kind} has {' and '.join(PARTS[request.rows.kind])}, two vectors {{x:, y:, z:}}")
    if rotations or request.rows.kind == POSE or not request.operation.takes_points:
        if rotations and request.rows.kind not in ("", POSE):
            raise Misfit(f"a record has a rotation and cannot be taken for a {request.rows.kind}")
        return POSE
    return request.rows.kind or (VECTOR if key == "vector" else POINT)


def _with_position(record: Record, value: Any, metre: float, *, partial: bool) -> Record:
    """Add the position: a list, or a mapping in which missing numbers are 0 if it may be partial."""
    key, parts = record.keys.position, round(1.0 / metre, 6)
    paths, numbers = within((key,), _three, value, (*record.path, key), parts, partial=partial)
    return record._replace(shape=record.shape._replace(unit=parts), numbers=paths, values=numbers)


def _three(
    value: Any, below: Path, parts: float = 0.0, *, partial: bool = False
) -> tuple[tuple[Path | None, ...], tuple[float, ...]]:
    """Read a list, or x, y and z, with the paths of the numbers; if it may be partial, missing ones are 0.

    parts: units per metre of a length, 0 for other numbers
    """
    numbers = readers.read_numbers(value, XYZ, partial=partial, metres=parts == 1.0)
    if type(value) is list:
        return tuple((*below, *step) for step in readers.places_in(value)), numbers
    return tuple((*below, axis) if axis in value else None for axis in XYZ), numbers


def _with_rotation(value: Any, key: str, record: Record, below: Path, reading: Reading, request: Request) -> Record:
    """Add the numbers of the rotation; of a scaled matrix s R it is checked when s is known."""
    row = ROTATION_KEYS.get(key)
    is_multiple = request.operation.multiples and row is not None and row.representation.whole is not None
    quiet = Reading(reading.source, degrees=reading.degrees) if is_multiple else reading
    _, _, notation, values, degrees, places = within(below, read_rotation, key, value, quiet, check=not is_multiple)
    joined = notation.representation.whole
    whole = joined is not None and len(values) == len(joined.columns)
    if whole and record.shape.unit is not None:
        raise Misfit("a 4x4 matrix is the whole pose; remove xyz, or write the 3x3 rotation", below)
    paths: tuple[Path | None, ...] = (None,) * len(values)
    if places and degrees == (reading.degrees if notation.degrees is None else notation.degrees):
        above, has_all = (*record.path, *below), type(value) is not dict
        paths = tuple((*above, *each) if has_all or each[0] in value else None for each in places[: len(values)])
    # else the numbers have another unit than their key, and are not replaced in place
    shape = record.shape._replace(kind=POSE, notations=((notation, degrees),), whole=whole)
    keys, every = record.keys._replace(rotation=key), (*record.values, *values)
    return record._replace(shape=shape, numbers=record.numbers + paths, values=every, keys=keys)


def _with_names(record: Record, root: Any, request: Request) -> Record:
    """Add the frames of the record and of the message around it, and the stamp of its header."""
    parent, name, path = Name(), Name(), record.path
    on_earth = record.parent.text in EARTH_FRAMES
    for depth in range(len(path), -1, -1):
        value = value_at(root, around := path[:depth])
        if type(value) is not dict:
            continue
        if record.shape.kind == POSE and SCALE in value and (around == path or type(value[SCALE]) is str):
            from frametool.rows.columns_uncertain import with_scale

            record = with_scale(record, value[SCALE], around, request)  # not the scale of a Marker, which is a size
        parent_keys, name_keys = (EARTH_PARENTS, EARTH_NAMES) if on_earth else (PARENT_COLUMNS, NAME_KEYS)
        parent = _named(value, parent_keys, around, parent, request)
        if record.shape.kind == POSE or around == path:
            name = _named(value, name_keys, around, name, request)
        header = value.get("header")
        if type(header) is dict:
            inside = (*around, "header")
            if on_earth:  # the frame of a NavSatFix is its antenna
                name = name if name.text else Name(header.get("frame_id") or None)
            else:
                parent = _named(header, ("frame_id",), inside, parent, request)
            record = _with_stamp(record, header, (*inside, "stamp"))
    if on_earth:
        parent = parent._replace(text=parent.text or record.parent.text)
    return record._replace(parent=parent, name=name) if parent.paths or name.paths or on_earth else record


def _named(value: dict[str, Any], keys: Sequence[str], path: Path, found: Name, request: Request) -> Name:
    """Add the name under some keys of a mapping; raise Misfit if two of them differ."""
    for key in keys:
        text = value.get(key)
        if key not in value or type(text) in (dict, list) or (key == "frame" and text and request.counts(text)):
            continue
        if not text and key in ("name", "parent", "frame"):
            hint = f"leave {key} out or quote the name"
            raise Misfit(f"{key} must be a frame's name, found nothing; {hint}", (*path, key))
        if text and found.text and text != found.text:
            where = ".".join(map(str, found.paths[0][1:][-2:]))  # without the number of the document
            raise Misfit(f"{key} says {shown(text)} and {where} says {shown(found.text)}; keep one", (*path, key))
        found = Name(found.text or text or None, (*found.paths, (*path, key)))
    return found


def _with_stamp(record: Record, header: dict[str, Any], path: Path) -> Record:
    """Add the stamp of a header and the paths of its seconds and nanoseconds; that of an inner header comes first."""
    if "stamp" not in header:
        return record
    from frametool.ros.messages import read_stamp

    stamp_ns = within(path, read_stamp, header["stamp"])
    parts = (next(key for key in header["stamp"] if key.startswith(letter)) for letter in "sn")
    stamps = (*record.stamps, *((*path, part) for part in parts))
    return record._replace(stamps=stamps, stamp_ns=record.stamp_ns if record.stamps else stamp_ns)


def key_path(documents: Any, holder: Path, names: Sequence[str] = STAMP_KEYS, wanted: str = "a time like 12.5") -> Path:
    """Find a scalar of a point or pose, by default its stamp, in the record or in the mappings around it.

    The name of a joint finds its position in a JointState.  Raises Misfit.
    """
    from frametool.ros import messages

    around = [documents]
    for step in holder:
        around.append(around[-1][step])
    for name, depth in product(names, range(len(holder), 0, -1)):
        found = messages.position_of(name, around[depth]) or _below(around[depth], name)
        value = found and value_at(around[depth], found)
        if found and type(value) not in (dict, list):
            return (*holder[:depth], *found)
        if found and names is not STAMP_KEYS:
            raise Misfit(f"expected {wanted}, found {kind(value)}", (*holder[:depth], *found))
    if names is STAMP_KEYS:
        usual = ", ".join(names)
        raise Misfit(f"no stamp: neither a header nor {usual}; name its key with --time-column", holder)
    known = [key for each in around[1:] if type(each) is dict for key in each]
    raise Misfit(f"no key {shown(names[0])}{did_you_mean(names[0], known)}", holder)


def _below(value: Any, name: str) -> Path | None:
    """Return the path of a key, or of keys and indices joined by dots; None if absent."""
    for steps in ([name], name.split(".")):
        path, inner = list[str | int](), value
        with suppress(LookupError, TypeError):
            for step in steps:
                path.append(int(step) if type(inner) is list and step.isdecimal() else step)
                inner = inner[path[-1]]
            return (*path,)
    return None
