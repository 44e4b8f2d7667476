"""The public face of Rotation and Transform: shapes, kinds of input, errors, warnings, frozen values."""

from __future__ import annotations

import math
import re
import subprocess
import sys
import tracemalloc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.errors import FrametoolWarning, ValueInvalid
from frametool.geometry import arrays, euler, floats
from frametool.geometry.conventions import AXES, axes_change
from frametool.geometry.representations import ROTATIONS, notation
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable

WAYS: dict[str, tuple[Callable[[Rotation], Any], Callable[[Any], Rotation]]] = {
    "quaternion": (Rotation.as_quaternion, Rotation.from_quaternion),
    "matrix": (Rotation.as_matrix, Rotation.from_matrix),
    "rotvec": (Rotation.as_rotvec, Rotation.from_rotvec),
    "axis_angle": (Rotation.as_axis_angle, lambda both: Rotation.from_axis_angle(*both)),
    "euler": (lambda rotation: rotation.as_euler("rzxz"), lambda angles: Rotation.from_euler("rzxz", angles)),
    "rpy": (Rotation.as_rpy, Rotation.from_rpy),
    "mrp": (lambda rotation: rotation.as_notation("mrp"), lambda three: Rotation.from_notation("mrp", three)),
    "six_d": (lambda rotation: rotation.as_notation("six_d"), lambda six: Rotation.from_notation("six_d", six)),
}
each_way = pytest.mark.parametrize("way", WAYS)
SHAPES = [(), (1,), (5,), (2, 3), (0,), (2, 0)]


def batch(shape: tuple[int, ...]) -> Rotation:
    """Give random rotations of a batch shape."""
    xyzw = np.random.default_rng(1).normal(size=(*shape, 4))
    return Rotation.from_quaternion(xyzw, normalize=True)


@each_way
@pytest.mark.parametrize("shape", SHAPES)
def test_leading_axes_pass_through_every_way_and_back(way: str, shape: tuple[int, ...]) -> None:
    there, back = WAYS[way]
    rotation = batch(shape)
    again = back(there(rotation))
    assert again.shape == shape
    assert np.all(again.is_close(rotation, angle=1e-14))


@each_way
def test_float32_strided_and_nested_lists_read_as_float64_does(way: str) -> None:
    there, back = WAYS[way]
    exact = there(batch((6,)))
    parts = exact if isinstance(exact, tuple) else (exact,)

    def reread(change: Callable[[Any], Any]) -> Rotation:
        changed = tuple(change(part) for part in parts)
        return back(changed if way == "axis_angle" else changed[0])

    plain = reread(lambda part: part)
    assert np.all(reread(lambda part: np.asarray(part, dtype=np.float32)).is_close(plain, angle=1e-6))
    assert np.all(reread(lambda part: np.repeat(part, 2, axis=0)[::2]).is_close(plain, angle=0.0))
    assert np.all(reread(lambda part: part.tolist()).is_close(plain, angle=0.0))


@each_way
def test_nothing_given_is_changed_or_kept(way: str) -> None:
    there, back = WAYS[way]
    given = there(batch((4,)))
    parts = given if isinstance(given, tuple) else (given,)
    before = [part.copy() for part in parts]
    rotation = back(given)
    kept = rotation.as_quaternion()
    assert all(np.array_equal(part, old) for part, old in zip(parts, before, strict=True))
    for part in parts:
        part[...] = 0.1
    assert np.array_equal(rotation.as_quaternion(), kept)


def test_integers_are_numbers() -> None:
    assert Rotation.from_quaternion(np.array([[0, 0, 0, 1], [1, 0, 0, 0]])).as_matrix().dtype == np.float64
    assert Rotation.from_rotvec([0, 0, 0]).is_close(Rotation.identity(), angle=0.0)


@each_way
def test_one_item_and_many_give_the_same_numbers(way: str) -> None:
    there, _ = WAYS[way]
    rotation = batch((7,))
    for index, one in enumerate(rotation):
        alone, among = there(one), there(rotation)
        pairs = zip(alone, among, strict=True) if isinstance(among, tuple) else [(alone, among)]
        assert all(np.allclose(np.asarray(a), np.asarray(b)[index], rtol=0.0, atol=2e-15) for a, b in pairs)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([-1, 0, 1, 0], r"quaternion -1 0 1 0 has norm 1.41421; a rotation needs norm 1"),
        ([0, 0, 0, 0], r"quaternion 0 0 0 0 has no direction; give a non-zero one"),
        ([0, math.nan, 0, 1], r"xyzw: 0 nan 0 1 is not finite"),
        ([1, 2], r"xyzw: expected shape \(\.\.\., 4\), got \(2,\)"),
        ([[0, 0, 0, 1], [0, 0, 0, 2], [0, 0, 0, 3]], r"xyzw\[1\]: quaternion 0 0 0 2 has norm 2.*\(2 such rows\)"),
        ([[[0, 0, 0, 1], [0, math.inf, 0, 1]]], r"xyzw\[0, 1\]: quaternion 0 inf 0 1 is not finite"),
        ([[0, 0, 0, 1], [0, 0, 1]], r"xyzw: the rows differ in length"),
        (["a", "b", "c", "d"], r"xyzw: expected real numbers"),
        ([1j, 0, 0, 0], r"xyzw: expected real numbers"),
        (np.ma.masked_array([0.0, 0.0, 0.0, 1.0], [False, False, True, False]), r"xyzw: some of its numbers are masked"),
    ],
)
def test_bad_quaternions_are_refused_by_name_and_place(given: Any, message: str) -> None:
    with pytest.raises(ValueInvalid, match=message):
        Rotation.from_quaternion(given)


@pytest.mark.parametrize("given", [[0, 0, 0, 0], [[0, 0, 0, 1], [0, 0, 0, 0]], [[0, 0, 0, 1], [0, math.nan, 0, 0]]])
def test_normalising_helps_neither_zero_nor_nan(given: Any) -> None:
    with pytest.raises(ValueInvalid):
        Rotation.from_quaternion(given, normalize=True)


@pytest.mark.parametrize("one", [True, False])
@pytest.mark.parametrize(
    ("entries", "message"),
    [
        (np.diag([1.0, 1.0, -1.0]), r"left-handed \(mirrored\)"),
        (2.0 * np.eye(3), r"matrix is 2 times a rotation: a similarity, not a pose \(--scale of compose, invert and apply takes it\)$"),
        (np.diag([1.0, 1.0, 2.0]), r"orthonormal only to 3 \(sheared or scaled unevenly\)$"),
        (np.diag([1.0, 1.0, 1.1]), r"orthonormal only to 0.21 \(normalize it with --normalize\)$"),
        (np.zeros((3, 3)), r"matrix 0 0 0, 0 0 0, 0 0 0 is singular"),
        (np.full((3, 3), math.nan), r"not finite"),
    ],
)
def test_bad_matrices_are_refused_alone_and_among_others(entries: Any, message: str, one: bool) -> None:  # noqa: FBT001
    with pytest.raises(ValueInvalid, match=message):
        Rotation.from_matrix(entries if one else np.stack([np.eye(3), entries]))


@pytest.mark.parametrize("entries", [np.zeros((3, 3)), np.ones((3, 3)), np.diag([1.0, 1.0, -1.0])])
def test_normalising_helps_neither_singular_nor_mirrored_matrices(entries: Any) -> None:
    for given in (entries, entries[None]):
        with pytest.raises(ValueInvalid, match=r"singular|mirrored"):
            Rotation.from_matrix(given, normalize=True)


@pytest.mark.parametrize("off", [1e-7, 1e-4])
def test_what_is_nearly_a_rotation_is_used_with_a_warning_beyond_1e_6(off: float) -> None:
    quaternions = np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0 + off], [0.0, 1.0 + off, 0.0, 0.0]])
    matrices = np.eye(3)[None] * (1.0 + off)
    reads: list[Callable[[], Rotation]] = [
        lambda: Rotation.from_quaternion(quaternions), lambda: Rotation.from_quaternion(quaternions[1]),
        lambda: Rotation.from_matrix(matrices), lambda: Rotation.from_matrix(matrices[0]),
    ]  # fmt: skip
    for read in reads:
        if off > 1e-6:
            with pytest.warns(FrametoolWarning) as caught:
                rotation = read()
            assert len(caught) == 1
        else:
            rotation = read()
        assert np.allclose(np.linalg.norm(rotation.as_quaternion(), axis=-1), 1.0, rtol=0.0, atol=1e-15)


def test_what_is_unit_to_4_eps_keeps_its_bits_and_printed_numbers_read_back() -> None:
    once = Rotation.random(2000, seed=3).as_quaternion()
    assert np.array_equal(Rotation.from_quaternion(once).as_quaternion(), once)
    products = (Rotation.from_quaternion(once) @ Rotation.from_quaternion(once[::-1])).as_quaternion()
    assert np.array_equal(Rotation.from_quaternion(products).as_quaternion(), products)
    for row in products[:200].tolist():
        assert Rotation.from_quaternion(row).as_quaternion().tolist() == row


def test_the_sign_that_leaves_is_canonical() -> None:
    rows: Any = [[0, 0, 0, -1], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [0.6, 0, 0, -0.8]]
    expected = [[0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [-0.6, 0, 0, 0.8]]
    assert Rotation.from_quaternion(rows).as_quaternion().tolist() == expected
    assert [Rotation.from_quaternion(row).as_quaternion().tolist() for row in rows] == expected


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, math.nan, 0.0]]), r"rotvec\[1\]: rotation vector 0 nan 0 is not finite"),
        (lambda: Rotation.from_rotvec([[0.0] * 3, [1e200, 0.0, 0.0]]), r"rotvec\[1\]: rotation vector 1e\+200 0 0"),
        (lambda: Rotation.from_rotvec([1e200, 0, 0]), r"rotation vector 1e\+200 0 0"),
        (lambda: Rotation.from_axis_angle([0, 0, 0], 1.0), r"axis 0 0 0 has no direction"),
        (lambda: Rotation.from_axis_angle([[1, 0, 0], [0, 0, 0]], 1.0), r"axis\[1\]: axis 0 0 0 has no direction"),
        (lambda: Rotation.from_euler("rzyx", [[0.0] * 3, [1.0, math.inf, 3.0]]), r"angles\[1\]: euler 1 inf 3 is not finite"),
        (lambda: Rotation.from_euler("zyx", [1, 2, 3]), r"unknown Euler axes 'zyx'; did you mean"),
        (lambda: Rotation.from_notation("six_d", [1, 0, 0, 2, 0, 0]), r"parallel"),
        (lambda: Rotation.from_notation("mrp", [math.nan, 0, 0]), r"mrp: nan 0 0 is not finite"),
        (lambda: Rotation.between([0, 0, 0], [1, 0, 0]), r"no direction"),
        (lambda: Rotation.identity().apply([[0.0] * 3, [1.0, 2.0, math.nan]]), r"vectors\[1\]: 1 2 nan is not finite"),
        (lambda: batch((2,)).apply([[0.0] * 3, [1.0, 2.0, math.nan]]), r"vectors\[1\]: 1 2 nan is not finite"),
        (lambda: Rotation.identity().apply([[1, 2]]), r"vectors: expected shape \(\.\.\., 3\), got \(1, 2\)"),
        (lambda: batch((2,)) @ batch((3,)), r"batch shapes \(2,\) and \(3,\) do not broadcast"),
        (lambda: Transform.from_matrix(np.ones((4, 4))), r"last row 1 1 1 1; expected 0 0 0 1"),
        (lambda: Transform.from_arrays(np.zeros((2, 3)), np.eye(4)[3:].repeat(3, 0)), r"do not broadcast"),
        (lambda: Transform.from_arrays([[0.0, 0.0, math.inf]], [[0, 0, 0, 1]]), r"xyz\[0\]: 0 0 inf is not finite"),
        (lambda: Rotation.identity().distance(1), r"expected a Rotation, got int"),  # type: ignore[arg-type]
        (lambda: Transform.identity().relative(Rotation.identity()), r"expected a Transform"),  # type: ignore[arg-type]
        (lambda: Transform([1, 2, 3], Rotation.identity()), r"got list; Transform\(rotation, xyz\) takes a Rotation first; from_parts\(xyz=.., rpy=..\) says which is which"),  # type: ignore[arg-type]
        (lambda: Transform.from_parts(Rotation.identity()), r"xyz: the position comes first, the rotation by its name"),  # type: ignore[arg-type]
        (lambda: Transform.from_parts([1, 2, 3], rotation=[0, 0, 0, 1]), r"rotation: expected a Rotation, got list"),
        (lambda: Transform.from_parts([1, 2, 3], rpy=[0, 0, 1], xyzw=[0, 0, 0, 1]), r"takes one rotation, not rpy and xyzw"),
        (lambda: Transform.from_parts(quaternion=[0, 0, 0, 1]), r"does not say its order; give xyzw=\[..\] or wxyz=\[..\]"),
        (lambda: Transform.from_parts(euler=[0, 0, 1]), r"euler needs its axes: write euler:rzyx"),
        (lambda: Transform.from_parts(position=[0, 0, 1]), r"unknown representation 'position'"),
        (lambda: Transform.from_parts([1, 2]), r"xyz: expected shape \(\.\.\., 3\), got \(2,\)"),
        (lambda: Transform.from_parts(rpy_deg=[[0.0] * 3, [0.0, 0.0, math.nan]]), r"rpy_deg\[1\]: rpy 0 0 nan is not finite"),
        (lambda: axes_change("opticl", "ned"), r"unknown axes 'opticl'; did you mean 'optical'"),
    ],
)
def test_bad_input_is_named(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueInvalid, match=message):
        call()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", [*(each for each in ROTATIONS if each not in ("quaternion", "euler")), "rpy_deg", "euler:rzyx", "euler_deg:sxyz"])
def test_a_transform_is_made_of_a_position_and_any_notation(name: str, shape: tuple[int, ...]) -> None:
    turn, xyz = batch(shape), np.random.default_rng(2).normal(size=(*shape, 3))
    form = notation(name)
    numbers = np.stack([np.asarray(each) for each in form.from_quaternion(*turn.components, arrays if shape else floats)], axis=-1)
    given = numbers.reshape(*shape, 3, 3) if name == "matrix" else numbers
    rotation: dict[str, Any] = {name: given}
    made = Transform.from_parts(xyz, **rotation)
    assert made.shape == shape
    assert np.all(made.is_close(Transform(turn, xyz), angle=1e-12, distance=0.0))


def test_what_a_transform_shows_makes_it_again() -> None:
    one = Transform.from_parts(xyz=[1, 2, 3], rpy_deg=[10, 20, 30])
    assert eval(repr(one), {"Transform": Transform}).is_close(one, angle=0.0, distance=0.0)  # noqa: S307
    assert Transform.from_parts().is_close(Transform.identity(), angle=0.0, distance=0.0)


def test_only_values_of_one_kind_compose() -> None:
    for bad in (Transform.identity(), np.eye(3), 2.0):
        with pytest.raises(TypeError):
            Rotation.identity() @ bad  # type: ignore[operator]
        with pytest.raises(TypeError):
            bad @ Rotation.identity()  # type: ignore[operator]


def test_values_are_frozen() -> None:
    with pytest.raises(AttributeError):
        Rotation.identity().components = (0.0, 0.0, 0.0, 1.0)  # type: ignore[misc]
    with pytest.raises(AttributeError):
        Transform.identity().name = "x"  # type: ignore[attr-defined]


def test_batches_broadcast_like_numpy() -> None:
    column, row = batch((3, 1)), batch((4,))
    assert (column @ row).shape == (3, 4)
    assert column.apply(np.zeros((4, 3))).shape == (3, 4, 3)
    assert (column @ row)[1, 2].is_close(column[1, 0] @ row[2], angle=1e-15)
    assert Transform(row, [1.0, 2.0, 3.0]).xyz.tolist() == [[1.0, 2.0, 3.0]] * 4
    assert row.slerp(row.inverse(), np.zeros((3, 1))).shape == (3, 4)
    assert len(row) == len(list(row)) == 4
    assert row[:2].shape == (2,)


def test_one_rotation_has_neither_length_nor_elements() -> None:
    with pytest.raises(TypeError):
        len(Rotation.identity())
    with pytest.raises(TypeError):
        Rotation.identity()[0]


def test_interpolation_ends_are_the_ends_to_the_bit() -> None:
    start, end = Transform.random(50, seed=1), Transform.random(50, seed=2)
    for fraction, whole in ((0.0, start), (1.0, end)):
        assert all(
            np.array_equal(a, b)
            for a, b in zip(start.interpolate(end, fraction).components, whole.components, strict=True)
        )
        assert start[0].interpolate(end[0], fraction).components == whole[0].components


@pytest.mark.parametrize("axes", sorted(euler.AXES))
def test_gimbal_lock_is_data_and_zeroes_the_third_angle(axes: str) -> None:
    middle = [0.0, math.pi] if axes[1] == axes[3] else [-math.pi / 2, math.pi / 2]
    rotation = Rotation.from_euler(axes, [[0.5, angle, 0.3] for angle in (*middle, 0.7)])
    assert rotation.gimbal_lock(axes).tolist() == [True, True, False]
    assert rotation[0].gimbal_lock(axes) is True
    assert rotation.as_euler(axes)[:2, 2].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("axes", sorted(euler.AXES))
def test_euler_angles_stay_in_their_ranges(axes: str) -> None:
    first, middle, third = Rotation.random(500, seed=4).as_euler(axes).T
    low, high = (0.0, math.pi) if axes[1] == axes[3] else (-math.pi / 2, math.pi / 2)
    assert np.all((middle >= low) & (middle <= high))
    assert np.all((np.abs(first) <= math.pi) & (np.abs(third) <= math.pi))


def test_between_turns_one_direction_into_the_other_even_when_opposite() -> None:
    start = np.random.default_rng(5).normal(size=(200, 3))
    for end in (start[::-1], -start, start, -start + 1e-9, 1e200 * start[::-1]):
        turned = Rotation.between(start, end).apply(start / np.linalg.norm(start, axis=1, keepdims=True))
        largest = np.abs(end).max(axis=1, keepdims=True)
        wanted = end / largest / np.linalg.norm(end / largest, axis=1, keepdims=True)
        assert np.allclose(turned, wanted, rtol=0.0, atol=2e-15)
    for axis in np.eye(3):
        assert np.array_equal(Rotation.between(axis, -axis).apply(axis), -axis)


def test_the_mean_is_the_middle_and_heeds_weights() -> None:
    turns = Rotation.from_rpy([[0.0, 0.0, 0.1], [0.0, 0.0, 0.3]])
    assert turns.mean().is_close(Rotation.from_rpy([0.0, 0.0, 0.2]), angle=1e-14)
    assert turns.mean([1.0, 0.0]).is_close(turns[0], angle=1e-14)
    flipped = Rotation.of(*(np.stack([part[0], -part[1]]) for part in turns.components))
    assert flipped.mean().is_close(turns.mean(), angle=1e-14)
    poses = Transform(turns, [[0.0, 0.0, 0.0], [2.0, 4.0, 6.0]])
    assert poses.mean().xyz.tolist() == [1.0, 2.0, 3.0]
    assert poses.mean([3.0, 1.0]).xyz.tolist() == [0.5, 1.0, 1.5]


@pytest.mark.parametrize("weights", [[1.0], [-1.0, 2.0], [0.0, 0.0], [math.nan, 1.0]])
def test_weights_must_be_weights(weights: list[float]) -> None:
    with pytest.raises(ValueInvalid, match="weights"):
        batch((2,)).mean(weights)


def test_nothing_has_no_mean() -> None:
    with pytest.raises(ValueInvalid, match="mean of no rotations"):
        batch((0,)).mean()


@pytest.mark.parametrize("normalize", [False, True])
@pytest.mark.parametrize(
    ("stretch", "message"),
    [
        *((each, r"sheared or scaled unevenly\)$") for each in (
            (1.0, 1.0, 1e-9), (1.0, 1.0, 1e-3), (1.2, 1.0, 1.0), (0.89, 0.95, 1.1))),
        *(((s, s, s), f"matrix is {re.escape(f'{s:g}')} times a rotation: a similarity, not a pose") for s in (
            1e-300, 1e-3, 0.5, 0.9, 0.95, 0.998, 1.002, 1.05, 2.0, 1000.0, 1e200, 1e307)),
        ((-1.0, 1.0, 1.0), r"left-handed \(mirrored\)"), ((2.0, 2.0, -2.0), r"left-handed \(mirrored\)"),
    ],
)  # fmt: skip
def test_what_stretches_is_refused_by_how_much_and_normalised_by_nothing(
    stretch: tuple[float, ...], message: str, normalize: bool  # noqa: FBT001
) -> None:
    entries = batch(()).as_matrix() * np.array(stretch)
    for given in (entries, entries[None]):
        with pytest.raises(ValueInvalid, match=message):
            Rotation.from_matrix(given, normalize=normalize)


@pytest.mark.parametrize("stretch", [(0.9, 1.0, 1.1), (1.1, 1.1, 0.9), (0.95, 0.95, 0.96), (1.0004, 1.0004, 1.0004)])
def test_what_stretches_by_a_tenth_is_normalised(stretch: tuple[float, ...]) -> None:
    turned = batch(())
    entries = turned.as_matrix() * np.array(stretch)
    for given in (entries, entries[None]):
        assert np.all(Rotation.from_matrix(given, normalize=True).is_close(turned, angle=1e-15))


def test_one_axis_takes_many_angles_and_one_direction_many_others() -> None:
    turns = Rotation.from_axis_angle([0.0, 0.0, 2.0], [0.1, 0.2])
    assert np.allclose(turns.as_rpy(), [[0.0, 0.0, 0.1], [0.0, 0.0, 0.2]], rtol=0.0, atol=1e-16)
    ends = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert np.allclose(Rotation.between([1.0, 0.0, 0.0], ends).apply([1.0, 0.0, 0.0]), ends, rtol=0.0, atol=1e-15)


def test_axes_of_the_field_take_the_forward_direction_where_it_is() -> None:
    forward = {"flu": [1, 0, 0], "frd": [1, 0, 0], "optical": [0, 0, 1], "opengl": [0, 0, -1]}
    up = {"flu": [0, 0, 1], "frd": [0, 0, -1], "optical": [0, -1, 0], "opengl": [0, 1, 0], "ned": [0, 0, -1]}
    for source, direction in forward.items():
        assert axes_change("flu", source).apply(direction).tolist() == [1.0, 0.0, 0.0]
    for source, direction in up.items():
        assert axes_change("enu", source).apply(direction).tolist() == [0.0, 0.0, 1.0]
    assert axes_change("enu", "ned").apply([1.0, 2.0, 3.0]).tolist() == [2.0, 1.0, -3.0]
    assert axes_change("opengl", "optical").apply([1.0, 2.0, 3.0]).tolist() == [1.0, -2.0, -3.0]
    assert all(summary for _, summary in AXES.values())


def test_seeds_repeat() -> None:
    assert np.array_equal(Rotation.random(3, seed=5).as_quaternion(), Rotation.random(3, seed=5).as_quaternion())
    assert Transform.random(seed=5).shape == ()


def test_conversions_of_long_arrays_need_little_beyond_the_result() -> None:
    rotation = Rotation.random(200_000, seed=6)
    xyzw, matrices = rotation.as_quaternion(), rotation.as_matrix()
    calls: list[Callable[[], object]] = [
        rotation.as_quaternion, rotation.as_rpy, rotation.as_rotvec, rotation.as_matrix, lambda: rotation @ rotation,
        lambda: Rotation.from_quaternion(xyzw), lambda: Rotation.from_matrix(matrices),
        lambda: Rotation.from_rotvec(xyzw[:, :3]), lambda: rotation.apply(xyzw[:, :3]),
    ]  # fmt: skip
    for call in calls:
        tracemalloc.start()
        result = call()
        kept, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert result is not None
        assert peak - kept < 4 * 2**20


def test_one_item_loads_no_numpy() -> None:
    program = (
        "import sys; from frametool.geometry.transform import Rotation, Transform\n"
        "from frametool.geometry.conventions import axes_change\n"
        "a = Transform(Rotation.from_rpy([0.1, 0.2, 0.3]), [1, 2, 3]); b = a @ a.inverse(); a.interpolate(b, 0.5)\n"
        "a.distance(b), a.is_close(b), a.relative(b), repr(a), a.rotation.slerp(b.rotation, 0.5), a.rotation.angle()\n"
        "sys.exit(bool({'numpy', 'dataclasses', 'decimal', 'yaml', 'rich', 'click'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_singular_values_of_more_than_a_thousandth_apart_are_no_multiple() -> None:
    """Whichever way they are turned: an entry of the Gram matrix may be off by less than the values are."""
    turns = batch((60,)).as_matrix()
    entries = turns[:30] @ np.diag([1.0025, 1.0016, 0.9989]) @ turns[30:]
    nearest = Rotation.from_matrix(entries, normalize=True)
    assert np.max(nearest.distance(Rotation.from_matrix(turns[:30] @ turns[30:]))) < 1e-2
    for each in entries:
        with pytest.raises(ValueInvalid, match="normalize it"):
            Rotation.from_matrix(each)
