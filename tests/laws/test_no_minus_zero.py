"""A number that we compute is never -0.0, whatever the command, the form, the notation and the decimals."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from machine_output import ROOT

from frametool.formats.table import writers
from frametool.geometry.representations import REPRESENTATIONS

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

MINUS_ZERO = re.compile(r"(?<![\w.])-0(?:\.0*)?(?:e[-+]?\d+)?(?![\w.])")
TURNS = ("0, 0, 180", "180, 0, 0", "0, 180, 0", "0, 0, -90", "0, -90, 0", "-90, 0, -90", "0, 0, -30")
POSES = [f"{{name: b, parent: a, xyz: [0, 0, 0], rpy_deg: [{turn}]}}" for turn in TURNS]
TINY = "{name: b, parent: a, xyz: [1e-300, -1e-9, 0], rotvec: [0, 0, -1e-9]}"
QUATERNIONS = ("0, 0, 1, 0", "1, 0, 0, 0", "0, 0, 0, 1", "0, 0, -0.6, 0.8", "0.5, -0.5, 0.5, -0.5", "0, 0, -1e-10, 1")
LINES = "".join(
    f'{{"stamp": {at}, "name": "b", "parent": "a", "xyz": [0, {-at % 2}, -1e-20], "xyzw": [{turn}]}}\n' for at, turn in enumerate(QUATERNIONS)
)
ROWS = "stamp,name,parent,x,y,z,qx,qy,qz,qw\n" + "".join(
    f"{at},b,a,0,{-at % 2},-1e-20,{turn.replace(' ', '')}\n" for at, turn in enumerate(QUATERNIONS)
)
POINTS = "x,y,z\n0,0,0\n1,0,0\n0,-1,-1e-20\n"
STANDING = "{frames: {imu: {b: {rpy_deg: [0, 0, 180]}, cam0: {rpy_deg: [-90, 0, -90]}, cam1: {rpy_deg: [180, 0, 0]}}}}"
CAMERAS = "{frames: {cam0: {cam1: {xyz: [0.1, 0, 0], rpy_deg: [0, 0, -90]}}}}"
MOVING = (
    "{frames: [{name: b, parent: imu, samples: [{stamp: 0}, {stamp: 1, rpy_deg: [0, 0, -90]}, "
    "{stamp: 2, xyz: [-1, 0, 0], rpy_deg: [0, 0, 180]}]}, {name: c, parent: b, rpy_deg: [0, 180, 0]}]}"
)
NAMES = sorted({"text", "csv", *writers("poses"), *writers("tree"), *writers("report")})
NOTATIONS = [*REPRESENTATIONS, "euler:rzyx", "rpy_deg", "rotvec_deg"]


def of_arguments(pose: str) -> list[list[str]]:
    """Return the commands that answer one pose."""
    return [
        ["convert", pose], ["invert", pose], ["compose", pose, f"inv({POSES[0]})"], ["relative", pose, POSES[1]],
        ["interpolate", pose, POSES[3], "0", "0.5"], ["mean", pose, POSES[6]], ["lookup", pose, "b", "a"], ["tree", pose],
        ["static", pose], ["convert", pose, "--precision", "3"], ["convert", pose, "--world-axes", "ned_from_enu"],
        ["convert", pose, "--all-axes", "unity_from_ros"], ["apply", "--transform", pose, "0", "-1", "0"], ["calc", f"log({pose})"],
        ["apply", "--transform", pose, "0", "-1", "0", "--as", "vector"], ["calc", f"rpy({pose})"],
    ]  # fmt: skip


TREES = [
    ["tree"], ["tree", "--at", "0.5"], ["tree", "--to", "matrix"], ["static"], ["lookup", "b", "imu"], ["lookup", "cam1", "cam0"], ["monitor"],
    ["lookup", "imu", "b", "--times", "0:2:0.5"], ["echo", "c", "imu"], ["tree", "--precision", "3"],
]  # fmt: skip
STREAMED = [
    ["convert"], ["invert"], ["compose", POSES[0], "-"], ["relative", "--first"], ["relative", "--consecutive", "--velocity"], ["mean"],
    ["apply", "--transform", POSES[1], "--as", "pose"], ["convert", "--all-axes", "unity_from_ros"], ["calc", "inv(row)"],
    ["calc", "-e", "w=log(row)"], ["resample", "-", "--rate", "2"], ["tree", "-"], ["lookup", "-", "b", "a"], ["monitor", "-"],
]  # fmt: skip
OTHERS = """
fk examples/arm.urdf arm_base tool -i examples/joints.csv
lookup examples/arm.urdf arm_base tool -j elbow=0 -f json
lookup examples/arm.urdf arm_base tool -f json --to matrix
tree examples/arm.urdf -f camchain
tree examples/robot.yaml -f camchain
tree examples/robot.yaml -f urdf
tree examples/camchain.yaml -f opencv
between 1,0,0 0,-1,0 -f json --to matrix,rpy_deg,rotvec,mrp
between 0,0,1 0,0,-1 -f csv
diff examples/robot.yaml examples/drive.yaml
align examples/truth.tum examples/mono.tum --align none -f json
compare examples/truth.tum examples/truth.tum --align none -f csv
solve --points examples/points_a.csv examples/points_b.csv -f json
solve examples/measurements.yaml -f json
solve --hand-eye examples/hand_eye_samples.json -f json
sim follow --duration 0.1 -f csv
sim follow --duration 0.1 --emit poses -f csv
sim follow --duration 0.1 --emit tf
""".strip().split("\n")


def refuse_minus_zeros(run: Run, commands: list[list[str]], stdin: str = "") -> None:
    outcomes = [(command, run(*command, stdin=stdin)) for command in commands]
    assert any(outcome.status == 0 for _, outcome in outcomes), outcomes[0]
    assert [(command, found[0]) for command, outcome in outcomes if (found := MINUS_ZERO.findall(outcome.out))] == []


@pytest.fixture
def run_text(run: Run) -> Run:
    """Run a command; of a form that is no text, nothing is looked at."""

    def call(*arguments: str, stdin: str = "") -> Outcome:
        try:
            return run(*arguments, stdin=stdin)
        except UnicodeDecodeError:
            return run("convert", POSES[0], "-f", "json")

    return call


@pytest.mark.parametrize("form", NAMES)
@pytest.mark.parametrize("pose", [*POSES, TINY])
def test_no_result_of_a_pose_is_minus_zero(run_text: Run, pose: str, form: str) -> None:
    refuse_minus_zeros(run_text, [["convert", POSES[0], "-f", "json"], *([*command, "-f", form] for command in of_arguments(pose))])


@pytest.mark.parametrize("name", NOTATIONS)
@pytest.mark.parametrize("pose", [*POSES, TINY])
def test_no_number_of_a_notation_is_minus_zero(run: Run, pose: str, name: str) -> None:
    commands = of_arguments(pose)[:4]
    refuse_minus_zeros(run, [["convert", pose], *([*command, "--to", name, "-f", form] for command in commands for form in ("json", "csv", "text"))])


@pytest.mark.parametrize("form", NAMES)
@pytest.mark.parametrize("tree", [STANDING, CAMERAS, MOVING], ids=["standing", "cameras", "moving"])
def test_no_number_of_a_tree_is_minus_zero(run_text: Run, tree: str, form: str) -> None:
    refuse_minus_zeros(run_text, [["lookup", tree, "cam1" if tree == CAMERAS else "b", "cam0" if tree == CAMERAS else "imu"], *([command, tree, *rest, "-f", form] for command, *rest in TREES)])


@pytest.mark.parametrize("form", [None, *NAMES])
@pytest.mark.parametrize("text", [ROWS, LINES], ids=["csv", "jsonl"])
def test_no_number_of_a_row_is_minus_zero(run_text: Run, text: str, form: str | None) -> None:
    told = [] if form is None else ["-f", form]
    decimals = [["--precision", "3"], ["--precision", "0", "--to", "rpy_deg"], ["--precision", "17", "--to", "matrix"]]
    commands = [*STREAMED, *([*command, *each] for command in STREAMED[:4] for each in decimals)]
    refuse_minus_zeros(run_text, [["convert"], *([*command, *told] for command in commands)], text.replace("-1e-20", "0") if form is None else text)


@pytest.mark.parametrize("pose", POSES)
def test_no_number_of_a_point_is_minus_zero(run: Run, pose: str) -> None:
    forms = [[], ["-f", "json"], ["--precision", "3"], ["--as", "vector", "-f", "yaml"]]
    refuse_minus_zeros(run, [["apply", "--transform", pose, *each] for each in forms], POINTS)


@pytest.mark.parametrize("line", OTHERS)
def test_no_number_of_an_example_is_minus_zero(run: Run, line: str) -> None:
    outcome = run(*line.replace("examples/", f"{ROOT}/examples/").split())
    assert outcome.status in (0, 1, 3), outcome.err
    assert MINUS_ZERO.findall(outcome.out) == []


def test_text_that_passes_keeps_its_minus_zero(run: Run) -> None:
    assert run("convert", "--to", "rpy_deg", stdin="note,x,y,z,qx,qy,qz,qw\n-0.0,-0.0,0,0,0,0,0,1\n").out.split("\n")[1].startswith("-0.0,-0.0,0,0,")
