"""URDF read: where the links are, what the joints do, and what is wrong with a file, in one line with its place."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from robots import RandomRobot

import frametool
from frametool.errors import BadTopology, FormatError, FrametoolWarning

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

ARM = Path(__file__).resolve().parent.parent.parent / "examples" / "arm.urdf"
TURN = '<origin xyz="1 0 0"/><axis xyz="0 0 1"/>'


def robot(*joints: str, links: str = "a b c") -> str:
    """Write a robot of joints, each on a line of its own from line 2 on, behind its links in line 1."""
    named = "".join(f'<link name="{name}"/>' for name in links.split())
    return "\n".join([f'<robot name="r">{named}', *joints, "</robot>"])


def joint(name: str = "j", parent: str = "a", child: str = "b", kind: str = "revolute", parts: str = TURN) -> str:
    """Write a joint."""
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{parts}</joint>'


def loaded(folder: Path, text: str | bytes, **options: Any) -> Any:
    """Load a robot from a file."""
    (folder / "r.urdf").write_bytes(text.encode() if isinstance(text, str) else text)
    return frametool.load(folder / "r.urdf", **options)


@pytest.mark.parametrize("seed", range(12))
def test_every_link_is_where_products_of_matrices_put_it(seed: int, tmp_path: Path) -> None:
    made = RandomRobot(seed)
    tree = loaded(tmp_path, made.urdf, joints=made.values)
    for index in range(len(made.joints) + 1):
        found = tree.lookup("link0", f"link{index}").as_matrix()
        assert np.abs(found - made.pose(f"link{index}")).max() < 1e-13


@pytest.mark.parametrize("kind", ["planar", "floating"])
def test_planar_and_floating_joints_take_a_pose(kind: str, tmp_path: Path) -> None:
    text = robot(joint(kind=kind), links="a b")
    tree = loaded(tmp_path, text, joints={"j": "{xyz: [0, 2, 0], rpy_deg: [0, 0, 90]}"})
    assert tree.lookup("a", "b").components == (1.0, 2.0, 0.0, 0.0, 0.0, 0.7071067811865476, 0.7071067811865476)
    assert loaded(tmp_path, text).lookup("a", "b").components == (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def test_the_motion_comes_behind_the_origin_and_about_the_axis_there(tmp_path: Path) -> None:
    text = robot(joint(parts='<origin xyz="1 0 0" rpy="1.5707963267948966 0 0"/><axis xyz="0 0 2"/>'), links="a b")
    a_from_b = loaded(tmp_path, text, joints={"j": "90deg"}).lookup("a", "b")
    assert a_from_b.apply([1.0, 0.0, 0.0]).tolist() == [1.0, 0.0, 1.0]


def test_without_origin_and_axis_a_joint_turns_about_x(tmp_path: Path) -> None:
    a_from_b = loaded(tmp_path, robot(joint(parts=""), links="a b"), joints={"j": "90deg"}).lookup("a", "b")
    assert a_from_b.apply([0.0, 1.0, 0.0]).tolist() == [0.0, 0.0, 1.0]


def test_quat_xyzw_says_a_rotation_alone_or_beside_angles_that_agree(tmp_path: Path) -> None:
    for rpy in ("", 'rpy="0 0 1.5707963"'):
        text = robot(joint(kind="fixed", parts=f'<origin {rpy} quat_xyzw="0 0 0.6 0.8"/>'), links="a b")
        if rpy:
            with pytest.raises(FormatError, match=r":2:.* disagree by 16\.26"):
                loaded(tmp_path, text)
        else:
            assert loaded(tmp_path, text).lookup("a", "b").xyzw.tolist() == [0.0, 0.0, 0.6, 0.8]
    close = 'rpy="0 0 1.2870022" quat_xyzw="0 0 0.6 0.8"'
    tree = loaded(tmp_path, robot(joint(kind="fixed", parts=f"<origin {close}/>"), links="a b"))
    assert tree.lookup("a", "b").xyzw.tolist() == [0.0, 0.0, 0.6, 0.8]


def test_a_quaternion_with_few_digits_is_normalised_with_a_warning(tmp_path: Path) -> None:
    text = robot(joint(kind="fixed", parts='<origin quat_xyzw="0 0 0.7068 0.7068"/>'), links="a b")
    with pytest.warns(FrametoolWarning, match=r"r\.urdf:2: a quaternion was off norm 1"):
        tree = loaded(tmp_path, text)
    assert tree.lookup("a", "b").xyzw.tolist() == pytest.approx([0.0, 0.0, 0.5**0.5, 0.5**0.5], abs=2e-16)


def test_a_joint_deeper_than_the_robot_is_none(tmp_path: Path) -> None:
    others = (
        '<transmission name="t"><joint name="nothing" type="x"/></transmission>'
        '<gazebo><plugin><joint name="j"/></plugin></gazebo>'
        '<gazebo reference="b"><sensor:camera name="s"/></gazebo>'
    )
    assert loaded(tmp_path, robot(others, joint(), links="a b")).frames == ("a", "b")


def test_links_without_joints_are_roots_and_several_are_told(run: Run) -> None:
    done = run("lookup", "r.urdf", "a", "b", files={"r.urdf": robot(joint(), links="a b c d")})
    assert (done.status, "warning: r.urdf:1: 3 roots, where a robot has one: a, c, d" in done.err) == (0, True)
    assert run("check", "r.urdf").out.endswith("[several-roots]\n")


def test_what_the_file_means_is_told_once(run: Run) -> None:
    files = {"r.urdf": robot(joint(), joint("k", "b", "c", "prismatic"))}
    err = run("lookup", "r.urdf", "a", "c", files=files).err
    assert err == "frametool: r.urdf: 2 joints at 0 (--joint NAME=VALUE)\n"
    assert "r.urdf: 1 joint at 0 (" in run("lookup", "r.urdf", "a", "c", "-j", "j=0.5").err
    assert run("lookup", "r.urdf", "a", "c", "-j", "j=0.5", "-j", "k=1cm").err == ""
    assert run("lookup", "r.urdf", "a", "c", "--quiet").err == ""


XACRO = {
    "an element": '<robot name="r">\n<xacro:macro name="m"/></robot>',
    "an expression": '<robot name="r">\n<link name="${prefix}a"/></robot>',
    "an argument": '<robot name="r">\n<link name="$(arg prefix)a"/></robot>',
    "an expression in a number": robot(joint(parts='<origin xyz="${2*0.1} 0 0"/>')),
}


@pytest.mark.parametrize("name", XACRO)
@pytest.mark.parametrize("told", [(), ("--in", "urdf")])
def test_xacro_in_disguise_is_refused_with_what_to_do(name: str, told: tuple[str, ...], run: Run) -> None:
    done = run("tree", *told, "r.urdf", files={"r.urdf": XACRO[name]})
    assert (done.status, done.out, done.err.count("pip install xacro")) == (1, "", 1)
    assert not told or "r.urdf:2:" in done.err


def test_the_namespace_of_xacro_and_comments_about_it_are_no_xacro(tmp_path: Path) -> None:
    text = '<!-- made by xacro: <xacro:arg/> ${x} -->\n<robot name="r" xmlns:xacro="http://x"><link name="a"/></robot>'
    assert loaded(tmp_path, text).frames == ("a",)


WRONG = {
    "duplicate link": (robot(links="a a"), r"r\.urdf:1:\d+: link 'a' twice; first in line 1"),
    "duplicate joint": (robot(joint(), joint(child="c")), r"r\.urdf:3:\d+: joint 'j' twice; first in line 2"),
    "link without a name": ('<robot name="r"><link/></robot>', r"r\.urdf:1:17: <link> has no name"),
    "empty name": ('<robot name="r"><link name=""/></robot>', r"r\.urdf:1:29: <link> has no name"),
    "joint without a name": (robot('<joint type="fixed"/>'), r"r\.urdf:2:1: <joint> has no name"),
    "joint without a type": (robot('<joint name="j"/>'), r"r\.urdf:2:1: <joint> has no type"),
    "unknown type": (robot(joint(kind="revolut")), r"r\.urdf:2:\d+: joint 'j' has the type 'revolut'; did you mean 'revolute'"),
    "no parent": (robot('<joint name="j" type="fixed"><child link="b"/></joint>'), r"r\.urdf:2:1: joint 'j' has no <parent>"),
    "no child": (robot('<joint name="j" type="fixed"><parent link="b"/></joint>'), r"r\.urdf:2:1: joint 'j' has no <child>"),
    "parent without link": (robot(joint(parent="")), r"r\.urdf:2:\d+: <parent> has no link"),
    "unknown link": (robot(joint(child="bb"), links="abc bbc"), r"r\.urdf:2:1: joint 'j': no link 'a'"),
    "two origins": (robot(joint(parts="<origin/><origin/>")), r"r\.urdf:2:\d+: <origin> twice in one joint"),
    "NaN": (robot(joint(parts='<origin xyz="0 nan 0"/>')), r"r\.urdf:2:\d+: xyz: 'nan' is not finite"),
    "infinity": (robot(joint(parts='<origin rpy="0 0 1e999"/>')), r"r\.urdf:2:\d+: rpy: '1e999' is not finite"),
    "two numbers": (robot(joint(parts='<origin xyz="0 0"/>')), r"xyz: expected 3 numbers, found 2"),
    "a word": (robot(joint(parts='<origin rpy="0 0 x"/>')), r"rpy: 'x' is not a number"),
    "axis 0 0 0": (robot(joint(parts='<axis xyz="0 0 0"/>')), r"r\.urdf:2:\d+: joint 'j' has the axis 0 0 0"),
    "no rotation": (robot(joint(parts='<origin quat_xyzw="0 0 0 2"/>')), r"r\.urdf:2:\d+: quaternion 0 0 0 2"),
    "limit": (robot(joint(parts='<limit lower="a" upper="1"/>')), r"r\.urdf:2:\d+: lower: 'a' is not a number"),
    "mimic of none": (robot(joint(parts='<mimic joint="k"/>')), r"r\.urdf:2: joint 'j' mimics 'k', which is no joint"),
    "mimic of itself": (robot(joint(parts='<mimic joint="j"/>')), r"r\.urdf:2: joints mimic each other in a circle: 'j' -> 'j'"),
    "mimics in a circle": (
        robot(joint(parts='<mimic joint="k"/>'), joint("k", "b", "c", parts='<mimic joint="j"/>')),
        r"circle: 'j' -> 'k' -> 'j'",
    ),
    "mimic of a pose": (robot(joint(kind="planar"), joint("k", "b", "c", parts='<mimic joint="j"/>')), r"joint 'k' mimics 'j', which is planar"),
    "link in a link": ('<robot name="r"><link name="a"><link name="b"/></link></robot>', "<link> inside a <link>"),
    "no links": ('<robot name="r"/>', r"r\.urdf: no links in it"),
    "truncated": (robot(joint())[:-20], r"r\.urdf:\d+:\d+: not XML"),
    "empty": ("", "r.urdf"),
    "two roots of XML": ("<robot/><robot/>", r"r\.urdf:1:9: not XML"),
    "another root": ('<robots name="r"><link name="a"/></robots>', "URDF begins with <robot>, found <robots>"),
    "entities": ('<!DOCTYPE robot [<!ENTITY a "b">]><robot name="&a;"/>', "entities"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_one_line_with_its_place(name: str, run: Run) -> None:
    text, said = WRONG[name]
    done = run("tree", "--in", "urdf", "r.urdf", files={"r.urdf": text})
    line, *snippet = done.err.splitlines()
    assert (done.status, done.out) == (1, "")
    assert re.search(said, line)
    assert len(snippet) in (0, 2)


TOPOLOGY = {
    "two parents": (robot(joint(), joint("k", "c", "b")), "r.urdf:3: frame 'b' has two parents: 'a' (line 2) and 'c'"),
    "a cycle": (robot(joint(), joint("k", "b", "a")), "r.urdf:3: frames form a cycle"),
    "itself": (robot(joint(child="a")), "r.urdf:2: frame 'a' is its own parent"),
}


@pytest.mark.filterwarnings("ignore:.*roots")
@pytest.mark.parametrize("name", TOPOLOGY)
def test_links_that_form_no_tree_are_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text, said = TOPOLOGY[name]
    Path("r.urdf").write_text(text)
    with pytest.raises(BadTopology) as caught:
        frametool.load("r.urdf")
    assert str(caught.value).startswith(said)
    with pytest.raises(BadTopology):
        frametool.load_robot("r.urdf").fk("a", "b", {"j": 0.0, "k": 0.0})


def test_check_finds_all_that_is_wrong_in_one_go(run: Run) -> None:
    wrong = (joint(parts='<axis xyz="0 0 0"/>'), joint("k", "a", "x"), joint("l", "a", "c", "odd"))
    done = run("check", "r.urdf", files={"r.urdf": robot(*wrong)})
    assert done.status == 1
    assert [line.partition(":")[2].partition(":")[0] for line in done.out.splitlines() if ": error:" in line] == ["2", "3", "4"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_names_come_in_the_encoding_that_the_file_declares(encoding: str, tmp_path: Path) -> None:
    declared = encoding.removesuffix("-sig")
    text = f'<?xml version="1.0" encoding="{declared}"?>\n<robot name="r"><link name="händ"/></robot>'
    assert loaded(tmp_path, text.encode(encoding)).frames == ("händ",)


def test_bytes_of_another_encoding_are_refused(run: Run) -> None:
    done = run("tree", "r.urdf", files={"r.urdf": robot(links="händ").encode("latin-1")})
    assert (done.status, "r.urdf:1:" in done.err) == (1, True)


def test_a_slash_at_the_beginning_of_a_name_is_left_out_and_told(tmp_path: Path) -> None:
    with pytest.warns(FrametoolWarning, match="leading /"):
        assert loaded(tmp_path, robot(joint(parent="/a"), links="a b")).frames == ("a", "b")


def test_ten_thousand_links_in_a_row_are_no_trouble(tmp_path: Path) -> None:
    count = 10_000
    names = [f"l{index}" for index in range(count)]
    straight = '<origin xyz="1 0 0"/>'
    joints = [joint(f"j{index}", *pair, parts=straight) for index, pair in enumerate(pairwise(names))]
    tree = loaded(tmp_path, robot(*joints, links=" ".join(names)))
    assert tree.lookup("l0", names[-1]).xyz.tolist() == [count - 1.0, 0.0, 0.0]
    assert tree.roots == ("l0",)


def test_elements_nested_without_end_are_no_trouble(tmp_path: Path) -> None:
    deep = "<x>" * 10_000 + "</x>" * 10_000
    assert loaded(tmp_path, f'<robot name="r"><link name="a">{deep}</link></robot>').frames == ("a",)
    with pytest.raises(FormatError, match="inside a <link>"):
        loaded(tmp_path, '<robot name="r">' + '<link name="a">' * 10_000 + "</link>" * 10_000 + "</robot>")


def test_the_example_is_read(run: Run) -> None:
    done = run("lookup", str(ARM), "left_finger", "right_finger", "-j", "gripper=20mm", "-f", "json")
    assert '"xyz": [0.0, -0.04, 0.0]' in done.out


def test_a_doctype_of_many_declarations_is_passed_by(tmp_path: Path) -> None:
    declared = "".join(f"<!ELEMENT e{number} (#PCDATA)>\n" for number in range(3000))
    assert loaded(tmp_path, f"<!DOCTYPE robot [{declared}]>{robot(joint(), links='a b')}").frames == ("a", "b")
