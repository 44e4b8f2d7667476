"""Autoware's files and hand-eye calibrations: directions, orders, what is refused, what is written."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from calibrations import read
from scipy.spatial.transform import Rotation as Peer

from frametool.errors import FormatError
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

VEHICLE = """\
base_link:
  kit_link:
    x: 1.1
    y: 0
    z: 1.9
    roll: -0.00
    pitch: 0.015
    yaw: -0.0364
"""
# quaternion of the camera: 0.1 0.2 0.3 0.9 (a comment is no pose)
KIT = """\
kit_link:
  camera0/camera_link:
    x: 0.2
    y: 0.5
    z: -0.3
    roll: -0.025
    pitch: 0.315
    yaw: 1.035
  imu_link: {yaw: 3.14159265359, pitch: 0.0, roll: 3.14159265359, z: 0.0, y: 0.0, x: 0.0}
"""


def pose(*numbers: float) -> Any:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = Peer.from_euler("xyz", numbers[3:]).as_matrix(), numbers[:3]
    return made


def test_two_files_of_autoware_make_one_tree(tmp_path: Path) -> None:
    (tmp_path / "vehicle.yaml").write_text(VEHICLE)
    (tmp_path / "kit.yaml").write_text(KIT)
    tree = load(tmp_path / "vehicle.yaml", tmp_path / "kit.yaml")
    assert tree.roots == ("base_link",)
    wanted = pose(1.1, 0, 1.9, 0, 0.015, -0.0364) @ pose(0.2, 0.5, -0.3, -0.025, 0.315, 1.035)
    assert tree.lookup("base_link", "camera0/camera_link").as_matrix() == pytest.approx(wanted, abs=1e-15)


def test_angles_are_about_fixed_axes_and_the_inner_frame_is_the_child(tmp_path: Path) -> None:
    tree = read(tmp_path, "a:\n  b: {x: 1, y: 2, z: 3, roll: 0.3, pitch: -0.4, yaw: 1.2}\n")
    assert tree.lookup("a", "b").as_matrix() == pytest.approx(pose(1, 2, 3, 0.3, -0.4, 1.2), abs=1e-15)


def test_autoware_is_written_in_the_numbers_it_was_read_from(run: Callable[..., Any]) -> None:
    done = run("tree", "a.yaml", "--quiet", "-f", "autoware", files={"a.yaml": KIT.split("  imu_link", maxsplit=1)[0]})
    assert (done.status, done.err) == (0, "")
    assert done.out == KIT.split("  imu_link", maxsplit=1)[0]


@pytest.mark.parametrize("angles", [(3.14159265359, 0.0, 3.14159265359), (0.1, 0.2, 4.7), (-0.5, 1.5, -6.1), (0.0, 1e-9, 0.0)])
def test_angles_beyond_half_a_turn_are_written_as_the_same_rotation(run: Callable[..., Any], angles: tuple[float, ...]) -> None:
    numbers = ", ".join(f"{key}: {value!r}" for key, value in zip(("roll", "pitch", "yaw"), angles, strict=True))
    text = f"a:\n  b: {{x: 0.1, y: 1e-7, z: 3, {numbers}}}\n"
    written = run("tree", "-", "--quiet", "-f", "autoware", stdin=text)
    assert (written.status, written.err) == (0, "")
    one, two = (run("lookup", "-", "a", "b", "-f", "json", "--to", "matrix", stdin=each).out for each in (written.out, text))
    assert json.loads(one)["matrix"] == [pytest.approx(row, abs=1e-15) for row in json.loads(two)["matrix"]]


def test_a_deeper_tree_is_written_whole_and_told(run: Callable[..., Any]) -> None:
    tree = "{frames: {a: {b: {xyz: [1, 0, 0], children: {c: {xyz: [0, 1, 0]}}}}, alone: {}}}"
    done = run("tree", tree, "-f", "autoware")
    assert "Autoware has a file for each frame that holds others; here in one: a, b" in done.err
    assert "autoware cannot store frames without a pose: 'alone' left out" in done.err
    assert run("lookup", "-", "a", "c", "-f", "json", stdin=done.out).out == run("lookup", tree, "a", "c", "-f", "json").out


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("0.015", "abc", "a.yaml:7:12: 'abc' is not a number"),
        ("1.1", "nan", "a.yaml:3:8: 'nan' is not finite"),
        ("    yaw: -0.0364\n", "", "a.yaml:3:5: missing yaw; a pose has x, y, z, roll, pitch, yaw"),
        ("roll:", "rol:", "a.yaml:6:5: unknown key 'rol'; a pose has x, y, z, roll, pitch, yaw"),
        ("  kit_link:\n", "  kit_link: [1]\n  other:\n", "a.yaml:2:13: expected the pose of 'kit_link' as {x, y, z, roll, pitch, yaw}, found a list"),
        ("1.9", "1,9", "a.yaml:5:8: '1,9' has a decimal comma"),
        ("kit_link", "base_link", "a.yaml:3:5: frame 'base_link' is its own parent"),
    ],
)
def test_what_is_wrong_in_autoware_is_one_placed_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, VEHICLE.replace(old, new, 1), format="autoware")
    assert said in str(caught.value)


def test_check_places_what_it_finds_in_documents_of_other_forms(run: Callable[..., Any]) -> None:
    done = run("check", "a.yaml", "--quiet", files={"a.yaml": VEHICLE + "other:\n  kit_link: {x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: abc}\n  top: {x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}\n"})
    assert "a.yaml:10:56: error: 'abc' is not a number [syntax]" in done.out
    assert "a.yaml:11:8: note: 2 roots" in done.out


ON_HAND = """\
parameters:
  eye_on_hand: true
  robot_base_frame: base_link
  robot_effector_frame: tool0
  tracking_base_frame: camera_link
  tracking_marker_frame: marker
transformation: {qw: 0.5, qx: 0.5, qy: -0.5, qz: 0.5, x: 0.1, y: 0.2, z: 0.3}
"""
SECOND = """\
parameters:
  name: arm
  calibration_type: eye_in_hand
  robot_base_frame: base_link
  robot_effector_frame: tool0
  tracking_base_frame: camera_link
transform:
  translation: {x: 0.1, y: 0.2, z: 0.3}
  rotation: {w: 0.5, x: 0.5, y: -0.5, z: 0.5}
"""
FIRST = ON_HAND.replace("parameters:\n", "").replace("  ", "")


@pytest.mark.parametrize(
    ("text", "parent"),
    [
        (ON_HAND, "tool0"),
        (ON_HAND.replace("true", "false"), "base_link"),
        (SECOND, "tool0"),
        (SECOND.replace("eye_in_hand", "eye_on_base"), "base_link"),
        (FIRST, "tool0"),
    ],
)
def test_a_camera_hangs_where_its_calibration_says(tmp_path: Path, text: str, parent: str) -> None:
    tree = read(tmp_path, text)
    assert tree.frames == (parent, "camera_link")
    assert tree.lookup(parent, "camera_link").components == (0.1, 0.2, 0.3, 0.5, -0.5, 0.5, 0.5)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("true", "yes", "a.yaml:2:16: eye_on_hand must be true or false, found 'yes'"),
        ("  eye_on_hand: true\n", "", "a.yaml:2:3: missing eye_on_hand (easy_handeye) or calibration_type (easy_handeye2)"),
        ("robot_effector_frame", "robot_frame", "a.yaml:2:3: missing robot_effector_frame"),
        ("qw: 0.5", "qw: 0.7", "a.yaml:7:17: quaternion"),
        ("qw: 0.5", "qw: O.5", "a.yaml:7:22: 'O.5' is not a number"),
        ("qw: 0.5, ", "", "missing qw; a pose has x, y, z, qx, qy, qz, qw"),
        ("transformation", "transformatio", "missing transformation (easy_handeye) or transform (easy_handeye2)"),
    ],
)
def test_what_is_wrong_in_a_hand_eye_calibration_is_one_placed_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, ON_HAND.replace(old, new, 1))
    assert said in str(caught.value)


def test_a_hand_eye_calibration_is_written_to_the_same_bits(run: Callable[..., Any]) -> None:
    tree = "{frames: {tool0: {camera: {xyz: [0.1, 1e-17, -3.3333333333333335], rotvec: [0.1, 0.2, 0.3]}}}}"
    written = run("tree", tree, "-f", "handeye")
    assert "handeye: 'tool0' is written as the hand" in written.err
    assert run("tree", "-", "--quiet", stdin=written.out).out == run("tree", tree).out
    several = run("tree", "{frames: {a: {b: {}, c: {}}}}", "-f", "handeye")
    assert (several.status, several.out) == (1, "")
    assert "handeye holds one pose, and here are 2: b, c" in several.err
