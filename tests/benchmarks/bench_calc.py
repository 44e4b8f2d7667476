"""Expressions over rows against `compose` on the same file, and the start of one expression: `python tests/benchmarks/bench_calc.py`.

A million poses from CSV; minima of several rounds taken in turn, processor time beside the clock's. Ratios count.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
ROBOT = str(ROOT / "examples" / "robot.yaml")
POSE = "{xyz: [1, 2, 3], rpy_deg: [10, 20, 30]}"
GOAL_OF_ROWS, GOAL_OF_START = 0.7, 1.4


def write_poses(path: Path, rows: int) -> None:
    """Write random poses with all digits."""
    rng = np.random.default_rng(1)
    quaternions = rng.normal(size=(rows, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    table = np.hstack([5 * rng.normal(size=(rows, 3)), quaternions])
    np.savetxt(path, table, delimiter=",", header="x,y,z,qx,qy,qz,qw", comments="", fmt="%.17g")


def timed(command: list[str], folder: Path) -> tuple[float, float]:
    """Time one process: seconds of the clock, and of the processor."""
    hidden = ("PYTHONDONTWRITEBYTECODE", "PYTHONUNBUFFERED")
    environment = {key: value for key, value in os.environ.items() if key not in hidden} | {"PYTHONPATH": str(ROOT)}
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True, cwd=folder, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - begin, spent


def compared(commands: list[list[str]], rounds: int, folder: Path) -> list[tuple[float, float]]:
    """Return the minima of clock and processor of each command, run in turn."""
    runs = [[timed(command, folder) for command in commands] for _ in range(rounds)]
    return [tuple(map(min, zip(*each, strict=True))) for each in zip(*runs, strict=True)]


def main() -> None:
    """Print the ratios with their goals."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_poses(folder / "poses.csv", options.rows)
        (folder / "X.yaml").write_text(POSE)
        rows = ["-i", "poses.csv", "--quiet"]
        compose, calc = compared(
            [[*TOOL, "compose", "inv", "X.yaml", "-", "X.yaml", *rows], [*TOOL, "calc", "X=X.yaml", "inv(X) * row * X", *rows]],
            options.rounds,
            folder,
        )
        for what, at in (("clock", 0), ("processor", 1)):
            print(f"inv(X) * row * X, {options.rows} rows, {what}: {calc[at]:.2f} s, compose {compose[at]:.2f} s, "
                  f"speed {compose[at] / calc[at]:.2f} (goal {GOAL_OF_ROWS})")  # fmt: skip
        texts = {"numbers": ["1 + 1"], "YAML": [f"inv({POSE})"], "a tree": ["--tree", ROBOT, "inv(map<-base_link) * (map<-tool)"]}
        for label, arguments in texts.items():
            bare, own = compared([[sys.executable, "-c", "import click, yaml"], [*TOOL, "calc", *arguments]], 4 * options.rounds, folder)
            print(f"start with {label}: {1e3 * own[0]:.1f} ms, import {1e3 * bare[0]:.1f} ms, ratio {own[0] / bare[0]:.2f}, "
                  f"processor {own[1] / bare[1]:.2f} (goal {GOAL_OF_START})")  # fmt: skip


if __name__ == "__main__":
    main()
