"""Chains of joints: the steps of one kernel are products of the motions, for floats and arrays to the same bits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from frametool.geometry import arrays, floats, rigid
from frametool.geometry.rigid import go_on, slid, turned

AXES = [(0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8), (2 / 3, -1 / 3, 2 / 3)]
ANGLES = [0.0, -0.0, 0.3, -2.9, math.pi, 1e-9, 40.0, -1e7]
HALF = math.sqrt(0.5)
POSES = [
    (1.0, -2.0, 0.5, 0.5, -0.5, 0.5, 0.5),
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    (0.1, 0.0, 0.0, 0.6, 0.0, 0.0, 0.8),
    (-3.0, 0.25, 1e3, HALF, 0.0, -HALF, 0.0),
]


def moved(axis: Any, value: Any, xp: Any, *, degrees: bool = False) -> Any:
    """Give what a joint that turns and one that slides do."""
    x, y, z = axis
    return turned(x, y, z, value, xp, degrees=degrees), slid(x, y, z, value)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("value", ANGLES)
def test_a_step_is_the_product_to_the_bit(axis: Any, pose: Any, value: float) -> None:
    both: Any = rigid.compose
    for piece in (*moved(axis, value, floats), *POSES):
        assert go_on(pose, piece) == both(*pose, *piece)


@pytest.mark.parametrize("unit", ["degrees", "radians"])
@pytest.mark.parametrize("axis", AXES)
def test_floats_and_arrays_take_the_same_steps_to_the_bit(axis: Any, unit: str) -> None:
    values = np.array([*ANGLES, 90.0, -180.0, 270.0, 0.1])

    def walk(value: Any, xp: Any) -> Any:
        pose = POSES[0]
        for piece in POSES:
            for step in (*moved(axis, value, xp, degrees=unit == "degrees"), piece):
                pose = go_on(pose, step)
        return pose

    many = [np.broadcast_to(part, values.shape) for part in walk(values, arrays)]
    for row, value in enumerate(values.tolist()):
        assert walk(value, floats) == tuple(part[row] for part in many)


@pytest.mark.parametrize("quarters", range(-4, 5))
def test_quarter_turns_in_degrees_are_exact(quarters: int) -> None:
    pose = turned(0.0, 0.0, 1.0, 90.0 * quarters, floats, degrees=True)
    x, y, _ = go_on(pose, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))[:3]
    assert (x, y) == [(1, 0), (0, 1), (-1, 0), (0, -1)][quarters % 4]
