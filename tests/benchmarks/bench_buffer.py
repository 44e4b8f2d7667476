"""Measure the transform buffer: `python tests/benchmarks/bench_buffer.py`.

tf2's own numbers, C++ core behind its Python binding, on a chain of ten moving edges: 235 000 lookups/s at given times.
"""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from frametool.frames.buffer import TransformBuffer
from frametool.frames.lookups import FrameTree
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

EDGES = 10
SAMPLES = 100
SECOND = 10**9
START = 1_700_000_000 * SECOND


def chain(*, moving: bool) -> TransformBuffer:
    """Make a chain f0 .. f10 with a hundred samples an edge over ten seconds, or of standing edges."""
    buffer = TransformBuffer()
    poses = Transform.random(EDGES * SAMPLES, seed=1)
    parts = [tuple(map(float, row)) for row in zip(*poses.components, strict=True)]
    for edge in range(EDGES):
        for at in range(SAMPLES if moving else 1):
            stamp = START + at * SECOND // 10 if moving else None
            buffer.insert(f"f{edge}", f"f{edge + 1}", Transform.of(*parts[edge * SAMPLES + at]), stamp)
    return buffer


def rate(count: int, action: Callable[[], object], repeats: int = 5) -> float:
    """Return things a second, the best of several runs."""
    best = float("inf")
    for _ in range(repeats):
        begin = perf_counter()
        action()
        best = min(best, perf_counter() - begin)
    return count / best


def insert_rate(order: Sequence[int], *, ask: bool = False, repeats: int = 5) -> float:
    """Measure inserts at stamps in some order, with a lookup after each if asked."""
    pose = Transform.of(1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8)

    def fill() -> None:
        buffer = TransformBuffer()
        for at in order:
            buffer.insert("map", "base", pose, START + at)
            if ask:
                buffer.lookup("map", "base", START + at)

    return rate(len(order), fill, repeats)


def single_rate(frames: TransformBuffer | FrameTree, stamps: list[int]) -> float:
    """Measure one lookup after another through the whole chain."""

    def ask() -> None:
        for stamp in stamps:
            frames.lookup("f0", f"f{EDGES}", stamp)

    return rate(len(stamps), ask)


def batch_rate(frames: TransformBuffer, times: NDArray[np.int64]) -> float:
    """Measure many lookups at once."""
    return rate(times.size, lambda: frames.lookup_many("f0", f"f{EDGES}", times), 3)


def standing_tree() -> FrameTree:
    """Make the standing chain as a tree."""
    tree = FrameTree()
    for track in chain(moving=False).tracks():
        tree.add_components(track.parent, track.child, track.components)
    return tree


def main() -> None:
    """Print the table."""
    generator = np.random.default_rng(2)
    times = generator.integers(START, START + (SAMPLES - 1) * SECOND // 10, 1_000_000)
    in_order = np.sort(times)
    moving, standing = chain(moving=True), chain(moving=False)
    few = times[:20_000].tolist()
    rows = [
        ("insert, in order", insert_rate(range(100_000)), 200_000),
        ("insert, 1e6 in reverse", insert_rate(range(1_000_000, 0, -1), repeats=1), 333_000),
        ("insert, 1e6 shuffled", insert_rate(generator.permutation(1_000_000).tolist(), repeats=1), 333_000),
        ("insert and look up, 1e4 in reverse", insert_rate(range(10_000, 0, -1), ask=True), 50_000),
        ("lookup, 10 standing edges, tree", single_rate(standing_tree(), few), 100_000),
        ("lookup, 10 standing edges, buffer", single_rate(standing, few), 100_000),
        ("lookup, 10 moving edges, random times", single_rate(moving, few), 20_000),
        ("batch of 1e6, 10 moving edges, sorted", batch_rate(moving, in_order), 940_000),
        ("batch of 1e6, 10 moving edges, random", batch_rate(moving, times), 470_000),
    ]
    print(f"{'what':<42}{'a second':>12}{'goal':>12}")
    for name, found, goal in rows:
        print(f"{name:<42}{found:>12,.0f}{goal:>12,.0f}")


if __name__ == "__main__":
    main()
