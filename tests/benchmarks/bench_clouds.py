"""Clouds of points against goals, beside a plain copy of the same file: `python tests/benchmarks/bench_clouds.py`.

Whole processes, from start to end, best of several; files in memory where /dev/shm is.  A goal is for an idle machine.
`--points N` (goals are those of 1e7), `--rounds N`.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
POSE = "{xyz: [1, 2, 3], rpy_deg: [10, 20, 30]}"
GOALS = {"npy": 1.2, "pcd": 2.0, "ply": 2.5}  # seconds at 1e7 points
MOST_MEMORY = 1e9
AT = 10_000_000
PCD = (
    "VERSION 0.7\nFIELDS x y z intensity ring time\nSIZE 4 4 4 1 2 8\nTYPE F F F U U F\nCOUNT 1 1 1 1 1 1\n"
    "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n"
)
PLY = (
    "ply\nformat binary_little_endian 1.0\nelement vertex {0}\nproperty float x\nproperty float y\nproperty float z\n"
    "property uchar intensity\nproperty ushort ring\nproperty double time\nend_header\n"
)


def write_files(folder: Path, points: int) -> None:
    """Write a cloud in each form; in a process of its own, whose memory is not counted with those it starts."""
    rng = np.random.default_rng(0)
    kind = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "u1"), ("ring", "<u2"), ("time", "<f8")]
    cloud = np.zeros(points, kind)
    for name in "xyz":
        cloud[name] = rng.normal(size=points, scale=20.0)
    cloud["x"][::97] = np.nan
    cloud["time"] = np.arange(points)
    files = {form: folder / f"cloud.{form}" for form in ("npy", "pcd", "ply", "las", "laz")}
    for form, head in (("pcd", PCD), ("ply", PLY)):
        with files[form].open("wb") as file:
            file.write(head.format(points).encode())
            cloud.tofile(file)
    np.save(files["npy"], np.stack([np.nan_to_num(cloud[name]) for name in "xyz"], axis=-1).astype(np.float64))
    if find_spec("laspy") and find_spec("lazrs"):
        for form in ("las", "laz"):
            subprocess.run([*tool(), "apply", "--transform", "{}", "--quiet", "-i", files["npy"], "-o", files[form]],
                           check=True, cwd=ROOT, stderr=subprocess.DEVNULL)  # fmt: skip


def order(form: str) -> int:
    """Return where a form stands in the table: those with a goal first."""
    return [*GOALS, "las", "laz"].index(form)


def tool() -> list[str]:
    """Return the command line that runs the tool."""
    return [sys.executable, "-m", "frametool"]


def measured(command: list[str | Path]) -> tuple[float, float, int]:
    """Run a command; return its seconds, those of the processor, and the bytes it needed at most."""
    begin = time.perf_counter()
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{command} ended with {process.returncode}")
    return time.perf_counter() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def main() -> None:
    """Print a row for each form."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=lambda text: int(float(text)), default=AT)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--write", type=Path, help="only write the files into this folder")
    options = parser.parse_args()
    if options.write:
        write_files(options.write, options.points)
        return
    memory = Path("/dev/shm")  # noqa: S108 - files in memory, in a folder of their own
    folder = Path(tempfile.mkdtemp(dir=memory if memory.is_dir() else None))
    try:
        subprocess.run([sys.executable, __file__, "--points", str(options.points), "--write", folder], check=True)
        files = {path.suffix[1:]: path for path in sorted(folder.iterdir(), key=lambda path: order(path.suffix[1:]))}
        print("| form | MB | seconds | goal | of the processor | copy | memory, MB | goal |")
        print("|---|---|---|---|---|---|---|---|")
        for form, path in files.items():
            out = folder / f"out.{form}"
            apply: list[str | Path] = [*tool(), "apply", "--transform", POSE, "--quiet", "--force", "-i", path, "-o", out]
            runs = [measured(apply) for _ in range(options.rounds)]
            copies = [measured(["cp", path, out]) for _ in range(options.rounds)]
            wall, busy = min(run[0] for run in runs), min(run[1] for run in runs)
            goal = f"{GOALS[form]:.2f}" if form in GOALS and options.points == AT else ""
            print(
                f"| {form} | {path.stat().st_size / 1e6:.0f} | {wall:.2f} | {goal} | {busy:.2f} | "
                f"{min(copy[0] for copy in copies):.2f} | {max(run[2] for run in runs) / 1e6:.0f} | {MOST_MEMORY / 1e6:.0f} |"
            )
            out.unlink()
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
