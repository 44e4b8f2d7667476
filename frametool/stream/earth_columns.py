"""Positions on the Earth among the columns of a table or the keys of a record: lat lon alt, ecef_x, easting ..

A common prefix is one that is set off (`field.latitude`, `gps_lat`); units follow names or in brackets.  Of records
points of latitude and longitude stay where they are, anything else is read as a pose:

    {"id": 7, "lat": 48.1, "lon": 11.5, "alt": 520}                     its numbers stay where they are, and are fast
    {"utm": {..}}  {"at": {..}, "axes": "enu", ..}  {"lat": .., "heading_deg": 30, "axes": "ned"}     written anew
    {"header": {"frame_id": "gps"}, "latitude": .., "position_covariance": [..]}                      a NavSatFix

Loaded where one of the names may say such a position.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import JSON_NUMBER
from frametool.errors import FormatError, Misused, ValueInvalid, shown, warn
from frametool.geometry import uncertainty
from frametool.geometry.earth import AXES as AXES_AT
from frametool.geometry.earth import ZONES as ZONE_NAMES
from frametool.geometry.earth import zone_number
from frametool.geometry.place import AXES, ECEF, ENU, LLA, LOCAL, NED, UNSAID, UTM, ZONE, Earth, Place, kernels
from frametool.geometry.representations import HEADING, POSITIONS, Notation, notation
from frametool.grammar import readers
from frametool.grammar.covariance import check, entries_of, of_position
from frametool.grammar.place import (
    AT,
    EARTH_KEYS,
    NO_ALT,
    NOT_READ,
    SAME,
    band_s,
    check_in_ecef,
    check_parent,
    coordinate,
    heights,
    placed_by,
    refuse_not_read,
    without_place,
)
from frametool.grammar.place import FIELDS as PLACE_FIELDS
from frametool.grammar.pose import COVARIANCE_KEYS, LEFT_OUT, Pose
from frametool.grammar.readers import AXES_KEY, EARTH_FRAMES, FIX, Misfit, Reading, may_be_uncertain, within
from frametool.stream.faults import ZONES, RowNote
from frametool.stream.header import Columns, Header, PoseColumns, find_positions, find_rotations, listed, places_named
from frametool.stream.row_layout import POINT, POSE, VECTOR, Shape, place_of
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from typing import TypeAlias

    from frametool.stream.record import Record
    from frametool.stream.request import Request
    from frametool.stream.table import Table
    from frametool.text.spans import Floats

    Reader: TypeAlias = Callable[[str], float]
    Inner: TypeAlias = Callable[[dict[str, Any]], tuple[Pose, Sequence[str]]]
    Groups: TypeAlias = dict[str, dict[str, "NamedColumn"]]

ECEF_COLUMNS = POSITIONS[ECEF].columns
STATUS, PARENT = "status", "parent"
STAYING = (STATUS, PARENT)  # read, and not rewritten
OTHERS = ("easting", "northing", *ECEF_COLUMNS, ZONE, "heading", AXES, *STAYING, "datum", "epsg")
FIELDS = PLACE_FIELDS | {name: name for names in (OTHERS, *readers.FLAT.values()) for name in names}
PATTERN = re.compile(
    rf"[#% ]*((?:.*[._/])??)({'|'.join(sorted(FIELDS, key=len, reverse=True))})"
    r"(?:[_ ]?(deg|rad|e7|m|mm|cm|ft))?\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*",
    re.IGNORECASE,
)
FIX_ENTRY = re.compile(rf"(?:.*[./_])?{FIX}\[?_?([0-8])\]?")
FIX_TYPE = "position_covariance_type"
WHOLE = ("lat", "latitude", "lat_rad", AT, "ecef", "utm", "easting", *readers.FLAT_KEYS)
DEGREES = {"": False, "deg": False, "degrees": False, "°": False, "rad": True, "radians": True}


class NamedColumn(NamedTuple):
    """A column: its place, its name, and the unit that this says."""

    place: int
    name: str
    unit: str


def _find(groups: Groups, earth: Earth, expected: str) -> PoseColumns | None:
    """Find the one position on the Earth among columns, and a heading with it; None if absent.

    expected: the representation that --from names.
    Raises ValueInvalid for several, for heights that are not above the ellipsoid, and for units that are not known.
    """
    kinds = (expected,) if expected else POSITIONS
    found = [(spots, _position(kind, spots, groups, earth)) for spots in groups.values() for kind in kinds]
    found = [each for each in found if each[1] is not None]
    plain = [each for each in found if each[0] is groups.get("")] or found
    if len(plain) > 1:
        several = "; ".join(columns.shown for _, columns in plain if columns)
        raise ValueInvalid(f"several positions on the Earth: {several}; choose with --columns NAMES --from lla")
    if not plain:
        return None
    spot = plain[0][0].get("heading")
    if spot is None or spot.unit == "":
        return PoseColumns(plain[0][1], None)
    degrees = not _in_radians(spot)
    heading = Notation(f"heading_{'deg' if degrees else 'rad'}", HEADING, NED, degrees=degrees)
    return PoseColumns(plain[0][1], Columns((spot.place,), (spot.name,), notation=heading, said=(degrees,)))


def _position(kind: str, spots: dict[str, NamedColumn], groups: Groups, earth: Earth) -> Columns | None:
    """Return the columns of a position of one kind, if they are there."""
    if kind in LOCAL and earth.origin is None:
        return None  # east and north are other data
    row = POSITIONS[kind]
    words = [words for words in zip(row.names, row.columns, strict=True) if words[0] != "alt"]
    fields = {field: spot for field, column in words if (spot := spots.get(column) or spots.get(field))}
    missing = {field for field, _ in words} - fields.keys()
    if kind == UTM and missing <= {ZONE}:
        zone = fields.get(ZONE) or groups.get("utm_", {}).get(ZONE) or groups.get("", {}).get(ZONE)
        if zone is None and earth.zone is None:
            refuse_not_read(spots)
            raise ValueInvalid("easting and northing do not say their zone; add a column utm_zone, or give --zone 32N")
        fields, missing = ({} if zone is None else {ZONE: zone}) | fields, set()
    if missing:
        return None
    if kind == LLA:
        fields = {f"{name}_rad" if _in_radians(spot) else name: spot for name, spot in fields.items()}
    above = heights({field: spot.name for field, spot in spots.items()}) if "alt" in row.names else ()
    return _columns(kind, fields | {field: spots[field] for field in above}, spots, earth)


def _columns(kind: str, fields: dict[str, NamedColumn], spots: dict[str, NamedColumn], earth: Earth) -> Columns:
    """Put the columns together, with that of the axes, and those that are checked and stay."""
    for field, spot in fields.items():
        if field[:3] not in ("lat", "lon") and spot.unit not in ("", "m"):
            what = f"column {shown(spot.name)}: unknown unit {shown(spot.unit)} of a length here; known is m"
            raise ValueInvalid(what)
    refuse_not_read(spots)
    fields = fields | {name: spots[name] for name in (AXES, *STAYING) if name in spots}
    axes, origin = (earth.axes or kind, earth.origin) if kind in LOCAL else (earth.axes, None)
    place = Place(kind, (*fields,), axes, earth.zone if kind == UTM and ZONE not in fields else None, origin)
    places, names, _ = zip(*fields.values(), strict=True)
    return Columns(places, names, unit=place)


def _in_radians(spot: NamedColumn) -> bool:
    if spot.unit not in DEGREES:
        unknown = f"column {shown(spot.name)}: unknown unit {shown(spot.unit)}"
        raise ValueInvalid(f"{unknown}; lat and lon are degrees, or rad")
    return DEGREES[spot.unit]


def find_pose(names: Sequence[str], request: Request, source: str) -> PoseColumns | None:
    """Find a position on the Earth and the rotation with it; None for rows that are expressed as x, y, z.

    Raises FormatError for half of one, for heights above the sea, and for a rotation whose axes nobody says.
    """
    groups: Groups = {}  # by what is before the names, and by field
    for at, name in enumerate(names):
        if name and (match := PATTERN.fullmatch(name)):
            unit = (match[4] if match[4] is not None else match[3] or "").lower()
            prefix, field = match[1].lower(), FIELDS[match[2].lower()]
            if field == STATUS:  # of a NavSatFix: another may be anything
                prefix = prefix.removesuffix("status.") if prefix.endswith("status.") else "another status"
            groups.setdefault(prefix, {}).setdefault(field, NamedColumn(at, name, unit))
    every = sorted((spot, field) for spots in groups.values() for field, spot in spots.items())
    earth, expected = request.earth or Earth(), request.rows.given_place
    in_ecef = {spot.place for spot, field in every if field in ECEF_COLUMNS and not expected}
    positions = find_positions(_header_of(names, in_ecef))
    if not expected and positions:
        said = [spot.name for spot, field in every if readers.may_be_on_earth(spot.name) or field == "lon"]
        if not request.operation.keeps_frames and said:
            message = f"{', '.join(said[:2])} stay data: {positions[0].shown} are the position"
            warn(f"{source}: {message}; --columns lat,lon,alt --from lla turns it round")
        return None
    try:
        found = _find(groups, earth, expected)
        if found is None and (place := Place.of_xyz(expected, earth)) and positions:
            found = PoseColumns(positions[0]._replace(unit=place), None)
        _check_found(found, names, {field for _, field in every}, request)
    except ValueInvalid as error:
        raise FormatError(str(error), source=source, line=1) from None
    if found is None or found.position is None:
        return None
    taken = {place for columns in found if columns for place in columns.places}
    turned = find_rotations(_header_of(names, taken), request.rows.given)
    turned += [found.rotation] if found.rotation else []
    if len(turned) > 1:
        several = " and ".join(each.shown for each in turned)
        raise FormatError(f"expected one rotation, found {several}", source=source, line=1)
    unsaid = [spot.name for spot, field in every if field == "heading" and not spot.unit]
    if unsaid and not turned:
        warn(f"{source}: {shown(unsaid[0])} has no unit and stays data; name it heading_deg")
    return PoseColumns(found.position, next(iter(turned), None))


def _header_of(names: Sequence[str], taken: Collection[int]) -> Header:
    """Return a header without some of its columns, which keep their places."""
    return Header(["" if at in taken else name for at, name in enumerate(names)])


def _check_found(found: PoseColumns | None, names: Sequence[str], fields: Collection[str], request: Request) -> None:
    """Raise ValueInvalid for an incomplete position, for the one of --from that is not there, and for an idle zone."""
    expected = request.rows.given_place
    if found is not None:
        place = place_of(found.position.unit) if found.position else None
        says_zone = expected == UTM and place is not None and ZONE in place.fields
        is_asked = request.results.place is not None and UTM in [each.name for each in request.results.place.all]
        if says_zone and not is_asked and request.earth is not None and request.earth.zone is not None:
            raise ValueInvalid("--zone has no effect: each row says its zone")
    elif row := POSITIONS.get(expected):
        what = f"no columns of {expected} ({' '.join(row.columns)}) among: {listed(names)}"
        raise ValueInvalid(f"{what}; name them with --columns")
    elif any(name.lower().rpartition(".")[2] == "mgrs" for name in names):
        raise ValueInvalid(NOT_READ["mgrs"])
    elif ("lat" in fields) != ("lon" in fields):
        missing = "lon" if "lat" in fields else "lat"
        raise ValueInvalid(f"half a place on the Earth: no {missing}; add it, or choose with --columns")
    elif {"east", "north"} <= {*fields}:
        raise ValueInvalid("east, north and up or down are of an origin; give --origin '{lat: .., lon: ..}'")


def chosen_pose(spec: str, names: Sequence[str] | None, width: int, request: Request) -> PoseColumns:
    """Take the columns that --columns names for a place, as --from says, and a rotation behind it.

    spec: "" for all columns of a table without names, behind a stamp or not
    Raises Misused for names that are not there, or a count that the place does not have.
    """
    kind, earth = request.rows.given_place, request.earth or Earth()
    is_zoned = kind == UTM and earth.zone is not None
    fields = POSITIONS[kind].names[is_zoned:]
    most = len(fields)
    called, places = places_named(spec or f"{1 + (width == most + 1)}-{width}", names, width)
    own, behind = places[:most], places[most:]
    if len(own) < (kernels(kind).least or most) - is_zoned:
        raise Misused(f"--columns: {kind} has {most} numbers ({' '.join(fields)}); found {len(own)}")
    spots = {field: NamedColumn(place, called[place], "") for field, place in zip(fields, own, strict=False)}
    try:
        position = _columns(kind, spots, {}, earth)
    except ValueInvalid as error:
        raise Misused(f"--columns: {error}") from None
    turned = find_rotations(_header_of(called, {*range(width)}.difference(behind)), None)
    if behind and len(turned) != 1:
        raise Misused(f"--columns: {', '.join(called[at] for at in behind)} are no rotation behind {kind}")
    return PoseColumns(position, turned[0] if turned else None)


def along(
    place: Place, shape: Shape, names: Sequence[str], places: tuple[int, ...], source: str
) -> tuple[tuple[int, ...], Shape]:
    """Return what the covariance with a place is expressed in; that of a NavSatFix is, where nothing else is there.

    Raises FormatError where nobody says so.
    """
    fix = {int(match[1]): at for at, name in enumerate(names) if (match := FIX_ENTRY.fullmatch(name))}
    if not places and shape.kind == POINT and len(fix) == 9:  # field.position_covariance0, or [0]
        return tuple(fix[at] for at in range(9)), shape._replace(unit=place._replace(axes=ENU))
    if places and not (place.axes or AXES in place.fields):
        raise FormatError(UNSAID.replace("rotation", "covariance").replace("a pose", "a row"), source=source, line=1)
    return places, shape


def readers_of(shape: Shape) -> tuple[dict[int, Reader], dict[int, Reader], int]:
    """Return what reads the words of a place, by the number's place, and what its angles with marks.

    And how many of the last numbers are read and stay as they are.
    """
    fields = shape.place.fields if shape.place is not None else ()
    words = {at: WORDS[field] for at, field in enumerate(fields) if field in WORDS}
    marked: dict[int, Reader] = {
        at: partial(coordinate, field=field) for at, field in enumerate(fields) if field in ("lat", "lon")
    }
    return words, marked, sum(field in STAYING for field in fields)


def _axes(text: str) -> float:
    if text not in AXES_AT:
        raise ValueInvalid(f"{shown(text)}: axes at a place are {', '.join(AXES_AT)}")
    return float(AXES_AT.index(text))


def _status(text: str) -> float:
    """Check the status of a NavSatFix."""
    if parse_number(text) < 0.0:
        raise ValueInvalid(f"status {text}: there was no fix")
    return 0.0


def _parent(text: str) -> float:
    """Check the frame that a row names."""
    check_parent({PARENT: text or None}, {"lat": None})
    return 0.0


WORDS: dict[str, Reader] = {ZONE: zone_number, AXES: _axes, STATUS: _status, PARENT: _parent}


def zone_notes(place: Place, columns: Sequence[Floats], line_of: Callable[[int], int]) -> list[RowNote]:
    """Return the zone of the first of some results in UTM, and where the first other one begins."""
    notes = []
    for at in place.words:
        other = (columns[at] != columns[at][0]).nonzero()[0][:1].tolist()
        notes += [RowNote(line_of(row), ZONES, ZONE_NAMES[int(columns[at][row])]) for row in (0, *other)]
    return notes


def doubt_band(place: Place, columns: Sequence[Floats], line_of: Callable[[int], int]) -> list[RowNote]:
    """Wonder about the first row whose zone has the S of a band."""
    fields = dict(zip(place.fields, columns, strict=False))
    if place.name != UTM:
        return []
    northing = fields["northing"]
    zone = fields[ZONE] if place.zone is None else northing * 0.0 + place.zone
    rows = ((zone < 0.0) & (northing >= 3.5e6) & (northing <= 4.5e6)).nonzero()[0][:1].tolist()
    return [RowNote(line_of(row), "band-s", band_s(float(zone[row]), float(northing[row])), ZONE) for row in rows]


def settle(
    request: Request, shapes: tuple[Shape, ...], table: Table, *, on_earth: bool
) -> tuple[Request, tuple[Shape, ...]]:
    """Check what rows on the Earth need: axes for rotations, a height; and that the frame of places is the Earth's.

    Raises FormatError for a rotation whose axes nobody says, CalcError.
    """
    operation, asked, names = request.operation, request.results, table.names or ()
    if on_earth and (place := shapes[0].place) is not None:
        shape, earth = shapes[0], request.earth
        reads = operation.moves or not operation.keeps_frames or asked.place is not None or asked.all_numbers
        if shape.kind == VECTOR:
            raise Misused("a vector has no place on the Earth; leave --as vector out")
        if place.name in (LLA, UTM) and not {"alt", "msl"}.intersection(place.fields) and reads:
            warn(f"{table.source}: {NO_ALT}")
        if operation.keeps_frames and asked.place is None:
            bare = shape.notation is None and all(each.representation.name == "quaternion" for each in asked.notations)
            request = request.with_results(place=Place.written((ECEF,), Earth()), by_default=asked.by_default or bare)
        if shape.notation is None and not (operation.inverse or operation.similar):
            has_idle_axes = earth and earth.axes and operation.keeps_frames
            if has_idle_axes and not (asked.all_numbers or any(map(may_be_uncertain, names))):
                raise Misused("--local-axes has no effect: the rows have no rotation")
        elif shape.notation is None or not (place.axes or AXES in place.fields):
            raise FormatError(UNSAID, source=table.source, line=1)
        else:  # a heading is one in the axes there
            level = shape.notation.representation is HEADING
            if level and place.axes == ECEF:
                what = "a heading is clockwise from north, which axes ecef do not have"
                raise FormatError(what, source=table.source, line=1)
            shapes = (shape._replace(unit=place._replace(level=level)),)
    is_formula = operation.formula is not None
    stays = not (is_formula or operation.moves)
    says_itself = stays and (on_earth or not {*readers.PARENT_COLUMNS}.isdisjoint(names))
    if says_itself or (not is_formula and (request.results.place is None or request.rows.frames)):
        return request, shapes  # a look-up looks at each row, an expression at its own frames
    rename = (request.for_kind(shapes[0].kind) if shapes else request).rename
    frame = None if stays or rename is None else rename(ECEF if on_earth and is_formula else None, None)[0]
    try:
        if request.results.place is not None:
            check_in_ecef(frame, request.results.place)
    except ValueInvalid as error:
        raise FormatError(str(error), source=table.source, line=1) from None
    return request, shapes


# --- records ---


def is_on_earth(value: dict[str, Any]) -> bool:
    """Return True if a mapping says a position on the Earth, whole or by half."""
    return not {*WHOLE, "mgrs", LLA}.isdisjoint(value) and not EARTH_KEYS.isdisjoint(value)


def placed_record(
    value: dict[str, Any], empty: Record, positions: Sequence[str], inner: Inner, reading: Reading, request: Request
) -> Record | None:
    """Read a record that is placed on the Earth, whole or by half; None for one that is expressed as x, y, z.

    empty: the record without what it says; inner: reads the pose that comes with a place, and names its keys
    The numbers of latitude, longitude and height stay members of the record; no other has a place of its own.
    Raises Misfit for half a place, for a pose whose axes nobody says, and for what is no place.
    """
    own = [key for key in value if key in EARTH_KEYS]
    in_ecef = value.get("frame", value.get("parent")) in EARTH_FRAMES
    if AT not in value and ((positions and not in_ecef) or {"x", "y", "z"} <= value.keys()):
        if request.rows.poses and not request.operation.keeps_frames:
            what = f"{', '.join(own)} stay data: x, y, z are the position"
            reading.note(f"{what}; to read the place, leave these out", own[0], rule="stays")
        return None
    if request.rows.kind == VECTOR:
        raise Misfit("a vector has no place on the Earth; leave --as vector out")
    operation = request.operation
    check_parent(value, value)
    there, used = inner(without_place(value))
    mapping = {key: value[key] for key in (*own, AXES_KEY, "parent", "frame", "inverse") if key in value}
    is_fix = "header" in value and operation.formula is None
    covariance = _of_fix(value, mapping, reading, request) if is_fix else ()
    pose = placed_by(mapping, there, reading)
    if pose.rotation is None and (operation.inverse or operation.similar):
        raise Misfit(UNSAID)  # as a factor it is a pose
    takes_points = operation.takes_points or operation.keeps_frames
    is_point = pose.rotation is None and request.rows.kind != POSE and takes_points
    numbers: tuple[float, ...] = pose.components[: 7 if pose.rotation is not None else 3]
    shape = Shape(POINT if is_point else POSE, 1.0, () if pose.rotation is None else ((notation("quaternion"), False),))
    if covariance and not is_point:  # of a pose whose turn is exact
        covariance = tuple(covariance[3 * i + j] if max(i, j) < 3 else 0.0 for i in range(6) for j in range(6))
    extra = covariance
    if not extra and pose.covariance is not None:
        if operation.formula is None and request.results.place is None:
            extra = of_position(tuple(pose.covariance)) if is_point else tuple(pose.covariance)
        else:
            reading.note(LEFT_OUT.format("a result at a place" if request.results.place else "this"), rule="left-out")
    if extra:
        shape = shape._replace(covariance=(len(extra),), sigma=())
    keys = [*own, *used, *(key for key in (AXES_KEY, *COVARIANCE_KEYS) if key in value)]
    keys += ["header", *[FIX, FIX_TYPE] * bool(covariance)] if "header" in value else []
    stays = False
    if pose.read and is_point and not extra:
        place, named = pose.read.place, {SAME.get(key): key for key in keys}
        stays = len(keys) == len(named) and named.keys() == {"lat", "lon", "alt"}
        stays = stays and all(re.fullmatch(JSON_NUMBER, value[key]) for key in keys)  # without marks of degrees
        if stays or operation.keeps_frames:
            shape, numbers = Shape(POINT, place), tuple(pose.read.numbers)
        keys = [named[field] for field in place.fields] if stays else keys
    values = (*numbers, *extra)
    record = empty._replace(shape=shape, values=values)
    if stays:
        own_keys = empty.keys._replace(members=tuple(keys))
        return record._replace(numbers=tuple((*empty.path, key) for key in keys), keys=own_keys)
    own_keys = empty.keys._replace(members=(keys[0],), others=tuple(keys[1:]), placed=tuple(keys))
    return record._replace(numbers=(None,) * len(values), keys=own_keys)


def _of_fix(value: dict[str, Any], mapping: dict[str, Any], reading: Reading, request: Request) -> tuple[float, ...]:
    """Return the covariance of a NavSatFix, east, north, up there, in ECEF; () where it has none, or where it stays.

    Raises Misfit for a fix that was none.
    """
    status = value.get("status")
    if type(status) is dict and status.get("status") == "-1":
        raise readers.NotARotation("status -1: there was no fix", ("status", "status"))
    if FIX not in value or value.get(FIX_TYPE, "1") == "0" or request.results.place is not None:
        return ()
    entries = [number for _, number in within((FIX,), entries_of, value[FIX], (9,))]
    within((FIX,), check, entries)
    level = Pose(rotation=(0.0, 0.0, 0.0, 1.0))
    at = placed_by(mapping | {AXES_KEY: ENU}, level, Reading(reading.source))
    return tuple(uncertainty.rotate_covariance(tuple(entries), *at.components[3:]))
