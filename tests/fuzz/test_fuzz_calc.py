"""Expressions by the thousand: random ones against a slow evaluator, broken ones against the contract."""

from __future__ import annotations

import random
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from random_expressions import World, check, text_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

pytestmark = pytest.mark.fuzz
TREE = str(Path(__file__).parents[2] / "examples" / "robot.yaml")
BITS = [
    "map<-tool", "a<-b", "row", "row.x", "{xyz: [1, 2, 3]}", "{", "}", "[", "]", "(", ")", ",", "*", "/", "+", "-", "^", "@", "=", "as ", " in ", "inv(", "dist(", "mean(",
    "1", "2m", "3deg", "1e308", "1e-320", "0", "2.5s", "latest", "pi", "ans", '"', "'", "<-", "é", "\t", "\n", "#", ";", "~", "exp(", "log(", "vector(", "acos(", "\ud800",
]  # fmt: skip


@pytest.mark.parametrize("begin", range(0, 20_000, 2_000))
def test_random_expressions_are_as_a_slow_evaluator_says(begin: int) -> None:
    for seed in range(begin + 1_000, begin + 3_000):
        check(seed)


@pytest.mark.parametrize("seed", range(20))
def test_broken_expressions_are_refused_in_a_line(seed: int, run: Callable[..., Any]) -> None:
    generator = random.Random(seed)  # noqa: S311 - no secrets here
    for _ in range(150):
        if generator.random() < 0.5:
            text = "".join(generator.choice(BITS) for _ in range(generator.randint(1, 12)))
        else:
            text = text_of(World(generator.randrange(10**6)).anything())
            at = generator.randrange(len(text))
            text = text[:at] + generator.choice(BITS) + text[at + generator.randrange(3) :]
        done = run("calc", "--tree", TREE, "--", text, stdin="x,y,z\n1,2,3\n")
        assert done.status in (0, 1, 2, 4, 5), text
        lines = done.err.splitlines()
        assert done.status == 0 or lines[-1].startswith("frametool: ") or lines[-1].strip() == "^", (text, done.err)
        assert "Traceback" not in done.err
        assert sum(line.startswith("frametool: ") and "warning" not in line for line in lines) <= 1, (text, done.err)
