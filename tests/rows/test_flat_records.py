"""Rotations told by flat keys are read as columns of these names are; what is ambiguous is a fault that says so."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from flow import INVERT, MOVE, convert, flow

if TYPE_CHECKING:
    from collections.abc import Callable

H = 0.7071067811865476


def moved(record: str) -> dict[str, object]:
    one, many = (flow((record + "\n").encode() * count, MOVE, "json") for count in (1, 40))
    assert many.text == one.text * 40
    assert one.told == []
    found: dict[str, object] = json.loads(one.text)
    return found


def test_flat_quaternions_turn() -> None:
    record = moved('{"x":1,"y":2,"z":3,"qw":1,"k":7,"qx":0,"qy":0,"qz":0}')
    assert record == {"x": -1.0, "y": 3.0, "z": 6.0, "qw": H, "k": 7, "qx": 0.0, "qy": 0.0, "qz": H}


def test_flat_angles_turn() -> None:
    record = moved('{"x":1,"y":2,"z":3,"roll_deg":0,"pitch_deg":0,"yaw_deg":0}')
    assert record["yaw_deg"] == pytest.approx(90)


def test_a_flat_position_beside_a_rotation_is_its_position() -> None:
    record = moved('{"x":1,"y":2,"z":3,"quaternion":{"x":0,"y":0,"z":0,"w":1}}')
    assert record == {"x": -1.0, "y": 3.0, "z": 6.0, "quaternion": {"x": 0.0, "y": 0.0, "z": H, "w": H}}


@pytest.mark.parametrize("scalar", ['"t":0.5', '"point":"A"'])
@pytest.mark.parametrize("names", [("lidar_x", "lidar_y", "lidar_z"), ("x_est", "y_est", "z_est"), ("gt.x", "gt.y", "gt.z")])
def test_a_time_or_a_label_is_no_position_that_hides_the_one_there_is(scalar: str, names: tuple[str, ...]) -> None:
    position = ",".join(f'"{name}":{at}' for at, name in enumerate(names, 1))
    record = moved(f'{{{scalar},{position},"qx":0,"qy":0,"qz":0,"qw":1}}')
    assert [record[name] for name in names] == [-1.0, 3.0, 6.0]
    assert "xyz" not in record


@pytest.mark.parametrize("names", [["map"], ["map"] * 40, [f"frame {at % 3}" for at in range(40)]])
def test_the_frame_of_a_header_in_one_key_is_the_frame_of_the_record(run: Callable[..., Any], names: list[str]) -> None:
    rows = [{"header.frame_id": name, "child_frame_id": "b", "gt.x": 1, "gt.y": 2, "gt.z": 3, "yaw": 0} for name in names]
    lines = "".join(json.dumps(row) + "\n" for row in rows)
    for command, frames in {
        ("invert",): [{"header.frame_id": "b", "child_frame_id": name} for name in names],
        ("apply", "--transform", "{xyz: [1, 1, 1], parent: w}"): [{"header.frame_id": "w", "child_frame_id": "b"}] * len(names),
        ("apply", "--transform", "{xyz: [1, 1, 1]}"): [{"child_frame_id": "b"}] * len(names),
    }.items():
        found = [json.loads(line) for line in run(*command, stdin=lines).out.splitlines()]
        assert [{key: each[key] for key in ("header.frame_id", "child_frame_id", "parent", "name") if key in each} for each in found] == frames


@pytest.mark.parametrize("spec", ["rpy_deg", "matrix", "quaternion", "rotvec"])
def test_flat_rotations_go_to_other_representations(spec: str) -> None:
    record = '{"x":1,"qx":0,"qy":0,"y":2,"z":3,"qz":0,"qw":1,"k":1}\n'
    assert set(json.loads(flow(record.encode(), convert(spec), "json").text)) in (
        {"x", "y", "z", spec, "k"}, {spec, "k"}, {"x", "y", "z", "qx", "qy", "qz", "qw", "k"}
    )  # fmt: skip


@pytest.mark.parametrize(
    ("record", "named"),
    [
        ('{"x":0,"y":0,"z":0,"w":1,"k":1}', "quaternion"),
        ('{"x":0,"y":0,"z":0,"qx":0,"qy":0,"qz":0}', "qw"),
        ('{"x":0,"y":0,"z":0,"roll":0,"pitch":0}', "yaw"),
        ('{"x":0,"y":0,"z":0,"roll_foo":0,"ox":0,"oy":0,"oz":0,"ow":1}', "ox oy oz ow"),
        ('{"x (furlong)":0,"y (furlong)":0,"z (furlong)":0,"yaw":1}', "furlong"),
        ('{"x":0,"y":0,"z":0,"qx":0,"qy":0,"qz":0,"qw":1,"roll":0,"pitch":0,"yaw":0}', "roll pitch yaw"),
        ('{"x":0,"y":0,"z":0,"qx":0,"qy":0,"qz":0,"qw":1,"rpy":[0,0,0]}', "rpy"),
        ('{"pose":{"xyz":[1,2,3],"rpy":[0,0,0]},"pose2":{"xyz":[1,2,3],"rpy":[0,0,0]}}', "pose, pose2"),
        ('{"pose":{"xyz":[1,2,3],"rpy":[0,0,0]},"transform":{"xyz":[1,2,3],"rpy":[0,0,0]}}', "pose, transform"),
        ('{"xyz":[1,2,3],"rpy":[0,0,0],"goal":{"xyz":[1,2,3],"rpy":[0,0,0]}}', "goal"),
        ('{"x":0,"y":0,"z":0,"qx":0,"qy":0,"qz":0,"qw":0}', "qx"),
    ],
)
def test_what_is_ambiguous_is_a_fault_that_names_the_keys(record: str, named: str) -> None:
    for request in (MOVE, INVERT):
        result = flow((record + "\n").encode(), request, "json")
        assert (result.status, result.text) == (1, b"")
        assert named in result.told[0]


def test_four_members_alone_are_a_quaternion() -> None:
    record = '{"x":0,"y":0,"z":0.6,"w":0.8}\n'
    assert json.loads(flow(record.encode(), INVERT, "json").text) == {"x": 0.0, "y": 0.0, "z": -0.6, "w": 0.8}
    moved_record = json.loads(flow(record.encode(), MOVE, "json").text)
    assert moved_record["xyz"] == [1.0, 2.0, 3.0]
    assert set(moved_record) == {"xyz", "quaternion"}


@pytest.mark.parametrize("yaw", ["yaw", "theta"])
@pytest.mark.parametrize("count", [1, 80])
def test_a_place_and_a_turn_about_z_are_a_pose_in_the_plane(yaw: str, count: int) -> None:
    record = f'{{"x":1,"y":2,"{yaw}":0,"k":7}}\n'
    found = flow(record.encode() * count, INVERT, "json")
    assert [json.loads(line) for line in found.text.splitlines()] == [{"x": -1.0, "y": -2.0, yaw: 0.0, "k": 7}] * count
    turned = flow(record.encode() * count, convert("quaternion"), "json")
    assert json.loads(turned.text.splitlines()[0])["quaternion"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}


@pytest.mark.parametrize("count", [1, 80])
def test_what_leaves_the_plane_is_a_bad_record(count: int) -> None:
    found = flow(b'{"x":1,"y":2,"yaw":0}\n' * count, MOVE, "json")
    assert (found.status, found.text) == (1, b"")
    assert "--to rpy" in found.told[0]


@pytest.mark.parametrize("count", [1, 80])
def test_units_in_names_count_as_written(count: int) -> None:
    record = '{"x_mm":1000,"y_mm":0,"z_mm":0,"roll [deg]":0,"pitch [deg]":0,"yaw[deg]":90}\n'
    found = flow(record.encode() * count, INVERT, "json")
    wanted = {"x_mm": 0.0, "y_mm": 1000.0, "z_mm": 0.0, "roll [deg]": 0.0, "pitch [deg]": 0.0, "yaw[deg]": -90.0}
    assert [json.loads(line) for line in found.text.splitlines()] == [wanted] * count


ONE_GRAMMAR = [
    "x,y,z", "px,py,pz", "pos_x,pos_y,pos_z", "x_mm,y_mm,z_mm", "X [m],Y [m],Z [m]", "x,y,theta", "x,y,z,rx,ry,rz",
    "pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w",
    "orientation_x,orientation_y,orientation_z,orientation_w,position_x,position_y,position_z", "timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z",
    "x,y,z,imu_qx,imu_qy,imu_qz,imu_qw", "axis_x,axis_y,axis_z,angle_deg", "rotvec_x,rotvec_y,rotvec_z", "lat,lon,alt", "ecef_x,ecef_y,ecef_z",
    "linear_x,linear_y,linear_z,angular_x,angular_y,angular_z", "force.x,force.y,force.z,torque.x,torque.y,torque.z", "x,y,z,roll_rate,A,B",
]  # fmt: skip


TURNED = {"x": "0", "y": "0", "z": "0.6", "w": "0.8"}


@pytest.mark.parametrize("names", ONE_GRAMMAR)
def test_keys_mean_what_columns_of_the_same_names_mean(run: Callable[..., Any], names: str) -> None:
    turned = [bool(re.search(r"q_?[wxyz]$|orientation", name)) for name in names.split(",")]
    cells = [TURNED[name[-1]] if turn else str(at) for at, (name, turn) in enumerate(zip(names.split(","), turned, strict=True), 1)]
    moved = ("apply", "--transform", "{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}")
    table = run(*moved, stdin=f"{names}\n{','.join(cells)}\n")
    record = ", ".join(f'"{name}": {cell}' for name, cell in zip(names.split(","), cells, strict=True))
    keyed = run(*moved, stdin=f"{{{record}}}\n")
    assert (table.status, keyed.status) == (0, 0)
    number = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")
    assert number.findall(keyed.out) == number.findall(table.out.partition("\n")[2])


def test_several_positions_under_affixes_are_an_error_that_names_them(run: Callable[..., Any]) -> None:
    done = run("convert", stdin='{"a_x": 1, "a_y": 2, "a_z": 3, "b_x": 1, "b_y": 2, "b_z": 3}\n')
    assert (done.status, done.err) == (1, "frametool: stdin:1:1: keys of one pose are wanted, found a_x a_y a_z; b_x b_y b_z\n")


def test_what_names_its_position_keeps_other_numbers_as_they_are(run: Callable[..., Any]) -> None:
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", stdin='{"point": [1, 2, 3], "box_x": 1, "box_y": 2, "box_z": 3}\n')
    assert done.out == '{"point": [2.0, 2.0, 3.0], "box_x": 1, "box_y": 2, "box_z": 3}\n'


@pytest.mark.parametrize("count", [1, 200])
def test_the_inverse_of_a_pose_in_the_plane_is_written_anew(count: int) -> None:
    found = flow(b'{"x":1,"y":2,"yaw_deg":90,"inverse":true}\n' * count, INVERT, "json")
    wanted = {"xyz": [1.0, 2.0, 0.0], "rpy_deg": {"roll": 0.0, "pitch": 0.0, "yaw": 90.0}}
    assert [json.loads(line) for line in found.text.splitlines()] == [wanted] * count
