"""The arguments of static_transform_publisher: both spellings, both rotations, read as the tool means them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid
from frametool.formats.load import load
from frametool.geometry.representations import notation
from frametool.geometry.transform import Rotation
from frametool.grammar.pose import Pose
from frametool.grammar.readers import Reading
from frametool.grammar.result import Result, Style
from frametool.ros.publisher import read_call, write_poses

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

TURN = Rotation.from_rpy([0.2, 0.1, 1.5])
POSE = Pose((0.1, 0.0, -0.2), TURN.components, "camera:é", "base")


def read(line: str) -> Pose:
    return read_call(line, Reading(Source("arguments", "")))


@pytest.mark.parametrize("form", ["static1", "static2"])
@pytest.mark.parametrize("rotation", ["quaternion", "rpy"])
@pytest.mark.parametrize("before", ["", "ros2 run tf2_ros static_transform_publisher "])
def test_what_is_written_reads_back(form: str, rotation: str, before: str) -> None:
    back = read(before + write_poses([Result(POSE)], Style(form, (notation(rotation),))))
    assert back[:1] + back[2:] == POSE[:1] + POSE[2:]
    assert Rotation.of(*back.components[3:]).distance(TURN) < 1e-15


@pytest.mark.parametrize(
    "line",
    [
        "0.1 0 0.2 1.5 0.1 0.2 base cam",
        "0.1 0 0.2 1.5 0.1 0.2 base cam 100",
        "--x 0.1 --z=0.2 --yaw 1.5 --pitch 0.1 --roll 0.2 --frame-id base --child-frame-id cam",
        "--child-frame-id cam --frame-id base --roll 0.2 --pitch 0.1 --yaw 1.5 --z 0.2 --x 0.1  # camera",
    ],
)
def test_yaw_comes_first_without_flags_and_order_is_free_with_them(line: str) -> None:
    pose = read(line)
    assert (pose.parent, pose.name, pose.position) == ("base", "cam", (0.1, 0.0, 0.2))
    assert Rotation.of(*pose.components[3:]).distance(TURN) < 1e-15


def test_what_is_missing_is_zero_or_the_identity() -> None:
    assert read("--frame-id a --child-frame-id b").components == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1 2 3", "found 3 words"),
        ("1 2 3 0 0 0 1 a", "found 8 words"),
        ("1.0foo 2 3 0 0 0 a b", "1.0foo"),
        ("1 2 3 0 0 0 a a", "its own parent"),
        ("--qz 0.5 --frame-id a --child-frame-id b", "norm 1.11803"),
        ("--qz 0 --yaw 1 --frame-id a --child-frame-id b", "a quaternion and angles at once"),
        ("--x 1 --frame-id a", "missing --child-frame-id"),
        ("--x", "not enough arguments for --x"),
        ("--w 1", "unknown argument '--w'"),
    ],
)
def test_what_the_tool_would_guess_is_refused(line: str, message: str) -> None:
    with pytest.raises(ValueInvalid, match=message):
        read(line)


@pytest.mark.parametrize(
    ("name", "form"), [("cam 1", "static1"), ("cam\u00a01", "static1"), ("a\nb", "static1"), ("a\nb", "static2"), ("\x1b[2J", "static2")]
)
def test_a_name_that_cannot_be_read_back_is_not_written(name: str, form: str) -> None:
    pose = Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), name, "map")
    with pytest.raises(ValueInvalid, match=f"cannot be written in {form}: it could not be read back"):
        write_poses([Result(pose)], Style(form))


def test_a_name_with_a_blank_is_quoted_in_flags() -> None:
    pose = Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), "cam 1", "map")
    assert read(write_poses([Result(pose)], Style("static2"))).name == "cam 1"


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("begin", ["", "static_transform_publisher ", "ros2 run tf2_ros static_transform_publisher "])
def test_calls_are_parted_by_any_line_end(begin: str, end: str, tmp_path: Path) -> None:
    lines = [f"{begin}{at} 0 0 0 0 0 f{at} f{at + 1}" for at in range(3)]
    (tmp_path / "a").write_bytes(end.join([*lines, "", "# nothing", ""]).encode())
    assert load(tmp_path / "a", format="calls").frames == ("f0", "f1", "f2", "f3")
    (tmp_path / "a").write_bytes(end.join([*lines, "1 oops"]).encode())
    with pytest.raises(FormatError, match=r"a:4: static_transform_publisher takes .* found 2 words"):
        load(tmp_path / "a", format="calls")


def test_two_calls_in_one_line_are_refused_and_a_hash_within_a_name_is_part_of_it() -> None:
    with pytest.raises(ValueInvalid, match="2 calls of static_transform_publisher in one line; write one a line"):
        read("static_transform_publisher 1 0 0 0 0 0 a b & static_transform_publisher 1 0 0 0 0 0 b c")
    assert read("1 0 0 0 0 0 a b#c").name == "b#c"
    assert read("1 0 0 0 0 0 a b # c").name == "b"


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "call",
    [
        "ros2 run tf2_ros static_transform_publisher --x 1 --y 2 \\\n  --z 3 \\\n  --frame-id a --child-frame-id b",
        "rosrun tf static_transform_publisher 1 2 3 \\\n  0 0 0 a b 100",
        "1 2 3 0 0 0 \\\na b \\\n",
    ],
)
def test_a_call_goes_on_behind_a_backslash_at_the_end_of_a_line(call: str, end: str, tmp_path: Path) -> None:
    path = tmp_path / "calls.sh"
    path.write_bytes(f"# a rig \\\n{call}\n0 0 0 0 0 0 b c\n".replace("\n", end).encode())
    tree = load(path, format="calls")
    assert tree.lookup("a", "c").components[:3] == (1.0, 2.0, 3.0)
    path.write_bytes(f"{call}\n0 0 0 0 0 0 x\n".replace("\n", end).encode())
    with pytest.raises(FormatError, match=f"calls.sh:{call.count(chr(10)) + 2}: "):
        load(path, format="calls")


def test_a_blank_of_a_name_behind_a_backslash_stays() -> None:
    assert read(r"0 0 0 0 0 0 'a \ b' c").parent == r"a \ b"
    assert read(r"0 0 0 0 0 0 a\ b c").parent == "a b"


@pytest.mark.parametrize("call", ["1 2 3 \\ 0 0 0 a b", "1 2 3 0 0 0 \\ a b", "1 2 3 \\\n 0 0 0 a b", "1 2 3 \\\r\n\t0 0 0 a b \\"])
def test_the_end_of_a_line_behind_a_backslash_is_a_blank_wherever_a_call_is_pasted(call: str, run: Callable[..., Outcome]) -> None:
    assert (read(call).position, read(call).parent, read(call).name) == ((1.0, 2.0, 3.0), "a", "b")
    node = f'<launch><node pkg="tf" type="static_transform_publisher" name="n" args="{call} 100"/></launch>'.replace("\\ 100", "100")
    for command in (["static", call], ["convert", f"static_transform_publisher {call}"], ["lookup", "a.launch", "a", "b"]):
        found = run(*command, "-f", "json", files={"a.launch": node})
        assert '"xyz": [1.0, 2.0, 3.0]' in found.out, found.err


def test_other_lines_of_a_script_are_skipped_and_counted(run: Callable[..., Outcome]) -> None:
    script = """#!/bin/bash
source /opt/ros/jazzy/setup.bash
ros2 run tf2_ros static_transform_publisher --z 1 --frame-id a --child-frame-id b &
rosrun tf static_transform_publisher 1 2 3 \\
  0 0 0 b c 100 &
wait
"""
    done = run("lookup", "rig", "a", "c", "-f", "json", files={"rig": script})
    assert '"xyz": [1.0, 2.0, 4.0]' in done.out
    assert done.err == "frametool: warning: rig:2: 2 lines that publish nothing skipped: 'source /opt/ros/jazzy/setup.bash'\n"
    assert "no frames" not in run("static", "rig", files={"rig": script}).err


def test_names_lose_one_slash_as_arguments_too(run: Callable[..., Outcome]) -> None:
    done = run("static", "1", "2", "3", "0", "0", "0", "/a", "b", "-f", "json")
    assert '"name": "b", "parent": "a"' in done.out
    assert "frame '/a': the leading / is no part of a name" in done.err
