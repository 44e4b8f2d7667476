"""Positions on the Earth among the columns of a table or the keys of a record: lat lon alt, ecef_x, easting ..

A common prefix is separated from the name (`field.latitude`, `gps_lat`); units follow names or are in brackets.  In
records lat, lon and alt of a point are replaced in place, all else is read as a pose or point in ECEF:

    {"id": 7, "lat": 48.1, "lon": 11.5, "alt": 520}                     in place, and fast
    {"utm": {..}}  {"at": {..}, "axes": "enu", ..}  {"lat": .., "heading_deg": 30, "axes": "ned"}     new members
    {"header": {"frame_id": "gps"}, "latitude": .., "position_covariance": [..]}                      a NavSatFix

Imported only if a key or column may hold such a position.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any

from frametool.documents.document import JSON_NUMBER
from frametool.errors import Misused, ValueInvalid, shown, warn
from frametool.geometry import uncertainty
from frametool.geometry.earth import AXES as AXES_AT
from frametool.geometry.earth import ZONES as ZONE_NAMES
from frametool.geometry.earth import zone_number
from frametool.geometry.place import AXES, ECEF, ENU, LLA, LOCAL, UNSAID, UTM, ZONE, Earth, Place, kernels
from frametool.geometry.representations import HEADING, POSITIONS, notation
from frametool.grammar import place as grammar
from frametool.grammar import readers
from frametool.grammar.covariance import check, entries_of, of_position
from frametool.grammar.pose import AT_EACH, COVARIANCE_KEYS, LEFT_OUT, Pose
from frametool.grammar.readers import AXES_KEY, EARTH_FRAMES, FIX, Misfit, Reading, may_be_uncertain, within
from frametool.rows import columns as finder
from frametool.rows.faults import ZONES, RowNote
from frametool.rows.shapes import POINT, POSE, VECTOR, Shape, place_of
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from typing import TypeAlias

    from frametool.rows.columns import Columns, Header, PoseColumns, Spot
    from frametool.rows.record import Record
    from frametool.rows.request import Request
    from frametool.rows.sources.tables import Table
    from frametool.text.spans import Floats

    Reader: TypeAlias = Callable[[str], float]
    Inner: TypeAlias = Callable[[dict[str, Any]], tuple[Pose, Sequence[str]]]
    Groups: TypeAlias = dict[tuple[str, str], dict[str, Spot]]

STATUS, PARENT = "status", "parent"
STAYING = (STATUS, PARENT)  # read, and not rewritten
FIX_ENTRY = re.compile(rf"(?:.*[./_])?{FIX}\[?_?([0-8])\]?")
FIX_TYPE = "position_covariance_type"
WHOLE = ("lat", "latitude", "lat_rad", grammar.AT, "ecef", "utm", "easting", *readers.FLAT_KEYS)
FIELDS = frozenset(readers.PLACE_WORDS.values())
AT_PLACE = notation("heading:ned")
METRES = finder.Units("of a length here; known is m", {"": None, "m": None})


def find_pose(header: Header, request: Request, source: str) -> PoseColumns | None:
    """Find a position on the Earth and its rotation among the columns; None for rows with x, y, z.

    Raises ValueInvalid for an incomplete position, for heights above sea level, and for several positions.
    """
    groups: Groups = {
        key: {field: next(iter(found[field].values())) for field in found if field in FIELDS}
        for key, found in header.found.items() if not key[1]
    }  # fmt: skip
    every = sorted((place, field) for spots in groups.values() for field, (place, _) in spots.items())
    earth, expected = request.earth or Earth(), request.rows.given_place
    positions = [each for each in finder.find_positions(header) if not each.affixes[0].lower().endswith("ecef_")]
    if not expected and positions:
        names = [(header.names[place], field) for place, field in every]
        said = [name for name, field in names if readers.may_be_on_earth(name) or field == "lon"]
        if not request.operation.keeps_frames and said:
            message = f"{', '.join(said[:2])} stay data: {positions[0].shown} are the position"
            warn(f"{source}: {message}; --columns lat,lon,alt --from lla turns it round")
        return None
    kinds = (expected,) if expected else POSITIONS
    every_place = (_find(kind, header, groups, key, earth) for key in groups for kind in kinds)
    found = [*filter(None, every_place)]
    found = [each for each in found if each.affixes == finder.BARE] or found
    if not found and positions and (place := Place.of_xyz(expected, earth)):
        found = [positions[0]._replace(unit=place)]
    _check_found(found, header.names, {field for _, field in every}, request)
    if not found:
        return None
    (position,) = found
    turned = finder.find_rotations(header.without(position.places), request.rows.given)
    headings = [each for each in header.match((HEADING.name,), angles=(0,)) if each.affixes == position.affixes]
    turned += [finder.rotation_of(each, HEADING, AT_PLACE) for each in headings if each.said != (None,) or each.wrong]
    if headings and not turned:
        warn(f"{source}: {shown(headings[0].shown)} has no unit and stays data; name it heading_deg")
    return finder.paired(header, found, turned)[0]


def _find(kind: str, header: Header, groups: Groups, key: tuple[str, str], earth: Earth) -> Columns | None:
    """Return the columns of a position of one kind; None if they do not exist.

    Raises ValueInvalid for heights that are not above the ellipsoid, and for a missing zone.
    """
    row, spots = POSITIONS[kind], groups[key]
    if kind == UTM and (zone := spots.get(ZONE) or groups.get(finder.BARE, {}).get(ZONE)):
        spots = spots | {ZONE: zone}
    words = zip(row.names, row.columns if kind == ECEF else row.names, strict=True)
    fields = {name: spots.get(word) for name, word in words if name != "alt" and (name != ZONE or ZONE in spots)}
    if None in fields.values() or (kind in LOCAL and earth.origin is None):
        return None  # without an origin east and north are other data
    if kind == UTM and ZONE not in fields and earth.zone is None:
        grammar.refuse_not_read(spots)
        raise ValueInvalid("easting and northing do not say their zone; add a column utm_zone, or give --zone 32N")
    named = {field: header.names[place] for field, (place, _) in spots.items()}
    above = grammar.heights(named) if "alt" in row.names else ()
    return _columns(kind, header, fields | {field: spots[field] for field in above}, spots, earth, key)


def _columns(
    kind: str, header: Header, fields: Mapping[str, Spot | None], spots: Mapping[str, Spot], earth: Earth,
    key: tuple[str, str] = finder.BARE,
) -> Columns:  # fmt: skip
    """Return the columns of a position, with those of the axes, and those that are read but not rewritten."""
    grammar.refuse_not_read(spots)
    fields = {**fields, **{name: spots[name] for name in (AXES, *STAYING) if name in spots}}
    angles = [at for at, field in enumerate(fields) if field in ("lat", "lon")]
    columns = header.columns([*fields.values()], METRES, angles, key)
    names = [name + "_rad" * (said is False) for name, said in zip(fields, columns.said, strict=True)]
    axes, origin = (earth.axes or kind, earth.origin) if kind in LOCAL else (earth.axes, None)
    zone = earth.zone if kind == UTM and ZONE not in fields else None
    return columns._replace(unit=Place(kind, tuple(names), axes, zone, origin))


def _check_found(found: Sequence[Columns], names: Sequence[str], fields: Collection[str], request: Request) -> None:
    """Raise ValueInvalid for several positions, for a missing or incomplete one, and for a zone that has no effect."""
    expected, place = request.rows.given_place, place_of(found[0].unit) if found else None
    if len(found) > 1:
        several = "; ".join(each.shown for each in found)
        raise ValueInvalid(f"several positions on the Earth: {several}; choose with --columns NAMES --from lla")
    if place is not None:
        written = [each.name for each in request.results.place.all] if request.results.place is not None else []
        if expected == UTM and ZONE in place.fields and UTM not in written and request.earth and request.earth.zone:
            raise ValueInvalid("--zone has no effect: each row says its zone")
    elif expected:
        what = f"no columns of {expected} ({' '.join(POSITIONS[expected].columns)}) among: {finder.listed(names)}"
        raise ValueInvalid(f"{what}; name them with --columns")
    elif "mgrs" in fields:
        raise ValueInvalid(grammar.NOT_READ["mgrs"])
    elif ("lat" in fields) != ("lon" in fields):
        missing = "lon" if "lat" in fields else "lat"
        raise ValueInvalid(f"half a place on the Earth: no {missing}; add it, or choose with --columns")
    elif {"east", "north"} <= {*fields}:
        raise ValueInvalid("east, north and up or down are of an origin; give --origin '{lat: .., lon: ..}'")


def chosen_pose(spec: str, names: Sequence[str] | None, width: int, request: Request, _: str) -> PoseColumns:
    """Return the columns in --columns as a position of the kind in --from, followed by a rotation if there are more.

    spec: "" for all columns of a table without names, perhaps after a stamp
    Raises Misused for names that do not exist, or a number of columns that does not fit.
    """
    kind, earth = request.rows.given_place, request.earth or Earth()
    fields = POSITIONS[kind].names[kind == UTM and earth.zone is not None :]
    least = len(fields) - len(POSITIONS[kind].names) + (kernels(kind).least or len(POSITIONS[kind].names))
    spec = spec or f"{1 + (width == len(fields) + 1)}-{width}"
    header, places = finder.places_named(spec, names, width)
    if len(places) < least:
        raise Misused(f"--columns: {kind} has {len(fields)} numbers ({' '.join(fields)}); found {len(places)}")
    for count in range(len(fields), least - 1, -1):
        rotation = finder.named_rotation(header, places[count:], None) if len(places) > count else None
        if rotation or len(places) == count:
            spots = dict(zip(fields, header.spots(places[:count]), strict=False))
            return finder.PoseColumns(_columns(kind, header, spots, {}, earth), rotation)
    behind = ", ".join(header.names[at] for at in places[len(fields) :])
    raise Misused(f"--columns: {behind} are no rotation behind {kind}")


def along(
    place: Place, shape: Shape, names: Sequence[str], places: tuple[int, ...]
) -> tuple[tuple[int, ...], Shape]:
    """Return the columns of the covariance of a position, and the shape with its axes; those of a NavSatFix by default.

    Raises ValueInvalid if neither rows nor options state the axes.
    """
    fix = {int(match[1]): at for at, name in enumerate(names) if (match := FIX_ENTRY.fullmatch(name))}
    if not places and shape.kind == POINT and len(fix) == 9:  # field.position_covariance0, or [0]
        return tuple(fix[at] for at in range(9)), shape._replace(unit=place._replace(axes=ENU))
    if places and not (place.axes or AXES in place.fields):
        raise ValueInvalid(UNSAID.replace("rotation", "covariance").replace("a pose", "a row"))
    return places, shape


def readers_of(shape: Shape) -> tuple[dict[int, Reader], dict[int, Reader], int]:
    """Return the readers of words of a geodetic position and of angles with marks, both by index of the number.

    The third value is the number of last numbers that are read and not rewritten.
    """
    fields = shape.place.fields if shape.place is not None else ()
    words = {at: WORDS[field] for at, field in enumerate(fields) if field in WORDS}
    marked: dict[int, Reader] = {
        at: partial(grammar.coordinate, field=field) for at, field in enumerate(fields) if field in ("lat", "lon")
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
    grammar.check_parent({PARENT: text or None}, {"lat": None})
    return 0.0


WORDS: dict[str, Reader] = {ZONE: zone_number, AXES: _axes, STATUS: _status, PARENT: _parent}


def zone_notes(place: Place, columns: Sequence[Floats], line_of: Callable[[int], int]) -> list[RowNote]:
    """Return the zone of the first result in UTM, and that of the first one in another zone."""
    zones = [columns[at] for at in place.words]
    firsts = [(each, row) for each in zones for row in (0, *(each != each[0]).nonzero()[0][:1].tolist())]
    return [RowNote(line_of(row), ZONES, ZONE_NAMES[int(each[row])]) for each, row in firsts]


def doubt_band(place: Place, columns: Sequence[Floats], line_of: Callable[[int], int]) -> list[RowNote]:
    """Return a warning about the first row whose zone may have the S of a latitude band."""
    fields = dict(zip(place.fields, columns, strict=False))
    if place.name != UTM:
        return []
    northing = fields["northing"]
    zone = fields[ZONE] if place.zone is None else northing * 0.0 + place.zone
    rows = ((zone < 0.0) & (northing >= 3.5e6) & (northing <= 4.5e6)).nonzero()[0][:1].tolist()
    return [RowNote(line_of(at), "band-s", grammar.band_s(float(zone[at]), float(northing[at])), ZONE) for at in rows]


def settle(
    request: Request, shapes: tuple[Shape, ...], table: Table, *, on_earth: bool
) -> tuple[Request, tuple[Shape, ...]]:
    """Check that geodetic rows state axes for rotations and a height, and that results are in the Earth's frame.

    Raises ValueInvalid for a rotation without stated axes.
    """
    operation, asked, names = request.operation, request.results, table.names or ()
    if on_earth and (place := shapes[0].place) is not None:
        shape, earth = shapes[0], request.earth
        reads = operation.moves or not operation.keeps_frames or asked.place is not None or asked.all_numbers
        if shape.kind == VECTOR:
            raise Misused("a vector has no place on the Earth; leave --as vector out")
        if place.name in (LLA, UTM) and not {"alt", "msl"}.intersection(place.fields) and reads:
            warn(f"{table.source}: {grammar.NO_ALT}")
        if operation.keeps_frames and asked.place is None:
            bare = shape.notation is None and all(each.representation.name == "quaternion" for each in asked.notations)
            by_default = asked.default_notation or bare
            request = request.with_results(place=Place.written((ECEF,), Earth()), default_notation=by_default)
        if shape.notation is None and not (operation.inverse or operation.similar):
            has_idle_axes = earth and earth.axes and operation.keeps_frames
            if has_idle_axes and not (asked.all_numbers or any(map(may_be_uncertain, names))):
                raise Misused("--local-axes has no effect: the rows have no rotation")
        elif shape.notation is None or not (place.axes or AXES in place.fields):
            raise ValueInvalid(UNSAID)
        else:  # a heading is relative to the axes at the position
            level = shape.notation.representation is HEADING
            if level and place.axes == ECEF:
                raise ValueInvalid("a heading is clockwise from north, which axes ecef do not have")
            shapes = (shape._replace(unit=place._replace(level=level)),)
    is_formula = operation.formula is not None
    stays = not (is_formula or operation.moves)
    says_itself = stays and (on_earth or not {*readers.PARENT_COLUMNS}.isdisjoint(names))
    if says_itself or (not is_formula and (request.results.place is None or request.rows.frames)):
        return request, shapes  # a look-up checks each row, a formula its own frames
    rename = (request.for_kind(shapes[0].kind) if shapes else request).rename
    frame = None if stays or rename is None else rename(ECEF if on_earth and is_formula else None, None)[0]
    if request.results.place is not None:
        grammar.check_in_ecef(frame, request.results.place)
    return request, shapes


# --- records ---


def is_on_earth(value: dict[str, Any]) -> bool:
    """Return True if a mapping has a position on the Earth, complete or not."""
    return not {*WHOLE, "mgrs", LLA}.isdisjoint(value) and not grammar.EARTH_KEYS.isdisjoint(value)


def placed_record(
    value: dict[str, Any], empty: Record, positions: Sequence[str], inner: Inner, reading: Reading, request: Request
) -> Record | None:
    """Read a record with a position on the Earth, complete or not; None for one with x, y, z.

    empty: the record without numbers; inner: reads the pose in the other keys, and returns it with its keys
    Numbers of lat, lon and alt keep their paths and are replaced in place; no other numbers have paths.
    Raises Misfit for an incomplete or invalid position, and for a pose without stated axes.
    """
    own = [key for key in value if key in grammar.EARTH_KEYS]
    in_ecef = value.get("frame", value.get("parent")) in EARTH_FRAMES
    if grammar.AT not in value and ((positions and not in_ecef) or {"x", "y", "z"} <= value.keys()):
        if request.rows.poses and not request.operation.keeps_frames:
            what = f"{', '.join(own)} stay data: x, y, z are the position"
            reading.note(f"{what}; to read the place, leave these out", own[0], rule="stays")
        return None
    if request.rows.kind == VECTOR:
        raise Misfit("a vector has no place on the Earth; leave --as vector out")
    operation = request.operation
    grammar.check_parent(value, value)
    there, used = inner(grammar.without_place(value))
    mapping = {key: value[key] for key in (*own, AXES_KEY, "parent", "frame", "inverse") if key in value}
    covariance = () if operation.only_adds else _of_fix(value, mapping, reading, request)
    pose = grammar.placed_by(mapping, there, reading)
    if pose.rotation is None and (operation.inverse or operation.similar):
        raise Misfit(UNSAID)  # a factor of a product must be a pose
    is_point = not (pose.rotation or request.rows.kind == POSE) and (operation.takes_points or operation.keeps_frames)
    numbers: tuple[float, ...] = pose.components[: 7 if pose.rotation is not None else 3]
    shape = Shape(POINT if is_point else POSE, 1.0, () if pose.rotation is None else ((notation("quaternion"), False),))
    if covariance and not is_point:  # of a pose with an exact rotation
        covariance = tuple(covariance[3 * i + j] if max(i, j) < 3 else 0.0 for i in range(6) for j in range(6))
    extra, place = covariance, request.results.place
    said = () if extra else pose.covariance or ()
    if (extra or said) and (operation.formula or (place and (said or place.axes != ECEF))):
        reading.note(LEFT_OUT.format("a result at a place" if place else "calc"), rule="left-out")
        extra = ()
    elif said:
        extra = of_position(tuple(said)) if is_point else tuple(said)
    if extra:
        shape = shape._replace(covariance=(len(extra),), sigma=())
    also = (AXES_KEY, *COVARIANCE_KEYS, "header", *(FIX, FIX_TYPE) * bool(covariance))
    keys = [*own, *used, *(key for key in also if key in value)]
    stays = False
    if pose.read and is_point and not extra:
        place, named = pose.read.place, {readers.PLACE_FIELDS.get(key): key for key in keys}
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
    """Return the covariance of a NavSatFix in ECEF, from east, north, up; () if it has none or is unchanged.

    Raises Misfit for a status without a fix.
    """
    status, place = value.get("status"), request.results.place
    if type(status) is dict and status.get("status") == "-1":
        raise readers.NotARotation("status -1: there was no fix", ("status", "status"))
    if FIX not in value or value.get(FIX_TYPE, "1") == "0":
        return ()
    if place is not None and place.axes == ENU and request.operation.keeps_frames:
        if place.origin:
            reading.note(AT_EACH.format(ENU), rule="origin")
        return ()
    entries = [number for _, number in within((FIX,), entries_of, value[FIX], (9,))]
    within((FIX,), check, entries)
    at = grammar.placed_by(mapping | {AXES_KEY: ENU}, Pose(rotation=(0.0, 0.0, 0.0, 1.0)), Reading(reading.source))
    return tuple(uncertainty.rotate_covariance(tuple(entries), *at.components[3:]))
