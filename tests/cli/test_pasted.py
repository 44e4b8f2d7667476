"""What people paste is read as it is, wherever a pose may stand; what is ambiguous is refused with what is not."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

HALF = 2**-0.5
QUARTER = [0.0, 0.0, HALF, HALF]  # x y z w of a quarter turn about z
PLACE = [0.5, -1.0, 2.0]
NOWHERE = [0.0, 0.0, 0.0]

# a quarter turn about z, as tools print it; other poses from more tools: test_pasted_prints
TURNED = {
    "numpy 2.4.6, print(R)": "[[ 0. -1.  0.]\n [ 1.  0.  0.]\n [ 0.  0.  1.]]\n",
    "numpy 2.4.6, repr(R)": "array([[ 0., -1.,  0.],\n       [ 1.,  0.,  0.],\n       [ 0.,  0.,  1.]])",
    "numpy 1.26.4, repr(R) of float32": "array([[ 0., -1.,  0.],\n       [ 1.,  0.,  0.],\n       [ 0.,  0.,  1.]], dtype=float32)",
    "a script": "R = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])",
    "PyTorch 2.13.0, repr(R)": "tensor([[ 0., -1.,  0.],\n        [ 1.,  0.,  0.],\n        [ 0.,  0.,  1.]], dtype=torch.float64)",
    "MATLAB, mat2str(R)": "[0 -1 0;1 0 0;0 0 1]",
    "MATLAB, a script": "R = [0 -1 0; 1 0 0; 0 0 1];",
    "MATLAB, R without ;": "R =\n\n     0    -1     0\n     1     0     0\n     0     0     1\n\n",
    "GNU Octave 7.3.0, R without ;": "R =\n\n   0  -1   0\n   1   0   0\n   0   0   1\n\n",
    "Eigen 3.4.0, std::cout << R": " 0 -1  0\n 1  0  0\n 0  0  1\n",
    "Eigen 3.4.0, IOFormat CleanFmt": "[ 0, -1,  0]\n[ 1,  0,  0]\n[ 0,  0,  1]\n",
    "C++, an initializer": "{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}",
    "Python, R.tolist()": "[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]",
    "a tutorial's algebra": f"{HALF!r} + {HALF!r}k",
    "Eigen 3.4.0, std::cout << q": f"0i + 0j + {HALF!r}k + {HALF!r}",
    "rclpy Jazzy, repr of a Quaternion": f"geometry_msgs.msg.Quaternion(x=0.0, y=0.0, z={HALF!r}, w={HALF!r})",
    "rostopic echo Noetic, an orientation": f"x: 0.0\ny: 0.0\nz: {HALF!r}\nw: {HALF!r}\n",
    "a tutorial, the URDF of a joint": '<origin rpy="0 0 1.5707963267948966"/>',
}

BLOCK_1 = """At time 1253924110.083
- Translation: [0.500, -1.000, 2.000]
- Rotation: in Quaternion [0.000, 0.000, 0.707, 0.707]
            in RPY (radian) [0.000, -0.000, 1.571]
            in RPY (degree) [0.000, -0.000, 90.000]
"""
BLOCK_2 = """[INFO] [1700000000.1] [tf2_echo]: Waiting for transform world ->  tool: Invalid frame ID "world"
At time 0.0
- Translation: [0.500, -1.000, 2.000]
- Rotation: in Quaternion (xyzw) [0.000, 0.000, 0.707, 0.707]
- Rotation: in RPY (radian) [0.000, -0.000, 1.571]
- Rotation: in RPY (degree) [0.000, -0.000, 90.000]
- Matrix:
  0.000 -1.000  0.000  0.500
  1.000  0.000  0.000 -1.000
  0.000  0.000  1.000  2.000
  0.000  0.000  0.000  1.000
"""
FRAGMENT = f"""translation:
        x: 0.5
        y: -1.0
        z: 2.0
      rotation:
        x: 0.0
        y: 0.0
        z: {HALF!r}
        w: {HALF!r}
"""

# the same turn at a place
PLACED = {
    "numpy 2.4.6, print(T[:3])": "[[ 0.  -1.   0.   0.5]\n [ 1.   0.   0.  -1. ]\n [ 0.   0.   1.   2. ]]",
    "numpy 2.4.6, repr(T)": "array([[ 0. , -1. ,  0. ,  0.5],\n       [ 1. ,  0. ,  0. , -1. ],\n"
    "       [ 0. ,  0. ,  1. ,  2. ],\n       [ 0. ,  0. ,  0. ,  1. ]])",
    "MATLAB, format short": "T =\n\n         0   -1.0000         0    0.5000\n    1.0000         0         0   -1.0000\n"
    "         0         0    1.0000    2.0000\n         0         0         0    1.0000\n",
    "MATLAB, with its factor": "T =\n\n   1.0e+03 *\n\n         0   -0.0010         0    0.0005\n"
    "    0.0010         0         0   -0.0010\n         0         0    0.0010    0.0020\n"
    "         0         0         0    0.0010\n",
    "Eigen 3.4.0, std::cout << T.matrix()": "  0  -1   0 0.5\n  1   0   0  -1\n  0   0   1   2\n  0   0   0   1\n",
    "Eigen 3.4.0, a 3x4": "  0  -1   0 0.5\n  1   0   0  -1\n  0   0   1   2\n",
    "Python, T[:3].tolist()": "[[0, -1, 0, 0.5], [1, 0, 0, -1], [0, 0, 1, 2]]",
    "KITTI odometry, a line of poses/00.txt": "0 -1 0 0.5 1 0 0 -1 0 0 1 2\n",
    "a C array": "{0, -1, 0, 0.5, 1, 0, 0, -1, 0, 0, 1, 2}",
    "tf2_echo of ROS 1 Noetic": BLOCK_1,
    "tf2_echo of ROS 2 Jazzy": BLOCK_2,
    "tf2_echo of ROS 1, from behind the first dash": BLOCK_1.partition("\n- ")[2],
    "tf2_echo of ROS 2, without dashes": BLOCK_2.partition("\n- ")[2].replace("\n- ", "\n"),
    "rostopic echo Noetic, from the middle of a line": FRAGMENT,
    "rclpy Jazzy, repr of a Transform": "geometry_msgs.msg.Transform(translation=geometry_msgs.msg.Vector3(x=0.5, y=-1.0, "
    f"z=2.0), rotation=geometry_msgs.msg.Quaternion(x=0.0, y=0.0, z={HALF!r}, w={HALF!r}))",
    "a URDF, the origin of a joint": '<origin xyz="0.5 -1 2" rpy="0 0 1.5707963267948966" />',
    "a launch file of ROS 1": 'args="0.5 -1 2 1.5707963267948966 0 0 world odom 100"',
    "ros2 run, a shell's history": "ros2 run tf2_ros static_transform_publisher --x 0.5 --y -1 --z 2 "
    "--yaw 1.5707963267948966 --frame-id world --child-frame-id odom",
}


class Answer(NamedTuple):
    """One pose of the output."""

    xyz: list[float]
    xyzw: list[float]


def answers(outcome: Outcome) -> list[Answer]:
    """Read the poses that were printed as JSON."""
    assert outcome.status == 0, outcome.err
    found = [json.loads(line) for line in outcome.out.splitlines()]
    return [answer(each if isinstance(each, dict) else {"matrix": each}) for each in found]


def answer(entry: dict[str, Any]) -> Answer:
    """Read one pose; a stream keeps the spelling of its records, also of a bare matrix."""
    if "matrix" in entry:
        turned = Rotation.from_matrix(entry["matrix"]).as_quat().tolist()
    else:
        turned = [entry["quaternion"][name] for name in "xyzw"]
    return Answer(entry.get("xyz", NOWHERE), turned)


def near(got: Answer, xyz: list[float], xyzw: list[float]) -> bool:
    """Compare to what prints of three decimals hold."""
    ours = Rotation.from_quat(got.xyzw)
    apart = (ours.inv() * Rotation.from_quat(xyzw)).magnitude()
    return got.xyz == pytest.approx(xyz, abs=1e-12) and apart < 1e-9


BOTH = [*((text, NOWHERE) for text in TURNED.values()), *((text, PLACE) for text in PLACED.values())]
NAMES = [*TURNED, *PLACED]


@pytest.mark.parametrize(("text", "place"), BOTH, ids=NAMES)
def test_convert_reads_a_paste_as_an_argument(run: Run, text: str, place: list[float]) -> None:
    (got,) = answers(run("convert", text, "-f", "json"))
    assert near(got, place, QUARTER)


@pytest.mark.parametrize(("text", "place"), BOTH, ids=NAMES)
def test_convert_reads_a_paste_from_a_file(run: Run, text: str, place: list[float]) -> None:
    (got,) = answers(run("convert", "pasted.txt", "-f", "json", files={"pasted.txt": text}))
    assert near(got, place, QUARTER)


@pytest.mark.parametrize(("text", "place"), BOTH, ids=NAMES)
@pytest.mark.parametrize("arguments", [["-"], [], ["-i", "pasted.txt"]], ids=["dash", "stdin", "input"])
def test_convert_reads_a_paste_as_a_stream(run: Run, text: str, place: list[float], arguments: list[str]) -> None:
    (got,) = answers(run("convert", *arguments, "-f", "json", stdin=text, files={"pasted.txt": text}))
    assert near(got, place, QUARTER)


@pytest.mark.parametrize(("text", "place"), BOTH, ids=NAMES)
def test_every_command_about_poses_reads_a_paste(run: Run, text: str, place: list[float]) -> None:
    back = Rotation.from_quat(QUARTER).inv()
    there = (-back.apply(place)).tolist()
    same = "{xyzw: [0, 0, 0, 1]}"
    assert near(answers(run("invert", text, "-f", "json"))[0], there, back.as_quat().tolist())
    assert near(answers(run("compose", text, same, "-f", "json"))[0], place, QUARTER)
    assert near(answers(run("relative", same, text, "-f", "json"))[0], place, QUARTER)
    outcome = run("apply", "--transform", text, "1", "0", "0", "-f", "json")
    moved = json.loads(outcome.out)["point"]
    assert moved == pytest.approx([place[0], place[1] + 1, place[2]], abs=1e-9), outcome.err


@pytest.mark.parametrize(("text", "place"), BOTH, ids=NAMES)
def test_the_other_commands_read_a_paste_from_standard_input(run: Run, text: str, place: list[float]) -> None:
    back = Rotation.from_quat(QUARTER).inv()
    told = [*["--from", "matrix"] * (text.count("\n") == 3 and place == NOWHERE), "-f", "json"]  # Eigen's rows
    there = (-back.apply(place)).tolist()
    assert near(answers(run("invert", "-", *told, stdin=text))[0], there, back.as_quat().tolist())
    assert near(answers(run("compose", "-", "{xyz: [0, 0, 0]}", *told, stdin=text))[0], place, QUARTER)


@pytest.mark.parametrize(
    "text",
    [
        f"[0, 0, {HALF!r}, {HALF!r}]",
        f"0, 0, {HALF!r}, {HALF!r}",
        f"0,0,{HALF!r},{HALF!r}",
        f"[0. 0. {HALF!r} {HALF!r}]",
        f"0; 0; {HALF!r}; {HALF!r}",
        f"({0}, {0}, {HALF!r}, {HALF!r})",
        f"array([0.        , 0.        , {HALF!r}, {HALF!r}])",
        f"[np.float64(0.0), np.float64(0.0), np.float64({HALF!r}), np.float64({HALF!r})]",
        f"0\n0\n{HALF!r}\n{HALF!r}\n",
    ],
)
@pytest.mark.parametrize("notation", ["xyzw", "quaternion"])
def test_from_says_what_a_bare_list_is(run: Run, text: str, notation: str) -> None:
    (got,) = answers(run("convert", "--from", notation, text, "-f", "json"))
    assert near(got, NOWHERE, QUARTER)
    (got,) = answers(run("convert", "--from", notation, "-f", "json", stdin=text + "\n"))
    assert near(got, NOWHERE, QUARTER)


def test_a_list_that_the_shell_took_apart_is_one_list(run: Run) -> None:
    assert run("convert", "--from", "wxyz", "[0,", "0,", "0,", "1]", "--to", "wxyz").out == "wxyz: [0.0, 0.0, 0.0, 1.0]\n"
    assert run("convert", "0.5", "+", "0.5i", "-", "0.5j", "+", "0.5k", "--to", "wxyz").out == "wxyz: [0.5, 0.5, -0.5, 0.5]\n"


@pytest.mark.parametrize(
    ("text", "wxyz"),
    [
        ("i", [0, 1, 0, 0]),
        ("-j", [0, 0, 1, 0]),
        ("1k", [0, 0, 0, 1]),
        ("0.5+0.5i+0.5j+0.5k", [0.5, 0.5, 0.5, 0.5]),
        ("0.5 - 0.5i - 0.5*j + 0.5k", [0.5, -0.5, -0.5, 0.5]),
        ("0.5i + -0.5j + 0.5k + 0.5", [0.5, 0.5, -0.5, 0.5]),
        ("q = 0.6 + 8e-1i", [0.6, 0.8, 0, 0]),
    ],
)
def test_the_algebra_of_tutorials_is_read(run: Run, text: str, wxyz: list[float]) -> None:
    outcome = run("convert", text, "--to", "wxyz", "-f", "json")
    assert json.loads(outcome.out)["wxyz"] == wxyz


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (["[0, 0, 0.7, 0.7]"], r"\{xyzw: \[\.\.\]\}"),
        (["0, 0, 0.7, 0.7"], r"\{xyzw: \[\.\.\]\}"),
        (["(0.7, 0, 0, 0.7)"], r"\{xyzw: \[\.\.\]\}"),
        (["[1 2 3 4 5 6]"], r"\{rpy_deg: \[\.\.\]\}"),
        (["--from", "rpy", "[[1, 2, 3], [0, 0, 1]]"], r"\{xyz: \[\.\.\], rpy: \.\.\}"),
        (["--from", "xyzw", "1,0 0,0 0,0 0,0"], "decimal commas"),
        (["--from", "xyzw", "[0, 0, 1]"], "found 3"),
        (["[[1. 0. ... 0.]\n [0. 1. ... 0.]]"], "was cut"),
        (["[[1 0 0]\n [0 1 0]\n [0 0 1]\n [1 2 3]]"], "bare list|rows"),
    ],
)
def test_what_is_ambiguous_is_refused_with_what_is_not(run: Run, arguments: list[str], remedy: str) -> None:
    outcome = run("convert", *arguments)
    assert outcome.status == 2
    assert outcome.out == ""
    assert re.search(remedy, outcome.err)


def test_three_rows_that_may_be_positions_are_refused_where_both_have_a_result(run: Run) -> None:
    text = "1 0 0\n0 1 0\n0 0 1\n"
    outcome = run("invert", stdin=text)
    assert (outcome.status, outcome.out) == (2, "")
    assert "--from matrix" in outcome.err
    assert run("invert", "--in", "columns", stdin=text).out == "-1.0 0.0 0.0\n0.0 -1.0 0.0\n0.0 0.0 -1.0\n"
    assert run("invert", stdin="1 0 0\n0 1 0\n0 0 2\n").out == "-1.0 0.0 0.0\n0.0 -1.0 0.0\n0.0 0.0 -2.0\n"


def test_blocks_of_tf2_echo_are_poses_at_their_times(run: Run) -> None:
    outcome = run("convert", "-", "-f", "json", stdin=BLOCK_1 + BLOCK_1.replace("110.083\n- ", "111.5\n") + BLOCK_2)
    stamps = [json.loads(line).get("stamp_ns") for line in outcome.out.splitlines()]
    assert stamps == [1253924110083000000, 1253924111500000000, None]


def test_a_publishers_frames_are_kept(run: Run) -> None:
    (entry,) = [json.loads(line) for line in run("convert", 'args="0 0 5 0 0 0 world odom 100"', "-f", "json").out.splitlines()]
    assert (entry["parent"], entry["name"], entry["xyz"]) == ("world", "odom", [0, 0, 5])


def test_the_origin_of_a_joint_is_the_pose_of_its_child(run: Run) -> None:
    joint = (
        '<joint name="lift" type="fixed">\n  <origin xyz="0 0 1" rpy="0 0 0"/>\n'
        '  <parent link="base"/>\n  <child link="arm"/>\n</joint>\n'
    )
    entry = json.loads(run("convert", "-", "-f", "json", stdin=joint).out)
    assert (entry["parent"], entry["name"], entry["xyz"]) == ("base", "arm", [0, 0, 1])


def test_numbers_of_a_paste_keep_their_bits(run: Run) -> None:
    entry = json.loads(run("convert", "[[1 0 0 0.1]\n [0 1 0 1e-300]\n [0 0 1 12345678.9012345]]", "-f", "json").out)
    assert entry["xyz"] == [0.1, 1e-300, 12345678.9012345]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n"),
        ("a.txt", "# x y z qx qy qz qw\n1 2 3 0 0 0 1\n"),
        ("a.tum", "0.5 1 2 3 0 0 0 1\n"),
        ("a.tsv", "x\ty\tz\tyaw_deg\n1\t2\t3\t90\n"),
    ],
)
def test_a_table_named_as_an_argument_is_read_as_with_input(run: Run, name: str, text: str) -> None:
    for command in (["convert", "--to", "rpy"], ["invert"]):
        there = run(*command, "-i", name, files={name: text})
        assert there.status == 0
        assert run(*command, name) == there


def test_what_is_wrong_with_a_paste_is_one_line(run: Run) -> None:
    outcome = run("convert", "[[1 0 0]\n [0 2 0]\n [0 0 1]]")
    assert outcome.status == 1
    assert outcome.err.count("\n") == 1
    assert "matrix is not a rotation" in outcome.err




@pytest.mark.parametrize(("text", "place"), [("{xyz: [1, 2, 3]}", [1.0, 2.0, 3.0]), ("x,y,z,yaw\n1,2,3,0.5\n", [1.0, 2.0, 3.0])])
def test_a_pipe_named_as_a_file_is_read_once(text: str, place: list[float]) -> None:
    command = f"{sys.executable} -m frametool convert <(printf {shlex.quote(text)}) -f json"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL)
    assert json.loads(done.stdout)["xyz"] == place


@pytest.mark.parametrize(("key", "value", "meant"), [("quats", "[0, 0, 1, 0]", "quaternion"), ("rpi", "[0, 0, 1]", "rpy"), ("eul", "[0, 0, 1]", "rpy")])
@pytest.mark.parametrize("command", ["convert", "invert"])
def test_another_word_for_a_rotation_is_refused_with_ours(run: Run, command: str, key: str, value: str, meant: str) -> None:
    done = run(command, f"{{xyz: [1, 2, 3], {key}: {value}}}")
    assert done.status in (1, 2)
    assert f"unknown key '{key}', did you mean '{meant}'?" in done.err


def test_a_weight_called_w_is_no_part_of_a_quaternion(run: Run) -> None:
    done = run("mean", "--weights", "w", "-f", "json", stdin="x,y,z,w\n0,0,0,1\n4,0,0,3\n")
    assert json.loads(done.out)["xyz"] == [3.0, 0.0, 0.0]


def test_eight_numbers_between_commas_are_a_trajectory_without_being_told(run: Run) -> None:
    text = "1.0,0,0,0,0,0,0,1\n2.0,1,0,0,0,0,0,1\n"
    assert json.loads(run("lookup", "-", "world", "body", "--at", "1.5", "-f", "json", stdin=text).out)["xyz"] == [0.5, 0.0, 0.0]


def test_the_help_of_a_group_lists_its_commands(run: Run) -> None:
    for arguments, named in (((), ("convert", "lookup", "calc")), (("sim",), ("follow", "run", "teleop"))):
        text = run(*arguments, "--help").out
        assert all(f"\n  {name} " in text for name in named)


def test_angles_of_a_urdf_beyond_a_turn_are_doubted(run: Run) -> None:
    robot = '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin rpy="0 0 90"/></joint></robot>'
    assert "rpy 90 is more than a full turn in radians; degrees? [degrees]" in run("check", "-", stdin=robot).out


@pytest.mark.parametrize(
    ("given", "to", "row"),
    [
        ("lla", "ecef", "48.1 11.5 500"), ("lla", "ecef", "48.1 11.5"), ("wxyz", "rpy_deg", "0.9 0 0.3 0"),
        ("rpy_deg", "xyzw", "0 0 90"), ("rpy_deg", "xyzw", "1 2 3 0 0 90"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("delimiter", [",", ", ", "\t"])
def test_rows_without_a_header_that_from_names_are_rows_with_any_delimiter(run: Run, given: str, to: str, row: str, delimiter: str) -> None:
    with_blanks = run("convert", "--from", given, "--to", to, stdin=f"{row}\n{row}\n")
    other = run("convert", "--from", given, "--to", to, stdin=f"{row}\n{row}\n".replace(" ", delimiter))
    assert (other.status, other.err) == (0, with_blanks.err)
    assert other.out.replace(delimiter.strip(" "), " ").replace("  ", " ") == with_blanks.out


@pytest.mark.parametrize("ragged", ["1 0 0\n0 1\n0 0 1\n", "1 0 0\n0 1 0 5\n0 0 1\n"])
@pytest.mark.parametrize("command", ["invert", "relative --consecutive", 'compose - {"xyz":[1,2,3]}'])
def test_three_lines_of_unequal_length_are_a_table_with_a_bad_row(command: str, ragged: str, run: Run) -> None:
    done = run(*command.split(), stdin=ragged)
    assert done.status == 1
    assert "stdin:2: expected 3 cells, found" in done.err


@pytest.mark.parametrize("key", ["translation", "rotation", "t"])
def test_a_stream_of_yaml_is_not_pasted_whatever_its_first_key(run: Run, key: str) -> None:
    turned = "rotation:\n  x: 0.0\n  y: 0.0\n  z: 1.0\n  w: 0.0\n" if key == "rotation" else "rpy_deg: [0, 0, 180]\n"
    moved = f"{'translation' if key == 'rotation' else key}:\n- 1.0\n- 2.0\n- 3.0\n"
    record = (turned + moved if key == "rotation" else moved + turned) + "note: a, b\n---\n"
    found = run("invert", "--to", "xyzw", "-f", "json", stdin=record * 1000)
    assert (found.status, found.err) == (0, "")
    assert [json.loads(line) for line in found.out.splitlines()] == 1000 * [
        {"xyz": [1.0, 2.0, -3.0], "xyzw": [0.0, 0.0, 1.0, 0.0], "note": "a, b"}
    ]
