"""Positions on the Earth through the command: every form says the same numbers, and nothing is assumed."""

from __future__ import annotations

import csv
import io
import json
import math
import subprocess
import sys
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import earth_oracles
import numpy as np
import pytest
import yaml
from mpmath import mpf

import frametool
from frametool.geometry import earth, quaternion
from frametool.rows.conversion import NO_ROTATION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

GOLDEN = json.loads((Path(__file__).resolve().parent.parent / "golden" / "earth.json").read_text())
EPS = 2.0**-52
LAT, LON, ALT = 48.137, 11.576, 519.0
XYZ = list(frametool.ecef_from_lla(LAT, LON, ALT))
ZONE, EASTING, NORTHING, *_ = frametool.utm_from_lla(LAT, LON)
UTM = {"zone": ZONE, "easting": EASTING, "northing": NORTHING, "alt": ALT}
ORIGIN = "{lat: 48.1, lon: 11.5, alt: 520}"
SITE = f"frames: [{{name: map, parent: ecef, at: {ORIGIN}, axes: enu}}]"


def table(names: str, rows: Iterable[Iterable[Any]], delimiter: str = ",") -> str:
    """Write a table."""
    lines = [names.replace(",", delimiter), *(delimiter.join(str(each) for each in row) for row in rows)]
    return "\n".join(lines) + "\n"


def numbers(text: str) -> list[list[str]]:
    """Read the rows of a CSV."""
    return list(csv.reader(io.StringIO(text)))[1:]


def ecef_of(text: str) -> list[list[float]]:
    """Read the positions of a CSV, by name."""
    return [[float(row.get(f"ecef_{axis}") or row[axis]) for axis in "xyz"] for row in csv.DictReader(io.StringIO(text))]


def flat(value: Any) -> list[float]:
    """Return the numbers of a result in their order."""
    if isinstance(value, dict):
        return [each for name, part in value.items() if name != "frame" for each in flat(part)]
    return [each for part in value for each in flat(part)] if isinstance(value, list) else [value]


# --- one position, every form ---

DMS = "48°08'13.2\"N"
RECORDS = {
    "lla": {"lat": LAT, "lon": LON, "alt": ALT},
    "long names": {"latitude": LAT, "longitude": LON, "altitude": ALT},
    "lng height": {"lat": LAT, "lng": LON, "height": ALT},
    "hae": {"lat": LAT, "long": LON, "hae": ALT},
    "undulation": {"lat": LAT, "lon": LON, "msl": 470.0, "undulation": 49.0},
    "ele": {"lat": LAT, "lon": LON, "ele": 470.0, "geoid_separation": 49.0},
    "ecef": {"ecef": XYZ},
    "of a message": {"header": {"frame_id": "gps"}, "latitude": LAT, "longitude": LON, "altitude": ALT},
    "marks": {"lat": DMS, "lon": "11.576E", "alt": ALT},
}
NEARLY = {  # by another kernel: 5e-9 m
    "utm": {"utm": UTM},
    "flat utm": UTM,
    "utm_zone": {"utm_zone": ZONE, "easting": EASTING, "northing": NORTHING, "alt": ALT},
    "radians": {"lat_rad": math.radians(LAT), "lon_rad": math.radians(LON), "alt": ALT},
}
TABLES = {
    "lat,lon,alt": (LAT, LON, ALT),
    "latitude,longitude,altitude": (LAT, LON, ALT),
    "lon,lat,alt": (LON, LAT, ALT),
    "lat [deg],lng [deg],height [m]": (LAT, LON, ALT),
    "gps_lat,gps_lon,gps_alt": (LAT, LON, ALT),
    "field.latitude,field.longitude,field.altitude": (LAT, LON, ALT),
    "lat,lon,msl,undulation": (LAT, LON, 470.0, 49.0),
    "lat,lon,alt,field.status.service": (LAT, LON, ALT, 1),
    "ecef_x,ecef_y,ecef_z": XYZ,
}
TABLES_NEARLY = {
    "utm_zone,easting,northing,alt": (ZONE, EASTING, NORTHING, ALT),
    "zone,easting,northing,alt": (ZONE, EASTING, NORTHING, ALT),
    "lat_rad,lon_rad,alt": (math.radians(LAT), math.radians(LON), ALT),
}


@pytest.mark.parametrize("name", [*RECORDS, *NEARLY])
def test_a_record_says_the_same_as_argument_line_document_and_list(name: str, run: Callable[..., Any]) -> None:
    record = (RECORDS | NEARLY)[name]
    text = json.dumps(record, ensure_ascii=False)
    asked = ("convert", "--to", "ecef", "-f", "json")
    found = [
        run(*asked, text).out, run(*asked, stdin=text + "\n").out, run(*asked, stdin=json.dumps(record, indent=1)).out,
        run(*asked, stdin=f"{text}\n{text}\n").out.splitlines()[1], run(*asked, stdin=yaml.safe_dump(record)).out,
    ]  # fmt: skip
    told = [json.loads(each).get("point") or json.loads(each)["ecef"] for each in found]
    assert told == [told[0]] * 5
    assert told[0] == (XYZ if name in RECORDS else pytest.approx(XYZ, abs=5e-9))


@pytest.mark.parametrize("delimiter", [",", "\t", ";"])
@pytest.mark.parametrize("names", [*TABLES, *TABLES_NEARLY])
def test_columns_say_the_same_as_a_record(names: str, delimiter: str, run: Callable[..., Any]) -> None:
    row = (TABLES | TABLES_NEARLY)[names]
    done = run("convert", "--to", "ecef", stdin=table(names, [row] * 3, delimiter))
    assert (done.status, done.err) == (0, "")
    for cells in done.out.splitlines()[1:]:
        found = [float(each) for each in cells.split(delimiter)[:3]]
        assert found == (XYZ if names in TABLES else pytest.approx(XYZ, abs=5e-9))


@pytest.mark.parametrize(
    ("arguments", "stdin"),
    [
        (["--from", "lla", str(LAT), str(LON), str(ALT)], ""),
        (["--from", "lla"], f"{LAT} {LON} {ALT}\n"),
        (["--columns", "b,c,d", "--from", "lla"], table("a,b,c,d", [(1, LAT, LON, ALT)])),
        (["--columns", "lat,lon,alt", "--from", "lla"], table("x,y,z,lat,lon,alt", [(1, 2, 3, LAT, LON, ALT)])),
        (["--from", "ecef", *map(str, XYZ)], ""),
    ],
)
def test_numbers_and_columns_that_are_named_say_the_same(
    arguments: list[str], stdin: str, run: Callable[..., Any]
) -> None:
    done = run("convert", *arguments, "--to", "ecef", "-f", "json", stdin=stdin)
    assert (done.status, json.loads(done.out)["point"]) == (0, XYZ), done.err


def test_columns_of_numbers_say_the_same(run: Callable[..., Any], tmp_path: Path) -> None:
    made = np.zeros(3, [(name, np.float64) for name in ("lat", "lon", "alt")])
    made[:] = (LAT, LON, ALT)
    np.save(tmp_path / "a.npy", made)
    done = run("convert", "-i", "a.npy", "--to", "ecef", "-f", "csv")
    assert ecef_of(done.out) == [XYZ] * 3, done.err
    pytest.importorskip("pyarrow")
    rows = table("lat,lon,alt", [(LAT, LON, ALT)] * 3)
    assert run("convert", "-o", "a.parquet", "--to", "utm", stdin=rows).status == 0
    done = run("convert", "-i", "a.parquet", "--to", "ecef", "-f", "csv")
    assert ecef_of(done.out) == [pytest.approx(XYZ, abs=5e-9)] * 3, done.err


# --- there and back ---

PLACES = [
    (0.0, 0.0, 0.0), (90.0, 0.0, 100.0), (-90.0, 0.0, 100.0), (48.1, 11.5, 520.0), (12.0, 180.0, 5.0),
    (-33.8, -179.999999, -11000.0), (5.0, 60.0, 1e7), (60.0, 4.0, 3.0), (75.0, 20.9, 0.0), (78.0, 9.0, 0.0), (-0.1, 30.0, 1.0),
]  # fmt: skip
FORMS = ("lla", "ecef", "utm", "enu", "ned")


def through(run: Callable[..., Any], text: str, *forms: str) -> str:
    """Convert rows to one form after the other."""
    for before, form in zip(["", *forms], forms, strict=False):
        local = ["--origin", ORIGIN] if {before, form} & {"enu", "ned"} else []
        done = run("convert", "--to", form, *local, stdin=text)
        assert done.status == 0, done.err
        text = done.out
    return text


@pytest.mark.parametrize(("first", "second"), list(permutations(FORMS, 2)))
def test_every_pair_comes_back(first: str, second: str, run: Callable[..., Any]) -> None:
    places = [each for each in PLACES if "utm" not in (first, second) or abs(each[0]) < 80]
    text = through(run, table("lat,lon,alt", places), first, second, "ecef")
    for row, place in zip(numbers(text), places, strict=True):
        exact = frametool.ecef_from_lla(*place)
        assert [float(each) for each in row[:3]] == pytest.approx(exact, abs=8 * EPS * (7e6 + abs(place[2])))


@pytest.mark.parametrize("form", FORMS)
def test_a_row_alone_has_the_bits_that_it_has_among_many(form: str, run: Callable[..., Any]) -> None:
    draw = np.random.default_rng(3)
    rows = np.column_stack([draw.uniform(-79, 83, 10000), draw.uniform(-180, 180, 10000), draw.uniform(-1e4, 1e7, 10000)]).tolist()
    asked = ("convert", "--to", form, *(("--origin", ORIGIN) if form in ("enu", "ned") else ()))
    many = run(*asked, stdin=table("lat,lon,alt", rows)).out.splitlines()[1:]
    for at in range(0, 10000, 997):
        argument = json.dumps(dict(zip(("lat", "lon", "alt"), rows[at], strict=True)))
        one = json.loads(run(*asked, argument, "-f", "json").out)
        one.pop("frame", None)
        one = one.get("utm", one)
        found = [str(each) for each in flat(list(one.values()))][: 4 if form == "utm" else 3]
        assert found == many[at].split(",")[: len(found)]


# --- the goldens, to the goals ---


def test_goldens_of_ecef_and_back(run: Callable[..., Any]) -> None:
    rows = GOLDEN["ecef"]
    found = numbers(run("convert", "--to", "ecef", stdin=table("lat,lon,alt", [row[:3] for row in rows])).out)
    for row, cells in zip(rows, found, strict=True):
        goal = 2 * EPS * math.hypot(*row[3:])
        assert [float(each) for each in cells[:3]] == pytest.approx(row[3:], abs=goal)
    rows = GOLDEN["lla"]
    found = numbers(run("convert", "--to", "lla", stdin=table("ecef_x,ecef_y,ecef_z", [row[:3] for row in rows])).out)
    for row, cells in zip(rows, found, strict=True):
        lat, lon, alt = map(float, cells[:3])
        degree = math.pi / 180
        step = abs(row[3]) * EPS * degree  # what is written is one of the doubles in degrees
        assert abs(lat - row[3]) * degree <= 8e-16 + step
        arc = abs((lon - row[4] + 180) % 360 - 180) * degree * math.cos(row[3] * degree)
        assert arc <= 8e-16 + abs(row[4]) * EPS * degree
        assert abs(alt - row[5]) <= 2 * EPS * math.hypot(*row[:3])


def test_goldens_of_local_axes(run: Callable[..., Any]) -> None:
    for (lat, lon, alt), axes, point, xyz in GOLDEN["local"]:
        origin = json.dumps({"lat": lat, "lon": lon, "alt": alt})
        done = run("convert", "--from", "lla", *map(repr, point), "--to", axes, "--origin", origin, "-f", "json")
        wanted = pytest.approx(xyz, abs=5e-9 + 4 * EPS * math.hypot(*xyz))
        assert list(json.loads(done.out).values()) == wanted, done.err


@pytest.mark.parametrize("what", ["utm", "utm_forced"])
def test_goldens_of_utm(what: str, run: Callable[..., Any]) -> None:
    for lat, lon, zone, easting, northing, convergence, scale in GOLDEN[what]:
        held = ["--zone", zone] if what == "utm_forced" else []
        argument = json.dumps({"lat": lat, "lon": lon, "alt": 0.0})
        found = json.loads(run("convert", argument, "--to", "utm", "-f", "json", *held).out)["utm"]
        assert found["zone"] == zone
        assert [found["easting"], found["northing"]] == pytest.approx([easting, northing], abs=5e-9)
        assert found["convergence_deg"] == pytest.approx(convergence, abs=1e-12)
        assert found["grid_scale"] == pytest.approx(scale, abs=1e-14)
        back = json.loads(run("convert", json.dumps({"utm": found}), "--to", "lla", "-f", "json").out)
        # a step of the numbers, which were written once, is up to 2e-9 m
        assert back["lat"] == pytest.approx(lat, abs=1e-13)
        assert abs((back["lon"] - lon + 180) % 360 - 180) * math.cos(math.radians(lat)) < 2e-13


# --- rotations at a place ---


def base(axes: str, lat: float = LAT, lon: float = LON) -> np.ndarray:
    """Give the matrix of ecef_from_axes."""
    if axes == "ecef":
        return np.eye(3)
    enu = np.array(earth_oracles.axes(lat, lon, "ned" if axes == "ned" else "enu").tolist(), dtype=float)
    if axes != "grid":
        return enu
    turn = math.radians(float(earth_oracles.transverse_mercator(lat, mpf(lon) - 9)[2]))
    c, s = math.cos(turn), math.sin(turn)
    return np.asarray(enu @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))


def matrix(xyzw: Sequence[float]) -> np.ndarray:
    """Give the matrix of a quaternion."""
    return np.array(quaternion.to_matrix(*xyzw)).reshape(3, 3)


YAW = matrix(frametool.Rotation.from_rpy([0.1, -0.2, 0.7]).components)


@pytest.mark.parametrize("axes", ["enu", "ned", "grid", "ecef"])
def test_a_rotation_is_given_in_its_axes(axes: str, run: Callable[..., Any]) -> None:
    record = {"lat": LAT, "lon": LON, "alt": ALT, "rpy": [0.1, -0.2, 0.7]}
    rows = table("lat,lon,alt,roll,pitch,yaw", [(LAT, LON, ALT, 0.1, -0.2, 0.7)])
    by_row = table("lat,lon,alt,axes,roll,pitch,yaw", [(LAT, LON, ALT, each, 0.1, -0.2, 0.7) for each in ("enu", axes)])
    asked = ("convert", "--to", "ecef,quaternion")
    texts = [
        run(*asked, "-f", "json", json.dumps(record | {"axes": axes})).out,
        run(*asked, "-f", "json", "--local-axes", axes, json.dumps(record)).out,
        run(*asked, stdin=json.dumps(record | {"axes": axes}) + "\n").out,
    ]
    turned = [list(json.loads(each)["quaternion"].values()) for each in texts]
    turned += [list(map(float, numbers(run(*asked, "--local-axes", axes, stdin=rows).out)[0][4:8]))]
    turned += [list(map(float, numbers(run(*asked, stdin=by_row).out)[1][4:8]))]
    for each in turned:
        assert each == pytest.approx(turned[0], abs=2 * EPS)
        assert matrix(each) == pytest.approx(base(axes) @ YAW, abs=8 * EPS)


@pytest.mark.parametrize("axes", ["enu", "ned", "grid", "ecef"])
def test_a_rotation_is_turned_into_the_axes_of_a_fixed_origin(axes: str, run: Callable[..., Any]) -> None:
    record = {"lat": LAT, "lon": LON, "alt": ALT, "rpy": [0.1, -0.2, 0.7]}
    rows = table("lat,lon,alt,roll,pitch,yaw", [(LAT, LON, ALT, 0.1, -0.2, 0.7)])
    asked = ("convert", "--to", "enu,quaternion", "--local-axes", axes, "--origin", json.dumps({"lat": LAT - 3, "lon": LON + 5, "alt": 0}))
    results = [run(*asked, "-f", "json", json.dumps(record)), run(*asked, stdin=json.dumps(record) + "\n")]
    turned = [list(json.loads(each.out)["quaternion"].values()) for each in results]
    turned += [[float(cell) for name, cell in csv.DictReader(io.StringIO(run(*asked, stdin=rows).out)).__next__().items() if name[0] == "q"]]
    for each in turned:
        assert matrix(each) == pytest.approx(base("enu", LAT - 3, LON + 5).T @ base(axes) @ YAW, abs=8 * EPS)


@pytest.mark.parametrize(("axes", "yaw"), [("enu", 90.0 - 30.0), ("ned", 30.0), ("grid", 90.0 - 30.0)])
def test_a_heading_is_clockwise_from_the_north_of_its_axes(axes: str, yaw: float, run: Callable[..., Any]) -> None:
    place = {"lat": LAT, "lon": LON, "alt": ALT, "axes": axes}
    asked = ("convert", "--to", "ecef,quaternion", "-f", "json")
    wanted = json.loads(run(*asked, json.dumps(place | {"rpy_deg": [0, 0, yaw]})).out)["quaternion"]
    for heading in ({"heading_deg": 30}, {"heading_rad": math.pi / 6}, {"heading_deg": "30deg"}):
        found = json.loads(run(*asked, json.dumps(place | heading)).out)["quaternion"]
        assert list(found.values()) == pytest.approx(list(wanted.values()), abs=3 * EPS)
    rows = table("lat,lon,alt,heading_deg", [(LAT, LON, ALT, 30)])
    found = numbers(run("convert", "--to", "ecef,quaternion", "--local-axes", axes, stdin=rows).out)[0]
    assert list(map(float, found[4:8])) == pytest.approx(list(wanted.values()), abs=3 * EPS)


def test_a_heading_without_a_unit_stays_data_which_is_told(run: Callable[..., Any]) -> None:
    done = run("convert", "--to", "ecef", stdin=table("lat,lon,alt,heading", [(LAT, LON, ALT, 30)]))
    assert numbers(done.out) == [[*map(repr, XYZ), "30"]]
    assert done.err == "frametool: warning: stdin: 'heading' has no unit and stays data; name it heading_deg\n"


def test_yaw_in_the_grid_is_yaw_in_enu_plus_convergence(run: Callable[..., Any]) -> None:
    place = json.dumps({"lat": LAT, "lon": LON, "alt": ALT, "axes": "enu", "rpy_deg": [0, 0, 20]})
    found = json.loads(run("convert", place, "--to", "utm,rpy_deg", "-f", "json").out)
    assert found["axes"] == "grid"
    assert found["rpy_deg"]["yaw"] == pytest.approx(20 + found["utm"]["convergence_deg"], abs=1e-12)


# --- NavSatFix ---

COVARIANCE = [1.0, 0.1, 0.0, 0.1, 2.0, 0.3, 0.0, 0.3, 4.0]


def fix(ros: int, **changed: Any) -> dict[str, Any]:
    """Make a message as ROS 1 or 2 prints it."""
    stamp = {"secs": 1700000000, "nsecs": 5} if ros == 1 else {"sec": 1700000000, "nanosec": 5}
    header = ({"seq": 1} if ros == 1 else {}) | {"stamp": stamp, "frame_id": "gps"}
    made = {"header": header, "status": {"status": 0, "service": 1}, "latitude": LAT, "longitude": LON, "altitude": ALT}
    return made | {"position_covariance": COVARIANCE, "position_covariance_type": 3} | changed


NO_FIX = {"status": {"status": -1, "service": 1}}
NOTHING = {"latitude": math.nan, "longitude": math.nan, "altitude": math.nan}


def echoed(messages: Iterable[dict[str, Any]], form: str) -> str:
    """Print messages as JSON lines, or as the echo tools do."""
    if form == "json":
        return "".join(json.dumps(each) + "\n" for each in messages)
    return "".join(yaml.safe_dump(each, sort_keys=False, default_flow_style=None) + "---\n" for each in messages)


def plotted(messages: Sequence[dict[str, Any]]) -> str:
    """Print messages as `rostopic echo -p` does."""
    names = "%time,field.header.frame_id,field.status.status,field.status.service,field.latitude,field.longitude,field.altitude,"
    names += ",".join(f"field.position_covariance{at}" for at in range(9)) + ",field.position_covariance_type"
    rows = [
        (1700000000000000005, "gps", *each["status"].values(), each["latitude"], each["longitude"], each["altitude"],
         *each["position_covariance"], each["position_covariance_type"])
        for each in messages
    ]  # fmt: skip
    return table(names, rows)


@pytest.mark.parametrize("form", ["json", "yaml", "csv"])
@pytest.mark.parametrize("ros", [1, 2])
def test_a_fix_is_moved_with_its_covariance(ros: int, form: str, run: Callable[..., Any]) -> None:
    messages = [fix(ros), fix(ros, **NO_FIX), fix(ros, **NOTHING), fix(ros, latitude=95.0), fix(ros, latitude=LAT + 1)]
    text = plotted(messages) if form == "csv" else echoed(messages, form)
    done = run("apply", "site.yaml", "map", "--on-error", "skip", stdin=text, files={"site.yaml": SITE})
    assert done.status == 3
    if form == "csv":
        rows = [list(map(float, cells[4:16])) for cells in numbers(done.out)]
    else:
        found = [json.loads(each) for each in done.out.splitlines()] if form == "json" else list(filter(None, yaml.load_all(done.out, yaml.CSafeLoader)))
        assert [(each["frame"], each["name"], each["stamp_ns"]) for each in found] == [("map", "gps", 1700000000000000005)] * 2
        rows = [[*each["point"], *each["covariance"]] for each in found]
    map_from_ecef = base("enu", 48.1, 11.5).T
    for lat, row in zip((LAT, LAT + 1), rows, strict=True):
        turn = map_from_ecef @ base("enu", lat)
        assert np.array(row[3:]).reshape(3, 3) == pytest.approx(turn @ np.reshape(COVARIANCE, (3, 3)) @ turn.T, abs=2e-14)
        off = np.subtract(frametool.ecef_from_lla(lat, LON, ALT), frametool.ecef_from_lla(48.1, 11.5, 520.0))
        assert row[:3] == pytest.approx(map_from_ecef @ off, abs=5e-9)
    for told in ("status -1: there was no fix", "is not finite", "lat 95.0 is beyond 90 degrees; are lat and lon swapped?", "3 of 5 rows skipped"):
        assert told in done.err


# --- covariances and sigmas of rows ---


def test_the_sigmas_of_a_row_need_axes_and_are_turned(run: Callable[..., Any]) -> None:
    files = {"site.yaml": SITE}
    rows = table("lat,lon,alt,sigma_x,sigma_y,sigma_z", [(48.1, 11.5, 520, 1, 2, 3)])
    done = run("apply", "site.yaml", "map", stdin=rows, files=files)
    assert (done.status, done.out) == (1, "")
    wanted = "a row at lat, lon does not state the axes of its covariance; axes: enu, ned, grid or ecef; for rows --local-axes"
    assert done.err == f"frametool: stdin:1: {wanted}\n"
    for axes, wanted_ in (("enu", [1, 4, 9]), ("ned", [4, 1, 9])):
        done = run("apply", "site.yaml", "map", "--local-axes", axes, stdin=rows, files=files)
        entries = np.reshape([float(each) for each in numbers(done.out)[0][3:]], (3, 3))
        assert entries == pytest.approx(np.diag(wanted_), abs=2e-14)


# --- refusals ---

SEA = "'msl' is above sea level, alt above the ellipsoid; give undulation (the geoid there) too, or alt"
UNSAID = "a pose at lat, lon does not state the axes of its rotation; axes: enu, ned, grid or ecef; for rows --local-axes"
DATUM = "datum is not read, all is WGS84; leave it out, or convert from another one first (cs2cs, pyproj)"
EPSG = "codes of EPSG are not read; write utm_zone: 32N or lat, lon; convert from others first (cs2cs, pyproj)"
MGRS = "MGRS is not read; convert it to lat, lon first (GeoConvert, or python's mgrs)"
REFUSED: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {  # the sentence, a place, what stands beside it
    "swapped": ("lat 95.0 is beyond 90 degrees; are lat and lon swapped?", {"lat": 95.0, "lon": 11.5, "alt": 1}, {}),
    "far lon": ("lon 361.0 is beyond -180 to 360 degrees; give it within", {"lat": 1, "lon": 361.0, "alt": 1}, {}),
    "sea": (SEA, {"lat": 45.0, "lon": 11.5, "msl": 1}, {}),
    "ele": (SEA.replace("msl", "ele"), {"lat": 45.0, "lon": 11.5, "ele": 1}, {}),
    "elevation": (SEA.replace("msl", "elevation"), {"lat": 45.0, "lon": 11.5, "elevation": 1}, {}),
    "datum": (DATUM, {"lat": 45.0, "lon": 11.5, "alt": 1, "datum": "ETRS89"}, {}),
    "epsg": (EPSG, {"lat": 45.0, "lon": 11.5, "alt": 1, "epsg": 31467}, {}),
    "epsg of utm": (EPSG, {"epsg": 32632, "easting": 691607.86, "northing": 5334760.4, "alt": 1}, {}),
    "mgrs": (MGRS, {"mgrs": "32UPU9160734760"}, {}),
    "axes": (UNSAID, {"lat": 45.0, "lon": 11.5, "alt": 1}, {"qx": 0, "qy": 0, "qz": 0, "qw": 1}),
    "band": (
        "'32U': a band letter; write 32N, or 32S south of the equator",
        {"utm_zone": "32U", "easting": 691607.86, "northing": 5334760.4, "alt": 1}, {},
    ),
    "no hemisphere": (
        "zone '32' has no hemisphere; write 32N, or 32S south of the equator",
        {"utm_zone": "32", "easting": 691607.86, "northing": 5334760.4, "alt": 1}, {},
    ),
    "beyond utm": (
        "lat 86.0: UTM ends at 84 N and 80 S; use lla, ecef or enu",
        {"lat": 86.0, "lon": 11.5, "alt": 1}, {"axes": "grid", "qx": 0, "qy": 0, "qz": 0, "qw": 1},
    ),
    "a parent": (
        "utm is neither rigid nor a parent; place the frame: at: {utm: {..}}, axes: grid",
        {"lat": 45.0, "lon": 11.5, "alt": 1}, {"parent": "utm"},
    ),
    "another parent": (
        "lat places a frame in ecef; parent is 'map'", {"lat": 45.0, "lon": 11.5, "alt": 1}, {"parent": "map"},
    ),
    "no marks": (
        "'48 08 14.5': degrees, minutes and seconds need their marks: 48°08'14.5\"N", {"lat": "48 08 14.5", "lon": 1, "alt": 1}, {},
    ),
    "decimal comma": ("'48,137' has a decimal comma; write a point", {"lat": "48,137", "lon": 1, "alt": 1}, {}),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_is_refused_in_every_form(name: str, run: Callable[..., Any]) -> None:
    sentence, place, beside = REFUSED[name]
    record = place | beside
    if "qx" in record:
        record = {key: each for key, each in record.items() if key[0] != "q"} | {"xyzw": [0, 0, 0, 1]}
    at = {"utm": place | {"zone": place["utm_zone"]}} if "utm_zone" in place else place
    at = {"utm": {key: each for key, each in at["utm"].items() if key != "utm_zone"}} if "utm" in at else at
    frame = {"name": "a", "at": at} | ({"axes": "enu"} if name != "axes" else {}) | beside
    frame = {key: each for key, each in frame.items() if key[0] != "q"}
    document = json.dumps({"frames": [frame]}, ensure_ascii=False)
    done = [
        run("convert", json.dumps(record, ensure_ascii=False)),
        run("convert", stdin=json.dumps(record, ensure_ascii=False) + "\n"),
        run("convert", stdin=table(",".join(place | beside), [(place | beside).values()], ";")),
        run("lookup", "a.yaml", "ecef", "a", files={"a.yaml": document}),
    ]
    for each, kind in zip(done, ("argument", "record", "table", "tree"), strict=True):
        wanted = sentence.replace("lat places", "at places") if kind == "tree" else sentence
        assert each.status == (2 if kind == "argument" else 1), kind  # an argument that cannot be parsed
        first = each.err.splitlines()[0]
        assert first.endswith(wanted), (kind, each.err)
        assert first.startswith("frametool: ")
        assert len(first) <= 200
        assert "Traceback" not in each.err


def test_a_result_beyond_utm_says_so_in_every_form(run: Callable[..., Any]) -> None:
    place = {"lat": 86.0, "lon": 11.5, "alt": 1}
    for done in (
        run("convert", json.dumps(place), "--to", "utm"),
        run("convert", "--from", "lla", "86", "11.5", "1", "--to", "utm"),
        run("convert", "--to", "utm", stdin=json.dumps(place) + "\n"),
        run("convert", "--to", "utm", stdin=table("lat,lon,alt", [place.values()])),
    ):
        assert done.status == 1
        assert "lat 86.0: UTM ends at 84 N and 80 S; use lla, ecef or enu" in done.err


# --- what is told, once ---


def test_a_missing_alt_is_told_once(run: Callable[..., Any]) -> None:
    lines = '{"lat": 48.1, "lon": 11.5}\n' * 3000
    for stdin in (table("lat,lon", [(48.1, 11.5)] * 3000), lines):
        done = run("convert", "--to", "ecef", stdin=stdin)
        assert done.status == 0
        assert done.err.count("no alt: 0 is taken, on the ellipsoid") == 1
        assert len(done.err.splitlines()) == 1


@pytest.mark.parametrize("options", [[], ["-f", "json"]])
def test_a_zone_that_changes_is_told_once_with_the_row(options: list[str], run: Callable[..., Any]) -> None:
    places = [(48.1, 11.5, 0)] * 2000 + [(48.1, 12.5, 0), (48.1, 11.5, 0), (-48.1, 12.5, 0)] * 700
    done = run("convert", "--to", "utm", *options, stdin=table("lat,lon,alt", places))
    assert done.status == 0
    assert done.err == "frametool: warning: stdin:2002: the zone changes from 32N to 33N: another grid; --zone 32N holds one\n"
    lines = "".join(json.dumps({"lat": lat, "lon": lon, "alt": 0}) + "\n" for lat, lon, _ in places)
    done = run("convert", "--to", "utm", stdin=lines)
    assert done.err == "frametool: warning: stdin:2001: the zone changes from 32N to 33N: another grid; --zone 32N holds one\n"
    assert run("convert", "--to", "utm", "--zone", "32N", stdin=table("lat,lon,alt", places[:2500])).err == ""


def test_the_band_s_is_warned_of_in_every_form(run: Callable[..., Any]) -> None:
    wanted = "zone 32S with northing 4.03476e+06: S is south of the equator; the band S lies north, write N"
    place = {"utm_zone": "32S", "easting": 691607.86, "northing": 4034760.4, "alt": 1}
    text = json.dumps({"utm": {"zone": "32S"} | {key: each for key, each in place.items() if key != "utm_zone"}})
    rows = table(",".join(place), [place.values()] * 5)
    for done in (run("convert", text), run("convert", stdin=text + "\n"), run("convert", stdin=rows)):
        assert done.status == 0
        assert done.err.count(wanted) == 1


def test_x_y_z_beside_lat_lon_remain_the_position_which_is_told(run: Callable[..., Any]) -> None:
    files = {"site.yaml": SITE}
    rows = table("x,y,z,lat,lon,alt", [(1, 2, 3, LAT, LON, ALT)] * 3)
    done = run("apply", "--transform", "{xyz: [1, 1, 1]}", stdin=rows, files=files)
    assert numbers(done.out) == [["2.0", "3.0", "4.0", str(LAT), str(LON), str(ALT)]] * 3
    assert done.err.count("lat, lon stay data: x y z are the position; --columns lat,lon,alt --from lla turns it round") == 1
    done = run("apply", "site.yaml", "map", "--columns", "lat,lon,alt", "--from", "lla", "--prefix", "m_", stdin=rows, files=files)
    assert done.status == 0, done.err
    assert done.out.startswith("x,y,z,m_x,m_y,m_z\n")


# --- the first position as origin ---


def test_the_first_good_row_is_the_origin(run: Callable[..., Any]) -> None:
    places = [(95.0, 11.5, 0.0), (48.1, 11.5, 520.0), *[(48.1 + 1e-7 * at, 11.5, 520.0) for at in range(20000)]]
    done = run("convert", "--to", "enu", "--origin", "first", "--on-error", "skip", stdin=table("lat,lon,alt", places))
    assert done.status == 3
    assert done.err.count("frametool: origin: lat 48.1, lon 11.5, alt 520.0, the first position\n") == 1
    rows = numbers(done.out)
    assert rows[0] == ["0.0", "0.0", "0.0"]
    assert float(rows[-1][1]) == pytest.approx(0.0019999 * 111_195, rel=1e-3)


@pytest.mark.parametrize(("numbers", "mapping"), [("48,11.5,520", "{lat: 48, lon: 11.5, alt: 520}"), ("-48 , 11.5", "{lat: -48, lon: 11.5}"), ("48 11 5", "{lat: 48, lon: 11, alt: 5}")])
def test_an_origin_may_be_numbers(numbers: str, mapping: str, run: Callable[..., Any]) -> None:
    ours, told = (run("convert", "--to", "enu", "--origin", origin, stdin="lat,lon,alt\n48.1,11.5,5\n") for origin in (numbers, mapping))
    assert (ours.status, ours.out) == (0, told.out)
    for wrong in ("48", "1,2,3,4", "48,east"):
        assert run("convert", "--to", "enu", "--origin", wrong, stdin="lat,lon,alt\n48.1,11.5,5\n").status == 2


def test_a_pipe_in_pieces_has_the_first_row_as_its_origin_throughout(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "frametool", "convert", "--to", "enu", "--origin", "first"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path)
    assert process.stdin is not None
    process.stdin.write(b"lat,lon,alt\n48.1,11.5,520\n")
    process.stdin.flush()
    rest = b"".join(b"48.1001,11.5,520\n" for _ in range(5000))
    out, err = process.communicate(rest)
    assert err.count(b"origin:") == 1
    rows = out.decode().splitlines()
    assert rows[1] == "0.0,0.0,0.0"
    assert {*rows[2:]} == {rows[2]}


def test_points_stay_points_and_keep_what_is_not_ours(run: Callable[..., Any]) -> None:
    rows = table("id,lat,lon,alt,note", [(7, LAT, LON, ALT, "a b")] * 2)
    done = run("convert", stdin=rows)
    assert done.out.splitlines()[0] == "id,ecef_x,ecef_y,ecef_z,note"
    assert numbers(done.out) == [["7", *map(repr, XYZ), "a b"]] * 2


def test_a_row_that_names_its_parent_names_the_frame_it_is_moved_to(run: Callable[..., Any]) -> None:
    for parent in ("ecef", "earth"):
        rows = table("lat,lon,alt,parent", [(LAT, LON, ALT, parent)] * 2)
        done = run("apply", "site.yaml", "map", stdin=rows, files={"site.yaml": SITE})
        assert [cells[3] for cells in numbers(done.out)] == ["map", "map"], done.err


def test_arrays_and_floats_of_the_kernels_agree_with_what_streams_write(run: Callable[..., Any]) -> None:
    rows = GOLDEN["utm"]
    found = numbers(run("convert", "--to", "utm", stdin=table("lat,lon,alt", [(*row[:2], 0) for row in rows])).out)
    zone, easting, northing, *_ = frametool.utm_from_lla([row[0] for row in rows], [row[1] for row in rows])
    for at, cells in enumerate(found):
        assert cells[0] == zone[at]
        assert [float(each) for each in cells[1:3]] == pytest.approx([easting[at], northing[at]], abs=5e-9)


def test_the_snippets_of_the_docstrings_run() -> None:
    lines = [line.strip() for line in (earth.__doc__ or "").splitlines() if line.startswith("    ")]
    known: dict[str, Any] = {"frametool": frametool}
    exec("\n".join(lines[:-1]), known)  # noqa: S102 - as written there
    assert eval(lines[-1], known) == pytest.approx([0.0, 0.0, 1.0], abs=5e-9)  # noqa: S307
    assert "frametool.earth_pose" in (frametool.FrameTree.__doc__ or "")
    tree = frametool.FrameTree()
    tree.add("ecef", "map", frametool.earth_pose(48.1, 11.5, 520.0))
    tree.add("ecef", "site", frametool.earth_pose(48.1, 11.5, 530.0, axes="ned"))
    assert tree.lookup("map", "site").xyz == pytest.approx([0.0, 0.0, 10.0], abs=5e-9)


def test_columns_of_a_covariance_stay_only_where_their_axes_do(run: Callable[..., Any]) -> None:
    text = "lat,lon,alt,sigma_x,sigma_y,sigma_z\n48,11,5,1,1,2\n"
    kept = run("convert", "--to", "utm", "--local-axes", "enu", stdin=text)
    assert kept.out.splitlines()[1].endswith(",1,1,2")
    refused = run("convert", "--to", "ecef", "--local-axes", "enu", stdin=text)
    assert (refused.status, refused.out) == (1, "")
    assert "the covariance is along enu, the result along ecef; leave its columns out\n" in refused.err


def test_rows_of_lookups_say_places_in_json_too(run: Callable[..., Any]) -> None:
    site = "frames: [{name: map, at: {lat: 48.1, lon: 11.5, alt: 520}, axes: enu}]"
    asked = ("lookup", "site.yaml", "ecef", "--source-column", "f", "-i", "rows.csv", "--to", "lla", "-f", "json")
    done = run(*asked, files={"site.yaml": site, "rows.csv": "t,f\n1,map\n"})
    row = json.loads(done.out)
    assert (row["parent"], row["axes"], row["f"], round(row["lat"], 9)) == ("ecef", "enu", "map", 48.1)


def test_what_has_no_effect_is_an_error(run: Callable[..., Any]) -> None:
    grid, places = "691607,5334760,5\n", "lat,lon,alt\n48.1,11.5,5\n"
    for arguments, text, told in (
        (("--from", "utm", "--zone", "32N", "--to", "lla"), f"utm_zone,easting,northing,alt\n33N,{grid}", "--zone has no effect"),
        (("--from", "utm", "--zone", "32N", "--to", "lla"), f"e,n,h\n{grid}", "no columns of utm"),
        (("--from", "lla", "--to", "ecef"), f"x,y,z\n{grid}", "no columns of lla"),
        (("--to", "lla", "--local-axes", "ned"), places, "--local-axes has no effect"),
        (("--to", "lla", "--origin", "first"), places, "--origin first has no effect"),
    ):
        done = run("convert", *arguments, stdin=text)
        assert done.status != 0
        assert told in done.err
    done = run("convert", "--from", "utm", "--zone", "32N", "--to", "lla", stdin=f"x,y,z\n{grid}")
    assert done.out == run("convert", "--from", "utm", "--zone", "32N", "--to", "lla", stdin=f"easting,northing,alt\n{grid}").out


def test_positions_on_the_earth_are_no_frames_and_poses_there_are_of_ecef(run: Callable[..., Any]) -> None:
    rows = "stamp,lat,lon,alt{}\n0,48,11,520{}\n"
    for command in ("tree", "view"):
        done = run(command, "fixes.csv", files={"fixes.csv": rows.format("", "")})
        assert (done.status, done.err) == (1, f"frametool: fixes.csv:1: {NO_ROTATION.format('stamp, lat, lon, alt')}\n")
    done = run("tree", "fixes.csv", files={"fixes.csv": rows.format(",heading_deg,axes", ",30,enu")})
    assert (done.status, done.err) == (0, "frametool: fixes.csv: 1 pose of body in ecef (--frames)\n")


FIX = (
    '{"header": {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "gps"}, "latitude": 48.1, "longitude": 11.5, '
    '"altitude": 520.0, "position_covariance": [1, 0, 0, 0, 1, 0, 0, 0, 1], "position_covariance_type": 2}\n'
)


def test_from_one_fix_to_the_next_the_covariances_of_both_add_up(run: Callable[..., Any]) -> None:
    done = run("relative", "--consecutive", stdin=2 * FIX)
    covariance = json.loads(done.out.splitlines()[1])["covariance"]
    assert covariance[::7] == pytest.approx([2.0, 2.0, 2.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("form", ["json", "yaml"])
@pytest.mark.parametrize(("words", "key"), [
    (("ecef",), "covariance"), (("utm",), ""), (("ned", "--origin", "48,11,0"), ""), (("lla",), "position_covariance"),
    (("enu", "--origin", "first"), "position_covariance"), (("utm", "--local-axes", "enu"), "position_covariance"),
])  # fmt: skip
def test_the_covariance_of_a_fix_is_along_the_axes_of_the_result(words: tuple[str, ...], key: str, form: str, run: Callable[..., Any]) -> None:
    done = run("convert", "--to", *words, "-f", "json", stdin=echoed([fix(2)], form))
    found = json.loads(done.out)
    assert [each for each in found if "covariance" in each and "type" not in each] == [key] * bool(key)
    assert ("covariances left out: a result at a place has none" in done.err) == (not key)
    assert ("position_covariance_type" in found) == (key == "position_covariance")
    turn = base("enu", LAT) if key == "covariance" else np.eye(3)
    if key:
        assert np.array(found[key]).reshape(3, 3) == pytest.approx(turn @ np.reshape(COVARIANCE, (3, 3)) @ turn.T, abs=2e-14)


@pytest.mark.parametrize("to", ["lla", "utm", "ecef", "quaternion"])
def test_a_covariance_in_ecef_stays_in_ecef_only(to: str, run: Callable[..., Any]) -> None:
    record = json.dumps({"frame": "ecef", "point": XYZ, "covariance": COVARIANCE}) + "\n"
    done, is_kept = run("convert", "--to", to, stdin=record), to in ("ecef", "quaternion")
    assert ("covariance" in json.loads(done.out), "covariances left out" in done.err) == (is_kept, not is_kept)
    if to != "quaternion":
        cells = ",".join(map(str, ["ecef", *XYZ, *COVARIANCE]))
        done = run("convert", "--to", to, stdin=f"frame,x,y,z,c11,c12,c13,c21,c22,c23,c31,c32,c33\n{cells}\n")
        assert (done.status, "the covariance is along ecef" in done.err) == ((0, False) if is_kept else (1, True))
    fix_in_lla = run("convert", "--to", "lla", stdin=FIX).out
    assert ("position_covariance" in json.loads(run("convert", "--to", to, stdin=fix_in_lla).out)) == (to == "lla")


def test_an_expression_over_fixes_leaves_their_covariances(run: Callable[..., Any]) -> None:
    assert json.loads(run("calc", "d = norm(row)", stdin=FIX).out)["d"] == pytest.approx(6366854.272197201)


def test_the_mean_of_flat_keys_in_ecef_is_in_ecef(run: Callable[..., Any]) -> None:
    done = run("mean", stdin='{"ecef_x": 4177000.0, "ecef_y": 855000.0, "ecef_z": 4728000.0}\n')
    assert done.out.startswith("parent: ecef\nxyz: [4177000.0, 855000.0, 4728000.0]\n"), done.err


def test_a_covariance_beside_a_place_is_along_its_axes_or_left_out(run: Callable[..., Any]) -> None:
    site = {"site.yaml": "{frames: [{name: map, parent: ecef, lat: 48.1, lon: 11.5, alt: 0, axes: enu}]}"}
    table = "lat,lon,alt,sigma_x,sigma_y,sigma_z\n48.1,11.5,0,1,2,3\n"
    origin = ("--to", "enu", "--origin", "48.1,11.5,0")
    moved = run("apply", "site.yaml", "ecef", "--local-axes", "enu", *origin, stdin=table, files=site)
    assert (moved.status, moved.out) == (1, "")
    assert moved.err == "frametool: stdin:1: the covariance is along ecef, the result along enu; leave its columns out\n"
    record = '{"lat": 0, "lon": 0, "alt": 0, "position_covariance": [1, 0, 0, 0, 4, 0, 0, 0, 9]}\n'
    left = run("apply", "site.yaml", "ecef", "--to", "lla", stdin=record, files=site)
    assert left.out == '{"lat": 0.0, "lon": 0.0, "alt": 0.0}\n'
    assert left.err == "frametool: warning: stdin:1:1: covariances left out: a result at a place has none\n"
    for text in (table, record):
        stays = run("convert", "--local-axes", "enu", *origin, stdin=text)
        assert stays.status == 0
        assert "the covariance stays along enu at each position, which far from the origin differ" in stays.err


FIX_RECORD = '{%s"latitude": 10, "longitude": 20, "altitude": 5, "position_covariance": [1, 0, 0, 0, 4, 0, 0, 0, 9], "position_covariance_type": 2}\n'
OF_FIX = [f"field.position_covariance{at}" for at in range(9)]
FIX_ROWS = f"field.latitude,field.longitude,field.altitude,{','.join(OF_FIX)}\n10,20,5,1,0,0,0,4,0,0,0,9\n"


@pytest.mark.parametrize("before", ["", '"header": {"frame_id": "gps"}, ', '"axes": "ned", '])
def test_that_of_a_fix_turns_with_its_axes_or_is_told(run: Callable[..., Any], before: str) -> None:
    """It is along east, north, up there, with a header and without, whatever axes a rotation would have."""
    record = FIX_RECORD % before
    turn = frametool.earth_pose(10.0, 20.0, 5.0).rotation.as_matrix()
    at_ecef = run("convert", "-f", "json", stdin=record)
    found = json.loads(at_ecef.out)
    assert found["covariance"] == pytest.approx((turn @ np.diag([1.0, 4.0, 9.0]) @ turn.T).ravel(), rel=1e-14)
    assert not any(key.startswith("position_cov") for key in found)
    assert at_ecef.err == ""
    for command in (("convert", "--to", "utm"), ("calc", "row"), ("apply", "--transform", "{parent: ecef, name: ecef, rpy: [0, 1, 0]}", "--to", "lla")):
        left = run(*command, stdin=record)
        assert "covariances left out" in left.err
        assert "covariance" not in left.out
    there = run("convert", "--to", "enu", "--origin", "48,11,0", stdin=record)
    assert there.err.endswith("the covariance stays along enu at each position, which far from the origin differ from those there\n")
    assert json.loads(run("convert", "--to", "lla", stdin=record).out)["position_covariance"] == [1, 0, 0, 0, 4, 0, 0, 0, 9]
    assert "position_covariance" in run("calc", "-e", "a=norm(row)", stdin=record).out


@pytest.mark.parametrize("fmt", ["csv", "json"])
def test_columns_of_that_of_a_fix_are_told_where_they_stay_and_left_out_of_calc(run: Callable[..., Any], fmt: str) -> None:
    for to, stays in (("lla", True), ("ecef", False), ("utm", False), ("enu", False)):
        origin = ["--origin", "48,11,0"] if to == "enu" else []
        told = run("convert", "--to", to, *origin, "-f", fmt, stdin=FIX_ROWS)
        assert ("and 6 more stay along east, north, up at each position" in told.err) != stays
        assert OF_FIX[8] in told.out
    assert OF_FIX[0] not in run("calc", "row", "-f", fmt, stdin=FIX_ROWS).out
    added = run("calc", "-e", "a=norm(row)", stdin=FIX_ROWS)
    assert OF_FIX[0] in added.out
    assert added.err == ""
    along_enu = FIX_ROWS.replace("field.position_covariance", "c").replace(",".join(f"c{at}" for at in range(9)), "c11,c12,c13,c21,c22,c23,c31,c32,c33")
    stays = run("convert", "--to", "lla", "--local-axes", "enu", "-f", fmt, stdin=along_enu)
    assert (stays.status, stays.err) == (0, "")
    assert "c33" in stays.out


@pytest.mark.parametrize("to", [["lla"], ["utm"], ["enu", "--origin", "48.1,11.5,0"]])
def test_the_spread_of_a_mean_is_along_ecef_and_left_out_at_a_place(run: Callable[..., Any], to: list[str]) -> None:
    rows = "lat,lon,alt\n48.1,11.5,0\n48.2,11.5,0\n"
    assert {"std_x", "covariance"} <= json.loads(run("mean", "--to", "ecef", "-f", "json", stdin=rows).out).keys()
    done = run("mean", "--to", *to, "-f", "json", stdin=rows)
    assert done.err == "frametool: warning: covariances left out: a mean at a place has none\n"
    found = json.loads(done.out)
    assert found["distance_rms"] == pytest.approx(5560.0, rel=1e-3)
    assert not {"std_x", "covariance"} & found.keys()


def test_a_trajectory_of_positions_is_resampled_at_places(run: Callable[..., Any]) -> None:
    rows = "t,lat,lon,alt\n0,48,11,500\n1,48,11,500\n2,48,11,500\n"
    found = run("resample", "gps.csv", "--rate", "1", "--to", "utm", "-f", "csv", files={"gps.csv": rows}).out.splitlines()
    assert (found[0], len(found)) == ("utm_zone,easting,northing,alt,stamp_ns", 4)
    same = run("convert", "--to", "utm", stdin=rows).out.splitlines()[1].split(",")
    assert [float(each) for each in found[1].split(",")[1:4]] == pytest.approx([float(each) for each in same[2:5]], abs=1e-6)
