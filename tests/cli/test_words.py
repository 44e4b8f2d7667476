"""Words of OpenCV, COLMAP, Universal Robots and ABB for a pose, and the inverse wherever a pose stands."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

TURNED = {"xyz": [1.0, 2.0, 3.0], "quaternion": {"x": 0.0, "y": 0.0, "z": 1.0, "w": 0.0}}
ROWS = "[[-1, 0, 0], [0, -1, 0], [0, 0, 1]]"
MAPPINGS = [
    '{"qvec": [0, 0, 0, 1], "tvec": [1, 2, 3]}',
    f'{{"R": {ROWS}, "t": [1, 2, 3]}}',
    f'{{"R": {ROWS}, "T": [[1], [2], [3]]}}',
    f'{{"R": {ROWS}, "t": [[1, 2, 3]]}}',
    f'{{"rotation_matrix": {ROWS}, "tvec": [[1, 2, 3]]}}',
    f'{{"rot": {ROWS}, "trans": [1, 2, 3]}}',
    '{"quat": {"x": 0, "y": 0, "z": 1, "w": 0}, "pos": [1, 2, 3]}',
    '{"T": [[-1, 0, 0, 1], [0, -1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}',
    f'{{"R": {ROWS}, "t": [1, 2, 3], "xyz": [1, 2, 3], "rpy_deg": [0, 0, 180]}}',
    '{"qvec_w": 0, "qvec_x": 0, "qvec_y": 0, "qvec_z": 1, "tvec_x": 1, "tvec_y": 2, "tvec_z": 3}',
    '{"rot_w": 0, "rot_x": 0, "rot_y": 0, "rot_z": 1, "trans_x": 1, "trans_y": 2, "trans_z": 3}',
    '{"xyz": ["100cm", "2m", "3000mm"], "rpy_deg": [0, 0, 180]}',
    '{"x": "100cm", "y": 2, "z": "3000mm", "yaw_deg": 180}',
]


@pytest.mark.parametrize("text", MAPPINGS)
def test_a_mapping_is_the_same_pose_as_an_argument_a_line_and_a_document(text: str, run: Run) -> None:
    for done in (
        run("convert", text, "-f", "json"),
        run("convert", "a.yaml", "-f", "json", files={"a.yaml": text.replace('"', "")}),
        run("invert", f"inv({text})", "-f", "json"),
    ):
        assert json.loads(done.out) == TURNED, done.err
    lines = run("convert", "-f", "yaml", stdin=f"{text}\n{text}\n")
    assert lines.out == "\n---\n".join(["xyz: [1.0, 2.0, 3.0]\nquaternion: {x: 0.0, y: 0.0, z: 1.0, w: 0.0}"] * 2) + "\n"


@pytest.mark.parametrize("text", [each for each in MAPPINGS if "_x" not in each and '"x": "' not in each])
def test_a_tree_reads_it_too(text: str, run: Run) -> None:
    done = run("lookup", f'{{"parent_frame": "a", "child": "b", {text[1:]}', "a", "b", "-f", "json")
    assert json.loads(done.out) == {"name": "b", "parent": "a"} | TURNED, done.err


def test_a_rotation_vector_is_in_radians_whatever_other_angles_are(run: Run) -> None:
    header, row = "rvec_x,rvec_y,rvec_z,tvec_x,tvec_y,tvec_z", "0,0,1,1,2,3"
    table = run("convert", "--deg", "-f", "json", stdin=f"{header}\n{row}\n")
    for text in ("{rvec: [0, 0, 1], tvec: [1, 2, 3]}", "{rvec: {x: 0, y: 0, z: 1}, tvec: [1, 2, 3]}", "p[1, 2, 3, 0, 0, 1]"):
        done = run("convert", text, "--deg", "-f", "json")
        assert done.out == table.out
        assert json.loads(done.out)["quaternion"]["z"] == pytest.approx(math.sin(0.5), abs=1e-15)
    moved = run("apply", "--transform", "{xyz: [1, 0, 0]}", stdin=f"{header}\n{row}\n")
    assert moved.out == f"{header}\n0.0,0.0,1.0,2.0,2.0,3.0\n"


def test_lines_keep_their_words_and_what_says_the_same_twice_is_written_once(run: Run) -> None:
    text = '{"t": 0.5, "R": [[1,0,0],[0,1,0],[0,0,1]], "trans": [1,2,3], "xyz": [1,2,3]}\n'
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", stdin=text + text.replace("0.5", "0.625"))
    row = '{{"t": {}, "R": [[1.0,0.0,0.0],[0.0,1.0,0.0],[0.0,0.0,1.0]], "trans": [2.0,2.0,3.0]}}\n'
    assert done.out == row.format(0.5) + row.format(0.625)


ROBOTS = (
    "p[0.1, 0.2, 0.3, 0, 0, 3.141592653589793]",
    "pose = p[0.1, 0.2, 0.3, 0, 0, 3.141592653589793]",
    "[[100, 200, 300], [0, 0, 0, 1], [0, 0, 0, 0], [9E9, 9E9, 9E9, 9E9, 9E9, 9E9]]",
    "CONST robtarget p10:=[[100,200,300],[0,0,0,1],[1,1,0,0],[11,12.3,9E9,9E9,9E9,9E9]];",
    "CONST pose home:=[[100,200,300],[0,0,0,1]];",
)


@pytest.mark.parametrize("text", ROBOTS)
def test_what_robots_print_is_read_as_pasted(text: str, run: Run) -> None:
    for done in (run("convert", text, "-f", "json"), run("convert", "-f", "json", stdin=text + "\n")):
        pose = json.loads(done.out)
        assert (pose["xyz"], done.err) == ([0.1, 0.2, 0.3], "")
        assert pose["quaternion"]["z"] == 1.0
        assert abs(pose["quaternion"]["w"]) < 1e-15


def test_two_lists_are_what_from_says(run: Run) -> None:
    done = run("convert", "[[1, 2, 3], [0, 0, 1, 0]]", "--from", "xyzw", "-f", "json")
    assert (json.loads(done.out), done.err) == (TURNED, "")


@pytest.mark.parametrize(("text", "told"), [
    ("{pos: [1, 2, 3], quat: [0, 0, 0, 1]}", "argument:1:24: quat [0, 0, 0, 1] has no order; write xyzw: [..], wxyz: [..] or {x:, y:, z:, w:}"),
    ("{position: [1, 2, 3], orientation: [0, 0, 0, 1]}", "argument:1:36: orientation [0, 0, 0, 1] has no order; write xyzw: [..], wxyz: [..] or {x:, y:, z:, w:}"),
    ("{rot: [0, 0, 1, 0], trans: [1, 2, 3]}", "argument:1:7: rot [0, 0, 1, 0] has no order; write xyzw: [..], wxyz: [..] or {x:, y:, z:, w:}"),
    ("{rot: [0, 0, 1], trans: [1, 2, 3]}", "argument:1:7: rot [0, 0, 1] does not say what it is; write rpy: [..], rpy_deg: [..] or rotvec: [..]"),
    ("{R: [0, 0, 1], t: [1, 2, 3]}", "argument:1:5: R [0, 0, 1] does not say what it is; write rpy: [..], rpy_deg: [..] or rotvec: [..]"),
    ("{child: a, name: b, xyz: [0, 0, 1]}", "argument:1:18: name says 'b' and child says 'a'; keep one"),
    ("{rvec: [0, 0, 1], tvec: [1, 2, 3], xyz: [1, 2, 4]}", "argument:1:41: two positions in one entry disagree by 1 m; keep one"),
    ("{rvec: [0, 0, 0], rpy_deg: [0, 0, 90]}", "argument:1:28: two rotations in one entry disagree by 90 degrees; keep one"),
    ("{xyz: [1, 2, 3], x: 4, y: 5, z: 6, rpy: [0, 0, 0]}", "argument:1:18: expected one position, found xyz and x y z"),
    ("p[0.1, 0.2, 0.3]", "argument: p[..] of Universal Robots has six numbers (x, y, z, rx, ry, rz); found 3"),
])  # fmt: skip
def test_what_words_leave_open_is_said(text: str, told: str, run: Run) -> None:
    done = run("convert", text)
    assert (done.out, done.err.splitlines()[0]) == ("", f"frametool: {told}")


def test_three_columns_of_rot_are_no_position(run: Run) -> None:
    done = run("convert", stdin="rot_x,rot_y,rot_z\n0,0,1\n")
    told = "columns rot_x rot_y rot_z do not say what they are; name them roll, pitch, yaw or rotvec_x, rotvec_y, rotvec_z"
    assert done.err == f"frametool: stdin:1: {told}\n"


def test_the_rectification_of_a_camera_is_no_pose(run: Run) -> None:
    done = run("convert", '{"K": [1,0,0,0,1,0,0,0,1], "R": [1,0,0,0,1,0,0,0,1], "P": [1,0,0,0,0,1,0,0,0,0,1,0]}')
    assert done.status == 2
    assert "found the keys 'K', 'R', 'P'" in done.err


def test_lengths_with_a_unit_in_cells_and_arguments(run: Run) -> None:
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "--on-error", "skip", stdin="x,y,z\n10cm,0,1\n1,2,3deg\n")
    assert done.out == "x,y,z\n1.1,0.0,1.0\n"
    assert "stdin:3:z: '3deg' is not a length; write metres, or a unit: 2cm, 20mm, 0.02m (row skipped)" in done.err
    assert run("apply", "--transform", "{xyz: [1, 0, 0]}", "10cm", "0", "2mm").out == "point: [1.1, 0.0, 0.002]\n"
    assert run("convert", "--from", "rpy", "10cm", "0", "2", "0", "0", "0").out.startswith("xyz: [0.1, 0.0, 2.0]\n")


@pytest.mark.parametrize(("parent", "child"), [("parent", "child"), ("parent_frame", "child_frame"), ("frame_id", "child")])
def test_names_of_frames_are_the_same_in_tables_lines_and_trees(parent: str, child: str, run: Run) -> None:
    table = f"{parent},{child},x,y,z,yaw_deg\nbase,cam,1,2,3,90\ncam,imu,1,0,0,0\n"
    assert json.loads(run("lookup", "t.csv", "base", "imu", "-f", "json", files={"t.csv": table}).out)["xyz"] == [1.0, 3.0, 3.0]
    assert run("invert", stdin=table).out.splitlines()[1] == "cam,base,-2.0,1.0,-3.0,-90.0"
    line = run("invert", stdin=f'{{"{parent}": "a", "{child}": "b", "xyz": [1, 2, 3]}}\n')
    assert line.out == f'{{"{parent}": "b", "{child}": "a", "xyz": [-1.0, -2.0, -3.0]}}\n'
    lines = f'{{"{parent}": "base", "{child}": "cam", "xyz": [1, 2, 3]}}\n{{"{parent}": "cam", "{child}": "imu", "xyz": [1, 0, 0]}}\n'
    assert json.loads(run("lookup", "t.jsonl", "base", "imu", "-f", "json", files={"t.jsonl": lines}).out)["xyz"] == [2.0, 2.0, 3.0]


P = '{"parent": "b", "name": "a", "xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}'
BACK = {"name": "b", "parent": "a", "xyz": [-2.0, 1.0, -3.0], "quaternion": {"x": 0.0, "y": 0.0, "z": -0.7071067811865476, "w": 0.7071067811865476}}


@pytest.mark.parametrize("spelled", [[f"inv({P})"], [f"~{P}"], ["inv", P], ["inv(a.json)"], ["inv(-)"], ["inv", "-"], [f"~~~{P}"]])
def test_the_inverse_stands_wherever_a_pose_does(spelled: list[str], run: Run) -> None:
    more: dict[str, Any] = {"files": {"a.json": P}, "stdin": P if "-" in spelled[-1] else ""}
    assert json.loads(run("convert", *spelled, "--to", "quaternion", "-f", "json", **more).out) == BACK
    assert json.loads(run("invert", *spelled, "--to", "rpy_deg", "-f", "json", **more).out)["xyz"] == [1.0, 2.0, 3.0]
    assert json.loads(run("mean", *spelled, "-f", "json", **more).out)["xyz"] == BACK["xyz"]
    seen = json.loads(run("relative", "{parent: a, name: c}", *spelled, "-f", "json", **more).out)
    assert (seen["parent"], seen["name"], seen["xyz"]) == ("c", "b", BACK["xyz"])
    between = json.loads(run("interpolate", *spelled, '{"xyz": [0, 0, 0]}', "0", "-f", "json", **more).out)
    assert between["xyz"] == BACK["xyz"]
    moved = run("apply", "--transform", *(spelled if spelled[-1] != "-" else ["inv(-)"]), "1", "2", "3", "-f", "json", **more)
    assert json.loads(moved.out) == {"frame": "a", "point": [0.0, 0.0, 0.0]}


def test_the_inverse_of_rows_is_a_stream(run: Run) -> None:
    table = "x,y,z,yaw_deg\n1,2,3,90\n"
    assert run("convert", "inv(t.csv)", "--to", "rpy_deg", files={"t.csv": table}).out.splitlines()[1] == "-2.0,1.0,-3.0,0.0,0.0,-90.0"
    derived = run("relative", "--explain", f"inv({P})", "{xyz: [1, 2, 3]}")
    assert "its inverse is a_from_b" in derived.out


def test_publisher_arguments_in_quotes_are_read(run: Run) -> None:
    done = run("convert", "1 2 3 0 0 0 base cam", "-f", "json")
    assert json.loads(done.out)["xyz"] == [1.0, 2.0, 3.0]
    assert done.err == "frametool: warning: argument: taken for arguments of static_transform_publisher: x y z yaw pitch roll PARENT CHILD\n"
    quoted = run("static", "1 2 3 0 0 0 base cam", "-f", "json").out
    assert quoted == run("static", "1", "2", "3", "0", "0", "0", "base", "cam", "-f", "json").out


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("calc", "-e", P, "-f", "ply"), "ply holds columns of numbers"),
        (("relative", "-i", "images.txt"), "columns of two poses are wanted, found x y z; qx qy qz qw"),
        (("apply", "--transform", "{rpy: [0, 0, 1]}", "[1, 2, 3]", "--as", "twist"), "a twist has linear and angular, two vectors"),
        (("invert", "list.txt", "--time-offset", "first"), "list.txt:1:1: a key must be one text"),
    ],
)  # fmt: skip
def test_what_found_no_other_place_is_refused_in_one_sentence(command: tuple[str, ...], said: str, run: Run) -> None:
    files = {"images.txt": "# Image list with two lines\n1 1 0 0 0 0 0 0 1 a.png\n\n", "list.txt": "[ INFO] [17]: Spinning\n"}
    done = run(*command, files=files)
    assert (done.status in (1, 2), said in done.err) == (True, True)
    rows = ("convert", "-i", "list.txt", "--in", "yaml")
    assert run(*rows, "--time-offset", "1s", files=files).out == run(*rows, files=files).out
