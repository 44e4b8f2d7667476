"""Rings of frames measured without sigmas: solved, with the noise found or said to be rough."""

from __future__ import annotations

import pytest
from worlds import ring

from frametool.fit.measured_tree import solve_tree

NOISE = 1e-3  # metres, radians
RINGS = [(frames, more) for frames in range(3, 13) for more in range(4)]


def shares(seeds: range, rings: list[tuple[int, int]]) -> list[bool]:
    """Return for each ring whether its sigmas are within a factor 3; every one is solved, and all rows are kept."""
    close = []
    for frames, more in rings:
        for seed in seeds:
            found = solve_tree(ring(frames, more, seed=seed))
            assert found.used.all(), (frames, more, seed)
            assert found.sigma is not None
            close.append(all(1 / 3 < each / NOISE < 3 for each in found.sigma))
    return close


def test_rings_by_sample() -> None:
    close = shares(range(1), RINGS[::5])
    assert sum(close) >= 0.9 * len(close)


@pytest.mark.fuzz
def test_rings() -> None:
    close = shares(range(20), RINGS)
    assert sum(close) >= 0.9 * len(close)
