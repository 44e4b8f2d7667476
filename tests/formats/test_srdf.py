"""SRDF: its states are values of joints, its virtual joints edges; the URDF beside it says the rest."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

URDF = """<robot name="r"><link name="base"/><link name="arm"/><link name="tip"/>
<joint name="pan" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="reach" type="prismatic"><parent link="arm"/><child link="tip"/></joint>
</robot>"""
SRDF = """<?xml version="1.0"?>
<robot name="r">
  <group name="arm"><joint name="pan"/></group>
  <group_state name="ready" group="arm"><joint name="pan" value="1.5707963267948966"/></group_state>
  <group_state name="ready" group="slide"><joint name="reach" value="0.5"/></group_state>
  <group_state name="wide" group="arm"><joint name="pan" value="1"/></group_state>
  <group_state name="wide" group="both"><joint name="pan" value="2"/></group_state>
  <group_state name="off" group="arm"><joint name="pann" value="2"/></group_state>
  <group_state name="bad" group="arm"><joint name="pan" value="left"/></group_state>
  <group_state name="bare" group="arm"/>
  <group_state name="placed" group="all"><joint name="hold" value="1 2 1.5707963267948966"/></group_state>
  <virtual_joint name="hold" type="planar" parent_frame="world" child_link="base"/>
  <disable_collisions link1="base" link2="arm" reason="Adjacent"/>
</robot>
"""
FILES = {"r.urdf": URDF, "r.srdf": SRDF}


def lookup(run: Run, target: str, source: str, *arguments: str) -> Outcome:
    """Look up in the robot."""
    return run("lookup", "r.urdf", target, source, "--quiet", "-f", "csv", *arguments, files=FILES)


def numbers(done: Outcome) -> list[float]:
    """Give the position and the rotation of a result."""
    assert done.status == 0, done.err
    return [float(cell) for cell in done.out.splitlines()[1].split(",")[2:9]]


def test_a_state_is_taken_from_all_groups_that_have_it(run: Run) -> None:
    half = 0.7071067811865476
    found = lookup(run, "base", "tip", "--joints", "r.srdf:ready")
    assert numbers(found) == [0.0, 0.5, 0.0, 0.0, 0.0, half, half]
    assert numbers(lookup(run, "base", "tip", "--joints", "r.srdf:slide/ready"))[:3] == [0.5, 0.0, 0.0]


@pytest.mark.parametrize(
    ("state", "status", "said"),
    [
        ("", 2, "r.srdf: say which state: --joints r.srdf:ready or --joints r.srdf:wide or"),
        (":raedy", 1, "r.srdf: no state 'raedy'; did you mean 'ready'? states: bad, bare, off, placed, ready, wide"),
        (":off", 1, r"r.srdf:8:\d+: no joint 'pann'; did you mean 'pan'"),
        (":bad", 1, r"r.srdf:9:\d+: value: 'left' is not an? (angle|number)"),
        (":bare", 1, "r.srdf: state 'bare' has no joints"),
        (":wide", 1, r"r.srdf:7:\d+: joint 'pan' has another value in line 6; say which: r.srdf:arm/wide or r.srdf:both/wide"),
    ],
)
def test_a_state_that_cannot_be_taken_says_why(state: str, status: int, said: str, run: Run) -> None:
    done = lookup(run, "base", "tip", "--joints", f"r.srdf{state}")
    assert done.status == status
    assert re.search(said if "\\" in said else re.escape(said), done.err), done.err


def test_a_virtual_joint_is_an_edge_that_takes_a_pose(run: Run) -> None:
    assert numbers(lookup(run, "world", "tip", "--with", "r.srdf"))[:3] == [0.0, 0.0, 0.0]
    told = ("-j", "hold={xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}", "-j", "reach=1")
    assert numbers(lookup(run, "world", "tip", "--with", "r.srdf", *told))[:3] == [1.0, 3.0, 0.0]
    assert numbers(lookup(run, "world", "base", "--with", "r.srdf", "--joints", "r.srdf:placed"))[:3] == [1.0, 2.0, 0.0]


def test_what_is_wrong_with_virtual_joints_is_named(run: Run) -> None:
    odd = '<robot name="r">\n<virtual_joint name="v" type="{}" parent_frame="w" child_link="{}"/>\n{}</robot>'
    wrong = {
        odd.format("odd", "a", ""): r"r\.srdf:2:\d+: virtual joint 'v' has the type 'odd'; types: fixed, floating, planar",
        odd.format("fixed", "", ""): r"r\.srdf:2:\d+: <virtual_joint> has no child_link",
        '<robot name="r"><group name="g"/></robot>': "no virtual joint, so no frames; --joints FILE:STATE",
        odd.format("fixed", "a", "<x>"): r"r\.srdf:3:\d+: not XML",
    }
    for text, said in wrong.items():
        done = run("tree", "r.srdf", files={"r.srdf": text})
        assert (done.status, done.out) == (1, "")
        assert re.search(said, done.err), done.err


def test_urdf_and_srdf_are_told_apart_though_both_are_robots(run: Run) -> None:
    assert "URDF robot" in run("tree", "-v", "a", files={"a": URDF}).err
    assert "SRDF, the semantics of a robot" in run("tree", "a", files={"a": SRDF}).err


def test_a_state_that_speaks_of_a_floating_base_or_a_fixed_joint_leaves_these_out(run: Callable[..., Any]) -> None:
    robot = (
        '<robot name="r"><link name="a"/><link name="b"/><link name="c"/><joint name="j" type="revolute"><parent link="a"/>'
        '<child link="b"/><limit lower="-1" upper="1"/></joint><joint name="f" type="fixed"><parent link="b"/><child link="c"/></joint></robot>'
    )
    state = (
        '<robot name="r"><gripper name="g"/><group_state name="home" group="g"><joint name="root" value="0 0 1 0 0 0 1"/>'
        '<joint name="f" value="0.5"/><joint name="j" value="0.25"/></group_state></robot>'
    )
    files = {"a.urdf": robot, "a.srdf": state}
    done = run("lookup", "a.urdf", "a", "c", "--joints", "a.srdf:home", "--to", "rotvec", "-f", "json", files=files)
    assert json.loads(done.out)["rotvec"] == pytest.approx([0.25, 0.0, 0.0])
    assert all(f"joint '{name}' does not move in the robot; its value is left out" in done.err for name in ("root", "f"))
