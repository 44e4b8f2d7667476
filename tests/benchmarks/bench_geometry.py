"""Time the core math against SciPy in one process: `python tests/benchmarks/bench_geometry.py [ROWS]`.

Both sides read and write C-order float64 arrays; each time is the best of several, the sides taking turns.  Ratios are
SciPy's time to ours, without and with an array for the result (`out=`); the goals are those for 1e6 rows and AVX-512.
SciPy's SE(3) appears twice: reading and writing translations and quaternions, and its own 4x4 matrices.
"""

from __future__ import annotations

import platform
import sys
import time
import tracemalloc
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
import scipy
from scipy.spatial.transform import RigidTransform, Slerp
from scipy.spatial.transform import Rotation as Peer

from frametool.geometry import floats
from frametool.geometry.representations import ROTATIONS, notation
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

ROUNDS = 9


class Case(NamedTuple):
    """One operation: how much faster than SciPy's it is to be, without and with `out=`."""

    name: str
    goal: float
    goal_with_out: float
    ours: Callable[..., Any]
    theirs: Callable[[], Any]


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
    """List the operations on rotations."""
    q, r, p = d["q"], d["r"], d["p"]
    ours, theirs = Rotation.from_quaternion, Peer.from_quat
    keys = Peer.from_quat(q[:2])
    return [
        Case("Euler -> quaternion", 22, 25, lambda out=None: Rotation.from_euler("rzyx", d["angles"]).as_quaternion(out=out),
             lambda: Peer.from_euler("ZYX", d["angles"]).as_quat()),
        Case("compose", 10.5, 13, lambda out=None: (ours(q) @ ours(r)).as_quaternion(out=out),
             lambda: Peer.as_quat(theirs(q) * theirs(r))),
        Case("quaternion -> rotation vector", 12, 14, lambda out=None: ours(q).as_rotvec(out=out),
             lambda: theirs(q).as_rotvec()),
        Case("quaternion -> Euler", 2.5, 2.8, lambda out=None: ours(q).as_euler("rzyx", out=out),
             lambda: theirs(q).as_euler("ZYX")),
        Case("matrix -> quaternion, validated", 4, 4, lambda out=None: Rotation.from_matrix(d["matrix"]).as_quaternion(out=out),
             lambda: Peer.from_matrix(d["matrix"]).as_quat()),
        Case("rotation vector -> quaternion", 1.0, 1.2, lambda out=None: Rotation.from_rotvec(d["rotvec"]).as_quaternion(out=out),
             lambda: Peer.from_rotvec(d["rotvec"]).as_quat()),
        Case("apply N to N", 2.3, 2.5, lambda out=None: ours(q).apply(p, out=out), lambda: theirs(q).apply(p)),
        Case("quaternion -> matrix", 1.3, 1.6, lambda out=None: ours(q).as_matrix(out=out), lambda: theirs(q).as_matrix()),
        Case("slerp of two keys", 16, 18, lambda out=None: ours(q[0]).slerp(ours(q[1]), d["fraction"]).as_quaternion(out=out),
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

    def both(transform: Transform, out: Any) -> Any:
        return transform.xyz, transform.rotation.as_quaternion(out=out and out[1])

    ours, one, peer_one = Transform.from_arrays, Transform.from_arrays(t[0], q[0]), theirs(t[0], q[0])
    a, b, read, peer_read = d["a"], d["b"], Transform.from_matrix, RigidTransform.from_matrix
    return [
        Case("one transform on N points", 3, 3, lambda out=None: one.apply(p, out=out), lambda: peer_one.apply(p)),
        Case("SE(3) compose", 4, 4, lambda out=None: both(ours(t, q) @ ours(u, r), out),
             lambda: parts(theirs(t, q) * theirs(u, r))),
        Case("SE(3) inverse", 4, 4, lambda out=None: both(ours(t, q).inverse(), out),
             lambda: parts(theirs(t, q).inv())),
        Case("SE(3) log", 4, 4, lambda out=None: ours(t, q).log(out=out), lambda: theirs(t, q).as_exp_coords()),
        Case("SE(3) exp", 4, 4, lambda out=None: both(Transform.exp(d["twist"]), out),
             lambda: parts(RigidTransform.from_exp_coords(d["twist"]))),
        Case("SE(3) compose, 4x4", 2.5, 2.5, lambda out=None: (read(a) @ read(b)).as_matrix(out=out),
             lambda: RigidTransform.as_matrix(peer_read(a) * peer_read(b))),
        Case("SE(3) inverse, 4x4", 2.5, 2.5, lambda out=None: read(a).inverse().as_matrix(out=out),
             lambda: peer_read(a).inv().as_matrix()),
        Case("SE(3) log, 4x4", 2.5, 2.5, lambda out=None: read(a).log(out=out), lambda: peer_read(a).as_exp_coords()),
        Case("SE(3) exp, 4x4", 2.5, 2.5, lambda out=None: Transform.exp(d["twist"]).as_matrix(out=out),
             lambda: RigidTransform.from_exp_coords(d["twist"]).as_matrix()),
    ]  # fmt: skip


def seconds(function: Callable[[], Any]) -> float:
    """Time one call, in seconds of the processor: other work on the machine counts less than by the clock."""
    start = time.process_time()
    function()
    return time.process_time() - start


def compare(case: Case, rows: int) -> str:
    """Time both sides in turns, and ours with a result that is there already; return a row of the table."""
    out = case.ours()
    times: list[list[float]] = [[], [], []]
    for _ in range(ROUNDS):
        times[0].append(seconds(case.ours))
        times[1].append(seconds(case.theirs))
        times[2].append(seconds(partial(case.ours, out=out)))
    mine, peer, given = (min(each) / rows * 1e9 for each in times)
    plain = f"| {case.name} | {peer:.1f} | {mine:.1f} | {verdict(peer / mine, case.goal)} |"
    return f"{plain} {given:.1f} | {verdict(peer / given, case.goal_with_out)} |"


def verdict(ratio: float, goal: float) -> str:
    """Show a ratio with its goal, and whether it is missed."""
    return f"{ratio:.3g} | {goal:g}{'' if ratio >= goal else ' missed'}"


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
    for name in ROTATIONS:
        row = notation("euler:sxyz" if name == "euler" else name)
        parts = row.from_quaternion(*q, floats)
        cases[f"{name} -> quaternion"] = partial(row.to_quaternion, parts, floats)
        cases[f"quaternion -> {name}"] = partial(row.from_quaternion, *q, floats)
    return cases


def processor() -> str:
    """Name the processor where Linux does, and whether it has the instructions the goals are for."""
    listed = Path("/proc/cpuinfo")
    lines = listed.read_text().splitlines() if listed.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    wide = any("avx512f" in line for line in lines if line.startswith("flags"))
    named = f"{models[0]} ({len(models)} cores)" if models else platform.machine()
    return f"{named} {'with' if wide else 'without'} AVX-512"


def main() -> None:
    """Print the tables."""
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, SciPy {scipy.__version__}"
    print(f"{rows} rows; {processor()}, {versions}\n")
    data = inputs(rows)
    print("| operation | SciPy, ns a row | frametool | ratio | goal | with out= | ratio | goal |")
    print("|---|---|---|---|---|---|---|---|")
    for case in [*rotation_cases(data), *rigid_cases(data)]:
        print(compare(case, rows), flush=True)
    print("\n| operation | MiB beyond the result |\n|---|---|")
    print("\n".join(memory_table(data)))
    print("\n| one item, floats | microseconds |\n|---|---|")
    for name, function in scalar_cases().items():
        print(f"| {name} | {per_call(function):.2f} |")


if __name__ == "__main__":
    main()
