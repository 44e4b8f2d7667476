"""Choose what runs by default: all but the slow cases, and of a law over a grid those that cover all pairs of values.

What is left out gets the marker `slow`, which CI runs too.  The slow cases stand in `tests/slow.txt`, a line a case, which
`tests/slow.py` keeps.  The grids are the laws and all that has three axes or more; `--seed` draws another cover.
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
    slow = set(SLOW.read_text(encoding="utf-8").splitlines())
    for _, group in groupby(items, lambda item: item.nodeid.partition("[")[0]):
        cases = list(group)
        covering = cover([axes(each) for each in cases], config.getoption("seed"))
        for at, item in enumerate(cases):
            if at not in covering or item.nodeid in slow:
                item.add_marker("slow")


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
