"""`check --measured`: each measurement against the tree, and what it would fit as."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from frametool.fit.blunders import BLUNDERS, Measurement
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

ANGLES = (0.4, -0.3, 1.1)
TREE = """frames:
  base:
    lidar: {xyz: [1, 0.4, 2], rpy: [0.4, -0.3, 1.1]}
    camera: {xyz: [0.3, 0, 1.2], rpy_deg: [0, 20, 0]}
"""
GOOD = "- {parent: base, child: lidar, xyz: [1.001, 0.4, 2], rpy: [0.4, -0.3, 1.1]}\n"


def row(transform: Transform, more: str = "") -> str:
    x, y, z, *turn = transform.components
    return f"- {{parent: base, child: lidar, xyz: {[x, y, z]}, xyzw: {turn}{more}}}\n"


def checked(run: Run, rows: str, *options: str, tree: str = TREE) -> Outcome:
    return run("check", "tree.yaml", "--measured", "m.yaml", *options, files={"tree.yaml": tree, "m.yaml": rows})


def test_measurements_that_agree_have_no_findings(run: Run) -> None:
    between = "- {parent: lidar, child: camera, inverse: true, xyz: [0, 0, 0]}\n"
    assert checked(run, GOOD) == (0, "", "")
    assert "1 warning" in checked(run, GOOD + between).err


def test_what_is_off_is_said_with_its_place_and_how_far(run: Run) -> None:
    found = checked(run, GOOD + GOOD.replace("1.001", "1.1"))
    assert found == (0, "m.yaml:2: warning: base<-lidar is 100.0 mm 0.0 deg off the tree [loop]\n", "frametool: 1 warning\n")
    assert checked(run, GOOD + GOOD.replace("1.001", "1.1"), "--strict").status == 1
    (one,) = map(json.loads, checked(run, GOOD.replace("1.001", "1.1"), "-f", "json").out.splitlines())
    assert (one["file"], one["line"], one["level"], one["rule"]) == ("m.yaml", 1, "warning", "loop")
    assert checked(run, GOOD.replace("1.001", "1.1"), "-f", "github").out.startswith("::warning file=m.yaml,line=1,title=loop::")


@pytest.mark.parametrize("words", BLUNDERS)
def test_each_blunder_is_named(run: Run, words: str) -> None:
    true = Transform(Rotation.from_rpy(ANGLES), (1.0, 0.4, 2.0))
    back = {
        "inverted": row(true.inverse()),
        "rotation inverted": row(Transform(true.rotation.inverse(), true.components[:3])),
        "translation of the inverse": row(Transform(true.rotation, true.inverse().components[:3])),
        "wxyz taken for xyzw": row(Transform.of(*true.components[:3], true.components[6], *true.components[3:6])),
        "xyzw taken for wxyz": row(Transform.of(*true.components[:3], *true.components[4:], true.components[3])),
        "millimetres": row(Measurement("", "", true.components).rescaled(1000.0)),
        "metres taken for millimetres": row(Measurement("", "", true.components).rescaled(0.001)),
        "degrees taken for radians": GOOD.replace("[0.4, -0.3, 1.1]", "[22.918, -17.189, 63.025]"),
        "radians taken for degrees": GOOD.replace("rpy", "rpy_deg"),
        "yaw, pitch, roll taken for roll, pitch, yaw": GOOD.replace("[0.4, -0.3, 1.1]", "[1.1, -0.3, 0.4]"),
    }
    if words not in back:
        words_of = BLUNDERS[words]
        # the opposite change of axes undoes each of these
        undone = {"optical axes of the child": "body axes of the child", "body axes of the child": "optical axes of the child",
                  "optical axes of the parent": "body axes of the parent", "body axes of the parent": "optical axes of the parent"}
        made = BLUNDERS[undone[words]](Measurement("", "", true.components))
        assert made is not None
        assert (again := words_of(Measurement("", "", made.components))) is not None
        assert again.is_close(true, angle=1e-12, distance=1e-12)
        back[words] = row(made)
    assert f"; fits when {words} [loop]" in checked(run, back[words]).out


def test_own_sigmas_count_unless_a_tolerance_is_said(run: Run) -> None:
    sure = GOOD.replace("}", ", sigma: {xyz_mm: 0.1, rpy_deg: 1}}")
    vague = GOOD.replace("1.001", "1.1").replace("}", ", sigma: {xyz: 0.1, rpy_deg: 1}}")
    assert checked(run, sure).out == "m.yaml:1: warning: base<-lidar is 1.0 mm 0.0 deg (4.1 sigmas) off the tree [loop]\n"
    assert checked(run, vague).out == ""
    assert checked(run, sure, "--tolerance", "2mm").out == ""
    assert "100.0 mm 0.0 deg off" in checked(run, vague, "--tolerance", "2mm,1deg").out
    turned = GOOD.replace("1.1]", "1.11]")
    assert checked(run, turned, "--tolerance", "2mm").out == ""  # 1 deg holds where no angle is said
    assert "0.6 deg off" in checked(run, turned, "--tolerance", "2mm,0.1deg").out


def test_frames_that_cannot_be_compared_are_told_once(run: Run) -> None:
    rows = "".join(f"- {{parent: base, child: {name}, xyz: [1, 2, 3]}}\n" for name in ("tag", "tag", "robot"))
    found = checked(run, rows, tree=TREE + "  map:\n    base_link: {xyz: [1, 2, 3]}\n")
    assert found.err.startswith("frametool: warning: frames that the tree does not have, or that move; not compared: robot, tag\n")
    apart = "- {parent: base, child: base_link, xyz: [1, 2, 3]}\n"
    found = checked(run, GOOD + apart, tree=TREE + "  map:\n    base_link: {xyz: [1, 2, 3]}\n")
    assert "1 of 2 measurements not compared: their frames are not connected by static frames" in found.err


def test_what_moves_is_not_compared_and_what_is_wrong_in_the_tree_is_said_too(run: Run) -> None:
    moves = "frames: [{name: lidar, parent: base, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0]}]}]"
    assert "or that move; not compared: base, lidar" in checked(run, GOOD, tree=moves).err
    twice = "[{name: lidar, parent: base, xyz: [1, 0.4, 2], rpy: [0.4, -0.3, 1.1]}, {name: lidar, parent: x, xyz: [1, 0, 0]}]"
    found = checked(run, GOOD, tree=twice)
    assert (found.status, "[two-parents]" in found.out, "[loop]" in found.out) == (1, True, False)


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        (("--tolerance", "1mm"), 2, "--tolerance needs --measured"),
        (("--measured", "m.yaml", "--tolerance", "much"), 2, "write a length, an angle or both: 1mm,0.1deg"),
        (("--measured", "none.yaml"), 5, "none.yaml"),
        (("--measured", "tree.yaml", "--measured", "bad.yaml"), 1, "bad.yaml:1: missing parent"),
        (("--measured", "-", "-"), 2, "standard input can be read once"),
    ],
)
def test_bad_options_and_files_are_refused_in_one_line(run: Run, options: tuple[str, ...], status: int, message: str) -> None:
    files = {"tree.yaml": TREE, "m.yaml": GOOD, "bad.yaml": "[{child: a, xyz: [1, 2, 3]}]"}
    found = run("check", "tree.yaml", *options, files=files)
    assert (found.status, found.out) == (status, "")
    assert message in found.err


def test_a_tree_agrees_with_itself(run: Run) -> None:
    assert run("check", "tree.yaml", "--measured", "tree.yaml", files={"tree.yaml": TREE}) == (0, "", "")
    assert run("check", "tree.yaml", "--measured", "-", stdin=TREE, files={"tree.yaml": TREE}) == (0, "", "")
