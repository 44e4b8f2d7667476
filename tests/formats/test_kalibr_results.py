"""Kalibr's results as text: the trap of a baseline's quaternion, directions, checks, what is wrong in them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Peer

from frametool.errors import FormatError
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def matrix(turn: list[float], shift: list[float]) -> Any:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = Peer.from_rotvec(turn).as_matrix(), shift
    return made


CAM0_IMU = matrix([1.2, -1.1, 1.3], [0.02, -0.05, 0.01])
CAM1_CAM0 = matrix([0.01, -0.2, 0.005], [-0.11, 0.002, 0.003])
IMU1_IMU0 = matrix([0.0, 0.0, np.pi / 2], [0.5, 0.0, 0.0])


def printed(numbers: Any) -> str:
    return np.array2string(np.asarray(numbers), precision=8, suppress_small=True)


def baseline(one: int, cam_from_before: Any, indent: str = "") -> str:
    """Return what Kalibr prints of a baseline: it writes JPL's quaternion of the matrix that its camchain holds."""
    jpl = Peer.from_matrix(cam_from_before[:3, :3]).inv().as_quat()
    return (
        f"{indent}baseline T_{one}_{one - 1}:\n{indent}    q: {printed(jpl)} +- [0.0015 0.0003 0.0001]\n"
        f"{indent}    t: {printed(cam_from_before[:3, 3])} +- [0.0001 0.0001 0.0003]\n\n"
    )


HEAD = """\
Calibration results
====================
Camera-system parameters:
cam0 (/cam0/image_raw):
    type: <class 'aslam_cv.libaslam_cv_python.DistortedPinholeCameraGeometry'>
    distortion: [ 0.075 -0.18  0.0009  0.0003] +- [0.005 0.01 0.0005 0.0004]
    reprojection error: [0.000121, -0.000036] +- [0.380177, 0.318709]

"""
TARGET = "\nTarget configuration\n====================\n\n  Type: aprilgrid\n  Tags:\n    Rows: 4\n"
INV = np.linalg.inv


def of_camera(cam: str, cam_imu: Any) -> str:
    return (
        f"Transformation ({cam}):\n-----------------------\nT_ci:  (imu0 to {cam}): \n{printed(cam_imu)}\n\n"
        f"T_ic:  ({cam} to imu0): \n{printed(INV(cam_imu))}\n\n"
        f"timeshift {cam} to imu0: [s] (t_imu = t_cam + shift)\n-0.0025\n\n\n"
    )


BASELINE = f"Baselines:\n----------\nBaseline (cam0 to cam1): \n{printed(CAM1_CAM0)}\nbaseline norm:  0.11 [m]\n\n"
IMUS = (
    f"IMU configuration\n=================\n\nIMU0:\n ----------------------------\n  Model: calibrated\n  T_ib (imu0 to imu0)\n"
    f"{printed(np.eye(4))}\n  time offset with respect to IMU0: 0.0 [s]\n\nIMU1:\n ---\n  T_i_b\n{printed(IMU1_IMU0)}\n"
)
BEGIN = "Calibration results\n===================\nResiduals\n---------\nGyroscope error (imu0) [rad/s]:  mean 0.005\n\n"
IMUCAM = BEGIN + of_camera("cam0", CAM0_IMU) + of_camera("cam1", CAM1_CAM0 @ CAM0_IMU) + BASELINE + IMUS


def close(tree: Any, target: str, source: str, wanted: Any) -> None:
    assert tree.lookup(target, source).as_matrix() == pytest.approx(wanted, abs=3e-8)


@pytest.mark.parametrize("indent", ["", "\t"])
@pytest.mark.parametrize("ends", ["\n", " \n", "\r\n"])
def test_the_quaternion_of_a_baseline_is_that_of_the_inverse(tmp_path: Path, indent: str, ends: str) -> None:
    text = HEAD + baseline(1, CAM1_CAM0, indent) + baseline(2, CAM0_IMU, indent) + TARGET
    (tmp_path / "results-cam.txt").write_bytes(text.replace("\n", ends).encode())
    tree = load(tmp_path / "results-cam.txt")
    assert (tree.roots, tree.frames) == (("cam0",), ("cam0", "cam1", "cam2"))
    close(tree, "cam1", "cam0", CAM1_CAM0)
    close(tree, "cam2", "cam0", CAM0_IMU @ CAM1_CAM0)


def test_the_camchain_of_the_same_rig_says_the_same(tmp_path: Path) -> None:
    blocks = {"cam0": {"T_cam_imu": CAM0_IMU}, "cam1": {"T_cam_imu": CAM1_CAM0 @ CAM0_IMU, "T_cn_cnm1": CAM1_CAM0}}
    text = "".join(
        f"{cam}:\n" + "".join(f"  {key}: {value.tolist()}\n" for key, value in each.items())
        + "  cam_overlaps: [1]\n  distortion_coeffs: [0.1, 0.2, 0.0, 0.0]\n  timeshift_cam_imu: -0.0025\n"
        for cam, each in blocks.items()
    )  # fmt: skip
    (tmp_path / "camchain-imucam.yaml").write_text(text)
    (tmp_path / "results-cam.txt").write_text(HEAD + baseline(1, CAM1_CAM0))
    (tmp_path / "results-imucam.txt").write_text(IMUCAM)
    chain, cam, imucam = (
        load(tmp_path / name) for name in ("camchain-imucam.yaml", "results-cam.txt", "results-imucam.txt")
    )
    for each in (chain, cam, imucam):
        close(each, "cam1", "cam0", CAM1_CAM0)
    for cam_name, wanted in (("cam0", CAM0_IMU), ("cam1", CAM1_CAM0 @ CAM0_IMU)):
        close(chain, cam_name, "imu", wanted)
        close(imucam, cam_name, "imu0", wanted)
    close(imucam, "imu1", "imu0", IMU1_IMU0)
    assert imucam.roots == ("imu0",)


def test_the_report_of_one_camera_says_the_same(tmp_path: Path) -> None:
    text = (
        f"{BEGIN}Transformation T_cam0_imu0 (imu0 to cam0, T_ci): \n{printed(CAM0_IMU)}\n\n"
        f"cam0 to imu0 time: [s] (t_imu = t_cam + shift)\n0.0012\n\n"
        f"T_imu0_cam0 (cam0 to imu0, T_ic): \n{printed(INV(CAM0_IMU))}\n"
    )
    (tmp_path / "report.txt").write_text(text)
    tree = load(tmp_path / "report.txt")
    assert tree.roots == ("imu0",)
    close(tree, "cam0", "imu0", CAM0_IMU)
    (tmp_path / "turned.txt").write_text(text.replace(printed(INV(CAM0_IMU)), printed(CAM0_IMU)))
    with pytest.raises(FormatError, match=r"turned.txt:7: T_cam0_imu0 \(imu0 to cam0\) differs from T_imu0_cam0"):
        load(tmp_path / "turned.txt")


def test_what_it_means_is_told_and_frames_are_called_otherwise(run: Callable[..., Any]) -> None:
    files = {"r.txt": HEAD + baseline(1, CAM1_CAM0)}
    done = run("lookup", "r.txt", "right", "left", "--frames", "left,right", files=files)
    assert done.status == 0
    assert done.err == ""
    assert run("tree", "r.txt", "--frames", "a,b,c", files=files).err == (
        "frametool: --frames names 3 frames, there are 2: cam0, cam1\n"
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + TARGET, "r.txt: no pose in it: it would be under baseline T_1_0 or T_ci"),
        (HEAD + "baseline T_1_0:\n", "r.txt:9: baseline T_1_0: expected q: [x y z w] and t: [x y z] below it"),
        (
            HEAD + "baseline T_1_0:\n  q: [0 0 1]\n  t: [1 2 3]\n",
            "r.txt:9: baseline T_1_0: q: expected 4 numbers, found 3",
        ),
        (
            HEAD + "baseline T_1_0:\n  q: [0 0 0 2]\n  t: [1 2 3]\n",
            "r.txt:9: baseline T_1_0: quaternion 0 0 0 2 has norm 2; a rotation needs norm 1",
        ),
        (
            HEAD + "baseline T_1_0:\n  q: [0 0 0 1]\n  t: [1 nan 3]\n",
            "r.txt:9: baseline T_1_0: 'nan' is not finite",
        ),
        (BEGIN + "T_ci:  (imu0 to cam0): \n", "r.txt:7: T_ci (imu0 to cam0): expected a 4 x 4 matrix below it, found none"),
        (
            BEGIN + "T_ci:  (imu0 to cam0): \n[[1 0 0 0]\n [0 1 0 0]]\n",
            "r.txt:7: T_ci (imu0 to cam0): expected a 4 x 4 matrix below it, found 8 numbers",
        ),
        (
            IMUCAM.replace(printed(INV(CAM0_IMU)), printed(CAM0_IMU)),
            "r.txt:9: T_ci (imu0 to cam0) differs from T_ic (cam0 to imu0) by ",
        ),
    ],
)
def test_what_is_wrong_names_its_line(run: Callable[..., Any], text: str, message: str) -> None:
    done = run("tree", "r.txt", files={"r.txt": text})
    assert (done.status, done.out) == (1, "")
    assert done.err.splitlines()[-1].startswith(f"frametool: {message}")


@pytest.mark.parametrize("arguments", [("r.txt",), ("-i", "r.txt")])
def test_convert_points_to_lookup(run: Callable[..., Any], arguments: tuple[str, ...]) -> None:
    hint = "frames, not a pose; look one up: frametool lookup r.txt TARGET SOURCE"
    assert run("convert", *arguments, files={"r.txt": IMUCAM}).err == f"frametool: r.txt: results of Kalibr as text: {hint}\n"
