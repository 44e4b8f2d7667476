"""Trajectories: every form read as a frame that moves and as a stream, and written in every other, against a second implementation."""

from __future__ import annotations

import json
import random
import re
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.errors import FrametoolWarning, ValueInvalid
from frametool.formats.load import load
from frametool.formats.table import FORMATS, is_trajectory, writers

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

CHILD = {"kitti": "cam0", "colmap": "camera", "nerf": "camera"}
WRITTEN = tuple(name for name in writers("trajectory") if name != "csv")
TIMED = ("tum", "euroc", "csv")
OPTICAL_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
START = 1403636579763555584


def matrices(count: int, seed: int = 7) -> np.ndarray:
    """Return poses (n, 4, 4) from random quaternions, by the textbook formula."""
    draw = np.random.default_rng(seed)
    x, y, z, w = (q := draw.normal(size=(4, count))) / np.sqrt((q * q).sum(axis=0))
    made = np.zeros((count, 4, 4))
    made[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], 1)
    made[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], 1)
    made[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], 1)
    made[:, :3, 3] = draw.normal(size=(count, 3)) * 10
    made[:, 3, 3] = 1.0
    return made


def quaternion(matrix: np.ndarray) -> list[float]:
    """Return x, y, z, w by the eigenvector of the largest eigenvalue (Bar-Itzhack 2000)."""
    r = matrix[:3, :3]
    k = np.array([
        [r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
        [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
        [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)],
    ])  # fmt: skip
    vector = np.linalg.eigh(k / 3)[1][:, -1]
    return list(vector * (1 if vector[3] >= 0 else -1))


def words(numbers: Any) -> str:
    return " ".join(map(repr, map(float, numbers)))


def stamp(index: int) -> int:
    return START + index * 50_000_001


def text_of(form: str, poses: np.ndarray) -> str:
    """Write poses of a thing in the world in a form, as its documentation says and nothing of ours does."""
    inverse = [np.linalg.inv(pose) for pose in poses]
    xyzw = [quaternion(pose) for pose in poses]
    if form == "tum":
        seconds = [f"{stamp(at) // 10**9}.{stamp(at) % 10**9:09d}" for at in range(len(poses))]
        return "".join(f"{at} {words(pose[:3, 3])} {words(turn)}\n" for at, pose, turn in zip(seconds, poses, xyzw, strict=True))
    if form in ("euroc", "csv"):
        head = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
        head = head if form == "euroc" else "stamp_ns,x,y,z,qw,qx,qy,qz"
        rows = [[*pose[:3, 3], turn[3], *turn[:3]] for pose, turn in zip(poses, xyzw, strict=True)]
        return head + "\n" + "".join(f"{stamp(at)},{words(row).replace(' ', ',')}\n" for at, row in enumerate(rows))
    if form == "kitti":
        return "".join(f"{words(pose[:3].ravel())}\n" for pose in poses)
    if form == "colmap":
        lines = [[*np.roll(quaternion(pose), 1), *pose[:3, 3]] for pose in inverse]
        return "# Image list with two lines of data per image:\n" + "".join(
            f"{at + 1} {words(line)} 1 a {at}.jpg\n{'1 2 3' if at % 2 else ''}\n" for at, line in enumerate(lines)
        )
    if form == "nerf":
        frames = [{"file_path": f"{at}.png", "transform_matrix": pose.tolist()} for at, pose in enumerate(poses)]
        return json.dumps({"camera_angle_x": 0.7, "frames": frames})
    rows = [[*pose[:3, 3], *turn] for pose, turn in zip(poses, xyzw, strict=True)]
    edge = "EDGE_SE3:QUAT 0 1 9 9 9 0 0 0 1 " + "1 " * 21
    return "".join(f"VERTEX_SE3:QUAT {at} {words(row)}\n" for at, row in enumerate(rows)) + edge + "\nFIX 0\n"


FORMS = ("tum", "euroc", "csv", "kitti", "colmap", "nerf", "g2o")


def samples_of(path: Path | str, **options: Any) -> tuple[np.ndarray, list[int]]:
    """Return the poses (n, 4, 4) of the one frame that moves, and the stamps."""
    (track,) = load(path, **options).tracks()
    found, stamps = [], []
    for stamp_ns, _, (*position, x, y, z, w) in track.walk():
        pose = np.eye(4)
        pose[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]  # fmt: skip
        pose[:3, 3] = position
        found.append(pose)
        stamps.append(stamp_ns or 0)
    return np.array(found), stamps


@pytest.mark.parametrize("form", FORMS)
def test_a_trajectory_is_a_frame_that_moves(form: str, tmp_path: Path) -> None:
    poses = matrices(20)
    (tmp_path / "file").write_text(text_of(form, poses))
    frames = load(tmp_path / "file", format="csv" if form == "csv" else None)
    assert set(frames.frames) == {"world", CHILD.get(form, "body")}
    found, stamps = samples_of(tmp_path / "file", format="csv" if form == "csv" else None)
    assert abs(found - poses).max() < 1e-12
    first = {"colmap": 1}.get(form, 0)
    assert stamps == [stamp(at) if form in TIMED else (at + first) * 10**9 for at in range(20)]


@pytest.mark.parametrize("source", [form for form in FORMS if form != "csv"])
@pytest.mark.parametrize("target", [*WRITTEN, "csv", "json", "yaml", "ros2"])
def test_any_trajectory_comes_out_in_any_form(source: str, target: str, run: Run, tmp_path: Path) -> None:
    poses = matrices(9)
    done = run("convert", "-i", "file", "-f", target, "-o", "out", "--quiet", files={"file": text_of(source, poses)})
    assert (done.status, done.out) == (0, "")
    axes = {"nerf": "opengl", "tum": "", "euroc": "", "g2o": ""}
    wanted = {"nerf": "opengl", "kitti": "optical", "colmap": "optical"}.get(target, "")
    is_turned = wanted and axes.get(source, "optical") not in ("", wanted)
    expected = poses @ OPTICAL_FROM_OPENGL if is_turned else poses
    assert ("camera axes turned" in done.err) == bool(is_turned)
    if target in ("json", "yaml", "ros2"):
        back = run("convert", "-i", "out", "--in", "yaml" if target == "ros2" else target, "-f", "tum", "-o", "out2")
        assert back.status == 0
    found, stamps = samples_of(tmp_path / ("out2" if target in ("json", "yaml", "ros2") else "out"), format="csv" if target == "csv" else None)
    assert abs(found - expected).max() < 1e-12
    if source in TIMED and target in (*TIMED, "json", "yaml", "ros2"):
        assert stamps == [stamp(at) for at in range(9)]


@pytest.mark.parametrize("form", WRITTEN)
def test_what_is_written_reads_back_to_the_same_bits_and_is_written_the_same_in_bulk(form: str, run: Run, tmp_path: Path) -> None:
    poses = matrices(5)
    bulk = run("convert", "-f", form, "--in", "tum", stdin=text_of("tum", poses)).out
    single = run("tree", "-", "-f", form, "--in", "tum", stdin=text_of("tum", poses)).out
    assert single == bulk
    again = run("convert", "-i", "a", "-f", form, files={"a": bulk})
    assert again.status == 0
    if form in ("tum", "euroc", "g2o"):
        assert again.out == bulk
    (tmp_path / "b").write_text(again.out)
    first, second = samples_of(tmp_path / "a")[0], samples_of(tmp_path / "b")[0]
    assert abs(first - second).max() < 2e-14


def test_round_the_forms_and_back_keeps_the_trajectory(run: Run, tmp_path: Path) -> None:
    way = ("tum", "euroc", "kitti", "tum", "colmap", "g2o", "colmap", "nerf", "csv", "tum")
    poses = matrices(30)
    (tmp_path / "0").write_text(text_of("tum", poses))
    for at, (source, target) in enumerate(pairwise(way)):
        told = ("--in", "csv") if source == "csv" else ()
        assert run("convert", "-i", str(at), *told, "-f", target, "-o", str(at + 1)).status == 0
    found, _ = samples_of(tmp_path / "9")
    assert abs(found @ OPTICAL_FROM_OPENGL - poses).max() < 1e-11  # COLMAP's axes are optical, NeRF's are not


def test_evo_reads_what_is_written_and_agrees(run: Run, tmp_path: Path) -> None:
    evo = pytest.importorskip("evo.tools.file_interface")
    poses = matrices(50)
    (tmp_path / "a.tum").write_text(text_of("tum", poses))
    readers = {"tum": evo.read_tum_trajectory_file, "euroc": evo.read_euroc_csv_trajectory, "kitti": evo.read_kitti_poses_file}
    for form, read in readers.items():
        run("convert", "-i", "a.tum", "-f", form, "-o", form)
        assert abs(np.array(read(str(tmp_path / form)).poses_se3) - poses).max() < 1e-9


# --- direction and axes, each with a number that the other reading would not give ---


def test_colmap_holds_the_world_in_the_camera_so_that_the_centre_is_minus_r_transposed_t(run: Run) -> None:
    # a quarter turn about z: R' (1, 2, 3) = (2, -1, 3)
    text = "# Image list with two lines of data per image:\n7 0.7071067811865476 0 0 0.7071067811865476 1 2 3 1 a b.jpg\n\n"
    done = run("convert", "-f", "json", "--to", "rpy_deg", stdin=text)
    found = json.loads(done.out)
    assert np.allclose(found["xyz"], [-2.0, 1.0, -3.0])
    assert (round(found["rpy_deg"]["yaw"], 9), found["image"], found["stamp_ns"]) == (-90.0, "a b.jpg", 7 * 10**9)


def test_the_list_of_frames_of_a_rig_holds_the_world_in_the_rig(run: Run) -> None:
    text = "# Frame list with one line of data per frame:\n1 1 1 0 0 0 0 0 3 2 CAMERA 1 1 CAMERA 2 2\n2 1 1 0 0 0 0 0 4 0\n"
    assert run("lookup", "-", "world", "camera", "-f", "tum", stdin=text).out == (
        "1.000000000 0.0 0.0 -3.0 0.0 0.0 0.0 1.0\n2.000000000 0.0 0.0 -4.0 0.0 0.0 0.0 1.0\n"
    )


# --- axes of cameras ---

AXES = {"nerf": "opengl", "kitti": "optical", "colmap": "optical"}
INTO = {**{form: AXES[form] for form in ("nerf", "kitti", "colmap")}, "tum": "", "csv": ""}
WAYS: dict[str, tuple[str, ...]] = {
    "convert": ("convert", "-i", "file"), "apply": ("apply", "--transform", "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}", "-i", "file"),
    "relative": ("relative", "--first", "-i", "file"), "mean": ("mean", "-i", "file"),
    "tree": ("tree", "file"), "lookup": ("lookup", "file", "w", "c", "--frames", "w,c"),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("target", INTO)
@pytest.mark.parametrize("source", [*AXES, "tum", "csv"])
def test_stated_axes_override_those_of_the_form_and_turn_nothing_by_themselves(source: str, target: str, way: str, run: Run, tmp_path: Path) -> None:
    poses = matrices(5)
    if way == "tree" and target == "csv":
        return  # of a tree, CSV is a report too

    def written(*options: str) -> tuple[Any, str]:
        chosen = ("--in", "csv") if source == "csv" else ()
        done = run(*WAYS[way], "-f", target, "-o", "out", "--force", *chosen, *options, files={"file": text_of(source, poses)})
        assert done.status == 0, done.err
        text = (tmp_path / "out").read_text()
        if target == "csv":
            text = run("convert", "-i", "out", "--in", "csv", "--columns", "x,y,z,qx,qy,qz,qw", "-f", "tum").out
        (tmp_path / "read").write_text(text)
        return samples_of(tmp_path / "read")[0], done.err

    plain, _ = written()
    usual = AXES.get(source) or INTO[target] or "optical"
    if source not in AXES and not INTO[target]:  # neither knows of cameras
        done = run(*WAYS[way], "-f", target, "--camera-axes", "opengl", *(("--in", "csv") if source == "csv" else ()))
        assert (done.status, done.out) == (2, "")
        assert "--camera-axes has no effect here" in done.err
        return
    for stated in ("optical", "opengl"):
        found, told = written("--camera-axes", stated)
        turn = OPTICAL_FROM_OPENGL if INTO[target] and stated != usual else np.eye(4)
        expected = (turn @ plain if way == "relative" else plain) @ turn
        assert abs(found - expected).max() < 1e-12, stated
        assert ("camera axes turned" in told) == (INTO[target] not in ("", stated)), told


@pytest.mark.parametrize("source", AXES)
def test_what_is_seen_from_another_camera_turns_on_both_sides(source: str, run: Run, tmp_path: Path) -> None:
    files = {"file": text_of(source, matrices(5))}
    target = "nerf" if AXES[source] == "optical" else "kitti"
    assert run("relative", "--first", "-i", "file", "-f", target, "-o", "one", files=files).status == 0
    assert run("convert", "-i", "file", "-f", target, "-o", "turned").status == 0
    assert run("relative", "--first", "-i", "turned", "-f", target, "-o", "two").status == 0
    one, two = (samples_of(tmp_path / name)[0] for name in ("one", "two"))
    assert abs(one - two).max() < 1e-12
    assert abs(one[0] - np.eye(4)).max() < 1e-12


def test_axes_that_a_change_of_axes_has_turned_are_not_turned_again(run: Run) -> None:
    text = text_of("nerf", matrices(3))
    by_hand = run("convert", "--axes", "optical_from_opengl", "-f", "kitti", stdin=text)
    assert by_hand.out == run("convert", "-f", "kitti", stdin=text).out


def test_cameras_of_robots_and_of_calibrations_have_axes_too(run: Run) -> None:
    robot = '<mujoco><worldbody><camera name="c"/></worldbody></mujoco>'
    assert "turned from opengl to optical" in run("lookup", "-", "world", "camera:c", "-f", "kitti", stdin=robot).err
    calib = "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n"
    assert "turned from optical to opengl" in run("lookup", "-", "velo", "cam0", "-f", "nerf", stdin=calib).err


def test_in_python_stated_axes_turn_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text(text_of("nerf", matrices(1)))
    plain, stated = load(tmp_path / "file"), load(tmp_path / "file", camera_axes="optical")
    assert (plain.camera_axes, stated.camera_axes) == ({"camera": "opengl"}, {"camera": "optical"})
    assert plain.lookup("world", "camera").is_close(stated.lookup("world", "camera"), angle=0.0, distance=0.0)
    with pytest.raises(ValueInvalid, match="camera_axes is optical or opengl, not 'upright'"):
        load(tmp_path / "file", camera_axes="upright")
    (tmp_path / "tree.yaml").write_text("frames: {map: {base: {xyz: [1, 2, 3]}}}")
    with pytest.warns(FrametoolWarning, match="camera_axes has no effect: yaml specifies this itself"):
        load(tmp_path / "tree.yaml", camera_axes="optical")


# ---


def test_the_quaternion_of_euroc_begins_with_w(run: Run) -> None:
    row = f"{START},1,2,3,0.5,0.5,0.5,-0.5\n"
    done = run("convert", "-f", "tum", stdin=row + row.replace("584,", "585,"))
    assert done.out.splitlines()[1] == "1403636579.763555585 1.0 2.0 3.0 0.5 0.5 -0.5 0.5"


def test_the_edges_of_a_graph_are_poses_of_one_vertex_in_another(run: Run) -> None:
    information = " 1" * 21
    text = f"VERTEX_SE2 0 9 9 0\nVERTEX_SE2 1 9 9 0\nEDGE_SE3:QUAT 0 1 1 2 3 0 0 0 1{information}\nEDGE_SE2 1 0 1 2 0.5 1 0 0 1 0 1\n"
    done = run("convert", "--edges", "-f", "json", stdin=text)
    found = [json.loads(line) for line in done.out.splitlines()]
    assert [(each["parent"], each["name"], each["xyz"]) for each in found] == [("0", "1", [1.0, 2.0, 3.0]), ("1", "0", [1.0, 2.0, 0.0])]
    assert "stamp_ns" not in found[0]
    bad = run("convert", "--edges", "-f", "json", stdin=text.replace(information, " 1"))
    assert (bad.status, "stdin:3: expected EDGE_SE3:QUAT i j x y z qx qy qz qw" in bad.err) == (1, True)


# --- KITTI ---


def test_kitti_takes_its_times_from_a_file(run: Run) -> None:
    files = {"00.txt": text_of("kitti", matrices(3)), "times.txt": "0.000000e+00\n1.036224e-01\n2.072888e-01\n"}
    done = run("convert", "-i", "00.txt", "--stamps", "times.txt", "-f", "tum", files=files)
    assert [line.split()[0] for line in done.out.splitlines()] == ["0.000000000", "0.103622400", "0.207288800"]
    found = run("lookup", "00.txt", "world", "cam0", "--stamps", "times.txt", "-f", "json")
    assert json.loads(found.out)["stamp_ns"] == 207288800


@pytest.mark.parametrize("rows", [2, 30000])
def test_a_row_that_is_skipped_takes_its_time_with_it(rows: int, run: Run) -> None:
    good, bad = "1 0 0 1 0 1 0 2 0 0 1 3\n", "1 0 0 x 0 1 0 2 0 0 1 3\n"
    files = {"kitti.txt": (good + bad + "\n") * rows, "times.txt": "".join(f"{at}.5\n" for at in range(2 * rows))}
    command = ("convert", "-i", "kitti.txt", "--in", "kitti", "-f", "tum", "--on-error", "skip")
    for times, half in ((("--stamps", "times.txt"), 0.5), ((), 0.0)):
        done = run(*command, *times, files=files)
        assert done.status == 3
        assert [float(line.split()[0]) for line in done.out.splitlines()] == [2 * at + half for at in range(rows)]


@pytest.mark.parametrize(("times", "said"), [("0\n1\n", "2 times are too few"), ("0\n1\n2\n3\n", "4 times for the 3 poses"), ("0\nx\n2\n", "times.txt:2: 'x'")])
@pytest.mark.parametrize("form", ["kitti", "g2o"])
def test_times_that_do_not_fit_are_refused(form: str, times: str, said: str, run: Run) -> None:
    files = {"poses": text_of(form, matrices(3)), "times.txt": times}
    for command in (("tree", "poses"), ("convert", "-i", "poses", "-f", "csv")):
        done = run(*command, "--stamps", "times.txt", files=files)
        assert (done.status, said in done.err) == (1, True), done.err


def test_rough_matrices_are_projected_with_one_warning(run: Run) -> None:
    poses = matrices(4)
    poses[1:3, 0, 1] += 2e-7
    for command in (("tree", "-"), ("convert", "-f", "tum"), ("convert",)):
        done = run(*command, stdin=text_of("kitti", poses))
        assert done.err.count("the matrices are orthonormal only to") == 1
    u, _, v = np.linalg.svd(poses[1, :3, :3])
    x, y, z, w = quaternion(u @ v)
    row = run("convert", "-f", "tum", stdin=text_of("kitti", poses)).out.splitlines()[1].split()
    assert np.allclose([float(each) for each in row[4:]], [x, y, z, w], rtol=0, atol=1e-14)


# --- what is told ---


def test_what_was_taken_for_granted_is_told_on_one_short_line(run: Run) -> None:
    for form in FORMS:
        done = run("lookup", "file", "world", CHILD.get(form, "body"), *["--camera-axes", "optical"] * (form in AXES), "--in", "csv" if form == "csv" else form.removesuffix("-json"), files={"file": text_of(form, matrices(3))})
        (line,) = (line for line in done.err.splitlines() if "3 poses of" in line)
        assert len(line) <= 200
        assert "in world (--frames)" in line
        quiet = run("lookup", "file", "world", CHILD.get(form, "body"), "--quiet", "--in", "csv" if form == "csv" else form.removesuffix("-json"))
        assert quiet.err == ""


def test_the_frames_are_called_as_told(run: Run) -> None:
    files = {"a.tum": text_of("tum", matrices(3)), "b.kitti": text_of("kitti", matrices(3))}
    done = run("tree", "a.tum", "--with", "b.kitti", "--frames", "map,a", "--frames", "map,b", "-f", "json", files=files)
    assert [entry.get("name") for entry in json.loads(done.out)["frames"]] == ["map", "a", "b"]


def test_rough_quaternions_are_told_once(run: Run) -> None:
    text = "0 1 2 3 0 0 0 1.0005\n1 1 2 3 0 0 0 1.0004\n2 1 2 3 0 0 0 1\n"
    done = run("tree", "-", stdin=text)
    assert done.err.count("warning") == 1
    assert "2 quaternions were off norm 1" in done.err


def test_what_a_form_cannot_hold_is_told_once(run: Run) -> None:
    text = "stamp,parent,name,x,y,z,qx,qy,qz,qw,tag\n" + "".join(f"{at},map,base,1,2,3,0,0,0,1,x\n" for at in range(9))
    told = run("convert", "-f", "kitti", "--in", "csv", stdin=text).err
    assert told.count("warning") == 1
    assert "kitti: names of frames, stamps, tag left out" in told
    assert "axes of the poses are taken for optical" in told


def test_several_frames_are_no_trajectory(run: Run) -> None:
    tree = "{frames: {map: {a: {xyz: [1, 0, 0]}, b: {xyz: [2, 0, 0]}}}}"
    done = run("tree", "-", "-f", "tum", stdin=tree)
    assert (done.status, done.out) == (1, "")
    assert "tum holds one frame, the tree has 'a', 'b'; name two: lookup TREE TARGET SOURCE -f tum" in done.err


def test_other_notations_are_refused_where_a_form_has_its_own(run: Run) -> None:
    done = run("convert", "-f", "euroc", "--to", "rpy", stdin=text_of("tum", matrices(2)))
    assert (done.status, "writes rotations in its own way" in done.err) == (1, True)


@pytest.mark.parametrize("form", ["colmap", "nerf", "g2o"])
def test_other_notations_of_a_list_of_poses_come_as_a_table(form: str, run: Run) -> None:
    done = run("convert", "--to", "rpy_deg", stdin=text_of(form, matrices(3)))
    assert (done.status, done.out.splitlines()[0][:34]) == (0, "x,y,z,roll_deg,pitch_deg,yaw_deg,s")


def test_a_trajectory_keeps_its_notation_where_its_form_is_asked_for(run: Run) -> None:
    text = text_of("tum", matrices(3))
    assert run("convert", "--in", "tum", "-f", "tum", "--to", "rpy", stdin=text).status == 1
    assert run("convert", "--in", "tum", "--to", "rpy_deg", stdin=text).out.count("\n") == 3


# --- hostile files ---

BAD: dict[str, tuple[str, str]] = {
    "a word for a number": ("0 1 2 3 0 0 0 1\n1 1 2 x 0 0 0 1\n", "2:z: 'x' is not a number"),
    "a cell too few": ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0\n", "2: expected 8 cells (t x y z qx qy qz qw), found 7"),
    "no rotation": ("0 1 2 3 0 0 0 0\n", "1:qx: quaternion 0 0 0 0 has no direction"),
    "a stamp that is none": ("nan 1 2 3 0 0 0 1\n", "1:"),
    "not finite": ("0 1 2 3 0 0 0 1\n1 1 2 nan 0 0 0 1\n", "2:z: 'nan' is not finite"),
    "kitti, a number too few": ("1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 1 0 1 0 2 0 0 1\n" * 3, "2: expected 12 cells, found 11"),
    "kitti, mirrored": ("1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 1 0 1 0 2 0 0 -1 3\n" * 3, "2:r11: matrix has determinant -1"),
    "colmap, a word": ("1 1 0 0 0 0 0 1 1 b.jpg\n\n2 1 0 0 0 0 x 1 1 c.jpg\n", "3: 'x' is not a number"),
    "colmap, cut short": ("1 1 0 0 0 0 0 1 1 b.jpg\n\n2 1 0 0\n", "3: expected 10 words"),
    "colmap, a shifted line": ("# Image list with\n1 1 0 0 0 2 3 1 im 0.png\n\n", "2: expected CAMERA_ID, a whole number, found 'im'"),
    "colmap, no id": ("# Image list with\n1.5 1 0 0 0 2 3 1 1 im 0.png\n\n", "2: expected an id, a whole number, found '1.5'"),
    "colmap, no line of points": ("# Image list with\n1 1 0 0 0 0 0 1 1 b.jpg\n2 1 0 0 0 0 0 1 1 c.jpg\n", "3: expected points (X Y POINT3D_ID each) or an empty line"),
    "colmap, a name apart": ("# Image list with\n1 1 0 0 0 0 0 1 1 b.jpg\n\n2 1 0 0 0 0 0 9 1 1 c.jpg\n\n", "4: only some pictures are called as '1 c.jpg'"),
    "colmap frames, no rig": ("# Frame list with\n1 x 1 0 0 0 0 0 1\n", "2: expected RIG_ID, a whole number, found 'x'"),
    "colmap frames, data": ("# Frame list with\n1 1 1 0 0 0 0 0 1 2 CAMERA 1 1\n", "2: expected FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS .., three words of each, found 4"),
    "g2o, no tag": ("VERTEX_SE2 0 1 2 3\n1 1 2 3\n", "2: expected a tag as VERTEX_SE3:QUAT, found '1'"),
    "g2o, a long id": (f"VERTEX_SE2 {'1' * 5000} 1 2 3\n", "1: expected the id of a vertex, a whole number, found '1111"),
    "g2o, cut short": ("VERTEX_SE3:QUAT 0 1 2 3 0 0 0\n", "1: expected VERTEX_SE3:QUAT id x y z qx qy qz qw, found 8 words"),
    "g2o, no number": ("VERTEX_SE2 0 1 2 3\nVERTEX_SE2 a 1 2 3\n", "2: expected the id of a vertex, a whole number, found 'a'"),
    "g2o, too large": ("VERTEX_SE2 99999999999999 1 2 3\n", "1: 99999999999999 is too large to count seconds"),
    "nerf, a word": ('{"frames": [{"transform_matrix": [[1,0,0,"x"],[0,1,0,0],[0,0,1,0]]}]}', "1:42: 'x' is not a number"),
    "nerf, mirrored": ('{"frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,-1,0]]}]}', "1:34: matrix has determinant -1"),
    "nerf, cut short": ('{"frames": [{"transform_matrix": [[1,0,0,0],[0,1', "1:"),
    "nerf, no list": ('{"frames": [{"transform_matrix": 3}]}', "1:13: expected transform_matrix as 4 rows"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_line_is_named_with_its_place(name: str, run: Run) -> None:
    text, said = BAD[name]
    for command in (("tree", "file"), ("convert", "-i", "file", "-f", "csv")):
        done = run(*command, files={"file": text})
        errors = [line for line in done.err.splitlines() if line.startswith("frametool: file:")]
        assert done.status == 1
        assert any(line.startswith(f"frametool: file:{said}") for line in errors), done.err
        assert "Traceback" not in done.err


@pytest.mark.parametrize("tag", ["VERTEX_SE3:QUAT", "EDGE_SE3:QUAT 0"])
def test_lines_of_g2o_with_unknown_tags_are_told(tag: str, run: Run) -> None:
    text = f"{tag} 0 1 2 3 0 0 0 1\n" + "VERTEX_SE3:QUIT 1 1 2 3 0 0 0 1\nFIX 0\nPARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n" * 2 + f"{tag} 2 1 2 3 0 0 0 1\n"
    options = ("--edges",) * tag.startswith("EDGE")
    done = run("convert", "-i", "a.g2o", *options, files={"a.g2o": text})
    assert (done.status, done.out.count("\n")) == (0, 2)
    assert "a.g2o:2: lines of unknown tags left out: VERTEX_SE3:QUIT" in done.err

    assert "FIX" not in done.err


def test_images_bin_is_named_with_the_command_that_makes_text_of_it(run: Run) -> None:
    data = (1).to_bytes(8, "little") + (1).to_bytes(4, "little") + np.ones(7).tobytes() + (1).to_bytes(4, "little") + b"a.jpg\0" + bytes(8)
    for command in (("tree", "images.bin"), ("convert", "-i", "images.bin")):
        done = run(*command, files={"images.bin": data})
        assert (done.status, "colmap model_converter" in done.err) == (1, True)


def test_bad_rows_can_be_left_out(run: Run) -> None:
    text = "0 1 2 3 0 0 0 1\n1 1 2 x 0 0 0 1\n2 1 2 3 0 0 0 1\n"
    done = run("convert", "-f", "euroc", "--on-error", "skip", "--in", "tum", stdin=text)
    assert (done.status, len(done.out.splitlines())) == (3, 3)
    assert "1 of 3 rows skipped" in done.err


# --- CSV, equal stamps, bulk ---


def test_a_table_with_stamps_and_poses_is_a_tree_in_any_notation(run: Run) -> None:
    text = "time_s,x_mm,y_mm,z_mm,yaw_deg,note\n0.5,1000,0,0,0,a\n1.5,2000,0,0,90,b\n"
    done = run("lookup", "a.csv", "world", "body", "--at", "1", "--to", "rpy_deg", "-f", "json", files={"a.csv": text})
    found = json.loads(done.out)
    assert (found["xyz"], round(found["rpy_deg"]["yaw"], 9)) == ([1.5, 0.0, 0.0], 45.0)


def test_a_table_that_names_its_frames_is_a_tree_of_them(run: Run) -> None:
    text = "stamp,parent,name,x,y,z,qx,qy,qz,qw\n0,map,a,1,2,3,0,0,0,1\n0,a,b,1,2,3,0,0,0,1\n1,map,a,1,2,3,0,0,0,1\n1,a,b,1,2,5,0,0,0,1\n"
    assert json.loads(run("lookup", "-", "map", "b", "-f", "json", stdin=text).out)["xyz"] == [2.0, 4.0, 8.0]


def test_what_lookup_prints_as_csv_is_a_tree_again(run: Run) -> None:
    text = run("lookup", "{name: a, parent: map, xyz: [1, 2, 3], rpy_deg: [0, 0, 30]}", "map", "a", "-f", "csv").out
    assert json.loads(run("lookup", "-", "map", "a", "-f", "json", stdin=text).out)["xyz"] == [1.0, 2.0, 3.0]


WANTED = "frames that stand still have parent and name, one that moves stamp or stamp_ns, or --stamps FILE"


@pytest.mark.parametrize(("text", "said"), [
    ("x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", f"no column parent, name nor stamp among x, y, z, qx, qy, qz, qw; {WANTED}"),
    ("sensor,x,y,z,yaw\nlidar,1,2,3,0\n", f"no column parent, name nor stamp among sensor, x, y, z, yaw; {WANTED}"),
    ("frame,x,y,z,yaw\nlidar,1,2,3,0\n", f"no column name nor stamp among frame, x, y, z, yaw; {WANTED}"),
    ("name,x,y,z,yaw\nlidar,1,2,3,0\n", f"no column parent nor stamp among name, x, y, z, yaw; {WANTED}"),
    ("stamp,x,y,z\n1,2,3,0\n", "no rotation among the columns stamp, x, y, z"),
    ("timestamp,x,y,z,qx,qy,qz,qw\n99999999999,1,2,3,0,0,0,1\n", "is beyond 64 bits of nanoseconds; are these some? then write ns behind them, or call them stamp_ns"),
    ("timestamp,x,y,z,qx,qy,qz,qw\n1.7e+18,1,2,3,0,0,0,1\n", "is beyond 64 bits of nanoseconds; are these some? then write whole numbers, without point or exponent"),
])  # fmt: skip
def test_a_table_that_is_no_trajectory_says_what_is_missing(text: str, said: str, run: Run) -> None:
    done = run("tree", "a.csv", files={"a.csv": text})
    assert (done.status, said in done.err) == (1, True)


def test_of_two_poses_at_one_stamp_the_last_holds_and_its_line_is_told(run: Run) -> None:
    rows = [f"{at} {at} 0 0 0 0 0 1\n" for at in range(9000)]
    rows.append("17 5 0 0 0 0 0 1\n")
    done = run("lookup", "a.tum", "world", "body", "--at", "17", "-f", "json", files={"a.tum": "".join(rows)})
    assert json.loads(done.out)["xyz"] == [5.0, 0.0, 0.0]
    assert "a.tum:9001: frame 'body' has two poses at 17.000000000; the last one holds" in done.err


def test_samples_taken_in_bulk_are_those_taken_one_by_one(tmp_path: Path) -> None:
    (tmp_path / "a.tum").write_text(text_of("tum", matrices(3000)))
    bulk, slow = load(tmp_path / "a.tum"), load(tmp_path / "a.tum", keep_ns=10**15)
    assert list(next(bulk.tracks()).walk()) == list(next(slow.tracks()).walk())


def test_a_parent_of_itself_is_refused_in_bulk_too(run: Run) -> None:
    done = run("tree", "-", "--frames", "a,a", stdin=text_of("tum", matrices(3)))
    assert (done.status, "frame 'a' is its own parent" in done.err) == (1, True)


def test_stamps_are_exact_to_the_nanosecond(run: Run) -> None:
    text = "1403636579.763555584 0 0 0 0 0 0 1\n1403636579.763555585 1 0 0 0 0 0 1\n-0.5 0 0 0 0 0 0 1\n"
    done = run("convert", "-f", "euroc", "--in", "tum", stdin=text)
    assert [line.split(",")[0] for line in done.out.splitlines()[1:]] == ["1403636579763555584", "1403636579763555585", "-500000000"]
    assert run("convert", "-f", "tum", stdin=done.out).out.startswith("1403636579.763555584 ")


# --- streams ---


@pytest.mark.parametrize("form", ["tum", "euroc", "kitti"])
def test_in_its_own_form_a_stream_passes_all_that_is_not_ours(form: str, run: Run) -> None:
    text = text_of(form, matrices(4))
    if form == "euroc":
        lines = text.splitlines()
        text = "".join(f"{line},v{at}, b ,1,2,3,4,5,6,7\r\n" for at, line in enumerate(lines))
    same = run("convert", "--in", form, stdin=text)
    for old, new in zip(text.splitlines(), same.out.splitlines(), strict=True):
        delimiter = "," if form == "euroc" else " "
        ours = slice(1, 8) if form != "kitti" else slice(0, 12)
        assert old.split(delimiter)[: ours.start] == new.split(delimiter)[: ours.start]
        assert old.split(delimiter)[ours.stop :] == new.split(delimiter)[ours.stop :]


def test_the_header_of_euroc_may_name_other_columns_too(run: Run) -> None:
    head = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]"
    text = head + "\n1403636579763555584, 1, 2, 3, 1, 0, 0, 0, 9\n1403636579763555585, 1, 2, 4, 1, 0, 0, 0, 9\n"
    done = run("convert", "-f", "json", stdin=text)
    assert json.loads(done.out.splitlines()[1]) == {
        "xyz": [1.0, 2.0, 4.0], "quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}, "stamp_ns": START + 1,
        "v_RS_R_x [m s^-1]": 9,
    }  # fmt: skip


@pytest.mark.parametrize("blank", ["\n", " \n", "\t\r\n", "  "])
def test_a_blank_line_of_euroc_is_no_row(run: Run, blank: str) -> None:
    text = text_of("euroc", matrices(2))
    given, wanted = run("convert", stdin=f"{text}{blank}"), run("convert", stdin=text)
    assert (given.status, given.out, given.err) == (0, f"{wanted.out}{blank}", wanted.err)
    assert run("tree", "e.csv", files={"e.csv": f"{text}{blank}"}).status == 0


@pytest.mark.parametrize("text", ["1x\n3 0\n", "a b\n3 0\n"])
def test_kitti_has_no_header_of_another_width(run: Run, text: str) -> None:
    wanted = f":1: expected 12 numbers a line, found {len(text.splitlines()[0].split())}"
    for command in (("convert", "-i", "k.txt"), ("tree", "k.txt")):
        done = run(*command, "--in", "kitti", files={"k.txt": text})
        assert (done.status, done.out, done.err) == (1, "", f"frametool: k.txt{wanted}\n")


def test_the_header_of_euroc_stays(run: Run) -> None:
    text = text_of("euroc", matrices(2))
    turned = run("invert", stdin=text).out
    assert turned.splitlines()[0] == text.splitlines()[0]
    assert abs(np.array([float(each) for each in run("invert", stdin=turned).out.splitlines()[1].split(",")[1:]])
               - np.array([float(each) for each in text.splitlines()[1].split(",")[1:]])).max() < 1e-12  # fmt: skip


def test_tr_inverse_p_tr_is_a_chain_over_rows(run: Run, tmp_path: Path) -> None:
    tr, poses = matrices(1, 3)[0], matrices(6)
    x, y, z, w = quaternion(tr)
    given = json.dumps({"xyz": tr[:3, 3].tolist(), "quaternion": {"x": x, "y": y, "z": z, "w": w}})
    first = run("compose", "-", given, "-f", "kitti", stdin=text_of("kitti", poses)).out
    inverse = run("invert", given).out
    (tmp_path / "out").write_text(run("compose", inverse, "-", "-f", "kitti", stdin=first).out)
    assert abs(samples_of(tmp_path / "out")[0] - np.linalg.inv(tr) @ poses @ tr).max() < 1e-12


def test_points_come_out_in_other_forms_with_what_is_beside_them(run: Run) -> None:
    tree = "{name: a, parent: map, xyz: [1, 0, 0]}"
    done = run("apply", tree, "map", "a", "-f", "json", stdin='x,y,z,id\n1,2,3,007\n4,5,6,"a,b"\n')
    assert done.out.splitlines() == [
        '{"frame": "map", "point": [2.0, 2.0, 3.0], "id": "007"}',
        '{"frame": "map", "point": [5.0, 5.0, 6.0], "id": "a,b"}',
    ]


@pytest.mark.parametrize("target", ["csv", "json", "yaml"])
@pytest.mark.parametrize("options", [(), ("--to", "rpy_deg"), ("--to", "matrix"), ("--to", "euler:rzyx,axis_angle"), ("--precision", "3"), ("--keep-sign",)])
def test_rows_in_bulk_are_written_as_single_results_are(target: str, options: tuple[str, ...], run: Run) -> None:
    draw = np.random.default_rng(2)
    turns = draw.normal(size=(40, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    turns[5] = 0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)  # the lock of rpy
    rows = [f"{words(draw.normal(size=3))} {words(turn)}" for turn in turns.tolist()]
    names = "id x y z qx qy qz qw"
    table = names.replace(" ", ",") + "\n" + "".join(f"{at},{row.replace(' ', ',')}\n" for at, row in enumerate(rows))
    keys = names.split()[1:]
    records = "".join(
        "---\n{" + ", ".join(f"{key}: {word}" for key, word in zip(keys, row.split(), strict=True)) + f", id: {at}}}\n"
        for at, row in enumerate(rows)
    )
    if target == "csv":
        table = table.replace(",", "\t")  # csv to csv would pass
        assert run("convert", "--in", "columns", "-f", target, *options, stdin=table.replace("\t", " ")).status == 0
        return
    bulk = run("convert", "--in", "csv", "-f", target, *options, stdin=table)
    single = run("convert", "--in", "yaml", "-f", "json", *options, stdin=records)
    read = run("convert", "--in", target, "-f", "json", *(() if options[:1] == ("--to",) else options), stdin=bulk.out)
    assert bulk.status == single.status == 0
    if target == "json":
        assert bulk.out == single.out
    else:
        assert read.status == 0


def test_each_row_seen_from_the_first_begins_with_the_identity(run: Run, tmp_path: Path) -> None:
    poses = matrices(40)
    (tmp_path / "a.tum").write_text(text_of("tum", poses))
    assert run("relative", "--first", "-i", "a.tum", "-f", "tum", "-o", "b.tum").status == 0
    assert abs(samples_of(tmp_path / "b.tum")[0] - np.linalg.inv(poses[0]) @ poses).max() < 1e-12


def test_lookups_for_the_rows_of_a_table_come_out_in_other_forms(run: Run) -> None:
    tree = "{name: a, parent: map, xyz: [1, 0, 0]}"
    done = run("lookup", tree, "--target-column", "t", "--source-column", "s", "-f", "json", stdin="t,s\nmap,a\na,map\n")
    assert [json.loads(line)["xyz"] for line in done.out.splitlines()] == [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]


# --- recordings ---

HEADER = {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "odom"}
POSE: dict[str, Any] = {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 1, "w": 0}}
POSES: dict[str, dict[str, Any]] = {
    "PoseStamped": {"header": HEADER, "pose": POSE},
    "PoseWithCovarianceStamped": {"header": HEADER, "pose": {"pose": POSE, "covariance": [0] * 36}},
    "Odometry": {"header": HEADER, "child_frame_id": "base", "pose": {"pose": POSE}, "twist": {"twist": {}}},
}
TF = {"transforms": [{"header": HEADER, "child_frame_id": "tf_base", "transform": {"translation": POSE["position"], "rotation": POSE["orientation"]}}]}


def published(topic: str, message: dict[str, Any]) -> str:
    return json.dumps({"op": "publish", "topic": topic, "msg": message}) + "\n"


@pytest.mark.parametrize("kind", POSES)
def test_a_topic_of_poses_is_a_frame_that_moves_if_it_was_named(kind: str, run: Run) -> None:
    text = published("/tf", TF) + published("/robot1/pose", POSES[kind])
    later = json.loads(json.dumps(POSES[kind]))
    later["header"]["stamp"]["sec"] = 2
    text += published("/robot1/pose", later)
    child = "base" if kind == "Odometry" else "robot1/pose"
    done = run("lookup", "a.jsonl", "odom", child, "--topic", "/robot1/pose", "-f", "tum", files={"a.jsonl": text})
    assert done.out.splitlines() == [f"{second}.000000005 1.0 2.0 3.0 0.0 0.0 1.0 0.0" for second in (1, 2)]
    if kind != "Odometry":
        named = run("lookup", "a.jsonl", "odom", "me", "--topic", "robot1/pose", "--frames", "odom,me", "-f", "tum")
        assert named.out == done.out
    assert "tf_base" in run("tree", "a.jsonl").out
    assert f"name: {child}," not in run("tree", "a.jsonl").out
    refused = run("tree", "a.jsonl", "--topic", "/nope")
    assert (refused.status, "no transforms on nope; topics: /robot1/pose, /tf" in refused.err) == (1, True)


@pytest.mark.parametrize("kind", POSES)
def test_poses_as_the_echo_tools_print_them_are_a_frame_that_moves(kind: str, run: Run) -> None:
    from frametool.documents.writers import dump_yaml

    child = "base" if kind == "Odometry" else "body"
    done = run("lookup", "a.txt", "odom", child, "--topic", "/any", "-f", "json", files={"a.txt": dump_yaml(POSES[kind]) + "---\n"})
    assert json.loads(done.out)["xyz"] == [1.0, 2.0, 3.0], done.err


def test_two_robots_with_the_same_frames_need_a_topic(run: Run) -> None:
    other = json.loads(json.dumps(TF))
    other["transforms"][0]["transform"]["translation"]["x"] = 7
    files = {"a.jsonl": published("/tf", TF) + published("/robot1/tf", other)}
    refused = run("lookup", "a.jsonl", "odom", "tf_base", files=files)
    assert (refused.status, "comes by /tf and by /robot1/tf; choose with --topic" in refused.err) == (1, True)
    found = run("lookup", "a.jsonl", "odom", "tf_base", "--topic", "/robot1/tf", "-f", "json")
    assert json.loads(found.out)["xyz"] == [7.0, 2.0, 3.0]


@pytest.mark.parametrize("kind", ["ros1", "MCAP"])
def test_the_odometry_of_a_bag_is_a_frame_that_moves(kind: str, run: Run, tmp_path: Path) -> None:
    write_odometry(tmp_path / "a.bag", kind)
    path = "a.bag" if kind == "ros1" else next(each.name for each in (tmp_path / "a.bag").glob("*.mcap"))
    where = path if kind == "ros1" else f"a.bag/{path}"
    refused = run("tree", where)
    assert (refused.status, "no transforms; topics: /odom (nav_msgs/msg/Odometry); --topic /odom reads its poses" in refused.err) == (1, True)
    done = run("lookup", where, "odom", "base", "--topic", "/odom", "-f", "tum")
    assert done.out.splitlines() == [f"{second}.000000007 {second}.0 2.0 3.0 0.0 0.0 0.0 1.0" for second in (1, 2)]


def write_odometry(path: Path, kind: str) -> None:
    """Write a bag with two messages of odometry."""
    from rosbags import typesys

    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if kind == "ros1" else typesys.Stores.ROS2_HUMBLE)
    make, name = store.types, "nav_msgs/msg/Odometry"

    def message(second: int) -> Any:
        header = make["std_msgs/msg/Header"](
            stamp=make["builtin_interfaces/msg/Time"](second, 7), frame_id="odom", **({"seq": 0} if kind == "ros1" else {})
        )
        point, turn = make["geometry_msgs/msg/Point"](float(second), 2.0, 3.0), make["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
        zero = make["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        pose = make["geometry_msgs/msg/PoseWithCovariance"](make["geometry_msgs/msg/Pose"](point, turn), np.zeros(36))
        twist = make["geometry_msgs/msg/TwistWithCovariance"](make["geometry_msgs/msg/Twist"](zero, zero), np.zeros(36))
        return make[name](header, "base", pose, twist)

    if kind == "ros1":
        from rosbags.rosbag1 import Writer

        with Writer(path) as writer:
            topic = writer.add_connection("/odom", name, typestore=store)
            for second in (1, 2):
                writer.write(topic, second, store.serialize_ros1(message(second), name))
        return
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    with Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer2:
        topic2 = writer2.add_connection("/odom", name, typestore=store)
        for second in (1, 2):
            writer2.write(topic2, second, store.serialize_cdr(message(second), name))


# --- lookups ---


def test_a_lookup_writes_every_sample_of_the_way(run: Run) -> None:
    tree = """{frames: [{name: base, parent: map, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 2, xyz: [2, 0, 0]}]},
        {name: arm, parent: base, samples: [{stamp: 1, xyz: [0, 1, 0]}, {stamp: 3, xyz: [0, 3, 0]}]}]}"""
    done = run("lookup", tree, "map", "arm", "-f", "tum")
    assert done.out == "1.000000000 1.0 1.0 0.0 0.0 0.0 0.0 1.0\n2.000000000 2.0 2.0 0.0 0.0 0.0 0.0 1.0\n"
    assert run("lookup", tree, "map", "arm", "-f", "tum", "--at", "1.5").out.count("\n") == 1
    assert run("lookup", tree, "map", "arm", "-f", "kitti", "--times", "1:2:0.25").out.count("\n") == 5
    assert run("echo", tree, "map", "arm", "-f", "euroc", "--rate", "2").out.count("\n") == 4


def test_ground_truth_at_the_times_of_pictures_is_one_command(run: Run) -> None:
    files = {"gt.tum": "0 0 0 0 0 0 0 1\n10 10 0 0 0 0 0 1\n", "times.txt": "1.25\n2500000000ns\n"}
    done = run("lookup", "gt.tum", "world", "body", "--times", "times.txt", "-f", "tum", files=files)
    assert done.out == "1.250000000 1.25 0.0 0.0 0.0 0.0 0.0 1.0\n2.500000000 2.5 0.0 0.0 0.0 0.0 0.0 1.0\n"


@pytest.mark.parametrize(("name", "form"), [("a.tum", "tum"), ("images.txt", "colmap"), ("transforms.json", "nerf"), ("a.g2o", "g2o"), ("a.csv", "csv")])
def test_the_name_of_the_output_says_its_form(name: str, form: str, run: Run, tmp_path: Path) -> None:
    assert run("convert", "--in", "tum", "-o", name, stdin=text_of("tum", matrices(3))).status == 0
    assert (tmp_path / name).read_text() == run("convert", "--in", "tum", "-f", form, stdin=text_of("tum", matrices(3))).out


@pytest.mark.parametrize("command", [("tree",), ("check",), ("monitor",), ("view", "-f", "svg"), ("echo", "world", "body")])
def test_every_command_that_takes_a_tree_takes_a_trajectory(command: tuple[str, ...], run: Run) -> None:
    name, *rest = command
    done = run(name, "a.tum", *rest, files={"a.tum": text_of("tum", matrices(5))})
    assert (done.status, "Traceback" in done.err) == (0, False), done.err


@pytest.mark.parametrize("name", [name for name in FORMATS if is_trajectory(name)])
def test_a_trajectory_states_what_its_numbers_mean(name: str) -> None:
    assert "<-" in FORMATS[name].conventions


# --- lines that somebody damaged ---

MORE_FORMS = {
    "colmap frames": "# Frame list with one line of data per frame:\n" + "".join(f"{at} {at + 5} 1 0 0 0 {at} 2 3 1 CAMERA 1 {at}\n" for at in range(1, 5)),
    "colmap, bare": "".join(f"{at} 1 0 0 0 {at} 2 3 1 im {at}.png\n1 2 -1 3 4 7\n" for at in range(1, 5)),
    "g2o edges": "".join(f"EDGE_SE3:QUAT {at} {at + 1} {at} 2 3 0 0 0 1 {'1 ' * 21}\n" for at in range(1, 5)),
    "g2o plane": "".join(f"VERTEX_SE2 {at} {at} 2 0.5\n" for at in range(1, 5)),
    "semicolon": "t;x;y;z;qx;qy;qz;qw\n" + "".join(f"{at};{at + 4};2;3;0;0;0;1\n" for at in range(1, 5)),
    "tsv": "t\tx\ty\tz\tqx\tqy\tqz\tqw\n" + "".join(f"{at}\t{at + 4}\t2\t3\t0\t0\t0\t1\n" for at in range(1, 5)),
    "bare euroc": "".join(f"140363658083855564{at},{at},2,3,1,0,0,0\n" for at in range(1, 5)),
    "calls": "".join(f"--x {at} --y 2 --z 3 --frame-id map --child-frame-id body{at}\n" for at in range(1, 5)),
}  # fmt: skip
IN = {"g2o edges": ("--edges",), "tsv": ("--in", "tsv"), "semicolon": ("--in", "semicolon")}


def damaged(text: str, draw: random.Random) -> str:
    """Drop a word of a line, add one, double one, or write another separator."""
    lines = text.splitlines(keepends=True)
    at = draw.choice([at for at, line in enumerate(lines) if len(re.findall(r"[\s,;]", line)) > 2])
    parts = re.split(r"([ ,;\t]+)", lines[at])  # words at even places, what stands between them at odd ones
    word = draw.randrange(0, len(parts) - (lines[at].endswith(" \n")), 2)
    match draw.choice(["drop", "add", "double", "swap", "glue"]):
        case "drop":
            del parts[word : word + 2]
        case "add":
            parts[word:word] = [draw.choice(["7", "x", "-0.5", "1e3"]), " " if " " in lines[at] else draw.choice(",;\t")]
        case "double":
            parts[word:word] = parts[word : word + 2]
        case "swap":
            parts[draw.randrange(1, len(parts), 2)] = draw.choice([",", ";", "\t", " ", "  ", ", "])
        case _:
            parts[draw.randrange(1, len(parts), 2)] = ""
    return "".join([*lines[:at], "".join(parts), "" if "".join(parts).endswith("\n") else "\n", *lines[at + 1 :]])


def poses_in(out: str) -> list[str]:
    """Return the position and rotation of every line of JSON."""
    return [repr((row["xyz"], row["quaternion"])) for row in map(json.loads, out.splitlines())]


@pytest.mark.parametrize("form", [*FORMS, *MORE_FORMS])
def test_a_damaged_line_is_refused_or_told_and_never_shifts_a_pose(form: str, run: Run) -> None:
    draw = random.Random(form)  # noqa: S311 - not for secrets
    text = MORE_FORMS.get(form) or text_of(form, matrices(4))
    command = ("convert", "-i", "file", "-f", "json", *IN.get(form, ()))
    whole = poses_in(run(*command, files={"file": text}).out)
    assert len(whole) == 4
    for _ in range(40):
        made = damaged(text, draw)
        done = run(*command, files={"file": made})
        assert "Traceback" not in done.err
        if done.status == 0:
            found = poses_in(done.out)
            assert set(found) <= set(whole), made
            assert len(found) == len(whole) or "left out" in done.err, made


@pytest.mark.parametrize(
    "text",
    [
        "# x y z r11 r12 r13 r21 r22 r23 r31 r32 r33\n1 2 3 -1 0 0 0 -1 0 0 0 1\n",
        "# r11 r21 r31 r12 r22 r32 r13 r23 r33 tx ty tz\n-1 0 0 0 -1 0 0 0 1 1 2 3\n",
        "#timestamp [ns],tx,ty,tz,qx,qy,qz,qw\n1700000000000000000,1,2,3,0,0,1,0\n",
        "# timestamp_ns, x, y, z, qw, qx, qy, qz\n1700000000000000000, 1, 2, 3, 0, 0, 0, 1\n",
        "#poses, w first\n1700000000000000000,1,2,3,0,0,0,1\n",  # EuRoC
    ],
)
def test_a_comment_that_names_the_columns_goes_before_the_order_of_a_trajectory(text: str, run: Run) -> None:
    found = json.loads(run("convert", "--to", "xyzw", "-f", "json", stdin=text).out)
    assert (found["xyz"], found["xyzw"]) == ([1, 2, 3], [0, 0, 1, 0])
