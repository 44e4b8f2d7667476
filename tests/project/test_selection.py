"""What runs by default covers what it is said to cover."""

from __future__ import annotations

import re
from itertools import combinations, product
from pathlib import Path

import pytest
import selection
import slow
from selection import cover

TESTS = Path(__file__).parents[1]


@pytest.mark.parametrize("sizes", [(3, 4), (2, 2, 2), (2, 8, 36), (5, 4, 2, 2)])
def test_a_cover_has_each_pair_of_values_and_no_more_cases_than_it_needs(sizes: tuple[int, ...]) -> None:
    grid = list(product(*map(range, sizes)))
    largest, second = sorted(sizes)[:-3:-1]
    for seed in range(3):
        chosen = [grid[at] for at in cover(grid, seed)]
        for a, b in combinations(range(len(sizes)), 2):
            assert {(point[a], point[b]) for point in chosen} == set(product(range(sizes[a]), range(sizes[b])))
        assert largest * second <= len(chosen) <= 1.5 * largest * second


def test_a_test_is_slow_from_a_limit_on_and_stays_so_until_half_of_it() -> None:
    fast, slow_cases, rest = [0.1 * slow.MEAN] * 3, [1.1 * slow.MEAN] * 3, [0.6 * slow.MEAN] * 3
    took = {"a": slow_cases, "b": rest, "c": rest, "d": fast, "e": [1.1 * slow.ONE], "f": [1.1 * slow.ONE, 0.0]}
    before = {"b": "one", "d": "one", "gone": "none"}
    assert slow.slow_now(before, took) == {"a": "one", "b": "one", "e": "none", "f": "none", "gone": "none"}


def test_a_slow_test_is_one_that_is_there() -> None:
    names = {f"{path.relative_to(TESTS.parent)}::{name}" for path in TESTS.rglob("test_*.py") for name in re.findall(r"(?m)^def (test_\w+)", path.read_text(encoding="utf-8"))}
    assert {name for name in selection.slow_tests() if not name.endswith("::runTest")} - names == set()  # a machine of hypothesis
