"""Time the core math against SciPy in one process: `python tests/benchmarks/bench_geometry.py [ROWS]`.

Both sides read and write C-order float64 arrays; each time is the best of several, the two sides alternating.
SciPy's SE(3) stands twice: reading and writing translations and quaternions, and its own 4x4 matrices.
"""

from __future__ import annotations

import platform
import sys
import time
import tracemalloc
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
import scipy
from scipy.spatial.transform import RigidTransform, Slerp
from scipy.spatial.transform import Rotation as Peer

from frametool.geometry import floats
from frametool.geometry.representations import REPRESENTATIONS
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    Case = tuple[str, float, Callable[[], Any], Callable[[], Any]]

ROUNDS = 7


def inputs(rows: int) -> dict[str, Any]:
    """Draw the arrays the cases read."""
    generator = np.random.default_rng(0)
    quaternions = generator.normal(size=(2, rows, 4))
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    points = generator.normal(size=(rows, 3))
    translations = generator.normal(size=(2, rows, 3))
    data = {
        "q": quaternions[0], "r": quaternions[1], "p": points, "t": translations[0], "u": translations[1],
        "angles": generator.uniform(-3.0, 3.0, (rows, 3)), "rotvec": generator.normal(size=(rows, 3)),
        "matrix": Peer.from_quat(quaternions[0]).as_matrix(), "fraction": generator.uniform(size=rows),
        "twist": generator.normal(size=(rows, 6)),
    }  # fmt: skip
    data["a"] = Transform.from_arrays(data["t"], data["q"]).as_matrix()
    data["b"] = Transform.from_arrays(data["u"], data["r"]).as_matrix()
    return data


def rotation_cases(d: dict[str, Any]) -> list[Case]:
    """List the operations on rotations: name, goal, ours, SciPy's."""
    q, r, p = d["q"], d["r"], d["p"]
    ours, theirs = Rotation.from_quaternion, Peer.from_quat
    keys = Peer.from_quat(q[:2])
    return [
        ("Euler -> quaternion", 25, lambda: Rotation.from_euler("rzyx", d["angles"]).as_quaternion(),
         lambda: Peer.from_euler("ZYX", d["angles"]).as_quat()),
        ("compose", 18, lambda: Rotation.as_quaternion(ours(q) @ ours(r)),
         lambda: Peer.as_quat(theirs(q) * theirs(r))),
        ("quaternion -> rotation vector", 12, lambda: ours(q).as_rotvec(), lambda: theirs(q).as_rotvec()),
        ("quaternion -> Euler", 4, lambda: ours(q).as_euler("rzyx"), lambda: theirs(q).as_euler("ZYX")),
        ("matrix -> quaternion, validated", 3, lambda: Rotation.from_matrix(d["matrix"]).as_quaternion(),
         lambda: Peer.from_matrix(d["matrix"]).as_quat()),
        ("rotation vector -> quaternion", 1.8, lambda: Rotation.from_rotvec(d["rotvec"]).as_quaternion(),
         lambda: Peer.from_rotvec(d["rotvec"]).as_quat()),
        ("apply N to N", 2.5, lambda: ours(q).apply(p), lambda: theirs(q).apply(p)),
        ("quaternion -> matrix", 1.6, lambda: ours(q).as_matrix(), lambda: theirs(q).as_matrix()),
        ("slerp of two keys", 30, lambda: ours(q[0]).slerp(ours(q[1]), d["fraction"]).as_quaternion(),
         lambda: Slerp([0.0, 1.0], keys)(d["fraction"]).as_quat()),
    ]  # fmt: skip


def rigid_cases(d: dict[str, Any]) -> list[Case]:
    """List the operations on rigid transforms."""
    q, r, p, t, u = d["q"], d["r"], d["p"], d["t"], d["u"]

    def theirs(xyz: Any, xyzw: Any) -> RigidTransform:
        return RigidTransform.from_components(xyz, Peer.from_quat(xyzw))

    def parts(peer: RigidTransform) -> Any:
        translation, rotation = peer.as_components()
        return translation, rotation.as_quat()

    def both(transform: Transform) -> Any:
        return transform.xyz, transform.xyzw

    ours, one, peer_one = Transform.from_arrays, Transform.from_arrays(t[0], q[0]), theirs(t[0], q[0])
    a, b, read, peer_read = d["a"], d["b"], Transform.from_matrix, RigidTransform.from_matrix
    return [
        ("one transform on N points", 1, lambda: one.apply(p), lambda: peer_one.apply(p)),
        ("SE(3) compose", 2, lambda: both(ours(t, q) @ ours(u, r)), lambda: parts(theirs(t, q) * theirs(u, r))),
        ("SE(3) inverse", 2, lambda: both(ours(t, q).inverse()), lambda: parts(theirs(t, q).inv())),
        ("SE(3) log", 2, lambda: ours(t, q).log(), lambda: theirs(t, q).as_exp_coords()),
        ("SE(3) exp", 2, lambda: both(Transform.exp(d["twist"])),
         lambda: parts(RigidTransform.from_exp_coords(d["twist"]))),
        ("SE(3) compose, 4x4", 1, lambda: Transform.as_matrix(read(a) @ read(b)),
         lambda: RigidTransform.as_matrix(peer_read(a) * peer_read(b))),
        ("SE(3) inverse, 4x4", 1, lambda: read(a).inverse().as_matrix(), lambda: peer_read(a).inv().as_matrix()),
        ("SE(3) log, 4x4", 1, lambda: read(a).log(), lambda: peer_read(a).as_exp_coords()),
        ("SE(3) exp, 4x4", 1, lambda: Transform.exp(d["twist"]).as_matrix(),
         lambda: RigidTransform.from_exp_coords(d["twist"]).as_matrix()),
    ]  # fmt: skip


def seconds(function: Callable[[], Any]) -> float:
    """Time one call."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def compare(case: Case, rows: int) -> str:
    """Time both sides alternately and give a row of the table."""
    name, goal, ours, theirs = case
    pairs = [(seconds(ours), seconds(theirs)) for _ in range(ROUNDS)]
    mine, peer = (min(times) / rows * 1e9 for times in zip(*pairs, strict=True))
    return f"| {name} | {mine:.1f} | {peer:.1f} | {peer / mine:.1f} | {goal:g} |"


def extra_memory(function: Callable[[], Any]) -> float:
    """Give the MiB a call needs beyond what it returns."""
    tracemalloc.start()
    result = function()
    kept, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    del result
    return (peak - kept) / 2**20


def memory_table(d: dict[str, Any]) -> list[str]:
    """Give the memory of conversions, each from array to value and from value to array."""
    rotation = Rotation.from_quaternion(d["q"])
    transform = Transform.from_arrays(d["t"], d["q"])
    cases: dict[str, Callable[[], Any]] = {
        "from_quaternion": lambda: Rotation.from_quaternion(d["q"]), "as_quaternion": rotation.as_quaternion,
        "from_euler": lambda: Rotation.from_euler("rzyx", d["angles"]), "as_euler": lambda: rotation.as_euler("rzyx"),
        "from_matrix": lambda: Rotation.from_matrix(d["matrix"]), "as_matrix": rotation.as_matrix,
        "compose": lambda: rotation @ rotation, "apply": lambda: rotation.apply(d["p"]),
        "exp": lambda: Transform.exp(d["twist"]), "log": transform.log,
    }  # fmt: skip
    return [f"| {name} | {extra_memory(function):.1f} |" for name, function in cases.items()]


def per_call(function: Callable[[], Any], repeats: int = 20000) -> float:
    """Give the microseconds of one call, the best of several runs."""

    def run() -> None:
        for _ in range(repeats):
            function()

    return min(seconds(run) for _ in range(ROUNDS)) / repeats * 1e6


def scalar_cases() -> dict[str, Callable[[], Any]]:
    """List what one item goes through, on plain floats."""
    a, b = Rotation.of(0.5, 0.5, 0.5, 0.5), Rotation.of(0.1, 0.7, 0.1, 0.7)
    s, t = Transform.of(1.0, 2.0, 3.0, *a.components), Transform.of(3.0, 2.0, 1.0, *b.components)
    cases: dict[str, Callable[[], Any]] = {"rotation compose": lambda: a @ b, "transform compose": lambda: s @ t}
    cases["transform inverse"] = s.inverse
    q = Rotation.from_rpy([0.1, 0.2, 0.3]).components
    for name, row in REPRESENTATIONS.items():
        parts = row.from_quaternion(*q, floats)
        cases[f"{name} -> quaternion"] = partial(row.to_quaternion, parts, floats)
        cases[f"quaternion -> {name}"] = partial(row.from_quaternion, *q, floats)
    return cases


def processor() -> str:
    """Name the processor where Linux does."""
    listed = Path("/proc/cpuinfo")
    lines = listed.read_text().splitlines() if listed.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{models[0]} ({len(models)} cores)" if models else platform.machine()


def main() -> None:
    """Print the tables."""
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, SciPy {scipy.__version__}"
    print(f"{rows} rows; {processor()}, {versions}\n")
    data = inputs(rows)
    print("| operation | frametool, ns a row | SciPy | ratio | goal |\n|---|---|---|---|---|")
    for case in [*rotation_cases(data), *rigid_cases(data)]:
        print(compare(case, rows), flush=True)
    print("\n| operation | MiB beyond the result |\n|---|---|")
    print("\n".join(memory_table(data)))
    print("\n| one item, floats | microseconds |\n|---|---|")
    for name, function in scalar_cases().items():
        print(f"| {name} | {per_call(function):.2f} |")


if __name__ == "__main__":
    main()
