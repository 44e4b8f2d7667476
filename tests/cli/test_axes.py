"""Axes of the frame a pose is seen from and of the frame it is the pose of; mirrored ones on both sides at once."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

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
    "unreal_from_ros": [[1, 0, 0], [0, -1, 0], [0, 0, 1]],
    "unity_from_unreal": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    "-y,z,x": [[0, -1, 0], [0, 0, 1], [1, 0, 0]],
    "y, +z, x": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
}
# W and B of both sides
SYSTEMS = {
    "aircraft_from_ros": ("ned_from_enu", "flu_from_frd"),
    "ned_from_enu": ("ned_from_enu", "flu_from_frd"),
    "ros_from_aircraft": ("enu_from_ned", "frd_from_flu"),
    "unity_from_ros": ("unity_from_ros", "ros_from_unity"),
    "opengl_from_opencv": ("opengl_from_opencv", "opengl_from_opencv"),
    "blender_from_optical": ("opengl_from_opencv", "opengl_from_opencv"),
}
MIRRORS = [name for name, rows in CHANGES.items() if np.linalg.det(rows) < 0]
LEFT_HANDED = ("unity", "unreal")
POSE = {"xyz": [1.5, -2.25, 3.0], "xyzw": Rotation.from_euler("xyz", [0.3, -0.8, 1.9]).as_quat().tolist()}


def homogeneous(rotation: Any, xyz: Any = (0, 0, 0)) -> Any:
    """Write a 4x4 matrix."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, xyz
    return made


def both(world: str, body: str) -> bool:
    """Tell whether the result is a rotation, and the pose between axes of one hand to begin with."""
    hands = [name in LEFT_HANDED for name in (world.partition("_from_")[2], body.partition("_from_")[0])]
    mirrors = world in MIRRORS, body in MIRRORS
    return mirrors[0] == mirrors[1] and (not mirrors[0] or "," in world + body or hands[0] == hands[1])


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


@pytest.mark.parametrize("name", SYSTEMS)
def test_all_axes_are_both_sides_at_once(run: Run, name: str) -> None:
    world, body = SYSTEMS[name]
    both = run("convert", json.dumps(POSE), "--all-axes", name, "--to", "matrix")
    assert both == run("convert", json.dumps(POSE), "--world-axes", world, "--axes", body, "--to", "matrix")
    line = json.dumps(POSE) + "\n"
    rows = [run("convert", *each, "--to", "matrix", stdin=line).out
            for each in (("--all-axes", name), ("--world-axes", world, "--axes", body))]  # fmt: skip
    assert rows[0] == rows[1]


@pytest.mark.parametrize("letters", ["x,-y,-z", "-y,z,x", "z,-x,-y", "y,x,z"])
def test_axes_of_ones_own_on_both_sides_are_w_p_and_the_inverse_of_w(run: Run, letters: str) -> None:
    got = json.loads(run("convert", json.dumps(POSE), "--all-axes", letters, "--to", "matrix", "-f", "json").out)
    w = homogeneous([[(each[-1] == axis) * (-1 if "-" in each else 1) for axis in "xyz"] for each in letters.split(",")])
    pose = homogeneous(Rotation.from_quat(POSE["xyzw"]).as_matrix(), POSE["xyz"])
    np.testing.assert_allclose(got["matrix"], w @ pose @ w.T, rtol=0, atol=1e-14)


@pytest.mark.parametrize("there", ["unity_from_ros", "unreal_from_unity", "aircraft_from_unreal", "optical_from_aircraft"])
def test_there_and_back_is_the_same_pose(run: Run, there: str) -> None:
    target, _, source = there.partition("_from_")
    out = run("convert", json.dumps(POSE), "--all-axes", there, "-f", "json").out
    back = json.loads(run("convert", out, "--all-axes", f"{source}_from_{target}", "--to", "xyzw", "-f", "json").out)
    (xyz,) = (np.array(back[key]) / size for key, size in (("xyz", 1.0), ("xyz_cm", 100.0)) if key in back)
    np.testing.assert_allclose([*xyz, *back["xyzw"]], [*POSE["xyz"], *POSE["xyzw"]], rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--world-axes", "unity_from_ros", "--axes", "unity_from_ros"],
         "on the right of the pose, so beside --world-axes unity_from_ros it is --axes ros_from_unity"),
        (["--all-axes", "unity"], "--all-axes: 'unity' is one end of a change; give A_from_B, as unity_from_ros"),
        (["--all-axes", "x,x,-y"],
         "--all-axes: 'x,x,-y' is not a set of axes: x, y and z once each, with their signs, as x,-y,-z"),
        (["--all-axes", "unity_from_ros", "--axes", "flu_from_frd"],
         "--all-axes and --axes exclude each other"),
        (["--axes", "optical_from_blendr"],
         "'blender'? axes: flu, frd, optical, opengl, enu, ned, unity, unreal, ros, aircraft, opencv, blender, or "),
    ],
)  # fmt: skip
def test_what_is_no_change_of_axes_is_told_with_what_is(run: Run, arguments: list[str], said: str) -> None:
    outcome = run("convert", json.dumps(POSE), *arguments)
    assert (outcome.status, outcome.out) == (2, "")
    assert said in outcome.err


def test_unreal_counts_in_centimetres(run: Run) -> None:
    pose = "{xyz: [1.1, -2, 3.0e-7], rpy_deg: [0, 0, 90]}"
    there = run("convert", pose, "--all-axes", "unreal_from_ros", "--to", "rpy_deg")
    assert there.out == "xyz_cm: [110.0, 200.0, 3.0e-05]\nrpy_deg: {roll: 0.0, pitch: 0.0, yaw: -90.0}\n"
    assert there.err == (
        "frametool: note: Unreal counts in centimetres: xyz is written as xyz_cm\n"
        "frametool: warning: rpy is not what Unreal calls its angles; rpy_unreal is\n"
    )
    back = run("convert", there.out, "--all-axes", "ros_from_unreal", "--to", "rpy_deg")
    assert back.out == "xyz: [1.1, -2.0, 3.0e-07]\nrpy_deg: {roll: 0.0, pitch: 0.0, yaw: 90.0}\n"
    rows = run("convert", "--all-axes", "unreal_from_ros", stdin="x_cm,y_cm,z_cm\n100,2,3\n")
    assert rows.out == "x_cm,y_cm,z_cm\n100.0,-2.0,3.0\n"
    assert "stays in metres, or in the unit its name says" in rows.err


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


@pytest.mark.parametrize("yaw", [-180.0, -90.0, -1e-15, 0.0, 30.0, 90.0, 180.0])
def test_a_heading_is_clockwise_from_north(run: Run, yaw: float) -> None:
    forward = (math.cos(math.radians(yaw)), math.sin(math.radians(yaw)))
    for axes, (north, east) in {"enu": forward[::-1], "ned": forward}.items():
        there = run("convert", f"{{rpy_deg: [9, 20, {yaw!r}]}}", "--to", f"heading_deg:{axes},heading:{axes}", "-f", "json")
        found = json.loads(there.out)
        assert 0.0 <= found["heading_deg"] < 360.0
        assert math.radians(found["heading_deg"]) == pytest.approx(found["heading"], abs=1e-12)
        assert (math.cos(found["heading"]), math.sin(found["heading"])) == pytest.approx((north, east), abs=1e-12)
        back = run("convert", "--from", f"heading:{axes}", repr(found["heading"]), "--to", f"heading:{axes}", "-f", "json")
        assert json.loads(back.out)["heading"] == pytest.approx(found["heading"], abs=1e-12)


def test_the_axes_of_a_heading_are_stated_once_and_alike_everywhere(run: Run) -> None:
    pose, to = "{rpy_deg: [0, 0, 30]}", ("--to", "heading_deg", "-f", "json")
    assert "heading_deg:enu (x east, y north, z up) or heading_deg:ned" in run("convert", pose, *to).err
    for change in (["--world-axes", "ned_from_enu"], ["--all-axes", "aircraft_from_ros"]):
        assert json.loads(run("convert", pose, *change, *to).out) == pytest.approx({"heading_deg": 60.0})
        assert run("convert", pose, *change, "--to", "heading_deg:enu").status == 1
    place = "{lat: 48, lon: 11, alt: 0, axes: ned, rpy_deg: [0, 0, 33]}"
    assert json.loads(run("convert", place, "--to", "lla,heading_deg", "-f", "json").out)["heading_deg"] == pytest.approx(33.0)
    assert "and not in axes 'grid'" in run("convert", place, "--to", "utm,heading_deg").err
    rows, names = "1,2,3,0,0,1\n" * 99, "x,y,z,{}\n"
    done = run("convert", "--to", "heading:enu", stdin=names.format("roll,pitch,yaw") + rows)
    assert done.out == names.format("heading") + rows.replace("0,0,1", repr(math.pi / 2 - 1))


LOG = "stamp,x,y,z,qx,qy,qz,qw,{}\n1,1,2,-3,0,0,0,1,4,5,6\n"


ENU, FLU = [5.0, 4.0, -6.0], [4.0, -5.0, -6.0]  # of 4, 5, 6 in ned and in frd
NAMES = {
    "vx,vy,vz": ENU, "vx [m/s],vy [m/s],vz [m/s]": ENU, "vx_mps,vy_mps,vz_mps": ENU,
    "wx,wy,wz": FLU, "body_vx,body_vy,body_vz": FLU, "Body.wx (rad/s),Body.wy (rad/s),Body.wz (rad/s)": FLU,
}  # fmt: skip


@pytest.mark.parametrize("names", NAMES)
@pytest.mark.parametrize("form", ["csv", "json", "npy"])
def test_velocities_turn_with_the_world_and_rates_with_the_body(run: Any, tmp_path: Path, names: str, form: str) -> None:
    text, changes = LOG.format(names), (["--world-axes", "enu_from_ned"], ["--axes", "frd_from_flu"])
    done = run("convert", *changes[0], *changes[1], "-o", str(tmp_path / f"a.{form}"), stdin=text)
    assert (done.status, done.err.count("are along the axes of the world")) == (0, NAMES[names] is ENU)
    found = run("convert", "-i", str(tmp_path / f"a.{form}"), "--to", "quaternion", "-f", "json").out
    assert [json.loads(found)[name] for name in names.split(",")] == NAMES[names]
    one_side = run("convert", *changes[NAMES[names] is ENU], stdin=text)
    assert one_side.out.splitlines()[1].rsplit(",", 3)[1:] == ["4.0", "5.0", "6.0"]


@pytest.mark.parametrize(("names", "change"), [("vx,vy,speed", "ros_from_aircraft"), ("vx,vy,vz", "unity_from_ros")])
def test_velocities_that_cannot_turn_are_told_to_stay(run: Any, names: str, change: str) -> None:
    text = LOG.format(names)
    done = run("convert", "--all-axes", change, stdin=text)
    assert (done.status, done.err.count("keep to the old axes: poses and covariances turn alone")) == (0, 1)
    assert done.out.splitlines()[1].endswith(",4,5,6")
    assert "old axes" not in run("convert", "--to", "rpy", stdin=text).err
    assert "old axes" not in run("convert", "--all-axes", "ros_from_aircraft", stdin=LOG.format("a,b,c")).err


def test_velocities_of_points_turn_with_the_world_and_stay_where_points_move(run: Any) -> None:
    text = "t,x,y,z,vx,vy,vz\n1,9,5,-2,3,4,0\n"
    assert run("convert", "--all-axes", "ros_from_aircraft", stdin=text).out.splitlines()[1] == "1,5.0,9.0,2.0,4.0,3.0,0.0"
    moved = run("apply", "--transform", "{rpy_deg: [0, 0, 90]}", stdin=text)
    assert (moved.status, moved.out.splitlines()[1]) == (0, "1,-5.0,9.0,-2.0,3,4,0")
    assert "vx, vy, vz stay as they are: points and poses move; --columns vx,vy,vz --as vector turns velocities" in moved.err
    turned = run("apply", "--transform", "{rpy_deg: [0, 0, 90]}", "--columns", "vx,vy,vz", "--as", "vector", stdin=text)
    assert (turned.out.splitlines()[1], turned.err) == ("1,9,5,-2,-4.0,3.0,0.0", "")


def test_velocities_that_stay_are_told_with_their_units_and_whether_they_can_turn(run: Any) -> None:
    units = run("apply", "--transform", "{rpy_deg: [0, 0, 90]}", stdin="x,y,z,vx [m/s],vy [m/s],vz [m/s]\n9,5,-2,3,4,0\n")
    assert "vx [m/s], vy [m/s], vz [m/s] stay as they are: points and poses move; --columns vx [m/s],vy [m/s],vz [m/s]" in units.err
    two = run("apply", "--transform", "{rpy_deg: [0, 0, 90]}", stdin="x,y,z,vx,vy\n9,5,-2,3,4\n")
    assert two.err == "frametool: warning: stdin: vx, vy stay as they are: points and poses move\n"


@pytest.mark.parametrize("form", ["json", "csv"])
@pytest.mark.parametrize(
    ("record", "told"),
    [
        ('{"x": 1, "y": 2, "z": 3, "vx": 1, "vy": 2, "vz": 3}', "1:32: vx, vy, vz stay as they are"),
        ('{"frame": "map", "point": [1, 2, 3], "velocity": [1, 2, 3]}', "1:50: velocity stays as it is"),
        ('{"pose": {"xyz": [1, 2, 3]}, "wx": 1}', "1:36: wx stays as it is"),
    ],
)
def test_velocities_beside_the_point_or_pose_of_a_record_stay_and_are_told_once(
    run: Any, record: str, told: str, form: str
) -> None:
    few, many = (run("apply", "--transform", "{xyz: [1, 0, 0]}", "-f", form, stdin=f"{record}\n" * count) for count in (2, 50))
    lines = [line for line in few.err.splitlines() if "frame 'map'" not in line]
    assert lines == [f"frametool: warning: stdin:{told}: points and poses move"]
    assert many.err == few.err


@pytest.mark.parametrize("keys", ['"vx": 1, "vy": 2, "vz": 3', '"velocity": [1, 2, 3]', '"angular_velocity": [1, 2, 3]'])
def test_records_do_not_keep_velocities_in_the_old_axes(run: Any, keys: str) -> None:
    line = f'{{"xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1], {keys}}}\n'
    for many in (1, 40):
        done = run("convert", "--all-axes", "ros_from_aircraft", stdin=line * many)
        assert (done.status, "would keep to the old axes" in done.err) == (1, True)
        assert run("convert", "--to", "rpy", stdin=line * many).status == 0


def test_a_whole_log_turns_in_one_command(run: Any) -> None:
    entries = [f"c{row}{column}" for row in range(1, 7) for column in range(1, 7)]
    variances = [1e-4 * (row + 1) * (row == column) for row in range(6) for column in range(6)]
    header, row = LOG.format("vx,vy,vz").splitlines()
    text = f"{header},{','.join(entries)},wx,wy,wz,mode\n{row},{','.join(map(repr, variances))},7,8,9,auto\n"
    done = run("convert", "--all-axes", "ros_from_aircraft", "--to", "rpy_deg", "-f", "csv", stdin=text)
    found = dict(zip(*(line.split(",") for line in done.out.splitlines()), strict=True))
    numbers: dict[str, float] = {"x": 2, "y": 1, "z": 3, "yaw_deg": 90, "vx": 5, "vy": 4, "vz": -6, "wx": 7, "wy": -8, "wz": -9}
    numbers |= {"c11": 2e-4, "c22": 1e-4, "c33": 3e-4, "c44": 5e-4, "c55": 4e-4, "c66": 6e-4, "c12": 0, "roll_deg": 0, "pitch_deg": 0}
    assert {name: float(found[name]) for name in numbers} == pytest.approx(numbers)
    assert found["mode"] == "auto"
    kept = run("convert", "--all-axes", "ros_from_aircraft", "--keep", "--prefix", "n_", stdin=LOG.format("vx,vy,vz")).out
    found = dict(zip(*(line.split(",") for line in kept.splitlines()), strict=True))
    assert [found[name] for name in ("vx", "vy", "vz", "n_vx", "n_vy", "n_vz")] == ["4", "5", "6", "5.0", "4.0", "-6.0"]
