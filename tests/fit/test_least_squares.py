"""Normal equations in any units, and the rotation between vectors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import samples

from frametool.fit.least_squares import Undetermined, align_vectors, inverse, solve_normal
from frametool.geometry.transform import Rotation

if TYPE_CHECKING:
    from frametool.geometry import Array

DRAWN = np.random.default_rng(4)
EPS = 2.0**-52
SIZES = [1, 2, 3, 6, 12, 24, 25, 26, 60, 131]


def positive(size: int) -> Array:
    """Draw a symmetric positive definite matrix whose rows differ in size by up to 1e12."""
    drawn = DRAWN.normal(size=(size, size + 3))
    units = 10.0 ** DRAWN.uniform(-6, 6, size)
    return drawn @ drawn.T * np.outer(units, units)


@pytest.mark.parametrize("size", SIZES)
def test_an_inverse_undoes_its_matrix_however_its_units_differ(size: int) -> None:
    matrix = positive(size)
    found = inverse(matrix)
    units = np.sqrt(np.diagonal(matrix))
    assert np.allclose((matrix @ found) * units / units[:, None], np.eye(size), rtol=0, atol=1e-6)
    assert np.array_equal(found, found.T)


@pytest.mark.parametrize("size", SIZES[:-4])
def test_what_is_solved_for_is_a_solution(size: int) -> None:
    matrix, right = positive(size), DRAWN.normal(size=(size, 3))
    found = solve_normal(matrix, right)
    assert np.all(abs(matrix @ found - right) <= 20 * size * EPS * (abs(matrix) @ abs(found) + abs(right)))


@pytest.mark.parametrize("matrix", [[[0.0]], [[1.0, 2.0], [2.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]], [[np.nan]]])
def test_what_has_no_inverse_is_an_error(matrix: list[list[float]]) -> None:
    with pytest.raises(Undetermined):
        inverse(np.array(matrix))


@pytest.mark.parametrize("xyzw", samples.quaternions(20))
def test_a_rotation_between_vectors_is_found(xyzw: list[float]) -> None:
    turn, source = Rotation.of(*xyzw), DRAWN.normal(size=(9, 3))
    assert align_vectors(source, turn.apply(source)).is_close(turn, angle=1e-14)
    assert align_vectors(source, -turn.apply(source)).as_matrix().shape == (3, 3)  # a mirror image: a rotation all the same


def test_vectors_that_say_nothing_of_a_rotation_have_one() -> None:
    assert np.isfinite(align_vectors(np.zeros((3, 3)), np.ones((3, 3))).as_quaternion()).all()
