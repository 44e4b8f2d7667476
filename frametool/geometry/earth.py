"""Kernels of positions on the Earth, WGS84: latitude and longitude in degrees, metres above the ellipsoid, and ECEF.

`ecef` is the Earth's frame: x to lat 0 lon 0, z to the north pole.  Only + - * / and square roots, and this package's
own sines and arc tangents: floats and arrays give the same bits.  Invalid positions become NaN; `check_lla` and
`check_ecef` return the reason.  Knows numbers only; components are floats or arrays of one shape.
"""

from __future__ import annotations

from math import nan

from frametool.errors import ValueInvalid
from frametool.geometry import quaternion
from frametool.geometry.floats import RADIAN, SQRT_HALF, bearing, half_sincos_deg, incline
from frametool.geometry.quaternion import TINY

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Four, Functions, N, Seven, Three, Two

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
    squared = x * x + y * y
    axial = xp.sqrt(squared)
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


def ecef_from_enu(lat: N, lon: N, xp: Functions[N]) -> Four[N]:
    """Return the quaternion of the axes east, north, up at a position; at a pole lon defines them.

    It is a rotation about z by 90 degrees + lon, then about x by 90 degrees - lat, with the right angles written out:
    exact where lat and lon are multiples of 90.
    """
    s1, c1 = half_sincos_deg(lon, xp)
    s2, c2 = half_sincos_deg(lat, xp)
    back, ahead, down, up = 0.5 * (c1 - s1), 0.5 * (c1 + s1), c2 - s2, c2 + s2
    return quaternion.settled(back * down, ahead * down, ahead * up, back * up)


def ecef_from_axes(lat: N, lon: N, axes: str, xp: Functions[N], convergence_deg: N | None = None) -> Four[N]:
    """Return the quaternion of axes at a position, with the canonical sign.

    axes: one of `AXES`
    convergence_deg: for grid axes, the angle of grid north clockwise of true north
    """
    if axes == "ecef":
        zero = 0.0 * lat + 0.0
        return zero, zero, zero, zero + 1.0
    x, y, z, w = ecef_from_enu(lat, lon, xp)
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
    shown = f"ecef {x:.9g} {y:.9g} {z:.9g}"
    if squared < NEAREST:
        raise ValueInvalid(f"{shown} is within 100 km of the Earth's centre and has no lat; are these metres?")
    if not squared <= FURTHEST:
        raise ValueInvalid(f"{shown} is farther than 1e+20 m from the Earth; are these metres?")
