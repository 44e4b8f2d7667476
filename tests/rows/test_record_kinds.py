"""Messages that are moved: tf2's numbers, the laws of mechanics, and nothing else touched."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from flow import Moving

from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Sequence

# tf2_geometry_msgs 0.7.6 (Python, PyKDL)
CASES = json.loads((Path(__file__).parent.parent / "golden" / "do_transform.json").read_text())["cases"]
HEADER = {"seq": "7", "stamp": {"secs": "1700000000", "nsecs": "123456789"}, "frame_id": "lidar"}


def mapping(names: str, values: Sequence[float]) -> dict[str, str]:
    return dict(zip(names, map(repr, map(float, values)), strict=True))


def pose(case: dict[str, Any]) -> dict[str, Any]:
    return {"position": mapping("xyz", case["v"]), "orientation": mapping("xyzw", case["pose_q"])}


def read(**fields: Any) -> Moving:
    return Moving({"header": HEADER, **fields})


def transform(case: dict[str, Any]) -> Any:
    return (*case["t"], *case["q"])


def close(values: Sequence[float], expected: Sequence[float]) -> bool:
    return bool(np.allclose(values, expected, rtol=1e-12, atol=1e-12 * (1 + np.abs(expected).max())))


@pytest.mark.parametrize("kind", ["point", "vector"])
def test_points_and_vectors_move_as_in_tf2(kind: str) -> None:
    for case in CASES:
        assert close(read(**{kind: mapping("xyz", case["v"])}).by(transform(case)), case[kind])


def test_poses_move_as_in_tf2() -> None:
    for case in CASES:
        numbers = read(pose=pose(case)).by(transform(case))
        position, orientation = case["pose"]
        assert close(numbers[:3], position)
        assert abs(np.dot(numbers[3:], orientation)) == pytest.approx(1.0, abs=1e-12)


def test_a_wrench_has_the_force_of_tf2_and_the_torque_about_the_new_origin() -> None:
    for case in CASES:
        wrench = {"force": mapping("xyz", case["v"]), "torque": mapping("xyz", case["torque"])}
        numbers = read(wrench=wrench).by(transform(case))
        force, torque = case["wrench"]  # this peer only rotates the torque
        assert close(numbers[:3], force)
        assert close(numbers[3:], np.add(torque, np.cross(case["t"], force)))


def test_the_power_of_a_wrench_on_a_twist_is_the_same_in_every_frame() -> None:
    for case in CASES:
        first, second = mapping("xyz", case["v"]), mapping("xyz", case["torque"])
        wrench = read(wrench={"force": first, "torque": second})
        twist = read(twist={"linear": second, "angular": first})
        seen = [each.by(transform(case)) for each in (wrench, twist)]
        power = np.dot(wrench.own, twist.own)
        assert np.dot(seen[0], seen[1]) == pytest.approx(power, rel=1e-9, abs=1e-9 * np.abs(seen).max() ** 2)


def covariance(seed: int) -> Any:
    root = np.random.default_rng(seed).normal(size=(6, 6))
    return root @ root.T


def test_each_block_of_a_pose_covariance_turns_on_its_own() -> None:
    for case in CASES[:10]:
        given = covariance(1)
        inner = {"pose": pose(case), "covariance": list(map(repr, given.ravel().tolist()))}
        turned = np.reshape(read(pose=inner).by(transform(case))[7:], (6, 6))
        turn = Rotation.from_quaternion(case["q"]).as_matrix()
        for rows in (slice(0, 3), slice(3, 6)):
            for columns in (slice(0, 3), slice(3, 6)):
                assert np.allclose(turned[rows, columns], turn @ given[rows, columns] @ turn.T, atol=1e-12)


def test_the_covariance_of_a_twist_is_that_of_moved_samples() -> None:
    case = CASES[3]
    basis = np.eye(6)
    twists = [read(twist={"linear": mapping("xyz", row[:3]), "angular": mapping("xyz", row[3:])}) for row in basis.tolist()]
    adjoint = np.array([each.by(transform(case)) for each in twists]).T
    zero = mapping("xyz", (0.0, 0.0, 0.0))
    inner = {"twist": {"linear": zero, "angular": zero}, "covariance": list(map(repr, covariance(2).ravel().tolist()))}
    found = np.reshape(read(twist=inner).by(transform(case))[6:], (6, 6))
    assert np.allclose(found, adjoint @ covariance(2) @ adjoint.T, rtol=1e-12)


def test_the_way_back_gives_the_numbers_back() -> None:
    there = Transform.of(*transform(CASES[0]))
    force, torque = mapping("xyz", (1, 2, 3)), mapping("xyz", (0.5, 0, -1))
    force_there, torque_there = np.reshape(read(wrench={"force": force, "torque": torque}).by(there.components), (2, 3)).tolist()
    wrench = {"force": mapping("xyz", force_there), "torque": mapping("xyz", torque_there)}
    assert np.allclose(read(wrench=wrench).by(there.inverse().components), [1, 2, 3, 0.5, 0, -1], atol=1e-12)
