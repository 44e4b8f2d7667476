"""How fast a dump of /tf is read, against CSafeLoader making the same records: `python tests/benchmarks/bench_ros.py [MB]`.

Each reader runs in a process of its own, so that its peak memory is its own. CSafeLoader reads a tenth of the dump
and is scaled up: it takes minutes for 100 MB.
"""

from __future__ import annotations

import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

EDGES = (("map", "odom"), ("odom", "base_link"), ("base_link", "arm_1"), ("arm_1", "arm_2"), ("base_link", "wheel"))
ENTRY = """transforms:
- header:
    stamp:
      sec: {sec}
      nanosec: {nanosec}
    frame_id: {parent}
  child_frame_id: {child}
  transform:
    translation:
      x: {x!r}
      y: {y!r}
      z: 0.1
    rotation:
      x: 0.0
      y: 0.0
      z: {qz!r}
      w: {qw!r}
---
"""


def main() -> None:
    """Write the dump, run the readers, print the table."""
    if len(sys.argv) == 4:
        measure(sys.argv[2], sys.argv[3])
        return
    megabytes = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    with tempfile.TemporaryDirectory() as folder:
        whole, tenth = Path(folder, "tf.txt"), Path(folder, "tenth.txt")
        write_dump(whole, megabytes * 1_000_000)
        write_dump(tenth, megabytes * 100_000)
        rows = [run("load", whole), run("samples", whole), run("safe", tenth)]
    print(f"{'reader':24} {'records/s':>12} {'MB/s':>8} {'peak MB':>8}")
    for name, size, count, seconds, peak in rows:
        print(f"{name:24} {count / seconds:12.0f} {size / seconds / 1e6:8.2f} {peak:8.0f}")
    print(f"load against CSafeLoader: {rows[0][2] / rows[0][3] / (rows[2][2] / rows[2][3]):.1f} times the records")
    print(f"peak memory of load: {rows[0][4] * 1e6 / rows[0][1]:.2f} times the size of the dump")


def write_dump(path: Path, size: int) -> None:
    """Write messages of one transform each until the file is as large as told."""
    with path.open("w") as stream:
        number = 0
        while stream.tell() < size:
            for _ in range(1000):
                stream.write(entry(number))
                number += 1


def entry(number: int) -> str:
    """Give the message of one transform, 500 a second in all."""
    seconds, nanoseconds = divmod(1_700_000_000_123_456_789 + 2_000_000 * number, 1_000_000_000)
    parent, child = EDGES[number % len(EDGES)]
    angle = 0.001 * number
    return ENTRY.format(
        sec=seconds, nanosec=nanoseconds, parent=parent, child=child, x=3 * math.sin(angle), y=2 * math.cos(angle),
        qz=math.sin(angle / 2), qw=math.cos(angle / 2),
    )  # fmt: skip


def run(reader: str, path: Path) -> tuple[str, int, int, float, float]:
    """Run one reader in a process of its own: name, bytes, records, seconds, peak megabytes."""
    done = subprocess.run(
        [sys.executable, __file__, "-", reader, str(path)], capture_output=True, text=True, check=True
    )
    count, seconds, peak = done.stdout.split()
    names = {"load": "frametool.load", "samples": "frametool, stream only", "safe": "CSafeLoader"}
    return names[reader], path.stat().st_size, int(count), float(seconds), float(peak)


def measure(reader: str, path: str) -> None:
    """Read a dump with one reader; print records, seconds and peak memory."""
    start = time.perf_counter()
    count = READERS[reader](path)
    seconds = time.perf_counter() - start
    print(count, seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000)


def load(path: str) -> int:
    """Read into a buffer that answers lookups."""
    import frametool

    buffer = frametool.load(path)
    if not isinstance(buffer, frametool.TransformBuffer):
        raise TypeError("nothing moves in the dump")
    return sum(track.count for track in buffer.tracks())


def samples(path: str) -> int:
    """Read one record after the other and keep none."""
    from frametool.formats.load import Recording

    return sum(1 for _ in Recording(path).edges())


def safe(path: str) -> int:
    """Read with PyYAML's C loader and make the same records."""
    import yaml

    records = []
    with open(path) as stream:
        for document in yaml.load_all(stream, Loader=yaml.CSafeLoader):
            for message in (document or {}).get("transforms", ()):
                stamp, moved = message["header"]["stamp"], message["transform"]
                numbers = (*moved["translation"].values(), *moved["rotation"].values())
                stamp_ns = stamp["sec"] * 1_000_000_000 + stamp["nanosec"]
                records.append((message["header"]["frame_id"], message["child_frame_id"], numbers, stamp_ns))
    return len(records)


READERS = {"load": load, "samples": samples, "safe": safe}

if __name__ == "__main__":
    main()
