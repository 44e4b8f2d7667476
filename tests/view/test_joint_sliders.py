"""Robots on the page: joints with a slider, whose numbers are those of `lookup --joint`, and solids."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from contextlib import closing
from typing import TYPE_CHECKING, Any

import browsers
import pytest
from chromium import NEEDS_CHROMIUM
from console import ROOT

import frametool
from frametool.documents.source import InputFile
from frametool.formats.robots.model import Solid, read_solids
from frametool.view.exports import EXTRAS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

ARM = ROOT / "examples" / "arm.urdf"
MOVED = {"shoulder_pan": 0.5, "elbow": -1.25, "wrist_roll": 3.0, "gripper": 0.02}


def page(folder: Path, *more: str) -> Path:
    path = folder / "arm.html"
    command = [sys.executable, "-m", "frametool", "view", str(ARM), "--quiet", "-o", str(path), *more]
    subprocess.run(command, check=True)
    return path


def joints_of(path: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(re.search(r'id="head-data">(.*?)</script>', path.read_text())[1])["joints"]  # type: ignore[index]
    return found


def test_each_joint_has_its_limits_its_value_and_the_one_it_follows(tmp_path: Path) -> None:
    joints = {each["name"]: each for each in joints_of(page(tmp_path, "-j", "elbow=0.5", "-j", "gripper=1cm"))}
    assert (joints["elbow"]["lower"], joints["elbow"]["upper"], joints["elbow"]["value"]) == (-2.4, 2.4, 0.5)
    assert joints["wrist_roll"]["lower"] is None
    assert joints["gripper_right"]["mimic"] == [list(joints).index("gripper"), 1.0, 0.0]
    assert joints["gripper_right"]["value"] == 0.01


@NEEDS_CHROMIUM
@pytest.mark.parametrize("source", ["tool", "right_finger"])
def test_the_page_moves_its_joints_as_lookup_does(tmp_path: Path, source: str) -> None:
    told = ",".join(f"{name}={value}" for name, value in MOVED.items())
    seen = browsers.seen_in_chromium(page(tmp_path), f"target=arm_base&source={source}&joints={told}")
    pose = json.loads(re.search('data-pose="([^"]*)"', seen)[1])  # type: ignore[index]
    expected = frametool.load(ARM, joints=MOVED).lookup("arm_base", source)
    assert pose == pytest.approx(list(expected.components), abs=1e-13)


def test_a_page_without_joints_has_no_script_for_them(tmp_path: Path) -> None:
    (tmp_path / "tree.yaml").write_text("{frames: {map: {a: {xyz: [1, 0, 0]}}}}")
    text = browsers.make_page(tmp_path, "robot.yaml").read_text()
    assert "window.joints" not in text
    assert EXTRAS == ("joints", "solids")


@pytest.mark.parametrize("arguments", [("robot.yaml",), ("arm.urdf", "--no-sliders")])
def test_what_has_no_joints_or_wants_none_has_no_sliders(run: Callable[..., Any], arguments: tuple[str, ...]) -> None:
    done = run("view", str(ROOT / "examples" / arguments[0]), *arguments[1:], "-f", "html")
    assert done.status == 0
    assert "set_joint" not in done.out


def test_the_option_for_sliders_went_with_a_word_on_the_new_one(run: Callable[..., Any]) -> None:
    done = run("view", str(ARM), "--sliders", "-o", "x.html")
    assert done.status == 2
    assert "--no-sliders" in done.err


FINGER = {"knuckle": 0.7, "tip_joint": -0.4}


@NEEDS_CHROMIUM
@pytest.mark.parametrize(("robot", "ends", "joints"), [("finger.xml", ("palm", "site:tip"), FINGER), ("lift.sdf", ("base", "camera"), {"hoist": 0.3})])
def test_joints_of_other_robots_move_as_lookup_moves_them(run: Callable[..., Any], tmp_path: Path, robot: str, ends: tuple[str, str], joints: dict[str, float]) -> None:
    """MJCF has anchors and references, SDF poses behind its joints."""
    source = ROOT / "examples" / robot
    tree = frametool.load(source, joints=joints)
    base, tip = (next(name for name in tree.frames if name.rsplit("::", 1)[-1] == end) for end in ends)
    assert run("view", str(source), "-o", "robot.html").status == 0
    told = ",".join(f"{name}={value}" for name, value in joints.items())
    seen = browsers.seen_in_chromium(tmp_path / "robot.html", f"target={base}&source={tip}&joints={told}")
    pose = json.loads(re.search('data-pose="([^"]*)"', seen)[1])  # type: ignore[index]
    assert pose == pytest.approx(list(tree.lookup(base, tip).components), abs=1e-13)


@pytest.fixture
def tab(browser: Any, tmp_path: Path) -> Iterator[Any]:
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    tab = context.new_page()
    tab.goto(f"file://{page(tmp_path, '-j', 'elbow=0.5')}")
    tab.wait_for_selector("html[data-ready]", state="attached")
    yield tab
    context.close()


def test_a_slider_shows_its_name_its_value_in_its_unit_and_its_limits(tab: Any) -> None:
    rows = {row.locator("span").inner_text(): row for row in tab.locator("#sliders label").all()}
    assert {*rows} == {"shoulder_pan", "shoulder_lift", "elbow", "wrist_roll", "gripper", "gripper_right"}
    for name, row in rows.items():
        span, slider = row.locator("span").bounding_box(), row.locator("input").bounding_box()
        assert span["width"] > 6 * len(name)
        assert span["x"] + span["width"] <= slider["x"]
    assert rows["elbow"].locator("output").inner_text() == "28.6°"
    assert rows["elbow"].locator("i").all_inner_texts() == ["-137.5°", "137.5°"]
    assert rows["gripper"].locator("i").all_inner_texts() == ["0.0 mm", "40.0 mm"]


def test_moving_a_slider_moves_what_follows_and_home_is_where_the_page_began(tab: Any) -> None:
    tab.evaluate("() => { window.copied = []; navigator.clipboard.writeText = async (text) => { window.copied.push(text); }; }")
    tab.locator("input[aria-label=gripper]").fill("0.03")
    tab.locator("input[aria-label=gripper]").dispatch_event("change")
    assert tab.locator("label:has(input[aria-label=gripper_right]) output").inner_text() == "30.0 mm"
    assert "joints=gripper%3D0.03" in tab.url
    tab.click("#shell")
    assert tab.evaluate("() => window.copied[0]").endswith(" -j elbow=0.5 -j gripper=0.03")
    tab.click("#home")
    assert tab.evaluate("() => window.joints.values") == [0, 0, 0.5, 0, 0, 0]
    assert "joints=" not in tab.url


# --- solids -----------------------------------------------------------------------------------------------------------

SHAPES = """<robot name="bot"><link name="base"><visual><origin xyz="0 0 0.1"/><geometry><box size="0.5 0.35 0.2"/></geometry></visual></link>
<link name="mast"><visual><geometry><mesh filename="package://bot/mast.stl"/></geometry></visual>
<collision><origin xyz="0 0 0.2"/><geometry><capsule radius="0.03" length="0.4"/></geometry></collision></link>
<link name="tool"><visual><geometry><mesh filename="package://bot/tool.stl"/></geometry></visual></link>
<joint name="lean" type="continuous"><origin xyz="-0.1 0 0.2"/><parent link="base"/><child link="mast"/></joint>
<joint name="mount" type="fixed"><origin xyz="0 0 0.5"/><parent link="mast"/><child link="tool"/></joint></robot>"""
MODEL = """<sdf version="1.9"><model name="m"><pose>1 0 0 0 0 0</pose><link name="a"><visual name="v"><pose degrees="true">0 0 1 0 90 0</pose>
<geometry><cylinder><radius>0.1</radius><length>2</length></cylinder></geometry></visual></link></model></sdf>"""
GEOMS = """<mujoco><default><geom type="capsule" size="0.02"/></default><worldbody><geom type="plane" size="1 1 1"/><body name="b">
<geom fromto="0 0 1 0 0 0"/><geom type="box" size="1 2 3" pos="0 0 1"/><geom type="sphere" size="0.5" group="3"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(("form", "text", "expected"), [
    ("urdf", SHAPES, [Solid("base", "box", (0.5, 0.35, 0.2), (0, 0, 0.1, 0, 0, 0, 1)), Solid("mast", "capsule", (0.03, 0.4), (0, 0, 0.2, 0, 0, 0, 1)), Solid("tool", "mesh", ())]),
    ("sdf", MODEL, [Solid("m::a", "cylinder", (0.1, 2.0), (0, 0, 1, 0, 0.5**0.5, 0, 0.5**0.5))]),
    ("sdf", MODEL.replace("<radius>0.1</radius><length>2</length>", "<length>2</length><radius>0.1</radius>"), [Solid("m::a", "cylinder", (0.1, 2.0), (0, 0, 1, 0, 0.5**0.5, 0, 0.5**0.5))]),
    ("mjcf", GEOMS, [Solid("b", "capsule", (0.02, 1.0), (0, 0, 0.5, 0, 0, 0, 1)), Solid("b", "box", (2, 4, 6), (0, 0, 1, 0, 0, 0, 1))]),
])  # fmt: skip
def test_solids_are_read_with_their_sizes_and_poses(tmp_path: Path, form: str, text: str, expected: list[Solid]) -> None:
    (tmp_path / "robot").write_text(text)
    with closing(InputFile(str(tmp_path / "robot"))) as file:
        found = read_solids(file, form)
    assert [(each.frame, each.kind) for each in found] == [(each.frame, each.kind) for each in expected]
    for each, wanted in zip(found, expected, strict=True):
        assert [*each.size, *each.pose] == pytest.approx([*wanted.size, *wanted.pose])


def test_a_mesh_is_a_box_as_far_as_the_frames_on_it_and_that_is_said(run: Callable[..., Any], tmp_path: Path) -> None:
    done = run("view", "bot.urdf", "-o", "bot.html", files={"bot.urdf": SHAPES.replace("collision>", "other>")})
    assert "note: 2 meshes drawn as boxes; mesh files are not read" in done.err
    head = json.loads(re.search('id="head-data">(.*?)</script>', (tmp_path / "bot.html").read_text())[1])  # type: ignore[index]
    mast = head["solids"][1]
    assert (mast["kind"], mast["size"][2], mast["pose"][:3]) == ("box", 0.5, [0, 0, 0.25])
    assert head["meshes"] == 2


def test_a_solid_that_cannot_be_read_keeps_no_page_back(run: Callable[..., Any]) -> None:
    done = run("view", "bot.urdf", "-o", "bot.html", files={"bot.urdf": SHAPES.replace("0.5 0.35 0.2", "0.5 0.35")})
    assert done.status == 0
    assert "note: solids not drawn: bot.urdf:1:89: size: expected 3 numbers, found 2 in '0.5 0.35'" in done.err


PAINTED = """() => {
  window.frameview.draw();
  const canvas = document.querySelector("#view"), {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.filter((value, at) => at % 4 === 0 && value < 245).length / (data.length / 4);
}"""


@pytest.mark.parametrize("count", [8, 12])
def test_solids_are_drawn_under_the_frames_and_many_faces_only_if_asked_for(run: Callable[..., Any], tmp_path: Path, browser: Any, count: int) -> None:
    ball = '<visual><geometry><sphere radius="0.3"/></geometry></visual>'
    assert run("view", "ball.urdf", "-o", "ball.html", files={"ball.urdf": f'<robot name="r"><link name="a">{ball * count}</link></robot>'}).status == 0
    tab = browser.new_page(color_scheme="light")
    tab.goto(f"file://{tmp_path / 'ball.html'}")
    tab.wait_for_selector("html[data-ready]", state="attached")
    is_little = tab.evaluate("window.solids.FACES.length") <= 2000
    painted = []
    for _ in range(2):
        painted.append(tab.evaluate(PAINTED) > 0.1)
        tab.click("#tools button:text-is('solids')")
    assert (is_little, painted) == ((True, [True, False]) if count == 8 else (False, [False, True]))
    tab.close()
