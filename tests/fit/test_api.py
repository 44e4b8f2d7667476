"""The Python face of solve: what it takes, what it returns, and the shapes that it refuses by name."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from rigs import rig
from worlds import COVARIANCE, world

import frametool
from frametool.errors import FormatError, FrametoolWarning, ValueInvalid
from frametool.fit.measured_tree import solve_tree
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from pathlib import Path

WORLD = world(6, 14, 3, sigmas=True).with_inverted(1)
TUPLES = [(each.parent, each.child, each.transform, each.covariance) for each in WORLD.measurements]
RIG = rig("target", seed=4, wrong=1)


def test_a_tree_is_solved_from_tuples_as_from_measurements() -> None:
    found, same = frametool.solve(TUPLES), solve_tree(WORLD.measurements)
    assert np.flatnonzero(~found.used).tolist() == list(WORLD.wrong)
    assert [found.fits[row] for row in WORLD.wrong] == ["inverted"]
    assert found.residuals.tolist() == same.residuals.tolist()
    assert found.u.tolist() == same.u.tolist()
    assert found.checked.all()
    assert found.tree.roots == (found.root,) == ("f0",)
    for name in found.frames[1:]:
        assert found.tree.lookup("f0", name).components == same.poses[name].components
        marginal = found.covariance("f0", name)
        assert marginal is not None
        np.testing.assert_allclose(np.reshape(found.tree.covariance("f0", name), (6, 6)), marginal, rtol=1e-9, atol=1e-15)


def test_covariances_are_rows_or_numbers_or_none() -> None:
    square = [(*each[:3], np.reshape(each[3], (6, 6)) if each[3] else None) for each in TUPLES]
    assert frametool.solve(square).u.tolist() == frametool.solve(TUPLES).u.tolist()
    bare = frametool.solve([each[:3] for each in TUPLES])
    assert bare.sigma is not None
    assert frametool.solve([each[:3] for each in TUPLES], robust=False).used.all()


def test_a_path_is_read_as_the_command_reads_it(tmp_path: Path) -> None:
    rows = [
        {"parent": each.parent, "child": each.child, "xyz": list(each.components[:3]), "xyzw": list(each.components[3:]), "covariance": list(COVARIANCE)}
        for each in WORLD.measurements
    ]  # fmt: skip
    path = tmp_path / "m.json"
    path.write_text(json.dumps({"measurements": rows}))
    assert frametool.solve(path).u.tolist() == pytest.approx(frametool.solve(TUPLES).u.tolist(), rel=1e-9)
    assert frametool.solve(str(path)).measurements[0].place == f"{path}:1:19"  # several on a line
    path.write_text("[]")
    with pytest.raises(FormatError, match="no measurements in it"):
        frametool.solve(path)


def test_what_is_fixed_keeps_its_entries(tmp_path: Path) -> None:
    path = tmp_path / "hand.yaml"
    path.write_text("frames: {f2: {tool: {xyz: [0.1, 0, 0.25], sigma: {xyz_mm: 1, rpy_deg: 1}}}}")
    tree = frametool.FrameTree()
    tree.add("f3", "lens", Transform.of(0.125, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    found = frametool.solve(TUPLES, root="f1", fix=[path, tree])
    assert (found.tree.parent("tool"), found.tree.parent("lens"), found.tree.roots) == ("f2", "f3", ("f1",))
    assert found.tree.lookup("f2", "tool").components == (0.1, 0.0, 0.25, 0.0, 0.0, 0.0, 1.0)
    assert found.tree.covariances["tool"][0] == 1e-6
    assert "lens" not in found.tree.covariances
    moving = "[{name: a, parent: f2, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0]}]}]"
    path.write_text(moving)
    with pytest.raises(ValueInvalid, match=r"hand\.yaml moves; fixed frames must be static"):
        frametool.solve(TUPLES, fix=[path])
    with pytest.raises(ValueInvalid, match=r"hand\.yaml moves; fixed frames must be static"):
        frametool.solve(TUPLES, fix=str(path))


POSE = Transform.identity()
MANY = Transform.random(3, seed=1)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (("a", "b"), "measurement 1: expected (parent, child, Transform) or with a covariance behind"),
        (("a", "b", [1, 2, 3]), "measurement 1: expected (parent, child, Transform) or with a covariance behind"),
        (("a", 7, POSE), "measurement 1: a frame is named by a text, found 7"),
        (("a", "b", MANY), "measurement 1: the pose of a frame is one Transform, found <Transform of shape (3,)>"),
        (("a", "b", POSE, np.eye(3)), "measurement 1: covariance must be 36 numbers or 6 rows of 6"),
        (("a", "b", POSE, [1.0] * 21), "measurement 1: covariance has 21 numbers; 36 are needed (6x6, row-major: x y z, turns about X Y Z)"),
        (("a", "b", POSE, -np.eye(6)), "measurement 1: covariance[0] is -1: 'unknown' in ROS; leave the covariance out"),
        (("a", "b", POSE, np.zeros((6, 6))), "measurement 1: the covariance is exact in some direction; exact: --fix"),
        (("a", "a", POSE), "measurement 1: 'a' is measured from itself"),
    ],
)  # fmt: skip
def test_what_is_no_measurement_is_refused_by_its_number(row: Any, message: str) -> None:
    with pytest.raises(ValueInvalid) as caught:
        frametool.solve([row])
    assert str(caught.value) == message


def test_no_measurements_are_an_error() -> None:
    with pytest.raises(ValueInvalid, match="no measurements"):
        frametool.solve([])


def test_hand_and_eye_are_solved_from_batches_matrices_and_lists() -> None:
    found = frametool.solve_hand_eye(RIG.gripper, RIG.target)
    assert np.flatnonzero(~found.used).tolist() == RIG.wrong
    assert found.x.is_close(RIG.x, angle=0.01, distance=0.01)
    by_matrix = frametool.solve_hand_eye(RIG.gripper.as_matrix(), RIG.target.as_matrix().tolist())
    by_list = frametool.solve_hand_eye([*RIG.gripper], [*RIG.target])
    for other in (by_matrix, by_list):
        assert other.x.is_close(found.x, angle=1e-9, distance=1e-9)
        assert other.used.tolist() == found.used.tolist()
    beside = frametool.solve_hand_eye(RIG.gripper.inverse(), RIG.target, eye_to_hand=True)
    assert beside.x.is_close(found.x, angle=1e-6, distance=1e-6)
    right = [row for row in range(len(RIG.gripper)) if row not in RIG.wrong]
    assert frametool.solve_hand_eye(RIG.gripper[right], RIG.target[right], robust=False).used.all()


def test_points_are_matched_and_what_looks_odd_is_warned_of() -> None:
    rng = np.random.default_rng(2)
    source = rng.normal(size=(12, 3))
    target = RIG.x.apply(source) + 1e-3 * rng.normal(size=(12, 3))
    target[5] += 1.0
    found = frametool.solve_points(target, source)
    assert np.flatnonzero(~found.used).tolist() == [5]
    assert found.transform.is_close(RIG.x, angle=0.01, distance=0.01)
    scaled = frametool.solve_points(target, 1000 * source, scale=True, weights=np.ones(12))
    assert scaled.scale == pytest.approx(1e-3, rel=0.01)
    with pytest.warns(FrametoolWarning, match="millimetres"):
        frametool.solve_points(target, 1000 * source)


def test_means_leave_out_what_is_wrong() -> None:
    poses = Transform.from_arrays(MANY[0].xyz + 1e-3 * np.random.default_rng(3).normal(size=(9, 3)), np.repeat(MANY[0].xyzw[None], 9, 0))
    poses = Transform.of(*map(np.append, poses.components, MANY[1].components))
    found = frametool.solve_mean(poses)
    assert np.flatnonzero(~found.used).tolist() == [9]
    assert found.transform.components == poses[:9].mean().components
    assert frametool.solve_mean([*poses], weights=np.ones(10)).used.tolist() == found.used.tolist()
    assert frametool.solve_mean(poses, robust=False).used.all()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (POSE, "{}: expected transforms of shape (n,), got ()"),
        (np.eye(4), "{}: expected matrices of shape (n, 4, 4), got (4, 4)"),
        (np.zeros((5, 3, 4)), "{}: expected matrices of shape (n, 4, 4), got (5, 3, 4)"),
        ([POSE, MANY], "{}: expected single transforms, got shape (3,)"),
        ([], "{}: expected matrices of shape (n, 4, 4), got (0,)"),
    ],
)
def test_other_shapes_of_poses_are_refused_by_name(given: Any, message: str) -> None:
    with pytest.raises(ValueInvalid) as gripper:
        frametool.solve_hand_eye(given, MANY)
    with pytest.raises(ValueInvalid) as target:
        frametool.solve_hand_eye(MANY, given)
    with pytest.raises(ValueInvalid) as poses:
        frametool.solve_mean(given)
    told = [str(caught.value) for caught in (gripper, target, poses)]
    assert told == [message.format(name) for name in ("gripper", "target", "poses")]


def test_other_shapes_of_points_and_weights_are_refused_by_name() -> None:
    good = np.random.default_rng(1).normal(size=(5, 3))
    for target, source, weights, message in (
        (good[:, :2], good, None, "target"),
        (good, good[:, :2], None, "source"),
        (good, good[:4], None, "target has 5 points, source 4"),
        (good, good, [1.0, 2.0], "weights"),
    ):
        with pytest.raises(ValueInvalid, match=message):
            frametool.solve_points(target, source, weights=weights)
    with pytest.raises(ValueInvalid, match="weights"):
        frametool.solve_mean(MANY, weights=[1.0])
    with pytest.raises(ValueInvalid, match="gripper has 3 poses, target 2"):
        frametool.solve_hand_eye(MANY, MANY[:2])
