"""Robots in Python: forward kinematics for floats and arrays, the same bits, held against products of matrices."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from robots import RandomRobot

import frametool
from frametool.errors import FormatError, NotConnected, UnknownFrame, ValueInvalid

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    from frametool.formats.robots.model import Robot

ARM = Path(__file__).resolve().parent.parent.parent / "examples" / "arm.urdf"


@pytest.fixture
def arm() -> Robot:
    """Load the example."""
    return frametool.load_robot(ARM)


@pytest.mark.parametrize("seed", range(8))
def test_a_chain_between_any_two_links_is_the_product_of_matrices(seed: int, tmp_path: Path) -> None:
    made = RandomRobot(seed)
    (tmp_path / "r.urdf").write_text(made.urdf)
    robot = frametool.load_robot(tmp_path / "r.urdf")
    for base, tip in (("link0", "link12"), ("link12", "link5"), ("link3", "link11"), ("link7", "link7")):
        expected = np.linalg.inv(made.pose(base)) @ made.pose(tip)
        found = robot.fk(base, tip, {name: made.values[name] for name in robot.chain(base, tip).needs})
        assert np.abs(found.as_matrix() - expected).max() < 1e-13


@pytest.mark.parametrize("seed", range(4))
def test_arrays_give_the_bits_of_floats(seed: int, tmp_path: Path) -> None:
    made = RandomRobot(seed)
    (tmp_path / "r.urdf").write_text(made.urdf)
    robot = frametool.load_robot(tmp_path / "r.urdf")
    chain = robot.chain("link9", "link12")
    rows = np.random.default_rng(seed).uniform(-4.0, 4.0, (30, 2, len(chain.needs)))
    many = robot.fk("link9", "link12", rows)
    by_name = robot.fk("link9", "link12", {name: rows[..., at] for at, name in enumerate(chain.needs)})
    assert many.xyz.shape == ((30, 2, 3) if chain.needs else (3,))
    for place in np.ndindex(30, 2):
        one = robot.fk("link9", "link12", dict(zip(chain.needs, rows[place].tolist(), strict=True)))
        for each in (many, by_name):
            found = [part[place] if chain.needs else part for part in each.components]
            assert np.array(found).tobytes() == np.array(one.components).tobytes()


@pytest.mark.parametrize("seed", range(6))
def test_a_tree_and_a_robot_give_the_same_bits_at_the_same_joints(seed: int, tmp_path: Path) -> None:
    made = RandomRobot(seed)
    (tmp_path / "r.urdf").write_text(made.urdf)
    robot = frametool.load_robot(tmp_path / "r.urdf")
    rng = np.random.default_rng(seed)
    for base, tip in (("link0", "link12"), ("link12", "link5"), ("link3", "link11")):
        needs = robot.chain(base, tip).needs
        rows = rng.uniform(-4.0, 4.0, (12, len(needs)))
        rows[rng.random(rows.shape) < 0.3] = 0.0  # where a joint is at rest the bits of the file stand
        many = robot.fk(base, tip, rows).as_matrix()
        for row, values in enumerate(rows.tolist()):
            joints = dict(zip(needs, values, strict=True))
            tree = frametool.load(tmp_path / "r.urdf", joints=joints).lookup(base, tip)
            assert tree.components == robot.fk(base, tip, joints).components
            assert np.array_equal(tree.as_matrix(), many[row] if needs else many)


@pytest.mark.parametrize("unit", ["", "deg"])
def test_lookup_and_fk_print_the_same_numbers(unit: str, run: Callable[..., Outcome]) -> None:
    names = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_roll")
    rows = [*np.random.default_rng(3).uniform(-2.0, 2.0, (20, 4)).tolist(), [0.0] * 4, [0.5, 0.0, -0.0, 0.25]]
    header = ",".join(f"{name}{'_deg' * bool(unit)}" for name in names)
    text = "\n".join([header, *(",".join(map(repr, row)) for row in rows), ""])
    ways = {
        name: run("fk", str(ARM), *name, "-f", "json", stdin=text).out
        for name in (("arm_base", "tool"), ("tool", "shoulder"))
    }
    for (base, tip), out in ways.items():
        for row, line in zip(rows, out.splitlines(), strict=True):
            joints = [
                each for name, value in zip(names, row, strict=True) for each in ("-j", f"{name}={value!r}{unit}")
            ]
            found = json.loads(run("lookup", str(ARM), base, tip, *joints, "-f", "json").out)
            assert [json.loads(line)[key] for key in ("xyz", "quaternion")] == [
                found[key] for key in ("xyz", "quaternion")
            ]


def test_values_may_be_text_numbers_and_arrays_together(arm: Robot) -> None:
    pans = np.array([0.0, math.pi / 2])
    found = arm.fk("arm_base", "tool", {"shoulder_pan": pans, "shoulder_lift": "90deg", "elbow": 0, "wrist_roll": 0.0})
    reach = 0.425 + 0.392 + 0.115
    assert found.xyz == pytest.approx(np.array([[reach, 0.0, 0.152], [0.0, reach, 0.152]]))


def test_what_follows_another_joint_needs_no_value_and_may_have_one(arm: Robot) -> None:
    assert arm.chain("left_finger", "right_finger").needs == ("gripper",)
    assert arm.fk("left_finger", "right_finger", {"gripper": 0.02}).xyz.tolist() == [0.0, -0.04, 0.0]
    assert arm.fk("left_finger", "right_finger", [0.02]).xyz.tolist() == [0.0, -0.04, 0.0]
    both = {"gripper": "2cm", "gripper_right": "1cm"}
    assert arm.fk("left_finger", "right_finger", both).xyz.tolist() == [0.0, -0.03, 0.0]
    assert arm.fk("tool", "right_finger", {"gripper_right": 0.01}).xyz.tolist() == [0.0, -0.01, -0.02]


def test_fixed_ways_need_no_joints(arm: Robot) -> None:
    assert arm.fk("tool", "wrist", {}).xyz.tolist() == [0.0, 0.0, -0.115]
    assert arm.fk("tool", "tool", {}).components == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def test_a_planar_joint_takes_a_pose(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="planar">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>'
    )
    robot = frametool.load_robot(tmp_path / "r.urdf")
    pose = frametool.Transform.from_arrays([1.0, 2.0, 0.0], [0.0, 0.0, 1.0, 0.0])
    for value in (pose, "{xyz: [1, 2, 0], rpy_deg: [0, 0, 180]}"):
        assert robot.fk("a", "b", {"j": value}).components == (1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("base", "tip", "joints", "said"),
    [
        ("tool", "left_finger", {}, "no value for gripper; the joints on the way are gripper"),
        ("tool", "left_finger", {"griper": 1.0}, "no joint 'griper'; did you mean 'gripper'"),
        ("tool", "left_finger", {"gripper": math.nan}, "gripper: nan is not finite"),
        ("tool", "left_finger", {"gripper": np.array([0.0, math.inf])}, r"gripper\[1\]: inf is not finite"),
        ("tool", "left_finger", {"gripper": "3deg"}, "'3deg' is not a length"),
        ("tool", "left_finger", np.zeros((5, 2)), r"joints: expected shape \(\.\.\., 1\) for gripper, got \(5, 2\)"),
        ("tool", "left_finger", {"gripper": "a"}, "'a' is not a"),
        ("arm_base", "tool", {"shoulder_pan": np.zeros(2), "elbow": np.zeros(3), "shoulder_lift": 0.0, "wrist_roll": 0.0},
         r"batch shapes \(2,\) and \(3,\) do not broadcast|batch shapes"),
    ],
)  # fmt: skip
def test_values_that_do_not_fit_are_refused(arm: Robot, base: str, tip: str, joints: Any, said: str) -> None:
    with pytest.raises(ValueInvalid, match=said):
        arm.fk(base, tip, joints)


@pytest.mark.filterwarnings("ignore:.*roots")
def test_frames_that_are_not_there_or_not_connected_are_refused(arm: Robot, tmp_path: Path) -> None:
    with pytest.raises(UnknownFrame, match="did you mean 'tool'"):
        arm.fk("arm_base", "tol", {})
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="a"/><link name="b"/></robot>')
    with pytest.raises(NotConnected):
        frametool.load_robot(tmp_path / "r.urdf").fk("a", "b", {})


def test_what_is_no_robot_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("frames: {a: {b: {}}}")
    with pytest.raises(FormatError, match="expected a URDF robot, found YAML"):
        frametool.load_robot(tmp_path / "a.yaml")


def test_a_robot_tells_its_frames_roots_and_joints(arm: Robot) -> None:
    assert arm.roots == ("arm_base",)
    assert repr(arm) == "Robot(8 frames, 6 joints, roots: arm_base)"
    assert arm.frames[:2] == ("arm_base", "shoulder")
    assert [*arm.joints] == ["shoulder_pan", "shoulder_lift", "elbow", "wrist_roll", "gripper", "gripper_right"]
    assert (arm.joints["elbow"].kind, arm.joints["elbow"].lower) == ("revolute", -2.4)
