"""KITTI's calibrations: which way each matrix points, baselines, rectification, what is refused."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from calibrations import matrix, read
from scipy.spatial.transform import Rotation as Peer

from frametool.errors import FormatError, Unanswered
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from frametool.geometry import Array

FOCAL = 700.0
CAM0_VELO = np.eye(4)
CAM0_VELO[:3, :3], CAM0_VELO[:3, 3] = [[0, -1, 0], [0, 0, -1], [1, 0, 0]], (-0.01, -0.07, -0.3)
VELO_IMU = np.eye(4)
VELO_IMU[:3, :3], VELO_IMU[:3, 3] = Peer.from_euler("z", 0.01).as_matrix(), (-0.8, 0.3, -0.8)
RECT = np.eye(4)
RECT[:3, :3] = Peer.from_euler("xyz", [0.01, -0.02, 0.005]).as_matrix()


def words(matrix: Array) -> str:
    return " ".join(f"{value!r}" for value in matrix.ravel().tolist())


def projection(last: float = 0.0, py: float = 0.0, pz: float = 0.0) -> str:
    return words(np.array([[FOCAL, 0, 600, last], [0, FOCAL, 180, py], [0, 0, 1, pz]]))


ODOMETRY = f"P0: {projection()}\nP1: {projection(-376.0)}\nTr: {words(CAM0_VELO[:3])}\n"
OBJECT = f"P0: {projection()}\nP1: {projection(-376.0)}\nR0_rect: {words(RECT[:3, :3])}\nTr_velo_to_cam: {words(CAM0_VELO[:3])}\nTr_imu_to_velo: {words(VELO_IMU[:3])}\n\n"
RAW = "calib_time: 15-Mar-2012 11:37:16\nR: {}\nT: {}\n"
VELO_TO_CAM = RAW.format(words(CAM0_VELO[:3, :3]), words(CAM0_VELO[:3, 3])) + "delta_f: 0.0 0.0\ndelta_c: 0.0 0.0\n"
IMU_TO_VELO = RAW.format(words(VELO_IMU[:3, :3]), words(VELO_IMU[:3, 3]))
CAM1_CAM0 = np.eye(4)
CAM1_CAM0[:3, :3], CAM1_CAM0[:3, 3] = Peer.from_euler("y", 0.02).as_matrix(), (-0.537, 0.004, -0.01)
CAMERAS = (
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
    f"S_00: 1392 512\nK_00: {words(np.eye(3))}\nD_00: 0.1 0.2 0 0 0\nR_00: {words(np.eye(3))}\nT_00: 0 0 0\nR_rect_00: {words(RECT[:3, :3])}\nP_rect_00: {projection()}\n"
    f"R_01: {words(CAM1_CAM0[:3, :3])}\nT_01: {words(CAM1_CAM0[:3, 3])}\nR_rect_01: {words(RECT[:3, :3].T)}\nP_rect_01: {projection(-376.0)}\n"
)


def test_tr_takes_points_of_the_lidar_to_the_camera(tmp_path: Path) -> None:
    assert matrix(read(tmp_path, ODOMETRY, "calib.txt"), "cam0", "velo") == pytest.approx(CAM0_VELO, abs=1e-15)


def test_a_projection_says_the_baseline_to_the_right(tmp_path: Path) -> None:
    assert read(tmp_path, ODOMETRY, "calib.txt").lookup("cam0", "cam1").components == (376.0 / FOCAL, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def test_a_camera_stands_at_the_whole_centre_of_its_projection(tmp_path: Path) -> None:
    text = f"P0: {projection()}\nP2: {projection(45.0, -0.1, 0.003)}\n"
    found = read(tmp_path, text, "calib.txt").lookup("cam0", "cam2").components[:3]
    assert found == pytest.approx((-0.061714285714, 0.000914285714, -0.003), abs=1e-12)


def test_rectification_stands_between_the_lidar_and_the_projections(run: Callable[..., Any], tmp_path: Path) -> None:
    tree = read(tmp_path, OBJECT, "calib.txt")
    assert matrix(tree, "cam0_rect", "velo") == pytest.approx(RECT @ CAM0_VELO, abs=1e-15)
    assert matrix(tree, "velo", "imu") == pytest.approx(VELO_IMU, abs=1e-15)
    assert matrix(tree, "cam0_rect", "cam1_rect")[0, 3] == pytest.approx(376.0 / FOCAL)
    assert run("tree", "calib.txt").err == "frametool: warning: yaml: intrinsics of cameras left out\n"


def test_raw_files_are_known_by_name_or_by_what_they_hold(tmp_path: Path) -> None:
    assert matrix(read(tmp_path, VELO_TO_CAM, "x.txt"), "cam0", "velo") == pytest.approx(CAM0_VELO, abs=1e-15)
    assert matrix(read(tmp_path, IMU_TO_VELO, "calib_imu_to_velo.txt"), "velo", "imu") == pytest.approx(VELO_IMU, abs=1e-15)
    with pytest.raises(Unanswered, match=r"give --frames cam0,velo .* or velo,imu"):
        read(tmp_path, IMU_TO_VELO, "x.txt")
    assert matrix(read(tmp_path, IMU_TO_VELO, "x.txt", frames=("a", "b")), "a", "b") == pytest.approx(VELO_IMU, abs=1e-15)


def test_raw_files_make_one_tree_in_which_cameras_are_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "calib_velo_to_cam.txt").write_text(VELO_TO_CAM)
    (tmp_path / "calib_imu_to_velo.txt").write_text(IMU_TO_VELO)
    (tmp_path / "calib_cam_to_cam.txt").write_text(CAMERAS)
    tree = load(*(tmp_path / f"calib_{name}.txt" for name in ("velo_to_cam", "imu_to_velo", "cam_to_cam")))
    assert tree.roots == ("cam0",)
    assert matrix(tree, "cam1", "cam0") == pytest.approx(CAM1_CAM0, abs=1e-15)
    assert matrix(tree, "cam1_rect", "imu") == pytest.approx(np.block([[RECT[:3, :3].T, np.zeros((3, 1))], [np.eye(4)[3:]]]) @ CAM1_CAM0 @ CAM0_VELO @ VELO_IMU, abs=2e-15)


def test_frames_are_called_as_told(tmp_path: Path) -> None:
    assert set(read(tmp_path, ODOMETRY, "calib.txt", frames=("left", "right")).frames) == {"left", "right", "velo"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("700.0", "7oo", "calib.txt:1:5: P0: '7oo' has a unit"),
        ("-0.01", "inf", "calib.txt:3:18: Tr: 'inf' is not finite"),
        ("Tr: ", "Tr: 1 ", "calib.txt:3:5: Tr: expected 12 numbers, found 13"),
        ("Tr: 0.0 -1.0", "Tr: 0.5 -1.0", "calib.txt:3:1: Tr: matrix is not a rotation"),
        ("Tr: 0.0 -1.0", "Tr: 0.0 1.0", "calib.txt:3:1: Tr: matrix has determinant -1: it is left-handed"),
        ("P1", "P0", "calib.txt:2:1: P0 appears twice; first in line 1"),
        ("P1: 700.0", "P1: 0.0", "calib.txt:2:1: P1: the focal length 0 is not positive"),
        ("Tr:", "???", "calib.txt:3:1: expected NAME: numbers, found '???"),
    ],
)
def test_what_is_wrong_is_one_placed_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, ODOMETRY.replace(old, new, 1), "calib.txt")
    assert said in str(caught.value)


def test_a_file_cut_off_or_without_a_pose_says_so(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"Tr: expected 12 numbers, found 6"):
        read(tmp_path, ODOMETRY[: ODOMETRY.index("Tr:") + 28], "calib.txt")
    with pytest.raises(FormatError, match="no pose in it"):
        read(tmp_path, f"P0: {projection()}\n", "calib.txt")
    with pytest.raises(FormatError, match="missing T: together with R:"):
        read(tmp_path, VELO_TO_CAM.replace("T: ", "X: "), "calib.txt")
