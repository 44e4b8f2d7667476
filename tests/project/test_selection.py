"""What runs by default covers what it is said to cover."""

from __future__ import annotations

from itertools import combinations, product

import pytest
import slow
from selection import cover


@pytest.mark.parametrize("sizes", [(3, 4), (2, 2, 2), (2, 8, 36), (5, 4, 2, 2)])
def test_a_cover_has_each_pair_of_values_and_no_more_cases_than_it_needs(sizes: tuple[int, ...]) -> None:
    grid = list(product(*map(range, sizes)))
    largest, second = sorted(sizes)[:-3:-1]
    for seed in range(3):
        chosen = [grid[at] for at in cover(grid, seed)]
        for a, b in combinations(range(len(sizes)), 2):
            assert {(point[a], point[b]) for point in chosen} == set(product(range(sizes[a]), range(sizes[b])))
        assert largest * second <= len(chosen) <= 1.5 * largest * second


def test_a_case_is_slow_from_the_limit_on_and_stays_so_until_half_of_it() -> None:
    seconds = {"a": slow.LIMIT * 1.1, "b": slow.LIMIT * 0.6, "c": slow.LIMIT * 0.6, "d": slow.LIMIT * 0.4}
    assert slow.slow_now({"b", "d", "gone"}, seconds) == {"a", "b", "gone"}
