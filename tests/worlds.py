"""Worlds of frames and measurements between them, seeded, for the tests and benchmarks of solve."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.fit.measurements import Measurement
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable

SIGMA_M, SIGMA_RAD = 0.004, np.radians(0.25)


class World(NamedTuple):
    """The true poses of frames f0, f1 .. in f0, and what was measured."""

    poses: Transform
    measurements: list[Measurement]

    def true(self, target: str, source: str) -> Transform:
        return self.poses[int(target[1:])].inverse() @ self.poses[int(source[1:])]

    def worst(self, pose: Callable[[str], Transform]) -> tuple[float, float]:
        """Return the largest error of any frame in f0, in metres and radians."""
        errors = [self.true("f0", f"f{i}").distance(pose(f"f{i}")) for i in range(len(self.poses))]
        return max(metres for metres, _ in errors), max(radians for _, radians in errors)


def world(
    frames: int, rows: int, seed: int, *, noise: float = 1.0, sigmas: bool = False, size: float = 1.0, near: int | None = None
) -> World:
    """Measure each frame from an earlier one, then any two, or two whose numbers are `near`; f0 is never a child."""
    generator = np.random.default_rng(seed)
    poses = Transform(Rotation.random(frames, seed=generator), generator.normal(scale=size, size=(frames, 3)))
    poses = poses[0].inverse() @ poses
    pairs = [(int(generator.integers(max(0, child - (near or child)), child)), child) for child in range(1, frames)]
    while len(pairs) < rows:
        a = int(generator.integers(0, frames - 1))
        b = int(generator.integers(a + 1, frames if near is None else min(a + near + 1, frames)))
        pairs.append((a, b))
    return World(poses, [measured(poses, a, b, generator, noise=noise, sigmas=sigmas) for a, b in pairs])


def measured(poses: Transform, a: int, b: int, generator: np.random.Generator, *, noise: float, sigmas: bool) -> Measurement:
    """Measure b in a: place + d, Exp(turn) R, along the axes of a."""
    true = poses[a].inverse() @ poses[b]
    d = noise * generator.normal(size=6) * ([SIGMA_M] * 3 + [SIGMA_RAD] * 3)
    pose = Transform(Rotation.from_rotvec(d[3:]) @ true.rotation, true.xyz + d[:3])
    covariance = tuple(np.diag([SIGMA_M**2] * 3 + [SIGMA_RAD**2] * 3).ravel().tolist()) if sigmas else None
    return Measurement(f"f{a}", f"f{b}", pose.components, covariance)


def inverted(measurement: Measurement) -> Measurement:
    """Give a pose the other way round, under the same names."""
    return measurement._replace(components=measurement.transform.inverse().components)
