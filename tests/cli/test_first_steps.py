"""What new users stumbled over: each answer says what the input is and what to do, or just takes it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
ROBOT = str(EXAMPLES / "robot.yaml")
COVARIANCE = [float(row == column) for row in range(6) for column in range(6)]


def test_columns_of_a_quaternion_without_a_position_to_move_name_both_ways_out(run: Run) -> None:
    outcome = run("apply", ROBOT, "map", "lidar", stdin="x,y,z,w\n1,2,3,4\n")
    assert (outcome.status, outcome.out) == (2, "")
    assert "--columns x,y,z" in outcome.err
    assert "--to" not in outcome.err
    moved = run("apply", ROBOT, "map", "lidar", "--columns", "x,y,z", stdin="x,y,z,w\n1,2,3,4\n").out
    assert moved.endswith(",4\n")


def test_a_table_of_one_column_needs_no_word_on_its_form(run: Run) -> None:
    assert run("convert", "--to", "rpy_deg", stdin="yaw_deg\n90\n45\n").out.splitlines()[1] == "0.0,0.0,90.0"


@pytest.mark.parametrize("name", ["arm.urdf", "camchain.yaml", "robot.yaml", "lift.sdf", "finger.xml", "lidar.launch"])
@pytest.mark.parametrize("command", [["convert"], ["invert"], ["compose", "{xyz: [1, 2, 3]}"], ["relative", "{xyz: [1, 2, 3]}"]], ids=" ".join)
def test_a_file_of_frames_in_the_place_of_a_pose_points_to_lookup(run: Run, command: list[str], name: str) -> None:
    text = (EXAMPLES / name).read_text()
    outcome = run(*command, name, files={name: text})
    assert outcome.status == 1
    assert f"not a pose; look one up: frametool lookup {name} TARGET SOURCE" in outcome.err
    assert outcome.err.count("\n") == 1
    if len(command) == 1:
        assert "not a pose; look one up" in run(*command, stdin=text).err


def test_times_may_be_listed(run: Run) -> None:
    for times, count in (("1,2.5,3", 3), ("1", 1), ("1000000000ns,2", 2)):
        outcome = run("lookup", str(EXAMPLES / "drive.yaml"), "map", "box", "--times", times, "-f", "json")
        assert len(outcome.out.splitlines()) == count
    outcome = run("lookup", str(EXAMPLES / "drive.yaml"), "map", "box", "--times", "1,x")
    assert (outcome.status, "START:STOP:STEP, or a file" in outcome.err) == (2, True)


def test_results_before_an_expression_without_one_are_kept(run: Run) -> None:
    outcome = run("calc", "1+1", "2*3", "1/0", "-f", "json")
    assert (outcome.status, outcome.out) == (1, "2.0\n6.0\n")


@pytest.mark.parametrize("record", ['{"xyz": [1, 2, 3], "rpy": [0, 0, 1], "covariance": %s}', '{"pose": {"xyz": [1, 2, 3], "rpy": [0, 0, 1]}, "covariance": %s}'])
def test_the_covariance_of_a_record_is_moved_with_it_or_refused(run: Run, record: str) -> None:
    for options in ({}, {"stdin": record % COVARIANCE}):
        argument = [] if options else [record % COVARIANCE]
        outcome = run("apply", ROBOT, "map", "lidar", *argument, "-f", "json", **options)
        assert json.loads(outcome.out)["covariance"] == pytest.approx(COVARIANCE)
    wanted = {"[1, 2, 3]": "covariance has 3 numbers; 36 are needed", '"none"': "expected 36 numbers", "null": "expected 36 numbers"}
    for bad, why in wanted.items():
        outcome = run("apply", ROBOT, "map", "lidar", "-f", "json", stdin=record % bad)
        assert (outcome.status, outcome.out) == (1, "")
        assert why in outcome.err


MANY_KEYS = ", ".join(f"quite_a_long_unknown_key_{number}: 1" for number in range(6))


def test_an_error_about_many_keys_is_one_short_line(run: Run) -> None:
    outcome = run("tree", "a.yaml", files={"a.yaml": f"frames: {{a: {{b: {{xyz: [1, 2, 3], {MANY_KEYS}}}}}}}"})
    first = outcome.err.splitlines()[0]
    assert len(first) <= 200
    assert "unknown key 'quite_a_long_unknown_key_0'; and 5 more;" in first


def test_names_with_a_slash_are_told_once_and_not_to_who_is_quiet(run: Run) -> None:
    entries = "".join(f"- {{name: /f{number}, parent: /base, xyz: [{number}, 0, 0]}}\n" for number in range(12))
    arguments = ["lookup", "a.yaml", "base", "f3", "-f", "json"]
    outcome = run(*arguments, files={"a.yaml": entries})
    assert outcome.err.count("\n") == 1
    assert "'/f0': the leading / is no part of a name and was left out (23 more like it)" in outcome.err
    assert run(*arguments, "--quiet").err == ""


def test_a_pose_graph_of_edges_says_how_they_are_read(run: Run) -> None:
    edge = "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1\n"
    for command in ("tree", "convert"):
        outcome = run(command, "a.g2o", files={"a.g2o": edge})
        assert (outcome.status, outcome.out) == (1, "")
        assert "only edges in it" in outcome.err
        assert "--edges" in outcome.err
    assert json.loads(run("convert", "a.g2o", "--edges", "-f", "json").out)["xyz"] == [1, 0, 0]


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        (["lookup", "robot.yaml", "map", "lidar", "--frames", "a,b"], "--frames"),
        (["tree", "arm.urdf", "--dh", "modified"], "--dh"),
        (["convert", "walk.tum", "--stamps", "kitti_times.txt"], "--stamps"),
        (["convert", "-i", "walk.tum", "--edges"], "--edges"),
    ],
)
def test_an_option_that_answers_nothing_is_refused(run: Run, arguments: list[str], option: str) -> None:
    files: dict[str, str | bytes] = {name: (EXAMPLES / name).read_bytes() for name in ("robot.yaml", "arm.urdf", "walk.tum", "kitti_times.txt")}
    outcome = run(*arguments, files=files)
    assert (outcome.status, outcome.out) == (2, "")
    assert f"{option} has no effect here" in outcome.err
