"""Launch files: the transforms that stand in them literally, in three languages, and what is said of the rest."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
from scipy.spatial.transform import Rotation

from frametool.errors import FormatError, heard_by
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

NODE = '<node pkg="tf2_ros" exec="static_transform_publisher" args="{}"/>'
POSITIONAL = "0.1 -0.2 0.3 1.5 0.2 -0.1 base cam"
FLAGS = "--x 0.1 --y -0.2 --z 0.3 --yaw 1.5 --pitch 0.2 --roll -0.1 --frame-id base --child-frame-id cam"
EXPECTED = [0.1, -0.2, 0.3, *Rotation.from_euler("ZYX", [1.5, 0.2, -0.1]).as_quat()]  # yaw, pitch, roll about moving axes

ROS1 = '<launch><node pkg="{}" type="static_transform_publisher" name="a" args="{}"/></launch>'
YAML = "launch:\n- node:\n    pkg: tf2_ros\n    exec: static_transform_publisher\n    args: {}\n"
PYTHON = """from launch import LaunchDescription
from launch_ros.actions import Node

def generate_launch_description():
    return LaunchDescription([Node(package='tf2_ros', executable='static_transform_publisher', arguments={})])
"""


def read(folder: Path, text: str, name: str = "a.launch") -> tuple[Any, list[str]]:
    """Load a launch file; return its frames and what was said."""
    (folder / name).write_text(text)
    said: list[str] = []
    with heard_by(lambda message, *_: said.append(message.replace(f"{folder}/", ""))):
        return load(folder / name), said


def unheard(*_: object) -> None:
    """Let a warning pass."""


def python(folder: Path, body: str) -> tuple[Any, list[str]]:
    """Load a launch file in Python with this body."""
    return read(folder, f"import os\ndef generate_launch_description():\n{body}", "a.launch.py")


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (ROS1.format("tf", f"{POSITIONAL} 100"), "a.launch"),
        (ROS1.format("tf2_ros", POSITIONAL), "a.launch"),
        (f"<launch>{NODE.format(FLAGS)}</launch>", "a.launch.xml"),
        (f"<launch>{NODE.format(POSITIONAL)}</launch>", "a.launch.xml"),
        (f"<launch><group><group ns='a'>{NODE.format(POSITIONAL)}</group></group></launch>", "a.launch.xml"),
        (f"<launch>{NODE.format(FLAGS + ' --ros-args --log-level warn -r __node:=x')}</launch>", "a.launch.xml"),
        (f"<launch><executable cmd='ros2 run tf2_ros static_transform_publisher {FLAGS}'/></launch>", "a.launch"),
        (YAML.format(FLAGS), "a.launch.yaml"),
        (YAML.format(f'"{POSITIONAL}"'), "a.yaml"),
        (f"%YAML 1.2\n---\n{YAML.format(POSITIONAL)}", "a.launch.yml"),
        ("launch:\n- group:\n  - push_ros_namespace: {namespace: a}\n" + YAML[8:].replace("\n", "\n  ").replace("- node", "  - node").format(FLAGS), "a.yaml"),
        (f"launch: [{{executable: {{cmd: ros2 run tf2_ros static_transform_publisher {POSITIONAL}}}}}]", "a.yaml"),
        (PYTHON.format(POSITIONAL.split()), "a.launch.py"),
        (PYTHON.format(FLAGS.split()), "a_launch.py"),
        (PYTHON.format(f"{POSITIONAL!r}.split()"), "a"),
        (PYTHON.format("['0.1', -0.2, '0.3', '1.5', '0.2', '-' '0.1', 'base', 'cam']"), "a"),
        (PYTHON.format("[0.1, -0.2, 0.3, 1.5, 0.2, -0.1, 'base', 'cam']"), "a"),
        (PYTHON.format(POSITIONAL.split()).replace("executable", "node_executable"), "a"),
        (PYTHON.format(POSITIONAL.split()).replace("Node(", "launch_ros.actions.Node("), "a"),
    ],
)  # fmt: skip
def test_a_call_is_read_in_every_language_and_spelling(tmp_path: Path, text: str, name: str) -> None:
    tree, said = read(tmp_path, text, name)
    assert [(parent, child) for parent, child, _ in tree.edges()] == [("base", "cam")]
    assert tree.lookup("base", "cam").components == pytest.approx(EXPECTED, abs=1e-15)
    assert not said


def test_a_quaternion_is_x_y_z_w(tmp_path: Path) -> None:
    tree, _ = read(tmp_path, ROS1.format("tf", "1 2 3 0.5 -0.5 0.5 -0.5 base cam 10"))
    assert tree.lookup("base", "cam").components == (1.0, 2.0, 3.0, 0.5, -0.5, 0.5, -0.5)


def test_the_transforms_of_a_lidar_odometry_turn_its_camera_axes_into_those_of_the_map(tmp_path: Path) -> None:
    node = '<node pkg="tf" type="static_transform_publisher" name="{}" args="{}" />'
    first = node.format("a", "0 0 0 1.570795   0        1.570795 /map    /camera_init 10")
    second = node.format("b", "0 0 0 -1.570795 -1.570795 0        /camera /base_link   10")
    tree, said = read(tmp_path, f"<launch>\n{first}\n{second}\n</launch>")
    assert tree.lookup("map", "camera_init").apply([0, 0, 1]) == pytest.approx([1, 0, 0], abs=2e-6)  # forward
    assert tree.lookup("map", "camera_init").apply([1, 0, 0]) == pytest.approx([0, 1, 0], abs=2e-6)  # left
    assert tree.lookup("camera", "base_link").apply([1, 0, 0]) == pytest.approx([0, 0, 1], abs=2e-6)
    assert said[0] == "a.launch:2: frame '/map': the leading / is no part of a name and was left out (3 more like it)"


@pytest.mark.parametrize(
    ("number", "said"),
    [
        ("LaunchConfiguration('x')", "\"LaunchConfiguration('x')\" is not a literal"),
        ("f'{x}'", "\"f'{x}'\" is not a literal"),
        ("str(x + 1)", "'str(x + 1)' is not a literal"),
        ("x + 1", "'x + 1' is not a literal"),
        ("str(-math.pi / 2)", "'str(-math.pi / 2)' is not a literal"),
        ("os.environ['X']", "\"os.environ['X']\" is not a literal"),
        ("x", "'x' is not a literal"),
        ("'1' + '2'", "\"'1' + '2'\" is not a literal"),
        ("*['1']", "\"*['1']\" is not a literal"),
    ],
)
def test_what_python_would_have_to_work_out_is_listed_as_not_read(tmp_path: Path, number: str, said: str) -> None:
    publisher = "Node(package='tf2_ros', executable='static_transform_publisher', arguments="
    body = f"    x = '1'\n    a = {publisher}['0', {number}, '0', '0', '0', '0', 'a', 'b'])\n"
    tree, told = python(tmp_path, f"{body}    b = {publisher}{POSITIONAL.split()})\n")
    assert set(tree.frames) == {"base", "cam"}
    assert told == [f"a.launch.py:4: static_transform_publisher not read: {said}"]


def test_python_is_never_run(tmp_path: Path) -> None:
    trap = tmp_path / "trap"
    call = "Node(package='tf2_ros', executable='static_transform_publisher', arguments=[str(open('{}', 'w')), 'a'])"
    body = f"    open({str(trap)!r}, 'w')\n    {call.format(trap)}\n    {call.replace('str(open', '(lambda: open').format(trap)}\n"
    with pytest.raises(FormatError, match="no frames"), heard_by(unheard):
        python(tmp_path, body)
    assert not trap.exists()


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        ("0 0 $(arg z) 0 0 0 a b", "$(arg z)"),
        ("0 0 $(var z) 0 0 0 a b", "$(var z)"),
        ("0 0 0 0 0 0 $(env ROBOT)/a b", "$(env ROBOT)"),
        ("0 0 $(eval 1 + 2) 0 0 0 a b", "$(eval 1 + 2)"),
    ],
)
def test_a_call_with_a_substitution_is_listed_and_the_others_are_read(
    tmp_path: Path, arguments: str, found: str
) -> None:
    xml = f"<launch><arg name='z'/>\n{NODE.format(arguments)}\n{NODE.format(POSITIONAL)}\n{NODE.format(arguments)}</launch>"
    tree, said = read(tmp_path, xml)
    assert set(tree.frames) == {"base", "cam"}
    told = f"static_transform_publisher not read: its arguments have '{found}'"
    assert said == [f"a.launch:2: {told}", f"a.launch:4: {told}"]
    tree, said = read(tmp_path, f"{YAML.format(arguments)}{YAML[8:].format(POSITIONAL)}", "a.yaml")
    assert (set(tree.frames), said) == ({"base", "cam"}, [f"a.yaml:5: {told}"])


def test_arguments_of_which_the_file_says_one_value_have_it(tmp_path: Path) -> None:
    called = "0 0 $(arg z) $(var yaw) 0 0 base $(arg child)"
    xml = (
        "<launch><arg name='z' default='0.35'/><let name='yaw' value='1.5'/><arg name='child' default='$(arg z)'/>\n"
        f"<include file='a.launch'><arg name='z' value='9'/></include><group>{NODE.format(called)}</group></launch>"
    )
    tree, said = read(tmp_path, xml)
    pose = [0.0, 0.0, 0.35, *Rotation.from_euler("z", 1.5).as_quat()]
    assert tree.lookup("base", "0.35").components == pytest.approx(pose, abs=1e-15)
    arguments = "static_transform_publisher read with the file's own arguments: z 0.35, yaw 1.5, child 0.35"
    assert said[1:] == [f"a.launch:2: {arguments}"]
    assert said[0].startswith("a.launch:2: include 'a.launch' is not followed")


@pytest.mark.parametrize(
    "defined",
    [
        "<arg name='z' value='1' if='$(arg a)'/>",
        "<arg name='z' value='1'/><group><let name='z' value='2'/></group>",
        "<group if='$(arg a)'><let name='z' value='1'/></group>",
        "<include file='a.launch'><arg name='z' value='9'/></include>",
        "<arg name='z' default='$(env Z)'/>",
    ],
)
def test_arguments_that_may_have_another_value_are_not_filled_in(tmp_path: Path, defined: str) -> None:
    tree, said = read(tmp_path, f"<launch>{defined}{NODE.format('0 0 $(arg z) 0 0 0 a b')}{NODE.format(FLAGS)}</launch>")
    assert set(tree.frames) == {"base", "cam"}
    assert "static_transform_publisher not read: its arguments have '$(" in said[-1]


def test_what_starts_under_a_condition_is_read_and_said_with_its_line(tmp_path: Path) -> None:
    nodes = [NODE.format(f"0 0 {n} 0 0 0 base c{n}") for n in range(4)]
    xml = f"<launch>\n<group if='$(arg a)'>\n{nodes[0]}\n<group unless='$(arg b)'>\n{nodes[1]}</group></group>\n{nodes[2]}\n<group if='1'>{nodes[3]}</group></launch>"
    tree, said = read(tmp_path, xml)
    assert len(tree.frames) == 5
    assert said == [
        "a.launch:3: frame 'c0' is published under a condition: if=\"$(arg a)\"",
        "a.launch:5: frame 'c1' is published under a condition: if=\"$(arg a)\" and unless=\"$(arg b)\"",
    ]
    body = (
        "    if x:\n        N(package='tf2_ros', executable='static_transform_publisher', arguments={})\n"
        "    else:\n        G([N(package='tf2_ros', executable='static_transform_publisher', arguments={})], condition=Unless(y))\n"
    )
    tree, said = python(tmp_path, body.format("'0 0 0 0 0 0 a b'.split()", "'0 0 0 0 0 0 a c'.split()"))
    assert said == [
        "a.launch.py:4: frame 'b' is published under a condition: if x",
        "a.launch.py:6: frame 'c' is published under a condition: if not (x) and Unless(y)",
    ]
    tree, said = read(tmp_path, "launch:\n- group:\n    if: $(var s)\n    children:\n    - node: {pkg: tf2_ros, exec: static_transform_publisher, args: 0 0 0 0 0 0 a b}\n", "a.yaml")
    assert said == ["a.yaml:5: frame 'b' is published under a condition: if=\"$(var s)\""]


@pytest.mark.parametrize("off", ["if='false'", "if='0'", "if='False'", "unless='true'", "unless='1'"])
def test_what_never_starts_is_left_out_and_said(tmp_path: Path, off: str) -> None:
    tree, said = read(tmp_path, f"<launch>{NODE.format(POSITIONAL)}\n<group {off}>{NODE.format(FLAGS.replace('cam', 'x'))}</group></launch>")
    assert set(tree.frames) == {"base", "cam"}
    written = off.replace("'", '"')
    assert said == [f"a.launch:2: static_transform_publisher not read: it never starts ({written})"]


PLUGIN = "tf2_ros::StaticTransformBroadcasterNode"


@pytest.mark.parametrize(
    ("text", "name", "line"),
    [
        (f"<launch>{NODE.format(FLAGS)}\n<node_container><composable_node pkg='tf2_ros' plugin='{PLUGIN}'/></node_container></launch>", "a.launch", 2),
        (f"{YAML.format(FLAGS)}- node_container:\n    composable_node:\n    - {{pkg: tf2_ros, plugin: '{PLUGIN}'}}\n", "a.yaml", 8),
        (PYTHON.format(FLAGS.split()) + f"\nx = ComposableNode(package='tf2_ros', plugin='{PLUGIN}')\n", "a.py", 7),
    ],
)  # fmt: skip
def test_a_composable_publisher_is_listed_as_not_read(tmp_path: Path, text: str, name: str, line: int) -> None:
    why = "it is a composable node, whose transform is in its parameters"
    assert read(tmp_path, text, name)[1] == [f"{name}:{line}: static_transform_publisher not read: {why}"]


def test_included_files_are_named(tmp_path: Path) -> None:
    followed = "is not followed; read that file too: --with FILE"
    assert read(tmp_path, f"<launch>{NODE.format(FLAGS)}\n<include file='$(find x)/y.launch'/></launch>")[1] == [
        f"a.launch:2: include '$(find x)/y.launch' {followed}"
    ]
    assert read(tmp_path, f"{YAML.format(FLAGS)}- include: {{file: y.yaml}}\n", "a.yaml")[1] == [f"a.yaml:6: include 'y.yaml' {followed}"]
    call = f"N(package='tf2_ros', executable='static_transform_publisher', arguments={FLAGS.split()})"
    assert python(tmp_path, f"    {call}\n    IncludeLaunchDescription('y.py')\n")[1] == [
        f"a.launch.py:4: include \"'y.py'\" {followed}"
    ]


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        (f"<launch>\n  {NODE.format('0 0 0 x 0 0 a b')}</launch>", "a.launch", "a.launch:2:63: 'x' is not a number"),
        (f"<launch>\n  {NODE.format('0 0 0 0 0 a b')}</launch>", "a.launch", "a.launch:2:63: static_transform_publisher takes"),
        (f"<launch>\n  {NODE.format('--qz 0.5 --frame-id a --child-frame-id b')}</launch>", "a.launch", "a.launch:2:63: quaternion 0 0 0.5 1 has norm 1.11803"),
        (f"<launch>{NODE.format('0 0 0 0 0 0 a a')}</launch>", "a.launch", "a.launch:1:69: frame 'a' is its own parent"),
        (f"<launch>{NODE.format(POSITIONAL)}", "a.launch", "a.launch:1:"),
        (YAML.format("0 0 0 nan 0 0 a b"), "a.yaml", "a.yaml:5:11: 'nan' is not finite"),
        ("launch: 3\n", "a.yaml", "a.yaml:1:9: expected a list of actions, found '3'"),
        ("launch:\n- node\n", "a.yaml", "a.yaml:2:3: expected an action as - node: .., found 'node'"),
        (PYTHON.format("['0', '0', '0', '0', '0', '1,5', 'a', 'b']"), "a.py", "a.py:5:31: '1,5' has a decimal comma"),
        ("def generate_launch_description():\n  x = (\n", "a.py", "a.py:2:7: not Python 3: '(' was never closed"),
        ("print 'x'\ndef generate_launch_description(): pass\n", "a.py", "a.py:1:1: not Python 3: Missing parentheses"),
        (f"def generate_launch_description(): return {'(' * 150}0{')' * 150}\n", "a.py", "a.py"),
        ("def generate_launch_description(): return " + "-" * 100_000 + "0\n", "a.py", "a.py"),
        ("def generate_launch_description(): return 0" + " + 0" * 50_000 + "\n", "a.py", "a.py"),
        ("<launch/>", "a.launch", "a.launch: no frames in it"),
        ("launch:\n", "a.yaml", "a.yaml: no frames in it"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line_with_its_place(run: Callable[..., Any], text: str, name: str, said: str) -> None:
    done = run("tree", name, files={name: text})
    assert done.status == 1
    lines = [line for line in done.err.splitlines() if line.startswith("frametool: ")]
    assert len(lines) == 1
    assert lines[0].startswith(f"frametool: {said}")
    assert len(lines[0]) < 260
    assert "Traceback" not in done.err


def test_two_calls_that_disagree_name_both_lines(tmp_path: Path) -> None:
    text = f"<launch>\n{NODE.format('0 0 0 0 0 0 a b')}\n{NODE.format('0 0 1 0 0 0 a b')}\n</launch>"
    with pytest.raises(FormatError, match=r"a\.launch:3: frame 'b' has two different poses in 'a': line 2 and line 3"):
        read(tmp_path, text)


def test_check_finds_what_is_wrong_in_each_call(run: Callable[..., Any]) -> None:
    text = f"<launch>\n{NODE.format('0 0 x 0 0 0 a b')}\n{NODE.format('0 0 0 0 0 7 a b')}\n{NODE.format('0 0 1 2 a c')}</launch>"
    done = run("check", "a.launch", files={"a.launch": text})
    assert done.status == 1
    assert [line.split(": ")[0] for line in done.out.splitlines()] == ["a.launch:2:61", "a.launch:3:1", "a.launch:4:61"]


NAMES_TO_KEEP = ("base", "camera é", "a/b", "it's", 'say "x"', "<&>", "-1")


def test_what_is_written_reads_back_to_the_same_bits(run: Callable[..., Any]) -> None:
    entries = [
        {"name": name, "parent": "world", "xyz": [0.1 * n, -1e-17, math.pi], "rpy": [n / 7, -0.3, 3.0]}
        for n, name in enumerate(NAMES_TO_KEEP)
    ]
    source = json.dumps({"frames": entries})
    written = run("tree", "a.json", "-f", "launch", files={"a.json": source})
    assert written.status == 0
    again = run("tree", "a.launch", "-f", "json", "--quiet", files={"a.launch": written.out})
    assert again.out == run("tree", "a.json", "-f", "json").out
    assert run("tree", "a.json", "-o", "b.launch").status == 0
    assert run("tree", "b.launch", "-f", "launch", "--quiet").out == written.out


def test_a_name_that_launch_files_would_replace_is_not_written(run: Callable[..., Any]) -> None:
    done = run("tree", "a.json", "-f", "launch", files={"a.json": '{"frames": {"a": {"$(arg x)": {}}}}'})
    assert (done.status, done.out) == (1, "")
    assert "a frame name with $( cannot be written in a launch file" in done.err


def test_frames_that_move_are_not_written_as_static_but_as_they_stood_at_a_time(run: Callable[..., Any]) -> None:
    moving = "{frames: [{name: b, parent: a, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0]}]}]}"
    done = run("tree", "a.yaml", "-f", "launch", files={"a.yaml": moving})
    assert (done.status, done.out) == (1, "")
    assert done.err == "frametool: a launch file holds no moving frames, and 'b' moves; give --at TIME\n"
    assert "--x 0.5 " in run("tree", "a.yaml", "-f", "launch", "--at", "0.5").out


def test_what_says_all_of_itself_is_read_without_a_word(run: Callable[..., Any]) -> None:
    assert run("lookup", "a.launch", "base", "cam", files={"a.launch": f"<launch>{NODE.format(FLAGS)}</launch>"}).err == ""


def test_reading_a_launch_file_in_xml_loads_no_numpy(tmp_path: Path) -> None:
    (tmp_path / "a.launch").write_text(f"<launch>{NODE.format(FLAGS)}</launch>")
    code = "import sys; from frametool.cli import run; run(['lookup', 'a.launch', 'base', 'cam']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert not {"numpy", "rich", "yaml"} & set(done.stdout.split())


ARGUMENTS = "--x 1 \\\n      --frame-id a \\\n      --child-frame-id b"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (f'<launch><node pkg="tf2_ros" exec="static_transform_publisher" args="{ARGUMENTS}"/></launch>', "a.launch"),
        (f"launch:\n- node:\n    pkg: tf2_ros\n    exec: static_transform_publisher\n    args: >-\n      {ARGUMENTS}\n", "a.yaml"),
    ],
)
def test_arguments_go_on_behind_a_backslash(tmp_path: Path, text: str, name: str) -> None:
    tree, _ = read(tmp_path, text, name)
    assert tree.lookup("a", "b").components[:3] == (1.0, 0.0, 0.0)
