"""Records: the points, vectors, poses, twists and wrenches of a document, and where their numbers and names are.

    {"id": 7, "frame": "lidar", "point": [1, 2, 3]}
    {"header": {"frame_id": "map"}, "pose": {"position": {"x": ..}, "orientation": {"x": ..}}}    as in ROS messages
    {"x": 1, "y": 2, "z": 3, "qx": 0, "qy": 0, "qz": 0, "qw": 1}                                  as columns of tables

Arguments, files, streams and messages are read by this one definition; keys that are not named here pass.
"""

from __future__ import annotations

import re
from functools import partial
from itertools import chain, islice, product
from math import nan
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from frametool.errors import MOST_COMPARED, NamedTuple, ValueInvalid, alternatives, did_you_mean, first_of, shown
from frametool.geometry import floats
from frametool.geometry.representations import notation
from frametool.grammar import readers
from frametool.grammar.pose import (
    COVARIANCE_KEYS,
    LISTED_WORDS,
    POSE_KEYS,
    POSITION_KEYS,
    ROTATION_KEYS,
    SCALE,
    Pose,
    as_meant,
    inverted,
    is_position,
    is_rotation,
    read_angle_unit,
    read_pose,
    read_rotation,
    unknown_key,
)
from frametool.grammar.readers import EARTH_FRAMES, NAME_KEYS, PARENT_KEYS, STAMP_KEYS, Misfit, Reading, kind, within
from frametool.stream.row_layout import ACCEL, PARTS, POINT, POSE, TURN, VECTOR, Shape, checked_rotation, doubt
from frametool.text.numbers import parse_number, read_number_or_angle

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.grammar.readers import Path
    from frametool.stream.header import PoseColumns
    from frametool.stream.request import Request

    Holder = tuple[Path, str, str]  # of the numbers of a record; of a message its field, and the kind of that

POINT_KEYS = {"point": 1.0, "vector": 1.0, **POSITION_KEYS}  # with metres a unit
INNER = ("transforms", "static_transforms", "poses", "pose", "transform", "twist", "wrench", "accel", "msg", "message",
         "detections")  # fmt: skip
LISTS = ("markers", "polygon", "points")  # of messages that hold nothing else
COVARIANCES = ("covariance", "position_covariance", "orientation_covariance")
# a mapping with no other keys may be the identity
NOTHING_BUT = frozenset((*POSE_KEYS, *PARENT_KEYS, *NAME_KEYS)).difference(LISTED_WORDS)
KNOWN = frozenset((*POSE_KEYS, *POINT_KEYS, *PARENT_KEYS, *NAME_KEYS))
XYZ = ("x", "y", "z")
MOST_KEYS = 8  # named in a message
QUATERNION = (*XYZ, "w")
USED = KNOWN.difference(NAME_KEYS).union(ROTATION_KEYS, (readers.AXES_KEY, "sigma"), COVARIANCES, *PARTS.values())
NUMBER_BEGINS = frozenset("+-.0123456789n")  # n: of nan
KEYS_REMEDY = "name the keys _deg"
EARTH_PARENTS, EARTH_NAMES = ("parent", "frame"), ("child_frame_id", "name", "frame_id")
STALE = ("gimbal_lock", "distance", "angle", "angle_deg")  # they describe the pose that was


class Name(NamedTuple):
    """A frame's name and the paths at which a record says it; the name is None where it is missing or empty."""

    text: str | None = None
    paths: tuple[Path, ...] = ()


class RecordKeys(NamedTuple):
    """The keys under which a record says what it is.

    position: "" where each of its numbers is a member of the record, whose keys are `members`
    others: further keys that say the same rotation or position
    flat: keys that hold one number of the rotation each; `rotation` is then the first of them
    covariances: the keys of those whose numbers come last, or of a scale
    placed: those of a position on the Earth and the rotation there, where the record's numbers are not theirs
    """

    position: str = ""
    rotation: str = ""
    others: tuple[str, ...] = ()
    members: tuple[str, ...] = ()
    flat: tuple[str, ...] = ()
    covariances: tuple[str, ...] = ()
    placed: tuple[str, ...] = ()


class Record(NamedTuple):
    """One point, vector, pose, twist or wrench: what its numbers mean, where they are, which frames it names.

    path: of the mapping or list that holds the numbers
    numbers: the path of each; None for a number that is not written and counts as 0
    values: the numbers, in the order of `shape`
    begins: where each covariance of messages begins; those that begin with -1 are unknown, and none of these numbers
    stamps: the paths of seconds and nanoseconds in its header, then in those around it; stamp_ns: the time of the first
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
    """Yield the records of a document in order; `path` leads to it and begins all paths.

    Raises Misfit, with the path, for a document without records and for a record that cannot be read.
    """
    formula = request.operation.formula
    root: Any = document  # all paths begin there; what holds the document is no mapping of it
    for step in reversed(path):
        root = MappingProxyType({step: root})
    search = _search_under if request.rows.columns else _search
    found = list(search(document, path, request, reading)) if request.rows.poses else []
    is_bare = request.rows.poses and not request.operation.takes_points
    if not found and is_bare and type(document) is dict and NOTHING_BUT.issuperset(document):
        reading.here = path
        reading.note("neither position nor rotation: taken as the identity", rule="identity")
        found = [(path, "", "")]
    if not found and formula is not None and not formula.reads_row:
        found = [((*path, *each), "", "") for each in _mappings(document)]
    if not found:
        within(path, _refuse, document)
    if request.operation.of == "pair":
        raise Misfit("a record holds one pose; name A or B, or compare it with the one before by --consecutive", path)
    for each in found:
        yield _record(root, *each, request, reading)


def _search_under(document: Any, path: Path, request: Request, reading: Reading) -> Iterator[Holder]:
    """Search what is under the key `detections.pose`, which --columns names; a list stands for its items."""
    found = [(document, path)]
    for key in request.rows.columns[0].split("."):
        items = [(value_at(each, at), (*above, *at)) for each, above in found for at in _mappings(each)]
        found = [(each[key], (*above, key)) for each, above in items if key in each]
        if not found:
            keys = dict.fromkeys(each for item, _ in items for each in item)
            raise Misfit(f"no key {shown(key)} for --columns{alternatives(key, keys, 'keys')}", path)
    for each in found:
        yield from _search(*each, request, reading)


def _mappings(document: Any) -> list[Path]:
    """Return the paths of the mappings that a document is, or is a list of."""
    if type(document) is list:
        return [(index,) for index, item in enumerate(document) if type(item) is dict]
    return [()] if type(document) is dict else []


def _refuse(document: Any) -> None:
    """Stop at a document in which no record was found."""
    if type(document) is not dict:
        if type(document) is list and document:
            raise _bare_numbers(document)
        raise Misfit(f"expected a pose like {{xyz: [x, y, z], rpy_deg: [..]}}, found {kind(document)}")
    if "header" not in document:  # fields of another message are no misspelt keys
        _refuse_typos(document, {*POINT_KEYS, *ROTATION_KEYS}, cutoff=0.6)
    wanted = "a point like {point: [x, y, z]} or a pose like {xyz: [..], rpy_deg: [..]}"
    raise Misfit(f"expected {wanted}, found the keys {first_of(list(document), MOST_KEYS, quote=shown)}")


def _bare_numbers(value: list[Any]) -> Misfit:
    """Build the error for a list that may be anything."""
    spellings = {4: "{xyzw: [..]} or {wxyz: [..]}, or give --from"}
    write = spellings.get(len(value), "{rpy_deg: [..]}, {xyzw: [..]}, ..")
    return Misfit(f"a bare list of {len(value)} number{'s' * (len(value) != 1)} does not say what it is; write {write}")


def _search(value: Any, path: Path, request: Request, reading: Reading) -> Iterator[Holder]:
    """Yield what holds numbers; where frames change, a mapping that does not move whole is refused.

    A warning names the velocities that stay where a point or pose moves.
    """
    if type(value) is list:
        is_matrix = len(value) in (3, 4) and all(type(row) is list for row in value)
        if is_matrix or (value and not any(type(item) in (dict, list) for item in value)):
            yield path, "", ""
            return
        for index, item in enumerate(value):
            yield from _search(item, (*path, index), request, reading)
    elif type(value) is dict:
        operation = request.operation
        holds: dict[str, str] = {}  # which fields of a known message hold what, and which stay, by the fields it has
        stays: tuple[str, ...] = ()
        if "header" in value or "angular_velocity" in value:
            from frametool.ros.messages import HELD

            there = {key for key, each in value.items() if type(each) in (dict, list)}
            known = [row for row in HELD.values() if there.issuperset(row[0])]
            holds, stays = max(known, key=lambda row: len(there.intersection(row[1])), default=({}, ()))
        if operation.moves and any(holds.values()):
            found = [(path, field, kind) for field, kind in holds.items()]
        elif _holds_numbers(value):
            _refuse_several(value, ["the record's own keys"], path)
            found = [(path, "", "")]
        else:
            found = _search_inside(value, path, request, reading, stays)
        if not operation.keeps_frames and (operation.formula is None or operation.formula.reads_row):
            _refuse_half(value, found, path, stays if operation.moves else ())
        if found and operation.takes_points and (rates := [*filter(partial(re.fullmatch, readers.RATE_KEYS), value)]):
            rates = [key for key in rates if key not in holds]
            if rates and operation.turns:
                what = f"{first_of(rates, 3, quote=shown)} would keep to the old axes; a table turns vx, vy, vz along"
                raise Misfit(f"{what}; leave them out, or convert to CSV first", (*path, rates[0]), key=True)
            if rates:
                stay, reading.here = "stay as they are" if rates[1:] else "stays as it is", path
                reading.note(f"{first_of(rates, 9)} {stay}: points and poses move", rates[0], rule="stays")
        yield from found


def _search_inside(
    value: dict[str, Any], path: Path, request: Request, reading: Reading, stays: Sequence[str]
) -> list[Holder]:
    """Return what the known keys of a message hold."""
    inner = [key for key in INNER if type(value.get(key)) in (dict, list)]
    if request.operation.moves:
        inner += [key for key in LISTS if _is_geometry(key, value.get(key), doubtful=False)]
    held = {key: [*_search(value[key], (*path, key), request, reading)] for key in inner if key not in stays}
    if keys := [key for key, each in held.items() if each]:
        _refuse_several(value, keys, path)
    return [*chain.from_iterable(held.values())]


def _refuse_half(value: dict[str, Any], found: Sequence[Holder], path: Path, stays: Sequence[str]) -> None:
    """Stop where another field of what moves is expressed in the same frame, or may be, and would stay as it is."""
    header = value.get("header")
    is_message = type(header) is dict and "frame_id" in header
    if is_message and not found:
        fields = first_of([key for key in value if key != "header"] or ["header"], MOST_KEYS, quote=shown)
        raise Misfit(f"a message that cannot be moved whole: its fields are {fields}; see help records", path)
    used = {"header", *stays}.union(*(
        (*holder[len(path) :][:1], field, *covariance_keys(field)) for holder, field, _ in found
    ))  # fmt: skip
    if any(holder == path and not field for holder, field, _ in found):
        used |= USED
    rest = [key for key, each in value.items() if key not in used and _is_geometry(key, each, doubtful=is_message)]
    if found and rest:
        message = f"{first_of(rest, 2, quote=shown)} may be given in a frame that changes, and would stay"
        raise Misfit(f"{message}; leave out what does not move, see help records", (*path, rest[0]), key=True)


def _is_geometry(key: str, value: Any, *, doubtful: bool) -> bool:
    """Return True if a value may depend on a frame: it has x, y, z; if doubtful also x and y, or a list of numbers.

    The names in a list are those of joints, whose positions are no point.
    """
    if type(value) is dict:
        axes = {*XYZ[: 3 - doubtful]}
        return value.keys() >= axes or any(_is_geometry(at, each, doubtful=doubtful) for at, each in value.items())
    if type(value) is not list:
        return False
    some = value[:MOST_KEYS]
    numbers = sum(type(each) is str and each[:1] in NUMBER_BEGINS for each in some)
    is_it = (numbers > 1 and (doubtful or key.endswith("covariance"))) or (doubtful and key == "name")
    return is_it or any(_is_geometry(key, each, doubtful=doubtful) for each in some)


def _holds_numbers(value: dict[str, Any]) -> bool:
    """Return True if a mapping itself is a record rather than a message around one."""
    if _is_holder(value) or set(XYZ) <= set(value) or _parts_of(value) is not None:
        return True
    if any(type(value.get(key)) in (dict, list) for key in INNER):
        return False
    if any(map(readers.may_be_on_earth, value)):
        from frametool.stream.earth_columns import is_on_earth

        if is_on_earth(value):
            return True
    try:
        return _flat_pose(value, []) is not None
    except Misfit:
        return True  # half a rotation, or two: reading it says so


def _is_holder(value: dict[str, Any]) -> bool:
    return bool(_rotations(value)) or any(_holds_position(key, each) for key, each in value.items())


def _rotations(value: dict[str, Any]) -> list[str]:
    """Return the keys of a mapping that hold a rotation; the R of a CameraInfo rectifies pictures."""
    return [
        key for key, each in value.items()
        if is_rotation(key, each) and not (key == "R" and not {"K", "P"}.isdisjoint(value))
    ]  # fmt: skip


def _parts_of(value: dict[str, Any]) -> str | None:
    """Name the kind whose two vectors a mapping has, as a Twist or a Wrench has."""
    held = {key for key, each in value.items() if type(each) in (dict, list)}
    return next((name for name, parts in PARTS.items() if held.issuperset(parts)), None)


def _refuse_several(value: dict[str, Any], found: list[str], path: Path) -> None:
    """Stop where a mapping holds more than one pose: which is meant nobody can tell."""
    ours = {*POINT_KEYS, *ROTATION_KEYS, *found, "sigma", "twist"}
    more = [key for key, each in value.items() if type(each) is dict and key not in ours and _is_holder(each)]
    if len(found) + len(more) > 1:
        raise Misfit(f"expected one point or pose in a record, found several: {', '.join([*found, *more])}", path)


def _holds_position(key: str, value: Any) -> bool:
    return key in POINT_KEYS and is_position(key, value) and not (key == "point" and type(value) is str)


def covariance_keys(field: str) -> Sequence[str]:
    """Return the keys under which the covariance of a field of a message may be, or that of a record."""
    return (f"{field}_covariance",) if field else COVARIANCES


def _record(root: Any, path: Path, field: str, kind: str, request: Request, reading: Reading) -> Record:
    """Read the record at a path; of a message its field, which holds something of this kind."""
    value, formula = value_at(root, path), request.operation.formula
    reading.here = path
    try:
        if type(value) is list:
            return _bare_list(value, path, reading, request)
        if kind:
            record = _of_message(value, path, reading, request, field=field, kind=kind)
        elif request.rows.poses:
            record = _mapping(value, path, reading, request)
    except Misfit as misfit:
        raise misfit.below(*path) from None
    if not request.rows.poses:
        record = _only_asked(value, path, request)
    if formula is not None and record.shape.kind in PARTS:
        raise Misfit(f"an expression takes poses, points and vectors; this is a {record.shape.kind}", path)
    if formula is not None and not (formula.reads_row or record.values or _is_holder(value)):
        record = record._replace(shape=Shape("", None))
    # what says a covariance: the record, or the mapping around it where a message has it so
    around = (path, path[:-1]) if path[-1:] == (record.shape.kind,) else (path,)
    keys = {*covariance_keys(field), *COVARIANCE_KEYS}
    for each in () if record.keys.placed else around:
        holder = value_at(root, each)
        if type(holder) is dict and (not keys.isdisjoint(holder) or any(map(readers.may_be_uncertain, holder))):
            from frametool.stream.extra_numbers import with_covariances

            record = with_covariances(record, holder, each, covariance_keys(field), request, reading)
            break
    record = _with_asked(record, root, request)
    return _with_names(record, root, request) if request.rows.poses else record


def _only_asked(value: dict[str, Any], path: Path, request: Request) -> Record:
    """Return a record of which only what is asked for counts; what a result adds must not be there.

    A JointState gives way to the pose, and the frame in its header becomes that of the pose.
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
    """Return the path of the outermost value that holds a record alone: an item of a list, or the whole document."""
    return path[: max((at for at, step in enumerate(path, 1) if type(step) is int), default=0)]


def _with_asked(record: Record, root: Any, request: Request) -> Record:
    """Add the numbers under the keys that an expression asks for; stop where a key that it adds is there already."""
    operation, value, said = request.operation, value_at(root, record.path), request.operation.shown
    for name in operation.columns:
        found, number = None, nan
        if not said or value.get(name.partition(".")[0], "") is not None:  # else no pixel
            found = key_path(root, record.path, (name,), "a number")
            text = value_at(root, found)
            number = within(found, parse_number, text if type(text) is str else "")
        record = record._replace(numbers=(*record.numbers, found), values=(*record.values, number))
    if operation.only_adds:
        holder = value_at(root, outermost(record.path))
        for name in (*operation.extras(record.shape), *(said.members if said and not said.replaces else ())):
            if (key := request.results.prefix + name) in holder:
                raise Misfit(f"key {shown(key)} is there already; take another name, or --prefix", record.path)
    return record._replace(shape=record.shape._replace(extras=operation.columns)) if operation.columns else record


def _of_message(value: Any, path: Path, reading: Reading, request: Request, *, field: str, kind: str) -> Record:
    """Read a field of a message.

    An orientation with a covariance that begins with -1 is unknown: nothing of it is read, and it stays.
    """
    if request.rows.kind not in ("", kind):
        raise Misfit(f"{field} cannot be taken for a {request.rows.kind}")
    if kind == VECTOR:
        return _with_position(Record(path, Shape(kind), keys=RecordKeys(field)), value[field], 1.0, partial=False)
    if known := value.get(key := covariance_keys(field)[0]):
        from frametool.stream.extra_numbers import is_unknown

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
        raise _bare_numbers(value)
    return Record(path, Shape(_kind("", (), request)), *_three(value, path, 1.0))


def _mapping(value: dict[str, Any], path: Path, reading: Reading, request: Request) -> Record:
    """Read what a mapping says: its position, then its rotation; or the two vectors of a twist or a wrench."""
    if (name := _parts_of(value)) is not None and not _is_holder(value):
        return _two_vectors(value, ACCEL if path[-1:] == (ACCEL,) else name, path, request)
    positions = [key for key in value if _holds_position(key, value[key])]
    if any(map(readers.may_be_on_earth, value)):
        from frametool.stream.earth_columns import placed_record

        inner = partial(_pose_at_place, path=path, reading=reading, request=request)
        empty = Record(path, Shape("", None), parent=Name(EARTH_FRAMES[0]))
        if (found := placed_record(value, empty, positions, inner, reading, request)) is not None:
            return found
    rotations = _rotations(value)
    flat = _flat_pose(value, rotations)
    if flat and flat.position and flat.position.kind:
        if not request.operation.moves:
            raise Misfit(f"a {flat.position.kind} cannot be taken for a pose; apply moves it")
        return _with_flat(Record(path, Shape(flat.position.kind, None)), value, flat, reading, request)
    turned, there = rotations or (flat and flat.rotation), positions or (flat and flat.position)
    # the grammar of poses allows that several say the same thing twice
    if len(positions) > 1 and not (turned and POSITION_KEYS.keys() >= {*positions}):
        raise Misfit(f"expected one position, found {' and '.join(positions)}", (positions[1],), key=True)
    if positions and flat and flat.position and not flat.position.absent:
        shown_both = f"{positions[0]} and {flat.position.shown}"
        raise Misfit(f"expected one position, found {shown_both}", (flat.position.names[0],), key=True)
    _refuse_typos(value, {*([] if turned else ROTATION_KEYS), *([] if there else POSITION_KEYS)})
    key = positions[0] if positions else ""
    operation, rows, sigma = request.operation, request.rows, value.get("sigma")
    # what says how sure its rotation is, is a pose, if only by that
    is_sure = type(sigma) is dict and any(each[:3] in ("rpy", "rol", "pit", "yaw") for each in sigma)
    turns = turned or (not operation.moves and is_sure)
    # a PointStamped or Vector3Stamped stays one where it is written anew and nobody asked for a rotation
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
        read_pose({key: value[key] for key in value if key in keys}, reading)  # they have to say the same
    if (flag := value.get("inverse", "false")) not in ("true", "false"):
        raise Misfit(f"inverse must be true or false, found {kind(flag)}", ("inverse",))
    shape = record.shape._replace(inverse=flag == "true")
    record = record._replace(shape=shape, keys=record.keys._replace(others=(*rotations[1:], *positions[1:])))
    is_ecef = flat and flat.position and flat.position.prefix.lower().endswith("ecef_")
    place = request.rows.given_place or ("ecef" if is_ecef else "")
    return _given_on_earth(record, request.with_rows(given_place=place)) if place else record


def _given_on_earth(record: Record, request: Request) -> Record:
    """Return a record whose x, y, z are in ecef or the axes of an origin, as --from says."""
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
    """Read the pose that comes with a place on the Earth, and return the keys that say it but its covariance."""
    covariance = None
    if not COVARIANCE_KEYS.isdisjoint(rest):
        from frametool.grammar.covariance import read_covariance

        covariance = read_covariance(rest, reading)
    bare = {key: each for key, each in rest.items() if key not in COVARIANCE_KEYS}
    rotations = _rotations(bare)
    positions = [key for key in bare if _holds_position(key, bare[key])]
    if not (rotations or positions or _flat_pose(bare, rotations)):
        return Pose(covariance=covariance), []
    record = _mapping(bare, path, reading, request.with_rows(kind=POSE))
    keys = [*rotations, *positions, *record.keys.members, *record.keys.flat, *(["angles"] if "angles" in bare else ())]
    return pose_of(record, request)._replace(covariance=covariance), keys


def pose_of(record: Record, request: Request) -> Pose:
    """Return a record as a named pose; position or rotation is None where it has none."""
    shape, values = record.shape, record.values
    position = shape.position(values) if shape.whole or shape.unit is not None else None
    check = partial(checked_rotation, shape, normalize=request.rows.normalize)
    if request.operation.reads_scale(shape):
        from frametool.stream.extra_numbers import of_multiple

        whole = of_multiple(shape, values[: shape.own_size], lambda own: check(own)[0], floats)
        pose = Pose.of(whole[: 7 + (whole[7] != 1.0)], record.name.text, record.parent.text)
        return pose if position is not None else pose._replace(position=None)
    rotation = None
    if shape.notation is not None:
        x, y, z, w = shape.turned(values, check(values)[0])
        rotation = x, y, z, w
    covariance = values[shape.own_size :][:36] if 36 in shape.covariance else None
    scale = values[-1] if 1 in shape.covariance else 1.0
    pose = Pose(position, rotation, record.name.text, record.parent.text, None, covariance, scale)
    return inverted(pose) if shape.inverse else pose


def _two_vectors(value: dict[str, Any], name: str, path: Path, request: Request) -> Record:
    """Read a twist or a wrench."""
    if request.rows.kind not in ("", name) or not request.operation.moves:
        raise readers.NotARotation(f"a {name} cannot be taken for a {request.rows.kind or POSE}")
    halves = [within((part,), _three, value[part], (*path, part)) for part in PARTS[name]]
    paths, numbers = (first + second for first, second in zip(*halves, strict=True))
    return Record(path, Shape(name, None), paths, numbers)


def _refuse_typos(value: dict[str, Any], wanted: set[str], cutoff: float = 0.75) -> None:
    """Stop at a key that is nearly one of those that would say a rotation or a position."""
    if not wanted or KNOWN.issuperset(value):
        return
    wanted -= LISTED_WORDS
    # a number under a letter or two, as px and ry, is no misspelt list of them
    others = (key for key in value if key not in KNOWN and (key[2:] or type(value[key]) is not str))
    near = []
    for key in islice(others, MOST_COMPARED):
        word = OTHER_WORDS.get(key.lower(), "") if type(value[key]) in (list, dict) else ""
        hint = f"; did you mean {shown(word)}?" if word in wanted else did_you_mean(key, wanted, cutoff=cutoff)
        near += [(key, hint)] if hint else []
    if near:
        raise unknown_key([key for key, _ in near], near[0][1])


# what others call a rotation or a position; as a list or mapping it is no further field of a record
OTHER_WORDS = dict.fromkeys(("q", "quats", "quaternions", "orient", "so3"), "quaternion") | {
    "loc": "xyz", "location": "xyz", "xzy": "xyz",
    "rpi": "rpy", "ypr": "rpy", "eul": "rpy", "euler_angles": "rpy", "angle_axis": "axis_angle",
    "ypr_deg": "rpy_deg", "ypr_rad": "rpy_rad", "euler_xyz": "euler", "euler_zyx": "euler",
}  # fmt: skip


def _flat_pose(value: dict[str, Any], rotations: list[str]) -> PoseColumns | None:
    """Find a position and a rotation among the keys by the names that columns have: x y z, qx qy qz qw, yaw_deg, ..

    None where there is neither.  Raises Misfit for half a rotation, for two of them, and for a unit that is not known.
    """
    scalars = [key for key, each in value.items() if type(each) not in (dict, list)]
    others = NOTHING_BUT.difference(STALE) if "axis_x" in value else NOTHING_BUT
    names = [key for key in scalars if key not in others]  # that may be numbers of ours
    is_flat = not (rotations or any(key in POINT_KEYS for key in value))
    if not (names or (is_flat and len(scalars) >= 6)):
        return None
    from frametool.stream.header import Columns, Header, PoseColumns, find_six, has_pose_column, plain_pose

    six = find_six(Header(scalars), "") if is_flat and len(scalars) >= 6 else None
    if six is not None and not has_pose_column(name for name in scalars if name not in six.names):
        return PoseColumns(six, None)
    if not rotations and set(names) == set(QUATERNION) and len(names) == len(value):
        alone = Columns((0, 1, 2, 3), QUATERNION, notation=notation("quaternion"), said=(None,) * 4)
        return PoseColumns(None, alone)
    try:
        found = plain_pose(tuple(names), affixed=is_flat)
    except ValueInvalid as error:
        raise Misfit(str(error), key=True) from None
    if wrong := next((each.wrong for each in found if each is not None and each.wrong), ""):
        raise Misfit(wrong.replace("column ", "key ", 1), key=True)
    if found.rotation and rotations:
        shown = " and ".join([found.rotation.shown, *rotations])
        raise Misfit(f"expected one rotation, found {shown}", (found.rotation.names[0],), key=True)
    if found.position and not found.rotation and not rotations and "w" in value:
        message = "x, y, z beside w may be a quaternion or a point; write {quaternion: {..}} or {point: [..], w: ..}"
        raise Misfit(message, ("w",), key=True)
    return found if found.position or found.rotation else None


def _with_flat(
    record: Record, value: dict[str, Any], flat: PoseColumns, reading: Reading, request: Request
) -> Record:
    """Add the numbers that are members of the record itself: those of a position, unless it has one, and a rotation."""
    from frametool.stream.header import Columns, row_shape

    position, rotation = flat
    if record.keys.position:
        flat = flat._replace(position=Columns((), (), unit=record.shape.unit))
    elif position is not None:
        record = record._replace(
            shape=record.shape._replace(unit=position.unit, absent=position.absent),
            numbers=tuple((*record.path, name) for name in position.names),
            values=tuple(_number(value, name, None, metres=position.unit == 1.0) for name in position.names),
            keys=RecordKeys(members=position.names),
        )
    if rotation is None:
        return record
    names = rotation.names
    shape = row_shape(flat, request.with_rows(degrees=reading.degrees), POSE)
    paths, values = ((), ()) if shape.whole else (record.numbers, record.values)
    numbers = [_number(value, name, shape.in_degrees(at)) for at, name in enumerate(names, len(values))]
    if shape.notation is not None:
        numbers = as_meant(shape.notation, numbers, [value[name] for name in names], reading)
    every = (*values, *numbers)
    try:
        _, doubts = checked_rotation(shape, every, normalize=reading.normalize)
    except ValueInvalid as error:
        raise readers.NotARotation(str(error), (names[0],)) from None
    for rule, message in doubts:
        reading.note(message, names[0], rule=rule)
    angles = shape.rotation(every)
    largest = max(shape.bare_angles, key=lambda at: abs(angles[at]), default=None)
    if largest is not None and abs(angles[largest]) > TURN:
        name = names[shape.number_at(largest) - shape.position_size]
        reading.note(doubt(shape, angles[largest], KEYS_REMEDY), name, rule="degrees")
    keys = record.keys._replace(rotation=next(key for key in value if key in names), flat=names)
    paths = (*paths, *((*record.path, name) for name in names))
    return record._replace(shape=shape, numbers=paths, values=every, keys=keys)


def _number(
    value: dict[str, Any], key: str, degrees: bool | None, *, metres: bool = False  # noqa: FBT001 - None: no angle
) -> float:
    """Read a member that is a number, an angle, or a length."""
    if type(value[key]) is not str:
        raise Misfit(f"expected a number, found {kind(value[key])}", (key,))
    return float(within((key,), read_number_or_angle, value[key], degrees, metres=metres))


def _kind(key: str, rotations: object, request: Request) -> str:
    """Decide what a mapping is: with a rotation a pose, else a point or a vector, or what --as says."""
    if request.rows.kind in PARTS:
        raise Misfit(f"a {request.rows.kind} has {' and '.join(PARTS[request.rows.kind])}, two vectors {{x:, y:, z:}}")
    if rotations or request.rows.kind == POSE or not request.operation.takes_points:
        if rotations and request.rows.kind not in ("", POSE):
            raise Misfit(f"a record has a rotation and cannot be taken for a {request.rows.kind}")
        return POSE
    return request.rows.kind or (VECTOR if key == "vector" else POINT)


def _with_position(record: Record, value: Any, metre: float, *, partial: bool) -> Record:
    """Add the position: a list, or a map in which, if it may be partial, what is missing is 0."""
    key, parts = record.keys.position, round(1.0 / metre, 6)
    paths, numbers = within((key,), _three, value, (*record.path, key), parts, partial=partial)
    return record._replace(shape=record.shape._replace(unit=parts), numbers=paths, values=numbers)


def _three(
    value: Any, below: Path, parts: float = 0.0, *, partial: bool = False
) -> tuple[tuple[Path | None, ...], tuple[float, ...]]:
    """Read a list, or x, y and z, with the paths of the numbers; if it may be partial, what is missing is 0.

    parts: how many of a length's make a metre, 0 for what is no length
    """
    numbers = readers.read_numbers(value, XYZ, partial=partial, metres=parts == 1.0)
    if type(value) is list:
        return tuple((*below, *step) for step in readers.places_in(value)), numbers
    return tuple((*below, axis) if axis in value else None for axis in XYZ), numbers


def _with_rotation(
    value: Any, key: str, record: Record, below: Path, reading: Reading, request: Request
) -> Record:
    """Add the rotation's numbers; whether that of a multiple s R is one is seen where s is known."""
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
    # else the numbers say another unit than their key: the member is written anew
    shape = record.shape._replace(kind=POSE, notations=((notation, degrees),), whole=whole)
    keys, every = record.keys._replace(rotation=key), (*record.values, *values)
    return record._replace(shape=shape, numbers=record.numbers + paths, values=every, keys=keys)


def _with_names(record: Record, root: Any, request: Request) -> Record:
    """Add the frames that the record and the message around it name, and the stamp of its header."""
    parent, name, path = Name(), Name(), record.path
    on_earth = record.parent.text in EARTH_FRAMES
    for depth in range(len(path), -1, -1):
        value = value_at(root, around := path[:depth])
        if type(value) is not dict:
            continue
        if record.shape.kind == POSE and SCALE in value and (around == path or type(value[SCALE]) is str):
            from frametool.stream.extra_numbers import with_scale

            record = with_scale(record, value[SCALE], around, request)  # around it, of a Marker: its shape's
        parent_keys, name_keys = (EARTH_PARENTS, EARTH_NAMES) if on_earth else (PARENT_KEYS, NAME_KEYS)
        parent = _named(value, parent_keys, around, parent, request)
        if record.shape.kind == POSE or around == path:
            name = _named(value, name_keys, around, name, request)
        header = value.get("header")
        if type(header) is dict:
            inside = (*around, "header")
            if on_earth:  # the frame of a fix is that of its antenna
                name = name if name.text else Name(header.get("frame_id") or None)
            else:
                parent = _named(header, ("frame_id",), inside, parent, request)
            record = _with_stamp(record, header, (*inside, "stamp"))
    if on_earth:
        parent = parent._replace(text=parent.text or record.parent.text)
    return record._replace(parent=parent, name=name) if parent.paths or name.paths or on_earth else record


def _named(value: dict[str, Any], keys: Sequence[str], path: Path, found: Name, request: Request) -> Name:
    """Add the keys of a mapping that name a frame; raise Misfit where two of them name different ones."""
    for key in keys:
        text = value.get(key)
        if key not in value or type(text) in (dict, list) or (key == "frame" and text and request.counts(text)):
            continue
        if not text and key in ("name", "parent", "frame"):
            hint = f"leave {key} out or quote the name"
            raise Misfit(f"{key} must be a frame's name, found nothing; {hint}", (*path, key))
        if text and found.text and text != found.text:
            where = ".".join(map(str, found.paths[0][1:][-2:]))  # without the count of the document
            raise Misfit(f"{key} says {shown(text)} and {where} says {shown(found.text)}; keep one", (*path, key))
        found = Name(found.text or text or None, (*found.paths, (*path, key)))
    return found


def _with_stamp(record: Record, header: dict[str, Any], path: Path) -> Record:
    """Add the stamp of a header, and where its seconds and nanoseconds are; one further in said it better."""
    if "stamp" not in header:
        return record
    from frametool.ros.messages import read_stamp

    stamp_ns = within(path, read_stamp, header["stamp"])
    parts = (next(key for key in header["stamp"] if key.startswith(letter)) for letter in "sn")
    stamps = (*record.stamps, *((*path, part) for part in parts))
    return record._replace(stamps=stamps, stamp_ns=record.stamp_ns if record.stamps else stamp_ns)


def value_at(value: Any, path: Path) -> Any:
    """Follow a path of keys and indices down."""
    for step in path:
        value = value[step]
    return value


def key_path(documents: Any, holder: Path, names: Sequence[str] = STAMP_KEYS, wanted: str = "a time like 12.5") -> Path:
    """Find a scalar of a point or pose, by default its stamp: its own key, else that of a mapping around it.

    The name of a joint leads to its position in a JointState.  Raises Misfit.
    """
    from frametool.ros import messages

    around = [documents]
    for step in holder:
        around.append(around[-1][step])
    for name, depth in product(names, range(len(holder), 0, -1)):
        if (position := messages.position_of(name, around[depth])) is not None:
            return (*holder[:depth], *position)
        steps = name.split(".")
        for keys in ((name,), steps, [int(each) if each.isdecimal() else each for each in steps]):
            if (found := _below(around[depth], keys)) is None:
                continue
            if type(found[0]) not in (dict, list):
                return (*holder[:depth], *keys)
            if names is not STAMP_KEYS:
                raise Misfit(f"expected {wanted}, found {kind(found[0])}", (*holder[:depth], *keys))
    if names is STAMP_KEYS:
        usual = ", ".join(names)
        raise Misfit(f"no stamp: neither a header nor {usual}; name its key with --time-column", holder)
    known = [key for each in around[1:] if type(each) is dict for key in each]
    raise Misfit(f"no key {shown(names[0])}{did_you_mean(names[0], known)}", holder)


def _below(value: Any, keys: Sequence[str | int]) -> tuple[Any] | None:
    """Follow keys and indices down; None where one is not there."""
    for key in keys:
        is_index = type(value) is list and type(key) is int and key < len(value)
        if not (is_index or (type(value) is dict and key in value)):
            return None
        value = value[key]
    return (value,)
