"""Records that are placed on the Earth: points of latitude and longitude unchanged, anything else read as a pose.

    {"id": 7, "lat": 48.1, "lon": 11.5, "alt": 520}                     its numbers stay where they are, and are fast
    {"utm": {..}}  {"at": {..}, "axes": "enu", ..}  {"lat": .., "heading_deg": 30, "axes": "ned"}     written anew
    {"header": {"frame_id": "gps"}, "latitude": .., "position_covariance": [..]}                      a NavSatFix

Loaded where a mapping has such keys.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.json import JSON_NUMBER
from frametool.geometry import uncertainty
from frametool.geometry.place import ENU, LLA, UNSAID
from frametool.geometry.representations import notation
from frametool.grammar.covariance import check, entries_of
from frametool.grammar.names import EARTH_FRAMES, FIX, FLAT_KEYS
from frametool.grammar.place import AT, EARTH_KEYS, SAME, check_parent, placed_by, without_place
from frametool.grammar.pose import COVARIANCE_KEYS, LEFT_OUT, Pose
from frametool.grammar.readers import Misfit, NotARotation, Reading, within
from frametool.grammar.rotation_spelling import AXES_KEY
from frametool.stream.record import Name, Record
from frametool.stream.row_layout import POINT, POSE, VECTOR, Shape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.grammar.readers import Path
    from frametool.stream.request import Request

    Inner = Callable[[dict[str, Any]], tuple[Pose, Sequence[str]]]

FIX_TYPE, NO_FIX = "position_covariance_type", "-1"
STAYS = ("{} stay data: x, y, z are the position; to read the place, leave these out")
WHOLE = ("lat", "latitude", "lat_rad", AT, "ecef", "utm", "easting", *FLAT_KEYS)


def is_on_earth(value: dict[str, Any]) -> bool:
    """Return True if a mapping says a position on the Earth, whole or by half."""
    return not {*WHOLE, "mgrs", LLA}.isdisjoint(value) and not EARTH_KEYS.isdisjoint(value)


def placed_record(
    value: dict[str, Any], path: Path, positions: Sequence[str], inner: Inner, reading: Reading, request: Request
) -> Record | None:
    """Read a record at a path that is placed on the Earth; None for one that is expressed as x, y, z.

    inner: reads the pose that comes with a place, and names its keys
    The numbers of latitude, longitude and height stay members of the record; no other has a place of its own.
    Raises Misfit for half a place, for a pose whose axes nobody says, and for what is no place.
    """
    if not is_on_earth(value):
        return None
    own = [key for key in value if key in EARTH_KEYS]
    in_ecef = value.get("frame", value.get("parent")) in EARTH_FRAMES
    if AT not in value and ((positions and not in_ecef) or {"x", "y", "z"} <= value.keys()):
        if request.poses and not request.operation.keeps_frames:
            reading.note(STAYS.format(", ".join(own)), own[0], rule="stays")
        return None
    if request.kind == VECTOR:
        raise Misfit("a vector has no place on the Earth; leave --as vector out")
    operation, gathered = request.operation, request.gathered
    if gathered is not None:
        gathered.frame = EARTH_FRAMES[0]
    check_parent(value, value)
    there, used = inner(without_place(value))
    mapping = {key: value[key] for key in (*own, AXES_KEY, "parent", "frame", "inverse") if key in value}
    covariance = _of_fix(value, mapping, reading, request) if "header" in value else ()
    pose = placed_by(mapping, there, reading)
    if pose.rotation is None and (operation.inverse or operation.similar) and gathered is None:
        raise Misfit(UNSAID)  # as a factor it is a pose
    takes_points = (operation.takes_points or operation.keeps_frames) and gathered is None
    is_point = pose.rotation is None and request.kind != POSE and takes_points
    numbers: tuple[float, ...] = pose.components[: 7 if pose.rotation is not None else 3]
    shape = Shape(POINT if is_point else POSE, 1.0, None if pose.rotation is None else notation("quaternion"))
    extra = covariance or _extra(pose, reading, request, is_point=is_point)
    if extra:
        shape = shape._replace(covariance=(len(extra),), rewritten=True)
    keys = [*own, *used, *(key for key in (AXES_KEY, *COVARIANCE_KEYS) if key in value)]
    keys += ["header", *[FIX, FIX_TYPE] * bool(covariance)] if "header" in value else []
    stays = False
    if pose.read and is_point and not extra:
        place, named = pose.read.place, {SAME.get(key): key for key in keys}
        stays = len(keys) == len(named) and named.keys() == {"lat", "lon", "alt"} and _are_numbers(value, keys)
        if stays or operation.keeps_frames:
            shape, numbers = Shape(POINT, place), tuple(pose.read.numbers)
        keys = [named[field] for field in place.fields] if stays else keys
    record = Record(path, shape, values=(*numbers, *extra), parent=Name(EARTH_FRAMES[0]))
    if stays:
        return record._replace(numbers=tuple((*path, key) for key in keys), members=tuple(keys))
    first, *others = keys
    return record._replace(
        numbers=(None,) * len(record.values), members=(first,), others=tuple(others), placed=tuple(keys)
    )  # fmt: skip


def _are_numbers(value: dict[str, Any], keys: Iterable[str]) -> bool:
    """Return True if members are plain numbers, without marks of degrees."""
    return all(re.fullmatch(JSON_NUMBER, value[key]) for key in keys)


def _extra(pose: Pose, reading: Reading, request: Request, *, is_point: bool) -> tuple[float, ...]:
    """Return the covariance of a pose or point in ECEF where it counts; where it does not, that is noted."""
    if pose.covariance is None:
        return ()
    if request.gathered is not None or request.operation.formula is not None or request.place is not None:
        reading.note(LEFT_OUT.format("a result at a place" if request.place else "this"), rule="left-out")
        return ()
    entries = tuple(pose.covariance)
    return tuple(entries[6 * i + j] for i in range(3) for j in range(3)) if is_point else entries


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
