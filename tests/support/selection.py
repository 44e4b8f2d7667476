"""Choose what runs by default: one case of a slow test, or none; of a test over a grid the cases that cover all pairs.

What is left out gets the marker `slow`, which CI runs too.  The slow tests stand in `tests/slow.txt`, with how many of
their cases run, one or none; `tests/slow.py` keeps the list.  A grid has three axes or more; `--seed` draws another cover.
"""

from __future__ import annotations

import random
from itertools import combinations, groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

SLOW = Path(__file__).parents[1] / "slow.txt"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the seed of the covers."""
    parser.addoption("--seed", type=int, default=0, help="which cases of a grid cover its pairs; all run with -m slow")


def pytest_report_header(config: pytest.Config) -> str:
    """Print the seed."""
    return f"seed of the grids: {config.getoption('seed')}"


@pytest.hookimpl(tryfirst=True)  # the markers stand before `-m` looks for them
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what does not run by default."""
    slow = slow_tests()
    for name, group in groupby(items, test_of):
        cases = list(group)
        if name in slow:
            chosen = {0} if slow[name] == "one" else set()
        else:
            chosen = cover([axes(each) for each in cases], config.getoption("seed"))
        for at, item in enumerate(cases):
            if at not in chosen:
                item.add_marker("slow")


def slow_tests() -> dict[str, str]:
    """Return the slow tests and how many cases of each run by default: `one` or `none`."""
    lines = (line.split() for line in SLOW.read_text(encoding="utf-8").splitlines())
    return {name: count for count, name in lines}


def test_of(item: pytest.Item) -> str:
    """Return the name of the test that a case is of."""
    return item.nodeid.partition("[")[0].replace(" ", "_")


def axes(item: Any) -> tuple[str, ...]:
    """Return which value a case has on each axis of its grid, by the names of the values."""
    return tuple(item.callspec._idlist) if hasattr(item, "callspec") else ()  # noqa: SLF001 - nothing public says it


def cover(grid: Sequence[tuple[Hashable, ...]], seed: int) -> set[int]:
    """Choose points of a grid so that each pair of values that some point has is in one that is chosen.

    Greedy: of the points in drawn order the one with most pairs that are missing.  A grid of two axes stays whole.
    """
    width = len(grid[0]) if grid else 0
    if width < 3:
        return set(range(len(grid)))
    pairs = [{(a, point[a], b, point[b]) for a, b in combinations(range(width), 2)} for point in grid]
    order = random.Random(seed).sample(range(len(grid)), len(grid))  # noqa: S311 - no secret
    missing, chosen = set().union(*pairs), set()
    while missing:
        best = max(order, key=lambda at: len(pairs[at] & missing))
        chosen.add(best)
        missing -= pairs[best]
    return chosen
