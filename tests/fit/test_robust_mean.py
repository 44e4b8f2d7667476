"""Means of poses some of which are wrong (golden/hand_eye.json), and that nothing changes where none is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rigs import replaced, small

from frametool.errors import ValueInvalid
from frametool.fit.robust_mean import solve_mean
from frametool.geometry.transform import Rotation, Transform

CASES = {each["name"]: each for each in json.loads((Path(__file__).parents[1] / "golden" / "hand_eye.json").read_text())["mean"]}
TRUTH = Transform.random(seed=5)


def seen(count: int, *, seed: int = 0, wrong: int = 0) -> tuple[Transform, list[int]]:
    rng = np.random.default_rng(seed)
    rows = sorted(rng.choice(count, wrong, replace=False).tolist())
    off = small(rng, count, (1e-3, 2e-3))
    poses = Transform(off.rotation @ TRUTH.rotation, TRUTH.xyz + off.xyz)
    return (replaced(poses, rows, Transform.random(wrong, seed=rng)) if wrong else poses), rows


@pytest.mark.parametrize("name", CASES)
def test_means_are_those_of_the_right_poses(name: str) -> None:
    case = CASES[name]
    rows = [[*row["xyz"], *(row["quaternion"][key] for key in "xyzw")] for row in case["poses"]]
    given = np.array(rows)
    found = solve_mean(Transform.from_arrays(given[:, :3], given[:, 3:], normalize=True))
    assert found.transform.is_close(Transform.from_arrays(case["pose"]["xyz"], case["pose"]["xyzw"], normalize=True), angle=1e-9, distance=1e-9)
    assert (np.flatnonzero(~found.used) + 1).tolist() == case["left_out"]


@pytest.mark.parametrize(("count", "wrong"), [(3, 1), (4, 1), (5, 2), (20, 8), (1000, 400)])
def test_wrong_poses_are_left_out_and_told(count: int, wrong: int) -> None:
    poses, rows = seen(count, wrong=wrong)
    found = solve_mean(poses)
    assert set(rows) <= set(np.flatnonzero(found.left_out).tolist())
    assert found.used.sum() >= 0.99 * (count - wrong)
    assert (found.u[rows] > 3.0).all()
    assert found.transform.components == poses[found.used].mean().components
    assert found.dof == 3 * found.used.sum() - 3
    assert solve_mean(poses, robust=False).used.all()


@pytest.mark.parametrize("count", [1, 2, 3, 10, 100])
@pytest.mark.parametrize("weighted", [False, True])
def test_where_none_is_wrong_the_bits_are_those_of_the_plain_mean(count: int, weighted: bool) -> None:  # noqa: FBT001
    poses, _ = seen(count, seed=1)
    weights = np.linspace(1.0, 2.0, count) if weighted else None
    plain = poses.mean(weights)
    metres, radians = plain.distance(poses)
    farthest = (metres.max(), radians.max())
    for robust in (True, False):
        found = solve_mean(poses, weights=weights, robust=robust)
        assert found.used.all()
        assert found.transform.components == plain.components
        assert found.most == farthest


def test_two_poses_apart_are_both_kept() -> None:
    assert solve_mean(Transform.random(2, seed=0)).used.all()


def test_poses_that_are_all_alike_but_one() -> None:
    poses = Transform(Rotation.from_rotvec(np.zeros((6, 3))), [[0.0, 0.0, 0.0]] * 5 + [[0.0, 0.0, 1.0]])
    found = solve_mean(poses)
    assert found.used.tolist() == [True] * 5 + [False]
    assert found.sigma == (1e-9, 1e-9)


def test_a_pose_of_weight_zero_counts_for_nothing_and_is_not_left_out() -> None:
    poses, rows = seen(12, wrong=2)
    weights = np.ones(12)
    weights[rows[0]] = 0.0
    found = solve_mean(poses, weights=weights)
    assert np.flatnonzero(~found.used).tolist() == rows
    assert np.flatnonzero(found.left_out).tolist() == rows[1:]
    assert found.transform.components == solve_mean(poses).transform.components


def test_moving_the_world_moves_the_mean() -> None:
    poses, rows = seen(15, wrong=4)
    moved = Transform.random(seed=9)
    there = solve_mean(moved @ poses)
    assert there.transform.is_close(moved @ solve_mean(poses).transform, angle=1e-12, distance=1e-12)
    assert np.flatnonzero(~there.used).tolist() == rows


def test_the_covariance_is_that_of_a_pose_and_sigma_its_root() -> None:
    poses, _ = seen(4000, seed=2)
    found = solve_mean(poses, robust=False)
    assert found.covariance is not None
    np.testing.assert_allclose(found.covariance, np.cov(found.residuals.T), atol=1e-9)
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), np.repeat([1e-3, 2e-3], 3), rtol=0.05)
    np.testing.assert_allclose(found.sigma, [1e-3, 2e-3], rtol=0.03)
    assert solve_mean(poses[:1]).covariance is None


def test_no_poses_and_no_mean() -> None:
    with pytest.raises(ValueInvalid, match=r"^mean of no rotations; give at least one$"):
        solve_mean(Transform.random(1)[:0])
    with pytest.raises(ValueInvalid, match=r"^poses: expected transforms of shape \(n,\), got \(\)$"):
        solve_mean(TRUTH)
    apart = Transform(Rotation.from_rotvec(np.pi * np.eye(4, 3)), np.zeros((4, 3)))
    with pytest.raises(ValueInvalid, match="none is their mean"):
        solve_mean(apart)
