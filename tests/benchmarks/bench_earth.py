"""Time places on the Earth against plain numpy in one process: `python tests/benchmarks/bench_earth.py [ROWS]`.

Then whole commands, `python tests/benchmarks/bench_earth.py ROWS commands` these alone.

The ratio is to numpy's own sines and the textbook's formula of to-ECEF, which knows no checks; pyproj stands beside
where it is installed.  Then how far results are off, against 60 digits, and whether floats and arrays agree to the bit.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).parents[2]))

import earth_oracles
import mpmath
import numpy as np
from bench_geometry import processor
from mpmath import mpf

import frametool
from frametool.geometry import earth

if TYPE_CHECKING:
    from collections.abc import Callable

ROUNDS, CHECKED = 9, 400
RANGES = {"-11 km to 10 000 km": (-11e3, 1e7), "to 5000 km down": (-5e6, 0.0), "to 1e9 km up": (1e7, 1e12)}


def plain(lat: Any, lon: Any, alt: Any) -> Any:
    """Give x, y, z by numpy alone."""
    s, c = np.sin(np.radians(lat)), np.cos(np.radians(lat))
    normal = earth.A / np.sqrt(1.0 - earth.E2 * s * s)
    across = (normal + alt) * c
    x, y = across * np.cos(np.radians(lon)), across * np.sin(np.radians(lon))
    return np.stack([x, y, (normal * (1.0 - earth.E2) + alt) * s], axis=-1)


def cases(rows: int) -> dict[str, tuple[float, Callable[[], Any]]]:
    """List what is timed, each with the ratio it is to stay below, 0 for none."""
    generator = np.random.default_rng(0)
    lat, lon = generator.uniform(-80, 84, rows), generator.uniform(-180, 180, rows)
    near, alt = 9.0 + generator.uniform(-3, 3, rows), generator.uniform(0.0, 5000.0, rows)
    xyz = frametool.ecef_from_lla(lat, lon, alt)
    _, easting, northing, *_ = frametool.utm_from_lla(lat, near, "32N")
    found: dict[str, tuple[float, Callable[[], Any]]] = {
        "plain numpy, to ECEF": (0.0, lambda: plain(lat, lon, alt)),
        "to ECEF": (1.5, lambda: frametool.ecef_from_lla(lat, lon, alt)),
        "to lat, lon, alt": (2.2, lambda: frametool.lla_from_ecef(xyz)),
        "to UTM, zone by the rule": (4.0, lambda: frametool.utm_from_lla(lat, lon)),
        "to UTM, one zone": (4.0, lambda: frametool.utm_from_lla(lat, near, "32N")),
        "from UTM, one zone": (4.0, lambda: frametool.lla_from_utm("32N", easting, northing)),
        "poses, enu": (0.0, lambda: frametool.earth_pose(lat, lon, alt)),
    }
    try:
        from pyproj import Transformer
    except ImportError:
        return found
    to_ecef = Transformer.from_crs(4979, 4978, always_xy=True).transform
    to_lla = Transformer.from_crs(4978, 4979, always_xy=True).transform
    to_utm = Transformer.from_crs(4326, 32632, always_xy=True).transform
    found["pyproj, to ECEF"] = 0.0, lambda: to_ecef(lon, lat, alt)
    found["pyproj, to lat, lon, alt"] = 0.0, lambda: to_lla(xyz[:, 0], xyz[:, 1], xyz[:, 2])
    found["pyproj, to UTM, one zone"] = 0.0, lambda: to_utm(near, lat)
    return found


def speed_table(rows: int) -> list[str]:
    """Time all in turns, in seconds of the processor, the best of several; give the rows of the table."""
    timed = cases(rows)
    best = dict.fromkeys(timed, np.inf)
    for _ in range(ROUNDS):
        for name, (_, act) in timed.items():
            start = time.process_time()
            act()
            best[name] = min(best[name], time.process_time() - start)
    reference = best["plain numpy, to ECEF"]
    table = []
    for name, (goal, _) in timed.items():
        ratio = best[name] / reference
        verdict = f"{goal:g}{'' if ratio <= goal else ' missed'}" if goal else ""
        table.append(f"| {name} | {best[name] / rows * 1e9:.1f} | {ratio:.2f} | {verdict} |")
    return table


def places(depth: float, height: float) -> Any:
    """Draw places, some near the poles and the date line."""
    generator = np.random.default_rng(1)
    gaps = 10.0 ** generator.uniform(-12, 0, (2, CHECKED))
    lat = np.where(generator.random(CHECKED) < 0.7, generator.uniform(-90, 90, CHECKED), 90.0 - gaps[0])
    lon = np.where(generator.random(CHECKED) < 0.7, generator.uniform(-180, 180, CHECKED), 180.0 - gaps[1])
    return np.stack([lat, lon, generator.uniform(depth, height, CHECKED)], axis=-1)


def accuracy_table() -> list[str]:
    """Give the worst errors of ECEF and back in each range of heights."""
    table = []
    for name, (depth, height) in RANGES.items():
        worst = np.zeros(4)
        for lat, lon, alt in places(depth, height).tolist():
            exact = earth_oracles.ecef(lat, lon, alt)
            xyz, radius = [float(part) for part in exact], earth_oracles.length(exact)
            off = max(abs(a - b) for a, b in zip(frametool.ecef_from_lla(lat, lon, alt), exact, strict=True))
            found, (lat_rad, lon_rad, height_) = frametool.lla_from_ecef(xyz), earth_oracles.lla(xyz, lat)
            turned = abs(mpf(found[1]) * earth_oracles.DEGREE - lon_rad)
            arc = min(turned, 2 * mpmath.pi - turned) * earth_oracles.sine_cosine(lat)[1]
            lat_off = abs(mpf(found[0]) * earth_oracles.DEGREE - lat_rad)
            alt_off = abs(found[2] - height_) / radius
            errors = (off / radius / earth_oracles.EPS, lat_off, arc, alt_off / earth_oracles.EPS)
            worst = np.maximum(worst, [float(error) for error in errors])
        table.append(f"| {name} | {worst[0]:.2f} | {worst[1]:.1e} | {worst[2]:.1e} | {worst[3]:.2f} |")
    return table


def mercator_table() -> list[str]:
    """Give the worst errors of UTM, 3 and 30 degrees to each side of the meridian, and of the way back."""
    table = []
    for reach in (3.0, 30.0):
        generator = np.random.default_rng(2)
        lats, lons = generator.uniform(-80, 84, CHECKED // 2), 9.0 + generator.uniform(-reach, reach, CHECKED // 2)
        worst = np.zeros(5)
        for lat, lon in zip(lats.tolist(), lons.tolist(), strict=True):
            easting, northing, convergence, scale = earth_oracles.transverse_mercator(lat, mpf(lon) - 9)
            _, *found = frametool.utm_from_lla(lat, lon, "32N")
            exact = 500_000 + easting, northing, convergence, scale
            off = [abs(float(a - b)) for a, b in zip(found, exact, strict=True)]
            back = frametool.lla_from_utm("32N", found[0], found[1])
            worst = np.maximum(worst, [*off, max(abs(back[0] - lat), abs(back[1] - lon) * np.cos(np.radians(lat)))])
        table.append(f"| {reach:g} degrees | {' | '.join(f'{error:.1e}' for error in worst)} |")
    return table


def same_bits() -> str:
    """Count the places where floats and arrays agree to the bit."""
    given = np.concatenate([places(*bounds) for bounds in RANGES.values()] * 3)[:3000]
    xyz = frametool.ecef_from_lla(*given.T)
    back = np.stack(frametool.lla_from_ecef(xyz), axis=-1)
    zone, *grid = frametool.utm_from_lla(given[:, 0] * 0.88, given[:, 1])
    same = 0
    for row, place in enumerate(given.tolist()):
        one = frametool.ecef_from_lla(*place)
        utm = frametool.utm_from_lla(place[0] * 0.88, place[1])
        together = (*xyz[row].tolist(), *back[row].tolist(), zone[row], *(float(part[row]) for part in grid))
        same += (*one, *frametool.lla_from_ecef(one), *utm) == together
    return f"floats and arrays: the same bits at {same} of {len(given)} places"


SITE = "frames: [{name: map, at: {lat: 48.1, lon: 11.5, alt: 520}, axes: enu}]\n"
COMMANDS = {  # the first is what the others are compared with
    "convert of poses, --to rpy": ["convert", "-i", "poses.csv", "--to", "rpy"],
    "convert, lat lon alt to ecef": ["convert", "-i", "gps.csv", "--to", "ecef"],
    "convert, lat lon alt to utm": ["convert", "-i", "gps.csv", "--to", "utm"],
    "apply to a map": ["apply", "site.yaml", "map", "-i", "gps.csv"],
}
SCALARS = {
    "convert of a rotation": ["convert", "--from", "rpy_deg", "0", "0", "90", "--to", "matrix"],
    "convert, lat lon alt to ecef": ["convert", "--from", "lla", "48.1", "11.5", "520", "--to", "ecef"],
    "convert, lat lon alt to utm": ["convert", "--from", "lla", "48.1", "11.5", "520", "--to", "utm"],
    "lookup of two placed frames": ["lookup", "site.yaml", "ecef", "map", "--to", "lla"],
}


def cost(arguments: list[str], folder: Path) -> tuple[float, float]:
    """Run a command; give the seconds of its processor and its peak of memory in MB."""
    with (folder / "out").open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, "-m", "frametool", *arguments], cwd=folder, stdout=out, stderr=subprocess.DEVNULL
        )
        _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def command_table(rows: int, folder: Path) -> list[str]:
    """Time whole commands in turns, the least of three; give the rows of the table."""
    draw = np.random.default_rng(4)
    lla = np.column_stack([draw.uniform(-80, 84, rows), draw.uniform(-180, 180, rows), draw.uniform(0, 5000, rows)])
    xyzw = draw.normal(size=(rows, 4))
    poses = np.column_stack([draw.normal(size=(rows, 3)), xyzw / np.linalg.norm(xyzw, axis=1, keepdims=True)])
    np.savetxt(folder / "gps.csv", lla, "%.9f", ",", header="lat,lon,alt", comments="")
    np.savetxt(folder / "poses.csv", poses, "%.17g", ",", header="x,y,z,qx,qy,qz,qw", comments="")
    (folder / "site.yaml").write_text(SITE)
    best = dict.fromkeys(COMMANDS, (np.inf, np.inf))
    for _ in range(3):
        for name, arguments in COMMANDS.items():
            best[name] = min(best[name], cost(arguments, folder))
    first = best[next(iter(COMMANDS))][0]
    table = [f"| {name} | {s:.2f} | {s / first:.2f} | {mb:.0f} |" for name, (s, mb) in best.items()]
    starts = {name: min(cost(arguments, folder)[0] for _ in range(15)) for name, arguments in SCALARS.items()}
    first = starts[next(iter(SCALARS))]
    return [*table, *(f"| one: {name} | {s:.3f} | {s / first:.2f} | |" for name, s in starts.items())]


def main() -> None:
    """Print the tables."""
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    with tempfile.TemporaryDirectory() as folder:
        print("| command | processor, s | ratio | MB |\n|---|---|---|---|", *command_table(rows, Path(folder)), sep="\n")
    if sys.argv[2:] == ["commands"]:
        return
    print(f"{rows} rows; {processor()}, numpy {np.__version__}\n")
    print("| operation | ns a row | ratio | goal |\n|---|---|---|---|", *speed_table(rows), sep="\n")
    print("\n| height | to ECEF, eps r (goal 2) | lat, rad (8e-16) | lon, rad of arc (8e-16) | alt, eps r (2) |")
    print("|---|---|---|---|---|", *accuracy_table(), sep="\n")
    print("\n| beside the meridian | easting, m (5e-9) | northing, m (5e-9) | convergence, deg (1e-12) | scale (1e-14) | back, deg |")
    print("|---|---|---|---|---|---|", *mercator_table(), sep="\n")
    print(f"\n{same_bits()}")


if __name__ == "__main__":
    main()
