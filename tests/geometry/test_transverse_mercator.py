"""UTM against 50 digits and the exact mapping, its zones, and what it refuses."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any

import earth_oracles
import numpy as np
import pytest
from mpmath import mpf

import frametool
from frametool.errors import ValueInvalid
from frametool.geometry import earth as mercator
from frametool.geometry import floats

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "earth.json").read_text())
METRES, DEGREES, SCALE = 5e-9, 1e-12, 1e-14
DRAWN = np.random.default_rng(42)


def assert_right(found: Any, expected: Any) -> None:
    """Hold easting, northing, convergence and scale to the goals."""
    off = [abs(float(a - b)) for a, b in zip(found, expected, strict=True)]
    assert max(off[:2]) <= METRES
    assert off[2] <= DEGREES
    assert off[3] <= SCALE


@pytest.mark.parametrize("key", ["utm", "utm_forced"])
def test_golden_places_both_ways(key: str) -> None:
    for lat, lon, zone, *expected in GOLDEN[key]:
        name, *found = frametool.utm_from_lla(lat, lon, zone if key == "utm_forced" else None)
        assert name == zone
        assert_right(found, expected)
        back = frametool.lla_from_utm(zone, *expected[:2])
        assert back == pytest.approx((lat, 180.0 if lon == -180.0 else lon), abs=1e-13 * max(1.0, 1.0 / math.cos(math.radians(lat))))


@pytest.mark.parametrize("reach", [3.0, 9.0, 30.0])
def test_the_exact_mapping_up_to_30_degrees_beside_the_meridian(reach: float) -> None:
    lats = [*DRAWN.uniform(-80, 84, 70).tolist(), 84.0, -80.0, 0.0, 1e-9, -1e-12]
    for lat, aside in zip(lats, [*DRAWN.uniform(-reach, reach, 70).tolist(), reach, -reach, reach, 0.0, 1e-12], strict=True):
        lon = max(-reach, min(9.0 + aside - 9.0, reach)) + 9.0
        easting, northing, *rest = earth_oracles.transverse_mercator(lat, mpf(lon) - 9)
        for name, south in (("32N", 0), ("32S", 10_000_000)):
            assert_right(frametool.utm_from_lla(lat, lon, name)[1:], (500_000 + easting, south + northing, *rest))


def test_places_come_back() -> None:
    lats, lons = DRAWN.uniform(-80, 84, 3000), DRAWN.uniform(-180, 180, 3000)
    zones, easting, northing, *_ = frametool.utm_from_lla(lats, lons)
    back = frametool.lla_from_utm(zones, easting, northing)
    arc = np.radians([back[0] - lats, (back[1] - lons) * np.cos(np.radians(lats))])
    assert np.max(np.abs(arc)) * 6.4e6 <= METRES
    again = frametool.utm_from_lla(back[0], back[1], zones)
    assert np.max(np.abs([again[1] - easting, again[2] - northing])) <= 2 * METRES


ZONES = [
    (0.0, -180.0, "1N"), (0.0, 180.0, "1N"), (0.0, 179.9999999, "60N"), (-1e-9, 0.0, "31S"), (-0.0, 0.0, "31N"), (5.0, 360.0, "31N"),
    (5.0, 359.0, "30N"), (0.0, math.nextafter(6.0, 0.0), "31N"), (0.0, 6.0, "32N"), (0.0, math.nextafter(-6.0, -9.0), "29N"),
    (math.nextafter(56.0, 0.0), 4.0, "31N"), (56.0, 4.0, "32N"), (56.0, 2.999999, "31N"), (63.999999, 3.0, "32N"), (64.0, 4.0, "31N"),
    (60.0, 12.0, "33N"), (72.0, 0.0, "31N"), (72.0, 8.999999, "31N"), (72.0, 9.0, "33N"), (84.0, 20.999999, "33N"), (84.0, 21.0, "35N"),
    (75.0, 32.999999, "35N"), (75.0, 33.0, "37N"), (75.0, 41.999999, "37N"), (75.0, 42.0, "38N"), (71.999999, 9.0, "32N"),
    (75.0, -0.000001, "30N"), (-75.0, 9.0, "32S"), (-60.0, 4.0, "31S"), (75.0, 365.0 - 360.0, "31N"),
]  # fmt: skip


@pytest.mark.parametrize(("lat", "lon", "zone"), ZONES)
def test_zones_by_the_rule_with_norway_and_svalbard(lat: float, lon: float, zone: str) -> None:
    assert frametool.utm_from_lla(lat, lon)[0] == zone
    assert frametool.utm_from_lla([lat], [lon])[0].tolist() == [zone]


def test_every_zone_begins_at_its_own_degree() -> None:
    for zone in range(1, 61):
        west = 6.0 * zone - 186.0
        assert frametool.utm_from_lla(10.0, west)[0] == f"{zone}N"
        assert frametool.utm_from_lla(-10.0, math.nextafter(west + 6.0, west))[0] == f"{zone}S"
        assert frametool.utm_from_lla(10.0, west + 3.0)[1:] == (500000.0, frametool.utm_from_lla(10.0, 3.0)[2], 0.0, pytest.approx(0.9996, abs=1e-15))


def test_zones_reach_over_the_date_line() -> None:
    for held, lon, like in (("1N", 179.0, 181.0), ("60N", -179.0, 181.0), ("1N", -179.0, 181.0), ("60N", 181.0, -179.0)):
        assert frametool.utm_from_lla(20.0, lon, held)[1:] == pytest.approx(frametool.utm_from_lla(20.0, (like if lon < 0 else lon), held)[1:], rel=1e-12)
        _, easting, northing, *_ = frametool.utm_from_lla(20.0, lon, held)
        lat, back = frametool.lla_from_utm(held, easting, northing)
        assert -180.0 < back <= 180.0
        assert (lat, (back - lon) % 360.0) == (pytest.approx(20.0, abs=1e-13), pytest.approx(0.0, abs=1e-12)) or (lon - back) % 360.0 < 1e-12
    assert frametool.lla_from_utm("1N", frametool.utm_from_lla(0.0, 180.0, "1N")[1], 0.0) == (0.0, 180.0)


def test_the_north_is_held_south_of_the_equator_and_the_south_north_of_it() -> None:
    north, south = frametool.utm_from_lla(-5.0, 9.5, "32N"), frametool.utm_from_lla(-5.0, 9.5, "32S")
    assert north[2] < 0.0
    assert south[2] == pytest.approx(north[2] + 1e7, abs=METRES)
    assert frametool.lla_from_utm("32N", *north[1:3]) == pytest.approx((-5.0, 9.5), abs=1e-13)
    assert frametool.lla_from_utm("32S", *frametool.utm_from_lla(5.0, 9.5, "32S")[1:3]) == pytest.approx((5.0, 9.5), abs=1e-13)


def test_the_edges_of_utm_come_back() -> None:
    for lat, aside, name in itertools.product((84.0, -80.0, 0.0), (-30.0, 0.0, 30.0), ("1N", "31S", "60S")):
        lon = (6.0 * int(name[:-1]) - 183.0 + aside + 180.0) % 360.0 - 180.0
        _, easting, northing, *_ = frametool.utm_from_lla(lat, lon, name)
        assert frametool.lla_from_utm(name, easting, northing)[0] == pytest.approx(lat, abs=1e-12)
        assert frametool.lla_from_utm(name, float(round(easting)), float(round(northing)))[0] == pytest.approx(lat, abs=1e-5)


def test_on_the_meridian_and_the_equator_all_is_exact() -> None:
    assert frametool.utm_from_lla(0.0, 9.0) == ("32N", 500000.0, 0.0, 0.0, pytest.approx(0.9996, abs=1e-15))
    zone, easting, northing, convergence, _ = frametool.utm_from_lla(0.0, 10.0)
    assert (zone, northing, convergence) == ("32N", 0.0, 0.0)
    assert frametool.lla_from_utm("32N", 1e6 - easting, 0.0) == (0.0, pytest.approx(8.0, abs=1e-13))
    assert frametool.lla_from_utm("32S", 500000.0, 1e7) == (0.0, 9.0)
    assert not [part for part in frametool.utm_from_lla(-0.0, 9.0)[1:] if math.copysign(1.0, part) < 0.0]


def test_zones_are_read_as_people_write_them_and_written_one_way() -> None:
    assert [mercator.zone_number(name) for name in ("32N", "32s", " 01n ", "60 S", "1S")] == [32.0, -32.0, 1.0, -60.0, -1.0]
    for name in mercator.ZONES[1:]:
        assert mercator.ZONES[int(mercator.zone_number(name))] == name


def test_zones_one_for_all_or_one_each() -> None:
    lats, lons = [[48.0], [-5.0]], [9.0, 12.0, 15.0]
    for zone in (None, "33N", [["32N"], ["33S"]], np.array(["32N", "33N", "33S"])):
        names, *numbers = frametool.utm_from_lla(lats, lons, zone)
        assert names.shape == (2, 3)
        for i, j in itertools.product(range(2), range(3)):
            one = frametool.utm_from_lla(lats[i][0], lons[j], str(names[i, j]))
            assert one == (names[i, j], *(float(part[i, j]) for part in numbers))
        back = frametool.lla_from_utm(names, numbers[0], numbers[1])
        assert (float(back[0][1, 2]), float(back[1][1, 2])) == frametool.lla_from_utm(str(names[1, 2]), *(float(part[1, 2]) for part in numbers[:2]))
    assert frametool.utm_from_lla(48.0, 9.0, ["32N", "33N"])[0].tolist() == ["32N", "33N"]
    assert frametool.utm_from_lla([], [])[0].shape == (0,)


BEYOND = "is beyond 84 N, 80 S or 30 degrees of the meridian; easting and northing swapped?"
NO_ZONE: Any = None
REFUSED: list[tuple[Any, str]] = [
    (lambda: frametool.utm_from_lla(86, 7), "lat 86.0: UTM ends at 84 N and 80 S; use lla, ecef or enu"),
    (lambda: frametool.utm_from_lla(-80.5, 7, "32S"), "lat -80.5: UTM ends at 84 N and 80 S; use lla, ecef or enu"),
    (lambda: frametool.utm_from_lla([1.0, 86.0], 7), "place[1]: lat 86.0: UTM ends at 84 N and 80 S; use lla, ecef or enu"),
    (lambda: frametool.utm_from_lla(95, 7), "lat 95.0 is beyond 90 degrees; are lat and lon swapped?"),
    (lambda: frametool.utm_from_lla(5, 400), "lon 400.0 is beyond -180 to 360 degrees; give it within"),
    (lambda: frametool.utm_from_lla(5, [1e300]), "place[0]: lon 1e+300 is beyond -180 to 360 degrees; give it within"),
    (lambda: frametool.utm_from_lla(1, 50, "32N"), "lon 50.0 is 41 degrees from the meridian of zone 32N; it reaches 30"),
    (lambda: frametool.utm_from_lla([1, 1], [9, 50], "32N"), "place[1]: lon 50.0 is 41 degrees from the meridian of zone 32N; it reaches 30"),
    (lambda: frametool.utm_from_lla(1, 9, "32U"), "'32U': a band letter; write 32N, or 32S south of the equator"),
    (lambda: frametool.lla_from_utm("17t", 5e5, 0), "'17t': a band letter; write 17N, or 17S south of the equator"),
    (lambda: frametool.lla_from_utm(["32N", "32U"], 5e5, 0), "'32U': a band letter; write 32N, or 32S south of the equator"),
    (lambda: frametool.lla_from_utm("32", 5e5, 0), "zone '32' has no hemisphere; write 32N, or 32S south of the equator"),
    (lambda: frametool.lla_from_utm(32, 5e5, 0), "zone 32 has no hemisphere; write 32N, or 32S south of the equator"),
    (lambda: frametool.lla_from_utm("61N", 5e5, 0), "unknown zone '61N'; zones: 1N to 60N, and 1S to 60S south of the equator"),
    (lambda: frametool.lla_from_utm("", 5e5, 0), "unknown zone ''; zones: 1N to 60N, and 1S to 60S south of the equator"),
    (lambda: frametool.lla_from_utm(NO_ZONE, 5e5, 0), "unknown zone None; zones: 1N to 60N, and 1S to 60S south of the equator"),
    (lambda: frametool.lla_from_utm([32], 5e5, 0), "zone '32' has no hemisphere; write 32N, or 32S south of the equator"),
    (lambda: frametool.lla_from_utm([["32N"], ["32N", "33N"]], 5e5, 0), "zone: the rows differ in length; expected an array of names such as 32N"),
    (lambda: frametool.lla_from_utm({}, 5e5, 0), "unknown zone {}; zones: 1N to 60N, and 1S to 60S south of the equator"),  # type: ignore[arg-type]
    (lambda: frametool.lla_from_utm("32N", 5334760.4, 691607.86), f"utm 32N 5334760.4 691607.86 {BEYOND}"),
    (lambda: frametool.lla_from_utm("32N", 5e5, [1.0, 9.5e6]), f"utm[1]: utm 32N 500000.0 9500000.0 {BEYOND}"),
    (lambda: frametool.lla_from_utm("32S", 5e5, 0.0), f"utm 32S 500000.0 0.0 {BEYOND}"),
    (lambda: frametool.lla_from_utm("32N", 1e300, 0.0), f"utm 32N 1e+300 0.0 {BEYOND}"),
    (lambda: frametool.lla_from_utm("32N", -1e300, [-1e300]), f"utm[0]: utm 32N -1e+300 -1e+300 {BEYOND}"),
    (lambda: frametool.lla_from_utm("32N", math.nan, 0.0), "easting: nan is not finite; give finite numbers"),
]  # fmt: skip


@pytest.mark.parametrize(("act", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_what_utm_has_not_is_refused(act: Any, message: str) -> None:
    with pytest.raises(ValueInvalid) as caught:
        act()
    assert str(caught.value) == message
    assert len(message) <= 200


# row k: the factors of n^k and of the following powers in c_k (Karney 2011, eq. 35 and 36; Karney 2024)
FRACTIONS = {
    "ALONG": (
        (1 / 2, -2 / 3, 5 / 16, 41 / 180, -127 / 288, 7891 / 37800),
        (13 / 48, -3 / 5, 557 / 1440, 281 / 630, -1983433 / 1935360),
        (61 / 240, -103 / 140, 15061 / 26880, 167603 / 181440), (49561 / 161280, -179 / 168, 6601661 / 7257600),
        (34729 / 80640, -3418889 / 1995840), (212378941 / 319334400,),
    ),
    "BACK": (
        (-1 / 2, 2 / 3, -37 / 96, 1 / 360, 81 / 512, -96199 / 604800),
        (-1 / 48, -1 / 15, 437 / 1440, -46 / 105, 1118711 / 3870720), (-17 / 480, 37 / 840, 209 / 4480, -5569 / 90720),
        (-4397 / 161280, 11 / 504, 830251 / 7257600), (-4583 / 161280, 108847 / 3991680), (-20648693 / 638668800,),
    ),
    "CONFORMAL": (
        (-2, 2 / 3, 4 / 3, -82 / 45, 32 / 45, 4642 / 4725), (5 / 3, -16 / 15, -13 / 9, 904 / 315, -1522 / 945),
        (-26 / 15, 34 / 21, 8 / 5, -12686 / 2835), (1237 / 630, -12 / 5, -24832 / 14175),
        (-734 / 315, 109598 / 31185), (444337 / 155925,),
    ),
    "GEODETIC": (
        (2, -2 / 3, -2, 116 / 45, 26 / 45, -2854 / 675), (7 / 3, -8 / 5, -227 / 45, 2704 / 315, 2323 / 945),
        (56 / 15, -136 / 35, -1262 / 105, 73814 / 2835), (4279 / 630, -332 / 35, -399572 / 14175),
        (4174 / 315, -144838 / 6237), (601676 / 22275,),
    ),
}  # fmt: skip


def in_powers(factors: list[float], slope: float) -> tuple[float, ...]:
    """Return the polynomial sum of f_k p_k(x), where p_0 = 1, p_1 = slope x and p_k+1 = 2x p_k - p_k-1.

    Chebyshev's: of slope 1 cos kt = T_k(cos t), of slope 2 sin (k + 1)t = sin t U_k(cos t).
    """
    before, now = [0.0] * len(factors), [1.0] + [0.0] * (len(factors) - 1)
    total = [0.0] * len(factors)
    for k, factor in enumerate(factors):
        total = [part + factor * each for part, each in zip(total, now, strict=True)]
        step = 2.0 if k else slope
        before, now = now, [step * up - old for up, old in zip([0.0, *now], before, strict=False)]
    return tuple(total)


def sums(*rows: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the polynomials in cos 2x that are the sum of c_k sin 2kx over sin 2x, and its derivative.

    Row k holds the factors of n^k and of the following powers in c_k.
    """
    series = [mercator.N3**power * floats.polynomial(mercator.N3, (*row, 0.0)) for power, row in enumerate(rows, 1)]
    return in_powers(series, 2.0), in_powers([0.0, *(2.0 * k * part for k, part in enumerate(series, 1))], 1.0)


def test_the_coefficients_are_those_of_the_published_fractions() -> None:
    made = {name: sums(*rows) for name, rows in FRACTIONS.items()}
    assert {name: getattr(mercator, name) for name in FRACTIONS} == {
        name: polynomial for name, (polynomial, _) in made.items()
    }
    assert made["ALONG"][1] == mercator.ALONG_SLOPE


def test_the_polynomials_are_the_series_and_its_derivative() -> None:
    rows = (1.0, 2.0), (3.0,), (0.5,)
    polynomial, slope = sums(*rows)
    for x in (0.1, 0.7, 1.4):
        series = [sum(part * mercator.N3 ** (k + j) for j, part in enumerate(row)) for k, row in enumerate(rows, 1)]
        expected = sum(part * math.sin(2 * k * x) for k, part in enumerate(series, 1))
        assert math.sin(2 * x) * floats.polynomial(math.cos(2 * x), polynomial) == pytest.approx(expected, rel=1e-14)
        tilt = sum(2 * k * part * math.cos(2 * k * x) for k, part in enumerate(series, 1))
        assert floats.polynomial(math.cos(2 * x), slope) == pytest.approx(tilt, rel=1e-13)
