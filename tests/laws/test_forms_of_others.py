"""What holds in every form of other tools: bare numbers, names with slashes, no position that nobody gave."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from frametool.formats.table import writers

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

# --- numbers without units ---

JOINT = '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="{} 0 0" rpy="0 0 {}"/></joint>'
CALL = '<launch><node pkg="tf2_ros" exec="static_transform_publisher" args="{} 0 0 {} 0 0 a b"/></launch>'
FLAGS = "--x {} --yaw {} --frame-id a --child-frame-id b\n"
# a file with a length and an angle, 1 and 0.5 where they are plain
ANGLES = {
    "launch": ("a.launch", CALL),
    "launch in YAML": ("a.yaml", 'launch:\n- node: {{pkg: tf2_ros, exec: static_transform_publisher, args: "{} 0 0 {} 0 0 a b"}}\n'),
    "launch in Python": ("a.py", 'def generate_launch_description():\n    return [Node(package="tf2_ros", executable="static_transform_publisher", arguments=["{}", "0", "0", "{}", "0", "0", "a", "b"])]\n'),
    "calls": ("a.calls", "static_transform_publisher {} 0 0 {} 0 0 a b\n"),
    "calls with flags": ("a.calls", "static_transform_publisher " + FLAGS),
    "autoware": ("a.yaml", "base:\n  cam: {{x: {}, y: 0, z: 0, roll: 0, pitch: 0, yaw: {}}}\n"),
    "opencv": ("a.yaml", "%YAML:1.0\n---\ntvec: [{}, 0, 0]\nrvec: [0, 0, {}]\n"),
    "opencv, XML": ("a.xml", "<opencv_storage><tvec type_id='opencv-matrix'><rows>3</rows><cols>1</cols><dt>d</dt><data>{} 0 0</data></tvec><rvec type_id='opencv-matrix'><rows>3</rows><cols>1</cols><dt>d</dt><data>0 0 {}</data></rvec></opencv_storage>"),
    "urdf": ("a.urdf", f'<robot name="r"><link name="a"/><link name="b"/>{JOINT}</robot>'),
    "sdf": ("a.sdf", '<sdf version="1.9"><model name="m"><link name="l"><pose>{} 0 0 0 0 {}</pose></link></model></sdf>'),
    "mjcf": ("a.xml", '<mujoco><compiler angle="radian"/><worldbody><body name="b" pos="{} 0 0" euler="0 0 {}"/></worldbody></mujoco>'),
    "nuscenes": ("a.json", '[{{"token": "a", "sensor_token": "s", "rotation": [1, 0, 0, {1}], "translation": [{0}, 2, 3]}}]'),
    "kitti-calib": ("calib_velo_to_cam.txt", "R: 1 0 0 0 1 0 0 0 {1}\nT: {0} 0 0\n"),
    "camchain": ("a.yaml", "cam0:\n  T_cam_imu: [[1, 0, 0, {}], [0, 1, 0, 0], [0, 0, 1, {}], [0, 0, 0, 1]]\n"),
    "handeye": ("a.yaml", "parameters: {{eye_on_hand: true, robot_effector_frame: t, tracking_base_frame: c}}\ntransformation: {{x: {}, y: 0, z: 0, qx: 0, qy: 0, qz: 0, qw: {}}}\n"),
}  # fmt: skip


@pytest.mark.parametrize("unit", ["0.5deg", "0.5 rad", "pi/2", "0.5°"])
@pytest.mark.parametrize("name", ANGLES)
def test_an_angle_of_another_tool_has_no_unit_of_its_own(name: str, unit: str, run: Run) -> None:
    file, text = ANGLES[name]
    text, form = text.format("1", unit.replace(" ", "") if "{} 0 0 {}" in text else unit), name.split(",", maxsplit=1)[0].split(" ", maxsplit=1)[0]
    if "json" in file:
        text = text.replace(unit, f'"{unit}"')
    done = run("tree", "--in", form, file, files={file: text})
    assert (done.status, done.out) == (1, ""), text
    assert "Traceback" not in done.err
    assert len(done.err.splitlines()[0]) <= 200


@pytest.mark.parametrize("name", ANGLES)
def test_a_length_of_another_tool_has_no_unit_of_its_own(name: str, run: Run) -> None:
    file, text = ANGLES[name]
    one = "1.0" if name in ("nuscenes", "kitti-calib", "handeye") else "0.5"
    form = name.split(",", maxsplit=1)[0].split(" ", maxsplit=1)[0]
    assert run("tree", "--in", form, file, files={file: text.format("1", one)}).status == (1 if name == "nuscenes" else 0)
    done = run("tree", "--in", form, file, files={file: text.format('"2cm"' if "json" in file else "2cm", one)})
    assert (done.status, done.out) == (1, "")
    assert "2cm" in done.err


@pytest.mark.parametrize("pasted", ['args="0 0 5 90deg 0 0 world odom 100"', "static_transform_publisher 0 0 0 pi/2 0 0 a b"])
def test_pasted_arguments_have_no_units_either(pasted: str, run: Run) -> None:
    assert run("convert", pasted).status == 2
    assert run("convert", "-i", "a", files={"a": pasted}).status == 1
    assert run("convert", pasted.replace("90deg", "1").replace("pi/2", "1")).status == 0


def test_our_own_grammar_keeps_units(run: Run) -> None:
    found = [json.loads(run("convert", "-f", "json", given).out) for given in ("{rpy: [90deg, 0, pi/2]}", "{rpy_deg: [90, 0, 90]}")]
    assert found[0] == found[1]


# --- one leading slash ---

READ_AS = {"ros1": "echo", "ros2": "echo", "static1": "calls", "static2": "calls", "foxglove": "jsonl"}
# what cannot be written of such names, or is not read
NOT_READ = ("tf2", "dot", "mermaid", "opencv", "camchain", "handeye")


@pytest.mark.parametrize("name", ["//a", "///a", "/", "//", "/a", "a//b", "a/", "/a/b"])
@pytest.mark.parametrize("form", [form for form in writers("tree") if form not in NOT_READ])
def test_names_with_slashes_read_back_as_they_are(form: str, name: str, run: Run) -> None:
    entries = [{"name": name, "parent": "base", "xyz": [1, 0, 0]}, {"name": "c", "parent": name, "xyz": [0, 1, 0]}]
    text = json.dumps({"frames": entries})
    told = run("tree", "a.json", "-f", "json", files={"a.json": text})
    kept = name[1:] if name in ("/a", "/a/b") else name
    assert {each["name"] for each in json.loads(told.out)["frames"]} == {"base", "c", kept}
    assert ("leading /" in told.err) == (kept != name)
    place = {"mcap": "back.mcap", "bag1": "back.bag"}.get(form, "back")
    written = run("tree", "a.json", "-f", form, *["-o", place] * (form in writers("recording")))
    assert written.status == 0
    files = {} if form in writers("recording") else {place: written.out}
    back = run("tree", "--in", READ_AS.get(form, form), place, "-f", "json", files=files)
    assert back.out == told.out
    assert "leading /" not in back.err


@pytest.mark.parametrize(
    ("form", "text"),
    [
        ("calls", "1 0 0 0 0 0 1 /base /a\n"), ("csv", "parent,name,x,y,z,qx,qy,qz,qw\n/base,/a,1,0,0,0,0,0,1\n"),
        ("csv", "stamp,parent,name,x,y,z,qx,qy,qz,qw\n1,/base,/a,1,0,0,0,0,0,1\n"), ("yaml", "{name: /a, parent: /base, xyz: [1, 0, 0]}\n"),
        ("autoware", "/base:\n  /a: {x: 1, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}\n"),
    ],
)  # fmt: skip
def test_one_leading_slash_is_taken_off_in_every_form(form: str, text: str, run: Run) -> None:
    done = run("tree", "--in", form, "a", "-f", "json", files={"a": text})
    assert [each["name"] for each in json.loads(done.out)["frames"]] == ["base", "a"]
    assert "the leading / is no part of a name" in done.err


# --- coordinates on the Earth ---

EARTH = {
    "csv": "lat,lon,alt,qx,qy,qz,qw\n47,8,3,0,0,0,1\n47,8,3,0,0,0,1\n",
    "csv, long names": "t,gps.latitude [deg],gps.longitude [deg],roll,pitch,yaw\n1,47,8,0,0,0\n2,47,8,0,0,0\n",
    "csv, no rotation": "lat_deg,lon_deg,alt\n47,8,3\n47,8,3\n",
    "jsonl": '{"lat": 47, "lon": 8, "alt": 3, "xyzw": [0, 0, 0, 1]}\n' * 2,
    "yaml": "lat: 47\nlon: 8\nyaw: 0.5\n---\nlat: 47\nlon: 8\nyaw: 0.5\n",
}
COMMANDS = (
    "convert -i file", "convert -i file -f kitti", "convert -i file -f tum", "convert -i file -f json", "convert -i file -f csv --to rpy",
    "apply --transform P -i file", "mean -i file", "relative --consecutive -i file", "invert -i file", "compose P - -i file", "relative P - -i file",
)  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", [name for name in EARTH if name != "csv, no rotation"])
def test_a_rotation_at_a_place_says_its_axes_and_no_position_is_0(name: str, command: str, run: Run) -> None:
    words = ["{xyz: [1, 0, 0], rpy: [0, 0, 0]}" if word == "P" else word for word in command.split()]
    done = run(*words, files={"file": EARTH[name]})
    assert (done.status, done.out) == (1, "")
    assert "a pose at lat, lon does not state the axes of its rotation; axes: enu, ned, grid or ecef" in done.err
    told = run(*words, "--local-axes", "enu", files={"file": EARTH[name]})
    assert told.status == 0
    assert told.out


def test_beside_a_position_they_are_other_columns(run: Run) -> None:
    text = "lat,lon,x,y,z,qx,qy,qz,qw\n47,8,1,2,3,0,0,0,1\n"
    assert run("convert", "--to", "rpy", stdin=text).out == "lat,lon,x,y,z,roll,pitch,yaw\n47,8,1,2,3,0.0,0.0,0.0\n"


# --- one row and many ---

KITTI = "1 0 0 5 0 1 0 0 0 0 1 0\n"


@pytest.mark.parametrize("options", [(), ("-f", "csv"), ("-f", "json"), ("-f", "tum"), ("--to", "rpy"), ("-f", "kitti")])
@pytest.mark.parametrize("end", ["\n", ""])
def test_a_kitti_file_of_one_line_is_one_as_of_two(options: tuple[str, ...], end: str, run: Run) -> None:
    one, two = (text.removesuffix("\n") + end for text in (KITTI, KITTI * 2))
    found = [run("convert", "-i", "file", *options, files={"file": text}) for text in (one, two)]
    streamed = run("convert", *options, stdin=one)
    assert found[0].out.strip() == found[1].out[: len(found[0].out)].strip()
    assert streamed.out == found[0].out
    assert found[0].err.replace("file:", "stdin:") == streamed.err
