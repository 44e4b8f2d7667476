"""Records that are placed on the Earth: points of latitude and longitude unchanged, anything else read as a pose.

    {"id": 7, "lat": 48.1, "lon": 11.5, "alt": 520}                     its numbers stay where they are, and are fast
    {"utm": {..}}  {"at": {..}, "axes": "enu", ..}  {"lat": .., "heading_deg": 30, "axes": "ned"}     written anew
    {"header": {"frame_id": "gps"}, "latitude": .., "position_covariance": [..]}                      a NavSatFix

Loaded where a mapping has such keys.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid
from frametool.geometry import uncertainty
from frametool.geometry.place import ENU, LLA, UNSAID, Place
from frametool.geometry.representations import notation
from frametool.grammar.covariance import check, entries_of
from frametool.grammar.names import EARTH_FRAMES, FIX, FLAT_KEYS
from frametool.grammar.place import AT, EARTH_KEYS, SAME, check_parent, placed_by, without_place
from frametool.grammar.pose import COVARIANCE_KEYS, LEFT_OUT, Pose
from frametool.grammar.readers import Misfit, NotARotation, Reading, within
from frametool.grammar.rotation_spelling import AXES_KEY
from frametool.stream.row_layout import POINT, POSE, VECTOR, Shape
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.stream.request import Request

    Inner = Callable[[dict[str, Any]], tuple[Pose, Sequence[str]]]

FIX_TYPE, NO_FIX = "position_covariance_type", "-1"
STAYS = ("{} stay data: x, y, z are the position; to read the place, leave these out")
WHOLE = ("lat", "latitude", "lat_rad", AT, "ecef", "utm", "easting", *FLAT_KEYS)


def is_on_earth(value: dict[str, Any]) -> bool:
    """Return True if a mapping says a position on the Earth, whole or by half."""
    return not {*WHOLE, "mgrs", LLA}.isdisjoint(value) and not EARTH_KEYS.isdisjoint(value)


class Placed(NamedTuple):
    """What a record on the Earth says.

    keys: those that say it; is_numbered: they are the numbers, one each
    """

    shape: Shape
    values: tuple[float, ...]
    keys: tuple[str, ...]
    is_numbered: bool = False


def placed_record(
    value: dict[str, Any], positions: Sequence[str], inner: Inner, reading: Reading, request: Request
) -> Placed | None:
    """Read a record that is placed on the Earth; None for one that is expressed as x, y, z.

    inner: reads the pose that comes with a place, and names its keys
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
    if request.gathered is not None:
        request.gathered.frame = EARTH_FRAMES[0]
    check_parent(value, value)
    pose, used = inner(without_place(value))
    plain = _plain_point(value, request) if not used else ()
    return _numbered(value, plain, request) if plain else _read(value, pose, used, reading, request)


def _plain_point(value: dict[str, Any], request: Request) -> tuple[str, ...]:
    """Return the keys of latitude, longitude and height where they are numbers and nothing else says a place."""
    own = [key for key in value if key in EARTH_KEYS]
    fields = [SAME.get(key, "") for key in own]
    usual = {"lat", "lon", "alt"} == {*fields} and len(own) == 3
    others = "header" in value or not COVARIANCE_KEYS.isdisjoint(value) or AXES_KEY in value
    if not usual or not _takes_points(request) or others:
        return ()
    try:
        for key in own:
            parse_number(value[key])
    except (ValueInvalid, TypeError):
        return ()
    return tuple(sorted(own, key=lambda key: ("lat", "lon", "alt").index(SAME[key])))


def _numbered(value: dict[str, Any], keys: tuple[str, ...], request: Request) -> Placed:
    """Return a point whose numbers are members of the record."""
    place = Place(LLA, ("lat", "lon", "alt"), request.earth.axes if request.earth else "")
    numbers = tuple(parse_number(value[key]) for key in keys)
    within((keys[0],), place.check, numbers)
    return Placed(Shape(POINT, place), numbers, keys, is_numbered=True)


def _read(value: dict[str, Any], inner: Pose, used: Sequence[str], reading: Reading, request: Request) -> Placed:
    """Read a pose or point by the grammar of places; none of its numbers stays where it is."""
    own = [key for key in value if key in EARTH_KEYS]
    mapping = {key: value[key] for key in (*own, AXES_KEY, "parent", "frame", "inverse") if key in value}
    is_fix = "header" in value
    covariance = _of_fix(value, mapping, reading, request) if is_fix else ()
    pose = placed_by(mapping, inner, reading)
    operation = request.operation
    if pose.rotation is None and (operation.inverse or operation.similar) and request.gathered is None:
        raise Misfit(UNSAID)  # as a factor it is a pose
    is_point = pose.rotation is None and request.kind != POSE and _takes_points(request)
    numbers: tuple[float, ...] = pose.components[: 7 if pose.rotation is not None else 3]
    shape = Shape(POINT if is_point else POSE, 1.0, None if pose.rotation is None else notation("quaternion"))
    extra = covariance or _extra(pose, reading, request, is_point=is_point)
    if extra:
        shape = shape._replace(covariance=(len(extra),), rewritten=True)
    if pose.read and is_point and operation.keeps_frames and not extra:
        shape, numbers = Shape(POINT, pose.read.place), tuple(pose.read.numbers)
    keys = [*own, *used, *(key for key in (AXES_KEY, *COVARIANCE_KEYS) if key in value)]
    keys += ["header", *[FIX, FIX_TYPE] * bool(covariance)] if is_fix else []
    return Placed(shape, (*numbers, *extra), tuple(keys))


def _extra(pose: Pose, reading: Reading, request: Request, *, is_point: bool) -> tuple[float, ...]:
    """Return the covariance of a pose or point in ECEF where it counts; where it does not, that is noted."""
    if pose.covariance is None:
        return ()
    if request.gathered is not None or request.operation.formula is not None or request.place is not None:
        reading.note(LEFT_OUT.format("a result at a place" if request.place else "this"), rule="left-out")
        return ()
    entries = tuple(pose.covariance)
    return tuple(entries[6 * i + j] for i in range(3) for j in range(3)) if is_point else entries


def _takes_points(request: Request) -> bool:
    operation = request.operation
    return (operation.takes_points or operation.keeps_frames) and request.gathered is None


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
    at = placed_by(mapping | {AXES_KEY: ENU}, level, Reading(reading.source))
    return tuple(uncertainty.rotate_covariance(tuple(entries), *at.components[3:]))
