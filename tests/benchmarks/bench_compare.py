"""Trajectories compared, whole processes beside evo's where it is installed: `python tests/benchmarks/bench_compare.py [N ..]`.

Made here: N poses at 100 Hz, an estimate 3 ms late with 2 cm of noise.  Minima of several runs; peak memory of one.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
RUNS = 3
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
WAYS = {
    "compare": [],
    "--offset auto": ["--offset", "auto"],
    "--all-pairs": ["--all-pairs"],
    "--report": ["--report", "error.html", "--force"],
}


def write(path: Path, count: int, late: float, noise: float) -> None:
    """Write a trajectory as a TUM file."""
    t = np.arange(count) * 0.01
    xyz = np.stack([50 * np.cos(0.1 * t) + t, 40 * np.sin(0.13 * t), 3 * np.sin(0.05 * t)], -1)
    xyz += np.random.default_rng(1).normal(0, noise, xyz.shape)
    turn = np.stack([0 * t, 0 * t, np.sin(0.05 * t), np.cos(0.05 * t)], -1)
    np.savetxt(path, np.column_stack([t + 1_700_000_000 + late, xyz, turn]), fmt="%.6f")


def timed(command: list[str], folder: str) -> tuple[float, float]:
    """Return the least seconds of some runs, and the peak memory of any child so far in MB."""
    best = float("inf")
    for _ in range(RUNS):
        begin = time.perf_counter()
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL, check=True, cwd=folder)
        best = min(best, time.perf_counter() - begin)
    return best, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


def main(counts: list[int]) -> None:
    """Print a row for each way and size."""
    os.environ["PYTHONPATH"] = str(ROOT)
    evo = shutil.which("evo_ape")
    print(f"{'poses':>8} {'way':<16} {'seconds':>8} {'MB':>6}  beside evo_ape tum -va")
    with tempfile.TemporaryDirectory() as folder:
        for count in counts:
            write(Path(folder, "ref.tum"), count, 0.0, 0.0)
            write(Path(folder, "est.tum"), count, 0.003, 0.02)
            rows = {name: timed([*TOOL, "compare", "ref.tum", "est.tum", *more], folder) for name, more in WAYS.items()}
            for name in ("ref", "est"):
                subprocess.run([*TOOL, "convert", "-i", f"{name}.tum", "-o", f"{name}.mcap", "--force", "--quiet"], cwd=folder, check=True, stderr=subprocess.DEVNULL)
            rows["of MCAP files"] = timed([*TOOL, "compare", "ref.mcap", "est.mcap"], folder)
            rows["resample, CSV"] = timed([*TOOL, "resample", "est.tum", "--rate", "70", "-f", "csv"], folder)
            theirs = timed([evo, "tum", "ref.tum", "est.tum", "-va"], folder)[0] if evo and count <= 100_000 else None
            for name, (seconds, memory) in rows.items():
                print(f"{count:>8} {name:<16} {seconds:>8.2f} {memory:>6.0f}  {'' if theirs is None else f'{theirs / seconds:.1f} x'}")


if __name__ == "__main__":
    main([int(each) for each in sys.argv[1:]] or [1_000, 100_000, 1_000_000])
