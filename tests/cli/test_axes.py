"""Axes of the frame a pose is seen from and of the frame it is the pose of; mirrored ones on both sides at once."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

# rows are the axes of the target in those of the source, written down by hand
CHANGES = {
    "enu_from_ned": [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
    "ned_from_enu": [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
    "frd_from_flu": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "flu_from_frd": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "optical_from_flu": [[0, -1, 0], [0, 0, -1], [1, 0, 0]],
    "flu_from_opencv": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]],
    "opengl_from_opencv": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "unity_from_ros": [[0, -1, 0], [0, 0, 1], [1, 0, 0]],
    "ros_from_unity": [[0, 0, 1], [-1, 0, 0], [0, 1, 0]],
    "unity_from_optical": [[1, 0, 0], [0, -1, 0], [0, 0, 1]],
}
MIRRORS = [name for name, rows in CHANGES.items() if np.linalg.det(rows) < 0]
POSE = {"xyz": [1.5, -2.25, 3.0], "xyzw": Rotation.from_euler("xyz", [0.3, -0.8, 1.9]).as_quat().tolist()}


def homogeneous(rotation: Any, xyz: Any = (0, 0, 0)) -> Any:
    """Write a 4x4 matrix."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, xyz
    return made


def both(world: str, body: str) -> bool:
    """Tell whether the result is a rotation."""
    return (world in MIRRORS) == (body in MIRRORS)


@pytest.mark.parametrize(("world", "body"), [(a, b) for a in CHANGES for b in CHANGES if both(a, b)])
def test_a_pose_p_becomes_w_p_b(run: Run, world: str, body: str) -> None:
    arguments = ["convert", json.dumps(POSE), "--world-axes", world, "--axes", body, "--to", "matrix", "-f", "json"]
    got = np.array(json.loads(run(*arguments).out)["matrix"])
    pose = homogeneous(Rotation.from_quat(POSE["xyzw"]).as_matrix(), POSE["xyz"])
    want = homogeneous(CHANGES[world]) @ pose @ homogeneous(CHANGES[body])
    np.testing.assert_allclose(got, want, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", MIRRORS)
def test_a_mirror_on_one_side_is_refused_with_what_is_none(run: Run, name: str) -> None:
    for arguments in (["--axes", name], ["--world-axes", name], ["--axes", name, "--world-axes", "enu_from_ned"]):
        outcome = run("convert", json.dumps(POSE), *arguments)
        assert (outcome.status, outcome.out) == (2, "")
        assert "--world-axes unity_from_ros --axes ros_from_unity" in outcome.err


def test_a_mirror_is_no_rotation_in_a_document(run: Run) -> None:
    outcome = run("convert", "{axes: unity}")
    assert outcome.status == 1
    assert "left-handed" in outcome.err


@pytest.mark.parametrize(
    ("arguments", "other"),
    [
        (["--axes", "frd_from_flu"], "--world-axes enu_from_ned"),
        (["--world-axes", "enu_from_ned"], "--axes frd_from_flu"),
        (["--axes", "flu_from_frd"], "--world-axes ned_from_enu"),
        (["--world-axes", "ned_from_enu"], "--axes flu_from_frd"),
    ],
)
def test_one_side_of_a_pair_tells_of_the_other(run: Run, arguments: list[str], other: str) -> None:
    assert other in run("convert", json.dumps(POSE), *arguments).err


def test_ned_and_frd_to_enu_and_flu_gives_the_whole_pair(run: Run) -> None:
    sides = ["--world-axes", "enu_from_ned", "--axes", "frd_from_flu"]
    north = run("convert", "{xyz: [10, 20, -3], rpy_deg: [0, 0, 0]}", *sides, "--to", "rpy_deg")
    assert north == (0, "xyz: [20.0, 10.0, 3.0]\nrpy_deg: {roll: 0.0, pitch: 0.0, yaw: 90.0}\n", "")


def test_rows_of_a_table_change_both_sides(run: Run) -> None:
    table = "id,x,y,z,yaw_deg\n7,10,20,-3,0\n"
    outcome = run("convert", "--world-axes", "enu_from_ned", "--axes", "frd_from_flu", "--to", "rpy_deg", stdin=table)
    assert outcome.out == "id,x,y,z,roll_deg,pitch_deg,yaw_deg\n7,20.0,10.0,3.0,0.0,0.0,90.0\n"


def test_a_rotation_alone_gets_no_position(run: Run) -> None:
    assert "xyz" not in run("convert", "{rpy: [0, 0, 1]}", "--world-axes", "enu_from_ned", "--axes", "frd_from_flu").out


@pytest.mark.parametrize(
    ("name", "never"), [("opencvv", "opengl"), ("opencl", "open"), ("openglv", "opencv"), ("openc", "opengl")]
)
def test_a_hint_never_offers_the_opposite_axes(run: Run, name: str, never: str) -> None:
    outcome = run("convert", "--axes", name)
    assert outcome.status == 2
    assert f"did you mean '{never}" not in outcome.err


def test_opencv_is_optical(run: Run) -> None:
    assert run("convert", "--axes", "opencv") == run("convert", "--axes", "optical")


@pytest.mark.parametrize(("name", "both"), [("ixyz", ("rxyz", "sxyz")), ("exyz", ("rxyz", "sxyz"))])
def test_a_hint_about_euler_axes_names_both_readings(run: Run, name: str, both: tuple[str, str]) -> None:
    said = run("convert", "--to", f"euler:{name}").err
    assert f"did you mean {both[0]} (rotating axes, intrinsic) or {both[1]} (static" in said


def test_a_hint_about_an_order_names_both_orders(run: Run) -> None:
    assert "did you mean 'xyzw' or 'wxyz'?" in run("convert", "--from", "xwyz", "1", "0", "0", "0").err
