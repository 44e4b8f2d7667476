"""Time the reading of large trees and lookups on single items: `python tests/benchmarks/bench_tree.py`."""

from __future__ import annotations

import random
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

FRAMES = 100_000


def big_tree(frames: int) -> str:
    """Write a tree in the list form, a random parent for each frame."""
    draw = random.Random(1)  # noqa: S311 - not for secrets
    lines = ["frames:", "  - {name: f0, parent: world, xyz: [1.0, 2.0, 3.0], rpy_deg: [0, 0, 90]}"]
    for child in range(1, frames):
        parent = draw.randrange(max(0, child - 1000), child)
        xyz = ", ".join(f"{draw.uniform(-5, 5):.6f}" for _ in range(3))
        rpy = ", ".join(f"{draw.uniform(-90, 90):.4f}" for _ in range(3))
        lines.append(f"  - {{name: f{child}, parent: f{parent}, xyz: [{xyz}], rpy_deg: [{rpy}]}}")
    return "\n".join(lines) + "\n"


def seconds(function: Callable[[], object], repeat: int = 1) -> float:
    """Give the shortest of several runs."""
    best = float("inf")
    for _ in range(repeat):
        begin = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - begin)
    return best


def main() -> None:
    """Print the figures."""
    from frametool import FrameTree, Rotation, Transform, load

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "big.yaml"
        path.write_text(big_tree(FRAMES))
        ours = seconds(lambda: load(path), 2)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        import yaml

        theirs = seconds(lambda: yaml.load(path.read_text(), yaml.CSafeLoader))
    print(f"{FRAMES} frames: load {ours:.2f} s (peak {memory:.0f} MB), yaml.load with CSafeLoader {theirs:.2f} s, "
          f"ratio {theirs / ours:.1f}  (goal 6)")

    a, b = Transform.random(seed=1), Transform.random(seed=2)
    p, q = Rotation.random(seed=1), Rotation.random(seed=2)
    tree = FrameTree()
    for edge in range(10):
        tree.add(f"f{edge}", f"f{edge + 1}", Transform.random(seed=edge))
    cases: list[tuple[str, Callable[[], object], float]] = [
        ("Rotation @ Rotation", lambda: p @ q, 1.0),
        ("Transform @ Transform", lambda: a @ b, 2.5),
        ("lookup over 10 edges", lambda: tree.lookup("f0", "f10"), 25.0),
    ]
    for name, function, goal in cases:
        best = seconds(lambda function=function: [function() for _ in range(2000)], 20) / 2000  # type: ignore[misc]
        print(f"{name:22s} {best * 1e6:6.2f} us  (goal {goal:g})")


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent))
    main()
