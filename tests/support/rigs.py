"""Hand-eye rigs made from a seed: where the camera truly is, and samples with noise at one of the frames."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from frametool.geometry import Array

NOISE = (5e-4, 2e-3)  # metres, radians, of each axis


class Rig(NamedTuple):
    """G and C of samples, the X and Z they were made from, and which samples are wrong."""

    gripper: Transform
    target: Transform
    x: Transform
    z: Transform
    wrong: list[int]


def small(rng: np.random.Generator, count: int, sigma: tuple[float, float]) -> Transform:
    """Draw poses near the identity: metres and radians of each axis."""
    steps = rng.normal(size=(count, 6)) * np.repeat(sigma, 3)
    return Transform(Rotation.from_rotvec(steps[:, 3:]), steps[:, :3])


def replaced(poses: Transform, rows: list[int], others: Transform) -> Transform:
    """Put others in the place of some poses."""
    xyz, xyzw = poses.xyz, poses.xyzw
    xyz[rows], xyzw[rows] = others.xyz, others.xyzw
    return Transform.from_arrays(xyz, xyzw)


def rig(
    noise_at: str | None,
    *,
    seed: int,
    count: int = 15,
    wrong: int = 0,
    turn: float | Array = 0.4,
    noise: tuple[float, float] = NOISE,
) -> Rig:
    """Make samples: turn is the deviation of the gripper's rotation vectors, radians, noise that at target, camera or gripper."""
    rng = np.random.default_rng(seed)
    x, z = Transform.random(seed=rng, radius=0.12), Transform.random(seed=rng)
    start = Transform.random(seed=rng, radius=0.5)
    moves = Transform(Rotation.from_rotvec(rng.normal(size=(count, 3)) * turn), rng.normal(size=(count, 3)) * 0.3)
    gripper = start @ moves
    target = x.inverse() @ gripper.inverse() @ z
    off = small(rng, count, noise)
    if noise_at == "target":
        target = target @ off
    elif noise_at == "camera":
        target = off @ target
    elif noise_at == "gripper":
        target = x.inverse() @ off @ x @ target
    rows = sorted(rng.choice(count, wrong, replace=False).tolist())
    return Rig(gripper, replaced(target, rows, Transform.random(wrong, seed=rng)) if wrong else target, x, z, rows)
