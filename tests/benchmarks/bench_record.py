"""Recordings copied, whole processes beside a loop over the library: `python tests/benchmarks/bench_record.py [N]`.

N messages in each form, a tenth of them transforms.  The peer is the shortest script with rosbags that copies messages:
its reader, its writer, nothing changed.  Least processor seconds of several runs, messages a second, peak memory.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from recorded import SECOND, START, Maker, Sent, write

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
RUNS = 3
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()", "record"]
EDGE = "{name: camera, parent: base, xyz: [1, 2, 3]}"
OTHER = "{name: lidar, parent: base, xyz: [1, 2, 3]}"
WORK = {
    "copied": (), "--with": ("--with", EDGE), "--replace": ("--with", OTHER, "--replace"),
    "--between, half": ("--between", "{start}ns,{middle}ns"), "--into, half move": ("--into", "odom", "--topic", "/pose"),
}  # fmt: skip
PEER = """
import sys
if sys.argv[1].endswith(".bag"):
    from rosbags.rosbag1 import Reader, Writer
    with Reader(sys.argv[1]) as reader, Writer(sys.argv[2]) as writer:
        known = {each.id: writer.add_connection(each.topic, each.msgtype, msgdef=each.msgdef.data, md5sum=each.digest)
                 for each in reader.connections}
        for connection, log_ns, data in reader.messages():
            writer.write(known[connection.id], log_ns, data)
else:
    from rosbags.rosbag2 import Reader, StoragePlugin, Writer
    with Reader(sys.argv[1]) as reader, Writer(sys.argv[2], version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        known = {each.id: writer.add_connection(each.topic, each.msgtype, msgdef=each.msgdef.data, rihs01=each.digest or "x")
                 for each in reader.connections}
        for connection, log_ns, data in reader.messages():
            writer.write(known[connection.id], log_ns, data)
"""


def timed(command: list[str], folder: str) -> tuple[float, float]:
    """Return the least processor seconds of some runs, and the most memory in megabytes."""
    best, most = float("inf"), 0.0
    for run in range(RUNS):
        said = [each.replace("RUN", str(run)) for each in command]
        process = subprocess.Popen(said, stderr=subprocess.DEVNULL, cwd=folder)
        _, status, used = os.wait4(process.pid, 0)
        assert status == 0, said
        best, most = min(best, used.ru_utime + used.ru_stime), max(most, used.ru_maxrss / 1024)
    return best, most


def messages(form: str, count: int) -> Iterator[Sent]:
    """Make the messages: of ten one transform, five poses and four of a type that is not known."""
    made = Maker(form)
    still = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    yield Sent("/tf_static", *made.transforms(("base", "lidar", still, START)), START)
    for at in range(count - 1):
        log_ns, moved = START + at * SECOND // 1000, (1e-3 * at, 0.0, 0.0, 0.0, 0.0, 0.6, 0.8)
        if at % 10 == 0:
            yield Sent("/tf", *made.transforms(("odom", "base", moved, log_ns)), log_ns)
        elif at % 2:
            yield Sent("/pose", *made.pose("base", log_ns - log_ns % (SECOND // 100), moved), log_ns)
        else:
            yield Sent("/odd", "my_msgs/msg/Odd", b"1234", log_ns)


def main(count: int) -> None:
    """Print a row for each form and each change."""
    os.environ["PYTHONPATH"] = str(ROOT)
    window = {"start": START, "middle": START + count * SECOND // 2000}
    with tempfile.TemporaryDirectory() as folder:
        print(f"{'form':<7} {'what':<18} {'seconds':>8} {'messages/s':>11} {'MB':>5}  the library alone")
        for form, suffix in (("mcap", "mcap"), ("sqlite", "mcap"), ("bag", "bag")):
            name = f"run.{form}" if form == "bag" else form
            making = [sys.executable, __file__, str(count), str(Path(folder, name)), form]  # else its memory counts here
            subprocess.run(making, check=True)
            path = str(next(Path(folder, name).glob("*.mcap")) if form == "mcap" else Path(folder, name))
            theirs, their_memory = timed([sys.executable, "-c", PEER, path, f"{form}RUN.{suffix}"], folder)
            for what, arguments in WORK.items():
                said = [each.format(**window) if "ns," in each else each for each in arguments]
                seconds, memory = timed([*TOOL, path, *said, "-o", f"copy.{suffix}", "--force"], folder)
                peer = f"{theirs / seconds:5.2f} x of {count / theirs:.0f}/s, {their_memory:.0f} MB" if what == "copied" else ""
                print(f"{form:<7} {what:<18} {seconds:8.2f} {count / seconds:11.0f} {memory:5.0f}  {peer}")


if __name__ == "__main__":
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 300_000
    if len(sys.argv) > 2:
        write(Path(sys.argv[2]), sys.argv[3], messages(sys.argv[3], size))
    else:
        main(size)
