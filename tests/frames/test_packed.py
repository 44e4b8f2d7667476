"""Samples that come in one piece are packed: the same poses to the bit, whatever is done to them, in a fifth of the memory."""

from __future__ import annotations

import random
import tracemalloc
from typing import Any

import pytest

from frametool.frames.buffer import TransformBuffer
from frametool.frames.track import MANY, Packed

BEGIN = 1_700_000_000_000_000_000
STEP = 10_000_000


def pose(seed: int) -> Any:
    return (0.1 * seed, -0.0, 1e-300 * seed, 0.0, 0.0, 0.6, 0.8)


def test_it_is_a_list_of_poses() -> None:
    draw = random.Random(3)  # noqa: S311
    packed: Any = Packed(map(pose, range(20)))
    listed: list[Any] = [*map(pose, range(20))]
    for step in range(500):
        at, end, new = draw.randrange(-len(listed), len(listed)), draw.randrange(len(listed)), pose(100 + step)
        operation = draw.choice(["append", "extend", "insert", "set", "set all", "delete"])
        for each in (packed, listed):
            if operation in ("append", "insert", "extend"):
                getattr(each, operation)(*{"append": (new,), "insert": (at, new), "extend": ([new, new],)}[operation])
            elif operation == "set":
                each[at] = new
            elif operation == "set all":
                each[:] = [*reversed([*each])]
            elif operation == "delete":
                del each[: min(end, 3)]
        assert len(packed) == len(listed)
        at = min(at, len(listed) - 1)
        assert packed[at] == listed[at]
        assert packed[min(at, end) : max(at, end)] == listed[min(at, end) : max(at, end)]
        assert [*map(repr, packed)] == [*map(repr, listed)]


@pytest.mark.parametrize("late", [0, 1, 100])
def test_lookups_are_those_of_samples_that_came_one_by_one(late: int) -> None:
    count, draw = 2 * MANY, random.Random(5)  # noqa: S311
    whole, single = TransformBuffer(), TransformBuffer()
    stamps = [BEGIN + STEP * at for at in range(count)]
    whole.insert_many("map", "base", stamps, [*map(pose, range(count))])
    for at, stamp in enumerate(stamps):
        single.insert_components("map", "base", pose(at), stamp)
    extra = [(draw.randrange(BEGIN - STEP, stamps[-1]), pose(at)) for at in range(late)] + [(stamps[-1] + 1, pose(7))]
    for buffer in (whole, single):
        for stamp, each in extra:
            buffer.insert_components("map", "base", each, stamp)
    times = [draw.randrange(BEGIN, stamps[-1]) for _ in range(200)] + stamps[:: count // 50] + [stamps[-1] + 1]
    for time in times:
        assert whole.lookup("map", "base", time).components == single.lookup("map", "base", time).components
    many = [[*part] for part in (b.lookup_many("map", "base", times).components for b in (whole, single))]
    assert str(many[0]) == str(many[1])


def test_a_sample_takes_a_hundred_bytes_and_a_little() -> None:
    count = 20 * MANY
    buffer = TransformBuffer()
    tracemalloc.start()
    try:
        for begin in range(0, count, MANY):
            stamps = [BEGIN + STEP * at for at in range(begin, begin + MANY)]
            buffer.insert_many("map", "base", stamps, [*map(pose, range(begin, begin + MANY))])
        assert tracemalloc.get_traced_memory()[0] < 130 * count
    finally:
        tracemalloc.stop()
