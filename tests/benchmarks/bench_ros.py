"""How fast a dump of /tf is read, against CSafeLoader making the same records: `python tests/benchmarks/bench_ros.py [MB]`.

Each reader runs in a process of its own, so that its peak memory is its own. CSafeLoader reads a tenth of the dump
and is scaled up: it takes minutes for 100 MB. Then `load` as a multiple of the plain parser of each form, in turns in
one process, minima of processor time: dumps and JSON lines of ROS 1 and 2, with 1, 2 and 5 transforms a message.
"""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

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
    print(f"\n{'load against the parser':24} {'echo / CSafeLoader':>20} {'JSON / json.loads':>18} {'rosbridge':>10}")
    for ros in "ros2", "ros1":
        for count in 1, 2, 5:
            found = " ".join(f"{ratio:{width}.2f}" for ratio, width in zip(ratios(ros, count), (20, 18, 10), strict=True))
            print(f"{ros}, {count} a message{'':8} {found}")


def ratios(ros: str, count: int, messages: int = 4000, rounds: int = 7) -> list[float]:
    """Return how many times as fast as its parser `load` is: echoed text, JSON lines, JSON lines in envelopes."""
    import yaml

    from frametool.grammar.result import Style
    from frametool.ros.messages import message_text

    made = [message(ros, number, count) for number in range(messages)]
    lines = [json.dumps(each) + "\n" for each in made]
    forms = {
        "".join(message_text(each, Style(ros)) for each in made): lambda text: list(
            yaml.load_all(text, Loader=yaml.CSafeLoader)
        ),
        "".join(lines): lambda text: [*map(json.loads, text.splitlines())],
        "".join(f'{{"op": "publish", "topic": "/tf", "msg": {line[:-1]}}}\n' for line in lines): lambda text: [
            *map(json.loads, text.splitlines())
        ],
    }
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for text, parse in forms.items():
            path = Path(folder, "tf")
            path.write_text(text)
            least = [math.inf, math.inf]
            for _ in range(rounds):
                least = [*map(min, least, (seconds(load, str(path)), seconds(parse, text)))]
            found.append(least[1] / least[0])
    return found


def seconds(action: Callable[[str], object], text: str) -> float:
    """Return the processor time of an action."""
    start = time.process_time()
    action(text)
    return time.process_time() - start


def message(ros: str, number: int, count: int) -> dict[str, Any]:
    """Return a message of transforms at one time."""
    names = ("sec", "nanosec") if ros == "ros2" else ("secs", "nsecs")
    stamp = dict(zip(names, divmod(1_700_000_000_123_456_789 + 20_000_000 * number, 1_000_000_000), strict=True))
    angle = 0.001 * number
    return {
        "transforms": [
            {
                "header": ({} if ros == "ros2" else {"seq": number}) | {"stamp": stamp, "frame_id": parent},
                "child_frame_id": child,
                "transform": {
                    "translation": {"x": 3 * math.sin(angle), "y": 2 * math.cos(angle), "z": 0.1},
                    "rotation": {"x": 0.0, "y": 0.0, "z": math.sin(angle / 2), "w": math.cos(angle / 2)},
                },
            }
            for parent, child in EDGES[:count]
        ]
    }


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
    from frametool.formats.load import FrameFile

    return sum(1 for _ in FrameFile(path).edges())


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
