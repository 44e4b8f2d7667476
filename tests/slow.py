"""Keep the list of slow cases: `python tests/slow.py [WORDS OF PYTEST ..]` runs all and writes `tests/slow.txt` anew.

A case that takes more processor time than LIMIT, its processes included, is slow; one that was slow stays so until it
takes less than half of that, so that two runs on a busy machine give the same list.  Prints what came and what went.
With words (files, say) the cases of the rest keep their place.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Generator, Mapping

SLOW = Path(__file__).with_name("slow.txt")
sys.path.insert(0, str(SLOW.parents[1]))  # as `python -m pytest` has it: the package is that of this folder
LIMIT = 0.2  # seconds; with 1 s the rest would take more than the 150 s that it may take in all


class Durations:
    """A plugin that notes the processor time of each case."""

    def __init__(self) -> None:
        """Begin with none."""
        self.seconds: dict[str, float] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Time a case from its set-up to its end."""
        before = sum(os.times()[:4])
        result = yield
        self.seconds[item.nodeid] = sum(os.times()[:4]) - before
        return result


def slow_now(before: set[str], seconds: Mapping[str, float]) -> set[str]:
    """Return the slow cases of a run, and those of before that did not run."""
    ran = {name for name, took in seconds.items() if took > (LIMIT / 2 if name in before else LIMIT)}
    return ran | (before - set(seconds))


def main(words: list[str]) -> None:
    """Run the cases, write the list and print what changed."""
    durations = Durations()
    pytest.main(["-m", "not large and not fuzz and not engines", *words], plugins=[durations])
    before = set(SLOW.read_text(encoding="utf-8").splitlines()) if SLOW.exists() else set()
    after = slow_now(before if words else before & set(durations.seconds), durations.seconds)
    SLOW.write_text("".join(f"{name}\n" for name in sorted(after)), encoding="utf-8")
    for sign, names in (("+", after - before), ("-", before - after)):
        for name in sorted(names):
            print(sign, f"{durations.seconds.get(name, 0.0):.2f}", name)
    print(len(after), "slow cases of", len(durations.seconds))


if __name__ == "__main__":
    main(sys.argv[1:])
