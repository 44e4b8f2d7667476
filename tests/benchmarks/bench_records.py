"""Records into other forms, whole processes: `python tests/benchmarks/bench_records.py [N]`.

N poses as JSON lines become a table, a trajectory, a recording and documents of YAML, and messages of a recording become a table again,
each beside the same from CSV.  Least processor seconds of several runs, records a second, peak memory of all so far.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
RUNS = 3
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]


def timed(folder: str, source: str, into: str, *command: str) -> tuple[float, float]:
    """Return the least processor seconds of making a file of another, and the megabytes of memory so far."""
    best = float("inf")
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*TOOL, *(command or ("convert",)), "-i", source, "-o", into, "--force", "--quiet"], stderr=subprocess.DEVNULL, check=True, cwd=folder)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        best = min(best, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return best, after.ru_maxrss / 1024


def main(count: int) -> None:
    """Print a row for each pair of forms."""
    os.environ["PYTHONPATH"] = str(ROOT)
    random = np.random.default_rng(1)
    turn = random.normal(size=(count, 4))
    turn *= (np.sign(turn[:, 3]) / np.linalg.norm(turn, axis=1))[:, None]
    rows = np.hstack([random.normal(size=(count, 3)), turn]).tolist()
    with tempfile.TemporaryDirectory() as folder:
        with Path(folder, "walk.csv").open("w", encoding="utf-8") as table, Path(folder, "walk.jsonl").open("w", encoding="utf-8") as lines:
            table.write("stamp_ns,x,y,z,qx,qy,qz,qw\n")
            for at, row in enumerate(rows, 1):
                table.write(f"{at}0000000,{','.join(map(repr, row))}\n")
                lines.write(f'{{"stamp_ns": {at}0000000, "xyz": {row[:3]}, "xyzw": {row[3:]}}}\n')
        print(f"{'records':<14} {'seconds':>8} {'a second':>9} {'MB':>5}  times those of CSV")
        for source, into in (("walk.jsonl", "new.tum"), ("walk.jsonl", "new.mcap"), ("walk.jsonl", "new.csv"), ("new.mcap", "back.csv")):
            seconds, memory = timed(folder, source, into)
            theirs, _ = timed(folder, "walk.csv", into.replace("csv", "tum"))
            print(f"{source.rpartition('.')[2]:<5} -> {into.rpartition('.')[2]:<5} {seconds:8.2f} {count / seconds:9.0f} {memory:5.0f}  {seconds / theirs:.2f}")
        few, covariance = count // 10, [0.01 * (at % 7 == 0) for at in range(36)]
        with Path(folder, "odometry.jsonl").open("w", encoding="utf-8") as lines:
            for at, row in enumerate(rows[:few]):
                pose = {"position": dict(zip("xyz", row, strict=False)), "orientation": dict(zip("xyzw", row[3:], strict=True))}
                twist = dict.fromkeys(("linear", "angular"), dict.fromkeys("xyz", 0.5))
                header = {"stamp": {"sec": at // 100, "nanosec": at % 100 * 10_000_000}, "frame_id": "odom"}
                parts = {"pose": {"pose": pose, "covariance": covariance}, "twist": {"twist": twist, "covariance": covariance}}
                lines.write(json.dumps({"header": header, "child_frame_id": "base_link", **parts}) + "\n")
        for source, into, size in (("odometry.jsonl", "new.csv", few), ("walk.csv", "new.json", count)):
            seconds, _ = timed(folder, source, into)
            print(f"{source} -> {into}: {seconds:.2f} s, {size / seconds:.0f} a second")
        of_table, _ = timed(folder, "walk.jsonl", "new.csv")
        print("the same as documents of YAML, and what depends on the rows before, as rows of CSV; times JSON lines to CSV")
        for command, into in (((), "new.yaml"), (("relative", "--consecutive"), "new.csv"), (("relative", "--consecutive", "--velocity"), "new.csv")):
            seconds, memory = timed(folder, "walk.jsonl", into, *command)
            print(f"{' '.join((*command, into)):<44} {seconds:8.2f} {count / seconds:9.0f} {memory:5.0f}  {seconds / of_table:.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200_000)
