"""Find the records in a document, and refuse documents that can only be moved in part."""

from __future__ import annotations

import re
from functools import cached_property, partial
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

from frametool.errors import MOST_COMPARED, NamedTuple, ValueInvalid, alternatives, did_you_mean, first_of, shown
from frametool.geometry.representations import notation
from frametool.grammar import readers
from frametool.grammar.pose import (
    LISTED_WORDS,
    POSE_KEYS,
    POSITION_KEYS,
    RELATIVE,
    ROTATION_KEYS,
    is_position,
    is_rotation,
    unknown_key,
)
from frametool.grammar.readers import NAME_KEYS, PARENT_KEYS, Misfit, Reading, kind, within
from frametool.rows.shapes import PARTS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.grammar.readers import Path
    from frametool.rows.columns import PoseColumns
    from frametool.rows.request import Request

POINT_KEYS = {"point": 1.0, "vector": 1.0, **POSITION_KEYS}  # metres per unit
INNER = ("transforms", "static_transforms", "poses", "pose", "transform", "twist", "wrench", "accel", "msg", "message",
         "detections")  # fmt: skip
LISTS = ("markers", "polygon", "points")  # keys of messages that hold nothing else
COVARIANCES = ("covariance", "position_covariance", "orientation_covariance")
# a mapping with no other keys may be the identity
NOTHING_BUT = frozenset((*POSE_KEYS, *PARENT_KEYS, *NAME_KEYS)).difference(LISTED_WORDS)
KNOWN = frozenset((*POSE_KEYS, *POINT_KEYS, *PARENT_KEYS, *NAME_KEYS))
XYZ = ("x", "y", "z")
QUATERNION = (*XYZ, "w")
MOST_KEYS = 8  # listed in an error
USED = KNOWN.difference(NAME_KEYS).union(ROTATION_KEYS, (readers.AXES_KEY, "sigma"), COVARIANCES, *PARTS.values())
NUMBER_BEGINS = frozenset("+-.0123456789n")  # n: of nan
# other names of a rotation or position; a list or mapping under them is not taken for an extra field
OTHER_WORDS = dict.fromkeys(("q", "quats", "quaternions", "orient", "so3"), "quaternion") | {
    "loc": "xyz", "location": "xyz", "xzy": "xyz",
    "rpi": "rpy", "ypr": "rpy", "eul": "rpy", "euler_angles": "rpy", "angle_axis": "axis_angle",
    "ypr_deg": "rpy_deg", "ypr_rad": "rpy_rad", "euler_xyz": "euler", "euler_zyx": "euler",
}  # fmt: skip


class Members:
    """The keys of a mapping that are a position or a rotation, classified once for search and reading.

    positions, rotations: the keys of each; say_pose: there are some
    parts: the kind if it holds a twist, wrench or acceleration, else ""; lists: the keys of lists and mappings
    """

    def __init__(self, value: dict[str, Any]) -> None:
        """Classify the keys."""
        self.value, self.lists = value, set[str]()
        self.positions, self.rotations, self.parts = list[str](), list[str](), ""
        for key, each in value.items():
            if type(each) in (dict, list):
                self.lists.add(key)
            if key in POINT_KEYS and is_position(key, each) and not (key == "point" and type(each) is str):
                self.positions.append(key)
            # the R of a CameraInfo rectifies images
            if is_rotation(key, each) and not (key == "R" and ("K" in value or "P" in value)):
                self.rotations.append(key)
        self.say_pose = bool(self.positions or self.rotations)
        for word, parts in () if self.say_pose else PARTS.items():
            if not self.parts and self.lists.issuperset(parts):
                self.parts = word

    @cached_property
    def on_earth(self) -> bool:
        """Return True if it has a geodetic position, complete or not."""
        if POSE_KEYS.issuperset(self.value) or not any(map(readers.may_be_on_earth, self.value)):
            return False
        from frametool.rows.columns_earth import is_on_earth

        return is_on_earth(self.value)

    @cached_property
    def flat(self) -> PoseColumns | None:
        """Return the position and rotation of keys named like columns: x y z, qx qy qz qw, yaw_deg, ..

        None for neither.  Raises Misfit for an incomplete rotation, for two, and for an unknown unit.
        """
        value, rotations = self.value, self.rotations
        scalars = [key for key in value if key not in self.lists]
        others = NOTHING_BUT.difference(RELATIVE) if "axis_x" in value else NOTHING_BUT
        names = [key for key in scalars if key not in others]  # possible numbers of a pose
        is_flat = not self.say_pose
        if not (names or (is_flat and len(scalars) >= 6)):
            return None
        from frametool.rows.columns import Columns, Header, PoseColumns, find_six, has_pose_column, plain_pose

        six = find_six(Header(scalars), "") if is_flat and len(scalars) >= 6 else None
        if six is not None and not has_pose_column(name for name in scalars if name not in six.names):
            return PoseColumns(six, None)
        if not rotations and set(names) == set(QUATERNION) and len(names) == len(value):
            alone = Columns((0, 1, 2, 3), QUATERNION, notation=notation("quaternion"), said=(None,) * 4)
            return PoseColumns(None, alone)
        try:
            found = plain_pose(tuple(names), affixed=is_flat)
        except ValueInvalid as error:
            reason = str(error).partition(", or add --")[0].removesuffix("; choose with --columns")
            reason = reason.replace("choose with --columns", "leave it out").replace("columns", "keys")
            raise Misfit(reason, key=True) from None
        if wrong := (found.position and found.position.wrong) or (found.rotation and found.rotation.wrong):
            raise Misfit(wrong.replace("column ", "key ", 1), key=True)
        if found.rotation and rotations:
            several = " and ".join([found.rotation.shown, *rotations])
            raise Misfit(f"expected one rotation, found {several}", (found.rotation.names[0],), key=True)
        if found.position and not found.rotation and not rotations and "w" in value:
            remedy = "write {quaternion: {..}} or {point: [..], w: ..}"
            raise Misfit(f"x, y, z beside w may be a quaternion or a point; {remedy}", ("w",), key=True)
        return found if found.position or found.rotation else None

    def refuse_typos(self, wanted: set[str], cutoff: float = 0.75) -> None:
        """Raise Misfit for a misspelt key of a rotation or position."""
        if not wanted or KNOWN.issuperset(self.value):
            return
        wanted -= LISTED_WORDS
        # a number under one or two letters, such as px or ry, is no misspelt list
        near = []
        for key in islice(self.value, MOST_COMPARED):
            if key in KNOWN or not (key[2:] or type(self.value[key]) is not str):
                continue
            word = OTHER_WORDS.get(key.lower(), "") if key in self.lists else ""
            hint = f"; did you mean {shown(word)}?" if word in wanted else did_you_mean(key, wanted, cutoff=cutoff)
            near += [(key, hint)] if hint else []
        if near:
            raise unknown_key([key for key, _ in near], near[0][1])


class Holder(NamedTuple):
    """The mapping or list that holds the numbers of a record; in a message also the field and its kind."""

    path: Path
    field: str = ""
    kind: str = ""
    members: Members | None = None


def find_holders(document: Any, path: Path, request: Request, reading: Reading) -> list[Holder]:
    """Return the holders of the records of a document, or its mappings if records need no poses.

    Raises Misfit, with the path, if there are none.
    """
    formula = request.operation.formula
    found: list[Holder] = []
    if request.rows.poses:
        for value, at in (
            _under(document, path, request.rows.columns[0]) if request.rows.columns else [(document, path)]
        ):
            found += _search(value, at, request, reading)
    is_bare = request.rows.poses and not request.operation.takes_points
    if not found and is_bare and type(document) is dict and NOTHING_BUT.issuperset(document):
        reading.here = path
        reading.note("neither position nor rotation: taken as the identity", rule="identity")
        found = [Holder(path)]
    if not found and formula is not None and not formula.reads_row:
        found = [Holder((*path, *each)) for each in _mappings(document)]
    if not found:
        within(path, _refuse, document)
    if request.operation.of == "pair":
        raise Misfit("a record holds one pose; name A or B, or compare it with the one before by --consecutive", path)
    return found


def _under(document: Any, path: Path, spec: str) -> list[tuple[Any, Path]]:
    """Return the values under a key such as `detections.pose` of --columns, for each item of a list."""
    found = [(document, path)]
    for key in spec.split("."):
        items = [(value_at(each, at), (*above, *at)) for each, above in found for at in _mappings(each)]
        found = [(each[key], (*above, key)) for each, above in items if key in each]
        if not found:
            keys = dict.fromkeys(each for item, _ in items for each in item)
            raise Misfit(f"no key {shown(key)} for --columns{alternatives(key, keys, 'keys')}", path)
    return found


def _mappings(document: Any) -> list[Path]:
    """Return the paths of the mappings of a document: itself, or the items of its list."""
    if type(document) is list:
        return [(index,) for index, item in enumerate(document) if type(item) is dict]
    return [()] if type(document) is dict else []


def _refuse(document: Any) -> None:
    """Raise Misfit for a document in which no record was found."""
    if type(document) is not dict:
        if type(document) is list and document:
            raise bare_numbers(document)
        raise Misfit(f"expected a pose like {{xyz: [x, y, z], rpy_deg: [..]}}, found {kind(document)}")
    if "header" not in document:  # fields of another message are no misspelt keys
        Members(document).refuse_typos({*POINT_KEYS, *ROTATION_KEYS}, cutoff=0.6)
    wanted = "a point like {point: [x, y, z]} or a pose like {xyz: [..], rpy_deg: [..]}"
    raise Misfit(f"expected {wanted}, found the keys {first_of(list(document), MOST_KEYS, quote=shown)}")


def _search(value: Any, path: Path, request: Request, reading: Reading) -> list[Holder]:
    """Return the holders below a value; if frames change, refuse a mapping that would be moved only in part.

    Warns about velocities that are not moved with a point or pose.
    """
    if type(value) is list:
        is_matrix = len(value) in (3, 4) and all(type(row) is list for row in value)
        if is_matrix or (value and not any(type(item) in (dict, list) for item in value)):
            return [Holder(path)]
        items = enumerate(value)
        return [each for index, item in items for each in _search(item, (*path, index), request, reading)]
    if type(value) is not dict:
        return []
    operation, members = request.operation, Members(value)
    holds: dict[str, str] = {}  # the fields of a known message and their kinds; `stays`: its unchanged fields
    stays: tuple[str, ...] = ()
    if "header" in value or "angular_velocity" in value:
        from frametool.ros.messages import HELD

        known = [row for row in HELD.values() if members.lists.issuperset(row[0])]
        holds, stays = max(known, key=lambda row: len(members.lists.intersection(row[1])), default=({}, ()))
    if operation.moves and any(holds.values()):
        found = [Holder(path, field, kind) for field, kind in holds.items()]
    elif _holds_numbers(members):
        _refuse_several(members, ["the record's own keys"], path)
        found = [Holder(path, members=members)]
    else:  # the known keys of a message
        inner = [key for key in INNER if key in members.lists]
        inner += [key for key in LISTS if operation.moves and _is_geometry(key, value.get(key), doubtful=False)]
        held = {key: _search(value[key], (*path, key), request, reading) for key in inner if key not in stays}
        if keys := [key for key, each in held.items() if each]:
            _refuse_several(members, keys, path)
        found = [*chain.from_iterable(held.values())]
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
    return found


def _holds_numbers(members: Members) -> bool:
    """Return True if a mapping is a record, not a message around one."""
    if members.say_pose or members.parts or members.value.keys() >= {*XYZ}:
        return True
    try:
        return members.lists.isdisjoint(INNER) and (members.on_earth or members.flat is not None)
    except Misfit:
        return True  # an incomplete rotation, or two: reading it raises the error


def _refuse_several(members: Members, found: list[str], path: Path) -> None:
    """Raise Misfit for a mapping with more than one pose, which is ambiguous."""
    ours = {*POINT_KEYS, *ROTATION_KEYS, *found, "sigma", "twist"}
    value = members.value
    more = [key for key in value if type(value[key]) is dict and key not in ours and Members(value[key]).say_pose]
    if len(found) + len(more) > 1:
        raise Misfit(f"expected one point or pose in a record, found several: {', '.join([*found, *more])}", path)


def _refuse_half(value: dict[str, Any], found: Sequence[Holder], path: Path, stays: Sequence[str]) -> None:
    """Raise Misfit if another field of a mapping that moves is, or may be, expressed in the same frame."""
    header = value.get("header")
    is_message = type(header) is dict and "frame_id" in header
    if is_message and not found:
        fields = first_of([key for key in value if key != "header"] or ["header"], MOST_KEYS, quote=shown)
        raise Misfit(f"a message that cannot be moved whole: its fields are {fields}; see help records", path)
    used: set[str | int] = {"header", *stays}
    for each in found:
        used |= {*each.path[len(path) :][:1], each.field, *covariance_keys(each.field)}
        used |= USED if each.path == path and not each.field else set()
    rest = [key for key, each in value.items() if key not in used and _is_geometry(key, each, doubtful=is_message)]
    if found and rest:
        message = f"{first_of(rest, 2, quote=shown)} may be given in a frame that changes, and would stay"
        raise Misfit(f"{message}; leave out what does not move, see help records", (*path, rest[0]), key=True)


def _is_geometry(key: str, value: Any, *, doubtful: bool) -> bool:
    """Return True if a value may depend on a frame: it has x, y, z; if doubtful also x and y, or a list of numbers.

    If doubtful, so is a list under `name`: the positions may be those of joints.
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


def bare_numbers(value: list[Any]) -> Misfit:
    """Return the error for a list of numbers without a notation."""
    spellings = {4: "{xyzw: [..]} or {wxyz: [..]}, or give --from"}
    write = spellings.get(len(value), "{rpy_deg: [..]}, {xyzw: [..]}, ..")
    return Misfit(f"a bare list of {len(value)} number{'s' * (len(value) != 1)} does not say what it is; write {write}")


def covariance_keys(field: str) -> Sequence[str]:
    """Return the keys of the covariance of a field of a message, or of a record."""
    return (f"{field}_covariance",) if field else COVARIANCES


def outdated(members: Mapping[str, Any]) -> set[str]:
    """Return the keys that describe a pose before it changed; a distance or an angle alone is other data."""
    return {"gimbal_lock", *(RELATIVE if members.keys() >= {*RELATIVE} else ())}


def value_at(value: Any, path: Path) -> Any:
    """Return the value at a path of keys and indices."""
    for step in path:
        value = value[step]
    return value
