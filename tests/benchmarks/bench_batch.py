"""Commands a second in one process, and with a process each: `python tests/benchmarks/bench_batch.py`.

Processor time stands beside the clock's; both are minima of several rounds, start and end of the process included.
"""

from __future__ import annotations

import argparse
import resource
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROOT = Path(__file__).parents[2]
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
ROBOT = ROOT / "examples" / "robot.yaml"
FRAMES = ("map", "base_link", "lidar", "camera_optical", "tool")
GOAL = 1000  # commands a second
ALONE = 20  # commands that get a process each
RANDOM = Random(1)  # noqa: S311 - of numbers to calculate with


def numbers(count: int) -> str:
    """Return some numbers as words."""
    return " ".join(f"{RANDOM.uniform(-2.0, 2.0):.6g}" for _ in range(count))


def pose() -> str:
    """Return a pose as a word."""
    return f"'{{xyz: [{numbers(3).replace(' ', ', ')}], rpy: [{numbers(3).replace(' ', ', ')}]}}'"


KINDS: dict[str, Callable[[], str]] = {
    "convert numbers": lambda: f"convert --from rpy {numbers(3)} --to quaternion,rpy_deg",
    "convert a pose": lambda: f"convert {pose()} --to matrix -f json",
    "compose": lambda: f"compose {pose()} {pose()}",
    "compose numbers": lambda: f"compose --from rpy '{numbers(3)}' '{numbers(3)}'",
    "invert": lambda: f"invert {pose()} -f json",
    "invert numbers": lambda: f"invert --from rpy '{numbers(3)}'",
    "look up": lambda: f"lookup {ROBOT} {RANDOM.choice(FRAMES)} {RANDOM.choice(FRAMES)}",
    "look up as JSON": lambda: f"lookup {ROBOT} {RANDOM.choice(FRAMES)} {RANDOM.choice(FRAMES)} --to rpy_deg -f json",
}


def timed(command: list[str], folder: str) -> tuple[float, float]:
    """Time one process: seconds of the clock, and of the processor."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, stdin=subprocess.DEVNULL, check=True, cwd=folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.perf_counter() - begin, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def best(command: list[str], folder: str, rounds: int) -> tuple[float, float]:
    """Return the minima of clock and processor."""
    clock, processor = zip(*(timed(command, folder) for _ in range(rounds)), strict=True)
    return min(clock), min(processor)


def rows(count: int, rounds: int, folder: str) -> Iterator[str]:
    """Yield a row for each kind of command, and one for all of them in turn."""
    for name in ("all in turn", *KINDS):
        make = list(KINDS.values()) if name == "all in turn" else [KINDS[name]]
        lines = [make[at % len(make)]() for at in range(count)]
        Path(folder, "commands.txt").write_text("".join(f"{line}\n" for line in lines))
        clock, processor = best([*TOOL, "batch", "commands.txt"], folder, rounds)
        alone = sum(best([*TOOL, *shlex.split(line)], folder, 1)[0] for line in lines[:ALONE]) / ALONE
        yield (f"{name:16} {count / clock:8.0f} commands/s, {count / processor:8.0f} of processor time (goal {GOAL}); "
               f"a process each {1 / alone:4.0f}/s, ratio {alone * count / clock:4.0f}")  # fmt: skip


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--lines", type=int, default=20_000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for row in rows(options.lines, options.rounds, folder):
            print(row)


if __name__ == "__main__":
    main()
