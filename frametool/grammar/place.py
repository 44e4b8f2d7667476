"""Positions on the Earth in the grammar of poses: their keys, and the local axes of rotations.

    {lat: 48.1, lon: 11.5, alt: 520}                             a point of `ecef`, WGS84; degrees, metres
    {lat: 48.1, lon: 11.5, axes: enu, rpy_deg: [0, 0, 90]}       a pose in `ecef`, its rotation relative to these axes
    {at: {lat: 48.1, lon: 11.5}, axes: enu, xyz: [1, 2, 3]}      ecef_from_axes there, then the other keys

Imported only if a mapping has such keys.
"""

from __future__ import annotations

import re
from math import hypot, isfinite
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, shown
from frametool.geometry import earth as wgs84
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.earth import NORTH, SOUTH, ZONES, standard_zone, utm, zone_number
from frametool.geometry.place import ECEF, ENU, GRID, GRIDDED, LLA, LOCAL, NED, UNSAID, UTM, ZONE, Place, Spot
from frametool.geometry.representations import HEADING, POSITIONS
from frametool.grammar import readers
from frametool.grammar.readers import AXES_KEY, EARTH_FRAMES, FLAT, Misfit, Reading, kind, read_number, within
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from frametool.grammar.pose import Pose

AT = "at"
LLA_KEYS = frozenset(("lat_rad", "lon_rad", *readers.PLACE_FIELDS)) - {"utm_zone"}
FLAT_NAMES = frozenset[str]().union(*FLAT.values())
UTM_KEYS = frozenset((UTM, "easting", "northing", ZONE, "utm_zone"))
HEADINGS = {"heading_deg": True, "heading_rad": False}
NOT_READ = {  # key or column -> what to write instead
    "datum": "datum is not read, all is WGS84; leave it out, or convert from another one first (cs2cs, pyproj)",
    "epsg": "codes of EPSG are not read; write utm_zone: 32N or lat, lon; convert from others first (cs2cs, pyproj)",
    LLA: "lla does not say which number is lat; write {lat: .., lon: .., alt: ..}",
    "mgrs": "MGRS is not read; convert it to lat, lon first (GeoConvert, or python's mgrs)",
}
EARTH_KEYS = LLA_KEYS | UTM_KEYS | NOT_READ.keys() | {*GRIDDED} | {ECEF, AT, *HEADINGS} | FLAT_NAMES
NO_ALT = "no alt: 0 is taken, on the ellipsoid"
LEVEL = 1e-9  # below this length the horizontal part has no direction
NEAR = 0.01  # metres: the largest distance between two positions of one entry
MINUTE, SECOND = "['\u2032\u2019]", "(?:[\"\u2033\u201d]|'')"
DMS = re.compile(
    r"\s*([-+]?)(\d+(?:\.\d*)?)\s*(?:[°d]\s*"
    rf"(?:(\d+(?:\.\d*)?)\s*{MINUTE}\s*(?:(\d+(?:\.\d*)?)\s*{SECOND}\s*)?)?)?([NSEWnsew]?)\s*"
)


def without_place(mapping: dict[str, Any]) -> dict[str, Any]:
    """Return the other keys of a mapping with a position on the Earth: a pose relative to that position."""
    return {key: value for key, value in mapping.items() if key not in EARTH_KEYS and key != AXES_KEY}


def placed_by(mapping: dict[str, Any], inner: Pose, reading: Reading) -> Pose:
    """Return the pose or point in `ecef` of a mapping with a position on the Earth and of the pose in its other keys.

    Raises Misfit with the path of the error in this mapping.
    """
    own = {key: value for key, value in mapping.items() if key in EARTH_KEYS}
    spots = _spots(own, reading)
    if not spots:
        raise Misfit(_incomplete(own), (next(iter(own)),), key=True)
    states_axes, axes = AXES_KEY in mapping, take_axes(mapping, reading, spots[0].place.name)
    check_parent(mapping, own)
    if "inverse" in mapping:
        raise Misfit("a position on the Earth is in ecef; remove inverse", ("inverse",), key=True)
    turn = _heading(own, axes)
    if turn is not None and inner.rotation is not None:
        raise Misfit("a heading is a rotation; keep one", (next(key for key in HEADINGS if key in own),), key=True)
    position = spots[0].ecef
    if AT not in own and inner.position is not None:
        _agree(position, inner.position)
        if not states_axes:  # also stated in ecef: then the rotation is relative to it
            return inner._replace(parent=inner.parent or ECEF)
        inner = inner._replace(position=None)
    rotation = turn or inner.rotation
    is_frame = AT in own or reading.framed  # a frame has axes, a position does not
    needs_axes = is_frame or rotation is not None or inner.covariance is not None
    if needs_axes and not axes:
        raise Misfit(UNSAID)
    if not needs_axes:
        return inner._replace(position=position, parent=inner.parent or ECEF, read=spots[0])
    place, numbers = spots[0].place._replace(axes=axes), spots[0].numbers
    within((next(iter(own)),), place.check, numbers)
    made = rigid.compose_full(place.base(numbers), inner._replace(rotation=rotation, scale=1.0).placed)
    found = inner.of(made, inner.name, inner.parent or ECEF)
    found = found if inner.position else found._replace(read=spots[0])
    return found if rotation is not None or is_frame else found._replace(rotation=None)


def _spots(own: dict[str, Any], reading: Reading) -> list[Spot]:
    """Read all positions in the keys of a mapping; they have to agree."""
    refuse_not_read(own)
    found = []
    if AT in own:
        found.append(within((AT,), read_at, own[AT], reading))
    if ECEF in own:
        xyz = within((ECEF,), readers.read_numbers, own[ECEF], ("x", "y", "z"))
        found.append(Spot(Place(ECEF, ("x", "y", "z")), xyz))
    if UTM in own:
        found.append(within((UTM,), _utm, own[UTM], reading))
    elif "easting" in own:
        there = [key for key in own if key in UTM_KEYS or readers.PLACE_FIELDS.get(key) == "alt"]
        found.append(_utm({key: own[key] for key in there}, reading))
    if any(key in own for key in ("lat", "latitude", "lat_rad")):
        named = _by_field(own)
        latitude, longitude = ([each for each in (name, f"{name}_rad") if each in named] for name in ("lat", "lon"))
        if len(latitude) != 1 or len(longitude) != 1:
            raise Misfit(_incomplete(own), (next(iter(own)),), key=True)
        fields = *latitude, *longitude, *_heights(named, reading, named[latitude[0]])
        keys = [(named[each], each) for each in fields]
        found.append(Spot(Place(LLA, fields), tuple(within((key,), coordinate, own[key], each) for key, each in keys)))
    for name, fields in FLAT.items():
        if {*fields} <= own.keys():
            axes, origin = (name, reading.earth and reading.earth.origin) if name in LOCAL else ("", None)
            if axes and origin is None:
                raise Misfit("east, north and up need --origin {lat: .., lon: ..}, or place the frame with at:")
            numbers = tuple(within((field,), read_number, own[field]) for field in fields)
            found.append(Spot(Place(name, fields, axes, None, origin), numbers))
    for spot in found:
        within((next(iter(own)),), spot.place.check, spot.numbers)
    for other in found[1:]:
        _agree(found[0].ecef, other.ecef)
    return found


def read_at(value: Any, reading: Reading) -> Spot:
    """Read the value of `at:`: lat lon alt, utm or ecef, and nothing else."""
    if type(value) is not dict:
        raise Misfit(f"expected a place like {{lat: 48.1, lon: 11.5, alt: 520}}, found {kind(value)}")
    if unknown := [key for key in value if key not in EARTH_KEYS or key in (AT, *HEADINGS, *FLAT_NAMES)]:
        what = f"unknown key {shown(unknown[0])} of a place; it has lat lon alt, utm or ecef"
        raise Misfit(what, (unknown[0],), key=True)
    found = _spots(value, reading)
    if not found:
        raise Misfit(_incomplete(value))
    return found[0]


def _by_field(own: dict[str, Any]) -> dict[str, str]:
    """Return the key of each field of a position; raise Misfit for two of one field."""
    named: dict[str, str] = {}
    for key in own:
        if (field := readers.PLACE_FIELDS.get(key, key)) in named:
            raise Misfit(f"{named[field]} and {key} are both {field}; keep one", (key,), key=True)
        named[field] = key
    return named


def heights(named: dict[str, str]) -> tuple[str, ...]:
    """Return the fields that make a height above the ellipsoid, from field -> key; () without a height."""
    if "alt" in named or "msl" not in named:
        return ("alt",) * ("alt" in named)
    if "undulation" not in named:
        above = f"{shown(named['msl'])} is above sea level, alt above the ellipsoid"
        raise Misfit(f"{above}; give undulation (the geoid there) too, or alt", (named["msl"],), key=True)
    return "msl", "undulation"


def _heights(named: dict[str, str], reading: Reading, *path: str) -> tuple[str, ...]:
    """Return the fields as `heights` does; record a warning if there is no height."""
    if not (found := heights(named)):
        reading.note(NO_ALT, *path, rule="no-alt")
    return found


def coordinate(value: Any, field: str) -> float:
    """Read a number, for latitude and longitude also with marks: 48°08'14.5"N, 48.1N."""
    if type(value) is not str:
        raise Misfit(f"expected a number, found {kind(value)}")
    try:
        return parse_number(value)
    except ValueInvalid as error:
        if field not in ("lat", "lon"):
            raise
        if (match := DMS.fullmatch(value)) is None:
            marks = f"{shown(value)}: degrees, minutes and seconds need their marks: 48°08'14.5\"N"
            is_several = len(re.findall(r"\d+(?:[.,]\d+)?", value)) > 1
            raise Misfit(marks if is_several else str(error), rule=error.rule) from None
    sign, degrees, minutes, seconds, letter = match.groups()
    parts = [float(part or 0.0) for part in (degrees, minutes, seconds)]
    if max(parts[1:]) >= 60.0 or (sign and letter):
        raise Misfit(f"{shown(value)}: minutes and seconds are below 60, and a sign or a letter states the side")
    size = (parts[0] * 3600.0 + parts[1] * 60.0 + parts[2]) / 3600.0 if minutes else parts[0]
    letter = letter.upper()
    if letter and letter not in ("NS" if field == "lat" else "EW"):
        raise Misfit(f"{shown(value)} is not a {field}: {letter} belongs to {'lon' if field == 'lat' else 'lat'}")
    return -size if sign == "-" or letter in ("S", "W") else size


def _utm(value: Any, reading: Reading) -> Spot:
    """Read a position in UTM."""
    if type(value) is not dict:
        raise Misfit(f"expected {{zone: 32N, easting: .., northing: .., alt: ..}}, found {kind(value)}")
    refuse_not_read(value)
    named = _by_field(value)
    known = (*POSITIONS[UTM].names, "msl", "undulation", *GRIDDED)
    if unknown := [key for field, key in named.items() if field not in known]:
        what = f"unknown key {shown(unknown[0])} of utm; it has zone, easting, northing, alt"
        raise Misfit(what, (unknown[0],), key=True)
    default = reading.earth.zone if reading.earth else None
    if ZONE in named and type(value[named[ZONE]]) is not str:
        raise Misfit(f"expected a zone like 32N, found {kind(value[named[ZONE]])}", (named[ZONE],))
    zone = within((named[ZONE],), zone_number, value[named[ZONE]]) if ZONE in named else default
    if zone is None:
        raise Misfit("utm needs its zone: 32N, or 32S south of the equator")
    if missing := [key for key in ("easting", "northing") if key not in value]:
        raise Misfit(f"missing {' and '.join(missing)}; utm has zone, easting, northing, alt")
    fields = "easting", "northing", *_heights(named, reading)
    numbers = zone, *(within((named[each],), read_number, value[named[each]]) for each in fields)
    if zone < 0.0 and 3.5e6 <= numbers[2] <= 4.5e6:
        reading.note(band_s(zone, numbers[2]), rule="band-s")
    return Spot(Place(UTM, (ZONE, *fields)), numbers)


def band_s(zone: float, northing: float) -> str:
    """Return a warning that a zone's S may be the latitude band, which is in the north."""
    name = f"zone {ZONES[int(zone)]} with northing {northing:g}"
    return f"{name}: S is south of the equator; the band S lies north, write N"


def _agree(first: Any, second: Any) -> None:
    """Raise Misfit unless two positions are equal."""
    apart = max(abs(a - b) for a, b in zip(first, second, strict=True))
    if not apart <= NEAR:
        raise Misfit(f"two positions in one entry disagree by {apart:.6g} m; keep one")


def take_axes(mapping: dict[str, Any], reading: Reading, name: str = "") -> str:
    """Return the axes of rotations, as stated in a mapping, else the default for all."""
    default = reading.earth.axes if reading.earth else ""
    default = name if name in LOCAL else default
    if AXES_KEY not in mapping:
        return default
    value = mapping[AXES_KEY]
    if value not in wgs84.AXES:
        found = shown(value) if type(value) is str else kind(value)
        raise Misfit(f"axes {found}: at a place they are enu, ned, grid or ecef", (AXES_KEY,))
    return str(value)


def check_parent(mapping: dict[str, Any], own: dict[str, Any]) -> None:
    """Refuse a position on the Earth in another frame."""
    for key in ("parent", "frame"):
        value = mapping.get(key)
        if value == UTM:
            raise Misfit("utm is neither rigid nor a parent; place the frame: at: {utm: {..}}, axes: grid", (key,))
        if value not in (None, *EARTH_FRAMES):
            what = "at" if AT in own else next(name for name in own if name in EARTH_KEYS)
            raise Misfit(f"{what} places a frame in ecef; {key} is {shown(value)}", (key,))


def _heading(own: dict[str, Any], axes: str) -> readers.Quaternion | None:
    """Read a heading as a rotation in the axes."""
    key = next((key for key in HEADINGS if key in own), "")
    if not key:
        return None
    if axes == ECEF:
        raise Misfit("a heading is clockwise from north, which axes ecef do not have; axes: enu, ned or grid", (key,))
    if type(own[key]) is not str:
        raise Misfit(f"expected a number, found {kind(own[key])}", (key,))
    angle, unit = within((key,), parse_angle, own[key])
    degrees = HEADINGS[key] if unit is None else unit == "deg"
    if not axes:
        raise Misfit(UNSAID)
    return HEADING.forward((angle,), floats, degrees, NED if axes == NED else ENU)


def refuse_not_read(own: Collection[str]) -> None:
    """Refuse keys that name another system than WGS84, and a bare `lla`."""
    if key := next((key for key in NOT_READ if key in own), None):
        raise Misfit(NOT_READ[key], (key,), key=True)


def _incomplete(own: dict[str, Any]) -> str:
    """Return an error that lists the keys of an incomplete position, and what it needs."""
    names = ", ".join(own)
    whole = "lat, lon, alt, or ecef: [x, y, z], or utm: {zone, easting, northing}"
    return f"{names}: half a place on the Earth; write {whole}"


# --- writing ---


def check_in_ecef(parent: str | None, place: Place) -> None:
    """Raise ValueInvalid unless a result is in the Earth's frame."""
    if parent in EARTH_FRAMES:
        return
    names = ",".join(each.name for each in (place, *place.more))
    unnamed = "this one does not name its frame (--from ecef, or parent: ecef)"
    found = f"this one is in {shown(parent)}" if parent else unnamed
    raise ValueInvalid(f"--to {names} wants poses in ecef: {found}")


def _numbers_of(frame: str | None, position: Sequence[float], place: Place, read: Spot | None = None) -> list[float]:
    """Return the numbers of a position in ecef; raises ValueInvalid for another frame, or if it cannot be written.

    read: the position as it was read, which is used if it is unchanged
    """
    check_in_ecef(frame, place)
    x, y, z = position
    place.settle(x, y, z)
    place.check_result(x, y, z)
    is_unchanged = read is not None and read.ecef == (x, y, z)
    return [number + 0.0 for number in place.numbers(x, y, z, read if is_unchanged else None)]


def _written(pose: Pose, place: Place) -> tuple[list[float], Pose]:
    """Return the numbers of the position of a pose in ecef, and the pose without it, in the local axes.

    Raises ValueInvalid as `_numbers_of`.
    """
    numbers = _numbers_of(pose.parent, pose.components[:3], place, pose.read)
    if pose.rotation is None:
        return numbers, pose._replace(position=None)
    x, y, z, w = place.local(*pose.components[:3], pose.rotation)
    return numbers, pose._replace(position=None, rotation=(x, y, z, w))


def placed_entry(pose: Pose, place: Place) -> tuple[dict[str, Any], Pose]:
    """Return the position of a pose in ecef as a mapping, with the axes of its rotation; and the pose in these axes.

    Raises ValueInvalid for a pose in another frame, and for a position that cannot be written in this notation.
    """
    numbers, there = _written(pose, place)
    entry = place.entry(numbers)
    if place.name == ECEF:
        return {"xyz": entry.pop(ECEF)} | entry, there
    return entry | ({} if pose.rotation is None else {AXES_KEY: place.axes}), there


def placed_cells(pose: Pose, place: Place) -> tuple[dict[str, Any], Pose]:
    """Return the position of a pose in ecef as cells of a table, with the axes of its rotation; and the pose in these.

    Raises as `placed_entry`.
    """
    numbers, there = _written(pose, place)
    cells = {
        name: place.words[at][int(number)] if at in place.words else number
        for at, (name, number) in enumerate(zip(place.columns, numbers, strict=True))
    }
    axes = {} if pose.rotation is None else {AXES_KEY: place.axes}
    return cells | axes, there


def overview(pose: Pose) -> list[tuple[str, str]]:
    """Return lines that describe a pose or point in ecef: lat lon alt, UTM, heading of its x; [] without a position."""
    x, y, z = pose.position or (0.0, 0.0, 0.0)
    lat, lon, alt = wgs84.lla(x, y, z, floats)
    if not isfinite(alt):
        return []
    lines = [("lat lon alt", f"{round(lat, 9) + 0.0:.9f} {round(lon, 9) + 0.0:.9f} deg  {round(alt, 4) + 0.0:.4f} m")]
    if SOUTH <= lat <= NORTH:
        zone = standard_zone(lat, lon, floats)
        easting, northing, convergence, _ = utm(zone, lat, lon, floats)
        grid = f"{ZONES[int(zone)]} {easting:.4f} {northing:.4f} m  convergence {round(convergence, 6) + 0.0:.6f} deg"
        lines.append(("utm", grid))
    if pose.rotation is not None:
        qx, qy, qz, qw = Place(LLA, POSITIONS[LLA].names, ENU).local(x, y, z, pose.rotation)
        east, north, _ = quaternion.rotate(qx, qy, qz, qw, 1.0, 0.0, 0.0)
        level = hypot(east, north)
        heading = round(floats.bearing(east, north, level, floats) * floats.RADIAN, 6) % 360.0 if level > LEVEL else 0.0
        lines.append(("heading", f"x {heading:.6f} deg from true north" if level > LEVEL else "none: x is upright"))
    return lines


def frame_entry(pose: Pose, place: Place) -> tuple[dict[str, Any], Pose]:
    """Return a frame of ecef as an entry of a tree: `at` and `axes`, and its pose and covariance in these axes.

    Raises as `placed_entry`, and for grid axes without a stated zone.
    """
    if place.axes == GRID and place.zone is not None and UTM not in (place.name, *(each.name for each in place.more)):
        raise ValueInvalid(f"--to {place.name} does not state the zone of axes grid; --to utm does")
    turned = pose.components[3:]
    try:
        at, local = placed_entry(pose._replace(parent=ECEF), place)
    except ValueInvalid as error:
        raise ValueInvalid(f"frame {shown(pose.name)}: {error}" if pose.name else str(error)) from None
    local = local._replace(parent=pose.parent)
    if pose.covariance is not None and local.rotation is not None:
        back = quaternion.compose(*local.rotation, *quaternion.conjugate(*turned))
        made = rigid.compose_full((0.0, 0.0, 0.0, *back), (0.0, 0.0, 0.0, *turned, *pose.covariance))
        local = local._replace(covariance=pose.of(made).covariance)
    axes = at.pop(AXES_KEY)
    return {AT: at, AXES_KEY: axes}, local


def seen_at(pose: Pose, place: Place | None) -> tuple[dict[str, Any], Pose]:
    """Return the position of a frame of ecef as a mapping in one notation, and its pose in the axes stated there.

    If the notation cannot express the position, the mapping is empty and the pose unchanged.
    """
    place = Place(LLA, POSITIONS[LLA].names, ENU) if place is None else place
    try:
        entry, local = placed_entry(pose, place._replace(more=()).with_grid(gridded=False))
    except ValueInvalid:
        return {}, pose
    return ({}, pose) if place.name == ECEF else (entry.pop(UTM, {}) | entry, local)


def point_entry(frame: str | None, point: Sequence[float], place: Place, read: Spot | None = None) -> dict[str, Any]:
    """Return a point of ecef as a mapping: as a position on the Earth, or with its frame.

    Raises ValueInvalid for a point of another frame, and for one that cannot be written in this notation.
    """
    entry = place.entry(_numbers_of(frame, point, place, read))
    in_metres = entry.pop(ECEF, None)
    return ({"frame": frame, "point": in_metres} if in_metres else {}) | entry
