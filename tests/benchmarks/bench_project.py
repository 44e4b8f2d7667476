"""Time cameras beside OpenCV, one thread each: `python tests/benchmarks/bench_project.py [POINTS]`.

The commands first, file to nowhere: rows a second beside `apply`, and whether their memory grows with the rows.  Then
points to pixels beside `cv2.projectPoints` and `cv2.fisheye.projectPoints` where OpenCV is installed, pixels to points,
and how far what is projected comes back from where it was.  Then in how much of a lidar sweep each draws points that a
folding distortion does not hold for (opencv#17768).
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from frametool.geometry.camera import Camera

if TYPE_CHECKING:
    from collections.abc import Callable

ROUNDS = 5
FASTER = {"plumb_bob": 3.0, "rational_polynomial": 3.0, "thin_prism": 3.0, "equidistant": 1.0}  # than OpenCV
SECONDS = 6.0  # for a million pixels back
OF_APPLY = 0.6  # of its rows a second
PART = 10_000  # rows that are drawn at once
GROWTH = 1.2  # of memory from a quarter of the rows to all
ROOT = Path(__file__).parents[2]
RIG = str(ROOT / "examples" / "cameras.yaml")
MEASURE = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
"""  # in a small process: the memory of a process counts that of the one it was forked from
COMMANDS = {
    "apply": ["apply", RIG, "cam_front", "lidar"],
    "project": ["project", RIG, "cam_front", "lidar"],
    "unproject --ground": ["unproject", RIG, "map", "cam_front", "--ground", "map", "--columns", "x,y", "--prefix", "p_"],
}
CAMERAS = (
    Camera("pinhole", [500.5, 510.25, 320.5, 239.75]),
    Camera("plumb_bob", [461.6, 460.3, 363.0, 248.1], [-0.2834, 0.0739, 0.000193, 1.7e-05]),
    Camera("rational_polynomial", [1200.0, 1201.5, 960.2, 601.4], [12.4, 5.91, 0.00031, -0.00012, 0.22, 12.8, 10.31, 1.52]),
    Camera("thin_prism", [700.0, 702.0, 640.0, 360.0], [-0.11, 0.03, 0.0004, -0.0003, 0.002, 0.05, 0.01, 0.0003, 0.0012, -0.0002, -0.0009, 0.0001]),
    Camera("equidistant", [287.1, 286.9, 319.2, 241.8], [-0.0131, 0.0209, -0.0127, 0.0025]),
    Camera("omni", [1025.4, 1024.1, 512.3, 384.9], [-0.21, 0.14, 0.0007, -0.0011], xi=1.47),
    Camera("ds", [309.3, 320.5, 639.2, 513.7], xi=-0.1867, alpha=0.586),
    Camera("eucm", [453.2, 446.0, 637.0, 508.9], alpha=0.6321, beta=1.017),
    Camera("fov", [421.0, 425.9, 368.6, 248.0], w=0.9498),
)


def best(call: Callable[[], Any]) -> float:
    """Give the least time of some rounds in seconds."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def of_opencv(cv2: Any, camera: Camera, points: Any) -> Callable[[], Any] | None:
    """Make the call of OpenCV for the same points; None where it has no such model."""
    if cv2 is None or camera.model not in FASTER:
        return None
    home = cv2.fisheye if camera.model == "equidistant" else cv2
    given, still, d = points.reshape(-1, 1, 3), np.zeros(3), np.array(camera.D)
    return lambda: home.projectPoints(given, still, still, camera.K, d)[0]


def sweep(count: int) -> Any:
    """Draw the points of a lidar around a camera."""
    drawn = np.random.default_rng(1)
    around, up, far = drawn.uniform(-np.pi, np.pi, count), drawn.uniform(-0.43, 0.2, count), drawn.uniform(2, 60, count)
    return np.column_stack([far * np.cos(up) * np.sin(around), -far * np.sin(up), far * np.cos(up) * np.cos(around)])


def spent(arguments: list[str], path: Path) -> tuple[float, float]:
    """Give the processor seconds of a command on a file, the least of some rounds, and its memory in MB."""
    line = [sys.executable, "-c", MEASURE, sys.executable, "-m", "frametool", *arguments, "-i", str(path), "--quiet"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    found = [subprocess.run(line, capture_output=True, text=True, env=environment, check=True).stdout for _ in range(ROUNDS)]
    seconds, memory = zip(*(map(float, each.split()) for each in found), strict=True)
    return min(seconds), max(memory) / 1024


def commands(count: int) -> list[str]:
    """Print rows a second and memory of the commands; return which goals are missed."""
    missed, rates, drawn = [], {}, np.random.default_rng(2)
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / name for name in ("quarter.csv", "all.csv")]
        for path, rows in zip(paths, (count // 4, count), strict=True):
            with path.open("w") as file:
                file.write("x,y,z\n")
                for _ in range(rows // PART):
                    np.savetxt(file, drawn.normal(size=(PART, 3)) * 10.0, "%.6f", ",")
        for name, arguments in COMMANDS.items():
            (_, less), (seconds, memory) = (spent(arguments, path) for path in paths)
            rates[name] = count / seconds
            ratio = rates[name] / rates["apply"]
            print(f"{name:22s} {rates[name]:10.0f} rows/s, {ratio:.2f} of apply; {memory:.0f} MB, of a quarter of them {less:.0f}")
            missed += [f"{name}: {ratio:.2f} of apply"] if name == "project" and ratio < OF_APPLY else []
            missed += [f"{name}: memory grows"] if memory > GROWTH * less else []
    return missed


def main(count: int) -> None:
    """Print the tables; exit with 1 where a goal is missed."""
    try:
        cv2: Any = importlib.import_module("cv2")
        cv2.setNumThreads(1)
    except ImportError:
        cv2 = None
    drawn = np.random.default_rng(0)
    points = np.column_stack([drawn.uniform(-5, 5, count), drawn.uniform(-5, 5, count), drawn.uniform(4, 30, count)])
    missed = commands(count)
    print(f"{count} points, ns each    to pixels   OpenCV  times  to points   comes back to  from OpenCV (px)")
    for camera in CAMERAS:
        pixels, depth = camera.project(points)
        there, back = best(lambda: camera.project(points)), best(lambda: camera.unproject(pixels, depth=depth))  # noqa: B023
        off = np.abs(camera.unproject(pixels, depth=depth) - points).max()
        row = f"{camera.model:22s} {there / count * 1e9:10.0f}"
        if peer := of_opencv(cv2, camera, points):
            ratio = best(peer) / there
            missed += [f"{camera.model}: {ratio:.1f} times OpenCV"] if ratio < FASTER[camera.model] else []
            apart = np.abs(peer().reshape(-1, 2) - pixels).max()
            row += f" {ratio * there / count * 1e9:8.0f} {ratio:6.1f} {back / count * 1e9:10.0f} {off:13.1e} m {apart:10.1e}"
        else:
            row += f" {'-':>8} {'-':>6} {back / count * 1e9:10.0f} {off:13.1e} m"
        print(row)
        missed += [f"{camera.model}: {back:.1f} s back"] if back > SECONDS * count / 1e6 else []
    camera = Camera("plumb_bob", [350.0, 350.0, 320.0, 240.0], [-0.4, 0.05, 0.0006, -0.0004], (640, 480))
    around = sweep(200_000)
    print(f"of 200000 points of a sweep in the picture: {camera.in_image(camera.project(around)[0]).sum()}", end="")
    if cv2 is not None:
        drawn_by_opencv = cv2.projectPoints(around, np.zeros(3), np.zeros(3), camera.K, np.array(camera.D))[0][:, 0]
        print(f", by OpenCV with z > 0: {(camera.in_image(drawn_by_opencv) & (around[:, 2] > 0)).sum()}", end="")
    print(*[f"\nmissed: {each}" for each in missed])
    sys.exit(bool(missed))


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if sys.argv[1:] else 1_000_000)
