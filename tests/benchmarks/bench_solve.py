"""Trees of measurements: `python tests/benchmarks/bench_solve.py` prints how good they are and what they cost.

Good: over 60 seeded worlds with one inverted row, the error beside that of a spanning tree, and how many name that row
and no other.  Cost: a fresh process each, beside `import numpy`, one thread as the command has it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

from worlds import World, world  # noqa: E402 - found on the path above

from frametool.fit.measured_tree import solve_tree  # noqa: E402

WORLDS = 60
KINDS = [(7, 20, False), (7, 20, True), (7, 12, False), (12, 25, False), (30, 60, False), (50, 120, False)]
SIZES = [(50, 120, 0), (50, 120, 5), (200, 500, 0), (200, 500, 20), (1000, 2500, 0), (1000, 2500, 25)]
RUNS = 2
ONE = """
import resource, sys
from worlds import world
frames, rows, wrong, near = map(int, sys.argv[1:])
made = world(frames, rows, 1, near=near or None).with_inverted(wrong)
if True:
    from frametool.fit.measured_tree import solve_tree
    {solve}
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
SOLVE = "found = solve_tree(made.measurements); [found.covariance(found.root, name) for name in found.frames]"


def quality(frames: int, rows: int, *, sigmas: bool) -> str:
    """Return a line: worlds where the wrong row is named and no other, and the median ratios of errors."""
    named, ratios = 0, []
    for seed in range(WORLDS):
        truth = world(frames, rows, seed, sigmas=sigmas).with_inverted(1)
        found = solve_tree(truth.measurements)
        left = np.flatnonzero(~found.used).tolist()
        named += left == list(truth.wrong) and found.fits[left[0]] == "inverted"
        ours = truth.rms(found.poses.__getitem__)
        ratios.append([_ratio(truth, ours, leave_out) for leave_out in ((), truth.wrong)])
    (m, rad), (good_m, good_rad) = np.median(ratios, 0)
    given = "sigmas" if sigmas else ""
    return f"{frames:6} {rows:5} {given:7} {named:3} of {WORLDS}  {m:6.2f} {rad:6.2f}      {good_m:6.2f} {good_rad:6.2f}"


def _ratio(truth: World, ours: tuple[float, float], leave_out: tuple[int, ...]) -> list[float]:
    theirs = truth.rms(truth.spanning_tree(leave_out).__getitem__)
    return [their / our for their, our in zip(theirs, ours, strict=True)]


def cost(frames: int, rows: int, wrong: int, near: int, solve: str) -> tuple[float, float]:
    """Return the least seconds of some processes that make a world and solve it, and their peak memory in MB."""
    best, memory = float("inf"), 0.0
    for _ in range(RUNS):
        begin = time.perf_counter()
        command = [sys.executable, "-c", ONE.format(solve=solve), *map(str, (frames, rows, wrong, near))]
        ran = subprocess.run(command, stdout=subprocess.PIPE, check=True)
        best, memory = min(best, time.perf_counter() - begin), int(ran.stdout) / 1024
    return best, memory


def main() -> None:
    """Print both tables."""
    os.environ.update(PYTHONPATH=f"{ROOT}:{ROOT / 'tests' / 'support'}", OPENBLAS_NUM_THREADS="1")
    print("frames  rows          named     error of a spanning tree / ours, m rad; of one without the wrong row")
    for frames, rows, sigmas in KINDS:
        print(quality(frames, rows, sigmas=sigmas), flush=True)
    print("frames  rows  wrong  joins   seconds beside import   MB   of these solving")
    for frames, rows, wrong in SIZES:
        for near, joins in ((20, "near"), (0, "any")):
            base, before = cost(frames, rows, wrong, near, "pass")
            whole, peak = cost(frames, rows, wrong, near, SOLVE)
            print(f"{frames:6} {rows:5} {wrong:6}  {joins:5} {whole - base:10.2f} {peak:18.0f} {peak - before:10.0f}", flush=True)


if __name__ == "__main__":
    main()
