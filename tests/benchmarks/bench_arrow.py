"""Parquet and Arrow files moved, beside what pyarrow needs to read and write them: `python tests/benchmarks/bench_arrow.py`.

Alternating, best of several; each run is a process of its own, in the folder of temporary files (a RAM disk if there is
one). What counts is the ratio to reading and writing in pyarrow alone plus the kernel. `--rows N`, `--rounds N`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
POSE = "{xyz: [1, 2, 3], rpy_deg: [10, 20, 30]}"
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}
RATIO, MEMORY = 1.2, 1.0  # goals: times the time, and GB
MAKE = """
import sys
import numpy as np, pyarrow as pa, pyarrow.parquet as pq
from pyarrow import ipc
rows, folder = int(sys.argv[1]), sys.argv[2]
generator = np.random.default_rng(1)
xyz = np.round(generator.normal(size=(rows, 3)) * 20, 6)
beside = {"id": np.arange(rows), "stamp_ns": 1_700_000_000_000_000_000 + np.arange(rows) * 1000}
intensity = {"intensity": generator.integers(0, 255, rows).astype(np.uint8)}
table = pa.table(beside | dict(zip("xyz", xyz.T, strict=True)) | intensity)
pq.write_table(table, folder + "/points.parquet", row_group_size=1 << 20)
with ipc.new_file(folder + "/points.arrow", table.schema) as writer:
    writer.write_table(table, max_chunksize=1 << 20)
"""
READ_AND_WRITE = {
    "parquet": """
import sys, pyarrow.parquet as pq
file = pq.ParquetFile(sys.argv[1])
with pq.ParquetWriter(sys.argv[2], file.schema_arrow) as writer:
    for group in range(file.num_row_groups):
        writer.write_table(file.read_row_group(group), row_group_size=1 << 20)
""",
    "arrow": """
import sys
from pyarrow import ipc
file = ipc.open_file(sys.argv[1])
with ipc.new_file(sys.argv[2], file.schema) as writer:
    for at in range(file.num_record_batches):
        writer.write_batch(file.get_batch(at))
""",
}
KERNEL = """
import sys, time
import numpy as np
import frametool
transform, xyz = frametool.Transform.random(seed=1), np.random.default_rng(1).normal(size=(int(sys.argv[1]), 3))
seconds = []
for _ in range(5):
    begin = time.perf_counter()
    transform.apply(xyz)
    seconds.append(time.perf_counter() - begin)
print(min(seconds))
"""
MOVE = """
import sys
from frametool.cli import run
sys.exit(run(["apply", "--transform", sys.argv[3], "-i", sys.argv[1], "-o", sys.argv[2], "--force"]))
"""


class Used(NamedTuple):
    """What a process took: seconds by the clock, seconds of the processor, GB."""

    wall: float
    processor: float
    memory: float


def used(code: str, *arguments: str) -> Used:
    """Run Python code in a process of its own."""
    begin = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-c", code, *arguments], env=ENVIRONMENT, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{arguments} failed: {process.returncode}")
    return Used(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e6)


def compare(form: str, source: Path, target: Path, rounds: int, kernel: float) -> None:
    """Print a line for a form."""
    ours, theirs = [], []
    for _ in range(rounds):
        theirs.append(used(READ_AND_WRITE[form], str(source), str(target)))
        ours.append(used(MOVE, str(source), str(target), POSE))
    wall, base = min(each.wall for each in ours), min(each.wall for each in theirs) + kernel
    processor, base_processor = min(each.processor for each in ours), min(each.processor for each in theirs) + kernel
    memory = max(each.memory for each in ours)
    goal = f" (goal {RATIO})" if form == "parquet" else ""
    print(
        f"{form:8} {wall:6.2f} s, pyarrow and kernel {base:6.2f} s: ratio {wall / base:5.2f}{goal}, of the processor's time "
        f"{processor / base_processor:5.2f}; memory {memory:5.2f} GB (goal {MEMORY})",
        flush=True,
    )


def main() -> None:
    """Compare both forms."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=10_000_000)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    folder = "/dev/shm" if os.path.isdir("/dev/shm") else None  # noqa: S108 - a folder of its own is made in it
    with tempfile.TemporaryDirectory(dir=folder) as made:
        at = Path(made)
        used(MAKE, str(options.rows), made)  # not here: what this process holds would count as the others' memory
        kernel = float(subprocess.check_output([sys.executable, "-c", KERNEL, str(options.rows)], env=ENVIRONMENT))
        print(f"{options.rows} points: id, stamp, x, y, z, intensity; kernel {kernel:.2f} s; best of {options.rounds}")
        for form in READ_AND_WRITE:
            compare(form, at / f"points.{form}", at / f"moved.{form}", options.rounds, kernel)


if __name__ == "__main__":
    main()
