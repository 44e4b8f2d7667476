"""`out=` of every `as_X` and `apply`: the same bits as without, in any array that can hold them; else one line."""

from __future__ import annotations

import inspect
import tracemalloc
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.errors import FrametoolError, ValueInvalid
from frametool.geometry.arrays import BLOCK
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Way = Callable[..., Any]  # (value, vectors or none, out=)

POSES = Transform.random(12, seed=1)
MANY = Transform.random(BLOCK + 5, seed=2)
WIDTHS = {"vectors": 3, "points": 3, "twists": 6, "wrenches": 6}


def own_ways(kind: type[Rotation | Transform]) -> dict[str, tuple[Way, int]]:
    """List the methods that return rows, with how many numbers a vector they take has, 0 for none."""
    ways: dict[str, tuple[Way, int]] = {}
    for name, method in inspect.getmembers(kind, inspect.isfunction):
        if name.startswith(("as_", "apply")) or name == "log":
            first = list(inspect.signature(method).parameters)[1]
            if first in ("axes", "name"):
                named = ("rzyx", "szxz") if first == "axes" else ("mrp", "six_d")
                ways |= {f"{name} {each}": (partial(_named, method, each), 0) for each in named}
            else:
                ways[name] = method, WIDTHS.get(first, 0)
    return ways


def _named(method: Way, name: str, value: Any, **options: Any) -> Any:
    return method(value, name, **options)


WAYS = {
    f"{kind.__name__} {name}": (kind, *way) for kind in (Rotation, Transform) for name, way in own_ways(kind).items()
}
each_way = pytest.mark.parametrize("way", WAYS)


def case(way: str, poses: Transform) -> tuple[Callable[..., Any], Any]:
    """Return a way bound to its value, and the vectors it takes, as a list of none or one."""
    kind, method, width = WAYS[way]
    value = poses if kind is Transform else poses.rotation
    drawn = np.random.default_rng(3).normal(size=(*poses.shape, width))
    return partial(method, value), [drawn] if width else []


def whole(result: Any) -> Any:
    """Join what is returned in two pieces."""
    return np.concatenate((result[0], np.expand_dims(result[1], -1)), -1) if isinstance(result, tuple) else result


def same(found: Any, expected: Any) -> bool:
    return bool(np.array_equal(np.array(found).view(np.int64), np.array(expected).view(np.int64)))


def places(shape: tuple[int, ...]) -> dict[str, Any]:
    """Make arrays of a shape that lie in memory in all ways."""
    wide = np.full((*shape[:-1], 2 * shape[-1] + 1), np.nan)
    return {
        "c": np.full(shape, np.nan),
        "fortran": np.full(shape, np.nan, order="F"),
        "wide": wide[..., 1 : shape[-1] + 1],
        "every second": wide[..., 1::2],
        "backwards": np.flip(np.full(shape, np.nan)),
        "turned": np.full(shape[::-1], np.nan).T,
        "odd bytes": np.zeros(int(np.prod(shape)), [("a", "u1"), ("x", "f8")])["x"].reshape(shape),
    }


def test_every_way_out_is_here() -> None:
    assert len(WAYS) == 9 + 1 + 6  # with euler twice
    for kind, method, _ in WAYS.values():
        assert kind in (Rotation, Transform)
        assert "out" in inspect.signature(getattr(method, "args", [method])[0]).parameters


@each_way
@pytest.mark.parametrize("shape", [(), (12,), (3, 4), (2, 1, 6), (0,), (0, 3)])
def test_the_same_bits_come_out_in_arrays_that_lie_anyhow(way: str, shape: tuple[int, ...]) -> None:
    count = int(np.prod(shape))
    poses = POSES[0] if shape == () else Transform.of(*(part[:count].reshape(shape) for part in POSES.components))
    act, vectors = case(way, poses)
    expected = whole(act(*vectors))
    for out in places(expected.shape).values():
        result = act(*vectors, out=out)
        assert isinstance(result, tuple) or result is out
        assert same(out, expected)
        assert same(whole(result), expected)


@each_way
def test_rows_of_many_blocks_come_out_the_same(way: str) -> None:
    act, vectors = case(way, MANY)
    expected = whole(act(*vectors))
    for out in places(expected.shape).values():
        act(*vectors, out=out)
        assert same(out, expected)


@each_way
def test_out_must_fit(way: str) -> None:
    act, vectors = case(way, POSES)
    shape = whole(act(*vectors)).shape
    fixed = np.zeros(shape)
    fixed.flags.writeable = False
    wanted = f"out: expected a writable float64 array of shape {shape}, got "
    readonly = f"float64 of shape {shape}, read-only"
    for out, found in (
        (np.zeros(shape, np.float32), f"float32 of shape {shape}"), (np.zeros(shape, int), f"int64 of shape {shape}"),
        (np.zeros(shape, ">f8"), f">f8 of shape {shape}"), (np.zeros(shape, object), f"object of shape {shape}"),
        (np.zeros((*shape, 1)), f"float64 of shape {(*shape, 1)}"), (np.zeros(shape[1:]), f"float64 of shape {shape[1:]}"),
        (np.zeros((13, *shape[1:])), f"float64 of shape {(13, *shape[1:])}"), (fixed, readonly),
        ([[0.0] * 4] * 12, "a list"), (1.0, "a float"), (np.broadcast_to(0.0, shape), readonly),
    ):  # fmt: skip
        with pytest.raises(FrametoolError) as caught:
            act(*vectors, out=out)
        assert str(caught.value) == wanted + found
    one, vector = case(way, POSES[0])
    with pytest.raises(ValueInvalid, match=r"^out: expected a writable float64 array of shape \(\d"):
        one(*vector, out=np.zeros(99))


MOVING = [way for way, (_, _, width) in WAYS.items() if width]


@pytest.mark.parametrize("way", MOVING)
@pytest.mark.parametrize("shape", [(12,), (3, 4), (BLOCK + 5,)])
@pytest.mark.parametrize("one", [False, True])
def test_vectors_are_moved_where_they_are(way: str, shape: tuple[int, ...], one: bool) -> None:  # noqa: FBT001
    poses = Transform.of(*(part[: int(np.prod(shape))].reshape(shape) for part in MANY.components))
    _, (drawn,) = case(way, poses)
    act, _ = case(way, poses[0] if len(shape) == 1 and one else poses)
    expected = act(drawn)
    for place in places(drawn.shape).values():
        place[...] = drawn
        assert act(place, out=place) is place
        assert same(place, expected)


@pytest.mark.parametrize("way", MOVING)
def test_vectors_that_lie_across_the_result_are_read_before_they_are_overwritten(way: str) -> None:
    act, (drawn,) = case(way, MANY)
    rows, width = drawn.shape
    room = np.empty((rows + 7, width + 2))
    for into, out_of in (
        ((slice(7, None), slice(width)), (slice(rows), slice(width))),
        ((slice(rows), slice(width)), (slice(7, None), slice(width))),
        ((slice(rows), slice(1, width + 1)), (slice(rows), slice(width))),
        ((slice(rows), slice(width)), (slice(rows - 1, None, -1), slice(width))),
        ((slice(rows), slice(width)), (slice(rows), slice(width - 1, None, -1))),
    ):
        given, out = room[out_of], room[into]
        given[...] = drawn
        expected = act(given)
        assert same(act(given, out=out), expected)


def test_one_vector_for_all_rows_may_lie_in_the_result() -> None:
    room = np.ones((BLOCK + 5, 3))
    expected = MANY.apply([1.0, 1.0, 1.0])
    assert same(MANY.apply(room[:1], out=room), expected)
    room[...] = 1.0
    assert same(MANY.apply(room[-1], out=room), expected)


@each_way
def test_a_value_that_shares_the_callers_columns_is_read_before_they_are_overwritten(way: str) -> None:
    kind, method, width = WAYS[way]
    parts = MANY.components if kind is Transform else MANY.rotation.components
    vectors = [np.random.default_rng(3).normal(size=(len(MANY), width))] if width else []
    expected = whole(method(kind.of(*parts), *vectors))
    for start in (0, 1):
        room = np.zeros((len(MANY), max(len(parts) + 1, expected[0].size)))
        columns = room.T[start : start + len(parts)]
        columns[:] = parts
        out = room[:, : expected[0].size].reshape(expected.shape)
        if np.shares_memory(out, room):
            method(kind.of(*columns), *vectors, out=out)
            assert same(out, expected)


@pytest.mark.parametrize("way", MOVING)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_bad_vector_among_those_moved_in_place_leaves_all_as_they_were(way: str, bad: float) -> None:
    act, (vectors,) = case(way, MANY)
    vectors[-2, 1] = bad
    before = vectors.copy()
    with pytest.raises(ValueInvalid, match=rf"\[{len(vectors) - 2}\]: .* is not finite"):
        act(vectors, out=vectors)
    assert same(vectors, before)


def test_finite_vectors_whose_images_overflow_are_no_error_in_place_either() -> None:
    points = np.full((3 * BLOCK, 3), 1.7e308)
    turn = Rotation.from_rpy([0.0, 0.0, 0.7])
    expected = turn.apply(points)
    assert not np.isfinite(expected).all()
    assert same(turn.apply(points, out=points), expected)


def test_a_memmap_takes_results_too(tmp_path: Path) -> None:
    act, _ = case("Rotation as_rpy", MANY)
    out = np.memmap(tmp_path / "angles", np.float64, "w+", shape=(len(MANY), 3))
    assert act(out=out) is out
    assert same(np.fromfile(tmp_path / "angles").reshape(-1, 3), act())


@each_way
def test_a_long_result_in_an_array_of_the_caller_needs_only_blocks(way: str) -> None:
    act, vectors = case(way, Transform.random(200_000, seed=6))
    out = whole(act(*vectors))
    tracemalloc.start()
    act(*vectors, out=out)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5 * 2**20
