"""The Earth in 60 digits, by other formulas than the kernels: Newton's method, and the exact transverse Mercator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mpmath
import oracles
from mpmath import mp, mpc, mpf

if TYPE_CHECKING:
    from collections.abc import Sequence

EPS = oracles.EPS
A, F = mpf(6378137), 1 / mpf("298.257223563")
B, E2 = A * (1 - F), F * (2 - F)
E = mpmath.sqrt(E2)
DEGREE = mp.pi / 180


def ecef(lat: float, lon: float, alt: float) -> list[Any]:
    """Give x, y, z by the two radii of curvature; right angles are exact."""
    s, c = sine_cosine(lat)
    east, front = sine_cosine(lon)
    normal = A / mpmath.sqrt(1 - E2 * s * s)
    return [(normal + alt) * c * front, (normal + alt) * c * east, (normal * (1 - E2) + alt) * s]


def sine_cosine(degrees: float) -> tuple[Any, Any]:
    """Give sine and cosine of degrees, by the half turns that mpmath reduces exactly."""
    return mpmath.sinpi(mpf(degrees) / 180), mpmath.cospi(mpf(degrees) / 180)


def lla(xyz: Sequence[float], near: float) -> tuple[Any, Any, Any]:
    """Give lat, lon in radians and alt: Newton's method on the reduced latitude, from a latitude nearby in degrees."""
    x, y, z = (mpf(part) for part in xyz)
    across = mpmath.hypot(x, y)
    reduced = mpmath.atan2(B * mpmath.sin(near * DEGREE), A * mpmath.cos(near * DEGREE))
    for _ in range(7):
        s, c = mpmath.sin(reduced), mpmath.cos(reduced)
        off = A * across * s - B * z * c - (A * A - B * B) * s * c
        reduced -= off / (A * across * c + B * z * s - (A * A - B * B) * (c * c - s * s))
    lat = mpmath.atan2(A * mpmath.sin(reduced), B * mpmath.cos(reduced))
    normal = A / mpmath.sqrt(1 - E2 * mpmath.sin(lat) ** 2)
    alt = across * mpmath.cos(lat) + z * mpmath.sin(lat) - A * A / normal
    return lat, mpmath.atan2(y, x), alt


def axes(lat: float, lon: float, name: str) -> Any:
    """Give the matrix of ecef_from_axes: east, north and up in columns, or north, east, down."""
    s, c = sine_cosine(lat)
    east, front = sine_cosine(lon)
    enu = [[-east, front, 0], [-s * front, -s * east, c], [c * front, c * east, s]]
    ned = [enu[1], enu[0], [-part for part in enu[2]]]
    return mpmath.matrix(enu if name == "enu" else ned).T


def transverse_mercator(lat: float, dlon: Any) -> tuple[Any, Any, Any, Any]:
    """Give easting, northing from the meridian's foot, convergence in degrees and scale, of UTM's 0.9996.

    The length of the meridian, an elliptic integral, taken at the complex latitude whose isometric latitude is that
    of the place plus i times the longitude.
    """
    wanted = isometric(lat * DEGREE) + mpc(0, 1) * mpf(dlon) * DEGREE
    latitude = mpmath.asin(mpmath.tanh(wanted))
    for _ in range(9):
        sine = mpmath.sin(latitude)
        slope = (1 - E2) / ((1 - E2 * sine * sine) * mpmath.cos(latitude))
        latitude -= (isometric(latitude) - wanted) / slope
    sine, cosine = mpmath.sin(latitude), mpmath.cos(latitude)
    root = mpmath.sqrt(1 - E2 * sine * sine)
    place = mpf("0.9996") * A * (mpmath.ellipe(latitude, E2) - E2 * sine * cosine / root)
    slope = A * cosine / root
    s, c = sine_cosine(lat)
    scale = mpf("0.9996") * abs(slope) * mpmath.sqrt(1 - E2 * s * s) / (A * c)
    return place.imag, place.real, -mpmath.arg(slope) / DEGREE, scale


def isometric(latitude: Any) -> Any:
    """Give the isometric latitude of a latitude in radians, which may be complex."""
    sine = mpmath.sin(latitude)
    return mpmath.atanh(sine) - E * mpmath.atanh(E * sine)


def length(xyz: Sequence[Any]) -> Any:
    """Give the length of a vector."""
    return mpmath.sqrt(sum(mpf(part) ** 2 for part in xyz))
