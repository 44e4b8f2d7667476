"""Notations of positions on the Earth: latitude and longitude, ECEF, UTM, local axes; conversion to ECEF and back.

A `Place` defines the meaning of numbers, as a unit does for lengths, and the axes of their rotations.  Knows numbers
only, floats or arrays of one shape; a zone of UTM is a number, as in `transverse_mercator`.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid
from frametool.geometry import earth, floats, quaternion, rigid
from frametool.geometry.floats import RADIAN, SQRT_HALF, nearest
from frametool.geometry.representations import POSITIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Self

    from frametool.geometry import Components, Namespace, Rigid, Vector

ECEF, ENU, NED, GRID = "ecef", "enu", "ned", "grid"  # axes; ENU and NED are notations too, with an origin
LLA, UTM = "lla", "utm"
LOCAL = (ENU, NED)
ZONE, AXES = "zone", "axes"  # written as words
SAMPLE = 0.5  # a number that is not a zone
ROUNDING = 1e-6  # metres or degrees: a computed number this close to the one that was read is unchanged
EDGE, END = 1e-11, 1e-13  # degrees: 1 micrometre, where zones meet, and 1e-8 m, where UTM ends; both at whole degrees
GRIDDED = ("convergence_deg", "grid_scale")  # results have them in addition to UTM's numbers
UNSAID = (
    "a pose at lat, lon does not state the axes of its rotation; "
    "axes: enu, ned, grid or ecef; for rows --local-axes"
)


class Origin:
    """The origin of enu and ned: a fixed position, or the first one that is written.

    tell: reports the origin once it is set by a position
    """

    __slots__ = ("place", "tell")

    def __init__(self, place: Vector | None = None, tell: Callable[[Vector], None] | None = None) -> None:
        """Store lat, lon, alt; None for the first position."""
        self.place = place
        self.tell = tell

    def settle(self, x: Any, y: Any, z: Any) -> None:
        """Use the first finite position in ECEF as the origin, unless it is set."""
        if self.place is not None:
            return
        rows = zip(*(part.tolist() if hasattr(part, "tolist") else [part] for part in (x, y, z)), strict=True)
        for row in rows:
            found = earth.lla(row[0], row[1], row[2], floats)
            if all(map(isfinite, found)):
                lat, lon, alt = found
                self.place = found = round(lat, 13), round(lon, 13), round(alt, 8)  # short to print: 10 nm
                if self.tell is not None:
                    self.tell(found)
                return

    def pose(self, axes: str) -> Rigid:
        """Return ecef_from_axes at the origin."""
        if self.place is None:
            raise ValueInvalid("there is no position to take for the origin")
        return earth.pose(*self.place, axes, floats)


class Place(NamedTuple):
    """A notation of positions on the Earth, with the axes of rotations.

    name: of its row of POSITIONS
    fields: the meaning of each of its numbers, in order
    axes: of rotations: enu, ned, grid, ecef; "" if not stated, or if each row has its own among its numbers
    level: rotations are headings: about down, which is the opposite direction in a frame with z up
    zone: of UTM, common to all; None if each position has its own among its numbers
    origin: of enu and ned
    more: further notations of a result
    """

    name: str
    fields: tuple[str, ...]
    axes: str = ""
    zone: float | None = None
    origin: Origin | None = None
    more: tuple[Place, ...] = ()
    level: bool = False

    @classmethod
    def written(cls, names: Sequence[str], earth_: Earth) -> Place:
        """Return the notation of results from the names of representations."""
        made = []
        for name in names:
            if name in LOCAL and earth_.origin is None:
                raise ValueInvalid(f"--to {name} needs --origin: {{lat: .., lon: ..}}, or first for the first position")
            fields = POSITIONS[name].names
            axes = ECEF if name == ECEF else name if name in LOCAL else earth_.axes or kernels(name).axes
            made.append(cls(name, fields, axes, earth_.zone, earth_.origin if name in LOCAL else None))
        return made[0]._replace(more=tuple(made[1:]))

    @classmethod
    def of_xyz(cls, name: str, said: Earth) -> Place | None:
        """Return the notation of x, y, z: in ecef, in the fixed zone, or in the local axes of the origin; else None.

        Raises ValueInvalid for local axes without an origin.
        """
        if name == UTM and said.zone is not None:
            return cls(name, POSITIONS[name].names[1:], said.axes, said.zone)
        if name not in (ECEF, *LOCAL):
            return None
        if name in LOCAL and said.origin is None:
            raise ValueInvalid(f"--from {name} needs --origin: {{lat: .., lon: ..}}")
        return cls(name, POSITIONS[name].names, name, None, said.origin if name in LOCAL else None)

    @property
    def all(self) -> tuple[Place, ...]:
        """Return the notations of a result: this one, then the others."""
        return (self, *self.more)

    @property
    def size(self) -> int:
        """Return the number of its fields."""
        return sum(len(each.fields) for each in self.all)

    @property
    def is_local(self) -> bool:
        """Return True if one of its notations has an origin."""
        return any(each.origin is not None for each in self.all)

    @property
    def sample(self) -> tuple[float, ...]:
        """Return example numbers, also for fields that are written as words."""
        return (SAMPLE,) * self.size

    @property
    def columns(self) -> tuple[str, ...]:
        """Return the column names of its fields."""
        found: list[str] = []
        for each in self.all:
            row = POSITIONS[each.name]
            own = dict(zip(row.names, row.columns, strict=True))
            found += (own.get(field, field) for field in each.fields)
        return tuple(found)

    @property
    def words(self) -> dict[int, tuple[str, ...]]:
        """Return the words for numbers that are written as words, by the index of the field: zones."""
        fields = [field for each in self.all for field in each.fields]
        return {at: earth.ZONES for at, field in enumerate(fields) if field == ZONE}

    def with_grid(self, *, gridded: bool) -> Place:
        """Return the same with or without convergence and scale in addition to UTM."""
        size = len(self.fields) - len(GRIDDED) * (GRIDDED[0] in self.fields)
        fields = self.fields[:size] + GRIDDED * (gridded and self.name == UTM)
        return self._replace(fields=fields, more=tuple(each.with_grid(gridded=gridded) for each in self.more))

    # --- reading ---

    def lla(self, numbers: Sequence[Any]) -> Vector:
        """Return lat, lon in degrees and alt from its numbers."""
        xp, row = namespace(numbers), kernels(self.name)
        found = row.read(self, self.named(numbers), xp)
        return found if row.is_angular else earth.lla(*found, xp)

    def ecef(self, numbers: Sequence[Any]) -> Vector:
        """Return x, y, z in ECEF from its numbers; NaN for an invalid position; `check` raises the reason."""
        xp, row = namespace(numbers), kernels(self.name)
        found = row.read(self, self.named(numbers), xp)
        return earth.ecef(*found, xp) if row.is_angular else found

    def named(self, numbers: Sequence[Any]) -> dict[str, Any]:
        """Return its numbers by field."""
        return dict(zip(self.fields, numbers, strict=True))

    def turned(self, numbers: Sequence[Any], rotation: Components) -> Components:
        """Return in ECEF a rotation that is relative to the local axes, as x y z w."""
        if AXES in self.fields:
            at = self.fields.index(AXES)  # rotations are relative to the axes of each row
            codes, others = numbers[at], [*numbers[:at], *numbers[at + 1 :]]
            bare = self._replace(fields=(*self.fields[:at], *self.fields[at + 1 :]))
            xp = namespace(numbers)
            found: Components = rotation
            for code, axes in enumerate(earth.AXES):
                if xp.some(codes == code):
                    each = bare._replace(axes=axes).turned(others, rotation)
                    found = tuple(xp.where(codes == code, a, b) for a, b in zip(each, found, strict=True))
            return found
        if self.axes == ECEF:
            return tuple(rotation)
        if self.level and self.axes != NED:  # a heading is about down: yaw = 90 degrees - it where z is up
            _, _, s, c = rotation
            rotation = quaternion.settled(0.0 * s, 0.0 * s, SQRT_HALF * (c - s), SQRT_HALF * (c + s))
        return quaternion.compose(*self._axes_at(numbers), *rotation)

    def base(self, numbers: Sequence[Any]) -> Components:
        """Return ecef_from_axes at the position."""
        return (*self.ecef(numbers), *self._axes_at(numbers))

    def _axes_at(self, numbers: Sequence[Any]) -> Components:
        """Return the rotation of `base`."""
        if self.name in LOCAL and self.axes == self.name and self.origin is not None:
            return self.origin.pose(self.name)[3:]
        lat, lon, _ = self.lla(numbers)
        return self._turn_at(lat, lon, self.named(numbers).get(ZONE, self.zone), namespace(numbers))

    def _turn_at(self, lat: Any, lon: Any, zone: Any, xp: Namespace) -> Components:
        """Return the rotation of its axes at a latitude and longitude."""
        convergence = earth.utm(_held(zone, lat, lon, xp), lat, lon, xp)[2] if self.axes == GRID else None
        return earth.ecef_from_axes(lat, lon, self.axes, xp, convergence)

    def check(self, numbers: Sequence[float]) -> None:
        """Raise ValueInvalid unless floats are a valid position."""
        named = self.named(numbers)
        if self.name == UTM:
            earth.check_grid(named[ZONE] if self.zone is None else self.zone, named["easting"], named["northing"])
        elif kernels(self.name).is_angular:
            earth.check_lla(*self.lla(numbers))
        if GRID in (self.axes, AXES in named and earth.AXES[int(named[AXES])]):
            lat, lon, _ = self.lla(numbers)
            earth.check_utm(_held(named.get(ZONE, self.zone), lat, lon, floats), lat, lon)

    # --- writing ---

    def settle(self, x: Any, y: Any, z: Any) -> None:
        """Use the first of positions in ECEF as the origin, if requested."""
        for each in self.all:
            if each.origin is not None:
                each.origin.settle(x, y, z)

    def numbers(self, x: Any, y: Any, z: Any, read: Spot | None = None) -> list[Any]:
        """Return its numbers for a position in ECEF; NaN if it has none; `check_result` raises the reason.

        read: the position as it was read, if unchanged: it is not converted through ECEF
        """
        xp = namespace((x, y, z))
        lla: Components = ()
        if read is not None and kernels(read.place.name).is_angular:
            lat, lon, alt = read.place.lla(read.numbers)
            lla = lat, earth.eastward(lon, xp), earth.with_latitude(x, y, z, alt, xp)
        found: list[Any] = []
        for each in self.all:
            row = kernels(each.name)
            if each.origin is not None:
                each.origin.settle(x, y, z)
            if row.is_angular:
                lla = lla or earth.lla(x, y, z, xp)
            own = row.write(each, lla if row.is_angular else (x, y, z), xp)[: len(each.fields)]
            if read is not None and (read.place.name, read.place.origin) == (each.name, each.origin):
                as_read = read.place.named(read.numbers)  # where the computed number differs only by rounding
                pairs = zip((as_read.get(field) for field in each.fields), own, strict=True)
                own = tuple(b if a is None else xp.where(abs(a - b) <= ROUNDING, a, b) for a, b in pairs)
            found += own
        return found

    def local(self, x: Any, y: Any, z: Any, rotation: Components) -> Components:
        """Return a rotation in ECEF, as x y z w, relative to the axes at a position in ECEF."""
        if self.axes == ECEF:
            return rotation
        if self.origin is not None:
            base = self.origin.pose(self.axes)[3:]
        else:
            xp = namespace((x, y, z))
            lat, lon, _ = earth.lla(x, y, z, xp)
            base = self._turn_at(lat, lon, self.zone, xp)
        return quaternion.compose(*quaternion.conjugate(*base), *rotation)

    def check_result(self, x: float, y: float, z: float) -> None:
        """Raise ValueInvalid unless a position in ECEF can be written in this notation."""
        for each in self.all:
            if kernels(each.name).is_angular:
                earth.check_ecef(x, y, z)
            if each.name == UTM or each.axes == GRID:
                lat, lon, _ = earth.lla(x, y, z, floats)
                earth.check_utm(_held(each.zone, lat, lon, floats), _edged(lat, END, floats), lon)

    def entry(self, numbers: Sequence[Any]) -> dict[str, Any]:
        """Return its numbers as the keys of a mapping."""
        found: dict[str, Any] = {}
        rest = iter(numbers)
        for each in self.all:
            own = dict(zip(each.fields, rest, strict=False))
            if each.name == UTM:
                own = {UTM: own | {ZONE: own[ZONE] if own[ZONE] == SAMPLE else earth.ZONES[int(own[ZONE])]}}
            found |= {ECEF: [*own.values()]} if each.name == ECEF else own
        return found


class Spot(NamedTuple):
    """A position as it was read: its notation, and its numbers."""

    place: Place
    numbers: Sequence[Any]

    @property
    def ecef(self) -> Vector:
        """Return x, y, z in ECEF."""
        return self.place.ecef(self.numbers)


class Unmoved(tuple[Any, ...]):  # noqa: SLOT001 - the slots of a tuple cannot be added to
    """The components of a result at the position of its row as it was read: `read`."""

    read: Spot

    def __new__(cls, parts: Components, read: Spot) -> Self:
        """Create from both."""
        made = super().__new__(cls, parts)
        made.read = read
        return made


def spot_of(lla: Sequence[Any]) -> Spot:
    """Return latitude, longitude and height as a position that was read."""
    return Spot(Place(LLA, ("lat", "lon", "alt")), tuple(lla))


class Kernels(NamedTuple):
    """The arithmetic of a row of POSITIONS.

    read: takes a place, its numbers by field and a namespace, and returns lat, lon and alt; or x, y, z in ECEF
    write: takes the place, these three and a namespace, and returns its numbers
    is_angular: these are lat, lon, alt, without a conversion through ECEF
    least: the minimum count of numbers; axes: default axes of rotations
    is_nested: a mapping has the numbers below its name
    """

    read: Callable[[Place, dict[str, Any], Namespace], Vector]
    write: Callable[[Place, Components, Namespace], Components] = lambda _place, three, _xp: three
    is_angular: bool = True
    least: int | None = None
    axes: str = ENU
    is_nested: bool = False


def _read_lla(_: Place, named: dict[str, Any], _xp: Namespace) -> Vector:
    lat, lon = (named[f"{name}_rad"] * RADIAN if f"{name}_rad" in named else named[name] for name in ("lat", "lon"))
    return lat, lon, _height(named, lat)


def _read_utm(place: Place, named: dict[str, Any], xp: Namespace) -> Vector:
    east = named["easting"]
    zone = named[ZONE] if place.zone is None else place.zone + (east - east)
    return *earth.lat_lon(zone, east, named["northing"], xp), _height(named, east)


def _write_utm(place: Place, lla: Components, xp: Namespace) -> Components:
    lat, lon, alt = lla
    zone = _held(place.zone, lat, lon, xp)
    ends = xp.where(abs(lat) > 79.5, _edged(lat, END, xp), lat)
    easting, northing, *grid = earth.utm(zone, ends, lon, xp)
    return zone, easting, northing, alt, *grid


def _read_local(place: Place, named: dict[str, Any], _: Namespace) -> Vector:
    """Return x, y, z of axes at the origin; missing numbers are 0."""
    zero = next(iter(named.values())) * 0.0
    return rigid.apply(*_origin(place), *(named.get(name, zero) for name in POSITIONS[place.name].names))


def _write_local(place: Place, xyz: Components, _: Namespace) -> Components:
    return earth.seen_from(*_origin(place), *xyz)


def _origin(place: Place) -> Rigid:
    if place.origin is None:
        raise ValueInvalid(f"{place.name} needs an origin")
    return place.origin.pose(place.name)


LLA_KERNELS = Kernels(_read_lla, least=2)
UTM_KERNELS = Kernels(_read_utm, _write_utm, least=3, axes=GRID, is_nested=True)
LOCAL_KERNELS = Kernels(_read_local, _write_local, is_angular=False)
ECEF_KERNELS = Kernels(
    lambda _, named, _xp: (named["x"], named["y"], named["z"]), is_angular=False, axes=ECEF, is_nested=True
)


@cache
def kernels(name: str) -> Kernels:
    """Return the arithmetic of a row of POSITIONS."""
    module, _, found = POSITIONS[name].kernels.partition(":")
    return getattr(import_module(module), found)  # type: ignore[no-any-return]


def _height(named: dict[str, Any], other: Any) -> Any:
    """Return the height above the ellipsoid, by default 0."""
    return named["msl"] + named["undulation"] if "msl" in named else named.get("alt", other - other)


class Earth(NamedTuple):
    """Options for all positions on the Earth in one run.

    origin: of enu and ned; axes: of rotations; zone: of UTM, fixed for all
    """

    origin: Origin | None = None
    axes: str = ""
    zone: float | None = None


def _held(zone: Any, lat: Any, lon: Any, xp: Namespace) -> Any:
    """Return the fixed zone, or that of each position; one at an edge is inside in spite of rounding."""
    if zone is None:
        return earth.standard_zone(_edged(lat, EDGE, xp), _edged(lon, EDGE, xp), xp)
    return zone + (lat - lat)


def _edged(angle: Any, near: float, xp: Namespace) -> Any:
    """Return whole degrees for an angle this close to them."""
    whole = nearest(angle)
    return xp.where(abs(angle - whole) <= near, whole, angle)


def namespace(numbers: Sequence[Any]) -> Namespace:
    """Return the namespace for numbers: floats, or arrays."""
    if all(type(number) is float for number in numbers):
        return floats
    from frametool.geometry import arrays

    return arrays

