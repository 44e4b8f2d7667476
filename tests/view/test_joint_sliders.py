"""Joints with a slider on the page: the numbers of the page are those of `lookup --joint`."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import browsers
import pytest
from chromium import NEEDS_CHROMIUM
from console import ROOT

import frametool
from frametool.view.exports import SCRIPTS, WITH_JOINTS

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

ARM = ROOT / "examples" / "arm.urdf"
MOVED = {"shoulder_pan": 0.5, "elbow": -1.25, "wrist_roll": 3.0, "gripper": 0.02}


def page(folder: Path, *more: str) -> Path:
    path = folder / "arm.html"
    command = [sys.executable, "-m", "frametool", "view", str(ARM), "--sliders", "--quiet", "-o", str(path), *more]
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
    assert set(WITH_JOINTS) - set(SCRIPTS) == {"joints"}


@pytest.mark.parametrize("arguments", [("-o", "x.svg"), ("-f", "text"), ()])
def test_sliders_need_a_page(run: Callable[..., Any], arguments: tuple[str, ...]) -> None:
    done = run("view", str(ARM), "--sliders", *arguments)
    assert done.status == 2
    assert "--sliders move the joints of a robot on a page" in done.err


def test_what_has_no_joints_has_no_sliders(run: Callable[..., Any]) -> None:
    done = run("view", str(ROOT / "examples" / "robot.yaml"), "--sliders", "-f", "html")
    assert done.status == 1
    assert "expected a URDF robot" in done.err
