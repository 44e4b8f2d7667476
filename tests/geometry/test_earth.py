"""Latitude and longitude to ECEF and back, and the axes at a place: against 50 digits, and where all is exact."""

from __future__ import annotations

import itertools
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import earth_oracles
import mpmath
import numpy as np
import oracles
import pytest

import frametool
from frametool.errors import ValueInvalid
from frametool.geometry import arrays, earth, floats, quaternion, rigid
from frametool.geometry.transform import Transform

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "earth.json").read_text())
EPS = oracles.EPS
DRAWN = np.random.default_rng(24)
NEAR_POLES = [side * (90.0 - gap) for gap in (10.0 ** DRAWN.uniform(-13, 1, 20)).tolist() for side in (1, -1)]
LATS = [*DRAWN.uniform(-90, 90, 120).tolist(), *NEAR_POLES, *(10.0 ** DRAWN.uniform(-300, 0, 20)).tolist(), 0.0, 45.0, -45.0, 90.0, -90.0]
NEAR_DATE_LINE = [side * (180.0 - gap) for gap in (10.0 ** DRAWN.uniform(-13, 1, 20)).tolist() for side in (1, -1)]
LONS = [*DRAWN.uniform(-180, 180, 120).tolist(), *NEAR_DATE_LINE, 0.0, 90.0, -90.0, 180.0, 1e-12, 1e-300]
RANGES = {"from 11 km down to 9 km up": (-11e3, 9e3), "to 10 000 km up": (0.0, 1e7), "to 5000 km down": (-5e6, 0.0), "to 1e9 km up": (1e7, 1e12)}
GROUND, METRES = 6.4e6, 2.0  # eps of the distance from the centre
RIGHT = (-180.0, -90.0, 0.0, 90.0, 180.0, 270.0, 360.0)


def places(depth: float, height: float, count: int = 250) -> list[tuple[float, float, float]]:
    """Draw places: near the poles, the equator, the date line and anywhere."""
    generator = np.random.default_rng(round(height))
    return [
        (float(generator.choice(LATS)), float(generator.choice(LONS)), alt)
        for alt in generator.uniform(depth, height, count).tolist()
    ]


def eps_off(found: Any, expected: Any) -> float:
    """Give the largest error of a position in eps of its distance from the centre."""
    return max(abs(float(a - b)) for a, b in zip(found, expected, strict=True)) / EPS / float(earth_oracles.length(expected))


def arc_off(found: tuple[float, ...], lat: Any, lon: Any) -> tuple[float, float]:
    """Give the errors of lat and lon in radians, that of lon along its parallel."""
    turned = found[1] * earth_oracles.DEGREE - lon
    turned -= 2 * mpmath.pi * mpmath.nint(turned / (2 * mpmath.pi))
    return abs(float(found[0] * earth_oracles.DEGREE - lat)), abs(float(turned * mpmath.cos(lat)))


def test_ecef_of_golden_places() -> None:
    for *place, x, y, z in GOLDEN["ecef"]:
        assert eps_off(frametool.ecef_from_lla(*place), (x, y, z)) <= METRES


def test_golden_places_of_ecef() -> None:
    for *xyz, lat, lon, alt in GOLDEN["lla"]:
        found = frametool.lla_from_ecef(xyz)
        assert max(arc_off(found, lat * earth_oracles.DEGREE, lon * earth_oracles.DEGREE)) <= 8e-16
        assert abs(found[2] - alt) <= METRES * EPS * math.hypot(*xyz)


@pytest.mark.parametrize("name", RANGES)
def test_places_of_every_height_are_right_both_ways(name: str) -> None:
    for lat, lon, alt in places(*RANGES[name]):
        exact = earth_oracles.ecef(lat, lon, alt)
        least = 1.0 if alt > -11e3 else GROUND / float(earth_oracles.length(exact))  # deep down two large numbers cancel
        assert eps_off(frametool.ecef_from_lla(lat, lon, alt), exact) <= METRES * least
        xyz = [float(part) for part in exact]
        found, expected = frametool.lla_from_ecef(xyz), earth_oracles.lla(xyz, lat)
        assert max(arc_off(found, *expected[:2])) <= 8e-16
        assert abs(float(found[2] - expected[2])) <= METRES * EPS * math.hypot(*xyz) * least
        assert -180.0 < found[1] <= 180.0


@pytest.mark.parametrize("name", RANGES)
def test_places_come_back_from_ecef(name: str) -> None:
    given = np.array(places(*RANGES[name]))
    xyz = frametool.ecef_from_lla(*given.T)
    again = frametool.ecef_from_lla(*frametool.lla_from_ecef(xyz))
    size = np.maximum(np.linalg.norm(xyz, axis=-1), GROUND)
    assert np.max(abs(again - xyz).max(axis=-1) / size) <= 6 * EPS


def test_points_in_local_axes_are_right_to_5_nanometres() -> None:
    for origin, axes, place, xyz in GOLDEN["local"]:
        pose = earth.pose(origin[0], origin[1], origin[2], axes, floats)
        point = earth.seen_from(*pose, *frametool.ecef_from_lla(*place))
        assert np.max(np.abs(np.array(point) - xyz)) <= 5e-9
        assert eps_off(rigid.apply(*pose, *xyz), frametool.ecef_from_lla(*place)) <= 4


def golden_frame(entry: dict[str, Any]) -> Transform:
    """Return the pose in ecef of a golden frame."""
    lat, lon, alt = entry["at"]
    at = frametool.earth_pose(lat, lon, alt, axes=entry["axes"], zone=entry.get("zone"))
    turn = frametool.Rotation.from_euler("sxyz", np.radians(entry["rpy_deg"]))
    return at @ Transform(turn, entry["offset"])


def quaternion_off(found: Any, expected: Any) -> float:
    """Give the largest difference of two quaternions in eps, whichever sign they have."""
    return float(min(np.max(np.abs(found - side * np.array(expected))) for side in (1, -1)) / EPS)


def test_golden_frames_and_what_is_seen_from_one_to_another() -> None:
    poses = [golden_frame(entry) for entry in GOLDEN["frames"]]
    for entry, pose in zip(GOLDEN["frames"], poses, strict=True):
        assert eps_off(pose.components[:3], entry["xyz"]) <= METRES
        assert quaternion_off(pose.xyzw, entry["quaternion"]) <= 4
    for target, source, xyz, xyzw in GOLDEN["pairs"]:
        seen = poses[target].relative(poses[source])
        assert np.max(np.abs(seen.xyz - xyz)) <= 5e-9
        assert quaternion_off(seen.xyzw, xyzw) <= 4


@pytest.mark.parametrize("axes", ["enu", "ned"])
def test_local_axes_are_those_of_60_digits(axes: str) -> None:
    for lat, lon, alt in places(-11e3, 1e7, 100):
        pose = frametool.earth_pose(lat, lon, alt, axes)
        exact = earth_oracles.axes(lat, lon, axes)
        assert oracles.error(oracles.matrix_of_quaternion(pose.components[3:]), exact) <= 4


@pytest.mark.parametrize("axes", ["enu", "ned"])
def test_axes_and_places_at_multiples_of_90_degrees_are_exact(axes: str) -> None:
    polar = earth.A * (1.0 - earth.F)
    for lat, lon in itertools.product((-90.0, 0.0, 90.0), RIGHT):
        pose = frametool.earth_pose(lat, lon, axes=axes)
        expected = np.array(earth_oracles.axes(lat, lon, axes).tolist(), float)
        assert np.array_equal(pose.rotation.as_matrix(), expected)
        assert {abs(part) for part in pose.components[3:]} <= {0.0, 0.5, math.sqrt(0.5), 1.0}
        x, y, z = frametool.ecef_from_lla(lat, lon, 0.0)
        assert min(abs(x), abs(y)) == 0.0
        assert (abs(z) == pytest.approx(polar, abs=1e-9) and x == y == 0.0) if lat else (z == 0.0 and abs(x + y) == earth.A)
        back = frametool.lla_from_ecef((x, y, z))
        assert back[:2] == (lat, 0.0 if lat else {-180.0: 180.0, 270.0: -90.0, 360.0: 0.0}.get(lon, lon))
        assert not [part for part in (x, y, z, *back, *pose.components) if part == 0.0 and math.copysign(1.0, part) < 0.0]


def test_grid_axes_are_turned_by_the_convergence() -> None:
    for lat, lon, zone in ((48.1, 11.5, None), (48.1, 11.5, "33N"), (-33.0, 151.2, None), (60.0, 4.0, None)):
        convergence = frametool.utm_from_lla(lat, lon, zone)[3]
        enu, grid = frametool.earth_pose(lat, lon, 7.0), frametool.earth_pose(lat, lon, 7.0, "grid", zone=zone)
        yaw_in_grid = grid.relative(enu).rotation.as_rpy()
        assert yaw_in_grid == pytest.approx([0.0, 0.0, math.radians(convergence)], abs=1e-15)


def test_ecef_axes_are_those_of_the_earth() -> None:
    pose = frametool.earth_pose(48.1, 11.5, 520.0, "ecef")
    assert pose.components == (*frametool.ecef_from_lla(48.1, 11.5, 520.0), 0.0, 0.0, 0.0, 1.0)


def test_lon_is_written_up_to_180_and_a_pole_has_lon_0() -> None:
    for y in (0.0, -0.0, -5e-324, -1e-300, -1e-12):
        assert frametool.lla_from_ecef((-7e6, y, 0.0))[:2] == (0.0, 180.0)
    assert frametool.lla_from_ecef((-7e6, -1e-8, -0.0))[1] < -179.0
    assert frametool.lla_from_ecef((-0.0, -0.0, 7e6))[:2] == (90.0, 0.0)
    assert frametool.lla_from_ecef((-0.0, 0.0, -7e6))[:2] == (-90.0, 0.0)
    for lon in (-180.0, 190.0, 359.0, 360.0):
        assert frametool.ecef_from_lla(10.0, lon) == pytest.approx(frametool.ecef_from_lla(10.0, (lon + 180) % 360 - 180), abs=1e-8)


def test_one_place_is_plain_floats_and_loads_no_numpy() -> None:
    code = (
        "import sys, frametool as f; xyz = f.ecef_from_lla(48, 11, 5); f.lla_from_ecef(xyz); f.lla_from_ecef(list(xyz)); "
        "[f.earth_pose(48, 11, axes=axes) for axes in ('enu', 'ned', 'grid', 'ecef')]; "
        "zone, x, y, *_ = f.utm_from_lla(48, 11); f.lla_from_utm(zone, x, y); f.utm_from_lla(48, 11, '33N'); "
        "print(type(xyz), {type(part) for part in xyz}, 'numpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "<class 'tuple'> {<class 'float'>} False\n"


def test_arrays_broadcast_and_keep_the_bits_of_floats() -> None:
    lats, lons = np.array([[10.0], [-20.0]]), np.array([170.0, 180.0, 359.0])
    xyz = frametool.ecef_from_lla(lats, lons)
    assert xyz.shape == (2, 3, 3)
    poses = {axes: frametool.earth_pose(lats, lons, axes=axes) for axes in earth.AXES}
    back = frametool.lla_from_ecef(xyz)
    for i, j in itertools.product(range(2), range(3)):
        one = frametool.ecef_from_lla(float(lats[i, 0]), float(lons[j]))
        assert one == tuple(xyz[i, j].tolist())
        assert frametool.lla_from_ecef(one) == tuple(float(part[i, j]) for part in back)
        for axes, many in poses.items():
            assert frametool.earth_pose(float(lats[i, 0]), float(lons[j]), axes=axes).components == many[i, j].components
    mixed = frametool.ecef_from_lla(10, [170, 180], 5)
    assert [tuple(row) for row in mixed.tolist()] == [frametool.ecef_from_lla(10.0, lon, 5.0) for lon in (170.0, 180.0)]
    heights = frametool.earth_pose(10.0, 20.0, [1.0, 2.0], "ned")
    assert heights[1].components == frametool.earth_pose(10.0, 20.0, 2.0, "ned").components
    assert frametool.ecef_from_lla([], [], []).shape == (0, 3)
    assert [part.shape for part in frametool.lla_from_ecef(np.empty((0, 3)))] == [(0,)] * 3


def test_more_than_a_block_and_columns_of_any_strides() -> None:
    count = arrays.BLOCK + 5
    rows = np.stack([DRAWN.uniform(-90, 90, count), DRAWN.uniform(-180, 360, count), DRAWN.uniform(-1e4, 1e5, count)], axis=-1)
    kept = rows.copy()
    xyz = frametool.ecef_from_lla(*rows.T)
    assert np.array_equal(rows, kept)
    for place in (0, arrays.BLOCK - 1, arrays.BLOCK, count - 1):
        assert tuple(xyz[place].tolist()) == frametool.ecef_from_lla(*rows[place].tolist())


REFUSED: list[tuple[Any, str]] = [
    (lambda: frametool.ecef_from_lla(95, 7), "lat 95.0 is beyond 90 degrees; are lat and lon swapped?"),
    (lambda: frametool.ecef_from_lla([1.0, -90.5], 7.0), "place[1]: lat -90.5 is beyond 90 degrees; are lat and lon swapped?"),
    (lambda: frametool.earth_pose(95.0, 7.0), "lat 95.0 is beyond 90 degrees; are lat and lon swapped?"),
    (lambda: frametool.ecef_from_lla(5.0, 360.5), "lon 360.5 is beyond -180 to 360 degrees; give it within"),
    (lambda: frametool.ecef_from_lla(5.0, [0.0, -181.0]), "place[1]: lon -181.0 is beyond -180 to 360 degrees; give it within"),
    (lambda: frametool.ecef_from_lla(math.nan, 7.0), "lat: nan is not finite; give finite numbers"),
    (lambda: frametool.ecef_from_lla(1.0, [3.0, math.inf]), "lon[1]: inf is not finite; give finite numbers"),
    (lambda: frametool.ecef_from_lla(1.0, 2.0, -math.inf), "alt: -inf is not finite; give finite numbers"),
    (lambda: frametool.ecef_from_lla("48.1", 2.0), "lat: expected real numbers, got an array of <U4"),
    (lambda: frametool.ecef_from_lla([1.0, 2.0], [1.0, 2.0, 3.0]), "batch shapes (2,) and (3,) and () do not broadcast"),
    (lambda: frametool.lla_from_ecef([6e4, 0, -6e4]), "ecef 60000 0 -60000 is within 100 km of the Earth's centre and has no lat; are these metres?"),
    (lambda: frametool.lla_from_ecef([[7e6, 0, 0], [0, 0, 1.5]]), "xyz[1]: ecef 0 0 1.5 is within 100 km of the Earth's centre and has no lat; are these metres?"),
    (lambda: frametool.lla_from_ecef([0.0, 1e300, 0.0]), "ecef 0 1e+300 0 is farther than 1e+20 m from the Earth; are these metres?"),
    (lambda: frametool.lla_from_ecef([[0.0, 1e300, 0.0]]), "xyz[0]: ecef 0 1e+300 0 is farther than 1e+20 m from the Earth; are these metres?"),
    (lambda: frametool.lla_from_ecef([1.0, 2.0]), "xyz: expected shape (..., 3), got (2,)"),
    (lambda: frametool.lla_from_ecef([7e6, 2.0, math.nan]), "xyz: 7e+06 2 nan is not finite; give finite numbers"),
    (lambda: frametool.lla_from_ecef([[7e6, 2.0, math.nan]]), "xyz[0]: 7e+06 2 nan is not finite; give finite numbers"),
    (lambda: frametool.earth_pose(1.0, 2.0, axes="nwu"), "unknown axes 'nwu'; axes: enu, ned, grid, ecef"),
    (lambda: frametool.earth_pose(1.0, 2.0, zone="31N"), "zone '31N' is one of a grid; axes 'enu' have none"),
    (lambda: frametool.earth_pose(86.0, 2.0, axes="grid"), "lat 86.0: UTM ends at 84 N and 80 S; use lla, ecef or enu"),
]  # fmt: skip


@pytest.mark.parametrize(("act", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_what_is_no_place_is_refused(act: Any, message: str) -> None:
    with pytest.raises(ValueInvalid) as caught:
        act()
    assert str(caught.value) == message
    assert len(message) <= 200


def test_the_bounds_themselves_are_places() -> None:
    for lat, lon in itertools.product((90.0, -90.0), (-180.0, 360.0)):
        assert all(map(math.isfinite, frametool.ecef_from_lla(lat, lon)))
    for xyz in ((1e5, 0.0, 0.0), (0.0, 0.0, -1e5), (0.0, 1e20, 0.0)):
        assert all(map(math.isfinite, frametool.lla_from_ecef(xyz)))
        assert frametool.lla_from_ecef(np.array([xyz]))[2].tolist() == [frametool.lla_from_ecef(xyz)[2]]


def test_a_quaternion_of_axes_has_the_canonical_sign_and_is_unit() -> None:
    for lat, lon, alt in places(-11e3, 9e3, 100):
        for axes in earth.AXES[:2]:
            turn = frametool.earth_pose(lat, lon, alt, axes).components[3:]
            assert floats.canonical_sign(*turn) == turn
            assert abs(quaternion.squared_norm(*turn) - 1.0) <= quaternion.UNIT
