"""SDF: which frame each pose is relative to, which one each frame moves with, and what its joints do."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from frametool.errors import FormatError, heard_by
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    Matrix = NDArray[np.float64]

LINK = '<link name="L"><pose>1 2 3 0.1 0.2 0.3</pose></link>'
DEG = "0 0 0 0 0 90"


def pose(text: str) -> Matrix:
    """Return x y z roll pitch yaw as a 4x4 matrix, with fixed axes."""
    numbers = [float(word) for word in text.split()]
    matrix = np.eye(4)
    matrix[:3, 3] = numbers[:3]
    matrix[:3, :3] = Rotation.from_euler("xyz", numbers[3:]).as_matrix()
    return matrix


def read(folder: Path, body: str, version: str = "1.9", **options: Any) -> tuple[Any, list[str]]:
    """Load a file with this body; return its frames and what was said."""
    (folder / "a.sdf").write_text(f'<?xml version="1.0"?>\n<sdf version="{version}">\n{body}\n</sdf>')
    said: list[str] = []
    with heard_by(lambda message, *_: said.append(message.replace(f"{folder}/", ""))):
        return load(folder / "a.sdf", **options), said


def model(body: str, name: str = "m", more: str = "") -> str:
    return f'<model name="{name}"{more}>{body}</model>'


def seen(tree: Any, target: str, source: str) -> Matrix:
    matrix: Matrix = tree.lookup(target, source).as_matrix()
    return matrix


P, Q, R = "1 2 3 0.1 0.2 0.3", "0.5 -1 2 -0.4 0.9 -2", "-3 0.1 0 2 -0.5 1"
JOINT = '<joint name="j" type="{}"><parent>a</parent><child>b</child>{}</joint>'
A_AND_B = f'<link name="a"><pose>{P}</pose></link><link name="b"><pose>{Q}</pose></link>'


@pytest.mark.parametrize(
    ("body", "target", "source", "expected"),
    [
        (f'<link name="a"><pose>{P}</pose></link>', "m", "m::a", pose(P)),
        ('<link name="a"/>', "m", "m::a", np.eye(4)),
        ('<link name="a"><pose/></link>', "m", "m::a", np.eye(4)),
        (f'<link name="a"><pose relative_to="__model__">{P}</pose></link>', "m", "m::a", pose(P)),
        (f'<link name="a"><pose relative_to="">{P}</pose></link>', "m", "m::a", pose(P)),
        (f'{A_AND_B}<link name="c"><pose relative_to="b">{R}</pose></link>', "m", "m::c", pose(Q) @ pose(R)),
        (f'<link name="c"><pose relative_to="b">{R}</pose></link>{A_AND_B}', "m", "m::c", pose(Q) @ pose(R)),
        (f'{A_AND_B}<link name="c"><pose relative_to="b"/></link>', "m", "m::c", pose(Q)),
        # a frame: relative to what it is attached to, else to the model
        (f'{A_AND_B}<frame name="f"><pose>{R}</pose></frame>', "m", "m::f", pose(R)),
        (f'{A_AND_B}<frame name="f" attached_to="b"/>', "m", "m::f", pose(Q)),
        (f'{A_AND_B}<frame name="f" attached_to="b"><pose>{R}</pose></frame>', "m", "m::f", pose(Q) @ pose(R)),
        (f'{A_AND_B}<frame name="f" attached_to="b"><pose relative_to="a">{R}</pose></frame>', "m", "m::f", pose(P) @ pose(R)),
        (f'{A_AND_B}<frame name="f" attached_to="b"><pose relative_to="__model__">{R}</pose></frame>', "m", "m::f", pose(R)),
        # a joint: relative to its child
        (A_AND_B + JOINT.format("fixed", f"<pose>{R}</pose>"), "m", "m::j", pose(Q) @ pose(R)),
        (A_AND_B + JOINT.format("fixed", ""), "m", "m::j", pose(Q)),
        (A_AND_B + JOINT.format("fixed", f'<pose relative_to="a">{R}</pose>'), "m", "m::j", pose(P) @ pose(R)),
        (f'{A_AND_B}{JOINT.format("fixed", "")}<frame name="f" attached_to="j"><pose>{R}</pose></frame>', "m", "m::f", pose(Q) @ pose(R)),
        # the link of a URDF: relative to its joint
        (f'<link name="a"/><link name="b"><pose relative_to="j"/></link>{JOINT.format("fixed", f"<pose relative_to={chr(39)}a{chr(39)}>{R}</pose>")}', "m::a", "m::b", pose(R)),
        # attached to a link that is relative to the frame: no circle
        (f'<link name="l1"><pose>{P}</pose></link><frame name="f" attached_to="l2"><pose relative_to="l1">{Q}</pose></frame><link name="l2"><pose relative_to="f">{R}</pose></link>', "m", "m::l2", pose(P) @ pose(Q) @ pose(R)),
        # sensors: relative to their link
        (f'<link name="a"><pose>{P}</pose><sensor name="s"><pose>{Q}</pose></sensor></link>', "m", "m::a::s", pose(P) @ pose(Q)),
        (f'<link name="a"><pose>{P}</pose><sensor name="s"/></link>', "m", "m::a::s", pose(P)),
        (f'{A_AND_B}<link name="c"><sensor name="s"><pose relative_to="b">{R}</pose></sensor></link>', "m::c", "m::c::s", pose(Q) @ pose(R)),
        # units and notations
        ('<link name="a"><pose degrees="true">1 2 3 90 0 0</pose></link>', "m", "m::a", pose(f"1 2 3 {np.pi / 2} 0 0")),
        ('<link name="a"><pose degrees="false">0 0 0 0 0 1.5</pose></link>', "m", "m::a", pose("0 0 0 0 0 1.5")),
        ('<link name="a"><pose rotation_format="euler_rpy" degrees="1">0 0 0 0 90 0</pose></link>', "m", "m::a", pose(f"0 0 0 0 {np.pi / 2} 0")),
        ('<link name="a"><pose rotation_format="quat_xyzw">1 2 3   0.6 0 0 0.8</pose></link>', "m", "m::a", pose(f"1 2 3 {2 * np.arctan2(0.6, 0.8)} 0 0")),
        ('<link name="a"><pose rotation_format="quat_xyzw"/></link>', "m", "m::a", np.eye(4)),
        (f'<link name="a"><pose>\n  {P.replace(" ", "  ")}\n</pose></link>', "m", "m::a", pose(P)),
        # what only looks is left out
        (f'<link name="a"><visual name="v"><pose>9 9 9 0 0 0</pose><link name="x"/></visual><inertial><pose>9 9 9 0 0 0</pose></inertial><pose>{P}</pose></link>', "m", "m::a", pose(P)),
    ],
)  # fmt: skip
def test_a_pose_is_relative_to_what_it_says_or_to_the_default_of_its_kind(
    tmp_path: Path, body: str, target: str, source: str, expected: Matrix
) -> None:
    tree, said = read(tmp_path, model(body))
    assert seen(tree, target, source) == pytest.approx(expected, abs=1e-14)
    assert not said


INNER = f'<model name="n"><pose>{Q}</pose><link name="a"><pose>{R}</pose></link><frame name="f"><pose>{P}</pose></frame></model>'


@pytest.mark.parametrize(
    ("body", "target", "source", "expected"),
    [
        (INNER, "m", "m::n", pose(Q)),
        (INNER, "m", "m::n::a", pose(Q) @ pose(R)),
        (INNER, "m::n", "m::n::f", pose(P)),
        (f'{INNER}<link name="b"><pose relative_to="n::a">{P}</pose></link>', "m", "m::b", pose(Q) @ pose(R) @ pose(P)),
        (f'{INNER}<link name="b"><pose relative_to="n">{P}</pose></link>', "m", "m::b", pose(Q) @ pose(P)),
        (f'{INNER}<link name="b"><pose relative_to="n::__model__">{P}</pose></link>', "m", "m::b", pose(Q) @ pose(P)),
        (f'{INNER}<frame name="g" attached_to="n::f"/>', "m", "m::g", pose(Q) @ pose(P)),
        (f'<link name="b"><pose>{P}</pose></link><model name="n"><pose relative_to="b">{Q}</pose><link name="a"/></model>', "m", "m::n::a", pose(P) @ pose(Q)),
        # the placement frame gets the pose, the model follows
        (INNER.replace('"n"', '"n" placement_frame="a"'), "m", "m::n::a", pose(Q)),
        (INNER.replace('"n"', '"n" placement_frame="a"'), "m", "m::n", pose(Q) @ np.linalg.inv(pose(R))),
        (INNER.replace('"n"', '"n" placement_frame="a"'), "m", "m::n::f", pose(Q) @ np.linalg.inv(pose(R)) @ pose(P)),
        (f'<model name="o" placement_frame="n::a"><pose>{P}</pose>{INNER}</model>', "m", "m::o::n::a", pose(P)),
        (f'<model name="o" placement_frame="n::a"><pose>{P}</pose>{INNER}</model>', "m", "m::o", pose(P) @ np.linalg.inv(pose(Q) @ pose(R))),
        # the names of a flattened file have their scopes in them
        (f"<frame name='n::__model__' attached_to='n::a'><pose relative_to='__model__'>{Q}</pose></frame><link name='n::a'><pose relative_to='n::__model__'>{R}</pose></link>", "m", "m::n::a", pose(Q) @ pose(R)),
    ],
)  # fmt: skip
def test_a_nested_model_is_a_scope_and_is_seen_from_outside_by_its_name(
    tmp_path: Path, body: str, target: str, source: str, expected: Matrix
) -> None:
    tree, said = read(tmp_path, model(body))
    assert seen(tree, target, source) == pytest.approx(expected, abs=1e-14)
    assert not said


def test_a_world_holds_models_and_frames(tmp_path: Path) -> None:
    body = (
        f'<world name="w"><frame name="f"><pose>{P}</pose></frame><model name="m"><pose relative_to="f">{Q}</pose>{LINK}</model>'
        f'<frame name="g" attached_to="m::L"><pose>{R}</pose></frame><model name="n"><pose relative_to="g"/><link name="L"/></model></world>'
    )
    tree, _ = read(tmp_path, body)
    assert tree.roots == ("world",)
    assert seen(tree, "world", "m") == pytest.approx(pose(P) @ pose(Q), abs=1e-14)
    assert seen(tree, "world", "n::L") == pytest.approx(pose(P) @ pose(Q) @ pose("1 2 3 0.1 0.2 0.3") @ pose(R), abs=1e-14)


def test_a_model_alone_is_the_root_unless_it_has_a_pose_or_a_joint_to_the_world(tmp_path: Path) -> None:
    assert read(tmp_path, model(LINK))[0].roots == ("m",)
    tree, _ = read(tmp_path, model(f"<pose>{P}</pose>{LINK}"))
    assert (tree.roots, seen(tree, "world", "m").tolist()) == (("world",), pytest.approx(pose(P)))
    weld = '<joint name="j" type="fixed"><parent>world</parent><child>L</child></joint>'
    tree, _ = read(tmp_path, model(LINK + weld))
    assert tree.roots == ("world",)
    assert seen(tree, "world", "m") == pytest.approx(np.eye(4), abs=1e-14)
    turned, _ = read(tmp_path, model(LINK + weld.replace("<parent>world</parent><child>L", "<parent>L</parent><child>world")))
    assert seen(turned, "world", "m::L") == pytest.approx(pose("1 2 3 0.1 0.2 0.3"), abs=1e-14)
    moving = weld.replace("world</parent><child>L", "L</parent><child>world").replace('fixed">', f'revolute">{AXIS.format("1 0 0")}')
    turned, _ = read(tmp_path, model(LINK + moving), joints={"j": 0.5})
    assert seen(turned, "m::L", "world") == pytest.approx(
        np.linalg.inv(pose("1 2 3 0.1 0.2 0.3")) @ turn([1, 0, 0], 0.5), abs=1e-14
    )


def turn(axis: Any, angle: float) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(np.asarray(axis) / np.linalg.norm(axis) * angle).as_matrix()
    return matrix


AXIS = "<axis><xyz>{}</xyz></axis>"


@pytest.mark.parametrize(
    ("version", "axis", "direction"),
    [
        ("1.9", AXIS.format("0 3 4"), [0, 3, 4]),  # any length
        ("1.9", "<axis/>", [0, 0, 1]),
        ("1.9", "<axis><xyz expressed_in='__model__'>0 3 4</xyz></axis>", "model"),
        ("1.9", "<axis><xyz expressed_in='a'>0 3 4</xyz></axis>", "a"),
        ("1.9", "<axis><xyz expressed_in='j'>0 3 4</xyz></axis>", [0, 3, 4]),
        ("1.9", "<axis><xyz expressed_in='b'>0 3 4</xyz></axis>", "b"),
        ("1.6", AXIS.format("0 3 4"), [0, 3, 4]),
        ("1.5", "<axis><xyz>0 3 4</xyz><use_parent_model_frame>true</use_parent_model_frame></axis>", "model"),
        ("1.6", "<axis><xyz>0 3 4</xyz><use_parent_model_frame>0</use_parent_model_frame></axis>", [0, 3, 4]),
        ("1.4", AXIS.format("0 3 4"), "model"),
    ],
)
def test_an_axis_is_seen_from_the_joint_unless_said_or_old(
    tmp_path: Path, version: str, axis: str, direction: Any
) -> None:
    tree, _ = read(tmp_path, model(A_AND_B + JOINT.format("revolute", f"<pose>{R}</pose>{axis}")), version, joints={"j": 0.7})
    joint = pose(Q) @ pose(R)
    outer = {"model": np.eye(4), "a": pose(P), "b": pose(Q)}
    if isinstance(direction, str):
        direction = (np.linalg.inv(joint) @ outer[direction])[:3, :3] @ [0, 3, 4]
    moved = joint @ turn(direction, 0.7) @ np.linalg.inv(joint) @ pose(Q)
    assert seen(tree, "m", "m::b") == pytest.approx(moved, abs=1e-14)
    assert seen(tree, "m", "m::j") == pytest.approx(joint @ turn(direction, 0.7), abs=1e-14)  # attached to the child


def shift(*xyz: float) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = xyz
    return matrix


@pytest.mark.parametrize(
    ("kind", "axes", "joints", "moved"),
    [
        ("prismatic", AXIS.format("0 0 2"), {"j": "3cm"}, shift(0, 0, 0.03)),
        ("continuous", AXIS.format("1 0 0"), {"j": "90deg"}, turn([1, 0, 0], np.pi / 2)),
        ("universal", AXIS.format("1 0 0") + "<axis2><xyz>0 1 0</xyz></axis2>", {"j": 0.3, "j:2": -0.4}, turn([1, 0, 0], 0.3) @ turn([0, 1, 0], -0.4)),
        ("revolute2", AXIS.format("0 0 1") + "<axis2><xyz>0 1 0</xyz></axis2>", {"j:2": 0.5}, turn([0, 1, 0], 0.5)),
        ("ball", "", {"j": "{rpy: [0.1, 0.2, 0.3]}"}, pose("0 0 0 0.1 0.2 0.3")),
        ("fixed", "", {}, np.eye(4)),
    ],
)  # fmt: skip
def test_a_joint_moves_its_child_in_its_own_frame(
    tmp_path: Path, kind: str, axes: str, joints: dict[str, Any], moved: Matrix
) -> None:
    tree, _ = read(tmp_path, model(A_AND_B + JOINT.format(kind, f"<pose>{R}</pose>{axes}")), joints=joints)
    joint = pose(Q) @ pose(R)
    assert seen(tree, "m", "m::b") == pytest.approx(joint @ moved @ np.linalg.inv(joint) @ pose(Q), abs=1e-14)
    assert seen(tree, "m", "m::a") == pytest.approx(pose(P), abs=1e-14)


def test_a_frame_moves_with_what_it_is_attached_to_and_not_with_what_its_pose_is_relative_to(tmp_path: Path) -> None:
    frames = (
        f'<frame name="f" attached_to="a"><pose relative_to="b">{R}</pose></frame>'
        f'<frame name="g" attached_to="b"><pose relative_to="a">{R}</pose></frame>'
    )
    body = model(A_AND_B + frames + JOINT.format("revolute", AXIS.format("0 0 1")))
    rest, _ = read(tmp_path, body)
    moved, _ = read(tmp_path, body, joints={"j": 1.0})
    assert seen(moved, "m::a", "m::f") == pytest.approx(seen(rest, "m::a", "m::f"), abs=1e-15)
    assert seen(moved, "m::b", "m::g") == pytest.approx(seen(rest, "m::b", "m::g"), abs=1e-15)
    assert abs(seen(moved, "m", "m::g") - seen(rest, "m", "m::g")).max() > 0.1


def test_a_model_moves_with_its_canonical_link(tmp_path: Path) -> None:
    joint = '<joint name="j" type="revolute"><parent>a</parent><child>n::c</child><axis><xyz>0 0 1</xyz></axis></joint>'
    inner = f'<model name="n"{{}}><pose>{Q}</pose><link name="b"/><link name="c"><pose>{R}</pose></link></model>'
    for more, carried in (("", False), (' canonical_link="c"', True)):
        body = model(f'<link name="a"/>{inner.format(more)}{joint}')
        rest, moved = read(tmp_path, body)[0], read(tmp_path, body, joints={"j": 1.0})[0]
        assert bool(abs(seen(moved, "m", "m::n") - seen(rest, "m", "m::n")).max() > 0.1) is carried
        assert seen(moved, "m", "m::n::b") == pytest.approx(seen(rest, "m", "m::n::b"), abs=1e-15)
    nested_only = model(f'<model name="n"><link name="c"/></model><link name="a"/>{joint}', more=' canonical_link="n::c"')
    assert seen(read(tmp_path, nested_only, joints={"j": 1.0})[0], "m", "m::n::c") == pytest.approx(np.eye(4), abs=1e-15)


def test_a_joint_connects_the_links_that_its_frames_are_attached_to(tmp_path: Path) -> None:
    frames = f'<frame name="p" attached_to="a"><pose>{R}</pose></frame><frame name="q" attached_to="b"><pose>{P}</pose></frame>'
    joint = '<joint name="j" type="revolute"><parent>p</parent><child>q</child><axis><xyz>0 0 1</xyz></axis></joint>'
    tree, _ = read(tmp_path, model(A_AND_B + frames + joint), joints={"j": 0.5})
    at = pose(Q) @ pose(P)
    assert seen(tree, "m", "m::j") == pytest.approx(at @ turn([0, 0, 1], 0.5), abs=1e-14)
    assert seen(tree, "m::a", "m::b") == pytest.approx(
        np.linalg.inv(pose(P)) @ at @ turn([0, 0, 1], 0.5) @ np.linalg.inv(at) @ pose(Q), abs=1e-14
    )


def test_a_joint_that_mimics_follows_from_its_reference(tmp_path: Path) -> None:
    links = "".join(f'<link name="{name}"/>' for name in "abc")
    lead = JOINT.format("revolute", AXIS.format("0 0 1"))
    mimic = '<mimic joint="j" axis="axis"><multiplier>2</multiplier><offset>0.1</offset><reference>0.3</reference></mimic>'
    follow = f'<joint name="k" type="revolute"><parent>b</parent><child>c</child><axis><xyz>1 0 0</xyz>{mimic}</axis></joint>'
    tree, _ = read(tmp_path, model(links + lead + follow), joints={"j": 0.5})
    assert seen(tree, "m::b", "m::c") == pytest.approx(turn([1, 0, 0], 2 * (0.5 - 0.3) + 0.1), abs=1e-15)


def made_up(rng: np.random.Generator) -> tuple[str, dict[str, Matrix], dict[str, str], list[Any]]:
    """Return a random model: its text, where all is at rest, what each frame moves with, and its joints."""
    at, moves_with, joints, text = {"__model__": np.eye(4)}, {}, [], []

    def placed(name: str, default: str) -> str:
        outer = str(rng.choice([default, *at]))
        numbers = " ".join(map(repr, rng.normal(size=6).tolist()))
        at[name] = at[outer] @ pose(numbers)
        return f"<pose>{numbers}</pose>" if outer == default else f'<pose relative_to="{outer}">{numbers}</pose>'

    for n in range(6):
        text.append(f'<link name="l{n}">{placed(f"l{n}", "__model__")}</link>')
        moves_with[f"l{n}"] = f"l{n}"
        if n:
            parent, axis = f"l{rng.integers(n)}", rng.normal(size=3)
            kind = str(rng.choice(["revolute", "prismatic", "fixed"]))
            told = " ".join(map(repr, axis.tolist()))
            text.append(
                f'<joint name="j{n}" type="{kind}"><parent>{parent}</parent><child>l{n}</child>'
                f'{placed(f"j{n}", f"l{n}")}<axis><xyz>{told}</xyz></axis></joint>'
            )
            moves_with[f"j{n}"] = f"l{n}"
            joints.append((f"j{n}", kind, parent, f"l{n}", axis))
        outer = str(rng.choice(list(moves_with)))
        text.append(f'<frame name="f{n}" attached_to="{outer}">{placed(f"f{n}", outer)}</frame>')
        moves_with[f"f{n}"] = moves_with[outer]
    return "".join(rng.permutation(text)), at, moves_with, joints


@pytest.mark.parametrize("seed", range(20))
def test_any_model_stands_and_moves_as_its_graph_says(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    text, at, moves_with, joints = made_up(rng)
    values = {name: float(rng.normal()) for name, kind, *_ in joints if kind != "fixed"}
    tree, _ = read(tmp_path, model(text, more=' canonical_link="l0"'), joints=values)
    moved = {"l0": at["l0"]}
    for name, kind, parent, child, axis in joints:
        unit, value = axis / np.linalg.norm(axis), values.get(name, 0.0)
        motion = turn(axis, value) if kind == "revolute" else shift(*(unit * value)) if kind == "prismatic" else np.eye(4)
        in_parent = np.linalg.inv(at[parent]) @ at[name] @ motion @ np.linalg.inv(at[name]) @ at[child]
        moved[child] = moved[parent] @ in_parent
    for name, body in moves_with.items():
        expected = moved[body] @ np.linalg.inv(at[body]) @ at[name]
        assert seen(tree, "m", f"m::{name}") == pytest.approx(expected, abs=2e-13)


def test_a_loop_is_opened_at_its_last_joint_and_said(tmp_path: Path) -> None:
    links = "".join(f'<link name="{name}"/>' for name in "abcd")
    ends = [("a", "b"), ("b", "c"), ("a", "d"), ("d", "c")]
    joints = "".join(
        f'\n<joint name="j{n}" type="revolute"><parent>{p}</parent><child>{c}</child><axis/></joint>' for n, (p, c) in enumerate(ends)
    )
    tree, said = read(tmp_path, model(links + joints))
    assert {(parent, child) for parent, child, _ in tree.edges() if "::j" not in child} == {
        ("m", "m::a"), ("m::a", "m::b"), ("m::b", "m::c"), ("m::a", "m::d"),
    }  # fmt: skip
    assert said == ["a.sdf:7: joint 'j3' closes a loop and is left out: 'm::c' hangs on joint 'j1' already"]


def test_values_go_by_the_short_name_of_a_joint_or_by_the_long_one_where_two_share_it(tmp_path: Path) -> None:
    one = A_AND_B + JOINT.format("revolute", "<axis/>")
    for name in ("j", "m::j"):
        assert seen(read(tmp_path, model(one), joints={name: 1.0})[0], "m::a", "m::j")[0, 0] < 0.9
    two = model(one) + model(one, "n")
    tree, _ = read(tmp_path, f"<world name='w'>{two}</world>", joints={"n::j": 1.0})
    assert seen(tree, "m::b", "m::j") == pytest.approx(np.eye(4))
    with pytest.raises(FormatError, match="no joint 'j'; joints: m::j, n::j"):
        read(tmp_path, f"<world name='w'>{two}</world>", joints={"j": 1.0})


def test_a_joint_with_the_name_of_a_link_is_renamed_in_old_files_and_refused_in_new_ones(tmp_path: Path) -> None:
    body = model(A_AND_B + JOINT.format("revolute", "<axis/>").replace('"j"', '"b"'))
    tree, said = read(tmp_path, body, "1.6", joints={"b": 0.5})
    assert "m::b_joint" in tree.frames
    assert said == ["a.sdf:3: joint 'b' has the name of a link; its frame is b_joint"]
    with pytest.raises(FormatError, match="joint 'm::b' twice; first in line 3"):
        read(tmp_path, body)


def test_included_models_are_left_out_and_named_with_their_lines(tmp_path: Path) -> None:
    include = "\n<include><uri>model://sun</uri></include>\n<include><uri>model://arm</uri><name>left</name></include>"
    tree, said = read(tmp_path, f"<world name='w'>{include}{model(LINK)}</world>")
    assert "m::L" in tree.frames
    assert said == [
        "a.sdf:4: <include> 'model://sun' is left out, it needs other files; with them: gz sdf -p FILE > whole.sdf",
        "a.sdf:5: <include> 'left' is left out, it needs other files; with them: gz sdf -p FILE > whole.sdf",
    ]


def test_the_saved_state_of_a_world_is_not_taken_for_its_models_and_said(tmp_path: Path) -> None:
    state = '<state world_name="w"><model name="m"><pose>9 9 9 0 0 0</pose></model></state>'
    tree, said = read(tmp_path, f"<world name='w'>{model(LINK)}\n{state}</world>")
    assert tree.lookup("world", "m").xyz.tolist() == [0.0, 0.0, 0.0]
    assert said == ["a.sdf:4: <state> is left out: every model is at its own pose"]


def test_joints_move_over_time_where_a_file_of_values_has_stamps(run: Callable[..., Any]) -> None:
    text = f"<sdf version='1.9'>{model(A_AND_B + JOINT.format('universal', '<axis><xyz>1 0 0</xyz></axis><axis2/>'))}</sdf>"
    rows = "stamp,j,j:2\n0,0,0\n1,0.5,1\n"
    files = {"a.sdf": text, "v.csv": rows}
    done = run("lookup", "a.sdf", "m::b", "m::a", "--joints", "v.csv", "--at", "1", "-f", "json", files=files)
    still = run("lookup", "a.sdf", "m::b", "m::a", "-j", "j=0.5", "-j", "j:2=1", "-f", "json")
    assert json.loads(done.out)["quaternion"] == json.loads(still.out)["quaternion"]
    assert json.loads(done.out)["stamp_ns"] == 1_000_000_000


@pytest.mark.parametrize("missing", ["create::base", "base"])
def test_what_builds_on_an_included_model_needs_the_whole_file(tmp_path: Path, missing: str) -> None:
    joint = f'<joint name="j" type="fixed"><parent>{missing}</parent><child>L</child></joint>'
    include = "<include><uri>model://create</uri></include>"
    with pytest.raises(FormatError, match=f"no frame '{missing}' in model 'm'; those of <include> need other files: gz sdf -p"):
        read(tmp_path, model(f'{include}<link name="L"/>{joint}'))


def test_a_joint_without_an_axis_takes_no_value_and_one_that_screws_neither(tmp_path: Path) -> None:
    _, said = read(tmp_path, model(A_AND_B + JOINT.format("revolute2", "<axis/>")), joints={"j": 0.1})
    assert said == ["a.sdf:3: joint 'j' has no <axis2>: it takes no value there"]
    _, said = read(tmp_path, model(A_AND_B + JOINT.format("screw", "<axis/>")))
    assert said == ["a.sdf:3: joint 'j' is a screw: it is fixed as in the file and takes no value"]
    with pytest.raises(FormatError, match="joint 'j' is fixed and takes no value"):
        read(tmp_path, model(A_AND_B + JOINT.format("screw", "<axis/>")), joints={"j": 0.1})


def test_joints_in_a_circle_of_links_leave_one_out(tmp_path: Path) -> None:
    joints = (
        '<joint name="j" type="fixed"><parent>a</parent><child>b</child></joint>\n'
        '<joint name="k" type="fixed"><parent>b</parent><child>a</child></joint>'
    )
    tree, said = read(tmp_path, model(A_AND_B + joints))
    assert set(tree.frames) == {"m", "m::a", "m::b", "m::j", "m::k"}
    assert said == ["a.sdf:4: joint 'k' closes a loop and is left out: 'm::b' hangs on 'm::a' already"]


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ('<link name="a"><pose relative_to="b"/></link>', "3:51: no frame 'b' in model 'm'; frames: a"),
        ('<link name="arm"><pose relative_to="arn"/></link>', "3:53: no frame 'arn' in model 'm'; did you mean 'arm'? frames: arm"),
        ('<link name="a"><pose relative_to="a"/></link>', "3:32: poses relative to each other in a circle: 'm::a' -> 'm::a'"),
        ('<frame name="a"><pose relative_to="b"/></frame><frame name="b"><pose relative_to="a"/></frame>', "poses relative to each other in a circle: "),
        ('<link name="l"/><frame name="a" attached_to="b"><pose relative_to="l"/></frame><frame name="b" attached_to="a"><pose relative_to="l"/></frame><joint name="j" type="fixed"><parent>a</parent><child>l</child></joint>', "frames attached to each other in a circle: "),
        ('<link name="a"><pose relative_to="world"/></link>', "no frame 'world' in model 'm'; poses in a model are relative to frames of the model"),
        ('<link name="a"><pose>1 2 3</pose></link>', "3:32: pose: expected 6 numbers, found 3 in '1 2 3'"),
        ('<link name="a"><pose>1 2 3 0 0 x</pose></link>', "3:32: pose: 'x' is not a number"),
        ('<link name="a"><pose>1 2 3 0 0 nan</pose></link>', "3:32: pose: 'nan' is not finite"),
        ('<link name="a"><pose rotation_format="quat_xyzw">1 2 3 0 0 0</pose></link>', "3:32: pose: expected 7 numbers, found 6"),
        ('<link name="a"><pose rotation_format="quat_xyzw">1 2 3 0 0 0 0.9</pose></link>', "3:32: quaternion 0 0 0 0.9 has norm 0.9"),
        ('<link name="a"><pose rotation_format="quat_wxyz">1 2 3 0 0 0 1</pose></link>', "3:55: rotation_format 'quat_wxyz'; expected euler_rpy or quat_xyzw"),
        ('<link name="a"><pose rotation_format="quat_xyzw" degrees="true">1 2 3 0 0 0 1</pose></link>', "degrees with quat_xyzw; keep one"),
        ('<link name="a"/><link name="a"/>', "3:45: link 'm::a' twice; first in line 3"),
        ("<link/>", "3:17: <link> has no name"),
        ('<link name="world"/>', "the name 'world' is reserved"),
        (A_AND_B + JOINT.format("hinge", ""), "joint 'j' has the type 'hinge'; types: ball, continuous"),
        (A_AND_B + JOINT.format("revolute", AXIS.format("0 0 0")), "joint 'j' has the axis 0 0 0, which is not a direction"),
        (A_AND_B + JOINT.format("fixed", "").replace("<child>b</child>", ""), "joint 'j' has no <child>"),
        (A_AND_B + JOINT.format("fixed", "").replace("<child>b", "<child>c"), "no frame 'c' in model 'm'"),
        (A_AND_B + JOINT.format("fixed", "").replace("<child>b", "<child>a"), "joint 'j' does not connect two links"),
('<include><uri>model://x</uri></include><link name="a"/><frame name="f" attached_to="b"/>', "no frame 'b' in model 'm'; those of <include> need other files"),
        ("<model name='n'><link name='a'><pose relative_to='b'/></link></model><link name='b'/>", "no frame 'b' in model 'm::n'"),
        ("", "a.sdf"),
        ("<link name='a'>", "a.sdf:3:"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line_with_its_place(run: Callable[..., Any], body: str, said: str) -> None:
    text = f"<?xml version='1.0'?>\n<sdf version='1.9'>\n<model name='m'>{body}</model></sdf>"
    done = run("tree", "a.sdf", files={"a.sdf": text})
    if not body:
        assert done.status == 0  # a model without links is one frame
        return
    errors = [line for line in done.err.splitlines() if line.startswith("frametool: a.sdf:")]
    assert (done.status, len(errors)) == (1, 1)
    assert said in errors[0]
    assert len(errors[0]) < 230
    assert run("check", "a.sdf").out.startswith("a.sdf:3:")


def test_what_has_no_frames_is_said(run: Callable[..., Any]) -> None:
    for text in ("<sdf version='1.9'/>", "<sdf><world name='w'/></sdf>"):
        done = run("tree", "a.sdf", files={"a.sdf": text})
        assert (done.status, done.err) == (1, "frametool: a.sdf: no frames in it\n")
    done = run("tree", "a.xml", "--in", "sdf", files={"a.xml": "<robot/>"})
    assert done.err.startswith("frametool: a.xml:1:1: expected <sdf>, found <robot>")


def test_long_chains_of_poses_are_read_at_once(tmp_path: Path) -> None:
    count = 10_000
    links = [f'<link name="l{n}"><pose relative_to="l{n + 1}">0 0 1 0 0 0</pose></link>' for n in range(count)]
    tree, _ = read(tmp_path, model("".join(links) + f'<link name="l{count}"/>'))
    assert tree.lookup("m", "m::l0").xyz.tolist() == [0.0, 0.0, float(count)]


def test_models_too_deep_inside_one_another_are_refused_in_a_line(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="more than 100 models inside one another"):
        read(tmp_path, "<model name='a'>" * 10_000 + "</model>" * 10_000)


def test_what_was_read_is_said_once(run: Callable[..., Any]) -> None:
    text = f"<sdf version='1.9'>{model(A_AND_B + JOINT.format('revolute', '<axis><limit><upper>1</upper><lower>-1</lower></limit></axis>'))}</sdf>"
    done = run("lookup", "a.sdf", "m", "m::b", files={"a.sdf": text})
    assert done.err == "frametool: a.sdf: 1 joint at 0 (--joint NAME=VALUE)\n"
    assert "joint 'j' is beyond its limits -1 .. 1 rad, 2" in run("lookup", "a.sdf", "m", "m::b", "-j", "j=2").err
    assert json.loads(run("lookup", "a.sdf", "m::a", "m::j", "-f", "json", "--quiet").out)["name"] == "m::j"
