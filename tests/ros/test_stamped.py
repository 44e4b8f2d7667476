"""Messages that are moved: tf2's numbers, the laws of mechanics, and nothing else touched."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.documents.source import Source
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform
from frametool.grammar.readers import Reading
from frametool.ros.stamped import Stamped, kind_of, read_stamped

if TYPE_CHECKING:
    from collections.abc import Sequence

# tf2_geometry_msgs 0.7.6 (Python, PyKDL)
CASES = json.loads((Path(__file__).parent.parent / "golden" / "do_transform.json").read_text())["cases"]
HEADER = {"seq": "7", "stamp": {"secs": "1700000000", "nsecs": "123456789"}, "frame_id": "lidar"}


def mapping(names: str, values: Sequence[float]) -> dict[str, str]:
    return dict(zip(names, map(repr, map(float, values)), strict=True))


def pose(case: dict[str, Any]) -> dict[str, Any]:
    return {"position": mapping("xyz", case["v"]), "orientation": mapping("xyzw", case["pose_q"])}


def read(**fields: Any) -> Stamped:
    message = {"header": HEADER, **fields}
    return read_stamped(message, kind_of(message) or "", Reading(Source("test", "")))


def transform(case: dict[str, Any]) -> Any:
    return (*case["t"], *case["q"])


def close(values: Sequence[float], expected: Sequence[float]) -> bool:
    return bool(np.allclose(values, expected, rtol=1e-12, atol=1e-12 * (1 + np.abs(expected).max())))


@pytest.mark.parametrize("kind", ["point", "vector"])
def test_points_and_vectors_move_as_in_tf2(kind: str) -> None:
    for case in CASES:
        assert close(read(**{kind: mapping("xyz", case["v"])}).moved(transform(case), "map").numbers, case[kind])


def test_poses_move_as_in_tf2() -> None:
    for case in CASES:
        numbers = read(pose=pose(case)).moved(transform(case), "map").numbers
        position, orientation = case["pose"]
        assert close(numbers[:3], position)
        assert abs(np.dot(numbers[3:], orientation)) == pytest.approx(1.0, abs=1e-12)


def test_a_wrench_has_the_force_of_tf2_and_the_torque_about_the_new_origin() -> None:
    for case in CASES:
        wrench = {"force": mapping("xyz", case["v"]), "torque": mapping("xyz", case["torque"])}
        numbers = read(wrench=wrench).moved(transform(case), "map").numbers
        force, torque = case["wrench"]  # this peer only rotates the torque
        assert close(numbers[:3], force)
        assert close(numbers[3:], np.add(torque, np.cross(case["t"], force)))


def test_the_power_of_a_wrench_on_a_twist_is_the_same_in_every_frame() -> None:
    for case in CASES:
        first, second = mapping("xyz", case["v"]), mapping("xyz", case["torque"])
        wrench = read(wrench={"force": first, "torque": second})
        twist = read(twist={"linear": second, "angular": first})
        moved = [each.moved(transform(case), "map").numbers for each in (wrench, twist)]
        power = np.dot(wrench.numbers, twist.numbers)
        assert np.dot(moved[0], moved[1]) == pytest.approx(power, rel=1e-9, abs=1e-9 * np.abs(moved).max() ** 2)


def covariance(seed: int) -> Any:
    root = np.random.default_rng(seed).normal(size=(6, 6))
    return root @ root.T


def test_each_block_of_a_pose_covariance_turns_on_its_own() -> None:
    for case in CASES[:10]:
        given = covariance(1)
        inner = {"pose": pose(case), "covariance": list(map(repr, given.ravel().tolist()))}
        moved = np.reshape(read(pose=inner).moved(transform(case), "map").covariance or (), (6, 6))
        turn = Rotation.from_quaternion(case["q"]).as_matrix()
        for rows in (slice(0, 3), slice(3, 6)):
            for columns in (slice(0, 3), slice(3, 6)):
                assert np.allclose(moved[rows, columns], turn @ given[rows, columns] @ turn.T, atol=1e-12)


def test_the_covariance_of_a_twist_is_that_of_moved_samples() -> None:
    case = CASES[3]
    basis = np.eye(6)
    moved = [read(twist={"linear": mapping("xyz", row[:3]), "angular": mapping("xyz", row[3:])}) for row in basis.tolist()]
    adjoint = np.array([each.moved(transform(case), None).numbers for each in moved]).T
    zero = mapping("xyz", (0.0, 0.0, 0.0))
    inner = {"twist": {"linear": zero, "angular": zero}, "covariance": list(map(repr, covariance(2).ravel().tolist()))}
    found = np.reshape(read(twist=inner).moved(transform(case), None).covariance or (), (6, 6))
    assert np.allclose(found, adjoint @ covariance(2) @ adjoint.T, rtol=1e-12)


def test_the_way_back_gives_the_message_back() -> None:
    there = Transform.of(*transform(CASES[0]))
    wrench = {"force": mapping("xyz", (1, 2, 3)), "torque": mapping("xyz", (0.5, 0, -1))}
    back = read(wrench=wrench).moved(there.components, "map").moved(there.inverse().components, "lidar")
    assert np.allclose(back.numbers, [1, 2, 3, 0.5, 0, -1], atol=1e-12)
    assert back.mapping()["header"] == {"seq": 7, "stamp": {"secs": 1700000000, "nsecs": 123456789}, "frame_id": "lidar"}


def test_stamp_and_fields_that_are_not_ours_stay() -> None:
    message = read(point=mapping("xyz", (1, 2, 3)), note="left", more={"deep": ["1", "2.50", "a"]})
    moved = message.moved((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), "map").mapping()
    assert message.stamp_ns == 1_700_000_000_123_456_789
    assert moved["header"]["frame_id"] == "map"
    assert (moved["note"], moved["more"]) == ("left", {"deep": [1, 2.5, "a"]})
    assert moved["point"] == {"x": 2.0, "y": 2.0, "z": 3.0}
