"""Keep the list of slow tests: `python tests/slow.py [WORDS OF PYTEST ..]` runs all and writes `tests/slow.txt` anew.

A test is slow if its cases take more processor time than MEAN on average, their processes included, or if it is one case
that takes more than ONE.  Of a slow test the first case runs by default, or none if that takes more than ONE.  What was
slow stays so until it takes less than half of that, so that two runs on a busy machine give the same list.  Prints what
came and what went.  With words (files, say) the others keep their place.
"""

from __future__ import annotations

import os
import sys
from collections import defaultdict
from pathlib import Path
from statistics import mean
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Generator, Mapping, Sequence

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE / "support")]  # as `python -m pytest` has it: the package is that of this folder

MEAN, ONE = 0.02, 0.25  # seconds; chosen so that all that runs by default takes less than 150 s of processor time


class Durations:
    """A plugin that notes the processor time of each case of each test."""

    def __init__(self) -> None:
        """Begin with none."""
        self.seconds: dict[str, list[float]] = defaultdict(list)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Time a case from its set-up to its end."""
        before = sum(os.times()[:4])
        result = yield
        self.seconds[item.nodeid.partition("[")[0].replace(" ", "_")].append(sum(os.times()[:4]) - before)
        return result


def slow_now(before: Mapping[str, str], seconds: Mapping[str, Sequence[float]]) -> dict[str, str]:
    """Return the slow tests of a run with how many cases of each run by default, and those of before that did not run."""
    found = {name: word for name, word in before.items() if name not in seconds}
    for name, took in seconds.items():
        share = 0.5 if name in before else 1.0
        if mean(took) > share * (MEAN if len(took) > 1 else ONE):
            found[name] = "one" if len(took) > 1 and took[0] <= ONE else "none"
    return found


def main(words: list[str]) -> None:
    """Run the cases, write the list and print what changed."""
    durations = Durations()
    pytest.main(["-m", "not large and not fuzz and not engines", *words], plugins=[durations])
    import selection  # pytest has loaded it by now, and rewritten its assertions

    before = selection.slow_tests() if selection.SLOW.exists() else {}
    known = before if words else {name: word for name, word in before.items() if name in durations.seconds}
    after = slow_now(known, durations.seconds)
    selection.SLOW.write_text("".join(f"{word} {name}\n" for name, word in sorted(after.items())), encoding="utf-8")
    for sign, names in (("+", set(after) - set(before)), ("-", set(before) - set(after))):
        for name in sorted(names):
            print(sign, f"{sum(durations.seconds.get(name, [0.0])):.2f} s", name)
    print(len(after), "slow tests of", len(durations.seconds))


if __name__ == "__main__":
    main(sys.argv[1:])
