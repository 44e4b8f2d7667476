"""Multiples of 90 degrees are exact in every representation, as products, and as moved points."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import pytest
import samples

from frametool.geometry import arrays, euler, floats, quaternion
from frametool.geometry.representations import ROTATIONS, notation

if TYPE_CHECKING:
    from frametool.geometry import Quaternion, Vector

EXACT = {0.0, 0.5, samples.SQRT_HALF, 1.0}
TURNS = list(itertools.product((-270.0, -90.0, 0.0, 90.0, 180.0, 360.0), repeat=3))


@pytest.mark.parametrize("axes", sorted(euler.AXES))
def test_euler_angles_in_degrees_are_exact_both_ways(axes: str) -> None:
    columns: Vector = tuple(np.array(TURNS).T)
    together = np.stack(euler.to_quaternion(*columns, axes, arrays, degrees=True), axis=-1)
    for (first, second, third), row in zip(TURNS, together.tolist(), strict=True):
        xyzw = euler.to_quaternion(first, second, third, axes, floats, degrees=True)
        assert list(xyzw) == row
        assert {abs(part) for part in xyzw} <= EXACT
        assert {abs(entry) for entry in quaternion.to_matrix(*xyzw)} <= {0.0, 1.0}
        assert all(angle % 90.0 == 0.0 for angle in euler.from_quaternion(*xyzw, axes, floats, degrees=True))


def test_angles_back_from_arrays_are_exact() -> None:
    columns: Quaternion = tuple(np.array(samples.LATTICE).T)
    for axes in euler.AXES:
        angles = np.stack(euler.from_quaternion(*columns, axes, arrays, degrees=True))
        straight = np.all(np.isin(np.abs(np.stack(quaternion.to_matrix(*columns))), (0.0, 1.0)), axis=0)
        assert np.all(angles[:, straight] % 90.0 == 0.0)


@pytest.mark.parametrize("name", [name for name in ROTATIONS if name not in ("mrp", "rotvec", "axis_angle")])
@pytest.mark.parametrize("xyzw", samples.LATTICE)
def test_the_lattice_of_right_angles_comes_back_to_the_bit(name: str, xyzw: Quaternion) -> None:
    row = notation("euler:sxyz" if name == "euler" else name)
    back = row.to_quaternion(row.from_quaternion(*xyzw, floats, degrees=True), floats, degrees=True)
    assert floats.canonical_sign(*back) == floats.canonical_sign(*xyzw)


@pytest.mark.parametrize("name", ["rotvec", "axis_angle"])
@pytest.mark.parametrize("turn", [90.0, 180.0])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_turns_about_coordinate_axes_are_exact(name: str, turn: float, axis: tuple[float, ...]) -> None:
    row = notation("euler:sxyz" if name == "euler" else name)
    given = tuple(part * turn for part in axis) if name == "rotvec" else (*axis, turn)
    xyzw = row.to_quaternion(given, floats, degrees=True)
    assert {abs(part) for part in xyzw} <= EXACT
    assert row.from_quaternion(*xyzw, floats, degrees=True) == given


def test_products_of_right_angles_stay_on_the_lattice() -> None:
    for a, b in itertools.product(samples.LATTICE, repeat=2):
        assert {abs(part) for part in quaternion.compose(*a, *b)} <= EXACT


def test_points_moved_by_right_angles_keep_their_digits() -> None:
    for first, second, third in TURNS:
        xyzw = euler.to_quaternion(first, second, third, "sxyz", floats, degrees=True)
        assert sorted(abs(part) for part in quaternion.rotate(*xyzw, 0.1, 0.2, 0.3)) == [0.1, 0.2, 0.3]


def test_half_a_turn_in_radians_keeps_the_residue_of_pi_and_in_degrees_has_none() -> None:
    row = notation("axis_angle")
    assert row.to_quaternion((1.0, 0.0, 0.0, np.pi), floats) == (1.0, 0.0, 0.0, 6.123233995736766e-17)
    assert row.to_quaternion((1.0, 0.0, 0.0, 180.0), floats, degrees=True) == (1.0, 0.0, 0.0, 0.0)
