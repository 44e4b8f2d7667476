"""Every row of the table of representations, against every other."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
import samples

from frametool.errors import ValueInvalid
from frametool.geometry import arrays, euler, floats, quaternion
from frametool.geometry.representations import ROTATIONS, Notation, axes_name, notation
from frametool.geometry.transform import Rotation

if TYPE_CHECKING:
    from frametool.geometry import Quaternion

SPECS = [*(name for name in ROTATIONS if name != "euler"), "euler:rzyx", "euler:sxzx"]
ROWS = samples.quaternions(10)
COLUMNS: Quaternion = tuple(np.array(ROWS).T)


def spelled(spec: str, unit: str) -> Notation:
    """Bind a unit where there is an angle to carry it."""
    name, colon, axes = spec.partition(":")
    return notation(f"{name}{unit}{colon}{axes}" if ROTATIONS[name].angles else spec)


@pytest.mark.parametrize(("start", "end"), list(itertools.permutations(SPECS, 2)))
def test_every_pair_converts_there_and_back(start: str, end: str) -> None:
    first, second = spelled(start, "_deg"), spelled(end, "_rad")
    there = second.from_quaternion(*first.to_quaternion(first.from_quaternion(*COLUMNS, arrays), arrays), arrays)
    back = Rotation.of(*second.to_quaternion(there, arrays))
    assert np.max(back.distance(Rotation.of(*COLUMNS))) <= 8e-15


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("unit", ["_deg", "_rad"])
def test_floats_and_arrays_agree(spec: str, unit: str) -> None:
    form = spelled(spec, unit)
    together = np.array(form.from_quaternion(*COLUMNS, arrays)).T
    for row, among in zip(ROWS, together, strict=True):
        ours = form.to_quaternion(form.from_quaternion(*row, floats), floats)
        theirs = form.to_quaternion(among.tolist(), floats)
        assert quaternion.distance(*ours, *theirs, floats) <= 8e-15


@pytest.mark.parametrize("spec", SPECS)
def test_checked_input_is_the_input(spec: str) -> None:
    form = notation(spec)
    for row in ROWS[:10]:
        found = form.checked_quaternion(form.from_quaternion(*row, floats), floats)
        assert quaternion.distance(*found, *row, floats) <= 8e-15


@pytest.mark.parametrize("name", ROTATIONS)
def test_each_row_says_what_it_is(name: str) -> None:
    row = ROTATIONS[name]
    assert row.name == name
    assert row.summary
    assert len(set(row.columns)) == len(row.columns)
    assert set(row.angles) <= set(range(len(row.columns)))


@pytest.mark.parametrize(
    ("spec", "columns"),
    [
        ("rpy", ("roll", "pitch", "yaw")),
        ("rpy_deg", ("roll_deg", "pitch_deg", "yaw_deg")),
        ("euler_rad:rzyx", ("euler_1_rad", "euler_2_rad", "euler_3_rad")),
        ("axis_angle_deg", ("axis_x", "axis_y", "axis_z", "angle_deg")),
        ("wxyz", ("qw", "qx", "qy", "qz")),
    ],
)
def test_columns_carry_the_unit_that_was_said(spec: str, columns: tuple[str, ...]) -> None:
    assert notation(spec).columns == columns


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("quaternon", "unknown representation 'quaternon'; did you mean 'quaternion'? representations: "),
        ("quat", "unknown representation 'quat'; did you mean 'quaternion'? representations: "),
        ("ypr_deg", "unknown representation 'ypr'; did you mean 'euler_deg:rzyx'? representations: "),
        ("matrix_deg", "matrix has no angle: write it without _deg"),
        ("euler:rzyz_", "unknown Euler axes 'rzyz_'; did you mean 'rzyz'? s (static axes) or r (rotating axes)"),
        ("euler:ZYX", "unknown Euler axes 'ZYX'"),
        ("rpy:rzyx", "rpy has no axes to name"),
        ("", "unknown representation ''"),
    ],
)
def test_unknown_notations_are_refused_with_the_nearest(spec: str, message: str) -> None:
    with pytest.raises(ValueInvalid) as caught:
        notation(spec)
    assert str(caught.value).startswith(message)


def test_euler_without_axes_asks_for_them() -> None:
    with pytest.raises(ValueInvalid, match="euler needs its axes: write euler:rzyx"):
        notation("euler").to_quaternion((0.0, 0.0, 0.0), floats)


@pytest.mark.parametrize(
    ("spec", "numbers", "message"),
    [
        ("rpy", (1.0, 2.0), r"rpy takes 3 numbers \(roll pitch yaw\), found 2"),
        ("rpy", (1.0, math.nan, 2.0), "rpy 1 nan 2 is not finite"),
        ("xyzw", (-1.0, 0.0, 1.0, 0.0), "quaternion -1 0 1 0 has norm 1.41421"),
        ("wxyz", (0.0, 0.0, 0.0, 0.0), "no direction"),
        ("axis_angle", (0.0, 0.0, 0.0, 1.0), "axis 0 0 0 has no direction"),
        ("matrix", (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0), "left-handed"),
        ("six_d", (1.0, 0.0, 0.0, 1.0, 0.0, 0.0), "parallel"),
        ("mrp", (math.inf, 0.0, 0.0), "mrp inf 0 0"),
        ("rotvec", (math.nan, 0.0, 0.0), "rotation vector nan 0 0"),
    ],
)
def test_numbers_that_are_no_rotation_are_refused(spec: str, numbers: tuple[float, ...], message: str) -> None:
    with pytest.raises(ValueInvalid, match=message):
        notation(spec).checked_quaternion(numbers, floats)


def test_an_axis_of_any_length_is_an_axis() -> None:
    turned = notation("axis_angle").checked_quaternion((-1.0, 0.0, 1.0, math.pi), floats)
    assert turned[:3] == pytest.approx((-math.sqrt(0.5), 0.0, math.sqrt(0.5)))


def test_order_and_frame_name_all_24_conventions() -> None:
    orders = ["".join(order) for order in itertools.product("xyz", repeat=3) if order[0] != order[1] != order[2]]
    named = {axes_name(order, frame) for order in orders for frame in ("intrinsic", "extrinsic")}
    assert named == set(euler.AXES)
    with pytest.raises(ValueInvalid, match="write intrinsic"):
        axes_name("zyx", "rotating")


def test_static_axes_are_the_rotating_ones_reversed() -> None:
    for axes in (name for name in euler.AXES if name[0] == "s"):
        static = Rotation.from_euler(axes, [0.3, 0.2, 0.1])
        assert static.is_close(Rotation.from_euler("r" + axes[:0:-1], [0.1, 0.2, 0.3]), angle=1e-15)
