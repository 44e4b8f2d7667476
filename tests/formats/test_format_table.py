"""The table of forms: one row and one file are a form, wherever forms are read, written, recognised and listed."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from frametool.errors import FileProblem, FormatError
from frametool.formats.detect import UNSUPPORTED, by_sign, detect, of_folder
from frametool.formats.load import load
from frametool.formats.rows.pose_rows import ROWS
from frametool.formats.table import FORMATS, Format, by_suffix, readers, writers

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).resolve().parent.parent.parent
TOY = '''
"""Toy: a line a frame, `child < parent x y z`, behind a line that says so."""
from frametool.grammar.edges import Edge

def read(file, options):
    for number, line in enumerate(file.text.split("\\n")[1:], 2):
        if line:
            child, _, parent, *xyz = line.split()
            yield Edge(parent, child, (*map(float, xyz), 0.0, 0.0, 0.0, 1.0), line=number)

def write_tree(tree, style):
    rows = ((child, parent, *map(style.number, edge.components[:3])) for parent, child, edge in tree.edges())
    return "toy 1\\n" + "".join("{} < {} {} {} {}\\n".format(*row) for row in rows)
'''
ROW = {
    "summary": "a toy",
    "suffixes": (".toy",),
    "reads": ("tree",),
    "reader": "toy",
    "writes": ("tree",),
    "writer": "toy",
    "magic": (("line", r"toy \d"),),
}
TEXT = "toy 1\nodom < map 1.0 2.0 3.0\nbase < odom 0.5 0.0 0.0\n"


def with_toy(folder: Path, *arguments: str, stdin: str = "") -> tuple[int, str, str]:
    """Run the command line in a new interpreter in which the toy has its row."""
    (folder / "toy.py").write_text(TOY)
    code = (
        f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; import frametool.formats.table as formats; "
        f"formats.FORMATS['toy'] = formats.Format(**{ROW!r}); from frametool.cli import run; "
        f"sys.exit(run({list(arguments)!r}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], input=stdin, capture_output=True, text=True, check=False, cwd=folder
    )
    return done.returncode, done.stdout, done.stderr


def test_a_made_up_form_is_read_wherever_a_tree_is(tmp_path: Path) -> None:
    (tmp_path / "map.toy").write_text(TEXT)
    status, out, err = with_toy(tmp_path, "lookup", "map.toy", "map", "base", "-f", "json")
    assert (status, json.loads(out)["xyz"]) == (0, [1.5, 2.0, 3.0]), err
    assert with_toy(tmp_path, "tree", "-", "-f", "toy", stdin=TEXT)[:2] == (0, TEXT)
    assert with_toy(tmp_path, "check", "map.toy")[0] == 0
    assert json.loads(with_toy(tmp_path, "monitor", "map.toy", "-f", "json")[1].splitlines()[0])["child"] == "odom"


def test_a_made_up_form_is_written_by_name_and_by_suffix_and_read_back(tmp_path: Path) -> None:
    assert with_toy(tmp_path, "tree", "-", "-o", "out.toy", stdin=TEXT) == (0, "", "")
    assert (tmp_path / "out.toy").read_text() == TEXT
    assert "toy" in with_toy(tmp_path, "formats")[1]
    assert with_toy(tmp_path, "tree", "-v", "out.toy", "-f", "toy")[2] == "frametool: out.toy: a toy\n"


def test_what_is_wrong_in_a_made_up_form_names_its_line(tmp_path: Path) -> None:
    (tmp_path / "map.toy").write_text(TEXT + "base < map 0 0 0\n")
    status, _, err = with_toy(tmp_path, "tree", "map.toy")
    assert (status, "map.toy:4: frame 'base' has two parents: 'odom' (line 3) and 'map' (line 4)" in err) == (1, True)


@pytest.mark.parametrize("name", FORMATS)
def test_a_row_names_modules_that_do_what_it_says(name: str) -> None:
    from importlib import import_module

    row = FORMATS[name]
    functions = {"poses": "write_poses", "points": "write_points", "tree": "write_tree", "report": "write_points"}
    functions |= {"trajectory": "write_poses", "arrays": "create"}
    if "recording" in row.writes:  # poses and points are messages there
        functions = dict.fromkeys(("poses", "points"), "RecordingFile") | dict.fromkeys(("tree", "recording"), "tree_pieces")
    if "arrays" in row.writes:  # poses and points are columns there
        functions |= dict.fromkeys(("poses", "points", "texts"), "create")
    for what in row.writes:
        module = import_module(row.writer)
        by_rows = functions[what] == "write_poses" and name in ROWS
        assert by_rows or hasattr(module, functions[what])
    assert "arrays" not in row.reads or hasattr(import_module(row.reader), "open_columns")
    assert "tree" not in row.reads or hasattr(import_module(row.reader), "read")
    assert row.summary


BEGINNINGS: dict[str, tuple[bytes, str, str]] = {
    "a tree in YAML": (b"# robot\nframes:\n  a:\n", "tree", "yaml"),
    "a tree in JSON": (b'{"angles": "deg",\n "frames": []}', "tree", "json"),
    "a tree in JSON on one line, with what messages have": (b'{"frames": [{"child_frame_id": 1}]}\n', "tree", "json"),
    "an array of numpy": (b"\x93NUMPY\x01\x00v\x00{'descr'", "arrays", "npy"),
    "echo behind noise": (b"WARNING: topic [/tf] x\n\n---\ntransforms:\n- header:\n", "tree", "echo"),
    "echo in UTF-16": ("transforms:\n- header:\n".encode("utf-16"), "tree", "echo"),
    "echo in flow style": (b"transforms: [{header: ..", "tree", "echo"),
    "lines of messages": (b'{"op": "publish", "msg": {}}\n', "tree", "jsonl"),
    "a matrix of JSON row by row": (b'{"T_cam_lidar": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]}\n', "tree", "camchain"),
    "rostopic echo -p": (b"%time,field.header.seq\n", "tree", "csv1"),
    "ros2 topic echo --csv": (b"12,5,map,base,0.0,0.0\n", "tree", "csv2"),
    "calls with flags": (b"# c\nros2 run tf2_ros static_transform_publisher --x 1\n", "tree", "calls"),
    "calls without a name": (b"0 0 5 0 0 0 world odom 100\n", "tree", "calls"),
    "a bag": (b"#ROSBAG V2.0\n", "tree", "bag1"),
    "sqlite": (b"SQLite format 3\0..", "tree", "bag2"),
    "mcap": (b"\x89MCAP0\r\n", "tree", "mcap"),
    "a launch file": (b"<!-- -*- mode: XML -*- -->\n<launch><arg name='x'/>", "tree", "launch"),
    "a launch file with substitutions": (b"<launch><node if='$(arg x)' args='$(find y) ${z}'/>", "tree", "launch"),
    "a launch file in YAML": (b"%YAML 1.2\n---\nlaunch:\n- node: {pkg: x}\n", "tree", "launch"),
    "a launch file in Python": (b"import os\n\ndef generate_launch_description():\n    pass\n", "tree", "launch"),
    "a tree with a frame called launch": (b"frames:\n  launch:\n    a:\n", "tree", "yaml"),
    "a world of Gazebo": (b"<?xml version='1.0' ?>\n<sdf version='1.6'>\n<world name='a'>", "tree", "sdf"),
    "a model of MuJoCo": (b"<mujoco model='a'>\n<compiler angle='radian'/>", "tree", "mjcf"),
    "a model of MuJoCo whose joints are told": (b"<mujoco model='a'>\n<keyframe>", "joints records rows", "mjcf"),
    "URDF": (b'<?xml version="1.0"?>\n<!-- <xacro:a/> ${b} -->\n<robot name="r" xmlns:xacro="x">\n<link', "tree", "urdf"),
    "URDF that begins with a joint": (b'<robot name="r"><joint name="a"><origin/></joint>', "tree", "urdf"),
    "a map of joints": (b"joint: 30deg\n", "joints records rows", "yaml"),
    "rows": (b"x,y,z\n1,2,3\n", "rows records", "csv"),
    "rows as frames": (b"stamp,x,y,z,qx,qy,qz,qw\n", "tree", "csv"),
    "a trajectory": (b"# t x y z qx qy qz qw\n1.5 1 2 -3 0. 0 .5 1e-3\n", "tree", "tum"),
    "a trajectory to be streamed": (b"1.5 1 2 -3 0 0 0 1\n", "rows records", "tum"),
    "a trajectory of matrices": (b"1 0 0 0 0 1 0 0 0 0 1 -1.5e-3\r\n", "tree", "kitti"),
    "EuRoC with a header": (b"#timestamp [ns],p_RS_R_x [m],a,b,q_RS_w [],c\n1,2\n", "tree", "euroc"),
    "EuRoC with blanks in its header": (b"#timestamp, p_RS_R_x [m], q_RS_w []\n1, 2\n", "rows records", "euroc"),
    "EuRoC of eight numbers": (b"1403636579763555584,1,2,3,1,0,0,0\n", "tree", "euroc"),
    "EuRoC of seventeen": (b"1403636579763555584," + b",".join([b"1.5"] * 16) + b"\n", "rows records", "euroc"),
    "COLMAP": (b"# Image list with two lines of data per image:\n", "tree", "colmap"),
    "COLMAP without its comments": (b"1 1 0 0 0 0 0 1 1 a b.jpg\n\n", "rows records", "colmap"),
    "COLMAP with rigs": (b"# Frame list with one line of data per frame:\n", "tree", "colmap"),
    "NeRF": (b'{"fl_x": 1, "frames": [{"file_path": "a", "transform_matrix": [[', "tree", "nerf"),
    "g2o": (b"PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 0 1", "tree", "g2o"),
    "a tree in JSON with frames that have matrices elsewhere": (b'{"frames": [{"name": "a"}]}', "tree", "json"),
    "rows whose first column ends in a colon": (b"a:,y\n1,2\n", "rows records", "csv"),
    "rows under a comment": (b"# t,x,y\n1,2,3\n", "rows records", "csv"),
    "rows between tabs": (b"x\ty,m\n", "rows records", "tsv"),
    "rows between blanks": (b"# a trajectory, in metres\n1.0 2 3\n", "rows records", "columns"),
    "records": (b'\n {"x": 1}\n', "rows records", "json"),
    "an array": (b"[\n {", "rows records", "json"),
    "an array of numbers": (b"[-1, 2]", "rows records", "json"),
    "documents": (b"# c\n- {x: 1}\n", "rows records", "yaml"),
    "a document in braces": (b"{x: 1, y: 2}\n", "rows records", "yaml"),
    "documents with the line ends of Windows": (b"t: 7\r\nx: 1\r\ny: 2\r\n", "rows records", "yaml"),
    "documents behind dashes": (b"---\nx: 1\n", "rows records", "yaml"),
    "Autoware's poses": (b"# kit\nbase/x:\n  kit:\n    x: 0\n    y: -.5\n    roll: 1e-3\n    yaw: 0.0\n", "tree", "autoware"),
    "Autoware's poses in braces": (b"base: {kit: {x: 0, y: 1, z: 2, roll: 0, pitch: 0, yaw: 0}}\n", "tree", "autoware"),
    "one level of numbers, as robot_calibration has it": (b"a_initial_values:\n  x: 0\n  roll: 0\n", "tree", "named"),
    "three levels of numbers": (b"a:\n  b:\n    c:\n      x: 0\n      roll: 0\n", "tree", "yaml"),
    "a tree of ours with two levels": (b"frames:\n  a:\n    b:\n      x: 0\n", "tree", "yaml"),
    "a chain of Kalibr": (b"cam0:\n  T_cam_imu:\n  - [1, 0]\n  distortion_model: radtan\n", "tree", "camchain"),
    "a chain of OpenVINS": (b"%YAML:1.0\n\ncam0:\n  T_imu_cam: # c\n    - [1]\n", "tree", "camchain"),
    "a configuration of okvis": (b"%YAML:1.0\ncameras:\n     - {T_SC:\n        [ 1.0", "tree", "camchain"),
    "a configuration of VINS": (b"%YAML:1.0\n\nimu: 1\nbody_T_cam0: !!opencv-matrix\n   rows: 4\n", "tree", "opencv"),
    "a matrix of OpenCV without its head": (b"body_T_cam0: !!opencv-matrix\n   rows: 4\n", "tree", "opencv"),
    "matrices of OpenCV with names of two frames": (b"%YAML:1.0\n---\nT_b_c: !!opencv-matrix\n   rows: 4\n", "tree", "opencv"),
    "matrices by name": (b"T_base_lidar:\n- [1, 0, 0, 0]\n", "tree", "camchain"),
    "a sensor of EuRoC under OpenCV's head": (b"%YAML:1.0\nT_BS:\n  cols: 4\n", "tree", "euroc-sensor"),
    "OpenCV's XML": (b'<?xml version="1.0"?>\n<opencv_storage>\n<a type_id="opencv-matrix">', "tree", "opencv"),
    "OpenCV's JSON": (b'{"a": {"type_id": "opencv-matrix", "rows": 4}}', "tree", "opencv"),
    "a sensor of EuRoC": (b"#Default\nsensor_type: camera\nT_BS:\n  cols: 4\n", "tree", "euroc-sensor"),
    "KITTI's odometry": (b"P0: 7.2e+02 0 6.1e+02 0 0 7 1 0 0 0 1 0\n", "tree", "kitti-calib"),
    "KITTI's odometry with a bad number": (b"P0: 7.2e+02 0 x 0 0 7 1 0 0 0 1 0\n", "tree", "kitti-calib"),
    "KITTI's tracking without colons": (b"R_rect 9.9e-01 1 0 0 0 0 0 0 1\n", "tree", "kitti-calib"),
    "KITTI's raw recordings": (b"calib_time: 15-Mar-2012 11:37:16\nR: 7.5e-03", "tree", "kitti-calib"),
    "sensors of nuScenes": (b'[\n{\n"token": "f4d",\n"sensor_token": "47f",', "tree", "nuscenes"),
    "ego poses of nuScenes": (b'[{"token": "5a", "timestamp": 15, "rotation": [', "tree", "nuscenes"),
    "a table of joints": (b"joint,theta,d,a,alpha\n1,q1,0.1,0,pi/2\n", "tree", "dh"),
    "a table of joints between blanks": (b"# i  alpha_i-1  a_i-1  d_i  theta_i\n1 0 0 0.3 q1\n", "tree", "dh"),
    "a table of joints with units": ("\u03b8_deg\td (mm)\ta [mm]\t\u03b1 [deg]\n".encode(), "tree", "dh"),
    "a table of joints in YAML": (b"dh:\n  - {joint: one, theta: 0, d: 0, a: 1, alpha: 0}\n", "tree", "dh"),
    "a table of joints in JSON": (b'[{"alpha": 0, "a": 0.3, "d": 0.1}]', "tree", "dh"),
    "a tree of ours about alpha": (b"frames:\n  alpha:\n    a: {xyz: [1, 0, 0]}\n    d: {}\n", "tree", "yaml"),
    "a table of numbers about colours": (b"a,alpha,blue\n1,2,3\n", "rows records", "csv"),
    "a hand-eye calibration": (b"parameters:\n  eye_on_hand: true\ntransformation: {x: 1}\n", "tree", "handeye"),
    "a second hand-eye calibration": (b"parameters:\n  tracking_base_frame: a\n", "tree", "handeye"),
}


@pytest.mark.parametrize("name", BEGINNINGS)
def test_a_form_is_known_by_how_it_begins(name: str) -> None:
    head, reads, form = BEGINNINGS[name]
    assert detect(head, *reads.split()) == form


def test_a_folder_is_known_by_what_it_holds(tmp_path: Path) -> None:
    assert of_folder(str(tmp_path)) is None
    (tmp_path / "metadata.yaml").write_text("")
    assert of_folder(str(tmp_path)) == "bag2"
    assert of_folder(str(tmp_path / "metadata.yaml")) is None


def test_the_suffix_counts_more_than_the_look_and_less_than_a_sign() -> None:
    assert detect(b"1 2 3\n", "rows", "records", name="a.csv") == "csv"
    assert detect(b"1 2 3\n", "rows", "records", name="a.txt") == "columns"
    assert detect(b"\x89MCAP0\r\n", "tree", name="a.yaml") == "mcap"
    assert detect(b"frames:\n", "tree", name="a.bag") == "yaml"
    assert detect(b"<robot name='a'/>", "tree", name="a.yaml") == "urdf"


def test_two_forms_that_fit_are_both_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("toy", "other"):
        monkeypatch.setitem(FORMATS, name, Format("a toy", reads=("tree",), magic=(("yaml key", "toys"),)))
    with pytest.raises(FormatError, match=r"^a\.yaml: fits toy and other; give --in toy\|other$"):
        by_sign(b"toys:\n", "tree", name="a.yaml")


def test_a_form_that_is_read_goes_before_one_that_is_only_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FORMATS, "toy", Format("a toy", reads=("tree",), magic=(("yaml key", "toys"),)))
    assert by_sign(b"distortion_model: x\ntoys:\n", "tree") == "toy"


def test_the_root_element_of_xml_is_a_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FORMATS, "toy", Format("a toy", reads=("tree",), magic=(("xml", "toys"),)))
    for head in (b"<toys name='a'>", b"<?xml version='1.0'?>\n<!-- <b> -->\n<!DOCTYPE x>\n<toys>", b"\xef\xbb\xbf<toys/>"):
        assert by_sign(head, "tree") == "toy"
    assert by_sign(b"<toy>", "tree") is None


@pytest.mark.parametrize("name", FORMATS)
def test_a_suffix_belongs_to_one_form_of_each_kind(name: str) -> None:
    kinds: list[tuple[Any, ...]] = [readers(what) for what in ("tree", "rows", "records")]
    kinds += [writers(what) for what in ("poses", "points", "tree", "report")]
    for names in kinds:
        for suffix in FORMATS[name].suffixes if name in names else ():
            assert by_suffix(f"dir.d/a{suffix}", names) == name


def test_a_name_without_a_suffix_tells_nothing() -> None:
    for path in (None, "", "a", "dir.csv/a", ".csv"):
        assert by_suffix(path, tuple(FORMATS)) is None


@pytest.mark.parametrize(
    ("text", "form"),
    [("x\ty\tz\n1\t2\t3\n", "tsv"), ('"x [m]"\t"y"\t\r\n1\t2\t\r\n', "tsv"), ("x;y;z\n1;2;3\n", "semicolon"), ("a\tb,x,y\n1\t2,3,4\n", "csv")],
)
def test_rows_with_the_suffix_of_csv_are_parted_by_what_is_between_their_names(text: str, form: str) -> None:
    assert detect(text.encode(), "rows", "records", name="a.csv") == form


@pytest.mark.parametrize("output", [("-f", "csv"), ("-o", "x.csv"), ("-f", "json"), ()])
@pytest.mark.parametrize(("text", "form"), [("1 2 3\n4 5 6\n", "columns"), ("x,y,z\n1,2,3\n", "csv"), ("x\ty\tz\n1\t2\t3\n", "tsv")])
def test_the_form_of_the_result_does_not_steer_how_the_input_is_read(
    run: Callable[..., Any], output: tuple[str, ...], text: str, form: str
) -> None:
    tree = "{name: a, parent: map, xyz: [1, 0, 0]}"
    assert f"read as {form} " in run("apply", tree, "map", "a", "-v", *output, stdin=text).err


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("x,y,z\n1,2,3\n".encode("utf-16"), "UTF-16, which is not read here"),
        (b"\x89PNG\r\n\x1a\n\0\0", "not text but a PNG picture"),
        (bytes(range(256)), "not text but binary data"),
    ],
)
@pytest.mark.parametrize("name", ["", "a.csv", "a.jsonl"])
def test_a_stream_of_what_is_no_utf_8_is_named_as_what_it_is(data: bytes, said: str, name: str) -> None:
    with pytest.raises(FormatError, match=said) as caught:
        detect(data, "rows", "records", name=name)
    assert not caught.value.snippet


def test_a_word_that_only_yaml_reads_is_read_as_yaml(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text('{frames: {"a\\e[31m": {b: {xyz: [1, 0, 0]}}}}')
    assert set(load(tmp_path / "a.yaml").frames) == {"a\x1b[31m", "b"}


FOREIGN = [
    "map", "launch", "directives", "distortion_model", "projection_matrix", "occupied_thresh", "T_cam_imu", "T_BS",
    "eye_on_hand", "transforms", "header", "parameters", "opencv_storage", "angles",
]  # fmt: skip


@pytest.mark.parametrize("name", FOREIGN)
@pytest.mark.parametrize(
    "text",
    [
        "frames:\n  {}:\n    b: {{xyz: [1, 0, 0]}}\n",
        "# c\nangles: deg\nframes:\n  a:\n    {}:\n      xyz: {{x: 1, y: 2, z: 3}}\n      rpy: {{roll: 0, pitch: 0, yaw: 0}}\n",
        "frames:\n- name: {}\n  parent: b\n  xyz: [1, 0, 0]\n",
        "frames:\n  a:\n    b:\n      xyz: [0, 0, 1]\n      children:\n        {}: {{xyz: [1, 0, 0]}}\n",
        "'frames':\n  a: {{{}: {{xyz: [1, 0, 0]}}}}\n",
        "{{frames: {{a: {{{}: {{xyz: [1, 0, 0]}}}}}}}}\n",
        '{{"frames": {{"a": {{"{}": {{"xyz": [1, 0, 0]}}}}}}}}\n',
        '{{\n"frames": {{\n  "{}": {{"b": {{"xyz": [1, 0, 0]}}}}}}}}\n',
        "name: {}\nparent: b\nxyz: {{x: 1, y: 2, z: 3}}\nrpy: {{roll: 0, pitch: 0, yaw: 0}}\n",
    ],
)
def test_a_tree_of_ours_stays_ours_whatever_its_frames_are_called(name: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_text(text.format(name))
    assert name in load(path).frames


@pytest.mark.parametrize("beside", ["distortion_model: x", "directives: []", "T_BS: 1", "launch: []"])
def test_frames_make_a_tree_ours_whatever_stands_beside_them(beside: str, tmp_path: Path) -> None:
    path = tmp_path / "a"
    for text in (f"{beside}\nframes: {{a: {{b: {{xyz: [1, 0, 0]}}}}}}\n", f"frames:\n  a:\n{beside}\n"):
        path.write_text(text)
        with pytest.raises(FormatError, match=r"unknown key .* next to frames"):
            load(path)


KNOWN: dict[str, tuple[bytes, str]] = {
    "directives of Drake": (b"# c\n\ndirectives:\n- add_model:\n", "drake"),
    "a stream of Arrow": (b"\xff\xff\xff\xff\x80\0\0\0" + bytes(40), "arrows"),
    "NPZ": (b"PK\x03\x04" + bytes(26) + b"points.npy" + bytes(20), "npz"),
    "Open3D's JSON": (b'{"class_name": "PinholeCameraTrajectory", "parameters": [{"extrinsic": [1', "open3d"),
    "Bundler": (b"# Bundle file v0.3\n1 2\n", "bundler"),
    "SRDF": (b'<?xml version="1.0"?>\n<robot name="r"><!-- c --><group name="arm">', "srdf"),
    "SRDF of collisions": (b'<robot name="r">\n<disable_collisions link1="a"/>', "srdf"),
    "camera_info": (b"image_width: 640\ncamera_matrix: {rows: 3}\nprojection_matrix: {rows: 3}\n", "cameras"),
    "camera_info as echo prints it": (b"header:\n  frame_id: a\nheight: 4\ndistortion_model: plumb_bob\n---\n", "cameras"),
    "camera_info as ini": (b"# oST version 5.0 parameters\n\n\n[image]\n\nwidth\n640\n", "cameras"),
    "Kalibr without places": (b"cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  rostopic: /a\n", "cameras"),
    "COLMAP's cameras": (b"# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 SIMPLE_PINHOLE 3072 2304 2559.81 1536 1152\n", "cameras"),
    "FAST-LIO": (b"mapping:\n  acc_cov: 0.1\n  extrinsic_T: [0, 0, 0]\n  extrinsic_R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n", "lio"),
    "LIO-SAM": (b"lio_sam:\n  imuTopic: imu\n  extrinsicTrans: [0, 0, 0]\n  extrinsicRot: [-1, 0, 0, 0, 1, 0, 0, 0, -1]\n", "lio"),
    "LIO-SAM of ROS 2": (b"/**:\n  ros__parameters:\n    extrinsicRot: [-1, 0, 0, 0, 1, 0, 0, 0, -1]\n", "lio"),
    "a map": (b"image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\n", "map"),
    "USD in ASCII": (b'#usda 1.0\n(\n)\ndef Xform "World"\n', "scene"),
    "USD in binary": (b"PXR-USDC" + bytes(80), "scene"),
    "glTF": (b'{"scene": 0, "asset": {"version": "2.0"}, "nodes": []}', "scene"),
    "glTF in binary": (b"glTF\x02\0\0\0" + bytes(40), "scene"),
    "Unity": (b"%YAML 1.1\r\n%TAG !u! tag:unity3d.com,2011:\n--- !u!1 &1\n", "scene"),
    "ITK": (b"#Insight Transform File V1.0\n#Transform 0\n", "itk"),
    "xacro": (b'<?xml version="1.0"?>\n<robot name="a">\n<xacro:macro name="b"/>\n</robot>', "xacro"),
    "xacro by its substitutions": (b'<robot name="a"><link name="${b}link"/></robot>', "xacro"),
}


@pytest.mark.parametrize("name", KNOWN)
def test_a_form_that_is_not_read_is_named_in_one_short_line_with_what_to_do(run: Callable[..., Any], name: str) -> None:
    head, form = KNOWN[name]
    found = run("tree", "file", files={"file": head})
    assert (found.status, found.out) == (1, "")
    assert found.err == f"frametool: file: {UNSUPPORTED[form]}\n"
    assert len(found.err) < 200


@pytest.mark.parametrize("suffix", [suffix for row in UNSUPPORTED.values() for suffix in row.suffixes])
def test_a_suffix_tells_of_a_form_that_is_not_read_where_no_sign_does(run: Callable[..., Any], suffix: str) -> None:
    form = next(name for name, row in UNSUPPORTED.items() if suffix in row.suffixes)
    assert UNSUPPORTED[form].remedy in run("check", f"a{suffix}", files={f"a{suffix}": b"PK\x03\x04...."}).err
    assert run("tree", f"b{suffix}", files={f"b{suffix}": "frames: {a: {b: {xyz: [1, 2, 3]}}}"}).status == 0


UNKNOWN: dict[str, tuple[bytes, str]] = {
    "prose": (b"The quick brown fox\njumps over it\n", "cannot detect the format of this text; formats: yaml, "),
    "a note": (b"Note: my password is hunter2\nother: thing\n", "cannot detect the format of this text; formats: yaml, "),
    "a letter": (b"Dear reader, my password is hunter2.\nThis is prose: it has a colon.\nbye\n", "cannot detect the format of this text"),
    "a word": (b"hunter2", "cannot detect the format of this text"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "not text but a PNG picture; `frametool formats` lists what is read"),
    "code": (b"import os\nprint(1)\n", "cannot detect the format of this text; formats: yaml, "),
    "a huge line": (b"abc " * 200_000, "cannot detect the format of this text"),
    "XML": (b'<?xml version="1.0"?>\n<!-- c --><note><to>Bob</to></note>', "format of XML with the root element note; formats: "),
    "HTML": (b"<!DOCTYPE html>\n<html><body>" + b"x" * 9999, "format of XML with the root element html; formats: "),
    "binary data": (bytes(range(256)) * 9, "not text but binary data"),
    "gzip": (b"\x1f\x8b\x08\0abc", "not text but gzip data; unpack it first"),
    "zip": (b"PK\x03\x04abc", "not text but a zip archive; unpack it first"),
    "escapes": (b"\x1b[31mred\x1b[0m fox\n", "cannot detect the format of this text"),
    "keys of no tree": (b"".join(b"key_%d: 1\n" % each for each in range(999)), "no frame tree: "),
    "long keys of no tree": (b"{" + b"".join(b'"%d%s": 1,' % (each, b"x" * 500) for each in range(9)) + b'"a": 1}', "no frame tree: "),
    "text under dashes": (b"--- |\n" + b"  words and more words\n" * 999, "cannot detect the format of this text"),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_what_is_no_form_is_told_in_one_line_without_its_content(run: Callable[..., Any], name: str) -> None:
    data, said = UNKNOWN[name]
    found = run("tree", "file", files={"file": data})
    assert (found.status, found.out) == (1, "")
    first, *snippet = found.err.splitlines()
    assert said in first
    assert len(first) <= 260
    assert all(len(line) <= 81 for line in snippet)
    if "cannot tell" in first:
        assert first.endswith("; `frametool formats` lists all, --in FORMAT sets one")


@pytest.mark.parametrize("data", [b"", b"  \n\n", b"# only a comment\n", b"\xef\xbb\xbf"])
def test_an_empty_file_has_no_frames(run: Callable[..., Any], data: bytes) -> None:
    found = run("tree", "file", files={"file": data})
    assert (found.status, found.err) == (1, "frametool: file: no frames in it\n")


@pytest.mark.parametrize("text", ["#timestamp,x,y,z,qw,qx,qy,qz\n", "stamp,parent,child,x,y,z,qx,qy,qz,qw\n"])
def test_a_table_without_rows_has_no_frames(run: Callable[..., Any], text: str) -> None:
    found = run("tree", "a.csv", files={"a.csv": text.encode()})
    assert (found.status, found.out, found.err) == (1, "", "frametool: a.csv: no frames in it\n")


@pytest.mark.parametrize("gap", ["\n", " \n", "#\n", "{\n", "a:\n", "a:\n" + 50 * "\n"])
def test_a_long_beginning_without_data_is_told_at_once(gap: str) -> None:
    head = gap.encode() * (60_000 // len(gap)) + b"hello world\n"
    begun = perf_counter()
    with suppress(FormatError):
        detect(head, "tree")
    assert perf_counter() - begun < 5.0


def test_a_form_that_is_not_read_cannot_be_told_either(run: Callable[..., Any]) -> None:
    found = run("tree", "--in", "xacro", "-", stdin="<robot/>")
    assert found.status == 2
    assert UNSUPPORTED["xacro"].remedy in found.err


def test_verbose_says_what_a_file_was_taken_for(run: Callable[..., Any]) -> None:
    said = run("tree", "a.yaml", "-v", files={"a.yaml": "frames: {a: {b: {xyz: [1, 0, 0]}}}"}).err
    assert said == f"frametool: a.yaml: {FORMATS['yaml'].summary}\n"
    assert run("tree", "a.yaml", "-v", "--in", "yaml").err == f"frametool: a.yaml: {FORMATS['yaml'].summary}\n"


BOTH = (
    "T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1]}\n"
    "parameters:\n  eye_on_hand: false\n  robot_base_frame: base\n  tracking_base_frame: cam\n"
    "transformation: {x: 1, y: 2, z: 3, qx: 0, qy: 0, qz: 0, qw: 1}\n"
)


def test_a_file_that_two_forms_fit_is_read_as_the_one_that_is_told(run: Callable[..., Any]) -> None:
    done = run("tree", "a.yaml", files={"a.yaml": BOTH})
    assert (done.status, done.err) == (1, "frametool: a.yaml: fits euroc-sensor and handeye; give --in euroc-sensor|handeye\n")
    assert "name: a," in run("tree", "a.yaml", "--in", "euroc-sensor").out
    assert "name: cam," in run("tree", "a.yaml", "--in", "handeye").out


MATRIX = "{cols: 4, rows: 4, data: [1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1]}"


@pytest.mark.parametrize(
    "text",
    [f"cam0: {{T_BS: {MATRIX}}}\n", f"cam0:\n  T_BS: {MATRIX}\n", json.dumps({"cam0": {"T_BS": yaml.safe_load(MATRIX)}})],
)
def test_a_sensor_under_its_name_is_known(run: Callable[..., Any], text: str) -> None:
    assert '"parent": "body", "xyz": [1.0, 2.0, 3.0]' in run("lookup", "-", "body", "cam0", "-f", "json", stdin=text).out


def test_extrinsics_of_apollo_have_a_name(run: Callable[..., Any]) -> None:
    text = (
        "header:\n  frame_id: lidar\nchild_frame_id: camera\ntransform:\n  translation: {x: 1, y: 2, z: 3}\n"
        "  rotation: {z: 0, y: 0, x: 0, w: 1}\n  euler_angles_degree:\n    pitch: 0\n    yaw: 5\n    roll: 0\n"
    )
    for told in ((), ("--in", "apollo")):
        done = run("lookup", "-", "lidar", "camera", "-f", "json", *told, stdin=text)
        assert '"xyz": [1.0, 2.0, 3.0]' in done.out
        assert "euler_angles_degree differs from the quaternion by 5 degrees; the quaternion is used" in done.err


@pytest.mark.parametrize("suffix", ["bag", "mcap", "db3"])
def test_an_empty_recording_is_empty_whatever_is_installed(run: Callable[..., Any], suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    done = run("tree", f"a.{suffix}", files={f"a.{suffix}": b""})
    assert (done.status, done.err) == (1, f"frametool: a.{suffix}: nothing in it: an empty file is not a bag\n")


def test_a_cloud_without_y_has_no_points(run: Callable[..., Any]) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 1\n" + "".join(f"property float {name}\n" for name in ("x", "nx", "ny", "nz"))
    done = run("apply", "--transform", "{xyz: [1, 2, 3]}", "-i", "a.ply", "-f", "csv", files={"a.ply": f"{head}end_header\n1 0 0 1\n"})
    assert (done.status, done.err.count("\n")) == (1, 1)
    assert "no columns of a point or pose among: x, nx, ny, nz" in done.err
    assert run("tree", "a.ply").err == "frametool: a.ply: PLY point cloud or mesh: no frames in it; frametool convert and apply read it\n"


@pytest.mark.parametrize("name", [name for name, row in UNSUPPORTED.items() if row.was_written])
def test_a_form_that_was_written_is_refused_as_an_output_with_what_to_write(run: Callable[..., Any], name: str) -> None:
    remedy = UNSUPPORTED[name].remedy
    for output in (("-f", name), ("-o", f"a{UNSUPPORTED[name].suffixes[0]}")):
        found = run("convert", *output, stdin="x,y,z\n1,2,3\n")
        assert (found.status in (1, 2), found.out, found.err.count("\n"), remedy in found.err) == (True, "", 1, True)


@pytest.mark.parametrize(("data", "said"), [
    (b"<note/>", "cannot detect the format of XML with the root element note; none of those read here is XML; `frametool "),
    (b"<!DOCTYPE note [" + b"<!ELEMENT a>" * 6000, "cannot detect the format of XML without an element in its first 64 KiB; none of"),
    (b"<!DOCTYPE note", "cannot detect the format of XML without an element; none of those read here is XML; `frametool "),
])  # fmt: skip
def test_xml_where_no_form_is_xml_names_no_forms(run: Callable[..., Any], data: bytes, said: str) -> None:
    found = run("convert", "file.xml", files={"file.xml": data})
    assert (found.status, found.out) == (1, "")
    assert said in found.err


@pytest.mark.parametrize("number", [1, True])
def test_a_number_is_no_file(number: int) -> None:
    with pytest.raises(FileProblem, match=f"'{number}' is no file name"):
        load(number)  # type: ignore[arg-type]
