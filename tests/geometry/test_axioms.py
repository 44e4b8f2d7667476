"""The laws of the groups of rotations and rigid transforms, on hostile samples, floats and arrays alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import samples
from hypothesis import given, settings
from hypothesis import strategies as st

from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from frametool.geometry import Array

QUATERNIONS = samples.quaternions()
SHIFTS = np.random.default_rng(2).normal(size=(len(QUATERNIONS), 3))
POSES = Transform.from_arrays(SHIFTS, QUATERNIONS)
OTHERS, THIRDS = POSES[::-1], POSES[np.random.default_rng(3).permutation(len(QUATERNIONS))]
ANGLE, DISTANCE = 4e-15, 2e-14

# no deadline: a busy machine is no broken law; derandomized, nothing stored: every run tries the same
settings.register_profile("laws", deadline=None, derandomize=True, database=None)
settings.load_profile("laws")
unit = st.floats(-1.0, 1.0)
quaternion = st.tuples(unit, unit, unit, unit).filter(lambda row: sum(part * part for part in row) > 0.1)
vector = st.tuples(*[st.floats(-1e3, 1e3)] * 3)
rotations = quaternion.map(lambda row: Rotation.from_quaternion(row, normalize=True))
transforms = st.tuples(rotations, vector).map(lambda parts: Transform(*parts))
twists = st.tuples(*[st.floats(-5.0, 5.0)] * 3, *[st.floats(-1.8, 1.8)] * 3)


def same(a: Transform, b: Transform) -> bool:
    return bool(np.all(a.is_close(b, angle=ANGLE, distance=DISTANCE)))


def test_a_transform_and_its_inverse_cancel() -> None:
    assert same(POSES @ POSES.inverse(), Transform.identity())
    assert same(POSES.inverse() @ POSES, Transform.identity())


def test_the_identity_changes_nothing() -> None:
    assert same(POSES @ Transform.identity(), POSES)
    assert same(Transform.identity() @ POSES, POSES)


def test_products_associate() -> None:
    assert same((POSES @ OTHERS) @ THIRDS, POSES @ (OTHERS @ THIRDS))


def test_the_inverse_of_a_product_is_the_product_of_inverses_reversed() -> None:
    assert same((POSES @ OTHERS).inverse(), OTHERS.inverse() @ POSES.inverse())


def test_relative_is_inverse_times_other() -> None:
    assert same(POSES.relative(OTHERS), POSES.inverse() @ OTHERS)


def test_the_homogeneous_matrix_does_what_apply_does() -> None:
    moved = np.einsum("nij,nj->ni", POSES.as_matrix(), np.c_[SHIFTS, np.ones(len(SHIFTS))])
    assert np.allclose(POSES.apply(SHIFTS), moved[:, :3], rtol=0.0, atol=1e-14)


def test_applying_a_product_is_applying_twice() -> None:
    assert np.allclose((POSES @ OTHERS).apply(SHIFTS), POSES.apply(OTHERS.apply(SHIFTS)), rtol=0.0, atol=2e-14)


def test_the_power_of_a_wrench_on_a_twist_is_the_same_seen_from_anywhere() -> None:
    twists, wrenches = POSES.log(), OTHERS.log()
    here, there = np.sum(twists * wrenches, axis=1), np.sum(POSES.apply_twist(twists) * POSES.apply_wrench(wrenches), axis=1)
    assert np.allclose(here, there, rtol=0.0, atol=1e-12)
    assert np.allclose(POSES[0].apply_twist(twists)[0], POSES.apply_twist(twists)[0], rtol=0.0, atol=0.0)


def test_q_and_minus_q_are_one_rotation() -> None:
    minus = Rotation.of(*(-part for part in POSES.rotation.components))
    assert np.all(minus.is_close(POSES.rotation, angle=0.0))
    assert np.array_equal(minus.as_quaternion(), POSES.rotation.as_quaternion())


def test_floats_and_arrays_give_the_same_numbers() -> None:
    alone = [(a @ b.inverse()).components for a, b in zip(POSES, OTHERS, strict=True)]
    assert np.array_equal(np.array(alone).T, np.stack((POSES @ OTHERS.inverse()).components))


def test_rotations_keep_lengths() -> None:
    lengths = np.linalg.norm(POSES.apply_vector(SHIFTS), axis=1)
    assert np.allclose(lengths, np.linalg.norm(SHIFTS, axis=1), rtol=1e-15, atol=0.0)


@given(transforms, transforms)
def test_any_two_transforms_undo_each_other(a: Transform, b: Transform) -> None:
    assert (a @ b @ b.inverse()).is_close(a, angle=1e-14, distance=1e-11)


@given(twists)
def test_log_undoes_exp(twist: tuple[float, ...]) -> None:
    assert np.allclose(Transform.exp(twist).log(), twist, rtol=0.0, atol=5e-14)


@given(rotations, vector)
def test_any_rotation_keeps_the_angle_between_vectors(rotation: Rotation, point: tuple[float, ...]) -> None:
    turned = rotation.apply(point)
    assert turned @ turned == pytest.approx(sum(part * part for part in point), rel=1e-14)


@given(rotations, rotations, st.floats(0.0, 1.0))
def test_slerp_divides_the_angle(a: Rotation, b: Rotation, fraction: float) -> None:
    assert a.distance(a.slerp(b, fraction)) == pytest.approx(fraction * a.distance(b), abs=2e-15)


@given(rotations, rotations)
def test_distance_is_symmetric_and_the_angle_of_the_relative_rotation(a: Rotation, b: Rotation) -> None:
    assert a.distance(b) == b.distance(a)
    assert a.distance(b) == pytest.approx((a.inverse() @ b).angle(), abs=4e-15)


@given(vector.filter(any), vector.filter(any))
def test_between_takes_any_direction_to_any_other(start: tuple[float, ...], end: tuple[float, ...]) -> None:
    assert np.allclose(Rotation.between(start, end).apply(direction(start)), direction(end), rtol=0.0, atol=2e-15)


def direction(vector: tuple[float, ...]) -> Array:
    scaled = np.array(vector) / max(map(abs, vector))
    unit: Array = scaled / np.linalg.norm(scaled)
    return unit
