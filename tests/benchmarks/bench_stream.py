"""Streams against their peers, file to file, alternating, best of several: `python tests/benchmarks/bench_stream.py`.

Rows of five CSV columns with six decimals, JSON lines, YAML documents. Peers that are not installed are named and left
out. Ratios of one run count; seconds do not travel. `--rows N`, `--rounds N`.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

START_NS = 1_700_000_000_000_000_000
ROOT = Path(__file__).parents[2]
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
POSE = "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
MOVE_AWK = 'BEGIN{FS=OFS=","} NR==1{print;next} {x=$2;y=$3;printf "%s,%.6f,%.6f,%.6f,%s\\n",$1,1-y,2+x,3+$4,$5}'
YAW_AWK = (
    'BEGIN{FS=OFS=","} NR==1{print;next} {printf "%s,%.6f,%.6f,%.6f\\n",$1,atan2(2*($5*$2+$3*$4),1-2*($2*$2+$3*$3)),'
    "$2*$5-$3*$4,atan2(2*($5*$4+$2*$3),1-2*($3*$3+$4*$4))}"
)
PANDAS_POINTS = """
import pandas, sys, numpy as np
from scipy.spatial.transform import Rotation as R
d = pandas.read_csv(sys.argv[1])
d[["x", "y", "z"]] = R.from_euler("z", 90, degrees=True).apply(d[["x", "y", "z"]].to_numpy(copy=True)) + [1, 2, 3]
d.to_csv(sys.stdout, index=False, float_format="%.6f")
"""
SCIPY_RPY = """
import sys, numpy as np
from scipy.spatial.transform import Rotation as R
d = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
np.savetxt(sys.stdout, np.c_[d[:, 0], R.from_quat(d[:, 1:5]).as_euler("xyz")], "%.6f", ",")
"""
JSON_LINES = """
import json, sys
for line in open(sys.argv[1]):
    d = json.loads(line)
    d["x"], d["y"], d["z"] = 1 - d["y"], 2 + d["x"], 3 + d["z"]
    sys.stdout.write(json.dumps(d) + "\\n")
"""
YAML_DOCUMENTS = """
import sys, yaml
for d in yaml.load_all(open(sys.argv[1]), yaml.CSafeLoader):
    if d:
        sys.stdout.write("%r\\n" % d["point"]["x"])
"""


def chain(rng: np.random.Generator) -> str:
    """Give a chain of ten edges that move for 100 s, 100 samples each, as records."""
    records = [
        {"name": f"f{edge + 1}", "parent": f"f{edge}", "samples": [
            {"stamp_ns": START_NS + sample * 10**9, "xyz": rng.normal(size=3).tolist(), "rpy": rng.normal(size=3).tolist()}
            for sample in range(101)
        ]}
        for edge in range(10)
    ]  # fmt: skip
    return json.dumps(records)


def generate(folder: Path, rows: int) -> dict[str, Path]:
    """Write the inputs, once."""
    rng = np.random.default_rng(1)
    points = rng.uniform(-100, 100, (rows, 3))
    turns = rng.normal(size=(rows, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    files = {
        name: folder / name
        for name in ("points.csv", "long.csv", "turns.csv", "points.jsonl", "points.yaml", "points.txt", "chain.json")
    }
    files["stamped.csv"] = folder / "stamped.csv"
    files["chain.json"].write_text(chain(rng))
    with files["stamped.csv"].open("w") as out:
        out.write("stamp,x,y,z,tag\n")
        for i, (x, y, z) in enumerate(points.tolist()):
            at = START_NS + i * 10**11 // rows
            out.write(f"{at // 10**9}.{at % 10**9:09d},{x:.6f},{y:.6f},{z:.6f},t{i % 1000:03d}\n")
    with (
        files["points.csv"].open("w") as six,
        files["long.csv"].open("w") as long,
        files["points.txt"].open("w") as plain,
    ):
        six.write("id,x,y,z,tag\n")
        long.write("id,x,y,z,tag\n")
        for i, (x, y, z) in enumerate(points.tolist()):
            six.write(f"{i},{x:.6f},{y:.6f},{z:.6f},t{i % 1000:03d}\n")
            long.write(f"{i},{x!r},{y!r},{z!r},t{i % 1000:03d}\n")
            plain.write(f"{x:.6f} {y:.6f} {z:.6f}\n")
    with files["turns.csv"].open("w") as out:
        out.write("t,qx,qy,qz,qw\n")
        out.writelines(
            f"{i * 0.01:.6f},{x:.6f},{y:.6f},{z:.6f},{w:.6f}\n" for i, (x, y, z, w) in enumerate(turns.tolist())
        )
    with files["points.jsonl"].open("w") as out:
        out.writelines(
            f'{{"id": {i}, "x": {x:.6f}, "y": {y:.6f}, "z": {z:.6f}}}\n' for i, (x, y, z) in enumerate(points.tolist())
        )
    with files["points.yaml"].open("w") as out:
        for i, (x, y, z) in enumerate(points[: rows // 10].tolist()):
            out.write(
                f"header:\n  stamp:\n    sec: {i}\n    nanosec: 5\n  frame_id: lidar\npoint:\n  x: {x:.6f}\n  y: {y:.6f}\n  z: {z:.6f}\n---\n"
            )
    return files


def contests(files: dict[str, Path]) -> list[tuple[str, int, dict[str, tuple[list[str], float | None]]]]:
    """List name, divisor of the rows, and the commands with the goal each peer sets."""
    csv, long, turns, lines, documents, plain, tree, stamped = (str(files[name]) for name in files)
    move = [*TOOL, "apply", "--transform", POSE, "-i"]
    python = [sys.executable, "-c"]
    six = ["--precision", "6"]
    cct = [
        "cct",
        "-d",
        "6",
        "+proj=helmert",
        "+convention=position_vector",
        "+x=1",
        "+y=2",
        "+z=3",
        "+rz=324000",
        plain,
    ]
    return [
        ("points, --precision 6", 1, {
            "frametool": ([*move, csv, *six], None), "cct": (cct, 1.8), "mawk": (["mawk", MOVE_AWK, csv], 1.5),
            "mlr": (["mlr", "--csv", "--ofmt", "%.6f", "put", "$x=1-$y;$y=2+$x;$z=3+$z", csv], 6.0),
            "pandas": ([*python, PANDAS_POINTS, csv], 5.0),
        }),
        ("quaternion to rpy, --precision 6", 1, {
            "frametool": ([*TOOL, "convert", "--to", "rpy", "-i", turns, *six], None), "mawk": (["mawk", YAW_AWK, turns], 1.0),
            "scipy": ([*python, SCIPY_RPY, turns], None),
        }),
        ("points, shortest", 1, {"frametool": ([*move, csv], None)}),
        ("points of 17 digits, --precision 6", 1, {"frametool": ([*move, long, *six], None)}),
        ("points of 17 digits, shortest", 1, {"frametool": ([*move, long], None)}),
        ("JSON lines", 1, {
            "frametool": ([*move, lines], None), "jq": (["jq", "-c", ".x=1-.y|.y=2+.x|.z=3+.z", lines], 3.0),
            "json": ([*python, JSON_LINES, lines], 2.5),
        }),
        ("YAML documents", 10, {
            "frametool": ([*move, documents], None), "yaml": ([*python, YAML_DOCUMENTS, documents], 3.0),
        }),
        ("stamped points through ten moving edges, each at its own time", 1, {
            "frametool": ([*TOOL, "apply", tree, "f0", "f10", "--time-column", "stamp", "-i", stamped, *six], None),
        }),
    ]  # fmt: skip


def seconds(command: list[str]) -> float:
    """Time one run into a null sink."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with Path(os.devnull).open("wb") as sink:
        start = time.perf_counter()
        subprocess.run(command, stdout=sink, check=True, env=environment)
        return time.perf_counter() - start


def is_there(peer: str) -> bool:
    """Tell whether a peer is installed."""
    modules = {"frametool": "click", "pandas": "pandas", "scipy": "scipy", "json": "json", "yaml": "yaml"}
    return find_spec(modules[peer]) is not None if peer in modules else shutil.which(peer) is not None


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    missing = set()
    with tempfile.TemporaryDirectory() as folder:
        files = generate(Path(folder), options.rows)
        for name, divisor, commands in contests(files):
            present = {peer: command for peer, (command, _) in commands.items() if is_there(peer)}
            missing |= set(commands) - set(present)
            best = dict.fromkeys(present, float("inf"))
            for _ in range(options.rounds):
                for peer, command in present.items():
                    best[peer] = min(best[peer], seconds(command))
            print(f"{name}: {options.rows / divisor / best['frametool'] / 1e3:.0f} k rows/s")
            for peer in present:
                goal = commands[peer][1]
                if peer != "frametool":
                    print(f"    {best[peer] / best['frametool']:6.2f} x {peer}" + (f"  (goal {goal})" if goal else ""))
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(f"largest child: {peak / 1024:.0f} MB (peers included)")
    print(f"not installed: {', '.join(sorted(missing)) or 'none'}")


if __name__ == "__main__":
    main()
