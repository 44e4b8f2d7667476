"""A derivation ends with the command's own result, and is refused where it does not lead there."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from recheck import recheck
from written import HOSTILE, ROTATIONS, SPECS, rotation, seeded

import frametool
from frametool.explain import derive
from frametool.explain.derive import BLOCKS, DerivationWrong
from frametool.explain.run import sheets
from frametool.geometry import euler

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

ROBOT = """
angles: deg
frames:
  map:
    odom: {xyz: [12.4, -3.75, 0], rpy: {yaw: 31.5}, children: {base: {xyz: [2.18, 0.36, 0], rpy: {yaw: -12.25}, children: {
      lidar: {xyz: [0.285, 0, 0.31], rpy: [180, 0, 0]}, arm: {xyz: [0.1, 0, 0.3], euler: {axes: rzyx, angles: [15, 45, 0]}}}}}}
    dock: {xyz: [8.02, -6.41, 0], rpy: {yaw: 180}}
"""
DRIVE = """
frames:
  - name: base
    parent: map
    samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0], rpy_deg: [0, 0, 90]}, {stamp: 2, xyz: [1, 1, 0], rpy_deg: [0, 0, 170]}]
  - {name: lidar, parent: base, xyz: [0.3, 0, 0.4], rpy_deg: [0, 0, 180]}
"""
FILES: dict[str, str | bytes] = {"robot.yaml": ROBOT, "drive.yaml": DRIVE}
NUMBER = re.compile(r"(?<![\w.:])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w:])")


def last_numbers(sheet: str) -> list[float]:
    """Read the numbers of the last block."""
    block = sheet.rsplit("\nResult", 1)[1].split("\n", 1)[1]
    return [float(each) for each in NUMBER.findall(block)]


def numbers_in(value: Any) -> list[float]:
    """List the numbers of a machine result."""
    if isinstance(value, dict):
        return [number for key, each in value.items() if key not in ("stamp_ns", "source_stamp_ns") for number in numbers_in(each)]
    if isinstance(value, list):
        return [number for each in value for number in numbers_in(each)]
    return [float(value)] if isinstance(value, (int, float)) and not isinstance(value, bool) else []


@pytest.mark.parametrize("numbers", ["1 0 0 4 0 0 -1 5 0 1 0 6 --from matrix", "1 2 3 30 --from heading_deg:enu", "30 --from heading_deg:ned", "1 2 3 0 1 0 -1 0 0 --from six_d"])
def test_a_row_of_a_matrix_and_a_heading_are_derived_as_they_are_read(numbers: str, run: Callable[..., Outcome]) -> None:
    machine = run("convert", *numbers.split(), "--format", "json")
    derived = run("convert", *numbers.split(), "--explain")
    assert last_numbers(derived.out) == pytest.approx(numbers_in(json.loads(machine.out)))


@pytest.mark.parametrize("spec", SPECS)
def test_the_last_block_of_a_conversion_is_the_result_of_the_command(spec: str, run: Callable[..., Outcome]) -> None:
    random = seeded(spec)
    for xyzw in (random.choice(ROTATIONS), random.choice(HOSTILE)):
        pose = json.dumps(rotation(spec, xyzw))
        for to in random.sample(SPECS, 2):
            machine, derived = run("convert", pose, "--to", to, "--format", "json"), run("convert", pose, "--to", to, "--explain")
            assert last_numbers(derived.out) == pytest.approx(numbers_in(json.loads(machine.out)), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("axes", euler.AXES)
@pytest.mark.parametrize("degrees", ["", "_deg"])
def test_all_conventions_of_euler_lead_to_the_result_at_lock_and_elsewhere(axes: str, degrees: str) -> None:
    for xyzw in (*ROTATIONS[:2], *HOSTILE[::2], *HOSTILE[-3:]):
        frametool.explain("convert", {"xyzw": list(xyzw)}, to=f"euler{degrees}:{axes}")
        frametool.explain("convert", rotation(f"euler{degrees}:{axes}", xyzw), to="quaternion,matrix")


A = "{name: camera, parent: base, xyz: [1, 2, 3], rpy_deg: [10, 20, 30]}"
B = "{xyz: [0.1, 0, 1.2], quaternion: {x: 0.5, y: -0.5, z: 0.5, w: 0.5}}"
CALLS = [
    ["compose", A, B], ["compose", B, B, B, B, B], ["invert", A], ["relative", A, B], ["relative", A, A], ["interpolate", A, B, "0.3"],
    ["interpolate", A, A, "0.5"], ["lookup", "robot.yaml", "base", "dock"], ["lookup", "robot.yaml", "arm", "arm"], ["lookup", "robot.yaml", "map", "arm"],
    ["lookup", "robot.yaml", "lidar", "map"], ["lookup", "robot.yaml", "base", "lidar"], ["lookup", "drive.yaml", "map", "lidar"],
    ["lookup", "drive.yaml", "lidar", "map", "--at", "1.25"], ["lookup", "drive.yaml", "map", "base", "--at", "1"],
    ["lookup", "drive.yaml", "base", "base", "--at", "2", "--source-at", "0.5", "--fixed", "map"],
    ["apply", "robot.yaml", "base", "lidar", "5", "0.2", "0"], ["apply", "robot.yaml", "map", "{frame: lidar, vector: [1, 2, 3]}"],
    ["apply", "drive.yaml", "map", "lidar", "--at", "0.5", "1", "0", "0"], ["apply", "--transform", A, "{xyz: [1, 0, 0], rpy_deg: [0, 0, 45]}", "--to", "quaternion"],
    ["apply", "drive.yaml", "map", "{header: {stamp: {sec: 1, nanosec: 500000000}, frame_id: lidar}, point: {x: 1, y: 2, z: 3}}"],
    ["convert", "--axes", "optical"], ["convert", "--axes", "optical", "--from", "rpy_deg", "10", "20", "30"],
    ["convert", "--from", "rpy_deg", "1", "2", "3", "10", "20", "30", "--to", "matrix"], ["convert", "{xyz: [1, 2, 3], inverse: true, rpy_deg: [0, 0, 30]}"],
    ["convert", "--from", "quaternion", "0.1", "0.2", "0.3", "-0.4", "--normalize", "--keep-sign"],
    ["convert", "1", "0.1", "0", "-0.1", "0.9", "0", "0", "0", "1", "--normalize", "--to", "axis_angle"],
]  # fmt: skip


@pytest.mark.parametrize("arguments", CALLS, ids=" ".join)
def test_the_last_block_is_the_result_of_the_command(arguments: list[str], run: Callable[..., Outcome]) -> None:
    derived, machine = run(*arguments, "--explain", files=FILES), run(*arguments, "--format", "json")
    assert (derived.status, derived.err) == (0, ""), derived.err
    found = json.loads(machine.out)
    wanted = numbers_in({key: value for key, value in found.items() if key not in ("header", "name", "parent")})
    assert sorted(last_numbers(derived.out)) == pytest.approx(sorted(wanted), rel=1e-12, abs=1e-12)


def test_python_and_the_command_agree(run: Callable[..., Outcome]) -> None:
    tree = frametool.load(_written("drive.yaml", run))
    pairs = {
        run("convert", "--from", "rpy_deg", "10", "20", "30", "--to", "matrix", "--explain").out: frametool.explain("convert", {"rpy_deg": [10, 20, 30]}, to="matrix"),
        run("compose", A, B, "--explain", "--precision", "4").out: frametool.explain("compose", A, B, precision=4),
        run("lookup", "drive.yaml", "map", "lidar", "--at", "1.25", "--explain").out: frametool.explain("lookup", tree, "map", "lidar", at_ns=1_250_000_000),
        run("apply", "drive.yaml", "map", "lidar", "1", "2", "3", "--explain").out: frametool.explain("apply", tree, "map", "lidar", [1, 2, 3]),
        run("sim", "follow", "--explain-step", "3").out: frametool.explain("follow", frametool.follow_steps(frametool.tutorial(), 3)),
    }
    assert [text == str(made) for text, made in pairs.items()] == [True] * len(pairs)


def _written(name: str, run: Callable[..., Outcome]) -> str:
    assert run("--version", files=FILES).status == 0
    return name


def test_a_transform_is_a_pose_too() -> None:
    turn = frametool.Rotation.from_rpy([0.1, 0.2, 0.3])
    sheet = frametool.explain("invert", frametool.Transform(turn, [1.0, 2.0, 3.0]))
    assert "xyz 1 2 3 m, xyzw 0.0342708" in str(sheet)
    assert "1. Quaternion to matrix" in str(frametool.explain("convert", turn, to="matrix")).replace("2. Q", "1. Q")


@pytest.mark.parametrize(("operation", "operands", "message"), [
    ("conver", (), "no operation 'conver'; did you mean 'convert'?"),
    ("convert", (), "missing a required argument: 'pose'"),
    ("compose", (), "compose takes at least one pose"),
    ("invert", ([1, 2],), "a bare list of 2 numbers"),
    ("convert", (frametool.Rotation.random(3),), "expected one pose"),
    ("follow", (3,), "expected the steps of follow_steps"),
])  # fmt: skip
def test_what_cannot_be_derived_is_said(operation: str, operands: tuple[Any, ...], message: str) -> None:
    with pytest.raises(frametool.FrametoolError, match=re.escape(message)):
        frametool.explain(operation, *operands)


def test_a_derivation_that_leads_elsewhere_is_never_printed(monkeypatch: pytest.MonkeyPatch, run: Callable[..., Outcome]) -> None:
    wrong = [line._replace(text=line.text.replace("ay*bz - az*by", "ay*bz + az*by")) for line in sheets()["product"]]
    monkeypatch.setitem(sheets(), "product", wrong)
    outcome = run("compose", A, A.replace("camera", "tip").replace("base", "camera"), "--explain")
    assert (outcome.status, outcome.out) == (1, "")
    assert "this is a mistake in frametool, please report it" in outcome.err
    with pytest.raises(DerivationWrong):
        frametool.explain("compose", {"rpy": [1, 2, 3]}, {"rpy": [1, 2, 3]})


def test_a_representation_without_a_block_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch, run: Callable[..., Outcome]) -> None:
    monkeypatch.setattr(derive, "BLOCKS", {name: block for name, block in BLOCKS.items() if name != "mrp"})
    outcome = run("convert", "--from", "mrp", "0.1", "0", "0", "--explain")
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err.startswith("frametool: there is no derivation of 'mrp'; derived are quaternion, xyzw, wxyz, rpy")


SIDES = [
    ["--world-axes", "enu_from_ned", "--axes", "frd_from_flu"],
    ["--world-axes", "ned_from_enu"],
    ["--world-axes", "unity_from_ros", "--axes", "ros_from_unity"],
]


@pytest.mark.parametrize("sides", SIDES, ids=" ".join)
@pytest.mark.parametrize("digits", [[], ["--precision", "full"]], ids=["short", "full"])
def test_axes_of_both_sides_are_derived(sides: list[str], digits: list[str], run: Callable[..., Outcome]) -> None:
    for pose in ("{xyz: [1, -2, 300], rpy_deg: [10, 20, 30]}", "{xyzw: [0.5, -0.5, 0.5, 0.5]}"):
        sheet = run("convert", pose, *sides, "--to", "rpy_deg", *digits, "--explain").out
        result = json.loads(run("convert", pose, *sides, "--to", "rpy_deg", "-f", "json").out)
        assert last_numbers(sheet) == numbers_in(result)
        assert recheck(sheet, None if digits else 6) > 0
