"""What `--jobs 2` gives, beside what the machine gives two processes at all: `python tests/benchmarks/bench_jobs.py`.

The bound is the same work without anything between the two: one process on the whole of a file, two at once on a half
each; and a plain copy of memory, whole and in two halves. All take turns, the best of several counts. CPU seconds
beside them say what the work costs where other work disturbs the clock. `--rows N`, `--rounds N`, `--jobs N`.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

GOAL = 1.6
ROOT = Path(__file__).parents[2]
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
POSE = "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
COPIED, TIMES = 1 << 26, 12  # bytes


class Cost(NamedTuple):
    """Seconds on the clock and of all processes together."""

    wall: float
    cpu: float


def generate(folder: Path, rows: int) -> dict[str, Path]:
    """Write a table of points, one with quoted cells that hold line ends, and JSON lines."""
    points = np.random.default_rng(1).uniform(-100, 100, (rows, 3)).tolist()
    table, quoted, lines = (folder / name for name in ("points.csv", "quoted.csv", "points.jsonl"))
    with table.open("w") as out:
        out.write("id,x,y,z,tag\n")
        out.writelines(f"{at},{x:.6f},{y:.6f},{z:.6f},t{at % 1000:03d}\n" for at, (x, y, z) in enumerate(points))
    with quoted.open("w") as out:
        out.write("id,x,y,z,tag\n")
        out.writelines(f'{at},{x:.6f},{y:.6f},{z:.6f},"a\nb"\n' for at, (x, y, z) in enumerate(points))
    with lines.open("w") as out:
        out.writelines(
            f'{{"id": {at}, "x": {x:.6f}, "y": {y:.6f}, "z": {z:.6f}}}\n' for at, (x, y, z) in enumerate(points)
        )
    return {"points": table, "points, --precision 6": table, "quoted cells": quoted, "JSON lines": lines}


def halves(path: Path, parts: int) -> list[Path]:
    """Cut a file at line ends, with its header before each part."""
    text = path.read_bytes()
    head = text[: text.find(b"\n") + 1] if path.suffix == ".csv" else b""
    mark = b'b"\n' if path.name == "quoted.csv" else b"\n"
    cuts = [text.index(mark, len(text) * part // parts) + len(mark) for part in range(1, parts)]
    found = []
    for part, (start, end) in enumerate(pairwise([len(head), *cuts, len(text)])):
        found.append(path.with_suffix(f".{part}{path.suffix}"))
        found[-1].write_bytes(head + text[start:end])
    return found


def cost(run: Callable[[], None]) -> Cost:
    """Measure what a function and the processes it waits for need."""
    before, start = _cpu(), time.perf_counter()
    run()
    return Cost(time.perf_counter() - start, _cpu() - before)


def _cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def at_once(commands: list[list[str]]) -> None:
    """Run processes side by side, and wait for all of them."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    started = [subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment) for command in commands]
    if sum(process.wait() for process in started):
        raise SystemExit("a run failed")


def copies(parts: int) -> list[list[str]]:
    """Say how memory is copied in several processes that share the work."""
    code = f"b = bytearray({COPIED // parts})\nfor _ in range({TIMES}): c = bytes(b)"
    return [[sys.executable, "-I", "-c", code]] * parts


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=4_000_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name, path in generate(Path(folder), options.rows).items():
            move = [*TOOL, "apply", "--transform", POSE, "--quiet", *name.split(", ")[1:2]]
            move = move[:-1] + move[-1].split() if "--precision" in name else move
            parts = halves(path, options.jobs)
            runs = {
                "one": [[*move, "-i", str(path)]],
                "jobs": [[*move, "-i", str(path), "--jobs", str(options.jobs)]],
                "halves": [[*move, "-i", str(part)] for part in parts],
                "copy": copies(1),
                "copies": copies(options.jobs),
            }
            best = dict.fromkeys(runs, Cost(float("inf"), float("inf")))
            for _ in range(options.rounds):
                for way, commands in runs.items():
                    best[way] = Cost(*map(min, best[way], cost(lambda commands=commands: at_once(commands))))  # type: ignore[misc]
            one, several = best["one"], best["jobs"]
            print(f"{name}: {one.wall:.2f} s, --jobs {options.jobs}: {several.wall:.2f} s", end="")
            print(f" = {one.wall / several.wall:.2f} x  (goal {GOAL}); CPU {one.cpu:.2f} s -> {several.cpu:.2f} s")
            apart, copy = one.wall / best["halves"].wall, best["copy"].wall / best["copies"].wall
            print(f"    bound: {options.jobs} processes on a part each {apart:.2f} x, a plain copy {copy:.2f} x")


if __name__ == "__main__":
    main()
