"""Find a position on the Earth among columns or keys by their names: lat lon alt, ecef_x .., utm_zone easting ..

A common prefix is one that is set off (`field.latitude`, `gps_lat`); units follow names or in brackets.  Knows
names only; loaded where one of them may say such a position.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, Misused, ValueInvalid, shown, warn
from frametool.geometry.earth import AXES as AXES_AT
from frametool.geometry.place import AXES, ECEF, ENU, LLA, LOCAL, NED, UNSAID, UTM, ZONE, Earth, Place, kernels
from frametool.geometry.representations import HEADING, POSITIONS, Notation
from frametool.geometry.transverse_mercator import ZONES as ZONE_NAMES
from frametool.geometry.transverse_mercator import zone_number
from frametool.grammar.names import FIX, FLAT, PARENT_COLUMNS, may_be_on_earth, may_be_uncertain
from frametool.grammar.place import (
    GEOID,
    NO_ALT,
    NOT_READ,
    SAME,
    SEA_LEVEL,
    band_s,
    check_in_ecef,
    check_parent,
    coordinate,
    not_on_ellipsoid,
)
from frametool.stream.faults import ZONES, RowNote
from frametool.stream.header import Columns, Header, PoseColumns, find_positions, find_rotations, listed, places_named
from frametool.stream.row_layout import POINT, VECTOR, place_of
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import TypeAlias

    from frametool.stream.request import Request
    from frametool.stream.row_layout import Shape
    from frametool.text.spans import Floats

    Reader: TypeAlias = Callable[[str], float]

ECEF_COLUMNS = POSITIONS[ECEF].columns
STATUS, DATUM, EPSG, PARENT = "status", "datum", "epsg", "parent"
OTHERS = (*SEA_LEVEL, "easting", "northing", *ECEF_COLUMNS, ZONE, "heading", AXES,
          STATUS, DATUM, EPSG, PARENT)  # fmt: skip
FIELDS = SAME | GEOID | {"utm_zone": ZONE} | {name: name for names in (OTHERS, *FLAT.values()) for name in names}
PATTERN = re.compile(
    rf"[#% ]*((?:.*[._/])??)({'|'.join(sorted(FIELDS, key=len, reverse=True))})"
    r"(?:[_ ]?(deg|rad|e7|m|mm|cm|ft))?\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*",
    re.IGNORECASE,
)
FIX_ENTRY = re.compile(rf"(?:.*[./_])?{FIX}\[?_?([0-8])\]?")
DEGREES = {"": False, "deg": False, "degrees": False, "°": False, "rad": True, "radians": True}


class NamedColumn(NamedTuple):
    """A column: its place, its name, and the unit that this says."""

    place: int
    name: str
    unit: str


def find(names: Sequence[str], earth: Earth, expected: str = "") -> PoseColumns | None:
    """Find the one position on the Earth among names, and a heading with it; None if absent.

    expected: the representation that --from names.
    Raises ValueInvalid for several, for heights that are not above the ellipsoid, and for units that are not known.
    """
    groups: dict[str, dict[str, NamedColumn]] = {}
    for at, name in enumerate(names):
        if name and (match := PATTERN.fullmatch(name)):
            unit = (match[4] if match[4] is not None else match[3] or "").lower()
            prefix, field = match[1].lower(), FIELDS[match[2].lower()]
            if field == STATUS:  # of a NavSatFix: another may be anything
                prefix = prefix.removesuffix("status.") if prefix.endswith("status.") else "another status"
            groups.setdefault(prefix, {}).setdefault(field, NamedColumn(at, name, unit))
    found = [
        (prefix, columns)
        for prefix, spots in groups.items()
        for kind in ((expected,) if expected else POSITIONS)
        if (columns := _position(kind, spots, groups, earth)) is not None
    ]
    if not found:
        return None
    plain = [each for each in found if not each[0]] or found
    if len(plain) > 1:
        several = "; ".join(columns.shown for _, columns in plain)
        raise ValueInvalid(f"several positions on the Earth: {several}; choose with --columns NAMES --from lla")
    prefix, columns = plain[0]
    return PoseColumns(columns, _heading(groups[prefix], columns))


def _position(
    kind: str, spots: dict[str, NamedColumn], groups: dict[str, dict[str, NamedColumn]], earth: Earth
) -> Columns | None:
    """Return the columns of a position of one kind, if they are there."""
    if kind in LOCAL and earth.origin is None:
        return None  # east and north are other data
    if kind == ECEF or kind in FLAT:
        names = ECEF_COLUMNS if kind == ECEF else POSITIONS[kind].names
        axes = zip("xyz" if kind == ECEF else names, names, strict=True)
        there = [(axis, spots[name]) for axis, name in axes if name in spots]
        return _columns(kind, there, spots, earth) if len(there) == len(names) else None
    fields: list[tuple[str, NamedColumn]] = [(name, spots[name]) for name in ("lat", "lon") if name in spots]
    if kind == UTM:
        zone = spots.get(ZONE) or groups.get("utm_", {}).get(ZONE) or groups.get("", {}).get(ZONE)
        spots = {name: spot for name, spot in spots.items() if spot is not zone}
        if zone is None and earth.zone is None and {"easting", "northing"} <= spots.keys():
            _refuse_not_read(spots)
            raise ValueInvalid("easting and northing do not say their zone; add a column utm_zone, or give --zone 32N")
        fields = [(ZONE, zone)] if zone is not None else []
        fields += [(name, spots[name]) for name in ("easting", "northing") if name in spots]
        size = 2 + (zone is not None)
    else:
        fields = [(f"{name}_rad" if _in_radians(spot) else name, spot) for name, spot in fields]
        size = 2
    return None if len(fields) < size else _columns(kind, [*fields, *_height(spots)], spots, earth)


def _height(spots: dict[str, NamedColumn]) -> list[tuple[str, NamedColumn]]:
    """Return the height above the ellipsoid, or that above the sea and the geoid's; raise ValueInvalid without it."""
    if "alt" in spots:
        return [("alt", spots["alt"])]
    name = next((name for name in SEA_LEVEL if name in spots), "")
    if name and "undulation" not in spots:
        raise ValueInvalid(not_on_ellipsoid(spots[name].name))
    return [("msl", spots[name]), ("undulation", spots["undulation"])] if name else []


def _columns(
    kind: str, fields: Sequence[tuple[str, NamedColumn]], spots: dict[str, NamedColumn], earth: Earth
) -> Columns:
    """Put the columns together, with that of the axes."""
    for field, spot in fields:
        if field[:3] not in ("lat", "lon") and spot.unit not in ("", "m"):
            what = f"column {shown(spot.name)}: unknown unit {shown(spot.unit)} of a length here; known is m"
            raise ValueInvalid(what)
    _refuse_not_read(spots)
    axes = [(AXES, spots[AXES])] if AXES in spots else []
    staying = [(name, spots[name]) for name in (STATUS, PARENT) if name in spots]
    fields = [*fields, *axes, *staying]
    zone = earth.zone if kind == UTM and fields[0][0] != ZONE else None
    place = Place(kind, tuple(field for field, _ in fields), earth.axes or kind * (kind in LOCAL), zone,
                  earth.origin if kind in LOCAL else None)  # fmt: skip
    places, names = zip(*((spot.place, spot.name) for _, spot in fields), strict=True)
    return Columns(places, names, unit=place, staying=len(staying))


def _refuse_not_read(spots: dict[str, NamedColumn]) -> None:
    if name := next((name for name in (DATUM, EPSG) if name in spots), None):
        raise ValueInvalid(NOT_READ[name])


def _in_radians(spot: NamedColumn) -> bool:
    if spot.unit not in DEGREES:
        unknown = f"column {shown(spot.name)}: unknown unit {shown(spot.unit)}"
        raise ValueInvalid(f"{unknown}; lat and lon are degrees, or rad")
    return DEGREES[spot.unit]


def _heading(spots: dict[str, NamedColumn], position: Columns) -> Columns | None:
    """Return the rotation that a heading with its unit says."""
    spot = spots.get("heading")
    if spot is None or spot.unit == "" or position.unit is None:
        return None
    radians = _in_radians(spot)
    notation = Notation(f"heading_{'rad' if radians else 'deg'}", HEADING, NED, degrees=not radians)
    return Columns((spot.place,), (spot.name,), notation=notation, degrees=(not radians,))


def unsaid_heading(names: Iterable[str]) -> str:
    """Return the name of a heading whose unit nobody says, so that it stays data; "" without one."""
    matches = ((name, PATTERN.fullmatch(name)) for name in names if name)
    return next((name for name, match in matches if match and match[2].lower() == "heading" and not match[3]
                 and match[4] is None), "")  # fmt: skip


def find_pose(names: Sequence[str], request: Request, source: str) -> PoseColumns | None:
    """Find a position on the Earth and the rotation with it; None for rows that are expressed as x, y, z.

    Raises FormatError for half of one, for heights above the sea, and for a rotation whose axes nobody says.
    """
    matches = {name: FIELDS[match[2].lower()] for name in names if name and (match := PATTERN.fullmatch(name))}
    known = () if request.given_place else ECEF_COLUMNS
    header = Header(["" if matches.get(name) in known else name for name in names])
    earth, expected = request.earth or Earth(), request.given_place
    if not expected and (others := find_positions(header)):
        said = [name for name, field in matches.items() if may_be_on_earth(name) or field == "lon"]
        if not request.operation.keeps_frames and said:
            message = f"{', '.join(said[:2])} stay data: {others[0].shown} are the position"
            warn(f"{source}: {message}; --columns lat,lon,alt --from lla turns it round")
        return None
    try:
        found = find(names, earth, expected)
        if found is None and (place := Place.of_xyz(expected, earth)) and (positions := find_positions(header)):
            found = PoseColumns(positions[0]._replace(unit=place), None)
        if problem := _problem(found, names, request):
            raise ValueInvalid(problem)  # noqa: TRY301 - so that it gets its place as others do
    except ValueInvalid as error:
        raise FormatError(str(error), source=source, line=1) from None
    if found is None or found.position is None:
        return None
    taken = {*found.position.places, *(found.rotation.places if found.rotation else ())}
    rest = Header(["" if at in taken else name for at, name in enumerate(names)])
    turned = find_rotations(rest, request.given)
    if len(turned) + (found.rotation is not None) > 1:
        shown_ = " and ".join(each.shown for each in (*turned, *filter(None, [found.rotation])))
        raise FormatError(f"expected one rotation, found {shown_}", source=source, line=1)
    if found.rotation is None and (name := unsaid_heading(names)) and not turned:
        warn(f"{source}: {shown(name)} has no unit and stays data; name it heading_deg")
    return PoseColumns(found.position, found.rotation or next(iter(turned), None))


def _problem(found: PoseColumns | None, names: Sequence[str], request: Request) -> str:
    """Return why the place of --from, or an incomplete one, cannot be read; "" where all is well."""
    expected = request.given_place
    if found is None:
        row = POSITIONS.get(expected)
        missing = row and f"no columns of {expected} ({' '.join(row.columns)}) among: {listed(names)}"
        return f"{missing}; name them with --columns" if missing else _half(names)
    place = place_of(found.position.unit) if found.position else None
    is_held = request.earth is not None and request.earth.zone is not None
    asked = [each.name for each in (request.place, *request.place.more)] if request.place else []
    if is_held and expected == UTM and place and ZONE in place.fields and UTM not in asked:
        return "--zone has no effect: each row says its zone"
    return ""


def _half(names: Iterable[str]) -> str:
    """Return what is missing of a position that is there by half; "" if absent."""
    if any(name.lower().rpartition(".")[2] == "mgrs" for name in names):
        return NOT_READ["mgrs"]
    fields = {FIELDS[match[2].lower()] for name in names if name and (match := PATTERN.fullmatch(name))}
    if len(fields & {"lat", "lon"}) == 1:
        missing = "lon" if "lat" in fields else "lat"
        return f"half a place on the Earth: no {missing}; add it, or choose with --columns"
    if {"east", "north"} <= fields:
        return "east, north and up or down are of an origin; give --origin '{lat: .., lon: ..}'"
    return ""


def chosen_pose(spec: str, names: Sequence[str] | None, width: int, request: Request) -> PoseColumns:
    """Take the columns that --columns names for a place, as --from says, and a rotation behind it.

    Raises Misused for names that are not there, or a count that the place does not have.
    """
    called, places = places_named(spec, names, width)
    kind, earth = request.given_place, request.earth or Earth()
    most = _count(kind, earth)
    fields = POSITIONS[kind].names[-most:]
    own = places[:most]
    if len(own) < (kernels(kind).least or len(fields)) - (kind == UTM and earth.zone is not None):
        raise Misused(f"--columns: {kind} has {most} numbers ({' '.join(fields)}); found {len(own)}")
    spots = [NamedColumn(place, called[place], "") for place in own]
    try:
        position = _columns(kind, [*zip(fields, spots, strict=False)], {}, earth)
    except ValueInvalid as error:
        raise Misused(f"--columns: {error}") from None
    behind = places[most:]
    turned = find_rotations(Header([name if at in behind else "" for at, name in enumerate(called)]), None)
    if behind and len(turned) != 1:
        others = ", ".join(called[at] for at in behind)
        raise Misused(f"--columns: {others} are no rotation behind {request.given_place}")
    return PoseColumns(position, turned[0] if turned else None)


def of_width(width: int, request: Request) -> str:
    """Return which columns of a table without names are a place: all of them, or those behind a stamp."""
    return f"2-{width}" if width == _count(request.given_place, request.earth or Earth()) + 1 else f"1-{width}"


def _count(kind: str, earth: Earth) -> int:
    """Count the numbers of a position, of UTM without the zone where that is held."""
    return len(POSITIONS[kind].names) - (kind == UTM and earth.zone is not None)


def along(
    shape: Shape, names: Sequence[str], places: tuple[int, ...], source: str
) -> tuple[tuple[int, ...], Shape]:
    """Return what the covariance with a place is expressed in; that of a NavSatFix is, where nothing else is there.

    Raises FormatError where nobody says so.
    """
    place = shape.place
    if place is None:
        return places, shape
    fix = {int(match[1]): at for at, name in enumerate(names) if (match := FIX_ENTRY.fullmatch(name))}
    if not places and shape.kind == POINT and len(fix) == 9:  # field.position_covariance0, or [0]
        return tuple(fix[at] for at in range(9)), shape._replace(unit=place._replace(axes=ENU))
    if places and not (place.axes or AXES in place.fields):
        raise FormatError(UNSAID.replace("rotation", "covariance").replace("a pose", "a row"), source=source, line=1)
    return places, shape


def readers_of(shape: Shape) -> tuple[dict[int, Reader], dict[int, Reader]]:
    """Return what reads the words of a place, by the number's place, and what its angles with marks."""
    fields = shape.place.fields if shape.place is not None else ()
    words = {at: WORDS[field] for at, field in enumerate(fields) if field in WORDS}
    return words, {at: partial(coordinate, field=field) for at, field in enumerate(fields) if field in ("lat", "lon")}


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


WORDS: dict[str, Reader] = {
    ZONE: zone_number, AXES: _axes, STATUS: _status, PARENT: _parent
}


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


def check_rows(
    request: Request, shapes: tuple[Shape, ...], names: Sequence[str], source: str
) -> tuple[Request, tuple[Shape, ...]]:
    """Check what rows on the Earth need: axes for rotations, a height; a heading is one in those axes.

    Raises FormatError for a rotation whose axes nobody says.
    """
    (shape,) = shapes
    place = shape.place
    if place is None:
        return request, shapes
    reads = request.operation.moves or not request.operation.keeps_frames or request.place is not None
    if shape.kind == VECTOR:
        raise Misused("a vector has no place on the Earth; leave --as vector out")
    if place.name in (LLA, UTM) and not {"alt", "msl"}.intersection(place.fields) and (reads or request.all_numbers):
        warn(f"{source}: {NO_ALT}")
    if request.gathered is not None:
        request.gathered.frame = ECEF
    if request.operation.keeps_frames and request.place is None:
        bare = shape.notation is None and all(each.representation.name == "quaternion" for each in request.notations)
        request = request._replace(place=Place.written((ECEF,), Earth()), by_default=request.by_default or bare)
    if shape.notation is None and not (request.operation.inverse or request.operation.similar):
        has_idle_axes = request.earth and request.earth.axes and request.operation.keeps_frames
        if has_idle_axes and not (request.all_numbers or any(map(may_be_uncertain, names))):
            raise Misused("--local-axes has no effect: the rows have no rotation")
        return request, shapes
    if shape.notation is None or not (place.axes or AXES in place.fields):
        raise FormatError(UNSAID, source=source, line=1)
    level = shape.notation.representation is HEADING
    if level and place.axes == ECEF:
        raise FormatError("a heading is clockwise from north, which axes ecef do not have", source=source, line=1)
    return request, (shape._replace(unit=place._replace(level=level)),)


def settle(
    request: Request, shapes: tuple[Shape, ...], names: Sequence[str], source: str, *, on_earth: bool
) -> tuple[Request, tuple[Shape, ...]]:
    """Check what rows on the Earth need; stop where places are asked for of results whose frame is not the Earth's.

    Raises FormatError, CalcError.
    """
    if on_earth:
        request, shapes = check_rows(request, shapes, names, source)
    operation = request.operation
    is_formula = operation.formula is not None
    stays = not (is_formula or operation.moves)
    says_itself = stays and (on_earth or not {*PARENT_COLUMNS}.isdisjoint(names))
    if says_itself or (not is_formula and (request.place is None or request.frames)):
        return request, shapes  # a look-up looks at each row, an expression at its own frames
    rename = (request.for_kind(shapes[0].kind) if shapes else request).rename
    frame = None if stays or rename is None else rename(ECEF if on_earth and is_formula else None, None)[0]
    try:
        if request.place is not None:
            check_in_ecef(frame, request.place)
    except ValueInvalid as error:
        raise FormatError(str(error), source=source, line=1) from None
    return request, shapes
