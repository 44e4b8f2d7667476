"""Random expressions over random trees agree with a slow evaluator, in numbers, in frames, in what is refused."""

from __future__ import annotations

from collections import Counter

from random_expressions import check


def test_random_expressions_are_worth_and_refused_as_a_slow_evaluator_says() -> None:
    told = Counter(check(seed) for seed in range(400))
    assert min(told[kind] for kind in ("pose", "point", "vector", "number", "refused")) >= 5
