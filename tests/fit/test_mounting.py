"""The lever arm: found where turns show it, 0 where they do not."""

from __future__ import annotations

import numpy as np
import pytest

from frametool.fit.alignment import lever_arm
from frametool.frames.trajectory import Trajectory
from frametool.geometry.transform import Rotation

UP = np.array([0.0, 0.0, 1.0])
ARM = np.array([0.3, -0.2, 0.5])
TIME = np.linspace(0.0, 6.0, 200)
PATH = np.stack([5.0 * np.cos(TIME), 3.0 * np.sin(2.0 * TIME), 0.5 * np.sin(3.0 * TIME)], -1)
TURNS = {
    "about all axes": (np.stack([0.3 * np.sin(TIME), 0.4 * np.cos(2.0 * TIME), TIME], -1), [True, True, True]),
    "about up": (np.stack([0.0 * TIME, 0.0 * TIME, TIME], -1), [True, True, False]),
    "not at all": (np.zeros((200, 3)), [False, False, False]),
}


@pytest.mark.parametrize("kind", ["yaw", "se3", "sim3"])
@pytest.mark.parametrize("name", TURNS)
def test_the_part_of_an_arm_that_turns_show_is_found_and_the_rest_is_0(name: str, kind: str) -> None:
    rpy, shown = TURNS[name]
    rotation = Rotation.from_rpy(rpy)
    world = Rotation.from_rpy([0.0, 0.0, 0.7])
    ref = Trajectory(None, world.apply(PATH + rotation.apply(ARM)))
    est = Trajectory(None, PATH, np.stack(rotation.components, -1))
    assert lever_arm(kind, ref, est, UP) == pytest.approx(np.where(shown, ARM, 0.0), abs=1e-9)
