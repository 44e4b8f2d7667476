"""Camera chains, OpenCV's files and EuRoC's sensors: which way a key points, what is checked, what is no pose."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from calibrations import matrix, read
from scipy.spatial.transform import Rotation as Peer

from frametool.errors import FormatError, Unanswered
from frametool.formats.trees.matrix_keys import Meaning, meaning_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from frametool.geometry import Array

KNOWN = {"me": "cam1", "before": "cam0", "imu": "imu", "body": "body", "sensor": "imu"}


def rigid(seed: int) -> Array:
    """Return a 4x4 matrix that does not equal its inverse."""
    matrix = np.eye(4)
    matrix[:3, :3] = Peer.random(rng=np.random.default_rng(seed)).as_matrix()
    matrix[:3, 3] = 0.1 * seed, -0.3, 0.07
    return matrix




def inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), np.float64)


CAM0_IMU, CAM1_IMU = rigid(1), rigid(2)


def rows(matrix: Array, indent: str = "  ") -> str:
    return "".join(f"{indent}- [{', '.join(map(repr, row))}]\n" for row in matrix.tolist())


def line(matrix: Array) -> str:
    return ", ".join(map(repr, matrix.ravel().tolist()))


def stored(name: str, matrix: Array, blank: str = " ") -> str:
    return f"{name}: !!opencv-matrix\n   rows: {len(matrix)}\n   cols: {matrix.shape[1]}\n   dt: d\n   data:{blank}[ {line(matrix)} ]\n"


INTRINSICS = "  camera_model: pinhole\n  distortion_model: radtan\n  intrinsics: [461.6, 460.3, 362.7, 246.4]\n  resolution: [752, 480]\n  rostopic: /cam/image_raw\n"
KALIBR = (
    f"cam0:\n  T_cam_imu:\n{rows(CAM0_IMU)}{INTRINSICS}"
    f"cam1:\n  T_cam_imu:\n{rows(CAM1_IMU)}  T_cn_cnm1:\n{rows(CAM1_IMU @ inverse(CAM0_IMU))}{INTRINSICS}"
)
OPENVINS = (
    f"%YAML:1.0\n\ncam0:\n  T_imu_cam: #rotation from camera to IMU R_CtoI\n{rows(inverse(CAM0_IMU), '    ')}{INTRINSICS}"
    f"cam1:\n  T_imu_cam:\n{rows(inverse(CAM1_IMU), '    ')}{INTRINSICS}"
)
CAMERAS_ALONE = f"cam0:\n{INTRINSICS}cam1:\n  T_cn_cnm1:\n{rows(CAM1_IMU @ inverse(CAM0_IMU))}{INTRINSICS}"
OKVIS = (
    f"%YAML:1.0\ncameras:\n     - {{T_SC:\n        [ {line(inverse(CAM0_IMU))}],\n        image_dimension: [752, 480]}}\n"
    f"     - {{T_SC:\n        [ {line(inverse(CAM1_IMU))}],\n        image_dimension: [752, 480]}}\n"
)
VINS = f'%YAML:1.0\n\n#common parameters\nimu_topic:"/imu0"\nViewer.PointSize:2\n{stored("body_T_cam0", inverse(CAM0_IMU), "")}{stored("body_T_cam1", inverse(CAM1_IMU))}'


@pytest.mark.parametrize(
    ("text", "base"),
    [(KALIBR, "imu"), (OPENVINS, "imu"), (OKVIS, "body"), (VINS, "body")],
    ids=["kalibr", "openvins", "okvis", "vins"],
)
def test_every_way_to_write_a_rig_says_the_same_poses(tmp_path: Path, text: str, base: str) -> None:
    tree = read(tmp_path, text)
    assert tree.roots == (base,)
    for camera, from_imu in (("cam0", CAM0_IMU), ("cam1", CAM1_IMU)):
        assert matrix(tree, camera, base) == pytest.approx(from_imu, abs=1e-15)
    assert matrix(tree, "cam1", "cam0") == pytest.approx(CAM1_IMU @ inverse(CAM0_IMU), abs=1e-15)


def test_cameras_without_an_imu_hang_in_a_chain(tmp_path: Path) -> None:
    tree = read(tmp_path, CAMERAS_ALONE)
    assert (tree.roots, tree.parent("cam1")) == (("cam0",), "cam0")
    assert matrix(tree, "cam1", "cam0") == pytest.approx(CAM1_IMU @ inverse(CAM0_IMU), abs=1e-15)


def test_the_camera_before_is_that_of_the_number_before_in_any_order(tmp_path: Path) -> None:
    first, second = CAMERAS_ALONE.split("cam1:")
    tree = read(tmp_path, f"cam1:{second}{first}")
    assert matrix(tree, "cam1", "cam0") == pytest.approx(CAM1_IMU @ inverse(CAM0_IMU), abs=1e-15)


def test_names_told_for_a_chain_are_those_of_cam0_and_on_in_any_order(tmp_path: Path) -> None:
    first, second = CAMERAS_ALONE.split("cam1:")
    for text in (CAMERAS_ALONE, f"cam1:{second}{first}"):
        tree = read(tmp_path, text, frames=("unused", "left", "right"))
        assert tree.roots == ("left",)
        assert matrix(tree, "right", "left") == pytest.approx(CAM1_IMU @ inverse(CAM0_IMU), abs=1e-15)


def test_the_sensor_of_okvis_is_the_imu_where_its_pose_is_told(tmp_path: Path) -> None:
    body_imu = rigid(5)
    tree = read(tmp_path, f"{OKVIS}imu_params:\n    a_max: 176.0\n    T_BS:\n        [{line(body_imu)}]\n")
    assert matrix(tree, "body", "imu") == pytest.approx(body_imu, abs=1e-15)
    assert matrix(tree, "body", "cam1") == pytest.approx(body_imu @ inverse(CAM1_IMU), abs=1e-15)


@pytest.mark.parametrize(
    ("key", "meaning"),
    [
        ("T_cam_imu", Meaning("cam1", "imu", "cam1")),
        ("T_imu_cam", Meaning("imu", "cam1", "cam1")),
        ("T_cn_cnm1", Meaning("cam1", "cam0", "cam1")),
        ("T_SC", Meaning("imu", "cam1", "cam1")),
        ("T_BS", Meaning("body", "cam1", "cam1")),
        ("T_cam_lidar", Meaning("cam1", "lidar", "cam1")),
        ("T_lidar_cam", Meaning("lidar", "cam1", "cam1")),
        ("T_base_lidar", Meaning("base", "lidar", "lidar")),
        ("body_T_cam0", Meaning("body", "cam0", "cam0")),
        ("base_from_lidar", Meaning("base", "lidar", "lidar")),
        ("T_base_from_lidar", Meaning("base", "lidar", "lidar")),
        ("IMU.T_b_c1", Meaning("b", "c1", "c1")),
        ("Tbc", Meaning("b", "c", "c")),
        ("lidar_to_cam", Meaning("lidar", "cam", "cam", is_stated=False)),
        ("T_lidar_to_cam", Meaning("lidar", "cam", "cam", is_stated=False)),
        ("lidar2cam", Meaning("lidar", "cam", "cam", is_stated=False)),
        ("extrinsic", None),
        ("transform", None),
    ],
)
def test_one_table_says_what_a_key_means(key: str, meaning: object) -> None:
    assert meaning_of(key, KNOWN) == meaning


def test_a_key_that_names_two_frames_in_several_ways_is_an_error_with_these() -> None:
    ways = "--frames velodyne,top_cam0 or velodyne_top,cam0"
    assert str(meaning_of("T_velodyne_top_cam0", KNOWN)).endswith(f"in several ways; give {ways}")


def test_names_that_were_told_part_a_key(tmp_path: Path) -> None:
    text = f"%YAML:1.0\n---\n{stored('T_velodyne_top_cam0', rigid(3))}"
    with pytest.raises(Unanswered, match="give --frames velodyne,top_cam0 or velodyne_top,cam0"):
        read(tmp_path, text)
    tree = read(tmp_path, text, frames=("velodyne_top", "cam0"))
    assert matrix(tree, "velodyne_top", "cam0") == pytest.approx(rigid(3), abs=1e-15)


@pytest.mark.parametrize("key", ["extrinsic", "lidar_to_body", "Lidar.transform"])
def test_a_key_that_says_no_direction_is_asked_for_with_both_spellings(tmp_path: Path, key: str) -> None:
    text = f"%YAML:1.0\n---\n{stored(key, rigid(3))}"
    with pytest.raises(Unanswered) as caught:
        read(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path}/a.yaml:3:1: ")
    assert "--direction parent-from-child" in str(caught.value)
    assert "child-from-parent" in str(caught.value)
    one = read(tmp_path, text, direction="parent-from-child")
    other = read(tmp_path, text, direction="child-from-parent")
    ((parent, child, _),) = one.edges()
    assert matrix(one, parent, child) == pytest.approx(rigid(3), abs=1e-15)
    assert matrix(other, child, parent) == pytest.approx(rigid(3), abs=1e-15)


@pytest.mark.parametrize("layout", ["{%s: %s}", '{"%s": %s}', '{\n  "K": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],\n  "%s": %s}', "%s: %s"])
@pytest.mark.parametrize("key", ["T_cam_lidar", "lidar_to_cam", "lidar2cam", "extrinsic", "extrinsic_matrix"])
def test_a_matrix_alone_is_known_by_its_key_in_yaml_and_json(run: Callable[..., Any], layout: str, key: str) -> None:
    name = "e.json" if '"' in layout else "e.yaml"
    files = {name: layout % (key, f"[{', '.join(str(row) for row in CAM0_IMU.tolist())}]")}
    names = ("--frames", "lidar,cam") * key.startswith("extrinsic")
    if key != "T_cam_lidar":
        done = run("tree", name, *names, files=files)
        assert (done.status, done.out) == (2, "")
        assert f"'{key}': the key does not say its direction: give --direction parent-from-child (takes points of cam" in done.err
        names = (*names, "--direction", "child-from-parent")
    found = json.loads(run("lookup", name, "cam", "lidar", *names, "-f", "json", "--to", "matrix", files=files).out)
    assert np.array(found["matrix"])[:3, :3] == pytest.approx(CAM0_IMU[:3, :3])


def test_an_unknown_key_in_a_block_is_about_that_camera(tmp_path: Path) -> None:
    text = KALIBR + f"cam2:\n  extrinsics:\n{rows(rigid(4))}"
    with pytest.raises(Unanswered, match=r"'cam2.extrinsics': .*takes points of cam2 to imu"):
        read(tmp_path, text)
    assert matrix(read(tmp_path, text, direction="child-from-parent"), "cam2", "imu") == pytest.approx(rigid(4), abs=1e-15)


def test_frames_are_called_as_told(tmp_path: Path) -> None:
    tree = read(tmp_path, KALIBR, frames=("base", "left", "right"))
    assert set(tree.frames) == {"base", "left", "right"}
    assert matrix(tree, "right", "left") == pytest.approx(CAM1_IMU @ inverse(CAM0_IMU), abs=1e-15)


def test_a_pose_and_its_inverse_are_checked_against_each_other(tmp_path: Path) -> None:
    both = f"cam0:\n  T_cam_imu:\n{rows(CAM0_IMU)}  T_imu_cam:\n"
    assert matrix(read(tmp_path, both + rows(inverse(CAM0_IMU))), "cam0", "imu") == pytest.approx(CAM0_IMU, abs=1e-15)
    moved = inverse(CAM0_IMU)
    moved[0, 3] += 0.02
    with pytest.raises(FormatError, match=r"2:3: cam0.T_cam_imu differs from cam0.T_imu_cam by 20 mm and .* degrees; keep one"):
        read(tmp_path, both + rows(moved))


def test_a_chain_that_disagrees_is_told_with_millimetres_and_degrees(tmp_path: Path) -> None:
    chain = rigid(0)
    chain[:3, :3] = Peer.from_euler("z", 0.5, degrees=True).as_matrix()
    text = f"cam0:\n  T_cam_imu:\n{rows(np.eye(4))}cam1:\n  T_cam_imu:\n{rows(np.eye(4))}  T_cn_cnm1:\n{rows(chain)}"
    with pytest.warns(UserWarning, match=r"a.yaml:14: cam1.T_cn_cnm1: differs from the others by 308.058 mm and 0.5 degrees"):
        tree = read(tmp_path, text)
    assert matrix(tree, "cam1", "imu") == pytest.approx(np.eye(4))


def test_rectification_projection_and_intrinsics_are_left_out_and_told(run: Callable[..., Any]) -> None:
    projection = np.array([[435.0, 0, 367, -47.9], [0, 435, 252, 0], [0, 0, 1, 0]])
    more = "".join(stored(*each) for each in (("LEFT.R", np.eye(3)), ("RIGHT.P", projection), ("LEFT.K", np.eye(3))))
    done = run("tree", "a.yaml", files={"a.yaml": VINS + more})
    assert done.status == 0
    assert "LEFT.R, RIGHT.P, LEFT.K are not poses" in done.err
    assert len(done.err) < 200 + len("frametool: a.yaml")


def test_a_file_without_a_pose_says_so(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"no pose in it; a pose is named after .*; LEFT.R is not a pose"):
        read(tmp_path, f"%YAML:1.0\n---\n{stored('LEFT.R', np.eye(3))}")


def test_a_pair_of_vectors_takes_points_of_the_object_to_the_camera(tmp_path: Path) -> None:
    vector = np.array([[0.1, -0.2, 0.5]])
    text = f'%YAML:1.0\n---\nrvec: !!opencv-matrix\n   rows: 1\n   cols: 1\n   dt: "3d"\n   data: [ {line(vector)} ]\n' + stored("tvec", vector.T)
    tree = read(tmp_path, text)
    wanted = np.eye(4)
    wanted[:3, :3], wanted[:3, 3] = Peer.from_rotvec(vector[0]).as_matrix(), vector[0]
    assert matrix(tree, "camera", "object") == pytest.approx(wanted, abs=1e-15)
    assert set(read(tmp_path, text, frames=("left", "board")).frames) == {"left", "board"}


def test_the_pair_of_vins_mono_is_the_camera_in_the_imu(tmp_path: Path) -> None:
    pose = rigid(3)
    text = "%YAML:1.0\n" + stored("extrinsicRotation", pose[:3, :3]) + stored("extrinsicTranslation", pose[:3, 3:])
    assert matrix(read(tmp_path, text), "imu", "cam0") == pytest.approx(pose, abs=1e-15)


def test_stereo_calibrate_takes_points_of_the_first_camera_to_the_second(tmp_path: Path) -> None:
    pose = rigid(3)
    pair = "%YAML:1.0\n---\n" + stored("R", pose[:3, :3]) + stored("T", pose[:3, 3:])
    tree = read(tmp_path, pair + stored("R1", np.eye(3)))
    assert (tree.roots, tree.parent("cam1")) == (("cam0",), "cam0")
    assert matrix(tree, "cam1", "cam0") == pytest.approx(pose, abs=1e-15)
    with pytest.raises(Unanswered, match="R and T"):
        read(tmp_path, pair)


def xml(matrix: Array) -> str:
    return f'<?xml version="1.0"?>\n<opencv_storage>\n<body_T_cam0 type_id="opencv-matrix">\n  <rows>4</rows>\n  <cols>4</cols>\n  <dt>d</dt>\n  <data>\n    {line(matrix).replace(",", "")}</data></body_T_cam0>\n</opencv_storage>\n'


def test_opencv_in_yaml_json_and_xml_is_read_to_the_same_bits(tmp_path: Path) -> None:
    pose = rigid(3)
    one = read(tmp_path, "%YAML:1.0\n---\n" + stored("body_T_cam0", pose)).lookup("body", "cam0").components
    two = read(tmp_path, xml(pose), "a.xml").lookup("body", "cam0").components
    text = f'{{"body_T_cam0": {{"type_id": "opencv-matrix", "rows": 4, "cols": 4, "dt": "d", "data": [{line(pose)}]}}}}'
    assert one == two == read(tmp_path, text, "a.json").lookup("body", "cam0").components


def test_three_rows_of_four_are_a_pose_too(tmp_path: Path) -> None:
    pose = rigid(3)
    assert matrix(read(tmp_path, "%YAML:1.0\n" + stored("T_a_b", pose[:3])), "a", "b") == pytest.approx(pose, abs=1e-15)


@pytest.mark.parametrize(("file", "sensor"), [("cam0/sensor.yaml", "cam0"), ("lidar.yaml", "lidar")])
def test_the_sensor_of_euroc_is_called_as_its_folder_or_file(tmp_path: Path, file: str, sensor: str) -> None:
    (tmp_path / "cam0").mkdir()
    text = f"#Default imu sensor yaml file\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{line(rigid(3))}]\nrate_hz: 20\n"
    assert matrix(read(tmp_path, text, file), "body", sensor) == pytest.approx(rigid(3), abs=1e-15)
    assert set(read(tmp_path, text, file, frames=("drone", "left")).frames) == {"drone", "left"}


ONE = f"cam0:\n  T_cam_imu:\n{rows(np.eye(4))}"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ONE.replace("1.0", "abc", 1), r"3:6: 'abc' is not a number"),
        (ONE.replace("1.0", "nan", 1), r"3:6: 'nan' is not finite"),
        (ONE.replace("1.0", "0.5", 1), r"3:3: matrix is not a rotation"),
        (ONE.replace("1.0", "-1.0", 1), r"3:3: matrix has determinant -1: it is left-handed"),
        (ONE.replace("0.0, 1.0]\n", "0.0, 2.0]\n"), r"the last row of a 4x4 pose is 0 0 0 1, found 0 0 0 2"),
        ("cam0:\n  T_cam_imu:\n  - [1, 0, 0]\n  - [0, 1, 0]\n", r"3:3: T_cam_imu: expected a 4 x 4 or 3 x 4 matrix, found 2 x 3"),
        ("cam0:\n  T_cam_imu:\n", r"T_cam_imu: expected a 4 x 4 or 3 x 4 matrix, found nothing"),
        ("cam0:\n  T_cam_imu:\n  - [1, 0, 0", r"3:13: "),
        (f"cam0:\n  T_cn_cnm1:\n{rows(np.eye(4))}", r"2:3: T_cn_cnm1: there is no camera before cam0"),
        (f"%YAML:1.0\n---\n{stored('T_a_b', np.eye(4)).replace('rows: 4', 'rows: 5')}", r"7:10: expected 5 x 4 = 20 numbers, found 16"),
        (f"%YAML:1.0\n---\n{stored('T_a_b', np.eye(4)).replace('opencv-matrix', 'other')}", r"3:8: tag !!other is not read here"),
        (f"%YAML:1.0\n---\n{stored('T_a_a', np.eye(4))}", r"frame 'a' is its own parent"),
    ],
)
def test_what_is_wrong_is_one_line_with_its_place(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(FormatError, match=said) as caught:
        read(tmp_path, text)
    assert len(str(caught.value).splitlines()) == 1
    assert caught.value.line


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<rows>4", "<rows>x", "4:3: expected a whole number, found 'x'"),
        ("1.0</data>", "abc</data>", "7:3: 'abc' is not a number"),
        ("1.0</data>", "</data>", "7:3: expected 4 x 4 = 16 numbers, found 15"),
        ("</opencv_storage>", "", "not XML: it ends too early"),
        ("<rows>4</rows>", "<rows>4</rows><rows>4</rows>", "key 'rows' appears twice"),
        ("<rows>4</rows>", "<_>" * 200 + "</_>" * 200, "more than 100 elements inside one another"),
    ],
)
def test_what_is_wrong_in_xml_is_one_line_with_its_place(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        read(tmp_path, xml(np.eye(4)).replace(old, new), "a.xml")


def test_an_unknown_key_in_xml_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(Unanswered, match=r"a.xml:3:1: 'extrinsic'"):
        read(tmp_path, xml(np.eye(4)).replace("body_T_cam0", "extrinsic"), "a.xml")


@pytest.mark.parametrize("form", ["camchain", "opencv"])
@pytest.mark.filterwarnings("ignore")
def test_what_is_written_reads_back_to_the_last_bits(run: Callable[..., Any], form: str) -> None:
    files = {"a.yaml": KALIBR, "b.yaml": CAMERAS_ALONE}
    for name, base in (("a.yaml", "imu"), ("b.yaml", "cam0")):
        written = run("tree", name, "-f", form, "--quiet", files=files)
        assert written.status == 0, written.err
        for camera in ("cam0", "cam1"):
            if camera != base:
                one, two = (run("lookup", tree, base, camera, "--to", "matrix", "-f", "json", stdin=text).out for tree, text in ((name, ""), ("-", written.out)))
                numbers = [np.array(eval_json(each)["matrix"]) for each in (one, two)]
                assert numbers[0] == pytest.approx(numbers[1], abs=2e-15)


def eval_json(text: str) -> Any:
    import json

    return json.loads(text)


def test_positions_are_written_to_the_same_bits_for_an_imu(run: Callable[..., Any]) -> None:
    tree = "{frames: {imu: {cam0: {xyz: [0.1, 1e-7, -3.3333333333333335], rpy_deg: [0, 90, 0]}}}}"
    written = run("tree", tree, "-f", "camchain")
    assert (written.status, written.err) == (0, "")
    assert run("tree", "-", "--quiet", stdin=written.out).out == run("tree", tree).out


@pytest.mark.parametrize(
    ("tree", "form", "said"),
    [
        *(("{frames: {alone: {}}}", form, f"{form} holds poses, and the tree has none: alone") for form in ("autoware", "camchain", "opencv", "handeye")),
        ("{frames: {a: {b: {xyz: [1, 0, 0]}}, c: {d: {xyz: [1, 0, 0]}}}}", "camchain", "camchain holds one tree of cameras; the roots here: a, c"),
        ("{frames: {a/x: {b: {xyz: [1, 0, 0]}}}}", "opencv", "opencv cannot name the pose of 'b' in 'a/x'"),
        ("{frames: {a_T_b: {c: {xyz: [1, 0, 0]}}}}", "opencv", "opencv cannot name the pose of 'c' in 'a_T_b'"),
        ("{name: b, parent: a, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [0, 0, 1]}]}", "opencv", "opencv holds no moving frames, and 'b' moves; give --at TIME"),
    ],
)
def test_what_a_form_cannot_hold_is_an_error(run: Callable[..., Any], tree: str, form: str, said: str) -> None:
    done = run("tree", tree, "-f", form)
    assert (done.status, done.out) == (1, "")
    assert said in done.err


# --- frames named by keys beside a matrix ---

STORED = "!!opencv-matrix {rows: 4, cols: 4, dt: d, data: [1, 0, 0, 0.1, 0, 1, 0, 0.2, 0, 0, 1, 0.3, 0, 0, 0, 1]}"
LORIS = '%YAML:1.0\n---\ntrans_matrix:\n   -\n      {0}: base_link\n      {1}: "d400_color"\n      matrix: {2}\n'


@pytest.mark.parametrize("keys", [("parent_frame", "child_frame"), ("frame_id", "child_frame_id"), ("parent", "child")])
def test_frames_named_beside_a_matrix_are_parent_and_child(keys: tuple[str, str], tmp_path: Path) -> None:
    tree = read(tmp_path, LORIS.format(*keys, STORED))
    assert tree.frames == ("base_link", "d400_color")
    assert matrix(tree, "base_link", "d400_color")[:3, 3] == pytest.approx([0.1, 0.2, 0.3])


def test_they_are_so_alone_in_a_file_without_its_head_and_beside_a_rotation_and_a_translation(tmp_path: Path) -> None:
    plain = LORIS.format("parent_frame", "child_frame", STORED.removeprefix("!!opencv-matrix ")).removeprefix("%YAML:1.0\n---\n")
    assert read(tmp_path, plain).frames == ("base_link", "d400_color")
    assert read(tmp_path, f"%YAML:1.0\nparent_frame: a\nchild_frame: b\nmatrix: {STORED}\n").frames == ("a", "b")
    pair = "%YAML:1.0\nparent_frame: a\nchild_frame: b\nR: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nT: [1, 2, 3]\n"
    assert matrix(read(tmp_path, pair), "a", "b")[:3, 3] == pytest.approx([1, 2, 3])


@pytest.mark.parametrize(("direction", "root"), [("parent-from-child", "d400_color"), ("child-from-parent", "d400_color")])
def test_source_and_target_name_frames_and_their_direction_is_asked(tmp_path: Path, direction: str, root: str) -> None:
    text = LORIS.format("source_frame", "target_frame", STORED)
    with pytest.raises(Unanswered, match=r"'target_frame and source_frame beside matrix': .* give --direction parent-from-child"):
        read(tmp_path, text)
    tree = read(tmp_path, text, direction=direction)
    assert tree.frames == (root, "base_link")
    sign = 1.0 if direction == "parent-from-child" else -1.0
    assert matrix(tree, "d400_color", "base_link")[:3, 3] == pytest.approx([sign * 0.1, sign * 0.2, sign * 0.3])


@pytest.mark.parametrize(("kept", "missing"), [("parent_frame", "child_frame"), ("child_frame", "parent_frame"), ("child_frame_id", "parent_frame_id")])
def test_one_of_the_two_alone_is_refused(tmp_path: Path, kept: str, missing: str) -> None:
    with pytest.raises(FormatError, match=rf"{kept} without {missing}, so nothing says what the matrix is between"):
        read(tmp_path, LORIS.format(kept, "note", STORED))


def test_a_key_with_letters_that_patterns_know_is_a_key(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no pose in it"):
        read(tmp_path, '%YAML:1.0\n---\n"rvec[": [0, 0, 0]\nrvec(: [0, 0, 0]\n', format="opencv")
