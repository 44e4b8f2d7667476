"""How fast the turtles run: one follower for a minute from the shell, ten thousand for 20 s on arrays.

    python tests/benchmarks/bench_sim.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from time import perf_counter

import numpy as np

from frametool.sim.sweep import simulate_many

ROOT = Path(__file__).parents[2]
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
RUNS = 5
FOLLOWERS = 10_000
TICKS = 1250


def follow() -> float:
    """Return the seconds that one minute of following takes, start-up included."""
    begin = perf_counter()
    arguments = ["sim", "follow", "--leader", "circle", "--duration", "60", "--format", "csv"]
    subprocess.run([*TOOL, *arguments], cwd=ROOT, check=True, capture_output=True)
    return perf_counter() - begin


def many() -> float:
    """Return the turtle-ticks a second of ten thousand followers."""
    generator = np.random.default_rng(1)
    spawn = generator.uniform((0.0, 0.0, -3.0), (11.0, 11.0, 3.0), size=(FOLLOWERS, 3))
    begin = perf_counter()
    simulate_many("circle", spawn=spawn, duration=20.0)
    return FOLLOWERS * TICKS / (perf_counter() - begin)


if __name__ == "__main__":
    print(f"sim follow, 60 s: {min(follow() for _ in range(RUNS)):.2f} s")
    print(f"simulate_many, {FOLLOWERS} followers: {max(many() for _ in range(RUNS)) / 1e6:.1f} million turtle-ticks a second")
