"""Recordings written and read, whole processes beside a loop over the library: `python tests/benchmarks/bench_recordings.py [N]`.

N poses of a TUM file become an MCAP file and a ROS 1 bag.  The peer is the shortest script with rosbags: a line parted,
a message made, serialised and written.  Least processor seconds of several runs, messages a second, peak memory.
"""

from __future__ import annotations

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
PEER = """
import sys
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
store = get_typestore(Stores.ROS2_HUMBLE)
name = "geometry_msgs/msg/PoseStamped"
time, header, stamped, pose, point, turn = (store.types[each] for each in (
    "builtin_interfaces/msg/Time", "std_msgs/msg/Header", name, "geometry_msgs/msg/Pose", "geometry_msgs/msg/Point",
    "geometry_msgs/msg/Quaternion"))
with Writer(sys.argv[2], version=9, storage_plugin=StoragePlugin.MCAP) as writer:
    topic = writer.add_connection("/pose", name, typestore=store)
    for line in open(sys.argv[1]):
        stamp, *numbers = line.split()
        sec, _, rest = stamp.partition(".")
        ns = int(rest.ljust(9, "0"))
        x, y, z, qx, qy, qz, qw = map(float, numbers)
        message = stamped(header(time(int(sec), ns), "world"), pose(point(x, y, z), turn(qx, qy, qz, qw)))
        writer.write(topic, int(sec) * 10**9 + ns, store.serialize_cdr(message, name))
"""


def timed(command: list[str], folder: str) -> float:
    """Return the least processor seconds of some runs."""
    best = float("inf")
    for run in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([each.format(run=run) for each in command], stderr=subprocess.DEVNULL, check=True, cwd=folder)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        best = min(best, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return best


def main(count: int) -> None:
    """Print a row for each form."""
    os.environ["PYTHONPATH"] = str(ROOT)
    random = np.random.default_rng(1)
    turn = random.normal(size=(count, 4))
    turn *= (np.sign(turn[:, 3]) / np.linalg.norm(turn, axis=1))[:, None]
    with tempfile.TemporaryDirectory() as folder:
        with Path(folder, "walk.tum").open("w", encoding="utf-8") as file:
            file.writelines(f"{1_700_000_000 + at // 100}.{at % 100:02d} {' '.join(map(repr, pose))}\n" for at, pose in enumerate(np.hstack([random.normal(size=(count, 3)), turn]).tolist()))
        print(f"{'form':<8} {'seconds':>8} {'messages/s':>11} {'MB':>5}  beside the library alone")
        theirs = 0.0
        for form, suffix in (("mcap", "mcap"), ("bag1", "bag")):
            seconds = timed([*TOOL, "convert", "-i", "walk.tum", "-o", f"w{{run}}.{suffix}", "--quiet"], folder)
            memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            theirs = theirs or timed([sys.executable, "-c", PEER, "walk.tum", "peer{run}"], folder)
            print(f"{form:<8} {seconds:8.2f} {count / seconds:11.0f} {memory:5.0f}  {theirs / seconds:.2f} x")
        print(f"\n{'read':<8} {'into':<5} {'seconds':>8} {'rows/s':>11}  goal 100000")
        for suffix in ("mcap", "bag"):
            for into in ("csv", "tum"):
                seconds = timed([*TOOL, "convert", "-i", f"w0.{suffix}", "-o", f"{suffix}{{run}}.{into}", "--quiet"], folder)
                print(f"{suffix:<8} {into:<5} {seconds:8.2f} {count / seconds:11.0f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300_000)
