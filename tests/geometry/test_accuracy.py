"""Errors in eps against 60 digits, on random and hostile inputs, for floats and for arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
import oracles
import pytest
import samples
from mpmath import mpf

from frametool.geometry import euler, floats
from frametool.geometry.representations import notation
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

LIMIT = 8.0  # eps, of the rotation
RELATIVE = 4.0  # eps, of the vector part of small rotations
QUATERNIONS = samples.quaternions()
VECTORS = samples.rotation_vectors()
FEW = slice(0, None, 7)
SIZES = [pytest.param(FEW, id="few"), pytest.param(slice(None), marks=pytest.mark.large, id="all")]
each_size = pytest.mark.parametrize("part", SIZES)


def both(make: Callable[[Any], Rotation], rows: Sequence[Any]) -> Iterator[tuple[Any, Rotation]]:
    """Give every row with what it becomes alone, as floats, and among others, as an array."""
    together = make(np.array(rows))
    for row, one in zip(rows, together, strict=True):
        yield row, one
        yield row, make(row)


def rotation_error(found: Rotation, expected: Any) -> float:
    return oracles.error(oracles.matrix_of_quaternion(found.components), expected)


def nearest_floats(matrix: Any) -> list[list[float]]:
    return [[float(matrix[row, column]) for column in range(3)] for row in range(3)]


@each_size
def test_matrices_of_quaternions_are_right(part: slice) -> None:
    for row, rotation in both(Rotation.from_quaternion, QUATERNIONS[part]):
        assert oracles.error(oracles.as_matrix(rotation.as_matrix()), oracles.matrix_of_quaternion(row)) <= LIMIT


@each_size
def test_quaternions_of_matrices_are_right(part: slice) -> None:
    exact = [oracles.matrix_of_quaternion(row) for row in QUATERNIONS[part]]
    together = Rotation.from_matrix(np.array([nearest_floats(matrix) for matrix in exact]))
    for matrix, one in zip(exact, together, strict=True):
        assert rotation_error(one, matrix) <= LIMIT
        assert rotation_error(Rotation.from_matrix(nearest_floats(matrix)), matrix) <= LIMIT


@each_size
def test_rotation_vectors_are_right_both_ways(part: slice) -> None:
    for row, rotation in both(Rotation.from_rotvec, VECTORS[part]):
        assert rotation_error(rotation, oracles.matrix_of_rotvec(row)) <= LIMIT
    for row, rotation in both(Rotation.from_quaternion, QUATERNIONS[part]):
        back = oracles.matrix_of_rotvec(rotation.as_rotvec().tolist())
        assert oracles.error(back, oracles.matrix_of_quaternion(row)) <= LIMIT


@each_size
def test_axis_and_angle_are_right_both_ways(part: slice) -> None:
    for row, rotation in both(Rotation.from_quaternion, QUATERNIONS[part]):
        axis, angle = rotation.as_axis_angle()
        exact = oracles.matrix_of_turn(axis.tolist(), mpf(angle))
        assert oracles.error(exact, oracles.matrix_of_quaternion(row)) <= LIMIT
        assert rotation_error(Rotation.from_axis_angle(axis, angle), exact) <= LIMIT


@each_size
@pytest.mark.parametrize("axes", sorted(euler.AXES))
def test_euler_angles_are_right_both_ways_at_lock_and_near_it(axes: str, part: slice) -> None:
    for row, rotation in both(lambda angles: Rotation.from_euler(axes, angles), samples.euler_angles(axes)[part]):
        assert rotation_error(rotation, oracles.matrix_of_euler(axes, row)) <= LIMIT
        back = oracles.matrix_of_euler(axes, rotation.as_euler(axes).tolist())
        assert rotation_error(rotation, back) <= LIMIT


@each_size
def test_products_and_inverses_are_right(part: slice) -> None:
    rows = QUATERNIONS[part]
    for first, second in zip(rows, rows[::-1], strict=True):
        product = Rotation.from_quaternion(first) @ Rotation.from_quaternion(second).inverse()
        exact = oracles.matrix_of_quaternion(first) * oracles.matrix_of_quaternion(second).T
        assert rotation_error(product, exact) <= LIMIT


def test_a_thousand_products_stay_within_40_eps() -> None:
    steps = samples.random_quaternions(1000, seed=3)
    total, exact = Rotation.identity(), mpmath.eye(3)
    for step in steps:
        total, exact = total @ Rotation.from_quaternion(step), exact * oracles.matrix_of_quaternion(step)
    assert rotation_error(total, exact) <= 40.0


@pytest.mark.parametrize("angle", samples.TINY_ANGLES)
@pytest.mark.parametrize("axis", samples.AXES_3)
def test_small_rotations_keep_relative_accuracy(axis: tuple[float, ...], angle: float) -> None:
    vector = [part * angle for part in axis]
    length = mpmath.sqrt(sum(mpf(part) ** 2 for part in vector))
    half = [mpf(part) * mpmath.sin(length / 2) / length for part in vector]

    def relative(found: Any, expected: Any) -> float:
        gap = mpmath.sqrt(sum((mpf(float(a)) - b) ** 2 for a, b in zip(found, expected, strict=True)))
        return float(gap / mpmath.sqrt(sum(mpf(b) ** 2 for b in expected))) / oracles.EPS

    rotation = Rotation.from_rotvec(vector)
    assert relative(rotation.components[:3], half) <= RELATIVE
    assert relative(rotation.as_rotvec(), vector) <= RELATIVE
    assert relative(Rotation.from_rotvec([vector]).as_rotvec()[0], vector) <= RELATIVE
    matrix = nearest_floats(oracles.matrix_of_rotvec(vector))
    assert relative(Rotation.from_matrix(matrix).components[:3], half) <= RELATIVE
    assert relative(Transform.exp([1.0, 2.0, 3.0, *vector]).log()[3:], vector) <= RELATIVE


@pytest.mark.parametrize("size", [1e-310, 1e-160, 1e-20, 1e20, 1e160, 1e300])
def test_quaternions_of_any_size_are_normalised_right(size: float) -> None:
    rows = [[part * size for part in row] for row in samples.random_quaternions(10)]
    for row, rotation in both(lambda xyzw: Rotation.from_quaternion(xyzw, normalize=True), rows):
        assert rotation_error(rotation, oracles.matrix_of_quaternion(row)) <= LIMIT


@pytest.mark.parametrize("noise", [1e-12, 1e-6, 1e-3, 0.03])
def test_noisy_matrices_become_the_optimal_rotation(noise: float) -> None:
    exact = Rotation.random(12, seed=4).as_matrix()
    noisy = exact + noise * np.random.default_rng(5).uniform(-1.0, 1.0, exact.shape)
    for row, one in zip(noisy, Rotation.from_matrix(noisy, normalize=True), strict=True):
        best = oracles.polar(row.tolist())
        assert rotation_error(one, best) <= LIMIT
        assert rotation_error(Rotation.from_matrix(row, normalize=True), best) <= LIMIT


FRACTIONS = [0.0, 1e-9, 0.3, 0.5, 0.99, 1.0, 1.5]


def slerp_oracle(start: Sequence[float], end: Sequence[float], fraction: float) -> Any:
    """Turn by a part of the angle between two quaternions, about the axis of end * start^-1."""
    relative = oracles.matrix_of_quaternion(end) * oracles.matrix_of_quaternion(start).T
    axial = [(relative[i, j] - relative[j, i]) / 2 for i, j in ((2, 1), (0, 2), (1, 0))]
    sine = mpmath.sqrt(sum(part * part for part in axial))
    angle = mpmath.atan2(sine, (relative[0, 0] + relative[1, 1] + relative[2, 2] - 1) / 2)
    k = oracles.cross_matrix(*(part / sine for part in axial))
    part = angle * mpf(fraction)
    turn = mpmath.eye(3) + mpmath.sin(part) * k + (1 - mpmath.cos(part)) * k * k
    return turn * oracles.matrix_of_quaternion(start)


@pytest.mark.parametrize("arc", [1e-15, 1e-9, 1e-8, 1e-3, 0.5, 2.0, 3.0])
def test_slerp_is_right_on_small_and_large_arcs(arc: float) -> None:
    for start in samples.random_quaternions(4, seed=7):
        end = (Rotation.from_axis_angle([1.0, 2.0, -2.0], arc) @ Rotation.from_quaternion(start)).as_quaternion()
        ours = Rotation.from_quaternion(start).slerp(Rotation.from_quaternion(end), FRACTIONS)
        for fraction, found in zip(FRACTIONS, ours, strict=True):
            assert rotation_error(found, slerp_oracle(start, end.tolist(), fraction)) <= LIMIT


@each_size
def test_exp_and_log_of_twists_are_right(part: slice) -> None:
    linear = np.random.default_rng(8).normal(size=(len(VECTORS), 3)).tolist()
    twists = [[*v, *w] for v, w in zip(linear, VECTORS, strict=True)][part]
    for twist, together in zip(twists, Transform.exp(twists), strict=True):
        exact = oracles.exponential(twist)
        for found in (together, Transform.exp(twist)):
            assert rotation_error(found.rotation, exact[:3, :3]) <= LIMIT
            assert shift_error(found.components[:3], exact) <= LIMIT
            assert shift_error(found.components[:3], oracles.exponential(found.log().tolist())) <= LIMIT


def shift_error(found: Sequence[float], exact: Any) -> float:
    """Give the relative error in eps of a translation."""
    gap = mpmath.sqrt(sum((mpf(part) - exact[row, 3]) ** 2 for row, part in enumerate(found)))
    return float(gap / mpmath.sqrt(sum(exact[row, 3] ** 2 for row in range(3)))) / oracles.EPS


@pytest.mark.parametrize("angle", [30.0, -45.0, 1e-5, 359.999, 12345.678, -719.5])
def test_degrees_are_as_good_as_the_radians_nearest_to_them(angle: float) -> None:
    exact = oracles.matrix_of_turn((0.0, 0.0, 1.0), mpf(angle) * mpmath.pi / 180)
    found = Rotation.of(*notation("rpy_deg").to_quaternion((0.0, 0.0, angle), floats))
    assert rotation_error(found, exact) <= 2.0


def test_scipys_loss_near_lock_is_not_ours() -> None:
    angles = (1.0, math.pi / 2 - 9e-8, -0.7)
    rotation = Rotation.from_euler("rzyx", angles)
    assert Rotation.from_euler("rzyx", rotation.as_euler("rzyx")).distance(rotation) <= LIMIT * oracles.EPS
