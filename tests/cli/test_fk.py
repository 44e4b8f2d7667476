"""`frametool fk`: rows of joint values to rows of poses; what is not ours passes, what is missing is named."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import frametool

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

ARM = Path(__file__).resolve().parent.parent.parent / "examples" / "arm.urdf"
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_roll")
ROWS = [(0.1, -0.2, 0.3, 0.4), (1.0, 0.5, -1.0, 2.0), (0.0, 0.0, 0.0, 0.0)]
FK = ("fk", str(ARM), "arm_base", "tool")


def expected(row: tuple[float, ...]) -> tuple[float, ...]:
    """Give the pose of a row by the Python face."""
    pose = frametool.load_robot(ARM).fk("arm_base", "tool", dict(zip(JOINTS, row, strict=True)))
    return tuple(float(part) for part in (*pose.xyz, *pose.xyzw))


def canonical(numbers: Any) -> tuple[float, ...]:
    """Give a pose with w >= 0."""
    numbers = tuple(map(float, numbers))
    return numbers if numbers[6] >= 0 else (*numbers[:3], *(-part for part in numbers[3:]))


def table(delimiter: str = ",", names: Any = JOINTS, rows: Any = ROWS) -> str:
    """Write a table with columns that are not ours at both ends."""
    head = delimiter.join(("id", *names, "note"))
    return f"{head}\n" + "".join(
        f"{delimiter.join((f'0{at}', *map(repr, row), 'x'))}\n" for at, row in enumerate(rows)
    )


@pytest.mark.parametrize("delimiter", [",", "\t", ";"])
def test_rows_of_a_table_get_the_pose_and_keep_all_else(delimiter: str, run: Run) -> None:
    text = table(delimiter)
    done = run(*FK, stdin=text)
    assert done.status == 0
    head, *lines = done.out.splitlines()
    assert head == delimiter.join((text.splitlines()[0], "x", "y", "z", "qx", "qy", "qz", "qw"))
    for line, before, row in zip(lines, text.splitlines()[1:], ROWS, strict=True):
        assert line.startswith(before + delimiter)
        assert canonical(line.split(delimiter)[6:]) == canonical(expected(row))


def test_json_lines_yaml_and_messages_get_the_pose_and_their_frames(run: Run) -> None:
    pose = canonical(expected(ROWS[0]))
    values = dict(zip(JOINTS, ROWS[0], strict=True))
    state = {"header": {"stamp": {"sec": 3, "nanosec": 5}, "frame_id": "odd"}, "name": [*JOINTS][::-1],
             "position": [*ROWS[0]][::-1], "velocity": [], "effort": []}  # fmt: skip
    done = run(*FK, stdin=json.dumps({"id": 7, **values}) + "\n" + json.dumps({**values, "id": "a"}) + "\n")
    for line in done.out.splitlines():
        found = json.loads(line)
        assert (found["name"], found["parent"], str(found["id"]) in "7a") == ("tool", "arm_base", True)
        assert canonical((*found["xyz"], *found["quaternion"].values())) == pose
    found = json.loads(run(*FK, stdin=json.dumps(state) + "\n").out)
    assert (found["header"], found["name"]) == ({"stamp": {"sec": 3, "nanosec": 5}, "frame_id": "arm_base"}, "tool")
    assert canonical((*found["xyz"], *found["quaternion"].values())) == pose
    assert "position" not in found
    echoed = run("fk", str(ARM), "arm_base", "tool", stdin=yaml_of(state) * 2)
    assert echoed.out.count("frame_id: 'arm_base'") == 2
    assert run("convert", "-", "--to", "rpy", stdin=echoed.out).status == 0  # what is printed reads back


def yaml_of(state: dict[str, Any]) -> str:
    """Write a message as `ros2 topic echo` does."""
    stamp = state["header"]["stamp"]
    lists = "".join(
        f"{key}:\n" + "".join(f"- {each}\n" for each in state[key]) if state[key] else f"{key}: []\n"
        for key in ("name", "position", "velocity", "effort")
    )
    return f"header:\n  stamp:\n    sec: {stamp['sec']}\n    nanosec: {stamp['nanosec']}\n  frame_id: ''\n{lists}---\n"


@pytest.mark.parametrize("size", [1, 40])
def test_messages_may_name_the_joints_in_any_order(size: int, run: Run) -> None:
    lines = []
    for at in range(size):
        names = [*JOINTS, "gripper"][at % 5 :] + [*JOINTS, "gripper"][: at % 5]
        values = dict(zip(JOINTS, ROWS[1], strict=True)) | {"gripper": 0.01}
        lines.append(json.dumps({"name": names, "position": [values[name] for name in names]}))
    done = run(*FK, stdin="\n".join(lines) + "\n")
    found = [json.loads(line) for line in done.out.splitlines()]
    assert len(found) == size
    assert {canonical((*each["xyz"], *each["quaternion"].values())) for each in found} == {canonical(expected(ROWS[1]))}


@pytest.mark.parametrize("form", ["csv", "ros2", "yaml"])
def test_messages_come_out_in_any_form_of_poses_with_their_stamps(form: str, run: Run) -> None:
    state = {"header": {"stamp": {"sec": 3, "nanosec": 5}, "frame_id": ""}, "name": [*JOINTS], "position": [*ROWS[0]]}
    out = run(*FK, "-f", form, "--quiet", stdin=json.dumps(state)).out
    assert re.search({"csv": "3000000005", "ros2": r"sec: 3\n +nanosec: 5", "yaml": "3000000005"}[form], out)


@pytest.mark.parametrize("form", [(), ("-f", "csv"), ("-f", "tum")])
def test_what_the_tools_print_between_messages_is_passed_over(form: tuple[str, ...], run: Run) -> None:
    state = {"header": {"stamp": {"sec": 3, "nanosec": 5}}, "name": [*JOINTS], "position": [*ROWS[0]], "velocity": [], "effort": []}
    done = run(*FK, *form, "--quiet", stdin=f"WARNING: no messages received\nIs /clock being published?\n{yaml_of(state)}")
    assert done.status == 0, done.err
    assert f"{expected(ROWS[0])[0]!r}" in done.out


def test_units_stand_in_the_names_of_columns(run: Run) -> None:
    names = ("shoulder_pan_deg", "shoulder_lift [deg]", "elbow (rad)", "wrist_roll")
    done = run(*FK, "--to", "xyzw", stdin=table(names=names, rows=[(90.0, 90.0, 0.0, 0.0)]))
    cells = done.out.splitlines()[1].split(",")
    assert [*map(float, cells[6:9])] == pytest.approx([0.0, 0.932, 0.152], abs=1e-15)
    fingers = run("fk", str(ARM), "tool", "left_finger", stdin="gripper_mm,t\n20,0\n")
    assert fingers.out.splitlines()[1].split(",")[2:5] == ["0.0", "0.02", "-0.02"]


def test_joints_without_a_column_are_told_by_options(run: Run) -> None:
    done = run(*FK, "-j", "wrist_roll=0.4", stdin=table(names=JOINTS[:3], rows=[ROWS[0][:3]]))
    assert canonical(done.out.splitlines()[1].split(",")[5:]) == canonical(expected(ROWS[0]))
    files = {"rest.yaml": "{wrist_roll: 0.4, elbow: 2}"}
    done = run(*FK, "--joints", "rest.yaml", stdin=table(names=JOINTS[:3], rows=[ROWS[0][:3]]), files=files)
    assert canonical(done.out.splitlines()[1].split(",")[5:]) == canonical(expected(ROWS[0]))  # a column wins


@pytest.mark.parametrize(
    ("arguments", "text", "status", "said"),
    [
        ((), table(names=JOINTS[:3]), 2, "no column for joint wrist_roll; give --joint wrist_roll=VALUE; columns: id"),
        ((), table(names=("shoulder_pn", *JOINTS[1:])), 2, "no column for joint shoulder_pan; did you mean 'shoulder_pn'?"),
        (("-j", "elbow=1"), table(), 2, "joint 'elbow' has a column, 'elbow', and a value by --joint; keep one"),
        (("-j", "ellbow=1"), table(), 2, "no joint 'ellbow'; did you mean 'elbow'"),
        ((), table(names=(*JOINTS[:3], "wrist_roll_mm")), 1, "stdin:1: column 'wrist_roll_mm': joint 'wrist_roll' is continuous"),
        ((), "1,2,3,4\n", 1, "no names"),
        (("--no-header",), "1,2,3,4\n", 2, "; columns: 1, 2, 3, 4"),
        ((), "", 1, "stdin: nothing in it"),
        (("-j", "elbow=1"), "", 2, f"for one posture, frametool lookup {ARM} arm_base tool -j elbow=1;"),
        ((), "[1, 2]\n", 1, "expected a mapping with a key for each joint"),
        (("--columns", "1-3"), table(), 2, "--columns has no effect here"),
        (("--joints", "m.csv"), table(), 2, "--joints: elbow moves over time; stream that file with -i"),
        ((), table().replace("x\n", "x\n0,1\n", 1), 1, "stdin:3: expected 6 cells"),
        ((), table().replace("0.5", "north"), 1, "stdin:3:shoulder_lift: 'north' is not a number"),
        ((), '{"shoulder_pan": 1}\n', 2, "no column for joints elbow, shoulder_lift, wrist_roll"),
        ((), table(names=(*JOINTS[:3], "x")), 2, "no column for joint wrist_roll"),
    ],
)  # fmt: skip
def test_what_is_missing_or_wrong_is_named(
    arguments: tuple[str, ...], text: str, status: int, said: str, run: Run
) -> None:
    done = run(*FK, "--quiet", *arguments, stdin=text, files={"m.csv": "t,elbow\n0,0\n1,1\n"})
    assert (done.status, said in done.err) == (status, True), done.err
    assert "Traceback" not in done.err


def test_columns_that_are_there_are_not_written_again(run: Run) -> None:
    text = table(names=(*JOINTS, "x"), rows=[(*ROWS[0], 1.0)])
    assert "name the new ones with --prefix" in run(*FK, stdin=text).err
    assert "columns x would appear twice; rename them in the input" in run(*FK, "-f", "json", stdin=text).err  # no --prefix
    assert run(*FK, "--prefix", "tool_", stdin=text).out.splitlines()[0].endswith(",tool_x,tool_y,tool_z,tool_qx,tool_qy,tool_qz,tool_qw")
    assert "key 'xyz' is there already" in run(*FK, stdin=json.dumps({**dict.fromkeys(JOINTS, 0), "xyz": [1, 2, 3]})).err


def test_a_time_called_t_is_that_of_the_pose(run: Run) -> None:
    line = json.dumps({"t": 1.5, **dict.fromkeys(JOINTS, 0)})
    assert json.loads(run(*FK, stdin=line).out)["t"] == 1.5
    assert run(*FK, "-f", "tum", "--quiet", stdin=line).out.startswith("1.500000000 ")
    assert "key 't' is there already" in run(*FK, stdin=line.replace("1.5", "[1, 2, 3]")).err


@pytest.mark.parametrize("policy", ["skip", "null"])
def test_bad_rows_are_skipped_or_emptied_and_counted(policy: str, run: Run) -> None:
    done = run(*FK, "--on-error", policy, "--quiet", stdin=table().replace("0.5", "nan"))
    assert done.status == 3
    assert len(done.out.splitlines()) == (3 if policy == "skip" else 4)
    assert "stdin:3:shoulder_lift: 'nan' is not finite" in done.err


def test_limits_are_told_once(run: Run) -> None:
    done = run(*FK, stdin=table(rows=[ROWS[0], (3.5, 0.0, 0.0, 9.0), (4.0, 0.0, 0.0, 0.0)]))
    assert (done.status, done.err.count("joint 'shoulder_pan' goes beyond its limits -3 .. 3 rad")) == (0, 1)


def test_a_bad_row_hides_no_limit_of_the_others(run: Run) -> None:
    done = run(*FK, "--on-error", "skip", stdin=table(rows=[ROWS[0], (3.5, 0.0, 0.0, 9.0), (float("nan"), 0.0, 0.0, 0.0)]))
    assert (done.status, done.err.count("joint 'shoulder_pan' goes beyond its limits -3 .. 3 rad")) == (3, 1)


def test_other_ways_through_the_robot(run: Run) -> None:
    assert run("fk", str(ARM), "tool", "wrist", stdin="a,b\n1,2\n").out.splitlines()[1].startswith("1,2,0.0,0.0,-0.115,")
    done = run("fk", str(ARM), "right_finger", "left_finger", stdin="gripper,b\n0.02,2\n")
    assert done.out.splitlines()[1].startswith("0.02,2,0.0,0.04,0.0,")
    done = run("fk", str(ARM), "right_finger", "left_finger", stdin="gripper,gripper_right\n0.02,0.01\n")
    assert done.out.splitlines()[1].startswith("0.02,0.01,0.0,0.03,0.0,")
    assert run("fk", str(ARM), "tool", "tol", stdin="a,b\n1,2\n").status == 4


def test_a_command_and_a_million_rows_share_their_bits(run: Run) -> None:
    one = run("lookup", str(ARM), "arm_base", "tool", "-f", "csv", *(part for name, value in zip(JOINTS, ROWS[1], strict=True) for part in ("-j", f"{name}={value}")))
    found = [float(cell) for cell in one.out.splitlines()[1].split(",")[2:]]
    many = run(*FK, stdin=table(rows=[ROWS[1]] * 3000)).out.splitlines()[1:]
    assert len({line.partition(",x,")[2] for line in many}) == 1
    assert [float(cell) for cell in many[0].partition(",x,")[2].split(",")] == pytest.approx(found, abs=1e-15)
