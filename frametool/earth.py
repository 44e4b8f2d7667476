"""Positions on the Earth (WGS84): latitude and longitude to and from ECEF and UTM, and local axes.

    import frametool
    ecef_from_map = frametool.earth_pose(48.1, 11.5, 520.0)            # axes east, north, up at this position
    xyz = frametool.ecef_from_lla(48.1, 11.5, 521.0)
    ecef_from_map.inverse().apply(xyz)                                  # 1 m up

lat and lon are degrees, lat in [-90, 90], lon in [-180, 360] as input and (-180, 180] as output; alt is metres above
the ellipsoid, as in NavSatFix, not above sea level.  ECEF is the Earth's frame: x to lat 0 lon 0, z to the north pole.
A single position is plain floats, without numpy; arrays broadcast, and results are arrays of their shape.  Raises
ValueInvalid for an invalid position.  The kernels are in `geometry.earth`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, shown
from frametool.geometry import earth, validation
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from frametool.geometry.types import Components, Numbers

__all__ = ["earth_pose", "ecef_from_lla", "lla_from_ecef", "lla_from_utm", "utm_from_lla"]


def ecef_from_lla(lat: Numbers, lon: Numbers, alt: Numbers = 0.0) -> Any:
    """Return x, y, z in metres: three floats for one position, an array (..., 3) for many."""
    argument = _columns(lat=lat, lon=lon, alt=alt)
    found = validation.checked(earth.ecef, 3, argument, "place", earth.check_lla)
    return found if validation.single(found) else validation.stacked(found)


def lla_from_ecef(xyz: Numbers) -> Any:
    """Return lat, lon, alt from x, y, z in metres, shape (..., 3), 100 km or more from the centre; lon 0 at a pole."""
    return validation.checked(earth.lla, 3, validation.columns(xyz, 3, "xyz"), "xyz", earth.check_ecef)


def earth_pose(
    lat: Numbers, lon: Numbers, alt: Numbers = 0.0, axes: str = "enu", *, zone: Numbers | str | None = None
) -> Transform:
    """Return ecef_from_axes: the pose in ECEF of axes at a position; at a pole lon defines them.

    axes: `enu` (x east, y north, z up), `ned` (north, east, down), `grid` (along the grid of UTM, z up) or `ecef`
    zone: that of the grid, such as `32N`; by default the standard zone
    """
    argument = _columns(lat=lat, lon=lon, alt=alt)
    if axes not in earth.AXES:
        raise ValueInvalid(f"unknown axes {shown(axes)}; axes: {', '.join(earth.AXES)}")
    if axes == "grid":
        zoned = _zone(zone, *argument[:2]), *argument
        return Transform.of(*validation.checked(earth.grid_pose, 7, zoned, "place", earth.check_utm))
    if zone is not None:
        raise ValueInvalid(f"zone {shown(zone)} is one of a grid; axes {axes!r} have none")

    def kernel(lat: Any, lon: Any, alt: Any, xp: Any) -> Components:
        return earth.pose(lat, lon, alt, axes, xp)

    return Transform.of(*validation.checked(kernel, 7, argument, "place", earth.check_lla))


def utm_from_lla(lat: Numbers, lon: Numbers, zone: Numbers | str | None = None) -> Any:
    """Return zone, easting, northing, convergence in degrees and grid scale.

    zone: fixed, such as `32N`, up to 30 degrees from its meridian; by default the standard zone, including the
    exceptions of Norway and Svalbard.  Convergence is the angle of grid north clockwise of true north: yaw in grid =
    yaw in enu + convergence.
    """
    argument = _columns(lat=lat, lon=lon)
    zoned = _zone(zone, *argument), *argument
    found = validation.checked(earth.utm, 4, zoned, "place", earth.check_utm)
    if validation.single(found):
        return (earth.ZONES[int(zoned[0])], *found)
    import numpy as np

    names = np.array(earth.ZONES)[np.asarray(zoned[0]).astype(np.int64)]
    return (np.full(found[0].shape, names), *found)


def lla_from_utm(zone: Numbers | str, easting: Numbers, northing: Numbers) -> Any:
    """Return lat, lon of positions in a zone, such as `32N` (`32S` south of the equator), or with a zone each."""
    argument = _zone(zone), *_columns(easting=easting, northing=northing)
    return validation.checked(earth.lat_lon, 2, argument, "utm", earth.check_grid)


def _columns(**values: Numbers) -> Components:
    """Return numbers of one position as floats, of many as arrays that broadcast; checked to be finite."""
    return tuple(validation.scalars(value, name) for name, value in values.items())


def _zone(argument: Any, *place: Any) -> Any:
    """Return the number of a zone, or of many; by default that of the position, if it is known."""
    if argument is None and place:
        return validation.number(earth.standard_zone, place)
    if not isinstance(argument, (list, tuple)) and not getattr(argument, "shape", ()):
        return earth.zone_number(argument)
    import numpy as np

    try:
        names = np.asarray(argument).astype(str)
    except ValueError:
        raise ValueInvalid("zone: the rows differ in length; expected an array of names such as 32N") from None
    numbers = {name: earth.zone_number(name) for name in dict.fromkeys(names.ravel().tolist())}
    return np.array([numbers[name] for name in names.ravel().tolist()]).reshape(names.shape)
