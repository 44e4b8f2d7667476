"""Poses as people see them: how many digits, how wide, and what the 24 Euler conventions say."""

from __future__ import annotations

import base64
import itertools
import json
import math
import random
import re
from typing import TYPE_CHECKING, Protocol

import pytest
from console import ROOT

import frametool
from frametool.errors import ValueInvalid
from frametool.geometry import euler, floats
from frametool.geometry.conventions import find_euler
from frametool.geometry.representations import ROTATIONS
from frametool.geometry.transform import Rotation

if TYPE_CHECKING:
    from conftest import Outcome

    class Run(Protocol):
        def __call__(self, *arguments: str, stdin: str = ..., files: dict[str, str] | None = None) -> Outcome: ...


SPECS = ["", *(row.spelling.replace("AXES", "rzyx") for row in ROTATIONS.values()), "euler:all", "rpy_deg,matrix"]


def hostile(seed: int) -> str:
    rng = random.Random(seed)  # noqa: S311 - poses to show, nothing to hide
    size = 10.0 ** rng.randrange(-9, 9)
    angles = [rng.choice([0.0, 90.0, -180.0, rng.uniform(-180.0, 180.0)]) for _ in range(3)]
    return json.dumps({"xyz": [rng.uniform(-size, size) for _ in range(3)], "rpy_deg": angles})


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("width", [80, 120])
def test_no_line_passes_the_terminal(run: Run, monkeypatch: pytest.MonkeyPatch, spec: str, width: int) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    for seed, precision in itertools.product(range(5), [(), ("--precision", "full"), ("--precision", "12")]):
        text = run("convert", hostile(seed), "-f", "text", *(("--to", spec) if spec else ()), *precision).out
        assert max(map(len, text.splitlines())) <= width, text


def test_an_overview_has_six_decimals_and_no_noise(run: Run) -> None:
    text = run("convert", "{xyz: [-1e-17, 9.999999999999998, -0.0], rpy: [0, 0, 1e-16]}", "-f", "text").out
    numbers = [word for word in text.split() if "." in word]
    assert all(len(number.partition(".")[2]) == 6 for number in numbers)
    assert "10.000000" in numbers
    assert "-0.000000" not in numbers
    assert "e-" not in text


@pytest.mark.parametrize("spec", ["quaternion", "rpy", "matrix", "euler:rzyx"])
def test_one_notation_is_shown_with_all_its_digits(run: Run, spec: str) -> None:
    shown = run("convert", hostile(3), "--to", spec, "-f", "text").out
    exact = run("convert", hostile(3), "--to", spec, "-f", "csv").out.splitlines()[1]
    words = shown.split()
    assert all(number in words for number in exact.split(",") if abs(float(number)) not in (0.0, 1.0))


def test_precision_decides_otherwise(run: Run) -> None:
    assert "0.7071067811865476" in run("convert", "{rpy_deg: [0, 0, 90]}", "-f", "text", "--precision", "full").out
    assert "0.71 " in run("convert", "{rpy_deg: [0, 0, 90]}", "-f", "text", "--precision", "2").out + " "
    assert run("convert", "{rpy_deg: [0, 0, 90]}", "-f", "json", "--precision", "full").out == (
        run("convert", "{rpy_deg: [0, 0, 90]}", "-f", "json").out
    )
    assert run("convert", "{rpy_deg: [0, 0, 90]}", "--precision", "many").status == 2


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_all_conventions_are_listed_and_read_back(run: Run, form: str) -> None:
    text = run("convert", '{"rpy_deg": [10, 20, 30]}', "--to", "euler:all", "-f", form).out
    back = json.loads(run("convert", "-", "--to", "rpy_deg,euler:all", "-f", "json", stdin=text).out)
    assert len(back["euler"]) == len(euler.AXES)
    assert [back["rpy_deg"][name] for name in ("roll", "pitch", "yaw")] == pytest.approx([10.0, 20.0, 30.0])


def test_conventions_that_disagree_are_refused(run: Run) -> None:
    two = '{"euler": [{"axes": "rxyz", "angles": [1, 0, 0]}, {"axes": "rzyx", "angles": [1, 0, 0]}]}'
    outcome = run("invert", two)
    assert outcome.status != 0
    assert "two rotations in one entry disagree" in outcome.err


@pytest.mark.parametrize("axes", sorted(euler.AXES))
def test_the_convention_of_given_angles_is_found(axes: str) -> None:
    angles = (0.3, -0.7, 1.1)
    rotation = Rotation.of(*euler.to_quaternion(*angles, axes, floats))
    assert axes in find_euler(rotation, angles)
    with pytest.raises(ValueInvalid, match="no Euler convention gives these angles within 1e-06 rad"):
        find_euler(rotation, (0.3, -0.7, 1.2))


def test_the_command_shows_the_conventions_it_found(run: Run) -> None:
    pose = "{rpy_deg: [10, 20, 30]}"
    found = json.loads(run("convert", pose, "--find", "30,20,10", "--deg", "-f", "json").out)
    assert [found["euler_deg"]["axes"], found["euler_deg"]["angles"]] == ["rzyx", pytest.approx([30.0, 20.0, 10.0])]
    radians = ",".join(repr(math.radians(angle)) for angle in (30, 20, 10))
    assert "euler rzyx" in run("convert", pose, "--find", radians, "-f", "text").out
    assert run("convert", pose, "--find", "31,20,10", "--deg").status == 1
    assert run("convert", pose, "--find", "31,20,10", "--deg", "--tolerance", "0.02").status == 0
    for wrong in ("1,2", "1,2,x", "1,2,3,4"):
        assert run("convert", pose, "--find", wrong).status == 2


def test_drawings_show_no_noise(run: Run) -> None:
    tree = "frames: {a: {b: {xyz: [1e-16, 9.999999999999998, 2e-5], rpy_deg: [0, -1e-14, 90]}}}"
    assert "b  xyz 0 10 2.0e-05  rpy_deg 0 0 90\n" in run("tree", "-", "-f", "text", stdin=tree).out


def test_notebooks_show_what_a_terminal_shows() -> None:
    pose = frametool.Transform.from_parts(xyz=[1, 2, 3], rpy_deg=[0, 0, 90])
    for value in (pose, pose.rotation):
        text = value._repr_html_() or ""
        assert re.search("quaternion +x 0.000000 +y 0.000000 +z 0.707107 +w 0.707107\n", re.sub(" +", " ", text))
        assert ("translation" in text) == (value is pose)
    assert frametool.Transform.from_arrays([[1, 2, 3]], [[0, 0, 0, 1]])._repr_html_() is None
    tree = frametool.load(ROOT / "examples" / "robot.yaml")
    assert base64.b64decode((tree._repr_html_() or "").partition("base64,")[2][:-2]).startswith(b"<svg ")
    assert frametool.FrameTree()._repr_html_() is None
    ref, est = (frametool.load_trajectory(ROOT / "examples" / f"{name}.tum") for name in ("truth", "odometry"))
    assert re.fullmatch(r"<pre>600 poses of \w+ in \w+, [\d.]+ m of path</pre>", ref._repr_html_() or "")
    assert (frametool.compare(ref, est)._repr_html_() or "").startswith("<pre>ref ")
