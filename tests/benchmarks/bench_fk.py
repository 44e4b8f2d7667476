"""Time forward kinematics: `python tests/benchmarks/bench_fk.py [ROWS]`, where pinocchio is installed against it.

The peer is called as its users call it from Python: row by row, the frame's placement read as translation and
quaternion.  Its robot comes from the same file; the poses are compared before anything is timed.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import frametool

if TYPE_CHECKING:
    from collections.abc import Callable

ROUNDS = 5
GOAL, GOAL_TEXT = 2.5, 0.25  # times the peer; Mrow/s of the command
BEFORE = (("0 0 0.3", "0 0 0"), ("0 0 0", "-1.5707963267948966 0 0"), ("0 -0.3 0", "1.5707963267948966 0 0"))
AXES = ("0 0 1", "0 0 1", "0 0 1", "0 0 -1", "0 0 1", "0 0 -1", "0 0 1")


def seven_joints() -> str:
    """Write an arm with seven joints whose axes are turned as those of most arms are."""
    links = "".join(f'<link name="l{index}"/>' for index in range(8))
    joints = "".join(
        f'<joint name="j{at}" type="revolute"><origin xyz="{BEFORE[at % 3][0]}" rpy="{BEFORE[at % 3][1]}"/>'
        f'<parent link="l{at}"/><child link="l{at + 1}"/><axis xyz="{axis}"/>'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        for at, axis in enumerate(AXES)
    )
    return f'<robot name="arm">{links}{joints}</robot>'


def best(*calls: Callable[[], Any]) -> list[float]:
    """Give the best time of each call, in turns."""
    times = [[] for _ in calls]  # type: list[list[float]]
    for _ in range(ROUNDS):
        for call, own in zip(calls, times, strict=True):
            start = time.perf_counter()
            call()
            own.append(time.perf_counter() - start)
    return [min(own) for own in times]


def peer(path: str, values: Any) -> Callable[[], Any] | None:
    """Give the call of pinocchio for all rows; None where it is not installed."""
    try:
        pinocchio: Any = import_module("pinocchio")
    except ImportError:
        return None
    model = pinocchio.buildModelFromUrdf(path)
    data, tip = model.createData(), model.getFrameId("l7")

    def call() -> Any:
        found = np.empty((len(values), 7))
        for row, posture in enumerate(values):
            pinocchio.forwardKinematics(model, data, posture)
            pinocchio.updateFramePlacement(model, data, tip)
            found[row] = pinocchio.SE3ToXYZQUAT(data.oMf[tip])
        return found

    return call


def command(path: Path, values: Any) -> float:
    """Give the time of the command with text in and out, start-up included."""
    rows = path.with_suffix(".csv")
    header = ",".join(f"j{at}" for at in range(7))
    rows.write_text(header + "\n" + "\n".join(",".join(map(repr, row)) for row in values.tolist()) + "\n")
    line = [sys.executable, "-m", "frametool", "fk", str(path), "l0", "l7", "-i", str(rows), "--quiet"]
    root = Path(__file__).parents[2]
    with path.with_suffix(".out").open("wb") as out:
        return best(lambda: subprocess.run(line, stdout=out, check=True, cwd=root))[0]


def main(rows: int) -> None:
    """Print one line a case."""
    values = np.random.default_rng(0).uniform(-2.9, 2.9, (rows, 7))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(seven_joints())
        robot = frametool.load_robot(path)
        few = values[: max(rows // 10, 1)]
        theirs = peer(str(path), few)
        calls: list[Callable[[], Any]] = [lambda: robot.fk("l0", "l7", values)]
        if theirs is not None:
            pose, found = robot.fk("l0", "l7", few), theirs()
            assert np.abs(pose.xyz - found[:, :3]).max() < 1e-12
            calls.append(theirs)
        ours, *others = best(*calls)
        print(f"arrays: {rows / ours / 1e6:.2f} Mrow/s", end="")
        if others:
            ratio = others[0] / len(few) * rows / ours
            print(f", {ratio:.1f} times pinocchio row by row (goal {GOAL})", end="")
        print("" if others else "  (pinocchio is not installed: pip install pin)")
        took = command(path, values)
        print(f"command, CSV to CSV: {rows / took / 1e6:.2f} Mrow/s (goal {GOAL_TEXT})")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
