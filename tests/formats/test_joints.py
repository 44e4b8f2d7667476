"""Values of joints: units, poses, mimics, limits; from options and from files of every kind, standing and moving."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

import frametool
from frametool.errors import BadAnswer, FormatError, FrametoolError, FrametoolWarning, ValueInvalid
from frametool.formats.robots.joints import JointState, find_joint_columns
from frametool.formats.robots.model import Joint, JointValue, Mimic, motion, read_value
from frametool.grammar.edges import Answers, Diagnostics, Options, Topics

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

URDF = """<robot name="r">
<link name="base"/><link name="arm"/><link name="tip"/><link name="left"/><link name="right"/>
<joint name="pan" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
  <limit lower="-2" upper="2"/></joint>
<joint name="reach" type="prismatic"><parent link="arm"/><child link="tip"/><axis xyz="1 0 0"/>
  <limit lower="0" upper="0.5"/></joint>
<joint name="grip" type="revolute"><parent link="tip"/><child link="left"/><axis xyz="0 0 1"/>
  <mimic joint="pan" multiplier="-2" offset="0.5"/></joint>
<joint name="grip2" type="revolute"><parent link="tip"/><child link="right"/><axis xyz="0 0 1"/>
  <mimic joint="grip" multiplier="2"/></joint>
</robot>
"""
TURN = Joint("pan", "revolute", (0.0, 0.0, 1.0))
SLIDE = Joint("reach", "prismatic")
FREE = Joint("free", "floating")
PLANE = Joint("plane", "planar", (0.0, 0.0, 1.0))
BALL = Joint("ball", "ball")
SOURCE: Any = None


@pytest.mark.parametrize(
    ("joint", "text", "value"),
    [
        (TURN, "0.5", JointValue(0.5)),
        (TURN, "-1e-3", JointValue(-0.001)),
        (TURN, "30deg", JointValue(30.0, degrees=True)),
        (TURN, "1.5rad", JointValue(1.5)),
        (TURN, "pi/2", JointValue(90.0, degrees=True)),
        (SLIDE, "0.5", JointValue(0.5)),
        (SLIDE, "2cm", JointValue(0.02)),
        (SLIDE, "-20 mm", JointValue(-0.02)),
        (SLIDE, "0.1m", JointValue(0.1)),
        (SLIDE, "7um", JointValue(7e-6)),
    ],
)
def test_a_value_is_a_number_with_or_without_a_unit(joint: Joint, text: str, value: JointValue) -> None:
    assert read_value(joint, text, SOURCE) == value


@pytest.mark.parametrize(
    ("joint", "text", "said"),
    [
        (TURN, "3cm", "'3cm' is not an angle"),
        (SLIDE, "30deg", "'30deg' is not a length; write metres, or a unit"),
        (SLIDE, "3km", "'3km' is not a length"),
        (SLIDE, "0,3", "has a decimal comma"),
        (TURN, "nan", "is not finite"),
        (TURN, "", "is empty"),
        (TURN, {"xyz": ["0", "0", "0"]}, "is revolute: expected radians, or 30deg, found a mapping"),
        (SLIDE, ["1"], "is prismatic: expected metres, or 2cm, found a list"),
        (FREE, "0.5", "is floating: it takes a POSE"),
        (FREE, "{xyz: [1, 2]}", "expected 3 numbers"),
        (FREE, "{xyz: [1", "joint 'free':"),
        (FREE, "{name: a, xyz: [1, 2, 3]}", "leave name and parent out"),
        (PLANE, "{xyz: [0, 0, 1]}", "leaves the plane across 0 0 1"),
        (PLANE, "{rpy: [0.1, 0, 0]}", "leaves the plane across 0 0 1"),
        (BALL, "{xyz: [1, 0, 0]}", "it turns only"),
    ],
)
def test_a_value_that_a_joint_cannot_have_is_refused(joint: Joint, text: Any, said: str) -> None:
    from frametool.documents.source import Source

    with pytest.raises(ValueInvalid, match=re.escape(said)):
        read_value(joint, text, Source("here", ""))


def test_at_its_rest_a_joint_moves_nothing() -> None:
    resting = TURN._replace(rest=0.75)
    assert motion(resting, resting.start) == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert motion(SLIDE._replace(rest=0.5), JointValue(2.0))[:3] == (1.5, 0.0, 0.0)


@pytest.fixture
def arm(tmp_path: Path) -> Callable[..., Any]:
    """Load the robot with what is told of its joints."""
    (tmp_path / "arm.urdf").write_text(URDF)

    def load(joints: Any = None, content: str | bytes = "", name: str = "joints") -> Any:
        if content:
            path = tmp_path / name
            path.write_bytes(content.encode() if isinstance(content, str) else content)
            joints = str(path)
        return frametool.load(tmp_path / "arm.urdf", joints=joints)

    return load


def posture(tree: Any, at: int | None = None) -> list[float]:
    """Give the values that a tree shows: of pan, reach, grip and grip2."""

    def about_z(parent: str, child: str) -> float:
        return float(tree.lookup(parent, child, at).rotation.as_rotvec()[2])

    reach = float(tree.lookup("arm", "tip", at).xyz[0])
    return [about_z("base", "arm"), reach, about_z("tip", "left"), about_z("tip", "right")]


def test_joints_stand_at_zero_and_mimics_follow_in_chains(arm: Callable[..., Any]) -> None:
    assert posture(arm()) == pytest.approx([0.0, 0.0, 0.5, 1.0])
    assert posture(arm({"pan": 0.25})) == pytest.approx([0.25, 0.0, 0.0, 0.0])
    assert posture(arm({"pan": "0.1", "reach": "5cm"})) == pytest.approx([0.1, 0.05, 0.3, 0.6])


def test_only_its_own_name_overrides_a_mimic(arm: Callable[..., Any]) -> None:
    assert posture(arm({"pan": 0.25, "grip": 0.4})) == pytest.approx([0.25, 0.0, 0.4, 0.8])
    assert posture(arm({"grip2": -0.4})) == pytest.approx([0.0, 0.0, 0.5, -0.4])


def test_a_quarter_turn_in_degrees_is_exact_and_so_is_what_follows_it() -> None:
    joints = [TURN, Joint("other", "continuous", (0.0, 0.0, 1.0), mimic=Mimic("pan", -2.0))]
    options = Options(Diagnostics(), Topics(), answers=Answers(joints={"pan": "90deg"}))
    found = JointState(joints, options, "arm.urdf")
    assert motion(joints[0], found.still["pan"])[5:] == (0.7071067811865476, 0.7071067811865476)
    assert motion(joints[1], found.still["other"])[5:] == (-1.0, 0.0)


def test_limits_are_told_and_not_enforced_and_followers_may_leave_theirs(arm: Callable[..., Any]) -> None:
    with pytest.warns(FrametoolWarning, match=r"arm\.urdf:3: joint 'pan' is beyond its limits -2 \.\. 2 rad, 2\.5"):
        assert posture(arm({"pan": 2.5}))[0] == pytest.approx(2.5)
    assert posture(arm({"pan": -1.0}))[2] == pytest.approx(2.5)
    assert posture(arm({"pan": 2.0 + 1e-10}))[0] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("-j", "pann=1"), "--joint: no joint 'pann'; did you mean 'pan'? joints: grip, grip2, pan, reach"),
        (("-j", "pan=1x"), "--joint 'pan': '1x' is not an angle"),
        (("-j", "pan"), "--joint takes NAME=VALUE, found 'pan'"),
        (("-j", "=1"), "--joint takes NAME=VALUE, found '=1'"),
    ],
)
def test_a_wrong_option_is_misuse(arguments: tuple[str, ...], said: str, run: Run) -> None:
    done = run("lookup", "arm.urdf", "base", "tip", *arguments, files={"arm.urdf": URDF})
    assert (done.status, done.out) == (2, "")
    assert said in done.err


@pytest.mark.parametrize("command", [["tree"], ["check"], ["monitor"], ["view", "-f", "svg"]])
def test_every_command_that_reads_a_robot_refuses_a_joint_it_does_not_have(command: list[str], run: Run) -> None:
    done = run(*command, "arm.urdf", "-j", "nose=1", files={"arm.urdf": URDF})
    assert (done.status, done.out, "no joint 'nose'" in done.err) == (2, "", True)


def test_joints_need_a_robot(run: Run) -> None:
    done = run("lookup", "-j", "pan=1", "a.yaml", "a", "b", files={"a.yaml": "frames: {a: {b: {}}}"})
    assert (done.status, "--joint: there are no joints in a.yaml" in done.err) == (2, True)


def test_a_joint_may_belong_to_any_of_several_robots(run: Run) -> None:
    other = """<robot name="x"><link name="x_arm"/><link name="x_tip"/><joint name="x_reach" type="prismatic">
      <parent link="x_arm"/><child link="x_tip"/></joint></robot>"""
    files = {"a.urdf": URDF, "b.urdf": other}
    done = run("lookup", "a.urdf", "x_arm", "x_tip", "--with", "b.urdf", "-j", "x_reach=1cm", "-f", "json", files=files)
    assert (done.status, '"xyz": [0.01, 0.0, 0.0]' in done.out) == (0, True), done.err
    assert run("lookup", "a.urdf", "base", "tip", "--with", "b.urdf", "-j", "y_reach=1").status == 2


STILL = {
    "a map in YAML": "pan: 0.25\nreach: 10cm\n",
    "a map in JSON": '{"pan": 0.25, "reach": "100mm"}',
    "a map under a key": "initial_positions:\n  pan: 0.25\n  reach: 0.1\n",
    "a JointState of ROS 1": (
        "header: \n  seq: 1\n  stamp: \n    secs: 5\n    nsecs: 7\n  frame_id: ''\n"
        "name: [reach, pan]\nposition: [0.1, 0.25]\nvelocity: []\neffort: []\n---\n"
    ),
    "a JointState of ROS 2": (
        "header:\n  stamp:\n    sec: 5\n    nanosec: 7\n  frame_id: ''\n"
        "name:\n- reach\n- pan\nposition:\n- 0.1\n- 0.25\nvelocity: []\neffort: []\n---\n"
    ),
    "a JointState in rosbridge's envelope": (
        '{"op": "publish", "topic": "/joint_states", "msg": {"header": {"stamp": {"sec": 5, "nanosec": 7}}, '
        '"name": ["reach", "pan"], "position": [0.1, 0.25]}}\n'
    ),
    "messages without times, of which the last counts": (
        '{"name": ["pan"], "position": [1.0]}\n{"name": ["reach", "pan"], "position": [0.1, 0.25]}\n'
    ),
    "a table": "pan,reach\n1.0,0.3\n0.25,0.1\n",
    "a table with units": "pan [deg];reach_mm\n14.32394487827058;100\n",
    "a table between tabs": "pan\treach\n0.25\t0.1\n",
    "a table in which nothing moves": "t,pan,reach\n0,0.25,0.1\n1,0.25,0.1\n",
}


@pytest.mark.parametrize("name", STILL)
def test_a_file_says_where_joints_stand(name: str, arm: Callable[..., Any]) -> None:
    tree = arm(content=STILL[name])
    assert isinstance(tree, frametool.FrameTree)
    assert posture(tree) == pytest.approx([0.25, 0.1, 0.0, 0.0], abs=1e-12)


ROS2 = (
    "header:\n  stamp:\n    sec: {}\n    nanosec: 500000000\n  frame_id: ''\n"
    "name: [reach, pan]\nposition: [0.1, {}]\nvelocity: []\neffort: []\n---\n"
)
MOVING = {
    "JointState of ROS 2": ROS2.format(1, 0.0) + ROS2.format(2, 0.5),
    "JointState a line": "".join(
        f'{{"header": {{"stamp": {{"sec": {at}, "nanosec": 500000000}}}}, "name": ["pan", "reach"], "position": [{to}, 0.1]}}\n'
        for at, to in ((1, 0.0), (2, 0.5))
    ),
    "maps with stamps": '{"stamp": 1.5, "pan": 0.0, "reach": 0.1}\n{"stamp": 2.5, "pan": "0.5rad", "reach": "10cm"}\n',
    "a table with seconds": "t,pan,reach\n1.5,0.0,0.1\n2.5,0.5,0.1\n",
    "a table with nanoseconds": "pan,stamp_ns,reach\n0.0,1500000000,0.1\n0.5,2500000000,0.1\n",
    "a table with milliseconds": "time [ms],pan,reach\n1500,0.0,0.1\n2500,0.5,0.1\n",
    "a table of messages": "header.stamp,pan,reach\n1.5,0.0,0.1\n2.5,0.5,0.1\n",
    "a table in any order": "time [s],pan,reach\n2.5,0.5,0.1\n1.5,0.0,0.1\n",
}


@pytest.mark.parametrize("name", MOVING)
def test_joints_that_move_in_a_file_move_with_its_stamps(name: str, arm: Callable[..., Any]) -> None:
    tree = arm(content=MOVING[name])
    assert isinstance(tree, frametool.TransformBuffer)
    assert posture(tree, 2_000_000_000) == pytest.approx([0.25, 0.1, 0.0, 0.0], abs=1e-12)
    assert posture(tree, 2_500_000_000)[2:] == pytest.approx([-0.5, -1.0])
    assert tree.lookup("arm", "tip", 0).xyz[0] == pytest.approx(0.1)  # it does not move: it stands at all times


def test_the_later_file_and_the_option_win(run: Run) -> None:
    files = {"arm.urdf": URDF, "a.yaml": "{pan: 1, reach: 0.1}", "b.yaml": "{pan: 0}"}
    done = run("lookup", "arm.urdf", "base", "tip", "--joints", "a.yaml", "--joints", "b.yaml", "-f", "json", files=files)
    assert '"xyz": [0.1, 0.0, 0.0]' in done.out
    done = run("lookup", "arm.urdf", "base", "tip", "--joints", "a.yaml", "-j", "pan=90deg", "-f", "json")
    assert '"xyz": [0.0, 0.1, 0.0]' in done.out


WRONG_FILES = {
    "an unknown joint in a map": ("pan: 1\nreech: 0.1\n", r"joints:2:8: no joint 'reech'; did you mean 'reach'\?"),
    "an unknown joint in a message": ("name: [pan, reech]\nposition: [1, 2]\n", r"joints:2:15: no joint 'reech'"),
    "a near column": ("t,pan,reech\n0,1,2\n", r"joints:1: column 'reech' is not a joint; did you mean 'reach'"),
    "no column": ("t,x,y\n0,1,2\n", r"joints:1: no column is a joint; columns: t, x, y; joints: grip, "),
    "two columns": ("pan,pan_deg\n1,2\n", r"joints:1: columns 'pan' and 'pan_deg' are both joint 'pan'"),
    "a unit": ("t,pan_mm\n0,1\n", r"joints:1: column 'pan_mm': joint 'pan' is revolute; units: deg, rad"),
    "fewer positions": ("name: [pan, reach]\nposition: [1]\n", r"joints:2:11: 2 names and 1 positions"),
    "no positions": ("name: [pan]\nposition: []\nvelocity: [1]\n", r"joints:1:1: a JointState without positions"),
    "cut lists": ("name: [pan]\nposition: '<sequence type: double, length: 1>'\n", r"joints:2:11: the numbers are not there"),
    "a word": ("pan,reach\n1,2\n1,x\n", r"joints:3: reach: 'x' is not a number"),
    "NaN": ("name: [pan]\nposition: [.nan]\n", r"joints:2:12: '\.nan' is not finite"),
    "a stamp": ("t,pan\nnoon,1\n", r"joints:2: t: 'noon' is not a time"),
    "a short row": ("t,pan\n1\n", r"joints:2: expected 2 cells, found 1"),
    "a length for an angle": ("pan: 3cm\n", r"joints:1:6: '3cm' is not an angle"),
    "a list": ("[1, 2]", r"joints:1:2: expected a map of joints"),
    "nothing": ("", r"joints: no values of joints in it"),
    "only a header": ("t,pan\n", r"joints: no values of joints in it"),
    "XML": ("<html><body/></html>", r"joints: this XML has no values of joints"),
    "broken JSON": ('{"pan": 1', r"joints:1:"),
    "binary": (b"\x89PNG\r\n\x1a\n\0\0\0", r"not text but a PNG picture"),
}


@pytest.mark.parametrize("name", WRONG_FILES)
def test_a_file_that_is_wrong_is_bad_data_and_names_the_place(name: str, run: Run) -> None:
    content, said = WRONG_FILES[name]
    done = run("lookup", "arm.urdf", "base", "tip", "--joints", "joints", files={"arm.urdf": URDF, "joints": content})
    assert (done.status, done.out) == (1, "")
    assert re.search(said, done.err), done.err


def test_a_missing_file_is_trouble_with_files_and_states_need_a_form_that_has_them(run: Run) -> None:
    files = {"arm.urdf": URDF, "a.yaml": "pan: 1"}
    assert run("lookup", "arm.urdf", "base", "tip", "--joints", "none.yaml", files=files).status == 5
    done = run("lookup", "arm.urdf", "base", "tip", "--joints", "a.yaml:home")
    assert (done.status, "a.yaml: has no states with names; " in done.err) == (1, True)


def test_states_of_srdf_are_refused_with_what_gives_values_of_joints(run: Run) -> None:
    files = {"arm.urdf": URDF, "arm.srdf": '<robot name="r"><group_state name="home" group="arm"/></robot>'}
    done = run("lookup", "arm.urdf", "base", "tip", "--joints", "arm.srdf:home", files=files)
    assert (done.status, done.err.count("\n")) == (1, 1)
    assert "arm.srdf: SRDF, the semantics of a robot: give values of joints, --joints FILE with {JOINT: VALUE}" in done.err


def test_what_tools_print_between_messages_is_passed_over_and_told(arm: Callable[..., Any]) -> None:
    with pytest.warns(FrametoolWarning, match=r"joints:1: a line printed between messages skipped"):
        tree = arm(content="WARNING: topic [/joint_states] x\n" + ROS2.format(1, 0.0) + ROS2.format(2, 0.5))
    assert posture(tree, 2_000_000_000)[0] == pytest.approx(0.25)


def test_columns_that_are_no_joints_are_left_out_and_told(arm: Callable[..., Any]) -> None:
    with pytest.warns(FrametoolWarning, match="columns that are no joints were left out: note"):
        assert posture(arm(content="pan,reach,note\n0.25,0.1,x\n"))[:2] == pytest.approx([0.25, 0.1])


def test_a_step_of_half_a_turn_is_told_because_poses_between_go_the_other_way(arm: Callable[..., Any]) -> None:
    with pytest.warns(FrametoolWarning, match=r"joint 'pan' turns by half a turn or more in the step from 1\.000"):
        arm(content="t,pan\n0,-1.6\n1,-1.6\n2,1.6\n")


def test_joints_that_move_together_are_interpolated_at_each_others_times() -> None:
    series = {"a": {0: 0.0, 10: 1.0}, "b": {5: 0.5, 15: 2.5}}
    options = Options(Diagnostics(), Topics())
    joints = [Joint(name, "prismatic") for name in "ab"]
    found = JointState(joints, options, "arm.urdf")
    for name, values in series.items():
        found.series[name] = {at: JointValue(value) for at, value in values.items()}
    steps = {at: tuple(motion(joint, value)[0] for joint, value in zip(joints, both, strict=True)) for at, both in found.values("a", "b")}
    assert steps == {5: (0.5, 0.5), 10: (1.0, 1.5)}
    found.series["b"] = {20: JointValue(0.0), 30: JointValue(1.0)}
    with pytest.raises(FormatError, match="joints a, b move one frame and have no time in common"):
        list(found.values("a", "b"))


def test_columns_are_found_by_name_and_unit() -> None:
    joints = {joint.name: joint for joint in (TURN, SLIDE, Joint("x_deg", "prismatic"))}
    names = ["t", "pan [deg]", "x_deg", "position.reach", "note"]
    found = [(each.joint, each.degrees, each.per_metre) for each in find_joint_columns(names, joints)]
    assert found == [("pan", True, 1.0), ("x_deg", False, 1.0), ("reach", False, 1.0)]
    assert [find_joint_columns([name], joints)[0].per_metre for name in ("reach_mm", "reach (cm)")] == [1000.0, 100.0]


def test_unknown_joints_from_python_are_refused(arm: Callable[..., Any]) -> None:
    with pytest.raises(BadAnswer, match="no joint 'nose'"):
        arm({"nose": 1.0})
    with pytest.raises(FrametoolError, match="not finite"):
        arm({"pan": float("nan")})
