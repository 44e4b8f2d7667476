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
    packed: Any = Packed(map(pose, range(5)))
    listed: Any = [*map(pose, range(5))]
    for each in (packed, listed):
        each.append(pose(7))
        each.extend([pose(8), pose(9)])
    for at in range(-8, 8):
        assert repr(packed[at]) == repr(listed[at])
    assert [*map(repr, packed)] == [*map(repr, listed)]


def test_packed_samples_are_replaced_and_forgotten_as_others() -> None:
    buffer = TransformBuffer(keep_ns=STEP * MANY)
    buffer.insert_many("map", "base", [BEGIN + STEP * at for at in range(2 * MANY)], [*map(pose, range(2 * MANY))])
    last = BEGIN + STEP * (2 * MANY - 1)
    assert buffer.insert_components("map", "base", pose(3), last)
    assert buffer.lookup("map", "base", last).components == pose(3)
    track = buffer.track("base")
    assert track is not None
    track.drop_before(last - STEP)  # type: ignore[union-attr]
    assert [sample for _, _, sample in track.walk()] == [pose(2 * MANY - 2), pose(3)]


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
