"""Positions on the Earth, WGS84: latitude and longitude in degrees, metres above the ellipsoid, ECEF, UTM, local axes.

    import frametool
    ecef_from_map = frametool.earth_pose(48.1, 11.5, 520.0)            # axes east, north, up at this position
    xyz = frametool.ecef_from_lla(48.1, 11.5, 521.0)
    ecef_from_map.inverse().apply(xyz)                                  # 1 m up

`ecef` is the Earth's frame: x to lat 0 lon 0, z to the north pole.  alt is metres above the ellipsoid, as in NavSatFix,
not above sea level.  lat is in [-90, 90], lon in [-180, 360] as input and (-180, 180] as output.

Kernels: only + - * / and square roots, and this package's own sines and arc tangents: floats and arrays give the same
bits.  Invalid positions become NaN; `check_lla`, `check_ecef`, `check_utm` and `check_grid` raise the reason.  Knows
numbers only; components are floats or arrays of one shape.  The public functions at the end take lists and arrays too,
which broadcast; a single position is plain floats, without numpy.  They raise ValueInvalid for an invalid position.

A zone of UTM is a number, 1 to 60, negative for the south: 32.0 is 32N, -32.0 is 32S; lat 0 is north.  Krueger's series
to n^6, whose truncation is below a nanometre 30 degrees from the meridian.

Source: Krueger 1912; Karney 2011, Transverse Mercator with an accuracy of a few nanometers, eq. 7 to 36;
Karney 2024, On auxiliary latitudes, for the conformal latitude.
"""

from __future__ import annotations

from math import factorial, isnan, nan

from frametool.errors import ValueInvalid, shown
from frametool.geometry import floats, quaternion, validation
from frametool.geometry.floats import RADIAN, SQRT_HALF, bearing, half_sincos_deg, incline, nearest, polynomial
from frametool.geometry.quaternion import TINY

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from frametool.geometry import Components, Four, Functions, N, Numbers, Seven, Three, Two
    from frametool.geometry.transform import Transform

A, F = 6378137.0, 1.0 / 298.257223563  # the equator's radius in metres, and the flattening
E2, EC = F * (2.0 - F), 1.0 - F  # the eccentricity squared; the polar radius over the equator's
NEAREST, FURTHEST = 1e5**2, 1e20**2  # m^2 from the centre: below, normals cross (up to 43 km); above, powers overflow
STEPS = 3  # of Halley: the third step is the last that changes anything, from 100 km to beyond 1e9 km
AXES = "enu", "ned", "grid", "ecef"


def sincos_deg(angle: N, xp: Functions[N]) -> Two[N]:
    """Return sine and cosine of an angle in degrees; exact at multiples of 90."""
    return half_sincos_deg(2.0 * angle, xp)


def within(value: N, least: float, most: float, xp: Functions[N]) -> N:
    """Return numbers that are between two bounds, NaN for others."""
    centre, reach = 0.5 * (least + most), 0.5 * (most - least)
    if xp.furthest(value, centre) <= reach:
        return value
    return xp.where(abs(value - centre) <= reach, value, nan)


def ecef(lat: N, lon: N, alt: N, xp: Functions[N]) -> Three[N]:
    """Return x, y, z in metres from latitude, longitude in degrees and metres above the ellipsoid; error <= 2 eps."""
    sine, cosine = sincos_deg(within(lat, -90.0, 90.0, xp), xp)
    east, front = sincos_deg(within(lon, -180.0, 360.0, xp), xp)
    normal = A / xp.sqrt(1.0 - E2 * sine * sine)
    radius = (normal + alt) * cosine
    return radius * front + 0.0, radius * east + 0.0, (normal * (1.0 - E2) + alt) * sine + 0.0


def lla(x: N, y: N, z: N, xp: Functions[N]) -> Three[N]:
    """Return latitude, longitude in degrees and metres above the ellipsoid; lon in (-180, 180], 0 at a pole.

    NaN within 100 km of the centre, where the latitude is not unique.
    Source: Fukushima 2006, Halley's method on the sine and cosine of the reduced latitude; three steps suffice.
    """
    axial = xp.sqrt(x * x + y * y)
    run, rise = xp.maximum(axial / A, 1e-18), (EC / A) * z
    sine, cosine = rise, EC * run
    for step in range(STEPS):
        if step:
            sine, cosine = _unit(sine, cosine, xp)
        sine, cosine = _halley(run, rise, sine, cosine, xp)
    sine, cosine = _unit(sine, EC * cosine, xp)
    alt = axial * cosine + z * sine - A * xp.sqrt(1.0 - E2 * sine * sine)
    alt = with_latitude(x, y, z, alt, xp)
    lon = bearing(y + 0.0, x + 0.0, xp.maximum(axial, TINY), xp) * RADIAN
    return incline(sine, cosine, xp) * RADIAN + 0.0, eastward(lon, xp), alt + 0.0


def with_latitude(x: N, y: N, z: N, alt: N, xp: Functions[N]) -> N:
    """Return the height of positions in ECEF that have a latitude, NaN for others."""
    squared = x * x + y * y + z * z
    if xp.least(squared) >= NEAREST and xp.furthest(squared) <= FURTHEST:
        return alt
    return xp.where((squared >= NEAREST) & (squared <= FURTHEST), alt, nan)


def _halley(run: N, rise: N, sine: N, cosine: N, xp: Functions[N]) -> Two[N]:
    """Return a refined sine and cosine of the reduced latitude, times a common factor."""
    length = xp.sqrt(sine * sine + cosine * cosine)
    cubed = length * length * length
    squared = cosine * cosine
    bend = (1.5 * E2) * sine * squared * ((run * sine - rise * cosine) * length - E2 * sine * cosine)
    above = rise * cubed + E2 * sine * sine * sine
    below = run * cubed - E2 * squared * cosine
    return above * below - bend * sine, below * below - bend * cosine


def _unit(sine: N, cosine: N, xp: Functions[N]) -> Two[N]:
    length = xp.sqrt(sine * sine + cosine * cosine)
    return sine / length, cosine / length


def eastward(lon: N, xp: Functions[N]) -> N:
    """Return a longitude of -360 to 360 degrees, wrapped to (-180, 180]."""
    if xp.furthest(lon) < 180.0:
        return lon + 0.0
    return lon - xp.where(lon > 180.0, 360.0, xp.where(lon <= -180.0, -360.0, 0.0))


def ecef_from_axes(lat: N, lon: N, axes: str, xp: Functions[N], convergence_deg: N | None = None) -> Four[N]:
    """Return the quaternion of axes at a position, with the canonical sign; at a pole lon defines them.

    Those of enu are rotated about z by 90 degrees + lon, then about x by 90 degrees - lat, with the right angles
    written out: exact where lat and lon are multiples of 90.

    axes: one of `AXES`
    convergence_deg: for grid axes, the angle of grid north clockwise of true north
    """
    if axes == "ecef":
        zero = 0.0 * lat + 0.0
        return zero, zero, zero, zero + 1.0
    s1, c1 = half_sincos_deg(lon, xp)
    s2, c2 = half_sincos_deg(lat, xp)
    back, ahead, down, up = 0.5 * (c1 - s1), 0.5 * (c1 + s1), c2 - s2, c2 + s2
    x, y, z, w = quaternion.settled(back * down, ahead * down, ahead * up, back * up)
    if axes == "ned":  # the product with enu_from_ned
        x, y, z, w = SQRT_HALF * x, SQRT_HALF * y, SQRT_HALF * z, SQRT_HALF * w
        x, y, z, w = quaternion.settled(w - z, w + z, x - y, 0.0 - x - y)
    elif convergence_deg is not None:  # with enu_from_grid, a rotation about z by minus the convergence
        s, c = half_sincos_deg(convergence_deg, xp)
        x, y, z, w = quaternion.settled(x * c - y * s, y * c + x * s, z * c - w * s, w * c + z * s)
    return xp.canonical_sign(x + 0.0, y + 0.0, z + 0.0, w + 0.0)


def pose(lat: N, lon: N, alt: N, axes: str, xp: Functions[N], convergence_deg: N | None = None) -> Seven[N]:
    """Return ecef_from_axes at a position, by `ecef` and `ecef_from_axes`: x, y, z and the quaternion."""
    tx, ty, tz = ecef(lat, lon, alt, xp)
    x, y, z, w = ecef_from_axes(lat, lon, axes, xp, convergence_deg)
    return tx, ty, tz, x, y, z, w


def seen_from(tx: N, ty: N, tz: N, x: N, y: N, z: N, w: N, px: N, py: N, pz: N) -> Three[N]:
    """Return a point of ecef in the axes of a pose in ecef; subtracting before rotating halves the rounding error."""
    qx, qy, qz, qw = quaternion.conjugate(x, y, z, w)
    return quaternion.rotate(qx, qy, qz, qw, px - tx, py - ty, pz - tz)


def check_lla(lat: float, lon: float, alt: float = 0.0) -> None:  # noqa: ARG001 - every finite alt will do
    """Raise ValueInvalid unless finite numbers are a position on the Earth."""
    if abs(lat) > 90.0:
        raise ValueInvalid(f"lat {lat!r} is beyond 90 degrees; are lat and lon swapped?")
    if not -180.0 <= lon <= 360.0:
        raise ValueInvalid(f"lon {lon!r} is beyond -180 to 360 degrees; give it within")


def check_ecef(x: float, y: float, z: float) -> None:
    """Raise ValueInvalid unless finite numbers have a latitude."""
    squared = x * x + y * y + z * z
    place = f"ecef {x:.9g} {y:.9g} {z:.9g}"
    if squared < NEAREST:
        raise ValueInvalid(f"{place} is within 100 km of the Earth's centre and has no lat; are these metres?")
    if not squared <= FURTHEST:
        raise ValueInvalid(f"{place} is farther than 1e+20 m from the Earth; are these metres?")


# --- UTM ---

SOUTH, NORTH, REACH = -80.0, 84.0, 30.0  # degrees: where UTM ends, and how far a fixed zone may reach
SLACK = 1e-4  # degrees, 11 m: a position at the edge that was written in whole metres can still be read
WIDEST = 0.6  # Krueger's eta in radians, above that of 30 degrees on the equator, 0.55
FALSE_EASTING, FALSE_NORTHING = 5e5, 1e7
ZONES = "", *(f"{zone}N" for zone in range(1, 61)), *(f"{zone}S" for zone in range(60, 0, -1))  # -32 is 32S too
N3 = F / (2.0 - F)  # the third flattening, called n
RADIUS = 0.9996 * A / (1.0 + N3) * (1.0 + N3**2 / 4 + N3**4 / 64 + N3**6 / 256)  # of the meridian, scaled
# Sums of c_k sin 2kx, over sin 2x, as polynomials in cos 2x; the c_k are series in n, whose fractions the tests have.
# Of conformal coordinates along the meridian, with the derivative, and back (Karney 2011, eq. 35 and 36):
ALONG = (
    0.0008377306229846783, 1.5216958381214998e-06, 4.790513472225676e-09, 1.9432887699936867e-11,
    9.138812284585286e-14, 4.771576740026846e-16,
)  # fmt: skip
ALONG_SLOPE = (
    -3.0433916762429996e-06, 0.0016754420839154678, 6.086666755159799e-06, 2.8742349728371287e-08,
    1.5545833002275492e-10, 9.138812284585286e-13, 5.725892088032216e-15,
)  # fmt: skip
BACK = (
    -0.0008377319967100609, -1.1811653712953729e-07, -6.693885205399433e-10, -1.7318152360537145e-12,
    -6.060764873869768e-15, -2.3195996450221294e-17,
)  # fmt: skip
# The conformal latitude minus the latitude, and the latitude minus the conformal one (Karney 2024):
CONFORMAL = (
    -0.0033565464253309135, 9.389083734841227e-06, -3.277761779378265e-08, 1.2463769010153507e-10,
    -4.965267586461303e-13, 2.0445272002629564e-15,
)  # fmt: skip
GEODETIC = (
    0.0033565338229051196, 1.314353089073916e-05, 7.058349964337608e-08, 4.31000923304068e-10, 2.822411956211541e-12,
    1.9379436405741367e-14,
)  # fmt: skip
HYPERBOLIC = tuple(1.0 / (2 * k + 1) for k in range(15))  # atanh(t)/t in t^2, t <= tanh 0.3
SINH = tuple(1.0 / factorial(2 * k + 1) for k in range(11))  # sinh(y)/y in y^2, y <= 1.2


def standard_zone(lat: N, lon: N, xp: Functions[N]) -> N:
    """Return the zone of a position: six degrees each, except 32V of Norway and four zones over Svalbard."""
    lon = eastward(lon, xp)
    sixth = _steps(lon, 6.0, xp) + 31.0
    zone = xp.where(sixth > 60.0, 1.0, sixth)  # lon 180
    high = (lat >= 56.0) & (lon >= 0.0) & (lon < 42.0)
    if xp.some(high):
        norway = high & (lat < 64.0) & (lon >= 3.0) & (lon < 12.0)
        svalbard = xp.where(high & (lat >= 72.0), 31.0 + 2.0 * _steps(lon + 3.0, 12.0, xp), zone)
        zone = xp.where(norway, 32.0, svalbard)
    return xp.where(lat < 0.0, 0.0 - zone, zone)


def zone_number(name: object) -> float:
    """Return the number of a zone written as `32N` or `32S`, negative for the south.

    Raises:
        ValueInvalid: not a zone, no hemisphere, or the letter of a band.
    """
    text = "".join(name.split()).lstrip("0").upper() if isinstance(name, str) else str(name)
    if text in ZONES[1:]:
        place = ZONES.index(text)
        return float(place if place <= 60 else place - len(ZONES))
    number, letter = text[:-1], text[-1:]
    if f"{number}N" in ZONES and letter in "CDEFGHJKLMPQRTUVWX":
        raise ValueInvalid(f"{shown(name)}: a band letter; write {number}N, or {number}S south of the equator")
    if f"{text}N" in ZONES:
        raise ValueInvalid(f"zone {shown(name)} has no hemisphere; write {text}N, or {text}S south of the equator")
    raise ValueInvalid(f"unknown zone {shown(name)}; zones: 1N to 60N, and 1S to 60S south of the equator")


def _steps(x: N, width: float, xp: Functions[N]) -> N:
    """Return the number of whole steps of a width from 0, rounded down; exact at every edge."""
    whole = nearest(x / width)
    return whole - xp.where(whole * width > x, 1.0, 0.0)


def beside_meridian(lon: N, zone: N) -> N:
    """Return the degrees of a longitude east of a zone's meridian, by one subtraction that rounds."""
    meridian = 6.0 * abs(zone) - 183.0
    return lon - (meridian + 360.0 * nearest((lon - meridian) / 360.0))


def utm(zone: N, lat: N, lon: N, xp: Functions[N]) -> Four[N]:
    """Return easting, northing, convergence in degrees and grid scale of a position in a zone.

    Convergence is the angle of grid north clockwise of true north.  Accurate to 5e-9 m in each zone, 30 degrees wide.
    The conformal latitude needs no logarithm: chi = lat + sum c_k sin 2k lat; on the sphere sin chi and cos chi
    give xi and eta, and Krueger's series in xi + i eta the rest; its derivative gives convergence and scale.
    """
    s, c = sincos_deg(within(lat, SOUTH, NORTH, xp), xp)
    east, front = sincos_deg(within(beside_meridian(within(lon, -180.0, 360.0, xp), zone), -REACH, REACH, xp), xp)
    sx, cx = _turned(s, c, (2.0 * s * c) * polynomial((c - s) * (c + s), CONFORMAL))
    u = cx * east
    squared = 1.0 - u * u
    root = xp.sqrt(squared)
    sp, cp = sx / root, cx * front / root
    s2, c2, sh2, ch2 = 2.0 * sp * cp, (cp - sp) * (cp + sp), 2.0 * u / squared, (1.0 + u * u) / squared
    x, y = c2 * ch2, 0.0 - s2 * sh2
    north, east_by = _product(s2 * ch2, c2 * sh2, *_complex_polynomial(x, y, ALONG))
    slope, tilt = _complex_polynomial(x, y, ALONG_SLOPE)
    half = u / (1.0 + root)
    eta = 2.0 * half * polynomial(half * half, HYPERBOLIC)
    xi = incline(sp, cp, xp)
    slope = 1.0 + slope
    across, ahead = sx * east * slope - front * tilt, front * slope + sx * east * tilt
    length = xp.sqrt((slope * slope + tilt * tilt) * squared)
    convergence = xp.doubled_arctan(across / (length + ahead)) * RADIAN
    scale = (RADIUS / A) * length / squared * xp.sqrt(1.0 - E2 * s * s) * (cx / c)
    south = xp.where(zone < 0.0, FALSE_NORTHING, 0.0)
    return RADIUS * (eta + east_by) + FALSE_EASTING, RADIUS * (xi + north) + south, convergence + 0.0, scale


def lat_lon(zone: N, easting: N, northing: N, xp: Functions[N]) -> Two[N]:
    """Return latitude and longitude in degrees of a position in a zone; lon in (-180, 180]."""
    eta = within((easting - FALSE_EASTING) / RADIUS, -WIDEST, WIDEST, xp)
    xi = within((northing - xp.where(zone < 0.0, FALSE_NORTHING, 0.0)) / RADIUS, -1.5, 1.5, xp)
    s2, c2 = floats.half_sincos(4.0 * xi, xp)
    sh2, ch2 = _sinh_cosh(2.0 * eta, xp)
    x, y = _product(s2 * ch2, c2 * sh2, *_complex_polynomial(c2 * ch2, 0.0 - s2 * sh2, BACK))
    s, c = floats.half_sincos(2.0 * (xi + x), xp)
    sh, ch = _sinh_cosh(eta + y, xp)
    hyp = xp.sqrt(sh * sh + c * c)
    lon = xp.doubled_arctan(sh / (hyp + c)) * RADIAN
    sx, cx = s / ch, hyp / ch
    chi = xp.doubled_arctan(s / (ch + hyp))
    lat = (chi + (2.0 * sx * cx) * polynomial((cx - sx) * (cx + sx), GEODETIC)) * RADIAN
    lat = within(lat, SOUTH - SLACK, NORTH + SLACK, xp)
    lon = within(lon, -REACH - SLACK, REACH + SLACK, xp)
    return lat + 0.0, eastward(lon + (6.0 * abs(zone) - 183.0), xp)


def _turned(s: N, c: N, d: N) -> Two[N]:
    """Return sine and cosine of an angle increased by d, below 0.004 radians."""
    squared = d * d
    sine = d - (d * squared) * (1 / 6 - squared * (1 / 120))
    rest = squared * (0.5 - squared * (1 / 24))
    return s + (c * sine - s * rest), c - (s * sine + c * rest)


def _sinh_cosh(y: N, xp: Functions[N]) -> Two[N]:
    sinh = y * polynomial(y * y, SINH)
    return sinh, xp.sqrt(1.0 + sinh * sinh)


def _product(a: N, b: N, c: N, d: N) -> Two[N]:
    """Multiply a + ib by c + id."""
    return a * c - b * d, a * d + b * c


def _complex_polynomial(x: N, y: N, coefficients: tuple[float, ...]) -> Two[N]:
    """Evaluate a real polynomial at x + iy, lowest coefficient first.

    Source: Knuth, TAOCP 4.6.4 (3): two real products a coefficient, where a complex one takes four.
    """
    twice, squared = x + x, x * x + y * y
    first, *others, last = coefficients
    now, before = others.pop() + twice * last, 0.0 * x + last
    for coefficient in reversed(others):
        now, before = coefficient + twice * now - squared * before, now
    return first + x * now - squared * before, y * now


def grid_pose(zone: N, lat: N, lon: N, alt: N, xp: Functions[N]) -> Seven[N]:
    """Return ecef_from_axes of the axes of a zone's grid at a position: x along grid east, y along grid north, z up."""
    return pose(lat, lon, alt, "grid", xp, utm(zone, lat, lon, xp)[2])


def check_utm(zone: float, lat: float, lon: float, alt: float = 0.0) -> None:
    """Raise ValueInvalid unless finite numbers are a position within UTM and 30 degrees of the zone's meridian."""
    check_lla(lat, lon, alt)
    if not SOUTH <= lat <= NORTH:
        raise ValueInvalid(f"lat {lat!r}: UTM ends at 84 N and 80 S; use lla, ecef or enu")
    off = abs(beside_meridian(lon, zone))
    if off > REACH:
        name = ZONES[int(zone)]
        raise ValueInvalid(f"lon {lon!r} is {off:.6g} degrees from the meridian of zone {name}; it reaches 30")


def check_grid(zone: float, easting: float, northing: float) -> None:
    """Raise ValueInvalid unless a position in a zone is covered by UTM."""
    if isnan(sum(lat_lon(zone, easting, northing, floats))):
        place = f"utm {ZONES[int(zone)]} {easting!r} {northing!r}"
        raise ValueInvalid(f"{place} is beyond 84 N, 80 S or 30 degrees of the meridian; easting and northing swapped?")


# --- the public functions ---


def ecef_from_lla(lat: Numbers, lon: Numbers, alt: Numbers = 0.0) -> Any:
    """Return x, y, z in metres: three floats for one position, an array (..., 3) for many."""
    argument = _columns(lat=lat, lon=lon, alt=alt)
    found = validation.checked(ecef, 3, argument, "place", check_lla)
    return found if validation.single(found) else validation.stacked(found)


def lla_from_ecef(xyz: Numbers) -> Any:
    """Return lat, lon, alt from x, y, z in metres, shape (..., 3), 100 km or more from the centre; lon 0 at a pole."""
    return validation.checked(lla, 3, validation.columns(xyz, 3, "xyz"), "xyz", check_ecef)


def earth_pose(
    lat: Numbers, lon: Numbers, alt: Numbers = 0.0, axes: str = "enu", *, zone: Numbers | str | None = None
) -> Transform:
    """Return ecef_from_axes: the pose in ECEF of axes at a position; at a pole lon defines them.

    axes: `enu` (x east, y north, z up), `ned` (north, east, down), `grid` (along the grid of UTM, z up) or `ecef`
    zone: that of the grid, such as `32N`; by default the standard zone
    """
    from frametool.geometry.transform import Transform

    argument = _columns(lat=lat, lon=lon, alt=alt)
    if axes not in AXES:
        raise ValueInvalid(f"unknown axes {shown(axes)}; axes: {', '.join(AXES)}")
    if axes == "grid":
        zoned = _zone(zone, *argument[:2]), *argument
        return Transform.of(*validation.checked(grid_pose, 7, zoned, "place", check_utm))
    if zone is not None:
        raise ValueInvalid(f"zone {shown(zone)} is one of a grid; axes {axes!r} have none")

    def kernel(lat: Any, lon: Any, alt: Any, xp: Any) -> Components:
        return pose(lat, lon, alt, axes, xp)

    return Transform.of(*validation.checked(kernel, 7, argument, "place", check_lla))


def utm_from_lla(lat: Numbers, lon: Numbers, zone: Numbers | str | None = None) -> Any:
    """Return zone, easting, northing, convergence in degrees and grid scale.

    zone: fixed, such as `32N`, up to 30 degrees from its meridian; by default the standard zone, including the
    exceptions of Norway and Svalbard.  Convergence is the angle of grid north clockwise of true north: yaw in grid =
    yaw in enu + convergence.
    """
    argument = _columns(lat=lat, lon=lon)
    zoned = _zone(zone, *argument), *argument
    found = validation.checked(utm, 4, zoned, "place", check_utm)
    if validation.single(found):
        return (ZONES[int(zoned[0])], *found)
    import numpy as np

    names = np.array(ZONES)[np.asarray(zoned[0]).astype(np.int64)]
    return (np.full(found[0].shape, names), *found)


def lla_from_utm(zone: Numbers | str, easting: Numbers, northing: Numbers) -> Any:
    """Return lat, lon of positions in a zone, such as `32N` (`32S` south of the equator), or with a zone each."""
    argument = _zone(zone), *_columns(easting=easting, northing=northing)
    return validation.checked(lat_lon, 2, argument, "utm", check_grid)


def _columns(**values: Numbers) -> Components:
    """Return numbers of one position as floats, of many as arrays that broadcast; checked to be finite."""
    return tuple(validation.scalars(value, name) for name, value in values.items())


def _zone(argument: Any, *place: Any) -> Any:
    """Return the number of a zone, or of many; by default that of the position, if it is known."""
    if argument is None and place:
        return validation.number(standard_zone, place)
    if not isinstance(argument, (list, tuple)) and not getattr(argument, "shape", ()):
        return zone_number(argument)
    import numpy as np

    try:
        names = np.asarray(argument).astype(str)
    except ValueError:
        raise ValueInvalid("zone: the rows differ in length; expected an array of names such as 32N") from None
    numbers = {name: zone_number(name) for name in dict.fromkeys(names.ravel().tolist())}
    return np.array([numbers[name] for name in names.ravel().tolist()]).reshape(names.shape)
