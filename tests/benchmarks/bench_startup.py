"""Time whole commands against the bare imports they stand on: `python tests/benchmarks/bench_startup.py`.

Run it with the interpreter of an environment that frametool is installed in (not editable, .pyc files present).
Minima of many fresh processes, taken in turn; only the ratios say something.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
SCRIPT = str(Path(sys.executable).with_name("frametool"))
ROBOT = str(ROOT / "examples" / "robot.yaml")
RUNS = 20
POSE = '{"xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}'
FLOW = "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
CASES = [
    ("--help", ["--help"], "import click", 1.2),
    ("--version", ["--version"], "import click", 1.1),
    ("convert, numbers", ["convert", "--from", "rpy_deg", "0", "0", "90"], "import click", 1.25),
    ("convert, JSON", ["convert", POSE], "import click", 1.35),
    ("compose, JSON", ["compose", POSE, POSE], "import click", 1.35),
    ("invert, JSON", ["invert", POSE], "import click", 1.35),
    ("convert, YAML", ["convert", FLOW], "import click, yaml", 1.35),
    ("lookup", ["lookup", ROBOT, "map", "camera_optical"], "import click, yaml", 1.35),
]


def seconds(command: list[str], environment: dict[str, str]) -> float:
    """Time one fresh process."""
    begin = time.perf_counter()
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begin


def main() -> None:
    """Print one line a case: milliseconds, those of the bare import, the ratio and its goal."""
    hidden = ("PYTHONDONTWRITEBYTECODE", "PYTHONUNBUFFERED", "PYTHONPATH")
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    print(f"{'command':18s} {'ms':>7s} {'import':>7s} {'ratio':>6s} {'goal':>6s}")
    for name, arguments, code, goal in CASES:
        pairs = [
            (seconds([SCRIPT, *arguments], environment), seconds([sys.executable, "-c", code], environment))
            for _ in range(RUNS)
        ]
        ours, bare = (1e3 * min(column) for column in zip(*pairs, strict=True))
        print(f"{name:18s} {ours:7.1f} {bare:7.1f} {ours / bare:6.2f} {goal:6.2f}")


if __name__ == "__main__":
    main()
