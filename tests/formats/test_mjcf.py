"""MJCF: where MuJoCo has each frame, in every spelling, and what is said of models that are refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mjcf_models
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from frametool.errors import FormatError, heard_by
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "mjcf.json").read_text())["models"]
HALF = math.sqrt(0.5)


def read(folder: Path, body: str, before: str = "", **options: Any) -> tuple[Any, list[str]]:
    """Load a model with this in its world; return its frames and what was said."""
    return read_all(folder, f"<mujoco>{before}<worldbody>\n{body}</worldbody></mujoco>", **options)


def read_all(folder: Path, text: str, **options: Any) -> tuple[Any, list[str]]:
    (folder / "a.xml").write_text(text)
    said: list[str] = []
    with heard_by(lambda message, *_: said.append(message.replace(f"{folder}/", ""))):
        return load(folder / "a.xml", **options), said


def seen(tree: Any, source: str, target: str = "world") -> Any:
    return tree.lookup(target, source).as_matrix()


def wxyz(tree: Any, source: str) -> tuple[float, ...]:
    x, y, z, w = tree.lookup("world", source).xyzw
    return w, x, y, z


@pytest.mark.parametrize("number", range(len(GOLDEN)))
def test_every_frame_is_where_mujoco_had_it(tmp_path: Path, number: int) -> None:
    golden = GOLDEN[number]
    tree, _ = read_all(tmp_path, golden["model"], joints=golden["joints"])
    assert set(tree.frames) == set(golden["frames"])
    for name, numbers in golden["frames"].items():
        assert seen(tree, name)[:3].ravel() == pytest.approx(numbers, rel=1e-12, abs=1e-12)


def test_every_frame_of_any_model_is_where_mujoco_has_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mujoco = pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # where it writes its log
    for seed in range(200, 260):
        text, kinds = mjcf_models.model(seed // 2)
        drawn = mjcf_models.values(seed, kinds) if seed % 2 else {}
        tree, _ = read_all(tmp_path, text, joints=mjcf_models.told(kinds, drawn) or None)
        for name, numbers in mjcf_models.poses(mujoco, text, drawn).items():
            assert seen(tree, name)[:3].ravel() == pytest.approx(numbers, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("compiler", "spelled", "expected"),  # w first; from the mujoco package, or plain
    [
        ("", 'quat="1 -1 0 0"', (HALF, -HALF, 0, 0)),
        ("", 'quat="0 0 0 -7"', (0, 0, 0, 1)),
        ("", 'quat="2e-200 0 0 0"', (1, 0, 0, 0)),
        ("", 'euler="90 0 0"', (HALF, HALF, 0, 0)),
        ('angle="degree"', 'euler="0 90 0"', (HALF, 0, HALF, 0)),
        ('angle="radian"', 'euler="0 0 1.5707963267948966"', (HALF, 0, 0, HALF)),
        ('angle="radian" eulerseq="zyx"', 'euler="1 0.5 0"', (0.85030065, -0.11861178, 0.2171174, 0.46452136)),
        ("", 'axisangle="0 0 3 90"', (HALF, 0, 0, HALF)),
        ('angle="radian"', 'axisangle="0 0 1 1"', (0.87758256, 0, 0, 0.47942554)),
        ("", 'xyaxes="0 2 0 -1 5 0"', (HALF, 0, 0, HALF)),
        ("", 'zaxis="0 0 3"', (1, 0, 0, 0)),
        ("", 'zaxis="0 0 -1"', (0, 1, 0, 0)),
        ("", 'zaxis="0 1e-12 -1"', (0, 1, 0, 0)),
        ("", 'zaxis="0 -4 0"', (HALF, HALF, 0, 0)),
        ("", 'pos=""', (1, 0, 0, 0)),
    ],
)
def test_an_orientation_has_five_spellings(
    tmp_path: Path, compiler: str, spelled: str, expected: tuple[float, ...]
) -> None:
    tree, _ = read(tmp_path, f'<body name="a" {spelled}/><site name="a" {spelled}/>', f"<compiler {compiler}/>")
    assert wxyz(tree, "a") == pytest.approx(expected, abs=1e-8)
    assert wxyz(tree, "site:a") == wxyz(tree, "a")


@pytest.mark.parametrize("sequence", ["xyz", "XYZ", "zyx", "ZYX", "ZXZ", "xYz", "Xyz", "zZy", "yXy"])
def test_small_letters_are_moving_axes_and_capitals_fixed_ones_also_mixed(tmp_path: Path, sequence: str) -> None:
    angles = (20.0, -50.0, 130.0)
    turned = Rotation.identity()
    for letter, angle in zip(sequence, angles, strict=True):
        turn = Rotation.from_euler(letter.lower(), angle, degrees=True)
        turned = turned * turn if letter.islower() else turn * turned
    tree, _ = read(tmp_path, '<body name="a" euler="20 -50 130"/>', f'<compiler eulerseq="{sequence}"/>')
    assert seen(tree, "a")[:3, :3] == pytest.approx(turned.as_matrix(), abs=1e-15)


def test_the_last_word_of_all_compiler_sections_counts_for_all(tmp_path: Path) -> None:
    text = '<mujoco><compiler angle="radian"/><worldbody><site name="a" euler="90 0 0"/></worldbody><compiler angle="degree"/></mujoco>'
    assert wxyz(read_all(tmp_path, text)[0], "site:a") == pytest.approx((HALF, HALF, 0, 0))


def test_a_site_from_end_to_end_stands_in_the_middle_and_looks_to_the_first_end(tmp_path: Path) -> None:
    tree, _ = read(tmp_path, '<site name="a" type="capsule" fromto="0 0 0 1 2 3" euler="10 0 0"/>')
    assert tree.lookup("world", "site:a").xyz.tolist() == [0.5, 1.0, 1.5]
    assert wxyz(tree, "site:a") == pytest.approx((0.31481445, 0.84894846, -0.42447423, 0), abs=1e-8)


DEFAULTS = """
<default><site pos="1 0 0" euler="90 0 0"/>
  <default class="a"><site pos="2 0 0"/><default class="b"><site quat="0 0 0 1"/></default></default>
  <site pos="3 0 0"/></default>
"""


@pytest.mark.parametrize("after", [False, True])
def test_a_class_gives_what_an_element_does_not_say(tmp_path: Path, *, after: bool) -> None:
    body = (
        '<site name="plain"/><site name="a" class="a"/><site name="b" class="b"/><site name="own" class="b" zaxis="0 1 0"/>'
        '<body name="x" childclass="a"><site name="c"/><body name="y"><site name="d"/><site name="e" class="main"/></body>'
        '<frame childclass="b"><site name="f"/></frame></body>'
    )
    world = f"<worldbody>{body}</worldbody>"
    tree, _ = read_all(tmp_path, f"<mujoco>{world if after else ''}{DEFAULTS}{'' if after else world}</mujoco>")
    along = {name: tree.lookup("world", f"site:{name}").xyz[0] for name in ("plain", "a", "b", "own", "c", "d", "e", "f")}
    assert along == {"plain": 3, "a": 2, "b": 2, "own": 2, "c": 2, "d": 2, "e": 3, "f": 2}
    quarter, half = (HALF, HALF, 0, 0), (0, 0, 0, 1)
    assert wxyz(tree, "site:a") == pytest.approx(quarter)
    assert wxyz(tree, "site:f") == wxyz(tree, "site:b") == half
    assert wxyz(tree, "site:own") == pytest.approx((HALF, -HALF, 0, 0))


def test_bodies_sites_and_cameras_have_names_of_their_own(tmp_path: Path) -> None:
    tree, _ = read(tmp_path, '<body name="cup"><site name="cup"/><camera name="cup"/><site/><site/><body/></body><body/>')
    assert set(tree.frames) == {
        "world", "cup", "site:cup", "camera:cup", "site:cup/site1", "site:cup/site2", "cup/body1", "world/body1",
    }  # fmt: skip


HINGE = '<body name="a" pos="1 0 0">{}</body>'


def test_a_hinge_turns_about_its_anchor_and_stands_at_its_reference(tmp_path: Path) -> None:
    body = HINGE.format('<joint name="j" axis="0 0 5" pos="0 1 0" ref="30"/>')
    assert seen(read(tmp_path, body)[0], "a") == pytest.approx(np.array([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))
    for value in ("120deg", 2 * math.pi / 3):
        moved = seen(read(tmp_path, body, joints={"j": value})[0], "a")
        assert moved @ [0, 1, 0, 1] == pytest.approx([1, 1, 0, 1])  # the anchor stays
        assert moved[:3, 0] == pytest.approx([0, 1, 0])  # 120 less 30 degrees
    assert seen(read(tmp_path, body, joints={"j": "120deg"})[0], "a")[0, 3] == 2.0


def test_a_slide_moves_by_its_value_less_the_reference_in_metres(tmp_path: Path) -> None:
    body = HINGE.format('<joint name="j" type="slide" axis="0 3 0" pos="9 9 9" ref="0.5"/>')
    assert read(tmp_path, body, joints={"j": "75cm"})[0].lookup("world", "a").xyz.tolist() == [1.0, 0.25, 0.0]


def test_joints_of_one_body_act_in_their_order_each_in_the_frame_that_the_others_moved(tmp_path: Path) -> None:
    joints = '<joint name="j" axis="0 0 1"/><joint name="k" type="slide" axis="1 0 0"/>'
    turned = {"j": "90deg", "k": 1.0}
    assert read(tmp_path, HINGE.format(joints), joints=turned)[0].lookup("world", "a").xyz == pytest.approx([1, 1, 0])
    swapped = joints.split("><", 1)
    joints = f"<{swapped[1]}{swapped[0]}>"
    assert read(tmp_path, HINGE.format(joints), joints=turned)[0].lookup("world", "a").xyz == pytest.approx([2, 0, 0])


def test_a_free_joint_takes_the_pose_in_the_world_and_a_ball_a_rotation_about_its_anchor(tmp_path: Path) -> None:
    free = HINGE.format('<freejoint name="j"/>')
    assert read(tmp_path, free)[0].lookup("world", "a").xyz.tolist() == [1, 0, 0]
    assert read(tmp_path, free, joints={"j": "{xyz: [5, 6, 7]}"})[0].lookup("world", "a").xyz.tolist() == [5, 6, 7]
    assert read(tmp_path, free, joints={"j": "{xyz: [0, 0, 0]}"})[0].lookup("world", "a").xyz.tolist() == [0, 0, 0]
    ball = HINGE.format('<joint name="j" type="ball" pos="1 0 0"/>')
    moved = read(tmp_path, ball, joints={"j": "{rpy_deg: [0, 0, 90]}"})[0]
    assert moved.lookup("world", "a").xyz == pytest.approx([2, -1, 0])


def test_frames_move_what_stands_in_them_and_are_none_themselves(tmp_path: Path) -> None:
    inside = '<frame pos="0 0 1" euler="90 0 0"><joint name="j" axis="0 1 0" pos="0.1 0.2 0.3"/><body name="c" pos="0 1 0"/></frame>'
    tree, _ = read(tmp_path, f'<frame pos="1 0 0"><body name="b">{inside}</body></frame>', joints={"j": 0.5})
    assert set(tree.frames) == {"world", "b", "c"}
    assert seen(tree, "c", "b") @ [0, 0, 0, 1] == pytest.approx([0, 0, 2, 1])
    assert seen(tree, "b") @ [0.1, -0.3, 1.2, 1] == pytest.approx([1.1, -0.3, 1.2, 1])  # anchor, as mujoco has it
    assert seen(tree, "b")[:3, :3] == pytest.approx(Rotation.from_rotvec([0, 0, 0.5]).as_matrix())


KEYS = """<mujoco><compiler angle="degree"/><worldbody>
<body name="base" pos="0 0 1"><freejoint name="root"/><body name="arm"><body name="hand"><joint name="grip" type="slide" ref="0.1"/></body>
<joint name="elbow" axis="0 0 1" ref="30"/></body><body name="head"><joint name="neck" type="ball"/></body></body>
</worldbody><keyframe><key name="home" qpos="1 2 3 2 0 0 0   0.5 0.25   0 0 0 9"/><key qpos="0 0 0 1 0 0 0 0 0 1 0 0 0"/></keyframe></mujoco>"""


def test_a_key_holds_values_of_all_joints_in_the_order_of_the_bodies(run: Callable[..., Any]) -> None:
    done = run("tree", "a.xml", "--joints", "a.xml:home", "-f", "json", files={"a.xml": KEYS})
    frames = {each["name"]: each for each in json.loads(done.out)["frames"]}
    assert frames["base"]["xyz"] == [1.0, 2.0, 3.0]
    assert frames["arm"]["quaternion"]["z"] == pytest.approx(math.sin((0.5 - math.radians(30)) / 2))  # elbow: radians
    assert frames["hand"]["xyz"] == [0.0, 0.0, 0.15]
    assert frames["head"]["quaternion"] == {"x": 0.0, "y": 0.0, "z": 1.0, "w": 0.0}
    assert "at rest" not in done.err
    assert run("lookup", "a.xml", "world", "hand", "--joints", "a.xml:1", "-f", "json").out.startswith('{"name": "hand"')
    partly = run("lookup", "a.xml", "arm", "hand", "--joints", "a.xml:home", "-j", "grip=0.1", "-f", "json")
    assert json.loads(partly.out)["xyz"] == [0.0, 0.0, 0.0]


def test_joints_move_over_time_where_a_file_of_values_has_stamps(run: Callable[..., Any]) -> None:
    rows = "stamp,elbow,grip\n0,0,0\n1,0.5,0.25\n"
    done = run("lookup", "a.xml", "base", "hand", "--joints", "v.csv", "--at", "1", "-f", "json", files={"a.xml": KEYS, "v.csv": rows})
    still = run("lookup", "a.xml", "base", "hand", "-j", "elbow=0.5", "-j", "grip=25cm", "-f", "json")
    assert {key: value for key, value in json.loads(done.out).items() if key != "stamp_ns"} == json.loads(still.out)


@pytest.mark.parametrize(
    ("key", "text", "said"),
    [
        ("a.xml", KEYS, "a.xml: name one of its keys: a.xml:home; keys: 1, home"),
        ("a.xml:hom", KEYS, "a.xml: no key 'hom'; did you mean 'home'? keys: 1, home"),
        ("a.xml:home", KEYS.replace("0 0 0 9", "0 0 0"), "a.xml:4:46: qpos: expected 13 numbers, found 12"),
        ("a.xml:home", KEYS.replace("0 0 0 9", "0 0 x 9"), "a.xml:4:46: qpos: 'x' is not a number"),
        ("a.xml:home", KEYS.replace("0 0 0 9", "0 0 0 0"), "a.xml:4:46: qpos of joint 'neck': 0 0 0 0 has no direction"),
        ("a.xml:home", KEYS.replace('qpos="1', 'qvel="1'), "a.xml:4:23: key 'home' has no qpos"),
        ("a.xml:home", KEYS.replace("keyframe", "nothing"), "a.xml: no <key> in it, which would have joint values"),
    ],
)
def test_a_key_that_does_not_fit_is_one_line(run: Callable[..., Any], key: str, text: str, said: str) -> None:
    done = run("tree", "a.xml", "--joints", key, "--quiet", files={"a.xml": text})
    assert done.status == 1
    assert done.err.splitlines()[0].startswith(f"frametool: {said}")


def test_values_beyond_the_range_are_told_where_the_range_applies(run: Callable[..., Any]) -> None:
    for limited, tells in (("", True), ('limited="true"', True), ('limited="false"', False)):
        body = HINGE.format(f'<joint name="j" range="-10 20" {limited}/>')
        text = f"<mujoco><worldbody>{body}</worldbody></mujoco>"
        done = run("tree", "a.xml", "-j", "j=30deg", files={"a.xml": text})
        assert ("joint 'j' is beyond its limits -0.174533 .. 0.349066 rad, 0.523599" in done.err) is tells


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ('<include file="b.xml"/>', "2:1: <include> is not expanded here; save it whole: mujoco.mj_saveLastXML('whole.xml', mujoco.MjModel.from_xml_path('FILE'))"),
        ('<body><replicate count="3"><body/></replicate></body>', "2:7: <replicate> is not expanded here; save it whole"),
        ('<frame><attach model="m" body="b"/></frame>', "2:8: <attach> is not expanded here; save it whole"),
        ('<site quat="0 0 0 0"/>', "2:13: quat: 0 0 0 0 has no direction"),
        ('<site zaxis="0 0 0"/>', "2:14: zaxis: 0 0 0 has no direction"),
        ('<site axisangle="0 0 0 1"/>', "2:18: axisangle: 0 0 0 has no direction"),
        ('<site xyaxes="1 0 0 1 0 0"/>', "2:15: xyaxes: 0 0 0 has no direction"),
        ('<site quat="1 0 0 0" euler="0 0 0"/>', "2:29: quat and euler in one element; keep one"),
        ('<site pos="1 2"/>', "2:12: pos: expected 3 numbers, found 2 in '1 2'"),
        ('<site pos="1,2,3"/>', "2:12: pos: expected 3 numbers, found 1 in '1,2,3'"),
        ('<site pos="1 2 nan"/>', "2:12: pos: 'nan' is not finite"),
        ('<body name="b"><joint axis="0 0 0"/></body>', "2:29: axis: 0 0 0 has no direction"),
        ('<body name="b"><joint type="hing"/></body>', "2:29: type 'hing'; expected hinge, slide, ball, free"),
        ('<site fromto="0 0 0 1 1 1"/>', "type 'sphere'; expected capsule, cylinder, box, ellipsoid"),
        ('<site type="box" pos="0 0 0" fromto="0 0 0 1 1 1"/>', "pos and fromto in one site; keep one"),
        ('<body name="a"/>\n<body name="a"/>', "3:13: body 'a' twice; first in line 2"),
        ('<site name="a"/><site name="a"/>', "2:29: site 'site:a' twice; first in line 2"),
        ('<body name="world"/>', "2:13: body 'world' twice, which is the name of the root"),
        ('<body name="b"><joint name="a"/><joint name="a"/></body>', "joint 'a' twice; first in line 2"),
        ('<body><body><freejoint name="f"/></body></body>', "joint 'f' is free: it belongs into a body directly in the world"),
        ('<body name="b"><freejoint/><joint name="j"/></body>', "joint 'j' beside others in body 'b', one of them free; keep that"),
        ('<body name="b"><joint name="j"/><freejoint name="f"/></body>', "joint 'f' beside others in body 'b', one of them free; keep that"),
        ("<joint/>", "2:1: the world has no joints; put it into a <body>"),
        ('<site class="x"/>', "2:14: no default class 'x'; classes: main"),
        ('<body childclass="mian"/>', "2:19: no default class 'mian'; did you mean 'main'? classes: main"),
        ("<body>", "2:9: not XML: mismatched tag"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line_with_its_place(run: Callable[..., Any], body: str, said: str) -> None:
    text = f"<mujoco><worldbody>\n{body}</worldbody>\n</mujoco>"
    done = run("tree", "a.xml", files={"a.xml": text})
    errors = [line for line in done.err.splitlines() if line.startswith("frametool: a.xml:")]
    assert (done.status, len(errors)) == (1, 1)
    assert said in errors[0] or errors[0].startswith(f"frametool: a.xml:{said}")
    assert len(errors[0]) < 200
    assert run("check", "a.xml").out.startswith("a.xml:")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<mujoco><include file="b.xml"/></mujoco>', "1:9: <include> is not expanded here"),
        ('<mujoco><default><include file="b.xml"/></default></mujoco>', "1:18: <include> is not expanded here"),
        ('<mujoco><compiler angle="deg"/></mujoco>', "1:26: angle 'deg'; expected degree, radian"),
        ('<mujoco><compiler eulerseq="xyw"/></mujoco>', "1:29: eulerseq 'xyw'; expected three of xyz"),
        ('<mujoco><compiler coordinate="global"/></mujoco>', "1:31: coordinate=global; MuJoCo reads it no more"),
        ('<mujoco><default class="foo"/></mujoco>', "1:25: the outermost default class is called main, found 'foo'"),
        ("<mujoco><default><default/></default></mujoco>", "1:18: a <default> without class"),
        ('<mujoco><default><default class="a"/><default class="a"/></default></mujoco>', "default class 'a' twice"),
        ('<mujoco><default><default class="a"><joint axis="1 x 0"/></default></default>\n<worldbody><body><joint class="a"/></body></worldbody></mujoco>', "1:50: axis: 'x' is not a number"),
        ("<mujoco/>", " no frames in it"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_model_is_placed_also_where_it_is_a_default(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(FormatError) as caught:
        read_all(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path}/a.xml:{said}") or said in str(caught.value)


def test_a_thousand_bodies_inside_one_another_are_read(tmp_path: Path) -> None:
    body = "".join(f'<body name="b{n}" pos="0 0 1">' for n in range(5000)) + "</body>" * 5000
    assert read(tmp_path, body)[0].lookup("world", "b4999").xyz.tolist() == [0.0, 0.0, 5000.0]


def test_what_cannot_be_known_from_the_file_alone_is_said(tmp_path: Path) -> None:
    _, said = read(tmp_path, '<camera name="c" mode="targetbody" target="b"/><body name="b"/>\n<flexcomp/>')
    assert said[0] == "a.xml:2: camera:c has the mode 'targetbody', in which MuJoCo rotates it over time; its pose is as written"
    assert said[1].startswith("a.xml:3: <flexcomp> is left out: its bodies are made by MuJoCo; save it whole: mujoco.")


def test_what_was_read_is_said_once(run: Callable[..., Any]) -> None:
    done = run("lookup", "a.xml", "world", "hand", files={"a.xml": KEYS})
    assert done.err == "frametool: a.xml: 4 joints at rest (--joint NAME=VALUE)\n"


@pytest.mark.parametrize(
    "text",
    [
        '<mujoco><compiler alignfree="true"/><worldbody><body name="a"><freejoint/></body></worldbody></mujoco>',
        '<mujoco><worldbody><body name="a"><freejoint align="true"/></body></worldbody></mujoco>',
    ],
)
def test_a_frame_that_mujoco_moves_onto_its_inertia_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FormatError, match="alignfree: MuJoCo moves this body's frame onto its inertia"):
        read_all(tmp_path, text)
