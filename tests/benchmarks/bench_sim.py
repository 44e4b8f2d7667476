"""How fast the turtles run: one follower for a minute from the shell.

    python tests/benchmarks/bench_sim.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).parents[2]
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
RUNS = 5


def follow() -> float:
    """Return the seconds that one minute of following takes, start-up included."""
    begin = perf_counter()
    arguments = ["sim", "follow", "--leader", "circle", "--duration", "60", "--format", "csv"]
    subprocess.run([*TOOL, *arguments], cwd=ROOT, check=True, capture_output=True)
    return perf_counter() - begin


if __name__ == "__main__":
    print(f"sim follow, 60 s: {min(follow() for _ in range(RUNS)):.2f} s")
