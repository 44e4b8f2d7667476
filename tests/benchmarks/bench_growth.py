"""Double the size of each command's work three times and print how its time grows: `python tests/benchmarks/bench_growth.py`.

    python tests/benchmarks/bench_growth.py lookup view      only these commands
    python tests/benchmarks/bench_growth.py --runs 5         minima of five runs instead of two

The exponent is the slope of the logarithm of time over that of size, by least squares over four sizes: 1 is in proportion, 2 quadratic.
Time is the processor's, so that other work on the machine counts little, above that of a fiftieth of the smallest size:
what every run takes, start-up and imports, is left out.  `last` is the slope of the last doubling alone, which tells
best what is to come, and is noisier.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from growing_inputs import INPUTS

if TYPE_CHECKING:
    from collections.abc import Sequence

GOAL = 1.1
SIZES = (1, 2, 4, 8)
START = 1 / 50  # of the smallest size
FRAMETOOL = str(Path(sys.executable).with_name("frametool"))
POSE = '{"xyz":[1,2,3],"rpy_deg":[0,0,90]}'


class Work(NamedTuple):
    """A command whose work grows.

    by: what grows
    least: the smallest size
    words: the command line.  @name is an input of that size, @name=20 one of twenty, @out a place for the result;
    {n} the size, {last} one less, {half} half of it; *word as many words, a**b one word of a and many b
    status: with which it ends
    """

    by: str
    least: int
    words: str
    status: int = 0

    @property
    def command(self) -> str:
        """Return the name of the command."""
        return self.words.split()[0]


WORKS = (
    Work("rows, CSV", 400_000, "convert -i @poses.csv --to quaternion"),
    Work("rows, JSON lines", 100_000, "convert -i @poses.jsonl --to quaternion"),
    Work("documents, YAML", 20_000, "convert -i @poses.yaml --to quaternion"),
    Work("rows, TUM", 200_000, "convert -i @walk.tum -f csv"),
    Work("columns, CSV", 20_000, "convert -i @wide.csv --to quaternion"),
    Work("columns kept", 20_000, "convert -i @wide.csv --to rpy --keep"),
    Work("keys, JSON lines", 10_000, "convert -i @wide.jsonl --to quaternion"),
    Work("keys, YAML", 5_000, "convert -i @wide.yaml --to quaternion"),
    Work("an unknown column", 10_000, "convert -i @wide.csv --columns x,y,z,yaw_degg", 2),
    Work("rows", 200_000, "compose -i @poses.csv - " + POSE),
    Work("poses", 500, "compose" + " *" + POSE),
    Work("rows", 200_000, "invert -i @poses.csv"),
    Work("columns", 20_000, "invert -i @wide.csv"),
    Work("rows", 200_000, "relative --consecutive -i @poses.csv"),
    Work("fractions", 2_000, "interpolate " + POSE + " " + POSE + " *0.5"),
    Work("rows", 400_000, "mean -i @poses.csv"),
    Work("columns", 20_000, "mean -i @wide.csv"),
    Work("times", 200_000, "lookup @dump.yaml=2000 map tool --times @times.txt -f csv"),
    Work("frames, list", 10_000, "lookup @frames.yaml world f{last}"),
    Work("frames, nested", 10_000, "lookup @nested.yaml world f{half}"),
    Work("frames, JSON", 40_000, "lookup @frames.json world f{last}"),
    Work("frames, ROS", 10_000, "lookup @ros.yaml world f{last}"),
    Work("frames, ROS in JSON", 10_000, "lookup @ros.json world f{last}"),
    Work("length of a chain", 10_000, "lookup @chain.yaml world f{last}"),
    Work("samples", 10_000, "lookup @samples.yaml map tool --at 1.00001"),
    Work("samples, reversed", 10_000, "lookup @reversed.yaml map tool --at 1.00001"),
    Work("samples, shuffled", 10_000, "lookup @late.yaml map tool --at 1.00001"),
    Work("messages", 40_000, "lookup @dump.yaml map tool --at 1.00001"),
    Work("messages, shuffled", 10_000, "lookup @late_dump.yaml map tool --at 1.00001"),
    Work("messages, each twice", 10_000, "lookup @twice.yaml map tool --at 1.00001"),
    Work("messages, forgotten", 10_000, "lookup @dump.yaml map tool --cache 0.001"),
    Work("changes of parent", 4_000, "lookup @reparented.yaml map base --at 0.01"),
    Work("names, unknown frame", 10_000, "lookup @frames.yaml world f12x34", 4),
    Work("rows", 200_000, "apply --transform " + POSE + " -i @points.csv"),
    Work("rows with times", 200_000, "apply @dump.yaml=2000 map tool -i @points.csv --time-column t"),
    Work("columns", 20_000, "apply --transform " + POSE + " -i @wide.csv --columns x,y,z --as point"),
    Work("frames", 10_000, "tree @frames.yaml"),
    Work("frames, JSON", 10_000, "tree @frames.yaml -f json"),
    Work("frames, DOT", 10_000, "tree @frames.yaml -f dot"),
    Work("depth, JSON", 10_000, "tree @chain.yaml -f json"),
    Work("samples", 10_000, "tree @dump.yaml"),
    Work("frames that move", 2_500, "tree @moving.yaml"),
    Work("blocks", 10_000, "echo @dump.yaml=2000 map tool --rate 1000000000 --limit {n}"),
    Work("samples", 40_000, "echo @dump.yaml map tool --limit 2"),
    Work("messages", 40_000, "monitor @dump.yaml"),
    Work("messages, shuffled", 40_000, "monitor @late_dump.yaml"),
    Work("edges", 2_500, "monitor @moving.yaml"),
    Work("frames", 5_000, "check @frames.yaml"),
    Work("depth", 5_000, "check @chain.yaml"),
    Work("messages", 10_000, "check @dump.yaml", 0),
    Work("messages, shuffled", 10_000, "check @late_dump.yaml", 0),
    Work("frames that move", 2_500, "check @moving.yaml"),
    Work("frames", 10_000, "static @frames.yaml"),
    Work("frames", 5_000, "diff @frames.yaml @other.yaml", 1),
    Work("depth", 5_000, "diff @chain.yaml @chain.yaml"),
    Work("messages", 10_000, "diff @dump.yaml @late_dump.yaml"),
    Work("frames that move", 2_500, "diff @moving.yaml @moving.yaml"),
    Work("rows", 100_000, "fk @snake.urdf=1000 l0 l1000 -i @joints.csv"),
    Work("links", 2_500, "fk @snake.urdf l0 l{n} -i @joints.csv=20"),
    Work("rows", 200_000, 'calc inv(row)*{"xyz":[1,2,3]} -i @poses.csv'),
    Work("terms", 2_000, "calc 1**+1"),
    Work("frames", 2_000, "view @frames.yaml"),
    Work("frames, SVG", 2_000, "view @frames.yaml -f svg -o @out --force"),
    Work("frames, HTML", 5_000, "view @frames.yaml -f html -o @out --force"),
    Work("frames, GLB", 5_000, "view @frames.yaml -f glb -o @out --force"),
    Work("depth, SVG", 2_000, "view @chain.yaml -f svg -o @out --force"),
    Work("samples, HTML", 10_000, "view @dump.yaml -f html -o @out --force"),
    Work("samples, SVG", 10_000, "view @dump.yaml -f svg -o @out --force"),
    Work("seconds", 200, "sim follow --leader square --duration {n}"),
    Work("turtles", 50, "sim run @turtles.yaml"),
)  # fmt: skip


class Bench:
    """Runs commands on inputs of any size, which are written once."""

    def __init__(self, folder: Path) -> None:
        """Keep inputs in a folder."""
        self.folder = folder
        self.environment = {key: value for key, value in os.environ.items() if not key.startswith("FRAMETOOL")}

    def seconds(self, work: Work, size: int) -> float:
        """Run a command once; return the processor's time that it took."""
        words = [made for word in work.words.split() for made in self.made(word, size)]
        with Path(os.devnull).open("wb") as nothing, (self.folder / "stderr").open("wb") as stderr:
            process = subprocess.Popen([FRAMETOOL, *words], env=self.environment, stdout=nothing, stderr=stderr)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != work.status:
            told = (self.folder / "stderr").read_text()[:1000]
            message = f"{work.words} with {size}: status {process.returncode}, expected {work.status}: {told}"
            raise ValueError(message)
        return usage.ru_utime + usage.ru_stime

    def made(self, word: str, size: int) -> list[str]:
        """Return the words that one of the table stands for."""
        if word.startswith("@"):
            return [self.input(word[1:], size)]
        if word.startswith("*"):
            return [word[1:]] * size
        head, _, repeated = word.partition("**")
        return [(head + repeated * size).replace("{n}", str(size)).replace("{last}", str(size - 1))
                .replace("{half}", str(size // 2))]  # fmt: skip

    def input(self, name: str, size: int) -> str:
        """Return the path of an input, written if it is not there yet."""
        name, _, fixed = name.partition("=")
        path = self.folder / f"{fixed or size}-{name}"
        if name in INPUTS and not path.exists():
            with path.open("w") as file:
                file.writelines(f"{line}\n" for line in INPUTS[name](int(fixed or size)))
        return str(path)


def slope(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Return the exponent of a power that fits best: least squares of logarithms."""
    across, up = [*map(math.log, sizes)], [*map(math.log, seconds)]
    middle, height = sum(across) / len(across), sum(up) / len(up)
    products = sum((x - middle) * (y - height) for x, y in zip(across, up, strict=True))
    return products / sum((x - middle) ** 2 for x in across)


def measure(bench: Bench, work: Work, runs: int) -> tuple[list[float], list[float]]:
    """Return the four sizes and the time of each, both above those of the start."""
    sizes = [max(2, int(work.least * START)), *(work.least * factor for factor in SIZES)]
    start, *seconds = (min(bench.seconds(work, size) for _ in range(runs)) for size in sizes)
    return [size - sizes[0] for size in sizes[1:]], [max(each - start, 1e-3) for each in seconds]


def main() -> None:
    """Print a line a row of the table, and how many are above the goal."""
    parser = argparse.ArgumentParser()
    parser.add_argument("commands", nargs="*")
    parser.add_argument("--runs", type=int, default=2)
    asked = parser.parse_args()
    above = []
    print(f"{'command':12} {'by':24} {'largest':>8} {'seconds above the start':^31} {'last':>6} {'exponent':>9} {'goal':>5}")
    for work in WORKS:
        if asked.commands and work.command not in asked.commands:
            continue
        try:
            with tempfile.TemporaryDirectory() as folder:
                sizes, seconds = measure(Bench(Path(folder)), work, asked.runs)
        except ValueError as error:
            above.append(work)
            print(error)
            continue
        exponent, last = slope(sizes, seconds), slope(sizes[-2:], seconds[-2:])
        above += [work] * (exponent > GOAL)
        told = " ".join(f"{each:7.2f}" for each in seconds)
        mark = "  ABOVE" if exponent > GOAL else ""
        print(f"{work.command:12} {work.by:24} {work.least * SIZES[-1]:8} {told} {last:6.2f} {exponent:9.2f} {GOAL:5.1f}{mark}", flush=True)
    print(f"{len(above)} above the goal")


if __name__ == "__main__":
    main()
