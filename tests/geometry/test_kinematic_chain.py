"""Chains of joints: products of the motions are the same bits for floats and arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from frametool.geometry import arrays, floats, rigid
from frametool.geometry.rigid import slid, turned

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


@pytest.mark.parametrize("unit", ["degrees", "radians"])
@pytest.mark.parametrize("axis", AXES)
def test_floats_and_arrays_take_the_same_steps_to_the_bit(axis: Any, unit: str) -> None:
    values = np.array([*ANGLES, 90.0, -180.0, 270.0, 0.1])

    def walk(value: Any, xp: Any) -> Any:
        pose = POSES[0]
        for piece in POSES:
            for step in (*moved(axis, value, xp, degrees=unit == "degrees"), piece):
                pose = rigid.compose(*pose, *step)
        return pose

    many = [np.broadcast_to(part, values.shape) for part in walk(values, arrays)]
    for row, value in enumerate(values.tolist()):
        assert walk(value, floats) == tuple(part[row] for part in many)


@pytest.mark.parametrize("quarters", range(-4, 5))
def test_quarter_turns_in_degrees_are_exact(quarters: int) -> None:
    pose = turned(0.0, 0.0, 1.0, 90.0 * quarters, floats, degrees=True)
    x, y, _ = rigid.compose(*pose, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)[:3]
    assert (x, y) == [(1, 0), (0, 1), (-1, 0), (0, -1)][quarters % 4]
