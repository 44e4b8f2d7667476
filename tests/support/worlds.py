"""Worlds of frames and measurements between them, seeded, for the tests and benchmarks of solve."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.fit.blunders import Measurement
from frametool.fit.tree_problem import bridges, spanning_tree
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable

SIGMA_M, SIGMA_RAD = 0.004, np.radians(0.25)
SIGMAS = np.array([SIGMA_M] * 3 + [SIGMA_RAD] * 3)
COVARIANCE = tuple(np.diag(SIGMAS**2).ravel().tolist())
OWN_INVERSE = np.radians(170)  # a turn about as far as this cannot be told from its inverse


class World(NamedTuple):
    """The true poses of frames f0, f1 .. in f0, and what was measured; wrong: the rows that are not as measured."""

    poses: Transform
    measurements: list[Measurement]
    wrong: tuple[int, ...] = ()

    @property
    def pairs(self) -> list[tuple[int, int]]:
        return [(int(each.parent[1:]), int(each.child[1:])) for each in self.measurements]

    def true(self, target: str, source: str) -> Transform:
        return self.poses[int(target[1:])].inverse() @ self.poses[int(source[1:])]

    def rms(self, pose: Callable[[str], Transform]) -> tuple[float, float]:
        """Return the rms error of the poses of frames in f0, in metres and radians."""
        errors = np.array([self.true("f0", f"f{i}").distance(pose(f"f{i}")) for i in range(1, len(self.poses))])
        metres, radians = np.sqrt((errors**2).mean(0))
        return float(metres), float(radians)

    def spanning_tree(self, leave_out: tuple[int, ...] = ()) -> dict[str, Transform]:
        """Return the poses that the first rows give which close no loop."""
        rows = [row for row in range(len(self.measurements)) if row not in leave_out]
        tree, poses = spanning_tree(len(self.poses), self.pairs, rows), {"f0": Transform.identity()}
        for body in tree.order[1:]:
            row, above = self.measurements[tree.row[body]], poses[f"f{tree.parent[body]}"]
            poses[f"f{body}"] = above @ (row.transform if row.child == f"f{body}" else row.transform.inverse())
        return poses

    def with_inverted(self, count: int, seed: int = 0) -> World:
        """Turn some rows around, each of which at least two independent loops check."""
        rows = list(self.measurements)
        wrong: tuple[int, ...] = ()
        for row in np.random.default_rng(seed).permutation(len(rows)).tolist():
            angle = rows[row].transform.rotation.angle()
            if len(wrong) < count and angle < OWN_INVERSE and self._decidable({*wrong, row}):
                rows[row], wrong = inverted(rows[row]), (*wrong, row)
        return World(self.poses, rows, tuple(sorted(wrong)))

    def _decidable(self, wrong: set[int]) -> bool:
        """Say whether the ends of wrong rows stay in loops without them."""
        rest = [row for row in range(len(self.measurements)) if row not in wrong]
        tree = spanning_tree(len(self.poses), self.pairs, rest)
        if len(tree.order) < len(self.poses):
            return False
        alone = bridges(tree, self.pairs, rest)
        return not any(alone.intersection(tree.rows_between(*self.pairs[row])) for row in wrong)


def world(
    frames: int, rows: int, seed: int, *, noise: float = 1.0, sigmas: bool = False, near: int | None = None
) -> World:
    """Measure each frame from an earlier one, then any two, or two whose numbers are `near`; f0 is never a child."""
    generator = np.random.default_rng(seed)
    poses = Transform(Rotation.random(frames, seed=generator), generator.normal(size=(frames, 3)))
    poses = poses[0].inverse() @ poses
    pairs = [(int(generator.integers(max(0, child - (near or child)), child)), child) for child in range(1, frames)]
    while len(pairs) < rows:
        a = int(generator.integers(0, frames - 1))
        b = int(generator.integers(a + 1, frames if near is None else min(a + near + 1, frames)))
        pairs.append((a, b))
    errors = noise * generator.normal(size=(len(pairs), 6)) * SIGMAS
    covariance = COVARIANCE if sigmas else None
    return World(poses, [measured(poses, pair, error, covariance) for pair, error in zip(pairs, errors, strict=True)])


def measured(poses: Transform, pair: tuple[int, int], error: np.ndarray, covariance: tuple[float, ...] | None) -> Measurement:
    """Measure a frame in another: place + d, Exp(turn) R, along the other's axes."""
    a, b = pair
    true = poses[a].inverse() @ poses[b]
    pose = Transform(Rotation.from_rotvec(error[3:]) @ true.rotation, true.xyz + error[:3])
    return Measurement(f"f{a}", f"f{b}", pose.components, covariance)


def inverted(measurement: Measurement) -> Measurement:
    """Give a pose the other way round, under the same names."""
    return measurement._replace(components=measurement.transform.inverse().components)


def ring(frames: int, more: int, *, seed: int, sigmas: tuple[float, float] = (1e-3, 1e-3)) -> list[Measurement]:
    """Measure each frame in the one before, the first in the last, and some more pairs; without sigmas."""
    generator = np.random.default_rng([frames, more, seed])
    poses = Transform(Rotation.random(frames, seed=generator), generator.normal(size=(frames, 3)))
    pairs = [(at, (at + 1) % frames) for at in range(frames)]
    pairs += [tuple(generator.choice(frames, 2, replace=False).tolist()) for _ in range(more)]
    errors = generator.normal(size=(len(pairs), 6)) * np.repeat(sigmas, 3)
    return [measured(poses, pair, error, None) for pair, error in zip(pairs, errors, strict=True)]
