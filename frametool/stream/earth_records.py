"""Records that are placed on the Earth: points of latitude and longitude as they stand, anything else read as a pose.

    {"id": 7, "lat": 48.1, "lon": 11.5, "alt": 520}                     its numbers stay where they are, and are fast
    {"utm": {..}}  {"at": {..}, "axes": "enu", ..}  {"lat": .., "heading_deg": 30, "axes": "ned"}     written anew
    {"header": {"frame_id": "gps"}, "latitude": .., "position_covariance": [..]}                      a NavSatFix

Loaded where a mapping has such keys.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.geometry import uncertainty
from frametool.geometry.place import ENU, LLA, Earth
from frametool.geometry.representations import notation
from frametool.grammar.covariance import check, entries_of
from frametool.grammar.names import EARTH_FRAMES
from frametool.grammar.place import AT, EARTH_KEYS, SAME, read_placed
from frametool.grammar.pose import COVARIANCE_KEYS, LEFT_OUT, Pose
from frametool.grammar.readers import Misfit, NotARotation, Reading, within
from frametool.grammar.rotation_spelling import AXES_KEY
from frametool.stream import earth_columns
from frametool.stream.row_layout import POINT, POSE, VECTOR, Shape
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.grammar.readers import Path
    from frametool.stream.record import Record
    from frametool.stream.request import Request

QUATERNION = notation("quaternion")
FIX = "position_covariance"  # of a NavSatFix: of its place, along east, north, up there
FIX_TYPE, NO_FIX = "position_covariance_type", "-1"
STAYS = ("{} stay data: x, y, z are the position; to read the place, leave these out")
WHOLE = ("lat", "latitude", "lat_rad", AT, "ecef", "utm", "easting", "east", "north")


def is_on_earth(value: dict[str, Any]) -> bool:
    """Tell whether a mapping says a position on the Earth, whole or by half."""
    return not {*WHOLE, "mgrs"}.isdisjoint(value) and not EARTH_KEYS.isdisjoint(value)


def record_on_earth(
    value: dict[str, Any], path: Path, positions: Sequence[str], reading: Reading, request: Request
) -> Record | None:
    """Read a record that is placed on the Earth; None for one that is given by x, y, z.

    Raises Misfit for half a place, for a pose whose axes nobody says, and for what is no place.
    """
    if not is_on_earth(value):
        return None
    in_ecef = value.get("frame", value.get("parent")) in EARTH_FRAMES
    if AT not in value and ((positions and not in_ecef) or {"x", "y", "z"} <= value.keys()):
        said = [key for key in value if key in EARTH_KEYS]
        if request.poses and not request.operation.keeps_frames:
            reading.note(STAYS.format(", ".join(said)), said[0], rule="stays")
        return None
    if request.kind == VECTOR:
        raise Misfit("a vector has no place on the Earth; leave --as vector out")
    plain = _plain_point(value, request)
    return _numbered(value, path, plain, request) if plain else _read(value, path, positions, reading, request)


def _plain_point(value: dict[str, Any], request: Request) -> tuple[str, ...]:
    """Return the keys of latitude, longitude and height where they are numbers and nothing else says a place."""
    own = [key for key in value if key in EARTH_KEYS]
    fields = [SAME.get(key, "") for key in own]
    usual = {"lat", "lon", "alt"} == {*fields} and len(own) == 3
    if not usual or not _takes_points(request):
        return ()
    if "header" in value or not COVARIANCE_KEYS.isdisjoint(value) or _turns(value, request):
        return ()
    try:
        for key in own:
            parse_number(value[key])
    except (ValueInvalid, TypeError):
        return ()
    return tuple(sorted(own, key=lambda key: ("lat", "lon", "alt").index(SAME[key])))


def _turns(value: dict[str, Any], request: Request) -> bool:
    """Tell whether there is a rotation beside a place."""
    from frametool.stream.record import _flat_pose, _is_rotation

    rest = {key: each for key, each in value.items() if key not in EARTH_KEYS and key != AXES_KEY}
    flat = _flat_pose(rest, []) if not any(_is_rotation(key, each) for key, each in rest.items()) else None
    return request.kind == POSE or flat is not None or any(_is_rotation(key, each) for key, each in rest.items())


def _numbered(value: dict[str, Any], path: Path, keys: tuple[str, ...], request: Request) -> Record:
    """Return a point whose numbers are members of the record."""
    from frametool.stream.record import Name, Record

    place = earth_columns.chosen((0, 1, 2), keys, LLA, request.earth or Earth()).unit
    numbers = tuple(parse_number(value[key]) for key in keys)
    try:
        place.check(numbers)  # type: ignore[union-attr]
    except ValueInvalid as error:
        raise Misfit(str(error), (keys[0],)) from None
    return Record(path, Shape(POINT, place), tuple((*path, key) for key in keys), numbers, members=keys,
                  parent=Name("ecef"))  # fmt: skip


def _read(
    value: dict[str, Any], path: Path, positions: Sequence[str], reading: Reading, request: Request
) -> Record:
    """Read a pose or point by the grammar of places; none of its numbers stays where it is."""
    from frametool.stream.record import Name, Record

    own = [key for key in value if key in EARTH_KEYS]
    rest = {key: each for key, each in value.items() if key not in own and key != AXES_KEY}
    inner, used = _inner(rest, positions, path, reading, request)
    mapping = {key: value[key] for key in (*own, AXES_KEY, "parent", "frame") if key in value}
    is_fix = "header" in value
    covariance = _of_fix(value, mapping, reading, request) if is_fix else None
    pose = read_placed(mapping, reading, ("frame",), inner)
    is_point = pose.rotation is None and request.kind != POSE and _takes_points(request)
    numbers: tuple[float, ...] = pose.components[: 7 if pose.rotation is not None else 3]
    shape = Shape(POINT if is_point else POSE, 1.0, None if pose.rotation is None else QUATERNION)
    beside = covariance or _beside(pose, reading, request, is_point=is_point)
    if beside:
        shape = shape._replace(covariance=(len(beside),), rewritten=True)
    used = [*own, *used, *(key for key in (AXES_KEY, *COVARIANCE_KEYS) if key in value)]
    used += ["header", *[FIX, FIX_TYPE] * bool(covariance)] if is_fix else []
    return Record(
        path, shape, (None,) * (len(numbers) + len(beside)), (*numbers, *beside), members=tuple(used[:1]),
        others=tuple(used[1:]), parent=Name("ecef"), placed=tuple(used),
    )  # fmt: skip


def _beside(pose: Pose, reading: Reading, request: Request, *, is_point: bool) -> tuple[float, ...]:
    """Return the covariance of a pose or point in ECEF where it counts; where it does not, that is noted."""
    if pose.covariance is None:
        return ()
    if request.gathered is not None or request.operation.formula is not None or request.place is not None:
        reading.note(LEFT_OUT.format("a result at a place" if request.place else "this"), rule="left-out")
        return ()
    entries = tuple(pose.covariance)
    return tuple(entries[6 * i + j] for i in range(3) for j in range(3)) if is_point else entries


def _takes_points(request: Request) -> bool:
    return request.operation.takes_points or request.operation.keeps_frames


def _inner(
    rest: dict[str, Any], positions: Sequence[str], path: Path, reading: Reading, request: Request
) -> tuple[Pose, list[str]]:
    """Read the rotation, the shift and the covariance beside a place, and return the keys that say the first two."""
    from frametool.stream.record import _flat_pose, _is_rotation, _mapping
    from frametool.stream.record_values import pose_of

    covariance = None
    if not COVARIANCE_KEYS.isdisjoint(rest):
        from frametool.grammar.covariance import read_covariance

        covariance = read_covariance(rest, reading)
    bare = {key: each for key, each in rest.items() if key not in COVARIANCE_KEYS}
    rotations = [key for key, each in bare.items() if _is_rotation(key, each)]
    if not (rotations or positions or _flat_pose(bare, rotations)):
        return Pose(covariance=covariance), []
    asked = request._replace(kind=POSE, gathered=None)
    record = _mapping(bare, path, reading, asked)
    pose = pose_of(record, asked)
    keys = [*rotations, *positions, *record.members, *record.flat, *(key for key in ("angles",) if key in bare)]
    return Pose(pose.position, pose.rotation, None, None, None, covariance), keys


def _of_fix(value: dict[str, Any], mapping: dict[str, Any], reading: Reading, request: Request) -> tuple[float, ...]:
    """Return the covariance of a NavSatFix, east, north, up there, in ECEF; () where it has none, or where it stays.

    Raises Misfit for a fix that was none.
    """
    status = value.get("status")
    if type(status) is dict and status.get("status") == NO_FIX:
        raise NotARotation("status -1: there was no fix", ("status", "status"))
    if FIX not in value or value.get(FIX_TYPE, "1") == "0" or request.place is not None or request.gathered is not None:
        return ()
    entries = [number for _, number in within((FIX,), entries_of, value[FIX], (9,))]
    within((FIX,), check, entries)
    level = Pose(rotation=(0.0, 0.0, 0.0, 1.0))
    at = read_placed(mapping | {AXES_KEY: ENU}, Reading(reading.source), ("frame",), level)
    return tuple(uncertainty.turned(tuple(entries), *at.components[3:]))
